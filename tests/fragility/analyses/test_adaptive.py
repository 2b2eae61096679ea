"""Adaptive levels end to end: every run against a run of its own, shared motions, equal bytes, refusals."""

import json
import math
import re
import warnings

import dask
import numpy as np
import pytest
import xarray as xr

import toppling as tp
from toppling.core.doubts import ImplausibleInput
from toppling.fragility import (
    HazardCurve,
    Slip,
)
from toppling.motions import both_axes
from toppling.motions.polarity import both_polarities

pytestmark = pytest.mark.lowest

SHAKES = tp.motions.CloughPenzien(duration=8.0, dt=0.01)
BLOCK = tp.Block(0.4, 1.6, name="narrow", depth=0.5)
WIDE = tp.Block(0.8, 2.4, name="wide", depth=0.9)
LAWS = [tp.HousnerImpact(), tp.EnergyConsistent()]
COARSE = {"median": 0.25, "motions": {"least": 32, "most": 400}}


def motion_of(found, i, motions=None):
    """The motion of run i."""
    number = int(found["run_motion"][i])
    return SHAKES.sample(1, 0, number) if motions is None else motions.isel(motion=[number])


@pytest.fixture(scope="module")
def found():
    return tp.adaptive_ida([BLOCK, WIDE], LAWS, SHAKES, "pgv", until=COARSE)


def test_layout(found):
    assert found.sizes["run"] == found["level"].size == found["overturned"].size
    assert found.attrs["design"] == "adaptive"
    assert json.loads(found.attrs["until"]) == COARSE
    assert found.attrs["stopped_because"] == "precision reached"
    motions = found["run_motion"].values
    counts = [
        np.unique(motions[(found["run_block"].values == b) & (found["run_model"].values == m)]).size
        for b in range(2)
        for m in range(2)
    ]
    assert counts == found["motions_run"].values.ravel().tolist()
    assert found["look_motions"].values[-1] == max(counts) == found.sizes["motion"]
    assert bool((found["half_width"] <= 0.25).all())
    widths = found["look_half_width"].values.reshape(4, -1)
    last = [row[np.isfinite(row)][-1] for row in widths]
    assert last == found["half_width"].values.ravel().tolist()
    assert [np.isfinite(row).sum() * 32 for row in widths] == counts


@pytest.mark.slow
def test_every_run_is_that_of_its_block_law_motion_and_level(found):
    """30 runs, each by an analysis of its own."""
    for i in np.random.default_rng(0).choice(found.sizes["run"], 30, replace=False):
        block = (BLOCK, WIDE)[int(found["run_block"][i])]
        law = LAWS[int(found["run_model"][i])]
        one = tp.ida(block, law, motion_of(found, i), [float(found["level"][i])], "pgv", screen=False)
        assert bool(one["overturned"].item()) == bool(found["overturned"][i])


@pytest.mark.slow
def test_medians_are_those_of_many_levels(found):
    """200 other motions at 60 levels: the medians agree within the two errors."""
    levels = np.geomspace(0.2, 3.0, 60)
    runs = tp.ida([BLOCK, WIDE], LAWS, SHAKES.sample(200, 7), levels, "pgv", ["overturned"], screen=False)
    p = runs["overturned"].mean("motion").values
    for b in range(2):
        for m in range(2):
            at = int(np.argmax(p[b, m] >= 0.5))
            share = (0.5 - p[b, m, at - 1]) / (p[b, m, at] - p[b, m, at - 1])
            grid = math.log(levels[at - 1]) + share * math.log(levels[at] / levels[at - 1])
            low, high = (math.log(float(found[f"half_level_{end}"][b, m])) for end in ("lower", "upper"))
            assert abs(math.log(float(found["half_level"][b, m])) - grid) < (high - low)


def test_a_curve_is_the_same_among_others_and_alone(found):
    alone = tp.adaptive_ida(WIDE, LAWS[1], SHAKES, "pgv", until=COARSE)
    own = (found["run_block"].values == 1) & (found["run_model"].values == 1)
    for name in ("level", "overturned", "run_motion", "wave"):
        assert np.array_equal(alone[name].values, found[name].values[own])
    for name in ("half_level", "dispersion", "half_width"):
        assert alone[name].item() == found[name][1, 1].item()


