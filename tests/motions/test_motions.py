"""Simulated motions, pulses, intensity measures and scaling against closed forms."""

import math
import warnings

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from scipy.integrate import quad

import toppling as tp
from toppling import motions as mo
from toppling.core.doubts import ImplausibleInput
from toppling.motions.intensity.peaks import displacement, velocity
from toppling.motions.scaling import parabolic_baseline
from toppling.motions.simulated.filters import filtered


class TestGenerators:
    @pytest.mark.parametrize(("omega", "xi", "s0"), [(5.0 * math.pi, 0.6, 0.01), (10.0, 0.3, 0.002)])
    def test_stationary_variance_of_kanai_tajimi(self, omega, xi, s0):
        """pi s0 omega (1 + 4 xi²)/(2 xi) as dt -> 0."""
        generator = mo.KanaiTajimi(omega, xi, s0, 60.0, 0.002, mo.Stationary(), baseline="none")
        settled = generator.sample(60, seed=1).values[:, 5000:]
        expected = math.pi * s0 * omega * (1.0 + 4.0 * xi**2) / (2.0 * xi)
        # 60 motions x 50 s of a process with a correlation time of about 1/(xi omega): 3 % at three sigma
        assert settled.var() == pytest.approx(expected, rel=0.04)

    def test_stationary_variance_of_clough_penzien(self):
        """The integral of s0 |H_g|² |H_f|² over all frequencies."""
        omega_g, xi_g, omega_f, xi_f, s0 = 15.0, 0.6, 1.5, 0.6, 0.01

        def density(w):
            ground = (omega_g**4 + (2 * xi_g * omega_g * w) ** 2) / (
                (omega_g**2 - w**2) ** 2 + (2 * xi_g * omega_g * w) ** 2
            )
            return s0 * ground * w**4 / ((omega_f**2 - w**2) ** 2 + (2 * xi_f * omega_f * w) ** 2)

        expected = 2.0 * quad(density, 0.0, 2000.0, limit=500)[0]
        generator = mo.CloughPenzien(omega_g, xi_g, s0, 60.0, 0.002, mo.Stationary(), omega_f=omega_f, xi_f=xi_f)
        settled = generator.sample(60, seed=2).values[:, 10000:30000]
        assert settled.var() == pytest.approx(expected, rel=0.04)

    def test_filter_is_exact_for_linear_segments(self):
        """A ramp through Kanai-Tajimi: the closed-form response t - (impulse response of the remainder)."""
        w, xi, dt = 9.0, 0.4, 0.05
        time = np.arange(200) * dt
        response = filtered(time[None], [2 * xi * w, w * w], [1.0, 2 * xi * w, w * w], dt)[0]
        wd = w * math.sqrt(1.0 - xi**2)
        exact = time - np.exp(-xi * w * time) * np.sin(wd * time) / wd
        np.testing.assert_allclose(response, exact, atol=1e-12)

    def test_clough_penzien_leaves_finite_displacement(self):
        plain = mo.measures(mo.KanaiTajimi(duration=40.0, baseline="none").sample(20, seed=3))
        high_passed = mo.measures(mo.CloughPenzien(duration=40.0).sample(20, seed=3))
        assert high_passed.pgd.median() < 0.2 * plain.pgd.median()

    def test_envelope_of_yim_chopra_penzien(self):
        envelope = mo.RiseStrongDecay()
        time = np.array([0.0, 2.0, 4.0, 10.0, 15.0, 30.0])
        expected = [0.0, 4.0 / 16.0, 1.0, 1.0, 1.0, math.exp(-0.0992 * 15.0)]
        np.testing.assert_allclose(envelope(time), expected, rtol=1e-15)

    def test_envelopes_faster_than_any_number(self):
        with warnings.catch_warnings(action="error"):
            values = mo.RiseStrongDecay(1e-308, 2.0, 1e308)(np.linspace(0.0, 40.0, 4001))
        assert np.all((values >= 0.0) & (values <= 1.0))

    @pytest.mark.parametrize("envelope", [mo.RiseStrongDecay(), mo.RiseStrongDecay(1.0, 2.0, 1.0)])
    def test_envelopes_peak_at_one(self, envelope):
        values = envelope(np.linspace(0.0, 40.0, 400001))
        assert values.max() == pytest.approx(1.0, abs=1e-8)
        assert values.min() >= 0.0


