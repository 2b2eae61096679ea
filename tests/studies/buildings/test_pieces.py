"""Pieces one by one: chances, levels and paybacks by hand, recommendations, orders, and files for spreadsheets."""

import csv
import io
import json
import math
import re
import zipfile

import numpy as np
import openpyxl
import pytest
import xarray as xr
from assessed import assess
from study_texts import HAZARD, crate_study, study_in

import toppling as tp
from toppling.studies.buildings.assessment import Assessment
from toppling.studies.buildings.pieces import SORTS, budget_set, pieces_of
from toppling.studies.buildings.recommendations import (
    ANCHORED,
    DUTY,
    FEW_UNSTATED,
    OUTSIDE,
    PREVENTS,
    REDUCES,
    SAFER,
    SAVES,
    SMALL,
    UNPRICED,
    UNRESOLVED,
    UNSTATED,
    UNVALUED,
    WEAK,
    WORTH,
)
from toppling.studies.command import piece_files
from toppling.studies.command.cli import main
from toppling.studies.facts.answer_building import _afterwards, actions
from toppling.studies.inventory.contents import Contents, Inventory
from toppling.studies.store.content import AS_WRITTEN
from toppling.studies.tables.files import cells
from toppling.studies.tables.inputs import anchoring
from toppling.studies.tables.pieces import codes, danger, exported_pieces, pieces, worth
from toppling.studies.tables.registry import REGISTRY

SHELF = tp.catalogue["bookcase-5-shelf"]
LEVELS = np.array([1.0, 2.0, 4.0, 8.0])
# item: annual rate of a piece (and the ends of its interval), number of pieces, value, cost, consequences, anchored
LINES = {
    "rack": ((0.002, 0.0015, 0.0025), 2, 30_000.0, 200.0, "", False),
    "shelf": ((0.01, 0.008, 0.012), 4, 100.0, 500.0, "injury", False),
    "crate": ((0.001, 0.0008, 0.0012), 1, 10.0, 20.0, "blocks-exit | dirt", False),
    "vase": ((0.004, 0.001, 0.007), 1, 2300.0, 200.0, "", False),
    "cheap": ((0.004, 0.003, 0.005), 1, 1.0, 200.0, "", False),
    "unpriced": ((0.004, 0.003, 0.005), 1, 1000.0, math.nan, "", False),
    "never": ((0.0, math.nan, math.nan), 1, 1000.0, 10.0, "injury", False),
    "held": ((0.0, math.nan, math.nan), 3, 50_000.0, 10.0, "injury", True),
    "worthless": ((1e-9, 1e-9, 1e-9), 1, 0.0, 10.0, "", False),
}


def results(lines=LINES, **attributes):
    """Results as a performance study with a hazard writes them, of these lines."""
    rates, number, value, cost, words, held = (np.array(column) for column in zip(*lines.values(), strict=True))
    observed = np.where(rates[:, :1] > 0.0, [[0.0, 0.2, 0.1, 1.0]], 0.0)
    return xr.Dataset(
        {
            "probability": (("model", "block", "level"), observed[None]),
            **{f"rate{end}": (("model", "block"), rates[None, :, i]) for i, end in enumerate(("", "_lower", "_upper"))},
            "level_weight": ("level", [0.02, 0.004, 0.001, 0.0005]),
            "level_weight_above": ((), 0.0001),
            "scale": ("motion", np.ones(40)),
        },
        {
            "block": [*lines],
            "room": ("block", ["hall"] * len(lines)),
            "floor": ("block", [str(i) for i in range(len(lines))]),
            "count": ("block", number),
            "anchored": ("block", held),
            "value": ("block", value),
            "anchoring_cost": ("block", cost),
            "consequences": ("block", words),
            "level": ("level", LEVELS, {"units": "m s-2", "long_name": "peak ground acceleration"}),
            "model": ["one law"],
        },
        {"im": "pga", "currency": "EUR", "confidence": 0.95, **attributes},
    )


