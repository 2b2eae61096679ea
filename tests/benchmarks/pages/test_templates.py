"""Pages are their templates filled in: some take many minutes, so that an old page would be kept."""

import re
from pathlib import Path

import pytest

import toppling as tp
from toppling.benchmarks.pages.page import template

DOCS = Path(tp.__file__).parent / "docs"
PAGES = ("consistency", "directions", "p58", "paper", "walls")


@pytest.mark.parametrize("name", PAGES)
def test_the_page_is_its_template(name):
    text = (DOCS / f"{name}.md").read_text(encoding="utf-8")
    parts = [re.escape(part) for part in re.split(r"\{\w+(?::[^}]*)?\}", template(name))]
    assert re.fullmatch("(.+?)".join(parts), text, re.DOTALL)
    assert not re.search(r"\{\w+\}|\bnan\b|\binf\b", text)


@pytest.mark.parametrize("name", PAGES)
def test_files_of_the_page_are_those_it_shows(name):
    text = (DOCS / f"{name}.md").read_text(encoding="utf-8")
    assert set(re.findall(rf"\]\({name}/([\w.]+)\)", text)) == {path.name for path in (DOCS / name).iterdir()}
