"""Walls: closed forms of one-sided rocking and of rocking with a gap, in normalised units (q = alpha = gain = 1)."""

import math

import numpy as np
import pytest
from scene_cases import SMALL, critical, front_and_back, sine, table

import toppling as tp
from toppling.models.assembly import Contact, Surroundings
from toppling.models.outputs import OF_ENGINE
from toppling.models.runs import run_many, trace
from toppling.models.scenes.wall import rebound

E, REBOUND = 0.925, 0.5


def wall(rotation, factor=REBOUND):
    return Surroundings(back_wall=Contact(rotation, factor))


def released(oscillator, theta, duration, omega=0.0, samples=20_000):
    return trace(oscillator, np.zeros(samples + 1), duration / samples, theta, omega, max_turning_points=40)


class TestFreeDecay:
    def test_one_sided_peaks_and_impacts(self):
        """x_n = 1 - sqrt(1 - r^2n (1 - (1 - x0)²)); impacts at acosh(1/(1 - x0)) + 2 sum of atanh(r^k v0)."""
        r, v0 = E * REBOUND * E, math.sqrt(0.75)
        run = released(table(E, wall(0.0)), 0.5, 5.0)
        peaks = [1.0 - math.sqrt(1.0 - r ** (2 * n) * 0.75) for n in range(1, 9)]
        assert run.turning_points[1][:8] == pytest.approx(peaks, rel=1e-11)
        assert peaks[:4] == pytest.approx([0.071166135074, 0.012641509286, 0.002301718383, 0.000420872381], abs=5e-13)
        impacts = [math.acosh(2.0)]
        for k in range(1, 9):
            impacts.append(impacts[-1] + 2.0 * math.atanh(r**k * v0))
        middles = [0.5 * (a + b) for a, b in zip(impacts, impacts[1:], strict=False)]
        assert run.turning_points[0][:8] == pytest.approx(middles, rel=1e-11)
        assert run.history[0, -1] == 0.0
        assert run.history[2, -1] == -1.0  # at rest

    @pytest.mark.parametrize("offset", [0.0, 0.02])
    def test_a_touching_wall_is_struck_after_the_impact_of_the_base(self, offset):
        """As a wall that is 1 µm away: e v, where the block comes down with v; the peak behind is 0, not -0."""
        found = []
        for gap in (0.0, 1e-6):
            block = tp.Block(0.3, 1.8, cm_offset=offset, wall=tp.Wall(gap))
            run = released(tp.HousnerImpact().oscillator(block), 0.5 * block.alpha, 4.0, samples=4000)
            found.append({name: run.results[OF_ENGINE[name]] for name in OF_ENGINE})
        touching, near = found
        assert touching["wall_impact_velocity"] == pytest.approx(near["wall_impact_velocity"], rel=1e-4)
        if not offset:
            e = tp.HousnerImpact().restitution(tp.Block(0.3, 1.8))
            assert touching["wall_impact_velocity"] == pytest.approx(e * touching["impact_velocity"], rel=1e-12)
        assert str(float(touching["peak_back"])) == "0.0"

    def test_gap(self):
        """v² -> e² v² at 0, and r² (v² - U) + U at the wall where v² > U = 2 x - x²: the recursion by hand."""
        at = 0.1
        run = released(table(E, wall(at)), 0.5, 10.0)
        energy, peaks, strikes, sign = 0.75, [], [], 1.0
        step = 2.0 * at - at * at
        while len(peaks) < 8:
            energy *= E * E
            sign = -sign
            if sign < 0.0 and energy > step:
                strikes.append(math.sqrt(energy - step))
                energy = E * E * (REBOUND**2 * (energy - step) + step)
                sign = 1.0
            peaks.append(sign * (1.0 - math.sqrt(1.0 - energy)))
        assert run.turning_points[1][:8] == pytest.approx(peaks, rel=1e-10)
        assert peaks[:3] == pytest.approx([0.139299247048, 0.088608319005, -0.075290911969], abs=5e-13)
        assert strikes == pytest.approx([0.672100252939, 0.178249962805], abs=5e-13)
        assert run.results[OF_ENGINE["wall_impacts"]] == len(strikes)
        assert run.results[OF_ENGINE["wall_impact_velocity"]] == pytest.approx(max(strikes), rel=1e-11)
        assert run.results[OF_ENGINE["peak_back"]] == at
        assert run.results[OF_ENGINE["peak_front"]] == 0.5

    def test_exact_geometry(self):
        block = tp.Block(0.3, 1.8, wall=tp.Wall(0.05))
        oscillator = tp.HousnerImpact().oscillator(block)
        assert oscillator.regions[0].lower == pytest.approx(-0.027781351264, abs=5e-13)
        run = released(oscillator, 0.5 * block.alpha, 10.0)
        expected = [0.032828448309, 0.025781980211, -0.023563490464, 0.021551327789, -0.019723448780]
        assert run.turning_points[1][:5] == pytest.approx(expected, abs=5e-13)

    @pytest.mark.parametrize("law", [tp.HousnerImpact(1.0), tp.HousnerImpact(1.0, "linear")], ids=["exact", "linear"])
    def test_energy_is_conserved_without_loss(self, law):
        block = tp.Block(0.3, 1.8, wall=tp.Wall(0.05, restitution=1.0))
        run = released(law.oscillator(block), 0.5 * block.alpha, 10.0)
        front = run.turning_points[1][run.turning_points[1] > 0.0]
        assert front[:6] == pytest.approx([0.5 * block.alpha] * len(front[:6]), rel=1e-10)


