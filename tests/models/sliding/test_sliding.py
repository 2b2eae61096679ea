"""Sliding blocks held to closed forms, typed records and symmetries."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq
from shared_cases import SHARED, needs_shared

import toppling as tp
from toppling import motions as mo
from toppling.fragility import Slip
from toppling.models.outputs import SLIDES
from toppling.models.sliding.law import Slider
from toppling.models.sliding.mode import Mode
from toppling.models.sliding.runs import friction_table, run_sliders
from toppling.motions.arrays import records

G = 9.80665
TYPED = np.array([0, 2, 5, 3, -1, -6, -4, 1, 4, 2, -3, -2, 0.0])
LIFTED = np.array([0, 1, -1, 2, 3, -2, -4, 1, 2, 0, 1, -1, 0.0])
ORDER = (
    "slide_forward",
    "slide_backward",
    "slide_residual",
    "slide_path",
    "slide_velocity",
    "slips",
    "first_slip_time",
)


def slide(record, dt, static, kinetic=None, vertical=None, factor=1.0):
    """Results of one run by name."""
    slider = tp.Sliding(static, kinetic).slider(tp.Block(0.6, 1.0))
    one = run_sliders(friction_table([slider]), np.array([[factor]]), np.asarray(record, float), vertical, dt)[0, 0]
    return {name: one[column] for name, column in SLIDES.items()}


def noise(n=4, seed=0, duration=20.0):
    return mo.CloughPenzien(duration=duration).sample(n, seed=seed)


class TestClosedForms:
    @pytest.mark.parametrize(("a", "expected"), [(1.5, 0.27581203125), (2.0, 0.73549875), (4.0, 4.4129925)])
    def test_rectangular_pulse(self, a, expected):
        """s = mu g t1² A (A - 1)/2."""
        record = np.full(51, -a * 0.3 * G)
        assert slide(record, 0.01, 0.3)["slide_forward"] == pytest.approx(expected, rel=1e-14)

    @pytest.mark.parametrize(("a", "expected"), [(1.5, 0.44129925), (2.0, 1.02969825), (4.0, 5.58979050)])
    def test_rectangular_pulse_with_less_kinetic_friction(self, a, expected):
        record = np.full(51, -a * 0.3 * G)
        assert slide(record, 0.01, 0.3, 0.25)["slide_forward"] == pytest.approx(expected, rel=1e-14)

    @pytest.mark.parametrize("samples", [1, 7, 100])
    @pytest.mark.parametrize("a", [1.2, 1.4, 1.5, 1.7, 2.0, 4.0, 8.0])
    def test_triangular_pulse(self, a, samples):
        """With beta = 1 - 1/A, below and above sqrt(2) - 1: the block stops while the pulse falls, or after it."""
        beta, leg = 1.0 - 1.0 / a, 0.4
        if beta <= math.sqrt(2.0) - 1.0:
            expected = beta**3 * (1.0 + 2.0 * math.sqrt(2.0) / 3.0)
        else:
            end = 0.5 * beta**2 + beta - 0.5
            expected = beta**3 / 6 + 0.5 * beta**2 + 0.5 * beta - 1 / 6 + end**2 / (2.0 * (1.0 - beta))
        top = a * 0.3 * G
        rise = np.linspace(0.0, top, samples + 1)
        record = -np.concatenate([rise, rise[-2::-1], np.zeros(80 * samples)])
        found = slide(record, leg / samples, 0.3)["slide_forward"] / (top * leg**2)
        assert found == pytest.approx(expected, rel=2e-14)

    @pytest.mark.parametrize("a", [1.2, 1.5, 2.0, 3.0, 4.0, 8.0])
    def test_half_sine_converges_with_the_square_of_the_step(self, a):
        psi = math.asin(1.0 / a)
        if a * (1.0 + math.cos(psi)) > math.pi - psi:
            left = math.pi - psi
            speed = a * (1.0 + math.cos(psi)) - left
            expected = a * (left * math.cos(psi) + math.sin(psi)) - 0.5 * left**2 + 0.5 * speed**2
        else:
            x = brentq(lambda x: a * (math.cos(psi) - math.cos(x)) - (x - psi), psi + 1e-6, math.pi, xtol=1e-15)
            expected = a * ((x - psi) * math.cos(psi) - math.sin(x) + math.sin(psi)) - 0.5 * (x - psi) ** 2
        unit = 0.3 * G  # at a circular frequency of 1
        errors = []
        for n in (200, 2000):
            pulse = a * unit * np.sin(np.linspace(0.0, math.pi, n + 1))
            record = -np.concatenate([pulse, np.zeros(40 * n)])
            errors.append(slide(record, math.pi / n, 0.3)["slide_forward"] / unit / expected - 1.0)
        assert abs(errors[0]) < 3e-3
        assert errors[1] / errors[0] == pytest.approx(0.01, rel=0.2)

    @pytest.mark.parametrize(
        ("a", "expected"),
        [
            (1.2, 0.155337666007),
            (1.5, 0.807456913373),
            (1.8, 1.77270638919),
            (2.0, 2.47596356979),
            (3.0, 5.11178986255),
            (6.0, 11.5814677653),
        ],
    )
    def test_harmonic_steady_state(self, a, expected):
        """Slip per half cycle: 2 sqrt(A² - pi²/4) mu g/omega² where the block slides all the time."""
        if a > math.sqrt(1.0 + math.pi**2 / 4.0):
            assert expected == pytest.approx(2.0 * math.sqrt(a * a - math.pi**2 / 4.0), rel=1e-11)
        n, cycles = 2000, 60
        t = np.arange(n * cycles + 1) * (2.0 * math.pi / n)
        motion = mo.from_array(a * 0.2 * G * np.sin(t), 2.0 * math.pi / n)
        slip = tp.simulate(tp.Block(0.6, 1.0), tp.Sliding(0.2), motion)["slip"].values
        last = slip[-n - 1 :]
        assert np.ptp(last) / (0.2 * G) == pytest.approx(expected, rel=2e-5)


class TestTypedRecord:
    CASES = (
        (
            (0.2, 0.2),
            None,
            (0.01943605473531, 0.07532236843244, 0.01266846818254, 0.1933967454999, 0.4690245710537, 4, 0.0980665),
        ),
        (
            (0.25, 0.25),
            None,
            (
                0.02991424491013,
                0.04744365119224,
                0.01987945216769,
                0.1377226965095,
                0.4047142302781,
                4,
                0.1150554166667,
            ),
        ),
        (
            (0.3, 0.2),
            LIFTED,
            (
                0.06043494915994,
                0.06325896196638,
                0.05270512820778,
                0.1946826940449,
                0.5857994044608,
                3,
                0.1344998611111,
            ),
        ),
    )

    @pytest.mark.parametrize(("friction", "vertical", "expected"), CASES)
    def test_all_results(self, friction, vertical, expected):
        found = slide(TYPED, 0.1, *friction, vertical)
        assert [found[name] for name in ORDER] == pytest.approx(expected, rel=3e-12)

    @needs_shared
    @pytest.mark.parametrize(
        ("friction", "expected"),
        [
            ((0.1, 0.1), (0.00419627625019, 0.0294344623943, -0.0138398567504)),
            ((0.12, 0.1), (0.00394895143913, 0.0294253394981, -0.0152049728498)),
            ((0.05, 0.05), (0.0342558995954, 0.0937776155525, -0.0561443524075)),
        ],
    )
    def test_el_centro(self, friction, expected):
        (record,) = records(mo.read(SHARED / "data/records/elCentro.AT2"))
        found = slide(record.acceleration, record.dt, *friction)
        assert [found[name] for name in ORDER[:3]] == pytest.approx(expected, rel=1e-11)


def draws(seed, n=200):
    """Friction (n, 4), symmetric, and factors (n, 1): from blocks that hardly move to ones that hardly stop."""
    rng = np.random.default_rng(seed)
    static = np.exp(rng.uniform(math.log(0.01), math.log(1.0), n))
    kinetic = static * rng.choice([1.0, 0.8, 0.3], n)
    return np.stack([static, static, kinetic, kinetic], axis=1), rng.uniform(1.0, 8.0, (n, 1))


@pytest.fixture(scope="module")
def shaking():
    record, other = records(noise(2))
    return record.acceleration / np.abs(record.acceleration).max(), 0.4 * other.acceleration, record.dt


class TestSymmetries:
    def test_a_mirrored_motion_exchanges_front_and_back(self, shaking):
        record, upward, dt = shaking
        for vertical in (None, upward):
            friction, factors = draws(1)
            one, other = (run_sliders(friction, factors, way * record, vertical, dt)[:, 0] for way in (1.0, -1.0))
            np.testing.assert_array_equal(one[:, SLIDES["slide_forward"]], other[:, SLIDES["slide_backward"]])
            np.testing.assert_array_equal(one[:, SLIDES["slide_residual"]], -other[:, SLIDES["slide_residual"]])
            for name in ("slide_peak", "slide_path", "slide_velocity", "slips", "first_slip_time"):
                np.testing.assert_array_equal(one[:, SLIDES[name]], other[:, SLIDES[name]])

    def test_friction_and_motion_scale_together(self, shaking):
        """s(f u'', mu) = f s(u'', mu/f), the identity by which levels and coefficients share their runs."""
        record, _, dt = shaking
        friction, factors = draws(2)
        scaled = run_sliders(friction, factors, record, None, dt)[:, 0]
        plain = run_sliders(friction / factors, np.ones_like(factors), record, None, dt)[:, 0]
        for name in ("slide_peak", "slide_path", "slide_velocity"):
            own = factors[:, 0] * plain[:, SLIDES[name]]
            np.testing.assert_allclose(scaled[:, SLIDES[name]], own, rtol=1e-9, atol=1e-14)

    def test_time_scales_with_the_square(self, shaking):
        record, _, dt = shaking
        friction, factors = draws(3)
        one, slow = (run_sliders(friction, factors, record, None, own)[:, 0] for own in (dt, 2.0 * dt))
        np.testing.assert_allclose(
            slow[:, SLIDES["slide_peak"]], 4.0 * one[:, SLIDES["slide_peak"]], rtol=1e-9, atol=1e-14
        )

    def test_constant_vertical_acceleration_is_another_gravity(self, shaking):
        record, _, dt = shaking
        friction, factors = draws(4)
        lifted = run_sliders(friction, 0.0 * factors + 2.0, record, np.full(record.size, 1.5), dt)[:, 0]
        plain = run_sliders(friction * (1.0 + 3.0 / G), 0.0 * factors + 2.0, record, None, dt)[:, 0]
        # (what comes after the end of the record is on a floor at rest)
        stopped = (lifted[:, SLIDES["slide_after"]] == 0.0) & (plain[:, SLIDES["slide_after"]] == 0.0)
        assert stopped.sum() > 50
        columns = [SLIDES[name] for name in ("slide_forward", "slide_backward", "slide_path", "slide_velocity")]
        np.testing.assert_allclose(lifted[stopped][:, columns], plain[stopped][:, columns], rtol=1e-9, atol=1e-14)

    def test_no_friction_leaves_the_block_where_it_is(self, shaking):
        """The slip is minus the displacement of the floor, which is piecewise cubic."""
        record, _, dt = shaking
        change = np.diff(record)
        velocity = np.append(0.0, np.cumsum(dt * (record[:-1] + 0.5 * change)))
        floor = np.append(0.0, np.cumsum(dt * velocity[:-1] + dt**2 * (0.5 * record[:-1] + change / 6.0)))
        motion = mo.from_array(record, dt)
        slip = tp.simulate(tp.Block(0.6, 1.0), tp.Sliding(1e-9), motion)["slip"].values
        np.testing.assert_allclose(slip, -floor, atol=1e-5 * np.abs(floor).max())


class TestLanes:
    def test_energy_balances(self, shaking):
        """Friction takes what the floor's acceleration gives: kinetic friction × way = -integral of u'' v."""
        record, _, dt = shaking
        for static, kinetic, factor in ((0.1, 0.1, 4.0), (0.3, 0.2, 6.0), (0.05, 0.04, 2.0)):
            fine = np.interp(np.arange(40 * (record.size - 1) + 1) / 40, np.arange(record.size), factor * record)
            fine = np.append(fine, np.zeros(4000))
            run = tp.simulate(tp.Block(0.6, 1.0), tp.Sliding(static, kinetic), mo.from_array(fine, dt / 40))
            power = -(fine * run["slip_velocity"].values)
            given = np.sum(0.5 * (power[1:] + power[:-1])) * dt / 40
            assert kinetic * G * float(run.slide_path) == pytest.approx(given, rel=1e-5)

    def test_one_way(self, shaking):
        """Newmark's block slides to the front alone, at least as far as the one that may come back."""
        record, _, dt = shaking
        sliders = [Slider(mu, math.inf, mu, mu) for mu in (0.05, 0.1, 0.2)]
        found = run_sliders(friction_table(sliders), np.full((3, 1), 4.0), record, None, dt)[:, 0]
        assert (found[:, SLIDES["slide_backward"]] == 0.0).all()
        assert (found[:, SLIDES["slide_forward"]] == found[:, SLIDES["slide_residual"]]).all()
        assert (found[:, SLIDES["slide_forward"]] > 0.0).all()


