"""Levels and floors as people say them, for tables, figures and notes."""

from __future__ import annotations

import xarray as xr

from ..units import ACCELERATION, STANDARD_GRAVITY, VELOCITY


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


def floor_name(floor: int | str) -> str:
    """A floor as people say it."""
    return "ground" if str(floor) == "0" else f"floor {floor}"
