"""Templates that say facts: one file of whole sentences for each register."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from ...core import wording
from ...core.doubts import first_names, first_of
from ...fragility.hazard.rates import probability_in
from ..text.curve_notes import action_of, reached_of
from ..text.names import clean
from ..text.words import that_has, value_in
from .fact import Fact

TEMPLATES = Path(__file__).parents[1] / "templates"
FILTERS: dict[str, Callable[..., str | float]] = {
    "counted": lambda number, noun: wording.counted(int(number), noun),
    "percent": wording.two_digit_percent,
    "whole": wording.given_percent,
    "two_digits": wording.two_digits,
    "given": wording.given_number,
    "listed": first_of,
    "named": first_names,
    "quoted": lambda names: first_of([f"“{name}”" for name in names]),
    "chance": wording.about_percent,
    "chances": lambda ends: _ends(ends, wording.about_percent, wording.chances_between),
    "ends": lambda ends: _ends(ends, wording.two_digits, wording.interval_text),
    "ratio": lambda values: wording.ratio_text(*values),
    "years": wording.about_years,
    "in_years": lambda rate, years: float(probability_in(np.float64(rate), years)),
    "year_count": wording.years_text,
    "article": wording.with_article,
    "in_unit": value_in,
    "that_has": that_has,
    "acts": action_of,
    "fell": reached_of,
}
"""Filters of numbers, plurals and lists."""
_SPACES, _GAPS = re.compile(r"[ \n]+"), re.compile(r" ([,.;:])(?=\s|$)")


def _ends(ends: tuple[float, float], write: Callable[[float], str], between: Callable[..., str]) -> str:
    """Return the ends of a range, one number if both are written alike, or that they are not known."""
    low, high = ends
    if not (math.isfinite(low) and low > 0.0) and math.isinf(high):
        return "interval not known"
    return write(low) if math.isfinite(high) and write(low) == write(high) else between(low, high, write)


def say(fact: Fact, register: str) -> str:
    """Return the sentence of a fact: the macro of its name in the template of a register, `a.b` as `a_b`."""
    return _sentence(register, fact.more.get("sentence", fact.what), fact)


def remedy(fact: Fact, register: str) -> str:
    """Return what to do about a fact; empty if there is nothing to do."""
    return _sentence(register, fact.remedy, fact) if fact.remedy else ""


def value_of(name: str, register: str) -> Any:
    """Return a table of a register, such as the titles of its facts."""
    return getattr(_module(register), name)


def _sentence(register: str, what: str, fact: Fact) -> str:
    text = getattr(_module(register), what.replace(".", "_"))(fact)
    return _GAPS.sub(r"\1", _SPACES.sub(" ", str(text))).strip()


@cache
def _module(register: str) -> Any:
    return environment(escaping=False).get_template(f"{register}.j2").module


def environment(*, escaping: bool) -> Environment:
    """Return the templates, whose texts are cleaned and, with `escaping`, escaped for HTML."""

    def safe(value: object) -> object:
        return clean(value) if isinstance(value, str) and not isinstance(value, Markup) else value

    made = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=escaping,
        finalize=safe,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    made.filters |= FILTERS
    return made
