"""What headers of text records say: units, quantities, steps and counts, wherever and however they are written."""

import re
import warnings
from pathlib import Path

import numpy as np
import pytest
from table_rows import table_rows

from toppling import motions as mo
from toppling.core.doubts import ImplausibleInput
from toppling.core.units import STANDARD_GRAVITY as G
from toppling.motions import RecordError
from toppling.motions.readers.units import unit_factor

SAMPLES = [0.1, -0.2, 0.15, 0.05, -0.1, 0.0, 0.1, 0.2, -0.15, 0.05, 0.01, -0.02]
COLUMN = "".join(f"{one}\n" for one in SAMPLES)
ROWS = "".join(f"{0.01 * i:.2f},{one}\n" for i, one in enumerate(SAMPLES))


NPTS = "NPTS= 12, DT= .0100 SEC"
PARTS = {
    "<column>": COLUMN,
    "<rows>": ROWS,
    "<rows in ms>": "".join(f"{0.5 * i:.2f},{one}\n" for i, one in enumerate(SAMPLES)),
    "<rows in days>": "".join(f"{1e-7 * i:.7f},{one}\n" for i, one in enumerate(SAMPLES)),
    "<minus signs>": COLUMN.replace("-", "\N{MINUS SIGN}"),
    "<rows;>": ROWS.replace(",", ";"),
    "<decimal commas>": ROWS.translate(str.maketrans(",.", ";,")),
    "<decimal commas between tabs>": ROWS.translate(str.maketrans(",.", "\t,")),
    "<columns>": ROWS.replace(",", " "),
    "<samples>": " ".join(map(str, SAMPLES)),
    "<title>": "PEER RECORD\nSomewhere, 1/2/1999, Station, 090",
    "<npts>": NPTS,
}
"""What stands in place of words in brackets in the texts of headers.csv."""


def at2(header):
    return f"{header}\n{PARTS['<samples>']}\n"


def read(tmp_path, text, name="record.csv", **options):
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return mo.read(path, **options)


@pytest.mark.parametrize("row", table_rows(Path(__file__).with_name("headers.csv"), PARTS))
def test_what_a_header_says(tmp_path, row):
    """A row of headers.csv: a text is refused, or read with this unit and step, and doubted or not."""
    options = {"unit": row["unit"] or None, "dt": float(row["dt"]) if row["dt"] else None}
    name = row["file"] or "record.csv"
    if row["refused"]:
        with pytest.raises(RecordError, match=row["refused"]) as error:
            read(tmp_path, row["text"], name, **options)
        assert str(error.value).startswith(str(tmp_path / name))
        assert "\n" not in str(error.value)
        return
    with warnings.catch_warnings(record=True, action="always") as told:
        motion = read(tmp_path, row["text"], name, **options)
    factor = G if row["factor"] == "g" else float(row["factor"])
    np.testing.assert_allclose(motion.values, [np.array(SAMPLES) * factor], rtol=1e-13)
    assert float(motion["dt"][0]) == pytest.approx(float(row["step"]), rel=1e-9)
    assert row["noted"] in f"{motion.attrs.get('processing')} {motion['unit_from'].item()}"
    assert [bool(re.search(row["doubted"], str(doubt.message))) for doubt in told] == [True] * bool(row["doubted"])
    if row["contradicted"]:
        with pytest.raises(RecordError, match=f"its header says dt = {row['step']} s, so dt must not be"):
            read(tmp_path, row["text"], name, **{**options, "dt": float(row["contradicted"])})


@pytest.mark.parametrize(
    "text", ["time (s),acc (counts)", "# acceleration in counts\ntime,acc", "time,acc\ns,mg", "time_s,acc_counts"]
)
def test_a_number_is_of_any_unit_that_is_not_read(tmp_path, text):
    motion = read(tmp_path, f"{text}\n{PARTS['<rows>']}", unit=0.5)
    np.testing.assert_allclose(motion.values, [np.array(SAMPLES) * 0.5], rtol=1e-13)
    for known in ("time (s),acc (g)", "time (s),acc (cm/s)"):
        with pytest.raises(RecordError, match=r"unit must not be given|not acceleration"):
            read(tmp_path, f"{known}\n{PARTS['<rows>']}", unit=0.5)


