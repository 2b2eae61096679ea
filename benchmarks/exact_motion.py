"""Solution of one run of one block to any number of digits, by Taylor series with proved events.

*Steps.*  In one region the motion is its Taylor series about the current state, by recurrence, over the rest of the
sample; terms are added until they fall far below rounding.  A step is accepted only if it is proved that the
acceleration has at most one zero in it: the first term of the acceleration's series, or of the jerk's, exceeds the sum
of all others.  Otherwise the step is halved.  The zeros of the velocity are then known from signs alone, the rotation
is monotonic between them, and no crossing is missed.  Events are roots of the same series, to rounding.

*Choices* that the statement leaves open:

- An inward crossing of ENERGY with v_o² <= 0 and rest="elastic" takes c = 2 w (zeta (1 + 1e-13) + 1e-13), where
  2 w zeta is the c that just stops the unforced block at the far edge and w = sqrt(zone): it turns just inside.
- A rigid block that has just hit is followed until it is *proved* that all further bounces end inside the sample and
  stay below the peak so far; then it is put at rest, which is exact at every sample.  `impacts` stops counting earlier,
  as soon as 2 v / ((1 - e) a_min) <= time left, with v the speed after the impact, shows that the block comes to rest:
  near rest the count is a convention (it depends on the length of the sample), the motion is not.
- The potential of the zone lies q2 alpha edge/2 above that of the rigid branch, as rest="rigid" defines it.
- After the record u'' = 0, and the motion is followed to its next turn: the energy never grows, so that no later turn
  is higher.  `impacts` counts the impacts during the record.
"""

from __future__ import annotations

import operator
from collections.abc import Iterable
from itertools import pairwise
from typing import NamedTuple

import gmpy2
from gmpy2 import atan2, const_pi, cos, log, mpfr, sin, sqrt

from ..core.units import STANDARD_GRAVITY
from .kernels.rivals import ENERGY, ENTRY_SPEED, EXACT, VISCOUS
from .multiprecision import root, set_digits, slope, turns, value
from .problems import DT, Problem

WORKING_DIGITS = 60
"""Working precision: rocking multiplies rounding errors by up to 1e9, and uplift near a threshold loses digits."""
REST, RIGID, ZONE, OUTSIDE = range(4)


