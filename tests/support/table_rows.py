"""Cases of one test as rows of a CSV file."""

import csv

import pytest

ESCAPES = {r"\n": "\n", r"\t": "\t", r"\r": "\r", r"\x1a": "\x1a", r"\0": "\0"}


def table_rows(path, parts=()):
    """Return a case for each row, named by its first cell, with line ends and parts in its `text`."""
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    for row in rows if "text" in rows[0] else ():
        for short, long in {**ESCAPES, **dict(parts)}.items():
            row["text"] = row["text"].replace(short, long)
    return [pytest.param(row, id=f"{next(iter(row.values()))} {number}") for number, row in enumerate(rows, start=2)]
