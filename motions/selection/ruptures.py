"""Disaggregations: magnitudes and distances that contribute to a hazard, as OpenQuake and the USGS write them."""

import json
import math
import os
import re
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...core import checks
from ...core.aliases import Array
from ...core.doubts import Doubt, warn
from ..intensity.measure import Measure
from ..intensity.naming import in_si, measure_named, our_name, program_unit, written_level
from ..simulated.ground_motion_models import Scenario
from ..simulated.scenario import STRIKE_SLIP, VELOCITY
from .files import MEAN, TargetError, numbered, opened, rows_of

FARTHEST = 2e6
"""Distance of a rupture, m, beyond which no hazard analysis goes."""
LEAST_SHARE = 1e-4
"""Bins with a smaller share of the hazard are left out."""
APART = 1.25
"""Factor between a level's stated rate and the rate of its bins, above which bins are missing or too many."""
_MORE_AXES = ("eps", "trt", "lon", "lat")

_LEVEL = ("ground motion", "Exceedance IML")
"""Names in the USGS' programs of the level of a disaggregation, at the end of its name."""


class Disaggregation(NamedTuple):
    """Shares of magnitudes and distances in the rate at which a level of a measure is exceeded.

    `measure`. `level`, SI. `magnitude` (bin,), moment magnitudes. `distance` (bin,), m. `share` (bin,), which sum to 1.
    `kept`, the part of the file's rate in these bins. `rate`, of all bins, 1/year, NaN if the file contains shares
    alone.
    """

    measure: Measure
    level: float
    magnitude: Array
    distance: Array
    share: Array
    kept: float
    rate: float = math.nan

    def scenarios(self, vs30: float, faulting: str = STRIKE_SLIP) -> list[Scenario]:
        """Return a scenario of each bin at a site of V_S30 (m/s), with the rupture reaching the surface."""
        speed = VELOCITY.number("vs30", vs30)
        pairs = zip(self.magnitude.tolist(), self.distance.tolist(), strict=True)
        return [Scenario(magnitude, distance, speed, faulting) for magnitude, distance in pairs]


def read_disaggregation(
    path: str | os.PathLike[str], *, im: str | Measure | None = None, level: float | None = None, column: str = MEAN
) -> Disaggregation:
    """Read the disaggregation of a hazard by magnitude and distance.

    Parameters
    ----------
    path : path
        One of the files below.
    im : measure or its name, optional
        Measure, if the file has several.
    level : float, optional
        Level, SI, if the file has several; the nearest one, which must lie within 2 %.
    column : str
        Which column of an OpenQuake file: ``mean`` (default) or a realisation as ``rlz0``.

    Returns
    -------
    Disaggregation
        Bins with less than 1e-4 of the hazard left out.

    Raises
    ------
    TargetError
        A file that cannot be read, of no known format, with several measures or levels and no choice, with a bin twice,
        or without any rate.

    Warns
    -----
    ImplausibleInput
        Bins of OpenQuake whose rates sum to less or more than the probability `poe` of their level.

    Notes
    -----
    - **OpenQuake**, ``Mag_Dist-….csv`` and ``Mag_Dist_Eps-….csv``: a comment with ``investigation_time``, then
      ``imt,iml,poe,mag,dist,[eps,]`` and a column a realisation or ``mean``; probabilities p in t years, which are
      rates -ln(1 - p)/t.  Distances in km.
    - **USGS**, JSON of the Unified Hazard Tool's disaggregation: ``response[i].metadata.imt`` and ``.data[]`` with the
      component ``Total``. Its ``summary`` states the level, and its bins have ``r``, ``m`` and the percentages of each
      epsilon. The layout is from the services' published code.

    Both are of the rate at which the level is exceeded. The shares in the rate of equalling it, which belong to a
    stripe, have slightly lower magnitudes; the difference of two disaggregations gives them.
    """
    file = checks.path(path)
    wanted = None if im is None else measure_named(im)
    with opened(file) as lines:
        first = next((line for line in lines.head if line.strip()), "")
        if first.lstrip().startswith(("{", "[")):
            return _one_of(file, _of_services(file, "\n".join(lines)), wanted, level)._replace(rate=math.nan)
        by_level = _of_openquake(file, first, rows_of(lines), column)
    return _one_of(file, by_level, wanted, level)


Bins = dict[tuple[str, float], list[tuple[float, float, float]]]
"""Magnitude, distance (m) and rate of each bin, by measure and level (SI)."""


