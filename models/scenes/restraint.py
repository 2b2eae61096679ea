"""Restraints that hold a block until they break: straps, brackets, cables, poles, tendons and adhesives."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from ...core import checks
from ...core.wording import with_article

KINDS = ("strap", "bracket", "cable", "pole", "tendon", "adhesive")
TEST_STRENGTH = 267.0
"""Force that an anti-tip kit must hold in the test of ASTM F3096-23, N (60 lbf): a lower bound, and no median."""


@dataclass(frozen=True, slots=True)
class Restraint:
    """Restraint of a block, elastic up to its strength and broken for good beyond; made by its class methods.

    Parameters
    ----------
    kind : str
        One of strap, bracket, cable, pole, tendon, adhesive.
    strength : float
        Force at which one of them breaks, N, > 0; infinity: never.
    stiffness : float
        Force over elongation of one of them, N/m, > 0; infinity for an adhesive.
    front, back : float or None
        Moment arm about the front and the rear lower corner, m: the elongation is the arm times the rotation towards
        that side; None: it does not act on that side.  The class methods set them: an adhesive acts on both sides.
    slack : float
        Elongation before it is taut, m, >= 0.
    preload : float
        Force of one of them at rest, N, >= 0, below the strength.
    count : int
        How many of them act side by side, with equal slack, >= 1.
    height : float, optional
        Where a cable is fixed to the block, m, at most the block's height: the arm of a sloping one is less.

    Notes
    -----
    The force is T = preload + stiffness max(0, arm theta - slack), and the restraint breaks for good where T reaches
    the strength, on both sides at once.  Blocks that have one need their `mass`.
    """

    kind: str
    strength: float
    stiffness: float
    front: float | None = None
    back: float | None = None
    slack: float = 0.0
    preload: float = 0.0
    count: int = 1
    height: float | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        checks.choice("kind", self.kind, KINDS)
        for name in ("strength", "stiffness"):
            if getattr(self, name) != math.inf:
                checks.number(name, getattr(self, name), above=0.0, unit="N" if name == "strength" else "N/m")
        for name in ("front", "back"):
            if getattr(self, name) is not None:
                checks.number(name, getattr(self, name), above=0.0, unit="m")
        checks.number("slack", self.slack, at_least=0.0, unit="m")
        checks.number("preload", self.preload, at_least=0.0, unit="N")
        checks.count("count", self.count, at_least=1)
        if self.preload >= self.strength:
            raise ValueError(f"preload must be below the strength of {self.strength:g} N, got {self.preload:g}")
        if self.slack > 0.0 and self.preload > 0.0:
            raise ValueError(f"a preload needs slack 0: a slack restraint has no force, got slack {self.slack:g} m")
        if self.stiffness == math.inf and (self.slack > 0.0 or self.preload > 0.0):
            raise ValueError("a rigid restraint (stiffness inf) has neither slack nor preload: give its stiffness")
        if self.stiffness == math.inf and self.kind in ("strap", "cable"):
            raise ValueError(
                f"{with_article(self.kind)} must have a finite stiffness: a rigid one would break whenever it jerks"
            )

    @classmethod
    def strap(
        cls,
        height: float,
        strength: float = TEST_STRENGTH,
        stiffness: float = 20e3,
        slack: float = 0.0,
        preload: float = 0.0,
        count: int = 1,
    ) -> Restraint:
        """Return a horizontal strap to the wall at a height (m), which acts on rotations to the front only.

        The stiffness of 20 kN/m is a judgement: no source was found.
        """
        return cls("strap", strength, stiffness, height, None, slack, preload, count)

    @classmethod
    def bracket(
        cls, height: float, strength: float, stiffness: float = 500e3, slack: float = 0.0, count: int = 1
    ) -> Restraint:
        """Return an angle bracket to the wall at a height (m), which acts on rotations to both sides.

        The stiffness of 500 kN/m (steel on a stud; 50 kN/m on plasterboard) is a judgement.
        """
        return cls("bracket", strength, stiffness, height, height, slack, 0.0, count)

    @classmethod
    def cable(
        cls,
        height: float,
        strength: float,
        stiffness: float = 100e3,
        slack: float = 0.0,
        preload: float = 0.0,
        count: int = 1,
        angle: float = 0.0,
        width: float = 0.0,
    ) -> Restraint:
        """Return a cable to the wall from the rear edge at a height (m), at an angle (rad, upwards from horizontal).

        It acts on rotations to the front only.  Its arm about the front corner is height cos(angle) - width sin(angle),
        with the block's width (m).
        """
        slope = checks.number("angle", angle, above=-0.5 * math.pi, below=0.5 * math.pi, unit="rad")
        arm = height * math.cos(slope) - width * math.sin(slope)
        if arm <= 0.0:
            raise ValueError(f"a cable at {height:g} m and an angle of {slope:g} rad pulls past the front corner")
        return cls("cable", strength, stiffness, arm, None, slack, preload, count, height)

    @classmethod
    def pole(
        cls, preload: float, strength: float, stiffness: float, front: float, back: float, count: int = 1
    ) -> Restraint:
        """Return a pole between block and ceiling, at distances (m) from the front and the rear lower corner.

        It acts on rotations to both sides.
        """
        return cls("pole", strength, stiffness, front, back, 0.0, preload, count)

    @classmethod
    def tendon(cls, stiffness: float, strength: float = math.inf, preload: float = 0.0, *, width: float) -> Restraint:
        """Return a vertical tendon in the middle of a block of a width (m), anchored in the floor.

        It acts on rotations to both sides.
        """
        return cls("tendon", strength, stiffness, 0.5 * width, 0.5 * width, 0.0, preload)

    @classmethod
    def adhesive(cls, strength: float, front: float, back: float | None = None) -> Restraint:
        """Return an adhesive (putty, pads) that holds rigidly until it peels, at distances (m) from both corners.

        It acts on rotations to both sides; `back` is `front` where it is not given.
        """
        return cls("adhesive", strength, math.inf, front, front if back is None else back)

    @property
    def rigid(self) -> bool:
        """True if the block does not move at all before it breaks."""
        return self.stiffness == math.inf

    @property
    def label(self) -> str:
        """What it is in a few words, as ``strap of 267 N, slack 5 mm``."""
        number = "" if self.count == 1 else f"{self.count} × "
        strength = "unbreakable" if self.strength == math.inf else f"of {self.strength:.4g} N"
        slack = "" if self.slack == 0.0 else f", slack {1000.0 * self.slack:.4g} mm"
        return f"{number}{self.kind} {strength}{slack}"


def describe_restraint(restraint: Restraint) -> dict[str, Any]:
    """Return the restraint's parameters as plain values (SI)."""
    names = ("kind", "strength", "stiffness", "front", "back", "slack", "preload", "count")
    return {name: getattr(restraint, name) for name in names}
