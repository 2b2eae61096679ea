"""Export of a performance study for pelicun: fragility, quantities by floor and consequences of its pieces, one law."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ...core.wording import currency_of
from ...fragility.curves.curve import ISOTONIC
from ...fragility.exchange.ids import TABLE_MARKS, is_id
from ...fragility.exchange.pelicun.building import FILES, UNITS, Amount, Line, currency_unit, write_building
from ...fragility.fitting.isotonic import isotonic_probabilities
from ..buildings.variables import JOINT
from ..facts.method import study_of
from ..facts.say import register_of
from ..inventory.consequences import LOGNORMAL, Consequence, PieceScores
from ..report.results_file import read_results
from ..store.content import check_content
from ..store.outputs import own_files
from ..text.error import StudyError
from .export import PELICUN, laws_of

INDEPENDENT = "independent"


def write_building_files(
    result: Path, folder: Path, model: str | None = None, prefix: str | None = None, verify: bool = False
) -> list[str]:
    """Write pieces of a performance study under one law for a whole assessment of pelicun; return lines to print."""
    with read_results(result) as results:
        check_content(result, results, verify)
        laws = np.arange(results.sizes["model"]) if model is None else laws_of(results, model, result)
        if laws.size > 1:
            named = ", ".join(repr(str(value)) for value in results["model"].values[laws])
            why = "is needed" if model is None else f"{model} names {laws.size} laws"
            raise StudyError(f"--model {why}: pelicun's tables are of one law, and {result} holds {named:.300}")
        of_law = results.isel(model=int(laws[0]))
        law = str(of_law["model"].values)
        items = [str(item) for item in of_law["block"].values]
        curves, smoothed = _curves(of_law)
        lines = [_line(of_law, i, smoothed[i]) for i in range(len(items))]
        currency = currency_of(results)
        correlation = _correlation(results)
    ids = None if prefix is None else _ids(prefix, len(items))
    try:
        with own_files(folder, PELICUN, FILES):  # files of an earlier export for pelicun are removed
            written = write_building(curves, lines, folder, currency, register_of("pelicun").table(law), ids)
    except StudyError:
        raise
    except (TypeError, ValueError) as error:
        raise StudyError(str(error)) from None
    never = sum(bool((row == 0.0).all()) for row in curves["probability"].values)
    pieces = sum(line.number for line in lines)
    unit = currency_unit(currency) if any(path.name == UNITS for path in written.paths) else None
    times = any(line.downtime is not None for line in lines)
    printed = register_of("pelicun").printed(len(items), pieces, law, never, correlation, times, unit)
    return [*printed.splitlines(), *(f"written: {path}" for path in written.paths)]


def _curves(results: xr.Dataset) -> tuple[xr.Dataset, list[float]]:
    """Return the curves of the pieces, and the difference of each from the observed probabilities."""
    level = results["level"]
    observed = results["probability"].transpose("block", "level").values
    runs = np.ones(level.size)
    table = np.array([isotonic_probabilities(level.values, row, runs) for row in observed])
    table = np.clip(table, 0.0, 1.0)
    curves = xr.Dataset(
        {"probability": (("block", "level"), table, {"units": "1"})},
        {"block": results["block"].values, "level": ("level", level.values, dict(level.attrs))},
        {
            "im": str(results.attrs["im"]),
            "form": ISOTONIC,
            "title": str(results.attrs.get("title", "Contents of a building")),
        },
    )
    return curves, np.abs(table - observed).max(axis=1).tolist()


def _line(results: xr.Dataset, i: int, smoothed: float) -> Line:
    """Return a line of the inventory."""
    values: dict[str, Any] = {name: results[name].values[i] for name in ("floor", "count", "value", "anchored")}
    floor = str(values["floor"])
    if not floor.isdecimal():
        raise StudyError(
            f"pelicun's locations are numbers, and {results['block'].values[i]!s:.80} stands on floor {floor!r}"
        )
    room = str(results["room"].values[i]) if "room" in results.coords else ""
    meant = str(results["consequences"].values[i]).split(JOINT)
    together = str(results.attrs.get("pieces", "")) != INDEPENDENT
    falls = bool(results["probability"].values[i].any())
    note = register_of("pelicun").piece(
        floor, room, bool(values["anchored"]), falls, [*filter(None, meant)], smoothed, together
    )
    number = int(values["count"])
    at_once = number if together else 1
    cost, downtime = (_consequence(results, i, kind) for kind in ("cost", "downtime"))
    return Line(
        int(floor),
        number,
        together,
        Amount(float(values["value"])) if cost is None else _amount(cost, at_once),
        None if downtime is None else _amount(downtime, at_once, greatest=True),
        note,
        " ".join([*_of_several("cost", cost, at_once), *_of_several("downtime", downtime, at_once)]),
    )


def _consequence(results: xr.Dataset, i: int, kind: str) -> Consequence | None:
    """Return the cost or the downtime of a piece of a line as a distribution, None if the line gives none."""
    if f"{kind}_median" not in results.coords or np.isnan(results[f"{kind}_median"].values[i]):
        return None
    median, dispersion, distribution = (
        results[f"{kind}_{name}"].values[i] for name in ("median", "dispersion", "distribution")
    )
    return Consequence(float(median), float(dispersion), str(distribution))


def _amount(consequence: Consequence, pieces: int, greatest: bool = False) -> Amount:
    """Return a consequence as pelicun draws it, once for pieces that fall together: mean cost, longest downtime."""
    if consequence.dispersion == 0.0:
        return Amount(float(consequence.median))
    if pieces == 1:
        return Amount(float(consequence.median), float(consequence.dispersion), consequence.distribution)
    mean, deviation = consequence.of_several(pieces, greatest)
    beta = math.sqrt(math.log1p((deviation / mean) ** 2))
    return Amount(mean * math.exp(-0.5 * beta**2), beta, LOGNORMAL)


def _of_several(kind: str, consequence: Consequence | None, pieces: int) -> list[str]:
    """Return the notes on a cost or a downtime of several pieces that fall together."""
    if consequence is None or consequence.dispersion == 0.0 or pieces == 1:
        return []
    spread = "dispersion" if consequence.distribution == LOGNORMAL else "coefficient of variation"
    what = "mean cost" if kind == "cost" else "longest downtime"
    return [register_of("pelicun").of_several(kind, consequence, spread, what, pieces)]


def _correlation(results: xr.Dataset) -> float | None:
    """Return the correlation of cost and downtime of a piece, None if no line spreads both, or if it is 0."""
    spread = [results.get(f"{kind}_dispersion", xr.DataArray(0.0)) > 0.0 for kind in ("cost", "downtime")]
    if not bool((spread[0] & spread[1]).any()):
        return None
    asked = study_of(results).get("performance")
    given = asked.get("consequence_correlation") if isinstance(asked, dict) else None
    return (PieceScores().correlation if given is None else float(given)) or None


def _ids(prefix: str, number: int) -> list[str]:
    """Return numbered ids."""
    digits = max(3, len(str(number)))
    ids = [f"{prefix}.{i:0{digits}d}" for i in range(1, number + 1)]
    if not is_id(prefix, TABLE_MARKS) or not is_id(ids[-1], TABLE_MARKS):
        raise StudyError(
            f"--ids {prefix:.80}: must begin with a letter, hold letters, digits, _ and . alone, and be no longer than "
            "some 55 characters"
        )
    return ids
