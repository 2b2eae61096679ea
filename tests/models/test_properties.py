"""What holds for every law: symmetry, similarity, conservation, limits, and histories that satisfy their equation."""

import dataclasses
import math

import numpy as np
import pytest
from shared_cases import LAWS, shake
from thresholds import overturns

import toppling as tp
from toppling.core.units import STANDARD_GRAVITY as G
from toppling.models.engine import tables as engine
from toppling.models.oscillator import Edge, Oscillator, Region
from toppling.models.outputs import OF_ENGINE
from toppling.models.runs import run_many, trace
from toppling.motions import CloughPenzien, OneCycleSine, scale_to

BLOCK = tp.Block.from_slenderness(0.2, 0.5)


def label(model):
    return model.label


@pytest.mark.parametrize("model", LAWS, ids=label)
def test_mirror_symmetry(model):
    """The floor shaken the other way gives the mirrored history, bit for bit."""
    rng = np.random.default_rng(1)
    oscillator = model.oscillator(BLOCK)
    for amplitude in (1.5, 2.5, 4.0):
        record = amplitude * shake(rng)
        one, other = trace(oscillator, record, 0.01), trace(oscillator, -record, 0.01)
        np.testing.assert_array_equal(one.history[:2], -other.history[:2])
        mirrored = other.results.copy()
        mirrored[[OF_ENGINE["direction"], OF_ENGINE["final_state"]]] *= -1.0
        np.testing.assert_array_equal(one.results, mirrored)


@pytest.mark.parametrize("model", LAWS, ids=label)
def test_similarity(model):
    """Blocks of one slenderness move alike in time p t under the same accelerations over g: any size and inertia."""
    rng = np.random.default_rng(2)
    small = tp.Block.from_slenderness(0.2, 0.5)
    for R, inertia in ((2.0, 4.0 / 3.0), (0.73, 4.0 / 3.0), (1.9, 1.51)):
        if isinstance(model, tp.Vassiliou) and inertia != small.inertia:
            continue  # c/p is proportional to 1/sqrt(lambda) in that law
        large = tp.Block.from_slenderness(0.2, R, inertia)
        slower = small.p / large.p
        for amplitude in (1.5, 2.5):
            record = amplitude * shake(rng, n=500)
            fast = trace(model.oscillator(small), record, 0.01)
            slow = trace(model.oscillator(large), record, 0.01 * slower)
            assert fast.results[0] == slow.results[0]
            np.testing.assert_allclose(fast.results[1], slow.results[1], rtol=1e-9)
            np.testing.assert_allclose(
                fast.history[1, :300], slower * slow.history[1, :300], rtol=0.0, atol=1e-8 * small.p * small.alpha
            )


def test_similarity_of_vassiliou():
    """c/(I_O p) = 0.02 (alpha/0.1)² / sqrt(lambda) whatever the size: the law scales as the others do."""
    for R in (0.1, 1.0, 10.0):
        block = tp.Block.from_slenderness(0.25, R)
        damping = tp.Vassiliou().oscillator(block).regions[0].damping
        assert damping / block.p == pytest.approx(0.02 * 2.5**2 / math.sqrt(4.0 / 3.0), rel=1e-14)


@pytest.mark.parametrize(
    "model",
    [
        tp.DiscreteDamping(e=1.0),
        tp.DiscreteDamping(e=1.0, rest="rigid"),
        tp.EnergyConsistent(e=1.0),
        tp.ViscousDamping(0.0),
        tp.GianniniMasiani(e=1.0),
        tp.MakrisKonstantinidis(e=1.0),
        tp.Vassiliou(coefficient=0.0),
        tp.HousnerImpact(e=1.0, geometry="linear"),
        tp.HousnerImpact(e=1.0, geometry="bilinear"),
        tp.HousnerImpact(e=1.0),
    ],
    ids=label,
)
def test_energy_is_kept_without_loss(model):
    """e = 1 for over 1000 cycles: the peaks, and so the energy, stay to 1e-10."""
    x0 = 0.5 * BLOCK.alpha
    run = tp.free_rocking(BLOCK, model, x0, 1600.0, dt=0.1)
    peaks = run.peak_rotations.values
    assert peaks.size > 2000
    energy = 1.0 - (1.0 - peaks / BLOCK.alpha) ** 2
    np.testing.assert_allclose(energy, energy[0], rtol=1e-10)


