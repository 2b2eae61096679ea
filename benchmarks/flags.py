"""Wrong overturned flags of the usual integrators in a usual study, and their effect on fragility curves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from ..core.aliases import Array, Flags
from ..core.units import STANDARD_GRAVITY
from ..fragility.fitting.fit import fit_fragility
from ..models import Block, DiscreteDamping, EnergyConsistent, GianniniMasiani, HousnerImpact, Law
from ..models.outputs import OF_ENGINE
from ..models.runs import run_many
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
USUAL: tuple[Rival, ...] = (runge_kutta(1), runge_kutta(5), newmark(1), newmark(5), located_runge_kutta(1))
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
    stacked = oscillators(law, blocks)
    runs = [(shake, grid / np.abs(shake.acceleration).max()) for shake in shakes]
    engine = [run_many(stacked, factors, shake.acceleration, shake.dt, True, True) for shake, factors in runs]
    right = np.stack(engine)[..., OF_ENGINE["overturned"]] > 0.0
    curves = _curves(right, grid)
    problems = [problem(block, law) for block in blocks]
    rows = []
    for rival in rivals:
        answers = [
            [
                rival.run(of, shake.acceleration, shake.dt, scales, 0).overturned
                for of, scales in zip(problems, factors, strict=True)
            ]
            for shake, factors in runs
        ]
        answered = np.array(answers)
        rows.append(
            {
                "law": law.label,
                "name": rival.name,
                "runs": int(right.size),
                "overturned": float(right.mean()),
                "wrong": int((answered != right).sum()),
                "falsely_overturned": int((answered & ~right).sum()),
                **_changes(curves, _curves(answered, grid)),
            }
        )
    return rows


def _curves(overturned: Flags, grid: Array) -> Array:
    """Return medians and dispersions (block, 2), NaN without a curve, from flags (motion, block, level)."""
    fitted = []
    for levels, fell in zip(grid, overturned.sum(axis=0), strict=True):
        counts = {"overturnings": ("level", fell), "runs": ("level", np.full(levels.size, overturned.shape[0]))}
        fit = fit_fragility(xr.Dataset(counts, {"level": levels}), intervals="wald", penalty="none")
        fitted.append([fit["median"].item(), fit["dispersion"].item()])
    return np.array(fitted)


def _changes(right: Array, rival: Array) -> Row:
    """Return relative changes of median and dispersion over the blocks with both curves (None without such blocks)."""
    known = np.isfinite(right[:, 0]) & np.isfinite(rival[:, 0])
    changes: Row = {}
    for i, name in enumerate(("median", "dispersion")):
        relative = rival[known, i] / right[known, i] - 1.0
        changes[f"{name}_mean"] = float(relative.mean()) if known.any() else None
        changes[f"{name}_largest"] = float(relative[np.argmax(np.abs(relative))]) if known.any() else None
    return changes
