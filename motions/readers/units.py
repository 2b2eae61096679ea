"""Units and quantities in words, headings and sentences of a text file, for the samples that follow."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from ...core import checks
from ...core.doubts import Doubt, warn
from ...core.units import STANDARD_GRAVITY
from .lines import RecordError, folded, plain

GAL = 0.01  # m/s²
# m/s² per unit of acceleration, by the normalised spelling of the unit.
_ACCELERATION = {"g": STANDARD_GRAVITY, "gal": GAL, "cm/s2": GAL, "mm/s2": 0.001, "m/s2": 1.0}
_NAMES = {STANDARD_GRAVITY: "g", GAL: "cm/s²", 0.001: "mm/s²", 1.0: "m/s²"}
GIVEN = "given"
"""Source of a unit or a time step that the caller gives."""
_OTHERS = {
    "velocity": ("m/s", "cm/s", "mm/s", "kine", "in/s", "ft/s"),
    "displacement": ("m", "cm", "mm", "ft"),
    "time": ("s", "ms", "hz"),
}
_QUANTITY = {
    quantity: re.compile(rf"(?<![a-z-])(?:{words})(?![a-z-])|{characters}", re.IGNORECASE)
    for quantity, words, characters in (
        (
            "acceleration",
            r"acc(?:el(?:eration|erations|erogram)?)?|acceleration|a[ck]?celera\w+|beschleunigung|ускорени\w+|ivme\w*"
            r"|επιταχυνσ\w+|شتاب\w*",
            "加速度|가속도",
        ),
        (
            "velocity",
            r"vel(?:ocity|ocities|ocidade?|ocita)?|geschwindigkeit|vitesse|hiz\w*|скорост\w+|ταχυτητ\w+|سرعت|predkosc\w*"
            r"|rychlost\w*|viteza",
            "(?<!加)速度|(?<!가)속도",
        ),
        (
            "displacement",
            r"disp(?:l|lacements?)?|verschiebung|deplacement|spostament[oi]|desplazamiento|deslocamento|lvdt"
            r"|yer ?degistirme\w*|deplasman\w*|deplasare|перемещени\w+|смещени\w+|μετατοπισ\w+|μετακινησ\w+|جابجایی|"
            r"przemieszczeni\w*|posun\w*",
            "変位|位移|변위",
        ),
    )
}
"""Words without accents for each quantity, in any language."""
OF_WAVES = re.compile(
    r"(?i)waves?(?!\w)|shear|vs_?30|wellen?g|\bond[aei]|dalga|волн|κυμα|波|ornekleme hiz|скорость дискрет|"
    r"(?:vel\w*|vitesse) d(?:[ei] |['’])(?:muestreo|campionamento|amostragem|echantillonnage)"
)
"""Words, without accents, next to a velocity of waves or a rate of samples."""
# A multiple next to a unit, which makes it another: "%g", "0.001 G", "1/100 G", "(g) *100", "G (x100)".
_BEFORE = (
    r"(?:(?:[%‰]|per ?cent|per ?mille|[x×*]?\s*(?!(?:19|20)\d\d\b)\d+(?:[.,/^]-?\d+)*(?:e[+-]?\d+)?\s*[%‰x×*]?)"
    r"\s*(?:of\s+)?)"
)
_AFTER = r"(?:[)\]]?\s*[(\[]?\s*(?:[x×*/]\s*\d|times\s+\d|[%‰])[\d.,^e+-]*[)\]]?)"
_MULTIPLE = re.compile(rf"^\s*{_BEFORE}|{_AFTER}\s*$", re.IGNORECASE)
_TIMES = re.compile(
    r"(?i)[%‰]|\bper ?cent|(?<![*s])[*×]\s*\d|\d\s*[*×](?!\*)|(?<![a-z])x ?(?:10|0?\.\d|\de)|\b10+ ?x\b|\b10 ?\^|\b1/\d"
)
# A unit as one word, or "m s-2", "cm/s ^2".
_WORD = rf"{_BEFORE}?(?:[cm]?m\s?[/·.\s]\s?s(?:ec)?(?:\s?(?:\^\s?-?2|²|⁻²|-2)|2)|[^\s,;]+){_AFTER}?"
# "UNITS OF G", "units: cm/s2", "The units are (g)", "UNIT = gal(cm/s/s)", "acceleration units in m/s²"
_TOLD = re.compile(
    r"(?i)(?:units?|unidad(?:es)?|unita|unites?|einheit(?:en)?|единиц\w+|birim\w*|μοναδ\w+|jednost?k\w+|واحد|u\.m\.|[单單単]位|단위)"
    r"(?:\s(?:d[ei] (?:misura|medida|mesure)|измерени\w+|μετρησης|miary)(?: dati)?)?"
    r"(?P<link>\s*(?:of\s+accelerations?\s*(?:is|are|in|[:=])?|of|is|are|[:=：])|\s)\s*"
    rf"(?P<unit>{_WORD})"
)
# ("0.2 in g" is of another number)
_IN = re.compile(rf"(?<!\d)(?<!\d\s)\b(?:in|en|em)\s+(?!units?\b)(?P<unit>{_WORD})", re.IGNORECASE)
_BRACKETS = re.compile(rf"[\[(](?P<unit>[^\])]*(?=[\])]){_AFTER}?)", re.IGNORECASE)
# "ACCELERATION TIME SERIES, GAL", "Acceleration g"
_LAST = re.compile(
    r"(?:[,:]\s*|\b(?:acc[a-z]*|series|history)\s+)(?P<unit>(?:per ?cent (?:of )?)?[a-zмс%][^\s,;]*)[^\w%]*$",
    re.IGNORECASE,
)
_NOT_OURS = re.compile(
    r"(?:milli|micro|[mµμ](?=[- ]?g))(?:[- ]?g(?:n|al)?'?s?)?|(?:tenth|hundredth|thousandth)s?(?: of)?(?: g)?"
    r"|[cd]g|n\s?/\s?kg|(?:da|[dhn])m\s?/\s?s(?:ec)?(?:\s?/\s?s(?:ec)?|\^?2|²)|per ?cent|%g?"
    r"|(?:digital |adc? )?(?:counts?|digits?)|(?:milli|micro)?volts?|mv"
    r"|(?:in(?:ch(?:es)?)?|f(?:ee|oo)?t)\s?/\s?s(?:ec)?\s?(?:/\s?s(?:ec)?|\^?2|²)",
    re.IGNORECASE,
)
"""Units of acceleration that are not read, where "N/S" is a direction."""
_ALONE = re.compile(r"^\W*(?:(?:units?|acc[a-z]*)\W+)*", re.IGNORECASE)  # (before a unit that is all of its line)
# A unit in the open, "Acceleration m/s^2", which no other word can be.
_OPEN = re.compile(
    rf"(?i)(?<![a-z\d.,/%(\[=])(?<![=\d]\s)(?P<unit>{_BEFORE}?(?:(?:[cm]?m|in|ft)\s?/\s?s(?:ec)?(?:\s?/\s?s(?:ec)?|(?:\^|\*\*)?[2²])?"
    r"|gals?|[cm]?m[ .·]?s(?:\^?-2|⁻²)))(?![\w/²^*)\]-]|\s[²^⁻])"
)
_IN_WORDS = re.compile(r"\b([cm]?m) per s(?:ec(?:ond)?)? (?:per s(?:ec(?:ond)?)?|squared)\b", re.IGNORECASE)
# Values of another thing than the samples: "Vs30 (m/s)", "elevation (m)", "offset (cm): 12".
_OF_ANOTHER = re.compile(
    r"\b(?:v_?s|wave|shear|elev|alt|depth|dist|radius|height|coord|easting|northing)[^,;]*$", re.IGNORECASE
)
_VALUE = re.compile(r"[)\]]?\s*[:=]?\s*[-+]?\.?\d")
_TO = re.compile(r"(?:\b(?:in)?to|[-=]>|→)\s+(?P<unit>[^\s,;]+)", re.IGNORECASE)  # "gal, converted to m/s2"
_PEAK = re.compile(r"\b(?:pga|pgv|peak|max\w*)\b[^,;:]*$", re.IGNORECASE)  # (before a unit that is its own)
_RANGE = re.compile(r"\b(?:full[- ]?scale|range|trigger\w*|threshold|resolution|sensitiv\w*)\b[^,;:]*$", re.IGNORECASE)
_NUMBERS = re.compile(r"\d+\.?\d*|\.\d+")
COUNTED = 10.0
"""Peak of whole numbers from which they may be counts."""
PEAK_TOLERANCE = 0.02
"""Maximum relative distance of the samples' peak from the peak in the header."""
# Words before or after a unit that samples had once.
_ONCE = re.compile(r"\b(?:original(?:ly)?|before|raw units?|converted from)\b[^,;]*$", re.IGNORECASE)
_THEN = re.compile(r"[\s.)\]]*[(\[]?\s*(?:original|before|prior)", re.IGNORECASE)
_FACTOR = re.compile(
    r"(?i)(?<!full.)\b(?:(?:(?:scal(?:e|ing)|amplification|calibration|conversion|gain)(?:[ _-]?factor)?|factor|"
    r"multipl(?:y|ier)|(?:to|must|should) be (?:multipli|scal)ed)\s*(?:by|of|is|[:=])?"
    r"|sf\s*[:=](?=\s*(?:1?\d(?![\d.])|\d?\d?\.\d)))\s*"
    r"(?P<number>\d+(?:\.\d*)?(?:e[+-]?\d+)?|\.\d+)(?![\d:./]|\s*(?:%|(?!(?:is |was )?not\b)[a-z]))"
)
_OF_TIME = (
    r"(?<!not )(?<!non-)\b(?:time|dt)[ -](?:(?:axis|step|base|is|was|has been) )*"
    r"(?:compress|scaled|shorten|condens|stretch|divided|multiplied)[^,;#]*"
    r"|\b(?:compressed in time|zeit\w* gestaucht|tiempo comprimido|time scal(?:e|ing)\b[^,;#\d]{0,20}\d)[^,;#]*"
)
_AMPLITUDE = re.compile(
    rf"(?i){_OF_TIME}|\bseismic coefficient[^,;]{{0,20}}"
    r"|\b(?:multiplied|amplified|divided) by (?!a factor)[^,;]{1,20}"
    r"|\b(?:peak[- ]?)?normali[sz]ed (?:to|by|acc|amp|rec|sig)[^,;]{0,20}"
    r"|\bpeak[- ]?normali[sz]ed|\bnorm(?:ali[sz]ed|\.)\W{1,3}acc\w*|\bacc\w*\W{1,3}norm(?:ali[sz]ed)?\b"
    r"|\ba(?:cc\w*)? ?/ ?(?:pga|a_?max)\b"
    r"|(?<!time )\b(?:model scale 1 ?[:/]|scale 1 ?[:/] ?\d\d? model)|\bsdof response|\bpseudo[- ]?acc"
    r"|(?<!not )(?<!no )\bclipped\b|\bshape function|(?:to|must|should) be scaled to|\bnormiert auf [^,;]{1,20}"
    r"|\bresponse not (?:removed|corrected)|\bnot corrected for (?:the )?(?:instrument|sensor)\w*"
    r"|\bin (?:m?V|(?:milli)?volts?)\b(?! ?/)|(?<![\d/])(?<!\d )\b(?:milli)?volts?\b(?! ?/| per)"
)
"""Statements that samples may be of another amplitude or time, or volts."""
RELATIVE = re.compile(
    r"\brel(?:ative|\.)?[ _]*(?:floor[ _]+)?acc|\b(?:acc|ace|beschl)\w*[ _,(-]{1,3}(?:\([^)]*\)\s*)?"
    r"rel(?:ativ[aeo]?)?(?![a-z])(?! to g)|\ba\d*_?rel\b|relativ[- ]?beschleunigung|相対加速度",
    re.IGNORECASE,
)
"""Names of an acceleration relative to the ground or a support."""
_OTHERS_NAMED = {
    "a response spectrum, no motion": re.compile(
        r"^\W*(?:(?:pseudo\W?)?spectral acc\w*\s*(?:$|[(\[,]|in\b|units?\b)|"
        r"(?:acc\w* )?response spectr(?:um|a)(?!\W*(?:co|ma)))",
        re.IGNORECASE,
    ),
    "relative to its support: blocks need the total acceleration": RELATIVE,
}
_APPLIED = re.compile(r"(?:(?:scal|amplifi|multipli)ed\b[^,;]*|orig peer filename.*)$", re.IGNORECASE)
# ("a_g (m/s2)" is of the ground)
_SUFFIX = re.compile(
    r"[a-z]_(?!(?<!acc_)g\s*[\[(])(?P<unit>[cm]?m_?(?:p|per_)?s-?2|gals?|[a-z]{0,9}g|m(?:illi|icro)_g"
    r"|ms|(?<=acc_)counts?|(?<=accel_)counts?|(?<=acceleration_)counts?)(?![a-z0-9])",
    re.IGNORECASE,
)
_NO_UNITS = {"the", "this", "these", "that", "each", "all", "a", "an", "time", "raw", "measure", "measurement"}


