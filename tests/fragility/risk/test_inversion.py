"""The block that meets a rate: sizes solved for, their intervals, and why there is none."""

import numpy as np
import pytest
import xarray as xr
from risk_cases import curves, outer

from toppling.fragility import HazardCurve, annual_rate, size_for_rate


class TestInversion:
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

    @pytest.mark.slow
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
