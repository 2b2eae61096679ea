"""Simulated motions that each have a given response spectrum: shaped noise, of which every motion is then matched."""

import math
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np
import scipy
import xarray as xr

from ...core import checks
from ...core.doubts import warn
from ...core.elementary import Array, exp, log, power
from ...core.parameters import check
from ...core.streams import stream
from ..intensity.peaks import peak_displacement, peak_velocity
from ..kernels import matching as engine
from ..simulated.envelopes import Envelope, RiseStrongDecay
from ..simulated.generator import LEAST_STEPS, USUAL_STEP, Generator, Seconds, check_samples, counts
from .adjustment import (
    GOOD,
    PGD_BOUND,
    PGV_BOUND,
    TOLERANCE,
    Bound,
    Bounds,
    Lines,
    MatchResult,
    Plan,
    TargetMissed,
    check_options,
    end_window,
    labelled_matches,
    match_result,
    matching_doubts,
)
from .target_spectra import TargetSpectrum

STEPS_OF_A_DRAW = 12  # fewer than for a record, because noise can be drawn again
DRAWS = 4
PILOTS = 16
JUDGES = 32
PILOT_SEED = 2**40  # separate streams: the pilot motions differ from motions of a usual seed
PILOT_ROUNDS = 5
HIGH_PASS_ORDER = 8


@dataclass(frozen=True)
class SpectrumCompatible(Generator):
    """Simulated motions, each of which has a given response spectrum.

    The motions are enveloped Gaussian noise whose mean log spectrum is the target's; then each of them is matched.

    Parameters
    ----------
    target : TargetSpectrum
        Target, matched at eight periods per octave; the shortest at least 2 dt, the longest at most `duration`.
    duration : float
        Length of the motions, s.
    dt : float
        Time step, s.
    envelope : Envelope, optional
        Intensity of the noise as a function of time. By default it rises over a sixth of the duration, stays strong to
        two thirds, then decays to 5 %.
    pgv_bound : float or None
        Largest relative difference of PGV (factor 1 + bound up or down) from the value that the spectrum implies; None
        for none.
    pgd_bound : float or None
        Largest relative difference of PGD from the value that the spectrum implies.
    tolerance : float
        Mean misfit over the periods at which the adjustment stops, 0.005 to 0.5.
    margin : float
        The motions are matched to (1 + margin) times the target, 0 to 0.5.

    Notes
    -----
    The PGV and PGD that the target implies are the geometric means of 32 pilot motions, from separate streams, that are
    matched to it without bounds. The spectral density of the noise is found with 16 other pilot motions. Its value at
    each period is multiplied by the squared ratio of target and mean log spectrum, five times. See `match` for the
    adjustment. Every motion ends at rest. The bounds have priority over the spectrum. If a motion violates its bounds
    or has a mean misfit over 5 %, noise is drawn again from the same stream. This is done up to three times, and the
    best motion is kept.

    References
    ----------
    Gasparini, D. and Vanmarcke, E. H. (1976). Simulated earthquake motions compatible with prescribed response spectra.
    MIT (recalled: the density of the noise found by iteration).  For the adjustment see `match`.

    Examples
    --------
    >>> target = TargetSpectrum((0.1, 0.5, 4.0), (8.0, 8.0, 1.0))
    >>> made = SpectrumCompatible(target, duration=12.0, dt=0.01).sample(2, seed=1)
    >>> made.shape, bool((made.misfit_mean < 0.05).all())
    ((2, 1201), True)
    """

    own_amplitude: ClassVar[bool] = False

    target: TargetSpectrum
    duration: Seconds = 20.0
    dt: Seconds = USUAL_STEP
    envelope: Envelope | None = None
    pgv_bound: Bound | None = PGV_BOUND
    pgd_bound: Bound | None = PGD_BOUND
    tolerance: float = TOLERANCE
    margin: float = 0.0
    periods: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.target, TargetSpectrum):
            raise TypeError(f"target must be a toppling.motions.TargetSpectrum, got {checks.kind(self.target)}")
        check(self)
        if self.duration < LEAST_STEPS * self.dt:
            raise ValueError(
                f"duration must be at least {LEAST_STEPS} dt = {LEAST_STEPS * self.dt:g} s, got {self.duration:g}"
            )
        if self.envelope is not None and not isinstance(self.envelope, Envelope):
            raise TypeError(f"envelope must be a toppling.motions envelope, got {checks.kind(self.envelope)}")
        check_options(self.pgv_bound, self.pgd_bound, self.tolerance)
        checks.number("margin", self.margin, at_least=0.0, at_most=0.5)
        if self.periods is not None:
            axis = checks.finite_array("periods", self.periods, unit="s")
            if not 2 <= axis.size <= engine.LANES or not np.all(np.diff(axis) > 0.0):
                raise ValueError(f"periods must be 2 to {engine.LANES} that increase, got {axis.size}")
            self.target.at(axis)
            object.__setattr__(self, "periods", tuple(axis.tolist()))
        Lines.of(self.target, self.dt, self.duration, self.periods)

    def sample(self, n: int, seed: int = 0, first: int = 0) -> xr.DataArray:
        """Return motions `first` … `first + n - 1` of `seed`; see `KanaiTajimi.sample`.

        Returns
        -------
        xarray.DataArray
            ``acceleration`` (motion, time), m s-2. On motion: ``misfit_mean`` and ``misfit_max`` (of the target, over
            its periods), ``pgv_reference`` and ``pgd_reference`` (implied by the target), ``bounds_held``, and
            ``target_met``. The last is false if the mean misfit stayed above 5 % (and the tolerance). Motions that miss
            their target or bounds are named in a warning (`TargetMissed`).
        """
        n, seed, first = counts(n, seed, first)
        steps = round(self.duration / self.dt)
        check_samples(n, steps)
        noise = _Noise.fitted(self._aim(), self._envelope(), self.dt, steps + 1, self.periods)
        bounds = noise.implied(self.pgv_bound, self.pgd_bound)
        values = np.empty((n, steps + 1))
        results: list[MatchResult] = []
        for i in range(n):
            values[i], reached = noise.matched(stream(seed, first + i), bounds, self.tolerance)
            results.append(match_result(values[i], self.dt, reached, bounds, noise.lines, 1.0 + self.margin))
        labels = [f"{type(self).__name__} {seed}-{first + i}" for i in range(n)]
        sources = [f"{self!r} seed {seed}"] * n
        made = labelled_matches(values, self.dt, labels, sources, results, max(GOOD, self.tolerance))
        warn(matching_doubts([made]), TargetMissed)
        return made

    def _aim(self) -> TargetSpectrum:
        return self.target.scaled(1.0 + self.margin) if self.margin else self.target

    def _envelope(self) -> Envelope:
        if self.envelope is not None:
            return self.envelope
        third = self.duration / 3.0
        return RiseStrongDecay(rise=0.5 * third, strong_end=2.0 * third, decay=math.log(20.0) / third)


