"""Running what an analysis asks for: arguments checked, chunks given to a runner, results put together."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from .. import checks
from ..models import Block, Law
from ..models.oscillator import Oscillator
from ..models.runs import TALLY
from ..models.simulate import oscillator_of
from ..motions.arrays import Record
from .block_factors import Factors
from .oscillator_grid import OscillatorGrid
from .plan import OUTPUT_TYPES, Work, plan_chunks
from .runners import Runner, runner_of

if TYPE_CHECKING:
    from distributed import Client

Progress = Callable[[int, int], None]
Labelled = TypeVar("Labelled", Block, Law)

# Outputs that follow from one of the engine's and the block.
DERIVED = {"top_displacement": "peak_rotation"}
OUTPUTS = (*OUTPUT_TYPES, *DERIVED)
"""What can be asked of a run."""


class Request(NamedTuple):
    """What an analysis was asked for, checked: blocks x laws, the outputs wanted of a run, and how to run."""

    blocks: list[Block]
    models: list[Law]
    outputs: list[str]
    skip: bool
    runner: Runner
    progress: Progress | None
    screen: bool

    @property
    def oscillators(self) -> OscillatorGrid:
        """Block by block, every law of each."""
        laws = self.models
        return OscillatorGrid(self.blocks, lambda block: [oscillator_of(block, law) for law in laws], len(laws))


class Runs(NamedTuple):
    """Outputs (oscillator, level, motion) by name, and the engine's counts (`models.runs.TALLY`)."""

    results: dict[str, NDArray[Any]]
    tally: NDArray[np.int64]

    @property
    def skipped(self) -> dict[str, float]:
        """The counts as shares of all samples, and events a run."""
        counts = dict(zip(TALLY, self.tally.tolist(), strict=True))
        samples = counts.pop("samples")
        events = counts.pop("events")
        runs = next(iter(self.results.values())).size
        return {
            "samples": samples,
            **{f"share_{reason}": round(count / samples, 6) for reason, count in counts.items()},
            "events_per_run": round(events / runs, 3),
        }


def request(
    blocks: Block | Sequence[Block],
    models: Law | Sequence[Law],
    outputs: Sequence[str],
    skip: bool,
    client: Client | Runner | None,
    progress: Progress | None,
    screen: bool = False,
) -> Request:
    """The arguments that all analyses share; TypeError or ValueError where one is wrong."""
    names = [outputs] if isinstance(outputs, str) else list(outputs)
    if not names:
        raise ValueError(f"outputs must name at least one of {', '.join(OUTPUTS)}, got none")
    wanted = list(dict.fromkeys(checks.choice("outputs", name, OUTPUTS) for name in names))
    for name, value in (("skip", skip), ("screen", screen)):
        if not isinstance(value, bool):
            raise TypeError(f"{name} must be True or False, got {value!r:.40}")
    return Request(
        labelled_sequence("blocks", blocks, Block),
        labelled_sequence("models", models, Law),  # type: ignore[type-abstract]
        wanted,
        skip,
        runner_of(client),
        progress,
        screen,
    )


def execute(oscillators: Sequence[Oscillator], motions: Sequence[Record], factors: Factors, asked: Request) -> Runs:
    """Every oscillator under factors (block, level, motion; see `Work`) times the motions."""
    names = tuple(dict.fromkeys(DERIVED.get(name, name) for name in asked.outputs))
    return collect(Work(oscillators, tuple(motions), factors, asked.skip, names), asked.runner, asked.progress)


def collect(work: Work, runner: Runner, progress: Progress | None) -> Runs:
    """Do the work in chunks and put the results together."""
    shape = (len(work.oscillators), work.levels, len(work.motions))
    results = {name: runner.array(shape, OUTPUT_TYPES[name]) for name in work.outputs}
    tally = np.zeros(len(TALLY), np.int64)
    so_far = 0
    for chunk, done in runner.run(work, plan_chunks(work)):
        for array, part in zip(results.values(), done.results, strict=True):
            array[chunk.row : chunk.row_stop, :, chunk.first : chunk.stop] = part
        tally += done.tally
        so_far += done.runs
        if progress is not None:
            progress(so_far, work.runs)
    return Runs(results, tally)


def labelled_sequence(name: str, values: Any, kind: type[Labelled]) -> list[Labelled]:
    """One or several blocks (or laws) as a list; TypeError for anything else, ValueError for none or equal labels."""
    found = [values] if isinstance(values, kind) else list(values) if isinstance(values, Iterable) else [values]
    if not found:
        raise ValueError(f"{name} must hold at least one, got none")
    for value in found:
        if not isinstance(value, kind):
            raise TypeError(f"{name} must be one {kind.__name__} or a sequence of them, got {checks.kind(value)}")
    taken: set[str] = set()
    for value in found:
        if value.label in taken:
            raise ValueError(f"{name} must have unique labels, got {value.label!r} more than once")
        taken.add(value.label)
    return found
