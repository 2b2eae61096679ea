"""Blocks of a study: the table ``[[blocks]]`` with restraints, and lines of a CSV file (``blocks_file``, inventory)."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Self

from pydantic import Field, TypeAdapter, ValidationError, create_model, field_validator, model_validator

from ...core.doubts import warn
from ...core.facts import Fact
from ...core.parameters import CHANCE, declared
from ...core.wording import listed_name
from ...models import Bed, Block, Edge, Restraint, Wall, catalogue
from ...models.block import HALF_DIAGONAL, SLENDERNESS, UNIFORM_INERTIA_FACTOR
from ...models.friction import CONTACTS, Friction, contact_named, friction_and_ratio
from ...models.plausibility import block_doubts
from ...models.scenes.restraint import KINDS, Strength
from .csv_table import CsvTable, TableKind
from .derived import Derived, choice, default_of, derived, in_si, keys_of
from .refusals import refusal
from .table import AMOUNT, KeyInfo, Label, Spread, Static, Table, Trip, shown

MOST_BLOCKS = 1_000_000
MAKERS: dict[str, Any] = {kind: getattr(Restraint, kind) for kind in KINDS}
"""Makers of each kind of restraint."""


class RestraintTable(Derived):
    """A restraint: kind, position, strength.

    kind: Kind of restraint; straps and cables act to the front only.
    cost: Cost of fixing one piece of an inventory with it.
    target: Probability of falling, in `hazard.years` or at the one level, that the strength must reach. The strength is
        searched from an eighth to 32 times `strength_n`, within 5 %. For fragility studies on one floor at levels that
        all motions share.
    """

    kind: str
    strength_n: Annotated[Strength, Field(description=declared(Restraint)["strength"].sentence)]
    cost: Annotated[Annotated[float, AMOUNT] | None, KeyInfo("not known", unit="the inventory's currency")] = None
    target: Annotated[Annotated[float, CHANCE] | None, KeyInfo("no strength is looked for")] = None

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
_READER: TypeAdapter[RestraintTable] = TypeAdapter(Restraints, config={"defer_build": True})


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


PARTS: dict[str, tuple[Any, dict[str, str]]] = {
    "block": (Block, {}),
    "wall": (Wall, {"gap": "wall_gap", "height": "wall_height", "restitution": "wall_restitution"}),
    "bed": (Bed, {"settlement": "bed_settlement"}),
    "edge": (Edge, {"front": "edge_distance", "back": "edge_distance_back"}),
}
"""Objects that a block's table makes, with the names in the table if they differ there."""
FIELDS: dict[str, Any] = {}
FACTORS: dict[str, dict[str, tuple[str, float]]] = {}
for part, (make, names) in PARTS.items():
    of_part, FACTORS[part] = keys_of(
        make, names=names, defaults=dict.fromkeys(("width", "height", "gap", "settlement"))
    )
    FIELDS |= of_part
SIZES = ("width_m", "height_m", "cm_height_m", "inertia_factor")


class _Piece(Table):
    """A catalogue name or outer sizes, and the surroundings of a piece.

    catalogue: Name of a catalogue item (see `toppling catalogue`).
    placed: The catalogue item in its usual place, unfixed: back to a wall at the catalogue's gap, or free.
    """

    catalogue: str | None = None
    placed: bool = False

    @property
    def ways(self) -> dict[str, tuple[str, ...]]:
        """The ways to give a size: the keys that do, and those that may come with them."""
        return {"catalogue": SIZES[2:], "width_m and height_m": SIZES[2:]}

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        given = {key for key in {"catalogue", *SIZES, "alpha_rad", "R_m"} if self.given(key) is not None}
        if not any({*way.split(" and ")} <= given <= {*way.split(" and "), *more} for way, more in self.ways.items()):
            raise ValueError(
                f"a block needs either {', or '.join(self.ways)}, got {', '.join(sorted(given)) or 'nothing'}"
            )
        if self.catalogue is not None and self.catalogue not in catalogue:
            try:
                catalogue[self.catalogue]
            except KeyError as error:
                raise ValueError(f"catalogue: {error.args[0]}") from None
        if self.placed and self.catalogue is None:
            raise ValueError("placed belongs to items of the catalogue: give wall_gap_mm for other blocks")
        if self.placed and self.given("wall_gap_mm") is not None:
            raise ValueError("placed must be left out beside wall_gap_mm, which says where the block stands")
        if self.given("wall_gap_mm") is None and self._usual_wall is None:
            for key in ("wall_height_m", "wall_restitution", "front_gap_mm"):
                if self.given(key) is not None:
                    raise ValueError(f"{key} needs wall_gap_mm: there is no wall")
        if self.given("falls_when") and not in_si(self, FACTORS["edge"]).keys() & {"front", "back"}:
            raise ValueError("falls_when needs edge_distance_mm or edge_distance_back_mm: there is no edge")
        return self

    def piece(self, name: str | None, restraint: Restraint | None = None) -> Block:
        """Make the block; ValueError if its values do not go together."""
        scene, wall, bed, edge = (in_si(self, FACTORS[part]) for part in PARTS)
        sizes = self._sizes(
            {key: scene.pop(key) for key in ("width", "height", "cm_height", "inertia_factor") if key in scene}
        )
        if self.placed and name is None:
            name = catalogue.placed(str(self.catalogue)).name
        if not wall and self._usual_wall is not None:
            wall = {"gap": self._usual_wall}
        return replace(
            sizes,
            **{"name": name, "depth": None if self.given("round") else sizes.depth, **scene},
            wall=Wall(**{"gap": self._usual_wall, **wall}) if wall else None,
            bed=Bed(**bed) if bed else None,
            edge=Edge(**edge) if edge else None,
            restraint=restraint,
        )

    @property
    def _usual_wall(self) -> float | None:
        """The gap (m) behind an item of the catalogue as it is usually placed; None if there is no wall."""
        return catalogue.item(self.catalogue).wall_gap if self.placed and self.catalogue else None

    def _sizes(self, given: dict[str, Any]) -> Block:
        """Return the block of sizes (SI) alone, or of the catalogue's."""
        if self.catalogue is None:
            return Block(**given)
        block = catalogue[self.catalogue]
        return Block(block.width, block.height, **given, depth=block.depth)


