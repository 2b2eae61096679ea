"""Savings of anchoring: the items of a performance assessment ranked, each by itself and one after the other."""

from dataclasses import replace

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...core import checks
from ...core.aliases import Array, Flags, Index
from ...core.units import DIMENSIONLESS, ENDS, PER_YEAR, described, of_end
from ...core.wording import given_percent
from ...fragility.curves.means import resampled_means
from ...fragility.fitting.bootstrap import REPLICATES
from ...fragility.numerics.slabs import Allocator, in_memory, slabs
from ...fragility.runs.labels import ordered
from .outcomes import ANY
from .savings import AdditiveItems, EventItems, FreeItems, ItemChances, most_left, order_of, score_of
from .variables import JOINT, Precision, Year, carried_items, level_index, per_year, variable

AMOUNTS = ("number", "loss")


def anchoring(
    assessment: xr.Dataset,
    objective: str = "loss",
    *,
    level: float | None = None,
    per_cost: bool = False,
    replicates: int = REPLICATES,
    seed: int = 0,
    array: Allocator = in_memory,
) -> xr.Dataset:
    """Rank the items that are not anchored by the saving of anchoring all their pieces.

    Parameters
    ----------
    assessment : xarray.Dataset
        As `assess` returns it.
    objective : str
        ``loss`` or ``number``: the expectation over all that overturns. ``any``: the probability that at least one
        piece overturns. Or a consequence, such as ``blocks-exit``: the probability that at least one piece with this
        consequence overturns.
    level : float, optional
        One of the levels: the expectation or probability given this level, instead of the annual value.
    per_cost : bool
        Rank by saving over cost; every item that is not anchored must then have an ``anchoring_cost``.
    replicates, seed : int
        Number of resamples and seed of the intervals, as for `assess`.
    array : callable
        Allocates an array of a shape and a type for data of every item and motion; in memory if not given.

    Returns
    -------
    xarray.Dataset
        On (model, item), for items that count for the objective and are not anchored: ``saving`` by anchoring this one
        alone, and ``saving_share`` of all that can be saved. ``alone`` is the objective if only this one could fall; it
        exceeds the saving if others have the same effect in the same motions. Further ``cost``, ``saving_per_cost``,
        and ``rank`` (1 is the first to anchor).

        On (model, step): ``anchored_block``, the next to anchor when each is chosen for its saving after the previous
        choices. Further the objective ``left`` then, and the ``total_cost``; step 0 is the present state.

        ``…_lower`` and ``…_upper`` are ends of intervals over motions. They are paired: the building has the same
        resampled motions with and without the item.

    Raises
    ------
    TypeError, ValueError
        No assessment, an objective that it lacks, no such level, neither a level nor a hazard curve, a missing cost,
        nothing to anchor.

    Notes
    -----
    Expectations add up, so the steps are in the order of the savings. A piece on another piece is an exception: its
    value is lost if either falls. Anchoring one of the two saves it only in motions in which the other does not fall.
    Probabilities of a consequence do not add up: of two shelves that fall across the same door in the same motions,
    anchoring one saves nothing. A step in which no item saves anything takes the item with the largest value alone.

    Examples
    --------
    >>> import toppling as tp
    >>> from toppling.studies.buildings.assessment import Assessment, assess
    >>> from toppling.studies.inventory.reading import Contents, Inventory
    >>> low, tall = (Contents(f"{n} shelves", tp.catalogue[f"bookcase-{n}-shelf"], floor=0) for n in (2, 6))
    >>> shaking = tp.motions.CloughPenzien(duration=10.0, dt=0.01).sample(6)
    >>> found = assess(Inventory((low, tall)), Assessment(tp.HousnerImpact(), shaking, [6.0]))
    >>> ranked = anchoring(found, "number", level=6.0)
    >>> str(ranked["anchored_block"].values[0, 1])
    '6 shelves'
    """
    if not isinstance(assessment, xr.Dataset) or "overturned" not in assessment or "place" not in assessment.dims:
        raise TypeError(f"assessment must be a dataset as assess returns it, got {checks.kind(assessment)}")
    checks.plain("the assessment", assessment)
    members, units, text = _objective(assessment, objective, level is None)
    weights = weights_of(assessment, level)
    chosen = np.flatnonzero(members & ~assessment["anchored"].values.astype(bool))
    if chosen.size == 0:
        raise ValueError(f"nothing can be anchored that counts for {objective!r}: all of it is anchored already")
    cost = (assessment["anchoring_cost"].values * assessment["count"].values)[chosen]
    labels = assessment["block"].values[chosen]
    if per_cost and np.isnan(cost).any():
        raise ValueError(f"per_cost needs the anchoring_cost of every item, {labels[np.isnan(cost)][0]!r} has none")
    year = Year.of(assessment, weights)
    free = _free(assessment, objective, year, chosen, array)
    order, left = free.steps(cost if per_cost else None)
    precision = interval_options(assessment, year, replicates, seed)
    kept = {
        str(name): coordinate.variable
        for name, coordinate in assessment.coords.items()
        if coordinate.dims == ("model",)
    }
    for name, coordinate in assessment.coords.items():
        if "block" in coordinate.dims:
            kept[str(name)] = coordinate.isel(block=chosen).variable
    ranked = xr.Dataset(
        {
            **_savings(assessment, free, (units, text), cost, per_cost, precision),
            **_stepped(assessment, order, left, most_left(free, order), (units, text), labels, cost, precision),
        },
        coords={
            **kept,
            "step": xr.Variable("step", np.arange(chosen.size + 1), described("number of items anchored")),
        },
        attrs={
            **assessment.attrs,
            "title": "What anchoring saves",
            "objective": objective,
            "objective_text": text,
            "per_cost": int(per_cost),
            **({} if level is None else {"level": float(level)}),
        },
    )
    return ordered(ranked)


