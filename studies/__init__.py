"""User-facing parts: study files, results, plots, the command line."""

from typing import TYPE_CHECKING

from ..core.faces import face

if TYPE_CHECKING:
    from .buildings.anchoring import anchoring as anchoring
    from .buildings.assessment import Assessment as Assessment, assess as assess
    from .inventory.consequences import Consequence as Consequence, Injury as Injury
    from .inventory.contents import Contents as Contents, Inventory as Inventory
    from .inventory.reading import read_inventory as read_inventory
    from .kinds.fragility import FragilityStudy as FragilityStudy
    from .kinds.performance import PerformanceStudy as PerformanceStudy
    from .kinds.sensitivity import SensitivityStudy as SensitivityStudy
    from .kinds.study import Study as Study
    from .kinds.uncertainty import UncertaintyStudy as UncertaintyStudy
    from .text.error import StudyError as StudyError

__getattr__, __dir__, __all__ = face(__name__)
