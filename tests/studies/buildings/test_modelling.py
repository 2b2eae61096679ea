"""Modelling uncertainty of inventories: closed forms, and plain loops over capacities of classes that are drawn."""

import math
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from assessed import assess

import toppling as tp
from toppling.fragility.uncertainty.joint import Variability
from toppling.studies.buildings import assessment as module
from toppling.studies.buildings.assessment import Assessment
from toppling.studies.buildings.modelling import DRAWS, scored_levels
from toppling.studies.inventory.contents import Contents, Inventory

LAW = tp.EnergyConsistent()
SHELF, CASE, FILES = (tp.catalogue[n] for n in ("bookcase-5-shelf", "display-cabinet-glass", "file-vertical-4-drawer"))
ROWS = (
    Contents("shelf", SHELF, 0, 3, value=1.0, consequences=("injury",)),
    Contents("case", CASE, 0, 2, value=10.0, consequences=("blocks-exit",)),
    Contents("files", FILES, 0, 4, value=2.0, consequences=("injury",)),
)
THREE = Inventory(ROWS, "EUR")
ALIKE = Inventory(tuple(replace(row, piece_class="furniture") for row in ROWS), "EUR")
COUNTS = np.array([row.count for row in ROWS])
MOTIONS = 40
CAPACITIES = np.array([[2.3], [4.1], [3.0]]) * np.exp(0.4 * np.random.default_rng(3).standard_normal((3, MOTIONS)))
FINE = np.geomspace(0.02, 100.0, 200)
BETA = 0.4


def assessed(monkeypatch, inventory, levels, hazard=None, run=None, factor=1.0, **options):
    """An assessment of pieces that fall from their known capacities on, times a factor."""
    run = levels if run is None else run
    flags = np.array([run[:, None] > factor * one for one in CAPACITIES])
    monkeypatch.setattr(module, "outputs_of", lambda _, pieces, *__: {"overturned": flags[: len(pieces)]})
    shaking = tp.motions.CloughPenzien(duration=10.0, dt=0.01, s0=0.05).sample(MOTIONS, seed=2)
    found = assess(inventory, Assessment(LAW, shaking, levels, "pga", None, hazard, **options))
    return found.isel(model=0)


