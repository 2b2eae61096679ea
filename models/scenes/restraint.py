"""Restraints that hold a block until they break: straps, brackets, cables, poles, tendons and adhesives."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from numbers import Real
from typing import Annotated

from ...core import checks
from ...core.parameters import Parameter, check
from ...core.wording import with_article

KINDS = ("strap", "bracket", "cable", "pole", "tendon", "adhesive")
TEST_STRENGTH = 267.0
"""Force that an anti-tip kit must carry in the test of ASTM F3096-23, N (60 lbf): a lower bound, and no median."""


Strength = Annotated[float, Parameter("N", above=0.0)]
Stiffness = Annotated[float, Parameter("N/m", above=0.0, written="N/mm")]
Arm = Annotated[float, Parameter("m", above=0.0)]
Slack = Annotated[float, Parameter("m", at_least=0.0, written="mm")]
Preload = Annotated[float, Parameter("N", at_least=0.0)]
Count = Annotated[int, Parameter(at_least=1, at_most=100)]
SLOPE = Parameter("rad", above=-0.5 * math.pi, below=0.5 * math.pi, written="°")


@dataclass(frozen=True, slots=True)
class Restraint:
    """Restraint of a block, elastic up to its strength and broken for good beyond; made by its class methods.

    Parameters
    ----------
    kind : str
        One of strap, bracket, cable, pole, tendon, adhesive.
    strength : float
        Force at which one of them breaks, N: the minimum of device, wall fixing and furniture fixing; infinity: never.
        The 267 N of ASTM F3096 are a lower bound, from a test.
    stiffness : float
        Force over elongation of one of them, N/m; infinity for an adhesive. The default stiffnesses are assumed.
    front : float or None
        Moment arm about the front lower corner, m: the elongation is the arm times the rotation towards that side;
        None: it does not act on that side.
    back : float or None
        Moment arm about the rear lower corner, m.
    slack : float
        Elongation before it is taut, m.
    preload : float
        Force of one of them at rest, N, below the strength.
    count : int
        Number of equal restraints side by side, with equal slack.
    height : float, optional
        Height of a strap, bracket or cable on the block, m, at most the block's height.

    Notes
    -----
    The force is T = preload + stiffness max(0, arm theta - slack), and the restraint breaks for good if T reaches the
    strength, on both sides at once. Blocks that have one need their `mass`.
    """

    kind: Annotated[str, Parameter(words=KINDS)]
    strength: Strength
    stiffness: Stiffness
    front: Arm | None = None
    back: Arm | None = None
    slack: Slack = 0.0
    preload: Preload = 0.0
    count: Count = 1
    height: float | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        numbers = [name for name in ("strength", "stiffness") if isinstance(getattr(self, name), Real)]
        check(self, but=[name for name in numbers if getattr(self, name) == math.inf])
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
        height: Arm,
        strength: Strength = TEST_STRENGTH,
        stiffness: Stiffness = 20e3,
        slack: Slack = 0.0,
        preload: Preload = 0.0,
        count: Count = 1,
    ) -> Restraint:
        """Return a horizontal strap to the wall at a height (m), which acts on rotations to the front only.

        The stiffness of 20 kN/m is assumed: no source was found.
        """
        return cls("strap", strength, stiffness, height, None, slack, preload, count)

    @classmethod
    def bracket(
        cls, height: Arm, strength: Strength, stiffness: Stiffness = 500e3, slack: Slack = 0.0, count: Count = 1
    ) -> Restraint:
        """Return an angle bracket to the wall at a height (m), which acts on rotations to both sides.

        The stiffness of 500 kN/m (steel on a stud; 50 kN/m on plasterboard) is assumed.
        """
        return cls("bracket", strength, stiffness, height, height, slack, 0.0, count)

    @classmethod
    def cable(
        cls,
        height: Arm,
        strength: Strength,
        stiffness: Stiffness = 100e3,
        slack: Slack = 0.0,
        preload: Preload = 0.0,
        count: Count = 1,
        angle: Annotated[float, SLOPE] = 0.0,
        width: Arm = 0.0,
    ) -> Restraint:
        """Return a cable to the wall from the rear edge, which acts on rotations to the front only.

        Its arm about the front corner is height cos(angle) - width sin(angle).

        Parameters
        ----------
        angle : float
            Slope of the cable, upwards from horizontal, rad.
        width : float
            The block's width, m; of use if the cable slopes.
        """
        SLOPE.check("angle", angle)
        slope = float(angle)
        checks.number("height", height, above=0.0, unit="m")
        checks.number("width", width, at_least=0.0, unit="m")
        arm = height * math.cos(slope) - width * math.sin(slope)
        if arm <= 0.0:
            raise ValueError(f"a cable at {height:g} m and an angle of {slope:g} rad pulls past the front corner")
        return cls("cable", strength, stiffness, arm, None, slack, preload, count, height)

    @classmethod
    def pole(
        cls, preload: Preload, strength: Strength, stiffness: Stiffness, front: Arm, back: Arm, count: Count = 1
    ) -> Restraint:
        """Return a pole between block and ceiling, which acts on rotations to both sides.

        Parameters
        ----------
        front : float
            Distance from the front lower edge, m.
        back : float
            Distance from the rear lower edge, m.
        """
        return cls("pole", strength, stiffness, front, back, 0.0, preload, count)

    @classmethod
    def tendon(
        cls, stiffness: Stiffness, strength: Strength = math.inf, preload: Preload = 0.0, *, width: Arm
    ) -> Restraint:
        """Return a vertical tendon in the middle of a block, anchored in the floor; it acts on both sides.

        Parameters
        ----------
        width : float
            The block's width, m.
        """
        checks.number("width", width, above=0.0, unit="m")
        return cls("tendon", strength, stiffness, 0.5 * width, 0.5 * width, 0.0, preload)

    @classmethod
    def adhesive(cls, strength: Strength, front: Arm, back: Arm | None = None) -> Restraint:
        """Return an adhesive (putty, pads) that is rigid until it peels, on both sides.

        Parameters
        ----------
        front : float
            Distance from the front lower edge, m.
        back : float, optional
            Distance from the rear lower edge, m; `front` if it is not given.
        """
        return cls("adhesive", strength, math.inf, front, front if back is None else back)

    @property
    def rigid(self) -> bool:
        """True if the block does not move at all before it breaks."""
        return self.stiffness == math.inf

    @property
    def label(self) -> str:
        """Short description, such as ``strap of 267 N, slack 5 mm``."""
        number = "" if self.count == 1 else f"{self.count} × "
        strength = "unbreakable" if self.strength == math.inf else f"of {self.strength:.4g} N"
        slack = "" if self.slack == 0.0 else f", slack {1000.0 * self.slack:.4g} mm"
        return f"{number}{self.kind} {strength}{slack}"
