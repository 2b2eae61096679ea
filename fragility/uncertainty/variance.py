"""Shares of variance: the parts of the total variance due to motion, law and parameters, and to interactions."""

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np
import xarray as xr

from ...core import checks
from ...core.elementary import log
from ...core.units import DIMENSIONLESS, described, provenance
from ..efficiency.capacity import overturning_capacity
from ..fitting.states import OVERTURNED, State
from ..numerics.slabs import gathered
from ..runs.provenance import configuration_of

MOST_DIMS = 8
BETWEEN = " × "


def variance_shares(
    values: xr.DataArray, dims: Sequence[str], weights: Mapping[str, Sequence[float]] | None = None
) -> xr.Dataset:
    """Return the shares of several dimensions in the variance of values, by the law of total variance.

    Parameters
    ----------
    values : xarray.DataArray
        On `dims` and any others, every combination present: flags (whose variance is p (1 - p)), ln capacities,
        medians ….
    dims : sequence of str
        Dimensions between which the variance is shared, such as ``("motion", "model", "sample")``; the others are kept.
    weights : mapping of str to sequence of float, optional
        Weights of the entries along a dimension, >= 0, such as degrees of belief in laws; equal if not given.

    Returns
    -------
    xarray.Dataset
        On component (each dimension, each pair, each triple …, ``motion × model``) and the dimensions left: `variance`
        and `share`, which sum to the total and to 1. On factor (each dimension): `total_share`, the share of all
        components with this dimension. Also `nested_share`, its contribution in the order of `dims`, which sum to 1 as
        well. Further `total_variance`. If the total variance is 0 the shares are NaN.

    Notes
    -----
    V(S) = Var E[values | dimensions in S], under the product of the weights. The component of S is V(S) less the
    components of all its parts (a functional analysis of variance of a full factorial). The contribution of dimension k
    in the given order is V(1 … k) - V(1 … k-1): E[Var] inside, Var[E] outside.

    Shares refer to the given entries. If these are a sample (motions, samples of inputs), a main effect includes a part
    of the interactions, 1/n for n entries along the other dimensions. With few motions the law's share is too large.

    References
    ----------
    Saltelli, A. et al. (2008). Global sensitivity analysis: the primer. Wiley, section 4.5.

    Examples
    --------
    >>> import xarray as xr
    >>> additive = xr.DataArray([[0.0, 1.0], [3.0, 4.0]], dims=("motion", "model"))
    >>> variance_shares(additive, ("motion", "model")).share.values.round(12).tolist()
    [0.9, 0.1, 0.0]
    """
    if not isinstance(values, xr.DataArray):
        raise TypeError(f"values must be a labelled array, got {checks.kind(values)}")
    factors = [dims] if isinstance(dims, str) else [str(dim) for dim in checks.sequence("dims", dims)]
    if not 1 <= len(factors) <= MOST_DIMS or len(set(factors)) != len(factors) or not {*factors} <= {*values.dims}:
        raise ValueError(f"dims must be 1 to {MOST_DIMS} different ones of {values.dims}, got {factors!r:.80}")
    if values.dtype.kind not in "biuf":
        raise TypeError(f"values must be numbers or flags, got {values.dtype}")
    numbers = values.astype(float)
    missing = int((~np.isfinite(numbers)).sum())
    if numbers.size == 0 or missing:
        raise ValueError(f"values must be finite and present for every combination, got {missing} that are not")
    shares = _weights(numbers, factors, weights or {})

    def mean(array: xr.DataArray, over: Sequence[str]) -> xr.DataArray:
        for dim in over:
            array = (array * shares[dim]).sum(dim, skipna=False)
        return array

    # about the mean, because rounding would hide small variances of large values
    centred = numbers.drop_vars(
        [name for name, coordinate in numbers.coords.items() if {*factors} & {*coordinate.dims}]
    )
    centred = centred - mean(centred, factors)
    subsets = [part for size in range(1, len(factors) + 1) for part in combinations(factors, size)]
    explained: dict[tuple[str, ...], xr.DataArray] = {(): 0.0 * mean(centred, factors)}
    components: dict[tuple[str, ...], xr.DataArray] = {}
    for part in subsets:
        expected = mean(centred, [dim for dim in factors if dim not in part])
        explained[part] = mean(expected**2, part)
        components[part] = explained[part] - sum(
            component for term, component in components.items() if {*term} < {*part}
        )
    total = explained[tuple(factors)]
    names = [BETWEEN.join(part) for part in subsets]
    variance = xr.concat([components[part] for part in subsets], _index("component", names), coords="minimal")
    nested = [explained[tuple(factors[: k + 1])] - explained[tuple(factors[:k])] for k in range(len(factors))]
    taking_part = [total - explained[tuple(factor for factor in factors if factor != dim)] for dim in factors]
    # (rounding may leave a variance of values that are all the same)
    differ = numbers.min(factors) < numbers.max(factors)
    whole = total.where(differ & (total > 0.0))
    factor = _index("factor", factors)
    of = str(values.attrs.get("long_name", values.name or ""))
    configuration = {
        "analysis": "shares of variance",
        "of": of,
        "dims": factors,
        "weights": {dim: share.values.tolist() for dim, share in shares.items()},
        "values": configuration_of(values),
    }
    units = str(values.attrs.get("units", DIMENSIONLESS))
    squared = DIMENSIONLESS if units == DIMENSIONLESS else f"({units})2"
    total_share, nested_share = (xr.concat(parts, factor, coords="minimal") / whole for parts in (taking_part, nested))
    text = "share of the total variance"
    variables = {
        "variance": (variance, squared, "variance by component"),
        "share": (variance / whole, DIMENSIONLESS, f"{text} by component"),
        "total_share": (total_share, DIMENSIONLESS, f"{text} in which the factor takes part"),
        "nested_share": (nested_share, DIMENSIONLESS, f"{text} that the factor adds to those before it"),
        "total_variance": (total, squared, "total variance"),
    }
    return xr.Dataset(
        {name: variable.assign_attrs(units=unit, long_name=text) for name, (variable, unit, text) in variables.items()},
        attrs={"title": "Shares of variance", **provenance(configuration), "of": of},
    )


