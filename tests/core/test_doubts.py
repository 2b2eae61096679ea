"""Input warnings of `doubts.toml`: code uses each, each that code names is there, and their tables are whole."""

import ast
from pathlib import Path
from string import Formatter

import pytest

from toppling.core.doubts import KINDS, Doubt, doubt_data

ROOT = Path(__file__).parents[2]
TREES = [
    ast.parse(path.read_text("utf-8"))
    for package in ("core", "models", "motions", "fragility", "studies")
    for path in (ROOT / package).rglob("*.py")
]
NODES = [node for tree in TREES for node in ast.walk(tree)]
DOUBTING = [tree for tree in TREES if "Doubt.of" in (source := ast.unparse(tree)) or "doubt_data" in source]
TEXTS = {
    node.value
    for tree in DOUBTING
    for node in ast.walk(tree)
    if isinstance(node, ast.Constant) and isinstance(node.value, str)
}
FIELDS = {node.target.id for node in NODES if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name)}
NAMED = {
    node.args[0].value
    for node in NODES
    if isinstance(node, ast.Call) and ast.unparse(node.func) == "Doubt.of" and isinstance(node.args[0], ast.Constant)
}
DATA = doubt_data()


def fields(text):
    return {name for _, name, _, _ in Formatter().parse(text) if name is not None}


def test_code_names_what_there_is():
    assert len(NAMED) > 50
    assert NAMED - DATA["doubt"].keys() == set()


@pytest.mark.parametrize("table", ["doubt", "cure", "quantity"])
def test_code_uses_each(table):
    assert DATA[table].keys() - TEXTS == set()


def test_usual_numbers_are_of_parameters():
    """Their names are parameters, keys of study files without or with their unit, or texts in code."""
    names = [name.rpartition(".")[2] for name in DATA["usual"]]
    assert [name for name in names if not {name, name.rpartition("_")[0]} & (FIELDS | TEXTS)] == []
    for least, most, unit, slip in DATA["usual"].values():
        assert 0.0 < least < most
        assert isinstance(unit, str)
        assert slip


@pytest.mark.parametrize("name", DATA["doubt"])
def test_rows(name):
    row = DATA["doubt"][name]
    assert row["kind"] in KINDS
    assert row.keys() <= {"kind", "sentence", "plural", "verb", "settled"}
    assert ("verb" in row) == ("verb" in fields(row["sentence"]))
    assert len(row.get("verb", "no")) == 2
    assert row.get("settled", True) is True
    # (a number that only the plural names chooses it)
    assert fields(row.get("plural", row["sentence"])) - {"number"} == fields(row["sentence"]) - {"number"}


def test_plural_and_cure():
    singular = Doubt.of("record_drift", False, "drift", of="the record", named="a")
    row, cure = DATA["doubt"]["record_drift"], DATA["cure"]
    (singly, together), values = row["verb"], {"of": "the record", "named": "a"}
    assert singular.sentence == row["sentence"].format(**values, verb=singly, cure=cure["drift"])
    assert singular[2:] == (False, False)
    plural = Doubt.of("record_drift", True, "floors", number=2, of="2 of 2 records", named="a, {b}")
    values = {"of": "2 of 2 records", "named": "a, {b}"}
    assert plural.sentence == row.get("plural", row["sentence"]).format(**values, verb=together, cure=cure["floors"])
    assert plural.grave


def test_settled():
    assert Doubt.of("unended", name="a.csv").settled
