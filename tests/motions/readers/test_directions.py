"""Vertical components among records: left out, wherever a file says that it is one, and taken on purpose."""

import re
import warnings
from pathlib import Path

import numpy as np
import pytest
import record_files as files
from table_rows import table_rows

import toppling as tp
from toppling import motions as mo
from toppling.core.doubts import ImplausibleInput
from toppling.motions import RecordError, records
from toppling.motions.plausibility import record_doubts
from toppling.motions.readers.directions import LEFT_OUT, direction_of, horizontal_motions
from toppling.studies import StudyError
from toppling.studies.command.cli import main

COUNTS = 61 * np.arange(-100, 100)
SHAKE = np.sin(0.3 * np.arange(60)) * np.sin(np.pi * np.arange(60) / 60.0) ** 2


def at2(folder, name, title="Somewhere, 1/2/1999, Station, 090"):
    text = files.at2(SHAKE, 0.01).splitlines()
    (folder / name).write_text("\n".join([text[0], title, *text[2:]]) + "\n", encoding="utf-8")


def kept(folder, patterns=("*",), **options):
    paths = sorted(path for pattern in patterns for path in folder.glob(pattern))
    return horizontal_motions({path: mo.read_all(path) for path in paths}, patterns, folder, **options)


def one_of(folder, about, text):
    """Files of a row of directions.csv."""
    rows = "".join(f"{0.01 * i:.2f},{a},{a * a},{a**3}\n" for i, a in enumerate(SHAKE))
    if about == "names of files":
        for name in text.split():
            at2(folder, name, "A synthetic motion")
        return len(text.split())
    if about == "second line of an AT2 file":
        at2(folder, "a.AT2")
        at2(folder, "shaking.AT2", f"Somewhere, 1/2/1999, Station, {text}")
    elif about == "a line of a header":
        rows = "".join(f"{0.01 * i:.2f},{a}\n" for i, a in enumerate(SHAKE))
        (folder / "a_1.csv").write_text(f"time (s),acc (g)\n{rows}", encoding="utf-8")
        (folder / "a_2.csv").write_text(f"{text}\ntime (s),acc (g)\n{rows}", encoding="utf-8")
    else:
        above = "" if text.endswith((")", "]")) else "# unit: g\n"
        (folder / "b.csv").write_text(f"{above}time (s),{text}\n{rows}", encoding="utf-8")
        return 3
    return 2


@pytest.mark.parametrize("row", table_rows(Path(__file__).with_name("directions.csv")))
def test_what_is_vertical(tmp_path, row):
    """Of a row of directions.csv what is vertical is left out; columns with units in brackets, or above them."""
    columns = row["about"] == "columns of a table"
    for number, unit in enumerate((" (g)", " [g]", "") if columns else ("",)):
        (folder := tmp_path / str(number)).mkdir()
        text = ",".join(f"{name}{unit}" for name in row["text"].split(",")) if columns else row["text"]
        every = one_of(folder, row["about"], text)
        out = [f"b {row['out']}{unit}"] if columns else row["out"].split()
        found = kept(folder)
        assert list(found[0].attrs.get(LEFT_OUT, ())) == out
        assert sum(array.sizes["motion"] for array in found) == every - len(out)


def test_columns_next_to_a_vertical_one(tmp_path):
    """Two unknown names of three columns are horizontal, which is said; others are refused."""
    rows = "".join(f"{0.01 * i:.2f},{a},{a * a},{a**3}\n" for i, a in enumerate(SHAKE))
    path = tmp_path / "b.csv"
    path.write_text(f"time (s),pohjoinen,itä,vertical\n{rows}", encoding="utf-8")
    with pytest.warns(ImplausibleInput, match="pohjoinen, itä: taken as horizontal next to vertical"):
        assert mo.read(path, unit="g").sizes["motion"] == 3
    path.write_text(f"time (s),foo,vertical,jerk\n{rows}", encoding="utf-8")
    with pytest.raises(RecordError, match="its column 'vertical' is vertical, foo no known direction: name the"):
        mo.read(path, unit="g")


