"""The engine's truth as one command: its flags, its errors below those of docs/performance/precision.csv, its hash."""

import csv
import re
from pathlib import Path

import engine_truth
import pytest

import toppling

TABLE = Path(toppling.__file__).parent / "docs/performance/precision.csv"


@pytest.fixture(scope="module")
def table():
    return engine_truth.rows()


def test_errors_are_those_that_the_page_claims(table):
    """No flag differs, and no error is larger than a change of the record by 1e-13 makes."""
    rows = [*csv.DictReader(TABLE.read_text(encoding="utf-8").splitlines())]
    assert {row["wrong flags"] for row in rows} == {"0 of 16"}
    claimed = [float(row["1e-13 moves the truth by"]) for row in rows]
    of_truth = [row for row in table if row.wrong_flags is not None]
    assert len(of_truth) == len(claimed) == 10
    for row, moved in zip(of_truth, claimed, strict=True):
        assert row.wrong_flags == 0, row
        assert max(row.peak, row.rotation) <= moved, row


def test_the_hash_is_of_the_numbers_alone(table):
    assert engine_truth.whole(table) == engine_truth.whole(engine_truth.rows())
    assert len({row.digest for row in table}) == len(table) == 13


def test_the_table_is_printed(capsys):
    engine_truth.main()
    *_, last = lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 15
    assert re.fullmatch(r"sha256 of all numbers: [0-9a-f]{64}", last)
