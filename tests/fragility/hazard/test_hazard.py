"""Hazard curves: laws, points, realisations; every file format as its program writes it, damaged ones, hostile ones."""

import dataclasses
import json
import re
import time
import tomllib
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from pydantic import ValidationError

import toppling as tp
from toppling.core.doubts import ImplausibleInput
from toppling.core.units import STANDARD_GRAVITY as G
from toppling.fragility import HazardCurve, HazardError, annual_rate, read_hazard
from toppling.fragility.hazard.level_weights import level_weights
from toppling.fragility.hazard.plausibility import hazard_doubts, point_off
from toppling.motions.readers.lines import HEAD_LINES, Lines, RecordError
from toppling.studies.file.hazard import hazard_table

# The layouts are those of the programs, the numbers are made up.
OPENQUAKE = (
    "#,,,,,,\"generated_by='OpenQuake engine 3.18.0-gitabf2de85b8', start_date='2023-10-03T06:09:08', "
    "checksum=2107362341, kind='{kind}', investigation_time=50.0, imt='{imt}'\"\n"
    "lon,lat,depth,poe-0.0500000,poe-0.2000000,poe-0.8000000\n"
    "-122.34000,37.72000,0.00000,5.000000E-01,1.000000E-01,2.000000E-03\n"
    "-121.95000,37.39000,0.00000,1.000000E+00,3.000000E-01,4.000000E-02\n"
    "179.99900,37.00000,0.00000,4.000000E-01,1.000000E-01,0.000000E+00\n"
)
OLD_OPENQUAKE = (
    '# quantile-0.15, investigation_time=1.0, imt="SA(0.2)", checksum=2496930815\n'
    "lon,lat,depth,poe-0.1000000,poe-0.4000000\n"
    "0.00000,0.00000,0.00000,1.000000E-02,8.000000E-04\n"
)
NSHMP = (
    "name,lon,lat,0.0025,0.0427,0.216,1.09,2.46\n"
    "Concord CA,-122.00000,37.95000,2.85280770e-03,2.84981392e-03,1.9e-03,4.1e-05,0.0\n"
    "Oakland CA,-122.25000,37.80000,2.85280766e-03,2.4e-03,1.4e-04,0.0,0.0\n"
)
PLAIN = "# a site\npga (g),rate (1/yr)\n0.1,1e-2\n0.2,3e-3\n\n0.8,1e-4\n"
REALISATIONS = (
    "Sa(1.0) (m/s2);annual rate (1/yr) weight 0.25;annual rate (1/yr) weight 0.75\n"
    "1;2e-2;1e-2\n4;2e-3;1e-3\n9;1e-4;1e-4\n"
)


def services(old):
    """A response of the Unified Hazard Tool, or of the services after it."""
    x, y = [0.01, 0.1, 1.0, 5.0], [0.2, 2e-2, 1e-4, 0.0]
    if old:
        response = [
            {
                "metadata": {"imt": {"value": imt, "display": imt}, "xlabel": "Ground Motion (g)", "xvalues": x},
                "data": [{"component": "Total", "yvalues": y}, {"component": "Fault", "yvalues": [0.1 * v for v in y]}],
            }
            for imt in ("PGA", "SA1P0")
        ]
    else:
        curve = {"component": "Total", "values": {"xs": x, "ys": y}}
        response = {"metadata": {}, "hazardCurves": [{"imt": {"value": "PGV", "display": "PGV"}, "data": [curve]}]}
    return json.dumps({"status": "success", "date": "2026-01-01", "response": response})


FILES = {
    "openquake.csv": (OPENQUAKE.format(kind="mean", imt="PGA"), {"site": 0}),
    "old.csv": (OLD_OPENQUAKE, {}),
    "total.csv": (NSHMP, {"site": 0, "im": "Sa(1.0)"}),
    "plain.csv": (PLAIN, {}),
    "realisations.csv": (REALISATIONS, {}),
    "old.json": (services(old=True), {"im": "pga"}),
    "new.json": (services(old=False), {}),
}


