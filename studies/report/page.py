"""The report of a study's results as one self-contained HTML page, or as Markdown."""

from __future__ import annotations

import json
import re
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import xarray as xr
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from ...core.writing import write_bytes
from .. import show
from ..file.report import ReportTable
from ..plan.slides import INSTEAD
from ..store.content import check_content
from ..tables.client import lead_rows
from ..text.block_order import shown
from ..text.error import StudyError, writing
from ..text.glossary import used
from ..text.names import clean
from ..text.rows import Rows, plain_table
from .actions import next_steps
from .answers import answer
from .basis import basis
from .cells import PageTable, longest_word, markdown, page_table, whole_intervals
from .figures import Picture, pictures_of
from .method import assumptions, block_rows, law_rows, lifted, method, provenance_rows, study_file_rows, study_of
from .results_file import read_results
from .summary import plain_answer
from .validity import badge, checks_of, not_checked, worst_word

if TYPE_CHECKING:
    from collections.abc import Iterator

ReportFormat = Literal["html", "md"]

TEMPLATES = Path(__file__).parents[1] / "templates"
_LINE = re.compile(r"\n\s*")
_PLAIN_LIST = re.compile(r"\[\n\s*([^\[\]{}]*?)\n\s*\]")
MANY_COLUMNS = 8
"""Most columns that fit an upright sheet or a tablet; wider tables get a sheet across, or a card for each row."""
NUMBERS = 600
"""Largest length of the answer at the end of a figure's description."""


def write_report(
    result: Path, out: Path | None = None, format_: ReportFormat = "html", verify: bool = False
) -> list[Path]:
    """Write the report of results to the file or folder `out`, beside the results by default; return the files."""
    target = result.parent if out is None else out
    if target.is_dir() or not target.suffix:
        target /= f"report.{format_}"
    if target.exists() and result.exists() and target.samefile(result):
        raise StudyError(f"{target}: are the results themselves; give the report another name")
    if target.suffix not in (".html", ".htm", ".md"):
        raise StudyError(f"{target}: --out must be a folder or end in .html or .md")
    with read_results(result) as results:
        state = check_content(result, results, verify)
        if format_ == "md":
            found = content(results, result, state)
            written: list[Path] = []
            figures: list[tuple[Picture, str]] = []
            for one in pictures_of(partial(show.figures, results), found["numbers"], png=True):
                beside = target.with_name(f"{target.stem}_{one.name}.png")
                _write(beside, one.png)
                written.append(beside)
                figures.append((one, beside.name.replace(" ", "%20").replace("(", "%28").replace(")", "%29")))
            text = environment(escaping=False).get_template("report.md.j2").render(**found, figures=figures)
            _write(target, text.encode("utf-8", "replace"))
            return [target, *written]
        _write(target, html_page(results, result, state).encode("utf-8"))
    return [target]


def html_page(results: xr.Dataset, path: Path, state: str) -> str:
    """Return the page of a study's results read from `path`, in a `state`; the same results give the same text."""
    found = content(results, path, state)
    every = pictures_of(partial(show.figures, results), found["numbers"])
    drawn = [(one, Markup(one.svg), Markup(one.phone)) for one in every]
    template = environment(escaping=True).get_template("report.html.j2")
    return template.render(**found, figures=drawn)


def content(results: xr.Dataset, path: Path, state: str) -> dict[str, Any]:
    """Return the contents of a report without its figures: text, tables and checks, as the templates need them."""
    said, plain = answer(results), plain_answer(results)
    found = checks_of(results, state)
    notes = [line for line in str(results.attrs.get("notes", "")).splitlines() if line]
    of_client = {
        "title": str(results.attrs.get("title", "")) or "A study",
        "question": said.question,
        "plain": plain,
        "lead": _tables_of(list(lead_rows(results))),
        "steps": next_steps(results, found),
        "basis": basis(results),
    }
    technical = {
        "sentences": [*said.sentences, *show.hints(results)],
        "tables": [page_table(table) for table in show.tables(results)],
        "method": method(results),
        "made_of": [
            *_tables_of([law_rows(results)], words=True),
            *_tables_of([block_rows(shown(results))]),
            *_tables_of([study_file_rows(results)], words=True),
        ],
        "assumptions": assumptions(results),
        "checks": found,
        "not_checked": not_checked(lifted(study_of(results)), INSTEAD in results),
        "notes": notes,
    }
    terms = used(texts(of_client))
    return {
        **of_client,
        **technical,
        "kind": str(results.attrs["kind"]),
        "lead_title": "Results" if str(results.attrs["kind"]) == "sensitivity" else "Each piece",
        "cover": [(name.capitalize(), text) for name, text in _cover(results)],
        "terms": terms,
        "technical_terms": used(texts(technical), terms),
        "numbers": _shortened(" ".join(said.sentences or plain)),
        "verdict": badge(found),
        "word": worst_word(found),
        "provenance": _tables_of([provenance_rows(results, path, state)], words=True),
        "study": _study_text(results),
    }


def _cover(results: xr.Dataset) -> Iterator[tuple[str, str]]:
    """Yield the lines of the cover, by their names in the study file."""
    given = study_of(results).get("report")
    for name in ReportTable.model_fields:
        text = given.get(name) if isinstance(given, dict) else None
        if isinstance(text, str):
            yield name, text


def texts(part: object) -> Iterator[str]:
    """Yield every text of a part of the page."""
    if isinstance(part, str):
        yield part
    elif isinstance(part, dict):
        yield from texts(list(part.values()))
    elif isinstance(part, list | tuple):
        for one in part:
            yield from texts(one)


def _tables_of(every: list[Rows | None], words: bool = False) -> list[PageTable]:
    return [page_table(plain_table(*rows), words) for rows in every if rows is not None and rows.rows]


def _shortened(text: str) -> str:
    return text if len(text) <= NUMBERS else f"{text[: text.rfind(' ', 0, NUMBERS)]} …"


def _study_text(results: xr.Dataset) -> str:
    text = json.dumps(study_of(results), ensure_ascii=False, indent=2)
    # each list of numbers and words is put on one line to save space (no string contains a line break)
    return _PLAIN_LIST.sub(lambda found: f"[{' '.join(re.split(_LINE, found[1]))}]", text)


def environment(*, escaping: bool) -> Environment:
    """Return the templates of pages, whose texts are cleaned and, with `escaping`, escaped for HTML."""

    def safe(value: object) -> object:
        return clean(value) if isinstance(value, str) and not isinstance(value, Markup) else value

    made = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=escaping,
        finalize=safe,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    made.filters |= {"markdown": markdown, "longest_word": longest_word, "whole_intervals": whole_intervals}
    made.globals["many_columns"] = MANY_COLUMNS
    return made


def _write(path: Path, text: bytes) -> None:
    """Write a file completely or not at all; StudyError where it cannot be written."""
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_bytes(path, text)
