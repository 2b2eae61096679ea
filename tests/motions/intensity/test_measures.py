"""Intensity measures and response spectra against closed forms, eqsig, scipy and finer sampling."""

import math
import re
from decimal import Decimal, localcontext

import numpy as np
import pytest
from both_ways import both_ways
from scipy import signal
from shared_cases import shake

from toppling import motions as mo
from toppling.core.doubts import ImplausibleInput
from toppling.core.units import STANDARD_GRAVITY
from toppling.motions.intensity.peaks import displacement, velocity
from toppling.motions.intensity.spectra import peak_displacements, peak_responses
from toppling.motions.kernels import oscillators as engine

OBJECTS = [
    mo.Sa(0.3),
    mo.Sa(1.0, 0.02),
    mo.Sv(0.7),
    mo.Sd(2.0, damping=0.0),
    mo.AvgSa([0.5, 1.0, 1.7]),
    mo.AvgSa.between(0.2, 2.0, 10),
    mo.AvgSa.between(0.2, 2.0, 10, damping=0.1),
    mo.FIV3(0.5),
    mo.FIV3(0.5, beta=0.5),
]
ALL = [*mo.MEASURES.values(), *OBJECTS]
labels = pytest.mark.parametrize("measure", ALL, ids=[one.label for one in ALL])


def record(seed=1, n=2000, dt=0.01):
    return 3.0 * shake(np.random.default_rng(seed), n=n, dt=dt)


def finer(a, times):
    """The same motion at more samples."""
    return np.interp(np.arange((a.size - 1) * times + 1) / times, np.arange(a.size), a)


class TestEveryMeasure:
    @labels
    def test_units_label_and_back(self, measure):
        assert measure.units
        assert measure.long_name
        again = mo.measure_named(measure.label)
        assert again == measure
        assert again.label == measure.label

    @labels
    def test_grows_as_its_power_says(self, measure):
        a = record()
        once, thrice = measure.of(a, 0.01), measure.of(3.0 * a, 0.01)
        assert thrice == pytest.approx(3.0**measure.power * once, rel=1e-12)
        assert measure.of(-a, 0.01) == pytest.approx(once, rel=1e-12)

    @labels
    def test_is_a_property_of_the_motion_not_of_its_samples(self, measure):
        """Seven samples for one of the same piecewise linear motion."""
        a = record(n=1501)
        # a Fourier transform of samples sees that the chords of high frequencies are low
        tolerance = {"t_mean": 0.02, "FIV3(0.5)": 5e-4, "FIV3(0.5, 0.7, 0.5)": 5e-4}.get(measure.label, 1e-11)
        assert measure.of(finer(a, 7), 0.01 / 7) == pytest.approx(measure.of(a, 0.01), rel=tolerance)

    @labels
    def test_a_motion_of_zeros(self, measure):
        value = measure.of(np.zeros(200), 0.01)
        assert math.isnan(value) if measure.power == 0.0 else value == 0.0

    def test_dataset_holds_what_was_asked_for(self):
        motions = mo.CloughPenzien(duration=5.0).sample(2)
        found = mo.measures(motions, ["pgv", mo.Sa(1.0), "Sa(0.5, 0.02)"])
        assert list(found) == ["pgv", "Sa(1.0)", "Sa(0.5, 0.02)"]
        name = "spectral acceleration at 1 s, 5 % damping, ground motion"
        assert found["Sa(1.0)"].attrs == {"units": "m s-2", "long_name": name}
        assert float(found["Sa(1.0)"][1]) == mo.Sa(1.0).of(motions.values[1], 0.005)
        assert set(mo.measures(motions)) == set(mo.MEASURES)


