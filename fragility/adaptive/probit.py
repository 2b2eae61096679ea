"""Probit curves through runs of many levels, with errors from the sums of each motion's scores.

Runs of one motion are dependent, even at levels that differ by a thousandth. The precision therefore depends on the
number of motions, not of runs.
"""

import math
from typing import NamedTuple

import numpy as np
import scipy

from ...core.elementary import Array, Flags, Index, exp, inverse, times
from ...core.parameters import USUAL_CONFIDENCE
from ..fitting.likelihood import STATUSES, FactorData, FittedLines, fit_lines
from ..fitting.links import LINKS, LOGNORMAL, Link
from ..fitting.trials import gap_between
from ..kernels import binomial as engine

ROUNDS = 4
"""Maximum number of times that the window of a local fit is moved to its median."""
SETTLED = 1e-3
FEWEST = 8
"""Fewest motions in a fit that errors are computed of."""


class Observations(NamedTuple):
    """Runs of one curve: ln of the level (run,), flag of overturning (run,), number of the motion (run,)."""

    x: Array
    fell: Flags
    motion: Index

    def within(self, centre: float, reach: float) -> "Observations":
        """Return the runs whose ln level is no further than `reach` from `centre`."""
        # (a level at the edge of the window must not come and go with the rounding of its logarithm)
        near = np.abs(self.x - centre) <= reach * (1.0 + 1e-9)
        return Observations(self.x[near], self.fell[near], self.motion[near])


class Estimate(NamedTuple):
    """Estimate with its error and its influences: contribution of each motion, (motion,) from number 0 on."""

    value: float
    error: float
    influence: Array
    motions: int

    @property
    def reach(self) -> float:
        """Half width of the interval by Student's t, two motions fewer than there are; infinite with few motions."""
        return student(self.motions - 2) * self.error

    def proportion(self) -> tuple[float, float]:
        """Return the interval of an estimate of a probability: Wilson's, for the number of runs that its error implies.

        A probability p with a standard error s is as precise as from p (1 - p)/s² independent runs. Near 0 and 1 the
        interval by the error alone would be too short if few runs fell or few did not. Wilson, E. B. (1927). Journal of
        the American Statistical Association 22, 209-212. Effective number of runs: Korn, E. L. and Graubard, B. I.
        (1998). Survey Methodology 24, 193-201.
        """
        t = student(self.motions - 2)
        spread = self.value * (1.0 - self.value)
        if not (math.isfinite(t) and spread > 0.0):
            return 0.0, 1.0
        share = (t * self.error) ** 2 / spread
        middle = (self.value + 0.5 * share) / (1.0 + share)
        half = math.sqrt(share * spread + 0.25 * share**2) / (1.0 + share)
        return max(0.0, middle - half), min(1.0, middle + half)


def student(freedom: float) -> float:
    """Return the quantile of Student's t for an interval of 95 %; infinite without a degree of freedom."""
    return float(scipy.special.stdtrit(freedom, 0.5 + 0.5 * USUAL_CONFIDENCE)) if freedom >= 1 else math.inf


def difference(first: Estimate, second: Estimate) -> tuple[float, float]:
    """Return one estimate less another from the same motions, and the standard error of the difference."""
    size = max(first.influence.size, second.influence.size)
    influence = np.pad(first.influence, (0, size - first.influence.size)) - np.pad(
        second.influence, (0, size - second.influence.size)
    )
    return first.value - second.value, math.sqrt(times(influence, influence))


class Probit(NamedTuple):
    """Curve Phi(a + b (x - centre)/width), x = ln level, with the influence (motion, 2) of each motion on a and b.

    `influence` is the inverse of the observed information times the sum of a motion's scores; its sum of squares is the
    sandwich estimate of the covariance.
    """

    line: FittedLines
    influence: Array
    information: Array
    motions: int

    @property
    def log_median(self) -> float:
        """Ln of the level at which half of the blocks overturn."""
        return float(self.line.log_values(0.5)[0])

    @property
    def dispersion(self) -> float:
        """Standard deviation of ln(capacity)."""
        return math.exp(float(self.line.log_values(None)[0]))

    def median(self) -> Estimate:
        """Return the estimate of ln(median)."""
        a, b = float(self.line.a[0]), float(self.line.b[0])
        return self._estimate(self.log_median, np.array([-1.0, a / b]) * (self.line.width / b))

    def log_dispersion(self) -> Estimate:
        """Return the estimate of ln(dispersion)."""
        return self._estimate(math.log(self.dispersion), np.array([0.0, -1.0 / float(self.line.b[0])]))

    def probability(self, x: float) -> Estimate:
        """Return the estimate of the probability at a ln level."""
        z = (x - self.line.centre) / self.line.width
        eta = float(self.line.a[0] + self.line.b[0] * z)
        slope = math.exp(-0.5 * eta * eta) / math.sqrt(2.0 * math.pi)
        return self._estimate(float(scipy.special.ndtr(eta)), slope * np.array([1.0, z]))

    def weighted(self, x: Array, weights: Array) -> Estimate:
        """Return the estimate of the sum of weights (point,) times the probabilities at ln levels (point,)."""
        z = (x - self.line.centre) / self.line.width
        eta = float(self.line.a[0]) + float(self.line.b[0]) * z
        slopes = weights * exp(-0.5 * eta * eta) / math.sqrt(2.0 * math.pi)
        return self._estimate(
            float((weights * scipy.special.ndtr(eta)).sum()), np.array([slopes.sum(), (slopes * z).sum()])
        )

    def _estimate(self, value: float, gradient: Array) -> Estimate:
        """Return an estimate from its gradient in (a, b); its error is not below the error of independent runs."""
        k = self.motions
        if k < FEWEST:
            return Estimate(value, math.inf, np.zeros(0), k)
        influence = math.sqrt(k / (k - 1.0)) * times(self.influence, gradient)
        covariance = inverse(self.information)
        alone = float(times(times(gradient, covariance), gradient))
        return Estimate(value, math.sqrt(max(float(times(influence, influence)), alone)), influence, k)


