"""Finished results on disk: written whole or not at all, and recognised when they are there already."""

from __future__ import annotations

import errno
import os
from contextlib import suppress
from pathlib import Path

import xarray as xr

from .tables import StudyError

RESULT_NAME = "results.nc"


def finished(target: Path, identity: str) -> xr.Dataset | None:
    """The finished results of the study of this identity, if they are there; StudyError where another's are."""
    try:
        if not target.exists():
            return None
        with xr.open_dataset(target) as stored:
            if stored.attrs.get("identity") == identity:
                return stored.load()
    except (OSError, ValueError) as error:
        if isinstance(error, OSError) and error.errno == errno.ENAMETOOLONG:
            raise StudyError(f"{target}: the name is too long") from None
        raise StudyError(f"{target}: exists and is no result file; move it away or use --fresh") from None
    raise StudyError(f"{target}: holds the results of another study; use another folder or --fresh")


def save(results: xr.Dataset, target: Path) -> None:
    """Write a dataset whole or not at all: temporary file beside the target, fsync, rename."""
    temporary = target.with_name(f"{target.name}.{os.getpid()}.part")
    try:
        results.to_netcdf(temporary, engine="netcdf4")
        with temporary.open("rb") as file:
            os.fsync(file.fileno())
        temporary.replace(target)
    except (OSError, RuntimeError) as error:  # the HDF5 library speaks of a full disk as a RuntimeError
        reason = getattr(error, "strerror", None) or error
        raise StudyError(f"{target}: cannot be written ({reason}; is the disk full?)") from None
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
