"""Reading of record files, whose format is detected from their content, never from their names."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Sequence
from importlib import resources
from pathlib import Path

import xarray as xr

from ...core.doubts import Doubt, first_names, warn
from .at2 import is_at2, read_at2
from .components import Component, arrays_of, single
from .cosmos import cosmos_components, is_cosmos
from .csmip import csmip_components, is_csmip
from .csv import csv_components
from .directions import LEFT_OUT, doubt_three, horizontal_motions
from .esm import esm_components, is_esm
from .geonet import geonet_components, is_geonet
from .knet import is_knet, knet_components
from .lines import Lines, RecordError, beginning, existing, refuse_packed
from .obspy import is_obspy_text, obspy_components
from .patterns import expand, is_pattern

# GeoNet before CSMIP: both begin with the words of a corrected accelerogram, and GeoNet's next line names a site.
FORMATS: dict[str, tuple[Callable[[Sequence[str]], bool], Callable[[Lines], list[Component]]]] = {
    "K-NET": (is_knet, knet_components),
    "ESM": (is_esm, esm_components),
    "COSMOS": (is_cosmos, cosmos_components),
    "GeoNet": (is_geonet, geonet_components),
    "CSMIP V2": (is_csmip, csmip_components),
}
"""A test of the first lines of a file, and the reader of its components, by the names of the formats."""

_OTHERS = {
    "CSMIP V1": (re.compile(r"\s*uncorrected accelerogram", re.IGNORECASE), "take the corrected file, V2"),
    "SMC": (re.compile(r"\s*\d\s+(?:un)?corrected accelerogram", re.IGNORECASE), "take the COSMOS file (.v2c) of it"),
}
"""Known formats that are not read, by their first line, and the remedy."""


def read(path: str | os.PathLike[str], dt: float | None = None, unit: str | float | None = None) -> xr.DataArray:
    """Read the motions in one record file: all components, m/s².

    Formats: PEER AT2, K-NET and KiK-net, ESM, COSMOS V1 and V2, CSMIP V2, GeoNet V2A, and plain tables (`read_csv`).
    Also the formats of obspy if it is installed (``pip install toppling[records]``). Raw samples (K-NET, KiK-net,
    uncorrected COSMOS, counts of obspy's formats) lose their mean, which is noted in ``processing``; nothing else is
    corrected, filtered or resampled.

    Parameters
    ----------
    path : path
        The file; its format is detected from its content.
    dt : float, optional
        Time step, s, for a table of accelerations that states none.
    unit : str or float, optional
        Unit of acceleration (``"g"``, ``"cm/s2"``), or m/s² per count, for a table or an obspy format that states none.

    Returns
    -------
    xarray.DataArray
        ``acceleration`` (motion, time), labelled with station, component and event if the file gives them, otherwise
        with its name. Coordinates on motion are station, component, event, magnitude, distance and vs30, as far as the
        file gives them.

    Raises
    ------
    RecordError
        One sentence that names the file and the fault. Also samples whose peak differs from the header's by more than 2
        %, and components of different steps or lengths (`read_all` gives an array for each).

    Examples
    --------
    >>> float(read(example_path()).dt[0])
    0.01
    """
    file = existing(path)
    return single(file, read_file(file, dt, unit))


def read_all(
    path: str | os.PathLike[str], dt: float | None = None, unit: str | float | None = None
) -> list[xr.DataArray]:
    """Read the motions in record files as `read`, with an array for each step and length of the components of each.

    Parameters
    ----------
    path : path
        One file, or a pattern that names several, such as ``"records/*.AT2"`` (``**`` is any depth of folders).  Their
        arrays are in the order of the sorted names, without vertical components, of which a warning names the first.
    dt, unit
        As for `read`, of every file.

    Raises
    ------
    RecordError
        As `read`, except for components that differ; a pattern that names no file, or vertical components alone.

    Examples
    --------
    >>> [array.sizes["motion"] for array in read_all(example_path())]
    [1]
    """
    if not is_pattern(path):
        return read_file(path, dt, unit)
    pattern = os.fspath(path)
    kept = horizontal_motions({file: read_file(file, dt, unit) for file in expand(pattern, Path(), "path")}, [pattern])
    if LEFT_OUT in kept[0].attrs:
        out = kept[0].attrs[LEFT_OUT]
        warn([Doubt.of("vertical_unread", number=len(out), named=first_names(out))])
    return kept


def read_file(
    path: str | os.PathLike[str], dt: float | None = None, unit: str | float | None = None
) -> list[xr.DataArray]:
    """Return the motions in one record file, an array for each step and length; arguments and errors as `read`."""
    file = existing(path)
    arrays = _arrays(file, dt, unit)
    doubt_three(file.name, arrays)
    return arrays


def _arrays(file: Path, dt: float | None, unit: str | float | None) -> list[xr.DataArray]:
    refuse_packed(file)
    if b"\0" in beginning(file):
        _refuse(file, "a binary format", dt, None)
        return arrays_of(file, obspy_components(file, unit))
    with Lines(file) as lines:
        if is_at2(lines.head):
            _refuse(file, "a PEER AT2 file", dt, unit)
            return [read_at2(file)]
        for name, (matches, read_components) in FORMATS.items():
            if matches(lines.head):
                _refuse(file, f"a {name} file", dt, unit)
                return arrays_of(file, read_components(lines))
        if lines.head[0].upper().startswith("PEER"):
            raise RecordError(f"{file}: looks like a PEER file, but has no 'NPTS= …, DT= …' above its numbers")
        for name, (pattern, cure) in _OTHERS.items():
            if pattern.match(lines.head[0]):
                raise RecordError(f"{file}: a file of the format {name}, which is not read: {cure}")
        components: list[Component]
        if is_obspy_text(lines.head):
            _refuse(file, "a waveform file", dt, None)
            components = obspy_components(file, unit)
        else:
            components = csv_components(lines, dt, unit)
        return arrays_of(file, components)


def example_path() -> str:
    """Return the path of the generated example record (AT2) of the package."""
    return str(resources.files("toppling.motions").joinpath("example.AT2"))


def _refuse(file: Path, what: str, dt: float | None, unit: str | float | None) -> None:
    """Raise RecordError if a caller gives a step or unit that the file states itself."""
    if dt is not None:
        raise RecordError(f"{file}: {what} states its own DT, so dt must not be given, got {dt!r}")
    if unit is not None:
        raise RecordError(f"{file}: {what} states its own unit, so unit must not be given, got {unit!r:.60}")
