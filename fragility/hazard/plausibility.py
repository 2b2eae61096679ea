"""Plausibility of hazard curves: rates and levels that no site has, and the slip of units that explains them."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from ...core.aliases import Array
from ...core.doubts import Doubt, by_study, warn
from ...core.elementary import log
from ...core.units import ACCELERATION, METRE, STANDARD_GRAVITY, VELOCITY
from ...core.wording import in_years
from ...motions.intensity.naming import in_si, written_level
from .curve import HazardCurve, hazard_measure
from .pieces import NONE
from .poisson import IMPOSSIBLY_OFTEN
from .reading import INVENTED, LARGER, LOW_PERCENT, NOT_USED, OFF_CURVE, RARE, UNNAMED

MOST_OFTEN = 0.2
"""Maximum annual rate of the weakest damaging motion at any site."""
RAREST = 2e-4
"""Annual rate of the weakest damaging motion below which seismicity is very low (EN 1998-1, 3.2.1; recalled)."""
MOST_OFTEN_OF_LAW = 1.0
"""The same of formulas, which are fitted to rarer levels."""
AMPLIFIED = 2.5
"""Maximum ratio of spectral accelerations to PGA: such levels are that much more frequent, and so are levels of floors.
"""
STEEPNESS = 0.8
"""Power of the level, at least, with which rates fall between damaging and the highest levels (assumed)."""
LEAST_CERTAIN, FLAT = 0.9, 0.8
"""Probability of weak motions in 50 years, and the share of it at twice the level; rates fall more there."""
SEVERAL = 10.0
"""Years from which a probability differs from an annual rate."""
RARE_AT_START, HALF = 0.05, 0.5
"""Minimum probability in several years of the weakest damaging level, which falls with the level; share for any level.

At half that level it is 10 %, as in regions of low seismicity; no minimum exceeds a half (assumed).
"""
RETURN_PERIODS, CENTURY = (475.0, 2475.0), 100.0
NOTHING = 1e-3
"""Share of the weakest level that damages, at most, at which no curve begins."""
STEEP, GENTLER, LEVEL_SLOPE, STEP, LEAST_RATE = 5.0, 0.3, 0.05, 0.1, 1e-8
"""Slope of a curve with its ratio to the next one, and the next after 1, of no site; from steps of ln level and rates.

