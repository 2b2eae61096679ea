"""Properties of one region, from the tables: potential energy, captures, impacts, and its linear form at zero."""

import math

from ...compiled import kernel
from .tables import (
    FUSED,
    IMPACT,
    LINK_HELD,
    LINK_LOWER_ACTION,
    LINK_LOWER_TARGET,
    LINK_TURN_LEFT,
    LINK_TURN_RIGHT,
    LINK_UPPER_ACTION,
    LINK_UPPER_TARGET,
    NO_REGION,
    PAR_EXACT,
    REGION_DAMPING,
    REGION_OFFSET,
    REGION_POTENTIAL,
    REGION_STIFFNESS,
    REGION_UPPER,
)


@kernel(inline="always")
def captures(model, o, region):
    """Return True if another region takes over where the velocity vanishes inside this one."""
    return model.links[o, region, LINK_TURN_LEFT] != NO_REGION or model.links[o, region, LINK_TURN_RIGHT] != NO_REGION


@kernel(**FUSED)
def potential_energy(model, o, region, theta):
    """Return the potential energy per unit inertia at theta, as continued from `region`."""
    stiffness = model.tables[o, region, REGION_STIFFNESS]
    offset = model.tables[o, region, REGION_OFFSET]
    if model.parameters[o, PAR_EXACT] != 0.0:
        tilt = offset / stiffness
        return -stiffness * (math.cos(tilt - theta) - math.cos(tilt)) + model.tables[o, region, REGION_POTENTIAL]
    return (0.5 * stiffness * theta - offset) * theta + model.tables[o, region, REGION_POTENTIAL]


@kernel(**FUSED)
def bounces_to(model, o, region):
    """Return the region across an impact at theta = 0 of an undamped region, else NO_REGION."""
    upper = model.tables[o, region, REGION_UPPER] == 0.0
    action = model.links[o, region, LINK_UPPER_ACTION] if upper else model.links[o, region, LINK_LOWER_ACTION]
    if action != IMPACT or model.links[o, region, LINK_HELD] or model.tables[o, region, REGION_DAMPING] != 0.0:
        return NO_REGION
    return model.links[o, region, LINK_UPPER_TARGET] if upper else model.links[o, region, LINK_LOWER_TARGET]


@kernel(**FUSED)
def near_zero(model, o, region):
    """Return offset, stiffness, gain, lean at 0: theta'' = offset + gain forcing - (stiffness - lean forcing) theta."""
    stiffness = model.tables[o, region, REGION_STIFFNESS]
    offset = model.tables[o, region, REGION_OFFSET]
    scale = model.parameters[o, PAR_EXACT]
    if scale == 0.0:
        return offset, stiffness, 1.0, 0.0
    tilt = offset / stiffness
    return stiffness * math.sin(tilt), stiffness * math.cos(tilt), scale * math.cos(tilt), scale * math.sin(tilt)
