"""The sliding engine held to runs of 40 digits, and to a second engine in doubles over 100,000 random runs."""

from pathlib import Path

import mpmath
import numpy as np
import pytest
import slide_kernel as other
from plain_selection import plain_slides, without_compiler
from slide_cases import cases, stored
from slide_reference import NAMES, solve
from slide_scan import scan

from toppling.models.outputs import SLIDES
from toppling.models.sliding.runs import ONE_WAY, run_sliders
from toppling.models.sliding_engine import sample, tables

COLUMNS = {
    "forward": SLIDES["slide_forward"],
    "backward": SLIDES["slide_backward"],
    "residual": SLIDES["slide_residual"],
    "path": SLIDES["slide_path"],
    "velocity": SLIDES["slide_velocity"],
    "slips": SLIDES["slips"],
    "first": SLIDES["first_slip_time"],
    "after": SLIDES["slide_after"],
}
SLIPS, FIRST = SLIDES["slips"], SLIDES["first_slip_time"]
KINDS = list(dict.fromkeys(case.name for case in cases()))
LARGEST = {"velocity": "velocity", "path": "path", "after": "path"}
"""Results over which errors are taken: the velocity, the way, and the larger of the two slips for the rest."""


def engine(case):
    friction = np.minimum([[*case.static, *case.kinetic]], ONE_WAY)
    vertical = None if case.vertical is None else np.array(case.vertical)
    return run_sliders(friction, np.array([[case.factor]]), np.array(case.record), vertical, case.dt)[0, 0]


def scales(row):
    """What the errors of a run are relative to, by name: a run that stays has no error at all."""
    values = {name: abs(float(row[name])) for name in NAMES}
    peak = max(values["forward"], values["backward"])
    return {name: values[LARGEST[name]] if name in LARGEST else peak for name in NAMES}


class TestFortyDigits:
    @pytest.mark.parametrize("kind", KINDS)
    def test_engine(self, kind):
        """Within 1e-13 of the largest slip; every slip is counted, and the first begins to the last digit."""
        runs = [(case, row) for case, row in zip(cases(), stored(), strict=True) if case.name == kind]
        for case, row in runs:
            found, scale = engine(case), scales(row)
            assert found[SLIPS] == float(row["slips"]), case
            np.testing.assert_allclose(found[FIRST], float(row["first"]), rtol=1e-14)
            for name in NAMES:
                if name not in ("slips", "first"):
                    assert abs(found[COLUMNS[name]] - float(row[name])) <= 1e-13 * scale[name], (name, case)

    def test_there_are_enough_runs_of_every_sort(self):
        rows = stored()
        assert len(rows) >= 300
        assert sum(float(row["slips"]) == 0 for row in rows) > 5
        assert sum(float(row["slips"]) > 10 for row in rows) > 50
        assert sum(float(row["after"]) > 0 for row in rows) > 10
        assert sum(float(row["first"]) == 0 for row in rows) > 10

    @pytest.mark.slow
    def test_stored_digits_are_right(self):
        """More working digits give the same forty."""
        for case, row in list(zip(cases(), stored(), strict=True))[::13]:
            found = solve(*case[1:], digits=90)
            for name in NAMES:
                with mpmath.workdps(90):
                    if row[name] != "nan":
                        error = abs(found[name] - mpmath.mpf(row[name]))
                        assert error <= 1e-38 * abs(found[name]) + 1e-45


