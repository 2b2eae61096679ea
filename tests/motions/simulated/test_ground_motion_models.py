"""Ground-motion models: pyGMM held to OpenQuake's hazardlib, and ensembles held to the models."""

import math
from pathlib import Path

import numpy as np
import pytest
import scipy
import xarray as xr
from check_facts import numbers_in
from study_texts import CABINET
from table_rows import table_rows

import toppling as tp
from toppling import motions as mo
from toppling.core.doubts import ImplausibleInput
from toppling.core.units import STANDARD_GRAVITY as G
from toppling.studies import StudyError

PERIODS = (0.1, 0.2, 0.3, 0.5, 1.0, 2.0, 3.0, 4.0)
HAZARDLIB = table_rows(Path(__file__).with_name("hazardlib.csv"))
"""openquake.hazardlib 3.26.2, BooreEtAl2014 and ChiouYoungs2014, by magnitude, R_rup = R_jb = R_x, V_S30 and faulting.

At a dip of 90° and Ztor = 0, with Z1.0 by Chiou and Youngs' formula of V_S30: medians and dispersions.
"""


class TestModels:
    @pytest.mark.parametrize("row", HAZARDLIB)
    def test_as_hazardlib_computes_them(self, row):
        """Two programs of the same papers, to 1e-4."""
        magnitude, km, vs30 = (float(row[name]) for name in ("magnitude", "distance_km", "vs30"))
        found = mo.expected_motions(mo.Scenario(magnitude, 1e3 * km, vs30, row["faulting"]), row["model"], PERIODS)
        ours = [float(found.pga) / G, 100.0 * float(found.pgv), *(found.sa.values / G)]
        ours += [float(found.pga_dispersion), float(found.pgv_dispersion), *found.sa_dispersion.values]
        np.testing.assert_allclose(ours, [*map(float, [*row.values()][6:])], rtol=1e-4)
        assert all("units" in found[name].attrs for name in found.variables)

    def test_a_buried_rupture_is_nearer_at_the_surface(self):
        """R_jb² = R_rup² - depth²: at the same rupture distance BSSA14, which knows R_jb alone, shakes more."""
        deep, same = mo.Scenario(6.5, 20e3, 760.0, depth=12e3), mo.Scenario(6.5, 16e3, 760.0)
        assert float(mo.expected_motions(deep).pga) == pytest.approx(float(mo.expected_motions(same).pga), rel=1e-12)

    def test_a_distance_in_km_is_doubted(self):
        with pytest.warns(ImplausibleInput, match="a rupture at a distance of 20 m: km in place of m"):
            mo.expected_motions(mo.Scenario(6.5, 20.0, 760.0))


class TestOver:
    SCENARIO = mo.Scenario(6.5, 20e3, 760.0)

    def test_motions_of_known_strength(self):
        """Twice and half the model's PGA: a median of 1 in the middle of three, and a dispersion of ln 2."""
        pga = float(mo.expected_motions(self.SCENARIO).pga)
        wave = np.sin(np.pi * np.arange(1001) / 1000.0) * np.sin(0.2 * np.arange(1001))
        wave /= np.abs(wave).max()
        three = mo.from_array(np.array([0.5, 1.0, 2.0])[:, None] * pga * wave, 0.01)
        found = mo.over_model(three, self.SCENARIO)
        assert found["measure"].values.tolist() == ["pga", "pgv", *(f"Sa({one!r})" for one in PERIODS)]
        assert float(found["ratio"][0]) == pytest.approx(1.0, rel=1e-9)
        np.testing.assert_allclose(found["dispersion"].values, math.log(2.0), rtol=1e-9)
        assert float(found["model_dispersion"][0]) == pytest.approx(0.605086, abs=1e-6)

    @pytest.mark.parametrize(("options", "stated"), [({}, [1.65, 1.55]), ({"arias_constant": -2.2962}, [1.2, 1.1])])
    def test_what_the_scenario_generator_says_of_itself(self, options, stated):
        """The figures of its docstring, to three standard errors of the median of 200 motions: 3 1.25 0.6/sqrt(200)."""
        made = mo.SiteBasedScenario(6.5, 20e3, 760.0, dt=0.01, **options)
        found = mo.over_model(made.sample(200, seed=0), made.scenario, periods=())
        np.testing.assert_allclose(np.log(found["ratio"].values), np.log(stated), rtol=0, atol=0.16)


