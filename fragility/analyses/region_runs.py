"""Runs of a pooled analysis: waves of motions for the surfaces, and those that check them."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ...core.aliases import Array, Flags, Index, Progress
from ...core.doubts import Doubt, warn
from ...core.elementary import exp, log
from ...core.streams import stream
from ...core.units import STANDARD_GRAVITY
from ...models import Block, Law
from ...models.laws import oscillator_of
from ...motions.plausibility import record_doubts
from ..adaptive.stopping import MOST_MOTIONS, NO_MORE, REACHED, motions_needed
from ..adaptive.until import Until
from ..hazard.curve import HazardCurve
from ..runs.axes import axes_of
from ..runs.request import Request, check_vertical
from ..runs.runners import shared
from ..runs.scaling import check_factors, name_at
from ..surfaces.checks import (
    BLOCKS,
    MOTIONS,
    RUNS,
    RUNS_OF_MANY,
    STRATA,
    STRATA_OF_MANY,
    Check,
    RatePlane,
    check_rates,
    check_surface,
    rate_levels,
)
from ..surfaces.domain import Domain, candidates, check_points, cut_check_points, design_weights, designed, normals
from ..surfaces.evaluation import Curves
from ..surfaces.sequential import FIRM, PooledCurves
from .adaptive import fall_start, first_levels, peaks_of
from .other_measures import OtherMeasures
from .waves import MotionSource, MotionWave, Scaled, run_wave

CHECKED_SHARE = 4
"""A check takes a quarter of the motions of the surfaces."""
RATE_KEY = (1, 5)
"""Key, under a seed and before the number of a motion, of the numbers that levels for its rate are drawn from."""
ALIKE, PARTS = 32, 8
"""Minimum number of motions that share their blocks, and maximum number of parts of a wave with their own blocks.
Without them the many motions of a late wave would sample only sixteen places of the region.
"""
SHRUNK = 0.5
"""Largest difference of a check, over that from one surface, below which a cut stays."""
CHECKED_TOGETHER = 500
"""Motions of a check at a time, which bounds memory."""


class PooledPlan(NamedTuple):
    """A pooled analysis, checked; most: of the motions; varied: options of its laws that blocks have of their own."""

    request: Request
    laws: Sequence[Law]
    scaled: Scaled
    source: MotionSource
    most: int
    domain: Domain
    until: Until
    blocks_per_motion: int
    seed: int
    hazard: HazardCurve | None
    varied: tuple[str, ...] = ()

    @property
    def power(self) -> float:
        """Power of the motion's scale that the measure grows with."""
        return 1.0 if self.scaled.base is None else self.scaled.base.power


def blocks_at(domain: Domain, points: Array) -> list[Block]:
    """Return blocks of the properties at points of the region."""
    blocks: list[Block] = []
    for log_p, log_tan, inertia in domain.variables(points)[:, :3].tolist():
        factor = min(max(inertia, 1.0 + 1e-9), 2.0)
        size = STANDARD_GRAVITY / (factor * math.exp(2.0 * log_p))
        blocks.append(Block.from_slenderness(math.atan(math.exp(log_tan)), size, factor, f"point {len(blocks)}"))
    return blocks


def own_options(domain: Domain, points: Array, names: Sequence[str]) -> list[dict[str, float]]:
    """Return the options of the laws that blocks have of their own (`BlockArray.own`), at points of the region."""
    values = domain.variables(points)[:, 3:]
    for column, name in enumerate(names):
        # (rounding on the way from the axes must not put an e above 1)
        values[:, column] = exp(values[:, column]) if name == "delta" else np.minimum(values[:, column], 1.0)
    return [dict(zip(names, row, strict=True)) for row in values.tolist()]


def checked_runs(made: bool, rated: bool) -> tuple[int, int]:
    """Return the runs of a checked block under each motion, for its median and for its rate.

    `made`: True for motions of a generator. `rated`: True with a hazard.
    """
    runs, strata = (RUNS_OF_MANY, STRATA_OF_MANY) if made else (RUNS, STRATA)
    return runs, strata if rated else 0


def with_own(law: Law, options: Mapping[str, float]) -> Law:
    """Return a law with the options that a block has of its own."""
    return replace(law, **options) if options else law  # type: ignore[type-var]


