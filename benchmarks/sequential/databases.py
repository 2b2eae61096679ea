"""How often sequential analysis keeps its promise for a block under databases of simulated motions, and what it takes.

A replicate draws its motions from a database with replacement; the truth is that of the whole database.
`python -m toppling.benchmarks.sequential.databases [replicates] [processes]` prints the tables.
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

from ...core.aliases import Array, Flags, Index
from ...core.streams import stream
from ...core.wording import counted
from ...fragility.adaptive.probit import Observations, fit_probit
from ...fragility.adaptive.until import MEDIAN as CENTRE, Until
from ...models import Block, EnergyConsistent
from ...models.oscillator import stack
from ...models.outputs import OF_ENGINE
from ...models.runs import TALLY, run_mixed
from ...motions import CloughPenzien, SiteBasedScenario, records
from ...motions.arrays import Record
from .promises import GRID, MOST, Outcome, Row, common_levels, grid_levels, sequential, summary
from .truths import MEDIAN

BLOCK = Block(0.4, 1.8)
OWN = stack([EnergyConsistent().oscillator(BLOCK)])
MIDDLE = 0.05
"""The half width of which several analyses are compared."""
AS_OFTEN = {"4,000 Clough-Penzien motions": 0.015, "1,500 site-based motions": 0.0375}
"""Half width that common levels must ask for, to be within `MIDDLE` as often as sequential analyses are."""
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
TOLERANCES = (0.10, MIDDLE, 0.02)
EACH = (3, 2)
"""Runs of each motion of the analyses that are compared; the first is what analyses take if nothing else is asked."""
TOGETHER = 32
"""Motions of a wave, by which the runs are timed."""
OF_ONE = 64
"""Levels of a motion that fill the lanes of the engine by themselves, about."""
NEAR = 0.25
"""Half width, in ln, of the levels that are timed near the median."""
CALLS = 60


Spent = tuple[float, float, float]
"""CPU time of runs, s, samples computed, and events solved."""


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
    spent: list[Spent] = field(default_factory=list)

    def verdicts(self, levels: Array, random: np.random.Generator) -> Flags:
        """Return whether the block overturns at levels (run, motion), each motion drawn anew."""
        which: Index = np.asarray(random.integers(0, len(self.motions), levels.shape[1]), np.int64)
        return self.fell(levels, which)

    def fell(self, levels: Array, which: Index) -> Flags:
        """Return whether the block overturns under motions `which` (motion,) at levels (run, motion)."""
        started = thread_time()
        factors = levels * self.unit / self.peaks[which]
        index = np.broadcast_to(which, levels.shape).ravel()
        counts = np.zeros(len(TALLY), np.int64)
        runs = run_mixed(OWN, np.zeros(levels.size, np.int64), index, factors.ravel(), self.motions, True, True, counts)
        seconds = thread_time() - started
        count = dict(zip(TALLY, counts.tolist(), strict=True))
        left_out = count["before_uplift"] + count["after_overturning"] + count["cannot_overturn"]
        self.spent.append((seconds, count["samples"] - left_out, count["events"]))
        return np.asarray(runs[:, OF_ENGINE["overturned"]] > 0.0).reshape(levels.shape)


@cache
def database(name: str) -> Database:
    """Return a database in units of half its median."""
    generator, number = DATABASES[name]
    motions = records(generator.sample(number, seed=SEED))
    peaks = np.array([np.abs(record.acceleration).max() for record in motions])
    first = Database(name, motions, peaks)
    known = math.log(5.0)
    for width in WIDTHS:
        known = _log_median(first, known, width)
    return Database(name, motions, peaks, math.exp(known) / MEDIAN)


def _log_median(data: Database, near: float, width: float) -> float:
    """Return ln of the level at which half of a database's runs overturn, from jittered levels within `width`."""
    n = len(data.motions)
    strata = (np.arange(LEVELS)[:, None] + stream(SEED, 5).random((LEVELS, n))) / LEVELS
    x = near + width * (2.0 * strata - 1.0)
    fell = data.fell(np.exp(x), np.arange(n))
    motion = np.broadcast_to(np.arange(n), x.shape)
    fitted, _ = fit_probit(Observations(x.ravel(), fell.ravel(), motion.ravel()))
    assert fitted is not None  # (levels on both sides of the median)
    return fitted.median().value


