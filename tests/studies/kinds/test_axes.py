"""Studies of pairs of components: keys, refusals, runs, and what results and reports say of the axes."""

import json
import re

import numpy as np
import pytest
from check_facts import notes_named
from study_texts import YEAR, changed, motions, study_in

import toppling as tp
from toppling import fragility
from toppling.core.facts import Fact
from toppling.models.friction import Contact, LognormalFriction
from toppling.studies.store.worker_motions import motions_again
from toppling.studies.text.error import StudyError

STUDY = f"""
title = "Pairs"
{motions(6, 8, 0.02, 4)}component = "pair"
azimuth = "random"
[[blocks]]
name = "square"
width_m = 0.3
height_m = 1.4
depth_m = 0.3
[[blocks]]
name = "vase"
width_m = 0.12
height_m = 0.5
round = true
[[models]]
law = "housner"
[ida]
im = "RotD50(pga)"
levels = {{ values = [0.2, 0.4, 0.7], unit = "g" }}
[fit]
replicates = 100
"""
UNCERTAIN = '[uncertainty.inputs]\nR_factor = { distribution = "uniform", lower = 0.9, upper = 1.1 }\n[[models]]'
LAWS = [tp.HousnerImpact()]
GENERATOR = tp.motions.CloughPenzien(duration=8.0, dt=0.02)


def study(tmp_path, *changes, more=""):
    return study_in(tmp_path, changed(STUDY + more, *changes))


def test_workers_make_the_same_pairs(tmp_path):
    plan = study(tmp_path)
    made = motions_again(json.dumps(plan.configuration))
    own = tp.motions.records(list(plan.arrays))
    assert [one.axes for one in made] == [one.axes for one in own]
    for one, other in zip(made, own, strict=True):
        np.testing.assert_array_equal(one.acceleration, other.acceleration)
        np.testing.assert_array_equal(one.companion, other.companion)


def test_the_weak_axis_alone(tmp_path):
    long = (
        (
            'name = "vase"\nwidth_m = 0.12\nheight_m = 0.5\nround = true',
            'name = "long"\nwidth_m = 0.3\nheight_m = 1.4\ndepth_m = 0.6',
        ),
    )
    weak = ('component = "pair"', 'component = "pair"\naxes = "weak"')
    with pytest.raises(StudyError, match=r"'square' must have a depth of at least 1\.6 times its width"):
        study(tmp_path, weak)
    plan = study(tmp_path, weak, *long, ("depth_m = 0.3\n", "depth_m = 0.5\n"))
    found = plan.run()
    assert "axis" not in found
    assert plan.work == plan.runs + plan.perturbed_runs


def test_an_azimuth_in_degrees(tmp_path):
    plan = study(tmp_path, ('azimuth = "random"', "azimuth = 90"))
    (array,) = plan.design.arrays
    np.testing.assert_array_equal(array.sel(component="h1"), GENERATOR.sample_pairs(6, 4).sel(component="h2"))


def test_blocks_of_a_file_have_depths(tmp_path):
    (tmp_path / "blocks.csv").write_text(
        "name,catalogue,width_m,height_m,depth_m,round\na,,0.3,1.4,0.4,\nb,server-rack-42u,,,,\nc,,0.1,0.4,,yes\n"
    )
    text = STUDY[: STUDY.index("[[blocks]]")] + STUDY[STUDY.index("[[models]]") :]
    blocks = study_in(tmp_path, 'blocks_file = "blocks.csv"\n' + text).blocks
    assert [one.depth for one in blocks] == [0.4, 1.07, 0.1]
    assert [one.round for one in blocks] == [False, False, True]


