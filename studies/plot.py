"""`toppling.plot`: every figure as a function, axes in and axes out.

A dataset first, then the axes to draw into (of a new figure where there are none: ``ax.figure.savefig("name.png")``);
one block, law or floor is chosen by its label.  Nothing here touches pyplot, or chooses a backend.
"""

from .plots_assessment import inventory
from .plots_efficiency import measures
from .plots_fragility import fragility
from .plots_indices import indices
from .plots_response import history, hysteresis, moment, phase
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