class Unit(NamedTuple):
    """A unit as it is written in a line: its quantity ('' if it is unknown), and m/s² per unit (NaN if it is none).

    `once`: the samples had it before something was done to them.
    """

    text: str
    quantity: str
    factor: float
    line: int
    once: bool = False


def quantities(text: str) -> list[str]:
    """Return the quantities that a text names: acceleration, velocity, displacement."""
    text = folded(text, "NFD")
    return [quantity for quantity, word in _QUANTITY.items() if word.search(text)]


def unit_of(word: str, line: int = 0) -> Unit:
    """Return a unit in a common spelling (g, gal, cm/s², m/s^2, cm/sec/sec, m s-2, cm/s, kine, mm)."""
    text = word.strip().strip(".,;:[]").lower().replace("²", "2").replace("⁻", "-").replace("см/с", "cm/s")
    text = text.replace("м/с", "m/s")
    text = text.strip("()") if text.startswith("(") or text.count("(") != text.count(")") else text
    text = re.sub(
        r"\^|\*\*|[\s_·]|\.(?=[a-z])", "", re.sub(r"(?:se[cg](?:ond[oi]?s?)?|sn)\b|(?:se[cg]|sn)(?=[\d^*²])", "s", text)
    )
    text = re.sub(r"^([cm]?m)(?:/|p|per)?\(?(?:s-?2|s\*s)\)?$|^([cm]?m)/s/s$", r"\1\2/s2", text)
    text = {"gals": "gal", "gs": "g", "g's": "g"}.get(text, text)
    if len(word) <= 40 and text in _ACCELERATION:
        return Unit(word, "acceleration", _ACCELERATION[text], line)
    bare = _MULTIPLE.sub("", word)
    if bare != word and unit_of(bare).quantity == "acceleration":
        return Unit(word, "acceleration", math.nan, line)
    return Unit(word, next((name for name, units in _OTHERS.items() if text in units), ""), math.nan, line)


