"""Levels at which shares of the runs overturn, from the runs themselves: no form of curve is taken through all of them.

Its tails pull a lognormal curve through all levels, so that half of the runs need not overturn at its median.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import scipy

from ...core.elementary import Array, Flags, Index, exp, expm1, log, log1p
from ...core.units import ENDS
from .form import Columns
from .intervals import Estimate, Options, estimate
from .labels import OBSERVED
from .links import LINKS, LOGNORMAL, Link
from .states import ALL, NO_RUNS, NONE
from .trials import OVERTURNING_OUTCOMES, Sample, outcomes_of

HALF, LOW = 0.5, 0.1
"""Shares whose levels are compared with the fitted curve's levels."""
COMMON = 3
"""Median number of runs per level from which levels count as common."""
WINDOW, MOTIONS = 1.2, 20
"""Half width, in dispersions, of the window in which runs of that many motions count as near; it falls with the cube
root of their number."""
PLACES = 400


class Bend(NamedTuple):
    """A distribution that curves may follow between levels: its inverse, its density there, and itself."""

    inverse: Callable[[Any], Any]
    chance: Callable[[Array], Array]
    density: Callable[[float], float]


def _density(score: float) -> float:
    return math.exp(-0.5 * score * score) / math.sqrt(2.0 * math.pi)


BENDS = (
    Bend(LINKS[LOGNORMAL].quantile, LINKS[LOGNORMAL].cumulative, _density),
    Bend(lambda p: log(-log1p(-p)), lambda s: -expm1(-exp(s)), lambda s: math.exp(s - math.exp(s))),
    Bend(lambda p: -log(-log(p)), lambda s: exp(-exp(-s)), lambda s: math.exp(-s - math.exp(-s))),
)
"""Normal and both extreme-value distributions: intervals include curves that are straight on any of these scales."""


def levels_of_shares(sample: Sample, shares: tuple[float, ...], options: Options) -> Array:
    """Return the levels (share, 3) at which shares of the runs overturn, with the lower and upper end of the interval.

    Levels are 0 below the lowest level and infinite above the highest one; NaN without runs, or without runs nearby.

    *Common levels.* Straight lines in normal scores over ln x join the observed shares, made non-decreasing (isotonic
    regression). The interval of the level of a share q ends at q -/+ t sqrt(q (1 - q)/n). It has n independent motions
    per level and Student's t with n - 1 degrees of freedom. It contains the levels at which a test of q against the
    observed share does not reject q (Wilson, E. B. (1927). Journal of the American Statistical Association 22,
    209-212). Each motion counts once per level, so no dependence between levels is assumed. The curve between levels is
    unknown: the interval is the widest one for three distributions.

    *Individual levels* (clouds, adaptive levels). Near a level x0 the probability follows a curve through q with the
    dispersion of the lognormal curve through all runs. The interval contains each x0 for which the residuals of the
    nearby runs sum to at most t standard deviations; at the level itself they sum to 0. Residuals of one motion are
    summed first. Fits to the runs nearby: Fan, J., Heckman, N. E. and Wand, M. P. (1995). Journal of the American
    Statistical Association 90, 141-150.
    """
    fell, runs = sample.level_counts
    if not runs.any():
        return np.full((len(shares), 3), np.nan)
    if not (sample.by_interval or _common(runs, sample.ways)):
        return _near(sample, shares, options)
    motions = runs / sample.ways
    if sample.patterns is not None:
        motions = np.minimum(motions, np.count_nonzero(sample.patterns.of_cluster >= 0))
    used = runs > 0
    return _along(sample.levels[used], fell[used] / runs[used], motions[used], shares, options.confidence)


def half_levels_of(sample: Sample, weights: Array, options: Options) -> Array:
    """Return the level at which half of the runs overturn in each replicate of the motions, (replicate,).

    weights (replicate, cluster): number of draws of each motion. Rules as in `levels_of_shares`. A common
    level without runs in a replicate takes its share from its neighbours. Runs at individual levels keep the window and
    the dispersion of the line through all of them.
    """
    if not (sample.by_interval or _common(sample.level_counts[1], sample.ways)):
        return _near_again(sample, weights, options)
    fell, runs = sample.counts_in(sample.resampled(weights)[1])
    x, rows, last = log(sample.levels), np.arange(weights.shape[0]), sample.levels.size - 1
    scores = BENDS[0].inverse(_clipped(_rising_of(fell, runs), np.maximum(runs, 1.0) / sample.ways))
    ends = []
    for below in ((scores < 0.0).sum(axis=1), (scores <= 0.0).sum(axis=1)):  # (as `_passed`, first and last)
        after = np.clip(below, 1, last)
        low, high = scores[rows, after - 1], scores[rows, after]
        with np.errstate(divide="ignore", invalid="ignore"):
            level = x[after - 1] - low / (high - low) * (x[after] - x[after - 1])
        level = np.where(below > 0, level, np.where(scores[:, 0] == 0.0, x[0], -np.inf))
        ends.append(np.where(below <= last, level, np.where(scores[:, -1] == 0.0, x[-1], np.inf)))
    return np.where((runs > 0.0).any(axis=1), exp(0.5 * (ends[0] + ends[1])), np.nan)