def interval_options(assessment: xr.Dataset, year: Year, replicates: int, seed: int) -> Precision:
    """Return the options of intervals of sums over the levels of an assessment, with its confidence."""
    precision = Precision.checked(0.5, float(assessment.attrs["confidence"]), replicates, seed)
    return replace(precision, strata=year.strata(assessment.sizes["motion"]))


def _free(assessment: xr.Dataset, objective: str, year: Year, chosen: Index, array: Allocator) -> FreeItems:
    """Return the chosen items with their contributions; anchored items do not overturn and do not count."""
    every = ItemChances(assessment, chosen)
    if objective == "loss":
        amounts = assessment["count"].values * assessment["value"].values
        at = {line: i for i, line in enumerate(chosen.tolist())}
        carried = carried_items(assessment).items()
        loads = [(at.get(i), at[below], float(amounts[i])) for i, below in carried if below in at]
        return AdditiveItems(every, amounts[chosen], year, array, loads)
    if objective == "number":
        return AdditiveItems(every, assessment["count"].values[chosen], year, array)
    return EventItems(every, year, array)


def _objective(assessment: xr.Dataset, objective: str, yearly: bool) -> tuple[Flags, str, str]:
    """Return the items that count for an objective (item,), its unit and its words."""
    words = [str(word) for word in assessment["consequence"].values] if "consequence" in assessment.coords else []
    amounts = [name for name in AMOUNTS if f"{name}_mean" in assessment]
    checks.choice("objective", objective, (*amounts, ANY, *words))
    everything = np.ones(assessment.sizes["block"], bool)
    if objective in AMOUNTS:
        attributes = assessment[objective].attrs
        units = per_year(attributes["units"]) if yearly else attributes["units"]
        text = f"{'expected annual' if yearly else 'mean of'} {attributes['long_name']}"
        return everything, units, text
    what = "at least one piece overturns"
    if objective != ANY:
        lists = [str(value).split(JOINT) for value in assessment["consequences"].values]
        everything = np.array([objective in words_of_item for words_of_item in lists])
        what = f"at least one piece with {objective!r} overturns"
    if yearly:
        return everything, PER_YEAR, f"annual rate at which {what}"
    return everything, DIMENSIONLESS, f"probability that {what}"


def weights_of(assessment: xr.Dataset, level: float | None) -> Array:
    """Return the weights of the levels (level,): annual rates, or 1 for one level and 0 for all others."""
    if level is None:
        if "level_weight" not in assessment:
            raise ValueError("anchoring needs a level, or an assessment with a hazard curve, got neither")
        return np.asarray(assessment["level_weight"].values)
    weights = np.zeros(assessment.sizes["level"])
    weights[level_index(assessment, level)] = 1.0
    return weights


