"""Inventories in CSV files and workbooks: a line for each kind of piece on a floor, which `contents` holds."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Self

from pydantic import Field, create_model, model_validator

from ...core import checks
from ...core.doubts import warn
from ...core.parameters import SHARE
from ...models import Block
from ...models.friction import CONTACTS, LOCKED, ROLLING, UNLOCKED, friction_and_ratio
from ...models.laws import Restitution
from ..file.blocks import PieceTable
from ..file.csv_table import NO, YES, CsvLine, CsvTable, TableKind
from ..file.derived import in_si, keys_of
from ..file.table import Spread, Static, one_of, shown
from ..file.workbook import CURRENCIES, Numeric
from ..plan.slides import Slides
from ..text.error import StudyError
from .consequences import DISTRIBUTIONS, LOGNORMAL, Consequence, Injury, Median, Persons, Scatter
from .contents import MAX_ROWS, Contents, Inventory, Stand, floor_text, row_doubts
from .kits import Kit

MEDIANS = {"cost": "cost_median", "downtime": "downtime_median_days"}
NEEDED = {
    **{f"{kind}_{name}": median for kind, median in MEDIANS.items() for name in ("dispersion", "distribution")},
    **{"persons_exposed": "injury_probability", "injury_probability": "persons_exposed"},
    "friction_dispersion": "friction",
}
"""Columns that need another one."""
FIELDS, FACTORS = keys_of(Contents)
"""Columns that are parameters of `Contents`."""
if TYPE_CHECKING:
    ContentsTable = PieceTable
else:
    ContentsTable = create_model("ContentsTable", __base__=PieceTable, __module__=__name__, **FIELDS)


class LineTable(ContentsTable):
    """A line of an inventory: pieces of one kind on one floor, and the consequences of their fall.

    item: Its name.
    floor: The floor of the pieces: 0 is the ground.
    restitution: As e.
    currency: Currency of all amounts.
    consequence: Consequences of a fall: words, or none.
    anchored: Fixed: yes, no, or the name of a restraint.
    cost_median: Median cost of a fall.
    cost_dispersion: Dispersion of the cost.
    cost_distribution: Of the cost.
    downtime_median_days: Median downtime, days.
    downtime_dispersion: Dispersion of the downtime.
    downtime_distribution: Of the downtime.
    persons_exposed: Persons in the area of its fall.
    injury_probability: Chance that one is hurt.
    class: Class whose pieces share an uncertainty.
    contact: Contact of the pieces with their floor.
    support: The bench or platform below.
    """

    item: str | None = None
    floor: str | None = None
    restitution: Restitution | None = None
    currency: str | None = None
    consequence: str | None = None
    anchored: str | None = None
    cost_median: Median | None = None
    cost_dispersion: Scatter | None = None
    cost_distribution: Annotated[str | None, one_of(DISTRIBUTIONS)] = None
    downtime_median_days: Median | None = None
    downtime_dispersion: Scatter | None = None
    downtime_distribution: Annotated[str | None, one_of(DISTRIBUTIONS)] = None
    persons_exposed: Persons | None = None
    injury_probability: Annotated[float, SHARE] | None = None
    class_: Annotated[str | None, Field(alias="class")] = None
    contact: Annotated[str | None, one_of((*CONTACTS, ROLLING, LOCKED, UNLOCKED))] = None
    friction: Static | None = None
    friction_dispersion: Spread | None = None
    support: str | None = None

    @model_validator(mode="after")
    def _together(self) -> Self:
        if not self.floor:
            raise ValueError("floor is empty: it must say where the item stands, 0 is the ground")
        if re.fullmatch(r"[-+]?[\d.,]+", self.floor) and not (
            self.floor.isascii() and self.floor.isdecimal() and len(self.floor) < 10
        ):
            raise ValueError(f"floor must be a whole number from 0 (ground), or a name, got {shown(self.floor)}")
        if self.given("e") is not None and self.restitution is not None:
            raise ValueError("restitution is the same as e: give one of them")
        if self.given("value") is not None and self.cost_median is not None:
            raise ValueError("cost_median takes the place of value: give one of them")
        for column, other in NEEDED.items():
            if self.given(column) is not None and self.given(other) is None:
                raise ValueError(f"{column} needs {other}, which is empty")
        if self.friction is not None and self.contact in (ROLLING, UNLOCKED):
            raise ValueError("friction must be empty on castors that are not locked: they roll, which is not modelled")
        if self.friction is not None and self.contact in CONTACTS:
            raise ValueError("friction takes the place of contact: give one of them")
        return self

    def contents(
        self, kits: Mapping[str, Kit], sliding: Slides | None, stands: Mapping[str, Stand], number: int
    ) -> Contents:
        """Return the contents, with the study's kits, friction and supports; ValueError that names a column."""
        options = in_si(self, FACTORS)
        held = (self.anchored or "").lower()
        kit = None if held in {"", *YES, *NO} else kits.get(self.anchored or "")
        block = self.piece(None)
        if options.get("anchor_height", 0.0) > block.height:
            raise ValueError(f"anchor_height_m must be at most {block.height:g} m, got {options['anchor_height']:g}")
        if kit is None and held not in {"", *YES, *NO}:
            named = f" or the name of a restraint of the study ({', '.join(map(repr, kits))})" if kits else ""
            raise ValueError(f"anchored must be yes or no{named}, got {shown(self.anchored)}")
        if kit is not None:
            block = _held(kit, block, options.get("anchor_height"))
        slides = self._slides(sliding)
        if held not in YES and slides["friction"] is None:
            self._refuse_unknown_slides(slides["contact"] == ROLLING)
        if "trip" not in options and slides["friction"] is not None and sliding is not None:
            options["trip"] = sliding.trip
        if self.support and self.support not in stands:
            known = f"one of {', '.join(map(repr, stands))}" if stands else "empty: the study has no [[supports]]"
            raise ValueError(f"support must be {known}, got {shown(self.support)}")
        if re.fullmatch(r"(?i)\W+|n[./]a\.?", self.class_ or ""):
            raise ValueError(f"class must be a name, or empty if equal sizes are a class, got {shown(self.class_)}")
        words = [word.strip().lower() for word in re.split(r"[|,;]", self.consequence or "")]
        if self.restitution is not None:
            options["e"] = self.restitution
        assert self.floor is not None  # (checked above)
        return Contents(
            label=self.item or self.catalogue or f"line {number}",
            block=block,
            floor=int(self.floor) if self.floor.isdecimal() else self.floor,
            consequences=tuple(word for word in words if word),
            anchored=held in YES,
            piece_class=self.class_ or "",
            kit="" if kit is None else kit.name,
            cost=self._consequence("cost"),
            downtime=self._consequence("downtime"),
            injury=None
            if self.persons_exposed is None
            else Injury(self.persons_exposed, self.injury_probability or 0.0),
            stand=stands.get(self.support or ""),
            **options,
            **slides,
        )

    def _refuse_unknown_slides(self, rolls: bool) -> None:
        """Raise a ValueError for an edge or an obstacle near a piece whose slips are not known."""
        for column in ("edge_distance_mm", "edge_distance_back_mm", "trip_mm"):
            if self.given(column) is not None and rolls:
                raise ValueError(f"{column} must be empty on castors: rolling is not modelled")
            if self.given(column) is not None:
                raise ValueError(f"{column} needs a friction: give contact or friction, or the study's [friction]")

    def _consequence(self, kind: str) -> Consequence | None:
        """Return the cost or downtime of a piece, None if no median is given."""
        median = self.given(MEDIANS[kind])
        if median is None:
            return None
        dispersion, form = self.given(f"{kind}_dispersion") or 0.0, self.given(f"{kind}_distribution") or LOGNORMAL
        try:
            return Consequence(median, dispersion, form)
        except ValueError as error:  # (median and distribution are checked above)
            raise ValueError(f"{kind}_{error}") from None

    def _slides(self, sliding: Slides | None) -> dict[str, Any]:
        """Return its contact and its friction, by default the study's friction."""
        if self.contact in (ROLLING, UNLOCKED):
            return {"contact": ROLLING, "friction": None}
        friction, ratio = (None, None) if sliding is None else (sliding.friction, sliding.kinetic_ratio)
        if self.contact in CONTACTS:
            friction, ratio = friction_and_ratio(self.contact, None, None)
        elif self.friction is not None:
            friction, _ = friction_and_ratio(None, self.friction, self.friction_dispersion)
        given = {} if ratio is None else {"kinetic_ratio": ratio}
        return {"contact": self.contact or "", "friction": friction, **given}


