"""The parts of results that a figure draws: one block, law or floor by its label, and the laws with their look."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import xarray as xr

from ...core import checks
from ...core.wording import counted
from ...fragility.runs.provenance import number_of_motions
from ...motions.arrays import POLARITY
from ..text.words import block_title, floor_name, law_names as names_of_laws
from . import axes


class DrawnLaw(NamedTuple):
    """A law to be drawn: its label, its part of the results, and its look, which is the same in every panel."""

    label: str
    results: xr.Dataset
    colour: str
    marker: str
    line: Any


def laws(results: xr.Dataset, model: str | None = None, color: str | None = None) -> list[DrawnLaw]:
    """Return every law of some results, or only the law labelled `model`, each with the look that it has among all."""
    checks.not_empty("results", results, "model")
    names = labels(results, "model")
    if model is not None:
        checks.choice("model", model, names)
    chosen = [
        DrawnLaw(text, results.isel(model=i) if "model" in results.dims else results, color or colour, marker, line)
        for i, (text, (colour, marker, line)) in enumerate(zip(law_names(names), looks(results), strict=True))
        if model is None or names[i] == model
    ]
    if color is not None and len(chosen) > 1:
        raise ValueError(f"color must be of one law, got {len(chosen)} laws: say which model")
    return chosen


def law_names(labels: Sequence[str]) -> list[str]:
    """Return laws as `text.words.law_names`, with e_R as a symbol."""
    return [*map(axes.model_name, names_of_laws(labels))]


def looks(results: xr.Dataset) -> list[tuple[str, str, Any]]:
    """Return colour, marker and line of each model: the first Housner black and dashed, the others in order."""
    names = results.get("law")
    if names is None or "model" not in names.dims:
        along = [""] * len(labels(results, "model"))
    else:
        # (an uncertain law differs from sample to sample: then no model is the reference)
        along = [str(law) for law in names.isel({dim: 0 for dim in names.dims if dim != "model"}).values]
    chosen: list[tuple[str, str, Any]] = []
    for law in along:
        if law == "housner" and axes.REFERENCE not in chosen:
            chosen.append(axes.REFERENCE)
        else:
            chosen.append(axes.look(sum(look != axes.REFERENCE for look in chosen)))
    return chosen


def labels(results: xr.Dataset, dim: str) -> list[str]:
    """Return the labels along a dimension; without the dimension one label, the coordinate's or an empty one."""
    if dim not in results.dims:
        return [str(results[dim].item())] if dim in results.coords and results[dim].ndim == 0 else [""]
    return [str(value) for value in results[dim].values]


def place(block: str, floor: int | str | None) -> str:
    """Return the name of a block, if it has one, and its floor, if results have floors."""
    return ", ".join(filter(None, (block_title(block), "" if floor is None else floor_name(floor))))


def motions(results: xr.Dataset, floors: int = 1) -> str:
    """Return the number of motions on each of some floors in words, with their reversal if they were run both ways."""
    ways = ", each also reversed" if POLARITY in results.coords else ""
    return f"{counted(number_of_motions(results) // floors, 'motion')}{ways}{' per floor' if floors > 1 else ''}"


def floors(results: xr.Dataset) -> list[int | str | None]:
    """Return the floors of results; None alone if the results do not distinguish floors."""
    return list(results["floor"].values.tolist()) if "floor" in results.dims else [None]


def single(results: xr.Dataset, **chosen: str | int | None) -> xr.Dataset:
    """Return the results of one block, law or floor: of the label given for each dimension, or of its only label."""
    for dim, label in chosen.items():
        if dim not in results.dims:
            continue
        checks.not_empty("results", results, dim)
        names = labels(results, dim)
        if label is None:
            if len(names) > 1:
                few = ", ".join(names[:8]) + (", …" if len(names) > 8 else "")
                raise ValueError(f"results are of several {dim}s, say which: {few}")
            results = results.isel({dim: 0})
        else:
            results = results.isel({dim: names.index(checks.choice(dim, str(label), names))})
    return results
