"""Fragility studies: blocks under damping laws, by any of the three designs."""

import math
from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np
import xarray as xr

from ...core.aliases import Array, Progress
from ...core.doubts import Doubt
from ...core.facts import Fact, stored
from ...core.units import ENDS
from ...core.wording import counted
from ...fragility import screen
from ...fragility.analyses.sliding import number_of_slides
from ...fragility.curves.curve import TABULATED
from ...fragility.fitting.fit import FIRST
from ...fragility.fitting.states import DIRECTIONS, OVERTURNED, of_both_axes, reached, state_name
from ...fragility.hazard.plausibility import branch_doubts, hazard_doubts
from ...fragility.hazard.poisson import probability_in
from ...fragility.risk.inversion import check_family
from ...fragility.risk.modelling import MODELLING, RANGE, USUAL_DISPERSION, range_of_half_levels
from ...fragility.runs.axes import check_axes, check_outputs
from ...fragility.runs.request import USUAL_OF_ROCKING, part_of
from ...fragility.runs.runners import Runner
from ...fragility.runs.scaling import BLOCK_MEASURES
from ...fragility.validity.notes import screen_facts
from ...fragility.validity.plausibility import level_doubts
from ...models import Block, Law, Restraint
from ...models.friction import FixedFriction, Friction
from ...motions.polarity import BOTH
from ..facts.notes import of_branch
from ..file.schema import StudyFile
from ..plan.branches import BEYOND, Branches, FittedCurves
from ..plan.designs import Cloud, Design, Incremental, Stripes
from ..plan.estimates import LOW_SHARE, MEAN, Fit, ranked
from ..plan.gains import gains
from ..plan.piece_classes import class_notes
from ..plan.restraints import FLAG, STEPS, any_held, needed_strengths, ruptures
from ..plan.risk import Risk, without_replicates
from ..plan.selections import selection_notes, selection_variables
from ..plan.slides import Slides, edge_notes, in_plane, is_free, slide_notes
from ..text.axes import axis_notes, component_notes, held_notes
from ..text.curve_notes import EXCEEDED, SLIPS_WITHOUT_BRANCHES, branches_beyond_note, modelling_note
from ..text.one_side import FORCED, forced_to_1, one_side_notes, uplift_notes
from ..text.spread import branch_names
from .branches import weighted_hazards, weighted_laws, weighted_motions
from .study import (
    CURVE_BYTES,
    LOGNORMAL,
    REPLICATE_BYTES,
    SLAB_BYTES_A_RUN,
    BlockStudy,
    blocks_of,
    check_one_floor,
    parts_of,
    perturbed_words,
    screening_of,
)

# Bytes of the ranking of all measures for a curve.
RANKED_BYTES = 3e3
# Bytes of a curve and its rate in the results, most of them the shares of 40 bins.
STORED_BYTES = 1.2e3
# Planning figures of a fit, measured on a current core. They are for a curve and each of its motions, in one thread,
# and for each replicate's levels and motions, in all threads.
SECONDS_A_CURVE = 2e-3
SECONDS_A_MOTION = 2e-6
SECONDS_A_REPLICATE = 2e-5
SECONDS_A_LEVEL = 2e-7
SECONDS_A_WEIGHT = 2e-9
# Curves without parameters are probabilities, like the observed probabilities, so they have other names in the results.
OBSERVED = ("probability", "probability_lower", "probability_upper")
SIZE = ("size_along", "size_probability")


def _branches(content: StudyFile, folder: Path, study: "FragilityStudy") -> Branches | None:
    """Return the weighted branches of a study, None if it has none; ValueError for laws that it lacks."""
    modelling = 0.0 if study.fit.modelling == MEAN else study.fit.modelling_dispersion
    if study.risk is None or (content.branches is None and modelling == 0.0):
        return None
    return Branches(
        weighted_laws(content, study.models),
        weighted_motions(content, lambda other: other.design(folder, study.design.both_ways)),
        weighted_hazards(content, study.risk.hazard, content.analysis.im, folder),
        modelling,
    )


