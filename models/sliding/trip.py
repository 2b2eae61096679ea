"""Criterion of tripping: the energy of a sliding block at an obstacle is enough to turn over it."""

import math
from typing import Any

import numpy as np

from ...core.parameters import Parameter
from ...core.units import STANDARD_GRAVITY, described
from ..block import Block

TRIP = Parameter("m", at_least=0.001, at_most=10.0, written="mm")
"""Distance to an obstacle."""
TRIPS = "trips"
"""Name of the flag of blocks that meet an obstacle fast enough to turn over it."""
OF_TRIPS = described("whether the block meets an obstacle with the energy to turn over it (a criterion)")
"""Its attributes."""


def tripping_velocity(block: Block) -> float:
    """Return the velocity from which a sliding block turns over when its foot is stopped, m/s.

    An obstacle that is low compared with the block stops the foot at once. The angular momentum about the foot is kept,
    m v h = I0 omega with I0 = lambda m R². The block therefore begins to rock with omega = v h/(lambda R²). It passes
    its balance if the energy can lift its mass that far (Housner 1963), I0 omega²/2 >= m g R (1 - cos alpha), hence

        v >= (R/h) sqrt(2 lambda g (R - h)),

    the critical sliding velocity of vehicles that are tripped by a curb. The motion after the impact, which may help or
    hinder, and an obstacle that deforms are left out. Jones, I. S. (1975). The mechanics of rollover as the result of
    curb impact. SAE Technical Paper 750461 (as quoted by others; not re-read). Housner, G. W. (1963). Bulletin of the
    Seismological Society of America 53(2), 403-417.
    """
    assert block.inertia_factor is not None  # set by the block itself
    # (R - h = b²/(R + h) without cancellation)
    lift = block.b * block.b / (block.R + block.h)
    return block.R / block.h * math.sqrt(2.0 * block.inertia_factor * STANDARD_GRAVITY * lift)


def trips(block: Block, velocity: Any) -> Any:
    """Return True if a block meets an obstacle with at least its `tripping_velocity` (velocities in m/s, any array).

    False for NaN, the velocity of a block that does not get there.
    """
    return np.asarray(velocity) >= tripping_velocity(block)
