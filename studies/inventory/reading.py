"""Inventories in CSV files and workbooks: a line for each kind of piece on a floor, which `contents` holds."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from ...core import checks
from ...core.doubts import warn
from ...models import Block, Edge
from ...models.friction import CONTACTS, LOCKED, ROLLING, UNLOCKED, FixedFriction, LognormalFriction
from ...models.scenes.edge import FALLS_WHEN
from ...motions.floors.histories import DIRECTIONS
from ..codes.check import CLASSES
from ..file.blocks import block_of_line, placed_of_line, planned_of_line
from ..file.csv_table import NO, YES, CsvLine, CsvTable, TableKind
from ..file.table import shown
from ..file.workbook import CURRENCIES, Numeric
from ..plan.slides import Slides
from ..text.error import StudyError
from .consequences import DISTRIBUTIONS, LOGNORMAL, Consequence, Injury
from .contents import (
    LEAST_TRIP,
    MAX_COUNT,
    MAX_ROWS,
    MAX_TRIP,
    MAX_VALUE,
    Contents,
    Inventory,
    Stand,
    floor_text,
    row_doubts,
)
from .kits import Kit

COLUMNS = (
    "item",
    "catalogue",
    "width_m",
    "height_m",
    "cm_height_m",
    "inertia_factor",
    "depth_m",
    "round",
    "floor",
    "room",
    "direction",
    "count",
    "e",
    "restitution",
    "value",
    "currency",
    "consequence",
    "anchored",
    "anchoring_cost",
    "mass_kg",
    "wall_gap_mm",
    "cm_offset_mm",
    "lean_deg",
    "bed_settlement_mm",
    "code_class",
    "code_importance",
    "anchor_strength_n",
    "anchor_height_m",
    "cost_median",
    "cost_dispersion",
    "cost_distribution",
    "downtime_median_days",
    "downtime_dispersion",
    "downtime_distribution",
    "persons_exposed",
    "injury_probability",
    "class",
    "contact",
    "friction",
    "friction_dispersion",
    "edge_distance_mm",
    "edge_distance_back_mm",
    "falls_when",
    "trip_mm",
    "stands_on",
    "support",
)
"""Columns of an inventory file, in any order."""


class InventoryError(StudyError):
    """Error for an inventory that cannot be used: one sentence with file, line, column, value and what is allowed."""


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
        A table in UTF-8 separated by commas, semicolons or tabs, one line for each kind of piece on a floor; or a
        workbook (``.xlsx``, ``.xlsm``) with such a table in the sheet ``inventory``, or in its first visible sheet.
    floors : sequence of str, optional
        The existing floors; any floor is allowed where not given.
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
        One sentence that names file, line (row of a workbook), column, value and what is allowed.

    Notes
    -----
    The header names the columns, in any order (docs/study.md explains them, decimal commas and workbooks); empty cells
    are treated as if the column were not there, lines that start with # are comments.

    Warnings (`toppling.core.doubts.ImplausibleInput`), which are notes of studies, name other lines with fewer cells
    than the header, lines that begin with # and a word, hidden rows, columns and sheets that are read, and visible
    sheets that are not; and sizes that are not plausible.

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
    found: list[tuple[CsvLine, Contents]] = []
    currency = sign_above = ""
    for line in table:
        found.append((line, _contents(line, kits or {}, sliding, stands or {})))
        if floors is not None and str(found[-1][1].floor) not in floors:
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
    if not found:
        raise InventoryError(f"{file}: has a header but no items")
    try:
        inventory = Inventory(tuple(_told_apart(found)), currency)
        inventory.check_supports()
    except ValueError as error:
        raise InventoryError(f"{file}: {error}") from None
    warn(row_doubts(inventory.rows))
    return inventory


def _currencies(money: str) -> set[str]:
    """Return the currencies that a sign or a code may stand for, with itself."""
    return {money, *CURRENCIES.get(money, ())}


def example_path() -> str:
    """Return the path of the example inventory (a small clinic) that ships with the package."""
    return str(Path(__file__).parents[1] / "examples" / "inventory.csv")


def _told_apart(found: Sequence[tuple[CsvLine, Contents]]) -> Iterator[Contents]:
    """Yield the rows with unique labels: the floor is added to labels that several lines have."""
    lines: dict[str, list[CsvLine]] = {}
    for line, row in found:
        lines.setdefault(row.label, []).append(line)
    taken: dict[str, CsvLine] = {}
    for line, row in found:
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
    block = _near_edge(line, placed_of_line(line, planned_of_line(line, block_of_line(line))))
    floor = line.text("floor")
    if not floor:
        line.refuse("floor", "is empty: it must say where the item stands, 0 is the ground")
    if re.fullmatch(r"[-+]?[\d.,]+", floor) and not (floor.isascii() and floor.isdecimal() and len(floor) < 10):
        line.refuse("floor", f"must be a whole number from 0 (ground), or a name, got {shown(floor)}")
    if line.text("e") and line.text("restitution"):
        line.refuse("restitution", "is the same as e: give one of them")
    e_column = "restitution" if line.text("restitution") else "e"
    count = line.count_in("count")
    if count is not None and not 1 <= count <= MAX_COUNT:
        line.refuse("count", f"must be from 1 to {MAX_COUNT}, got {count}")
    anchored = line.text("anchored").lower()
    height = line.number_in("anchor_height_m", above=0.0, at_most=block.height)
    kit = None
    if anchored not in {"", *YES, *NO}:
        kit = kits.get(line.text("anchored"))
        if kit is None:
            named = f" or the name of a restraint of the study ({', '.join(map(repr, kits))})" if kits else ""
            line.refuse("anchored", f"must be yes or no{named}, got {shown(line.text('anchored'))}")
        block = _held(line, kit, block, height)
    direction = line.text("direction").lower()
    if direction not in ("", *DIRECTIONS):
        line.refuse("direction", f"must be x or y, got {shown(direction)}")
    code_class = line.text("code_class").lower()
    if code_class not in ("", *CLASSES):
        line.refuse("code_class", f"must be one of {', '.join(CLASSES)}, got {shown(code_class)}")
    if line.text("cost_median") and line.text("value"):
        line.refuse("cost_median", "takes the place of value: give one of them")
    distributions: dict[str, Any] = {
        "cost": _consequence(line, "cost", "cost_median"),
        "downtime": _consequence(line, "downtime", "downtime_median_days"),
        "injury": _injury(line),
        **_friction(line, sliding),
    }
    if block.edge is not None and anchored not in YES and distributions["friction"] is None:
        column = "edge_distance_mm" if line.text("edge_distance_mm") else "edge_distance_back_mm"
        if distributions["contact"] == ROLLING:
            line.refuse(column, "must be empty on castors: rolling is not modelled")
        line.refuse(column, "needs a friction: give contact or friction, or the study's [friction]")
    trip = line.number_in("trip_mm", at_least=1e3 * LEAST_TRIP, at_most=1e3 * MAX_TRIP)
    slides = distributions["friction"] is not None
    if trip is not None and anchored not in YES and not slides:
        if distributions["contact"] == ROLLING:
            line.refuse("trip_mm", "must be empty on castors: rolling is not modelled")
        line.refuse("trip_mm", "needs a friction: give contact or friction, or the study's [friction]")
    if trip is not None:
        distributions["trip"] = 1e-3 * trip
    elif slides and sliding is not None:
        distributions["trip"] = sliding.trip
    stand = stands.get(line.text("support"))
    if line.text("support") and stand is None:
        known = f"one of {', '.join(map(repr, stands))}" if stands else "empty: the study has no [[supports]]"
        line.refuse("support", f"must be {known}, got {shown(line.text('support'))}")
    words = [word.strip().lower() for word in re.split(r"[|,;]", line.text("consequence"))]
    e = line.number_in(e_column, above=0.0, at_most=1.0)
    value = line.number_in("value", at_least=0.0, at_most=MAX_VALUE)
    cost = line.number_in("anchoring_cost", at_least=0.0, at_most=MAX_VALUE)
    return line.checked(
        "consequence",
        lambda: Contents(
            label=line.name_in("item") or line.text("catalogue") or f"line {line.number}",
            block=block,
            floor=int(floor) if floor.isdecimal() else floor,
            count=1 if count is None else count,
            e=e,
            value=0.0 if value is None else value,
            consequences=tuple(word for word in words if word),
            anchored=anchored in YES,
            anchoring_cost=cost,
            room=line.text("room"),
            piece_class=line.text("class"),
            direction=direction,
            code_class=code_class,
            code_importance=line.number_in("code_importance", at_least=1.0, at_most=1.5),
            anchor_strength=line.number_in("anchor_strength_n", above=0.0, at_most=MAX_VALUE),
            anchor_height=height,
            kit="" if kit is None else kit.name,
            stands_on=line.text("stands_on"),
            stand=stand,
            **distributions,
        ),
    )


def _near_edge(line: CsvLine, block: Block) -> Block:
    """Return the block of a line with its edges."""
    columns = {side: f"edge_distance_{side}mm" for side in ("", "back_")}
    given = {side: line.number_in(column, at_least=0.0) for side, column in columns.items()}
    word = line.text("falls_when").lower()
    if word and word not in FALLS_WHEN:
        line.refuse("falls_when", f"must be one of {', '.join(FALLS_WHEN)}, got {shown(word)}")
    front, back = (None if one is None else 1e-3 * one for one in given.values())
    if front is None and back is None:
        if word:
            line.refuse("falls_when", "needs edge_distance_mm or edge_distance_back_mm, which are empty")
        return block
    try:
        return replace(block, edge=Edge(front, back, word or FALLS_WHEN[0]))
    except ValueError as error:
        line.refuse(columns["" if front is not None else "back_"], str(error))


def _friction(line: CsvLine, sliding: Slides | None) -> dict[str, Any]:
    """Return what a line stands on and its friction, that of the study where it gives neither."""
    contact = line.text("contact").lower()
    static = line.number_in("friction", at_least=0.05, at_most=2.0)
    dispersion = line.number_in("friction_dispersion", above=0.0, at_most=1.0)
    if dispersion is not None and static is None:
        line.refuse("friction_dispersion", "needs friction, which is empty")
    if contact in (ROLLING, UNLOCKED):
        if static is not None:
            line.refuse("friction", "must be empty on castors that are not locked: they roll, which is not modelled")
        return {"contact": ROLLING, "friction": None}
    if contact in CONTACTS:
        if static is not None:
            line.refuse("friction", "takes the place of contact: give one of them")
        own = CONTACTS[contact]
        return {"contact": contact, "friction": own.friction, "kinetic_ratio": own.kinetic_ratio}
    if contact not in ("", LOCKED):
        names = ", ".join((*CONTACTS, ROLLING, LOCKED))
        line.refuse("contact", f"must be one of {names}, got {shown(contact)}")
    found: dict[str, Any] = {"contact": contact, "friction": None if sliding is None else sliding.friction}
    if static is not None:
        found["friction"] = FixedFriction(static) if dispersion is None else LognormalFriction(static, dispersion)
    return found | ({} if sliding is None else {"kinetic_ratio": sliding.kinetic_ratio})


def _held(line: CsvLine, kit: Kit, block: Block, height: float | None) -> Block:
    """Return the block of a line with the kit that holds it."""
    try:
        return kit.held(block, height)
    except ValueError as error:
        line.refuse("anchored", str(error))


def _consequence(line: CsvLine, kind: str, median_column: str) -> Consequence | None:
    """Return the cost or downtime of a line, None where it gives no median."""
    median = line.number_in(median_column, above=0.0, at_most=MAX_VALUE)
    names = {name: f"{kind}_{name}" for name in ("dispersion", "distribution")}
    if median is None:
        for column in names.values():
            if line.text(column):
                line.refuse(column, f"needs {median_column}, which is empty")
        return None
    form = line.text(names["distribution"]).lower() or LOGNORMAL
    if form not in DISTRIBUTIONS:
        line.refuse(names["distribution"], f"must be one of {', '.join(DISTRIBUTIONS)}, got {shown(form)}")
    dispersion = line.number_in(names["dispersion"], at_least=0.0)
    try:
        return Consequence(median, 0.0 if dispersion is None else dispersion, form)
    except ValueError as error:  # (median and distribution are checked above)
        line.refuse(names["dispersion"], str(error).removeprefix("dispersion "))


def _injury(line: CsvLine) -> Injury | None:
    """Return the persons whom a piece of a line injures, None where the line says nothing of them."""
    persons = line.number_in("persons_exposed", at_least=0.0, at_most=1e4)
    probability = line.number_in("injury_probability", at_least=0.0, at_most=1.0)
    if persons is None and probability is None:
        return None
    if persons is None:
        line.refuse("injury_probability", "needs persons_exposed, which is empty")
    if probability is None:
        line.refuse("persons_exposed", "needs injury_probability, which is empty")
    return Injury(persons, probability)