def advice(found):
    """The actions that follow from results, and what anchoring changes, by their names."""
    return {fact.what: fact for fact in [*actions(found), *_afterwards(found, math.nan)]}


class TestRecommendations:
    def test_safety_ranks_before_money(self):
        """The shelf never pays back and stays first; the rack pays back in 4 years and comes after all safety."""
        found = {one.item: one for one in pieces_of(results())}
        words = {name: one.recommendation for name, one in found.items()}
        assert words == {
            "shelf": REDUCES,  # 0.04 of the 0.041 falls a year that matter
            "crate": SAFER,  # whatever it saves: 0.6 EUR in 50 years, for 20
            "never": UNRESOLVED,
            "rack": WORTH,  # 50 years at the lower end, worth 21.5 years today: 1900 EUR, for 400
            "vase": UNRESOLVED,  # 49 to 350 EUR, for 200
            "cheap": UNSTATED,
            "unpriced": UNPRICED,
            "worthless": UNVALUED,
            "held": ANCHORED,
        }
        order = [*found]
        assert max(order.index(name) for name in ("shelf", "crate", "never")) < order.index("rack")
        assert order[0] == "shelf"
        assert order[-1] == "held"
        assert found["shelf"].payback == math.inf  # 80 EUR of interest a year, for 4
        assert found["rack"].payback == pytest.approx(-math.log(1.0 - 0.04 * 400.0 / 120.0) / math.log(1.04))
        assert tuple(found["rack"].saving) == pytest.approx((120.0, 90.0, 150.0))
        assert math.isnan(found["unpriced"].payback)

    def test_a_hazardous_substance_is_a_matter_of_safety(self):
        """A cabinet that may release its contents stands before one that is worth ten times its cost."""
        lines = {
            "rack": LINES["rack"],
            "solvents": ((0.001, 0.0008, 0.0012), 1, 1900.0, 70.0, "release", False),
        }
        found = pieces_of(results(lines))
        assert [one.item for one in found] == ["solvents", "rack"]
        assert found[0].safety
        assert advice(results(lines))["anchoring.lines"].names == ("“solvents” (floor 1)", "“rack” (ground)")
        table = anchoring(results(lines))
        *cells, consequence = table.cells(table.rows[0])[:4]
        assert cells == ["solvents", "1", "1"]
        assert "hazardous" in consequence

    def test_injuries_rank_safety_where_all_have_them(self):
        """Ten shelves fall far more often than the cabinet, beside which ten times as many persons stand."""
        lines = {
            "shelves": ((0.01, 0.008, 0.012), 10, 100.0, 10.0, "injury", False),
            "cabinet": ((0.001, 0.0008, 0.0012), 1, 100.0, 10.0, "injury", False),
        }
        given = results(lines)
        assert [one.item for one in pieces_of(given)] == ["shelves", "cabinet"]
        injured = np.array([[0.001, 0.01]])
        for end in ("", "_lower", "_upper"):
            given[f"block_annual_injuries{end}"] = (("model", "block"), injured)
        found = pieces_of(given)
        assert [one.item for one in found] == ["cabinet", "shelves"]
        assert [one.recommendation for one in found] == [REDUCES, SAFER]
        assert budget_set(given, 10.0).chosen.tolist() == [False, True]
        # (one of them without persons beside it: the number of injuries of the other says nothing of their order)
        given["block_annual_injuries"] = (("model", "block"), injured * [0.0, 1.0])
        assert [one.item for one in pieces_of(given)] == ["shelves", "cabinet"]

    def test_what_stands_on_a_piece_is_lost_with_it(self):
        """Three pedestals of 200 EUR carry vases of 25,000: a fall loses both, and anchoring saves both."""
        lines = {
            "pedestal": ((1e-4, 0.8e-4, 1.2e-4), 3, 200.0, 30.0, "none", False),
            "vase": ((2e-4, 1e-4, 3e-4), 3, 25_000.0, 120.0, "", True),
        }
        alone = {one.item: one for one in pieces_of(results(lines))}
        found = {
            one.item: one for one in pieces_of(results(lines).assign_coords(stands_on=("block", ["", "pedestal"])))
        }
        assert alone["pedestal"].saving.value == pytest.approx(3 * 200.0 * 1e-4)
        assert found["pedestal"].saving.value == pytest.approx(3 * 25_200.0 * 1e-4)
        assert found["pedestal"].payback == pytest.approx(-math.log(1.0 - 0.04 * 30.0 / 2.52) / math.log(1.04))
        assert (alone["pedestal"].recommendation, found["pedestal"].recommendation) == (SMALL, WORTH)
        assert found["vase"] == alone["vase"]

    def test_squat_pieces_have_no_advice_on_money(self):
        """Of the rack, which is worth its cost, nothing is advised where its mass centre is 1.9 half widths high."""
        alpha = np.where(np.array([*LINES]) == "rack", math.atan(1.0 / 1.9), math.atan(1.0 / 2.1))
        found = {one.item: one for one in pieces_of(results().assign_coords(alpha=("block", alpha)))}
        assert found["rack"].recommendation == OUTSIDE
        assert math.isnan(found["rack"].payback)
        assert {name for name, one in found.items() if one.doubt} == {"rack"}
        squat = results(kind="performance").assign_coords(alpha=("block", alpha), law=("model", ["housner"]))
        said = advice(squat)
        assert said["anchoring.outside"].names == ("“rack” (ground)",)
        assert said["anchoring.lines"].names == ("“shelf” (floor 1)", "“crate” (floor 2)")
        assert "rack" not in squat["block"].values[budget_set(squat, 5000.0).chosen]

    def test_other_words_are_a_matter_of_safety(self):
        found = {one.item: one for one in pieces_of(results(safety="dirt"))}
        assert [name for name, one in found.items() if one.safety] == ["crate"]
        assert next(iter(found)) == "crate"
        assert found["crate"].recommendation == REDUCES

    def test_money_decides_where_nothing_is_a_matter_of_safety(self):
        """A single piece that pays back after 19,000 years is not to be anchored first."""
        found = pieces_of(results(safety="nothing"))
        assert found[0].item == "rack"
        assert {one.item: one.recommendation for one in found if one.item in ("rack", "shelf")} == {
            "rack": WORTH,
            "shelf": SMALL,
        }
        (one,) = pieces_of(results({"rack": ((1e-5, 0.8e-5, 1.2e-5), 1, 26_000.0, 5000.0, "none", False)}))
        assert one.recommendation == SMALL
        assert one.payback == math.inf

    def test_without_a_hazard_the_loss_at_the_level_decides(self):
        """One vase of a million before a hundred crates of one; nothing is said of costs."""
        yearly = results({
            "crates": ((0.0, 0.0, 0.0), 100, 1.0, 1.0, "none", False),
            "vase": ((0.0, 0.0, 0.0), 1, 1e6, 1.0, "", False),
            "never": ((0.0, 0.0, 0.0), 1, 1e6, 1.0, "", False),
        })  # fmt: skip
        given = yearly.drop_vars([name for name in yearly.data_vars if "rate" in name])
        chances = np.repeat([[0.6], [0.5], [0.0]], 4, axis=1)[None]
        for end in ("", "_lower", "_upper"):
            given[f"probability{end}"] = (("model", "block", "level"), chances)
        given = given.assign_attrs(at_level=2.0)
        assert {one.item: one.recommendation for one in pieces_of(given)} == {
            "vase": REDUCES,
            "crates": SMALL,
            "never": UNRESOLVED,
        }
        table = pieces(given)
        assert "= 0.204 g." in table.note
        assert "falls, each" in [column.title for column in table.columns]
        heading, *_ = cells(exported_pieces(given))
        assert "probability_at_level (1)" in heading
        assert "level (m s-2)" in heading
        assert not any("chance" in one for one in heading)

    def test_falls_decide_where_nothing_has_a_value(self):
        lines = {name: (*one[:2], 0.0, math.nan, "", False) for name, one in LINES.items()}
        found = pieces_of(results(lines))
        # 0.04, four times 0.004 and 0.001 falls a year, 0.057 in all: four fifths are 0.0456
        assert {one.item for one in found if one.recommendation == REDUCES} == {"shelf", "rack", "vase"}
        assert {one.recommendation for one in found if one.item in ("cheap", "unpriced", "crate")} == {FEW_UNSTATED}

    @pytest.mark.parametrize(("value", "word"), [(5000.0, SAVES), (0.0, PREVENTS)])
    def test_money_is_never_the_greatest_risk_beside_people(self, value, word):
        """An archive that loses far more than a shelf over people comes after the shelf, and is named after it."""
        found = results({
            "archive": ((0.01, 0.008, 0.012), 20, value, math.nan, "", False),
            "shelf": ((0.001, 0.0008, 0.0012), 1, min(value, 10.0), math.nan, "injury", False),
            "stool": ((0.0001, 0.0, 0.0002), 1, min(value, 10.0), math.nan, "none", False),
        }, kind="performance").drop_vars([f"rate{end}" for end in ("", "_lower", "_upper")])  # fmt: skip
        chances = np.repeat([[0.6], [0.1], [0.01]], 4, axis=1)[None]
        for end in ("", "_lower", "_upper"):
            found[f"probability{end}"] = (("model", "block", "level"), chances)
        found = found.assign_attrs(at_level=2.0).assign_coords(law=("model", ["housner"]))
        assert [(one.item, one.recommendation) for one in pieces_of(found)] == [
            ("shelf", REDUCES),
            ("archive", word),
            ("stool", SMALL),
        ]
        said = advice(found)
        assert said["anchoring.lines"].names == ("“shelf” (floor 1)", "“archive” (ground)")
        assert (said["anchoring.lines"].more["number"], said["anchoring.after"].more["share_safe"]) == (21, 1.0)
        alone = found.assign_coords(consequences=("block", ["none", "none", "none"]))
        assert {one.recommendation for one in pieces_of(alone)} == {REDUCES, SMALL}
        assert advice(alone)["anchoring.lines"].names == ("“archive” (ground)",)
        assert "anchoring.after" not in advice(alone)

    def test_lines_that_are_anchored_are_said(self):
        mixed = results(kind="performance").assign_coords(law=("model", ["housner"]))
        inspect = advice(mixed)["anchoring.inspect"]
        assert (inspect.value, inspect.names) == (3, ("“held” (floor 7)",))
        all_held = mixed.assign_coords(anchored=("block", np.ones(len(LINES), bool)))
        all_held = all_held.assign(budget_chosen=(("model", "block"), np.zeros((1, len(LINES)), bool)))
        all_held = all_held.assign(budget_gap=("model", [0.0])).assign_attrs(budget=100.0)
        said = advice(all_held)
        assert {*said} == {"anchoring.inspect", "anchoring.all_anchored", "code.not_checked"}
        assert said["anchoring.inspect"].value == all_held["count"].sum()

    def test_levels_by_hand(self):
        """Observed 0, 0.2, 0.1 and 1: isotonic 0, 0.15, 0.15 and 1, straight in the logarithm of the level."""
        one = pieces_of(results())[0]
        assert one.levels[0] == pytest.approx(2.0 ** (0.1 / 0.15))
        assert one.levels[1] == pytest.approx(4.0 * 2.0 ** (0.35 / 0.85))
        never = next(one for one in pieces_of(results()) if one.item == "never")
        assert never.levels == (math.inf, math.inf)

    @pytest.mark.parametrize("by", SORTS)
    def test_orders(self, by):
        found = pieces_of(results(sort=by))
        assert sorted(one.item for one in found) == sorted(LINES)
        keys = {
            "chance": lambda one: -one.chance.value,
            "loss": lambda one: -one.saving.value,
            "payback": lambda one: one.payback,
            "value": lambda one: -one.value,
            "cost": lambda one: one.cost,
            "floor": lambda one: one.floor,
            "item": lambda one: one.item,
        }
        if by in keys:
            free = [
                keys[by](one) for one in found if one.recommendation != ANCHORED or by in ("value", "floor", "item")
            ]
            numbers = [one for one in free if not (isinstance(one, float) and math.isnan(one))]
            assert numbers == sorted(numbers)
            assert free[: len(numbers)] == numbers