def slides_of(content: StudyFile, blocks: Iterable[Block]) -> Slides | None:
    """Return the friction of a study, with the friction of blocks that have their own; None if it is not known."""
    if content.friction is None:
        return None
    frictions = {
        block.label: table.own_friction
        for block, table in zip(blocks, content.blocks or [], strict=False)
        if table.own_friction is not None
    }
    near = {
        block.label: 1e-3 * table.trip_mm
        for block, table in zip(blocks, content.blocks or [], strict=False)
        if table.trip_mm is not None
    }
    return replace(content.friction.build(content.analysis.polarity or BOTH), frictions=frictions, trips=near)


def screening_with(
    content: StudyFile, slides: Slides | None, blocks: Iterable[Block]
) -> tuple[Friction | Mapping[str, Friction] | None, float]:
    """Return `screening_of` with the friction of each block; outcomes other than falls are not tested."""
    friction, undecided = screening_of(content)
    state = fit_of(content).state
    if state not in (OVERTURNED, *DIRECTIONS):
        if content.screen is not None and content.screen.undecided:
            raise ValueError(f"screen.undecided tests falls: leave it out with fit.state = {state!r}")
        undecided = 0.0
    if slides is None or not slides.frictions:
        return friction, undecided
    return {block.label: slides.friction_of(block) for block in blocks}, undecided


def median_doubts(medians: Array, units: str) -> list[str]:
    """Return the input warnings on medians at levels that runs have found (SI, in such units)."""
    known = medians[np.isfinite(medians)]
    doubts = level_doubts(known, units)
    return [doubt.sentence.replace("the highest level", "the highest median").partition(": ")[0] for doubt in doubts]


def fit_of(content: StudyFile) -> Fit:
    """Return the options of the fit; with a hazard the table of rates gives the level of a probability, too."""
    fit = LOGNORMAL if content.fit is None else content.fit.build()
    asked = content.fit is not None and content.fit.fractiles is not None
    return fit if asked or content.hazard is None else replace(fit, fractiles=(LOW_SHARE,))


def _targets(content: StudyFile, study: "FragilityStudy") -> tuple[float, ...]:
    """Return the chance that the restraint of each block is to keep, empty if none has a target."""
    tables = {key: table for key, table in content.restraint_tables.items() if table.target is not None}
    if not tables:
        return ()
    key = f"{next(iter(tables))}.target"
    check_one_floor(study.design, key)
    if study.risk is None and study.design.levels.size != 1:
        raise ValueError(f"{key} needs [hazard], whose years it is of, or a single level; add one of them")
    # (blocks of a file have no tables: restraints are found by their values)
    of_restraint: dict[Restraint | None, float | None] = {table.build(): table.target for table in tables.values()}
    return tuple(of_restraint.get(block.restraint) or math.nan for block in study.blocks)


