"""Wrong overturned flags of the usual integrators in a usual study, and their effect on fragility curves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..core.aliases import Array, Flags
from ..core.units import STANDARD_GRAVITY
from ..fragility.fitting.fit import LognormalFit, fit_lognormal
from ..models import Block, DiscreteDamping, EnergyConsistent, GianniniMasiani, HousnerImpact, Law
from ..models.runs import OUTPUTS, run_many
from ..motions.arrays import Record
from .measure import Row, oscillators
from .problems import problem, typical
from .rivals.fixed_steps import Rival, located_runge_kutta, newmark, runge_kutta
from .speed import motions

FLAG_LAWS: tuple[Law, ...] = (
    DiscreteDamping(e=0.9),
    GianniniMasiani(e=0.9),
    EnergyConsistent(e=0.9),
    HousnerImpact(e=0.9, geometry="linear"),
    HousnerImpact(e=0.9),
)
USUAL: tuple[Rival, ...] = (
    runge_kutta(1),
    runge_kutta(5),
    newmark(1),
    newmark(5),
    located_runge_kutta(1),
)
SEED = 11
SMALLEST = 0.38  # m: R of the smallest block, to which the levels refer


def levels_of(block: Block, number: int = 40) -> Array:
    """Return peak accelerations, m/s², at which the block stands or overturns: they grow as sqrt(R)."""
    scale = STANDARD_GRAVITY * np.tan(block.alpha) * np.sqrt(block.R / SMALLEST)
    return np.asarray(scale * np.linspace(0.2, 2.6, number))


def flags(
    laws: Sequence[Law] = FLAG_LAWS,
    rivals: Sequence[Rival] = USUAL,
    blocks: Sequence[Block] | None = None,
    number: int = 10,
    levels: int = 40,
) -> list[Row]:
    """Count the flags of each rival under each law that differ from the engine's, and compare the fitted curves."""
    blocks = typical() if blocks is None else blocks
    shakes = motions(number, SEED)
    grid = np.array([levels_of(block, levels) for block in blocks])
    return [row for law in laws for row in _of_law(law, rivals, blocks, shakes, grid)]


def _of_law(law: Law, rivals: Sequence[Rival], blocks: Sequence[Block], shakes: list[Record], grid: Array) -> list[Row]:
    own = oscillators(law, blocks)
    factors = [grid / np.abs(one.acceleration).max() for one in shakes]
    right = np.stack(
        [
            run_many(own, scales, one.acceleration, one.dt, True, True)[..., OUTPUTS["overturned"]] > 0.0
            for scales, one in zip(factors, shakes, strict=True)
        ]
    )
    curves = _curves(right, grid)
    problems = [problem(block, law) for block in blocks]
    rows = []
    for rival in rivals:
        found = np.stack(
            [
                np.stack(
                    [
                        rival.run(one_problem, one.acceleration, one.dt, scales[b], 0).overturned
                        for b, one_problem in enumerate(problems)
                    ]
                )
                for scales, one in zip(factors, shakes, strict=True)
            ]
        )
        rows.append(
            {
                "law": law.label,
                "name": rival.name,
                "runs": int(right.size),
                "overturned": float(right.mean()),
                "wrong": int((found != right).sum()),
                "falsely_overturned": int((found & ~right).sum()),
                **_changes(curves, _curves(found, grid)),
            }
        )
    return rows


def _curves(overturned: Flags, grid: Array) -> list[LognormalFit]:
    """Return a curve for each block, from flags (motion, block, level)."""
    counts = overturned.sum(axis=0)
    runs = np.full(grid.shape[1], overturned.shape[0])
    return [fit_lognormal(levels, fell, runs) for levels, fell in zip(grid, counts, strict=True)]


def _changes(right: Sequence[LognormalFit], found: Sequence[LognormalFit]) -> Row:
    """Return relative changes of median and dispersion over the blocks with both curves (None without such blocks)."""
    pairs = [(a, b) for a, b in zip(right, found, strict=True) if np.isfinite([a.median, b.median]).all()]
    changes: Row = {"curves": len(pairs)}
    for name in ("median", "dispersion"):
        relative = np.array([getattr(b, name) / getattr(a, name) - 1.0 for a, b in pairs])
        changes[f"{name}_mean"] = float(relative.mean()) if pairs else None
        changes[f"{name}_largest"] = float(relative[np.argmax(np.abs(relative))]) if pairs else None
    return changes
