"""Every generator by the name that study files use."""

from __future__ import annotations

from .ac156 import AC156
from .ensembles import Generator
from .evolutionary import EvolutionaryCloughPenzien, EvolutionaryKanaiTajimi
from .filters import CloughPenzien, KanaiTajimi
from .nearfault import NearFault
from .seismological import Seismological
from .sitebased import SiteBased, SiteBasedScenario
from .spectrum_compatible import SpectrumCompatible

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
"""Every generator by the name that study files use."""
