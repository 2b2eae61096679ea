"""Rest: the decision that a bouncing block comes to rest, and the time at which the motion lifts it again."""

import math

from ...core.compiled import kernel
from .regions import greatest, later, least_weight, rate, rounding, value, weight_at
from .tables import (
    BREAK_TIME,
    BROKEN,
    EPSILON,
    FUSED,
    IMPACTS,
    LINK_LOWER_REST,
    LINK_UPPER_REST,
    MANY_IMPACTS,
    NOW,
    OMEGA,
    REGION_GAIN,
    REGION_LOWER,
    REGION_STIFFNESS,
    REGION_UPPER,
    REST_BREAKS,
    REST_DOWN,
    REST_DOWN_TARGET,
    REST_THETA,
    REST_UP,
    REST_UP_TARGET,
    SPAN,
    THETA,
    UPLIFTED,
    WALL_IMPACTS,
)

NO_HEIGHT = 2e-11  # height of bounces, rad, that counts as none after MANY_IMPACTS impacts

MARGIN = 32.0 * EPSILON  # of the uplift threshold, within which forcing counts as at the threshold


@kernel(inline="always")
def may_rest(model, o, rest, loss, omega, left, weight):
    """Return a condition that `comes_to_rest` needs, and that rejects most cases: more is never enough."""
    thresholds = (model.rests[o, rest, REST_UP] + model.rests[o, rest, REST_DOWN]) * greatest(weight, left)
    return omega == 0.0 or abs(omega) < 0.25 * loss * thresholds * left


@kernel(**FUSED)
def comes_to_rest(model, o, rest, loss, omega, next_omega, stiffness, force, slope, left, highest, weight):
    """Return True if all later bounces provably end before the sample, or before its forcing leaves the threshold.

    On either side the deceleration changes one way over a horizon, from a to b say. A bounce under it returns faster by
    sqrt(b/a) at most, and over many bounces these factors multiply to no more than sqrt(max/min) of each side. Let
    a_min be the minimum deceleration and r the product of both ratios. The bounces that follow then take at most
    2|omega| sqrt(r)/(loss a_min) in all and rise to next_omega² r/(2 a_min). This must not exceed `highest`: the peak
    so far, and the branch with impacts only. A tenth of a_min is kept for the softening |K| x of the branch. There x <=
    loss² a_min horizon²/8, and a horizon of half its time constant keeps it below 1/32.

    `loss`: 1 - e if every impact takes the factor e. If the factors of the two sides differ, the velocities that follow
    are omega (1 + f + f g + f² g …). Then loss is (1 - f g)/(1 + f), and `next_omega` is the larger one of omega and f
    omega. Against a wall all bounces are on one side, and the state of rest has one threshold only. Under a vertical
    component thresholds, decelerations and softening are in proportion to the weight, which is linear in time, too.
    """
    if omega == 0.0:
        return True
    up = model.rests[o, rest, REST_UP]
    down = model.rests[o, rest, REST_DOWN]
    horizon = min(left, 0.5 / math.sqrt(abs(stiffness) * greatest(weight, left)))
    end = force + slope * horizon
    heavy = value(later(weight, horizon))
    # Where the threshold is exceeded later in this sample, half the time until then is the horizon.
    if end > up * heavy and slope > up * rate(weight):
        horizon = 0.5 * (up * value(weight) - force) / (slope - up * rate(weight))
    elif end < -down * heavy and slope < -down * rate(weight):
        horizon = 0.5 * (-down * value(weight) - force) / (slope + down * rate(weight))
    end = force + slope * horizon
    heavy = value(later(weight, horizon))
    right = up * value(weight) - force
    right_end = up * heavy - end
    left_side = down * value(weight) + force
    left_end = down * heavy + end
    least_right = min(right, right_end)
    least_left = min(left_side, left_end)
    gain_right = model.tables[o, int(model.rests[o, rest, REST_UP_TARGET]), REGION_GAIN]
    gain_left = model.tables[o, int(model.rests[o, rest, REST_DOWN_TARGET]), REGION_GAIN]
    a_min = 0.9 * min(gain_right * least_right, gain_left * least_left)
    if a_min <= 0.0:
        return False
    r = 1.0
    if up < math.inf:
        r = max(right, right_end) / least_right
    if down < math.inf:
        r *= max(left_side, left_end) / least_left
    time = loss * a_min * horizon
    return 4.0 * omega * omega * r <= time * time and next_omega * next_omega * r <= 2.0 * a_min * highest