@pytest.mark.slow
def test_uncertain_blocks(tmp_path):
    """Samples keep their plan ratio; every figure is of the runs about both axes."""
    changes = ([("[[models]]", UNCERTAIN)], [("replicates = 100", 'replicates = 100\nform = "lognormal"')])
    plan = study(tmp_path, *(one for each in changes for one in each))
    done = []
    found = plan.run(progress=lambda so_far, total: done.append((so_far, total)))
    assert done[-1] == (plan.work, plan.work)
    assert plan.work == 2 * plan.runs + plan.perturbed_runs
    shaken = tp.motions.both_axes(GENERATOR.sample_pairs(6, 4), "random", 4)
    levels = np.array([0.2, 0.4, 0.7]) * 9.80665
    for block in plan.blocks:
        options = {"samples": plan.inputs.sample(plan.samples, plan.seed)}
        runs = tp.fragility.uncertain_ida(plan.inputs, block, LAWS, shaken, levels, "RotD50(pga)", **options)
        np.testing.assert_array_equal(found["overturned"].sel(block=block.label).values, runs["overturned"].values)
    assert notes_named(found, "axis.screen_of_width") == [Fact("axis.screen_of_width")]


BUILDINGS = """
[[buildings]]
name = "shed"
kind = "ground"
[[buildings]]
name = "tower"
kind = "flexural-shear"
period_s = 0.5
storeys = 3
floors = [3]
"""


@pytest.mark.slow
def test_floors_of_buildings(tmp_path):
    """Each component goes through the building by itself; the ground stays as it is, and its measure the level."""
    plan = study(tmp_path, ('im = "RotD50(pga)"', 'im = "RotD50(pga)"\nim_at = "ground"'), more=BUILDINGS)
    assert re.search("12 motions.*both axes", plan.words)
    found = plan.run()
    ground = tp.motions.both_axes(GENERATOR.sample_pairs(6, 4), "random", 4)
    tower = tp.motions.Building.flexural_shear(0.5, storeys=3)
    levels = np.array([0.2, 0.4, 0.7]) * 9.80665
    square = tp.Block(0.3, 1.4, name="square", depth=0.3)
    angles = np.radians(np.arange(180.0))
    peaks = [
        np.abs(np.outer(np.cos(angles), one.acceleration) + np.outer(np.sin(angles), one.companion)).max(axis=1)
        for one in tp.motions.records(ground)
    ]
    scale = levels[:, None] / np.median(peaks, axis=1)
    fallen = found["overturned"].sel(block="square").values[0]
    for k, record in enumerate(tp.motions.records(ground)):
        components = record.acceleration, record.companion
        floors = [
            tower.floor_motions(tp.motions.from_array(one, dt=record.dt), [3]).isel(floor=0, drop=True)
            for one in components
        ]
        for at, shaken in ((k, [tp.motions.from_array(one, dt=record.dt) for one in components]), (6 + k, floors)):
            for level in range(3):
                each = [tp.simulate(square, tp.HousnerImpact(), scale[level, k] * one) for one in shaken]
                assert fallen[level, at] == any(bool(one.overturned) for one in each)
    assert 0 < fallen[:, :6].sum() < fallen[:, 6:].sum()


HELD = """
[[blocks]]
name = "shelf"
width_m = 0.3
height_m = 1.4
depth_m = 0.35
mass_kg = 60
wall_gap_mm = 10
restraint = "strap"
[restraints.strap]
kind = "strap"
height_m = 1.2
strength_n = 60
stiffness_n_per_mm = 20
"""


