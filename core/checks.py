"""Argument checks shared by all packages: each raises one sentence with the value and the allowed range."""

import math
import operator
import os
import re
import unicodedata
from collections.abc import Callable, Iterable, Mapping, Sequence
from numbers import Integral, Real
from pathlib import Path
from typing import Any, TypeGuard, TypeVar

import numpy as np

from .aliases import Array

Item = TypeVar("Item")

BOUNDS: dict[str, tuple[Callable[[Any, Any], Any], str]] = {
    "above": (operator.gt, ">"),
    "at_least": (operator.ge, ">="),
    "below": (operator.lt, "<"),
    "at_most": (operator.le, "<="),
}
"""Bounds of numbers: their test on a number or an array, and their sign."""
NUMERIC = {
    *("width", "height", "cm_height", "alpha", "R", "p", "inertia_factor", "delta", "e", "level", "intensity"),
    *("pga", "pgv", "pgd", "cav", "scale_factor", "overturnings", "peak_rotation"),
    *("probability", "median", "dispersion", "rate"),
}
"""Names of labelled data that are numbers in all results."""
NO_NUMBERS = (bool, np.bool_, np.timedelta64)
"""Types that Python or numpy count among whole numbers."""


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
    """Return `value` as a float; ValueError if it is not finite or outside the bounds, TypeError if it is no number."""
    if isinstance(value, NO_NUMBERS) or not isinstance(value, Real):
        raise TypeError(f"{name} must be a number{_in(unit)}, got {shown(value)}")
    try:
        result = float(value)
    except OverflowError:
        result = math.inf
    given = zip(BOUNDS.values(), (above, at_least, below, at_most), strict=True)
    bounds = [(holds, sign, bound) for (holds, sign), bound in given if bound is not None]
    if not math.isfinite(result) or not all(holds(result, bound) for holds, _, bound in bounds):
        allowed = " and ".join(["finite", *(f"{sign} {bound:g}" for _, sign, bound in bounds)])
        raise ValueError(f"{name} must be {allowed}{_in(unit)}, got {result!r}")
    return result


def count(name: str, value: Any, *, at_least: int = 0) -> int:
    """Return `value` as an int; TypeError if it is not a whole number, ValueError if it is too small."""
    if isinstance(value, NO_NUMBERS) or not isinstance(value, Integral):
        raise TypeError(f"{name} must be a whole number, got {shown(value)}")
    if int(value) < at_least:
        raise ValueError(f"{name} must be at least {at_least}, got {int(value)}")
    return int(value)


def plain(name: str, data: Any) -> None:
    """Raise TypeError for a variable of labelled data that is neither flags, numbers nor text.

    Libraries fail on it, take times as numbers of nanoseconds, or compute with three digits. Dates may be coordinates.
    """
    if not hasattr(data, "coords"):
        raise TypeError(f"{name} must be labelled data (xarray), got {kind(data)}")
    coordinates = data.coords.variables
    variables = data.variables if hasattr(data, "variables") else {**coordinates, data.name: data.variable}
    for key, array in variables.items():
        dtype = array.dtype
        if isinstance(dtype, np.dtype) and (dtype.kind in "biu" or (dtype.kind == "f" and dtype.itemsize in (4, 8))):
            continue
        text = dtype.kind in "UT" or (dtype.kind == "O" and _is_text(array.values, key in coordinates))
        if not text and (dtype.kind != "M" or key not in coordinates):
            what = dtype if dtype.kind != "O" else "objects that are no text"
            raise TypeError(f"{key} of {name} must be flags, numbers of 32 or 64 bits, or text, got {what}: convert it")
        unit = array.attrs.get("units", "1")
        if key in NUMERIC or _spelled(str(unit)) != "1":
            raise TypeError(f"{key} of {name} must be numbers{_in(str(unit)[:40])}, got {'text' if text else 'dates'}")


def _is_text(values: Any, label: bool) -> bool:
    """Return True for text with or without gaps; for labels, also if some are whole numbers."""
    from pandas.api.types import infer_dtype  # noqa: PLC0415 - as labelled arrays, which have objects alone

    return infer_dtype(values, skipna=True) in ("string", "empty", *(("integer", "mixed-integer") if label else ()))


def not_empty(name: str, data: Any, *dims: str) -> None:
    """Raise an error for labelled data that are not `plain`, or empty along a dimension (of runs, if none is named)."""
    plain(name, data)
    for dim in dims or ("block", "model", "level", "motion"):
        if data.sizes.get(dim, 1) == 0:
            raise ValueError(f"{name} must hold at least one {dim}, got none")


