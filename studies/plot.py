"""`toppling.plot`: every figure as a function, axes in and axes out.

A dataset first, then the axes to draw into, one panel each: every figure of several is made of calls with ``ax=``.
Where there are none they are of a new figure, with its legend (``ax.figure.savefig("name.png")``); axes that are handed
in get no legend, their lines have labels (``ax.legend()``).  Options are keywords, one line's look is matplotlib's
``color`` and ``label``, and one block, law or floor is chosen by its label: where there are several, that must be said.
Nothing here touches pyplot, or chooses a backend.
"""

from .plots_assessment import inventory
from .plots_efficiency import measures
from .plots_fragility import fragility
from .plots_indices import indices
from .plots_moments import hysteresis, moment
from .plots_response import history, phase
from .plots_risk import risk
from .plots_sensitivity import sensitivity
from .plots_uncertainty import uncertainty

__all__ = [
    "fragility",
    "history",
    "hysteresis",
    "indices",
    "inventory",
    "measures",
    "moment",
    "phase",
    "risk",
    "sensitivity",
    "uncertainty",
]
