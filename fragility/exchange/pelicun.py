"""Fragility tables of pelicun and SimCenter's damage and loss library: a CSV of parameters and a JSON of descriptions.

A row is a component: lognormal capacities of its limit states, in a demand with a unit.  The table holds ids and
numbers alone; the JSON describes each id to people and to `read_pelicun`.
"""

from __future__ import annotations

import csv
import io
import json
import os
import re
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import xarray as xr

from ...motions import Sa, Sd, Sv
from ...units import STANDARD_GRAVITY
from ..fitting.states import INCOMPLETE
from .datasets import curve_dataset, curve_set
from .files import ExchangeError, number, read_text, target, write_text
from .ids import TABLE_MARKS, Component, common_limit_state, component_of, component_record, labelled_curves
from .rows import MAX_CURVES, CurveParameters, CurveRow, CurveSet, Written, select_measure, spectral_period

MAX_LIMIT_STATES = 20

COMPONENT_KEY = "Toppling"  # key of our record among a component's metadata
GENERAL = "_GeneralInformation"

ADVICE = (
    "The probability is that under shaking in the direction of the component, across its smaller plan "
    "size: give the component direction 1 or 2. In direction 0, or with Demand-Directional 0, pelicun takes 1.2 times "
    "the larger of both directions."
)


class Demand(NamedTuple):
    """pelicun's name of a measure, the unit that it is written in, and the SI value of the unit."""

    name: str
    unit: str
    factor: float


_OF_FLOORS = {
    "pga": Demand("Peak Floor Acceleration", "g", STANDARD_GRAVITY),
    "pgv": Demand("Peak Floor Velocity", "mps", 1.0),
    "pgd": Demand("Peak Floor Displacement", "m", 1.0),
}
_OF_THE_GROUND = {
    "pga": Demand("Peak Ground Acceleration", "g", STANDARD_GRAVITY),
    "pgv": Demand("Peak Ground Velocity", "mps", 1.0),
}
_SPECTRAL = {
    "Sa": (Sa, Demand("Spectral Acceleration", "g", STANDARD_GRAVITY)),
    "Sv": (Sv, Demand("Spectral Velocity", "mps", 1.0)),
    "Sd": (Sd, Demand("Spectral Displacement", "m", 1.0)),
}
# SI values of pelicun's units, by the SI unit of the quantity
_UNITS: dict[str, dict[str, float]] = {
    "m s-2": {"g": STANDARD_GRAVITY, "mps2": 1.0, "inps2": 0.0254, "inchps2": 0.0254, "ftps2": 0.3048},
    "m s-1": {"mps": 1.0, "cmps": 0.01, "inps": 0.0254, "inchps": 0.0254, "ftps": 0.3048, "mph": 0.44704},
    "m": {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "inch": 0.0254, "ft": 0.3048},
}
_SI = {"g": "m s-2", "mps": "m s-1", "m": "m"}


