"""Result files as reports read them: only ours, of this layout, and of a kind that a report knows."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import xarray as xr

from ..units import SCHEMA
from .store import damaged
from .tables import StudyError

KINDS = ("fragility", "uncertainty", "performance", "sensitivity")


@contextmanager
def read_results(path: Path) -> Iterator[xr.Dataset]:
    """A study's results, open until the block ends: what is of every run is read where it is asked for.

    Raises
    ------
    StudyError
        One sentence: no such file, no result file, one of another layout, not a study's; or what it holds is not what
        results of its kind hold.
    """
    if not path.is_file():
        raise StudyError(f"{path}: no such file" if not path.exists() else f"{path}: is no file")
    try:
        stored = xr.open_dataset(path, engine="netcdf4")
    except RuntimeError:  # (what the netCDF library says of checksums that do not fit)
        raise damaged(path) from None
    except (OSError, ValueError, KeyError, TypeError, AttributeError, OverflowError):
        raise StudyError(f"{path}: is no result file") from None
    with stored:
        check_layout(path, stored)
        try:
            small = [name for name, one in stored.data_vars.items() if "motion" not in one.dims]
            whole = stored.assign({name: stored[name].load() for name in small})
        except (OSError, ValueError, RuntimeError):
            raise damaged(path) from None
        try:
            yield whole
        except StudyError:
            raise
        except RuntimeError as error:
            if "NetCDF" in str(error):
                raise damaged(path) from None
            raise
        except (KeyError, IndexError, ValueError, TypeError, AttributeError) as error:
            reason = " ".join(str(error).split())[:200] or type(error).__name__
            raise StudyError(
                f"{path}: does not hold what results of a {stored.attrs['kind']} study hold ({reason}): run its study "
                "again"
            ) from error


def check_layout(path: Path, stored: xr.Dataset) -> None:
    """StudyError where attributes say that a report cannot be made of these results."""
    layout, kind = stored.attrs.get("schema"), stored.attrs.get("kind")
    if layout is None or "toppling_version" not in stored.attrs:
        raise StudyError(f"{path}: is a netCDF file, but not one of toppling's (no attribute schema)")
    try:
        number = int(layout)
    except (TypeError, ValueError):
        raise StudyError(f"{path}: its attribute schema must be a number, got {str(layout)[:40]!r}") from None
    if number > SCHEMA:
        raise StudyError(
            f"{path}: was written by a newer toppling (layout {number}, this one reads {SCHEMA}): update toppling"
        )
    if number < SCHEMA:
        raise StudyError(
            f"{path}: was written by an older toppling (layout {number}, this one reads {SCHEMA}): run its study again"
        )
    if kind is None:
        raise StudyError(f"{path}: holds runs, not a study's results: toppling run writes those")
    if str(kind) not in KINDS:
        raise StudyError(f"{path}: is of the kind {str(kind)[:40]!r}; reports are of {', '.join(KINDS)} studies")
