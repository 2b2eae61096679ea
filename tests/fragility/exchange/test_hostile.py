"""Hostile curves and files: one sentence each, nothing else, and nothing written or run that was not asked for."""

import xml.etree.ElementTree as ET
from contextlib import nullcontext

import numpy as np
import pytest
import xarray as xr
from damage import damaged
from exchange_cases import FORMATS, isotonic, lognormal, there_and_back, unguarded
from hypothesis import given, settings, strategies as st
from repeatable import REPEATABLE

from toppling.fragility import (
    ExchangeError,
    read_pelicun,
    write_curve_csv,
    write_nrml,
    write_pelicun,
)
from toppling.fragility.exchange.curve_csv import guarded


def unsure(**changes):
    return lognormal().assign_attrs(changes)


def of_one_floor():
    """Curves as of runs on one floor, whose long name alone shows the place."""
    curves = lognormal().assign_attrs(design="ida")
    return curves.assign(median=curves["median"].assign_attrs(long_name="median: peak floor acceleration"))


def times(curves, factor):
    return curves.assign(median=(curves["median"].dims, curves["median"].values * factor, curves["median"].attrs))


def with_near_levels():
    found = isotonic()
    levels = found["level"].values.copy()
    levels[2] = levels[1] * (1.0 + 1e-8)
    return found.assign_coords(level=("level", levels, found["level"].attrs))


@pytest.mark.parametrize("name", FORMATS)
def test_a_failed_write_leaves_what_was_there(name, tmp_path, monkeypatch):
    write, _, file = FORMATS[name]
    (tmp_path / file).write_text("before")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("pathlib.Path.replace", full)
    with pytest.raises(ExchangeError, match=r"cannot be written \(No space left"):
        write(lognormal(), tmp_path / file)
    assert [path.name for path in tmp_path.iterdir()] == [file]
    assert (tmp_path / file).read_text() == "before"


def test_partly_missing_probabilities_are_an_error(tmp_path):
    curves = isotonic()
    curves["probability"][0, 0, 2] = np.nan
    with pytest.raises(ValueError, match="probabilities must lie between 0 and 1"):
        write_nrml(curves, tmp_path / "t.xml")
    curves["probability"][0, 0, 2] = 0.05
    with pytest.raises(ValueError, match="must not decrease"):
        write_nrml(curves, tmp_path / "t.xml")


def saved(folder, text):
    path = folder / "t.csv"
    path.write_text(text, encoding="utf-8")
    return path


HEADING = "ID,Incomplete,Demand-Type,Demand-Unit,Demand-Offset,Demand-Directional,LS1-Family,LS1-Theta_0,LS1-Theta_1"
ROW = "a,0,Peak Floor Acceleration,g,0,1,lognormal,1.0,0.4"


def test_size_is_bounded(tmp_path, monkeypatch):
    path = tmp_path / "t.csv"
    path.write_bytes(b"")
    with pytest.raises(ExchangeError, match="empty"):
        read_pelicun(path)
    monkeypatch.setattr("toppling.fragility.exchange.files.CURVE_BYTES", 2**20)
    path.write_bytes(b"a," * 2**20)
    with pytest.raises(ExchangeError, match="larger than 1 MiB"):
        read_pelicun(path)


@pytest.mark.parametrize(
    ("about", "refused"),
    [
        ("[1]", True),
        ("{", True),
        ('{"a": ' * 2000, True),
        ('<labels>{\\"median\\": \\"x\\"}}"}}', True),
        ('<labels>{\\"id\\": \\"x\\"}}"}}', True),
        ('{"a": 5}', False),
        ('<labels>{\\"block\\": 5}, \\"width\\": \\"wide\\"}"}}', False),
        ('{"a": {"Comments": "\\nLabels for toppling: {"}}', False),
        ('{"a": {"Comments": ["\\nLabels for toppling: {}"]}}', False),
        ('{"b": {"Comments": "Labels for toppling: []"}}', False),
    ],
)
def test_bad_metadata_are_refused_and_foreign_ones_left_alone(about, refused, tmp_path):
    (tmp_path / "t.csv").write_text(f"{HEADING}\n{ROW}", encoding="utf-8")
    labels = r'{"a": {"Comments": "\nLabels for toppling: {\"labels\": '
    (tmp_path / "t.json").write_text(about.replace("<labels>", labels), encoding="utf-8")
    with pytest.raises(ExchangeError) if refused else nullcontext():
        assert read_pelicun(tmp_path / "t.csv")["block"].values.tolist() == ["a"]


