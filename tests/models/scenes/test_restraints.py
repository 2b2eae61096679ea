"""Restraints: energy of rupture, critical pulses, tendons and adhesives, in normalised units and in real sizes."""

import math

import numpy as np
import pytest
from scene_cases import SMALL, critical, front_and_back, sine, table
from shared_cases import shake

import toppling as tp
from toppling.models.assembly import Spring, Surroundings
from toppling.models.laws import oscillator_of
from toppling.models.outputs import OF_ENGINE
from toppling.models.runs import run_many, trace

BROKEN, FRONT = OF_ENGINE["ruptured"], OF_ENGINE["peak_front"]
QUIET = np.zeros(2)
CASES = [(20.0, 0.0, 0.05), (20.0, 0.02, 0.07), (200.0, 0.01, 0.03), (0.5, 0.1, 0.6)]


def strap(stiffness, taut, breaks, preload=0.0):
    return Surroundings(front_spring=Spring(stiffness, taut, breaks, preload, 0.0))


def both(stiffness, taut, breaks, preload=0.0, strength=0.0):
    spring = Spring(stiffness, taut, breaks, preload, strength)
    return Surroundings(front_spring=spring, back_spring=spring)


def boundary(holds, low, high):
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if holds(middle) else (low, middle)
    return 0.5 * (low + high)


class TestRupture:
    @pytest.mark.parametrize(("stiffness", "taut", "breaks"), CASES)
    def test_release_speeds(self, stiffness, taut, breaks):
        """It breaks where v² >= 2U(breaks), and falls where v² > 1 + stiffness (breaks - taut)²."""
        oscillator = table(0.9, strap(stiffness, taut, breaks))

        def result(speed):
            return trace(oscillator, QUIET, 1e-3, 0.0, speed).results

        stretch = breaks - taut
        rupture = math.sqrt(2.0 * breaks - breaks**2 + stiffness * stretch**2)
        found = boundary(lambda speed: result(speed)[BROKEN] == 0.0, 0.05, 1.2)
        assert found == pytest.approx(rupture, rel=1e-12)
        falls = boundary(lambda speed: result(speed)[0] == 0.0, 0.9, 1.2)
        assert falls == pytest.approx(math.sqrt(1.0 + stiffness * stretch**2), rel=1e-12)

    @pytest.mark.parametrize(("omega", "case", "expected"), [
        (1.0, 0, 1.587605951063), (1.0, 1, 1.444920897240), (1.0, 2, 3.354271801020),
        (3.0, 0, 2.484459484856), (3.0, 1, 2.412281255969), (3.0, 2, 2.816038387001),
    ])  # fmt: skip
    def test_half_sine(self, omega, case, expected):
        found = critical(table(0.9, strap(*CASES[case])), sine(omega, 1, -1.0), 1.05, 12.0)
        assert found == pytest.approx(expected, abs=5e-10)

    @pytest.mark.parametrize(("omega", "free"), [(1.0, 1.3223965979), (3.0, 2.2938723134)])
    def test_no_strength_is_no_restraint(self, omega, free):
        found = critical(table(0.9, strap(20.0, 0.0, 1e-9)), sine(omega, 1, -1.0), 1.05, 4.0)
        assert found == pytest.approx(free, abs=3e-9)

    @pytest.mark.parametrize(("stiffness", "slack", "expected"), [
        (200e3, 0.0, 6.241040152), (20e3, 0.0, 4.923596911), (20e3, 0.005, 3.908156812), (None, 0.0, 3.085563481),
    ])  # fmt: skip
    def test_bookcase_against_a_wall(self, stiffness, slack, expected):
        """100 kg, 0.30 × 1.80 m, touching wall, 267 N at 1.75 m: one cycle of 1 Hz towards the wall first, m/s²."""
        restraint = None if stiffness is None else tp.Restraint.strap(1.75, 267.0, stiffness, slack)
        block = tp.Block(0.3, 1.8, mass=100.0, wall=tp.Wall(), restraint=restraint)
        oscillator = tp.HousnerImpact(geometry="linear").oscillator(block)
        found = critical(oscillator, sine(2.0 * math.pi, 2, 1.0), expected - 0.2, expected + 0.2)
        assert found == pytest.approx(expected, abs=3e-9)

    def test_it_holds_just_below(self):
        block = tp.Block(0.3, 1.8, mass=100.0, wall=tp.Wall(), restraint=tp.Restraint.strap(1.75, 267.0, 200e3))
        oscillator = tp.HousnerImpact(geometry="linear").oscillator(block)
        peaks = []
        for samples in (8000, 16_000):  # (chords of a sine are wrong by the square of the step)
            record, dt = sine(2.0 * math.pi, 2, 1.0)(samples)
            result = run_many([oscillator], np.full((1, 1), 6.0), record, dt)[0, 0]
            assert result[BROKEN] == 0.0
            peaks.append(result[FRONT])
        assert peaks[1] + (peaks[1] - peaks[0]) / 3.0 == pytest.approx(0.000722451053, abs=5e-13)


