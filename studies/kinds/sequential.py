"""Fragility studies at adaptive levels: runs, each with its own level, until the answer is as precise as requested."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
import xarray as xr

from ...core.aliases import Progress
from ...core.facts import doubted, stored
from ...core.wording import counted
from ...fragility.adaptive.stopping import WAVE
from ...fragility.adaptive.until import RATE
from ...fragility.fitting.states import state_name
from ...fragility.risk.modelling import range_of_half_levels
from ...fragility.runs.axes import check_axes, check_outputs
from ...fragility.runs.request import DERIVED
from ...fragility.validity.notes import screen_facts
from ...fragility.validity.slab_screen import ScreenRequest
from ...fragility.validity.undecided import perturbed_runs
from ...motions.arrays import LIFTS
from ..file.schema import StudyFile
from ..plan.adaptive_slides import SLIP_HALF, adaptive_slides, groups
from ..plan.designs import Sequential
from ..plan.form_free import ENDS, form_free, modelling_factor
from ..plan.risk import without_replicates
from ..plan.slides import exact_friction_notes, in_plane, slide_notes
from ..text.axes import axis_notes
from ..text.one_side import uplift_notes
from ..text.precision import SEQUENTIAL, measure_notes, precision_notes
from .fragility import FragilityStudy, Rated, fit_of, median_doubts, screening_with, slides_of
from .study import Expected, blocks_of, check_laws, each, perturbed_words, plain

if TYPE_CHECKING:
    from ...fragility.runs.runners import Runner
    from ..plan.risk import Risk

OUTPUTS = ("overturned",)
OF_ANALYSIS = ("dispersion", "rate", "probability")
"""Variables of the analysis that results hold beside those of the fitted curve."""
OF_FIT = ("misfit", "misfit_low", *(f"half_level{end}" for end in ENDS))
"""Variables of the fit whose place is taken by the analysis, which made runs for them."""


@dataclass(frozen=True)
class SequentialStudy(FragilityStudy):
    """Blocks x damping laws x as many motions as the precision takes."""

    kind: ClassVar[str] = "sequential"
    results_are_of: ClassVar[str] = "fragility"

    @classmethod
    def of(cls, content: StudyFile, folder: Path) -> Self:
        blocks = blocks_of(content, folder)
        design = content.design(folder, content.both_ways(blocks))
        assert isinstance(design, Sequential)  # (the table makes it this kind of study)
        risk = None if content.hazard is None else content.hazard.risk(content.analysis.im, folder)
        if design.until.target == RATE:
            assert risk is not None  # (checked with the file)
            design = replace(design, hazard=risk.hazard)
        slides = slides_of(content, blocks)
        if slides is not None and any(LIFTS in array.coords for array in design.arrays):
            raise ValueError("friction at adaptive levels needs motions without a vertical component")
        friction, undecided = screening_with(content, slides, blocks)
        design = replace(design, screening=ScreenRequest(friction, undecided=undecided))
        study = cls(
            content.title,
            plain(content),
            blocks,
            each("models", content.models, blocks),
            design,
            friction,
            undecided,
            fit=fit_of(content),
            risk=risk,
            outputs=OUTPUTS if content.outputs is None else tuple(content.outputs),
            slides=slides,
        )
        near = next((block.label for block in blocks if block.edge is not None), None)
        if near is not None:
            raise ValueError(f"edge_distance_mm of {near!r} needs levels that all motions share, not adaptive ones")
        check_laws(content, study.blocks, study.models)
        check_axes(design.axes, study.blocks, study.models)
        check_outputs(design.axes, study.kept_outputs, study.models)
        derived = next((name for name in study.kept_outputs if name in DERIVED), None)
        if derived is not None:
            raise ValueError(f"outputs: adaptive levels do not keep {derived!r}; leave it out, or give levels")
        study.check_state()
        design.check(study.blocks)
        if len(design.floors) > 1:
            raise ValueError("adaptive levels need the motions of one floor, got several")
        if risk is not None:
            risk.check(design, content.motions.given("floors_file") is not None)
        study.check_sizes()
        return study

    @property
    def words(self) -> str:
        of = f"{counted(len(self.blocks), 'block')} × {counted(len(self.models), 'law')} × {self.design.words}"
        usual = self._own(self.sequence.expected[1], self.sequence.until.least)
        tests = self._perturbed(self.sequence.expected[1], self.sequence.until.least)
        return f"{of}: about {counted(usual, 'run')}{perturbed_words(tests)}"

    @property
    def sequence(self) -> Sequential:
        """The design."""
        assert isinstance(self.design, Sequential)
        return self.design

    @property
    def expected(self) -> Expected:
        motions = self.sequence.expected
        # (a curve may be found in the first wave)
        first = WAVE, self.sequence.until.least, self.sequence.until.least
        few, usual, many = (self._own(*each) + self._perturbed(*each) for each in zip(motions, first, strict=True))
        words = "of some {1:,} motions ({0:,} to {2:,})".format(*motions)
        return Expected((few, usual, many), words, self._sliding(motions[1], first[1]))

    def _own(self, motions: int, first: int) -> int:
        """Return the number of planar runs under so many motions, of which so many look for the curve."""
        return len(self.blocks) * len(self.models) * self.design.about * self.sequence.runs_of(motions, first)

    def _perturbed(self, motions: int, first: int) -> int:
        """Return how many further runs test which outcomes are undecided, under so many motions."""
        tested = (math.ceil(self.undecided * n) for n in (motions, first))
        each = perturbed_runs(len(self.blocks), self.models, 1, 1, 1.0, axes=self.design.about)
        return each * self.sequence.runs_of(*tested)

    @property
    def perturbed_runs(self) -> int:
        return self._perturbed(self.sequence.until.most, self.sequence.until.least)

    @property
    def together(self) -> float:
        return super().together + (0.0 if self.slides is None else self.sequence.kept_bytes)

    @property
    def slide_runs(self) -> int:
        return self._sliding(self.sequence.until.most, self.sequence.until.least)

    def _sliding(self, motions: int, first: int) -> int:
        """Return the number of runs of sliding blocks under so many motions, of which so many look for the curve."""
        if self.slides is None:
            return 0
        curves = len(self.slides.distances) * sum(map(len, groups(self.slides, self.blocks).values()))
        return curves * self.sequence.one_way.runs_of(motions, first)

    def _rated(
        self, risk: Risk, curves: xr.Dataset, results: xr.Dataset, client: Runner, progress: Progress | None
    ) -> Rated:
        """Return the rates of fitted curves; until a rate, those without a form and the fitted ones beside."""
        fitted = super()._rated(risk, curves, results, client, progress)
        if self.sequence.until.target != RATE:
            return fitted
        factor = modelling_factor(curves, risk, self.fit)
        found, said = form_free(fitted.variables, results, factor, risk, self.fit, self.blocks)
        return fitted._replace(variables=found, notes=[*said, *fitted.notes])

    def _compute(self, client: Runner, progress: Progress | None) -> xr.Dataset:
        design = self.sequence if self.slides is None else self.sequence.keeping
        runs = design.run(self.blocks, self.models, self.kept_outputs, client, progress)
        curves = self.fit.curves(runs, self.risk is not None, telling=client.tell)
        found: dict[Any, Any] = {}
        attributes = self._fit_attributes(curves)
        said = [*axis_notes(runs), *self.fit.notes(curves, runs), *precision_notes(runs), *measure_notes(runs)]
        said += uplift_notes(self.blocks, self.models, self.fit.state, self.fit.form)
        coordinates: dict[Any, Any] = {}
        if self.risk is not None:
            rated = self._rated(self.risk, curves, runs, client, progress)
            found |= rated.variables
            coordinates |= rated.coordinates
            attributes |= rated.attributes
            said += rated.notes
        units, medians = str(runs["level"].attrs["units"]), runs["half_level"].values
        if self.slides is not None:
            falls = {"rate": found["rate"]} if "rate" in found else {}
            slid, noted = adaptive_slides(self.slides, design, self.blocks, self.fit, self.risk, falls, units, client)
            found |= {name: one.variable for name, one in slid.data_vars.items()}
            coordinates["slip"] = slid["slip"]
            medians = np.append(medians, slid[SLIP_HALF].values)
            said += [*noted, *slide_notes(slid, self.blocks, plane=in_plane(runs))]
            said += exact_friction_notes(self.slides.exact(self.blocks))
        said += [*doubted(median_doubts(medians, units)), *screen_facts(runs, self.slides is not None)]
        found |= without_replicates(curves).drop_vars(OF_FIT).data_vars
        found |= range_of_half_levels(runs, self.fit.modelling_dispersion)
        own = [f"{name}{end}" for name in OF_ANALYSIS for end in ENDS]
        renamed = runs.rename({name: f"{SEQUENTIAL}{name}" for name in own if name in runs})
        # (figures and sentences take the axis of runs that have no common levels from there, as of a cloud)
        renamed = renamed.assign_coords(intensity=renamed["level"].variable)
        return (
            renamed.assign_coords(coordinates)
            .assign(found)
            .assign_attrs(
                **attributes, confidence=self.fit.confidence, state=state_name(self.fit.state), notes=stored(said)
            )
        )
