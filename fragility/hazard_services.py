"""Hazard curves from the JSON of the web services of the US Geological Survey."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..motions.files import Lines, plain
from .hazard import HazardCurve
from .hazard_reading import MOST_LEVELS, HazardError, curve_of, program_measure, program_unit

Array = NDArray[np.float64]


def read_services(lines: Lines, im: str | None, component: str) -> HazardCurve:
    """A response of the Unified Hazard Tool, or of the services after it."""
    file = lines.file
    try:
        data = json.loads("\n".join(lines))
    except (ValueError, RecursionError) as error:
        where = f"line {error.lineno}: {error.msg}" if isinstance(error, json.JSONDecodeError) else type(error).__name__
        raise HazardError(f"{file}: is no valid JSON ({where})") from None
    status = data.get("status") if isinstance(data, dict) else None
    if isinstance(status, str) and status.lower() not in {"success", "ok"}:
        raise HazardError(f"{file}: is a response of status {plain(status)!r}, not of success")
    response = _member(file, data, "response")
    old = isinstance(response, list)
    entries = response if old else _member(file, response, "hazardCurves")
    if not isinstance(entries, list) or not entries:
        raise HazardError(f"{file}: response must be a list of hazard curves, got {_shown(entries)}")
    found: dict[str, Any] = {}
    for entry in entries:
        imt = _member(file, _member(file, entry, "metadata") if old else entry, "imt")
        text = imt.get("value") if isinstance(imt, dict) else imt
        found[program_measure(lines, text if isinstance(text, str) else _shown(text))] = entry
    if im is None and len(found) > 1:
        raise HazardError(f"{file}: holds curves of {', '.join(found)}: give im")
    label = im or next(iter(found))
    if label not in found:
        raise HazardError(f"{file}: holds no curve of {label}, only of {', '.join(found)}")
    curves = _member(file, found[label], "data")
    if not isinstance(curves, list):
        raise HazardError(f"{file}: data must be a list, got {_shown(curves)}")
    named = {str(_member(file, one, "component")): one for one in curves}
    if component not in named:
        raise HazardError(f"{file}: holds no component {component!r:.40}, only {plain(', '.join(named)) or 'none'}")
    if old:
        levels = _member(file, _member(file, found[label], "metadata"), "xvalues")
        rates = _member(file, named[component], "yvalues")
    else:
        values = _member(file, named[component], "values")
        levels, rates = _member(file, values, "xs"), _member(file, values, "ys")
    x, y = (_numbers(file, name, one) for name, one in (("levels", levels), ("rates", rates)))
    if x.size != y.size:
        raise HazardError(f"{file}: {label} must have one rate a level, got {y.size} for {x.size} levels")
    return curve_of(file, label, program_unit(label), x, [y], None, f"USGS, {plain(component)}")


def _member(file: Path, holder: Any, key: str) -> Any:
    if not isinstance(holder, dict) or key not in holder:
        raise HazardError(f"{file}: is no response of a USGS hazard service: {key!r} is missing in {_shown(holder)}")
    return holder[key]


def _numbers(file: Path, what: str, values: Any) -> Array:
    if not isinstance(values, list) or len(values) > MOST_LEVELS:
        raise HazardError(f"{file}: {what} must be a list of numbers, got {_shown(values)}")
    for value in values:
        if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < 1e300 or value < 0.0:
            raise HazardError(f"{file}: {what} must be finite numbers >= 0, got {_shown(value)}")
    return np.array(values, dtype=np.float64)


def _shown(value: Any) -> str:
    text = repr(value) if isinstance(value, str | int | float | bool | None) else f"a {type(value).__name__}"
    return text if len(text) <= 40 else f"{text[:37]}..."
