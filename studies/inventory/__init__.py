"""Inventories: the pieces of a building as lines of a table, what their falling means, and the kits that hold them."""
