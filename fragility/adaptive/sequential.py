"""Sequential analysis of one curve: levels for the next motions, results of their runs, and the decision to stop.

The module does not use blocks or motions: its caller runs them at the levels it returns, and passes the outcomes. The
plan depends only on these outcomes and on each motion's own random stream.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...core import checks
from ...core.elementary import Array, Flags, Index, exp, log
from ...core.parameters import USUAL_CONFIDENCE
from ...core.streams import stream
from ...core.wording import counted
from ..fitting.states import ALL, NONE
from ..numerics.proportions import binomial_interval
from .probit import Estimate, Observations, Probit, difference, enclosing, fit_probit, local_probit
from .rate import HazardCells, draw_levels, hazard_cells, unseen_tail, weighted_rate
from .stopping import ALL_FELL, MISFIT, MOST_MOTIONS, NONE_FELL, REACHED, StoppingRule, motions_needed, reason_text
from .until import DISPERSION, MEDIAN, PROBABILITY, RATE, Until

LEVELS = (0, 2)
"""Key, under a seed and before the number of a motion, of the random numbers that its levels are drawn from."""
RUNS = 3
MOST_RUNS = 20
PLACES = 3
"""Levels that single runs of motions take in turns."""
EXPLORATIONS = 6
"""Maximum number of waves in which nothing overturns, or everything."""
STEP = math.log(8.0)
LOCAL, WIDE = 0.5, 1.2
"""Distance from the middle, in dispersions, of the outer levels: for a point of the curve, and for its slope."""
JITTER = 0.15
CURVED = 0.8
"""Square of the outer levels' distance, in dispersions, over the tolerance in dispersions. A curve that is not straight
between the levels on normal paper shifts the result by the square of their distance. A smaller tolerance therefore
needs closer levels.
"""
STEEPEST = 0.4
"""Density of the normal law in its middle: change of a probability per dispersion."""
WINDOW = 2.0
"""Half width of the window of local fits over the distance of the outer levels from the middle."""
DISPERSIONS = (0.02, 2.0)
"""Range of a rough dispersion that places levels."""
SURELY = 2.0
"""Standard errors by which two estimates must differ to count as different."""


def exploring(runs: int) -> int:
    """Return the runs a motion while nothing is known of the curve, given those once it is."""
    return min(2 * runs, MOST_RUNS)


class WavePlan(NamedTuple):
    """Levels of the next motions, and the weights of runs that overturn (1/year, NaN without a hazard)."""

    levels: Array
    weights: Array


class Look(NamedTuple):
    """Results after a wave; medians are ln, NaN if there is no estimate.

    `ratio`: half width of the interval over its allowed value. `lower`, `upper`: ends of the interval of the target (of
    its logarithm for median and dispersion). `local`, `curve`: estimates of ln(median) near the median alone and by the
    curve through all runs.
    """

    motions: int
    ratio: float
    value: float
    lower: float
    upper: float
    local: Estimate | None = None
    curve: Estimate | None = None
    log_dispersion: Estimate | None = None

    @property
    def misfit(self) -> float:
        """Difference of the local ln(median) from the curve's if it exceeds twice its error, else 0."""
        if self.local is None or self.curve is None:
            return 0.0
        gap, error = difference(self.local, self.curve)
        return gap if math.isfinite(error) and abs(gap) > SURELY * error else 0.0


UNKNOWN = (math.inf, math.nan, math.nan, math.nan)


