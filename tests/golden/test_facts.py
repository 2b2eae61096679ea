"""Every sentence that the corpus printed has its row in the table of facts, and every row its sentence."""

import csv
import re
from collections import Counter
from pathlib import Path

import pytest
from sentences import HERE, facts, of_file, pattern

import toppling
from toppling.studies.facts.say import SHARED

PLACES = {
    *("answer", "figure", "action", "validity", "anchor-table", "footnote"),  # the first screen
    *("A", "B", "C", "D", "E", "F"),  # the appendix
    *("terminal", "progress", "help", "comparison", "single", "motions", "dropped"),
}
NEW = {
    "anchoring.nothing_advised",  # (a page without advice said nothing)
    "anchoring.rest_repays_nothing",  # (the recommendations of all other lines, in one sentence)
    "block.tilt_limit",  # (a new key)
    "hazard.levels_apart",  # (levels of an inventory between which nearly everything falls were taken without a word)
    "motion.taken",  # (units and time steps of records were taken without a word)
    "rate.amounts_beyond_levels",  # (as above, for amounts beyond the levels)
}
"""Facts that no page said before."""
OTHERS = {"glossary", "caption", "help", "unchanged", "dropped"}
"""What a row may be now if no fact says it: a term, a caption; or as before."""


@pytest.fixture(scope="module")
def found():
    """The sentences of the corpus, each with the places of its rows."""
    rows = facts()
    sentences = (HERE / "sentences.txt").read_text(encoding="utf-8").splitlines()
    patterns = [pattern(row["sentence"]) for row in rows]
    return {
        sentence: [place for place, of_row in enumerate(patterns) if of_row.fullmatch(sentence)]
        for sentence in sentences
    }


def test_every_sentence_tells_a_fact(found):
    assert len(found) > 1_700
    assert [sentence for sentence, rows in found.items() if not rows] == []


def test_no_sentence_tells_a_fact_twice(found):
    rows = facts()
    for sentence, places in found.items():
        told = Counter(rows[place]["fact"] for place in places)
        assert set(told.values()) == {1}, (sentence, told)


def test_every_row_has_a_sentence(found):
    told = {place for places in found.values() for place in places}
    assert [row["sentence"] for place, row in enumerate(facts()) if place not in told] == []


def test_rows_are_whole():
    rows = facts()
    for row in rows:
        assert re.fullmatch(r"[a-z]+\.[a-z0-9_]+", row["fact"]), row
        assert row["place"] in PLACES, row
        assert row["condition"], row
        assert row["source"], row
        assert row["because"] or row["place"] != "dropped", row
    assert len({(row["fact"], row["sentence"]) for row in rows}) == len(rows)


def of_notes(root):
    """Return the macros of notes."""
    files = root / "studies/templates/notes.j2", root / "fragility/templates/screen.j2"
    return {macro for file in files for macro in re.findall(r"{% macro ([a-z]+_\w+)\(f\)", file.read_text())}


def names_of_facts():
    """Return the names of facts: those in the code; a name put together there has macros instead."""
    root = Path(toppling.__file__).parent
    files = [*root.glob("studies/**/*.py"), *root.glob("fragility/validity/*.py")]
    code = "".join(
        file.read_text(encoding="utf-8") for file in root.glob("studies/facts/*.py") if file.name != "say.py"
    )
    templates = "".join(file.read_text(encoding="utf-8") for file in root.glob("*/templates/*.j2"))
    macros = set(re.findall(r"{% macro (\w+)\(f\)", templates)) - {
        "others",
        "curves",
        "amounts",
        "beyond",
        "range",
        "worst",
    }
    noted = "".join(file.read_text(encoding="utf-8") for file in files)
    macros -= {*SHARED.values()}  # (sentences of several facts, none of which has their name)
    written = set(re.findall(r'"([a-z]+\.[a-z_]+)"', code)) | set(re.findall(r'Fact\(\s*"([a-z]+\.[a-z_]+)"', noted))
    # (notes are also named in tables, and in calls of functions that make them)
    written |= {macro.replace("_", ".", 1) for macro in macros & of_notes(root)} | {*SHARED}
    named = {macro.replace("_", ".", 1) for macro in macros} | {*SHARED}
    assert written - named == set()
    made = [re.sub(r"{[^}]*}", ".+", text) for text in re.findall(r'f"([a-z]+\.[^"]*{[^"]*)"', code)]
    assert made
    return written | {name for name in named for of_code in made if re.fullmatch(of_code, name)}


def test_every_row_is_said_now_and_every_fact_has_a_row():
    rows = facts()
    with (HERE / "facts_unseen.csv").open(encoding="utf-8", newline="") as stream:
        unseen = list(csv.DictReader(stream))
    names = names_of_facts()
    for row in rows:
        assert row["now"], row
        assert (row["now"] == "dropped") == (row["place"] == "dropped"), row
    said = {part for row in [*rows, *unseen] if row["now"] for part in row["now"].split("; ")}
    assert {
        part for part in said if part not in names | OTHERS and not re.match("(table|terminal|dropped): ", part)
    } == set()
    assert names - said == NEW


def test_sentences_of_a_page_and_a_terminal(tmp_path):
    page = tmp_path / "report.html"
    page.write_text(
        "<head><title>no title here</title></head><body><h1>The study's own title</h1><p>About 16 of <b>100</b> fall. "
        "“Two cabinets” falls rarely, they say.</p><table><tr><td>four words of cell</td>"
        "<td>One cell of six words, 3 pieces</td></tr></table><p>sha 0a1b2c3d4e5f is no number</p></body>",
        encoding="utf-8",
    )
    assert list(of_file(page)) == [
        *("About # of # fall.", "“…” falls rarely, they say.", "One cell of six words, # pieces", "sha # is no number"),
    ]
    terminal = tmp_path / ".1.out"
    terminal.write_text("of a table   with columns\nnote: 3 words and more\n\n", encoding="utf-8")
    assert list(of_file(terminal)) == ["note: # words and more"]
