"""Corrections of labelled motions: baseline, filters, windows and resampling.

Every function takes motions of dims (motion, time) and returns new motions. The attribute `processing` lists the
corrections in the order in which they were made. A correction of one motion is bit-identical alone and among a
thousand.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any, Literal

import numpy as np
import scipy
import xarray as xr

from ..core import checks
from ..core.doubts import warn
from ..core.elementary import Array, orthonormal, times
from ..core.parameters import STEP, Parameter
from ..core.units import described
from .arrays import BEGINS, filter_doubts, records

# Band-limited interpolation: zero crossings of the sinc on each side, and Kaiser's beta; errors stay below 1e-5 up to
# 0.9 of the coarser step's Nyquist frequency.
_CROSSINGS, _KAISER = 48, 12.0
_LARGEST_RATIO = 10_000
_MAX_SAMPLES = 50_000_000
_PIECE = 5_000_000  # samples of the finer step that are filtered at once
_ROUNDING = 1e-12  # of a motion's peak

TAPER, CORNER = Parameter("s", above=0.0), Parameter("Hz", above=1e-9)
"""Half cosine at an end, and corner frequency of a filter."""
BASELINE_ORDERS, FILTER_ORDERS = Parameter(at_least=0, at_most=10), Parameter(at_least=1, at_most=10)
FILTER_ORDER = 4

Kind = Literal["bandpass", "highpass", "lowpass"]


def baseline(motions: xr.DataArray, order: int = 1) -> xr.DataArray:
    """Subtract from each acceleration its best-fitting polynomial in time (least squares).

    Parameters
    ----------
    motions : xarray.DataArray
        Dims (motion, time), m s-2.
    order : int, 0 to 10
        0 subtracts the mean (the offset of a K-NET record), 1 the straight line, and so on.

    Examples
    --------
    >>> from toppling import motions
    >>> record = motions.from_array([1.0, 2.0, 1.0, 2.0], dt=0.01)
    >>> motions.baseline(record, order=0).values.tolist()
    [[-0.5, 0.5, -0.5, 0.5]]
    >>> motions.baseline(record, order=0).attrs["processing"]
    'baseline(order=0)'
    """
    BASELINE_ORDERS.check("order", order, int)
    degree = int(order)
    n = _values(motions)[0].shape[1]
    if n <= degree:
        raise ValueError(f"order must be below the number of samples, got {degree} for {n}")
    # with orthonormal columns the fit is one product, which is well conditioned at any order
    basis = orthonormal(np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, n), degree))

    def without(a: Array) -> Array:
        residual = a - times(basis, times(basis.T, a))
        # What is left of a motion that is nothing but such a polynomial is rounding, and no shaking.
        return residual if np.abs(residual).max() > _ROUNDING * np.abs(a).max() else np.zeros_like(a)

    return _corrected(motions, f"baseline(order={degree})", without)


def bandpass(
    motions: xr.DataArray, low: float, high: float, order: int = FILTER_ORDER, zero_phase: bool = True
) -> xr.DataArray:
    """Filter motions with a Butterworth band-pass from `low` to `high` (Hz).

    Parameters
    ----------
    motions : xarray.DataArray
        Dims (motion, time), m s-2.  Remove their offset first (`baseline`): the filter rings at a step to or from zero
        at the ends.
    low, high : float
        Corner frequencies, Hz, 0 < low < high < 1 / (2 dt).
    order : int, 1 to 10
        Order of the filter at each corner.
    zero_phase : bool
        True runs the filter forwards and backwards: no phase shift, twice the order, -6 dB at the corners.  False runs
        it forwards only: causal, -3 dB at the corners.

    Notes
    -----
    For the filter in both directions the record is padded with zeros of 1.5 order / low seconds on either side. The
    filter needs them for its transients [1]_; they are cut off afterwards. To keep them, so that velocity and
    displacement end at rest, `pad` the record first.

    References
    ----------
    .. [1] Boore, D. M. (2005). On pads and filters: processing strong-motion data. Bulletin of the Seismological
       Society of America 95(2), 745-750.

    Examples
    --------
    >>> from toppling import motions
    >>> record = motions.read(motions.example_path())
    >>> motions.bandpass(record, 0.1, 20.0).attrs["processing"]
    'bandpass(low=0.1 Hz, high=20 Hz, order=4, zero_phase=True)'
    """
    return _filtered(motions, "bandpass", {"low": low, "high": high}, order, zero_phase)


def highpass(motions: xr.DataArray, low: float, order: int = FILTER_ORDER, zero_phase: bool = True) -> xr.DataArray:
    """Filter motions with a Butterworth high-pass above `low` (Hz); everything else as in `bandpass`."""
    return _filtered(motions, "highpass", {"low": low}, order, zero_phase)


def lowpass(motions: xr.DataArray, high: float, order: int = FILTER_ORDER, zero_phase: bool = True) -> xr.DataArray:
    """Filter motions with a Butterworth low-pass below `high` (Hz); everything else as in `bandpass`."""
    return _filtered(motions, "lowpass", {"high": high}, order, zero_phase)


def taper(motions: xr.DataArray, duration: float) -> xr.DataArray:
    """Taper each motion at both ends with a half cosine of `duration` s, > 0 and at most half of the motion."""
    values, dt = _values(motions)
    n = values.shape[1]
    length = replace(TAPER, at_most=0.5 * (n - 1) * dt).number("duration", duration)
    window = scipy.signal.windows.tukey(n, 2.0 * length / ((n - 1) * dt))
    tapered = _corrected(motions, f"taper(duration={length:g} s)", lambda a: a * window)
    warn(filter_doubts([tapered]))
    return tapered


def pad(motions: xr.DataArray, before: float, after: float) -> xr.DataArray:
    """Pad each motion with zeros of `before` and `after` s, >= 0, in whole steps; at most 50 million samples."""
    values, dt = _values(motions)
    steps = [
        int(np.ceil(checks.number(name, value, at_least=0.0, at_most=1e6, unit="s") / dt - 1e-6))
        for name, value in (("before", before), ("after", after))
    ]
    _size(values.shape[0] * (values.shape[1] + sum(steps)))
    note = f"pad(before={before:g} s, after={after:g} s)"
    return _corrected(motions, note, lambda a: np.pad(a, steps), later=-steps[0] * dt)


def trim_husid(motions: xr.DataArray, low: float = 0.05, high: float = 0.95) -> xr.DataArray:
    """Keep the strong motion: between the times at which ∫ü² reaches fractions `low` and `high` of its total.

    Motions in one array are the components of one record: all keep the same window, from the earliest start to the
    latest stop, so that they stay simultaneous. An offset counts as motion: subtract it first (`baseline`). 0 <= low <
    high <= 1; ValueError for a motion of zeros.

    References
    ----------
    Husid, R. (1969). Características de terremotos: análisis general. Revista del IDIEM 8(1), 21-42.
    """
    first = checks.number("low", low, at_least=0.0, below=1.0)
    last = checks.number("high", high, above=first, at_most=1.0)
    values, dt = _values(motions)
    windows = []
    for a in values:
        # the exact integral of the square of an acceleration that is linear between samples, without the factor dt / 3
        growth = np.concatenate([[0.0], np.cumsum(a[:-1] ** 2 + a[:-1] * a[1:] + a[1:] ** 2)])
        if growth[-1] == 0.0:
            raise ValueError("motions to be trimmed must shake, got one that is zero throughout")
        reached = growth / growth[-1]
        # from the last sample not above low to the first not below high, so that the window holds both fractions
        windows.append((np.searchsorted(reached, first, side="right") - 1, np.searchsorted(reached, last)))
    i, j = min(int(w[0]) for w in windows), max(int(w[1]) for w in windows)
    note = f"trim_husid(low={first:g}, high={last:g})"
    return _corrected(motions, note, lambda a: a[i : max(j, i + 1) + 1], later=i * dt)


def resample(motions: xr.DataArray, dt: float) -> xr.DataArray:
    """Resample band-limited motions to another time step `dt` (s).

    Parameters
    ----------
    motions : xarray.DataArray
        Dims (motion, time), m s-2; they should begin and end near zero (`baseline`, `taper`). Beyond its ends a motion
        is assumed to be zero, and the filter rings at a step there.
    dt : float
        New step, s.  Its ratio to the old step must be a ratio of two whole numbers up to 10,000.

    Notes
    -----
    A polyphase filter (`scipy.signal.resample_poly`) with a Kaiser-windowed sinc of 48 zero crossings on each side.
    Unlike an FFT it does not assume a periodic motion, and its cost does not depend on the factors of the length. A
    finer step that divides the old one keeps every old sample. For a coarser step the content above its Nyquist
    frequency is removed first. The models of toppling assume that a motion is linear between its samples, so a finer
    step changes their input. Resampling follows the band-limited curve through the samples instead of the chords.

    References
    ----------
    Oppenheim, A. V. and Schafer, R. W. (2010). Discrete-time signal processing, 3rd ed., section 4.6. Pearson.

    Examples
    --------
    >>> from toppling import motions
    >>> record = motions.read(motions.example_path())
    >>> finer = motions.resample(record, 0.005)
    >>> bool(abs(finer.values[:, ::2] - record.values).max() < 1e-12)
    True
    """
    values, old = _values(motions)
    new = STEP.number("dt", dt)
    ratio = Fraction(min(old / new, 2.0 * _LARGEST_RATIO)).limit_denominator(_LARGEST_RATIO)
    up, down = ratio.numerator, ratio.denominator
    if not 1 <= up <= _LARGEST_RATIO or abs(up / down - old / new) > 1e-9 * old / new:
        raise ValueError(
            f"dt must stand to the motions' step {old:g} s as two whole numbers up to {_LARGEST_RATIO}, got {new!r} s"
        )
    n = (values.shape[1] - 1) * up // down + 1
    if n < 2:
        raise ValueError(f"dt must leave at least 2 samples of {(values.shape[1] - 1) * old:g} s, got {new:g} s")
    _size(values.shape[0] * n)
    note = f"resample(dt={new:g} s)"
    if up == down:
        return _corrected(motions, note, lambda a: a)
    rate = max(up, down)
    window = scipy.signal.firwin(2 * _CROSSINGS * rate + 1, 1.0 / rate, window=("kaiser", _KAISER))
    if down == 1:
        window = window / (window[_CROSSINGS * rate] * up)
    taps: Any = window  # scipy's documentation allows an array here, its type stubs do not
    # (an interrupt is heard between pieces of a fifth of a second; each is summed over the samples of the whole filter)
    parts, around = math.ceil(_PIECE / rate), math.ceil((_CROSSINGS * rate / up + 1) / down)

    def resampled(a: Array) -> Array:
        pieces = []
        for first in range(0, -(-n // up), parts):
            before = min(first, around)
            part = a[(first - before) * down : (first + parts + around) * down]
            longer = scipy.signal.resample_poly(part, up, down, window=taps)
            pieces.append(longer[before * up : (before + parts) * up])
        return np.concatenate(pieces)[:n]

    made = _corrected(motions, note, resampled, dt=new)
    warn(filter_doubts([made]))
    known = [name for name in ("dt_from",) if name in made.coords]
    return made.assign_coords({name: xr.full_like(made[name], "resample") for name in known})


def _butterworth(order: int, corners: Sequence[float], kind: Kind, dt: float) -> Array:
    """Return the sections (section, 6) of `scipy.signal.butter`, whose tangents and products depend on the processor.

    Slow poles are combined with zeros of slow motions, fast poles with zeros of fast motions.
    """
    warped: Any = [math.tan(math.pi * corner * dt) for corner in corners]
    analog = scipy.signal.butter(order, warped if len(warped) > 1 else warped[0], kind, analog=True, output="zpk")
    zeros, poles, gain = scipy.signal.bilinear_zpk(*analog, fs=0.5)
    real, left = [*poles[np.abs(poles.imag) < _ROUNDING]], sorted(zeros.real, reverse=True)
    pairs = [[pole, pole.conjugate()] for pole in poles if pole.imag >= _ROUNDING]
    pairs.sort(key=lambda pair: -pair[0].real / abs(pair[0]))
    pairs[len(pairs) // 2 : len(pairs) // 2] = [real] if real else []  # (of an odd order: one, or two of a wide band)
    sections = np.ones((len(pairs), 6))
    for section, pair in zip(sections, pairs, strict=True):
        for at, roots in ((1, left[: len(pair)]), (4, pair)):
            a, b = [*roots, 0.0][:2]
            section[at : at + 2] = -(a + b).real, (a * b).real
        del left[: len(pair)]
    sections = sections[np.argsort(sections[:, 5], kind="stable")]
    sections[0, :3] *= gain
    return sections


def _filtered(motions: xr.DataArray, kind: Kind, given: dict[str, float], order: int, zero_phase: bool) -> xr.DataArray:
    values, dt = _values(motions)
    corners: list[float] = []
    for name, corner in given.items():
        what, least = (name if len(given) > 1 else "the corner frequency"), max(corners, default=CORNER.bounds["above"])
        corners.append(checks.number(what, corner, above=least, below=0.5 / dt, unit="Hz"))
    FILTER_ORDERS.check("order", order, int)
    poles = int(order)
    checks.flag("zero_phase", zero_phase)
    sections = _butterworth(poles, corners, kind, dt)
    limits = ", ".join(f"{name}={corner:g} Hz" for name, corner in zip(given, corners, strict=True))
    note = f"{kind}({limits}, order={poles}, zero_phase={zero_phase})"
    warn(filter_doubts([motions.assign_attrs(processing=note)]))
    if not zero_phase:
        return _corrected(motions, note, lambda a: scipy.signal.sosfilt(sections, a))
    zeros = int(np.ceil(1.5 * poles / (corners[0] * dt)))
    _size(values.shape[1] + 2 * zeros)

    # the state of each section under a constant input, as of `scipy.signal.sosfilt_zi`
    b, a = sections[:, :3], sections[:, 3:]
    entry = b[:, 1:] - a[:, 1:] * b[:, :1]
    state = entry.sum(axis=1) / a.sum(axis=1)
    gains = np.cumprod([1.0, *(b.sum(axis=1) / a.sum(axis=1))])[:-1, None]
    steady = gains * np.stack([state, entry[:, 1] - a[:, 2] * state], axis=1)

    def both_ways(a: Array) -> Array:
        once = scipy.signal.sosfilt(sections, np.pad(a, zeros))
        twice, _ = scipy.signal.sosfilt(sections, once[::-1], zi=steady * once[-1])
        return np.asarray(twice[::-1][zeros : zeros + a.size])

    return _corrected(motions, note, both_ways)


def _values(motions: xr.DataArray) -> tuple[Array, float]:
    """Return accelerations (motion, time) and their step; an error if the argument is no set of motions."""
    plain = records(motions)
    if set(motions.dims) != {"motion", "time"}:
        raise ValueError(f"motions to be corrected must have dims (motion, time), got {motions.dims}")
    return np.stack([record.acceleration for record in plain]), plain[0].dt


def _size(samples: int) -> None:
    if samples > _MAX_SAMPLES:
        raise ValueError(f"the result would hold {samples:,} samples, allowed are {_MAX_SAMPLES:,}")


def _corrected(
    motions: xr.DataArray, note: str, function: Callable[[Array], Array], dt: float | None = None, later: float = 0.0
) -> xr.DataArray:
    """Apply `function` to every motion, keep the labels, and add the correction `note` to `processing`.

    The first sample is by `later` s later than before.
    """
    values, step = _values(motions)
    if dt is not None:
        step = dt
    corrected = np.stack([function(a) for a in values])
    done = motions.attrs.get("processing")
    array = xr.DataArray(
        corrected,
        dims=("motion", "time"),
        coords={name: c for name, c in motions.coords.items() if "time" not in c.dims},
        name=motions.name,
        attrs={**motions.attrs, "processing": f"{done}; {note}" if done else note},
    )
    time = described("time", "s")
    array = array.assign_coords(time=("time", np.arange(corrected.shape[1]) * step, time))
    if "dt" in motions.coords:
        array = array.assign_coords(dt=("motion", np.full(corrected.shape[0], step), motions["dt"].attrs))
    return array.assign_coords({name: array[name] + later for name in (BEGINS,) if name in array.coords})
