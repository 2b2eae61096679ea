"""Rates over weighted branches: their fractiles, and the shares of the sources of spread."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...core.elementary import Array, log, times

MODELS, MOTIONS, HAZARD, MODEL_ERROR, FINITE, JOINT = (
    "models",
    "motions",
    "hazard",
    "modelling",
    "number of motions",
    "together",
)
SOURCES = (MODELS, MOTIONS, HAZARD, MODEL_ERROR, FINITE, JOINT)
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
        for branch, weight in zip(
            branches, weights, strict=True
        ):  # (a replicate may have no curve; its branch keeps its weight)
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
    out[:, SOURCES.index(JOINT)] = np.maximum(between - out[:, :3].sum(axis=1), 0.0)
    finite, both = np.zeros(means.shape[0]), np.zeros(means.shape[0])
    for rates, before, after, weight in zip(branches, plain, modelled, weights, strict=True):
        of_realisations = rates.weights / rates.weights.sum()
        finite += weight * times(_moments(before)[1], of_realisations)
        both += weight * times(_moments(after)[1], of_realisations)
    out[:, SOURCES.index(FINITE)] = finite
    # (replicates and beta_m are independent of each other)
    out[:, SOURCES.index(MODEL_ERROR)] = np.maximum(both - finite, 0.0)
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
