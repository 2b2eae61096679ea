"""Tables by name, with a test if they apply to some results, and the lists of tables in each place."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from typing import NamedTuple

import xarray as xr

from ...models.outputs import AXIS
from ..buildings.variables import SIDEWAYS
from ..facts.answer_building import recommended_lines
from ..plan.adaptive_slides import SLIP_HALF
from ..plan.gains import GAIN
from ..plan.restraints import BROKEN
from ..plan.selections import PREFIX
from ..plan.slides import FALL_OFF, INSTEAD, SLIP
from ..text.reached import within_levels
from . import (
    assessment,
    axes,
    blocks,
    branches,
    fragility,
    inputs,
    kits,
    pieces,
    region,
    restraints,
    sensitivity,
    slides,
)
from .table import Table

Question = Callable[[xr.Dataset], bool]


class Entry(NamedTuple):
    """A table: the test if it applies, and the function that makes it, for each law if `by_law`."""

    applies: Question
    make: Callable[..., Table]
    by_law: bool = False


def has(*names: str) -> Question:
    """Return the test if results have any of some variables, coordinates or attributes."""
    return lambda results: any(name in results or name in results.attrs for name in names)


def _both(*questions: Question) -> Question:
    return lambda results: all(question(results) for question in questions)


def _without(name: str) -> Question:
    return lambda results: name not in results and name not in results.dims


OF_BLOCKS = _both(has("half_level"), _without("value"))
OF_PIECES = has("place")
REGISTRY = {
    "anchoring": Entry(_both(OF_PIECES, lambda results: bool(recommended_lines(results))), inputs.anchoring),
    "lead_blocks": Entry(OF_BLOCKS, blocks.lead_blocks),
    "short_blocks": Entry(_both(OF_BLOCKS, _without("sample_median")), blocks.short_blocks),
    "block_levels": Entry(has("median_ratio"), sensitivity.block_levels),
    "surfaces": Entry(has("lack_of_fit"), region.surfaces),
    "spread": Entry(has("lack_of_fit"), region.spread),
    "events": Entry(has("fallen_mean"), region.events),
    "curves": Entry(OF_BLOCKS, fragility.curves),
    "precision": Entry(
        _both(has("stopped_because"), lambda results: "block" in results["stopped_because"].dims), fragility.precision
    ),
    "gains": Entry(has(GAIN), restraints.gains),
    "breaks": Entry(_both(OF_BLOCKS, has(BROKEN)), restraints.breaks),
    "edges": Entry(_both(OF_BLOCKS, has(f"{FALL_OFF}_probability")), slides.edges),
    "slides": Entry(_both(OF_BLOCKS, has(SLIP_HALF, INSTEAD), has(SLIP_HALF, SLIP)), slides.slides),
    "selections": Entry(has(f"{PREFIX}bias"), fragility.selections),
    "sizes": Entry(has("size_along"), fragility.sizes),
    "measures": Entry(has("measure_rank"), fragility.measures),
    "shares": Entry(_both(OF_BLOCKS, has("capacity_share", "flag_share")), fragility.shares),
    "indices": Entry(_both(OF_BLOCKS, has("sobol_first")), fragility.indices),
    "pieces": Entry(OF_PIECES, pieces.danger, by_law=True),
    "worth": Entry(OF_PIECES, pieces.worth, by_law=True),
    "short_pieces": Entry(OF_PIECES, pieces.short_pieces),
    "kits": Entry(has("kit_falls"), kits.kits, by_law=True),
    "short_kits": Entry(has("kit_falls"), kits.short_kits),
    "item_slides": Entry(_both(OF_PIECES, has(INSTEAD, "contact")), slides.slips, by_law=True),
    "item_falls": Entry(_both(OF_PIECES, has(INSTEAD, "contact")), slides.falls, by_law=True),
    "totals": Entry(OF_PIECES, assessment.totals, by_law=True),
    "consequences": Entry(_both(OF_PIECES, has("consequence")), assessment.consequences, by_law=True),
    "axes": Entry(has(AXIS, f"{SIDEWAYS}_share"), axes.axes),
    "branch_rates": Entry(has("epistemic_rate", "epistemic_any_rate"), branches.branch_rates),
    "branch_amounts": Entry(has(*(f"epistemic_annual_{name}" for name in branches.AMOUNTS)), branches.amount_branches),
    "branch_consequences": Entry(has("epistemic_consequence_rate"), branches.consequence_branches),
    "static_checks": Entry(has("kit_falls"), kits.static_checks),
    "kit_breaks": Entry(_both(OF_PIECES, has(BROKEN, "kit_broken_probability")), kits.kit_breaks),
    "codes": Entry(_both(OF_PIECES, has("code")), pieces.codes),
    "ratios": Entry(has("median_ratio"), sensitivity.median_ratios),
    "short_ratios": Entry(has("median_ratio"), sensitivity.short_ratios),
    "inventory": Entry(has("block"), inputs.sizes),
}
"""All tables by name."""

LEAD = "anchoring", "lead_blocks", "spread", "block_levels"
"""Tables of a page's first part."""
SHORT = "short_blocks", "short_pieces", "short_ratios", "short_kits"
"""Tables on a terminal."""
TABLES = (
    *("surfaces", "spread", "events", "curves", "precision", "gains", "breaks", "edges", "slides"),
    *("shares", "indices", "pieces", "worth", "kits", "item_slides", "item_falls", "totals", "consequences"),
    *("axes", "selections", "branch_rates", "branch_amounts", "branch_consequences", "sizes", "measures"),
    *("static_checks", "kit_breaks", "codes", "ratios"),
)
"""Tables of the appendix, and of a terminal that prints everything."""
INPUTS = ("inventory",)


def tables(results: xr.Dataset, names: Iterable[str] = TABLES) -> Iterator[Table]:
    """Yield the tables of some names that apply to results and have rows."""
    results = within_levels(results)
    entries = [entry for name in names if (entry := REGISTRY[name]).applies(results)]
    by_law = [entry for entry in entries if entry.by_law]
    for entry in entries:
        if not entry.by_law:
            yield from _filled(entry.make(results))
        elif entry is by_law[0]:  # (the tables of a law follow one another)
            for k, law in enumerate(map(str, results["model"].values)):
                for made in (entry.make(results, k) for entry in by_law):
                    several = results.sizes["model"] > 1
                    yield from _filled(replace(made, title=f"{made.title}: {law}") if several else made)


def _filled(table: Table) -> Iterator[Table]:
    if table.rows:
        yield table
