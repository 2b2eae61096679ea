"""Rates of inventories over weighted branches: by hand, by closed forms, and against plain simulations."""

import numpy as np
import pytest
import scipy
import xarray as xr
from assessed import assess

import toppling as tp
from toppling.studies.buildings.assessment import Assessment
from toppling.studies.buildings.branches import Sampling, combinations, rates_over_branches
from toppling.studies.inventory.consequences import Consequence, Injury
from toppling.studies.inventory.contents import Contents, Inventory

K, K0 = 2.0, 1e-3
LAW = tp.EnergyConsistent()
SHELF, CASE = (tp.catalogue[n] for n in ("bookcase-5-shelf", "display-cabinet-glass"))
TWO = Inventory(
    (Contents("shelf", SHELF, 0, 3, value=1.0), Contents("case", CASE, 0, 2, value=10.0)),
    "EUR",
)
LEVELS = np.geomspace(0.02, 100.0, 200)
MOTIONS = 30
CAPACITIES = np.array([[2.3], [3.5]]) * np.exp(0.3 * np.random.default_rng(3).standard_normal((2, MOTIONS)))


@pytest.fixture(scope="module")
def known():
    """Assessments of pieces with known capacities, and with capacities higher by a half, at many levels."""
    shaking = tp.motions.CloughPenzien(duration=10.0, dt=0.01, s0=0.05).sample(MOTIONS, seed=2)
    plain = assess(TWO, Assessment(LAW, shaking, LEVELS[[0, -1]], "pga"))

    def of(factor):
        flags = np.array([LEVELS[:, None] > factor * one for one in CAPACITIES])[None]
        found = plain.drop_dims("level").assign_coords(level=LEVELS)
        return found.assign(overturned=(("model", "block", "level", "motion"), flags))

    return {"motions": of(1.0), "stiff": of(1.5)}


def hazard(k0=K0):
    return tp.HazardCurve.power_law(k0, K, "pga")


def rates_of(capacities):
    return K0 * capacities**-K


def spread(known, sampling, motions=None, hazards=None):
    every = combinations({LAW.label: 1.0}, motions or {"motions": 1.0}, hazards or {"hazard": (hazard(), 1.0)})
    return rates_over_branches(every, known, TWO, sampling)


def test_three_hazards_by_hand(known):
    """Rates of 1, 2 and 4 times the lowest, weights 0.2, 0.5 and 0.3: order statistics, mean and shares by hand."""
    curves = {str(f): (hazard(f * K0), w) for f, w in ((2.0, 0.5), (1.0, 0.2), (4.0, 0.3))}
    steady = {"motions": known["motions"].isel(motion=[0, 0])}  # (two motions alike: resampling changes nothing)
    found = spread(steady, Sampling(100, 0), hazards=curves)
    lowest = rates_of(CAPACITIES[:, 0])
    # (a capacity is known to the step between two levels)
    np.testing.assert_allclose(found["branch_rate"], lowest[:, None] * [2.0, 1.0, 4.0], rtol=0.045)
    own = found["branch_rate"].values[:, 1]
    np.testing.assert_allclose(found["epistemic_rate"], own * (1.0 + 0.2 + 1.2), rtol=1e-12)
    expected = own[:, None] * np.array([1.0, 1.0, 2.0, 4.0, 4.0])
    np.testing.assert_allclose(found["epistemic_rate_fractile"], expected, rtol=1e-12)
    np.testing.assert_allclose(found["epistemic_rate_spread"].sel(epistemic_source="hazard"), 1.0, rtol=1e-9)
    number = (np.array([3.0, 2.0]) * own).sum()
    np.testing.assert_allclose(found["branch_annual_number"].values[0], number * np.array([2.0, 1.0, 4.0]), rtol=1e-12)
    np.testing.assert_allclose(found["branch_annual_loss"].values[0, 1], 3.0 * own[0] + 20.0 * own[1], rtol=1e-12)
    np.testing.assert_allclose(found["branch_any_rate"].values[0, 1], own.max(), rtol=1e-6)
    assert found["branch_share_beyond"].max() < 1e-3