def test_directions_of_other_languages_without_times(tmp_path):
    """Columns of directions alone: the first is no column of times."""
    rows = "".join(f"{a} {a * a} {a**3}\n" for a in SHAKE)
    (tmp_path / "b.txt").write_text(f"Unidades: cm/s2\ndt = 0.01\nEO NS UD\n{rows}", encoding="utf-8")
    assert mo.read(tmp_path / "b.txt")["component"].values.tolist() == ["EO", "NS", "UD"]


def test_a_line_of_an_at2_file_says_that_it_is_vertical(tmp_path):
    at2(tmp_path, "a_1.AT2", "Somewhere")
    at2(tmp_path, "a_2.AT2", "Somewhere, component: vertical")
    assert kept(tmp_path)[0].attrs[LEFT_OUT] == ("a_2.AT2",)


def test_a_second_line_that_says_up_beside_a_name_in_degrees(tmp_path):
    at2(tmp_path, "A_000.AT2")
    at2(tmp_path, "A_090.AT2", "Somewhere, 1/2/1999, Station, UP")
    with pytest.warns(ImplausibleInput, match="A_090.AT2: its second line says UP, its name 090, which is taken"):
        assert len(mo.read_all(tmp_path / "*.AT2")) == 2


@pytest.mark.parametrize(
    ("heading", "upright"),
    [
        ("time (s),UD (gal)", [True]),
        ("time,acc_z (g)", [True]),
        ("# Channel HNZ\ntime,a (g)", [True]),
        ("# channel 1 = NS; channel 2 = UP; channel 3 = EW\ntime,ch1 (g),ch2 (g),ch3 (g)", [False, True, False]),
        ("# ch2: UP\ntime,A1 (g),A2 (g)", [False, True]),
        ("# 1 = NS, 2 = EW, 3 = Z\ntime,acc_1 (g),acc_2 (g),acc_3 (g)", [False, False, True]),
        ("# channel 2 = broken\ntime,ch1 (g),ch2 (g)", [False, False]),
    ],
)
def test_vertical_columns_are_doubted_in_python(tmp_path, heading, upright):
    """`read` gives every component of a file, so analyses name the vertical ones, as studies leave them out."""
    rows = "".join(
        ",".join(map(str, (0.01 * i, a, a * a, a**3)[: 1 + len(upright)])) + "\n" for i, a in enumerate(SHAKE)
    )
    (tmp_path / "a.csv").write_text(f"{heading}\n{rows}", encoding="utf-8")
    plain = records(mo.read(tmp_path / "a.csv"))
    assert [record.upright for record in plain] == upright
    said = [doubt.sentence for doubt in record_doubts(plain, False)]
    assert sum("vertical component" in sentence for sentence in said) == any(upright)


def test_three_columns_are_doubted_on_reading(tmp_path):
    rows = "".join(f"{0.01 * i:.2f}\t{a}\t{a * a}\t{a**3}\n" for i, a in enumerate(SHAKE))
    (tmp_path / "a.txt").write_text(f"Time\tU1\tU2\tU3\nSec\tm/sec2\tm/sec2\tm/sec2\n{rows}", encoding="utf-8")
    with pytest.warns(ImplausibleInput, match="a.txt: three components, none of them known to be vertical"):
        mo.read(tmp_path / "a.txt")


def test_what_other_formats_say(tmp_path):
    counts = np.round(1000.0 * SHAKE).astype(int)
    (tmp_path / "a.UD").write_text(files.knet(np.tile(counts, 5)[:200], direction="U-D"), encoding="utf-8")
    (tmp_path / "a.EW").write_text(files.knet(np.tile(counts, 5)[:200], direction="E-W"), encoding="utf-8")
    rows = "".join(f"{0.01 * i:.2f},{a},{a}\n" for i, a in enumerate(SHAKE))
    (tmp_path / "b.csv").write_text(f"time (s),EW (g),UD (g)\n{rows}", encoding="utf-8")
    found = kept(tmp_path)
    assert list(found[0].attrs[LEFT_OUT]) == ["a.UD", "b UD (g)"]
    assert [array["component"].values.tolist() for array in found] == [["E-W"], ["EW (g)"]]


