"""Intervals of fitted curves (Wald, profile likelihood, bootstrap), and the estimates that they belong to.

Forms of curves are built from factors, the probability of overturning or of uplift.  Each factor is a two-parameter
line, fitted to the data and to resampled data, with intervals of ln x of any fractile and of ln(dispersion).
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy

from ...core.elementary import Array, Index, exp, power
from ..kernels import binomial as engine
from .bootstrap import draw_counts, percentile_interval
from .likelihood import PENALTIES, FactorData, FittedLines, covariance_of, data_of, fit_lines, status_of
from .links import Link
from .states import OK, SEPARATED
from .trials import Sample

Ends = tuple[float, float]

WALD, PROFILE, BOOTSTRAP = "wald", "profile", "bootstrap"
INTERVALS = (WALD, PROFILE, BOOTSTRAP)


@dataclass(frozen=True)
class Options:
    """Options of a fit; weights (replicate, cluster) of the ground motions if these are resampled."""

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
        """True if replicates are needed."""
        return self.keep or self.intervals == BOOTSTRAP


class ResampledData(NamedTuple):
    """Resampled data of one curve: cells (replicate, cell); weights of its patterns if motions are known."""

    cells: Array
    patterns: Array | None

    @classmethod
    def of(cls, sample: Sample, options: Options, curve: int) -> "ResampledData":
        """Resample a curve's motions with the weights of the options or, of counts, level by level."""
        if options.weights is None:
            return cls(draw_counts(sample.cells, options.replicates, options.seed, curve), None)
        patterns, cells = sample.resampled(options.weights)
        return cls(cells, patterns)


class LineFits(NamedTuple):
    """Lines, the data they are fitted to, and their covariances (replicate, 3).

    `covariance`: with scores summed over each motion if motions are repeated (clustered). `plain`: from the
    information, as if runs were independent. `ways`: number of runs at a level of one motion.
    """

    lines: FittedLines
    data: FactorData
    covariance: Array
    plain: Array
    clustered: bool
    ways: int = 1

    def inflation(self, p: float | None) -> Array:
        """Return the variances over the variances of independent runs; 1 without a line or if it is penalised."""
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = self.lines.log_variances(p, self.covariance) / self.lines.log_variances(p, self.plain)
        return np.where((ratio > 0.0) & np.isfinite(ratio), ratio, 1.0)


@dataclass(frozen=True)
class Estimate:
    """Line fitted to one factor of a curve, and the lines fitted to its resampled data."""

    fits: LineFits
    status: str
    resampled: LineFits | None
    always_penalised: bool

    @property
    def lines(self) -> FittedLines:
        """The line fitted to the data."""
        return self.fits.lines

    @property
    def exists(self) -> bool:
        """True if there is an estimate."""
        return self.status in {OK, SEPARATED} and bool(np.isfinite(self.lines.a[0]))

    @property
    def penalised(self) -> bool:
        """True if the estimate maximises the penalised likelihood."""
        return self.exists and bool(self.lines.penalised[0])

    @property
    def arguments(self) -> tuple[int, int, Array, Array, Array, bool]:
        """The data of this fit alone as the kernels take them, and True if its likelihood is penalised."""
        kind, code, z, failures, runs = self.fits.data.arguments(self.lines.link)
        return kind, code, z, failures[0], runs[0], bool(self.lines.penalised[0])

    def interval_kind(self, asked: str) -> str:
        """Return the kind of interval that the data allow if `asked` is the requested kind.

        Resampled separated data are separated: neither replicates nor the curvature at the edge of the dispersion
        bound it from above.  Such data always have intervals of the profile penalised likelihood.
        """
        return PROFILE if self.status == SEPARATED else asked

    def log_value(self, p: float | None) -> float:
        """Return ln x of the fractile p, or ln(dispersion)."""
        return float(self.lines.log_values(p)[0]) if self.exists else math.nan

    def log_error(self, p: float | None) -> float:
        """Return the standard error of `log_value`."""
        if not self.exists:
            return math.nan
        return math.sqrt(max(self.lines.log_variances(p, self.fits.covariance)[0], 0.0))

    def log_interval(self, p: float | None, asked: str, confidence: float) -> Ends:
        """Return the interval of `log_value`, of the requested kind if the data allow it.

        With l the profile log-likelihood of the parameter, R = sign(estimate - parameter) sqrt(2 (l(estimate) - l)) is
        nearly normal. Its variance is 1 if runs are independent, and the ratio of the two variances (`inflation`) if
        motions are repeated (Chandler and Bate 2007). ``profile`` takes the normal quantiles of R over that ratio's
        root. ``bootstrap`` takes the quantiles of the replicates' R at the estimate, over the roots of their own ratios
        (DiCiccio, Martin and Stern 2001, with a bootstrap over motions).

        Percentiles of the replicates would repeat the estimator's bias instead of removing it. A dispersion from n
        motions is a little small, and one from n motions drawn of them is smaller still. If motions are repeated, no
        interval is narrower than the interval of independent runs. Resampling motions of large capacity gives no motion
        of small capacity, which the likelihood allows for. The coverage of each kind is measured in
        tests/fragility/fitting/test_coverage.py. The two runs of a motion that is run both ways count as one there.

        A step between the highest level without a fall and the lowest level with a fall explains separated data best.
        Intervals of levels therefore contain both.

        Chandler, R. E. and Bate, S. (2007). Biometrika 94, 167-183. DiCiccio, T. J., Martin, M. A. and Stern, S.
        E. (2001). Canadian Journal of Statistics 29, 67-76.
        """
        if not self.exists:
            return math.nan, math.nan
        kind = self.interval_kind(asked)
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
            least = math.sqrt(self.fits.ways) * z
            low, high = min(low, -least), max(high, least)
        # a positive root means a parameter below the estimate
        first, last = self._end(p, high), self._end(p, low)
        if p is None:  # a larger slope is a smaller dispersion
            whole = math.log(self.lines.link.scale * self.lines.width)
            return whole - last, whole - first
        lower, upper = self.lines.centre + self.lines.width * first, self.lines.centre + self.lines.width * last
        gap = self.fits.data.gap
        return (lower, upper) if gap is None else (min(lower, gap[0]), max(upper, gap[1]))

    def _target(self, p: float | None) -> tuple[int, float]:
        """Return the kernel's code of the parameter, and its eta."""
        return (engine.SLOPE, 0.0) if p is None else (engine.FRACTILE, float(self.lines.link.quantile(p)))

    def _roots(self, p: float | None) -> Array:
        """Return R of every replicate at the estimate, over the root of the replicate's inflation."""
        assert self.resampled is not None
        lines, data = self.resampled.lines, self.resampled.data
        what, eta = self._target(p)
        a, b = float(self.lines.a[0]), float(self.lines.b[0])
        at, free = (math.log(b), a) if p is None else ((eta - a) / b, b)
        roots = np.empty(lines.a.size)
        given = (lines.table, self.always_penalised, what, eta, at, free)
        engine.signed_roots(*data.arguments(lines.link), *given, roots)
        return roots / np.sqrt(self.resampled.inflation(p))

    def _end(self, p: float | None, root: float) -> float:
        """Return the parameter of signed root `root`, on the kernel's scale; below the estimate for positive roots."""
        what, eta = self._target(p)
        given = (what, eta, self.lines.a[0], self.lines.b[0], 0.5 * root * root, -1.0 if root > 0.0 else 1.0)
        return float(engine.profile_end(*self.arguments, *given))


