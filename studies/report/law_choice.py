"""Which of several damping laws an answer is best taken from, with the reason and the source, in sentences."""

from __future__ import annotations

import xarray as xr

from ..tables.sensitivity import LAW_NAMES
from ..text.words import REFERENCE_LAW, reference_law
from .validity import is_valid

VISCOUS = ("giannini-masiani", "makris-konstantinidis", "vassiliou")
"""Laws that replace impacts by viscous damping."""
CONSISTENT = "energy-consistent"


def choice_of_law(results: xr.Dataset) -> str:
    """Return `law_choice` for results by their checks, which are made only where there is a choice."""
    said = law_choice(results)
    return said if not said or is_valid(results) else law_choice(results, valid=False)


def law_choice(results: xr.Dataset, valid: bool = True) -> str:
    """Return which law of a study to use, and what several laws show; '' for one law, branches or an uncertain law."""
    law = results.coords.get("law")
    if law is None or law.dims != ("model",) or "branch" in results.dims:
        return ""
    names = list(dict.fromkeys(law.values.astype(str).tolist()))
    if len(names) == 1:
        return ""
    use = "Use the results" if valid else "Once results are valid, use those"
    own = names_of([str(law.values[reference_law(results)[0]])])
    if REFERENCE_LAW in names:
        said = (
            f"{use} under {LAW_NAMES[REFERENCE_LAW]}, for which this answer is given: they are those of the "
            "rigid block with impacts (Housner 1963), which the other laws approximate."
        )
    elif CONSISTENT in names:
        here = own == LAW_NAMES[CONSISTENT]
        given = "for which this answer is given" if here else f"not those under {own}, which are given here"
        said = (
            f"{use} under {LAW_NAMES[CONSISTENT]}, {given}: at each passage through the upright position it "
            "dissipates the energy that an impact of the rigid block would (Housner 1963)."
        )
    else:
        said = (
            "No law of this study is the rigid block with impacts (Housner 1963), which they approximate: run the "
            f"study under {LAW_NAMES[REFERENCE_LAW]} as well, and use those results rather than these, under {own}."
        )
    viscous = [name for name in VISCOUS if name in names]
    if len(viscous) > 1:
        said += (
            f" {names_of(viscous)} are viscous approximations of one and the same reference, that rigid block: that "
            "they agree confirms nothing, and how far they differ does not measure what is uncertain about a real "
            "piece."
        )
    return said


def names_of(laws: list[str]) -> str:
    """Return laws in words, as a list."""
    words = [LAW_NAMES.get(one, one) for one in laws]
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
