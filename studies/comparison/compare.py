"""The comparison of two results from end to end: tables, facts, a CSV file, figures and the page of all of them."""

import math
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from ...core.facts import Fact
from ...core.wording import confidence_text
from ..facts.say import say
from ..facts.sections import fact_json
from ..report.figures import Draw
from ..report.page import drawn_of, environment, texts, write
from ..show import save_figures
from ..store.outputs import own_files
from ..tables.files import csv_bytes, table_json
from ..tables.table import Cells, Column, Table
from ..text.error import StudyError
from ..text.glossary import used
from .curves import compare_curves
from .inputs import inputs_that_differ, notes_on_inputs
from .pieces import compare_pieces
from .ratios import MOST_ROWS, REGISTER, Found, answer, exported_lines, legend, table_of
from .sides import PIECES, Side, refuse_different, titles_of, two_sides

TABLE, PAGE = "comparison.csv", "comparison.html"
NAMES = (TABLE, PAGE, "curves.png", "chances.png")
"""Names of all files that a comparison may have."""


class Comparison(NamedTuple):
    """Two results side by side: titles and files, inputs that differ, tables, answer, notes, and the files written."""

    head: list[str]
    inputs: list[Fact]
    tables: list[Table]
    answer: list[Fact]
    notes: list[Fact]
    written: list[Path]

    @property
    def as_json(self) -> dict[str, Any]:
        """The facts and tables as an object of JSON."""
        facts = {"inputs": self.inputs, "answer": self.answer, "notes": self.notes}
        return {
            "compared": self.head,
            **{name: [fact_json(fact, REGISTER) for fact in of_name] for name, of_name in facts.items()},
            "tables": [table_json(table) for table in self.tables],
            "written": [str(path) for path in self.written],
        }


def compare(
    first: Path, second: Path, folder: Path, laws: tuple[str, str] | None = None, verify: bool = False
) -> Comparison:
    """Compare two results, under a law of each or all in common, and write table, figures and page into a folder."""
    from ..plots.axes import defaults  # noqa: PLC0415
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
            findings = compare_pieces(a, b, laws)
            draw = partial(figures.of_pieces, findings, drawn_titles, sure)
        else:
            findings, curves, places = compare_curves(a, b, laws)
            draw = partial(figures.of_curves, findings, curves, places, drawn_titles, sure)
        compared = _compared(a, b, findings, sure)
        page = _html_page((a, b), titles, compared, draw)
        with defaults():
            drawn = list(draw())
    with own_files(folder, "compare", NAMES):
        written = [
            write(folder / TABLE, csv_bytes(exported_lines(findings.lines, findings.quantities))),
            *save_figures(drawn, folder),
            write(folder / PAGE, page.encode("utf-8")),
        ]
    return compared._replace(written=written)


def side_by_side(a: Side, b: Side, laws: tuple[str, str]) -> Comparison:
    """Compare the curves of two results in memory, under a law of each, and write nothing."""
    refuse_different(a, b)
    findings, _, _ = compare_curves(a, b, laws)
    return _compared(a, b, findings, confidence_text(a.results))


def _compared(a: Side, b: Side, findings: Found, sure: str) -> Comparison:
    """Return the tables and facts of a comparison."""
    names = {line.quantity for line in findings.lines}
    shown = [quantity for quantity in findings.quantities if quantity.shown and quantity.name in names]
    whole = [quantity for quantity in shown if quantity.whole]
    groups = [[quantity] for quantity in shown if not quantity.whole] + ([whole] if whole else [])
    lines = [line for line in findings.lines if any(line.quantity == quantity.name for quantity in shown)]
    inputs = [*inputs_that_differ(a, b, findings.matched)]
    resampled = any(not math.isnan(line.ratio.lower) for line in lines)
    rows: list[Cells] = [
        {
            Column("name"): say(fact, REGISTER),
            Column("a", "A"): fact.names[1] or None,
            Column("b", "B"): fact.names[2] or None,
        }
        for fact in inputs
    ]
    of_inputs = [Table.of("Inputs that differ", rows, most=MOST_ROWS)] if rows else []
    of = "item" if a.kind == PIECES else "block" if len(findings.matched["floor"].pairs) == 1 else "curve"
    return Comparison(
        [f"{side.name}: {side.title} ({side.path})" for side in (a, b)],
        inputs,
        [*of_inputs, *(table_of(findings.lines, group, sure) for group in groups)],
        [*answer(lines, shown, of)],
        [
            Fact("comparison.ratio", more={"resampled": resampled}),
            *notes_on_inputs(a, b, bool(inputs), resampled),
            *legend(lines),
            *findings.notes,
        ],
        [],
    )


def _html_page(sides: tuple[Side, Side], titles: tuple[str, str], compared: Comparison, draw: Draw) -> str:
    """Return the page of a comparison; the same results give the same text."""
    drawn = drawn_of(draw)
    content = {
        "cover": list(zip("AB", titles, strict=True)),
        "answer": [say(fact, REGISTER) for fact in compared.answer],
        "tables": compared.tables,
        "notes": [say(fact, REGISTER) for fact in compared.notes],
    }
    rows = [
        ("file", *(side.path.as_posix() for side in sides)),
        ("made by toppling", *(str(side.results.attrs.get("toppling_version", "")) for side in sides)),
        ("content (SHA-256)", *(str(side.results.attrs.get("content_sha256", "not stated")) for side in sides)),
    ]
    columns = Column("what"), Column("a", "A"), Column("b", "B")
    provenance = Table("Compared results", columns, [{"what": what, "a": of_a, "b": of_b} for what, of_a, of_b in rows])
    terms = used(texts(content))
    template = environment(escaping=True).get_template("comparison.html.j2")
    return template.render(**content, provenance=provenance, terms=terms, figures=drawn)
