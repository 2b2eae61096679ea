"""Output of a command: on the terminal, or as plain lines where the output goes elsewhere."""

from __future__ import annotations

import re
from collections.abc import Iterator

from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment
from rich.table import Table
from rich.text import Text

from .encoding import printable

GAP, EDGE = 3, 1
"""Characters between the columns of a table (`rich.box.SIMPLE_HEAD`), and at its sides."""


def say(console: Console, *lines: str) -> None:
    """Print lines as they are: without markup, colours or line breaks."""
    for line in lines:
        console.print(line, highlight=False, markup=False, soft_wrap=True)


def terminal(least: int = 100) -> Console:
    """The console: of the terminal's width, or of at least `least` columns where the output goes elsewhere."""
    console = _Printable()
    return console if console.is_terminal else _Printable(width=max(least, console.width))


class _Printable(Console):
    """A console that a name cannot give orders to: control characters are its own."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterator[Segment]:
        for segment in super().render(renderable, options):
            yield segment if segment.control else segment._replace(text=printable(segment.text))


def fitted(table: Table, width: int) -> Iterator[Table]:
    """Yield a table that fits a width with cells broken between words, or several that begin with its first column."""
    cells = [[Text.from_markup(str(one)) for one in (column.header, *column.cells)] for column in table.columns]
    words = [max((cell_len(word) for one in column for word in _words(one)), default=0) for column in cells]
    most = [_longest(column) for column in cells]
    if _width(most, [*range(len(cells))]) > width:  # (headings are broken before cells are)
        most = [max(word, _longest(column[1:])) for column, word in zip(cells, words, strict=True)]
    least = [a if column.no_wrap else b for column, a, b in zip(table.columns, most, words, strict=True)]
    first, *rest = range(len(cells))
    group = [first]
    for i in rest:
        if len(group) > 1 and _width(least, [*group, i]) > width:
            yield _part(table, group, least, most, width)
            group = [first]
        group.append(i)
    yield _part(table, group, least, most, width)


def _longest(column: list[Text]) -> int:
    return max((cell_len(line) for one in column for line in one.plain.split("\n")), default=0)


def _words(text: Text) -> list[str]:
    return text.plain.replace("\n", " ").split(" ")


def _width(columns: list[int], group: list[int]) -> int:
    """The width of a table of some columns, each but the last with a gap behind it, between two edges."""
    return sum(columns[i] + GAP for i in group) - GAP + 2 * EDGE


def _part(table: Table, group: list[int], least: list[int], most: list[int], width: int) -> Table:
    """A table of a group of columns, each as wide as there is room for."""
    title = table.title
    if isinstance(title, str) and group[:2] != [0, 1]:
        # (what it is of is said once, above the first columns)
        title = re.split(r" \(|: |; ", title, maxsplit=1)[0] + ", continued"
    part = Table(title=title, box=table.box, pad_edge=table.pad_edge, title_justify=table.title_justify)
    room = width - _width(least, group)
    given, left = {}, max(0, room)
    for i in sorted(group, key=lambda i: most[i] - least[i]):  # (as few columns as can be have broken cells)
        given[i] = min(most[i] - least[i], left)
        left -= given[i]
    for i in group:
        column = table.columns[i]
        part.add_column(
            column.header,
            justify=column.justify,
            overflow=column.overflow,
            no_wrap=column.no_wrap,
            width=least[i] + given[i] if room >= 0 else None,
        )
    columns = [list(table.columns[i].cells) for i in group]
    for row, found in zip(table.rows, zip(*columns, strict=True), strict=True):
        part.add_row(*found, end_section=row.end_section)
    return part