class TestLabels:
    @pytest.mark.slow
    @given(st.text(max_size=30))
    @settings(max_examples=500, **REPEATABLE)
    def test_no_cell_is_a_formula_and_all_come_back(self, text):
        cell = guarded(text)
        assert unguarded(cell) == text
        assert cell.lstrip()[:1] not in ("=", "+", "-", "@")
        assert not set(cell) & set("\t\r\n\0")

    @pytest.mark.parametrize("text", ["=1+1", "+1", "-1", "@x", " =1", "a;=1", "a|'=1", "\t=1", "＝1", "'=1", "\\x3b"])
    def test_known_injections(self, text):
        cell = guarded(text)
        assert cell != text
        assert unguarded(cell) == text

    def test_words_of_a_curve_are_no_formula(self, tmp_path):
        curves = lognormal(blocks=["a", "b"], models=["x"]).assign(weights=("block", ["=1+1", "0.9 | 0.1"]))
        written, found = there_and_back(curves, "csv", tmp_path)
        lines = written.paths[0].read_text(encoding="utf-8").splitlines()
        assert [line.split(",")[-1] for line in lines] == ["weights", "'=1+1", "0.9 | 0.1"]
        assert found["weights"].values.ravel().tolist() == ["=1+1", "0.9 | 0.1"]

    @pytest.mark.parametrize("name", FORMATS)
    def test_names_escape_nothing(self, name, tmp_path):
        """No file but those named, nothing in XML but what is ours, whatever a label holds."""
        evil = [
            '--><fragilityFunction id="evil"/><!--',
            "]]>",
            "</nrml>",
            "--",
            "-",
            "../../x",
            "C:\\x",
            "\x01\x85\ufffe",
        ]
        folder = tmp_path / "out"
        folder.mkdir()
        curves = lognormal(blocks=evil).isel(model=[0]).assign_attrs(title=evil[0])
        written, found = there_and_back(curves, name, folder)
        assert found["block"].values.tolist() == evil
        assert sorted(folder.iterdir()) == sorted(written.paths)
        assert [path.name for path in tmp_path.iterdir()] == ["out"]
        if name == "nrml":
            assert len(list(ET.parse(written.paths[0]).iter())) == 4 + 3 * len(evil)

    def test_a_label_that_no_file_can_hold(self, tmp_path):
        with pytest.raises(ValueError, match="holds characters that no text file can hold"):
            write_curve_csv(lognormal(blocks=["\ud800"]), tmp_path / "t.csv")


PIECES = [
    *b"nan inf 1e400 1e-400 -1 0 1_0 &x; &#0; <a> </a> ]]> <!-- --> <!DOCTYPE {} [ null true level limit_state".split(),
    *b"ID LS9-Family SA( PGV discrete \\ud800 \xce\xb4 \xff\xfe \xef\xbb\xbf \0 \" , ' = (".split(),
    *(b"\n", b"\r", b" ", b"1" * 400, b"9" * 5000),
]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["pelicun", "pelicun-levels", "metadata"])
def test_two_thousand_mutations(name, tmp_path, monkeypatch):
    """A damaged file gives curves or an ExchangeError, and quickly."""
    # the versions of packages take longer than all the rest, and do not depend on the file
    monkeypatch.setattr("toppling.fragility.exchange.datasets.provenance", lambda _: {})
    write, read, file = FORMATS["pelicun"]
    curves = isotonic() if "-" in name else lognormal(blocks=["a", "b c"], models=["x"])
    paths = write(curves, tmp_path / file).paths
    target = paths[-1] if name == "metadata" else paths[0]
    seed = target.read_bytes()
    rng = np.random.default_rng(np.random.SeedSequence(7, spawn_key=(len(name),)))
    read_well = 0
    for _ in range(2000):
        target.write_bytes(damaged(rng, seed, PIECES))
        try:
            found = read(paths[0])
        except ExchangeError as error:
            assert len(str(error)) < 700
            assert "\n" not in str(error)
            continue
        read_well += 1
        assert isinstance(found, xr.Dataset)
    assert 20 < read_well < 1980


def test_refused(refusal):
    refusal()


@pytest.mark.parametrize(
    "curves",
    [
        lognormal().assign_coords(block=[f"{chr(97 + k // 2)}{k % 2}".upper() for k in range(lognormal().block.size)]),
        lognormal().drop_vars(["block", "model"]),
        lognormal().isel(block=[0], model=[0]),
        lognormal().isel(block=0, model=0),
        lognormal().isel(block=[1, 0]),
        isotonic().isel(block=[1, 0]),
    ],
    ids=["capitals", "numbers", "one of each", "none", "reversed", "reversed points"],
)
def test_labels_that_differ_are_written(curves, tmp_path):
    for write, _, file in FORMATS.values():
        assert write(curves, tmp_path / file).ids
    assert write_pelicun(curves, tmp_path / "np.csv", directional=np.True_).ids
