"""Numbers with their unit as people write them on a command line: ``0.4g``, ``40cm``."""

from __future__ import annotations

import difflib
import math
import re

from ..fragility.exchange import UNITS
from ..units import ACCELERATION, METRE, RADIAN, SECOND
from .tables import StudyError

_MORE = {"s": (1.0, SECOND), "ms": (1e-3, SECOND), "rad": (1.0, RADIAN), "deg": (math.pi / 180.0, RADIAN)}
_SPELLINGS = {"m/s²": "m/s2", "m/s^2": "m/s2", "cm/s²": "cm/s2", "cm/s^2": "cm/s2", "Gal": "gal", "°": "deg"}
_WRITTEN = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*")
_EXAMPLES = {ACCELERATION: "0.4g or 3.9m/s2", METRE: "0.4m or 40cm", SECOND: "0.5s", RADIAN: "0.2rad or 12deg"}


def quantity(option: str, text: str, units: str, *, bare: float = 0.0) -> float:
    """The SI value of a number and its unit, > 0.

    Parameters
    ----------
    option : str
        What it is given for, as the user wrote it.
    text : str
        The number and, with or without a blank between, its unit.
    units : str
        The SI unit that it must be of: ``m s-2``, ``m``, ``s`` or ``rad``.
    bare : float
        Up to which value a number alone is in that unit; 0 where the unit must always be said.

    Raises
    ------
    StudyError
        No number, another unit or none, a value that is not finite and > 0, a number alone that is above `bare`.

    Examples
    --------
    >>> quantity("--width", "40cm", "m"), quantity("--width", "0.4", "m", bare=10.0)
    (0.4, 0.4)
    """
    factors = {name: factor for name, (factor, si) in {**UNITS, **_MORE}.items() if si == units and " " not in name}
    example = _EXAMPLES[units]
    found = _WRITTEN.fullmatch(text)
    if found is None or "," in text:
        hint = " (a decimal point, no comma)" if "," in text else ""
        raise StudyError(f"{option} {text[:40]}: must be a number with its unit, such as {example}{hint}")
    name = _SPELLINGS.get(found[2], found[2])
    if not name and not bare:
        raise StudyError(f"{option} {text[:40]}: say the unit, such as {example}")
    if name and name not in factors:
        near = difflib.get_close_matches(name.lower(), factors, n=1, cutoff=0.5)
        hint = f"; did you mean {found[1]}{near[0]}?" if near else ""
        raise StudyError(f"{option} {text[:40]}: unit must be one of {', '.join(factors)}, got {name[:20]!r}{hint}")
    value = float(found[1]) * (factors[name] if name else 1.0)
    if not 0.0 < value < math.inf:
        raise StudyError(f"{option} {text[:40]}: must be finite and > 0")
    if not name and value > bare:
        fits = [unit for unit in ("cm", "mm") if float(found[1]) * factors.get(unit, math.inf) <= bare]
        hint = f"; did you mean {float(found[1]) * factors[fits[0]]:g} ({found[1]}{fits[0]})?" if fits else ""
        alone = f"a number alone is in {units}, up to {bare:g} (beyond that {found[1]}{units})"
        raise StudyError(f"{option} {text[:40]}: {alone}{hint}")
    return value
