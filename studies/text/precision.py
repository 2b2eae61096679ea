"""Results of an analysis at adaptive levels, curve by curve, and notes on them."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import xarray as xr

from ...core.aliases import Index
from ...core.facts import Fact
from ...fragility.adaptive.stopping import REACHED
from ...fragility.adaptive.until import MEDIAN, PROBABILITY, RATE, TARGETS
from ...fragility.surfaces.gain import Gain, gain_words

FITTED_RATE = "fitted_rate"
"""Rate of the fitted curve in results whose rates are without a form of curve."""
SEQUENTIAL = "sequential_"
"""Prefix, in a study's results, of the analysis' own values of each curve, apart from the curve fitted to all runs."""

SLIP_TARGET, SLIP_HALF_WIDTH = "slip_target", "slip_half_width"
SLIP_MOTIONS, SLIP_RUNS = "slip_motions_run", "slip_runs"
SLIP_STOPPED, SLIP_ACCOUNT = "slip_stopped_because", "slip_account"
"""Variables, on (block, slip): results of the analysis of a slip, and its reason to stop; none without runs."""


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


class Reached(NamedTuple):
    """Results of the analysis of one curve: its target with the interval, half width, and reason to stop."""

    name: str
    target: tuple[float, float, float]
    half_width: float
    motions: int
    runs: int
    stopped: str
    account: str


def asked_of(results: xr.Dataset) -> tuple[str, float]:
    """Return the quantity of the requested precision, and the allowed half width."""
    asked = json.loads(str(results.attrs["until"]))
    target = next(name for name in asked if name in TARGETS)
    return target, float(asked[target]["within"] if target == PROBABILITY else asked[target])


def is_missed(stopped: str, half_width: float, allowed: float) -> bool:
    """Return True if an interval is wider than requested; another may have stopped before it was confirmed."""
    return stopped != REACHED and not half_width <= allowed


def slip_words(distance: float) -> str:
    """Return the words after the name of a block in the name of the curve of its slip over a distance, m."""
    return f", slip over {100.0 * distance:g} cm where it slides"


def reached_by(results: xr.Dataset) -> list[Reached]:
    """Return the reached precision of the curve of each block under each law, and of each slip of the runs."""
    target, _ = asked_of(results)

    def ends(one: xr.Dataset, name: str) -> tuple[float, float, float]:
        value, low, high = (float(one[f"{name}{end}"]) for end in ("", "_lower", "_upper"))
        return value, low, high

    found = [
        Reached(
            name,
            ends(one, "half_level" if target == MEDIAN else f"{SEQUENTIAL}{target}"),
            float(one["half_width"]),
            int(one["motions_run"]),
            runs_of_curve(one).size,
            str(one["stopped_because"].item()),
            str(one["account"].item()),
        )
        for name, one in curves_of(results)
    ]
    if SLIP_TARGET not in results:
        return found
    for i, k in np.ndindex(results[SLIP_STOPPED].shape):
        one = results.isel(block=i, slip=k)
        if one[SLIP_STOPPED].item():
            found.append(
                Reached(
                    f"{one['block'].item()}{slip_words(float(one['slip']))}",
                    ends(one, SLIP_TARGET),
                    float(one[SLIP_HALF_WIDTH]),
                    int(one[SLIP_MOTIONS]),
                    int(one[SLIP_RUNS]),
                    str(one[SLIP_STOPPED].item()),
                    str(one[SLIP_ACCOUNT].item()),
                )
            )
    return found


def missed_curves(results: xr.Dataset) -> tuple[list[str], int]:
    """Return the accounts of the curves that missed the requested precision, and the number of all curves."""
    stops = results["stopped_because"]
    if "block" in stops.dims:
        _, allowed = asked_of(results)
        every = reached_by(results)
        missed = [curve for curve in every if is_missed(curve.stopped, curve.half_width, allowed)]
        return [f"{curve.name}: {curve.account}" for curve in missed], len(every)
    # (of a region's surfaces)
    return results["account"].values[stops.values.astype(str) != REACHED].tolist(), stops.size


def precision_notes(runs: xr.Dataset, slip: float | None = None) -> list[Fact]:
    """Return a note for each curve (of slips of `slip` m) whose precision was missed, or whose form is far off."""
    target, allowed = asked_of(runs)
    room = 0.5 * allowed if target in (MEDIAN, RATE) else math.inf
    of = "" if slip is None else slip_words(slip)
    found = []
    for name, one in curves_of(runs):
        missed = is_missed(str(one["stopped_because"].item()), float(one["half_width"]), allowed)
        off = abs(float(one["misfit"])) >= room
        # (what the rate of a curve of falls misses has a note of its own, however little it is)
        apart = slip is not None and target == RATE and float(one["rate_misfit"]) != 0.0
        if missed or off or apart:
            found.append(Fact("adaptive.account", names=(f"{name}{of}", str(one["account"].item()))))
    return found


def measure_notes(runs: xr.Dataset) -> list[Fact]:
    """Return the note on better measures for the curve that took the most motions, which all curves share."""
    if MEDIAN not in json.loads(str(runs.attrs["until"])):
        return []
    motions = runs["motions_run"]
    where = np.unravel_index(int(np.argmax(motions.values)), motions.shape)
    slowest = runs.isel(dict(zip(motions.dims, where, strict=True)))
    table = np.stack([slowest[f"measure_gain{end}"].values for end in ("", "_lower", "_upper")], axis=-1)
    found = gain_words(slowest["other_measure"].values.tolist(), [Gain(*row) for row in table.tolist()])
    return [Fact("adaptive.other_measure", names=(found,))] if found else []
