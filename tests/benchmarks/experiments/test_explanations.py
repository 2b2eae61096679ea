"""Explanations and known relations: each changes what it says alone, and the relations are those of their formulas."""

import math

import numpy as np
import pytest
from experiment_tables import ROW, forget_motions, granite_folder, table_of, take_motions

import toppling as tp
from toppling.benchmarks.experiments import explanations, relations
from toppling.benchmarks.experiments.ensembles import motions_of
from toppling.benchmarks.experiments.figures import relations_figure
from toppling.benchmarks.experiments.predictions import predict
from toppling.benchmarks.experiments.replays import CM_HEIGHT, GYRATION_SQUARED, HALF_WIDTHS, read_runs, replay
from toppling.benchmarks.experiments.specimens import blocks_of
from toppling.benchmarks.experiments.table import read_experiments
from toppling.motions.arrays import records


@pytest.fixture(autouse=True)
def few_motions(monkeypatch):
    take_motions(monkeypatch, 6)
    yield
    forget_motions()


class TestRocks:
    def test_the_first_scene_is_the_blind_replay(self, tmp_path):
        known = replay(*read_runs(granite_folder(tmp_path / "g", (0, 1))))
        scenes = explanations.rock_scenes(known)
        assert scenes[0].predicted == known.overturned[len(HALF_WIDTHS) // 2].sum()
        assert len({one.change for one in scenes}) == len(scenes)
        assert all(0.0 <= one.long_period <= one.predicted <= len(known.runs) for one in scenes)

    def test_a_lopsided_rock_has_the_weak_side_in_front(self):
        """The mass centre lies the weak half-width behind the front edge and the strong one before the back edge."""
        block = explanations._lopsided(0.033)
        assert 0.5 * block.width - block.cm_offset == pytest.approx(0.033)
        assert 0.5 * block.width + block.cm_offset == pytest.approx(explanations.STRONG_SIDE)
        assert block.h == CM_HEIGHT
        assert block.gyration**2 == pytest.approx(GYRATION_SQUARED)
        weak, strong = (
            bool(
                tp.simulate(block, tp.HousnerImpact(), tp.motions.from_array(np.full(200, sign * 0.2 * 9.81), 0.01))[
                    "overturned"
                ]
            )
            for sign in (-1.0, 1.0)
        )
        assert (weak, strong) in {(True, False), (False, True)}


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
        loose = read_experiments(table_of(tmp_path / "l.csv", {**pole, "fixing": ""}))[0]
        assert with_change["one", "no poles"] == pytest.approx(
            predict(loose.test).value, abs=0.2
        )  # (linear, not exact)
        assert with_change["two", "restitution: 0.9 times Housner's"] != before["two"]

    def test_a_change_of_a_pole_changes_it_alone(self, tmp_path):
        pole = {**ROW, "fixing": "pole", "mass_kg": "100", "placement": "wall"}
        (block,) = blocks_of(read_experiments(table_of(tmp_path / "t.csv", pole))[0].test)
        changed = {name: make(block) for name, make in explanations.POLES}
        assert changed["no wall behind it"].wall is None
        assert changed["no wall behind it"].restraint == block.restraint
        assert changed["no poles"].restraint is None
        assert changed["no poles"].wall == block.wall
        assert explanations._pole(block, 200.0, 2000.0, 50e3).restraint == block.restraint

    def test_a_raised_mass_centre(self):
        block = explanations._raised(tp.Block(0.4, 1.8))
        assert block.h == pytest.approx(0.99)
        assert block.gyration == pytest.approx(tp.Block(0.4, 1.8).gyration)


class TestRelations:
    def test_by_their_formulas(self):
        found = {one.name: one.median for one in relations.relations()}
        width = 0.2 * 1.8
        at = int(np.flatnonzero(relations.RATIOS == 0.2)[0])
        assert found["start of rocking, g B/H"][at] == pytest.approx(0.2 * 9.80665)
        assert found["Japanese criterion, acceleration"][at] == pytest.approx(0.24 * 9.80665)
        cm = 10.0 * 36.0 / math.sqrt(180.0)
        assert found["Ishiyama 1984, velocity"][at] == pytest.approx(0.01 * cm)
        assert found["Japanese criterion, velocity"][at] == pytest.approx(0.01 * cm * 1.2**2.5)
        assert found["FEMA P-58, regression"][at] == pytest.approx(
            math.exp(1.05 + 1.48 * math.log(width) - 1.07 * math.log(1.8)), rel=0.01
        )  # (coefficients of three digits)

    @pytest.mark.slow
    def test_computed_medians(self):
        """The third of six capacities, by plain runs; as PGV it is the third of the same runs' PGV."""
        one = next(each for each in relations.own() if each.kind == "broadband")
        at = 1
        block, pga, pgv = tp.Block(relations.RATIOS[at] * 1.8, 1.8), [], []
        for record in records(motions_of("broadband")):
            unit = record.acceleration / np.abs(record.acceleration).max()
            falls = (
                bool(tp.simulate(block, tp.HousnerImpact(), tp.motions.from_array(a * unit, record.dt))["overturned"])
                for a in relations.LEVELS
            )
            pga.append(next(a for a, fell in zip(relations.LEVELS, falls, strict=False) if fell))
            speed = np.concatenate([[0.0], np.cumsum(0.5 * (unit[1:] + unit[:-1])) * record.dt])
            pgv.append(pga[-1] * np.abs(speed).max())
        assert one.pga[1, at] == pytest.approx(sorted(pga)[2])
        assert one.pgv[1, at] == pytest.approx(sorted(pgv)[2], rel=0.02)

    def test_the_figure_names_every_relation(self):
        figure = relations_figure(relations.relations(), relations.own())
        named = {text.get_text() for ax in figure.axes for text in ax.get_legend().get_texts()}
        for one in relations.relations():
            assert any(name.startswith(one.name) and ("recalled" in name) == (one.quality == "D") for name in named)
