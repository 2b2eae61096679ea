"""How often sequential analysis keeps its promise on known truths, and its runs beside those of 20 common levels.

`python -m toppling.benchmarks.sequential.promises [replicates] [processes]` prints both tables.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from ...core.aliases import Array
from ...core.streams import stream
from ...fragility import HazardCurve
from ...fragility.adaptive.probit import Observations, fit_probit, local_probit
from ...fragility.adaptive.sequential import SequentialCurve
from ...fragility.adaptive.stopping import REACHED, StoppingRule, next_wave
from ...fragility.adaptive.until import DISPERSION as SPREAD, MEDIAN as CENTRE, PROBABILITY, RATE, Until
from .truths import DISPERSION, MEDIAN, TRUTHS, Truth

TOLERANCES = (0.10, 0.05, 0.02)
REPLICATES = 500
PROCESSES = 2
SLOPE = 2.5
HAZARD = HazardCurve.power_law(1.0, SLOPE, "pga")
AT = 1.5
"""Level whose probability is asked for."""
START = (0.4, 20.0)
MOST = 200_000
GRID = 20


class Outcome(NamedTuple):
    """End of one analysis: the answer's error over what is promised, and the motions and runs that it took."""

    error: float
    motions: int
    runs: int
    reason: str

    @property
    def kept(self) -> bool:
        """Whether the answer is as near to the truth as promised."""
        return self.error <= 1.0


def sequential(truth: Truth, until: Until, seed: int, runs: int = 3) -> Outcome:
    """Run one sequential analysis of a truth."""
    curve = SequentialCurve(replace(until, hazard=HAZARD), *START, runs, seed)
    done = number = 0
    while not curve.stopped:
        wave = np.arange(done, min(done + next_wave(done), until.most))
        plan = curve.plan(wave)
        fell = truth.verdicts(plan.levels, stream(seed, 1, done))
        curve.add(wave, plan, fell)
        done, number = done + wave.size, number + fell.size
    value = curve.looks[-1].value
    return Outcome(_error(truth, until, value), done, number, curve.stopped)


def _error(truth: Truth, until: Until, value: float) -> float:
    """Return how far an answer is from the truth, over what is promised."""
    if until.target == RATE:
        return abs(value / truth.rate(SLOPE) - 1.0) / until.tolerance
    if until.target == PROBABILITY:
        return abs(value - float(truth.probability(np.array(math.log(until.level))))) / until.tolerance
    known = truth.log_median if until.target == CENTRE else math.log(DISPERSION)
    # (as the intervals are, as a factor)
    return abs(value - known) / until.room


def grid_levels() -> Array:
    """Return the common levels (level,): from a tenth to ten times the median."""
    return np.geomspace(0.1 * MEDIAN, 10.0 * MEDIAN, GRID)


def common_levels(truth: Truth, until: Until, seed: int, asked: Until | None = None, near: bool = False) -> Outcome:
    """Run the same rule over the common levels, and the curve through all, or those within a dispersion of the median.

    asked: what is asked for where that is more than `until`; near: fit the levels near the median alone.
    """
    levels = grid_levels()
    rules = until if asked is None else asked
    rule, done, stopped, value = StoppingRule(rules), 0, "", math.nan
    seen = Observations(np.empty(0), np.empty(0, np.bool_), np.empty(0, np.int64))
    while not stopped:
        wave = np.arange(done, min(done + next_wave(done), until.most))
        at = np.repeat(levels[:, None], wave.size, axis=1)
        fell = truth.verdicts(at, stream(seed, 2, done))
        seen = Observations(
            np.append(seen.x, np.log(at)),
            np.append(seen.fell, fell),
            np.append(seen.motion, np.broadcast_to(wave, at.shape)),
        )
        done += wave.size
        fitted, _ = fit_probit(seen)
        if near and fitted is not None:
            fitted, _ = local_probit(seen, fitted.log_median, fitted.dispersion, follow=True)
        ratio = math.inf
        if fitted is not None:
            median = fitted.median()
            value, ratio = median.value, median.reach / rules.room
        stopped = rule.step(done, ratio, False)
    return Outcome(_error(truth, until, value), done, done * GRID, stopped)


class Row(NamedTuple):
    """Results of all replicates of a truth: shares that kept the promise and reached it, and mean numbers.

    within: the error that 95 % of the answers do not exceed, over what is promised.
    """

    truth: str
    kept: float
    within: float
    reached: float
    motions: float
    runs: float


def summary(truth: Truth, outcomes: Sequence[Outcome]) -> Row:
    """Return the row of a truth."""
    n = len(outcomes)
    return Row(
        truth.name,
        sum(end.kept for end in outcomes) / n,
        float(np.quantile([end.error for end in outcomes], 0.95)),
        sum(end.reason == REACHED for end in outcomes) / n,
        sum(end.motions for end in outcomes) / n,
        sum(end.runs for end in outcomes) / n,
    )


def promises(
    target: str, tolerance: float, replicates: int, truths: Sequence[Truth] = TRUTHS, processes: int = PROCESSES
) -> list[Row]:
    """Return a row for each truth (of the dispersion: those that are lognormal, which have one)."""
    until = Until(target, tolerance, AT if target == PROBABILITY else math.nan, most=MOST)
    chosen = [truth for truth in truths if target != SPREAD or truth.name.startswith("lognormal")]
    with ProcessPoolExecutor(processes) as pool:
        return [
            summary(truth, list(pool.map(partial(sequential, truth, until), range(replicates), chunksize=8)))
            for truth in chosen
        ]


def rows_of_text(title: str, rows: Sequence[Row]) -> str:
    """Return a table as text."""
    lines = [title, f"{'truth':36s} {'kept':>6s} {'95%':>5s} {'reached':>8s} {'motions':>8s} {'runs':>8s}"]
    lines += [
        f"{row.truth:36s} {row.kept:6.3f} {row.within:5.2f} {row.reached:8.3f} {row.motions:8.0f} {row.runs:8.0f}"
        for row in rows
    ]
    return "\n".join(lines)


def main(arguments: Sequence[str]) -> None:
    """Print the tables."""
    replicates, processes = (*map(int, arguments), *(REPLICATES, PROCESSES)[len(arguments) :])
    asked = [(CENTRE, tolerance, f"{tolerance:.0%}") for tolerance in TOLERANCES]
    asked += [(SPREAD, 0.1, "0.1"), (RATE, 0.1, "0.1"), (PROBABILITY, 0.03, "0.03")]
    for target, tolerance, width in asked:
        rows = promises(target, tolerance, replicates, processes=processes)
        print(rows_of_text(f"{target} ±{width}", rows), flush=True)
    truth, until = TRUTHS[1], Until(CENTRE, 0.05, most=MOST)
    with ProcessPoolExecutor(processes) as pool:
        outcomes = list(pool.map(partial(common_levels, truth, until), range(max(1, replicates // 5)), chunksize=4))
    print(rows_of_text("median ±5 %, 20 common levels", [summary(truth, outcomes)]))


if __name__ == "__main__":
    main(sys.argv[1:])