def _held(kit: Kit, block: Block, height: float | None) -> Block:
    """Return the block of a line with the kit that holds it."""
    try:
        return kit.held(block, height)
    except ValueError as error:
        raise ValueError(f"anchored {error}") from None


COLUMNS = tuple(field.alias or key for key, field in LineTable.model_fields.items())
"""Columns of an inventory file, in any order."""


class InventoryError(StudyError):
    """Error for an inventory that cannot be used: one sentence with file, line, column, value and allowed values."""


KIND = TableKind("inventory", COLUMNS, MAX_ROWS, 16 * 2**20, InventoryError, "inventory")


def read_inventory(
    path: str | os.PathLike[str],
    floors: Sequence[str] | None = None,
    kits: Mapping[str, Kit] | None = None,
    sliding: Slides | None = None,
    stands: Mapping[str, Stand] | None = None,
) -> Inventory:
    """Read an inventory from a CSV file or a workbook.

    Parameters
    ----------
    path : path
        A table in UTF-8 separated by commas, semicolons or tabs, one line for each kind of piece on a floor. Or a
        workbook (``.xlsx``, ``.xlsm``) with such a table in the sheet ``inventory``, or in its first visible sheet.
    floors : sequence of str, optional
        The existing floors; any floor is allowed if not given.
    kits : mapping of str to Kit, optional
        The kits that the column ``anchored`` can name.
    sliding : Slides, optional
        The friction of lines that give none, the kinetic ratio of those that give no contact, and the distance to an
        obstacle of those that give none.
    stands : mapping of str to Stand, optional
        The benches and platforms that the column ``support`` can name.

    Raises
    ------
    InventoryError
        One sentence that names file, line (row of a workbook), column, value and the allowed values.

    Notes
    -----
    The header names the columns, in any order (docs/study_buildings.md explains them and workbooks). Empty cells
    are treated as if the column were not there. Lines that start with # are comments.

    Warnings (`toppling.core.doubts.ImplausibleInput`) are notes of studies. They name other lines with fewer cells than
    the header, and lines that begin with # and a word. They name hidden rows, columns and sheets that are read, and
    visible sheets that are not; and sizes that are not plausible.

    Examples
    --------
    >>> from toppling.studies.inventory.reading import example_path
    >>> inventory = read_inventory(example_path())
    >>> len(inventory), inventory.pieces, inventory.currency
    (14, 54, 'EUR')
    """
    file = checks.path(path)
    table = CsvTable(file, KIND)
    if "floor" not in table.columns:
        raise InventoryError(f"{table.where}: column 'floor' is missing")
    if "catalogue" not in table.columns and not {"width_m", "height_m"} <= set(table.columns):
        raise InventoryError(f"{table.where}: columns must name catalogue, or width_m and height_m")
    read: list[tuple[CsvLine, Contents]] = []
    currency = sign_above = ""
    for line in table:
        read.append((line, _contents(line, kits or {}, sliding, stands or {})))
        if floors is not None and str(read[-1][1].floor) not in floors:
            line.refuse("floor", floor_text(floors, line.text("floor")))
        stated = line.text("currency")
        if stated and currency and stated != currency:
            line.refuse("currency", f"must be {currency!r} as in the {table.word}s above, got {stated!r}")
        currency = currency or stated
        for column, cell in line.cells.items():
            sign, wanted = cell.money if isinstance(cell, Numeric) else "", currency or sign_above
            if sign and wanted and not _currencies(sign) & _currencies(wanted):
                line.refuse(column, f"must be in {wanted} as the others are, got {cell} shown in {sign}")
            sign_above = sign or sign_above
    if not read:
        raise InventoryError(f"{file}: has a header but no items")
    try:
        inventory = Inventory(tuple(_told_apart(read)), currency)
        inventory.check_supports()
    except ValueError as error:
        raise InventoryError(f"{file}: {error}") from None
    warn(row_doubts(inventory.rows))
    return inventory


