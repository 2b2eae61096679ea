"""Record files: AT2 and plain CSV; headers.csv has the other headers and faulty files of both."""

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


def at2(tmp_path, body):
    path = tmp_path / "RECORD.AT2"
    path.write_text(f"{HEADER}NPTS= 4, DT= .01000 SEC\n{body}\n")
    return path


def csv(tmp_path, text):
    path = tmp_path / "record.csv"
    path.write_text(text)
    return path


class TestAt2:
    def test_header(self, tmp_path):
        motion = mo.read(at2(tmp_path, " .1 -.2E+00 0.3 .4"))
        assert motion.dims == ("motion", "time")
        assert motion.motion.values.tolist() == ["RECORD"]
        np.testing.assert_allclose(motion.values[0], np.array([0.1, -0.2, 0.3, 0.4]) * G, rtol=1e-15)
        assert float(motion.dt[0]) == 0.01
        assert motion.attrs["title"] == "SOMEWHERE 01/01/00, STATION"

    def test_columns_that_run_together(self, tmp_path):
        motion = mo.read(at2(tmp_path, "-.1000000E+00-.2000000E+00\n .3000000E-01-.4000000D-01"))
        np.testing.assert_allclose(motion.values[0] / G, [-0.1, -0.2, 0.03, -0.04], rtol=1e-15)

    def test_round_trip(self, tmp_path):
        motion = mo.CloughPenzien(duration=3.0, dt=0.01).sample(1, seed=5)
        mo.write_at2(motion, tmp_path / "out.AT2", title="A SIMULATED MOTION")
        again = mo.read(tmp_path / "out.AT2")
        np.testing.assert_allclose(again.values, motion.values, rtol=1e-6, atol=1e-9)
        assert float(again.dt[0]) == 0.01
        with pytest.raises(ValueError, match="exactly one motion, got 2"):
            mo.write_at2(mo.CloughPenzien(duration=3.0).sample(2), tmp_path / "two.AT2")

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

    def test_one_column_and_dt(self, tmp_path):
        path = csv(tmp_path, "1.0\n2.0\n3.0\n")
        assert float(mo.read(path, dt=0.02, unit="g").dt[0]) == 0.02
        with pytest.raises(RecordError, match=r"states no unit of its accelerations: write it .* or give unit"):
            mo.read(path, dt=0.02)
        stated = csv(tmp_path, "# dt = 0.004, acceleration in g\n1.0\n2.0\n")
        assert float(mo.read(stated).dt[0]) == 0.004
        assert mo.read(stated).values[0, 0] == G


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


def test_example_record_ships():
    motion = mo.read(mo.example_path())
    assert float(mo.measures(motion).pga[0]) / G == pytest.approx(0.35, rel=1e-6)
    assert motion.sizes["time"] == 2001
