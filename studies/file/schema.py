"""The study file: one TOML schema, checked once, and converted into blocks, laws and motions."""

import math
import re
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Annotated, ClassVar, NamedTuple, Self

import numpy as np
import xarray as xr
from pydantic import Field, ValidationError, field_validator, model_validator

from ...core import checks
from ...core.aliases import Array
from ...core.doubts import KINDS, Doubt, noted
from ...core.wording import percent, with_article
from ...fragility.adaptive.sequential import MOST_RUNS, RUNS
from ...fragility.adaptive.until import MEDIAN, MOST, TARGETS, USUAL
from ...fragility.analyses.joint import FEWEST_MOTIONS as FEWEST_EVENTS
from ...fragility.analyses.pooled import BLOCKS_A_MOTION, MOST as MOST_POOLED
from ...fragility.analyses.surface_results import POOLED
from ...fragility.curves.curve import LINKED
from ...fragility.fitting.links import LINKS
from ...fragility.fitting.states import OVERTURNED, UPLIFTED
from ...fragility.hazard.pieces import EXTEND
from ...fragility.runs.request import USUAL_OF_ROCKING
from ...fragility.runs.scaling import BLOCK_MEASURES, SCALE
from ...fragility.uncertainty.joint import INDEPENDENT, TOGETHER
from ...fragility.validity.slab_screen import FACTORS
from ...models import Block
from ...models.outputs import OF_ROCKING
from ...motions.plausibility import collapse_doubts, ringing_doubts, scaling_doubts
from ...motions.polarity import BOTH, both_polarities
from ...motions.scaling import scale_to
from ..facts.say import notes_said
from ..plan.designs import Cloud, Design, Events, Incremental, Pooled, Sequential, Stripes, Waves
from ..plan.reading import Reading
from ..plan.size import refuse_factors, refuse_samples
from ..text.error import StudyError
from .analyses import (
    EVENTS,
    LEVEL_UNITS,
    CloudTable,
    EventsTable,
    FitTable,
    FrictionTable,
    IdaTable,
    MeasuresTable,
    PerformanceTable,
    ScreenTable,
    StripesTable,
    UntilTable,
)
from .blocks import BlockTable, Restraints, RestraintTable
from .buildings import Buildings, BuildingTable, StoreysTable
from .hazard import OF_HAZARD, OF_MOTIONS, BranchTable, Hazards, HazardSetTable, MotionSetTable
from .include import line_of, read_content, text_of
from .models import Models
from .motions import PAIR, Motions, MotionsTable, motions_table
from .refusals import refusal, refusals
from .report import ReportTable
from .selecting import Levels, SelectTable, selected
from .supports import NamedSupports, Supports
from .table import SEVERAL, KeyInfo, Label, RelativePath, Table, all_errors, bare, one_of
from .uncertainty import SensitivityTable, UncertaintyTable


class MotionSet(NamedTuple):
    """Motions of the blocks, the ground motions of their levels, input warnings and the selection's fit."""

    motions: tuple[xr.DataArray, ...]
    ground: tuple[xr.DataArray, ...]
    reading: Reading
    selection: xr.Dataset | None = None

    @property
    def both_ways(self) -> "MotionSet":
        """The same with each motion followed by its reverse."""
        motions, ground = both_polarities(self.motions), both_polarities(self.ground)
        refuse_samples(sum(array.size for array in (*motions, *ground)), "motions of both polarities")
        return self._replace(motions=tuple(motions), ground=tuple(ground))


LOOKED_AT = 64
"""Number of motions of a generator that are made before an adaptive or a pooled analysis runs, to check them."""

OF_STRIPES = "the motions of all stripes"


