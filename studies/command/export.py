"""Export of a study's curves for other programs: the selection from a result file, and the formats."""

import difflib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import xarray as xr

from ...core.aliases import Index
from ...fragility import ExchangeError, Written, with_modelling, write_curve_csv, write_nrml, write_pelicun
from ...fragility.curves.curve import TABULATED
from ...fragility.exchange.pelicun.building import FILES, FRAGILITY
from ...fragility.fitting.states import SEPARATED
from ...fragility.risk.modelling import MODELLING
from ..plan.estimates import MEAN
from ..report.results_file import refuse_newer
from ..store.content import check_content
from ..store.folder import reading
from ..store.netcdf import opened
from ..store.outputs import own_files
from ..text.error import StudyError
from .choices import CurveFormat

PERFORMANCE, UNCERTAINTY = "performance", "uncertainty"
"""Kinds of studies whose results are not curves alone."""

MOST_NAMED, NAMED = 12, 3
"""Most curves without an estimate that are all named, and the number that is named of more curves."""

PELICUN = "export pelicun"
"""By this name a folder's record has the files for pelicun, of curves and of buildings."""

# Names of files never come from labels: they are fixed, in a folder that the user chooses.
_WRITERS: dict[str, tuple[Callable[[xr.Dataset, Path], Written], str, tuple[str, ...]]] = {
    "pelicun": (write_pelicun, FRAGILITY, FILES),
    "nrml": (write_nrml, "fragility.xml", ("fragility.xml",)),
    "csv": (write_curve_csv, "curves.csv", ("curves.csv",)),
}
"""The writer of each format, the name of its file, and the names of all files that the format may have."""


def read_curves(path: Path, model: str | None = None, verify: bool = False, modelling: bool = False) -> xr.Dataset:
    """Read a result file's curves, of all laws or those `model` names; with `modelling` their uncertainty counts."""
    with reading(path), opened(path) as whole:
        refuse_newer(path, whole)
        check_content(path, whole, verify)
        kind = str(whole.attrs.get("kind", ""))
        stored = _of_all_samples(whole) if kind == UNCERTAINTY else whole
        parts = [name for name, array in stored.data_vars.items() if "motion" not in array.dims]
        # only the curves are loaded, because the runs may be larger than the memory
        curves = stored[parts].load()
        observed = ("probability", "lower", "upper", "overturnings", "runs")
        if "curve_probability" in curves:  # renamed as in a fit, instead of the observed probability
            curves = curves.drop_vars(observed, errors="ignore")
            curves = curves.rename(curve_probability="probability")
        axis = stored.coords.get("level", stored.coords.get("intensity"))  # (a cloud has no levels)
        im = "" if axis is None else axis.attrs.get("im", "")
        floors = _floors(stored)
    if kind == PERFORMANCE:
        raise StudyError(
            f"{path}: results of a performance study, which has no fragility curves: --format csv, xlsx or pelicun "
            "writes its pieces"
        )
    tabulated = str(curves.attrs.get("form")) in TABULATED and "probability" in curves
    if not tabulated and ("median" not in curves or "dispersion" not in curves):
        raise StudyError(f"{path}: holds no fragility curves (median and dispersion, or probability on level)")
    if not curves.attrs.get("im"):
        curves = curves.assign_attrs(im=im)
    if len(floors) == 1:  # (results of one floor have no such dimension, but a format may need the floor)
        curves = curves.assign_coords(floor=floors[0])
    curves = _modelled(curves, path, modelling)
    if model is None:
        return curves
    if "model" not in curves.dims:
        raise StudyError(f"--model {model}: {path} does not tell laws apart")
    return curves.isel(model=laws_of(curves, model, path))


