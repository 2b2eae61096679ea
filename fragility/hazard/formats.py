"""Formats of hazard files: plain tables and the files of other programs."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...core import checks
from ...core.aliases import Array
from ...core.doubts import first_names
from ...core.units import DAMPING
from ...motions.matching.target_spectra import other_damping
from ...motions.readers.lines import THOUSANDS, Lines, is_blank, is_comment, plain
from ...motions.readers.units import units_in
from .curve import HazardCurve, unit_to_si
from .plausibility import SEVERAL, names_point, starts_rare
from .reading import (
    INVENTED,
    LARGER,
    LOW_PERCENT,
    MOST_LEVELS,
    NOT_USED,
    RARE,
    UNNAMED,
    HazardError,
    Quantity,
    agreed_measure,
    curve_of,
    measure_label,
    program_measure,
    rate_of_word,
    row_words,
    unit_of_program,
)

Site = int | str | tuple[float, float] | None
"""A site of a file: its number, its name, or its longitude and latitude; None if the file has only one."""

# Tolerance, in degrees, of a site given by longitude and latitude.
NEAR = 0.01

_YEARS = {
    **dict.fromkeys(("yr", "yrs", "year", "years", "y", "a"), 1.0),
    **dict.fromkeys(("month", "months"), 1.0 / 12.0),
    **dict.fromkeys(("decade", "decades"), 10.0),
    **dict.fromkeys(("century", "centuries"), 100.0),
    **dict.fromkeys(("kyr", "ka", "millennium", "millennia"), 1000.0),
}
"""Years of each unit of time that a heading may name."""
_TIME = re.compile(
    r"(?P<per>(?:1\s?)?/\s?\(?\s?|(?<![a-z])(?:per|in)\s)?"
    rf"(?:(?<![\d.,])(?P<number>\d{{1,9}}(?:\.\d{{1,9}})?)\s?-?\s?|(?<![a-z]))(?P<unit>{'|'.join(_YEARS)})(?![a-z])"
    r"(?P<power>\s?\^?\s?-\s?1(?!\d))?"
)
_KINDS = {
    "return period": re.compile(r"return periods?"),
    "probability": re.compile(r"(?<![a-z])(?:probability|probabilities|poes?|apoe)(?![a-z])"),
    "rate": re.compile(r"(?<![a-z])(?:rate|rates|frequency|afe|mafe)(?![a-z])"),
}
_WRITTEN = {
    "return period": "return periods in yr, as 'return period (yr)'",
    "probability": "probabilities with their time, as 'probability in 50 yr' or 'probability in 50 yr (%)'",
    "rate": "rates in 1/yr, as 'rate (1/yr)'",
}
_OF_SHARES = (
    r"(?:(?:per[cz]|c)entile?|fra[ckt]tile?|[qc]uantile?|aggregation ?level|yüzdelik"
    r"|分位|パーセンタイル|(?:квант|(?:про|перс?)цент)иль)"
)
_FRACTILES = re.compile(
    r"(?i)(?<![\d.,])(?P<before>\d{1,2}(?:[.,]\d{1,3})?)[\s-]?(?:st|nd|rd|th|[èeé]?me|[eo.°ºª%]|per cent)?[\s-]{0,2}"
    rf"{_OF_SHARES}|{_OF_SHARES}[\s=:-]{{0,3}}(?P<after>0?[.,]\d{{1,3}}|\d{{1,2}}(?:[.,]\d{{1,3}})?)(?!\d)"
    r"|(?:(?<![a-z\d] )(?<![a-z\d-])p|(?<![a-z\d-])q)(?P<short>(?:0?[.,])?(?:05|10|1[56]|50|8[45]|9[058]))(?![a-z\d])"
    r"|(?:curve|kurve|kurva|courbe|curva)\W{1,3}(?P<curve>1[56]|8[45]|9[058])\s?%(?!\s?(?:in|poe|prob)(?![a-z]))"
    r"|(?:/\s?(?=1)|(?<![\d.])(?=[89]))(?P<ordinal>1[56]|8[45]|9[058])th(?!\w|\s(?:st|av|of|c))"
    r"|(?P<median>(?<![a-z])m[eé]dian[ae]?(?![a-z])(?!\s(?:v_?s|mag|dist|depth|gmm|gmpe|ground)))"
)
_SPREAD = re.compile(
    r"(?i)(?:standard deviations?|(?<![a-z])std(?![a-z])|[+±-]\s?(?:\d|\d?\.\d+)?\s?(?:sigma|σ)(?![a-z])"
    r"|(?:plus|minus) (?:(?:one|two|\d) )?(?:sigma|σ|standard))"
    r"|(?P<bound>(?:upper|lower)[- ](?:bound(?! m)|confidence|\d\d\s?%)|\d\s?% confidence(?!\s?(?:interval|band))|"
    r"confidence (?:upper|lower|limit|level\W{1,3}\d)|"
    r"obere (?:grenze|schranke)(?!\w)|obergrenze|borne sup|limite? superior)"
)
_VERTICAL = re.compile(  # (curves are of horizontal shaking with a damping of 5 %)
    r"(?i)verti[ck]ale? (?:component|motion|pga|hazard|acc|spec)|(?:component|comp|imc|direction)\w*\W{0,3}verti[ck]al"
    r"|#\W*verti[ck]ale?\W*(?=#|$)|d[uü][sş]ey|上下動|[鉛铅垂竖][直向]|вертикальн|κατακόρυφ"
)
_LARGER = re.compile(
    r"(?i)rotd100|larger (?:horizontal|component|of)|max\w*[- ](?:horizontal )?(?:direction|component)|"
    r"\bsrss\b|vector sum|resultant"
)
_OTHER_RATES = re.compile(
    r"(?i)(?:not|non)[- ]cumulative|incremental rate\w*|occurrence rate\w*"
    r"|(?:rates?|occurrence) (?:per|of each|in each) bin|non-?exceed\w*|(?<![a-z])per ?mill?e|promille|‰"
    r"|(?:(?<![\d\s])\s?[x×*]|times|units of|multipl\w+ by)\s?(?:10\s?(?:\^|\*\*)?\s?-?\d|10⁻|1e-?\d|0\.0*1|1000)[\d]*"
)
_PER_CENT = re.compile(
    r"(?i)(?<!levels )(?<![a-z])(?:in|as) (?:%|per ?cent)(?!\w|\s?(?:of|g(?![a-z])))"
    r"|(?<!\d)(?<!\d )(?:%|per ?cent)\s?(?:per |/\s?)(?:yr|year)"
)
_NOT_USED = re.compile(
    r"(?i)(?:multipl[iy]\w*|scaled|divided?|amplified|reduced|increased) (?:\S+ ){0,3}?by [^#;,]{1,30}"
    r"|conditional (?:up)?on [^#;,]{1,30}|given (?:that )?(?:an? |the )?(?:earthquake|event|rupture)[^#;,]{0,20}"
    r"|\bscenario (?:hazard|curve)|\b(?:at|on|of) the (?:roof|(?:\w+th|first|second|third|top) floor)"
    r"|\b(?:floor \w+|roof) (?:motion|response)"
    r"|(?:(?:background|subduction|crustal|fault|zone|source)\w* ){1,2}(?:\S+ )?(?:excluded|not included)"
    r"|(?:[^\s#;,]+ ){1,4}(?<!mean )(?<!horizontal )only(?![a-z])"
    r"|(?:only|excluding|without) (?:\w+ )?(?:source|fault|zone|background|subduction|crustal)[^#;,]{0,20}"
    r"|(?:at least one|any|aggregat\w+|averag\w+)(?: of| over)? \d+ sites"
    r"|(?:branch|reali[sz]ation)\W{0,3}\d+(?: of \d+)?|(?<![a-z])weight\W{1,3}0?\.\d+"
    r"|(?<![a-z])(?:ln|log(?:10)?|logarithms?) ?(?:of |\()(?:the )?(?:pg|sa|level|rate|ground|prob)\w*|log base 10"
    r"|(?<!return )(?<!time )(?<![a-z])period\s?[:=]\s?0?\.?[1-9][\d.]*\s?(?:s(?:ec\w*)?(?![a-z])|(?=#|$))"
    r"|factors?(?![a-z])[^#;,]{0,30} (?:not (?:applied|included)|to be applied)"
    r"|(?:importance|safety) factor[^#;,]*|design (?:spectrum|levels?|ground motions?) ?[x×*·] ?\d[^#;,]*"
    r"|(?:site|soil)\w* (?:amplification|effects?|response) (?:\S+ )?not (?:included|considered|applied)"
    r"|time[- ]dependent[^#;,]*"
    r"|(?<![a-z\d])t ?= ?0?\.?[1-9][\d.]* ?s(?![a-z])"
)
_ENGLISH = {
    re.compile(pattern, re.IGNORECASE): word
    for pattern, word in {
        r"\b(?:jahr(?:en?|e)?|années?|anni|años?|anos|yıl\w*|yil(?:da)?|(?:(?<=\d )|(?<=par )|(?<=/))ans?)\b": "years",
        r"\b(?:pro|par|por|pour|sur|su|per) (?=\d|year)": "per ",
        r"\b(?:en|em|für) (?=[\d%]|gal\b|g\b|[cm]?m/s)": "in ",
        r"\b(?:rate[n]?|taux|tasas?|tasso|tassi|taxas?)\b": "rates",
        r"\b(?:häufigkeit\w*|fréquences?|frecuencias?|frequenz[ae])": "frequency",
        r"\b(?:\w*wahrscheinlichkeit\w*|probabilit[éà]s?|probabilidad\w*|olas[ıi]l[ıi][kğg]\w*)": "probability",
        r"\b(?:wiederkehrperiode\w*|p[ée]r[ií]od\w+ d[ei] (?:retour|retorno|ritorno))": "return period",
        r"\b(?:mittelwert\w*|moyenne\w*|promedio)\b": "mean",
        r"\b(?:umgerechnet|aus|calculad[oa]s?|à partir d\w)\b": "from",
        r"\bpro(?:zent|cent\w*)\b|\bpour ?cent\b|\bpor ciento\b": "per cent",
        r"(?:年?超過確率|年?超越概率|πιθανότητα\w*|вероятност\w*)": " probability ",
        r"(?:再現期間|重现期|период\w* повторяемости|περίοδο\w* επαναφοράς)": " return period ",
        r"(?<=\d)\s?(?:年|έτη|ετών|лет|год\w*)": " years ",
        r"\b(?:ivme|ac+[eé]l[eé]ra[ctz]\w+|beschleunigung\w*|ускорени\w+|επιτάχυνσ\w+)|加速度": "acceleration",
        r"\bpour ?mille\b|\bpor mil\b|\bper mille\b": "per mille",
    }.items()
}
"""Words of comments in ten other languages, for which the English one is read."""
_OF_RATES = re.compile(r"rate|frequen|exceed|events?|number of (?:event|exceed)|^\W*per ")
_OF_SOURCES = re.compile(r"slip|activity|recurrence|seismicity|catalog|\bdata\b|\blife|from|convert", re.IGNORECASE)
_RATES = re.compile(r"rate|frequenc|from|convert", re.IGNORECASE)
"""Words with which a comment on probabilities is still consistent with rates."""
_ANNUAL = re.compile(r"(?<![a-z])(?:annual|yearly|apoe|afe|mafe)(?![a-z])")
_PERCENT = re.compile(r"%|(?<![a-z])per ?cent(?![a-z])")
_PLAIN_WORDS = frozenset(
    {"annual", "yearly", "mean", "total", "average", "seismic", "hazard", "being", "of", "the", "at", "least", "once"}
    | {"exceedance", "exceedence", "exceeding", "exceeded"}
)
"""Words that a heading may contain in addition to its quantity: none of them changes the meaning of its numbers."""
_BRANCH = re.compile(r"(?:rlz|branch|realisation|realization|model|b)?\d{0,4}|[a-z]")
"""Names of realisations, without their weight."""
_NAMED = re.compile(
    r"(?i)(?<![a-z\d_])(?:(?P<peak>pg[avd])(?![a-z])|peak ground (?P<word>[avd])\w+"
    r"|(?:p?sa|spectral acceleration)\s?(?:at|\()?\s?(?:t\s?=\s?)?(?P<period>\d+(?:\.\d+)?)\s?(?:s(?:ec)?\b|\))\)?"
    r"|(?:p?sa|spectral acceleration)\s?(?:at|[(,:])?\s?(?P<hertz>[1-9]\d*(?:\.\d+)?)\s?hz(?![a-z])"
    r"|(?<![\d.])(?P<of>\d+(?:\.\d+)?)[\s-]?s(?:ec\w*)? (?:p?sa|spectral acc\w*)(?![a-z])|p?sa(?P<bare>\d\.\d+)(?!\d)"
    r"|(?P<hz>(?<![\d.])[1-9]\d*(?:\.\d+)?)[\s-]?hz (?:p?sa|spectral acc\w*)(?![a-z]))"
)
"""Measures that comments name: PGA, peak ground velocity, Sa(1.0 s), SA(1.0), spectral acceleration at 1 s."""
_WEIGHT = re.compile(r"weight\s{0,9}[=:]?\s{0,9}([\d.]{1,20}(?:e-?\d{1,3})?)")
OF_MEASURES = re.compile(r"([a-z]{2,8}(?:\([\d.]{1,20}\))?)-(\d[\d.]{0,20}(?:e[+-]?\d{1,3})?)")
"""Name of a column of OpenQuake's older tables of several measures, in small letters: measure and level."""
MAP = "is a map or uniform hazard spectra, whose columns are probabilities: give hazard curves"
_POES = frozenset((0.632, 0.63, 0.5, 0.39, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002105, 0.000404))
"""Probabilities of exceedance for which OpenQuake's maps are usually made."""
_PLACE = re.compile(r"(?<![A-Za-z0-9])(?:PGA|PGV|PGD|CAV|SA\d{1,3}P\d{1,3}|SA\([\d.]{1,9}\))(?![A-Za-z0-9])")
_BRACKETS = re.compile(r"(?P<name>.{1,200}?)\s*[\[(](?P<unit>[^()\[\]]{1,40})[\])]\s*")


