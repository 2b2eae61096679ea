"""Blocks of a study: the table ``[[blocks]]`` with restraints, and lines of a CSV file (``blocks_file``, inventory)."""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn, Self

from pydantic import Field, TypeAdapter, ValidationError, field_validator, model_validator

from ...core.doubts import warn
from ...core.facts import Fact
from ...core.parameters import declared
from ...core.wording import listed_name
from ...fragility.validity.plausibility import block_doubts
from ...models import Bed, Block, Edge, Restraint, Wall, catalogue
from ...models.friction import CONTACTS, Friction, contact_named, friction_from
from ...models.scenes.edge import CENTRE, FALLS_WHEN
from ...models.scenes.restraint import KINDS
from .csv_table import CsvLine, CsvTable, TableKind
from .derived import Derived, choice, default_of, derived
from .refusals import refusal
from .table import KeyInfo, Table, one_of, shown

MOST_BLOCKS = 1_000_000
KIND = TableKind(
    "file of blocks",
    (
        *("name", "catalogue", "width_m", "height_m", "cm_height_m", "inertia_factor", "alpha_rad", "R_m"),
        *("depth_m", "round", "placed", "mass_kg", "cm_offset_mm", "lean_deg", "wall_gap_mm", "bed_settlement_mm"),
        *("restraint", "edge_distance_mm", "edge_distance_back_mm", "falls_when"),
    ),
    MOST_BLOCKS,
    256 * 2**20,
)

NAMED = {
    "width": "width_m",
    "height": "height_m",
    "cm_height": "cm_height_m",
    "inertia_factor": "inertia_factor",
    "alpha": "alpha_rad",
    "R": "R_m",
}
"""Columns by the names that a `Block` has for their values."""


MAKERS: dict[str, Any] = {kind: getattr(Restraint, kind) for kind in KINDS}
"""What makes each kind of restraint."""


class RestraintTable(Derived):
    """A restraint: what it is, where it acts, and when it breaks."""

    kind: Annotated[str, Field(description="What it is; straps and cables act to the front only.")]
    strength_n: Annotated[float, Field(gt=0.0, description=declared(Restraint)["strength"].sentence)]
    cost: Annotated[
        float | None,
        KeyInfo("not known", unit="the inventory's currency"),
        Field(ge=0.0, le=1e15, description="Cost of fixing one piece of an inventory with it."),
    ] = None
    target: Annotated[
        float | None,
        KeyInfo("no strength is looked for"),
        Field(
            gt=0.0,
            lt=1.0,
            description="Chance of falling, in `hazard.years` or at the one level, to be kept: the strength for "
            "it is looked for, from an eighth to 32 times `strength_n`, within 5 %. For fragility "
            "studies on one floor at levels that all motions share.",
        ),
    ] = None

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.given("angle_deg") and self.given("width_m") is None:
            raise ValueError("a cable with an angle needs width_m")
        return self


RESTRAINTS = {kind: derived(make, RestraintTable, word=("kind", kind)) for kind, make in MAKERS.items()}
if TYPE_CHECKING:
    Restraints = RestraintTable
else:
    Restraints = choice("kind", RESTRAINTS)


def stiffness_notes(study: Mapping[str, Any]) -> list[Fact]:
    """Return the note on the restraints of a study file (as plain values) whose stiffness is not given."""
    tables = dict(study.get("restraints") or {})
    for block in study.get("blocks") or ():
        if isinstance(block.get("restraint"), dict):
            tables[f"the restraint of {block.get('name') or block.get('catalogue') or 'a block'}"] = block["restraint"]
    usual = {kind: table.model_fields.get("stiffness_n_per_mm") for kind, table in RESTRAINTS.items()}
    assumed = {
        listed_name(name): default_of(field)
        for name, table in tables.items()
        if table.get("stiffness_n_per_mm") is None and (field := usual[table["kind"]]) is not None
    }
    stiffnesses = {"stiffnesses": [*assumed.values()]}
    return [Fact("restraint.stiffness_assumed", names=tuple(assumed), more=stiffnesses)] if assumed else []


SCENE = {
    *("depth_m", "round"),
    *("placed", "mass_kg", "cm_offset_mm", "lean_deg", "restraint", "bed_settlement_mm"),
    *("wall_gap_mm", "wall_height_m", "wall_restitution", "front_gap_mm"),
    *("edge_distance_mm", "edge_distance_back_mm", "falls_when"),
    *("friction", "friction_dispersion", "contact", "trip_mm"),
}
"""Keys of what stands around a block, or holds it, and of its plan."""


