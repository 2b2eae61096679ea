"""Templates that are kept compiled: equal texts, renewed with their source, and no need of a place."""

import sys
from types import SimpleNamespace

import pytest

from toppling.core import sentences
from toppling.core.facts import Fact


def text(folder, **options):
    return sentences.environment([folder], **options).get_template("a.j2").module.said("<b>")


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "a.j2").write_text("{% macro said(x) %}{{ x }}!{% endmacro %}", encoding="utf-8")
    return tmp_path


def kept(folder):
    return sorted(file.name[:10] for file in folder.glob("__pycache__/*.j2c"))


def test_each_kind_of_text_is_kept_by_itself(folder, monkeypatch):
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    for _ in range(2):
        assert text(folder) == "<b>!"
        assert text(folder, escaping=True) == "&lt;b&gt;!"
        assert text(folder, safe=lambda x: x and f"{x}?") == "<b>?!"
        assert kept(folder) == ["html-plain", "text-plain", "text-safe-"]
    (folder / "a.j2").write_text("{% macro said(x) %}{{ x }}.{% endmacro %}", encoding="utf-8")
    assert text(folder) == "<b>."
    for file in folder.glob("__pycache__/*"):
        file.write_bytes(file.read_bytes()[:40])
    assert text(folder) == "<b>."


def test_nothing_is_kept_where_nothing_may_be_written(folder, monkeypatch):
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    assert text(folder) == "<b>!"
    assert kept(folder) == []
    monkeypatch.setattr(sys, "dont_write_bytecode", False)
    (folder / "__pycache__").write_text("", encoding="utf-8")
    assert text(folder) == "<b>!"


def test_a_number_and_its_per_cent_sign_stay_together():
    module = SimpleNamespace(share=lambda fact: f"A  chance of {fact.value:g} % , or 5 % more.")
    assert sentences.sentence("share", Fact("share", 95.0), [module]) == "A chance of 95\u00a0%, or 5\u00a0% more."
