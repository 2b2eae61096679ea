"""Study files, results and the command, run as a person would run them."""

import json
import os
import re
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
import xarray as xr
from check_facts import numbers_in
from shared_cases import SHARED, needs_shared
from study_texts import crate_study

import toppling as tp
from toppling.core.units import STANDARD_GRAVITY as G
from toppling.core.wording import three_digits, two_digits
from toppling.studies import StudyError
from toppling.studies.command.cli import main
from toppling.studies.text.words import reference_law

mpl.use("Agg")

EXAMPLES = Path(tp.__file__).parent / "studies" / "examples"

SMALL = crate_study("A small study", number=12, duration=8, dt=0.01, levels=6)


def write(tmp_path, text=SMALL, name="study.toml"):
    path = tmp_path / name
    path.write_text(text)
    return path


class TestStudy:
    def test_runs_and_stores_everything(self, tmp_path):
        study = tp.Study.from_toml(write(tmp_path))
        assert study.runs == 2 * 2 * 12 * 6
        result = study.run(tmp_path / "out")
        with xr.open_dataset(tmp_path / "out" / "results.nc") as stored:
            xr.testing.assert_identical(stored.load(), result)
        assert result.overturned.dims == ("block", "model", "level", "motion")
        assert result.probability.dims == ("block", "model", "level")
        assert result["median"].dims == ("block", "model")
        np.testing.assert_allclose(result.level.values, np.linspace(0.1, 1.0, 6) * G)
        for name in result.variables:
            assert "units" in result[name].attrs, name
            assert "long_name" in result[name].attrs, name
        assert json.loads(result.attrs["study"])["title"] == "A small study"
        assert not re.search(r"20\d\d-\d\d-\d\d", json.dumps({k: str(v) for k, v in result.attrs.items()}))
        assert sorted(os.listdir(tmp_path / "out")) == ["results.nc", "run.log"]

    @pytest.mark.slow
    def test_same_file_same_bytes(self, tmp_path):
        path = write(tmp_path)
        first = tp.Study.from_toml(path).run(tmp_path / "out")
        data = (tmp_path / "out" / "results.nc").read_bytes()
        second = tp.Study.from_toml(path).run(tmp_path / "out")
        xr.testing.assert_identical(first, second)
        assert (tmp_path / "out" / "results.nc").read_bytes() == data

    @pytest.mark.slow
    def test_another_studys_results_are_not_overwritten(self, tmp_path):
        tp.Study.from_toml(write(tmp_path)).run(tmp_path / "out")
        other = tp.Study.from_toml(write(tmp_path, SMALL.replace("0.9", "0.8")))
        with pytest.raises(StudyError, match=r"another study \(models\[1\].e was 0.9, is 0.8\); use another folder"):
            other.run(tmp_path / "out")
        other.run(tmp_path / "out", resume=False)
        (tmp_path / "out" / "results.nc").write_text("no netCDF")
        with pytest.raises(StudyError, match="is no result file; move it away"):
            other.run(tmp_path / "out")

    @pytest.mark.slow
    def test_finished_results_are_kept(self, tmp_path):
        path = write(tmp_path)
        calls = []
        first = tp.Study.from_toml(path).run(tmp_path / "out", progress=lambda *done: calls.append(done))
        assert calls
        calls.clear()
        again = tp.Study.from_toml(path).run(tmp_path / "out", progress=lambda *done: calls.append(done))
        assert not calls
        xr.testing.assert_identical(first, again)
        tp.Study.from_toml(path).run(tmp_path / "out", resume=False, progress=lambda *done: calls.append(done))
        assert calls
        # another title is the same study under another name
        renamed = tp.Study.from_toml(write(tmp_path, SMALL.replace("A small study", "Renamed"))).run(tmp_path / "out")
        assert renamed.attrs["title"] == "Renamed"
        with xr.open_dataset(tmp_path / "out" / "results.nc") as stored:
            assert stored.attrs["title"] == "Renamed"

    def test_changed_records_are_another_study(self, tmp_path):
        shake = tp.motions.CloughPenzien(duration=4.0).sample(1, seed=1)
        tp.motions.write_at2(shake, tmp_path / "R.AT2")
        text = shaken_by('records = "R.AT2"')
        tp.Study.from_toml(write(tmp_path, text)).run(tmp_path / "out")
        tp.motions.write_at2(shake * 1.01, tmp_path / "R.AT2")
        with pytest.raises(StudyError, match="results of another study"):
            tp.Study.from_toml(write(tmp_path, text)).run(tmp_path / "out")

    def test_notes_name_squat_and_absurd_blocks(self, tmp_path):
        text = SMALL.replace("height_m = 1.2", "height_m = 0.6").replace("bookcase-5-shelf", "file-vertical-2-drawer")
        (squat,) = tp.Study.from_toml(write(tmp_path, text)).facts
        assert (squat.what, squat.names) == ("block.squat", ("file-vertical-2-drawer", "crate"))
        assert squat.lower == pytest.approx(1.2)
        (tall,) = tp.Study.from_toml(write(tmp_path, SMALL.replace("= 1.2", "= 40"))).notes
        assert "crate" in tall
        assert numbers_in(tall)[-5:] == [0.5, 40, 0.5, 4, 10]
        assert tp.Study.from_toml(write(tmp_path)).notes == []

    def test_matches_the_api(self, tmp_path):
        result = tp.Study.from_toml(write(tmp_path)).run()
        motions = tp.motions.CloughPenzien(
            duration=8.0, dt=0.01, envelope=tp.motions.RiseStrongDecay(1.0, 4.0, 0.5)
        ).sample(12)
        blocks = [tp.catalogue["bookcase-5-shelf"], tp.Block(0.5, 1.2, name="crate")]
        models = [tp.DiscreteDamping(e=0.9), tp.HousnerImpact()]
        direct = tp.ida(blocks, models, motions, np.linspace(0.1, 1.0, 6) * G, screen=False)
        xr.testing.assert_equal(result[["overturned", "peak_rotation"]], direct)

    def test_records_relative_to_the_file(self, tmp_path):
        folder = tmp_path / "records"
        folder.mkdir()
        for i in range(3):
            tp.motions.write_at2(tp.motions.CloughPenzien(duration=4.0).sample(1, seed=i), folder / f"R{i}.AT2")
        text = re.sub(r"(?s)\[motions\].*?\[ida\]", '[motions]\nrecords = "records/*.AT2"\n[ida]', SMALL)
        study = tp.Study.from_toml(write(tmp_path, text))
        assert [str(m.motion.values[0]) for m in study.design.arrays] == ["R0", "R1", "R2"]
        twice = text.replace('"records/*.AT2"', '["records/*.AT2", "records/R1.AT2"]')
        assert len(tp.Study.from_toml(write(tmp_path, twice)).design.arrays) == 3

    def test_pulse_and_velocity_levels(self, tmp_path):
        pulse = '[motions]\npulse = "one-cycle-sine"\nomega_rad_s = 6.0\n[ida]'
        text = re.sub(r"(?s)\[motions\].*?\[ida\]", pulse, SMALL).replace('im = "pga"', 'im = "pgv"')
        text = text.replace('unit = "g"', 'unit = "m/s"').replace(
            "from = 0.1, to = 1.0", 'spacing = "log", from = 0.1, to = 4.0'
        )
        result = tp.Study.from_toml(write(tmp_path, text)).run()
        np.testing.assert_allclose(result.level.values, np.geomspace(0.1, 4.0, 6))
        assert bool(result.overturned.any())

    @pytest.mark.parametrize(
        ("im", "unit", "label"),
        [
            ("Sa(1)", "g", "Sa(1.0)"),
            ("AvgSa(0.2:1:5, 0.02)", "cm/s2", "AvgSa(0.2:1.0:5, 0.02)"),
            ("arias", "m/s", "arias"),
        ],
    )
    def test_levels_of_other_measures(self, tmp_path, im, unit, label):
        text = SMALL.replace('im = "pga"', f'im = "{im}"').replace('unit = "g"', f'unit = "{unit}"')
        study = tp.Study.from_toml(write(tmp_path, text))
        assert study.design.im == study.configuration["ida"]["im"] == label
        result = study.run()
        assert result.level.attrs["im"] == label
        if im == "arias":
            assert result.status.dims == ("block", "model")

    def test_levels_for_each_block(self, tmp_path):
        text = SMALL.replace('im = "pga"', 'im = "pgv_normalised"').replace('unit = "g"', 'unit = "1"')
        result = tp.Study.from_toml(write(tmp_path, text)).run(tmp_path / "out")
        assert result.pgv_normalised.dims == ("block", "motion")
        with xr.open_dataset(tmp_path / "out" / "results.nc") as stored:
            xr.testing.assert_identical(stored.load(), result)

    def test_the_example_is_the_issues_study(self):
        study = tp.Study.from_toml(EXAMPLES / "office.toml")
        assert study.runs == 3 * 6 * 100 * 20
        assert [b.name for b in study.blocks] == ["bookcase-5-shelf", "file-vertical-4-drawer", "server-rack-42u"]
        assert len({m.law for m in study.models}) == 6

    @pytest.mark.slow
    @needs_shared
    def test_recorded_suite(self, tmp_path):
        records = f'[motions]\nrecords = "{SHARED}/data/records/suite/*.AT2"\n[ida]'
        text = re.sub(r"(?s)\[motions\].*?\[ida\]", records, SMALL)
        result = tp.Study.from_toml(write(tmp_path, text)).run()
        assert result.sizes["motion"] == 59
        assert bool(result.converged.all())