class BlockTable(Table):
    """One block: a catalogue name, or outer sizes, or slenderness and size."""

    catalogue: Annotated[str | None, Field(description="Name of a catalogue item (see `toppling catalogue`).")] = None
    placed: Annotated[
        bool,
        Field(
            description="The catalogue item as it usually stands, unfixed: back to a wall at the catalogue's "
            "gap, or free."
        ),
    ] = False
    name: Annotated[
        str | None, KeyInfo("what it is"), Field(min_length=1, max_length=200, description="Label in results.")
    ] = None
    width_m: Annotated[
        float | None,
        KeyInfo(above=0.0),
        Field(description="Full size in the direction in which it tips, m (of a bookcase, its depth)."),
    ] = None
    height_m: Annotated[float | None, KeyInfo(above=0.0), Field(description="Full height, m.")] = None
    cm_height_m: Annotated[
        float | None,
        KeyInfo("mid-height", above=0.0),
        Field(description="Height of the centre of mass, m; inertia_factor must come with it."),
    ] = None
    inertia_factor: Annotated[
        float | None, KeyInfo("4/3", above=1.0, at_most=2.0), Field(description="I_O/(m R²), above 1 to 2.")
    ] = None
    alpha_rad: Annotated[
        float | None, KeyInfo(above=0.0, below=0.5 * math.pi), Field(description="Slenderness, rad, instead of sizes.")
    ] = None
    R_m: Annotated[float | None, KeyInfo(above=0.0), Field(description="Size R, m, instead of sizes.")] = None
    depth_m: Annotated[
        float | None,
        KeyInfo("the catalogue's", above=0.0),
        Field(description="Full size in the other horizontal direction, at least width_m; needed where both shake."),
    ] = None
    round: Annotated[
        bool,
        Field(
            description="Whether its base is round (a vase, a bottle); its planar result is then called possibly "
            "unconservative."
        ),
    ] = False
    mass_kg: Annotated[
        float | None, KeyInfo("needed by restraints only", above=0.0), Field(description="Mass, kg.")
    ] = None
    cm_offset_mm: Annotated[
        float, Field(description="Centre of mass in front of the middle (behind it: negative), mm.")
    ] = 0.0
    lean_deg: Annotated[
        float, Field(description="Lean, or slope of the floor, to the front (to the back: negative), °.")
    ] = 0.0
    wall_gap_mm: Annotated[
        float | None,
        KeyInfo("no wall"),
        Field(
            ge=0.0,
            description="Clear distance to a wall behind it, mm; 0 touches. The front is the side away from the wall.",
        ),
    ] = None
    wall_height_m: Annotated[
        float | None, KeyInfo("its upper edge", above=0.0), Field(description="Height at which it meets the wall, m.")
    ] = None
    wall_restitution: Annotated[
        float | None,
        KeyInfo("from its geometry"),
        Field(ge=0.0, le=1.0, description="Velocity after over velocity before an impact at the wall."),
    ] = None
    front_gap_mm: Annotated[
        float | None,
        KeyInfo("no wall in front", above=0.0),
        Field(description="Clear distance to a second wall in front (a niche), mm."),
    ] = None
    bed_settlement_mm: Annotated[
        float | None,
        KeyInfo("a rigid floor", above=0.0),
        Field(
            description="Settlement of a soft bed (carpet, mat) under its whole width by its weight, mm; for "
            '`viscous`, or `rest = "soft"`.'
        ),
    ] = None
    restraint: Annotated[
        str | Restraints | None,
        KeyInfo("none"),
        Field(description="Name of a table of `restraints`, or such a table."),
    ] = None
    edge_distance_mm: Annotated[
        float | None,
        KeyInfo("no edge in front"),
        Field(
            ge=0.0,
            description="Clear distance from the foot to the front edge of its shelf, bench or pedestal, mm. For "
            "fragility studies with [friction], and blocks that stand free and upright with their "
            "mass in the middle.",
        ),
    ] = None
    edge_distance_back_mm: Annotated[
        float | None, KeyInfo("no edge behind"), Field(ge=0.0, description="The same to the edge behind, mm.")
    ] = None
    falls_when: Annotated[
        str | None,
        one_of(FALLS_WHEN),
        KeyInfo("centre"),
        Field(
            description="It falls off when its centre of mass (a slip of the distance and half its width), or "
            "its foot, has slid over the edge."
        ),
    ] = None

    friction: Annotated[
        float | None,
        KeyInfo("that of [friction]"),
        Field(
            ge=0.05,
            le=2.0,
            description="Its own static coefficient of friction, or its median. For fragility studies with "
            "[friction]; not in `blocks_file`.",
        ),
    ] = None
    friction_dispersion: Annotated[
        float | None,
        KeyInfo("taken as known exactly, with a note"),
        Field(gt=0.0, le=1.0, description="Dispersion of its own lognormal coefficient."),
    ] = None
    contact: Annotated[
        str | None,
        KeyInfo("that of [friction]"),
        Field(
            description=f"Instead of friction: {', '.join(CONTACTS)} (values by judgement), with its own kinetic ratio."
        ),
    ] = None
    trip_mm: Annotated[
        float | None,
        KeyInfo("that of [friction]"),
        Field(
            ge=1.0,
            le=10_000.0,
            description="Its own clear distance from the foot to an obstacle, mm. For fragility studies with "
            "[friction]; not in `blocks_file`.",
        ),
    ] = None

    @field_validator("restraint", mode="before")
    @classmethod
    def _inline(cls, value: Any) -> Any:
        if not isinstance(value, dict):
            return value
        try:
            return TypeAdapter(Restraints).validate_python(value)
        except ValidationError as error:
            raise ValueError(refusal(error, value, Restraints)[0]) from None

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        ways = (
            self.catalogue is not None,
            self.width_m is not None and self.height_m is not None,
            self.alpha_rad is not None and self.R_m is not None,
        )
        given = {name for name in self.model_fields_set if getattr(self, name) is not None} - SCENE
        allowed = (
            {"catalogue", "cm_height_m", "inertia_factor", "name"},
            {"width_m", "height_m", "cm_height_m", "inertia_factor", "name"},
            {"alpha_rad", "R_m", "inertia_factor", "name"},
        )
        if sum(ways) != 1 or not given <= allowed[ways.index(True)]:
            raise ValueError(
                "a block needs either catalogue, or width_m and height_m, or alpha_rad and R_m, got "
                + (", ".join(sorted(given)) or "nothing")
            )
        if self.placed and self.catalogue is None:
            raise ValueError("placed belongs to items of the catalogue: give wall_gap_mm for other blocks")
        if self.placed and self.wall_gap_mm is not None:
            raise ValueError("the place of an item is given by placed or by wall_gap_mm, got both")
        if self.wall_gap_mm is None and not self._placed_gap():
            for name in ("wall_height_m", "wall_restitution", "front_gap_mm"):
                if getattr(self, name) is not None:
                    raise ValueError(f"{name} needs wall_gap_mm: there is no wall")
        if self.falls_when is not None and self.edge_distance_mm is None and self.edge_distance_back_mm is None:
            raise ValueError("falls_when needs edge_distance_mm or edge_distance_back_mm: there is no edge")
        self._check_friction()
        return self

    def _check_friction(self) -> None:
        """Raise a ValueError for friction that is given twice, or a dispersion without it."""
        if self.friction is not None and self.contact is not None:
            raise ValueError("a block has friction or contact, got both")
        if self.friction_dispersion is not None and self.friction is None:
            raise ValueError("friction_dispersion goes with friction")
        if self.contact is not None:
            contact_named(self.contact)

    def build(self, restraints: Mapping[str, Restraint] | None = None) -> Block:
        """Make the block; ValueError where its values are out of range, or a name is in no catalogue or table."""
        sizes = self._sizes()
        return replace(
            sizes,
            depth=sizes.depth if self.depth_m is None else self.depth_m,
            round=self.round,
            mass=self.mass_kg,
            cm_offset=1e-3 * self.cm_offset_mm,
            lean=math.radians(self.lean_deg),
            wall=self._wall(),
            bed=None if self.bed_settlement_mm is None else Bed(1e-3 * self.bed_settlement_mm),
            restraint=self._restraint(restraints or {}),
            edge=edge_at(self.edge_distance_mm, self.edge_distance_back_mm, self.falls_when),
        )

    @property
    def own_friction(self) -> tuple[Friction, float | None] | None:
        """Its own coefficient of friction, and kinetic over static friction where a contact tells it; or None."""
        if self.contact is not None:
            contact = contact_named(self.contact)
            return contact.friction, contact.kinetic_ratio
        if self.friction is None:
            return None
        return friction_from(self.friction, self.friction_dispersion), None

    def _placed_gap(self) -> float | None:
        """Return the gap (m) behind an item of the catalogue as it is usually placed; None where there is no wall."""
        if not self.placed or self.catalogue is None or self.catalogue not in catalogue:
            return None  # (a name that is not in the catalogue is refused when the block is made)
        return catalogue.item(self.catalogue).wall_gap

    def _wall(self) -> Wall | None:
        gap = self._placed_gap() if self.wall_gap_mm is None else 1e-3 * self.wall_gap_mm
        if gap is None:
            return None
        front = None if self.front_gap_mm is None else 1e-3 * self.front_gap_mm
        return Wall(gap, self.wall_height_m, self.wall_restitution, front)

    def _restraint(self, restraints: Mapping[str, Restraint]) -> Restraint | None:
        if self.restraint is None:
            return None
        if isinstance(self.restraint, RestraintTable):
            made: Restraint = self.restraint.build()
            return made
        if self.restraint not in restraints:
            known = ", ".join(map(repr, restraints)) or "none"
            raise ValueError(f"restraint must name one of restraints ({known}), got {shown(self.restraint)}")
        return restraints[self.restraint]

    def _sizes(self) -> Block:
        if self.catalogue is not None:
            try:
                block = catalogue[self.catalogue]
            except KeyError as error:
                raise ValueError(error.args[0]) from None
            listed = catalogue.placed(self.catalogue) if self.placed else block
            name = listed.name if self.name is None else self.name
            # (the depth that is given replaces the catalogue's, and a round piece has none of its own)
            return Block(
                block.width,
                block.height,
                self.cm_height_m,
                self.inertia_factor,
                name,
                depth=None if self.round else block.depth,
            )
        if self.alpha_rad is not None and self.R_m is not None:
            factor = 4.0 / 3.0 if self.inertia_factor is None else self.inertia_factor
            return Block.from_slenderness(self.alpha_rad, self.R_m, factor, self.name)
        assert self.width_m is not None  # one of three ways, checked above
        assert self.height_m is not None
        return Block(self.width_m, self.height_m, self.cm_height_m, self.inertia_factor, self.name)


