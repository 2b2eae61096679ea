"""Walls, restraints, offsets and leans in films: where they are drawn, what is said, when a restraint is broken."""

import math

import numpy as np
import pytest

import toppling as tp
from toppling.studies.film import fittings
from toppling.studies.film.frames import frames_of, rotated
from toppling.studies.film.scene import Scene

LINEAR = tp.HousnerImpact(geometry="linear")
STRAP = tp.Block(0.3, 1.8, mass=100.0, wall=tp.Wall(0.02), restraint=tp.Restraint.strap(1.75, slack=0.005))
RESTRAINTS = {
    "strap": STRAP.restraint,
    "cable": tp.Restraint.cable(1.7, 300.0, angle=0.3, width=0.3),
    "bracket": tp.Restraint.bracket(1.7, 100.0),
    "pole": tp.Restraint.pole(100.0, 300.0, 50e3, 0.25, 0.05),
    "tendon": tp.Restraint.tendon(40e3, 600.0, 50.0, width=0.3),
    "adhesive": tp.Restraint.adhesive(150.0, 0.28),
}


def sine(amplitude, sign=1.0):
    motion = tp.motions.OneCycleSine(amplitude=amplitude, omega=2.0 * math.pi, dt=0.005, tail=2.0).sample(1)
    return (sign * motion).assign_attrs(motion.attrs)


def filmed(block, law, motion):
    run = tp.simulate(block, law, motion)
    frames = frames_of(run)
    return run, frames, Scene(run, block, frames, 240)


class TestWalls:
    @pytest.mark.parametrize("law", [LINEAR, tp.HousnerImpact()])
    @pytest.mark.parametrize("height", [None, 1.2])
    def test_the_block_touches_the_wall_where_it_is_drawn(self, law, height):
        """At the rotation of the contact the upper edge, or the rear face at the rail's height, is on the face."""
        block = tp.Block(0.3, 1.8, wall=tp.Wall(0.05, height, front_gap=0.1))
        run = tp.simulate(block, law, sine(3.0))
        back, front = fittings.faces(run, block)
        level = 1.8 if height is None else height
        assert (back.side, front.side) == (-1.0, 1.0)
        for face, gap in ((back, 0.05), (front, 0.1)):
            assert face.contact(block, face.side * face.rotation)[0] == pytest.approx(face.x, abs=1e-15)
            assert abs(face.x) - 0.15 == pytest.approx(gap, rel=4e-3)  # (linear geometry takes gap/height)
            assert face.rotation == pytest.approx(math.atan(gap / level), rel=3e-3)
            assert face.rail is (height is not None)

    def test_it_never_enters_the_wall(self):
        run = tp.simulate(STRAP, LINEAR, sine(4.4))
        (back,) = fittings.faces(run, STRAP)
        edge = np.array([[-0.15, 1.8]])
        reached = [rotated(STRAP, theta, 0.0, edge)[0, 0] for theta in run.rotation.values]
        assert min(reached) == pytest.approx(back.x, abs=2e-5)
        assert min(reached) >= back.x - 1e-12

    def test_strikes(self):
        """Alone impacts that are apart are seen in samples; each is where the block is at the wall."""
        block = tp.Block(0.3, 1.8, wall=tp.Wall(0.05))
        run = tp.simulate(block, LINEAR, sine(2.2, -1.0))
        (back,) = fittings.faces(run, block)
        times = fittings.strikes(run, [back])
        assert 0 < times.size <= int(run.wall_impacts)
        np.testing.assert_allclose(run.rotation.sel(time=times), -back.rotation, atol=0.3 * 0.005)
        assert fittings.strikes(run, []).size == 0

    def test_words(self):
        block = tp.Block(0.3, 1.8, wall=tp.Wall(0.4, 1.5))
        _, frames, scene = filmed(block, LINEAR, sine(4.0, -1.0))
        words = dict.fromkeys(scene._state_text(i) for i in range(frames.time.size))
        assert list(words)[-1].startswith("leans ")
        _, frames, scene = filmed(STRAP, LINEAR, sine(4.4))
        assert "strikes the wall" in {scene._state_text(i) for i in range(frames.time.size)}


