"""The table of blocks under the law of the answer, for the first page and, shorter, for a terminal."""

import math

import numpy as np
import xarray as xr

from ...core.wording import about_percent, years_text
from ...fragility.fitting.states import ALL, NONE
from ...fragility.risk.modelling import LOWER, UPPER
from ..buildings.recommendations import Range
from ..text.block_order import RATE, shown
from ..text.curve_notes import NOTABLE, extrapolated_shares, infinitive_of, verb_in
from ..text.one_side import FORCED, falling_both_ways
from ..text.precision import FITTED_RATE
from ..text.reached import NO_LEVEL
from ..text.spread import MODEL_RANGE, OUTER, has_model_range, model_note, sample_range
from ..text.words import axis_of, block_title, by_place, display_unit, floor_cell, level_name, reference_law, roof_of
from .table import (
    Cells,
    Column,
    Marked,
    Table,
    Value,
    chance_in,
    chosen,
    dispersion_of,
    ends_of,
    footnote,
    intervals,
    range_of,
    tilted,
)

MOST, MOST_SHORT = 14, 8
"""Most blocks that a page shows all of; the first blocks of more, and most lines on a terminal."""
LEAD = "block", "floor", "level", "samples", "chance", "model_range"
SHORT = "block", "floor", "level", "others", "chance", "model_range"
NOT_FOUND = {ALL: "at every level", NONE: "never seen"}
"""Text instead of a level, by the status of the curve."""


def lead_blocks(results: xr.Dataset) -> Table:
    """Return the table of a page's first part."""
    every = results.sizes["block"] <= MOST
    return blocks(results, MOST if every else MOST_SHORT).only(*LEAD).noted(*([] if every else [footnote("export")]))


def short_blocks(results: xr.Dataset) -> Table:
    """Return the table of a terminal."""
    most = max(1, MOST_SHORT // (results.sizes["floor"] if "floor" in results["half_level"].dims else 1))
    law = results["model"].values[reference_law(results)[0]]
    return blocks(results, most).only(*SHORT).noted(f"Law: {law}.")


def blocks(results: xr.Dataset, most: int) -> Table:
    """Return the levels at which half fall under the law of the answer, and rates, of the first blocks."""
    yearly = "rate" in results
    selected = shown(results, RATE, most) if yearly else shown(results, most=most)
    at = reference_law(selected)[0]
    scale, unit = display_unit(axis_of(selected))
    highest = float(axis_of(selected).max()) / scale
    either, roof, ranged = (
        falling_both_ways(selected),
        roof_of(selected),
        "risk_probability" if yearly else "half_level",
    )
    years = years_text(float(results.attrs["years"])) if yearly else ""
    of_range = Column(
        "model_range", MODEL_RANGE, *(("chance", "") if yearly else ("two", unit)), note=model_note(selected)
    )
    rows: list[Cells] = []
    starred, extrapolated = list[float](), list[float]()
    for _, place in by_place(selected, selected["half_level"].dims):
        laws = selected.isel(place)
        curve = laws.isel(model=at)
        block, level = str(laws["block"].item()), _level(curve, scale, highest)
        others = np.delete(laws["half_level"].values / scale, at)
        others = others[np.isfinite(others)]
        row: Cells = {
            Column("block", "block"): block_title(block),
            Column("floor", "floor"): floor_cell(laws["floor"].item(), roof) if "floor" in place else None,
            Column("level", f"half {infinitive_of(verb_in(selected))} at {level_name(selected)}", "level2", unit): (
                Marked(level, "†") if block in either else level
            ),
            Column("dispersion", "β", "dispersion"): (
                dispersion_of(curve) if math.isfinite(float(curve["half_level"])) else None
            ),
            Column("others", "other laws", "three", unit): (
                ends_of(float(others.min()), float(others.max())) if others.size else None
            ),
        }
        if "sample_median" in selected:
            of_samples = Column("samples", "90 % range over its uncertain properties", "level2", unit)
            row[of_samples] = ends_of(*(end / scale for end in sample_range(curve)))
        if yearly:
            far = float(curve.get("rate_share_above", 0.0)) if np.isfinite(float(curve["rate"])) else 0.0
            shares = [float(share) for share in extrapolated_shares(curve).values() if float(share) > NOTABLE]
            starred += [far] if far > NOTABLE else []
            extrapolated += shares
            marks = " ".join([*(["*"] if far > NOTABLE else []), *(["‡"] if shares else [])])
            chance = block_chance(curve, laws, float(results.attrs["years"]))
            row[Column("chance", f"chance in {years}", "chance")] = Marked(chance, marks) if marks else chance
        if has_model_range(selected, ranged):
            row[of_range] = _model_range(curve, laws, ranged, scale, float(results.attrs.get("years", 0.0)))
        rows.append(row)
    notes = [footnote("chances_over_branches")] if "epistemic_rate" in selected else []
    for mark, shares_of, where in (("*", starred, "beyond_hazard"), ("‡", extrapolated, "beyond_runs")):
        ends = dict.fromkeys(about_percent(share) for share in (min(shares_of), max(shares_of))) if shares_of else {}
        notes += [footnote(where, mark, " to ".join(ends))] if ends else []
    notes += [footnote("both_ways")] if any(str(block) in either for block in selected["block"].values) else []
    notes += [footnote("forced", selected.attrs["form"])] if FORCED in selected.attrs else []
    notes += [footnote("form_free")] if FITTED_RATE in selected else []
    return Table.of("Blocks", rows, intervals(selected), *notes, tilted(selected), chosen(selected))


def _level(curve: xr.Dataset, scale: float, highest: float) -> Value:
    """Return the level at which half of the motions reach the state; in words if there is none."""
    level, status = range_of(curve, "half_level", scale), str(curve["status"].item())
    if math.isnan(level.value):
        return NOT_FOUND.get(status, NO_LEVEL.get(status, status))
    return Range(math.inf, highest, math.inf) if level.value == math.inf else level


def block_chance(curve: xr.Dataset, laws: xr.Dataset, years: float) -> Range:
    """Return the probability in `years` years, over all branches if there are any."""
    if "epistemic_rate" in laws:
        ends = laws["epistemic_rate_fractile"].sel(epistemic_fractile=list(OUTER)).values.tolist()
        rates = (float(laws["epistemic_rate"]), *ends)
        return chance_in(rates, years)
    chance = range_of(curve, "risk_probability")
    # (a bound without a rate: every run overturned)
    return chance._replace(upper=math.nan) if math.isnan(float(curve["rate"])) else chance


def _model_range(curve: xr.Dataset, laws: xr.Dataset, name: str, scale: float, years: float) -> Range | None:
    """Return the range of the probability in `years` years, or of the level, under one factor on all capacities."""
    if name == "risk_probability" and "epistemic_rate" in laws:
        return chance_in((math.nan, *(float(laws[f"epistemic_rate{end}"]) for end in (LOWER, UPPER))), years)
    scale = scale if name == "half_level" else 1.0
    low, high = (float(curve[f"{name}{end}"]) / scale for end in (LOWER, UPPER))
    return ends_of(low, high) if high > 0.0 else None
