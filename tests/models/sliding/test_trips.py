"""Velocities at which slides meet an obstacle, and the criterion of a trip: closed forms, 40 digits, identities."""

import math

import numpy as np
import pytest
from slide_cases import cases, stored
from slide_reference import speed_at
from slide_scan import scan

import toppling as tp
from toppling.models.outputs import COLUMNS, SLIDES
from toppling.models.sliding.law import Slider
from toppling.models.sliding.runs import friction_table, run_sliders
from toppling.models.sliding.trip import tripping_velocity, trips

G = 9.80665
MET, PEAK = COLUMNS["trip_velocity"], SLIDES["slide_peak"]


def met(record, dt, obstacle, static, kinetic=None, factor=1.0, vertical=None):
    kinetic = static if kinetic is None else kinetic
    table = friction_table([Slider(static, static, kinetic, kinetic, obstacle)])
    return run_sliders(table, np.array([[factor]]), np.asarray(record, float), vertical, dt)[0, 0, MET]


class TestClosedForms:
    @pytest.mark.parametrize("share", [0.01, 0.3, 0.49, 0.51, 0.8, 0.999])
    @pytest.mark.parametrize("side", [1.0, -1.0])
    @pytest.mark.parametrize("kinetic", [0.3, 0.25])
    def test_rectangular_pulse(self, share, side, kinetic):
        """v² = 2 (a - mu g) s under the pulse, and v² = 2 mu g (s_end - s) after it, when the record is over."""
        push, t1, drag = 2.0 * 0.3 * G, 0.5, kinetic * G
        end = 0.5 * (push - drag) * t1**2 * (1.0 + (push - drag) / drag)
        at = share * end
        expected = min(2.0 * (push - drag) * at, 2.0 * drag * (end - at))
        found = met([-side * push] * 51, 0.01, at, 0.3, kinetic)
        assert found == pytest.approx(math.sqrt(expected), rel=1e-11)

    def test_rising_push(self):
        """u'' = -(mu g + k t) from t = 0: v = k t²/2 and s = k t³/6 in one sample, so that v = (9 k s²/2)^(1/3)."""
        record = [-0.3 * G, -0.3 * G - 2.0]
        slip = 2.0 / 6.0
        for at in (1e-6, 0.01, 0.2, 0.33):
            assert at < slip
            assert met(record, 1.0, at, 0.3) == pytest.approx((9.0 * 2.0 * at**2 / 2.0) ** (1.0 / 3.0), rel=1e-12)

    def test_never_met(self):
        push = 2.0 * 0.3 * G
        assert math.isnan(met([-push] * 51, 0.01, 0.74, 0.3))  # (it slides 0.7355 m)
        assert math.isnan(met(np.zeros(20), 0.01, 1e-9, 0.3))

    def test_the_first_meeting_counts_and_not_the_fastest(self):
        """Gently to the front, hard to the back: the obstacle in front is met first."""
        soft, hard = [-0.4 * G] * 40 + [0.0] * 60, [1.5 * G] * 60 + [0.0] * 300
        both = met(soft + hard, 0.01, 0.02, 0.3)
        assert both == met(soft + [0.0] * 360, 0.01, 0.02, 0.3)
        assert both < 0.3 * met([0.0] * 100 + hard, 0.01, 0.02, 0.3)


class TestFortyDigits:
    @pytest.mark.slow
    def test_against_the_reference(self):
        """Short runs of every kind, the obstacle at a third and nine tenths of the greatest slip."""
        rows = [
            (case, float(row["forward"]), float(row["backward"])) for case, row in zip(cases(), stored(), strict=True)
        ]
        some = [
            one for one in rows if len(one[0].record) <= 130 and max(one[1:]) > 1e-6 and math.inf not in one[0].static
        ]
        compared = 0
        for case, *ends in some[::2]:
            for share in (0.33, 0.9):
                at = share * max(ends)
                expected = speed_at(at, case[1:])
                table = np.array([[*case.static, *case.kinetic, at]])
                vertical = None if case.vertical is None else np.array(case.vertical)
                found = run_sliders(table, np.array([[case.factor]]), np.array(case.record), vertical, case.dt)[
                    0, 0, MET
                ]
                assert found == pytest.approx(float(expected), rel=1e-11), (case, share)
                compared += 1
        assert compared > 80