def is_unit(word: str) -> bool:
    """Return True if a word is a unit, of accelerations also one that is not read (mg, counts)."""
    return bool(unit_of(word).quantity or _NOT_OURS.fullmatch(word.strip(" .()[]")))


def unit_factor(word: str) -> float | None:
    """Return m/s² per unit of acceleration, or None if a word is none."""
    factor = unit_of(word).factor
    return None if math.isnan(factor) else factor


def given_factor(unit: str | float) -> float:
    """Return m/s² per unit or count that a caller gives; ValueError if it is no unit of acceleration."""
    if isinstance(unit, str):
        factor = unit_factor(unit)
        if factor is None:
            known = ", ".join(map(repr, _ACCELERATION))
            raise ValueError(f"unit must be one of {known}, or m/s² per count, got {unit!r:.60}")
        return factor
    factor = checks.number("unit", unit, unit="m/s² per count")
    if factor == 0.0:
        raise ValueError("unit must not be 0 m/s² per count")
    return factor


def unit_taken(factor: float, source: int | str) -> str:
    """Return the name of a unit of m/s², with its source: a line, or words."""
    where = f"line {source}" if isinstance(source, int) else source
    return f"{_NAMES.get(factor, f'{factor:g} m/s²')} ({where})"


def in_name(name: str, line: int) -> list[Unit]:
    """Return the units in the name of a column, acceleration (g), acc_g or acceleration in g; also unknown units."""
    words = [match["unit"] for pattern in (_BRACKETS, _SUFFIX, _IN, _OPEN) for match in pattern.finditer(name)]
    last = _LAST.search(name)
    words += [last["unit"]] if last is not None and not words and is_unit(last["unit"]) else []
    times = [name] if _TIMES.search(name) else []  # ("acc_g_x100", "1000*acc (g)")
    letters = (word for word in words + times if re.search(r"[a-zмс]", word, re.IGNORECASE))
    return [*(unit_of(word, line) for word in letters), *_linked_units(name, line)]


