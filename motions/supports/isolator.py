"""Isolators between a floor and a platform: linear, lead rubber (bilinear) and friction pendulums, with stops."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, overload

import numpy as np
import xarray as xr

from ...core import checks
from ...core.aliases import Array
from ...core.doubts import noted, warn
from ...core.parameters import Parameter
from ...core.units import STANDARD_GRAVITY
from ..arrays import records
from ..kernels.pendulum import pendulum_response
from ..kernels.stops import stopped_response
from ..kernels.yielding import storey_response
from ..plausibility import unusual
from .chain import Motion, chained, one_way_only
from .stops import RESTITUTION, Clearance, Frequency, Restitution, Stops
from .support import Damping, MassRatio, OneWay, Support

FINE = 1e-3
"""Maximum time between samples of motions on a friction pendulum, whose acceleration jumps, s."""
PERIOD, SHARE = Parameter("s", at_least=0.01, at_most=100.0), Parameter(above=0.0, below=1.0)
# (below it a pendulum slides without yielding before)
RADIUS = Parameter("m", above=0.0)
YIELD = Parameter("m", at_least=1e-6, written="mm")
Period = Annotated[float, PERIOD]
Share = Annotated[float, SHARE]
LINEAR, BILINEAR, PENDULUM = "linear", "bilinear", "pendulum"


class IsolatorStrikes(UserWarning):
    """Warning of motions under which an isolated platform moves further than its clearance."""


@dataclass(frozen=True)
class Isolator:
    """Isolator of a platform; made by `linear`, `bilinear` or `pendulum`.

    Parameters
    ----------
    clearance : float
        Displacement at which the platform strikes a stop, m; none if not given.
    stop_frequency : float, optional
        Natural frequency of platform and load on a stop, sqrt(k_s/m)/(2 pi), Hz, which gives the stop's stiffness; at
        least the isolator's. Contacts last at least 2 ms. The uplift of a block by a strike depends on it: try several.
        If not given, strikes are not modelled, and motions that reach the clearance cause a warning.
    stop_restitution : float
        Ratio of the platform's velocities after and before a strike (0.6 is assumed).
    mass_ratio : float
        Mass of the load over the mass of load and platform; must be at most 0.1 unless `one_way` is True.
    one_way : bool
        True to leave out the reaction of heavier blocks, too.

    Attributes
    ----------
    kind : {"linear", "bilinear", "pendulum"}
    period : float
        Period once it has yielded or slips, s.
    strength : float
        Force at zero displacement over the weight: the strength of a lead core, the friction of a pendulum.
    yield_displacement : float
        Of a bilinear isolator, m.
    damping : float
        Damping ratio of a linear one.
    stops : Stops
        Its stops.
    mass_ratio, one_way
        As of `Support`.
    """

    kind: str
    period: float
    strength: float
    yield_displacement: float
    damping: float
    stops: Stops
    mass_ratio: float
    one_way: bool

    @overload
    @classmethod
    def linear(
        cls, period: float, damping: float, mass_ratio: float = 0.0, one_way: bool = False, *, clearance: None = None
    ) -> Support: ...

    @overload
    @classmethod
    def linear(
        cls,
        period: float,
        damping: float,
        mass_ratio: float = 0.0,
        one_way: bool = False,
        *,
        clearance: float,
        stop_frequency: float | None = None,
        stop_restitution: float = RESTITUTION,
    ) -> Isolator: ...

    @classmethod
    def linear(
        cls,
        period: Period,
        damping: Damping,
        mass_ratio: MassRatio = 0.0,
        one_way: OneWay = False,
        *,
        clearance: Clearance | None = None,
        stop_frequency: Frequency | None = None,
        stop_restitution: Restitution = RESTITUTION,
    ) -> Support | Isolator:
        """Return a linear isolator: without a clearance the elastic support of that period, s, and damping ratio.

        Parameters
        ----------
        period : float
            Period of the isolator, s.
        damping : float
            Damping ratio.
        mass_ratio, one_way
            As of `Support`.
        clearance, stop_frequency, stop_restitution
            As of the class. With stops it does not scale, because a strike depends on the strength of the motion.

        Examples
        --------
        >>> Isolator.linear(2.5, 0.1)
        Support(frequency=0.4, damping=0.1, mass_ratio=0.0, one_way=False)
        """
        PERIOD.check("period", period)
        with noted():  # (it is no bench)
            plain = Support(1.0 / period, damping, mass_ratio, one_way)
        if clearance is None and stop_frequency is None and stop_restitution == RESTITUTION:
            warn(unusual({"period of an isolator": period, "damping of an isolator": damping}))
            return plain
        stops = Stops(math.inf if clearance is None else clearance, stop_frequency, stop_restitution)
        return cls(LINEAR, period, 0.0, 0.0, damping, stops, mass_ratio, one_way)

    @classmethod
    def bilinear(
        cls,
        period: Period,
        strength: Share,
        yield_displacement: Annotated[float, YIELD] = 0.01,
        *,
        clearance: Clearance = math.inf,
        stop_frequency: Frequency | None = None,
        stop_restitution: Restitution = RESTITUTION,
        mass_ratio: MassRatio = 0.0,
        one_way: OneWay = False,
    ) -> Isolator:
        """Return a bilinear isolator, such as lead rubber.

        Parameters
        ----------
        period : float
            Period 2 pi sqrt(m/k2) of the stiffness k2 after yielding, s.
        strength : float
            Force at zero displacement, Q, over the weight.
        yield_displacement : float
            Displacement at which it yields (assumed: 5 to 15 mm), m.
        clearance, stop_frequency, stop_restitution, mass_ratio, one_way
            As of the class; isolated buildings have no mass ratio.
        """
        # (each step of a slide that is as good as rigid-plastic takes as long as a thousand others)
        YIELD.check("yield_displacement", yield_displacement)
        stops = Stops(clearance, stop_frequency, stop_restitution)
        return cls(BILINEAR, period, strength, yield_displacement, 0.0, stops, mass_ratio, one_way)

    @classmethod
    def pendulum(
        cls,
        radius: Annotated[float, RADIUS],
        friction: Share,
        *,
        clearance: Clearance = math.inf,
        stop_frequency: Frequency | None = None,
        stop_restitution: Restitution = RESTITUTION,
        mass_ratio: MassRatio = 0.0,
        one_way: OneWay = False,
    ) -> Isolator:
        """Return a friction pendulum.

        Parameters
        ----------
        radius : float
            Radius of the dish, m: the period is 2 pi sqrt(R/g).
        friction : float
            Coefficient of friction, the same at all speeds.
        clearance, stop_frequency, stop_restitution, mass_ratio, one_way
            As of the class.

        Notes
        -----
        u'' = -a - (g/R) u - mu g s; it sticks while |a + (g/R) u| <= mu g, and begins to slip against that pull.
        """
        period = 2.0 * math.pi * math.sqrt(RADIUS.number("radius", radius) / STANDARD_GRAVITY)
        stops = Stops(clearance, stop_frequency, stop_restitution)
        return cls(PENDULUM, period, friction, 0.0, 0.0, stops, mass_ratio, one_way)

    def __post_init__(self) -> None:
        checks.choice("kind", self.kind, [LINEAR, BILINEAR, PENDULUM])
        if not isinstance(self.stops, Stops):
            raise TypeError(f"stops must be Stops, got {checks.kind(self.stops)}")
        PERIOD.check("period", self.period)
        if self.kind != LINEAR:
            SHARE.check("friction" if self.kind == PENDULUM else "strength", self.strength)
        frequency, on_stop = 1.0 / self.period, self.stops.frequency
        if on_stop is not None and on_stop < frequency:
            raise ValueError(
                f"stop_frequency must be at least that of the isolator, {frequency:.3g} Hz, got {on_stop:g} Hz: a stop "
                "that is softer than the isolator hardly holds the platform"
            )
        one_way_only(self.mass_ratio, self.one_way)
        warn(
            unusual(
                {
                    "period of an isolator": self.period,
                    "damping of an isolator": self.damping,
                    "strength of an isolator": self.strength,
                    "displacement at which an isolator yields": self.yield_displacement,
                    "clearance of a platform": self.stops.clearance,
                }
            )
        )

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
            As given, at steps of 1 ms or less on a friction pendulum. Its acceleration jumps when it sticks or turns,
            and is a straight line over such a step here. Steps are at most a twentieth of a contact with a stop. On
            motion (and floor): ``support_displacement`` (m), the maximum at the samples. With a `stop_frequency` also
            ``strikes``, the number of times that a stop begins to push, and ``strike_acceleration`` (m s-2), the
            maximum at the samples while one pushes. The stiffness of the stops decides if a block uplifts in a strike.
            Motions of yielding isolators and of strikes do not scale: ``own_level`` bars analyses from it.

        Raises
        ------
        TypeError, ValueError
            As `toppling.motions.records`; pairs of components, a vertical component, a factor <= 0.

        Examples
        --------
        >>> from toppling import motions
        >>> floor = motions.CloughPenzien(duration=5.0, dt=0.01).sample(2)
        >>> moved = Isolator.pendulum(radius=1.5, friction=0.05).motions(floor)
        >>> dict(moved.sizes), bool((abs(moved).max("time") < abs(floor).max("time")).all())
        ({'motion': 2, 'time': 26231}, True)
        """
        scale = checks.number("factor", factor, above=0.0)
        dt = records(motions)[0].dt
        parts = max(1, math.ceil(dt / FINE - 1e-9)) if self.kind == PENDULUM else 1
        parts = max(parts, self.stops.parts(dt))

        def on_top(acceleration: Array, dt: float) -> Motion:
            if self.stops.modelled:
                return self._stopped(acceleration, dt, parts)
            if self.kind == LINEAR:
                return Support(1.0 / self.period, self.damping, self.mass_ratio, self.one_way).on_top(acceleration, dt)
            if self.kind == PENDULUM:
                return self._pendulum(acceleration, dt, parts)
            return self._bilinear(acceleration, dt)

        moved = chained(motions, on_top, repr(self), parts, scale, level=True, stops=self.stops.modelled)
        warn(self.stops.doubts([moved]), IsolatorStrikes)
        return moved

    def _stopped(self, acceleration: Array, dt: float, parts: int) -> Motion:
        omega, slip = 2.0 * math.pi / self.period, self.strength * STANDARD_GRAVITY
        after = initial = omega * omega
        yields = {LINEAR: math.inf, BILINEAR: self.yield_displacement, PENDULUM: 0.0}[self.kind]
        if self.kind == BILINEAR:
            initial += slip / yields
        spring = (2.0 * self.damping * omega, initial, after, yields, slip)
        displacement, response = np.empty((2, (acceleration.size - 1) * parts + 1))
        at_rest = (0.0, 0.0)
        strikes, peak = stopped_response(
            acceleration, dt, parts, spring, self.stops.over_mass, at_rest, displacement, response
        )
        return Motion(response, float(np.abs(displacement).max()), int(strikes), float(peak))

    def _pendulum(self, acceleration: Array, dt: float, parts: int) -> Motion:
        n = (acceleration.size - 1) * parts + 1
        displacement, response = np.empty((2, n))
        friction = self.strength * STANDARD_GRAVITY
        pendulum_response(acceleration, dt, parts, 2.0 * math.pi / self.period, friction, 0.0, displacement, response)
        return Motion(response, float(np.abs(displacement).max()))

    def _bilinear(self, acceleration: Array, dt: float) -> Motion:
        after = (2.0 * math.pi / self.period) ** 2
        initial = after + self.strength * STANDARD_GRAVITY / self.yield_displacement
        storeys = np.array([[initial], [self.yield_displacement], [after / initial], [0.0], [0.0]])
        accelerations, velocities = np.empty((2, 1, acceleration.size))
        peaks, residual = np.empty((2, 1))
        far = np.full(1, np.inf)
        storey_response(acceleration, dt, np.ones(1), storeys, 0.0, far, accelerations, velocities, peaks, residual)
        return Motion(accelerations[0], float(peaks[0]))
