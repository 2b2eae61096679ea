"""Time steps and sampling rates in a header: those to read, and those in words that others must agree with."""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Sequence
from typing import NamedTuple

from .lines import LONGEST_STEP, STEP, Lines, RecordError, known, plain

_OF_SAMPLING = r"(?:muestreo|campionamento|amostragem|[ée]chantillonnage)"
"""Sampling in Spanish, Italian, Portuguese and French."""
_PER_SECOND = (
    r"(?:samples?|values?|points?|frames?|muestras|datos|campioni|[ée]chantillons|amostras|\w*werte) ?"
    r"(?:/|per |por |al |pro |par |a )\s?s\w*"
)
_LABELS = {
    "read_step": r"dt|(?:delta|δ) ?t|time ?step|sampl\w{0,5} ?(?:interval|period|step|time)|"
    rf"(?:interval\w{{1,2}}|p[ée]r[ií]od[oe]|pass?o?) d(?:[ei] |['’]){_OF_SAMPLING}|paso de tiempo|pas de temps|"
    r"passo (?:temporale|de tempo)|zeitschritt|abtast(?:intervall|schritt|zeit|periode)|zaman ad[ıi]m[ıi]|"
    r"[öo]rnekleme (?:aral\w+|periyodu)|шаг (?:по времени|дискретизации)|интервал дискретизации|"
    "β[ήη]μα (?:χρ[όο]νου|δειγματοληψ[ίι]ας)|krok (?:czasowy|próbkowania)|časový krok|tijdstap|"
    "サンプリング間隔|サンプリング周期|時間刻み|時間間隔|[采採取][样樣]间?間?隔|时间间隔",
    "read_rate": rf"samp(?:l\w{{0,5}})? ?(?:rate|freq\w{{0,6}})|{_PER_SECOND}|^sr|"
    rf"(?:tasa|taxa|raz[óo]n|velocidad|fr[eé][cq]u?\w{{3,6}}|taux|tasso) d(?:[ei] |['’]){_OF_SAMPLING}|"
    r"abtast(?:rate|frequenz)|[öo]rnekleme (?:frekans\w*|h[ıi]z[ıi]|oran[ıi])|частота дискретизации|"
    r"(?:συχν[όο]τητα|ρυθμ[όο]ς) δειγματοληψ[ίι]ας|częstotliwość próbkowania|vzorkovací frekvence|bemonster\w+|"
    "サンプリング(?:周波数|レート)|[采採取][样樣](?:频率|頻率|率)",
    "step": r"(?:time|equal|uniform|regular) (?:time )?(?:increment|interval|step|spacing)s?|"
    "(?:equally|evenly|uniformly) spaced|time ?delta|delta ?x|x ?inc",
    "rate": rf"f ?s|sps|odr|abtastung|(?:frame|data|acqui\w+) ?(?:rate|freq\w*)|^(?:sampling|{_OF_SAMPLING})",
    "nyquist_rate": r"nyquist(?: freq\w*)?",
    "lone_step": "^(?:delta|δ|h|ts|dx|intervall?o?|increment|step|spacing)",
    "lone_rate": r"^(?:f|fr[ée][qc]\w*|частота|周波数|[频頻]率|rate|tasa|taux|tasso)",
    "in_its_unit": r"rate|every|intervall?o?s?|(?:re)?sampl(?:ed|ing)|"
    r"digiti[sz](?:ed|ation)|abgetastet|muestreado",
}
"""Words at the end of the label of a number, by the kind of the number: the first kind counts that begins first.

A step or rate to read is after ``=`` or ``:``. Words of the other kinds have other meanings, too: a step given
elsewhere must agree with them. A lone one needs to be as short as the steps of records are.
"""
_KIND = re.compile("|".join(rf"(?P<{kind}>(?<![a-zà-ÿа-я0-9])(?:{words})$)" for kind, words in _LABELS.items()))
LONGEST_LONE = 1.0 / 40.0
"""Time step, s, above which a lone statement may be of another quantity, such as the frequency of a shaking."""
_UNITS = {
    "s": (r"s|sec\w*|seg\w*", 1.0),
    "ms": (r"ms|msec\w*|milli\w+", 1e-3),
    "us": (r"[uµμ]s(?:ec\w*)?|micro\w+", 1e-6),
    "hz": ("hz|1/s", 1.0),
    "khz": ("khz", 1e3),
    "per_second": (rf"[sf]ps|{_PER_SECOND}", 1.0),
}
"""Spellings of the units of steps and rates, and seconds or Hz of them."""
_UNIT = "|".join(f"(?P<{unit}>{words})" for unit, (words, _) in _UNITS.items())
_DIGITIZER = re.compile(
    r"(?i)\b(?:digiti[sz]er|logger|recorder|daq|adc)\b(?!.*(?:filter|alias|pass|corner|band|cut)).{0,60}$"
)
_UNIT_OF_LABEL = re.compile(rf"(?<!per)(?<!p[oa]r)(?<!pro)(?<! al)[(\[\s]\s*(?:{_UNIT.rpartition('|(?P<')[0]})\.?$")
_AFTER = re.compile(
    rf"(?i)(?P<rest>,\d+|/\d+)?[\s-]?(?:{_UNIT})?(?!\w|\s?(?:h|min|hours?|days?|[ckm]?m|%)(?!\w)"
    r"|\s?(?:[-x:/]|to|bis)\s?\d)(?P<sampling>[\s-](?:time )?(?:sampl\w*|intervals?|steps?|spacing)\b)?"
    r"(?P<last>(?=[\s.)\]]*(?:$|[,;])))?"
)
_LINK = re.compile(r"(?:[\s=:()\[\]\"'#*]|\b(?:was|is|at|of|with|in|mit|von|a|de|to|auf)\b)*$")
_NUMBER = re.compile(rf"(?<![\w.,/]){STEP.replace('(?P<rest>.{0,20})', '(?=(?P<rest>.{0,20}))')}")
_COUNTED = re.compile(r"\W*(\d{2,8})[\s,]+(0?\.\d+)\b")
_STANDARD = re.compile(r", C1-C6(?P<unit> \(s\))?\s*:\s*/(?P<step>[\d.]+)(?:/(?P=step))*\s*$")  # (of Mexico)
_CHANGED = re.compile(
    r"original|ursprünglich|resampl|remuestr|ricampion|r[ée]-?[ée]chantillon|before|prototype", re.IGNORECASE
)  # next to a step
_THINNED = re.compile(
    r"(?<!before )decimat|diezmad|dezimier|down-?sampl|\bevery (?:\d+(?![\d.]|\s?m?s)|second|other)|time scale",
    re.IGNORECASE,
)
_HERTZ = re.compile(
    r"\s*(?:k?hz|sps|1/s|(?:[^\W\d]|\.)+\s?(?:/|per |por |al |pro |par |a )\s?s\w*)?[\s)\].]*(?:[,;]|$)", re.IGNORECASE
)


