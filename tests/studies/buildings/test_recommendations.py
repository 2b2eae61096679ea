"""What is advised of single pieces and kits: savings without people stated, doubtful chances, kits that do nothing."""

import math

import numpy as np
import pytest
import xarray as xr

import toppling as tp
from toppling.fragility.numerics.proportions import wilson_interval
from toppling.studies.buildings.recommendations import (
    FEW_UNSTATED,
    FIRST,
    HELPS,
    INDICATIVE,
    NOT_KNOWN,
    NOTHING,
    OUTSIDE,
    REDUCES,
    SMALL,
    TOO_LITTLE,
    UNKNOWN,
    UNPRICED,
    UNRESOLVED,
    UNSTATED,
    WORSE,
    WORTH,
    KitEffect,
    Piece,
    Range,
    carriers,
    recommended,
)
from toppling.studies.facts.answer_building import _kits
from toppling.studies.inventory.consequences import Injury
from toppling.studies.inventory.contents import Contents, Inventory
from toppling.studies.tables.assessment import at_most, most_rate

SAVED = Range(20.0, 15.0, 25.0)


def piece(item="case", *, cost=100.0, saving=SAVED, words=("none",), **more):
    """A piece that is judged by money and saves 20 a year for 100."""
    of = {
        "room": "", "floor": "1", "number": 1, "chance": Range(0.02, 0.015, 0.025), "levels": (1.0, 2.0),
        "value": 1000.0, "payback": math.nan, "safety": False, "recommendation": "",
    } | more  # fmt: skip
    return Piece(item=item, cost=cost, saving=saving, consequences=words, **of)


def kit(name="strap", saved=(0.015, 0.01, 0.018), share=(0.75, 0.6, 0.9), cost=20.0, value=1000.0):
    return KitEffect(name, cost, Range(*saved), Range(*share), Range(*saved).times(value))


USELESS = kit("strap", (-0.001, -0.004, 0.002), (-0.05, -0.2, 0.1))
WEAK_ONE = kit("weak", (0.004, 0.002, 0.006), (0.2, 0.1, 0.3))
HARMFUL = kit("stiff", (-0.01, -0.02, -0.005), (-0.5, -1.0, -0.2))
BRACKET = kit("bracket", (0.019, 0.018, 0.0195), (0.95, 0.9, 0.98), 60.0)


class TestMoney:
    @pytest.mark.parametrize(
        ("saving", "word"),
        [
            (Range(5.0, 4.66, 6.0), WORTH),  # 100/21.4822 = 4.655
            (Range(5.0, 4.65, 6.0), UNRESOLVED),  # (without discounting surely worth it: 232 in 50 years)
            (Range(4.0, 3.0, 4.65), SMALL),
        ],
    )
    def test_worth_is_discounted(self, saving, word):
        (one,) = recommended([piece(saving=saving)])
        assert one.recommendation == word
        assert one.worth == pytest.approx(21.482184616 * saving.value - 100.0)

    def test_an_81_year_payback_is_never(self):
        (one,) = recommended([piece(saving=Range(100.0 / 81.0, 1.0, 1.5))])
        assert (one.recommendation, one.payback) == (SMALL, math.inf)

    def test_never_is_not_all_that_is_said_where_the_interval_decides(self):
        """The saving never pays its cost, its upper end does within 50 years: not resolved."""
        (one,) = recommended([piece(saving=Range(4.0, 3.0, 5.0))])
        assert (one.recommendation, one.payback) == (UNRESOLVED, math.inf)

    def test_never_does_not_stand_beside_an_unknown_cost(self):
        (one, _) = recommended([piece(cost=math.nan), piece("other")])
        assert one.recommendation == UNPRICED
        assert math.isnan(one.payback)

    def test_an_empty_consequence_is_not_harmless(self):
        little = Range(0.1, 0.05, 0.2)
        (unstated,) = recommended([piece(saving=little, words=())])
        (stated,) = recommended([piece(saving=little)])
        assert (unstated.recommendation, stated.recommendation) == (UNSTATED, SMALL)
        few = recommended([piece(str(i), value=0.0, cost=math.nan, saving=UNKNOWN, words=(), number=100**i)
                           for i in range(2)])  # fmt: skip
        assert few[0].recommendation == FEW_UNSTATED

    @pytest.mark.parametrize("words", [("none", "injury"), ("dirt", "none")])
    def test_none_stands_alone(self, words):
        block = tp.catalogue["bookcase-5-shelf"]
        shelf = Contents("shelf", block, 0, consequences=("none",))
        assert Inventory((shelf,)).consequences == ()
        with pytest.raises(ValueError, match="consequence must be 'none' alone"):
            Contents("shelf", block, 0, consequences=words)
        with pytest.raises(ValueError, match="persons exposed"):
            Contents("shelf", block, 0, consequences=("none",), injury=Injury(0.1, 0.5))


