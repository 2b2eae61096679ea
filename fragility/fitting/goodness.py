"""Goodness of fit of fragility curves by parametric bootstrap, and comparison of forms by Akaike's criterion.

Akaike, H. (1974). A new look at the statistical model identification. IEEE Transactions on Automatic Control 19,
716-723. Correlated normal scores: Emrich, L. J. and Piedmonte, M. R. (1991). A method for generating high-dimensional
multivariate binary variates. The American Statistician 45, 302-304 (recalled). Su, J. Q. and Wei, L. J. (1991). A
lack-of-fit test for the mean function in a generalized linear model. Journal of the American Statistical Association
86, 420-426.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import scipy
import xarray as xr
from numpy.typing import NDArray

from ...core import checks
from ...core.elementary import Array, Index, exp, times
from ...core.parameters import COUNT
from ...core.streams import stream
from ...core.units import described
from ..runs.provenance import ADAPTIVE, CLOUD, carried_attributes
from .fit import FIRST, METHODS, USUAL, check_method, fit_fragility, form_named
from .form import Fit, Form
from .likelihood import PENALTIES
from .links import LOGNORMAL
from .states import State
from .trials import ROCKED, STATES, STOOD, TOPPLED, Sample, collect
from .two_parameter import TWO_PARAMETER_FORMS

Draw = Callable[[np.random.Generator], NDArray[Any]]
SCORES = np.linspace(-6.0, 6.0, 401)
"""Normal scores of a motion at which moments are summed."""
MOST_SHARED = 0.998
"""Maximum share of a motion in the score of its runs, except a share of 1, for which the spacing of these scores is
close enough.
"""


def goodness_of_fit(
    data: xr.Dataset,
    form: str | Fit = LOGNORMAL,
    *,
    method: str = USUAL.method,
    penalty: str = USUAL.penalty,
    replicates: int = USUAL.replicates,
    seed: int = USUAL.seed,
    state: State = USUAL.state,
) -> xr.Dataset:
    """Goodness of fit of fragility curves by parametric bootstrap.

    Parameters
    ----------
    data, form, method, penalty, state
        As in `fit_fragility`.
    replicates, seed : int
        Of the simulated studies; replicate r draws from SeedSequence(seed, spawn_key=(r,)).

    Returns
    -------
    xarray.Dataset
        On the dimensions of the curves: statistic (1), and p_value, the share of simulated studies that fit as badly or
        worse, (1 + as bad)/(1 + replicates). NaN without a curve.

    Raises
    ------
    TypeError, ValueError
        As `fit_fragility`; motions run both ways, whose runs are less alike than runs of one way; runs at adaptive
        levels.

    Notes
    -----
    The statistic is the deviance from the observed fractions (of first overturnings: from the observed shares of the
    intervals). The deviance of a cloud from its flags contains no information on the fit. The statistic is then the
    largest absolute sum of residuals up to any intensity, over its standard deviation (Su and Wei 1991). Studies are
    simulated from the fitted curve and fitted again.

    If motions are repeated (an IDA), the runs of each simulated motion have equally correlated normal scores (a
    Gaussian copula of one factor). A correlation of 1 is one capacity for all levels, and 0 is independent runs. The
    correlation is chosen so that the numbers of overturnings of the motions vary as in the runs. Simulated motions may
    therefore also fail to overturn above their first overturning (`resurrections`).

    Of lognormal truths 3-7 % were rejected at 5 % (`benchmarks.coverage.goodness`), with correlations of 0, 0.3, 0.5,
    0.8 and 1, 20 to 400 motions, and 6 and 20 levels. It was as many if the correlation fell with the distance of
    levels. With one capacity for each motion, whatever the runs, it was 13-26 % at 0.3. Chi-square quantiles, which
    assume independent runs, are wrong above 0. Motions of the study drawn again, their fractions shifted to the curve,
    rejected 9-20 %.
    """
    chosen = form_named(form)
    first = checks.choice("method", method, METHODS) == FIRST
    trials = collect(data, first, state)
    if trials.design == ADAPTIVE:
        raise ValueError(
            "goodness of fit simulates runs at given levels, and adaptive levels follow from the outcomes: "
            "their results hold misfit, of the curve's median from that of levels near it"
        )
    if trials.ways > 1:
        raise ValueError(
            "goodness of fit takes any two runs of a motion to be equally correlated, and these are run both ways: "
            "test each polarity by itself, runs.isel(motion=runs.polarity == 1)"
        )
    check_method(chosen, method)
    checks.choice("penalty", penalty, tuple(PENALTIES))
    number = COUNT.count("replicates", replicates)
    start = checks.count("seed", seed)
    cloud = trials.design == CLOUD
    tests = [_test(chosen, sample, penalty, number, start, cloud) for sample in trials.samples]
    statistic, p_value = np.array(tests).T.reshape((2, *trials.shape))
    text = "largest standardised sum of residuals" if cloud else "deviance"
    return xr.Dataset(
        {
            "statistic": (trials.dims, statistic, described(text)),
            "p_value": (trials.dims, p_value, described("share of simulated studies that fit as badly or worse")),
        },
        coords=trials.coords,
        attrs={
            **carried_attributes(trials.attrs),
            "title": "Goodness of fit",
            "form": chosen.name,
            "statistic": text,
            "replicates": number,
            "seed": start,
        },
    )


def compare_forms(
    data: xr.Dataset,
    forms: Sequence[str | Fit] = tuple(TWO_PARAMETER_FORMS),
    *,
    method: str = USUAL.method,
    penalty: str = USUAL.penalty,
    state: State = USUAL.state,
) -> xr.Dataset:
    """Akaike's criterion of several forms fitted to the same data.

    Parameters
    ----------
    data, method, penalty, state
        As in `fit_fragility`.
    forms : sequence of str or callable
        As `form` there; isotonic curves and own fits without `parameters` have no criterion.

    Returns
    -------
    xarray.Dataset
        aic, log_likelihood and aic_difference (from the minimum), on form and the dimensions of the curves.

    Notes
    -----
    The likelihood of every form is of the same overturnings.  In an IDA it takes the runs as independent, which
    magnifies differences: there, prefer ``method="first-overturning"``.

    Examples
    --------
    >>> import xarray as xr
    >>> counts = xr.Dataset(
    ...     {"overturnings": ("level", [0, 0, 0, 4, 6, 13, 12, 16]), "runs": ("level", [40] * 8)},
    ...     coords={"level": [0.2, 0.3, 0.4, 0.6, 0.7, 0.8, 0.9, 1.0]},
    ... )
    >>> compare_forms(counts)["aic_difference"].round(2).values.tolist()
    [0.0, 1.25, 2.03]
    """
    names = [form_named(form).name for form in checks.sequence("forms", forms)]
    if not names or len(set(names)) != len(names):
        raise ValueError(f"forms must hold at least one form, each once, got {names}")
    fits: list[Any] = []
    for form in forms:
        kind = "wald" if "wald" in form_named(form).intervals else None
        number = 1 if kind is None else 1000
        curves = fit_fragility(
            data, form=form, method=method, penalty=penalty, intervals=kind, replicates=number, state=state
        )
        if "aic" not in curves:
            curves["aic"] = curves["log_likelihood"] * np.nan
        fits.append(curves[["aic", "log_likelihood"]].drop_vars("level", errors="ignore"))
    named = xr.Variable("form", np.array(names, dtype=object), described("form of curve"))
    compared: xr.Dataset = xr.concat(fits, named, combine_attrs="drop_conflicts").assign_coords(form=named)
    compared["aic_difference"] = compared["aic"] - compared["aic"].min("form")
    compared["aic_difference"].attrs = described("criterion over the least of all forms")
    for name in ("aic", "log_likelihood"):
        compared[name].attrs = dict(fits[0][name].attrs)
    return compared.assign_attrs(title="Forms of fragility curves compared")


def _test(form: Form, sample: Sample, penalty: str, replicates: int, seed: int, cloud: bool) -> tuple[float, float]:
    """The statistic of one curve and its p-value."""
    measure = _residual_sums if cloud else _deviances
    observed = measure(form, sample, sample.cells[None], penalty)[0]
    if not np.isfinite(observed):
        return float(observed), np.nan
    simulated = measure(form, sample, _simulated(form, sample, penalty, replicates, seed), penalty)
    # a simulated study that cannot be fitted counts as one that fits badly
    worse = int((~(simulated < observed * (1.0 - 1e-9))).sum())
    return float(observed), (1.0 + worse) / (1.0 + replicates)


def _simulated(form: Form, sample: Sample, penalty: str, replicates: int, seed: int) -> Array:
    """Cells (replicate, cell) drawn from the fitted curve."""
    draw = _first_overturnings if sample.by_interval else _motions if sample.repeated else _runs
    drawn = draw(form, sample, penalty)
    cells = np.empty((replicates, sample.cells.size))
    for replicate in range(replicates):
        cells[replicate] = drawn(stream(seed, replicate))
    return cells


def _first_overturnings(form: Form, sample: Sample, penalty: str) -> Draw:
    """Return a generator of first overturnings by interval: each motion's capacity is drawn from the curve."""
    curve = form.probabilities(sample, sample.cells[None], penalty)[0]
    motions = int(sample.cells.sum())
    return lambda rng: np.bincount(np.searchsorted(curve, rng.random(motions)), minlength=sample.cells.size)


