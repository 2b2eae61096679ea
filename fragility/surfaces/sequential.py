"""Pooled analysis of one law: levels for the next runs, results for all blocks, and the decision to continue.

The module does not use blocks or motions: its caller runs them at the levels it returns, and passes the outcomes. Two
surfaces are fitted. The first goes through all runs, for curves. The second is near the medians alone, for medians,
because hardly any curve differs from a lognormal one there. It has the dispersions of the first times one factor.
"""

import math
from typing import NamedTuple

import numpy as np

from ...core.elementary import Array, Flags, Index, eigh, exp, times
from ...core.streams import stream
from ..adaptive.probit import Observations, student
from ..adaptive.stopping import ALL_FELL, MOST_MOTIONS, NO_MORE, NONE_FELL, StoppingRule, margin, next_wave
from ..adaptive.until import Until
from .cuts import find_cut, log_likelihood, settled
from .surface import RUNS_A_TERM, Cut, Pool, Surface, added_terms, fit_medians, fit_surface, number_of_terms, terms_at

LEVELS = (1, 3)
"""Key, under a seed and before the number of a motion, of the random numbers that its levels are drawn from."""
BAND_KEY = (1, 4)
FIRM = 1024
"""Number of motions beyond which looks have less room to spare (`stopping.margin`)."""
EARLY, LATE = 4, 2
"""A wave has at most a quarter of the motions so far, and half beyond `FIRM`. Each wave takes a fit, and late fits
hardly change the next levels.
"""
STEP = math.log(8.0)
FEW = 0.05
"""Share of runs with or without a fall below which levels move on: the curves lie beyond."""
EXPLORATIONS = 6
BEGIN, BEGIN_WIDE, MOST_DEGREES = (4, 2), (3, 2), (6, 4)
"""Degrees of ln median and ln dispersion at the first fit, if blocks differ in up to three numbers and in more, and at
most.
"""
FEW_VARIABLES = 3
LIKELY = 0.1
"""Probability below which further terms are not there by chance."""
EVERY = 6
"""One run in `EVERY` is far from the median, for the dispersion."""
WIDE = (-2.2, 1.6)
"""Range of these, in dispersions from the median: rates depend on the curve below it."""
LOCAL, CURVED, WINDOW, SURELY = 0.5, 0.8, 1.5, 2.0
"""Of runs near the median, as of `adaptive.sequential`: half width in dispersions, by tolerance, and of fits."""
FURTHEST = 1.0
"""Maximum difference of the two surfaces, in dispersions, for a curve of any form."""
STEEPEST, FLATTEST = 1e-3, 10.0
"""Dispersions beyond which the runs do not determine a surface."""
DRAWS = 1000
DISPERSIONS = (0.02, 2.0)


class Band(NamedTuple):
    """Precision of all medians at once: largest standard error, and the number of errors on either side."""

    error: float
    factor: float

    @property
    def reach(self) -> float:
        """Half width, of ln median, of the widest interval."""
        return self.error * self.factor


Surfaces = tuple[tuple[int, int], Cut | None, Surface | None, Surface | None]
"""Surfaces of a law: their degrees, their cut, the surface of all runs, and the surface near the medians."""


