"""toppling: how likely is a bookcase, server rack or museum pedestal to overturn in an earthquake?

Blocks and damping laws (`toppling.models`), motions (`toppling.motions`), incremental dynamic analysis and fragility
curves (`toppling.fragility`), studies and figures (`toppling.studies`).  SI units and radians throughout.
"""

from typing import TYPE_CHECKING, Any

from .core.faces import face

if TYPE_CHECKING:
    from . import motions as motions
    from .fragility import (
        HazardCurve as HazardCurve,
        adaptive_ida as adaptive_ida,
        annual_rate as annual_rate,
        cloud as cloud,
        fit_fragility as fit_fragility,
        ida as ida,
        overturning_probability as overturning_probability,
        read_hazard as read_hazard,
        stripes as stripes,
    )
    from .models import (
        Bed as Bed,
        Block as Block,
        DiscreteDamping as DiscreteDamping,
        Edge as Edge,
        EnergyConsistent as EnergyConsistent,
        GianniniMasiani as GianniniMasiani,
        HousnerImpact as HousnerImpact,
        MakrisKonstantinidis as MakrisKonstantinidis,
        Restraint as Restraint,
        Sliding as Sliding,
        Vassiliou as Vassiliou,
        ViscousDamping as ViscousDamping,
        Wall as Wall,
        catalogue as catalogue,
        free_rocking as free_rocking,
        simulate as simulate,
    )
    from .studies import Study as Study, plot as plot
    from .studies.film.animate import animate as animate

    __version__: str

_public, __dir__, __all__ = face(__name__)


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version  # noqa: PLC0415 - hardly anyone asks

        return version("toppling")
    return _public(name)
