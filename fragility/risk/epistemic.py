"""Annual rates over weighted branches of models, motions and hazards, with modelling uncertainty.

The curves contain the variability from earthquake to earthquake. Epistemic uncertainty spreads the rate itself: the
right model, the motions of the site, the hazard curve, and the error of the model.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy
import xarray as xr

from ...core import checks
from ...core.elementary import Array, log, times
from ...core.parameters import BETA_M, CHANCE, PART
from ...core.streams import stream
from ...core.units import DIMENSIONLESS, PER_YEAR, described, provenance
from ..curves.curve import REFUSE, CurveArrays, TabulatedCurves, has_replicates
from ..hazard.curve import HazardCurve
from ..hazard.pieces import EXTEND
from ..hazard.plausibility import warn_of_hazards
from ..runs.provenance import coordinates_on
from .annual_rate import rates_alone
from .common_measure import in_hazard_measure
from .convolution import rates_of
from .modelling import MODELLING, with_modelling

FRACTILES = (0.05, 0.16, 0.5, 0.84, 0.95)
SAMPLES = 1000
"""Samples of the modelling uncertainty if curves have no replicates."""


@dataclass(frozen=True, eq=False)
class Branch:
    """One combination: curves under one model and set of motions, a hazard curve, names, and its weight (> 0)."""

    model: str
    motions: str
    hazard_name: str
    curves: xr.Dataset
    hazard: HazardCurve
    weight: float


def epistemic_rates(
    branches: Sequence[Branch],
    modelling_dispersion: float = 0.0,
    *,
    fractiles: Sequence[float] = FRACTILES,
    below: str = EXTEND,
    above: str = EXTEND,
    outside: str = REFUSE,
    seed: int = 0,
) -> xr.Dataset:
    """Return fractiles and the mean of annual rates over weighted branches, and the sources of their spread.

    Parameters
    ----------
    branches : sequence of Branch
        All combinations of models, motions and hazards with their weights, which sum to 1. Curves are of the same
        blocks, in the measure of their hazard. With replicates (`fit_fragility`, ``keep_replicates``) the finite number
        of motions counts. With realisations of a hazard its own uncertainty counts.
    modelling_dispersion : float
        beta_m, the modelling uncertainty of the medians, as `with_modelling` explains; common to all branches.
    fractiles : sequence of float
        Probabilities, between 0 and 1.
    below, above, outside : str
        As for `annual_rate`.
    seed : int
        Of the pairing of replicates with samples of the modelling uncertainty.

    Returns
    -------
    xarray.Dataset
        On the dimensions of the curves: `rate_mean`, the mean of the rate (1/year). `rate_fractile` on fractile: the
        rate is below it with that probability. `branch_rate` on branch, the rate of each branch by itself (without
        beta_m), with the coordinates branch_model, branch_motions, branch_hazard and branch_weight. `spread` on source,
        the share of each source in the variance of ln(rate); the shares sum to 1 (NaN if the rate is 0 or has no
        spread).

    Raises
    ------
    TypeError, ValueError
        No branches. Weights that do not sum to 1, or are no products of the weights of their models, motions and
        hazards. The same combination twice, or one missing. Curves of other blocks. A hazard curve that is a fractile
        of its realisations. With modelling uncertainty, curves that are not lognormal or already contain it. Also as
        `annual_rate`.

    Notes
    -----
    Fractiles are order statistics of all samples: every branch, its realisations and its replicates by their weights.
    Each replicate is paired with one of as many equally probable values of exp(beta_m Z). The mean is from the
    branches' best estimates, with beta_m by sqrt(beta² + beta_m²).

    Shares of the variance of ln(rate) are main effects of the branches, whose realisations count as hazard. The rest of
    their variance is *together*. The mean over branches of the variance by beta_m and by replicates is added.

    Examples
    --------
    >>> curves = xr.Dataset({"median": ((), 0.6, {"units": "m s-2"}), "dispersion": 0.4}, attrs={"im": "pga"})
    >>> hazard = HazardCurve.power_law(1e-4, 2.5, "pga")
    >>> rates = epistemic_rates([Branch("a law", "records", "hazard", curves, hazard, 1.0)], 0.4)
    >>> [f"{rate:.2e}" for rate in rates["rate_fractile"].values]
    ['1.14e-04', '2.18e-04', '5.91e-04', '1.60e-03', '3.05e-03']
    """
    beta = BETA_M.number("modelling_dispersion", modelling_dispersion)
    shares = [CHANCE.number("fractiles", fractile) for fractile in fractiles]
    every = _checked(branches)
    warn_of_hazards(branch.hazard for branch in every)
    first, dims = every[0].curves, in_hazard_measure(every[0].curves, every[0].hazard)[1]
    sampled = [_rates(branch, beta, below, above, outside, seed) for branch in every]
    weights = np.array([branch.weight for branch in every])
    means = np.stack([rates.mean for rates in sampled], axis=-1)
    mean = times(means, weights)
    if beta > 0.0:
        modelled = [
            rates_alone(with_modelling(branch.curves, beta), branch.hazard, below, above, outside)[1].ravel()
            for branch in every
        ]
        mean = times(np.stack(modelled, axis=-1), weights)
    names = [(branch.model, branch.motions, branch.hazard_name) for branch in every]
    spread = shares_of_spread(names, sampled, weights)
    quantiles = fractiles_of(sampled, weights, shares)
    shape = [first.sizes[dim] for dim in dims]
    text = "annual rate of overturning"
    variables = {
        "rate_mean": (dims, mean.reshape(shape), PER_YEAR, f"{text}, mean over all branches"),
        "rate_fractile": ((*dims, "fractile"), quantiles.reshape(*shape, -1), PER_YEAR, f"{text} of the fractile"),
        "branch_rate": ((*dims, "branch"), means.reshape(*shape, -1), PER_YEAR, f"{text} of the branch"),
        "spread": ((*dims, "source"), spread.reshape(*shape, -1), DIMENSIONLESS, "share of the variance of ln(rate)"),
    }
    return xr.Dataset(
        {name: (on, values, described(long_name, units)) for name, (on, values, units, long_name) in variables.items()},
        coords={
            **{name: coordinate for name, coordinate in coordinates_on(first, dims).items() if coordinate.dims},
            "fractile": _labelled("fractile", np.array(shares), "probability that the rate is lower"),
            "source": _labelled("source", np.array(SOURCES, object), "what spreads the rate"),
            **{
                f"branch_{part}": _labelled("branch", np.array(values, object), part)
                for part, values in zip(("model", "motions", "hazard"), zip(*names, strict=True), strict=True)
            },
            "branch_weight": _labelled("branch", weights, "weight of the branch"),
        },
        attrs={
            "title": "Annual rates over branches",
            **provenance({MODELLING: beta, "fractiles": shares, "below": below, "above": above, "outside": outside}),
            MODELLING: beta,
            "im": every[0].hazard.im,
        },
    )


def _checked(branches: Sequence[Branch]) -> list[Branch]:
    every = checks.sequence("branches", branches)
    if not every:
        raise ValueError("branches must hold at least one, got none")
    for combination in every:
        if not isinstance(combination, Branch):
            raise TypeError(f"branches must be Branch, got {checks.kind(combination)}")
        PART.number("weight of a branch", combination.weight)
        if combination.hazard.fractile is not None and combination.hazard.weights is not None:
            raise ValueError(
                f"hazard {combination.hazard_name!r:.60} of a branch must be the mean of its realisations, got their "
                f"fractile {combination.hazard.fractile:g}"
            )
    total = math.fsum(branch.weight for branch in every)
    if not math.isclose(total, 1.0, rel_tol=1e-9):
        raise ValueError(f"weights of the branches must sum to 1, got {total:.9g}")
    names = [(branch.model, branch.motions, branch.hazard_name) for branch in every]
    whole = math.prod(len({name[i] for name in names}) for i in range(3))
    if len(set(names)) < len(names) or len(names) < whole:
        raise ValueError(f"branches must be every combination of models, motions and hazards once, got {len(names)}")
    shares: list[dict[str, float]] = [{}, {}, {}]
    for combination, words in zip(every, names, strict=True):
        for share, word in zip(shares, words, strict=True):
            share[word] = share.get(word, 0.0) + combination.weight
    for combination, name in zip(every, names, strict=True):
        product = math.prod(share[word] for share, word in zip(shares, name, strict=True))
        if not math.isclose(combination.weight, product, rel_tol=1e-6):
            raise ValueError(
                "weights of branches must be products of those of their models, motions and hazards, got "
                f"{combination.weight:g} for {' / '.join(name)!r:.100} in place of {product:g}"
            )
    for combination in every[1:]:
        _refuse_others(every[0].curves, combination.curves)
    return every


def _refuse_others(first: xr.Dataset, curves: xr.Dataset) -> None:
    """Raise ValueError if curves are not of the same blocks and floors, in their order."""
    for name in ("block", "floor"):
        base, labels = (np.atleast_1d(data[name].values) if name in data.coords else None for data in (first, curves))
        same = (base is None) == (labels is None) and (base is None or np.array_equal(base, np.asarray(labels)))
        if not same or first.sizes.get(name) != curves.sizes.get(name):
            raise ValueError(f"curves of all branches must be of the same {name}s in the same order")


def _rates(branch: Branch, beta: float, below: str, above: str, outside: str, seed: int) -> "SampledRates":
    """Return the rates of one branch."""
    if beta > 0.0:
        with_modelling(branch.curves, 0.0)  # (refuses curves that it cannot be in, or is in already)
    pieces = branch.hazard.pieces(below, above)
    realisations = pieces[1:] if branch.hazard.weights is not None else pieces
    weights = np.ones(1) if branch.hazard.weights is None else np.asarray(branch.hazard.weights)
    mean = rates_of(in_hazard_measure(branch.curves, branch.hazard)[0].flat(), pieces[0], outside).rate
    arrays = _sampled(branch, SAMPLES if beta > 0.0 else 1)
    samples = np.stack([rates_of(arrays.flat(), piece, outside).rate for piece in realisations], axis=-1)
    count = arrays.shape[-1]
    shaped = samples.reshape(mean.size, count, weights.size)
    if beta == 0.0:
        return SampledRates(mean, shaped, shaped, weights)
    order = stream(seed, 0).permutation(count)
    z = scipy.special.ndtri((order + 0.5) / count)
    moved = arrays.shifted(np.broadcast_to(beta * z, arrays.shape))
    modelled = np.stack([rates_of(moved.flat(), piece, outside).rate for piece in realisations], axis=-1)
    return SampledRates(mean, shaped, modelled.reshape(shaped.shape), weights)


def _sampled(branch: Branch, least: int) -> CurveArrays:
    """Return the curves of a branch (curve, replicate): its bootstrap replicates, or copies of its curves."""
    if has_replicates(branch.curves):
        return in_hazard_measure(branch.curves, branch.hazard, True)[0]
    arrays = in_hazard_measure(branch.curves, branch.hazard)[0].flat()
    # (tabulated curves are never shifted by beta_m, so that one copy is enough)
    if isinstance(arrays, TabulatedCurves):
        return arrays._replace(values=arrays.values[:, None], shift=arrays.shift[:, None])
    return type(arrays)(*(np.repeat(part[:, None], least, axis=1) for part in arrays))


def _labelled(dim: str, values: Array, long_name: str) -> xr.Variable:
    return xr.Variable(dim, values, described(long_name))


SOURCES = ("models", "motions", "hazard", "modelling", "number of motions", "together")
MODEL_ERROR, FINITE, JOINT = range(3, 6)
"""Sources of spread of a rate: branches of models, motions and hazards; beta_m; the finite number of motions; joint
effects of branches.
"""


class SampledRates(NamedTuple):
    """Rates of one branch: of its best estimate (curve,), and samples (curve, replicate, realisation) with and without
    modelling uncertainty; weights of the realisations.
    """

    mean: Array
    samples: Array
    modelled: Array
    weights: Array


def fractiles_of(branches: Sequence[SampledRates], weights: Array, shares: Sequence[float]) -> Array:
    """Return weighted order statistics (curve, fractile); NaN for a curve without an estimate in some branch."""
    curves = branches[0].mean.size
    out = np.full((curves, len(shares)), np.nan)
    masses = []
    for rates, weight in zip(branches, weights, strict=True):
        part = np.broadcast_to(rates.weights, rates.modelled.shape[1:])
        masses.append((weight * part / part.sum()).ravel())
    mass = np.concatenate(masses)
    for i in range(curves):
        if any(np.isnan(rates.mean[i]) for rates in branches):
            continue
        values = np.concatenate([rates.modelled[i].ravel() for rates in branches])
        known = ~np.isnan(values)
        part = mass.copy()
        begin = 0
        # (a replicate may have no curve; its branch keeps its weight)
        for branch, weight in zip(branches, weights, strict=True):
            end = begin + branch.modelled[i].size
            held = part[begin:end][known[begin:end]].sum()
            part[begin:end] *= weight / held if held > 0.0 else np.nan
            begin = end
        order = np.argsort(values[known], kind="stable")
        total = np.cumsum(part[known][order])
        at = np.searchsorted(total / total[-1], np.array(shares) - 1e-12)
        out[i] = values[known][order][np.minimum(at, order.size - 1)]
    return out


def shares_of_spread(names: Sequence[tuple[str, str, str]], branches: Sequence[SampledRates], weights: Array) -> Array:
    """Return the shares (curve, source) of the variance of ln(rate) of branches by model, motions and hazard."""
    with np.errstate(divide="ignore", invalid="ignore"):
        plain = [log(rates.samples) for rates in branches]
        modelled = [log(rates.modelled) for rates in branches]
        # (of each branch: the mean over replicates, on its realisations)
        central = [_moments(logs)[0] for logs in plain]
    cells: list[tuple[str, str, str]] = []
    columns, mass = [], []
    for (model, motions, hazard), rates, values, weight in zip(names, branches, central, weights, strict=True):
        for k, share in enumerate(rates.weights):
            cells.append((model, motions, f"{hazard} {k}"))
            columns.append(values[:, k])
            mass.append(weight * share / rates.weights.sum())
    means, part = np.stack(columns, axis=1), np.array(mass)
    out = np.zeros((means.shape[0], len(SOURCES)))
    between = _variance(means, part)
    for i in range(3):
        kinds = list(dict.fromkeys(cell[i] for cell in cells))
        of = [np.array([cell[i] == name for cell in cells]) for name in kinds]
        main = np.stack([times(means[:, at], part[at]) / part[at].sum() for at in of], axis=1)
        out[:, i] = _variance(main, np.array([part[at].sum() for at in of]))
    out[:, JOINT] = np.maximum(between - out[:, :3].sum(axis=1), 0.0)
    finite, both = np.zeros(means.shape[0]), np.zeros(means.shape[0])
    for rates, before, after, weight in zip(branches, plain, modelled, weights, strict=True):
        of_realisations = rates.weights / rates.weights.sum()
        finite += weight * times(_moments(before)[1], of_realisations)
        both += weight * times(_moments(after)[1], of_realisations)
    out[:, FINITE] = finite
    # (replicates and beta_m are independent of each other)
    out[:, MODEL_ERROR] = np.maximum(both - finite, 0.0)
    whole = out.sum(axis=1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(np.isfinite(whole) & (whole > 0.0), out / whole, np.nan)


def _moments(values: Array) -> tuple[Array, Array]:
    """Return mean and variance over replicates (curve, realisation) of those that are known, NaN without any."""
    known = np.isfinite(values)
    number = known.sum(axis=1)
    part = np.where(number > 0, 1.0 / np.maximum(number, 1), np.nan)
    mean = np.where(known, values, 0.0).sum(axis=1) * part
    off = np.where(known, values - mean[:, None], 0.0)
    return mean, (off * off).sum(axis=1) * part


def _variance(values: Array, weights: Array) -> Array:
    mean = times(values, weights) / weights.sum()
    off = values - mean[:, None]
    return np.asarray(times(off * off, weights) / weights.sum())
