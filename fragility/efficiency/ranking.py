"""Ranking of intensity measures: efficiency, sufficiency, practicality and proficiency, from one set of runs."""

import math
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...core import checks
from ...core.elementary import Array, Index, exp
from ...core.parameters import CONFIDENCE, USUAL_CONFIDENCE
from ...core.streams import stream
from ...core.units import ENDS, described, of_end
from ...motions.intensity.measure import Measure
from ..fitting.bootstrap import draw_clusters, percentile_interval
from ..fitting.first_overturning import FEWEST, Brackets, brackets
from ..fitting.states import OVERTURNED, State, state_name
from ..numerics.slabs import gathered, sizes_of
from ..runs.provenance import (
    as_given,
    coordinates_on,
    floor_names,
    load_coordinates,
    motions_by_floor,
    number_of_motions,
    polarity_pairs,
    provenance_from,
)
from .candidates import Candidate, Motions, candidates_of, covariates_of, motions_of_runs
from .capacity import OrderedRuns, ordered_runs
from .trends import STATUSES, LogCapacityEnds, capacity_trends, demand_trends, fit_dispersions

ALL_LEVELS = slice(None)
LEVEL_SAMPLES = 20
"""Samples of the levels, which bootstrap samples of the motions use in turns."""
TYPICAL_MEASURES = 32
"""Typical number of measures compared, which sizes the slabs of bootstrap samples."""
SAME = 1e-9
"""Relative difference of dispersions below which two measures tie (a block's PGA and its normalised PGA)."""


