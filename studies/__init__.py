"""What a user runs: study files, results, plots, the command line."""

from .schema import StudyError
from .study import Study

__all__ = ["Study", "StudyError"]
