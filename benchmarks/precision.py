"""Work and precision: the cost of each integrator, and its errors against the 40-digit truth."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from time import thread_time

import numpy as np

from ..core.aliases import Array
from ..models import Law
from ..models.runs import run_many
from .measure import ENGINE, TRUTH_RUNS, Row, answers, errors, multiplication, oscillators, seconds, true_record
from .problems import DT, HARD, LAWS, TRUTH_FACTORS, problem
from .rivals.fixed_steps import Rival
from .rivals.peers import ALL

SHOWN = (
    "discrete e=0.9 δ=0.05",
    "giannini-masiani e=0.9 δ=0.05",
    "energy-consistent e=0.9 δ=0.05",
    "housner e=0.9",
)
"""Labels of the laws in the figure: one for each kind of dissipation, and exact geometry."""
ALLOWED, ALLOWED_ELSEWHERE, ALLOWED_FULL = 10.0, 0.6, 30.0
"""Time limits, s, of the runs of the truth under one law: shown, not shown, with --full."""
TIMED = np.linspace(0.05, 0.45, 256)
"""Factors with which an integrator is timed on the hard block; an expensive one is timed on the runs of the truth."""
TIMING_ALLOWED = 3.0
"""Time limit, s, of one timing with these factors."""
ALL_LAWS = "all laws"
MISSING, UNABLE, DEAR, FAILED = "not installed", "no means for the law", "too dear", "gave up"
"""Reasons for which a rival is left out."""
_PROBE = slice(400, 800)  # 2 s of strong shaking


def precision(
    laws: Sequence[Law] = LAWS, rivals: Sequence[Rival] = ALL, full: bool = False, timed: Array = TIMED
) -> dict[str, list[Row]]:
    """Measure cost and errors of the engine and all rivals under all laws (`found`); `left_out`: missing rivals."""
    shaking = true_record()
    found: list[Row] = []
    left_out: list[Row] = []
    missing = {rival.name: rival.available() for rival in rivals}
    left_out += [
        {"law": ALL_LAWS, "name": name, "why": MISSING, "reason": reason} for name, reason in missing.items() if reason
    ]
    for law in laws:
        found.append(_engine(law, shaking, timed))
        allowed = ALLOWED_FULL if full else ALLOWED if law.label in SHOWN else ALLOWED_ELSEWHERE
        for rival in rivals:
            if missing[rival.name]:
                continue
            row = _rival(law, rival, shaking, allowed, timed)
            (left_out if "reason" in row else found).append({"law": law.label, "name": rival.name} | row)
    return {"found": found, "left_out": left_out}


def _engine(law: Law, shaking: Array, timed: Array) -> Row:
    task = partial(run_many, oscillators(law, [HARD]), timed[None, :], shaking, DT, skip=False)
    cost = 1e9 * seconds([task], 5)[0] / (timed.size * shaking.size)
    found = errors(law, answers(law, None, shaking))
    return {"law": law.label, "name": ENGINE, "cost": cost, "twin": multiplication(law), **found}


def _rival(law: Law, rival: Rival, shaking: Array, allowed: float, timed: Array) -> Row:
    """Return cost and errors, or the reason for which there are none."""
    hard = problem(HARD, law)
    if not rival.handles(hard):
        return {"why": UNABLE, "reason": "has no means for this law"}
    try:
        a_run = _estimate(rival, law, shaking)
        if a_run * TRUTH_RUNS > allowed:
            needed = a_run * TRUTH_RUNS
            reason = (
                f"would take about {needed:.1f} s for the {TRUTH_RUNS} runs of the truth; {allowed:g} s are allowed"
            )
            return {"why": DEAR, "reason": reason, "seconds": needed}
        start = thread_time()
        there = answers(law, rival, shaking)
        taken = (thread_time() - start) / TRUTH_RUNS
        if a_run * timed.size <= TIMING_ALLOWED:
            task = partial(rival.run, hard, shaking, DT, timed, 0)
            repeats = 3 if a_run * timed.size <= 0.1 else 1
            taken = seconds([task], repeats)[0] / timed.size
    except RuntimeError as error:
        return {"why": FAILED, "reason": str(error)}
    return {"cost": 1e9 * taken / shaking.size, **errors(law, there)}


def _estimate(rival: Rival, law: Law, shaking: Array) -> float:
    """Estimate the CPU time, s, of one of several runs from a part of the record."""
    factors = np.array(TRUTH_FACTORS)
    part = shaking[_PROBE]
    hard = problem(HARD, law)

    def one_and_all(record: Array, factors: Array) -> Callable[[], object]:
        return partial(rival.run, hard, record, DT, factors, 0)

    one_and_all(part[:20], factors)()  # compiles
    start = thread_time()
    one_and_all(part, factors[-3:-2])()
    alone = thread_time() - start
    if alone * factors.size < 0.2:  # cheap enough to measure the gain from several runs at once
        start = thread_time()
        one_and_all(part, factors)()
        alone = min(alone, (thread_time() - start) / factors.size)
    return alone * shaking.size / part.size
