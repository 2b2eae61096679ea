"""Tables and facts of sensitivity studies: what is not possible has a mark, and both are over the same values."""

import math
import warnings

import numpy as np
import pytest
import xarray as xr

import toppling as tp
from toppling.models.friction import friction_at_impact
from toppling.studies.facts.answer_sensitivity import actions, answer
from toppling.studies.facts.say import say
from toppling.studies.tables.sensitivity import (
    ABOVE,
    SLIPS,
    SQUAT,
    block_levels,
    laws_apart,
    marks_of,
    median_ratios,
    own_restitution,
    swings_of,
)

SLENDER, SQUAT_BLOCK = tp.Block(0.4, 1.9, name="slender"), tp.Block(2.0, 1.0, name="squat")
VALUES = [0.5, 0.7, 0.9, 1.0]
SIZES = ("width", "height", "cm_height")
GIVEN = {"kind": "sensitivity", "friction": 1.0, "usual": "the usual ones", "reference": "rigid"}
MEDIANS = [[4.0, 3.0, 2.0, 1.0], [9.0, 8.0, 7.0, 6.0]]


def results_of(parameter="e", medians=MEDIANS, blocks=(SLENDER, SQUAT_BLOCK), axis="level"):
    """Results of a sensitivity study with given medians (block, value), under one law; levels up to 12 m/s²."""
    values, in_use = [0.001, 0.01, 0.1, 0.2], [[False, True, True, False]] * len(blocks)
    if parameter == "e":
        values, in_use = VALUES, [friction_at_impact(block.h / block.b, VALUES) <= 1.0 for block in blocks]
    shakes = {"units": "m s-2", "long_name": "peak ground acceleration", "im": "pga"}
    median = np.array(medians)[:, None]
    return xr.Dataset(
        {
            **dict.fromkeys(("half_level", "median"), (("block", "model", "value"), median)),
            "median_ratio": (("block", "model", "value", "comparison"), (median / 2.0)[..., None]),
        },
        {
            "block": [block.label for block in blocks],
            "model": ["housner e"],
            "law": ("model", ["housner"]),
            "value": values,
            "comparison": ["rigid"],
            "in_use": (("block", "value"), in_use),
            axis: ("level" if axis == "level" else "motion", [1.0, 12.0], shakes),
            **{name: ("block", [getattr(block, name) for block in blocks]) for name in SIZES},
            "inertia_factor": ("block", [block.inertia for block in blocks]),
        },
        {**GIVEN, "parameter": parameter},
    )


class TestMarks:
    def test_the_least_e_is_that_of_the_friction(self):
        """(h/b)(1 - e)/(1 + e) = 1 at e = (4.75 - 1)/(4.75 + 1) = 0.652."""
        assert marks_of(results_of())[0].tolist() == [SLIPS, "", "", ""]

    def test_of_a_squat_block(self):
        """e_R = 1 - 1.5 sin² α is not positive from α = 0.955 on; this block has α = 1.107."""
        found = results_of()
        assert marks_of(found)[1].tolist() == [SQUAT] * 4
        own = own_restitution(found)
        assert own[0] == pytest.approx(1.0 - 1.5 * math.sin(SLENDER.alpha) ** 2, rel=1e-12)
        assert np.isnan(own[1])

    def test_delta_is_possible_everywhere(self):
        found = results_of("delta")
        assert (marks_of(found) == "").all()
        assert own_restitution(found) is None


