"""What a study prints on a terminal: an answer in a few lines, everything with --verbose, and help by task."""

import re

import pytest
from study_texts import HAZARD, crate_study

from toppling.studies.command.cli import main

BLOCKS = "".join(f'[[blocks]]\nname = "shelf {i}"\nwidth_m = {0.3 + 0.02 * i}\nheight_m = 1.8\n' for i in range(12))


@pytest.fixture
def study(tmp_path):
    """Fourteen blocks under two laws, with a hazard."""
    text = crate_study("Many shelves", 6, 6, 0.02, 5).replace("[motions]", f"{BLOCKS}[motions]", 1)
    (tmp_path / "study.toml").write_text(text + HAZARD, encoding="utf-8")
    return tmp_path / "study.toml"


@pytest.mark.slow
def test_an_answer_in_a_few_lines(study, capsys):
    assert main(["run", str(study), "--out", str(study.parent / "out")]) == 0
    lines = [line for line in capsys.readouterr().out.splitlines() if not line.startswith("compiling")]
    assert len(lines) < 27
    text = "\n".join(lines)
    assert "Law: housner e=e_R." in " ".join(text.split())
    assert re.search("8 of 14.*rates", " ".join(text.split()))
    assert sum(line.startswith(" shelf") for line in lines) >= 7
    assert any(line.startswith("validity: ") and "range of levels" in line for line in lines)
    assert re.search(r"report \S+ \(\d+.*--verbose", text)
    assert "note: vertical shaking" not in text


@pytest.mark.slow
def test_results_that_are_not_valid_are_said_to_be_so_before_anything_is_advised(tmp_path, capsys):
    (tmp_path / "study.toml").write_text(crate_study("Few motions", 2, 6, 0.02, 5), encoding="utf-8")
    assert main(["run", str(tmp_path / "study.toml"), "--out", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().out
    marks = [said.index(mark) for mark in ("validity: not valid", "; do not rely", "Use Housner")]
    assert marks == sorted(marks)


@pytest.mark.slow
def test_everything_with_verbose(study, capsys):
    assert main(["run", str(study), "--out", str(study.parent / "out"), "--verbose"]) == 0
    text = capsys.readouterr().out
    assert "Fragility curves and rates" in text
    assert "vertical shaking" in text
    assert all(f"shelf {i}" in text for i in range(12))


def test_help_lists_commands_by_task(capsys):
    assert main(["--help"]) == 0
    text = capsys.readouterr().out
    order = [text.index(name) for name in ("─ Run ─", "─ Results ─", "─ Inputs ─")]
    assert order == sorted(order)
    assert order[1] < text.index("report") < order[2] < text.index("catalogue") < text.index("schema")