class StudyFile(Table):
    """A study: blocks x damping laws x motions, as one kind of analysis.

    include: Files whose tables are merged into this file; keys of this file take precedence.
    title: Title of the study; it must be given.
    blocks: The blocks, one table each, at most 2,000; a performance study has an inventory instead.
    blocks_file: Instead of blocks: a CSV of up to a million (2,000 with [uncertainty] or [sensitivity]), one
        line each, its columns their keys.
    restraints: Straps, brackets and others that blocks, lines of an inventory and kits name.
    models: The damping laws, one table each.
    motions: Ground or floor motions.
    building: Building between the ground and the blocks.
    buildings: Several buildings, each with a name.
    support: Bench or isolator between the floor and the blocks.
    supports: Benches and platforms that lines of an inventory name.
    ida: Incremental dynamic analysis: every motion at every level.
    until: Precision at which adaptive levels stop.
    events: Distribution of the number of blocks of a region that overturn in one event.
    stripes: Stripes: other motions at each level.
    cloud: Cloud: every motion once, unscaled.
    screen: Options of the validity checks.
    friction: Friction of the floor, for sliding.
    report: Contents of the report's cover.
    accept: Kinds of input warnings to accept without a note: slips of units, offsets, drifts.
    outputs: Results kept of every run; `overturned` alone is fastest. Outputs of walls and restraints need such
        blocks, `airborne` needs `motions.vertical`, `axis` needs both components.
    fit: Options of the fitted curves.
    measures: Comparison of intensity measures.
    uncertainty: Distributions of uncertain properties of blocks and laws.
    sensitivity: Sensitivity of results to delta or e.
    performance: Performance assessment of an inventory, with joint motions.
    hazard: Seismic hazard, for annual rates.
    branches: Weights of alternative inputs, one table for each kind.
    motion_sets: Other motions, for branches of motions.
    hazards: Other hazard curves, for branches of the hazard.
    """

    include: Annotated[list[str] | None, KeyInfo("none"), RelativePath()] = None
    title: Label
    blocks: Annotated[list[BlockTable] | None, Field(min_length=1, max_length=2000)] = None
    blocks_file: Annotated[str | None, KeyInfo("none"), RelativePath()] = None
    restraints: Annotated[
        dict[Annotated[str, SEVERAL], Restraints] | None,
        KeyInfo("none"),
        SEVERAL,
    ] = None
    models: Annotated[list[Models], SEVERAL]
    motions: Motions
    building: Annotated[Buildings | None, KeyInfo("none: they stand on the ground")] = None
    buildings: Annotated[list[Buildings] | None, KeyInfo("none"), SEVERAL] = None
    support: Annotated[Supports | None, KeyInfo("none: they stand on the floor")] = None
    supports: Annotated[list[NamedSupports] | None, KeyInfo("none"), SEVERAL] = None
    ida: IdaTable | None = None
    until: Annotated[UntilTable | None, KeyInfo(f"the median within {percent(USUAL)}")] = None
    events: Annotated[EventsTable | None, KeyInfo("none")] = None
    stripes: StripesTable | None = None
    cloud: CloudTable | None = None
    screen: ScreenTable | None = None
    friction: Annotated[FrictionTable | None, KeyInfo("not known: a need above 1 counts as sliding")] = None
    report: Annotated[ReportTable | None, KeyInfo("none: no cover")] = None

    accept: Annotated[list[Annotated[str, one_of(KINDS)]] | None, KeyInfo("none")] = None
    outputs: Annotated[list[Annotated[str, one_of(OF_ROCKING)]] | None, KeyInfo(", ".join(USUAL_OF_ROCKING))] = None
    fit: FitTable | None = None
    measures: MeasuresTable | None = None
    uncertainty: UncertaintyTable | None = None

    sensitivity: SensitivityTable | None = None

    performance: PerformanceTable | None = None
    hazard: Hazards | None = None

    branches: Annotated[list[BranchTable] | None, KeyInfo("none"), Field(min_length=1, max_length=3)] = None
    motion_sets: Annotated[list[MotionSetTable] | None, KeyInfo("none"), Field(min_length=1, max_length=20)] = None
    hazards: Annotated[list[HazardSetTable] | None, KeyInfo("none"), SEVERAL] = None

    compare: ClassVar[bool] = True
    """Whether the motions of a scenario are compared with a model as they are made."""

    @field_validator("title")
    @classmethod
    def _seen(cls, title: str) -> str:
        if not title.strip():
            raise ValueError(f"must hold something that can be seen, got {title!r}")
        return title

    @model_validator(mode="after")
    def _code_hazard(self) -> Self:
        """Take S_DS of a building's default strength from the code that the study checks."""
        code = None if self.performance is None else self.performance.code
        building = self.building
        sds = None if code is None else code.given("sds_g")
        if not isinstance(building, StoreysTable) or building.system is None or sds is None:
            return self
        if building.sds_g not in (None, sds):
            raise ValueError(
                f"building.sds_g {building.sds_g:g} and performance.code.sds_g {sds:g} are of one site: state "
                "one of them"
            )
        return self.model_copy(update={"building": building.model_copy(update={"sds_g": sds})})

    @model_validator(mode="after")
    def _rules(self) -> Self:
        """Raise one ValueError for all broken rules, a line each."""
        sentences = broken(self)
        if sentences:
            raise ValueError("\n".join(sentences))
        return self

    @property
    def scales(self) -> bool:
        """True if twice the ground motion gives twice the motion of the blocks' floor."""
        return all(building.scales for building in self.stand) and (self.support is None or self.support.scales)

    @property
    def _scaled_before(self) -> bool:
        """True if motions are scaled to their level before they pass a building or support that does not scale."""
        return self.stripes is not None and self.stripes.scale and not self.scales

    @property
    def adaptive(self) -> bool:
        """True if levels follow from the runs before."""
        return self.ida is not None and isinstance(self.ida.levels, str)

    @property
    def restraint_tables(self) -> dict[str, RestraintTable]:
        """Tables of restraints by their keys."""
        inline = {f"blocks[{i}].restraint": block.restraint for i, block in enumerate(self.blocks or [], start=1)}
        return {f"restraints.{name}": table for name, table in (self.restraints or {}).items()} | {
            key: table for key, table in inline.items() if isinstance(table, RestraintTable)
        }

    @property
    def of_kind(self) -> str:
        """Kind of the study, with its article; levels that follow by their word."""
        if self.ida is not None and isinstance(self.ida.levels, str):
            return f"levels = {self.ida.levels!r}"
        return f"{with_article(self.kind)} study"

    @property
    def kind(self) -> str:
        """The kind of the study."""
        if self.performance is not None:
            return "performance"
        if self.sensitivity is not None:
            return "sensitivity"
        if self.ida is not None and isinstance(self.ida.levels, str):
            return "pooled" if self.ida.levels == POOLED else "sequential"
        return "fragility" if self.uncertainty is None else "uncertainty"

    @property
    def analysis(self) -> IdaTable | StripesTable | CloudTable:
        """The table of the one requested analysis."""
        table = self.ida or self.stripes or self.cloud
        if table is None:
            raise ValueError("a performance study has no ida, stripes or cloud")
        return table

    @property
    def stand(self) -> list[BuildingTable]:
        """The tables of the buildings of the blocks."""
        return [self.building] if self.building is not None else self.buildings or []

    def other(self, motions: MotionsTable) -> Self:
        """Return the study with other motions, and without branches."""
        return self.model_copy(update={"motions": motions, "branches": None, "motion_sets": None, "hazards": None})

    def shaking(self, folder: Path, both: bool = False) -> list[MotionSet]:
        """Compute the motions in the buildings, one set for all levels or each stripe; ValueError as of the tables.

        both: with each motion followed by its reverse.
        """
        sets = self._sets(folder)
        return [of_set.both_ways for of_set in sets] if both else sets

    def _sets(self, folder: Path) -> list[MotionSet]:
        if self.stripes is None:
            return [self._shaking(self.motions, folder)]
        tables = self._stripes_motions(self.stripes)
        if self.stripes.select is not None:
            return self._selected(self.stripes, self.stripes.select, tables, folder)
        samples = 0.0
        for i, table in enumerate(tables, start=1):
            with self._of_stripe(i):
                samples += table.samples(folder)
        refuse_samples(samples * (1 + sum(self._floor_counts())), OF_STRIPES)
        sets: list[MotionSet] = []
        held, levels = 0, self.stripes.levels().tolist()
        for i, table in enumerate(tables, start=1):
            with self._of_stripe(i):
                ground, reading = self._ground(table, folder, own_level=False)
            sets.append(self._in_buildings(ground, reading, levels[i - 1]))
            held += sum(array.size for array in sets[-1].motions)
            # (the size of records is known only once they are read)
            refuse_samples(held, OF_STRIPES)
        return sets

    @contextmanager
    def _of_stripe(self, number: int) -> Iterator[None]:
        """Name the table that an error of a stripe's motions comes from: the stripe's own keys, or [motions]."""
        assert self.stripes is not None
        own_keys = self.stripes.at[number - 1].motions or {}
        try:
            yield
        except ValueError as error:
            text = str(error).removeprefix("motions: ")
            words = [bare(word) for word in re.findall(r"\w+", text)]
            known = {"stripes", *map(bare, self.motions.model_fields_set)}
            elsewhere = not known.isdisjoint(words[:1]) and not {*words} & {*map(bare, own_keys)}
            if own_keys and not elsewhere:
                raise ValueError(f"stripes.at[{number}].motions: {text}") from None
            raise

    def _selected(
        self, stripes: StripesTable, select: SelectTable, tables: list[MotionsTable], folder: Path
    ) -> list[MotionSet]:
        """Return the sets of the stripes whose motions are selected to agree with the hazard."""
        if self.kind != "fragility":
            raise ValueError(f"stripes.select is for fragility studies of known blocks, not for {self.of_kind}")
        if self.stand and stripes.im_at != "ground":
            raise ValueError(
                "stripes.select with a building needs im_at = 'ground': the hazard that motions agree with is there"
            )
        hazard = None if self.hazard is None else self.hazard.build(stripes.im, folder)
        levels = Levels(stripes.im, stripes.unit, LEVEL_UNITS[stripes.unit][0], stripes.levels().tolist(), hazard)
        chosen, doubts = selected(select, stripes.at, tables, levels, folder, self._of_stripe)
        sets = []
        for i, (ground, report) in enumerate(chosen):
            reading = Reading.of(ground, own_level=False)
            reading = reading._replace(doubts=(*(doubts if i == 0 else ()), *reading.doubts))
            sets.append(self._in_buildings(ground, reading, float(report.attrs["level"]))._replace(selection=report))
        refuse_samples(sum(array.size for of_set in sets for array in of_set.motions), OF_STRIPES)
        return sets

    def _stripes_motions(self, stripes: StripesTable) -> list[MotionsTable]:
        """Return the table of motions of each level: [motions] with the keys that differ there."""
        common = self.motions.model_dump(by_alias=True, exclude_unset=True)
        tables = []
        for i, stripe in enumerate(stripes.at, start=1):
            together = {**common, **(stripe.motions or {})}
            try:
                tables.append(motions_table(together))
            except ValidationError as error:
                where = ("stripes", "at", i - 1, "motions")
                raise ValueError(refusal(error, together, Motions, where)[0]) from None
        return tables

    def _shaking(self, motions: MotionsTable, folder: Path, level: float = math.nan) -> MotionSet:
        return self._in_buildings(*self._ground(motions, folder), level)

    def _ground(
        self, motions: MotionsTable, folder: Path, own_level: bool = True
    ) -> tuple[list[xr.DataArray], Reading]:
        """Return the motions of a table as they are made or read, and notes on them."""
        refuse_samples(motions.samples(folder) * (1 + sum(self._floor_counts())), "motions on all floors")
        motions.refuse_moving(folder, (self.performance or self.analysis).im)
        ground = motions.build(folder)
        return ground, Reading.of(ground, motions.made_by(folder), own_level, self.compare)

    def _in_buildings(self, ground: list[xr.DataArray], reading: Reading, level: float = math.nan) -> MotionSet:
        """Return the motions in the buildings of the blocks under ground motions, of a stripe at a level (SI)."""
        counts = self._floor_counts()
        if not self.stand and self.support is None:
            return MotionSet(tuple(ground), (), reading)
        refuse_samples(sum(array.size for array in ground) * (1 + sum(counts)), "motions on all floors")
        if self._scaled_before:
            given, ground = ground, [scale_to(array, level, self.analysis.im) for array in ground]
            doubts = scaling_doubts(given, ground, FACTORS)
            # (the strength of scaled motions has no meaning)
            reading = reading._replace(own_strength=False, doubts=(*reading.doubts, *doubts))
        where = ""
        if self.performance is not None and self.performance.levels is not None:
            where = "under the motions as they are, before they are scaled to performance.levels, "
        if self.stripes is not None and math.isfinite(level):
            size, _ = LEVEL_UNITS[self.stripes.unit]
            where = f"at {self.stripes.im} of {level / size:.4g} {self.stripes.unit} "
        floors: list[xr.DataArray] = [] if self.stand else ground
        for i, building in enumerate(self.stand, start=1):
            try:
                with noted():  # a study has input warnings among its notes
                    moved = building.shake(ground)
            except ValueError as error:
                raise ValueError(f"{self._called(i)}: {error}") from None
            floors = [*floors, *moved]
            if not building.scales:
                line = f"{where}{building.yielding(ground, moved)}"
                doubts = [collapse._replace(sentence=f"{where}{collapse.sentence}") for collapse in _collapses(moved)]
                storeys = (*reading.storeys, *notes_said(building.strength_facts), line)
                reading = reading._replace(doubts=(*reading.doubts, *doubts), storeys=storeys)
            elif building.kind != "ground":
                reading = reading._replace(doubts=(*reading.doubts, *ringing_doubts(moved)))
        if self.support is not None:
            floors, struck = self.support.carry(floors)
            struck = [doubt._replace(sentence=f"{where}{doubt.sentence}") for doubt in struck]
            reading = reading._replace(doubts=(*reading.doubts, *struck))
        at_ground = self.performance is None and self.analysis.im_at == "ground"
        return MotionSet(tuple(floors), tuple(ground) if at_ground else (), reading)

    def _floor_counts(self) -> list[int]:
        """Return the number of floors of each building whose motions are wanted; ValueError for an invalid building."""
        counts = []
        for i, building in enumerate(self.stand, start=1):
            try:
                counts.append(building.floor_count)
            except ValueError as error:
                raise ValueError(f"{self._called(i)}: {error}") from None
        return counts

    def _called(self, number: int) -> str:
        return "building" if self.buildings is None else f"buildings[{number}]"

    def both_ways(self, blocks: Iterable[Block]) -> bool:
        """Return True if motions are run both ways: by the file, or by default if a block is sided."""
        asked = self.analysis.polarity
        return any(block.sided for block in blocks) if asked is None else asked == BOTH

    def design(self, folder: Path, both: bool = False) -> Design:
        """Make the design of the analysis with its motions, run `both` ways or as they are; ValueError for a clash."""
        levels = self._levels()  # (errors of the levels are raised before motions are made)
        if self.adaptive:
            return self._in_waves(folder, both)
        sets = self.shaking(folder, both)
        if self.ida is not None:
            refuse_factors(levels.size * sum(array.size // array.sizes["time"] for array in sets[0].motions))
        first = sets[0]
        if self.stripes is not None:
            ground = tuple(of_set.ground for of_set in sets) if self.stripes.im_at == "ground" else ()
            reading = Reading.joined([of_set.reading for of_set in sets])
            shaken = tuple(of_set.motions for of_set in sets)
            selections = tuple(of_set.selection for of_set in sets if of_set.selection is not None)
            scale = self.stripes.scale and not self._scaled_before
            if selections:  # (stripes that do not agree with the hazard may be left out)
                levels = np.array([selection.attrs["level"] for selection in selections])
            return Stripes(shaken, ground, self.stripes.im, scale, selections, levels=levels, reading=reading)
        kind = Cloud if self.ida is None else Incremental
        return kind(first.motions, first.ground, self.analysis.im, levels=levels, reading=first.reading)

    def _in_waves(self, folder: Path, both: bool) -> Waves:
        """Return the design of adaptive levels or of a pooled surface, without the hazard of its rates.

        A generator makes its first motions now, to check them, and the others during the runs.
        """
        motions, asked = self.motions, self.until or UntilTable()
        plain = (
            not self.stand
            and self.support is None
            and not motions.given("match_gmm")
            and motions.given("component") is None
        )
        generator = motions.made_by(folder) if plain else None
        number, seed = motions.given("number") or 1, motions.given("seed") or 0
        if generator is not None:
            motions = motions.model_copy(update={"number": min(number, LOOKED_AT)})
        shaken = self._shaking(motions, folder)
        if generator is None:
            number, seed = sum(array.sizes["motion"] for array in shaken.motions), asked.seed
        elif asked.seed:
            raise ValueError("until.seed is of motions that are read: give motions.seed, which levels follow, too")
        is_pooled = self.kind == POOLED
        until = asked.build(self.analysis.im, number, MOST_POOLED if is_pooled else MOST)
        if not is_pooled:
            until = replace(until, state=OVERTURNED if self.fit is None else self.fit.state)
        runs = asked.runs_per_motion or (BLOCKS_A_MOTION if is_pooled else RUNS)
        kept = shaken.motions, shaken.ground, self.analysis.im, until, runs, seed, generator, both
        if is_pooled:
            return Pooled(*kept, events=self._events(generator is not None, number), reading=shaken.reading)
        return Sequential(*kept, reading=shaken.reading)

    def _events(self, made: bool, number: int) -> Events | None:
        """Return the events in which a sample of the region is run: made by a generator, or all `number` of a set."""
        if self.events is None:
            return None
        if not made and self.events.motions is not None:
            raise ValueError("events.motions is of motions that a generator makes: a set of motions is taken whole")
        if not made and number < FEWEST_EVENTS:
            raise ValueError(f"events need {FEWEST_EVENTS} motions at least, got {number}")
        levels = self.events.levels.build(self.analysis.im)
        return Events(levels, (self.events.motions or EVENTS) if made else number, self.events.sample)

    def _levels(self) -> Array:
        """Return the levels in SI, none for a cloud; ValueError if their unit is not the measure's."""
        if self.stripes is not None:
            return self.stripes.levels()
        if self.ida is None or isinstance(self.ida.levels, str):
            return np.empty(0)
        return self.ida.levels.build(self.ida.im)


def read_study_file(path: Path, target: float | None = None) -> StudyFile:
    """Read and check a study file; StudyError if it is not valid. target: of all restraints, beyond the file."""
    merged = read_content(path, StudyFile)
    if target is not None:
        named, blocks = merged.content.get("restraints"), merged.content.get("blocks")
        tables = list(named.values()) if isinstance(named, dict) else []
        for block in blocks if isinstance(blocks, list) else []:
            tables.append(block.get("restraint") if isinstance(block, dict) else None)
        restraints = [table for table in tables if isinstance(table, dict)]
        if not restraints:
            raise StudyError(f"{path}: --target needs a restraint, whose strength is looked for; the study has none")
        for table in restraints:
            table["target"] = target
    try:
        return StudyFile.model_validate(merged.content)
    except ValidationError as error:
        sentences = []
        refused = refusals(error, merged.content, StudyFile)
        for message, location in refused:
            key = tuple(part for part in location if isinstance(part, str))
            origin = merged.origin.get(key[:2]) or merged.origin.get(key[:1]) or path
            unknown = message.startswith("unknown key")
            line = line_of(text_of(origin), location) if unknown else 0
            # (several errors leave no room for lists of keys)
            brief = message.partition(", allowed are ")[0] if unknown and len(refused) > 1 else message
            where = [f"in {origin}"] * (origin != path) + [f"line {line}"] * (line > 0)
            sentences.append(f"{brief} ({', '.join(where)})" if where else brief)
        raise StudyError(f"{path}: {all_errors(sentences)}") from None


def _collapses(floors: Iterable[xr.DataArray]) -> list[Doubt]:
    """Return the input warning on floor motions of a building that yields."""
    parts = list(floors)
    labels = [label for part in parts for label in part["motion"].values.tolist()]
    return collapse_doubts(labels, np.concatenate([part["collapsed"].values for part in parts]))


ANALYSES = ("ida", "stripes", "cloud", "performance")
RULES: list[Callable[[StudyFile], None]] = []
"""All rules, in the order of their sentences; each raises a ValueError if it is broken."""


def rule(check: Callable[[StudyFile], None]) -> Callable[[StudyFile], None]:
    """Put a function among the rules."""
    RULES.append(check)
    return check


def broken(study: StudyFile) -> list[str]:
    """Return the sentences of the rules that a study breaks; rules of one analysis come before all others."""
    sentences: list[str] = []
    for check in RULES:
        try:
            check(study)
        except ValueError as error:
            sentences.append(str(error))
            if check is _one_analysis:
                break
    return sentences


@rule
def _one_analysis(study: StudyFile) -> None:
    analyses = [name for name in ANALYSES if study.given(name) is not None]
    if len(analyses) != 1:
        given = " and ".join(analyses) or "none"
        raise ValueError(f"a study needs exactly one of {', '.join(ANALYSES)}, got {given}")


@rule
def _inventory_or_blocks(study: StudyFile) -> None:
    if study.performance is None:
        if study.blocks is None and study.blocks_file is None:
            raise ValueError("key 'blocks' is missing")
        if study.blocks is not None and study.blocks_file is not None:
            raise ValueError("blocks stand in the study file or in blocks_file, not in both")
        return
    for name in ("blocks", "blocks_file", "buildings", "uncertainty", "sensitivity", "fit", "measures", "outputs"):
        if study.given(name) is not None:
            why = "its blocks stand in its inventory" if name.startswith("blocks") else "leave it out"
            raise ValueError(f"a performance study has no {name}: {why}")


@rule
def _hazard_of_an_inventory(study: StudyFile) -> None:
    if study.performance is None or study.hazard is None:
        return
    given = sorted(study.hazard.model_fields_set & {"years", "probability", "along", "at", "below", "above"})
    if given:
        why = "its values are of one year" if given[0] == "years" else "leave it out"
        raise ValueError(f"hazard.{given[0]} is not for a performance study: {why}")


@rule
def _measure_of_an_inventory(study: StudyFile) -> None:
    if study.performance is not None and study.performance.im in BLOCK_MEASURES:
        raise ValueError(
            "performance.im must be a measure of the ground motion alone, which all pieces share, got "
            f"{study.performance.im!r}"
        )


@rule
def _keys_of_other_kinds(study: StudyFile) -> None:
    """Keys that only some kinds of study have; a line each."""
    near = [f"blocks[{i}]" for i, block in enumerate(study.blocks or [], start=1) if block.trip_mm is not None]
    rough = [f"blocks[{i}]" for i, block in enumerate(study.blocks or [], start=1) if block.own_friction is not None]
    friction = set[str]() if study.friction is None else study.friction.model_dump(exclude_none=True).keys()
    lines = []
    for keys, kinds in (
        ([f"{key}.target" for key, table in study.restraint_tables.items() if table.target is not None], ["fragility"]),
        (["friction.slips_m"] * ("slips_m" in friction), ["fragility", "sequential", "performance"]),
        (["friction.trip_mm"] * ("trip_mm" in friction), ["fragility", "performance"]),
        (["friction.shared"] * ("shared" in friction), ["performance"]),
        ([f"{block}: its own friction" for block in rough], ["fragility", "sequential"]),
        ([f"{block}.trip_mm" for block in near], ["fragility"]),
        (["motions.elastic"] * (study.motions.given("elastic") is not None), ["performance"]),
        (["supports"] * bool(study.supports), ["performance"]),
    ):
        if keys and study.kind not in kinds:
            *others, last = ("adaptive" if kind == "sequential" else kind for kind in kinds)
            words = f"{', '.join(others)} or {last}" if others else last
            lines.append(f"{keys[0]} is for {words} studies, not for {study.of_kind}")
    if study.friction is None:
        lines += [f"{block}: its own friction needs [friction] for the other blocks" for block in rough[:1]]
        lines += [f"{block}.trip_mm needs [friction], without which no block slides" for block in near[:1]]
    if lines:
        raise ValueError("\n".join(lines))


@rule
def _restraints_that_hold(study: StudyFile) -> None:
    named = {block.restraint for block in study.blocks or [] if isinstance(block.restraint, str)}
    unused = [name for name in study.restraints or {} if name not in named]
    if unused and study.blocks_file is None and study.performance is None:
        raise ValueError(f"restraints.{unused[0]} holds no block: name it in `restraint` of a block")


@rule
def _rates_of_curves(study: StudyFile) -> None:
    form = "lognormal" if study.fit is None else study.fit.form
    if study.hazard is not None and form in LINKED:
        raise ValueError(f"hazard needs curves whose rates are known exactly, not fit.form {form!r}")


@rule
def _sensitivity_alone(study: StudyFile) -> None:
    if study.sensitivity is None:
        return
    for name in ("hazard", "fit", "measures", "outputs", "uncertainty"):
        if study.given(name) is not None:
            raise ValueError(f"a study with sensitivity has no {name}")
    if study.motions.pair:
        raise ValueError("motions.component 'pair' is for an inventory or a study of blocks, not for [sensitivity]")


@rule
def _levels_that_follow(study: StudyFile) -> None:
    word = None if study.ida is None or not isinstance(study.ida.levels, str) else study.ida.levels
    if study.events is not None and word != POOLED:
        raise ValueError("events are of a region: they need ida with levels = 'pooled'")
    if word is None:
        if study.until is not None:
            raise ValueError("until is for ida with levels = 'adaptive' or 'pooled'")
        return
    if word != POOLED and study.until is not None and study.until.runs_per_motion is not None:
        checks.number("until.runs_per_motion", study.until.runs_per_motion, at_least=1, at_most=MOST_RUNS)
    needing = ("uncertainty", "sensitivity", "measures", "branches", "motion_sets")
    for name in (*needing, *(("screen", "friction") if word == POOLED else ())):
        if study.given(name) is not None:
            raise ValueError(f"{name} needs levels that all motions share, not levels = {word!r}")


@rule
def _fit_of_adaptive_levels(study: StudyFile) -> None:
    if study.fit is None or not study.adaptive:
        return
    for key, value, allowed in (
        ("state", study.fit.state, (OVERTURNED, UPLIFTED, "a number")),
        ("form", study.fit.form, tuple(LINKS)),
        ("method", study.fit.method, ("binomial",)),
    ):
        if value not in allowed and not (key == "state" and isinstance(value, float | int)):
            raise ValueError(f"fit.{key} of adaptive levels must be {' or '.join(allowed)}, got {value!r}")


@rule
def _rate_of_adaptive_levels(study: StudyFile) -> None:
    if not study.adaptive or study.until is None or study.until.rate is None:
        return
    if study.hazard is None:
        raise ValueError("until.rate needs a [hazard]")
    for key in ("below", "above"):
        if getattr(study.hazard, key) != EXTEND:
            raise ValueError(
                f"until.rate draws levels from the hazard curve, extended at both ends: leave out hazard.{key}"
            )


@rule
def _surface_of_many_blocks(study: StudyFile) -> None:
    if study.kind != "pooled":
        return
    for name in ("fit", "outputs", "restraints", "buildings"):
        if study.given(name) is not None:
            stands = name in ("restraints", "buildings")
            why = "blocks stand free on one floor" if stands else "all curves are found together"
            raise ValueError(f"levels = 'pooled' has no {name}: {why}")
    if study.motions.pair:
        raise ValueError(f"motions.component {PAIR!r} is not for levels = 'pooled', whose curves are of one component")
    asked = {} if study.until is None else study.until.model_dump(include=set(TARGETS), exclude_none=True)
    other = sorted({*asked} - {MEDIAN})
    if other:
        raise ValueError(f"until.{other[0]} is for levels = 'adaptive': a pooled surface asks for the median")
    given = (
        set() if study.hazard is None else study.hazard.model_fields_set & {"probability", "along", "below", "above"}
    )
    if given:
        raise ValueError(f"hazard.{min(given)} is not for levels = 'pooled', whose rates are found with its runs")


@rule
def _shared_friction(study: StudyFile) -> None:
    shared = None if study.friction is None else study.friction.shared
    if shared is None or study.performance is None:
        return
    variability = study.performance.variability
    pieces = INDEPENDENT if variability is None else variability.given("pieces") or INDEPENDENT
    if variability is not None and shared != (pieces == TOGETHER):
        raise ValueError(
            f"friction.shared = {str(shared).lower()} contradicts performance.variability.pieces = "
            f"{pieces!r}: pieces share their friction as they share all that differs"
        )


@rule
def _branches(study: StudyFile) -> None:
    sets = {
        OF_MOTIONS: [motions.name for motions in study.motion_sets or []],
        OF_HAZARD: [hazard.name for hazard in study.hazards or []],
    }
    keys = {OF_MOTIONS: "motion_sets", OF_HAZARD: "hazards"}
    kinds = [table.of for table in study.branches or []]
    key, table = ("fit", study.fit) if study.performance is None else ("performance", study.performance)
    modelled = table is not None and table.modelling == "fractiles"
    if modelled and table is not None and table.modelling_dispersion == 0.0:
        raise ValueError(f"{key}.modelling = 'fractiles' needs {key}.modelling_dispersion > 0")
    if study.branches is None and not any(sets.values()) and not modelled:
        return
    if study.kind not in ("fragility", "performance"):
        raise ValueError(
            f"branches are for fragility studies of known blocks and for inventories, not for {study.of_kind}"
        )
    if study.hazard is None:
        what = "branches" if study.branches is not None or any(sets.values()) else f"{key}.modelling = 'fractiles'"
        raise ValueError(f"{what}: they spread an annual rate, which needs a [hazard]")
    if len(set(kinds)) < len(kinds):
        raise ValueError(f"branches hold one table for each kind, got {', '.join(kinds)}")
    for kind, names in sets.items():
        known = [kind, *names]
        if len(set(known)) < len(known):
            raise ValueError(f"{keys[kind]} need names that differ from each other and from {kind!r}")
        asked = next((table.names for table in study.branches or [] if table.of == kind), [])
        for name in asked:
            if name not in known:
                raise ValueError(f"branches of {kind} must name {', '.join(map(repr, known))}, got {name!r}")
        unused = [name for name in names if name not in asked]
        if unused:
            raise ValueError(f"{keys[kind]} {unused[0]!r} is in no branch: name it with its weight")
    if sets[OF_MOTIONS] and study.stripes is not None:
        raise ValueError("branches of motions need ida or cloud: stripes have motions of their own at each level")


@rule
def _buildings(study: StudyFile) -> None:
    if study.building is not None and study.buildings is not None:
        raise ValueError("a study has one building or several buildings, not both keys")
    names = [building.name for building in study.buildings or []]
    if None in names or len(set(names)) < len(names):
        raise ValueError(f"buildings need a name each, all different, got {', '.join(map(str, names))}")
    for key in ("floors_file", "floors_index"):
        if study.stand and study.motions.given(key) is not None:
            raise ValueError(f"a building needs ground motions, got motions.{key}, which are of floors already")


@rule
def _levels_at_the_ground(study: StudyFile) -> None:
    if study.performance is None and study.analysis.im_at == "ground" and not study.stand and study.support is None:
        name = next(name for name in ANALYSES if study.given(name) is not None)
        raise ValueError(f"{name}.im_at 'ground' needs a building, whose floors move with the ground")


@rule
def _what_does_not_scale(study: StudyFile) -> None:
    if study.scales or study.performance is not None:
        return  # (motions of an inventory go through what yields at each level)
    what = next((building.what for building in study.stand if not building.scales), "an isolator that yields")
    if study.ida is not None:
        raise ValueError(
            f"{what} needs stripes or cloud: what is above it does not scale, so that motions go through it at "
            "each level"
        )
    if study.stripes is None or not study.stripes.scale:
        return
    if study.stripes.im_at != "ground":
        raise ValueError(
            f"{what} needs stripes.im_at = 'ground', where motions are scaled to their level, or scale = false"
        )
    if study.stripes.im in (SCALE, *BLOCK_MEASURES):
        raise ValueError(f"{what} needs a measure of the ground motion, got {study.stripes.im}")


@rule
def _support(study: StudyFile) -> None:
    if study.support is None:
        return
    if study.performance is not None or study.sensitivity is not None:
        raise ValueError(
            "support is for the blocks of a study, not for an inventory, whose lines name [[supports]], or "
            "[sensitivity]"
        )
    for key in ("floors_file", "floors_index"):
        if study.motions.given(key) is not None:
            raise ValueError(f"a support needs ground motions, got motions.{key}, which are of floors already")
    if study.analysis.im_at != "ground":
        raise ValueError("a support needs im_at = 'ground': levels are of the ground motion below it")


@rule
def _supports(study: StudyFile) -> None:
    names = [support.name for support in study.supports or []]
    if len(set(names)) < len(names):
        raise ValueError(f"supports need different names, got {', '.join(names)}")