COSMOS = files.cosmos([[("acceleration", 40.0 * SHAKE)], [("acceleration", 20.0 * SHAKE)]])
ROWS = "".join(f"{0.01 * i:.2f},{a},{a * a}\n" for i, a in enumerate(SHAKE))
LONE = "".join(f"{0.01 * i:.2f},{a}\n" for i, a in enumerate(SHAKE))
CSMIP = files.csmip([SHAKE, SHAKE])


@pytest.mark.parametrize(
    ("written", "out"),
    [
        ({"A05.NS1": files.knet(COUNTS, direction="1"), "A05.NS2": files.knet(COUNTS, direction="4")}, "A05.NS1"),
        ({"A05.EW1": files.knet(COUNTS), "A05.EW2": files.knet(COUNTS)}, "A05.EW1"),
        (
            {"a.asc": files.esm(SHAKE), "hole.asc": files.esm(SHAKE).replace("LOC", "SENSOR_DEPTH_M: 37.5\nLOC")},
            "hole.asc",
        ),
        (
            {"a.asc": files.esm(SHAKE), "hole.asc": files.esm(SHAKE).replace("LOC", "SENSOR_DEPTH_M: -150\nLOC")},
            "hole.asc",
        ),
        *(
            ({"a.asc": files.esm(SHAKE), "b.csv": files.esm(SHAKE).replace("LOC", f"STATION_NAME: {name}\nLOC")}, out)
            for name, out in (
                ("BELL TOWER, ROOF", "b.csv"),
                ("TOWN HALL 5TH FLOOR", "b.csv"),
                ("ROOF LANE", ""),
                ("DEEP CREEK", ""),
                ("TOWER 1ST FLOOR", ""),
            )
        ),
        ({"a.v2c": COSMOS.replace("2) Location: none", "2) Location: Downhole -30 m")}, "180 deg borehole"),
        ({"a.v2c": COSMOS.replace("2) Location: none", "2) Location: 5th Floor: NE corner")}, "180 deg structure"),
        ({"a.v2c": COSMOS.replace("2) Location: none", "2) Location: 1st Floor: NE corner")}, ""),
        *(
            ({name: f"{line}\ntime (s),a (g)\n{LONE}" for name, line in (("a.csv", "# x"), ("b.csv", words))}, out)
            for words, out in (
                ("# Station ABC, floor 5", "b.csv"),
                ("# dam crest", "b.csv"),
                ("# 10th floor", "b.csv"),
                ("# top of specimen", "b.csv"),
                ("# at 30 m depth", "b.csv"),
                ("# 屋上", "b.csv"),
                ("# hypocentral depth: 10 km", ""),
                ("# 5-storey building, basement", ""),
                ("# Vs30 from a borehole: 560 m/s", ""),
                ("# 1st floor", ""),
            )
        ),
        ({"b.csv": f"time (s),NS surface (g),NS borehole (g)\n{ROWS}"}, "NS borehole (g)"),
        ({"a.v2": re.sub(r"(2:  H2 +\n)\n", r"\1Location: Roof, south\n", CSMIP)}, "chan 2 H2 structure"),
    ],
)
def test_sensors_that_are_not_on_the_ground(tmp_path, written, out, monkeypatch):
    """Boreholes and floors of buildings are left out beside the ground, with a note of which."""
    for name, text in written.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    with warnings.catch_warnings(record=True, action="always") as said:
        found = mo.read_all("*")
    assert sum(array.sizes["motion"] for array in found) == (1 if out else 2)
    assert [out in str(one.message) and "left out" in str(one.message) for one in said] == [True] * bool(out)
    if len(written) == 2 and out and out != "b.csv":  # (by itself, or where there is no other)
        assert mo.read(out)["component"].values[0].endswith("borehole")
        with pytest.warns(ImplausibleInput, match="taken as ground motion, since there is no other"):
            assert mo.read_all(f"*{out[1:]}")[0].sizes["motion"] == 1