def saved(folder, text, name="hazard.csv"):
    path = folder / name
    path.parent.mkdir(exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


class TestLaws:
    def test_power_law_at_any_level(self):
        hazard = HazardCurve.power_law(1e-4, 2.5, "pga", units="g")
        x = np.geomspace(1e-4, 1e3, 50)
        np.testing.assert_allclose(hazard.rate_at(x * G), 1e-4 * x**-2.5, rtol=2e-14)

    @pytest.mark.parametrize("k1", [2.0, 0.5, -0.5])
    def test_second_order_law(self, k1):
        hazard = HazardCurve.log_quadratic(1e-3, k1, 0.3, "Sa(1.0)", units="g")
        summit = np.exp(-k1 / 0.6)
        x = np.geomspace(summit, 1e3, 40)
        expected = 1e-3 * np.exp(-0.3 * np.log(x) ** 2 - k1 * np.log(x))
        np.testing.assert_allclose(hazard.rate_at(x * G), expected, rtol=1e-11)
        # no hazard curve rises: left of the summit the rate stays
        np.testing.assert_allclose(hazard.rate_at(x[0] * np.array([1e-6, 0.5]) * G), expected[0], rtol=1e-12)

    def test_tails_by_rule(self):
        hazard = HazardCurve([1.0, 2.0, 4.0], [1e-2, 2e-3, 1e-4], "pgv")
        assert hazard.rate_at(0.5, below="none").item() == pytest.approx(1e-2, rel=1e-15, abs=0.0)
        assert hazard.rate_at(0.5).item() == pytest.approx(5e-2, rel=1e-14, abs=0.0)
        assert hazard.rate_at(8.0).item() == pytest.approx(5e-6, rel=1e-14, abs=0.0)
        assert hazard.rate_at(8.0, above="none").item() == hazard.rate_at(8.0, above="hold").item() == 0.0
        assert hazard.rate_at(4.0, above="hold").item() == pytest.approx(1e-4, rel=1e-15, abs=0.0)
        np.testing.assert_allclose(hazard.rate_at(np.sqrt([2.0, 8.0])), np.sqrt([2e-5, 2e-7]), rtol=1e-14)

    def test_a_level_stretch(self):
        hazard = HazardCurve([1.0, 2.0, 4.0], [1e-3, 1e-3, 1e-5], "pga")
        assert hazard.rate_at(0.1).item() == hazard.rate_at(1.5).item() == pytest.approx(1e-3, rel=1e-15)


class TestPoints:
    def test_units(self):
        for units, factor in [("g", G), ("m/s2", 1.0), ("cm/s2", 0.01), ("gal", 0.01), (None, 1.0)]:
            hazard = HazardCurve.from_points([1.0, 2.0], [2e-3, 1e-3], "Sa(0.5)", units)
            assert hazard.levels == (factor, 2.0 * factor)
            assert hazard.units == "m s-2"
        assert HazardCurve.from_points([30.0, 60.0], [2e-3, 1e-3], "pgv", "cm/s").levels == (0.3, 0.6)
        assert HazardCurve.from_points([1.0, 2.0], [2e-3, 1e-3], "cav", "g s").levels[0] == G
        with pytest.raises(ValueError, match=r"units of pgv must be one of m/s, cm/s, mm/s.*got 'g'"):
            HazardCurve.from_points([1.0, 2.0], [2e-3, 1e-3], "pgv", "g")

    def test_realisations(self):
        rows = (1e-2, 1e-3, 1e-4), (4e-2, 4e-3, 4e-4)
        both = HazardCurve([1.0, 2.0, 4.0], (), "pga", realisations=rows, weights=[0.25, 0.75])
        np.testing.assert_allclose(both.rates, [3.25e-2, 3.25e-3, 3.25e-4], rtol=1e-15)
        assert both.realisations == rows
        assert both.weights == (0.25, 0.75)
        assert both.describe()["weights"] == [0.25, 0.75]

    @pytest.mark.parametrize("weights", [None, [0.25, 0.75]])
    def test_given_rates_are_the_mean_of_their_realisations(self, weights):
        """Within the rounding of files, 0.1 %; what is given is what is used."""
        rows = np.array([[1e-2, 1e-3, 1e-4], [4e-2, 4e-3, 2e-4]])
        mean = (np.array([0.5, 0.5]) if weights is None else np.array(weights)) @ rows
        for factor in (1.0, 1.0009, 0.9991):
            given = (mean * factor).tolist()
            assert HazardCurve([1.0, 2.0, 4.0], given, "pga", "", rows, weights).rates == tuple(given)
        printed = [float(f"{rate:.4e}") for rate in mean]
        assert HazardCurve([1.0, 2.0, 4.0], printed, "pga", "", rows, weights).rates == tuple(printed)
        for factor in (1.002, 0.998):
            given = [*mean[:2], mean[2] * factor]
            with pytest.raises(
                ValueError, match=r"the weighted mean of its realisations, 0.0001.* at a level of 4, got"
            ):
                HazardCurve([1.0, 2.0, 4.0], given, "pga", "", rows, weights)

    def test_a_fractile_lies_among_its_realisations(self):
        """Its rates are not the mean, and are never made of it."""
        rows = [[1e-2, 1e-3], [2e-2, 2e-3], [9e-2, 9e-3]]
        median = HazardCurve([1.0, 2.0], rows[1], "pga", "", rows, fractile=0.5)
        assert median.rates == tuple(rows[1])
        with pytest.raises(
            ValueError, match=r"weighted mean of its realisations, 0.04 per year at a level of 1, got 0.02"
        ):
            HazardCurve([1.0, 2.0], rows[1], "pga", "", rows)
        with pytest.raises(
            ValueError, match=r"between its realisations, 0.001 to 0.009 per year at a level of 2, got 0.01"
        ):
            HazardCurve([1.0, 2.0], [9e-2, 1e-2], "pga", "", rows, fractile=0.9)
        with pytest.raises(
            ValueError, match=r"rates of a fractile curve must be given with its realisations, fractile 0.5"
        ):
            HazardCurve([1.0, 2.0], (), "pga", "", rows, fractile=0.5)

    def test_is_a_value(self):
        first, second = (HazardCurve(np.array([1.0, 2.0]), [2e-3, 1e-3], tp.motions.Sa(1.0)) for _ in range(2))
        assert first == second
        assert hash(first) == hash(second)
        assert first.im == "Sa(1.0)"
        with pytest.raises(dataclasses.FrozenInstanceError):
            first.levels = (1.0,)

    @pytest.mark.parametrize(
        ("arguments", "message"),
        [
            (([1.0], [1e-3], "pga"), "must be at least two, got 1"),
            (([0.0, 1.0], [2e-3, 1e-3], "pga"), "must be > 0 and strictly increasing, got 0 m s-2"),
            (([1.0, 3.0, 2.0], [3e-3, 2e-3, 1e-3], "pga"), "strictly increasing, got 2 m s-2 after 3 m s-2"),
            (([1.0, 2.0], [1e-3, 2e-3], "pga"), "must never rise, got 0.001 per year at 1 m s-2 and 0.002 at 2 m s-2"),
            (([1.0, 2.0], [1e-3, 0.0], "pga"), r"must be > 0 per year, got 0 at 2 m s-2: leave it out"),
            (([1.0, 2.0], [1e-3], "pga"), "must be one a level, got 1 for 2 levels"),
            (([1.0, 2.0], [np.nan, 1e-3], "pga"), "must be finite"),
            (
                ([1.0, 2.0], [2e-3, 1e-3], "pga_normalised"),
                "motion alone, got 'pga_normalised': give the hazard of pga",
            ),
            (([1.0, 2.0], [2e-3, 1e-3], "scale"), "motion alone, got 'scale'"),
            (([1.0, 2.0], [2e-3, 1e-3], "d5_95"), "must grow with the motion, got 'd5_95'"),
            (([1.0, 2.0], [2e-3, 1e-3], "pgx"), "im of a hazard curve must be one of"),
            (([1.0, 2.0], (), "pga", "", [[2e-3, 1e-3]], [0.5]), "of sum 1, got a sum of 0.5"),
            (([1.0, 2.0], (), "pga", "", [[1e-3, 2e-3]]), "rates of a realisation must never rise"),
            (([1.0, 9.0], [2e-3, 1e-3], "pga", "", None, None, 5.0), "would rise from 1 on with a curvature of 5"),
        ],
    )
    def test_refused(self, arguments, message):
        with pytest.raises(ValueError, match=message):
            HazardCurve(*arguments)

    def test_units_of_labelled_levels_and_rates(self):
        """Values of xarray may say their unit, which must be the curve's."""

        def labelled(values, units, key="units"):
            return xr.DataArray(values, dims="level", attrs={key: units})

        levels, rates = [0.2, 0.4, 0.8], [1e-2, 3e-3, 5e-4]
        plain = HazardCurve(levels, rates, "pgv")
        for units in ("m/s", "m s-1", "m s**-1", "meter / second", "m·s⁻¹", ""):
            assert HazardCurve(labelled(levels, units), labelled(rates, "1/yr"), "pgv") == plain
            assert plain.rate_at(labelled(levels, units)).tolist() == pytest.approx(rates)
        from_points = HazardCurve.from_points(labelled([20.0, 40.0, 80.0], "cm/s"), rates, "pgv", "cm/s")
        assert from_points.levels == pytest.approx(levels)
        for units, key in (("ft/s", "units"), ("cm/s", "units"), ("g", "unit"), ("m s-2", "units")):
            wrong = labelled(levels, units, key)
            for given in (
                lambda wrong=wrong: HazardCurve(wrong, rates, "pgv"),
                lambda wrong=wrong: HazardCurve.from_points(wrong, rates, "pgv"),
                lambda wrong=wrong: HazardCurve.from_points(wrong, rates, "pgv", "mm/s"),
                lambda wrong=wrong: plain.rate_at(wrong),
                lambda wrong=wrong: plain.resampled(wrong),
                lambda wrong=wrong: level_weights(wrong, plain),
            ):
                with pytest.raises(ValueError, match=rf"must be in (m s-1|mm/s), got units '{units}'"):
                    given()
        with pytest.raises(ValueError, match="rates of a hazard curve must be in 1/year, got units 'percent'"):
            HazardCurve(levels, labelled(rates, "percent"), "pgv")

    def test_other_refusals(self):
        hazard = HazardCurve([1.0, 2.0], [2e-3, 1e-3], "pga")
        with pytest.raises(ValueError, match="levels must be > 0, got -1"):
            hazard.rate_at([-1.0])
        with pytest.raises(ValueError, match="below must be one of 'extend', 'none'"):
            hazard.rate_at(1.0, below="hold")
        level = HazardCurve([1.0, 2.0, 3.0], [2e-3, 1e-3, 1e-3], "pga")
        with pytest.raises(
            ValueError, match=r"last two rates are equal \(0.001 per year\).*give above='hold' or 'none'"
        ):
            level.rate_at(1.0)


class TestFiles:
    def test_errors_of_cells_are_no_comments(self, tmp_path):
        for error in ("#N/A", "#NV", "#DIV/0!", "#NAME?"):
            path = saved(tmp_path, f"pga (g),rate (1/yr)\n0.1,0.01\n{error},0.005\n0.4,0.001\n")
            with pytest.raises(HazardError, match=f"line 3 gives pga .g. as '{re.escape(error)}'"):
                read_hazard(path)
        path = saved(tmp_path, "pga (g),rate (1/yr)\n0.1,0.01\n#N/A means nothing\n0.4,0.001\n")
        with pytest.raises(HazardError):
            read_hazard(path)

    def test_cells_of_comments(self, tmp_path):
        rows = "pga (g),rate (1/yr)\n0.1,0.01\n0.4,0.001\n"
        assert read_hazard(saved(tmp_path, f"# Quantile,0.84\n{rows}")).fractile == 0.84
        with pytest.raises(HazardError, match="names rates, a comment probabilities in 50 yr"):
            read_hazard(saved(tmp_path, f"# investigation_time,50,yr\n{rows}"))

    def test_files_of_spreadsheet_programs(self, tmp_path):
        plain = read_hazard(saved(tmp_path, "pga (g),rate (1/yr)\n0.1,0.01\n0.4,0.001\n"))
        text = "sep=;\npga (g);rate (1/yr)\n0.1;0.01\n0.4;0.001\n;\n;;\n"
        found = read_hazard(saved(tmp_path, text))
        assert (found.levels, found.rates) == (plain.levels, plain.rates)
        text = OPENQUAKE.format(kind="mean", imt="PGA")
        first, _, rest = text.partition("\n")
        mean = read_hazard(saved(tmp_path, text), site=0)
        assert read_hazard(saved(tmp_path, first + "\n" + rest.replace(",", ";")), site=0).rates == mean.rates

    def test_openquake(self, tmp_path):
        path = saved(tmp_path, OPENQUAKE.format(kind="mean", imt="PGA"))
        hazard = read_hazard(path, site=0)
        np.testing.assert_allclose(hazard.levels, np.array([0.05, 0.2, 0.8]) * G, rtol=1e-15)
        np.testing.assert_allclose(hazard.rates, -np.log1p(-np.array([0.5, 0.1, 0.002])) / 50.0, rtol=1e-15)
        assert (hazard.im, hazard.fractile) == ("pga", None)
        assert hazard.source.split(", ") == ["hazard.csv", "OpenQuake mean", "lon -122.34", "lat 37.72"]

    def test_openquake_what_has_no_logarithm_is_left_out_and_said(self, tmp_path):
        path = saved(tmp_path, OPENQUAKE.format(kind="mean", imt="PGV"))
        hazard = read_hazard(path, site=1)
        assert hazard.levels == (0.002, 0.008)
        assert "probability 1 left" in hazard.source
        across = read_hazard(path, site=(-180.0, 37.0))
        assert across.source.split(", ")[-3:-1] == ["lon 179.999", "lat 37"]

    def test_openquake_quantiles_and_the_old_comment(self, tmp_path):
        hazard = read_hazard(saved(tmp_path, OLD_OPENQUAKE))
        assert (hazard.im, hazard.fractile) == ("Sa(0.2)", 0.15)
        assert hazard.rates[0] == pytest.approx(-np.log(0.99), rel=1e-14, abs=0.0)
        newer = saved(tmp_path, OPENQUAKE.format(kind="quantile-0.84", imt="SA(1.0)"))
        assert read_hazard(newer, "Sa(1)", 0).fractile == 0.84

    def test_nshmp(self, tmp_path):
        path = saved(tmp_path, NSHMP, "SA1P0/total.csv")
        hazard = read_hazard(path, site="Oakland CA")
        assert hazard.im == "Sa(1.0)"
        np.testing.assert_allclose(hazard.levels, np.array([0.0025, 0.0427, 0.216]) * G, rtol=1e-15)
        assert hazard.rates == (2.85280766e-03, 2.4e-03, 1.4e-04)
        *source, left_out = hazard.source.split(", ")
        assert source == ["total.csv", "nshmp-haz", "Oakland CA", "lon -122.25", "lat 37.8"]
        assert left_out.startswith("2 levels")
        assert read_hazard(path, site=(-122.0, 37.95)) == read_hazard(path, site=0)
        as_probabilities = read_hazard(path, site=1, years=50.0)
        np.testing.assert_allclose(as_probabilities.rates, -np.log1p(-np.array(hazard.rates)) / 50.0, rtol=1e-14)
        nameless = saved(tmp_path, NSHMP.replace("name,", "").replace("Concord CA,", "").replace("Oakland CA,", ""))
        assert read_hazard(nameless, "Sa(1.0)", 1).rates == hazard.rates

    def test_a_response_that_a_disk_refuses_midway(self, tmp_path, monkeypatch):
        response = saved(tmp_path, json.dumps(json.loads(services(old=True)), indent=0), "response.json")
        head = iter(range(HEAD_LINES))
        fetch = Lines._fetch

        def refuse(lines):
            if next(head, None) is None:
                raise RecordError(f"{lines.file}: cannot be read (Input/output error)")
            return fetch(lines)

        monkeypatch.setattr(Lines, "_fetch", refuse)
        with pytest.raises(HazardError, match=r"response\.json: cannot be read \(Input/output error\)$"):
            read_hazard(response, "pga")

    def test_services(self, tmp_path):
        old = saved(tmp_path, services(old=True), "response.json")
        hazard = read_hazard(old, "Sa(1.0)")
        assert hazard.levels == (0.01 * G, 0.1 * G, G)
        assert hazard.rates == (0.2, 0.02, 1e-4)
        *source, left_out = hazard.source.split(", ")
        assert source == ["response.json", "USGS", "Total"]
        assert left_out.startswith("1 level")
        assert read_hazard(old, "pga", component="Fault").rates[0] == pytest.approx(0.02, rel=1e-15)
        new = read_hazard(saved(tmp_path, services(old=False)))
        assert (new.im, new.levels[0]) == ("pgv", 1e-4)
        twice = json.loads(services(old=False))
        twice["response"]["hazardCurves"] *= 2
        with pytest.raises(HazardError, match="holds several curves of pgv: keep the one of the site"):
            read_hazard(saved(tmp_path, json.dumps(twice)))
        twice = json.loads(services(old=True))
        twice["response"][0]["data"] *= 2
        with pytest.raises(HazardError, match="holds several curves of one component"):
            read_hazard(saved(tmp_path, json.dumps(twice)), "pga")

    def test_plain(self, tmp_path):
        hazard = read_hazard(saved(tmp_path, PLAIN))
        assert hazard.levels == (0.1 * G, 0.2 * G, 0.8 * G)
        assert hazard.rates == (1e-2, 3e-3, 1e-4)
        periods = "PGV [cm/s]\treturn period (yr)\n10\t20\n40\t500\n"
        assert read_hazard(saved(tmp_path, periods)).rates == (1 / 20, 1 / 500)
        for heading in ("probability in 50 yr", "Probability of exceedance in 50 years", "PoE (50 yr)"):
            text = f"Sa(1.0) (g),{heading}\n0.1,0.5\n0.4,0.02\n"
            assert read_hazard(saved(tmp_path, text)).rates[1] == pytest.approx(
                -np.log(0.98) / 50.0, rel=1e-14, abs=0.0
            )
        annual = saved(tmp_path, "pga (g),annual probability\n0.1,0.5\n0.4,0.02\n")
        assert read_hazard(annual).rates[0] == pytest.approx(np.log(2.0), rel=1e-15)
        unsaid = saved(tmp_path, "pga,poe\n0.1,0.5\n0.4,0.02\n")
        assert read_hazard(unsaid, units="g", years=10).rates[0] == pytest.approx(np.log(2.0) / 10.0, rel=1e-15)
        quoted = saved(tmp_path, '"Sa(1.0, 0.02) (g)",rate\n0.1,0.5\n0.4,0.02\n')
        assert read_hazard(quoted).im == "Sa(1.0, 0.02)"

    # (what a heading says, and the number that it gives a rate of once in 50 years)
    TIMES = (
        ("rate (1/yr)", 0.02),
        ("annual frequency of exceedance", 0.02),
        ("rate [yr^-1]", 0.02),
        ("rate of exceedance in a year", 0.02),
        ("rate per 50 years", 1.0),
        ("rate (1/50 yr)", 1.0),
        ("rate per century", 2.0),
        ("rate (1/kyr)", 20.0),
        ("return period (yr)", 50.0),
        ("return period in years", 50.0),
        ("return period (kyr)", 0.05),
        ("mean return period [centuries]", 0.5),
        ("probability in 50 yr", 0.6321205588),
        ("probability in 50 yr (%)", 63.21205588),
        ("percent probability of exceedance in 50 years", 63.21205588),
        ("probability in 0.05 kyr", 0.6321205588),
        ("annual probability", 0.0198013267),
    )

    @pytest.mark.parametrize(("heading", "number"), TIMES)
    def test_times_and_per_cent_of_a_column(self, tmp_path, heading, number):
        """Once in 50 years, by hand: 1 - exp(-1) = 0.632… in 50 years, 1 - exp(-0.02) in one."""
        rare = number * (10.0 if "return period" in heading else 0.1)
        found = read_hazard(saved(tmp_path, f"pga (g),{heading}\n0.05,{number}\n0.8,{rare}\n"))
        assert found.rates[0] == pytest.approx(0.02, rel=1e-8)

    @pytest.mark.parametrize(
        "heading",
        [
            "return period (days)",
            "return period (1/yr)",
            "return period (100 yr)",
            "rate (yr)",
            "rate (%/yr)",
            "rate (1e-3/yr)",
            "rate (0.1/yr)",
            "log10 rate (1/yr)",
            "rate std (1/yr)",
            "max rate (1/yr)",
            "median rate (1/yr)",
            "84th percentile rate (1/yr)",
            "rate of non-exceedance (1/yr)",
            "rate of occurrence (1/yr)",
            "daily rate",
            "annual rate per 50 years",
            "annual probability in 50 yr",
            "probability of non-exceedance in 50 yr",
            '"probability in 2,475 yr"',
            "probability in 50 yr (permille)",
            "probability in 50 days",
            "probability (yr)",
        ],
    )
    def test_a_heading_that_is_not_understood(self, tmp_path, heading):
        path = saved(tmp_path, f"pga (g),{heading}\n0.05,0.5\n0.8,0.02\n")
        with pytest.raises(HazardError, match=r"line 1 (must give|names a prob)"):
            read_hazard(path)

    def test_per_cent_above_a_hundred(self, tmp_path):
        path = saved(tmp_path, "pga (g),probability in 50 yr (%)\n0.05,120\n0.8,2\n")
        with pytest.raises(HazardError, match=r"line 2 gives .* as '120', must be between 0 and 100"):
            read_hazard(path)

    @pytest.mark.parametrize(
        "comment",
        [
            "# mean, investigation_time=50.0,imt=SA(1.0)",
            "# source_model_tree_path=('b1',), gsim_tree_path=('b1',), investigation_time=50.0,imt=SA(1.0)",
            "#,,,\"kind='mean', investigation_time=50.0, imt=PGV\"",
            "# investigation_time=50.0",
        ],
    )
    def test_openquake_of_another_measure(self, tmp_path, comment):
        """Without quotes, as engines until 2018 wrote it; without a measure in the comment the file's name says it."""
        text = f"{comment}\nlon,lat,depth,poe-0.1,poe-0.4\n10,45,0,1e-1,1e-2\n"
        path = saved(tmp_path, text, "hazard_curve-mean-SA(1.0).csv")
        with pytest.raises(HazardError, match=r"(Sa\(1.0\)|pgv), but pga is needed"):
            read_hazard(path, "pga")
        assert read_hazard(path).im == ("pgv" if "PGV" in comment else "Sa(1.0)")

    @pytest.mark.parametrize("kind", ["kind='max'", "kind=max", "max", "kind='std'", "std"])
    def test_openquake_of_another_kind(self, tmp_path, kind):
        text = f"# {kind}, investigation_time=50.0, imt='PGA'\nlon,lat,depth,poe-0.1,poe-0.4\n10,45,0,1e-1,1e-2\n"
        with pytest.raises(HazardError, match=r"kind '(max|std)'"):
            read_hazard(saved(tmp_path, text))

    @pytest.mark.parametrize(("kind", "doubts"), [("mean", 0), ("rlz-012", 1)])
    def test_a_realisation_of_openquake_is_no_mean(self, tmp_path, kind, doubts):
        text = f"# kind='{kind}', investigation_time=50.0, imt='PGA'\nlon,lat,poe-0.1,poe-0.4\n10,45,1e-1,1e-2\n"
        found = hazard_doubts(read_hazard(saved(tmp_path, text)))
        assert [(one.settled, kind in one.sentence) for one in found] == [(True, True)] * doubts

    def test_openquake_kind_of_the_name(self, tmp_path):
        text = "# investigation_time=50.0, imt='PGA'\nlon,lat,depth,poe-0.1,poe-0.4\n10,45,0,1e-1,1e-2\n"
        assert read_hazard(saved(tmp_path, text, "quantile_curve-0.84-PGA_12.csv")).fractile == 0.84
        with pytest.raises(HazardError, match="kind 'max'"):
            read_hazard(saved(tmp_path, text, "hazard_curve-max-PGA_12.csv"))

    def test_openquake_time_of_the_risk(self, tmp_path):
        text = (
            "# risk_investigation_time=1.0, investigation_time=50.0, imt='PGA'\nlon,lat,poe-0.1,poe-0.4\n1,2,0.1,0.01\n"
        )
        assert read_hazard(saved(tmp_path, text)).rates[0] == pytest.approx(-np.log(0.9) / 50.0, rel=1e-14)
        with pytest.raises(HazardError, match=r"states investigation_time as '50.0' and as '1.0'"):
            read_hazard(saved(tmp_path, text.replace("#", "# investigation_time=50.0,").replace("risk_", "")))

    def test_openquake_of_several_measures(self, tmp_path):
        """The table of engines until 2017: a column for each measure and level."""
        text = (
            "# mean, investigation_time=50.0\nlon,lat,PGA-0.1,PGA-0.4,SA(0.1)-0.2,SA(0.1)-0.8\n1,2,0.1,0.01,0.2,0.02\n"
        )
        path = saved(tmp_path, text)
        found = read_hazard(path, "Sa(0.1)")
        np.testing.assert_allclose(found.levels, np.array([0.2, 0.8]) * G)
        np.testing.assert_allclose(found.rates, -np.log1p([-0.2, -0.02]) / 50.0)
        with pytest.raises(HazardError, match=r"holds curves of pga, Sa\(0.1\): give im"):
            read_hazard(path)
        with pytest.raises(HazardError, match="holds no curve of pgv"):
            read_hazard(path, "pgv")

    def test_two_sites_at_one_place(self, tmp_path):
        """OpenQuake's custom_site_id tells two soils of one place apart."""
        heading = "# mean, investigation_time=50.0, imt='PGA'\ncustom_site_id,lon,lat,poe-0.1,poe-0.4\n"
        text = f"{heading}0:CD,1,2,0.1,0.01\n0:BC,1,2,0.2,0.02\n"
        path = saved(tmp_path, text)
        with pytest.raises(HazardError, match="holds 2 sites as near as 0:CD"):
            read_hazard(path, site=(1.0, 2.0))
        assert read_hazard(path, site="0:BC").rates[0] == pytest.approx(-np.log(0.8) / 50.0, rel=1e-14)

    def test_a_measure_that_nothing_names(self, tmp_path):
        """It is the one that is asked for, and said; a folder or a comment with another one is not passed over."""
        assert "no measure" in read_hazard(saved(tmp_path, NSHMP, "h/total.csv"), "pga", 0).source
        for name in ("SA1P0/total.csv", "x/total-SA1P0.csv"):
            with pytest.raises(HazardError, match=r"says Sa\(1.0\), but pga is needed"):
                read_hazard(saved(tmp_path, NSHMP, name), "pga", 0)
        for text in (NSHMP, PLAIN):
            with pytest.raises(HazardError, match=r"gives (Sa\(1.0\), but pga|pgv, but Sa\(1.0\))|gives Sa"):
                read_hazard(saved(tmp_path, f"# imt=SA(1.0)\n{text}"), "pga", 0 if text == NSHMP else None)

    def test_services_in_probabilities(self, tmp_path):
        text = services(old=True).replace('"xlabel"', '"ylabel": "Probability in 50 years", "xlabel"')
        with pytest.raises(HazardError, match="annual rates are needed"):
            read_hazard(saved(tmp_path, text), "pga")

    @pytest.mark.parametrize(
        ("labels", "message"),
        [
            ({"ylabel": "Annual Frequency of Exceedence"}, None),
            ({"ylabel": "Annual rate of exceedance (yr⁻¹)", "xlabel": "PGA (g)"}, None),
            ({"ylabel": "50-year exceedance"}, "must name 'rate .1/yr.'"),
            ({"ylabel": "Return period (yr)"}, "annual rates are needed"),
            ({"ylabel": "Rate per 100 years"}, "annual rates are needed"),
            ({"ylabel": "Annual frequency (%)"}, "whose '%' is not known"),
            ({"xlabel": "Ground Motion (m/s²)"}, "but levels in g are needed"),
            ({"xlabel": "PGA (gal)"}, "but levels in g are needed"),
            ({"xlabel": "Ground Motion (%g)"}, "but levels in g are needed"),
            ({"xlabel": "Velocity (cm/s)"}, "but levels in g are needed"),
        ],
    )
    def test_labels_of_services(self, tmp_path, labels, message):
        response = json.loads(services(old=True))
        response["response"][0]["metadata"].update(labels)
        path = saved(tmp_path, json.dumps(response))
        if message is None:
            assert read_hazard(path, "pga").rates == (0.2, 0.02, 1e-4)
            return
        with pytest.raises(HazardError, match=message):
            read_hazard(path, "pga")

    def test_the_larger_component_of_services_is_doubted(self, tmp_path):
        response = json.loads(services(old=False))
        response["response"]["metadata"] = {"maxdir": True}
        (doubt,) = hazard_doubts(read_hazard(saved(tmp_path, json.dumps(response))))
        assert "of both components" in doubt.sentence

    @pytest.mark.parametrize(
        ("name", "heading"),
        [
            ("hazard_map-mean_12.csv", "PGA-0.02,PGA-0.1"),
            ("map.csv", "PGA-0.02,PGA-0.1"),
            ("map.csv", "PGA-0.1,PGA-0.02"),
            ("map.csv", "PGA-0.002105,PGA-0.000404"),
            ("quantile_map-0.15_3.csv", "0.002105,0.000404"),
            ("hazard_uhs-mean_3.csv", "0.1~PGA,0.1~SA(0.2)"),
        ],
    )
    def test_maps_are_no_curves(self, tmp_path, name, heading):
        text = f"#,,,\"kind='mean', investigation_time=50.0\"\nlon,lat,{heading}\n9.1,45.1,0.25,0.12\n"
        with pytest.raises(HazardError, match="is a map or uniform hazard spectra, whose columns are probabilities"):
            read_hazard(saved(tmp_path, text, name), "pga")

    def test_units_of_latin_1(self, tmp_path):
        (tmp_path / "old.csv").write_bytes("pga (m/s²),rate (1/yr)\n1,1e-2\n4,1e-3\n".encode("latin-1"))
        assert read_hazard(tmp_path / "old.csv").levels == (1.0, 4.0)

    def test_plain_realisations(self, tmp_path):
        hazard = read_hazard(saved(tmp_path, REALISATIONS))
        assert hazard.weights == (0.25, 0.75)
        np.testing.assert_allclose(hazard.rates, [1.25e-2, 1.25e-3, 1e-4], rtol=1e-15)
        assert hazard.realisations[0] == (2e-2, 2e-3, 1e-4)

    @pytest.mark.parametrize(
        ("text", "options", "message"),
        [
            (OPENQUAKE.format(kind="mean", imt="PGA"), {}, "holds 3 sites: give site"),
            (OPENQUAKE.format(kind="mean", imt="PGA"), {"site": 3}, "holds 3 sites, numbered from 0, got site 3"),
            (
                OPENQUAKE.format(kind="mean", imt="PGA"),
                {"site": (1.0, 2.0)},
                r"no site within 0.01 degrees of \(1, 2\)",
            ),
            (OPENQUAKE.format(kind="mean", imt="MMI"), {"site": 0}, "im of a hazard curve must be one of"),
            (OPENQUAKE.format(kind="std", imt="PGA"), {"site": 0}, "holds standard deviations"),
            (OPENQUAKE.format(kind="mean", imt="PGA"), {"site": 0, "im": "pgv"}, "gives pga, but pgv is needed"),
            (OPENQUAKE.format(kind="mean", imt="PGA"), {"site": 0, "years": 1.0}, "states its time"),
            (
                OPENQUAKE.replace("imt=", "im=").format(kind="mean", imt="PGA"),
                {"site": 0},
                "does not say of which measure",
            ),
            (OLD_OPENQUAKE.replace("1.0, imt", "0.0, imt"), {}, "line 1 gives investigation_time as '0.0'"),
            (OLD_OPENQUAKE.replace("8.0", "x"), {}, r"line 3 gives 'poe' as 'x00000E-04', must be a finite number"),
            (OLD_OPENQUAKE.replace("1.000000E-02", "1.5"), {}, "line 3 gives 'poe' as '1.5', must be between 0 and 1"),
            (OLD_OPENQUAKE.replace("0.00000,1.0", "1.0"), {}, "line 3 has 4 columns, its heading 5"),
            (OLD_OPENQUAKE.replace("lon,", "x,"), {}, "line 2 must name lon and lat, got 'x'"),
            (OLD_OPENQUAKE.split("0.00000,", maxsplit=1)[0], {}, "holds no site"),
            (NSHMP, {"site": 0}, "does not say of which measure it is: give im"),
            (NSHMP, {"site": "Reno NV", "im": "pga"}, "holds no sites of the name 'Reno NV'"),
            (NSHMP.replace("0.0427", "M"), {"site": 0, "im": "pga"}, "at least two levels, got a column 'm'"),
            (NSHMP.replace("2.4e-03", "3e-03"), {"site": 1, "im": "pga"}, "rates of a hazard curve must never rise"),
            (PLAIN.replace(" (g)", ""), {}, "line 2 names no unit of its levels: give units"),
            (PLAIN, {"units": "g"}, "line 2 states its unit, so units must not be given"),
            (PLAIN.replace("(g)", "(furlong)"), {}, "units of pga must be one of g, gal, cm/s2, m/s2, got 'furlong'"),
            (PLAIN.replace("pga", "mood"), {}, r"line 2 must name the measure with its unit.* got 'mood \(g\)'"),
            (PLAIN.replace("rate (1/yr)", "rate (1/day)"), {}, "line 2 must give rates in 1/yr"),
            (PLAIN.replace("rate (1/yr)", "value"), {}, "line 2 must name 'rate .1/yr.'"),
            (PLAIN.replace("rate (1/yr)", "poe"), {}, "not in how many years"),
            (PLAIN.replace("rate (1/yr)", "poe in 50 yr"), {"years": 50}, "names the years of a probability"),
            (PLAIN, {"years": 50}, "names no probability, so years must not be given"),
            (PLAIN.replace("3e-3", "three"), {}, r"line 4 gives 'rate \(1/yr\)' as 'three', must be a finite number"),
            (PLAIN.replace("0.2,", "0.05,"), {}, "strictly increasing, got 0.05 g after 0.1 g"),
            (PLAIN.replace(",3e-3", ""), {}, "line 4 has 1 columns, its heading 2"),
            (PLAIN, {"site": 1}, "is a table of one site"),
            (PLAIN[:38], {}, "holds 1 levels with a rate between 0 and infinity"),
            (REALISATIONS.replace("weight 0.25", ""), {}, "realisations need a weight each"),
            (REALISATIONS.replace("0.25", "0.5"), {}, "weights must be > 0 and of sum 1, got a sum of 1.25"),
            ("", {}, "empty"),
            ("# nothing\n", {}, "holds no line that names its columns"),
            ("<html><body>", {}, "a web page or XML, not a hazard file"),
            ("pga (g)\0,rate", {}, "not text"),
            (services(old=True), {}, "holds curves of pga, Sa(1.0): give im".replace("(", r"\(").replace(")", r"\)")),
            (services(old=True), {"im": "pgv"}, "holds no curve of pgv, only of pga"),
            (services(old=True), {"im": "pga", "component": "Grid"}, "no component 'Grid', only Total, Fault"),
            (services(old=False)[:-5], {}, "is no valid JSON"),
            (services(old=False).replace("success", "busy"), {}, "is a response of status 'busy', not of success"),
            (services(old=False).replace('"ys"', '"y"'), {}, "'ys' is missing in a dict"),
            (services(old=False).replace("0.0001", "NaN"), {}, "rates must be finite numbers >= 0, got nan"),
            (services(old=False).replace("0.0001", '"low"'), {}, "rates must be finite numbers >= 0, got 'low'"),
            (services(old=False).replace("0.0001, ", ""), {}, "must have one rate a level, got 3 for 4 levels"),
            (services(old=False), {"units": "g"}, "USGS services state units"),
            ("[" * 100_000, {}, "is no valid JSON"),
            ("[]", {}, "'response' is missing in a list"),
        ],
    )
    def test_refused(self, tmp_path, text, options, message):
        """One sentence that names the file."""
        path = saved(tmp_path, text)
        with pytest.raises(HazardError, match=message) as caught:
            read_hazard(path, **options)
        assert str(caught.value).startswith(str(path))
        assert "\n" not in str(caught.value)

    def test_no_such_file(self, tmp_path):
        with pytest.raises(HazardError, match="no such file"):
            read_hazard(tmp_path / "none.csv")
        with pytest.raises(TypeError, match="path must be a path"):
            read_hazard(3)

    def test_a_large_export(self, tmp_path):
        """One of 20,000 sites: the others are counted, not converted."""
        head, row = OPENQUAKE.format(kind="mean", imt="PGA").splitlines(keepends=True)[1:3]
        path = saved(
            tmp_path, OPENQUAKE.splitlines(keepends=True)[0].format(kind="mean", imt="PGA") + head + row * 20_000
        )
        start = time.process_time()
        assert read_hazard(path, site=19_999).levels[0] == 0.05 * G
        assert time.process_time() - start < 5.0


@pytest.mark.parametrize("name", list(FILES))
def test_damaged_files_are_read_or_refused(tmp_path, name):
    """2,000 mutants over all formats: a curve, or the one error that names the file; nothing else, and nothing slow."""
    text, options = FILES[name]
    assert isinstance(read_hazard(saved(tmp_path, text, name), **options), HazardCurve)
    rng = np.random.default_rng(sorted(FILES).index(name))
    alphabet = [*"0123456789.,;-+eE#\"'()[]{}: \t\n\0ñ∞/xnaif_=", "1e999", "nan", "-inf", '""', "\r\n", "9" * 400]
    slowest, read = 0.0, 0
    for _ in range(2000 // len(FILES) + 1):
        mutant = list(text)
        for _ in range(rng.integers(1, 6)):
            at = int(rng.integers(len(mutant) + 1))
            action = rng.integers(4)
            word = alphabet[rng.integers(len(alphabet))]
            if action == 0:
                mutant[at : at + 1] = word
            elif action == 1:
                mutant.insert(at, word)
            elif action == 2:
                del mutant[at : at + int(rng.integers(1, 30))]
            else:
                mutant[at:at] = mutant[max(at - 20, 0) : at]
        path = saved(tmp_path, "".join(mutant), name)
        start = time.process_time()
        try:
            found = read_hazard(path, **options)
            assert np.isfinite(found.rate_at(found.levels, above="hold")).all()
            read += 1
        except HazardError as error:
            assert str(error).startswith(str(path))
        slowest = max(slowest, time.process_time() - start)
    assert slowest < 3.0
    assert read > 0


@pytest.mark.parametrize(
    ("levels", "rates", "im", "units", "sentence", "grave"),
    [
        # return periods in place of rates
        ([0.1, 0.4, 0.8], [9975.0, 475.0, 50.0], "pga", "g", "0.1 g is exceeded 9,975 times per year", True),
        # per cent in place of rates: 3 % per year at 0.1 g
        ([0.1, 0.4], [3.0, 0.2], "Sa(1.0)", "g", "0.1 g is exceeded 3 times per year", False),
        ([5.0, 50.0], [3.0, 0.2], "pgv", "cm/s", "10 cm/s is exceeded", False),
        # probabilities in 50 years in place of rates
        ([0.1, 0.2, 0.4], [0.39, 0.10, 0.02], "pga", "g", "0.1 g is exceeded 0.39 times per year", False),
        ([0.05, 0.1, 0.4], [0.63, 0.3, 0.02], "pga", "g", "0.1 g is exceeded 0.3 times per year", False),
        # the same at a site where 0.1 g is exceeded 1e-3 times per year: probabilities stop at 1
        ([0.005, 0.01, 0.1], [0.993, 0.95, 0.05], "pga", "g", "the rates begin at 0.993 and hardly fall", False),
        ([0.1, 0.3, 3.0], [0.993, 0.95, 0.01], "pgv", "cm/s", "the rates begin at 0.993 and hardly fall", False),
        # return periods in thousands of years
        ([196.0, 294.0, 392.0], [1.0, 1 / 2.475, 1 / 4.975], "pga", "cm/s2", "exceeded 1 times per year", False),
        # twenty times the rates of a site: PGA of both components as of one
        *(
            ([0.05, 0.1, 0.2, 0.4, 0.8, 1.6], [0.9, 0.45, 0.1, 0.03, 0.006, 0.001], im, "g", "0.45 times", False)
            for im in ("pga", "RotD50(pga)", "RotD100(pga)", "GeometricMean(pga)")
        ),
        ([0.05, 0.1, 0.2], [0.9, 0.45, 0.1], "RotD50(pgv)", "m/s", "is exceeded 0.45 times per year", False),
        # levels in per cent of g, in cm/s2, in cm/s
        ([5.0, 20.0, 80.0], [2e-2, 1.2e-3, 2e-5], "pga", "g", "2 g is exceeded more than once in 475 years", False),
        ([0.5, 2.5, 10.0], [2e-2, 2.2e-3, 2e-5], "pga", "g", "2 g is exceeded more than once in 475 years", False),
        ([50.0, 200.0, 800.0], [2e-2, 1.2e-3, 2e-5], "pga", "g", "2 g is exceeded more than once", True),
        ([5.0, 20.0, 80.0], [2e-2, 3e-3, 2e-5], "pgv", "m/s", "400 cm/s is exceeded more than once", False),
        ([0.05, 0.8], [2e-2, 2e-5], "pga", "cm/s2", "ends at 0.0008158 g", False),
        ([0.1, 2.0], [1.1e-3, 1.1e-4], "pga", "g", "rates hardly fall up to 2 g", False),  # (20 to the power 0.8 is 11)
    ],
)
def test_what_no_site_has(levels, rates, im, units, sentence, grave):
    (doubt,) = hazard_doubts(HazardCurve.from_points(levels, rates, im, units, "study file"))
    assert sentence in doubt.sentence
    assert doubt.grave == grave
    assert doubt.kind == "hazard"


@pytest.mark.parametrize(
    ("hazard", "times", "grave"),
    [
        (HazardCurve.power_law(0.01, 2.5, "pgv"), 3.162, False),
        (HazardCurve.power_law(0.3, 2.5, "pgv"), 94.87, True),
        (HazardCurve.power_law(0.01, 2.5, "pga", "g"), 3.162, False),
        (HazardCurve.power_law(0.01, 2.5, "RotD50(pga)", "g"), 3.162, False),
        # k0 exp(-0.1 ln² 0.1 - 2 ln 0.1) = 0.02 × 0.58846 × 100
        (HazardCurve.log_quadratic(0.02, 2.0, 0.1, "pgv"), 1.177, False),
    ],
)
def test_formulas_that_are_too_frequent(hazard, times, grave):
    """By hand: k0 times 10 to the power of 2.5, 316.2, at 0.1 m/s or 0.1 g, below the level of one a year."""
    (doubt,) = hazard_doubts(hazard)
    assert f"is exceeded {times:g} times per year" in doubt.sentence
    assert doubt.grave == grave


@pytest.mark.parametrize(
    "hazard",
    [
        HazardCurve.from_points([0.05, 0.1, 0.2, 0.4, 0.8], [2e-2, 6e-3, 1.2e-3, 2e-4, 2e-5], "pga", "g"),
        HazardCurve.from_points([0.01, 0.1, 1.0, 3.0], [20.0, 0.4, 2e-3, 1e-5], "Sa(0.2)", "g"),
        HazardCurve.from_points([0.01, 0.1, 1.0], [5.0, 0.15, 2e-3], "pga", "g"),
        HazardCurve.from_points([0.005, 0.01, 0.1, 1.0], [0.95, 0.6, 0.03, 1e-4], "pga", "g"),
        HazardCurve.from_points([0.1, 1.0], [0.4, 1e-2], "pga", "g", at="floor"),
        HazardCurve.from_points([0.1, 1.0], [5.0, 1e-2], "cav", "m/s"),
        HazardCurve.from_points([0.1, 1.0], [5.0, 1e-2], "RotD50(cav)", "m/s"),
        HazardCurve.from_points([0.1, 1.0], [0.45, 1e-2], "RotD50(Sa(0.3))", "g"),
        HazardCurve.power_law(1e-3, 3.0, "pga", "g"),
        HazardCurve.power_law(1e-4, 0.85, "pga", "g"),
        HazardCurve.log_quadratic(1e-4, 2.0, 0.2, "pga", "g"),
    ],
)
def test_what_sites_have(hazard):
    assert hazard_doubts(hazard) == []


@pytest.mark.parametrize("above", ["extend", "none", "hold"])
def test_a_study_may_ask_for_every_tail_that_rates_have(above):
    given = {"levels": [1.0, 4.0], "rates": [1e-2, 1e-3], "unit": "m/s2", "above": above}
    asked = hazard_table(given).risk("pga", Path())
    assert asked.above == above
    curves = xr.Dataset({"median": ((), 5.0, {"units": "m s-2"}), "dispersion": 0.4}, attrs={"im": "pga"})
    rate, none = (annual_rate(curves, asked.hazard, above=rule)["rate"].item() for rule in (above, "none"))
    assert (rate > none) == (above != "none")


def test_what_lies_above_is_not_held_below():
    with pytest.raises(ValidationError, match="hold"):
        hazard_table({"k0": 1e-4, "k": 2.5, "unit": "g", "below": "hold"})


def test_a_curve_describes_its_realisations():
    """What made a rate is all there: the branches, too."""
    rows = [[5e-3, 5e-4], [1.5e-2, 1.5e-3]]
    tree = HazardCurve([1.0, 2.0], (), "pga", realisations=rows, weights=[0.25, 0.75])
    told = tree.describe()
    assert told["realisations"] == rows
    again = HazardCurve(told["levels"], told["rates"], told["im"], "", told["realisations"], told["weights"])
    assert again.rates == tree.rates


@pytest.mark.parametrize(
    ("text", "refused"),
    [
        ("PGA (cm/s2);return period (yr)\n196;1.000\n294;2.475\n", "line 2 gives 'return period (yr)' as '1.000'"),
        ("pga (m/s2)\trate (1/yr)\n1.500\t1\n2.000\t0\n", "line 2 gives 'pga (m/s2)' as '1.500', which is ambiguous"),
        ("pga (cm/s2),return period (yr)\n196,1.000\n294,2.475\n", "write 1000 or 1.0"),
        ("pga (g);return period (yr)\n0.2;1.000\n0.3;2.475\n", ""),
        ("pga (m/s2);return period (yr)\n1.000;475\n2.5;2475\n", ""),
        ("pga (m/s2),return period (yr)\n1.000,475\n2.000,2475\n", ""),
        ("# 50-year probabilities\nPGA (g),rate\n0.1,0.3\n0.4,0.02\n", "a comment probabilities"),
        *(
            (f"# {comment}\n{heading},rate (1/yr)\n0.1,0.03\n0.4,0.002\n", message)
            for comment, heading, message in (
                ("return periods of 475 years", "PGA (g)", "names rates, a comment return periods"),
                ("PGA in cm/s2", "pga (g)", "names levels in g, a comment in cm/s2"),
                ("units: gal", "pga (g)", "names levels in g, a comment in gal"),
                ("peak ground acceleration (g)", "pga (m/s2)", "names levels in m/s2, a comment in g"),
                ("PGV in cm/s", "pgv (m/s)", "names levels in m/s, a comment in cm/s"),
                ("Uniform hazard: Sa(1.0 s)", "pga (g)", "names pga, a comment Sa(1.0)"),
                ("spectral acceleration at 0.2 s", "Sa(1.0) (g)", "names Sa(1.0), a comment Sa(0.2)"),
                ("PGV of rock", "pga (g)", "names pga, a comment pgv"),
                ("levels in %g", "pga (g)", "names levels in g, a comment in %g"),
                ("rates per 100 years", "pga (g)", "names rates in 1/yr, a comment 'per 100 years': correct"),
                ("exceedances per 50 years", "pga (g)", "a comment 'per 50 years'"),
                ("rates are x 1e-3", "pga (g)", "a comment 'x 1e-3'"),
                ("rates in units of 10^-4", "pga (g)", "a comment 'units of 10^-4'"),
                ("occurrence rates per bin (not cumulative)", "pga (g)", "a comment 'occurrence rates'"),
                ("vertical", "pga (g)", "a comment names 'vertical': levels are of horizontal shaking"),
                ("component: vertical", "pga (g)", "levels are of horizontal shaking"),
                ("IMC: Vertical", "pga (g)", "levels are of horizontal shaking"),
                ("damping 2%", "Sa(1.0) (g)", "a comment names 'damping 2%'"),
                ("damping: 2 %", "Sa(1.0) (g)", "levels are of horizontal shaking, damped by 5 %"),
                ("damping ratio 0.02", "Sa(1.0) (g)", "damped by 5 %"),
                ("Dämpfung 2 %", "Sa(1.0) (g)", "damped by 5 %"),
                ("95% confidence upper bound", "pga (g)", "a comment names a bound"),
                ("95% confidence upper limit", "pga (g)", "a comment names a bound"),
                ("upper 84 %", "pga (g)", "a comment names a bound"),
                ("84% confidence", "pga (g)", "a comment names a bound"),
                ("rates in % per year", "pga (g)", "names rates in 1/yr, a comment 'in %'"),
                ("values in per cent", "pga (g)", "a comment 'in per cent'"),
                ("values given in per mille", "pga (g)", "a comment 'per mille'"),
                ("Raten in Prozent pro Jahr", "pga (g)", "a comment 'in per cent'"),
                ("rate of occurrence per bin", "pga (g)", "a comment 'occurrence per bin'"),
                ("Raten pro 50 Jahre", "pga (g)", "a comment 'per 50 years'"),
                ("taux pour 100 ans", "pga (g)", "a comment 'per 100 years'"),
                ("tasa en 50 años", "pga (g)", "a comment 'in 50 years'"),
                ("probabilidad en 50 años", "pga (g)", "names rates, a comment probabilities"),
                ("Wahrscheinlichkeit in 50 Jahren", "pga (g)", "names rates, a comment probabilities"),
                ("Überschreitungswahrscheinlichkeiten in 50 Jahren", "pga (g)", "names rates, a comment probabilities"),
                ("probabilité sur 50 ans", "pga (g)", "names rates, a comment probabilities"),
                ("probabilità in 50 anni", "pga (g)", "names rates, a comment probabilities"),
                ("50 yılda aşılma olasılığı", "pga (g)", "names rates, a comment probabilities"),
                ("50 yilda asilma olasiligi", "pga (g)", "names rates, a comment probabilities"),
                ("période de retour 475 ans", "pga (g)", "names rates, a comment return periods"),
                ("aceleraciones en gal", "pga (g)", "names levels in g, a comment in gal"),
            )
        ),
        ("pga (g),rate\n# 2% damped\n0.1,0.03\n0.4,0.002\n", "a comment names '2% damp'"),
        ("pga (g),rate\n0.1,0.03\n0.4,0.002\n# probabilities in 50 years\n", "line 1 names rates, a comment probab"),
        *(
            (f"# {comment}\n{heading} (g),rate (1/yr)\n0.1,0.03\n0.4,0.002\n", "")
            for heading, comments in (
                ("pga", "FEMA P58; upper bound magnitude 7.5; slip rate 5 mm/kyr; annual rates of exceedance; RotD50"),
                (
                    "pga",
                    "rates per year; rate of 1/475 years; grid of 5 x 10 km; downhole vertical array; 0.002 per year",
                ),
                (
                    "pga",
                    "taux par an; jährliche Raten; tasa anual; 0.002 / an; Raten pro Jahr; Grid of 10 % of the sites; "
                    "mean with 95 % confidence intervals; discount rate 3 % per year; values in % of rock taken off; "
                    "Raten, aus Wahrscheinlichkeiten in 50 Jahren; rate of occurrence of exceedances",
                ),
                ("Sa(1.0)", "5% damped; damping 5 %; damping ratio 0.05; damping = 5; 5 % Dämpfung; damped 1 s"),
            )
            for comment in comments.split("; ")
        ),
        ("# PoE in 50 yr\nPGA (g),rate (1/yr)\n0.1,0.3\n0.4,0.02\n", "line 2 names rates"),
        ("# rates, from probabilities in 50 years\nPGA (g),rate\n0.1,0.03\n0.4,0.002\n", ""),
        *(
            (f"#,,\"generated_by='OpenQuake', {said}, imt='PGA'\"\npga (g),{heading}\n0.1,0.03\n0.4,0.002\n", message)
            for said, heading, message in (
                ("investigation_time=1.0", "probability in 50 yr", "in 50 yr, a comment probabilities in 1 yr"),
                ("investigation_time=50.0", "annual probability", "in 1 yr, a comment probabilities in 50 yr"),
                ("investigation_time=50.0", "rate (1/yr)", "names rates, a comment probabilities in 50 yr"),
                ("investigation_time=50.0", "probability in 50 yr", ""),
                ("kind='std'", "rate (1/yr)", "holds standard deviations of a hazard curve"),
            )
        ),
        (
            "# annual probabilities\npga (g),probability in 50 yr\n0.1,0.03\n0.4,0.002\n",
            "a comment probabilities in 1 yr",
        ),
        ("# PoE in 50 years\npga (g),probability in 1 yr\n0.1,0.03\n0.4,0.002\n", "a comment 'in 50 years'"),
        ("# 10 % PoE in 50 years: 0.2 g\npga (g),probability in 1 yr\n0.1,0.03\n0.4,0.002\n", ""),
        ("# values in %\npga (g),probability in 50 yr (%)\n0.1,30\n0.4,2\n", ""),
        ("# values in %\npga (g),probability in 50 yr\n0.1,0.3\n0.4,0.02\n", "a comment 'in %'"),
        ("# annual probabilities, converted\npga (g),probability in 50 yr\n0.1,0.03\n0.4,0.002\n", ""),
        *(
            (f"# {comment}\npga (g),rate\n0.1,0.03\n0.4,0.002\n", "a comment names a standard deviation")
            for comment in ("mean + 1 sigma", "mean minus one sigma", "mean - 1σ", "mean - 0.5 sigma")
        ),
        *(
            (f"# {comment}\n{measure} (g),rate\n0.1,0.03\n0.4,0.002\n", refused)
            for comment in (
                "spectral acceleration at 5 Hz",
                "SA(5 Hz)",
                "5-Hz SA",
                "0.2 s spectral acceleration",
                "SA0.2",
            )
            for measure, refused in (("pga", "names pga, a comment Sa(0.2)"), ("Sa(0.2)", ""))
        ),
        ("# vertical component\npga (g),rate\n0.1,0.03\n0.4,0.002\n", "levels are of horizontal shaking"),
        ("# 2 % damping\nSa(1.0) (g),rate\n0.1,0.03\n0.4,0.002\n", "a comment names '2 % damp'"),
        ("# 5 % damping\nSa(1.0) (g),rate\n0.1,0.03\n0.4,0.002\n", ""),
        ("# standard deviation of rates\npga (g),rate\n0.1,0.03\n0.4,0.002\n", "a comment names a standard deviation"),
    ],
)
def test_what_a_table_may_mean_otherwise(tmp_path, text, refused):
    path = saved(tmp_path, text)
    if not refused:
        assert read_hazard(path).levels
        return
    with pytest.raises(HazardError, match=re.escape(refused)):
        read_hazard(path)


@pytest.mark.parametrize(
    ("comment", "heading", "doubted"),
    [
        ("RotD100", "pga", True),
        ("larger horizontal component", "Sa(1.0)", True),
        ("maximum direction", "pga", True),
        ("SRSS of the components", "pga", True),
        ("RotD100", "RotD100(pga)", False),
        ("RotD50, geometric mean", "pga", False),
    ],
)
def test_the_larger_component_of_a_comment_is_doubted(tmp_path, comment, heading, doubted):
    found = read_hazard(saved(tmp_path, f"# {comment}\n{heading} (g),rate (1/yr)\n0.1,0.03\n0.4,0.002\n"))
    assert any("of both components" in doubt.sentence for doubt in hazard_doubts(found)) == doubted


@pytest.mark.parametrize(
    ("comment", "point"),
    [
        ("# 475 years: 0.35 g", "0.35 g once in 475 years, and the curve has it once in 1,070 years"),
        ("# PGA of 0.35 g with 10 % probability of exceedance in 50 years", "0.35 g once in 475 years"),
        ("# return period 475: 0.4 g", "0.4 g once in 475 years"),
        ("# 475 Jahre: 0.15 g", "0.15 g once in 475 years"),
        ("# 0.01 per year at 0.25 g", "0.25 g once in 100 years"),
        ("# 35 cm/s² once in 475 years", "0.03569 g once in 475 years"),
        ("k0 = 2.4e-4 # annual rate at 1 g", "1 g once in 4,170 years"),
        ("# 0.25 g once in 475 years", ""),
        ("# T_R = 2,475 yr, 0.5 g", ""),
        ("# 0.0021/yr at 0.25 g", ""),
        ("# Sa(1.0) of 0.1 g once in 475 years", ""),  # (of another measure)
        ("# 0.3 m/s once in 475 years", ""),
        ("# 0.1 g and 0.2 g in 475 years", ""),  # (which of them is not known)
        ("# levels in g, rates per year", ""),
        ("years = 50 # up to 2.5 g", ""),
    ],
)
def test_points_of_comments_that_are_off_the_curve(tmp_path, comment, point):
    """One level and one time in a line: 0.25 g once in 476 years is on this curve."""
    rows = "0.05,0.04\n0.1,0.0139\n0.25,0.0021\n0.5,0.0004\n0.8,0.0001\n"
    file = saved(tmp_path, f"# {comment.strip('# ')}\npga (g),rate (1/yr)\n{rows}")
    curve = HazardCurve([G * level for level in (0.05, 0.1, 0.25, 0.5, 0.8)], [0.04, 0.0139, 0.0021, 4e-4, 1e-4], "pga")
    off = point_off(curve, ["# other words", comment])
    assert off.startswith(point)
    assert bool(off) == bool(point)
    if comment.startswith("# ") and "Sa(" not in comment and " m/s" not in comment:
        try:
            said = [doubt.sentence for doubt in hazard_doubts(read_hazard(file)) if "a comment names" in doubt.sentence]
        except HazardError as error:  # (rates above which a comment speaks of other things)
            assert "a comment" in str(error)
        else:
            assert [point in sentence for sentence in said] == [True] * bool(point)


def test_points_of_comments_in_files_of_the_package():
    """Examples and starters: what a comment says of a hazard is on its curve."""
    package = Path(tp.__file__).parent / "studies"
    files = [*package.glob("examples/*.toml"), *package.glob("starters/*.toml")]
    found = 0
    for file in files:
        text = file.read_text(encoding="utf-8")
        table = tomllib.loads(text).get("hazard", {})
        if "k0" in table or "rates" in table:
            hazard = hazard_table(table).build("pgv" if table["unit"] == "m/s" else "pga", file.parent)
            assert not point_off(hazard, text.splitlines()), file
            found += 1
    assert found >= 10


@pytest.mark.parametrize(
    ("comment", "text"),
    [
        ("PGA on rock; multiply by S = 1.35 for soil C", "multiply by S = 1.35 for soil C"),
        ("PGA at bedrock; site factor 1.5 not applied", "factor 1.5 not applied"),
        ("values scaled by 0.5", "scaled by 0.5"),
        ("design spectrum divided by q = 4", "divided by q = 4"),
        ("T = 0.3 s", "T = 0.3 s"),
        ("period: 1.0", "period: 1.0"),
        ("PGA at the roof", "at the roof"),
        ("conditional on an M7 earthquake", "conditional on an M7 earthquake"),
        ("given that an earthquake occurs", "given that an earthquake occurs"),
        ("fault A only", "fault A only"),
        ("from the northern segment only", "from the northern segment only"),
        ("exceeded at least one of 5 sites", "at least one of 5 sites"),
        ("site factor = 1.4 to be applied", "factor = 1.4 to be applied"),
        ("background seismicity excluded", "background seismicity excluded"),
        ("branch 2 of 8", "branch 2 of 8"),
        ("weight 0.3", "weight 0.3"),
        ("log10 of PGA", "log10 of PGA"),
        ("on the valley floor; 8 branches; interpolated log-log; all sources, crustal and subduction", None),
        ("site factor 1.5 included; 84 sites; T = 475 years", None),
    ],
)
def test_factors_of_comments_are_doubted(tmp_path, comment, text):
    """Factors that nothing applies, and a period above the PGA; of other formats, too."""
    plain = read_hazard(saved(tmp_path, f"# {comment}\npga (g),rate (1/yr)\n0.1,0.03\n0.4,0.002\n"))
    others = [
        read_hazard(saved(tmp_path, f"# {comment}\n{FILES[name][0]}", name), site=0, im="pga")
        for name in ("total.csv", "openquake.csv")
    ]
    for hazard in (plain, *others):
        said = [doubt.sentence for doubt in hazard_doubts(hazard) if "is not used" in doubt.sentence]
        file = hazard.source.partition(",")[0]
        assert [sentence.startswith(f"{file}: ") and repr(text) in sentence for sentence in said] == [True] * (
            text is not None
        )


@pytest.mark.parametrize(
    ("name", "comment", "message"),
    [
        ("total.csv", "Poisson probability of exceedance in 50 years", "without years names rates, a comment probab"),
        ("total.csv", "investigation_time=50", "names rates, a comment probabilities in 50 yr"),
        ("total.csv", "vertical component", "levels are of horizontal shaking"),
        ("total.csv", "levels in m/s2", "names levels in g, a comment in m/s2"),
        ("total.csv", "Sa(1.0 s)", "names pga, a comment Sa(1.0)"),
        ("total.csv", "kind='std'", "holds standard deviations"),
        ("total.csv", "rates x 1e-3", "a comment 'x 1e-3'"),
        ("openquake.csv", "vertical component", "levels are of horizontal shaking"),
        ("openquake.csv", "levels in m/s2", "OpenQuake's format names levels in g, a comment in m/s2"),
        ("openquake.csv", "PoE in 10 years", "names probabilities in 50 yr, a comment 'in 10 years'"),
        ("total.csv", "annual rates of exceedance, mean", ""),
        ("openquake.csv", "probability of exceedance in 50 years, mean", ""),
    ],
)
def test_comments_of_other_programs(tmp_path, name, comment, message):
    path = saved(tmp_path, f"# {comment}\n{FILES[name][0]}", name)
    if not message:
        assert read_hazard(path, "pga", site=0).fractile is None
        return
    with pytest.raises(HazardError, match=re.escape(message)):
        read_hazard(path, "pga", site=0)


def test_the_starter_with_other_columns(tmp_path):
    """Its comments name all columns that it may have."""
    text = (Path(tp.__file__).parent / "studies/starters/hazard.csv").read_text(encoding="utf-8")
    for heading in ("rate (1/yr)", "probability in 10 yr", "probability in 50 yr", "return period (yr)"):
        other = text.replace(",rate (1/yr)\n", f",{heading}\n")
        rows = other.partition(f",{heading}\n")[0] + f",{heading}\n0.1,{'4' if 'return' in heading else '0.04'}\n"
        rows += f"0.4,{'400' if 'return' in heading else '0.002'}\n"
        assert not [doubt for doubt in hazard_doubts(read_hazard(saved(tmp_path, rows))) if "comment" in doubt.sentence]


def test_comments_beside_given_years(tmp_path):
    path = saved(tmp_path, f"# Poisson probability of exceedance in 50 years\n{NSHMP}")
    assert read_hazard(path, "pga", site=0, years=50).rates
    with pytest.raises(HazardError, match="names probabilities in 1 yr, a comment 'in 50 years'"):
        read_hazard(path, "pga", site=0, years=1)


def test_fractiles_of_other_programs(tmp_path):
    for name, comment, fractile in (
        ("total.csv", "84th percentile", 0.84),
        ("total.csv", "kind='quantile-0.84'", 0.84),
        ("total.csv", "kind='quantile-0.025'", 0.025),
        ("old.csv", "", 0.15),
    ):
        path = saved(tmp_path, f"# {comment}\n{FILES[name][0]}" if comment else FILES[name][0], name)
        assert read_hazard(path, None if name == "old.csv" else "pga", site=0).fractile == fractile


@pytest.mark.parametrize(
    ("comment", "fractile"),
    [
        *(
            (text, 0.84)
            for text in (
                *("84. Perzentil", "percentil 84", "84e centile", "84° percentile", "frattile 84", "Fractil 0.84"),
                *(
                    "curve 84%",
                    "Quantil 0,84",
                    "84-%-Quantil",
                    "q0.84",
                    "curve: q84",
                    "84 ème percentile",
                    "cuantil 0,84",
                ),
                *(
                    "percentile=84th",
                    "kurva 84%",
                    "mean/84th",
                    "84th-percentile UHS",
                    "0.84 quantile",
                    "84.0th percentile",
                ),
            )
        ),
        ("97.5th percentile", 0.975),
        ("5. Perzentil", 0.05),
        ("mediana", 0.5),
        ("courbe médiane", 0.5),
        ("Mittelwert, über dem Median", None),
        ("84th Street", None),
        ("behaviour factor q = 4", None),
        ("curve, 5% damped; 10% in 50 years", None),
        ("hazard curve 16% in 50 years", None),
        ("kind='quantile-0.84'", 0.84),
        ("kind='mean'", None),
        ("84th percentile curve", 0.84),
        ("16th fractile", 0.16),
        ("84% fractile", 0.84),
        ("fractile = 0.84", 0.84),
        ("Median", 0.5),
        ("median curve", 0.5),
        ("percentile = 84", 0.84),
        ("p84", 0.84),
        ("84%-Fraktil", 0.84),
        ("percentil 16", 0.16),
        ("median Vs30 of 760 m/s", None),
        ("mean, above the median", None),
    ],
)
def test_the_fractile_of_a_comment(tmp_path, comment, fractile):
    found = read_hazard(saved(tmp_path, f"# {comment}\npga (g),rate (1/yr)\n0.1,0.03\n0.4,0.002\n"))
    assert found.fractile == fractile
    assert any("not the mean" in doubt.sentence for doubt in hazard_doubts(found)) == (fractile is not None)


@pytest.mark.parametrize(
    ("heading", "first", "doubted"),
    [
        ("probability in 50 yr (%)", 0.39, True),
        ("PoE in 10 years [%]", 0.39, True),
        ("probability in 50 yr (%)", 10.0, False),
        ("annual probability (%)", 0.39, False),
    ],
)
def test_fractions_under_per_cent(tmp_path, heading, first, doubted):
    hazard = read_hazard(saved(tmp_path, f"pga (g),{heading}\n0.1,{first}\n0.4,0.02\n"))
    assert ["below 1: fractions" in doubt.sentence for doubt in hazard_doubts(hazard)] == [True] * doubted


def test_cut_within_the_last_number(tmp_path):
    """Rates to six decimals; 0.000034 without its last digit is 0.00003."""
    rows = [f"{0.1 * 1.5**i:.2f},{0.07 * 0.5**i:.6f}" for i in range(12)]
    path = tmp_path / "site.csv"
    path.write_text("\n".join(["pga (g),rate (1/yr)", *rows]), encoding="utf-8")
    assert read_hazard(path).rates[-1] == 0.000034
    path.write_text(path.read_text(encoding="utf-8")[:-1], encoding="utf-8")
    with pytest.raises(HazardError, match=r"site.csv: line 13 ends in '0.00003' without a line end, .* truncated"):
        read_hazard(path)


def test_return_periods_as_rates_are_doubted():
    with pytest.warns(ImplausibleInput, match="rate of 475 per year is beyond any of damage: is it a return period"):
        tp.fragility.probability_in(475.0, 50.0)
    np.testing.assert_allclose(tp.fragility.probability_in(np.array([1 / 475, 20.0])), [0.0999, 1.0], atol=1e-4)
    assert tp.fragility.probability_in(1, 50) == tp.fragility.probability_in(1.0, 50.0)
    with pytest.warns(ImplausibleInput, match="rate of 50.* per year is beyond any of damage: is 0.00210526 a rate"):
        tp.fragility.rate_from_probability(0.1, 1 / 475)