@pytest.mark.slow
def test_branches_are_assessments_of_their_own():
    """Under each law, set of motions and hazard curve the values are those that `assess` gives."""
    laws = (LAW, tp.HousnerImpact())
    sets = {
        name: tp.motions.CloughPenzien(duration=10.0, dt=0.01, s0=0.05).sample(10, seed=seed)
        for name, seed in (("motions", 1), ("other", 2))
    }
    levels, curves = np.geomspace(1.0, 12.0, 6), {"hazard": (hazard(), 0.3), "high": (hazard(3e-3), 0.7)}
    known = {name: assess(TWO, Assessment(laws, shaking, levels)) for name, shaking in sets.items()}
    every = combinations(
        {law.label: w for law, w in zip(laws, (0.4, 0.6), strict=True)}, {"motions": 0.8, "other": 0.2}, curves
    )
    found = rates_over_branches(every, known, TWO, Sampling(100, 0))
    for b, one in enumerate(every):
        own = assess(TWO, Assessment(laws, sets[one.motions], levels, hazard=one.hazard)).sel(model=one.model)
        for name in ("rate", "any_rate", "annual_number", "annual_loss"):
            np.testing.assert_allclose(found[f"branch_{name}"].isel(branch=b), own[name], rtol=1e-12)
            np.testing.assert_allclose(
                found[f"epistemic_{name}"], found[f"branch_{name}"] @ found["branch_weight"], rtol=1e-12
            )
    np.testing.assert_allclose(found["epistemic_any_rate_spread"].sum("epistemic_source"), 1.0)


def of_all_kinds(e=0.4):
    """Two classes of pieces with consequences, injuries and downtimes, which are known for `e` = 0."""
    return Inventory(
        (
            Contents(
                "shelf", SHELF, 0, 3, consequences=("injury",), downtime=Consequence(1.0, e), injury=Injury(0.5, 0.2)
            ),
            Contents("case", CASE, 0, 2, consequences=("injury", "release"), downtime=Consequence(3.0, e)),
        )
    )


@pytest.mark.slow
@pytest.mark.parametrize("beta", [0.0, 0.3])
def test_events_downtime_and_injuries_are_those_of_assessments(beta):
    """Of each branch they are those that `assess` gives, also where they are means over the modelling uncertainty."""
    inventory, levels = of_all_kinds(), np.geomspace(1.0, 12.0, 6)
    shaking = tp.motions.CloughPenzien(duration=10.0, dt=0.01, s0=0.05).sample(10, seed=1)
    curves = {"hazard": (hazard(), 0.3), "high": (hazard(3e-3), 0.7)}
    options = {"consequence_correlation": 0.5, "seed": 4}
    known = {"motions": assess(inventory, Assessment(LAW, shaking, levels, **options))}
    every = combinations({LAW.label: 1.0}, {"motions": 1.0}, curves)
    found = rates_over_branches(every, known, inventory, Sampling(100, 4, beta, correlation=0.5))
    for b, one in enumerate(every):
        own = assess(
            inventory, Assessment(LAW, shaking, levels, hazard=one.hazard, modelling_dispersion=beta, **options)
        )
        for name in ("any_rate", "consequence_rate", "annual_downtime", "annual_injuries"):
            # (an event of one class alone is integrated over the levels here, over points there)
            rtol = 3e-4 if beta and name == "consequence_rate" else 1e-12
            np.testing.assert_allclose(found[f"branch_{name}"].isel(branch=b), own[name][0], rtol=rtol)
            assert found[f"branch_{name}"].attrs["units"] == own[name].attrs["units"]
    weighted = found["branch_consequence_rate"] @ found["branch_weight"]
    np.testing.assert_allclose(found["epistemic_consequence_rate"], weighted, rtol=1e-12)
    assert found["epistemic_consequence_rate"].dims == ("place", "consequence")