class Asked(NamedTuple):
    """What a caller says of a table: measure, site, unit of the levels and years of probabilities, None if nothing."""

    im: str | None
    site: Site
    units: str | None
    years: float | None


def read_plain(lines: Lines, comment: str, names: list[str], separator: str, asked: Asked) -> HazardCurve:
    """Read the rows of a plain table below its heading `names`: levels, and one or several columns of rates."""
    im, site, units, years = asked
    if site is not None:
        raise HazardError(f"{lines.file}: is a table of one site, so site must not be given, got {site!r:.40}")
    label, unit = _measure_and_unit(lines, names[0])
    label = agreed_measure(lines, label, im)
    if (text := stated(lines, comment, "imt")) is not None:
        agreed_measure(lines, program_measure(lines, text), label)
    if (unit is None) == (units is None):
        given = "names no unit of its levels: give units", "states its unit, so units must not be given"
        problem = given[unit is not None]
        raise HazardError(f"{lines.file}: line {lines.number} {problem}")
    if len(names) < 2:
        raise HazardError(f"{lines.file}: line {lines.number} must name levels and rates, got {names[0][:40]!r} alone")
    kinds = [_column_quantity(lines, name, years) for name in names[1:]]
    weights = [weight for _, weight in kinds]
    if len(kinds) > 1 and None in weights:
        name = names[1 + weights.index(None)][:40]
        raise HazardError(
            f"{lines.file}: line {lines.number} names {len(kinds)} columns of rates: realisations need a weight each, "
            f"as 'rate (1/yr) weight 0.3', got {name!r}"
        )
    fractile, notes = _read_comments(lines, comment, label, units if unit is None else unit, kinds[0][0])
    table: list[list[float]] = []
    unsure: list[tuple[int, str, str]] = []
    periods = [False, *(quantity.kind == "return period" for quantity, _ in kinds)]
    decimal = False  # (True once a number shows that points mark decimals)
    for line in lines:
        if is_blank(line) or is_comment(line):
            continue
        words = _row_under(names, lines, line, separator)
        level = lines.value(words[0], names[0][:40])
        decimal = decimal or any("." in word and not THOUSANDS.fullmatch(word) for word in words)
        unsure += [
            (lines.number, name, word)
            for word, name, period in zip(words, names, periods, strict=True)
            if (period or separator != ",") and THOUSANDS.fullmatch(word)
        ]
        rates = [
            rate_of_word(lines, word, name, quantity)
            for word, name, (quantity, _) in zip(words[1:], names[1:], kinds, strict=True)
        ]
        table.append([level, *rates])
        if len(table) > MOST_LEVELS:
            raise HazardError(f"{lines.file}: line {lines.number} is beyond {MOST_LEVELS} levels, no hazard curve is")
    if unsure and not decimal:
        at, name, word = unsure[0]
        whole, _, thousands = word.partition(".")
        raise HazardError(
            f"{lines.file}: line {at} gives {name[:40]!r} as {word!r}, which is ambiguous: write {whole}{thousands} or "
            f"{whole}.0"
        )
    values = np.array(table).reshape(-1, len(names)).T
    shares = None if len(kinds) == 1 else [float(weight) for weight in weights if weight is not None]
    # (in a year, all are below 1 %)
    low = bool(table) and all(
        quantity.unit == 0.01 and quantity.years > 1.0 and -np.expm1(-column.max() * quantity.years) < 0.01
        for column, (quantity, _) in zip(values[1:], kinds, strict=True)
    )
    text = f"table ({LOW_PERCENT})" if low else f"table{notes}"
    if not low and table and all(quantity.kind == "probability" and quantity.years >= SEVERAL for quantity, _ in kinds):
        first = table[0][0] * unit_to_si(units if unit is None else unit, label)
        chances = [-math.expm1(-rate * quantity.years) for rate, (quantity, _) in zip(table[0][1:], kinds, strict=True)]
        text = f"table ({RARE})" if starts_rare(label, first, max(chances)) else text
    read = text, *dict.fromkeys(quantity.text for quantity, _ in kinds)
    return curve_of(lines.file, label, units if unit is None else unit, values[0], values[1:], shares, read, fractile)


