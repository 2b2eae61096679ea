"""Targets from files: the user's own table, and conditional spectra of OpenQuake; numbers must have units."""

import csv
import math
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ...core.doubts import Doubt, warn
from ...core.units import ACCELERATION, STANDARD_GRAVITY
from ..intensity.measure import MEASURES, Measure
from ..intensity.naming import in_si, measure_named, our_name, written_level
from ..intensity.parametric_measures import Sa
from ..matching.target_spectra import doubt_spectrum
from ..readers.lines import Lines, RecordError, is_blank, is_comment
from .stated import Stated
from .target import FORMULAS, Mixture, Target

MEAN = "mean"
MOST_ROWS = 20_000
_OWN, _OF_RUPTURES = ("measure", "unit", "median", "sigma"), ("rupture", "weight")
_OPENQUAKE = ("poe", "stat", "period", "mea", "std")


_UNLIKE_MEDIANS = (
    r"\bvariances?\b|coefficients? of variation|\b(?:16|84|95|9[78](?:\.\d)?)(?:th|[-. ]?%)?[- ]?"
    r"(?:per[cz]entile?|fractile|quantile)|[+±]\s?\d?\s?(?:sigma|σ|standard)"
    r"|\b(?:sigmas?|std|deviations?)\b[^#;,]{0,12}(?:in |\()(?:%|per ?cent)"
    r"|(?:within|intra|between|inter)-event (?:\w+ ){0,2}only"
    r"|\bconditional (?:up)?on (?!(?:the |an? )?(?:rupt|scen|magn|earth|event))|\brotd100"
)
"""Words of comments about other numbers than medians and standard deviations of natural logarithms of a rupture."""
HIGHEST_MEDIAN = 5.0 * STANDARD_GRAVITY
"""Acceleration, m/s², that no earthquake has in the median (assumed)."""
MOST_PGA = 10.0
"""Maximum plausible ratio of a peak acceleration to the largest spectral one of the same spectrum (assumed)."""


class TargetError(ValueError):
    """A file without a target; the message names the file, the line and the value."""


def read_target(
    path: str | os.PathLike[str], given: str | Measure, *, correlations: Any = FORMULAS, statistic: str = MEAN
) -> Target | Mixture | Stated:
    """Read a target for motions from a file of a hazard analysis, whose format is detected.

    Parameters
    ----------
    path : path
        One of the files below.
    given : measure or its name
        The measure whose levels condition the others; of OpenQuake's file the one that it was computed for.
    correlations : str, path or array_like
        As for `Target`; or the path of a CSV file, a square table with the measures as its heading and first column.
    statistic : str
        Which curve of an OpenQuake file: ``mean`` (default), a quantile as it is named there, or a realisation.

    Returns
    -------
    Target, Mixture or Stated
        A `Mixture` if the table names several ruptures; a `Stated` target, known at its own levels alone, of
        conditional spectra.

    Raises
    ------
    TargetError
        A file that cannot be read or is of no known format. Values that are missing or no numbers, an unknown measure
        or unit, a negative sigma, or a rupture without weight.

    Notes
    -----
    - **Table** (CSV): ``measure,unit,median,sigma`` with a row per measure: ``Sa(1.0),g,0.145,0.69``. Sigma is of the
      natural logarithm, both given the rupture, not the level. With the columns ``rupture,weight`` in front there is a
      block of rows for each rupture, and its weight in each of its rows.
    - **OpenQuake**, ``conditional-spectrum-….csv``: ``poe,stat,period,mea,std``, medians in g, standard deviations of
      logarithms, period 0 for the PGA; a spectrum for each probability, that is each level. A job with PGV among its
      measures writes that, too, as period 0: a value over ten times the largest Sa there is an error.
    """
    measure = measure_named(given, "given")
    file = Path(path)
    known = correlations_in(correlations)
    with opened(file) as lines:
        doubt_spectrum(file, enumerate(lines.head, start=1), also=_UNLIKE_MEDIANS)
        rows = rows_of(lines)
        number, heading = next(rows, (0, []))
        names = [name.lower() for name in heading]
        body = list(rows)
    if len(body) > MOST_ROWS:
        raise TargetError(f"{file}: holds {len(body):,} rows, no target does")
    if not body:
        raise TargetError(f"{file}: holds no rows below its heading")
    for at, words in body:
        if len(words) != len(names):
            raise TargetError(f"{file}: line {at} has {len(words)} columns, its heading {len(names)}")
    table = [(at, dict(zip(names, words, strict=True))) for at, words in body]
    if set(names) == set(_OPENQUAKE):
        return _conditional_spectra(file, table, measure, known, statistic)
    if set(names) in (set(_OWN), {*_OWN, *_OF_RUPTURES}):
        return _own(file, table, measure, known)
    raise TargetError(
        f"{file}: line {number} must name the columns {','.join(_OWN)} (with {','.join(_OF_RUPTURES)} of several "
        f"ruptures) or, of OpenQuake, {','.join(_OPENQUAKE)}, got {','.join(heading)[:80]!r}"
    )


