"""Targets and disaggregations from files, against the same numbers by hand; damaged ones are refused in a sentence."""

import json
import math
import re
import warnings

import numpy as np
import pytest

from toppling import motions
from toppling.core.doubts import ImplausibleInput
from toppling.core.units import STANDARD_GRAVITY as G
from toppling.motions.selection.files import read_target
from toppling.motions.selection.ruptures import read_disaggregation

TABLE = "measure,unit,median,sigma\nSa(0.5),g,0.2774773026,0.639513096\nSA(1.0),g,0.1450798388,0.6924081166\n"
TABLE += "PGV,cm/s,14.86829403,0.651475249\nd5_95,s,12.22547952,0.4301162634\n"


def written(tmp_path, text, name="target.csv"):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


class TestTables:
    def test_as_typed(self, tmp_path):
        read = read_target(written(tmp_path, f"# of a study\n{TABLE}"), "Sa(1.0)")
        medians = [0.2774773026 * G, 0.1450798388 * G, 0.1486829403, 12.22547952]
        sigmas = [0.639513096, 0.6924081166, 0.651475249, 0.4301162634]
        typed = motions.Target(["Sa(0.5)", "Sa(1.0)", "pgv", "d5_95"], medians, sigmas, given="Sa(1.0)")
        np.testing.assert_allclose(read.at(4.0).mean, typed.at(4.0).mean, rtol=1e-13)
        np.testing.assert_allclose(read.at(4.0).covariance, typed.at(4.0).covariance, rtol=1e-13)

    def test_of_ruptures(self, tmp_path):
        head, *rows = TABLE.splitlines()
        lines = [f"rupture,weight,{head}", *(f"near,0.6,{row}" for row in rows), *(f"far,0.4,{row}" for row in rows)]
        read = read_target(written(tmp_path, "\n".join(lines)), "pgv")
        assert isinstance(read, motions.Mixture)
        assert read.weights == (0.6, 0.4)
        single = read_target(written(tmp_path, TABLE), "pgv")
        np.testing.assert_allclose(read.at(0.3).covariance, single.at(0.3).covariance, atol=1e-15)

    @pytest.mark.parametrize(
        ("text", "said"),
        [
            (TABLE.replace("0.1450798388", "14.5"), "line 3 has a median of 14.5 g, beyond any shaking"),
            (f"# vertical component\n{TABLE}", "line 1 says 'vertical': is it the spectrum that shakes"),
            (f"# damping 2 %\n{TABLE}", "line 1 says 'damping 2 %'"),
            (f"# sigma in log10\n{TABLE}", "line 1 says 'log10'"),
            (f"# logarithms to base 10\n{TABLE}", "line 1 says 'base 10'"),
            (f"# sigma in per cent\n{TABLE}", "line 1 says 'sigma in per cent'"),
            (f"# 84th percentile\n{TABLE}", "line 1 says '84th percentile'"),
            (f"# median + 1 sigma\n{TABLE}", "line 1 says '+ 1 sigma'"),
            (f"# conditional on Sa(1.0) = 0.4 g\n{TABLE}", "line 1 says 'conditional on"),
        ],
    )
    def test_what_no_target_has_is_doubted(self, tmp_path, text, said):
        with pytest.warns(ImplausibleInput, match=re.escape(said)):
            read_target(written(tmp_path, text), "Sa(1.0)")

    @pytest.mark.parametrize(
        "comment",
        [
            "standard deviations of ln Sa, 5 % damped",
            "conditional on the rupture",
            "total sigma: between-event and within-event",
            "50th percentile",
            "return period 475 years, 10 % in 50 years",
        ],
    )
    def test_what_targets_say_is_not_doubted(self, tmp_path, comment):
        with warnings.catch_warnings(action="error"):
            read_target(written(tmp_path, f"# {comment}\n{TABLE}"), "Sa(1.0)")

    def test_correlations_of_a_file(self, tmp_path):
        names = ["0.5", "1.0", "pgv", "d5_95"]
        rho = np.array([[1.0, 0.5, 0.4, 0.1], [0.5, 1.0, 0.6, -0.2], [0.4, 0.6, 1.0, 0.0], [0.1, -0.2, 0.0, 1.0]])
        rows = [
            ",".join(["", *names]),
            *(",".join([name, *map(str, row)]) for name, row in zip(names, rho, strict=True)),
        ]
        path = written(tmp_path, "\n".join(rows), "correlations.csv")
        read = read_target(written(tmp_path, TABLE), "Sa(1.0)", correlations=path)
        typed = motions.Target(read.measures, read.medians, read.sigmas, rho, "Sa(1.0)")
        np.testing.assert_allclose(read.at(4.0).covariance, typed.at(4.0).covariance, rtol=1e-13)


