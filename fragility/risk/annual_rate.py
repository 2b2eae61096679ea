"""Annual rates of overturning: fragility curves convolved with a hazard curve, with the uncertainty of both.

More motions do not correct the rate of a curve of the wrong form. The rate of the runs is the curve's rate plus the
contribution of the observed shares of overturning, linear in ln x between the levels.
"""

from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...core import checks
from ...core.doubts import warn_of_results
from ...core.elementary import Array, exp, geomspace, log
from ...core.parameters import CONFIDENCE, USUAL_CONFIDENCE, USUAL_YEARS, YEARS
from ...core.units import DIMENSIONLESS, ENDS, PER_YEAR, described, of_end, provenance
from ...motions.intensity.naming import long_name_at
from ..curves.curve import (
    LEAST,
    OUTSIDE,
    REFUSE,
    CurveArrays,
    LognormalCurves,
    TabulatedCurves,
    curve_arrays,
    form_name,
    has_replicates,
)
from ..fitting.bootstrap import Percentiles, percentile_interval
from ..fitting.labels import OBSERVED
from ..fitting.links import LOGNORMAL
from ..hazard.curve import HazardCurve
from ..hazard.pieces import EXTEND, HOLD, Pieces
from ..hazard.plausibility import warn_of_hazards
from ..hazard.poisson import probability_in
from ..numerics.slabs import spread
from ..runs.provenance import configuration_of, coordinates_on
from ..validity.limits import of_rates
from .common_measure import in_hazard_measure
from .convolution import contributions, rates_of
from .modelling import MODELLING
from .quadrature import event_integral, lower_end

FAR = 1e30
"""Factor to a level so rare that no share of a rate lies above it."""
OF_RUNS, MISFIT = "rate_of_runs", "rate_misfit"
MOST_BINS = 100_000
POWER = 2.0
"""Power of the ratio of dispersions that studentises a step of ln(rate).

The variance of ln(rate) of n motions with one capacity each is k² beta² (1 + k² beta²/2)/n. Errors are therefore as a
power of beta between 1 and 2. Of 1, 1.5 and 2, only 2 keeps the level. Their upper tails were 4-8, 3-5 and 2-4 % in
1,000 studies of 20 motions (nominal 2.5 %).
"""
MOST_RATIO = 2.0
"""Maximum ratio of dispersions that counts: data of few motions may be drawn separated, without a dispersion.

Coverage was the same to 0.3 % as without a bound. The longest of 960 intervals were 5 to 7 times as long as the normal
one, instead of 5 to 100 times.
"""


