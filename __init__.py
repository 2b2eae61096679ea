"""toppling: how likely is this bookcase, cabinet, server rack or pedestal to fall over in an earthquake?

Blocks and damping laws (`toppling.models`), motions (`toppling.motions`), incremental dynamic analysis and fragility
curves (`toppling.fragility`), studies and figures (`toppling.studies`).  SI units and radians throughout.
"""

from importlib import import_module, metadata
from typing import TYPE_CHECKING, Any

from . import motions
from .fragility import (
    HazardCurve,
    annual_rate,
    cloud,
    fit_fragility,
    ida,
    overturning_probability,
    read_hazard,
    stripes,
)
from .models import (
    Block,
    DiscreteDamping,
    EnergyConsistent,
    GianniniMasiani,
    HousnerImpact,
    MakrisKonstantinidis,
    Vassiliou,
    ViscousDamping,
    catalogue,
    free_rocking,
    simulate,
)

if TYPE_CHECKING:
    from .studies import Study, plot
    from .studies.animate import animate

__version__ = metadata.version("toppling")

__all__ = [
    "Block",
    "DiscreteDamping",
    "EnergyConsistent",
    "GianniniMasiani",
    "HazardCurve",
    "HousnerImpact",
    "MakrisKonstantinidis",
    "Study",
    "Vassiliou",
    "ViscousDamping",
    "animate",
    "annual_rate",
    "catalogue",
    "cloud",
    "fit_fragility",
    "free_rocking",
    "ida",
    "motions",
    "overturning_probability",
    "plot",
    "read_hazard",
    "simulate",
    "stripes",
]

# Study files and figures load slow libraries (pydantic, matplotlib): only when asked for.
_LAZY = {"Study": (".studies", "Study"), "animate": (".studies.animate", "animate"), "plot": (".studies.plot", None)}


def __getattr__(name: str) -> Any:
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, attribute = _LAZY[name]
    loaded = import_module(module, __name__)
    return loaded if attribute is None else getattr(loaded, attribute)