def observed_columns(sample: Sample, fitted: Columns, link: Link | None, options: Options) -> Columns:
    """Return the columns of the levels of shares of the runs, and of the misfits of the fitted curve.

    link: of a curve of two parameters; its `LOW` fractile is compared, too.
    """
    half, low, *rest = levels_of_shares(sample, (HALF, LOW, *options.fractiles), options)
    if fitted["status"] in (NONE, ALL, NO_RUNS):  # (the status says why there is no level)
        half[0] = low[0] = math.nan
    median = tenth = math.nan
    if link is not None:
        median = float(fitted["median"])
        score = link.quantile(LOW) - link.quantile(HALF)
        tenth = median * math.exp(score * float(fitted["dispersion"]) / link.scale)
    columns = {f"half_level{end}": value for end, value in zip(ENDS, half, strict=True)}
    fell, runs = sample.level_counts
    if _common(runs, sample.ways):
        columns[OBSERVED] = fell / np.maximum(runs, 1)
    columns |= {f"fraction_level{end}": np.array([level[i] for level in rest]) for i, end in enumerate(ENDS)}
    return columns | {"misfit": _missed(median, half), "misfit_low": _missed(tenth, low)}


def _common(runs: Index, ways: int) -> bool:
    """Return True if levels are common to motions."""
    return bool(runs.any() and np.median(runs[runs > 0]) >= COMMON * ways)


def _missed(fitted: float, seen: Array) -> float:
    """Return a fitted level over the level of the runs, less 1; 0 if their interval contains it, or none is known."""
    value, lower, upper = seen.tolist()
    if not math.isfinite(fitted) or math.isnan(value) or lower <= fitted <= upper:
        return 0.0
    # (where the level itself is not reached, its interval ends at the outermost level)
    near = value if 0.0 < value < math.inf else lower if fitted < lower else upper
    return fitted / near - 1.0 if near > 0.0 else 0.0


def _along(levels: Array, seen: Array, motions: Array, shares: tuple[float, ...], confidence: float) -> Array:
    """Return the levels of shares along common levels, from the share seen at each and the number of motions there."""
    rising = _rising(seen, motions)
    x, held = log(levels), _clipped(rising, motions)
    log_levels = np.empty((len(shares), 3))
    normal = BENDS[0].inverse(held)
    for row, share in zip(log_levels, shares, strict=True):
        n = float(motions[np.abs(rising - share).argmin()])
        half = math.inf if n <= 1.0 else float(scipy.special.stdtrit(n - 1.0, 0.5 + 0.5 * confidence))
        half *= math.sqrt(share * (1.0 - share) / n)
        # (where the line is level, the share is reached anywhere on it)
        score = float(scipy.special.ndtri(share))
        row[0] = 0.5 * sum(_passed(x, normal, score, first=first) for first in (True, False))
        row[1:] = -math.inf, math.inf
        if share > half:
            ends = rising == 1.0
            at = [_passed(x, bend.inverse(held), bend.inverse(share - half), first=True, ends=ends) for bend in BENDS]
            row[1] = min(x[-1], *at)
        if share + half < 1.0:
            ends = rising == 0.0
            at = [_passed(x, bend.inverse(held), bend.inverse(share + half), first=False, ends=ends) for bend in BENDS]
            row[2] = max(x[0], *at)
    return exp(log_levels)


def _clipped(rising: Array, motions: Array) -> Array:
    """Return non-decreasing shares without 0 and 1, which have no score."""
    least = 0.25 / motions
    return np.maximum.accumulate(np.clip(rising, least, 1.0 - least), axis=-1)


def _rising_of(fell: Array, runs: Array) -> Array:
    """Return the non-decreasing shares (replicate, level): as `_rising`, of all replicates at once.

    At a level it is the maximum over starts before it of the minimum over ends after it of the share between the two
    (Robertson, T., Wright, F. T. and Dykstra, R. L. (1988). Order restricted statistical inference. Wiley; recalled).
    """
    levels = fell.shape[1]
    summed = [np.cumsum(np.pad(counts, ((0, 0), (1, 0))), axis=1) for counts in (fell, runs)]
    rising = np.full(fell.shape, -np.inf)
    for start in range(levels):
        total, number = (sums[:, start + 1 :] - sums[:, [start]] for sums in summed)
        with np.errstate(divide="ignore", invalid="ignore"):
            share = total / number
        smallest = np.fmin.accumulate(share[:, ::-1], axis=1)[:, ::-1]
        rising[:, start:] = np.fmax(rising[:, start:], smallest)
    return rising


def _rising(shares: Array, weights: Array) -> Array:
    """Return the non-decreasing shares nearest to some, by pooling adjacent violators.

    (`scipy.optimize` has it, and takes a tenth of a second to load.)
    """
    pools: list[tuple[float, float, int]] = []
    for share, weight in zip(shares.tolist(), weights.tolist(), strict=True):
        last = (share * weight, weight, 1)
        while pools and pools[-1][0] * last[1] >= last[0] * pools[-1][1]:
            last = tuple(a + b for a, b in zip(pools.pop(), last, strict=True))
        pools.append(last)
    total, weight, levels = np.array(pools).T
    return np.repeat(total / weight, levels.astype(np.int64))