def rank_measures(
    runs: xr.Dataset,
    motions: Motions | None = None,
    also: str | Measure | Sequence[str | Measure] = (),
    *,
    state: State = OVERTURNED,
    least_demand: float = 0.01,
    replicates: int = 200,
    confidence: float = USUAL_CONFIDENCE,
    seed: int = 0,
) -> xr.Dataset:
    """Rank intensity measures by efficiency, with their sufficiency, practicality and proficiency.

    An efficient measure has capacities of small dispersion.

    Parameters
    ----------
    runs : xarray.Dataset
        Runs on (block, model, level, motion) as `toppling.ida` returns them, in any measure; or of stripes or a cloud,
        on (block, model, motion) with a coordinate `intensity`.
    motions : xarray.DataArray or a sequence of them (or of sets, for stripes), optional
        Motions of the runs before scaling, for measures that the runs do not contain. They also give the coordinates
        `magnitude`, `distance` and `epicentral_distance`, which scenario generators and record files set.
    also : measures or their names
        Measures to rank in addition to the runs' own and all of `motions.MEASURES` that grow with the motion:
        ``"Sa(1.0)"``, ``motions.AvgSa(…)``, ``"FIV3(1.0)"``, ``"pga_normalised"``, ``"pgv_normalised"``.
    state : str or float
        Damage state of the capacities: ``overturned``, ``uplifted``, or a threshold of |theta|/alpha, see `reached`.
    least_demand : float
        |theta|/alpha, 0 to below 1, above which a run counts as rocking (and above the elastic zone's delta).
    replicates : int
        Bootstrap samples of the motions and the levels, the same for all measures (0: no intervals).
    confidence : float
        Of the intervals, between 0 and 1.
    seed : int
        Of the bootstrap.

    Returns
    -------
    xarray.Dataset
        On (block, model, measure):

        - efficiency: `dispersion`, the standard deviation of ln capacity in the measure, and `status`.
          `amplitude_dispersion`, the dispersion over the measure's power, makes measures comparable: Arias intensity
          grows with the square of the motion, and ranks like its root. `rank` by it is 1 for the minimum. `excess` is
          its difference from the minimum. `distinguishable` is True if the interval of the excess is above zero.
          `share_best` is the share of bootstrap samples in which the measure is the best;
        - only if the runs contain `peak_rotation`: `practicality` is the slope b of ln(|theta|/alpha) on ln im over the
          runs that rock without overturning. `demand_dispersion` is the scatter about that line, and `proficiency` the
          second over the first.

        Estimates have `_lower` and `_upper` ends of their intervals; `power` is a coordinate.

        On (block, model, measure, covariate): `slope` of ln capacity, `slope_se`, `p_value` of no slope (sufficiency);
        lengths (m) and times (s) enter as logarithms. On (block, model): `best`. `share_below` and `share_above`, of
        capacities below the lowest and above the highest level. `stood_above`, of motions with a level above the first
        overturning at which the block does not overturn. Motions of several floors: a dimension `floor` after (block,
        model).

    Notes
    -----
    A capacity is the measure at the first overturning. It lies between two levels, below the lowest or above the
    highest. The dispersion belongs to a lognormal law fitted to these intervals by maximum likelihood. For single runs
    (stripes, clouds) this is a probit regression in ln im, of slope 1/dispersion. If many motions never overturn
    (`share_above`), the dispersion depends on the lognormal form, the more so the further the measure is from the
    measure of the levels.

    Intervals are percentiles over bootstrap samples of motions, and contain their estimate; intervals of `excess` are
    paired. Both runs of a motion that is run both ways are drawn together. Intervals of dispersions contained the true
    value in 76 % of simulated studies of 10 motions, in 90 % of 20 and in 96 % of 80. In the others it lay above the
    interval. There is no correction for multiple comparisons: some of many equal measures are distinguished by chance.

    First overturnings depend on the levels: closer levels always find earlier overturnings. The intervals of
    dispersions include that. From four levels on, bootstrap samples draw the levels, too, and keep the lowest and the
    highest. For 12 sets of 5 motions and 16 grids of 30 to 60 levels, intervals of one grid contained the dispersions
    of the others in 94 %. Samples of the motions alone contained 75 %. For sets of 20 motions it was 99.7 % (93 %).
    Trends, practicality and `stood_above` use all levels.

    Trends are fitted together with the dispersion to the same intervals, one covariate at a time. Standard errors are
    from the observed information times sqrt(n/(n - 2)), and p-values are Student's with n - 2 degrees of freedom. For
    capacities known exactly this is ordinary least squares. Trends use the motions as given: reversed motions are not
    independent of them.

    Demands are conditional on rocking without overturning, and the runs of one motion at all levels count alike.

    References
    ----------
    Luco, N. and Cornell, C. A. (2007). Structure-specific scalar intensity measures for near-source and ordinary
    earthquake ground motions. Earthquake Spectra 23(2), 357-392.
    Padgett, J. E., Nielson, B. G. and DesRoches, R. (2008). Selection of optimal intensity measures in probabilistic
    seismic demand models of highway bridge portfolios. Earthquake Engineering and Structural Dynamics 37, 711-725.

    Examples
    --------
    >>> import numpy as np
    >>> import toppling as tp
    >>> shakes = tp.motions.CloughPenzien(duration=10.0, dt=0.01).sample(20)
    >>> runs = tp.ida(tp.catalogue["bookcase-5-shelf"], tp.HousnerImpact(), shakes, np.linspace(1.0, 12.0, 23))
    >>> ranking = rank_measures(runs, shakes, ["Sa(1.0)"], replicates=50)
    >>> ranking.sizes["measure"], float(ranking.excess.min()), int(ranking["rank"].min())
    (7, 0.0, 1)
    """
    options = RankingOptions(
        motions,
        [also] if isinstance(also, str | Measure) else list(also) if checks.is_several(also) else also,
        state,
        checks.number("least_demand", least_demand, at_least=0.0, below=1.0),
        checks.count("replicates", replicates),
        CONFIDENCE.number("confidence", confidence),
        checks.count("seed", seed),
    )
    if isinstance(runs, xr.Dataset):
        load_coordinates(runs)
        checks.not_empty("runs", runs)
    ordered = ordered_runs(_first_block_and_law(runs), state)
    if set(ordered.overturned.dims) != {"block", "model", "motion", "level"}:
        raise ValueError(f"overturned must lie on block, model, motion and level, got {ordered.overturned.dims}")
    index, groups = motions_by_floor(runs)
    whole = _with_measures(runs, options)
    sizes = sizes_of(runs)
    of_one = math.prod(sizes[dim] for dim in ("level", "motion") if dim in sizes)
    sizes = {
        "block": sizes["block"],
        "model": sizes["model"],
        "sample": max(of_one, TYPICAL_MEASURES * (1 + options.replicates)),
    }
    return gathered(lambda part: _by_floor(part, index, groups, options), whole, sizes=sizes)


