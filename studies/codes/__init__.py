"""What a building code asks of the pieces of an inventory: who must be anchored, for which force, and is it enough."""