class TestLaw:
    def test_label(self):
        assert tp.Sliding(0.3).label == tp.Sliding(0.3, 0.3).label == "sliding μ=0.3"
        assert tp.Sliding(0.3, 0.25).label == "sliding μ=0.3 μ_k=0.25"

    def test_history_holds_the_results_of_its_run(self):
        motion = 4.0 * noise(1)
        (record,) = records(motion)
        run, found = tp.simulate(tp.Block(0.6, 1.0), tp.Sliding(0.1, 0.08), motion), slide(
            record.acceleration, record.dt, 0.1, 0.08
        )  # fmt: skip
        for name, value in found.items():
            assert float(run[name]) == value
        assert float(run.slide_forward) >= run["slip"].max()
        assert float(np.abs(run["slip_velocity"]).max()) == pytest.approx(float(run.slide_velocity), rel=0.02)
        assert int(run["mode"]) == Mode.SLIDES


class TestAnalyses:
    BLOCKS = (tp.Block(0.6, 1.0, name="squat"), tp.Block(0.3, 1.8, name="slender"))

    def runs(self, **options):
        names = ("slide_peak", "slide_forward", "slide_backward", "slips", "first_slip_time", "mode")
        laws = [tp.Sliding(0.3), tp.Sliding(0.5, 0.4)]
        return tp.ida(self.BLOCKS, laws, noise(5), [2.0, 4.0, 7.0], outputs=names, **options)

    def test_runs_are_those_of_the_engine(self):
        runs = self.runs()
        for i, record in enumerate(records(noise(5))):
            scale = 7.0 / np.abs(record.acceleration).max()
            own = slide(record.acceleration, record.dt, 0.5, 0.4, factor=scale)
            for name in ("slide_peak", "slips", "first_slip_time"):
                np.testing.assert_array_equal(runs[name].values[:, 1, 2, i], own[name])

    def test_modes(self):
        """Up to the smaller of friction and b/h (0.6 and 1/6) all rests; above it the smaller one decides."""
        modes = self.runs()["mode"]
        levels = modes["level"].values / G
        for k, friction in enumerate((0.3, 0.5)):
            wide = np.where(levels > friction, Mode.SLIDES, Mode.RESTS)
            np.testing.assert_array_equal(modes.values[0, k], np.repeat(wide[:, None], 5, axis=1))
            slender = np.where(levels > 1.0 / 6.0, Mode.ROCKS, Mode.RESTS)
            np.testing.assert_array_equal(modes.values[1, k], np.repeat(slender[:, None], 5, axis=1))

    def test_stripes_and_cloud(self):
        weak, strong = noise(3, 1), noise(3, 2)
        stripes = tp.stripes(self.BLOCKS[0], tp.Sliding(0.3), [weak, strong], [3.0, 7.0], outputs="slide_peak")
        each = [tp.ida(self.BLOCKS[0], tp.Sliding(0.3), one, [at]) for one, at in ((weak, 3.0), (strong, 7.0))]
        own = np.concatenate([one.slide_peak.values[0, 0, 0] for one in each])
        np.testing.assert_array_equal(stripes.slide_peak.values[0, 0], own)
        cloud = tp.cloud(self.BLOCKS[0], tp.Sliding(0.1), 2.0 * weak, "pga")
        assert cloud.slide_peak.dims == ("block", "model", "motion")
        assert (cloud.slide_peak > 0.0).all()

    def test_probabilities_of_slips(self):
        runs = self.runs()
        for state, name in ((Slip(0.01), "slide_peak"), (Slip(0.01, "front"), "slide_forward")):
            found = tp.overturning_probability(runs, state=state)
            np.testing.assert_array_equal(found.overturnings, (runs[name] > 0.01).sum("motion"))
            assert "slip above 0.01" in found.attrs["state"]
        many = tp.ida(self.BLOCKS[0], tp.Sliding(0.2), mo.pad(noise(40), 0.0, 5.0), np.linspace(2.0, 10.0, 9))
        fit = tp.fit_fragility(many, state=Slip(0.05))
        counts = (many.slide_peak > 0.05).mean("motion").values[0, 0]
        assert np.interp(fit["median"].item(), many["level"], counts) == pytest.approx(0.5, abs=0.12)

    def test_a_motion_that_ends_in_motion_is_named(self):
        cut = mo.from_array(-np.ones(50), 0.01, ["cut"])
        whole = mo.from_array(-np.append(np.ones(50), np.zeros(500)), 0.01, ["whole"])
        with pytest.warns(
            tp.core.doubts.ImplausibleInput, match=r"1 of 2 motions end while a block slides, .* \(cut\)"
        ):
            tp.ida(self.BLOCKS[0], tp.Sliding(0.2), [cut, whole], [4.0])

    def test_vertical_acceleration(self):
        h1, h2, v = (mo.pad(noise(3, seed), 0.0, 5.0) for seed in (1, 2, 3))
        pair = mo.join(h1, h2, 0.8 * v)
        names = ("slide_peak", "mode")
        plain, lifted = (
            tp.ida(self.BLOCKS[0], tp.Sliding(0.2), mo.as_recorded(pair, vertical=on), [2.0, 6.0, 40.0], outputs=names)
            for on in (False, True)
        )
        factors = [2.0 / np.abs(one.acceleration).max() for one in records(h1)]
        for i, (one, up) in enumerate(zip(records(h1), records(0.8 * v), strict=True)):
            own = slide(one.acceleration, one.dt, 0.2, None, up.acceleration, factors[i])
            assert float(lifted.slide_peak[0, 0, 0, i]) == own["slide_peak"]
        assert (plain.slide_peak[0, 0, 1] != lifted.slide_peak[0, 0, 1]).all()
        # at 40 m/s² the vertical acceleration exceeds g
        assert np.isnan(lifted.slide_peak[0, 0, 2]).all()
        assert (lifted["mode"][0, 0, 2] == Mode.AIRBORNE).all()
        with pytest.raises(ValueError, match="loses contact with the floor"):
            tp.overturning_probability(lifted, state=Slip(0.1))


def test_refused(refusal):
    refusal()