def test_columns_above_the_ground_are_doubted(tmp_path):
    with pytest.warns(ImplausibleInput, match="acc_block .g.: of a structure or block, not of its ground motion?"):
        read(tmp_path, columns("time (s),acc_block (g),acc_table (g)", 1, 2))
    for name in ("Specimen top acc (g)", "Acc. floor 1 (g)", "Acc Top (g)", "bookcase (g)"):
        with pytest.warns(ImplausibleInput, match="of a structure or block, not of its ground motion?"):
            read(tmp_path, columns(f"time (s),table (g),{name}", 1, 2))
    with pytest.warns(ImplausibleInput, match="drift is left out: no acceleration, by its name"):
        motion = read(tmp_path, columns("# units: g\ntime (s),ground,drift", 1, 1))
    assert motion.sizes["motion"] == 1


def columns(heading, *factors):
    rows = zip(*(np.roll(SAMPLES, i) * factor for i, factor in enumerate(factors)), strict=True)
    return f"{heading}\n" + "".join(
        f"{0.01 * i:.2f},{','.join(map(repr, map(float, row)))}\n" for i, row in enumerate(rows)
    )


@pytest.mark.parametrize(
    "heading",
    [
        'time,"Acceleration x (m/s^2)","Acceleration y (m/s^2)","Absolute acceleration (m/s^2)"',
        "time,NS (m/s2),EW (m/s2),resultant (m/s2)",
        "time,acc_x (m/s2),acc_y (m/s2),magnitude (m/s2)",
        "time,ax (m/s2),ay (m/s2),vector sum (m/s2)",
        "time,ax (m/s2),ay (m/s2),total (m/s2)",
        "# acceleration in m/s2\ntime,ax,ay,aT",
        "# acceleration in m/s2\ntime,ax,ay,a_total",
        "time,H1 (m/s2),H2 (m/s2),mean (m/s2)",
        "time,NS (m/s2),EW (m/s2),RotD50 (m/s2)",
        "# acceleration in m/s2\ntime,gFx,gFy,TgF",
    ],
)
def test_resultants_are_left_out(tmp_path, heading):
    with pytest.warns(ImplausibleInput, match="is left out: a resultant, or relative"):
        motion = read(tmp_path, columns(heading, 1, 1, 1))
    np.testing.assert_allclose(motion.values, [SAMPLES, np.roll(SAMPLES, 1)], rtol=1e-15)


def test_relative_columns_beside_total_ones_are_left_out(tmp_path):
    with pytest.warns(ImplausibleInput, match=r"record.csv: roof rel\. acc \(m/s2\) is left out"):
        motion = read(tmp_path, columns("time,roof rel. acc (m/s2),roof total acc (m/s2),table (m/s2)", 1, 1, 1))
    np.testing.assert_allclose(motion.values, [np.roll(SAMPLES, 1), np.roll(SAMPLES, 2)], rtol=1e-15)


def test_a_total_acceleration_alone_is_one(tmp_path):
    assert read(tmp_path, columns("time,total acceleration (g)", 1)).sizes["motion"] == 1
    assert read(tmp_path, columns("time,absolute (g),total (g)", 1, 1)).sizes["motion"] == 2


@pytest.mark.parametrize("heading", ["time,acc (g),acc (m/s2)", "time,a1 (g),a2 (g)"])
def test_one_signal_in_two_units_is_refused(tmp_path, heading):
    rows = "".join(f"{0.01 * i:.2f},{one},{9.8 * one:.4f}\n" for i, one in enumerate(SAMPLES))
    with pytest.raises(RecordError, match=r"its columns .* are one signal twice, or no motion"):
        read(tmp_path, f"{heading}\n{rows}")


@pytest.mark.parametrize("heading", ["time,NS corrected (g),EW corrected (g)", "time,roof (g),table (g)"])
def test_columns_of_two_motions_are_read(tmp_path, heading):
    assert read(tmp_path, columns(heading, 1, 2)).sizes["motion"] == 2


