"""How often sequential analysis keeps its promise for a block under databases of simulated motions.

A replicate draws its motions from a database with replacement; the truth is that of the whole database.
`python -m toppling.benchmarks.sequential.databases [replicates] [processes]` prints the table.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from functools import cache, partial
from time import thread_time
from typing import NamedTuple

import numpy as np

from ...aliases import Array, Flags, Index
from ...fragility.adaptive.probit import Observations, fit_probit
from ...fragility.adaptive.until import MEDIAN as CENTRE
from ...fragility.adaptive.until import Until
from ...models import Block, EnergyConsistent
from ...models.oscillator import stack
from ...models.runs import OUTPUTS, run_mixed
from ...motions import CloughPenzien, SiteBasedScenario, records
from ...motions.arrays import Record
from ...streams import stream
from .promises import GRID, MOST, Outcome, Row, common_levels, grid_levels, rows_of_text, sequential, summary
from .truths import MEDIAN

BLOCK = Block(0.4, 1.8)
COMMON = 0.05
"""Half width of the answers of common levels."""
AS_OFTEN = {"4,000 Clough-Penzien motions": 0.02, "1,500 site-based motions": 0.045}
"""Half width that they must ask for, to be within `COMMON` about as often as sequential analyses are."""
DATABASES = {
    "4,000 Clough-Penzien motions": (CloughPenzien(duration=20.0, dt=0.01), 4000),
    "1,500 site-based motions": (SiteBasedScenario(magnitude=6.8, distance=15_000.0, vs30=620.0, dt=0.01), 1500),
}
SEED = 11
LEVELS = 48
"""Levels of each motion near the median, for the truth."""
WIDTHS = (1.2, 0.25, 0.05)
"""Half widths, in ln, within which the median is looked for: at last so near that no form of curve matters."""
REPLICATES = 500
PROCESSES = 2
TOLERANCES = (0.10, 0.05, 0.02)
TOGETHER = 32
"""Motions of a wave, by which the runs are timed."""
OF_ONE = 64
"""Levels of a motion that fill the lanes of the engine by themselves, about."""
NEAR = 0.25
"""Half width, in ln, of the levels that are timed near the median."""
CALLS = 60


@dataclass(frozen=True, eq=False)
class Database:
    """Motions of one kind and what they do to a block: a truth as those of `truths`, with levels over half the median.

    peaks (motion,): PGA, m/s²; log_median: of the levels (`truths.MEDIAN`), but for what rounding leaves.
    """

    name: str
    motions: list[Record]
    peaks: Array
    unit: float = 1.0
    log_median: float = math.log(MEDIAN)
    spent: list[float] = field(default_factory=list)

    def verdicts(self, levels: Array, random: np.random.Generator) -> Flags:
        """Return whether the block overturns at levels (run, motion), each motion drawn anew."""
        which: Index = np.asarray(random.integers(0, len(self.motions), levels.shape[1]), np.int64)
        return self.fell(levels, which)

    def fell(self, levels: Array, which: Index) -> Flags:
        """Return whether the block overturns under motions `which` (motion,) at levels (run, motion)."""
        started = thread_time()
        factors = levels * self.unit / self.peaks[which]
        each = np.broadcast_to(which, levels.shape).ravel()
        own = stack([EnergyConsistent().oscillator(BLOCK)])
        found = run_mixed(own, np.zeros(levels.size, np.int64), each, factors.ravel(), self.motions, True, True)
        self.spent.append(thread_time() - started)
        return np.asarray(found[:, OUTPUTS["overturned"]] > 0.0).reshape(levels.shape)


@cache
def database(name: str) -> Database:
    """Return a database in units of half its median."""
    generator, number = DATABASES[name]
    motions = records(generator.sample(number, seed=SEED))
    peaks = np.array([np.abs(one.acceleration).max() for one in motions])
    first = Database(name, motions, peaks)
    known = math.log(5.0)
    for width in WIDTHS:
        known = _log_median(first, known, width)
    return Database(name, motions, peaks, math.exp(known) / MEDIAN)


def _log_median(one: Database, near: float, width: float) -> float:
    """Return ln of the level at which half of a database's runs overturn, from jittered levels within `width`."""
    n = len(one.motions)
    strata = (np.arange(LEVELS)[:, None] + stream(SEED, 5).random((LEVELS, n))) / LEVELS
    x = near + width * (2.0 * strata - 1.0)
    fell = one.fell(np.exp(x), np.arange(n))
    motion = np.broadcast_to(np.arange(n), x.shape)
    fitted, _ = fit_probit(Observations(x.ravel(), fell.ravel(), motion.ravel()))
    assert fitted is not None  # (levels on both sides of the median)
    return fitted.median().value


