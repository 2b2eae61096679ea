"""Predictions: they know no outcome, and agree with what is known in closed form or by another way."""

import csv
import math
import random
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from experiment_tables import granite_folder, row_of, table_of

import toppling as tp
from toppling.benchmarks.experiments import ensembles, replays
from toppling.benchmarks.experiments.ensembles import jma_intensity
from toppling.benchmarks.experiments.predictions import Prediction, predict
from toppling.benchmarks.experiments.replays import Replays, Run, read_granite_outcomes, read_runs, replay, rock
from toppling.benchmarks.experiments.specimens import blocks_of, law_of, not_sliding
from toppling.benchmarks.experiments.table import ExperimentError, read_experiments
from toppling.motions.arrays import records

OWN = Path(__file__).resolve().parents[3] / "docs" / "experiments.csv"
OUTCOMES = ("overturned", "value", "dispersion", "outcome")


def one(tmp_path, **changes):
    return row_of(tmp_path, **changes).test


class TestBlind:
    @pytest.mark.slow
    def test_outcomes_removed_or_exchanged_change_nothing(self, tmp_path):
        with OWN.open(encoding="utf-8", newline="") as stream:
            rows = [row for row in csv.DictReader(stream) if not row["predict"].startswith(("no", "replay"))]
        assert len(rows) > 10
        removed = [{**row, **dict.fromkeys(OUTCOMES, "")} for row in rows]
        order = random.Random(1).sample(range(len(rows)), len(rows))
        exchanged = [{**row, **{name: rows[i][name] for name in OUTCOMES}} for row, i in zip(rows, order, strict=True)]
        for row in exchanged:  # (a count of another row may be larger than the trials)
            row["overturned"] = "0" if row["trials"] and row["overturned"] else ""
        predicted = [
            [predict(row.test) for row in read_experiments(table_of(tmp_path / "t.csv", *table))]
            for table in (rows, removed, exchanged)
        ]
        for each in zip(*predicted, strict=True):
            assert all(repr(other) == repr(each[0]) for other in each)

    def test_a_test_has_no_field_of_its_outcome(self, tmp_path):
        fields = set(one(tmp_path).__dataclass_fields__)
        assert not fields & set(OUTCOMES)
        assert {"trials", "levels"} <= fields


class TestCounts:
    def test_it_is_the_mean_of_plain_runs(self, tmp_path):
        """Every motion scaled by hand to its intensity, run by `simulate` both ways."""
        test = one(tmp_path, width_m="0.5", level_low="5.8", level_high="6.2")
        found = predict(test)
        block, fallen = tp.Block(0.5, 1.8), []
        for i, record in enumerate(records(ensembles.GENERATORS["broadband"].sample(8, seed=1))):
            level = 5.8 + 0.4 * (i + 0.5) / 8
            factor = 10.0 ** (0.5 * (level - jma_intensity(record.acceleration, record.dt)))
            scaled = factor * record.acceleration
            assert jma_intensity(scaled, record.dt) == pytest.approx(level)
            for sign in (1.0, -1.0):
                run = tp.simulate(block, tp.HousnerImpact(), tp.motions.from_array(sign * scaled, record.dt))
                fallen.append(float(run["overturned"]))
        assert found.value == pytest.approx(np.mean(fallen))
        lower, upper = tp.fragility.binomial_interval(sum(fallen) / 2, 8)
        assert (found.lower, found.upper) == pytest.approx((float(lower), float(upper)))

    def test_two_specimens_and_two_kinds_are_of_equal_share(self, tmp_path):
        sizes = {"width_m": "0.4|0.9", "height_m": "1.8|1.2"}
        parts = [
            predict(one(tmp_path, width_m=b, height_m=h, motion=kind))
            for b, h in (("0.4", "1.8"), ("0.9", "1.2"))
            for kind in ("broadband", "near-fault")
        ]
        found = predict(one(tmp_path, motion="unspecified", **sizes))
        assert found.value == pytest.approx(np.mean([part.value for part in parts]))
        assert (found.lower, found.upper) == (min(part.lower for part in parts), max(part.upper for part in parts))

    def test_friction_takes_away_what_slides(self, tmp_path):
        free, held = one(tmp_path), one(tmp_path, contact="carpet")
        share = 1.0 - float(tp.models.friction.CONTACTS["carpet"].friction.below(0.4 / 1.8))
        assert not_sliding(held, blocks_of(held)[0]) == pytest.approx(share)
        assert predict(held).value == pytest.approx(share * predict(free).value)
        assert predict(free).value > 0.0

    def test_fixings(self, tmp_path):
        mass = {"mass_kg": "100", "placement": "wall"}
        (plain,), (wedged,), (poled,) = (
            blocks_of(one(tmp_path, fixing=fixing, **mass)) for fixing in ("", "wedge", "wedge and pole")
        )
        assert plain.wall.gap == 0.02
        assert (plain.lean, wedged.lean) == (0.0, -math.radians(1.0))
        assert poled.restraint.kind == "pole"
        assert law_of(one(tmp_path, fixing="pole", **mass)).geometry == "linear"
        assert law_of(one(tmp_path)).geometry == "exact"


