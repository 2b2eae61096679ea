"""Hazard curves: laws, points, realisations; every file format as its program writes it, damaged ones, hostile ones."""

import json
import time
import tomllib
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from damage import damaged
from pydantic import ValidationError
from table_rows import table_rows

import toppling as tp
from toppling.core.doubts import ImplausibleInput
from toppling.core.units import STANDARD_GRAVITY as G
from toppling.fragility import HazardCurve, HazardError, annual_rate, read_hazard
from toppling.fragility.hazard.level_weights import level_weights
from toppling.fragility.hazard.plausibility import hazard_doubts, point_off
from toppling.fragility.hazard.reading import INVENTED
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


PARTS = {
    "<old services>": services(old=True),
    "<new services>": services(old=False),
    "<engine>": OPENQUAKE.partition("kind=")[0],
    "<sites>": OPENQUAKE.partition("\n")[2],
    "<old>": OLD_OPENQUAKE,
    "<nshmp>": NSHMP,
    "<plain>": PLAIN,
    "<realisations>": REALISATIONS,
    "<two rates>": "0.1,0.03\n0.4,0.002\n",
    "<brackets>": "[" * 100_000,
}
"""What stands in place of words in brackets in the texts of hazards.csv."""

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


def relabelled(folder, **labels):
    response = json.loads(services(old=True))
    response["response"][0]["metadata"].update(labels)
    return saved(folder, json.dumps(response))


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

    def test_realisations(self):
        rows = (1e-2, 1e-3, 1e-4), (4e-2, 4e-3, 4e-4)
        both = HazardCurve([1.0, 2.0, 4.0], (), "pga", realisations=rows, weights=[0.25, 0.75])
        np.testing.assert_allclose(both.rates, [3.25e-2, 3.25e-3, 3.25e-4], rtol=1e-15)
        assert both.realisations == rows
        assert both.weights == (0.25, 0.75)
        told = both.describe()
        again = HazardCurve(told["levels"], told["rates"], told["im"], "", told["realisations"], told["weights"])
        assert again.rates == both.rates

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


def site_of(text):
    """A site's number, its longitude and latitude, or its name."""
    if ";" in text:
        return tuple(map(float, text.split(";")))
    return int(text) if text.isdigit() else text or None


@pytest.mark.parametrize("row", table_rows(Path(__file__).with_name("hazards.csv"), PARTS))
def test_what_a_file_says(tmp_path, row):
    """A row of hazards.csv: a text is refused, or read as this curve, and doubted or not."""
    path = saved(tmp_path, row["text"], row["file"] or "hazard.csv")
    options = {name: row[name] for name in ("im", "units", "component") if row[name]}
    options |= {"years": float(row["years"])} if row["years"] else {}
    if row["refused"]:
        with pytest.raises(HazardError, match=row["refused"]) as caught:
            read_hazard(path, site=site_of(row["site"]), **options)
        assert str(caught.value).startswith(str(path))
        assert "\n" not in str(caught.value)
        return
    found = read_hazard(path, site=site_of(row["site"]), **options)
    assert found.im == row["measure"]
    for name, number in (("level", found.levels[0]), ("rate", found.rates[0]), ("last", found.rates[-1])):
        assert number == pytest.approx(float(row[name]), rel=1e-14, abs=0.0), name
    assert found.fractile == (float(row["fractile"]) if row["fractile"] else None)
    doubts, wanted = hazard_doubts(found), row["doubted"].split(" & ") if row["doubted"] else []
    assert [words in doubt.sentence for words, doubt in zip(wanted, doubts, strict=True)] == [True] * len(wanted)


