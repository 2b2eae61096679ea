"""Doubts: inputs outside of what exists, each in a sentence that names the likely slip; studies accept them by name."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import NamedTuple

from .wording import listed_name

KINDS: dict[str, str] = {
    "block size": "sides above 20 m or below 0.01 m, widths above 1.5 m, and centres of mass lower than half the width "
    "(sides above 100 m or below 0.001 m refused)",
    "units": "dampings, restitutions, masses, strengths, distances, periods, filters … that suggest another unit",
    "building": "periods, dampings and heights of buildings, benches and isolators that suggest another unit",
    "level": "levels above 5 g or 10 m/s (above 50 g or 100 m/s refused), and levels of stripes or histories that "
    "their unscaled motions miss (stripes: by more than 10 %; by more than a factor of 1.5 refused)",
    "scenario": "earthquakes and sites outside of a generator's data, or motions unlike a ground-motion model's",
    "spectra": "records that are copies or multiples, and ensembles of nearly one spectrum: a dispersion of PGV/PGA "
    "below 0.3, or of Sa(1 s)/Sa(0.2 s) below 0.45, each with 95 % confidence (earthquakes: 0.52 and 0.73)",
    "vertical": "vertical components of records, left out, or shaking blocks as horizontal ones where they are named",
    "offset": "records whose mean is above 1 % of their PGA: raw samples (`baseline_order`)",
    "drift": "records whose velocity at the end is above 10 % of their PGV: an offset or a cut record (`highpass_hz`)",
    "displacement": "records whose PGD is above a quarter of their duration times their PGV (`highpass_hz`)",
    "PGA": "motions with a PGA above 3 g (above 20 g refused): gal or per cent headed g",
    "PGV/PGA": "records whose PGV/PGA lies outside 0.01 to 0.8 s: another time step, or velocity headed acceleration",
    "duration": "motions longer than 900 s, steps of a second, and arrays that look transposed (`window`)",
    "hazard": "hazards that are more frequent or stronger than at any site (0.1 g or 0.1 m/s more than 0.2 times per "
    "year, peaks of 2 g or 4 m/s in 475 years), end below 0.01 g, contradict others, or name no measure",
    "selection": "stripes whose motions do not agree with the hazard, disaggregations of another level",
    "ringing": "floor motions that end while the building sways with more than a fifth of its peak acceleration",
    "collapse": "ground motions under which a building that yields collapses",
    "strike": "motions under which an isolated platform moves further than its clearance (`stop_frequency_hz`)",
    "rocks first": "blocks that slide, under so much friction that they would rock",
    "slides on": "motions at whose end blocks still slide: add zeros after records, or friction is next to nothing",
    "scaling": "recordings scaled by less than 0.2 or more than 5 before they go through a building or an isolator "
    "that yields",
    "misfit": "matched motions whose mean misfit is above 5 %, or whose PGV or PGD leave their bounds (`pgv_bound`)",
    "table": "lines that lack cells or are cut, factors not applied, what is left out, hidden cells, unlikely pairs",
}
"""Kinds of doubts, by the names under which a study accepts them."""
NAMED = 3  # no sentence names more
_noted: ContextVar[list[Doubt] | None] = ContextVar("noted", default=None)


class Doubt(NamedTuple):
    """One doubt: its kind, one of `KINDS`, its sentence, whether nothing real can be meant, whether it is dealt with.

    What is dealt with is a note alone: it needs no care.
    """

    kind: str
    sentence: str
    grave: bool = False
    settled: bool = False


class ImplausibleInput(UserWarning):
    """Warning of an input outside of what exists, or too poor for valid results; it is used as it is."""


def first_names(names: Sequence[str]) -> str:
    """Return the first of some names, and the number of the others."""
    return first_of([*map(listed_name, names[:NAMED]), *names[NAMED:]])


def first_of(texts: Sequence[str]) -> str:
    """Return the first of some texts, and the number of the others."""
    more = len(texts) - NAMED
    return ", ".join(texts[:NAMED]) + (f" and {more:,} more" if more > 0 else "")


def warn(found: Iterable[Doubt], category: type[UserWarning] = ImplausibleInput) -> None:
    """Warn of doubts where the package was called; nothing is said where the caller notes them itself (`noted`)."""
    keeper = _noted.get()
    if keeper is not None:
        keeper.extend(found)
        return
    level = len(_callers()) + 1
    for one in found:
        warnings.warn(one.sentence, category, stacklevel=level)


def warn_of_results(found: Iterable[str]) -> None:
    """Warn of results that are not valid where the package was called; studies say so among their checks."""
    level = len(_callers()) + 1
    for sentence in () if by_study() else found:
        warnings.warn(f"results are not valid: {sentence}", ImplausibleInput, stacklevel=level)


def by_study() -> bool:
    """Return whether a study called, which has doubts among its notes."""
    return any(name.split(".")[1:2] == ["studies"] for name in _callers())


def _callers() -> list[str]:
    """Return the names of the package's modules on the stack, the caller of this function first."""
    package = __name__.partition(".")[0]
    found, frame = [], sys._getframe(1)
    while frame.f_back is not None and (name := str(frame.f_globals.get("__name__"))).partition(".")[0] == package:
        found.append(name)
        frame = frame.f_back
    return found


@contextmanager
def noted() -> Iterator[list[Doubt]]:
    """Keep doubts silent within, and yield the list of them: for callers that note them."""
    keeper: list[Doubt] = []
    token = _noted.set(keeper)
    try:
        yield keeper
    finally:
        _noted.reset(token)