def units_in(text: str, line: int, brackets: bool = True, peak: float = math.nan) -> list[Unit]:
    """Return the units of the samples in a line of words; brackets count if they contain a known unit.

    The unit of a peak does not apply to the samples, unless it is their `peak`; a number in brackets, (0.3 g), is a
    value.
    """
    text = _IN_WORDS.sub(r"\1/s2", folded(text, "NFD"))
    named = quantities(text)
    units = _linked_units(text, line)
    theirs = any(math.isclose(float(number), peak, rel_tol=PEAK_TOLERANCE) for number in _NUMBERS.findall(text))
    for pattern in (_BRACKETS, _IN, _OPEN) if brackets else (_IN, _OPEN):
        for match in pattern.finditer(text):
            unit, before = _of_match(match, line), text[: match.start()]
            if pattern is _OPEN:
                theirs_too = brackets or (unit.quantity == "acceleration" and not unit.once)
                # (a sure unit at the end of a line, "# y: cm/s2", whatever the words before)
                at_end = brackets and unit.factor > 0.0 and not unit.once and not text[match.end() :].strip(" .)#")
                counts = bool(named or at_end or match[0] == text.strip("# \t")) and theirs_too
            else:
                admitted = ("velocity", "displacement") if pattern is _BRACKETS else named
                counts = unit.quantity in ("acceleration", *admitted)
                counts |= "acceleration" in named and not unit.quantity and is_unit(unit.text) and not _TO.search(text)
            if math.isnan(unit.factor):
                number = re.match(r"\s*\d", unit.text) and (pattern is _BRACKETS or not (brackets and named))
                value = unit.quantity != "acceleration" and _VALUE.match(text, match.end())
                counts = counts and not (number or value or _OF_ANOTHER.search(before))
            if counts and (theirs or not _PEAK.search(before)) and not _RANGE.search(before):
                units.append(unit)
    last = _LAST.search(text) if named and not units else None
    if last is not None and (
        unit_of(last["unit"]).quantity in named or is_unit(last["unit"]) or "/s" in last["unit"].lower()
    ):
        units.append(_of_match(last, line))
    alone = _ALONE.sub("", text).strip(" #()[].:-\t")
    units += [unit_of(alone, line)] if not units and _NOT_OURS.fullmatch(alone) else []
    later = [_of_match(match, line) for match in _TO.finditer(text)] if units else []
    return [*units, *(unit for unit in later if unit.quantity == "acceleration")]