def _read_comments(
    lines: Lines, comment: str, label: str, unit: str | None, quantity: Quantity, format_: str = "", kind: str = ""
) -> tuple[float | None, str]:
    """Return the fractile of comments, None for a mean, and a note on the rest; HazardError for contradictions."""
    text, untimed = comment, "#".join(part for part in comment.split("#") if not names_point(part))
    for pattern, word in _ENGLISH.items():
        text, untimed = pattern.sub(word, text), pattern.sub(word, untimed)
    where = f"{lines.file}: {format_ or f'line {lines.number}'} names"
    for contrary, plural in (("probability", "probabilities"), ("return period", "return periods")):
        if quantity.kind == "rate" and _KINDS[contrary].search(untimed.lower()) and not _RATES.search(untimed):
            raise HazardError(f"{where} rates, a comment {plural}: correct one of them")
    _refuse_other_comments(lines, text, label, unit, where)
    _refuse_other_time(lines, untimed, quantity, where)
    larger = _LARGER.search(text) and not label.startswith("RotD100")
    unused = (match[0].strip() for match in _NOT_USED.finditer(text))
    used = next((part for part in unused if part[0] not in "tTpP" or "Sa(" not in label), None)
    notes = f" ({LARGER})" if larger else f" ({NOT_USED} {plain(used)})" if used else ""
    notes += f" ({INVENTED})" if re.search(r"(?i)\binvented\b", comment) else ""
    fractile, q = _fractile(lines, kind or (stated(lines, comment, "kind") or "").lower()), _fractile_of(lines, text)
    return fractile if kind else fractile or q, notes