def write_pelicun(
    curves: xr.Dataset, path: str | os.PathLike[str], directional: bool | None = None, ids: Sequence[str] | None = None
) -> Written:
    """Write lognormal curves as a fragility table for pelicun, with its metadata beside it.

    Parameters
    ----------
    curves : xarray.Dataset
        median and dispersion on block, model, floor or any other dimensions, as `toppling.fit_fragility` returns them;
        ``limit_state`` makes the limit states of one component.
    path : path
        The CSV; the JSON gets its name with another suffix.
    directional : bool, optional
        True if the demand is that of the component's own direction.  Where not given, as stated by the curves
        (coordinate directional, which `read_pelicun` and `published.fema_p58` give), else True.
    ids : sequence of str, optional
        Ids of the components, one for each combination of labels other than the limit state (the last dimension of
        the curves changes fastest): a letter, then letters, digits, ``_`` and ``.``, at most 60 characters.  Where not
        given, the curves' own (coordinate ``id``) or ids made of the labels.

    Returns
    -------
    Written
        Files, ids, and the components without an estimate: they stand in the table as incomplete, as FEMA P-58's own.

    Raises
    ------
    ExchangeError
        Curves that pelicun cannot hold: not lognormal, of a measure that it has no demand for, two with like ids; a
        file that cannot be written.
    TypeError, ValueError
        Something other than a dataset of fragility curves; `ids` that are too few, not legal, or not unique.

    Notes
    -----
    pelicun takes a demand without direction as 1.2 times the larger of the demands in both directions, which raises the
    probabilities above the curve's: directional rows reproduce the curve's own probabilities (``make test-exchange``
    reads them with the real program).  A component must then be given direction 1 or 2: direction 0 means no direction,
    whatever the row states.

    Location of a demand in pelicun: for a component at location i, the demand of a floor is taken at location i - 1,
    the floor that the contents of storey i stand on; demands of the ground and spectral demands are taken at the
    component's own location.

    Examples
    --------
    >>> import tempfile
    >>> from toppling.fragility.curves import published
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     written = write_pelicun(published.fema_p58(), f"{folder}/fragility.csv")
    ...     print(written.paths[0].read_text().splitlines()[1])
    E.20.22.102a,0,Peak Floor Velocity,mps,0,0,lognormal,0.724,0.5,
    """
    file = target(path)
    found = curve_set(curves, TABLE_MARKS, ids)
    demand = _demand(found)
    components = found.components()
    if any(curve.probability is not None or curve.parameters.uplifting for curve in found.curves):
        raise ExchangeError(
            f"{file}: pelicun takes lognormal curves, got {found.form} ones: fit lognormal ones, or write NRML or CSV"
        )
    missing = found.missing()
    states = len(found.limit_states)
    heading = ["ID", "Incomplete", "Demand-Type", "Demand-Unit", "Demand-Offset", "Demand-Directional"]
    for i in range(1, states + 1):
        heading += [f"LS{i}-Family", f"LS{i}-Theta_0", f"LS{i}-Theta_1", f"LS{i}-DamageStateWeights"]
    lines = io.StringIO()
    table = csv.writer(lines, lineterminator="\n")
    table.writerow(heading)
    for name, rows in components.items():
        own = rows[0].numbers.get("directional", 1.0) if directional is None else float(directional)
        offset = int(rows[0].numbers.get("offset", 0.0))
        cells = [name, int(name in missing), demand.name, demand.unit, offset, int(own != 0.0)]
        for row in rows:
            cells += ["lognormal", *_thetas(row, demand), row.words.get("weights", "")]
        table.writerow(cells)
    metadata_file = file.with_suffix(".json")
    if metadata_file == file:
        raise ExchangeError(f"{file}: the table must not be named .json, its metadata are")
    paths = (write_text(file, lines.getvalue()), write_text(metadata_file, metadata_text(found)))
    return Written(paths, tuple(components), missing)


