"""Published overturning criteria: their numbers, what is said of them, and that they are curves like one's own."""

import csv
import math
import re

import numpy as np
import pytest
from shared_cases import SHARED, needs_shared

import toppling as tp
from toppling.core.doubts import ImplausibleInput
from toppling.core.units import SCHEMA, STANDARD_GRAVITY as G
from toppling.fragility.curves import published


class TestFemaP58:
    @needs_shared
    def test_rows_are_those_of_the_database(self):
        """Every unanchored row in peak floor velocity, and none but those."""
        with (SHARED / "data" / "fema_p58_contents.csv").open(encoding="utf-8") as stream:
            rows = [row for row in csv.DictReader(stream) if row["ID"].endswith("a")]
        curves = published.fema_p58()
        assert [row["ID"] for row in rows] == curves["id"].values.tolist()
        assert {(row["Demand-Type"], row["Demand-Unit"], row["LS1-Family"]) for row in rows} == {
            ("Peak Floor Velocity", "mps", "lognormal")
        }
        np.testing.assert_array_equal(curves["median"], [float(row["LS1-Theta_0"]) for row in rows])
        np.testing.assert_array_equal(curves["dispersion"], [float(row["LS1-Theta_1"]) for row in rows])
        np.testing.assert_array_equal(curves["directional"], [int(row["Demand-Directional"]) for row in rows])

    def test_blocks_are_those_of_the_catalogue(self):
        curves = published.fema_p58()
        known = {tp.catalogue.item(name).fema_p58: name for name in tp.catalogue if tp.catalogue.item(name).fema_p58}
        assert dict(zip(curves["id"].values, curves["block"].values, strict=True)) == known
        for name in curves["block"].values:
            one = curves.sel(block=name)
            assert (one["width"].item(), one["height"].item()) == (tp.catalogue[name].width, tp.catalogue[name].height)

    def test_law_between_the_medians(self):
        """Least squares over the nine rows, by themselves: the coefficients, and how far the rows are from them."""
        curves = published.fema_p58()
        B, H, median = (curves[name].values for name in ("width", "height", "median"))
        design = np.column_stack([np.ones(9), np.log(B), np.log(H)])
        found = np.linalg.lstsq(design, np.log(median), rcond=None)[0]
        np.testing.assert_allclose(found, [1.0535, 1.4802, -1.0740], atol=6e-5)
        np.testing.assert_array_equal(found.round(2), published.P58_COEFFICIENTS)
        off = median / np.exp(design @ found) - 1.0
        assert (off.min(), off.max()) == pytest.approx((-0.0332, 0.0507), abs=6e-5)
        blocks = [tp.Block(width, height, name=f"{width} x {height}") for width, height in zip(B, H, strict=True)]
        rounded = median / published.p58_estimate(blocks)["median"].values - 1.0
        assert (rounded.min(), rounded.max()) == pytest.approx((-0.0301, 0.0563), abs=6e-5)
        assert curves["block"].values[rounded.argmax()] == "file-vertical-2-drawer"

    def test_medians_beside_the_japanese_velocity(self):
        curves = published.fema_p58()
        velocity = published.japanese([tp.catalogue[name] for name in curves["block"].values], "velocity")
        ratio = (curves["median"] / velocity["median"]).values
        assert ratio.mean() == pytest.approx(0.7905, abs=6e-5)
        assert ratio.std(ddof=1) / ratio.mean() == pytest.approx(0.0230, abs=6e-5)
        assert (ratio.min(), ratio.max()) == pytest.approx((0.748, 0.808), abs=6e-4)

    def test_estimates(self):
        blocks = [tp.Block(0.4, 2.0, name="inside"), tp.Block(0.4, 2.1, name="tall"), tp.Block(0.3, 1.0, name="thin")]
        curves = published.p58_estimate(blocks)
        for block, median in zip(blocks, curves["median"].values, strict=True):
            assert median == pytest.approx(math.exp(1.05) * block.width**1.48 * block.height**-1.07, rel=1e-14)
        assert curves["extrapolated"].values.tolist() == [False, True, True]
        assert set(curves["dispersion"].values) == {0.5}


