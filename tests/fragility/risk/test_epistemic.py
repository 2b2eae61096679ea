"""Modelling uncertainty and weighted branches: closed forms for power-law hazards, fractiles and shares by hand."""

import math

import numpy as np
import pytest
import scipy
import xarray as xr

import toppling as tp
from toppling.fragility import Branch, epistemic_rates, with_modelling
from toppling.fragility.risk.epistemic import SOURCES


def curves(median=0.6, dispersion=0.4, **more):
    found = xr.Dataset(
        {"median": ((), median, {"units": "m s-2"}), "dispersion": ((), dispersion)}, attrs={"im": "pga"}
    )
    return found.assign(more)


def power(k=2.5, k0=1e-4):
    return tp.HazardCurve.power_law(k0, k, "pga")


def named(*blocks):
    """Curves of two blocks, by name."""
    found = {"median": ("block", [0.6, 0.9], {"units": "m s-2"}), "dispersion": ("block", [0.4, 0.4])}
    return xr.Dataset(found, {"block": [*blocks]}, {"im": "pga"})


def branch(weight, *, model="a", motions="m", hazard="h", median=0.6, k0=1e-4, found=None):
    return Branch(model, motions, hazard, curves(median) if found is None else found, power(k0=k0), weight)


def share(found, source):
    return float(found["spread"].sel(source=source))


class TestModelling:
    @pytest.mark.parametrize("k", [1.0, 2.0, 3.5])
    @pytest.mark.parametrize("beta", [0.1, 0.35, 0.6])
    def test_the_mean_rate_of_a_power_law(self, k, beta):
        """The mean over what the model may be is exp(k² beta_m²/2) times the rate of the curve alone."""
        plain = tp.annual_rate(curves(), power(k))["rate"].item()
        found = tp.annual_rate(with_modelling(curves(), beta), power(k))["rate"].item()
        assert found == pytest.approx(plain * math.exp(0.5 * k * k * beta * beta), rel=1e-10)

    @pytest.mark.slow
    def test_it_is_the_mean_of_shifted_curves(self):
        """Held to the average of 201 shifted curves under a hazard curve with kinks."""
        hazard = tp.HazardCurve([0.1, 0.5, 1.0, 3.0], [1e-2, 8e-4, 2e-4, 1e-5], "pga")
        z = np.linspace(-8.0, 8.0, 201)
        shifted = [tp.annual_rate(curves(0.6 * math.exp(0.3 * one)), hazard)["rate"].item() for one in z]
        density = np.exp(-0.5 * z**2)
        mean = float(np.sum(shifted * density) / density.sum())
        assert tp.annual_rate(with_modelling(curves(), 0.3), hazard)["rate"].item() == pytest.approx(mean, rel=1e-6)

    def test_everything_of_a_fit_is_widened_or_left_out(self):
        more = {
            "dispersion_lower": 0.3,
            "dispersion_sample": ("replicate", [0.3, 0.5]),
            "median_se": 0.1,
            "fractile": 0.2,
        }
        found = with_modelling(curves(**more), 0.4)
        assert found["dispersion"].item() == pytest.approx(math.hypot(0.4, 0.4))
        assert found["dispersion_lower"].item() == pytest.approx(0.5)
        np.testing.assert_allclose(found["dispersion_sample"], np.hypot([0.3, 0.5], 0.4))
        assert not {"median_se", "fractile"} & {*found}
        assert found.attrs["modelling_dispersion"] == 0.4

    def test_none_changes_nothing(self):
        assert with_modelling(curves(), 0.0).identical(curves())


