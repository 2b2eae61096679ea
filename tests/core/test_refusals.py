"""Rows of refusals.csv and doubts.csv belong to test files that run them."""

import pytest
from refusals import TESTS
from table_rows import table_rows


@pytest.mark.parametrize(
    ("table", "function"), [("refusals.csv", "test_refused(refusal)"), ("doubts.csv", "test_doubted(doubts)")]
)
def test_each_row_is_run(table, function):
    tables = [*TESTS.glob(f"*/{table}")]
    assert tables
    for path in tables:
        for file in {row.values[0]["file"] for row in table_rows(path)}:
            assert f"def {function}:" in (path.parent / file).read_text("utf-8"), file
