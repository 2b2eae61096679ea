"""Spectra of motions: exact response spectra of damped oscillators, and measures from response and Fourier spectra.

The response is exact for acceleration that is linear between samples (`kernels.oscillators`), and so are its maxima,
which mostly lie between samples.
"""

import math
from collections.abc import Callable, Iterable
from functools import lru_cache
from typing import Any, cast

import numpy as np
import scipy
import xarray as xr

from ...core import checks
from ...core.aliases import Array
from ...core.doubts import Doubt, warn
from ...core.parameters import RATIO
from ...core.units import ACCELERATION, DAMPING, METRE, SECOND, VELOCITY, described, provenance, variables
from ..arrays import motion_coordinates, records
from ..kernels import oscillators as engine

MIN_PERIOD, MAX_PERIOD = 1e-3, 1e3
HOUSNER_PERIODS = np.linspace(0.1, 2.5, 49)
MEAN_PERIOD_BAND = (0.25, 20.0)  # Hz
MEAN_PERIOD_STEP = 0.05  # Hz
BAND_SHARES = (0.05, 0.95)
BAND_STEP = 0.05  # Hz
MOST_PADDED = 2**20  # samples; motions of more than an eighth of them are padded to eight times their length


def period_of(name: str, value: Any) -> float:
    """Return a period in s; ValueError outside 1e-3 to 1e3 s."""
    return checks.number(name, value, at_least=MIN_PERIOD, at_most=MAX_PERIOD, unit="s")


def damping_of(value: Any) -> float:
    """Return a damping ratio; ValueError outside 0 to below 1."""
    return RATIO.number("damping", value)


def peak_displacements(acceleration: Array, dt: float, periods: Array, damping: float) -> Array:
    """Return the peak relative displacement of oscillators (period,) under one record, m."""
    displacement: Array = peak_responses(acceleration, dt, periods, damping, quantities=1)[0]
    return displacement


def peak_responses(acceleration: Array, dt: float, periods: Array, damping: float, quantities: int = 3) -> Array:
    """Return peaks of oscillators under one record, (quantity, period), of one to three quantities.

    These are relative displacement (m), relative velocity (m/s) and absolute acceleration (m/s²).
    """
    omega = 2.0 * math.pi / periods
    peaks = np.empty((quantities, omega.size))
    parts = np.ceil(omega * dt).astype(np.int64)
    for count in np.unique(parts):
        alike = np.flatnonzero(parts == count)
        for first in range(0, alike.size, engine.LANES):
            lanes = alike[first : first + engine.LANES]
            out = np.empty((quantities, lanes.size))
            zeta = np.full(lanes.size, damping)
            engine.oscillator_peaks(acceleration, dt, int(count), omega[lanes], zeta, out)
            peaks[:, lanes] = out
    return peaks


LONGEST_PERIOD, MOST_DAMPED = 10.0, 0.35
"""Longest period, s, and largest damping ratio of a spectrum; the damping is of a building with dampers (assumed)."""


def spectrum_doubts(name: str, period: float, damping: float) -> list[Doubt]:
    """Return the input warnings on a spectrum: a period (of several the shortest) above 10 s, a damping above 0.35."""
    doubts = []
    if period > LONGEST_PERIOD:
        doubts.append(Doubt.of("spectrum_period", name=name, longest=LONGEST_PERIOD))
    if damping > MOST_DAMPED:
        doubts.append(Doubt.of("spectrum_damping", name=name, damping=damping))
    return doubts


def measure_doubts(name: str, measure: Any) -> list[Doubt]:
    """Return the input warnings on the longest period and the damping of a measure."""
    plain = getattr(measure, "base", measure)
    longest = max(getattr(plain, "period", 0.0), *getattr(plain, "periods", ()), 0.0)
    return spectrum_doubts(name, float(longest), getattr(plain, "damping", 0.0))


