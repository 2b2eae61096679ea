"""Names and units of measures as people and other programs write them."""

from __future__ import annotations

import re
from collections.abc import Iterable

from ...core.units import ACCELERATION, METRE, SECOND, STANDARD_GRAVITY, VELOCITY
from ..readers.units import unit_factor
from .measure import Measure

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
