"""What a user runs: study files, results, plots, the command line."""

from typing import TYPE_CHECKING

from ..core.faces import face

if TYPE_CHECKING:
    from .buildings.anchoring import anchoring
    from .buildings.assessment import assess
    from .inventory.consequences import Consequence, Injury
    from .inventory.contents import Contents, Inventory
    from .inventory.reading import read_inventory
    from .kinds.fragility import FragilityStudy
    from .kinds.performance import PerformanceStudy
    from .kinds.sensitivity import SensitivityStudy
    from .kinds.study import Study
    from .kinds.uncertainty import UncertaintyStudy
    from .text.error import StudyError

__all__ = [
    "Consequence",
    "Contents",
    "FragilityStudy",
    "Injury",
    "Inventory",
    "PerformanceStudy",
    "SensitivityStudy",
    "Study",
    "StudyError",
    "UncertaintyStudy",
    "anchoring",
    "assess",
    "read_inventory",
]

__getattr__, __dir__ = face(
    __name__,
    {
        "buildings.anchoring": ("anchoring",),
        "buildings.assessment": ("assess",),
        "text.error": ("StudyError",),
        "inventory.consequences": ("Consequence", "Injury"),
        "inventory.contents": ("Contents", "Inventory"),
        "inventory.reading": ("read_inventory",),
        "kinds.fragility": ("FragilityStudy",),
        "kinds.performance": ("PerformanceStudy",),
        "kinds.sensitivity": ("SensitivityStudy",),
        "kinds.study": ("Study",),
        "kinds.uncertainty": ("UncertaintyStudy",),
    },
)
