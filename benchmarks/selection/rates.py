"""Annual rates from stripes at levels of several measures: the same site and blocks, conditioned one way and another.

A rate of overturning does not depend on the measure whose levels the motions are selected at, provided that each
stripe agrees with the hazard in everything that the blocks feel.  Rates that differ say that some stripes do not.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from ...core import checks
from ...core.aliases import Array, Index
from ...core.units import DIMENSIONLESS, PER_YEAR
from ...core.wording import given_percent
from ...fragility.fitting.bootstrap import draw_motions, percentile_interval
from ...fragility.fitting.fit import FORMS, REPLICATES, fitted_curves
from ...fragility.fitting.intervals import PROFILE, Options
from ...fragility.fitting.links import LOGNORMAL
from ...fragility.fitting.trials import Sample, Trials, collect
from ...fragility.hazard.curve import HazardCurve
from ...fragility.risk.annual_rate import annual_rate, rate_share_above
from ...fragility.runs.provenance import STRIPES, design_of, ground_names, provenance_from
from ...fragility.runs.scaling import intensity_measure

DURATION = "d5_95"
"""Measure by which a motion is known again: scaling does not change it."""
SAME = 1e-6
"""Relative difference of durations up to which two motions of one name are the same."""


class _Rates(NamedTuple):
    """Rates (curve,) of one measure with their replicates (curve, replicate), and shares outside the stripes (curve,).

    rate, samples: of the fitted curves; within, within_samples: summed over the stripes.
    """

    rate: Array
    samples: Array
    within: Array
    within_samples: Array
    below: Array
    above: Array


def rates_by_measure(
    runs: Sequence[xr.Dataset],
    hazards: Sequence[HazardCurve],
    *,
    events: Mapping[str, str] | None = None,
    confidence: float = 0.95,
    replicates: int = REPLICATES,
    seed: int = 0,
) -> xr.Dataset:
    """Return the annual rates of overturning by stripes at levels of different measures, side by side.

    Parameters
    ----------
    runs : sequence of xarray.Dataset
        Runs of `toppling.stripes` of the same blocks under the same laws: for each measure those of motions that were
        selected at its levels.  A motion with the same `record` in several of them is the same one.
    hazards : sequence of HazardCurve
        For each of the runs the hazard curve of its measure, of the same site.  Realisations do not count.
    events : mapping, optional
        The earthquake of each motion, by `record`; motions that it does not name are earthquakes of their own.
    confidence : float
        Of the intervals, between 0 and 1.
    replicates, seed : int
        Of the bootstrap.

    Returns
    -------
    xarray.Dataset
        On measure and the dimensions of the curves, such as (block, model): `rate` (1/year) of the lognormal curve
        that is fitted to the stripes, and `rate_within`, of the stripes alone without a curve, both with intervals
        (`…_lower`, `…_upper`); `share_below` and `share_above`, the shares of `rate` from below the lowest and from
        above the highest stripe; `ratio`, `rate` over that of the first measure, with its paired interval.  On
        measure: `motions`, the ground motions; `shared`, those that the first measure has, too; `inconsistent`, the
        stripes that do not agree with the hazard, NaN where the runs do not say.  NaN where there is no curve.

    Raises
    ------
    TypeError, ValueError
        Fewer than two analyses or other than one hazard for each, runs of another design, measures of runs and hazard
        that differ, one measure twice, different blocks or laws, one level, a record that is another motion in other
        runs; otherwise as `annual_rate`.

    Notes
    -----
    The measures agree where the interval of `ratio` holds 1.  It covers the motions alone: ground motions (or all of an
    earthquake) are drawn with all their runs under every measure, those that several analyses share and those that they
    do not each keeping their number, so that what a motion does to all rates cancels in their ratio.

    rate_within = sum over the stripes of (share overturned) times the rate of levels between the geometric means of
    neighbouring stripes; the lowest and the highest stripe lie in the middle of their intervals, too.  It differs from
    `rate` by what the shares outside say, by the width of the intervals, and by the form of the curve.

    References
    ----------
    Lin, T., Haselton, C. B. and Baker, J. W. (2013). Conditional spectrum-based ground motion selection. Part I: hazard
    consistency for risk-based assessments. Earthquake Engineering & Structural Dynamics 42(12), 1847-1865.

    Examples
    --------
    >>> import toppling as tp
    >>> from toppling.fragility import HazardCurve
    >>> pool = tp.motions.CloughPenzien(duration=8.0, dt=0.02).sample(30, seed=4)
    >>> block, law = tp.Block(width=0.2, height=1.0), tp.HousnerImpact()
    >>> by_pga = tp.stripes(block, law, [pool, pool], [3.0, 4.0], "pga", ["overturned"])
    >>> by_pgv = tp.stripes(block, law, [pool, pool], [0.3, 0.4], "pgv", ["overturned"])
    >>> curves = [HazardCurve.power_law(1e-2, 2.5, "pga"), HazardCurve.power_law(3e-5, 2.5, "pgv")]
    >>> found = rates_by_measure([by_pga, by_pgv], curves, replicates=100)
    >>> found["measure"].values.tolist(), found["shared"].values.tolist(), float(found["ratio"][0].item())
    (['pga', 'pgv'], [30, 30], 1.0)
    """
    analyses, curves = _listed("runs", runs, xr.Dataset), _listed("hazards", hazards, HazardCurve)
    if len(analyses) < 2 or len(analyses) != len(curves):
        raise ValueError(
            f"runs and hazards must be of at least two measures, one of each a measure, got {len(analyses)} and "
            f"{len(curves)}"
        )
    level = checks.number("confidence", confidence, above=0.0, below=1.0)
    count = checks.count("replicates", replicates, at_least=1)
    chance = checks.count("seed", seed)
    trials = [_trials(i, one, hazard) for i, (one, hazard) in enumerate(zip(analyses, curves, strict=True))]
    measures = [one.im for one in curves]
    if len(set(measures)) < len(measures):
        raise ValueError(f"measures must differ, got {', '.join(map(str, measures))}")
    names = [list(dict.fromkeys(ground_names(one))) for one in analyses]
    _same_motions(analyses)
    drawn = _draws(names, events or {}, count, chance)
    found = []
    first = None
    for one, hazard, weights in zip(trials, curves, drawn, strict=True):
        options = Options(level, PROFILE, (), "auto", count, chance, True, weights)
        curve = fitted_curves(one, FORMS[LOGNORMAL], options).assign_attrs({**one.attrs, "im": hazard.im})
        first = curve if first is None else first
        _same_blocks(first, curve)
        found.append(_rates(one, curve, replace(hazard, realisations=None, weights=None), weights))
    assert first is not None
    dims, shape = trials[0].dims, trials[0].shape
    percent = given_percent(level)
    variables: dict[str, tuple[Any, Array, str, str]] = {}

    def add(name: str, values: Array, samples: Array, unit: str, text: str) -> None:
        lower, upper, _ = percentile_interval(samples, level)
        of_end = f"end of the {percent} interval of the {text}"
        for key, array, words in (
            (name, values, text),
            (f"{name}_lower", lower, f"lower {of_end}"),
            (f"{name}_upper", upper, f"upper {of_end}"),
        ):
            variables[key] = (("measure", *dims), array.reshape(len(found), *shape), unit, words)

    rate, samples = np.stack([one.rate for one in found]), np.stack([one.samples for one in found])
    within = np.stack([one.within for one in found])
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio, ratios = rate / rate[0], samples / samples[0]
    add("rate", rate, samples, PER_YEAR, "annual rate of overturning")
    add("rate_within", within, np.stack([one.within_samples for one in found]), PER_YEAR, "annual rate by the stripes")
    add("ratio", ratio, ratios, DIMENSIONLESS, f"rate over that by levels of {measures[0]}")
    on = ("measure", *dims)
    for side in ("below", "above"):
        shares = np.stack([getattr(one, side) for one in found]).reshape(len(found), *shape)
        variables[f"share_{side}"] = (on, shares, DIMENSIONLESS, f"share of the rate from {side} the stripes")
    sizes = np.array([len(one) for one in names])
    shared = np.array([len({*one} & {*names[0]}) for one in names])
    variables["motions"] = ("measure", sizes, DIMENSIONLESS, "ground motions")
    variables["shared"] = ("measure", shared, DIMENSIONLESS, f"ground motions that are among those of {measures[0]}")
    off = np.array([_inconsistent(one) for one in analyses])
    variables["inconsistent"] = ("measure", off, DIMENSIONLESS, "stripes that do not agree with the hazard")
    return xr.Dataset(
        {
            name: (on, values, {"units": unit, "long_name": text})
            for name, (on, values, unit, text) in variables.items()
        },
        coords={
            **{name: one for name, one in first.coords.items() if set(one.dims) <= set(dims)},
            "measure": ("measure", measures, {"units": DIMENSIONLESS, "long_name": "measure of the levels"}),
        },
        attrs={
            "title": "Annual rates by stripes of several measures",
            **provenance_from(
                "rates_by_measure",
                {
                    "hazards": [one.describe() for one in curves],
                    "confidence": level,
                    "replicates": count,
                    "seed": chance,
                    "events": dict(events or {}),
                },
                **{f"runs_{i}": one for i, one in enumerate(analyses, start=1)},
            ),
            "confidence": level,
        },
    )


def _listed(name: str, given: Any, kind: type) -> list[Any]:
    if not isinstance(given, list | tuple) or not all(isinstance(one, kind) for one in given):
        raise TypeError(f"{name} must be a list of {kind.__name__}, one a measure, got {checks.kind(given)}")
    return list(given)


def _trials(i: int, runs: xr.Dataset, hazard: HazardCurve) -> Trials:
    """Return the trials of an analysis; ValueError for another design or measure than the hazard's, or one level."""
    if "overturned" not in runs or design_of(runs) != STRIPES:
        raise ValueError(f"runs[{i}] must be those of stripes, with overturned")
    found = collect(runs)
    measure = intensity_measure(found.level["im"]) if found.level["im"] else None
    if getattr(measure, "label", "") != hazard.im:
        raise ValueError(
            f"runs[{i}] are at levels of {found.level['im'] or 'no measure'}, hazards[{i}] is of {hazard.im}"
        )
    if min(one.levels.size for one in found.samples) < 2:
        raise ValueError(f"runs[{i}] must have at least two stripes, got one")
    return found


