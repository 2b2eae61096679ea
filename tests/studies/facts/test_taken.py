"""Units and time steps that readers take, as a study, the command and the page name them."""

import numpy as np
import pytest
import record_files as files
import xarray as xr

import toppling as tp
from toppling import motions as mo
from toppling.core.facts import stored
from toppling.motions.pairs import pair_up
from toppling.studies.command.cli import main
from toppling.studies.facts.method import inputs_of
from toppling.studies.facts.notes import INPUT_NOTES
from toppling.studies.facts.say import say
from toppling.studies.plan import reading
from toppling.studies.plan.reading import taken_facts, taken_of

STUDY = """
title = "Records"
[[blocks]]
width_m = 0.4
height_m = 1.8
[[models]]
law = "housner"
[motions]
records = "records/*"
[ida]
im = "pga"
levels = { values = [0.3, 0.6], unit = "g" }
"""
ODD = {
    "a.csv": "# values: gal\n" + files.csv(files.shaking(200)).replace(" (cm/s2)", ""),
    "b.AT2": files.at2(0.01 * files.shaking(200, seed=1)),
    "c.AT2": files.at2(0.01 * files.shaking(200, seed=2), dt=0.005).replace(" IN UNITS OF G", ""),
}
SENTENCE = (
    "a: unit cm/s² (line 1), time step 0.01 s (time column); b: unit g (line 3), time step 0.01 s (line 4); "
    "c: unit g (AT2 without a unit), time step 0.005 s (line 4)."
)


@pytest.fixture
def odd(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "records").mkdir()
    for name, text in ODD.items():
        (tmp_path / "records" / name).write_text(text, encoding="utf-8")
    (tmp_path / "study.toml").write_text(STUDY, encoding="utf-8")
    return tmp_path


def test_a_study_names_them(odd):
    study = tp.Study.from_toml(odd / "study.toml")
    assert SENTENCE in study.notes
    attrs = {"study": "{}", "kind": "fragility", INPUT_NOTES: stored(study.facts)}
    (fact,) = (fact for fact in inputs_of(xr.Dataset(attrs=attrs)) if fact.what == "motion.taken")
    assert say(fact, "method") == SENTENCE


@pytest.mark.parametrize("inputs", [["study.toml"], ["records/*"]])
def test_the_terminal_names_them(odd, capsys, inputs):
    assert main(["motions", *inputs, "--out", "out"]) == 0
    assert SENTENCE.split("; ")[1] in " ".join(capsys.readouterr().out.split())


