"""Vertical shaking in analyses: flags, labels, refusals, and what counts where the floor leaves the block."""

import json

import numpy as np
import pytest
import xarray as xr

import toppling as tp
from toppling import motions
from toppling.core.facts import Fact
from toppling.core.units import STANDARD_GRAVITY as G
from toppling.fragility import screen
from toppling.fragility.fitting.states import reached
from toppling.fragility.validity.notes import screen_facts, sentences_of
from toppling.models.outputs import OF_ENGINE
from toppling.models.runs import run_many, trace

BLOCK = tp.Block(0.4, 1.6, name="shelf")
LAW = tp.HousnerImpact()
FACTORS = [0.5, 1.0, 4.0]


def triple(n=6, vertical=0.5):
    """Joined components of simulated motions; the vertical one has a greatest downward acceleration of its own."""
    one, two, up = (motions.CloughPenzien(duration=8.0, dt=0.01).sample(n, seed=seed) for seed in (1, 2, 3))
    up = up * (vertical * G / np.abs(up).max("time"))
    return motions.join(one * 2.0, two * 2.0, up.assign_attrs(one.attrs))


def run(*arguments, **options):
    """`toppling.ida` of one block at plain scale factors, with most outputs."""
    outputs = ["overturned", "peak_rotation", "uplifted", "impacts", "direction", "final_state", "airborne"]
    return tp.ida(BLOCK, LAW, *arguments, FACTORS, im="scale", outputs=outputs, **options)


@pytest.fixture(scope="module")
def pair():
    return triple()


@pytest.fixture(scope="module")
def lifted(pair):
    return run(motions.as_recorded(pair, "h1", vertical=True))


def test_runs_are_the_engines(pair, lifted):
    """Each run of an analysis against the engine on plain arrays."""
    oscillator = LAW.oscillator(BLOCK)
    for i in range(pair.sizes["motion"]):
        h1, up = (pair.sel(component=name).values[i] for name in ("h1", "v"))
        plain = run_many([oscillator], np.array([FACTORS]), h1, 0.01, vertical=up)[0]
        found = lifted.isel(block=0, model=0, motion=i)
        np.testing.assert_array_equal(found["airborne"], plain[:, OF_ENGINE["airborne"]] == 1.0)
        here = ~found["airborne"].values
        for name in ("overturned", "peak_rotation", "uplifted", "impacts"):
            np.testing.assert_array_equal(found[name].values[here], plain[here, OF_ENGINE[name]])


def test_it_matters(pair, lifted):
    without = run(motions.as_recorded(pair, "h1"))
    assert not bool(without["airborne"].any())
    assert "downward_acceleration" not in without.coords
    assert not without["peak_rotation"].equals(lifted["peak_rotation"])


def test_runs_in_which_the_floor_falls_away(lifted):
    """Known before they are run: at four times a motion that falls with more than g/4."""
    down = lifted["downward_acceleration"]
    expected = (down * xr.DataArray(FACTORS, dims="level") >= G).transpose("level", "motion")
    airborne = lifted["airborne"].isel(block=0, model=0)
    np.testing.assert_array_equal(airborne, expected)
    assert bool(airborne.any())
    assert not bool(airborne.all())
    here = lifted["airborne"].values
    assert lifted["overturned"].values[here].all()
    assert lifted["uplifted"].values[here].all()
    assert np.isnan(lifted["peak_rotation"].values[here]).all()
    assert np.isfinite(lifted["peak_rotation"].values[~here]).all()
    assert (lifted["impacts"].values[here] == -1).all()
    assert ((lifted["verdict"].values & 128 > 0) == here).all()
    for state in ("overturned", "uplifted", "front", "back", 0.5):
        assert reached(lifted, state).values[here].all()
    share = lifted["outside"].sel(reason="airborne").item()
    assert share == pytest.approx(here.mean())


def test_the_notes_say_so(pair, lifted):
    shaking = motions.as_recorded(pair, "h1", vertical=True)
    facts = screen_facts(screen(lifted, shaking))
    found = {fact.what: fact for fact in facts}
    assert found["motion.airborne"].value == pytest.approx(lifted["airborne"].values.mean())
    assert "count as overturned" in sentences_of([found["motion.airborne"]])[0]
    assert "motion.vertical" in found
    assert facts[-1] == Fact("validity.not_modelled", more={"vertical": True, "slides": False})
    without = motions.as_recorded(pair, "h1")
    facts = screen_facts(screen(run(without), without))
    assert not {"motion.airborne", "motion.vertical"} & {fact.what for fact in facts}
    assert facts[-1] == Fact("validity.not_modelled", more={"vertical": False, "slides": False})


def test_flags_alone_are_the_same(pair, lifted):
    shaking = motions.as_recorded(pair, "h1", vertical=True)
    for options in ({}, {"skip": False}):
        flags = tp.ida(BLOCK, LAW, shaking, FACTORS, im="scale", outputs=["overturned"], **options)
        np.testing.assert_array_equal(flags["overturned"], lifted["overturned"])
        np.testing.assert_array_equal(flags["verdict"], lifted["verdict"])