def edge_at(front: float | None, back: float | None, falls_when: str | None) -> Edge | None:
    """Return the edge at distances in mm from the foot; None where there is none. ValueError as of `Edge`."""
    if front is None and back is None:
        return None
    sides = [None if one is None else 1e-3 * one for one in (front, back)]
    return Edge(sides[0], sides[1], falls_when or CENTRE)


def read_blocks(file: Path, restraints: Mapping[str, Restraint] | None = None) -> tuple[Block, ...]:
    """Read ``[[blocks]]`` from the lines of a CSV file; StudyError names the file, the line and the column."""
    table = CsvTable(file, KIND)
    found: dict[str, tuple[int, Block]] = {}
    for line in table:
        slender = line.text("alpha_rad") or line.text("R_m")
        block = _slender(line) if slender else block_of_line(line, line.name_in("name") or line.text("catalogue"))
        block = _surrounded(line, block, restraints or {})
        if block.label in found:
            before = f"{block.label!r} is taken by line {found[block.label][0]}"
            line.refuse("name", f"must be another name, {before}" if line.text("name") else f"is needed: {before}")
        found[block.label] = (line.number, block)
    if not found:
        raise KIND.error(f"{file}: has a header but no blocks")
    blocks = tuple(block for _, block in found.values())
    warn(block_doubts(blocks))
    return blocks


