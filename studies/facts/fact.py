"""A fact: what results say, without words."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

GOOD, CARE, INVALID, UNKNOWN = "good", "use with care", "not valid", "not checked"
"""Words of a check: the first three from best to worst, the last if nothing was checked."""


@dataclass(frozen=True)
class Fact:
    """What results say: `what` names its sentence in a template, the rest are the values in it.

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
        Name of the sentence that says what to do about it.
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
