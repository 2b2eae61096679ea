"""Performance studies: an inventory in a building, shaken jointly."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..fragility import HazardCurve, block_notes, slabs, standing
from ..fragility.joint import Variability
from ..fragility.scaling import SCALE
from ..models import Law
from ..models.oscillator import Oscillator
from ..motions import Building
from .analysis_tables import LevelsTable, PerformanceTable
from .anchoring import anchoring
from .assessment import assess, described, distinct_runs
from .assessment_notes import hazard_notes, notes
from .contents import Inventory
from .designs import count
from .inventory import read_inventory
from .schema import StudyFile
from .shaking import Shaking
from .study import SLAB_BYTES_A_RUN, Progress, Study, each, plain
from .words import level_text

if TYPE_CHECKING:
    from ..fragility.runners import Runner

OSCILLATOR_BYTES = 5500.0
"""What one takes at most, with the words that name it when its floor's runs are kept."""
RANKING = "ranked_"
"""What the ranking's variables are called after, beside those of the assessment."""


@dataclass(frozen=True)
class PerformanceStudy(Study):
    """An inventory in a building under the same motions.

    `levels` of `im`, plain factors of 1 for a scenario; `hazard` where values are wanted for a year.  `objective` is
    what anchoring saves, given level `at` where there is no hazard.
    """

    inventory: Inventory
    models: tuple[Law, ...]
    building: Building | None
    motions: tuple[xr.DataArray, ...]
    im: str
    levels: NDArray[np.float64]
    hazard: HazardCurve | None
    variability: Variability | None
    objective: str
    at: float | None
    replicates: int
    seed: int
    kind: ClassVar[str] = "performance"

    @classmethod
    def of(cls, content: StudyFile, folder: Path) -> Self:
        asked = content.performance
        assert asked is not None  # which makes it this kind
        building = None if content.building is None else content.building.made()
        if content.motions.floors_file is None:  # what is wrong with it is said before motions are made
            known = ["0"] if building is None else [str(floor) for floor in building.floors]
            inventory = read_inventory(folder / asked.inventory, known)
        if asked.levels is None:
            if "im" in asked.model_fields_set:
                raise ValueError("performance.im needs performance.levels: without them the motions are as they are")
            im, levels = SCALE, np.ones(1)
        else:
            im, levels = asked.im, asked.levels.build(asked.im)
        hazard = None if content.hazard is None else content.hazard.build(im, folder)
        at = None
        if hazard is None:
            at = float(levels[levels.size // 2]) if asked.at_level is None else _level_of(levels, asked, im)
        elif asked.at_level is not None:
            raise ValueError("performance.at_level does not go with a hazard: the ranking is of a year")
        motions = tuple(content.motions.build(folder))
        if content.motions.floors_file is not None:
            known = Shaking.of(building, motions, None, im == SCALE).known
            inventory = read_inventory(folder / asked.inventory, known)
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
        )
        allowed = (*(["loss"] if inventory.value > 0.0 else []), "number", "any", *inventory.consequences)
        if study.objective not in allowed:
            raise ValueError(f"performance.objective must be one of {', '.join(allowed)}, got {study.objective!r}")
        for row in inventory.rows:
            for model in study.models:
                if row.e is None:
                    model.oscillator(row.block)
        return study

    @property
    def words(self) -> str:
        of = f"{count(self.inventory.pieces, 'piece')} in {count(len(self.inventory), 'line')}"
        shakes = sum(array.sizes["motion"] for array in self.motions)
        levels = "" if self.im == SCALE else f" × {count(self.levels.size, 'level')}"
        return (
            f"{of} × {count(len(self.models), 'law')} × {count(shakes, 'motion')}{levels} = {count(self.runs, 'run')}"
        )

    @property
    def runs(self) -> int:
        shakes = sum(array.sizes["motion"] for array in self.motions)
        return distinct_runs(self.inventory, self.variability) * len(self.models) * shakes * self.levels.size

    @property
    def stored_bytes(self) -> float:
        return self._flags + 16.0 * self._outcomes

    @property
    def together(self) -> float:
        variants = 1 if self.variability is None else self.variability.variants
        motions = self._shaken / len(self.models) / self.levels.size
        # lines pass in slabs, one line under one law at least, with all its levels
        of_one = max(min(self._flags, slabs.RUNS), self.levels.size * motions)
        oscillators = distinct_runs(self.inventory, self.variability) * len(self.models)
        of_lines = 300.0 * len(self.models) * len(self.inventory) * self.levels.size
        drawn = 16.0 * self.replicates * motions
        return SLAB_BYTES_A_RUN * of_one + OSCILLATOR_BYTES * oscillators + of_lines + drawn + 8.0 * variants * motions

    @property
    def arrays_aside(self) -> list[float]:
        of_places = 8.0 * self._shaken * (1 + len({str(row.floor) for row in self.inventory.rows}))
        of_lines = 8.0 * len(self.models) * len(self.inventory)
        of_motions = of_lines * self._shaken / len(self.models) / self.levels.size
        # expectations and chances of any fall, and of what it means; what anchoring saves, and ranks
        consequences = len(self.inventory.consequences)
        anchored = [of_motions] * 4 + [of_lines * self.replicates] * 2
        return [of_places] * 3 + ([of_places * consequences] if consequences else []) + anchored

    @property
    def _shaken(self) -> int:
        return len(self.models) * self.levels.size * sum(array.sizes["motion"] for array in self.motions)

    @property
    def _flags(self) -> float:
        """Flags of all lines, alike ones each for themselves."""
        return float(
            len(self.inventory) * self._shaken * (1 if self.variability is None else self.variability.variants)
        )

    @property
    def _outcomes(self) -> float:
        """Numbers of what falls in the building and on each floor, motion by motion."""
        places = 1 + len({str(row.floor) for row in self.inventory.rows})
        return float(places * self._shaken * (1 if self.variability is None else self.variability.realisations))

    @property
    def of_each_law(self) -> list[Oscillator]:
        return [model.oscillator(self.inventory.rows[0].block) for model in self.models]

    @property
    def notes(self) -> list[str]:
        return block_notes([row.block for row in self.inventory.rows])

    @property
    def arrays(self) -> Iterable[xr.DataArray]:
        return self.motions

    @property
    def _read(self) -> list[Any]:
        rows = [described(row) for row in self.inventory.rows]
        return [rows, self.inventory.currency, None if self.hazard is None else asdict(self.hazard)]

    def _compute(self, client: Runner, progress: Progress | None) -> xr.Dataset:
        found = assess(
            self.inventory,
            self.models,
            self.motions,
            self.levels,
            self.im,
            self.building,
            self.hazard,
            variability=self.variability,
            replicates=self.replicates,
            seed=self.seed,
            client=client,
            progress=progress,
        )
        ranked = anchoring(
            found,
            self.objective,
            level=self.at,
            replicates=self.replicates,
            seed=self.seed,
            array=client.array,
        )
        whole = ranked.reindex(item=found["item"])
        blocks = [row.block for row in self.inventory.rows]
        screened = standing(blocks, self.models, found.sizes["motion"], "item")
        said = [*notes(found), *([] if self.hazard is None else hazard_notes(found, self.hazard))]
        if self.at is not None and self.levels.size > 1 and "at_level" not in self.configuration["performance"]:
            middle = level_text(self.at, found["level"])
            said.append(f"performance.at_level is not given: table and ranking are of the middle level, {middle}")
        beside = {f"{RANKING}{name}": one for name, one in whole.data_vars.items()}
        return found.assign({**beside, **screened.data_vars}).assign_attrs(
            ranking=json.dumps({name: ranked.attrs[name] for name in ranked.attrs if name not in found.attrs}),
            notes="\n".join([*said, screened.attrs["notes"]]),
            **({} if self.at is None else {"at_level": self.at}),
        )


def ranking_of(results: xr.Dataset) -> xr.Dataset:
    """The ranking that stands in a performance study's results, as `anchoring` returns it."""
    own = [str(name) for name in results.data_vars if str(name).startswith(RANKING)]
    ranked = results[own].rename({name: name.removeprefix(RANKING) for name in own})
    keep = np.flatnonzero(np.isfinite(ranked["rank"].values).all(axis=0))
    return ranked.isel(item=keep).assign_attrs(json.loads(results.attrs["ranking"]))


def _level_of(levels: NDArray[np.float64], asked: PerformanceTable, im: str) -> float:
    """The level of the ranking; ValueError where it is none of the levels."""
    if asked.levels is None or asked.at_level is None:
        raise ValueError("performance.at_level needs performance.levels")
    at = float(LevelsTable(values=[asked.at_level], unit=asked.levels.unit).build(im)[0])
    found = levels[np.isclose(levels, at, rtol=1e-9)]
    if not found.size:
        raise ValueError(f"performance.at_level must be one of the levels, got {asked.at_level:g} {asked.levels.unit}")
    return float(found[0])
