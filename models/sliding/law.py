"""The law of a block that slides on its floor, and never rocks."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from ... import checks
from ..block import Block
from ..laws import Model

MOST_FRICTION = 10.0
"""Largest coefficient of friction: beyond any contact's; blocks of it do not slide."""
LEAST_FRICTION = 1e-9
"""Smallest coefficient of friction: the block stays where it is while the floor moves."""


def check_free(block: Block) -> None:
    """Raise ValueError for a block that may rock one way and slide the other, or is held."""
    for name, has in (
        ("a wall", block.wall is not None),
        ("a restraint", block.restraint is not None),
        ("an offset or a lean", not block.symmetric),
        ("a soft bed", block.bed is not None),
    ):
        if has:
            raise ValueError(f"Sliding is for free blocks that are alike at front and back: {block.label!r} has {name}")


class Slider(NamedTuple):
    """A sliding block in numbers: coefficients of friction, static and kinetic, towards the front and the back.

    An infinite static one lets the block slide one way only, as Newmark's does.  `obstacle`: the slip to either side at
    which the block meets one, m.
    """

    static_front: float
    static_back: float
    kinetic_front: float
    kinetic_back: float
    obstacle: float = math.inf

    @property
    def exact(self) -> bool:
        """False: sliding has no geometry."""
        return False


class PlaneSlider(NamedTuple):
    """A block that slides in the plane of the floor, in numbers: its coefficients of friction, alike to all sides."""

    static: float
    kinetic: float

    @property
    def exact(self) -> bool:
        """True: its runs take the exact way through all samples (plans have a figure of their own for it)."""
        return True


@dataclass(frozen=True)
class Sliding(Model):
    """Block that slides on its floor with Coulomb friction, solved exactly between the samples of a motion.

    Parameters
    ----------
    static : float
        Static coefficient of friction, 1e-9 to 10: the block moves with the floor up to the acceleration static x g.
    kinetic : float, optional
        Coefficient of friction while the block slides, at most `static`; equal to it if not given.

    Notes
    -----
    While the block slides with the velocity v relative to the floor, v' = -u'' - sign(v) kinetic (g + w''), with the
    accelerations u'' and w'' of the floor; it stays where it stops unless abs(u'') > static (g + w'').  Positive slips
    are to the front.  Neither its size nor its mass matters.  A block with static >= b/h uplifts before it slides: the
    output ``mode`` tells which runs these are.

    References
    ----------
    Newmark, N. M. (1965). Effects of earthquakes on dams and embankments. Géotechnique 15(2), 139-160.
    Shenton, H. W. (1996). Criteria for initiation of slide, rock, and slide-rock rigid-body modes. Journal of
    Engineering Mechanics 122(7), 690-693.

    Examples
    --------
    >>> import toppling as tp
    >>> block, law = tp.Block(0.6, 1.0), tp.Sliding(0.3)
    >>> push = tp.motions.from_array([-6.0] * 51, dt=0.01)  # a pulse of 6 m/s² for 0.5 s
    >>> round(float(tp.simulate(block, law, push).slide_peak), 4)
    0.7796
    """

    law: ClassVar[str] = "sliding"
    static: float
    kinetic: float | None = None

    def __post_init__(self) -> None:
        static = checks.number("static", self.static, at_least=LEAST_FRICTION, at_most=MOST_FRICTION)
        if self.kinetic is not None:
            checks.number("kinetic", self.kinetic, at_least=LEAST_FRICTION, at_most=static)

    def slider(self, block: Block) -> Slider:
        """Return the numbers of a block under this law; ValueError for one that is held, or differs front and back."""
        check_free(block)
        kinetic = self.static if self.kinetic is None else self.kinetic
        return Slider(self.static, self.static, kinetic, kinetic)

    def in_plane(self, block: Block) -> PlaneSlider:
        """Return the numbers of a block that both horizontal components shake; ValueError as of `slider`."""
        found = self.slider(block)
        return PlaneSlider(found.static_front, found.kinetic_front)

    @property
    def label(self) -> str:
        """Short name and coefficients, as ``sliding μ=0.3``."""
        if self.kinetic is None or self.kinetic == self.static:
            return f"{self.law} μ={self.static:g}"
        return f"{self.law} μ={self.static:g} μ_k={self.kinetic:g}"