def _refuse_other_time(lines: Lines, comment: str, quantity: Quantity, where: str) -> None:
    """Raise HazardError if comments speak of probabilities in another time than the heading, or of rates."""
    time = stated(lines, comment, "investigation_time")
    words = comment.lower()
    for text in words.split("#"):
        contrary = [match[0] for match in _OTHER_RATES.finditer(text)]
        contrary += [match[0] for match in _PER_CENT.finditer(text) if quantity.unit != 0.01]
        spoken = [kind for kind, pattern in _KINDS.items() if pattern.search(text)]
        probable = quantity.kind == "probability" and spoken == ["probability"] and not re.search(r"\d ?%", text)
        if probable or (quantity.kind == "rate" and _OF_RATES.search(text)):
            per = [match for match in _TIME.finditer(text) if _belongs(match, "rate") and match[0][0] != "1"]
            contrary += [at[0] for at in per if float(at["number"] or 1.0) * _YEARS[at["unit"]] != quantity.years]
        if contrary and not _OF_SOURCES.search(text):
            head = f"probabilities in {quantity.years:g} yr" if probable else _WRITTEN[quantity.kind].partition(",")[0]
            raise HazardError(f"{where} {head}, a comment {plain(contrary[0].strip())!r}: correct one of them")
    if time is None and _ANNUAL.search(words) and _KINDS["probability"].search(words) and not _RATES.search(words):
        time = "1"
    if time is None:
        return
    years = lines.value(time, "investigation_time", above=0.0, at=max(lines.number - 1, 1))
    if quantity.kind != "probability" or quantity.years != years:
        held = f"probabilities in {quantity.years:g} yr" if quantity.kind == "probability" else f"{quantity.kind}s"
        remark = f"a comment probabilities in {years:g} yr"
        raise HazardError(f"{where} {held}, {remark}: correct one of them")


