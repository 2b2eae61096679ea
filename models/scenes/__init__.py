"""What stands around a block, holds it or lies under it: walls, restraints, beds; frozen dataclasses in SI units."""
