"""A building's contents for a whole assessment of pelicun: fragility, quantities by floor, and costs of falls.

Demands are ground motions, like the curves of a performance study: every component takes its demand at location 0,
whatever its own location.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import xarray as xr

from ....core.units import DIMENSIONLESS
from ..datasets import curve_set
from ..files import ExchangeError, write_text
from ..ids import TABLE_MARKS
from ..rows import MAX_CURVES, Written
from .consequences import REPLACED, TABLE, UNITS, Line, write_consequences
from .metadata import metadata_text
from .writing import csv_text, write_table

FRAGILITY, QUANTITIES = "fragility.csv", "components.csv"
"""Names of the tables; the fragility table has a JSON of the same name."""
FILES = (FRAGILITY, "fragility.json", QUANTITIES, TABLE, "consequence_repair.json", UNITS)
"""Names of all files of a building."""
DIRECTION = "1"


def write_building(
    curves: xr.Dataset,
    lines: Sequence[Line],
    folder: Path,
    currency: str,
    description: str,
    ids: Sequence[str] | None = None,
) -> Written:
    """Write a building's contents for pelicun into a folder: ``fragility.csv``, ``components.csv`` and their metadata.

    `curves` has probabilities on ``item`` and ``level`` (of a measure of the ground motion), and `lines` has one line
    for each item. `ids` are made of the items' labels if not given. Costs and downtimes make
    ``consequence_repair.csv``; a currency that pelicun does not know makes ``units.json``.

    Contents of floor k are at location k + 1, as pelicun has the contents of a storey. Pieces that fall together are
    one row of quantities, others a row each: pelicun draws a capacity for each row. Blocks have the same purpose but
    cannot be used: pelicun 3.10 stops at the second block of a component that has a ``multilinear_CDF``. One cost and
    one time are drawn for each row, too, and multiplied by the number of fallen pieces. The unit of quantity of a
    downtime is therefore the whole row.
    """
    rows = sum(1 if line.together else line.number for line in lines)
    if rows > MAX_CURVES:
        raise ExchangeError(f"pelicun's quantities need a row a piece, and {rows:,} are more than {MAX_CURVES:,}")
    offsets = np.array([-float(_location(line)) for line in lines])
    located = curves.assign_coords(offset=("item", offsets, {"units": DIMENSIONLESS}))
    curve_rows = curve_set(located.assign_attrs(im_at="ground"), TABLE_MARKS, ids)
    notes = dict(zip(curve_rows.ids, (line.note for line in lines), strict=True))
    metadata = metadata_text(curve_rows, description, notes, REPLACED)
    written = write_table(curve_rows, folder / FRAGILITY, metadata, located=True)
    by_id = dict(zip(curve_rows.ids, lines, strict=True))
    paths = [*written.paths, write_text(folder / QUANTITIES, _quantities(by_id))]
    labels = {name: curve.labels[0] for name, curve in zip(curve_rows.ids, curve_rows.curves, strict=True)}
    paths += write_consequences(folder, by_id, labels, currency, curve_rows.title, description)
    return written._replace(paths=tuple(paths))


def _location(line: Line) -> int:
    return line.floor + 1


def _quantities(lines: Mapping[str, Line]) -> str:
    rows = [["ID", "Units", "Location", "Direction", "Theta_0", "Blocks"]]
    for name, line in lines.items():
        amounts = [line.number] if line.together else [1] * line.number
        rows += [[name, "ea", str(_location(line)), DIRECTION, str(amount), "1"] for amount in amounts]
    return csv_text(rows)