class TestKinds:
    @pytest.mark.parametrize(("beta", "omega", "expected"), [
        (0.25, 1.0, 1.3710889433), (0.25, 3.0, 2.3055769193), (1.0, 1.0, 2.0), (1.0, 3.0, 2.4853645333),
    ])  # fmt: skip
    def test_adhesive(self, beta, omega, expected):
        """Rigid until beta times the moment of the weight is added: closed form of the half sine."""
        oscillator = table(0.9, both(math.inf, 0.0, 0.0, strength=beta))
        found = critical(oscillator, sine(omega, 1, -1.0), 1.05, 5.0, samples=64_000)
        assert found == pytest.approx(expected, abs=5e-10)

    def test_tendon(self):
        """The same block with p' = sqrt(q² - k) and alpha' = (1 + pi0)/(q² - k)."""
        oscillator = table(0.9, both(0.3, 0.0, math.inf, 0.2 * SMALL), SMALL)
        found = critical(oscillator, sine(3.0, 1, -1.0), 1.05 * SMALL, 5.0 * SMALL)
        assert found / SMALL == pytest.approx(3.1016010062, abs=3e-9)

    def test_an_unbreakable_strap_never_lets_it_fall_to_the_front(self):
        """A saddle below the strap is not the end: 1 - sqrt(1 - 0.81·1.0199) to the back, in 2 samples or 3,000."""
        oscillator = table(0.9, strap(400.0, 0.02, math.inf))
        for samples in (2, 3000):
            run = trace(oscillator, np.zeros(samples), 0.01, 0.01, 1.0)
            assert run.results[0] == 0.0
            assert run.results[OF_ENGINE["peak_back"]] == pytest.approx(0.583009592436, abs=5e-13)

    def test_hangs_on_a_strap_with_much_slack(self):
        """Taut beyond alpha: it falls into the strap, and stays there."""
        run = trace(table(0.9, strap(2.0, 1.5 * SMALL, math.inf), SMALL), np.zeros(2), 0.01, 1.2 * SMALL, 0.0)
        assert run.results[0] == 0.0
        assert run.results[OF_ENGINE["final_state"]] == 1.0

    def test_both_directions_break_together(self):
        record = shake(np.random.default_rng(8))
        result = run_many([table(0.9, both(50.0, 0.0, 0.02))], np.linspace(1.0, 9.0, 30)[None], record, 0.01)[0]
        broken = result[:, BROKEN] == 1.0
        assert broken.any()
        assert not broken.all()
        assert (np.isfinite(result[:, OF_ENGINE["rupture_time"]]) == broken).all()
        assert (result[~broken][:, [FRONT, OF_ENGINE["peak_back"]]] < 0.02).all()

    def test_after_the_rupture_it_is_the_free_block(self):
        """From the state at its rupture on, a strapped block moves as a free one does, to rounding."""
        record = 3.0 * shake(np.random.default_rng(2))
        run = trace(table(0.9, strap(30.0, 0.0, 0.03)), record, 0.01)
        start = math.ceil(run.results[OF_ENGINE["rupture_time"]] / 0.01)
        theta, omega = run.history[:2, start]
        free = trace(table(0.9), record[start:], 0.01, theta, omega)
        assert run.history[0, start:] == pytest.approx(free.history[0], abs=1e-9)


