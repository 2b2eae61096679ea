"""Rival heyoka: Taylor's method in SIMD lanes, with events located to rounding; the strongest rival in accuracy.

Every lane solves its own run on its own branch: stiffness, offset, damping, bounds and the linear piece of the record
are parameters, so that a step ends at a sample or at an event and no kink is smoothed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import numpy as np

from ...core.aliases import Array, Index
from ..kernels import rivals as kernels
from ..kernels.rivals import EXACT
from ..problems import Problem
from .fixed_steps import Answer, empty

_MOST_STEPS = 20  # per sample and run; usual are one step and the events


class _Note:
    """Callback that notes the event that ended a lane's step."""

    def __init__(self, noted: Index, event: int) -> None:
        self.noted = noted
        self.event = event

    def __call__(self, integrator: Any, sign: int, lane: int) -> bool:
        self.noted[lane] = self.event
        return True

    def __deepcopy__(self, memo: dict[int, Any]) -> _Note:
        return self  # heyoka copies its callbacks, and would leave `noted` behind


@lru_cache(maxsize=8)
def _integrator(exact: bool, tolerance: float, batch: int) -> tuple[Any, Index]:
    """Return a compiled integrator (which takes seconds) and the array in which its events are noted."""
    hy = import_module("heyoka")
    # heyoka misses the root of a bounce of 1e-17 rad and warns; `next_stops` detects that theta passed its bound.
    hy.set_logger_level_error()
    theta, omega = hy.make_vars("theta", "omega")
    stiffness, offset, damping, shaking, slope, lower, upper, way = (hy.par[i] for i in range(8))
    forcing = shaking + slope * hy.time
    if exact:
        acceleration = -(stiffness * hy.sin(offset - theta) + forcing * hy.cos(offset - theta))
    else:
        acceleration = offset + stiffness * theta - damping * omega - forcing
    noted = np.full(batch, kernels.NOTHING)
    down, up = hy.event_direction.negative, hy.event_direction.positive
    # A branch starts on its bound, moving inward: because of the directions this is no event, so that no cooldown after
    # an event is needed, which would miss short excursions.
    events = [
        hy.t_event_batch(expression, callback=_Note(noted, event), cooldown=0.0, direction=direction)
        for expression, event, direction in (
            (theta - lower, kernels.LOW, down),
            (theta - upper, kernels.HIGH, up),
            (way * omega, kernels.TURN, down),
        )
    ]
    integrator = hy.taylor_adaptive_batch(
        [(theta, omega), (omega, acceleration)],
        np.zeros((2, batch)),
        pars=np.zeros((8, batch)),
        tol=tolerance,
        t_events=events,
    )
    return integrator, noted


@dataclass(frozen=True)
class Heyoka:
    """Taylor's method at a tolerance, in at most `batch` lanes; it handles every problem."""

    tolerance: float
    batch: int = 64

    @property
    def name(self) -> str:
        return f"heyoka {self.tolerance:.0e} batch {self.batch}"

    def available(self) -> str:
        return "" if find_spec("heyoka") else "heyoka is not installed"

    def run(self, problem: Problem, record: Array, dt: float, factors: Array, every: int) -> Answer:
        answer = empty(record, factors, every)
        batch = min(self.batch, 8 * -(-factors.size // 8))  # whole vectors of 8, no more than the runs need
        integrator, noted = _integrator(problem.kind == EXACT, self.tolerance, batch)
        noted[:] = kernels.NOTHING
        integrator.state[:] = 0.0
        limit = np.zeros(batch)
        lanes = (
            np.full(batch, -1),  # run
            np.zeros(batch, dtype=np.int64),  # sample
            np.zeros(batch),  # time
            np.zeros(batch, dtype=np.int64),  # mode
            np.ones(batch),  # side
            np.zeros(batch),  # held
            np.zeros(1, dtype=np.int64),  # pending
            noted,
        )
        view = (integrator.state, integrator.pars, limit)
        shared = (record, dt, every, factors, *problem[1:], *answer, *lanes)
        moved = np.zeros(batch)
        for _ in range(_MOST_STEPS * record.size * -(-factors.size // batch)):
            if not kernels.next_stops(*shared, moved, *view):
                return answer
            integrator.set_time(0.0)
            integrator.step(limit)
            moved = integrator.last_h
        raise RuntimeError(f"{self.name}: steps without end")
