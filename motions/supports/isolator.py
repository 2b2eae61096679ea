"""Isolators between a floor and a platform: linear ones, lead rubber (bilinear) and friction pendulums."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from ... import checks
from ...aliases import Array
from ...doubts import Doubt, warn
from ...units import STANDARD_GRAVITY
from ..arrays import records
from ..kernels.pendulum import pendulum_response
from ..kernels.yielding import storey_response
from .chain import Motion, chained, one_way_only
from .support import Support

FINE = 1e-3
"""Greatest time between samples of motions on a friction pendulum, whose acceleration jumps, s."""
LEAST_PERIOD, MOST_PERIOD = 0.01, 100.0
BILINEAR, PENDULUM = "bilinear", "pendulum"


class IsolatorStrikes(UserWarning):
    """Warning of motions under which an isolated platform moves further than its clearance."""


def strike_doubts(found: Sequence[xr.DataArray], clearance: float) -> list[Doubt]:
    """Return the doubt in a platform that moves further than its clearance, m (its ``support_displacement``)."""
    ways = np.concatenate([one["support_displacement"].values.ravel() for one in found])
    far = int((ways > clearance).sum())
    if not far:
        return []
    what = (
        f"the platform would strike its stops, {clearance:g} m away, under {far} of {ways.size} motions, by up to "
        f"{ways.max():.3g} m: strikes are not modelled"
    )
    return [Doubt("strike", what)]


LEAST_YIELD = 1e-6
"""Least displacement at which a bilinear isolator yields, m: below it a `pendulum` slides without yielding before."""


@dataclass(frozen=True)
class Isolator:
    """Isolator of a platform; made by `linear`, `bilinear` or `pendulum`.

    Attributes
    ----------
    kind : {"bilinear", "pendulum"}
    period : float
        Period once it has yielded or slips, s.
    strength : float
        Force at zero displacement over the weight: the strength of a lead core, the friction of a pendulum.
    yield_displacement : float
        Of a bilinear isolator, m.
    clearance : float
        Displacement at which the platform would strike a stop, m; infinite for none.
    mass_ratio, one_way
        As of `Support`.
    """

    kind: str
    period: float
    strength: float
    yield_displacement: float
    clearance: float
    mass_ratio: float
    one_way: bool

    @staticmethod
    def linear(period: float, damping: float, mass_ratio: float = 0.0, one_way: bool = False) -> Support:
        """Return a linear isolator: the elastic support of that period, s, and damping ratio.

        Examples
        --------
        >>> round(Isolator.linear(2.5, 0.1).transmissibility(1.0), 10)
        0.211999576
        """
        known = checks.number("period", period, at_least=LEAST_PERIOD, at_most=MOST_PERIOD, unit="s")
        return Support(1.0 / known, damping, mass_ratio, one_way)

    @classmethod
    def bilinear(
        cls,
        period: float,
        strength: float,
        yield_displacement: float = 0.01,
        *,
        clearance: float = math.inf,
        mass_ratio: float = 0.0,
        one_way: bool = False,
    ) -> Isolator:
        """Return a bilinear isolator, such as lead rubber.

        Parameters
        ----------
        period : float
            2 pi sqrt(m/k2) of the stiffness k2 after yielding, s.
        strength : float
            Force at zero displacement, Q, over the weight, > 0.
        yield_displacement : float
            Displacement at which it yields, m, > 0 (judgement: 5 to 15 mm).
        clearance : float
            Displacement at which the platform would strike a stop, m: strikes are not modelled, motions that reach it
            are warned of.
        mass_ratio, one_way
            As of `Support`; isolated buildings have 0.

        Raises
        ------
        TypeError, ValueError
            Values out of range.
        """
        # (each step of a slide that is as good as rigid-plastic takes as long as a thousand others)
        checks.number("yield_displacement", yield_displacement, at_least=LEAST_YIELD, unit="m")
        return cls(BILINEAR, period, strength, yield_displacement, clearance, mass_ratio, one_way)

    @classmethod
    def pendulum(
        cls,
        radius: float,
        friction: float,
        *,
        clearance: float = math.inf,
        mass_ratio: float = 0.0,
        one_way: bool = False,
    ) -> Isolator:
        """Return a friction pendulum.

        Parameters
        ----------
        radius : float
            Radius of the dish, m, > 0: the period is 2 pi sqrt(R/g).
        friction : float
            Coefficient of friction, > 0, the same at all speeds.
        clearance, mass_ratio, one_way
            As of `bilinear`.

        Raises
        ------
        TypeError, ValueError
            Values out of range.

        Notes
        -----
        u'' = -a - (g/R) u - mu g s; it sticks while |a + (g/R) u| <= mu g, and begins to slip against that pull.
        """
        period = 2.0 * math.pi * math.sqrt(checks.number("radius", radius, above=0.0, unit="m") / STANDARD_GRAVITY)
        return cls(PENDULUM, period, friction, 0.0, clearance, mass_ratio, one_way)

    def __post_init__(self) -> None:
        checks.number("period", self.period, at_least=LEAST_PERIOD, at_most=MOST_PERIOD, unit="s")
        name = "friction" if self.kind == PENDULUM else "strength"
        checks.number(name, self.strength, above=0.0, below=1.0)
        if not self.clearance > 0.0:
            raise ValueError(f"clearance must be > 0 (in m), got {self.clearance!r}")
        one_way_only(self.mass_ratio, self.one_way)

    def motions(self, motions: xr.DataArray, factor: float = 1.0) -> xr.DataArray:
        """Return the motions on top of the isolator under motions of one strength.

        Parameters
        ----------
        motions : xarray.DataArray
            Absolute accelerations of the ground (motion, time) or of floors (motion, floor, time), m s-2, from rest.
        factor : float
            Factor on them, > 0.

        Returns
        -------
        xarray.DataArray
            As given, at steps of 1 ms or less on a friction pendulum, whose acceleration jumps where it sticks or turns
            and is a straight line over such a step here; ``support_displacement`` (m), the greatest at the samples, on
            motion (and floor).  What yields does not scale: ``own_level`` bars analyses from it.

        Raises
        ------
        TypeError, ValueError
            As `toppling.motions.records`; pairs of components, vertical shaking, a factor <= 0.

        Examples
        --------
        >>> from toppling import motions
        >>> floor = motions.CloughPenzien(duration=5.0, dt=0.01).sample(2)
        >>> found = Isolator.pendulum(radius=1.5, friction=0.05).motions(floor)
        >>> dict(found.sizes), bool((abs(found).max("time") < abs(floor).max("time")).all())
        ({'motion': 2, 'time': 5001}, True)
        """
        scale = checks.number("factor", factor, above=0.0)
        slides = self.kind == PENDULUM
        parts = max(1, math.ceil(records(motions)[0].dt / FINE - 1e-9)) if slides else 1

        def on_top(acceleration: Array, dt: float) -> Motion:
            return self._pendulum(acceleration, dt, parts) if slides else self._bilinear(acceleration, dt)

        found = chained(motions, on_top, repr(self), parts, scale, level=True)
        warn(strike_doubts([found], self.clearance), IsolatorStrikes)
        return found

    def _pendulum(self, acceleration: Array, dt: float, parts: int) -> Motion:
        n = (acceleration.size - 1) * parts + 1
        displacement, found = np.empty((2, n))
        friction = self.strength * STANDARD_GRAVITY
        pendulum_response(acceleration, dt, parts, 2.0 * math.pi / self.period, friction, 0.0, displacement, found)
        return Motion(found, float(np.abs(displacement).max()))

    def _bilinear(self, acceleration: Array, dt: float) -> Motion:
        after = (2.0 * math.pi / self.period) ** 2
        initial = after + self.strength * STANDARD_GRAVITY / self.yield_displacement
        storeys = np.array([[initial], [self.yield_displacement], [after / initial], [0.0]])
        accelerations, velocities = np.empty((2, 1, acceleration.size))
        peaks, residual = np.empty((2, 1))
        no, far = np.zeros(2), np.full(1, np.inf)
        storey_response(acceleration, dt, np.ones(1), storeys, no, far, accelerations, velocities, peaks, residual)
        return Motion(accelerations[0], float(peaks[0]))
