"""Curves that cross: the answer names no first piece, and says between which levels which one is higher."""

import json

import numpy as np
import pytest
import xarray as xr
from scipy.stats import binomtest

import toppling as tp
from toppling.studies.command.verdict import verdict
from toppling.studies.report.crossed import (
    FEWEST_APART,
    crossed_pieces,
    crossing,
    crossings_of,
    curves_at,
    levels_of,
)
from toppling.studies.report.law_choice import law_choice
from toppling.studies.report.summary import plain_answer

STUDY = """
title = "Two pieces"
[[blocks]]
width_m = 0.4
height_m = 1.8
name = "shelf"
[[blocks]]
width_m = 0.42
height_m = 1.9
name = "rack"
[[models]]
law = "giannini-masiani"
[[models]]
law = "housner"
[motions]
generator = "clough-penzien"
number = 12
seed = 1
duration_s = 10
dt_s = 0.02
[ida]
im = "pga"
levels = { values = [0.1, 0.2, 0.4, 0.8, 1.6], unit = "g" }
[fit]
replicates = 200
"""
G = 9.80665


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("crossings")
    (folder / "study.toml").write_text(STUDY, encoding="utf-8")
    return tp.Study.from_toml(folder / "study.toml").run(folder / "out").load()


def with_curves(results, medians, dispersions):
    """The results with lognormal curves (block, model) of given medians (g) and dispersions."""
    found = results.copy(deep=True)
    found["median"][:] = np.array(medians) * G
    half = found["median"].where(found["median"] <= found["level"].max(), np.inf)
    found["half_level"][:], found["half_level_lower"][:], found["half_level_upper"][:] = half, half * 0.99, half * 1.01
    found["dispersion"][:] = np.array(dispersions)
    found["status"] = xr.full_like(found["status"].astype(object), "ok")
    return found


class TestCrossing:
    def test_by_hand(self):
        """Phi(ln(x/0.4)/0.2) and Phi(ln(x/0.45)/0.8) at 0.1 to 1.6: 0 and 0.030, 0.0003 and 0.155, 1/2 and 0.44, …"""
        levels = np.array([0.1, 0.2, 0.4, 0.8, 1.6])
        steep, flat = [0.0, 0.0003, 0.5, 0.9997, 1.0], [0.0300, 0.1554, 0.4414, 0.7638, 0.9436]
        found = crossing(np.array(steep), np.array(flat), levels)
        assert found.higher == [(0.4, 1.6)]
        assert found.lower == [(0.1, 0.2)]
        assert found.most_higher == pytest.approx(0.2359)
        assert found.most_lower == pytest.approx(0.1551)

    def test_small_differences_and_missing_curves(self):
        levels = np.array([1.0, 2.0])
        assert crossing(np.array([0.5, 0.5]), np.array([0.49, 0.9]), levels) is None
        assert crossing(np.array([0.5, 0.9]), np.array([0.4, 0.5]), levels) is None
        assert crossing(np.array([np.nan, np.nan]), np.array([0.4, 0.5]), levels) is None

    def test_order_of_pairs(self):
        """Those with the first curve first, then the greatest differences both ways."""
        levels = np.array([1.0, 2.0])
        curves = np.array([[0.5, 0.6], [0.4, 0.9], [0.1, 1.0], [0.0, 0.05]])
        found = list(crossings_of(curves, levels, [(0,), (1,), (2,), (3,)]))
        assert [(one[0], other[0]) for one, other, _ in found] == [(0, 2), (0, 1), (1, 2)]

    def test_levels_of_a_cloud(self):
        cloud = xr.Dataset(coords={"intensity": ("motion", [0.5, 8.0, np.nan, 2.0])})
        found = levels_of(cloud)
        assert (found[0], found[-1]) == (0.5, pytest.approx(8.0))

    def test_probabilities_are_those_of_the_fit(self, results):
        found = with_curves(results, [[0.4, 0.4], [9.0, 9.0]], [[0.2, 0.2], [0.8, 0.8]])
        at = curves_at(found, levels_of(found)).transpose("block", "model", "level").values
        assert at[0, 1] == pytest.approx([0.0, 0.000264, 0.5, 0.999736, 1.0], abs=1e-6)


