"""`toppling validate` from end to end: files, what is kept after an interruption, errors, and what is printed."""

import csv
import json

import pytest
from experiment_tables import ROW, forget_motions, granite_folder, table_of, take_motions

from toppling.studies.command.cli import main
from toppling.studies.validation import validate

WIDE = {**ROW, "id": "two", "width_m": "0.8", "overturned": "0"}
VALUE = {**ROW, "id": "three", "piece": "contact", "kind": "friction", "predict": "friction", "contact": "concrete",
         "quantity": "static friction", "value": "0.4", "trials": "", "overturned": ""}  # fmt: skip
WHY = {**ROW, "id": "four", "predict": "no: size not given", "width_m": ""}
BAND = {**ROW, "id": "five", "piece": "rock", "predict": "replay", "measure": "PGV/PGA", "level_low": "0",
        "level_high": "0.03", "motion": "history", "trials": "1", "overturned": "0"}  # fmt: skip


@pytest.fixture(autouse=True)
def few_motions(monkeypatch):
    take_motions(monkeypatch, 4)
    yield
    forget_motions()


@pytest.fixture
def table(tmp_path):
    return table_of(tmp_path / "t.csv", ROW, WIDE, VALUE, WHY, BAND)


def rows_of(path):
    with path.open(encoding="utf-8", newline="") as stream:
        return {row["id"]: row for row in csv.DictReader(stream)}


class TestCommand:
    def test_from_end_to_end(self, table, tmp_path, capsys):
        pulses = tmp_path / "pulses.csv"
        pulses.write_text("file,time,pgv_over_pga_s,pga_g,toppled\na,t,0.1,0.2,0\na,t,0.1,0.4,1\n", encoding="utf-8")
        granite = granite_folder(tmp_path / "g", (0, 1))
        out = tmp_path / "out"
        given = ["validate", str(table), "--out", str(out), "--granite", str(granite), "--pulses", str(pulses)]
        assert main(given) == 0
        printed = capsys.readouterr().out
        assert len(printed.splitlines()) < 40
        for said in (
            "5 rows, 4 predicted",
            "granite rock 1: 0 of 2 runs fell",
            "pulses a: 1 of 2 toppled",
            "friction: ",
        ):
            assert said in printed
        assert {path.name for path in out.iterdir()} == {*validate.NAMES, ".toppling.json"}
        made, found = rows_of(out / "predictions.csv"), rows_of(out / "validation.csv")
        assert list(made) == list(found) == ["one", "two", "three", "four", "five"]
        assert found["one"]["predicted"] == made["one"]["predicted"]
        assert (float(found["one"]["observed"]), found["four"]["how"]) == (0.75, "size not given")
        assert found["five"]["intervals overlap"] == "yes"
        scores = json.loads((out / "scores.json").read_text(encoding="utf-8"))
        assert scores["overall"]["brier"]["trials"] == 9
        assert [one["rock"] for one in scores["granite"]] == [1, 2]
        assert scores["granite"][0]["twin"] == 0.0

    @pytest.mark.slow
    def test_predictions_hold_no_outcome(self, table, tmp_path):
        """The file of predictions is the same to the byte whatever came out."""
        other = table_of(tmp_path / "o.csv", {**ROW, "overturned": "0"}, {**WIDE, "overturned": "4"},
                         {**VALUE, "value": "0.9"}, WHY, {**BAND, "overturned": "1"})  # fmt: skip
        for path in (table, other):
            assert main(["validate", str(path), "--out", str(tmp_path / path.stem)]) == 0
        first, second = ((tmp_path / name / "predictions.csv").read_bytes() for name in ("t", "o"))
        assert first == second

    @pytest.mark.slow
    def test_an_interrupted_run_goes_on(self, table, tmp_path, capsys, monkeypatch):
        out, asked = tmp_path / "out", []
        plain = validate.predict

        def counting(test, replays=None):
            asked.append(test.id)
            if len(asked) == 3:
                raise KeyboardInterrupt
            return plain(test, replays)

        monkeypatch.setattr(validate, "predict", counting)
        assert main(["validate", str(table), "--out", str(out)]) == 130
        said = capsys.readouterr().err
        assert "run the same command again to go on" in said
        assert list(rows_of(out / "predictions.csv")) == ["one", "two"]
        assert main(["validate", str(table), "--out", str(out)]) == 0
        assert asked == ["one", "two", "three", "three", "four", "five"]
        assert main(["validate", str(table), "--out", str(out)]) == 0
        assert len(asked) == 6
        kept = (out / "predictions.csv").read_bytes()
        monkeypatch.setattr(validate, "predict", plain)
        assert main(["validate", str(table), "--out", str(tmp_path / "fresh")]) == 0
        assert (tmp_path / "fresh" / "predictions.csv").read_bytes() == kept

    @pytest.mark.slow
    def test_changed_tests_are_predicted_again(self, table, tmp_path):
        out = tmp_path / "out"
        assert main(["validate", str(table), "--out", str(out)]) == 0
        before = rows_of(out / "predictions.csv")
        table_of(table, {**ROW, "width_m": "0.9"}, WIDE, VALUE, WHY, BAND)
        assert main(["validate", str(table), "--out", str(out)]) == 0
        after = rows_of(out / "predictions.csv")
        assert after["one"]["inputs"] != before["one"]["inputs"]
        assert float(after["one"]["predicted"]) < float(before["one"]["predicted"])
        assert after["two"] == before["two"]

    @pytest.mark.parametrize(
        ("more", "said"),
        [
            (["--granite", "nowhere"], "granite_table_motions.npz: no such file"),
            (["--pulses", "nowhere.csv"], "nowhere.csv: no such file"),
        ],
    )
    def test_errors_are_sentences(self, table, tmp_path, capsys, more, said):
        assert main(["validate", str(table), "--out", str(tmp_path / "out"), *more]) == 2
        printed = capsys.readouterr().err
        assert said in printed
        assert "Traceback" not in printed
        assert not (tmp_path / "out").exists()