def response_spectrum(
    motions: xr.DataArray | Iterable[xr.DataArray], periods: Any, damping: float = DAMPING
) -> xr.Dataset:
    """Return the response spectra of every motion.

    Parameters
    ----------
    motions : xarray.DataArray or a sequence of them
        Labelled motions (m s-2), each with its own time step and length.
    periods : array_like, shape (period,)
        Periods of the oscillators, s, 1e-3 to 1e3, in any order, each once.
    damping : float
        Damping ratio, 0 to below 1.

    Returns
    -------
    xarray.Dataset
        On (motion, period): ``sd``, maximum relative displacement (m). ``sv`` = omega sd and ``sa`` = omega² sd are the
        pseudo-velocity (m s-1) and pseudo-acceleration (m s-2) of `Sv` and `Sa`. ``sv_true`` and ``sa_true`` are the
        maximum relative velocity and absolute acceleration. All are maxima during the record of the response from rest,
        between samples too.

    Notes
    -----
    The equation u'' + 2 zeta omega u' + omega² u = -a with a linear between samples is solved exactly. For an
    oscillator whose period is short compared with the time step, exact intermediate states are computed.

    References
    ----------
    Nigam, N. C. and Jennings, P. C. (1969). Calculation of response spectra from strong-motion earthquake records.
    Bulletin of the Seismological Society of America 59(2), 909-922.

    Examples
    --------
    >>> from toppling import motions
    >>> spectrum = response_spectrum(motions.HalfSine(2.0, 10.0).sample(1), [0.2, 0.5, 1.0])
    >>> dict(spectrum.sizes)
    {'motion': 1, 'period': 3}
    """
    plain = records(motions)
    axis = np.atleast_1d(checks.finite_array("periods", periods, ndim=(0, 1), unit="s"))
    for value in axis:
        period_of("periods", float(value))
    if np.unique(axis).size != axis.size:
        raise ValueError("periods must be different from each other, got one twice")
    zeta = damping_of(damping)
    warn(spectrum_doubts("the spectrum", float(axis.min()), zeta))
    omega = 2.0 * math.pi / axis
    peaks = np.array([peak_responses(record.acceleration, record.dt, axis, zeta) for record in plain])
    text = f"{100.0 * zeta:g} % damping"
    spectra = {
        "sd": (peaks[:, 0], METRE, f"spectral displacement, {text}"),
        "sv": (peaks[:, 0] * omega, VELOCITY, f"pseudo-spectral velocity, {text}"),
        "sa": (peaks[:, 0] * omega**2, ACCELERATION, f"pseudo-spectral acceleration, {text}"),
        "sv_true": (peaks[:, 1], VELOCITY, f"greatest relative velocity of an oscillator, {text}"),
        "sa_true": (peaks[:, 2], ACCELERATION, f"greatest absolute acceleration of an oscillator, {text}"),
    }
    return xr.Dataset(
        variables(("motion", "period"), spectra),
        coords={**motion_coordinates(plain), "period": ("period", axis, described("period of the oscillator", SECOND))},
        attrs={"title": "Response spectra", **provenance({"periods": axis.tolist(), "damping": zeta}), "damping": zeta},
    )


def housner_intensity(acceleration: Array, dt: float) -> float:
    """Return the Housner intensity: the integral of the pseudo-velocity spectrum from 0.1 to 2.5 s, m.

    The damping is 5 %, and the integral is the trapezoidal rule on 49 periods 0.05 s apart. For ten simulated motions
    it is within 0.5 % of the result with periods 0.002 s apart. Housner, G. W. (1952). Spectrum intensities of strong
    motion earthquakes. Symposium on Earthquakes and Blast Effects on Structures, Los Angeles.
    """
    displacement = peak_displacements(acceleration, dt, HOUSNER_PERIODS, DAMPING)
    return float(np.trapezoid(displacement * 2.0 * math.pi / HOUSNER_PERIODS, HOUSNER_PERIODS))


def mean_period(acceleration: Array, dt: float) -> float:
    """Return the mean period sum(C²/f)/sum(C²) of the Fourier amplitudes C at 0.25 <= f <= 20 Hz, s.

    The frequencies are 1/(n dt) apart, 0.05 Hz at most; a motion without content in the band has NaN. Rathje, E. M.,
    Faraj, F., Russell, S. and Bray, J. D. (2004). Earthquake Spectra 20(1), 119-144.
    """
    largest = float(np.abs(acceleration).max())
    if largest == 0.0:
        return math.nan
    lowest, highest = MEAN_PERIOD_BAND
    step = min(MEAN_PERIOD_STEP, 1.0 / (acceleration.size * dt))
    first, last = math.ceil(lowest / step), math.floor(min(highest, 0.5 / dt) / step)
    if last <= first:
        return math.nan
    frequency = np.arange(first, last + 1) * step
    # the chirp transform computes this band only, whatever the step of the record
    amplitude = _band_transform(acceleration.size, frequency[0], frequency[-1], frequency.size, dt)(
        acceleration / largest
    )
    power = np.abs(amplitude) ** 2
    total = float(power.sum())
    return float((power / frequency).sum()) / total if total > 0.0 else math.nan


@lru_cache(maxsize=4)
def _band_transform(size: int, first: float, last: float, number: int, dt: float) -> Callable[[Array], Array]:
    """Return the Fourier transform at some frequencies (Hz): it is prepared once for all motions of a length."""
    transform = scipy.signal.ZoomFFT(size, [first, last], number, fs=1.0 / dt, endpoint=True)
    return cast("Callable[[Array], Array]", transform)


def energy_band(acceleration: Array, dt: float) -> tuple[float, float]:
    """Return the frequencies (Hz) below which the `BAND_SHARES` of the energy of a motion lie.

    The energy is the integral of the squared Fourier amplitude of the acceleration over frequency, which by Parseval's
    theorem is the Arias intensity. The band is the counterpart in frequency of the significant duration in time. The
    transform is padded until its frequencies are 0.05 Hz apart at most (up to `MOST_PADDED`); the share is assumed to
    be linear between them. NaN for a motion of zeros.
    """
    largest = float(np.abs(acceleration).max())
    if largest == 0.0:
        return math.nan, math.nan
    padded = min(1.0 / (BAND_STEP * dt), max(MOST_PADDED, 8 * acceleration.size))
    size = scipy.fft.next_fast_len(max(acceleration.size, math.ceil(padded)), real=True)
    energy = np.abs(scipy.fft.rfft(acceleration / largest, size)) ** 2
    # linear between frequencies: the trapezoidal rule, with half the weight at both ends
    reached = np.concatenate([[0.0], np.cumsum(0.5 * (energy[1:] + energy[:-1]))])
    low, high = np.interp(BAND_SHARES, reached / reached[-1], np.arange(energy.size) / (size * dt))
    return float(low), float(high)
