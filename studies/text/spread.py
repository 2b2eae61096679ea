"""Ranges in words: of annual rates over branches, and of values if all capacities are wrong by the same factor."""

import numpy as np
import xarray as xr

from ...core.wording import two_digits
from ...fragility.risk.modelling import LOWER, RANGE, UPPER, capacity_factors
from .words import floor_name

SOURCES = {
    "models": ("law", "the choice of law"),
    "motions": ("motions", "the choice of motions"),
    "hazard": ("hazard", "the hazard curve"),
    "modelling": ("modelling", "the modelling uncertainty"),
    "number of motions": ("few motions", "the number of motions"),
    "together": ("together", "the interaction of these"),
}
"""Sources of the spread of a rate, in headings of tables and in words."""
OUTER = (0.05, 0.95)
"""Fractiles at the ends of the stated range."""
MODEL_RANGE = "model range"
"""Heading of the column of ranges if all capacities are wrong by the same factor, and their name in sentences."""


def has_model_range(results: xr.Dataset, name: str) -> bool:
    """Return True if any value has a range."""
    return f"{name}{LOWER}" in results and bool(np.isfinite(results[f"{name}{LOWER}"]).any())


def of_what(results: xr.Dataset) -> str:
    """Return the description of a model range, for a caption; '' for results without one."""
    if RANGE not in results.attrs:
        return ""
    low, high = capacity_factors(float(results.attrs[RANGE]))
    return f"{MODEL_RANGE}: if all capacities are wrong by the same factor, {two_digits(low)} to {two_digits(high)}"


def model_note(results: xr.Dataset) -> str:
    """Return the sentence of a note on model ranges; '' for results without."""
    return f"{of_what(results)[:1].upper()}{of_what(results)[1:]}." if RANGE in results.attrs else ""


def branch_names(results: xr.Dataset) -> list[str]:
    """Return the branches in words: law, motions and hazard of each."""
    named = (results[f"branch_{of}"].values for of in ("model", "motions", "hazard"))
    return [" / ".join(map(str, branch)) for branch in zip(*named, strict=True)]


def sample_range(results: xr.Dataset, quantity: str = "sample_median") -> tuple[float, float]:
    """Return the 5 and 95 % quantiles of a quantity over samples, infinite above all levels; NaN if none has it."""
    values = results[quantity].values.astype(float)
    known = values[~np.isnan(values)]
    if not known.size:
        return np.nan, np.nan
    low, high = np.quantile(known, OUTER, method="inverted_cdf").tolist()
    return low, high


def sources(results: xr.Dataset) -> list[tuple[str, float]]:
    """Return the sources of the spread of one block's rate in words with their shares, the largest first."""
    shares = results["epistemic_spread"].values
    names = [str(value) for value in results["epistemic_source"].values]
    shares_of = [(SOURCES[name][1], float(share)) for name, share in zip(names, shares, strict=True) if share > 0.0]
    return sorted(shares_of, key=lambda pair: -pair[1])


def rates_of_building(results: xr.Dataset) -> xr.Dataset:
    """Return the rates over branches of a performance study in the form of blocks: any fall by place, and pieces."""
    item = _as_blocks(results, "rate", "block")
    item = item.isel(block=np.argsort(-item["epistemic_rate"].values, kind="stable"))
    item = item.isel(block=np.flatnonzero(item["epistemic_rate"].values > 0.0))
    place = _as_blocks(results, "any_rate", "place")
    names = [f"anything, {floor_name(str(value).removeprefix('floor '))}" for value in place["block"].values[1:]]
    place = place.assign_coords(block=["anything in the building", *names])
    place = place.isel(block=[0] if len(names) == 1 else slice(None))
    return xr.concat([place, item], "block").assign_attrs(results.attrs)


def building_spread(results: xr.Dataset, quantity: str, place: str) -> xr.Dataset:
    """Return an annual value of a place over all branches as the rate of one block."""
    return _as_blocks(results, quantity, "place").sel(block=place)


def rates_of_consequences(results: xr.Dataset, place: str) -> xr.Dataset | None:
    """Return the rates of the consequences in a place over all branches in the form of blocks, most frequent first."""
    if "epistemic_consequence_rate" not in results:
        return None
    as_blocks = _as_blocks(results.sel(place=place), "consequence_rate", "consequence")
    as_blocks = as_blocks.isel(block=np.argsort(-as_blocks["epistemic_rate"].values, kind="stable"))
    as_blocks = as_blocks.isel(block=np.flatnonzero(as_blocks["epistemic_rate"].values > 0.0))
    return as_blocks.assign_attrs(results.attrs) if as_blocks.sizes["block"] else None


def _as_blocks(results: xr.Dataset, quantity: str, dim: str) -> xr.Dataset:
    names = {
        f"epistemic_{quantity}": "epistemic_rate",
        f"epistemic_{quantity}_fractile": "epistemic_rate_fractile",
        f"epistemic_{quantity}_spread": "epistemic_spread",
        f"branch_{quantity}": "branch_rate",
        **{f"epistemic_{quantity}{end}": f"epistemic_rate{end}" for end in (LOWER, UPPER)},
    }
    names = {old: new for old, new in names.items() if old in results}
    renamed = results[list(names)].rename(names)
    kept = [
        dim,
        "epistemic_fractile",
        "epistemic_source",
        *(str(coordinate) for coordinate in renamed.coords if "branch" in str(coordinate)),
    ]
    return renamed.drop_vars([name for name in renamed.coords if name not in kept]).rename({dim: "block"})
