"""Undecided outcomes: flags that change when the motion or the restitution differs by a millionth.

Rocking is chaotic, so that an outcome near a boundary is no evidence, and no inexpensive criterion tells which outcomes
are near a boundary.  The runs are therefore repeated, with flags as their only output.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ... import checks
from ...aliases import Flags, Progress
from ...models import Block, Law
from ...models.laws import oscillator_of
from ...models.oscillator import Oscillator
from ...units import DIMENSIONLESS
from ..numerics.slabs import Where, slabs
from ..runs.factors import either_side
from ..runs.oscillators import OscillatorGrid
from ..runs.plan import Work
from ..runs.provenance import Motions, blocks_of, factors_under, laws_of, records_of
from ..runs.request import collect, runner_of
from ..runs.runners import Runner

if TYPE_CHECKING:
    from distributed import Client

PERTURBATION = 1e-6
NOT_TESTED = -1
FLAGS = ("overturned",)


def undecided_outcomes(
    runs: xr.Dataset,
    motions: Motions,
    share: float = 1.0,
    client: Client | Runner | None = None,
    progress: Progress | None = None,
) -> xr.DataArray:
    """Count the perturbations of a millionth that change the flag of each run.

    Parameters
    ----------
    runs : xarray.Dataset
        As `toppling.ida`, `stripes` or `cloud` return it, with `overturned`.
    motions : xarray.DataArray or a sequence of them
        The motions of the runs; for stripes, one set for each stripe, as `toppling.stripes` takes them.
    share : float
        Share of the motions to be tested, above 0 to 1, at least one motion: a fixed random choice that depends on the
        number of motions alone.
    client, progress
        As for `toppling.ida`.

    Returns
    -------
    xarray.DataArray
        On the dimensions of `overturned`: the number of repeated runs that give another flag, 0 to 4; -1 where not
        tested.  Runs are repeated with scale factors times 1 ± 1e-6 and, where the law has a restitution, with e times
        1 ± 1e-6 (1 - 1e-6 alone where e is 1).

    Raises
    ------
    TypeError, ValueError
        Runs of another kind, without their configuration or with laws that the package does not have, motions missing,
        a share out of range.
    """
    flags = _flags(runs)
    found = count_flips(runs, motions, share, runner_of(client), progress)
    dims = flags.dims
    shaped = _shaped(flags)
    out = np.full(shaped.shape, NOT_TESTED, np.int8)
    out[..., found.chosen] = found.counts
    labelled = shaped.copy(data=out)
    if "level" not in dims:
        labelled = labelled.isel(level=0)
    text = f"perturbations of {PERTURBATION:g} of motion and restitution that change the flag, {NOT_TESTED}: not tested"
    labelled = labelled.transpose(*dims).rename("undecided_outcomes")
    labelled.attrs = {"units": DIMENSIONLESS, "long_name": text}
    return labelled


class FlipCounts(NamedTuple):
    """Number of perturbations that change the flag of each run that was repeated.

    chosen (motion,): True for the motions whose runs were repeated; counts (block, model, level or 1, chosen motion).
    """

    chosen: Flags
    counts: NDArray[np.int8]

    def flipped(self, where: Where, dims: tuple[str, ...]) -> xr.Variable:
        """Return, on the dimensions of the runs, True for runs of a slab whose flag a perturbation changes."""
        block, motion = (where.get(dim, slice(None)) for dim in ("block", "motion"))
        before = int(self.chosen[: motion.start or 0].sum())
        here = self.chosen[motion]
        own = self.counts[block, :, :, before : before + int(here.sum())]
        found = np.zeros((*own.shape[:3], here.size), np.bool_)
        found[..., here] = own > 0
        on = xr.Variable(("block", "model", "level", "motion"), found)
        return (on if "level" in dims else on.isel(level=0)).transpose(*dims)


def count_flips(
    runs: xr.Dataset, motions: Motions, share: float, runner: Runner, progress: Progress | None = None
) -> FlipCounts:
    """Repeat the runs of a share of the motions under the perturbations of `undecided_outcomes` and count flips."""
    shaped = _shaped(_flags(runs))
    chosen = choose_motions(runs.sizes["motion"], share)
    plain = [one for one, is_in in zip(records_of(runs, motions), chosen, strict=True) if is_in]
    blocks, models = blocks_of(runs), laws_of(runs)
    factors = factors_under(runs, chosen)

    with_e = [j for j, model in enumerate(models) if model.restitution(blocks[0]) is not None]
    shaken = OscillatorGrid(blocks, lambda block: [oscillator_of(block, model) for model in models], len(models))
    struck = OscillatorGrid(
        blocks, lambda block: [one for j in with_e for one in _either_side(block, models[j])], 2 * len(with_e)
    )
    works = [Work(shaken, tuple(plain), either_side(factors, PERTURBATION), outputs=FLAGS)]
    if with_e:
        works.append(Work(struck, tuple(plain), factors, outputs=FLAGS))
    total = sum(work.runs for work in works)
    done: list[Flags] = []
    for work in works:
        before = sum(flags.size for flags in done)
        told = None if progress is None else lambda n, _, before=before: progress(before + n, total)
        done.append(collect(work, runner, told).results["overturned"])

    each = len(blocks), len(models)
    _, levels, n = factors.shape
    # (oscillator, up and down x level, motion), and (block x law x up and down, level, motion)
    flags_up_down = done[0].reshape(*each, 2, levels, n)
    flags_e = done[1].reshape(each[0], len(with_e), 2, levels, n) if with_e else None
    counts = runner.array((*each, levels, n), np.int8)
    for part in slabs({str(dim): size for dim, size in shaped.sizes.items()}, ("block",)):
        here = part.get("block", slice(None))
        nominal = shaped[here].values[..., chosen]
        counts[here] = (flags_up_down[here] != nominal[:, :, None]).sum(axis=2, dtype=np.int8)
        if flags_e is not None:
            counts[here, with_e] += (flags_e[here] != nominal[:, with_e, None]).sum(axis=2, dtype=np.int8)
    return FlipCounts(chosen, counts)


def choose_motions(n: int, share: float) -> Flags:
    """Return True for a share of n motions: rounded down, one at least, a choice that depends on n and share alone."""
    part = checks.number("share", share, above=0.0, at_most=1.0)
    order = np.random.default_rng(np.random.SeedSequence(0)).permutation(n)
    chosen = np.zeros(n, np.bool_)
    chosen[order[: max(1, math.floor(part * n + 1e-9))]] = True
    return chosen


def perturbed_runs(blocks: int, models: Sequence[Law], levels: int, motions: int, share: float) -> int:
    """Return the number of runs that `undecided_outcomes` needs."""
    laws = sum(2 if hasattr(model, "e") else 1 for model in models)
    return 2 * blocks * laws * levels * int(choose_motions(motions, share).sum())


def _flags(runs: xr.Dataset) -> xr.DataArray:
    if not isinstance(runs, xr.Dataset) or "overturned" not in runs:
        raise TypeError("runs must be a dataset with `overturned`, as toppling.ida returns it")
    flags = runs["overturned"]
    if {*flags.dims} - {"level"} != {"block", "model", "motion"}:
        raise ValueError(f"overturned must be on block, model, motion and possibly level, got dims {flags.dims}")
    return flags.reset_coords(drop=True)


def _shaped(flags: xr.DataArray) -> xr.DataArray:
    shaped = flags if "level" in flags.dims else flags.expand_dims("level")
    return shaped.transpose("block", "model", "level", "motion")


def _either_side(block: Block, model: Law) -> list[Oscillator]:
    """The oscillator with e a millionth higher and lower; with e unchanged where the higher value would exceed 1."""
    e = model.restitution(block)
    assert e is not None
    sides = [e * (1.0 + PERTURBATION) if e * (1.0 + PERTURBATION) <= 1.0 else e, e * (1.0 - PERTURBATION)]
    return [oscillator_of(block, replace(model, e=side, restitution_factor=1.0)) for side in sides]  # type: ignore[type-var]
