"""Blocks that slide with Coulomb friction, to 40 digits (mpmath), event by event: what the sliding engine is held to.

Written from the equations alone, and sharing nothing with the engine: a block at rest relative to the floor stays
while the floor's acceleration u'' is within the resistances static_front G and static_back G, G = g + w''; while it
slides towards the side s = +1 (front) or -1, its velocity relative to the floor obeys v' = -u'' - s kinetic G.  Between
samples u'' and w'' are straight lines.  Every float is an exact number; samples lie at exact multiples of the step.
"""

import mpmath
from mpmath import mpf

DIGITS = 60
"""Digits that are worked with; more than 40 are left after the longest runs."""
TIE = mpf("1e-45")
"""Speeds, m/s, and excesses, m/s², below which two roundings of zero are zero: ties of round numbers."""
G = 9.80665
NAMES = ("forward", "backward", "residual", "path", "velocity", "slips", "first", "after")
"""Results of a run, in order: slips, m; greatest velocity, m/s; number of slips; time of the first, s; m."""


def excess(side, u, weight, resistance):
    """What pushes a block towards a side beyond its resistance; None where it resists without end."""
    return None if resistance is None else -side * u - resistance * weight


def crossing(now, after, length):
    """The first instant of [0, length) after which a straight line, now to after, is above zero; None without one."""
    if now > 0:
        return mpf(0)
    if after <= 0:
        return None
    return length * (-now) / (after - now)


def standstill(v, c, d, length):
    """The first instant of (0, length] at which v + c t + d t²/2 is zero; None without one.

    With v = 0 the instant 0 is not counted: the block has just begun to slide.
    """
    if v == 0:
        found = [-2 * c / d] if d != 0 else []
    elif d == 0:
        found = [-v / c] if c != 0 else []
    else:
        inside = c * c - 2 * d * v
        if inside < 0:
            return None
        wide = -c - mpmath.sqrt(inside) if c > 0 else -c + mpmath.sqrt(inside)
        found = [wide / d, 2 * v / wide] if wide != 0 else []
    return min((t for t in found if 0 < t <= length), default=None)


