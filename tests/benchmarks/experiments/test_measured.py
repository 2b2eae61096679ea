"""Second predictions: they change what was measured and nothing else, and know no outcome of their own record."""

import csv
from pathlib import Path

import numpy as np
from experiment_tables import granite_folder, row_of, table_of

import toppling as tp
from toppling.benchmarks.experiments.halves import RESAMPLES, best_candidate, fit_halves, halves_of
from toppling.benchmarks.experiments.predictions import predict, predict_measured
from toppling.benchmarks.experiments.replays import read_granite_outcomes, read_runs, replay
from toppling.benchmarks.experiments.results import fitted_band, granite
from toppling.benchmarks.experiments.specimens import blocks_of, law_of, not_sliding
from toppling.benchmarks.experiments.table import read_experiments
from toppling.benchmarks.experiments.validate import second_prediction

OWN = Path(__file__).resolve().parents[3] / "docs" / "experiments.csv"
OUTCOMES = ("overturned", "value", "dispersion", "outcome")
MEASURED = {"measured_cm_height_m": "0.8", "measured_inertia_factor": "1.4", "measured_restitution": "0.9",
            "measured_friction": "0.3", "measured_from": "its own table"}  # fmt: skip


class TestMeasuredInputs:
    def test_they_change_the_block_its_law_and_friction_alone(self, tmp_path):
        row = row_of(tmp_path, contact="carpet", **MEASURED)
        (block,), (plain,) = blocks_of(row.test, row.measured), blocks_of(row.test)
        assert (block.h, block.inertia_factor, block.width) == (0.8, 1.4, plain.width)
        assert plain.h == 0.9
        assert law_of(row.test, row.measured).e == 0.9
        assert law_of(row.test).e is None
        assert not_sliding(row.test, block, row.measured) == 1.0
        assert not_sliding(row.test, tp.Block(1.0, 1.8), row.measured) == 0.0
        assert 0.0 < not_sliding(row.test, block) < 1.0

    def test_the_second_prediction_is_the_first_of_the_measured_block(self, tmp_path):
        """A lower mass centre: the same as a plain run of that block, and the blind prediction stays as it was."""
        row = row_of(tmp_path, measured_cm_height_m="0.5", measured_inertia_factor="1.5", measured_from="its table")
        plain = row_of(tmp_path)
        assert repr(predict(row.test)) == repr(predict(plain.test))
        found = predict_measured(row.test, row.measured)
        assert found.value < predict(row.test).value
        assert found.how.endswith("its table")
        same = row_of(tmp_path, measured_cm_height_m="0.9", measured_inertia_factor=repr(4.0 / 3.0), measured_from="x")
        assert predict_measured(same.test, same.measured).value == predict(same.test).value

    def test_outcomes_removed_change_nothing(self, tmp_path):
        with OWN.open(encoding="utf-8", newline="") as stream:
            rows = [row for row in csv.DictReader(stream) if row["measured_from"]]
        assert rows
        removed = [{**row, **dict.fromkeys(OUTCOMES, "")} for row in rows]
        found = [
            [second_prediction(row, None, []) for row in read_experiments(table_of(tmp_path / "t.csv", *table))]
            for table in (rows, removed)
        ]
        assert repr(found[0]) == repr(found[1])


class TestHalves:
    def test_records_stay_whole(self):
        which = halves_of(["b", "a", "c", "b", "d", "a"])
        assert which.tolist() == [1, 0, 0, 1, 1, 0]

    def test_the_middle_one_of_those_that_are_equal(self):
        assert best_candidate(np.array([[1.0, 3, 3, 3, 2], [5, 1, 5, 0, 0]])).tolist() == [2, 0]

    def fitted(self, overturned):
        """Candidates that overturn above a level of their own; the truth is the third of five."""
        levels = np.tile(np.linspace(0.1, 1.0, 10), 8)
        records = [f"r{i // 10}" for i in range(80)]
        flags = levels > np.array([0.2, 0.4, 0.55, 0.7, 0.9])[:, None]
        truth = flags[2] if overturned is None else overturned
        return flags, truth, records, fit_halves(flags, truth, records, levels)

    def test_it_finds_the_truth_and_scores_it_on_the_other_half(self):
        flags, truth, _, found = self.fitted(None)
        assert [half.fitted for half in found.halves] == [2, 2]
        assert [half.right for half in found.halves] == [1.0, 1.0]
        assert [half.runs for half in found.halves] == [40, 40]
        np.testing.assert_array_equal(found.predicted, truth)
        assert found.resampled.shape == (RESAMPLES, 80)
        assert all(half.pgv == 1.0 for half in found.halves)
        assert all(half.predicted_lower <= half.predicted <= half.predicted_upper for half in found.halves)
        assert flags[0].sum() > truth.sum()

    def test_outcomes_of_a_half_leave_its_own_predictions_alone(self):
        """With all outcomes of one half turned round, that half is predicted as before; the other half is not."""
        _, truth, records, before = self.fitted(None)
        own = halves_of(records) == 0
        _, _, _, after = self.fitted(np.where(own, ~truth, truth))
        np.testing.assert_array_equal(after.predicted[own], before.predicted[own])
        np.testing.assert_array_equal(after.resampled[:, own], before.resampled[:, own])
        assert (after.predicted[~own] != before.predicted[~own]).any()

    def test_a_band_of_a_rock(self, tmp_path):
        folder = granite_folder(tmp_path / "g", (0, 1))
        replays = replay(*read_runs(folder))
        rocks = granite(replays, read_granite_outcomes(folder, replays.runs))
        row = row_of(tmp_path, piece="rock", predict="replay", measure="PGV/PGA", level_low="0", level_high="1",
                  motion="history", trials="2", overturned="1", specimen="granite rock 2, a part")  # fmt: skip
        found = fitted_band(row, replays, rocks)
        assert found.value == rocks[1].fits.predicted.mean()
        assert found.lower <= found.value <= found.upper
        assert fitted_band(row_of(tmp_path, specimen="a rock"), replays, rocks) is None
