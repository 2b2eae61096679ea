"""Validation from end to end: files, predictions of before, measured inputs, errors."""

import csv
import math

import pytest
from experiment_tables import ROW, granite_folder, table_of

from toppling.benchmarks.experiments import validate
from toppling.benchmarks.experiments.table import ExperimentError

WIDE = {**ROW, "id": "two", "width_m": "0.8", "overturned": "0"}
VALUE = {**ROW, "id": "three", "piece": "contact", "kind": "friction", "predict": "friction", "contact": "concrete",
         "quantity": "static friction", "value": "0.4", "trials": "", "overturned": ""}  # fmt: skip
WHY = {**ROW, "id": "four", "predict": "no: size not given", "width_m": ""}
BAND = {**ROW, "id": "five", "piece": "rock", "predict": "replay", "measure": "PGV/PGA", "level_low": "0",
        "level_high": "0.03", "motion": "history", "trials": "1", "overturned": "0"}  # fmt: skip


@pytest.fixture
def table(tmp_path):
    return table_of(tmp_path / "t.csv", ROW, WIDE, VALUE, WHY, BAND)


def rows_of(path):
    with path.open(encoding="utf-8", newline="") as stream:
        return {row["id"]: row for row in csv.DictReader(stream)}


def test_from_end_to_end(table, tmp_path):
    out = tmp_path / "out"
    found = validate.validate(table, out, granite_folder(tmp_path / "g", (0, 1)))
    names = {path.name for path in out.iterdir()}
    assert names == {"predictions.csv", "measured.csv", "outcomes.csv", "calibration.png"}
    made = rows_of(out / "predictions.csv")
    rows = {one.row.test.id: one for one in found.rows}
    assert list(made) == list(rows) == ["one", "two", "three", "four", "five"]
    assert float(made["one"]["predicted"]) == pytest.approx(rows["one"].prediction.value)
    assert (rows["one"].observed, made["four"]["how"]) == (0.75, "size not given")
    assert rows["five"].overlap
    seen = rows_of(out / "outcomes.csv")
    assert list(seen) == ["one", "two", "three", "five"]
    assert (seen["one"]["observed"], seen["five"]["overlap"]) == ("0.75", "True")
    assert found.scores["all"].trials == 9
    assert [one.rock for one in found.granite] == [1, 2]
    assert (found.granite[0].overturned, found.granite[0].runs, found.granite[0].twin) == (0, 2, 0.0)


@pytest.mark.slow
def test_predictions_hold_no_outcome(table, tmp_path):
    """The file of predictions is the same to the byte whatever came out."""
    other = table_of(tmp_path / "o.csv", {**ROW, "overturned": "0"}, {**WIDE, "overturned": "4"},
                     {**VALUE, "value": "0.9"}, WHY, {**BAND, "overturned": "1"})  # fmt: skip
    for path in (table, other):
        validate.validate(path, tmp_path / path.stem)
    first, second = ((tmp_path / name / "predictions.csv").read_bytes() for name in ("t", "o"))
    assert first == second


@pytest.mark.slow
def test_predictions_of_before_are_taken_as_they_are(table, tmp_path, monkeypatch):
    """To the byte, values and reasons, though the code would predict something else now."""
    before = tmp_path / "before"
    validate.validate(table, before)
    plain = validate.predict

    def other(test, replays=None):
        found = plain(test, replays)
        return found._replace(value=0.25, how="otherwise") if found.made else found

    monkeypatch.setattr(validate, "predict", other)
    monkeypatch.setattr(validate, "code_digest", lambda: "other code")
    validate.validate(table, tmp_path / "now", blind=before / "predictions.csv")
    assert (tmp_path / "now" / "predictions.csv").read_bytes() == (before / "predictions.csv").read_bytes()
    validate.validate(table, tmp_path / "fresh")
    assert rows_of(tmp_path / "fresh" / "predictions.csv")["one"]["predicted"] == "0.25"


@pytest.mark.slow
def test_rows_that_have_a_value_now_get_it(table, tmp_path):
    before = tmp_path / "before"
    validate.validate(table, before)
    granite = granite_folder(tmp_path / "g", (0, 1))
    validate.validate(table, tmp_path / "now", granite, blind=before / "predictions.csv")
    made, now = rows_of(before / "predictions.csv"), rows_of(tmp_path / "now" / "predictions.csv")
    assert (made["five"]["predicted"], made["four"]) == ("", now["four"])
    assert float(now["five"]["predicted"]) >= 0.0


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("granite_folder", "granite_table_motions.npz: no such file"),
        ("blind", "nowhere: has no predictions"),
    ],
)
def test_errors_are_sentences(table, tmp_path, given, said):
    with pytest.raises(ExperimentError, match=said):
        validate.validate(table, tmp_path / "out", **{given: tmp_path / "nowhere"})
    assert not (tmp_path / "out").exists()


def test_measured_rows_stand_beside_blind_ones(tmp_path):
    row = {**ROW, "measured_cm_height_m": "0.6", "measured_inertia_factor": "1.4", "measured_from": "its table"}
    found = validate.validate(table_of(tmp_path / "m.csv", row, WIDE), tmp_path / "out")
    assert list(rows_of(tmp_path / "out" / "measured.csv")) == ["one"]
    one, two = found.rows
    assert one.measured.value != one.prediction.value
    assert two.measured is None
    assert found.scores["with measured inputs"].trials == 4
    assert math.isnan(found.classes["cabinet"].ratio)
