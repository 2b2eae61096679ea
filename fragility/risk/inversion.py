"""Inversion of rates of overturning: the slenderness or size of a block that meets a target."""

import math
from collections.abc import Sequence

import numpy as np
import xarray as xr

from ...core import checks
from ...core.doubts import Doubt, warn
from ...core.elementary import Array, Index, log
from ...core.parameters import CHANCE, CONFIDENCE, USUAL_CONFIDENCE, USUAL_YEARS
from ...core.units import DIMENSIONLESS, described, of_end, provenance
from ..fitting.bootstrap import percentile_interval
from ..fitting.states import CROSSED, NO_RATE, OK, TOO_HIGH, TOO_LOW
from ..hazard.poisson import IMPOSSIBLY_OFTEN, rate_from_probability
from ..numerics.slabs import spread
from ..runs.provenance import configuration_of, coordinates_on

SIZES = ("alpha", "R", "width", "height", "cm_height")
"""Coordinates of blocks along which rates can be solved."""


def size_for_rate(
    rates: xr.Dataset,
    along: str = "alpha",
    *,
    rate: float | None = None,
    probability: float | None = None,
    years: float = USUAL_YEARS,
    confidence: float = USUAL_CONFIDENCE,
) -> xr.Dataset:
    """Find the slenderness or size at which a family of blocks meets a target, from the rates of several blocks.

    Parameters
    ----------
    rates : xarray.Dataset
        As `annual_rate` returns it, of at least two blocks that differ in `along`. They are a family with one free
        size, such as several slendernesses of one R, or widths of one height.
    along : {"alpha", "R", "width", "height", "cm_height"}
        The coordinate of the blocks to solve for.
    rate, probability : float
        The target, either an annual rate (1/year, > 0), or a probability in `years`, above 0 and below 1.
    years : float
        Time of the probability, years.
    confidence : float
        Of the interval, between 0 and 1.

    Returns
    -------
    xarray.Dataset
        On the other dimensions, such as model: the variable named as `along`, at which the target is met, and status.
        The status is ``ok``, or the reason for NaN: ``all above the target``, ``all below the target``, ``crosses the
        target more than once`` or ``no rate``. With `rate_sample`, the ends of its interval too (such as alpha_lower,
        alpha_upper): quantiles over the samples. A sample that does not meet the target counts as infinitely large or
        small. An end of the interval may therefore be infinite: it lies beyond the given blocks. Samples in which a
        block has no rate are left out (samples_used).

    Notes
    -----
    ln(rate) is linear between neighbouring blocks, without extrapolation.  A sample that crosses the target more than
    once counts with the crossing on its conservative side.

    Examples
    --------
    >>> import xarray as xr
    >>> rates = xr.Dataset({"rate": ("block", [1e-2, 1e-4])}, {"alpha": ("block", [0.1, 0.3], {"units": "rad"})})
    >>> round(float(size_for_rate(rates, rate=1e-3)["alpha"]), 6)
    0.2
    """
    goal = target_rate(rate, probability, years)
    level = CONFIDENCE.number("confidence", confidence)
    checks.choice("along", along, SIZES)
    if not isinstance(rates, xr.Dataset) or "rate" not in rates or "block" not in rates["rate"].dims:
        raise TypeError("rates must be a dataset with `rate` on block, as annual_rate returns it")
    checks.plain("rates", rates)
    if along not in rates.coords or rates[along].dims != ("block",):
        raise ValueError(f"rates must have the coordinate {along!r} on block")
    order = np.argsort(rates[along].values, kind="stable")
    sizes = checks.finite_array(along, rates[along].values[order])
    if sizes.size < 2:
        raise ValueError(f"blocks must be at least two that differ in {along}, got {sizes.size}")
    check_family(along, sizes, [str(label) for label in rates["block"].values[order]])
    dims = tuple(str(dim) for dim in rates["rate"].dims if dim != "block")
    central = rates["rate"].transpose(*dims, "block").values[..., order]
    times, outermost = _crossings(sizes, central, goal)
    status = np.select(
        [np.isnan(central).any(axis=-1), times > 1, times == 1, (central > goal).all(axis=-1)],
        [NO_RATE, CROSSED, OK, TOO_HIGH],
        TOO_LOW,
    ).astype(object)
    values = np.where(status == OK, outermost, np.nan)
    text = str(rates[along].attrs.get("long_name", along))
    attributes = {"units": rates[along].attrs.get("units", DIMENSIONLESS)}
    goal_text = f"for a rate of overturning of {goal:.4g} per year"
    variables = {
        along: (dims, values, {**attributes, "long_name": f"{text} {goal_text}"}),
        "status": (dims, status, described("ok, or why there is no size")),
    }
    if "rate_sample" in rates:
        rows = [str(dim) for dim in rates["rate_sample"].dims if dim not in (*dims, "block")]
        samples = rates["rate_sample"].transpose(*dims, *rows, "block").values[..., order]
        sizes_of = _crossings(sizes, samples, goal)[1].reshape(*central.shape[:-1], -1)
        ends = percentile_interval(sizes_of, level, _weights(rates, rows))
        used = described("samples with a rate of every block")
        variables["samples_used"] = (dims, ends[2], used)
        for name, end in zip(("lower", "upper"), ends[:2], strict=True):
            long_name = of_end(name, f"{text} {goal_text}", level)
            variables[f"{along}_{name}"] = (dims, end, {**attributes, "long_name": long_name})
    configuration = {"target_rate": goal, "along": along, "blocks": sizes.tolist(), "rates": configuration_of(rates)}
    return xr.Dataset(
        variables,
        coords={name: coordinate for name, coordinate in coordinates_on(rates, dims).items() if name != along},
        attrs={"title": f"Blocks that meet a rate of overturning: {along}", **provenance(configuration)},
    )


