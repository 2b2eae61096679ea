"""The page of a comparison: one self-contained HTML file in the style of the reports."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from markupsafe import Markup

from ..report.cells import page_table
from ..report.figures import pictures_of
from ..report.page import environment, texts
from ..text.glossary import used
from ..text.rows import Rows, plain_table
from .sides import Side

if TYPE_CHECKING:
    from ..report.figures import Draw

QUESTION = "How do the results of B differ from those of A, and does the choice of motions explain the difference?"
RATIOS = (
    "B/A is the ratio of a number of B to the same number of A. Its interval comes from bootstrap replicates of the "
    "motions, drawn together for both studies where they have the same motions. It reflects only the limited number of "
    "motions: it does not say which damping law or hazard curve is right."
)


def html_page(
    a: Side,
    b: Side,
    titles: tuple[str, str],
    sentences: Sequence[str],
    differences: Sequence[str],
    tables: Sequence[Rows],
    reading: Sequence[str],
    draw: Draw,
) -> str:
    """Return the page of a comparison; the same results give the same text.

    `titles` are the names of both sides; `sentences`, `differences` and `reading` are the answer, the differences
    between the inputs, and what a reader must know; `draw` makes the figures, each with its file name.
    """
    of_page = [page_table(plain_table(*rows)) for rows in tables]
    drawn = [(one, Markup(one.svg), Markup(one.phone)) for one in pictures_of(draw, " ".join(sentences))]
    content = {
        "title": "Two studies side by side",
        "question": QUESTION,
        "cover": list(zip("AB", titles, strict=True)),
        "sentences": _as_sentences(sentences),
        "differences": _as_sentences(differences),
        "tables": of_page,
        "reading": [RATIOS, *_as_sentences(reading)],
    }
    provenance = page_table(plain_table(*_provenance(a, b)), words=True)
    terms = used(texts(content))
    template = environment(escaping=True).get_template("comparison.html.j2")
    return template.render(**content, provenance=provenance, terms=terms, figures=drawn)


def _as_sentences(said: Sequence[str]) -> list[str]:
    """Return lines of a terminal as sentences: with a capital letter and a full stop."""
    return [f"{one[:1].upper()}{one[1:].rstrip('.')}." for one in said]


def _provenance(a: Side, b: Side) -> Rows:
    rows = [
        ("file", *(one.path.as_posix() for one in (a, b))),
        ("made by toppling", *(str(one.results.attrs.get("toppling_version", "")) for one in (a, b))),
        ("content (SHA-256)", *(str(one.results.attrs.get("content_sha256", "not stated")) for one in (a, b))),
    ]
    return Rows("The results that are compared", ("", "A", "B"), rows)
