"""Ratios of two numbers by their replicates: too few motions decide nothing."""

import math

import numpy as np
import pytest

from toppling.fragility.risk.ratios import ratio_of
from toppling.studies.buildings.recommendations import Range
from toppling.studies.comparison.compare import answer, reading
from toppling.studies.comparison.ratios import ANCHORED_IN, NONE, Line, Quantity, table_of
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
    median = Quantity("median", "Fitted median", "g", 9.80665, "m s-2")
    own = Line("median", "rack", "", ("housner", "housner"), *sides, Range(2.0, *ends), OPEN)
    table = table_of([own], [median], "95 %")
    assert table.cells(table.lines[0])[1:4] == ["1.00 (below 2.00)", "1.00 (above 0.500)", shown]


def line(name, verdict, law="housner"):
    return Line("chance", name, "", (law, law), NONE, NONE, NONE, verdict)


CHANCE = Quantity("chance", "Chance that a piece falls in 50 years", "", 1.0, "1", chance=True)
KEPT = ANCHORED_IN["B"]


@pytest.mark.parametrize(
    ("verdicts", "said"),
    [
        ([KEPT] * 6 + [SAME] * 2, "6 pieces are anchored in B and cannot fall there; the other 2 are unchanged"),
        ([KEPT, LOWER], "1 piece is anchored in B and cannot fall there; the other one is lower in B, by more than"),
        ([KEPT] * 3, "3 pieces are anchored in B and cannot fall there"),
        ([KEPT, ANCHORED_IN["A"], ANCHORED_IN["both"], UNKNOWN], "in both and cannot fall; for the other 1, no"),
        ([LOWER, SAME, UNKNOWN], "1 of 3 differ by more than the choice of motions explains (1 lower in B); 1"),
    ],
)
def test_anchored_pieces_are_no_open_question(verdicts, said):
    lines = [line(str(i), verdict) for i, verdict in enumerate(verdicts)]
    text = answer(lines, CHANCE)
    assert said in text
    assert "too few motions" not in text


def test_laws_are_named():
    """Two laws of one piece are not two pieces."""
    both = [line("rack", verdict, law) for law, verdict in (("housner", LOWER), ("discrete", LOWER))]
    assert "under each of the 2 laws: lower in B" in answer(both, CHANCE)
    apart = [line("rack", verdict, law) for law, verdict in (("housner", LOWER), ("discrete", OPEN))]
    text = answer(apart, CHANCE)
    assert "under housner, lower in B" in text
    assert "under discrete, not resolved" in text


def test_the_legend_explains_what_occurs():
    said = reading([line("rack", KEPT), line("shelf", SAME)])
    assert "the piece is taken as one that cannot fall" in said
    assert "too few motions" not in said
    assert "too few motions" in reading([line("rack", UNKNOWN)])
