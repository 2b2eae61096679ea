"""How much a page says: the answer, actions and terms within their budgets, and nothing twice."""

import re
from collections import Counter
from pathlib import Path

import pytest
from report_pages import STUDIES, loaded

import toppling as tp
from toppling.studies.facts.say import _module
from toppling.studies.report.page import MOST_STEPS, MOST_WORDS, content
from toppling.studies.store.content import AS_WRITTEN


@pytest.fixture(params=STUDIES)
def page(request, folder):
    path = next(folder.rglob("results.nc"))
    return content(loaded(folder, request.param), path, AS_WRITTEN)


def test_the_first_screen_is_short(page):
    words = sum(len(sentence.split()) for sentence in page["answer"])
    assert words <= MOST_WORDS or len(page["answer"]) == 1
    assert len(page["steps"]) <= MOST_STEPS == 3
    assert len(page["terms"]) <= 8


def test_no_sentence_stands_on_a_page_twice(page):
    parts = ("answer", "steps", "further", "footnotes", "details", "method", "remarks", "notes")
    said = [sentence for part in parts for sentence in page[part]]
    said += [table.title for table in (*page["lead"], *page["tables"], *page["input_tables"])]
    said += [text for _, text in page["inputs"]] + [finding for _, _, finding, _ in page["checks"]]
    counts = Counter(sentence for text in said for sentence in re.split(r"(?<=[.?]) (?=[A-Z“])", text))
    assert [sentence for sentence, number in counts.items() if number > 1] == []


def test_every_check_has_the_template_of_its_remedy():
    code = (Path(tp.__file__).parent / "studies/facts/checks.py").read_text(encoding="utf-8")
    remedies = set(re.findall(r'"(remedy_\w+)"', code))
    assert len(remedies) > 15
    assert [name for name in sorted(remedies) if not hasattr(_module("checks"), name)] == []
