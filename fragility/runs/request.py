"""The request of an analysis and its execution: checked arguments, chunks given to a runner, results put together."""

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from ...core import checks
from ...core.aliases import Index, Progress
from ...models import Block, Law, Model
from ...models.laws import oscillator_of
from ...models.outputs import DERIVED, OF_ROCKING, OF_SLIDING, OUTPUTS
from ...models.runs import TALLY, Specimen
from ...models.scenes.edge import FALLEN_OFF
from ...models.sliding.law import SlidingLaw
from ...motions.arrays import Record
from .axes import along_depth, axes_of, needed, of_both
from .factors import Factors
from .oscillators import OscillatorGrid
from .plan import Work, plan_chunks
from .runners import ConfiguredScheduler, Runner, Workers, default_client

Labelled = TypeVar("Labelled", Block, Law, Model)

USUAL = USUAL_OF_ROCKING, USUAL_OF_SLIDING = ("overturned", "peak_rotation"), ("slide_peak",)
"""Outputs if none are named: of rocking and of sliding blocks."""
ENDS = ("slide_peak", "slide_after")
"""Outputs that show if blocks still slide at the end of a motion."""


class Request(NamedTuple):
    """The checked arguments of an analysis: blocks, laws, the outputs of a run, and options of the computation."""

    blocks: list[Block]
    models: Sequence[Model]
    outputs: list[str]
    skip: bool
    runner: Runner
    progress: Progress | None
    screen: bool

    @property
    def sliding(self) -> bool:
        """True if the blocks slide."""
        return any(isinstance(model, SlidingLaw) for model in self.models)

    def specimens(self, across: bool = False, plane: bool = False) -> OscillatorGrid[Block]:
        """Return the specimens of each block under every law, block by block, as `specimen_of` returns them.

        across: of the blocks in the direction of their depth.
        """
        laws = self.models

        def of_block(block: Block) -> list[Specimen]:
            turned = block.across if across else block
            return [specimen_of(turned, law, plane) for law in laws]

        return OscillatorGrid(self.blocks, of_block, len(laws))


class Runs(NamedTuple):
    """Outputs (oscillator, level, motion) by name, and the engine's counts (`models.runs.TALLY`)."""

    results: dict[str, NDArray[Any]]
    tally: Index

    @property
    def skipped(self) -> dict[str, float]:
        """The counts as shares of all samples, and the number of events per run."""
        counts = dict(zip(TALLY, self.tally.tolist(), strict=True))
        samples = counts.pop("samples")
        events = counts.pop("events")
        runs = next(iter(self.results.values())).size
        return {
            "samples": samples,
            **{f"share_{reason}": round(count / samples, 6) for reason, count in counts.items()},
            "events_per_run": round(events / runs, 3),
        }


def check_request(
    blocks: Block | Sequence[Block],
    models: Model | Sequence[Model],
    outputs: Sequence[str] | None,
    skip: bool,
    client: Workers,
    progress: Progress | None,
    screen: bool = False,
) -> Request:
    """Check the arguments that all analyses share; TypeError or ValueError if one is wrong."""
    laws = labelled_sequence("models", models, Model)  # type: ignore[type-abstract]
    wanted = _outputs(outputs, laws)
    for name, value in (("skip", skip), ("screen", screen)):
        checks.flag(name, value)
    checks.callback("progress", progress)
    checked = labelled_sequence("blocks", blocks, Block)
    if FALLEN_OFF in wanted and all(block.edge is None for block in checked):
        raise ValueError(f"outputs: {FALLEN_OFF} needs a block near an edge (Block(…, edge=Edge(…))), got none")
    return Request(
        checked, laws, wanted, skip, runner_of(client), progress, screen and not isinstance(laws[0], SlidingLaw)
    )


def specimen_of(block: Block, model: Model, plane: bool = False) -> Specimen:
    """Return a block under a law in numbers, as its engine takes it; `plane`: sliding under both components."""
    if not isinstance(model, SlidingLaw):
        return oscillator_of(block, model)
    return model.in_plane(block) if plane else model.slider(block)


def _outputs(outputs: Sequence[str] | None, models: Sequence[Model]) -> list[str]:
    """Return the names of outputs, each once; ValueError if a law has none of them."""
    sliding = [isinstance(model, SlidingLaw) for model in models]
    if any(sliding) and not all(sliding):
        raise ValueError("models must be laws of rocking, or Sliding alone: their outputs differ")
    allowed, what = (OF_SLIDING, "outputs of sliding blocks") if all(sliding) else (OF_ROCKING, "outputs")
    names = (
        [outputs]
        if isinstance(outputs, str)
        else checks.sequence("outputs", USUAL[all(sliding)] if outputs is None else outputs)
    )
    if not names:
        raise ValueError(f"{what} must name at least one of {', '.join(allowed)}, got none")
    return list(dict.fromkeys(checks.choice(what, name, allowed) for name in names))


