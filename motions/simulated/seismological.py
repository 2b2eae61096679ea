"""Motions of a seismological model: windowed noise with the spectrum of an omega-squared source, path and site."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import scipy
import xarray as xr

from ...core import checks
from ...core.elementary import Array, exp, log, power
from ...core.parameters import SHARE, Parameter, check
from .generator import LARGEST, USUAL_STEP, Generator, Seconds, Streams, ensemble, steps_of
from .ground_motion_models import Scenario

SITES = ("generic-rock", "flat")

ROCK = 760.0  # m/s, V_S30 of this rock
# Crustal amplification of western generic rock with Vs30 = 760 m/s (Boore 2016), relative to a source at 3.5 km/s: Hz,
# factor.  The values were read in public code that cites the paper, not in the paper.
GENERIC_ROCK = (
    (0.010, 1.00), (0.015, 1.01), (0.021, 1.02), (0.031, 1.02), (0.045, 1.04), (0.065, 1.06), (0.095, 1.09),
    (0.138, 1.13), (0.200, 1.18), (0.291, 1.25), (0.423, 1.32), (0.615, 1.41), (0.894, 1.51), (1.301, 1.64),
    (1.892, 1.80), (2.751, 1.99), (4.000, 2.18), (5.817, 2.38), (8.459, 2.56), (12.301, 2.75), (17.889, 2.95),
    (26.014, 3.17), (37.830, 3.42), (55.012, 3.68), (80.000, 3.96),
)  # fmt: skip

# Path duration of active crustal regions (Boore and Thompson 2014): km, s; 0.156 s/km beyond the last distance.
PATH_DISTANCES = np.array([0.0, 7.0, 45.0, 125.0, 175.0, 270.0])
PATH_DURATIONS = np.array([0.0, 2.4, 8.4, 10.9, 17.4, 34.2])
PATH_SLOPE = 0.156

# Window of Saragoni and Hart as used by Boore: its peak is at EPSILON t_eta, and at t_eta = 2 T it has fallen to ETA.
EPSILON, ETA, STRETCH = 0.2, 0.05, 2.0
AFTER = 1.5  # end of the window over t_eta (at 0.4 % of its peak) if no duration is given
QUIET = 1.5  # quiet time before and after, times the corner frequency: the source filter acts both ways in time


@dataclass(frozen=True)
class Seismological(Generator):
    """Motions by the stochastic method of Boore: noise shaped by source, path and site spectra.

    Parameters
    ----------
    magnitude : float
        Moment magnitude.
    distance : float
        Effective point-source distance (hypocentral for small earthquakes), m.
    stress_drop : float
        Stress drop of the source, Pa; 8e6 Pa is 80 bar.
    kappa : float
        Attenuation exp(-pi kappa f) near the site, s.
    q0 : float
        Quality factor of the path at 1 Hz and below.
    q_exponent : float
        Growth of the quality factor with frequency above 1 Hz: q0 f^q_exponent.
    beta : float
        Shear-wave velocity at the source, m/s.
    density : float
        Density at the source, kg/m³.
    site : {"generic-rock", "flat"}
        Site amplification: of Boore's (2016) generic rock with Vs30 = 760 m/s, or 1.
    amplification : sequence of (float, float), optional
        Table that replaces `site`: frequency in Hz (increasing) and factor, both > 0; the logarithms are interpolated,
        and the factors are constant beyond the ends.
    dt : float
        Time step, s.
    duration : float, optional
        Length of the motions, s; by default the length that the window needs.

    Notes
    -----
    Acceleration spectrum A(f) = C M0 (2 pi f)² / [1 + (f/f0)²] x Z(R) exp[-pi f R/(Q beta)] x amplification x exp(-pi
    kappa f). Source: M0 = 10^(1.5 M + 9.045) N m, f0 = 0.49 beta (stress_drop/M0)^(1/3), C = 0.55 (1/sqrt 2) 2/(4 pi
    rho beta³ R0), R0 = 1 km. Path: Z = R0/R to 40 km, then (R0/40 km) sqrt(40 km/R). Duration T = 1/f0 + path duration.
    White noise under a window is transformed, divided by the root of its mean square amplitude, multiplied by A and
    transformed back. The root mean square amplitude over motions is therefore A. The source filter acts in both
    directions of time. Therefore 1.5/f0 without motion is left before and after, and motions end at rest: with less
    than 1e-3 of PGV. Without a low-cut filter the displacement has the long periods of the source.

    References
    ----------
    Boore, D. M. (2003). Simulation of ground motion using the stochastic method. Pure and Applied Geophysics 160,
    635-676.
    Boore, D. M. and Thompson, E. M. (2014). Path durations for use in the stochastic-method simulation of ground
    motions. Bulletin of the Seismological Society of America 104, 2541-2552.
    Boore, D. M. (2016). Determining generic velocity and density models for crustal amplification calculations.
    Bulletin of the Seismological Society of America 106, 316-320 (read in public code that cites it).

    Examples
    --------
    >>> Seismological(magnitude=5.5, distance=20e3, dt=0.01, duration=20.0).sample(2, seed=1).shape
    (2, 2001)
    """

    magnitude: Annotated[float, Parameter(at_least=3.0, at_most=8.5)] = 6.5
    distance: Annotated[float, Parameter("m", at_least=1e3, at_most=1e6)] = 20e3
    stress_drop: Annotated[float, Parameter("Pa", at_least=1e4, at_most=1e9)] = 8e6
    kappa: Annotated[float, Parameter("s", at_least=0.0, at_most=1.0)] = 0.04
    q0: Annotated[float, Parameter(above=0.0, at_most=LARGEST)] = 180.0
    q_exponent: Annotated[float, SHARE] = 0.45
    beta: Annotated[float, Parameter("m/s", at_least=100.0, at_most=1e4)] = 3500.0
    density: Annotated[float, Parameter("kg/m³", at_least=100.0, at_most=1e4)] = 2800.0
    site: Annotated[str, Parameter(words=SITES)] = "generic-rock"
    amplification: Sequence[tuple[float, float]] | None = None
    dt: Seconds = USUAL_STEP
    duration: Seconds | None = None

    def __post_init__(self) -> None:
        check(self)
        if self.amplification is not None:
            table = checks.finite_array("amplification", self.amplification, ndim=(2,))
            if table.shape[1] != 2 or table.min() <= 0.0 or np.any(np.diff(table[:, 0]) <= 0.0):
                raise ValueError("amplification must be pairs (frequency in Hz, factor), > 0, frequencies increasing")
            object.__setattr__(self, "amplification", tuple((float(f), float(a)) for f, a in table))
        if self.duration is not None:
            least = 2.0 * self._quiet + STRETCH * self.shaking
            if self.duration < least:
                raise ValueError(
                    f"duration must be at least {least:.1f} s (quiet, the window to 5 % of its peak, quiet), got "
                    f"{self.duration:g}"
                )
        steps_of(self.length, self.dt)

    @property
    def scenario(self) -> Scenario | None:
        rock = self.site == SITES[0] and self.amplification is None
        return Scenario(self.magnitude, self.distance, ROCK) if rock else None

    @property
    def moment(self) -> float:
        """Seismic moment, N m."""
        return float(10.0 ** (1.5 * (self.magnitude + 6.03)))

    @property
    def corner(self) -> float:
        """Corner frequency of the source, Hz."""
        return float(0.49 * self.beta * (self.stress_drop / self.moment) ** (1.0 / 3.0))

    @property
    def shaking(self) -> float:
        """Duration T of the motion from source and path, s."""
        km = self.distance / 1e3
        path = float(np.interp(km, PATH_DISTANCES, PATH_DURATIONS))
        return 1.0 / self.corner + path + PATH_SLOPE * max(0.0, km - float(PATH_DISTANCES[-1]))

    @property
    def length(self) -> float:
        """Length of the motions, s."""
        if self.duration is not None:
            return self.duration
        return float(math.ceil(2.0 * self._quiet + AFTER * STRETCH * self.shaking))

    @property
    def _quiet(self) -> float:
        return QUIET / self.corner

    def spectrum(self, frequency: Array) -> Array:
        """Return the Fourier amplitude of acceleration at `frequency` (Hz, >= 0), m/s, in the same shape."""
        f = np.asarray(frequency, dtype=np.float64)
        km = self.distance / 1e3
        constant = 0.55 / math.sqrt(2.0) * 2.0 / (4.0 * math.pi * self.density * self.beta**3 * 1e3)
        source = constant * self.moment * (2.0 * math.pi * f) ** 2 / (1.0 + (f / self.corner) ** 2)
        spreading = 1.0 / km if km <= 40.0 else math.sqrt(40.0 / km) / 40.0
        quality = self.q0 * power(np.maximum(f, 1.0), self.q_exponent)
        decay = exp(-math.pi * f * (self.distance / (quality * self.beta) + self.kappa))
        return np.asarray(source * spreading * decay * self._amplification(f))

    def window(self, time: Array) -> Array:
        """Return the window of the noise at times from its start (s), at most 1, in the same shape."""
        b = -EPSILON * math.log(ETA) / (1.0 + EPSILON * (math.log(EPSILON) - 1.0))
        x = np.maximum(np.asarray(time, dtype=np.float64), 0.0) / (STRETCH * self.shaking)
        return power(math.e / EPSILON * x, b) * exp(-b / EPSILON * x)

    def sample(self, n: int, seed: int = 0, first: int = 0) -> xr.DataArray:
        """Return motions `first` … `first + n - 1` of `seed`; see `KanaiTajimi.sample`."""
        steps = steps_of(self.length, self.dt)
        size = scipy.fft.next_fast_len(steps + 1, real=True)
        front = round(self._quiet / self.dt)
        window = self.window(np.arange(steps + 1 - 2 * front, dtype=np.float64) * self.dt)
        target = self.spectrum(np.asarray(np.fft.rfftfreq(size, self.dt), dtype=np.float64)) / self.dt

        def make(streams: Streams) -> Array:
            motions = np.empty((len(streams), steps + 1))
            padded = np.zeros(size)
            # one motion at a time: the transform of many rows may round each row differently
            for row, random in zip(motions, streams, strict=True):
                padded[front : front + window.size] = window * random.standard_normal(window.size)
                noise = np.fft.rfft(padded)
                noise *= target / math.sqrt(np.mean(noise.real**2 + noise.imag**2))
                row[:] = np.fft.irfft(noise, size)[: steps + 1]
            return motions

        return ensemble(self, n, seed, first, steps, self.dt, make)

    def _amplification(self, frequency: Array) -> Array:
        if self.amplification is None and self.site == "flat":
            return np.ones_like(frequency)
        table = log(np.array(GENERIC_ROCK if self.amplification is None else self.amplification))
        return exp(np.interp(log(frequency), table[:, 0], table[:, 1]))