def test_pairs_of_the_ground(tmp_path):
    for number, along in enumerate(("NS1", "EW1", "NS2", "EW2"), start=1):
        direction = str(number if number < 3 else number + 1)
        (tmp_path / f"A05.{along}").write_text(files.knet(COUNTS, direction=direction), encoding="utf-8")
    with pytest.warns(
        ImplausibleInput, match=r"2 components of a borehole or structure \(A05.EW1, A05.NS1\): left out"
    ):
        (pair,) = files.read_pairs([str(tmp_path / "A05.*")])
    assert pair.sizes["motion"] == 1


@pytest.mark.parametrize("names", ["roof,table,zenith", "acc_a,acc_b,acc_c", "acc_1,acc_2,acc_3", "CH1,ch2,CH3"])
def test_three_columns_of_which_none_is_known_to_be_vertical(tmp_path, names):
    heading = ",".join(f"{name} (g)" for name in names.split(","))
    rows = "".join(f"{0.01 * i:.2f},{a},{a * a},{a**3}\n" for i, a in enumerate(SHAKE))
    (tmp_path / "b.csv").write_text(f"time (s),{heading}\n{rows}", encoding="utf-8")
    with pytest.warns(ImplausibleInput, match="b.csv: three components, none of them known to be vertical"):
        (found,) = kept(tmp_path)
    assert found.sizes["motion"] == 3
    assert LEFT_OUT not in found.attrs


@pytest.mark.parametrize(
    ("names", "asked"),
    [
        *((f"x_{names}", True) for names in ("HL1,x_HL2,x_HL3", "chan1,x_chan2,x_chan3")),
        ("a.comp1,a.comp2,a.comp3", True),
        ("x_dir1,x_dir2,x_dir3", True),
        ("051WCW080512142801010101,051WCW080512142801010102,051WCW080512142801010103", True),
        ("rec1,rec2,rec3", False),
        ("x_NS,x_EW,x_c", True),
        ("NS,EW,c", True),
        ("x_NS,x_EW,x_h2", False),
        ("x_1,x_2,x_c", False),
        ("a,b,c", False),
    ],
)
def test_three_files_of_which_none_is_known_to_be_vertical(tmp_path, names, asked):
    for name in names.split(","):
        at2(tmp_path, f"{name}.AT2", "A synthetic motion")
    with warnings.catch_warnings(record=True, action="always") as said:
        assert len(kept(tmp_path)) == 3
    assert ["none of them" in str(warning.message) for warning in said] == [True] * asked


def test_directions_beside_units_of_names():
    up = ("az_g", "acc_z_gal", "z-acc_g", "UD_gal", "Vertical acceleration", "acc v", "上下")
    assert [direction_of(name)[0] for name in up] == [True] * len(up)
    assert [direction_of(name)[0] for name in ("ax_g", "acc_y_m_s2", "NS_gal", "acc EW")] == [False] * 4
    assert [direction_of(name) for name in ("a", "acc", "gaz", "azimuth", "g")] == [None] * 5


