"""Sliding in the plane of the floor: against one direction, a turned floor, a closed form and SciPy's DOP853."""

import numpy as np
import pytest
from slide_in_plane_reference import slide
from slip_in_plane import peak_in_plane

import toppling as tp
from toppling.models.outputs import SLIDES
from toppling.models.runs import run_specimens, stacked
from toppling.models.sliding.law import PlaneSlider, Slider
from toppling.models.sliding.runs import IN_PLANE, friction_table, plane_table, run_in_plane, run_sliders
from toppling.models.sliding_engine import plane_tables
from toppling.motions.arrays import Record

G = 9.80665
ONE = np.ones((1, 1))
NAMES = [*SLIDES]
SCALAR = [SLIDES[name] for name in NAMES if name not in ("slide_forward", "slide_backward", "slide_residual")]
ALONG, ACROSS = IN_PLANE.values()


def noise(number=4, seed=0, duration=6.0, size=6.0):
    """Records (motion, component, time) of a greatest acceleration, which end at rest."""
    made = tp.motions.pad(tp.motions.CloughPenzien(duration=duration, dt=0.01).sample(2 * number, seed=seed), 0.0, 1.0)
    values = made.values.reshape(number, 2, -1)
    return size * values / np.abs(values).max(axis=(1, 2), keepdims=True)


def table(static, ratio=1.0):
    return plane_table([PlaneSlider(static, ratio * static)]).friction


def run(x, y, static, ratio=1.0, vertical=None, factors=ONE, **options):
    return run_in_plane(table(static, ratio), factors, (x, y), vertical, 0.01, **options)[0]


class TestOneDirection:
    @pytest.mark.parametrize(("static", "ratio"), [(0.05, 1.0), (0.1, 0.9), (0.3, 0.8), (0.5, 1.0)])
    @pytest.mark.parametrize("angle", [0.0, 0.7, 2.5])
    @pytest.mark.parametrize("lifted", [False, True])
    def test_to_rounding(self, static, ratio, angle, lifted):
        """Both components in one direction: the engine of one direction, whatever that direction is."""
        for one, other in noise(4, seed=1):
            vertical = 0.5 * other if lifted else None
            slider = Slider(static, static, ratio * static, ratio * static)
            expected = run_sliders(friction_table([slider]), ONE, one, vertical, 0.01)[0, 0]
            found = run(one * np.cos(angle), one * np.sin(angle), static, ratio, vertical)[0]
            np.testing.assert_allclose(found[SCALAR], expected[SCALAR], rtol=1e-12, atol=1e-14)
            residual = expected[SLIDES["slide_residual"]]
            np.testing.assert_allclose(
                found[[ALONG, ACROSS]], [residual * np.cos(angle), residual * np.sin(angle)], atol=1e-14
            )
            np.testing.assert_allclose(found[SLIDES["slide_residual"]], abs(residual), atol=1e-14)
            if angle == 0.0:
                for name in ("slide_forward", "slide_backward"):
                    np.testing.assert_allclose(found[SLIDES[name]], expected[SLIDES[name]], rtol=1e-12, atol=1e-14)

    def test_a_peak_that_touches_starts_nothing(self):
        hold = 0.25 * G
        for peak, slips in ((hold, 0), (np.nextafter(hold, 9.0), 1), (np.nextafter(hold, 0.0), 0)):
            record = np.array([0.0, 0.0, -peak, 0.0, 0.0])
            assert run(record, 0.0 * record, 0.25)[0, SLIDES["slips"]] == slips
            assert run(0.0 * record, record, 0.25)[0, SLIDES["slips"]] == slips


