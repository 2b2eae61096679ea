"""The screen of runs at adaptive levels: every run as a screen of its own has it, shares, selections, refusals."""

import json

import numpy as np
import pytest
import xarray as xr
from flips import undecided_outcomes

import toppling as tp
from toppling.fragility import notes, screen
from toppling.fragility.validity.notes import screen_facts
from toppling.fragility.validity.reasons import AIRBORNE, REASONS, SLIDES_AT_UPLIFT, UNDECIDED
from toppling.fragility.validity.sparse_screen import Shaken
from toppling.models.friction import LognormalFriction
from toppling.motions import both_axes
from toppling.motions.arrays import records
from toppling.motions.polarity import both_polarities

SHAKES = tp.motions.CloughPenzien(duration=8.0, dt=0.01)
BLOCKS = [tp.Block(0.4, 1.6, name="narrow", depth=0.5), tp.Block(0.8, 1.4, name="squat", depth=1.5)]
LAWS = [tp.HousnerImpact(), tp.DiscreteDamping(delta=0.05)]
COARSE = {"median": 0.25, "motions": {"least": 32, "most": 400}}
FRICTION = {"narrow": 0.3, "squat": LognormalFriction(0.5, 0.3)}
OF_RUNS = ("friction_rocking_demand", "friction_uplift_demand", "scale_factor", "verdict")


@pytest.fixture(scope="module")
def found():
    return tp.adaptive_ida(BLOCKS, LAWS, SHAKES, "pgv", until=COARSE)


@pytest.fixture(scope="module")
def screened(found):
    return screen(found, SHAKES, FRICTION, undecided=True)


def number_of(runs, i):
    return tuple(int(runs[f"run_{dim}"][i]) for dim in ("block", "model", "motion"))


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:the highest level")
def test_every_run_has_what_a_screen_of_it_alone_has(found, screened):
    """40 runs, each by an analysis at one level and a screen of its own: friction is the other of the two kinds."""
    for i in np.random.default_rng(1).choice(found.sizes["run"], 40, replace=False).tolist():
        block, model, motion = number_of(found, i)
        shake = SHAKES.sample(1, 0, motion)
        one = tp.ida(BLOCKS[block], LAWS[model], shake, [float(found["level"][i])], "pgv")
        own = screen(one, shake, FRICTION[BLOCKS[block].label], undecided=True)
        for runs, alone in ((found, one), (screened, own)):
            for name in OF_RUNS:
                assert runs[name].values[i] == alone[name].item(), name
        chance = float(own["slides"].item())
        assert float(screened["slides"][i]) == pytest.approx(chance, abs=1e-7)


def test_the_shares_are_those_of_the_runs_near_a_curve(screened):
    """Without the first wave, whose levels are far from the curve to find it; all runs tested count for stability."""
    for block in range(2):
        for model in range(2):
            own = (screened["run_block"].values == block) & (screened["run_model"].values == model)
            near = screened["verdict"].values[own & (screened["wave"].values > 0)]
            assert 0 < near.size < own.sum()
            expected = [np.mean(near & one.bit > 0) for one in REASONS] + [np.mean(near > 0)]
            expected[REASONS.index(UNDECIDED)] = float(screened["undecided"][block, model])
            assert screened["outside"][block, model].values == pytest.approx(expected, abs=1e-15)
    shares = screened["outside"]
    assert (shares.sel(block="squat", reason="squat") == 1.0).all()
    assert (shares.sel(model=LAWS[0].label, reason="elastic_mode") == 0.0).all()
    assert (shares.sel(model=LAWS[1].label, reason="elastic_mode") > 0.5).all()


