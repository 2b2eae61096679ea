"""Inventories with friction, edges, castors and pedestals as studies: what is said of them, tables, files, refusals."""

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from check_facts import check as check_of, facts_of

import toppling as tp
from toppling.core.facts import Fact, facts_in
from toppling.studies.buildings.pieces import pieces_of
from toppling.studies.facts import building
from toppling.studies.facts.checks import checks_of
from toppling.studies.facts.method import inputs_of, method_of
from toppling.studies.facts.notes import notes_of
from toppling.studies.tables.pieces import exported_pieces, pieces
from toppling.studies.tables.registry import tables
from toppling.studies.tables.slides import NOT_MODELLED, item_slides

EXAMPLES = Path(tp.__file__).parent / "studies" / "examples"


def study(folder, name, *changes):
    for path in EXAMPLES.glob(f"{name}.*"):
        shutil.copy(path, folder)
    text = (folder / f"{name}.toml").read_text(encoding="utf-8")
    for pattern, other in ((r"number = \d+\nseed", "number = 12\ndt_s = 0.02\nseed"), *changes):
        text, found = re.subn(pattern, other, text)
        assert found, pattern
    (folder / f"{name}.toml").write_text(text, encoding="utf-8")
    return tp.Study.from_toml(folder / f"{name}.toml")


@pytest.fixture(scope="module")
def laboratory(tmp_path_factory):
    return study(tmp_path_factory.mktemp("laboratory"), "laboratory").run()


@pytest.fixture(scope="module")
def gallery(tmp_path_factory):
    return study(tmp_path_factory.mktemp("gallery"), "gallery").run()


def notes_by_name(results):
    return {fact.what: fact for fact in notes_of(results)}


