"""Coverage of the intervals of annual rates, of their ratios, and of means over motions."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np
import xarray as xr

from ...core.aliases import Array
from ...core.streams import stream
from ...fragility import HazardCurve, annual_rate, fit_fragility, size_for_rate
from ...fragility.curves.means import mean_interval, resampled_means
from ...fragility.fitting.fit import CurveOptions, half_level_samples
from ...fragility.risk.ratios import ratio_of
from ..sequential.truths import MEDIAN, Truth
from .drawn_studies import LEVELS, LOGNORMAL, SHAPES, SKEWED_LEFT, Row, cloud, ida, row_of, stripes

CONFIDENCE = 0.95
NORMAL = 1.959964
SLOPES = (1.5, 2.5, 4.0, 5.0)
MOTIONS = (10, 20, 40, 80, 400)
TABULATED = "curved hazard"
DESIGNS: dict[str, Callable[[Truth, int, int, int], xr.Dataset]] = {
    "20 common levels": ida,
    "5 stripes": stripes,
    "cloud": cloud,
}


def hazards() -> dict[str, HazardCurve]:
    """Return power laws, and a tabulated curve whose slope grows from 1 at low levels to 4 at high ones."""
    curves = {f"slope {slope:g}": HazardCurve.power_law(1e-3, slope, "pga") for slope in SLOPES}
    x = np.geomspace(0.02, 30.0, 25)
    u = np.log(x / MEDIAN)
    rates = 1e-3 * np.exp(np.minimum.accumulate(-2.2 * u - 0.25 * u**2))
    return curves | {TABULATED: HazardCurve(x.tolist(), rates.tolist(), "pga")}


def rows(full: bool) -> Iterator[Row]:
    """Yield the rows of the table; `full`: of more correlations and studies."""
    studies = 1000 if full else 200
    correlations = (0.3, 0.5, 1.0) if full else (0.5, 1.0)
    for motions in MOTIONS:
        for shape in SHAPES:
            for correlation in correlations:
                yield from of_design("20 common levels", replace(shape, correlation=correlation), motions, studies)
            yield from of_design("5 stripes", shape, motions, studies)
            yield from of_design("20 common levels", shape, motions, studies, form="isotonic")
        yield from _of_means(motions, studies)
        yield from _of_ratios(motions, studies)
        yield from _of_sizes(motions, studies)
    for motions in MOTIONS[2:]:
        for shape in SHAPES:
            yield from of_design("cloud", shape, motions, studies)


def of_design(design: str, truth: Truth, motions: int, studies: int, form: str | None = None) -> Iterator[Row]:
    """Yield the rows of annual rates under all hazard curves for studies of one design."""
    drawn = DESIGNS[design](truth, studies, motions, 1)
    of = f"{truth.name}, within motions {truth.correlation:g}" if DESIGNS[design] is ida else truth.name
    what = f"annual rate, {design}" if form is None else f"annual rate of {form} curves, {design}"
    yield from of_runs(drawn, replace(truth, name=of), motions, what, form, 1 if design == "cloud" else 50)


def of_runs(
    drawn: xr.Dataset, truth: Truth, motions: int, what: str, form: str | None = None, together: int = 50
) -> Iterator[Row]:
    """Yield the rows of annual rates under all hazard curves for drawn studies.

    together: studies fitted together share bootstrap draws; each study of a cloud has its own intensities.
    """
    fitted = [
        fit_fragility(drawn.isel(study=slice(first, first + together)), form=form, keep_replicates=True, seed=first)
        for first in range(0, drawn.sizes["study"], together)
    ]
    for name, hazard in hazards().items():
        if truth.probability is SKEWED_LEFT.probability and name in ("slope 4", "slope 5"):
            continue  # (its rate has no bound)
        annual = [annual_rate(curves, hazard, outside="most") for curves in fitted]
        rate, lower, upper = (
            np.concatenate([rates[f"rate{end}"].values for rates in annual]) for end in ("", "_lower", "_upper")
        )
        length = _length(rate, lower, upper)
        yield row_of(f"{what}, {name}", truth.name, motions, (lower, upper), true_rate(truth, hazard), length)


def true_rate(truth: Truth, hazard: HazardCurve) -> float:
    """Return the annual rate of a truth, 1/year."""
    x = np.linspace(math.log(MEDIAN) - 8.0, math.log(MEDIAN) + 6.0, 20_001)
    events = hazard.rate_at(np.exp(x))
    seen = truth.probability(x)
    return float(-np.sum(0.5 * (seen[1:] + seen[:-1]) * np.diff(events)) + events[-1])


def _length(values: Array, lower: Array, upper: Array) -> float:
    """Return the mean length of intervals of logarithms over a normal interval with the deviation of the values."""
    with np.errstate(divide="ignore"):  # (isotonic curves may have rates of 0)
        logs, lengths = np.log(values), np.log(upper) - np.log(lower)
    return float(np.nanmean(np.where(np.isfinite(lengths), lengths, np.nan)) / (2.0 * NORMAL * np.nanstd(logs)))


def contributions(motions: int, studies: int) -> Iterator[tuple[str, Array, float]]:
    """Yield names, contributions of motions (study, motion) to a sum, and its true mean."""
    random = stream(motions, 5)
    for spread in (1.0, 1.5):
        values = np.exp(spread * random.standard_normal((studies, motions)))
        yield f"lognormal, dispersion {spread:g}", values, math.exp(0.5 * spread**2)
    fell = random.random((studies, motions)) < 0.2
    yield "one in five", np.where(fell, np.exp(random.standard_normal(fell.shape)), 0.0), 0.2 * math.exp(0.5)
    yield "shares", random.beta(0.3, 0.7, (studies, motions)), 0.3
    weights = -np.diff(hazards()[TABULATED].rate_at(LEVELS), append=0.0)
    for shape in SHAPES:
        truth = replace(shape, correlation=0.5)
        fallen = ida(truth, studies, motions, motions)["overturned"].transpose("study", "motion", "level").values
        true = float(truth.probability(np.log(LEVELS)) @ weights)
        yield f"annual falls, {shape.name}", np.asarray(fallen @ weights, dtype=np.float64), true


def _of_means(motions: int, studies: int) -> Iterator[Row]:
    for name, drawn, true in contributions(motions, studies):
        values = drawn[np.ptp(drawn, axis=1) > 0.0]
        lower, upper = mean_interval(values, CONFIDENCE)[:2]
        length = float(np.mean(upper - lower) / (2.0 * NORMAL * values.mean(axis=1).std()))
        yield row_of("total of an inventory", name, motions, (lower, upper), true, length)
        # (anchoring saves the falls of half as many pieces, and may cause others)
        saved = values - 0.5 * values[::-1]
        ends = mean_interval(saved, CONFIDENCE, signed=True)[:2]
        yield row_of("saving, which may be negative", name, motions, ends, 0.5 * true)


def _stronger(truth: Truth, x: Array) -> Array:
    middle = math.log(MEDIAN)
    return truth.probability(middle + (x - middle - 0.3) / 1.2)


def _ratios(values: Array, samples: Array, runs: Array | None = None) -> tuple[tuple[Array, Array], float]:
    """Return the ends of the intervals of ratios of two blocks (block, study), study by study, and their length."""
    by_runs = np.full(values.shape, np.nan) if runs is None else runs
    intervals = [
        ratio_of(values[0, i], values[1, i], samples[0, i], samples[1, i], CONFIDENCE, by_runs[:, i])
        for i in range(values.shape[1])
    ]
    ratio, lower, upper = np.array(intervals).T
    return (lower, upper), _length(ratio, lower, upper)


def _of_ratios(motions: int, studies: int) -> Iterator[Row]:
    """Yield the rows of ratios of annual rates of two blocks under the same motions, of other medians and scatter."""
    hazard = hazards()[TABULATED]
    for shape in SHAPES:
        weak = replace(shape, correlation=0.5)
        strong = replace(weak, probability=partial(_stronger, shape))
        # (one seed draws the same motions)
        drawn = xr.concat([ida(truth, studies, motions, 1) for truth in (weak, strong)], "block")
        curves = fit_fragility(drawn, keep_replicates=True).transpose("block", "study", ...)
        rates = annual_rate(curves, hazard).transpose("block", "study", ...)
        halves = half_level_samples(drawn, CurveOptions())["half_level_sample"].transpose("block", "study", ...)
        ends, length = _ratios(curves["half_level"].values, halves.values)
        yield row_of("ratio of half levels", shape.name, motions, ends, math.exp(0.3), length)
        if shape is LOGNORMAL:
            ends, length = _ratios(curves["median"].values, curves["median_sample"].values)
            yield row_of("ratio of fitted medians", shape.name, motions, ends, math.exp(0.3), length)
        ends, length = _ratios(*(rates[name].values for name in ("rate", "rate_sample", "rate_of_runs")))
        true = true_rate(strong, hazard) / true_rate(weak, hazard)
        yield row_of(f"ratio of annual rates, {TABULATED}", shape.name, motions, ends, true, length)
        # totals of falls at the levels, as inventories are compared
        weights = -np.diff(hazard.rate_at(LEVELS), append=0.0)
        falls = drawn["overturned"].transpose("block", "study", "motion", "level").values @ weights
        ends, length = _ratios(falls.mean(axis=-1), resampled_means(falls))
        a, b = (float(truth.probability(np.log(LEVELS)) @ weights) for truth in (weak, strong))
        yield row_of("ratio of totals of inventories", shape.name, motions, ends, b / a, length)


def _slenderer(truth: Truth, alpha: float, x: Array) -> Array:
    return truth.probability(x - math.log(alpha / 0.2))


def _of_sizes(motions: int, studies: int) -> Iterator[Row]:
    """Yield the rows of the slenderness that meets the rate of its middle value; medians grow with it."""
    hazard, alphas = hazards()[TABULATED], np.linspace(0.1, 0.3, 5)
    for shape in SHAPES:
        family = [replace(shape, correlation=0.5, probability=partial(_slenderer, shape, alpha)) for alpha in alphas]
        drawn = xr.concat([ida(truth, studies, motions, 1) for truth in family], "block")
        named = drawn.assign_coords(alpha=("block", alphas), block=[f"{alpha:g}" for alpha in alphas])
        rates = annual_rate(fit_fragility(named, keep_replicates=True), hazard)
        sizes = size_for_rate(rates, rate=true_rate(family[2], hazard))
        ends = sizes["alpha_lower"].values, sizes["alpha_upper"].values
        yield row_of(f"size that meets a rate, {TABULATED}", shape.name, motions, ends, 0.2)
