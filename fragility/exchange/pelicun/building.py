"""A building's contents for a whole assessment of pelicun: fragility, quantities by floor, and what a fall costs.

Demands are those of the ground, of which the curves of a performance study are: every component takes its demand at
location 0, whatever its own.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from ....units import DIMENSIONLESS
from ..datasets import curve_set
from ..files import ExchangeError, write_text
from ..ids import TABLE_MARKS
from ..rows import MAX_CURVES, Written
from .demands import UNITS_OF_MEASURES
from .metadata import general_information, json_of, metadata_text
from .writing import csv_text, write_table

FRAGILITY, QUANTITIES, CONSEQUENCES = "fragility.csv", "components.csv", "consequence_repair.csv"
"""Names of the tables; fragility and consequences have a JSON of the same name."""
UNITS = "units.json"
"""Name of the file of pelicun's option ``UnitsFile``, for a currency that it does not know."""
_OTHER_UNITS = {
    "time": {"sec": 1.0, "minute": 60.0, "hour": 3600.0, "day": 86400.0},
    "area": {"m2": 1.0, "in2": 0.0254**2, "ft2": 0.3048**2, "SF": 0.3048**2},
    "volume": {"m3": 1.0, "ft3": 0.3048**3, "CF": 0.3048**3 / 60.0},
    "quantity": {"ea": 1.0, "EA": 1.0, "LF": 0.3048, "TN": 1000.0, "AP": 1.0, "KV": 1000.0},
    "other": {"unitless": 1.0, "rad": 1.0, "loss_ratio": 1.0, "worker_day": 1.0, "kg": 1.0, "J": 1.0, "MJ": 1e6},
    "dollars": {"USD": 1.0, "USD_2011": 1.0},
}
# (pelicun reads such a file in place of its own units: those of FEMA P-58's components must be there, too)
KNOWN_CURRENCY = "USD"
STATE = "overturned"
REPLACED = "Set up again, or replaced, at the value that the inventory gives."
DIRECTION = "1"


class Line(NamedTuple):
    """Pieces of one kind on a floor: floor (0 is the ground), number, value of one, and a comment on them.

    together: whether all of them fall, or none.
    """

    floor: int
    number: int
    together: bool
    value: float
    note: str


def write_building(
    curves: xr.Dataset,
    lines: Sequence[Line],
    folder: Path,
    currency: str,
    description: str,
    ids: Sequence[str] | None = None,
) -> Written:
    """Write a building's contents for pelicun into a folder that is there.

    Parameters
    ----------
    curves : xarray.Dataset
        Probabilities on ``item`` and ``level``, levels of a measure of the ground motion.
    lines : sequence of Line
        One for each item.
    folder : Path
        The folder.
    currency : str
        Currency of the values; empty where none is stated.
    description : str
        Sentences on what the curves are and what the tables do not hold.
    ids : sequence of str, optional
        As for `write_pelicun`; made of the items' labels where not given.

    Returns
    -------
    Written
        ``fragility.csv``, ``components.csv`` and, where something has a value, ``consequence_repair.csv``, with their
        metadata; ``units.json`` where pelicun does not know the currency.

    Raises
    ------
    ExchangeError, ValueError
        As `write_pelicun`.

    Notes
    -----
    What stands on floor k is at location k + 1, as pelicun has the contents of a storey.  Pieces that fall together are
    one row of quantities, others a row each: pelicun draws a capacity for each row.  Blocks, which serve the same
    purpose, cannot: pelicun 3.10 stops at the second block of a component that has a ``multilinear_CDF``.
    """
    rows = sum(1 if one.together else one.number for one in lines)
    if rows > MAX_CURVES:
        raise ExchangeError(f"pelicun's quantities need a row a piece, and {rows:,} are more than {MAX_CURVES:,}")
    offsets = np.array([-float(_location(one)) for one in lines])
    located = curves.assign_coords(offset=("item", offsets, {"units": DIMENSIONLESS}))
    found = curve_set(located.assign_attrs(im_at="ground"), TABLE_MARKS, ids)
    notes = dict(zip(found.ids, (one.note for one in lines), strict=True))
    metadata = metadata_text(found, description, notes, REPLACED)
    written = write_table(found, folder / FRAGILITY, metadata, located=True)
    by_id = dict(zip(found.ids, lines, strict=True))
    paths = [*written.paths, write_text(folder / QUANTITIES, _quantities(by_id))]
    if any(one.value > 0.0 for one in lines):
        unit = currency_unit(currency)
        consequences = folder / CONSEQUENCES
        paths.append(write_text(consequences, _consequences(by_id, unit)))
        about = f"Value of a piece that falls, {currency or 'in a currency that is not stated'}. {description}"
        named = dict(zip(found.ids, (curve.labels[0] for curve in found.curves), strict=True))
        paths.append(write_text(consequences.with_suffix(".json"), _consequences_about(named, found.title, about)))
        if unit != KNOWN_CURRENCY:
            paths.append(write_text(folder / UNITS, _units(unit)))
    return written._replace(paths=tuple(paths))


def currency_unit(currency: str) -> str:
    """Return the unit of a currency in pelicun's tables: a word of letters, ``money`` for any other text.

    Examples
    --------
    >>> currency_unit("EUR"), currency_unit("€"), currency_unit("")
    ('EUR', 'money', 'money')
    """
    return currency if re.fullmatch("[A-Z]{3}", currency) else "money"


def _units(currency: str) -> str:
    measures = {f"measure {si}": units for si, units in UNITS_OF_MEASURES.items()}
    return json_of({**measures, **_OTHER_UNITS, "currency": {currency: 1.0}})


def _location(line: Line) -> int:
    return line.floor + 1


def _quantities(lines: Mapping[str, Line]) -> str:
    rows = [["ID", "Units", "Location", "Direction", "Theta_0", "Blocks"]]
    for name, one in lines.items():
        amounts = [one.number] if one.together else [1] * one.number
        rows += [[name, "ea", str(_location(one)), DIRECTION, str(amount), "1"] for amount in amounts]
    return csv_text(rows)


def _consequences(lines: Mapping[str, Line], unit: str) -> str:
    rows = [["ID", "Incomplete", "Quantity-Unit", "DV-Unit", "DS1-Family", "DS1-Theta_0", "DS1-Theta_1"]]
    rows += [[f"{name}-Cost", "0", "1 EA", unit, "", repr(one.value), ""] for name, one in lines.items()]
    return csv_text(rows)


def _consequences_about(labels: Mapping[str, str], title: str, description: str) -> str:
    return json_of(
        {
            "_GeneralInformation": general_information(title, description, labels),
            **{
                name: {
                    "Description": f"{label}: value of one",
                    "SuggestedComponentBlockSize": "1 EA",
                    "RoundUpToIntegerQuantity": "True",
                    "ControllingDemand": "Damage Quantity",
                    "DamageStates": {"DS1": {"Description": STATE, "RepairAction": REPLACED}},
                }
                for name, label in labels.items()
            },
        }
    )
