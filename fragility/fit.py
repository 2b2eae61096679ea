"""Lognormal fragility curves by maximum likelihood from counts of overturning at each level."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.special import log_ndtr, ndtri

from .. import checks
from ..units import DIMENSIONLESS
from .probability import overturning_probability

# Why a curve is missing or must not be trusted.
OK = "ok"
NO_RUNS = "no runs"
ONE_LEVEL = "one level"
NONE = "no overturning"
ALL = "all overturned"
SEPARATED = "separated"
DECREASING = "not increasing"
FAILED = "not converged"
FLAT = "flat"
# A median this far (in ln x) outside the levels says only that the data hold no slope.
FAR = np.log(100.0)

MAX_ITERATIONS = 100


class LognormalFit(NamedTuple):
    """Median (unit of the level), dispersion, standard errors of ln(median) and of the dispersion, log-likelihood."""

    median: float = np.nan
    dispersion: float = np.nan
    log_median_se: float = np.nan
    dispersion_se: float = np.nan
    log_likelihood: float = np.nan
    iterations: int = 0
    status: str = OK


def fit_lognormal(
    levels: NDArray[np.float64], overturnings: NDArray[np.int64], runs: NDArray[np.int64]
) -> LognormalFit:
    """Binomial maximum likelihood of P(x) = Phi(ln(x/median)/dispersion); all arrays (level,).

    Fisher scoring with step halving in (a, b) of the probit a + b ln x; standard errors from the observed information,
    carried over to (ln median, dispersion).  Where no finite maximum exists the estimates are NaN and `status` says
    why: ``separated`` means that every level below some point has no overturning and every level above has nothing
    else, so that the data bound the median but say nothing of the dispersion.

    References
    ----------
    Baker, J. W. (2015). Efficient analytical fragility function fitting using dynamic structural analysis. Earthquake
    Spectra 31(1), 579-599.
    """
    # runs at one level are one stripe, wherever they stand in the data
    distinct, where = np.unique(levels[runs > 0], return_inverse=True)
    x = np.log(distinct)
    k = np.bincount(where, overturnings[runs > 0], distinct.size).astype(float)
    n = np.bincount(where, runs[runs > 0], distinct.size).astype(float)
    status = _existence(k, n)
    if status != OK:
        return LognormalFit(status=status)
    centre, width = x.mean(), max(float(np.ptp(x)), 1e-12)
    z = (x - centre) / width
    smoothed = ndtri((k + 0.5) / (n + 1.0))
    slope = float(np.sum((z - z.mean()) * (smoothed - smoothed.mean())) / np.sum((z - z.mean()) ** 2))
    parameters = np.array([smoothed.mean() - max(slope, 0.1) * z.mean(), max(slope, 0.1)])
    value = _log_likelihood(parameters, z, k, n)
    converged = False
    iterations = 0
    for iterations in range(1, MAX_ITERATIONS + 1):
        gradient, expected, _ = _derivatives(parameters, z, k, n)
        try:
            step = np.linalg.solve(expected, gradient)
        except np.linalg.LinAlgError:  # levels too close to be told apart
            return LognormalFit(log_likelihood=value, iterations=iterations, status=FAILED)
        converged = bool(np.all(np.abs(step) <= 1e-10 * (1.0 + np.abs(parameters))))
        for _ in range(40):
            new = _log_likelihood(parameters + step, z, k, n)
            if new >= value - 1e-12 * abs(value):
                break
            step *= 0.5
        parameters = parameters + step
        value = new
        if converged:
            break
    if not converged:
        return LognormalFit(log_likelihood=value, iterations=iterations, status=FAILED)
    a, b = parameters
    if b <= 0.0:
        return LognormalFit(log_likelihood=value, iterations=iterations, status=DECREASING)
    _, _, observed = _derivatives(parameters, z, k, n)
    # ln median = centre - width a/b and dispersion = width/b
    jacobian = np.array([[-width / b, width * a / b**2], [0.0, -width / b**2]])
    try:
        covariance = jacobian @ np.linalg.inv(observed) @ jacobian.T
    except np.linalg.LinAlgError:
        return LognormalFit(log_likelihood=value, iterations=iterations, status=FAILED)
    errors = np.sqrt(np.diag(covariance))
    log_median = centre - width * a / b
    if not np.all(np.isfinite(errors)) or not x[0] - FAR <= log_median <= x[-1] + FAR:
        return LognormalFit(log_likelihood=value, iterations=iterations, status=FLAT)
    return LognormalFit(
        float(np.exp(log_median)), float(width / b), float(errors[0]), float(errors[1]), float(value), iterations
    )


def _existence(k: NDArray[np.float64], n: NDArray[np.float64]) -> str:
    """Whether the likelihood has a finite maximum (Albert and Anderson 1984: the outcomes must overlap)."""
    if k.size == 0:
        return NO_RUNS
    if k.sum() == 0.0:
        return NONE
    if np.all(k == n):
        return ALL
    fell, stood = np.flatnonzero(k > 0.0), np.flatnonzero(k < n)
    if k.size == 1:
        return ONE_LEVEL
    if fell[0] >= stood[-1]:
        return SEPARATED
    if stood[0] >= fell[-1]:
        return DECREASING
    return OK


def _log_likelihood(
    parameters: NDArray[np.float64], z: NDArray[np.float64], k: NDArray[np.float64], n: NDArray[np.float64]
) -> float:
    eta = parameters[0] + parameters[1] * z
    return float(np.sum(k * log_ndtr(eta) + (n - k) * log_ndtr(-eta)))


def _derivatives(
    parameters: NDArray[np.float64], z: NDArray[np.float64], k: NDArray[np.float64], n: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Gradient, expected and observed information of the probit log-likelihood."""
    eta = parameters[0] + parameters[1] * z
    log_density = -0.5 * eta**2 - 0.5 * np.log(2.0 * np.pi)
    up = np.exp(log_density - log_ndtr(eta))  # density over P, and over 1 - P
    down = np.exp(log_density - log_ndtr(-eta))
    design = np.stack([np.ones_like(z), z])
    gradient = design @ (k * up - (n - k) * down)
    expected = (design * (n * up * down)) @ design.T
    observed = (design * (k * up * (up + eta) + (n - k) * down * (down - eta))) @ design.T
    return gradient, expected, observed