def _fractile_of(lines: Lines, comment: str) -> float | None:
    """Return the fractile that comments name, None for a mean; HazardError for other curves than of a plain mean."""
    spread, vertical = _SPREAD.search(comment), _VERTICAL.search(comment)
    if spread is not None:
        what = "a bound" if spread["bound"] else "a standard deviation"
        raise HazardError(f"{lines.file}: a comment names {what}: give the mean, or correct it")
    words = vertical[0].strip("# ") if vertical else other_damping(comment, DAMPING)
    if words:
        raise HazardError(f"{lines.file}: a comment names {words!r}: levels are of horizontal shaking, damped by 5 %")
    for match in _FRACTILES.finditer(comment):
        number = next((text for name, text in match.groupdict().items() if text and name != "median"), "")
        share = float(number.replace(",", ".") or 0.5) / (1.0 if re.match("0?[.,]|$", number) else 100.0)
        if 0.0 < share < 1.0 and not (match["median"] and re.search(r"(?i)(?<![a-z])mean(?![a-z])", comment)):
            return share
    return None


def _refuse_other_comments(lines: Lines, comment: str, label: str, unit: str | None, where: str) -> None:
    """Raise HazardError if comments name other measures alone, or another unit of the levels, than the heading."""
    named = {
        f"Sa({float(period)!r})"
        if (period := match["period"] or match["of"] or match["bare"])
        else f"Sa({1.0 / float(match['hertz'] or match['hz'])!r})"
        if match["hertz"] or match["hz"]
        else f"pg{(match['peak'] or match['word']).lower()[-1]}"
        for match in _NAMED.finditer(comment)
    }
    if named and not any(label == name or label.startswith(f"{name[:-1]}, ") for name in named):
        raise HazardError(f"{where} {label}, a comment {first_names(sorted(named))}: correct one of them")
    for text in comment.split("#"):
        # (a measure is what its levels are of, not a peak of something else)
        words = _NAMED.sub(lambda match: "velocity" if re.search("v$|ve", match[0].lower()) else "acceleration", text)
        stated = [levels for levels in units_in(words, lines.number) if not levels.once]
        mismatched = [
            levels.text.strip()
            for levels in stated
            if _si(levels.text, label) not in (None, _si(unit, label))
            or (levels.quantity == "acceleration" and math.isnan(levels.factor))
        ]
        if mismatched and len(mismatched) == len(stated):
            raise HazardError(f"{where} levels in {unit}, a comment in {plain(mismatched[0])}: correct one of them")


def _si(unit: str | None, label: str) -> float | None:
    """Return the SI value of a unit of a measure, None if it is none."""
    try:
        return unit_to_si(None if unit is None else unit.strip(" ()[].,;"), label)
    except ValueError:
        return None


def _row_under(names: list[str], lines: Lines, line: str, separator: str) -> list[str]:
    """Return the words of a row, one for each name of the heading; HazardError for another number of words."""
    words = row_words(lines, line, separator)
    if len(words) != len(names):
        raise HazardError(f"{lines.file}: line {lines.number} has {len(words)} columns, its heading {len(names)}")
    return words


def _measure_and_unit(lines: Lines, text: str) -> tuple[str, str | None]:
    """Return the measure and the unit of the first column; None for a missing unit."""
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


def _column_quantity(lines: Lines, name: str, years: float | None) -> tuple[Quantity, float | None]:
    """Return the quantity of a column, and its weight if the column is a realisation; every word is understood."""
    where = f"{lines.file}: line {lines.number}"
    text = re.sub(r"(?<![a-z])(?:any one|any|one|a) (?=year)", "1 ", " ".join(name.lower().split()))
    weight = None
    if (match := _WEIGHT.search(text)) is not None:
        weight = lines.value(match[1], f"the weight in {name[:40]!r}", above=0.0)
        text = text.replace(match[0], "")
    kind = next((kind for kind, words in _KINDS.items() if words.search(text)), None)
    if years is not None and kind != "probability":
        raise HazardError(f"{where} names no probability, so years must not be given, got {name[:40]!r}")
    if kind is None:
        raise HazardError(
            f"{where} must name 'rate (1/yr)', 'probability in 50 yr' or 'return period (yr)', got {name[:40]!r}"
        )
    times = list(_TIME.finditer(text))
    stated = {float(time["number"] or 1.0) * _YEARS[time["unit"]] for time in times}
    if _ANNUAL.search(text):
        stated.add(1.0)
    rest = _ANNUAL.sub(" ", _KINDS[kind].sub(" ", _TIME.sub(" ", text)))
    unit = 1.0
    if kind == "probability" and _PERCENT.search(rest):
        rest, unit = _PERCENT.sub(" ", rest), 0.01
    words = [word for word in re.split(r"[\s()\[\],;:._-]+", rest) if word and word not in _PLAIN_WORDS]
    strange = [word for word in words if weight is None or not _BRANCH.fullmatch(word)]
    if strange or len(stated) > 1 or not all(_belongs(time, kind) for time in times):
        what = f", whose {strange[0][:20]!r} is not known" if strange else ""
        raise HazardError(f"{where} must give {_WRITTEN[kind]}, got {name[:60]!r}{what}")
    period = next(iter(stated), None)
    if kind != "probability":
        return Quantity(kind, 1.0 if period is None else period), weight
    if period is None and years is None:
        raise HazardError(
            f"{where} names a probability but not in how many years (`probability in 50 years`), got {name[:40]!r}"
        )
    if period is not None and years is not None:
        raise HazardError(f"{where} names the years of a probability, so years must not be given: {name[:40]!r}")
    time = years if period is None else period
    if not time:
        raise HazardError(f"{where} names a probability in 0 years, got {name[:40]!r}")
    return Quantity(kind, time, unit), weight


