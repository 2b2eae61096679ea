"""docs/p58.md is its template filled in: it is made in three quarters of an hour, so that an old page would be kept."""

import re
from pathlib import Path

import toppling as tp
from toppling.benchmarks.pages.page import template

TEXT = (Path(tp.__file__).parent / "docs/p58.md").read_text(encoding="utf-8")


def test_the_page_is_its_template():
    parts = [re.escape(part) for part in re.split(r"\{\w+\}", template("p58"))]
    assert re.fullmatch("(.+?)".join(parts), TEXT, re.DOTALL)
