"""A building's contents for a whole assessment of pelicun: fragility, quantities by floor, and costs of falls.

Demands are ground motions, like the curves of a performance study: every component takes its demand at location 0,
whatever its own location.
"""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from ....core.units import DIMENSIONLESS
from ..datasets import curve_set
from ..files import ExchangeError, write_text
from ..ids import TABLE_MARKS
from ..rows import MAX_CURVES, Written
from .demands import UNITS_OF_MEASURES
from .metadata import general_information, json_of, metadata_text
from .writing import csv_text, write_table

TABLE = "consequence_repair.csv"
"""Name of the table; a JSON of the same name describes it."""
UNITS = "units.json"
"""Name of the file of pelicun's option ``UnitsFile``, for a currency that pelicun does not have."""
_OTHER_UNITS = {
    "time": {"sec": 1.0, "minute": 60.0, "hour": 3600.0, "day": 86400.0},
    "area": {"m2": 1.0, "in2": 0.0254**2, "ft2": 0.3048**2, "SF": 0.3048**2},
    "volume": {"m3": 1.0, "ft3": 0.3048**3, "CF": 0.3048**3 / 60.0},
    "quantity": {"ea": 1.0, "EA": 1.0, "LF": 0.3048, "TN": 1000.0, "AP": 1.0, "KV": 1000.0},
    "other": {"unitless": 1.0, "rad": 1.0, "loss_ratio": 1.0, "worker_day": 1.0, "kg": 1.0, "J": 1.0, "MJ": 1e6},
    "dollars": {"USD": 1.0, "USD_2011": 1.0},
}
# pelicun reads such a file instead of its own units: the units of FEMA P-58's components must be there, too
KNOWN_CURRENCY = "USD"
DAY = "day"
STATE = "overturned"
REPLACED = "Set up again, or replaced."


class Amount(NamedTuple):
    """A cost or a time of a fall: median, dispersion and pelicun's family of its distribution.

    The dispersion of a lognormal distribution is the standard deviation of the logarithm. The dispersion of a normal
    one, which pelicun truncates at 0, is the coefficient of variation. The family is empty if the amount is known.
    """

    median: float
    dispersion: float = 0.0
    family: str = ""


class Line(NamedTuple):
    """Pieces of one kind on a floor: floor (0 is the ground), number, and the cost of their fall, with comments.

    `together`: True if all of them fall, or none. `cost`: of one piece, drawn once for pieces that fall together, and
    once for each otherwise. `downtime`: likewise, days, of all pieces that fall together, None if not given. `note`: on
    their fall. `note_of_cost`: on cost and downtime.
    """

    floor: int
    number: int
    together: bool
    cost: Amount
    downtime: Amount | None
    note: str
    note_of_cost: str = ""

    @property
    def pieces(self) -> int:
        """Pieces that the downtime is of."""
        return self.number if self.together else 1


def currency_unit(currency: str) -> str:
    """Return the unit of a currency in pelicun's tables: a word of letters, ``money`` for other texts, as ``€``."""
    return currency if re.fullmatch("[A-Z]{3}", currency) else "money"


def write_consequences(
    folder: Path, lines: Mapping[str, Line], labels: Mapping[str, str], currency: str, title: str, description: str
) -> list[Path]:
    """Write the table of consequences, by ids of components, and its metadata; nothing if there is no consequence.

    ``units.json`` is written if pelicun does not have the currency.
    """
    valued = any(line.cost.median > 0.0 for line in lines.values())
    lasting = any(line.downtime is not None for line in lines.values())
    if not (valued or lasting):
        return []
    unit = currency_unit(currency)
    table = folder / TABLE
    of_cost = f"Cost of a piece that falls, {currency or 'in a currency that is not stated'}. " if valued else ""
    of_time = "Time for which a piece that falls is out of use, days. " if lasting else ""
    about = f"{of_cost}{of_time}{description}"
    paths = [
        write_text(table, _table(lines, unit, valued)),
        write_text(table.with_suffix(".json"), _metadata(lines, labels, title, about)),
    ]
    if valued and unit != KNOWN_CURRENCY:
        measures = {f"measure {si}": units for si, units in UNITS_OF_MEASURES.items()}
        paths.append(write_text(folder / UNITS, json_of({**measures, **_OTHER_UNITS, "currency": {unit: 1.0}})))
    return paths


def _table(lines: Mapping[str, Line], unit: str, valued: bool) -> str:
    rows = [["ID", "Incomplete", "Quantity-Unit", "DV-Unit", "DS1-Family", "DS1-Theta_0", "DS1-Theta_1"]]
    for name, line in lines.items():
        if valued:
            rows.append([f"{name}-Cost", "0", "1 EA", unit, *_cells(line.cost)])
        if line.downtime is not None:
            rows.append([f"{name}-Time", "0", f"{line.pieces} EA", DAY, *_cells(line.downtime)])
    return csv_text(rows)


def _cells(amount: Amount) -> list[str]:
    return [amount.family, repr(amount.median), repr(amount.dispersion) if amount.family else ""]


def _of_time(line: Line) -> str:
    if line.downtime is None:
        return ""
    return f" and downtime of {f'{line.pieces} that fall together' if line.pieces > 1 else 'one'}"


def _metadata(lines: Mapping[str, Line], labels: Mapping[str, str], title: str, description: str) -> str:
    return json_of(
        {
            "_GeneralInformation": general_information(title, description, lines),
            **{
                name: {
                    "Description": f"{labels[name]}: cost of one{_of_time(line)}",
                    **({"Comments": line.note_of_cost} if line.note_of_cost else {}),
                    "SuggestedComponentBlockSize": "1 EA",
                    "RoundUpToIntegerQuantity": "True",
                    "ControllingDemand": "Damage Quantity",
                    "DamageStates": {"DS1": {"Description": STATE, "RepairAction": REPLACED}},
                }
                for name, line in lines.items()
            },
        }
    )


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

    `curves` has probabilities on ``block`` and ``level`` (of a measure of the ground motion), and `lines` has one line
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
    located = curves.assign_coords(offset=("block", offsets, {"units": DIMENSIONLESS}))
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