if TYPE_CHECKING:
    PieceTable = _Piece
else:
    PieceTable = create_model("PieceTable", __base__=_Piece, __module__=__name__, **FIELDS)


class BlockTable(PieceTable):
    """One block: a catalogue name, or outer sizes, or slenderness and size.

    name: Label in results.
    alpha_rad: Slenderness, instead of sizes.
    R_m: Size R, instead of sizes.
    restraint: Name of a table of `restraints`, or such a table.
    """

    name: Annotated[Label | None, KeyInfo("what it is")] = None
    alpha_rad: Annotated[float, SLENDERNESS] | None = None
    R_m: Annotated[float, HALF_DIAGONAL] | None = None
    restraint: Annotated[str | Restraints | None, KeyInfo("none")] = None
    friction: Annotated[Static | None, KeyInfo("that of [friction], which it needs; not in `blocks_file`")] = None
    friction_dispersion: Annotated[Spread | None, KeyInfo("taken as known exactly, with a note")] = None
    contact: Annotated[
        str | None,
        KeyInfo("that of [friction]"),
        Field(
            description=f"Instead of friction: {', '.join(CONTACTS)} (values by judgement), with its own kinetic ratio."
        ),
    ] = None
    trip_mm: Annotated[Trip | None, KeyInfo("that of [friction], which it needs; not in `blocks_file`")] = None

    @field_validator("restraint", mode="before")
    @classmethod
    def _inline(cls, value: Any) -> Any:
        if not isinstance(value, dict):
            return value
        try:
            return _READER.validate_python(value)
        except ValidationError as error:
            raise ValueError(refusal(error, value, Restraints)[0]) from None

    @property
    def ways(self) -> dict[str, tuple[str, ...]]:
        return {**super().ways, "alpha_rad and R_m": SIZES[3:]}

    @model_validator(mode="after")
    def _one_friction(self) -> Self:
        if self.friction is not None and self.contact is not None:
            raise ValueError("a block has friction or contact, got both")
        if self.friction_dispersion is not None and self.friction is None:
            raise ValueError("friction_dispersion goes with friction")
        if self.contact is not None:
            contact_named(self.contact)
        return self

    def build(self, restraints: Mapping[str, Restraint] | None = None) -> Block:
        """Make the block; ValueError if its values are out of range, or a name is in no table."""
        name = self.name or (None if self.placed or self.catalogue is None else catalogue[self.catalogue].name)
        return self.piece(name, self._restraint(restraints or {}))

    def _sizes(self, given: dict[str, Any]) -> Block:
        if self.alpha_rad is None or self.R_m is None:
            return super()._sizes(given)
        return Block.from_slenderness(self.alpha_rad, self.R_m, given.get("inertia_factor", UNIFORM_INERTIA_FACTOR))

    @property
    def own_friction(self) -> tuple[Friction, float | None] | None:
        """Its own coefficient of friction, and kinetic over static friction if a contact gives it; or None."""
        if self.contact is None and self.friction is None:
            return None
        return friction_and_ratio(self.contact, self.friction, self.friction_dispersion)

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


KIND = TableKind(
    "file of blocks",
    tuple(
        key for key in BlockTable.model_fields if key not in ("friction", "friction_dispersion", "contact", "trip_mm")
    ),
    MOST_BLOCKS,
    256 * 2**20,
)


def read_blocks(file: Path, restraints: Mapping[str, Restraint] | None = None) -> tuple[Block, ...]:
    """Read ``[[blocks]]`` from the lines of a CSV file; StudyError names the file, the line and the column."""
    table = CsvTable(file, KIND)
    blocks_by_label: dict[str, tuple[int, Block]] = {}
    for line in table:
        line.name_in("name")
        block = line.made(BlockTable, lambda made: made.build(restraints))
        if block.label in blocks_by_label:
            before = f"{block.label!r} is taken by line {blocks_by_label[block.label][0]}"
            line.refuse("name", f"must be another name, {before}" if line.text("name") else f"is needed: {before}")
        blocks_by_label[block.label] = (line.number, block)
    if not blocks_by_label:
        raise KIND.error(f"{file}: has a header but no blocks")
    blocks = tuple(block for _, block in blocks_by_label.values())
    warn(block_doubts(blocks))
    return blocks
