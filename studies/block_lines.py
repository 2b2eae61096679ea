"""Blocks from the lines of a CSV file, those of an inventory or a file that holds nothing but blocks."""

from __future__ import annotations

import difflib
from pathlib import Path
from typing import NoReturn

from ..models import Block, catalogue
from .lines import Kind, Line, Lines
from .tables import shown

MOST_BLOCKS = 1_000_000
KIND = Kind(
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
"""Columns by what blocks call their values."""


def read_blocks(file: Path) -> tuple[Block, ...]:
    """The blocks of a file, one line each; StudyError with one sentence that names file, line and column.

    Its columns are the keys of a study's ``[[blocks]]``: a line gives ``catalogue``, or ``width_m`` and ``height_m``,
    or ``alpha_rad`` and ``R_m``.
    """
    table = Lines(file, KIND)
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


def block_of_line(line: Line, name: str = "") -> Block:
    """The block whose outer sizes, or whose name in the catalogue, a line holds."""
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


def _refuse(line: Line, error: ValueError, column: str) -> NoReturn:
    """Raise an error about a block as one of the cell that holds the value, or else of a `column`."""
    word, _, what = str(error).partition(" ")
    # (what is missing may be missing from an empty cell; other values may come of another way to say the sizes)
    if word in NAMED and (line.text(NAMED[word]) or what.startswith("must be given")):
        line.refuse(NAMED[word], what)
    line.refuse(column, str(error))


def _slender(line: Line) -> Block:
    """The block whose slenderness and size a line holds."""
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
