"""Costs, downtimes and injuries as distributions: closed forms, and simulated years written out in plain loops."""

import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest
import scipy
import xarray as xr
from assessed import anchoring, assess
from check_facts import check as check_of

import toppling as tp
from toppling.core.facts import CARE, GOOD, INVALID
from toppling.fragility.numerics import slabs
from toppling.fragility.uncertainty.joint import Variability
from toppling.studies.buildings import assessment as module
from toppling.studies.buildings.assessment import Assessment
from toppling.studies.buildings.notes import hazard_notes, hazard_shares, notes
from toppling.studies.buildings.pieces import SAFETY, pieces_of
from toppling.studies.facts.answer_building import details
from toppling.studies.inventory.consequences import Consequence, Injury, PieceScores
from toppling.studies.inventory.contents import Contents, Inventory
from toppling.studies.tables.assessment import annual as annual_table, at_level
from toppling.studies.tables.pieces import exported_pieces, pieces

LAW = tp.EnergyConsistent()
SHELF, CASE, FILES = (tp.catalogue[n] for n in ("bookcase-5-shelf", "display-cabinet-glass", "file-vertical-4-drawer"))
LEVELS = np.array([1.0, 2.0, 4.0])
HAZARD = tp.HazardCurve.power_law(1e-3, 1.8, "pga")
COST, DAYS, HURT = Consequence(1000.0, 0.6), Consequence(5.0, 0.8), Injury(2.0, 0.3)
LAB = Inventory(
    (
        Contents("freezer", SHELF, 0, 3, cost=COST, downtime=DAYS, injury=HURT, anchoring_cost=50.0),
        Contents("rack", CASE, 0, 2, cost=Consequence(4000.0, 0.3, "normal"), downtime=Consequence(12.0, 0.4)),
        Contents("desk", FILES, 0, 4, value=150.0, anchoring_cost=5.0),
    ),
    "EUR",
)
"""Three lines; the third has a value without spread."""
GROUND = tp.motions.CloughPenzien(duration=4.0, dt=0.02).sample(2, seed=1)


def shaken(monkeypatch, flags, inventory=LAB, **options):
    """An assessment whose runs give these flags (oscillator, level, motion)."""
    flags = np.array(flags, bool)
    monkeypatch.setattr(module, "outputs_of", lambda _, pieces, *__: {"overturned": flags[: len(pieces)]})
    ground = tp.motions.CloughPenzien(duration=4.0, dt=0.02).sample(flags.shape[2], seed=1)
    return assess(
        inventory, Assessment(LAW, ground, LEVELS[: flags.shape[1]], "pga", None, HAZARD, replicates=100, **options)
    )


def falls(motions, seed=5):
    """Flags of three lines, each with a capacity of its own under each motion."""
    capacity = np.random.default_rng(seed).lognormal(np.log([[2.0], [3.0], [1.5]]), 0.5, (3, motions))
    return LEVELS[None, :, None] > capacity[:, None, :]


