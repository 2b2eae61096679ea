"""Indices of Sobol' (by SALib) and the tornado of any function of random inputs."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import xarray as xr

from ...core import checks
from ...core.aliases import Array
from ...core.parameters import CHANCE, CONFIDENCE, USUAL_CONFIDENCE
from ...core.streams import stream
from ...core.units import DIMENSIONLESS, ENDS, described, of_end, provenance
from ...core.wording import given_percent
from ..runs.provenance import configuration_of
from .distributions import Categorical
from .inputs import RandomInputs

Response = Callable[[xr.Dataset], Any]
"""Function of samples of inputs that returns numbers on sample and any other dimensions."""


def sobol_indices(
    inputs: RandomInputs,
    function: Response,
    n: int = 256,
    *,
    confidence: float = USUAL_CONFIDENCE,
    replicates: int = 200,
    seed: int = 0,
) -> xr.Dataset:
    """Sobol' indices: shares of the variance of a function that its inputs explain alone and with others.

    Parameters
    ----------
    inputs : RandomInputs
        Independent inputs; choices among them count as one input each.
    function : callable
        A function of samples, a dataset on ``sample`` as `RandomInputs.sample` returns it. It returns numbers on sample
        and any other dimensions. `overturning_response` returns such a function.
    n : int
        Base samples, a power of 2, >= 2: the function is evaluated at n (d + 2) samples of d inputs.
    confidence : float
        Confidence level of the intervals, between 0 and 1.
    replicates : int
        Number of bootstrap samples for the intervals, >= 2.
    seed : int
        Seed of the samples and the bootstrap.

    Returns
    -------
    xarray.Dataset
        On input and the function's other dimensions: `first` (alone) and `total` (with all others), each with its
        interval, `_lower` and `_upper`. `mean` and `variance` of the function. NaN if it does not vary.

    Notes
    -----
    First and total order by the estimators of Saltelli et al. (2010), on scrambled Sobol' points. The indices are
    estimates, and small indices may be below zero. Their intervals are the estimate plus and minus normal quantiles of
    the standard deviation of the bootstrap replicates. For the g-function of Sobol' they contained indices in 89 to 99
    % of repetitions with 64 base samples, and always with 256: then they are too long.

    References
    ----------
    Saltelli, A. et al. (2010). Variance based sensitivity analysis of model output. Computer Physics Communications
    181, 259-270.
    Herman, J. and Usher, W. (2017). SALib: an open-source Python library for sensitivity analysis. Journal of Open
    Source Software 2(9), 97.

    Examples
    --------
    >>> from toppling.fragility import Uniform
    >>> inputs = RandomInputs({"a": Uniform(0.0, 1.0), "b": Uniform(0.0, 2.0)})
    >>> indices = sobol_indices(inputs, lambda sample: sample["a"] + sample["b"], n=512)
    >>> indices.total.values.round(2).tolist()
    [0.2, 0.8]
    """
    from SALib.analyze import sobol as sobol_analysis  # noqa: PLC0415 - loads pandas and matplotlib, seconds of start

    _independent(inputs)
    size, start = checks.count("n", n, at_least=2), checks.count("seed", seed)
    if size & (size - 1):
        raise ValueError(f"n must be a power of 2, got {size}")
    level = CONFIDENCE.number("confidence", confidence)
    times = checks.count("replicates", replicates, at_least=2)
    d = len(inputs.names)
    problem = _problem(inputs)
    points = _points(inputs, size, start)
    values, rest = _evaluate(inputs, function, points)
    shape = (d, values.shape[1])
    indices = {name: np.full(shape, np.nan) for name in ("S1", "S1_conf", "ST", "ST_conf")}
    step = points.shape[0] // size
    base = np.concatenate([values[::step], values[step - 1 :: step]])
    for k in range(values.shape[1]):
        if np.ptp(base[:, k]) == 0.0:
            continue
        result = sobol_analysis.analyze(
            problem, values[:, k], calc_second_order=False, num_resamples=times, conf_level=level, seed=stream(start, 1)
        )
        for name, array in indices.items():
            array[:, k] = result[name]
    variables = {
        **_with_ends("first", indices["S1"], indices["S1_conf"], "first-order Sobol' index", level),
        **_with_ends("total", indices["ST"], indices["ST_conf"], "total-order Sobol' index", level),
    }
    dataset = _dataset(inputs, variables, rest)
    units = str(rest.attrs.get("units", DIMENSIONLESS))
    for name, column, unit, text in (
        ("mean", base.mean(axis=0), units, "mean of the function"),
        ("variance", base.var(axis=0), DIMENSIONLESS if units == DIMENSIONLESS else f"({units})2", "its variance"),
    ):
        dataset[name] = (rest.dims[1:], column.reshape(rest.shape[1:]), described(text, unit))
    options = {"n": size, "samples": points.shape[0], "confidence": level, "replicates": times, "seed": start}
    return dataset.assign_attrs(
        title="Sobol' indices", **_provenance("Sobol' indices", inputs, rest, options), **options
    )


def tornado(inputs: RandomInputs, function: Response, low: float = 0.05, high: float = 0.95) -> xr.Dataset:
    """Evaluate a function with one input at a time at two of its quantiles and all others at their medians.

    Parameters
    ----------
    inputs : RandomInputs
        Independent inputs.
    function : callable
        As for `sobol_indices`; evaluated at one sample and two for each input (for a choice, one for each).
    low, high : float
        Probabilities of the two quantiles, 0 < low < high < 1.

    Returns
    -------
    xarray.Dataset
        On input and the function's other dimensions, in its unit: `low` and `high`, the function at the two quantiles
        (of a choice, its minimum and maximum). `swing` is their absolute difference, and `base` the value at the
        medians (and the likeliest choices).

    Examples
    --------
    >>> from toppling.fragility import Uniform
    >>> inputs = RandomInputs({"a": Uniform(0.0, 1.0), "b": Uniform(0.0, 2.0)})
    >>> tornado(inputs, lambda sample: sample["a"] - sample["b"]).swing.values.round(6).tolist()
    [0.9, 1.8]
    """
    _independent(inputs)
    first = CHANCE.number("low", low)
    last = checks.number("high", high, above=first, below=1.0)
    middle, turns = [], []
    for distribution in inputs.distributions.values():
        if isinstance(distribution, Categorical):
            centres = np.cumsum(distribution.shares) - 0.5 * distribution.shares
            middle.append(float(centres[distribution.shares.argmax()]))
            turns.append(centres.tolist())
        else:
            middle.append(0.5)
            turns.append([first, last])
    points = [middle]
    owner = [-1]
    for i, values_of_input in enumerate(turns):
        for value in values_of_input:
            points.append([*middle[:i], value, *middle[i + 1 :]])
            owner.append(i)
    values, rest = _evaluate(inputs, function, np.array(points))
    ends = np.empty((2, len(turns), values.shape[1]))
    for i, distribution in enumerate(inputs.distributions.values()):
        swing = values[np.array(owner) == i]
        ends[:, i] = (swing.min(axis=0), swing.max(axis=0)) if isinstance(distribution, Categorical) else swing
    variables = {
        "low": (ends[0], f"at the {given_percent(first)} quantile, or the least of a choice"),
        "high": (ends[1], f"at the {given_percent(last)} quantile, or the greatest of a choice"),
        "swing": (np.abs(ends[1] - ends[0]), "absolute difference of the two"),
    }
    units = str(rest.attrs.get("units", DIMENSIONLESS))
    dataset = _dataset(inputs, variables, rest, units)
    base = values[0].reshape(rest.shape[1:])
    dataset["base"] = (rest.dims[1:], base, described("at the medians of all inputs", units))
    return dataset.assign_attrs(
        title="One input at a time",
        **_provenance("tornado", inputs, rest, {"quantiles": [first, last]}),
        quantiles=[first, last],
    )


def _with_ends(
    name: str, values: Array, half_width: Array, long_name: str, confidence: float
) -> dict[str, tuple[Array, str]]:
    """The estimate and the ends of its symmetric interval, with their long names."""
    of_ends = zip(ENDS, (values, values - half_width, values + half_width), strict=True)
    return {f"{name}{end}": (value, of_end(end, long_name, confidence)) for end, value in of_ends}


def _provenance(analysis: str, inputs: RandomInputs, rest: xr.DataArray, options: dict[str, Any]) -> dict[str, Any]:
    """Provenance of indices, with the configuration that the function states, as `overturning_response` does."""
    return provenance({"analysis": analysis, **options, "inputs": inputs.description, "of": configuration_of(rest)})


def _independent(inputs: Any) -> None:
    if not isinstance(inputs, RandomInputs):
        raise TypeError(f"inputs must be RandomInputs, got {checks.kind(inputs)}")
    if not inputs.independent:
        pairs = ", ".join(f"{a} and {b}" for (a, b), value in inputs.rank_correlation.items() if value)
        raise ValueError(f"inputs must be independent to have shares of their own, got a correlation of {pairs}")


def _problem(inputs: RandomInputs) -> dict[str, Any]:
    """The unit cube of the inputs' probabilities as a problem of SALib."""
    d = len(inputs.names)
    return {"num_vars": d, "names": list(inputs.names), "bounds": [[0.0, 1.0]] * d}


