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
from matplotlib.figure import Figure
from study_texts import BLOCKS, HAZARD, IDA, laws, motions, study_of

import toppling as tp
from toppling.studies.command.cli import main
from toppling.studies.facts.notes import notes_of
from toppling.studies.store.content import ATTRIBUTE, content_digest, content_state

pytestmark = [pytest.mark.lowest, pytest.mark.newest]

LAYOUT_1 = Path(__file__).resolve().parents[2] / "data/results_layout_1.nc.gz"
PARTS = BLOCKS, laws("housner"), motions(5), IDA, HAZARD


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    folder = tmp_path_factory.mktemp("contents")
    return study_of(folder, *PARTS).run(folder / "out"), folder / "out/results.nc"


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

    @pytest.mark.parametrize(
        "options",
        [
            {"encoding": {"median": {"zlib": True}}},
            # (the classic model has no unsigned and no long integers, and texts are arrays of letters)
            {"format": "NETCDF4_CLASSIC"},
            {"format": "NETCDF3_64BIT"},
        ],
    )
    def test_however_it_is_stored(self, finished, tmp_path, options):
        with xr.open_dataset(finished[1]) as stored:
            stored.load().drop_encoding().to_netcdf(tmp_path / "copy.nc", **options)
        with xr.open_dataset(tmp_path / "copy.nc") as copy:
            assert content_digest(copy) == finished[0].attrs[ATTRIBUTE]

    def test_in_slabs(self, monkeypatch):
        values = np.arange(3 * 700 * 1100, dtype=float).reshape(3, 700, 1100)
        whole = content_digest(xr.Dataset({"one": (("a", "b", "c"), values)}))
        monkeypatch.setattr("toppling.studies.store.netcdf.SLAB_BYTES", 2**20)
        assert content_digest(xr.Dataset({"one": (("a", "b", "c"), values)})) == whole
        assert content_digest(xr.Dataset({"one": (("a", "b", "c"), values[::-1])})) != whole

    def test_of_what(self):
        base = xr.Dataset({"a": ("x", [1.0, 2.0]), "b": ("x", ["one", "two"])}, attrs={"title": "T", "n": 3})
        arrays = ([1.0, 2.5], np.array([1.0, 2.0], np.float32), [1, 2], [True, False])
        other = [
            *(base.assign(a=("x", values)) for values in arrays),
            base.assign(a=("x", [1.0, 2.0], {"units": "m"})),
            base.assign(b=("x", ["on", "etwo"])),
            *(base.rename(a="c"), base.assign_attrs(title="U"), base.assign_attrs(more=""), base.set_coords("a")),
        ]
        assert len({content_digest(results) for results in [base, *other]}) == len(other) + 1
        assert content_digest(base[["b", "a"]]) == content_digest(base)

    def test_attributes_that_are_lists(self, tmp_path):
        given = xr.Dataset(
            {"a": ("x", [1.0], {"n": [1], "two": [1.0, 2.0], "t": ["one"]})}, attrs={"some": [3], "e": ""}
        )
        given.to_netcdf(tmp_path / "lists.nc")
        with xr.open_dataset(tmp_path / "lists.nc") as stored:
            assert content_digest(stored) == content_digest(given)

    def test_nothing_in_it(self):
        empty = xr.Dataset({"a": ("x", np.empty(0)), "b": ((), True)})
        assert content_digest(empty) != content_digest(empty.drop_vars("a"))


def edit(path, variable=None):
    with netCDF4.Dataset(path, "a") as file:
        if variable == "rate":
            file["rate"][0, 0] *= 0.5
        else:
            (file[variable] if variable else file).setncattr("notes", "nothing to note")


@pytest.mark.slow
@pytest.mark.parametrize("variable", ["rate", "median", None])
def test_edited_results(copied, capsys, variable):
    """A warning and a badge in the report, a warning of exports; refused with --verify."""
    commands = ["report", str(copied)], ["export", str(copied), "--format", "csv"]
    status = ["status", str(copied.parent)]
    for arguments in (*commands, status):
        assert main([*arguments, "--verify"]) == 0
    edit(copied, variable)
    capsys.readouterr()
    for arguments in commands:
        with pytest.warns(UserWarning, match="was edited after it was written"):
            assert main(arguments) == 0
        assert main([*arguments, "--verify"]) == 2
        assert f"toppling: {copied}: was edited" in capsys.readouterr().err
    page = re.sub(r"<[^>]*>|\s+", " ", copied.with_name("report.html").read_text(encoding="utf-8"))
    assert "edited results" in page
    assert [main(status), main([*status, "--verify"])] == [0, 2]