def _of_openquake(file: Path, comment: str, rows: Any, column: str) -> Bins:
    number, heading = next(rows, (0, []))
    names = [name.lower() for name in heading]
    needed = ("imt", "iml", "mag", "dist", column.lower())
    missing = [name for name in needed if name not in names]
    if missing:
        raise TargetError(f"{file}: line {number} names no column {missing[0]!r}: is it a disaggregation Mag_Dist?")
    time = re.search(r"investigation_time=['\"]?([\d.eE+]{1,20})", comment)
    if time is None:
        raise TargetError(f"{file}: states no investigation_time in its first line")
    years = numbered(file, 1, time[1], "investigation_time", 0.0, above=True)
    # the mean has this level, and so does one realisation alone
    of_level = sum(name == MEAN or name.startswith("rlz") for name in names) == 1 or column.lower() == MEAN
    by_level: Bins = {}
    stated: dict[tuple[str, float], float] = {}
    seen: dict[tuple[Any, ...], int] = {}
    for at, words in rows:
        if len(words) != len(names):
            raise TargetError(f"{file}: line {at} has {len(words)} columns, its heading {len(names)}")
        row = dict(zip(names, words, strict=True))
        measure = _measure(file, row["imt"], at)
        iml = numbered(file, at, row["iml"], "iml", 0.0, above=True) * in_si(program_unit(measure) or "", measure)
        chance = numbered(file, at, row[column.lower()], "a probability", 0.0, above=False)
        if chance >= 1.0:
            raise TargetError(f"{file}: line {at} gives a probability of {chance:g}, must be below 1")
        magnitude = numbered(file, at, row["mag"], "a magnitude", 0.0, above=True)
        distance = 1e3 * numbered(file, at, row["dist"], "a distance", 0.0, above=False)
        key = measure.label, iml
        before = seen.setdefault((key, magnitude, distance, *(row.get(name) for name in _MORE_AXES)), at)
        if before != at:
            raise TargetError(f"{file}: line {at} gives the bin of line {before} again: leave one out")
        by_level.setdefault(key, []).append((magnitude, distance, -math.log1p(-chance) / years))
        with suppress(ValueError):  # (no number where the level was chosen by itself)
            if of_level and 0.0 < (poe := float(row.get("poe", "nan"))) < 1.0:
                stated[key] = -math.log1p(-poe) / years
    for key, rate in stated.items():
        bins_rate = math.fsum(part for _, _, part in by_level[key])
        if bins_rate > 0.0 and not 1.0 / APART <= bins_rate / rate <= APART:
            of = {"file": file.name, "of": _named([key])}
            warn([Doubt.of("rupture_rate", rate=bins_rate, stated=rate, **of)])
    return by_level


def _of_services(file: Path, text: str) -> Bins:
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise TargetError(f"{file}: is no valid JSON ({str(error)[:60]})") from None
    by_level: Bins = {}
    try:
        for entry in data["response"]:
            about = entry["metadata"]
            name = about["imt"]["value"] if isinstance(about["imt"], dict) else about["imt"]
            measure = _measure(file, str(name), None)
            total = next(component for component in entry["data"] if component["component"] == "Total")
            targets = next(item for item in total["summary"] if item["name"] == "Deaggregation targets")
            stated = next(target for target in targets["data"] if str(target["name"]).endswith(_LEVEL))
            level = float(stated["value"]) * in_si(str(stated["units"]), measure)
            bins = [
                (float(row["m"]), 1e3 * float(row["r"]), sum(float(part["value"]) for part in row["εdata"]))
                for row in total["data"]
            ]
            by_level[measure.label, level] = bins
    except StopIteration:
        raise TargetError(
            f"{file}: holds no component 'Total' with the level that it is of, among its 'Deaggregation targets'"
        ) from None
    except (KeyError, TypeError, ValueError) as error:
        if isinstance(error, TargetError):
            raise
        raise TargetError(f"{file}: is no disaggregation of the USGS as known here ({str(error)[:60]})") from None
    return by_level


def _measure(file: Path, name: str, at: int | None) -> Measure:
    where = f"{file}: line {at}" if at else f"{file}"
    try:
        return measure_named(our_name(name))
    except ValueError as error:
        raise TargetError(f"{where}: {error}") from None


def _one_of(file: Path, by_level: Bins, wanted: Measure | None, level: float | None) -> Disaggregation:
    """Return the requested disaggregation; TargetError if the request leaves none, or a choice."""
    keys = [key for key in by_level if wanted is None or key[0] == wanted.label]
    if not keys:
        raise TargetError(f"{file}: holds {_named(list(by_level))}" + (f", none of {wanted.label}" if wanted else ""))
    if level is not None:
        y = checks.number("level", level, above=0.0)
        keys = [key for key in keys if abs(key[1] / y - 1.0) < 0.02]
        if not keys:
            asked = written_level(wanted or measure_named(next(iter(by_level))[0]), y)
            raise TargetError(f"{file}: holds {_named(list(by_level))}, none within 2 % of {asked}")
    if len({key[0] for key in keys}) > 1 or (level is None and len(keys) > 1):
        raise TargetError(f"{file}: holds {_named(keys)}: say which with im and level")
    if level is not None:
        keys.sort(key=lambda key: abs(math.log(key[1] / level)))
    label, at = keys[0]
    bins = np.array(by_level[keys[0]], dtype=float).reshape(-1, 3)
    if not np.all(np.isfinite(bins)) or np.any(bins < 0.0) or bins[:, 2].sum() == 0.0 or bins[:, 0].max() > 10.0:
        raise TargetError(
            f"{file}: the disaggregation of {label} holds no rates, negative ones, or magnitudes above 10"
        )
    if (farthest := bins[:, 1].max()) > FARTHEST:
        raise TargetError(f"{file}: holds a distance of {farthest / 1e3:g} km: m in place of km?")
    joined: dict[tuple[float, float], float] = {}
    for magnitude, distance, rate in bins.tolist():  # (bins of each epsilon)
        joined[magnitude, distance] = joined.get((magnitude, distance), 0.0) + rate
    rates = np.array(list(joined.values()))
    shares = rates / rates.sum()
    keep = shares >= LEAST_SHARE
    places = np.array(list(joined))[keep]
    kept = float(shares[keep].sum())
    return Disaggregation(
        measure_named(label), at, places[:, 0], places[:, 1], shares[keep] / kept, kept, float(rates.sum())
    )


def _named(keys: list[tuple[str, float]]) -> str:
    held = (f"{label} = {written_level(measure_named(label), level)}" for label, level in keys)
    return ", ".join(held)[:120] or "nothing"