@pytest.mark.parametrize("stiffness", [1.6e4, 2e4, 2.2e4, 2.5e4])
def test_stiff_straps_of_light_blocks_do_not_depend_on_the_samples(stiffness):
    """Below and above the limit of the pieces of degree 12 (sqrt(K) dt of 0.26 to 0.32): samples halved, same runs."""
    restraint = tp.Restraint.strap(0.675, strength=1e9, stiffness=stiffness)
    oscillator = oscillator_of(tp.Block(0.12, 0.75, mass=14.4, restraint=restraint), tp.HousnerImpact(0.9, "linear"))
    drawn = np.random.default_rng(3).standard_normal(400)
    record = 4.0 * np.convolve(drawn, np.ones(6) / 6.0, "same")
    halved = np.interp(np.arange(2 * record.size - 1) / 2.0, np.arange(record.size), record)
    factors = np.linspace(0.5, 3.0, 60)[None]
    runs = [run_many([oscillator], factors, one, dt, skip=False)[0] for one, dt in ((record, 0.005), (halved, 0.0025))]
    first, second = (one[:, OF_ENGINE["peak_rotation"]] for one in runs)
    difference = np.abs(first / second - 1.0)
    assert 0.3 < runs[0][:, OF_ENGINE["overturned"]].mean() < 0.9
    assert np.quantile(difference, 0.9) < 1e-12
    assert difference.max() < 1e-6  # (what a rounding becomes over some hundred bounces)


@pytest.mark.parametrize(
    ("restraint", "sides"),
    [
        (tp.Restraint.strap(1.7), (1.7, None)),
        (tp.Restraint.cable(1.7, 500.0), (1.7, None)),
        (tp.Restraint.bracket(1.7, 500.0), (1.7, 1.7)),
        (tp.Restraint.pole(100.0, 500.0, 1e5, 0.3, 0.1), (0.3, 0.1)),
        (tp.Restraint.tendon(1e5, width=0.4), (0.2, 0.2)),
        (tp.Restraint.adhesive(500.0, 0.3), (0.3, 0.3)),
        (tp.Restraint.adhesive(500.0, 0.3, 0.1), (0.3, 0.1)),
    ],
)
def test_sides_of_the_class_methods(restraint, sides):
    assert (restraint.front, restraint.back) == sides


class TestRandom:
    @pytest.mark.parametrize("seed", range(4))
    def test_no_action_adds_energy(self, seed):
        """After the record the peaks of each side fall; a run without shaking ends at rest or on the ground."""
        rng = np.random.default_rng(seed)
        for _ in range(60):
            around = both(*sorted_spring(rng)) if rng.random() < 0.5 else strap(*sorted_spring(rng))
            run = trace(table(0.95, around), np.zeros(4000), 0.01, 0.0, rng.uniform(0.1, 1.2), max_turning_points=200)
            turns = run.turning_points[1]
            for side in (turns[turns > 0.0], -turns[turns < 0.0]):
                assert (np.diff(side) <= 1e-12).all()

    def test_hostile_restraints_end(self):
        record = 6.0 * shake(np.random.default_rng(3))
        for restraint in (
            tp.Restraint.strap(1.75, 267.0, 1e9),
            tp.Restraint.strap(1.75, 1e-9, 2e4),
            tp.Restraint.bracket(1.75, math.inf, 1e9),
            tp.Restraint.tendon(1e7, width=0.3, preload=1e5),
            tp.Restraint.adhesive(1e-9, 0.28),
        ):
            block = tp.Block(0.3, 1.8, mass=100.0, wall=tp.Wall(1e-6, restitution=1.0), restraint=restraint)
            oscillator = tp.HousnerImpact(geometry="bilinear").oscillator(block)
            found = front_and_back(oscillator, record, np.linspace(0.1, 2.0, 12)[None])
            assert np.isfinite(found).all()


def sorted_spring(rng):
    taut = rng.choice([0.0, rng.uniform(0.001, 0.2)])
    return rng.uniform(0.2, 300.0), taut, taut + rng.uniform(0.01, 0.4)


class TestWell:
    def test_a_rupture_beyond_the_saddle_does_not_count_before_it(self):
        """Released before the saddle at 0.2 it stays there, though its energy is above that of the rupture at 0.45."""
        oscillator = table(0.9, both(0.5, 0.0, 4.5 * SMALL), SMALL)
        results = trace(oscillator, QUIET, 1e-3, SMALL).results
        assert [results[OF_ENGINE[name]] for name in ("overturned", "ruptured", "final_state")] == [0.0, 0.0, 0.0]


def test_refused(refusal):
    refusal()
