"""Undecided outcomes: flags that change when the motion or the restitution differs by a millionth.

Rocking is chaotic, so that an outcome near a boundary is no evidence, and no inexpensive criterion finds these
outcomes. The runs are therefore repeated, with flags as their only output.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple, TypeVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...core import checks
from ...core.aliases import Flags, Index, Progress
from ...core.parameters import PART, USUAL_CONFIDENCE
from ...core.units import ENDS, of_end
from ...models import Block, Law, Model
from ...models.laws import oscillator_of
from ...models.oscillator import Oscillator
from ...models.runs import Specimen
from ...motions.arrays import Record
from ..numerics.proportions import wilson_interval
from ..numerics.slabs import Where, slabs
from ..runs.axes import along_depth
from ..runs.factors import Factors, either_side
from ..runs.oscillators import OscillatorGrid
from ..runs.plan import Work
from ..runs.provenance import RUN, Motions, about_both_axes, blocks_of, factors_under, laws_of, records_of
from ..runs.request import collect, part_of
from ..runs.runners import Runner
from .reasons import labelled

Row = TypeVar("Row")
Pairs = Sequence[tuple[Block, Law]]

PERTURBATION = 1e-6
FLAGS = ("overturned",)


def undecided_variables(
    perturbed: Flags, dims: tuple[str, ...], flipped: Index, tested: Index
) -> dict[str, xr.Variable]:
    """Return the variables of a screen from numbers of flags, on `dims`: those that change and those tested."""
    known = tested > 0
    n = np.where(known, tested, 1)
    ends = [np.where(known, end, np.nan) for end in wilson_interval(flipped, n)]
    share = np.where(known, flipped / n, np.nan)
    text = "share of the flags tested that a millionth flips"
    again = "whether the runs of the motion were run again, perturbed"
    return {
        "perturbed": labelled(xr.Variable("motion", perturbed), again),
        **{
            f"undecided{end}": labelled(xr.Variable(dims, values), of_end(end, text, USUAL_CONFIDENCE, "Wilson"))
            for end, values in zip(ENDS, (share, *ends), strict=True)
        },
    }


class FlipCounts(NamedTuple):
    """Number of perturbations that change the flag of each run that was repeated.

    `chosen` (motion,): True for the motions whose runs were repeated. `counts` (block, model, level or 1, …, chosen
    motion), where … are several runs of one block under one law, such as the runs of its variants. Counts may be in a
    file and are read slab by slab.
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
        repeated = self.chosen[motion]
        counts = self.counts[block][..., before : before + int(repeated.sum())]
        counts = counts.max(axis=tuple(range(3, counts.ndim - 1)))
        flipped = np.zeros((*counts.shape[:3], repeated.size), np.bool_)
        flipped[..., repeated] = counts > 0
        on = xr.Variable(("block", "model", "level", "motion"), flipped)
        return (on if "level" in dims else on.isel(level=0)).transpose(*dims)

    def variables(self, dims: tuple[str, ...]) -> dict[str, xr.Variable]:
        """Return the share of flags that change among those tested, and its interval as if runs were independent."""
        curve_dims = tuple(dim for dim in dims if dim in ("block", "model"))
        over = tuple(range(1, self.counts.ndim - 1))
        flipped = np.stack([np.count_nonzero(counts > 0, axis=over) for counts in self.counts])
        return undecided_variables(self.chosen, curve_dims, flipped, np.full(flipped.shape, self.tested))


class RunFlips(NamedTuple):
    """Flags of runs in a table that a perturbation changes (run,), and the runs that were repeated.

    chosen (motion,): True for the motions whose runs were repeated; curve (run,): the number of the curve of each.
    """

    chosen: Flags
    repeated: Flags
    changed: Flags
    curve: Index
    shape: tuple[int, int]

    @property
    def tested(self) -> int:
        """Number of runs of each block under each law that were repeated, at most."""
        return int(self._numbers(self.repeated).max())

    def flipped(self, where: Where, dims: tuple[str, ...]) -> xr.Variable:
        """Return True for runs of a slab whose flag a perturbation changes."""
        return xr.Variable(dims, self.changed[where[RUN]])

    def variables(self, _: tuple[str, ...]) -> dict[str, xr.Variable]:
        """Return the share of flags that change among those tested, and the number of these, which curves differ in."""
        dims, tested = ("block", "model"), self._numbers(self.repeated)
        shares = undecided_variables(self.chosen, dims, self._numbers(self.changed), tested)
        text = "runs that were run again, perturbed"
        return {**shares, "undecided_tested": labelled(xr.Variable(dims, tested), text)}

    def _numbers(self, flags: Flags) -> Index:
        return np.bincount(self.curve[flags], minlength=math.prod(self.shape)).reshape(self.shape)


def count_flips(
    runs: xr.Dataset, motions: Motions, share: float, runner: Runner, progress: Progress | None = None
) -> FlipCounts:
    """Repeat the runs of a share of the motions under perturbations and count flips of the flags.

    Runs are repeated with scale factors times 1 ± 1e-6 and, if the law has a restitution, with e times 1 ± 1e-6 (1 -
    1e-6 alone if e is 1).
    """
    shaped = _flags(runs)
    chosen = choose_motions(runs.sizes["motion"], share)
    models = laws_of(runs)
    counts = count_flips_of(
        blocks_of(runs),
        lambda block, across: turned([(block, model) for model in models], across),
        [record for record, is_in in zip(records_of(runs, motions), chosen, strict=True) if is_in],
        lambda blocks: shaped[blocks].values[..., chosen],
        factors_under(runs, chosen),
        runner,
        progress,
        about_both_axes(runs),
    )
    return FlipCounts(chosen, counts)


