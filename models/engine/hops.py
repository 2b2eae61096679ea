"""Bounces within one sample: short flights from impact to impact, solved in closed form."""

import math

from ...core.compiled import kernel
from .regions import greatest, later, lesser_peak, near_zero, raise_peak, value, with_rate
from .rest import comes_to_rest, rest_at
from .tables import (
    FREE,
    FUSED,
    IMPACTS,
    LINK_HOPS,
    MANY_HOPS,
    MANY_IMPACTS,
    NO_REGION,
    NOW,
    OMEGA,
    REGION_GAIN,
    REGION_LOWER,
    REGION_LOWER_FACTOR,
    REGION_LOWER_LOSS,
    REGION_OFFSET,
    REGION_STIFFNESS,
    REGION_UPPER,
    REGION_UPPER_FACTOR,
    REGION_UPPER_LOSS,
    REST_DOWN,
    REST_UP,
    STRIKE,
    THETA,
    TURNS,
)


@kernel(inline="always")
def flight_terms(stiffness, h):
    """Return m = -K h², and c1, c2 and c3 of `solve_hops` by their series, exact to rounding for |m| <= 1/400."""
    m = -stiffness * h * h
    c1 = 1.0 + m * ((1.0 / 6.0) + m * ((1.0 / 120.0) + m * (1.0 / 5040.0)))
    c2 = 0.5 + m * ((1.0 / 24.0) + m * ((1.0 / 720.0) + m * (1.0 / 40320.0)))
    c3 = (1.0 / 6.0) + m * ((1.0 / 120.0) + m * ((1.0 / 5040.0) + m * (1.0 / 362880.0)))
    return m, c1, c2, c3


@kernel(inline="always")
def landing(model, o, region):
    """Return the factor that the velocity takes on at the end at theta = 0 of a region, and the loss of the bounces."""
    row = model.tables[o, region]
    if row[REGION_LOWER] == 0.0:
        return row[REGION_LOWER_FACTOR], row[REGION_LOWER_LOSS]
    return row[REGION_UPPER_FACTOR], row[REGION_UPPER_LOSS]


@kernel(**FUSED)
def solve_hops(x, k, model, o, force, slope, t, dt):
    """Solve short flights from an impact at theta = 0 to the next, up to the end of the sample.

    Over a flight theta/s = v c1 + a s c2 + b s² c3 and theta' = v (1 + m c2) + s (a c1 + b s c2). Here b is the slope
    of the forcing and m = -K s². The factors c1 = sinh(sqrt m)/sqrt m, c2 = (cosh(sqrt m) - 1)/m, c3 = (c1 - 1)/m are
    by their series. The flight is taken only if these are exact to rounding and it stays below the peak and in its
    region. Returns the time reached within the sample.
    """
    region = k[NOW]
    across = model.links[o, region, LINK_HOPS]
    if across == NO_REGION:
        return t
    offset = model.tables[o, region, REGION_OFFSET]
    offset_across = model.tables[o, across, REGION_OFFSET]
    stiffness = model.tables[o, region, REGION_STIFFNESS]
    stiffness_across = model.tables[o, across, REGION_STIFFNESS]
    push = model.tables[o, region, REGION_GAIN] * force
    push_across = model.tables[o, across, REGION_GAIN] * force
    rise = model.tables[o, region, REGION_GAIN] * slope
    rise_across = model.tables[o, across, REGION_GAIN] * slope
    e, loss = landing(model, o, region)
    e_across, loss_across = landing(model, o, across)
    highest = min(
        lesser_peak(x),
        model.tables[o, region, REGION_UPPER] - model.tables[o, region, REGION_LOWER],
        model.tables[o, across, REGION_UPPER] - model.tables[o, across, REGION_LOWER],
    )
    rest = rest_at(model, o, region, 0.0)
    settling = 0.25 * max(loss, loss_across) * (model.rests[o, rest, REST_UP] + model.rests[o, rest, REST_DOWN])
    omega = x[OMEGA]
    strike = x[STRIKE]
    hops = 0
    while hops < MANY_HOPS:
        a = push + rise * t + offset
        if omega * a >= 0.0:
            break
        left = dt - t
        # the parabola's landing, and the next two terms by one step
        jerk = rise - stiffness * omega
        y2 = 0.5 * a
        y3 = jerk * (1.0 / 6.0)
        square = y2 * y2 - 4.0 * y3 * omega
        h = left
        if square > 0.0:
            root = math.copysign(math.sqrt(square), y2)
            guess = -2.0 * omega / (y2 + root)
            guess += guess * guess * guess * stiffness * (y2 * (1.0 / 12.0) + y3 * guess * (1.0 / 20.0)) / root
            if 0.0 < guess < left:
                h = guess
        # With |jerk| h <= |a|/4 the flight is a single arc; its height is a quarter of its first slope times its
        # length, a little more with a jerk.
        height = abs(omega) * h * (1.0 if h == left else 0.35)
        if abs(jerk) * h > 0.25 * abs(a) or abs(stiffness) * h * h > 0.0025 or height > highest:
            break
        f = 0.0
        speed = 0.0
        lands = False
        for _ in range(6):
            m, c1, c2, c3 = flight_terms(stiffness, h)
            # rotation over h, whose zero is the landing, and velocity
            f = omega * c1 + h * (a * c2 + h * rise * c3)
            speed = omega + (omega * m * c2 + h * (a * c1 + h * rise * c2))
            if h == left and f * omega > 0.0:
                break
            step = -f * h / (speed - f)
            lands = abs(step) <= 1e-8 * h
            h = min(h + step, left)
            if lands:
                speed += step * (a + rise * h)
                break
        if not lands:
            if h == left:
                x[THETA] = left * f
                k[TURNS] += 1 if speed * omega < 0.0 else 0
                omega = speed
                t = dt
            break
        t += h
        hops += 1
        speed = min(speed, 0.0) if omega > 0.0 else max(speed, 0.0)
        strike = max(strike, abs(speed))
        omega = e * speed
        if abs(omega) < settling * (dt - t) or omega == 0.0:
            faster = max(1.0, e_across) * omega
            settles = comes_to_rest(
                model, o, rest, loss, omega, faster, stiffness, force + slope * t, slope, dt - t, highest, None
            )
            if k[FREE] == 0 and settles:
                omega = 0.0
                region = -1 - rest
                break
        region, across = across, region
        offset, offset_across = offset_across, offset
        stiffness, stiffness_across = stiffness_across, stiffness
        push, push_across = push_across, push
        rise, rise_across = rise_across, rise
        e, e_across = e_across, e
        loss, loss_across = loss_across, loss
    x[OMEGA] = omega
    x[STRIKE] = strike
    k[NOW] = region
    k[TURNS] += hops
    k[IMPACTS] += hops
    return t