def _modelled(curves: xr.Dataset, path: Path, asked: bool) -> xr.Dataset:
    """Return curves whose dispersions include the modelling uncertainty, if requested; rates are as they are."""
    beta = float(curves.attrs.get(MODELLING, 0.0))
    if asked and beta == 0.0:
        raise StudyError(
            f"--with-modelling: the study of {path} has no modelling uncertainty (modelling_dispersion = 0)"
        )
    if "median" not in curves or MODELLING not in curves.attrs:
        return curves
    plain = curves.assign_attrs({MODELLING: 0.0})
    held = (with_modelling(plain, beta) if asked else plain).assign({MODELLING: beta if asked else 0.0})
    of_rates = beta if curves.attrs.get("modelling", MEAN) == MEAN else 0.0
    if "rate" not in curves or of_rates == float(held[MODELLING]):
        return held
    return held.assign({f"rate_{MODELLING}": of_rates})


def laws_of(results: xr.Dataset, model: str, path: Path) -> Index:
    """Return the positions of the laws that a label or a short name selects; StudyError if there is none."""
    labels = [str(label) for label in results["model"].values]
    laws = [str(law) for law in results["law"].values] if "law" in results.coords else []
    chosen = np.flatnonzero([label == model for label in labels] if model in labels else [law == model for law in laws])
    if not chosen.size:
        near = difflib.get_close_matches(model, [*labels, *dict.fromkeys(laws)], n=1, cutoff=0.4)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise StudyError(f"--model {model}: {path} holds {', '.join(map(repr, labels)):.300}{hint}")
    return chosen


def _of_all_samples(stored: xr.Dataset) -> xr.Dataset:
    """Return the pooled curves of an uncertainty study, which are of all samples together."""
    own_curves = [
        name
        for name, variable in stored.data_vars.items()
        if {"sample", "motion"} & {*variable.dims} or "level" in variable.dims
    ]
    rest = stored.drop_vars(own_curves)
    law = rest.coords.get("law")
    if law is not None and "sample" in law.dims and bool((law == law.isel(sample=0)).all()):
        rest = rest.assign_coords(law=law.isel(sample=0, drop=True))  # one law for all samples
    return rest.drop_vars([name for name, coordinate in rest.coords.items() if "sample" in coordinate.dims])


def _floors(stored: xr.Dataset) -> list[str]:
    """Return the floors of the motions, if results are not separated by floor."""
    if "floor" not in stored.coords or stored["floor"].dims != ("motion",):
        return []
    return sorted({str(floor) for floor in stored["floor"].values})


def kind_of(path: Path) -> str:
    """Return the kind of study of a result file; empty if it has none."""
    with reading(path), opened(path) as whole:
        return str(whole.attrs.get("kind", ""))


def guessed_lines(curves: xr.Dataset) -> list[str]:
    """A line with the number of curves of separated data, which other programs cannot recognise; or none."""
    status = curves["status"].values if "status" in curves else np.empty(0)
    number = int((status == SEPARATED).sum())
    if not number:
        return []
    return [f"{number:,} of {status.size:,} curves are of separated data: their dispersions are guesses"]


def missing_lines(written: Written) -> list[str]:
    """A line with the reason for each curve without an estimate, or one line for more than `MOST_NAMED` of a reason."""
    by_reason: dict[str, list[str]] = {}
    for name, reason in written.missing.items():
        by_reason.setdefault(reason, []).append(name)
    lines = []
    for reason, names in by_reason.items():
        if len(names) <= MOST_NAMED:
            lines += [f"no estimate ({reason}): {name}" for name in names]
        else:
            more = f"{len(names) - NAMED:,} more"
            lines.append(f"no estimate ({reason}) of {len(names):,}: {', '.join(names[:NAMED])} and {more}")
    return lines


def write_curves(curves: xr.Dataset, folder: Path, format_: CurveFormat) -> Written:
    """Write curves into a folder, made if missing, from which an earlier export in this format is removed."""
    write, name, names = _WRITERS[format_]
    try:
        with own_files(folder, f"export {format_}", names):
            return write(curves, folder / name)
    except (TypeError, ValueError) as error:
        if isinstance(error, StudyError):
            raise
        raise StudyError(str(error) if isinstance(error, ExchangeError) else f"no curves to export: {error}") from None