class TestPulses:
    @pytest.mark.parametrize("name", mo.PULSES)
    def test_amplitude_and_length(self, name):
        pulse = mo.PULSES[name](amplitude=2.0, omega=5.0, dt=1e-3, tail=0.5)
        motion = pulse.sample(1)
        assert np.abs(motion.values).max() == pytest.approx(2.0, rel=1e-5)
        assert float(motion.dt[0]) <= 1e-3
        assert motion.time.values[-1] == pytest.approx(pulse.duration + 0.5, abs=2e-3)
        assert motion.values[0, -1] == 0.0

    def test_jump_is_the_mean_of_its_sides(self):
        """The impulse of the rectangle, and so its PGV, is amplitude x length."""
        motion = mo.RectangularPulse(3.0, math.pi / 0.4, dt=0.01).sample(1)
        values = motion.values[0]
        assert values[:41].tolist() == [3.0] * 40 + [1.5]
        assert float(mo.measures(motion).pgv[0]) == pytest.approx(3.0 * 0.4, rel=1e-12)

    def test_ricker_has_no_impulse(self):
        motion = mo.Ricker(1.0, 6.0).sample(1)
        assert abs(velocity(motion.values, float(motion.dt[0]))[0, -1]) < 1e-9


class TestMeasures:
    def test_sine(self):
        """A sine from rest: PGV = 2 A/omega, PGD of one cycle = 2 pi A/omega²."""
        motion = mo.OneCycleSine(3.0, 5.0, dt=1e-4, tail=0.0).sample(1)
        found = mo.measures(motion)
        assert float(found.pga[0]) == pytest.approx(3.0, rel=1e-7)
        assert float(found.pgv[0]) == pytest.approx(2.0 * 3.0 / 5.0, rel=1e-7)
        assert float(found.pgd[0]) == pytest.approx(2.0 * math.pi * 3.0 / 25.0, rel=1e-7)

    def test_peaks_between_samples(self):
        """Two samples: a falls from 1 to -1 over 1 s: v peaks at t = 1/2 with 1/4, u(1) = 1/6."""
        found = mo.measures(mo.from_array([1.0, -1.0], 1.0))
        assert float(found.pgv[0]) == pytest.approx(0.25, rel=1e-15)
        assert float(found.pgd[0]) == pytest.approx(1.0 / 6.0, rel=1e-14)
        # v passes zero between samples: a = -1 with v0 > 0 from a first step
        values = [2.0, 2.0, -6.0, -6.0, 0.0]
        fine = np.interp(np.linspace(0.0, 4.0, 400001), np.arange(5.0), values)
        for measure in ("pgv", "pgd"):
            coarse = float(mo.measures(mo.from_array(values, 1.0))[measure][0])
            dense = float(mo.measures(mo.from_array(fine, 1e-5))[measure][0])
            assert coarse == pytest.approx(dense, rel=1e-9)

    def test_integrals_are_exact_for_linear_segments(self):
        rng = np.random.default_rng(1)
        a = rng.standard_normal(50)
        fine = np.interp(np.linspace(0.0, 49.0, 49 * 64 + 1), np.arange(50), a)
        np.testing.assert_allclose(velocity(a, 0.02), velocity(fine, 0.02 / 64)[::64], rtol=1e-12, atol=1e-14)
        np.testing.assert_allclose(displacement(a, 0.02), displacement(fine, 0.02 / 64)[::64], rtol=1e-11, atol=1e-14)

    def test_measures_carry_units(self):
        found = mo.measures(mo.KanaiTajimi(duration=2.0).sample(2))
        assert {name: found[name].attrs["units"] for name in found} == {
            "pga": "m s-2",
            "pgv": "m s-1",
            "pgd": "m",
            "arias": "m s-1",
            "cav": "m s-1",
            "d5_75": "s",
            "d5_95": "s",
            "t_mean": "s",
            "housner_intensity": "m",
        }
        assert all(found[c].attrs["units"] and found[c].attrs["long_name"] for c in found.coords)


class TestScaling:
    @pytest.mark.parametrize("im", ["pga", "pgv", "pgd", "arias", "cav", "housner_intensity", "Sa(0.5)", mo.FIV3(0.4)])
    def test_scale_to(self, im):
        scaled = mo.scale_to(mo.CloughPenzien(duration=5.0).sample(4), 2.5, im)
        name = im if isinstance(im, str) else im.label
        np.testing.assert_allclose(mo.measures(scaled, im)[name].values, 2.5, rtol=1e-12)
        assert scaled.attrs["units"] == "m s-2"
        assert scaled.dims == ("motion", "time")

    def test_scale_to_mean_keeps_ratios(self):
        motions = mo.CloughPenzien(duration=5.0).sample(5)
        scaled = mo.scale_to_mean(motions, 3.0)
        assert float(mo.measures(scaled).pga.mean()) == pytest.approx(3.0, rel=1e-13)
        np.testing.assert_allclose((scaled / motions).values[:, 1:].std(), 0.0, atol=1e-12)
        squared = mo.scale_to_mean(motions, 3.0, "arias")
        assert float(mo.measures(squared).arias.mean()) == pytest.approx(3.0, rel=1e-13)


