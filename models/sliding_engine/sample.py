"""One run through one sample with an event: the block begins to slide, stops, or turns round."""

import math

from ...core.compiled import kernel
from .tables import (
    BACKWARD,
    BARE,
    DRAG,
    EVENTS,
    FACTOR,
    FASTEST,
    FIRST,
    FORWARD,
    GRAVITY,
    GRIP,
    KINETIC_BACK,
    KINETIC_FRONT,
    LATEST,
    LEVEL,
    MET,
    PATH,
    PUSH,
    ROUNDING,
    SIGN,
    SLIP,
    SLIPS,
    SPEED,
    STATIC_BACK,
    STATIC_FRONT,
    STILL,
    WAY,
)

MOST_STEPS = 200
"""Most steps of an iteration, more than bisection needs."""


@kernel(**BARE)
def time_to_stop(speed, c1, c2, left):
    """Smallest root > 0 of speed + c1 t + c2 t²/2 that is at most `left`; infinity if there is none; speed >= 0.

    The roots are 2 speed/q and q/c2 with q = -(c1 + sign(c1) sqrt(c1² - 2 c2 speed)), free of cancellation.  A block
    that is slowed down stops at the first of them; one that is sped up has a root > 0, the second, if that changes.
    """
    inside = c1 * c1 - 2.0 * c2 * speed
    if inside < 0.0:
        return math.inf
    if c1 < 0.0:
        time = 2.0 * speed / (math.sqrt(inside) - c1)
    elif c2 < 0.0:
        time = -(c1 + math.sqrt(inside)) / c2
    else:
        return math.inf
    return time if 0.0 < time <= left else math.inf


@kernel(**BARE)
def begin(x, j, sign, time, dt):
    """Let a block slide in a direction from `time` on."""
    kinetic = x[KINETIC_FRONT + j] if sign > 0.0 else x[KINETIC_BACK + j]
    x[SIGN + j] = sign
    x[PUSH + j] = -sign * (x[FACTOR + j] * dt)
    x[GRIP + j] = kinetic * dt
    x[DRAG + j] = kinetic * dt * GRAVITY
    x[LEVEL + j] = math.inf
    x[SLIPS + j] += 1.0
    if math.isnan(x[FIRST + j]):
        x[FIRST + j] = time


@kernel(**BARE)
def end(x, j):
    """Let a block stop: extremes of the slip lie where its velocity vanishes."""
    slip = x[SLIP + j] + x[SIGN + j] * x[WAY + j]
    x[SLIP + j] = slip
    x[FORWARD + j] = max(x[FORWARD + j], slip)
    x[BACKWARD + j] = max(x[BACKWARD + j], -slip)
    x[PATH + j] += x[WAY + j]
    x[WAY + j] = 0.0
    x[SPEED + j] = 0.0
    x[SIGN + j] = 0.0
    x[PUSH + j] = 0.0
    x[GRIP + j] = 0.0
    x[DRAG + j] = 0.0
    x[LEVEL + j] = x[STILL + j]


@kernel(**BARE)
def speed_after(way, speed, c1, c2, duration):
    """Speed after a way that is covered within `duration`, in which the speed, speed + c1 t + c2 t²/2, is >= 0.

    The way is a cubic that increases: Newton's iteration between the ends of a bracket finds its one root to rounding.
    """
    low, high = 0.0, duration
    time = duration
    for _ in range(MOST_STEPS):
        excess = time * (speed + time * (0.5 * c1 + time * c2 / 6.0)) - way
        if excess > 0.0:
            high = time
        else:
            low = time
        slope = speed + time * (c1 + 0.5 * time * c2)
        after = time - excess / slope if slope > 0.0 else low
        if not low < after < high:
            after = 0.5 * (low + high)
        if after in (time, low, high):
            break
        time = after
    return max(0.0, speed + time * (c1 + 0.5 * time * c2))


@kernel(**BARE)
def meet(x, j, obstacle, before, speed, c1, c2, duration):
    """Keep the speed with which a block meets the obstacle on a piece of its way, from `before` on."""
    room = obstacle - x[SIGN + j] * x[SLIP + j] - before
    if x[MET + j] < 0.0 and x[WAY + j] - before > room:
        x[MET + j] = speed_after(max(0.0, room), speed, c1, c2, duration)