class TestAnnualValues:
    @pytest.mark.slow
    @pytest.mark.parametrize("inventory", [THREE, ALIKE])
    def test_means_have_the_closed_form_s_factor(self, monkeypatch, inventory):
        """Under a power law exp(k² beta_m²/2): rates of pieces, numbers and losses, with their intervals."""
        hazard = tp.HazardCurve.power_law(1e-3, 1.8, "pga")
        plain, found = (
            assessed(monkeypatch, inventory, FINE, hazard, modelling_dispersion=beta) for beta in (0.0, BETA)
        )
        factor = math.exp(0.5 * 1.8**2 * BETA**2)
        for name in ("rate", "block_annual_loss", "annual_number", "annual_loss"):
            for end in ("", "_lower", "_upper"):
                np.testing.assert_allclose(found[name + end], factor * plain[name + end], rtol=1e-10, err_msg=name)
        for name in ("number_mean", "any_probability", "number_exceedance", "probability"):
            np.testing.assert_array_equal(found[name], plain[name])

    @pytest.mark.slow
    def test_one_class_falls_as_one(self, monkeypatch):
        """Of one class every annual value has the factor: any fall, consequences, and how many fall at once."""
        hazard = tp.HazardCurve.power_law(1e-3, 1.8, "pga")
        plain, found = (assessed(monkeypatch, ALIKE, FINE, hazard, modelling_dispersion=beta) for beta in (0.0, BETA))
        factor = math.exp(0.5 * 1.8**2 * BETA**2)
        every = [str(name) for name in plain.data_vars if {"annual", "rate"} & {*str(name).split("_")}]
        names = [name for name in every if "modelling" not in name]
        assert len(names) > 15
        assert len(names) < len(every)
        for name in names:
            np.testing.assert_allclose(found[name], factor * plain[name], rtol=1e-9, err_msg=str(name))
        # (a capacity c has the rate k0 c^-k)
        for name in set(every) - set(names):
            value, _, end = name.partition("_modelling_")
            exponent = 1.28 * BETA * (1.8 if end == "upper" else -1.8)
            np.testing.assert_allclose(found[name], math.exp(exponent) * plain[value], rtol=1e-9, err_msg=name)

    @pytest.mark.slow
    @pytest.mark.parametrize("hazard", [None, tp.HazardCurve.log_quadratic(1e-3, 1.5, 0.2, "pga")])
    def test_a_range_ends_where_capacities_times_one_factor_do(self, monkeypatch, hazard):
        """Numbers, losses, any fall and consequences, of a year and at levels: assessments of other capacities."""
        levels = np.geomspace(0.4, 20.0, 500)
        found = assessed(monkeypatch, THREE, levels, hazard)
        names = [str(name).split("_modelling_")[0] for name in found.data_vars if "_modelling_lower" in str(name)]
        assert len(names) == 5
        for end, factor in (("lower", math.exp(1.28 * 0.3)), ("upper", math.exp(-1.28 * 0.3))):
            other = assessed(monkeypatch, THREE, levels, hazard, factor=factor)
            for name in names:
                given, wanted = found[f"{name}_modelling_{end}"], other[name]
                if hazard is None:  # (neither end is known within ln 1.468 of the first and the last level)
                    inside = (levels > 0.4 * math.exp(0.384)) & (levels < 20.0 * math.exp(-0.384))
                    assert (given.notnull() == xr.DataArray(inside, dims="level")).all()
                    given, wanted = (
                        given.where(given.notnull(), 0.0).mean("level"),
                        wanted.where(inside, 0.0).mean("level"),
                    )
                np.testing.assert_allclose(given, wanted, rtol=0.01, err_msg=name)

    @pytest.mark.slow
    def test_classes_against_plain_loops(self, monkeypatch):
        """120,000 buildings with a capacity factor for each class, each added up by itself: any fall, and how many."""
        k, k0 = 2.0, 1e-3
        hazard = tp.HazardCurve.power_law(k0, k, "pga")
        found = assessed(monkeypatch, THREE, FINE, hazard, modelling_dispersion=BETA).isel(place=0)
        common = assessed(monkeypatch, ALIKE, FINE, hazard, modelling_dispersion=BETA).isel(place=0)
        random = np.random.default_rng(9)
        samples = 3000
        number, injury, fallen = np.zeros(9), 0.0, 0.0
        for motion in range(MOTIONS):
            for _ in range(samples):
                capacities = CAPACITIES[:, motion] * np.exp(BETA * random.standard_normal(3))
                rates = k0 * capacities**-k
                fallen += rates.max()
                injury += max(rates[0], rates[2])
                before = 0
                for i in np.argsort(capacities):
                    number[before : before + COUNTS[i]] += rates[i]
                    before += COUNTS[i]
        number, injury, fallen = (one / (MOTIONS * samples) for one in (number, injury, fallen))
        assert float(found["any_rate"]) == pytest.approx(fallen, rel=0.015)
        assert float(found["consequence_rate"].sel(consequence="injury")) == pytest.approx(injury, rel=0.015)
        np.testing.assert_allclose(found["number_rate"], number, rtol=0.06)
        # what all pieces have in common makes any fall rarer, and that of all of them together more frequent
        assert float(common["any_rate"]) < 0.93 * fallen
        assert float(common["number_rate"][-1]) > 1.3 * number[-1]

    @pytest.mark.slow
    def test_a_bent_hazard(self, monkeypatch):
        """Means of classes that are joined are those of each class alone, under a hazard curve with kinks, too."""
        hazard = tp.HazardCurve([0.1, 1.0, 4.0, 20.0], [1e-1, 5e-3, 2e-4, 1e-6], "pga")
        levels = np.geomspace(0.3, 30.0, 15)
        found = assessed(monkeypatch, THREE, levels, hazard, modelling_dispersion=0.3)
        only = Inventory((ROWS[0], *(replace(row, anchored=True) for row in ROWS[1:])), "EUR")
        alone = assessed(monkeypatch, only, levels, hazard, modelling_dispersion=0.3)
        np.testing.assert_allclose(alone["any_rate"], alone["rate"].sel(block="shelf"), rtol=2e-3)
        np.testing.assert_allclose(alone["rate"].sel(block="shelf"), found["rate"].sel(block="shelf"))
        assert (found["any_rate"] > found["rate"].max("block")).all()
        assert (found["any_rate"] < found["rate"].sum("block")).all()


