"""Columns of the arrays of the sliding engine."""

from typing import Any, NamedTuple

BARE: dict[str, Any] = {"_nrt": False}
"""Options of kernels that allocate nothing."""
LANES = 128
"""Runs in lockstep."""
# Rows of lanes in one flat array, so that compilers know that they do not overlap. The state of each run: its direction
# (SIGN, 0 at rest), its speed in that direction, the way since it began to slide and the slip before. Then columns that
# become results.
SPEED, WAY, SIGN, SLIP, FORWARD, BACKWARD, PATH, FASTEST, SLIPS, FIRST = (LANES * row for row in range(10))
# Its factor, and its static and kinetic friction towards the front and the back.
FACTOR, STATIC_FRONT, STATIC_BACK, KINETIC_FRONT, KINETIC_BACK = (LANES * row for row in range(10, 15))
# Needs of a sample, all zero at rest: changes of speed over one sample. They are by a floor acceleration of 1 (PUSH),
# by friction (DRAG), and by friction under a weight per mass of 1 (GRIP).
PUSH, DRAG, GRIP = (LANES * row for row in range(15, 18))
# The acceleration of the record that just starts the block (LEVEL, infinite while it slides; STILL, at rest). Then the
# friction that a vertical acceleration adds to it (HOLD).
LEVEL, STILL, HOLD = (LANES * row for row in range(18, 21))
# The speed with which the block has met an obstacle, below 0 before.
MET = LANES * 21
ROWS = 22
COEFFICIENTS = 4
"""Columns of a run's friction: static towards the front and the back, kinetic towards the front and the back."""
# Results of a run.
OUT_PEAK, OUT_FORWARD, OUT_BACKWARD, OUT_RESIDUAL, OUT_PATH, OUT_SPEED, OUT_SLIPS, OUT_FIRST, OUT_AFTER = range(9)
OUT_COLUMNS = 9
OUT_MET = 9
"""One more column, of runs towards an obstacle."""
HISTORY_SPEED, HISTORY_SLIP = range(2)
HISTORY_ROWS = 2
EVENTS = 8
"""Most events of a sample; there are four at most.

While a block slides, the push less friction is at least the excess over static friction, a straight line. A slide that
begins where that line crosses zero therefore lasts to the end of the sample. A slide that begins at once may stop only
if its line falls. The two directions' lines have a negative sum, and a block that stops does not slide on. After the
stop of an earlier slide, each direction therefore begins at once and stops one time at most.
"""
LATEST = 1.0 - 2.0**-52
"""Latest start of a slide as a part of the time that is left: it has some time to move in."""
ROUNDING = 1e-15
"""Error of an acceleration between two samples as a part of their sum."""
NEARLY = 1.0 - 1e-14
"""Share of a threshold by which samples are marked: thresholds of the sample itself are rounded in another way."""
GRAVITY = 9.80665


class Shaking(NamedTuple):
    """One record: horizontal and vertical acceleration (n,), m/s²; `vertical` is empty if there is none."""

    horizontal: Any
    vertical: Any
    dt: float
