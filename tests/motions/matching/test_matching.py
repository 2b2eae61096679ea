"""Target spectra, motions matched to them with velocity in bounds, and the acceptance rules of AC156."""

import math
import re
import warnings

import numpy as np
import pytest

from toppling import motions as mo
from toppling.core.doubts import ImplausibleInput, noted
from toppling.core.units import STANDARD_GRAVITY as G
from toppling.motions.intensity.peaks import displacement, velocity
from toppling.motions.intensity.spectra import peak_displacements
from toppling.motions.kernels import matching as engine
from toppling.motions.matching.ac156 import checked_frequencies
from toppling.motions.matching.adjustment import matching_doubts

PLATEAU = mo.TargetSpectrum((0.05, 0.12, 0.5, 4.0), (6.0, 10.0, 10.0, 1.2), name="plateau")


def at_hz(target, *frequencies):
    return target.at(1.0 / np.array(frequencies)) / G


class TestAC156Spectrum:
    @pytest.mark.parametrize(
        ("edition", "z", "flexible", "rigid"),
        [
            ("7-16", 0.0, 1.0, 0.4),
            ("7-16", 0.25, 1.5, 0.6),
            ("7-16", 1.0, 1.6, 1.2),  # 1 + 2 z/h is 3: the ceiling holds A_FLX, not A_RIG
            ("7-22", 0.0, 1.0, 0.4),
            ("7-22", 0.4, 2.0 / 1.3, 0.8 / 1.3),
            ("7-22", 1.0, 1.6, 1.4 / 1.3),
        ],
    )
    @pytest.mark.parametrize("s_ds", [1.0, 0.75])
    def test_knots(self, edition, z, flexible, rigid, s_ds):
        target = mo.TargetSpectrum.ac156(s_ds, z, edition)
        expected = s_ds * np.array([0.1 * flexible, flexible, flexible, flexible, rigid])
        np.testing.assert_allclose(at_hz(target, 0.1, 1.3, 4.0, 8.3, 33.3), expected, rtol=1e-13)
        # straight on a log-log plot between them
        between = at_hz(target, math.sqrt(0.1 * 1.3), math.sqrt(8.3 * 33.3))
        np.testing.assert_allclose(between, s_ds * np.sqrt([0.1 * flexible * flexible, flexible * rigid]), rtol=1e-12)
        assert target.damping == 0.05

    def test_vertical_does_not_depend_on_height(self):
        low, high = (mo.TargetSpectrum.ac156(1.2, z, vertical=True) for z in (0.0, 1.0))
        assert low.sa == high.sa
        np.testing.assert_allclose(at_hz(low, 5.0, 33.3), [1.2 * 0.67, 1.2 * 0.27], rtol=1e-13)

    def test_given_amplification_and_ductility(self):
        target = mo.TargetSpectrum.ac156(1.0, 0.5, "7-22", h_f=2.0, r_mu=1.6)
        np.testing.assert_allclose(at_hz(target, 5.0, 33.3), [1.25, 0.5], rtol=1e-13)

    def test_asce_7_22_floor(self):
        """H_f = 1 + a1 z + a2 z^10 by hand: T_a 0.8 s gives a1 = 1.25, a2 = 0.75."""
        target = mo.TargetSpectrum.asce7_floor(1.0, 0.9, t_a=0.8)
        peak = 0.4 * (1.0 + 1.25 * 0.9 + 0.75 * 0.9**10) / 1.3
        np.testing.assert_allclose(at_hz(target, 33.3, 5.0), [peak, min(2.5 * peak, 1.6)], rtol=1e-13)
        # a short period: a1 at its ceiling of 2.5 and a2 at its floor of 0
        stiff = mo.TargetSpectrum.asce7_floor(1.0, 1.0, t_a=0.2)
        np.testing.assert_allclose(at_hz(stiff, 33.3), 0.4 * 3.5 / 1.3, rtol=1e-13)
        assert stiff.sa == pytest.approx(mo.TargetSpectrum.asce7_floor(1.0, 1.0).sa, rel=1e-14)


