"""Results of schema 1 by the names of schema 2: variables and dimensions whose names begin as the table says."""

import csv
from functools import cache
from pathlib import Path

import xarray as xr

from ...core.units import SCHEMA
from ...fragility.runs.labels import ordered

TABLE = Path(__file__).parents[1] / "reference" / "renamed_variables.csv"


@cache
def _beginnings() -> tuple[tuple[str, str], ...]:
    with TABLE.open(encoding="utf-8", newline="") as file:
        return tuple((row["old"], row["new"]) for row in csv.DictReader(file))


def renamed(name: str) -> str:
    """Return the name of schema 2 of a variable or dimension of schema 1."""
    return next((new + name.removeprefix(old) for old, new in _beginnings() if name.startswith(old)), name)


def with_present_names(stored: xr.Dataset) -> xr.Dataset:
    """Return results of any schema under the names of this schema; their attribute keeps the schema of the file."""
    if int(stored.attrs.get("schema", SCHEMA)) >= SCHEMA:
        return stored
    names = {name: renamed(str(name)) for name in (*stored.dims, *stored.variables)}
    return ordered(stored.rename({old: new for old, new in names.items() if old != new}))