def _motions(form: Form, sample: Sample, penalty: str) -> Draw:
    """Return a generator of the states of all runs, whose normal scores are correlated within each motion."""
    chances = form.state_probabilities(sample, penalty)
    motion, level, fell = sample.single_runs
    shared, single = _score_shares(motion, level, fell - chances[level, TOPPLED], chances[:, TOPPLED])
    # (score below which a run overturns, and below which it lifts off)
    falls, lifts = scipy.special.ndtri(np.minimum([chances[:, TOPPLED], chances[:, ROCKED:].sum(axis=1)], 1.0))

    def draw(rng: np.random.Generator) -> Array:
        score = shared * rng.standard_normal(motion[-1] + 1)[motion] + single * rng.standard_normal(motion.size)
        state = np.where(score < falls[level], TOPPLED, np.where(score < lifts[level], ROCKED, STOOD))
        return np.bincount(level * STATES + state, minlength=sample.cells.size).astype(float)

    return draw


def _score_shares(motion: Index, level: Index, residual: Array, chance: Array) -> tuple[float, float]:
    """Return the roots of the shares of a run's normal score that its motion and the run alone have.

    With the share of the motion, the numbers of overturnings of the motions vary as among the runs. `residual` has the
    runs' differences from the `chance` at their levels. Given the motion's part of the score, runs are independent:
    moments are sums over `SCORES`, of equal steps.
    """
    runs: Any = scipy.sparse.csr_array((np.ones(motion.size), (motion, level)), (motion[-1] + 1, chance.size))
    observed = float((np.bincount(motion, residual) ** 2).sum())
    expected = runs @ chance
    density = exp(-0.5 * SCORES**2)
    density /= density.sum()

    def excess(share: float) -> float:
        given = (scipy.special.ndtri(chance)[:, None] - math.sqrt(share) * SCORES) / math.sqrt(1.0 - share)
        p = scipy.special.ndtr(given)
        within, between = runs @ (p * (1.0 - p)), (runs @ p - expected[:, None]) ** 2
        return float(times((within + between).sum(axis=0), density)) - observed

    if excess(0.0) >= 0.0:
        share = 0.0
    elif excess(MOST_SHARED) <= 0.0:
        share = 1.0
    else:
        share = float(scipy.optimize.brentq(excess, 0.0, MOST_SHARED, xtol=1e-4))
    return math.sqrt(share), math.sqrt(1.0 - share)