def _by_floor(
    runs: xr.Dataset, index: xr.Variable | None, groups: list[NDArray[np.intp]], options: "RankingOptions"
) -> xr.Dataset:
    """Compare all measures, floor by floor if the motions are of several floors."""
    if index is None:
        return _compare(runs, options)
    apart = runs.drop_vars(floor_names(runs.coords))
    parts = [_compare(apart.isel(motion=group), options) for group in groups]
    joined = xr.concat(parts, xr.DataArray(index, name="floor"), combine_attrs="override")
    return joined.transpose("block", "model", "floor", ...)


def _with_measures(runs: xr.Dataset, options: "RankingOptions") -> xr.Dataset:
    """Return the runs with every measure as a coordinate, so that the slabs need not compute it again."""
    few = _first_block_and_law(runs)
    candidates = candidates_of(
        few, ordered_runs(few, options.state), motions_of_runs(runs, options.motions), options.also
    )
    known = {
        candidate.label: ("motion", exp(candidate.log_values))
        for candidate in candidates
        if candidate.label not in runs.coords and candidate.log_values.shape == (runs.sizes["motion"],)
    }
    return runs.assign_coords(known)


def _first_block_and_law(runs: Any) -> Any:
    """Return the runs of the first block under the first law; anything else unchanged."""
    return runs.isel(block=slice(1), model=slice(1), missing_dims="ignore") if isinstance(runs, xr.Dataset) else runs


class RankingOptions(NamedTuple):
    """Options of `rank_measures`, checked."""

    motions: Motions | None
    also: Any
    state: State
    least_demand: float
    replicates: int
    confidence: float
    seed: int

    @property
    def described(self) -> dict[str, Any]:
        """Options as plain values, without the motions, which the runs determine."""
        also = [measure if isinstance(measure, str) else measure.label for measure in self.also]
        plain = {**self._asdict(), "also": also, "state": state_name(self.state)}
        del plain["motions"]
        return plain


def _compare(runs: xr.Dataset, options: RankingOptions) -> xr.Dataset:
    """Compare all measures for the motions of one floor."""
    ordered = ordered_runs(runs, options.state)
    run_motions = motions_of_runs(runs, options.motions)
    candidates = candidates_of(runs, ordered, run_motions, options.also)
    n = len(run_motions.labels)
    # how often each motion is drawn, (1 + replicate, motion); in the first row every motion once
    drawn = draw_clusters(polarity_pairs(runs), options.replicates, options.seed)
    weights = np.concatenate([np.ones((1, n)), drawn])
    capacities = _capacities(ordered)
    ends = [_log_capacities(capacities, candidate) for candidate in candidates]
    dims = ("block", "model", "measure")
    powers = np.array([candidate.power for candidate in candidates])
    # a motion and its reverse are one earthquake, so that fits of both ways are only as precise as fits of one
    fits = _dispersions(ordered, candidates, ends, weights * as_given(runs).mean(), options)
    columns = _efficiency(*fits, powers, options.confidence)
    if "peak_rotation" in runs:
        columns |= _practicality(runs, ordered, candidates, weights, options)
    variables: dict[str, Any] = {name: (dims, *column) for name, column in columns.items()}
    known = covariates_of(runs, run_motions)
    # (a motion that is run both ways counts once, as given: its two capacities are not independent)
    given = as_given(runs)
    slope, error, p, motions = capacity_trends(
        [(lower[..., given], upper[..., given]) for lower, upper in ends], [x.isel(motion=given) for x in known]
    )
    for name, values, text in (
        ("slope", slope, "slope of ln capacity on the covariate"),
        ("slope_se", error, "standard error of the slope"),
        ("p_value", p, "p-value of no slope"),
    ):
        variables[name] = ((*dims, "covariate"), *_column(values, text))
    coords = {
        **_coordinates(runs, candidates),
        "covariate": ("covariate", *_texts([x.name for x in known], "covariate")),
        "covariate_long_name": ("covariate", *_texts([x.attrs["long_name"] for x in known], "what it is")),
        "covariate_motions": ("covariate", *_column(motions, "motions whose covariate is known")),
    }
    labels = [candidate.label for candidate in candidates]
    summary = _summary(capacities, columns["rank"][0], labels)
    variables |= {name: (("block", "model"), *column) for name, column in summary.items()}
    return xr.Dataset(
        variables,
        coords,
        {
            "title": "Intensity measures compared",
            **provenance_from("comparison of intensity measures", options.described, runs=runs),
            "method": "lognormal likelihood of interval-censored capacities; paired bootstrap of motions and levels",
            "state": state_name(options.state),
            "im": ordered.name,
            "confidence": options.confidence,
            "replicates": options.replicates,
            "seed": options.seed,
            "motions": number_of_motions(runs),
        },
    )