def _same_motions(analyses: Sequence[xr.Dataset]) -> None:
    """Raise ValueError where motions of one name last differently in two analyses: pools whose labels meet."""
    known: dict[str, float] = {}
    for runs in analyses:
        if DURATION not in runs.coords or runs[DURATION].dims != ("motion",):
            continue
        own: dict[str, set[float]] = {}
        for name, duration in zip(ground_names(runs), runs[DURATION].values.tolist(), strict=True):
            own.setdefault(name, set()).add(duration)
        for name, several in own.items():
            duration = next(iter(several))
            # (histories of floors that yield differ from level to level)
            if len(several) == 1 and abs(known.setdefault(name, duration) - duration) > SAME * duration:
                raise ValueError(
                    f"record {name!r} is another motion in other runs: take motions of one pool, or label them apart"
                )


def _draws(names: Sequence[list[str]], events: Mapping[str, str], replicates: int, seed: int) -> list[Array]:
    """Return for each analysis how often each of its ground motions is drawn, (replicate, motion).

    Earthquakes that the same analyses hold are a stratum, and keep their number.
    """
    each = [[("event", events[name]) if name in events else ("motion", name) for name in own] for own in names]
    known = {event: i for i, event in enumerate(dict.fromkeys(event for own in each for event in own))}
    members: dict[tuple[bool, ...], list[int]] = {}
    holders = [set(own) for own in each]
    for event, i in known.items():
        members.setdefault(tuple(event in own for own in holders), []).append(i)
    strata: tuple[Index, ...] = tuple(np.array(one) for one in members.values())
    drawn = draw_motions(strata, replicates, seed)
    return [np.ascontiguousarray(drawn[:, [known[event] for event in own]]) for own in each]