class TestTargetSpectrum:
    def test_power_law_is_exact(self):
        axis = np.geomspace(0.05, 5.0, 4)
        target = mo.TargetSpectrum(tuple(axis), tuple(3.0 * axis**-0.7))
        fine = np.geomspace(0.05, 5.0, 37)
        np.testing.assert_allclose(target.at(fine), 3.0 * fine**-0.7, rtol=1e-13)

    def test_grid_and_parts(self):
        grid = PLATEAU.grid(8)
        assert grid[[0, -1]] == pytest.approx([0.05, 4.0], rel=1e-15)
        assert np.log2(grid[1:] / grid[:-1]).max() <= 1.0 / 8.0
        part = PLATEAU.between(0.1, 1.0)
        assert part.periods == pytest.approx((0.1, 0.12, 0.5, 1.0))
        fine = np.geomspace(0.1, 1.0, 29)
        np.testing.assert_allclose(part.at(fine), PLATEAU.at(fine), rtol=1e-13)
        np.testing.assert_allclose(PLATEAU.scaled(2.0).at(fine), 2.0 * PLATEAU.at(fine), rtol=1e-13)


class TestSpectrumFile:
    @pytest.mark.parametrize(
        ("comment", "said"),
        [
            ("vertical component", "vertical"),
            ("normalised to PGA", "normalised"),
            ("Sa/PGA", "Sa/PGA"),
            ("design spectrum, q = 4", "q = 4"),
            ("Sve(T)", "Sve"),
            ("to be multiplied by a_g", "to be multiplied by a_g"),
            ("damping correction eta = 0.7", "eta = 0.7"),
            ("scaled to a PGA of 0.3 g; beta = 0.4; base 12", None),
            ("not normalised; horizontal; vertical: no", None),
        ],
    )
    def test_spectra_that_may_not_be_of_the_ground_are_doubted(self, tmp_path, comment, said):
        (tmp_path / "t.csv").write_text(f"# {comment}\nperiod (s),sa (g)\n0.1,1.0\n1.0,0.5\n", encoding="utf-8")
        with warnings.catch_warnings(record=True, action="always") as told:
            assert mo.TargetSpectrum.from_csv(tmp_path / "t.csv").sa == pytest.approx((G, 0.5 * G), rel=1e-12)
        sentence = f"line 1 says {said!r}: is it the spectrum that shakes"
        assert [sentence in str(one.message) for one in told] == [True] * (said is not None)

    @pytest.mark.parametrize(
        "text",
        [
            "period (s),sa (g)\n0.1,1.0\n1.0,0.5\n",
            "# by hand\nfrequency (Hz); Sa (m/s2)\n1.0; 4.903325\n10; 9.80665\n",
            "T [s]\tPSA [cm/s^2]\n1.0\t490.3325\n0.1\t980.665\n",
            "period_s,sa_g\n0.1,1.0\n1.0,0.5\n",
            "T (s),Se(T) (g)\n0.1,1.0\n1.0,0.5\n",
            "# damping ratio: 0.05, 5% damped, PSA in g\nperiod (s),sa (g)\n0.1,1.0\n1.0,0.5\n",
        ],
    )
    def test_same_spectrum(self, tmp_path, text):
        (tmp_path / "target.csv").write_text(text)
        target = mo.TargetSpectrum.from_csv(tmp_path / "target.csv")
        assert target.periods == pytest.approx((0.1, 1.0), rel=1e-15)
        assert target.sa == pytest.approx((G, 0.5 * G), rel=1e-12)
        assert target.name == "target.csv"

    def test_another_damping_is_given(self, tmp_path):
        (tmp_path / "target.csv").write_text("# damping 2 %\nperiod (s),sa (g)\n0.1,1\n1,2\n")
        assert mo.TargetSpectrum.from_csv(tmp_path / "target.csv", damping=0.02).damping == 0.02


