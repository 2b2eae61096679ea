"""Given motions, each adjusted until it has a target's response spectrum."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from .. import checks
from .adjustment import (
    FIRM,
    GOOD,
    PGD_BOUND,
    PGV_BOUND,
    TOLERANCE,
    Bounds,
    Lines,
    Matched,
    Plan,
    check_options,
    ends_held,
    labelled,
    reached_by,
)
from .arrays import records
from .peaks import peak_displacement, peak_velocity
from .targets import TargetSpectrum

Series = NDArray[np.float64]

MOST_STEPS = 24  # for a record
SMOOTHING = 2.0  # s over which the strength of a record is taken
QUIET = 0.02  # of the greatest strength: what a quiet part may still be adjusted with


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
    check_options(pgv_bound, pgd_bound, tolerance)
    plain = records(motions)
    if set(motions.dims) - {"motion", "time"}:
        raise ValueError(f"motions to be matched must have dims (motion, time), got {motions.dims}")
    free = Bounds(0.0, 0.0, None, None).limits()
    found: list[Matched] = []
    values = np.empty((len(plain), plain[0].acceleration.size))
    for i, record in enumerate(plain):
        dt, own = record.dt, record.acceleration.copy()
        lines = Lines.of(target, dt, record.duration)
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
            tries.append((reached_by(values[i], dt, reached, bounds, lines, 1.0), values[i].copy()))
            if bounds.held(tries[-1][0].pgv, tries[-1][0].pgd) and tries[-1][0].misfit <= max(GOOD, tolerance):
                break
        one, values[i] = min(tries, key=lambda t: (not bounds.held(t[0].pgv, t[0].pgd), t[0].misfit))
        found.append(one)
    labels = [record.label for record in plain]
    sources = [f"{record.source}, matched to {target.name}" for record in plain]
    return labelled(values, plain[0].dt, labels, sources, found)


def _strength(acceleration: Series, dt: float) -> Series:
    """Where a record may change: its mean square over a moving window, none at the ends."""
    window = max(1, min(round(SMOOTHING / dt), acceleration.size // 4))
    power = np.convolve(acceleration**2, np.hanning(window + 2)[1:-1], mode="same")
    return np.asarray(np.maximum(power / power.max(), QUIET)) * ends_held(acceleration.size, dt)