class TestTables:
    def test_levels(self):
        table = block_levels(results_of())
        assert [column.heading for column in table.columns] == ["e =", "its e_R", "0.5", "0.7", "0.9", "1"]
        slender, squat = ([*rows] for _, group in table.groups for rows in group)
        assert slender == ["slender", f"{SLENDER.restitution:.3f}", SLIPS, "0.31", "0.20", f"0.10\u00a0{ABOVE}"]
        assert squat == ["squat", "none", *[SQUAT] * 4]
        assert all(sum(note.startswith(f"{mark}: ") for note in table.notes) == 1 for mark in (SLIPS, SQUAT, ABOVE))

    def test_levels_over_delta_have_no_such_column(self):
        table = block_levels(results_of("delta"))
        assert [column.heading for column in table.columns] == ["δ =", "0.001", "0.01", "0.1", "0.2"]
        assert table.cells(table.lines[0]) == ["slender", "0.41", "0.31", "0.20", "0.10"]
        assert SLIPS not in table.note

    def test_ratios_are_marked_as_well(self):
        table = median_ratios(results_of())
        assert [*table.groups] == [
            ("slender", [["housner e", SLIPS, "1.50", "1.00", "0.50"]]),
            ("squat", [["housner e", *[SQUAT] * 4]]),
        ]
        assert "not possible" in table.note

    def test_a_ratio_without_a_curve_is_a_dash(self):
        table = median_ratios(results_of("delta", medians=[[4.0, np.nan, 2.0, 1.0], [1.0] * 4]))
        assert table.cells(table.lines[0]) == ["housner e", "2.00", "–", "1.00", "0.50"]
        assert f"–: {table.dash}." in table.note

    def test_blocks_of_the_catalogue_have_titles(self):
        blocks = tp.Block(0.4, 1.9, name="bookcase-5-shelf"), SQUAT_BLOCK
        found = results_of("delta", blocks=blocks)
        assert block_levels(found).texts("name")[0] == "Bookcase, 5 shelves"
        assert [heading for heading, _ in median_ratios(found).groups] == ["Bookcase, 5 shelves", "squat"]

    def test_what_is_not_reached(self):
        """Lead tables are of results whose medians above the levels are infinite."""
        table = block_levels(results_of(medians=[[4.0, np.inf, np.nan, 1.0], [1.0] * 4]))
        assert table.cells(table.lines[0])[2:] == [SLIPS, "not reached", "–", f"0.10\u00a0{ABOVE}"]


class TestAnswer:
    def test_over_the_whole_range_of_the_table(self):
        """Over δ all values count, also those that are not the usual ones; over e those that are possible."""
        assert swings_of(results_of("delta"), 0)[0] == ("slender", 0.001, 0.2, 4.0, 1.0)
        assert swings_of(results_of(), 0) == [("slender", 0.7, 1.0, 3.0, 1.0)]
        first = next(answer(results_of()))
        assert (first.names, first.value) == (("“slender”",), pytest.approx(3.0))
        assert (first.more["at"], first.more["over"], first.more["all"]) == ((0.7, 1.0), (0.7, 1.0), False)
        assert (first.lower, first.upper) == pytest.approx((3.0 / 9.80665, 1.0 / 9.80665))
        assert first.more["own"] == pytest.approx(SLENDER.restitution)
        assert "factor of 3.0" in say(first, "page")

    def test_a_factor_of_1_is_not_a_factor(self):
        for ratio in (1.04, 1.06):
            found = results_of("delta", medians=[[2.0, ratio * 2.0, 2.0, 2.0], [3.0] * 4])
            assert ("factor" in say(next(answer(found)), "page")) == (ratio == 1.06)

    def test_the_extremes_need_not_be_at_the_ends(self):
        found = results_of("delta", medians=[[2.0, 1.0, 5.0, 2.0], [3.0] * 4])
        assert swings_of(found, 0) == [("slender", 0.01, 0.1, 1.0, 5.0), ("squat", 0.001, 0.2, 3.0, 3.0)]

    def test_a_median_above_the_levels_does_not_count(self):
        found = results_of("delta", medians=[[20.0, 4.0, 2.0, 2.0], [30.0] * 4])
        found["half_level"] = found["half_level"].where(found["half_level"] <= 12.0, np.inf)
        assert swings_of(found, 0) == [("slender", 0.01, 0.1, 4.0, 2.0)]
        assert laws_apart(found) == [("Housner’s impacts", pytest.approx(math.sqrt(2.0)))]

    def test_a_squat_block_is_said(self):
        said = [(fact.what, fact.names) for fact in answer(results_of())]
        assert said[:2] == [("sensitivity.swing", ("“slender”",)), ("sensitivity.squat", ("“squat”",))]

    @pytest.mark.parametrize(("parameter", "factor"), [("e", 3.0), ("delta", 4.0)])
    def test_how_the_parameter_can_be_made_certain(self, parameter, factor):
        """On an unloaded sample: nobody tilts loaded furniture to measure something."""
        fact = next(actions(results_of(parameter)))
        assert (fact.what, fact.value) == (f"sensitivity.{parameter}_matters", factor)
        assert ("measured on an unloaded sample" in say(fact, "page")) == (parameter == "e")

    @pytest.mark.parametrize("axis", ["level", "intensity"])
    def test_without_a_median_or_levels_nothing_warns(self, axis):
        found = results_of(medians=np.full((2, 4), np.nan), axis=axis)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            assert swings_of(found, 0) == []
            assert laws_apart(found) == []
            assert [block_levels(found).texts(f"{value:g}")[0] for value in VALUES[1:3]] == ["–", "–"]
            assert [fact.what for fact in answer(found)] == ["sensitivity.squat"]