def shaken_by(keys):
    """The small study with other motions."""
    return re.sub(r"(?s)\[motions\].*?\[ida\]", f"[motions]\n{keys}\n[ida]", SMALL)


BAD_FILES = [
    ("", "key 'title' is missing"),
    ("title = ", "not valid TOML"),
    (SMALL.replace("[[models]]", "[[model]]"), "unknown key 'model'; did you mean 'models'"),
    (SMALL.replace("[motions]", "[motion]"), "unknown key 'motion'; did you mean 'motions'"),
    (shaken_by('pulse = "ricker"'), "key 'motions.omega_rad_s' is missing"),
    (shaken_by('pulse = "ricker"\nomega_rad_s = 6\namplitude_m_s2 = 0'), "motions.amplitude_m_s2: must be > 0"),
    (SMALL.replace("width_m", "widht_m"), r"unknown key 'blocks\[2\].widht_m'; did you mean 'width_m'"),
    (SMALL.replace("duration_s", "duration"), r"unknown key 'motions.duration'; did you mean 'duration_s'"),
    (SMALL.replace("rise_s", "raise_s"), "unknown key 'motions.envelope.raise_s'; did you mean 'rise_s'"),
    (SMALL.replace('"discrete"', '"discreet"'), r"models\[1\].law: must be one of .*; did you mean 'discrete'"),
    (SMALL.replace("bookcase-5-shelf", "bookcase"), r"blocks\[1\]: catalogue: no catalogue item 'bookcase'; nearest"),
    (SMALL.replace("e = 0.9", "e = 1.9"), r"models\[1\].e: must be > 0 and <= 1, got 1.9"),
    (SMALL.replace("e = 0.9", "e = nan"), r"models\[1\].e: must be a finite number"),
    (SMALL.replace("e = 0.9", 'geometry = "exact"'), r"unknown key .models\[1\].geometry."),
    (SMALL.replace("0.5\n", "-0.5\n"), r"blocks\[2\].width_m: must be"),
    (SMALL.replace("height_m = 1.2", ""), r"blocks\[2\]: a block needs either catalogue, or width_m and height_m"),
    (SMALL.replace("height_m = 1.2", "height_m = 1.2\nalpha_rad = 0.2"), "a block needs either"),
    (SMALL.replace("width_m = 0.5", "width_m = 2.5"), "explicit e"),
    (SMALL.replace("number = 12", "number = 0"), "motions.number: must be >= 1, got 0"),
    (SMALL.replace("number = 12", 'number = "many"'), "motions.number"),
    (SMALL.replace("number = 12", ""), "motions.number"),
    (SMALL.replace("dt_s = 0.01", "dt_s = 0"), "motions.dt_s: must be > 0"),
    (SMALL.replace("dt_s = 0.01", "omega_f_rad_s = -1"), "motions.omega_f_rad_s: must be"),
    (
        SMALL.replace("clough-penzien", "kanai-tajimi").replace("dt_s", "xi_f"),
        "unknown key 'motions.xi_f'",
    ),
    (
        SMALL.replace('generator = "clough-penzien"', 'records = "none/*.AT2"\ngenerator = "kanai-tajimi"'),
        "exactly one of",
    ),
    (re.sub(r"(?s)\[motions\].*?\[ida\]", '[motions]\nrecords = "none/*.AT2"\n[ida]', SMALL), "no file matches 'none/"),
    (SMALL.replace('unit = "g"', 'unit = "m/s"'), "unit of levels of pga must be one of g, m/s2, cm/s2, got 'm/s'"),
    (SMALL.replace(', unit = "g"', ""), "key 'ida.levels.unit' is missing"),
    (SMALL.replace("number = 6", "values = [1.0]"), "levels need either values, or from, to and number"),
    (SMALL.replace("to = 1.0", "to = 0.05"), "strictly increasing"),
    (SMALL.replace("from = 0.1", "from = 0.0"), "levels must be > 0"),
    (SMALL.replace("from = 0.1", 'spacing = "log", from = 0.0'), "from > 0"),
    (SMALL.replace('im = "pga"', 'im = "pgx"'), "ida.im: must be one of pga, pgv, .*scale, Sa.*, got 'pgx'"),
    (SMALL.replace('im = "pga"', 'im = "Sa(-1)"'), r"ida.im: im 'Sa\(-1\)': period must be finite and >= 0.001"),
    (
        SMALL.replace('im = "pga"', 'im = "Sa(1.0)"').replace('"g"', '"m"'),
        "units? of levels of Sa.1.0. must be one of g",
    ),
    (SMALL.replace('im = "pga"', 'im = "d5_95"'), "ida.im: must be one of pga, .*got 'd5_95'"),
    (SMALL + "[extra]\n", "unknown key 'extra'"),
    (
        SMALL.replace('name = "crate"', 'name = "bookcase-5-shelf"'),
        r"blocks\[2\]: the label 'bookcase-5-shelf' is taken",
    ),
    (
        SMALL.replace('law = "housner"', 'law = "discrete"\ne = 0.9'),
        r"models\[2\]: the label .* is taken by models\[1\]",
    ),
]