def annual_rate(
    curves: xr.Dataset,
    hazard: HazardCurve,
    years: float = USUAL_YEARS,
    *,
    below: str = EXTEND,
    above: str = EXTEND,
    outside: str = REFUSE,
    bins: Any = 40,
    confidence: float = USUAL_CONFIDENCE,
) -> xr.Dataset:
    """Return the annual rate of overturning of every curve under a hazard curve, with its deaggregation.

    Parameters
    ----------
    curves : xarray.Dataset
        Fitted curves, as `fit_fragility` returns them: lognormal, with or without uplift, or tabulated.
        Curves in ``pga_normalised`` or ``pgv_normalised`` need a hazard of ``pga`` or ``pgv``: each block's own alpha
        (and p) turns its levels into that measure.
    hazard : HazardCurve
        Hazard curve of the same measure. With realisations, `rate` is the rate of their mean, and the interval covers
        all of them.
    years : float
        Time for the probability, years, > 0.
    below : {"extend", "none"}
        Below the hazard curve's lowest level: its first piece is extended, or no events count.
    above : {"extend", "none", "hold"}
        Above its highest level: the last piece is extended; or the events there do not count; or they count as if they
        just reached it (a lower bound).
    outside : {"refuse", "least", "most"}
        Rule for tabulated curves beyond their levels, as in `curve_probability`; "refuse" is an error if it changes a
        rate.
    bins : int or array_like (edge,)
        Bins of intensity: their number, of equal width in ln x between the lowest and the highest level of the hazard
        curve, or their edges (SI).
    confidence : float
        Of the interval, between 0 and 1.

    Returns
    -------
    xarray.Dataset
        On the dimensions of the curves, such as (block, model): rate (1/year), probability in `years`. `share_below`
        and `share_above` are the shares of the rate that the tails beyond the hazard curve's levels contribute.
        `share`, also on bin, sums to 1 less the events beyond the bins. `intensity_mean` is the exponential of the mean
        of ln x over all contributing events. `intensity_mode` is the middle of the bin with the maximum per unit of ln
        x.

        With bootstrap replicates of the curves or realisations of the hazard: rate_sample on ``replicate`` and
        ``realisation`` (coordinate weight), rate_lower, rate_upper, probability_lower, probability_upper, and
        samples_used. If curves know their runs at common levels, rate_of_runs and rate_misfit (Notes). One replicate is
        one bootstrap sample for all blocks and models, so differences between them are taken sample by sample. A curve
        without an estimate has NaN.

    Raises
    ------
    TypeError, ValueError
        No dataset of curves or no hazard curve. Measures or units that differ. Floors of another hazard (below). Rules,
        bins or confidence that do not exist. A tabulated curve too short for its rate with ``outside="refuse"``. A
        hazard curve that ends level and is to be extended.

    Notes
    -----
    The rate is the integral of P(x) |dH(x)|, in closed form on every piece of the hazard curve (`convolution`). On a
    piece ln H is linear in ln x, or a parabola, and P is lognormal, a step, or linear in ln x. If P is the product of
    two lognormals with dispersions > 0, the integral is computed by quadrature with a relative error of 1e-10 (about
    ten times slower).

    Extending is the conservative default. Hazard curves grow steeper with intensity on a log-log plot, so continuing
    with the slope of an end overestimates the rates beyond both ends. A share_above of more than some per cent means
    that the hazard curve is too short for these blocks.

    Curves whose levels are of the floor motion need the hazard of that floor: ``HazardCurve(…, at="floor")``, one floor
    at a time.  Runs with their ground motions (``ground``) use the hazard of the ground on all floors.  Curves
    that do not state their place are assumed to be at the place of the hazard curve.

    rate_sample are samples of a studentised bootstrap, of which the ends of intervals
    are percentiles.  Every replicate is combined with every realisation by its weight; replicates without an estimate
    are left out (samples_used counts the others).

    If the shares of the runs at common levels are known, the interval also contains itself moved to the rate of the
    runs. It then contains the true rate even if the curve does not fit. `rate_misfit` is the curve's rate over the rate
    of the runs, less 1, or 0 within the curve's own interval. Tabulated and uplift curves have the hull of percentiles
    and of their mirror images in ln(rate).

    *Coverage* of 95 % intervals in 960 studies each of 20, 40 and 80 motions (480 of 400) at hazard slopes of 1.5 to 5.
    It was 92-100 % for lognormal truths with dispersions of 0.25 to 0.7, two populations and skewed curves, with at
    most 4.4 % of the truths above the upper end. It was 81-90 % for skewed curves whose rate comes from below all
    levels. Lengths were 1.0 to 1.5 times the length of a normal interval with the true deviation of ln(rate). They were
    1.8 times with 10 motions, and more if the curve misfits. For isotonic curves and 20 motions coverage was 92-98 %,
    and 89-91 % for skewed truths (percentiles: 87-95 %).

    Examples
    --------
    >>> import xarray as xr
    >>> curves = xr.Dataset({"median": ((), 0.6, {"units": "m s-2"}), "dispersion": 0.4}, attrs={"im": "pga"})
    >>> risk = annual_rate(curves, HazardCurve.power_law(1e-4, 2.5, "pga"))
    >>> print(f"{risk['rate'].item():.12e} {risk['probability'].item():.5f}")
    5.912472244407e-04 0.02913
    """
    time = YEARS.number("years", years)
    level = CONFIDENCE.number("confidence", confidence)
    checks.choice("outside", outside, OUTSIDE)
    arrays, dims = in_hazard_measure(curves, hazard)
    edges = _bin_edges(bins, hazard)
    pieces = hazard.pieces(below, above)
    rates_at = rates_of(arrays, pieces[0], outside)
    share, mean, mode = _deaggregate(arrays, rates_at.rate, pieces[0], edges, outside)
    units, measure = hazard.units, long_name_at(hazard.measure.long_name, hazard.at)
    overturning, text = "annual rate of overturning", f"probability of overturning in {time:g} years"
    variables: dict[str, tuple[tuple[str, ...], NDArray[Any], str, str]] = {
        "rate": (dims, rates_at.rate, PER_YEAR, overturning),
        "probability": (dims, probability_in(rates_at.rate, time), DIMENSIONLESS, text),
        "share_below": (dims, rates_at.share_below, DIMENSIONLESS, "share of the rate from below the hazard's levels"),
        "share_above": (dims, rates_at.share_above, DIMENSIONLESS, "share of the rate from above the hazard's levels"),
        "intensity_mean": (dims, mean, units, f"geometric mean of the {measure} that overturns"),
        "intensity_mode": (dims, mode, units, f"{measure} of the bin that contributes most per unit of ln x"),
        "share": ((*dims, "bin"), share, DIMENSIONLESS, f"share of the rate in a bin of {measure}"),
    }
    samples = _samples(curves, hazard, below, above, outside)
    if samples is not None:
        apart = _of_runs(curves, arrays, pieces)
        lower, upper, used = samples.ends(level, samples.values)
        sampled = [samples.mirrored]
        if apart is not None:
            within = (lower <= rates_at.rate * apart[:, 0]) & (rates_at.rate * apart[:, 0] <= upper)
            with np.errstate(divide="ignore", invalid="ignore"):
                missed = np.where(within | np.isnan(rates_at.rate), 0.0, 1.0 / apart[:, 0] - 1.0)
            more = "rate of the curve over that of its runs, less 1; 0 within the curve's interval"
            of = "annual rate of overturning of the runs, and of the curve beyond their levels"
            variables |= {
                OF_RUNS: (dims, rates_at.rate * apart[:, 0], PER_YEAR, of),
                MISFIT: (dims, missed, DIMENSIONLESS, more),
            }
            sampled.append(samples.values * apart[:, None, -samples.values.shape[-1] :])
        for values in (samples_of_rate for samples_of_rate in sampled if samples_of_rate is not None):
            ends = samples.ends(level, values)
            lower, upper = np.fmin(lower, ends.lower), np.fmax(upper, ends.upper)
        variables |= {
            "rate_sample": (samples.dims, samples.values, PER_YEAR, f"{overturning} of each sample"),
            "samples_used": (dims, used, DIMENSIONLESS, "samples with an estimate"),
        }
        for end, values in zip(ENDS[1:], (lower, upper), strict=True):
            variables[f"rate{end}"] = dims, values, PER_YEAR, of_end(end, overturning, level)
            chances = probability_in(values, time)
            variables[f"probability{end}"] = dims, chances, DIMENSIONLESS, of_end(end, text, level)
    shapes = {name: curves.sizes[name] for name in (*dims, "replicate") if name in curves.sizes}
    shapes |= {"bin": edges.size - 1, "realisation": len(hazard.weights or ())}
    configuration = {
        "hazard": hazard.describe(),
        "below": below,
        "above": above,
        "outside": outside,
        "years": time,
        "confidence": level,
        "curves": configuration_of(curves),
    }
    rates = xr.Dataset(
        {
            name: (on, np.reshape(values, [shapes[dim] for dim in on]), described(long_name, unit))
            for name, (on, values, unit, long_name) in variables.items()
        },
        coords={
            **coordinates_on(curves, (*dims, "replicate") if samples is not None else dims),
            **_bin_coordinates(edges, hazard, measure),
            **_weights(hazard),
        },
        attrs={
            "title": "Annual rates of overturning",
            **provenance(configuration),
            "im": hazard.im,
            "years": time,
            "confidence": level,
        },
    )
    warn_of_hazards([hazard])
    warn_of_results(of_rates(rates))
    return rates


