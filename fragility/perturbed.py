"""Which verdicts are undecided: every flag again, under a motion and a restitution that differ by a millionth.

Rocking is chaotic, so that a verdict near a boundary is no evidence, and no cheap proof says which are near one: the
runs are repeated, flags only.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from .. import checks
from ..models import Block, Law
from ..models.oscillator import Oscillator
from ..models.simulate import oscillator_of
from ..units import DIMENSIONLESS
from .block_factors import either_side
from .execution import Progress, collect
from .oscillator_grid import OscillatorGrid
from .plan import Work
from .provenance import Motions, blocks_of, factors_under, laws_of, records_of
from .runners import Runner, runner_of
from .slabs import Where, slabs

if TYPE_CHECKING:
    from distributed import Client

PERTURBATION = 1e-6
NOT_TESTED = -1
FLAGS = ("overturned",)


def flips(
    runs: xr.Dataset,
    motions: Motions,
    share: float = 1.0,
    client: Client | Runner | None = None,
    progress: Progress | None = None,
) -> xr.DataArray:
    """How many perturbations of a millionth change the flag of each run.

    Parameters
    ----------
    runs : xarray.Dataset
        As `toppling.ida`, `stripes` or `cloud` return it, with `overturned`.
    motions : xarray.DataArray or a sequence of them
        The motions of the runs; of stripes, one set a stripe, as `toppling.stripes` takes them.
    share : float
        Share of the motions to be tested, above 0 to 1, one at least: a fixed random choice that depends on their
        number alone.
    client, progress
        As for `toppling.ida`.

    Returns
    -------
    xarray.DataArray
        On the dimensions of `overturned`: of the runs again with scale factors times 1 ± 1e-6 and, where the law has a
        restitution, e times 1 ± 1e-6 (1 - 1e-6 alone where e is 1), how many give another flag, 0 to 4; -1 where not
        tested.

    Raises
    ------
    TypeError, ValueError
        Runs of another kind, without their configuration or with laws that the package does not have, motions missing,
        a share out of range.
    """
    flags = _flags(runs)
    again = repeated(runs, motions, share, runner_of(client), progress)
    dims = flags.dims
    shaped = _shaped(flags)
    out = np.full(shaped.shape, NOT_TESTED, np.int8)
    out[..., again.chosen] = again.counts
    labelled = shaped.copy(data=out)
    if "level" not in dims:
        labelled = labelled.isel(level=0)
    text = f"perturbations of {PERTURBATION:g} of motion and restitution that change the flag, {NOT_TESTED}: not tested"
    labelled = labelled.transpose(*dims).rename("flips")
    labelled.attrs = {"units": DIMENSIONLESS, "long_name": text}
    return labelled


class Repeated(NamedTuple):
    """Which motions (motion,) were run again, and how many of their flags' perturbations flip them.

    counts (block, model, level or 1, chosen motion).
    """

    chosen: NDArray[np.bool_]
    counts: NDArray[np.int8]

    def flipped(self, where: Where, dims: tuple[str, ...]) -> xr.Variable:
        """Whether a run of a slab is known to flip, on the dimensions of the runs."""
        block, motion = (where.get(dim, slice(None)) for dim in ("block", "motion"))
        before = int(self.chosen[: motion.start or 0].sum())
        here = self.chosen[motion]
        own = self.counts[block, :, :, before : before + int(here.sum())]
        found = np.zeros((*own.shape[:3], here.size), np.bool_)
        found[..., here] = own > 0
        on = xr.Variable(("block", "model", "level", "motion"), found)
        return (on if "level" in dims else on.isel(level=0)).transpose(*dims)


def repeated(
    runs: xr.Dataset, motions: Motions, share: float, runner: Runner, progress: Progress | None = None
) -> Repeated:
    """The runs of a share of the motions again, perturbed: see `flips`."""
    shaped = _shaped(_flags(runs))
    chosen = tested(runs.sizes["motion"], share)
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
    done: list[NDArray[np.bool_]] = []
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
    return Repeated(chosen, counts)


def tested(n: int, share: float) -> NDArray[np.bool_]:
    """Which of n motions a share means: that many, rounded down, one at least, chosen by their number alone."""
    part = checks.number("share", share, above=0.0, at_most=1.0)
    order = np.random.default_rng(np.random.SeedSequence(0)).permutation(n)
    chosen = np.zeros(n, np.bool_)
    chosen[order[: max(1, math.floor(part * n + 1e-9))]] = True
    return chosen


def perturbed_runs(blocks: int, models: Sequence[Law], levels: int, motions: int, share: float) -> int:
    """Number of runs that `flips` needs."""
    laws = sum(2 if hasattr(model, "e") else 1 for model in models)
    return 2 * blocks * laws * levels * int(tested(motions, share).sum())


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
    """The oscillator with e a millionth higher and lower; unchanged where higher would be above 1."""
    e = model.restitution(block)
    assert e is not None
    sides = [e * (1.0 + PERTURBATION) if e * (1.0 + PERTURBATION) <= 1.0 else e, e * (1.0 - PERTURBATION)]
    return [oscillator_of(block, replace(model, e=side, restitution_factor=1.0)) for side in sides]  # type: ignore[type-var]
