"""Tables on a terminal: cells are broken between words alone, whatever the width."""

import io

import pytest
from rich.console import Console

from toppling.studies.buildings.recommendations import Range
from toppling.studies.tables.table import Column, Table
from toppling.studies.tables.terminal import rendered

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