@contextmanager
def opened(file: Path) -> Iterator[Lines]:
    """Open a text file line by line; TargetError if it cannot be read."""
    try:
        with Lines(file) as lines:
            yield lines
    except RecordError as error:
        reason = str(error).replace("no record is", "no target is").replace("not a record", "not a target")
        raise TargetError(reason) from None


def rows_of(lines: Lines) -> Iterator[tuple[int, list[str]]]:
    """Yield the words of each row with the number of its line; comments and empty lines are left out."""
    for line in lines:
        if not is_blank(line) and not is_comment(line.lstrip(' "')):
            yield lines.number, [word.strip() for word in next(csv.reader([line]), [])]


def numbered(file: Path, at: int, word: str, what: str, least: float, above: bool) -> float:
    """Return a number of a line; TargetError if it is none, or is not at least (or above) the minimum."""
    try:
        number = float(word)
    except ValueError:
        number = math.nan
    if not math.isfinite(number) or number < least or (above and number == least):
        sign = ">" if above else ">="
        raise TargetError(f"{file}: line {at} gives {what} as {word[:30]!r}, must be a number {sign} {least:g}")
    return number


def _own(file: Path, table: list[tuple[int, dict[str, str]]], given: Measure, correlations: Any) -> Target | Mixture:
    ruptures: dict[str, list[tuple[Measure, float, float]]] = {}
    weights: dict[str, float] = {}
    for at, row in table:
        name = row.get("rupture", "")
        try:
            measure = measure_named(our_name(row["measure"]))
            factor = in_si(row["unit"], measure)
        except ValueError as error:
            raise TargetError(f"{file}: line {at}: {error}") from None
        median = factor * numbered(file, at, row["median"], f"the median of {measure.label}", 0.0, above=True)
        _doubt_median(file, at, measure, median)
        sigma = numbered(file, at, row["sigma"], f"the sigma of {measure.label}", 0.0, above=True)
        weight = numbered(file, at, row["weight"], "a weight", 0.0, above=False) if "weight" in row else 1.0
        if weights.setdefault(name, weight) != weight:
            raise TargetError(f"{file}: line {at} gives rupture {name!r} another weight than the lines above")
        ruptures.setdefault(name, []).append((measure, median, sigma))
    try:
        targets = [
            Target([row[0] for row in rows], [row[1] for row in rows], [row[2] for row in rows], correlations, given)
            for rows in ruptures.values()
        ]
        return targets[0] if len(targets) == 1 else Mixture(targets, list(weights.values()))
    except ValueError as error:
        raise TargetError(f"{file}: {error}") from None


def _doubt_median(file: Path, at: int, measure: Measure, median: float) -> None:
    """Warn of a median acceleration (SI) that no earthquake has."""
    if measure.units == ACCELERATION and median > HIGHEST_MEDIAN:
        warn([Doubt.of("rupture_median", file=file, line=at, median=written_level(measure, median))])


