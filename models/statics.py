"""Static checks of anchors by hand: the force that holds a block, the acceleration it resists, half of its weight."""

import math
from typing import Any

from ..core import checks
from ..core.doubts import Doubt, by_study, warn
from ..core.units import STANDARD_GRAVITY
from .block import Block

IN_G = 1.0
"""Acceleration, m/s², up to which one that would tip the block in g may be in g."""


def required_force(block: Block, acceleration: float, height: float) -> float:
    """Return the horizontal force at a height that keeps a block from tipping to the front, N.

    Parameters
    ----------
    block : Block
        A block with its mass.
    acceleration : float
        Peak acceleration of its floor, m s-2, >= 0. One that would only tip the block if it were in g causes a warning.
    height : float
        Height of the anchor above the floor, m, > 0, at most the block's.

    Returns
    -------
    float
        N; 0 if the block does not uplift.

    Notes
    -----
    Moments about the front lower edge, with the acceleration as a static load (derived): F = m (a h - g b)/z. With the
    mass off the middle b is its distance to the front edge, and with a lean b and h are of the leaning block. A
    strength above F only means that the anchor carries this load; a moving block strikes a slack anchor.

    Examples
    --------
    >>> round(required_force(Block(0.3, 1.8, mass=100.0), 9.80665, 1.8), 1)
    408.6
    """
    _check(block)
    shaking = checks.number("acceleration", acceleration, at_least=0.0, unit="m/s²")
    z = checks.number("height", height, above=0.0, at_most=block.height, unit="m")
    b, h = _levers(block)
    slight = 0.0 < shaking <= IN_G and shaking * h <= STANDARD_GRAVITY * b < STANDARD_GRAVITY * shaking * h
    if slight and not by_study():
        warn([Doubt.of("still_force", shaking=shaking)])
    return max(0.0, _mass(block) * (shaking * h - STANDARD_GRAVITY * b) / z)


def static_capacity(block: Block) -> float:
    """Return the static acceleration at which a block tips to the front, its restraint at its strength, m s-2.

    Notes
    -----
    a_u = g tan(alpha) (1 + F d/(m g b)) with the strength F of all restraints and their moment arm d about the front
    lower edge (derived). Without a restraint, or with one that acts to the back only, it is g tan(alpha), where uplift
    begins. It assumes a rigid restraint: one with slack is struck, and an elastic one deforms, before it is reached.

    Examples
    --------
    >>> from .scenes.restraint import Restraint
    >>> round(static_capacity(Block(0.3, 1.8, mass=100.0, restraint=Restraint.strap(1.75))), 3)
    6.826
    """
    _check(block)
    b, h = _levers(block)
    bare = STANDARD_GRAVITY * b / h
    held = block.restraint
    if held is None or held.front is None:
        return bare
    return bare + held.count * held.strength * held.front / (_mass(block) * h)


def half_weight(block: Block) -> float:
    """Return half of the weight of a block, N, which must have a mass: a rule of thumb for its anchor.

    Notes
    -----
    "At least half of the weight" is a rule of Japanese guides to L-brackets.  It is `required_force` for 1 g and an
    anchor at the top, z = 2 h, which is (m g/2)(1 - b/h), rounded up (derived).

    References
    ----------
    Page on L-brackets, 184.tea-nifty.com (read).

    Examples
    --------
    >>> round(half_weight(Block(0.3, 1.8, mass=100.0)), 1)
    490.3
    """
    _check(block)
    return 0.5 * _mass(block) * STANDARD_GRAVITY


def _check(block: Any) -> None:
    if not isinstance(block, Block):
        raise TypeError(f"block must be a Block, got {checks.kind(block)}")


def _levers(block: Block) -> tuple[float, float]:
    """Return the horizontal and vertical distances of the mass from the front lower edge, including a lean, m."""
    (half, angle), _ = block.corners
    if block.symmetric:
        return block.b, block.h
    size = math.hypot(half, block.h)
    return size * math.sin(angle), size * math.cos(angle)


def _mass(block: Block) -> float:
    if block.mass is None:
        raise ValueError(f"the force on an anchor needs the mass of the block (kg), {block.label!r} has none")
    return block.mass