class TestFractiles:
    def test_three_branches_by_hand(self):
        """Rates of 1, 2 and 4 times the lowest with weights 0.2, 0.5 and 0.3: cumulated 0.2, 0.7 and 1."""
        every = [branch(w, hazard=str(k0), k0=k0) for w, k0 in ((0.5, 2e-4), (0.2, 1e-4), (0.3, 4e-4))]
        found = epistemic_rates(every, fractiles=[0.05, 0.2, 0.21, 0.7, 0.71, 0.95])
        one = tp.annual_rate(curves(), power())["rate"].item()
        np.testing.assert_allclose(found["rate_fractile"], one * np.array([1, 1, 2, 2, 4, 4]), rtol=1e-12)
        assert found["rate_mean"].item() == pytest.approx(one * (0.2 + 1.0 + 1.2), rel=1e-12)
        np.testing.assert_allclose(found["branch_rate"], one * np.array([2, 1, 4]), rtol=1e-12)
        assert share(found, "hazard") == pytest.approx(1.0)

    def test_modelling_alone_is_lognormal(self):
        """With a power-law hazard the rate is lognormal with dispersion k beta_m around that of the curve."""
        found = epistemic_rates([branch(1.0)], 0.3, fractiles=[0.05, 0.5, 0.84])
        one = tp.annual_rate(curves(), power())["rate"].item()
        expected = one * np.exp(2.5 * 0.3 * scipy.special.ndtri([0.05, 0.5, 0.84]))
        np.testing.assert_allclose(found["rate_fractile"], expected, rtol=5e-3)
        assert found["rate_mean"].item() == pytest.approx(one * math.exp(0.5 * 0.75**2), rel=1e-10)
        assert share(found, "modelling") == pytest.approx(1.0)

    def test_realisations_of_a_hazard(self):
        levels, rates = [0.1, 1.0, 10.0], np.array([1e-2, 1e-4, 1e-6])
        hazard = tp.HazardCurve(levels, [], "pga", realisations=[rates, 3.0 * rates], weights=[0.25, 0.75])
        found = epistemic_rates([Branch("a", "m", "h", curves(), hazard, 1.0)], fractiles=[0.2, 0.3])
        low = tp.annual_rate(curves(), tp.HazardCurve(levels, rates, "pga"))["rate"].item()
        np.testing.assert_allclose(found["rate_fractile"], [low, 3.0 * low], rtol=1e-12)
        assert found["rate_mean"].item() == pytest.approx(2.5 * low, rel=1e-12)

    def test_many_samples_against_a_plain_simulation(self):
        """Two models, two hazards, replicates and beta_m: fractiles and mean of 400,000 draws."""
        rng = np.random.default_rng(3)
        samples = 0.6 * np.exp(0.1 * rng.standard_normal(1000))
        models = {"a": (0.6, 0.4), "b": (0.9, 0.6)}
        hazards = {"x": (0.7, 1e-4), "y": (0.3, 3e-4)}
        every = []
        for name, (median, weight) in models.items():
            own = xr.Variable("replicate", samples * median / 0.6)
            found = curves(median, median_sample=own, dispersion_sample=("replicate", np.full(1000, 0.4)))
            every += [branch(weight * w, model=name, hazard=h, k0=k0, found=found) for h, (w, k0) in hazards.items()]
        found = epistemic_rates(every, 0.25)
        n = 400_000
        medians = np.where(rng.random(n) < 0.4, 0.6, 0.9) * samples[rng.integers(1000, size=n)] / 0.6
        medians *= np.exp(0.25 * rng.standard_normal(n))
        k0 = np.where(rng.random(n) < 0.7, 1e-4, 3e-4)
        rates = k0 * medians**-2.5 * math.exp(0.5 * (2.5 * 0.4) ** 2)
        np.testing.assert_allclose(found["rate_fractile"], np.quantile(rates, found["fractile"]), rtol=0.03)
        of = {
            "models": 0.4 * 0.6 * (2.5 * math.log(1.5)) ** 2,
            "hazard": 0.7 * 0.3 * math.log(3.0) ** 2,
            "modelling": (2.5 * 0.25) ** 2,
            "number of motions": (2.5 * np.log(samples).std()) ** 2,
        }
        assert sum(of.values()) == pytest.approx(np.log(rates).var(), rel=0.01)
        for source, variance in of.items():
            assert share(found, source) == pytest.approx(variance / sum(of.values()), abs=0.02)
        assert found["spread"].sum().item() == pytest.approx(1.0)

    def test_what_branches_do_together(self):
        """A second motion set that matters under one model alone: by hand, half of it is interaction."""
        of = {("a", "m"): 1.0, ("a", "n"): 1.0, ("b", "m"): 1.0, ("b", "n"): 2.0}
        every = [branch(0.25, model=a, motions=m, median=0.6 * factor) for (a, m), factor in of.items()]
        found = epistemic_rates(every)
        # ln rates 0, 0, 0, x: total variance 3/16 x², each main effect 1/16 x², the rest 1/16 x²
        for source in ("models", "motions", "together"):
            assert share(found, source) == pytest.approx(1.0 / 3.0, rel=1e-9)

    def test_a_branch_keeps_its_weight_where_replicates_are_unknown(self):
        """Two branches of a half, 60 % of one's replicates without a curve: the median lies between both."""
        low = curves(
            0.9, median_sample=("replicate", np.full(10, 0.9)), dispersion_sample=("replicate", np.full(10, 0.4))
        )
        few = np.where(np.arange(10) < 6, np.nan, 0.6)
        high = curves(0.6, median_sample=("replicate", few), dispersion_sample=("replicate", np.full(10, 0.4)))
        every = [branch(0.5, found=low), branch(0.5, model="b", found=high)]
        found = epistemic_rates(every, fractiles=[0.49, 0.51])
        own = [tp.annual_rate(curves(median), power())["rate"].item() for median in (0.9, 0.6)]
        np.testing.assert_allclose(found["rate_fractile"], own, rtol=1e-12)

    def test_blocks_and_curves_without_an_estimate(self):
        two = xr.Dataset(
            {"median": ("block", [0.6, np.nan], {"units": "m s-2"}), "dispersion": ("block", [0.4, np.nan])},
            {"block": ["x", "y"]},
            {"im": "pga"},
        )
        found = epistemic_rates([branch(1.0, found=two)], 0.3)
        assert found["rate_fractile"].dims == ("block", "fractile")
        assert np.isfinite(found["rate_fractile"].sel(block="x")).all()
        assert np.isnan(found["rate_fractile"].sel(block="y")).all()
        assert [*found["source"].values] == [*SOURCES]

    def test_a_fractile_is_no_mean(self):
        levels, rates = [0.1, 1.0, 10.0], np.array([1e-2, 1e-4, 1e-6])
        upper = tp.HazardCurve(
            levels, 3.0 * rates, "pga", realisations=[rates, 3.0 * rates], weights=[0.25, 0.75], fractile=0.9
        )
        with pytest.raises(
            ValueError, match="'h' of a branch must be the mean of its realisations, got their fractile"
        ):
            epistemic_rates([Branch("a", "m", "h", curves(), upper, 1.0)])


def test_refused(refusal):
    refusal()