class TestLaboratory:
    @pytest.mark.slow
    def test_what_rolls_and_what_is_locked_is_said_line_by_line(self, laboratory):
        notes = notes_by_name(laboratory)
        assert notes["support.rolls"].names == ("instrument trolley",)
        assert notes["support.brakes_assumed"].names == ("ultra-low freezer", "server rack")
        table = item_slides(laboratory)
        (trolley,) = (row for row in table.lines if row["item"] == "instrument trolley")
        assert table.cells(trolley)[2:4] == ["castors", NOT_MODELLED]
        assert {*table.cells(trolley)[4:]} == {"–"}
        assert "Castors locked" in table.note
        castors = {fact.what: fact.more for fact in checks_of(laboratory) if fact.what.startswith("support.castors")}
        assert castors == {
            "support.castors": {"number": 3, "pieces": 32},
            "support.castors_locked": {"number": 4, "pieces": 32},
        }

    def test_a_friction_without_dispersion_is_said(self, laboratory):
        """The two lines on locked castors have a coefficient without dispersion; the trolley rolls."""
        assert notes_by_name(laboratory)["friction.exact"].names == ("ultra-low freezer", "server rack")
        assert facts_of(method_of, laboratory)["friction.exact"].names == ("ultra-low freezer", "server rack")

    def test_nothing_says_that_sliding_is_not_modelled(self, laboratory):
        last = facts_in(laboratory.attrs["notes"])[-1]
        assert last == Fact("validity.not_modelled", more={"vertical": False, "slides": True})
        assert facts_of(method_of, laboratory)["block.model"].more["slides"]
        assert check_of(laboratory, "sliding").remedy == "remedy_sliding_table"

    def test_safety_is_ranked_by_injuries(self, laboratory):
        safe = [one for one in pieces_of(laboratory) if one.safety]
        assert all(b.injuries.value <= a.injuries.value for a, b in zip(safe, safe[1:], strict=False))

    def test_downtime_is_said_of_an_earthquake(self, laboratory):
        """Days of downtime a year over the rate of any fall: the mean of the longest downtime when anything falls."""
        whole = laboratory.isel(model=0).sel(place="building")
        days = float(whole["annual_downtime"] / whole["any_rate"])
        downtime = facts_of(building.details, laboratory)["consequence.downtime"]
        assert downtime.more["each"] == pytest.approx(days)
        assert downtime.value == float(whole["annual_downtime"])

    def test_pieces_on_the_roof_are_named(self, laboratory):
        assert "floor.roof" not in facts_of(inputs_of, laboratory)
        file = json.loads(laboratory.attrs["study"])
        file["building"]["storeys"] = 3
        lower = laboratory.assign_attrs(study=json.dumps(file))
        roof = facts_of(inputs_of, lower)["floor.roof"]
        assert (roof.value, roof.names[:3]) == (3, ("server rack", "standing cabinet", "bench analyser"))
        floors = {row["item"]: row["floor"] for row in pieces(lower).rows}
        assert (floors["server rack"], floors["bookcase"]) == ("3 (roof)", "1")

    def test_lines_have_their_own_friction_or_that_of_the_study(self, laboratory):
        friction = dict(zip(laboratory["item"].values, laboratory["friction"].values, strict=True))
        assert friction["bookcase"] == pytest.approx(0.55)  # (carpet)
        assert friction["ultra-low freezer"] == 0.5
        assert friction["standing cabinet"] == pytest.approx(0.35)  # (the study's)
        assert np.isnan(friction["instrument trolley"])

    def test_the_bench_is_among_what_falls(self, laboratory):
        one = laboratory.sel(item="microscope").isel(model=0)
        assert float(one["item_rate"]) >= float(one["item_overturning_rate"])
        assert float(one["item_rate"]) >= float(one["item_off_rate"]) > 0.0
        table = item_slides(laboratory)
        off = dict(zip(table.column("item"), table.texts("off"), strict=True))
        assert sum(cell != "–" for cell in off.values()) == 3
        assert off["microscope"] != "–"
        assert next(building.answer(laboratory)).more["edges"]
        assert "sliding.upper_estimate" in facts_of(method_of, laboratory)
        actions = facts_of(building.actions, laboratory)
        assert actions["support.lock_castors"].names == ("“instrument trolley”",)
        assert actions["support.check_brakes"].names == ("“ultra-low freezer”", "“server rack”")

    def test_a_value_is_a_mean_cost(self, laboratory):
        """The bookcase has a value of 420 EUR, and no dispersion."""
        costs = {row["item"]: row["value"] for row in pieces(laboratory).lines}
        assert costs["bookcase"] == 420.0
        assert costs["standing cabinet"] == 1000.0  # (900 exp(0.5²/2) to two digits)

    def test_tables_of_pieces_hold_it(self, laboratory):
        table = exported_pieces(laboratory)
        rows = {row["item"]: row for row in table.lines}
        own = rows["microscope"]
        assert own["contact"] == "vinyl"
        assert own["slides_instead"] == pytest.approx(float(laboratory["slides_instead"].sel(item="microscope")))
        rate = float(laboratory["item_off_rate"].sel(item="microscope"))
        assert own["sliding_off_in_50_years"].value == pytest.approx(-np.expm1(-50.0 * rate))
        assert np.isnan(rows["instrument trolley"]["sliding_off_in_50_years"].value)
        assert "sliding_off_at_level" not in [column.key for column in table.columns]
        headings = [column.title for shown in tables(laboratory) for column in shown.columns]
        assert "slides off it" in headings


class TestGallery:
    def test_pedestals_that_move_are_said(self, gallery):
        share = gallery["item_support_moves_share"].isel(model=0)
        assert float(share.sel(item="marble bust")) == 0.0  # (its case is anchored)
        assert float(share.sel(item="vase")) > 0.0
        moving = notes_by_name(gallery)["support.pedestals_as_floor"]
        assert (moving.names, moving.value) == (("vase",), float(share.sel(item="vase")))
        assert check_of(gallery, "moving supports").names == ("vase",)
        (fixed,) = (fact for fact in building.actions(gallery) if fact.what == "support.fix_first")
        assert (fixed.names, fixed.value) == (("“pedestal”", "“vase”"), pytest.approx(float(share.sel(item="vase"))))
        falling = gallery.copy(deep=True)
        falling["item_rate"].loc[{"item": "pedestal"}] = 1e-5
        carries = facts_of(building.details, falling)["support.carries"]
        assert (carries.value, carries.names[:2]) == (1e-5, ("“pedestal”", "“vase”"))
        falling["item_rate"].loc[{"item": "pedestal"}] = 0.0
        assert "support.carries" not in facts_of(building.details, falling)

    def test_each_object_has_its_own_friction(self, gallery):
        assert gallery.attrs["pieces"] == "independent"
        assert gallery["slip"].values.tolist() == [0.02, 0.05, 0.1]
        assert bool((gallery["item_slip_rate"].sel(item="glazed bowl").diff("slip") <= 0.0).all())