def is_several(values: Any) -> TypeGuard[Iterable[Any]]:
    """Return True for what can be iterated, as an array without dimensions can't."""
    return isinstance(values, Iterable) and getattr(values, "ndim", 1) > 0


def several(name: str, values: Any, kind_of: type[Item]) -> list[Item]:
    """Return one value of a type, or several, as a list; TypeError for others, which can also be no sequence."""
    items = [values] if isinstance(values, kind_of) or not is_several(values) else list(values)
    for item in items:
        if not isinstance(item, kind_of):
            raise TypeError(f"{name} must be one {kind_of.__name__} or a sequence of them, got {kind(item)}")
    return items


def sequence(name: str, values: Any) -> list[Any]:
    """Return several values as a list; TypeError for text and for what cannot be iterated."""
    if isinstance(values, str) or not is_several(values):
        raise TypeError(f"{name} must be a sequence, got {shown(values)}")
    return list(values)


def flag(name: str, value: Any) -> None:
    """Raise TypeError for a value that is neither True nor False."""
    if not isinstance(value, bool):
        raise TypeError(f"{name} must be True or False, got {shown(value)}")


def choice(name: str, value: Any, allowed: Sequence[str]) -> str:
    """Return `value` if it is one of the allowed words; ValueError otherwise."""
    if not isinstance(value, str) or value not in allowed:
        # Many words are listed without quotes, so that the sentence stays readable.
        words = ", ".join(allowed if len(allowed) > 12 else map(repr, allowed))
        raise ValueError(f"{name} must be one of {words}, got {shown(value)}")
    return value


def numbers(name: str, values: Any, unit: str = "", kinds: str = "biufO") -> Array:
    """Return a float64 copy, of any shape and in C order; an error for text, times, complex or masked values, or units.

    `kinds`: the allowed types of numpy.  Objects must be numbers; None in a list is NaN.
    """
    stated_unit(name, values, unit)
    if not isinstance(values, Mapping) and np.ma.is_masked(values):  # (a dataset is no array, and a mapping)
        raise ValueError(f"{name} must hold no masked values")
    try:
        array = np.asarray(values)
        if array.dtype.kind not in kinds or values is None:
            raise TypeError
        return np.array(array, dtype=np.float64, order="C", ndmin=0)
    except (TypeError, ValueError, OverflowError):
        raise TypeError(f"{name} must be real numbers{_in(unit)}, got {shown(values)}") from None


def finite_array(name: str, values: Any, *, ndim: tuple[int, ...] = (1,), unit: str = "") -> Array:
    """Return a C-contiguous float64 copy; ValueError for NaN, infinity, no values, wrong dimensions or another unit."""
    array = numbers(name, values, unit, "iuf")
    if array.ndim not in ndim:
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


def increasing(name: str, values: Sequence[float] | Array, unit: str = "") -> None:
    """Raise a ValueError, in the unit of the values, unless they are > 0 and strictly increasing."""
    of, array = "" if unit in ("", "1") else f" {unit}", np.asarray(values, dtype=np.float64)
    if array.size and not array[0] > 0.0:
        raise ValueError(f"{name} must be > 0, got {array[0]:g}{of}")
    falls = np.flatnonzero(~(np.diff(array) > 0.0))
    if falls.size:
        before, after = array[falls[0] : falls[0] + 2]
        raise ValueError(f"{name} must be strictly increasing, got {after:g}{of} after {before:g}{of}")


def acceleration(name: str, values: Any, *, ndim: tuple[int, ...] = (1,)) -> Array:
    """Return acceleration histories as `finite_array` does; ValueError above 1e9 m/s²."""
    array = finite_array(name, values, ndim=ndim, unit="m/s²")
    largest = float(np.abs(array).max())
    if largest > MAX_ACCELERATION:
        raise ValueError(f"{name} must be at most {MAX_ACCELERATION:g} m/s², got {largest:g}")
    return array


# Fraction of a step: a time axis printed with few digits counts as uniform, an axis with a missing sample does not.
UNIFORMITY = 0.05
# Limits (m/s², s) above which a motion is no shaking and arithmetic on it overflows.
MAX_ACCELERATION = 1e9
MAX_STEP = 1e3


