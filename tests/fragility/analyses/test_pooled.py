"""Pooled curves of many blocks end to end: against runs of the blocks themselves, equal bytes, region, refusals."""

import json
import math
import re
import warnings

import dask
import numpy as np
import pytest
import xarray as xr
from direct_medians import Kinked, direct_medians

import toppling as tp
from toppling.core.doubts import ImplausibleInput
from toppling.core.units import STANDARD_GRAVITY
from toppling.fragility import HazardCurve, pooled, surface_curves
from toppling.fragility.analyses import region_runs
from toppling.fragility.surfaces import cuts, sequential as pooled_curves
from toppling.fragility.surfaces.checks import check_surface
from toppling.models import BlockArray


class Cut(tp.motions.CloughPenzien):
    """Motions that end with their noise: kinks and checks are tuned to them."""

    @property
    def rest(self):
        return 0.0


SHAKES = Cut(duration=8.0, dt=0.01)
LAWS = [tp.HousnerImpact(), tp.EnergyConsistent()]
COARSE = {"median": 0.12, "motions": {"least": 64, "most": 4000}}
HAZARD = HazardCurve.power_law(1e-3, 2.0, "pga")


def region(number, seed=0, narrow=1.0):
    """Blocks at random between 3 and 6 times as high as wide, R from 0.5 to 1.5 m."""
    random = np.random.default_rng(seed)
    slender, size = (
        np.exp(np.log(mid) + narrow * np.log(far) * random.uniform(-1, 1, number))
        for mid, far in ((4.24, 1.41), (0.87, 1.73))
    )
    alpha = np.arctan(1.0 / slender)
    return BlockArray(2.0 * size * np.sin(alpha), 2.0 * size * np.cos(alpha))


@pytest.fixture(scope="module")
def found():
    return pooled(region(2000), LAWS, SHAKES, "pga", COARSE, hazard=HAZARD, seed=1)


def test_layout(found):
    assert dict(found["half_level"].sizes) == {"block": 2000, "model": 2}
    assert found["stopped_because"].values.tolist() == ["precision reached"] * 2
    assert found.attrs["design"] == "pooled"
    assert bool((found["half_width"] <= 0.12).all())
    assert bool(
        (found["half_level_lower"] < found["half_level"]).all()
        & (found["half_level"] < found["half_level_upper"]).all()
    )
    assert bool((found["rate_lower"] < found["rate"]).all() & (found["rate"] < found["rate_upper"]).all())
    # the widest of the region, whose corners are blocks of it
    widest = (found["half_level_upper"] / found["half_level"] - 1.0).max("block")
    np.testing.assert_allclose(widest, found["half_width"], rtol=0.05)
    assert found.sizes["pooled_run"] == 16 * int(found["motions_run"].sum())
    assert json.loads(found.attrs["configuration"])["until"] == COARSE


@pytest.mark.slow
def test_medians_are_those_of_runs_of_the_blocks_themselves(found):
    tested = region(12, seed=5, narrow=0.9)
    curves = surface_curves(found, tested)
    blocks = [tp.Block(w, h, name=name) for w, h, name in zip(tested.width, tested.height, tested.names, strict=True)]
    for i, law in enumerate(LAWS):
        truth, error = direct_medians(blocks, law, curves.isel(model=[i]), 1500, SHAKES)
        assert error.max() < 0.02
        lower, upper = (np.log(curves[f"half_level_{end}"].values[:, i]) for end in ("lower", "upper"))
        assert ((lower - 2 * error < truth) & (truth < upper + 2 * error)).all()


def test_runs_are_runs(found):
    """Single runs of the analysis' own blocks are those of `ida` of these blocks at these levels."""
    for i in np.random.default_rng(3).integers(0, found.sizes["pooled_run"], 12):
        run = found.isel(pooled_run=i)
        p, inertia = float(run["run_p"]), float(run["run_inertia_factor"])
        block = tp.Block.from_slenderness(float(run["run_alpha"]), STANDARD_GRAVITY / (inertia * p**2), inertia)
        motion = SHAKES.sample(1, 1, int(run["run_motion"]))
        own = tp.ida(block, LAWS[int(run["run_model"])], motion, [float(run["run_level"])], "pga", ["overturned"])
        assert bool(own["overturned"].squeeze()) == bool(run["run_overturned"])


