"""Curves against published ones, and the law between medians and sizes."""

import numpy as np
import xarray as xr

from toppling.fragility import median_ratio


def curves(median, lower, upper, im="pgv"):
    names = {"median": median, "median_lower": lower, "median_upper": upper}
    return xr.Dataset(
        {name: (("block", "model"), np.array(values)[:, None], {"units": "m s-1"}) for name, values in names.items()},
        {"block": [f"b{i}" for i in range(len(median))], "model": ["m"]},
        {"im": im},
    )


class TestMedianRatio:
    def test_verdicts(self):
        """Each by hand: within 15 %, above, below, across 1, no estimate, across the margin but above 1."""
        found = curves(
            [1.0, 1.5, 0.6, 1.0, np.nan, 1.1], [0.9, 1.3, 0.5, 0.7, np.nan, 1.05], [1.1, 1.7, 0.7, 1.4, np.nan, 1.3]
        )
        known = xr.Dataset(
            {"median": ("block", np.ones(6), {"units": "m s-1"})}, {"block": found.block.values}, {"im": "pgv"}
        )
        result = median_ratio(found, known)
        assert result.verdict.values[:, 0].tolist() == ["agrees", "higher", "lower", "open", "open", "higher"]
        np.testing.assert_array_equal(result.ratio.values[:, 0], found["median"].values[:, 0])

    def test_only_blocks_in_common_and_in_their_own_order(self):
        found = curves([2.0, 3.0], [1.9, 2.9], [2.1, 3.1])
        known = xr.Dataset(
            {"median": ("block", [9.0, 1.5, 1.0], {"units": "m s-1"})}, {"block": ["x", "b1", "b0"]}, {"im": "pgv"}
        )
        assert median_ratio(found, known).ratio.values[:, 0].tolist() == [2.0, 2.0]


def test_refused(refusal):
    refusal()