def _savings(
    assessment: xr.Dataset,
    free: FreeItems,
    objective: tuple[str, str],
    cost: Array,
    per_cost: bool,
    precision: Precision,
) -> dict[str, xr.Variable]:
    """Return the variables on (model, item), for an objective of some unit and words."""
    units, text = objective
    money = assessment["anchoring_cost"].attrs["units"]
    percent, confidence = given_percent(precision.confidence), precision.confidence
    saved = free.savings
    total = free.whole.mean(axis=-1)
    mean, lower, upper = precision.of_means(saved, free.most)
    price = cost if per_cost else None
    alone = free.alone.mean(axis=-1)
    resampled = resampled_means(saved, precision.replicates, precision.seed, free.array, precision.strata)
    models, items, replicates = resampled.shape
    ranks = free.array(resampled.shape, np.int64)
    for k in range(models):
        # (ranks need all items of a replicate, intervals all replicates of an item)
        for where in slabs({"block": items, "sample": replicates}, ("sample",)):
            part = where.get("sample", slice(None))
            ranks[k, :, part] = _ranks(score_of(resampled[k, :, part].T, price), alone[k]).T
    ends = np.empty((2, models, items), np.int64)
    at = [round(q * (replicates - 1)) for q in (0.5 - 0.5 * confidence, 0.5 + 0.5 * confidence)]
    for where in slabs({"model": models, "block": items, "sample": replicates}, ("model", "block")):
        part_of = where.get("model", slice(None)), where.get("block", slice(None))
        ends[:, *part_of] = np.moveaxis(np.sort(ranks[part_of], axis=-1)[..., at], -1, 0)
    first, last = ends[0], ends[1]
    by = "saving over cost" if per_cost else "saving"
    share = np.divide(mean, total[:, None], out=np.full(mean.shape, np.nan), where=total[:, None] > 0.0)
    columns = {
        **{
            f"saving{end}": (values, units, of_end(end, f"saved by anchoring it alone of: {text}", confidence))
            for end, values in zip(ENDS, (mean, lower, upper), strict=True)
        },
        "saving_share": (share, DIMENSIONLESS, "saving over all that anchoring could save"),
        "alone": (alone, units, f"if it stood alone: {text}"),
        "rank": (_ranks(score_of(mean, price), alone), DIMENSIONLESS, f"rank by {by}, 1 is the first to anchor"),
        "rank_lower": (first, DIMENSIONLESS, f"first rank of the {percent} interval of the rank"),
        "rank_upper": (last, DIMENSIONLESS, f"last rank of the {percent} interval of the rank"),
    }
    with np.errstate(divide="ignore", invalid="ignore"):
        columns["saving_per_cost"] = (mean / cost, _over(units, money), "saving over cost")
    variables = {name: variable(("model", "block"), *column) for name, column in columns.items()}
    variables["cost"] = variable(("block",), cost, money, "cost of anchoring its pieces")
    return variables


def _stepped(
    assessment: xr.Dataset,
    order: Index,
    left: Array,
    most: Array,
    objective: tuple[str, str],
    labels: NDArray[np.object_],
    cost: Array,
    precision: Precision,
) -> dict[str, xr.Variable]:
    """Return the variables on (model, step), for an objective of some unit and words."""
    units, text = objective
    mean, lower, upper = precision.of_means(left, most)
    models = order.shape[0]
    names = np.concatenate([np.full((models, 1), "", dtype=object), labels[order]], axis=1)
    spent = np.concatenate([np.zeros((models, 1)), np.cumsum(cost[order], axis=1)], axis=1)
    money = assessment["anchoring_cost"].attrs["units"]
    columns = {
        "anchored_block": (names, DIMENSIONLESS, "item anchored at the step"),
        **{
            f"left{end}": (values, units, of_end(end, f"what is left: {text}", precision.confidence))
            for end, values in zip(ENDS, (mean, lower, upper), strict=True)
        },
        "total_cost": (spent, money, "cost of all that is anchored then"),
    }
    return {name: variable(("model", "step"), *column) for name, column in columns.items()}


def _ranks(score: Array, alone: Array) -> Index:
    """Return the rank of every item, 1 for the highest score."""
    return np.argsort(order_of(score, alone), axis=-1, kind="stable") + 1


def _over(units: str, money: str) -> str:
    """Return the unit of an objective divided by the cost."""
    if money == DIMENSIONLESS:
        return units
    if units == money:
        return DIMENSIONLESS
    if units == per_year(money):
        return PER_YEAR
    return f"{money}-1" if units == DIMENSIONLESS else f"{units} {money}-1"
