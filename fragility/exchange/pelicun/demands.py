"""pelicun's demands: their names, and the units that they may be written in."""

import re
from typing import NamedTuple

from ....core.units import STANDARD_GRAVITY
from ....motions import Sa, Sd, Sv
from ..files import ExchangeError
from ..rows import CurveSet, spectral_period


class Demand(NamedTuple):
    """pelicun's name of a measure, the unit that it is written in, and the SI value of the unit."""

    name: str
    unit: str
    factor: float


_OF_FLOORS = {
    "pga": Demand("Peak Floor Acceleration", "g", STANDARD_GRAVITY),
    "pgv": Demand("Peak Floor Velocity", "mps", 1.0),
    "pgd": Demand("Peak Floor Displacement", "m", 1.0),
}
_OF_THE_GROUND = {
    "pga": Demand("Peak Ground Acceleration", "g", STANDARD_GRAVITY),
    "pgv": Demand("Peak Ground Velocity", "mps", 1.0),
}
_SPECTRAL = {
    "Sa": (Sa, Demand("Spectral Acceleration", "g", STANDARD_GRAVITY)),
    "Sv": (Sv, Demand("Spectral Velocity", "mps", 1.0)),
    "Sd": (Sd, Demand("Spectral Displacement", "m", 1.0)),
}
UNITS_OF_MEASURES: dict[str, dict[str, float]] = {
    "m s-2": {"g": STANDARD_GRAVITY, "mps2": 1.0, "inps2": 0.0254, "inchps2": 0.0254, "ftps2": 0.3048},
    "m s-1": {"mps": 1.0, "cmps": 0.01, "inps": 0.0254, "inchps": 0.0254, "ftps": 0.3048, "mph": 0.44704},
    "m": {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "inch": 0.0254, "ft": 0.3048},
}
"""SI values of pelicun's units, by the SI unit of the quantity."""
_SI = {"g": "m s-2", "mps": "m s-1", "m": "m"}


def demand_of(curves: CurveSet, located: bool = False) -> Demand:
    """Return the demand of curves; ExchangeError if pelicun has none.

    `located`: offsets give the place of the demand, so that a spectral demand can be of the ground.
    """
    spectral = spectral_period(curves.im)
    if spectral is not None and (located or not curves.ground):
        _, demand = _SPECTRAL[spectral[0]]
        return demand._replace(name=f"{demand.name}|{spectral[1]!r}")
    demands = _OF_THE_GROUND if curves.ground else _OF_FLOORS
    if curves.im not in demands:
        where = " of the ground" if curves.ground else ""
        spectra = "" if curves.ground and not located else ", Sa(T), Sv(T) and Sd(T) with 5 % damping"
        raise ExchangeError(
            f"pelicun has no demand for {curves.im or 'a measure without a name'}{where}, "
            f"allowed are {', '.join(demands)}{spectra}"
        )
    return demands[curves.im]


def measure_of(demand: str) -> tuple[str, bool] | None:
    """Return the measure's label and True if it is of the ground; None for a demand without a measure here."""
    name, _, subtype = demand.partition("|")
    for ground, known in ((False, _OF_FLOORS), (True, _OF_THE_GROUND)):
        for label, entry in known.items():
            if demand == entry.name:
                return label, ground
    for spectral, entry in _SPECTRAL.values():
        if name in (entry.name, f"Peak {entry.name}") and re.fullmatch(r"[0-9]{1,4}(?:\.[0-9]{0,17})?", subtype):
            try:
                return spectral(float(subtype)).label, False
            except ValueError:
                return None
    return None


def units_of(im: str) -> tuple[str, dict[str, float]]:
    """Return the SI unit of a table's measure, and pelicun's units of the measure."""
    demand = _OF_FLOORS[im] if im in _OF_FLOORS else _SPECTRAL[im[:2]][1]
    si = _SI[demand.unit]
    return si, UNITS_OF_MEASURES[si]
