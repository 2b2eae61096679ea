"""Kanai-Tajimi and Clough-Penzien motions whose ground frequency drifts, and their calibration."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar, Self, cast

import numpy as np
import scipy
import xarray as xr
from numpy.typing import NDArray

from .. import checks
from ..units import STANDARD_GRAVITY
from ._drifting import drifting_ground
from .arrays import records
from .ensembles import LARGEST, Generator, Streams, ensemble, normals, steps_of
from .envelopes import Envelope, RiseStrongDecay
from .filters import BASELINES, _filter
from .measures import measure
from .processing import parabolic_baseline

Values = NDArray[np.float64]
PSD_INSTANTS = 101  # of the drift, over which a density is averaged


@dataclass(frozen=True)
class EvolutionaryKanaiTajimi(Generator):
    """Gaussian white noise x envelope through a soil layer whose frequency drifts while it shakes.

    Parameters
    ----------
    omega_g : float or sequence of float
        Circular frequency of the ground, rad/s, > 0: one value (it stays), two (a linear drift) or more (a table).
    omega_g_times : sequence of float, optional
        Their times, s, increasing; linear between them and constant outside.  Evenly over the duration where not given.
    xi_g, s0, duration, dt, envelope, baseline
        As `KanaiTajimi`.

    Notes
    -----
    x'' + 2 xi_g omega_g(t) x' + omega_g(t)² x = w(t), acceleration 2 xi_g omega_g x' + omega_g² x: the frequency is
    constant within a time step (its value in the middle), and each step is solved exactly for noise that is linear
    between samples.  With a single frequency these are the motions of `KanaiTajimi`, number by number.

    References
    ----------
    Fan, F.-G. and Ahmadi, G. (1990). Nonstationary Kanai-Tajimi models for El Centro 1940 and Mexico City 1985
    earthquakes. Probabilistic Engineering Mechanics 5, 171-181 (recalled).

    Examples
    --------
    >>> generator = EvolutionaryKanaiTajimi(omega_g=(25.0, 8.0), duration=10.0, dt=0.01).calibrate_pga(3.0, n=20)
    >>> round(float(abs(generator.sample(20)).max("time").mean()), 6)
    3.0
    """

    own_amplitude: ClassVar[bool] = False

    omega_g: float | Sequence[float] = (8.0 * math.pi, 3.0 * math.pi)
    omega_g_times: Sequence[float] | None = None
    xi_g: float = 0.6
    s0: float = 0.01
    duration: float = 30.0
    dt: float = 0.005
    envelope: Envelope = field(default_factory=RiseStrongDecay)
    baseline: str = "parabolic"

    def __post_init__(self) -> None:
        given = self.omega_g if isinstance(self.omega_g, Sequence | np.ndarray) else (self.omega_g,)
        if len(given) == 0:
            raise ValueError("omega_g must hold at least one frequency, got none")
        values = tuple(checks.number("omega_g", value, above=0.0, at_most=LARGEST, unit="rad/s") for value in given)
        object.__setattr__(self, "omega_g", values)
        for name in ("xi_g", "s0"):
            checks.number(name, getattr(self, name), above=0.0, at_most=LARGEST)
        steps_of(self.duration, self.dt)
        if self.omega_g_times is not None:
            times = tuple(checks.number("omega_g_times", time, unit="s") for time in self.omega_g_times)
            if len(times) != len(values):
                raise ValueError(f"omega_g_times must hold one time a frequency, got {len(times)} for {len(values)}")
            if any(late <= early for early, late in itertools.pairwise(times)):
                raise ValueError(f"omega_g_times must increase, got {times}")
            object.__setattr__(self, "omega_g_times", times)
        if not isinstance(self.envelope, Envelope):
            raise TypeError(f"envelope must be a toppling.motions envelope, got {type(self.envelope).__name__}")
        checks.choice("baseline", self.baseline, BASELINES)

    def frequency(self, time: Values) -> Values:
        """Circular frequency of the ground at `time` (s), rad/s, same shape."""
        values = np.atleast_1d(np.asarray(self.omega_g, dtype=np.float64))
        if values.size == 1:
            return np.full(np.shape(time), values[0])
        times = np.linspace(0.0, self.duration, values.size) if self.omega_g_times is None else self.omega_g_times
        return np.interp(time, times, values)

    def density(self, omega: Values) -> Values:
        """Two-sided power spectral density at circular frequencies `omega` (rad/s), m²/s³ per rad/s, same shape.

        The evolutionary density s0 |H(omega; t)|² averaged over the duration with the envelope's square as weight: that
        of the strong shaking, whose level is that of a unit envelope.
        """
        time = np.linspace(0.0, self.duration, PSD_INSTANTS)
        weight = self.envelope(time) ** 2
        w = np.asarray(omega, dtype=np.float64)[..., None]
        ground = self.frequency(time)
        damping = (2.0 * self.xi_g * ground * w) ** 2
        squared = (ground**4 + damping) / ((ground**2 - w**2) ** 2 + damping)
        return np.asarray(self.s0 * (squared * weight).sum(axis=-1) / weight.sum())

    def calibrate_pga(self, target: float, n: int = 200, seed: int = 0) -> Self:
        """The generator with s0 such that the mean PGA of motions 0 … n - 1 of `seed` is `target`, m/s², > 0."""
        return self._calibrate(target, float(measure("pga", records(self.sample(n, seed))).mean()))

    def calibrate_arias(self, target: float, n: int = 200, seed: int = 0) -> Self:
        """The generator with s0 such that the mean Arias intensity of motions 0 … n - 1 of `seed` is `target`, m/s.

        Arias intensity: pi/(2 g) integral a² dt, exact for acceleration that is linear between samples.
        """
        a = self.sample(n, seed).values
        energy = float((a[:, :-1] ** 2 + a[:, :-1] * a[:, 1:] + a[:, 1:] ** 2).sum()) * self.dt / (3.0 * len(a))
        found = math.pi / (2.0 * STANDARD_GRAVITY) * energy
        return self._calibrate(math.sqrt(checks.number("target", target, above=0.0, unit="m/s")), math.sqrt(found))

    def calibrate_psd(self, omega: Sequence[float] | Values, density: Sequence[float] | Values) -> Self:
        """The generator whose `density` comes closest to a given one.

        Parameters
        ----------
        omega : sequence of float, shape (k,)
            Circular frequencies, rad/s, > 0, at least five.
        density : sequence of float, shape (k,)
            Two-sided power spectral density at them, m²/s³ per rad/s, > 0.

        Notes
        -----
        Least squares of the logarithms over s0, damping ratios and frequencies; the drift keeps its shape (all its
        frequencies change by one factor).
        """
        w = checks.finite_array("omega", omega, unit="rad/s")
        target = checks.finite_array("density", density, unit="m²/s³")
        if w.size != target.size or w.size < 5:
            raise ValueError(f"omega and density must have one length of at least 5, got {w.size} and {target.size}")
        if not (w.min() > 0.0 and target.min() > 0.0):
            raise ValueError("omega and density must be > 0")
        center = math.exp(float((np.log(w) * target).sum() / target.sum()))
        start = self._with_frequency(center / float(self.frequency(np.array([0.5 * self.duration]))[0]))
        free = ("xi_g", "s0", *self._also_free)

        def candidate(logs: Values) -> EvolutionaryKanaiTajimi:
            own = {name: getattr(start, name) * math.exp(log) for name, log in zip(free, logs[1:], strict=True)}
            return replace(start._with_frequency(math.exp(logs[0])), **own)

        def misfit(logs: Values) -> Values:
            return np.log(candidate(logs).density(w) / target)

        level = -float(misfit(np.zeros(1 + len(free))).mean())
        first = np.zeros(1 + len(free))
        first[2] = level
        found = scipy.optimize.least_squares(misfit, first, bounds=(first - 6.0, first + 6.0))
        return cast("Self", candidate(found.x))

    _also_free: ClassVar[tuple[str, ...]] = ()

    def _with_frequency(self, factor: float) -> Self:
        return replace(self, omega_g=tuple(factor * value for value in np.atleast_1d(np.asarray(self.omega_g))))

    def _calibrate(self, target: float, found: float) -> Self:
        return replace(self, s0=self.s0 * (checks.number("target", target, above=0.0) / found) ** 2)

    def sample(self, n: int, seed: int = 0, first: int = 0) -> xr.DataArray:
        """Motions `first` … `first + n - 1` of `seed`, see `KanaiTajimi.sample`."""
        steps = steps_of(self.duration, self.dt)
        time = np.arange(steps + 1, dtype=np.float64) * self.dt
        amplitude = math.sqrt(2.0 * math.pi * self.s0 / self.dt) * self.envelope(time)
        propagators = _propagators(self.frequency(time[:-1] + 0.5 * self.dt), self.xi_g, self.dt)
        ground = self.frequency(time)
        read = np.stack([ground**2, 2.0 * self.xi_g * ground], axis=1)

        def make(streams: Streams) -> Values:
            motions: Values = drifting_ground(normals(streams, steps + 1) * amplitude, *propagators, read)
            motions = self._after(motions)
            return parabolic_baseline(motions, self.dt) if self.baseline == "parabolic" else motions

        return ensemble(self, n, seed, first, steps, self.dt, make)

    def _after(self, motions: Values) -> Values:
        return motions


@dataclass(frozen=True)
class EvolutionaryCloughPenzien(EvolutionaryKanaiTajimi):
    """Evolutionary Kanai-Tajimi motions through the constant high-pass of `CloughPenzien`.

    Parameters as `EvolutionaryKanaiTajimi`, and omega_f (rad/s), xi_f as `CloughPenzien`.

    Examples
    --------
    >>> EvolutionaryCloughPenzien(omega_g=(25.0, 8.0), duration=10.0, dt=0.01).sample(2, seed=1).shape
    (2, 1001)
    """

    omega_f: float = 0.25 * math.pi
    xi_f: float = 0.6
    baseline: str = "none"

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("omega_f", "xi_f"):
            checks.number(name, getattr(self, name), above=0.0, at_most=LARGEST)

    _also_free: ClassVar[tuple[str, ...]] = ("omega_f", "xi_f")

    def density(self, omega: Values) -> Values:
        w = np.asarray(omega, dtype=np.float64)
        damping = (2.0 * self.xi_f * self.omega_f * w) ** 2
        return super().density(omega) * w**4 / ((self.omega_f**2 - w**2) ** 2 + damping)

    def _after(self, motions: Values) -> Values:
        high_pass = [1.0, 2.0 * self.xi_f * self.omega_f, self.omega_f**2]
        return _filter(motions, [1.0, 0.0, 0.0], high_pass, self.dt)


def _propagators(omega: Values, xi: float, dt: float) -> tuple[Values, Values, Values]:
    """One step of x'' + 2 xi omega x' + omega² x = w for each omega (n,), with w linear over it.

    The exponential of the matrix of (x, x', w, dt w'), which holds for any damping ratio; each frequency once.
    """
    different, where = np.unique(omega, return_inverse=True)
    matrix = np.zeros((different.size, 4, 4))
    matrix[:, 0, 1] = dt
    matrix[:, 1, 0] = -(different**2) * dt
    matrix[:, 1, 1] = -2.0 * xi * different * dt
    matrix[:, 1, 2] = dt
    matrix[:, 2, 3] = 1.0
    step = np.asarray(scipy.linalg.expm(matrix))[where]
    after = step[:, :2, 3]
    return np.ascontiguousarray(step[:, :2, :2]), step[:, :2, 2] - after, np.ascontiguousarray(after)
