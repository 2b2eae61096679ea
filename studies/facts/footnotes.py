"""Footnotes of a page: contents and omissions of its ranges, and its law."""

from collections.abc import Iterator

import numpy as np
import xarray as xr

from ...core.facts import Fact
from ...fragility.risk.modelling import LOWER, RANGE, UPPER, capacity_factors
from ...fragility.runs.provenance import number_of_motions
from ..buildings.assessment import BUILDING
from ..buildings.recommendations import YEARS
from ..tables.table import chance_in, range_of
from ..text.block_order import HALF, RATE, places
from ..text.spread import has_model_range
from ..text.words import axis_of, display_unit, reference_law
from .coverage import coverage_in
from .crossed import case_name
from .law_choice import choice_of_law
from .notes import notes_of


def footnotes(results: xr.Dataset) -> Iterator[Fact]:
    """Yield the facts that a reader of the first screen needs about its numbers."""
    motions = number_of_motions(results) if "motion" in results.dims or "motions_run" in results else 0
    if "confidence" in results.attrs:
        # (on several floors each floor's motion is one)
        number = motions // max(1, results.sizes.get("floor", 1))
        more = {"motions": number, "branches": results.sizes.get("branch", 0)}
        if "value" in results.dims:  # (levels by value have no ranges, figures have bands)
            more["bands"] = True
        yield Fact("precision.interval_meaning", float(results.attrs["confidence"]), more=more)
    yield from coverage_in(results)
    yield from _model_range(results)
    beta = float(results.attrs.get("modelling_dispersion", 0.0))
    if beta:
        yearly = "place" not in results.dims or "annual_number" in results
        more = {"yearly": yearly, "spread": str(results.attrs.get("modelling")) == "fractiles"}
        more["common"] = "place" in results.dims and not more["spread"]
        yield Fact("rate.modelling_included", beta, more=more)
    yield from (note for note in notes_of(results) if note.what == "validity.tests")
    # (sensitivity studies compare laws with the reference themselves)
    choice = None if "value" in results.dims else choice_of_law(results)
    if choice is not None:
        yield choice


def _model_range(results: xr.Dataset) -> Iterator[Fact]:
    """Yield the range of the headline's number if all capacities are wrong by the same factor."""
    if RANGE not in results.attrs:
        return
    beta, at = float(results.attrs[RANGE]), reference_law(results)[0]
    more = {"beta": beta, "factors": capacity_factors(beta), "chance": True, "at_level": False}
    of_law, unit, scale, names = results.isel(model=at), "", 1.0, tuple[str, ...]()
    if "place" in results.dims:
        of_law = of_law.sel(place=BUILDING)
        name = "any_rate" if "any_rate" in of_law else "any_probability"
        more["at_level"] = name != "any_rate"
        of_law = of_law.sel(level=float(results.attrs["at_level"])) if more["at_level"] else of_law
    else:
        rated = "rate" in of_law and bool(np.isfinite(of_law["rate"]).any())
        name, by = ("risk_probability", RATE) if rated else (HALF, HALF)
        more["chance"] = rated
        first = np.argwhere(places(results, by).values == 0)[0]
        dims = of_law[name].transpose("block", ...).dims
        of_law = of_law.isel({str(dim): int(i) for dim, i in zip(dims, first, strict=True)})
        names = (case_name(of_law[[name]]),)
        scale, unit = (1.0, "") if rated else display_unit(axis_of(results))
    if f"{name}{LOWER}" not in of_law:
        return
    ends = range_of(of_law, name, scale, ("", LOWER, UPPER))
    ends = chance_in(ends, YEARS) if name == "any_rate" else ends
    known = has_model_range(of_law, name) and ends.upper > 0.0
    low, high = ends[1:] if known else (np.nan, np.nan)
    yield Fact("rate.model_range", np.nan, low, high, unit, names, more=more)
