"""Tables say once what all rows or groups of rows have in common; captions do not repeat earlier captions."""

import json
import math

import matplotlib.pyplot as plt
import pytest
import xarray as xr

from toppling.studies.report.figures import pictures_of
from toppling.studies.tables.fragility import _rates
from toppling.studies.tables.table import Column, Table, tilted

COLUMNS = Column("name", "piece"), Column("height", "height", "short", "m"), Column("law", "law")


def rows(*pieces):
    return [dict(zip(COLUMNS, piece, strict=True)) for piece in pieces]


def test_a_column_of_one_value_is_in_the_note():
    table = Table.of("Sizes", rows(("a", 1.6, "x"), ("b", 1.6, "y"), ("c", 1.6, None))).common()
    assert [column.key for column in table.columns] == ["name", "law"]
    assert "height 1.6 m" in table.note


def test_words_in_a_note_have_no_unit():
    table = Table.of("Sizes", rows(*((name, "not reached", "x") for name in "abc"))).common()
    assert "height not reached;" in table.note


@pytest.mark.parametrize("dim", ["block", "item"])
def test_a_tilt_that_counts_as_overturning_is_noted(dim):
    scenes = [json.dumps(scene) for scene in ({"tilt_limit": math.radians(5.0)}, {"lean": 0.1}, {})]
    results = xr.Dataset(coords={dim: ["vessel", "shelf", "case"], "scene": (dim, scenes)})
    assert tilted(results).endswith(": vessel 5°.")
    assert tilted(results.isel({dim: [1, 2]})) == tilted(results.drop_vars("scene")) == ""
    assert tilted(results.assign_attrs(state="uplift")) == ""


class TestUncertain:
    def test_a_chance_is_of_the_rate_beside_it(self):
        """Once in 2,410 years is 2.05 % in 50 years, whatever the mean rate of few samples is."""
        rate = {"rate": 1 / 2410, "rate_lower": 1 / 4030, "rate_upper": 1 / 1540}
        chance = {name.replace("rate", "risk_probability"): -math.expm1(-50.0 * value) for name, value in rate.items()}
        curve = xr.Dataset({**rate, **chance, "sample_rate_mean": 1 / 1010, "sample_risk_probability_mean": 0.0476})
        curve["sample_rate_quantile"] = "quantile", [1 / 4940, 1 / 479]
        texts = {column.title: column.text(value) for column, value in _rates(curve, "50 years").items()}
        assert texts["once in"] == "2,410 (1,540–4,030)"
        assert texts["in 50 years"] == "2.05\u00a0% (1.23–3.19)"
        assert texts["mean of the samples, 90 % of them"] == "1,010 (479–4,940)"


def test_two_rows_or_dashes_keep_their_columns():
    two = Table.of("Sizes", rows(("a", 1.6, "x"), ("b", 1.6, "y")))
    assert two.common() == two
    unknown = [{"name": name, "height": height, "law": None} for name, height in (("a", 1.6), ("b", 1.7), ("c", 1.8))]
    dashes = Table("Sizes", COLUMNS, unknown)
    assert dashes.common() == dashes


def test_groups_have_a_heading_in_place_of_a_column():
    table = Table.of("Sizes", rows(("a", 1.6, "x"), ("b", 1.7, "y"), ("c", 1.8, "x"))).grouped("law")
    assert [heading for heading, _ in table.groups] == ["x", "y"]
    assert [row["name"] for row in table.lines] == ["a", "c", "b"]
    assert table.grouped("height", "law") is table
    assert "law" not in [column.key for column in table.columns]


def test_a_caption_does_not_repeat_earlier_captions():
    def draw():
        for name, block in (("map_half_level", "A"), ("map_rate", "B")):
            figure = plt.figure()
            figure.set_label(f"{block}. 20 motions.")
            yield name, figure

    first, second = pictures_of(draw, png=True)
    assert first.caption.startswith("Values of all blocks by slenderness")
    assert first.caption.endswith("A. 20 motions.")
    assert second.caption == "B."
    assert second.alt.endswith("B. 20 motions.")
