"""Studies of blocks that may trip over obstacles: chances, rates, what is said, and refusals."""

import numpy as np
import pytest
from study_texts import YEAR

import toppling as tp
from toppling.fragility import overturning_probability, slide_runs
from toppling.models.friction import LognormalFriction
from toppling.models.sliding.trip import tripping_velocity
from toppling.studies import StudyError
from toppling.studies.tables.slides import slides

TEXT = """
title = "Cables"
[[blocks]]
name = "shelf"
width_m = 0.3
height_m = 1.8
[[blocks]]
name = "cabinet"
width_m = 0.4
height_m = 1.2
{own}
[[models]]
law = "housner"
[motions]
generator = "kanai-tajimi"
number = 12
duration_s = 12
dt_s = 0.01
[ida]
im = "pga"
levels = {{ values = [0.2, 0.5, 0.8, 1.5], unit = "g" }}
polarity = "as recorded"
[screen]
undecided = 0.0
[fit]
replicates = 100
{friction}
"""
FRICTION = "[friction]\nstatic = 0.15\ndispersion = 0.3\n{trip}"


def study(folder, own="trip_mm = 10", trip="trip_mm = 40\n", friction=FRICTION, more=YEAR, name="study"):
    text = TEXT.format(own=own, friction=friction.format(trip=trip)) + more
    (folder / f"{name}.toml").write_text(text)
    return tp.Study.from_toml(folder / f"{name}.toml")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("trips")


@pytest.fixture(scope="module")
def cables(folder):
    return study(folder)


@pytest.fixture(scope="module")
def results(cables):
    return cables.run()


@pytest.fixture(scope="module")
def slid(cables):
    runs = tp.ida(cables.blocks, cables.models, cables.design.motions, cables.design.levels)
    trip = {"shelf": 0.04, "cabinet": 0.01}
    return slide_runs(runs, cables.design.motions, LognormalFriction(0.15, 0.3), trip=trip)


@pytest.mark.filterwarnings("ignore::toppling.core.doubts.ImplausibleInput")
class TestResults:
    def test_chances_are_those_of_slide_runs(self, results, slid):
        found = overturning_probability(slid, state="trips")
        for ours, theirs in (("", "probability"), ("_lower", "lower"), ("_upper", "upper")):
            np.testing.assert_array_equal(results[f"trip_probability{ours}"], found[theirs][:, 0])
        assert 0.0 < float(found["probability"].max()) < 1.0
        assert results["trip_distance"].values.tolist() == [0.04, 0.01]

    def test_the_table_says_what_a_trip_is(self, results):
        assert "Trips over obstacles" in slides(results).note

    def test_flags_follow_from_velocities(self, slid, cables):
        for i, block in enumerate(cables.blocks):
            v = slid["trip_velocity"].values[i]
            np.testing.assert_array_equal(slid["trips"].values[i], v >= tripping_velocity(block))
            np.testing.assert_array_equal(np.isfinite(v), slid["slide_peak"].values[i] > (0.04, 0.01)[i])

    @pytest.mark.slow
    def test_nothing_else_changes(self, results, folder):
        plain = study(folder, own="", trip="", name="plain").run()
        assert "trip_probability" not in plain
        for name in ("probability", "rate", "slip_probability", "slip_rate", "gated_rate"):
            np.testing.assert_array_equal(results[name], plain[name])

    def test_both_ways_and_a_number(self, cables, slid):
        runs = tp.ida(cables.blocks, cables.models, cables.design.motions, cables.design.levels)
        both = slide_runs(runs, cables.design.motions, 0.1, trip=0.04, polarity="both")
        assert both.sizes["motion"] == 24
        once = slide_runs(runs, cables.design.motions, 0.1, trip=0.04)
        assert float(both["trips"].sum()) == 2.0 * float(once["trips"].sum()) > 0.0


def slid_with(trip):
    shakes = tp.motions.CloughPenzien(duration=3.0, dt=0.01).sample(2)
    return slide_runs(tp.ida(tp.Block(0.6, 1.0), tp.HousnerImpact(), shakes, [3.0]), shakes, 0.2, trip=trip)


def test_friction_that_is_missing_is_named_once(tmp_path):
    """However many blocks need it; own friction and distances each."""
    rough = 'friction = 0.4\n[[blocks]]\nname = "{}"\nwidth_m = 0.3\nheight_m = 1.2\n'
    own = rough.format("a") + rough.format("b") + "trip_mm = 10\nfriction = 0.3"
    sentences = [
        "blocks[2]: its own friction needs [friction] for the other blocks",
        "blocks[4].trip_mm needs [friction], without which no block slides",
    ]
    with pytest.raises(StudyError) as caught:
        study(tmp_path, own=own, friction="")
    assert str(caught.value).endswith(f"2 errors: (1) {sentences[0]}; (2) {sentences[1]}")
    with pytest.raises(StudyError) as caught:
        study(tmp_path, friction="")
    assert str(caught.value).endswith(": blocks[2].trip_mm needs [friction], without which no block slides")


def test_refused(refusal):
    refusal()