class TestDistributions:
    @pytest.mark.parametrize("one", [COST, Consequence(3.0, 0.5, "normal"), Consequence(3.0, 0.2, "normal")])
    def test_mean_is_that_of_scipy_and_of_a_quadrature(self, one):
        if one.distribution == "lognormal":
            law = scipy.stats.lognorm(one.dispersion, scale=one.median)
        else:
            law = scipy.stats.truncnorm(-1.0 / one.dispersion, np.inf, one.median, one.dispersion * one.median)
        assert one.mean == pytest.approx(law.mean(), rel=1e-12)
        scores = np.array([-6.0, -1.3, 0.0, 0.7, 3.0, 6.0])
        np.testing.assert_allclose(one.at(scores), law.ppf(scipy.special.ndtr(scores)), rtol=1e-6)
        nodes, weights = np.polynomial.hermite_e.hermegauss(60)
        assert weights @ one.at(nodes) / weights.sum() == pytest.approx(one.mean, rel=1e-3)
        assert np.isfinite(one.at(np.array([-40.0, 40.0]))).all()

    def test_known_where_there_is_no_dispersion(self):
        assert Consequence(7.0).mean == 7.0
        assert Consequence(7.0, 0.0, "normal").at(np.array([-2.0, 5.0])).tolist() == [7.0, 7.0]

    @pytest.mark.parametrize("mean", [1e-4, 0.3, 4.0, 300.0])
    def test_injured_persons_are_a_poisson_number(self, mean):
        scores = np.linspace(-8.0, 8.0, 401)
        found = Injury(mean / 0.5, 0.5).at(scores)
        np.testing.assert_array_equal(found, scipy.stats.poisson(mean).ppf(scipy.special.ndtr(scores)))

    @pytest.mark.parametrize("rho", [0.0, 0.4, 1.0])
    def test_scores_of_a_piece_are_correlated_and_pieces_are_not(self, rho):
        z = PieceScores(100, rho).of_pieces("x", 400, 0)
        within = np.corrcoef(z.reshape(-1, 3).T)
        off = within[np.triu_indices(3, 1)]
        np.testing.assert_allclose(off, rho, atol=4.0 / np.sqrt(40_000))
        np.testing.assert_allclose(z.std(axis=(0, 1)), 1.0, atol=4.0 / np.sqrt(80_000))
        assert abs(np.corrcoef(z[:200, :, 0].ravel(), z[200:, :, 0].ravel())[0, 1]) < 4.0 / np.sqrt(20_000)
        if rho == 1.0:
            np.testing.assert_array_equal(z[..., 0], z[..., 2])

    def test_draws_of_a_piece_hang_on_nothing_else(self):
        few, many = PieceScores(5, 0.3, 9).of_pieces("a", 2, 3), PieceScores(5, 0.3, 9).of_pieces("a", 7, 3)
        np.testing.assert_array_equal(many[:2], few)
        for other in (PieceScores(5, 0.3, 8).of_pieces("a", 2, 3), PieceScores(5, 0.3, 9).of_pieces("b", 2, 3)):
            assert not np.isin(other, few).any()
        assert not np.isin(PieceScores(5, 0.3, 9).of_pieces("a", 2, 4), few).any()


N = 200_000
"""Simulated earthquakes."""


@pytest.fixture(scope="module")
def found():
    with pytest.MonkeyPatch.context() as patch:
        return shaken(patch, falls(400), consequence_correlation=0.0)


@pytest.fixture(scope="module")
def simulated(found):
    """Rate of earthquakes, and of each its cost, downtime and number of injured persons."""
    generator = np.random.default_rng(21)
    flags, weights = falls(400), found.level_weight.values
    level = generator.choice(LEVELS.size, N, p=weights / weights.sum())
    motion = generator.integers(400, size=N)
    outcomes = np.zeros((N, 3))
    for event in range(N):
        freezer, rack, desk = flags[:, level[event], motion[event]]
        cost, longest, hurt = 0.0, 0.0, 0
        for _ in range(3 if freezer else 0):
            cost += 1000.0 * math.exp(0.6 * generator.standard_normal())
            longest = max(longest, 5.0 * math.exp(0.8 * generator.standard_normal()))
            hurt += generator.binomial(generator.poisson(2.0), 0.3)
        for _ in range(2 if rack else 0):
            paid = -1.0
            while paid < 0.0:
                paid = generator.normal(4000.0, 1200.0)
            cost += paid
            longest = max(longest, 12.0 * math.exp(0.4 * generator.standard_normal()))
        outcomes[event] = cost + (4 * 150.0 if desk else 0.0), longest, hurt
    return weights.sum(), outcomes


