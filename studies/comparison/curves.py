"""Fragility curves and annual rates of two studies side by side: block by block, law by law, floor by floor."""

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from ...core.aliases import Array
from ...core.facts import Fact
from ...core.units import DIMENSIONLESS, ENDS, PER_YEAR
from ...fragility.analyses.sparse import weighted_rate_samples
from ...fragility.analyses.surface_results import POOLED
from ...fragility.curves.curve import UPLIFT
from ...fragility.hazard.poisson import probability_in
from ...fragility.risk.annual_rate import OF_RUNS
from ...fragility.risk.modelling import MODELLING
from ...fragility.runs.provenance import RUN
from ..buildings.recommendations import UNKNOWN, YEARS, Range
from ..file.analyses import FitTable
from ..file.hazard import hazard_table
from ..plan.estimates import Fit
from ..plan.form_free import modelling_factor
from ..plan.samples import flags_of_samples, pooled_curves
from ..tables.table import chance_in
from ..text.curve_notes import infinitive_of, verb_in
from ..text.error import StudyError
from ..text.precision import FITTED_RATE
from ..text.reached import BELOW, FLAT, open_ends
from ..text.words import NOT_REACHED, axis_of, display_unit, floor_name, level_name
from .ratios import CHANCE, HALF, Found, Line, Quantity, line_of, pair_text
from .sides import Side, floors_of, matched, matched_laws, matched_names, measure_of, same_measure, same_motions

DISPERSION, RATE = "dispersion", "rate"
"""Quantities of a curve besides its level of half and the chance of at least one fall in some years."""
MOST_RESAMPLED = 2000
"""Most curves of a side that are fitted again to replicates of the motions; ratios of more have no interval."""
Place = tuple[int, int, int]
"""Positions of a block, a law and a floor (0 if there are no floors)."""


class Curves(NamedTuple):
    """Curves of one side, replicates of parameters and rates on (block, model, floor, …), None unless refitted."""

    side: Side
    fit: xr.Dataset | None
    rates: Array | None

    def value(self, name: str, at: Place) -> Range:
        """Return a number of the results with its interval."""
        ends = [f"{name}{end}" for end in ENDS]
        held = self.side.results
        return Range(*(float(_spread(held[end]).values[at]) if end in held else math.nan for end in ends))

    def samples(self, name: str, at: Place) -> Array | None:
        """Return the replicates of a parameter of a curve or of its rate, None if there are none."""
        if name == RATE:
            return None if self.rates is None else self.rates[at]
        if self.fit is None or f"{name}_sample" not in self.fit:
            return None
        return np.asarray(_spread(self.fit[f"{name}_sample"], "replicate").values[at])

    def status(self, at: Place) -> str:
        """Return why there is no curve."""
        i, j, k = at
        status = self.side.results["status"].isel(block=i, model=j)
        return str((status.isel(floor=k) if "floor" in status.dims else status).item())


def compare_curves(
    a: Side, b: Side, laws: tuple[str, str] | None = None
) -> tuple[Found, tuple[Curves, Curves], list[tuple[Place, Place]]]:
    """Compare curves and rates of two studies, and return both studies' curves and their places in A and in B, too.

    Replicates draw the same motions for both studies if they share them.
    """
    blocks, models = matched_names(a, b, "block", "block"), matched_laws(a, b, laws)
    floors = matched(floors_of(a), floors_of(b))
    if not floors.pairs:
        raise StudyError("A and B have no floor in common")
    paired = same_motions(a, b)
    number = len(blocks.pairs) * len(models.pairs) * len(floors.pairs)
    surface = any(side.results.attrs.get("design") == POOLED for side in (a, b))
    again = number <= MOST_RESAMPLED and not surface
    options = fit_of(a)
    seeds = (options.seed, options.seed if paired else options.seed + 1)
    sides = []
    for k, (side, seed) in enumerate(zip((a, b), seeds, strict=True)):
        chosen = [sorted({pair[k] for pair in dim.pairs}) for dim in (blocks, models)]
        sides.append(_resampled(side, seed, options.replicates, chosen) if again else Curves(side, None, None))
    of_a, of_b = sides
    years = {float(side.results.attrs["years"]) for side in (a, b) if "years" in side.results.attrs}
    time = years.pop() if len(years) == 1 else YEARS
    places = [((i[0], j[0], k[0]), (i[1], j[1], k[1])) for i, k, j in product(blocks.pairs, floors.pairs, models.pairs)]
    lines = [line for place, other in places for line in _lines(of_a, of_b, place, other, time)]
    notes = [*_notes(a, b, of_a, of_b)]
    if not again:
        more = {"most": MOST_RESAMPLED}
        notes.append(Fact("comparison.surface") if surface else Fact("comparison.too_many", number, more=more))
    findings = Found({"model": models, "block": blocks, "floor": floors}, lines, _quantities(a, time), notes)
    return findings, (of_a, of_b), places