class TestKernel:
    def test_peaks_agree_with_the_exact_ones(self):
        """Sampled peaks with their parabola: low by 0.5 % at most against peaks found exactly."""
        axis = np.geomspace(0.02, 8.0, 40)
        omega = 2.0 * math.pi / axis[::-1]
        for motion in mo.CloughPenzien(duration=10.0, dt=0.01).sample(3, seed=5).values:
            value, when = np.empty(40), np.empty(40)
            engine.peaks(motion, 0.01, omega, 0.05, value, when)
            exact = omega**2 * peak_displacements(motion, 0.01, 2.0 * math.pi / omega, 0.05)
            np.testing.assert_allclose(np.abs(value), exact, rtol=5e-3)
            assert np.all((when >= 0.0) & (when <= 0.01 * motion.size))

    @pytest.mark.slow
    def test_a_step_delivers_what_is_asked(self):
        """Responses at fixed times are linear in the acceleration: rows times change is the wanted change."""
        rng = np.random.default_rng(3)
        n, lines, dt = 800, 6, 0.01
        motion = rng.standard_normal(n)
        root = np.sqrt(rng.uniform(0.5, 1.0, n))
        rows, firsts, lasts = np.zeros((lines + 3, n)), np.zeros(lines, np.int64), np.zeros(lines, np.int64)
        for i in range(lines):
            firsts[i], lasts[i] = engine._oscillator_row(4.0 + 5.0 * i, 0.05, 3.0 + 0.7 * i, dt, rows[i])
        plain, wanted = rows[:lines].copy(), rng.standard_normal(lines)
        after = motion.copy()
        engine._apply_changes(after, root, rows, firsts, lasts, wanted, np.zeros(lines), lines)
        np.testing.assert_allclose(plain @ (after - motion), wanted, rtol=1e-10)
        # and it is the least change: a combination of the rows, weighted
        part = np.linalg.lstsq((plain * root).T, (after - motion) / root, rcond=None)[0]
        np.testing.assert_allclose((plain * root).T @ part, (after - motion) / root, atol=1e-12)


@pytest.fixture(scope="module")
def fifty():
    """50 motions, default bounds."""
    return mo.SpectrumCompatible(PLATEAU, duration=20.0, dt=0.005).sample(50, seed=11)


class TestSpectrumCompatible:
    @pytest.mark.slow
    def test_every_motion_has_the_spectrum(self, fifty):
        """Mean misfit over the matched periods, found exactly between samples: 3 % is asked for."""
        report = mo.matching_report(fifty, PLATEAU)
        assert report.misfit_mean.max() < 0.05
        assert report.misfit_mean.mean() < 0.03
        assert report.misfit_max.max() < 0.5
        # the misfits in the coordinates are the same up to peaks between samples
        np.testing.assert_allclose(fifty.misfit_mean, report.misfit_mean, atol=2e-3)
        np.testing.assert_allclose(fifty.misfit_max, report.misfit_max, atol=2e-2)
        # and between the matched periods
        axis = PLATEAU.grid(29)
        sa = mo.response_spectrum(fifty[:10], axis).sa
        assert float(abs(sa / PLATEAU.at(axis) - 1.0).mean("period").max()) < 0.05

    @pytest.mark.slow
    def test_velocity_and_displacement_stay_in_bounds(self, fifty):
        report = mo.matching_report(fifty, PLATEAU)
        assert bool(fifty.bounds_held.all())
        assert report.pgv_ratio.max() <= 1.15
        assert report.pgv_ratio.min() >= 1.0 / 1.15
        assert report.pgd_ratio.max() <= 1.5
        assert report.pgd_ratio.min() >= 1.0 / 1.5

    def test_without_the_bound_velocity_leaves_it(self):
        """With the same seeds and no bound, PGV varies more: the bound has an effect."""
        free = mo.SpectrumCompatible(PLATEAU, dt=0.01, pgv_bound=None, pgd_bound=None).sample(50, seed=11)
        ratio = mo.matching_report(free, PLATEAU).pgv_ratio
        outside = int(((ratio > 1.15) | (ratio < 1.0 / 1.15)).sum())
        assert outside >= 10
        # the reference is their own mean: 0.2/sqrt(32) + 0.2/sqrt(50), twice
        assert math.exp(np.log(ratio).mean()) == pytest.approx(1.0, abs=0.1)

    @pytest.mark.slow
    def test_ends_at_rest(self, fifty):
        values, dt = fifty.values, float(fifty.dt[0])
        assert np.abs(velocity(values, dt)[:, -1]).max() < 1e-12
        assert np.abs(displacement(values, dt)[:, -1]).max() < 1e-11