def time_step(what: str, time: Array | None, dt: float | None) -> float:
    """Return the step (s) of a motion from its uniform time axis (n >= 2), its stated dt, or both if they agree."""
    step = None
    if time is not None:
        axis = finite_array(f"time of {what}", time, unit="s")
        step = float(axis[-1] - axis[0]) / (axis.size - 1)
        if not 0.0 < step <= MAX_STEP:
            ends = f"{axis[0]:g} s first and {axis[-1]:g} s last"
            raise ValueError(f"the time of {what} must increase, by at most {MAX_STEP:g} s a step, got {ends}")
        off = np.abs(axis - (axis[0] + step * np.arange(axis.size)))
        worst = int(off.argmax())
        if off[worst] > UNIFORMITY * step:
            raise ValueError(
                f"the time step of {what} must be uniform: sample {worst} lies at {axis[worst]:g} s, "
                f"{off[worst]:.2g} s off a step of {step:g} s; resample it first"
            )
    if dt is None:
        if step is None:
            raise ValueError(f"{what} must have a dt or a time coordinate, got neither")
        return step
    stated = number(f"dt of {what}", dt, above=0.0, at_most=MAX_STEP, unit="s")
    if step is not None and abs(step - stated) > UNIFORMITY * stated:
        raise ValueError(f"{what} states dt = {stated:g} s, but its time steps by {step:g} s: drop or correct dt")
    return stated


_SLOWER = re.compile(r"(?<![a-z])(?:veloc|displac)", re.IGNORECASE)
"""Names of labelled values that are no accelerations."""


def stated_unit(name: str, values: Any, unit: str) -> None:
    """Raise ValueError if labelled values (xarray, pandas) state another unit than `unit`; '' accepts any."""
    attributes = getattr(values, "attrs", None)
    units = attributes.get("units", attributes.get("unit")) if isinstance(attributes, Mapping) else None
    if unit and units is not None and str(units) and _spelled(str(units)) != _spelled(unit):
        raise ValueError(f"{name} must be in {unit}, got units {units!r:.40}: convert the values, or correct units")
    title = getattr(values, "name", None)
    if unit == "m s-2" and isinstance(title, str) and _SLOWER.search(title):
        raise ValueError(f"{name} must be acceleration in {unit}, got values of the name {title!r:.40}")


def _spelled(unit: str) -> str:
    """Return a unit in the spelling ``m s-2``, from ``m/s²``, ``m s**-2``, ``meter / second ** 2`` or ``m/s/s``."""
    text = unicodedata.normalize("NFKC", unit).replace("\u2212", "-").strip().lower().replace("/s/s", "/s2")
    text = re.sub(r"\bmet(?:er|re)s?\b", "m", re.sub(r"\bsec(?:ond)?s?(?=\b|\d|\^)", "s", text))
    text = re.sub(r"\b(?:years?|yrs?|annum|a)\b", "year", re.sub(r"\s*(?:/|\bper\b)\s*", "/", text))
    text = re.sub(r"[*·.\s]+", " ", re.sub(r"\s*(?:\*\*|\^)\s*", "", text))
    text = re.sub(r"-$", "-1", re.sub(r"/\(?([a-z]+)(\d*)\)?$", r" \1-\2", text))
    return re.sub(r"^1? ?(?=year-1$)|^(?:dimensionless|none|-)?$", "", text).strip() or "1"


def path(value: Any) -> Path:
    """Return a path; TypeError for anything else."""
    if not isinstance(value, str | os.PathLike):
        raise TypeError(f"path must be a path, got {type(value).__name__}")
    return Path(value)


def callback(name: str, value: Any) -> None:
    """Raise TypeError for a value that is neither None nor callable: it would otherwise fail after the first runs."""
    if value is not None and not callable(value):
        raise TypeError(f"{name} must be a function, got {kind(value)}")


def kind(value: Any) -> str:
    """Return the type of a value for a message; a class that was passed instead of an instance is named as such."""
    return f"the class {value.__name__} (call it)" if isinstance(value, type) else type(value).__name__


def _in(unit: str) -> str:
    return f" (in {unit})" if unit else ""


def shown(value: Any) -> str:
    """Return a value for a message, in one line of at most 60 characters."""
    try:
        text = " ".join(repr(value).split())
    except (ValueError, RecursionError):  # (a whole number of more than 4300 digits)
        text = f"a value of type {type(value).__name__}"
    return text if len(text) <= 60 else f"{text[:57]}..."