class TestHeldAgainstTheWall:
    def test_first_strike_and_release(self):
        """F = -1.5 up to 6: struck at acosh 1.2 with 0.5 sinh; let go, it rises to 1 - sqrt(1 - e² U)."""
        oscillator = table(0.9, wall(0.1))
        run = trace(oscillator, np.full(6001, 1.5), 0.001, max_turning_points=20)
        assert run.results[OF_ENGINE["wall_impact_velocity"]] == pytest.approx(0.331662479036, abs=5e-13)
        assert run.history[0, 622] > -0.1 == run.history[0, -1]
        rest = np.flatnonzero(run.history[2] == -2.0)
        assert rest[0] == pytest.approx(1745, abs=1)  # (at rest from 1.744693657813 on)
        free = trace(oscillator, np.zeros(2001), 0.001, -0.1, 0.0, max_turning_points=5)
        assert free.turning_points[1][0] == pytest.approx(0.080163057928, abs=5e-13)

    def test_leans_behind_a_wide_gap(self):
        """From -1.1 with -0.1 it falls onto the wall at 1.2, at ln 2 with 0.2, and stays there: not overturned."""
        run = released(table(0.9, wall(1.2)), -1.1, 20.0, omega=-0.1)
        assert run.results[OF_ENGINE["overturned"]] == 0.0
        assert run.results[OF_ENGINE["wall_impact_velocity"]] == pytest.approx(0.2, rel=1e-11)
        assert run.results[OF_ENGINE["final_state"]] == -1.0
        assert run.history[0, -1] == -1.2

    def test_a_push_towards_the_wall_moves_nothing(self):
        run = trace(table(0.9, wall(0.0)), np.full(500, 3.0), 0.01)
        assert run.results[OF_ENGINE["uplifted"]] == 0.0
        assert not run.history[0].any()


class TestPulses:
    @pytest.mark.parametrize(("omega", "expected"), [(1.0, 1.3223965979), (3.0, 2.2938723134)], ids=["slow", "fast"])
    @pytest.mark.parametrize("towards", [False, True], ids=["half sine away", "one cycle, towards first"])
    def test_touching(self, omega, expected, towards):
        """It waits at rest for the half cycle that pushes it away: the free block's closed form."""
        found = critical(table(0.9, wall(0.0)), sine(omega, 2 if towards else 1, 1.0 if towards else -1.0), 1.05, 3.0)
        assert found == pytest.approx(expected, abs=3e-9)

    @pytest.mark.parametrize(("gap", "low", "high", "expected"), [
        (0.0, 3.2, 3.4, 3.2891467775), (0.05, 2.3, 2.4, 2.3685679514),
    ])  # fmt: skip
    def test_thresholds_are_not_monotonic_in_the_gap(self, gap, low, high, expected):
        assert critical(table(0.9, wall(gap)), sine(5.0, 2, 1.0), low, high) == pytest.approx(expected, abs=3e-9)

    @pytest.mark.parametrize(("gap", "towards", "front_peak"), [
        (None, True, None), (None, False, None), (0.0, True, 0.017038271131), (0.02, False, 0.140581854332),
        (0.02, True, None), (0.05, True, None),
    ])  # fmt: skip
    def test_two_cycles_in_real_sizes(self, gap, towards, front_peak):
        """Two cycles of 1 Hz and 2.2 m/s²: the free block falls, a touching wall saves, a gap can do either."""
        block = tp.Block(0.3, 1.8, wall=None if gap is None else tp.Wall(gap))
        oscillator = tp.HousnerImpact(geometry="linear").oscillator(block)
        record, dt = sine(2.0 * math.pi, 4, 1.0 if towards else -1.0)(16_000)
        result = run_many([oscillator], np.full((1, 1), 2.2), record, dt)[0, 0]
        assert result[OF_ENGINE["overturned"]] == (front_peak is None)
        if gap is not None and front_peak is None:
            assert result[OF_ENGINE["direction"]] == 1.0
        if front_peak is not None:
            assert result[OF_ENGINE["peak_front"]] == pytest.approx(front_peak, rel=1e-6)


