"""Study files, results and the command, run as a person would run them."""

import json
import os
import re

import matplotlib as mpl
import numpy as np
import pytest
import xarray as xr
from check_facts import numbers_in
from study_texts import crate_study

import toppling as tp
from toppling.core.units import STANDARD_GRAVITY as G
from toppling.core.wording import three_digits, two_digits
from toppling.studies import StudyError
from toppling.studies.command.cli import main
from toppling.studies.text.words import reference_law

mpl.use("Agg")


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


def shaken_by(keys):
    """The small study with other motions."""
    return re.sub(r"(?s)\[motions\].*?\[ida\]", f"[motions]\n{keys}\n[ida]", SMALL)


def test_a_bad_study_file_leaves_no_folder(tmp_path, capsys):
    """All others: `tests/golden/refused/sentences.toml`."""
    path = write(tmp_path, SMALL.replace("dt_s = 0.01", "dt_s = 0"))
    assert main(["run", str(path), "--out", str(tmp_path / "out")]) == 2
    assert re.fullmatch(rf"toppling: {path}: motions.dt_s: must be > 0[^\n]*\n", capsys.readouterr().err)
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

    def test_unreachable_scheduler(self, tmp_path, capsys):
        path = str(write(tmp_path))
        assert main(["run", path, "--out", str(tmp_path / "o"), "--scheduler", "nonsense://x"]) == 2
        assert "--scheduler nonsense://x" in capsys.readouterr().err

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
