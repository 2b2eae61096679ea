"""Soft supports: the half width of a law's elastic zone from a settlement or from a measured frequency."""

import math
from dataclasses import replace

from ..core import checks
from ..core.parameters import Parameter
from .block import Block
from .scenes.bed import MOST_SETTLEMENT, SETTLEMENT

FREQUENCY = Parameter("Hz", above=0.0, at_most=1e6)
MOST_DELTA = 0.3
"""Largest delta: beyond it the block uplifts at rotations at which small angles are no longer small against alpha."""


def delta_from_settlement(block: Block, settlement: float) -> float:
    """Return delta of a block on two feet, which its weight presses down by a settlement.

    Parameters
    ----------
    block : Block
        A symmetric block.
    settlement : float
        Static settlement d0 = m g/(2 k) of two vertical feet of stiffness k at the lower edges, m, > 0.

    Raises
    ------
    ValueError
        A block that is not symmetric; a settlement of more than a tenth of the half width; a delta above 0.3.

    Notes
    -----
    A rigid block on two springs without tension uplifts at the rotation d0/b; from there on its moment falls like a
    rigid block's. It is the bilinear law with delta = d0/(b alpha) (derived). Its frequency is within about 4e-4 of the
    springs' frequency. A soft support is a material with damping of its own: take ``rest="elastic"`` and a measured e.

    Examples
    --------
    >>> round(delta_from_settlement(Block(0.4, 1.8), 0.5e-3), 6)
    0.011433
    """
    _check(block)
    depth = replace(SETTLEMENT, at_most=MOST_SETTLEMENT * block.b).number("settlement", settlement)
    return _checked(depth / (block.b * block.alpha), f"a settlement of {depth:g} m")


def delta_from_frequency(block: Block, frequency: float, body_frequency: float | None = None) -> float:
    """Return delta of a block that rocks on its support at a measured natural frequency before it uplifts.

    Parameters
    ----------
    block : Block
        A symmetric block.
    frequency : float
        Natural frequency of rocking on the support, Hz, > 0.
    body_frequency : float, optional
        Natural frequency of the body on a rigid base, Hz, > 0, if it is flexible too: 1/f² = 1/f_support² + 1/f_body².

    Raises
    ------
    ValueError
        A block that is not symmetric; a frequency so low that delta is above 0.3.

    Notes
    -----
    The zone has the stiffness (1/delta - 1) q² with q² = p² sin(alpha)/alpha, hence delta = 1/(1 + (2 pi f/p)²
    alpha/sin(alpha)) (derived). The flexibility of a body does not vanish once it uplifts, as the zone's does.

    Examples
    --------
    >>> round(delta_from_frequency(Block(0.4, 1.8), 6.0), 6)
    0.005538
    """
    _check(block)
    f = FREQUENCY.number("frequency", frequency)
    if body_frequency is not None:
        f = 1.0 / math.hypot(1.0 / f, 1.0 / FREQUENCY.number("body_frequency", body_frequency))
    stiffness = (2.0 * math.pi * f / block.p) ** 2 * block.alpha / math.sin(block.alpha)
    return _checked(1.0 / (1.0 + stiffness), f"a frequency of {f:.3g} Hz")


def _check(block: Block) -> None:
    if not isinstance(block, Block):
        raise TypeError(f"block must be a toppling Block, got {checks.kind(block)}")
    if not block.symmetric:
        raise ValueError(f"{block.label!r} is not symmetric: its support gives no single delta")


def _checked(delta: float, given: str) -> float:
    if delta > MOST_DELTA:
        raise ValueError(f"{given} means delta = {delta:.3g}, above {MOST_DELTA:g}: too soft for an elastic zone")
    return delta
