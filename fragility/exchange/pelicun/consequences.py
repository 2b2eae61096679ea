"""pelicun's table of consequences: the cost of a fall, and the time for which a piece is out of use."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from ..files import write_text
from .demands import UNITS_OF_MEASURES
from .metadata import general_information, json_of
from .writing import csv_text

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
