"""Table of all generators, by the names that study files use."""

from .matching.ac156 import AC156
from .matching.spectrum_compatible import SpectrumCompatible
from .simulated.evolutionary import EvolutionaryCloughPenzien, EvolutionaryKanaiTajimi
from .simulated.generator import Generator
from .simulated.kanai_tajimi import CloughPenzien, KanaiTajimi
from .simulated.near_fault import NearFault
from .simulated.seismological import Seismological
from .simulated.site_based import SiteBased, SiteBasedScenario

GENERATORS: dict[str, type[Generator]] = {
    "kanai-tajimi": KanaiTajimi,
    "clough-penzien": CloughPenzien,
    "evolutionary-kanai-tajimi": EvolutionaryKanaiTajimi,
    "evolutionary-clough-penzien": EvolutionaryCloughPenzien,
    "site-based": SiteBased,
    "site-based-scenario": SiteBasedScenario,
    "near-fault": NearFault,
    "seismological": Seismological,
    "spectrum-compatible": SpectrumCompatible,
    "ac156": AC156,
}
"""The generators by the names that study files use."""
