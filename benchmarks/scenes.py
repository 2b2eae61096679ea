"""Cost of a run in a scene (walls, restraints, a mass off the middle) over that of the same block alone."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from ..core.aliases import Array
from ..core.units import STANDARD_GRAVITY
from ..models import Block, EnergyConsistent, HousnerImpact, Law, Restraint, Wall
from ..models.runs import run_many
from .measure import Row, oscillators, seconds
from .problems import CASES, DT, record

CASE = "B"
TARGET = 1.5
"""Largest cost of a run with a wall or a strap over a run of the free block."""
SCENE_LAWS: tuple[Law, ...] = (
    HousnerImpact(e=0.9, geometry="linear"),
    HousnerImpact(e=0.9),
    EnergyConsistent(e=0.9, delta=0.01),
)
"""Two without a zone, and one whose zone ends before every wall of `SCENES`."""
FREE = "free"
DENSITY = 400.0
"""Mass over width, depth of 0.4 m and height of the strapped blocks, kg/m³: furniture and what it holds."""


def _strapped(block: Block, slack: float = 0.0, wall: Wall | None = None) -> Block:
    """The block with a strap at nine tenths of its height, 20 kN/m, that breaks at half the block's weight."""
    mass = DENSITY * 0.4 * block.width * block.height
    strap = Restraint.strap(0.9 * block.height, strength=0.5 * STANDARD_GRAVITY * mass, stiffness=2e4, slack=slack)
    return replace(block, mass=mass, restraint=strap, wall=wall)


SCENES: dict[str, Callable[[Block], Block]] = {
    FREE: lambda block: block,
    "wall, touching": lambda block: replace(block, wall=Wall()),
    "wall, gap of 20 mm": lambda block: replace(block, wall=Wall(gap=0.02)),
    "strap": _strapped,
    "strap with 5 mm of slack, wall touching": partial(_strapped, slack=0.005, wall=Wall()),
    "mass off the middle": lambda block: replace(block, cm_offset=0.05 * block.width),
}
"""Scenes by their names in the tables; the mass is off by a tenth of the half-width."""


def scenes(
    laws: Sequence[Law] = SCENE_LAWS, case: tuple[Sequence[Block], Array] = CASES[CASE], repeats: int = 7
) -> list[Row]:
    """Measure the cost of a run of each scene, µs, and over that of the free block, without skipping.

    Scenes that a law refuses (restraints in exact geometry, slack that ends inside a zone) are left out.
    """
    blocks, factors = case
    grid = np.tile(factors, (len(blocks), 1))
    shaking = record()
    rows = []
    for law in laws:
        tasks: Mapping[str, Callable[[], object]] = {
            name: partial(run_many, oscillators(law, placed), grid, shaking, DT, skip=False)
            for name, placed in ((name, [scene(block) for block in blocks]) for name, scene in SCENES.items())
            if _allowed(law, placed)
        }
        taken = dict(zip(tasks, seconds(list(tasks.values()), repeats), strict=True))
        rows += [
            {"law": law.label, "scene": name, "cost": 1e6 * cost / grid.size, "ratio": cost / taken[FREE]}
            for name, cost in taken.items()
        ]
    return rows


def _allowed(law: Law, blocks: Sequence[Block]) -> bool:
    try:
        oscillators(law, blocks)
    except ValueError:
        return False
    return True