def turned(pairs: Pairs, across: bool) -> Pairs:
    """Return blocks with their laws, with `across` in the direction of their depth."""
    return [(block.across, law) for block, law in pairs] if across else pairs


def count_flips_of(
    rows: Sequence[Row],
    pairs_of: Callable[[Row, bool], Pairs],
    motions: Sequence[Record],
    flags_of: Callable[[slice], Flags],
    factors: Factors,
    runner: Runner,
    progress: Progress | None,
    both: bool,
) -> NDArray[np.int8]:
    """Repeat the runs of pairs of a block and a law under the perturbations of `count_flips`.

    Counts are (row, pair, level, motion), allocated by the runner. `rows` are the sources of pairs, such as blocks.
    `pairs_of` makes the pairs of a row, as many for each row; with True, in the direction of the depth. Pairs at the
    same position have laws of the same kind (with or without a restitution, and of the same geometry). With `both` the
    runs are about both axes: a run overturns about either. `flags_of` returns the flags (row, pair, level, motion) of a
    slice of the rows without a perturbation. `factors` are (row or 1, level, motion).
    """
    first = pairs_of(rows[0], False)
    with_e = [j for j, (block, law) in enumerate(first) if law.restitution(block) is not None]

    def shaken(row: Row, across: bool) -> list[Specimen]:
        return [oscillator_of(*pair) for pair in pairs_of(row, across)]

    def struck(row: Row, across: bool) -> list[Specimen]:
        pairs = pairs_of(row, across)
        return [specimen for j in with_e for specimen in _either_side(*pairs[j])]

    def works(oscillators_of: Callable[[Row, bool], list[Specimen]], per_row: int, factors: Factors) -> list[Work]:
        def about(across: bool) -> Work:
            grid = OscillatorGrid(rows, lambda row: oscillators_of(row, across), per_row)
            return Work(grid, tuple(map(along_depth, motions) if across else motions), factors, outputs=FLAGS)

        return [about(across) for across in ((False, True) if both else (False,))]

    _, levels, n = factors.shape
    # (up and down are factors in the first works, along the levels, and oscillators in the second)
    perturbed: list[tuple[list[Work], slice | list[int]]] = [
        (works(shaken, len(first), either_side(factors, PERTURBATION)), slice(None))
    ]
    if with_e:
        perturbed.append((works(struck, 2 * len(with_e), factors), with_e))
    counts = runner.array((len(rows), len(first), levels, n), np.int8)
    counts[...] = 0
    done, total = 0, sum(work.runs for about, _ in perturbed for work in about)
    for about, tested in perturbed:
        about_axes = []
        for work in about:
            fell = collect(work, runner, part_of(progress, done, total)).results["overturned"]
            about_axes.append(fell.reshape(len(rows), -1, 2, levels, n))
            done += work.runs
        for part in slabs(dict(zip(("block", "model", "level", "motion"), counts.shape, strict=True)), ("block",)):
            blocks = part.get("block", slice(None))
            nominal = flags_of(blocks)[:, tested]
            flags = np.logical_or.reduce([flags_about[blocks] for flags_about in about_axes])
            counts[blocks, tested] += (flags != nominal[:, :, None]).sum(axis=2, dtype=np.int8)
    return counts


def choose_motions(n: int, share: float) -> Flags:
    """Return True for a share of n motions: rounded down, one at least, a choice that depends on n and share alone."""
    part = PART.number("share", share)
    order = np.random.default_rng(np.random.SeedSequence(0)).permutation(n)
    chosen = np.zeros(n, np.bool_)
    chosen[order[: max(1, math.floor(part * n + 1e-9))]] = True
    return chosen


def perturbed_runs(blocks: int, models: Sequence[Model], levels: int, motions: int, share: float, axes: int = 1) -> int:
    """Return the number of runs that `count_flips` repeats, about one axis or two."""
    laws = sum(2 if hasattr(model, "e") else 1 for model in models)
    return 2 * axes * blocks * laws * levels * int(choose_motions(motions, share).sum())


def _flags(runs: xr.Dataset) -> xr.DataArray:
    """Return the flags of runs on (block, model, level, motion)."""
    if not isinstance(runs, xr.Dataset) or "overturned" not in runs:
        raise TypeError("runs must be a dataset with `overturned`, as toppling.ida returns it")
    flags = runs["overturned"]
    if {*flags.dims} - {"level"} != {"block", "model", "motion"}:
        raise ValueError(f"overturned must be on block, model, motion and possibly level, got dims {flags.dims}")
    checks.not_empty("overturned", flags)
    shaped = flags.reset_coords(drop=True)
    return (shaped if "level" in shaped.dims else shaped.expand_dims("level")).transpose(
        "block", "model", "level", "motion"
    )


def _either_side(block: Block, model: Law) -> list[Oscillator]:
    """The oscillator with e a millionth higher and lower; with e unchanged if the higher value would exceed 1."""
    e = model.restitution(block)
    assert e is not None
    sides = [e * (1.0 + PERTURBATION) if e * (1.0 + PERTURBATION) <= 1.0 else e, e * (1.0 - PERTURBATION)]
    return [oscillator_of(block, replace(model, e=side, restitution_factor=1.0)) for side in sides]  # type: ignore[type-var]
