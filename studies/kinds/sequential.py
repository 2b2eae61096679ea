"""Fragility studies at adaptive levels: runs, each with its own level, until the answer is as precise as requested."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import ClassVar, Self

import numpy as np
import xarray as xr

from ...core.aliases import Progress
from ...core.facts import Fact, doubted
from ...core.units import ENDS
from ...core.wording import counted
from ...fragility.adaptive.stopping import WAVE
from ...fragility.adaptive.until import RATE
from ...fragility.risk.modelling import range_of_half_levels
from ...fragility.runs.runners import Runner
from ...fragility.validity.notes import screen_facts
from ...fragility.validity.slab_screen import ScreenRequest
from ...models.outputs import DERIVED
from ...motions.arrays import LIFTS
from ..file.schema import StudyFile
from ..plan.adaptive_slides import SLIP_HALF, adaptive_slides, groups
from ..plan.designs import Sequential
from ..plan.form_free import form_free, modelling_factor
from ..plan.risk import Risk, without_replicates
from ..plan.slides import in_plane, slide_notes
from ..text.axes import axis_notes
from ..text.one_side import uplift_notes
from ..text.precision import SEQUENTIAL, measure_notes, precision_notes
from .fragility import FragilityStudy, median_doubts
from .study import Expected, perturbed_words

OF_ANALYSIS = ("dispersion", "rate", "probability")
"""Variables of the analysis that results contain in addition to the fitted curve's."""
OF_FIT = ("misfit", "misfit_low", *(f"half_level{end}" for end in ENDS))
"""Variables of the fit whose place is taken by the analysis, which made runs for them."""


@dataclass(frozen=True)
class SequentialStudy(FragilityStudy):
    """Blocks x damping laws x as many motions as the precision takes."""

    design: Sequential
    outputs: tuple[str, ...] = ("overturned",)
    kind: ClassVar[str] = "sequential"
    results_are_of: ClassVar[str] = "fragility"

    @classmethod
    def of(cls, content: StudyFile, folder: Path) -> Self:
        study = super().of(content, folder)
        if study.slides is not None and any(LIFTS in array.coords for array in study.design.arrays):
            raise ValueError("friction at adaptive levels needs motions without a vertical component")
        near = next((block.label for block in study.blocks if block.edge is not None), None)
        if near is not None:
            raise ValueError(f"edge_distance_mm of {near!r} needs levels that all motions share, not adaptive ones")
        derived = next((name for name in study.kept_outputs if name in DERIVED), None)
        if derived is not None:
            raise ValueError(f"outputs: adaptive levels do not keep {derived!r}; leave it out, or give levels")
        until = study.design.until
        if until.target == RATE:
            assert study.risk is not None  # (checked with the file)
            until = replace(until, hazard=study.risk.hazard)
        screening = ScreenRequest(study.friction, undecided=study.undecided)
        return replace(study, design=replace(study.design, until=until, screening=screening))

    @property
    def words(self) -> str:
        motions, first = self.design.expected[1], self.design.until.least
        usual, tests = self._shaken(motions, first), self._tests * self.design.tested_of(self.undecided, motions, first)
        return f"{self.pairs_words} × {self.design.words}: about {counted(usual, 'run')}{perturbed_words(tests)}"

    @property
    def expected(self) -> Expected:
        motions, least = self.design.expected, self.design.until.least
        # (a curve may be found in the first wave)
        few, usual, many = (
            self._shaken(n, first) + self._tests * self.design.tested_of(self.undecided, n, first)
            for n, first in zip(motions, (WAVE, least, least), strict=True)
        )
        words = "of some {1:,} motions ({0:,} to {2:,})".format(*motions)
        return Expected((few, usual, many), words, self._sliding(motions[1], least))

    def _shaken(self, motions: int, first: int) -> int:
        """Return the number of planar runs under `motions` motions, of which `first` search for the curve."""
        return len(self.blocks) * len(self.models) * self.design.about * self.design.runs_of(motions, first)

    @property
    def together(self) -> float:
        return super().together + (0.0 if self.slides is None else self.design.kept_bytes)

    @property
    def slide_runs(self) -> int:
        return self._sliding(self.design.until.most, self.design.until.least)

    def _sliding(self, motions: int, first: int) -> int:
        """Return the number of runs of sliding blocks under `motions` motions; `first` of them search for the curve."""
        if self.slides is None:
            return 0
        curves = len(self.slides.distances) * sum(map(len, groups(self.slides, self.blocks).values()))
        return curves * self.design.one_way.runs_of(motions, first)

    def _rated(
        self, risk: Risk, curves: xr.Dataset, results: xr.Dataset, client: Runner, progress: Progress | None
    ) -> tuple[xr.Dataset, list[Fact]]:
        """Return the rates of fitted curves; until a rate, the rates without a form, with the fitted rates."""
        rates, facts = super()._rated(risk, curves, results, client, progress)
        if self.design.until.target != RATE:
            return rates, facts
        factor = modelling_factor(curves, risk, self.fit)
        variables, of_runs = form_free(rates.data_vars, results, factor, risk, self.fit, self.blocks)
        return rates.assign(variables), [*of_runs, *facts]

    def _compute(self, client: Runner, progress: Progress | None) -> xr.Dataset:
        design = self.design if self.slides is None else self.design.keeping
        runs = design.run(self.blocks, self.models, self.kept_outputs, client, progress)
        curves = self.fit.curves(runs, self.risk is not None, telling=client.tell)
        kept = without_replicates(curves).drop_vars(OF_FIT).drop_attrs(deep=False)
        parts = [kept.assign(range_of_half_levels(runs, self.fit.modelling_dispersion))]
        facts = [*axis_notes(runs), *self.fit.notes(curves, runs), *precision_notes(runs), *measure_notes(runs)]
        facts += uplift_notes(self.blocks, self.models, self.fit.state, self.fit.form)
        falls: dict[str, xr.DataArray] = {}
        if self.risk is not None:
            rates, of_rates = self._rated(self.risk, curves, runs, client, progress)
            parts.append(rates)
            falls["rate"] = rates["rate"]
            facts += of_rates
        units, medians = str(runs["level"].attrs["units"]), runs["half_level"].values
        if self.slides is not None:
            slid, noted = adaptive_slides(self.slides, design, self.blocks, self.fit, self.risk, falls, units, client)
            parts.append(slid)
            medians = np.append(medians, slid[SLIP_HALF].values)
            exact = self.slides.exact(self.blocks)
            facts += [*noted, *slide_notes(slid, self.blocks, exact, plane=in_plane(runs))]
        facts += [*doubted(median_doubts(medians, units)), *screen_facts(runs, self.slides is not None)]
        names = [f"{name}{end}" for name in OF_ANALYSIS for end in ENDS]
        renamed = runs.rename({name: f"{SEQUENTIAL}{name}" for name in names if name in runs})
        # (figures and sentences take the axis of runs that have no common levels from there, as of a cloud)
        renamed = renamed.assign_coords(intensity=renamed["level"].variable)
        return self._with_curves(renamed, curves, parts, facts)