@kernel(**FUSED)
def solve_low_hops(x, k, model, o, force, slope, t, dt, weight):
    """Solve bounces so low that each is a cubic to rounding; a sample may have 100,000 of them if e is close to 1.

    From an impact on, theta = v s + a s²/2 + j s³/6 - K a s⁴/24, where -K is the slope of the moment at zero. This is
    also valid in exact geometry: the rest is of the order of theta². The flight takes s = -2 v z/a with z = 1 - r z² -
    q z³, r = -2 j v/(3 a²), q = -K v²/(3 a²). It lands with -v (2 - z + q z³), and rises to v² y (4 - y)/(6 |a|), y = 1
    + w y²/2, w = j v/a². Under a vertical component the moment is in proportion to the weight, whose rate adds to j.
    Returns the time reached within the sample.
    """
    region = k[NOW]
    across = model.links[o, region, LINK_HOPS]
    if across == NO_REGION:
        return t
    offset, stiffness, gain, lean = near_zero(model, o, region)
    offset_across, stiffness_across, gain_across, lean_across = near_zero(model, o, across)
    outside = min(model.tables[o, region, REGION_STIFFNESS], model.tables[o, across, REGION_STIFFNESS])
    steepest = outside * greatest(weight, dt)
    room = min(
        model.tables[o, region, REGION_UPPER] - model.tables[o, region, REGION_LOWER],
        model.tables[o, across, REGION_UPPER] - model.tables[o, across, REGION_LOWER],
    )
    e, loss = landing(model, o, region)
    e_across, loss_across = landing(model, o, across)
    rest = rest_at(model, o, region, 0.0)
    settling = 0.25 * max(loss, loss_across) * (model.rests[o, rest, REST_UP] + model.rests[o, rest, REST_DOWN])
    settling *= greatest(weight, dt)
    v = x[OMEGA]
    peak = lesser_peak(x)
    strike = x[STRIKE]
    hops = 0
    most = MANY_IMPACTS - k[IMPACTS]
    while hops < most:
        now = force + slope * t
        heavy = later(weight, t)
        a = offset * value(heavy) + gain * now
        bend = stiffness * value(heavy) - lean * now
        jerk = with_rate(heavy, offset, gain * slope) - bend * v
        over = 1.0 / a
        flight = v * over
        w = jerk * flight * over
        q = -bend * flight * flight * (1.0 / 3.0)
        height = -0.5 * abs(v) * flight
        small = abs(w) <= 1e-4 and abs(q) <= 1e-10 and -steepest * height * height <= 1e-16 * abs(a)
        if not (small and 0.0 < height <= 0.5 * room):
            break
        r = w * (-2.0 / 3.0)
        z = 1.0 - q * (1.0 - 5.0 * r) - r * (1.0 - r * (2.0 - r * (5.0 - r * 14.0)))
        end = t - 2.0 * flight * z
        if end >= dt:
            break
        if height * 1.001 > peak:
            y = 1.0 + 0.5 * w * (1.0 + w)
            raise_peak(x, k, math.copysign(height * y * (4.0 - y) * (1.0 / 3.0), v))
            peak = lesser_peak(x)
        t = end
        v *= -(2.0 - z + q)
        strike = max(strike, abs(v))
        v *= e
        hops += 1
        faster = max(1.0, e_across) * v
        highest = min(peak, room)
        if (
            abs(v) < settling * (dt - t)
            and k[FREE] == 0
            and comes_to_rest(
                model, o, rest, loss, v, faster, outside, force + slope * t, slope, dt - t, highest, later(weight, t)
            )
        ):
            v = 0.0
            region = -1 - rest
            break
        region, across = across, region
        offset, offset_across = offset_across, offset
        stiffness, stiffness_across = stiffness_across, stiffness
        gain, gain_across = gain_across, gain
        lean, lean_across = lean_across, lean
        e, e_across = e_across, e
        loss, loss_across = loss_across, loss
    x[OMEGA] = v
    x[STRIKE] = strike
    k[NOW] = region
    k[TURNS] += hops
    k[IMPACTS] += hops
    return t
