"""Reading of fragility tables of pelicun and of SimCenter's damage and loss library."""

import csv
import io
import os
import re
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path

import numpy as np
import xarray as xr

from ....core.aliases import Array
from ....core.doubts import warn
from ...curves.curve import ISOTONIC
from ...fitting.links import LOGNORMAL
from ...fitting.states import INCOMPLETE
from ...validity.plausibility import period_doubts
from ..datasets import MAX_NUMBERS, curve_dataset
from ..files import ExchangeError, number, read_text
from ..ids import common_limit_state, labelled_curves
from ..rows import MAX_CURVES, CurveParameters, CurveRow, CurveSet, select_measure
from .demands import measure_of, units_of
from .metadata import read_metadata
from .multilinear import FAMILY, points

MAX_LIMIT_STATES = 20
Read = tuple[str, int, CurveRow, tuple[Array, Array] | None]
"""Id, index of the limit state, curve, and the levels and probabilities of a curve without parameters."""


def read_pelicun(path: str | os.PathLike[str], ids: Collection[str] | None = None, im: str | None = None) -> xr.Dataset:
    """Read curves from a fragility table of pelicun, or of SimCenter's library.

    Parameters
    ----------
    path : path
        The CSV. A JSON with the same name, as written by `write_pelicun`, gives the labels of its curves.
    ids : collection of str, optional
        The components to read; every one if not given.
    im : str, optional
        The measure to read (``pga``, ``pgv``, ``Sa(1.0)``, …) if the table has several; ``pga of the ground`` or ``pga
        of the floor`` if it has both.

    Returns
    -------
    xarray.Dataset
        The median (SI) and dispersion on the written dimensions, else on ``block``, labelled by ids; with
        ``limit_state`` if a component has more than one. Coordinates are id and directional; the attribute is im.
        Incomplete rows are NaN, with that status. Curves of the family ``multilinear_CDF`` have probability on
        ``level`` instead of median and dispersion (form isotonic). Each has the levels of all, and is linear between
        its own.

    Raises
    ------
    ExchangeError
        One sentence that names the file and the error: unknown measures or families, missing ids, several measures
        without a choice, or both families in the selected rows.
    """
    file, text = read_text(path)
    heading, rows = _table(file, text)
    wanted = None if ids is None else set(ids)
    absent = sorted(wanted - {row[0] for row in rows}) if wanted is not None else []
    if absent:
        raise ExchangeError(f"{file}: holds no component {absent[0]!r:.80}")
    chosen = [dict(zip(heading, row, strict=True)) for row in rows if wanted is None or row[0] in wanted]
    by_measure: dict[tuple[str, bool], list[dict[str, str]]] = {}
    unknown: dict[str, str] = {}
    for row in chosen:
        measure = measure_of(row.get("Demand-Type", ""))
        if measure is None:
            unknown.setdefault(row["Demand-Type"], row["ID"])
        else:
            by_measure.setdefault(measure, []).append(row)
    if unknown and im is None:
        demand, name = next(iter(unknown.items()))
        raise ExchangeError(f"{file}: component {name!r:.80} is in {demand!r:.60}, which no measure here is")
    (label, ground), entries = select_measure(file, by_measure, im)
    warn(period_doubts(label))
    stated, components = read_metadata(file.with_suffix(".json"))
    states = _limit_states(file, heading)
    levels, rows_of = _at_common_levels(
        file, [(row["ID"], *curve) for row in entries for curve in _curves(file, row, states, label)]
    )
    dims, named = labelled_curves(file, rows_of, components, [f"LS{i}" for i in states], units_of(label)[0])
    made = CurveSet(
        label,
        units_of(label)[0],
        ground,
        dims,
        tuple(name for name, _, _ in rows_of),
        named,
        LOGNORMAL if levels is None else ISOTONIC,
        levels,
        title=stated or f"Fragility curves of {file.name}",
        state=common_limit_state(rows_of, components),
    )
    return curve_dataset(made, file.name)


def _table(file: Path, text: str) -> tuple[list[str], list[list[str]]]:
    """Return heading and rows, every row as long as the heading."""
    try:
        rows = [row for row in csv.reader(io.StringIO(text, newline=""), strict=True) if row]
    except csv.Error as error:
        raise ExchangeError(f"{file}: no table ({error})") from None
    if not rows:
        raise ExchangeError(f"{file}: empty")
    heading, rows = rows[0], rows[1:]
    for name in ("ID", "Demand-Type", "Demand-Unit", "LS1-Family", "LS1-Theta_0"):
        if name not in heading:
            raise ExchangeError(f"{file}: has no column {name}: not a fragility table of pelicun")
    if heading[0] != "ID" or len(set(heading)) < len(heading):
        raise ExchangeError(f"{file}: its columns must begin with ID and have names of their own")
    if len(rows) > MAX_CURVES:
        raise ExchangeError(f"{file}: holds {len(rows):,} rows, allowed are {MAX_CURVES:,}")
    for i, row in enumerate(rows, start=2):
        if len(row) != len(heading):
            raise ExchangeError(f"{file}: row {i} has {len(row)} columns, the heading has {len(heading)}")
    names = [row[0] for row in rows]
    if not names or "" in names or len(set(names)) < len(names):
        raise ExchangeError(f"{file}: {'every row must have an id of its own' if names else 'holds no components'}")
    return heading, rows


