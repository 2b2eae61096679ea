"""What an analysis at adaptive levels reached, curve by curve: as notes, and as rows of a table."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator

import numpy as np
import xarray as xr

from ...aliases import Index
from ...fragility.adaptive.stopping import REACHED
from ...fragility.adaptive.until import MEDIAN, PROBABILITY, RATE, TARGETS
from ...fragility.surfaces.gain import Gain, gain_words
from ...wording import value_text, whole_percent
from .rows import Rows
from .words import axis_of, display_unit

FITTED_RATE = "fitted_rate"
"""Rate of the fitted curve in results whose rates are without a form of curve."""
SEQUENTIAL = "sequential_"
"""Prefix, in a study's results, of what the analysis itself says of each curve, beside the curve fitted to all runs."""

SLIP_TARGET, SLIP_HALF_WIDTH = "slip_target", "slip_half_width"
SLIP_MOTIONS, SLIP_RUNS = "slip_motions_run", "slip_runs"
SLIP_STOPPED, SLIP_ACCOUNT = "slip_stopped_because", "slip_account"
"""Variables, on (block, slip): what the analysis of a slip says, and why it stopped; none for blocks without runs."""


def curves_of(results: xr.Dataset) -> Iterator[tuple[str, xr.Dataset]]:
    """Yield each curve of an analysis at adaptive levels with its name."""
    several = results.sizes["model"] > 1
    for i, j in np.ndindex(results.sizes["block"], results.sizes["model"]):
        one = results.isel(block=i, model=j)
        law = f" ({one['model'].item()})" if several else ""
        yield f"{one['block'].item()}{law}", one


def runs_of_curve(one: xr.Dataset) -> Index:
    """Return the places of the runs of one block under one law."""
    mine = one["run_block"].values == int(one["block_number"]), one["run_model"].values == int(one["model_number"])
    return np.flatnonzero(mine[0] & mine[1])


def precision_notes(runs: xr.Dataset, of: str = "") -> list[str]:
    """Return a note for each curve whose precision was not reached, or whose form is off by half of it or more.

    of: words before the name of the curve.
    """
    asked = json.loads(str(runs.attrs["until"]))
    shares = [value for name, value in asked.items() if name in (MEDIAN, RATE)]
    room = 0.5 * float(shares[0]) if shares else math.inf
    said = []
    for name, one in curves_of(runs):
        missed = str(one["stopped_because"].item()) != REACHED
        # (what the rate of a curve misses has a note of its own, however little it is)
        off = abs(float(one["misfit"]))
        if missed or off >= room:
            said.append(f"{of}{name}: {one['account'].item()}")
    return said


def measure_notes(runs: xr.Dataset) -> list[str]:
    """Return a note on better measures for the curve that took the most motions, which all curves share.

    runs: with gains on (block, model, other measure), or on (model, other measure) of a surface; of a median.
    """
    if MEDIAN not in json.loads(str(runs.attrs["until"])):
        return []
    motions = runs["motions_run"]
    where = np.unravel_index(int(np.argmax(motions.values)), motions.shape)
    slowest = runs.isel(dict(zip(motions.dims, where, strict=True)))
    table = np.stack([slowest[f"measure_gain{end}"].values for end in ("", "_lower", "_upper")], axis=-1)
    found = gain_words(slowest["other_measure"].values.tolist(), [Gain(*row) for row in table.tolist()])
    return [f"{found}; a rate then needs a hazard curve of that measure"] if found else []


def precision_rows(results: xr.Dataset) -> Rows | None:
    """Return the table of what was asked of each curve and what was reached; None for other designs."""
    if "stopped_because" not in results or "block" not in results["stopped_because"].dims:
        return None
    asked = json.loads(str(results.attrs["until"]))
    target = next(name for name in asked if name in TARGETS)
    chance = target == PROBABILITY
    scale, unit = display_unit(axis_of(results)) if target == MEDIAN else (1.0, "1/year" if target == RATE else "")
    within = f"±{asked[target]['within']:g}" if chance else f"±{100.0 * asked[target]:g} %"
    beside = target == RATE and FITTED_RATE in results

    def reached(one: xr.Dataset, name: str, width: float) -> tuple[str, str]:
        value, low, high = (float(one[f"{name}{end}"]) / scale for end in ("", "_lower", "_upper"))
        if not (math.isfinite(width) and math.isfinite(value)):
            return "–", "–"
        return f"{value:.3g} ({low:.3g}–{high:.3g})", f"±{width:.3f}" if chance else f"±{100.0 * width:.1f} %"

    lines = []
    for name, one in curves_of(results):
        lines.append(
            (
                name,
                *reached(one, f"{SEQUENTIAL}{target}", float(one["half_width"])),
                f"{int(one['motions_run']):,}",
                f"{runs_of_curve(one).size:,}",
                str(one["stopped_because"].item()),
                *(_of_fitted(one) if beside else ()),
            )
        )
    for name, one in _slips(results):
        lines.append(
            (
                name,
                *reached(one, SLIP_TARGET, float(one[SLIP_HALF_WIDTH])),
                f"{int(one[SLIP_MOTIONS]):,}",
                f"{int(one[SLIP_RUNS]):,}",
                str(one[SLIP_STOPPED].item()),
                *(("–", "–") if beside else ()),
            )
        )
    of = f"{target}, {unit}" if unit else target
    without = " without a form of curve" if target == RATE else ""
    title = f"Precision at adaptive levels: asked are {within} of the {target}{without} (95 % intervals)"
    headings = ("curve", of, "reached", "motions", "runs", "stopped because")
    return Rows(title, (*headings, *(("of the fitted curve", "which differs") if beside else ())), lines)


def _slips(results: xr.Dataset) -> Iterator[tuple[str, xr.Dataset]]:
    """Yield each slip that was run, with the name of its curve."""
    if SLIP_STOPPED not in results:
        return
    for i, k in np.ndindex(results[SLIP_STOPPED].shape):
        one = results.isel(block=i, slip=k)
        if one[SLIP_STOPPED].item():
            yield f"{one['block'].item()}, slip over {100.0 * float(one['slip']):g} cm where it slides", one


def _of_fitted(one: xr.Dataset) -> tuple[str, str]:
    """Return the rate of the fitted curve, and by how much the curve through all runs differs beyond error."""
    fitted = value_text(*(float(one[f"{FITTED_RATE}{end}"]) for end in ("", "_lower", "_upper")))
    apart = float(one["rate_misfit"])
    return fitted, f"by {whole_percent(apart, signed=True)}" if apart else "within error"
