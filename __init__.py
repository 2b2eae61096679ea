"""toppling: how likely is this bookcase, cabinet, server rack or pedestal to fall over in an earthquake?

Blocks and damping laws (`toppling.models`), motions (`toppling.motions`), incremental dynamic analysis and fragility
curves (`toppling.fragility`), studies and figures (`toppling.studies`).  SI units and radians throughout.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
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
        Bed,
        Block,
        DiscreteDamping,
        Edge,
        EnergyConsistent,
        GianniniMasiani,
        HousnerImpact,
        MakrisKonstantinidis,
        Restraint,
        Sliding,
        Vassiliou,
        ViscousDamping,
        Wall,
        catalogue,
        free_rocking,
        simulate,
    )
    from .studies import Study, plot
    from .studies.film.animate import animate

    __version__: str

__all__ = [
    "Bed",
    "Block",
    "DiscreteDamping",
    "Edge",
    "EnergyConsistent",
    "GianniniMasiani",
    "HazardCurve",
    "HousnerImpact",
    "MakrisKonstantinidis",
    "Restraint",
    "Sliding",
    "Study",
    "Vassiliou",
    "ViscousDamping",
    "Wall",
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

# Every name is loaded when it is first used: nobody waits for libraries that are not needed, and the command can be
# interrupted from its first moment.
_MODELS = (
    "Bed", "Block", "DiscreteDamping", "Edge", "EnergyConsistent", "GianniniMasiani", "HousnerImpact",
    "MakrisKonstantinidis", "Restraint", "Sliding", "Vassiliou", "ViscousDamping", "Wall", "catalogue", "free_rocking",
    "simulate",
)  # fmt: skip
_FRAGILITY = (
    "HazardCurve", "annual_rate", "cloud", "fit_fragility", "ida", "overturning_probability", "read_hazard", "stripes",
)  # fmt: skip
_HOME = (
    dict.fromkeys(_MODELS, ".models")
    | dict.fromkeys(_FRAGILITY, ".fragility")
    | {"Study": ".studies", "animate": ".studies.film.animate"}
)
_MODULES = ("models", "motions", "fragility", "studies")


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return import_module("importlib.metadata").version("toppling")
    if name == "plot":
        return import_module(".studies.plot", __name__)
    if name in _MODULES:
        return import_module(f".{name}", __name__)
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOME[name], __name__), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__, *_MODULES})
