"""What a user runs: study files, results, plots, the command line."""

from .study import Study
from .tables import StudyError

__all__ = ["Study", "StudyError"]