@pytest.mark.slow
def test_outcomes_are_undecided_where_a_run_alone_has_them_so(found, screened):
    """All runs of one curve, motion by motion, against the perturbations of runs at common levels."""
    own = np.flatnonzero((found["run_block"].values == 0) & (found["run_model"].values == 0))
    flips = 0
    for motion in np.unique(found["run_motion"].values[own]).tolist():
        mine = own[found["run_motion"].values[own] == motion]
        shake = SHAKES.sample(1, 0, motion)
        levels = np.sort(found["level"].values[mine])
        one = tp.ida(BLOCKS[0], LAWS[0], shake, levels, "pgv", screen=False)
        counts = undecided_outcomes(one, shake).values[0, 0, :, 0]
        bit = screened["verdict"].values[mine[np.argsort(found["level"].values[mine])]] & UNDECIDED.bit > 0
        assert bit.tolist() == (counts > 0).tolist()
        flips += int((counts > 0).sum())
    assert flips > 0
    assert int(screened["undecided_tested"][0, 0]) == own.size
    assert float(screened["undecided"][0, 0]) == flips / own.size
    assert float(screened["undecided_lower"][0, 0]) < flips / own.size < float(screened["undecided_upper"][0, 0])


def test_results_have_the_screen_without_friction(found):
    again = screen(found, SHAKES)
    for name, one in again.data_vars.items():
        assert one.variable.identical(found[name].variable), name
    assert json.loads(again.attrs["screen"]) == json.loads(found.attrs["screen"])
    assert json.loads(found.attrs["screen"])["fewest_motions"] == int(found["motions_run"].min())
    of_screen = [name for name in again if name not in ("run_block", "run_model", "run_motion", "wave")]
    bare = found.isel(block=[0], model=[0]).drop_vars(of_screen)
    without = screen(bare)
    assert "friction_uplift_demand" not in without
    assert "band_low" not in without
    own = (found["run_block"].values == 0) & (found["run_model"].values == 0)
    np.testing.assert_array_equal(without["scale_factor"], found["scale_factor"][own])


@pytest.mark.slow
def test_motions_may_be_a_set(found, screened):
    motions = SHAKES.sample(found.sizes["motion"])
    again = screen(found, motions, FRICTION, undecided=True)
    for name, one in screened.data_vars.items():
        assert one.identical(again[name]), name


@pytest.mark.slow
def test_selections_are_screened_as_the_whole(found, screened):
    for block, model in ((0, 1), (1, 0)):
        own = (screened["run_block"].values == block) & (screened["run_model"].values == model)
        part = screen(found.isel(block=[block], model=[model]), SHAKES, FRICTION, undecided=True)
        assert part.sizes["run"] == own.sum()
        for name in (*OF_RUNS, "slides"):
            np.testing.assert_allclose(part[name], screened[name][own], atol=1e-7)
        assert (part["outside"].values == screened["outside"][block, model].values).all()
    some = found.isel(motion=[20, 3, 11])
    part = screen(some, SHAKES.sample(30), FRICTION, undecided=True)
    for i in range(part.sizes["run"]):
        (same,) = (
            k
            for k in np.flatnonzero(screened["run_motion"].values == int(part["run_motion"][i]))
            if number_of(screened, k) == number_of(part, i)
            and float(screened["scale_factor"][k]) == float(part["scale_factor"][i])
        )
        assert int(part["verdict"][i]) == int(screened["verdict"][same])
    assert (part["band_low"].values == screened["band_low"].values[[3, 11, 20]]).all()
    assert (part["motion"].values == found["motion"].values[[3, 11, 20]]).all()


def test_a_share_of_the_motions_is_evenly_spaced_with_reverses():
    motions = both_polarities(SHAKES.sample(30))
    kept = []
    for size in (4, 20, 60):
        shaken = Shaken(0.1)
        for first in range(0, 60, size):
            shaken.add(records(motions.isel(motion=slice(first, first + size))))
        kept.append(list(shaken.kept))
        assert shaken.characteristics.low.size == len(shaken.characteristics.rising) == 60
    assert kept[0] == kept[1] == kept[2] == [0, 1, 20, 21, 40, 41]
    none = Shaken(0.0)
    none.add(records(motions))
    assert not none.kept