@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 3])
def test_bytes_do_not_depend_on_workers(found, workers):
    with dask.config.set(scheduler="threads", num_workers=workers):
        again = tp.adaptive_ida([BLOCK, WIDE], LAWS, SHAKES, "pgv", until=COARSE)
    xr.testing.assert_identical(again, found)
    other = tp.adaptive_ida(BLOCK, LAWS[0], SHAKES, "pgv", until=COARSE, seed=1)
    assert not np.array_equal(other["level"][:50], found["level"][:50])


def test_fits_take_the_runs_with_their_motions(found):
    """The curve through all runs is the one that the analysis followed."""
    fitted = tp.fit_fragility(found, replicates=200)
    assert fitted["median"].values == pytest.approx(found["median"].values, rel=1e-9)
    assert fitted["dispersion"].values == pytest.approx(found["dispersion"].values, rel=1e-9)
    assert "bootstrap over motions" in fitted.attrs["method"]
    assert fitted["alpha"].dims == ("block",)
    rates = tp.fragility.annual_rate(fitted, HazardCurve.power_law(1e-3, 2.0, "pgv"))
    assert bool((rates["rate"] > 0.0).all())


@pytest.mark.slow
def test_fits_of_selections_are_of_what_was_selected(found):
    whole = tp.fit_fragility(found, replicates=20)
    for b in (0, 1):
        for m in (0, 1):
            curve = whole["median"][b, m].item()
            assert tp.fit_fragility(found.isel(block=[b], model=[m]), replicates=20)["median"].item() == curve
            alone = tp.fit_fragility(found.isel(block=b, model=m), replicates=20)["median"]
            assert alone.dims == ()
            assert alone.item() == curve
    turned = tp.fit_fragility(found.isel(block=[1, 0], motion=slice(None, None, -1)), replicates=20)["median"]
    assert turned.values == pytest.approx(whole["median"].values[::-1], rel=1e-12)
    half = np.arange(0, found.sizes["motion"], 2)
    even = tp.fit_fragility(found.isel(motion=half), replicates=20)["median"]
    by_run = tp.fit_fragility(found.isel(run=found["run_motion"].values % 2 == 0), replicates=20)["median"]
    assert np.array_equal(even, by_run)
    assert not np.array_equal(even, whole["median"])
    with pytest.raises(ValueError, match="must hold some of block number 1 under law number 0, got none"):
        tp.fit_fragility(found.isel(run=found["run_block"].values == 0))
    with pytest.raises(ValueError, match="must keep their motion dimension"):
        tp.fit_fragility(found.isel(motion=0))


@pytest.mark.slow
def test_rates_are_those_of_the_hazard():
    hazard = HazardCurve.power_law(1e-1, 2.0, "pga")
    until = {"rate": 0.25, "motions": {"least": 32, "most": 600}}
    found = tp.adaptive_ida(BLOCK, LAWS[0], SHAKES, until={**until, "hazard": hazard})
    levels = np.geomspace(0.5, 40.0, 120)
    runs = tp.ida(BLOCK, LAWS[0], SHAKES.sample(200, 5), levels, outputs=["overturned"], screen=False)
    p = runs["overturned"].mean("motion").values.ravel()
    rates = hazard.rate_at(levels)
    expected = float((0.5 * (p[1:] + p[:-1])) @ (rates[:-1] - rates[1:]) + rates[-1] * p[-1])
    assert float(found["rate"].item()) == pytest.approx(expected, rel=0.3)
    known = np.isfinite(found["weight"].values)
    sums = np.bincount(found["run_motion"].values[known], (found["weight"] * found["overturned"]).values[known])
    used = np.unique(found["run_motion"].values[known])
    assert sums[used].mean() == pytest.approx(float(found["rate"].item()), rel=1e-12)
    assert float(found["rate_lower"].item()) < float(found["rate"].item()) < float(found["rate_upper"].item())