class Motion:
    """State of a block: region, side, and rotation x and velocity v, both positive away from upright on that side.

    Forces are given as the floor's push on the right side: gain u'', and u''/g for EXACT.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.q2, self.alpha, self.edge = mpfr(problem.q2), mpfr(problem.alpha), mpfr(problem.edge)
        self.zone, self.e = mpfr(problem.zone), mpfr(problem.e)
        self.exact = problem.kind == EXACT
        self.held = mpfr(problem.c)
        self.region = REST if problem.rigid else ZONE
        self.side = 1
        self.x = self.v = mpfr(0)
        self.flat = const_pi() / 2
        self.tolerance = mpfr(2) ** -(gmpy2.get_context().precision + 24)
        self.overturned = self.coming_to_rest = False
        self.peaks: list[mpfr] = []
        self.impacts = 0

    @property
    def rotation(self) -> mpfr:
        return self.side * self.x

    @property
    def peak(self) -> mpfr:
        return self.flat if self.overturned else max(self.peaks, default=mpfr(0))

    def sample(self, force: mpfr, after: mpfr, dt: mpfr) -> None:
        """Follow the motion over one sample, in which the force changes linearly from `force` to `after`."""
        time = mpfr(0)
        rate = (after - force) / dt
        self.coming_to_rest = False
        while time < dt and not self.overturned:
            lifts = self.region == REST
            if lifts:
                # at rest |force| <= threshold, and the force is linear: it exceeds the threshold once or not at all
                threshold = gmpy2.tan(self.alpha) if self.exact else self.q2 * self.alpha
                if abs(after) <= threshold:
                    return
                self.side = -1 if after > 0 else 1
                self.region = RIGID
                time = max(time, (-self.side * threshold - force) / rate)
            h = dt - time
            push, growth = self.side * (force + rate * time), self.side * rate
            while True:
                series = self.series(h, push, growth, lifts)
                zeros = turns(series)
                if zeros is not None:
                    break
                h /= 2
            fraction = self.follow(series, zeros, h)
            if fraction is None:
                time = dt if h == dt - time else time + h
            else:
                time += fraction * h
                self.meet(force + rate * time, after, dt - time)

    def series(self, h: mpfr, push: mpfr, growth: mpfr, lifts: bool) -> list[mpfr]:
        """Return the Taylor terms of x in t/h about the state; at lift-off the acceleration is zero by definition."""
        x, h2 = [self.x, self.v * h], h * h
        small = self.tolerance * h
        if self.exact:
            # sine and cosine of alpha - x by their product recurrences
            s, c, speed = [sin(self.alpha - self.x)], [cos(self.alpha - self.x)], [-x[1]]
            pull, change = -self.q2 * h2, growth * h
            k = 0
            while k < 4 or abs(x[-1]) > small or abs(x[-2]) > small:
                total = s[k] + push * c[k] + (change * c[k - 1] if k else 0)
                x.append(mpfr(0) if lifts and k == 0 else pull * total / ((k + 1) * (k + 2)))
                s.append(sum(map(operator.mul, speed, reversed(c))) / (k + 1))
                c.append(-sum(map(operator.mul, speed, reversed(s[:-1]))) / (k + 1))
                speed.append(-(k + 2) * x[-1])
                k += 1
            return x
        inside = self.region == ZONE
        stiffness = (self.zone if inside else -self.q2) * h2
        damping = (self.held if inside or self.problem.kind == VISCOUS else 0) * h
        constant = (push if inside else self.q2 * self.alpha + push) * h2
        x.append(mpfr(0) if lifts else -(damping * x[1] + stiffness * x[0] + constant) / 2)
        x.append(-(2 * damping * x[2] + stiffness * x[1] + growth * h2 * h) / 6)
        k = 2
        while k < 4 or abs(x[-1]) > small or abs(x[-2]) > small:
            x.append(-(damping * (k + 1) * x[k + 1] + stiffness * x[k]) / ((k + 1) * (k + 2)))
            k += 1
        return x

    def follow(self, series: list[mpfr], zeros: list[mpfr], h: mpfr) -> mpfr | None:
        """Move along the series to its first event, whose fraction of h is returned, or to the end."""
        low = {ZONE: -self.edge, RIGID: mpfr(0), OUTSIDE: self.edge}[self.region]
        high = self.flat if self.region == OUTSIDE or not self.edge else self.edge
        velocity = slope(series)
        before, x_before = mpfr(0), self.x
        for at in [*zeros, mpfr(1)]:
            x = value(series, at) if at < 1 else sum(series)
            # monotonic from `before` to `at`; a start on an edge does not cross it
            limit = high if x > x_before else low
            if (x >= high and x > x_before) or (x <= low and x < x_before):
                fraction = root(lambda t: value(series, t) - limit, before, at)  # noqa: B023
                self.x, self.v = limit, value(velocity, fraction) / h
                return fraction
            before, x_before = at, x
            if at < 1:
                self.peaks.append(abs(x))
                if self.region == ZONE and self.problem.rigid:
                    self.x, self.v = x, mpfr(0)
                    return at
        self.x, self.v = x, sum(velocity) / h
        return None

    def meet(self, force: mpfr, after: mpfr, left: mpfr) -> None:
        """Change the state where `follow` stopped: at an edge, upright, flat, or at a turn inside the zone."""
        if self.region == ZONE:
            outward = self.x * self.v > 0
            if self.x < 0:
                self.side, self.x, self.v = -self.side, -self.x, -self.v
            if outward:
                self.region = OUTSIDE
            else:
                energy = self.zone * self.x**2 / 2 + self.q2 * self.alpha * self.edge / 2
                self.region, self.x = RIGID, self.alpha - sqrt(self.alpha**2 - 2 * energy / self.q2)
        elif self.v > 0:
            self.overturned = self.x == self.flat
            self.region = OUTSIDE
        elif self.region == RIGID:
            self.side, self.v = -self.side, -self.e * self.v
            self.impacts += not self.coming_to_rest
            if self.rests(force, after, left):
                self.region, self.v = REST, mpfr(0)
        else:
            self.enter()

    def enter(self) -> None:
        """Change the state at an inward crossing of the edge: into the damped zone, or along the rigid branch."""
        e2, kind = self.e**2, self.problem.kind
        # twice the potential of the rigid branch at the edge
        barrier = self.q2 * self.edge * (2 * self.alpha - self.edge)
        if self.problem.rigid and e2 * (self.v**2 + barrier) <= barrier:
            self.region = RIGID
            return
        self.region = ZONE
        self.impacts += 1
        if kind == ENTRY_SPEED:
            self.held = (1 - self.e) * abs(self.v) / (2 * self.edge)
        elif kind == ENERGY:
            leaving = e2 * self.v**2 - (1 - e2) * barrier
            self.held = self.crossing(abs(self.v), sqrt(max(leaving, 0)))
            if leaving <= 0:
                self.held += (self.held + 2 * sqrt(self.zone)) * mpfr("1e-13")

    def crossing(self, entry: mpfr, exit_: mpfr) -> mpfr:
        """Return the damping with which the unforced crossing of the zone has the speeds `entry` and `exit_`.

        With beta = c/2 and w_d = sqrt(zone - beta²), v + (beta + i w_d) x rotates at the rate w_d and decays at the
        rate beta; its size and angle at both edges give one equation for c.
        """
        edge = self.edge

        def balance(c: mpfr) -> mpfr:
            beta = c / 2
            turn = sqrt(self.zone - beta**2)
            angle = atan2(turn * edge, exit_ + beta * edge) + atan2(turn * edge, entry - beta * edge)
            sizes = (exit_**2 + c * edge * exit_ + self.zone * edge**2) / (
                entry**2 - c * edge * entry + self.zone * edge**2
            )
            return log(sizes) / 2 + beta / turn * angle

        # the damping is below critical for the benchmark's e
        return root(balance, mpfr(0), mpfr("1.999999") * sqrt(self.zone))

    def rests(self, force: mpfr, after: mpfr, left: mpfr) -> bool:
        """Return True if it is proved that all bounces after this impact end within the time `left` and below the peak.

        The inward acceleration is at least margin - softening x, and its part due to the force changes by `jerk` in
        the time left.  A bounce therefore lasts at most 2 v/a, is at most v²/2a high, and ends with at most
        sqrt(a_max/a_min) times its initial speed: if this factor times e is below 1, all later bounces are bounded too.
        """
        strongest = max(abs(force), abs(after))
        margin, softening, jerk = self.q2 * self.alpha - strongest, self.q2, abs(after - force)
        if self.exact:
            margin = self.q2 * (sin(self.alpha) - strongest * cos(self.alpha))
            softening, jerk = self.q2 * (1 + strongest), self.q2 * jerk
        if margin <= 0 or not left:
            return False
        self.coming_to_rest |= 2 * self.v <= left * (1 - self.e) * margin
        discriminant = margin**2 - 2 * softening * self.v**2
        if discriminant <= 0:
            return False
        least = (margin + sqrt(discriminant)) / 2
        duration, height = 2 * self.v / least, self.v**2 / (2 * least)
        e = self.e * sqrt(1 + (jerk / left * duration + softening * height) / least)
        return bool(e < 1 and duration <= (1 - e) * left and height <= self.peak)


class Result(NamedTuple):
    peak: mpfr
    overturned: bool
    impacts: int
    rotation: list[mpfr]


def integrate(problem: Problem, record: Iterable[float], factor: mpfr, digits: int = WORKING_DIGITS) -> Result:
    """Solve one run from rest, over the record times `factor` and the free motion after it."""
    set_digits(digits)
    motion = Motion(problem)
    dt = mpfr(DT)
    scale = factor / STANDARD_GRAVITY if motion.exact else factor * mpfr(problem.gain)
    forces = [scale * mpfr(float(a)) for a in record]
    rotation = [motion.rotation]
    for force, after in pairwise(forces):
        motion.sample(force, after, dt)
        rotation.append(motion.rotation)
    impacts, so_far = motion.impacts, len(motion.peaks)
    while not motion.overturned and motion.region != REST and len(motion.peaks) == so_far:
        motion.sample(mpfr(0), mpfr(0), dt)
    return Result(motion.peak, motion.overturned, impacts, rotation)
