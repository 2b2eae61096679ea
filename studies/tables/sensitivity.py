"""Tables of sensitivity studies: laws down, values of delta or e across."""

import math

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...core.aliases import Array
from ...fragility.runs.provenance import blocks_of
from ...models import Block
from ..plan.estimates import middle_level
from ..text.block_order import shown
from ..text.reached import within_levels
from ..text.words import LAW_NAMES, axis_of, block_title, display_unit, level_name, level_text
from .table import Cells, Column, Marked, Row, Table, chosen, footnote

GREEK = {"delta": "δ", "e": "e"}
SLIPS, SQUAT, ABOVE = "†", "‡", "*"
"""Marks of values of e: not possible with the friction there is, for so squat a block; and possible, but above e_R."""
NO_CURVE = "no curve can be fitted"
MOST_SHORT = 8
"""Most rows on a terminal."""
MOST_SAID = 3
"""Most blocks that have a sentence; the table has all of them."""


def reference_of(results: xr.Dataset) -> str:
    """The name of the comparison with the study's reference."""
    return str(results["comparison"].values[0])


def reference_name(results: xr.Dataset) -> str:
    """The reference that values are compared with, in words."""
    symbol = GREEK[str(results.attrs["parameter"])]
    return {
        "rigid": "the rigid block",
        "own": "the block's own e_R",
        "given": f"{symbol} = {results.attrs['reference']}",
        "previous": "the value before",
    }[reference_of(results)]


def level_between(results: xr.Dataset) -> int:
    """The index of the level at which the rigid block overturns under as near to half of the motions as possible."""
    rigid = results["probability"] - results["excess"].sel(comparison="rigid")
    return middle_level(rigid.where(np.isfinite(rigid)))


def level_at(results: xr.Dataset, at: int) -> str:
    """Return one of the levels with its unit."""
    return level_text(float(results["level"][at]), results["level"])


def law_of_answer(results: xr.Dataset) -> int:
    """Return the position of the law that the first page is about: the nearest to a rigid block with impacts."""
    laws = [str(value) for value in results["law"].values]
    rigid = [name for name in ("housner", "energy-consistent") if name in laws]
    return laws.index(rigid[0]) if rigid else 0


def law_name(results: xr.Dataset, at: int) -> str:
    """Return the name of a law in words: without parameters, and with its rest if two laws differ in it alone."""
    laws = [str(value) for value in results["law"].values]
    name = LAW_NAMES.get(laws[at], laws[at])
    twice = laws.count(laws[at]) > 1 and "rest" in results.coords
    return f"{name} (rigid at rest)" if twice and str(results["rest"].values[at]) == "rigid" else name


def block_levels(results: xr.Dataset) -> Table:
    """Return the levels at which half of the motions overturn each block, by the value, under the law of the answer."""
    at = law_of_answer(results)
    scale, unit = display_unit(axis_of(results))
    medians = results["half_level"].isel(model=at).transpose("block", "value").values / scale
    marks, own_e = marks_of(results), own_restitution(results)
    names, *values = _values(results, "level2")
    rows: list[Cells] = []
    above = False
    for i, block in enumerate(results["block"].values):
        row: Cells = {names: block_title(str(block))}
        if own_e is not None:
            row[Column("own", "its e_R", "thousandths")] = "none" if math.isnan(own_e[i]) else float(own_e[i])
        columns_of = zip(values, results["value"].values.tolist(), medians[i].tolist(), marks[i].tolist(), strict=True)
        for column, value, median, mark in columns_of:
            higher = own_e is not None and value > own_e[i] and not mark
            above |= higher
            row[column] = mark or (Marked(median, ABOVE) if higher else median)
        rows.append(row)
    notes = (
        footnote("levels_under_law", f"{level_name(results)}{f', {unit}' if unit else ''}", law_name(results, at)),
        footnote(str(results.attrs["parameter"])),
        *_legend(results, marks),
        footnote("above_own", ABOVE) if above else "",
    )
    return Table.of("Levels for half of the motions", rows, *notes)


def _values(results: xr.Dataset, format_: str) -> list[Column]:
    """Return the columns of the values that are varied, after the column of names."""
    symbol = GREEK[str(results.attrs["parameter"])]
    return [
        Column("name", f"{symbol} ="),
        *(Column(f"{value:g}", f"{value:g}", format_) for value in results["value"].values.tolist()),
    ]


