"""Work and precision: the cost of each integrator, and its errors against the 40-digit truth."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from time import thread_time

import numpy as np

from ..core.aliases import Array
from ..models import Law
from ..models.runs import run_many
from .measure import ENGINE, TRUTH_RUNS, Row, answers, errors, multiplication, oscillators, seconds, true_record
from .problems import DT, HARD, LAWS, problem
from .rivals.fixed_steps import RIVALS, Rival
from .rivals.taylor import Heyoka

ALL: tuple[Rival, ...] = (*RIVALS, *(Heyoka(tolerance) for tolerance in (1e-6, 1e-9, 1e-12, 1e-15)))
TIMED = np.linspace(0.05, 0.45, 256)
"""Factors with which an integrator is timed on the hard block."""
BRIEF = 0.1
"""Duration, s, below which the timing of a rival is repeated."""


def precision(laws: Sequence[Law] = LAWS, rivals: Sequence[Rival] = ALL, timed: Array = TIMED) -> Row:
    """Measure cost and errors of the engine and all rivals under all laws (`rows`); `missing`: rivals with reasons."""
    shaking = true_record()
    missing = {rival.name: rival.available() for rival in rivals if rival.available()}
    rows: list[Row] = []
    for law in laws:
        rows.append(_engine(law, shaking, timed))
        rows += [_rival(law, rival, shaking, timed) for rival in rivals if rival.name not in missing]
    return {"rows": rows, "missing": missing}


def _engine(law: Law, shaking: Array, timed: Array) -> Row:
    task = partial(run_many, oscillators(law, [HARD]), timed[None, :], shaking, DT, skip=False)
    cost = 1e9 * seconds([task], 5)[0] / (timed.size * shaking.size)
    error_row = errors(law, answers(law, None, shaking))
    return {"law": law.label, "name": ENGINE, "cost": cost, "twin": multiplication(law), **error_row}


def _rival(law: Law, rival: Rival, shaking: Array, timed: Array) -> Row:
    start = thread_time()
    error_row = errors(law, answers(law, rival, shaking))
    expected = (thread_time() - start) * timed.size / TRUTH_RUNS
    task = partial(rival.run, problem(HARD, law), shaking, DT, timed, 0)
    taken = seconds([task], 3 if expected <= BRIEF else 1)[0] / timed.size
    return {"law": law.label, "name": rival.name, "cost": 1e9 * taken / shaking.size, **error_row}
