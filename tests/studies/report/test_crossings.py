"""Curves that cross: the answer names no first piece, and has the levels between which each one is higher."""

import json

import numpy as np
import pytest
import xarray as xr
from check_facts import facts_of
from scipy.stats import binomtest
from study_texts import blocks, laws, motions, study_of

from toppling.studies.command.verdict import verdict
from toppling.studies.facts import answer_curves as curves
from toppling.studies.facts.crossed import FEWEST_APART, crossing, crossings_of, levels_of
from toppling.studies.facts.footnotes import footnotes
from toppling.studies.facts.law_choice import choice_of_law
from toppling.studies.facts.say import say
from toppling.studies.tables.fragility import curves_at

REST = """
[ida]
im = "pga"
levels = { values = [0.1, 0.2, 0.4, 0.8, 1.6], unit = "g" }
[fit]
replicates = 100
"""
CROSSED = ([[0.4, 0.4], [0.45, 0.45]], [[0.2, 0.2], [0.8, 0.8]])
G = 9.80665


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    parts = blocks(shelf=0.4), blocks(1.9, rack=0.42), laws("giannini-masiani", "housner"), motions(12), REST
    return study_of(tmp_path_factory.mktemp("crossings"), *parts).run()


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
        found = list(crossings_of(curves, levels, range(4)))
        assert [(one, other) for one, other, _ in found] == [(0, 2), (0, 1), (1, 2)]

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
        found = with_curves(results, *CROSSED)
        facts = facts_of(curves.answer, found)
        assert not {"curve.rank", "curve.crossing_too"} & facts.keys()
        fact = facts["curve.crossing"]
        assert fact.names == ("“shelf”", "“rack”")
        assert np.array(fact.more["higher"]) == pytest.approx(np.array([(0.4, 1.6)]))
        assert np.array(fact.more["lower"]) == pytest.approx(np.array([(0.1, 0.2)]))
        assert (fact.upper, fact.lower, fact.more["chance"]) == pytest.approx((0.236, 0.155, 6 / 12), abs=1e-3)
        assert "less often from 0.10 to 0.20 g (by up to 16\u00a0%). With so few motions" in say(fact, "page")
        assert say(fact, "page") in verdict(found, True)[0]

    def test_the_fewest_motions_that_are_no_chance(self):
        """Of n motions that tell two equal pieces apart, all point one way with a probability of 2 · 2⁻ⁿ."""
        chance = [binomtest(n, n).pvalue for n in (FEWEST_APART - 1, FEWEST_APART)]
        assert chance == pytest.approx([2 / 32, 2 / 64])
        assert chance[1] < 0.05 < chance[0]

    def test_what_more_motions_would_not_change(self, results):
        """With 60 motions, differences of 10 and more in 100 earthquakes are no chance."""
        found = with_curves(results, *CROSSED)
        screened = {**json.loads(found.attrs["screen"]), "fewest_motions": 60}
        fact = facts_of(curves.answer, found.assign_attrs(screen=json.dumps(screened)))["curve.crossing"]
        assert fact.more["chance"] == 0.1
        assert "chance" not in say(fact, "page")

    def test_of_several_pairs(self, results):
        found = with_curves(results, *CROSSED)
        third = with_curves(results, [[0.5, 0.5], [0.5, 0.5]], [[1.5, 1.5], [1.5, 1.5]]).isel(block=[0])
        three = xr.concat([found, third.assign_coords(block=["chest"])], "block", data_vars="minimal")
        every = [fact for fact in curves.answer(three.assign_attrs(results.attrs)) if "crossing" in fact.what]
        assert [fact.what for fact in every] == ["curve.crossing", "curve.crossing_too", "curve.crossing_too"]
        assert every[0].names[0] == "“shelf”"
        assert len({frozenset(fact.names) for fact in every}) == 3
        assert say(every[1], "page").startswith("Likewise, “")

    def test_a_piece_is_the_first_where_they_do_not(self, results):
        facts = facts_of(curves.answer, with_curves(results, [[0.3, 0.3], [0.6, 0.6]], [[0.4, 0.4], [0.4, 0.4]]))
        rank = facts["curve.rank"]
        assert (rank.value, rank.more["name"], rank.names) == (2, "“shelf”", ())
        assert "curve.crossing" not in facts

    def test_a_median_that_is_not_reached_has_a_curve(self, results):
        found = with_curves(results, [[0.8, 0.8], [1.8, 1.8]], [[0.1, 0.1], [1.5, 1.5]])
        lower = facts_of(curves.answer, found)["curve.crossing"].more["lower"]
        assert np.array(lower) == pytest.approx(np.array([(0.1, 0.4)]))

    def test_which_law_is_said_where_laws_agree(self, results):
        found = with_curves(results, [[0.4, 0.4], [0.9, 0.9]], [[0.2, 0.2], [0.2, 0.2]])
        assert "law.range" not in facts_of(curves.answer, found)
        assert facts_of(footnotes, found)["law.use_reference"].names == choice_of_law(found).names

    def test_laws_that_cross(self, results):
        found = with_curves(results, [[0.4, 0.4], [0.9, 0.9]], [[0.8, 0.2], [0.2, 0.2]])
        fact = facts_of(curves.answer, found)["law.crossing"]
        assert fact.names == ("Giannini–Masiani", "“shelf”")
        # (Phi(ln 2/0.8) = 0.807 against Phi(ln 2/0.2) = 1.000, and the same the other way)
        assert (fact.lower, fact.upper) == pytest.approx((0.193, 0.193), abs=1e-3)
        assert "less often from 0.80 to 1.6 g (by up to 19\u00a0%)" in say(fact, "page")


class TestLawChoice:
    @staticmethod
    def of(*laws):
        return choice_of_law(xr.Dataset(coords={"model": [*laws], "law": ("model", [*laws])}))

    def test_the_reference(self):
        fact = self.of("discrete", "housner")
        assert (fact.what, fact.names, fact.more["viscous"]) == ("law.use_reference", ("Housner’s impacts",), "")
        assert say(fact, "page") == "Use Housner (reference), the rigid block with impacts."

    def test_three_viscous_laws_are_one_reference(self):
        fact = self.of("giannini-masiani", "makris-konstantinidis", "vassiliou", "housner")
        viscous = "Giannini–Masiani, Makris–Konstantinidis and Vassiliou et al."
        assert (fact.what, fact.more["viscous"]) == ("law.use_reference", viscous)
        assert "confirms nothing" in say(fact, "page")
        assert "confirms nothing" in say(self.of("giannini-masiani", "vassiliou"), "page")

    def test_without_the_reference(self):
        first, second = self.of("energy-consistent", "discrete"), self.of("discrete", "energy-consistent")
        assert (first.what, first.names) == ("law.use_consistent", ("energy-consistent damping",))
        assert (second.what, second.names) == ("law.use_consistent", ("discrete damping",))
        assert [fact.more["consistent"] for fact in (first, second)] == [True, False]
        none = self.of("discrete", "vassiliou")
        assert (none.what, none.names) == ("law.use_missing", ("discrete damping",))

    def test_nothing_to_choose(self):
        assert self.of("housner") is self.of("discrete", "discrete") is choice_of_law(xr.Dataset()) is None
        branches = xr.Dataset(
            {"branch_rate": ("branch", [1.0])}, {"model": ["a", "b"], "law": ("model", ["housner", "discrete"])}
        )
        assert choice_of_law(branches) is None