def own_restitution(results: xr.Dataset) -> Array | None:
    """Return each block's own e_R (block,), NaN for a block too squat for one; None if e is not varied."""
    if str(results.attrs["parameter"]) != "e":
        return None
    return np.array([_restitution(block) for block in blocks_of(results)])


def _restitution(block: Block) -> float:
    try:
        return block.restitution
    except ValueError:  # (an impact at its edge stops so squat a block)
        return math.nan


def marks_of(results: xr.Dataset) -> NDArray[np.str_]:
    """Return marks of impossible values (block, value): e needs more friction, or the block is too squat."""
    marks = np.full((results.sizes["block"], results.sizes["value"]), "", dtype="<U1")
    restitution = own_restitution(results)
    if restitution is None:
        return marks
    marks[~results["in_use"].transpose("block", "value").values.astype(bool)] = SLIPS
    marks[np.isnan(restitution)] = SQUAT
    return marks


def _legend(results: xr.Dataset, marks: NDArray[np.str_]) -> list[str]:
    """Return the meanings of the marks that occur."""
    limit = f"{float(results.attrs.get('friction', 1.0)):g}"
    names = {SLIPS: "slips_at_impact", SQUAT: "too_squat"}
    return [footnote(name, mark, limit) for mark, name in names.items() if (marks == mark).any()]


def swings_of(results: xr.Dataset, model: int) -> list[tuple[str, float, float, float, float]]:
    """Return each block's values of its lowest and highest median, in order, and these (SI), as in `block_levels`."""
    results = within_levels(results)
    every = results["half_level"].isel(model=model).transpose("block", "value").values
    values, marks = results["value"].values, marks_of(results)
    swings = []
    for i, block in enumerate(results["block"].values):
        known = np.flatnonzero(np.isfinite(every[i]) & (every[i] > 0.0) & (marks[i] == ""))
        if known.size > 1:
            medians_of = every[i][known]
            first, last = sorted((int(known[medians_of.argmin()]), int(known[medians_of.argmax()])))
            if first == last:  # (all medians are the same)
                first, last = int(known[0]), int(known[-1])
            ends = [(float(values[k]), float(every[i][k])) for k in (first, last)]
            swings.append((str(block), ends[0][0], ends[1][0], ends[0][1], ends[1][1]))
    return swings


def laws_apart(results: xr.Dataset) -> list[tuple[str, float]]:
    """Return the laws with the geometric mean of their medians over the rigid block's, the nearest to 1 first."""
    results = within_levels(results)
    ratio = results["median_ratio"].sel(comparison="rigid").transpose("model", "block", "value").values
    ratios = []
    for k, ratios_of_law in enumerate(ratio):
        known = (
            results["in_use"].values & (marks_of(results) == "") & np.isfinite(ratios_of_law) & (ratios_of_law > 0.0)
        )
        if known.any():
            ratios.append((law_name(results, k), float(np.exp(np.log(ratios_of_law[known]).mean()))))
    return sorted(ratios, key=lambda pair: abs(np.log(pair[1])))


def median_ratios(results: xr.Dataset) -> Table:
    """Return the medians divided by the reference medians, the laws of each block together."""
    selected = shown(results)
    ratio, marks = selected["median_ratio"].sel(comparison=reference_of(selected)), marks_of(selected)
    names = [f"{value:g}" for value in selected["value"].values.tolist()]
    rows: list[Row | str] = []
    for i, block in enumerate(selected["block"].values):
        rows.append(block_title(str(block)))
        for model in selected["model"].values:
            values = ratio.sel(block=block, model=model).values.tolist()
            cells = [mark or value for value, mark in zip(values, marks[i].tolist(), strict=True)]
            rows.append({"name": str(model), **dict(zip(names, cells, strict=True))})
    notes = [*filter(None, (*_legend(selected, marks), chosen(selected)))]
    return Table(f"Median relative to {reference_name(selected)}", _values(selected, "times"), rows, notes, NO_CURVE)


def short_ratios(results: xr.Dataset) -> Table:
    """Return the first rows of the medians divided by the reference medians, for a terminal."""
    return median_ratios(results).first(MOST_SHORT)
