"""Results that cannot be compared: one sentence on standard error, exit code 2, and nothing written."""

import json
import shutil

import pytest
import xarray as xr
from study_texts import CABINET, IDA, motions

import toppling as tp
from toppling.studies.command.cli import main
from toppling.studies.comparison.compare import compare
from toppling.studies.report import results_file
from toppling.studies.store.manifest import FOLDER, LAYOUT, MANIFEST

STUDY = f'title = "Base"\n{CABINET}{motions(6)}'
FILES = {
    "base": STUDY + IDA,
    "velocity": STUDY + IDA.replace('"pga"', '"pgv"').replace("1.0, to = 12.0", "0.1, to = 2.0").replace("m/s2", "m/s"),
    "uplift": STUDY + IDA + '[fit]\nstate = "uplifted"\n',
    "other_law": STUDY.replace("[motions]", '[[models]]\nlaw = "discrete"\n[motions]').replace(
        'law = "housner"\ne = 0.9', 'law = "makris-konstantinidis"'
    )
    + IDA,
    "blocks": STUDY.replace("[[models]]", "[[blocks]]\nwidth_m = 0.3\nheight_m = 1.2\n[[models]]", 1).replace(
        "width_m = 0.4", "width_m = 0.5"
    )
    + IDA,
    "factors": STUDY + IDA + '[fit]\nform = "uplift-lognormal"\n',
    "surer": STUDY + IDA + "[fit]\nconfidence = 0.9\n",
    "sensitivity": f'title = "Delta"\n[[blocks]]\nwidth_m = 0.4\nheight_m = 1.8\n[[models]]\nlaw = "discrete"\n'
    f'{motions(6)}{IDA}[sensitivity]\nparameter = "delta"\nvalues = [0.01, 0.05]\nreplicates = 100\n',
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with small finished studies, by name, and copies of one that are edited, damaged or unfinished."""
    here = tmp_path_factory.mktemp("refused")
    for name, text in FILES.items():
        (here / f"{name}.toml").write_text(text, encoding="utf-8")
        tp.Study.from_toml(here / f"{name}.toml").run(here / name)
    for name in ("copy", "edited", "damaged", "unfinished", "empty"):
        (here / name).mkdir()
    for name in ("copy", "damaged", "unfinished"):
        shutil.copy(here / "base/results.nc", here / name)
    results = xr.load_dataset(here / "velocity/results.nc")
    results["median"] = 2.0 * results["median"]
    results.attrs |= {"identity": "0-0"}
    results.to_netcdf(here / "edited/results.nc")
    whole = (here / "base/results.nc").read_bytes()
    (here / "damaged/results.nc").write_bytes(whole[: len(whole) // 2])
    (here / "unfinished" / FOLDER).mkdir()
    manifest = {"engine": {}, "study": {}, "calls": [], "layout": LAYOUT, "identity": "", "work": 1}
    (here / "unfinished" / FOLDER / MANIFEST).write_text(json.dumps(manifest), encoding="utf-8")
    return here


@pytest.mark.slow
@pytest.mark.parametrize(
    ("first", "second", "said"),
    [
        ("base", "base", "are the same results"),
        ("base", "base/../base", "are the same results"),
        ("base", "copy", "the same study: nothing differs"),
        ("base", "velocity", "in PGA of the ground and those of B in PGV of the ground"),
        ("base", "uplift", "A is of overturning and B of uplift"),
        ("base", "other_law", "no damping law in common"),
        ("base", "blocks", "no block in common"),
        ("base", "sensitivity", "A is a fragility study and B a sensitivity study"),
        ("sensitivity", "sensitivity/results.nc", "are the same results"),
        ("base", "damaged", "damaged/results.nc: is"),
        ("base", "unfinished", "its study is not finished"),
        ("base", "empty", "holds no results"),
        ("base", "nowhere", "no such file"),
        ("base", "base.csv", "no such file"),
        ("base", "surer", "A has 95 % intervals and B 90 % intervals: give both the same"),
    ],
)
def test_one_sentence(folder, tmp_path, capsys, first, second, said):
    assert main(["compare", str(folder / first), str(folder / second), "--out", str(tmp_path / "out")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert said in line
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("second", ["damaged", "empty", "nowhere", "notes.txt", "foreign"])
def test_the_second_is_refused_before_the_first_is_read(folder, tmp_path, monkeypatch, capsys, second):
    """The head of each file is read, and no variable of the other."""
    (folder / "notes.txt").write_text("no results", encoding="utf-8")
    (folder / "foreign").mkdir(exist_ok=True)
    xr.Dataset({"x": 1.0}).to_netcdf(folder / "foreign/results.nc")
    monkeypatch.setattr(results_file, "without_motions", lambda stored: pytest.fail("the first was read"))
    assert main(["compare", str(folder / "base"), str(folder / second), "--out", str(tmp_path / "out")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert second in line


@pytest.mark.slow
def test_edited_by_hand(folder, tmp_path, capsys):
    """As the other commands: a warning, and with --verify an error."""
    command = ["compare", str(folder / "velocity"), str(folder / "edited"), "--out", str(tmp_path / "out")]
    assert main([*command, "--verify"]) == 2
    assert "edited after" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
    with pytest.warns(UserWarning, match="edited after"):
        assert main(command) == 0


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ([], "name a second result"),
        (["--laws", "housner", "discret"], "no such law"),
        (["--laws", "housner"], "--laws"),
        (["--laws", "housner", "housner"], "--laws housner housner: name two laws"),
    ],
)
def test_laws(folder, tmp_path, capsys, more, said):
    assert main(["compare", str(folder / "base"), *more, "--out", str(tmp_path / "out")]) == 2
    assert said in capsys.readouterr().err


@pytest.mark.slow
def test_a_law_of_each(folder, tmp_path, capsys):
    command = ["compare", str(folder / "base"), str(folder / "other_law"), "--out", str(tmp_path / "out")]
    assert main([*command, "--laws", "housner", "discrete"]) == 0
    assert "housner e=0.9 discrete" in " ".join(capsys.readouterr().out.split())


@pytest.mark.slow
def test_a_folder_that_cannot_be_written(folder, tmp_path, capsys):
    (tmp_path / "file").write_text("", encoding="utf-8")
    command = ["compare", str(folder / "base"), str(folder / "other_law"), "--laws", "housner", "discrete"]
    assert main([*command, "--out", str(tmp_path / "file")]) == 2
    assert "file: cannot be made" in capsys.readouterr().err


class TestStudyFiles:
    """A study file stands for the results that toppling run has written into results/NAME."""

    @pytest.fixture
    def place(self, folder, tmp_path, monkeypatch):
        """A folder with study files, of which two were run as they are."""
        monkeypatch.chdir(tmp_path)
        for name in ("base", "surer", "uplift"):
            shutil.copy(folder / f"{name}.toml", tmp_path)
        text = (tmp_path / "base.toml").read_text(encoding="utf-8")
        (tmp_path / "seed.toml").write_text(text.replace("seed = 1", "seed = 2"), encoding="utf-8")
        assert "seed = 1" in text
        shutil.copytree(folder / "base", tmp_path / "results" / "base")
        tp.Study.from_toml("seed.toml").run("results/seed")
        return tmp_path

    @pytest.mark.slow
    def test_their_results(self, place, capsys):
        assert main(["compare", "base.toml", "seed.toml", "--out", "out"]) == 0
        said = capsys.readouterr().out
        assert "A: Base (results/base/results.nc)" in " ".join(said.split())
        assert main(["compare", "results/base", "seed.toml", "--out", "again"]) == 0
        files = [(place / name / "comparison.csv").read_bytes() for name in ("out", "again")]
        assert files[0] == files[1]

    @pytest.mark.parametrize(
        ("change", "said"),
        [
            (lambda place: None, "uplift.toml: has no results in results/uplift: toppling run uplift.toml computes"),
            (
                lambda place: shutil.copytree(place / "results/base", place / "results/uplift"),
                "uplift.toml: is not the study of the results in results/uplift, or was changed since: toppling run "
                "uplift.toml --fresh computes them again",
            ),
            (lambda place: (place / "uplift.toml").write_text("x", encoding="utf-8"), "uplift.toml: "),
        ],
    )
    def test_without_results(self, place, capsys, change, said):
        change(place)
        assert main(["compare", "base.toml", "uplift.toml", "--out", "out"]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert said in line
        assert not (place / "out").exists()

    @pytest.mark.slow
    def test_unfinished(self, folder, place, capsys):
        shutil.copytree(folder / "unfinished", place / "results" / "uplift")
        assert main(["compare", "base.toml", "uplift.toml", "--out", "out"]) == 2
        assert "uplift.toml: its study" in capsys.readouterr().err

    def test_two_laws_of_one(self, place, capsys):
        assert main(["compare", "base.toml", "--laws", "housner", "housner", "--out", "out"]) == 2
        assert "name two laws" in capsys.readouterr().err


def test_dispersions_of_what_uplifted_are_not_compared(folder, tmp_path):
    """Of one study under two forms: the curves differ, and half overturn at the same level."""
    found = compare(folder / "base", folder / "factors", tmp_path)
    assert [fact.names for fact in found.notes if fact.what == "comparison.of_uplift"] == [("uplift-lognormal",)]
    (table,) = (table for table in found.tables if "overturn" in table.title)
    assert table.title.startswith("Half overturn at")
    assert set(table.column("verdict")) == {"the same"}
    with xr.open_dataset(folder / "factors/results.nc") as results:
        assert results["median"].attrs["long_name"].startswith("median of the curve of what uplifted")