class TestJapanese:
    # gal: B/H g and the table's acceleration of 50 % (National Institute for Land and Infrastructure Management)
    NILIM = [(174, 205), (232, 287), (327, 436), (315, 416), (535, 826)]

    @pytest.mark.parametrize(("static", "printed"), NILIM)
    def test_acceleration_reproduces_the_table(self, static, printed):
        """Both are printed in whole gal: some slenderness within the rounding of the first gives the second."""

        def acceleration(gal):
            curves = published.japanese(tp.Block(gal / 100.0 / G, 1.0))
            return 100.0 * curves["median"].item()

        assert acceleration(static - 0.5) <= printed + 0.5
        assert acceleration(static + 0.5) >= printed - 0.5

    def test_velocity_is_the_formula_in_its_own_units(self):
        blocks = [tp.Block(0.4, 1.8, name="a"), tp.Block(0.32, 0.74, name="b")]
        curves = published.japanese(blocks, "velocity")
        for block, median in zip(blocks, curves["median"].values, strict=True):
            B, H = 100.0 * block.width, 100.0 * block.height
            assert 100.0 * median == pytest.approx(10.0 * B / math.sqrt(H) * (1.0 + B / H) ** 2.5, rel=1e-14)
            # the two criteria meet at the frequency that the literature gives for it
            frequency = 15.6 / math.sqrt(H) * (1.0 + B / H) ** -1.5
            acceleration = published.japanese(block)["median"].item()
            assert acceleration / (2.0 * math.pi * frequency) == pytest.approx(median, rel=1e-3)
        assert set(curves["dispersion"].values) == {0.5}

    def test_a_flatter_block_needs_more(self):
        blocks = [tp.Block(width, 1.5, name=str(width)) for width in (0.2, 0.4, 0.8)]
        for criterion in published.CRITERIA:
            assert np.all(np.diff(published.japanese(blocks, criterion)["median"].values) > 0.0)


@pytest.mark.parametrize("sizes", [(40.0, 180.0), (1.8, 0.4), (0.004, 1.8)], ids=["cm", "exchanged", "small"])
@pytest.mark.parametrize(
    "criterion",
    [
        lambda *sizes: published.p58_estimate(tp.Block(*sizes)),
        lambda *sizes: published.japanese(tp.Block(*sizes)),
        lambda *sizes: published.japanese(tp.Block(*sizes), "velocity"),
    ],
)
def test_sizes_of_another_unit_are_doubted_once(criterion, sizes):
    said = {40.0: r"sides above 20 m", 1.8: r"a width above 1\.5 m", 0.004: r"sides below 0\.01 m"}[sizes[0]]
    with pytest.warns(ImplausibleInput, match=said) as caught:
        criterion(*sizes)
    assert len([one for one in caught if re.search(said, str(one.message))]) == 1
    assert caught[0].filename == __file__


CURVES = {
    "fema_p58": published.fema_p58,
    "p58_estimate": lambda: published.p58_estimate(tp.Block(0.4, 1.8)),
    "acceleration": lambda: published.japanese(tp.Block(0.4, 1.8)),
    "velocity": lambda: published.japanese(tp.Block(0.4, 1.8), "velocity"),
}


@pytest.mark.parametrize("name", CURVES)
def test_they_are_curves_like_ones_own(name):
    curves = CURVES[name]()
    assert curves["median"].dims == curves["dispersion"].dims == ("block",)
    assert curves.attrs["form"] == "lognormal"
    im, unit = ("pga", "m s-2") if name == "acceleration" else ("pgv", "m s-1")
    assert (curves.attrs["im"], curves["median"].attrs["units"]) == (im, unit)
    assert curves.attrs["schema"] == SCHEMA
    assert bool(curves["converged"].all())
    assert set(curves["status"].values) == {"ok"}
    for variable in curves.variables:
        assert {"units", "long_name"} <= set(curves[variable].attrs), variable


def test_refused(refusal):
    refusal()