def test_a_row_of_units_and_commas_at_the_ends(tmp_path):
    for row in ("s,gal,m/s2,gal", "[s],[gal],(m/s2),[gal]", "(sec),gal,m/s/s,cm/s2"):
        motion = read(tmp_path, columns(f"time,NS,EW,UD\n{row}", 1, 1, 1))
        np.testing.assert_allclose(motion.values[:, 0], [0.001, -0.02, 0.0001], atol=1e-12)
    rows = "".join(f"{one},{2 * one},{3 * one},\n" for one in SAMPLES)
    motion = read(tmp_path, f"UNIT  = gal(cm/s/s),\nSAMPLING RATE= 100Hz,\nNS,EW,UD,\n{rows}")
    np.testing.assert_allclose(motion.values, np.outer([0.01, 0.02, 0.03], SAMPLES), rtol=1e-15)


@pytest.mark.parametrize(("step", "decimals"), [(1.0 / 128.0, 3), (0.005, 2), (1.0 / 64.0, 2)])
def test_times_that_are_rounded(tmp_path, step, decimals):
    rows = "".join(f"{step * i:.{decimals}f},{0.1 * (i % 7)}\n" for i in range(500))
    with pytest.raises(RecordError, match=rf"rounded to {decimals} decimals: leave .* 'dt = {step:.6g}' above"):
        read(tmp_path, f"time,a (g)\n{rows}")
    gap = "".join(f"{0.01 * (i + (i > 250)):.2f},0.1\n" for i in range(500))
    with pytest.raises(RecordError, match="must be uniform"):
        read(tmp_path, f"time,a (g)\n{gap}")
    once = [f"{0.01 * i:.2f},{0.1 * (i % 7)}\n" for i in range(500)]
    for rows, row in (([row for row in once for _ in "ab"], 2), ([*once, *once], 501), ([*once[:9], *once[8:]], 10)):
        with pytest.raises(RecordError, match=f"row {row} has the time .*: give one record, with each row once"):
            read(tmp_path, f"time,a (g)\n{''.join(rows)}")


@pytest.mark.parametrize("mark", ["-999", "999.99", "-99999", "9999.0", "99.99"])
def test_marks_of_gaps(tmp_path, mark):
    """Two of them, alone or at the end of an AT2 file, or one that stands far from all others: see refusals.csv."""
    assert read(tmp_path, f"time,a (gal)\n{ROWS}0.12,{mark}\n0.13,{0.4 * float(mark)}\n").sizes["time"] == 14


def test_acceleration_alone_of_a_table_with_velocity_and_displacement(tmp_path):
    rows = "".join(f"{0.01 * i:.2f},{one},1.0,2.0\n" for i, one in enumerate(SAMPLES))
    motion = read(tmp_path, f"Time [s],Acceleration [g],Velocity [m/s],Displacement [m]\n{rows}")
    np.testing.assert_allclose(motion.values, [np.array(SAMPLES) * G], rtol=1e-15)


def test_directions_without_a_column_of_times(tmp_path):
    rows = "".join(f"{one},{2 * one},{3 * one}\n" for one in SAMPLES)
    head = "SITE CODE= 99999,,\nSAMPLING RATE= 100Hz,,\nUNIT  = gal(cm/s/s),,\nNS,EW,UD\n"
    motion = read(tmp_path, head + rows)
    np.testing.assert_allclose(motion.values, np.outer([0.01, 0.02, 0.03], SAMPLES), rtol=1e-15)
    assert motion["component"].values.tolist() == ["NS", "EW", "UD"]


def test_columns_that_another_line_names(tmp_path):
    rows = "".join(f" {0.01 * i:.2f} {one} {2 * one} {3 * one}\n" for i, one in enumerate(SAMPLES))
    head = "#AmplitudeUnit:  gal.\n#DataSequence: Time U(+); N(+); E(+)\n#Data: 4F10.3\n"
    motion = read(tmp_path, head + rows)
    np.testing.assert_allclose(motion.values, np.outer([0.01, 0.02, 0.03], SAMPLES), rtol=1e-15)


