"""Many free-standing blocks as columns: a region of a million has arrays of its sizes, and no object for each."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..core import checks
from ..core.elementary import Array, Flags, Index, arctan2
from ..core.units import STANDARD_GRAVITY
from .block import FACTOR, MIN_ANGLE, SIZE, UNIFORM_INERTIA_FACTOR, Block, describe_scene
from .laws import DELTA, RESTITUTION

OWN = {"e": RESTITUTION, "delta": DELTA}
"""Properties that blocks may have instead of the laws."""


class BlockArray:
    """Free-standing blocks on a rigid floor, as arrays.

    Parameters
    ----------
    width, height : array_like, shape (block,)
        Full outer sizes, m, > 0.
    cm_height : array_like, shape (block,), optional
        Heights of the centres of mass, m, between 0 and `height`; NaN or not given: mid-height.
    inertia_factor : array_like, shape (block,), optional
        lambda = I_O/(m R²), 1 < lambda <= 2; NaN or not given: 4/3, which needs a centre of mass at mid-height.
    names : sequence of str, shape (block,), optional
        Unique labels; by default ``block 1``, ``block 2``, …
    e, delta : array_like, shape (block,), optional
        Coefficients of restitution, 0 < e <= 1, and half widths of the elastic zones over alpha, 0 < delta < 1. Pooled
        curves take them instead of the damping laws' values.

    Notes
    -----
    Symbols alpha, R, p are as of `Block`, whose sizes and properties these are; `own` contains e and delta if they are
    given.

    Examples
    --------
    >>> blocks = BlockArray([0.4, 0.5], [1.8, 1.6])
    >>> len(blocks), blocks.p.round(4).tolist()
    (2, [2.8245, 2.9623])
    """

    def __init__(
        self,
        width: Any,
        height: Any,
        cm_height: Any = None,
        inertia_factor: Any = None,
        names: Sequence[str] | None = None,
        *,
        e: Any = None,
        delta: Any = None,
    ) -> None:
        self.width = _column("width", width)
        self.height = _column("height", height, self.width.size)
        n = self.width.size
        given = None if names is None else np.asarray(names, dtype=np.str_)
        for name, values in (("width", self.width), ("height", self.height)):
            self._check(SIZE.holds(values), given, f"{name} must be {SIZE.text}", values)
        middle = 0.5 * self.height
        centre = np.full(n, np.nan) if cm_height is None else _column("cm_height", cm_height, n, missing=True)
        self.cm_height = np.where(np.isnan(centre), middle, centre)
        inside = (self.cm_height > 0.0) & (self.cm_height < self.height)
        self._check(inside, given, "cm_height must be above 0 and below the height", self.cm_height)
        factor = (
            np.full(n, np.nan) if inertia_factor is None else _column("inertia_factor", inertia_factor, n, missing=True)
        )
        plain = np.isclose(self.cm_height, middle, rtol=1e-9, atol=0.0)
        text = "inertia_factor must be given where cm_height is not mid-height"
        self._check(plain | ~np.isnan(factor), given, text, self.cm_height)
        self.inertia = np.where(np.isnan(factor), UNIFORM_INERTIA_FACTOR, factor)
        self._check(FACTOR.holds(self.inertia), given, f"inertia_factor must be {FACTOR.text}", self.inertia)
        upright = (self.alpha >= MIN_ANGLE) & (self.alpha <= 0.5 * np.pi - MIN_ANGLE)
        self._check(upright, given, "the slenderness angle must be inside (0, pi/2)", self.alpha)
        self.own: dict[str, Array] = {
            name: _column(name, values, n) for name, values in (("e", e), ("delta", delta)) if values is not None
        }
        for name, values in self.own.items():
            self._check(OWN[name].holds(values), given, f"{name} must be {OWN[name].text}", values)
        self._names = given
        if given is not None:
            if given.shape != (n,):
                raise ValueError(f"names must be one for each of the {n:,} blocks, got {given.shape}")
            if np.unique(given).size < n:
                values, counts = np.unique(given, return_counts=True)
                raise ValueError(f"names must be unique, got {str(values[counts > 1][0])!r:.60} more than once")

    @classmethod
    def of(cls, blocks: "Block | Iterable[Block] | BlockArray") -> "BlockArray":
        """Return blocks as columns; TypeError for others, ValueError if a block is not free-standing."""
        if isinstance(blocks, BlockArray):
            return blocks
        if not isinstance(blocks, Block | Iterable) or getattr(blocks, "ndim", 1) == 0:
            raise TypeError(f"blocks must be Blocks or a BlockArray, got {checks.kind(blocks)}")
        listed = [blocks] if isinstance(blocks, Block) else list(blocks)
        for item in listed:
            if not isinstance(item, Block):
                raise TypeError(f"blocks must be Blocks or a BlockArray, got {checks.kind(item)}")
            if describe_scene(item) or item.edge is not None:
                raise ValueError(f"{item.label!r} does not stand free on a rigid floor: {', '.join(item.scene_words)}")
        return cls(
            [block.width for block in listed],
            [block.height for block in listed],
            [block.h for block in listed],
            [block.inertia for block in listed],
            [block.label for block in listed],
        )

    @staticmethod
    def _check(good: Flags, names: NDArray[np.str_] | None, text: str, values: Array) -> None:
        if good.all():
            return
        first = int(np.argmin(good))
        whose = f"block {first + 1}" if names is None or names.shape != good.shape else repr(str(names[first]))
        raise ValueError(f"{text}, got {values[first]:g} of {whose:.80}")

    def __len__(self) -> int:
        return int(self.width.size)

    def some(self, which: Index) -> list[Block]:
        """Return the blocks of these numbers (block,) as objects, which have no e and delta of their own."""
        columns = self.width, self.height, self.cm_height, self.inertia, self.names
        lists = (column[which].tolist() for column in columns)
        return [
            Block(width, height, centre, inertia, name)
            for width, height, centre, inertia, name in zip(*lists, strict=True)
        ]

    @property
    def names(self) -> NDArray[np.str_]:
        """Labels (block,)."""
        if self._names is None:
            return np.char.add("block ", np.arange(1, len(self) + 1).astype(np.str_))
        return self._names

    @property
    def alpha(self) -> Array:
        """Slenderness angles (block,), rad."""
        return arctan2(0.5 * self.width, self.cm_height)

    @property
    def R(self) -> Array:
        """Distances from centre of mass to corner (block,), m."""
        return np.hypot(0.5 * self.width, self.cm_height)

    @property
    def p(self) -> Array:
        """Frequency parameters sqrt(g/(lambda R)) (block,), rad/s."""
        return np.asarray(np.sqrt(STANDARD_GRAVITY / (self.inertia * self.R)))


def _column(name: str, values: Any, size: int | None = None, missing: bool = False) -> Array:
    """Return a column of finite numbers, or NaN if one may be missing."""
    column = np.atleast_1d(checks.numbers(name, values))
    if column.ndim != 1 or not column.size:
        raise ValueError(f"{name} must be a column of at least one block, got the shape {column.shape}")
    if size is not None and column.size != size:
        raise ValueError(f"{name} must have {size:,} entries, as width has, got {column.size:,}")
    bad = ~np.isfinite(column) & ~(np.isnan(column) & missing)
    if bad.any():
        first = int(np.argmax(bad))
        raise ValueError(f"{name} must be finite, got {column[first]} of block {first + 1}")
    return column
