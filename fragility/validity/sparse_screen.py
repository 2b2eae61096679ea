"""The screen of runs at adaptive levels, each of one block, law and motion at a level of its own: curve by curve."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from ...core.aliases import Array, Flags, Progress
from ...models.friction import FixedFriction
from ...motions.arrays import POLARITY, Record
from ...motions.polarity import AS_RECORDED, BOTH, records_under
from ...motions.simulated.generator import Generator
from ..runs.factors import ScaleFactors
from ..runs.progress import part_of
from ..runs.provenance import (
    RUN,
    CurveRuns,
    LevelMeasure,
    Motions,
    about_both_axes,
    blocks_of,
    configuration_of,
    curves_of,
    laws_of,
    level_measure,
    places_in,
    polarity_pairs,
    records_of,
    runs_near_curves,
    same_motions,
)
from ..runs.runners import Runner
from .characteristics import Characteristics
from .reasons import REASONS, UNDECIDED, labelled
from .slab_screen import (
    NEEDED,
    TESTED,
    Screened,
    ScreenInput,
    ScreenRequest,
    described_friction,
    few_motions,
    in_order,
    known_coordinates,
    screened_runs,
)
from .sliding import as_probability, friction_by_block
from .undecided import FLAGS, FlipCounts, count_flips_of, perturbed_runs, turned

OF_RUNS = ("run_block", "run_model", "run_motion")
"""Variables with the block, the law and the motion of a run, by number."""
NUMBERS = ("block_number", "model_number", "motion_number")
"""Coordinates with these numbers."""
OF_ALL = ("few_motions", "interval_half_width", "band_low", "band_high", "perturbed")
"""Variables that are of no curve by itself."""
AT_ONCE = 32
"""Motions of a generator that are made at a time: only their characteristics are kept."""


class Shaken:
    """What the screen needs of motions, which come some at a time and are not kept.

    The runs of the share `share` of the motions, rounded up, are repeated under perturbations. `kept` has these motions
    by place: evenly spaced from the first one on, with their reverses, so that the choice does not depend on how many
    motions follow.
    """

    def __init__(self, share: float) -> None:
        self.share = share
        self._parts: list[Characteristics] = []
        self._given = self._records = 0
        self._last = ""
        self.kept: dict[int, Record] = {}

    def add(self, records: Sequence[Record]) -> None:
        """Take the next motions."""
        self._parts.append(Characteristics.of(records))
        for one in records:
            if self._records == 0 or one.given != self._last:
                self._given, self._last = self._given + 1, one.given
            if math.ceil(self._given * self.share) > math.ceil((self._given - 1) * self.share):
                self.kept[self._records] = one
            self._records += 1

    @property
    def characteristics(self) -> Characteristics:
        """The characteristics of all motions, in order."""
        return Characteristics.joined(self._parts)


def shaken_by(runs: xr.Dataset, motions: Motions | Generator, share: float) -> Shaken:
    """Return what the screen needs of the motions of runs; ValueError for other motions than those of the runs.

    Those of a generator are made again, with the seed of the runs.
    """
    found = Shaken(share)
    if not isinstance(motions, Generator):
        found.add(records_of(runs, motions))
        return found
    polarity = BOTH if POLARITY in runs.coords else AS_RECORDED
    ways = 2 if polarity == BOTH else 1
    seed = configuration_of(runs).get("seed")
    if seed is None:
        raise ValueError("runs must say their seed where motions are a generator, as toppling.ida returns them")
    given, places = np.divmod(runs["motion_number"].values, ways)
    for first in range(0, int(given.max()) + 1, AT_ONCE):
        mine = np.flatnonzero((given >= first) & (given < first + AT_ONCE))
        if mine.size:
            made = records_under(motions.sample(AT_ONCE, seed, first), polarity)
            own = [made[i] for i in (ways * (given[mine] - first) + places[mine]).tolist()]
            found.add(same_motions(runs.isel(motion=mine), own))
    return found


def selected(runs: xr.Dataset) -> xr.Dataset:
    """Return the runs of the blocks, laws and motions that a dataset holds, with the motions in order of their numbers.

    Selecting blocks, laws or motions of a dataset leaves its dimension run as it is.
    """
    held = {*OF_RUNS, *NUMBERS, *NEEDED, "level", "wave"} <= {*runs.variables}
    dims = {"block", "model", "motion"}
    if not held or not dims <= {*runs.dims}:
        raise TypeError("runs must be a dataset of runs with its coordinates, as toppling.ida returns it")
    runs = runs.isel(motion=np.argsort(runs["motion_number"].values, kind="stable"))
    return runs.isel({RUN: np.logical_and.reduce([one >= 0 for one in places_in(runs).values()])})


def sparse_screen(
    runs: xr.Dataset, shaken: Shaken | None, asked: ScreenRequest, runner: Runner, progress: Progress | None = None
) -> Screened:
    """Return the screen of runs at adaptive levels (`selected`).

    The variables are those of `screen` (what every run has is on run) and ``undecided_tested`` (block, model). Without
    `shaken` they are those of `screen` without motions; `runner` and `progress` serve the runs that are repeated.
    """
    labels = [str(label) for label in runs["block"].values]
    available = friction_by_block(asked.friction, labels)
    known = all(isinstance(one, FixedFriction) for one in available)
    curves = list(curves_of(runs))
    for curve in curves:
        if not curve.runs.size:
            label, law = str(runs["block"].values[curve.block]), str(runs["model"].values[curve.model])
            raise ValueError(f"runs must hold runs of every block under every law, got none of {label} under {law}")
    properties, measured = known_coordinates(runs), level_measure(runs)
    inputs = [_input(runs["level"].values, properties, measured, curve) for curve in curves]
    flips = _flips(runs, curves, inputs, shaken.kept, runner, progress) if shaken is not None and shaken.kept else None
    shaking = None if shaken is None else shaken.characteristics
    sizes = {str(dim): runs.sizes[dim] for dim in (RUN, "block", "model")}
    found: dict[str, xr.Variable] = {}
    settings: dict[str, Any] = {}
    for k, (curve, given) in enumerate(zip(curves, inputs, strict=True)):
        own = None if shaking is None else shaking.at(curve.motions)
        counts = None if flips is None else flips[k]
        of_block = asked._replace(friction=None if asked.friction is None else available[curve.block])
        variables, settings = screened_runs(given, own, of_block, counts, np.empty)
        if "slides" in variables and not known:
            variables["slides"] = as_probability(variables["slides"])
        if counts is not None:
            text = "runs that were run again, perturbed"
            variables[TESTED] = labelled(xr.Variable(("block", "model"), [[counts.tested]]), text)
        _put(found, {name: one for name, one in variables.items() if name not in OF_ALL}, curve, sizes)
    _share_near(found["outside"], found["verdict"], found.get("undecided"), curves, runs_near_curves(runs))
    if shaking is not None:
        found |= {"band_low": shaking.low, "band_high": shaking.high}
    if flips is not None:
        assert shaken is not None
        chosen = xr.Variable("motion", np.isin(np.arange(runs.sizes["motion"]), list(shaken.kept)))
        found["perturbed"] = labelled(chosen, "whether the runs of the motion were run again, perturbed")
    pairs = polarity_pairs(runs)
    fewest = min(np.unique(pairs[curve.motions]).size for curve in curves)
    of_all = {
        "friction": described_friction(asked.friction, available, labels),
        "fewest_motions": fewest,
        "tested_runs": 0 if flips is None else max(counts.tested for counts in flips if counts is not None),
    }
    return in_order(found | few_motions(fewest, asked.bounds)), settings | of_all


def _input(
    levels: Array, properties: Mapping[str, xr.Variable], measured: LevelMeasure, curve: CurveRuns
) -> ScreenInput:
    """Return the properties of the runs of a curve, each of which has the place of a motion; levels (run,)."""
    at: dict[str, Any] = {"block": [curve.block], "model": [curve.model], "motion": curve.motions}
    level = xr.Variable("motion", levels[curve.runs])
    return ScreenInput(
        {"block": 1, "model": 1, "motion": curve.runs.size},
        {name: variable.isel(at, missing_dims="ignore") for name, variable in properties.items()},
        ScaleFactors(level, measured.values.variable.isel(at, missing_dims="ignore"), measured.measure),
    )


def _share_near(
    outside: xr.Variable, verdict: xr.Variable, undecided: xr.Variable | None, curves: Sequence[CurveRuns], near: Flags
) -> None:
    """Make shares of all runs those of the runs near the curves; that of undecided ones is of the runs tested."""
    bits = np.array([[one.bit] for one in REASONS])
    for curve in curves:
        own = verdict.values[curve.runs[near[curve.runs]]]
        shares = [*np.mean(own & bits > 0, axis=1), np.mean(own > 0)]
        if undecided is not None:
            shares[REASONS.index(UNDECIDED)] = undecided.values[curve.block, curve.model]
        outside.values[curve.block, curve.model] = shares


def _all(flags: Flags, _: slice) -> Flags:
    """Return the flags of the one row that there is."""
    return flags


def _flips(
    runs: xr.Dataset,
    curves: Sequence[CurveRuns],
    inputs: Sequence[ScreenInput],
    kept: Mapping[int, Record],
    runner: Runner,
    progress: Progress | None,
) -> list[FlipCounts | None]:
    """Repeat the runs under the motions that were kept, curve by curve, and count flips (`count_flips`).

    None for a curve without a run under these motions.
    """
    if FLAGS[0] not in runs:
        raise TypeError("runs must hold overturned, the outcome that is tested for being undecided, got none")
    blocks, laws = blocks_of(runs), laws_of(runs)
    about = 2 if about_both_axes(runs) else 1
    chosen = [np.isin(curve.motions, list(kept)) for curve in curves]
    each = zip(curves, chosen, strict=True)
    work = [perturbed_runs(1, [laws[curve.model]], 1, int(own.sum()), 1.0, about) for curve, own in each]
    found: list[FlipCounts | None] = []
    for k, (curve, given, own) in enumerate(zip(curves, inputs, chosen, strict=True)):
        if not own.any():
            found.append(None)
            continue
        flags = runs[FLAGS[0]].values[curve.runs[own]][None, None, None]
        counts = count_flips_of(
            [[(blocks[curve.block], laws[curve.model])]],
            turned,
            [kept[place] for place in curve.motions[own].tolist()],
            partial(_all, flags),
            given.factors.values.values.reshape(1, 1, -1)[..., own],
            runner,
            part_of(progress, sum(work[:k]), sum(work)),
            about == 2,
        )
        found.append(FlipCounts(own, np.asarray(counts)))
    return found


def _put(
    found: dict[str, xr.Variable], variables: Mapping[str, xr.Variable], curve: CurveRuns, sizes: Mapping[str, int]
) -> None:
    """Put the variables of a curve where they belong; what is of its motions, which are its runs, belongs on run."""
    places = {"block": slice(curve.block, curve.block + 1), "model": slice(curve.model, curve.model + 1)}
    for name, one in variables.items():
        of_runs = "motion" in one.dims
        dims = (RUN,) if of_runs else one.dims
        values = one.values.reshape(-1) if of_runs else one.values
        if name not in found:
            shape = [sizes.get(str(dim), values.shape[i]) for i, dim in enumerate(dims)]
            # (what is not known of every curve stays NaN)
            start = np.nan if values.dtype.kind == "f" else 0
            found[name] = xr.Variable(dims, np.full(shape, start, values.dtype), one.attrs)
        at = (curve.runs,) if of_runs else tuple(places.get(str(dim), slice(None)) for dim in dims)
        found[name].values[at] = values