class TestPlane:
    @pytest.mark.parametrize("static", [0.05, 0.15, 0.4])
    def test_a_turned_floor_turns_the_slip(self, static):
        for x, y in noise(6, seed=2):
            plain = run(x, y, static, 0.9)[0]
            for angle in (0.3, 1.9, np.pi / 2):
                c, s = np.cos(angle), np.sin(angle)
                found = run(c * x - s * y, s * x + c * y, static, 0.9)[0]
                np.testing.assert_allclose(found[SCALAR], plain[SCALAR], rtol=0.0, atol=1e-9)
                turned = [c * plain[ALONG] - s * plain[ACROSS], s * plain[ALONG] + c * plain[ACROSS]]
                np.testing.assert_allclose(found[[ALONG, ACROSS]], turned, rtol=0.0, atol=1e-9)

    @pytest.mark.slow
    @pytest.mark.parametrize(
        ("static", "ratio", "lifted"),
        [pytest.param(0.1, 1.0, False, marks=pytest.mark.slow), (0.25, 0.8, False), (0.2, 0.9, True)],
    )
    def test_against_dop853(self, static, ratio, lifted):
        # (a block that slides nearly all the time takes DOP853 minutes)
        for k, (x, y) in enumerate(noise(3, seed=3, duration=3.0)[: 1 if static == 0.1 else 3]):
            vertical = 0.4 * np.roll(x, 40) if lifted else None
            expected = slide(np.stack([x, y]), 0.01, static, ratio * static, vertical)
            found = run(x, y, static, ratio, vertical)[0]
            assert found[SLIDES["slide_after"]] == 0.0, k
            assert expected["peak"] > 0.005, k
            np.testing.assert_allclose(found[[ALONG, ACROSS]], expected["slip"], rtol=0.0, atol=1e-9)
            for name, own in (
                ("slide_peak", "peak"),
                ("slide_forward", "forward"),
                ("slide_backward", "backward"),
                ("slide_path", "way"),
                ("slide_velocity", "speed"),
            ):
                np.testing.assert_allclose(found[SLIDES[name]], expected[own], rtol=0.0, atol=1e-9, err_msg=name)

    @pytest.mark.slow
    def test_against_steps_with_friction_at_their_ends(self):
        motions = noise(3, seed=4)
        found = [run(x, y, 0.15)[0, SLIDES["slide_peak"]] for x, y in motions]
        np.testing.assert_allclose(found, peak_in_plane(motions, 0.01, 0.15, 64), rtol=2e-3)

    def test_a_floor_that_moves_in_a_circle(self):
        """With an acceleration a of constant size that turns with ω the speed becomes sqrt(a² - (μ g)²)/ω."""
        omega, a, mu, dt = 2.0 * np.pi, 4.0, 0.25, 0.002
        time = np.arange(0.0, 20.0, dt)
        friction, history = table(mu), np.zeros((plane_tables.HISTORY_ROWS, time.size))
        shaking = a * np.cos(omega * time), a * np.sin(omega * time)
        run_in_plane(friction, ONE, shaking, None, dt, skip=False, history=history)
        speed = np.hypot(history[plane_tables.HISTORY_VX], history[plane_tables.HISTORY_VY])[-2000:]
        np.testing.assert_allclose(speed, np.sqrt(a * a - (mu * G) ** 2) / omega, rtol=1e-4)
        x = history[plane_tables.HISTORY_X][-500:]
        np.testing.assert_allclose(0.5 * np.ptp(x), np.sqrt(a * a - (mu * G) ** 2) / omega**2, rtol=1e-4)

    def test_scale(self):
        """s(f u'', μ) = f s(u'', μ/f), with the factor and the record alike."""
        ((x, y),) = noise(1, seed=5)
        whole = run(x, y, 0.3, factors=np.array([[2.0]]))[0]
        np.testing.assert_allclose(whole, run(2.0 * x, 2.0 * y, 0.3)[0], rtol=1e-12, atol=1e-13)
        half = run(x, y, 0.15)[0]
        np.testing.assert_allclose(whole[[ALONG, ACROSS]], 2.0 * half[[ALONG, ACROSS]], rtol=0.0, atol=1e-10)

    def test_ways_are_consistent(self):
        for x, y in noise(8, seed=6):
            for static in (0.02, 0.1, 0.3):
                found = dict(zip(NAMES, run(x, y, static, 0.9)[0], strict=False))
                assert found["slide_path"] >= found["slide_peak"] - 1e-12
                assert found["slide_peak"] >= max(found["slide_forward"], found["slide_backward"]) - 1e-12
                assert found["slide_peak"] >= found["slide_residual"] - 1e-12
                assert (found["slips"] > 0.0) == (found["slide_path"] > 0.0)


class TestRuns:
    def test_company_and_skips_change_no_bit(self):
        friction = plane_table([PlaneSlider(mu, 0.9 * mu) for mu in (0.05, 0.1, 0.3, 0.6)]).friction
        factors = np.tile([0.3, 1.0, 2.0], (4, 1))
        ((x, y),) = noise(1, seed=7)
        every = run_in_plane(friction, factors, (x, y), None, 0.01)
        np.testing.assert_array_equal(every, run_in_plane(friction, factors, (x, y), None, 0.01, skip=False))
        for i in range(4):
            for j in range(3):
                alone = run_in_plane(friction[i : i + 1], factors[i : i + 1, j : j + 1], (x, y), None, 0.01)
                np.testing.assert_array_equal(alone[0, 0], every[i, j])

    def test_the_weight_is_taken(self):
        ((x, y),) = noise(1, seed=8)
        up = 3.0 * x
        found = run(x, y, 0.2, vertical=up, factors=np.array([[0.2, 1.0]]))
        assert np.isfinite(found[0, SLIDES["slide_peak"]])
        assert np.isnan(found[1]).all()

    def test_nothing_moves(self):
        still = np.zeros(40)
        found = run(still, still, 1e-9)[0]
        assert np.isnan(found[SLIDES["first_slip_time"]])
        assert (np.delete(found, SLIDES["first_slip_time"]) == 0.0).all()

    @pytest.mark.parametrize("size", [5e-324, 1e-160, 1e-20, 1e6])
    def test_extreme_sizes_have_results(self, size):
        rng = np.random.default_rng(3)
        x, y = rng.normal(size=(2, 60)) * size
        for mu in (1e-9, 0.3, 10.0):
            found = run(x, y, mu)[0]
            assert np.isfinite(np.delete(found, SLIDES["first_slip_time"])).all(), mu

    def test_one_component_is_refused(self):
        given = stacked([PlaneSlider(0.2, 0.2)])
        with pytest.raises(ValueError, match="need both horizontal components, got one"):
            run_specimens(given, ONE, Record("one", np.zeros(9), 0.01, ""), True, False, np.zeros(5, np.int64))
