"""Annual rates as datasets: replicates and realisations, labels, measures and floors, what is refused."""

import json
import math
import time

import numpy as np
import pytest
import scipy
import xarray as xr
from risk_cases import SITE, X, curves, outer

import toppling as tp
from toppling.core.units import STANDARD_GRAVITY as G
from toppling.fragility import HazardCurve, annual_rate, probability_in
from toppling.fragility.curves import published
from toppling.fragility.risk.modelling import with_modelling


def one_floor(ground=False):
    """Curves of runs on one floor, whose levels are of the floor's motion, or of the ground motions below."""
    shakes = tp.motions.CloughPenzien(duration=6.0, dt=0.02).sample(3, seed=2)
    floor = tp.motions.Building.flexural_shear(0.3).floor_motions(shakes, floors=[2])
    below = {"ground": shakes} if ground else {}
    return tp.fit_fragility(tp.ida(tp.Block(0.4, 1.8), tp.HousnerImpact(), floor, [1.0, 3.0, 9.0, 20.0], **below))


class TestUncertainty:
    @staticmethod
    def replicated(count=400, blocks=3, seed=2):
        rng = np.random.default_rng(seed)
        median = np.linspace(2.0, 4.0, blocks)
        found = curves(median)
        spread = np.exp(0.15 * rng.standard_normal((blocks, count)))
        attributes = found["median"].attrs
        found["median_sample"] = (("block", "replicate"), median[:, None] * spread, attributes)
        found["dispersion_sample"] = (("block", "replicate"), 0.4 * np.exp(0.1 * rng.standard_normal((blocks, count))))
        return found

    def test_replicates(self):
        data = self.replicated()
        data["median_sample"][1, 5] = np.nan
        risk = annual_rate(data, SITE, confidence=0.9)
        assert risk["rate_sample"].dims == ("block", "replicate")
        one = data.isel(block=2, replicate=7)
        drawn = annual_rate(curves(one["median_sample"].item(), one["dispersion_sample"].item()), SITE)["rate"].item()
        rate = risk["rate"].values[2]
        # the step of ln(rate) is taken the other way, over the square of the replicate's dispersion
        expected = rate * (rate / drawn) ** ((one["dispersion"] / one["dispersion_sample"]).item() ** 2)
        assert risk["rate_sample"].values[2, 7] == pytest.approx(expected, rel=1e-13, abs=0.0)
        assert risk["samples_used"].values.tolist() == [400, 399, 400]
        ends = outer(risk["rate_sample"].values, 0.05)
        np.testing.assert_allclose([risk["rate_lower"], risk["rate_upper"]], ends, rtol=1e-15)
        np.testing.assert_allclose(risk["probability_upper"], probability_in(ends[1], 50.0), rtol=1e-15)
        assert ((risk["rate_lower"] < risk["rate"]) & (risk["rate"] < risk["rate_upper"])).all()

    def test_realisations(self):
        low, high = (HazardCurve(X, factor * np.array(SITE.rates), "pga") for factor in (0.5, 3.0))
        tree = HazardCurve(X, (), "pga", realisations=[low.rates, high.rates], weights=[0.8, 0.2])
        risk = annual_rate(curves([2.0, 4.0]), tree)
        assert risk["rate_sample"].dims == ("block", "realisation")
        base = annual_rate(curves([2.0, 4.0]), SITE)["rate"].values
        np.testing.assert_allclose(risk["rate_sample"], base[:, None] * [0.5, 3.0], rtol=1e-13)
        np.testing.assert_allclose(risk["rate"], base, rtol=1e-13)
        np.testing.assert_allclose(risk["rate_upper"], 3.0 * base, rtol=1e-13)
        assert risk["weight"].values.tolist() == [0.8, 0.2]
        mostly = annual_rate(curves([2.0, 4.0]), tree, confidence=0.5)
        np.testing.assert_allclose(mostly["rate_upper"], 0.5 * base, rtol=1e-13)

    def test_both_are_crossed(self):
        data = self.replicated(50)
        tree = HazardCurve(X, (), "pga", realisations=np.outer([0.5, 1.0, 3.0], SITE.rates), weights=[0.3, 0.5, 0.2])
        risk = annual_rate(data, tree)
        assert risk["rate_sample"].dims == ("block", "replicate", "realisation")
        alone = annual_rate(data, SITE)["rate_sample"].values
        np.testing.assert_allclose(risk["rate_sample"], alone[..., None] * [0.5, 1.0, 3.0], rtol=1e-13)
        # weights as counts of equal samples
        every = np.repeat(risk["rate_sample"].values, [3, 5, 2], axis=2).reshape(3, -1)
        ends = outer(every, 0.025)
        np.testing.assert_array_equal([risk["rate_lower"], risk["rate_upper"]], ends)

    @pytest.mark.parametrize("modelling", [0.0, 0.3])
    def test_the_rate_of_the_runs(self, modelling):
        """By numbers: what the shares add to the curve at the levels, linear in ln x; their rate is in the interval."""
        data = self.replicated(blocks=2)
        levels = np.array([0.8, 1.5, 2.5, 4.0, 6.0])
        shares = np.array([[0.3, 0.5, 0.7, 0.8, 1.0], [0.0, 0.0, 0.1, 0.5, 0.9]])
        data = data.assign_coords(level=("level", levels)).assign(observed_probability=(("block", "level"), shares))
        hazard = HazardCurve.power_law(2e-3, 2.5, "pga")
        plain = annual_rate(data.drop_vars("observed_probability"), hazard)
        widened = with_modelling(data, modelling)
        risk = annual_rate(widened, hazard)
        np.testing.assert_array_equal(
            risk["rate"], annual_rate(widened.drop_vars("observed_probability"), hazard)["rate"]
        )
        x = np.linspace(math.log(0.8**2 / 1.5), math.log(6.0**2 / 4.0), 200_001)
        middle = np.exp(0.5 * (x[1:] + x[:-1]))
        for i in range(2):
            own = shares[i] - scipy.stats.norm.cdf(np.log(levels / data["median"].values[i]) / 0.4)
            at = np.concatenate([x[:1], np.log(levels), x[-1:]])
            more = np.interp(np.log(middle), at, [0.0, *own, 0.0]) @ -np.diff(2e-3 * np.exp(-2.5 * x))
            # a power law takes modelling uncertainty as one factor
            ratio = 1.0 + more / plain["rate"].values[i]
            assert risk["rate_of_runs"].values[i] / risk["rate"].values[i] == pytest.approx(ratio, rel=1e-6)
            assert risk["rate_lower"][i] <= risk["rate_of_runs"][i] <= risk["rate_upper"][i]
        off = (risk["rate"] / risk["rate_of_runs"] - 1.0).values[0]
        assert risk["rate_misfit"].values[0] == pytest.approx(off, rel=1e-12)
        assert risk["rate_misfit"].values[1] == 0.0
        assert risk["rate_upper"].values[0] > 1.5 * plain["rate_upper"].values[0]

    def test_replicates_of_tabulated_curves(self):
        level = xr.Variable("level", [1.0, 2.0, 8.0], {"units": "m s-2"})
        values = np.array([[0.0, 0.4, 1.0], [0.0, 0.5, 1.0]])
        data = xr.Dataset(
            {
                "probability": ("level", values.mean(axis=0)),
                "probability_sample": (("replicate", "level"), values),
            },
            {"level": level},
            {"form": "isotonic", "im": "pga"},
        )
        risk = annual_rate(data, SITE)
        # the integral is linear in P
        assert risk["rate_sample"].values.mean() == pytest.approx(risk["rate"].item(), rel=1e-13, abs=0.0)
        assert risk["rate_sample"].values[0] < risk["rate_sample"].values[1]
        # (both samples, and their mirror images in ln(rate))
        drawn, rate = risk["rate_sample"].values, risk["rate"].item()
        expected = [min(drawn[0], rate**2 / drawn[1]), max(drawn[1], rate**2 / drawn[0])]
        np.testing.assert_allclose([risk["rate_lower"], risk["rate_upper"]], expected, rtol=1e-13)

    def test_fifty_curves_of_a_thousand_replicates_in_a_second(self):
        """Exactly as one by one; the bound is generous to a slow machine."""
        data = self.replicated(1000, 50)
        start = time.process_time()
        risk = annual_rate(data, SITE)
        assert time.process_time() - start < 10.0
        assert risk.sizes == {"block": 50, "replicate": 1000, "bin": 40}
        again = annual_rate(data.isel(block=[17]), SITE)
        np.testing.assert_array_equal(again["rate_sample"].values[0], risk["rate_sample"].values[17])


