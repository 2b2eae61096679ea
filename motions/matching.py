"""Motions that have a given response spectrum, with peak velocity and displacement kept in bounds.

Matching by itself spoils velocity and displacement, and velocity is what overturns: so both are conditions of the same
adjustment as the spectrum (`_matching`), not a correction after it.  It does not know where a target comes from.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy import fft

from .. import checks
from ..units import DIMENSIONLESS, METRE, VELOCITY
from . import _matching as engine
from .arrays import from_array, records
from .ensembles import LARGEST, LEAST_STEPS, MOST_SAMPLES, Generator, stream
from .envelopes import Envelope, RiseStrongDecay
from .peaks import peak_displacement, peak_velocity
from .targets import TargetSpectrum

Series = NDArray[np.float64]

PGV_BOUND, PGD_BOUND = 0.15, 0.5
TOLERANCE = 0.03
MOST_STEPS = 24  # for a record
STEPS_OF_A_DRAW = 12  # for noise, of which there is more
DRAWS = 4
GOOD = 0.05  # mean misfit beyond which another try is made
FIRM = (1e-3, 1e-6)  # regularisation of bounds; what one cannot reconcile with the spectrum the other often can
PILOTS = 16
JUDGES = 32
PILOT_SEED = 2**40  # a stream of their own: no motion of a usual seed is among them
PILOT_ROUNDS = 5
HIGH_PASS_ORDER = 8
TAPER = 0.5  # s at both ends, where a motion is not adjusted
SMOOTHING = 2.0  # s over which the strength of a record is taken
QUIET = 0.02  # of the greatest strength: what a quiet part may still be adjusted with
BETWEEN_SAMPLES = 0.997  # peaks may lie between samples, and bounds hold for those too


class Bounds(NamedTuple):
    """Peak velocity (m/s) and displacement (m) to stay near, and by which fraction; None: not bounded."""

    pgv: float
    pgd: float
    pgv_bound: float | None
    pgd_bound: float | None

    def limits(self) -> Series:
        """Least and greatest peak velocity, least and greatest peak displacement."""
        out = []
        for value, bound in ((self.pgv, self.pgv_bound), (self.pgd, self.pgd_bound)):
            free = bound is None
            out += [
                0.0 if free else value / (1.0 + (bound or 0.0)),
                math.inf if free else value * (1.0 + (bound or 0.0)) * BETWEEN_SAMPLES,
            ]
        return np.array(out)

    def held(self, pgv: float, pgd: float) -> bool:
        """Whether peaks lie in the bounds."""
        low_v, high_v, low_d, high_d = self.limits()
        return bool(low_v <= pgv <= high_v / BETWEEN_SAMPLES and low_d <= pgd <= high_d / BETWEEN_SAMPLES)


class Matched(NamedTuple):
    """What came of one motion: mean and greatest misfit, peak velocity and displacement, and their bounds."""

    misfit: float
    worst: float
    pgv: float
    pgd: float
    reference: Bounds


class Plan(NamedTuple):
    """Most steps of an adjustment, the mean misfit at which it stops, and how softly bounds are imposed."""

    steps: int
    tolerance: float
    firm: float = FIRM[0]


class _Lines(NamedTuple):
    """A target on its oscillators, by falling period: circular frequency (rad/s), damping, pseudo-acceleration."""

    omega: Series
    damping: float
    sa: Series

    @classmethod
    def of(cls, target: TargetSpectrum, dt: float, duration: float, periods: Any = None) -> _Lines:
        """ValueError where the step or the length of a motion cannot hold the target's periods."""
        ends = target.periods if periods is None else periods
        shortest, longest = ends[0], ends[-1]
        if shortest < 2.0 * dt * (1.0 - 1e-9):
            raise ValueError(
                f"a spectrum from {shortest:g} s needs a time step of at most {shortest / 2.0:g} s, got {dt:g} s: "
                "take a part of it (between)"
            )
        if longest > duration * (1.0 + 1e-9):
            raise ValueError(
                f"a spectrum up to {longest:g} s needs motions at least as long, got {duration:g} s: "
                "take a part of it (between)"
            )
        axis = (target.grid() if periods is None else np.array(periods))[::-1].copy()
        return cls(2.0 * math.pi / axis, target.damping, target.at(axis))

    def spectrum(self, acceleration: Series, dt: float) -> Series:
        """Pseudo-acceleration of a motion, m/s²."""
        found, when = np.empty(self.omega.size), np.empty(self.omega.size)
        engine.peaks(acceleration, dt, self.omega, self.damping, found, when)
        return np.abs(found)

    def adjust(self, acceleration: Series, dt: float, freedom: Series, limits: Series, plan: Plan) -> Series:
        """Match one motion in place; misfit, worst, pgv, pgd, steps."""
        out = np.zeros(engine.RESULTS)
        axis, steps, enough, firm = (self.omega, self.damping, self.sa), *plan
        engine.adjust(acceleration, dt, *axis, freedom, limits, steps, enough, firm, out)
        return out


