"""The block that meets a rate: sizes and slendernesses solved for, their intervals, and why there is none."""

import numpy as np
import pytest
import xarray as xr
from risk_cases import SITE, curves, outer

from toppling.core.units import STANDARD_GRAVITY as G
from toppling.fragility import HazardCurve, annual_rate, design_for_rate, size_for_rate, slenderness_for_rate


class TestInversion:
    def test_design_for_rate(self):
        found = design_for_rate(lambda alpha: 1e-4 * alpha**-2.5, 2e-4, 0.1, 1.0)
        assert found.value == pytest.approx(2.0**-0.4, rel=1e-8, abs=0.0)
        assert found.rate == pytest.approx(2e-4, rel=1e-7, abs=0.0)
        assert found.evaluations < 20
        rising = design_for_rate(lambda x: 1e-3 * x, 1e-3, 0.0, 4.0)
        assert rising.value == pytest.approx(1.0, rel=1e-8, abs=0.0)
        assert design_for_rate(lambda x: 1e-3 * x, 4e-3, 0.0, 4.0).value == 4.0

    @pytest.mark.parametrize(
        ("rate_of", "message"),
        [
            (lambda x: 1e-2 / x, r"target of 0.0001 per year is not met between 1 and 2: .* both lie above it"),
            (lambda x: 1e-6 / x, "both lie below it"),
            (lambda x: 1e-3 if x < 1.3 else 2e-3 if x < 1.7 else 1e-5, "rate_of must fall steadily between 1 and 2"),
            (lambda x: np.nan, "rate_of must give a rate >= 0 per year, got nan at 1"),
            (lambda x: -1.0, "got -1.0 at 1"),
        ],
    )
    def test_design_refused(self, rate_of, message):
        with pytest.raises(ValueError, match=message):
            design_for_rate(rate_of, 1e-4, 1.0, 2.0)

    @staticmethod
    def family(count=5, replicates=0):
        """Blocks of one R whose rates follow a known law: rate = 1e-4 (alpha/0.2)^-3 under LAW-like hazard."""
        alpha = np.linspace(0.1, 0.3, count)
        hazard = HazardCurve.power_law(1e-4, 3.0, "pga")
        coords = {"alpha": ("block", alpha, {"units": "rad", "long_name": "slenderness angle"})}
        data = curves(alpha / 0.2, 0.0).assign_coords(coords)
        if replicates:
            factor = np.exp(0.1 * np.random.default_rng(4).standard_normal(replicates))
            data["median_sample"] = data["median"] * xr.DataArray(factor, dims="replicate")
            data["dispersion_sample"] = xr.zeros_like(data["median_sample"])
        return data, hazard, alpha

    def test_size_for_rate(self):
        data, hazard, alpha = self.family()
        risk = annual_rate(data, hazard)
        found = size_for_rate(risk, "alpha", rate=3e-4)
        logs = np.log(risk["rate"].values)
        assert found["alpha"].item() == pytest.approx(np.interp(-np.log(3e-4), -logs, alpha), rel=1e-14, abs=0.0)
        assert found["status"].item() == "ok"
        assert found["alpha"].attrs["units"] == "rad"
        # with many blocks the law's own
        many, hazard, _ = self.family(400)
        fine = size_for_rate(annual_rate(many, hazard), probability=0.01, years=50.0)
        assert fine["alpha"].item() == pytest.approx(0.2 * (-np.log(0.99) / 50.0 / 1e-4) ** (-1 / 3), rel=1e-5, abs=0.0)
        shuffled = size_for_rate(risk.isel(block=[3, 0, 4, 1, 2]), rate=3e-4)
        assert shuffled["alpha"].item() == found["alpha"].item()

    def test_the_interval_of_a_size(self):
        data, hazard, _ = self.family(400, 999)
        found = size_for_rate(annual_rate(data, hazard), rate=2e-4, confidence=0.9)
        # (steps of ln(rate) are taken the other way)
        sizes = 0.2 * 2.0 ** (-1 / 3) * np.sort(data["median_sample"].values[0] / data["median"].values[0])
        expected = outer(sizes, 0.05)
        np.testing.assert_allclose([found["alpha_lower"], found["alpha_upper"]], expected, rtol=2e-4)
        wide = size_for_rate(annual_rate(data, hazard), rate=0.35e-4, confidence=0.9)
        assert np.isposinf(wide["alpha_upper"].item())
        assert wide["alpha_lower"].item() < 0.3

    def test_samples_that_cross_more_than_once_count_on_the_safe_side(self):
        """Falling rates: above the last crossing; rising ones: below the first."""
        rates = xr.Dataset(
            {
                "rate": ("block", [9.0, 9.0, 0.1, 0.1]),
                "rate_sample": (("replicate", "block"), [[9.0, 0.1, 9.0, 0.1]] * 3),
            },
            {"width": ("block", [1.0, 2.0, 3.0, 4.0], {"units": "m"})},
        )
        middle = np.log(9.0) / np.log(90.0)
        falling = size_for_rate(rates, "width", rate=1.0)
        assert falling["width"].item() == pytest.approx(2.0 + middle, rel=1e-14, abs=0.0)
        assert falling["width_lower"].item() == pytest.approx(3.0 + middle, rel=1e-14, abs=0.0)
        rising = rates.assign_coords(width=("block", [4.0, 3.0, 2.0, 1.0], {"units": "m"}))
        rising = size_for_rate(rising, "width", rate=1.0)
        assert rising["width"].item() == pytest.approx(3.0 - middle, rel=1e-14, abs=0.0)
        assert rising["width_upper"].item() == pytest.approx(2.0 - middle, rel=1e-14, abs=0.0)
        assert rising["samples_used"].item() == 3

    def test_says_why_there_is_no_size(self):
        rates = xr.Dataset(
            {
                "rate": (
                    ("model", "block"),
                    [[9.0, 8.0, 7.0], [0.3, 0.2, 0.1], [9.0, 0.1, 8.0], [9.0, np.nan, 0.1], [9.0, 2.0, 0.0]],
                )
            },
            {"width": ("block", [0.2, 0.4, 0.6], {"units": "m"}), "alpha": ("block", [0.1, 0.2, 0.3])},
        )
        found = size_for_rate(rates, "width", rate=1.0)
        status = ["all above the target", "all below the target", "crosses the target more than once", "no rate", "ok"]
        assert found["status"].values.tolist() == status
        # a rate of 0 is met from its own block on
        np.testing.assert_allclose(found["width"], [np.nan] * 4 + [0.6])
        with pytest.raises(ValueError, match="got neither"):
            size_for_rate(rates, "width")
        with pytest.raises(ValueError, match="got both"):
            size_for_rate(rates, "width", rate=1.0, probability=0.1)
        with pytest.raises(ValueError, match="coordinate 'height' on block"):
            size_for_rate(rates, "height", rate=1.0)
        with pytest.raises(ValueError, match=r"must all differ in width, got 0.2 of both '0' and '1'"):
            size_for_rate(rates.isel(block=[0, 0]), "width", rate=1.0)
        with pytest.raises(TypeError, match="with `rate` on block"):
            size_for_rate(rates["rate"], "width", rate=1.0)

    def test_slenderness_for_rate(self):
        """One normalised curve, any slenderness: closed form for the power law, and the rate of the block found."""
        data = curves([2.0, 3.0], 0.4, im="pga_normalised", units="1")
        law = HazardCurve.power_law(1e-4, 2.5, "pga", units="g")
        found = slenderness_for_rate(data, law, probability=0.01, years=50.0)
        goal = -np.log(0.99) / 50.0
        expected = (1e-4 * np.exp(0.5) / goal) ** 0.4 / np.array([2.0, 3.0])
        np.testing.assert_allclose(found["tan_alpha"], expected, rtol=1e-12)
        np.testing.assert_allclose(np.tan(found["alpha"]), expected, rtol=1e-12)
        back = annual_rate(data.assign_coords(alpha=("block", found["alpha"].values), p=3.0), SITE)
        labelled = data.assign_coords(block=["slim", "wide"], alpha=("block", [0.1, 0.2]), p=("block", [2.0, 2.0]))
        again = slenderness_for_rate(labelled, SITE, rate=back["rate"].values[0])
        assert set(again.coords) == {"block"}
        assert again["alpha"].values[0] == pytest.approx(found["alpha"].values[0], rel=1e-12, abs=0.0)

    def test_slenderness_by_velocity_with_interval(self):
        data = curves([2.0], 0.4, im="pgv_normalised", units="1")
        factor = np.exp(0.1 * np.random.default_rng(4).standard_normal((1, 99)))
        data["median_sample"] = (("block", "replicate"), 2.0 * factor)
        data["dispersion_sample"] = (("block", "replicate"), np.full((1, 99), 0.4))
        law = HazardCurve.power_law(1e-3, 2.0, "pgv")
        found = slenderness_for_rate(data, law, rate=1e-3, p=3.0, confidence=0.9)
        tangent = 3.0 / G * np.exp(0.16) / 2.0
        assert found["tan_alpha"].item() == pytest.approx(tangent, rel=1e-12, abs=0.0)
        np.testing.assert_allclose(
            np.tan([found["alpha_lower"].item(), found["alpha_upper"].item()]),
            tangent * outer(1.0 / factor, 0.05),
            rtol=1e-4,
        )
        by_block = data.assign_coords(p=("block", [3.0], {"units": "rad s-1"}))
        assert slenderness_for_rate(by_block, law, rate=1e-3)["alpha"].item() == found["alpha"].item()
        with pytest.raises(ValueError, match="coordinates alpha and p"):
            slenderness_for_rate(data, law, rate=1e-3)

    def test_no_slenderness(self):
        data = curves([2.0, np.nan], 0.4, im="pga_normalised", units="1")
        high = slenderness_for_rate(data, SITE, rate=10.0, below="none")
        assert high["status"].values.tolist() == ["all below the target", "no rate"]
        assert np.isnan(high["alpha"]).all()
        with pytest.raises(ValueError, match="curves must be of pga_normalised or pgv_normalised, got 'pga'"):
            slenderness_for_rate(curves(), SITE, rate=1e-3)

    def test_samples_that_no_slenderness_saves(self):
        """Where a branch of the hazard never comes so often (or so rarely), its sample is 0 (or pi/2)."""
        data = curves([2.0], 0.4, im="pga_normalised", units="1")
        often = HazardCurve([1.0, 2.0], [1e-1, 1e-2], "pga")
        seldom = HazardCurve([1.0, 2.0], [1e-4, 1e-5], "pga")
        tree = HazardCurve.from_realisations([often, seldom], [0.5, 0.5])
        found = slenderness_for_rate(data, tree, rate=1e-3, below="none")
        assert found["alpha_lower"].item() == 0.0
        assert found["alpha_upper"].item() == pytest.approx(
            slenderness_for_rate(data, often, rate=1e-3, below="none")["alpha"].item(), rel=1e-12, abs=0.0
        )
        # a curve that lets one block in two fall at any level
        table = xr.Dataset(
            {"probability": ("level", [0.5, 0.5])},
            {"level": ("level", [1.0, 2.0], {"units": "1"})},
            {"form": "isotonic", "im": "pga_normalised"},
        )
        tree = HazardCurve.from_realisations([often, seldom], [0.3, 0.7])
        found = slenderness_for_rate(table, tree, rate=1e-3, below="none", above="hold", outside="most")
        assert found["status"].item() == "all above the target"
        assert found["alpha_upper"].item() == pytest.approx(np.pi / 2.0, rel=1e-15)
        assert found["alpha_lower"].item() == 0.0

    def test_slenderness_of_tabulated_curves(self):
        table = xr.Dataset(
            {"probability": ("level", [0.0, 0.4, 1.0])},
            {"level": ("level", [1.0, 2.0, 4.0], {"units": "1"})},
            {"form": "isotonic", "im": "pga_normalised"},
        )
        found = slenderness_for_rate(table, SITE, rate=1e-3)
        back = annual_rate(table.assign_coords(alpha=found["alpha"].item(), p=1.0), SITE)
        assert back["rate"].item() == pytest.approx(1e-3, rel=1e-11, abs=0.0)
