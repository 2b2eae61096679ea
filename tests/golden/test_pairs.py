"""The covering array: every pair of features that can stand together is in a study, a sample ends as recorded.

`pairs/outcomes.csv` says how each row ended at 0e788eb, and `pairs/open.csv` which pairs are in no row that ran to its
end.
"""

import csv
import itertools
import random

import pair_cases
import pytest

from toppling.studies.command.cli import main

ROWS = pair_cases.rows()


def table(name):
    with (pair_cases.FOLDER / name).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


OUTCOMES = {line["row"]: line for line in table("outcomes.csv")}
# (what ends in a traceback takes its test along)
SAMPLE = random.Random(7).sample(sorted(row for row, line in OUTCOMES.items() if line["code"] != "traceback"), 12)


def test_rows_hold_every_pair_that_can_stand_together():
    held = {pair for row in ROWS.values() for pair in itertools.combinations(row.items(), 2)}
    values = [(factor, value) for factor, of_factor in pair_cases.features().items() for value in of_factor]
    missing = [
        (first, second)
        for first, second in itertools.combinations(values, 2)
        if first[0] != second[0] and (first, second) not in held and pair_cases.can_hold(first, second)
    ]
    assert not missing


def test_no_row_holds_what_is_apart():
    for number, row in ROWS.items():
        broken = [apart for apart in pair_cases.constraints() if all(row[factor] in apart[factor] for factor in apart)]
        assert not broken, number


def test_every_fragment_is_in_a_row():
    for factor, values in pair_cases.features().items():
        for value, fragment in values.items():
            numbers = [int(number) for number, row in ROWS.items() if row[factor] == value]
            count = len(fragment) if isinstance(fragment, list) else 1
            assert {number % count for number in numbers} == set(range(count)), (factor, value)


@pytest.mark.slow
def test_rows_are_those_of_the_generator():
    assert pair_cases.rows_text(pair_cases.generate()) == (pair_cases.FOLDER / "rows.csv").read_text(encoding="utf-8")


def test_known_faults_have_cases():
    faults = table("known.csv")
    assert {f"pairs/{line['name']}" for line in faults} < {case.name for case in pair_cases.cases()}
    crashes = {line["sentence"] for line in OUTCOMES.values() if line["code"] == "traceback"}
    assert all(any(crash in fault["happens"] for fault in faults) for crash in crashes)


def test_every_row_has_an_outcome():
    assert list(OUTCOMES) == list(ROWS)


def test_pairs_without_a_row_that_ran_are_listed():
    ran = {pair for row in ROWS if not OUTCOMES[row]["code"] for pair in itertools.combinations(ROWS[row].items(), 2)}
    held = {pair for row in ROWS.values() for pair in itertools.combinations(row.items(), 2)}
    open_pairs = {("=".join(first), "=".join(second)) for first, second in held - ran}
    assert {(line["first"], line["second"]) for line in table("open.csv")} == open_pairs


@pytest.mark.parametrize(
    "number", [pytest.param(row, marks=[pytest.mark.slow] * (at > 2)) for at, row in enumerate(SAMPLE)]
)
def test_rows_end_as_recorded(number, tmp_path, monkeypatch):
    case = pair_cases.case(number, ROWS[number])
    case.write(tmp_path / "case")
    monkeypatch.chdir(tmp_path / "case")
    ended = next((command for command in case.commands if main(list(command))), None)
    assert (ended[0] if ended else "") == OUTCOMES[number]["refused"]