def _quantities(side: Side, years: float) -> list[Quantity]:
    """Return the compared quantities of curves; the probability, which decides, is first."""
    axis = axis_of(side.results)
    scale, unit = display_unit(axis)
    stored = str(axis.attrs.get("units", DIMENSIONLESS))
    state = str(side.results.attrs.get("state", "overturning"))
    verb = infinitive_of(verb_in(side.results))
    of = {"measure": level_name(side.results), "state": state, "verb": verb, "years": years}
    return [
        Quantity(CHANCE, "", 1.0, DIMENSIONLESS, of, chance=True),
        Quantity(HALF, unit, scale, stored, of),
        Quantity(DISPERSION, "", 1.0, DIMENSIONLESS, of),
        Quantity(RATE, "1/year", 1.0, PER_YEAR, of, shown=False),
    ]


def fit_of(side: Side) -> Fit:
    """Return the options of a study's fit, without the fractiles."""
    asked = side.study.get("fit")
    return Fit() if asked is None else replace(FitTable.model_validate(asked).build(), fractiles=())


def _resampled(side: Side, seed: int, replicates: int, chosen: list[list[int]]) -> Curves:
    """Fit the curves of some blocks and laws again with replicates; arrays keep the places of all."""
    fit = replace(fit_of(side), seed=seed, replicates=replicates)
    of_runs = {name for name, variable in side.results.data_vars.items() if RUN in variable.dims}
    runs = side.results.drop_vars([name for name in side.results.data_vars if name not in {*fit.outputs, *of_runs}])
    if "motion_floor" in runs.coords:  # (the curves took the name)
        runs = runs.drop_vars("floor").rename(motion_floor="floor")
    # (the new curves hold no modelling uncertainty yet)
    runs.attrs.pop(MODELLING, None)
    runs = runs.isel(block=chosen[0], model=chosen[1])
    if side.kind == "uncertainty":
        parts = [runs.isel(block=i) for i in range(len(chosen[0]))]
        of_blocks = [pooled_curves(part, fit, keep=True) for part in parts]
        curves = xr.concat(of_blocks, "block", combine_attrs="override", coords="minimal", compat="override")
        halves = [fit.half_level_samples(flags_of_samples(part), ("sample",)) for part in parts]
        half = xr.concat(halves, "block", coords="minimal", compat="override")
    else:
        curves, half = fit.curves(runs, True), fit.half_level_samples(runs)
    # (adaptive analyses have a level of half of their own, and its replicates are relative to the level of these runs)
    stored = side.results["half_level"].isel(block=chosen[0], model=chosen[1])
    curves = curves.assign(half_level_sample=half * (stored.variable / curves["half_level"].variable))
    every = {dim: side.results[dim].values for dim in ("block", "model")}
    curves = curves.assign_coords({dim: every[dim][places] for dim, places in zip(every, chosen, strict=True)})
    hazard = side.study.get("hazard")
    # a curve in a file next to the study is not known
    known = hazard is not None and "file" not in hazard and "rate" in side.results
    risk = hazard_table(hazard).risk(measure_of(side), Path()) if known else None
    rates = None
    if risk is not None:
        yearly = risk.rates(fit.modelled(curves), fit.confidence)
        rates = yearly.get("rate_sample")
        if rates is not None and "realisation" in rates.dims:
            rates = rates.weighted(yearly["weight"]).mean("realisation")
    if FITTED_RATE in side.results and (risk is not None or not fit.in_mean):
        # rates without a form of curve are from the runs' own weights, which need no hazard curve
        labels = {dim: curves[dim].values for dim in every}
        rates = weighted_rate_samples(runs.assign_coords(labels), replicates, seed, fit.state)
        rates = rates * (1.0 if risk is None else modelling_factor(curves, risk, fit))
    drawn = None if rates is None else np.asarray(_spread(rates.reindex(every), "replicate").values)
    return Curves(side, curves.reindex(every), drawn)


