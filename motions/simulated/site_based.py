"""Site-based stochastic motions: high-passed noise of drifting frequency with a gamma modulating function.

The parameters of the process are given, fitted to a record, or drawn for an earthquake and a site.
"""

import math
from abc import abstractmethod
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
import scipy
import xarray as xr

from ...core import checks
from ...core.elementary import Array, Flags, Index, arccos, arcsin, orthonormal, solve, times
from ...core.parameters import Parameter, check
from ...core.streams import stream
from ...core.units import STANDARD_GRAVITY, described, variables
from ..arrays import records
from ..intensity.cumulative import energy_at_samples
from ..kernels.drifting_filters import LANES, drifting_noise
from .filters import filtered, high_pass, settling
from .generator import LARGEST, USUAL_STEP, Generator, Seconds, Streams, counts, ensemble, normals, steps_of
from .ground_motion_models import Scenario
from .modulation import Modulation, modulation, ratio_limits
from .scenario import (
    PUBLISHED_CONSTANT,
    STRIKE_SLIP,
    UNITS,
    Faulting,
    Parameters,
    SiteBasedEquations,
    Velocity,
    corner_frequency,
)

LEAST_OMEGA = 0.6 * math.pi  # 0.3 Hz
ALL_ENERGY = 0.995  # fraction of the energy that must have arrived before the high-pass dies out
MOST_TRIES = 1000
LEAST_ZETA, MOST_ZETA = 0.005, 0.99
COUNTED = (0.01, 0.99)  # fractions of the energy between which crossings and extremes are counted
LEAST_CROSSINGS = 10
MOST_WORK = 1e8
"""Maximum product of the numbers of samples of a motion and of its longest response: about 2 s of work."""
PART_WORK = MOST_WORK / 16.0
"""The same product, summed over vectors of motions, after which an interrupt is heard."""
PASSES = 6  # alternating passes of frequency and damping ratio, which changes the frequency by a few per cent at most
DEFAULT_CORNER = 0.15  # `corner_frequency` of magnitude 6.5