CHECKS = {
    "rack": ("required", 0.9),
    "shelf": ("exempt", math.nan),
    "crate": ("not checked", math.nan),
    "held": ("required", 1.2),
}


def with_code(found):
    """Results of a study that names a code, which says this of the lines (the others are exempt)."""
    of = [CHECKS.get(str(item), ("exempt", math.nan)) for item in found["block"].values]
    columns = {
        "status": [status for status, _ in of],
        "clause": ["4.3.5"] * len(of),
        "factors": [""] * len(of),
        "coefficient": [0.4 if status == "required" else math.nan for status, _ in of],
        "force": [400.0 if status == "required" else math.nan for status, _ in of],
        "demand": [250.0 if status == "required" else math.nan for status, _ in of],
        "ratio": [ratio for _, ratio in of],
    }
    code = {f"code_{name}": ("block", values) for name, values in columns.items()}
    return found.assign(code).assign_attrs(code="EN 1998-1, 4.3.5", code_site="a_g = 0.2 g, S = 1.2")


class TestCode:
    def test_duties_come_first_whatever_the_risk(self):
        found = pieces_of(with_code(results()))
        assert [(one.item, one.recommendation) for one in found[:3]] == [
            ("held", WEAK),
            ("rack", DUTY),
            ("shelf", REDUCES),
        ]
        held = next(row for row in pieces(with_code(results())).lines if row["item"] == "held")
        assert held["chance"] is None  # (it falls no more as long as its anchors hold)

    def test_tables(self):
        given = with_code(results())
        forces = codes(given)
        texts = {row["item"]: forces.cells(row)[1:] for row in forces.lines}
        assert texts["rack"] == ["required", "4.3.5", "0.400", "400", "250", "0.90"]
        assert texts["held"][-1] == "1.2"
        assert not REGISTRY["codes"].applies(results())
        heading, *rows = cells(exported_pieces(given))
        values = {row[0]: dict(zip(heading, row, strict=True)) for row in rows}
        assert values["rack"]["code_force (N)"] == 400.0
        assert values["held"]["code_demand_over_strength (1)"] == 1.2
        assert not any("code" in heading for heading in cells(exported_pieces(results()))[0])

    def test_chances_and_values_are_two_tables(self):
        first, second = danger(results()), worth(results())
        keys = [{column.key for column in table.columns} for table in (first, second)]
        assert keys[0] | keys[1] == {column.key for column in pieces(results()).columns}
        assert keys[0] & keys[1] == {"item"}
        assert first.column("item")[: len(second.lines)] == second.column("item")