class TestIdentities:
    @pytest.mark.parametrize("part", range(12))
    def test_other_results_are_those_without_an_obstacle(self, part):
        record, vertical, dt, friction, factors = scan(part)
        plain = run_sliders(friction, factors[:, None], record, vertical, dt)[:, 0]
        at = np.maximum(0.5 * plain[:, PEAK], 1e-12)
        found = run_sliders(np.column_stack([friction, at]), factors[:, None], record, vertical, dt)[:, 0]
        np.testing.assert_array_equal(found[:, : plain.shape[1]], plain)
        passed = plain[:, PEAK] > at
        np.testing.assert_array_equal(np.isfinite(found[:, MET]), passed)
        assert (found[passed, MET] <= plain[passed, SLIDES["slide_velocity"]] * (1.0 + 1e-12)).all()
        whole = run_sliders(np.column_stack([friction, at]), factors[:, None], record, vertical, dt, skip=False)[:, 0]
        np.testing.assert_array_equal(found, whole)

    @pytest.mark.parametrize("part", range(0, 12, 2))
    def test_scaling(self, part):
        """v(f u'', mu, d) = f v(u'', mu/f, d/f), and mirror symmetry: obstacles stand on both sides."""
        record, vertical, dt, friction, _ = scan(part)
        if vertical is not None:
            vertical = None
        factors = np.full((friction.shape[0], 1), 2.0)
        both = np.column_stack([np.minimum(friction[:, :1], friction[:, 1:2])] * 2 + [friction[:, 2:3]] * 2)
        both[:, 2:] = np.minimum(both[:, 2:], both[:, :1])
        at = np.maximum(0.6 * run_sliders(both, factors, record, None, dt)[:, 0, PEAK], 1e-12)
        found = run_sliders(np.column_stack([both, at]), factors, record, None, dt)[:, 0, MET]
        scaled = run_sliders(np.column_stack([0.5 * both, 0.5 * at]), factors / 2.0, record, None, dt)[:, 0, MET]
        np.testing.assert_allclose(2.0 * scaled, found, rtol=1e-9, atol=1e-12)
        mirrored = run_sliders(np.column_stack([both, at]), factors, -record, None, dt)[:, 0, MET]
        np.testing.assert_array_equal(mirrored, found)

    def test_where_the_weight_is_taken_nothing_is_known(self):
        up = np.full(51, -10.0)
        assert math.isnan(met([-6.0] * 51, 0.01, 0.1, 0.3, vertical=up))


class TestCriterion:
    def test_energy_at_the_foot(self):
        """Angular momentum about the foot, then the energy of the balance, from the sizes alone."""
        for block in (tp.Block(0.4, 1.8), tp.Block(0.6, 1.0, cm_height=0.3, inertia_factor=1.2), tp.Block(1.0, 0.2)):
            v, m = tripping_velocity(block), 70.0
            inertia = block.inertia_factor * m * (block.b**2 + block.h**2)
            omega = m * v * block.h / inertia
            lifted = m * G * (math.hypot(block.b, block.h) - block.h)
            assert 0.5 * inertia * omega**2 == pytest.approx(lifted, rel=1e-12)

    def test_a_rocking_run_from_that_rate_overturns(self):
        """`simulate` begins to rock with omega = v h/(lambda R²): just above it falls, just below it stands."""
        block = tp.Block(0.4, 1.8)
        quiet = tp.motions.from_array(np.zeros(2000), dt=0.01)
        for times, falls in ((1.0001, True), (0.9999, False)):
            omega = times * tripping_velocity(block) * block.h / (block.inertia_factor * block.R**2)
            run = tp.simulate(block, tp.HousnerImpact(), quiet, theta0=1e-9, omega0=omega)
            assert bool(run["overturned"]) is falls

    def test_flags(self):
        block = tp.Block(0.4, 1.8)
        v = tripping_velocity(block)
        assert trips(block, np.array([v, 0.999999 * v, np.nan, 0.0])).tolist() == [True, False, False, False]