class _Statement(NamedTuple):
    """A time step, s, that a line states, and True if it is to be read."""

    line: int
    text: str
    step: float
    read: bool = False

    def agrees(self, step: float) -> bool:
        return math.isclose(self.step, step, rel_tol=0.01)


def written_step(lines: Lines, header: Sequence[tuple[int, str]], n: int) -> tuple[float | None, str, int]:
    """Return the time step in the header of n samples, s, or None; the reason to refuse it, or ''; and its line."""
    stated, changes, changed = _statements(lines, header, n)
    stated = [statement for statement in stated if statement.read or not changes]
    first = next((statement for statement in stated if statement.read), None)
    if first is None:
        return None, "", 0
    agreeing = {statement.line for statement in stated if statement.agrees(first.step)}
    others = (other for other in stated if not other.agrees(first.step) and (other.read or other.line not in agreeing))
    second = next(others, None)
    doubtful = changed or (f"lines {first.line} and {second.line} state two steps" if second else "")
    return first.step, doubtful, first.line


def refuse_other_step(
    lines: Lines, header: Sequence[tuple[int, str]], n: int, step: float, what: str, *, given: bool = False
) -> None:
    """Raise RecordError if the header of n samples states steps, s, but not this one nor a change to another.

    A file's own step may be longer than its instrument's step; a `given` one may not.
    """
    stated, changes, changed = _statements(lines, header, n)
    stated = [statement for statement in stated if given or not _DIGITIZER.search(statement.text)]
    sure = [statement for statement in stated if statement.read or not changes] if not changed else []
    steps = sure or stated
    alike = not sure and all(statement.agrees(stated[0].step) for statement in stated)  # (before a change to another)
    if steps and not alike and not any(statement.agrees(step) for statement in steps):
        first = max(steps, key=lambda statement: statement.read)
        where = f"line {first.line}: {plain(first.text, 60)!r}"
        raise RecordError(f"{lines.file}: its header says dt = {first.step:g} s, {what} ({where})")