def check_family(along: str, sizes: Sequence[float] | Array, labels: Sequence[str]) -> None:
    """Raise ValueError if two blocks have the same size, which must distinguish all blocks of a family."""
    seen: dict[float, str] = {}
    for size, label in zip(map(float, sizes), labels, strict=True):
        if size in seen:
            raise ValueError(
                f"blocks must all differ in {along}, got {size:g} of both {seen[size]!r} and {label!r}: a family with "
                "one free size is needed"
            )
        seen[size] = label


def target_rate(rate: float | None, probability: float | None, years: float) -> float:
    """Return the target as an annual rate; ValueError if neither or both are given, or the target is out of range."""
    if (rate is None) == (probability is None):
        given = "neither" if rate is None else "both"
        raise ValueError(f"a target is either a rate or a probability in years, got {given}")
    if rate is not None:
        goal = checks.number("rate", rate, above=0.0, unit="1/year")
        if goal > IMPOSSIBLY_OFTEN:
            warn([Doubt.of("rate_of_years", rate=goal)])
        return goal
    return float(rate_from_probability(CHANCE.number("probability", probability), years))


def _crossings(sizes: Array, rates: Array, goal: float) -> tuple[Index, Array]:
    """Return the number of crossings of the target by rates (…, size), and the outermost on the conservative side.

    Crossings are of ln(rate), linear between sizes; without one, the end beyond which it would lie.
    """
    above = rates > goal
    flips = above[..., 1:] != above[..., :-1]
    count = flips.sum(axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        logs = log(rates) - math.log(goal)
        # a rate of 0 next to one above: the larger size is safe
        along = np.where(np.isneginf(logs[..., 1:]), 1.0, logs[..., :-1] / (logs[..., :-1] - logs[..., 1:]))
        along = np.where(np.isneginf(logs[..., :-1]), 0.0, along)
    points = sizes[:-1] + along * np.diff(sizes)
    # the conservative crossing is the last one for rates that fall with size, the first one for rates that rise
    falls = logs[..., 0] >= logs[..., -1]
    last = flips.shape[-1] - 1 - np.argmax(flips[..., ::-1], axis=-1)
    at = np.where(falls, last, np.argmax(flips, axis=-1))
    met = np.take_along_axis(points, at[..., None], axis=-1)[..., 0]
    never = np.where(above[..., 0] == falls, np.inf, -np.inf)
    sizes_met = np.where(count > 0, met, never)
    return count, np.where(np.isnan(rates).any(axis=-1), np.nan, sizes_met)


def _weights(rates: xr.Dataset, rows: list[str]) -> Array | None:
    """Return the weights of the samples, with the dimensions `rows` flattened; None if all weights are equal."""
    if "realisation" not in rows or "weight" not in rates.coords:
        return None
    return spread(rates["weight"], {dim: rates.sizes[dim] for dim in rows}).reshape(-1)
