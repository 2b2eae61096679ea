"""Ratios of two numbers by their replicates: too few motions decide nothing."""

import math

import numpy as np
import pytest

from toppling.core.facts import Fact
from toppling.fragility.risk.ratios import ratio_of
from toppling.studies.buildings.recommendations import UNKNOWN as NO_RANGE, Range
from toppling.studies.comparison.ratios import ANCHORED_IN, Line, Quantity, answer, legend, table_of
from toppling.studies.facts.say import say
from toppling.studies.plan.ratios import LOWER, OPEN, SAME, UNKNOWN, verdict_of


@pytest.mark.parametrize(("motions", "verdict"), [(1, ""), (2, ""), (3, ""), (8, "higher")])
def test_a_few_motions_decide_nothing(motions, verdict):
    """The resamples in which nothing falls are not left out, which would make the rest look certain."""
    rng = np.random.default_rng(1)
    fell = np.arange(60) < motions
    drawn = rng.multinomial(60, np.full(60, 1 / 60), 2000) @ fell / 60.0
    ratio = ratio_of(1.0e-3, 1.1e-3, 1.0e-3 * drawn, 1.1e-3 * drawn, 0.95)
    assert ratio.value == pytest.approx(1.1)
    assert verdict_of(ratio) == verdict
    assert math.isnan(ratio.lower) == (verdict == "")


@pytest.mark.parametrize(
    ("ends", "shown"),
    [
        ((0.8, 7.6e17), "2.00 (above 0.800)"),
        ((1e-9, 3.0), "2.00 (below 3.00)"),
        ((1e-9, 7.6e17), "2.00 (not known)"),
        ((1.5, 3.0), "2.00 (1.50–3.00)"),
    ],
)
def test_ends_of_ratios_beyond_any_runs_are_open(ends, shown):
    sides = Range(9.80665, -math.inf, 19.6133), Range(9.80665, 4.903325, math.inf)
    half = Quantity("half_level", "g", 9.80665, "m s-2", {"measure": "PGA", "verb": "overturn"})
    own = Line("half_level", "rack", "", ("housner", "housner"), *sides, Range(2.0, *ends), OPEN)
    table = table_of([own], [half], "95 %")
    assert table.cells(table.lines[0])[1:4] == ["1.00 (below 2.00)", "1.00 (above 0.500)", shown]


@pytest.mark.parametrize("name", ["files_changed", "first_branch", "largest", "other_motions", "surface", "too_many"])
def test_rare_facts_have_their_sentences(name):
    motions = {"motions": (9, 8), "both_ways": ["A"], "resampled": True, "changed": True, "known": False}
    assert say(Fact(f"comparison.{name}", 2001, more={"of": 70, "most": 2000, **motions}), "comparison").endswith(".")


def line(name, verdict, law="housner"):
    return Line("chance", name, "", (law, law), NO_RANGE, NO_RANGE, NO_RANGE, verdict)


CHANCE = Quantity("chance", "", 1.0, "1", {"years": 50.0}, chance=True)
KEPT = ANCHORED_IN["B"]


@pytest.mark.parametrize(
    "numbers", [{KEPT: 6, SAME: 2}, {KEPT: 3}, {**dict.fromkeys(ANCHORED_IN.values(), 1), LOWER: 2, UNKNOWN: 1}]
)
def test_lines_are_counted_by_verdict(numbers):
    verdicts = [verdict for verdict, number in numbers.items() for _ in range(number)]
    facts = [*answer([line(str(i), verdict) for i, verdict in enumerate(verdicts)], [CHANCE], "item")]
    assert {fact.word: fact.value for fact in facts} == numbers
    assert {fact.more["of"] for fact in facts} == {len(verdicts)}


def test_laws_are_named():
    """Two laws of one piece are not two pieces."""
    both = [line("rack", verdict, law) for law, verdict in (("housner", LOWER), ("discrete", LOWER))]
    (fact,) = answer(both, [CHANCE], "item")
    assert (fact.word, fact.value, fact.more["of"], fact.more["under"]) == (LOWER, 1, 1, ("housner", "discrete"))
    apart = [line("rack", verdict, law) for law, verdict in (("housner", LOWER), ("discrete", OPEN))]
    found = {fact.word: fact.more["under"] for fact in answer(apart, [CHANCE], "item")}
    assert found == {LOWER: ("housner",), OPEN: ("discrete",)}


def test_quantities_of_which_all_lines_are_alike_are_one_fact():
    both = [CHANCE._replace(name=name) for name in ("loss", "any")]
    lines = [line("rack", LOWER)._replace(quantity=quantity.name) for quantity in both]
    assert [fact.names for fact in answer(lines, both, "item")] == [("loss", "any")]
    lines += [line("shelf", OPEN)._replace(quantity=quantity.name) for quantity in both]
    assert [fact.names for fact in answer(lines, both, "item")] == [("loss",), ("loss",), ("any",), ("any",)]


def test_the_legend_explains_what_occurs():
    assert [fact.names for fact in legend([line("rack", KEPT), line("shelf", SAME)])] == [(KEPT,), (SAME,)]
    assert [fact.names for fact in legend([line("rack", LOWER), line("shelf", UNKNOWN)])] == [(LOWER,), (UNKNOWN,)]