class TestAgainstSimulatedYears:
    """Earthquakes one by one, pieces one by one: no function of the assessment, but the rate of each level."""

    @pytest.mark.parametrize(("quantity", "column"), [("loss", 0), ("downtime", 1), ("injuries", 2)])
    def test_expectation_and_exceedance_in_a_year(self, found, simulated, quantity, column):
        rate, outcomes = simulated
        here, drawn = found.isel(model=0).sel(place="building"), outcomes[:, column]
        # the means of loss and injuries are exact; all else is of 400 motions × 20 realisations at each level
        both = math.sqrt(1.0 / N + 1.0 / 8000.0)
        error = 4.0 * rate * drawn.std() * (both if quantity == "downtime" else math.sqrt(1.0 / N))
        assert error < (0.12 if quantity == "downtime" else 0.04) * rate * drawn.mean()
        assert float(here[f"annual_{quantity}"]) == pytest.approx(rate * drawn.mean(), abs=error)
        thresholds, compared = found[f"{quantity}_threshold"].values, 0
        for threshold, mine in zip(thresholds, here[f"{quantity}_rate"].values, strict=True):
            share = (drawn > threshold).mean() if quantity != "injuries" else (drawn >= threshold).mean()
            error = 4.0 * rate * both * math.sqrt(max(share * (1.0 - share), 1.0 / 8000.0))
            assert mine == pytest.approx(rate * share, abs=error), threshold
            compared += 4.0 * error < rate * share
        assert compared >= 3

    def test_expected_loss_is_rate_times_mean_cost(self, found):
        """EAL = Σ rate · number · median · exp(β²/2), of lines with a value rate · number · value."""
        here = found.isel(model=0)
        means = [1000.0 * math.exp(0.18), scipy.stats.truncnorm(-1 / 0.3, np.inf, 4000.0, 1200.0).mean(), 150.0]
        lines = here.rate.values * np.array([3, 2, 4]) * means
        np.testing.assert_allclose(here.block_annual_loss, lines, rtol=1e-12)
        assert float(here.annual_loss.sel(place="building")) == pytest.approx(lines.sum(), rel=1e-12)
        hurt = here.rate.values * np.array([3 * 0.6, 0.0, 0.0])
        np.testing.assert_allclose(here.block_annual_injuries, hurt, rtol=1e-12, atol=0.0)
        days = here.rate.values * np.array([5.0 * math.exp(0.32), 12.0 * math.exp(0.08), 0.0])
        np.testing.assert_allclose(here.block_annual_downtime, days, rtol=1e-12, atol=0.0)
        np.testing.assert_allclose(found.value, means, rtol=1e-12)

    def test_rates_of_anything_are_where_they_were(self, found):
        here = found.isel(model=0).sel(place="building")
        assert float(here.loss_rate[0]) == pytest.approx(float(here.any_rate), rel=1e-12)
        assert (here.loss_rate.diff("loss_threshold") <= 1e-15).all()
        assert float(here.downtime_rate[0]) <= float(here.any_rate)


class TestLongestDowntime:
    """Its mean is a sum over cells of P(longer), at least the mean of any piece."""

    @pytest.mark.parametrize("dispersion", [0.1, 0.8, 2.0])
    @pytest.mark.parametrize("distribution", ["lognormal", "normal"])
    def test_of_several_pieces(self, monkeypatch, dispersion, distribution):
        """The maximum of n alike pieces, whose mean is a quadrature over the density of their largest score."""
        days = Consequence(5.0, min(dispersion, 0.5) if distribution == "normal" else dispersion, distribution)
        for n in (1, 2, 7):
            line = Inventory((replace(LAB.rows[0], count=n, cost=None, injury=None, downtime=days),))
            found = shaken(monkeypatch, np.ones((1, 1, 3), bool), line).isel(model=0, level=0)
            exact = days.of_several(n, greatest=True)[0]
            assert float(found.downtime_mean[0]) == pytest.approx(exact, rel=1e-10 if n == 1 else 3e-3)
            assert float(found.downtime_mean_upper[0]) == pytest.approx(float(found.downtime_mean[0]), rel=1e-12)

    def test_a_total_is_at_least_its_largest_part(self, monkeypatch):
        """Whatever is drawn: few motions, lines of which one alone counts, pieces that fall in part."""
        for seed in range(8):
            flags = falls(3, seed)
            for some in (LAB, replace(LAB, rows=LAB.rows[:1]), replace(LAB, rows=LAB.rows[1:])):
                found = shaken(monkeypatch, flags[: len(some.rows)], some)
                assert (found.block_annual_downtime <= found.annual_downtime[:, 0] * (1.0 + 1e-12)).all()
                alone = float(found.annual_downtime[0, 0])
                if len(some.rows) == 1:
                    exact = float(found.any_rate[0, 0]) * DAYS.of_several(3, greatest=True)[0]
                    assert alone == pytest.approx(exact, rel=3e-3)

    def test_known_downtimes_have_no_error(self, monkeypatch):
        rows = (replace(LAB.rows[0], downtime=Consequence(3.0)), replace(LAB.rows[1], downtime=Consequence(8.0)))
        flags = falls(50)[:2]
        found = shaken(monkeypatch, flags, replace(LAB, rows=rows))
        longest = np.max(flags * np.array([3.0, 8.0])[:, None, None], axis=0).mean(axis=-1)
        np.testing.assert_allclose(found.downtime_mean[0, 0], longest, rtol=1e-12)