class TestAnswer:
    def test_no_piece_is_the_first_where_curves_cross(self, results):
        found = with_curves(results, [[0.4, 0.4], [0.45, 0.45]], [[0.2, 0.2], [0.8, 0.8]])
        said = plain_answer(found)
        assert not any("vulnerable" in one for one in said)
        assert said[0] == (
            "Which piece is the most likely to overturn may depend on the level of shaking (peak ground acceleration), "
            "because the curves cross: “shelf” overturns more often than “rack” from 0.4 to 1.6 g (by up to 24 in 100 "
            "earthquakes), and less often from 0.1 to 0.2 g (by up to 16)."
        )
        assert said[1] == "With 12 motions, differences of less than 50 in 100 earthquakes may be chance."
        assert crossed_pieces(found) == said[:2]
        assert said[0] in verdict(found, True)  # (and the rest in the report)

    def test_the_fewest_motions_that_are_no_chance(self):
        """Of n motions that tell two equal pieces apart, all point one way with a probability of 2 · 2⁻ⁿ."""
        chance = [binomtest(n, n).pvalue for n in (FEWEST_APART - 1, FEWEST_APART)]
        assert chance == pytest.approx([2 / 32, 2 / 64])
        assert chance[1] < 0.05 < chance[0]

    def test_what_more_motions_would_not_change(self, results):
        """With 60 motions, differences of 10 and more in 100 earthquakes are no chance."""
        found = with_curves(results, [[0.4, 0.4], [0.45, 0.45]], [[0.2, 0.2], [0.8, 0.8]])
        screened = {**json.loads(found.attrs["screen"]), "fewest_motions": 60}
        (said,) = crossed_pieces(found.assign_attrs(screen=json.dumps(screened)))
        assert said.startswith("Which piece is the most likely to overturn depends on the level of shaking")

    def test_of_several_pairs(self, results):
        """Three curves that all cross: a pair with the piece that falls first, and the others in a second sentence."""
        found = with_curves(results, [[0.4, 0.4], [0.45, 0.45]], [[0.2, 0.2], [0.8, 0.8]])
        third = with_curves(results, [[0.5, 0.5], [0.5, 0.5]], [[1.5, 1.5], [1.5, 1.5]]).isel(block=[0])
        three = xr.concat([found, third.assign_coords(block=["chest"])], "block", data_vars="minimal")
        first, _, second = crossed_pieces(three.assign_attrs(results.attrs))
        assert "“shelf” overturns more often than" in first
        assert second.startswith("Likewise, “")
        assert second.count("more often than") == 2
        assert second.endswith(").")

    def test_a_piece_is_the_first_where_they_do_not(self, results):
        found = with_curves(results, [[0.3, 0.3], [0.6, 0.6]], [[0.4, 0.4], [0.4, 0.4]])
        assert plain_answer(found)[0] == "“shelf” is the more vulnerable of the 2 pieces."
        assert crossed_pieces(found) == []

    def test_a_median_that_is_not_reached_has_a_curve(self, results):
        """The curve of a piece whose median lies above the levels is compared within them."""
        found = with_curves(results, [[0.8, 0.8], [1.8, 1.8]], [[0.1, 0.1], [1.5, 1.5]])
        assert "less often from 0.1 to 0.4 g" in plain_answer(found)[0]

    def test_which_law_is_said_where_laws_agree(self, results):
        found = with_curves(results, [[0.4, 0.4], [0.9, 0.9]], [[0.2, 0.2], [0.2, 0.2]])
        assert plain_answer(found)[-1] == law_choice(found) != ""

    def test_laws_that_cross(self, results):
        found = with_curves(results, [[0.4, 0.4], [0.9, 0.9]], [[0.8, 0.2], [0.2, 0.2]])
        said = next(one for one in plain_answer(found) if "under another law" in one)
        # (Phi(ln 2/0.8) = 0.807 against Phi(ln 2/0.2) = 1.000, and the same the other way)
        assert (
            "may depend on the level of shaking, because the curves cross: under Giannini–Masiani (more often" in said
        )
        assert (
            "from 0.1 to 0.2 g, by up to 19 in 100 earthquakes, and less often from 0.8 to 1.6 g, by up to 19)" in said
        )
        assert law_choice(found) in said


class TestLawChoice:
    @staticmethod
    def of(*laws):
        return law_choice(xr.Dataset(coords={"model": [*laws], "law": ("model", [*laws])}))

    def test_the_reference_with_reason_and_source(self):
        said = self.of("discrete", "housner")
        assert said.startswith("Use the results under Housner’s impacts, for which this answer is given")
        assert "(Housner 1963)" in said
        assert "viscous" not in said

    def test_of_results_that_are_not_valid_nothing_is_to_be_used(self):
        said = law_choice(xr.Dataset(coords={"model": ["a", "b"], "law": ("model", ["discrete", "housner"])}), False)
        assert said.startswith("Once results are valid, use those under Housner’s impacts")

    def test_three_viscous_laws_are_one_reference(self):
        said = self.of("giannini-masiani", "makris-konstantinidis", "vassiliou", "housner")
        assert "Giannini–Masiani, Makris–Konstantinidis and Vassiliou et al. are viscous approximations of one" in said

    def test_without_the_reference(self):
        first = self.of("energy-consistent", "discrete")
        assert "Use the results under energy-consistent damping, for which this answer is given" in first
        second = self.of("discrete", "energy-consistent")
        assert "energy-consistent damping, not those under discrete damping, which are given here" in second
        none = self.of("discrete", "vassiliou")
        assert none.startswith("No law of this study is the rigid block with impacts (Housner 1963)")

    def test_nothing_to_choose(self):
        assert self.of("housner") == self.of("discrete", "discrete") == law_choice(xr.Dataset()) == ""
        branches = xr.Dataset(
            {"branch_rate": ("branch", [1.0])}, {"model": ["a", "b"], "law": ("model", ["housner", "discrete"])}
        )
        assert law_choice(branches) == ""
