"""Columns of the arrays of blocks that slide in the plane of the floor."""

from typing import Any, NamedTuple

import numpy as np

# The state of a run: its slip and its velocity along the width and along the depth, and 1 if it slides. Last the
# direction in which it slid straight to its last stop.
X, Y, VX, VY, SLIDING, LAST_X, LAST_Y = range(7)
# Columns that become results: extremes of the slip along the width, largest distance, way, largest speed, slips, first
# slip.
MOST_FRONT, MOST_BACK, FARTHEST, WAY, FASTEST, NUMBER, FIRST = range(7, 14)
STATE = 14
# Rows of the series of a piece: speed, direction, and velocity; and the push in the direction, of starts alone.
SPEED, ALONG, ACROSS, VELOCITY_X, VELOCITY_Y, PUSHED = range(6)
SERIES = 6
ORDER = 14
"""Order of the series."""
TERMS = ORDER + 1
SHARES = 1.0 / np.arange(1.0, TERMS + 1.0)
"""Factor of t^(k+1) in the integral of t^k."""
FRICTION_COLUMNS = 2
"""Columns of a run's friction: static and kinetic."""
# Results of a run: the columns of one direction, and the two components of the residual slip.
OUT_RESIDUAL_X, OUT_RESIDUAL_Y = 9, 10
OUT_COLUMNS = 11
# Rows of a history: slip and velocity along the width and along the depth.
HISTORY_X, HISTORY_Y, HISTORY_VX, HISTORY_VY = range(4)
HISTORY_ROWS = 4
TOLERANCE = 1e-12
"""Largest size of the last two terms of a series, m/s; friction takes errors of the velocity away again."""
STRAIGHT = 1e-14
"""Push across the direction of the slip, as a part of friction, up to which a block slides straight on."""
SLOW = 1e-7
"""Speed below which a block stops if its stop is nearer than `SOON`, m/s: it moves on by less than 1e-13 m."""
SOON = 1e-6
"""Time in s."""
STANDING = 1e-9
"""Speed that is none, m/s."""
MOST_PIECES = 100_000
"""Most pieces of a sample; beyond it a run has no result."""


class PlaneShaking(NamedTuple):
    """One record: accelerations along the width and depth, and upward (n,), m/s²; `vertical` is empty without any."""

    along: Any
    across: Any
    vertical: Any
    dt: float
