"""The laws of a block that slides on its floor, and never rocks: with a known friction, and with a random one."""

import math
from abc import abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from ...core import checks
from ...core.aliases import Array
from ...core.parameters import PART
from ..block import Block
from ..friction import MOST_FRICTION, Friction
from ..laws import Model

LEAST_FRICTION = 1e-9
"""Smallest coefficient of friction: the block keeps its place while the floor moves."""


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


class SlidingLaw(Model):
    """Law of a block that slides, and never rocks."""

    law: ClassVar[str] = "sliding"

    @abstractmethod
    def slider(self, block: Block) -> Slider:
        """Return the numbers of a block under this law; ValueError for one that is held, or differs front and back."""

    def in_plane(self, block: Block) -> PlaneSlider:
        """Return the numbers of a block under both horizontal components; ValueError as of `slider`."""
        slider = self.slider(block)
        return PlaneSlider(slider.static_front, slider.kinetic_front)

    @abstractmethod
    def coefficients(self, block: Block, share: Array) -> Array:
        """Return the static coefficients at shares, between 0 and 1, of those with which a block slides.

        In the shape of `share`; ValueError for a block that is held, differs front and back, or slides with none.
        """


@dataclass(frozen=True)
class Sliding(SlidingLaw):
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
    accelerations u'' and w'' of the floor. It stays at its stop unless abs(u'') > static (g + w''). Positive slips are
    to the front. Its size and its mass do not matter. A block with static >= b/h uplifts before it slides: the output
    ``mode`` marks these runs.

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

    static: float
    kinetic: float | None = None

    def __post_init__(self) -> None:
        static = checks.number("static", self.static, at_least=LEAST_FRICTION, at_most=MOST_FRICTION)
        if self.kinetic is not None:
            checks.number("kinetic", self.kinetic, at_least=LEAST_FRICTION, at_most=static)

    def slider(self, block: Block) -> Slider:
        check_free(block)
        kinetic = self.static if self.kinetic is None else self.kinetic
        return Slider(self.static, self.static, kinetic, kinetic)

    def coefficients(self, block: Block, share: Array) -> Array:
        check_free(block)
        return np.full(np.shape(share), self.static)

    @property
    def label(self) -> str:
        """Short name and coefficients, as ``sliding μ=0.3``."""
        if self.kinetic is None or self.kinetic == self.static:
            return f"{self.law} μ={self.static:g}"
        return f"{self.law} μ={self.static:g} μ_k={self.kinetic:g}"


@dataclass(frozen=True)
class RandomSliding(SlidingLaw):
    """Block that slides on its floor with a coefficient of Coulomb friction drawn for every run.

    It is for `toppling.adaptive_ida`.  At common levels `toppling.fragility.slide_runs` runs every motion
    with the quantiles of the friction.

    Parameters
    ----------
    friction : Friction
        Static coefficient of friction (`toppling.models.friction`). Runs have coefficients below b/h of their block,
        with which it slides and does not rock. The probability of a slip is the curve's times the probability of such a
        coefficient, ``friction.below(b/h)``.
    kinetic_ratio : float
        Kinetic over static friction, above 0, at most 1.

    Notes
    -----
    Without a vertical component, compare a block with friction mu under s times a motion and one with friction 1 under
    s/mu times the motion. With the same ratio of the coefficients, the first slips mu times as far, in one direction
    and in the plane. The velocity over mu obeys the equation of the second (derived).

    Examples
    --------
    >>> from toppling.models.friction import LognormalFriction
    >>> RandomSliding(LognormalFriction(0.35, 0.3), 0.85).label
    'sliding μ lognormal(median=0.35, dispersion=0.3) μ_k/μ=0.85'
    """

    friction: Friction
    kinetic_ratio: float = 1.0

    def __post_init__(self) -> None:
        if not isinstance(self.friction, Friction):
            raise TypeError(
                f"friction must be a Friction such as LognormalFriction (of a number: Sliding), got "
                f"{checks.kind(self.friction)}"
            )
        PART.number("kinetic_ratio", self.kinetic_ratio)

    def slider(self, block: Block) -> Slider:
        """Raise ValueError: the coefficient is one of a run."""
        raise ValueError(
            f"RandomSliding is for adaptive_ida, got {block.label!r} in another analysis: take Sliding with "
            "a number, or fragility.slide_runs"
        )

    def chance(self, block: Block) -> float:
        """Return the chance of a coefficient below b/h, with which the block slides."""
        return float(self.friction.below(block.b / block.h))

    def coefficients(self, block: Block, share: Array) -> Array:
        check_free(block)
        chance = self.chance(block)
        if not chance > 0.0:
            raise ValueError(f"{self.label}: {block.label!r} rocks with every coefficient and never slides")
        return np.clip(self.friction.quantile(np.asarray(share) * chance), LEAST_FRICTION, MOST_FRICTION)

    @property
    def of_unit(self) -> Slider:
        """The numbers of a block with the friction 1."""
        return Slider(1.0, 1.0, self.kinetic_ratio, self.kinetic_ratio)

    @property
    def of_unit_in_plane(self) -> PlaneSlider:
        """The same under both horizontal components."""
        return PlaneSlider(1.0, self.kinetic_ratio)

    @property
    def options(self) -> dict[str, Any]:
        return {"friction": self.friction.description, "kinetic_ratio": self.kinetic_ratio}

    @property
    def label(self) -> str:
        """Short name and friction, as ``sliding μ lognormal(median=0.35, dispersion=0.3)``."""
        described = self.friction.description
        name = described.pop("distribution")
        of = f"{self.law} μ {name}({', '.join(f'{key}={value:g}' for key, value in described.items())})"
        return of if self.kinetic_ratio == 1.0 else f"{of} μ_k/μ={self.kinetic_ratio:g}"
