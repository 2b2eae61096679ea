"""Sufficiency of the measure of stripes: dependence of outcomes at a given level on other features of motions.

If they do, a probability at the level is valid only for motions with these features. The set of a stripe must then have
them as the hazard does.
"""

from collections.abc import Sequence

import numpy as np
import scipy
import xarray as xr

from ...core import checks
from ...core.elementary import Array, Flags, Index, crossed, inverse, log, solve, times
from ...core.units import described
from ...motions.intensity.measure import Measure
from ...motions.intensity.naming import measure_named
from ..runs.provenance import STRIPES, clusters_of, design_of, provenance_from

FACTOR = "factor"
USUAL = ("pgv", "d5_95", FACTOR)
STEPS, SETTLED, STEEPEST = 60, 1e-9, 30.0
"""Maximum number of Newton steps, the step at which they end, and the slope beyond which data count as separated."""
FEWEST = 10
"""Minimum number of runs of the rarer outcome per coefficient for a known slope (Peduzzi and others 1996)."""


def stripe_sufficiency(runs: xr.Dataset, covariates: Sequence[str | Measure] = USUAL) -> xr.Dataset:
    """Test the dependence of overturning at the levels of stripes on other features of the motions.

    Parameters
    ----------
    runs : xarray.Dataset
        Runs of `toppling.stripes` at levels of a measure that the motions were scaled to.
    covariates : sequence of measures or their names
        Of the motions as scaled; ``factor`` is the factor itself.  Their values of the motions as given must be in the
        runs (pga, pgv, pgd, arias, cav, d5_75, d5_95 always are).

    Returns
    -------
    xarray.Dataset
        On (block, model, covariate): `slope`, the change of the log odds of overturning per standard deviation of the
        logarithm of the covariate within stripes. Also `slope_se`, and `p_value` of no dependence (two-sided, normal).
        On (block, model) `runs`, the number in stripes with both outcomes. On covariate `spread`, the standard
        deviation within stripes. NaN with fewer than ten runs of the rarer outcome per covariate, or if the covariates
        separate the two outcomes.

    Notes
    -----
    The model is logit P = a_stripe + sum of slope_k z_k, z_k = (x_k - mean of the stripe)/spread_k, x the logarithms,
    by maximum likelihood. Errors are robust, with the runs of a ground motion as one cluster, because neighbouring
    stripes share motions.

    References
    ----------
    Luco, N. and Cornell, C. A. (2007). Structure-specific scalar intensity measures for near-source and ordinary
    earthquake ground motions. Earthquake Spectra 23(2), 357-392 (sufficiency).  Liang, K.-Y. and Zeger, S. L. (1986).
    Longitudinal data analysis using generalized linear models. Biometrika 73, 13-22.  Peduzzi, P. and others (1996). A
    simulation study of the number of events per variable in logistic regression analysis. Journal of Clinical
    Epidemiology 49, 1373-1379.

    Examples
    --------
    >>> import toppling as tp
    >>> pool = tp.motions.CloughPenzien(duration=8.0, dt=0.02).sample(60, seed=4)
    >>> block = tp.Block(width=0.2, height=1.0)
    >>> runs = tp.stripes(block, tp.HousnerImpact(), [pool, pool], [3.0, 4.0], outputs=["overturned"])
    >>> tests = stripe_sufficiency(runs, ["pgv"])
    >>> bool(tests["slope"].item() > 0.0), bool(tests["p_value"].item() < 0.05)
    (True, True)
    """
    _check(runs)
    checks.not_empty("runs", runs)
    labels, values = _covariates(runs, covariates)
    stripe = np.unique(runs["stripe"].values, return_inverse=True)[1]
    residuals = values - _means(values, stripe)[stripe]
    spread = np.sqrt((residuals**2).sum(axis=0) / (len(stripe) - stripe.max() - 1))
    if spread.min() <= 1e-12:
        raise ValueError(f"{labels[int(spread.argmin())]} does not vary within the stripes")
    clusters = clusters_of(runs)
    fell = runs["overturned"].transpose("block", "model", "motion").values
    blocks, models = fell.shape[:2]
    tests = [[slopes(residuals / spread, stripe, fell[i, j], clusters) for j in range(models)] for i in range(blocks)]
    slope, error, used = (np.array([[test[k] for test in row] for row in tests]) for k in range(3))
    of_odds = "change of the log odds of overturning per standard deviation of the covariate within stripes"
    dims = ("block", "model", "covariate")

    def variable(values: Array, text: str) -> tuple[tuple[str, ...], Array, dict[str, str]]:
        return dims[: values.ndim], values, described(text)

    return xr.Dataset(
        {
            "slope": variable(slope, of_odds),
            "slope_se": variable(error, "standard error of the slope"),
            "p_value": variable(2.0 * scipy.special.ndtr(-np.abs(slope / error)), "p-value of no dependence"),
            "runs": variable(used, "runs of stripes in which some fall and some stand"),
            "spread": ("covariate", spread, described("standard deviation within stripes")),
        },
        coords={
            **{name: runs[name] for name in ("block", "model")},
            "covariate": ("covariate", labels, described("ln of the motions' feature")),
        },
        attrs={
            "title": "Sufficiency of the measure of stripes",
            **provenance_from("stripe_sufficiency", {"covariates": labels}, runs=runs),
        },
    )