def estimate(
    link: Link, sample: Sample, outcomes: Index | None, options: Options, drawn: ResampledData | None
) -> Estimate:
    """Fit one factor of a curve; `outcomes` is the outcome of each cell (None: intervals of first overturning)."""

    def fits_of(data: FactorData, weights: Array | None, penalty: str, start: FittedLines | None = None) -> LineFits:
        lines = fit_lines(link, data, penalty, start)
        plain = covariance_of(lines, data)
        if not sample.repeated or weights is None:
            return LineFits(lines, data, plain, plain, False)
        summed = covariance_of(lines, data, outcomes, sample.patterns, weights)
        # separated data have at most one level with both outcomes, and there each motion counts once (or both ways,
        # which may always agree)
        alone = (lines.status == engine.SEPARATED)[:, None]
        return LineFits(lines, data, np.where(alone, sample.ways * plain, summed), plain, True, sample.ways)

    data = data_of(sample.levels, sample.cells[None], outcomes)
    weights = None if sample.patterns is None else sample.resampled(np.ones((1, sample.patterns.of_cluster.size)))[0]
    fits = fits_of(data, weights, options.penalty)
    status = status_of(fits.lines, data, fits.covariance)
    always = PENALTIES[options.penalty] == engine.ALWAYS
    if drawn is None:
        return Estimate(fits, status, None, always)
    # a separated replicate is penalised, whichever penalty the fit to the data has
    penalty = "auto" if options.penalty == "none" else options.penalty
    more = data_of(sample.levels, drawn.cells, outcomes, data)
    return Estimate(fits, status, fits_of(more, drawn.patterns, penalty, fits.lines), always)


def median_bound(sample: Sample, confidence: float) -> Ends:
    """Return the one-sided interval of the median if no run overturned, or all did; NaN in other cases.

    Let the median be at or below a level. Each of the N independent runs at or above it does not overturn with a
    probability of at most one half. All of them do not overturn with at most 2^-N. The highest level at which this is
    no more than 1 - confidence is a lower bound, for any curve that does not fall. With one level it is Clopper and
    Pearson's: their bound of the probability there is below one half. Runs of one motion count once.
    """
    overturnings, runs = sample.level_counts
    nothing, everything = not overturnings.any(), bool((overturnings == runs).all())
    if nothing == everything:
        return math.nan, math.nan
    levels = sample.levels
    # independent runs at each level and beyond
    if sample.repeated:
        beyond = sample.motions_beyond(below=everything)
    elif sample.by_interval:
        beyond = runs
    else:
        beyond = np.cumsum(runs) if everything else np.cumsum(runs[::-1])[::-1]
    if everything:
        levels, beyond = levels[::-1], beyond[::-1]
    enough = np.flatnonzero(power(0.5, beyond) <= 1.0 - confidence)
    if not enough.size:
        return math.nan, math.nan
    bound = float(levels[enough[-1]])
    return (bound, math.inf) if nothing else (0.0, bound)


def unlogged(value: float) -> float:
    """Return exp(value), infinite if it is too large for a float."""
    return float(exp(value))
