"""Words that options of commands take."""

from collections.abc import Sequence
from typing import Literal, Protocol

CurveFormat = Literal["pelicun", "nrml", "csv"]
ExportFormat = Literal["pelicun", "nrml", "csv", "xlsx"]
Starter = Literal["bookcase", "hazard", "inventory", "records", "scenario"]


class Word(Protocol):
    """A word of the command line."""

    @property
    def value(self) -> str:
        """Its text."""


def whole(_: object, words: Sequence[Word]) -> int:
    """Return the whole number of an option; ValueError for others (1.5), which the parser of options would round."""
    (word,) = words
    if not word.value.removeprefix("-").isdecimal():
        raise ValueError(f"must be a whole number, got {word.value!r}")
    return int(word.value)
