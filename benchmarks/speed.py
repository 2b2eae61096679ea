"""Cost of a sample: the engine and plain Runge-Kutta, exact and linear geometry."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from ..core.aliases import Array
from ..models import Block, Law
from ..models.runs import run_many
from ..motions import records
from ..motions.arrays import Record
from .measure import Row, oscillators, seconds
from .problems import CASES, DT, LAWS, SHAKING, problem, record
from .rivals.fixed_steps import Rival, runge_kutta

YARDSTICK = runge_kutta(1)
EXACT_GEOMETRY, LINEAR_GEOMETRY = "housner e=0.9", "housner e=0.9 geometry=linear"


def motions(number: int, seed: int = 0) -> list[Record]:
    """Return simulated motions of the benchmark's kind."""
    return records(SHAKING.sample(number, seed=seed))


def speed(
    laws: Sequence[Law] = LAWS, cases: Mapping[str, tuple[list[Block], Array]] = CASES, repeats: int = 7
) -> list[Row]:
    """Measure ns per sample and run of the engine, without skipping, and of the yardstick, for each law and case.

    `share` is the engine's cost divided by the yardstick's.
    """
    shaking = record()
    rows = []
    for law in laws:
        for case, (blocks, factors) in cases.items():
            grid = np.tile(factors, (len(blocks), 1))
            engine = partial(run_many, oscillators(law, blocks), grid, shaking, DT, skip=False)
            taken = seconds([engine, partial(_run, YARDSTICK, law, blocks, factors, shaking)], repeats)
            ours, theirs = (1e9 * s / (grid.size * shaking.size) for s in taken)
            rows.append({"law": law.label, "case": case, "engine": ours, "yardstick": theirs, "share": ours / theirs})
    return rows


def _run(rival: Rival, law: Law, blocks: Sequence[Block], factors: Array, shaking: Array) -> None:
    for block in blocks:
        rival.run(problem(block, law), shaking, DT, factors, 0)


def exact_over_linear(rows: Sequence[Row]) -> dict[str, float]:
    """Return the cost of exact over linear geometry by case, from the rows of `speed`."""
    cost = {(row["law"], row["case"]): row["engine"] for row in rows}
    return {
        case: cost[EXACT_GEOMETRY, case] / cost[LINEAR_GEOMETRY, case]
        for law, case in cost
        if law == EXACT_GEOMETRY and (LINEAR_GEOMETRY, case) in cost
    }