class Run:
    """One block under one record; `go` returns its results by name."""

    def __init__(self, static, kinetic, obstacle=None):
        self.obstacle, self.met = None if obstacle is None else mpf(obstacle), None
        self.static = {side: None if mu == float("inf") else mpf(mu) for side, mu in zip((1, -1), static, strict=True)}
        self.kinetic = {side: mpf(mu) for side, mu in zip((1, -1), kinetic, strict=True)}
        self.s = self.v = self.began = self.path = self.fastest = self.forward = self.backward = mpf(0)
        self.side = self.came_from = self.slips = 0
        self.first = None

    def extreme(self):
        self.forward, self.backward = max(self.forward, self.s), max(self.backward, -self.s)

    def start(self, side, time):
        self.side, self.began = side, self.s
        self.slips += 1
        if self.first is None:
            self.first = time

    def stop(self):
        self.path += abs(self.s - self.began)
        self.came_from, self.side, self.v = self.side, 0, mpf(0)
        self.extreme()

    def move(self, c, d, t):
        """Slide for a time t under the acceleration c + d t."""
        self.fastest = max(self.fastest, abs(self.v))
        if d != 0 and 0 < -c / d < t:
            self.fastest = max(self.fastest, abs(self.v - c * c / (2 * d)))
        self.meet(c, d, t)
        self.s += t * (self.v + t * (c / 2 + t * d / 6))
        self.v += t * (c + t * d / 2)
        self.fastest = max(self.fastest, abs(self.v))

    def meet(self, c, d, t):
        """Keep the speed with which a slide first passes the obstacle on either side, by bisection."""
        if self.obstacle is None or self.met is not None:
            return
        left = self.s - self.side * self.obstacle
        if self.side * (left + t * (self.v + t * (c / 2 + t * d / 6))) <= 0:
            return
        low, at = mpf(0), t
        while at - low > mpf(10) ** (1 - mpmath.mp.dps) * t:
            middle = (low + at) / 2
            passed = self.side * (left + middle * (self.v + middle * (c / 2 + middle * d / 6))) > 0
            low, at = (low, middle) if passed else (middle, at)
        self.met = abs(self.v + at * (c + at * d / 2))

    def sample(self, time, length, u, weight):
        """Follow a stretch of a given length with (value at its beginning, at its end) of u'' and of the weight."""
        gone = mpf(0)
        slope, lift = (u[1] - u[0]) / length, (weight[1] - weight[0]) / length
        while gone < length:
            left = length - gone
            u0, g0 = u[0] + slope * gone, weight[0] + lift * gone
            threshold, moving = False, self.side != 0
            if not moving:
                starts = {}
                for side in (1, -1):
                    now, after = (excess(side, *at, self.static[side]) for at in ((u0, g0), (u[1], weight[1])))
                    # A block that has just come to rest was slowed down: it cannot slide on, whatever the last digit.
                    if now is not None and (now < TIE or side == self.came_from):
                        now = min(now, mpf(0))
                    at = None if now is None else crossing(now, after, left)
                    if at is not None:
                        starts[side] = (at, now)
                if not starts:
                    return
                side = min(starts, key=lambda one: starts[one][0])
                at, now = starts[side]
                self.start(side, time + gone + at)
                gone, left = gone + at, left - at
                u0, g0 = u0 + slope * at, g0 + lift * at
                threshold = now <= 0
            # At a breakaway within the sample -u'' is exactly side static G: its digits are not left to rounding.
            c = -u0 - self.side * self.kinetic[self.side] * g0
            if threshold:
                c = self.side * (self.static[self.side] - self.kinetic[self.side]) * g0
            d = -slope - self.side * self.kinetic[self.side] * lift
            t = standstill(self.v, c, d, left)
            if t is None:
                self.move(c, d, left)
                if moving and abs(self.v) < TIE:
                    self.stop()
                return
            self.move(c, d, t)
            gone += t
            self.stop()

    def go(self, record, dt, factor=1.0, vertical=None):
        factor, dt, g = mpf(factor), mpf(dt), mpf(G)
        u = [factor * mpf(float(value)) for value in record]
        w = [g] * len(u) if vertical is None else [g + factor * mpf(float(value)) for value in vertical]
        for i in range(len(u) - 1):
            if self.side == 0 and self.stays(u[i : i + 2], w[i : i + 2]):
                continue
            self.sample(i * dt, dt, u[i : i + 2], w[i : i + 2])
        after = mpf(0)
        if self.side != 0:
            after = self.v * self.v / (2 * self.kinetic[self.side] * g)
            self.meet(-self.side * self.kinetic[self.side] * g, mpf(0), abs(self.v) / (self.kinetic[self.side] * g))
            self.s += self.side * after
            self.stop()
        first = mpf("nan") if self.first is None else self.first
        found = (self.forward, self.backward, self.s, self.path, self.fastest, mpf(self.slips), first, after)
        return dict(zip(NAMES, found, strict=True))

    def stays(self, u, weight):
        """Whether no end of a sample is above a resistance: straight lines are not, between their ends."""
        return not any(
            resistance is not None and excess(side, *at, resistance) > 0
            for side, resistance in self.static.items()
            for at in zip(u, weight, strict=True)
        )


def speed_at(obstacle, case, digits=DIGITS):
    """The speed with which a run (arguments of `solve`) first meets an obstacle at a slip to either side, or None."""
    record, dt, static, kinetic, factor, vertical = case
    with mpmath.workdps(digits):
        run = Run(static, kinetic, obstacle)
        run.go(record, dt, factor, vertical)
        return run.met


def solve(record, dt, static, kinetic, factor=1.0, vertical=None, digits=DIGITS):
    """Results of one run by name (mpf); static and kinetic are (front, back), and an infinite one is never exceeded.

    dt is taken exactly; the record (n,) and `vertical` (n,), m/s², are both multiplied by the factor.
    """
    with mpmath.workdps(digits):
        return Run(static, kinetic).go(record, dt, factor, vertical)
