"""What stands around a block or holds it: walls and restraints, as frozen dataclasses in SI units."""
