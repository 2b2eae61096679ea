"""Building codes: forces by hand, limits, exemptions clause by clause, and anchors by moments."""

import math
from dataclasses import replace

import pytest

from toppling.models import catalogue
from toppling.studies.buildings.pieces import SAFETY, component_of
from toppling.studies.codes.asce7 import Asce7, Factors, height_factor
from toppling.studies.codes.check import EXEMPT, REQUIRED, UNCHECKED, Component, anchor_demand
from toppling.studies.codes.eurocode8 import Eurocode8
from toppling.studies.inventory.contents import Contents

FACTORS = {"storage": Factors(1.4, 1.5, 1.0), "equipment": Factors(2.2, 2.0, 1.0)}


def shelf(**changes):
    return Component(**{"width": 0.4, "height": 2.0, "cm_height": 1.0, "kind": "storage", "mass": 100.0, **changes})


def machine(**changes):
    return shelf(kind="equipment", **changes)


def asce(category="D", **changes):
    return Asce7(**{"sds_g": 1.0, "design_category": category, "factors": FACTORS, **changes})


class TestAsce7:
    def test_the_force_by_hand(self):
        """H_f of half the height without a period is 2.25: 0.4 · 2.25/1.3 · 1.4/1.5 of the weight of 980.665 N."""
        found = asce().check(shelf(z=6.0, h=12.0))
        assert found.status == REQUIRED
        assert found.coefficient == pytest.approx(0.4 * 2.25 / 1.3 * 1.4 / 1.5, rel=1e-12)
        assert found.force == pytest.approx(found.coefficient * 980.665, rel=1e-12)
        assert "13.5-1" in found.clause

    @pytest.mark.parametrize(
        ("height", "period", "expected"),
        [
            (0.5, None, 2.25),
            (1.0, None, 3.5),
            (1.0, 0.2, 3.5),
            (1.0, 1.0, 1.0 + 1.0 + 0.84),
            (0.5, 1.0, 1.5 + 0.84 / 1024),
        ],
    )
    def test_the_height_factor(self, height, period, expected):
        assert height_factor(height, period) == pytest.approx(expected, rel=1e-12)

    def test_limits(self):
        low = asce(factors={"storage": Factors(1.0, 2.0)}).check(shelf(at_grade=True))
        assert low.coefficient == pytest.approx(0.3)  # 0.4/2 = 0.2 is below 0.3
        high = asce(sds_g=1.2, importance=1.5, factors={"storage": Factors(2.8, 1.3, 1.0)}).check(shelf(z=9.0, h=9.0))
        assert high.coefficient == pytest.approx(1.6 * 1.2 * 1.5)  # 0.4 · 3.5/1.3 · 2.8/1.3 = 2.3 is above 1.6
        assert "limited to 1.6" in high.factors

    def test_at_grade(self):
        """At grade neither height nor ductility of the building counts."""
        found = asce(r_mu=2.0, factors={"storage": Factors(9.0, 1.25, 1.2)}).check(shelf(at_grade=True))
        assert found.coefficient == pytest.approx(0.4 * 1.2 / 1.25)

    @pytest.mark.parametrize(
        ("code", "one", "status", "clause"),
        [
            (asce("A"), machine(importance=1.5), EXEMPT, "11.7"),
            (asce(), shelf(kind=""), UNCHECKED, "code_class"),
            (asce(), shelf(kind="furniture"), EXEMPT, "furniture"),
            (asce(), shelf(kind="movable"), EXEMPT, "movable"),
            (asce(), shelf(height=1.829), EXEMPT, "up to 1.829 m"),
            (asce(), shelf(height=1.83), REQUIRED, "13.5-1"),
            (asce("B"), shelf(), EXEMPT, "category B"),
            (asce("B"), shelf(importance=1.5), REQUIRED, "13.5-1"),
            (asce("C"), shelf(), REQUIRED, "13.5-1"),
            (asce(), shelf(kind="laboratory", height=0.9), REQUIRED, "13.5-1"),
            (asce("B"), machine(importance=1.5), EXEMPT, "category B"),
            (asce("C"), machine(anchored=True), EXEMPT, "category C"),
            (asce("C"), machine(), REQUIRED, "13.6-1"),
            (asce("C"), machine(anchored=True, importance=1.5), REQUIRED, "13.6-1"),
            (asce(), machine(anchored=True), UNCHECKED, "light and low"),
            (asce(), machine(anchored=True, cm_height=1.3), REQUIRED, "13.6-1"),
            (asce(), machine(anchored=True, mass=182.0), REQUIRED, "13.6-1"),
            (asce(), machine(anchored=True, mass=9.0, cm_height=1.5), UNCHECKED, "light and low"),
            (asce(), machine(anchored=True, mass=None), REQUIRED, "13.6-1"),
        ],
    )
    def test_who_must_be_anchored(self, code, one, status, clause):
        found = code.check(one)
        assert found.status == status
        assert clause in found.clause
        on_ground = code.check(replace(one, at_grade=True))
        assert math.isfinite(on_ground.coefficient) == (status == REQUIRED and one.kind != "laboratory")

    def test_what_is_missing_is_said(self):
        assert "C_AR and R_po" in asce().check(shelf(kind="laboratory")).factors
        found = asce().check(shelf())
        assert math.isnan(found.coefficient)
        assert "height of" in found.factors