def _capacities(ordered: OrderedRuns, kept: Index | slice = ALL_LEVELS) -> Brackets:
    """Return the capacities, as ln factors (block, model, motion), as the levels at some positions show them."""
    flags = ordered.overturned.transpose("block", "model", "motion", "level").values
    return brackets(flags[..., kept], ordered.factors_by_block[:, None, :, kept])


def _dispersions(
    ordered: OrderedRuns,
    candidates: Sequence[Candidate],
    ends: Sequence[LogCapacityEnds],
    weights: Array,
    options: RankingOptions,
) -> tuple[Array, NDArray[np.int8]]:
    """Return the dispersions under each row of weights (sample, motion): the first of all levels, others of samples."""
    levels = ordered.overturned.sizes["level"]
    if levels < FEWEST:
        return fit_dispersions(ends, weights)
    whole, status = fit_dispersions(ends, weights[:1])
    dispersions = np.concatenate([whole, np.empty((*whole.shape[:-1], options.replicates))], axis=-1)
    for i in range(min(LEVEL_SAMPLES, options.replicates)):
        kept = np.unique([0, levels - 1, *stream(options.seed, i, levels).integers(levels, size=levels)])
        sampled = _capacities(ordered, kept)
        of_levels = [_log_capacities(sampled, candidate) for candidate in candidates]
        rows = slice(1 + i, None, LEVEL_SAMPLES)
        sample, _ = fit_dispersions(of_levels, np.concatenate([weights[:1], weights[rows]]))
        dispersions[..., rows] = sample[..., 1:]
    return dispersions, status


def _log_capacities(capacities: Brackets, candidate: Candidate) -> LogCapacityEnds:
    """Return the ends of ln capacity in a measure, in the shape of the capacities."""
    values = np.atleast_2d(candidate.log_values)[:, None, :]
    return values + candidate.power * capacities.lower, values + candidate.power * capacities.upper


Column = tuple[NDArray[Any], dict[str, str]]


def _column(values: NDArray[Any], long_name: str) -> Column:
    return values, described(long_name)


def _texts(values: Iterable[Any], long_name: str) -> Column:
    return _column(np.array([str(value) for value in values], dtype=object), long_name)


def _with_interval(name: str, values: Array, confidence: float, long_name: str) -> dict[str, Column]:
    """An estimate (first along the last axis) and its percentile interval over the samples that have a value.

    Samples of few motions are biased, samples of dispersions to low values: the interval also contains the estimate.
    """
    estimate, samples = values[..., 0], values[..., 1:]
    ends = percentile_interval(samples, confidence)
    known = (ends.used > 1) & ~np.isnan(estimate)
    lower = np.where(known, np.minimum(ends.lower, estimate), np.nan)
    upper = np.where(known, np.maximum(ends.upper, estimate), np.nan)
    # (a copy: a view would hold all samples)
    of_ends = zip(ENDS, (estimate.copy(), lower, upper), strict=True)
    return {f"{name}{end}": _column(value, of_end(end, long_name, confidence, "bootstrap")) for end, value in of_ends}


