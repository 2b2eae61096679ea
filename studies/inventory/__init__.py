"""Inventories: the pieces of a building as lines of a table, the consequences of falls, and the kits that hold them."""