@dataclass(frozen=True)
class SpectrumCompatible(Generator):
    """Simulated motions, each of which has a given response spectrum.

    Enveloped Gaussian noise whose mean log spectrum is the target's, then every motion matched by itself.

    Parameters
    ----------
    target : TargetSpectrum
        Matched at all its periods, eight to an octave; the shortest at least 2 dt, the longest at most `duration`.
    duration, dt : float
        Length and time step, s.
    envelope : Envelope, optional
        Intensity of the noise over time: rise over a sixth of the duration, strong to two thirds, then decay to 5 %
        where not given.
    pgv_bound, pgd_bound : float or None
        Greatest relative distance (factor 1 + bound either way) of PGV and PGD from what the target implies; None for
        no bound.
    tolerance : float
        Mean misfit over the periods at which the adjustment stops, 0.005 to 0.5.
    margin : float
        The motions are matched to (1 + margin) times the target, 0 to 0.5.

    Notes
    -----
    What the target implies is the geometric mean of 32 pilot motions matched to it with no bound, from streams of their
    own.  The spectral density of the noise is found on 16 others: its value at each period is multiplied by the
    squared ratio of target and mean log spectrum, five times.  See `match` for the adjustment.  Every motion ends at
    rest.  A motion keeps within its bounds first and near the spectrum second; where one comes out beyond its bounds or
    with a mean misfit over 5 %, noise is drawn again from the same stream, up to three times, and the best is kept.

    References
    ----------
    Gasparini, D. and Vanmarcke, E. H. (1976). Simulated earthquake motions compatible with prescribed response spectra.
    MIT (recalled: the density of the noise found by iteration).  The adjustment: see `match`.

    Examples
    --------
    >>> target = TargetSpectrum((0.1, 0.5, 4.0), (8.0, 8.0, 1.0))
    >>> made = SpectrumCompatible(target, duration=12.0, dt=0.01).sample(2, seed=1)
    >>> made.shape, bool((made.misfit_mean < 0.05).all())
    ((2, 1201), True)
    """

    target: TargetSpectrum
    duration: float = 20.0
    dt: float = 0.005
    envelope: Envelope | None = None
    pgv_bound: float | None = PGV_BOUND
    pgd_bound: float | None = PGD_BOUND
    tolerance: float = TOLERANCE
    margin: float = 0.0
    periods: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.target, TargetSpectrum):
            raise TypeError(f"target must be a toppling.motions.TargetSpectrum, got {checks.kind(self.target)}")
        for name in ("duration", "dt"):
            checks.number(name, getattr(self, name), above=0.0, at_most=LARGEST, unit="s")
        if self.duration < LEAST_STEPS * self.dt:
            raise ValueError(
                f"duration must be at least {LEAST_STEPS} dt = {LEAST_STEPS * self.dt:g} s, got {self.duration:g}"
            )
        if self.envelope is not None and not isinstance(self.envelope, Envelope):
            raise TypeError(f"envelope must be a toppling.motions envelope, got {checks.kind(self.envelope)}")
        _check_options(self.pgv_bound, self.pgd_bound, self.tolerance)
        checks.number("margin", self.margin, at_least=0.0, at_most=0.5)
        if self.periods is not None:
            axis = checks.finite_array("periods", self.periods, unit="s")
            if not 2 <= axis.size <= engine.LANES or not np.all(np.diff(axis) > 0.0):
                raise ValueError(f"periods must be 2 to {engine.LANES} that increase, got {axis.size}")
            self.target.at(axis)
            object.__setattr__(self, "periods", tuple(axis.tolist()))
        _Lines.of(self.target, self.dt, self.duration, self.periods)

    def sample(self, n: int, seed: int = 0, first: int = 0) -> xr.DataArray:
        """Motions `first` … `first + n - 1` of `seed`.

        Parameters
        ----------
        n : int
            Number of motions, >= 1.
        seed, first : int
            Seed of the ensemble and index of the first motion, >= 0; (seed, index) alone decides a motion.

        Returns
        -------
        xarray.DataArray
            ``acceleration`` (motion, time), m s-2; on motion ``misfit_mean`` and ``misfit_max`` (of the target, over
            its periods), ``pgv_reference`` and ``pgd_reference`` (what the target implies), ``bounds_held``.
        """
        n = checks.count("n", n, at_least=1)
        seed = checks.count("seed", seed)
        first = checks.count("first", first)
        steps = round(self.duration / self.dt)
        if n * (steps + 1) > MOST_SAMPLES:
            raise ValueError(
                f"motions must have at most {MOST_SAMPLES:.0e} samples in all, got {n} motions of {steps + 1}: "
                "make them in parts (first)"
            )
        noise = _Noise.fitted(self._aim(), self._envelope(), self.dt, steps + 1, self.periods)
        bounds = noise.implied(self.pgv_bound, self.pgd_bound)
        values = np.empty((n, steps + 1))
        found: list[Matched] = []
        for i in range(n):
            values[i], reached = noise.matched(stream(seed, first + i), bounds, self.tolerance)
            found.append(_matched(values[i], self.dt, reached, bounds, noise.lines, 1.0 + self.margin))
        labels = [f"{type(self).__name__} {seed}-{first + i}" for i in range(n)]
        return _labelled(values, self.dt, labels, [f"{self!r} seed {seed}"] * n, found)

    def _aim(self) -> TargetSpectrum:
        return self.target.scaled(1.0 + self.margin) if self.margin else self.target

    def _envelope(self) -> Envelope:
        if self.envelope is not None:
            return self.envelope
        third = self.duration / 3.0
        return RiseStrongDecay(rise=0.5 * third, strong_end=2.0 * third, decay=math.log(20.0) / third)


