"""Tables of sensitivity studies: laws down, values of delta or e across, a table for each block."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...core.aliases import Array
from ...core.wording import two_digits, whole_percent
from ...fragility.runs.provenance import blocks_of
from ...models import Block
from ..plan.estimates import middle_level
from ..text.reached import within_levels
from ..text.rows import Rows
from ..text.words import NOT_REACHED, axis_of, block_title, display_unit, level_name, level_text

LAW_NAMES = {
    "discrete": "discrete damping",
    "giannini-masiani": "Giannini–Masiani",
    "makris-konstantinidis": "Makris–Konstantinidis",
    "vassiliou": "Vassiliou et al.",
    "energy-consistent": "energy-consistent damping",
    "housner": "Housner’s impacts",
    "viscous": "viscous damping",
}
"""Laws in words, by their short names."""
GREEK = {"delta": "δ", "e": "e"}
PARAMETERS = {"delta": "δ, the width of the zone of damping", "e": "e, the coefficient of restitution"}
"""Parameters in words."""
SLIPS, SQUAT, ABOVE = "†", "‡", "*"
"""Marks of values of e: not possible with the friction there is, for so squat a block; and possible, but above e_R."""
MOST_SAID = 3
"""Most blocks that have a sentence; the table has all of them."""


def reference_of(results: xr.Dataset) -> str:
    """The name of the comparison with the study's reference."""
    return str(results["comparison"].values[0])


def reference_name(results: xr.Dataset, comparison: str | None = None) -> str:
    """The reference that values are compared with, in words."""
    symbol = GREEK[str(results.attrs["parameter"])]
    return {
        "rigid": "the rigid block",
        "own": "the block's own e_R",
        "given": f"{symbol} = {results.attrs['reference']}",
        "previous": "the value before",
    }[comparison or reference_of(results)]


def level_between(here: xr.Dataset) -> int:
    """The index of the level at which the rigid block overturns under as near to half of the motions as possible."""
    rigid = here["probability"] - here["excess"].sel(comparison="rigid")
    return middle_level(rigid.where(np.isfinite(rigid)))


def level_at(results: xr.Dataset, at: int) -> str:
    """Return one of the levels with its unit."""
    return level_text(float(results["level"][at]), results["level"])


def law_of_answer(results: xr.Dataset) -> int:
    """Return the position of the law that the first page is about: the nearest to a rigid block with impacts."""
    laws = [str(one) for one in results["law"].values]
    rigid = [name for name in ("housner", "energy-consistent") if name in laws]
    return laws.index(rigid[0]) if rigid else 0


def law_name(results: xr.Dataset, at: int) -> str:
    """Return the name of a law in words: without parameters, and with its rest where two laws differ in it alone."""
    laws = [str(one) for one in results["law"].values]
    name = LAW_NAMES.get(laws[at], laws[at])
    twice = laws.count(laws[at]) > 1 and "rest" in results.coords
    return f"{name} (rigid at rest)" if twice and str(results["rest"].values[at]) == "rigid" else name


def level_rows(results: xr.Dataset) -> Rows:
    """Return the levels at which half of the motions overturn each block, by the value, under the law of the answer."""
    at = law_of_answer(results)
    axis = axis_of(results)
    scale, unit = display_unit(axis)
    symbol = GREEK[str(results.attrs["parameter"])]
    medians = results["half_level"].isel(model=at).transpose("block", "value").values / scale
    marks, own_e = marks_of(results), own_restitution(results)
    rows = []
    for i, block in enumerate(results["block"].values):
        cells = [mark or _level(one) for one, mark in zip(medians[i].tolist(), marks[i].tolist(), strict=True)]
        if own_e is not None:
            e, values = own_e[i], results["value"].values
            above = [bool(value > e) and not mark for value, mark in zip(values, marks[i], strict=True)]
            cells = [f"{cell} {ABOVE}" if beyond else cell for cell, beyond in zip(cells, above, strict=True)]
            cells = ["none" if math.isnan(e) else f"{e:.3f}", *cells]
        rows.append((block_title(str(block)), *cells))
    name = f"{level_name(results)}{f', {unit},' if unit else ''}"
    said = [law_name(results, at), *_legend(results, marks)]
    if any(ABOVE in cell for row in rows for cell in row):
        said.append(f"{ABOVE}: above e_R, so less energy is lost than in an impact at the edge")
    title = f"{name} at which half of the motions overturn each piece, by {symbol} ({'; '.join(said)})"
    heading = () if own_e is None else ("its e_R",)
    return Rows(title, (f"{symbol} =", *heading, *(f"{one:g}" for one in results["value"].values)), rows)


