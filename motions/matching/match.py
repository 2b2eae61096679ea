"""Matching of given motions to a target spectrum."""

import math

import numpy as np
import xarray as xr

from ...core import checks
from ...core.doubts import warn
from ...core.elementary import Array, log, times
from ..arrays import records
from ..intensity.peaks import peak_displacement, peak_velocity
from .adjustment import (
    FIRM,
    GOOD,
    PGD_BOUND,
    PGV_BOUND,
    TOLERANCE,
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

MOST_STEPS = 24  # for a record
SMOOTHING = 2.0  # s over which the strength of a record is taken
PIECE = 10**8  # products of the strength that are taken at once
QUIET = 0.02  # of the maximum strength: weight with which quiet parts may still be adjusted


def match(
    motions: xr.DataArray,
    target: TargetSpectrum,
    pgv_bound: float | None = PGV_BOUND,
    pgd_bound: float | None = PGD_BOUND,
    tolerance: float = TOLERANCE,
    scale: bool = True,
) -> xr.DataArray:
    """Adjust given motions, each until it has the target's response spectrum.

    Parameters
    ----------
    motions : xarray.DataArray
        One labelled array (motion, time), m s-2; ValueError for a motion of zeros, and for samples times periods above
        some 30 million.
    target : TargetSpectrum
        Target, matched at eight periods per octave; the shortest at least 2 dt, the longest at most the duration.
    pgv_bound, pgd_bound : float or None
        Maximum relative change of PGV and PGD (factor 1 + bound up or down) from the scaled motion; None for no bound.
    tolerance : float
        Mean misfit over the periods at which the adjustment stops, 0.005 to 0.5.
    scale : bool
        True scales the motion first, by the factor that makes the mean log misfit zero.  The references of PGV and PGD
        are those after scaling.

    Returns
    -------
    xarray.DataArray
        The adjusted motions, at rest at their end, with the coordinates on motion that `SpectrumCompatible.sample`
        names. A residual displacement is removed before the references of PGV and PGD are taken.

    Notes
    -----
    With the peaks of all oscillators fixed at their times, each step computes the smallest change of acceleration that
    corrects all peaks at once. The change is weighted by the local strength of the motion. It also makes end velocity
    and displacement zero, and brings excursions of velocity and displacement back within their bounds. The peaks move,
    so the step is repeated up to 24 times, and the best motion is kept: bounds first, then the misfit.

    A spectrum that the motion cannot have with its own PGV and PGD is then not reached. The motion is named in a
    warning (`TargetMissed`), its coordinate ``target_met`` is false, and wider bounds help.

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
    check_options(pgv_bound, pgd_bound, tolerance)
    plain = records(motions)
    if set(motions.dims) - {"motion", "time"}:
        raise ValueError(f"motions to be matched must have dims (motion, time), got {motions.dims}")
    free = Bounds(0.0, 0.0, None, None).limits()
    results: list[MatchResult] = []
    values = np.empty((len(plain), plain[0].acceleration.size))
    for i, record in enumerate(plain):
        dt, adjusted = record.dt, record.acceleration.copy()
        lines = Lines.of(target, dt, record.duration)
        spectrum = lines.spectrum(adjusted, dt)
        if not np.all(spectrum > 0.0):
            raise ValueError(f"motion {record.label!r} has no response at some period and cannot be matched")
        if scale:
            adjusted *= math.exp(float(np.mean(log(lines.sa / spectrum))))
        freedom = _strength(adjusted, dt)
        lines.adjust(adjusted, dt, freedom, free, Plan(0, tolerance))
        bounds = Bounds(peak_velocity(adjusted, dt), peak_displacement(adjusted, dt), pgv_bound, pgd_bound)
        tries = []
        for firm in FIRM:
            values[i] = adjusted
            reached = lines.adjust(values[i], dt, freedom, bounds.limits(), Plan(MOST_STEPS, tolerance, firm))
            tries.append((match_result(values[i], dt, reached, bounds, lines, 1.0), values[i].copy()))
            if bounds.held(tries[-1][0].pgv, tries[-1][0].pgd) and tries[-1][0].misfit <= max(GOOD, tolerance):
                break
        result, values[i] = min(tries, key=lambda t: (not bounds.held(t[0].pgv, t[0].pgd), t[0].misfit))
        results.append(result)
    labels = [record.label for record in plain]
    sources = [f"{record.source}, matched to {target.name}" for record in plain]
    matched = labelled_matches(values, plain[0].dt, labels, sources, results, tolerance)
    warn(matching_doubts([matched]), TargetMissed)
    return matched


def _strength(acceleration: Array, dt: float) -> Array:
    """Return the weight of changes of a record: its mean square over a moving window, zero at the ends."""
    window = max(1, min(round(SMOOTHING / dt), acceleration.size // 4))
    padded = np.pad(acceleration**2, (window // 2, (window - 1) // 2))
    windows, hanning = np.lib.stride_tricks.sliding_window_view(padded, window), np.hanning(window + 2)[1:-1]
    # (an interrupt is heard between the pieces)
    pieces = np.array_split(windows, math.ceil(windows.size / PIECE))
    power = np.concatenate([times(piece, hanning) for piece in pieces])
    return np.asarray(np.maximum(power / power.max(), QUIET)) * end_window(acceleration.size, dt)