def _check(runs: xr.Dataset) -> None:
    """Raise TypeError or ValueError for anything but runs of stripes."""
    if not isinstance(runs, xr.Dataset) or "overturned" not in runs:
        raise TypeError(f"runs must be a dataset with overturned, got {checks.kind(runs)}")
    if design_of(runs) != STRIPES:
        raise ValueError(f"runs must be those of stripes, got those of {design_of(runs)}")
    if {*runs["overturned"].dims} != {"block", "model", "motion"}:
        raise ValueError(f"runs must be on block, model and motion, got {runs['overturned'].dims}")


def _covariates(runs: xr.Dataset, wanted: Sequence[str | Measure]) -> tuple[list[str], Array]:
    """Return labels and logarithms (motion, covariate) of features of the motions as scaled."""
    if isinstance(wanted, str | Measure) or not isinstance(wanted, Sequence) or not wanted:
        raise TypeError(f"covariates must be a sequence of measures or 'factor', got {checks.kind(wanted)}")
    name = str(runs["intensity"].attrs.get("im", ""))
    of_runs = measure_named(name, "im of the runs")
    if of_runs.label not in runs.coords or of_runs.power == 0.0:
        raise ValueError(f"the runs hold no {of_runs.label} of the motions as given, from which their factors follow")
    log_factor = log(runs["intensity"].values / runs[of_runs.label].values) / of_runs.power
    labels, columns = [], []
    for feature in wanted:
        if feature == FACTOR:
            labels.append(FACTOR)
            columns.append(log_factor)
            continue
        measure = measure_named(feature)
        if measure.label not in runs.coords or runs[measure.label].dims != ("motion",):
            raise ValueError(f"the runs hold no {measure.label} of their motions")
        labels.append(measure.label)
        columns.append(log(runs[measure.label].values) + measure.power * log_factor)
    if len(set(labels)) < len(labels):
        raise ValueError(f"covariates hold {max(labels, key=labels.count)} twice")
    return labels, np.column_stack(columns)


def _means(values: Array, stripe: Index) -> Array:
    """Return the means (stripe, covariate) of values of the runs."""
    sums = np.zeros((int(stripe.max()) + 1, values.shape[1]))
    np.add.at(sums, stripe, values)
    return np.asarray(sums / np.bincount(stripe)[:, None])


def slopes(z: Array, stripe: Index, fell: Flags, clusters: Index) -> tuple[Array, Array, int]:
    """Return the slopes (covariate,) of a logistic regression with an intercept a stripe, their errors, and its runs.

    z (run, covariate); stripe, fell, clusters (run,). Slopes and errors are NaN if they are not determined.
    """
    k = z.shape[1]
    unknown = np.full(k, np.nan)
    falls, sizes = np.bincount(stripe, weights=fell), np.bincount(stripe)
    mixed = ((falls > 0.0) & (falls < sizes))[stripe]
    n = int(mixed.sum())
    if min(int(fell[mixed].sum()), n - int(fell[mixed].sum())) < FEWEST * k:
        return unknown, unknown, n
    numbered = np.unique(stripe[mixed], return_inverse=True)[1]
    design = np.concatenate([np.eye(int(numbered.max()) + 1)[numbered], z[mixed]], axis=1)
    y = fell[mixed].astype(float)
    b = np.zeros(design.shape[1])
    for _ in range(STEPS):
        p = scipy.special.expit(times(design, b))
        information = crossed(design * (p * (1.0 - p))[:, None], design)
        try:
            step = solve(information, times(y - p, design))
        except np.linalg.LinAlgError:
            return unknown, unknown, n
        b = b + step
        if np.abs(step).max() < SETTLED:
            break
    if not np.all(np.isfinite(b)) or np.abs(b).max() > STEEPEST or np.abs(step).max() >= SETTLED:
        return unknown, unknown, n
    p = scipy.special.expit(times(design, b))
    bread = inverse(crossed(design * (p * (1.0 - p))[:, None], design))
    groups = np.unique(clusters[mixed], return_inverse=True)[1]
    scores = np.zeros((int(groups.max()) + 1, design.shape[1]))
    np.add.at(scores, groups, design * (y - p)[:, None])
    g = len(scores)
    covariance = times(times(bread, crossed(scores, scores)), bread) * (g / (g - 1.0))
    return b[-k:], np.sqrt(np.diag(covariance))[-k:], n
