"""Integrators of other packages, each used as a competent user would: further rivals of the engine.

scipy is in `solve_ivp` and heyoka in `taylor`; numbalsoda and OpenSeesPy are here.  Packages are imported when they are
first used; a missing package is reported and is no error.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from typing import Any, Literal

import numpy as np
from numba import carray, cfunc, njit  # type: ignore[attr-defined]

from ...core.aliases import Array
from ..kernels import rivals as kernels
from ..kernels.rivals import ENERGY, ENTRY_SPEED, EXACT, IMPACT, VISCOUS
from ..problems import Problem
from .fixed_steps import RIVALS, Answer, Rival, empty, finish, label
from .solve_ivp import SolveIvp
from .taylor import Heyoka


def _missing(package: str) -> str:
    """Return the reason for which a package cannot be used; "" if it can."""
    try:
        import_module(package)
    except (ImportError, RuntimeError) as error:  # not installed, or without the libraries it was built for
        return f"{package}: {error.__context__ or error}"
    return ""


# ---------------------------------------------------------------------------------------------------------------------
# numbalsoda


@cache
def _compiled_runs(method: str) -> Callable[..., None]:
    """Return a function that solves all runs of a viscous problem within compiled code."""
    package = import_module("numbalsoda")
    solver = getattr(package, method)
    acceleration = kernels.viscous_acceleration

    @cfunc(package.lsoda_sig)
    def field(t, y, rate, data):  # type: ignore[no-untyped-def]
        numbers = carray(data, (9,))
        shaking = carray(data, (9 + int(numbers[8]),))[9:]
        q2, alpha, edge, zone, c = numbers[0], numbers[1], numbers[2], numbers[3], numbers[4]
        gain, dt = numbers[5] * numbers[6], numbers[7]
        rate[0] = y[1]
        rate[1] = acceleration(t, y[0], y[1], shaking, dt, q2, alpha, edge, zone, c, gain)

    address = field.address

    @njit(nogil=True)
    def runs(data, times, factors, rtol, out):  # type: ignore[no-untyped-def]
        for j in range(factors.size):
            data[6] = factors[j]
            out[j], _ = solver(address, np.zeros(2), times, data=data, rtol=rtol, atol=1e-2 * rtol)

    def keeps_field(*arguments: Any) -> None:
        assert field is not None  # keeps its machine code alive, whose address the loop uses
        runs(*arguments)

    return keeps_field


@dataclass(frozen=True)
class NumbaLsoda:
    """numbalsoda: the same right-hand side and solvers without Python in between; it has no events.

    The step has no bound.  `dop853` exists from numbalsoda 0.3 on.
    """

    method: Literal["lsoda", "dop853"]
    rtol: float

    @property
    def name(self) -> str:
        return f"numbalsoda {self.method} {self.rtol:.0e}"

    def available(self) -> str:
        missing = _missing("numbalsoda")
        if missing or hasattr(import_module("numbalsoda"), self.method):
            return missing
        return f"this version of numbalsoda has no {self.method}"

    def handles(self, problem: Problem) -> bool:
        return problem.kind == VISCOUS

    def run(self, problem: Problem, record: Array, dt: float, factors: Array, every: int) -> Answer:
        answer = empty(record, factors, every)
        q2, alpha, edge, zone, c, gain = (*problem[2:7], problem.gain)
        data = np.concatenate(([q2, alpha, edge, zone, c, gain, 1.0, dt, record.size], record))
        out = np.empty((factors.size, record.size, 2))
        _compiled_runs(self.method)(data, np.arange(record.size) * dt, factors, self.rtol, out)
        for j in range(factors.size):
            path = out[j, :, 0]
            fallen = np.flatnonzero(np.abs(path) >= kernels.FLAT)
            ended = int(fallen[0]) if fallen.size else record.size - 1
            finish(answer, j, problem, path, ended, out[j, ended, 1], float(np.abs(path).max()), every)
        return answer


# ---------------------------------------------------------------------------------------------------------------------
# OpenSeesPy


@dataclass(frozen=True)
class OpenSees:
    """OpenSeesPy: one degree of freedom on an elastic multilinear spring and a dashpot; Newmark, `steps` a sample.

    A held damping is set from Python after each step, because no material does so.  There is no element for impacts and
    rigid rest.
    """

    steps: int

    @property
    def name(self) -> str:
        return label("OpenSeesPy Newmark", self.steps)

    def available(self) -> str:
        return _missing("openseespy.opensees")

    def handles(self, problem: Problem) -> bool:
        return problem.kind not in {IMPACT, EXACT} and not problem.rigid

    def run(self, problem: Problem, record: Array, dt: float, factors: Array, every: int) -> Answer:
        answer = empty(record, factors, every)
        ops = import_module("openseespy.opensees")
        for j, factor in enumerate(factors):
            path = np.zeros(record.size)
            peak = 0.0
            ended = 0
            self._build(ops, problem, factor * record, dt)
            for ended, (theta, highest) in enumerate(self._samples(ops, problem, dt, record.size - 1), 1):
                path[ended] = theta
                peak = max(peak, highest)
                if highest >= kernels.FLAT:
                    path[ended] = math.copysign(kernels.FLAT, theta)
                    break
            finish(answer, j, problem, path, ended, ops.nodeVel(2, 1), peak, every)
        ops.wipe()
        return answer

    def _samples(self, ops: Any, problem: Problem, dt: float, intervals: int) -> Iterator[tuple[float, float]]:
        """Yield the rotation at each sample, and the largest since the sample before."""
        holds = problem.kind in {ENTRY_SPEED, ENERGY}
        kind, q2, alpha, edge, zone, c, e, _, _ = problem[1:]
        calls, steps = (self.steps, 1) if holds else (1, self.steps)
        theta = 0.0
        for _ in range(intervals):
            highest = 0.0
            for _ in range(calls):
                if ops.analyze(steps, dt / self.steps):
                    raise RuntimeError("OpenSees found no equilibrium")
                before, theta = theta, ops.nodeDisp(2, 1)
                highest = max(highest, abs(theta))
                if holds and abs(theta) <= edge < abs(before):
                    v = abs(ops.nodeVel(2, 1))
                    ops.updateParameter(1, kernels.entry_damping(v, kind, q2, alpha, edge, zone, c, e))
                elif holds and abs(theta) > edge >= abs(before):
                    ops.updateParameter(1, 0.0)
            yield theta, highest

    @staticmethod
    def _build(ops: Any, problem: Problem, shaking: Array, dt: float) -> None:
        far = 10.0  # rad; beyond it the last stiffness continues
        knee = problem.zone * problem.edge
        last = knee - problem.q2 * (far - problem.edge)
        ops.wipe()
        ops.model("basic", "-ndm", 1, "-ndf", 1)
        ops.node(1, 0.0)
        ops.node(2, 0.0)
        ops.fix(1, 1)
        ops.mass(2, 1.0)
        strains = (-far, -problem.edge, 0.0, problem.edge, far)
        ops.uniaxialMaterial("ElasticMultiLinear", 1, "-strain", *strains, "-stress", -last, -knee, 0.0, knee, last)
        ops.uniaxialMaterial("Elastic", 2, 1e-12, problem.c)  # a dashpot; without stiffness it is refused
        ops.element("zeroLength", 1, 1, 2, "-mat", 1, "-dir", 1)
        ops.element("zeroLength", 2, 1, 2, "-mat", 2, "-dir", 1)
        ops.parameter(1, "element", 2, "material", 1, "eta")
        ops.timeSeries("Path", 1, "-dt", dt, "-values", *(problem.gain * shaking).tolist())
        ops.pattern("UniformExcitation", 1, 1, "-accel", 1)
        ops.constraints("Plain")
        ops.numberer("Plain")
        ops.system("ProfileSPD")
        ops.test("NormDispIncr", 1e-12, 50)
        ops.algorithm("Newton")
        ops.integrator("Newmark", 0.5, 0.25)
        ops.analysis("Transient")


PEERS: tuple[Rival, ...] = (
    *(OpenSees(steps) for steps in (1, 5)),
    SolveIvp("RK45", 1e-6, limited=False),
    SolveIvp("LSODA", 1e-6, limited=False),
    SolveIvp("DOP853", 1e-6, limited=False),
    SolveIvp("RK45", 1e-6, limited=True),
    SolveIvp("LSODA", 1e-6, limited=True),
    SolveIvp("DOP853", 1e-6, limited=True),
    SolveIvp("DOP853", 1e-10, limited=False),
    SolveIvp("DOP853", 1e-10, limited=True),
    *(NumbaLsoda(method, rtol) for method in ("lsoda", "dop853") for rtol in (1e-6, 1e-10)),
    *(Heyoka(tolerance) for tolerance in (1e-6, 1e-9, 1e-12, 1e-15)),
)
ALL: tuple[Rival, ...] = (*RIVALS, *PEERS)
"""All rivals; those of other packages come last."""