@dataclass(frozen=True)
class SiteBased(Generator):
    """Fully non-stationary motions of Rezaeian and Der Kiureghian, with given parameters.

    Parameters
    ----------
    arias : float
        Expected Arias intensity pi/(2 g) integral a² dt before the high-pass, m/s.
    d5_95 : float
        Time from 5 to 95 % of the Arias intensity, s, at most 4.92 t_mid.
    t_mid : float
        Time to 45 % of the Arias intensity, s.
    omega_mid : float
        Filter frequency at t_mid, rad/s.
    omega_slope : float
        Slope of the filter frequency, rad/s².
    zeta : float
        Damping ratio of the filter.
    f_c : float
        Corner of the critically damped high-pass, Hz, which governs the peak velocity and so the overturning of blocks.
        The usual 0.1 Hz gives 1.45 times the PGV of 0.3 Hz (M 6.5, 20 km).
    dt : float
        Time step, s.
    duration : float, optional
        Length of the motions, s; by default the length that the motion needs.

    Notes
    -----
    The process is x(t) = q(t) sum_i h(t - t_i; omega(t_i), zeta) u_i / sqrt(sum_i h²), with u_i ~ N(0, 1) on every
    sample. The discrete sum itself has unit variance, so that the law of x converges as dt -> 0. Here q² is a gamma
    density times 2 g Ia/pi. The frequency omega(t) = omega_mid + omega_slope (t - t_mid) is limited to 0.3 Hz and half
    the Nyquist frequency. The motion is z'' of z'' + 2 w z' + w² z = x with w = 2 pi f_c. The excitation is cut off
    10/w before the end; at least 99.5 % of the energy has arrived. Motions therefore end at rest: with less than 1e-3
    of PGV.

    References
    ----------
    Rezaeian, S. and Der Kiureghian, A. (2008). A stochastic ground motion model with separable temporal and spectral
    nonstationarities. Earthquake Engineering and Structural Dynamics 37, 1565-1584.

    Examples
    --------
    >>> SiteBased(d5_95=8.0, t_mid=4.0, duration=25.0, dt=0.01).sample(2, seed=1).shape
    (2, 2501)
    """

    own_amplitude: ClassVar[bool] = False

    arias: Annotated[float, Parameter("m/s", above=0.0, at_most=LARGEST)] = 0.5
    d5_95: Seconds = 12.0
    t_mid: Seconds = 7.0
    omega_mid: Annotated[float, Parameter("rad/s", above=0.0, at_most=LARGEST)] = 10.0 * math.pi
    omega_slope: float = -0.2 * math.pi
    zeta: Annotated[float, Parameter(at_least=LEAST_ZETA, at_most=MOST_ZETA)] = 0.2
    f_c: Annotated[float, Parameter("Hz", above=0.0, at_most=LARGEST)] = DEFAULT_CORNER
    dt: Seconds = USUAL_STEP
    duration: Seconds | None = None

    def __post_init__(self) -> None:
        check(self)
        checks.number("omega_slope", self.omega_slope, at_least=-LARGEST, at_most=LARGEST)
        low, high = ratio_limits(0.45)
        if not low <= self.d5_95 / self.t_mid <= high:
            raise ValueError(
                f"d5_95/t_mid must be {low:.3g} to {high:.3g} for a gamma modulating function, got "
                f"{self.d5_95:g}/{self.t_mid:g} = {self.d5_95 / self.t_mid:.3g}"
            )
        least = end_of(self._modulation(), self.f_c)
        if self.duration is not None and self.duration < least:
            raise ValueError(
                f"duration must be at least {least:.1f} s (99.5 % of the energy, then the high-pass dies out), got "
                f"{self.duration:g}"
            )
        steps_of(self.length, self.dt)

    @property
    def length(self) -> float:
        """Length of the motions, s."""
        return math.ceil(end_of(self._modulation(), self.f_c)) if self.duration is None else self.duration

    @classmethod
    def fit(cls, motion: xr.DataArray, f_c: float = DEFAULT_CORNER) -> "SiteBased":
        """Return the generator with the parameters of one recorded motion.

        Parameters
        ----------
        motion : xarray.DataArray
            Exactly one motion.
        f_c : float
            Corner of the high-pass, Hz, which cannot be found from the record.

        Raises
        ------
        ValueError
            More than one motion, a motion of zeros, or a record whose energy arrives too early for a gamma function.

        Notes
        -----
        Arias intensity, D5-95 and t_mid are the record's. The slope and the middle of the cumulative count of
        zero-level up-crossings (least squares, 1 to 99 % of the energy) give the frequency. The total count of positive
        minima and negative maxima gives the damping ratio: the statistics of Rezaeian and Der Kiureghian (2008). Both
        rates of the sampled filtered noise are known in closed form (orthant probabilities of three neighbours), so
        that no simulation is needed.
        """
        parameters, dt = _fitted(motion)
        return cls(**parameters, f_c=f_c, dt=dt)

    def sample(self, n: int, seed: int = 0, first: int = 0) -> xr.DataArray:
        """Return motions `first` … `first + n - 1` of `seed`; see `KanaiTajimi.sample`."""
        return ensemble(self, n, seed, first, steps_of(self.length, self.dt), self.dt, self._make)

    def _parameters(self, n: int) -> Parameters:
        values = (self.arias, self.d5_95, self.t_mid, self.omega_mid, self.omega_slope, self.zeta)
        return Parameters(*(np.full(n, value) for value in values))

    def _modulation(self) -> Modulation:
        return modulation(np.array([self.d5_95]), np.array([self.t_mid]))

    def _make(self, streams: Streams) -> Array:
        parameters = self._parameters(len(streams))
        return site_based_motions(streams, parameters, 0.45, self.f_c, self.dt, steps_of(self.length, self.dt))


