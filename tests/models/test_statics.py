"""Static checks of anchors by hand: equilibrium of moments, the rule of half the weight, and the engine's uplift."""

import math

import numpy as np
import pytest

import toppling as tp
from toppling.core.doubts import ImplausibleInput
from toppling.core.units import STANDARD_GRAVITY as G
from toppling.models import half_weight, required_force, static_capacity

BLOCK = tp.Block(0.3, 1.8, mass=100.0)


class TestRequiredForce:
    def test_by_hand(self):
        """100 kg at 0.5 g, anchored at 1.75 m: (490.3325 × 0.9 − 980.665 × 0.15)/1.75 N."""
        assert required_force(BLOCK, 0.5 * G, 1.75) == pytest.approx(
            (490.3325 * 0.9 - 980.665 * 0.15) / 1.75, rel=1e-14
        )

    def test_half_the_weight_is_that_of_1_g_at_the_top(self):
        """(m g/2)(1 − b/h) at z = 2h: the rule rounds it up."""
        found = required_force(BLOCK, G, 1.8)
        assert found == pytest.approx(0.5 * 100.0 * G * (1.0 - 0.15 / 0.9), rel=1e-14)
        assert found < half_weight(BLOCK) == 0.5 * 100.0 * G

    def test_nothing_is_needed_below_uplift(self):
        assert required_force(BLOCK, 0.999 * G * 0.15 / 0.9, 1.0) == 0.0

    def test_an_acceleration_in_g_is_doubted(self):
        with pytest.warns(ImplausibleInput, match="0.4 m/s² does not tip the block: g in place of m/s²"):
            assert required_force(BLOCK, 0.4, 1.7) == 0.0
        assert required_force(BLOCK, 0.0, 1.7) == 0.0
        assert required_force(BLOCK, 0.1, 1.7) == 0.0  # (0.1 g tips it no more than 0.1 m/s² does)

    def test_capacity_and_force_agree(self):
        """At the static capacity of a strap the force needed is its strength, with an offset and a lean too."""
        for more in ({}, {"cm_offset": 0.03}, {"lean": math.radians(2.0)}, {"cm_offset": -0.05, "lean": -0.02}):
            held = tp.Block(0.3, 1.8, mass=100.0, restraint=tp.Restraint.strap(1.75, 267.0, count=2), **more)
            assert required_force(held, static_capacity(held), 1.75) == pytest.approx(2 * 267.0, rel=1e-12)

    def test_refuses(self):
        with pytest.raises(ValueError, match="needs the mass of the block"):
            required_force(tp.Block(0.3, 1.8), 1.0, 1.0)
        for height in (0.0, BLOCK.height + 0.1, 150.0):  # (in cm)
            with pytest.raises(ValueError, match="height must be"):
                required_force(BLOCK, 1.0, height)


class TestStaticCapacity:
    def test_by_hand(self):
        """a_u = g tan α (1 + F d/(m g b))."""
        held = tp.Block(0.3, 1.8, mass=100.0, restraint=tp.Restraint.strap(1.75, 267.0))
        factor = 1.0 + 267.0 * 1.75 / (100.0 * G * 0.15)
        assert static_capacity(held) == pytest.approx(G * math.tan(held.alpha) * factor, rel=1e-14)

    def test_bare(self):
        assert static_capacity(BLOCK) == pytest.approx(G * math.tan(BLOCK.alpha), rel=1e-14)
        leaning = tp.Block(0.4, 1.8, lean=math.radians(1.0))
        assert static_capacity(leaning) == pytest.approx(2.000320792121, abs=5e-13)
        aside = tp.Block(0.4, 1.8, cm_offset=0.05)
        assert static_capacity(aside) == pytest.approx(1.634441666667, abs=5e-13)

    @pytest.mark.parametrize("strength", [50.0, 267.0, 900.0])
    def test_a_rigid_adhesive_lets_go_there(self, strength):
        """A slow push of the engine's block: an adhesive holds rigidly, so that its block moves from a_u on."""
        held = tp.Block(0.3, 1.8, mass=100.0, restraint=tp.Restraint.adhesive(strength, 0.28))
        a = static_capacity(held)
        law = tp.HousnerImpact(geometry="bilinear", lever="h")
        for factor, moves in ((0.9999, False), (1.0001, True)):
            push = tp.motions.from_array(np.full(100, -factor * a), 0.005)
            runs = tp.ida(held, law, push, [1.0], "scale", outputs=["uplifted"])
            assert bool(runs["uplifted"].any()) == moves
