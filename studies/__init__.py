"""What a user runs: study files, results, plots, the command line."""

from .anchoring import anchoring
from .assessment import assess
from .contents import Contents, Inventory
from .fragility_study import FragilityStudy
from .inventory import read_inventory
from .performance_study import PerformanceStudy
from .sensitivity_study import SensitivityStudy
from .study import Study
from .tables import StudyError
from .uncertainty_study import UncertaintyStudy

__all__ = [
    "Contents",
    "FragilityStudy",
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
