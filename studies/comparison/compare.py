"""The comparison of two results from end to end: tables, sentences, a CSV file, figures and the page of all of them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from ...core.wording import confidence_text, counted
from ...core.writing import write_bytes
from ..plan.ratios import HIGHER, LOWER, OPEN, SAME, UNKNOWN
from ..report.page import drawn_of, environment, texts
from ..show import save_figures
from ..store.outputs import own_files
from ..tables.files import csv_bytes
from ..tables.table import Column, Table
from ..text.error import StudyError, writing
from ..text.glossary import used
from .curves import compare_curves
from .inputs import differences_in_words
from .pieces import compare_pieces
from .ratios import ANCHORED_IN, Line, Quantity, exported_lines, law_text, table_of
from .sides import PIECES, Side, titles_of, two_sides

ONE = {
    HIGHER: f"{HIGHER} in B, by more than the choice of motions explains",
    LOWER: f"{LOWER} in B, by more than the choice of motions explains",
    OPEN: f"{OPEN}: the choice of motions may explain the difference",
    SAME: "exactly the same",
}
"""What is said of a single comparison, by its verdict."""
KEPT = {
    ANCHORED_IN["A"]: "anchored in A and cannot fall there",
    ANCHORED_IN["B"]: "anchored in B and cannot fall there",
    ANCHORED_IN["both"]: "anchored in both and cannot fall",
}
"""What is said of anchored pieces, by their verdict."""


def answer(lines: Sequence[Line], quantity: Quantity) -> str:
    """Return in a sentence how many of a quantity differ by more than the choice of motions explains, law by law."""
    own = [line for line in lines if line.quantity == quantity.name]
    laws = dict.fromkeys(law_text(line.laws) for line in own)
    each = {law: _counts([line for line in own if law_text(line.laws) == law]) for law in laws}
    different = set(each.values())
    if len(different) == 1:
        under = f" under each of the {len(each)} laws" if len(each) > 1 else ""
        return f"{quantity.title}{under}: {different.pop()}"
    return f"{quantity.title}: {'; '.join(f'under {law}, {said}' for law, said in each.items())}"


def _counts(own: Sequence[Line]) -> str:
    """Say how many lines under one law differ, are not resolved, are the same, and how many pieces are anchored."""
    said = []
    for verdict, text in KEPT.items():
        number = sum(line.verdict == verdict for line in own)
        said += [f"{counted(number, 'piece')} {'is' if number == 1 else 'are'} {text}"] if number else []
    free = [line for line in own if line.verdict not in KEPT]
    total = len(free)
    if not total:
        return "; ".join(said)
    other = "other " if said else ""
    numbers = {word: sum(line.verdict == word for line in free) for word in (HIGHER, LOWER, OPEN, SAME, UNKNOWN)}
    decided = numbers[HIGHER] + numbers[LOWER]
    if numbers[UNKNOWN] == total:
        none = "no ratio has an interval"
        said.append(f"for the other {total:,}, {none}" if other else none)
    elif numbers[SAME] == total:
        said.append(f"the other {total:,} {'is' if total == 1 else 'are'} unchanged" if other else ONE[SAME])
    elif total == 1:
        (only,) = free
        said.append(f"the other one is {ONE[only.verdict]}" if other else ONE[only.verdict])
    else:
        which = [f"{numbers[word]} {word} in B" for word in (HIGHER, LOWER) if numbers[word]]
        counts = f" ({', '.join(which)})" if which else ""
        of = f"the other {total:,}" if other else f"{total:,}"
        said.append(f"{decided} of {of} differ by more than the choice of motions explains{counts}")
        few = numbers[OPEN]
        said += [f"{few} not resolved: the choice of motions may explain the difference"] if few else []
        said += [f"{numbers[SAME]} exactly the same"] if numbers[SAME] else []
        few = numbers[UNKNOWN]
        said += [f"{few} without a verdict, because their ratios have no interval"] if few else []
    return "; ".join(said)


def reading(lines: Sequence[Line]) -> str:
    """Return the legend of the verdicts of a comparison's tables: of those that occur."""
    words = {line.verdict for line in lines}
    said = []
    decided = [word for word in (HIGHER, LOWER) if word in words]
    if decided:
        said.append(
            f"{', '.join(decided)}: the interval of B/A does not include 1, so the choice of motions does not explain "
            "the difference"
        )
    if OPEN in words:
        said.append(f"{OPEN}: the interval of B/A includes 1, and more motions may decide")
    if words & set(KEPT):
        said.append("anchored: the piece is taken as one that cannot fall, so there is no ratio")
    if UNKNOWN in words:
        said.append("–: the ratio has no interval (too few motions bring something down, or a note says why)")
    if SAME in words:
        said.append(f"{SAME}: both numbers are equal in every resample of the motions")
    return "; ".join(said)


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
    tables: list[Table]
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
        whole = [quantity for quantity in told if quantity.whole]
        tables = [table_of(found.lines, [quantity], sure) for quantity in told if not quantity.whole]
        tables += [table_of(found.lines, whole, sure)] if whole else []
        said = [answer(found.lines, one) for one in told]
        legend = reading([line for line in found.lines if line.quantity in {one.name for one in told}])
        page = _html_page(a, b, titles, said, differences, tables, [legend, *found.notes], draw)
        drawn = list(draw())
    with own_files(folder, "compare", NAMES):
        written = [
            _write(folder / TABLE, csv_bytes(exported_lines(found.lines, found.quantities))),
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
    tables: Sequence[Table],
    reading: Sequence[str],
    draw: Draw,
) -> str:
    """Return the page of a comparison; the same results give the same text."""
    drawn = drawn_of(draw)
    content = {
        "title": "Two studies side by side",
        "question": QUESTION,
        "cover": list(zip("AB", titles, strict=True)),
        "sentences": _as_sentences(sentences),
        "differences": _as_sentences(differences),
        "tables": list(tables),
        "reading": [RATIOS, *_as_sentences(reading)],
    }
    rows = [
        ("file", *(one.path.as_posix() for one in (a, b))),
        ("made by toppling", *(str(one.results.attrs.get("toppling_version", "")) for one in (a, b))),
        ("content (SHA-256)", *(str(one.results.attrs.get("content_sha256", "not stated")) for one in (a, b))),
    ]
    columns = Column("what"), Column("a", "A"), Column("b", "B")
    provenance = Table("Compared results", columns, [{"what": what, "a": of_a, "b": of_b} for what, of_a, of_b in rows])
    terms = used(texts(content))
    template = environment(escaping=True).get_template("comparison.html.j2")
    return template.render(**content, provenance=provenance, terms=terms, figures=drawn)


def _as_sentences(said: Sequence[str]) -> list[str]:
    """Return lines of a terminal as sentences: with a capital letter and a full stop."""
    return [f"{one[:1].upper()}{one[1:].rstrip('.')}." for one in said]


def _write(path: Path, content: bytes) -> Path:
    with writing(path):
        write_bytes(path, content)
    return path