@dataclass(frozen=True)
class FragilityStudy(BlockStudy):
    """Blocks x damping laws x motions.

    `measures` are ranked in addition to the plain measures (None: no ranking); `outputs` are kept in addition to the
    outputs that the fit needs.
    """

    measures: tuple[str, ...] | None = None
    outputs: tuple[str, ...] = USUAL_OF_ROCKING
    branches: Branches | None = None
    slides: Slides | None = None
    targets: tuple[float, ...] = ()
    """Chance that the restraint of each block is to keep, NaN without one; empty if none has a target."""

    @property
    def may_slide(self) -> bool:
        return self.slides is not None

    kind: ClassVar[str] = "fragility"

    @classmethod
    def of(cls, content: StudyFile, folder: Path) -> Self:
        blocks = blocks_of(content, folder)
        slides = slides_of(content, blocks)
        friction, undecided = screening_with(content, slides, blocks)
        study = cls(
            **parts_of(content, folder, blocks),
            fit=fit_of(content),
            friction=friction,
            undecided=undecided,
            measures=None if content.measures is None else tuple(content.measures.also or ()),
            outputs=cls.outputs if content.outputs is None else tuple(content.outputs),
            slides=slides,
        )
        study = replace(study, branches=_branches(content, folder, study))
        # errors in the combination of blocks, laws, motions and levels are raised before the work, not during it
        check_axes(study.design.axes, study.blocks, study.models)
        check_outputs(study.design.axes, study.kept_outputs, study.models)
        study.check_state()
        if study.design.about == 2 and slides is not None and (slides.trip is not None or slides.trips):
            raise ValueError("trip_mm cannot be given where both components shake: trips are of one component")
        study._check(content)
        study = replace(study, targets=_targets(content, study))
        for name, design in study.further.items():
            try:
                design.check(study.blocks)
                if design.axes != study.design.axes:
                    raise ValueError("must shake about the same axes: give component, and axes, as in [motions]")
                if design.floors != study.design.floors:
                    raise ValueError(f"must be of the same floors, got {', '.join(design.floors) or 'the ground'}")
            except ValueError as error:
                raise ValueError(f"motion_sets {name!r}: {error}") from None
        study.check_sizes()
        return study

    def check_state(self) -> None:
        """Raise a ValueError for a state of one axis if both components act, and if options need common levels."""
        if self.design.about == 2 and not of_both_axes(self.fit.state):
            raise ValueError(
                f"fit.state must be overturned or uplifted where both components shake, got {self.fit.state!r}"
            )
        if self.fit.method == FIRST and not isinstance(self.design, Incremental):
            raise ValueError(f"fit.method {FIRST!r} needs the levels of [ida], which all motions share")
        own_levels = isinstance(self.design, Cloud) and not self.design.ground and len(self.design.floors) > 1
        if self.fit.form in TABULATED and own_levels:
            raise ValueError(
                f"fit.form {self.fit.form!r} needs levels that floors share, which a [cloud] has with "
                'im_at = "ground", or of one floor'
            )

    def check_sizes(self) -> None:
        """Raise a ValueError if the size that a rate asks for cannot be found among the blocks."""
        if self.risk is None or self.risk.along is None:
            return
        if len(self.blocks) < 2:
            raise ValueError(f"hazard.along {self.risk.along!r} needs blocks that differ in it, got one block")
        sizes = [getattr(block, self.risk.along) for block in self.blocks]
        try:
            check_family(self.risk.along, sizes, [block.label for block in self.blocks])
        except ValueError as error:
            raise ValueError(f"hazard.along: {error}") from None

    @property
    def words(self) -> str:
        other = f", and {self.further_runs:,} under the motions of {counted(len(self.further), 'branch')}"
        searched = f", and up to {self.searched_runs:,} that look for strengths of restraints"
        of_study = f"{self.pairs_words} × {self.design.words} = {counted(self.runs, 'run')}"
        return (
            f"{of_study}{perturbed_words(self.perturbed_runs)}"
            f"{other if self.further_runs else ''}{searched if self.searched_runs else ''}"
        )

    @property
    def runs(self) -> int:
        return len(self.blocks) * len(self.models) * self.design.runs

    @property
    def work(self) -> int:
        return super().work + self.further_runs + self.searched_runs

    @property
    def searched_runs(self) -> int:
        """Most runs that look for strengths of restraints."""
        held = int(np.isfinite(self.targets).sum())
        return STEPS * held * len(self.models) * self.design.runs * self.design.about

    @property
    def selections(self) -> xr.Dataset | None:
        """Agreement of the motions of stripes with the hazard; None if they are not selected."""
        if not isinstance(self.design, Stripes) or not self.design.selections:
            return None
        return selection_variables(self.design.selections, self.design.motions)

    @property
    def _read(self) -> list[Any]:
        chosen = self.selections
        return [*super()._read, *([] if chosen is None else [chosen.to_dict()])]

    @property
    def slide_runs(self) -> int:
        if self.slides is None or isinstance(self.design, Cloud):
            return 0
        runs_of_blocks = (
            number_of_slides(block, self.slides.friction_of(block), self.in_plane)
            for block in self.blocks
            if is_free(block)
        )
        return sum(runs_of_blocks) * self.design.runs

    @property
    def further(self) -> dict[str, Design]:
        """The designs of branches in addition to the study's own, by name."""
        return {} if self.branches is None else self.branches.designs

    @property
    def further_runs(self) -> int:
        """Number of runs under the motions of branches."""
        return len(self.blocks) * len(self.models) * sum(design.runs * design.about for design in self.further.values())

    @property
    def arrays(self) -> Iterable[xr.DataArray]:
        others = [array for design in self.further.values() for array in (*design.arrays, *design.below)]
        return (*super().arrays, *others)

    @property
    def doubts(self) -> list[Doubt]:
        others = [doubt for design in self.further.values() for doubt in design.doubts]
        named = {} if self.branches is None else {name: curve for name, (curve, _) in self.branches.hazards.items()}
        # the study's own hazard is among the hazards of its branches; levels of block measures are not in its measure
        apart = [] if self.design.im in BLOCK_MEASURES else branch_doubts(named, self.design.levels)
        hazards = chain.from_iterable(map(hazard_doubts, named.values()))
        return list(dict.fromkeys([*super().doubts, *others, *hazards, *apart]))

    @property
    def curves(self) -> int:
        return self._curves_of(self.design) + sum(map(self._curves_of, self.further.values()))

    def _curves_of(self, design: Design) -> int:
        return len(self.blocks) * len(self.models) * max(1, len(design.floors))

    def seconds_of_fits(self, threads: int) -> float:
        drawn = 0 if self.fit.intervals in ("wald", "profile") and self.risk is None else self.fit.replicates
        seconds = 0.0
        for design in (self.design, *self.further.values()):
            alone = SECONDS_A_CURVE + SECONDS_A_MOTION * design.shakes
            motions = design.shakes / max(1, len(design.floors))
            per_replicate = SECONDS_A_REPLICATE + design.levels.size * (SECONDS_A_LEVEL + SECONDS_A_WEIGHT * motions)
            seconds += self._curves_of(design) * (alone + drawn * per_replicate / threads)
        return seconds

    @property
    def kept_outputs(self) -> tuple[str, ...]:
        held = (FLAG,) if any_held(self.blocks) else ()
        return tuple(dict.fromkeys((*self.fit.outputs, *self.outputs, *held)))

    @property
    def together(self) -> float:
        # (a slab is one block under one law at least)
        slab = max(super().together, SLAB_BYTES_A_RUN * self.design.runs)
        drawn = 0.0 if self.risk is None else REPLICATE_BYTES * self.fit.replicates
        ranked = 0.0 if self.measures is None else RANKED_BYTES
        # (the measure is held twice: by itself, and as a coordinate of the results)
        measured = 16.0 * len(self.blocks) * self.design.shakes if self.design.im in BLOCK_MEASURES else 0.0
        return slab + (CURVE_BYTES + drawn + ranked) * self.curves + measured

    @property
    def stored_bytes(self) -> float:
        # Further variables are the screen's outcome, the probability of sliding (if friction is given), and the
        # friction that a block needs, which is the same for all laws.
        given = self.friction.values() if isinstance(self.friction, Mapping) else [self.friction]
        known = all(isinstance(friction, FixedFriction) for friction in given)
        slides = 0 if self.friction is None else 1 if known else 4
        of_blocks = 8.0 * self.runs / len(self.models)
        of_curves = (STORED_BYTES + (0.0 if self.measures is None else RANKED_BYTES)) * self._curves_of(self.design)
        return (self.bytes_a_run + 1 + slides) * float(self.runs) + of_blocks + of_curves

    def _spread(
        self, of_study: FittedCurves, client: Runner, progress: Progress | None
    ) -> tuple[xr.Dataset, list[Fact]]:
        """Run the motions of branches, and return the rates over all branches, with notes on the branches' curves."""
        assert self.branches is not None
        assert self.risk is not None
        done = super().work
        facts: list[Fact] = []

        def fitted(name: str, design: Design) -> FittedCurves:
            nonlocal done
            part = part_of(progress, done, self.work)
            runs = design.run(self.blocks, self.models, self.fit.outputs, client, part)
            done += len(self.blocks) * len(self.models) * design.runs * design.about
            curves = self.fit.curves(runs, True, telling=client.tell)
            facts.extend(of_branch(name, self.fit.notes(curves, runs)))
            return FittedCurves(self.fit.modelled(curves), design.highest(runs), curves)

        spread = self.branches.of(of_study, fitted, self.risk, self.fit)
        beyond = spread[BEYOND].max([dim for dim in spread[BEYOND].dims if dim != "branch"]).values.tolist()
        return spread, [*facts, *branches_beyond_note(beyond, branch_names(spread))]

    def _strengths(self, client: Runner, progress: Progress | None) -> xr.Dataset:
        """Return the strengths that restraints need, from runs under the motions of the study."""
        done = self.work - self.searched_runs
        quick = replace(self.fit, replicates=100)

        def chances(held: Sequence[Block], law: Law) -> Array:
            nonlocal done
            runs = self.design.run(held, [law], self.fit.outputs, client, part_of(progress, done, self.work))
            done += len(held) * self.design.runs * self.design.about
            if self.risk is None:
                return np.asarray(self.fit.probabilities(runs)["probability"].values.ravel())
            risk, ends = replace(self.risk, along=None), (self.design.highest(runs), self.design.lowest(runs))
            curves = self.fit.modelled(quick.curves(runs, False))
            rates = risk.of(curves, self.fit.confidence, ends[0], self.fit.state, lowest=ends[1])
            flags = reached(runs, self.fit.state)
            fell = flags.any([dim for dim in flags.dims if dim not in ("block", "model")]).values.ravel()
            # (without a fall the runs show no more than how rarely it shakes more strongly)
            beyond = probability_in(rates[EXCEEDED].values.ravel(), risk.years)
            return np.where(fell, rates["risk_probability"].values.ravel(), beyond)

        return needed_strengths(self.blocks, self.models, self.targets, chances)

    def _with_curves(
        self, results: xr.Dataset, curves: xr.Dataset, parts: Iterable[xr.Dataset], facts: Iterable[Fact]
    ) -> xr.Dataset:
        """Return the results with the variables and attributes of all `parts`, attributes of the curves, and notes."""
        results = results.assign_attrs(
            fit_method=curves.attrs["method"],
            form=curves.attrs["form"],
            confidence=self.fit.confidence,
            state=state_name(self.fit.state),
            modelling=self.fit.modelling,
            **{MODELLING: self.fit.modelling_dispersion, RANGE: self.fit.modelling_dispersion or USUAL_DISPERSION},
        )
        variables: dict[Hashable, xr.DataArray] = {}
        for part in parts:
            variables |= part.data_vars
            results = results.assign_attrs(part.attrs)
        # (all at once: otherwise coordinates of a part would replace the coordinates of the runs)
        return results.assign(variables).assign_attrs(notes=stored(facts))

    def _rated(
        self, risk: Risk, curves: xr.Dataset, results: xr.Dataset, client: Runner, progress: Progress | None
    ) -> tuple[xr.Dataset, list[Fact]]:
        """Return the rates of fitted curves, over branches if there are any, and notes on them."""
        highest, lowest = self.design.highest(results), self.design.lowest(results)
        modelled = self.fit.modelled(curves)
        rates = risk.of(modelled, self.fit.confidence, highest, self.fit.state, client.tell, lowest=lowest)
        facts = risk.notes(rates, modelled, highest, self.configuration)
        facts += component_notes(self.configuration["motions"].get("component"), self.design.im)
        rates.attrs = {name: rates.attrs[name] for name in ("years", *SIZE) if name in rates.attrs}
        rates = rates.assign(risk.modelling_range(curves, self.fit.modelling_dispersion))
        compared = gains(modelled, risk, self.blocks, self.fit.confidence)
        if compared is not None:
            rates = rates.assign(compared.data_vars)
        if self.branches is not None:
            spread, of_branches = self._spread(FittedCurves(modelled, highest, curves), client, progress)
            facts += [*of_branches, *([SLIPS_WITHOUT_BRANCHES] if self.slides is not None else [])]
            rates = rates.assign(spread.data_vars)
        facts.append(modelling_note(self.fit.modelling_dispersion, self.fit.modelling))
        return rates, [*facts, *class_notes(self.fit.modelling_class)]

    def _compute(self, client: Runner, progress: Progress | None) -> xr.Dataset:
        results = self.design.run(self.blocks, self.models, self.kept_outputs, client, part_of(progress, 0, self.work))
        screened = screen(
            results,
            self.design.motions,
            self.friction,
            undecided=self.undecided,
            client=client,
            progress=part_of(progress, self.runs * self.design.about, self.work),
        )
        curves = self.fit.curves(results, self.risk is not None, telling=client.tell)
        forced = forced_to_1(self.blocks, self.fit.state, self.fit.form)
        attributes = {"screen": screened.attrs["screen"], **({FORCED: forced} if forced else {})}
        parts = [screened.drop_attrs(deep=False).assign_attrs(attributes)]
        if self.measures is not None:
            parts.append(ranked(results, self.design.motions, self.measures, self.fit.state))
        facts = [
            *axis_notes(results),
            *held_notes([block.label for block in self.blocks if self.design.about == 2 and block.surrounded]),
            *self.fit.notes(curves, results),
            *one_side_notes(self.blocks, self.fit.state, self.fit.form),
            *uplift_notes(self.blocks, self.models, self.fit.state, self.fit.form),
        ]
        falls: dict[str, xr.DataArray] = {}
        if self.risk is not None:
            rates, of_rates = self._rated(self.risk, curves, results, client, progress)
            parts.append(rates)
            falls |= {f"rate{end}": rates[f"rate{end}"] for end in ENDS if f"rate{end}" in rates}
            facts += of_rates
        if self.targets:
            parts.append(self._strengths(client, progress))
        chosen = self.selections
        if chosen is not None:
            parts.append(chosen)
            facts += selection_notes(chosen)
        elif isinstance(self.design, Stripes):
            facts.append(Fact("selection.none"))
        kept = without_replicates(curves).assign(range_of_half_levels(curves, self.fit.modelling_dispersion))
        named = kept.rename({name: f"curve_{name}" for name in OBSERVED if name in kept})
        parts.append(named.drop_attrs(deep=False))
        if self.design.levels.size:
            observed = self.fit.probabilities(results)
            falls["probability"] = observed["probability"]
            parts.append(observed.assign(self.fit.chances_of_range(kept, observed["level"])).drop_attrs(deep=False))
            if any_held(self.blocks):
                # (a hazard curve of a measure of each block is of no single level)
                hazard = None if self.risk is None or self.design.im in BLOCK_MEASURES else self.risk.hazard
                parts.append(ruptures(results, self.blocks, self.fit.confidence, hazard))
        if self.slides is not None:
            slid = self.slides.of(results, self.design.motions, self.blocks, self.fit, self.risk, falls, client)
            parts.append(slid.drop_attrs(deep=False))
            exact, labels = self.slides.exact(self.blocks), [str(value) for value in results["motion"].values]
            facts += slide_notes(slid, self.blocks, exact, labels, in_plane(results))
        facts += edge_notes(results, self.blocks, self.slides is not None, self.fit.state)
        if "floor" in curves.dims:  # (the dimension of the curves takes the name)
            results = results.rename(floor="motion_floor")
        return self._with_curves(results, curves, parts, [*facts, *screen_facts(screened, self.slides is not None)])
