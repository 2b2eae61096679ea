"""Collect answers of a package's public functions: a dataset of what is numeric, lines of text of what is not.

Usage: collect.py NAME: calls every function of NAME.py and writes what they return into NAME.nc and NAME.txt.
"""

import inspect
import json
import sys
import warnings
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from importlib.util import module_from_spec, spec_from_file_location
from typing import Any

import netCDF4
import numpy as np
import xarray as xr


def main(name: str) -> None:
    """Write the answers of a script's functions; one that fails leaves a line with its error."""
    spec = spec_from_file_location(name, f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    script = module_from_spec(spec)
    spec.loader.exec_module(script)
    topics = [
        topic
        for title, topic in inspect.getmembers(script, inspect.isfunction)
        if topic.__module__ == name and not title.startswith("_")
    ]
    lines: list[str] = []
    with netCDF4.Dataset(f"{name}.nc", "w") as file:
        for topic in topics:
            try:
                with warnings.catch_warnings(action="ignore"):
                    answers = topic()
            except Exception as error:
                lines.append(f"{topic.__name__}: FAILED {type(error).__name__}: {error}")
                continue
            for key, answer in answers.items():
                _put(file, lines, f"{topic.__name__}.{key}", answer)
    with open(f"{name}.txt", "w", encoding="utf-8") as text:
        text.write("\n".join(lines) + "\n")


def _put(file: netCDF4.Dataset, lines: list[str], name: str, answer: Any) -> None:
    """Put one answer into the dataset or the lines, part by part."""
    if isinstance(answer, xr.Dataset):
        for key, variable in {**answer.data_vars, **answer.coords}.items():
            _put_array(file, lines, f"{name}.{key}", variable.variable)
    elif isinstance(answer, xr.DataArray):
        for key, coordinate in answer.coords.items():
            _put_array(file, lines, f"{name}.{key}", coordinate.variable)
        _put_array(file, lines, f"{name}.values", answer.variable)
    elif isinstance(answer, Mapping):
        for key, part in answer.items():
            _put(file, lines, f"{name}.{key}", part)
    elif hasattr(answer, "_asdict"):
        _put(file, lines, name, answer._asdict())
    elif is_dataclass(answer) and not isinstance(answer, type):
        _put(file, lines, name, {field.name: getattr(answer, field.name) for field in fields(answer)})
    elif isinstance(answer, np.ndarray | float | int | np.generic) and np.asarray(answer).dtype != object:
        array = np.asarray(answer)
        _put_array(file, lines, name, xr.Variable([f"axis_{axis}" for axis in range(array.ndim)], array))
    elif isinstance(answer, list | tuple) and not all(isinstance(part, str) for part in answer):
        for number, part in enumerate(answer):
            _put(file, lines, f"{name}.{number}", part)
    else:
        lines.append(f"{name}: {json.dumps(answer, ensure_ascii=False, default=_named)}")


def _named(value: Any) -> str:
    """Return the name of a function or class, whose text has an address in memory, and the text of anything else."""
    return str(getattr(value, "__qualname__", value))


def _put_array(file: netCDF4.Dataset, lines: list[str], name: str, variable: xr.Variable) -> None:
    values = variable.values
    if values.dtype.kind not in "bif":
        lines.append(f"{name}: {json.dumps(values.tolist(), ensure_ascii=False, default=_named)}")
        return
    name = name.replace("/", " over ")
    for dim, size in zip(variable.dims, values.shape, strict=True):
        file.createDimension(f"{name}:{dim}", size)
    stored = values.astype("i1") if values.dtype == bool else values
    made = file.createVariable(name, stored.dtype, [f"{name}:{dim}" for dim in variable.dims])
    made[...] = stored
    made.setncatts({name: value for name, value in variable.attrs.items() if np.ndim(value) == 0 and value is not None})


if __name__ == "__main__":
    main(sys.argv[1])
