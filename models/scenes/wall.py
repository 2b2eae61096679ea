"""Walls behind a block, or on both of its sides: the gap, the contact with the block, and its rebound."""

import math
from dataclasses import dataclass
from typing import Annotated

from ...core.parameters import SHARE, Parameter, check


@dataclass(frozen=True, slots=True)
class Wall:
    """Rigid wall behind a block, fixed to the floor of the block.

    Parameters
    ----------
    gap : float
        Clear distance between the block at rest and the wall behind it, m; 0: the block touches the wall.  The front is
        the side away from the wall.
    height : float, optional
        Height at which they meet, m; the block's height (its upper edge) if not given, less for a rail.
    restitution : float, optional
        Velocity after over velocity before an impact at the wall; `rebound` of the block if not given.
    front_gap : float, optional
        Clear distance to a second wall in front (a niche), m; no wall there if not given.

    Notes
    -----
    The back is the side of negative rotation: a positive rotation tips the block away from the wall, into the room. The
    block meets the wall at the rotation atan(gap/height), asin(gap/height) for its upper edge in exact geometry. The
    wall moves with the floor. The drift of its storey against the floor is left out, and so is the slip of the block's
    foot in the impact.

    Examples
    --------
    >>> Wall(gap=0.02).gap
    0.02
    """

    gap: Annotated[float, Parameter("m", at_least=0.0, written="mm")] = 0.0
    height: Annotated[float, Parameter("m", above=0.0)] | None = None
    restitution: Annotated[float, SHARE] | None = None
    front_gap: Annotated[float, Parameter("m", above=0.0, written="mm")] | None = None

    def __post_init__(self) -> None:
        check(self)

    def contact(self, gap: float, height: float, exact: bool) -> float:
        """Return the rotation (rad) at which a block of a height (m) meets a wall at a gap (m).

        The linearised geometry takes gap/height; a gap as wide as the contact is high is never closed (infinity).
        """
        level = height if self.height is None else self.height
        if not exact:
            return gap / level
        if self.height is not None and self.height < height:
            return math.atan(gap / level)
        return math.asin(gap / level) if gap < level else math.inf

    @property
    def label(self) -> str:
        """Short description, such as ``wall at 20 mm``."""
        behind = "touching wall" if self.gap == 0.0 else f"wall at {1000.0 * self.gap:.4g} mm"
        return behind if self.front_gap is None else f"{behind}, another in front at {1000.0 * self.front_gap:.4g} mm"


def rebound(gyration: float, half_width: float, cm_height: float, contact_height: float) -> float:
    """Return velocity after over velocity before an impact at a wall, from the block's geometry (>= 0).

    A block that turns about its lower rear corner strikes the wall at the height z, and the contact sticks: the angular
    momentum about that point is kept. With rho² = I_G/m, the half width b towards the wall, and the mass at height h,
    omega+/omega- = (rho² + b² + h² - h z)/(rho² + b² + (z - h)²). For the upper edge of a block with its mass at
    mid-height this is -(2 cos² alpha/lambda - 1) (derived). A positive ratio (squat blocks, low rails) would mean that
    the block continues to turn about the contact: it is assumed to stop there, 0. With Housner's restitution at the
    base before and after it, the product is the published restitution of one-sided rocking: Sorrentino, L., AlShawa, O.
    and Decanini, L. D. (2011). Bulletin of Earthquake Engineering 9, 1617 (recalled, not re-read).
    """
    square = gyration * gyration + half_width * half_width
    above = contact_height - cm_height
    ratio = (square + cm_height * cm_height - cm_height * contact_height) / (square + above * above)
    return min(max(0.0, -ratio), 1.0)
