"""Cost of a sample: the engine and plain Runge-Kutta, exact and linear geometry, and the saving by skipping."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from ..core.aliases import Array
from ..core.units import STANDARD_GRAVITY
from ..models import Block, Law
from ..models.runs import TALLY, run_many
from ..motions import CloughPenzien, RiseStrongDecay, records
from ..motions.arrays import Record
from .measure import Row, is_rigid, oscillators, seconds
from .problems import CASES, DT, DURATION, LAWS, problem, record, typical
from .rivals.fixed_steps import Rival, runge_kutta, runge_kutta_at_rest

YARDSTICK = runge_kutta_at_rest()
PASSING = runge_kutta(1)
EXACT_GEOMETRY, LINEAR_GEOMETRY = "housner e=0.9", "housner e=0.9 geometry=linear"
SKIPPING_LEVELS = np.linspace(0.1, 2.0, 20)
"""Peak accelerations over g tan alpha, at which a rigid block uplifts."""


def motions(number: int, seed: int = 0) -> list[Record]:
    """Return simulated motions of the benchmark's kind."""
    envelope = RiseStrongDecay(2.0, 10.0, 0.2)
    shaking = CloughPenzien(omega_g=15.0, xi_g=0.6, duration=DURATION, dt=DT, envelope=envelope)
    return records(shaking.sample(number, seed=seed))


def speed(
    laws: Sequence[Law] = LAWS, cases: Mapping[str, tuple[list[Block], Array]] = CASES, repeats: int = 7
) -> list[Row]:
    """Measure ns per sample and run of the engine, without skipping, and of the yardstick, for each law and case.

    `share` is the engine's cost over that of the yardstick, one step per sample; `share_passing` is the cost over that
    of the same RK4 without steps while a rigid block rests.
    """
    shaking = record()
    rows = []
    for law in laws:
        for case, (blocks, factors) in cases.items():
            grid = np.tile(factors, (len(blocks), 1))
            engine = partial(run_many, oscillators(law, blocks), grid, shaking, DT, skip=False)
            rivals = [partial(_run, one, law, blocks, factors, shaking) for one in (YARDSTICK, PASSING)]
            taken = seconds([engine, *rivals[: 2 if is_rigid(law) else 1]], repeats)
            ours, theirs, *passing = (1e9 * s / (grid.size * shaking.size) for s in taken)
            rows.append(
                {"law": law.label, "case": case, "rigid": is_rigid(law), "engine": ours, "yardstick": theirs}
                | {"share": ours / theirs, "share_passing": ours / (passing or [theirs])[0]}
            )
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


def skipping(
    laws: Sequence[Law] = LAWS, blocks: Sequence[Block] | None = None, number: int = 5, repeats: int = 5
) -> list[Row]:
    """Measure the speed-up of a typical IDA by skipping, for peaks and for flags alone, and the share left out."""
    blocks = typical() if blocks is None else blocks
    shakes = motions(number)
    thresholds = np.array([STANDARD_GRAVITY * np.tan(block.alpha) for block in blocks])
    rows = []
    for law in laws:
        own = oscillators(law, blocks)

        def analysis(skip: bool, flags_only: bool, tally: Any = None, own: Any = own) -> None:
            for one in shakes:
                factors = thresholds[:, None] * SKIPPING_LEVELS / np.abs(one.acceleration).max()
                run_many(own, factors, one.acceleration, one.dt, skip, flags_only, tally)

        tasks: list[Callable[[], None]] = [
            partial(analysis, False, False),
            partial(analysis, True, False),
            partial(analysis, True, True),
        ]
        whole, peaks, flags = seconds(tasks, repeats)
        samples = len(shakes) * len(blocks) * SKIPPING_LEVELS.size * shakes[0].acceleration.size
        rows.append(
            {"law": law.label, "whole": 1e9 * whole / samples, "peaks": whole / peaks, "flags": whole / flags}
            | {"left_out_peaks": _shares(analysis, False)[0], "left_out_flags": _shares(analysis, True)[0]}
            | {"after_overturning": _shares(analysis, False)[1]}
        )
    return rows


def _shares(analysis: Callable[..., None], flags_only: bool) -> tuple[float, float]:
    """Return the shares of all samples that skipping leaves out, and that follow overturning (left out in any case)."""
    tally = np.zeros(len(TALLY), np.int64)
    analysis(True, flags_only, tally)
    counts = dict(zip(TALLY, tally.tolist(), strict=True))
    skipped = counts["before_uplift"] + counts["cannot_overturn"]
    return skipped / counts["samples"], counts["after_overturning"] / counts["samples"]
