"""How measures, floors, laws' inputs and figures are said to people: the same words in tables and in drawings.

It knows nothing of drawing, so that tables and messages load no plotting library.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
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
REFERENCE_LAW = "housner"
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


def three(value: float) -> str:
    """A number to three figures, the zeros among them, so that the ends of an interval look as exact as they are.

    Examples
    --------
    >>> three(0.35), three(1234.5), three(2.0e-7)
    ('0.350', '1,230', '2.00e-07')
    """
    if math.isinf(value):
        return "∞"
    if value == 0.0 or math.isnan(value):
        return "0" if value == 0.0 else "not known"
    if not 1e-4 <= abs(value) < 1e9:
        return f"{value:.2e}"
    # (rounded first: 0.9996 is 1.00)
    digits = 2 - math.floor(math.log10(abs(float(f"{value:.2e}"))))
    return f"{round(value, digits):,.{max(0, digits)}f}"


def interval_text(low: float, high: float, write: Callable[[float], str] = three) -> str:
    """The ends of an interval, each as `write` says it; one that is open is said in words.

    Examples
    --------
    >>> interval_text(2.1, 3.0), interval_text(2.1, math.inf), interval_text(math.nan, 3.0)
    ('2.10–3.00', 'above 2.10', 'no interval')
    """
    if math.isnan(low) or math.isnan(high):
        return "no interval"
    if math.isinf(high):
        return "not known" if low <= 0.0 else f"above {write(low)}"
    return f"below {write(high)}" if math.isinf(low) else f"{write(low)}–{write(high)}"


def years_between(often: float, seldom: float) -> str:
    """The ends of a rate's interval, the higher first, as years between two events."""
    if not often > 0.0:
        return "no interval"
    low, high = (1.0 / rate if rate > 0.0 else math.inf for rate in (often, seldom))
    return interval_text(low, high, lambda years: in_years(1.0 / years))


def fractile_text(curve: xr.Dataset, p: float, scale: float) -> str:
    """The level at which a curve reaches p, over `scale`, with its interval."""
    at = curve.sel(fraction=p)
    value, low, high = (at[f"fractile{end}"].item() / scale for end in ("", "_lower", "_upper"))
    return f"{three(value)} ({interval_text(low, high)})"


def axis_of(results: xr.Dataset) -> xr.DataArray:
    """The measure that curves are drawn against: the levels, or in a cloud every motion's own intensity."""
    return results["level"] if "level" in results.coords else results["intensity"]


def axis_name(axis: xr.DataArray, default: str = "level") -> str:
    """A quantity with its unit, as an axis says it."""
    _, unit = display_unit(axis)
    return f"{axis.attrs.get('long_name', default)}{f' ({unit})' if unit else ''}"


def in_years(rate: float) -> str:
    """A rate as the years between two events, to three digits.

    Examples
    --------
    >>> in_years(1.0 / 2137.0), in_years(0.3), in_years(0.0)
    ('2,140', '3.33', '∞')
    """
    return three(1.0 / rate) if rate > 0.0 else "∞"


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


def chance_text(share: float) -> str:
    """A probability in per cent, to three digits, that no line breaks."""
    return f"{three(100.0 * share)}\u00a0%"


def chances_between(low: float, high: float, write: Callable[[float], str] = chance_text) -> str:
    r"""The ends of a probability's interval in per cent.

    Examples
    --------
    >>> chances_between(0.0199, 0.0268)
    '1.99–2.68\xa0%'
    """
    return interval_text(low, high, write).replace("\u00a0%–", "–")


def reference_law(results: xr.Dataset) -> tuple[int, bool]:
    """Which law the answer is of, and whether it is the field's reference (else the first)."""
    law = results.coords.get("law")
    if law is not None and law.dims == ("model",):
        found = np.flatnonzero(law.values == REFERENCE_LAW)
        if found.size:
            return int(found[0]), True
    return 0, False
