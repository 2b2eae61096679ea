"""Inventories in buildings: their joint outcomes under each motion, the consequences, and the savings of anchoring."""