@pytest.mark.parametrize("model", LAWS, ids=label)
def test_histories_satisfy_the_equation_of_motion(model):
    """theta'' = forcing - damping - restoring at the samples, against the change of the stored velocity."""
    motion = scale_to(CloughPenzien(duration=8.0, dt=0.0005).sample(1, seed=4), 2.4)
    run = tp.simulate(BLOCK, model, motion)
    omega, a, dt = run.angular_velocity.values, run.angular_acceleration.values, 0.0005
    # between two samples without an event the acceleration is as good as linear: its mean is the change of velocity
    error = np.abs(np.diff(omega) / dt - 0.5 * (a[1:] + a[:-1])) / np.abs(a).max()
    assert np.mean(error < 1e-5) > 0.97
    assert np.median(error) < 1e-6
    assert float(run.peak_rotation) >= np.abs(run.rotation.values).max()


@pytest.mark.parametrize("model", LAWS, ids=label)
def test_peak_is_between_samples_too(model):
    """A sparse record gives the peak of the same record with every sample halved ten times over."""
    rng = np.random.default_rng(5)
    record = 2.0 * shake(rng, n=400, dt=0.02)
    fine = np.interp(np.arange(399 * 16 + 1) / 16.0, np.arange(400), record)
    sparse = trace(model.oscillator(BLOCK), record, 0.02)
    dense = trace(model.oscillator(BLOCK), fine, 0.02 / 16.0)
    assert sparse.results[0] == dense.results[0]
    np.testing.assert_allclose(sparse.results[1], dense.results[1], rtol=1e-9)


@pytest.mark.parametrize("model", LAWS, ids=label)
def test_skipping_changes_no_result(model):
    rng = np.random.default_rng(6)
    factors = np.linspace(0.2, 6.0, 60)[None]
    for _ in range(10):
        record = shake(rng)
        with_skip = run_many([model.oscillator(BLOCK)], factors, record, 0.01, True)[0]
        without = run_many([model.oscillator(BLOCK)], factors, record, 0.01, False)[0]
        twin = run_many([model.oscillator(BLOCK)], factors * (1.0 + 1e-13), record, 0.01, False)[0]
        np.testing.assert_array_equal(with_skip[:, [0, 2, 3]], without[:, [0, 2, 3]])
        np.testing.assert_allclose(with_skip[:, 4], without[:, 4], rtol=1e-6)
        bound = np.maximum(1e-12 * without[:, 1], 100.0 * np.abs(twin[:, 1] - without[:, 1]))
        assert np.all(np.abs(with_skip[:, 1] - without[:, 1]) <= bound)


