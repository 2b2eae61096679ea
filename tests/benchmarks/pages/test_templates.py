"""Pages are their templates filled in: some take many minutes, so that an old page would be kept."""

import re

import pytest
from page_tables import DOCS, page

from toppling.benchmarks.pages.page import template

PAGES = ("consistency", "directions", "p58", "paper", "walls")


@pytest.mark.parametrize("name", PAGES)
def test_the_page_is_its_template(name):
    text = page(name)
    parts = [re.escape(part) for part in re.split(r"\{\w+(?::[^}]*)?\}", template(name))]
    assert re.fullmatch("(.+?)".join(parts), text, re.DOTALL)
    assert not re.search(r"\{\w+\}|\bnan\b|\binf\b", text)


@pytest.mark.parametrize("name", PAGES)
def test_files_of_the_page_are_those_it_shows(name):
    text = page(name)
    assert set(re.findall(rf"\]\({name}/([\w.]+)\)", text)) == {path.name for path in (DOCS / name).iterdir()}
