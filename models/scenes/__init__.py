"""Surroundings of a block: walls, restraints and beds, as frozen dataclasses in SI units."""