class TestFiles:
    def test_openquake(self, tmp_path):
        path = saved(tmp_path, OPENQUAKE.format(kind="mean", imt="PGA"))
        hazard = read_hazard(path, site=0)
        np.testing.assert_allclose(hazard.levels, np.array([0.05, 0.2, 0.8]) * G, rtol=1e-15)
        np.testing.assert_allclose(hazard.rates, -np.log1p(-np.array([0.5, 0.1, 0.002])) / 50.0, rtol=1e-15)
        assert (hazard.im, hazard.fractile) == ("pga", None)
        assert hazard.source.split(", ") == [
            *("hazard.csv", "OpenQuake mean", "lon -122.34", "lat 37.72", "probabilities in 50 years", "levels in g")
        ]

    def test_openquake_what_has_no_logarithm_is_left_out_and_said(self, tmp_path):
        path = saved(tmp_path, OPENQUAKE.format(kind="mean", imt="PGV"))
        hazard = read_hazard(path, site=1)
        assert hazard.levels == (0.002, 0.008)
        assert "probability 1 left" in hazard.source
        across = read_hazard(path, site=(-180.0, 37.0))
        assert across.source.split(", ")[2:5] == ["lon 179.999", "lat 37", "probabilities in 50 years"]

    def test_nshmp(self, tmp_path):
        path = saved(tmp_path, NSHMP, "SA1P0/total.csv")
        hazard = read_hazard(path, site="Oakland CA")
        assert hazard.im == "Sa(1.0)"
        np.testing.assert_allclose(hazard.levels, np.array([0.0025, 0.0427, 0.216]) * G, rtol=1e-15)
        assert hazard.rates == (2.85280766e-03, 2.4e-03, 1.4e-04)
        *source, left_out = hazard.source.split(", ")
        assert source[1:] == ["nshmp-haz", "Oakland CA", "lon -122.25", "lat 37.8", "annual rates", "levels in g"]
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
        assert source == ["response.json", "USGS", "Total", "annual rates", "levels in g"]
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

    @pytest.mark.parametrize(
        "labels",
        [
            {"ylabel": "Annual Frequency of Exceedence"},
            {"ylabel": "Annual rate of exceedance (yr⁻¹)", "xlabel": "PGA (g)"},
        ],
    )
    def test_labels_of_services(self, tmp_path, labels):
        assert read_hazard(relabelled(tmp_path, **labels), "pga").rates == (0.2, 0.02, 1e-4)

    def test_the_larger_component_of_services_is_doubted(self, tmp_path):
        response = json.loads(services(old=False))
        response["response"]["metadata"] = {"maxdir": True}
        larger, quiet = hazard_doubts(read_hazard(saved(tmp_path, json.dumps(response))))
        assert "of both components" in larger.sentence
        assert quiet.kind == "hazard"  # (1 cm/s is exceeded once in 10,000 years)
        assert "10 cm/s" in quiet.sentence

    def test_units_of_latin_1(self, tmp_path):
        (tmp_path / "old.csv").write_bytes("pga (m/s²),rate (1/yr)\n1,1e-2\n4,1e-3\n".encode("latin-1"))
        assert read_hazard(tmp_path / "old.csv").levels == (1.0, 4.0)

    def test_plain_realisations(self, tmp_path):
        hazard = read_hazard(saved(tmp_path, REALISATIONS))
        assert hazard.weights == (0.25, 0.75)
        np.testing.assert_allclose(hazard.rates, [1.25e-2, 1.25e-3, 1e-4], rtol=1e-15)
        assert hazard.realisations[0] == (2e-2, 2e-3, 1e-4)

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
    words = [*"0123456789.,;-+eE#\"'()[]{}: \t\n\0ñ∞/xnaif_=", "1e999", "nan", "-inf", '""', "\r\n", "9" * 400]
    pieces = [word.encode() for word in words]
    slowest, read = 0.0, 0
    for _ in range(2000 // len(FILES) + 1):
        path = tmp_path / name
        path.write_bytes(damaged(rng, text.encode(), pieces))
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


@pytest.mark.parametrize("above", ["extend", "none", "hold"])
def test_a_study_may_ask_for_every_tail_that_rates_have(above):
    given = {"levels": [1.0, 4.0], "rates": [1e-2, 1e-3], "unit": "m/s2", "above": above}
    asked = hazard_table(given).risk("pga", Path())
    assert asked.above == above
    curves = xr.Dataset({"median": ((), 5.0, {"units": "m s-2"}), "dispersion": 0.4}, attrs={"im": "pga"})
    rate, none = (annual_rate(curves, asked.hazard, above=rule)["rate"].item() for rule in (above, "none"))
    assert (rate > none) == (above != "none")


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


def test_the_starter_with_other_columns(tmp_path):
    """Its comments name all columns that it may have."""
    text = (Path(tp.__file__).parent / "studies/starters/hazard.csv").read_text(encoding="utf-8")
    for heading in ("rate (1/yr)", "probability in 10 yr", "probability in 50 yr", "return period (yr)"):
        other = text.replace(",rate (1/yr)\n", f",{heading}\n")
        rows = other.partition(f",{heading}\n")[0] + f",{heading}\n0.1,{'4' if 'return' in heading else '0.04'}\n"
        rows += f"0.4,{'400' if 'return' in heading else '0.002'}\n"
        doubts = [doubt.sentence for doubt in hazard_doubts(read_hazard(saved(tmp_path, rows)))]
        of_comments = [sentence for sentence in doubts if "comment" in sentence]
        assert of_comments == [f"hazard.csv: {INVENTED}: replace it by the site's own"]


def test_return_periods_as_rates_are_doubted():
    with pytest.warns(ImplausibleInput, match="rate of 475 per year is beyond any of damage: is it a return period"):
        tp.fragility.probability_in(475.0, 50.0)
    np.testing.assert_allclose(tp.fragility.probability_in(np.array([1 / 475, 20.0])), [0.0999, 1.0], atol=1e-4)
    assert tp.fragility.probability_in(1, 50) == tp.fragility.probability_in(1.0, 50.0)
    with pytest.warns(ImplausibleInput, match="rate of 50.* per year is beyond any of damage: is 0.00210526 a rate"):
        tp.fragility.rate_from_probability(0.1, 1 / 475)


@pytest.mark.parametrize("call", [tp.fragility.probability_in, tp.fragility.rate_from_probability])
def test_rates_and_chances_of_lazy_arrays_and_of_objects(call):
    """With their labels, as results opened in chunks have them."""
    plain = xr.DataArray([0.01, 0.2], {"block": ["a", "b"]})
    for given in (plain.chunk(), plain.astype(object)):
        xr.testing.assert_identical(call(given), call(plain))


def test_chances_are_labelled_as_chances_and_rates_as_rates():
    """The unit of what they were made of stayed with them."""
    rate = xr.DataArray([0.01, 0.2], {"block": ["a", "b"]}, name="rate", attrs={"units": "year-1", "long_name": "rate"})
    chance = tp.fragility.probability_in(rate, 10.0)
    assert (chance.name, chance.attrs["units"]) == ("probability", "1")
    assert chance.attrs["long_name"] == "probability of at least one event in 10 years"
    again = tp.fragility.rate_from_probability(chance, 10.0)
    assert (again.name, again.attrs["units"], again["block"].values.tolist()) == ("rate", "year-1", ["a", "b"])


def test_what_lies_above_is_not_held_below():
    with pytest.raises(ValidationError, match="hold"):
        hazard_table({"k0": 1e-4, "k": 2.5, "unit": "g", "below": "hold"})


def test_refused(refusal):
    refusal()


def test_doubted(doubts):
    doubts()
