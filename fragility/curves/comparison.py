"""Ratios of fitted medians to published medians."""

import numpy as np
import xarray as xr

from ...core import checks
from ...core.parameters import CHANCE
from ...core.units import DIMENSIONLESS, of_end
from ..runs.provenance import provenance_from

AGREES, HIGHER, LOWER, OPEN = "agrees", "higher", "lower", "open"
"""The fitted median against the published one: within the margin; above it; below it; the interval does not decide."""
MARGIN = 0.15


def median_ratio(curves: xr.Dataset, published: xr.Dataset, margin: float = MARGIN) -> xr.Dataset:
    """Compare fitted medians with published medians, block by block.

    Parameters
    ----------
    curves : xarray.Dataset
        Fitted curves on (block, …) with the median's interval, as `fit_fragility` returns them.
    published : xarray.Dataset
        Medians on block, in the same measure, as `toppling.fragility.curves.published` has them.
    margin : float
        Above 0 to below 1: ratios from 1/(1 + margin) to 1 + margin count as agreement.

    Returns
    -------
    xarray.Dataset
        On the dimensions of the curves: ratio, lower, upper, and `verdict` on the fitted median. It is ``agrees`` if
        the whole interval lies within the margin. It is ``higher`` if the interval lies above 1 (a higher intensity
        than published), and ``lower`` below 1. It is ``open`` if the interval contains 1 and exceeds the margin, or
        without an estimate. A difference shows that models, motions or data differ, not that one of the two is
        conservative.

    Examples
    --------
    >>> import xarray as xr
    >>> ends = {"median": 2.0, "median_lower": 1.6, "median_upper": 2.4}
    >>> curves = xr.Dataset({name: ("block", [value], {"units": "m s-1"}) for name, value in ends.items()},
    ...                     {"block": ["shelf"]}, {"im": "pgv"})
    >>> known = xr.Dataset({"median": ("block", [1.0], {"units": "m s-1"})}, {"block": ["shelf"]}, {"im": "pgv"})
    >>> median_ratio(curves, known)["verdict"].values.tolist()
    ['higher']
    """
    width = CHANCE.number("margin", margin)
    checks.plain("curves", curves)
    checks.plain("published medians", published)
    for name, medians in (("curves", curves), ("published medians", published)):
        if not isinstance(medians, xr.Dataset) or not {"median", "block"} <= {*medians.variables}:
            raise ValueError(f"{name} must be a dataset with median on block, got {checks.kind(medians)} without it")
        if "block" in medians.indexes and not medians.indexes["block"].is_unique:
            raise ValueError(f"{name} must have blocks of unique labels")
    for name, expected, given in (
        ("measure", curves.attrs.get("im"), published.attrs.get("im")),
        ("unit", curves["median"].attrs.get("units"), published["median"].attrs.get("units")),
    ):
        if expected != given:
            raise ValueError(f"published medians must be of the {name} of the curves, {expected!r}, got {given!r}")
    for dim in {*curves["median"].dims} & {*published["median"].dims} - {"block"}:
        if not np.array_equal(curves[dim].values, published[dim].values):
            raise ValueError(f"published medians must have the {dim}s of the curves, or none")
    blocks = [block for block in curves["block"].values if block in published["block"].values]
    if not blocks:
        raise ValueError("curves and published medians must have blocks in common, got none")
    compared = curves.sel(block=blocks)
    base = (
        published["median"]
        .sel(block=blocks)
        .drop_vars([name for name in published["median"].coords if name != "block"], errors="ignore")
    )
    ratio, lower, upper = (compared[name] / base for name in ("median", "median_lower", "median_upper"))
    least, most = 1.0 / (1.0 + width), 1.0 + width
    low, high = (end.transpose(*ratio.dims).values for end in (lower, upper))
    conditions = [np.isnan(low) | np.isnan(high), (low >= least) & (high <= most), low > 1.0, high < 1.0]
    verdict = np.select(conditions, [OPEN, AGREES, HIGHER, LOWER], OPEN).astype(object)
    text = "median over the published one"
    results = {
        "ratio": (ratio, text),
        "lower": (lower, of_end("lower", text)),
        "upper": (upper, of_end("upper", text)),
        "verdict": (ratio.copy(data=verdict), "fitted median against the published one: agrees, higher, lower or open"),
    }
    return xr.Dataset(
        {name: data.assign_attrs(units=DIMENSIONLESS, long_name=words) for name, (data, words) in results.items()},
        attrs={
            "title": "Medians against published ones",
            **provenance_from("ratio of medians", {"margin": width}, curves=curves, published=published),
            "margin": width,
        },
    )