def _efficiency(dispersion: Array, status: NDArray[np.int8], powers: Array, confidence: float) -> dict[str, Column]:
    amplitude = dispersion / powers[:, None]
    ranked = np.where(np.isnan(amplitude), np.inf, amplitude)
    first, samples = ranked[..., 0], ranked[..., 1:]
    below = first[..., None, :] < first[..., :, None] * (1.0 - SAME)
    rank = np.where(np.isfinite(first), 1 + below.sum(axis=-1), 0)
    best = np.take_along_axis(amplitude, first.argmin(axis=-1)[..., None, None], axis=2)
    excess = _with_interval("excess", amplitude - best, confidence, "amplitude_dispersion above the least")
    share = np.full(first.shape, np.nan)
    if samples.shape[-1] > 0:
        least = samples.min(axis=2, keepdims=True)
        wins = (samples <= least * (1.0 + SAME)) & np.isfinite(least)
        share = (wins / np.maximum(wins.sum(axis=2, keepdims=True), 1)).mean(axis=-1)
    text = "standard deviation of ln capacity"
    return {
        **_with_interval("dispersion", dispersion, confidence, text),
        "status": _column(np.array(STATUSES, dtype=object)[status], "ok, or why there is no dispersion"),
        **_with_interval("amplitude_dispersion", amplitude, confidence, f"{text} over the measure's power"),
        "rank": _column(rank, "place by amplitude_dispersion, 1 for the least, 0 without one"),
        **excess,
        "distinguishable": _column(excess["excess_lower"][0] > 0.0, "whether the excess is told from 0"),
        "share_best": _column(share, "share of bootstrap samples in which the measure is the best"),
        "resampled": _column(np.isfinite(samples).sum(axis=-1), "bootstrap samples with a dispersion"),
    }


def _practicality(
    runs: xr.Dataset, ordered: OrderedRuns, candidates: Sequence[Candidate], weights: Array, options: RankingOptions
) -> dict[str, Column]:
    slope, scatter = demand_trends(runs, ordered, candidates, weights, options.least_demand)
    with np.errstate(divide="ignore", invalid="ignore"):
        proficiency = np.where(slope > 0.0, scatter / slope, np.nan)
    columns: dict[str, Column] = {}
    for name, values, text in (
        ("practicality", slope, "slope of ln demand on ln im, runs that rock and stand"),
        ("demand_dispersion", scatter, "standard deviation of ln demand about that line"),
        ("proficiency", proficiency, "demand_dispersion over practicality"),
    ):
        columns |= _with_interval(name, values, options.confidence, text)
    return columns


def _summary(capacities: Brackets, rank: Index, labels: Sequence[str]) -> dict[str, Column]:
    first = np.where(rank > 0, rank, len(labels) + 1).argmin(axis=-1)
    best = np.where(rank.any(axis=-1), np.array(labels, dtype=object)[first], "")
    return {
        "best": _column(best, "measure with the least amplitude_dispersion"),
        "share_below": _column(np.isinf(capacities.lower).mean(axis=-1), "share of capacities below the lowest level"),
        "share_above": _column(np.isinf(capacities.upper).mean(axis=-1), "share of capacities above the highest level"),
        "stood_above": _column(
            capacities.stood_above.mean(axis=-1), "share of motions that overturn at a level and not at a higher one"
        ),
    }


def _coordinates(runs: xr.Dataset, candidates: Sequence[Candidate]) -> dict[str, Any]:
    return {
        **{name: values for name, values in coordinates_on(runs, ("block", "model")).items() if values.dims},
        "measure": ("measure", *_texts([each.label for each in candidates], "intensity measure")),
        "measure_units": ("measure", *_texts([each.units for each in candidates], "unit of the measure")),
        "power": ("measure", *_column(np.array([each.power for each in candidates]), "power with which it grows")),
        "measure_long_name": ("measure", *_texts([each.long_name for each in candidates], "what the measure is")),
    }