class Analysis(NamedTuple):
    """A way to a median within `tolerance`: so many runs of each motion near it, or common levels.

    asked: the half width that common levels ask for; near: they are fitted near the median alone.
    """

    tolerance: float
    runs: int = EACH[0]
    asked: float | None = None
    near: bool = False

    @property
    def label(self) -> str:
        """What it is called in a table."""
        if self.asked is None:
            return f"{counted(self.runs, 'run')} of each motion"
        asks = "" if self.asked == self.tolerance else f", ask ±{100.0 * self.asked:g}%"
        return f"{GRID} common levels{asks}{', local fit' if self.near else ''}"


def analyses(name: str) -> list[Analysis]:
    """Return the analyses of a database that are compared."""
    more = {MIDDLE: [Analysis(MIDDLE, asked=AS_OFTEN[name]), Analysis(MIDDLE, asked=MIDDLE, near=True)]}
    ways: list[Analysis] = []
    for tolerance in TOLERANCES:
        ways += [Analysis(tolerance, runs) for runs in (EACH if tolerance == MIDDLE else EACH[:1])]
        ways += [Analysis(tolerance, asked=tolerance), *more.get(tolerance, [])]
    return ways


def outcome(name: str, way: Analysis, seed: int) -> tuple[Outcome, Spent]:
    """Return the end of one analysis, and what its runs took."""
    data = database(name)
    data.spent.clear()
    until = Until(CENTRE, way.tolerance, most=MOST)
    if way.asked is None:
        end = sequential(data, until, seed, way.runs)  # type: ignore[arg-type]  # (of a truth it has what is used)
    else:
        asked = Until(CENTRE, way.asked, most=MOST)
        end = common_levels(data, until, seed, asked, way.near)  # type: ignore[arg-type]
    return end, tuple(np.sum(data.spent, axis=0).tolist())


def promises_kept(name: str, way: Analysis, replicates: int, processes: int = PROCESSES) -> tuple[Row, Spent]:
    """Return the row of a way of analysis, and what its runs take on average."""
    with ProcessPoolExecutor(processes) as pool:
        every = list(pool.map(partial(outcome, name, way), range(replicates), chunksize=4))
    row = summary(database(name), [end for end, _ in every])  # type: ignore[arg-type]
    return row, tuple(np.mean([spent for _, spent in every], axis=0).tolist())


HEAD = (
    f"{'within':6s} {'analysis':28s} {'kept':>5s} {'95%':>4s} {'motions':>7s} {'runs':>7s} {'samples':>7s} "
    f"{'events':>6s} {'ms':>7s}"
)


def line(way: Analysis, row: Row, spent: Spent) -> str:
    """Return a way of analysis as a line of the table, samples and events in thousands."""
    seconds, samples, events = spent
    return (
        f"±{way.tolerance:<5.0%} {way.label:28s} {row.kept:5.3f} {row.within:4.2f} {row.motions:7,.0f} "
        f"{row.runs:7,.0f} {1e-3 * samples:7,.0f} {1e-3 * events:6,.0f} {1e3 * seconds:7,.1f}"
    )


def cost(name: str) -> tuple[float, float, float]:
    """Return the CPU time of a run, s: of common levels, and near the median three of each motion and many of one.

    Medians over calls in turns, each of which runs a wave of motions.
    """
    base, random = database(name), stream(SEED, 6)
    grid = np.repeat(grid_levels()[:, None], TOGETHER, axis=1)
    spent: list[tuple[float, ...]] = []
    for _ in range(CALLS):
        base.spent.clear()
        near = [MEDIAN * np.exp(NEAR * random.uniform(-1.0, 1.0, (runs, TOGETHER))) for runs in (3, OF_ONE)]
        for levels in (grid, *near):
            base.verdicts(levels, random)
        sizes = (levels.size for levels in (grid, *near))
        spent.append(tuple(seconds / size for (seconds, *_), size in zip(base.spent, sizes, strict=True)))
    common, three, many = np.median(spent, axis=0).tolist()
    return common, three, many


def main(arguments: Sequence[str]) -> None:
    """Print the tables."""
    replicates, processes = (*map(int, arguments), *(REPLICATES, PROCESSES)[len(arguments) :])
    for name in DATABASES:
        print(f"{name}\n{HEAD}", flush=True)
        for way in analyses(name):
            print(line(way, *promises_kept(name, way, replicates, processes)), flush=True)
        common, near, of_one = (f"{1e6 * seconds:.0f}" for seconds in cost(name))
        near_median = f"{near} (3 near the median), {of_one} ({OF_ONE} near it)"
        print(f"CPU of a run, us: {common} ({GRID} common levels), {near_median}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