def test_parabolic_baseline_removes_a_parabola_and_lessens_the_drift():
    time = np.linspace(0.0, 10.0, 2001)
    parabola = 0.3 - 0.1 * time + 0.02 * time**2
    np.testing.assert_allclose(parabolic_baseline(parabola, 0.005), 0.0, atol=1e-11)
    rng = np.random.default_rng(2)
    noise = rng.standard_normal((3, 2001))
    corrected = parabolic_baseline(noise, 0.005)
    assert np.all((velocity(corrected, 0.005) ** 2).mean(axis=1) < (velocity(noise, 0.005) ** 2).mean(axis=1))


def test_floors_are_stacked():
    values = np.arange(24.0).reshape(2, 3, 4)
    floors = tp.motions.from_array(values[:, 0], 0.01, ["a", "b"]).expand_dims(floor=["1", "2", "roof"], axis=1).copy()
    floors.values[:] = values
    plain = mo.records(floors)
    assert [r.label for r in plain] == [f"{m} floor {f}" for m in "ab" for f in ("1", "2", "roof")]
    np.testing.assert_array_equal(np.stack([r.acceleration for r in plain]), values.reshape(6, 4))


def test_labelled_arrays_say_their_units_axes_and_steps():
    values = xr.DataArray(np.arange(12.0).reshape(4, 3), dims=("time", "motion"), coords={"time": 0.02 * np.arange(4)})
    np.testing.assert_array_equal(mo.from_array(values, 0.02).values, values.values.T)
    series = pd.Series(np.sin(np.arange(20.0)), index=0.02 * np.arange(20))
    assert mo.from_array(series, 0.02).sizes["time"] == 20
    assert mo.from_array(series.reset_index(drop=True), 0.01).sizes["time"] == 20


def test_times_of_tables_are_checked():
    shakes, times = np.sin(np.arange(20.0)), 0.02 * np.arange(20)
    for index in (pd.to_timedelta(times, unit="s"), pd.date_range("2020", periods=20, freq="20ms"), times):
        for table in (pd.Series(shakes, index=index), pd.DataFrame([shakes, -shakes], columns=index)):
            assert mo.from_array(table, 0.02).sizes["time"] == 20
            with pytest.raises(ValueError, match=r"acceleration states dt = 0.01 s, but its time steps by 0.02 s"):
                mo.from_array(table, 0.01)
    assert mo.from_array(pd.DataFrame([shakes, -shakes]), 0.01).sizes["motion"] == 2


def test_names_of_other_quantities_and_units():
    shakes = np.sin(np.arange(20.0))
    for name in ("velocity", "displacement", "acc (g)", "acc_g", "acceleration [cm/s2]"):
        for values in (xr.DataArray(shakes, dims="time", name=name), pd.Series(shakes, name=name)):
            with pytest.raises(ValueError, match="acceleration must be acceleration in m s-2, got values of the name"):
                mo.from_array(values, 0.01)
    for name in ("acceleration", "acc (m/s2)", "floor 3", "a", "acc_ms2", None):
        assert mo.from_array(xr.DataArray(shakes, dims="time", name=name), 0.01).sizes["time"] == 20
        assert mo.from_array(pd.Series(shakes, name=name), 0.01).sizes["time"] == 20


@pytest.mark.parametrize("first", [0.0, 10.0])
def test_a_row_of_times_is_doubted(first):
    shakes = np.sin(np.arange(50.0))
    with pytest.warns(ImplausibleInput, match="row 0 rises by equal steps of 0.01: times of the others?"):
        mo.from_array([first + 0.01 * np.arange(50), shakes], 0.01)
    with warnings.catch_warnings(action="error"):
        mo.from_array([shakes, shakes.cumsum()], 0.01)
        mo.from_array(0.01 * np.arange(50), 0.01)  # (alone it is a motion)


@pytest.mark.parametrize(("name", "units"), [("time", "min"), ("time", "ms"), ("dt", "ms"), ("dt", "Hz")])
def test_times_in_other_units_are_refused(name, units):
    motion = mo.from_array([0.0, 1.0, 0.0], 0.01)
    motion[name].attrs["units"] = units
    with pytest.raises(ValueError, match=f"{name} of motions must be in s, got units '{units}'"):
        mo.records(motion)
    for seconds in ("s", "seconds", ""):
        motion[name].attrs["units"] = seconds
        assert mo.records(motion)[0].dt == 0.01


def test_refused(refusal):
    refusal()
