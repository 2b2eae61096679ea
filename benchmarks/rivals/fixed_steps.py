"""Fixed-step integrators of rocking blocks, as a careful user would write them: rivals of the engine.

Plain Runge-Kutta and Newmark locate no events: they change damping, impacts and rest at the ends of their steps.
Runge-Kutta with events ends its steps at events, and is the cheapest rival that is right.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from ...core.aliases import Array, Flags
from ..kernels import rivals as kernels
from ..problems import Problem


class Answer(NamedTuple):
    """Results of m runs: peak (m,) of abs(theta), pi/2 if overturned; overturned (m,); rotation (m, samples); rad."""

    peak: Array
    overturned: Flags
    rotation: Array


class Rival(Protocol):
    """Integrator with its settings."""

    @property
    def name(self) -> str: ...

    def available(self) -> str:
        """Return the reason for which it cannot run here; "" if it can."""
        ...

    def run(self, problem: Problem, record: Array, dt: float, factors: Array, every: int) -> Answer:
        """Solve `problem` from rest under every factor (m,) times the record (n,), m/s², linear between samples.

        Rotations are given at every `every`-th sample; with `every` = 0 none are given, for timing.
        """
        ...


def empty(record: Array, factors: Array, every: int) -> Answer:
    """Return an answer at rest, to be filled in."""
    m = factors.size
    samples = -(-record.size // every) if every else 0
    return Answer(np.zeros(m), np.zeros(m, dtype=np.bool_), np.zeros((m, samples)))


@dataclass(frozen=True)
class FixedSteps:
    """Method in numba with `steps` equal steps per sample; it handles every problem."""

    title: str
    steps: int
    newmark: bool | None = None
    locates: bool = False

    @property
    def name(self) -> str:
        return f"{self.title} dt" if self.steps == 1 else f"{self.title} dt/{self.steps}"

    def available(self) -> str:
        return ""

    def run(self, problem: Problem, record: Array, dt: float, factors: Array, every: int) -> Answer:
        answer = empty(record, factors, every)
        leading = () if self.locates else (problem.kind == kernels.EXACT or None, self.newmark)
        kernel = kernels.located_events if self.locates else kernels.fixed_steps
        kernel(*leading, record, dt, self.steps, every, factors, *problem[1:], *answer)
        return answer


def runge_kutta(steps: int) -> FixedSteps:
    """Return classical Runge-Kutta in vectors of runs: the yardstick of the engine's speed."""
    return FixedSteps("RK4", steps)


def newmark(steps: int) -> FixedSteps:
    """Return Newmark's average acceleration, iterated to convergence, as in structural programs."""
    return FixedSteps("Newmark", steps, newmark=True)


def located_runge_kutta(steps: int) -> FixedSteps:
    """Return classical Runge-Kutta that ends a step at each event; an excursion within one step is not detected."""
    return FixedSteps("RK4 with events", steps, locates=True)


RIVALS: tuple[Rival, ...] = (
    *(runge_kutta(steps) for steps in (1, 5, 20, 100)),
    *(newmark(steps) for steps in (1, 5, 20, 100)),
    *(located_runge_kutta(steps) for steps in (1, 5, 20)),
)