All are assumed.
"""
STIFF = 0.5
"""Period, s, up to which spectral accelerations are at least about the PGA."""
HALVINGS = 50
LONG_PERIODS = 1.65
"""Ratio of pseudo-velocities to PGV at periods above about 0.5 s (Newmark and Hall 1982, 5 % damping, median)."""
OF_DISAGGREGATION, OF_BRANCHES = 1.5, 100.0
"""Factors between two rates of one level above which they are not of one site."""
FLAWS = {
    UNNAMED: "hazard_unnamed",
    LARGER: "hazard_larger",
    NOT_USED: "hazard_comment",
    INVENTED: "hazard_invented",
    OFF_CURVE: "hazard_off",
}
"""Input warnings on parts of the source of a curve."""

_YEARS = r"(?:years?|yrs?|a|Jahren?|ans|años|anni|anos|yıl)(?!\w)"
_NUMBER = r"(?<![\w.,])(\d{1,6}(?:\.\d{1,6})?)"
_LEVEL = re.compile(_NUMBER + r"\s?(g|gal|c?m/s(?:\^?2|²)?)(?![\w/^²])")
_MEASURE = re.compile(r"(?i)\bpg[avd]\b|\bsa\s?\([\d.]{1,9}\)")
_CHANCE = re.compile(r"(\d{1,2}(?:\.\d{1,3})?)\s?%[\w\s]{0,40}?\bin\s(\d{1,4})[\s-]?" + _YEARS)
_PERIOD = re.compile(
    r"(?<![\w.,-])(\d{1,3}(?:,\d{3})+|[1-9]\d{1,5})[\s-]?" + _YEARS + r"|return period\D{1,6}([1-9]\d{1,5})(?!\s?[\w,])"
    r"|\bT_?R\s?=?\s?([1-9]\d{1,4})(?![\d.])|\((95|225|475|975|2475|4975)\)"
)
_RATE = re.compile(
    r"(?<![\w.,])(\d{1,3}(?:\.\d{1,9})?(?:e-\d{1,2})?)\s?(?:(?:per|a)\syear|/\s?(?:year|yr|a)(?!\w))"
    r"|^\s*k0\s*=\s*(\d{1,3}(?:\.\d{1,9})?(?:e-\d{1,2})?)\s*#.*\brate\b"
)
"""Levels, measures, probabilities in years, return periods and rates of comments."""


class _Bounds(NamedTuple):
    """Levels in SI: the weakest that damages, the highest of any ground in `RETURN_PERIODS`, and a limit.

    The highest are assumed. Hazard models have a PGA of about 1.2 g in 475 years and 2 g in 2475 years near the fastest
    faults, on soil (recalled).
    """

    damaging: float
    highest: tuple[float, float]
    beyond: float
    weakest: float  # a curve that ends below it has no information on damage
    in_a_century: float  # the highest in `CENTURY` years (assumed)


_BOUNDS = {
    ACCELERATION: _Bounds(
        0.1 * STANDARD_GRAVITY,
        (1.3 * STANDARD_GRAVITY, 2.2 * STANDARD_GRAVITY),
        50.0 * STANDARD_GRAVITY,
        0.01 * STANDARD_GRAVITY,
        0.7 * STANDARD_GRAVITY,
    ),
    VELOCITY: _Bounds(0.1, (1.6, 2.8), 100.0, 0.01, 0.9),
    METRE: _Bounds(0.05, (2.0, 4.0), 100.0, 0.001, 1.0),
}


def hazard_doubts(hazard: HazardCurve) -> list[Doubt]:
    """Return the input warnings on a hazard curve: damaging motions every year, high levels, missing statements."""
    name = hazard.source.partition(",")[0] or "hazard"
    notes: list[Doubt] = []

    def note(what: str, level: float = math.nan, grave: bool = False, **values: object) -> None:
        text = written_level(hazard.measure, level)
        notes.append(Doubt.of(what, grave, name=name, level=text, **values))

    for flaw, what in FLAWS.items():
        if flaw in hazard.source:
            text = hazard.source.partition(f"{flaw} ")[2].partition(")")[0]
            note(what, flaw=flaw, text=text, measure=hazard.im)
    if hazard.fractile is not None:
        note("hazard_fractile", per_cent=100.0 * hazard.fractile)
    if realisation := re.search(r"OpenQuake (rlz-\d+)", hazard.source):
        note("hazard_branch", branch=realisation[1])
    bounds = _BOUNDS.get(hazard.units)
    base = getattr(hazard.measure, "base", hazard.measure).label  # (of one component)
    if bounds is None or base in ("arias", "cav", "housner_intensity"):
        return notes
    low = LOW_PERCENT in hazard.source
    if low:
        note("hazard_low_percent", flaw=LOW_PERCENT)
    if RARE in hazard.source:
        note("hazard_rare", flaw=RARE)
    damaging = bounds.damaging if hazard.of_formula else max(bounds.damaging, hazard.levels[0])
    often = float(hazard.rate_at(damaging, above=NONE))
    peak = base in ("pga", "pgv") and hazard.at == "ground" and not hazard.of_formula
    amplified = 1.0 if peak else AMPLIFIED
    # levels twice as high are at least twice as rare; levels above all damaging levels are checked below
    most = MOST_OFTEN * amplified * max(bounds.damaging / damaging, 0.2)
    most = MOST_OFTEN_OF_LAW if hazard.of_formula else most
    frequent = often > most * (1.0 + 1e-9)
    if frequent:  # a formula may reach the maximum except for its last digit
        what = "hazard_frequent_law" if hazard.of_formula else "hazard_frequent"
        note(what, damaging, often > IMPOSSIBLY_OFTEN, often=often)
    first, twice = (float(hazard.rate_at(factor * hazard.levels[0], above=NONE)) for factor in (1.0, 2.0))
    if LEAST_CERTAIN < first <= 1.0 and twice > FLAT * first and not hazard.of_formula:
        note("hazard_certain", first=first)
    period = getattr(getattr(hazard.measure, "base", hazard.measure), "period", 0.0)
    highest = [amplified * level for level in (*bounds.highest, bounds.in_a_century)]
    if hazard.units == ACCELERATION and period > 0.0 and hazard.at == "ground":
        velocity = _BOUNDS[VELOCITY]
        limits = (*velocity.highest, velocity.in_a_century)
        fast = [LONG_PERIODS * 2.0 * math.pi / period * level for level in limits]
        highest = [*map(min, highest, fast)]
    beyond = [
        (level, years)
        for level, years in zip(highest, (*RETURN_PERIODS, CENTURY), strict=True)
        if hazard.rate_at(level, above=NONE) > 1.0 / years
    ]
    if beyond and not frequent:
        level, years = beyond[0]
        grave = bool(hazard.rate_at(bounds.beyond, above=NONE) > 1.0 / RETURN_PERIODS[0])
        note("hazard_high", level, grave, years=years)
    elif often < (highest[1] / damaging) ** STEEPNESS * float(hazard.rate_at(highest[1], above=NONE)):
        note("hazard_flat", highest[1])
    stiff = base in ("pga", "pgv") or 0.0 < period <= STIFF
    if hazard.levels[-1] < bounds.weakest:
        note("hazard_weak", hazard.levels[-1])
    elif hazard.levels[0] < NOTHING * bounds.weakest and not hazard.of_formula:
        note("hazard_exchanged", hazard.levels[0])
    elif stiff and hazard.at == "ground" and hazard.levels[0] <= bounds.damaging and not low:
        rate = float(hazard.rate_at(bounds.damaging))
        if rate < RAREST:
            note("hazard_quiet", bounds.damaging, years=in_years(rate))
    kink = _kink(hazard)
    if kink and not hazard.of_formula:
        note("hazard_kink", kink)
    return notes


def _kink(hazard: HazardCurve) -> float:
    """Return the level after which the slope of a curve falls as no site's does, 0 if there is none."""
    levels, rates = log(np.array(hazard.levels)), log(np.array(hazard.rates))
    known = np.concatenate([[True], np.diff(levels) > STEP]) & (rates > math.log(LEAST_RATE))
    slopes = -np.diff(rates[known]) / np.diff(levels[known])
    before, after = slopes[:-1], slopes[1:]
    kinks = np.flatnonzero(((before > STEEP) & (after < GENTLER * before)) | ((before > 1.0) & (after < LEVEL_SLOPE)))
    return math.exp(levels[known][kinks[0] + 1]) if kinks.size else 0.0