def rates_alone(
    curves: xr.Dataset, hazard: HazardCurve, below: str, above: str, outside: str
) -> tuple[tuple[str, ...], Array]:
    """Return the rates of `annual_rate` alone, under the mean hazard, and their dimensions; replicates are left out."""
    arrays, dims = in_hazard_measure(curves, hazard)
    rates = rates_of(arrays, hazard.pieces(below, above)[0], outside).rate
    return dims, rates.reshape([curves.sizes[dim] for dim in dims])


def rate_share_above(
    curves: xr.Dataset,
    hazard: HazardCurve,
    levels: xr.DataArray | float,
    *,
    below: str = EXTEND,
    above: str = EXTEND,
    outside: str = REFUSE,
) -> xr.DataArray:
    """Return the share of each annual rate from motions above a level.

    Parameters
    ----------
    curves, hazard, below, above, outside
        As for `annual_rate`.
    levels : xarray.DataArray or float
        Level in the measure and unit of the hazard curve, > 0; on block if blocks have different levels.

    Returns
    -------
    xarray.DataArray
        On the dimensions of the curves, 0 to 1; NaN if there is no rate.

    Examples
    --------
    >>> import xarray as xr
    >>> curves = xr.Dataset({"median": ((), 0.6, {"units": "m s-2"}), "dispersion": 0.4}, attrs={"im": "pga"})
    >>> round(rate_share_above(curves, HazardCurve.power_law(1e-4, 2.5, "pga"), 0.6).item(), 4)
    0.4619
    """
    arrays, dims = in_hazard_measure(curves, hazard)
    pieces = hazard.pieces(below, above)[0]
    shape = tuple(curves.sizes[dim] for dim in dims)
    if isinstance(levels, xr.DataArray):
        checks.plain("levels", levels)
        at = levels
    else:
        at = xr.DataArray(checks.number("levels", levels, above=0.0))
    for dim in at.dims:
        if dim not in dims or at.sizes[dim] != curves.sizes[dim]:
            raise ValueError(
                f"levels must be one number, or on dimensions of the curves, {dims}, got {at.sizes[dim]} on {dim!r}"
            )
        if dim in at.coords and dim in curves.coords and not np.array_equal(at[dim].values, curves[dim].values):
            raise ValueError(f"levels must have the labels of the curves on {dim}, in their order")
    if not (at.values > 0.0).all():
        raise ValueError(f"levels must be > 0, got {at.values.min():g}")
    thresholds = spread(at, dict(zip(dims, shape, strict=True))).ravel()
    share = _share_above(arrays, rates_of(arrays, pieces, outside).rate, pieces, thresholds, outside)
    return xr.DataArray(share.reshape(shape), coordinates_on(curves, dims), dims)


