"""Reading of result files for reports, with refusal of other files, other layouts and other kinds of results."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import xarray as xr
from pandas.errors import InvalidIndexError

from ... import fragility
from ...core.labelled import spare_dask
from ...core.units import ENDS, SCHEMA
from ...core.wording import with_article
from ..store.folder import UNREADABLE, damaged, reading
from ..store.netcdf import opened
from ..store.renames import with_present_names
from ..text.error import StudyError

spare_dask()

OLDEST = 1
"""Earliest layout of results that is read."""
KINDS = ("fragility", "uncertainty", "performance", "sensitivity")


@contextmanager
def opened_results(path: Path) -> Iterator[xr.Dataset]:
    """Open a study's results until the block ends; StudyError for other files, of which the head is read alone."""
    if not path.is_file():
        raise StudyError(f"{path}: no such file" if not path.exists() else f"{path}: is no file")
    with reading(path):
        stored = opened(path)
    with stored:
        layout, kind = stored.attrs.get("schema"), stored.attrs.get("kind")
        if layout is None or "toppling_version" not in stored.attrs:
            raise StudyError(f"{path}: is a netCDF file, but not one of toppling's (no attribute schema)")
        number = refuse_newer(path, stored)
        if number < OLDEST:
            raise StudyError(
                f"{path}: was written by an older toppling (layout {number}, this one reads {OLDEST} to {SCHEMA}): "
                "run its study again"
            )
        if kind is None:
            raise StudyError(f"{path}: holds runs, not a study's results: toppling run writes those")
        if str(kind) not in KINDS:
            raise StudyError(f"{path}: is of the kind {str(kind)[:40]!r}; reports are of {', '.join(KINDS)} studies")
        yield with_present_names(stored)


@contextmanager
def read_results(path: Path) -> Iterator[xr.Dataset]:
    """Open a study's results until the block ends; variables of single runs are read only if they are used."""
    with opened_results(path) as stored:
        try:
            small = without_motions(stored).data_vars
            whole = _with_half_levels(stored.assign({name: stored[name].load() for name in small}))
        except (*UNREADABLE, RuntimeError):
            raise damaged(path) from None
        try:
            yield whole
        except StudyError:
            raise
        except RecursionError:
            raise StudyError(f"{path}: its attributes are nested too deeply: run its study again") from None
        except RuntimeError as error:
            if "NetCDF" in str(error):
                raise damaged(path) from None
            raise
        except (LookupError, ValueError, TypeError, AttributeError, ArithmeticError, InvalidIndexError) as error:
            reason = " ".join(str(error).split())[:200] or type(error).__name__
            raise StudyError(
                f"{path}: does not hold what results of {with_article(stored.attrs['kind'])} study hold ({reason}): "
                "run its study again"
            ) from error


def _with_half_levels(stored: xr.Dataset) -> xr.Dataset:
    """Return results of before `half_level` was stored, with `half_level` from their counts."""
    if "half_level" in stored or "median" not in stored or not {"overturnings", "runs"} <= {*stored.data_vars}:
        return stored
    # (the fit loads the compiler, which pages of newer results do without)
    confidence = float(stored.attrs["confidence"])
    counted = fragility.fit_fragility(stored[["overturnings", "runs"]], confidence, intervals="wald")
    return stored.assign({f"half_level{end}": counted[f"half_level{end}"] for end in ENDS})


def without_motions(results: xr.Dataset) -> xr.Dataset:
    """Return the variables that are not given motion by motion, which are small and quick to select from."""
    return results[[name for name, variable in results.data_vars.items() if "motion" not in variable.dims]]


def refuse_newer(path: Path, stored: xr.Dataset) -> int:
    """Return the number of the layout, this version's if there is none; StudyError if a newer one is needed."""
    layout = stored.attrs.get("schema", SCHEMA)
    try:
        number = int(layout)
    except (TypeError, ValueError):
        raise StudyError(f"{path}: its attribute schema must be a number, got {str(layout)[:40]!r}") from None
    if number > SCHEMA:
        raise StudyError(
            f"{path}: was written by a newer toppling (layout {number}, this one reads {SCHEMA}): update toppling"
        )
    return number
