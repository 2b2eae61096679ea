"""The largest force of a restraint in a run, from the peaks of the rotation or from the motion of a block at rest."""

import math
from typing import Any, NamedTuple

import numpy as np

from .block import Block
from .oscillator import Oscillator


class HeldBy(NamedTuple):
    """A block's restraint in numbers: the force of one of its parts under rotations, or at rest; NaN without any.

    They are floats, or arrays for many blocks.

    `front`, `back`: moment arms (m), 0 on a side where it does not act. `stiffness` (N/m), `slack` (m) and `preload`
    (N): 0 for a rigid one. A rigid one has `front_pull` and `back_pull`, N per m/s² of acceleration that pushes to that
    side. Its `front_hold` and `back_hold` (N) are the part that gravity carries. `strength` (N). `broken`: the maximum
    force if it broke, which is its strength. It is NaN for a rigid one that acts on one side only: a lift to the other
    side releases it below its strength.
    """

    front: Any = 0.0
    back: Any = 0.0
    stiffness: Any = 0.0
    slack: Any = 0.0
    preload: Any = 0.0
    front_pull: Any = 0.0
    back_pull: Any = 0.0
    front_hold: Any = 0.0
    back_hold: Any = 0.0
    strength: Any = 0.0
    broken: Any = 0.0


NONE = HeldBy._make([math.nan] * 11)


def held_by(block: Block, oscillator: Oscillator) -> HeldBy:
    """Return the restraint of a block; the geometry of a law is its oscillator's."""
    restraint = block.restraint
    if restraint is None:
        return NONE
    front, back = restraint.front or 0.0, restraint.back or 0.0
    if not restraint.rigid:
        elastic = restraint.stiffness, restraint.slack, restraint.preload
        return HeldBy(front, back, *elastic, strength=restraint.strength, broken=restraint.strength)
    assert block.mass is not None  # (checked by the block)
    rest = oscillator.rests[0]
    pulls, holds = [0.0, 0.0], [0.0, 0.0]
    ways = ((front, rest.up_target), (back, rest.down_target))
    for k, ((half, _), (arm, target)) in enumerate(zip(block.corners, ways, strict=True)):
        if arm == 0.0 or (k == 1 and block.wall is not None and block.wall.gap == 0.0):
            continue  # (it does not act there, or the wall behind the block takes the push)
        beyond = oscillator.regions[target]
        # the moment about the corner is inertia (gain F - q² alpha), with both of the region without the restraint
        inertia = block.mass * (block.gyration**2 + block.h**2 + half**2)
        per_part = inertia / (restraint.count * arm)
        pulls[k], holds[k] = per_part * oscillator.gain * beyond.gain, per_part * abs(beyond.offset)
    broken = restraint.strength if front > 0.0 and back > 0.0 else math.nan
    rigid = {"front_pull": pulls[0], "back_pull": pulls[1], "front_hold": holds[0], "back_hold": holds[1]}
    return HeldBy(**rigid, strength=restraint.strength, broken=broken)


def largest_force(held: HeldBy, front: Any, back: Any, ruptured: Any, to_front: Any, to_back: Any) -> Any:
    """Return the largest force of each part of a restraint (N), NaN for a block without one.

    `held` is of the block, or its numbers as arrays that broadcast with the runs. `front` and `back` are peak
    rotations, rad; `ruptured` marks runs in which it broke. `to_front` and `to_back` are the maximum accelerations of
    the floor to the back, which pushes the block to its front, and to the front, m/s². An intact elastic restraint has
    the force preload + stiffness max(0, arm theta - slack). It is largest at the peak rotation of the side on which it
    acts more. A rigid one keeps the block at rest: moments about the corner give m (h F - g b)/arm under the
    acceleration F. In linear geometry they give m R (F - g alpha)/arm.
    """
    stretch = np.maximum(np.maximum(held.front * front, held.back * back) - held.slack, 0.0)
    at_rest = np.maximum(
        np.maximum(held.front_pull * to_front - held.front_hold, held.back_pull * to_back - held.back_hold), 0.0
    )
    force = held.preload + held.stiffness * stretch + at_rest
    return np.where(ruptured, held.broken, np.minimum(force, held.strength))
