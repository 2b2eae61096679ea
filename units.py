"""Physical constants and the units that labelled arrays carry (SI and radians, written the CF way)."""

from typing import Final

STANDARD_GRAVITY: Final = 9.80665
"""Standard acceleration of gravity, m/s² (CGPM 1901)."""

DIMENSIONLESS: Final = "1"
METRE: Final = "m"
SECOND: Final = "s"
RADIAN: Final = "rad"
VELOCITY: Final = "m s-1"
ACCELERATION: Final = "m s-2"
ANGULAR_VELOCITY: Final = "rad s-1"
ANGULAR_ACCELERATION: Final = "rad s-2"
RATE: Final = "s-1"