class TestBlind:
    @pytest.mark.slow
    def test_predictions_of_before_are_taken_as_they_are(self, table, tmp_path, monkeypatch):
        """To the byte, values and reasons, though the code would predict something else now."""
        before = tmp_path / "before"
        assert main(["validate", str(table), "--out", str(before)]) == 0
        plain = validate.predict

        def other(test, replays=None):
            found = plain(test, replays)
            return found._replace(value=0.25, how="otherwise") if found.made else found

        monkeypatch.setattr(validate, "predict", other)
        monkeypatch.setattr(validate, "code_digest", lambda: "other code")
        given = ["--blind", str(before / "predictions.csv")]
        assert main(["validate", str(table), "--out", str(tmp_path / "now"), *given]) == 0
        assert (tmp_path / "now" / "predictions.csv").read_bytes() == (before / "predictions.csv").read_bytes()
        assert main(["validate", str(table), "--out", str(tmp_path / "fresh")]) == 0
        assert rows_of(tmp_path / "fresh" / "predictions.csv")["one"]["predicted"] == "0.25"

    @pytest.mark.slow
    def test_rows_that_have_a_value_now_get_it(self, table, tmp_path):
        before = tmp_path / "before"
        assert main(["validate", str(table), "--out", str(before)]) == 0
        given = ["--blind", str(before / "predictions.csv"), "--granite", str(granite_folder(tmp_path / "g", (0, 1)))]
        assert main(["validate", str(table), "--out", str(tmp_path / "now"), *given]) == 0
        made, now = rows_of(before / "predictions.csv"), rows_of(tmp_path / "now" / "predictions.csv")
        assert (made["five"]["predicted"], made["four"]) == ("", now["four"])
        assert float(now["five"]["predicted"]) >= 0.0

    def test_errors_are_sentences(self, table, tmp_path, capsys):
        assert main(["validate", str(table), "--out", str(tmp_path / "out"), "--blind", "nowhere.csv"]) == 2
        assert "nowhere.csv: has no predictions" in capsys.readouterr().err


class TestSecond:
    def test_measured_rows_stand_beside_blind_ones(self, tmp_path):
        row = {**ROW, "measured_cm_height_m": "0.6", "measured_inertia_factor": "1.4", "measured_from": "its table"}
        out = tmp_path / "out"
        assert main(["validate", str(table_of(tmp_path / "m.csv", row, WIDE)), "--out", str(out)]) == 0
        (name,) = rows_of(out / "measured.csv")
        assert name == "one"
        found = rows_of(out / "validation.csv")
        assert found["one"]["with measured inputs"] == rows_of(out / "measured.csv")["one"]["predicted"]
        assert found["one"]["predicted"] == rows_of(out / "predictions.csv")["one"]["predicted"]
        assert found["two"]["with measured inputs"] == ""
        scores = json.loads((out / "scores.json").read_text(encoding="utf-8"))
        assert scores["measured"]["brier"]["trials"] == 4
        assert scores["classes"]["cabinet"]["ratio"] is None

    def test_pulses_are_fitted_on_half(self, tmp_path):
        pulses = tmp_path / "pulses.csv"
        lines = [f"a,t,{r},{a},{int(a > 0.15)}" for r in (0.1, 0.2, 0.3, 0.4) for a in (0.05, 0.4)]
        pulses.write_text("file,time,pgv_over_pga_s,pga_g,toppled\n" + "\n".join(lines) + "\n", encoding="utf-8")
        row = {**WHY, "id": "set-a", "motion": "pulse", "trials": "8", "overturned": "4"}
        given = ["validate", str(table_of(tmp_path / "p.csv", ROW, row)), "--pulses", str(pulses)]
        assert main([*given, "--out", str(tmp_path / "out")]) == 0
        found = rows_of(tmp_path / "out" / "measured.csv")["set-a"]
        assert 0.0 <= float(found["predicted"]) <= 1.0
        assert "fitted on the other half" in found["how"]
        table_of(tmp_path / "p.csv", ROW, {**row, "trials": "9"})
        assert main([*given, "--out", str(tmp_path / "again")]) == 2
