"""Writing of pelicun's fragility tables: a CSV of parameters and a JSON of descriptions.

A row is a component: capacities of its limit states, in a demand with a unit. The table contains ids and numbers alone;
the JSON describes each id to people and to `read_pelicun`.
"""

import csv
import io
import os
from collections.abc import Iterable, Sequence
from pathlib import Path

import xarray as xr

from ....core import checks
from ..datasets import curve_set
from ..files import ExchangeError, write_text
from ..ids import TABLE_MARKS
from ..rows import CurveRow, CurveSet, Written
from .demands import Demand, demand_of
from .metadata import metadata_text
from .multilinear import FAMILY, theta


def write_pelicun(
    curves: xr.Dataset, path: str | os.PathLike[str], directional: bool | None = None, ids: Sequence[str] | None = None
) -> Written:
    """Write curves as a fragility table for pelicun, with its metadata.

    Parameters
    ----------
    curves : xarray.Dataset
        Curves of any form on block, model, floor or any other dimensions, as `toppling.fit_fragility` returns them;
        ``limit_state`` makes the limit states of one component.
    path : path
        The CSV; the JSON gets its name with another suffix.
    directional : bool, optional
        True if the demand is in the component's own direction. If not given, as stated by the curves (coordinate
        directional, which `read_pelicun` and `published.fema_p58` give), else True.
    ids : sequence of str, optional
        Ids of the components, as `write_curve_csv` takes them.

    Returns
    -------
    Written
        Files, ids, and the components without an estimate: the table marks them as incomplete, as FEMA P-58 does.

    Raises
    ------
    ExchangeError
        Curves that pelicun cannot represent: a measure without a demand, levels that six digits do not distinguish, or
        two with like ids. A file that cannot be written.

    Notes
    -----
    pelicun takes a demand without direction as 1.2 times the larger of the demands in both directions, which raises the
    probabilities above the curve's. Directional rows reproduce the curve's own probabilities (``make test-exchange``
    reads them with the real program). A component must then have direction 1 or 2: direction 0 means no direction,
    whatever the row states.

    Curves that are not lognormal are written as pelicun's ``multilinear_CDF`` (3.10 reads it): levels and probabilities
    with lines between them, to six digits. A log-logistic or Weibull curve, or a curve with a factor of uplift, then
    errs by less than 0.0002 (dispersions below 0.003 more). An isotonic curve has its own levels. Below the lowest it
    falls to 0 within one step, as in annual rates, and above the highest it is constant. `read_pelicun` reads both
    forms, one at a time: curves that were not lognormal are read as probabilities at levels.

    The metadata have the keys that the Damage and Loss Model Library asks for, and no others.

    Location of a demand in pelicun: a component at location i takes the demand of a floor at location i - 1, the floor
    below its storey. It takes demands of the ground and spectral demands at its own location.
    """
    file = checks.path(path)
    curve_rows = curve_set(curves, TABLE_MARKS, ids)
    return write_table(curve_rows, file, metadata_text(curve_rows), directional)


def write_table(
    curve_rows: CurveSet, file: Path, metadata: str, directional: bool | None = None, located: bool = False
) -> Written:
    """Write curves as a table, and its metadata; errors as of `write_pelicun`.

    `located`: the curves' offsets give the place of the demand.
    """
    if directional is not None:
        checks.flag("directional", getattr(directional, "item", lambda: directional)())
    demand = demand_of(curve_rows, located)
    if not file.name:
        raise ExchangeError("path must name a file, got a folder")
    metadata_file = file.with_suffix(".json")
    if metadata_file == file:
        raise ExchangeError(f"{file}: the table must not be named .json, its metadata are")
    components, missing = curve_rows.components(), curve_rows.missing()
    heading = ["ID", "Incomplete", "Demand-Type", "Demand-Unit", "Demand-Offset", "Demand-Directional"]
    for i in range(1, len(curve_rows.limit_states) + 1):
        heading += [f"LS{i}-Family", f"LS{i}-Theta_0", f"LS{i}-Theta_1", f"LS{i}-DamageStateWeights"]
    table = [heading]
    for name, rows in components.items():
        directed = rows[0].numbers.get("directional", 1.0) if directional is None else float(directional)
        offset = int(rows[0].numbers.get("offset", 0.0))
        cells = [name, str(int(name in missing)), demand.name, demand.unit, str(offset), str(int(directed != 0.0))]
        for row in rows:
            cells += [*_thetas(curve_rows, row, demand), row.words.get("weights", "")]
        table.append(cells)
    paths = (write_text(file, csv_text(table)), write_text(metadata_file, metadata))
    return Written(paths, tuple(components), missing)


def csv_text(rows: Iterable[Sequence[str]]) -> str:
    """Return rows as a CSV."""
    lines = io.StringIO()
    csv.writer(lines, lineterminator="\n").writerows(rows)
    return lines.getvalue()


def _thetas(curve_rows: CurveSet, row: CurveRow, demand: Demand) -> tuple[str, str, str]:
    """Return family and parameters of a curve, these empty if there is none."""
    if not row.estimated:
        return "lognormal", "", ""
    if row.lognormal:
        return "lognormal", repr(row.parameters.median / demand.factor), repr(row.parameters.dispersion)
    return FAMILY, theta(row, curve_rows.levels, demand.factor), ""
