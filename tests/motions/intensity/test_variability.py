"""Spectral variability: what it is in nature, which ensembles have it, and how little data still say so."""

import csv
import math

import numpy as np
import pytest
import scipy
from shared_cases import SHARED, needs_shared

from toppling import motions as mo
from toppling.core.streams import stream
from toppling.motions.arrays import records
from toppling.motions.intensity.variability import (
    LEAST_SHAPE,
    LEAST_VELOCITY,
    LONG,
    NATURAL_SHAPE,
    NATURAL_VELOCITY,
    SHORT,
    Variability,
    pooled,
    variability,
)
from toppling.motions.simulated.scenario import MARGINALS

SCENARIO = (6.8, 20e3, 760.0)


def of(generator, number=60, seed=1):
    return variability(records(generator.sample(number, seed=seed)))


class TestNature:
    @needs_shared
    def test_values(self):
        """Total dispersions of Boore et al. (2014) and the correlations of Baker and Bradley (2017)."""
        lines = (SHARED / "data/bb17_correlations.csv").read_text(encoding="utf-8").splitlines()
        rows = list(csv.reader(line for line in lines if not line.startswith("#")))
        table = {row[0]: dict(zip(rows[0][1:], row[1:], strict=True)) for row in rows[1:]}
        model = mo.expected_motions(mo.Scenario(*SCENARIO), periods=(SHORT, LONG))
        short, long = model["sa_dispersion"].values
        velocity = (float(model["pga_dispersion"]), float(model["pgv_dispersion"]), float(table["pga"]["pgv"]))
        shape = (short, long, float(table[f"{SHORT:g}"][f"{LONG:g}"]))
        for (a, b, r), stated in ((velocity, NATURAL_VELOCITY), (shape, NATURAL_SHAPE)):
            assert math.sqrt(a * a + b * b - 2.0 * r * a * b) == pytest.approx(stated, abs=0.006)

    @needs_shared
    def test_recorded_motions(self):
        """Records of many magnitudes and distances differ more than those of one."""
        files = sorted((SHARED / "data/records/suite").glob("*.AT2"))
        found = variability([one for file in files for one in records(mo.read(file))])
        assert found.freedom == len(files) - 1
        assert found.velocity > NATURAL_VELOCITY
        assert found.shape > NATURAL_SHAPE
        assert not found.narrow


class TestGenerators:
    @pytest.mark.slow
    @pytest.mark.parametrize(
        "generator",
        [
            mo.KanaiTajimi(),
            mo.CloughPenzien(),
            mo.EvolutionaryCloughPenzien(),
            mo.Seismological(*SCENARIO[:2]),
            mo.SiteBased(),
            mo.AC156(1.0),
        ],
        ids=lambda one: type(one).__name__,
    )
    def test_one_spectrum(self, generator):
        assert of(generator).narrow

    @pytest.mark.parametrize(
        "generator",
        [
            mo.KanaiTajimi(omega_g_dispersion=0.5, xi_g_dispersion=0.6),
            mo.CloughPenzien(omega_g_dispersion=0.5, xi_g_dispersion=0.6),
            mo.SiteBasedScenario(*SCENARIO),
            mo.NearFault(7.0, 8e3, 500.0, with_pulse="always"),
            mo.NearFault(7.0, 8e3, 500.0, with_pulse="never"),
        ],
        ids=lambda one: type(one).__name__,
    )
    def test_many_spectra(self, generator):
        assert not of(generator).narrow

    @pytest.mark.slow
    @pytest.mark.parametrize("kind", [mo.KanaiTajimi, mo.CloughPenzien])
    def test_random_ground(self, kind):
        """The dispersion that the docstring names."""
        found = of(kind(omega_g_dispersion=0.5, xi_g_dispersion=0.6))
        assert found.velocity == pytest.approx(0.35, abs=0.05)