def read_pelicun(path: str | os.PathLike[str], ids: Collection[str] | None = None, im: str | None = None) -> xr.Dataset:
    """Read curves from a fragility table of pelicun, or of SimCenter's library.

    Parameters
    ----------
    path : path
        The CSV.  A JSON beside it, as `write_pelicun` writes it, gives the labels of its curves.
    ids : collection of str, optional
        The components to read; every one where not given.
    im : str, optional
        The measure to read (``pga``, ``pgv``, ``Sa(1.0)``, …) where the table has several.

    Returns
    -------
    xarray.Dataset
        median (SI) and dispersion on the dimensions that were written, else on ``block``, labelled by ids; with
        ``limit_state`` where a component has more than one; coordinates id and directional; attribute im.  Incomplete
        rows are NaN, with that status.

    Raises
    ------
    ExchangeError
        One sentence that names the file and the error: unknown measures or families, missing ids, several measures and
        no choice of one.
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
        measure = _measure(row.get("Demand-Type", ""))
        if measure is None:
            unknown.setdefault(row["Demand-Type"], row["ID"])
        else:
            by_measure.setdefault(measure, []).append(row)
    if unknown and im is None:
        demand, name = next(iter(unknown.items()))
        raise ExchangeError(f"{file}: component {name!r:.80} is in {demand!r:.60}, which no measure here is")
    (label, ground), found = select_measure(file, by_measure, im)
    metadata = read_metadata(file.with_suffix(".json"))
    states = _limit_states(file, heading)
    rows_of = [(row["ID"], at, curve) for row in found for at, curve in _curves(file, row, states, label)]
    dims, named = labelled_curves(rows_of, metadata.components, [f"LS{i}" for i in states])
    made = CurveSet(
        label,
        _units(label)[0],
        ground,
        dims,
        tuple(name for name, _, _ in rows_of),
        named,
        title=metadata.title or f"Fragility curves of {file.name}",
        state=common_limit_state(rows_of, metadata.components, "LS1"),
    )
    return curve_dataset(made, file.name)


def _demand(found: CurveSet) -> Demand:
    spectral = spectral_period(found.im)
    if spectral is not None and not found.ground:
        _, demand = _SPECTRAL[spectral[0]]
        return demand._replace(name=f"{demand.name}|{spectral[1]!r}")
    demands = _OF_THE_GROUND if found.ground else _OF_FLOORS
    if found.im not in demands:
        where = " of the ground" if found.ground else ""
        raise ExchangeError(
            f"pelicun has no demand for {found.im or 'a measure without a name'}{where}, "
            f"allowed are {', '.join(demands)}{'' if found.ground else ', Sa(T), Sv(T) and Sd(T) with 5 % damping'}"
        )
    return demands[found.im]


def _thetas(curve: CurveRow, demand: Demand) -> tuple[str, str]:
    if not curve.estimated:
        return "", ""
    return repr(curve.parameters.median / demand.factor), repr(curve.parameters.dispersion)


def _table(file: Path, text: str) -> tuple[list[str], list[list[str]]]:
    """Return heading and rows, every row as long as the heading."""
    try:
        rows = [row for row in csv.reader(io.StringIO(text, newline=""), strict=True) if row]
    except csv.Error as error:
        raise ExchangeError(f"{file}: no table ({error})") from None
    if not rows:
        raise ExchangeError(f"{file}: empty")
    heading, rows = rows[0], rows[1:]
    for name in ("ID", "Demand-Type", "Demand-Unit", "LS1-Family", "LS1-Theta_0", "LS1-Theta_1"):
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
        if f"LS{i}-Theta_0" not in heading or f"LS{i}-Theta_1" not in heading:
            raise ExchangeError(f"{file}: has no column LS{i}-Theta_0 or LS{i}-Theta_1 beside LS{i}-Family")
    return states


def _measure(demand: str) -> tuple[str, bool] | None:
    """Return the measure's label and True if it is of the ground; None for a demand without a measure here."""
    name, _, subtype = demand.partition("|")
    for ground, known in ((False, _OF_FLOORS), (True, _OF_THE_GROUND)):
        for label, one in known.items():
            if demand == one.name:
                return label, ground
    for spectral, one in _SPECTRAL.values():
        if name in (one.name, f"Peak {one.name}") and re.fullmatch(r"[0-9]{1,4}(?:\.[0-9]{0,17})?", subtype):
            try:
                return spectral(float(subtype)).label, False
            except ValueError:
                return None
    return None


def _units(im: str) -> tuple[str, dict[str, float]]:
    """Return the SI unit of a table's measure, and pelicun's units of the measure."""
    demand = _OF_FLOORS[im] if im in _OF_FLOORS else _SPECTRAL[im[:2]][1]
    si = _SI[demand.unit]
    return si, _UNITS[si]