class TestRealisations:
    def test_one_piece_alone(self, monkeypatch):
        """With correlation 1 the downtime follows from the cost: both are functions of one normal score."""
        alone = Inventory((replace(LAB.rows[0], count=1, injury=None),))
        for rho, exact in ((1.0, True), (0.0, False)):
            found = shaken(monkeypatch, np.ones((1, 1, 500)), alone, consequence_correlation=rho).isel(model=0, level=0)
            one = found.sel(place="building")
            z = np.log(one.loss.values / 1000.0) / 0.6
            follows = 5.0 * np.exp(0.8 * z)
            if exact:
                np.testing.assert_allclose(one.downtime, follows, rtol=1e-12)
            else:
                correlation = np.corrcoef(z.ravel(), np.log(one.downtime.values.ravel()))[0, 1]
                assert abs(correlation) < 4.0 / math.sqrt(10_000)
            assert scipy.stats.kstest(z.ravel(), "norm").pvalue > 1e-3
            np.testing.assert_allclose(one.loss_quantile, np.quantile(one.loss, [0.1, 0.5, 0.9], method="inverted_cdf"))

    def test_more_falls_at_a_higher_level_and_costs_more(self, monkeypatch):
        found = shaken(monkeypatch, np.sort(falls(30), axis=1), variability=None)
        for name in ("loss", "downtime", "injuries"):
            assert (found[name].diff("level") >= 0.0).all()
            assert found[name].dims == ("model", "place", "level", "motion", "realisation")
            assert found[name].sizes["realisation"] == 20
        assert found.number.dims == ("model", "place", "level", "motion")

    def test_some_pieces_of_a_line_fall(self):
        """With differences between pieces: given n of a line, the cost has the mean and variance of n costs."""
        line = Inventory((Contents("a", SHELF, 0, 6, cost=COST, downtime=Consequence(2.0)),))
        ground = tp.motions.CloughPenzien(duration=8.0, dt=0.02, s0=0.05).sample(60, seed=2)
        spread = Variability(0.02, 0.1, realisations=40)
        found = assess(line, Assessment(LAW, ground, [2.0, 2.5, 3.0, 4.0], "pga", variability=spread, replicates=100))
        here = found.isel(model=0).sel(place="building")
        number, loss = here.number.values.ravel(), here.loss.values.ravel()
        assert len({*number}) == 7
        variance = 1000.0**2 * (math.exp(0.36) - 1.0) * math.exp(0.36)
        for n in range(1, 7):
            of = loss[number == n]
            # draws repeat from level to level: at least a quarter of them are independent
            error = 4.0 * math.sqrt(n * variance / (0.25 * of.size))
            assert of.mean() == pytest.approx(n * COST.mean, abs=error)
        np.testing.assert_array_equal(here.downtime, np.where(here.number > 0, 2.0, 0.0))
        np.testing.assert_array_equal(loss[number == 0], 0.0)
        assert float(here.loss_mean[0]) == pytest.approx(COST.mean * float(here.number_mean[0]), rel=1e-12)

    def test_same_bits_in_parts_of_any_size(self, monkeypatch):
        whole = shaken(monkeypatch, falls(25))
        monkeypatch.setattr(slabs, "RUNS", 1)
        xr.testing.assert_identical(shaken(monkeypatch, falls(25)), whole)

    def test_a_seed_of_its_own_and_motions_that_are_added(self, monkeypatch):
        few, many = shaken(monkeypatch, falls(40)[..., :20]), shaken(monkeypatch, falls(40))
        np.testing.assert_array_equal(many.loss[..., :20, :], few.loss)
        other = shaken(monkeypatch, falls(40), seed=1)
        assert not np.isin(other.downtime.values[many.downtime.values > 0.0], many.downtime).any()
        np.testing.assert_array_equal(other.annual_loss, many.annual_loss)  # (exact, whatever is drawn)

    def test_certain_costs_are_values(self, monkeypatch):
        """A cost without dispersion gives what the same value gives."""
        rows = LAB.rows[2], replace(LAB.rows[2], label="b", value=70.0)
        plain = shaken(monkeypatch, falls(20)[:2], Inventory(rows, "EUR"), losses=[0.0, 500.0])
        known = tuple(replace(row, value=0.0, cost=Consequence(row.value)) for row in rows)
        drawn = shaken(monkeypatch, falls(20)[:2], Inventory(known, "EUR"), losses=[0.0, 500.0])
        for name in ("annual_loss", "loss_rate", "loss_quantile", "loss_exceedance", "block_annual_loss"):
            np.testing.assert_allclose(drawn[name], plain[name], rtol=1e-12)