def test_vertical_ones_on_purpose(tmp_path):
    for name in ("A000.AT2", "A-UP.AT2"):
        at2(tmp_path, name)
    (found,) = kept(tmp_path, ["A-UP.AT2"])
    assert found["motion"].values.tolist() == ["A-UP"]
    assert LEFT_OUT not in found.attrs
    (found,) = kept(tmp_path, vertical=True)
    assert found["motion"].values.tolist() == ["A-UP"]
    none = r"A-UP.AT2: none of these records is horizontal: "
    with pytest.raises(RecordError, match=rf"{none}a file named by itself is taken$"):  # (Python has no component)
        mo.read_all(tmp_path / "*UP.AT2")
    path = tmp_path / "study.toml"
    path.write_text(STUDY.format("").replace("*.AT2", "*UP.AT2"), encoding="utf-8")
    with pytest.raises(StudyError, match=rf"{none}component = 'v', or a file named by itself, takes them$"):
        tp.Study.from_toml(path)


STUDY = """title = "Verticals"
[[blocks]]
catalogue = "bookcase-5-shelf"
[[models]]
law = "housner"
[motions]
records = "*.AT2"
{}
[ida]
im = "pga"
levels = {{ from = 0.1, to = 1.0, number = 3, unit = "g" }}
"""


@pytest.mark.slow
def test_a_command_of_files_names_no_key(tmp_path, capsys):
    for name in ("A000.AT2", "A-UP.AT2"):
        at2(tmp_path, name)
    assert main(["motions", str(tmp_path / "*.AT2"), "--out", str(tmp_path / "out")]) == 0
    assert "(A-UP.AT2): a file" in capsys.readouterr().out


def test_a_study_notes_what_it_leaves_out(tmp_path):
    for name in ("A000.AT2", "A090.AT2", "A-UP.AT2"):
        at2(tmp_path, name)
    path = tmp_path / "study.toml"
    path.write_text(STUDY.format(""), encoding="utf-8")
    study = tp.Study.from_toml(path)
    (note,) = [note for note in study.notes if "vertical" in note]
    assert "(A-UP.AT2): component =" in note
    assert len(records(study.design.motions)) == 2
    path.write_text(STUDY.format("component = 'v'"), encoding="utf-8")
    assert [one.label for one in records(tp.Study.from_toml(path).design.motions)] == ["A-UP"]
    path.write_text(STUDY.format("component = 'v'\nvertical = true"), encoding="utf-8")
    with pytest.raises(StudyError, match=r"vertical needs motions\.component"):
        tp.Study.from_toml(path)


@pytest.mark.parametrize(
    ("names", "ends", "degrees"),
    [
        (("R_STAC018.AT2", "R_STAC108.AT2", "R_STACUP.AT2"), ("", "", ""), (18.0, 108.0)),
        (("RSN3_STACN18E.AT2", "RSN3_STACS72E.AT2", "RSN3_STACUP.AT2"), ("N18E", "S72E", "UP"), (18.0, 108.0)),
        (("STACN18E.AT2", "STACS72E.AT2", "STACUP.AT2"), ("N18E", "S72E", "UP"), (18.0, 108.0)),
        (("S--L.AT2", "S--T.AT2", "S--V.AT2"), ("L", "T", "V"), (0.0, 90.0)),
        (("S-L1.AT2", "S-T1.AT2", "S-V1.AT2"), ("L1", "T1", "V1"), (0.0, 90.0)),
        (("RSN4_S0XTE.AT2", "RSN4_S0YLN.AT2", "RSN4_S0ZUP.AT2"), ("XTE", "YLN", "UP"), (90.0, 0.0)),
        (("S.BH1.00.AT2", "S.BH2.00.AT2", "S.BHZ.00.AT2"), ("BH100", "BH200", "BHZ00"), (0.0, 90.0)),
    ],
)
def test_components_of_one_recording(tmp_path, names, ends, degrees):
    for name, end in zip(names, ends, strict=True):
        at2(tmp_path, name, f"Somewhere, 1/2/1999, Station, {end}")
    (pair,) = files.read_pairs([tmp_path / name for name in names])
    assert pair["component"].values.tolist() == ["h1", "h2", "v"]
    np.testing.assert_allclose(np.degrees(pair["azimuth"].values[0, :2]), degrees, atol=1e-9)