class TestEurocode8:
    def test_the_force_by_hand(self):
        """A rigid shelf on the roof: 0.25 · 1.2 (3 · 2/2 - 0.5) = 0.75 g, halved by q_a = 2 of cabinets."""
        code = Eurocode8(0.25, 1.2, 0.0, building_period=0.8)
        found = code.check(shelf(z=9.0, h=9.0, safety=True))
        assert found.coefficient == pytest.approx(0.25 * 1.2 * 2.5 / 2.0, rel=1e-12)
        assert found.force == pytest.approx(0.375 * 980.665, rel=1e-12)
        assert code.check(machine(z=9.0, h=9.0, safety=True)).coefficient == pytest.approx(0.75, rel=1e-12)

    def test_resonance(self):
        """In tune with the building 3 (1 + z/H) - 0.5 times α S: 2.5 at the base, 5.5 at the roof."""
        code = Eurocode8(0.25, 1.2, 0.8, q_a=1.0, building_period=0.8)
        assert code.check(shelf(at_grade=True, safety=True)).coefficient == pytest.approx(0.3 * 2.5)
        assert code.check(shelf(z=9.0, h=9.0, safety=True)).coefficient == pytest.approx(0.3 * 5.5)

    def test_never_below_the_ground(self):
        """Far above the building's period the formula falls below α S, which is its limit."""
        code = Eurocode8(0.25, 1.2, 4.0, q_a=1.0, building_period=0.4)
        assert code.check(shelf(at_grade=True, safety=True)).coefficient == pytest.approx(0.3)

    @pytest.mark.parametrize(
        ("code", "one", "status"),
        [
            (Eurocode8(0.04, 1.0, 0.0), shelf(safety=True), EXEMPT),
            (Eurocode8(0.05, 1.0, 0.0), shelf(safety=True), EXEMPT),
            (Eurocode8(0.05, 1.2, 0.0), shelf(safety=True), REQUIRED),
            (Eurocode8(0.25, 1.2, 0.0), shelf(), UNCHECKED),
            (Eurocode8(0.25, 1.2, 0.0), shelf(importance=1.5), REQUIRED),
            (Eurocode8(0.25, 1.2, 0.0), shelf(stated=True), EXEMPT),
            (Eurocode8(0.25, 1.2, 0.0), shelf(stated=True, safety=True), REQUIRED),
            (Eurocode8(0.25, 1.2, 0.0), shelf(stated=True, importance=1.5), REQUIRED),
        ],
    )
    def test_who_must_be_anchored(self, code, one, status):
        assert code.check(one).status == status

    @pytest.mark.parametrize(
        ("consequences", "safety", "status"),
        [
            ((), SAFETY, UNCHECKED),
            (("none",), SAFETY, EXEMPT),
            (("medication", "records"), SAFETY, EXEMPT),
            (("medication",), ("medication",), REQUIRED),  # (a service of a critical facility)
            (("medication", "injury"), SAFETY, REQUIRED),
            (("injuries",), SAFETY, UNCHECKED),  # (a slip of the pen must not exempt)
            (("Verletzung",), SAFETY, UNCHECKED),
        ],
    )
    def test_stated_consequences(self, consequences, safety, status):
        """An empty cell alone, or a word that may mean a danger, leaves the danger to people unknown."""
        row = Contents("shelf", catalogue["bookcase-5-shelf"], floor=0, consequences=consequences)
        assert Eurocode8(0.25, 1.2, 0.0).check(component_of(row, None, safety)).status == status

    def test_what_is_missing_is_said(self):
        found = Eurocode8(0.25, 1.2, 0.3).check(shelf(at_grade=True, safety=True))
        assert "period of" in found.factors


class TestAnchors:
    def test_by_moments(self):
        """500 N at 1.0 m against 0.9 · 980.665 N at 0.2 m, held at 1.9 m; the base takes the rest."""
        one = shelf(anchor_height=1.9)
        assert anchor_demand(500.0, 0.9, one) == pytest.approx((500.0 - 0.9 * 980.665 * 0.2) / 1.9, rel=1e-12)
        assert anchor_demand(100.0, 0.9, one) == 0.0  # (it does not tip over)
        assert anchor_demand(500.0, 0.9, shelf()) == 500.0

    def test_weight_counts_less_by_asce(self):
        assert asce().held_down == pytest.approx(0.7)
        assert asce(sds_g=4.0).held_down == pytest.approx(0.1)

    def test_over_the_strength(self):
        found = asce().check(shelf(at_grade=True, anchored=True, strength=267.0, anchor_height=1.9))
        force = 0.3 * 980.665  # (0.4/1.5 is below the least that is asked for)
        assert found.ratio == pytest.approx((force - 0.7 * 980.665 * 0.2) / 1.9 / 267.0, rel=1e-12)
        assert math.isnan(asce().check(shelf(at_grade=True)).ratio)