def _surrounded(line: CsvLine, block: Block, restraints: Mapping[str, Restraint]) -> Block:
    """Return the block of a line with its wall, restraint, offset, lean and edge."""
    named = line.text("restraint")
    if named and named not in restraints:
        known = ", ".join(map(repr, restraints)) or "none"
        line.refuse("restraint", f"must name one of the study's restraints ({known}), got {shown(named)}")
    placed = placed_of_line(line, planned_of_line(line, block))
    try:
        held = replace(placed, restraint=restraints[named] if named else None)
    except ValueError as error:
        line.refuse("restraint", str(error))
    return _near_edge(line, held)


def _near_edge(line: CsvLine, block: Block) -> Block:
    """Return the block of a line with its edge, from the columns of a study's keys."""
    front, back = (line.number_in(f"edge_distance{side}_mm", at_least=0.0) for side in ("", "_back"))
    when = line.text("falls_when")
    if when and front is None and back is None:
        line.refuse("falls_when", "needs edge_distance_mm or edge_distance_back_mm: there is no edge")
    if when and when not in FALLS_WHEN:
        line.refuse("falls_when", f"must be one of {', '.join(FALLS_WHEN)}, got {shown(when)}")
    try:
        return replace(block, edge=edge_at(front, back, when or None))
    except ValueError as error:
        line.refuse("edge_distance_mm" if front is not None else "edge_distance_back_mm", str(error))