class TestRigidLimit:
    """delta -> 0: the discrete laws with rest="rigid" become `HousnerImpact(geometry="bilinear")`."""

    @pytest.mark.parametrize("law", [tp.DiscreteDamping, tp.EnergyConsistent])
    @pytest.mark.parametrize("lever", ["h", "R"])
    def test_first_order_on_pulses(self, law, lever):
        block = tp.Block.from_slenderness(0.25, 1.6)
        deltas = np.array([1e-3, 1e-4, 1e-5])
        errors = np.zeros(3)
        for amplitude, w in ((2.5, 5.0), (1.5, 6.0), (3.0, 8.0)):
            pulse = OneCycleSine(amplitude * G * 0.25, w * block.p, dt=1e-4, tail=3.0).sample(1)
            rigid = tp.simulate(block, tp.HousnerImpact(e=0.9, geometry="bilinear", lever=lever), pulse)
            assert not rigid.overturned
            for i, delta in enumerate(deltas):
                run = tp.simulate(block, law(e=0.9, delta=delta, lever=lever, rest="rigid"), pulse)
                errors[i] = max(errors[i], abs(float(run.peak_rotation / rigid.peak_rotation) - 1.0))
        assert 0.0 < errors[2] < 1e-4
        order = np.log10(errors[:-1] / errors[1:])
        assert np.all(np.abs(order - 1.0) < 0.15)

    @pytest.mark.slow
    def test_probabilities_agree_on_records(self):
        """30 s records are chaotic, so probabilities are compared: 400 motions, h/b = 4, R = 0.5 m, mean PGA 0.3 g."""
        block = tp.Block.from_slenderness(math.atan(0.25), 0.5)
        motions = tp.motions.scale_to_mean(tp.motions.KanaiTajimi(duration=30.0, dt=0.02).sample(400, seed=3), 1.0)
        rigid = [
            tp.HousnerImpact(geometry="bilinear", lever="R"),
            *(tp.DiscreteDamping(delta=d, lever="R", rest="rigid") for d in (1e-3, 1e-4)),
            *(tp.EnergyConsistent(delta=d, lever="R") for d in (0.05, 1e-3, 1e-4)),
        ]
        elastic = [tp.DiscreteDamping(delta=d, lever="R") for d in (0.1, 0.05, 0.01, 0.001)]
        runs = tp.ida(block, rigid + elastic, motions, np.array([0.3, 0.4]) * G, im="scale")
        p = tp.overturning_probability(runs).probability.values[0]
        reference = p[0]
        sigma = np.sqrt(reference * (1.0 - reference) / 400.0)
        assert np.all(np.abs(p[: len(rigid)] - reference) <= 3.0 * np.maximum(sigma, 0.005))
        # the elastic zone's own mode makes blocks fall that should not, and fades with delta
        falls = p[len(rigid) :, 0]
        assert np.all(np.diff(falls) < 0.0)
        assert falls[1] > 0.3
        assert reference[0] < 0.05


class TestOverturning:
    @pytest.mark.parametrize("model", LAWS, ids=label)
    def test_time_does_not_depend_on_where_the_record_ends(self, model):
        """The same motion with a quiet tail inside the record overturns at the same time."""
        compared = 0
        for block in (tp.Block.from_slenderness(0.3, 0.5), BLOCK):
            for amplitude in (15.0, 30.0, 60.0):
                record = np.array([amplitude] * 4 + [0.0])
                short = trace(model.oscillator(block), record, 0.01).results
                long = trace(model.oscillator(block), np.append(record, np.zeros(3000)), 0.01).results
                assert short[0] == long[0]
                if short[0] == 1.0:
                    assert short[4] == pytest.approx(long[4], rel=1e-9)
                    compared += 1
        assert compared >= 2

    def test_history_stays_flat(self):
        motion = OneCycleSine(8.0, 6.0, dt=0.005, tail=6.0).sample(1)
        run = tp.simulate(BLOCK, tp.HousnerImpact(), motion)
        assert run.overturned
        fallen = run.time.values >= float(run.overturning_time)
        assert fallen.sum() > 10
        np.testing.assert_array_equal(np.abs(run.rotation.values[fallen]), 0.5 * math.pi)
        assert not run.angular_velocity.values[fallen].any()
        assert float(run.peak_rotation) == 0.5 * math.pi

    @pytest.mark.parametrize("model", LAWS, ids=label)
    def test_the_separatrix_decides_after_the_record(self, model):
        """Released outward at 0.5 alpha, the speed that decides is where the damped (or exact) saddle says."""
        oscillator = model.oscillator(BLOCK)
        alpha, quiet = BLOCK.alpha, np.zeros(2)
        right = max(oscillator.regions, key=lambda region: region.upper)
        q2 = -right.stiffness
        if oscillator.exact:
            critical = 2.0 * math.sqrt(q2) * math.sin(0.25 * alpha)
        else:
            half = 0.5 * right.damping
            critical = (half + math.sqrt(half**2 + q2)) * 0.5 * alpha
        stands = trace(oscillator, quiet, 1e-9, 0.5 * alpha, critical * (1.0 - 1e-6))
        falls = trace(oscillator, quiet, 1e-9, 0.5 * alpha, critical * (1.0 + 1e-6))
        assert (stands.results[0], falls.results[0]) == (0.0, 1.0)
        assert stands.results[1] < alpha < falls.results[1]
        # the verdict holds when the quiet is part of the record instead
        long = np.zeros(4000)
        assert trace(oscillator, long, 0.01, 0.5 * alpha, critical * (1.0 - 1e-6)).results[0] == 0.0
        assert trace(oscillator, long, 0.01, 0.5 * alpha, critical * (1.0 + 1e-6)).results[0] == 1.0

    def test_makris_konstantinidis_needs_more_than_energy_says(self):
        """Outward at 0.5 alpha: 0.6771 p alpha where energy says 0.4972 (alpha = 15 degrees, e_R, delta = 0.05)."""
        block = tp.Block.from_slenderness(math.radians(15.0), 1.0)
        oscillator = tp.MakrisKonstantinidis().oscillator(block)
        unit = block.p * block.alpha
        speeds = (0.4973, 0.67705, 0.67715)
        flags = [trace(oscillator, np.zeros(2), 1e-9, 0.5 * block.alpha, v * unit).results[0] for v in speeds]
        assert flags == [0.0, 0.0, 1.0]

    def test_a_block_beyond_alpha_can_come_back(self):
        """|theta| > alpha is not overturning yet."""
        oscillator = tp.HousnerImpact(e=0.9, geometry="linear").oscillator(BLOCK)
        pulse = OneCycleSine(1.0, 5.0 * BLOCK.p, dt=1e-3, tail=5.0).sample(1)
        unit = G * BLOCK.alpha
        factors = np.linspace(2.0, 12.0, 2000) * unit
        peaks = run_many([oscillator], factors[None], pulse.values[0].copy(), float(pulse.dt[0]))[0]
        came_back = (peaks[:, 0] == 0.0) & (peaks[:, 1] > BLOCK.alpha)
        assert came_back.any()
        assert np.any(np.diff(overturns(oscillator, pulse, factors).astype(int)) < 0)


