"""Tables on a terminal: broken between words, and into parts that fit its width."""

from collections.abc import Iterator

from rich import table as rich
from rich.box import SIMPLE_HEAD
from rich.cells import cell_len
from rich.padding import Padding
from rich.text import Text

from .table import Column, Table

GAP, EDGE = 3, 1
"""Characters between the columns of a table (`SIMPLE_HEAD`), and at its sides."""
WIDEST = 40
"""Longest text of the first column that is not broken."""


def rendered(table: Table, width: int) -> Iterator[Padding]:
    """Yield a table that fits a width, or several that begin with its first column, and the note."""
    cells = [[column.heading] for column in table.columns]
    for heading, lines in table.groups:
        rows = [[heading, *[""] * (len(cells) - 1)]] if heading else []
        for row in [*rows, *lines]:
            for column, text in zip(cells, row, strict=True):
                column.append(text)
    words = [max((cell_len(word) for cell in column for word in cell.split()), default=0) for column in cells]
    most = [max(map(cell_len, column)) for column in cells]
    if _width(most) > width:  # (headings are broken before cells)
        most = [max([word, *map(cell_len, column[1:])]) for column, word in zip(cells, words, strict=True)]
    first = most[0] if most[0] <= WIDEST else words[0]
    least = [first, *words[1:]]
    parts = [[0]]
    for i in range(1, len(cells)):
        if len(parts[-1]) > 1 and _width([least[k] for k in [*parts[-1], i]]) > width:
            parts.append([0])
        parts[-1].append(i)
    for part in parts:
        # (as an edge without the empty line above it)
        yield Padding(_part(table, part, least, most, width), (0, EDGE, 1, EDGE), expand=False)
    if table.note:
        yield Padding(Text(table.note), (0, 1))


def _width(columns: list[int]) -> int:
    """Return the width of a table of some columns, each but the last with a gap behind it, between two edges."""
    return sum(columns) + GAP * (len(columns) - 1) + 2 * EDGE


def _part(table: Table, part: list[int], least: list[int], most: list[int], width: int) -> rich.Table:
    """Return a table of some columns, each as wide as there is room for."""
    title = table.title if 1 in part or len(part) == 1 else f"{table.title}, continued"
    shown = rich.Table(title=Text(title), box=SIMPLE_HEAD, show_edge=False, pad_edge=False, title_justify="left")
    room = width - _width([least[i] for i in part])
    given, left = {}, max(0, room)
    for i in sorted(part, key=lambda i: most[i] - least[i]):  # (as few columns as possible have broken cells)
        given[i] = min(most[i] - least[i], left)
        left -= given[i]
    for i in part:
        column: Column = table.columns[i]
        shown.add_column(
            Text(column.heading),
            justify="right" if column.numeric else "left",
            overflow="fold",
            no_wrap=i == 0 and most[0] <= WIDEST,
            width=least[i] + given[i] if room >= 0 else None,
        )
    for heading, lines in table.groups:
        if heading:
            shown.add_row(Text(heading, style="bold"))
        for k, cells in enumerate(lines):
            shown.add_row(*(Text(cells[i]) for i in part), end_section=bool(heading) and k == len(lines) - 1)
    return shown
