"""Record files: both AT2 headers, plain CSV, and faulty files of both kinds."""

import errno
import os

import numpy as np
import pytest
from failing_calls import refuse_opening
from shared_cases import SHARED, needs_shared

from toppling import motions as mo
from toppling.core.units import STANDARD_GRAVITY as G
from toppling.motions import RecordError
from toppling.motions.readers.lines import Lines

HEADER = "PEER STRONG MOTION DATABASE RECORD\nSOMEWHERE 01/01/00, STATION\nACCELERATION TIME HISTORY IN UNITS OF G\n"


def at2(tmp_path, body, last="NPTS= 4, DT= .01000 SEC", header=HEADER):
    path = tmp_path / "RECORD.AT2"
    path.write_text(f"{header}{last}\n{body}\n")
    return path


def csv(tmp_path, text):
    path = tmp_path / "record.csv"
    path.write_text(text)
    return path


class TestAt2:
    @pytest.mark.parametrize(
        "last",
        ["NPTS=  4, DT= .01000 SEC", "NPTS=   4, dt=  .01000", "NPTS=4,DT=0.01", "  npts = 4 , dt = 1.0E-02 SEC"],
    )
    def test_headers(self, tmp_path, last):
        motion = mo.read(at2(tmp_path, " .1 -.2E+00 0.3 .4", last))
        assert motion.dims == ("motion", "time")
        assert motion.motion.values.tolist() == ["RECORD"]
        np.testing.assert_allclose(motion.values[0], np.array([0.1, -0.2, 0.3, 0.4]) * G, rtol=1e-15)
        assert float(motion.dt[0]) == 0.01
        assert motion.attrs["title"] == "SOMEWHERE 01/01/00, STATION"

    def test_columns_that_run_together(self, tmp_path):
        motion = mo.read(at2(tmp_path, "-.1000000E+00-.2000000E+00\n .3000000E-01-.4000000D-01"))
        np.testing.assert_allclose(motion.values[0] / G, [-0.1, -0.2, 0.03, -0.04], rtol=1e-15)

    @pytest.mark.parametrize(("unit", "factor"), [("CM/S/S", 0.01), ("CM/SEC**2", 0.01), ("M/S^2", 1.0), ("G", G)])
    def test_units_are_honoured(self, tmp_path, unit, factor):
        header = HEADER.replace("UNITS OF G", f"UNITS OF {unit}")
        motion = mo.read(at2(tmp_path, "1 2 3 4", header=header))
        np.testing.assert_allclose(motion.values[0], np.array([1.0, 2.0, 3.0, 4.0]) * factor, rtol=1e-15)

    def test_round_trip(self, tmp_path):
        motion = mo.CloughPenzien(duration=3.0, dt=0.01).sample(1, seed=5)
        mo.write_at2(motion, tmp_path / "out.AT2", title="A SIMULATED MOTION")
        again = mo.read(tmp_path / "out.AT2")
        np.testing.assert_allclose(again.values, motion.values, rtol=1e-6, atol=1e-9)
        assert float(again.dt[0]) == 0.01
        with pytest.raises(ValueError, match="exactly one motion, got 2"):
            mo.write_at2(mo.CloughPenzien(duration=3.0).sample(2), tmp_path / "two.AT2")

    def test_words_of_the_title_are_not_units(self, tmp_path):
        header = HEADER.replace("SOMEWHERE", "SANTA CRUZ COMMUNITY HOSPITAL UNIT 5, UNITED STATES, VELOCITY ROAD")
        motion = mo.read(at2(tmp_path, "1 2 3 4", header=header))
        assert motion.values[0, 0] == G

    BROKEN = [
        ("1 2 3", {}, "declares 4 samples .NPTS. but holds 3: truncated or damaged"),
        ("1 2 3 4 5", {}, "declares 4 samples .NPTS. but holds 5"),
        ("1 2 x 4", {}, "line 5 holds 'x 4', no number"),
        ("1 2 nan 4", {}, "sample 3 is nan"),
        ("1 2 1e999 4", {}, "sample 3 is inf"),
        ("1 2 3 4", {"last": "NPTS= 4, DT= .0 SEC"}, "DT must lie between 0 and 1 s, got 0"),
        ("1 2 3 4", {"last": "NPTS= 4, DT= -.01 SEC"}, "DT must lie between 0 and 1 s"),
        ("1", {"last": "NPTS= 1, DT= .01 SEC"}, "declares 1 samples, a motion has at least 2"),
        ("1 2 3 4", {"header": HEADER.replace("ACCELERATION", "VELOCITY")}, "a velocity record, not acceleration"),
        ("1 2 3 4", {"header": HEADER.replace("UNITS OF G", "UNITS OF FURLONGS")}, "unknown unit"),
    ]

    @pytest.mark.parametrize(("body", "options", "message"), BROKEN, ids=[m for *_, m in BROKEN])
    def test_broken_files(self, tmp_path, body, options, message):
        path = at2(tmp_path, body, **options)
        with pytest.raises(RecordError, match=message) as error:
            mo.read(path)
        assert str(path) in str(error.value)
        assert "\n" not in str(error.value)

    @needs_shared
    def test_el_centro(self):
        motion = mo.read(SHARED / "data/records/elCentro.AT2")
        assert motion.sizes["time"] == 1559
        assert float(motion.dt[0]) == 0.02
        assert float(mo.measures(motion).pga[0]) / G == pytest.approx(0.319, abs=5e-4)

    @pytest.mark.slow
    @needs_shared
    def test_the_whole_suite(self):
        paths = sorted((SHARED / "data/records/suite").glob("*.AT2"))
        assert len(paths) == 59
        found = mo.measures([mo.read(path) for path in paths])
        assert found.sizes["motion"] == 59
        assert found.pga.min() / G == pytest.approx(0.007, abs=1e-3)
        assert found.pga.max() / G == pytest.approx(0.48, abs=5e-3)
        assert set(np.round(found.dt.values, 5)) == {0.00244, 0.004, 0.005, 0.01, 0.02}

    @needs_shared
    def test_truncated_real_record(self, tmp_path):
        text = (SHARED / "data/records/suite/SHL000.AT2").read_text()
        short = tmp_path / "SHL000.AT2"
        short.write_text(text[: text.rindex("\n", 0, len(text) // 2)])
        with pytest.raises(RecordError, match="declares 1800 samples"):
            mo.read(short)
        short.write_text(text[: len(text) // 2])
        with pytest.raises(RecordError, match=r"declares 1800 samples|truncated"):
            mo.read(short)


class TestCsv:
    def test_time_and_acceleration(self, tmp_path):
        motion = mo.read(csv(tmp_path, "time,acceleration (m/s2)\n0.00,0.1\n0.01,0.2\n0.02,-0.3\n"))
        assert motion.values[0].tolist() == [0.1, 0.2, -0.3]
        assert float(motion.dt[0]) == pytest.approx(0.01)

    @pytest.mark.parametrize(
        ("heading", "factor"),
        [
            ("time_s,acceleration_g", G),
            ("t (s); a (cm/s2)", 0.01),
            ("Time [s],Acc [m/s^2]", 1.0),
            ("time,acc (gal)", 0.01),
            ("time_s,acceleration_m_s2", 1.0),
            ("time_s,acceleration_cm_s2", 0.01),
            ("acceleration in g", G),
        ],
    )
    def test_units_in_the_heading(self, tmp_path, heading, factor):
        motion = mo.read(csv(tmp_path, f"{heading}\n0.00,1.0\n0.02,2.0\n0.04,3.0\n"))
        np.testing.assert_allclose(motion.values[0], np.array([1.0, 2.0, 3.0]) * factor, rtol=1e-15)

    def test_one_column_and_dt(self, tmp_path):
        path = csv(tmp_path, "1.0\n2.0\n3.0\n")
        assert float(mo.read(path, dt=0.02, unit="g").dt[0]) == 0.02
        with pytest.raises(RecordError, match=r"states no unit of its accelerations: write it .* or give unit"):
            mo.read(path, dt=0.02)
        stated = csv(tmp_path, "# dt = 0.004, acceleration in g\n1.0\n2.0\n")
        assert float(mo.read(stated).dt[0]) == 0.004
        assert mo.read(stated).values[0, 0] == G

    BROKEN = [
        ("1.0\n2.0\n", {}, "has no time column, so dt must be given"),
        ("t,acc (ft/s2)\n0,1\n0.01,2\n", {}, "unknown unit 'ft/s2'"),
        ("t,acc (mg)\n0,1\n0.01,2\n", {}, "unknown unit 'mg'"),
        ("t,acc_mg\n0,1\n0.01,2\n", {}, "unknown unit 'mg'"),
        ("t (h),acc (g)\n0,1\n10,2\n", {}, "unknown unit 'h'"),
        ("t (s),velocity (cm/s)\n0,1\n0.01,2\n", {}, "velocity or displacement"),
        ("PEER STRONG MOTION\njunk\n", {}, "looks like a PEER file"),
        ("0,1\n0.01,2\n", {"dt": 0.01}, "has a time column, so dt must not be given"),
        ("0,1\n0.01,2\n0.05,3\n", {}, "must be uniform: sample 1 lies at 0.01 s"),
        ("0,1\n0,2\n0,3\n", {}, "must increase"),
        ("0,1\n0.01\n", {}, "line 2 has 1 columns, the first has 2"),
        ("0,1,2\n", {}, "line 1 has 3 columns, allowed are 1 or 2"),
        ("0,1\n0.01,two\n", {}, "line 2 holds '0.01,two', no numbers"),
        ("0,1\n0.01,nan\n", {}, "row 2 is not finite"),
        ("0,1\n", {}, "at least 2 samples, found 1"),
        ("only words\nand more words\n", {}, "at least 2 samples, found 0"),
        ("<!DOCTYPE html><html></html>", {}, "a web page"),
        ("   \n", {}, "empty"),
        ("0,1\0\n", {}, "NUL"),
    ]

    @pytest.mark.parametrize(("text", "options", "message"), BROKEN, ids=[m for *_, m in BROKEN])
    def test_broken_files(self, tmp_path, text, options, message):
        path = csv(tmp_path, text)
        with pytest.raises(RecordError, match=message) as error:
            mo.read(path, **options)
        assert str(path) in str(error.value)
        assert "\n" not in str(error.value)


def test_missing_and_unreadable_files(tmp_path):
    with pytest.raises(RecordError, match="no such file"):
        mo.read(tmp_path / "nothing.AT2")
    with pytest.raises(RecordError, match="not a file"):
        mo.read(tmp_path)
    locked = at2(tmp_path, "1 2 3 4")
    locked.chmod(0)
    if os.access(locked, os.R_OK):
        pytest.skip("this user reads every file")
    with pytest.raises(RecordError, match="cannot be read"):
        mo.read(locked)


def test_a_disk_that_fails_while_a_record_is_read(tmp_path, monkeypatch):
    """The file is opened four times: for its kind, its line ends, its lines, and again as its last one has no end."""
    path = csv(tmp_path, "\n".join(f"{0.01 * i:.2f},{0.1:.4f}" for i in range(9)))
    for number in range(1, 5):
        with monkeypatch.context() as context:
            refuse_opening(context, path.name, number)
            with pytest.raises(RecordError, match=r"record.csv: cannot be read \(Input/output error\)"):
                [*Lines(path)]
    refuse_opening(monkeypatch, path.name, 5)
    with Lines(path) as lines:
        assert len([*lines]) == 9

        def refuse():
            raise OSError(errno.EIO, "Input/output error")

        lines._stream.close = refuse  # (nothing is lost)


@pytest.mark.slow
def test_mutated_files_give_only_the_readers_error(tmp_path):
    """Damaged copies of the example record are read, or refused by a RecordError of one line, in short time."""
    with open(mo.example_path(), encoding="ascii") as file:
        lines = file.read().splitlines()[:60]
    lines[3] = lines[3].replace("2001", str(5 * 56))
    source = "\n".join(lines).encode()
    path = tmp_path / "damaged.AT2"
    path.write_bytes(source)
    assert mo.read(path).sizes["time"] == 280
    rng = np.random.default_rng(3)
    refused = 0
    for _ in range(1500):
        data = bytearray(source)
        for _ in range(int(rng.integers(1, 6))):
            at = int(rng.integers(len(data)))
            kind = rng.integers(4)
            if kind == 0:
                data[at] = int(rng.integers(256))
            elif kind == 1:
                del data[at : at + int(rng.integers(1, 40))]
            elif kind == 2:
                data[at:at] = bytes(rng.integers(32, 127, int(rng.integers(1, 20)), dtype=np.uint8))
            else:
                data = data[: at + 1]
        path.write_bytes(bytes(data))
        try:
            motion = mo.read(path)
        except RecordError as error:
            refused += 1
            assert "\n" not in str(error)
        else:
            assert np.isfinite(motion.values).all()
    assert refused > 500


def test_example_record_ships():
    motion = mo.read(mo.example_path())
    assert float(mo.measures(motion).pga[0]) / G == pytest.approx(0.35, rel=1e-6)
    assert motion.sizes["time"] == 2001