class TestManyRuns:
    @pytest.mark.slow
    @pytest.mark.parametrize("part", range(4))
    def test_results_and_energy_are_those_of_a_second_engine(self, part):
        """What the floor gives, -u'' v, is what friction takes, run by run; and that engine has the same slips."""
        runs = 0
        for seed in range(100 * part, 100 * part + 100):
            record, vertical, dt, friction, factors = scan(seed)
            found = run_sliders(friction, factors[:, None], record, vertical, dt)[:, 0]
            own = other.runs(record, np.empty(0) if vertical is None else vertical, dt, friction, factors)
            np.testing.assert_array_equal(found[:, SLIPS], own[:, other.SLIPS])
            np.testing.assert_array_equal(np.isnan(found[:, FIRST]), found[:, SLIPS] == 0.0)
            np.testing.assert_allclose(found[:, FIRST], own[:, other.FIRST], rtol=1e-9)
            peak = np.maximum(own[:, other.FORWARD], own[:, other.BACKWARD])
            for name, column, scale in (
                ("slide_peak", None, peak),
                ("slide_forward", other.FORWARD, peak),
                ("slide_backward", other.BACKWARD, peak),
                ("slide_residual", other.RESIDUAL, peak),
                ("slide_path", other.PATH, own[:, other.PATH]),
                ("slide_velocity", other.SPEED, own[:, other.SPEED]),
                ("slide_after", other.AFTER, own[:, other.PATH]),
            ):
                expected = peak if column is None else own[:, column]
                assert (np.abs(found[:, SLIDES[name]] - expected) <= 1e-10 * scale).all(), (name, seed)
            given, taken = own[:, other.GIVEN], own[:, other.TAKEN]
            np.testing.assert_allclose(taken, given, rtol=1e-10, atol=1e-25)
            alike = friction[:, 2] == friction[:, 3]
            if vertical is None:
                work = friction[:, 2] * tables.GRAVITY * found[:, SLIDES["slide_path"]]
                np.testing.assert_allclose(work[alike], given[alike], rtol=1e-10, atol=1e-25)
            runs += factors.size
        assert runs >= 25_000

    def test_lanes_skips_and_cuts_change_nothing(self):
        """A run is the same alone and among others, with every sample or without those that need none.

        Between two samples the acceleration is a straight line: a sample in its middle changes rounding alone.
        """
        samples, tally = 0, np.zeros(5, np.int64)
        for seed in range(120):
            record, vertical, dt, friction, factors = scan(seed)
            given = friction, factors[:, None], record, vertical, dt
            found, whole = (run_sliders(*given, skip, tally)[:, 0] for skip in (True, False))
            samples += 2 * factors.size * record.size
            np.testing.assert_array_equal(found, whole)
            for j in (0, 131, 255):
                alone = run_sliders(friction[j : j + 1], factors[j : j + 1, None], record, vertical, dt)[0]
                np.testing.assert_array_equal(found[j : j + 1], alone)
            at = np.arange(2 * record.size - 1) / 2.0
            halved, upward = (
                None if one is None else np.interp(at, np.arange(record.size), one) for one in (record, vertical)
            )
            cut = run_sliders(friction, factors[:, None], halved, upward, dt / 2.0)[:, 0]
            np.testing.assert_allclose(
                cut[:, SLIDES["slide_path"]], found[:, SLIDES["slide_path"]], rtol=1e-9, atol=1e-22
            )
        assert tally[0] == samples
        assert tally[1] > 0.05 * samples

    def test_ways_are_consistent(self):
        for seed in range(120):
            record, vertical, dt, friction, factors = scan(seed)
            found = run_sliders(friction, factors[:, None], record, vertical, dt)[:, 0]
            peak, forward, backward, residual, path = (
                found[:, SLIDES[f"slide_{name}"]] for name in ("peak", "forward", "backward", "residual", "path")
            )
            rounding = 1e-13 * path
            np.testing.assert_array_equal(peak, np.maximum(forward, backward))
            assert (path >= np.abs(residual) - rounding).all()
            assert (path >= forward + backward - rounding).all()
            assert (residual <= forward).all()
            assert (residual >= -backward).all()
            assert (found[:, SLIPS] <= 3 * record.size).all()
            assert ((path > 0.0) == (found[:, SLIPS] > 0.0)).all()

    @pytest.mark.parametrize("size", [5e-324, 1e-310, 1e-160, 1e-20, 1e9])
    @pytest.mark.parametrize("dt", [1e-9, 1e-4, 1e3])
    def test_extreme_sizes_have_results(self, size, dt):
        """Accelerations from the least float to the largest that motions may have, over all allowed friction."""
        rng = np.random.default_rng(3)
        record, vertical = rng.normal(size=200) * size, rng.uniform(-9.0, 9.0, 200)
        friction = np.array([[mu, top, mu, mu] for mu in (1e-9, 0.3, 10.0) for top in (mu, ONE_WAY)])
        for up in (None, vertical):
            found = run_sliders(friction, np.ones((6, 1)), record, up, dt)[:, 0]
            assert np.isfinite(np.delete(found, FIRST, axis=1)).all()
            assert (found[:, SLIDES["slide_path"]] >= 0.0).all()


