"""Comparisons of fragility curves: ratios to published medians, and the regression of medians on block sizes."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...core import checks
from ...core.units import DIMENSIONLESS
from ...core.wording import given_percent
from ..fitting.bootstrap import percentile_interval
from ..runs.provenance import provenance_from

AGREES, HIGHER, LOWER, OPEN = "agrees", "higher", "lower", "open"
"""The fitted median against the published one: within the margin; above it; below it; the interval does not decide."""
MARGIN = 0.15
TERM = {"units": DIMENSIONLESS, "long_name": "term of the regression"}


def median_ratio(curves: xr.Dataset, published: xr.Dataset, margin: float = MARGIN) -> xr.Dataset:
    """Ratios of fitted medians to published ones, block by block, and which of the two is higher.

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
        On the dimensions of the curves: ratio, lower, upper, and verdict: the fitted median ``agrees`` (the whole
        interval lies within the margin), is ``higher`` (the interval lies above 1: more shaking than was published) or
        ``lower`` (below 1), or that is ``open`` (it holds 1 and more than the margin, or there is no estimate).  A
        difference says that models, motions or data differ, and not which of the two is conservative.

    Raises
    ------
    ValueError
        Measures or units that differ, no block in common.

    Examples
    --------
    >>> import xarray as xr
    >>> ends = {"median": 2.0, "median_lower": 1.6, "median_upper": 2.4}
    >>> found = xr.Dataset({name: ("block", [value], {"units": "m s-1"}) for name, value in ends.items()},
    ...                    {"block": ["shelf"]}, {"im": "pgv"})
    >>> known = xr.Dataset({"median": ("block", [1.0], {"units": "m s-1"})}, {"block": ["shelf"]}, {"im": "pgv"})
    >>> median_ratio(found, known)["verdict"].values.tolist()
    ['higher']
    """
    width = checks.number("margin", margin, above=0.0, below=1.0)
    for name, one, other in (
        ("measure", curves.attrs.get("im"), published.attrs.get("im")),
        ("unit", curves["median"].attrs.get("units"), published["median"].attrs.get("units")),
    ):
        if one != other:
            raise ValueError(f"published medians must be of the {name} of the curves, {one!r}, got {other!r}")
    blocks = [block for block in curves["block"].values if block in published["block"].values]
    if not blocks:
        raise ValueError("curves and published medians must have blocks in common, got none")
    here = curves.sel(block=blocks)
    base = (
        published["median"]
        .sel(block=blocks)
        .drop_vars([name for name in published["median"].coords if name != "block"], errors="ignore")
    )
    ratio, lower, upper = (here[name] / base for name in ("median", "median_lower", "median_upper"))
    least, most = 1.0 / (1.0 + width), 1.0 + width
    conditions: list[tuple[Any, str]] = [
        (np.isnan(lower) | np.isnan(upper), OPEN),
        ((lower >= least) & (upper <= most), AGREES),
        (lower > 1.0, HIGHER),
        (upper < 1.0, LOWER),
    ]
    verdict: NDArray[np.object_] = np.full(ratio.shape, OPEN, dtype=object)
    decided = np.zeros(ratio.shape, dtype=bool)
    for condition, word in conditions:
        now = condition.transpose(*ratio.dims).values & ~decided
        verdict[now] = word
        decided |= now
    text = "median over the published one"
    found = {
        "ratio": (ratio, text),
        "lower": (lower, f"lower end of the interval of the {text}"),
        "upper": (upper, f"upper end of the interval of the {text}"),
        "verdict": (ratio.copy(data=verdict), "fitted median against the published one: agrees, higher, lower or open"),
    }
    return xr.Dataset(
        {name: one.assign_attrs(units=DIMENSIONLESS, long_name=words) for name, (one, words) in found.items()},
        attrs={
            "title": "Medians against published ones",
            **provenance_from("ratio of medians", {"margin": width}, curves=curves, published=published),
            "margin": width,
        },
    )


def size_regression(curves: xr.Dataset, confidence: float = 0.95) -> xr.Dataset:
    """Fit the law ln(median) = a + b ln(width) + c ln(height) to the medians of blocks, by least squares.

    Parameters
    ----------
    curves : xarray.Dataset
        Curves on block with the coordinates width and height (m), and any other dimensions; with `median_sample` on
        replicate where intervals are wanted.
    confidence : float
        Of the intervals, between 0 and 1.

    Returns
    -------
    xarray.Dataset
        On term (constant, width, height) and the dimensions left: coefficient (the constant is the ln of the median, in
        the unit of the levels, of a block of 1 m x 1 m), with coefficient_lower and coefficient_upper from the
        bootstrap replicates, if any; scatter, the root mean square of the residuals.  NaN where a block has no
        median.

    Raises
    ------
    ValueError
        Fewer than four blocks, or sizes that do not tell width from height.

    Notes
    -----
    A replicate is one resample of the motions for all blocks, so the intervals account for the motions that all blocks
    share.  The scatter measures how far the law itself fails to hold.

    Examples
    --------
    >>> import numpy as np
    >>> import xarray as xr
    >>> B, H = np.array([0.3, 0.4, 0.5, 0.6]), np.array([1.0, 2.0, 1.5, 0.9])
    >>> curves = xr.Dataset({"median": ("block", 3.0 * B**1.5 / H)}, {"width": ("block", B), "height": ("block", H)})
    >>> size_regression(curves)["coefficient"].values.round(6).tolist()
    [1.098612, 1.5, -1.0]
    """
    level = checks.number("confidence", confidence, above=0.0, below=1.0)
    n = curves.sizes.get("block", 0)
    if n < 4:
        raise ValueError(f"a law in two sizes needs at least 4 blocks, got {n}")
    terms = np.stack([np.ones(n), np.log(curves["width"].values), np.log(curves["height"].values)], axis=1)
    if np.linalg.matrix_rank(terms, 1e-6) < 3:
        raise ValueError("sizes of the blocks must tell width from height, got the same proportion or size throughout")
    solve = xr.DataArray(
        np.linalg.pinv(terms),
        {"term": ("term", np.array(["constant", "width", "height"], dtype=object), TERM)},
        ("term", "block"),
    )
    plain = curves["median"].drop_vars([name for name in curves["median"].coords if "block" in curves[name].dims])
    logs = plain.copy(data=np.log(plain.values))
    coefficient = xr.dot(solve, logs, dim="block")
    fitted = xr.dot(xr.DataArray(terms, dims=("block", "term")), coefficient.drop_vars("term"), dim="term")
    scatter = np.sqrt(((logs - fitted) ** 2).mean("block", skipna=False))
    found: dict[str, tuple[xr.DataArray, str]] = {
        "coefficient": (coefficient, "coefficient of ln size in ln median"),
        "scatter": (scatter, "root mean square of the residuals of ln median"),
    }
    if "median_sample" in curves:
        sample = curves["median_sample"]
        sample = sample.drop_vars([name for name in sample.coords if "block" in curves[name].dims])
        drawn = xr.dot(solve, sample.copy(data=np.log(sample.values)), dim="block")
        drawn = drawn.transpose(*coefficient.dims, "replicate")
        ends = percentile_interval(drawn.values, level)
        for end, values in (("lower", ends.lower), ("upper", ends.upper)):
            text = f"{end} end of the {given_percent(level)} interval of the coefficient"
            found[f"coefficient_{end}"] = coefficient.copy(data=values), text
    return xr.Dataset(
        {name: one.assign_attrs(units=DIMENSIONLESS, long_name=text) for name, (one, text) in found.items()},
        attrs={
            "title": "Medians by block size",
            **provenance_from("regression of medians on sizes", {"confidence": level}, curves=curves),
            "confidence": level,
        },
    )