class RateSamples(NamedTuple):
    """Samples of rates, (curve, replicate, realisation), the dimensions of their labelled array, and their weights.

    mirrored: samples whose steps of ln(rate) are taken the other way, if they are not studentised.
    """

    values: Array
    dims: tuple[str, ...]
    weights: Array | None
    mirrored: Array | None

    def ends(self, confidence: float, values: Array) -> Percentiles:
        """Return the ends of the intervals of curves from `values` of the samples."""
        flat = values.reshape(values.shape[0], values.shape[1] * values.shape[2])
        return percentile_interval(flat, confidence, self.weights)


def _samples(curves: xr.Dataset, hazard: HazardCurve, below: str, above: str, outside: str) -> RateSamples | None:
    """Rates of every replicate under every realisation, (curve, replicate, realisation); None if there are neither."""
    replicates, realisations = has_replicates(curves), hazard.weights is not None
    if not replicates and not realisations:
        return None
    arrays, dims = in_hazard_measure(curves, hazard, replicates)
    pieces = hazard.pieces(below, above)
    hazards = pieces[1:] if realisations else pieces
    rates = [rates_of(arrays, curve, outside).rate for curve in hazards]
    count = curves.sizes["replicate"] if replicates else 1
    values = np.stack(rates, axis=-1).reshape(-1, count, len(rates))
    mirrored = None
    if replicates:
        plain = in_hazard_measure(curves, hazard)[0]
        rate = np.stack([rates_of(plain, curve, outside).rate for curve in hazards], axis=-1)
        if form_name(curves) == LOGNORMAL:
            values = _studentised(curves, rate, values)
        else:
            known = (values > 0.0) & np.isfinite(values)
            mirrored = np.divide(rate[:, None] ** 2, values, out=np.full_like(values, np.nan), where=known)
    weights = None
    if hazard.weights is not None:
        weights = np.tile(hazard.weights, count)
        dims = (*dims, "realisation")
    return RateSamples(values, dims, weights, mirrored)