Corner = Annotated[float, Parameter("Hz", above=0.0, at_most=1e3)]
"""Type of the corner of a high-pass."""


def outside_data(*rows: tuple[str, float, str, bool, str]) -> str:
    """Return the quantities that are not inside the data, of rows of name, value, unit, True if inside, and data."""
    return "; ".join(f"{name} {value:g}{unit}, data {data}" for name, value, unit, inside, data in rows if not inside)


class ScenarioGenerator(Generator):
    """Generator of motions for an earthquake and a site, whose length follows from the times that are drawn."""

    magnitude: float
    distance: float
    vs30: float
    faulting: str
    f_c: Corner | None
    dt: Seconds
    duration: Seconds | None
    late: ClassVar[float]
    """Number of standard deviations above the median times for which the default length is sufficient."""

    def __post_init__(self) -> None:
        check(self)
        if self.duration is not None:
            least = self._needed(0.0)
            if not self.duration >= least:
                raise ValueError(
                    f"duration must be at least {least:.1f} s, which motions with the median times need, got "
                    f"{self.duration:g}"
                )
        steps_of(self.length, self.dt)

    @property
    def scenario(self) -> Scenario:
        return Scenario(self.magnitude, self.distance, self.vs30, self.faulting, getattr(self, "depth", 0.0))

    @property
    def corner(self) -> float:
        """Corner of the high-pass that is used, Hz."""
        return corner_frequency(self.magnitude) if self.f_c is None else self.f_c

    @property
    def length(self) -> float:
        """Length of the motions, s."""
        return float(math.ceil(self._needed(self.late))) if self.duration is None else self.duration

    def sample(self, n: int, seed: int = 0, first: int = 0) -> xr.DataArray:
        """Return motions `first` … `first + n - 1` of `seed`; see `KanaiTajimi.sample`."""
        return ensemble(self, n, seed, first, steps_of(self.length, self.dt), self.dt, self._make)

    @abstractmethod
    def _needed(self, errors: float) -> float:
        """Return the length (s) that is needed for times at `errors` standard deviations above their medians."""

    @abstractmethod
    def _make(self, streams: Streams) -> Array:
        """Return motions (motion, time) from their streams."""

    def _labelled(self, seed: int, first: int, columns: dict[str, tuple[Array, str, str]]) -> xr.Dataset:
        """Return drawn parameters (values, unit and long name, by name) as a dataset on ``motion``."""
        n = len(next(iter(columns.values()))[0])
        labels = np.array([f"{type(self).__name__} {seed}-{first + i}" for i in range(n)], dtype=object)
        return xr.Dataset(
            variables("motion", columns),
            {"motion": ("motion", labels, described("motion"))},
        )


