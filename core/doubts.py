"""Input warnings: values outside of the known range, each in a sentence that names the likely slip."""

import sys
import warnings
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, Self

from .units import STANDARD_GRAVITY
from .wording import listed_name

KINDS = (
    *("block size", "units", "building", "level", "scenario", "spectra", "vertical", "offset", "drift"),
    *("displacement", "PGA", "PGV/PGA", "duration", "hazard", "selection", "ringing", "collapse", "strike"),
    *("rocks first", "slides on", "scaling", "misfit", "table", "structure"),
)
"""Kinds of input warnings, by the names under which a study accepts them."""
NAMED = 3  # no sentence names more
HIGHEST_RECORD, HIGHEST_PGA, IMPOSSIBLE_PGA = 2.0 * STANDARD_GRAVITY, 3.0 * STANDARD_GRAVITY, 20.0 * STANDARD_GRAVITY
"""m/s²: a few recorded PGA are 2 to 4 g (Anderson 2010), floors have more; twenty times g is another unit."""
_noted: "ContextVar[list[Doubt] | None]" = ContextVar("noted", default=None)


class Doubt(NamedTuple):
    """Input warning: its kind, one of `KINDS`, its sentence, and flags for an impossible value and for a settled one.

    A settled warning is a note alone: it needs no action.
    """

    kind: str
    sentence: str
    grave: bool = False
    settled: bool = False

    @classmethod
    def of(cls, name: str, grave: bool = False, cure: str = "", /, **values: Any) -> Self:
        """Return the input warning of a name in `doubts.toml` with values for the fields of its sentence."""
        row = doubt_data()["doubt"][name]
        several = values.get("number", 1) != 1
        sentence = row.get("plural", row["sentence"]) if several else row["sentence"]
        texts = {"cure": doubt_data()["cure"][cure] if cure else "", "verb": row.get("verb", ("", ""))[several]}
        return cls(row["kind"], sentence.format(**texts, **values), grave, row.get("settled", False))


@cache
def doubt_data() -> dict[str, dict[str, Any]]:
    """Return the tables of `doubts.toml` by their names."""
    import tomllib  # noqa: PLC0415 - only when needed

    return tomllib.loads(Path(__file__).with_name("doubts.toml").read_text(encoding="utf-8"))


class ImplausibleInput(UserWarning):
    """Warning of an input outside of the known range, or too poor for valid results; it is used as it is."""


def first_names(names: Sequence[str]) -> str:
    """Return the first of some names, and the number of the others."""
    return first_of([*map(listed_name, names[:NAMED]), *names[NAMED:]])


def first_of(texts: Sequence[str]) -> str:
    """Return the first of some texts, and the number of the others."""
    more = len(texts) - NAMED
    return ", ".join(texts[:NAMED]) + (f" and {more:,} more" if more > 0 else "")


def warn(doubts: Iterable[Doubt], category: type[UserWarning] = ImplausibleInput) -> None:
    """Issue input warnings at the package's caller; none are issued if the caller notes them itself (`noted`)."""
    keeper = _noted.get()
    if keeper is not None:
        keeper.extend(doubts)
        return
    level = len(_callers()) + 1
    for doubt in doubts:
        warnings.warn(doubt.sentence, category, stacklevel=level)


def warn_of_results(sentences: Iterable[str]) -> None:
    """Warn of invalid results at the package's caller; studies report them among their checks."""
    level = len(_callers()) + 1
    for sentence in () if by_study() else sentences:
        warnings.warn(f"results are not valid: {sentence}", ImplausibleInput, stacklevel=level)


def by_study() -> bool:
    """Return True if a study called, which has input warnings among its notes."""
    return any(name.split(".")[1:2] == ["studies"] for name in _callers())


def _callers() -> list[str]:
    """Return the names of the package's modules on the stack, the caller of this function first."""
    package = __name__.partition(".")[0]
    names, frame = [], sys._getframe(1)
    while frame.f_back is not None and (name := str(frame.f_globals.get("__name__"))).partition(".")[0] == package:
        names.append(name)
        frame = frame.f_back
    return names


@contextmanager
def noted() -> Iterator[list[Doubt]]:
    """Keep input warnings silent within, and yield the list of them: for callers that note them."""
    keeper: list[Doubt] = []
    token = _noted.set(keeper)
    try:
        yield keeper
    finally:
        _noted.reset(token)