def _curves(file: Path, row: Mapping[str, str], states: Sequence[int], im: str) -> list[tuple[int, CurveRow]]:
    """Return one row's curves, each with the index of its limit state."""
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
        return [(0, CurveRow((), status=INCOMPLETE, numbers=numbers))]
    _, units = _units(im)
    if row["Demand-Unit"] not in units:
        raise ExchangeError(
            f"{file}: Demand-Unit of {name!r:.80} must be one of {', '.join(units)} for {row['Demand-Type']}, "
            f"got {row['Demand-Unit']!r:.30}"
        )
    found = []
    for at, i in enumerate(states):
        family, theta_0, theta_1 = (row[f"LS{i}-{key}"].strip() for key in ("Family", "Theta_0", "Theta_1"))
        if not (family or theta_0 or theta_1):
            continue
        where = f"of LS{i} of {name!r:.80}"
        if family != "lognormal":
            raise ExchangeError(f"{file}: the family {where} must be lognormal, got {family!r:.30}")
        weights = row.get(f"LS{i}-DamageStateWeights", "").strip()
        median = number(file, f"Theta_0 {where}", theta_0) * units[row["Demand-Unit"]]
        parameters = CurveParameters(median, number(file, f"Theta_1 {where}", theta_1))
        curve = CurveRow((), parameters, numbers=numbers, words={"weights": weights} if weights else {})
        found.append((at, curve))
    if not found:
        raise ExchangeError(f"{file}: {name!r:.80} has no limit state and is not said to be incomplete")
    return found


class Metadata(NamedTuple):
    """Title of the table, and our records of its components, by id."""

    title: str = ""
    components: Mapping[str, Component] = MappingProxyType({})


def metadata_text(found: CurveSet) -> str:
    """Return the JSON beside a table: the library's layout, with our record under one key of each component."""
    content = {
        GENERAL: {
            "ShortName": found.title,
            "Description": f"{found.title}; made by toppling. {ADVICE}",
            "Version": "1.0",
        },
        **{name: _entry(found, rows) for name, rows in found.components().items()},
    }
    return json.dumps(content, ensure_ascii=False, indent=1) + "\n"


def _entry(found: CurveSet, rows: Sequence[CurveRow]) -> dict[str, Any]:
    ours = component_record(found, rows)
    reason = ours.get("status")
    return {
        "Description": f"{', '.join(ours['labels'].values()) or found.title}: fragility in {found.long_name}",
        "Comments": " ".join([*([ours["note"]] if "note" in ours else []), _parts(rows), ADVICE])
        if reason is None
        else f"No estimate: {reason}.",
        "SuggestedComponentBlockSize": "1 EA",
        "RoundUpToIntegerQuantity": "True",
        "LimitStates": {
            f"LS{i}": {"DS1": {"Description": state, "RepairAction": "To be given by the user."}}
            for i, state in enumerate(found.limit_states, start=1)
        },
        COMPONENT_KEY: ours,
    }


def _parts(rows: Sequence[CurveRow]) -> str:
    """Return which parts the dispersions of a component hold."""
    beta = next((one.numbers["modelling_dispersion"] for one in rows if "modelling_dispersion" in one.numbers), None)
    if beta is None:
        return "Which parts the dispersion holds is not stated."
    if beta == 0.0:
        return "The dispersion is of the motions alone and holds no modelling uncertainty."
    return f"The dispersion holds that of the motions and a modelling uncertainty of {beta:g}."


def read_metadata(file: Path) -> Metadata:
    """Read the JSON beside a table; empty metadata without such a file, ExchangeError for any other JSON."""
    if not file.is_file():
        return Metadata()
    _, text = read_text(file)
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        raise ExchangeError(f"{file}: no JSON") from None
    if not isinstance(found, dict):
        raise ExchangeError(f"{file}: must say something of each component, got {type(found).__name__}")
    general = found.get(GENERAL)
    title = general.get("ShortName") if isinstance(general, dict) else None
    entries = {name: component_of(entry.get(COMPONENT_KEY)) for name, entry in found.items() if isinstance(entry, dict)}
    return Metadata(
        title if isinstance(title, str) else "", {name: one for name, one in entries.items() if one is not None}
    )