SPECTRA = '#,,,,"generated_by=OpenQuake engine, site_id=0, lon=-122.0, lat=37.0"\npoe,stat,period,mea,std\n'
for _poe, _level in ((0.02, 0.4), (0.1, 0.2)):
    for _period, _ratio, _std in ((0.0, 0.9, 0.5), (0.5, 1.4, 0.42), (1.0, 1.0, 0.027), (2.0, 0.4, 0.46)):
        SPECTRA += f"{_poe},mean,{_period},{_level * _ratio},{_std}\n"


class TestConditionalSpectra:
    def test_medians_are_the_files_and_correlations_the_formulas(self, tmp_path):
        read = read_target(written(tmp_path, SPECTRA), "Sa(1.0)")
        assert [one.label for one in read.measures] == ["pga", "Sa(0.5)", "Sa(1.0)", "Sa(2.0)"]
        np.testing.assert_allclose(read.levels, [0.2 * G, 0.4 * G])
        found = read.at(0.4 * G)
        np.testing.assert_allclose(found.medians / G, [0.36, 0.56, 0.4, 0.16], rtol=1e-12)
        np.testing.assert_allclose(found.sigmas, [0.5, 0.42, 0.0, 0.46], rtol=1e-12)
        target = motions.Target(read.measures, np.ones(4), np.ones(4), given="Sa(1.0)")
        rho = target._covariance
        partial = (rho[1, 3] - rho[1, 2] * rho[3, 2]) / math.sqrt((1 - rho[1, 2] ** 2) * (1 - rho[3, 2] ** 2))
        assert found.covariance[1, 3] == pytest.approx(partial * 0.42 * 0.46, rel=1e-9)

    def test_a_level_near_one_of_the_file_is_that_one(self, tmp_path):
        read = read_target(written(tmp_path, SPECTRA), "Sa(1.0)")
        assert read.at(0.402 * G).medians[2] == pytest.approx(0.402 * G)


def openquake(rows, head="imt,iml,poe,mag,dist,mean"):
    return f'#,,,,,"generated_by=OpenQuake, investigation_time=50.0, mag_bin_edges=[6, 7, 8]"\n{head}\n' + "\n".join(
        rows
    )


BINS = ["SA(1.0),0.4,0.02,6.5,10.0,0.008", "SA(1.0),0.4,0.02,7.5,30.0,0.012", "SA(1.0),0.4,0.02,5.5,30.0,0.0"]