@pytest.mark.parametrize(
    "text",
    [
        at2(f"PEER\nACCELERATION TIME SERIES (m/s²)\n{NPTS}"),
        at2(f"PEER\nAcceleration m/s²\n{NPTS}"),
        f"# Beschleunigung in m/s²\ntime,acc\n{ROWS}",
        f"time (s),acc_m/s²\n{ROWS}",
        f"time (s),Beschleunigung (m/s²)\n# Ort: Zürich\n{ROWS}",
    ],
)
@pytest.mark.parametrize("encoding", ["latin-1", "utf-8"])
def test_units_of_latin_1(tmp_path, text, encoding):
    """A unit that was taken as none, so that an AT2 file was in g, or as a velocity."""
    motion = read(tmp_path, text.encode(encoding))
    np.testing.assert_allclose(motion.values[0], SAMPLES, rtol=1e-15)


@pytest.mark.parametrize(
    ("heading", "first", "motions"),
    [
        ("time (s),NS (m/s2),EW (m/s2)\n# event of 1999", "time", 2),
        ("time (ms),a (m/s2)\n# one\n# two", "milliseconds", 1),
        ("NS (m/s2),EW (m/s2)\n# dt = 0.01", "", 2),
        ("# dt = 0.01\nNS (m/s2),UD (m/s2)", "", 2),
    ],
)
def test_comments_below_a_heading(tmp_path, heading, first, motions):
    times = {"time": 0.01, "milliseconds": 10.0}.get(first)
    rows = [
        ",".join(map(repr, [*([] if times is None else [i * times]), *(a**n for n in range(1, motions + 1))]))
        for i, a in enumerate(SAMPLES)
    ]
    found = read(tmp_path, "\n".join([heading, *rows, ""]))
    np.testing.assert_allclose(found.values, [[a**n for a in SAMPLES] for n in range(1, motions + 1)], rtol=1e-15)
    assert float(found["dt"][0]) == pytest.approx(0.01, rel=1e-9)
    assert all(str(name).startswith("record NS") for name in found["motion"].values[:1]) == (motions > 1)


CLOCK = "seconds_elapsed,z,y,x"


@pytest.mark.parametrize(
    ("heading", "start", "unit", "given"),
    [
        (f"time,{CLOCK}", 1700000000_000000000, 1e-9, {"unit": "m/s2"}),
        ("timestamp,x,y,z", 1700000000_000, 1e-3, {"unit": "m/s2"}),
        ("time (ns),ax (m/s^2),ay (m/s^2),az (m/s^2)", 1700000000_000000000, 1e-9, {}),
        ("Timestamp [us],AccX [m/s2],AccY [m/s2],AccZ [m/s2]", 0, 1e-6, {}),
        ("epoc (ms),elapsed (s),x-axis (m/s2),y-axis (m/s2),z-axis (m/s2)", 1700000000_000, 1e-3, {}),
        ("Zaman (sn);K-G (m/s2);D-B (m/s2);Düşey (m/s2)", 0, 1.0, {}),
        ('"Time (s)","Linear Acceleration x (m/s^2)","Linear Acceleration y (m/s^2)"', 0, 1.0, {}),
    ],
)
def test_clocks_of_phones(tmp_path, heading, start, unit, given):
    """Times in µs or ns, since 1970, and those since the first sample beside them."""
    mark = ";" if ";" in heading else ","
    many = len(heading.split(mark)) - 1
    rows = ""
    for i, a in enumerate(SAMPLES):
        time = f"{0.01 * i:.2f}" if unit == 1.0 else str(start + round(0.01 * i / unit))
        elapsed = [f"{0.01 * i:.2f}"] * ("elapsed" in heading)
        rows += mark.join([time, *elapsed, *(str(a**n) for n in range(1, many + 1 - len(elapsed)))]) + "\n"
    motion = read(tmp_path, f"{heading}\n{rows}", **given)
    assert float(motion["dt"][0]) == pytest.approx(0.01, rel=3e-6)  # (256 ns of a double number)
    np.testing.assert_allclose(motion.values[0], SAMPLES, rtol=1e-13)


