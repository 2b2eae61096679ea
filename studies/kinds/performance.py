"""Performance studies: an inventory in a building, with joint outcomes under each motion."""

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
import xarray as xr

from ...core.aliases import Array, Progress
from ...core.doubts import Doubt
from ...core.facts import Fact, stored
from ...core.units import DIMENSIONLESS, ENDS
from ...core.wording import counted
from ...fragility import HazardCurve
from ...fragility.hazard.plausibility import branch_doubts, hazard_doubts
from ...fragility.numerics import slabs
from ...fragility.risk.modelling import USUAL_DISPERSION
from ...fragility.runs.request import part_of
from ...fragility.runs.runners import Runner
from ...fragility.runs.scaling import SCALE
from ...fragility.uncertainty.joint import PieceDraws, Variability, with_restitution
from ...fragility.validity.notes import screen_facts, squat_facts
from ...fragility.validity.plausibility import period_doubts
from ...fragility.validity.scenes import scene_facts
from ...models import Block, Law
from ...models.oscillator import Oscillator
from ...models.plausibility import stated_restitution_doubts, still_doubts
from ...motions import Building, Generator
from ...motions.arrays import BOTH_AXES, POLARITY
from ...motions.floors.histories import FloorHistories
from ...motions.plausibility import unusual
from ...motions.polarity import AS_RECORDED, BOTH
from ..buildings.anchoring import anchoring
from ..buildings.assessment import (
    Assessment,
    assess,
    check_drawn,
    described,
    distinct_runs,
    polarity_of,
    refuse_modelling,
    tells_sides,
)
from ..buildings.axes import axes_notes, placed_on_axes, sideways_notes
from ..buildings.branches import BEYOND, InventoryBranch, Sampling, combinations, rates_over_branches
from ..buildings.modelling import DRAWS, MOST_POINTS, scored_levels
from ..buildings.notes import UNDIRECTED, hazard_notes, hazard_shares, inventory_notes, notes, polarity_notes
from ..buildings.pieces import RANKING, budget_set, code_variables
from ..buildings.screening import runs_of_tests, screen_inventory
from ..buildings.shaking import Shaking
from ..buildings.slide_runs import Slipping, draws_of, falls_off, number_of_slides, slides
from ..buildings.sliding import item_slide_notes
from ..buildings.variables import ANNUAL_SAVING, JOINT, fall_flags, range_of_a_year, variable
from ..codes.asce7 import Asce7
from ..codes.check import Code
from ..facts.notes import of_branch
from ..file.analyses import LevelsTable, PerformanceTable
from ..file.hazard import OF_MOTIONS
from ..file.schema import StudyFile
from ..inventory.consequences import COLUMNS, DRAWN_BYTES, REALISATIONS, SAFETY
from ..inventory.contents import Contents, Inventory, Stand, place_doubts, row_doubts
from ..inventory.kits import Kit
from ..inventory.reading import read_inventory
from ..kits.savings import kit_savings, with_kit
from ..plan.branches import BRANCH_COORDINATES
from ..plan.estimates import MEAN as IN_MEAN
from ..plan.piece_classes import class_notes
from ..plan.reading import Reading
from ..plan.slides import INSTEAD
from ..text.curve_notes import SLIPS_WITHOUT_BRANCHES, branches_beyond_note, level_modelling_note, modelling_note
from ..text.spread import branch_names
from ..text.words import level_text
from .branches import weighted_hazards, weighted_laws, weighted_motions
from .kits import candidates, kit_doubts, kit_notes, kits_of, scenes_of, with_kit_sets
from .level_floors import (
    LevelFloors,
    Motions,
    arrays_of,
    check_levels,
    in_si,
    level_floors,
    levels_of,
    motion_notes,
    named_levels,
    number_of,
    read_histories,
    reading_of,
    refuse_scaling,
    strikes,
    what_yields,
)
from .study import SLAB_BYTES_A_RUN, Study, each, perturbed_words, plain, screening_of

OSCILLATOR_BYTES = 5500.0
"""Most memory of an oscillator, with its description in the runs of its floor."""
USUAL = Slipping()
SMALLER = (0.04, 0.03, 0.02, 0.01)
"""Half widths of an elastic zone that a refusal tries."""
DECIDED = ("code_", "budget_", "target_", "kit_cost")
"""Beginnings of the names of the variables that keys decide which change no run."""