QUANTITIES = ("number", "loss", "downtime", "injuries")


class TestEndsOfTheHazardCurve:
    """How much of each annual value comes from beyond the ends of a hazard curve that is a power law there, too."""

    K = 1.8

    def curve(self, first, last):
        levels = np.array([first, last])
        return tp.HazardCurve(levels, 1e-3 * levels**-self.K, "pga")

    def found(self, monkeypatch, flags, curve):
        found = shaken(monkeypatch, flags)
        return found.assign(hazard_shares(found, curve))

    @pytest.mark.parametrize("name", QUANTITIES)
    def test_closed_form_where_everything_falls_at_every_level(self, monkeypatch, name):
        """v = 1 above the first level b, and rises from 0 at a = b/2: ∫ v |dλ| = λ(a) (1 - e^-z)/z with z = k ln 2."""
        z = self.K * math.log(2.0)
        whole = 0.5**-self.K * -math.expm1(-z) / z
        found = self.found(monkeypatch, np.ones((3, 3, 10)), self.curve(1.5, 3.0))
        below, above = (found[f"annual_{name}_share_{side}"].item() for side in ("below", "above"))
        assert above == pytest.approx(3.0**-self.K / whole, rel=1e-12)
        assert below == pytest.approx(1.0 - 1.5**-self.K / whole, rel=1e-12)
        assert float(found[f"annual_{name}"][0, 0]) == pytest.approx(1e-3 * whole * found[f"{name}_mean"][0, 0, 0])

    @pytest.mark.parametrize("name", QUANTITIES)
    @pytest.mark.parametrize(("first", "last"), [(1.3, 9.0), (0.2, 2.7)])
    def test_equals_the_integral_in_small_steps(self, monkeypatch, name, first, last):
        found = self.found(monkeypatch, falls(80), self.curve(first, last))
        mean = found[f"{name}_mean"].isel(model=0).sel(place="building").values
        fine = np.linspace(math.log(0.5), math.log(1e4), 400_001)
        middle = 0.5 * (fine[1:] + fine[:-1])
        value = np.interp(middle, np.log([0.5, *LEVELS]), [0.0, *mean])
        events = value * -np.diff(np.exp(-self.K * fine))
        for side, outside in (("below", np.exp(middle) < first), ("above", np.exp(middle) > last)):
            share = events[outside].sum() / events.sum()
            assert found[f"annual_{name}_share_{side}"].item() == pytest.approx(share, rel=1e-3, abs=1e-12)

    def test_notes_name_every_quantity_of_which_much_comes_from_there(self, monkeypatch):
        """The rack, which injures nobody, falls at the last level alone: much of loss and downtime is from above."""
        flags = np.zeros((3, 3, 20))
        flags[0], flags[1, 2] = 1.0, 1.0
        freezer = replace(LAB.rows[0], count=30, cost=Consequence(1.0))
        rack = replace(LAB.rows[1], downtime=Consequence(200.0))
        found = shaken(monkeypatch, flags, Inventory((freezer, rack, LAB.rows[2]), "EUR"))
        curve = self.curve(0.1, 4.0)
        found = found.assign(hazard_shares(found, curve))
        number, loss, downtime, injuries = (found[f"annual_{name}_share_above"].item() for name in QUANTITIES)
        assert min(loss, downtime) > 0.05 > max(number, injuries) > 0.0
        (note,) = (one for one in hazard_notes(found, curve) if one.what == "rate.share_beyond_hazard")
        assert note.more["shares"] == [[loss, "loss"], [downtime, "downtime"]]
        assert (note.more["side"], note.more["formula"]) == ("above", False)
        check = check_of(found, "hazard curve")
        assert (check.word, check.names) == (CARE, ("annual loss",))

    @pytest.mark.parametrize(("k", "apart"), [(4.0, True), (3.0, False)])
    def test_a_note_on_levels_between_which_everything_falls(self, monkeypatch, k, apart):
        """All falls at the last level, nothing before: as often as the last level is exceeded, or as the one before."""
        flags = np.zeros((3, 3, 20))
        flags[:, 2] = 1.0
        curve = tp.HazardCurve.power_law(1e-3, k, "pga")
        found = shaken(monkeypatch, flags)
        found = found.assign(hazard_shares(found, curve))
        told = [note for note in hazard_notes(found, curve) if note.what == "hazard.levels_apart"]
        assert len(told) == apart
        if apart:
            given = (found["number_mean"].isel(level=2) / found["annual_number"]).isel(place=0).item()
            ends = [given * float(curve.rate_at(level)) for level in (4.0, 2.0)]
            assert (told[0].lower, told[0].upper) == pytest.approx(ends, rel=1e-9)

    @pytest.mark.parametrize(("first", "side"), [(0, "below"), (2, "above")])
    def test_notes_on_the_ends_of_the_levels(self, monkeypatch, first, side):
        """From some level on, half of the motions overturn everything."""
        flags = np.zeros((3, 3, 20))
        flags[:, first:, ::2] = 1.0
        found = shaken(monkeypatch, flags)
        (note,) = (one for one in notes(found) if one.what == f"rate.share_{side}_levels")
        part = {one: (found[f"annual_{one}_{side}"] / found[f"annual_{one}"])[0, 0].item() for one in QUANTITIES}
        shares, words = zip(*note.more["shares"], strict=True)
        assert words == ("overturnings", "loss", "downtime", "injuries")
        assert shares == pytest.approx([*part.values()], rel=1e-12)

    def test_no_note_above_where_all_has_fallen(self, monkeypatch):
        flags = np.zeros((3, 3, 20))
        flags[:, 2] = 1.0
        above = "rate.share_above_levels"
        assert not [one for one in notes(shaken(monkeypatch, flags)) if one.what == above]
        flags[1, 2, ::2] = 0.0  # half of the racks stand, and they injure nobody
        (note,) = (one for one in notes(shaken(monkeypatch, flags)) if one.what == above)
        words = {text for _, text in note.more["shares"]}
        assert "downtime" in words
        assert "injuries" not in words

    @pytest.mark.parametrize(
        ("first", "motions", "word"), [(2, 1, INVALID), (2, 16, CARE), (1, 20, GOOD), (3, 1, CARE)]
    )
    def test_amounts_from_shaking_that_was_not_run_are_checked(self, monkeypatch, first, motions, word):
        """From some level on, so many of 20 motions overturn everything; a hazard beyond the levels is not left out."""
        flags = np.zeros((3, 3, 20))
        flags[:, first:, :motions] = 1.0
        found = shaken(monkeypatch, flags)
        found = found.assign(hazard_shares(found, self.curve(0.1, 4.0)))
        study = json.dumps({"performance": {"levels": {"from": 1.0, "to": 4.0}}})
        check = check_of(found.assign_attrs(study=study), "range of levels")
        above = {one: (found[f"annual_{one}_above"] / found[f"annual_{one}"])[0, 0].item() for one in QUANTITIES}
        assert check.word == word
        if first == 3:
            assert check.value == np.inf
        elif word != GOOD:
            assert check.value == pytest.approx(max(above.values()) * (20 / motions - 1.0), rel=1e-6)
            assert check.more["advice"] == "raise performance.levels.to"