class TestMatch:
    def test_records_keep_their_velocity(self):
        records = mo.CloughPenzien(duration=20.0, dt=0.01).sample(8, seed=4)
        with pytest.warns(
            mo.TargetMissed, match=r"^1 of 8 motions misses the target spectrum \(Clou.* mean misfit 9\.\d %\)"
        ):
            matched = mo.match(records, PLATEAU)
        np.testing.assert_array_equal(matched.target_met, matched.misfit_mean <= 0.03)
        report = mo.matching_report(matched, PLATEAU)
        # one of the eight cannot have this spectrum with its own PGV and PGD, and its misfit shows this
        assert int((report.misfit_mean < 0.03).sum()) == 7
        assert report.misfit_mean.max() < 0.2
        assert mo.matching_report(records, PLATEAU).misfit_mean.min() > 0.15
        assert bool(matched.bounds_held.all())
        assert report.pgv_ratio.max() <= 1.15
        assert report.pgv_ratio.min() >= 1.0 / 1.15
        free = mo.matching_report(mo.match(records, PLATEAU, pgv_bound=None, pgd_bound=None), PLATEAU)
        assert abs(np.log(free.pgv_ratio)).max() > 1.5 * math.log(1.15)
        assert abs(report.end_velocity).max() < 1e-12
        assert abs(report.end_displacement).max() < 1e-11

    def test_mirror_image_and_label(self):
        """A motion with its sign changed is matched to the mirror image, bit for bit; labels stay."""
        record = mo.read(mo.example_path())
        target = PLATEAU.between(0.05, 2.0)
        one, other = mo.match(record, target), mo.match(record * -1.0, target)
        np.testing.assert_array_equal(one.values, -other.values)
        assert one.motion.values.tolist() == record.motion.values.tolist()
        assert "matched to plateau" in str(one.source.values[0])
        # motions are scaled first, so that their original amplitude has no effect
        np.testing.assert_allclose(mo.match(3.0 * record, target).values, one.values, rtol=1e-6, atol=1e-6)

    def test_what_is_met_is_silent(self):
        with warnings.catch_warnings(action="error"):
            matched = mo.match(mo.CloughPenzien(duration=20.0, dt=0.01).sample(2, seed=4), PLATEAU, tolerance=0.2)
        assert bool(matched.target_met.all())
        assert bool(matched.bounds_held.all())

    @pytest.mark.slow
    def test_generators_name_what_misses(self):
        """A spectrum with a hole that no motion has; AC156 names its own motions."""
        hole = mo.TargetSpectrum((0.05, 0.3, 0.31, 0.33, 0.34, 4.0), (8.0, 8.0, 0.5, 0.5, 8.0, 1.0))
        generator = mo.SpectrumCompatible(hole, duration=10.0, dt=0.02)
        with pytest.warns(
            mo.TargetMissed, match=r"^2 of 2 motions miss the target spectrum \(SpectrumCompatible 0-0: mean"
        ):
            made = generator.sample(2)
        assert not made.target_met.any()
        with noted(), warnings.catch_warnings(action="error"):
            generator.sample(1)
        with pytest.warns(mo.TargetMissed, match=r"\(AC156 0-1: mean misfit") as caught:
            mo.AC156(1.0, duration=10.0, dt=0.015, pgv_bound=0.02, pgd_bound=0.02).sample(2)
        assert len(caught) == 1
        beyond = made.assign_coords(target_met=("motion", [True, True]), bounds_held=("motion", [True, False]))
        (one,) = matching_doubts([beyond, mo.HalfSine(3.0, 8.0).sample(1)])
        assert re.match(r"1 of 2.*\b0-1\b", one.sentence)
        assert "pgv_bound and pgd_bound" in one.sentence

    def test_a_margin_is_no_misfit(self):
        with warnings.catch_warnings(action="error"):
            made = mo.SpectrumCompatible(PLATEAU, duration=20.0, dt=0.01, margin=0.2).sample(2)
        assert made.misfit_mean.min() > 0.1
        assert bool(made.target_met.all())

    def test_report_of_what_was_not_matched(self):
        report = mo.matching_report(mo.HalfSine(3.0, 8.0).sample(1), PLATEAU)
        assert np.isnan(report.pgv_ratio).all()
        assert all("units" in report[name].attrs for name in report.variables)