class TestDisaggregations:
    def test_of_openquake(self, tmp_path):
        found = read_disaggregation(written(tmp_path, openquake(BINS)))
        assert found.measure.label == "Sa(1.0)"
        assert found.level == pytest.approx(0.4 * G)
        np.testing.assert_allclose(found.magnitude, [6.5, 7.5])
        np.testing.assert_allclose(found.distance, [10e3, 30e3])
        rates = -np.log1p(-np.array([0.008, 0.012])) / 50.0
        np.testing.assert_allclose(found.share, rates / rates.sum(), rtol=1e-12)
        assert found.kept == pytest.approx(1.0)
        assert found.scenarios(400.0)[1] == motions.Scenario(7.5, 30e3, 400.0)

    def test_bins_of_epsilon_are_joined(self, tmp_path):
        rows = [f"SA(1.0),0.4,0.012,6.5,10.0,{eps},0.004" for eps in (-1, 0, 1)]
        found = read_disaggregation(written(tmp_path, openquake(rows, "imt,iml,poe,mag,dist,eps,mean")))
        assert found.share.tolist() == [1.0]

    def test_a_choice_of_several(self, tmp_path):
        path = written(tmp_path, openquake([*BINS, "PGA,0.5,0.01,6.5,10.0,0.01", "PGA,0.9,0.01,6.5,10.0,0.01"]))
        assert read_disaggregation(path, im="pga", level=0.9 * G).level == pytest.approx(0.9 * G)

    @pytest.mark.parametrize(
        "rows",
        [
            BINS[:1],  # 0.008 of 0.02
            [*BINS, "SA(1.0),0.4,0.02,6.8,10.0,0.02"],
        ],
    )
    def test_bins_that_are_not_all_of_their_level_are_doubted(self, tmp_path, rows):
        with pytest.warns(
            ImplausibleInput, match=r"bins of Sa\(1.0\) = 0.4 g .* its poe says 0.000404: lines are missing"
        ):
            read_disaggregation(written(tmp_path, openquake(rows)))

    def test_the_rate_of_a_level(self, tmp_path):
        """No doubt: no number for poe, or one of two realisations, whose level is that of their mean."""
        rate = -math.log1p(-0.008) / 50.0
        for row, head, column in (
            ("SA(1.0),0.4,nan,6.5,10.0,0.008", "imt,iml,poe,mag,dist,mean", "mean"),
            ("SA(1.0),0.4,0.02,6.5,10.0,0.008,0.032", "imt,iml,poe,mag,dist,rlz0,rlz1", "rlz0"),
        ):
            found = read_disaggregation(written(tmp_path, openquake([row], head)), column=column)
            assert found.rate == pytest.approx(rate, rel=1e-12)

    def services(self):
        targets = {
            "name": "Deaggregation targets",
            "data": [{"name": "1.0 s SA ground motion", "value": 0.4, "units": "g"}],
        }
        bins = [
            {"r": 11.2, "m": 6.6, "εdata": [{"εbin": 0, "value": 30.0}, {"εbin": 1, "value": 10.0}]},
            {"r": 40.0, "m": 7.8, "εdata": [{"εbin": 1, "value": 60.0}]},
        ]
        total = {"component": "Total", "summary": [targets], "data": bins}
        return {"response": [{"metadata": {"imt": {"value": "SA1P0"}}, "data": [total]}]}

    def test_of_the_services(self, tmp_path):
        found = read_disaggregation(written(tmp_path, json.dumps(self.services()), "usgs.json"))
        assert found.measure.label == "Sa(1.0)"
        assert found.level == pytest.approx(0.4 * G)
        np.testing.assert_allclose(found.share, [0.4, 0.6])
        np.testing.assert_allclose(found.distance, [11.2e3, 40e3])
        assert math.isnan(found.rate)  # (shares alone)

    def test_shares_of_what_is_kept_sum_to_one(self, tmp_path):
        """A bin of 5e-5 of the hazard is left out."""
        services = self.services()
        bins = services["response"][0]["data"][0]["data"]
        bins.append({"r": 90.0, "m": 5.0, "εdata": [{"εbin": 0, "value": 0.005}]})
        found = read_disaggregation(written(tmp_path, json.dumps(services), "usgs.json"))
        np.testing.assert_allclose(found.share, [0.4, 0.6], rtol=1e-12)
        assert found.kept == pytest.approx(100.0 / 100.005, rel=1e-12)


class TestExpected:
    def test_one_earthquake(self):
        """The numbers of an independent computation with the same models."""
        names = ["Sa(0.1)", "Sa(0.5)", "Sa(1.0)", "pgv", "d5_95"]
        found = motions.expected_target(motions.Scenario(6.5, 20e3, 400.0), "Sa(1.0)", names)
        known = [0.294692134 * G, 0.2774773026 * G, 0.1450798388 * G, 0.1486829403, 12.22547952]
        np.testing.assert_allclose(found.medians, known, rtol=2e-6)
        np.testing.assert_allclose(found.sigmas, [0.7088335489, 0.639513096, 0.6924081166, 0.651475249, 0.4301162634])

    @pytest.mark.parametrize("scenario", [(8.0, 20e3, 400.0), (6.5, 250e3, 400.0), (6.5, 20e3, 180.0)])
    def test_durations_outside_the_data_of_their_model(self, scenario):
        """One sentence, and none of pyGMM's own."""
        with pytest.warns(ImplausibleInput, match="durations .* outside the data of their model: magnitudes") as said:
            motions.expected_target(motions.Scenario(*scenario), "Sa(1.0)", ["Sa(0.5)", "d5_95"])
        assert [one.category for one in said if issubclass(one.category, UserWarning)] == [ImplausibleInput]

    def test_a_disaggregation(self):
        two = [motions.Scenario(6.5, 20e3, 400.0), motions.Scenario(7.0, 10e3, 760.0, "reverse")]
        found = motions.expected_target(two, "Sa(1.0)", weights=[3.0, 1.0])
        assert found.weights == (0.75, 0.25)
        assert {one.label for one in found.measures} >= {"Sa(1.0)", "pgv", "d5_95"}
        level = found.at(4.0)
        parts = [motions.expected_target(one, "Sa(1.0)").at(4.0) for one in two]
        np.testing.assert_allclose(level.mean, 0.75 * parts[0].mean + 0.25 * parts[1].mean, rtol=1e-12)


def test_refused(refusal):
    refusal()
