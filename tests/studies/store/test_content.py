"""The checksum of contents: equal however a file is stored, and another one after every edit."""

import gzip
import json
import re
from pathlib import Path

import netCDF4
import numpy as np
import pytest
import xarray as xr
from check_facts import check as check_of
from study_texts import BLOCKS, HAZARD, IDA, motions

import toppling as tp
from toppling.studies.command.cli import main
from toppling.studies.facts.notes import notes_of
from toppling.studies.store.content import ATTRIBUTE, content_digest, content_state

pytestmark = [pytest.mark.lowest, pytest.mark.newest]

ROOT = Path(__file__).resolve().parents[3]
STUDY = f'title = "Contents"\n{BLOCKS}\n[[models]]\nlaw = "housner"\n{motions(5)}{IDA}{HAZARD}'


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    folder = tmp_path_factory.mktemp("contents")
    (folder / "study.toml").write_text(STUDY, encoding="utf-8")
    results = tp.Study.from_toml(folder / "study.toml").run(folder / "out")
    return results, folder / "out/results.nc"


@pytest.fixture
def copied(finished, tmp_path):
    path = tmp_path / "out/results.nc"
    path.parent.mkdir()
    path.write_bytes(finished[1].read_bytes())
    return path


class TestDigest:
    def test_the_same_in_memory_and_on_the_disk(self, finished):
        results, path = finished
        with xr.open_dataset(path) as stored:
            assert stored.attrs[ATTRIBUTE] == results.attrs[ATTRIBUTE] == content_digest(results)
            assert content_digest(stored) == content_digest(stored.load()) == stored.attrs[ATTRIBUTE]

    def test_however_it_is_stored(self, finished, tmp_path):
        """Without checksums, compressed, and as Zarr's and scipy's older layouts would be: a copy keeps it."""
        results, path = finished
        with xr.open_dataset(path) as stored:
            plain = stored.load().drop_encoding()
        plain.to_netcdf(tmp_path / "plain.nc", encoding={"median": {"zlib": True}})
        with xr.open_dataset(tmp_path / "plain.nc") as copy:
            assert content_digest(copy) == results.attrs[ATTRIBUTE]

    @pytest.mark.parametrize("model", ["NETCDF4_CLASSIC", "NETCDF3_64BIT"])
    def test_in_the_classic_model(self, finished, tmp_path, model):
        """It has no unsigned and no long integers, and texts are arrays of letters."""
        with xr.open_dataset(finished[1]) as stored:
            stored.load().drop_encoding().to_netcdf(tmp_path / "classic.nc", format=model)
        with xr.open_dataset(tmp_path / "classic.nc") as copy:
            assert content_digest(copy) == finished[0].attrs[ATTRIBUTE]

    def test_in_slabs(self, monkeypatch):
        """Slabs are read in C order, so that their size does not matter."""
        values = np.arange(3 * 700 * 1100, dtype=float).reshape(3, 700, 1100)
        whole = content_digest(xr.Dataset({"one": (("a", "b", "c"), values)}))
        monkeypatch.setattr("toppling.studies.store.netcdf.SLAB_BYTES", 2**20)
        assert content_digest(xr.Dataset({"one": (("a", "b", "c"), values)})) == whole
        assert content_digest(xr.Dataset({"one": (("a", "b", "c"), values[::-1])})) != whole

    def test_of_what(self):
        """Values, types, names, dimensions and attributes all count; the order of variables does not."""
        base = xr.Dataset({"a": ("x", [1.0, 2.0]), "b": ("x", ["one", "two"])}, attrs={"title": "T", "n": 3})
        other = [
            base.assign(a=("x", [1.0, 2.5])),
            base.assign(a=("x", np.array([1.0, 2.0], np.float32))),
            base.assign(b=("x", ["on", "etwo"])),
            base.rename(a="c"),
            base.assign_attrs(title="U"),
            base.assign_attrs(more=""),
            base.assign(a=("x", [1.0, 2.0], {"units": "m"})),
            base.assign(a=("x", [1, 2])),
            base.assign(a=("x", [True, False])),
            base.set_coords("a"),
        ]
        assert len({content_digest(one) for one in [base, *other]}) == len(other) + 1
        assert content_digest(base[["b", "a"]]) == content_digest(base)

    def test_attributes_that_are_lists(self, tmp_path):
        """Of one, of several, of none, as a file gives them back."""
        given = xr.Dataset(
            {"a": ("x", [1.0], {"n": [1], "two": [1.0, 2.0], "t": ["one"]})}, attrs={"some": [3], "e": ""}
        )
        given.to_netcdf(tmp_path / "lists.nc")
        with xr.open_dataset(tmp_path / "lists.nc") as stored:
            assert content_digest(stored) == content_digest(given)

    def test_nothing_in_it(self):
        empty = xr.Dataset({"a": ("x", np.empty(0)), "b": ((), True)})
        assert content_digest(empty) != content_digest(empty.drop_vars("a"))


def edit_value(path):
    with netCDF4.Dataset(path, "a") as file:
        file["rate"][0, 0] *= 0.5


def edit_attribute(path):
    with netCDF4.Dataset(path, "a") as file:
        file.setncattr("notes", "nothing to note")


def edit_a_variable(path):
    with netCDF4.Dataset(path, "a") as file:
        file["median"].setncattr("long_name", "median of all")