def _studentised(curves: xr.Dataset, rates: Array, samples: Array) -> Array:
    """Return samples (curve, replicate, hazard) whose percentiles are the ends of bootstrap-t intervals of the rates.

    The step of a replicate in ln(rate) is reversed and multiplied by (beta/beta of the replicate)², with a ratio of at
    most `MOST_RATIO`. Replicates of few severe motions have low rates and small errors, so that plain percentiles are
    too short on the unsafe side. Efron, B. and Tibshirani, R. J. (1993). An introduction to the bootstrap. Chapman and
    Hall, chapters 12 and 22.
    """
    spread = _of_motions(curves, False).dispersion.reshape(-1, 1)
    sampled = _of_motions(curves, True).dispersion.reshape(spread.size, samples.shape[1])
    # (a step has no error to be scaled by)
    ratio = np.divide(spread, sampled, out=np.ones_like(sampled), where=(spread > 0.0) & (sampled > 0.0))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        scale = np.minimum(ratio, MOST_RATIO)[..., None] ** POWER
        step = (log(samples) - log(rates)[:, None]) * scale
        return np.asarray(np.where(np.isnan(sampled)[..., None], np.nan, rates[:, None] * exp(-step)))


def _of_runs(curves: xr.Dataset, arrays: CurveArrays, hazards: list[Pieces]) -> Array | None:
    """Return the rates of the runs over the rates of their curves, (curve, hazard), without modelling uncertainty.

    None if the shares of the runs at common levels are not known. arrays: the curves in the hazard's measure.
    """
    if OBSERVED not in curves or not isinstance(arrays, LognormalCurves) or curves.sizes["level"] < 2:
        return None
    motions = _of_motions(curves, False)
    dims = [dim for dim in curves["median"].dims if dim in curves[OBSERVED].dims]
    levels = log(curves["level"].values.astype(np.float64))
    plain = motions.flat()
    seen = curves[OBSERVED].transpose(*dims, "level").values.reshape(-1, levels.size)
    shift = np.nan_to_num(arrays.log_median.ravel() - plain.log_median)
    ends = 2.0 * levels[[0, -1]] - levels[[1, -2]]
    at = np.concatenate([ends[:1], levels, ends[1:]])
    ratios = []
    for hazard in hazards:
        rate = rates_of(plain.shifted(shift), hazard).rate
        by_shares, by_curve = (
            rates_of(TabulatedCurves(at, np.pad(values, ((0, 0), (1, 1))), shift), hazard, LEAST).rate
            for values in (seen, plain.probability(levels))
        )
        with np.errstate(divide="ignore", invalid="ignore"):
            ratios.append(np.maximum(1.0 + (by_shares - by_curve) / rate, 0.0))
    return np.stack(ratios, axis=-1)


def _of_motions(curves: xr.Dataset, replicates: bool) -> LognormalCurves:
    """Return curves, or their replicates, whose dispersion is of the motions alone."""
    arrays = curve_arrays(curves, replicates)[0]
    assert isinstance(arrays, LognormalCurves)
    spread = float(curves.attrs.get(MODELLING, 0.0))
    return arrays._replace(dispersion=np.sqrt(np.maximum(arrays.dispersion**2 - spread**2, 0.0)))