class PooledCurves:
    """The curves of all blocks under one law, until medians at all `points` (point, axis) are known precisely."""

    def __init__(self, until: Until, points: Array, seed: int) -> None:
        self.until = until
        self._points, self._seed = points, seed
        self._rule = StoppingRule(until, FIRM)
        self._runs: Pool | None = None
        self._new: Pool | None = None
        self._shift = 0.0
        self._explored = 0
        self._asked = 0
        self._first_degrees = BEGIN if points.shape[1] <= FEW_VARIABLES else BEGIN_WIDE
        self.degrees = self._first_degrees
        self.cut: Cut | None = None
        self._smooth: Surfaces | None = None
        self.curve: Surface | None = None
        self.near: Surface | None = None
        self.ratios: list[tuple[int, float]] = []
        self.stopped = ""

    @property
    def runs(self) -> Pool:
        """All runs so far."""
        assert self._runs is not None
        return self._runs

    @property
    def centred(self) -> Observations:
        """All runs so far, their ln levels less the ln medians of their blocks: runs as of one block."""
        assert self.curve is not None
        runs = self.runs
        return Observations(runs.x - self.curve.log_medians(runs.points), runs.fell, runs.motion)

    @property
    def motions(self) -> int:
        """Number of motions so far."""
        return 0 if self._runs is None else int(np.unique(self._runs.motion).size)

    @property
    def next_wave(self) -> int:
        """Number of motions to take until the next look: as many as seem to be missing, in steps."""
        done = self.motions
        if self._rule.confirmed_at > done:
            return self._rule.confirmed_at - done
        missing = math.inf
        if self.ratios:
            missing = done * (max(margin(done, FIRM) * self.ratios[-1][1], 1.0) ** 2 - 1.0)
        return max(next_wave(done), math.ceil(min(missing, done // (EARLY if done < FIRM else LATE))))

    def plan(self, points: Array, motions: Index, start: tuple[Array, Array]) -> Array:
        """Return the ln levels (block, motion) of blocks at points (block, axis) under motions of these numbers.

        start: lowest and highest ln levels (block,) among which the search begins.
        """
        n = len(points)
        uniform = np.stack([stream(self._seed, *LEVELS, int(motion)).random(n) for motion in motions], axis=-1)
        if self.curve is None or self.near is None:
            low, high = (np.asarray(array)[:, None] + self._shift for array in start)
            return np.asarray(low + uniform * (high - low))
        middle, scale = self._rough(points)
        place = (np.arange(n)[:, None] + motions[None, :]) % EVERY
        far = middle[:, None] + scale[:, None] * (WIDE[0] + (WIDE[1] - WIDE[0]) * uniform)
        return np.where(place == 0, far, self._close(points, uniform))

    def near_medians(self, points: Array, shares: Array) -> Array:
        """Return ln levels near the medians of points (point, axis), at shares (…, point or 1, motion) of -1 to 1."""
        return self._close(points, 0.5 + 0.5 * shares)

    def _close(self, points: Array, uniform: Array) -> Array:
        assert self.near is not None
        middle = self._seen(self.near.log_medians(points))
        return np.asarray(middle[:, None] + self.distances(points)[:, None] * (2.0 * uniform - 1.0))

    def _seen(self, x: Array) -> Array:
        """Return ln levels; levels far beyond all runs so far are moved to the bounds of the next levels.

        In a region with few blocks, early surfaces are constrained at their medians alone, and may be anything
        elsewhere.
        """
        return np.clip(x, self.runs.x.min() - STEP, self.runs.x.max() + STEP)

    def dispersions(self, points: Array) -> Array:
        """Return dispersions at points (point, axis), as far as they are known: all alike while nothing is."""
        return np.ones(len(points)) if self.curve is None else self._rough(points)[1]

    def _rough(self, points: Array) -> tuple[Array, Array]:
        """Return ln medians and dispersions by the curve through all runs, confined to values that can place levels."""
        assert self.curve is not None
        middle = self._seen(self.curve.log_medians(points))
        return middle, np.clip(exp(self.curve.log_dispersions(points)), *DISPERSIONS)

    def distances(self, points: Array) -> Array:
        """Return the distance in ln level of the outer levels near the medians of points (point, axis) from these.

        It falls with the tolerance, but not below the error of the medians, so that the levels enclose them.
        """
        assert self.near is not None
        _, scale = self._rough(points)
        known = SURELY * self.near.median_errors(points)
        return np.minimum(LOCAL * scale, np.maximum(np.sqrt(CURVED * self.until.room * scale), known))

    def add(self, points: Array, motions: Index, x: Array, fell: Flags) -> None:
        """Take the outcomes (block, motion) of some blocks under motions of a wave, at ln levels x."""
        where = np.repeat(np.arange(len(points)), x.shape[1])
        added = Pool(points[where], x.ravel(), fell.ravel(), np.broadcast_to(motions, x.shape).ravel())
        self._new = added if self._new is None else self._new.joined(added)

    def look(self, last: bool = False) -> None:
        """Fit both surfaces to the runs of all waves, after one of them, and decide whether to continue."""
        assert self._new is not None
        new, self._new = self._new, None
        self._runs = new if self._runs is None else self._runs.joined(new)
        self._fit()
        if self.curve is None or self.near is None:
            self._explore(new, last)
            return
        band = self.band()
        self.ratios.append((self.motions, band.reach / self.until.room))
        self.stopped = self._rule.step(self.motions, self.ratios[-1][1], last)

    def _fit(self) -> None:
        """Fit the surfaces, with more terms if the runs require them."""
        runs = self.runs
        if not self._enough(self.degrees, runs):
            return
        degrees = self.degrees
        curve = settled(fit_surface(runs, degrees, self.curve, self.cut), runs)
        if curve is None or not self._inside(curve):
            return
        self.cut = curve.cut
        # if runs near the medians do not determine a surface yet, the surface of all runs replaces it
        self.curve = self.near = curve
        self.near = self._fit_near(degrees[0]) or curve
        if self.motions >= 2 * self._asked:
            self._asked = self.motions
            more = self._fit_near(degrees[0] + 1)
            if more is not None and added_terms(self.near, more) < LIKELY:
                self.raise_degree()

    def _fit_near(self, degree: int, curve: Surface | None = None) -> Surface | None:
        """Fit the surface to runs near the medians alone; None if they do not determine it.

        `curve`: surface whose dispersions are used, by default the current one.
        """
        if degree > MOST_DEGREES[0]:
            return None
        spread = curve or self.curve
        assert spread is not None
        runs, surface = self.runs, self.near
        window = WINDOW * self.distances(runs.points)
        for _ in range(2):  # (the window follows the medians)
            assert surface is not None
            nearby = runs.some(np.abs(runs.x - surface.log_medians(runs.points)) <= window)
            if not self._enough((degree, 0), nearby):
                return None
            surface = fit_medians(nearby, degree, spread, surface)
            if surface is None or not self._plausible(surface):
                return None
        return surface

    def _plausible(self, near: Surface) -> bool:
        """Return True if a surface of levels near the medians stays near the surface of all runs everywhere."""
        middle, scale = self._rough(self._points)
        medians = near.log_medians(self._points)
        return bool((np.abs(medians - middle) <= FURTHEST * scale).all())

    def _inside(self, curve: Surface) -> bool:
        """Return True if medians of a surface lie near the levels of runs, over the whole region."""
        middle = curve.log_medians(self._points)
        spread = curve.log_dispersions(self._points)
        low, high = self.runs.x.min() - STEP, self.runs.x.max() + STEP
        steep = (spread >= math.log(STEEPEST)) & (spread <= math.log(FLATTEST))
        return bool(((middle >= low) & (middle <= high) & steep).all())

    def _enough(self, degrees: tuple[int, int], runs: Pool) -> bool:
        return runs.x.size >= RUNS_A_TERM * number_of_terms(runs.points.shape[1], degrees, self.cut)

    def raise_degree(self) -> bool:
        """Fit with a degree higher by one; return True if that was possible."""
        degrees = self.degrees[0] + 1, min(self.degrees[1] + 1, MOST_DEGREES[1])
        if degrees[0] > MOST_DEGREES[0] or not self._points.shape[1] or not self._enough(degrees, self.runs):
            return False
        curve = fit_surface(self.runs, degrees, self.curve, self.cut)
        if curve is None or not self._inside(curve):
            return False
        near = self._fit_near(degrees[0], curve)
        if near is None:
            return False
        self.degrees, self.curve, self.near = degrees, curve, near
        return True

    def cut_region(self, normals: Array, agreed: bool) -> bool:
        """Cut the region at a plane across one of the `normals` (plane, axis); return True if the runs require it.

        Both sides have the first degrees, and a jump between them. `agreed` is True if the check found no difference.
        Of a surface whose degree was raised, which can follow a jump in part, the surface with the cut must then be the
        likelier one.
        """
        if self.cut is not None or self.curve is None or not len(normals):
            return False
        cut = find_cut(self.runs, normals, self._first_degrees, self.curve)
        if cut is None or not self._inside(cut):
            return False
        if agreed and log_likelihood(cut, self.runs) <= log_likelihood(self.curve, self.runs):
            return False
        self._smooth = self._surfaces()
        self.degrees, self.cut, self.curve, self.near = self._first_degrees, cut.cut, cut, cut
        self.near = self._fit_near(self.degrees[0]) or cut
        return True

    def without_cut(self) -> Surfaces:
        """Replace the surfaces by surfaces without the cut, through the current runs; return the old surfaces."""
        assert self._smooth is not None
        replaced = self._surfaces()
        self.take(self._smooth)
        self._fit()
        return replaced

    def take(self, surfaces: Surfaces) -> None:
        """Put other surfaces in the place of these."""
        self.degrees, self.cut, self.curve, self.near = surfaces

    def _surfaces(self) -> Surfaces:
        return self.degrees, self.cut, self.curve, self.near

    def go_on(self) -> None:
        """Continue after a check that failed: the precision must be reached again."""
        self._rule = StoppingRule(self.until, FIRM)
        self.stopped = ""

    def run_out(self, reason: str) -> None:
        """Stop for want of motions, after a check that took the precision away."""
        self.ratios.append((self.motions, self.band().reach / self.until.room))
        self.stopped = reason

    def band(self) -> Band:
        """Return the precision of the medians at all points at once.

        It uses the quantile of the largest of all t statistics, by draws from the normal law of the coefficients
        (sup-t). The quantile is widened as Student's t with the motions less the terms as degrees of freedom. Montiel
        Olea, J. L. and Plagborg-Møller, M. (2019). Journal of Applied Econometrics 34, 1-17.
        """
        assert self.near is not None
        rows = terms_at(self._points, self.near.degrees[0], self.near.cut)
        n = rows.shape[1]
        values, vectors = eigh(self.near.covariance[:n, :n])
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        spread = times(rows, root)
        errors = np.linalg.norm(spread, axis=1)
        draws = stream(self._seed, *BAND_KEY).standard_normal((n, DRAWS))
        largest = np.abs(times(spread, draws) / errors[:, None]).max(axis=0)
        factor = float(np.quantile(largest, 0.95)) * student(self.near.motions - n) / student(1e9)
        return Band(float(errors.max()), factor)

    def _explore(self, wave: Pool, last: bool) -> None:
        """Move the search towards the possible place of the curves after a wave that did not find it, or stop."""
        share = float(wave.fell.mean())
        alike = share in (0.0, 1.0)
        if share < FEW or share > 1.0 - FEW:
            self._shift += math.copysign(STEP if alike else 0.5 * STEP, 0.5 - share)
        self._explored += alike
        if self._explored >= EXPLORATIONS and alike:
            self.stopped = ALL_FELL if share else NONE_FELL
        elif last:
            self.stopped = MOST_MOTIONS if self.motions >= self.until.most else NO_MORE
