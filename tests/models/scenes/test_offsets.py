"""Mass off the middle and lean: sided parameters by hand, closed forms, mirror symmetry, all laws."""

import math

import numpy as np
import pytest
from scene_cases import critical, front_and_back, sine
from shared_cases import LAWS, shake

import toppling as tp
from toppling.models.engine import tables
from toppling.models.engine.regions import crossing_zeta, energy_consistent_zeta
from toppling.models.oscillator import stack
from toppling.models.outputs import OF_ENGINE
from toppling.models.runs import run_many, trace
from toppling.models.sides import sides, zone_of

BLOCK = tp.Block(0.4, 1.8, cm_offset=0.05)
BILINEAR = tp.HousnerImpact(geometry="bilinear")
PEAKS = [-0.034287938007, 0.055644095867, -0.025165047310]


class TestParameters:
    def test_sides(self):
        front, back = sides(BLOCK, "bilinear")
        assert front == pytest.approx((7.982473834508, 0.165148677415, 0.806572068708, 1.115833333333), abs=5e-13)
        assert back == pytest.approx((7.828550588724, 0.270946850338, 0.778658976208, 1.155833333333), abs=5e-13)

    def test_impacts_take_the_same_energy_either_way(self):
        assert BILINEAR.restitution(BLOCK) == pytest.approx(0.929711270671, abs=5e-13)
        back, front = BILINEAR.oscillator(BLOCK).regions
        assert front.lower_edge.factor == pytest.approx(0.913482335977, abs=5e-13)
        assert back.upper_edge.factor == pytest.approx(0.946228528753, abs=5e-13)

    def test_thresholds(self):
        rest = BILINEAR.oscillator(BLOCK).rests[0]
        gain = sides(BLOCK, "bilinear")[0].gain
        assert (rest.up / gain, rest.down / gain) == pytest.approx((1.634441666667, 2.724069444444), abs=5e-13)

    @pytest.mark.parametrize("geometry", ["bilinear", "exact"])
    def test_lean(self, geometry):
        block = tp.Block(0.4, 1.8, lean=math.radians(1.0))
        rest = tp.HousnerImpact(geometry=geometry).oscillator(block).rests[0]
        gain = sides(block, geometry)[0].gain
        assert (rest.up / gain, rest.down / gain) == pytest.approx((2.000320792121, 2.359583865718), abs=5e-13)

    def test_zone(self):
        zone = zone_of(BLOCK, 0.05, "h", rigid_rest=True)
        found = (
            zone.front,
            zone.back,
            zone.stiffness * zone.inertia,
            zone.centre,
            zone.step * zone.inertia,
            zone.inertia,
        )
        expected = (0.010904530761821, 0.010900246467627, 170.921318041217, 0.002866506853916, 0.009989372115506)
        assert found == pytest.approx((*expected, 1.135657237511), rel=1e-12)

    def test_a_symmetric_block_has_the_table_that_it_had(self):
        for law in LAWS:
            plain, written = (law.oscillator(tp.Block(0.4, 1.8, **kw)) for kw in ({}, {"cm_offset": 0.0, "lean": 0.0}))
            assert plain == written
            assert not plain.sided


