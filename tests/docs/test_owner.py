"""Numbers of the owner's tutorial: the live page shows them at its steps."""

import re
from pathlib import Path

import pytest

pytest.importorskip("starlette", reason="needs the extra app")

from browser import CHROMIUM
from owner import walk

pytestmark = [
    pytest.mark.repository,
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium or Chrome"),
]
TUTORIAL = Path(__file__).resolve().parents[2] / "docs/tutorials/owner.md"
STEPS = ("piece", "piece", "building", "budget", "after")
"""Steps after which the page shows the blocks of the tutorial, in its order."""


def test_the_page_shows_the_tutorials_numbers(tmp_path):
    blocks = re.findall(r"```text\n(.*?)```", TUTORIAL.read_text("utf-8"), re.DOTALL)
    shown = [block for block in blocks if not block.startswith(("toppling app", "written into"))]
    texts = {step: text.replace("What does this rest on?", "") for step, text, _ in walk(tmp_path)}
    for step, block in zip(STEPS, shown, strict=True):
        text = " ".join(texts[step].split())
        for line in block.splitlines():
            assert line == "..." or " ".join(line.split()) in text, (step, line, texts[step])
