"""What a user runs: study files, results, plots, the command line."""

from .fragility_study import FragilityStudy
from .study import Study
from .tables import StudyError

__all__ = ["FragilityStudy", "Study", "StudyError"]