@dataclass(frozen=True)
class PerformanceStudy(Study):
    """An inventory in a building under the same motions.

    `motions` are of the ground, or histories of all floors. `levels` are of the measure `im`, or a plain factor of 1
    for a scenario; `hazard` is given if annual values are wanted. `objective` is the quantity that anchoring saves,
    given the level `at` without a hazard. `undirected`: the inventory gives directions that no motion has. `kits` are
    tried on all pieces that they fit, of which the cheapest set is chosen for the `target`. `polarity`: polarity of the
    motions, also of branches and under kits. `axes`: axes of pairs of components, '' for one component; `of_axes`:
    notes on the axes about which lines are run. `of_levels`: if the building or a platform yields, the floors at each
    level, which are `motions`; `building` is then the building before it yields, for codes alone. `struck`: the input
    warnings on the clearances of platforms.
    """

    inventory: Inventory
    asked: PerformanceTable
    models: tuple[Law, ...]
    building: Building | None
    motions: Motions
    im: str
    levels: Array
    hazard: HazardCurve | None
    variability: Variability | None
    objective: str
    at: float | None
    safety: tuple[str, ...]
    code: Code | None = None
    generator: Generator | None = None
    undecided: float = 0.0
    branches: "InventoryBranches | None" = None
    undirected: bool = False
    kits: tuple[Kit, ...] = ()
    target: dict[str, float] | None = None
    polarity: str = AS_RECORDED
    axes: str = ""
    of_axes: tuple[Fact, ...] = ()
    of_levels: LevelFloors | None = None
    struck: tuple[Doubt, ...] = ()
    slipping: Slipping = USUAL
    kind: ClassVar[str] = "performance"

    @classmethod
    def of(cls, content: StudyFile, folder: Path) -> Self:
        asked = content.performance
        assert asked is not None  # (the table makes it this kind of study)
        building = None if content.building is None else content.building.made()
        known_kits = kits_of(content)
        sliding = None if content.friction is None else content.friction.build()
        stands = {support.name: Stand(support.name, support.made()) for support in content.supports or []}
        if asked.kits and content.hazard is None and asked.modelling_dispersion > 0.0:
            raise ValueError("performance.kits with modelling_dispersion need a [hazard]: savings at a level hold none")
        on_floors = any(content.motions.given(key) is not None for key in ("floors_file", "floors_index"))
        if not on_floors:  # (errors in the inventory are raised before motions are made)
            known = ["0"] if building is None else [str(floor) for floor in building.floors]
            inventory = read_inventory(folder / asked.inventory, known, known_kits, sliding, stands)
        about = content.hazard is None and asked.modelling_dispersion > 0.0
        refuse_scaling(content.motions, "" if asked.levels is None else "performance.levels", about)
        histories = read_histories(content.motions, asked, folder)
        levels_asked = asked.levels
        if histories is not None and histories.unit and not histories.elastic:
            levels_asked = levels_of(histories)
        if levels_asked is None:
            if "im" in asked.model_fields_set:
                raise ValueError("performance.im needs performance.levels: without them the motions are as they are")
            im, levels = SCALE, np.ones(1)
        else:
            im, levels = asked.im, levels_asked.build(asked.im)
            content.motions.refuse_moving(folder, im)
        hazard = None if content.hazard is None else content.hazard.build(im, folder)
        at = None
        if hazard is None:
            at = float(levels[levels.size // 2])
            if asked.at_level is not None:
                at = _level_of(levels, asked.at_level, levels_asked, im)
        elif asked.at_level is not None:
            raise ValueError("performance.at_level does not go with a hazard: the ranking is of a year")
        motions: Motions = tuple(content.motions.build(folder)) if histories is None else in_si(histories, im, levels)
        of_levels = None if on_floors else _of_levels(content, folder, inventory, motions, im, levels)
        motions = motions if of_levels is None else of_levels.histories
        shaking = Shaking.of(None if of_levels is not None else building, motions, None, im == SCALE)
        if shaking.axes:
            shaking.scaled(levels, im)  # a measure of one component is an error before any run
        if on_floors:
            inventory = read_inventory(folder / asked.inventory, shaking.known, known_kits, sliding, stands)
        unused = [name for name in stands if name not in {row.stand.name for row in inventory.rows if row.stand}]
        if unused:
            raise ValueError(f"supports {unused[0]!r} carries nothing: name it in the inventory under 'support'")
        given_directions, as_read = any(row.direction for row in inventory.rows), inventory
        laws = each("models", content.models)
        inventory = placed_on_axes(inventory, shaking, laws)
        _refuse_modelling(asked.modelling_dispersion, inventory, shaking, hazard is not None)
        try:
            code = None if asked.code is None else asked.code.of(building)
        except ValueError as error:
            raise ValueError(f"performance.code: {error}") from None
        for row in inventory.rows:
            if isinstance(code, Asce7) and row.code_importance not in (None, 1.0, 1.5):
                raise ValueError(
                    f"code_importance must be 1.0 or 1.5 by 'asce7-22' (13.1.3), got {row.code_importance:g} for "
                    f"{row.label!r}"
                )
        kits = candidates(asked, known_kits, inventory)
        sided = any(kit.on(row).block.sided for kit in kits for row in inventory.rows if kit.fits(row))
        if asked.budget is not None and not kits and all(row.anchoring_cost is None for row in inventory.rows):
            raise ValueError("performance.budget needs anchoring_cost in the inventory, which gives none")
        given = any(row.drawn for row in inventory.rows)
        if "consequence_correlation" in asked.model_fields_set and not given:
            raise ValueError(
                "performance.consequence_correlation is of cost_median, downtime_median_days and injury_probability in "
                "the inventory, which gives none"
            )
        slipping = Slipping()
        if sliding is not None and content.friction is not None:
            slipping = Slipping(sliding.distances, content.friction.shared is not False)
        study = cls(
            content.title,
            plain(content),
            inventory,
            asked,
            laws,
            building,
            motions,
            im,
            levels,
            hazard,
            asked.variability.build() if asked.variability is not None else None,
            asked.objective or ("loss" if inventory.value > 0.0 else "number"),
            at,
            SAFETY if asked.safety is None else tuple(asked.safety),
            code,
            content.motions.made_by(folder),
            screening_of(content)[1],
            kits=kits,
            target=None if asked.target is None else asked.target.limits,
            polarity=asked.polarity or (BOTH if sided else polarity_of(inventory)),
            axes=shaking.axes,
            of_axes=tuple(axes_notes(inventory, as_read, shaking.axes)),
            of_levels=of_levels,
            struck=tuple(strikes(inventory, shaking)),
            slipping=slipping,
        )
        study = replace(study, branches=_branches(content, folder, study, as_read))
        used = [inventory, *(contents.inventory for contents in study.further.values())]
        directed = any(row.direction for contents in used for row in contents.rows)
        study = replace(study, undirected=given_directions and not directed)
        allowed = (*(["loss"] if inventory.value > 0.0 else []), "number", "any", *inventory.consequences)
        if study.objective not in allowed:
            raise ValueError(f"performance.objective must be one of {', '.join(allowed)}, got {study.objective!r}")
        of_word = study.objective in inventory.consequences
        if all(row.anchored for row in inventory.rows if not of_word or study.objective in row.consequences):
            raise ValueError(
                f"performance.objective: nothing is left to be anchored that counts for {study.objective!r}: set "
                "anchored to no for a line of the inventory, or name another objective"
            )
        check_drawn(inventory, study.realisations)
        for word in asked.safety or ():
            if word not in inventory.consequences:
                words = ", ".join(inventory.consequences) or "none"
                raise ValueError(f"performance.safety must name consequences in the inventory ({words}), got {word!r}")
        pieces = [(row, model) for row in inventory.rows for model in study.models if row.e is None]
        held = [(kit.on(row), model) for row, model in pieces for kit in kits if kit.fits(row)]
        _check_laws([*pieces, *held])
        return study

    @property
    def shakes(self) -> int:
        """Number of motions of each level."""
        return number_of(self.motions)

    @property
    def words(self) -> str:
        of = f"{counted(self.inventory.pieces, 'piece')} in {counted(len(self.inventory), 'line')}"
        levels = "" if self.im == SCALE else f" × {counted(self.levels.size, 'level')}"
        ways = " both ways" if self.both_ways else ""
        ways += " about both axes" if self.axes == BOTH_AXES else ""
        shaken = f"{counted(len(self.models), 'law')} × {counted(self.shakes, 'motion')}{ways}{levels}"
        about = "" if self.levels_run == self.levels.size else f" (at {self.levels_run:,} levels about them)"
        held = f", of them {self.kit_runs:,} with {counted(len(self.kits), 'kit')}" if self.kits else ""
        other = f", and {self.further_runs:,} under the motions of {counted(len(self.further), 'branch')}"
        return (
            f"{of} × {shaken}{about} = {counted(self.runs, 'run')}{held}{perturbed_words(self.perturbed_runs)}"
            f"{other if self.further_runs else ''}"
        )

    @property
    def levels_run(self) -> int:
        """Number of levels that are run: with modelling uncertainty at given levels several about each."""
        if self.hazard is not None or self.asked.modelling_dispersion == 0.0:
            return int(self.levels.size)
        return int(scored_levels(self.levels, self.asked.modelling_dispersion)[0].size)

    @property
    def runs(self) -> int:
        return self._runs_of(self.motions, self.inventory) * self.levels_run + self.kit_runs

    @cached_property
    def kit_runs(self) -> int:
        """Number of runs with kits."""
        return sum(self._runs_of(self.motions, held) for held in self._held) * int(self.levels.size)

    @property
    def _held(self) -> list[Inventory]:
        """The inventory with each kit that fits a piece."""
        return [held for kit in self.kits if (held := with_kit(self.inventory, kit)) is not None]

    @property
    def sides(self) -> bool:
        """True if forward falls are distinguished."""
        return bool(self.kits) or tells_sides(self.inventory)

    def _runs_of(self, motions: Motions, inventory: Inventory) -> int:
        return distinct_runs(inventory, self.variability, self.polarity) * len(self.models) * number_of(motions)

    @property
    def slide_runs(self) -> int:
        of_study = self._slides_of(self.motions, self.inventory) * self.levels_run
        others = sum(self._slides_of(self.motions, held) for held in self._held)
        others += sum(self._slides_of(branch.motions, branch.inventory) for branch in self.further.values())
        return of_study + others * int(self.levels.size)

    def _slides_of(self, motions: Motions, inventory: Inventory) -> int:
        per_motion = number_of_slides(inventory, self.models[0], self.variability, self.in_plane)
        return per_motion * number_of(motions)

    @property
    def in_plane(self) -> bool:
        return bool(self.axes)

    @property
    def further(self) -> "dict[str, ShakenBy]":
        """The motions of branches in addition to the study's own, by name."""
        return {} if self.branches is None else self.branches.further

    @property
    def further_runs(self) -> int:
        """Number of runs under the motions of branches."""
        return sum(self._runs_of(branch.motions, branch.inventory) for branch in self.further.values()) * int(
            self.levels.size
        )

    @property
    def perturbed_runs(self) -> int:
        """Number of further runs that test which outcomes are undecided."""
        levels, motions = self.levels.size, self.shakes
        if isinstance(self.motions, FloorHistories):
            levels, motions = self.motions.run_shape(levels)
        motions *= self.polarities
        return runs_of_tests(self.inventory, self.models, levels, motions, self.undecided, self.variability)

    @property
    def work(self) -> int:
        return self.runs + self.perturbed_runs + self.further_runs

    @property
    def stored_bytes(self) -> float:
        sideways = any(row.both_axes for row in self.inventory.rows)
        # flags of overturning are kept in addition to flags of all falls if anything can fall off
        return (1.0 + self.sides + sideways + self._edges) * self._flags + 8.0 * self._outcomes

    @property
    def together(self) -> float:
        variants = self.variants
        motions = self._shaken / len(self.models) / self.levels.size
        # lines are processed in slabs, at least one line under one law with all its levels
        of_one = max(min(self._flags, slabs.RUNS), self.levels.size * motions)
        oscillators = distinct_runs(self.inventory, self.variability) * len(self.models)
        of_lines = 300.0 * len(self.models) * len(self.inventory) * self.levels.size
        drawn = 16.0 * self.asked.replicates * motions
        drawn += (
            DRAWN_BYTES * self.realisations * max((row.count for row in self.inventory.rows if row.drawn), default=0)
        )
        fillings = 0 if self.draws is None else self.draws.realisations
        draws = 8.0 * variants * motions * (1 + 3 * fillings)
        return SLAB_BYTES_A_RUN * of_one + OSCILLATOR_BYTES * oscillators + of_lines + drawn + draws

    @property
    def arrays_aside(self) -> list[float]:
        of_places = 8.0 * self._shaken * (1 + len({str(row.floor) for row in self.inventory.rows}))
        of_lines = 8.0 * len(self.models) * len(self.inventory)
        of_motions = of_lines * self._shaken / len(self.models) / self.levels.size
        if isinstance(self.motions, FloorHistories) and self.motions.own_motions:
            of_motions *= self.levels.size
        # expectations and chances of any fall and of each consequence; savings by anchoring and their ranks
        consequences = len(self.inventory.consequences)
        anchored = [of_motions] * 4 + [of_lines * self.asked.replicates] * 2
        # flips of all lines, and of those that are run
        flips = [self.undecided * self._flags, *super().arrays_aside]
        arrays = flips + [of_places] * (3 + self._drawn)
        arrays += ([of_places * consequences] if consequences else []) + anchored
        # runs with kits: flags, and expectations in each place, kit after kit
        arrays += [self._flags] * 2 + [of_places] * 3 if self.kits else []
        # slips: counts of variants that slide and slip so far, and flags of variants that fall off
        sliding = sum(map(slides, self.inventory.rows)) / len(self.inventory)
        if sliding:
            of_flags = sliding * self._flags / self.variants / len(self.models)
            arrays += [2.0 * (1 + len(self.slipping.distances)) * of_flags, self._edges * self.variants * of_flags]
            near = sum(slides(row) and row.obstacle is not None for row in self.inventory.rows)
            arrays.append(2.0 * near / sum(map(slides, self.inventory.rows)) * of_flags)
        # the motions of branches: flags and outcomes of each; classes of pieces joined in draws of their capacities
        for branch in self.further.values():
            share = number_of(branch.motions) / self.shakes
            arrays += [share * self._flags, 8.0 * share * self._outcomes]
        if self.asked.modelling_dispersion > 0.0:
            points = max(self.levels_run, MOST_POINTS) / self.levels.size
            arrays += [of_places * points * DRAWS] * (2 + self._drawn)
        return arrays

    @property
    def _shaken(self) -> int:
        return len(self.models) * self.levels.size * self.shakes * self.polarities

    @property
    def polarities(self) -> int:
        """Outcomes of each motion: 2 if motions are run both ways, else 1."""
        return 2 if self.both_ways else 1

    @property
    def both_ways(self) -> bool:
        return self.polarity == BOTH

    @property
    def _flags(self) -> float:
        """Number of flags of all lines; lines that are alike count each."""
        return float(len(self.inventory) * self._shaken * self.variants)

    @property
    def _outcomes(self) -> float:
        """Number of outcomes in the building and on each floor, motion by motion, of all quantities."""
        places = 1 + len({str(row.floor) for row in self.inventory.rows})
        plain = 1 if self.draws is None else self.draws.realisations
        return float(places * self._shaken * (2 * plain + self._drawn * self.realisations))

    @property
    def realisations(self) -> int:
        """Number of fillings of the building, or of draws of costs, downtimes and injuries."""
        return REALISATIONS if self.draws is None else self.draws.realisations

    @property
    def draws(self) -> PieceDraws | None:
        """Rules for drawing pieces from variants, None if pieces of a line are alike."""
        return draws_of(self.inventory, self.variability, self.slipping, self.asked.seed)

    @property
    def variants(self) -> int:
        """Number of variants of each line."""
        return 1 if self.draws is None else self.draws.variants

    @property
    def _edges(self) -> int:
        """1 if anything can fall off an edge, else 0."""
        return int(any(map(falls_off, self.inventory.rows)))

    @property
    def _drawn(self) -> int:
        """Number of quantities that are drawn."""
        return sum(any(getattr(row, name) is not None for row in self.inventory.rows) for name in COLUMNS)

    @property
    def may_slide(self) -> bool:
        return any(map(slides, self.inventory.rows))

    @property
    def of_each_law(self) -> list[Oscillator]:
        return [model.oscillator(self.inventory.rows[0].block) for model in self.models]

    @property
    def cases(self) -> Iterable[tuple[str, Block, Law]]:
        laws = list(enumerate(self.models, start=1))
        return (
            (f"models[{i}]", row.block, with_restitution(law, row.e)) for row in self.inventory.rows for i, law in laws
        )

    @property
    def facts(self) -> list[Fact]:
        scenes = scenes_of(self.inventory, self.kits)
        facts = inventory_notes(self.inventory, self.safety, self.code is not None)
        facts += scene_facts(scenes)
        facts += kit_notes(self.inventory, self.kits)
        facts += polarity_notes(scenes, self.polarity)
        elastic, yields = bool(self.configuration["motions"].get("elastic")), self.of_levels is not None
        facts += motion_notes(self.motions, self.inventory, elastic, yields)
        for name, branch in self.further.items():
            facts += of_branch(name, motion_notes(branch.motions, branch.inventory, branch.elastic, yields))
        if self.undirected:
            facts.append(UNDIRECTED)
        return [*super().facts, *facts, *self.of_axes]

    @property
    def squat(self) -> list[Fact]:
        return squat_facts([replace(row.block, name=row.label) for row in self.inventory.rows])

    @property
    def doubts(self) -> list[Doubt]:
        others = [doubt for shaken in self.further.values() for doubt in shaken.reading.doubts]
        far = self.reading.far if self.im == SCALE else ()
        of_motions = (*self.reading.doubts, *self.struck)
        named = {} if self.branches is None else {branch.hazard_name: branch.hazard for branch in self.branches.every}
        hazards = [] if self.hazard is None else [self.hazard, *named.values()]
        # (branches share hazards)
        of_hazards = dict.fromkeys(doubt for hazard in hazards for doubt in hazard_doubts(hazard))
        pieces = [*stated_restitution_doubts(self.models), *row_doubts(self.inventory.rows)]
        spread, rate = self.variability, self.asked.discount_rate
        scatter = (0.0, 0.0) if spread is None else (spread.restitution_sd, spread.slenderness_dispersion)
        names = "standard deviation of the restitution", "dispersion of the slenderness", "discount rate"
        pieces += unusual(dict(zip(names, (*scatter, rate), strict=True)), "units")
        if self.building is not None:
            pieces += place_doubts(self.inventory.rows, self.building.heights.tolist())
        kits = kit_doubts(self.inventory, self.kits, self.target or {})
        if self.im == SCALE:
            blocks = [row.block for row in self.inventory.rows]
            pieces += still_doubts(blocks, (float(abs(array.values).max()) for array in self.arrays))
        apart = [] if self.im == SCALE else branch_doubts(named, self.levels)
        return [
            *self.of_tables,
            *pieces,
            *kits,
            *period_doubts(self.im),
            *of_motions,
            *far,
            *of_hazards,
            *apart,
            *others,
        ]

    @cached_property
    def reading(self) -> Reading:
        if self.of_levels is not None:
            return self.of_levels.reading
        return reading_of(self.motions, self.generator, self.building)

    @property
    def arrays(self) -> Sequence[xr.DataArray]:
        further = [array for branch in self.further.values() for array in arrays_of(branch.motions)]
        return [*arrays_of(self.motions), *further]

    @property
    def site_hazard(self) -> HazardCurve | None:
        return self.hazard

    @property
    def _read(self) -> list[Any]:
        rows = [described(row) for row in self.inventory.rows]
        others = [] if self.branches is None else [asdict(branch.hazard) for branch in self.branches.every]
        read: list[Any] = [
            rows,
            self.inventory.currency,
            None if self.hazard is None else asdict(self.hazard),
            *others,
            *([BOTH] if self.both_ways else []),
        ]
        # the levels of floor histories are in their index
        if isinstance(self.motions, FloorHistories):
            read.append(self.motions.levels.tolist())
        for branch in self.further.values():
            if isinstance(branch.motions, FloorHistories):
                read += [branch.motions.levels.tolist(), [row.direction for row in branch.inventory.rows]]
        return read

    @property
    def _elastic(self) -> Building | None:
        """The building that ground motions go through as they are run; None if they went through it before."""
        return self.building if self.of_levels is None else None

    @property
    def _in_mean(self) -> float:
        """beta_m if means include it, else 0."""
        return self.asked.modelling_dispersion if self.asked.modelling == IN_MEAN else 0.0

    @property
    def _assessment(self) -> Assessment:
        """Options of the assessment of the inventory, as it is and with each kit."""
        return Assessment(
            self.models,
            self.motions,
            self.levels,
            self.im,
            self._elastic,
            self.hazard,
            variability=self.variability,
            modelling_dispersion=self._in_mean,
            slipping=self.slipping,
            consequence_correlation=self.asked.consequence_correlation,
            replicates=self.asked.replicates,
            seed=self.asked.seed,
            polarity=self.polarity,
        )

    def _compute(self, client: Runner, progress: Progress | None) -> xr.Dataset:
        asked = self.asked
        part = part_of(progress, 0, self.work)
        assessed = assess(self.inventory, self._assessment, sides=self.sides, client=client, progress=part)
        held = self._with_kits(assessed, client, progress)
        part = part_of(progress, self.runs, self.work)
        flags, share = assessed["overturned"], self.undecided
        screened = screen_inventory(self.inventory, self._assessment, flags, share, client, part)
        spread, facts = self._spread(assessed, client, progress)
        drawn: dict[str, Any] = {"replicates": asked.replicates, "seed": asked.seed}
        ranked = anchoring(assessed, self.objective, level=self.at, **drawn, array=client.array)
        if self.inventory.carried and "annual_loss" in assessed:
            of_money = anchoring(assessed, "loss", **drawn, array=client.array)
            of_all = of_money.reindex(block=assessed["block"])
            assessed = assessed.assign({f"{ANNUAL_SAVING}{end}": of_all[f"saving{end}"] for end in ENDS})
        whole = ranked.reindex(block=assessed["block"])
        facts = [*notes(assessed), *sideways_notes(assessed), *item_slide_notes(assessed, self.inventory), *facts]
        if self.hazard is not None:
            if self._in_mean != asked.modelling_dispersion:
                ends = range_of_a_year(assessed.data_vars, self.levels, self.hazard, asked.modelling_dispersion)
                assessed = assessed.assign(ends)
            assessed = assessed.assign(hazard_shares(assessed, self.hazard))
            facts += [*hazard_notes(assessed, self.hazard), modelling_note(asked.modelling_dispersion, asked.modelling)]
        elif asked.modelling_dispersion > 0.0:
            facts.append(level_modelling_note(asked.modelling_dispersion))
        facts += class_notes(asked.modelling_class)
        if self.at is not None and self.levels.size > 1 and "at_level" not in self.configuration["performance"]:
            middle = level_text(self.at, assessed["level"])
            facts.append(Fact("building.middle_level", names=(middle,)))
        if self.of_levels is not None:
            assessed = assessed.assign(self.of_levels.variables(self.polarities))
        rankings = {f"{RANKING}{name}": variable for name, variable in whole.data_vars.items()}
        ways = {POLARITY: assessed[POLARITY]} if POLARITY in assessed.coords else {}
        results = (
            assessed.assign({**rankings, **screened.data_vars, **spread.data_vars, **held.data_vars})
            .assign_coords(held.coords)
            .assign_coords(reason=screened["reason"])
            .assign_coords({name: spread.coords[name] for name in BRANCH_COORDINATES if name in spread.coords})
            .assign_attrs(
                ranking=json.dumps({name: ranked.attrs[name] for name in ranked.attrs if name not in assessed.attrs}),
                screen=screened.attrs["screen"],
                notes=stored([*facts, *screen_facts(screened.assign_coords(ways), INSTEAD in assessed)]),
                modelling_dispersion=asked.modelling_dispersion,
                modelling_range=asked.modelling_dispersion or USUAL_DISPERSION,
                modelling=asked.modelling,
                **({} if self.at is None else {"at_level": self.at}),
            )
        )
        return self._decided(results)

    def _decided(self, results: xr.Dataset) -> xr.Dataset:
        asked = self.asked
        earlier = [name for name in results.data_vars if str(name).startswith(DECIDED)]
        kept = results.drop_vars(earlier).assign_attrs(
            safety=JOINT.join(self.safety), sort=asked.sort, discount_rate=asked.discount_rate
        )
        for name in ("code", "code_site", "budget", "target"):
            kept.attrs.pop(name, None)
        if self.code is not None:
            coded = code_variables(self.inventory, self.code, self.building, (*SAFETY, *self.safety))
            kept = kept.assign(coded).assign_attrs(code=self.code.title, code_site=self.code.site)
        if not self.kits:
            return kept if asked.budget is None else _with_set(kept, asked.budget)
        costs = np.array([np.nan if kit.cost is None else kit.cost for kit in self.kits])
        text, money = "cost of fixing a piece with the kit", kept["anchoring_cost"].attrs["units"]
        return with_kit_sets(kept.assign(kit_cost=variable(("kit",), costs, money, text)), asked.budget, self.target)

    def _with_kits(self, assessed: xr.Dataset, client: Runner, progress: Progress | None) -> xr.Dataset:
        """Run the inventory with each kit, and return the savings."""
        if not self.kits:
            return xr.Dataset()
        done = part_of(progress, self.runs - self.kit_runs, self.work)
        return kit_savings(self.inventory, self.kits, assessed, self._assessment, self.at, client, done)

    def _spread(self, of_study: xr.Dataset, client: Runner, progress: Progress | None) -> tuple[xr.Dataset, list[Fact]]:
        """Run the motions of branches, and return the rates over all branches, with notes on the branches."""
        if self.branches is None:
            return xr.Dataset(), []
        asked = self.asked
        done = self.runs + self.perturbed_runs
        assessed = {OF_MOTIONS: of_study}
        facts: list[Fact] = []
        for name, branch in self.further.items():
            of_branch_alone = replace(self._assessment, motions=branch.motions, hazard=None, modelling_dispersion=0.0)
            part = part_of(progress, done, self.work)
            assessed[name] = assess(branch.inventory, of_branch_alone, client=client, progress=part)
            done += self._runs_of(branch.motions, branch.inventory) * int(self.levels.size)
            if not bool(fall_flags(assessed[name]).any()):
                facts.append(Fact("rate.no_falls_under", names=(name,)))
        spread, beta = asked.modelling != IN_MEAN, asked.modelling_dispersion
        correlation = asked.consequence_correlation
        sampling = Sampling(asked.replicates, asked.seed, beta, spread, self.draws, correlation)
        rates = rates_over_branches(self.branches.every, assessed, self.inventory, sampling)
        of_slips = [SLIPS_WITHOUT_BRANCHES] if self.may_slide else []
        return rates, [*facts, *branches_beyond_note(rates[BEYOND].values.tolist(), branch_names(rates)), *of_slips]


class ShakenBy(NamedTuple):
    """The motions of a branch, their reading, the inventory on them, and True if histories are scaled as if elastic."""

    motions: Motions
    reading: Reading
    inventory: Inventory
    elastic: bool


class InventoryBranches(NamedTuple):
    """All combinations of a study's branches, and the motions in addition to the study's own, by name."""

    every: list[InventoryBranch]
    further: dict[str, ShakenBy]


def _branches(
    content: StudyFile, folder: Path, study: PerformanceStudy, inventory: Inventory
) -> InventoryBranches | None:
    """Return the weighted branches of a study, None if it has none; `inventory` has the directions as read."""
    spread = study.asked.modelling != IN_MEAN and study.asked.modelling_dispersion > 0.0
    if study.hazard is None or (content.branches is None and not spread):
        return None
    motions = weighted_motions(content, lambda other: _shaken_by(other, folder, study, inventory))
    hazards = weighted_hazards(content, study.hazard, study.im, folder)
    shares = {name: weight for name, (_, weight) in motions.items()}
    every = combinations(weighted_laws(content, study.models), shares, hazards)
    return InventoryBranches(every, {name: made for name, (made, _) in motions.items() if made is not None})


def _shaken_by(content: StudyFile, folder: Path, study: PerformanceStudy, inventory: Inventory) -> ShakenBy:
    """Make the motions of a branch; ValueError if they do not reach the study's levels as they are."""
    table, asked = content.motions, content.performance
    assert asked is not None  # (the table makes it this kind of study)
    table.refuse_moving(folder, study.im)
    histories = read_histories(table, asked, folder)
    if histories is not None:
        histories = in_si(histories, study.im, study.levels)
    motions: Motions = tuple(table.build(folder)) if histories is None else histories
    of_levels = None
    if study.of_levels is not None:
        of_levels = _of_levels(content, folder, inventory, motions, study.im, study.levels)
        motions = motions if of_levels is None else of_levels.histories
    shaking = Shaking.of(study._elastic, motions, None, study.im == SCALE)
    refuse_scaling(table, "the levels of shaking")
    if shaking.axes != study.axes:
        raise ValueError("must shake about the same axes: give component, and axes, as in [motions]")
    placed = placed_on_axes(inventory, shaking, study.models)
    if histories is not None and not histories.elastic:
        named = named_levels(histories)
        if not named or not np.array_equal(histories.levels, study.levels):
            raise ValueError(
                f"floor histories are used at their own levels ({named or 'none in their index'}), which are not those "
                "of the study"
            )
    _refuse_modelling(study.asked.modelling_dispersion, placed, shaking, study.hazard is not None)
    reading = of_levels.reading if of_levels else reading_of(motions, table.made_by(folder), study._elastic)
    reading = reading._replace(doubts=(*reading.doubts, *strikes(placed, shaking)))
    return ShakenBy(motions, reading, placed, bool(table.given("elastic")))


def _of_levels(
    content: StudyFile, folder: Path, inventory: Inventory, motions: Motions, im: str, levels: Array
) -> LevelFloors | None:
    """Return the floors of each level if the building or a platform yields, else None."""
    asked, what = content.performance, what_yields(content.building, inventory)
    assert asked is not None  # (the table makes it this kind of study)
    if what:
        check_levels(what, asked, content.hazard is not None)
    if not what or isinstance(motions, FloorHistories):
        return None
    if content.motions.given("floors_file") is not None:
        raise ValueError(f"{what} needs ground motions, or floor histories of each level (motions.floors_index)")
    unit = "" if asked.levels is None else asked.levels.unit
    return level_floors(content.building, inventory, motions, content.motions.made_by(folder), im, levels, unit)


def _refuse_modelling(beta: float, inventory: Inventory, shaking: Shaking, yearly: bool) -> None:
    """Raise the errors of `refuse_modelling`, with the name of the key."""
    try:
        refuse_modelling(beta, inventory, shaking, yearly)
    except ValueError as error:  # (its message begins with the name of an argument)
        raise ValueError(f"performance.{error}") from None


def _check_laws(pieces: Sequence[tuple[Contents, Law]]) -> None:
    """Raise a ValueError that names all lines to which the first law that does not apply to all of them does not."""
    wrong = [(row, law, why) for row, law in pieces if (why := _law_error(law, row))]
    if not wrong:
        return
    row, law, why = wrong[0]
    alike = [faulty for faulty, other, _ in wrong if other is law]
    labels = dict.fromkeys(
        f"{faulty.label!r} with kit {faulty.kit!r}" if faulty.kit else repr(faulty.label) for faulty in alike
    )
    works, of = "", ""
    if len(labels) > 1:
        works, of = _smaller_zone(law, [faulty for faulty, other in pieces if other is law]), f"{row.label!r}: "
    raise ValueError(f"inventory: {', '.join(labels)} under {law.label}{works}: {of}{why}")


def _smaller_zone(law: Law, rows: Sequence[Contents]) -> str:
    """Return in words a half width of the elastic zone with which a law applies to all rows; '' if none does."""
    if not hasattr(law, "delta"):
        return ""
    for delta in SMALLER:
        narrow = replace(law, delta=delta)  # type: ignore[type-var]
        if not any(_law_error(narrow, row) for row in rows):
            return f" (delta = {delta:g} does)"
    return ""


def _law_error(law: Law, row: Contents) -> str:
    """Return why a law does not apply to a line, '' if it does."""
    try:
        law.oscillator(row.block)
    except ValueError as error:
        return str(error)
    return ""


def _with_set(results: xr.Dataset, budget: float) -> xr.Dataset:
    """Return the results with the lines to anchor for the budget under each law."""
    choices = [budget_set(results, budget, k) for k in range(results.sizes["model"])]
    chosen = np.stack([choice.chosen for choice in choices])
    gaps = np.array([max(choice.gaps) for choice in choices])
    text = "by how much the best of all sets can be better, relative to this one"
    variables = {
        "budget_chosen": variable(("model", "block"), chosen, DIMENSIONLESS, "whether it is anchored for the budget"),
        "budget_gap": variable(("model",), gaps, DIMENSIONLESS, text),
    }
    return results.assign(variables).assign_attrs(budget=budget)


def _level_of(levels: Array, asked: float, table: LevelsTable | None, im: str) -> float:
    """Return the level of the ranking; ValueError if it is not among the levels."""
    if table is None:
        raise ValueError("performance.at_level needs performance.levels")
    at = float(LevelsTable(values=[asked], unit=table.unit).build(im)[0])
    near = levels[np.isclose(levels, at, rtol=1e-9)]
    if not near.size:
        raise ValueError(f"performance.at_level must be one of the levels, got {asked:g} {table.unit}")
    return float(near[0])