class _Noise(NamedTuple):
    """Enveloped noise whose mean log spectrum is a target's."""

    lines: Lines
    envelope: Array
    freedom: Array
    amplitude: Array
    dt: float
    length: int

    @classmethod
    def fitted(cls, target: TargetSpectrum, envelope: Envelope, dt: float, size: int, periods: Any) -> "_Noise":
        lines = Lines.of(target, dt, (size - 1) * dt, periods)
        time = np.arange(size, dtype=np.float64) * dt
        strength = envelope(time)
        length = scipy.fft.next_fast_len(size, real=True)
        frequency = np.asarray(scipy.fft.rfftfreq(length, dt))
        level = log(lines.sa / np.sqrt(lines.omega))
        made = cls(lines, strength, strength**2 * end_window(size, dt), frequency, dt, length)
        for _ in range(PILOT_ROUNDS):
            made = made._replace(amplitude=_amplitude(frequency, lines.omega, level))
            spectra = [lines.spectrum(made.motion(stream(PILOT_SEED, i)), dt) for i in range(PILOTS)]
            level = level - np.mean(log(spectra), axis=0) + log(lines.sa)
        return made._replace(amplitude=_amplitude(frequency, lines.omega, level))

    def motion(self, source: np.random.Generator) -> Array:
        """Return one motion before matching, m/s²."""
        spectrum = scipy.fft.rfft(source.standard_normal(self.length)) * self.amplitude
        return np.asarray(scipy.fft.irfft(spectrum, self.length))[: self.envelope.size] * self.envelope

    def matched(self, source: np.random.Generator, bounds: Bounds, tolerance: float) -> tuple[Array, Array]:
        """Return one matched motion and its result: the best of a few draws if the first one fails."""
        best: tuple[bool, float] = (True, math.inf)
        for _ in range(DRAWS):
            motion = self.motion(source)
            reached = self.lines.adjust(
                motion, self.dt, self.freedom, bounds.limits(), Plan(STEPS_OF_A_DRAW, tolerance)
            )
            misfit = float(reached[engine.MISFIT])
            rank = (not bounds.held(float(reached[engine.PGV]), float(reached[engine.PGD])), misfit)
            if rank < best:
                best, kept, outcome = rank, motion, reached
            if best < (False, max(GOOD, tolerance)):
                break
        return kept, outcome

    def implied(self, pgv_bound: float | None, pgd_bound: float | None) -> Bounds:
        """Return the peaks that the target implies: geometric means of pilot motions matched without bounds."""
        free = Bounds(0.0, 0.0, None, None).limits()
        peaks = []
        for i in range(PILOTS, PILOTS + JUDGES):
            motion = self.motion(stream(PILOT_SEED, i))
            self.lines.adjust(motion, self.dt, self.freedom, free, Plan(STEPS_OF_A_DRAW, TOLERANCE))
            peaks.append((peak_velocity(motion, self.dt), peak_displacement(motion, self.dt)))
        pgv, pgd = exp(log(peaks).mean(axis=0))
        return Bounds(float(pgv), float(pgd), pgv_bound, pgd_bound)


def _amplitude(frequency: Array, omega: Array, level: Array) -> Array:
    """Return the Fourier amplitude from its logarithm at the oscillators, cut off below and above their frequencies.

    The cut at low frequencies keeps velocity and displacement finite.
    """
    axis = omega / (2.0 * math.pi)
    inside = np.maximum(frequency, 1e-3 * axis[0])
    shape = exp(np.interp(log(inside), log(axis), level))
    low = 1.0 / np.sqrt(1.0 + power(axis[0] / inside, HIGH_PASS_ORDER))
    high = 1.0 / np.sqrt(1.0 + power(inside / (1.2 * axis[-1]), HIGH_PASS_ORDER))
    return np.asarray(np.where(frequency > 0.0, shape * low * high, 0.0))
