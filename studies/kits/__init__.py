"""Kits on the pieces of an inventory: falls and savings with each, and the best sets to buy."""