class TestModelling:
    def test_an_item_is_lognormal(self, known):
        """With a power law the rate of a piece is lognormal with dispersion k beta_m, its mean exp(k² beta_m²/2)."""
        steady = {"motions": known["motions"].isel(motion=[0, 0])}
        found = spread(steady, Sampling(1000, 0, 0.3, True))
        own = found["branch_rate"].values[:, 0]
        np.testing.assert_allclose(own, rates_of(CAPACITIES[:, 0]), rtol=0.045)
        np.testing.assert_allclose(found["epistemic_rate"], own * np.exp(0.5 * (K * 0.3) ** 2), rtol=1e-10)
        expected = own[:, None] * np.exp(K * 0.3 * scipy.special.ndtri(found["epistemic_fractile"].values))
        np.testing.assert_allclose(found["epistemic_rate_fractile"], expected, rtol=5e-3)
        np.testing.assert_allclose(found["epistemic_rate_spread"].sel(epistemic_source="modelling"), 1.0, rtol=1e-9)

    @pytest.mark.slow
    def test_in_the_mean_it_is_a_factor(self, known):
        plain, found = (spread(known, Sampling(200, 0, beta)) for beta in (0.0, 0.3))
        factor = np.exp(0.5 * (K * 0.3) ** 2)
        for name in (
            "epistemic_rate",
            "branch_rate",
            "epistemic_annual_loss",
            "epistemic_rate_fractile",
        ):
            np.testing.assert_allclose(found[name], factor * plain[name], rtol=1e-10)

    @pytest.mark.slow
    def test_sums_and_any_fall_against_a_plain_simulation(self, known):
        """20,000 buildings: bootstrapped motions, one of two sets of motions, and a factor for each class."""
        found = spread(known, Sampling(1000, 0, 0.3, True), motions={"motions": 0.7, "stiff": 0.3}).isel(place=0)
        random = np.random.default_rng(5)
        number, fallen = [], []
        for _ in range(20_000):
            capacities = CAPACITIES * (1.0 if random.random() < 0.7 else 1.5)
            capacities = capacities * np.exp(0.3 * random.standard_normal(2))[:, None]
            rates = rates_of(capacities[:, random.integers(MOTIONS, size=MOTIONS)])
            number.append((np.array([3.0, 2.0]) @ rates).mean())
            fallen.append(rates.max(axis=0).mean())
        shares = found["epistemic_fractile"].values
        np.testing.assert_allclose(found["epistemic_annual_number_fractile"], np.quantile(number, shares), rtol=0.04)
        np.testing.assert_allclose(found["epistemic_any_rate_fractile"], np.quantile(fallen, shares), rtol=0.08)
        assert float(found["epistemic_annual_number"]) == pytest.approx(np.mean(number), rel=0.02)
        assert float(found["epistemic_any_rate"]) == pytest.approx(np.mean(fallen), rel=0.02)

    @pytest.mark.slow
    def test_downtime_and_consequences_against_a_plain_simulation(self, known):
        """20,000 buildings: the shelf is out of use for 1 day, the case for 3, and only the case releases anything."""
        inventory = of_all_kinds(0.0)
        every = combinations({LAW.label: 1.0}, {"motions": 1.0}, {"hazard": (hazard(), 1.0)})
        found = rates_over_branches(every, known, inventory, Sampling(1000, 0, 0.3, True)).isel(place=0)
        random = np.random.default_rng(6)
        days, release = [], []
        for _ in range(20_000):
            capacities = CAPACITIES * np.exp(0.3 * random.standard_normal(2))[:, None]
            shelf, case = rates_of(capacities[:, random.integers(MOTIONS, size=MOTIONS)])
            days.append((3.0 * case + np.maximum(shelf - case, 0.0)).mean())
            release.append(case.mean())
        shares = found["epistemic_fractile"].values
        # (5 % of 200 joint samples are known to some 7 %)
        np.testing.assert_allclose(found["epistemic_annual_downtime_fractile"], np.quantile(days, shares), rtol=0.12)
        assert float(found["epistemic_annual_downtime"]) == pytest.approx(np.mean(days), rel=0.02)
        at = inventory.consequences.index("release")
        of_case = found["epistemic_consequence_rate_fractile"].values[at]
        np.testing.assert_allclose(of_case, np.quantile(release, shares), rtol=0.04)
        everything = found["epistemic_any_rate_fractile"].values
        both = found["epistemic_consequence_rate_fractile"].values[inventory.consequences.index("injury")]
        np.testing.assert_allclose(both, everything, rtol=1e-12)


def test_realisations_count_as_hazard(known):
    levels, rates = [0.1, 1.0, 10.0], np.array([1e-2, 1e-4, 1e-6])
    curve = tp.HazardCurve(levels, [], "pga", realisations=[rates, 3.0 * rates], weights=[0.25, 0.75])
    steady = {"motions": known["motions"].isel(motion=[0, 0])}
    found = spread(steady, Sampling(100, 0), hazards={"hazard": (curve, 1.0)})
    low = found["branch_rate"].values[:, 0] / 2.5
    np.testing.assert_allclose(found["epistemic_rate_fractile"].values[:, [0, 4]], low[:, None] * [1.0, 3.0], rtol=1e-9)
    upper = tp.HazardCurve(
        levels, 3.0 * rates, "pga", realisations=[rates, 3.0 * rates], weights=[0.25, 0.75], fractile=0.9
    )
    with pytest.raises(ValueError, match="must be the mean of its realisations"):
        spread(steady, Sampling(100, 0), hazards={"hazard": (upper, 1.0)})


def test_what_comes_from_beyond(known):
    """The share from above the hazard curve's last level, by hand: pieces that all fall from 20 m/s² on."""
    flags = np.broadcast_to((LEVELS > 20.0)[:, None], (2, LEVELS.size, MOTIONS))[None]
    high = {"motions": known["motions"].assign(overturned=(("model", "block", "level", "motion"), flags))}
    curve = tp.HazardCurve([0.1, 1.0, 10.0], [1e-1, 1e-3, 1e-5], "pga")
    found = spread(high, Sampling(100, 0), hazards={"hazard": (curve, 1.0)})
    assert found["branch_share_beyond"].item() == pytest.approx(1.0, abs=1e-6)
    assert isinstance(found, xr.Dataset)