@pytest.mark.slow
@pytest.mark.parametrize("edit", [edit_value, edit_attribute, edit_a_variable])
def test_edited_results(copied, capsys, edit):
    """A warning and a badge in the report, a warning of exports; refused with --verify."""
    for arguments in (["report", str(copied)], ["export", str(copied), "--format", "csv"]):
        assert main([*arguments, "--verify"]) == 0
    assert main(["status", str(copied.parent), "--verify"]) == 0
    edit(copied)
    capsys.readouterr()
    for arguments in (["report", str(copied)], ["export", str(copied), "--format", "csv"]):
        with pytest.warns(UserWarning, match="was edited after it was written"):
            assert main(arguments) == 0
        assert main([*arguments, "--verify"]) == 2
        said = capsys.readouterr().err
        assert f"toppling: {copied}: was edited" in said
    page = re.sub(r"<[^>]*>|\s+", " ", copied.with_name("report.html").read_text(encoding="utf-8"))
    assert "edited results" in page
    assert main(["status", str(copied.parent)]) == 0
    assert main(["status", str(copied.parent), "--verify"]) == 2


@pytest.mark.filterwarnings("ignore:.* was edited after it was written")
@pytest.mark.parametrize(
    ("variable", "name", "value"),
    [
        ("median", "scale_factor", "x"),
        ("median", "_Encoding", "nonsense"),
        ("block", "_Encoding", "utf-16"),
        ("median", "coordinates", 5),
        ("level", "units", "days since yesterday"),
    ],
)
def test_attributes_that_make_no_sense(copied, capsys, variable, name, value):
    """What the libraries cannot decode ends in one sentence, whichever of their errors it is."""
    with netCDF4.Dataset(copied, "a") as file:
        file[variable].setncattr(name, value)
    for arguments in (
        ["report", str(copied)],
        ["export", str(copied), "--format", "csv"],
        ["status", str(copied.parent)],
    ):
        assert main([*arguments, "--verify"]) == 2
        assert len(capsys.readouterr().err.splitlines()) == 1


def test_curves_of_a_newer_layout_are_not_exported(copied, capsys):
    with netCDF4.Dataset(copied, "a") as file:
        file.setncattr("schema", 99)
    for arguments in (["export", str(copied), "--format", "csv"], ["status", str(copied.parent), "--verify"]):
        assert main(arguments) == 2
        assert "newer toppling" in capsys.readouterr().err


@pytest.mark.slow
def test_a_study_does_not_seal_what_was_edited(finished, copied):
    """Neither where it finds its results there already, nor where only its title has changed."""
    edit_value(copied)
    path = finished[1].parents[1] / "study.toml"
    for text in (STUDY, STUDY.replace("Contents", "Another title")):
        path.write_text(text, encoding="utf-8")
        with pytest.raises(tp.studies.StudyError, match="was edited after it was written; move it away"):
            tp.Study.from_toml(path).run(copied.parent)
    path.write_text(STUDY, encoding="utf-8")
    assert content_state(tp.Study.from_toml(path).run(copied.parent, resume=False)) == "as written"


@pytest.mark.slow
def test_a_file_without_it(tmp_path, capsys):
    """A file of before is opened without a word, but cannot be verified."""
    path = tmp_path / "results.nc"
    path.write_bytes(gzip.decompress((ROOT / "tests/data/results_layout_1.nc.gz").read_bytes()))
    assert main(["report", str(path)]) == 0
    assert "edited" not in capsys.readouterr().err
    assert main(["report", str(path), "--verify"]) == 2
    assert "no checksum" in capsys.readouterr().err


def test_results_of_before_are_not_called_pulses(finished):
    """Results without the variability of spectra: floor motions and pulses, or of a version that did not look."""
    results = (
        finished[0]
        .drop_attrs(deep=False)
        .assign_attrs({name: value for name, value in finished[0].attrs.items() if name != "spectral_variability"})
    )
    assert check_of(results, "variety of spectra").what == "motion.spectra_not_compared"
    del results.attrs["processor"]
    assert check_of(results, "variety of spectra").more["sentence"] == "missing"


def test_a_study_that_is_not_finished(finished, tmp_path, capsys):
    shards = tmp_path / "shards"
    shards.mkdir()
    manifest = {"layout": 3, "engine": {}, "identity": "", "study": {}, "work": 1, "calls": []}
    (shards / "manifest.json").write_text(json.dumps(manifest))
    assert main(["status", str(tmp_path), "--verify"]) == 2
    assert "not finished" in capsys.readouterr().err


@pytest.mark.slow
def test_a_finished_study_stays_as_it_is(tmp_path):
    """Run again, it is not written anew: notes on walls, on inputs that look odd and of its runs keep their order."""
    walls = f"{BLOCKS}wall_gap_mm = 20\n[[blocks]]\nwidth_m = 0.004\nheight_m = 0.02\n"
    (tmp_path / "study.toml").write_text(STUDY.replace(BLOCKS, walls), encoding="utf-8")
    first = tp.Study.from_toml(tmp_path / "study.toml").run(tmp_path / "out")
    written = (tmp_path / "out/results.nc").read_bytes()
    assert len(notes_of(first)) > 2
    tp.Study.from_toml(tmp_path / "study.toml").run(tmp_path / "out")
    assert (tmp_path / "out/results.nc").read_bytes() == written