@pytest.mark.slow
def test_motions_both_ways_and_levels_that_depend_on_the_block():
    """A block at a wall answers a motion and its reverse differently, and counts them as one."""
    held = tp.Block(0.4, 1.6, wall=tp.Wall(0.05))
    found = tp.adaptive_ida(held, tp.EnergyConsistent(), SHAKES, "pgv_normalised", until=COARSE, polarity="both")
    screened = screen(found, SHAKES, undecided=0.2)
    chosen = np.flatnonzero(screened["perturbed"].values)
    assert {one.removesuffix(", reversed") for one in found["motion"].values[chosen]} == {
        str(one) for one in found["motion"].values[chosen[::2]]
    }
    assert json.loads(screened.attrs["screen"])["fewest_motions"] == int(found["motions_run"][0, 0])
    assert int(screened["undecided_tested"][0, 0]) == np.isin(found["run_motion"].values, chosen).sum()
    i = int(np.argmax(found["run_motion"].values == 5))
    level = [float(found["level"][i])]
    one = tp.ida(held, tp.EnergyConsistent(), SHAKES.sample(1, 0, 2), level, "pgv_normalised", polarity="both")
    assert float(one["scale_factor"][0, 0, 1]) == float(screened["scale_factor"][i])
    assert int(one["verdict"][0, 0, 0, 1]) == int(found["verdict"][i])


@pytest.mark.slow
def test_pairs_are_tested_about_both_axes():
    (pairs,) = both_axes(SHAKES.sample_pairs(40, 3))  # (one of whose outcomes is undecided)
    found = tp.adaptive_ida(BLOCKS[0], LAWS[0], pairs, "RotD50(pgv)", until=COARSE)
    screened = screen(found, pairs, undecided=True)
    flips = 0
    for motion in range(found.sizes["motion"]):
        mine = np.flatnonzero(found["run_motion"].values == motion)
        order = mine[np.argsort(found["level"].values[mine])]
        pair = pairs.sel(motion=[found["motion"].values[motion]])
        one = tp.ida(BLOCKS[0], LAWS[0], pair, found["level"].values[order], "RotD50(pgv)")
        counts = undecided_outcomes(one, pair).values[0, 0, :, 0]
        assert (screened["verdict"].values[order] & UNDECIDED.bit > 0).tolist() == (counts > 0).tolist()
        assert (found["verdict"].values[order] == one["verdict"].values[0, 0, :, 0]).all()
        flips += int((counts > 0).sum())
    assert flips > 0
    assert "along the width" in found["pga"].attrs["long_name"]


@pytest.mark.slow
def test_floors_that_fall_faster_than_the_block_are_a_reason():
    one, two, up = SHAKES.sample(40), SHAKES.sample(40, 1), SHAKES.sample(40, 2)
    lifted = tp.motions.as_recorded(tp.motions.join(one, two, 0.7 * up.assign_attrs(one.attrs)), "h1", vertical=True)
    outputs = ["overturned", "airborne"]
    found = tp.adaptive_ida(BLOCKS[1], LAWS[0], lifted, "pga", COARSE, outputs)
    airborne = found["airborne"].values
    assert 0 < airborne.sum() < airborne.size
    np.testing.assert_array_equal(found["verdict"].values & AIRBORNE.bit > 0, airborne)
    assert json.loads(found.attrs["screen"])["vertical"]
    assert "motion.airborne" in {fact.what for fact in screen_facts(found)}


def test_notes_are_of_the_selection_and_leave_out_the_search(found, screened):
    uplift = screened["outside"].sel(reason=SLIDES_AT_UPLIFT.name)
    facts = screen_facts(screened)
    (said,) = (fact for fact in facts if fact.what == "sliding.share" and fact.more["when"] == "uplift")
    near = screened["wave"].values > 0
    need = float(screened["friction_uplift_demand"].values[near].max())
    assert said.value == pytest.approx(float(uplift.mean()), rel=1e-12)
    assert said.upper == need
    assert need < float(screened["friction_uplift_demand"].max())
    flipped, tested = int((screened["verdict"].values & UNDECIDED.bit > 0).sum()), screened.sizes["run"]
    assert int(screened["undecided_tested"].sum()) == tested
    (reversals,) = (fact for fact in facts if fact.what == "stability.undecided")
    assert (reversals.more["flipped"], reversals.more["tested"]) == (flipped, tested)
    for part in (found.isel(block=[0]), screened.isel(block=[0]), screen(found.isel(block=[0]), SHAKES)):
        assert "block.squat" not in {fact.what for fact in screen_facts(part)}
        assert not any("squat" in one or "()" in one for one in notes(part))