def _belongs(time: re.Match[str], kind: str) -> bool:
    """Return True if a time suits a quantity: rates are per time, return periods are times."""
    per = bool(time["power"]) or (time["per"] or "").strip() not in ("", "in")
    if kind == "return period":
        return not per and time["number"] is None
    return per or time["number"] is not None or (kind == "rate" and time["per"] is not None)


class _SiteRow(NamedTuple):
    """Row of a site in a file with several: its line, name, longitude and latitude, and the words of its rates."""

    line: int
    name: str
    longitude: float
    latitude: float
    words: list[str]


def read_openquake(lines: Lines, comment: str, names: list[str], separator: str, asked: Asked) -> HazardCurve:
    """Read one site of an OpenQuake export of hazard curves; its comment and column names have been read."""
    im, site, units, years = asked
    label, unnamed = _named_measure(lines, comment, im)
    time = stated(lines, comment, "investigation_time")
    if (time is None) == (years is None):
        problems = "states no investigation_time in its first line", "states its time, so years must not be given"
        raise HazardError(f"{lines.file}: {problems[time is not None]}")
    above = max(lines.number - 1, 1)
    period = years if time is None else lines.value(time, "investigation_time", above=0.0, at=above)
    assert period is not None
    if units is not None:
        raise HazardError(f"{lines.file}: OpenQuake's units are known, so units must not be given, got {units!r:.40}")
    name = _curve_kind(lines, comment)
    quantity, format_ = Quantity("probability", period), "OpenQuake's format"
    fractile, notes = _read_comments(lines, comment, label, unit_of_program(label), quantity, format_, name)
    heading = lines.number
    columns = [at for at, name in enumerate(names) if name.startswith("poe-")]
    levels = [lines.value(names[at][4:], "a level", at=heading) for at in columns]
    row = _selected_site(lines, _sites(lines, names, columns, separator), site)
    rates = [rate_of_word(lines, word, "poe", quantity, row.line) for word in row.words]
    text = f"OpenQuake{f' {name}' if name else ''}{unnamed}{notes}, {_site_text(row)}"
    return curve_of(lines.file, label, unit_of_program(label), levels, [rates], None, (text, quantity.text), fractile)


def _fractile(lines: Lines, name: str) -> float | None:
    """Return the fractile that a curve's kind names, None for a mean or a realisation; HazardError for others."""
    quantile = re.fullmatch(r"quantile-(0?\.\d{1,9})", name)
    if not (quantile or re.fullmatch(r"|mean|rlz-\d{1,9}", name)):
        what = "standard deviations of a hazard curve" if name.startswith("std") else "no mean, quantile or realisation"
        raise HazardError(f"{lines.file}: holds {what} (kind {name[:40]!r}): give the mean")
    return float(quantile[1]) if quantile and float(quantile[1]) > 0.0 else None


def stated(lines: Lines, comment: str, key: str) -> str | None:
    """Return the value that a comment gives a key, quoted or not; None if it has no such key."""
    value = r"['\"]{1,2}(?P<quoted>[^'\"]{0,60})['\"]|(?P<plain>[^\s,'\"()]{0,60}(?:\([^\s'\"()]{0,40}\))?)"
    matches = re.finditer(rf"(?<![A-Za-z_]){key}\s?[=:]\s?(?:{value})", comment)
    values = list(dict.fromkeys(match["quoted"] if match["plain"] is None else match["plain"] for match in matches))
    if len(values) > 1:
        raise HazardError(f"{lines.file}: states {key} as {plain(values[0])!r} and as {plain(values[1])!r}")
    return values[0] if values else None


def _curve_kind(lines: Lines, comment: str) -> str:
    """Return the kind of OpenQuake's curve, which older engines write first, or else in the name of the file alone."""
    kind = stated(lines, comment, "kind")
    if kind is not None:
        return kind.lower()
    first = re.match(r"#\s{0,9}([a-z]{1,20}[\d.-]{0,20})(?:,|$)", comment)
    if first:
        return first[1]
    name = re.match(
        r"(hazard|quantile)_curve-(mean|max|std|(?:rlz|quantile)-[\d.]{1,9}|[\d.]{1,9})[-_.]", lines.file.name
    )
    if name is None:
        return ""
    return name[2] if name[1] == "hazard" else f"quantile-{name[2].removeprefix('quantile-')}"


def _named_measure(lines: Lines, comment: str, im: str | None) -> tuple[str, str]:
    """Return the measure of another program's file, and a text for its source if neither it nor its place names one.

    The comment names it, or else the name of the file or of a folder above it.
    """
    text = stated(lines, comment, "imt")
    if text is not None:
        return agreed_measure(lines, program_measure(lines, text), im), ""
    place = _measure_of_place(lines.file.resolve())
    if place is not None and im is not None and place != im:
        raise HazardError(
            f"{lines.file}: its name or folder says {place}, but {im} is needed, the measure of the levels: rename it "
            "if that is wrong"
        )
    return agreed_measure(lines, place, im), "" if place is not None else f" ({UNNAMED})"


