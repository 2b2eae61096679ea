"""Hazard curves from plain tables that name their measure, units and times in the heading."""

from __future__ import annotations

import re

import numpy as np

from ..motions.files import Lines
from .hazard import HazardCurve
from .hazard_reading import (
    MOST_LEVELS,
    HazardError,
    Quantity,
    agreed_measure,
    curve_of,
    measure_label,
    rate_of_word,
    row_words,
)

_YEARS = re.compile(r"(\d{1,9}(?:\.\d{0,9})?)\s?-?\s?(?:years?|yrs?|y|a)(?![a-z])")
_PER_YEAR = ("1/yr", "1/year", "1/a", "/yr", "/year", "yr-1", "year-1", "a-1", "peryear", "peryr", "yr^-1", "year^-1")
_WEIGHT = re.compile(r"weight\s{0,9}[=:]?\s{0,9}([\d.]{1,20}(?:e-?\d{1,3})?)")
_BRACKETS = re.compile(r"(?P<name>.{1,200}?)\s*[\[(](?P<unit>[^()\[\]]{1,40})[\])]\s*")


def read_plain(
    lines: Lines, names: list[str], separator: str, im: str | None, units: str | None, years: float | None
) -> HazardCurve:
    """The rows below a heading, whose `names` are read already: levels, and one column of rates or several."""
    label, stated = _measure_and_unit(lines, names[0])
    label = agreed_measure(lines, label, im)
    if (stated is None) == (units is None):
        given = "names no unit of its levels: give units", "states its unit, so units must not be given"
        problem = given[stated is not None]
        raise HazardError(f"{lines.file}: line {lines.number} {problem}")
    if len(names) < 2:
        raise HazardError(f"{lines.file}: line {lines.number} must name levels and rates, got {names[0][:40]!r} alone")
    kinds = [_kind(lines, name, years) for name in names[1:]]
    weights = [weight for _, weight in kinds]
    if len(kinds) > 1 and None in weights:
        name = names[1 + weights.index(None)][:40]
        raise HazardError(
            f"{lines.file}: line {lines.number} names {len(kinds)} columns of rates: realisations need a weight each, "
            f"as 'rate (1/yr) weight 0.3', got {name!r}"
        )
    table: list[list[float]] = []
    for line in lines:
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        words = row_words(lines, line, separator)
        if len(words) != len(names):
            raise HazardError(f"{lines.file}: line {lines.number} has {len(words)} columns, its heading {len(names)}")
        level = lines.value(words[0], names[0][:40])
        rates = [
            rate_of_word(lines, word, name, quantity)
            for word, name, (quantity, _) in zip(words[1:], names[1:], kinds, strict=True)
        ]
        table.append([level, *rates])
        if len(table) > MOST_LEVELS:
            raise HazardError(f"{lines.file}: line {lines.number} is beyond {MOST_LEVELS} levels, no hazard curve is")
    values = np.array(table).reshape(-1, len(names)).T
    shares = None if len(kinds) == 1 else [float(weight) for weight in weights if weight is not None]
    return curve_of(lines.file, label, units if stated is None else stated, values[0], values[1:], shares)


def _measure_and_unit(lines: Lines, text: str) -> tuple[str | None, str | None]:
    """The measure and the unit of the first column, None for a unit that is not there."""
    match = _BRACKETS.fullmatch(text)
    for name, unit in ((text, None), *([(match["name"], match["unit"])] if match else [])):
        try:
            return measure_label(name), unit
        except ValueError:
            continue
    raise HazardError(
        f"{lines.file}: line {lines.number} must name the measure with its unit, as 'pga (g)' or 'Sa(1.0) (m/s2)', got "
        f"{text[:40]!r}"
    )


def _kind(lines: Lines, name: str, years: float | None) -> tuple[Quantity, float | None]:
    """What a column is, and its weight where it is a realisation."""
    where = f"{lines.file}: line {lines.number}"
    text = name.lower()
    weight = None
    if (found := _WEIGHT.search(text)) is not None:
        weight = lines.value(found[1], f"the weight in {name[:40]!r}", above=0.0)
        text = text.replace(found[0], "")
    probability = re.search(r"(?<![a-z])(?:probability|poe|apoe)(?![a-z])", text) is not None
    if years is not None and not probability:
        raise HazardError(f"{where} names no probability, so years must not be given, got {name[:40]!r}")
    if "return period" in text:
        return Quantity("return period"), weight
    if probability:
        match = _YEARS.search(text)
        annual = 1.0 if re.search(r"annual|(?<![a-z])apoe", text) else None
        own = float(match[1]) if match else annual
        if own is None and years is None:
            raise HazardError(f"{where} names a probability but not in how many years: give years, got {name[:40]!r}")
        if own is not None and years is not None:
            raise HazardError(f"{where} names the years of a probability, so years must not be given: {name[:40]!r}")
        time = years if own is None else own
        if not time:
            raise HazardError(f"{where} names a probability in 0 years, got {name[:40]!r}")
        return Quantity("probability", time), weight
    if re.search(r"(?<![a-z])(?:rate|rates|frequency|afe|mafe)(?![a-z])", text):
        match = _BRACKETS.fullmatch(text.strip())
        if match and match["unit"].replace(" ", "") not in _PER_YEAR:
            raise HazardError(f"{where} must give rates in 1/yr, got {name[:40]!r}")
        return Quantity("rate"), weight
    raise HazardError(
        f"{where} must name 'rate (1/yr)', 'probability in 50 yr' or 'return period (yr)', got {name[:40]!r}"
    )
