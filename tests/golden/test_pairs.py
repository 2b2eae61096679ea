"""The covering array: every pair of features that can stand together ran to its end in a study.

`pairs/constraints.toml` says which features exclude one another, and `pairs/outcomes.csv` how each row ended: well, or
refused, by a key before its runs or by an export that has nothing to hold. A sample ends as recorded.
"""

import itertools
import random

import pair_cases
import pytest
import xarray as xr
from check_results import check_results

from toppling.core.doubts import ImplausibleInput
from toppling.studies.command.cli import main

ROWS, OUTCOMES = pair_cases.rows(), pair_cases.outcomes()
SAMPLE = [*random.Random(7).sample(sorted(OUTCOMES), 12), "0338"]  # (few motions by their first overturning)


def test_every_pair_that_can_stand_together_ran():
    ran = {pair for row in pair_cases.ran().values() for pair in itertools.combinations(row.items(), 2)}
    values = [(factor, value) for factor, of_factor in pair_cases.features().items() for value in of_factor]
    missing = [
        (first, second)
        for first, second in itertools.combinations(values, 2)
        if first[0] != second[0] and (first, second) not in ran and pair_cases.can_hold(first, second)
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


def test_every_row_ended_or_was_refused():
    assert list(OUTCOMES) == list(ROWS)
    assert {line["code"] for line in OUTCOMES.values()} == {"", "2"}


FAILED = {
    "several floors compared": "analysis=stripes place=ground building=floors then=compare",
    "surfaces compared": "analysis=pooled motions=clough-penzien then=compare",
    "curves with modelling uncertainty compared": "hazard=power curve=modelling then=compare",
    "a measure with a space": "measure=sa-damped then=status",
    "recordings on a support": "motions=recordings place=ground support=linear",
    "a cloud exported": "analysis=cloud size=catalogue motions=near-fault measure=pgv curve=firth then=nrml",
    "no median at any value": "analysis=sensitivity-delta measure=integral size=squat law=vassiliou",
    "a rate that nothing bounds": "analysis=cloud motions=near-fault hazard=file form=isotonic state=uplifted",
    "downtime where all falls": "analysis=performance inventory=distributions size=catalogue",
    "inputs of recordings": "analysis=sensitivity-e motions=recordings sensitivity=tornado-e",
}


@pytest.mark.slow
@pytest.mark.parametrize("features", FAILED.values(), ids=FAILED)
def test_pairs_that_failed_run(features, tmp_path, monkeypatch, recwarn):
    """They warn of nothing, and their numbers do not contradict."""
    simplest = {factor: next(iter(values)) for factor, values in pair_cases.features().items()}
    case = pair_cases.case("1", simplest | dict(word.split("=") for word in features.split()))
    case.write(tmp_path / "case")
    monkeypatch.chdir(tmp_path / "case")
    assert [main(list(command)) for command in case.commands] == [0] * len(case.commands)
    assert not [warning for warning in recwarn if issubclass(warning.category, ImplausibleInput)]
    assert main(["status", "out", "--verify"]) == 0
    with xr.open_dataset("out/results.nc") as results:
        check_results(results)


@pytest.mark.slow
@pytest.mark.parametrize(
    "number", [pytest.param(row, marks=[pytest.mark.slow] * (at > 2)) for at, row in enumerate(SAMPLE)]
)
def test_rows_end_as_recorded(number, tmp_path, monkeypatch):
    case = pair_cases.case(number, ROWS[number])
    case.write(tmp_path / "case")
    monkeypatch.chdir(tmp_path / "case")
    ended = next((command for command in case.commands if main(list(command))), None)
    assert (ended[0] if ended else "") == OUTCOMES[number]["refused"]
    if OUTCOMES[number]["refused"] == "run":  # (by key)
        assert main(["run", "study.toml", "--dry-run"]) == 2
        return
    assert main(["status", "out", "--verify"]) == 0
    assert main(["report", "out", "--format", "md", "--out", "page"]) == 0
    with xr.open_dataset("out/results.nc") as results:
        check_results(results)