@pytest.mark.parametrize("names", ["RX,RY", "rot_x,rot_y", "roll,pitch", "theta_x,Tilt"])
def test_rotations_are_no_accelerations(tmp_path, names):
    heading = ",".join(f"{name} (g)" for name in names.split(","))
    with pytest.raises(RecordError, match=r"its heading names .*, not acceleration"):
        read(tmp_path, columns(f"time (s),{heading}", 1, 2))
    with pytest.warns(ImplausibleInput, match="left out: no acceleration, by its name"):
        assert read(tmp_path, columns(f"time (s),X (g),{heading}", 1, 2, 3)).sizes["motion"] == 1


@pytest.mark.parametrize(("factor", "doubted"), [(4.0, False), (9.80665, True), (14.0, True)])
def test_an_at2_file_without_a_unit_above_1_g_is_doubted(tmp_path, factor, doubted):
    samples = " ".join(str(factor * one) for one in SAMPLES)
    with warnings.catch_warnings(record=True, action="always") as told:
        read(tmp_path, f"PEER\nSomewhere\nACCELERATION\n{NPTS}\n{samples}\n")
    sentence = f"states no unit, is taken as g, and reaches {0.2 * factor:.2g}: m/s² or per cent of g?"
    assert [sentence in str(one.message) for one in told] == [True] * doubted


def test_a_pulse_before_zeros_is_one(tmp_path):
    assert read(tmp_path, "0.0\n100.0\n" + "0.0\n" * 30, dt=0.1, unit="gal").sizes["time"] == 32


@pytest.mark.parametrize(
    ("heading", "left"),
    [
        *(
            (f"# acceleration in g\ntime,{names}", left)
            for names, left in (("acc,jerk", "jerk"), ("NS,count", "count"))
        ),
        ("# units: g\nt,a,v", "v"),
        ("# units: g\nt,ax,temperature", "temperature"),
        ("# units: g\nt,accelX,magZ", "magZ"),
        ("time,acc (g),Difference (g)", "Difference .g."),
        ("time,acc (g),sigma (g)", "sigma .g."),
        ("time,acc (g),envelope (g)", "envelope .g."),
        ("time,acc (g),|acc| (g)", r"\|acc\| .g."),
        ("time,acc (g),arias (m/s)", "arias .m/s."),
    ],
)
def test_columns_of_no_acceleration_are_left_out(tmp_path, heading, left):
    with pytest.warns(ImplausibleInput, match=f"{left} is left out: no acceleration, by its name"):
        motion = read(tmp_path, columns(heading, 1, 2))
    np.testing.assert_allclose(motion.values, [np.array(SAMPLES) * G], rtol=1e-15)


def test_columns_of_no_known_name_are_all_read(tmp_path):
    assert read(tmp_path, columns("time,roof,table", 1, 2), unit="g").sizes["motion"] == 2


def test_line_ends_that_a_transfer_doubled(tmp_path):
    text = at2(f"{PARTS['<title>']}\nACCELERATION IN G\n{NPTS}").replace("\n", "\r\r\n")
    motion = read(tmp_path, text, "record.AT2")
    np.testing.assert_allclose(motion.values[0], np.array(SAMPLES) * G, rtol=1e-15)
    assert motion.attrs["title"].split(", ") == ["Somewhere", "1/2/1999", "Station", "090"]


@pytest.mark.parametrize(
    ("factor", "units"),
    [
        (G, "g G (g)"),
        (0.01, "Gal. cm/s² cm/sec/sec cm/sec2"),
        (1.0, "m.s-2 m/s**2"),
        (0.001, "mm/s2"),
        (None, "cm*s-2 cm/s counts ms"),
    ],
)
def test_spellings_of_units(factor, units):
    assert {unit_factor(unit) for unit in units.split()} == {factor}
    assert unit_factor("m s^-2") == 1.0


