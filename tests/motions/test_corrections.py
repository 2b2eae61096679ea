"""Baseline, filters, windows and resampling: their effect on known signals, and their record in `processing`."""

import numpy as np
import pytest
from scipy import signal

from toppling import motions as mo
from toppling.motions import corrections

DT = 0.005
TIME = np.arange(8001) * DT


def tone(*parts):
    """Return a sum of sines, each given by (amplitude, frequency in Hz)."""
    return sum(a * np.sin(2.0 * np.pi * f * TIME) for a, f in parts)


def of(*rows, dt=DT):
    return mo.from_array(np.array(rows), dt, [f"row {i}" for i in range(len(rows))])


def middle(motion):
    """Return the samples away from the ends."""
    n = motion.sizes["time"]
    return motion.values[:, n // 4 : 3 * n // 4]


EVERY = [
    (lambda m: mo.baseline(m, 2), "baseline(order=2)"),
    (lambda m: mo.bandpass(m, 0.5, 10.0), "bandpass(low=0.5 Hz, high=10 Hz, order=4, zero_phase=True)"),
    (lambda m: mo.highpass(m, 0.5, zero_phase=False), "highpass(low=0.5 Hz, order=4, zero_phase=False)"),
    (lambda m: mo.lowpass(m, 20.0, order=2), "lowpass(high=20 Hz, order=2, zero_phase=True)"),
    (lambda m: mo.taper(m, 1.0), "taper(duration=1 s)"),
    (lambda m: mo.pad(m, 1.0, 2.0), "pad(before=1 s, after=2 s)"),
    (mo.trim_husid, "trim_husid(low=0.05, high=0.95)"),
    (lambda m: mo.resample(m, 0.01), "resample(dt=0.01 s)"),
]


class TestEvery:
    @pytest.mark.parametrize(("function", "said"), EVERY, ids=[s for _, s in EVERY])
    def test_labels_units_and_what_was_done(self, function, said):
        motion = of(tone((1.0, 2.0)), tone((2.0, 3.0))).assign_coords(station=("motion", ["A", "B"]))
        before = motion.copy(deep=True)
        found = function(motion)
        assert found.dims == ("motion", "time")
        assert found.attrs == {**motion.attrs, "processing": said}
        assert found.name == "acceleration"
        assert found.motion.values.tolist() == ["row 0", "row 1"]
        assert found.station.values.tolist() == ["A", "B"]
        assert found.time.attrs["units"] == "s"
        assert float(found.time[0]) == 0.0
        np.testing.assert_allclose(found.dt.values, float(found.time[1] - found.time[0]), rtol=1e-12)
        assert mo.records(found)
        assert motion.identical(before)
        again = function(mo.taper(motion, 0.5))
        assert again.attrs["processing"] == f"taper(duration=0.5 s); {said}"

    @pytest.mark.parametrize(("function", "said"), EVERY, ids=[s for _, s in EVERY])
    def test_same_bits_alone_and_mirrored(self, function, said):
        rows = np.random.default_rng(2).standard_normal((3, TIME.size)) * np.exp(-((TIME - 20.0) ** 2) / 50.0)
        rows[2] = rows[0]
        if said.startswith("trim_husid"):
            rows[1] = rows[0]  # all motions of an array share one window
        together = function(of(*rows)).values
        np.testing.assert_array_equal(together[0], function(of(rows[0])).values[0])
        np.testing.assert_array_equal(together[2], together[0])
        np.testing.assert_array_equal(function(of(*-rows)).values, -together)

    @pytest.mark.parametrize(("function", "said"), EVERY, ids=[s for _, s in EVERY])
    def test_refuses_what_is_no_motion(self, function, said):
        with pytest.raises(TypeError, match="labelled arrays"):
            function(np.zeros(100))
        with pytest.raises(ValueError, match=r"must have dims .motion, time."):
            function(of(tone((1.0, 2.0))).isel(motion=0))
        with pytest.raises(ValueError, match="must be finite"):
            function(of(tone((1.0, 2.0))) * np.nan)


class TestBaseline:
    @pytest.mark.parametrize("order", [0, 1, 2, 5])
    def test_polynomials_vanish(self, order):
        line = sum(0.3 * (-1) ** k * (TIME / 10.0) ** k for k in range(order + 1))
        assert np.abs(mo.baseline(of(line), order)).max() < 1e-12 * np.abs(line).max()

    def test_mean_is_numpys(self):
        row = np.random.default_rng(1).standard_normal(1000)
        np.testing.assert_allclose(mo.baseline(of(row), 0).values[0], row - row.mean(), atol=1e-14)
        np.testing.assert_allclose(mo.baseline(of(row), 1).values[0], signal.detrend(row), atol=1e-13)


class TestFilters:
    def test_passes_and_stops(self):
        found = mo.bandpass(of(tone((1.0, 5.0), (1.0, 0.05), (1.0, 80.0))), 0.5, 20.0)
        n = TIME.size
        np.testing.assert_allclose(middle(found)[0], tone((1.0, 5.0))[n // 4 : 3 * n // 4], atol=2e-3)

    @pytest.mark.parametrize(("zero_phase", "gain"), [(True, 0.5), (False, np.sqrt(0.5))])
    def test_gain_at_the_corner(self, zero_phase, gain):
        found = mo.highpass(of(tone((1.0, 5.0))), 5.0, zero_phase=zero_phase)
        assert np.abs(middle(found)).max() == pytest.approx(gain, rel=1e-3)

    def test_zero_phase_mirrors_in_time_and_causal_waits(self):
        pulse = np.zeros(TIME.size)
        pulse[4000] = 1.0
        forth_and_back = mo.bandpass(of(pulse), 0.5, 20.0).values[0]
        np.testing.assert_allclose(forth_and_back, forth_and_back[::-1], atol=1e-7)
        causal = mo.bandpass(of(pulse), 0.5, 20.0, zero_phase=False).values[0]
        assert not causal[:4000].any()

    def test_longer_zeros_change_nothing(self):
        """The padding with zeros is sufficient: ten times as many zeros give the same result."""
        row = tone((1.0, 2.0)) * np.exp(-((TIME - 20.0) ** 2) / 50.0)
        found = mo.highpass(of(row), 0.1)
        wider = mo.highpass(mo.pad(of(row), 600.0, 600.0), 0.1).values[:, 120_000 : 120_000 + TIME.size]
        np.testing.assert_allclose(found.values, wider, atol=2e-5)


class TestWindows:
    def test_taper(self):
        found = mo.taper(of(np.ones(TIME.size)), 2.0).values[0]
        assert found[0] == 0.0
        assert found[200] == pytest.approx(0.5, abs=1e-12)
        assert np.all(found[400:-400] == 1.0)
        assert np.all(np.diff(found[:400]) > 0.0)
        np.testing.assert_allclose(found, found[::-1], atol=1e-12)

    def test_pad(self):
        found = mo.pad(of(np.ones(11), dt=0.1), 0.25, 0.1).values[0]
        assert found.tolist() == [0.0] * 3 + [1.0] * 11 + [0.0]

    def test_husid(self):
        """Constant shaking reaches 5 % and 95 % at these shares of its time; components share the widest window."""
        shaking = np.where((TIME >= 10.0) & (TIME < 30.0), 1.0, 0.0)
        found = mo.trim_husid(of(shaking))
        assert found.sizes["time"] * DT == pytest.approx(18.0, abs=3 * DT)
        early = np.where(TIME < 1.0, 1.0, 0.0)
        both = mo.trim_husid(of(shaking, early))
        assert both.sizes["time"] * DT == pytest.approx(29.0 - 0.05, abs=3 * DT)
        assert mo.trim_husid(of(shaking), 0.0, 1.0).values.sum() == shaking.sum()


class TestResample:
    ROW = tone((1.0, 3.0), (0.5, 40.0)) * np.exp(-((TIME - 20.0) ** 2) / 30.0)

    def at(self, time):
        waves = sum(a * np.sin(2.0 * np.pi * f * time) for a, f in ((1.0, 3.0), (0.5, 40.0)))
        return waves * np.exp(-((time - 20.0) ** 2) / 30.0)

    @pytest.mark.parametrize("dt", [0.0025, 0.001, 0.002, 0.004, 0.00244, 0.008, 0.01, 0.005])
    def test_band_limited_signals_are_exact(self, dt):
        found = mo.resample(of(self.ROW), dt)
        time = np.arange(found.sizes["time"]) * dt
        assert 40.0 - dt < time[-1] <= 40.0 + 1e-9
        assert float(found.dt[0]) == dt
        np.testing.assert_allclose(found.values[0], self.at(time), atol=3e-6)

    @pytest.mark.parametrize("parts", [1, 2, 5, 10])
    def test_finer_steps_keep_every_sample(self, parts):
        rough = np.random.default_rng(4).standard_normal(500)
        found = mo.resample(of(rough), DT / parts)
        np.testing.assert_allclose(found.values[0, ::parts], rough, atol=1e-13)

    def test_what_a_coarser_step_cannot_hold_is_removed(self):
        found = mo.resample(of(tone((1.0, 80.0)) * np.exp(-((TIME - 20.0) ** 2) / 30.0)), 0.01)
        assert np.abs(found).max() < 1e-5

    def test_there_and_back(self):
        there = mo.resample(of(self.ROW), 0.004)
        np.testing.assert_allclose(mo.resample(there, DT).values[0][:-1], self.ROW[:-1], atol=5e-6)


def test_every_correction_is_public():
    names = {
        n for n, f in vars(corrections).items() if callable(f) and getattr(f, "__module__", "") == corrections.__name__
    }
    assert {n for n in names if not n.startswith("_")} <= set(mo.__all__)


def test_refused(refusal):
    refusal()