def level_at(hazard: HazardCurve, rate: float) -> float:
    """Return the level (SI) that is exceeded at an annual rate, by bisection; NaN beyond the curve's points."""
    if not hazard.rates[-1] <= rate <= hazard.rates[0]:
        return math.nan
    mean = hazard.pieces()[0]
    low, high = math.log(hazard.levels[0]), math.log(hazard.levels[-1])
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if float(mean.rate(np.array([middle]))[0]) > rate else (low, middle)
    return math.exp(0.5 * (low + high))


def starts_rare(im: str, level: float, probability: float) -> bool:
    """Return True if a probability in years of the first level (SI) is so small that it is likely an annual rate."""
    bounds = _BOUNDS.get(hazard_measure(im).units)
    if bounds is None or not 0.0 < level <= HALF * bounds.damaging:
        return False
    return 0.0 < probability < min(HALF, RARE_AT_START * bounds.damaging / level)


def point_off(hazard: HazardCurve, comments: Iterable[str]) -> str:
    """Return the first point of comments that is not on a hazard curve, and the curve's rate there; '' if all are on.

    A point is one level with its unit, and one time, probability or rate. A line of a file may be a comment with its
    code (``k0 = 1e-4 # annual rate at 1 g``).

    >>> point_off(HazardCurve([1.0, 10.0], [1e-2, 1e-4], "pga"), ["# 475 years: 0.3 g"])
    '0.3 g once in 475 years, and the curve has it once in 866 years'
    """
    for comment in comments:
        levels, rates = [*_LEVEL.finditer(comment)], _rates(comment)
        named = [match[0].replace(" ", "").lower() for match in _MEASURE.finditer(comment)]
        if len(levels) != 1 or len(rates) != 1 or any(name != hazard.measure.label.lower() for name in named):
            continue
        try:
            level = float(levels[0][1]) * in_si(levels[0][2].replace("²", "2").replace("^", ""), hazard.measure)
        except ValueError:  # (of another measure)
            continue
        known = float(hazard.rate_at(level)) if level > 0.0 else 0.0
        if known > 0.0 < rates[0] and max(known / rates[0], rates[0] / known) > OF_DISAGGREGATION:
            stated = f"{written_level(hazard.measure, level)} once in {in_years(rates[0])} years"
            return f"{stated}, and the curve has it once in {in_years(known)} years"
    return ""


