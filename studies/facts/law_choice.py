"""Choice of the damping law whose results answer a question best."""

import xarray as xr

from ...core.aliases import Flags
from ...core.facts import Fact
from ..text.words import LAW_NAMES, REFERENCE_LAW, reference_law

VISCOUS = ("giannini-masiani", "makris-konstantinidis", "vassiliou")
"""Laws that replace impacts by viscous damping."""
CONSISTENT = "energy-consistent"


def choice_of_law(results: xr.Dataset) -> Fact | None:
    """Return the recommended law of a study; None for one law, branches or an uncertain law."""
    law = results.coords.get("law")
    if law is None or law.dims != ("model",) or "branch" in results.dims:
        return None
    names = list(dict.fromkeys(law.values.astype(str).tolist()))
    if len(names) == 1:
        return None
    given = names_of([str(law.values[reference_law(results)[0]])])
    what = "reference" if REFERENCE_LAW in names else "consistent" if CONSISTENT in names else "missing"
    viscous = [name for name in VISCOUS if name in names]
    more = {"viscous": names_of(viscous) if len(viscous) > 1 else "", "consistent": given == LAW_NAMES[CONSISTENT]}
    return Fact(f"law.use_{what}", names=(given,), more=more)


def damped_throughout(results: xr.Dataset, fewer: Flags) -> tuple[str, ...]:
    """Return the laws with `fewer` falls that dissipate energy throughout the motion, as no impact does."""
    law = results.coords.get("law")
    if law is None or law.dims != ("model",):
        return ()
    names = law.values.astype(str)[fewer]
    return tuple(dict.fromkeys(LAW_NAMES.get(name, name) for name in names if name in (*VISCOUS, "viscous")))


def names_of(laws: list[str]) -> str:
    """Return laws in words, as a list."""
    words = [LAW_NAMES.get(law, law) for law in laws]
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