class _Noise(NamedTuple):
    """Enveloped noise whose mean log spectrum is a target's."""

    lines: _Lines
    envelope: Series
    freedom: Series
    amplitude: Series
    dt: float
    length: int

    @classmethod
    def fitted(cls, target: TargetSpectrum, envelope: Envelope, dt: float, size: int, periods: Any) -> _Noise:
        lines = _Lines.of(target, dt, (size - 1) * dt, periods)
        time = np.arange(size, dtype=np.float64) * dt
        strength = envelope(time)
        length = fft.next_fast_len(size, real=True)
        frequency = np.asarray(fft.rfftfreq(length, dt))
        level = np.log(lines.sa * lines.omega**-0.5)
        made = cls(lines, strength, strength**2 * _ends(size, dt), frequency, dt, length)
        for _ in range(PILOT_ROUNDS):
            made = made._replace(amplitude=_amplitude(frequency, lines.omega, level))
            spectra = [lines.spectrum(made.motion(stream(PILOT_SEED, i)), dt) for i in range(PILOTS)]
            level = level - np.mean(np.log(spectra), axis=0) + np.log(lines.sa)
        return made._replace(amplitude=_amplitude(frequency, lines.omega, level))

    def motion(self, source: np.random.Generator) -> Series:
        """One motion, not matched, m/s²."""
        spectrum = fft.rfft(source.standard_normal(self.length)) * self.amplitude
        return np.asarray(fft.irfft(spectrum, self.length))[: self.envelope.size] * self.envelope

    def matched(self, source: np.random.Generator, bounds: Bounds, tolerance: float) -> tuple[Series, Series]:
        """One motion, matched, and what was reached: the best of a few draws from its own stream where one fails."""
        best: tuple[bool, float] = (True, math.inf)
        for _ in range(DRAWS):
            motion = self.motion(source)
            reached = self.lines.adjust(
                motion, self.dt, self.freedom, bounds.limits(), Plan(STEPS_OF_A_DRAW, tolerance)
            )
            misfit = float(reached[engine.MISFIT])
            rank = (not bounds.held(float(reached[engine.PGV]), float(reached[engine.PGD])), misfit)
            if rank < best:
                best, kept, found = rank, motion, reached
            if best < (False, max(GOOD, tolerance)):
                break
        return kept, found

    def implied(self, pgv_bound: float | None, pgd_bound: float | None) -> Bounds:
        """What the target implies: geometric mean peaks of more pilots, matched with no bound."""
        free = Bounds(0.0, 0.0, None, None).limits()
        peaks = []
        for i in range(PILOTS, PILOTS + JUDGES):
            motion = self.motion(stream(PILOT_SEED, i))
            self.lines.adjust(motion, self.dt, self.freedom, free, Plan(STEPS_OF_A_DRAW, TOLERANCE))
            peaks.append((peak_velocity(motion, self.dt), peak_displacement(motion, self.dt)))
        pgv, pgd = np.exp(np.log(peaks).mean(axis=0))
        return Bounds(float(pgv), float(pgd), pgv_bound, pgd_bound)