def fit_fragility(data: xr.Dataset, confidence: float = 0.95) -> xr.Dataset:
    """Lognormal fragility curves P(overturn | x) = Phi(ln(x/median)/dispersion) by binomial maximum likelihood.

    Parameters
    ----------
    data : xarray.Dataset
        An IDA dataset (`overturned` on motion), or counts: `overturnings` and `runs` on ``level`` and any other
        dimensions, as `overturning_probability` returns them.
    confidence : float
        Of the intervals, between 0 and 1.

    Returns
    -------
    xarray.Dataset
        On the dimensions left: median, median_se, median_lower, median_upper (unit of the level), dispersion,
        dispersion_se, dispersion_lower, dispersion_upper (1), log_likelihood, converged, and status: ``ok``, or why
        the estimates are NaN (``no runs``, ``one level``, ``no overturning``, ``all overturned``, ``separated``, ``not
        increasing``, ``flat``: a median over a hundred times outside the levels, ``not converged``).

    Raises
    ------
    TypeError, ValueError
        A dataset of neither kind, counts that are negative or above the runs, levels that are not positive.

    Notes
    -----
    Intervals are Wald's on ln(median) and on ln(dispersion), from the observed information.  They take the runs as
    independent; in an IDA the same motion returns at every level, which these intervals do not see.

    References
    ----------
    Baker, J. W. (2015), as in `fit_lognormal`.

    Examples
    --------
    >>> import xarray as xr
    >>> counts = xr.Dataset(
    ...     {"overturnings": ("level", [0, 0, 0, 4, 6, 13, 12, 16]), "runs": ("level", [40] * 8)},
    ...     coords={"level": [0.2, 0.3, 0.4, 0.6, 0.7, 0.8, 0.9, 1.0]},
    ... )
    >>> fit = fit_fragility(counts)
    >>> round(float(fit["median"]), 6), round(float(fit["dispersion"]), 6)
    (1.076116, 0.429237)
    """
    level = checks.number("confidence", confidence, above=0.0, below=1.0)
    counts = _counts(data)
    x = checks.finite_array("level", counts["level"].values)
    if np.any(x <= 0.0):
        raise ValueError(f"level must be > 0, got {x.min():g}")
    order = np.argsort(x)
    overturnings = counts["overturnings"].transpose(..., "level")
    runs = counts["runs"].broadcast_like(overturnings).transpose(*overturnings.dims)
    shape = overturnings.shape[:-1]
    fits = [
        fit_lognormal(x[order], k[order], n[order])
        for k, n in zip(overturnings.values.reshape(-1, x.size), runs.values.reshape(-1, x.size), strict=True)
    ]

    def column(name: str) -> NDArray[np.float64]:
        return np.array([getattr(fit, name) for fit in fits], dtype=float).reshape(shape)

    z = float(ndtri(0.5 + 0.5 * level))
    median, dispersion = column("median"), column("dispersion")
    log_se, dispersion_se = column("log_median_se"), column("dispersion_se")
    status = np.array([fit.status for fit in fits], dtype=object).reshape(shape)
    units = counts["level"].attrs.get("units", DIMENSIONLESS)
    percent = f"{100.0 * level:g} %"
    variables: dict[str, tuple[NDArray[np.generic], str, str]] = {
        "median": (median, units, "median of the fragility curve"),
        "median_se": (median * log_se, units, "standard error of the median"),
        "median_lower": (median * np.exp(-z * log_se), units, f"lower end of the {percent} interval of the median"),
        "median_upper": (median * np.exp(z * log_se), units, f"upper end of the {percent} interval of the median"),
        "dispersion": (dispersion, DIMENSIONLESS, "lognormal standard deviation of the fragility curve"),
        "dispersion_se": (dispersion_se, DIMENSIONLESS, "standard error of the dispersion"),
        "dispersion_lower": (
            dispersion * np.exp(-z * dispersion_se / dispersion),
            DIMENSIONLESS,
            f"lower end of the {percent} interval of the dispersion",
        ),
        "dispersion_upper": (
            dispersion * np.exp(z * dispersion_se / dispersion),
            DIMENSIONLESS,
            f"upper end of the {percent} interval of the dispersion",
        ),
        "log_likelihood": (column("log_likelihood"), DIMENSIONLESS, "binomial log-likelihood without its constant"),
        "converged": (status == OK, DIMENSIONLESS, "whether a finite maximum was found"),
        "status": (status, DIMENSIONLESS, "ok, or why there is no estimate"),
    }
    dims = overturnings.dims[:-1]
    coords = {
        name: coordinate
        for name, coordinate in counts.coords.items()
        if "level" not in coordinate.dims and set(coordinate.dims) <= set(dims)
    }
    return xr.Dataset(
        {name: (dims, values, {"units": unit, "long_name": text}) for name, (values, unit, text) in variables.items()},
        coords=coords,
        attrs={
            **counts.attrs,
            "title": "Lognormal fragility curves",
            "method": "binomial maximum likelihood; Wald intervals on ln(median) and ln(dispersion)",
            "confidence": level,
            "im": str(counts["level"].attrs.get("im", "")),
        },
    )


def _counts(data: xr.Dataset) -> xr.Dataset:
    """Counts on level from either kind of dataset, checked."""
    if not isinstance(data, xr.Dataset):
        raise TypeError(f"fit_fragility needs an IDA dataset or a dataset of counts, got {type(data).__name__}")
    counts = overturning_probability(data) if "overturned" in data and "overturnings" not in data else data
    missing = [name for name in ("overturnings", "runs") if name not in counts]
    if missing or "level" not in counts.coords or "level" not in counts["overturnings"].dims:
        raise ValueError(
            f"counts must hold overturnings and runs on a level coordinate, got {sorted(map(str, counts.variables))}"
        )
    k, n = counts["overturnings"], counts["runs"]
    if not (np.issubdtype(k.dtype, np.integer) and np.issubdtype(n.dtype, np.integer)):
        raise TypeError(f"overturnings and runs must be whole numbers, got {k.dtype} and {n.dtype}")
    if not set(n.dims) <= set(k.dims):
        raise ValueError(f"runs must lie on the dimensions of overturnings {k.dims}, got {n.dims}")
    if bool((k < 0).any()) or bool((k > n).any()):
        raise ValueError("overturnings must lie between 0 and runs at every level")
    return counts
