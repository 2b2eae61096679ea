"""Performance studies: an inventory in a building, shaken jointly."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
import xarray as xr

from ...aliases import Array, Progress
from ...doubts import Doubt, noted
from ...fragility import HazardCurve
from ...fragility import notes as screen_notes
from ...fragility.numerics import slabs
from ...fragility.runs.scaling import SCALE, intensity_measure
from ...fragility.uncertainty.joint import Variability
from ...fragility.validity.notes import squat_notes
from ...fragility.validity.plausibility import block_doubts, level_doubts
from ...models import Law
from ...models.oscillator import Oscillator
from ...motions import Building, Generator
from ...motions.floors.histories import FloorHistories
from ...motions.plausibility import ringing_doubts
from ...units import DIMENSIONLESS
from ...wording import counted
from ..buildings.anchoring import anchoring
from ..buildings.assessment import assess, check_drawn, described, distinct_runs
from ..buildings.code_checks import code_variables
from ..buildings.consequences import COLUMNS, DRAWN_BYTES, REALISATIONS
from ..buildings.contents import Inventory
from ..buildings.floor_index import read_floor_index
from ..buildings.inventory import read_inventory
from ..buildings.notes import (
    PROPORTIONAL,
    UNDIRECTED,
    hazard_notes,
    hazard_shares,
    history_notes,
    inventory_notes,
    notes,
)
from ..buildings.pieces import SAFETY, budget_set
from ..buildings.screening import Screening, screen_inventory
from ..buildings.shaking import Shaking
from ..buildings.variables import JOINT, variable
from ..codes.asce7 import Asce7
from ..codes.check import Code
from ..file.analyses import LevelsTable, PerformanceTable
from ..file.motions import MotionsTable
from ..file.schema import StudyFile
from ..plan.estimates import MEAN as IN_MEAN
from ..plan.reading import Reading
from ..text.curve_notes import modelling_note
from ..text.words import level_text
from .study import SLAB_BYTES_A_RUN, Study, each, part_of, perturbed_words, plain, screening_of

if TYPE_CHECKING:
    from ...fragility.runs.runners import Runner

OSCILLATOR_BYTES = 5500.0
"""Most memory of an oscillator, with its description in the runs of its floor."""
NOT_ASKED = Screening()
MOST_NAMED = 6
"""Most levels that a sentence names."""
RANKING = "ranked_"
"""Prefix of the names of the ranking's variables, beside those of the assessment."""