@kernel(**BARE)
def move(x, j, c1, c2, duration, obstacle):
    """Move a sliding block, and keep its maximum speed, which lies at an end or where the acceleration vanishes.

    `obstacle`: the slip at which there is one; if it is None the code for it is not even compiled.
    """
    speed, before = x[SPEED + j], x[WAY + j]
    later = speed + duration * (c1 + 0.5 * duration * c2)
    x[WAY + j] += duration * (speed + duration * (0.5 * c1 + duration * c2 / 6.0))
    x[SPEED + j] = later
    fastest = max(speed, later)
    if c1 > 0.0 and c1 + c2 * duration < 0.0:
        fastest = max(fastest, speed - 0.5 * c1 * c1 / c2)
    x[FASTEST + j] = max(x[FASTEST + j], fastest)
    if obstacle is not None:
        meet(x, j, obstacle, before, speed, c1, c2, duration)


@kernel(**BARE)
def first_start(now, after, left):
    """Time at which a line, `now` at 0 and `after` at `left`, exceeds zero: 0 if it does already, or infinity.

    Exceeds, not reaches: a peak that only touches the threshold starts nothing.  A start leaves some time to slide in.
    """
    if now > 0.0:
        return 0.0
    if not after > 0.0:
        return math.inf
    return left * min(now / (now - after), LATEST)


@kernel(**BARE)
def follow_sample(x, j, start, a0, a1, g0, g1, dt, obstacle):
    """Follow lane j through a sample with the accelerations a0 to a1 and the weights per mass g0 to g1.

    `start` is the time at the beginning of the sample, `obstacle` as in `move`. A block that stops at the end of a
    sample keeps its direction with a speed of zero. The next sample, which may turn it round at once, decides its
    motion.
    """
    slope, lift = (a1 - a0) / dt, (g1 - g0) / dt
    time, left, stopped = 0.0, dt, 0.0
    sign = x[SIGN + j]
    if sign != 0.0 and x[SPEED + j] == 0.0:
        end(x, j)
        sign, stopped = 0.0, sign
    for _ in range(EVENTS):
        a, weight = a0 + slope * time, g0 + lift * time
        if sign == 0.0:
            front, back = x[STATIC_FRONT + j], x[STATIC_BACK + j]
            push_front, push_back = -a - front * weight, a - back * weight
            # What has stopped was slowed down and cannot slide on at once, whatever rounding makes of its last digit.
            # It turns round only if more than the rounding of the acceleration within a sample pushes it back.
            least = ROUNDING * (abs(a0) + abs(a1)) if time > 0.0 else 0.0
            if stopped > 0.0 or push_front <= least:
                push_front = min(push_front, 0.0)
            if stopped < 0.0 or push_back <= least:
                push_back = min(push_back, 0.0)
            to_front = first_start(push_front, -a1 - front * g1, left)
            to_back = first_start(push_back, a1 - back * g1, left)
            if to_front == math.inf and to_back == math.inf:
                return
            sign = 1.0 if to_front <= to_back else -1.0
            begins = min(to_front, to_back)
            static, kinetic = (front, x[KINETIC_FRONT + j]) if sign > 0.0 else (back, x[KINETIC_BACK + j])
            time += begins
            left -= begins
            c1, c2 = -sign * a - kinetic * weight, -sign * slope - kinetic * lift
            if begins > 0.0:
                # Inside a sample the acceleration is that which just starts the block: rounding would give it another
                # sign where static and kinetic friction are equal.  It grows, so that the block slides to the end.
                c1 = (static - kinetic) * (g0 + lift * time)
                if c1 == 0.0 and c2 <= 0.0:
                    return  # the line exceeds zero by rounding alone, at its end: nothing moves the block
                begin(x, j, sign, start + time, dt)
                move(x, j, c1, c2, left, obstacle)
                return
            begin(x, j, sign, start + time, dt)
        else:
            kinetic = x[KINETIC_FRONT + j] if sign > 0.0 else x[KINETIC_BACK + j]
            c1, c2 = -sign * a - kinetic * weight, -sign * slope - kinetic * lift
        stops = time_to_stop(x[SPEED + j], c1, c2, left)
        if not time + stops < dt:
            move(x, j, c1, c2, left, obstacle)
            if stops <= left or x[SPEED + j] < 0.0:
                x[SPEED + j] = 0.0
            return
        move(x, j, c1, c2, stops, obstacle)
        end(x, j)
        time += stops
        left = dt - time
        sign, stopped = 0.0, sign


@kernel(**BARE)
def slide_out(x, j):
    """Let a block that slides at the end of the record come to a stop, and return its further slip."""
    sign = x[SIGN + j]
    if sign == 0.0:
        return 0.0
    speed = x[SPEED + j]
    kinetic = x[KINETIC_FRONT + j] if sign > 0.0 else x[KINETIC_BACK + j]
    further = speed * speed / (2.0 * kinetic * GRAVITY)
    x[FASTEST + j] = max(x[FASTEST + j], speed)
    x[WAY + j] += further
    end(x, j)
    return further