def test_a_simulated_record_is_named(odd, capsys):
    assert main(["simulate", "--width", "0.4m", "--height", "1.8m", "records/a.csv", "--out", "out"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "note: 1 record: unit cm/s² (line 1), time step 0.01 s (time column)." in said


def groups(motions):
    """Count or names, unit, smallest time step and its source, of each group of records."""
    (fact,) = taken_facts(taken_of(motions))
    return [(g["names"] or g["count"], g["unit"], g["steps"][0], g["step"]) for g in fact.more["groups"]]


def test_the_record_under_a_building_is_named(odd, capsys):
    """Of the ground motion of the simulated floor motion."""
    building = 'kind = "flexural-shear"\nperiod_s = 0.4\nstoreys = 3\nfloors = [2]'
    study = STUDY.replace("records/*", "records/b.AT2") + f"[building]\n{building}\n"
    (odd / "study.toml").write_text(study, encoding="utf-8")
    assert main(["simulate", "--width", "0.4m", "--height", "1.8m", "study.toml", "--out", "out"]) == 0
    assert "unit g (line 3), time step 0.01 s (line 4)" in " ".join(capsys.readouterr().out.split())


def test_columns_left_out_are_named(tmp_path):
    rows = "".join(f"{0.01 * i:.2f},{i % 7 - 3},1.5,{i % 3}\n" for i in range(99))
    (tmp_path / "a.csv").write_text(f"t (s),acc (gal),vel (cm/s),disp (cm)\n{rows}", encoding="utf-8")
    (fact,) = taken_facts(taken_of([mo.read(tmp_path / "a.csv")]))
    assert fact.more["groups"][0]["unit"] == "cm/s² (line 1, columns left out: vel (cm/s), disp (cm))"


def test_columns_of_many_names_are_one_group(tmp_path):
    """Each file has a velocity of its own name, and half of them a line more."""
    rows = "".join(f"{0.01 * i:.2f},{i % 7 - 3},1.5\n" for i in range(99))
    for i in range(12):
        text = f"t (s),acc (gal),vel {i} (cm/s)\n{rows}"
        (tmp_path / f"r{i}.csv").write_text(text, encoding="utf-8")
    times = 0.01, "time column"
    assert groups(mo.read_all(tmp_path / "*.csv")) == [(12, "cm/s² (line 1, columns left out)", *times)]
    for i in range(6):
        text = (tmp_path / f"r{i}.csv").read_text(encoding="utf-8")
        (tmp_path / f"r{i}.csv").write_text(f"# a note\n{text}", encoding="utf-8")
    assert groups(mo.read_all(tmp_path / "*.csv")) == [(12, "cm/s² (various lines, columns left out)", *times)]


def test_equal_records_are_one_group(tmp_path):
    def write(titles):
        for i in range(40):
            text = files.at2(0.01 * files.shaking(50, seed=i), dt=0.005 if i % 2 else 0.02)
            (tmp_path / f"r{i}.AT2").write_text("A title\n" * (i % titles) + text, encoding="utf-8")
        return groups(mo.read_all(tmp_path / "*.AT2"))

    by_lines = write(titles=3)
    assert by_lines[:2] == [(7, "g (line 3)", 0.02, "line 4"), (7, "g (line 4)", 0.005, "line 5")]
    assert len(by_lines) == 6
    various = "g (various lines)"
    assert write(titles=7) == [(20, various, 0.02, "various lines"), (20, various, 0.005, "various lines")]
    (tmp_path / "odd").mkdir()
    for i in range(5):
        text = files.at2(0.01 * files.shaking(50, seed=i), dt=0.005 if i == 3 else 0.02)
        (tmp_path / "odd" / f"r{i}.AT2").write_text(text, encoding="utf-8")
    read = "g (line 3)", 0.02, "line 4"
    assert groups(mo.read_all(tmp_path / "odd/*.AT2")) == [(4, *read), (["r3"], "g (line 3)", 0.005, "line 4")]
    assert taken_facts(taken_of([mo.from_array(np.ones(9), 0.01)])) == []


def test_components_of_a_pair_keep_theirs(tmp_path):
    """A pair whose components have different units names both, and the source of the azimuths."""
    read = {}
    for name, unit in (("A-090.csv", "g"), ("A-000.csv", "gal")):
        (tmp_path / name).write_text(files.csv(files.shaking(200, 1.0), unit=unit), encoding="utf-8")
        read[tmp_path / name] = mo.read_all(tmp_path / name)
    (pair,) = pair_up(read)
    (turned,) = mo.both_axes(pair, 0.3)
    (fact,) = taken_facts(taken_of([turned]))
    assert [group["unit"] for group in fact.more["groups"]] == ["g (line 1)", "cm/s² (line 1)"]
    assert {group["azimuth"] for group in fact.more["groups"]} == {"file name"}


def test_floor_histories_are_named(tmp_path):
    path = tmp_path / "floors.csv"
    path.write_text("# of a model\ntime,a/1 [g],a/roof [gal]\n0,1,2\n0.01,2,1\n", encoding="utf-8")
    times = 0.01, "time column"
    of_floors = [(["a floor 1"], "g (line 2)", *times), (["a floor roof"], "cm/s² (line 2)", *times)]
    assert groups([mo.read_floors(path)]) == of_floors


def test_floor_histories_of_another_program_are_named(tmp_path):
    """Without units, without `recorded` and without a time step but by their times."""
    of = {"motion": ["a", "b"], "floor": [0, 1], "time": 0.01 * np.arange(500)}
    xr.DataArray(np.random.default_rng(1).normal(size=(2, 2, 500)), of, list(of)).to_netcdf(tmp_path / "floors.nc")
    study = STUDY.replace('records = "records/*"', 'floors_file = "floors.nc"')
    (tmp_path / "study.toml").write_text(study, encoding="utf-8")
    sentence = "2 records: unit m/s² (netCDF without units), time step 0.01 s (coordinate time)."
    assert sentence in tp.Study.from_toml(tmp_path / "study.toml").notes


def test_a_resampled_record_says_so(tmp_path):
    (tmp_path / "a.AT2").write_text(ODD["b.AT2"], encoding="utf-8")
    assert groups([mo.resample(mo.read(tmp_path / "a.AT2"), 0.005)]) == [(1, "g (line 3)", 0.005, "resample")]


def test_a_comparison_that_was_interrupted_is_made_again(monkeypatch):
    made = mo.SiteBasedScenario(magnitude=6.5, distance=2e4, vs30=760.0).sample(3)
    compared = reading.Compared([made], mo.Scenario(6.5, 2e4, 760.0))
    with monkeypatch.context() as patch:
        patch.setattr(reading, "over_model", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
        with pytest.raises(KeyboardInterrupt):
            compared.outcome  # noqa: B018 - computes it
    assert compared.outcome[0].startswith("M 6.5, 20 km")
