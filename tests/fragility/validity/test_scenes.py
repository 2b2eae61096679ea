"""Notes on walls and restraints, falls to one side, and blocks rebuilt from labelled runs."""

import numpy as np
import pytest

import toppling as tp
from toppling.fragility.curves.probability import overturning_probability
from toppling.fragility.fitting.states import reached
from toppling.fragility.runs.provenance import SCENE, blocks_of
from toppling.fragility.uncertainty.realisation import block_with
from toppling.fragility.validity.scenes import scene_facts

FREE = tp.Block(0.3, 1.8, name="free")
TOUCHING = tp.Block(0.3, 1.8, name="touching", wall=tp.Wall())
KIT = tp.Block(0.3, 1.8, name="kit", mass=100.0, wall=tp.Wall(0.1), restraint=tp.Restraint.strap(1.75, slack=0.005))
HEAVY_FRONT = tp.Block(0.3, 1.8, name="books in front", cm_offset=0.03, lean=-0.01)
LAW = tp.HousnerImpact(geometry="linear")


@pytest.fixture(scope="module")
def runs():
    shakes = tp.motions.KanaiTajimi(duration=12.0, dt=0.01).sample(24, seed=3)
    levels = [2.0, 4.0, 8.0]
    outputs = ["overturned", "direction", "peak_front", "peak_back", "wall_impacts", "ruptured", "final_state"]
    return tp.ida([FREE, TOUCHING, KIT, HEAVY_FRONT], LAW, shakes, levels, outputs=outputs)


class TestNotes:
    def test_a_free_block_has_none(self):
        assert scene_facts([FREE]) == []

    def test_each_effect_names_its_blocks(self):
        found = {fact.what: fact.names for fact in scene_facts([FREE, TOUCHING, KIT, HEAVY_FRONT])}
        assert found["wall.base_no_slip"] == ("kit",)
        assert found["wall.pushes"] == ("touching",)  # (0.5 % of 1.8 m is 9 mm, less than a third of 100 mm)
        assert found["restraint.elastic"] == ("kit",)
        assert found["sliding.checked_freestanding"] == ("touching", "kit", "books in front")

    def test_stiff_low_and_without_a_wall(self):
        stiff = tp.Block(0.3, 1.8, name="stiff", mass=100.0, restraint=tp.Restraint.bracket(1.75, 500.0))
        rail = tp.Block(0.3, 1.8, name="rail", wall=tp.Wall(0.1, height=1.0))
        found = {fact.what: fact for fact in scene_facts([stiff, rail])}
        assert (found["restraint.stiff"].names, found["restraint.stiff"].value) == (("stiff",), 12.0)
        assert found["restraint.no_wall"].names == ("stiff",)
        assert found["wall.low_contact"].names == ("rail",)


class TestFalls:
    def test_to_either_side(self, runs):
        front, back, any_side = (reached(runs, state) for state in ("front", "back", "overturned"))
        assert bool((any_side == (front | back)).all())
        assert not bool((front & back).any())
        assert bool(back.sel(block="free").any())
        assert not bool(back.sel(block=["touching", "kit"]).any())
        assert front.attrs["state"] == "a forward fall"
        assert float(overturning_probability(runs, state="front").probability.sel(block="touching").max()) > 0.0

    def test_the_direction_is_needed(self, runs):
        with pytest.raises(TypeError, match="needs runs with `direction`"):
            reached(runs.drop_vars("direction"), "front")

    def test_final_state_and_peaks(self, runs):
        state = runs["final_state"].values
        assert (np.abs(state) == 2).tobytes() == runs["overturned"].values.tobytes()
        assert np.isnan(runs["peak_front"].sel(block="free")).all()
        assert float(runs["peak_back"].sel(block="touching").max()) == 0.0
        assert bool(runs["ruptured"].sel(block="kit").any())
        assert not bool(runs["ruptured"].sel(block="touching").any())


class TestBlocks:
    def test_rebuilt_from_runs(self, runs):
        rebuilt = blocks_of(runs)
        for one, other in zip(rebuilt, (FREE, TOUCHING, KIT, HEAVY_FRONT), strict=True):
            assert LAW.oscillator(one) == LAW.oscillator(other)
        assert SCENE not in tp.ida(FREE, LAW, tp.motions.KanaiTajimi(duration=5.0).sample(1), [1.0]).coords

    def test_uncertain_sizes_keep_the_scene(self):
        other = block_with(KIT, {"width": 0.32})
        assert (other.width, other.wall, other.restraint, other.mass) == (0.32, KIT.wall, KIT.restraint, 100.0)
