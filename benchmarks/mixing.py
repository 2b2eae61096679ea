"""Cost of runs of which few share a motion: in mixed batches, and motion by motion."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import partial

import numpy as np

from ..core.aliases import Array, Index
from ..core.units import STANDARD_GRAVITY
from ..models import Law
from ..models.batches import batch_of, lay_out
from ..models.engine.starts import begin_runs
from ..models.oscillator import Stack, stack
from ..models.runs import TALLY, run_mixed, run_specimens
from ..motions.arrays import Record
from .measure import Row, oscillators, seconds
from .problems import HARD, LAWS
from .speed import motions

RUNS = 512
"""Runs of a batch."""
LEVELS = (1.5, 2.5, 4.0)
"""Peak accelerations over g tan alpha where a motion is run at few levels."""
RATIO_TARGET = 1.3
"""Cost of a run of a mixed batch over that of one in a batch of one motion."""
MOTION_TARGET = 40.0
"""Cost of a motion at `LEVELS`, µs."""
ONE_BY_ONE = 20


def mixing(laws: Sequence[Law] = LAWS, number: int = RUNS, repeats: int = 7) -> list[Row]:
    """Measure the cost, µs, of a run in batches of one motion and of many, and of a motion at few levels.

    What lies before the first uplift is skipped, and the laying out of the records is counted.  `before`: what is done
    of a mixed run before it begins, which runs of one motion share.  `alone`: the few levels motion by motion.
    """
    shakes = motions(number)
    high = np.array([np.abs(one.acceleration).max() for one in shakes])
    threshold = STANDARD_GRAVITY * np.tan(HARD.alpha)
    spread = np.geomspace(0.8, 6.0, number) * threshold
    few = np.outer(threshold / high, LEVELS)
    each, thrice = np.arange(number), np.repeat(np.arange(number), len(LEVELS))
    rows = []
    for law in laws:
        own = stack(oscillators(law, [HARD]))

        tasks: list[Callable[[], object]] = [
            partial(_motion_by_motion, own, shakes[:4], [spread / one for one in high[:4]]),
            partial(run_mixed, own, 0 * each, each, spread / high, shakes),
            partial(_before, own, each, spread / high, shakes),
            partial(run_mixed, own, 0 * thrice, thrice, few.ravel(), shakes),
            partial(_motion_by_motion, own, shakes[:ONE_BY_ONE], few),
        ]
        one, mixed, before, levels, apart = seconds(tasks, repeats)
        rows.append(
            {"law": law.label, "shared": 1e6 * one / (4 * number), "mixed": 1e6 * mixed / number}
            | {"ratio": mixed / number / (one / (4 * number)), "before": 1e6 * before / number}
            | {"levels": 1e6 * levels / number, "alone": 1e6 * apart / min(ONE_BY_ONE, number)}
        )
    return rows


def _before(own: Stack, which: Index, factors: Array, shakes: Sequence[Record]) -> None:
    records = lay_out([one.acceleration for one in shakes], shakes[0].dt)
    batch = batch_of(records, own, 0 * which, which, factors, np.zeros(len(TALLY), np.int64))
    begin_runs(batch, np.empty(0), True, False)


def _motion_by_motion(own: Stack, shakes: Sequence[Record], factors: Iterable[Array]) -> None:
    tally = np.zeros(len(TALLY), np.int64)
    for one, scale in zip(shakes, factors, strict=False):
        run_specimens(own, scale[None], one.acceleration, one.vertical, one.dt, True, False, tally)