def _index(name: str, labels: Sequence[str]) -> xr.DataArray:
    attributes = described(f"{name} of the variance")
    return xr.DataArray(np.array(labels, dtype=object), dims=name, name=name, attrs=attributes)


def _weights(
    values: xr.DataArray, factors: Sequence[str], given: Mapping[str, Sequence[float]]
) -> dict[str, xr.DataArray]:
    """The weights along every factor, with sum 1."""
    unknown = [name for name in given if name not in factors]
    if unknown:
        raise ValueError(f"weights must be of {', '.join(factors)}, got {unknown[0]!r}")
    shares = {}
    for dim in factors:
        n = values.sizes[dim]
        weight = checks.finite_array(f"weights of {dim}", given[dim]) if dim in given else np.ones(n)
        if weight.size != n or weight.min() < 0.0 or weight.sum() == 0.0:
            raise ValueError(f"weights of {dim} must be {n} numbers >= 0, not all 0, got {weight.tolist()!r:.80}")
        shares[dim] = xr.DataArray(weight / weight.sum(), dims=dim)
    return shares


def capacity_variance_shares(
    runs: xr.Dataset,
    dims: Sequence[str] = ("motion", "model", "sample"),
    weights: Mapping[str, Sequence[float]] | None = None,
    state: State = OVERTURNED,
) -> xr.Dataset:
    """Return shares in the variance of ln capacity, over the motions whose capacities are all known.

    Parameters
    ----------
    runs : xarray.Dataset
        Runs on levels, as `toppling.ida` or `uncertain_ida` return them.
    dims : sequence of str
        As for `variance_shares`; dimensions that the runs do not have are left out.
    weights : mapping, optional
        As for `variance_shares`; not of motion, because some motions may be left out.
    state : str or float
        The limit state of the capacities, see `reached`.

    Returns
    -------
    xarray.Dataset
        As `variance_shares` of ln of the geometric mean of the two levels between which a capacity lies. `share_known`
        is the share of capacities of all motions that lie between two levels; `motions` and `motions_used` are numbers.
        `rounding_share` is the part of the total variance that the distance of the levels could explain (the variance
        of uniform errors is width²/12).

    Notes
    -----
    A capacity below the lowest or above the highest level is not known, and a full factorial admits no missing values.
    A motion with one such capacity is left out, with all its blocks, laws and samples. If `share_known` is not close to
    1, the strong and the weak motions are missing, and the share of the motions is too small. In that case extend the
    levels, or compute the shares of the flags themselves level by level, ``variance_shares(runs["overturned"], dims)``.
    No motion is then left out.

    Examples
    --------
    >>> import numpy as np
    >>> import toppling as tp
    >>> shakes = tp.motions.CloughPenzien(duration=10.0, dt=0.01).sample(10)
    >>> laws = [tp.HousnerImpact(), tp.EnergyConsistent(), tp.DiscreteDamping()]
    >>> runs = tp.ida(tp.catalogue["bookcase-5-shelf"], laws, shakes, np.geomspace(0.5, 40.0, 30))
    >>> shares = capacity_variance_shares(runs)
    >>> shares.component.values.tolist(), float(shares.share.sum().round(12))
    (['motion', 'model', 'motion × model'], 1.0)
    """
    capacity = gathered(lambda part: overturning_capacity(part, state), runs, ("block", "model", "sample"))
    known = capacity["capacity"].notnull()
    every = known.all([dim for dim in known.dims if dim != "motion"])
    used = np.flatnonzero(every.values)
    if used.size < 2:
        raise ValueError(
            f"capacities must be known for at least 2 motions throughout, got {used.size} of {every.size} "
            f"({100.0 * float(known.mean()):.0f} % of all capacities lie between two levels): extend the levels"
        )
    some = capacity.isel(motion=used)
    logs = some["capacity"].copy(data=log(some["capacity"].values))
    logs.attrs = described("ln capacity")
    if "configuration" in runs.attrs:
        logs.attrs["configuration"] = runs.attrs["configuration"]
    factors = [dim for dim in ([dims] if isinstance(dims, str) else dims) if dim in logs.dims]
    shares = variance_shares(logs, factors, weights)
    widths = some["upper"].copy(data=log(some["upper"].values / some["lower"].values))
    rounding = (widths**2 / 12.0).mean(factors)
    total = shares["total_variance"].where(shares["share"].notnull().any("component"))  # (where there is any)
    extra: dict[str, tuple[Any, str]] = {
        "share_known": (known.mean([*factors]), "share of capacities that lie between two levels"),
        "rounding_share": (rounding / total, "share that the distance of the levels could be"),
        "motions": (xr.DataArray(every.size), "motions"),
        "motions_used": (xr.DataArray(used.size), "motions whose capacities are all known"),
    }
    for name, (variable, text) in extra.items():
        shares[name] = variable.assign_attrs(units=DIMENSIONLESS, long_name=text)
    return shares