class TestRebound:
    def test_a_block_with_its_mass_in_the_middle(self):
        block = tp.Block(0.3, 1.8)
        r = rebound(block.gyration, block.b, block.h, block.height)
        assert r == pytest.approx(1.5 * math.cos(block.alpha) ** 2 - 1.0, rel=1e-12)

    def test_the_gap_tends_to_the_published_one_sided_restitution(self):
        block = tp.Block(0.3, 1.8, wall=tp.Wall(0.0))
        factor = tp.HousnerImpact(geometry="linear").oscillator(block).regions[0].lower_edge.factor
        s, c = math.sin(block.alpha) ** 2, math.cos(block.alpha) ** 2
        assert -factor == pytest.approx((1.0 - 1.5 * s) ** 2 * (1.0 - 1.5 * c), rel=1e-12)

    def test_squat_blocks_and_low_rails_stick(self):
        assert rebound(*_numbers(tp.Block(1.6, 1.0)), 1.0) == 0.0
        assert rebound(*_numbers(tp.Block(0.3, 1.8)), 1.1) == 0.0


def _numbers(block):
    return block.gyration, block.b, block.h


class TestLimits:
    @pytest.mark.parametrize("law", [tp.HousnerImpact(), tp.HousnerImpact(geometry="linear"), tp.EnergyConsistent()])
    def test_a_wall_out_of_reach_changes_no_bit(self, law, shaken):
        free, far = (law.oscillator(tp.Block(0.4, 1.8, wall=w)) for w in (None, tp.Wall(3.5)))
        record, factors = shaken
        names = ("overturned", "peak_rotation", "impacts", "overturning_time", "impact_velocity", "direction")
        columns = [OF_ENGINE[name] for name in names]
        one, other = (run_many([o], factors, record, 0.01)[0][:, columns] for o in (free, far))
        assert one.tobytes() == other.tobytes()

    def test_a_narrow_gap_tends_to_a_touching_wall(self):
        touching, near = (released(table(E, wall(gap)), 0.5, 5.0).turning_points[1][:4] for gap in (0.0, 1e-7))
        assert near == pytest.approx(touching, abs=1e-7)  # (the width of the gap)

    def test_mirror(self, shaken):
        """The same niche seen from the other side, under the opposite motion."""
        record, factors = shaken
        niche = Surroundings(Contact(0.3 * SMALL, 0.5), Contact(0.2 * SMALL, 0.4))
        other = Surroundings(niche.back_wall, niche.front_wall)
        one = front_and_back(table(0.9, niche, SMALL), record, factors)
        two = front_and_back(table(0.9, other, SMALL), -record, factors)
        assert one[:, [0, 2, 1]] == pytest.approx(two, abs=1e-9)
        assert one[:, 1].max() == pytest.approx(0.3 * SMALL)

    @pytest.mark.parametrize("gap", [0.0, 1e-6, 0.02, 0.5])
    @pytest.mark.parametrize("restitution", [0.0, None, 1.0])
    @pytest.mark.parametrize("geometry", ["exact", "linear"])
    def test_hostile_walls_end(self, gap, restitution, geometry, shaken):
        """No hang and no NaN; with and without the skipped beginning, and flags alone: the same flags."""
        record, factors = shaken
        block = tp.Block(0.3, 1.8, wall=tp.Wall(gap, restitution=restitution))
        oscillator = tp.HousnerImpact(geometry=geometry).oscillator(block)
        result = run_many([oscillator], factors, record, 0.01)[0]
        assert np.isfinite(result[:, [OF_ENGINE["peak_front"], OF_ENGINE["peak_back"]]]).all()
        assert (result[:, OF_ENGINE["direction"]] >= 0.0).all()
        for skip, flags_only in ((False, False), (True, True)):
            again = run_many([oscillator], factors, record, 0.01, skip, flags_only)[0]
            assert (again[:, 0] == result[:, 0]).all()


class TestAfterTheRecord:
    """1 - sqrt(1 - e² U) with the energy U = 2 x - x² of the block at the wall, from which it comes back to 0."""

    PEAK = 1.0 - math.sqrt(1.0 - 0.81 * 0.19)

    def test_it_comes_off_the_wall_that_it_was_held_against(self):
        found = front_and_back(table(0.9, wall(0.1)), np.full(601, 1.5), np.ones((1, 1)))[0]
        assert found == pytest.approx([0.0, self.PEAK, 0.1], rel=1e-11)

    def test_it_comes_off_the_wall_to_which_it_stuck(self):
        run = trace(table(0.9, wall(0.1, 0.0)), np.zeros(2), 1e-3, -0.05, -0.5)
        assert run.results[OF_ENGINE["peak_front"]] == pytest.approx(self.PEAK, rel=1e-11)
        assert run.results[OF_ENGINE["final_state"]] == 0.0


class TestRefusals:
    def test_no_zone_no_refusal(self):
        """A block that touches its wall never crosses the zone: a second wall, or a strap, may be nearer than that."""
        restraint = tp.Restraint.strap(1.75)
        block = tp.Block(0.3, 1.8, mass=100.0, wall=tp.Wall(0.0, front_gap=0.001), restraint=restraint)
        zoned = tp.DiscreteDamping(rest="rigid").oscillator(block)
        assert zoned.regions == tp.HousnerImpact(geometry="bilinear").oscillator(block).regions


@pytest.fixture(scope="module")
def shaken():
    from shared_cases import shake

    return shake(np.random.default_rng(4)), np.linspace(0.5, 8.0, 25)[None]


def test_refused(refusal):
    refusal()
