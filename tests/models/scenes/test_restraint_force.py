"""The largest force of a restraint: against the independent integration, by hand, and as an output of analyses."""

import math

import numpy as np
import pytest
from scene_draws import case_of, scene_of
from scene_reference import integrate_segments, record_segments

import toppling as tp
from toppling.core.units import STANDARD_GRAVITY as G

shake = tp.motions.from_array
FORCE = "restraint_force"
LAW = tp.HousnerImpact(geometry="bilinear")


def scenes(most, first=0):
    """Random scenes that have a restraint."""
    found = []
    for j in range(first, 100_000):
        scene, record, dt = scene_of([7, j])
        if scene.restraint is not None:
            found.append((scene, record, dt))
        if len(found) == most:
            return found
    raise AssertionError


def force_of(case):
    runs = tp.ida(case.block, case.law, shake(case.record, case.dt), [1.0], "scale", [FORCE], screen=False)
    return runs[FORCE].item()


@pytest.mark.slow
def test_against_the_independent_integration():
    """Of straps, brackets and adhesives with walls, offsets and leans; most of them hold in some runs."""
    held = broken = rigid = 0
    for scene, record, dt in scenes(120):
        case = case_of(scene, record, dt)
        truth, other = (
            integrate_segments(scene, record_segments(record * (1.0 + change), dt), tolerance, log=100_000)
            for change, tolerance in ((0.0, 1e-12), (1e-13, 1e-13))
        )
        if truth.ruptured != other.ruptured:
            continue
        stiff = 0.0 if math.isinf(scene.restraint.stiffness) else scene.restraint.stiffness * scene.restraint.arm
        apart = abs(truth.restraint_force - other.restraint_force)
        allowed = max(1e-9 * stiff, 1e-9 * (1.0 + truth.restraint_force), 100.0 * apart)
        force = force_of(case)
        if truth.ruptured and stiff == 0.0 and not scene.restraint.both_sides:
            assert math.isnan(force)  # (it may have come off as the block left to the other side)
            continue
        assert abs(force - truth.restraint_force) <= allowed, (scene, truth.restraint_force)
        held += not truth.ruptured and truth.restraint_force > 0.0
        broken += truth.ruptured
        rigid += stiff == 0.0
    assert min(held, broken, rigid) >= 10


class TestByHand:
    BLOCK = {"width": 0.3, "height": 1.8, "mass": 80.0}

    def test_an_adhesive_takes_what_gravity_does_not(self):
        """m (h F - g b)/d, of each of two pads half; the strength once it peels."""
        ramp = shake(-np.arange(0.0, 4.001, 0.01), 0.01)
        for count in (1, 2):
            pads = tp.Restraint("adhesive", 1000.0, math.inf, 0.25, 0.25, count=count)
            run = tp.simulate(tp.Block(**self.BLOCK, restraint=pads), LAW, ramp)
            assert run[FORCE].item() == pytest.approx(80.0 * (4.0 * 0.9 - G * 0.15) / 0.25 / count, rel=1e-12)
        weak = tp.Restraint("adhesive", 100.0, math.inf, 0.25, 0.25)
        run = tp.simulate(tp.Block(**self.BLOCK, restraint=weak), LAW, ramp)
        assert run["ruptured"]
        assert run[FORCE].item() == 100.0
        assert run[FORCE].attrs["units"] == "N"

    def test_an_unbreakable_one_with_an_offset_to_either_side(self):
        block = tp.Block(
            **self.BLOCK, cm_offset=0.05, restraint=tp.Restraint("adhesive", math.inf, math.inf, 0.25, 0.2)
        )
        for sign, half, arm in ((-1.0, 0.10, 0.25), (1.0, 0.20, 0.2)):
            run = tp.simulate(block, LAW, shake(sign * np.arange(0.0, 4.001, 0.01), 0.01))
            assert run[FORCE].item() == pytest.approx(80.0 * (4.0 * 0.9 - G * half) / arm, rel=1e-12)

    def test_the_wall_behind_takes_the_push(self):
        block = tp.Block(**self.BLOCK, wall=tp.Wall(), restraint=tp.Restraint("bracket", math.inf, math.inf, 1.5, 1.5))
        run = tp.simulate(block, LAW, shake(np.arange(0.0, 4.001, 0.01), 0.01))
        assert run[FORCE].item() == 0.0

    def test_a_strap_follows_the_front(self):
        strap = tp.Restraint.strap(1.5, strength=1e9, slack=0.001)
        motion = 3.0 * tp.motions.CloughPenzien(duration=10.0, dt=0.01).sample(1)
        motion.attrs["units"] = "m s-2"
        run = tp.simulate(tp.Block(**self.BLOCK, restraint=strap), LAW, motion)
        assert run[FORCE].item() == pytest.approx(20e3 * (1.5 * run["peak_front"].item() - 0.001), rel=1e-12)
        assert run[FORCE].item() > 0.0

    def test_a_free_block_has_none(self):
        motion = shake(-np.arange(0.0, 4.001, 0.01), 0.01)
        assert FORCE not in tp.simulate(tp.Block(0.3, 1.8), LAW, motion)
        assert math.isnan(tp.ida(tp.Block(0.3, 1.8), LAW, motion, [1.0], outputs=[FORCE])[FORCE].item())


def test_analyses_give_it_for_samples_alike():
    motions = tp.motions.CloughPenzien(duration=10.0, dt=0.01).sample(5)
    strap = tp.Restraint.strap(1.7, 200.0, slack=0.002)
    pads = tp.Restraint.adhesive(150.0, 0.25)
    blocks = [
        tp.Block(0.3, 1.8, name="free"),
        tp.Block(0.3, 1.8, name="strap", mass=80.0, restraint=strap),
        tp.Block(0.3, 1.8, name="pads", mass=80.0, restraint=pads),
    ]
    levels = [1.0, 2.0, 4.0]
    for im in ("pga", "pga_normalised"):
        runs = tp.ida(blocks, [LAW, tp.HousnerImpact(geometry="linear")], motions, levels, im, [FORCE, "ruptured"])
        assert np.isnan(runs[FORCE].sel(block="free")).all()
        for name, strength in (("strap", 200.0), ("pads", 150.0)):
            here = runs.sel(block=name)
            assert (here[FORCE].where(here["ruptured"], strength) == strength).all()
            assert (here[FORCE].where(~here["ruptured"], 0.0) < strength).all()
            assert here["ruptured"].any()
            assert not here["ruptured"].all()
    inputs = tp.fragility.RandomInputs({"e": tp.fragility.Uniform(0.85, 0.9)})
    sampled = tp.fragility.uncertain_ida(inputs, blocks[1], LAW, motions, levels, outputs=[FORCE], samples=3)
    assert (sampled[FORCE] > 0.0).any()
    assert sampled[FORCE].max() <= 200.0
