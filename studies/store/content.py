"""The checksum of the contents of results, of any format, which shows values and attributes edited after writing."""

import hashlib
import json
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ...core.units import SCHEMA
from ..text.error import StudyError
from .netcdf import opened, rows_of

ATTRIBUTE = "content_sha256"
AS_WRITTEN = "as written"
EDITED = "edited after it was written"
UNSEALED = "written by a version that stored no checksum of contents"


class EditedResults(UserWarning):
    """Warning that a result file was edited after it was written."""


def content_digest(results: xr.Dataset) -> str:
    """Return the SHA-256 of all variables and attributes, whatever the file's format.

    The digest covers each variable and coordinate, by name: a line of JSON, and its values in C order. The line has its
    name, a flag for a coordinate, its dimensions, shape, type and attributes. Whole numbers and flags are 64-bit
    integers, other numbers are as they are, little-endian, and texts are a line of JSON each. The attributes of the
    dataset follow, except this one.
    """
    digest = hashlib.sha256()
    for name, variable in sorted(results.variables.items(), key=lambda pair: str(pair[0])):
        kind = _type_of(variable)
        about = {"name": str(name), "coordinate": name in results.coords, "dims": [str(dim) for dim in variable.dims]}
        digest.update(_line({**about, "shape": variable.shape, "type": kind, "attributes": _plain(variable.attrs)}))
        # (flags of one byte are summed as eight)
        for where in rows_of(variable.shape, max(variable.dtype.itemsize, 8)):
            values = variable[where].values
            if kind == "text":
                lines = [_in_json(str(value)) for value in np.ravel(values).tolist()]
                digest.update("".join(f"{line}\n" for line in lines).encode())
            else:
                stored = values.dtype.newbyteorder("<") if kind.startswith("float") else np.dtype("<i8")
                digest.update(np.ascontiguousarray(values, stored).data)
    digest.update(_line(_plain({name: value for name, value in results.attrs.items() if name != ATTRIBUTE})))
    return digest.hexdigest()


def sealed(results: xr.Dataset) -> xr.Dataset:
    """Return results with the checksum of their contents as an attribute."""
    return results.assign_attrs({ATTRIBUTE: content_digest(results)})


def check_content(path: Path, results: xr.Dataset, verify: bool = False) -> str:
    """Return the state of results, and warn if they were changed; with `verify` that is an error."""
    if int(results.attrs.get("schema", SCHEMA)) < SCHEMA:  # (read under other names than it was sealed)
        with opened(path) as stored:
            state = content_state(stored)
    else:
        state = content_state(results)
    if verify and state != AS_WRITTEN:
        raise StudyError(f"{path}: was {state}: run its study again with --fresh")
    if state == EDITED:
        warnings.warn(f"{path}: was {state}: it is not what its study gave", EditedResults, stacklevel=3)
    return state


def content_state(results: xr.Dataset) -> str:
    """Return the state of results: as written or edited, by the checksum among their attributes."""
    if ATTRIBUTE not in results.attrs:
        return UNSEALED
    return AS_WRITTEN if str(results.attrs[ATTRIBUTE]) == content_digest(results) else EDITED


def _type_of(variable: xr.Variable) -> str:
    """Return the type of a variable in all models of netCDF: the classic model has no unsigned or long integers."""
    if variable.dtype.kind == "f":
        return f"float{8 * variable.dtype.itemsize}"
    return {"b": "flag", "i": "integer", "u": "integer"}.get(variable.dtype.kind, "text")


def _plain(attributes: Mapping[Any, Any]) -> dict[str, Any]:
    """Return attributes as plain values, as netCDF returns a number, a text or a list of them."""
    arrays = {str(name): np.asarray(value) for name, value in attributes.items()}
    # (a list of one comes back as that one)
    return {name: array.item() if array.size == 1 else array.tolist() for name, array in arrays.items()}


# (what dumps makes of a text, without its choice of an encoder for each of a million)
_in_json = json.encoder.encode_basestring_ascii


def _line(value: Any) -> bytes:
    return json.dumps(value, ensure_ascii=True, sort_keys=True, separators=(",", ":")).encode() + b"\n"