def _of_match(match: re.Match[str], line: int) -> Unit:
    """Return the unit of a match in its line, which may mark it as the unit of an earlier state."""
    once = _ONCE.search(match.string[: match.start("unit")]) or _THEN.match(match.string, match.end("unit"))
    return unit_of(match["unit"], line)._replace(once=once is not None)


def _linked_units(text: str, line: int) -> list[Unit]:
    units = []
    for match in _TOLD.finditer(text):
        link, word = match["link"].strip().lower(), match["unit"]
        readings = unit_of(word, line), unit_of(word.partition("(")[0], line)
        unit = next((unit for unit in readings if unit.quantity), None)
        if unit is not None:
            unit = unit._replace(once=_of_match(match, line).once)
            units += [unit] if unit.quantity != "time" else []
        elif link and (link != "of" or quantities(text)) and re.match(r"[(\[]?[^\W\d_一-龥]", word):
            units += [unit_of(word, line)] if word.lower().strip("():") not in _NO_UNITS else []
    return units


def agreed(file: Path, units: Iterable[Unit]) -> Unit | None:
    """Return the one unit of acceleration that all lines state, None if none does; two different units are an error."""
    first: Unit | None = None
    for unit in sorted(units, key=lambda unit: unit.once):
        if not unit.quantity or (unit.quantity == "acceleration" and math.isnan(unit.factor)):
            raise RecordError(
                f"{file}: line {unit.line} has the unknown unit {unit.text.strip()[:40]!r}, "
                "known are g, gal, cm/s², mm/s² and m/s²"
            )
        if unit.quantity != "acceleration":
            raise RecordError(
                f"{file}: line {unit.line} gives a {unit.quantity} ({unit.text.strip()[:40]}), not acceleration"
            )
        if first is None and unit.once:
            raise RecordError(
                f"{file}: line {unit.line} gives a unit of before ({unit.text.strip()[:40]!r}): write the unit of its "
                "samples into the heading, as 'acceleration (g)'"
            )
        first = first or unit
        if unit.factor != first.factor:
            raise RecordError(
                f"{file}: line {first.line} says {first.text.strip()[:40]!r}, line {unit.line} "
                f"{unit.text.strip()[:40]!r}: which of them is the unit of its accelerations?"
            )
    return first


def doubt_factors(file: Path, header: Iterable[tuple[int, str]]) -> None:
    """Warn of a factor other than 1 in a numbered line of a header, which nothing applies."""
    for line, text in header:
        factors = [] if re.search(_OF_TIME, text, re.IGNORECASE) else [*_FACTOR.finditer(text)]
        for match in factors:
            if float(match["number"]) != 1.0 and not _APPLIED.search(text[: match.start()]):
                warn([Doubt.of("factor", file=file, line=line, text=match[0].strip())])
        amplitude = None if re.search("convert|applied|original", text, re.IGNORECASE) else _AMPLITUDE.search(text)
        if amplitude is not None and not factors:
            warn([Doubt.of("amplitude", file=file, line=line, text=plain(amplitude[0].strip(), 40))])


def refuse_others(file: Path, header: Iterable[tuple[int, str]]) -> None:
    """Raise RecordError if a numbered line of a header names accelerations that are no motions of the floor."""
    for line, text in header:
        for what, pattern in _OTHERS_NAMED.items():
            if pattern.search(text):
                raise RecordError(f"{file}: line {line} says {plain(text, 60)!r}: {what}")