def _runs(form: Form, sample: Sample, penalty: str) -> Draw:
    """Return a generator of the states of independent runs."""
    chances = form.state_probabilities(sample, penalty)
    shares = chances / chances.sum(axis=1, keepdims=True)
    runs = sample.level_counts[1]
    return lambda rng: rng.multinomial(runs, shares).ravel().astype(float)


def _deviances(form: Form, sample: Sample, cells: Array, penalty: str) -> Array:
    """Deviances: twice the difference between the saturated and the fitted log-likelihood of each replicate."""
    p = form.probabilities(sample, cells, penalty)
    if sample.by_interval:
        shares = np.diff(p, axis=1, prepend=0.0, append=1.0)
        return 2.0 * _lacking(cells, shares * cells.sum(axis=1, keepdims=True))
    overturnings, runs = sample.counts_in(cells)
    return 2.0 * (_lacking(overturnings, runs * p) + _lacking(runs - overturnings, runs * (1.0 - p)))


def _lacking(observed: Array, expected: Array) -> Array:
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.where(observed > 0.0, observed / expected, 1.0)
    return np.where(np.isnan(expected).any(axis=1), np.nan, scipy.special.xlogy(observed, ratio).sum(axis=1))


def _residual_sums(form: Form, sample: Sample, cells: Array, penalty: str) -> Array:
    p = form.probabilities(sample, cells, penalty)
    overturnings, runs = sample.counts_in(cells)
    spread = np.sqrt((runs * p * (1.0 - p)).sum(axis=1))
    return np.asarray(np.abs(np.cumsum(overturnings - runs * p, axis=1)).max(axis=1) / spread)
