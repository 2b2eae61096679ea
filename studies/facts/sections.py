"""The facts of results by section: for the page, and as `report --json` gives them to programs."""

import json
from typing import Any

import xarray as xr

from ...core.facts import GOOD, INVALID, Fact, stored
from ..text.reached import within_levels
from . import answer_building as building, answer_curves as curves, answer_sensitivity as sensitivity
from .checks import badge, checks_of
from .footnotes import footnotes
from .method import inputs_of, method_of
from .notes import left_notes
from .say import remedy, say

REGISTERS = {
    "answer": "page",
    "actions": "page",
    "validity": "checks",
    "footnotes": "page",
    "details": "page",
    "inputs": "method",
    "method": "method",
    "checks": "checks",
    "passed": "",
    "notes": "notes",
}
"""Sections in the order of a page, and the register of each; passed checks are named only."""


def sections(results: xr.Dataset, state: str = "") -> dict[str, list[Fact]]:
    """Return the facts of results, whose file is in a `state`, by section."""
    within, checks = within_levels(results), checks_of(results, state)
    of_building = "place" in results.dims
    subject = building if of_building else sensitivity if "value" in results.dims else curves
    inputs, method, below = [*inputs_of(results)], [*method_of(results)], [*footnotes(within)]
    passed = [check for check in checks if check.word == GOOD]
    bad = sorted((check for check in checks if check.word != GOOD), key=lambda check: check.word != INVALID)
    return {
        "answer": [*subject.answer(within)],
        "actions": [*subject.actions(within)],
        "validity": [badge(checks)],
        "footnotes": below,
        "details": [*building.details(within)] if of_building else [],
        "inputs": inputs,
        "method": method,
        "checks": bad,
        "passed": passed,
        "notes": left_notes(results, (*checks, *inputs, *method, *below)),
    }


def as_json(by_section: dict[str, list[Fact]]) -> dict[str, list[dict[str, Any]]]:
    """Return facts by section as objects of JSON, each with its sentence and its remedy's."""
    return {section: [fact_json(fact, REGISTERS[section]) for fact in facts] for section, facts in by_section.items()}


def fact_json(fact: Fact, register: str) -> dict[str, Any]:
    """Return a fact as an object of JSON with its sentence and its remedy's; '' as `register`: without."""
    (given,) = json.loads(stored([fact]), parse_constant=lambda _: None)
    words = {"sentence": say(fact, register), "remedy": remedy(fact, register)} if register else {}
    return {**given, **{name: text for name, text in words.items() if text}}