def outcome(name: str, until: Until, common: Until | None, seed: int) -> tuple[Outcome, float]:
    """Return the end of one analysis, and the CPU time of its runs, s; `common`: what is asked of common levels."""
    one = database(name)
    one.spent.clear()
    way = sequential if common is None else partial(common_levels, asked=common)
    return way(one, until, seed), sum(one.spent)  # type: ignore[arg-type]  # (of a truth it has what is used)


def promises_kept(
    name: str, tolerance: float, replicates: int, common: float | None = None, processes: int = PROCESSES
) -> tuple[Row, float]:
    """Return the row of a database and a tolerance of the median, and the mean CPU time of an analysis' runs, s.

    common: the half width that an analysis at common levels asks for; without it, the analysis is sequential.
    """
    until = Until(CENTRE, tolerance, most=MOST)
    asked = None if common is None else Until(CENTRE, common, most=MOST)
    with ProcessPoolExecutor(processes) as pool:
        every = list(pool.map(partial(outcome, name, until, asked), range(replicates), chunksize=4))
    row = summary(database(name), [one for one, _ in every])  # type: ignore[arg-type]
    return row._replace(truth=name), float(np.mean([spent for _, spent in every]))


class Cost(NamedTuple):
    """CPU time of a run, s: of common levels, and of levels near the median, three of each motion or many of one."""

    common: float
    near: float
    near_of_one: float


def cost(name: str) -> Cost:
    """Return what a run costs, medians over calls in turns, each of which runs a wave of motions."""
    one, random = database(name), stream(SEED, 6)
    grid = np.repeat(grid_levels()[:, None], TOGETHER, axis=1)
    spent: list[tuple[float, ...]] = []
    for _ in range(CALLS):
        one.spent.clear()
        near = [MEDIAN * np.exp(NEAR * random.uniform(-1.0, 1.0, (n, TOGETHER))) for n in (3, OF_ONE)]
        every = (grid, *near)
        for levels in every:
            one.verdicts(levels, random)
        spent.append(tuple(time / levels.size for time, levels in zip(one.spent, every, strict=True)))
    return Cost(*np.median(spent, axis=0).tolist())


def cost_text(name: str, found: Cost) -> str:
    """Return the cost of a run as a line."""
    common, near, of_one = (f"{1e6 * one:.0f}" for one in found)
    return (
        f"CPU of a run under {name}, us: {common} of {GRID} common levels; "
        f"near the median {near} (3 levels a motion), {of_one} ({OF_ONE} levels a motion)"
    )


def main(arguments: Sequence[str]) -> None:
    """Print the table."""
    replicates, processes = (*map(int, arguments), *(REPLICATES, PROCESSES)[len(arguments) :])
    for name in DATABASES:
        for tolerance in TOLERANCES:
            row, spent = promises_kept(name, tolerance, replicates, None, processes)
            print(rows_of_text(f"median ±{tolerance:.0%}, runs {1e3 * spent:.1f} ms", [row]), flush=True)
        for asked in (COMMON, AS_OFTEN[name]):
            row, spent = promises_kept(name, COMMON, max(2, replicates * 2 // 5), asked, processes)
            words = f"median ±{COMMON:.0%}, 20 common levels that ask for ±{100.0 * asked:g}%"
            print(rows_of_text(f"{words}, runs {1e3 * spent:.1f} ms", [row]), flush=True)
        print(cost_text(name, cost(name)), flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