def _same_blocks(first: xr.Dataset, curves: xr.Dataset) -> None:
    """Raise ValueError where two sets of curves are not of the same blocks, laws and floors in one order."""
    if first["median"].dims != curves["median"].dims or first["median"].shape != curves["median"].shape:
        raise ValueError(
            f"runs must be of the same blocks, laws and floors, got {dict(first['median'].sizes)} and "
            f"{dict(curves['median'].sizes)}"
        )
    for dim in first["median"].dims:
        if dim in first.coords and first[dim].values.tolist() != curves[dim].values.tolist():
            raise ValueError(f"runs must have the same {dim} labels in one order")


def _rates(trials: Trials, curves: xr.Dataset, hazard: HazardCurve, weights: Array) -> _Rates:
    found = annual_rate(curves, hazard)
    size = len(trials.samples)
    lowest = min(float(one.levels[0]) for one in trials.samples)
    highest = max(float(one.levels[-1]) for one in trials.samples)
    above_lowest, above_highest = (
        np.broadcast_to(rate_share_above(curves, hazard, at).values, found["rate"].shape).reshape(size)
        for at in (lowest, highest)
    )
    within = [_summed(one, hazard, one.cells[None]) for one in trials.samples]
    resampled = [_summed(one, hazard, one.resampled(weights)[1]) for one in trials.samples]
    return _Rates(
        found["rate"].values.reshape(size),
        found["rate_sample"].values.reshape(size, -1),
        np.concatenate(within),
        np.stack(resampled),
        np.maximum(1.0 - above_lowest, 0.0),
        above_highest,
    )


def _summed(sample: Sample, hazard: HazardCurve, cells: Array) -> Array:
    """Return the rate by the stripes alone, (replicate,), of cells (replicate, cell); NaN where a stripe has no run."""
    x = sample.levels
    middle = np.sqrt(x[:-1] * x[1:])
    bounds = np.concatenate([[x[0] ** 2 / middle[0]], middle, [x[-1] ** 2 / middle[-1]]])
    fell, ran = sample.counts_in(cells)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray((fell / ran) @ -np.diff(hazard.rate_at(bounds)))


def _inconsistent(runs: xr.Dataset) -> float:
    """Return the number of stripes that do not agree with the hazard, NaN where the runs do not say."""
    if "hazard_consistent" not in runs.coords:
        return float("nan")
    flags = runs["hazard_consistent"].values.astype(bool)
    return float(np.unique(runs["stripe"].values[~flags]).size)