def _passed(x: Array, scores: Array, score: float, *, first: bool, ends: Flags | None = None) -> float:
    """Return the first ln x at which a line through rising scores reaches one, or the last at which it is not above it.

    ends (level,): levels whose scores are not known but to lie further out: the line to them may be a step.
    """
    below = int(np.searchsorted(scores, score, side="left" if first else "right"))
    if below == 0:
        return float(x[0]) if scores[0] == score else -math.inf
    if below == x.size:
        return float(x[-1]) if scores[-1] == score else math.inf
    if ends is not None and ends[below if first else below - 1]:
        return float(x[below - 1] if first else x[below])
    low, high = scores[below - 1], scores[below]
    return float(x[below - 1] + (score - low) / (high - low) * (x[below] - x[below - 1]))


def _near(sample: Sample, shares: tuple[float, ...], options: Options) -> Array:
    """Return the levels of shares by the runs near each."""
    log_levels = np.full((len(shares), 3), np.nan)
    line = _line(sample, replace(options, penalty="auto", keep=False))
    if not line.exists:
        return log_levels
    motion, fell, places, away, near = _about(sample, line)
    motions, scale = int(motion[-1]) + 1, math.exp(line.log_value(None))
    t = scipy.special.stdtrit(np.maximum(near.sum(axis=1) - 1.0, 1.0), 0.5 + 0.5 * options.confidence)
    for row, share in zip(log_levels, shares, strict=True):
        steep = _density(float(scipy.special.ndtri(share))) / scale
        ends = []
        for bend in BENDS:
            score = float(bend.inverse(share))
            chance = bend.chance(score + away * steep / bend.density(score))
            residual = np.where(near, fell - chance, 0.0)
            spread = np.where(near, chance * (1.0 - chance), 0.0).sum(axis=1)
            if sample.repeated:
                summed = np.zeros((motions, PLACES))
                np.add.at(summed, motion, residual.T)
                spread = np.maximum(spread, (summed**2).sum(axis=0))
            away_by = residual.sum(axis=1) / np.sqrt(np.maximum(spread, 1e-300))
            crossed = np.flatnonzero((away_by[:-1] < 0.0) & (away_by[1:] >= 0.0))
            if not crossed.size:
                continue
            at = crossed[np.abs(places[crossed] - line.log_value(share)).argmin()]
            low, high = np.flatnonzero((away_by < -t)[: at + 1]), np.flatnonzero((away_by > t)[at + 1 :])
            ends.append(
                [
                    np.interp(0.0, away_by[at : at + 2], places[at : at + 2]),
                    places[low[-1]] if low.size else -np.inf,
                    places[at + 1 + high[0]] if high.size else np.inf,
                ]
            )
        if ends:
            levels, lower, upper = zip(*ends, strict=True)
            row[:] = levels[0], min(lower), max(upper)
    return np.asarray(exp(log_levels))


def _about(sample: Sample, line: Estimate) -> tuple[Index, Flags, Array, Array, Flags]:
    """Return motions and falls of runs, places along ln x, distances of runs to them (place, run), and who is near."""
    motion, level, fell = sample.single_runs
    x, motions = log(sample.levels[level]), int(motion[-1]) + 1
    reach = WINDOW * math.exp(line.log_value(None)) * (MOTIONS / motions) ** (1.0 / 3.0)
    places = np.linspace(x.min(), x.max(), PLACES)
    away = x - places[:, None]
    return motion, fell, places, away, np.abs(away) <= reach


def _near_again(sample: Sample, weights: Array, options: Options) -> Array:
    """Return the levels of half by the runs near each, of replicates of the motions."""
    line = _line(sample, replace(options, penalty="auto", keep=False))
    if not line.exists:
        return np.full(weights.shape[0], np.nan)
    motion, fell, places, away, near = _about(sample, line)
    summed = np.zeros((int(motion[-1]) + 1, PLACES))
    chance = BENDS[0].chance(away / math.exp(line.log_value(None)))
    np.add.at(summed, motion, np.where(near, fell - chance, 0.0).T)
    assert sample.patterns is not None
    residual = weights[:, np.flatnonzero(sample.patterns.of_cluster >= 0)] @ summed
    before, after = residual[:, :-1], residual[:, 1:]
    crossed = (before < 0.0) & (after >= 0.0)
    distance = np.where(crossed, np.abs(places[:-1] - line.log_value(HALF)), np.inf)
    rows, at = np.arange(weights.shape[0]), distance.argmin(axis=1)
    low, high = before[rows, at], after[rows, at]
    with np.errstate(divide="ignore", invalid="ignore"):
        level = places[at] - low / (high - low) * (places[1] - places[0])
    return np.asarray(exp(np.where(crossed.any(axis=1), level, np.nan)))


def _line(sample: Sample, options: Options) -> Estimate:
    return estimate(LINKS[LOGNORMAL], sample, outcomes_of(OVERTURNING_OUTCOMES, sample.levels.size), options, None)