class TestClosedForms:
    def test_constant_acceleration(self):
        a, n, dt = 2.5, 101, 0.03
        duration = 3.0
        values = np.full(n, a)
        of = {name: one.of(values, dt) for name, one in mo.MEASURES.items()}
        assert of["arias"] == pytest.approx(math.pi / (2.0 * STANDARD_GRAVITY) * a * a * duration, rel=1e-13)
        assert of["cav"] == pytest.approx(a * duration, rel=1e-13)
        assert of["d5_95"] == pytest.approx(0.9 * duration, rel=1e-13)
        assert of["d5_75"] == pytest.approx(0.7 * duration, rel=1e-13)

    def test_a_ramp_through_zero(self):
        """From -1 to 2 over 3 s: the integral of a² is 3, that of |a| is 5/2; 5 and 95 % by hand."""
        values = np.array([-1.0, 2.0])
        assert mo.MEASURES["arias"].of(values, 3.0) == pytest.approx(1.5 * math.pi / STANDARD_GRAVITY, rel=1e-14)
        assert mo.MEASURES["cav"].of(values, 3.0) == pytest.approx(2.5, rel=1e-14)
        # a³ runs from -1 to 8, in proportion to the energy
        start, end = (1.0 + np.cbrt(-1.0 + 9.0 * part) for part in (0.05, 0.95))
        assert mo.MEASURES["d5_95"].of(values, 3.0) == pytest.approx(end - start, rel=1e-13)

    @pytest.mark.parametrize("damping", [0.0, 0.02, 0.05, 0.5])
    @pytest.mark.parametrize("dt", [0.001, 0.037, 0.2])
    def test_step(self, damping, dt):
        """Overshoot A/omega² (1 + exp(-pi zeta/sqrt(1 - zeta²))), whatever the samples."""
        period, a = 0.8, 1.7
        omega = 2.0 * math.pi / period
        values = np.full(round(4.0 / dt) + 1, a)
        root = math.sqrt(1.0 - damping**2)
        displacement, velocity, absolute = peak_responses(values, dt, np.array([period]), damping)
        overshoot = 1.0 + math.exp(-math.pi * damping / root)
        assert displacement[0] == pytest.approx(a / omega**2 * overshoot, rel=1e-12)
        # the velocity A/(omega root) exp(-zeta omega t) sin(omega root t) peaks where tan(omega root t) = root/zeta
        at = math.atan2(root, damping)
        assert velocity[0] == pytest.approx(a / omega * math.exp(-damping / root * at), rel=1e-12)
        if damping == 0.0:
            assert absolute[0] == pytest.approx(2.0 * a, rel=1e-12)

    def test_resonance(self):
        """Steady state A/(2 zeta omega²) under A sin(omega t)."""
        period, zeta, dt = 0.5, 0.1, 1e-3
        omega = 2.0 * math.pi / period
        values = np.sin(omega * np.arange(20001) * dt)
        found = mo.Sd(period, zeta).of(values, dt)
        # chords of a sine are (omega dt)²/12 too low at its frequency
        expected = 1.0 / (2.0 * zeta * omega**2) * (1.0 - (omega * dt) ** 2 / 12.0)
        assert found == pytest.approx(expected, rel=1e-6)

    def test_limits_of_the_period(self):
        """Very long: the ground's displacement; very short: its acceleration."""
        a, dt = record(), 0.01
        u = np.empty((2, a.size))
        engine.oscillator_history(a, dt, 2.0 * math.pi / 1e7, 0.0, u)
        for mine, exact in zip(u, (-displacement(a, dt), -velocity(a, dt)), strict=True):
            np.testing.assert_allclose(mine, exact, atol=1e-9 * np.abs(exact).max())
        assert mo.Sa(1e-3).of(a, dt) == pytest.approx(np.abs(a).max(), rel=1e-3)

    def test_mean_period(self):
        """A sine has one period; a record has the sum over its own Fourier lines."""
        sine = np.sin(2.0 * math.pi * 2.5 * np.arange(8000) * 0.005)
        assert mo.MEASURES["t_mean"].of(sine, 0.005) == pytest.approx(0.4, rel=1e-6)
        a = record(n=4000)
        frequency = np.fft.rfftfreq(4000, 0.01)
        power = np.abs(np.fft.rfft(a)) ** 2
        inside = (frequency > 0.2499) & (frequency < 20.001)
        expected = np.sum(power[inside] / frequency[inside]) / np.sum(power[inside])
        assert mo.MEASURES["t_mean"].of(a, 0.01) == pytest.approx(expected, rel=1e-12)
        assert mo.MEASURES["t_mean"].of(a * 1e-150, 0.01) == pytest.approx(expected, rel=1e-12)

    def test_mean_period_of_odd_steps(self):
        """No frequency in the band; a step so small that zeros up to 20 s would fill the memory."""
        assert math.isnan(mo.MEASURES["t_mean"].of(record(), 10.0))
        assert mo.MEASURES["t_mean"].of(record(), 1e-9) > 0.0

    def test_spectral_measures_agree_with_the_spectrum(self):
        motions = mo.CloughPenzien(duration=8.0, dt=0.01).sample(2, seed=3)
        periods = np.array([1.0, 0.05, 0.3, 3.0])
        spectrum = mo.response_spectrum(motions, periods, 0.03)
        a = motions.values[1]
        for i, period in enumerate(periods):
            assert float(spectrum.sa[1, i]) == pytest.approx(mo.Sa(period, 0.03).of(a, 0.01), rel=1e-13)
            assert float(spectrum.sv[1, i]) == pytest.approx(mo.Sv(period, 0.03).of(a, 0.01), rel=1e-13)
            assert float(spectrum.sd[1, i]) == pytest.approx(mo.Sd(period, 0.03).of(a, 0.01), rel=1e-13)
        assert spectrum.sa.dims == ("motion", "period")
        assert all(spectrum[name].attrs["units"] and spectrum[name].attrs["long_name"] for name in spectrum.variables)
        average = mo.AvgSa(periods, 0.03).of(a, 0.01)
        assert average == pytest.approx(float(np.exp(np.log(spectrum.sa.values[1]).mean())), rel=1e-13)
        grid = np.linspace(0.1, 2.5, 49)
        housner = np.trapezoid(mo.response_spectrum(motions, grid).sv.values, grid, axis=1)
        np.testing.assert_allclose(mo.measures(motions).housner_intensity, housner, rtol=1e-13)


