"""The screen of runs in a table, each of one block, law and motion at a level of its own."""

import math
from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np
import xarray as xr

from ...core.aliases import Array, Flags, Progress
from ...motions.arrays import POLARITY, Record
from ...motions.polarity import AS_RECORDED, BOTH, records_under
from ...motions.simulated.generator import Generator
from ..runs.factors import ScaleFactors
from ..runs.provenance import (
    RUN,
    Motions,
    about_both_axes,
    blocks_of,
    configuration_of,
    curves_of,
    laws_of,
    level_measure,
    places_in,
    records_of,
    runs_near_curves,
    same_motions,
)
from ..runs.request import part_of
from ..runs.runners import Runner
from .characteristics import Characteristics
from .reasons import CurveShares
from .slab_screen import NEEDED, Screened, ScreenInput, ScreenRequest, known_coordinates, screened_runs
from .undecided import FLAGS, RunFlips, count_flips_of, perturbed_runs, turned

OF_RUNS = ("run_block", "run_model", "run_motion")
"""Variables with the block, the law and the motion of a run, by number."""
NUMBERS = ("block_number", "model_number", "motion_number")
"""Coordinates with these numbers."""
AT_ONCE = 32
"""Motions of a generator that are made at a time: only their characteristics are kept."""


class Shaken:
    """Properties of motions that the screen needs; motions are given in groups and are not kept.

    The runs of the share `share` of the motions, rounded up, are repeated under perturbations. `kept` has these motions
    by place: evenly spaced from the first one on, with their reverses. The choice therefore does not depend on the
    number of motions that follow.
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
        for record in records:
            if self._records == 0 or record.given != self._last:
                self._given, self._last = self._given + 1, record.given
            if math.ceil(self._given * self.share) > math.ceil((self._given - 1) * self.share):
                self.kept[self._records] = record
            self._records += 1

    @property
    def characteristics(self) -> Characteristics:
        """The characteristics of all motions, in order."""
        return Characteristics.joined(self._parts)


def shaken_by(runs: xr.Dataset, motions: Motions | Generator, share: float) -> Shaken:
    """Return the motions' properties for the screen; ValueError for motions that are not the motions of the runs.

    Motions of a generator are made again, with the seed of the runs.
    """
    shaken = Shaken(share)
    if not isinstance(motions, Generator):
        shaken.add(records_of(runs, motions))
        return shaken
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
            records = [made[i] for i in (ways * (given[mine] - first) + places[mine]).tolist()]
            shaken.add(same_motions(runs.isel(motion=mine), records))
    return shaken


def selected(runs: xr.Dataset) -> xr.Dataset:
    """Return the runs of the blocks, laws and motions of a dataset, with the motions in order of their numbers.

    Selecting blocks, laws or motions of a dataset leaves its dimension run as it is.
    """
    held = {*OF_RUNS, *NUMBERS, *NEEDED, "level", "wave"} <= {*runs.variables}
    dims = {"block", "model", "motion"}
    if not held or not dims <= {*runs.dims}:
        raise TypeError("runs must be a dataset of runs with its coordinates, as toppling.ida returns it")
    runs = runs.isel(motion=np.argsort(runs["motion_number"].values, kind="stable"))
    return runs.isel({RUN: np.logical_and.reduce([places >= 0 for places in places_in(runs).values()])})


def sparse_screen(
    runs: xr.Dataset, shaken: Shaken | None, asked: ScreenRequest, runner: Runner, progress: Progress | None = None
) -> Screened:
    """Return the screen of runs in a table (`selected`).

    The variables are as of `screen`, with run as the dimension of every run, and ``undecided_tested`` (block, model).
    Without `shaken` they are as of `screen` without motions; `runner` and `progress` are for the repeated runs.
    """
    places = places_in(runs)
    sizes = {dim: runs.sizes[dim] for dim in ("block", "model")}
    curve = places["block"] * sizes["model"] + places["model"]
    missing = np.flatnonzero(np.bincount(curve, minlength=math.prod(sizes.values())) == 0)
    if missing.size:
        block, model = divmod(int(missing[0]), sizes["model"])
        label, law = str(runs["block"].values[block]), str(runs["model"].values[model])
        raise ValueError(f"runs must hold runs of every block under every law, got none of {label} under {law}")
    properties, measured = known_coordinates(runs), level_measure(runs)
    at_runs = {dim: xr.Variable(RUN, at) for dim, at in places.items()}
    of_motion = measured.values.variable.isel(at_runs, missing_dims="ignore")
    factors = ScaleFactors(xr.Variable(RUN, runs["level"].values), of_motion, measured.measure)
    given = ScreenInput({RUN: runs.sizes[RUN]}, properties, factors, places)
    flips = None
    if shaken is not None and shaken.kept:
        flips = _flips(runs, factors.values.values, shaken.kept, runner, progress)
    shaking = None if shaken is None else shaken.characteristics
    shares = CurveShares(sizes, curve, runs_near_curves(runs))
    return screened_runs(given, shaking, asked, flips, np.empty, shares)


def _flips(
    runs: xr.Dataset, factors: Array, kept: Mapping[int, Record], runner: Runner, progress: Progress | None
) -> RunFlips:
    """Repeat the runs under the kept motions, curve by curve, and return the changes of flags (`count_flips`)."""
    if FLAGS[0] not in runs:
        raise TypeError("runs must hold overturned, the outcome that is tested for being undecided, got none")
    blocks, laws = blocks_of(runs), laws_of(runs)
    about = 2 if about_both_axes(runs) else 1
    repeated, changed = np.zeros((2, runs.sizes[RUN]), np.bool_)
    number = np.empty(runs.sizes[RUN], np.int64)
    tests = []
    for block, model, places, motions_of_runs in curves_of(runs):
        number[places] = block * len(laws) + model
        among = np.isin(motions_of_runs, list(kept))
        repeated[places[among]] = True
        if among.any():
            tests.append((block, laws[model], places[among], motions_of_runs[among].tolist()))
    work = [perturbed_runs(1, [law], 1, len(motions), 1.0, about) for _, law, _, motions in tests]
    for k, (block, law, at, motions) in enumerate(tests):
        flags = runs[FLAGS[0]].values[at][None, None, None]
        counts = count_flips_of(
            [[(blocks[block], law)]],
            turned,
            [kept[place] for place in motions],
            partial(_all, flags),
            factors[at].reshape(1, 1, -1),
            runner,
            part_of(progress, sum(work[:k]), sum(work)),
            about == 2,
        )
        changed[at] = np.asarray(counts).ravel() > 0
    chosen = np.isin(np.arange(runs.sizes["motion"]), list(kept))
    return RunFlips(chosen, repeated, changed, number, (len(blocks), len(laws)))


def _all(flags: Flags, _: slice) -> Flags:
    """Return the flags of the only row."""
    return flags