class SequentialCurve:
    """One curve that is determined to a precision, from a search between the levels `low` and `high` (> 0).

    Each motion has `runs` runs, 1 to 20, once the curve is roughly known, and twice as many before; a rate needs a
    hazard.
    """

    def __init__(self, until: Until, low: float, high: float, runs: int = RUNS, seed: int = 0) -> None:
        self.until = until
        self._runs = checks.count("runs_per_motion", runs, at_least=1)
        if self._runs > MOST_RUNS:
            raise ValueError(f"runs_per_motion must be at most {MOST_RUNS}, got {runs}")
        self._seed = checks.count("seed", seed)
        if until.target == RATE and until.hazard is None:
            raise ValueError("until rate needs a hazard curve")
        self._hazard = until.hazard if until.target == RATE else None
        start = checks.number("the first level", low, above=0.0)
        self._range = math.log(start), math.log(checks.number("the last first level", high, above=start))
        self._rule = StoppingRule(until)
        self._explored = 0
        self._global: Probit | None = None
        self._centre = math.nan
        self.seen = Observations(np.empty(0), np.empty(0, np.bool_), np.empty(0, np.int64))
        self._weights = np.empty(0)
        self.looks: list[Look] = []
        self.stopped = ""

    @property
    def dispersion(self) -> float:
        """The dispersion as known so far, confined to values that can place levels; NaN before the first estimate."""
        if self._global is None:
            return math.nan
        return min(max(self._global.dispersion, DISPERSIONS[0]), DISPERSIONS[1])

    def plan(self, motions: Index) -> WavePlan:
        """Return the levels of motions of these numbers (motion,), the same for one that is run both ways."""
        uniform = np.stack(
            [stream(self._seed, *LEVELS, int(motion)).random((2, MOST_RUNS)) for motion in motions], axis=-1
        )
        if self._global is None:
            low, high = self._range
            n = exploring(self._runs)
            share = (np.arange(n)[:, None] + uniform[0, :n]) / n
            return self._unweighted(low + share * (high - low))
        uniform = uniform[:, : self._runs]
        scale = self.dispersion
        if self._hazard is not None:
            cells = hazard_cells(self._hazard, self._global.log_median, scale)
            x, weights = draw_levels(cells, self._global.log_median, scale, uniform)
            # a motion that is run both ways is one motion: its runs share its rate
            _, place, ways = np.unique(motions, return_inverse=True, return_counts=True)
            return WavePlan(exp(x), weights / ways[place])
        if self.until.target == DISPERSION:
            z = WIDE * self._places(motions) + JITTER * (2.0 * uniform[0] - 1.0)
            return self._unweighted(self._global.log_median + scale * z)
        return self._unweighted(self._centre + self._distance() * self._places(motions))

    def _places(self, motions: Index) -> Array:
        """Return the places (run, motion) of the levels between the outer levels, which are at -1 and 1."""
        if self._runs == 1:
            return np.linspace(-1.0, 1.0, PLACES)[motions % PLACES][None]
        return np.repeat(np.linspace(-1.0, 1.0, self._runs)[:, None], len(motions), axis=1)

    def _distance(self) -> float:
        """Return the distance in ln level of the outer levels from the middle of local fits.

        It falls with the tolerance, but not below the error of the median, so that the levels enclose it.
        """
        assert self._global is not None
        scale = self.dispersion
        room = self.until.tolerance / (STEEPEST if self.until.target == PROBABILITY else scale)
        known = self._global.median().error / scale
        return scale * min(LOCAL, max(math.sqrt(CURVED * room), SURELY * known))

    def _unweighted(self, x: Array) -> WavePlan:
        return WavePlan(exp(x), np.full(x.shape, math.nan))

    def add(self, motions: Index, plan: WavePlan, fell: Flags, last: bool = False) -> None:
        """Add the outcomes of a wave (run, motion), estimate the result, and decide whether to continue.

        `motions` (motion,): their numbers, the same for both runs of a motion that is run both ways. `last`: True if no
        more follow.
        """
        numbers = np.broadcast_to(motions, fell.shape).ravel()
        x = log(plan.levels).ravel()
        self.seen = Observations(
            np.append(self.seen.x, x), np.append(self.seen.fell, fell.ravel()), np.append(self.seen.motion, numbers)
        )
        self._weights = np.append(self._weights, plan.weights.ravel())
        known, status = fit_probit(self.seen)
        self._global = known if known is not None else self._global
        if self._global is None:
            self._explore(status)
            if self.stopped:
                self.looks.append(Look(self.motions, *UNKNOWN))
                return
        look = self._look()
        self.looks.append(look)
        self.stopped = self._rule.step(look.motions, look.ratio, last)
        asked = self.until.target == DISPERSION and look.motions >= self.until.least
        # (a finer answer than the form can carry is asked of it)
        if not self.stopped and asked and abs(look.misfit) > self.until.room:
            self.stopped = MISFIT

    def _explore(self, status: str) -> None:
        """Move the search towards the possible place of the curve, after a wave that did not find it."""
        low, high = self._range
        self._explored += 1
        if status == NONE:
            self._range = high, high + STEP
        elif status == ALL:
            self._range = low - STEP, low
        if self._explored >= EXPLORATIONS and status in (NONE, ALL):
            self.stopped = NONE_FELL if status == NONE else ALL_FELL

    @property
    def motions(self) -> int:
        """Number of motions so far."""
        return int(np.unique(self.seen.motion).size)

    @property
    def explored(self) -> tuple[float, float]:
        """Lowest and highest level of the runs."""
        return math.exp(self.seen.x.min()), math.exp(self.seen.x.max())

    @property
    def cells(self) -> HazardCells | None:
        """Cells of the levels that the rate is of; None without a hazard or a curve."""
        if self._hazard is None or self._global is None:
            return None
        return hazard_cells(self._hazard, self._global.log_median, self.dispersion)

    def fitted_rate(self) -> Estimate | None:
        """Return the rate of the lognormal curve through all runs; None without a hazard or a curve."""
        cells = self.cells
        return None if cells is None or self._global is None else self._global.weighted(*cells.points)

    def weighted_rate(self) -> Estimate:
        """Return the rate from the weighted runs."""
        return weighted_rate(self._weights, self.seen.fell, self.seen.motion)

    def rate_misfit(self) -> float:
        """Return the fitted rate over the weighted one, less 1, if they differ by more than twice the error."""
        fitted, weighted = self.fitted_rate(), self.weighted_rate()
        if fitted is None or not weighted.value > 0.0:
            return 0.0
        gap, error = difference(fitted, weighted)
        return gap / weighted.value if math.isfinite(error) and abs(gap) > SURELY * error else 0.0

    def _look(self) -> Look:
        if self._global is None:
            return Look(self.motions, *UNKNOWN)
        curve, spread = self._global.median(), self._global.log_dispersion()
        at = self._global.log_median
        near, middle = local_probit(self.seen, at, WINDOW * self._distance(), follow=True)
        local = None if near is None else enclosing(near.median(), self.seen)
        self._centre = middle
        k, room = self.motions, self.until.room
        estimates = (local, curve, spread)
        if self.until.target == MEDIAN:
            return _look_at(k, local, room, estimates)
        if self.until.target == DISPERSION:
            return _look_at(k, spread, room, estimates)
        if self.until.target == RATE:
            return self._rate(k, estimates)
        self._centre = math.log(self.until.level)
        return self._probability(k, estimates)

    def _rate(self, k: int, estimates: "Known") -> Look:
        """Look at the rate from weighted runs; its upper end includes a possible rate below the levels of falls."""
        rate, cells = self.weighted_rate(), self.cells
        if cells is None or not rate.value > 0.0:
            return Look(k, *UNKNOWN, *estimates)
        up = rate.reach + unseen_tail(cells, self._weights, self.seen)
        ratio = up / (self.until.room * rate.value)
        return Look(k, ratio, rate.value, max(0.0, rate.value - rate.reach), rate.value + up, *estimates)

    def _probability(self, k: int, estimates: "Known") -> Look:
        """Look at the probability of a level: by a local fit, or if all runs nearby end alike, by their number."""
        reach = WINDOW * self._distance()
        x = math.log(self.until.level)
        near = self.seen.within(x, reach)
        alike = near.fell.all() or not near.fell.any()
        if near.x.size and alike:
            # (a motion counts once: its runs are as alike as they can be)
            n = np.unique(near.motion).size
            lower, upper = map(
                float, binomial_interval(n if near.fell[0] else 0, n, USUAL_CONFIDENCE, "clopper-pearson")
            )
            return Look(k, (upper - lower) / self.until.room, float(near.fell[0]), lower, upper, *estimates)
        if not near.x.size:
            return Look(k, *UNKNOWN, *estimates)
        fitted, _ = local_probit(self.seen, x, reach, follow=False)
        if fitted is None:  # (as many motions as runs that fell, each counted once)
            n = np.unique(near.motion).size
            value = float(near.fell.mean())
            falls = min(max(round(value * n), 1), n - 1) if n > 1 else round(value)
            lower, upper = map(float, binomial_interval(falls, n, USUAL_CONFIDENCE, "clopper-pearson"))
        else:
            estimate = fitted.probability(x)
            value, (lower, upper) = estimate.value, estimate.proportion()
        return Look(k, 0.5 * (upper - lower) / self.until.room, value, lower, upper, *estimates)


