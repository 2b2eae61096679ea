"""First mode of a block on its floor, along one axis or in the plane of the floor: rest, sliding or rocking."""

import enum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...core.aliases import Array
from ...core.units import STANDARD_GRAVITY
from ..block import Block


class Mode(enum.IntEnum):
    """First mode of a block: rest, sliding or rocking; AIRBORNE if the vertical acceleration takes its weight."""

    RESTS = 0
    SLIDES = 1
    ROCKS = 2
    AIRBORNE = -1


def demand(acceleration: Array, vertical: Array | None, factors: Array) -> Array:
    """Return the maximum of abs(u'')/(g + w'') under each factor: the friction that keeps a block in place.

    The largest value lies at a sample, since the ratio of two straight lines is monotonic. Infinite if g + w'' is not
    above zero.
    """
    if vertical is None:
        return np.asarray(factors * np.abs(acceleration).max() / STANDARD_GRAVITY)
    needed = np.empty(factors.size)
    for i, factor in enumerate(factors.ravel().tolist()):
        weight = STANDARD_GRAVITY + factor * vertical
        needed[i] = np.max(factor * np.abs(acceleration) / weight) if weight.min() > 0.0 else np.inf
    return needed.reshape(factors.shape)


def mode_of(block: Block, static: ArrayLike, demanded: ArrayLike) -> NDArray[np.int8]:
    """Return the `Mode` of a free block with static friction under a demand (see `demand`); the two broadcast.

    Up to the smaller of static friction and b/h the block rests. Above it, it slides if static < b/h, and never
    uplifts, or it uplifts and rocks (Shenton 1996, as in `friction_at_uplift`).
    """
    needed, available = np.asarray(demanded, dtype=float), np.asarray(static, dtype=float)
    level = block.b / block.h
    moves = np.where(available < level, Mode.SLIDES, Mode.ROCKS)
    mode = np.where(needed > np.minimum(available, level), moves, Mode.RESTS)
    return np.where(np.isinf(needed), Mode.AIRBORNE, mode).astype(np.int8)


def demand_in_plane(
    along: Array, across: Array, vertical: Array | None, factors: Array, level: float = np.inf
) -> Array:
    """Return the friction that keeps a block in place if both horizontal components act on it, under each factor.

    Components (n,) along the width and along the depth, and the vertical one or None, are in m/s². `level` is b/h along
    the width: a block that uplifts there transmits no more than b/h of its weight in that direction. With G = g + w'',
    the friction is the maximum at the samples of sqrt(min(abs(x'')/G, b/h)² + (y''/G)²). It is infinite if G is not
    above zero.
    """
    needed = np.empty(factors.size)
    for i, factor in enumerate(factors.ravel().tolist()):
        weight = STANDARD_GRAVITY if vertical is None else STANDARD_GRAVITY + factor * vertical
        if np.min(weight) > 0.0:
            needed[i] = np.hypot(np.minimum(np.abs(factor * along) / weight, level), factor * across / weight).max()
        else:
            needed[i] = np.inf
    return needed.reshape(factors.shape)


def mode_in_plane(block: Block, static: ArrayLike, along: ArrayLike, across: ArrayLike, plane: ArrayLike) -> Any:
    """Return the `Mode` of a free block with a depth if both horizontal components act on it; arrays broadcast.

    `along` and `across` are its `demand` along the width and the depth, `plane` its `demand_in_plane` with the `level`
    b/h along the width. With static friction below b/h along the depth the block slides if `plane` exceeds it. From b/h
    along the width on it may rock about the width in such a run, too. A block that does not slide rocks if it uplifts
    along the width. With friction from b/h along the depth on, it rocks if it uplifts along the depth, too.
    """
    assert block.depth is not None
    available, weightless = np.asarray(static, dtype=float), np.isinf(np.asarray(plane))
    width, depth = block.b / block.h, 0.5 * block.depth / block.h
    slides = (available < depth) & (np.asarray(plane) > available)
    rocks = ((np.asarray(along) > width) & (available >= width)) | ((np.asarray(across) > depth) & (available >= depth))
    mode = np.where(slides, Mode.SLIDES, np.where(rocks, Mode.ROCKS, Mode.RESTS))
    return np.where(weightless, Mode.AIRBORNE, mode).astype(np.int8)
