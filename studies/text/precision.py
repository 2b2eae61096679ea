"""Results of an analysis at adaptive levels, curve by curve, and notes on them."""

import json
import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import xarray as xr

from ...core.aliases import Index
from ...core.facts import Fact
from ...core.units import ENDS
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
        curve = results.isel(block=i, model=j)
        law = f" ({curve['model'].item()})" if several else ""
        yield f"{curve['block'].item()}{law}", curve


def runs_of_curve(curve: xr.Dataset) -> Index:
    """Return the places of the runs of one block under one law."""
    mine = (
        curve["run_block"].values == int(curve["block_number"]),
        curve["run_model"].values == int(curve["model_number"]),
    )
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

    def ends(curve: xr.Dataset, name: str) -> tuple[float, float, float]:
        value, low, high = (float(curve[f"{name}{end}"]) for end in ENDS)
        return value, low, high

    reached = [
        Reached(
            name,
            ends(curve, "half_level" if target == MEDIAN else f"{SEQUENTIAL}{target}"),
            float(curve["half_width"]),
            int(curve["motions_run"]),
            runs_of_curve(curve).size,
            str(curve["stopped_because"].item()),
            str(curve["account"].item()),
        )
        for name, curve in curves_of(results)
    ]
    if SLIP_TARGET not in results:
        return reached
    for i, k in np.ndindex(results[SLIP_STOPPED].shape):
        of_slip = results.isel(block=i, slip=k)
        if of_slip[SLIP_STOPPED].item():
            reached.append(
                Reached(
                    f"{of_slip['block'].item()}{slip_words(float(of_slip['slip']))}",
                    ends(of_slip, SLIP_TARGET),
                    float(of_slip[SLIP_HALF_WIDTH]),
                    int(of_slip[SLIP_MOTIONS]),
                    int(of_slip[SLIP_RUNS]),
                    str(of_slip[SLIP_STOPPED].item()),
                    str(of_slip[SLIP_ACCOUNT].item()),
                )
            )
    return reached


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
    facts = []
    for name, curve in curves_of(runs):
        missed = is_missed(str(curve["stopped_because"].item()), float(curve["half_width"]), allowed)
        off = abs(float(curve["misfit"])) >= room
        # (what the rate of a curve of falls misses has a note of its own, however little it is)
        apart = slip is not None and target == RATE and float(curve["rate_misfit"]) != 0.0
        if missed or off or apart:
            facts.append(Fact("adaptive.account", names=(f"{name}{of}", str(curve["account"].item()))))
    return facts


def measure_notes(runs: xr.Dataset) -> list[Fact]:
    """Return the note on better measures for the curve that took the most motions, which all curves share."""
    if MEDIAN not in json.loads(str(runs.attrs["until"])):
        return []
    motions = runs["motions_run"]
    where = np.unravel_index(int(np.argmax(motions.values)), motions.shape)
    slowest = runs.isel(dict(zip(motions.dims, where, strict=True)))
    table = np.stack([slowest[f"measure_gain{end}"].values for end in ENDS], axis=-1)
    words = gain_words(slowest["other_measure"].values.tolist(), [Gain(*row) for row in table.tolist()])
    return [Fact("adaptive.other_measure", names=(words,))] if words else []
