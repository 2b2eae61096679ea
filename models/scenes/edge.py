"""Edges of shelves, benches and pedestals, over which blocks that slide fall."""

import math
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from ...core.parameters import Parameter, check

CENTRE, FOOT = "centre", "foot"
FALLS_WHEN = (CENTRE, FOOT)
"""Part that must pass an edge for a block to fall off: the centre of mass, or the foot."""
Distance = Annotated[float, Parameter("m", at_least=0.0, written="mm")]
FALLEN_OFF = "fallen_off"
"""Name of the flag of blocks that slide over an edge."""


@dataclass(frozen=True, slots=True)
class Edge:
    """Edges of the surface below a block, over which it falls when it slides far enough.

    Parameters
    ----------
    front : float, optional
        Clear distance from the foot to the edge of the shelf, bench or pedestal in front, m; none there if not given.
    back : float, optional
        Clear distance from the foot to the edge behind, m; none there if not given.
    falls_when : str
        ``centre`` (it falls when its centre of mass has passed the edge) or ``foot`` (when its foot has: feet or
        castors that leave the surface).

    Notes
    -----
    A block at rest on its base falls when its centre of mass is over the edge: it has to slide the distance and its
    half width. Its motion while it slides beyond the edge (it tilts under a sliding contact) is left out.

    Examples
    --------
    >>> Edge(0.10).slips(half_width=0.15)
    (0.25, inf)
    >>> Edge(0.10, falls_when="foot").label
    'edge 100 mm in front'
    """

    front: Distance | None = None
    back: Distance | None = None
    falls_when: Annotated[str, Parameter(words=FALLS_WHEN)] = CENTRE

    def __post_init__(self) -> None:
        check(self)
        if self.front is None and self.back is None:
            raise ValueError("an edge needs its distance to the front or to the back")

    def slips(self, half_width: float) -> tuple[float, float]:
        """Return the slips to the front and back (m) beyond which a block falls off, infinite if there is no edge.

        `half_width` of the block, m.
        """
        reach = half_width if self.falls_when == CENTRE else 0.0
        front, back = (math.inf if gap is None else gap + reach for gap in (self.front, self.back))
        return front, back

    def fallen_off(self, forward: Any, backward: Any, half_width: float) -> Any:
        """Return True if the maximum slips to the front and to the back (m, >= 0) move a block over an edge.

        The slips are arrays of numpy or dask, or numbers.  NaN, the slip of a block that loses contact with the floor,
        counts as fallen off.
        """
        front, back = self.slips(half_width)
        return np.logical_not((forward <= front) & (backward <= back))

    @property
    def label(self) -> str:
        """Short description, such as ``edge 100 mm in front``."""
        sides = ((self.front, "in front"), (self.back, "behind"))
        return "edge " + " and ".join(f"{1000.0 * gap:.4g} mm {side}" for gap, side in sides if gap is not None)