class TestBudget:
    def test_law_before_safety_before_money(self):
        """The rack (400, required), the shelves (2,000) and the crate (20); the vase saves no more than its 200."""
        given = with_code(results())
        items = given["block"].values
        assert [*items[budget_set(given, 2650.0).chosen]] == ["rack", "shelf", "crate"]
        assert [*items[budget_set(given, 2450.0).chosen]] == ["rack", "shelf", "crate"]
        assert [*items[budget_set(given, 399.0).chosen]] == ["crate"]
        dear = results({**LINES, "vase": ((0.004, 0.001, 0.007), 1, 2400.0, 200.0, "", False)})
        chosen = budget_set(dear, 2650.0).chosen
        assert "vase" in items[chosen]  # (206 in 50 years, 52 to 360)
        dear = dear.assign(budget_chosen=(("model", "block"), chosen[None]), budget_gap=("model", [0.0]))
        dear = dear.assign_attrs(budget=2650.0, kind="performance").assign_coords(law=("model", ["housner"]))
        said = advice(dear)
        lines = "“shelf” (floor 1)", "“crate” (floor 2)", "“rack” (ground)", "“vase” (floor 3)"
        assert said["anchoring.lines"].names == lines
        assert (said["anchoring.lines"].more["budget"], said["anchoring.after"].more["cost"]) == (2650.0, 2620.0)
        assert said["anchoring.unresolved"].names == ("“vase” (floor 3)",)
        assert said["anchoring.never_seen"].names == ("“never” (floor 6)",)
        # without a code the rack waits for the shelves, and pays best after them
        assert [*items[budget_set(results(), 2100.0).chosen]] == ["shelf", "crate"]
        assert [*items[budget_set(results(), 2420.0).chosen]] == ["rack", "shelf", "crate"]

    def test_a_budget_for_kits_is_not_of_the_recommended_lines(self):
        """Without costs of anchoring the budget buys kits alone: these lines may cost more."""
        given = results(budget=2650.0, kind="performance").assign_coords(law=("model", ["housner"]))
        assert math.isnan(advice(given)["anchoring.lines"].more["budget"])
        assert "Budget" not in anchoring(given).note

    def test_the_table_marks_them(self):
        given = results()
        chosen = budget_set(given, 2420.0).chosen
        given = given.assign(budget_chosen=(("model", "block"), chosen[None])).assign_attrs(budget=2420.0)
        table = anchoring(given)
        assert sorted(table.column("item")[:-1]) == ["crate", "rack", "shelf"]
        assert "2,420 EUR" in table.note
        values = {row["item"]: row for row in exported_pieces(given).lines}
        assert values["rack"]["within_budget"] == "yes"
        assert values["vase"]["within_budget"] == "no"


