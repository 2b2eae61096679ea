"""Random friction at adaptive levels: draws, runs of each coefficient, and curves held to `slide_runs`."""

import numpy as np
import pytest

import toppling as tp
from toppling.fragility import Slip, slide_runs
from toppling.fragility.analyses.friction_draws import draws
from toppling.models import RandomSliding
from toppling.models.friction import Contact, LognormalFriction
from toppling.models.outputs import SLIDES
from toppling.motions import both_axes

BLOCK = tp.Block(0.6, 1.8)
FRICTION = LognormalFriction(0.35, 0.3)
LAW = RandomSliding(FRICTION, 0.85)
SHAKES = tp.motions.CloughPenzien(duration=10.0, dt=0.02)
OUTPUTS = (*SLIDES,)
pytestmark = pytest.mark.filterwarnings("ignore::toppling.core.doubts.ImplausibleInput")


def adaptive(**options):
    given = {"until": {"median": 0.1}, "seed": 3} | options
    given["until"] = {"state": Slip(0.05), **given["until"]}
    return tp.adaptive_ida(given.pop("blocks", BLOCK), given.pop("law", LAW), SHAKES, **given)


def test_coefficients_are_draws_of_those_below_uplift():
    """At any place among a motion's runs they follow the distribution below b/h."""
    found = draws(LAW, BLOCK, 5, np.arange(4000), 3)
    assert found.shape == (3, 4000)
    level = BLOCK.b / BLOCK.h
    assert found.max() < level
    share = FRICTION.below(found) / FRICTION.below(level)
    for own in share:
        np.testing.assert_allclose(np.quantile(own, [0.1, 0.5, 0.9]), [0.1, 0.5, 0.9], atol=0.03)
    # (equally spaced within a motion)
    np.testing.assert_allclose(np.diff(np.sort(share, axis=0), axis=0)[0], 1 / 3, atol=1e-9)
    np.testing.assert_array_equal(draws(LAW, BLOCK, 5, np.array([7, 2]), 3), found[:, [7, 2]])


@pytest.mark.slow
def test_a_run_is_that_of_its_coefficient():
    found = adaptive(outputs=OUTPUTS)
    for k in range(0, found.sizes["run"], 41):
        mu, level = float(found["friction"][k]), float(found["level"][k])
        one = SHAKES.sample(1, 3, int(found["run_motion"][k]))
        own = tp.ida(BLOCK, tp.Sliding(mu, 0.85 * mu), one, [level], outputs=OUTPUTS)
        for name in OUTPUTS:
            np.testing.assert_allclose(found[name][k], own[name].squeeze(), rtol=1e-9, atol=1e-12)


@pytest.mark.slow
def test_a_run_in_the_plane_is_that_of_its_coefficient():
    (pairs,) = both_axes(SHAKES.sample_pairs(80))
    found = tp.adaptive_ida(BLOCK, LAW, pairs, "RotD50(pga)", until={"median": 0.3, "state": Slip(0.05)})
    for k in range(0, found.sizes["run"], 83):
        mu, level = float(found["friction"][k]), float(found["level"][k])
        label = str(found["motion"].values[int(found["run_motion"][k])])
        one = pairs.isel(motion=[pairs["motion"].values.tolist().index(label)])
        own = tp.ida(BLOCK, tp.Sliding(mu, 0.85 * mu), one, [level], "RotD50(pga)")
        np.testing.assert_allclose(found["slide_peak"][k], own["slide_peak"].squeeze(), rtol=1e-6, atol=1e-9)


@pytest.mark.slow
def test_the_curve_is_that_of_many_coefficients():
    """Runs of other motions with 100 coefficients each have their half between the ends of the interval."""
    found = adaptive(until={"median": 0.05})
    levels = np.linspace(2.5, 8.0, 12)
    others = SHAKES.sample(300, 99)
    runs = tp.ida(BLOCK, tp.HousnerImpact(), others, levels, screen=False)
    slid = slide_runs(runs, others, Contact(FRICTION, 0.85))
    slides = slid["friction"].values[0] < BLOCK.b / BLOCK.h
    share = (slid["slide_peak"].values[0, 0][:, slides] > 0.05).mean(axis=1)
    # (300 motions know the half to some 2 %)
    assert np.interp(0.5, share, levels) == pytest.approx(float(found["half_level"].squeeze()), rel=0.05)
    assert slides.mean() == pytest.approx(LAW.chance(BLOCK), abs=0.01)


@pytest.mark.slow
def test_results_do_not_depend_on_other_blocks_or_threads():
    import dask

    both = adaptive(blocks=[tp.Block(0.5, 1.0), BLOCK])
    with dask.config.set(scheduler="synchronous"):
        alone = adaptive()
    mine = both["run_block"].values == 1
    np.testing.assert_array_equal(both["level"][mine], alone["level"])
    np.testing.assert_array_equal(both["slide_peak"][mine], alone["slide_peak"])


@pytest.mark.slow
def test_known_and_random_friction_side_by_side():
    found = adaptive(law=[tp.Sliding(0.3), LAW])
    known = found["run_model"].values == 0
    assert (found["friction"].values[known] == 0.3).all()
    own = adaptive(law=tp.Sliding(0.3))
    np.testing.assert_array_equal(found["slide_peak"][known], own["slide_peak"])


def test_vertical_shaking_and_held_blocks_are_refused():
    one, two, up = (SHAKES.sample(80, seed=seed) for seed in (1, 2, 3))
    lifted = tp.motions.as_recorded(tp.motions.join(one, two, 0.3 * up.assign_attrs(one.attrs)), "h1", vertical=True)
    with pytest.raises(
        ValueError, match="random friction at adaptive levels needs motions without a vertical component"
    ):
        tp.adaptive_ida(BLOCK, LAW, lifted, until={"state": Slip(0.05)})


def test_refused(refusal):
    refusal()