def names_point(comment: str) -> bool:
    """Return True if a comment names one level with its return period, or with its probability in years.

    >>> names_point("return period 475 yr: 0.21 g"), names_point("return periods in years, levels up to 2 g")
    (True, False)
    """
    timed = _CHANCE.search(comment) or re.search(r"(?i)return period|\bT_?R\s?\d", comment)
    return bool(timed) and len(_LEVEL.findall(comment)) == len(_rates(comment)) == 1


def _rates(comment: str) -> list[float]:
    """Return the annual rates that a comment names: as probabilities in years, return periods or rates."""
    rates = [-math.log1p(-0.01 * float(match[1])) / float(match[2]) for match in _CHANCE.finditer(comment)]
    rest = _CHANCE.sub("", comment)
    rates += [1.0 / float(next(filter(None, match.groups())).replace(",", "")) for match in _PERIOD.finditer(rest)]
    return rates + [float(next(filter(None, match.groups()))) for match in _RATE.finditer(rest)]


def warn_of_hazards(hazards: Iterable[HazardCurve]) -> None:
    """Warn of implausible hazard curves that a script uses; studies name them themselves."""
    if not by_study():
        warn(dict.fromkeys(doubt for hazard in hazards for doubt in hazard_doubts(hazard)))


def disaggregation_doubts(hazard: HazardCurve, level: float, rate: float, name: str) -> list[Doubt]:
    """Return a warning if the rate (1/year) of a disaggregation's level (SI) differs from the study's hazard."""
    curve_rate = _known(hazard, level)
    if hazard.at != "ground" or not max(curve_rate / rate, rate / curve_rate) > OF_DISAGGREGATION:
        return []
    text = written_level(hazard.measure, level)
    return [Doubt.of("hazard_of_disaggregation", name=name, level=text, rate=rate, known=curve_rate)]


def branch_doubts(hazards: Mapping[str, HazardCurve], levels: Array) -> list[Doubt]:
    """Return a warning if alternative hazard curves by name have rates orders apart at one of the levels (SI)."""
    for level in levels:
        known = {name: rate for name, hazard in hazards.items() if (rate := _known(hazard, level)) > 0.0}
        rare, often = min(known, key=known.__getitem__, default=""), max(known, key=known.__getitem__, default="")
        if known and known[often] > OF_BRANCHES * known[rare]:
            text, rates = written_level(hazards[rare].measure, level), {"most": known[often], "least": known[rare]}
            return [Doubt.of("hazard_of_branches", level=text, often=often, rare=rare, **rates)]
    return []


def _known(hazard: HazardCurve, level: float) -> float:
    """Return the rate of a level, NaN beyond the curve's rates."""
    within = hazard.levels[0] <= level <= hazard.levels[-1]
    return float(hazard.rate_at(level)) if within or hazard.of_formula else math.nan
