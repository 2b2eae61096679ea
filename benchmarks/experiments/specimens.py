"""Specimens of a test as blocks: stated sizes, or those of catalogue items; walls and fixings as the package has them.

Fixings have the values of docs/walls.md, which are assumed where no source was found.
"""

from __future__ import annotations

import math

from ...models import Block, HousnerImpact, Restraint, Wall, catalogue
from ...models.friction import contact_named
from .table import POLE, WALL, WEDGE, WEDGE_AND_POLE, Experiment, Measured

WALL_GAP = 0.02
"""Clear distance to a wall, m: that of the catalogue (a skirting board; judgement)."""
LEAN = -math.radians(1.0)
"""Lean of a piece on a wedge, rad."""
POLE_FORCE, POLE_STRENGTH, POLE_STIFFNESS, POLE_EDGE = 200.0, 2000.0, 50e3, 0.05
"""A pole: its force and strength, N, its stiffness, N/m, and its distance from the rear edge, m; two of them stand
side by side."""


def law_of(experiment: Experiment, measured: Measured | None = None) -> HousnerImpact:
    """Return Housner's impact in exact geometry, linear where a pole needs it; with e_R unless e was measured."""
    geometry = "linear" if experiment.fixing in (POLE, WEDGE_AND_POLE) else "exact"
    return HousnerImpact(e=None if measured is None else measured.restitution, geometry=geometry)


def blocks_of(experiment: Experiment, measured: Measured | None = None) -> list[Block]:
    """Return the blocks of a test's specimens, all of equal share; uniform where no mass centre was measured."""
    if experiment.width and experiment.height:
        masses = experiment.mass or (None,) * len(experiment.width)
        sizes = list(zip(experiment.width, experiment.height, masses, strict=True))
    else:
        sizes = [(catalogue[name].width, catalogue[name].height, None) for name in experiment.catalogue]
    wall = Wall(WALL_GAP) if experiment.placement == WALL else None
    lean = LEAN if experiment.fixing in (WEDGE, WEDGE_AND_POLE) else 0.0
    blocks = []
    for i, (width, height, mass) in enumerate(sizes, 1):
        held = None
        if experiment.fixing in (POLE, WEDGE_AND_POLE):
            held = Restraint.pole(POLE_FORCE, POLE_STRENGTH, POLE_STIFFNESS, width - POLE_EDGE, POLE_EDGE, count=2)
        name = f"{experiment.id}, specimen {i}"
        centre, inertia = (None, None) if measured is None else (measured.cm_height, measured.inertia_factor)
        blocks.append(Block(width, height, centre, inertia, name, mass=mass, lean=lean, wall=wall, restraint=held))
    return blocks


def not_sliding(experiment: Experiment, block: Block, measured: Measured | None = None) -> float:
    """Return the probability that a block's friction is at least b/h, so that it can uplift: 1 without a contact.

    With a friction that was measured it is 0 or 1.  From rest the smaller of the static friction and b/h decides, and a
    sliding block never uplifts (Shenton 1996).
    """
    if measured is not None and measured.friction is not None:
        return float(measured.friction >= block.b / block.h)
    if not experiment.contact:
        return 1.0
    return 1.0 - float(contact_named(experiment.contact).friction.below(block.b / block.h))