class TestTies:
    """Round numbers, of which rounding may not decide."""

    def test_a_stop_at_the_very_end_of_a_sample(self):
        """A block that stops with a sample turns round at once, or stays, as the next sample has it."""
        hold = 0.25 * tables.GRAVITY
        friction = np.full((1, 4), 0.25)
        # under -3 hold for one sample, then 5 hold after a jump within one: v = dt hold (2 - 2) = 0 where u'' is 5 hold
        back = [-3 * hold, -3 * hold, 5 * hold, -hold, 0.0, 0.0]
        # … and below the threshold, for the samples 4 and 5
        rest = [-3 * hold, -3 * hold, hold, hold, 0.0, 0.0]
        for record, slips, dt in ((back, 2, 0.1), (back, 2, 0.03), (rest, 1, 0.1), (rest, 1, 0.03)):
            found = run_sliders(friction, np.ones((1, 1)), np.array(record), None, dt)[0, 0]
            exact = solve(record, dt, (0.25, 0.25), (0.25, 0.25))
            assert found[SLIPS] == exact["slips"] == slips
            for name in ("forward", "residual", "path", "velocity", "after"):
                np.testing.assert_allclose(found[COLUMNS[name]], float(exact[name]), rtol=1e-14)

    @pytest.mark.slow
    def test_accelerations_on_the_thresholds(self):
        """Random multiples of the acceleration that just starts the block, by powers of two: stops lie on samples.

        Where a speed only touches zero it takes more than doubles to tell whether the block stops there and has to
        break away anew: those runs, some per cent, are left out.
        """
        rng = np.random.default_rng(11)
        multiples = np.array([-4.0, -2.0, -1.0, 0.0, 0.5, 1.0, 2.0, 4.0])
        friction = np.array([[0.25, 0.25, k, k] for k in (0.25, 0.125, 0.2)] + [[0.5, 0.5, 0.25, 0.25]])
        decided = 0
        for _ in range(1000):
            record = np.append(0.25 * tables.GRAVITY * rng.choice(multiples, 60), np.zeros(100))
            dt = float(rng.choice([0.01, 0.03125, 0.1]))
            found = run_sliders(friction, np.ones((4, 1)), record, None, dt)[:, 0]
            own = other.runs(record, np.empty(0), dt, friction, np.ones(4))
            sure = own[:, other.MARGIN] > 1e-12
            decided += sure.sum()
            for name, column in (("path", other.PATH), ("residual", other.RESIDUAL), ("velocity", other.SPEED)):
                np.testing.assert_allclose(found[sure, COLUMNS[name]], own[sure, column], rtol=1e-9, atol=1e-12)
            np.testing.assert_array_equal(found[sure, SLIPS], own[sure, other.SLIPS])
        assert decided > 2000

    def test_a_peak_one_rounding_above_the_threshold_is_a_slip(self):
        hold = 0.25 * tables.GRAVITY
        friction = np.full((1, 4), 0.25)
        for peak, slips in ((hold, 0), (np.nextafter(hold, 9.0), 1), (np.nextafter(hold, 0.0), 0)):
            for skip in (True, False):
                record = np.array([0.0, 0.0, -peak, 0.0, 0.0])
                assert run_sliders(friction, np.ones((1, 1)), record, None, 0.013, skip)[0, 0, SLIPS] == slips


@pytest.mark.slow
def test_a_sample_has_four_events_at_most(monkeypatch):
    """The bound of the engine's loop is never reached: slides and stops of 20,000 random samples."""
    follow, move = getattr(sample.follow_sample, "py_func", sample.follow_sample), sample.move
    calls = []
    monkeypatch.setattr(sample, "move", lambda *arguments: calls.append(0) or move(*arguments))
    rng = np.random.default_rng(5)
    x = np.zeros(tables.ROWS * tables.LANES)
    most = 0
    for _ in range(20_000):
        x[:] = 0.0
        x[tables.FACTOR] = 1.0
        static = rng.choice([0.01, 0.1, 0.5], 2)
        x[[tables.STATIC_FRONT, tables.STATIC_BACK]] = static
        x[[tables.KINETIC_FRONT, tables.KINETIC_BACK]] = static * rng.choice([0.1, 0.5, 1.0])
        sign = rng.choice([-1.0, 0.0, 1.0])
        if sign != 0.0:
            sample.begin(x, 0, sign, 0.0, 0.02)
            x[tables.SPEED] = rng.choice([0.0, 1e-18, 1e-3, 0.01, 0.1])
        a0, a1 = rng.choice([-20.0, -5.0, -1.0, -0.1, 0.0, 0.1, 1.0, 5.0, 20.0], 2)
        g0, g1 = rng.choice([1e-3, 1.0, 9.80665, 20.0], 2)
        calls.clear()
        follow(x, 0, 0.0, a0, a1, g0, g1, 0.02, None)
        most = max(most, len(calls))
    assert 3 <= most <= 4 < tables.EVENTS


@pytest.mark.slow
def test_plain_python():
    """NUMBA_DISABLE_JIT=1: the same results to the last bit, and no function of the engine left unused."""
    plain, unused = without_compiler(plain_slides, Path(tables.__file__).parent)
    assert plain == plain_slides()
    assert unused == set()
