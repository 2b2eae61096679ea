"""Calls of test files as rows: refusals.csv has those that are refused, doubts.csv those whose input is doubted."""

import ast
import builtins
import contextlib
import re
from importlib import import_module
from pathlib import Path

import pytest
from table_rows import table_rows

import toppling as tp
from toppling.core.doubts import noted

TESTS = Path(__file__).parents[1]
PUBLIC = (builtins, tp, tp.fragility, tp.motions)
"""Where a name is looked up that the test file does not have."""


def pytest_generate_tests(metafunc):
    for fixture, table in (("refusal", "refusals.csv"), ("doubts", "doubts.csv")):
        if fixture in metafunc.fixturenames:
            package, *name = Path(metafunc.module.__file__).relative_to(TESTS).parts
            rows = [row for row in table_rows(TESTS / package / table) if row.values[0]["file"] == "/".join(name)]
            metafunc.parametrize(fixture, rows, indirect=True)


def names_of(row, request):
    """Return what the names of a row mean: fixtures, names of its test file, public ones."""
    names, text = {"toppling": tp, **vars(request.module)}, f"{row['call']}; {row.get('error', '')}"
    for module in re.findall(r"toppling(?:\.[a-z_]+)+(?=\.)", text):
        import_module(module)
    tree = ast.parse(text)
    for name in {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}:
        with contextlib.suppress(pytest.FixtureLookupError):
            names[name] = request.getfixturevalue(name)
        if name not in names:
            names.update((name, getattr(module, name)) for module in PUBLIC if hasattr(module, name))
    return names


@pytest.fixture
def refusal(request):
    """Return a function that makes the call of a row, which must be refused in one line, with nothing written."""
    row, names = request.param, names_of(request.param, request)

    def refused():
        with pytest.raises(eval(row["error"], names), match=row["refused"]) as caught:
            eval(row["call"], names)
        assert "\n" not in str(caught.value)
        assert len(str(caught.value)) < 400
        if "write_" in row["call"] and "tmp_path" in names:
            assert not [*names["tmp_path"].iterdir()]
        assert type(caught.value).__module__.partition(".")[0] in {"builtins", "toppling"}

    return refused


@pytest.fixture
def doubts(request):
    """Return a function that makes the call of a row, which must return or note the doubts of the row and no other."""
    row, names = request.param, names_of(request.param, request)

    def doubted():
        with noted() as said:
            found = eval(row["call"], names)
        doubts = found if isinstance(found, list) else said
        words = row["doubted"].split(" & ") if row["doubted"] else []
        assert [text in doubt.sentence for text, doubt in zip(words, doubts, strict=True)] == [True] * len(words)
        assert {doubt.kind for doubt in doubts} <= {row["kind"] or doubt.kind for doubt in doubts}
        assert not row["grave"] or [str(doubt.grave) for doubt in doubts] == [row["grave"]]

    return doubted
