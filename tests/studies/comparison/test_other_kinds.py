"""Comparisons of other studies: uncertain blocks, two measures, hazard curves in files, floors."""

import math

import pytest
import xarray as xr
from study_texts import CABINET, IDA, motions

import toppling as tp
from toppling.studies.comparison import curves, sides
from toppling.studies.comparison.compare import compare

PGA, PGV = IDA, IDA.replace('"pga"', '"pgv"').replace("1.0, to = 12.0", "0.1, to = 2.0").replace("m/s2", "m/s")
LAWS = '[[blocks]]\nwidth_m = 0.4\nheight_m = 1.8\n[[models]]\nlaw = "housner"\n[[models]]\nlaw = "discrete"\n'
FIT = "[fit]\nreplicates = 100\n"
STUDIES = {
    "pga": CABINET + motions(12) + PGA + FIT + '[hazard]\nk0 = 2e-3\nk = 2.5\nunit = "m/s2"\n',
    "pgv": CABINET + motions(12) + PGV + FIT + '[hazard]\nk0 = 1e-4\nk = 2.5\nunit = "m/s"\n',
    "file": CABINET + motions(12) + PGA + FIT + '[hazard]\nfile = "hazard.csv"\n',
    "sampled": LAWS
    + motions(12)
    + PGA
    + FIT
    + "[uncertainty]\nsamples = 4\n[uncertainty.inputs]\n"
    + 'restitution_factor = { distribution = "beta", a = 8, b = 2, lower = 0.7, upper = 1.0 }\n',
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with small finished studies, by name."""
    here = tmp_path_factory.mktemp("kinds")
    rows = "".join(f"{x},{2e-3 * x**-2.5:.9e}\n" for x in (0.5, 1.0, 2.0, 4.0, 8.0, 16.0))
    (here / "hazard.csv").write_text(f"pga (m/s2),rate (1/yr)\n{rows}", encoding="utf-8")
    for name, text in STUDIES.items():
        (here / f"{name}.toml").write_text(f'title = "{name}"\n{text}', encoding="utf-8")
        tp.Study.from_toml(here / f"{name}.toml").run(here / name)
    return here


@pytest.mark.slow
def test_two_measures_have_their_rates_in_common(folder, tmp_path):
    found = compare(folder / "pga", folder / "pgv", tmp_path)
    assert [table.title for table in found.tables[1:]] == ["Chance of overturning in 50 years"]
    (measures,) = (fact.names for fact in found.notes if fact.what == "comparison.two_measures")
    assert measures[0].startswith("peak ground acceleration")
    assert [path.name for path in found.written] == ["comparison.csv", "chances.png", "comparison.html"]


@pytest.mark.slow
def test_a_hazard_curve_in_a_file(folder, tmp_path):
    """The file is not in the results: the ratio has no interval, which is a fact."""
    with sides.two_sides(folder / "pga", folder / "file") as (a, b):
        found = curves.compare_curves(a, b)[0]
    (line,) = [one for one in found.lines if one.quantity == "rate"]
    assert line.ratio.value == pytest.approx(1.0, rel=1e-6)
    assert math.isnan(line.ratio.lower)
    assert line.verdict == ""
    found = compare(folder / "pga", folder / "file", tmp_path)
    assert [fact.names for fact in found.notes if fact.what == "comparison.hazard_in_file"] == [("B",)]
    assert [fact.word for fact in found.answer if "chance" in fact.names] == [""]


def test_uncertain_blocks(folder):
    with sides.two_sides(folder / "sampled", folder / "sampled", same=True) as (a, b):
        found = curves.compare_curves(a, b, ("housner", "discrete"))[0]
    results = xr.open_dataset(folder / "sampled/results.nc")
    (line,) = [one for one in found.lines if one.quantity == "half_level"]
    levels = results["half_level"].isel(block=0).values
    assert line.ratio.value == pytest.approx(levels[1] / levels[0], rel=1e-12)
    assert line.ratio.lower < line.ratio.value < line.ratio.upper


@pytest.mark.slow
def test_a_hazard_file_that_has_changed(folder, tmp_path):
    """Results hold a digest of the curve, so that a comparison knows whether the file has changed."""
    for name, factor in (("again", 1.0), ("doubled", 2.0)):
        (tmp_path / name).mkdir()
        rows = "".join(f"{x},{factor * 2e-3 * x**-2.5:.9e}\n" for x in (0.5, 1.0, 2.0, 4.0, 8.0, 16.0))
        (tmp_path / name / "hazard.csv").write_text(f"pga (m/s2),rate (1/yr)\n{rows}", encoding="utf-8")
        text = (folder / "file.toml").read_text(encoding="utf-8")
        (tmp_path / name / "file.toml").write_text(text.replace("number = 12", "number = 11"), encoding="utf-8")
        tp.Study.from_toml(tmp_path / name / "file.toml").run(tmp_path / name)
    same = compare(folder / "file", tmp_path / "again", tmp_path / "one").inputs
    assert [fact.names for fact in same] == [("motions.number", "12", "11")]
    _, curve = compare(folder / "file", tmp_path / "doubled", tmp_path / "two").inputs
    assert (curve.names[0], curve.more["of"], len({"", *curve.names})) == ("content", "hazard.csv", 4)