def test_stripes_and_clouds(pair):
    shaking = motions.as_recorded(pair, "h1", vertical=True)
    outputs = ["overturned", "airborne"]
    cloud = tp.cloud(BLOCK, LAW, shaking, outputs=outputs)
    np.testing.assert_array_equal(cloud["airborne"].values.ravel(), cloud["downward_acceleration"].values >= G)
    stripes = tp.stripes(BLOCK, LAW, [shaking, shaking], [1.0, 20.0], outputs=outputs)
    assert stripes["airborne"].values.any()


def test_both_ways(pair):
    """A reverse turns the block round, and not upside down."""
    both = run(motions.as_recorded(pair, "h1", vertical=True), polarity="both")
    one, other = (both.isel(motion=slice(k, None, 2)) for k in (0, 1))
    np.testing.assert_array_equal(one["downward_acceleration"], other["downward_acceleration"])
    np.testing.assert_array_equal(one["peak_rotation"], other["peak_rotation"])


def test_a_measure_is_of_the_horizontal_component(pair):
    levels = [1.0, 2.0]
    with_vertical, without = (
        tp.ida(BLOCK, LAW, motions.as_recorded(pair, "h1", vertical=lifts), levels, im="pga") for lifts in (True, False)
    )
    np.testing.assert_array_equal(with_vertical["pga"], without["pga"])


@pytest.mark.parametrize("law", [tp.DiscreteDamping(), tp.HousnerImpact(geometry="linear"), tp.Vassiliou()])
def test_other_laws_refuse_it(pair, law):
    shaking = motions.as_recorded(pair, "h1", vertical=True)
    with pytest.raises(ValueError, match=r"vertical shaking needs exact geometry.*take HousnerImpact\(\)"):
        tp.ida(BLOCK, [LAW, law], shaking, FACTORS, im="scale")
    with pytest.raises(ValueError, match=r"vertical shaking needs exact geometry.*take HousnerImpact\(\)"):
        tp.simulate(BLOCK, law, shaking.isel(motion=[0]))


class TestHistories:
    """`simulate` with joined components."""

    def test_the_run(self, pair):
        one = pair.isel(motion=[0])
        history = tp.simulate(BLOCK, LAW, motions.as_recorded(one, "h2", vertical=True))
        h2, up = (one.sel(component=name).values[0] for name in ("h2", "v"))
        found = trace(LAW.oscillator(BLOCK), h2, 0.01, vertical=up)
        np.testing.assert_array_equal(history["rotation"], found.history[0])
        np.testing.assert_array_equal(history["vertical_acceleration"], up)
        np.testing.assert_array_equal(history["floor_acceleration"], h2)
        plain = tp.simulate(BLOCK, LAW, one.sel(component="h2", drop=True))
        xr.testing.assert_identical(plain, tp.simulate(BLOCK, LAW, motions.as_recorded(one, "h2")))

    def test_moments_and_acceleration(self, pair):
        """The equation of motion, sample by sample, while the block rocks."""
        one = motions.as_recorded(pair.isel(motion=[1]), "h1", vertical=True)
        history = tp.simulate(BLOCK, LAW, one)
        theta, across, up = (
            history[name].values for name in ("rotation", "floor_acceleration", "vertical_acceleration")
        )
        lean = np.sign(theta) * BLOCK.alpha - theta
        expected = -(BLOCK.p**2) / G * ((G + up) * np.sin(lean) + across * np.cos(lean))
        rocks = theta != 0.0
        assert rocks.sum() > 50
        np.testing.assert_allclose(
            history["angular_acceleration"].values[rocks], expected[rocks], rtol=1e-12, atol=1e-12
        )
        weight = BLOCK.p**2 * (1.0 + up / G) * np.sin(lean)
        np.testing.assert_allclose(history["restoring_moment"].values[rocks], weight[rocks], rtol=1e-12)

    def test_a_floor_that_falls_away(self):
        """The time and the value, in one sentence."""
        shaking = motions.as_recorded(triple(1, 1.2), "h1", vertical=True)
        up = shaking.sel(component="v").values[0]
        if up.min() > -G:
            shaking = shaking * -1.0
            up = -up
        first = int(np.flatnonzero(up <= -G)[0])
        sentence = rf"must not fall faster than g.* {up[first]:.4g} m/s² at {first * 0.01:.4g} s"
        with pytest.raises(ValueError, match=sentence):
            tp.simulate(BLOCK, LAW, shaking.assign_attrs(units="m s-2"))


def test_the_configuration_tells_the_motions_apart(pair, lifted):
    """A screen of the runs records that vertical components shook."""
    assert json.loads(lifted.attrs["screen"])["vertical"] is True