def _statements(
    lines: Lines, header: Sequence[tuple[int, str]], n: int
) -> tuple[list[_Statement], list[tuple[int, str]], str]:
    """Return the steps in the header of n samples, changes that lines mention, and the first one of a step to read."""
    stated: list[_Statement] = []
    for line, text in header:
        words = unicodedata.normalize("NFKC", _STANDARD.sub(r"\g<unit>: \g<step>", text))
        counted = _COUNTED.match(words)
        if counted and counted[1] == str(n):
            stated.append(_Statement(line, text, float(counted[2])))
        end = 0
        for match in _NUMBER.finditer(words):
            kind, unit, equals = _label(words[end : match.start()])
            end = match.end()
            if kind.startswith("read") and equals:
                try:
                    step = _step_to_read(lines, kind, match, unit)
                except RecordError:
                    if not any(statement.read for statement in stated):
                        raise
                    continue
            else:
                step = _step_in_words(kind, words, match, unit)
            if 0.0 < step < LONGEST_STEP:
                stated.append(_Statement(line, text, step, kind.startswith("read") and equals))
    read = {statement.line for statement in stated if statement.read}
    changes = [(line, text) for line, text in header if _THINNED.search(text) or _CHANGED.search(text)]
    of_read = (
        f"line {line} says {text.lstrip('# ')[:60]!r}"
        for line, text in changes
        if line in read or _THINNED.search(text)
    )
    return stated, changes, next(of_read, "")


def _label(text: str) -> tuple[str, str, bool]:
    """Return the kind of a number by the text before it ('': none), a unit in that text, and True after = or :."""
    words = re.sub(r"(?<=[a-z])(?=[A-Z][a-z]{2})|[_-]+", " ", re.split("[,;|]", text)[-1]).lower().replace("∆", "δ")
    bare = _LINK.sub("", words, count=1)
    stated = _UNIT_OF_LABEL.search(bare)
    unit = stated.lastgroup or "" if stated else ""
    if stated:
        bare = _LINK.sub("", bare[: stated.start()], count=1)
    kind = _KIND.search(re.sub(r"^[\W_]+", "", bare))
    return kind.lastgroup or "" if kind else "", unit, re.search("[=:]", words[len(bare) :]) is not None


def _step_to_read(lines: Lines, kind: str, match: re.Match[str], unit: str) -> float:
    """Return the time step of one number, s; RecordError if it is not a step or a rate alone."""
    if unit in ("s", "ms", "us") or (kind == "read_step" and not unit):
        return lines.step(match["number"], match["rest"], unit)
    rate = known(match["number"]) * (1e3 if "k" in unit + match["rest"].lower()[:3] else 1.0)
    if not rate > 1.0 / LONGEST_STEP or _HERTZ.match(match["rest"]) is None:
        written = f"{match['number']}{match['rest']}".strip()
        raise RecordError(f"{lines.file}: gives its sampling rate as {written[:30]!r}, must be in Hz")
    return 1.0 / rate


def _step_in_words(kind: str, words: str, match: re.Match[str], unit: str) -> float:
    """Return the time step of one number in a line of words, s, NaN if it is of another quantity."""
    after = _AFTER.match(words, match.end())
    if after is None:
        return math.nan
    number, rest = match["number"].lower().replace("d", "e"), after["rest"] or ""
    if (rest.startswith("/") and number != "1") or (rest.startswith(",") and "." in number):
        return math.nan
    value = float(number + rest.replace(",", ".")) if not rest.startswith("/") else 1.0 / (float(rest[1:]) or math.inf)
    unit_after = next((name for name in _UNITS if after[name]), "")
    alone = after["last"] is not None and re.search(r"\w", words[: match.start()]) is None
    if unit_after and (after["sampling"] or unit_after == "per_second"):
        kind = "in_its_unit"
    elif alone or (not kind and _DIGITIZER.search(words[: match.start()])):
        kind = "lone_in_its_unit"
    unit = unit_after or unit
    if not kind or (kind.endswith("unit") and not unit):
        return math.nan
    in_time = unit in ("s", "ms", "us") if unit else kind.endswith("step") or (value <= 1.0 and kind.endswith("rate"))
    value *= _UNITS[unit][1] if unit else 1.0
    step = value if in_time else 1.0 / (value * (2.0 if kind.startswith("nyquist") else 1.0) or math.inf)
    return math.nan if kind.startswith("lone") and step > LONGEST_LONE else step
