"""Pairs of components along the axes of blocks: azimuths, and simulated pairs."""

import math

import numpy as np
import pytest

from toppling import motions as mo
from toppling.motions.arrays import BOTH_AXES, WEAK_AXIS, records

NOISE = mo.CloughPenzien(duration=8.0, dt=0.02)


def correlations(pair):
    one, two = (pair.sel(component=name).values for name in ("h1", "h2"))
    return (one * two).sum(axis=1) / np.sqrt((one**2).sum(axis=1) * (two**2).sum(axis=1))


class TestAzimuth:
    def test_components_along_width_and_depth(self):
        pair = NOISE.sample_pairs(2, seed=4)
        (turned,) = mo.both_axes(pair, 0.6)
        h1, h2 = (pair.sel(component=name).values for name in ("h1", "h2"))
        expected = h1 * math.cos(0.6) + h2 * math.sin(0.6), -h1 * math.sin(0.6) + h2 * math.cos(0.6)
        for name, values in zip(("h1", "h2"), expected, strict=True):
            np.testing.assert_allclose(turned.sel(component=name), values, rtol=1e-12, atol=1e-12)

    @pytest.mark.parametrize(
        ("turns", "signs"), [(0, (1, 1)), (1, (1, -1)), (2, (-1, -1)), (3, (-1, 1)), (-1, (-1, 1))]
    )
    def test_right_angles_exchange_components_to_the_last_bit(self, turns, signs):
        pair = NOISE.sample_pairs(2)
        (turned,) = mo.both_axes(pair, turns * 0.5 * math.pi)
        names = ("h1", "h2") if turns % 2 == 0 else ("h2", "h1")
        for name, of, sign in zip(("h1", "h2"), names, signs, strict=True):
            np.testing.assert_array_equal(turned.sel(component=name), sign * pair.sel(component=of))

    def test_random_azimuths_have_streams_of_their_own(self):
        (turned,) = mo.both_axes(NOISE.sample_pairs(4), "random", seed=9)
        found = [one.azimuth for one in records(turned)]
        expected = [
            np.random.default_rng(np.random.SeedSequence(9, spawn_key=(i, 1))).uniform(0.0, 2.0 * math.pi)
            for i in range(4)
        ]
        np.testing.assert_allclose(found, expected, rtol=1e-15)

    def test_numbers_go_on_from_array_to_array(self):
        whole = mo.both_axes(NOISE.sample_pairs(4), "random")[0]
        parts = mo.both_axes([NOISE.sample_pairs(3), NOISE.sample_pairs(1, first=3)], "random")
        np.testing.assert_array_equal(whole, np.concatenate([one.values for one in parts]))
        (last,) = mo.both_axes(NOISE.sample_pairs(1, first=3), "random", first=3)
        np.testing.assert_array_equal(whole[3:], last)

    def test_measures_of_both_do_not_depend_on_the_azimuth(self):
        pair = NOISE.sample_pairs(3)
        names = ["RotD50(pga)", "RotD100(pgv)"]
        here, there = (mo.measures(mo.both_axes(pair, angle)[0], names) for angle in (0.0, math.radians(37.0)))
        for name in names:
            np.testing.assert_allclose(here[name], there[name], rtol=1e-9)

    def test_how_records_shake(self):
        pair = NOISE.sample_pairs(2)
        for shaken, how in ((mo.both_axes(pair), BOTH_AXES), (mo.weak_axis(pair), WEAK_AXIS)):
            assert {one.axes for one in records(shaken)} == {how}
        assert {one.axes for one in records(mo.as_recorded(pair))} == {""}


class TestSimulatedPairs:
    @pytest.mark.parametrize("correlation", [-0.7, 0.0, 0.4, 1.0])
    def test_the_correlation_is_the_one_asked_for(self, correlation):
        found = correlations(NOISE.sample_pairs(400, seed=2, correlation=correlation))
        assert abs(found.mean() - correlation) < 4.0 * found.std() / 20.0 + 1e-12
        # (h1 and the motion that is drawn independently of it are as strong on average, but not motion by motion)
        assert found.std() < 0.2

    def test_the_first_component_is_the_sample(self):
        np.testing.assert_array_equal(NOISE.sample_pairs(3, 5).sel(component="h1"), NOISE.sample(3, 5))

    def test_motions_can_be_made_in_parts(self):
        whole = NOISE.sample_pairs(5, 5)
        np.testing.assert_array_equal(whole[3:], NOISE.sample_pairs(2, 5, first=3))
        assert whole["motion"].values[3:].tolist() == NOISE.sample_pairs(2, 5, first=3)["motion"].values.tolist()

    def test_components_of_an_earthquake_share_its_intensity(self):
        scenario = mo.SiteBasedScenario(duration=40.0, dt=0.02)
        pair = scenario.sample_pairs(20)
        energy = (pair**2).sum("time")
        np.testing.assert_allclose(energy.sel(component="h1"), energy.sel(component="h2"), rtol=1e-9)
        assert float(energy.sel(component="h1").std() / energy.sel(component="h1").mean()) > 0.3

    def test_both_components_have_the_spectrum_of_the_generator(self):
        pair = NOISE.sample_pairs(200, correlation=0.5)
        pgv = [mo.measures(mo.as_recorded(pair, name), ["pgv"])["pgv"].values.mean() for name in ("h1", "h2")]
        assert math.isclose(*pgv, rel_tol=0.08)


def test_refused(refusal):
    refusal()
