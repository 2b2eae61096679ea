"""Facts: content of results, without words."""

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

GOOD, CARE, INVALID, UNKNOWN = "good", "use with care", "not valid", "not checked"
"""Words of a check: the first three from best to worst, the last if nothing was checked."""


@dataclass(frozen=True)
class Fact:
    """Fact in results: `what` names its sentence in a template, the rest are the values in it.

    Attributes
    ----------
    what
        Name of the fact, such as ``sliding.share``.
    value, lower, upper
        A value (SI) and the ends of its interval.
    unit
        Unit of the value.
    names
        Blocks, pieces, laws or places that the fact is about.
    level
        Intensity level (SI).
    word
        Severity, for facts of checks.
    remedy
        Name of the sentence with the remedy.
    more
        Other values of the sentence.
    """

    what: str
    value: float = math.nan
    lower: float = math.nan
    upper: float = math.nan
    unit: str = ""
    names: tuple[str, ...] = ()
    level: float = math.nan
    word: str = ""
    remedy: str = ""
    more: Mapping[str, Any] = field(default_factory=dict)


def doubted(sentences: Iterable[str]) -> list[Fact]:
    """Return input warnings, which are always sentences, as facts."""
    return [Fact("input.doubt", names=(sentence,)) for sentence in sentences]


def stored(facts: Iterable[Fact]) -> str:
    """Return facts as one line of JSON, the attribute of results that `facts_in` reads."""
    empty = vars(Fact(""))
    # (what is not known is the same object, unlike any other NaN)
    given = [[(name, value) for name, value in vars(fact).items() if value is not empty[name]] for fact in facts]
    kept = [{name: value for name, value in values if value != empty[name]} for values in given]
    return json.dumps(kept, ensure_ascii=False)


def facts_in(text: str) -> list[Fact]:
    """Return the facts of an attribute of results; lines of a text are sentences of an earlier version."""
    if not text.startswith("["):
        return doubted(text.splitlines())
    return [Fact(**{**fact, "names": tuple(fact.get("names", ()))}) for fact in json.loads(text)]