LONG = np.sin(np.arange(40)) / 8.0
"""Accelerations of which the last, 0.12047…, is positive and not 0."""
FIXED = "time (s),acceleration (g)\n" + "\n".join(f"{0.01 * i:.2f},{one:.4f}" for i, one in enumerate(LONG))
ALIGNED = "dt = 0.01, acceleration (gal)\n" + "\n".join(f"{round(1000.0 * one):8d}" for one in LONG)
VARIED = "dt = 0.01, acceleration (g)\n" + "\n".join(map(repr, LONG.tolist()))
THREE = "time (s),NS (gal),EW (gal)\n" + "\n".join(f"{0.01 * i:.2f},{one:.3f},{-one:.5f}" for i, one in enumerate(LONG))
FIVE = "NPTS= 40, DT= .0100 SEC\n" + "\n".join(
    "".join(f"{one:15.7E}" for one in LONG[i : i + 5]) for i in range(0, 40, 5)
)


@pytest.mark.parametrize(
    ("text", "lost"),
    [
        (FIXED, 1),
        (FIXED, 3),
        (ALIGNED, 1),
        (ALIGNED, 2),
        (THREE, 1),
        (THREE, 4),
        (f"PEER\nACCELERATION (G)\n{FIVE}", 1),
    ],
)
def test_cut_within_the_last_number(tmp_path, text, lost):
    """The last number has fewer digits than all others, or ends where none of them does, and no line end follows it."""
    assert read(tmp_path, text).sizes["time"] == 40
    line = text.count("\n") + 1
    with pytest.raises(RecordError, match=rf"record.csv: line {line} ends in .* without a line end, .* truncated"):
        read(tmp_path, text[:-lost])
    assert read(tmp_path, f"{text[:-lost]}\n").sizes["time"] == 40  # (with a line end it was written so)


def test_a_last_number_that_may_be_cut(tmp_path):
    """Where digits vary a short number may be right, and is noted."""
    assert read(tmp_path, VARIED).sizes["time"] == 40
    with pytest.warns(ImplausibleInput, match=r"line 41 ends in '0.1' without a line end"):
        read(tmp_path, VARIED[: VARIED.rindex("\n") + 4])


@pytest.mark.parametrize(
    "text",
    [
        f"{FIXED}\x1a",
        f"{FIXED} ",
        FIXED.rpartition("\n")[0],
        FIXED.replace("0.39,", "10.39,")[: FIXED.index("0.39,") - 1],
    ],
)
def test_right_files_without_a_line_end(tmp_path, text):
    with warnings.catch_warnings(action="error"):
        read(tmp_path, text)


def test_whole_numbers_of_a_unit_are_doubted(tmp_path):
    counts = "".join(f"{round(1e4 * one)}\n" for one in SAMPLES)
    with pytest.warns(ImplausibleInput, match="whole numbers, as counts are, are taken as 'gal'"):
        read(tmp_path, counts, dt=0.01, unit="gal")
    with warnings.catch_warnings(action="error"):
        read(tmp_path, counts, dt=0.01, unit=0.01)
        read(tmp_path, counts.replace("1000\n", "1000.5\n"), dt=0.01, unit="gal")


def test_names_and_units_of_columns_in_lines_of_cells(tmp_path):
    """A sheet of an agency: a line of components and a line of units above a heading that names the times alone."""
    rows = "".join(f"{0.01 * i:.2f},{one},{one * one},{one**3}\n" for i, one in enumerate(SAMPLES))
    motion = read(tmp_path, f"Station,A,A,A\nComponent,NS,EW,UD\nUnit,gal,gal,gal\nTime (s),,,\n{rows}")
    assert motion["component"].values.tolist() == ["NS", "EW", "UD"]
    np.testing.assert_allclose(motion.values[0], np.array(SAMPLES) * 0.01, rtol=1e-15)
    with pytest.raises(RecordError, match="has 4 columns"):
        read(tmp_path, f"Unit,gal,gal,gal\nTime (s),,,\n{rows}")


def test_whole_milliseconds_and_numbers_are_no_decimal_commas(tmp_path):
    rows = "".join(f"{5 * i},{round(1e5 * one)}\n" for i, one in enumerate(SAMPLES))
    motion = read(tmp_path, f"time (ms),acc (mm/s2)\n{rows}")
    np.testing.assert_allclose(motion.values[0], np.array(SAMPLES) * 100.0, rtol=1e-12)


def test_refused(refusal):
    refusal()
