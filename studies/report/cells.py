"""Tables and text prepared for a page: a terminal's tables as plain cells, and text escaped for Markdown."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple

from markupsafe import Markup
from rich.table import Table
from rich.text import Text

from ..text.names import clean

_FIGURE = re.compile(r"[-−+≈–∞]?\s*[\d∞]|–$|no fall|no width")
_NUMBERS = re.compile(r"(?:[-−+≈]\s*)?(?:[\d.,()%\s–±]|inf|nan)+")
_BRACKETS = re.compile(r"(\([^()]{1,24}\))")
_MARKDOWN = re.compile(r"([\\`*_{}\[\]|~$<>&]|(?<=.)#+$)")
_LINE_START = re.compile(r"^(#|\+(?= |$)|-(?= |-|$)|=+$|\d+(?=[.)](?: |$)))")
"""Characters with a meaning in Markdown: anywhere (round brackets have none without square ones) or at the end of a
heading, which they close; at the start of a line."""


class Line(NamedTuple):
    """A row of a table on a page: its cells, and a flag for a row that only names the rows below it."""

    cells: list[str]
    heads: bool


class PageTable(NamedTuple):
    """A table on a page; `numeric` marks the columns that hold numbers, which the first never does."""

    title: str
    headings: list[str]
    numeric: list[bool]
    groups: list[list[Line]]


def page_table(table: Table, words: bool = False) -> PageTable:
    """Return a terminal's table as one for a page, without markup; with `words` no column counts as numeric."""
    columns = [[_cell(cell) for cell in column.cells] for column in table.columns]
    lines = []
    for row in zip(*columns, strict=True):
        texts = [text for text, _ in row]
        lines.append(Line(texts, row[0][1] and not any(texts[1:])))
    numeric = [i > 0 and not words and _figures([text for text, _ in column]) for i, column in enumerate(columns)]
    headings = [_plain(column.header) for column in table.columns]
    return PageTable(_plain(table.title or ""), headings, numeric, list(_groups(lines)))


def _cell(cell: object) -> tuple[str, bool]:
    """Return the text of a cell, and True if all of it is bold, as in rows that name the rows below them."""
    text = Text.from_markup(str(cell))
    bold = bool(text.plain) and any(span.style == "bold" and span.end - span.start == len(text) for span in text.spans)
    plain = clean(text.plain.strip())
    if _NUMBERS.fullmatch(plain):
        plain = plain.replace("inf", "∞").replace("nan", "not known")
    return plain, bold


def _plain(text: object) -> str:
    """Return a title or a heading without the terminal's markup."""
    return clean(Text.from_markup(str(text)).plain)


def _figures(cells: list[str]) -> bool:
    """Return True if a column holds numbers: most of its cells start like a number."""
    filled = [cell for cell in cells if cell]
    return 2 * sum(_FIGURE.match(cell) is not None for cell in filled) > len(filled)


def _groups(lines: list[Line]) -> Iterator[list[Line]]:
    group: list[Line] = []
    for line in lines:
        if line.heads and group:
            yield group
            group = []
        group.append(line)
    if group:
        yield group


def longest_word(text: str) -> int:
    """Return the length of the longest word, which a narrow column must break."""
    return max(map(len, text.split()), default=0)


def whole_intervals(text: str) -> Markup:
    """Return a cell as one HTML element in which no line break divides an interval in brackets."""
    whole = Markup('<span class="whole">{}</span>')
    parts = [whole.format(one) if i % 2 else one for i, one in enumerate(_BRACKETS.split(clean(text)))]
    return Markup("<span>{}</span>").format(Markup("").join(parts))


def markdown(text: object) -> str:
    """Return text escaped for Markdown in one line, so that nothing in it is markup or HTML."""
    entities = {"<": "&lt;", ">": "&gt;", "&": "&amp;"}
    plain = " ".join(clean(str(text)).split())
    marked = _LINE_START.search(plain)
    text = _MARKDOWN.sub(lambda found: entities.get(found[1], f"\\{found[1]}"), plain)
    if marked is None:
        return text
    # (a number is kept from being a list by its stop or bracket: a digit cannot be escaped)
    at = marked.end() if marked[1].isdigit() else 0
    return f"{text[:at]}\\{text[at:]}"
