"""Fragility studies: blocks under damping laws, by any of the three designs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Self

import xarray as xr

from ..fragility import block_notes, fit_fragility, notes, overturning_probability, screen
from ..fragility.perturbed import perturbed_runs
from ..models import Block, Law
from ..models.friction import Friction
from ..models.oscillator import Oscillator
from .designs import Design, count
from .schema import StudyFile
from .study import Progress, Study, each, plain

if TYPE_CHECKING:
    from distributed import Client

# Share of the motions whose flags are tested under perturbations: some 30 % more work.
UNDECIDED = 0.08


@dataclass(frozen=True)
class FragilityStudy(Study):
    """Blocks x damping laws x motions.

    `design` says what is done with which motions; `friction` and `undecided` (share of the motions) are for the
    validity screen.
    """

    blocks: tuple[Block, ...]
    models: tuple[Law, ...]
    design: Design
    friction: Friction | None = None
    undecided: float = UNDECIDED
    kind: ClassVar[str] = "fragility"

    @classmethod
    def of(cls, content: StudyFile, folder: Path) -> Self:
        screening = content.screen
        study = cls(
            content.title,
            plain(content),
            each("blocks", content.blocks),
            each("models", content.models),
            content.design(folder),
            None if screening is None else screening.build(),
            UNDECIDED if screening is None or screening.undecided is None else screening.undecided,
        )
        # what only blocks, laws, motions and levels together can get wrong is said before the work, not during it
        for block in study.blocks:
            for model in study.models:
                model.oscillator(block)
        study.design.check(study.blocks)
        return study

    @property
    def words(self) -> str:
        of = f"{count(len(self.blocks), 'block')} × {count(len(self.models), 'law')} × {self.design.words}"
        perturbed = f", and {self.perturbed_runs:,} perturbed" if self.perturbed_runs else ""
        return f"{of} = {count(self.runs, 'run')}{perturbed}"

    @property
    def runs(self) -> int:
        return len(self.blocks) * len(self.models) * self.design.runs

    @property
    def work(self) -> int:
        return self.runs + self.perturbed_runs

    @property
    def first(self) -> Oscillator:
        return self.models[0].oscillator(self.blocks[0])

    @property
    def notes(self) -> list[str]:
        return block_notes(self.blocks)

    @property
    def _arrays(self) -> Iterable[xr.DataArray]:
        return (*self.design.arrays, *self.design.below)

    @property
    def perturbed_runs(self) -> int:
        """Number of further runs that tell which flags are undecided."""
        if self.undecided == 0.0:
            return 0
        each_motion = self.design.runs // self.design.shakes
        return perturbed_runs(len(self.blocks), self.models, each_motion, self.design.shakes, self.undecided)

    def _compute(self, client: Client | None, progress: Progress | None) -> xr.Dataset:
        results = self.design.run(
            self.blocks,
            self.models,
            ("overturned", "peak_rotation"),
            client,
            None if progress is None else lambda done, _: progress(done, self.work),
        )
        screened = screen(
            results,
            self.design.motions,
            self.friction,
            undecided=self.undecided,
            client=client,
            progress=None if progress is None else lambda done, _: progress(self.runs + done, self.work),
        )
        probabilities = overturning_probability(results)
        curves = fit_fragility(probabilities)
        if "floor" in probabilities.dims:  # the dimension takes the name
            results = results.rename(floor="motion_floor")
        return results.assign({**probabilities.data_vars, **curves.data_vars, **screened.data_vars}).assign_attrs(
            fit_method=curves.attrs["method"],
            confidence=curves.attrs["confidence"],
            screen=screened.attrs["screen"],
            notes="\n".join(notes(screened)),
        )
