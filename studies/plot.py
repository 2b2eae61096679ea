"""`toppling.plot`: one function for each kind of panel, which takes matplotlib axes and returns them.

Each function takes a dataset first (`sliding`: blocks) and then the axes to draw into. A figure of several panels is
made of several calls with ``ax=``. Without axes the function makes a new figure with a legend
(``ax.figure.savefig("name.png")``). Axes that the caller provides get no legend, but their lines have labels
(``ax.legend()``). Options are keywords; ``color`` and ``label`` are matplotlib's. A block, law or floor is chosen by
its label, which must be given if there are several. Nothing here uses pyplot or chooses a backend.
"""

from .plots.assessment import inventory
from .plots.efficiency import measures
from .plots.fragility import fragility
from .plots.response import history, hysteresis, moment, phase
from .plots.risk import risk
from .plots.sensitivity import sensitivity
from .plots.sliding import sliding
from .plots.uncertainty import indices, uncertainty

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
    "sliding",
    "uncertainty",
]
