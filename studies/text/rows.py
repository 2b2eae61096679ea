"""Tables as rows of text, for a terminal or a report."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from rich.box import SIMPLE_HEAD
from rich.markup import escape
from rich.table import Table


class Rows(NamedTuple):
    """A table of text: title, headings, and rows of as many cells as there are headings."""

    title: str
    headings: Sequence[str]
    rows: Sequence[Sequence[str]]


def plain_table(title: str, headings: Sequence[str], rows: Sequence[Sequence[str]], wrapped: bool = False) -> Table:
    """A table for a terminal: text in the first column, which is broken into lines if `wrapped`, then numbers."""
    table = Table(title=escape(title), box=SIMPLE_HEAD, pad_edge=False, title_justify="left")
    for i, heading in enumerate(headings):
        table.add_column(escape(heading), justify="right" if i else "left", overflow="fold", no_wrap=not (i or wrapped))
    for row in rows:
        table.add_row(*(escape(cell) for cell in row))
    return table