class TestDoubt:
    @pytest.mark.parametrize("doubt", [OUTSIDE, INDICATIVE])
    @pytest.mark.parametrize("safety", [False, True])
    def test_no_advice_follows_from_a_doubtful_chance(self, doubt, safety):
        (one,) = recommended([piece(doubt=doubt, safety=safety, tried=(BRACKET,))])
        assert one.recommendation == doubt
        assert math.isnan(one.payback)
        assert math.isnan(one.saving.value)

    def test_what_moves_under_others_has_one_word(self):
        """A pedestal of small effect under a vase that falls is to be fixed first, and has no payback of its own."""
        judged = recommended([piece("pedestal", saving=Range(0.1, 0.05, 0.2)), piece("vase", doubt=INDICATIVE)])
        assert judged[0].recommendation == SMALL
        found = carriers(judged, {"pedestal"})
        assert [one.recommendation for one in found] == [FIRST, INDICATIVE]
        assert math.isnan(found[0].payback)
        people = recommended([piece("pedestal", safety=True)])
        assert carriers(people, {"pedestal"})[0].recommendation == REDUCES


class TestKits:
    @pytest.mark.parametrize(
        ("one", "effect"),
        [
            (BRACKET, HELPS),
            (kit(share=(0.45, 0.4, 0.51)), HELPS),
            (WEAK_ONE, TOO_LITTLE),
            (USELESS, NOTHING),
            (HARMFUL, WORSE),
            (kit(saved=(0.01, math.nan, math.nan)), NOT_KNOWN),
        ],
    )
    def test_effects(self, one, effect):
        assert one.effect == effect

    def test_the_kit_that_is_meant(self):
        tried = (USELESS, WEAK_ONE, HARMFUL, kit("cheap"), BRACKET)
        # by money: 21.48·15 − 20 = 302 of the cheap one, 21.48·19 − 60 = 348 of the bracket
        assert piece(tried=tried).meant == BRACKET
        assert piece(tried=(kit("cheap"), BRACKET._replace(cost=150.0))).meant.kit == "cheap"
        # for safety what prevents most, though it costs more than it saves
        assert piece(tried=(kit("cheap"), BRACKET._replace(cost=1500.0)), safety=True).meant.kit == "bracket"
        alike = BRACKET._replace(kit="alike", cost=30.0, share=Range(0.93, 0.88, 0.96))
        assert piece(tried=(BRACKET, alike), safety=True).meant.kit == "alike"
        assert piece(tried=tried[:3]).meant is None

    def test_paybacks_of_kits_where_anchors_have_no_cost(self):
        (one,) = recommended([piece(cost=math.nan, tried=(USELESS, BRACKET))])
        assert one.recommendation == WORTH
        assert one.payback == pytest.approx(-math.log(1.0 - 0.04 * 60.0 / 19.0) / math.log(1.04))
        (one,) = recommended([piece(cost=math.nan, tried=(USELESS,), saving=UNKNOWN._replace(value=1.0))])
        assert one.recommendation != WORTH
        assert math.isnan(one.payback)

    def test_what_achieves_nothing_is_said(self):
        results = xr.Dataset({"kit_falls": ((), 0.0)}, {"motion": np.arange(24)})
        facts = [*_kits(results, [piece(tried=(USELESS, WEAK_ONE, HARMFUL, BRACKET))])]
        assert [(fact.what, fact.more["kit"], fact.names) for fact in facts] == [
            ("kit.no_effect", "strap", ("“case” (floor 1)",)),
            ("kit.too_weak", "weak", ("“case” (floor 1)",)),
            ("kit.worse", "stiff", ("“case” (floor 1)",)),
        ]
        assert (facts[0].more["motions"], facts[1].lower, facts[1].upper) == (24, 0.2, 0.2)


class TestUnseen:
    def results(self):
        weights = {"level_weight": ("level", [0.02, 0.004, 0.001]), "level_weight_above": 0.001}
        return xr.Dataset(weights, {"motion": np.arange(40)}, {"confidence": 0.95})

    def test_the_bound_is_that_of_no_outcome_of_all_motions(self):
        """Wilson's upper end for 0 of n is z²/(n + z²); what lies above the levels counts in full."""
        z = 1.959963984540054
        bound = z**2 / (40 + z**2)
        assert wilson_interval(np.zeros(1, np.int64), np.array([40]), 0.95)[1][0] == pytest.approx(bound)
        assert most_rate(self.results()) == pytest.approx(bound * 0.024 + 0.001)
        rate = bound * 0.024 + 0.001
        assert at_most(self.results()) == f"at most {100.0 * -math.expm1(-50.0 * rate):.0f}\u00a0%"

    def test_at_a_level(self):
        assert at_most(self.results().drop_vars("level_weight")).startswith("at most 8.8")