@kernel(inline="always")
def rest_at(model, o, region, theta):
    """Return the state of rest into which bounces at this rotation die, -1 if there are none."""
    if theta == model.tables[o, region, REGION_LOWER]:
        return model.links[o, region, LINK_LOWER_REST]
    if theta == model.tables[o, region, REGION_UPPER]:
        return model.links[o, region, LINK_UPPER_REST]
    return -1


@kernel(inline="always")
def has_bounced_out(x, k, model, o, force, weight):
    """Return True if a block has bounced MANY_IMPACTS times and bounces below NO_HEIGHT: it then counts as at rest."""
    if k[IMPACTS] + k[WALL_IMPACTS] <= MANY_IMPACTS or k[NOW] < 0:
        return False
    rest = rest_at(model, o, k[NOW], x[THETA])
    if rest < 0:
        return False
    gain = model.tables[o, k[NOW], REGION_GAIN]
    heavy = value(weight)
    a_min = gain * min(model.rests[o, rest, REST_UP] * heavy - force, model.rests[o, rest, REST_DOWN] * heavy + force)
    return x[OMEGA] * x[OMEGA] <= 2.0 * a_min * NO_HEIGHT


@kernel(**FUSED)
def set_at_rest(x, k, model, o, rest):
    """Put a block into a state of rest."""
    x[THETA] = model.rests[o, rest, REST_THETA]
    x[OMEGA] = 0.0
    k[NOW] = -1 - rest


@kernel(**FUSED)
def uplift(model, o, x, k, force, slope, left, time, weight):
    """Return the time until forcing lifts a block at rest (left if it does not), and the forcing at that time.

    Forcing that is at the threshold to rounding lifts the block only if it grows. The margin is wider than the margin
    within which a piece treats its acceleration as zero, or a block could be lifted and set down without end. The
    thresholds are in proportion to the weight.
    """
    row = model.rests[o, -1 - k[NOW]]
    right = row[REST_UP]
    leftward = -row[REST_DOWN]
    sure_right = right * (1.0 + MARGIN) if right > 0.0 else right * (1.0 - MARGIN)
    sure_left = leftward * (1.0 + MARGIN) if leftward < 0.0 else leftward * (1.0 - MARGIN)
    if row[REST_THETA] != 0.0:  # (at a wall the threshold is a difference, and may be next to 0)
        target = int(row[REST_UP_TARGET if right < math.inf else REST_DOWN_TARGET])
        margin = MARGIN * abs(model.tables[o, target, REGION_STIFFNESS] * row[REST_THETA])
        sure_right += margin
        sure_left -= margin
    heavy = value(weight)
    heavy_end = value(later(weight, left))
    end = force + slope * left
    t = 0.0
    wide = MARGIN * rounding(weight, force, end)
    rises = slope - right * rate(weight)
    sinks = leftward * rate(weight) - slope
    if force > sure_right * heavy + wide:
        up = True
    elif force < sure_left * heavy - wide:
        up = False
    elif end > sure_right * heavy_end + wide and rises > 0.0:
        t = min(max(right * heavy - force, 0.0) / rises, left)
        force = right * value(later(weight, t))
        up = True
    elif end < sure_left * heavy_end - wide and sinks > 0.0:
        t = min(max(force - leftward * heavy, 0.0) / sinks, left)
        force = leftward * value(later(weight, t))
        up = False
    else:
        return left, force
    x[THETA] = row[REST_THETA]
    x[OMEGA] = 0.0
    k[NOW] = int(row[REST_UP_TARGET]) if up else int(row[REST_DOWN_TARGET])
    k[UPLIFTED] = 1
    if row[REST_BREAKS] != 0.0:
        k[BROKEN] = 1
        x[BREAK_TIME] = time + t
    return t, force


@kernel(**FUSED)
def until_uplift(record, highs, amplitude, upper, lower, i, last, weight, lifting):
    """Return the sample, from i on, in which the forcing exceeds the threshold: the last one if it never does.

    By `highs`, the largest |record| of every SPAN samples, most samples are passed over.
    """
    force = amplitude * record[i]
    heavy = weight_at(weight, lifting, i)
    if force >= upper * heavy or force <= lower * heavy:  # (a record may begin there)
        return i
    enough = min(upper, -lower)
    j = i + 1
    while j <= last:
        if j % SPAN == 0:
            least = least_weight(weight, lifting, j // SPAN)
            if least > 0.0 and abs(amplitude) * highs[j // SPAN] < enough * least:
                j += SPAN
                continue
        force = amplitude * record[j]
        heavy = weight_at(weight, lifting, j)
        if force >= upper * heavy or force <= lower * heavy:
            return j - 1
        j += 1
    return last