class TestGenerators:
    def test_what_they_claim(self):
        assert mo.SiteBasedScenario(6.8, 15e3, 700.0, "reverse").scenario == mo.Scenario(6.8, 15e3, 700.0, "reverse")
        assert mo.NearFault(7.0, 8e3, 500.0, depth=2e3).scenario == mo.Scenario(7.0, 8e3, 500.0, depth=2e3)
        assert mo.Seismological(6.0, 30e3).scenario == mo.Scenario(6.0, 30e3, 760.0)
        assert mo.Seismological(6.0, 30e3, site="flat").scenario is None
        assert mo.CloughPenzien().scenario is None

    def test_what_lies_outside_of_the_data(self):
        assert mo.SiteBasedScenario(6.5, 20e3, 700.0).outside == ""
        assert numbers_in(mo.SiteBasedScenario(6.0, 8e3, 400.0).outside) == [6, 6.1, 7.7, 8, 10, 100, 400, 600]
        assert mo.CloughPenzien().outside == ""

    STUDY = f"""
title = "A scenario"
{CABINET}
[motions]
generator = "site-based-scenario"
number = 12
seed = 3
magnitude = 5.5
distance_m = 20000
vs30_m_s = {{vs30}}
"""

    def study(self, tmp_path, analysis, vs30=700, top=""):
        path = tmp_path / "study.toml"
        path.write_text(top + self.STUDY.format(vs30=vs30) + analysis, encoding="utf-8")
        return tp.Study.from_toml(path)

    def test_studies_note_it(self, tmp_path):
        """What lies outside of the data always; the strength where motions are not scaled."""
        ida = '[ida]\nlevels = { from = 0.1, to = 1.0, number = 3, unit = "g" }\n'
        scaled = self.study(tmp_path, ida)
        (note,) = scaled.notes
        assert numbers_in(note)[-3:] == [5.5, 6.1, 7.7]
        assert numbers_in(scaled.run().attrs["scenario"])[:3] == [5.5, 20, 700]
        cloud = self.study(tmp_path, "[cloud]\n")
        assert [one.kind for one in cloud.doubts] == ["scenario", "scenario"]
        assert numbers_in(cloud.notes[1])[:2] == [5.5, 20]
        assert self.study(tmp_path, "[cloud]\n", top='accept = ["scenario"]\n').notes == []

    @pytest.mark.slow
    def test_matched_motions(self, tmp_path):
        """A note of the strength goes away, PGV has the model's distribution, and the key is of scenarios alone."""
        path = tmp_path / "study.toml"
        text = self.STUDY.format(vs30=700).replace("number = 12", "number = 60\nmatch_gmm = true")
        path.write_text(text + "[cloud]\n", encoding="utf-8")
        study = tp.Study.from_toml(path)
        (doubt,) = study.doubts
        assert numbers_in(doubt.sentence)[-3:] == [5.5, 6.1, 7.7]
        pgv = mo.measures(study.design.motions[0], ["pgv"])["pgv"]
        plain = mo.SiteBasedScenario(5.5, 20e3, 700.0).sample(60, seed=3)
        scaled = mo.scale_to_model(plain, mo.Scenario(5.5, 20e3, 700.0), seed=3)
        np.testing.assert_array_equal(pgv, mo.measures(scaled, ["pgv"])["pgv"])
        path.write_text(text.replace("site-based-scenario", "clough-penzien").partition("magnitude")[0] + "[cloud]\n")
        with pytest.raises(StudyError, match=r"unknown key 'motions\.match_gmm'"):
            tp.Study.from_toml(path)


class TestScaleToModel:
    AT = mo.Scenario(7.0, 20e3, 760.0)

    @pytest.mark.parametrize("im", ["pgv", "pga", "Sa(1.0)"])
    def test_distribution(self, im):
        """The logarithms are normal with the model's mean and dispersion."""
        plain = mo.Seismological(7.0, 20e3, dt=0.02).sample(300, seed=4)
        found = np.log(mo.measures(mo.scale_to_model(plain, self.AT, im=im, seed=4), [im])[im].values)
        expected = mo.expected_motions(self.AT, periods=[1.0])
        name = im if im != "Sa(1.0)" else "sa"
        median, spread = float(np.ravel(expected[name])[0]), float(np.ravel(expected[f"{name}_dispersion"])[0])
        assert scipy.stats.kstest(found, "norm", (np.log(median), spread)).pvalue > 0.01

    def test_parts_and_labels(self):
        generator = mo.Seismological(7.0, 20e3, dt=0.02)
        whole = mo.scale_to_model(generator.sample(4, seed=2), self.AT, seed=2)
        part = mo.scale_to_model(generator.sample(2, seed=2, first=1), self.AT, seed=2, first=1)
        xr.testing.assert_identical(whole.isel(motion=slice(1, 3)), part)
        assert whole.name == generator.sample(1).name
        assert whole.dims == ("motion", "time")

    def test_the_library_says_nothing_of_its_own(self, caplog, recwarn):
        mo.expected_motions(mo.Scenario(3.0, 20e3, 760.0), "CY14")
        assert not caplog.records
        assert not [one for one in recwarn if "mag" in str(one.message)]


def test_refused(refusal):
    refusal()