@pytest.mark.filterwarnings("ignore:.* was edited after it was written")
@pytest.mark.parametrize(
    ("variable", "name", "value"),
    [
        ("median", "scale_factor", "x"),
        ("median", "_Encoding", "nonsense"),
        ("block", "_Encoding", "utf-16"),
        ("median", "coordinates", 5),
        ("level", "units", "days since yesterday"),
        (None, "schema", 99),
    ],
)
def test_attributes_that_make_no_sense(copied, capsys, variable, name, value):
    """What the libraries cannot decode ends in one sentence, whichever of their errors it is."""
    with netCDF4.Dataset(copied, "a") as file:
        (file[variable] if variable else file).setncattr(name, value)
    commands = ["report", str(copied)], ["export", str(copied), "--format", "csv"], ["status", str(copied.parent)]
    for arguments in commands:
        assert main([*arguments, "--verify"]) == 2
        (said,) = capsys.readouterr().err.splitlines()
        assert variable or "newer toppling" in said


@pytest.mark.slow
def test_a_study_does_not_seal_what_was_edited(copied, tmp_path):
    """Neither where it finds its results there already, nor where only its title has changed."""
    edit(copied, "rate")
    for more in ("", "[report]\nclient = 'Another'\n"):
        with pytest.raises(tp.studies.StudyError, match="was edited after it was written; move it away"):
            study_of(tmp_path, *PARTS, more).run(copied.parent)
    assert content_state(study_of(tmp_path, *PARTS).run(copied.parent, resume=False)) == "as written"


def test_results_of_before_are_not_called_pulses(finished):
    """Results without the variability of spectra: floor motions and pulses, or of a version that did not look."""
    results = finished[0].copy()
    del results.attrs["spectral_variability"]
    assert check_of(results, "variety of spectra").what == "motion.spectra_not_compared"
    del results.attrs["processor"]
    assert check_of(results, "variety of spectra").more["sentence"] == "missing"


class TestLayout1:
    """A result file as it was written when its layout was published: every later version opens it.

    Where the layout changes, its number (`units.SCHEMA`) goes up, and a file of the new one comes beside this one.
    """

    @pytest.fixture
    def results(self, tmp_path):
        path = tmp_path / "out/results.nc"
        path.parent.mkdir()
        path.write_bytes(gzip.decompress(LAYOUT_1.read_bytes()))
        return path

    def test_values_and_units(self, results):
        with xr.open_dataset(results) as stored:
            assert stored.attrs["schema"] == 1
            assert stored["median"].attrs["units"] == "m s-1"
            np.testing.assert_allclose(stored["median"], [[0.469375, 0.447214], [0.900106, 0.949752]], rtol=1e-5)
            np.testing.assert_allclose(stored["rate"], [[0.00568354, 0.00598762], [0.00144879, 0.00124941]], rtol=1e-5)
            assert stored["overturned"].dims == ("block", "model", "level", "motion")
            ax = tp.plot.fragility(stored.load(), Figure().subplots(), block="bookcase-5-shelf")
            assert len(ax.lines) >= 2
            assert float(tp.fragility.curve_probability(stored, [0.5]).max()) > 0.4

    @pytest.mark.slow
    def test_commands_open_it(self, results, capsys):
        """It has no checksum: it is opened without a word, but cannot be verified."""
        assert main(["report", str(results)]) == 0
        assert "edited" not in capsys.readouterr().err
        page = re.sub("<[^>]*>", "", results.with_name("report.html").read_text(encoding="utf-8"))
        assert "of layout 1" in page
        assert "0.47 m/s (0.34–0.68)." in page  # (read off its counts: it holds no level of half)
        assert "icelake-server" in page
        assert main(["export", str(results), "--format", "csv"]) == 0
        assert main(["status", str(results.parent)]) == 0
        assert "finished" in capsys.readouterr().out
        assert main(["report", str(results), "--verify"]) == 2
        assert "no checksum" in capsys.readouterr().err


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
    study = study_of(tmp_path, BLOCKS, "wall_gap_mm = 20\n[[blocks]]\nwidth_m = 0.004\nheight_m = 0.02\n", *PARTS[1:])
    assert len(notes_of(study.run(tmp_path / "out"))) > 2
    written = (tmp_path / "out/results.nc").read_bytes()
    tp.Study.from_toml(tmp_path / "study.toml").run(tmp_path / "out")
    assert (tmp_path / "out/results.nc").read_bytes() == written