def _bin_coordinates(edges: Array, hazard: HazardCurve, text: str) -> dict[str, xr.Variable]:
    lower, upper = edges[:-1], edges[1:]
    columns = {
        "bin": (np.sqrt(lower * upper), f"geometric middle of a bin of {text}"),
        "bin_lower": (lower, f"lower edge of a bin of {text}"),
        "bin_upper": (upper, f"upper edge of a bin of {text}"),
    }
    return {
        name: xr.Variable("bin", values, {"units": hazard.units, "long_name": long_name, "im": hazard.im})
        for name, (values, long_name) in columns.items()
    }


def _weights(hazard: HazardCurve) -> dict[str, xr.Variable]:
    if hazard.weights is None:
        return {}
    number = described("realisation of the hazard curve")
    attributes = described("weight of the realisation")
    return {
        "realisation": xr.Variable("realisation", np.arange(len(hazard.weights)), number),
        "weight": xr.Variable("realisation", np.array(hazard.weights), attributes),
    }


def _bin_edges(bins: int | Any, hazard: HazardCurve) -> Array:
    """Return edges of bins of intensity (SI): those given, or bins of equal width in ln x over the hazard's levels."""
    if isinstance(bins, int | np.integer) and not isinstance(bins, bool):
        count = int(checks.number("bins", checks.count("bins", bins), at_least=1, at_most=MOST_BINS))
        return geomspace(hazard.levels[0], hazard.levels[-1], count + 1)
    edges = checks.finite_array("bins", bins)
    if edges.size < 2:
        raise ValueError("bins must be a number of bins, or at least two edges")
    checks.increasing("bins", edges)
    return edges


def _share_above(curves: CurveArrays, rate: Array, hazard: Pieces, levels: Array, outside: str) -> Array:
    """Return the shares of rates (curve,) from above each curve's level (curve,); NaN if a rate is 0 or infinite."""
    curves = curves.flat()
    share = np.full(rate.shape, np.nan)
    sound = np.isfinite(rate) & (rate > 0.0)
    for level in np.unique(levels[sound]):
        rows = np.flatnonzero(sound & (levels == level))
        edges = log([level, FAR * level])
        share[rows] = contributions(curves.rows(rows), hazard, edges, outside)[:, 0] / rate[rows]
    return share


def _deaggregate(
    curves: CurveArrays, rate: Array, hazard: Pieces, edges: Array, outside: str
) -> tuple[Array, Array, Array]:
    """Return the shares of the rates (curve, bin) between `edges` (edge,), and mean and mode of ln x (curve,) each.

    The mean is exact, over all intensities; the mode is the middle of the bin with the maximum per unit of ln x. Both
    are NaN if the rate is 0 or infinite.
    """
    curves = curves.flat()
    log_edges = log(edges)
    sound = np.isfinite(rate) & (rate > 0.0)
    safe = np.where(sound, rate, np.nan)[:, None]
    share = contributions(curves, hazard, log_edges, outside) / safe
    density = share / np.diff(log_edges)
    middle = np.sqrt(edges[:-1] * edges[1:])
    mode = np.where(sound, middle[np.argmax(np.nan_to_num(density), axis=1)], np.nan)
    rule = LEAST if outside == REFUSE else outside
    base = lower_end(curves, hazard, rule)
    moment = np.full(rate.shape, np.nan)
    rows = np.flatnonzero(sound)
    if rows.size:
        some, low = curves.rows(rows), base[rows]
        moment[rows] = event_integral(some, hazard, lambda u, row: np.maximum(u - low[row][:, None], 0.0), rule)
        if hazard.above == HOLD:
            held = some.probability(np.array([hazard.last]), rule)[:, 0] * exp(hazard.log_last)
            moment[rows] += held * np.maximum(hazard.last - low, 0.0)
    return share, exp(base + moment / safe[:, 0]), mode
