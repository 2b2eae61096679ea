"""What a user runs: study files, results, plots, the command line."""

from .buildings.anchoring import anchoring
from .buildings.assessment import assess
from .buildings.consequences import Consequence, Injury
from .buildings.contents import Contents, Inventory
from .buildings.inventory import read_inventory
from .file.table import StudyError
from .kinds.fragility import FragilityStudy
from .kinds.performance import PerformanceStudy
from .kinds.sensitivity import SensitivityStudy
from .kinds.study import Study
from .kinds.uncertainty import UncertaintyStudy

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
