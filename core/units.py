"""Physical constants, the units of labelled arrays (SI and radians, in CF notation), and the provenance of datasets."""

import json
from collections.abc import Mapping
from functools import cache
from importlib import metadata
from typing import Any, Final

from .wording import given_percent

STANDARD_GRAVITY: Final = 9.80665
"""Standard acceleration of gravity, m/s² (CGPM 1901)."""
DAMPING: Final = 0.05
"""Damping ratio of response spectra if no other is given."""

DIMENSIONLESS: Final = "1"
METRE: Final = "m"
SECOND: Final = "s"
RADIAN: Final = "rad"
VELOCITY: Final = "m s-1"
ACCELERATION: Final = "m s-2"
ANGULAR_VELOCITY: Final = "rad s-1"
ANGULAR_ACCELERATION: Final = "rad s-2"
HERTZ: Final = "Hz"
NEWTON: Final = "N"
STIFFNESS: Final = "N m-1"
KILOGRAM: Final = "kg"
PER_YEAR: Final = "year-1"

UNITS: Final[dict[str, tuple[float, str]]] = {
    "m s-2": (1.0, "m s-2"),
    "m/s2": (1.0, "m s-2"),
    "cm/s2": (0.01, "m s-2"),
    "gal": (0.01, "m s-2"),
    "g": (STANDARD_GRAVITY, "m s-2"),
    "m s-1": (1.0, "m s-1"),
    "m/s": (1.0, "m s-1"),
    "cm/s": (0.01, "m s-1"),
    "m": (1.0, "m"),
    "cm": (0.01, "m"),
    "mm": (0.001, "m"),
    "1": (1.0, "1"),
    PER_YEAR: (1.0, PER_YEAR),
    "1/year": (1.0, PER_YEAR),
}
"""SI value and SI unit of each unit that a column of a file, or a value on the command line, may have."""
SPELLED: Final = {ACCELERATION: "m/s2", VELOCITY: "m/s", PER_YEAR: "1/year"}
"""Units as people write them."""


def described(long_name: str, units: str = DIMENSIONLESS) -> dict[str, str]:
    """Return the attributes of a labelled array: its unit and its long name."""
    return {"units": units, "long_name": long_name}


ENDS: Final = ("", "_lower", "_upper")
"""Suffixes of the names of an estimate and of both ends of its interval."""


def of_end(end: str, long_name: str, share: float | None = None, kind: str = "") -> str:
    """Return the long name of an estimate, or of an end of its interval (of a kind, with a share).

    >>> of_end("", "rate"), of_end("_lower", "rate", 0.95, "bootstrap")
    ('rate', 'lower end of the 95 % bootstrap interval: rate')
    """
    words = (end.removeprefix("_"), "end of the", "" if share is None else given_percent(share), kind, "interval")
    return f"{' '.join(filter(None, words))}: {long_name}" if end else long_name


def variables(dims: Any, table: Mapping[str, tuple[Any, str, str]]) -> dict[str, tuple[Any, Any, dict[str, str]]]:
    """Return labelled variables on some dimensions by name, from the values, the unit and the long name of each."""
    return {name: (dims, values, described(long_name, units)) for name, (values, units, long_name) in table.items()}


SCHEMA: Final = 2
"""Version number of the layout of datasets and result files; raised when a name, a dimension or a meaning changes."""


def provenance(configuration: dict[str, Any]) -> dict[str, Any]:
    """Return the attributes of every dataset: conventions, layout number, versions and configuration (JSON).

    They contain no date or time, so that equal computations give equal files.
    """
    versions = {name: _version(name) for name in ("numpy", "numba", "scipy")}
    return {
        "Conventions": "CF-1.11",
        "schema": SCHEMA,
        "toppling_version": _version("toppling"),
        "package_versions": json.dumps(versions),
        "configuration": json.dumps(configuration, ensure_ascii=False),
    }


@cache
def _version(package: str) -> str:
    return metadata.version(package)