def _level(value: float) -> str:
    return NOT_REACHED if value == math.inf else "–" if math.isnan(value) else two_digits(value)


def own_restitution(results: xr.Dataset) -> Array | None:
    """Return each block's own e_R (block,), NaN of a block too squat for one; None where e is not what is varied."""
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
    own = own_restitution(results)
    if own is None:
        return marks
    marks[~results["in_use"].transpose("block", "value").values.astype(bool)] = SLIPS
    marks[np.isnan(own)] = SQUAT
    return marks


def _legend(results: xr.Dataset, marks: NDArray[np.str_]) -> list[str]:
    """Return what the marks that occur mean."""
    limit = f"{float(results.attrs.get('friction', 1.0)):g}"
    words = {
        SLIPS: f"not possible, because the impact needs a coefficient of friction above {limit}",
        SQUAT: "not possible, because so squat a block stops at an impact at its edge (its e_R is not positive)",
    }
    return [f"{mark}: {text}" for mark, text in words.items() if (marks == mark).any()]


def swings_of(results: xr.Dataset, model: int) -> list[tuple[str, float, float, float, float]]:
    """Return each block's values of its lowest and highest median, in order, and these (SI), as in `level_rows`."""
    results = within_levels(results)
    every = results["half_level"].isel(model=model).transpose("block", "value").values
    values, marks = results["value"].values, marks_of(results)
    found = []
    for i, block in enumerate(results["block"].values):
        known = np.flatnonzero(np.isfinite(every[i]) & (every[i] > 0.0) & (marks[i] == ""))
        if known.size > 1:
            own = every[i][known]
            first, last = sorted((int(known[own.argmin()]), int(known[own.argmax()])))
            if first == last:  # (all medians are the same)
                first, last = int(known[0]), int(known[-1])
            ends = [(float(values[k]), float(every[i][k])) for k in (first, last)]
            found.append((str(block), ends[0][0], ends[1][0], ends[0][1], ends[1][1]))
    return found


def laws_apart(results: xr.Dataset) -> list[tuple[str, float]]:
    """Return the laws with the geometric mean of their medians over the rigid block's, the nearest to 1 first."""
    results = within_levels(results)
    ratio = results["median_ratio"].sel(comparison="rigid").transpose("model", "block", "value").values
    found = []
    for k, own in enumerate(ratio):
        known = results["in_use"].values & (marks_of(results) == "") & np.isfinite(own) & (own > 0.0)
        if known.any():
            found.append((law_name(results, k), float(np.exp(np.log(own[known]).mean()))))
    return sorted(found, key=lambda one: abs(np.log(one[1])))


def median_rows(results: xr.Dataset) -> list[Rows]:
    """Medians divided by those of the reference."""
    ratio = results["median_ratio"].sel(comparison=reference_of(results))
    title = f"Median over that of {reference_name(results)}"
    return [_table(results, f"{title}: {block}", ratio.sel(block=block), _factor) for block in results["block"].values]


def probability_rows(results: xr.Dataset) -> list[Rows]:
    """Probabilities of overturning and shares of flipped outcomes, at the level given by `level_between`."""
    found = []
    for block in results["block"].values:
        here = results.sel(block=block)
        at = level_between(here)
        where = f"at {level_at(results, at)}: {block}"
        found.append(
            _table(results, f"Probability of overturning {where}", here["probability"].isel(level=at), _percent)
        )
        flips = here["flipped"].sel(comparison=reference_of(results)).isel(level=at)
        found.append(_table(results, f"Outcomes that differ from {reference_name(results)} {where}", flips, _percent))
    return found


def _table(results: xr.Dataset, title: str, cells: xr.DataArray, write: Callable[[float], str]) -> Rows:
    symbol = GREEK[str(results.attrs["parameter"])]
    marks = marks_of(results)[results["block"].values.astype(str).tolist().index(str(cells["block"].item()))]
    rows = [
        (
            str(model),
            *(mark or write(float(one)) for one, mark in zip(cells.sel(model=model).values, marks, strict=True)),
        )
        for model in results["model"].values
    ]
    said = _legend(results, marks)
    title += f" ({'; '.join(said)})" if said else ""
    return Rows(title, (f"{symbol} =", *(f"{one:g}" for one in results["value"].values)), rows)


def _factor(value: float) -> str:
    return "" if np.isnan(value) else NOT_REACHED if value == np.inf else f"{value:.2f}"


def _percent(value: float) -> str:
    return "" if np.isnan(value) else whole_percent(value)
