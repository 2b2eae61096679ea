"""The report of a study's results as one self-contained HTML page, or as Markdown."""

import base64
import json
import math
import re
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Literal

import numpy as np
import xarray as xr
from jinja2 import Environment
from markupsafe import Markup

from ...core.writing import write_bytes
from .. import show
from ..facts.bars import bars_of
from ..facts.checks import REMARKS
from ..facts.method import study_of
from ..facts.say import environment as templates, notes_said, remedy, say, value_of
from ..facts.sections import REGISTERS, as_json, sections
from ..file.report import ReportTable
from ..store.content import check_content
from ..tables.files import table_json
from ..tables.inputs import provenance
from ..tables.pieces import code_note
from ..tables.registry import INPUTS, LEAD, TABLES, tables
from ..tables.table import Table, intervals
from ..text.error import StudyError, writing
from ..text.glossary import used
from ..text.names import clean
from ..text.reached import within_levels
from ..text.spread import model_note
from ..text.words import renamed, with_law_names
from .figures import Draw, Picture, pictures_of
from .results_file import read_results

ReportFormat = Literal["html", "md"]

_LINE = re.compile(r"\n\s*")
_PLAIN_LIST = re.compile(r"\[\n\s*([^\[\]{}]*?)\n\s*\]")
_BRACKETS = re.compile(r"(\([^()]{1,24}\))")
_MARKDOWN = re.compile(r"([\\`*_{}\[\]|~$<>&]|(?<=.)#+$)")
_LINE_START = re.compile(r"^(#|\+(?= |$)|-(?= |-|$)|=+$|\d+(?=[.)](?: |$)))")
"""Characters with a meaning in Markdown: anywhere (round brackets have none without square brackets) or at the start of
a line. At the end of a heading there are characters that close it.
"""
MANY_COLUMNS = 7
"""Most columns that fit an upright sheet or a tablet; wider tables get a sheet across, or a card for each row."""
PLAIN = "footnotes", "method"
"""Sections that a page prints as they are."""
IN_TABLES = "gain.chance", "curve.half_level", "curve.rank", "curve.rare", "consequence.loss"
"""Facts that tables contain, which the appendix does not repeat in words."""
MOST_STEPS = 3
"""Most actions on the first screen; the others follow in the appendix."""
MOST_WORDS = 60
"""Most words of the answer; the others follow in the appendix."""


def write_report(
    result: Path, out: Path | None = None, format_: ReportFormat = "html", verify: bool = False
) -> list[Path]:
    """Write the report of results to the file or folder `out`, by default next to the results; return the files."""
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
            parts = content(results, result, state)
            written: list[Path] = []
            figures: list[tuple[Picture, str]] = []
            for picture in pictures_of(partial(show.figures, results), png=True):
                file = target.with_name(f"{target.stem}_{picture.name}.png")
                written.append(write(file, picture.png))
                figures.append((picture, file.name.replace(" ", "%20").replace("(", "%28").replace(")", "%29")))
            text = environment(escaping=False).get_template("report.md.j2").render(**parts, figures=figures)
            write(target, text.encode("utf-8", "replace"))
            return [target, *written]
        write(target, html_page(results, result, state).encode("utf-8"))
    return [target]


def drawn_of(draw: Draw) -> list[tuple[Picture, Markup, Markup]]:
    """Return figures as pictures, each with its drawings for a screen and a phone as HTML."""
    return [(picture, Markup(picture.svg), Markup(picture.phone)) for picture in pictures_of(draw)]


def html_page(results: xr.Dataset, path: Path, state: str) -> str:
    """Return the page of a study's results read from `path`, in a `state`; the same results give the same text."""
    parts = content(results, path, state)
    drawn = drawn_of(partial(show.figures, results))
    template = environment(escaping=True).get_template("report.html.j2")
    study = base64.b64encode(parts["study"].encode()).decode()
    return template.render(**{**parts, "study": study}, figures=drawn)