@pytest.mark.slow
def test_a_probability_keeps_within_0_and_1():
    for level in (1.15, 1.2, 1.25):
        until = {"probability": {"level": level, "within": 0.05}, "motions": {"least": 32}}
        found = tp.adaptive_ida(BLOCK, LAWS[1], SHAKES, "pga_normalised", until=until)
        assert 0.0 <= found["probability_lower"].item() <= found["probability_upper"].item() <= 1.0


def test_sets_are_taken_in_an_order_of_their_own_and_end():
    motions = SHAKES.sample(70, 3)
    found = tp.adaptive_ida(BLOCK, LAWS[0], motions, until={"median": 0.01, "motions": {"least": 64}})
    assert found.attrs["stopped_because"] == "no more motions"
    labels = found["motion"].values.tolist()
    assert sorted(labels) == sorted(motions["motion"].values.tolist()) != labels
    assert re.search("70 motions.*takes about", found["account"].item())


@pytest.mark.slow
def test_measures_of_blocks_and_plain_factors():
    """Levels are those of the measure: its value of the motion times the factor that the run had."""
    for im in ("pga_normalised", "scale"):
        found = tp.adaptive_ida(BLOCK, LAWS[0], SHAKES, im, until=COARSE)
        for i in (0, 77, found.sizes["run"] - 1):
            one = tp.ida(BLOCK, LAWS[0], motion_of(found, i), [float(found["level"][i])], im, screen=False)
            assert bool(one["overturned"].item()) == bool(found["overturned"][i])


def test_levels_of_the_ground_below_a_floor():
    ground = SHAKES.sample(64, 2)
    floor = (2.0 * ground).assign_attrs(ground.attrs)
    until = {"median": 0.3, "motions": {"least": 32}}
    above = tp.adaptive_ida(BLOCK, LAWS[0], floor, "pgv", until=until, ground=ground)
    below = tp.adaptive_ida(BLOCK, LAWS[0], ground, "pgv", until=until)
    assert float(above["half_level"].item()) == pytest.approx(0.5 * float(below["half_level"].item()), rel=1e-9)
    assert json.loads(above.attrs["configuration"])["im_at"] == "ground"
    assert "ground_pgv" in above.coords


@pytest.mark.slow
def test_both_polarities_are_one_motion():
    lean = tp.Block(0.4, 1.6, name="lean", wall=tp.Wall(0.05))
    found = tp.adaptive_ida(lean, LAWS[0], SHAKES, until=COARSE, polarity="both")
    assert found.sizes["motion"] == 2 * int(found["motions_run"].item())
    assert found["record"].values[0] == found["record"].values[1]
    fitted = tp.fit_fragility(found, replicates=50)
    assert float(fitted["median"].item()) == pytest.approx(float(found["median"].item()), rel=1e-9)
    given = tp.adaptive_ida(lean, LAWS[0], both_polarities(SHAKES.sample(64)), until=COARSE, polarity="both")
    assert int(given["motions_run"].item()) <= 64


@pytest.mark.slow
def test_pairs_fall_about_either_axis():
    (pairs,) = both_axes(SHAKES.sample_pairs(64))
    found = tp.adaptive_ida(BLOCK, LAWS[0], pairs, "RotD50(pgv)", until={"median": 0.4, "motions": {"least": 32}})
    assert np.unique(found["run_motion"]).size > 20
    for i in (3, 100, 180):
        motion = pairs.sel(motion=[found["motion"].values[int(found["run_motion"][i])]])
        one = tp.ida(BLOCK, LAWS[0], motion, [float(found["level"][i])], "RotD50(pgv)", screen=False)
        assert bool(one["overturned"].item()) == bool(found["overturned"][i])


