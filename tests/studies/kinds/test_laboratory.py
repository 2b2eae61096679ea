"""Inventories with friction, edges, castors and pedestals as studies: what is said of them, tables, files, refusals."""

import json
import re
import shutil
from pathlib import Path

import pytest
from check_facts import check as check_of, facts_of

import toppling as tp
from toppling.studies.facts import answer_building as building
from toppling.studies.facts.method import inputs_of
from toppling.studies.facts.notes import notes_of
from toppling.studies.tables.pieces import pieces
from toppling.studies.tables.slides import item_slides

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

    def test_what_is_locked_is_said_below_the_table(self, laboratory):
        assert "Castors locked" in item_slides(laboratory).note


class TestGallery:
    def test_pedestals_that_move_are_said(self, gallery):
        share = gallery["support_moves_rate_share"].isel(model=0)
        assert float(share.sel(block="marble bust")) == 0.0  # (its case is anchored)
        assert float(share.sel(block="vase")) > 0.0
        moving = notes_by_name(gallery)["support.pedestals_as_floor"]
        assert (moving.names, moving.value) == (("vase",), float(share.sel(block="vase")))
        assert check_of(gallery, "moving supports").names == ("vase",)
        (fixed,) = (fact for fact in building.actions(gallery) if fact.what == "support.fix_first")
        assert (fixed.names, fixed.value) == (("“pedestal”", "“vase”"), pytest.approx(float(share.sel(block="vase"))))
        falling = gallery.copy(deep=True)
        falling["rate"].loc[{"block": "pedestal"}] = 1e-5
        carries = facts_of(building.details, falling)["support.carries"]
        assert (carries.value, carries.names[:2]) == (1e-5, ("“pedestal”", "“vase”"))
        falling["rate"].loc[{"block": "pedestal"}] = 0.0
        assert "support.carries" not in facts_of(building.details, falling)