class TestRestraints:
    @pytest.mark.parametrize("kind", RESTRAINTS)
    def test_broken_from_its_rupture_on(self, kind):
        walled = kind in ("strap", "cable")
        restraint = RESTRAINTS[kind]
        block = tp.Block(0.3, 1.8, mass=100.0, wall=tp.Wall(0.02) if walled else None, restraint=restraint)
        run, frames, scene = filmed(block, LINEAR, sine(5.0))
        assert bool(run.ruptured)
        at = float(run.rupture_time)
        for i in (0, int(np.searchsorted(frames.time, at)), frames.time.size - 1):
            scene.frame(i)
            broken = bool(frames.time[i] >= at)
            text = scene._hold.get_text()
            assert text.startswith(kind)
            assert (text == f"{kind} broken at {at:.2f} s") is broken
            for drawn in scene._lines:
                assert bool(np.isnan(drawn.get_xdata()).any()) is broken

    def test_the_slack_curve_is_as_long_as_the_strap(self):
        (strap,) = fittings.straps(STRAP, fittings.faces(tp.simulate(STRAP, LINEAR, sine(1.0)), STRAP))
        curve = fittings.line(STRAP, strap, 0.0)
        assert curve.shape == (15, 2)
        lengths = np.hypot(*np.diff(curve, axis=0).T)
        assert lengths.sum() == pytest.approx(0.02 + 0.005, rel=0.1)
        assert fittings.line(STRAP, strap, 0.01).shape == (2, 2)  # taut

    def test_force(self):
        """At its rupture the strap has its strength, by the engine's time and the force that the film shows."""
        run = tp.simulate(STRAP, LINEAR, sine(4.4))
        after = int(np.searchsorted(run.time.values, float(run.rupture_time)))
        before, beyond = (fittings.force(STRAP.restraint, run.rotation.values[i]) for i in (after - 1, after))
        assert before < 267.0 < beyond
        assert fittings.force(STRAP.restraint, -0.01) == 0.0
        assert fittings.force(RESTRAINTS["adhesive"], 0.0) is None


class TestLeanAndOffset:
    BLOCK = tp.Block(0.4, 1.8, cm_offset=0.05, lean=math.radians(-2.0), wall=tp.Wall(0.03), name="cabinet")

    def test_the_floor_slopes_and_the_weight_is_vertical(self):
        _, _, scene = filmed(self.BLOCK, tp.HousnerImpact(), sine(2.6, -1.0))
        scene.frame(0)
        outline = scene._body.get_transform().transform(scene._body.get_xy()[:2])
        rise = np.diff(outline, axis=0)[0]
        assert math.atan2(rise[1], rise[0]) == pytest.approx(math.radians(2.0), abs=1e-9)
        x, y = scene._plumb.get_data()
        assert x[0] == x[1]
        assert y[1] == pytest.approx(x[0] * math.tan(math.radians(2.0)))
        assert x[0] == pytest.approx(0.05 * math.cos(math.radians(2.0)) - 0.9 * math.sin(math.radians(2.0)))

    @pytest.mark.slow
    def test_balance_is_that_of_the_side(self):
        run, frames, scene = filmed(self.BLOCK, tp.HousnerImpact(), sine(6.0))
        (_, front), _ = self.BLOCK.corners
        assert front < self.BLOCK.alpha + math.radians(2.0)
        past = [scene._past_balance(i) for i in range(frames.time.size)]
        assert past == ((frames.rotation > front) | (frames.rotation < -self.BLOCK.corners[1][1])).tolist()
        assert bool(run.overturned)

    def test_no_words_beyond_the_frame_or_on_each_other(self):
        for block in (self.BLOCK, STRAP):
            run = tp.simulate(block, LINEAR, sine(4.4))
            frames = frames_of(run, speed=0.25)
            scene = Scene(run, block, frames, 480)
            for i in (0, frames.time.size // 2, frames.time.size - 1):
                scene.frame(i)
                texts = [*scene._figure.texts, *scene._stage_ax.texts]
                boxes = [text.get_window_extent(scene._canvas.get_renderer()) for text in texts if text.get_text()]
                for k, box in enumerate(boxes):
                    assert box.x0 >= 0.0
                    assert box.x1 <= 480.0
                    assert not any(box.overlaps(other) for other in boxes[:k])
