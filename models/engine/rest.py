"""Rest: the decision that a bouncing block comes to rest, and the time at which shaking lifts it again."""

import math

import numpy as np

from ...compiled import kernel
from .tables import (
    EPSILON,
    FUSED,
    IMPACTS,
    MANY_IMPACTS,
    NOW,
    OMEGA,
    PAR_REST_LEFT,
    PAR_REST_RIGHT,
    PAR_RESTITUTION,
    PAR_UPLIFT_LEFT,
    PAR_UPLIFT_RIGHT,
    REGION_STIFFNESS,
    REST,
    THETA,
    UPLIFTED,
)

NO_HEIGHT = 2e-11  # height of bounces, rad, that counts as none after MANY_IMPACTS impacts

# Samples of a record of which the largest is kept, for blocks at rest.
SPAN = 32
MARGIN = 32.0 * EPSILON  # of the uplift threshold, within which forcing counts as at the threshold


@kernel(**FUSED)
def comes_to_rest(model, o, omega, stiffness, force, slope, left, highest):
    """Return True if all later bounces provably end before the sample, or before its forcing reaches the threshold.

    On either side the deceleration changes one way over a horizon, from a to b say; a bounce under it comes back faster
    by sqrt(b/a) at most, and over many bounces these factors multiply to no more than sqrt(max/min) of each side.  So,
    with a_min the least deceleration and r the product of both ratios, the bounces that follow take at most
    2|omega| sqrt(r)/((1 - e) a_min) in all and rise to omega² r/(2 a_min), which must not exceed `highest`: the peak so
    far, and the branch on which there are impacts only.  A tenth of a_min is kept for the softening |K| x of the
    branch: x <= (1 - e)² a_min horizon²/8, and a horizon of half its time constant keeps it below 1/32.
    """
    if omega == 0.0:
        return True
    e = model.parameters[o, PAR_RESTITUTION]
    right = model.parameters[o, PAR_UPLIFT_RIGHT]
    left_side = model.parameters[o, PAR_UPLIFT_LEFT]
    # (this necessary condition rejects most cases)
    if 2.0 * abs(omega) >= (1.0 - e) * 0.5 * (right + left_side) * left:
        return False
    horizon = min(left, 0.5 / math.sqrt(-stiffness))
    end = force + slope * horizon
    # Where the threshold is exceeded later in this sample, half the time until then is the horizon.
    if end > model.parameters[o, PAR_UPLIFT_RIGHT] and slope > 0.0:
        horizon = 0.5 * (model.parameters[o, PAR_UPLIFT_RIGHT] - force) / slope
    elif end < -model.parameters[o, PAR_UPLIFT_LEFT] and slope < 0.0:
        horizon = 0.5 * (-model.parameters[o, PAR_UPLIFT_LEFT] - force) / slope
    end = force + slope * horizon
    least_right = right - max(force, end)
    least_left = left_side + min(force, end)
    a_min = 0.9 * min(least_right, least_left)
    if a_min <= 0.0:
        return False
    r = (right - min(force, end)) / least_right * ((left_side + max(force, end)) / least_left)
    time = (1.0 - e) * a_min * horizon
    return 4.0 * omega * omega * r <= time * time and omega * omega * r <= 2.0 * a_min * highest


@kernel(inline="always")
def has_bounced_out(x, k, model, o, force):
    """Return True if a block has bounced MANY_IMPACTS times and bounces below NO_HEIGHT: it then counts as at rest."""
    if k[IMPACTS] <= MANY_IMPACTS or x[THETA] != 0.0 or k[NOW] == REST:
        return False
    stiffness = model.tables[o, k[NOW], REGION_STIFFNESS]
    a_min = min(model.parameters[o, PAR_UPLIFT_RIGHT] - force, model.parameters[o, PAR_UPLIFT_LEFT] + force)
    return x[OMEGA] * x[OMEGA] <= 2.0 * a_min * NO_HEIGHT and stiffness < 0.0


@kernel(**FUSED)
def uplift(model, o, x, k, force, slope, left):
    """Return the time until forcing lifts a block at rest (left if it does not), and the forcing at that time.

    Forcing that is at the threshold to rounding lifts the block only if it grows: the margin is wider than the one
    within which a piece takes its acceleration for zero, or a block could be lifted and set down without end.
    """
    right = model.parameters[o, PAR_UPLIFT_RIGHT]
    leftward = -model.parameters[o, PAR_UPLIFT_LEFT]
    end = force + slope * left
    t = 0.0
    if force > right * (1.0 + MARGIN) or force < leftward * (1.0 + MARGIN):
        pass
    elif end > right * (1.0 + MARGIN) and slope > 0.0:
        t = max(right - force, 0.0) / slope
        force = right
    elif end < leftward * (1.0 + MARGIN) and slope < 0.0:
        t = min(leftward - force, 0.0) / slope
        force = leftward
    else:
        return left, force
    k[NOW] = int(model.parameters[o, PAR_REST_RIGHT]) if force > 0.0 else int(model.parameters[o, PAR_REST_LEFT])
    k[UPLIFTED] = 1
    x[THETA] = 0.0
    x[OMEGA] = 0.0
    return min(t, left), force


@kernel()
def span_maxima(record):
    """Return the largest |record| of every SPAN samples."""
    highs = np.zeros(record.shape[0] // SPAN + 1)
    for j in range(record.shape[0]):
        highs[j // SPAN] = max(highs[j // SPAN], abs(record[j]))
    return highs


@kernel(**FUSED)
def until_uplift(record, highs, amplitude, upper, lower, i):
    """Return the sample, from i on, in which the forcing exceeds the threshold: the last one if it never does.

    By `highs` (see `span_maxima`) most samples are passed over.
    """
    force = amplitude * record[i]
    if force >= upper or force <= lower:  # (a record may begin there)
        return i
    enough = min(upper, -lower)
    j = i + 1
    while j < record.shape[0]:
        if j % SPAN == 0 and abs(amplitude) * highs[j // SPAN] < enough:
            j += SPAN
            continue
        force = amplitude * record[j]
        if force >= upper or force <= lower:
            return j - 1
        j += 1
    return record.shape[0] - 1