Known = tuple[Estimate | None, Estimate, Estimate]
"""Local and global ln(median), and ln(dispersion)."""


def _look_at(motions: int, estimate: Estimate | None, room: float, estimates: Known) -> Look:
    if estimate is None or not math.isfinite(room):
        return Look(motions, *UNKNOWN, *estimates)
    reach = estimate.reach
    return Look(motions, reach / room, estimate.value, estimate.value - reach, estimate.value + reach, *estimates)


LEAST_GAP = 0.05
"""Per cent of a median below which a misfit, though beyond its error, is nothing to speak of."""


def width_text(curve: SequentialCurve, ratio: float) -> str:
    """Return a half width as text, such as ``±4.8 %`` of the median; `ratio`: half width over its allowed value."""
    until = curve.until
    if not math.isfinite(ratio):
        return "no interval yet"
    if until.target == PROBABILITY:
        return f"±{ratio * until.room:.3f}"
    return f"±{100.0 * half_width(curve, ratio):.1f} %"


def half_width(curve: SequentialCurve, ratio: float) -> float:
    """Return the half width in the terms of the tolerance."""
    until = curve.until
    if until.room != until.tolerance and math.isfinite(ratio):
        return math.expm1(min(ratio * until.room, 700.0))
    return ratio * until.room


