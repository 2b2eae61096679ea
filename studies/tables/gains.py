"""Chances of blocks with walls and restraints beside those without them, as a table and in sentences."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import NamedTuple

import numpy as np
import xarray as xr

from ...core.wording import about_percent, confidence_text, counted, ratio_text, years_text
from ...fragility.risk.ratios import Ratio
from ...fragility.runs.provenance import number_of_motions
from ..plan.gains import GAIN, MOST, OTHER
from ..plan.ratios import HIGHER, LOWER, OPEN, SAME, verdict_of
from ..text.curve_notes import verb_in
from ..text.rows import Rows
from ..text.words import block_title, floor_name, reference_law

MOST_SAID = 3
"""Most blocks that have a sentence; the table has all of them."""


class Gain(NamedTuple):
    """The chance of a block, that of another in the same place under the same law, and their ratio."""

    block: str
    other: str
    floor: str
    law: str
    chance: float
    of_other: float
    ratio: Ratio


def gains_of(results: xr.Dataset, laws: list[int]) -> Iterator[Gain]:
    """Yield the comparisons of blocks under some laws, block by block; none where there are none."""
    if GAIN not in results:
        return
    floors = results["floor"].values.tolist() if "floor" in results[GAIN].dims else [None]
    labels = [str(one) for one in results["block"].values]
    for i, (k, floor), j in product(range(len(labels)), enumerate(floors), laws):
        at = {"model": j} | ({} if floor is None else {"floor": k})
        ratio = Ratio(*(float(results[f"{GAIN}{end}"].isel(block=i, **at)) for end in ("", "_lower", "_upper")))
        other = str(results[OTHER].values[i])
        if other not in labels or np.isnan(ratio.value):
            continue
        chance, of_other = (
            float(results["risk_probability"].isel(block=one, **at)) for one in (i, labels.index(other))
        )
        law, where = str(results["model"].values[j]), "" if floor is None else floor_name(floor)
        yield Gain(labels[i], other, where, law, chance, of_other, ratio)


def gain_rows(results: xr.Dataset) -> Rows | None:
    """Return the table of what walls and restraints change, under every law; None where nothing can be compared."""
    found = list(gains_of(results, list(range(results.sizes["model"]))))
    if not found:
        return None
    years = float(results.attrs["years"])
    headings = ("", "law", f"in {years_text(years)}", "compared with", f"in {years_text(years)}", "ratio", "")
    rows = []
    for one in found:
        name = f"{one.block}, {one.floor}" if one.floor else one.block
        ratio = ratio_text(*one.ratio)
        chances = about_percent(one.chance), one.other, about_percent(one.of_other)
        rows.append((name, one.law, *chances, ratio, verdict_of(one.ratio) or "–"))
    first = f"the first {MOST} blocks; " if len({one.block for one in found}) == MOST else ""
    title = (
        f"What walls and restraints change ({first}ratios with {confidence_text(results)} intervals; both pieces are "
        "shaken by the same motions)"
    )
    return Rows(title, headings, rows)


def gain_sentences(results: xr.Dataset) -> list[str]:
    """Return what walls and restraints change under the reference law, a sentence for each of the first blocks."""
    at, _ = reference_law(results)
    found = list(gains_of(results, [at]))
    years = years_text(float(results.attrs["years"])) if found else ""
    motions = counted(number_of_motions(results), "motion")
    verb = verb_in(results)
    said = []
    for one in found[:MOST_SAID]:
        where = f" on {one.floor}" if one.floor else ""
        name, other = block_title(one.block), block_title(one.other)
        text = f"The chance that “{name}”{where} {verb} in {years} is {about_percent(one.chance)}, compared with"
        said.append(f"{text} {about_percent(one.of_other)} for “{other}”: {_verdict(one.ratio, motions)}.")
    more = len(found) - MOST_SAID
    return [*said, *([f"The table has {counted(more, 'more comparison')}."] if more > 0 else [])]


def _verdict(ratio: Ratio, motions: str) -> str:
    """Say which of two chances is the lower one, and by what factor."""
    word = verdict_of(ratio)
    ends = sorted((ratio.lower, ratio.upper))
    if word == LOWER:
        low, high = (1.0 / end for end in reversed(ends))
        return f"lower by a factor of {ratio_text(1.0 / ratio.value, low, high)}"
    if word == HIGHER:
        return f"higher by a factor of {ratio_text(ratio.value, ends[0], ends[1])}"
    if word == OPEN:
        return f"{motions} are too few to tell which is lower"
    if word == SAME:
        return "no difference"
    if ratio.value == 0.0:
        return f"no fall under any of the {motions}"
    return "too few motions bring either down for a comparison"
