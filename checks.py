"""Argument checks shared by every room: each raises one sentence that names the value and what is allowed."""

from __future__ import annotations

import math
from collections.abc import Sequence
from numbers import Integral, Real
from typing import Any

import numpy as np
from numpy.typing import NDArray


def number(
    name: str,
    value: Any,
    *,
    above: float | None = None,
    at_least: float | None = None,
    below: float | None = None,
    at_most: float | None = None,
    unit: str = "",
) -> float:
    """Return `value` as a float; ValueError where it is not finite or outside the bounds, TypeError where no number."""
    if isinstance(value, bool | np.bool_) or not isinstance(value, Real):
        raise TypeError(f"{name} must be a number{_in(unit)}, got {_shown(value)}")
    result = float(value)
    bounds = []
    if above is not None:
        bounds.append((result > above, f"> {above:g}"))
    if at_least is not None:
        bounds.append((result >= at_least, f">= {at_least:g}"))
    if below is not None:
        bounds.append((result < below, f"< {below:g}"))
    if at_most is not None:
        bounds.append((result <= at_most, f"<= {at_most:g}"))
    if not math.isfinite(result) or not all(holds for holds, _ in bounds):
        allowed = " and ".join(["finite", *(text for _, text in bounds)])
        raise ValueError(f"{name} must be {allowed}{_in(unit)}, got {result!r}")
    return result


def count(name: str, value: Any, *, at_least: int = 0) -> int:
    """Return `value` as an int; TypeError where it is not a whole number, ValueError where it is too small."""
    if isinstance(value, bool | np.bool_) or not isinstance(value, Integral):
        raise TypeError(f"{name} must be a whole number, got {_shown(value)}")
    if int(value) < at_least:
        raise ValueError(f"{name} must be at least {at_least}, got {int(value)}")
    return int(value)


def choice(name: str, value: Any, allowed: Sequence[str]) -> str:
    """Return `value` where it is one of the allowed words; ValueError else."""
    if not isinstance(value, str) or value not in allowed:
        raise ValueError(f"{name} must be one of {', '.join(map(repr, allowed))}, got {_shown(value)}")
    return value


def finite_array(name: str, values: Any, *, ndim: tuple[int, ...] = (1,), unit: str = "") -> NDArray[np.float64]:
    """Return `values` as a C-contiguous float64 array of an allowed dimensionality; no NaN, no infinity, not empty."""
    try:
        array = np.ascontiguousarray(values)
        if array.dtype.kind not in "iuf":
            raise TypeError
        array = array.astype(np.float64, copy=False)
    except (TypeError, ValueError):
        raise TypeError(f"{name} must be real numbers{_in(unit)}, got {_shown(values)}") from None
    if np.ndim(values) not in ndim or array.ndim not in ndim:
        dims = " or ".join(str(n) for n in ndim)
        raise ValueError(f"{name} must have {dims} dimension(s), got an array of shape {np.shape(values)}")
    if array.size == 0:
        raise ValueError(f"{name} must not be empty, got an array of shape {array.shape}")
    bad = ~np.isfinite(array)
    if bad.any():
        first = tuple(int(i) for i in np.argwhere(bad)[0])
        where = first[0] if len(first) == 1 else first
        raise ValueError(f"{name} must be finite{_in(unit)}, got {array[first]} at index {where}")
    return array


def _in(unit: str) -> str:
    return f" (in {unit})" if unit else ""


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