def reached_so_far(curves: Sequence[SequentialCurve], motions: int) -> str:
    """Return the progress of an analysis: the widest interval among the curves that have not stopped."""
    going = [curve for curve in curves if not curve.stopped]
    if not going:
        every = f"all {len(curves):,} curves have" if len(curves) > 1 else "the curve has"
        return f"{motions:,} motions, {every} stopped"
    widest = max(going, key=lambda curve: curve.looks[-1].ratio)
    until = widest.until
    asked = f"±{until.tolerance:g}" if until.target == PROBABILITY else f"±{100.0 * until.tolerance:g} %"
    stopped = f"{len(curves) - len(going):,} of {counted(len(curves), 'curve')} stopped"
    width = width_text(widest, widest.looks[-1].ratio)
    return f"{motions:,} motions, {stopped}; widest interval of a {until.target}: {width}, {asked} asked"


def account(curve: SequentialCurve, state: str | None = None) -> str:
    """Return the reason why a curve has stopped, the reached precision, and the gain of more motions.

    state: the name of a damage state other than overturning.
    """
    look, until = curve.looks[-1], curve.until
    asked = f"±{until.tolerance:g}" if until.target == PROBABILITY else f"±{100.0 * until.tolerance:g} %"
    n = f"{look.motions:,} motions"
    low, high = curve.explored
    if curve.stopped in (NONE_FELL, ALL_FELL):
        return f"{reason_text(curve.stopped, state)} under {n} at levels from {low:.3g} to {high:.3g} (SI)"
    if curve.stopped == MISFIT:
        return (
            f"a dispersion within {asked} is not to be had: near the median, levels give a median "
            f"{100.0 * math.expm1(look.misfit):+.1f} % from that of the lognormal curve through all runs"
        )
    text = f"{width_text(curve, look.ratio)} for the {until.target} after {n}, {asked} asked"
    if curve.stopped != REACHED:
        needed = motions_needed(look.motions, look.ratio)
        why = "the most allowed" if curve.stopped == MOST_MOTIONS else "all there are"
        # (the rule wants an interval narrower than asked, and to see it again)
        what = "the precision" if look.ratio > 1.0 else "confirming it"
        text += f"; {n} are {why}" + (f", {what} takes about {needed:,}" if needed > look.motions else "")
    gap = 100.0 * math.expm1(-look.misfit)
    if abs(gap) >= LEAST_GAP:
        text += f"; no lognormal curve fits: its median is {gap:+.1f} % from that of levels near it"
    differs = curve.rate_misfit() if until.target == RATE else 0.0
    if differs:
        text += f"; the rate of the lognormal curve through all runs is {100.0 * differs:+.1f} % from this one"
    return text
