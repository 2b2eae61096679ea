"""Tables on a terminal: cells are broken between words alone, whatever the width."""

import io

import pytest
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from toppling.studies.text.rows import plain_table
from toppling.studies.text.terminal import fitted

HEADINGS = ("", "building", "ground", *(f"floor {i}" for i in range(1, 7)))
ROWS = [
    ("server-rack", "576 (385–813)", "2,750", "2,200", "1,350", "1,050", "937", "659", "768"),
    ("gas-cylinder-rack", "71.6 (56.9–87.4)", "316", "242", "195", "133", "128", "98.8", "72.5"),
]


def printed(table, width):
    console = Console(width=width, file=io.StringIO())
    for part in fitted(table, width):
        console.print(part)
    return console.file.getvalue()


@pytest.mark.parametrize("width", [40, 46, 60, 80, 100, 200])
def test_no_word_is_broken(width):
    text = printed(plain_table("What it means", HEADINGS, ROWS), width)
    words = text.split()
    for cell in (one for row in [HEADINGS, *ROWS] for one in row):
        for word in cell.split():
            assert word in words, (width, word)
    assert max(map(len, text.splitlines())) <= width
    assert text.count("What it means") == text.count("server-rack")


def test_what_fits_is_one_table():
    table = plain_table("Wide", HEADINGS, ROWS)
    (part,) = fitted(table, 200)
    assert [column.header for column in part.columns] == list(HEADINGS)
    assert [list(column.cells) for column in part.columns] == [list(column) for column in zip(*ROWS, strict=True)]
    parts = list(fitted(table, 60))
    assert [part.columns[0].header for part in parts] == [""] * len(parts)
    assert [column.header for part in parts for column in part.columns[1:]] == list(HEADINGS[1:])
    assert [part.title for part in parts] == ["Wide"] + ["Wide, continued"] * (len(parts) - 1)


def test_sections_and_markup_stay():
    table = Table(title="Marked", box=SIMPLE_HEAD, pad_edge=False)
    table.add_column("law", overflow="fold")
    table.add_column("median", justify="right", overflow="fold")
    table.add_row("[bold]a block[/]", "1.00", end_section=True)
    table.add_row("another", "[italic]no overturning[/]")
    (part,) = fitted(table, 80)
    assert [row.end_section for row in part.rows] == [True, False]
    assert list(part.columns[0].cells) == ["[bold]a block[/]", "another"]
    # (the marks themselves take no room)
    assert part.columns[0].width == len("a block")


def test_a_word_that_is_too_long_is_broken():
    text = printed(plain_table("Long", ("", "name"), [("x", "y" * 70)]), 40)
    assert max(map(len, text.splitlines())) <= 40
    assert text.count("y") == 70