class TestTables:
    @pytest.mark.parametrize("sort", ["recommendation", "floor"])
    def test_the_figure_of_anchoring_is_in_the_order_of_the_advice(self, sort):
        """Safety comes before money there, too, though anchoring the rack saves most; what is held has no bar."""
        saving = np.array([math.nan if held else rate[0] * n * worth for rate, n, worth, *_, held in LINES.values()])
        units = {"units": "EUR year-1"}
        ranked = {f"ranked_saving{end}": (("model", "block"), saving[None], units) for end in ("", "_lower", "_upper")}
        ranked["ranked_alone"] = ranked["ranked_saving"]
        ranked["ranked_rank"] = (
            ("model", "block"),
            np.where(np.isnan(saving), np.nan, (-saving).argsort().argsort())[None],
        )
        about = {"confidence": 0.95, "objective_text": "expected annual value overturned", "per_cost": 0}
        found = results(sort=sort, ranking=json.dumps(about)).assign(ranked).assign_coords(place=["building"])
        order = [label.get_text() for label in tp.plot.inventory(found, view="anchoring").get_yticklabels()]
        advised = [one.item for one in pieces_of(results()) if not one.held]
        assert advised[0] != "rack"
        assert [name.split()[0] for name in order] == advised

    def test_rows(self):
        table = pieces(results())
        assert "95 % intervals" in table.notes[0]
        assert "at 4 %" in table.note
        assert [column.key for column in table.columns][:5] == ["item", "room", "floor", "pieces", "chance"]
        texts = {row["item"]: dict(zip((column.key for column in table.columns), table.cells(row), strict=True))
                 for row in table.lines}  # fmt: skip
        assert texts["rack"]["chance"] == "9.5\u00a0% (7.2–12)"
        assert texts["never"]["chance"].startswith("at most 11")  # 3.84/43.84 of 0.0254 a year, all beyond
        assert texts["never"]["level"] == "not reached"
        unseen = 3.8415 / 43.8415 * 0.0254 + 0.0001  # (of 1,000 EUR)
        assert texts["never"]["saves"] == f"at most {1000.0 * unseen:.3g}"
        assert texts["held"]["chance"] == "–"
        assert texts["shelf"]["recommendation"] == REDUCES

    def test_values(self):
        heading, *lines = cells(exported_pieces(results()))
        rows = {row[0]: dict(zip(heading, row, strict=True)) for row in lines}
        assert rows["rack"]["chance_in_50_years (1)"] == pytest.approx(1.0 - math.exp(-0.1))
        assert rows["rack"]["saving_a_year (EUR/year)"] == pytest.approx(120.0)
        assert rows["never"]["level_at_10_percent (m s-2)"] is None
        assert rows["never"]["chance_in_a_year (1)"] is None
        assert rows["never"]["saving_a_year (EUR/year)"] is None
        assert rows["never"]["saving_a_year_upper (EUR/year)"] == pytest.approx(
            1000.0 * -math.log1p(-rows["never"]["chance_in_a_year_upper (1)"])
        )
        assert rows["unpriced"]["anchoring_cost (EUR)"] is None
        assert not any("probability_at_level" in name for name in heading)


