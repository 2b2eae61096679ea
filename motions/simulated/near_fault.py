"""Near-fault motions: a site-based background plus a velocity pulse, both drawn for an earthquake and a site."""

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
import xarray as xr

from ...core.aliases import Array, Index
from ...core.parameters import Parameter
from ...core.streams import stream
from .directivity import MIDDLE, TRUNCATION, NearFaultEquations, background_parameters, pulse_parameters
from .generator import USUAL_STEP, Seconds, Streams, counts, steps_of
from .modulation import modulation
from .pulses import velocity_pulse
from .scenario import STRIKE_SLIP, UNITS, Faulting, Parameters, Velocity
from .site_based import MOST_TRIES, Corner, ScenarioGenerator, end_of, fits, outside_data, site_based_motions

WITH_PULSE = ("always", "probability", "never")
PULSE_UNITS = {
    "pulse_velocity": ("m s-1", "velocity amplitude of the pulse"),
    "pulse_period": ("s", "period of the pulse"),
    "pulse_gamma": ("1", "half cycles of the pulse"),
    "pulse_nu": ("rad", "phase of the pulse"),
    "pulse_time": ("s", "time of the middle of the pulse"),
}


@dataclass(frozen=True)
class NearFault(ScenarioGenerator):
    """Near-fault motions, in the direction of the largest pulse.

    Parameters
    ----------
    magnitude : float
        Moment magnitude.
    distance : float
        Closest distance to the rupture, m (data: below 31 km).
    vs30 : float
        Shear-wave velocity of the uppermost 30 m, m/s; values above 1100 count as 1100.
    faulting : {"strike-slip", "reverse"}
        Style of faulting.
    depth : float
        Depth of the top of the rupture, m; it counts in reverse faulting only, and up to 1 km.
    along : float
        Length of rupture towards the site (s of strike-slip, d of other faulting), m.
    angle : float
        Angle between rupture and site (theta or phi), rad.
    with_pulse : {"always", "probability", "never"}
        Motions with a pulse: all, each with the scenario's probability, or none.
    f_c : float, optional
        Corner of the background's high-pass, Hz; 10^(1.4071 - 0.3452 M) if not given.
    dt : float
        Time step, s.
    duration : float, optional
        Length of the motions, s; by default sufficient for all but rare draws.

    Notes
    -----
    Background: the process of `SiteBased`, with separate equations for sites near a fault (middle at 30 % of the
    energy). A gamma modulating function replaces the paper's piecewise function. Pulse: the pulse of
    `MavroeidisPapageorgiou` without residual displacement. V_p, T_p, gamma, nu and the time of the pulse are drawn
    together with the background's parameters. The time has a correlation of 0.79 with the middle of the background. The
    pulse is added after the high-pass. Draws are repeated as in `SiteBasedScenario`, and motions end at rest as in
    `SiteBased`.

    Examples
    --------
    >>> NearFault(magnitude=6.5, distance=5e3, duration=60.0, dt=0.02).sample(2, seed=1).shape
    (2, 3001)
    """

    magnitude: Annotated[float, Parameter(at_least=5.5, at_most=8.0)] = 7.0
    distance: Annotated[float, Parameter("m", at_least=0.0, at_most=5e4)] = 5e3
    vs30: Velocity = 500.0
    faulting: Faulting = STRIKE_SLIP
    depth: Annotated[float, Parameter("m", at_least=0.0, at_most=3e4)] = 0.0
    along: Annotated[float, Parameter("m", at_least=0.0, at_most=5e5)] = 2e4
    angle: Annotated[float, Parameter("rad", at_least=0.0, at_most=0.5 * math.pi)] = 0.0
    with_pulse: Annotated[str, Parameter(words=WITH_PULSE)] = "always"
    f_c: Corner | None = None
    dt: Seconds = USUAL_STEP
    duration: Seconds | None = None
    late: ClassVar[float] = TRUNCATION
    along_a_pulse: ClassVar[bool] = True

    @property
    def outside(self) -> str:
        return outside_data(("distance", 1e-3 * self.distance, " km", self.distance <= 31e3, "below 31 km"))

    @property
    def equations(self) -> NearFaultEquations:
        """The predictive equations of the scenario."""
        return NearFaultEquations(
            self.magnitude, self.distance, self.vs30, self.faulting, self.depth, self.along, self.angle
        )

    @property
    def _kinds(self) -> tuple[bool, ...]:
        return {"always": (True,), "never": (False,), "probability": (True, False)}[self.with_pulse]

    def _needed(self, errors: float) -> float:
        return max(self._needed_by(pulse, errors) for pulse in self._kinds)

    def _needed_by(self, pulse: bool, errors: float) -> float:
        scores = self.equations.at(np.full(11 if pulse else 6, errors), pulse)[None]
        background = background_parameters(scores)
        end = end_of(modulation(background.d5_95, background.t_mid, MIDDLE), self.corner)
        if not pulse:
            return end
        _, period, gamma, _, time = (float(value[0]) for value in pulse_parameters(scores))
        return max(end, time + 0.5 * gamma * period)

    def parameters(self, n: int, seed: int = 0, first: int = 0) -> xr.Dataset:
        """Return the drawn parameters of motions `first` … `first + n - 1`; NaN for motions without a pulse."""
        n, seed, first = counts(n, seed, first)
        background, pulse, redrawn = self._draw([stream(seed, first + i) for i in range(n)])
        named = {**UNITS, **PULSE_UNITS, "redrawn": ("1", "draws that were not used")}
        values = [*background, *pulse, redrawn]
        columns = {name: (value, *units) for (name, units), value in zip(named.items(), values, strict=True)}
        return self._labelled(seed, first, columns)

    def _draw(self, streams: Streams) -> tuple[Parameters, Array, Index]:
        """Return parameters (motion,), parameters of pulses (5, motion), NaN without a pulse, and the unused draws."""
        equations = self.equations
        chance = {"always": 1.0, "never": 0.0, "probability": equations.pulse_probability}[self.with_pulse]
        pulsed = np.array([random.random() < chance for random in streams])
        background = np.empty((len(streams), 6))
        pulse = np.full((5, len(streams)), np.nan)
        redrawn = np.full(len(streams), -1)
        left = np.arange(len(streams))
        for _ in range(MOST_TRIES):
            for i in left:
                scores = equations.draw(streams[i], bool(pulsed[i]))
                background[i] = scores[-6:]
                if pulsed[i]:
                    pulse[:, i] = [value[0] for value in pulse_parameters(scores[None])]
            redrawn[left] += 1
            good = fits(background_parameters(background[left]), MIDDLE, self.corner, self.length)
            half = 0.5 * pulse[2, left] * pulse[1, left]
            # NaN, for motions without a pulse, is never outside
            outside = (pulse[4, left] < half) | (pulse[4, left] + half > self.length)
            left = left[~good | outside]
            if left.size == 0:
                return background_parameters(background), pulse, redrawn
        raise ValueError(f"no motion of this scenario fits into {self.length:g} s: raise duration or f_c")

    def _make(self, streams: Streams) -> Array:
        background, pulse, _ = self._draw(streams)
        steps = steps_of(self.length, self.dt)
        motions = site_based_motions(streams, background, MIDDLE, self.corner, self.dt, steps)
        # differences of the pulse's velocity, not its acceleration, so that no velocity remains at any time step
        between = (np.arange(steps + 2, dtype=np.float64) - 0.5) * self.dt
        # one motion at a time: the values must not depend on the other motions
        for i, (velocity, period, gamma, nu, middle) in enumerate(pulse.T):
            if math.isfinite(velocity):
                form = velocity_pulse(between - middle, 2.0 * math.pi / period, gamma, nu, zero_residual=True)
                motions[i] += np.diff(form) * (velocity / self.dt)
        return motions