def planned_of_line(line: CsvLine, block: Block) -> Block:
    """Return the block of a line with its depth, where it gives one, and whether it is round."""
    depth, is_round = line.number_in("depth_m", above=0.0), line.yes_in("round")
    try:
        return replace(block, depth=block.depth if depth is None else depth, round=is_round)
    except ValueError as error:
        line.refuse("depth_m" if depth is not None else "round", str(error))


def placed_of_line(line: CsvLine, block: Block) -> Block:
    """Return the block of a line with its mass, wall, bed, offset and lean, from the columns of these names."""
    gap = line.number_in("wall_gap_mm", at_least=0.0)
    wall = None if gap is None else Wall(1e-3 * gap)
    if line.yes_in("placed"):
        if not line.text("catalogue"):
            line.refuse("placed", "belongs to items of the catalogue: give wall_gap_mm for other blocks")
        if wall is not None:
            line.refuse("placed", "must be empty beside wall_gap_mm, which says where the block stands")
        listed = catalogue.placed(line.text("catalogue"))
        wall = listed.wall
        if not line.text("name"):
            block = replace(block, name=listed.name)
    mass, offset = line.number_in("mass_kg", above=0.0), line.number_in("cm_offset_mm")
    lean, depth = line.number_in("lean_deg"), line.number_in("bed_settlement_mm", above=0.0)
    try:
        return replace(
            block,
            mass=mass,
            cm_offset=1e-3 * (offset or 0.0),
            lean=math.radians(lean or 0.0),
            wall=wall,
            bed=None if depth is None else Bed(1e-3 * depth),
        )
    except ValueError as error:
        of_bed = "wall_gap_mm" if depth is None else "bed_settlement_mm"
        column = {"cm_offset": "cm_offset_mm", "lean": "lean_deg"}.get(str(error).partition(" ")[0], of_bed)
        line.refuse(column, str(error))


def block_of_line(line: CsvLine, name: str = "") -> Block:
    """Return the block of a line that holds outer sizes or a name of the catalogue."""
    listed = line.text("catalogue")
    width, height = line.number_in("width_m", above=0.0), line.number_in("height_m", above=0.0)
    cm_height, factor = line.number_in("cm_height_m", above=0.0), line.number_in("inertia_factor", above=1.0)
    depth = None
    if listed:
        if width is not None or height is not None:
            column = "width_m" if width is not None else "height_m"
            line.refuse(column, "must be empty beside a catalogue name, which gives the sizes")
        if listed not in catalogue:
            near = difflib.get_close_matches(listed, catalogue, n=1, cutoff=0.4)
            hint = f"; did you mean {near[0]!r}?" if near else ", `toppling catalogue` lists them"
            line.refuse("catalogue", f"there is no item {shown(listed)}{hint}")
        item = catalogue[listed]
        width, height, depth = item.width, item.height, item.depth
    if width is None or height is None:
        column = "width_m" if width is None else "height_m"
        others = ", or alpha_rad and R_m" if "alpha_rad" in line.table.kind.columns else ""
        line.refuse(column, f"is empty: a line needs a catalogue name, or width_m and height_m{others}")
    try:
        return Block(width, height, cm_height, factor, name or None, depth=depth)
    except ValueError as error:
        _refuse(line, error, "catalogue" if listed else "width_m")


def _refuse(line: CsvLine, error: ValueError, column: str) -> NoReturn:
    """Raise an error about a block as an error of the cell that holds the value, or else of a `column`."""
    word, _, what = str(error).partition(" ")
    # (a missing value may be an empty cell; a wrong value may follow from sizes given in another way)
    if word in NAMED and (line.text(NAMED[word]) or what.startswith("must be given")):
        line.refuse(NAMED[word], what)
    line.refuse(column, str(error))


def _slender(line: CsvLine) -> Block:
    """Return the block of a line that holds slenderness and size."""
    beside = next((one for one in ("catalogue", "width_m", "height_m", "cm_height_m") if line.text(one)), None)
    if beside is not None:
        line.refuse(beside, "must be empty beside alpha_rad and R_m, which give the sizes")
    alpha, size = line.number_in("alpha_rad", above=0.0), line.number_in("R_m", above=0.0)
    if alpha is None or size is None:
        line.refuse("R_m" if size is None else "alpha_rad", "is empty: alpha_rad and R_m go together")
    factor = line.number_in("inertia_factor", above=1.0)
    more = {} if factor is None else {"inertia_factor": factor}
    try:
        return Block.from_slenderness(alpha, size, **more, name=line.name_in("name") or None)
    except ValueError as error:
        _refuse(line, error, "R_m")