def test_a_rate_is_that_of_the_piece_s_own_curve():
    """The rate of the lognormal curve fitted to the same flags, to within what the fit and 24 motions leave open."""
    hazard = tp.HazardCurve(np.geomspace(0.2, 20.0, 12), 0.02 * np.geomspace(0.2, 20.0, 12) ** -1.8, "pga")
    frame = tp.motions.Building.flexural_shear(0.5, storeys=2)
    ground = tp.motions.CloughPenzien(duration=10.0, dt=0.01, s0=0.05).sample(24, seed=2)
    ground = tp.motions.pad(ground, 0.0, 5.0)
    inventory = Inventory((Contents("shelf", SHELF, 2, 3),))
    found = assess(
        inventory, Assessment(tp.EnergyConsistent(), ground, np.geomspace(0.8, 12.0, 15), "pga", frame, hazard)
    )
    flags = found[["overturned"]].rename(block="block").drop_vars("floor").assign_attrs(found.attrs)
    own = tp.annual_rate(tp.fit_fragility(flags, replicates=200), hazard)["rate"].item()
    assert found["rate"].item() == pytest.approx(own, rel=0.03)
    assert found["rate_lower"].item() < own < found["rate_upper"].item()


class TestFiles:
    @pytest.fixture
    def folder(self, tmp_path, monkeypatch):
        lines = {"=1+1": LINES["rack"], **LINES}
        plain = results(lines, title="=danger", kind="performance").assign_coords(law=("model", ["housner"]))

        class Opened:
            def __enter__(self):
                return plain

            def __exit__(self, *_):
                return None

        monkeypatch.setattr(piece_files, "read_results", lambda path: Opened())
        monkeypatch.setattr(piece_files, "check_content", lambda *_: AS_WRITTEN)
        return tmp_path

    def test_csv(self, folder):
        path = piece_files.write_pieces(folder / "results.nc", folder / "export", "csv")
        rows = [*csv.DictReader(io.StringIO(path.read_text(encoding="utf-8")))]
        assert {row["item"] for row in rows} == {"'=1+1", *LINES}
        rack = next(row for row in rows if row["item"] == "rack")
        assert float(rack["payback (years)"]) == pytest.approx(-math.log(1.0 - 16.0 / 120.0) / math.log(1.04))
        assert rack["recommendation"] == WORTH
        assert rack["damping_law"] == "one law"

    def test_amounts_that_are_not_stated_are_not_zero(self):
        """The rack states no downtime, the crate no persons, and what never fell may fall: none of them is 0."""
        given = results()
        for name, stated, missing in (
            ("downtime", "downtime_median", "rack"),
            ("injuries", "persons_exposed", "crate"),
        ):
            amounts = given["rate"].where(given["block"] != missing, 0.0) * 0.5
            given[f"block_annual_{name}"] = amounts
            ends = amounts.where(amounts > 0.0)
            given = given.assign({f"block_annual_{name}{end}": ends for end in ("_lower", "_upper")})
            given = given.assign_coords({stated: ("block", np.where(given["block"].values == missing, np.nan, 0.5))})
        heading, *rows = cells(exported_pieces(given))
        found = {row[0]: dict(zip(heading, row, strict=True)) for row in rows}
        downtime, injured = "downtime_of_one_a_year (days/year)", "injured_a_year (1/year)"
        assert found["shelf"][downtime] == found["shelf"][injured] == pytest.approx(0.005)
        assert (found["rack"][downtime], found["rack"][injured]) == (None, pytest.approx(0.001))
        assert (found["crate"][downtime], found["crate"][injured]) == (pytest.approx(0.0005), None)
        assert (found["never"][downtime], found["never"][injured]) == (None, None)
        assert found["held"][downtime] == 0.0

    def test_xlsx(self, folder):
        path = piece_files.write_pieces(folder / "results.nc", folder / "export", "xlsx")
        with zipfile.ZipFile(path) as parts:  # (nothing of it is of the clock)
            assert {one.date_time[:3] for one in parts.infolist()} == {(1980, 1, 1)}
            assert {*re.findall(rb"\d{4}-\d\d-\d\dT", parts.read("docProps/core.xml"))} == {b"1980-01-01T"}
        book = openpyxl.load_workbook(path)
        heading, *rows = book["pieces"].iter_rows(values_only=True)
        assert book["pieces"].cell(2, 1 + heading.index("chance_in_50_years")).number_format.endswith("%")
        found = {row[0]: dict(zip(heading, row, strict=True)) for row in rows}
        assert {*found} == {"=1+1", *LINES}
        assert found["rack"]["payback (years)"] == pytest.approx(-math.log(1.0 - 16.0 / 120.0) / math.log(1.04))
        assert found["never"]["level_at_50_percent (g)"] is None
        assert not any(cell.data_type == "f" for sheet in book for row in sheet.iter_rows() for cell in row)
        about = {row[0]: row[1] for row in book["about"].iter_rows(values_only=True)}
        assert about["damping law"] == "one law"
        assert about["code requirements"] == "not checked"