@pytest.mark.slow
@pytest.mark.parametrize("uncertain", [False, True])
def test_a_block_at_a_wall_stands_free_along_its_depth(tmp_path, uncertain):
    changes = [('law = "housner"', 'law = "housner"\ngeometry = "linear"')]
    changes += [("[[models]]", UNCERTAIN)] if uncertain else []
    found = study(tmp_path, *changes, more=HELD).run().sel(block="shelf")
    if uncertain:
        assert 0.0 < found["overturned"].mean() < 1.0
        assert [fact.names for fact in notes_named(found, "axis.held_free")] == [("shelf",)]
        return
    assert found["ruptured"].any()
    assert (found["axis"] == 2).any()
    shaken = tp.motions.both_axes(GENERATOR.sample_pairs(6, 4), "random", 4)
    law, levels = tp.HousnerImpact(geometry="linear"), np.array([0.2, 0.4, 0.7]) * 9.80665
    pairs = [[one.acceleration, one.companion] for one in tp.motions.records(shaken)]
    strap = tp.Restraint.strap(1.2, 60.0, 20e3)
    held = tp.Block(0.3, 1.4, mass=60.0, wall=tp.Wall(0.01), restraint=strap)
    ways = found["motion"].size // 6
    for k, pair in enumerate(pairs):
        for way in range(ways):
            factors = levels / float(found["RotD50(pga)"][ways * k]) * (-1.0 if way else 1.0)
            for level, factor in enumerate(factors.tolist()):
                x, y = (
                    tp.simulate(one, law, tp.motions.from_array(factor * shake, dt=0.02))
                    for one, shake in zip((held, tp.Block(0.35, 1.4)), pair, strict=True)
                )
                at = {"level": level, "motion": ways * k + way}
                assert bool(found["overturned"][0].isel(at)) == (bool(x.overturned) or bool(y.overturned))
                assert bool(found["ruptured"][0].isel(at)) == bool(x.ruptured)
    assert [fact.names for fact in notes_named(found, "axis.held_free")] == [("shelf",)]


FRICTION = """
[friction]
static = 0.25
dispersion = 0.3
kinetic_ratio = 0.9
"""


@pytest.mark.slow
def test_blocks_that_slide(tmp_path):
    """Chances of slips and of falls over edges are those of `slide_runs`, and a wider band is near uplift."""
    edge = ("depth_m = 0.3\n", 'depth_m = 0.4\nedge_distance_mm = 30\nfalls_when = "foot"\n')
    found = study(tmp_path, edge, more=FRICTION + YEAR).run()
    shaken = tp.motions.both_axes(GENERATOR.sample_pairs(6, 4), "random", 4)
    levels = np.array([0.2, 0.4, 0.7]) * 9.80665
    block = tp.Block(0.3, 1.4, name="square", depth=0.4, edge=tp.Edge(0.03, falls_when="foot"))
    runs = tp.ida(block, tp.HousnerImpact(), shaken, levels, "RotD50(pga)")
    friction = LognormalFriction(0.25, 0.3)
    slid = fragility.slide_runs(runs, shaken, Contact(friction, 0.9), polarity="both")
    for k, distance in enumerate((0.05, 0.1, 0.3)):
        expected = (slid["slide_peak"] > distance).mean("motion").values[0, 0]
        np.testing.assert_allclose(found["slip_probability"].sel(block="square").values[k], expected, rtol=1e-12)
    expected = slid["fallen_off"].mean("motion").values[0, 0]
    np.testing.assert_allclose(found["fall_off_probability"].sel(block="square").values, expected, rtol=1e-12)
    assert 0.0 < expected.max() < 1.0
    below = friction.below(np.array([0.3, 0.39, 0.4, 0.52]) / 1.4)
    assert float(found["slides_instead"][0]) == pytest.approx(below[0], rel=1e-12)
    assert float(found["friction_near_uplift"][0]) == pytest.approx(below[3] - below[0] - below[2] + below[1], rel=1e-9)
    gated = found["probability"].sel(block="square") * (1.0 - below[0])
    np.testing.assert_allclose(found["gated_probability"].sel(block="square"), gated, rtol=1e-12)
    assert len(notes_named(found, "sliding.in_plane")) == 1
    (near,) = notes_named(found, "sliding.friction_near_uplift")
    assert near.more["plane"]
    assert near.value == float(found["friction_near_uplift"].max())


def test_one_component_against_a_hazard_of_both(tmp_path):
    """A note says what levels of one component leave out; levels of RotD50 do not need it."""
    from toppling.studies.text.axes import component_notes

    assert component_notes("h1", "RotD50(pga)") == []
    assert component_notes(None, "pga") == []
    assert component_notes("h1", "pga") == [Fact("motion.one_component", names=("PGA",))]
    assert component_notes("h1", "Sa(0.5)") == [Fact("motion.one_component", names=("Sa(0.5 s)",))]
