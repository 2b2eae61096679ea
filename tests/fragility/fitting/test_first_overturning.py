"""What first overturnings owe to the spacing of their levels."""

import math

import numpy as np
import pytest

import toppling as tp
from toppling.fragility import overturning_capacity
from toppling.fragility.fitting.first_overturning import level_shift, spacing_attributes

LEVELS = np.geomspace(0.5, 8.0, 41)


def test_one_capacity_a_motion_does_not_shift():
    capacity = np.geomspace(0.8, 5.0, 400)
    assert abs(level_shift(capacity[:, None] < LEVELS, LEVELS)) < 1e-3
    assert spacing_attributes(LEVELS)["level_spacing"] == pytest.approx(LEVELS[1] / LEVELS[0] - 1.0, rel=1e-9)


def test_verdicts_drawn_by_chance_shift_as_their_law_says():
    """Independent verdicts of one probability: first overturnings are geometric in the number of the level."""
    p, n = 0.1, 4000
    levels = np.exp(0.01 * np.arange(400))
    fell = np.random.default_rng(1).random((n, levels.size)) < p

    # With all levels a bracket's middle is i - 1/2 for a fall at level i.  Of every other level it is 2 j - 1 for the
    # even ones and 2 j for the odd ones, and falls at 0, of the odd ones at 1, too, leave nothing known.  With
    # E(i | i >= 1) = E(j | j >= 1) = 1/p and E(i | i >= 2) = 1 + 1/p both differences are 1/p - 1/2 levels.
    assert level_shift(fell, levels) == pytest.approx(0.01 * (1.0 / p - 0.5), rel=0.03)


def test_the_order_of_the_levels_does_not_matter():
    fell = np.random.default_rng(2).random((50, LEVELS.size)) < 0.2
    assert level_shift(fell[:, ::-1], LEVELS[::-1]) == level_shift(fell, LEVELS)
    assert spacing_attributes(LEVELS[::-1]) == spacing_attributes(LEVELS)


def test_capacities_and_fits_say_it_of_their_runs():
    shakes = tp.motions.CloughPenzien(duration=10.0, dt=0.01).sample(40)
    blocks = [tp.Block(0.4, 1.6), tp.Block(0.8, 2.4)]
    runs = tp.ida(blocks, tp.EnergyConsistent(), shakes, np.geomspace(1.0, 12.0, 40), screen=False)
    capacities = overturning_capacity(runs)
    fitted = tp.fit_fragility(runs, method="first-overturning")
    for one in (capacities, fitted):
        assert one.attrs["level_spacing"] == pytest.approx(12.0 ** (1.0 / 39.0) - 1.0, rel=1e-9)
        assert "closer levels" in one.attrs["note"]
        assert one["level_shift"].dims == ("block", "model")
    assert np.array_equal(capacities["level_shift"], fitted["level_shift"])
    # by hand, from capacities of every other level
    half = [overturning_capacity(runs.isel(level=slice(k, None, 2)))["capacity"] for k in (0, 1)]
    gaps = np.stack([(np.log(one) - np.log(capacities["capacity"])).values[:, 0] for one in half])
    assert capacities["level_shift"].values[:, 0] == pytest.approx(np.nanmean(gaps, axis=(0, 2)), rel=1e-9)
    assert bool((capacities["level_shift"] > 0.0).all())
    pooled = tp.fit_fragility(runs, method="first-overturning", together=["block"])
    assert pooled["level_shift"].values == pytest.approx(np.nanmean(gaps), rel=1e-9)
    plain = tp.fit_fragility(runs, replicates=20)
    assert "note" not in plain.attrs
    assert "level_shift" not in plain


def test_floors_have_a_shift_each():
    ground = tp.motions.CloughPenzien(duration=6.0, dt=0.01).sample(12, 4)
    floors = tp.motions.Building.flexural_shear(0.5, storeys=3).floor_motions(ground, floors=[1, 3])
    runs = tp.ida(tp.Block(0.4, 1.6), tp.EnergyConsistent(), floors, np.geomspace(1.0, 12.0, 40), screen=False)
    found = tp.fit_fragility(runs, method="first-overturning")["level_shift"]
    assert found.dims == ("block", "model", "floor")
    for floor in (1, 3):
        alone = runs.isel(motion=np.flatnonzero(runs["floor"].values == str(floor)))
        assert overturning_capacity(alone)["level_shift"].item() == found.sel(floor=floor).item()


def test_few_levels_tell_nothing():
    assert math.isnan(level_shift(np.ones((3, 2), bool), LEVELS[:2]))
    assert math.isnan(spacing_attributes(LEVELS[:1])["level_spacing"])