@dataclass(frozen=True)
class PerformanceStudy(Study):
    """An inventory in a building under the same motions.

    `motions` are of the ground, or histories of all floors.  `levels` are of the measure `im`, or a plain factor of 1
    for a scenario; `hazard` is given where annual values are wanted.  `objective` is the quantity that anchoring saves,
    given the level `at` where there is no hazard.  `undirected`: the inventory gives directions that no motion has.
    """

    inventory: Inventory
    models: tuple[Law, ...]
    building: Building | None
    motions: tuple[xr.DataArray, ...] | FloorHistories
    im: str
    levels: Array
    hazard: HazardCurve | None
    variability: Variability | None
    objective: str
    at: float | None
    replicates: int
    seed: int
    safety: tuple[str, ...]
    sort: str
    code: Code | None = None
    budget: float | None = None
    modelling: float = 0.0
    correlation: float = 1.0
    generator: Generator | None = None
    screening: Screening = NOT_ASKED
    undirected: bool = False
    kind: ClassVar[str] = "performance"

    @classmethod
    def of(cls, content: StudyFile, folder: Path) -> Self:
        asked = content.performance
        assert asked is not None  # (the table makes it this kind of study)
        building = None if content.building is None else content.building.made()
        on_floors = content.motions.floors_file is not None or content.motions.floors_index is not None
        if not on_floors:  # (errors in the inventory are raised before motions are made)
            known = ["0"] if building is None else [str(floor) for floor in building.floors]
            inventory = read_inventory(folder / asked.inventory, known)
        _refuse_scaling(content.motions, asked)
        histories = _histories(content.motions, asked, folder)
        levels_asked = asked.levels
        if histories is not None and histories.unit and not histories.elastic:
            levels_asked = LevelsTable(values=histories.levels.tolist(), unit=histories.unit)
        if levels_asked is None:
            if "im" in asked.model_fields_set:
                raise ValueError("performance.im needs performance.levels: without them the motions are as they are")
            im, levels = SCALE, np.ones(1)
        else:
            im, levels = asked.im, levels_asked.build(asked.im)
        if histories is not None and histories.unit:
            own = LevelsTable(values=histories.levels.tolist(), unit=histories.unit).build(im)
            histories = histories.at(own)
        hazard = None if content.hazard is None else content.hazard.build(im, folder)
        at = None
        if hazard is None:
            at = float(levels[levels.size // 2])
            if asked.at_level is not None:
                at = _level_of(levels, asked.at_level, levels_asked, im)
        elif asked.at_level is not None:
            raise ValueError("performance.at_level does not go with a hazard: the ranking is of a year")
        motions = tuple(content.motions.build(folder)) if histories is None else histories
        if on_floors:
            known = Shaking.of(building, motions, None, im == SCALE).known
            inventory = read_inventory(folder / asked.inventory, known)
        directed = any(row.direction for row in inventory.rows)
        inventory = Shaking.of(building, motions, None, im == SCALE).placed(inventory)
        try:
            code = None if asked.code is None else asked.code.build(building)
        except ValueError as error:
            raise ValueError(f"performance.code: {error}") from None
        for row in inventory.rows:
            if isinstance(code, Asce7) and row.code_importance not in (None, 1.0, 1.5):
                raise ValueError(
                    f"code_importance must be 1.0 or 1.5 by 'asce7-22' (13.1.3), got {row.code_importance:g} for "
                    f"{row.label!r}"
                )
        if asked.modelling_dispersion > 0.0 and hazard is None:
            raise ValueError("performance.modelling_dispersion is of annual values, which need a [hazard]")
        if asked.budget is not None and all(row.anchoring_cost is None for row in inventory.rows):
            raise ValueError("performance.budget needs anchoring_cost in the inventory, which gives none")
        given = any(row.drawn for row in inventory.rows)
        if "consequence_correlation" in asked.model_fields_set and not given:
            raise ValueError(
                "performance.consequence_correlation is of cost_median, downtime_median_days and injury_probability in "
                "the inventory, which gives none"
            )
        study = cls(
            content.title,
            plain(content),
            inventory,
            each("models", content.models),
            building,
            motions,
            im,
            levels,
            hazard,
            asked.variability.build() if asked.variability is not None else None,
            asked.objective or ("loss" if inventory.value > 0.0 else "number"),
            at,
            asked.replicates,
            asked.seed,
            SAFETY if asked.safety is None else tuple(asked.safety),
            asked.sort,
            code,
            asked.budget,
            asked.modelling_dispersion,
            asked.consequence_correlation,
            content.motions.made_by(folder),
            Screening(*screening_of(content)),
            directed and not any(row.direction for row in inventory.rows),
        )
        allowed = (*(["loss"] if inventory.value > 0.0 else []), "number", "any", *inventory.consequences)
        if study.objective not in allowed:
            raise ValueError(f"performance.objective must be one of {', '.join(allowed)}, got {study.objective!r}")
        check_drawn(inventory, study.realisations)
        for word in asked.safety or ():
            if word not in inventory.consequences:
                words = ", ".join(inventory.consequences) or "none"
                raise ValueError(f"performance.safety must name consequences in the inventory ({words}), got {word!r}")
        for row in inventory.rows:
            for model in study.models:
                if row.e is None:
                    model.oscillator(row.block)
        return study

    @property
    def shakes(self) -> int:
        """Number of motions of each level."""
        if isinstance(self.motions, FloorHistories):
            return self.motions.motions
        return sum(array.sizes["motion"] for array in self.motions)

    @property
    def words(self) -> str:
        of = f"{counted(self.inventory.pieces, 'piece')} in {counted(len(self.inventory), 'line')}"
        levels = "" if self.im == SCALE else f" × {counted(self.levels.size, 'level')}"
        shaken = f"{counted(len(self.models), 'law')} × {counted(self.shakes, 'motion')}{levels}"
        return f"{of} × {shaken} = {counted(self.runs, 'run')}{perturbed_words(self.perturbed_runs)}"

    @property
    def runs(self) -> int:
        return distinct_runs(self.inventory, self.variability) * len(self.models) * self.shakes * self.levels.size

    @property
    def perturbed_runs(self) -> int:
        """Number of further runs that test which outcomes are undecided."""
        levels, motions = self.levels.size, self.shakes
        if isinstance(self.motions, FloorHistories):
            levels, motions = self.motions.run_shape(levels)
        return self.screening.runs(self.inventory, self.models, levels, motions, self.variability)

    @property
    def work(self) -> int:
        return self.runs + self.perturbed_runs

    @property
    def stored_bytes(self) -> float:
        return self._flags + 8.0 * self._outcomes

    @property
    def together(self) -> float:
        variants = 1 if self.variability is None else self.variability.variants
        motions = self._shaken / len(self.models) / self.levels.size
        # lines are processed in slabs, at least one line under one law with all its levels
        of_one = max(min(self._flags, slabs.RUNS), self.levels.size * motions)
        oscillators = distinct_runs(self.inventory, self.variability) * len(self.models)
        of_lines = 300.0 * len(self.models) * len(self.inventory) * self.levels.size
        drawn = 16.0 * self.replicates * motions
        drawn += (
            DRAWN_BYTES * self.realisations * max((row.count for row in self.inventory.rows if row.drawn), default=0)
        )
        return SLAB_BYTES_A_RUN * of_one + OSCILLATOR_BYTES * oscillators + of_lines + drawn + 8.0 * variants * motions

    @property
    def arrays_aside(self) -> list[float]:
        of_places = 8.0 * self._shaken * (1 + len({str(row.floor) for row in self.inventory.rows}))
        of_lines = 8.0 * len(self.models) * len(self.inventory)
        of_motions = of_lines * self._shaken / len(self.models) / self.levels.size
        if isinstance(self.motions, FloorHistories) and self.motions.own_motions:
            of_motions *= self.levels.size
        # expectations and chances of any fall and of each consequence; savings by anchoring and their ranks
        consequences = len(self.inventory.consequences)
        anchored = [of_motions] * 4 + [of_lines * self.replicates] * 2
        return [of_places] * (3 + self._drawn) + ([of_places * consequences] if consequences else []) + anchored

    @property
    def _shaken(self) -> int:
        return len(self.models) * self.levels.size * self.shakes

    @property
    def _flags(self) -> float:
        """Number of flags of all lines; lines that are alike count each."""
        return float(
            len(self.inventory) * self._shaken * (1 if self.variability is None else self.variability.variants)
        )

    @property
    def _outcomes(self) -> float:
        """Number of outcomes in the building and on each floor, motion by motion, of all quantities."""
        places = 1 + len({str(row.floor) for row in self.inventory.rows})
        plain = 1 if self.variability is None else self.variability.realisations
        return float(places * self._shaken * (2 * plain + self._drawn * self.realisations))

    @property
    def realisations(self) -> int:
        """Number of fillings of the building, or of draws of costs, downtimes and injuries."""
        return REALISATIONS if self.variability is None else self.variability.realisations

    @property
    def _drawn(self) -> int:
        """Number of quantities that are drawn."""
        return sum(any(getattr(row, name) is not None for row in self.inventory.rows) for name in COLUMNS)

    @property
    def of_each_law(self) -> list[Oscillator]:
        return [model.oscillator(self.inventory.rows[0].block) for model in self.models]

    @property
    def notes(self) -> list[str]:
        said = inventory_notes(self.inventory, self.safety, self.code)
        if isinstance(self.motions, FloorHistories):
            said += history_notes(self.motions, self.inventory)
        elif self.configuration["motions"].get("elastic"):
            said.append(PROPORTIONAL)
        if self.undirected:
            said.append(UNDIRECTED)
        return [*super().notes, *said]

    @property
    def squat(self) -> list[str]:
        return squat_notes([replace(row.block, name=row.label) for row in self.inventory.rows])

    @property
    def doubts(self) -> list[Doubt]:
        measure = None if self.im == SCALE else intensity_measure(self.im)
        levels = [] if measure is None else level_doubts(self.levels, measure.units)
        far = self.reading.far if self.im == SCALE else ()
        return [*block_doubts([row.block for row in self.inventory.rows]), *self.reading.doubts, *far, *levels]

    @cached_property
    def reading(self) -> Reading:
        found = Reading.of(self.arrays, self.generator)
        if self.building is None:
            return found
        with noted():  # (a study has doubts among its notes)
            roof = self.building.floor_motions(self.arrays, [self.building.floors[-1]])
        return found._replace(doubts=(*found.doubts, *ringing_doubts(roof)))

    @property
    def arrays(self) -> Sequence[xr.DataArray]:
        return self.motions.arrays if isinstance(self.motions, FloorHistories) else self.motions

    @property
    def _read(self) -> list[Any]:
        rows = [described(row) for row in self.inventory.rows]
        found = [rows, self.inventory.currency, None if self.hazard is None else asdict(self.hazard)]
        return [*found, self.levels.tolist()] if isinstance(self.motions, FloorHistories) else found

    def _compute(self, client: Runner, progress: Progress | None) -> xr.Dataset:
        with noted():  # (a study has doubts among its notes)
            found = assess(
                self.inventory,
                self.models,
                self.motions,
                self.levels,
                self.im,
                self.building,
                self.hazard,
                variability=self.variability,
                modelling_dispersion=self.modelling,
                consequence_correlation=self.correlation,
                replicates=self.replicates,
                seed=self.seed,
                client=client,
                progress=part_of(progress, 0, self.work),
            )
            screened = self._screened(found, client, progress)
        ranked = anchoring(
            found,
            self.objective,
            level=self.at,
            replicates=self.replicates,
            seed=self.seed,
            array=client.array,
        )
        whole = ranked.reindex(item=found["item"])
        said = notes(found)
        if self.hazard is not None:
            found = found.assign(hazard_shares(found, self.hazard))
            said += [*hazard_notes(found, self.hazard), modelling_note(self.modelling, IN_MEAN)]
        if self.at is not None and self.levels.size > 1 and "at_level" not in self.configuration["performance"]:
            middle = level_text(self.at, found["level"])
            said.append(f"performance.at_level is not given: table and ranking are of the middle level, {middle}")
        beside = {f"{RANKING}{name}": one for name, one in whole.data_vars.items()}
        coded = (
            {}
            if self.code is None
            else code_variables(self.inventory, self.code, self.building, (*SAFETY, *self.safety))
        )
        results = (
            found.assign({**beside, **coded, **screened.data_vars})
            .assign_coords(reason=screened["reason"])
            .assign_attrs(
                ranking=json.dumps({name: ranked.attrs[name] for name in ranked.attrs if name not in found.attrs}),
                screen=screened.attrs["screen"],
                notes="\n".join([*said, *screen_notes(screened)]),
                safety=JOINT.join(self.safety),
                sort=self.sort,
                **({} if self.at is None else {"at_level": self.at}),
                **({} if self.code is None else {"code": self.code.title, "code_site": self.code.site}),
            )
        )
        return results if self.budget is None else _with_set(results, self.budget)

    def _screened(self, found: xr.Dataset, client: Runner, progress: Progress | None) -> xr.Dataset:
        """Screen the lines of the inventory."""
        return screen_inventory(
            self.inventory,
            self.models,
            Shaking.of(self.building, self.motions, None, self.im == SCALE),
            self.levels,
            self.im,
            found["overturned"],
            self.screening,
            client,
            self.variability,
            part_of(progress, self.runs, self.work),
        )


def _with_set(results: xr.Dataset, budget: float) -> xr.Dataset:
    """Return the results with the lines to anchor for the budget under each law."""
    choices = [budget_set(results, budget, k) for k in range(results.sizes["model"])]
    chosen = np.stack([one.chosen for one in choices])
    gaps = np.array([max(one.gaps) for one in choices])
    text = "by how much the best of all sets can be better, relative to this one"
    found = {
        "budget_chosen": variable(("model", "item"), chosen, DIMENSIONLESS, "whether it is anchored for the budget"),
        "budget_gap": variable(("model",), gaps, DIMENSIONLESS, text),
    }
    return results.assign(found).assign_attrs(budget=budget)


def ranking_of(results: xr.Dataset) -> xr.Dataset:
    """Return the ranking held by a performance study's results, as `anchoring` returns it."""
    own = [str(name) for name in results.data_vars if str(name).startswith(RANKING)]
    ranked = results[own].rename({name: name.removeprefix(RANKING) for name in own})
    keep = np.flatnonzero(np.isfinite(ranked["rank"].values).all(axis=0))
    return ranked.isel(item=keep).assign_attrs(json.loads(results.attrs["ranking"]))


def _refuse_scaling(motions: MotionsTable, asked: PerformanceTable) -> None:
    """Raise a ValueError where floor histories would be scaled without saying that the building is elastic."""
    if asked.levels is not None and motions.floors_file is not None and not motions.elastic:
        raise ValueError(
            "performance.levels scale the histories of motions.floors_file, which holds for an elastic building alone: "
            "say motions.elastic = true, or give a motions.floors_index with histories of each level"
        )
    if asked.levels is None and motions.elastic:
        raise ValueError("motions.elastic is of histories that are scaled to performance.levels, which are not given")


def _histories(motions: MotionsTable, asked: PerformanceTable, folder: Path) -> FloorHistories | None:
    """Read the floor histories with levels of their own, in the unit of their index; None where there is no index.

    ValueError where the study asks for other levels, and does not say that one set is scaled to them.
    """
    if motions.floors_index is None:
        return None
    path = folder / motions.floors_index
    found = read_floor_index(path, motions.dt_s, motions.unit)
    if not motions.elastic:
        if asked.levels is not None:
            own = f" ({', '.join(found.texts[:MOST_NAMED])})" if found.unit else ""
            raise ValueError(
                f"performance.levels do not go with motions.floors_index: its histories are used as they are, at their "
                f"own levels{own}; motions.elastic = true scales one set of them to other levels"
            )
        return found
    if not found.unit:
        raise ValueError(f"motions.elastic needs the level of the set that is scaled, such as 'level (g)' in {path}")
    if found.levels.size > 1:
        raise ValueError(
            f"motions.elastic scales one set of histories, {path} has sets at {found.levels.size} levels: leave "
            "motions.elastic and performance.levels out, and they are used as they are"
        )
    return replace(found, elastic=True)


def _level_of(levels: Array, asked: float, table: LevelsTable | None, im: str) -> float:
    """Return the level of the ranking; ValueError where it is not among the levels."""
    if table is None:
        raise ValueError("performance.at_level needs performance.levels")
    at = float(LevelsTable(values=[asked], unit=table.unit).build(im)[0])
    found = levels[np.isclose(levels, at, rtol=1e-9)]
    if not found.size:
        raise ValueError(f"performance.at_level must be one of the levels, got {asked:g} {table.unit}")
    return float(found[0])