class TestDatasets:
    def test_labels(self):
        data = curves([2.0, 4.0, np.nan]).assign_coords(
            block=("block", ["slim", "squat", "wide"], {"units": "1", "long_name": "block"}),
            alpha=("block", [0.1, 0.2, 0.3], {"units": "rad", "long_name": "slenderness angle"}),
        )
        data.attrs["configuration"] = json.dumps({"im": "pga"})
        risk = annual_rate(data, SITE, years=75.0, below="none")
        assert risk["rate"].attrs["units"] == "year-1"
        assert risk["alpha"].values.tolist() == [0.1, 0.2, 0.3]
        assert np.isnan(risk["rate"].values[2])
        assert np.isnan(risk["intensity_mean"].values[2])
        np.testing.assert_allclose(risk["probability"], -np.expm1(-75.0 * risk["rate"]))
        configuration = json.loads(risk.attrs["configuration"])
        assert configuration["hazard"]["im"] == "pga"
        assert configuration["hazard"]["rates"] == list(SITE.rates)
        assert [configuration[key] for key in ("below", "above", "years")] == ["none", "extend", 75.0]
        assert configuration["curves"] == {"im": "pga"}
        assert risk.attrs["title"].endswith("of overturning")

    def test_of_an_analysis(self):
        """From runs to a rate; of the observed probabilities as they are, it lies between the two plain sums."""
        blocks = [tp.Block(0.4, 1.8, name="slim"), tp.Block(0.6, 1.5, name="squat")]
        shakes = tp.motions.CloughPenzien(duration=10.0, dt=0.01).sample(30, seed=3)
        runs = tp.ida(blocks, tp.HousnerImpact(), shakes, np.geomspace(0.5, 12.0, 12), outputs="overturned")
        risk = annual_rate(tp.fit_fragility(runs), SITE)
        assert risk["rate"].dims == ("block", "model")
        assert (risk["rate"] > 0.0).all()
        observed = tp.overturning_probability(runs)["probability"]
        rising = observed.copy(data=np.maximum.accumulate(observed.values, axis=-1))
        table = xr.Dataset({"probability": rising}, attrs={"form": "tabulated", "im": "pga"})
        hazard = HazardCurve(runs["level"].values, SITE.rate_at(runs["level"].values), "pga")
        found = annual_rate(table, hazard, below="none", above="hold")["rate"]
        later = rising.copy(data=rising.values[..., [*range(1, 12), 11]])
        below, above = (one @ -np.diff(hazard.rates, append=0.0) for one in (rising.values, later.values))
        assert ((below < found) & (found < above)).all()

    def test_normalised_measures(self):
        """Curves of one normalised measure meet the hazard of pga (pgv) with each block's own levels."""
        blocks = {
            "alpha": ("block", [0.1, 0.2], {"units": "rad", "long_name": "slenderness"}),
            "p": ("block", [2.0, 3.0], {"units": "rad s-1", "long_name": "frequency parameter"}),
        }
        normalised = curves([2.0, 2.0], im="pga_normalised", units="1").assign_coords(blocks)
        found = annual_rate(normalised, SITE)["rate"]
        own = annual_rate(curves(2.0 * G * np.tan([0.1, 0.2])), SITE)["rate"]
        np.testing.assert_allclose(found, own, rtol=1e-13)
        velocity = HazardCurve.power_law(1e-3, 2.0, "pgv")
        found = annual_rate(curves([2.0, 2.0], im="pgv_normalised", units="1").assign_coords(blocks), velocity)["rate"]
        own = annual_rate(curves(2.0 * G * np.tan([0.1, 0.2]) / [2.0, 3.0], im="pgv", units="m s-1"), velocity)["rate"]
        np.testing.assert_allclose(found, own, rtol=1e-13)
        lifted = normalised.assign(uplift_median=("block", [3.0, 3.0]), uplift_dispersion=("block", [0.2, 0.0]))
        own = curves(2.0 * G * np.tan([0.1, 0.2])).assign(
            uplift_median=("block", 3.0 * G * np.tan([0.1, 0.2])),
            uplift_dispersion=lifted["uplift_dispersion"].variable,
        )
        np.testing.assert_allclose(annual_rate(lifted, SITE)["rate"], annual_rate(own, SITE)["rate"], rtol=1e-12)
        table = xr.Dataset(
            {"probability": (("block", "level"), [[0.0, 0.4, 1.0]] * 2)},
            {"level": ("level", [1.0, 2.0, 4.0], {"units": "1"}), **blocks},
            {"form": "isotonic", "im": "pga_normalised"},
        )
        found = annual_rate(table, SITE)["rate"].values
        for at, alpha in enumerate((0.1, 0.2)):
            one = table.isel(block=at).assign_coords(
                level=("level", table["level"].values * G * np.tan(alpha), {"units": "m s-2"})
            )
            assert found[at] == pytest.approx(
                annual_rate(one.assign_attrs(im="pga"), SITE)["rate"].item(), rel=1e-12, abs=0.0
            )

    def test_floors(self):
        upper = curves([2.0, 4.0]).rename(block="floor").assign_coords(floor=[0, 3])
        there = HazardCurve(SITE.levels, SITE.rates, "pga", at="floor")
        assert annual_rate(upper.isel(floor=1), there)["rate"].item() > 0.0
        assert annual_rate(upper.isel(floor=0), SITE)["rate"].item() > 0.0
        upper.attrs["configuration"] = json.dumps({"im_at": "ground"})
        assert annual_rate(upper, SITE)["rate"].dims == ("floor",)
        assert annual_rate(upper, SITE)["bin"].attrs["long_name"].endswith("peak ground acceleration")
        with pytest.raises(ValueError, match="of the ground's motion, the hazard curve is of a floor's"):
            annual_rate(upper.isel(floor=1), there)
        assert annual_rate(one_floor(), there)["rate"].item() > 0.0
        assert annual_rate(one_floor(ground=True), SITE)["rate"].item() > 0.0
        # (published medians are of the floor below the block, which may be the ground)
        assert (annual_rate(published.fema_p58(), HazardCurve(SITE.levels, SITE.rates, "pgv"))["rate"] > 0.0).all()

    def test_a_tabulated_curve_too_short(self):
        level = xr.Variable("level", [1.0, 2.0, 8.0], {"units": "m s-2"})
        data = xr.Dataset(
            {"probability": ("level", [0.1, 0.4, 0.9])}, {"level": level}, {"form": "isotonic", "im": "pga"}
        )
        inside = HazardCurve([1.5, 3.0, 6.0], [1e-2, 2e-3, 1e-4], "pga")
        with pytest.raises(ValueError, match=r"bounds its rate by 0.00\d+ and 0.00\d+ per year"):
            annual_rate(data, inside, below="none")
        exact = annual_rate(data, inside, below="none", above="hold")["rate"].item()
        assert exact == annual_rate(data, inside, below="none", above="hold", outside="most")["rate"].item()
        least, most = (
            annual_rate(data, inside, below="none", outside=rule)["rate"].item() for rule in ("least", "most")
        )
        assert exact < least < most
        np.testing.assert_allclose(
            annual_rate(data, SITE, below="none", outside="most", bins=300)["share"].sum("bin"), 1.0, rtol=1e-2
        )


def test_refused(refusal):
    refusal()