def check_vertical(models: Iterable[Model], motions: Iterable[Record]) -> None:
    """Raise ValueError for motions with a vertical component, and a law that is not in exact geometry."""
    lifted = next((motion.label for motion in motions if motion.vertical is not None), None)
    rocking = [law for law in models if not isinstance(law, SlidingLaw)]
    linear = next((law.label for law in rocking if getattr(law, "geometry", "") != "exact"), None)
    if lifted is not None and linear is not None:
        raise ValueError(
            f"vertical shaking needs exact geometry: {lifted!r} shakes vertically, too, and {linear!r} is linear in "
            'the rotation; take HousnerImpact() (the law "housner")'
        )


def work_of(
    oscillators: Sequence[Specimen], motions: Sequence[Record], factors: Factors, request: Request, per_block: int = 1
) -> Work:
    """Return the work of a request: every oscillator under factors (block, level, motion; see `Work`) times motions.

    ValueError for motions of both axes, which need blocks and are the affair of `collect_about`.
    """
    if axes_of(motions):
        raise ValueError(
            "motions.both_axes and motions.weak_axis are for ida, stripes, cloud and uncertain_ida: let one component "
            "shake (motions.as_recorded)"
        )
    wanted = [*request.outputs, *(ENDS if request.sliding else ())]
    names = tuple(dict.fromkeys(needed for name in wanted for needed in DERIVED.get(name, (name,))))
    return Work(oscillators, tuple(motions), factors, request.skip, names, per_block)


def collect_about(
    work: Work, across: Sequence[Specimen] | None, runner: Runner, progress: Progress | None, least: float | None = None
) -> Runs:
    """Do the work, also about the other axis if there are specimens of it, and put the outputs of the two together.

    across: the specimens of blocks that rock in the direction of their depth (`axes.of_both`).
    """
    if across is None:
        return collect(work, runner, progress, least)
    along = work._replace(outputs=needed(work.outputs))
    works = (along, along._replace(oscillators=across, motions=tuple(map(along_depth, work.motions))))
    total = sum(work.runs for work in works)
    x, y = (
        collect(work, runner, part_of(progress, before, total), least)
        for work, before in zip(works, (0, total // 2), strict=True)
    )
    shape = next(iter(x.results.values())).shape
    outputs = {name: runner.array(shape, OUTPUTS[name].kind) for name in work.outputs}
    for row in range(shape[0]):  # (arrays may lie in files)
        of_row = ({name: values[row] for name, values in runs.results.items()} for runs in (x, y))
        for name, values in of_both(work.outputs, *of_row).items():
            outputs[name][row] = values
    return Runs(outputs, x.tally + y.tally)


def part_of(progress: Progress | None, before: int, total: int | None = None) -> Progress | None:
    """Return the progress callback of a part that begins after `before` of all `total` units of work.

    Without `total`, the part's own total is assumed to be the end of the whole.
    """
    if progress is None:
        return None

    def shifted(done: int, of_part: int) -> None:
        progress(before + done, before + of_part if total is None else total)

    return shifted


def collect(work: Work, runner: Runner, progress: Progress | None, least: float | None = None) -> Runs:
    """Do the work in chunks and put the results together; `least`: shortest duration of a chunk, else the runner's."""
    shape = (len(work.oscillators), work.levels, len(work.motions))
    results = {name: runner.array(shape, OUTPUTS[name].kind) for name in work.outputs}
    tally = np.zeros(len(TALLY), np.int64)
    so_far = 0
    for chunk, done in runner.run(work, plan_chunks(work, least=runner.least if least is None else least)):
        for array, part in zip(results.values(), done.results, strict=True):
            array[chunk.row : chunk.row_stop, :, chunk.first : chunk.stop] = part
        tally += done.tally
        so_far += done.runs
        if progress is not None:
            progress(so_far, work.runs)
    return Runs(results, tally)


def labelled_sequence(name: str, values: Any, kind: type[Labelled]) -> list[Labelled]:
    """Return blocks (or laws) as a list; TypeError for other types, ValueError for equal labels or none."""
    sequence = checks.several(name, values, kind)
    if not sequence:
        raise ValueError(f"{name} must hold at least one, got none")
    taken: set[str] = set()
    for value in sequence:
        if value.label in taken:
            raise ValueError(f"{name} must have unique labels, got {value.label!r} more than once")
        taken.add(value.label)
    return sequence


def runner_of(client: Workers) -> Runner:
    """Return the runner of a client: by default dask's configuration; TypeError for other types."""
    if client is None:
        client = default_client()
    if client is None:
        return ConfiguredScheduler()
    if isinstance(client, Runner):
        return client
    if not hasattr(client, "submit") or not hasattr(client, "scheduler"):
        raise TypeError(f"client must be a dask.distributed Client, got {checks.kind(client)}")
    from .cluster import Cluster  # noqa: PLC0415 - the cluster code loads only where there is a cluster

    return Cluster(client)
