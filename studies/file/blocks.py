"""Blocks of a study: the table ``[[blocks]]``, and the lines of a CSV file (``blocks_file``, or an inventory)."""

from __future__ import annotations

import difflib
import math
from pathlib import Path
from typing import Annotated, NoReturn, Self

from pydantic import Field, model_validator

from ...models import Block, catalogue
from .csv_table import CsvLine, CsvTable, TableKind
from .table import KeyInfo, Table, shown

MOST_BLOCKS = 1_000_000
KIND = TableKind(
    "file of blocks",
    ("name", "catalogue", "width_m", "height_m", "cm_height_m", "inertia_factor", "alpha_rad", "R_m"),
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


class BlockTable(Table):
    """One block: a catalogue name, or outer sizes, or slenderness and size."""

    catalogue: Annotated[str | None, Field(description="Name of a catalogue item (see `toppling catalogue`).")] = None
    name: Annotated[
        str | None, KeyInfo("what it is"), Field(min_length=1, max_length=200, description="Label in results.")
    ] = None
    width_m: Annotated[
        float | None, KeyInfo(above=0.0), Field(description="Full width in the direction of shaking, m.")
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
        float | None,
        KeyInfo(above=0.0, below=0.5 * math.pi),
        Field(description="Slenderness, rad, instead of sizes."),
    ] = None
    R_m: Annotated[float | None, KeyInfo(above=0.0), Field(description="Size R, m, instead of sizes.")] = None

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        ways = (
            self.catalogue is not None,
            self.width_m is not None and self.height_m is not None,
            self.alpha_rad is not None and self.R_m is not None,
        )
        given = {name for name in self.model_fields_set if getattr(self, name) is not None}
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
        return self

    def build(self) -> Block:
        """Make the block; ValueError where its values are out of range or its name is not in the catalogue."""
        if self.catalogue is not None:
            try:
                block = catalogue[self.catalogue]
            except KeyError as error:
                raise ValueError(error.args[0]) from None
            name = block.name if self.name is None else self.name
            return Block(block.width, block.height, self.cm_height_m, self.inertia_factor, name)
        if self.alpha_rad is not None and self.R_m is not None:
            factor = 4.0 / 3.0 if self.inertia_factor is None else self.inertia_factor
            return Block.from_slenderness(self.alpha_rad, self.R_m, factor, self.name)
        assert self.width_m is not None  # one of three ways, checked above
        assert self.height_m is not None
        return Block(self.width_m, self.height_m, self.cm_height_m, self.inertia_factor, self.name)


def read_blocks(file: Path) -> tuple[Block, ...]:
    """Read the blocks of a CSV file, one per line; StudyError with one sentence that names file, line and column.

    Its columns are the keys of a study's ``[[blocks]]``: a line gives ``catalogue``, or ``width_m`` and ``height_m``,
    or ``alpha_rad`` and ``R_m``.
    """
    table = CsvTable(file, KIND)
    found: dict[str, tuple[int, Block]] = {}
    for line in table:
        slender = line.text("alpha_rad") or line.text("R_m")
        block = _slender(line) if slender else block_of_line(line, line.text("name") or line.text("catalogue"))
        if block.label in found:
            before = f"{block.label!r} is taken by line {found[block.label][0]}"
            line.refuse("name", f"must be another name, {before}" if line.text("name") else f"is needed: {before}")
        found[block.label] = (line.number, block)
    if not found:
        raise KIND.error(f"{file}: has a header but no blocks")
    return tuple(block for _, block in found.values())


def block_of_line(line: CsvLine, name: str = "") -> Block:
    """Return the block of a line that holds outer sizes or a name of the catalogue."""
    listed = line.text("catalogue")
    width, height = line.number_in("width_m", above=0.0), line.number_in("height_m", above=0.0)
    cm_height, factor = line.number_in("cm_height_m", above=0.0), line.number_in("inertia_factor", above=1.0)
    if listed:
        if width is not None or height is not None:
            column = "width_m" if width is not None else "height_m"
            line.refuse(column, "must be empty beside a catalogue name, which gives the sizes")
        if listed not in catalogue:
            near = difflib.get_close_matches(listed, catalogue, n=1, cutoff=0.4)
            hint = f"; did you mean {near[0]!r}?" if near else ", `toppling catalogue` lists them"
            line.refuse("catalogue", f"there is no item {shown(listed)}{hint}")
        width, height = catalogue[listed].width, catalogue[listed].height
    if width is None or height is None:
        column = "width_m" if width is None else "height_m"
        others = ", or alpha_rad and R_m" if "alpha_rad" in line.table.kind.columns else ""
        line.refuse(column, f"is empty: a line needs a catalogue name, or width_m and height_m{others}")
    try:
        return Block(width, height, cm_height, factor, name or None)
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
        return Block.from_slenderness(alpha, size, **more, name=line.text("name") or None)
    except ValueError as error:
        _refuse(line, error, "R_m")
