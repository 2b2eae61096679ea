"""How measures, floors, laws' inputs and figures are said to people: the same words in tables and in drawings.

It knows nothing of drawing, so that tables and messages load no plotting library.
"""

from __future__ import annotations

import math

import xarray as xr

from ..units import ACCELERATION, STANDARD_GRAVITY, VELOCITY

MEASURES = {
    "pga": "PGA",
    "pgv": "PGV",
    "pgd": "PGD",
    "arias": "Arias intensity",
    "cav": "CAV",
    "housner_intensity": "Housner intensity",
    "pga_normalised": "PGA/(g tan α)",
    "pgv_normalised": "p·PGV/(g tan α)",
    "scale": "scale factor",
}
INPUTS = {
    "alpha": "α",
    "alpha_factor": "α / nominal",
    "R": "R",
    "R_factor": "R / nominal",
    "inertia_factor": "λ",
    "e": "e",
    "restitution_factor": "$e/e_R$",
    "delta": "δ",
    "zeta": "ζ",
    "law": "damping law",
    "model": "damping law",
    "sample": "parameters",
    "cm_height": "mass centre",
}


def display_unit(level: xr.DataArray) -> tuple[float, str]:
    """What to divide a level by for people, and that unit: g for accelerations, SI else."""
    units = level.attrs.get("units", "1")
    if units == ACCELERATION:
        return STANDARD_GRAVITY, "g"
    return 1.0, {VELOCITY: "m/s", "1": ""}.get(units, units)


def level_text(value: float, like: xr.DataArray) -> str:
    """A level with its unit, to three figures."""
    scale, unit = display_unit(like)
    return f"{value / scale:.3g}{f' {unit}' if unit else ''}"


def fractile_text(curve: xr.Dataset, p: float, scale: float) -> str:
    """The level at which a curve reaches p, over `scale`, with its interval."""
    at = curve.sel(fraction=p)
    value, low, high = (at[f"fractile{end}"].item() / scale for end in ("", "_lower", "_upper"))
    return f"{value:.3f} ({low:.3f}–{high:.3f})"


def axis_of(results: xr.Dataset) -> xr.DataArray:
    """The measure that curves are drawn against: the levels, or in a cloud every motion's own intensity."""
    return results["level"] if "level" in results.coords else results["intensity"]


def axis_name(axis: xr.DataArray, default: str = "level") -> str:
    """A quantity with its unit, as an axis says it."""
    _, unit = display_unit(axis)
    return f"{axis.attrs.get('long_name', default)}{f' ({unit})' if unit else ''}"


def in_years(rate: float) -> str:
    """A rate as the years between two events, to two or three digits."""
    if not rate > 0.0:
        return "∞"
    digits = 10.0 ** (math.floor(math.log10(1.0 / rate)) - 1)
    return f"{max(1.0 / rate, 0.1) if rate > 1.0 else round(1.0 / rate / digits) * digits:,.{int(rate > 0.1)}f}"


def measure_name(label: str, power: float = 1.0) -> str:
    """A measure as people write it; with its power in the motion's amplitude the root that grows as that does."""
    if power == 2.0:
        return f"√({measure_name(label)})"
    if label.startswith("ground_"):
        return f"{measure_name(label.removeprefix('ground_'))}, ground"
    return MEASURES.get(label, label)


def input_name(name: str) -> str:
    """An input, or a dimension of runs, as people write it."""
    return INPUTS.get(name, name)


def floor_name(floor: int | str) -> str:
    """A floor as people say it."""
    return "ground" if str(floor) == "0" else f"floor {floor}"


def percent(share: float) -> str:
    """A share in per cent, short, that no line breaks."""
    return f"{100.0 * share:.3g}\u00a0%"
