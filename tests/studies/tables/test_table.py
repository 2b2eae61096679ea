"""Tables say once what all rows or groups of rows have in common; captions do not repeat earlier captions."""

import ast
import io
import json
import math
import re
from pathlib import Path
from string import Formatter

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from rich.console import Console

import toppling
from toppling.studies.buildings.recommendations import Range
from toppling.studies.facts.say import value_of
from toppling.studies.plots import selection
from toppling.studies.plots.assessment import bars
from toppling.studies.report.figures import pictures_of
from toppling.studies.tables.assessment import doubtful_items
from toppling.studies.tables.fragility import _rates
from toppling.studies.tables.registry import REGISTRY
from toppling.studies.tables.sensitivity import GREEK
from toppling.studies.tables.table import Column, Table, tilted
from toppling.studies.tables.terminal import rendered

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


def test_a_tilt_that_counts_as_overturning_is_noted():
    scenes = [json.dumps(scene) for scene in ({"tilt_limit": math.radians(5.0)}, {"lean": 0.1}, {})]
    results = xr.Dataset(coords={"block": ["vessel", "shelf", "case"], "scene": ("block", scenes)})
    assert tilted(results).endswith(": vessel 5°.")
    assert tilted(results.isel(block=[1, 2])) == tilted(results.drop_vars("scene")) == ""
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


def test_components_of_records_are_no_sources_of_variance():
    curves = xr.Dataset({"half_level": ("block", [1.0])}, {"component": ("motion", ["H1", "H2"])})
    assert not REGISTRY["shares"].applies(curves)
    uncertain = xr.Dataset({"half_level": ("block", [1.0]), "capacity_share": ("component", [1.0])})
    assert REGISTRY["shares"].applies(uncertain)


def ranking(**coordinates):
    saving = (("model", "block"), np.array([[3.0, 1.0]]), {"units": "EUR"})
    values = dict.fromkeys(("alone", "saving", "saving_lower", "saving_upper"), saving)
    ranks = {"rank": (("model", "block"), np.array([[1, 2]]))}
    return xr.Dataset(
        {**values, **ranks, "saving_share": (("model", "block"), np.array([[0.75, 0.25]]))},
        {
            "model": ["housner"],
            "block": ["bust", "shelf"],
            "floor": ("block", ["1", "2"]),
            "count": ("block", [1, 1]),
            "cost": ("block", np.full(2, np.nan)),
            **coordinates,
        },
        {"objective": "loss", "objective_text": "expected loss", "objective_units": "EUR", "confidence": 0.95},
    )


def marked(given):
    ax = bars(given, selection.laws(given), plt.figure().subplots())
    return [label.get_text() for label in ax.get_yticklabels()]


def test_a_squat_piece_is_marked():
    labels = marked(ranking(doubtful=("block", [True, False])))
    assert ["‡" in label for label in labels] == ["bust" in label for label in labels]


def test_nothing_is_marked_where_nothing_is_doubted():
    for given in (ranking(), ranking(doubtful=("block", [False, False]))):
        assert not any("‡" in label for label in marked(given))
        assert not doubtful_items(given).any()


HEADINGS = ("", "building", "ground", *(f"floor {i}" for i in range(1, 7)))
ROWS = [
    ("server-rack", "576 (385–813)", "2,750", "2,200", "1,350", "1,050", "937", "659", "768"),
    ("gas-cylinder-rack", "71.6 (56.9–87.4)", "316", "242", "195", "133", "128", "98.8", "72.5"),
]


def table_of(title, headings=HEADINGS, rows=ROWS):
    columns = [Column(str(i), heading) for i, heading in enumerate(headings)]
    return Table(title, columns, [{str(i): cell for i, cell in enumerate(row)} for row in rows])


def printed(table, width):
    console = Console(width=width, file=io.StringIO())
    console.print(*rendered(table, width), sep="\n")
    return console.file.getvalue()


def parts_of(table, width):
    return [padded.renderable for padded in rendered(table, width)]


@pytest.mark.parametrize("width", [40, 46, 60, 80, 100, 200])
def test_no_word_is_broken(width):
    text = printed(table_of("What it means"), width)
    words = text.split()
    for cell in (cell for row in [HEADINGS, *ROWS] for cell in row):
        for word in cell.split():
            assert word in words, (width, word)
    assert max(map(len, text.splitlines())) <= width
    assert text.count("What it means") == text.count("server-rack")


def test_what_fits_is_one_table():
    table = table_of("Wide")
    (part,) = parts_of(table, 200)
    assert [str(column.header) for column in part.columns] == list(HEADINGS)
    columns = [[str(cell) for cell in column.cells] for column in part.columns]
    assert columns == [list(column) for column in zip(*ROWS, strict=True)]
    parts = parts_of(table, 60)
    assert [str(part.columns[0].header) for part in parts] == [""] * len(parts)
    assert [str(column.header) for part in parts for column in part.columns[1:]] == list(HEADINGS[1:])
    assert [str(part.title) for part in parts] == ["Wide"] + ["Wide, continued"] * (len(parts) - 1)


def test_groups_have_a_heading_and_a_gap():
    columns = Column("law", "law"), Column("median", "median", "three")
    rows = ["a block", {"law": "x", "median": Range(1.0, 0.5, 2.0)}, "another", {"law": "y", "median": "[none]"}]
    part, note = parts_of(Table("Groups", columns, rows, ["A note."]), 80)
    assert [str(cell) for cell in part.columns[0].cells] == ["a block", "x", "another", "y"]
    assert [str(cell) for cell in part.columns[1].cells] == ["", "1.00 (0.500–2.00)", "", "[none]"]
    assert [row.end_section for row in part.rows] == [False, True, False, True]
    assert str(note) == "A note."


def test_a_word_that_is_too_long_is_broken():
    text = printed(table_of("Long", ("", "name"), [("x", "y" * 70)]), 40)
    assert max(map(len, text.splitlines())) <= 40
    assert text.count("y") == 70


def test_every_footnote_is_of_a_table():
    """A table names each sentence of the template, and fills all of its braces."""
    files = (Path(toppling.__file__).parent / "studies/tables").glob("*.py")
    code = "\n".join(path.read_text(encoding="utf-8") for path in files)
    sentences = value_of("footnotes", "footnotes")
    given = set(re.findall(r"[\"'](\w+)[\"']", code)) | set(GREEK)
    assert sentences.keys() <= given
    calls = [node for node in ast.walk(ast.parse(code)) if isinstance(node, ast.Call)]
    named = [call for call in calls if ast.unparse(call.func) == "footnote" and isinstance(call.args[0], ast.Constant)]
    assert len(named) > 40
    for call in named:
        fields = [field for _, field, _, _ in Formatter().parse(sentences[call.args[0].value]) if field is not None]
        assert len(fields) == len(call.args) - 1, ast.unparse(call)
