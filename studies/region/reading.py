"""Blocks of a region from a CSV file by columns, a million lines in two seconds; by lines if columns are not enough."""

import re
from io import StringIO
from pathlib import Path

import numpy as np

from ...core.aliases import Array
from ...core.doubts import warn
from ...models.block_array import BlockArray
from ..file.blocks import KIND, MOST_BLOCKS, read_blocks
from ..file.csv_table import CsvTable
from ..file.table import MAX_TEXT
from ..text.error import StudyError

# (a word that would be taken for an empty cell)
_NOT_A_NUMBER = re.compile(r"(?:^|[,;\t])\s*[-+]?nan\s*(?:[,;\t]|$)", re.IGNORECASE | re.MULTILINE)

NUMBERS = ("width_m", "height_m", "cm_height_m", "inertia_factor", "alpha_rad", "R_m")
OWN = ("e", "delta")
"""Columns of properties that blocks have of their own, instead of the damping laws."""
SIZES, SLENDERNESS = ("width_m", "height_m"), ("alpha_rad", "R_m")


def read_region(file: Path) -> BlockArray:
    """Read the blocks of a CSV file as columns: as ``blocks_file``, with ``e`` and ``delta`` of their own, if any."""
    table = CsvTable(file, KIND._replace(columns=(*KIND.columns, *OWN)))
    try:
        by_column = _by_column(table)
    except (TypeError, ValueError) as error:
        raise StudyError(f"{file}: {error}") from None
    if by_column is not None:
        warn(table.doubts())
        return by_column
    extra = [name for name in OWN if name in table.columns]
    if extra:
        raise StudyError(
            f"{file}: with the column {extra[0]} every line must have a name, its sizes and {' and '.join(extra)} as "
            "plain numbers, without quotes, decimal commas and catalogue names"
        )
    blocks = read_blocks(file)
    try:
        return BlockArray.of(blocks)
    except ValueError as error:
        raise StudyError(f"{file}: {error}") from None


def _by_column(table: CsvTable) -> BlockArray | None:
    """Return the blocks of a plain table without errors; None for others."""
    if not {*SIZES} <= {*table.columns} and not {*SLENDERNESS} <= {*table.columns}:
        return None
    if "name" not in table.columns or not {*table.columns} <= {"name", *NUMBERS, *OWN}:
        return None
    columns = _columns(table)
    if columns is None:
        return None
    given = {name: columns[name] for name in NUMBERS if name in columns}
    width, height = _outer_sizes(given)
    centre, factor = given.get("cm_height_m"), given.get("inertia_factor")
    own_laws = {name: columns[name] for name in OWN if name in columns}
    try:
        return BlockArray(width, height, centre, factor, columns["name"].tolist(), **own_laws)
    except (TypeError, ValueError):
        if own_laws:
            raise
        return None


def _columns(table: CsvTable) -> dict[str, Array] | None:
    """Return the columns of a table with plain numbers and names in each line; None for others."""
    import pandas as pd  # noqa: PLC0415 - only the files of regions are read by it

    text = table.text_below
    if '"' in text or (table.delimiter != "," and "," in text) or _NOT_A_NUMBER.search(text):
        return None
    try:
        frame = pd.read_csv(
            StringIO(text),
            sep=table.delimiter,
            header=None,
            names=table.columns,
            dtype={name: str if name == "name" else np.float64 for name in table.columns},
            keep_default_na=False,
            na_values={name: [""] for name in table.columns if name != "name"},
            skipinitialspace=True,
            float_precision="round_trip",
        )
    except (ValueError, pd.errors.ParserError):
        return None
    # (lines with fewer cells are read one by one, which finds cut files)
    if text.count(table.delimiter) < (len(table.columns) - 1) * len(frame):
        return None
    # (an index other than the numbers of the lines: these have more cells than the header)
    if not isinstance(frame.index, pd.RangeIndex) or not 0 < len(frame) <= MOST_BLOCKS:
        return None
    names = frame["name"].str.strip()
    lengths = names.str.len()
    if names.isna().any() or not lengths.between(1, MAX_TEXT).all() or not "".join(names).isprintable():
        return None
    numbers = {name: frame[name].to_numpy() for name in table.columns if name != "name"}
    if any(np.isinf(number).any() for number in numbers.values()):
        return None
    return {"name": names.to_numpy(dtype=np.str_), **numbers}


def _outer_sizes(given: dict[str, Array]) -> tuple[Array, Array]:
    """Return widths and heights, m, of blocks given by these or by slenderness and size; NaN for others."""
    n = next(iter(given.values())).size
    columns = {name: given.get(name, np.full(n, np.nan)) for name in NUMBERS}
    width, height = columns["width_m"], columns["height_m"]
    alpha, size = columns["alpha_rad"], columns["R_m"]
    slender = ~np.isnan(alpha) & ~np.isnan(size)
    # (both ways in one line, or a centre of mass of a block that is given by its slenderness, are errors)
    mixed = slender & ~(np.isnan(width) & np.isnan(height) & np.isnan(columns["cm_height_m"]))
    half = np.isnan(alpha) != np.isnan(size)
    broad = np.where(slender, 2.0 * size * np.sin(alpha), width)
    tall = np.where(slender, 2.0 * size * np.cos(alpha), height)
    wrong = mixed | half
    return np.where(wrong, np.nan, broad), np.where(wrong, np.nan, tall)