def test_esm_and_csmip_by_their_headers(tmp_path):
    for stream in ("HNE", "HNN", "HNZ"):
        text = files.esm(SHAKE).replace("STREAM: HNE", f"STREAM: {stream}")
        (tmp_path / f"XX.AAA..{stream}.D.20200101.000000.C.ACC.ASC").write_text(text, encoding="utf-8")
    (pair,) = files.read_pairs(sorted(tmp_path.glob("*.ASC")))
    np.testing.assert_allclose(np.degrees(pair["azimuth"].values[0, :2]), [90.0, 0.0])
    for number, direction in enumerate(("110 Deg", "Up", "20 Deg"), 1):
        text = files.csmip([SHAKE]).replace("Chan  1:  H1", f"Chan  {number}: {direction}")
        (tmp_path / f"CHAN00{number}.V2").write_text(text, encoding="utf-8")
    (pair,) = files.read_pairs(sorted(tmp_path.glob("*.V2")))
    np.testing.assert_allclose(np.degrees(pair["azimuth"].values[0, :2]), [110.0, 20.0])
    assert pair.sizes["component"] == 3


class TestPatterns:
    """`read_all` takes the files that a pattern names, sorted, and leaves vertical components out, as studies do."""

    @pytest.fixture
    def folder(self, tmp_path):
        for name in ("B_090.AT2", "A_090.AT2", "A_000.AT2", "A_UP.AT2"):
            at2(tmp_path, name, "Somewhere, 1/2/1999, Station, -")
        (tmp_path / "deep").mkdir()
        at2(tmp_path / "deep", "C_090.AT2")
        return tmp_path

    def names(self, arrays):
        return [str(array["source"].values[0]).rpartition("/")[2] for array in arrays]

    @pytest.mark.parametrize("kind", [str, lambda path: path], ids=["str", "path"])
    def test_without_vertical_components(self, folder, kind):
        with pytest.warns(ImplausibleInput, match=r"a vertical component is left out \('?A_UP.AT2") as told:
            found = mo.read_all(kind(folder / "*.AT2"))
        assert self.names(found) == ["A_000.AT2", "A_090.AT2", "B_090.AT2"]
        assert len(told) == 1

    def test_any_depth(self, folder):
        (folder / "A_UP.AT2").unlink()
        assert len(mo.read_all(folder / "**" / "*.AT2")) == 4

    def test_one_file_by_itself_is_taken(self, folder):
        assert self.names(mo.read_all(folder / "A_UP.AT2")) == ["A_UP.AT2"]

    def test_brackets_of_a_name_are_no_pattern(self, folder):
        at2(folder, "D[1]_090.AT2")
        assert self.names(mo.read_all(folder / "D[1]_090.AT2")) == ["D[1]_090.AT2"]

    @pytest.mark.parametrize("pattern", ["*.v2", "X?_090.AT2", "[XY]_090.AT2"])
    def test_that_name_nothing_are_refused(self, folder, pattern):
        with pytest.raises(RecordError, match="path: no file matches"):
            mo.read_all(folder / pattern)

    def test_step_and_unit_go_to_every_file(self, tmp_path):
        for name in ("a.csv", "b.csv"):
            (tmp_path / name).write_text("\n".join(["acceleration", *map(str, SHAKE)]), encoding="utf-8")
        found = mo.read_all(tmp_path / "*.csv", dt=0.01, unit="g")
        assert [float(array["dt"][0]) for array in found] == [0.01, 0.01]
        np.testing.assert_allclose(found[1].values[0], 9.80665 * SHAKE, rtol=1e-12)

    def test_pairs(self, folder):
        (pair,) = files.read_pairs([folder / "A_0*.AT2"])
        assert pair.sizes["component"] == 2

    def test_several_files_are_no_pair_of_read(self, folder):
        with pytest.raises(RecordError, match="no such file"):
            mo.read(folder / "A_0*.AT2")
