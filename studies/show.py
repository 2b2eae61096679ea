"""Figures of a study's results, chosen by the kind of the study."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING

import xarray as xr

from ..core.writing import whole_file
from .text.block_order import MOST_DRAWN, RATE, chosen_of, shown
from .text.error import writing
from .text.names import drawable
from .text.reached import within_levels

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FRAGILITY, SENSITIVITY = "fragility", "sensitivity"
MOST_RANKINGS = 8
"""Maximum number of figures of rankings, one for each block (and floor); the results contain all rankings."""

# (matplotlib loads slowly and is not needed for an error message: each function imports the plots that it needs)


def figures(results: xr.Dataset) -> Iterator[tuple[str, Figure]]:
    """Yield the figures of a study's results, each with the name of its file."""
    kind = str(results.attrs["kind"])
    plain = drawable(results)
    if kind == FRAGILITY:
        yield from _FIGURES[kind](plain)
        return
    first = shown(plain, most=MOST_DRAWN)
    for name, figure in _FIGURES[kind](within_levels(first) if kind == SENSITIVITY else first):
        chosen = chosen_of(first)
        figure.set_label(f"{figure.get_label()} {chosen[:1].upper()}{chosen[1:]}.".removesuffix(" ."))
        yield name, figure


def draw(results: xr.Dataset, folder: Path) -> list[Path]:
    """Write the figures of a study's results; StudyError if that cannot be."""
    return save_figures(figures(results), folder)


def save_figures(named: Iterable[tuple[str, Figure]], folder: Path) -> list[Path]:
    """Write figures as PNGs with their names; StudyError if that cannot be."""
    from .plots.axes import defaults, settle  # noqa: PLC0415

    written = []
    with defaults():
        for name, figure in named:
            path = folder / f"{name}.png"
            settle(figure)
            with writing(path), whole_file(path) as temporary:
                figure.savefig(temporary, format="png", dpi=150)
            written.append(path)
    return written


def _fragility_figures(results: xr.Dataset) -> Iterator[tuple[str, Figure]]:
    from .plan.estimates import ranking_of_measures  # noqa: PLC0415
    from .plots.efficiency import ranking_figure  # noqa: PLC0415
    from .plots.fragility import fragility_figure, laws_figure  # noqa: PLC0415
    from .plots.region import event_figure, maps  # noqa: PLC0415
    from .plots.risk import risk_figure, spread_figure  # noqa: PLC0415
    from .region.rows import examples, is_pooled  # noqa: PLC0415
    from .text.words import reference_law  # noqa: PLC0415

    first = examples(results) if is_pooled(results) else shown(results)
    yield FRAGILITY, fragility_figure(first)
    half = first["half_level"].isel(model=reference_law(first)[0])
    if first.sizes["model"] > 1 and bool(((half > 0.0) & (half < math.inf)).any()):
        yield "laws", laws_figure(first)
    if is_pooled(results):
        yield from maps(results)
    if "fallen_share" in results:
        yield "events", event_figure(results)
    if "rate_share" in results:
        yield "risk", risk_figure(shown(results, RATE))
    # (where every run overturned there are no curves, and no rates to draw)
    if "epistemic_rate" in results and "place" not in results.dims and bool((results["epistemic_rate"] > 0.0).any()):
        yield "branches", spread_figure(shown(results, RATE))
    if "measure_rank" in results:
        ranking = ranking_of_measures(first)
        floors = ranking["floor"].values.tolist() if "floor" in ranking.dims else [None]
        every = list(product(ranking["block"].values, floors))
        for i, (block, floor) in enumerate(every[:MOST_RANKINGS], start=1):
            yield f"measures_{i}", ranking_figure(ranking, str(block), floor)


def _uncertainty_figures(results: xr.Dataset) -> Iterator[tuple[str, Figure]]:
    from .plots.uncertainty import index_figure, uncertainty_figure  # noqa: PLC0415

    yield "uncertainty", uncertainty_figure(results)
    if "sobol_first" in results:
        yield "sobol", index_figure(results)


def _performance_figures(results: xr.Dataset) -> Iterator[tuple[str, Figure]]:
    from .plots.assessment import anchoring_figure, exceedance_figure, levels_figure  # noqa: PLC0415
    from .plots.risk import spread_figure  # noqa: PLC0415
    from .text.spread import rates_of_building  # noqa: PLC0415

    quantities = ["number", *(["loss"] if "loss_mean" in results else [])]
    if results.sizes["level"] > 1:
        for quantity in quantities:
            yield quantity, levels_figure(results, quantity)
    if "annual_number" in results:
        yield "exceedance", exceedance_figure(results, quantities[-1])
    if "downtime_rate" in results:
        yield "downtime_exceedance", exceedance_figure(results, "downtime")
    if "branch" in results.dims and bool(((rates := rates_of_building(results))["epistemic_rate"] > 0.0).any()):
        yield "branches", spread_figure(rates)
    yield "anchoring", anchoring_figure(results)


def _sensitivity_figures(results: xr.Dataset) -> Iterator[tuple[str, Figure]]:
    from .plots.sensitivity import figures  # noqa: PLC0415

    yield from figures(results)


_FIGURES: dict[str, Callable[[xr.Dataset], Iterator[tuple[str, Figure]]]] = {
    FRAGILITY: _fragility_figures,
    "uncertainty": _uncertainty_figures,
    "performance": _performance_figures,
    SENSITIVITY: _sensitivity_figures,
}
