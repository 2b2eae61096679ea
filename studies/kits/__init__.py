"""Kits on the pieces of an inventory: what falls with each and what it saves, and the sets that are best to buy."""
