"""The end of a study on a terminal, below its short table: the answer, and its validity."""

from collections.abc import Iterator
from dataclasses import replace

import xarray as xr

from ...core.facts import GOOD, INVALID, Fact
from ..facts import answer_building as building, answer_curves as curves, answer_sensitivity as sensitivity
from ..facts.checks import badge, checks_of
from ..facts.footnotes import footnotes
from ..facts.say import remedy, say
from ..text.reached import within_levels

BESIDE_TABLE = (
    *("curve.half_level", "curve.rare", "curve.rank", "law.range", "rate.chance", "uncertainty.half_level"),
    *("curve.crossing_too", "law.crossing_too"),
)
"""Facts that the short table shows, or that only the page gives."""
OF_MONEY = ("anchoring.", "budget.", "kit.", "code.beyond_budget", "code.unpriced")
"""Actions on money, by the beginning of their names."""


def verdict(results: xr.Dataset, answered: bool) -> tuple[list[str], list[str], list[str]]:
    """Return the answer, the validity, which begins the answer if results are not valid, and remedies of curves.

    `answered`: True if a short table follows the answer.
    """
    checks = checks_of(results)
    bad = [check for check in checks if check.word != GOOD]
    answer = [say(fact, "page") for fact in _facts(within_levels(results), answered)]
    missed = [say(check, "checks") for check in bad if check.what == "adaptive.precision_missed"]
    unfitted = [remedy(check, "checks") for check in bad if check.what == "curve.unfitted"]
    line = f"validity: {say(badge(checks), 'checks')}"
    invalid = [say(check, "checks") for check in bad if check.word == INVALID]
    if invalid:
        return [" ".join([f"{line}; do not rely on these results.", *invalid]), *answer, *missed], [], unfitted
    return [*answer, *missed], [line], unfitted


def _facts(results: xr.Dataset, answered: bool) -> Iterator[Fact]:
    if "place" in results.dims:
        yield from building.answer(results)
        yield from (fact for fact in footnotes(results) if fact.what == "rate.model_range")
        yield from (fact for fact in building.details(results) if fact.what == "consequence.loss")
        for fact in building.actions(results):
            if fact.what.startswith(OF_MONEY):  # (without the page's table, lines are named)
                yield replace(fact, more={**fact.more, "listed": True}) if fact.what == "anchoring.lines" else fact
    elif "value" in results.dims:
        yield from sensitivity.answer(results)
    else:
        yield from (fact for fact in curves.answer(results) if not (answered and fact.what in BESIDE_TABLE))
        yield from (fact for fact in curves.actions(results) if fact.what.startswith("size."))
    yield from (fact for fact in footnotes(results) if fact.what.startswith("law."))