def _lines(a: Curves, b: Curves, at: Place, to: Place, years: float) -> list[Line]:
    """Return the lines of one curve: median, dispersion, rate and chance, as far as both sides have them."""
    sides = (a, at), (b, to)
    floors = floors_of(a.side)
    place = floor_name(floors[at[2]]) if floors != [""] else ""
    name = pair_text(*(str(curves.side.results["block"].values[where[0]]) for curves, where in sides))
    laws = str(a.side.results["model"].values[at[1]]), str(b.side.results["model"].values[to[1]])
    of = name, place, laws
    confidence = float(a.side.results.attrs["confidence"])
    of_levels = same_measure(a.side, b.side)
    of_curves = of_levels and not _of_uplift(a.side, b.side)
    lines = []
    for quantity in (*([HALF] if of_levels else []), *([DISPERSION] if of_curves else []), RATE):
        if not all(quantity in curves.side.results for curves, _ in sides):
            continue
        samples = [curves.samples(quantity, where) for curves, where in sides]
        values, words = zip(*(_reached(curves, quantity, where) for curves, where in sides), strict=True)
        if quantity != RATE:
            lines.append(line_of((quantity, *of), values, samples, words, confidence))
            continue
        runs = np.array([curves.value(OF_RUNS, where).value for curves, where in sides])
        lines.append(line_of((RATE, *of), values, samples, words, confidence, runs))
        chances = [chance_in(value, years) for value in values]
        of_samples = [None if rates is None else probability_in(rates, years) for rates in samples]
        lines.append(line_of((CHANCE, *of), chances, of_samples, words, confidence, probability_in(runs, years)))
    return lines


def _reached(curves: Curves, quantity: str, at: Place) -> tuple[Range, str]:
    """Return a number of a curve with open ends, or words instead of it beyond the levels of the runs."""
    value, results = curves.value(quantity, at), curves.side.results
    if quantity == HALF and value.value in (0.0, math.inf):
        return UNKNOWN, NOT_REACHED if value.value else BELOW
    if quantity == DISPERSION and value.value > FLAT:
        return UNKNOWN, f"above {FLAT:g}"
    words = "" if math.isfinite(value.value) else curves.status(at)
    if quantity == HALF:
        return Range(value.value, *open_ends(value.lower, value.upper, results)), words
    return value._replace(upper=math.inf) if quantity == DISPERSION and value.upper > FLAT else value, words


def _notes(a: Side, b: Side, of_a: Curves, of_b: Curves) -> Iterator[Fact]:
    """Yield the quantities without a comparison, or without an interval."""
    with_rates = [side.name for side in (a, b) if "rate" in side.results]
    if len(with_rates) == 1:
        yield Fact("comparison.no_rates", names=tuple(with_rates))
    in_files = [curves.side.name for curves in (of_a, of_b) if curves.fit is not None and curves.rates is None]
    if len(with_rates) == 2 and in_files:
        yield Fact("comparison.hazard_in_file", names=tuple(in_files))
    if not same_measure(a, b):
        measures = (str(axis_of(side.results).attrs.get("long_name", measure_of(side))) for side in (a, b))
        yield Fact("comparison.two_measures", names=tuple(measures))
    if _of_uplift(a, b):
        yield Fact("comparison.of_uplift", names=(UPLIFT,))
    if any("epistemic_rate" in side.results for side in (a, b)):
        yield Fact("comparison.first_branch")


def _of_uplift(a: Side, b: Side) -> bool:
    """Return True if dispersions of a side belong to the second factor of its curves."""
    return any("uplift_median" in side.results for side in (a, b))


def _spread(values: xr.DataArray, *last: str) -> xr.DataArray:
    """Return values on (block, model, floor, *last), with one floor if they have none."""
    whole = values if "floor" in values.dims else values.expand_dims("floor")
    return whole.transpose("block", "model", "floor", *last)
