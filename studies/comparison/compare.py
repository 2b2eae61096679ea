"""The comparison of two results from end to end: tables, sentences, a CSV file, figures and the page of all of them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from markupsafe import Markup

from ...core.wording import confidence_text, system_reason
from ...core.writing import write_bytes
from ..report.cells import page_table
from ..report.figures import pictures_of
from ..report.page import environment, texts
from ..show import save_figures
from ..store.outputs import own_files
from ..tables.values import csv_bytes
from ..text.error import StudyError
from ..text.glossary import used
from ..text.rows import Rows, plain_table
from .answers import answer, reading
from .curves import compare_curves
from .inputs import differences_in_words
from .pieces import compare_pieces
from .sides import PIECES, Side, titles_of, two_sides
from .tables import rows_of, value_table, whole_rows

if TYPE_CHECKING:
    from ..report.figures import Draw

TABLE, PAGE = "comparison.csv", "comparison.html"
NAMES = (TABLE, PAGE, "curves.png", "chances.png")
"""Names of all files that a comparison may have."""
QUESTION = "How do the results of B differ from those of A, and does the choice of motions explain the difference?"
RATIOS = (
    "B/A is the ratio of a number of B to the same number of A. Its interval comes from bootstrap replicates of the "
    "motions, drawn together for both studies where they have the same motions. It reflects only the limited number of "
    "motions: it does not say which damping law or hazard curve is right."
)


class Comparison(NamedTuple):
    """Two results side by side: lines to print before and after the tables, the tables, and the files written."""

    head: list[str]
    tables: list[Rows]
    tail: list[str]
    written: list[Path]


def compare(
    first: Path, second: Path, folder: Path, laws: tuple[str, str] | None = None, verify: bool = False
) -> Comparison:
    """Compare two results, under a law of each or all in common, and write table, figures and page into a folder."""
    from . import figures  # noqa: PLC0415 - matplotlib

    same = laws is not None and first.resolve() == second.resolve()
    with two_sides(first, second, same, verify) as (a, b):
        sure = confidence_text(a.results)
        if sure != confidence_text(b.results):
            raise StudyError(f"A has {sure} intervals and B {confidence_text(b.results)} intervals: give both the same")
        if same and laws is not None and laws[0] == laws[1]:
            raise StudyError(f"--laws {laws[0]} {laws[1]}: name two laws")
        titles = titles_of(a, b, laws)
        # (figures name the laws themselves)
        drawn_titles = (a.title, b.title) if same else titles
        if a.kind == PIECES:
            found = compare_pieces(a, b, laws)
            draw = partial(figures.of_pieces, found, drawn_titles, sure)
        else:
            both = compare_curves(a, b, laws)
            found = both.found
            draw = partial(figures.of_curves, both, drawn_titles, sure)
        head = [f"{one.name}: {one.title} ({one.path})" for one in (a, b)]
        differences = differences_in_words(a, b, found.names, found.laws)
        compared = {line.quantity for line in found.lines}
        told = [one for one in found.quantities if one.name in compared and one.shown]
        tables = [rows_of(found.lines, one, sure) for one in told if not one.whole]
        whole = [one for one in told if one.whole]
        tables += [whole_rows(found.lines, whole, sure)] if whole else []
        said = [answer(found.lines, one) for one in told]
        legend = reading([line for line in found.lines if line.quantity in {one.name for one in told}])
        page = _html_page(a, b, titles, said, differences, tables, [legend, *found.notes], draw)
        drawn = list(draw())
    with own_files(folder, "compare", NAMES):
        written = [
            _write(folder / TABLE, csv_bytes(value_table(found.lines, found.quantities))),
            *save_figures(drawn, folder),
            _write(folder / PAGE, page.encode("utf-8")),
        ]
    head += ["what differs:", *(f"  {one}" for one in differences)]
    return Comparison(head, tables, [*said, legend, *(f"note: {one}" for one in found.notes)], written)


def _html_page(
    a: Side,
    b: Side,
    titles: tuple[str, str],
    sentences: Sequence[str],
    differences: Sequence[str],
    tables: Sequence[Rows],
    reading: Sequence[str],
    draw: Draw,
) -> str:
    """Return the page of a comparison; the same results give the same text."""
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
    rows = [
        ("file", *(one.path.as_posix() for one in (a, b))),
        ("made by toppling", *(str(one.results.attrs.get("toppling_version", "")) for one in (a, b))),
        ("content (SHA-256)", *(str(one.results.attrs.get("content_sha256", "not stated")) for one in (a, b))),
    ]
    provenance = page_table(plain_table(*Rows("The results that are compared", ("", "A", "B"), rows)), words=True)
    terms = used(texts(content))
    template = environment(escaping=True).get_template("comparison.html.j2")
    return template.render(**content, provenance=provenance, terms=terms, figures=drawn)


def _as_sentences(said: Sequence[str]) -> list[str]:
    """Return lines of a terminal as sentences: with a capital letter and a full stop."""
    return [f"{one[:1].upper()}{one[1:].rstrip('.')}." for one in said]


def _write(path: Path, content: bytes) -> Path:
    try:
        write_bytes(path, content)
    except OSError as error:
        raise StudyError(f"{path}: cannot be written ({system_reason(error)})") from None
    return path