class TestMotion:
    @pytest.mark.parametrize("law", [
        BILINEAR, tp.EnergyConsistent(), tp.EnergyConsistent(delta=0.01), tp.EnergyConsistent(rest="elastic"),
    ], ids=lambda law: law.label)  # fmt: skip
    def test_free_decay(self, law):
        """E -> eta² E and theta = (a/k)(1 - sqrt(1 - 2 E k/a²)) per side; the energy-consistent zone does the same."""
        alpha = sides(BLOCK, "bilinear")[0].alpha
        run = trace(law.oscillator(BLOCK), np.zeros(40_001), 2.5e-4, 0.5 * alpha, max_turning_points=10)
        assert run.turning_points[1][:3] == pytest.approx(PEAKS, abs=5e-13)

    @pytest.mark.parametrize(("delta", "expected"), [
        (0.05, (1.4164315640, 1.3348268248, 1.2694282096)), (0.01, (6.5682822888, 6.1211637146, 5.7114990592)),
    ])  # fmt: skip
    def test_held_damping(self, delta, expected):
        alpha = sides(BLOCK, "bilinear")[0].alpha
        oscillator = tp.EnergyConsistent(delta=delta).oscillator(BLOCK)
        run = trace(oscillator, np.zeros(40_001), 2.5e-4, 0.5 * alpha)
        damping = run.history[tables.HISTORY_DAMPING]
        held = damping[damping > 0.0]
        changes = held[np.append(True, np.abs(np.diff(held)) > 1e-9)]
        assert changes[:3] == pytest.approx(expected, abs=5e-11)

    def test_half_sines(self):
        """To the front the closed form; to the back it rebounds and falls forward, below the back's own value."""
        oscillator = BILINEAR.oscillator(BLOCK)
        assert critical(oscillator, sine(2.0 * math.pi, 1, -1.0), 2.5, 4.0) == pytest.approx(3.122649076149, abs=3e-10)
        found = critical(oscillator, sine(2.0 * math.pi, 1, 1.0), 4.1, 4.5)
        assert found == pytest.approx(4.264114686147, abs=3e-10)
        record, dt = sine(2.0 * math.pi, 1, 1.0)(4000)
        result = run_many([oscillator], np.full((1, 1), 4.3), record, dt)[0, 0]
        assert result[OF_ENGINE["direction"]] == 1.0

    @pytest.mark.parametrize("law", LAWS, ids=lambda law: law.label)
    @pytest.mark.parametrize("odd", [{"cm_offset": 0.05}, {"lean": 0.03}, {"cm_offset": -0.1, "lean": 0.02}], ids=str)
    def test_mirror(self, law, odd):
        record = shake(np.random.default_rng(6), 400)
        factors = np.linspace(0.5, 6.0, 20)[None]
        one = front_and_back(law.oscillator(tp.Block(0.4, 1.8, **odd)), record, factors)
        mirrored = tp.Block(0.4, 1.8, **{name: -value for name, value in odd.items()})
        two = front_and_back(law.oscillator(mirrored), -record, factors)
        assert (one[:, 0] == two[:, 0]).all()
        assert one[:, [1, 2]] == pytest.approx(two[:, [2, 1]], abs=1e-7)

    def test_an_elastic_block_starts_in_balance(self):
        run = trace(tp.GianniniMasiani(e=0.9).oscillator(BLOCK), np.zeros(500), 0.01)
        zone = zone_of(BLOCK, 0.05, "h", rigid_rest=False)
        assert run.history[0] == pytest.approx(np.full(500, zone.centre), abs=1e-15)
        assert run.results[OF_ENGINE["uplifted"]] == 0.0

    @pytest.mark.parametrize(
        "odd", [{"cm_offset": 0.99 * 0.15}, {"lean": 0.99 * 0.165148}, {"cm_offset": -0.99 * 0.15}]
    )
    def test_next_to_falling_by_itself(self, odd):
        record = shake(np.random.default_rng(7))
        for law in (tp.HousnerImpact(), BILINEAR, tp.EnergyConsistent(delta=1e-3)):
            found = front_and_back(law.oscillator(tp.Block(0.3, 1.8, **odd)), record, np.linspace(0.01, 5.0, 20)[None])
            assert np.isfinite(found).all()
            assert found[:, 0].any()


class TestHistory:
    @pytest.mark.parametrize("law", [tp.HousnerImpact(), BILINEAR, tp.GianniniMasiani()], ids=lambda law: law.label)
    def test_acceleration_is_the_slope_of_velocity(self, law):
        """On both sides, with the gain and inertia of each, wherever no event lies within two samples."""
        shakes = tp.motions.KanaiTajimi(duration=8.0, dt=0.0005).sample(1, seed=2)
        run = tp.simulate(tp.Block(0.4, 1.8, cm_offset=0.1, lean=0.02), law, 8.0 * shakes.assign_attrs(units="m s-2"))
        omega, a = run.angular_velocity.values, run.angular_acceleration.values
        slope = (omega[2:] - omega[:-2]) / 0.001
        theta = run.rotation.values
        smooth = np.abs(np.diff(slope, prepend=0.0)) < 0.5
        smooth &= np.abs(theta[1:-1]) < 1.0
        for side in (theta[1:-1] > 0.02, theta[1:-1] < -0.02):
            assert (smooth & side).sum() > 100
            assert np.median(np.abs(slope - a[1:-1])[smooth & side]) < 0.02 * np.abs(a).max()
        assert int(run.final_state) in (-2, 0, 2)


class TestRoot:
    @pytest.mark.parametrize(("speed", "leaves"), [(2.0, 1.5), (9.0, 0.5), (1.2, 0.0), (30.0, 29.999)])
    def test_a_centred_zone(self, speed, leaves):
        assert crossing_zeta(-1.0, speed, 1.0, leaves) == pytest.approx(
            energy_consistent_zeta(speed, leaves), rel=1e-11
        )

    @pytest.mark.parametrize(("start", "end"), [(-1.4, 0.6), (-0.2, 1.8), (-1.0, 1.0)])
    @pytest.mark.parametrize("zeta", [0.01, 0.5, 0.999999, 1.0, 1.000001, 3.0])
    def test_the_motion_with_the_root_arrives(self, start, end, zeta):
        """By the matrix exponential of the crossing: the velocity at the far end, from the root."""
        from scipy.linalg import expm
        from scipy.optimize import brentq

        matrix = np.array([[0.0, 1.0], [-1.0, -2.0 * zeta]])
        speed = 20.0
        arrives = brentq(lambda t: (expm(matrix * t) @ (start, speed))[0] - end, 1e-6, 1.0, xtol=1e-15)
        leaves = (expm(matrix * arrives) @ (start, speed))[1]
        assert crossing_zeta(start, speed, end, leaves) == pytest.approx(zeta, rel=1e-9)


@pytest.mark.parametrize("geometry", ["exact", "linear", "bilinear"])
def test_no_loss_with_any_offset(geometry):
    """e = 1: the factors of the two impacts have the product 1, but for rounding."""
    law = tp.HousnerImpact(e=1.0, geometry=geometry)
    stack([law.oscillator(tp.Block(0.4, 1.8, cm_offset=offset)) for offset in np.linspace(-0.19, 0.19, 100)])


def test_refused(refusal):
    refusal()