@pytest.mark.slow
def test_tables_of_any_shape():
    """Five regions without mirror symmetry (two slendernesses, a soft stop on one side) against a stiff ODE solver."""
    from scipy.integrate import solve_ivp

    q2_left, q2_right, a_left, a_right, stop = 16.0, 20.0, 0.25, 0.15, 0.05
    edge_left, edge_right = -0.02, 0.01
    k = 300.0
    # restoring moments that join: zone of stiffness k, then falling branches, then a spring beyond the stop
    low, high = k * edge_left, k * edge_right
    at_stop = high - q2_right * (stop - edge_right)
    regions = (
        Region(
            -1.5,
            edge_left,
            -q2_left,
            -q2_left * edge_left - low,
            0.3,
            0.0,
            Edge(engine.OVERTURN),
            Edge(engine.CROSS, 1),
        ),
        Region(edge_left, 0.0, k, 0.0, 1.0, 0.0, Edge(engine.CROSS, 0), Edge(engine.CROSS, 2)),
        Region(0.0, edge_right, k, 0.0, 2.0, 0.0, Edge(engine.CROSS, 1), Edge(engine.CROSS, 3)),
        Region(
            edge_right,
            stop,
            -q2_right,
            -q2_right * edge_right - high,
            0.0,
            0.0,
            Edge(engine.CROSS, 2),
            Edge(engine.CROSS, 4),
        ),
        Region(stop, 1.5, 400.0, 400.0 * stop - at_stop, 0.5, 0.0, Edge(engine.CROSS, 3), Edge(engine.OVERTURN)),
    )
    assert a_left > a_right
    oscillator = Oscillator(regions, 1.2, engine.RULE_CONSTANT, 1.0, 0.0, 1)

    def moment(theta):
        for region in regions:
            if theta <= region.upper:
                return region.stiffness * theta - region.offset, region.damping
        raise AssertionError(theta)

    rng = np.random.default_rng(7)
    dt = 0.01
    record = 4.0 * shake(rng, n=600, dt=dt)
    time = np.arange(600) * dt

    def rate(t, state):
        f, c = moment(state[0])
        return [state[1], -f - c * state[1] - 1.2 * np.interp(t, time, record)]

    state, theta = np.zeros(2), [0.0]
    for i in range(599):
        piece = solve_ivp(rate, (time[i], time[i + 1]), state, method="DOP853", rtol=1e-11, atol=1e-14, max_step=dt / 8)
        state = piece.y[:, -1]
        theta.append(state[0])
    run = trace(oscillator, record, dt)
    visited = set(run.history[2].astype(int))
    assert visited == {0, 1, 2, 3, 4}
    np.testing.assert_allclose(run.history[0], theta, rtol=0.0, atol=2e-7 * np.abs(theta).max())