def _measure_of_place(file: Path) -> str | None:
    """Return the measure in the name of a file or of one of two folders above it, as nshmp-haz' ``SA1P0``."""
    for text in (file.stem, file.parent.name, file.parent.parent.name):
        names = set(_PLACE.findall(text))
        if len(names) == 1:
            return measure_label(names.pop())
        with suppress(ValueError):
            return measure_label(text)
    return None


def one_measure(lines: Lines, names: list[str], im: str | None) -> tuple[str, list[str]]:
    """Return the measure that is read of OpenQuake's older table of several, and the names of columns of one measure.

    `names`: as ``pga-0.1`` and ``sa(0.1)-0.1``; names of the measure are returned as ``poe-0.1``.
    """
    matches = [OF_MEASURES.fullmatch(name) for name in names]
    labels = [None if match is None else program_measure(lines, match[1]) for match in matches]
    held = dict.fromkeys(label for label in labels if label is not None)
    label = _chosen(lines.file, held, im)
    columns = zip(names, matches, labels, strict=True)
    levels = [float(match[2]) for match, key in zip(matches, labels, strict=True) if match is not None and key == label]
    if levels != sorted(levels) or (len(levels) < 5 and _POES.issuperset(levels)):
        raise HazardError(f"{lines.file}: {MAP}")
    return label, [f"poe-{match[2]}" if match is not None and text == label else name for name, match, text in columns]


def _chosen(file: Path, held: Iterable[str], im: str | None) -> str:
    """Return the measure `im`, or the only one in a file; HazardError if it is not there."""
    labels = list(held)
    if im is None and len(labels) > 1:
        raise HazardError(f"{file}: holds curves of {', '.join(labels)}: give im")
    label = im or labels[0]
    if label not in labels:
        raise HazardError(f"{file}: holds no curve of {label}, only of {', '.join(labels)}")
    return label


def read_nshmp(lines: Lines, comment: str, names: list[str], separator: str, asked: Asked) -> HazardCurve:
    """Read one site of nshmp-haz' curves.csv or total.csv; its comment and column names have been read."""
    im, site, units, years = asked
    label, unnamed = _named_measure(lines, comment, im)
    unit = units or unit_of_program(label)
    heading = lines.number
    columns = [at for at, name in enumerate(names) if re.fullmatch(r"[\d.][\d.eE+-]{0,30}", name)]
    extra = [name for at, name in enumerate(names) if at not in columns and name not in ("name", "lon", "lat", "vs30")]
    if extra or len(columns) < 2:
        problem = f"got a column {extra[0][:40]!r}" if extra else f"got {len(columns)} levels"
        raise HazardError(f"{lines.file}: line {heading} must name name, lon, lat and at least two levels, {problem}")
    levels = [lines.value(names[at], "a level", at=heading) for at in columns]
    quantity = Quantity("rate") if years is None else Quantity("probability", years)
    without = f"nshmp-haz' format{' without years' if years is None else ''}"
    fractile, notes = _read_comments(lines, comment, label, unit, quantity, without)
    row = _selected_site(lines, _sites(lines, names, columns, separator), site)
    rates = [rate_of_word(lines, word, quantity.kind, quantity, row.line) for word in row.words]
    read = f"nshmp-haz{unnamed}{notes}, {_site_text(row)}", quantity.text
    return curve_of(lines.file, label, unit, levels, [rates], None, read, fractile)


def _sites(lines: Lines, names: list[str], columns: list[int], separator: str) -> Iterator[_SiteRow]:
    """Yield the sites row by row; only the rates of the selected site are read as numbers."""
    if not {"lon", "lat"} <= set(names):
        raise HazardError(f"{lines.file}: line {lines.number} must name lon and lat, got {names[0][:40]!r}, …")
    longitude, latitude = names.index("lon"), names.index("lat")
    title = next((names.index(title_name) for title_name in ("name", "custom_site_id") if title_name in names), None)
    for line in lines:
        if is_blank(line) or is_comment(line):
            continue
        words = _row_under(names, lines, line, separator)
        place = [lines.value(words[at], what) for at, what in ((longitude, "a longitude"), (latitude, "a latitude"))]
        name = "" if title is None else words[title]
        yield _SiteRow(lines.number, name, place[0], place[1], [words[at] for at in columns])


def _selected_site(lines: Lines, rows: Iterator[_SiteRow], site: Site) -> _SiteRow:
    """Return the only site or the selected one; HazardError if it is missing, or several sites leave a choice."""
    if site is None:
        first = next(rows, None)
        if first is None:
            raise HazardError(f"{lines.file}: holds no site")
        further = sum(1 for _ in rows)
        if further:
            raise HazardError(f"{lines.file}: holds {further + 1} sites: give site, a number, a name or (lon, lat)")
        return first
    if isinstance(site, str):
        named = [row for row in rows if row.name == site]
        if len(named) != 1:
            raise HazardError(f"{lines.file}: holds {len(named) or 'no'} sites of the name {site!r:.40}")
        return named[0]
    if isinstance(site, tuple | list) and len(site) == 2:
        longitude, latitude = (checks.number("site", degrees, unit="degrees") for degrees in site)
        nearest, distance, alike = None, math.inf, 0
        for row in rows:
            turn = abs((row.longitude - longitude + 180.0) % 360.0 - 180.0)
            apart = max(turn, abs(row.latitude - latitude))
            alike = 1 if apart < distance else alike + (apart == distance)
            if apart < distance:
                nearest, distance = row, apart
        if nearest is None or distance > NEAR:
            there = "none" if nearest is None else f"the nearest is {_site_text(nearest)}"
            raise HazardError(
                f"{lines.file}: holds no site within {NEAR} degrees of ({longitude:g}, {latitude:g}); {there}"
            )
        if alike > 1:
            raise HazardError(
                f"{lines.file}: holds {alike} sites as near as {_site_text(nearest)}: give a number or a name"
            )
        return nearest
    index, count, numbered = checks.count("site", site), 0, None
    for row in rows:
        if row.name == str(index) and count != index:
            raise HazardError(f"{lines.file}: site {index} is the name of site number {count}: give a name as text")
        numbered = row if count == index else numbered
        count += 1
    if numbered is not None:
        return numbered
    raise HazardError(f"{lines.file}: holds {count} sites, numbered from 0, got site {index}")


