"""Rival scipy solve_ivp, with compiled right-hand sides and restarts at events."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.integrate import solve_ivp

from ...core.aliases import Array
from ..kernels import rivals as kernels
from ..kernels.rivals import EXACT, VISCOUS
from ..problems import Problem
from .fixed_steps import Answer, empty, finish

_MOST_LEGS = 100_000


def _event(function: Callable[..., float], direction: int) -> Callable[..., float]:
    """Mark a function as an event that ends the integration."""
    function.terminal = True  # type: ignore[attr-defined]
    function.direction = direction  # type: ignore[attr-defined]
    return function


@dataclass
class _Leg:
    """State of a run between two events."""

    t: float
    theta: float
    omega: float
    mode: int
    side: float
    held: float


@dataclass(frozen=True)
class SolveIvp:
    """scipy's solve_ivp with compiled right-hand sides.

    Problems with the same damping at every rotation need no events except the end.  The other problems are solved
    branch by branch with terminal events.  If `limited` is False, steps may pass over a short excursion or samples.
    """

    method: Literal["RK45", "DOP853", "LSODA"]
    rtol: float
    limited: bool

    @property
    def name(self) -> str:
        return f"solve_ivp {self.method} {self.rtol:.0e}" + (" max_step=dt" if self.limited else "")

    def available(self) -> str:
        return ""

    def handles(self, problem: Problem) -> bool:
        return True

    def run(self, problem: Problem, record: Array, dt: float, factors: Array, every: int) -> Answer:
        answer = empty(record, factors, every)
        for j, factor in enumerate(factors):
            path = np.zeros(record.size)
            if problem.kind == VISCOUS:
                leg = self._whole(problem, factor * record, dt, path)
            else:
                leg = self._by_branches(problem, factor * record, dt, path)
            ended = record.size - 1
            if leg.mode == kernels.FALLEN:
                ended = min(math.ceil(leg.t / dt), ended)
                path[ended] = leg.theta
            finish(answer, j, problem, path, ended, leg.omega, float(np.abs(path).max()), every)
        return answer

    def _solve(
        self,
        field: Callable[..., Array],
        numbers: tuple[float, ...],
        shaking: Array,
        dt: float,
        leg: _Leg,
        events: list[Callable[..., float]],
        path: Array,
        most: float,
    ) -> int:
        """Solve up to the first event, whose number is returned, or to the end of the record (-1)."""
        first = math.floor(leg.t / dt * (1.0 + 1e-14)) + 1
        end = (shaking.size - 1) * dt
        times = np.append(np.arange(first, shaking.size - 1) * dt, end)
        solution = solve_ivp(
            field,
            (leg.t, end),
            (leg.theta, leg.omega),
            method=self.method,
            t_eval=times,
            events=events,
            args=(shaking, dt, *numbers),
            rtol=self.rtol,
            atol=1e-2 * self.rtol,  # rotations and velocities are of the order of 0.1
            max_step=most,
        )
        if solution.status < 0:
            raise RuntimeError(f"{self.name}: {solution.message}")
        if len(solution.t):  # no sample may have been reached
            path[first : first + len(solution.t)] = solution.y[0]
        if solution.status != 1 or solution.t_events is None or solution.y_events is None:
            leg.t = end
            leg.theta, leg.omega = solution.y[:, -1]
            return -1
        number = next(i for i, found in enumerate(solution.t_events) if found.size)
        leg.t = solution.t_events[number][0]
        leg.theta, leg.omega = solution.y_events[number][0]
        return number

    def _whole(self, problem: Problem, shaking: Array, dt: float, path: Array) -> _Leg:
        leg = _Leg(0.0, 0.0, 0.0, kernels.ZONE, 1.0, problem.c)
        flat = _event(lambda t, y, *_: abs(y[0]) - kernels.FLAT, 1)
        numbers = (problem.q2, problem.alpha, problem.edge, problem.zone, problem.c, problem.gain)
        most = dt if self.limited else math.inf
        if self._solve(kernels.viscous_field, numbers, shaking, dt, leg, [flat], path, most) == 0:
            leg.mode = kernels.FALLEN
        return leg

    def _by_branches(self, problem: Problem, shaking: Array, dt: float, path: Array) -> _Leg:
        kind, q2, alpha, edge, zone, c, e, gain, rigid = problem[1:]
        threshold = kernels.holds(kind, q2, alpha) / gain
        end = (shaking.size - 1) * dt
        leg = _Leg(0.0, 0.0, 0.0, kernels.REST if rigid else kernels.ZONE, 1.0, c)
        usual = most = dt if self.limited else math.inf
        for _ in range(_MOST_LEGS):
            if leg.t >= end * (1.0 - 1e-14) or leg.mode == kernels.FALLEN:
                return leg
            if leg.mode == kernels.REST:
                self._lift(leg, shaking, dt, threshold)
                continue
            low, high = kernels.bounds(leg.mode, edge)
            numbers = kernels.law(leg.mode, leg.side, leg.held, kind, q2, alpha, zone, c, gain)
            events = [
                _event(lambda t, y, *_, side=leg.side, low=low: side * y[0] - low, -1),
                _event(lambda t, y, *_, side=leg.side, high=high: side * y[0] - high, 1),
            ]
            if rigid and leg.mode == kernels.ZONE:
                way = math.copysign(1.0, leg.omega)
                events.append(_event(lambda t, y, *_, way=way: way * y[1], -1))
            start = _Leg(**vars(leg))
            number = self._solve(kernels.branch_field, (kind == EXACT, *numbers), shaking, dt, leg, events, path, most)
            if number < 0:
                return leg
            event = (kernels.LOW, kernels.HIGH, kernels.TURN)[number]
            outward = {kernels.LOW: -1.0, kernels.HIGH: 1.0}.get(event, 0.0) * leg.side * leg.omega
            if outward < 0.0 and leg.t <= start.t and most > 1e-9 * dt:
                # The first step crossed the bound twice, and its start was taken as the event: take shorter steps.
                leg, most = start, 0.25 * min(most, dt)
                continue
            most = usual
            u = float(np.interp(leg.t / dt, np.arange(shaking.size), shaking))
            impact = leg.mode == kernels.RIGID and event == kernels.LOW
            leg.mode, leg.side, leg.theta, leg.omega, leg.held = kernels.transition(
                event, leg.mode, leg.side, leg.theta, leg.omega, leg.held, u, kind, q2, alpha, edge, zone, c, e, rigid
            )
            after = min(int(leg.t / dt) + 1, shaking.size - 1)
            if impact and kernels.settles(leg.omega, u, shaking[after], after * dt - leg.t, kind, q2, alpha, e, gain):
                leg.mode, leg.omega = kernels.REST, 0.0
        raise RuntimeError(f"{self.name}: events without end at {leg.t} s")

    @staticmethod
    def _lift(leg: _Leg, shaking: Array, dt: float, threshold: float) -> None:
        """Move from rest to the time at which the threshold is exceeded, or to the end of the record."""
        i = int(leg.t / dt)
        later = np.flatnonzero(np.abs(shaking[i + 1 :]) > threshold)
        if not later.size:
            leg.t = (shaking.size - 1) * dt
            return
        i += int(later[0])
        u0, u1 = shaking[i], shaking[i + 1]
        if abs(u0) <= threshold:
            leg.t = max(leg.t, (i + (math.copysign(threshold, u1) - u0) / (u1 - u0)) * dt)
        leg.mode = kernels.RIGID
        leg.side = -math.copysign(1.0, u1)