def test_a_curve_without_a_tested_run_has_no_share(found):
    """Some curves take more motions than others: of two motions the later one is tested, which not all ran."""
    run = found["motions_run"].values
    few, many = int(run.min()), int(run.max())
    assert few < many
    # (with numbers that fall the later motion is the first one)
    some = found.isel(motion=[many - 1, few - 1])
    falling = ("motion", -some["motion_number"].values)
    some = some.assign(run_motion=("run", -found["run_motion"].values)).assign_coords(motion_number=falling)
    part = screen(some, SHAKES.sample(many), undecided=0.3)
    tested = part["undecided_tested"].values
    assert (tested[run == few] == 0).all()
    assert (tested[run == many] > 0).all()
    np.testing.assert_array_equal(np.isnan(part["undecided"].values), tested == 0)
    assert [fact.more["tested"] for fact in screen_facts(part) if fact.what == "stability.undecided"] == [tested.sum()]


def test_blocks_and_laws_in_another_order_keep_their_shares(found):
    turned = {"block": [1, 0], "model": [1, 0]}
    whole, again = (screen(one, SHAKES, FRICTION) for one in (found, found.isel(turned)))
    xr.testing.assert_identical(again["outside"], whole["outside"].isel(turned))
    np.testing.assert_array_equal(again["verdict"], whole["verdict"])


@pytest.mark.slow
@pytest.mark.parametrize("order", [slice(None, None, -1), np.random.default_rng(3).permutation(64)])
def test_motions_in_any_order_are_made_again_in_theirs(found, screened, order):
    """More motions than are made at a time: what is of a motion stays with it."""
    whole = found.isel(motion=slice(64))
    assert found.sizes["motion"] >= 64
    again = screen(whole.isel(motion=order), SHAKES, FRICTION, undecided=True)
    expected = screen(whole, SHAKES.sample(64), FRICTION, undecided=True)
    for name, one in expected.data_vars.items():
        assert one.identical(again[name]), name


def test_reverses_alone_are_tested():
    found = tp.adaptive_ida(BLOCKS[0], LAWS[0], SHAKES, "pgv", until=COARSE, polarity="both")
    part = screen(found.isel(motion=slice(1, None, 2)), SHAKES, undecided=0.1)
    chosen = np.flatnonzero(part["perturbed"].values)
    assert chosen.tolist() == list(range(0, part.sizes["motion"], 10))


@pytest.mark.slow
@pytest.mark.parametrize("pairs", [False, True])
def test_progress_ends_where_it_said(pairs):
    from toppling.fragility.adaptive.until import until_of
    from toppling.fragility.analyses.adaptive import adaptive
    from toppling.fragility.analyses.waves import MotionSource
    from toppling.fragility.runs.request import check_request
    from toppling.fragility.validity.slab_screen import ScreenRequest

    told = []
    motions = both_axes(SHAKES.sample_pairs(64))[0] if pairs else SHAKES
    request = check_request(BLOCKS[0], LAWS[0], None, True, None, lambda done, total: told.append((done, total)), True)
    found = adaptive(
        request,
        MotionSource(motions, 0),
        "RotD50(pgv)" if pairs else "pgv",
        until_of(COARSE),
        runs_per_motion=3,
        seed=0,
        screening=ScreenRequest(undecided=0.5),
    )
    about = 2 if pairs else 1
    assert told[-1][0] == told[-1][1] == about * (found.sizes["run"] + 4 * int(found["undecided_tested"].sum()))
    assert [one for one, _ in told] == sorted(one for one, _ in told)
    (before,) = {total for done, total in told if done == about * found.sizes["run"]}
    assert before == pytest.approx(told[-1][1], rel=0.1)


def test_refused(refusal):
    refusal()