def _site_text(row: _SiteRow) -> str:
    return f"{f'{row.name}, ' if row.name else ''}lon {row.longitude:g}, lat {row.latitude:g}"


def read_services(lines: Lines, im: str | None, component: str) -> HazardCurve:
    """Read a JSON response of the Unified Hazard Tool, or of the later services."""
    file, response_text = lines.file, "\n".join(lines)
    try:
        data = json.loads(response_text)
    except (ValueError, RecursionError) as error:
        where = f"line {error.lineno}: {error.msg}" if isinstance(error, json.JSONDecodeError) else type(error).__name__
        raise HazardError(f"{file}: is no valid JSON ({where})") from None
    status = data.get("status") if isinstance(data, dict) else None
    if isinstance(status, str) and status.lower() not in {"success", "ok"}:
        raise HazardError(f"{file}: is a response of status {plain(status)!r}, not of success")
    response = _member(file, data, "response")
    old = isinstance(response, list)
    entries = response if old else _member(file, response, "hazardCurves")
    if not isinstance(entries, list) or not entries:
        raise HazardError(f"{file}: response must be a list of hazard curves, got {_shown(entries)}")
    by_label: dict[str, Any] = {}
    for entry in entries:
        imt = _member(file, _member(file, entry, "metadata") if old else entry, "imt")
        text = imt.get("value") if isinstance(imt, dict) else imt
        label = program_measure(lines, text if isinstance(text, str) else _shown(text))
        if label in by_label:
            raise HazardError(f"{file}: holds several curves of {label}: keep the one of the site")
        by_label[label] = entry
    label = _chosen(file, by_label, im)
    curves = _member(file, by_label[label], "data")
    if not isinstance(curves, list):
        raise HazardError(f"{file}: data must be a list, got {_shown(curves)}")
    named = {str(_member(file, curve, "component")): curve for curve in curves}
    if len(named) < len(curves):
        raise HazardError(f"{file}: holds several curves of one component: keep the one of the site")
    if component not in named:
        raise HazardError(f"{file}: holds no component {component!r:.40}, only {plain(', '.join(named)) or 'none'}")
    if old:
        levels = _member(file, _member(file, by_label[label], "metadata"), "xvalues")
        rates = _member(file, named[component], "yvalues")
    else:
        values = _member(file, named[component], "values")
        levels, rates = _member(file, values, "xs"), _member(file, values, "ys")
    about = (by_label[label] if old else response).get("metadata")
    texts = {key.lower(): str(text) for key, text in about.items()} if isinstance(about, dict) else {}
    y = texts.get("ylabel", "rate").replace("⁻¹", "-1")
    if "probab" in y.lower() or _column_quantity(lines, y, None)[0] != Quantity("rate"):
        raise HazardError(f"{file}: gives {_shown(y)}, but annual rates are needed: save the response with these")
    own_unit = unit_of_program(label)
    for unit in units_in(_NAMED.sub("acceleration", texts.get("xlabel", "")), lines.number):
        # (the services write g for every measure)
        if unit.text.strip() != "g" and _si(unit.text, label) != _si(own_unit, label):
            raise HazardError(f"{file}: gives {_shown(texts['xlabel'])}, but levels in {own_unit} are needed")
    x, rates = (_numbers(file, name, numbers) for name, numbers in (("levels", levels), ("rates", rates)))
    if x.size != rates.size:
        raise HazardError(f"{file}: {label} must have one rate a level, got {rates.size} for {x.size} levels")
    larger = f" ({LARGER})" * (texts.get("maxdir") == "True")
    read = f"USGS{larger}", plain(component), Quantity("rate").text
    return curve_of(file, label, own_unit, x, [rates], None, read)


def _member(file: Path, holder: Any, key: str) -> Any:
    if not isinstance(holder, dict) or key not in holder:
        raise HazardError(f"{file}: is no response of a USGS hazard service: {key!r} is missing in {_shown(holder)}")
    return holder[key]


def _numbers(file: Path, what: str, values: Any) -> Array:
    if not isinstance(values, list) or len(values) > MOST_LEVELS:
        raise HazardError(f"{file}: {what} must be a list of numbers, got {_shown(values)}")
    for value in values:
        if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < 1e300 or value < 0.0:
            raise HazardError(f"{file}: {what} must be finite numbers >= 0, got {_shown(value)}")
    return np.array(values, dtype=np.float64)


def _shown(value: Any) -> str:
    text = repr(value) if isinstance(value, str | int | float | bool | None) else f"a {type(value).__name__}"
    return text if len(text) <= 40 else f"{text[:37]}..."