class TestAtALevel:
    @pytest.mark.slow
    def test_against_plain_loops(self, monkeypatch):
        """Probabilities, and the distribution of how many fall, of 80,000 buildings."""
        levels = np.array([3.0, 4.0])
        run, _ = scored_levels(levels, BETA)
        found = assessed(monkeypatch, THREE, levels, run=run, modelling_dispersion=BETA).isel(place=0)
        assert found["overturned"].shape == (3, 2, MOTIONS)
        assert found["number"].sizes["realisation"] == DRAWS
        random = np.random.default_rng(4)
        for at, level in enumerate(levels):
            here = found.isel(level=at)
            fell = []
            for motion in range(MOTIONS):
                for _ in range(2000):
                    fell.append(CAPACITIES[:, motion] * np.exp(BETA * random.standard_normal(3)) < level)
            number = np.array(fell) @ COUNTS
            np.testing.assert_allclose(here["probability"], np.mean(fell, axis=0), atol=0.02)
            assert float(here["number_mean"]) == pytest.approx(number.mean(), rel=0.02)
            assert float(here["any_probability"]) == pytest.approx(np.mean(number > 0), abs=0.01)
            assert float(here["number"].var()) == pytest.approx(number.var(), rel=0.06)
            assert float(here["number"].mean()) == pytest.approx(number.mean(), rel=0.02)
            shares = [np.mean(number >= n) for n in range(1, 10)]
            np.testing.assert_allclose(here["number_exceedance"], shares, atol=0.02)

    def test_a_class_spreads_the_number_more(self, monkeypatch):
        """Pieces of one class fall together: the same mean, a wider number."""
        levels = np.array([3.0])
        run, _ = scored_levels(levels, BETA)
        options = {"run": run, "modelling_dispersion": BETA}
        apart, alike = (assessed(monkeypatch, one, levels, **options).isel(place=0) for one in (THREE, ALIKE))
        np.testing.assert_allclose(apart["number_mean"], alike["number_mean"], rtol=1e-12)
        assert float(alike["number"].var()) > 1.2 * float(apart["number"].var())

    def test_lognormal_capacities(self):
        """The mean over the scores is Phi(ln(x/c)/sqrt(beta² + beta_m²))."""
        for beta in (0.2, 0.4, 0.8):
            run, states = scored_levels(np.array([1.0, 1.7]), 0.4)
            given = np.array([0.5 * math.erfc(-math.log(x / 1.3) / beta / math.sqrt(2.0)) for x in run])
            whole = math.hypot(beta, 0.4)
            expected = [0.5 * math.erfc(-math.log(x / 1.3) / whole / math.sqrt(2.0)) for x in (1.0, 1.7)]
            np.testing.assert_allclose(states.of(given[:, None])[:, 0], expected, rtol=3e-3)

    def test_runs_and_variants(self):
        """A real assessment at one level, with variants: the flags kept are those of the level itself."""
        shaking = tp.motions.CloughPenzien(duration=10.0, dt=0.01, s0=0.05).sample(12, seed=2)
        options = (LAW, shaking, [4.0])
        variability = Variability(0.02, 0.05, variants=4)
        plain, found = (
            assess(THREE, Assessment(*options, variability=variability, modelling_dispersion=beta))
            for beta in (0.0, 0.3)
        )
        np.testing.assert_array_equal(plain["overturned"], found["overturned"])
        assert found["number"].dims == plain["number"].dims
        assert not np.array_equal(plain["probability"], found["probability"])


def test_nothing_that_can_happen_stays_nothing():
    """Shares sum to 1 but for rounding: the rate of a consequence where no piece has it is 0, not 1e-18."""
    for beta in (0.2, 0.3, 0.35):
        _, states = scored_levels(np.array([1.0, 1.7]), beta)
        assert (states.of(np.ones((3, states.shares.shape[1] - 1, 2)), 1.0) == 1.0).all()


def test_refuses():
    with pytest.raises(ValueError, match="piece_class must be 1 to"):
        replace(ROWS[0], piece_class="x\n")
