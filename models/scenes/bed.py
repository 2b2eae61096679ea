"""Soft beds under the whole width of blocks: carpets, mats, strips of soft feet (Winkler foundation)."""

import math
from dataclasses import dataclass
from typing import Annotated, NamedTuple

from ...core import checks
from ...core.parameters import Parameter, check

MOST_SETTLEMENT = 0.1
"""Largest settlement over the half width."""
MOST_UPLIFT, LEAST_UPLIFT = 0.1, 1e-9
"""Maximum and minimum rotation at uplift over alpha; beyond 0.1 the weight takes over 0.3 of the stiffness.
"""
CHORDS = 6
"""Straight pieces of the moment from the uplift on, before the last one."""


SETTLEMENT = Parameter("m", above=0.0, written="mm")


@dataclass(frozen=True, slots=True)
class Bed:
    """Soft bed under the whole width of a block, elastic and without tension (Winkler foundation).

    Parameters
    ----------
    settlement : float
        Settlement of the soft bed (carpet, mat) under the weight of the upright block over its whole width, m. It must
        be at most a tenth of the block's half width and of half width x alpha.

    Notes
    -----
    A rigid base of width 2b with the weight m g on a bed of stiffness k per length settles by d0 = m g/(2 b k). Its
    edge lifts off at the rotation theta_u = d0/b. Up to theta_u the whole width is in contact and the bed's moment is k
    (2b³/3) theta. Beyond it the contact narrows to 2b sqrt(theta_u/theta), and its pressure is a triangle. The weight m
    g then acts at a third of the contact's length from the loaded edge. (Derived, for small rotations and a vertical
    motion without inertia; Winkler 1867.)

    Examples
    --------
    >>> Bed(settlement=0.002).label
    'bed that settles 2 mm'
    """

    settlement: Annotated[float, SETTLEMENT]

    def __post_init__(self) -> None:
        check(self)

    @property
    def label(self) -> str:
        """Short description, such as ``bed that settles 2 mm``."""
        return f"bed that settles {1000.0 * self.settlement:.4g} mm"


def check_bed(bed: Bed, half_width: float, alpha: float) -> None:
    """Raise ValueError for a bed that is too soft (or too firm to be resolved) for a block."""
    checks.number("bed settlement", bed.settlement, at_most=MOST_SETTLEMENT * half_width, unit="m")
    ratio = bed.settlement / (half_width * alpha)
    if not LEAST_UPLIFT <= ratio <= MOST_UPLIFT:
        word = "soft" if ratio > MOST_UPLIFT else "firm"
        raise ValueError(
            f"bed settlement must be {LEAST_UPLIFT * half_width * alpha:.3g} to {MOST_UPLIFT * half_width * alpha:.3g} "
            f"m for this block, so that it uplifts between {LEAST_UPLIFT:g} and {MOST_UPLIFT:g} alpha, got "
            f"{bed.settlement:g} m: too {word}"
        )


def balance_on_bed(uplift: float) -> float:
    """Return the rotation at which a block on a bed balances, over alpha, from that at uplift over alpha (below 1/3).

    The block balances at x alpha with 1 - (2/3) sqrt(uplift/x) = x: sqrt(x) = (2/sqrt 3) cos(arccos(-sqrt(3 uplift))/3)
    (derived).
    """
    return 4.0 / 3.0 * math.cos(math.acos(-math.sqrt(3.0 * uplift)) / 3.0) ** 2


class Polygon(NamedTuple):
    """Straight pieces of the moment of a bed: rotations of the nodes over alpha, and moments there over m g b.

    From the last node on the moment is constant.  `balance`: the rotation over alpha at which the block would fall by
    itself.
    """

    rotations: tuple[float, ...]
    moments: tuple[float, ...]
    balance: float


def polygon(uplift: float) -> Polygon:
    """Return the moment of a bed as a polygon, for a rotation at uplift over alpha below 1/3.

    The nodes form a geometric series of ratio r from the uplift on. Beyond the first, they lie on 1 - (2/3) c
    sqrt(uplift/x) with c = 4 sqrt(r)/(1 + sqrt(r))²: each chord then has the area of the curve (derived). The last node
    is at c² times the balance, so that the constant moment beyond it is the moment at the balance, which is exact.
    """
    balance = balance_on_bed(uplift)
    share = 1.0
    ratio = 1.0
    for _ in range(100):
        ratio = (share * share * balance / uplift) ** (1.0 / CHORDS)
        before, share = share, 4.0 * math.sqrt(ratio) / (1.0 + math.sqrt(ratio)) ** 2
        if abs(share - before) <= 1e-15:
            break
    beyond = [uplift * ratio**k for k in range(1, CHORDS + 1)]
    moments = [1.0 - 2.0 / 3.0 * share * math.sqrt(uplift / x) for x in beyond]
    return Polygon((uplift, *beyond), (1.0 / 3.0, *moments), balance)