@dataclass(frozen=True)
class SiteBasedScenario(ScenarioGenerator):
    """Site-based motions for an earthquake and a site; every motion draws its own parameters.

    Parameters
    ----------
    magnitude : float
        Moment magnitude (data: 6.1 to 7.7).
    distance : float
        Closest distance to the rupture, m (data: 10 to 100 km).
    vs30 : float
        Shear-wave velocity of the uppermost 30 m, m/s (data: above 600).
    faulting : {"strike-slip", "reverse"}
        Style of faulting.
    f_c : float, optional
        Corner of the high-pass, Hz; 10^(1.4071 - 0.3452 M) if not given.
    dt : float
        Time step, s.
    duration : float, optional
        Length of the motions, s; by default sufficient for times 2.5 standard deviations above their medians.
    arias_constant : float
        Constant of the equation of the Arias intensity, which sets the strength of the motions. It is -1.844 as
        published in 2010, or -2.2962 as in later code, which is nearer to ground-motion models.

    Notes
    -----
    A draw is repeated, from the motion's own stream, while no gamma modulating function has its D5-95 and t_mid. It is
    also repeated while 99.5 % of its energy and the decay of the high-pass do not fit into the duration (`redrawn`
    counts both). A short duration therefore excludes long motions: keep the default, or check `redrawn`.

    The published equations give higher motions than ground-motion models. For M 6.5 at 20 km on 760 m/s the medians of
    PGA and PGV are 1.65 and 1.55 times the medians of Boore et al. (2014). With the later constant they are 1.2 and 1.1
    times. Compare (`over_model`) before you rely on the level of a scenario. Motions that are scaled to levels of an
    intensity measure, as in an IDA, do not depend on it.

    Examples
    --------
    >>> SiteBasedScenario(magnitude=6.5, distance=20e3, duration=60.0, dt=0.02).sample(2, seed=1).shape
    (2, 3001)
    """

    magnitude: Annotated[float, Parameter(at_least=5.0, at_most=8.5)] = 6.5
    distance: Annotated[float, Parameter("m", at_least=1e3, at_most=2e5)] = 20e3
    vs30: Velocity = 760.0
    faulting: Faulting = STRIKE_SLIP
    f_c: Corner | None = None
    dt: Seconds = USUAL_STEP
    duration: Seconds | None = None
    arias_constant: Annotated[float, Parameter(at_least=-5.0, at_most=0.0)] = PUBLISHED_CONSTANT

    late: ClassVar[float] = 2.5

    @property
    def outside(self) -> str:
        return outside_data(
            ("magnitude", self.magnitude, "", 6.1 <= self.magnitude <= 7.7, "6.1 to 7.7"),
            ("distance", 1e-3 * self.distance, " km", 1e4 <= self.distance <= 1e5, "10 to 100 km"),
            ("V_S30", self.vs30, " m/s", self.vs30 >= 600.0, "above 600 m/s"),
        )

    @property
    def equations(self) -> SiteBasedEquations:
        """The predictive equations of the scenario."""
        return SiteBasedEquations(self.magnitude, self.distance, self.vs30, self.faulting, self.arias_constant)

    def _needed(self, errors: float) -> float:
        parameters = self.equations.at(np.full(6, errors))
        return end_of(modulation(np.array([parameters.d5_95]), np.array([parameters.t_mid])), self.corner)

    def parameters(self, n: int, seed: int = 0, first: int = 0) -> xr.Dataset:
        """Return the drawn parameters of motions `first` … `first + n - 1` and the number of repeated draws."""
        n, seed, first = counts(n, seed, first)
        drawn, redrawn = self._draw([stream(seed, first + i) for i in range(n)])
        columns = {name: (values, *UNITS[name]) for name, values in drawn._asdict().items()}
        columns["redrawn"] = (redrawn, "1", "draws that were not used")
        return self._labelled(seed, first, columns)

    def _draw(self, streams: Streams) -> tuple[Parameters, Index]:
        equations = self.equations
        scores = np.empty((len(streams), 6))
        redrawn = np.full(len(streams), -1)
        left = np.arange(len(streams))
        for _ in range(MOST_TRIES):
            for i in left:
                scores[i] = equations.draw(streams[i])
            redrawn[left] += 1
            drawn = equations.parameters(scores[left])
            left = left[~fits(drawn, 0.45, self.corner, self.length)]
            if left.size == 0:
                return equations.parameters(scores), redrawn
        raise ValueError(f"no motion of this scenario fits into {self.length:g} s: raise duration or f_c")

    def _make(self, streams: Streams) -> Array:
        drawn, _ = self._draw(streams)
        return site_based_motions(streams, drawn, 0.45, self.corner, self.dt, steps_of(self.length, self.dt))


def fits(parameters: Parameters, middle: float, f_c: float, length: float) -> Flags:
    """Return True for motions (motion,) that have a modulating function and end within `length` s."""
    shape = modulation(parameters.d5_95, parameters.t_mid, middle)
    end = shape.time_of(ALL_ENERGY) + settling(2.0 * math.pi * f_c)
    return np.asarray(end <= length)  # False for NaN, without a modulating function


def end_of(shape: Modulation, f_c: float) -> float:
    """Return the time at which one motion is at rest, s."""
    return float(shape.time_of(ALL_ENERGY)[0]) + settling(2.0 * math.pi * f_c)