class TestStatistics:
    def test_definition(self):
        """Of the measures by their names, whatever the motions are scaled by."""
        motions = mo.CloughPenzien(duration=10.0, dt=0.01).sample(5, seed=2)
        pga, pgv, long, short = (
            np.log(mo.measures(motions, [one])[one].values) for one in ("pga", "pgv", "Sa(1.0)", "Sa(0.2)")
        )
        found = variability(records(motions * np.array([1.0, 3.0, 0.1, 7.0, 2.0])[:, None]))
        assert found.freedom == 4
        assert found.velocity == pytest.approx(np.std(pgv - pga, ddof=1), rel=1e-9)
        assert found.shape == pytest.approx(np.std(long - short, ddof=1), rel=1e-9)

    def test_motions_of_zeros_and_single_ones(self):
        one = mo.CloughPenzien(duration=10.0, dt=0.01).sample(1)
        assert variability(records([one, 0.0 * one.assign_coords(motion=["still"])])).freedom == 0
        assert not variability(records(one)).narrow

    def test_ensembles_together(self):
        """Within each of them: the differences between ensembles do not count."""
        parts = [Variability(3, 0.1, 0.5), Variability(0, math.nan, math.nan), Variability(6, 0.4, 0.2)]
        found = pooled(parts)
        assert found.freedom == 9
        assert found.velocity == pytest.approx(math.sqrt((3 * 0.01 + 6 * 0.16) / 9))
        assert found.shape == pytest.approx(math.sqrt((3 * 0.25 + 6 * 0.04) / 9))
        assert pooled([]).freedom == 0

    def test_confidence(self):
        """Of samples from the least variability allowed, one in twenty is called narrow for each of the two."""
        random = np.random.default_rng(5)
        freedom, trials = 11, 4000
        spread = np.sqrt(random.chisquare(freedom, (trials, 2)) / freedom) * [LEAST_VELOCITY, LEAST_SHAPE]
        called = sum(Variability(freedom, *one).narrow for one in spread)
        expected = 1.0 - 0.95**2
        assert scipy.stats.binomtest(called, trials, expected).pvalue > 1e-3


class TestRandomParameters:
    def test_each_motion_is_of_its_own_parameters(self):
        """The same noise through the filter with the parameters that follow it in the stream of the motion."""
        wide = mo.CloughPenzien(duration=10.0, dt=0.01, omega_g_dispersion=0.5, xi_g_dispersion=0.6)
        motions = wide.sample(4, seed=9)
        for i in range(4):
            random = stream(9, i)
            random.standard_normal(1001)
            ground, damping = random.standard_normal(2)
            own = mo.CloughPenzien(
                5.0 * math.pi * math.exp(0.5 * ground), 0.6 * math.exp(0.6 * damping), duration=10.0, dt=0.01
            )
            np.testing.assert_array_equal(motions.values[i], own.sample(1, seed=9, first=i).values[0])

    def test_parts_of_an_ensemble(self):
        wide = mo.KanaiTajimi(duration=5.0, dt=0.01, omega_g_dispersion=0.5)
        whole = wide.sample(5, seed=3).values
        np.testing.assert_array_equal(whole[2:4], wide.sample(2, seed=3, first=2).values)

    def test_dispersions_of_the_source(self):
        """The documented dispersions are of lognormals with the source's coefficients of variation, rounded up."""
        (shape, _), (a, b, lower, upper) = MARGINALS[3].args, MARGINALS[5].args
        share, width = scipy.stats.beta(a, b), upper - lower
        found = (1.0 / math.sqrt(shape), width * share.std() / (lower + width * share.mean()))
        assert found == pytest.approx((0.49, 0.64), abs=0.006)
        dispersions = [math.sqrt(math.log1p(one * one)) for one in found]
        assert dispersions == pytest.approx([0.47, 0.58], abs=0.006)

    @pytest.mark.parametrize("value", [-0.1, 2.1, math.nan, "much"])
    def test_refused(self, value):
        with pytest.raises((TypeError, ValueError), match="xi_g_dispersion"):
            mo.KanaiTajimi(xi_g_dispersion=value)