@pytest.mark.parametrize(("text", "message"), BAD_FILES, ids=[m for _, m in BAD_FILES])
def test_bad_study_files(tmp_path, text, message, capsys):
    path = write(tmp_path, text)
    with pytest.raises(StudyError, match=message) as error:
        tp.Study.from_toml(path)
    assert str(error.value).startswith(str(path))
    assert "\n" not in str(error.value)
    assert main(["run", str(path), "--out", str(tmp_path / "out")]) == 2
    assert capsys.readouterr().err == f"toppling: {error.value}\n"
    assert not (tmp_path / "out").exists()


class TestCommand:
    @pytest.mark.slow
    def test_run(self, tmp_path, capsys):
        assert main(["run", str(write(tmp_path)), "--out", str(tmp_path / "out")]) == 0
        printed = capsys.readouterr().out
        assert "384 runs (96" in printed
        assert "Bookcase, 5 shelves" in printed
        assert "runs: 100 %" in printed
        picture = (tmp_path / "out" / "fragility.png").read_bytes()
        assert picture[:8] == b"\x89PNG\r\n\x1a\n"
        assert len(picture) > 20_000
        results = tp.Study.from_toml(write(tmp_path)).run()
        at = reference_law(results)[0]
        for j, values in enumerate((results["half_level"].values / G).T):
            for value in values:
                level_text = two_digits if j == at else three_digits
                assert ("not reached" if value == np.inf else level_text(value)) in printed

    @pytest.mark.slow
    def test_separated_data_are_said_in_the_table(self, tmp_path, capsys):
        text = SMALL.replace("from = 0.1, to = 1.0, number = 6", "from = 0.001, to = 0.002, number = 2")
        assert main(["run", str(write(tmp_path, text)), "--out", str(tmp_path / "out"), "--verbose"]) == 0
        printed = capsys.readouterr().out
        assert printed.lower().count("no overturning") == 5
        assert "raise ida.levels.to" in printed

    @pytest.mark.parametrize(
        ("arguments", "message"),
        [
            (["run"], "usage: toppling run STUDY.toml"),
            (["run", "nothing.toml"], "nothing.toml: no such file"),
            (["run", "."], "cannot be read"),
            (["walk"], "walk"),
            (["run", "x.toml", "--wat"], "wat"),
        ],
    )
    def test_wrong_arguments(self, arguments, message, capsys):
        assert main(arguments) == 2
        error = capsys.readouterr().err
        assert message in error
        assert error.count("\n") == 1
        assert "Traceback" not in error

    def test_unwritable_output(self, tmp_path, capsys):
        blocked = tmp_path / "file"
        blocked.write_text("")
        assert main(["run", str(write(tmp_path)), "--out", str(blocked / "out")]) == 2
        assert str(blocked) in capsys.readouterr().err

    def test_a_name_too_long(self, tmp_path, capsys):
        assert main(["run", str(write(tmp_path)), "--out", str(tmp_path / ("x" * 300))]) == 2
        assert "too long" in capsys.readouterr().err

    def test_unreachable_scheduler(self, tmp_path, capsys):
        path = str(write(tmp_path))
        assert main(["run", path, "--out", str(tmp_path / "o"), "--scheduler", "nonsense://x"]) == 2
        assert "--scheduler nonsense://x" in capsys.readouterr().err

    def test_catalogue(self, capsys):
        assert main(["catalogue"]) == 0
        assert "E.20.22.105a" in capsys.readouterr().out

    @pytest.mark.slow
    def test_a_cluster_gives_the_same_bytes(self, tmp_path):
        """A real scheduler and two worker processes on loopback."""
        path = write(tmp_path)
        assert main(["run", str(path), "--out", str(tmp_path / "here")]) == 0
        from distributed import LocalCluster

        with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None, host="127.0.0.1") as cluster:
            address = cluster.scheduler_address
            assert main(["run", str(path), "--out", str(tmp_path / "there"), "--scheduler", address]) == 0
        assert (tmp_path / "here/results.nc").read_bytes() == (tmp_path / "there/results.nc").read_bytes()
