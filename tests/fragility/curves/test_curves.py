"""Fitted curves as functions: every form, steps, replicates, what lies beyond the levels, what is refused."""

import numpy as np
import pytest
import xarray as xr
from scipy.stats import lognorm

import toppling as tp
from toppling.fragility import curve_probability
from toppling.fragility.curves.curve import curve_arrays, form_name

X = np.geomspace(0.2, 20.0, 25)


def lognormal(replicates=0):
    """Two blocks, two laws, one of them without an estimate."""
    median = np.array([[2.0, 3.0], [4.0, np.nan]])
    found = xr.Dataset(
        {
            "median": (("block", "model"), median, {"units": "m s-2", "long_name": "median"}),
            "dispersion": (("block", "model"), [[0.4, 0.2], [0.0, np.nan]], {"units": "1", "long_name": "dispersion"}),
        },
        {"block": ["slim", "squat"], "alpha": ("block", [0.1, 0.3], {"units": "rad", "long_name": "slenderness"})},
        {"im": "pga"},
    )
    if replicates:
        factor = np.exp(0.1 * np.random.default_rng(1).standard_normal((2, 2, replicates)))
        found["median_sample"] = (("block", "model", "replicate"), median[..., None] * factor)
        found["dispersion_sample"] = found["dispersion"] * xr.DataArray(factor, dims=("block", "model", "replicate"))
    return found


def isotonic():
    values = np.array([[0.0, 0.2, 0.2, 0.9], [0.1, 0.5, 0.75, 1.0]])
    level = xr.Variable("level", [1.0, 2.0, 4.0, 8.0], {"units": "m s-2", "long_name": "PGA", "im": "pga"})
    return xr.Dataset(
        {"probability": (("block", "level"), values)}, {"level": level}, {"form": "isotonic", "im": "pga"}
    )


class TestForms:
    def test_lognormal_as_scipy_has_it(self):
        found = curve_probability(lognormal(), X)
        assert found.dims == ("block", "model", "level")
        np.testing.assert_allclose(found.values[0, 0], lognorm.cdf(X, 0.4, scale=2.0), rtol=1e-14)
        np.testing.assert_allclose(found.values[0, 1], lognorm.cdf(X, 0.2, scale=3.0), rtol=1e-13)
        assert np.isnan(found.values[1, 1]).all()
        assert found["alpha"].values.tolist() == [0.1, 0.3]
        assert found["level"].attrs["units"] == "m s-2"
        assert found["level"].attrs["im"] == "pga"
        assert found.attrs["units"] == "1"

    def test_a_dispersion_of_0_is_a_step(self):
        found = curve_probability(lognormal(), [3.9999, 4.0, 4.0001]).values[1, 0]
        assert found.tolist() == [0.0, 1.0, 1.0]

    def test_uplift(self):
        curves = lognormal().isel(block=0, model=0)
        step = curves.assign(uplift_median=1.5, uplift_dispersion=0.0).assign_attrs(form="uplift-lognormal")
        found = curve_probability(step, [1.0, 1.4999, 1.5, 3.0])
        over = lognorm.cdf([1.5, 3.0], 0.4, scale=2.0)
        np.testing.assert_allclose(found.values, [0.0, 0.0, *over], rtol=1e-14)
        smooth = curves.assign(uplift_median=1.5, uplift_dispersion=0.3)
        assert form_name(smooth) == "uplift-lognormal"
        product = lognorm.cdf(X, 0.4, scale=2.0) * lognorm.cdf(X, 0.3, scale=1.5)
        np.testing.assert_allclose(curve_probability(smooth, X), product, rtol=1e-13)

    def test_tabulated_is_straight_in_the_logarithm(self):
        found = curve_probability(isotonic(), [1.0, np.sqrt(2.0), 2.0, 3.0, 8.0])
        np.testing.assert_allclose(found.values[0], [0.0, 0.1, 0.2, 0.2, 0.9], atol=1e-15)
        np.testing.assert_allclose(found.values[1, 3], 0.5 + 0.25 * np.log2(1.5), rtol=1e-15)

    def test_beyond_the_levels_by_rule(self):
        least = curve_probability(isotonic(), [0.5, 9.0], "least")
        most = curve_probability(isotonic(), [0.5, 9.0], "most")
        assert least.values.tolist() == [[0.0, 0.9], [0.0, 1.0]]
        assert most.values.tolist() == [[0.0, 1.0], [0.1, 1.0]]

    def test_replicates(self):
        curves = lognormal(replicates=7)
        arrays, dims = curve_arrays(curves, replicates=True)
        assert dims == ("block", "model", "replicate")
        found = arrays.probability(np.log(X))
        one = curves.isel(block=0, model=1, replicate=3)
        expected = lognorm.cdf(X, one["dispersion_sample"].item(), scale=one["median_sample"].item())
        np.testing.assert_allclose(found[0, 1, 3], expected, rtol=1e-13)

    def test_of_a_fit(self):
        """The dataset that fit_fragility returns, whose form is not stated."""
        counts = xr.Dataset(
            {"overturnings": ("level", [0, 4, 13, 16]), "runs": ("level", [20] * 4)},
            {"level": ("level", [1.0, 2.0, 3.0, 4.0], {"units": "m s-2", "im": "pga"})},
        )
        fit = tp.fit_fragility(counts)
        found = curve_probability(fit, fit["median"].item())
        assert float(found[0]) == pytest.approx(0.5, abs=1e-15)
        assert found["level"].attrs["im"] == "pga"


def test_other_refusals():
    falling = isotonic()
    falling["probability"][0, 2] = 0.1
    with pytest.raises(ValueError, match="never fall with the level"):
        curve_probability(falling, [2.0])


def test_a_missing_number_is_a_missing_curve():
    curves = lognormal().assign(uplift_median=1.0, uplift_dispersion=("block", [0.0, np.nan]))
    curves["dispersion"][0, 1] = np.nan
    found = np.isnan(curve_probability(curves, X)).all("level").values
    assert found.tolist() == [[False, True], [True, True]]
    law = tp.HazardCurve.power_law(1e-3, 2.0, "pga")
    assert np.isnan(tp.annual_rate(curves, law)["rate"]).values.tolist() == found.tolist()
    without = curves.drop_vars(["uplift_median", "uplift_dispersion"])
    assert np.isnan(tp.annual_rate(without, law)["rate"]).values.tolist() == [[False, True], [False, True]]


def test_a_tabulated_curve_without_an_estimate_is_nan():
    curves = isotonic()
    curves["probability"][1] = np.nan
    found = curve_probability(curves, [1.0, 2.0, 8.0])
    assert np.isnan(found.values[1]).all()
    assert not np.isnan(found.values[0]).any()


def test_units_of_labelled_levels():
    levels = np.array([1.0, 2.0])
    curves = xr.Dataset({"median": ((), 2.0, {"units": "m s-2"}), "dispersion": 0.5}, attrs={"im": "pga"})
    labelled = xr.DataArray(levels, dims="level", attrs={"units": "m/s²"})
    xr.testing.assert_identical(curve_probability(curves, labelled), curve_probability(curves, levels))


def test_refused(refusal):
    refusal()