def _amplitude(frequency: Series, omega: Series, level: Series) -> Series:
    """Fourier amplitude from its log at the oscillators; below the lowest of them it is cut off, above the highest too.

    The low cut keeps velocity and displacement finite.
    """
    axis = omega / (2.0 * math.pi)
    inside = np.maximum(frequency, 1e-3 * axis[0])
    shape = np.exp(np.interp(np.log(inside), np.log(axis), level))
    low = 1.0 / np.sqrt(1.0 + (axis[0] / inside) ** HIGH_PASS_ORDER)
    high = 1.0 / np.sqrt(1.0 + (inside / (1.2 * axis[-1])) ** HIGH_PASS_ORDER)
    return np.asarray(np.where(frequency > 0.0, shape * low * high, 0.0))


def _ends(size: int, dt: float) -> Series:
    """0 at both ends, 1 from TAPER s (a tenth of a short motion) inside."""
    from_end = np.minimum(np.arange(size), np.arange(size)[::-1]) * dt
    return np.minimum(1.0, from_end / min(TAPER, 0.1 * (size - 1) * dt))


def match(
    motions: xr.DataArray,
    target: TargetSpectrum,
    pgv_bound: float | None = PGV_BOUND,
    pgd_bound: float | None = PGD_BOUND,
    tolerance: float = TOLERANCE,
    scale: bool = True,
) -> xr.DataArray:
    """Given motions, each adjusted until it has the target's response spectrum.

    Parameters
    ----------
    motions : xarray.DataArray
        One labelled array (motion, time), m s-2.
    target : TargetSpectrum
        Matched at all its periods, eight to an octave; the shortest at least 2 dt, the longest at most the duration.
    pgv_bound, pgd_bound : float or None
        Greatest relative change of PGV and PGD (factor 1 + bound either way) from the scaled motion's own; None for no
        bound.
    tolerance : float
        Mean misfit over the periods at which the adjustment stops, 0.005 to 0.5.
    scale : bool
        Scale first, by the factor that makes the mean log misfit zero.  References are taken after it.

    Returns
    -------
    xarray.DataArray
        As given, adjusted, at rest at its end (a residual displacement is taken out before PGV and PGD are read off as
        references); on motion the coordinates that `SpectrumCompatible.sample` names.

    Raises
    ------
    TypeError, ValueError
        As `toppling.motions.records`; a motion of zeros, a target that the step or the length cannot hold, options out
        of range.

    Notes
    -----
    With the peaks of all oscillators held at their times, the smallest change of acceleration (weighted by the local
    strength of the motion) is found that mends all of them at once, together with end velocity and displacement zero
    and the excursions of velocity and displacement beyond their bounds; peaks move, so this is repeated, up to 24
    times, and the best is kept: bounds first, then the misfit.  A spectrum that the motion cannot have with its own PGV
    and PGD is then not met: the misfit says so, and wider bounds help.

    References
    ----------
    Lilhanand, K. and Tseng, W. S. (1988). Development and application of realistic earthquake time histories
    compatible with multiple-damping design spectra. 9th World Conference on Earthquake Engineering (recalled: the
    adjustment of all peaks by one linear system of time-reversed responses).
    Al Atik, L. and Abrahamson, N. (2010). An improved method for nonstationary spectral matching. Earthquake Spectra
    26(3), 601-617 (abstract read; why velocity and displacement must not drift).

    Examples
    --------
    >>> from toppling import motions
    >>> record = motions.CloughPenzien(duration=15.0, dt=0.01).sample(1)
    >>> target = motions.TargetSpectrum((0.1, 0.5, 4.0), (8.0, 8.0, 1.0))
    >>> bool(match(record, target).misfit_mean[0] < 0.05)
    True
    """
    if not isinstance(target, TargetSpectrum):
        raise TypeError(f"target must be a toppling.motions.TargetSpectrum, got {checks.kind(target)}")
    _check_options(pgv_bound, pgd_bound, tolerance)
    plain = records(motions)
    if set(motions.dims) - {"motion", "time"}:
        raise ValueError(f"motions to be matched must have dims (motion, time), got {motions.dims}")
    free = Bounds(0.0, 0.0, None, None).limits()
    found: list[Matched] = []
    values = np.empty((len(plain), plain[0].acceleration.size))
    for i, record in enumerate(plain):
        dt, own = record.dt, record.acceleration.copy()
        lines = _Lines.of(target, dt, record.duration)
        spectrum = lines.spectrum(own, dt)
        if not np.all(spectrum > 0.0):
            raise ValueError(f"motion {record.label!r} has no response at some period and cannot be matched")
        if scale:
            own *= math.exp(float(np.mean(np.log(lines.sa / spectrum))))
        freedom = _strength(own, dt)
        lines.adjust(own, dt, freedom, free, Plan(0, tolerance))
        bounds = Bounds(peak_velocity(own, dt), peak_displacement(own, dt), pgv_bound, pgd_bound)
        tries = []
        for firm in FIRM:
            values[i] = own
            reached = lines.adjust(values[i], dt, freedom, bounds.limits(), Plan(MOST_STEPS, tolerance, firm))
            tries.append((_matched(values[i], dt, reached, bounds, lines, 1.0), values[i].copy()))
            if bounds.held(tries[-1][0].pgv, tries[-1][0].pgd) and tries[-1][0].misfit <= max(GOOD, tolerance):
                break
        one, values[i] = min(tries, key=lambda t: (not bounds.held(t[0].pgv, t[0].pgd), t[0].misfit))
        found.append(one)
    labels = [record.label for record in plain]
    sources = [f"{record.source}, matched to {target.name}" for record in plain]
    return _labelled(values, plain[0].dt, labels, sources, found)