def enclosing(estimate: Estimate, runs: Observations) -> Estimate:
    """Return an estimate of ln(median) whose interval spans the gap if all falls lie above all runs without a fall.

    Between the two the runs give no information: the estimate is the middle, and its interval reaches at least to both
    ends.
    """
    gap = gap_between(runs.x, ~runs.fell, runs.fell)
    if gap is None:
        return estimate
    low, high = gap
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    return estimate._replace(value=middle, error=max(estimate.error, half / student(estimate.motions - 2)))


def fit_probit(runs: Observations) -> tuple[Probit | None, str]:
    """Return the probit curve of runs (penalised if separated) or None, and the status as of `fit_fragility`.

    Errors are the sandwich estimate with clusters: Liang, K.-Y. and Zeger, S. L. (1986). Biometrika 73, 13-22. Penalty:
    Firth, D. (1993). Biometrika 80, 27-38.
    """
    if not runs.x.size:
        return None, STATUSES[engine.NO_RUNS]
    line = fit_line(runs, LINKS[LOGNORMAL])
    status = STATUSES[line.status[0]]
    if not np.isfinite(line.a[0]):
        return None, status
    haa, hab, hbb = (float(line.table[0, column]) for column in (engine.HAA, engine.HAB, engine.HBB))
    information = np.array([[haa, hab], [hab, hbb]])
    if not (haa > 0.0 and haa * hbb - hab * hab > 0.0):
        return None, STATUSES[engine.FAILED]
    z = (runs.x - line.centre) / line.width
    scores = _scores(float(line.a[0]) + float(line.b[0]) * z, runs.fell)
    size = int(runs.motion.max()) + 1
    summed = np.stack([np.bincount(runs.motion, values, size) for values in (scores, scores * z)], axis=1)
    influence = times(summed, inverse(information))
    return Probit(line, influence, information, np.unique(runs.motion).size), status


def fit_line(runs: Observations, link: Link) -> FittedLines:
    """Fit a curve of two parameters to runs, one at least, penalised (Firth) if they are separated."""
    distinct, where = np.unique(runs.x, return_inverse=True)
    centre, width = float(distinct.mean()), max(float(np.ptp(distinct)), 1e-12)
    counts = np.bincount(where).astype(np.float64)[None]
    failures = np.bincount(where, runs.fell).astype(np.float64)[None]
    data = FactorData(engine.BINOMIAL, distinct, centre, width, (distinct - centre) / width, failures, counts)
    return fit_lines(link, data, "auto")


def _scores(eta: Array, fell: Flags) -> Array:
    """Return the slope of the log-likelihood of each run in eta: phi/Phi if it fell, -phi/(1 - Phi) if not."""
    log_density = -0.5 * eta * eta - 0.5 * math.log(2.0 * math.pi)
    sign = np.where(fell, 1.0, -1.0)
    return np.asarray(sign * exp(log_density - scipy.special.log_ndtr(sign * eta)))


def local_probit(runs: Observations, centre: float, reach: float, follow: bool) -> tuple[Probit | None, float]:
    """Return the probit curve of the runs near a point alone, where hardly any curve differs from it, or None.

    The window has the middle `centre` and the half width `reach` in ln level: one dispersion is enough to determine the
    slope. With `follow` it moves to the median of the fit until it settles; its middle is returned, too.
    """
    local: Probit | None = None
    for _ in range(ROUNDS if follow else 1):
        near, _status = fit_probit(runs.within(centre, reach))
        if near is None:
            break
        local = near
        # (no more than the window at a time: a nearly flat fit has its median anywhere)
        moved = min(max(near.log_median - centre, -reach), reach)
        if not follow or abs(moved) <= SETTLED * reach:
            break
        centre += moved
    return local, centre