class TestRecurrence:
    @pytest.mark.parametrize(("period", "zeta"), [(0.004, 0.05), (0.1, 0.0), (1.0, 0.05), (1.0, 0.99), (50.0, 0.2)])
    def test_against_scipy(self, period, zeta):
        """The state-space system with a first-order hold."""
        a, dt = record(), 0.01
        omega = 2.0 * math.pi / period
        system = ([[0.0, 1.0], [-(omega**2), -2.0 * zeta * omega]], [[0.0], [-1.0]], np.eye(2), np.zeros((2, 1)))
        _, expected, _ = signal.lsim(system, a, np.arange(a.size) * dt, interp=True)
        found = np.empty((2, a.size))
        engine.oscillator_history(a, dt, omega, zeta, found)
        for row in range(2):
            scale = np.abs(expected[:, row]).max()
            np.testing.assert_allclose(found[row], expected[:, row], atol=1e-11 * scale)

    @pytest.mark.parametrize("zeta", [0.0, 0.05, 0.7, 0.98])
    def test_coefficients_to_the_last_digits(self, zeta):
        """c, s and the integrals of s by Taylor series in ninety digits, on both sides of omega t = 1."""
        with localcontext(prec=90):
            for t in (1e-9, 1e-3, 0.1, 0.3333333, 0.3333334, 0.7, 13.0):
                found = engine.basis(3.0, zeta, t)
                x, z = 3 * Decimal(t), Decimal(zeta)
                before, here, power = Decimal(0), Decimal(1), x
                s, first, second = Decimal(0), Decimal(0), Decimal(0)
                for k in range(1, 300):
                    s += here * power
                    first += here * power * x / (k + 1)
                    second += here * power * x * x / ((k + 1) * (k + 2))
                    before, here = here, -(2 * z * k * here + before) / (k * (k + 1))
                    power *= x
                exact = [float(one) for one in (1 - first, s / 3, first / 9, second / 27)]
                # s and c pass through zero: rounding is that of their envelope
                envelope = np.array([1.0, min(t, 1.0), min(t, 1.0) ** 2, min(t, 1.0) ** 3])
                assert np.all(np.abs(np.array(found) - exact) <= 2e-15 * (np.abs(exact) + envelope))

    def test_peaks_lie_between_samples(self):
        """A maximum is that of a history two hundred times finer, to that history's resolution; samples miss it."""
        a, dt = record(n=600), 0.01
        fine = finer(a, 200)
        missed = 0.0
        for period in (0.02, 0.05, 0.11, 0.3, 1.3):
            omega = 2.0 * math.pi / period
            history, samples = np.empty((2, fine.size)), np.empty((2, a.size))
            engine.oscillator_history(fine, dt / 200, omega, 0.05, history)
            engine.oscillator_history(a, dt, omega, 0.05, samples)
            found = peak_responses(a, dt, np.array([period]), 0.05)
            absolute = np.abs(omega**2 * history[0] + 0.1 * omega * history[1]).max()
            resolution = (omega * dt / 200) ** 2 / 8.0 + 1e-12
            for value, dense in zip(found, (*np.abs(history).max(axis=1), absolute), strict=True):
                assert dense * (1.0 - 1e-12) <= value[0] <= dense * (1.0 + 2.0 * resolution)
            missed = max(missed, 1.0 - np.abs(samples[0]).max() / found[0, 0])
        assert missed > 0.01

    def test_lanes_do_not_matter(self):
        a = record(n=400)
        periods = np.geomspace(0.02, 5.0, 150)
        together = peak_displacements(a, 0.01, periods, 0.05)
        alone = [peak_displacements(a, 0.01, periods[i : i + 1], 0.05)[0] for i in range(periods.size)]
        np.testing.assert_array_equal(together, alone)

    @pytest.mark.slow
    def test_without_the_compiler(self):
        code = (
            "import json, numpy as np\n"
            "from toppling.motions.intensity.spectra import peak_responses\n"
            "from toppling.motions import Building, from_array\n"
            "a = np.sin(np.arange(80.0)) * np.hanning(80)\n"
            "found = np.array(peak_responses(a, 0.02, np.array([0.05, 0.2, 1.0]), 0.05)).ravel().tolist()\n"
            "peaks = Building.flexural_shear(0.3, storeys=3, modes=3).peaks(from_array(a, 0.02))\n"
            "print(json.dumps([*found, *peaks.pfa.values[0].tolist(), *peaks.pfv.values[0].tolist()]))\n"
        )
        np.testing.assert_allclose(*both_ways(code), rtol=1e-12)


