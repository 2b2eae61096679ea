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
from ...aliases import Array, Flags, Progress
from ...models import Block, Law
from ...models.laws import oscillator_of
from ...models.oscillator import Oscillator
from ...motions.arrays import Record
from ...units import DIMENSIONLESS
from ..numerics.slabs import Where, slabs
from ..runs.factors import Factors, either_side
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

    chosen (motion,): True for the motions whose runs were repeated; counts (block, model, level or 1, …, chosen
    motion), where … are several runs of one block under one law, such as those of its variants.
    """

    chosen: Flags
    counts: NDArray[np.int8]

    @property
    def tested(self) -> int:
        """Number of runs of each block under each law that were repeated."""
        return math.prod(self.counts.shape[2:])

    def flipped(self, where: Where, dims: tuple[str, ...]) -> xr.Variable:
        """Return, on the dimensions of the runs, True for runs of a slab whose flag a perturbation changes."""
        block, motion = (where.get(dim, slice(None)) for dim in ("block", "motion"))
        before = int(self.chosen[: motion.start or 0].sum())
        here = self.chosen[motion]
        own = self.counts[block][..., before : before + int(here.sum())]
        own = own.max(axis=tuple(range(3, own.ndim - 1)))
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
    done = _repeated(shaken, struck if with_e else (), plain, (factors, factors), runner, progress)

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


def count_flips_of(
    pairs: Sequence[tuple[Block, Law]],
    flags: Flags,
    motions: Sequence[Record],
    factors: Array,
    runner: Runner,
    progress: Progress | None = None,
) -> NDArray[np.int8]:
    """Repeat the runs of pairs of a block and a law under the perturbations of `undecided_outcomes` and count flips.

    flags (pair, level, motion): as they are without a perturbation; factors (pair or 1, level, motion).  The counts are
    on the dimensions of the flags.
    """
    with_e = [i for i, (block, law) in enumerate(pairs) if law.restitution(block) is not None]
    shaken = [oscillator_of(*pair) for pair in pairs]
    struck = [one for i in with_e for one in _either_side(*pairs[i])]
    own = factors if factors.shape[0] == 1 else factors[with_e]
    done = _repeated(shaken, struck, motions, (factors, own), runner, progress)
    n, levels, shakes = flags.shape
    counts: NDArray[np.int8] = (done[0].reshape(n, 2, levels, shakes) != flags[:, None]).sum(axis=1, dtype=np.int8)
    if with_e:
        of_e = done[1].reshape(len(with_e), 2, levels, shakes)
        counts[with_e] += (of_e != flags[with_e][:, None]).sum(axis=1, dtype=np.int8)
    return counts


def _repeated(
    shaken: Sequence[Oscillator],
    struck: Sequence[Oscillator],
    motions: Sequence[Record],
    factors: tuple[Factors, Factors],
    runner: Runner,
    progress: Progress | None,
) -> list[Flags]:
    """Run some oscillators with factors a millionth higher and lower, and others (where there are any) as they are."""
    works = [Work(shaken, tuple(motions), either_side(factors[0], PERTURBATION), outputs=FLAGS)]
    if len(struck):
        works.append(Work(struck, tuple(motions), factors[1], outputs=FLAGS))
    total = sum(work.runs for work in works)
    done: list[Flags] = []
    for work in works:
        before = sum(flags.size for flags in done)
        told = None if progress is None else lambda n, _, before=before: progress(before + n, total)
        done.append(collect(work, runner, told).results["overturned"])
    return done


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