def content(results: xr.Dataset, path: Path, state: str) -> dict[str, Any]:
    """Return the contents of a report without its figures: text, tables and checks, as the templates need them."""
    labelled, results = results, with_law_names(results)
    facts = sections(results, state)
    (validity,) = facts["validity"]
    sentences = {name: [say(fact, REGISTERS[name]) for fact in facts[name]] for name in ("answer", "actions", *PLAIN)}
    titles, labels = value_of("titles", "checks"), value_of("titles", "method")
    words = np.cumsum([len(sentence.split()) for sentence in sentences["answer"]])
    first = max(1, int((words <= MOST_WORDS).sum()))
    later = [fact for fact in (*facts["answer"][first:], *facts["details"]) if fact.what not in IN_TABLES]
    page = {
        "title": str(results.attrs.get("title", "")) or "A study",
        "cover": [(name.capitalize(), text) for name, text in _cover(results)],
        "answer": sentences["answer"][:first],
        "bars": bars_of(within_levels(results)),
        "steps": sentences["actions"][:MOST_STEPS],
        "further": sentences["actions"][MOST_STEPS:],
        "badge": validity,
        "verdict": say(validity, "checks"),
        "lead": _page_tables(results, LEAD),
        **{name: sentences[name] for name in PLAIN},
        "details": [say(fact, "page") for fact in later],
        "after": next(
            (fact for fact in facts["answer"] if fact.what == "anchoring.after" and math.isfinite(fact.value)), None
        ),
        "tables": _page_tables(results, [name for name in TABLES if name not in LEAD]),
        "inputs": [(labels[fact.what], say(fact, "method")) for fact in facts["inputs"]],
        "input_tables": _page_tables(results, INPUTS),
        "checks": [
            (titles[check.what], check.word, say(check, "checks"), remedy(check, "checks")) for check in facts["checks"]
        ],
        "good": list(dict.fromkeys(titles[check.what] for check in facts["passed"])),
        "remarks": [say(check, "checks") for check in facts["passed"] if check.what in REMARKS],
        "notes": [renamed(note, labelled) for note in notes_said(facts["notes"])],
    }
    study = json.dumps(study_of(results), ensure_ascii=False, indent=2)
    return {
        **page,
        "terms": used(texts(page)),
        "provenance": [provenance(results, path, state)],
        # each list of numbers and words is put on one line to save space (no string contains a line break)
        "study": _PLAIN_LIST.sub(lambda match: f"[{' '.join(re.split(_LINE, match[1]))}]", study),
    }


def facts_json(path: Path, verify: bool = False) -> dict[str, Any]:
    """Return the content of the report of a result file, as an object of JSON: facts by section, and tables."""
    with read_results(path) as results:
        state = check_content(path, results, verify)
        made = *tables(results, dict.fromkeys((*LEAD, *TABLES, *INPUTS))), provenance(results, path, state)
        return {
            "title": str(results.attrs.get("title", "")),
            **as_json(sections(results, state)),
            "tables": [table_json(table) for table in made],
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
    elif isinstance(part, Table):
        yield from texts([part.title, part.note, [column.heading for column in part.columns], [*part.groups]])
    elif isinstance(part, list | tuple):
        for inner in part:
            yield from texts(inner)


def _page_tables(results: xr.Dataset, names: Sequence[str]) -> list[Table]:
    """Return the tables of some names, without the sentences that the page has elsewhere for all of them."""
    elsewhere = intervals(results), model_note(results), code_note(results)
    made = (table.without(*elsewhere).common() for table in tables(results, names))
    return [table.grouped("recommendation").grouped("status", "clause") for table in made]


def longest_word(text: str) -> int:
    """Return the length of the longest word, which a narrow column must break."""
    return max(map(len, text.split()), default=0)


def whole_intervals(text: str) -> Markup:
    """Return a cell as one HTML element in which no line break divides an interval in brackets."""
    whole = Markup('<span class="whole">{}</span>')
    parts = [whole.format(piece) if i % 2 else piece for i, piece in enumerate(_BRACKETS.split(clean(text)))]
    return Markup("<span>{}</span>").format(Markup("").join(parts))


def markdown(text: object) -> str:
    """Return text escaped for Markdown in one line, so that nothing in it is markup or HTML."""
    entities = {"<": "&lt;", ">": "&gt;", "&": "&amp;"}
    plain = " ".join(clean(str(text)).split())
    marked = _LINE_START.search(plain)
    text = _MARKDOWN.sub(lambda match: entities.get(match[1], f"\\{match[1]}"), plain)
    if marked is None:
        return text
    # (a number is kept from being a list by its stop or bracket: a digit cannot be escaped)
    at = marked.end() if marked[1].isdigit() else 0
    return f"{text[:at]}\\{text[at:]}"


def environment(*, escaping: bool) -> Environment:
    """Return the templates of pages."""
    made = templates(escaping=escaping)
    made.filters |= {"markdown": markdown, "longest_word": longest_word, "whole_intervals": whole_intervals}
    made.globals["many_columns"] = MANY_COLUMNS
    return made


def write(path: Path, text: bytes) -> Path:
    """Write a file completely or not at all, and return its path; StudyError if it cannot be written."""
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_bytes(path, text)
    return path