class TestEqsig:
    """eqsig integrates by trapezoids and takes g = 9.81: finer samples of the same motion, and its g."""

    @pytest.fixture
    def case(self):
        pytest.importorskip("eqsig")
        a = record(n=1500)
        return a, 0.01, finer(a, 40), 0.01 / 40

    def test_arias_and_cav(self, case):
        import eqsig

        a, dt, fine, step = case
        theirs = eqsig.AccSignal(fine, step)
        arias = eqsig.im.calc_arias_intensity(theirs)[-1] * 9.81 / STANDARD_GRAVITY
        assert mo.MEASURES["arias"].of(a, dt) == pytest.approx(arias, rel=1e-4)
        assert mo.MEASURES["cav"].of(a, dt) == pytest.approx(eqsig.im.calc_cav(theirs)[-1], rel=1e-5)

    @pytest.mark.parametrize(("name", "end"), [("d5_75", 0.75), ("d5_95", 0.95)])
    def test_durations(self, case, name, end):
        import eqsig

        a, dt, fine, step = case
        assert mo.MEASURES[name].of(a, dt) == pytest.approx(
            eqsig.im.calc_sig_dur_vals(fine, step, end=end), abs=2.5 * step
        )

    @pytest.mark.slow
    def test_spectra(self, case):
        from eqsig import sdof

        a, dt, fine, step = case
        periods = np.array([0.1, 0.35, 1.0, 2.7])
        for damping in (0.02, 0.2):
            sd, sv, sa = sdof.pseudo_response_spectra(fine, step, periods, damping)
            ours = mo.response_spectrum(mo.from_array(a, dt), periods, damping)
            for mine, theirs in ((ours.sd, sd), (ours.sv, sv), (ours.sa, sa)):
                # maxima at samples: up to (omega step)²/8 = 3e-5 too low at 0.1 s
                np.testing.assert_allclose(mine.values[0], theirs, rtol=4e-5)
            _, true_sv, true_sa = sdof.true_response_spectra(fine, step, periods, damping)
            np.testing.assert_allclose(ours.sv_true.values[0], true_sv, rtol=1e-4)
            np.testing.assert_allclose(ours.sa_true.values[0], true_sa, rtol=1e-4)


class TestFiv3:
    @pytest.mark.parametrize(("period", "alpha", "beta"), [(0.5, 0.7, 0.85), (1.03, 0.7, 0.85), (2.0, 0.5, 2.0)])
    def test_by_definition(self, period, alpha, beta):
        """Butterworth filter by scipy on finer samples, windows summed one by one, extremes picked."""
        a, dt, times = record(n=1200), 0.01, 20
        fine, step = finer(a, times), 0.01 / times
        system = signal.butter(2, 2.0 * math.pi * beta / period, analog=True)
        _, filtered, _ = signal.lsim(system, fine, np.arange(fine.size) * step)
        window = round(alpha * period / step)
        integral = np.concatenate([[0.0], np.cumsum(0.5 * step * (filtered[1:] + filtered[:-1]))])
        increments = integral[window:] - integral[:-window]
        sums = []
        for values in (increments, -increments):
            at, _ = signal.find_peaks(np.concatenate([[-1e9], values, [-1e9]]))
            sums.append(np.sort(values[at - 1])[-3:].sum())
        assert mo.FIV3(period, alpha, beta).of(a, dt) == pytest.approx(max(sums), rel=5e-4)

    def test_a_slow_pulse_is_its_impulse(self):
        """One pulse far longer than the filter and shorter than the window: its whole impulse."""
        pulse = np.concatenate([np.zeros(3000), 2.0 * np.hanning(501), np.zeros(3000)])
        found = mo.FIV3(20.0, beta=200.0).of(pulse, 0.01)
        assert found == pytest.approx(2.0 * 2.5, rel=1e-5)

    def test_a_record_shorter_than_the_window(self):
        # exactly one window is enough
        assert mo.FIV3(1.0, alpha=1.0).of(np.ones(101), 0.01) > 0.0


@pytest.mark.parametrize(
    ("periods", "damping", "said"),
    [
        ([100.0, 200.0], 0.05, "no spectrum has periods above 10 s: milliseconds in place of s?"),
        ([0.1, 15.0], 0.5, "no spectrum has a damping ratio of 0.5: 0.05 for 5 %?"),
    ],
)
def test_spectra_of_other_units_are_doubted(periods, damping, said):
    with pytest.warns(ImplausibleInput, match=re.escape(said)):
        mo.response_spectrum(mo.HalfSine(1.0, 6.0).sample(1), periods, damping)


def test_refused(refusal):
    refusal()