class PooledRuns:
    """Runs of a pooled analysis: waves for the surfaces, then waves for the checks."""

    def __init__(self, plan: PooledPlan, laws: Sequence[PooledCurves], given: Array, progress: Progress | None) -> None:
        self.plan, self.laws = plan, laws
        self._progress = progress
        self._candidates = candidates(plan.domain, plan.seed)
        self._given = given
        self.check_points = check_points(plan.domain, given, BLOCKS, plan.seed)
        self._tried_cuts: set[int] = set()
        self._worst_before_cut: dict[int, float] = {}
        self._cut_checks: dict[int, int] = {}
        self.others = OtherMeasures(plan.scaled)
        self._doubts: list[Doubt] = []
        self._done = self._parts = self._runs = self._expected = 0
        self.level_name = ""

    def until_known(self) -> list[Check]:
        """Run waves until every law is known and has been checked; return the last check of each law."""
        nothing = Check(np.zeros((0, self.plan.domain.size)), np.zeros(0), np.zeros(0), 1.0, 0.0)
        checked = [nothing] * len(self.laws)
        open_laws = set(range(len(self.laws)))
        while open_laws:
            while any(not law.stopped for law in self.laws):
                if self._done < self.plan.most:
                    self._wave()
                    continue
                # (the checks of other laws took the last motions)
                for law in self.laws:
                    if not law.stopped:
                        law.run_out(MOST_MOTIONS)
            for k in sorted(open_laws):
                law = self.laws[k]
                if law.near is not None:
                    checked[k] = self._checked(k, law)
                if law.stopped:
                    open_laws.remove(k)
        warn(list(dict.fromkeys(self._doubts)))
        return checked

    def _wave(self) -> None:
        plan = self.plan
        wanted = min(law.next_wave for law in self.laws if not law.stopped)
        wave = plan.source.wave(self._done, min(wanted, plan.most - self._done))
        self._take(wave)
        shares = self._design()
        going = [k for k, law in enumerate(self.laws) if not law.stopped]
        for part in wave.parts(max(ALIKE, math.ceil(len(wave.records) / PARTS))):
            self._part(part, shares, going)
        self.others.add(wave)  # (after the measure of the levels, which refuses motions that do not shake)
        self._done = int(wave.numbers[-1]) + 1
        last = self._done >= plan.most
        # (each law's fits are its own, and spend their time in products of matrices)
        for _ in shared(lambda k: self.laws[k].look(last=last), going):
            pass
        if plan.source.size is None:
            # (of a generator's motions, checks have taken some: it is the number allowed that ends them)
            for k in going:
                if self.laws[k].stopped == NO_MORE:
                    self.laws[k].stopped = MOST_MOTIONS
        self._tell()

    def _part(self, part: MotionWave, shares: Array, going: Sequence[int]) -> None:
        """Run blocks of their own under some motions of a wave."""
        plan = self.plan
        points = designed(self._candidates, shares, plan.blocks_per_motion, plan.seed, self._parts)
        self._parts += 1
        blocks = blocks_at(plan.domain, points)
        measured = plan.scaled.measured(part, blocks)[0]
        unit = self._unit(blocks)
        start = self._start(blocks, part, measured) if any(self.laws[k].near is None for k in going) else (unit, unit)
        x = np.stack([self.laws[k].plan(points, part.numbers, start) for k in going])
        fell = self._fell(points, going, part, (x + unit[:, None])[:, :, None], measured)
        for row, k in enumerate(going):
            self.laws[k].add(points, part.numbers, x[row], fell[row, :, 0])
        self._runs += x.size

    def _design(self) -> Array:
        """Return the shares of the candidates, for the law with the widest interval."""
        going = [law for law in self.laws if not law.stopped]
        worst = max(going, key=lambda law: law.ratios[-1][1] if law.ratios else math.inf)
        return design_weights(self._candidates, worst.degrees[0], worst.dispersions(self._candidates), worst.cut)

    def _tell(self) -> None:
        going = [law for law in self.laws if not law.stopped and law.ratios]
        widest = max(going, key=lambda law: law.ratios[-1][1], default=None)
        if widest is not None:
            motions, ratio = widest.ratios[-1]
            needed = min(self.plan.most, max(motions_needed(motions, ratio, FIRM), motions))
            self._expected = math.ceil(self._runs * needed / max(self._done, 1)) + self._runs_of_checks(needed)
            reach = 100.0 * math.expm1(min(ratio * self.plan.until.room, 700.0))
            self.plan.request.runner.reached(
                f"{self._done:,} motions; widest interval of a median: ±{reach:.1f} %, "
                f"±{100.0 * self.plan.until.tolerance:g} % asked"
            )
        if self._progress is not None:
            self._progress(self._runs, max(self._runs, self._expected))

    def _runs_of_checks(self, motions: int) -> int:
        """Return the runs of one check of every law, and of its rates, after this number of motions."""
        source = self.plan.source
        under = max(MOTIONS, motions // CHECKED_SHARE) if source.size is None else source.size
        counts = checked_runs(source.size is None, self.plan.hazard is not None)
        return len(self.laws) * len(self.check_points) * sum(counts) * under

    def _take(self, wave: MotionWave) -> None:
        """Check motions, and keep warnings on them."""
        records = wave.records
        if axes_of(records):
            raise ValueError(
                "motions must have one horizontal component for pooled curves: run pairs with toppling.ida"
            )
        check_vertical(self.plan.laws, records)
        self._doubts += record_doubts([record for record in records if not record.reverse_of])
        self.level_name = name_at(self.plan.scaled.long_name, records, wave.ground)

    def unit(self, points: Array) -> Array:
        """Return ln of the level that is 1 in the surfaces at points (point, axis)."""
        return self._unit(blocks_at(self.plan.domain, points))

    def _unit(self, blocks: Sequence[Block]) -> Array:
        """Return ln of the level that is 1 in the surfaces, (block,)."""
        return np.array([self.plan.power * math.log(STANDARD_GRAVITY * math.tan(block.alpha)) for block in blocks])

    def _start(self, blocks: Sequence[Block], wave: MotionWave, measured: Array) -> tuple[Array, Array]:
        """Return the first ln levels (block,), lowest and highest, in the unit of the surfaces."""
        peaks = peaks_of(wave)
        ends = log([first_levels(fall_start(block), peaks, self.plan.scaled, measured) for block in blocks])
        unit = self._unit(blocks)
        return ends[:, 0] - unit, ends[:, 1] - unit

    def _fell(self, points: Array, laws: Sequence[int], wave: MotionWave, x: Array, measured: Array) -> Any:
        """Run blocks at points (block, axis) at ln levels (law, block, run, motion); return outcomes of that shape."""
        plan = self.plan
        blocks, options = blocks_at(plan.domain, points), own_options(plan.domain, points, plan.varied)
        pieces = list(zip(blocks, options, strict=True))
        specimens = [oscillator_of(block, with_own(plan.laws[k], weights)) for k in laws for block, weights in pieces]
        levels = exp(x).reshape(len(specimens), *x.shape[2:])
        factors = np.asarray(plan.scaled.factors(levels, measured))
        check_factors(factors, wave.records)
        return run_wave(plan.request, specimens, None, wave.records, factors)["overturned"].reshape(x.shape)

    def _checked(self, k: int, law: PooledCurves) -> Check:
        """Check a law at other blocks; raise its degree, or cut the region, and continue, if that helps.

        A cut is tried once, if the check fails or the runs show a jump although it does not.
        """
        points = self._check_points(k, law)
        runs = self._check_runs(k, law, points)
        check = _raised(law, points, runs)
        before = self._worst_before_cut.pop(k, None)
        if before is not None:
            check = _better(law, check, points, runs, before)
        # (a few blocks may miss a jump that all runs together show)
        elif k not in self._tried_cuts and law.cut_region(normals(self.plan.domain), check.passed):
            self._tried_cuts.add(k)
            self._worst_before_cut[k] = check.worst
            if not self._goes_on(law):
                return self._checked(k, law)
            return check
        missed = law.stopped == REACHED and law.band().reach > self.plan.until.room
        if check.passed and missed and not self._goes_on(law):
            law.run_out(MOST_MOTIONS if self.plan.source.size is None else NO_MORE)
        return check

    def _goes_on(self, law: PooledCurves) -> bool:
        """Continue with a law that has reached its precision if there are motions left; return True if it continues."""
        if law.stopped != REACHED or self._done >= self.plan.most:
            return False
        law.go_on()
        return True

    def _check_points(self, k: int, law: PooledCurves) -> Array:
        """Return the blocks that a law is checked at: others for every check of a region that is cut."""
        if law.cut is None:
            return self.check_points
        self._cut_checks[k] = self._cut_checks.get(k, 0) + 1
        plan = self.plan
        return cut_check_points(plan.domain, self._given, BLOCKS, plan.seed, law.cut, self._cut_checks[k])

    def _check_runs(self, k: int, law: PooledCurves, points: Array) -> tuple[Index, Array, Flags]:
        """Return the motions, ln levels and outcomes (block, run, motion) of blocks that are run by themselves."""
        plan = self.plan
        blocks = blocks_at(plan.domain, points)
        unit = self._unit(blocks)[:, None, None]
        n, _ = checked_runs(plan.source.size is None, rated=False)
        parts: list[tuple[Index, Array, Any]] = []
        for wave in self._further_waves():
            run, block = np.arange(n)[:, None, None], np.arange(len(points))[:, None]
            places = (run + block + wave.numbers) % RUNS
            x = np.moveaxis(law.near_medians(points, np.linspace(-1.0, 1.0, RUNS)[places]), 0, 1)
            measured = plan.scaled.measured(wave, blocks)[0]
            parts.append((wave.numbers, x, self._fell(points, [k], wave, (x + unit)[None], measured)[0]))
            self._runs += x.size
            self._tell()
        motions, x, fell = (np.concatenate([part[i] for part in parts], axis=-1) for i in range(3))
        return motions, x, fell

    def rates(self, curves: Sequence[Curves]) -> list[RatePlane | None]:
        """Compare the rates of each law's curves at the blocks of a check with the rates of runs without a form."""
        plan = self.plan
        assert plan.hazard is not None
        blocks = blocks_at(plan.domain, self.check_points)
        _, strata = checked_runs(plan.source.size is None, rated=True)
        parts: list[tuple[Index, Array, Any]] = []
        for wave in self._further_waves():
            uniform = [stream(plan.seed, *RATE_KEY, int(number)).random((2, strata)) for number in wave.numbers]
            drawn = np.stack(uniform, axis=-1)
            levels = [rate_levels(plan.hazard, curve.log_curve_median, curve.dispersion, drawn) for curve in curves]
            x, weights = (np.stack(arrays) for arrays in zip(*levels, strict=True))
            measured = plan.scaled.measured(wave, blocks)[0]
            parts.append((wave.numbers, weights, self._fell(self.check_points, range(len(curves)), wave, x, measured)))
            self._runs += x.size
            self._tell()
        motions, weights, fell = (np.concatenate([part[i] for part in parts], axis=-1) for i in range(3))
        return [
            check_rates(self.check_points, curve.rate, weights[k], fell[k], motions) for k, curve in enumerate(curves)
        ]

    def _further_waves(self) -> Iterator[MotionWave]:
        """Return motions of which the surfaces have no runs; all motions of a set."""
        source = self.plan.source
        first, n = 0, self.plan.most
        if source.size is None:
            first, n = self._done, max(MOTIONS, self._done // CHECKED_SHARE)
            self._done += n
        stop = first + n
        while first < stop:
            wave = source.wave(first, min(stop - first, CHECKED_TOGETHER))
            self._take(wave)
            yield wave
            first = int(wave.numbers[-1]) + 1


def _raised(law: PooledCurves, points: Array, runs: tuple[Index, Array, Flags]) -> Check:
    """Check a law, with a degree more and again if it fails, and return the last check."""
    while True:
        assert law.near is not None
        check = check_surface(law.near, points, *runs)
        if check.passed or not law.raise_degree():
            return check


def _better(law: PooledCurves, check: Check, points: Array, runs: tuple[Index, Array, Flags], before: float) -> Check:
    """Decide if a cut stays, by the first check with it, and return the check of the remaining surface.

    The cut stays if the blocks differ from it by at most half as much as from one surface through the same runs. The
    degree of that surface is raised if that helps, as for the surface with the cut. `before`: largest difference at the
    check before the cut, 0 if that check had passed.
    """
    cut = law.without_cut()
    uncut = _raised(law, points, runs)
    if check.worst < SHRUNK * uncut.worst:
        law.take(cut)
        return check
    # (that these blocks differ less does not take back what the others said)
    return uncut._replace(worst=max(uncut.worst, before))