def _strength(acceleration: Series, dt: float) -> Series:
    """Where a record may change: its mean square over a moving window, none at the ends."""
    window = max(1, min(round(SMOOTHING / dt), acceleration.size // 4))
    power = np.convolve(acceleration**2, np.hanning(window + 2)[1:-1], mode="same")
    return np.asarray(np.maximum(power / power.max(), QUIET)) * _ends(acceleration.size, dt)


def _check_options(pgv_bound: Any, pgd_bound: Any, tolerance: Any) -> None:
    for name, bound in (("pgv_bound", pgv_bound), ("pgd_bound", pgd_bound)):
        if bound is not None:
            checks.number(name, bound, at_least=0.02, at_most=100.0)
    checks.number("tolerance", tolerance, at_least=0.005, at_most=0.5)


def _matched(acceleration: Series, dt: float, reached: Series, bounds: Bounds, lines: _Lines, lifted: float) -> Matched:
    """Misfit of the target, which is what was aimed at over `lifted`."""
    misfit, worst = reached[engine.MISFIT], reached[engine.WORST]
    if lifted != 1.0:
        off = np.abs(lines.spectrum(acceleration, dt) / lines.sa * lifted - 1.0)
        misfit, worst = off.mean(), off.max()
    pgv, pgd = peak_velocity(acceleration, dt), peak_displacement(acceleration, dt)
    return Matched(float(misfit), float(worst), pgv, pgd, bounds)


def _labelled(values: Series, dt: float, labels: list[str], sources: list[str], found: list[Matched]) -> xr.DataArray:
    of_target = "misfit of the target spectrum over its periods"
    coordinates = {
        "misfit_mean": ([one.misfit for one in found], DIMENSIONLESS, f"mean {of_target}"),
        "misfit_max": ([one.worst for one in found], DIMENSIONLESS, f"greatest {of_target}"),
        "pgv_reference": ([one.reference.pgv for one in found], VELOCITY, "PGV to stay near"),
        "pgd_reference": ([one.reference.pgd for one in found], METRE, "PGD to stay near"),
        "bounds_held": (
            [one.reference.held(one.pgv, one.pgd) for one in found],
            DIMENSIONLESS,
            "PGV and PGD lie within their bounds",
        ),
    }
    return from_array(values, dt, labels, sources).assign_coords(
        {
            name: ("motion", np.array(numbers), {"units": units, "long_name": long_name})
            for name, (numbers, units, long_name) in coordinates.items()
        }
    )