class TestValues:
    @pytest.mark.slow
    def test_median_of_capacities(self, tmp_path):
        """By bisection: each motion's least peak acceleration among the levels that overturns."""
        found = predict(one(tmp_path, predict="median", measure="PGA", unit="m/s2", level_low="", level_high=""))
        block, capacities = tp.Block(0.4, 1.8), []
        levels = np.geomspace(0.5, 45.0, 90)
        for record in records(ensembles.motions_of("broadband")):
            unit = record.acceleration / np.abs(record.acceleration).max()
            falls = (
                bool(tp.simulate(block, tp.HousnerImpact(), tp.motions.from_array(a * unit, record.dt))["overturned"])
                for a in levels
            )
            capacities.append(next(a for a, fell in zip(levels, falls, strict=False) if fell))
        assert found.value == pytest.approx(sorted(capacities)[4])
        assert found.lower <= found.value <= found.upper
        assert found.dispersion > 0.0

    def test_restitution_is_housner_s(self, tmp_path):
        test = one(tmp_path, predict="restitution", slenderness="5")
        assert predict(test).value == pytest.approx(1.0 - 1.5 * math.sin(math.atan(0.2)) ** 2)
        assert predict(replace(test, quantity="restitution over Housner's")).value == 1.0

    def test_friction_of_a_contact(self, tmp_path):
        found = predict(one(tmp_path, predict="friction", contact="concrete", quantity="kinetic friction"))
        assert found.value == pytest.approx(0.9 * 0.5)
        assert found.upper == pytest.approx(0.45 * math.exp(1.959964 * 0.25))

    def test_what_is_not_predicted_says_why(self, tmp_path):
        found = predict(one(tmp_path, predict="no: size not given"))
        assert not found.made
        assert found.how == "size not given"
        bands = {"measure": "PGV/PGA", "level_low": "0", "motion": "history"}
        assert "TOPPLING_GRANITE" in predict(one(tmp_path, predict="replay", **bands)).how


class TestReplays:
    def test_runs_without_outcomes(self, tmp_path):
        found = [replay(*read_runs(granite_folder(tmp_path / "g", falls))) for falls in ((0, 0), (1, 1))]
        assert [run.test for run in found[0].runs] == ["1", "2"]
        np.testing.assert_array_equal(found[0].overturned, found[1].overturned)
        assert not found[0].overturned[:, 0].any()
        assert found[0].overturned[:, 1].all()
        outcomes = read_granite_outcomes(tmp_path / "g", found[0].runs)
        assert outcomes.overturned.all()
        assert outcomes.pgv.tolist() == [0.1, 0.1]

    def test_a_band_is_the_mean_over_half_widths(self, tmp_path):
        flags = np.array([[1, 1, 0, 1], [1, 0, 0, 1], [0, 0, 0, 1]], bool)
        runs = tuple(Run(str(i), "", ratio, np.zeros(2)) for i, ratio in enumerate((0.01, 0.02, 0.03, 0.2)))
        test = one(
            tmp_path, predict="replay", measure="PGV/PGA", level_low="0", level_high="0.03", motion="history"
        )  # fmt: skip
        found = predict(test, Replays(runs, flags, "x"))
        assert found[:4] == (test.id, pytest.approx(0.5), 0.0, 1.0)
        assert isinstance(found, Prediction)

    def test_the_rock(self):
        block = rock(0.053)
        assert block.alpha == pytest.approx(math.atan(0.053 / 0.293))
        assert block.gyration**2 == pytest.approx(0.0565)

    def test_errors(self, tmp_path):
        with pytest.raises(ExperimentError, match=r"granite_table_motions.npz: no such file"):
            read_runs(tmp_path)
        (tmp_path / replays.HISTORIES).write_text("no archive")
        with pytest.raises(ExperimentError, match="no archive of numpy arrays"):
            read_runs(tmp_path)
