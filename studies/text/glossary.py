"""The terms that reports use, each with its definition (terms.csv): a report defines every term that it uses, once."""

import csv
import re
from collections.abc import Iterable
from importlib import resources
from typing import NamedTuple


class Term(NamedTuple):
    """A term, its definition, the pattern that finds it in a text, and True if a page explains it."""

    name: str
    definition: str
    pattern: str
    page: str


def terms() -> list[Term]:
    """Return every term, the most needed first."""
    text = resources.files(__package__).joinpath("terms.csv").read_text(encoding="utf-8")
    return [Term(**row) for row in csv.DictReader(text.splitlines())]


def used(texts: Iterable[str]) -> list[Term]:
    """Return the terms of some texts that a page explains; the documentation has the others."""
    text = "\n".join(texts)
    return [term for term in terms() if term.page and re.search(term.pattern, text)]