def _conditional_spectra(
    file: Path, table: list[tuple[int, dict[str, str]]], given: Measure, correlations: Any, statistic: str
) -> Stated:
    if not isinstance(given, Sa) and given != MEASURES["pga"]:
        raise TargetError(f"{file}: conditional spectra are given a spectral ordinate or the PGA, not {given.label}")
    kinds = list(dict.fromkeys(row["stat"] for _, row in table))
    if statistic not in kinds:
        raise TargetError(f"{file}: holds the statistics {', '.join(kinds)[:80]}, not {statistic!r}")
    spectra: dict[float, dict[float, tuple[float, float]]] = {}
    for at, row in table:
        if row["stat"] != statistic:
            continue
        poe = numbered(file, at, row["poe"], "poe", 0.0, above=True)
        period = numbered(file, at, row["period"], "a period", 0.0, above=False)
        median = STANDARD_GRAVITY * numbered(file, at, row["mea"], "a median", 0.0, above=True)
        _doubt_median(file, at, MEASURES["pga"], median)
        ordinates = spectra.setdefault(poe, {})
        if period in ordinates:
            raise TargetError(f"{file}: line {at} gives period {period:g} twice")
        ordinates[period] = median, numbered(file, at, row["std"], "a standard deviation", 0.0, above=False)
    periods = sorted(next(iter(spectra.values())))
    if any(sorted(spectrum) != periods for spectrum in spectra.values()):
        raise TargetError(f"{file}: the spectra must have the same periods at each probability")
    _refuse_velocity(file, spectra)
    measures: list[Measure] = [MEASURES["pga"] if period == 0.0 else Sa(period) for period in periods]
    if given not in measures:
        raise TargetError(
            f"{file}: holds no {given.label}, only {', '.join(measure.label for measure in measures)}"[:200]
        )
    medians = [[spectrum[period][0] for period in periods] for spectrum in spectra.values()]
    sigmas = [[spectrum[period][1] for period in periods] for spectrum in spectra.values()]
    try:
        return Stated(measures, medians, sigmas, given, correlations)
    except ValueError as error:
        raise TargetError(f"{file}: {error}") from None


def _refuse_velocity(file: Path, spectra: dict[float, dict[float, tuple[float, float]]]) -> None:
    """Raise TargetError if the value at period 0 cannot be the peak acceleration of its spectral values."""
    for spectrum in spectra.values():
        greatest = max((median for period, (median, _) in spectrum.items() if period > 0.0), default=math.inf)
        at_zero = spectrum[0.0][0] if 0.0 in spectrum else 0.0
        if at_zero > MOST_PGA * greatest:
            raise TargetError(
                f"{file}: gives {at_zero / STANDARD_GRAVITY:g} at period 0, {at_zero / greatest:.0f} times the largest "
                "Sa: OpenQuake writes a PGV there, with the correlations of a PGA; leave PGV out of its job"
            )


def correlations_in(correlations: Any) -> Any:
    """Return correlations as they are, or those in the CSV file of a path, labelled; TargetError as `read_target`."""
    if not isinstance(correlations, str | os.PathLike) or correlations == FORMULAS:
        return correlations
    file = Path(correlations)
    if not file.exists():
        raise TargetError(f"{file}: no such file of correlations (or write {FORMULAS!r})")
    with opened(file) as lines:
        rows = list(rows_of(lines))
    names = [_label(name) for name in rows[0][1][1:]] if rows else []
    if len(names) < 2 or len(rows) != len(names) + 1:
        raise TargetError(f"{file}: holds {max(len(rows) - 1, 0)} rows for {len(names)} columns, must be square")
    values = np.empty((len(names), len(names)))
    for i, (at, (name, *words)) in enumerate(rows[1:]):
        if _label(name) != names[i]:
            raise TargetError(f"{file}: line {at} is of {name[:30]!r}, the columns have {names[i]} in its place")
        if len(words) != len(names):
            raise TargetError(f"{file}: line {at} has {len(words)} values, its heading {len(names)}")
        values[i] = [numbered(file, at, word, "a correlation", -1.0, above=False) for word in words]
    return xr.DataArray(values, dims=("row", "column"), coords={"row": names, "column": names})


def _label(name: str) -> str:
    """Return our label of a measure; a plain number is a period of Sa."""
    text = our_name(f"Sa({float(name):g})" if re.fullmatch(r"[\d.]{1,20}", name) else name)
    try:
        return measure_named(text).label
    except ValueError:
        return text