def test_curves_have_no_workbook(tmp_path, capsys):
    study_in(tmp_path, crate_study("Curves", 3, 6, 0.02, 3)).run(tmp_path / "out")
    assert main(["export", str(tmp_path / "out"), "--format", "xlsx"]) == 2
    assert re.search(r"--format xlsx .*\[hazard\]", capsys.readouterr().err)


@pytest.mark.slow
def test_rates_of_blocks_as_a_workbook(tmp_path):
    """Every block under every law: rate, chances, and the levels at which a tenth and a half fall."""
    text = crate_study("Curves", 8, 6, 0.02, 6) + HAZARD
    found = study_in(tmp_path, text).run(tmp_path / "out")
    assert main(["export", str(tmp_path / "out"), "--format", "xlsx"]) == 0
    book = openpyxl.load_workbook(tmp_path / "out" / "export" / "rates.xlsx")
    heading, *rows = book["rates"].iter_rows(values_only=True)
    assert [row[:3] for row in rows] == [
        (block, None, law) for block in found["block"].values for law in found["model"].values
    ]
    first = dict(zip(heading, rows[0], strict=True))
    rate = float(found["rate"][0, 0])
    assert first["rate (year-1)"] == pytest.approx(rate)
    assert first["chance_in_a_year (1)"] == pytest.approx(-math.expm1(-rate))
    assert first["chance_in_50_years_upper (1)"] == pytest.approx(-math.expm1(-50.0 * float(found["rate_upper"][0, 0])))
    assert first["level_at_50_percent (m s-2)"] == pytest.approx(float(found["half_level"][0, 0]))
    assert first["level_at_10_percent (m s-2)"] == pytest.approx(float(found["fraction_level"][0, 0, 0]))
    assert main(["export", str(tmp_path / "out"), "--format", "xlsx", "--model", "housner"]) == 0
    book = openpyxl.load_workbook(tmp_path / "out" / "export" / "rates.xlsx")
    assert {row[2] for row in [*book["rates"].iter_rows(values_only=True)][1:]} == {"housner e=e_R"}