class TestOtherStates:
    """Curves of slips and of rotations: levels are chosen by the state that is sought."""

    SLIDING = tp.Sliding(0.3)
    CASES = [(SLIDING, Slip(0.1), "slide_peak"), (LAWS[0], 0.5, "peak_rotation"), (LAWS[0], "uplifted", "uplifted")]

    @pytest.mark.slow
    @pytest.mark.parametrize(("law", "state", "output"), CASES, ids=["slip", "rotation", "uplift"])
    def test_medians_are_those_of_many_levels(self, law, state, output):
        """200 other motions at 60 levels: the medians agree within the two errors."""
        found = tp.adaptive_ida(WIDE, law, SHAKES, "pgv", until={**COARSE, "state": state})
        assert found.attrs["stopped_because"] == "precision reached"
        levels = np.geomspace(0.02, 5.0, 60)
        runs = tp.ida(WIDE, law, SHAKES.sample(200, 7), levels, "pgv", [output], screen=False)
        truth = float(tp.fit_fragility(runs, state=state)["median"].item())
        assert abs(math.log(found["half_level"].item() / truth)) < math.log1p(found["half_width"].item() + 0.1)
        for i in (5, 77, 150):
            one = tp.ida(WIDE, law, motion_of(found, i), [float(found["level"][i])], "pgv", [output], screen=False)
            assert float(one[output].item()) == pytest.approx(float(found[output][i]), rel=1e-9)
        curve = tp.fit_fragility(found, state=state, replicates=100)
        assert curve.attrs["state"] == found.attrs["state"]
        assert abs(math.log(curve["median"].item() / truth)) < math.log1p(found["half_width"].item() + 0.1)
        with pytest.raises(ValueError, match=r"levels were chosen for .*, and tell nothing sure of overturning: give"):
            tp.fit_fragility(found)

    @pytest.mark.slow
    def test_pairs_slide_in_the_plane(self):
        (pairs,) = both_axes(SHAKES.sample_pairs(64))
        until = {"median": 0.4, "motions": {"least": 32}}
        found = tp.adaptive_ida(WIDE, self.SLIDING, pairs, "RotD50(pgv)", until={**until, "state": Slip(0.05)})
        assert math.isfinite(found["half_level"].item())
        for i in (3, 100, 180):
            motion = pairs.sel(motion=[found["motion"].values[int(found["run_motion"][i])]])
            one = tp.ida(WIDE, self.SLIDING, motion, [float(found["level"][i])], "RotD50(pgv)")
            assert float(one["slide_peak"].item()) == pytest.approx(float(found["slide_peak"][i]), rel=1e-9)

    @pytest.mark.slow
    def test_other_laws_of_friction_have_curves_of_their_own(self):
        laws = [self.SLIDING, tp.Sliding(0.32)]
        found = tp.adaptive_ida(WIDE, laws, SHAKES, "pga", until={**COARSE, "state": Slip(0.02)})
        weak, strong = found["half_level"].values.ravel()
        alone = tp.adaptive_ida(WIDE, laws[1], SHAKES, "pga", until={**COARSE, "state": Slip(0.02)})
        assert alone["half_level"].item() == strong > weak

    def test_motions_that_end_in_a_slide_are_named(self):
        cut = SHAKES.sample(40).isel(time=slice(0, 300))
        with pytest.warns(ImplausibleInput, match="end while a block slides"):
            tp.adaptive_ida(
                WIDE, self.SLIDING, cut, until={"median": 0.4, "motions": {"least": 32}, "state": Slip(0.05)}
            )

    def test_blocks_that_would_rock_first_are_named(self):
        until = {"median": 0.4, "motions": {"least": 32}, "state": Slip(0.05)}
        for analysis, more in ((tp.ida, {"levels": [2.0]}), (tp.adaptive_ida, {"until": until})):
            shakes = SHAKES.sample(40)
            with pytest.warns(ImplausibleInput, match=r"1 of 2 blocks uplift before they slide, .*narrow"):
                analysis([BLOCK, WIDE], self.SLIDING, shakes, **more)
        with warnings.catch_warnings():
            warnings.filterwarnings("error", message=".*uplift before they slide")
            tp.ida(BLOCK, self.SLIDING, SHAKES.sample(2), [2.0], outputs=["slide_peak", "mode"])
            tp.ida(WIDE, self.SLIDING, SHAKES.sample(2), [2.0])


def test_refused(refusal):
    refusal()