def site_based_motions(streams: Streams, drawn: Parameters, middle: float, f_c: float, dt: float, steps: int) -> Array:
    """Return motions (motion, steps + 1), m/s², of parameters (motion,) that fit; `t_mid` is at energy `middle`."""
    live = steps + 1 - math.ceil(settling(2.0 * math.pi * f_c) / dt)
    time = np.arange(live, dtype=np.float64) * dt
    omega = drawn.omega_mid[:, None] + drawn.omega_slope[:, None] * (time - drawn.t_mid[:, None])
    np.clip(omega, LEAST_OMEGA, 0.5 * math.pi / dt, out=omega)
    shape = modulation(drawn.d5_95, drawn.t_mid, middle)
    # The last millionth of the energy is left out: it has no visible effect, and costs most, at the lowest frequencies.
    ends = np.minimum(np.ceil(shape.time_of(1.0 - 1e-6) / dt) + 1.0, live).astype(np.int64)
    density = shape.density(time)
    density *= (2.0 * STANDARD_GRAVITY / math.pi) * drawn.arias[:, None]
    motions = np.zeros((len(streams), steps + 1))
    life = (1.0 / omega).mean(axis=1) / drawn.zeta  # (the motions computed together should cost about the same)
    order = np.argsort(ends * life, kind="stable")
    work = ends * life / dt
    if work.max() > MOST_WORK:
        least = 1.05 * dt * math.sqrt(work.max() / MOST_WORK)
        raise ValueError(f"dt must be at least {least:.2g} s for motions of this length and damping, got {dt:g}")
    # Vectors of motions last as long as their longest motion; an interrupt is heard between the parts.
    costs = np.cumsum(np.maximum.reduceat(work[order], np.arange(0, order.size, LANES)))
    parts = np.split(order, LANES * (np.flatnonzero(np.diff(costs // PART_WORK)) + 1))
    pulses = normals(streams, live)
    for part in parts:
        motions[part, :live] = drifting_noise(pulses[part], omega[part], drawn.zeta[part], dt, ends[part])
    motions[:, :live] *= np.sqrt(density)
    return filtered(motions, *high_pass(2.0 * math.pi * f_c, 1.0), dt)


def _fitted(motion: xr.DataArray) -> tuple[dict[str, float], float]:
    """Return the parameters of one record by name (SI), and its time step (s); see `SiteBased.fit`."""
    plain = records(motion)
    if len(plain) != 1:
        raise ValueError(f"motion must hold exactly one motion to be fitted, got {len(plain)}")
    record = plain[0]
    a, dt = record.acceleration, record.dt
    energy = energy_at_samples(a, dt)
    if not energy[-1] > 0.0:
        raise ValueError(f"motion {record.label!r} must shake to be fitted, got zeros only")
    arias = math.pi / (2.0 * STANDARD_GRAVITY) * energy[-1]
    time = np.arange(a.size, dtype=np.float64) * dt
    first, t05, t45, t95, last = np.interp([COUNTED[0], 0.05, 0.45, 0.95, COUNTED[1]], energy / energy[-1], time)
    low, high = ratio_limits(0.45)
    if not low <= (t95 - t05) / t45 <= high:
        raise ValueError(
            f"motion {record.label!r} must have D5-95/t_mid of {low:.3g} to {high:.3g} for a gamma "
            f"modulating function, got {t95 - t05:.3g}/{t45:.3g} s: "
            + ("cut off some of its quiet start" if (t95 - t05) / t45 < low else "put quiet before it")
        )
    omega, slope, zeta = _spectral(a, dt, time, t45, (time >= first) & (time <= last))
    values = (arias, t95 - t05, t45, omega, slope, zeta)
    return dict(zip(Parameters._fields, map(float, values), strict=True)), dt


def _spectral(a: Array, dt: float, time: Array, t_mid: float, counted: Flags) -> tuple[float, float, float]:
    """Return the frequency at `t_mid` (rad/s), its slope (rad/s²) and the damping ratio."""
    ups = np.zeros(a.size)
    ups[1:] = (a[:-1] < 0.0) & (a[1:] >= 0.0)
    crossings = np.cumsum(ups)
    x = time[counted] - t_mid
    if ups[counted].sum() < LEAST_CROSSINGS:
        raise ValueError(f"motion must cross zero upwards {LEAST_CROSSINGS} times to be fitted, got fewer")
    # N(t) = N_0 + [omega_mid x + slope x²/2]/(2 pi)
    basis = np.stack([np.ones_like(x), x, 0.5 * x * x], axis=1)
    across = orthonormal(basis).T
    _, apparent, apparent_slope = 2.0 * math.pi * solve(times(across, basis), times(across, crossings[counted]))
    rises, falls = a[1:-1] - a[:-2], a[1:-1] - a[2:]
    extremes = ((rises < 0.0) & (falls < 0.0) & (a[1:-1] > 0.0)) | ((rises > 0.0) & (falls > 0.0) & (a[1:-1] < 0.0))
    observed = int(extremes[counted[1:-1]].sum())
    seen = np.maximum(apparent + apparent_slope * x, 1e-3 * abs(apparent))
    zeta, ratio = 0.3, 1.0
    for _ in range(PASSES):
        omega = np.minimum(seen / ratio, 0.5 * math.pi / dt)

        def excess(value: float, omega: Array = omega) -> float:
            return float(small_extremes(omega, value, dt).sum()) - observed

        if excess(LEAST_ZETA) >= 0.0:
            zeta = LEAST_ZETA
        elif excess(MOST_ZETA) <= 0.0:
            zeta = MOST_ZETA
        else:
            zeta = float(scipy.optimize.brentq(excess, LEAST_ZETA, MOST_ZETA, xtol=1e-6))
        middle = np.array([min(apparent / ratio, 0.5 * math.pi / dt)])
        ratio = float(crossing_frequency(middle, zeta, dt)[0] / middle[0])
    return apparent / ratio, apparent_slope / ratio, zeta


def _correlations(omega: Array, zeta: float, dt: float) -> tuple[Array, Array]:
    """Return the exact autocorrelations, at one and two steps, of noise pulses on samples through the oscillator.

    h_j = Im z^j with z = exp[(-zeta + i sqrt(1 - zeta²)) omega dt]: sum_j h_j h_(j+m) is a sum of two geometric series.
    """
    z = np.exp((-zeta + 1j * math.sqrt(1.0 - zeta * zeta)) * omega * dt)
    c = [(z**m / (1.0 - np.abs(z) ** 2) - z**m / (1.0 - z * z)).real for m in range(3)]
    return np.asarray(c[1] / c[0]), np.asarray(c[2] / c[0])


def crossing_frequency(omega: Array, zeta: float, dt: float) -> Array:
    """Return 2 pi times the rate of up-crossings of the sampled noise, arccos(rho_1)/dt, rad/s (omega as dt -> 0)."""
    return arccos(_correlations(omega, zeta, dt)[0]) / dt


def small_extremes(omega: Array, zeta: float, dt: float) -> Array:
    """Return the probability that a sample is a positive minimum or a negative maximum.

    It follows from the orthant probability of (x_(k-1) - x_k, x_(k+1) - x_k, x_k): 1/8 + sum of arcsines of the
    correlations/(4 pi).
    """
    lag_1, lag_2 = _correlations(omega, zeta, dt)
    with_level = -np.sqrt(0.5 * (1.0 - lag_1))
    between = (1.0 - 2.0 * lag_1 + lag_2) / (2.0 * (1.0 - lag_1))
    p = 0.125 + (arcsin(np.clip(between, -1.0, 1.0)) + 2.0 * arcsin(with_level)) / (4.0 * math.pi)
    return np.asarray(2.0 * np.maximum(p, 0.0))