@pytest.mark.slow
def test_levels_grow_with_the_square_of_the_scale():
    """Runs at levels of Arias intensity are those of `ida` there, though surfaces take them over (g tan α)²."""
    block = tp.Block.from_slenderness(0.2, 0.8)
    found = pooled(block, LAWS[1], SHAKES, "arias", {"median": 0.5}, blocks_per_motion=4)
    for i in range(found.sizes["pooled_run"] // 2, found.sizes["pooled_run"], 20):
        run = found.isel(pooled_run=i)
        motion = SHAKES.sample(1, 0, int(run["run_motion"]))
        own = tp.ida(block, LAWS[1], motion, [float(run["run_level"])], "arias", ["overturned"])
        assert bool(own["overturned"].squeeze()) == bool(run["run_overturned"])


@pytest.mark.slow
def test_bytes_do_not_depend_on_the_number_of_workers(found):
    with dask.config.set(num_workers=1):
        again = pooled(region(2000), LAWS, SHAKES, "pga", COARSE, hazard=HAZARD, seed=1)
    xr.testing.assert_identical(again.drop_attrs(deep=False), found.drop_attrs(deep=False))
    other = pooled(region(2000), LAWS, SHAKES, "pga", COARSE, seed=2)
    assert not np.array_equal(other["half_level"].values, found["half_level"].values)


def test_curves_of_further_blocks_and_of_none_outside(found):
    columns = region(2000)
    some = BlockArray(columns.width[:5], columns.height[:5])
    curves = surface_curves(found, some, HAZARD)
    for name in ("half_level", "half_level_lower", "dispersion", "rate", "rate_upper"):
        np.testing.assert_array_equal(curves[name].values, found[name].values[:5])


@pytest.mark.slow
def test_rates_are_near_those_of_weighted_runs(found):
    """Against adaptive levels, whose rates have no form of curve and share no run with these."""
    columns = region(4, 7, 0.8)
    curves = surface_curves(found, columns, HAZARD)
    for i in range(4):
        block = tp.Block(columns.width[i], columns.height[i], name="block")
        other = tp.adaptive_ida(block, LAWS[1], SHAKES, "pga", until={"rate": 0.05, "hazard": HAZARD}, seed=4)
        assert abs(float(curves["rate"][i, 1]) / float(other["rate"].squeeze()) - 1.0) < 0.15


@pytest.fixture(scope="module")
def cut():
    return pooled(region(2000), Kinked(delta=0.1), SHAKES, "pga", {"median": 0.08}, hazard=HAZARD, seed=1)


@pytest.mark.slow
def test_a_region_with_a_kink_is_cut_there(cut):
    """Blocks of R above 0.8 m have another elastic zone: a surface for each side, which fresh blocks confirm."""
    assert float(cut["lack_of_fit"][0]) == 0.0
    assert float(cut["half_width"][0]) < 0.15
    words = re.search(r"cut at a size R of (\S+) m, .* between (\S+) and (\S+) m hold both", cut["account"].values[0])
    place, low, high = (float(one) for one in words.groups())
    assert low <= 0.8 <= high < 1.05 * low
    assert low <= place <= high
    assert "at a cut" in cut["account"].values[0]
    # medians jump there, and intervals of blocks between hold both sides
    alpha = 0.23
    around = [tp.Block.from_slenderness(alpha, r, name=f"{r}") for r in (0.97 * low, 0.5 * (low + high), 1.03 * high)]
    curves = surface_curves(cut, around, HAZARD).isel(model=0)
    before, between, beyond = curves["half_level"].values.tolist()
    assert beyond / before > 1.1 or before / beyond > 1.1
    assert float(curves["half_level_lower"][1]) < min(before, beyond)
    assert float(curves["half_level_upper"][1]) > max(before, beyond)
    assert min(before, beyond) * 0.95 < between < max(before, beyond) * 1.05
    assert bool((curves["rate_lower"] < curves["rate"]).all() & (curves["rate"] < curves["rate_upper"]).all())


@pytest.mark.slow
@pytest.mark.parametrize("seed", [3, 18])
def test_a_kink_that_the_check_misses_is_found_in_the_runs(seed, monkeypatch):
    """24 blocks agree with a surface whose further degrees, or width, hide the jump; all of its runs do not."""
    passed = []
    cut_region = pooled_curves.PooledCurves.cut_region

    def seen(law, planes, agreed):
        passed.append(agreed)
        return cut_region(law, planes, agreed)

    monkeypatch.setattr(pooled_curves.PooledCurves, "cut_region", seen)
    found = pooled(region(2000), Kinked(delta=0.1), SHAKES, "pga", {"median": 0.08}, seed=seed)
    assert passed == [True]
    # (or, of seed 18, further blocks do not agree with the cut either, and every interval holds what is left)
    cut_there = "cut at a size R of 0.8" in found["account"].values[0]
    assert cut_there == (seed == 3)
    assert cut_there or float(found["lack_of_fit"][0]) > 0.1


@pytest.mark.slow
def test_laws_whose_checks_take_the_last_motions_end_with_what_is_known(monkeypatch):
    """The check of the first law sends it on, and that of the second takes all motions that were left."""
    answers = iter([True])
    monkeypatch.setattr(pooled_curves.PooledCurves, "cut_region", lambda *given: next(answers, False))
    monkeypatch.setattr(region_runs, "_better", lambda law, found, *given: found)
    monkeypatch.setattr(region_runs, "MOTIONS", 400)
    until = {"median": 0.3, "motions": {"least": 64, "most": 900}}
    found = pooled(region(300), LAWS, SHAKES, until=until, seed=1)
    assert found["stopped_because"].values.tolist() == ["most motions", "precision reached"]
    assert (found["motions_run"].values < 500).all()


@pytest.mark.slow
def test_medians_on_both_sides_of_a_cut_are_those_of_runs(cut):
    tested = region(24, seed=5, narrow=0.9)
    blocks = [tp.Block(w, h, name=name) for w, h, name in zip(tested.width, tested.height, tested.names, strict=True)]
    curves = surface_curves(cut, tested)
    truth, error = direct_medians(blocks, Kinked(delta=0.1), curves, 1500, SHAKES)
    lower, upper = (np.log(curves[f"half_level_{end}"].values[:, 0]) for end in ("lower", "upper"))
    assert ((lower - 2 * error < truth) & (truth < upper + 2 * error)).mean() > 0.95
    assert np.sqrt(np.mean((np.log(curves["half_level"].values[:, 0]) - truth) ** 2)) < 0.035


@pytest.mark.slow
def test_cuts_are_kept_in_files_and_hold_for_one_law_alone(cut, tmp_path):
    cut.to_netcdf(tmp_path / "surface.nc")
    with xr.open_dataset(tmp_path / "surface.nc") as read:
        own, other = (surface_curves(one, region(9, 5, 0.9), HAZARD) for one in (cut, read))
        for name in ("half_level", "half_level_upper", "rate"):
            np.testing.assert_array_equal(own[name], other[name])
    laws = [tp.EnergyConsistent(), Kinked(delta=0.1)]
    both = pooled(region(2000), laws, SHAKES, "pga", {"median": 0.08}, seed=1)
    assert both["cut_places"].notnull().all("place").values.tolist() == [False, True]
    assert ["a size R" in account for account in both["account"].values] == [False, True]


@pytest.mark.slow
@pytest.mark.parametrize("worst", [0.1, 0.0])
def test_a_cut_that_fresh_blocks_do_not_confirm_is_given_up(worst, monkeypatch):
    """The first check is made to fail although nothing is amiss, or it passes, and any jump is taken: fresh blocks
    refuse it.
    """
    known = iter([worst])

    def failing(*given):
        found = check_surface(*given)
        return found._replace(worst=max(found.worst, next(known, 0.0)))

    monkeypatch.setattr(region_runs, "check_surface", failing)
    monkeypatch.setattr(cuts, "LIKELY", math.inf)
    monkeypatch.setattr(pooled_curves, "MOST_DEGREES", (4, 2))
    tried = []
    cut_region = pooled_curves.PooledCurves.cut_region
    monkeypatch.setattr(
        pooled_curves.PooledCurves, "cut_region", lambda *given: tried.append(cut_region(*given)) or tried[-1]
    )
    found = pooled(region(300), LAWS[1], SHAKES, until=COARSE, seed=1)
    assert tried == [True]
    assert float(found["lack_of_fit"][0]) == pytest.approx(math.expm1(worst))
    assert "cut_places" not in found
    assert "cut" not in found["account"].values[0]


@pytest.mark.slow
def test_one_block_and_one_size():
    one = pooled(tp.Block(0.4, 1.8, name="alone"), LAWS[1], SHAKES, until=COARSE)
    other = tp.adaptive_ida(tp.Block(0.4, 1.8, name="alone"), LAWS[1], SHAKES, "pga", until={"median": 0.05}, seed=9)
    assert one.sizes["region_axis"] == 0
    assert abs(float(np.log(one["half_level"].squeeze() / other["half_level"].squeeze()))) < 0.15
    sizes = pooled([tp.Block.from_slenderness(0.2, r) for r in (0.5, 0.8, 1.2)], LAWS[1], SHAKES, until=COARSE)
    assert sizes.sizes["region_axis"] == 1


def test_a_set_of_motions_and_its_end():
    motions = SHAKES.sample(80)
    found = pooled(region(20), LAWS[1], motions, until={"median": 0.02})
    assert found["stopped_because"].values.tolist() == ["no more motions"]
    assert found["motions_run"].values.tolist() == [80]
    assert "takes about" in found["account"].values[0]


@pytest.mark.slow
@pytest.mark.parametrize(
    "blocks",
    [
        [(0.4, 1.6), (0.5, 1.6), (0.4, 1.9)],
        [(0.4, 1.6), (0.5, 1.6), (0.4, 1.9), (0.42, 1.65)],  # (one of them within the triangle)
        [(0.4, 1.6), (0.5, 1.6)],
    ],
)
def test_few_blocks_have_a_surface(blocks):
    """Regions that are triangles or lines: medians are those of the blocks by themselves, within the intervals."""
    shelves = [tp.Block(*one) for one in blocks]
    found = pooled(shelves, LAWS[1], SHAKES, until={"median": 0.25, "motions": {"least": 64, "most": 2000}})
    direct, error = direct_medians(shelves, LAWS[1], found, 400, SHAKES)
    lower, upper = (np.log(found[f"half_level_{end}"].values[:, 0]) for end in ("lower", "upper"))
    assert (lower - 3.0 * error <= direct).all()
    assert (direct <= upper + 3.0 * error).all()


def test_what_is_odd_is_said_before_the_runs():
    still = SHAKES.sample(64).copy(deep=True)
    still[5] = 0.0
    with warnings.catch_warnings(action="error"), pytest.raises(ValueError, match="has pga = 0 and cannot be scaled"):
        pooled(region(20), LAWS[1], still)
    with pytest.warns(ImplausibleInput, match="sides above 20 m"), pytest.raises(ValueError, match="too few"):
        pooled(
            [tp.Block(40.0, 160.0), tp.Block(50.0, 160.0)],
            LAWS[1],
            SHAKES,
            until={"median": 0.5, "motions": {"least": 64, "most": 64}},
            blocks_per_motion=1,
        )


def test_what_needs_runs_of_each_block_refuses_surfaces(found):
    for function in (tp.fit_fragility, tp.overturning_probability, tp.fragility.overturning_capacity):
        with pytest.raises((ValueError, TypeError, KeyError)):
            function(found)


def own_region(n=300, seed=4):
    """Blocks that differ in e and delta, too."""
    random = np.random.default_rng(seed)
    height, slenderness = random.uniform(1.2, 2.0, n), random.uniform(3.0, 5.0, n)
    own = {"e": random.uniform(0.86, 0.96, n), "delta": np.exp(random.uniform(np.log(0.02), np.log(0.08), n))}
    return BlockArray(height / slenderness, height, **own)


@pytest.mark.slow
def test_medians_of_blocks_with_their_own_e_and_delta_are_those_of_their_runs():
    """Four numbers a block: medians are those of sequential analyses of blocks under laws with their options."""
    region = own_region()
    found = pooled(region, tp.DiscreteDamping(), SHAKES, until={"median": 0.2})
    assert found["near_degrees"][0].values.tolist() >= [3, 1]
    assert found["model"].values.tolist() == ["discrete e=own δ=own"]
    assert found.sizes["region_axis"] == 4
    np.testing.assert_array_equal(found["own_delta"], region.own["delta"])
    gaps, reaches = [], []
    for i in (3, 120, 200):
        (block,) = region.some(np.array([i]))
        law = tp.DiscreteDamping(e=float(region.own["e"][i]), delta=float(region.own["delta"][i]))
        one = tp.adaptive_ida(block, law, SHAKES, until={"median": 0.05}, seed=9)
        gaps.append(np.log(found["half_level"][i, 0].item() / one["half_level"].item()))
        reaches.append(np.log(found["half_level_upper"][i, 0] / found["half_level"][i, 0]).item())
    assert np.sqrt(np.mean(np.square(gaps))) < 0.08
    assert (np.abs(gaps) < np.array(reaches) + 0.05).all()
    # (medians do depend on them: with e and delta of another block they are others)
    size = {"width": [0.4, 0.4], "height": [1.6, 1.6]}
    lossy, bouncy = surface_curves(found, BlockArray(**size, e=[0.88, 0.94], delta=[0.04, 0.04]))["half_level"].values[
        :, 0
    ]
    assert lossy > 1.1 * bouncy


@pytest.mark.slow
def test_own_e_that_is_that_of_the_law_gives_its_curves():
    """With one e for all blocks the surface has no further axis, and its runs are those of a law with this e."""
    plain = own_region(40)
    alike = BlockArray(plain.width, plain.height, e=np.full(40, 0.9))
    until = {"median": 0.3}
    found = pooled(alike, tp.HousnerImpact(), SHAKES, until=until)
    law = pooled(BlockArray(plain.width, plain.height), tp.HousnerImpact(e=0.9), SHAKES, until=until)
    np.testing.assert_allclose(found["half_level"], law["half_level"], rtol=1e-9)
    assert found["model"].values.tolist() == ["housner e=own"]


def test_refused(refusal):
    refusal()
