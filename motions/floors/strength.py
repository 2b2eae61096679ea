"""Default strengths of buildings: a code's design strength times the overstrength of the system."""

from typing import Annotated, Any, NamedTuple

from ...core import checks
from ...core.parameters import Parameter


class System(NamedTuple):
    """A seismic force-resisting system: its name, response modification R and overstrength factor Omega_0."""

    title: str
    reduction: float
    overstrength: float


SYSTEMS = {
    "special-moment-frame": System("special moment frame", 8.0, 3.0),
    "ordinary-steel-moment-frame": System("ordinary steel moment frame", 3.5, 3.0),
    "special-concrete-wall": System("special reinforced concrete shear wall (building frame system)", 6.0, 2.5),
    "special-braced-frame": System("special concentrically braced frame", 6.0, 2.0),
    "buckling-restrained-braced-frame": System("buckling-restrained braced frame", 8.0, 2.5),
    "light-frame-wall": System("light-frame wall with wood panels", 6.5, 3.0),
    "ordinary-masonry-wall": System("ordinary reinforced masonry shear wall", 2.0, 2.5),
}
"""Systems by the words of study files, with R and Omega_0 of ASCE/SEI 7-22, table 12.2-1 (recalled)."""
IMPORTANCE = Parameter(at_least=1.0, at_most=1.5)
Importance = Annotated[float, IMPORTANCE]
DESIGN = Parameter(above=0.0, at_most=4.0)
Design = Annotated[float, DESIGN]
"""S_DS or S_D1 of a site, g: maps have up to about 3."""


class Strength(NamedTuple):
    """Yield strength over weight, and its derivation from the code in words."""

    coefficient: float
    text: str


def code_strength(system: Any, period: Any, sds: Any, sd1: Any, importance: Any = 1.0) -> Strength:
    """Return the assumed strength of a building designed by a code, with its derivation.

    C_y = Omega_0 C_s with C_s = min(S_DS, S_D1/T1) I_e/R (ASCE/SEI 7-22, 12.8.1.1, recalled), for
    `Building.from_storeys`. The code's minimum C_s, its branch at long periods and designs governed by drift are left
    out: these make buildings stronger.
    """
    kind = SYSTEMS[checks.choice("system", system, tuple(SYSTEMS))]
    t = checks.number("period", period, above=0.0, unit="s")
    short, long = DESIGN.number("sds", sds), DESIGN.number("sd1", sd1)
    factor = IMPORTANCE.number("importance", importance)
    response = min(short, long / t) * factor / kind.reduction
    c_y = kind.overstrength * response
    text = (
        f"{kind.title}, C_y = Ω0 C_s = {kind.overstrength:g} × {response:.3g} = {c_y:.3g}, C_s = min(S_DS, S_D1/T1) "
        f"I_e/R with S_DS {short:g} g, S_D1 {long:g} g, T1 {t:.3g} s, I_e {factor:g} and R {kind.reduction:g}"
    )
    return Strength(c_y, text)
