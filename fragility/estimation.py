"""One probability of a curve - that a block falls, or that it uplifts - estimated, with intervals of any kind.

What forms of curves are built from: a two-parameter line fitted to the data and to resampled data, and intervals of
ln x of any fractile and of ln(dispersion).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from . import _binomial as engine
from .bootstrap import draw_counts, percentile_interval
from .likelihood import PENALTIES, Data, Lines, covariance_of, data_of, fit_lines, status_of
from .links import Link
from .statuses import OK, SEPARATED
from .trials import Index, Sample

Array = NDArray[np.float64]
Ends = tuple[float, float]

WALD, PROFILE, BOOTSTRAP = "wald", "profile", "bootstrap"
INTERVALS = (WALD, PROFILE, BOOTSTRAP)
TOLERANCE = 1e-12
DISPERSION = None
"""Stands for ln(dispersion) where a probability stands for ln x of that fractile."""


@dataclass(frozen=True)
class Options:
    """What is asked of a fit; weights (replicate, cluster) of the ground motions, where they are drawn."""

    confidence: float
    intervals: str
    fractiles: tuple[float, ...]
    penalty: str
    replicates: int
    seed: int
    keep: bool
    weights: Array | None = None

    @property
    def resamples(self) -> bool:
        """Whether replicates are needed."""
        return self.keep or self.intervals == BOOTSTRAP


class Resampled(NamedTuple):
    """The data of one curve drawn anew: cells (replicate, cell); weights of its patterns where motions are known."""

    cells: Array
    patterns: Array | None

    @classmethod
    def of(cls, sample: Sample, options: Options, curve: int) -> Resampled:
        """Drawn as the weights say, or, of counts, level by level."""
        if options.weights is None:
            return cls(draw_counts(sample.cells, options.replicates, options.seed, curve), None)
        patterns, cells = sample.resampled(options.weights)
        return cls(cells, patterns)


class Fits(NamedTuple):
    """Lines, the data they are fitted to, and their covariances (replicate, 3).

    covariance: with scores summed over each motion where motions come more than once (clustered); plain: from the
    information, as if runs were independent.
    """

    lines: Lines
    data: Data
    covariance: Array
    plain: Array
    clustered: bool

    def log_values(self, p: float | None) -> Array:
        """Ln x of the fractile p, or ln(dispersion), (replicate,)."""
        return self.lines.log_dispersion if p is None else self.lines.log_fractile(p)

    def log_variances(self, p: float | None) -> Array:
        """Their variances."""
        return self._variances(p, self.covariance)

    def inflation(self, p: float | None) -> Array:
        """Their variances over those of independent runs; 1 where there is no line or it is penalised."""
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = self.log_variances(p) / self._variances(p, self.plain)
        return np.where((ratio > 0.0) & np.isfinite(ratio), ratio, 1.0)

    def _variances(self, p: float | None, covariance: Array) -> Array:
        if p is None:
            return self.lines.log_dispersion_variance(covariance)
        return self.lines.log_fractile_variance(p, covariance)


@dataclass(frozen=True)
class Estimate:
    """A line fitted to one factor of a curve, and to its resampled data."""

    fits: Fits
    status: str
    again: Fits | None
    always: bool

    @property
    def lines(self) -> Lines:
        """The line itself."""
        return self.fits.lines

    @property
    def found(self) -> bool:
        """Whether there is an estimate."""
        return self.status in {OK, SEPARATED} and bool(np.isfinite(self.lines.a[0]))

    @property
    def penalised(self) -> bool:
        """Whether it is of the penalised likelihood."""
        return self.found and bool(self.lines.penalised[0])

    def kind(self, asked: str) -> str:
        """The kind of interval given where `asked` is wanted.

        Resampling separated data gives separated data: replicates say nothing of how large the dispersion may be, nor
        does the curvature at its edge.  There it is the profile of the penalised likelihood whatever is asked.
        """
        return PROFILE if self.status == SEPARATED else asked

    def log_value(self, p: float | None) -> float:
        """Ln x of the fractile p, or ln(dispersion)."""
        return float(self.fits.log_values(p)[0]) if self.found else math.nan

    def log_error(self, p: float | None) -> float:
        """Its standard error."""
        return math.sqrt(max(self.fits.log_variances(p)[0], 0.0)) if self.found else math.nan

    def log_interval(self, p: float | None, asked: str, confidence: float) -> Ends:
        """Its interval of the asked kind.

        Notes
        -----
        With l the profile log-likelihood of the parameter, R = sign(estimate - parameter) sqrt(2 (l(estimate) - l)) is
        nearly normal, of variance 1 where runs are independent and of the ratio of the two variances (`inflation`)
        where motions come more than once (Chandler and Bate 2007).  ``profile`` takes the normal quantiles of R over
        that ratio's root; ``bootstrap`` those of the replicates' R at the estimate, over the roots of their own
        ratios (DiCiccio, Martin and Stern 2001, with a bootstrap over motions).

        Percentiles of the replicates would repeat the estimator's bias instead of taking it out: a dispersion from n
        motions is a little small, one from n drawn of them smaller still.  And where motions come more than once no
        interval is narrower than that of independent runs: resampled motions that fall late do not make one that falls
        early, which the likelihood reckons with (tests/test_fit_coverage.py measures what each covers).

        References
        ----------
        Chandler, R. E. and Bate, S. (2007). Inference for clustered data using the independence loglikelihood.
        Biometrika 94, 167-183.

        DiCiccio, T. J., Martin, M. A. and Stern, S. E. (2001). Simple and accurate one-sided inference from signed
        roots of likelihood ratios. Canadian Journal of Statistics 29, 67-76.
        """
        if not self.found:
            return math.nan, math.nan
        kind = self.kind(asked)
        z = float(scipy.special.ndtri(0.5 + 0.5 * confidence))
        if kind == WALD:
            value, error = self.log_value(p), self.log_error(p)
            return value - z * error, value + z * error
        low, high = -z, z
        if kind != PROFILE:
            ends = percentile_interval(self._roots(p), confidence, against=True)
            low, high = float(ends.lower), float(ends.upper)
        scale = math.sqrt(self.fits.inflation(p)[0])
        low, high = low * scale, high * scale
        if self.fits.clustered:
            low, high = min(low, -z), max(high, z)
        # where the estimate came out high, the parameter is lower
        first, last = self._end(p, high), self._end(p, low)
        if p is None:  # a larger slope is a smaller dispersion
            whole = math.log(self.lines.link.scale * self.lines.width)
            return whole - last, whole - first
        return self.lines.centre + self.lines.width * first, self.lines.centre + self.lines.width * last

    def _target(self, p: float | None) -> tuple[int, float]:
        """What the engine calls the parameter: its kind and eta."""
        return (engine.SLOPE, 0.0) if p is None else (engine.FRACTILE, float(self.lines.link.quantile(p)))

    def _roots(self, p: float | None) -> Array:
        """R of every replicate at the estimate, over the root of its inflation."""
        assert self.again is not None
        lines, data = self.again.lines, self.again.data
        what, eta = self._target(p)
        a, b = float(self.lines.a[0]), float(self.lines.b[0])
        at, free = (math.log(b), a) if p is None else ((eta - a) / b, b)
        roots = np.empty(lines.a.size)
        engine.signed_roots(
            data.kind,
            lines.link.code,
            data.z,
            data.falls,
            data.runs,
            lines.table,
            self.always,
            what,
            eta,
            at,
            free,
            roots,
        )
        return roots / np.sqrt(self.again.inflation(p))

    def _end(self, p: float | None, root: float) -> float:
        """Where the root of the profile is `root`: on the scale of the engine, below the estimate for positive ones."""
        what, eta = self._target(p)
        lines, data = self.lines, self.fits.data
        return float(
            engine.profile_end(
                data.kind,
                lines.link.code,
                data.z,
                data.falls[0],
                data.runs[0],
                bool(lines.penalised[0]),
                what,
                eta,
                lines.a[0],
                lines.b[0],
                0.5 * root * root,
                -1.0 if root > 0.0 else 1.0,
                TOLERANCE,
            )
        )


def estimate(link: Link, sample: Sample, outcomes: Index | None, options: Options, drawn: Resampled | None) -> Estimate:
    """Fit one factor of a curve: `outcomes` says what each cell is to it (None: intervals of first overturning)."""
    data = data_of(sample.levels, sample.cells[None], outcomes)
    own = sample.resampled(np.ones((1, sample.patterns.of_cluster.size)))[0] if sample.patterns is not None else None
    fits = _fits(link, sample, outcomes, data, own, options.penalty, None)
    status = status_of(fits.lines, data, fits.covariance)
    always = PENALTIES[options.penalty] == engine.ALWAYS
    if drawn is None:
        return Estimate(fits, status, None, always)
    # a replicate is penalised where it is separated, whatever is done with the data
    penalty = "auto" if options.penalty == "none" else options.penalty
    more = data_of(sample.levels, drawn.cells, outcomes, data)
    return Estimate(fits, status, _fits(link, sample, outcomes, more, drawn.patterns, penalty, fits.lines), always)


def _fits(
    link: Link,
    sample: Sample,
    outcomes: Index | None,
    data: Data,
    weights: Array | None,
    penalty: str,
    start: Lines | None,
) -> Fits:
    lines = fit_lines(link, data, penalty, start)
    plain = covariance_of(lines, data)
    if not sample.repeated or weights is None:
        return Fits(lines, data, plain, plain, False)
    summed = covariance_of(lines, data, outcomes, sample.patterns, weights)
    # separated data have one level at most that is not settled, where each motion counts once
    alone = (lines.status == engine.SEPARATED)[:, None]
    return Fits(lines, data, np.where(alone, plain, summed), plain, True)


def median_bound(sample: Sample, confidence: float) -> Ends:
    """What runs of which none overturned, or all, say of the median: a one-sided interval; NaN of others.

    Where the median were at or below a level, each of the N independent runs at or above it would stand with a
    probability of one half at most, and all of them with 2^-N at most: the highest level at which that is no more than
    1 - confidence is a lower bound, for any curve that does not fall (with one level it is Clopper and Pearson's:
    their bound of the probability there is below one half).  Runs of one motion count once.
    """
    overturnings, runs = sample.of_levels
    nothing, everything = not overturnings.any(), bool((overturnings == runs).all())
    if nothing == everything:
        return math.nan, math.nan
    levels = sample.levels
    if everything:
        levels, runs = levels[::-1], runs[::-1]
    # independent runs at each level and beyond
    counted = np.maximum if sample.repeated or sample.first else np.add
    beyond = counted.accumulate(runs[::-1])[::-1]
    enough = np.flatnonzero(0.5**beyond <= 1.0 - confidence)
    if not enough.size:
        return math.nan, math.nan
    bound = float(levels[enough[-1]])
    return (bound, math.inf) if nothing else (0.0, bound)


def unlogged(value: float) -> float:
    """Exp(value), infinite where that is too large for a float."""
    with np.errstate(over="ignore"):
        return float(np.exp(value))