def _limit_states(file: Path, heading: Sequence[str]) -> list[int]:
    states = sorted(int(match[1]) for name in heading if (match := re.fullmatch(r"LS([0-9]{1,3})-Family", name)))
    if len(states) > MAX_LIMIT_STATES:
        raise ExchangeError(f"{file}: has {len(states)} limit states, allowed are {MAX_LIMIT_STATES}")
    for i in states:
        if f"LS{i}-Theta_0" not in heading:
            raise ExchangeError(f"{file}: has no column LS{i}-Theta_0 beside LS{i}-Family")
    return states


def _at_common_levels(file: Path, read: Sequence[Read]) -> tuple[Array | None, list[tuple[str, int, CurveRow]]]:
    """Return the levels of all curves without parameters, None if there are none, and all curves at these levels."""
    tables = [table for _, _, _, table in read if table is not None]
    if not tables:
        return None, [(name, at, curve) for name, at, curve, _ in read]
    lognormal = next((name for name, _, curve, table in read if table is None and curve.estimated), None)
    if lognormal is not None:
        raise ExchangeError(
            f"{file}: {lognormal!r:.80} is lognormal and other components are {FAMILY}: read one family with ids"
        )
    levels = np.unique(np.concatenate([x for x, _ in tables]))
    if levels.size * len(read) > MAX_NUMBERS:
        raise ExchangeError(f"{file}: {len(read):,} curves have {levels.size:,} levels: read some of them with ids")
    curves = []
    for name, at, curve, pair in read:
        p = None if pair is None else np.interp(levels, *pair)
        curves.append((name, at, curve._replace(probability=p)))
    return levels, curves


def _curves(
    file: Path, row: Mapping[str, str], states: Sequence[int], im: str
) -> list[tuple[int, CurveRow, tuple[Array, Array] | None]]:
    """Return one row's curves, each with the index of its limit state, and its own levels with their probabilities."""
    name = row["ID"]
    numbers = {}
    for column, key in (("Demand-Directional", "directional"), ("Demand-Offset", "offset")):
        if row.get(column, "").strip():
            numbers[key] = number(file, f"{column} of {name!r:.80}", row[column])
            if key == "offset" and not (numbers[key].is_integer() and abs(numbers[key]) < 1000.0):
                raise ExchangeError(
                    f"{file}: {column} of {name!r:.80} must be a number of floors, got {row[column]:.30}"
                )
    if numbers.get("offset") == 0.0:
        del numbers["offset"]
    if row.get("Incomplete", "").strip() not in ("", "0", "0.0", "False"):
        return [(0, CurveRow((), status=INCOMPLETE, numbers=numbers), None)]
    _, units = units_of(im)
    if row["Demand-Unit"] not in units:
        raise ExchangeError(
            f"{file}: Demand-Unit of {name!r:.80} must be one of {', '.join(units)} for {row['Demand-Type']}, "
            f"got {row['Demand-Unit']!r:.30}"
        )
    unit = units[row["Demand-Unit"]]
    curves: list[tuple[int, CurveRow, tuple[Array, Array] | None]] = []
    for at, i in enumerate(states):
        family, theta_0, theta_1 = (row.get(f"LS{i}-{key}", "").strip() for key in ("Family", "Theta_0", "Theta_1"))
        if not (family or theta_0 or theta_1):
            continue
        where = f"of LS{i} of {name!r:.80}"
        weights = row.get(f"LS{i}-DamageStateWeights", "").strip()
        curve = CurveRow((), numbers=numbers, words={"weights": weights} if weights else {})
        if family == FAMILY:
            curves.append((at, curve, points(file, where, theta_0, unit)))
        elif family == LOGNORMAL:
            # (tables of multilinear curves alone have no such column)
            if f"LS{i}-Theta_1" not in row:
                raise ExchangeError(f"{file}: has no column LS{i}-Theta_1, which the curve {where} needs")
            median = number(file, f"Theta_0 {where}", theta_0) * unit
            parameters = CurveParameters(median, number(file, f"Theta_1 {where}", theta_1))
            curves.append((at, curve._replace(parameters=parameters), None))
        else:
            raise ExchangeError(f"{file}: the family {where} must be lognormal or {FAMILY}, got {family!r:.30}")
    if not curves:
        raise ExchangeError(f"{file}: {name!r:.80} has no limit state and is not said to be incomplete")
    return curves
