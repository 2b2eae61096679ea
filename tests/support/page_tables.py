"""Pages of the documentation: their tables, within them and beside them."""

import csv
from pathlib import Path

DOCS = Path(__file__).resolve().parents[2] / "docs"


def page(name):
    """Return the text of a page."""
    return (DOCS / f"{name}.md").read_text(encoding="utf-8")


def rows_beside(page, name, heading=False):
    """Return the rows of a table beside a page, as lists of cells, with its heading or without."""
    rows = [*csv.reader((DOCS / page / f"{name}.csv").read_text(encoding="utf-8").splitlines())]
    return rows if heading else rows[1:]


def table_below(text, heading):
    """Return the first table below a text of a page, as lists of cells, without its head."""
    lines = text[text.index(heading) :].splitlines()
    first = next(i for i, line in enumerate(lines) if line.startswith("|"))
    found = []
    for line in lines[first:]:
        if not line.startswith("|"):
            break
        found.append([cell.strip() for cell in line.strip("|").split("|")])
    return found[2:]
