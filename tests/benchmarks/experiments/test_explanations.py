"""Explanations: each changes what it says alone."""

from dataclasses import replace

import pytest
from experiment_tables import ROW, granite_folder, row_of, table_of

import toppling as tp
from toppling.benchmarks.experiments import explanations
from toppling.benchmarks.experiments.predictions import predict
from toppling.benchmarks.experiments.replays import HALF_WIDTHS, read_runs, replay
from toppling.benchmarks.experiments.specimens import blocks_of
from toppling.benchmarks.experiments.table import read_experiments


class TestRocks:
    def test_the_first_scene_is_the_blind_replay(self, tmp_path):
        known = replay(*read_runs(granite_folder(tmp_path / "g", (0, 1))))
        scenes = explanations.rock_scenes(known)
        assert scenes[0][1] == known.overturned[len(HALF_WIDTHS) // 2].sum()
        assert len({change for change, _, _ in scenes}) == len(scenes)
        assert all(0.0 <= slow <= fell <= len(known.runs) for _, fell, slow in scenes)


class TestScenes:
    def test_poles_and_medians(self, tmp_path):
        pole = {**ROW, "fixing": "pole", "mass_kg": "100", "placement": "wall"}
        median = {**ROW, "id": "two", "predict": "median", "measure": "PGA", "unit": "m/s2", "level_low": "",
                  "level_high": ""}  # fmt: skip
        rows = read_experiments(table_of(tmp_path / "t.csv", pole, median, {**ROW, "id": "three"}))
        found = explanations.scenes(rows)
        assert {one.id for one in found} == {"one", "two"}
        before = {one.id: one.before for one in found}
        assert before["one"] == pytest.approx(predict(rows[0].test).value)
        with_change = {(one.id, one.change): one.predicted for one in found}
        loose = row_of(tmp_path, **{**pole, "fixing": ""})
        assert with_change["one", "no poles"] == pytest.approx(
            predict(loose.test).value, abs=0.2
        )  # (linear, not exact)
        (restitution,) = (value for (name, change), value in with_change.items() if name == "two" and "0.9" in change)
        assert restitution != before["two"]

    def test_a_change_of_a_pole_changes_it_alone(self, tmp_path):
        (block,) = blocks_of(row_of(tmp_path, fixing="pole", mass_kg="100", placement="wall").test)
        changed = {name: make(block) for name, make in explanations.POLES.items()}
        free = changed["no wall behind it"]
        assert (free.wall, free.restraint) == (None, block.restraint)
        assert changed["no poles"].restraint is None
        assert changed["no poles"].wall == block.wall
        slipping = changed["poles that slip off at 1.5 times their force"].restraint
        assert slipping == replace(block.restraint, strength=slipping.strength)
        assert slipping.strength < block.restraint.strength

    def test_a_raised_mass_centre(self):
        block = explanations._raised(tp.Block(0.4, 1.8))
        assert block.h == pytest.approx(0.99)
        assert block.gyration == pytest.approx(tp.Block(0.4, 1.8).gyration)
