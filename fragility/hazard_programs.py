"""Hazard curves from the CSV of OpenQuake and of nshmp-haz: one site a row, one level a column."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import NamedTuple

from .. import checks
from ..motions.files import Lines
from .hazard import HazardCurve
from .hazard_reading import (
    HazardError,
    Quantity,
    agreed_measure,
    curve_of,
    program_measure,
    program_unit,
    rate_of_word,
    row_words,
)

Site = int | str | tuple[float, float] | None

# A site given by longitude and latitude is found within so many degrees.
NEAR = 0.01


class _Row(NamedTuple):
    """One site of a file with several: its line, its name, where it is, and the words of its rates."""

    line: int
    name: str
    longitude: float
    latitude: float
    words: list[str]


def read_openquake(
    lines: Lines,
    comment: str,
    names: list[str],
    im: str | None,
    site: Site,
    units: str | None,
    years: float | None,
) -> HazardCurve:
    """One site of an export of hazard curves, whose comment and column names are read already."""
    stated = re.search(r"imt=['\"]{1,2}([^'\"]{1,60})['\"]", comment)
    label = agreed_measure(lines, None if stated is None else program_measure(lines, stated[1]), im)
    time = re.search(r"investigation_time=['\"]?([^,'\"\s]{1,40})", comment)
    if (time is None) == (years is None):
        problems = "states no investigation_time: give years", "states its time, so years must not be given"
        raise HazardError(f"{lines.file}: {problems[time is not None]}")
    above = max(lines.number - 1, 1)
    period = years if time is None else lines.value(time[1], "investigation_time", above=0.0, at=above)
    assert period is not None
    if units is not None:
        raise HazardError(f"{lines.file}: OpenQuake's units are known, so units must not be given, got {units!r:.40}")
    # older engines begin the comment with the kind
    kind = re.search(r"kind=['\"]{1,2}([\w.-]{1,40})", comment) or re.match(
        r"#\s{0,9}([a-z]{1,20}[\d.-]{0,20}),", comment
    )
    name = kind[1].lower() if kind else ""
    if name.startswith("std"):
        raise HazardError(f"{lines.file}: holds standard deviations of a hazard curve (kind {name!r}), not a curve")
    quantile = re.fullmatch(r"quantile-(0?\.\d{1,9})", name)
    heading = lines.number
    columns = [at for at, one in enumerate(names) if one.startswith("poe-")]
    levels = [lines.value(names[at][4:], "a level", at=heading) for at in columns]
    row = _chosen(lines, _sites(lines, names, columns), site)
    rates = [rate_of_word(lines, word, "poe", Quantity("probability", period), row.line) for word in row.words]
    fractile = float(quantile[1]) if quantile and 0.0 < float(quantile[1]) < 1.0 else None
    text = f"OpenQuake{f' {name}' if name else ''}, {_place(row)}"
    return curve_of(lines.file, label, program_unit(label), levels, [rates], None, text, fractile)


def read_nshmp(
    lines: Lines, names: list[str], im: str | None, site: Site, units: str | None, years: float | None
) -> HazardCurve:
    """One site of curves.csv or total.csv, whose column names are read already."""
    try:
        folder = program_measure(lines, lines.file.resolve().parent.name)
    except HazardError:
        folder = None
    label = agreed_measure(lines, im or folder, None)
    heading = lines.number
    columns = [at for at, one in enumerate(names) if re.fullmatch(r"[\d.][\d.eE+-]{0,30}", one)]
    other = [one for at, one in enumerate(names) if at not in columns and one not in ("name", "lon", "lat", "vs30")]
    if other or len(columns) < 2:
        problem = f"got a column {other[0][:40]!r}" if other else f"got {len(columns)} levels"
        raise HazardError(f"{lines.file}: line {heading} must name name, lon, lat and at least two levels, {problem}")
    levels = [lines.value(names[at], "a level", at=heading) for at in columns]
    row = _chosen(lines, _sites(lines, names, columns), site)
    quantity = Quantity("rate") if years is None else Quantity("probability", years)
    rates = [rate_of_word(lines, word, quantity.kind, quantity, row.line) for word in row.words]
    return curve_of(lines.file, label, units or program_unit(label), levels, [rates], None, f"nshmp-haz, {_place(row)}")


def _sites(lines: Lines, names: list[str], columns: list[int]) -> Iterator[_Row]:
    """Sites row by row; their rates are read of the one chosen alone."""
    if not {"lon", "lat"} <= set(names):
        raise HazardError(f"{lines.file}: line {lines.number} must name lon and lat, got {names[0][:40]!r}, …")
    longitude, latitude = names.index("lon"), names.index("lat")
    title = names.index("name") if "name" in names else None
    for line in lines:
        if not line.strip() or line.startswith("#"):
            continue
        words = row_words(lines, line, ",")
        if len(words) != len(names):
            raise HazardError(f"{lines.file}: line {lines.number} has {len(words)} columns, its heading {len(names)}")
        place = [lines.value(words[at], what) for at, what in ((longitude, "a longitude"), (latitude, "a latitude"))]
        name = "" if title is None else words[title]
        yield _Row(lines.number, name, place[0], place[1], [words[at] for at in columns])


def _chosen(lines: Lines, rows: Iterator[_Row], site: Site) -> _Row:
    """The one site, or the one that is named; HazardError where there is no such site or none is chosen of several."""
    if site is None:
        first = next(rows, None)
        if first is None:
            raise HazardError(f"{lines.file}: holds no site")
        others = sum(1 for _ in rows)
        if others:
            raise HazardError(f"{lines.file}: holds {others + 1} sites: give site, a number, a name or (lon, lat)")
        return first
    if isinstance(site, str):
        named = [row for row in rows if row.name == site]
        if len(named) != 1:
            raise HazardError(f"{lines.file}: holds {len(named) or 'no'} sites of the name {site!r:.40}")
        return named[0]
    if isinstance(site, tuple | list) and len(site) == 2:
        longitude, latitude = (checks.number("site", one, unit="degrees") for one in site)
        nearest, distance = None, math.inf
        for row in rows:
            turn = abs((row.longitude - longitude + 180.0) % 360.0 - 180.0)
            apart = max(turn, abs(row.latitude - latitude))
            if apart < distance:
                nearest, distance = row, apart
        if nearest is None or distance > NEAR:
            there = "none" if nearest is None else f"the nearest is {_place(nearest)}"
            raise HazardError(
                f"{lines.file}: holds no site within {NEAR} degrees of ({longitude:g}, {latitude:g}); {there}"
            )
        return nearest
    index = checks.count("site", site)
    count = 0
    for row in rows:
        if count == index:
            return row
        count += 1
    raise HazardError(f"{lines.file}: holds {count} sites, numbered from 0, got site {index}")


def _place(row: _Row) -> str:
    return f"{f'{row.name}, ' if row.name else ''}lon {row.longitude:g}, lat {row.latitude:g}"