class TestDecisions:
    def test_means_pay_back(self, monkeypatch):
        found = shaken(monkeypatch, falls(60))
        pieces = {one.item: one for one in pieces_of(found.assign_attrs(safety=" | ".join(SAFETY)))}
        assert pieces["freezer"].saving.value == pytest.approx(float(found.block_annual_loss[0, 0]))
        assert pieces["freezer"].payback == math.inf  # (a year saves 1.8 EUR, and the interest on 150 EUR is 6)
        free = {one.item: one for one in pieces_of(found.assign_attrs(safety=" | ".join(SAFETY), discount_rate=0.0))}
        assert free["freezer"].payback == pytest.approx(150.0 / float(found.block_annual_loss[0, 0]))
        assert pieces["freezer"].safety
        assert not pieces["rack"].safety
        assert math.isnan(pieces["rack"].injuries.value)  # (the line states no persons)
        ranked = anchoring(found, replicates=100)
        np.testing.assert_allclose(ranked.saving, found.block_annual_loss, rtol=1e-12)

    def test_tables_and_sentences_hold_the_numbers(self, monkeypatch):
        found = shaken(monkeypatch, falls(60)).assign_attrs(safety=" | ".join(SAFETY))
        exported = {row["item"]: row for row in exported_pieces(found).lines}
        for i, name in enumerate(("freezer", "rack")):
            annual = found.isel(model=0, block=i)
            for key, variable in (("downtime_of_one_a_year", "downtime"), ("saving_a_year", "loss")):
                amounts = [float(annual[f"block_annual_{variable}{end}"]) for end in ("", "_lower", "_upper")]
                assert exported[name][key] == pytest.approx(amounts, rel=1e-9)
        hurt = float(found.block_annual_injuries[0, 0])
        assert exported["freezer"]["injured_a_year"].value == hurt
        table = pieces(found)
        freezer = next(row for row in table.lines if row["item"] == "freezer")
        titles = {column.key: column.title for column in table.columns}
        assert (freezer["value"], titles["value"]) == (1200.0, "mean cost, each")
        assert freezer["lost"] == pytest.approx(float(found.block_annual_loss[0, 0]))
        assert freezer["injuries"] == pytest.approx(1000.0 * hurt)
        assert "1,000 years" in titles["injuries"]
        assert freezer["downtime"] == pytest.approx(1000.0 * float(found.block_annual_downtime[0, 0]))
        table = annual_table(found)
        titles = {column.key: column.title for column in table.columns}
        for name in ("downtime", "injuries"):
            years = 1000.0 if titles[name].endswith(" in 1,000 years") else 1.0
            annual = float(found[f"annual_{name}"][0, 0])
            assert table.lines[0][name].value == pytest.approx(years * annual)
            assert (annual < 0.1) == (years == 1000.0)
        assert {"downtime", "injuries"} <= {column.key for column in at_level(found, 2.0).columns}

    def test_lines_without_persons_are_said_not_to_count(self, monkeypatch):
        found = shaken(monkeypatch, falls(60)).assign_attrs(safety=" | ".join(SAFETY), kind="performance")
        for persons, some in ([1.0, np.nan, 1.0], True), ([1.0, 0.0, 1.0], False):
            given = found.assign_coords(persons_exposed=("block", persons[: found.sizes["block"]]))
            (injuries,) = (fact for fact in details(given) if fact.what == "consequence.injuries")
            assert injuries.value == float(given["annual_injuries"][0, 0])
            assert injuries.more["unstated"] == some

    def test_nothing_of_it_where_no_line_gives_it(self, monkeypatch):
        plain = shaken(monkeypatch, falls(20)[:1], Inventory(LAB.rows[2:], "EUR"))
        assert not {str(name) for name in plain.variables if re.search("downtime|injur|cost_", str(name))}
        assert not [column for column in exported_pieces(plain).columns if re.search("downtime|injur", column.key)]
        assert not [column for column in pieces(plain).columns if re.search("downtime|injur|lost", column.key)]
        assert "realisation" not in plain.dims


def test_refused(refusal):
    refusal()
