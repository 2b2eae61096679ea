"""docs/architecture.md and its drawing, held to the imports as they are."""

import importlib.util
import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
ALLOWED = {
    ("fragility", "models"),
    ("fragility", "motions"),
    ("benchmarks", "models"),
    ("benchmarks", "motions"),
    ("benchmarks", "fragility"),
    ("studies", "models"),
    ("studies", "motions"),
    ("studies", "fragility"),
    ("studies", "benchmarks"),
}


def load(name):
    specification = importlib.util.spec_from_file_location(name, ROOT / "docs" / f"{name}.py")
    module = importlib.util.module_from_spec(specification)
    sys.modules[name] = module
    specification.loader.exec_module(module)
    return module


drawing = load("drawing")
TABLE = drawing.ideas((ROOT / "docs/architecture.md").read_text(encoding="utf-8"))


@pytest.mark.parametrize("package", drawing.PACKAGES)
def test_every_module_has_one_idea(package):
    listed = [name for names in TABLE[package].values() for name in names]
    assert len(listed) == len(set(listed)), "a module stands twice"
    assert sorted(listed) == drawing.modules()[package], "docs/architecture.md lists other modules than there are"


@pytest.mark.parametrize("package", drawing.PACKAGES)
def test_ideas_use_only_those_above_them(package):
    order = list(TABLE[package])
    wrong = [
        (user, used)
        for where, user, used in drawing.idea_arrows(TABLE)
        if where == package and order.index(used) > order.index(user)
    ]
    assert not wrong, f"ideas of {package} that use one below them in docs/architecture.md"


def test_arrows_between_packages():
    arrows = drawing.package_arrows()
    assert {pair for pair in arrows if pair[1] not in drawing.BELOW} == ALLOWED
    assert {used for _, used in arrows} <= {*drawing.PACKAGES, *drawing.BELOW}


def test_the_drawing_is_of_today():
    kept = (ROOT / "docs/architecture.svg").read_text(encoding="utf-8")
    assert kept == drawing.svg(TABLE), "run `make drawing`"
    # as many arrows as there are between packages
    assert len(re.findall(r"marker-end", kept)) == len(ALLOWED)


def test_the_test_sees_a_forbidden_import(tmp_path):
    for package in drawing.PACKAGES:
        (tmp_path / package).mkdir()
    (tmp_path / "models/block.py").write_text("from ..motions import read\nfrom .. import checks\n", encoding="utf-8")
    (tmp_path / "motions/arrays.py").write_text("from . import files\nfrom ..units import METRE\n", encoding="utf-8")
    (tmp_path / "motions/files.py").write_text("import numpy\n", encoding="utf-8")
    assert drawing.package_arrows(tmp_path) == {("models", "motions"), ("models", "checks"), ("motions", "units")}
    table = {"motions": {"a": ["arrays"], "b": ["files"]}}
    assert drawing.idea_arrows(table, tmp_path) == {("motions", "a", "b")}
    with pytest.raises(ValueError, match="no place is known for the arrows"):
        drawing.svg({one: {} for one in drawing.PACKAGES}, tmp_path)