def _currencies(money: str) -> set[str]:
    """Return the possible currencies of a sign or a code, with itself."""
    return {money, *CURRENCIES.get(money, ())}


def example_path() -> str:
    """Return the path of the example inventory (a small clinic) that ships with the package."""
    return str(Path(__file__).parents[1] / "examples" / "inventory.csv")


def _told_apart(rows_read: Sequence[tuple[CsvLine, Contents]]) -> Iterator[Contents]:
    """Yield the rows with unique labels: the floor is added to labels that several lines have."""
    lines: dict[str, list[CsvLine]] = {}
    for line, row in rows_read:
        lines.setdefault(row.label, []).append(line)
    taken: dict[str, CsvLine] = {}
    for line, row in rows_read:
        label = row.label if len(lines[row.label]) == 1 else f"{row.label}, floor {row.floor}"
        if label in taken:
            line.refuse("item", f"must be another name, {label!r} is taken by {line.table.word} {taken[label].number}")
        taken[label] = line
        below = row.stands_on
        if len(lines.get(below, ())) > 1:
            below = f"{below}, floor {row.floor}"
        yield replace(row, label=label, stands_on=below)


def _contents(line: CsvLine, kits: Mapping[str, Kit], sliding: Slides | None, stands: Mapping[str, Stand]) -> Contents:
    """Return the contents that a line describes."""
    line.name_in("item")
    return line.made(LineTable, lambda made: made.contents(kits, sliding, stands, line.number))
