"""Names and units of measures as people and other programs write them, and the measure that a name means."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import fields

from ...core import checks
from ...core.units import ACCELERATION, METRE, SECOND, STANDARD_GRAVITY, VELOCITY
from ..readers.units import unit_factor
from .directions import PAIR_MEASURES, PairMeasure
from .measure import MEASURES, Measure
from .parametric_measures import PARAMETRIC_MEASURES

GROUND, FLOOR = "ground", "floor"
"""Places whose motion levels, hazards and curves are measured at."""
GROUND_FLOORS = ("", "0", GROUND)
"""Labels of floors that move with the ground."""
# Measures of other programs by their own names, and the units that OpenQuake and USGS use for them.
_NAMES = {"PGA": "pga", "PGV": "pgv", "PGD": "pgd", "IA": "arias", "CAV": "cav", "RSD595": "d5_95"}
_PROGRAM_UNITS = {"pgv": "cm/s", "pgd": "cm", "arias": "m/s", "cav": "g s", "d5_95": "s"}
_FACTORS: dict[str, dict[str, float]] = {
    VELOCITY: {"m/s": 1.0, "cm/s": 0.01, "mm/s": 0.001, "g s": STANDARD_GRAVITY, "g-s": STANDARD_GRAVITY},
    METRE: {"m": 1.0, "cm": 0.01, "mm": 0.001},
    SECOND: {"s": 1.0},
}
_AROUND = re.compile(r"\s*(\w+)\s*\(\s*(\w.{0,200}?)\s*\)\s*", re.DOTALL)
_WRITTEN = re.compile(r"\s*(\w+)\s*\(([^()]*)\)\s*")


def measure_named(
    name: str | Measure, what: str = "intensity measure", also: Sequence[str] = (), listed: Sequence[str] = (*MEASURES,)
) -> Measure:
    """Return the measure of a name or label such as ``pgv``, ``Sa(1.0)``, ``Sa(1.0, 0.02)`` or ``AvgSa(0.2:2.0:10)``.

    Parameters
    ----------
    name : str or Measure
        A name of `MEASURES`, or one of Sa, Sv, Sd (period, damping), AvgSa (periods, damping) and FIV3 (period, alpha,
        beta) with its parameters. Parameters with defaults may be left out. The periods of AvgSa are separated by
        blanks or written as first:last:number. RotD50, RotD100 and GeometricMean take the measure of one motion, as
        ``RotD50(Sa(1.0))``: they are of both horizontal components. Capitals make no difference. A measure is returned
        as it is.
    what, also, listed : str, sequence of str
        Words for the message: the named quantity, further allowed names, and the names of `MEASURES` that the caller
        allows.

    Examples
    --------
    >>> measure_named("Sa(1.0, 0.02)")
    Sa(period=1.0, damping=0.02)
    """
    if isinstance(name, Measure):
        return name
    if isinstance(name, str):
        known = as_known(name, MEASURES)
        if known is not None:
            return MEASURES[known]
        around = _AROUND.fullmatch(name)
        pair = None if around is None else as_known(around.group(1), PAIR_MEASURES)
        if around is not None and pair is not None:
            base = measure_named(around.group(2), what, also, listed)
            if isinstance(base, PairMeasure):
                raise ValueError(f"{what} {name!r}: {pair} takes a measure of one motion")
            return PAIR_MEASURES[pair](base)
        match = _WRITTEN.fullmatch(name)
        kind = None if match is None else as_known(match.group(1), PARAMETRIC_MEASURES)
        if match is not None and kind is not None:
            try:
                return PARAMETRIC_MEASURES[kind].read(match.group(2).split(","))
            except (TypeError, ValueError) as error:
                raise ValueError(f"{what} {name!r}: {_plainly(error, kind)}") from None
    allowed = ", ".join(repr(label) for label in (*listed, *also))
    more = " or ".join(f"{form}(…)" for form in (*PARAMETRIC_MEASURES, *PAIR_MEASURES))
    raise ValueError(f"{what} must be one of {allowed}, or {more}, got {checks.shown(name)}")


def as_known(name: str, known: Iterable[str]) -> str | None:
    """Return the known name that differs from a name by no more than capitals, None if there is none."""
    return next((label for label in known if label.casefold() == name.casefold()), None)


def _plainly(error: Exception, name: str) -> str:
    """Return the message of an error, without Python's wording for too many arguments."""
    if isinstance(error, TypeError):
        known = ", ".join(field.name for field in fields(PARAMETRIC_MEASURES[name]))
        return f"{name} takes {known}"
    return str(error)


def long_name_at(long_name: str, place: str) -> str:
    """Return the long name of a measure of motions of the ground or of a floor: "Arias intensity, floor motion"."""
    return long_name.replace(FLOOR, place) if FLOOR in long_name else f"{long_name}, {place} motion"


def place_of(floors: Iterable[str]) -> str:
    """Return the place of motions by their labels of floors: a floor if one of them is of a floor."""
    return GROUND if all(floor in GROUND_FLOORS for floor in floors) else FLOOR


def place_in(long_name: str) -> str:
    """Return the place in the long name of a measure, '' without one."""
    return next((place for place in (GROUND, FLOOR) if place in long_name), "")


def our_name(text: str) -> str:
    """Return our name of a measure from the one that another program writes; unknown names stay as they are.

    >>> our_name("SA0P5"), our_name("SA(1.0)"), our_name("PGV")
    ('Sa(0.5)', 'Sa(1.0)', 'pgv')
    """
    name = text.strip()
    usgs = re.fullmatch(r"SA(\d{1,3})P(\d{1,3})", name, re.IGNORECASE)
    spectral = re.fullmatch(r"SA\(([^()]{1,40})\)", name, re.IGNORECASE)
    if usgs:
        name = f"Sa({usgs[1]}.{usgs[2]})"
    elif spectral:
        name = f"Sa({spectral[1]})"
    return _NAMES.get(name.upper(), name)


def program_unit(measure: Measure) -> str:
    """Return the unit in which OpenQuake and USGS give a measure, '' if they do not give it."""
    return "g" if measure.units == ACCELERATION else _PROGRAM_UNITS.get(measure.label, "")


def written_level(measure: Measure, level: float) -> str:
    """Return a level (SI) of a measure in the unit of OpenQuake and USGS: ``0.2 g``, ``50 cm/s``."""
    unit = program_unit(measure)
    return f"{level / in_si(unit, measure):.4g} {unit}" if unit else f"{level:.4g} {measure.units}"


def in_si(units: str, measure: Measure) -> float:
    """Return the SI value of a unit of a measure, as people write units; ValueError for a unit of another measure."""
    factor: float | None
    if measure.units == ACCELERATION:
        factor, allowed = unit_factor(units), "g, gal, cm/s2, m/s2"
    else:
        known = _FACTORS[measure.units]
        text = re.sub(r"\s+", " ", units.strip().lower().replace("sec", "s").replace("*", " ").replace("·", " "))
        text = re.sub(r"^([cm]?m) s ?\^?-1$", r"\1/s", text)
        factor, allowed = known.get(text), ", ".join(known)
    if factor is None:
        raise ValueError(f"units of {measure.label} must be one of {allowed}, got {units[:40]!r}")
    return factor