def test_free_rocking_does_not_depend_on_the_output_step():
    for model in LAWS:
        runs = [tp.free_rocking(BLOCK, model, 0.6 * BLOCK.alpha, 8.0, dt=dt) for dt in (0.001, 0.0137, 0.5)]
        for run in runs[1:]:
            np.testing.assert_array_equal(run.peak_rotations.values, runs[0].peak_rotations.values)
            np.testing.assert_array_equal(run.peak_times.values, runs[0].peak_times.values)
        fine, coarse = runs[0].rotation, runs[2].rotation
        np.testing.assert_allclose(fine.values[::500][: coarse.size], coarse.values, rtol=0, atol=1e-9 * BLOCK.alpha)


def test_laws_are_values():
    """Frozen, comparable, with labels that tell options apart."""
    assert tp.DiscreteDamping() == tp.DiscreteDamping(None, 0.05, "h", "elastic")
    with pytest.raises(dataclasses.FrozenInstanceError):
        tp.DiscreteDamping().delta = 0.1
    assert tp.DiscreteDamping(e=0.92).label == "discrete e=0.92 δ=0.05"
    options = tp.DiscreteDamping(rest="rigid", lever="R").label.split()
    assert options == ["discrete", "e=e_R", "δ=0.05", "lever=R", "rest=rigid"]
    assert tp.HousnerImpact(restitution_factor=0.95).label == "housner e=0.95·e_R"
    assert tp.Vassiliou(coefficient=0.03).label == "vassiliou δ=0.05 coefficient=0.03"
    assert len({law.label for law in LAWS}) == len(LAWS)
    assert tp.ViscousDamping.fema356(0.9).zeta == pytest.approx(0.04)


def captured_from_one_side(side):
    """A zone whose turns hand over to another region on one side only, and its mirror image."""
    k = 300.0
    other = Region(-1.5, 1.5, 80.0, 0.0, 0.4, 0.0, Edge(engine.OVERTURN), Edge(engine.OVERTURN))
    taker = {"turn_left": 1} if side < 0 else {"turn_right": 1}
    zone = Region(-1.5, 1.5, k, 0.0, 0.1, 0.0, Edge(engine.OVERTURN), Edge(engine.OVERTURN), False, **taker)
    return Oscillator((zone, other), 1.2, engine.RULE_CONSTANT, 1.0, 0.0, 0)


def test_captures_on_either_side():
    record = shake(np.random.default_rng(10), n=400)
    left, right = (trace(captured_from_one_side(side), -side * record, 0.01) for side in (-1, 1))
    np.testing.assert_array_equal(left.history[0], -right.history[0])
    np.testing.assert_array_equal(left.history[2], right.history[2])
    assert set(left.history[2].astype(int)) == {0, 1}


def test_a_zone_with_a_static_offset_is_not_skipped():
    """Its response is not proportional to the factor, so skipping must leave it alone."""
    zone = Region(-0.02, 0.02, 300.0, 1.0, 0.1, 0.0, Edge(engine.CROSS, 1), Edge(engine.CROSS, 2))
    left = Region(-1.5, -0.02, -16.0, 7.32, 0.1, 0.0, Edge(engine.OVERTURN), Edge(engine.CROSS, 0))
    right = Region(0.02, 1.5, -16.0, -5.32, 0.1, 0.0, Edge(engine.CROSS, 0), Edge(engine.OVERTURN))
    oscillator = Oscillator((zone, left, right), 1.2, engine.RULE_CONSTANT, 1.0, 0.0, 0)
    record = shake(np.random.default_rng(11), n=400)
    factors = np.linspace(0.1, 6.0, 40)[None]
    one, other = (run_many([oscillator], factors, record, 0.01, skip)[0] for skip in (True, False))
    np.testing.assert_array_equal(one, other)


def test_refused(refusal):
    refusal()
