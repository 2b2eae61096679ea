"""Records from files, their format detected from what they hold, never from their names."""

from __future__ import annotations

import os
from importlib import resources

import xarray as xr

from .at2 import is_at2, read_at2
from .files import RecordError, text_of
from .text import read_csv


def read(path: str | os.PathLike[str], dt: float | None = None) -> xr.DataArray:
    """The motions in one record file (PEER AT2, plain CSV), m/s².

    Parameters
    ----------
    path : path
        The file; its format is detected from its content.
    dt : float, optional
        Time step, s, for a table of accelerations that states none.

    Returns
    -------
    xarray.DataArray
        ``acceleration`` (motion, time), labelled with the file's name.

    Raises
    ------
    RecordError
        One sentence that names the file and what is wrong with it.

    Examples
    --------
    >>> float(read(example_path()).dt[0])
    0.01
    """
    file, text = text_of(path)
    if is_at2(text):
        if dt is not None:
            raise RecordError(f"{file}: a PEER AT2 file states its own DT, so dt must not be given, got {dt!r}")
        return read_at2(path)
    if any(line.upper().startswith("PEER") for line in text.splitlines()[:1]):
        raise RecordError(f"{file}: looks like a PEER file, but has no 'NPTS= …, DT= …' in its first four lines")
    return read_csv(path, dt)


def example_path() -> str:
    """Path of the generated example record (AT2) that ships with the package."""
    return str(resources.files(__package__).joinpath("example.AT2"))