class TestAcceptance:
    def test_simulated_motions_pass(self):
        made = mo.AC156(1.0, 0.5).sample(6, seed=2)
        found = mo.ac156_acceptance(made, 1.0, 0.5)
        assert bool(found.accepted.all())
        assert mo.matching_report(made, mo.TargetSpectrum.ac156(1.0, 0.5)).misfit_mean.max() < 0.06
        # 0.85 of the motion fails the limit of 0.9; the ratios are proportional to the motion
        assert not mo.ac156_acceptance(0.85 * made, 1.0, 0.5).above_90.any()
        assert "correlation" not in found

    def test_each_rule_by_its_own_failure(self, monkeypatch):
        """Replace the spectra of a motion so that one rule fails and the others hold."""
        frequency = checked_frequencies()
        required = mo.TargetSpectrum.ac156(1.0).at(1.0 / frequency)

        def judged(**low):
            ratio = np.full(frequency.size, 1.05)
            for at, value in low.items():
                ratio[int(at[1:])] = value
            sd = ratio * required / (2.0 * math.pi * frequency) ** 2
            monkeypatch.setattr("toppling.motions.matching.ac156.peak_displacements", lambda *_: sd)
            found = mo.ac156_acceptance(mo.HalfSine(1.0, 5.0).sample(1), 1.0)
            return [bool(found[rule][0]) for rule in ("above_90", "none_adjacent", "at_most_two", "accepted")]

        assert judged() == [True] * 4
        assert judged(i3=0.95, i6=0.91, i20=0.95, i23=0.95) == [True] * 4
        assert judged(i3=0.89) == [False, True, True, False]
        assert judged(i3=0.99, i4=0.99) == [True, False, True, False]
        assert judged(i3=0.99, i5=0.99, i7=0.99) == [True, True, False, False]
        assert judged(i18=0.99, i20=0.99, i22=0.99) == [True, True, False, False]

    @pytest.mark.parametrize(("lowest", "start"), [(None, 1.3), (1.0, 1.3), (3.0, 2.25), (20.0, 3.5)])
    def test_frequencies(self, lowest, start):
        found = checked_frequencies(lowest)
        assert found[0] == start
        assert found[-1] == 33.3
        np.testing.assert_allclose(found[1:-1] / found[:-2], 2.0 ** (1.0 / 6.0), rtol=1e-14)

    def test_correlation_between_axes(self):
        made = mo.AC156(1.0, duration=12.0, dt=0.01).sample(2, seed=1)
        other = mo.AC156(1.0, duration=12.0, dt=0.01).sample(2, seed=9)
        apart = mo.ac156_acceptance(made, 1.0, other_axes=[other])
        assert bool(apart.uncorrelated.all())
        same = mo.ac156_acceptance(made, 1.0, other_axes=[other, -0.5 * made])
        np.testing.assert_allclose(same.correlation, 1.0, rtol=1e-12)
        assert not same.accepted.any()

    @pytest.mark.slow
    def test_what_is_not_enforced_is_most_of_the_velocity(self):
        """Matched from 0.1 Hz or from 1.3 Hz on: both are accepted, with velocities far apart."""
        whole, part = (mo.AC156(1.0, lowest_frequency=f).sample(4, seed=3) for f in (0.1, 1.3))
        found = [mo.ac156_acceptance(one, 1.0) for one in (whole, part)]
        assert all(bool(one.accepted.all()) for one in found)
        assert found[0].pfv.min() > 2.0 * found[1].pfv.max()


STUDY = """title = "t"
blocks = [{ width_m = 0.4, height_m = 1.8 }]
models = [{ law = "discrete" }]
[motions]
%s
number = 2
duration_s = 10
dt_s = 0.01
[ida]
im = "pga"
levels = { values = [0.5], unit = "g" }
"""


class TestStudyFile:
    def build(self, tmp_path, text):
        from toppling.studies.file.schema import read_study_file

        (tmp_path / "study.toml").write_text(STUDY % text)
        return read_study_file(tmp_path / "study.toml").motions.build(tmp_path)[0]

    def test_both_by_name(self, tmp_path):
        (tmp_path / "target.csv").write_text("period (s),sa (g)\n0.1,1.0\n4.0,0.2\n")
        made = self.build(tmp_path, 'generator = "spectrum-compatible"\ntarget = "target.csv"\npgv_bound = 0.2')
        assert made.shape == (2, 1001)
        made = self.build(tmp_path, 'generator = "ac156"\ns_ds = 0.9\nedition = "7-22"\nz_over_h = 0.5')
        assert made.shape == (2, 1001)


def test_periods_of_a_target_in_milliseconds():
    with pytest.warns(ImplausibleInput, match="no spectrum has periods above 10 s: milliseconds in place of s"):
        mo.TargetSpectrum((100.0, 500.0, 1000.0), (6.0, 8.0, 4.0))
    mo.TargetSpectrum((0.1, 1.0, 16.0), (6.0, 8.0, 0.4))  # (codes have long periods)


def test_refused(refusal):
    refusal()