def _points(inputs: RandomInputs, n: int, seed: int) -> Array:
    """Return the points (sample, input) of the unit cube at which Sobol' indices are evaluated."""
    from SALib.sample import sobol as sobol_sample  # noqa: PLC0415 - as above

    points: Array = sobol_sample.sample(_problem(inputs), n, calc_second_order=False, seed=stream(seed, 0))
    return points


def sobol_samples(inputs: RandomInputs, n: int, seed: int) -> xr.Dataset:
    """Return the samples of first and total indices, which `sobol_indices` evaluates."""
    return inputs.at(_points(inputs, n, seed))


def _evaluate(inputs: RandomInputs, function: Response, points: Array) -> tuple[Array, xr.DataArray]:
    """Values (sample, column) at points (sample, input) of the unit cube, and the array of the first sample."""
    samples = inputs.at(points)
    values = function(samples)
    if not isinstance(values, xr.DataArray):
        values = xr.DataArray(checks.finite_array("the function's result", values), dims="sample")
    if "sample" not in values.dims or values.sizes["sample"] != points.shape[0]:
        raise ValueError(f"the function must give {points.shape[0]} values on sample, got {dict(values.sizes)}")
    array = values.transpose("sample", ...).astype(float)
    if not np.all(np.isfinite(array.values)):
        raise ValueError(f"the function must be finite, got {int((~np.isfinite(array)).sum())} values that are not")
    return array.values.reshape(points.shape[0], -1), array.isel(sample=[0])


def _dataset(
    inputs: RandomInputs, variables: dict[str, tuple[Array, str]], rest: xr.DataArray, units: str = DIMENSIONLESS
) -> xr.Dataset:
    """Arrays (input, column) on input and the function's other dimensions."""
    dims = ("input", *rest.dims[1:])
    shape: Sequence[int] = (len(inputs.names), *rest.shape[1:])
    kept = {name: coordinate.variable for name, coordinate in rest.coords.items() if "sample" not in coordinate.dims}
    names = np.array(inputs.names, dtype=object)
    return xr.Dataset(
        {name: (dims, array.reshape(shape), described(text, units)) for name, (array, text) in variables.items()},
        coords={**kept, "input": ("input", names, described("input"))},
    )
