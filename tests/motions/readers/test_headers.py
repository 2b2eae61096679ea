"""What headers of text records say: units, quantities, steps and counts, wherever and however they are written."""

import warnings

import numpy as np
import pytest

from toppling import motions as mo
from toppling.core.doubts import ImplausibleInput
from toppling.core.units import STANDARD_GRAVITY as G
from toppling.motions import RecordError
from toppling.motions.readers.units import unit_factor

SAMPLES = [0.1, -0.2, 0.15, 0.05, -0.1, 0.0, 0.1, 0.2, -0.15, 0.05, 0.01, -0.02]
COLUMN = "".join(f"{one}\n" for one in SAMPLES)
ROWS = "".join(f"{0.01 * i:.2f},{one}\n" for i, one in enumerate(SAMPLES))


def scaled_times(factor):
    return "".join(f"{factor * 0.01 * i:.2f},{one}\n" for i, one in enumerate(SAMPLES))


def at2(header):
    return f"{header}\n{' '.join(map(str, SAMPLES))}\n"


def read(tmp_path, text, name="record.csv", **options):
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return mo.read(path, **options)


NPTS = "NPTS= 12, DT= .0100 SEC"
TITLE = "PEER RECORD\nSomewhere, 1/2/1999, Station, 090"


@pytest.mark.parametrize(
    ("unit", "factor"), [("Unidad: m/s^2", 1.0), ("ускорение, м/с2", 1.0), ("единицы: см/с2", 0.01)]
)
def test_units_in_other_languages(tmp_path, unit, factor):
    motion = read(tmp_path, f"# {unit}\n# dt = 0.01\n{COLUMN}")
    np.testing.assert_allclose(motion.values[0], np.array(SAMPLES) * factor, rtol=1e-15)


@pytest.mark.parametrize(
    ("heading", "factor"),
    [
        ("# dt = 0.01\n# units: m s-2", 1.0),
        ("# dt = 0.01\n# units: cm s^-2", 0.01),
        ("# dt = 0.01\n# acceleration in m/s ²", 1.0),
        ("# dt = 0.01\nacceleration in units of cm/s2", 0.01),
        ("# dt = 0.01\nacceleration (g's)", G),
        ("time (s),a_g (m/s2)", 1.0),
        ("time (s),ground acceleration u_g [gal]", 0.01),
        ("время (с),ускорение (см/с2)", 0.01),
        (f"{TITLE}\nACCELERATION TIME HISTORY IN UNITS OF M S-2\n{NPTS}", 1.0),
        (f"{TITLE}\nACCELERATION TIME HISTORY IN UNITS OF CM/S ^2\n{NPTS}", 0.01),
    ],
)
def test_units_of_several_words_and_the_letter_of_the_ground(tmp_path, heading, factor):
    timed = heading.startswith(("time", "время"))
    motion = read(tmp_path, f"{heading}\n{ROWS if timed else COLUMN}")
    np.testing.assert_allclose(motion.values[0], np.array(SAMPLES) * factor, rtol=1e-15)


@pytest.mark.parametrize("unit", ["µg", "μm/s2"])
def test_units_that_begin_with_a_greek_letter_are_unknown(tmp_path, unit):
    with pytest.raises(RecordError, match="unknown unit"):
        read(tmp_path, f"# units: {unit}\n{COLUMN}", dt=0.01, unit="g")


def test_columns_above_the_ground_are_doubted(tmp_path):
    with pytest.warns(ImplausibleInput, match="acc_block .g.: of a structure or block, not of its ground motion?"):
        read(tmp_path, columns("time (s),acc_block (g),acc_table (g)", 1, 2))
    with pytest.warns(ImplausibleInput, match="drift is left out: no acceleration, by its name"):
        motion = read(tmp_path, columns("# units: g\ntime (s),ground,drift", 1, 1))
    assert motion.sizes["motion"] == 1


@pytest.mark.parametrize(
    ("header", "factor"),
    [
        (f"{TITLE}\nACCELERATION TIME SERIES (M/S/S)\n{NPTS}", 1.0),
        (f"{TITLE}\nACCELERATION TIME SERIES IN M/S2\n{NPTS}", 1.0),
        (f"PEER\nACCELERATION TIME SERIES IN UNITS OF M/S/S\n{NPTS}", 1.0),
        (f"PEER\nACCELERATION IN UNITS OF CM/SEC**2\nSomewhere\n{NPTS}", 0.01),
        (f"PEER\nSomewhere\nACCELERATION\n{NPTS}, UNITS: GAL", 0.01),
        (f"{TITLE}\nACCELERATION TIME SERIES, GAL\n{NPTS}", 0.01),
        (f"PEER\nSomewhere\nACCELERATION [mm/s^2]\n{NPTS}", 0.001),
        (f"PEER\nThe units are (g)\n*** Begin data ***\n{NPTS}", G),
        (f"PEER\nUNIT 5, UNITED STATES\nACCELERATION\n{NPTS}", G),
        *(
            (f"{TITLE}\n{line}\n{NPTS}", factor)
            for line, factor in (
                ("Acceleration m/s2", 1.0),
                ("ACCELERATION TIME SERIES m/s^2", 1.0),
                ("m/s^2", 1.0),
                ("ACCELERATION TIME HISTORY CM/SEC/SEC", 0.01),
                ("Accel. m s-2", 1.0),
                ("Beschleunigung mm/s²", 0.001),
                ("Acceleration GAL (corrected)", 0.01),
                ("Acceleration g", G),
                ("ACCELERATION, VS30 760 m/s", G),
            )
        ),
        (f"\n{TITLE}\nACCELERATION IN UNITS OF G\nFILTER POINTS: HP=0.1 Hz LP=30.0 Hz\n{NPTS}", G),
        ("H1 for rotation: STATION, 000\nrotation angle -37.0\nAcceleration in g\n12 0.0100 NPTS, DT", G),
    ],
)
def test_the_unit_of_an_at2_file_stands_anywhere(tmp_path, header, factor):
    motion = read(tmp_path, at2(header), "record.AT2")
    np.testing.assert_allclose(motion.values[0], np.array(SAMPLES) * factor, rtol=1e-15)
    assert float(motion["dt"][0]) == 0.01


def test_an_at2_file_without_a_unit_is_noted(tmp_path):
    motion = read(tmp_path, at2(f"{TITLE}\nACCELERATION TIME SERIES\n{NPTS}"), "record.AT2")
    np.testing.assert_allclose(motion.values[0], np.array(SAMPLES) * G, rtol=1e-15)
    assert "no unit" in motion.attrs["processing"]


@pytest.mark.parametrize(
    ("header", "message"),
    [
        (f"PEER\nVELOCITY TIME SERIES IN UNITS OF CM/S\n{NPTS}", "a velocity record, not acceleration"),
        (f"PEER\nSomewhere\nSomething else\nDISPLACEMENT TIME SERIES\n{NPTS}", "a displacement record"),
        (f"PEER\nSomewhere\nUNITS OF CM/S\n{NPTS}", "line 3 gives a velocity"),
        (f"{TITLE}\nGeschwindigkeit (cm/s)\n{NPTS}", "a velocity record, not acceleration"),
        (f"{TITLE}\nSpostamento [cm]\n{NPTS}", "a displacement record, not acceleration"),
        (f"{TITLE}\nHIZ (cm/s)\n{NPTS}", "line 3 gives a velocity"),
        (f"{TITLE}\nACCELERATION TIME SERIES cm/s\n{NPTS}", "line 3 gives a velocity"),
        (f"PEER\nACCELERATION IN UNITS OF G\nUNITS: GAL\n{NPTS}", "line 2 says 'G', line 3 'GAL'"),
        (f"{TITLE}\nACCELERATION IN UNITS OF COUNTS\n{NPTS}", "line 3 has the unknown unit 'COUNTS'"),
        *(
            (f"{TITLE}\nACCELERATION {unit}\n{NPTS}", "line 3 has the unknown unit")
            for unit in (
                *("IN UNITS OF %G", "IN UNITS OF %g", "IN UNITS OF 1/100 G", "IN UNITS OF 0.001 G", "IN G (x100)"),
                *(
                    "IN % OF G",
                    "IN PER CENT OF G",
                    "(%G)",
                    "UNITS: 10^-3 G",
                    "UNITS: G*100",
                    "(G) x 10",
                    "IN 1E-3 M/S2",
                    ", IN/S2",
                    "TIME SERIES %G",
                    "TIME SERIES ft/s2",
                    "TIME SERIES 0.01 m/s2",
                    "MG",
                    "COUNTS",
                ),
            )
        ),
        (f"{TITLE}\nACCELERATION IN UNITS OF G\nNPTS= 12, DT= 10 SEC", "between 0 and 1 s, got 10"),
        (f"{TITLE}\nACCELERATION IN UNITS OF G\nNPTS= 12, DT= 0.01*2", "time step as '0.01[*]2'"),
    ],
)
def test_an_at2_file_that_contradicts_itself(tmp_path, header, message):
    with pytest.raises(RecordError, match=message):
        read(tmp_path, at2(header), "record.AT2")


@pytest.mark.parametrize(
    "step",
    ["1.0D-02 SEC", "1/100", "10 ms", "10 msec,", ".01sec", "0.01 s, UNITS OF G"],
)
def test_steps_are_read_whole(tmp_path, step):
    motion = read(tmp_path, at2(f"{TITLE}\nACCELERATION IN UNITS OF G\nNPTS= 12, DT= {step}"), "record.AT2")
    assert float(motion["dt"][0]) == pytest.approx(0.01, rel=1e-12)
    motion = read(tmp_path, f"acceleration (g)\ndt = {step}\n{COLUMN}")
    assert float(motion["dt"][0]) == pytest.approx(0.01, rel=1e-12)


@pytest.mark.parametrize(
    ("heading", "step"),
    [
        ("SAMPLING RATE= 100Hz,,\nUNIT  = gal(cm/s/s)", 0.01),
        ("Sampling interval (sec) : 0.005\nunits: gal", 0.005),
        ("sampling interval (ms): 5\nunits: gal", 0.005),
        ("#SampleRate(Hz): 200\n#AmplitudeUnit:  gal. DCoffset(corr)", 0.005),
        ("time step = 2e-2 s; acceleration units in gal", 0.02),
        ("dt = 0.01, sampling rate: 100 Hz\nunits: gal", 0.01),
        ("# original recording, filtered\n# dt = 0.01\n# sampling time: 12 h\nunits: gal", 0.01),
        ("# sampling rate before decimation = 200 Hz\n# sampling rate: 100 Hz\nunits: gal", 0.01),
    ],
)
def test_steps_and_rates_in_words(tmp_path, heading, step):
    motion = read(tmp_path, f"{heading}\n{COLUMN}")
    assert float(motion["dt"][0]) == pytest.approx(step, rel=1e-12)
    np.testing.assert_allclose(motion.values[0], np.array(SAMPLES) * 0.01, rtol=1e-15)


@pytest.mark.parametrize(
    "heading",
    [
        "# Tasa de muestreo: 100 muestras/s",
        "# Frecuencia de muestreo (Hz): 100",
        "# Intervalo de muestreo: 0.01 s",
        "# Frequenza di campionamento: 100 Hz",
        "# Passo di campionamento: 0.01 s",
        "# Fréquence d'échantillonnage = 100 Hz",
        "# Pas de temps : 0.01",
        "# Taxa de amostragem: 100 amostras por segundo",
        "# Abtastrate: 100 Hz",
        "# Abtastintervall (ms): 10",
        "# Zeitschritt = 0.01 s",
        "# Örnekleme frekansı: 100 Hz",
        "# ornekleme araligi: 0.01",
        "# サンプリング周波数：100 Hz",
        "# 採樣率: 100",
        "# частота дискретизации: 100 Hz",
        "# sampling rate: 100 samples/s",
        "# sampling rate: 100 samples per second",
        " INTERVALO DE MUESTREO, C1-C6 (s)    : /.01/.01/.01",
    ],
)
def test_steps_of_other_languages(tmp_path, heading):
    """A step of 0.01 s is read, and one that the study contradicts is refused, as in English."""
    assert float(read(tmp_path, f"{heading}\nacc (g)\n{COLUMN}")["dt"][0]) == pytest.approx(0.01, rel=1e-12)
    with pytest.raises(RecordError, match=r"its header says dt = 0.01 s, so dt must not be 0.005"):
        read(tmp_path, f"{heading}\nacc (g)\n{COLUMN}", dt=0.005)


@pytest.mark.parametrize(
    "heading",
    [
        *("SAMPLING FREQUENCY (HZ) 200", "# Sampling rate 200 Hz", "# sampled at 200 Hz", "fs = 200", "# fs 200 Hz"),
        *(
            "# Time increment: 0.005 s",
            "12 points equally spaced at 0.005 sec",
            "# 12 points at equal intervals of .005 s",
        ),
        *("# DT 0.005", "# dt(s) 0.005", "12 0.005 g", "# Frecuencia de muestreo 200 Hz", "# sampling interval 5 ms"),
        *(
            "# 200 sps",
            "# 200 samples per second",
            "# digitized at 200 Hz",
            "# Abtastrate 200 Hz",
        ),
        *("# fs = 0.2 kHz", "# Sampling: 1/200 s", "# sample period 5000 us", "# interval 0,005 s", "# Rate (Hz): 200"),
        *("# 200 values per second", "# step 0.005", "# every 5 ms", "# TimeDelta=0.005", "# Sampling: 200"),
        *("# INCREMENT 5.0000E-03", "# 0.005 s intervals", "# Frame rate: 200 fps", "# T0 0.0 DT 5.0E-3"),
        *("# Samples per second: 200", "# Δt = 0.005 s", "# SR=200", "# recording rate 200 Hz", "# intervallo: 5 ms"),
        *("# sampling rate 200", "# Fréquence d'échantillonnage 200 Hz", "# Zeitschritt 0.005 s", "# 200 Hz sampling"),
    ],
)
def test_steps_in_words_are_not_contradicted(tmp_path, heading):
    text = f"{heading}\nacc (g)\n{COLUMN}"
    assert float(read(tmp_path, text, dt=0.005)["dt"][0]) == 0.005
    with pytest.raises(RecordError, match=r"its header says dt = 0.005 s, so dt must not be 0.01"):
        read(tmp_path, text, dt=0.01)


@pytest.mark.parametrize(
    "heading",
    [
        *("# sampled, low-pass filter 25 Hz", "# bandpass 0.1-25 Hz", "# Samples: 12", "# 11 0.005", "# fs"),
        *(
            "# originally sampled at 200 Hz",
            "# sampled at 200 Hz, resampled",
            "# recorded at 200 Hz, sampled at 100 Hz",
        ),
        *("# sampling period 12 h", "# time interval 10 s to 30 s", "# dt 0.5 h", "# station spacing 0.5 km"),
        *("# sampled at 200 Hz, decimated by 2", "# sampling rate 100 Hz, digitized at 200 Hz", "# fs 0.2 m"),
    ],
)
def test_steps_in_words_of_something_else(tmp_path, heading):
    assert float(read(tmp_path, f"{heading}\nacc (g)\n{COLUMN}", dt=0.01)["dt"][0]) == 0.01


@pytest.mark.parametrize("words", ["Número de muestras", "numero di punti", "Anzahl der Messwerte", "Veri sayısı:"])
def test_numbers_of_samples_of_other_languages(tmp_path, words):
    read(tmp_path, f"# {words} 12\nacc (g)\n{COLUMN}", dt=0.01)
    with pytest.raises(RecordError, match="line 1 declares 13 samples, it holds 12"):
        read(tmp_path, f"# {words} 13\nacc (g)\n{COLUMN}", dt=0.01)


@pytest.mark.parametrize(
    ("heading", "factor"),
    [
        ("# bandpass (0.1-25 Hz)\ntime (s),acceleration (g)", G),
        ("# units of the raw file: gal\ntime (s),acceleration (g)", G),
        ("# Station AAA (basement), PGA (gal): 196\ntime (s),acceleration (g)", G),
        ("# chosen for displacement-based design\ntime (s),acceleration (g)", G),
        ("# scaled to a peak of 0.20 in g\ntime (s),acceleration (m/s2)", 1.0),
        ("# acceleration, velocity and displacement were processed\ntime_s,acc_g", G),
        ("# unit of acceleration is cm/s^2\ntime,a", 0.01),
        ("t [s];a [cm s⁻²]", 0.01),
        ("# units: m/s2 (converted from g)\ntime,a", 1.0),
        ("# unit of acceleration: g = 981 gal\ntime,a", G),
        ("# recorded in 2019 G. Smith, sensor (2 g)\ntime,a (gal)", 0.01),
        ("# max acc (g): 0.0002\n# data in gal\ntime,a", 0.01),
        ("# RAW PGA VALUES (gal) : 0.200\ntime,a", 0.01),  # (the peak of the samples)
        ("time,a (m/s**2)", 1.0),
        ("time,x1 (g)", G),
        ("# original units: g\ntime,a (g)", G),
        ("time,acc m/s2", 1.0),
        ("time,acc g", G),
        ("time;Beschleunigung mm/s²", 0.001),
        ("# acceleration m/s2, velocity m/s\ntime,acc (m/s2)", 1.0),
        ("# Vs30 (m/s): 760, elevation (m)\ntime,acc (m/s2)", 1.0),
        ("# PGA: 0.0204 g\ntime,acc (m/s2)", 1.0),
        ("# sensor: max acceleration 2 g; PGA of the event 1.1 g\ntime,acc (m/s2)", 1.0),
        ("# PGA 0.1 g, of another component\ntime,acc (g)", G),
        ("Elapsed time [s];acc (g)", G),
    ],
)
def test_words_beside_the_unit_of_a_table(tmp_path, heading, factor):
    motion = read(tmp_path, f"{heading}\n{ROWS}")
    np.testing.assert_allclose(motion.values[0], np.array(SAMPLES) * factor, rtol=1e-15)


def test_a_matched_record_of_another_program(tmp_path):
    text = (
        "Matched to: target.tgt\nFile Type: Accelerations (g)\n#Final (Baseline Corrected)\nNPTS = 12 , DT = 0.01 SEC\n"
    )
    motion = read(tmp_path, text + COLUMN, "record.acc")
    np.testing.assert_allclose(motion.values[0], np.array(SAMPLES) * G, rtol=1e-15)


@pytest.mark.parametrize(
    "heading",
    [
        "# original sampling rate: 200 Hz, resampled to 100 Hz",
        "# original dt = 0.005\n# resampled: every 2nd",
        "# dt = 0.02 s (filtered, then decimated by 2)",
        "# dt=0.02 (prototype), model time scale 1:2",
        "# dt = 0.01 before resampling",
        "# dt = 0.005\n# down-sampled by 2",
        "# dt = 0.005 s\n# sampling rate: 100 Hz",
    ],
)
def test_steps_that_may_be_of_before(tmp_path, heading):
    with pytest.raises(RecordError, match="which is the time step of its samples"):
        read(tmp_path, f"{heading}\nacc (g)\n{COLUMN}")
    assert float(read(tmp_path, f"{heading}\nacc (g)\n{COLUMN}", dt=0.01)["dt"][0]) == 0.01
    assert float(read(tmp_path, f"{heading}\ntime (s),acc (g)\n{ROWS}")["dt"][0]) == pytest.approx(0.01)


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


@pytest.mark.parametrize(
    ("heading", "apart"),
    [
        ("time,acc (g),acc (m/s2)", False),
        ("time,a1 (g),a2 (g)", False),
        ("time,measured (g),filtered (g)", True),
        ("time,acc (g),error (g)", True),
        ("time,acc (g),baseline (g)", True),
        ("time,NS raw (g),NS corrected (g)", True),
        ("time,uncorrected acceleration (g),corrected acceleration (g)", True),
        ("time,table command (g),table feedback (g)", True),
        ("time,target (g),achieved (g)", True),
        ("time,sensor 1 (g),reference (g)", True),
    ],
)
def test_one_signal_twice_is_refused(tmp_path, heading, apart):
    text = columns(heading, 1, 2)
    if not apart:
        text = f"{heading}\n" + "".join(f"{0.01 * i:.2f},{one},{9.8 * one:.4f}\n" for i, one in enumerate(SAMPLES))
    with pytest.raises(RecordError, match=r"its columns .* are one signal twice, or no motion"):
        read(tmp_path, text)


@pytest.mark.parametrize("heading", ["time,NS corrected (g),EW corrected (g)", "time,roof (g),table (g)"])
def test_columns_of_two_motions_are_read(tmp_path, heading):
    assert read(tmp_path, columns(heading, 1, 2)).sizes["motion"] == 2


def test_a_row_of_units_and_commas_at_the_ends(tmp_path):
    for row in ("s,gal,m/s2,gal", "[s],[gal],(m/s2),[gal]", "(sec),gal,m/s/s,cm/s2"):
        motion = read(tmp_path, columns(f"time,NS,EW,UD\n{row}", 1, 1, 1))
        np.testing.assert_allclose(motion.values[:, 0], [0.001, -0.02, 0.0001], atol=1e-12)
    with pytest.raises(RecordError, match=r"'g'.*'gal'"):
        read(tmp_path, columns("time,NS (g),EW (g)\ns,gal,gal", 1, 1))
    rows = "".join(f"{one},{2 * one},{3 * one},\n" for one in SAMPLES)
    motion = read(tmp_path, f"UNIT  = gal(cm/s/s),\nSAMPLING RATE= 100Hz,\nNS,EW,UD,\n{rows}")
    np.testing.assert_allclose(motion.values, np.outer([0.01, 0.02, 0.03], SAMPLES), rtol=1e-15)


def test_quoted_numbers(tmp_path):
    rows = "".join(f'"{0.01 * i:.2f}","{one}"\n' for i, one in enumerate(SAMPLES))
    np.testing.assert_allclose(read(tmp_path, f'"time (s)","a (m/s2)"\n{rows}').values, [SAMPLES], rtol=1e-15)


@pytest.mark.parametrize(("step", "decimals"), [(1.0 / 128.0, 3), (0.005, 2), (1.0 / 64.0, 2)])
def test_times_that_are_rounded(tmp_path, step, decimals):
    rows = "".join(f"{step * i:.{decimals}f},0.1\n" for i in range(500))
    with pytest.raises(RecordError, match=rf"rounded to {decimals} decimals: leave .* 'dt = {step:.6g}' above"):
        read(tmp_path, f"time,a (g)\n{rows}")
    gap = "".join(f"{0.01 * (i + (i > 250)):.2f},0.1\n" for i in range(500))
    with pytest.raises(RecordError, match="must be uniform"):
        read(tmp_path, f"time,a (g)\n{gap}")


@pytest.mark.parametrize("mark", ["-999", "999.99", "-99999", "9999.0", "99.99"])
def test_marks_of_gaps(tmp_path, mark):
    with pytest.raises(RecordError, match=r"2 of its values are 9[9.]*, a mark of gaps"):
        read(tmp_path, f"time,a (gal)\n{ROWS}0.12,{mark}\n0.13,{mark}\n")
    with pytest.raises(RecordError, match="a mark of gaps"):
        read(tmp_path, at2(f"{TITLE}\nACCELERATION IN CM/S2\nNPTS= 14, DT= 0.01").rstrip() + f" {mark} {mark}\n")
    with pytest.raises(RecordError, match=r"1 of its values is 9[9.]*, a mark of gaps"):
        read(tmp_path, f"time,a (gal)\n{ROWS}0.12,{mark}\n0.13,1.0\n")
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
    ("text", "message"),
    [
        (f"# recorded in cm/s2, corrected\ntime (s),acceleration (g)\n{ROWS}", "line 2 says 'g', line 1 'cm/s2'"),
        (f"# units: gal before scaling\ntime (s),acceleration (g)\n{ROWS}", "line 2 says 'g', line 1 'gal'"),
        (f"# units: gal\n# acceleration in g\ntime,a\n{ROWS}", "line 1 says 'gal', line 2 'g'"),
        (f"# velocity\ntime (s),a (cm/s)\n{ROWS}", "velocity or displacement"),
        (f"time (s),v (cm/s)\n{ROWS}", "velocity or displacement"),
        *(
            (f"time (s),{name}\n{ROWS}", "line 1 has the unknown unit")
            for name in (
                *("Acc.(g) *100", "acc_g_x100", "a (cm/s^2) x 10", "1000*acc (g)", "acc*1000 (g)", "acc (g) %"),
                *("10^3 acc (g)", "1/100 acc (g)", "a [gal]×10", "100 x acc (g)"),
            )
        ),
        (f"# values in % of g\ntime (s),acc (g)\n{ROWS}", "line 1 has the unknown unit '% of g'"),
        (f"# values in percent of g\ntime (s),acc (g)\n{ROWS}", "line 1 has the unknown unit"),
        (f"# original units: gal; converted to m/s2\ntime,a\n{ROWS}", "line 1 says 'm/s2', line 1 'gal'"),
        (f"# units: gal -> m/s2\ntime,a\n{ROWS}", "line 1 says 'gal', line 1 'm/s2'"),
        (f"# units: gal, changed into g\ntime,a\n{ROWS}", "line 1 says 'gal', line 1 'g'"),
        (f"# original units: gal\ntime,a\n{ROWS}", "line 1 gives a unit of before"),
        (f"# units: gal (before scaling)\ntime,a\n{ROWS}", "line 1 gives a unit of before"),
        (f"# PGA (g): 0.025\ntime,a\n{ROWS}", "states no unit"),
        (f"# peak [m/s2] = 3.1\ntime,a\n{ROWS}", "states no unit"),
        (f"# units: counts\ntime,a\n{ROWS}", "line 1 has the unknown unit 'counts'"),
        (f"period (s),Sa (g)\n{ROWS}", "a spectrum, no motion"),
        (f"Frequency (Hz),PSA (g)\n{ROWS}", "a spectrum, no motion"),
        ("n,a (g)\n" + "".join(f"{i},{one}\n" for i, one in enumerate(SAMPLES, 1)), "counts 1, 2, 3"),
        ("".join(f"{10 * i},{one}\n" for i, one in enumerate(SAMPLES)), "steps by 10, which is no time in s"),
        (f"time (min),a (g)\n{ROWS}", "times in the unknown unit 'min'"),
        (f"# dt = 0.02 s\ntime (s),a (g)\n{ROWS}", "says dt = 0.02 s, its time column 0.01 s"),
        (f"dt = 0,01 s; acceleration (g)\n{COLUMN}", "time step as '0,01"),
        (f"dt = 10 milliseconds\nacceleration (g)\n{COLUMN}", "time step as '10 milliseconds'"),
        (f"sampling rate: 0.01\nacceleration (g)\n{COLUMN}", "sampling rate as '0.01', must be in Hz"),
        (f"number of data: 13\ndt = 0.01\nacceleration (g)\n{COLUMN}", "declares 13 samples, it holds 12"),
        (f"T (s),Sa (g)\n{ROWS}", "a spectrum, no motion"),
        (f"T [s],Se [m/s²]\n{ROWS}", "a spectrum, no motion"),
        (f"Schwingungsdauer (s),Se (g)\n{ROWS}", "a spectrum, no motion"),
        (f"T (s),RotD50 (g)\n{ROWS}", "a spectrum, no motion"),
        (f"time,jerk (g/s)\n{ROWS}", "names jerk .*, not acceleration"),
        *(
            (f"{line}\n{ROWS}", "line 1: its samples reach .*: another unit")
            for line in (
                "# Station ABC, PGA: 0.200 g\ntime,acc (m/s2)",
                "# PGA (cm/s2) = 0.2\ntime,acc (g)",
                "# peak ground acceleration 0.2 m/s2\ntime,acc (gal)",
            )
        ),
        (at2(f"PEER\nPGA = 0.2 m/s2\nACCELERATION IN G\n{NPTS}"), "line 2: its samples reach"),
        (f"t,PSA (g)\n{ROWS}", "a spectrum, no motion"),
        (f"# response spectrum, 5 % damping\nt,a (g)\n{ROWS}", "a response spectrum, no motion"),
        (at2(f"PEER\nSPECTRAL ACCELERATION IN UNITS OF G\n{NPTS}"), "line 2 says .* a response spectrum"),
        (f"time (s),relative acceleration (g)\n{ROWS}", "line 1 says .*: relative to its support"),
        (f"# acc (rel. to the ground)\ntime,a (g)\n{ROWS}", "relative to its support"),
        (at2(f"PEER\nRELATIVE ACCELERATION IN UNITS OF G\n{NPTS}"), "relative to its support"),
        (f"time\ta (g)\n{ROWS.replace(',', chr(9)).replace('.', ',')}", "line 2 holds .*: write decimals with a point"),
        (f"time   a (g)\n{ROWS.replace(',', '  ').replace('.', ',')}", "write decimals with a point"),
        ('time,a (g)\n"0,00","0,1"\n"0,01","0,2"\n', "write decimals with a point"),
        ('time,a (gal)\n"0","1,100.5"\n"1","1,200.5"\n', "write decimals with a point"),
        (
            "time,a (g)\n00:00:00.00,1\n00:00:00.01,2\n",
            "line 3 holds '00:00:00.01,2', a time of day: write the time in s",
        ),
        ("time,a (g)\n2023-02-06T01:17:35.00Z,1\n2023-02-06T01:17:35.01Z,2\n", "a time of day"),
        (f"time;a (g)\n{ROWS.replace(',', ';').replace('.', ',')}", "write decimals with a point"),
    ],
)
def test_tables_that_are_no_motion_or_contradict_themselves(tmp_path, text, message):
    with pytest.raises(RecordError, match=message):
        read(tmp_path, text)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("# scale: 2.0", "scale: 2.0"),
        ("# gain 0.5, baseline removed", "gain 0.5"),
        ("# amplification factor: 3", "amplification factor: 3"),
        ("# please multiply by 2", "multiply by 2"),
        ("# calibration factor = .25", "calibration factor = .25"),
        ("# SCALE FACTOR 2.5 NOT APPLIED", "SCALE FACTOR 2.5"),
        ("# to be multiplied by 1.5", "to be multiplied by 1.5"),
        ("# scale factor: 1.0", None),
        ("# full scale 4 g, length scale 1:2", None),
        ("# scaled by a factor of 1.4", None),
        ("# gain 4 V/g", None),
        ("Orig PEER filename = A/B.acc, Scale factor = 1.5", None),
    ],
)
@pytest.mark.parametrize("kind", ["csv", "at2"])
def test_factors_that_are_not_applied_are_doubted(tmp_path, line, said, kind):
    text = f"{line}\ntime,a (g)\n{ROWS}" if kind == "csv" else at2(f"{line}\nACCELERATION IN G\n{NPTS}")
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        motion = read(tmp_path, text)
    np.testing.assert_allclose(motion.values[0], np.array(SAMPLES) * G, rtol=1e-15)
    assert [f"says {said!r}, which is" in str(doubt.message) for doubt in told] == [True] * (said is not None)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("# output in V, sensitivity 2.5 V/g", "in V"),
        ("# volts; sensitivity 2.5 V/g", "volts"),
        ("# signal in millivolts", "in millivolts"),
        ("# values multiplied by 10 for storage", "multiplied by 10 for storage"),
        ("# amplified by 10", "amplified by 10"),
        ("# normalised to a PGA of 1", "normalised to a PGA of 1"),
        ("# peak-normalized", "peak-normalized"),
        ("a/PGA", "a/PGA"),
        ("# instrument response not removed", "response not removed"),
        ("normalised acceleration", "normalised acceleration"),
        ("# shape function, to be scaled to 0.25 g", "shape function"),
        ("# supply 12 V; 4 volts/g; gain 4 V/g", None),
        ("# converted from volts", None),
        ("# normalised Arias intensity", None),
    ],
)
def test_amplitudes_and_volts_are_doubted(tmp_path, line, said):
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        motion = read(tmp_path, f"{line}\ndt = 0.01\n{COLUMN}", unit="g")
    np.testing.assert_allclose(motion.values[0], np.array(SAMPLES) * G, rtol=1e-15)
    assert [f"says {said!r}: are its" in str(doubt.message) for doubt in told] == [True] * (said is not None)


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("# time compressed by √10", "time compressed by √10"),
        ("# TIME AXIS SCALED BY 1/3.16; baseline removed", "TIME AXIS SCALED BY 1/3.16"),
        ("# compressed in time by a factor of 3.16", "compressed in time by a factor of 3.16"),
        ("# the time step was divided by 2", "time step was divided by 2"),
        ("# length scale 1:10, time scale 1:3.16", "time scale 1:3.16"),
        ("# Zeit gestaucht um Wurzel 10", "Zeit gestaucht um Wurzel 10"),
        ("# seismic coefficient k = 0.25", "seismic coefficient k = 0.25"),
        ("# not time-compressed; time scale in seconds", None),
    ],
)
@pytest.mark.parametrize("kind", ["csv", "at2"])
def test_times_and_coefficients_are_doubted(tmp_path, line, said, kind):
    text = f"{line}\ntime,a (g)\n{ROWS}" if kind == "csv" else at2(f"{line}\nACCELERATION IN G\n{NPTS}")
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        read(tmp_path, text)
    assert [f"{said!r}: are its" in str(doubt.message) for doubt in told] == [True] * (said is not None)


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


def test_a_spectrum_with_a_comment_below_its_heading_is_refused(tmp_path):
    with pytest.raises(RecordError, match=r"its first column is 'period .s.': a spectrum, no motion"):
        read(tmp_path, f"period (s),Sa (g)\n# damping 5 %\n{ROWS}")


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
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        read(tmp_path, f"PEER\nSomewhere\nACCELERATION\n{NPTS}\n{samples}\n")
    sentence = f"states no unit, is taken as g, and reaches {0.2 * factor:.2g}: m/s² or per cent of g?"
    assert [sentence in str(one.message) for one in told] == [True] * doubted


@pytest.mark.parametrize(("stated", "doubted"), [(0.06, True), (0.12, True), (0.18, False), (0.6, True), (0.0, False)])
def test_a_peak_of_another_scale_is_doubted(tmp_path, stated, doubted):
    """Samples that reach 0.2 g; a fifth of it would be another unit, and is refused."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        read(tmp_path, at2(f"PEER\nPGA = {stated} g\nACCELERATION IN G\n{NPTS}"))
    sentence = f"line 2 says 'PGA = {stated} g', its samples reach"
    assert [sentence in str(one.message) for one in told] == [True] * doubted


def test_a_peak_that_samples_were_scaled_to(tmp_path):
    with pytest.warns(ImplausibleInput, match="says 'PGA = 0.6 g', its samples reach"):
        read(tmp_path, f"# scaled to PGA = 0.6 g\ntime,a (g)\n{ROWS}")


def test_times_in_milliseconds(tmp_path):
    rows = "".join(f"{10 * i},{one}\n" for i, one in enumerate(SAMPLES))
    assert float(read(tmp_path, f"time (ms),a (g)\n{rows}")["dt"][0]) == pytest.approx(0.01, rel=1e-12)


@pytest.mark.parametrize(
    "heading",
    [
        *("Zeit ms", "elapsed time in ms", "Time/ms", '"Time, ms"', "Sample time milliseconds"),
        *("时间(毫秒)", "Время (мс)", "time_ms"),
    ],
)
def test_milliseconds_without_brackets_and_of_other_languages(tmp_path, heading):
    motion = read(tmp_path, f'{heading},"acceleration (g)"\n{scaled_times(50.0)}')
    assert float(motion["dt"][0]) == pytest.approx(0.0005, rel=1e-12)


@pytest.mark.parametrize("line", ["# time in ms", "# Time: msec", "% milliseconds"])
def test_milliseconds_in_a_line_above_the_names(tmp_path, line):
    motion = read(tmp_path, f"{line}\n# acceleration in g\n{scaled_times(50.0)}")
    assert float(motion["dt"][0]) == pytest.approx(0.0005, rel=1e-12)


@pytest.mark.parametrize("line", ["# time of day, 9 ms late", "# delay 12 ms", "# time in s", "# processing time 3 ms"])
def test_other_milliseconds_are_of_no_column(tmp_path, line):
    assert float(read(tmp_path, f"{line}\n# acceleration in g\n{ROWS}")["dt"][0]) == pytest.approx(0.01, rel=1e-9)


@pytest.mark.parametrize("heading", ["Elapsed time (min)", "Laufzeit [min]", "時刻(分)", "time / h"])
def test_times_in_another_unit_are_refused(tmp_path, heading):
    with pytest.raises(RecordError, match="times in the unknown unit"):
        read(tmp_path, f"{heading},acceleration (g)\n{scaled_times(50.0)}")


@pytest.mark.parametrize(
    ("above", "options"),
    [
        ("12", {"dt": 0.005}),
        *((above, {}) for above in ("12\n0.005", "0.005\n12", "12 0.005", "0.005, 12", "Station A\n12\n0.005")),
    ],
)
def test_the_numbers_above_are_no_samples(tmp_path, above, options):
    motion = read(tmp_path, f"{above}\n{COLUMN}", unit="g", **options)
    np.testing.assert_allclose(motion.values[0], np.array(SAMPLES) * G, rtol=1e-15)
    assert float(motion["dt"][0]) == pytest.approx(0.005, rel=1e-12)
    assert "of samples" in motion.attrs["processing"]


@pytest.mark.parametrize(
    ("above", "message"),
    [
        ("35.123\n139.812", "number 2, 139.812, is far above all that follow, so no sample"),
        ("35.123", "number 1, 35.123, is far above"),
        ("12\n-35.1", "number 2, -35.1, is far above"),
        ("15\n0.005", "number 1, 15, is far above"),
        ("35.123 139.812", "line 2 has 1 columns, the first has 2"),
        ("dt = 0.01\n12\n0.005", "lines 1 and 3 state two steps"),
    ],
)
def test_numbers_above_that_are_no_samples_and_no_step(tmp_path, above, message):
    with pytest.raises(RecordError, match=message):
        read(tmp_path, f"{above}\n{COLUMN}", unit="g", **({} if "dt" in above else {"dt": 0.01}))


@pytest.mark.parametrize("above", ["12 0.01", "0.01 12"])
def test_the_numbers_above_two_columns_are_no_samples(tmp_path, above):
    rows = ROWS.replace(",", " ")
    motion = read(tmp_path, f"{above}\n{rows}", unit="g")
    np.testing.assert_allclose(motion.values[0], np.array(SAMPLES) * G, rtol=1e-15)
    assert "no sample" in motion.attrs["processing"]
    with pytest.raises(RecordError, match=r"its header says dt = 0.02 s, its time column 0.01 s"):
        read(tmp_path, f"{above.replace('0.01', '0.02')}\n{rows}", unit="g")


@pytest.mark.parametrize("name", ["", "index", "No.", "#", "sample"])
def test_a_column_that_counts_before_the_times(tmp_path, name):
    rows = "".join(f"{i},{row}\n" for i, row in enumerate(ROWS.splitlines()))
    motion = read(tmp_path, f"{name},time (s),acceleration (g)\n{rows}")
    np.testing.assert_allclose(motion.values, [np.array(SAMPLES) * G], rtol=1e-15)
    assert float(motion["dt"][0]) == pytest.approx(0.01, rel=1e-12)


DURATIONS = [
    *("# Duration: 40 s", "# total duration = 40 sec.", "# record length (s): 40", "# Dauer: 40 s", "Duración = 40 s"),
    "# duration 40s, bedrock",
]


@pytest.mark.parametrize("line", DURATIONS)
def test_another_duration_is_doubted(tmp_path, line):
    with pytest.warns(ImplausibleInput, match=r"40.*its samples last 0.12 s: another time step, or cut"):
        read(tmp_path, f"{line}\n# acceleration (g)\n{COLUMN}", dt=0.01)


@pytest.mark.parametrize(
    "line",
    [
        *("# Duration: 0.12 s", "# strong motion duration 40 s", "# D5-95 duration: 40 s", "# fault length: 40 km"),
        *("# original duration 40 s", "# duration: 40 % of the event", "# tape length 40 m", "# duration 40-60 s"),
    ],
)
def test_durations_of_something_else(tmp_path, line):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        read(tmp_path, f"{line}\n# acceleration (g)\n{COLUMN}", dt=0.01)


@pytest.mark.parametrize("line", ["# 400 points", "# samples: 400", "# data points = 400, corrected", "# 400 samples"])
def test_other_numbers_of_samples(tmp_path, line):
    with pytest.raises(RecordError, match="line 1 declares 400 samples, it holds 12: truncated or damaged"):
        read(tmp_path, f"{line}\n# acceleration (g)\n{COLUMN}", dt=0.01)


def test_a_pulse_before_zeros_is_one(tmp_path):
    assert read(tmp_path, "0.0\n100.0\n" + "0.0\n" * 30, dt=0.1, unit="gal").sizes["time"] == 32


@pytest.mark.parametrize(
    "heading",
    [
        *("Zeit (s);Geschwindigkeit (cm/s)", "Temps;Vitesse (cm/s)", "tempo (s);Spostamento (cm)", "Tiempo;Velocidad"),
        *(
            "time;v_x",
            "time;ux",
            "t (s);v",
            "時間 (s);速度 (cm/s)",
            "# Vitesse (cm/s)\ntime;x",
            "Zeit (s);Weg (mm)",
            "time;x cm/s",
        ),
    ],
)
def test_velocities_by_other_words(tmp_path, heading):
    with pytest.raises(RecordError, match="not acceleration"):
        read(tmp_path, f"{heading}\n{ROWS.replace(',', ';')}", unit="cm/s2")


@pytest.mark.parametrize(
    ("heading", "left"),
    [
        *(
            (f"# acceleration in g\ntime,{names}", left)
            for names, left in (("acc,jerk", "jerk"), ("NS,count", "count"))
        ),
        ("# units: g\nt,a,v", "v"),
        ("# units: g\nt,ax,temperature", "temperature"),
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


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (b"\x1f\x8b\x08\x00rest", r"compressed \(gzip\).* unpack it"),
        (b"PK\x03\x04rest", "a zip archive or a workbook"),
        ("time,a (g)\n0,1\n0.01,2\n".encode("utf-16"), "UTF-16, not plain text: save it as UTF-8"),
        ("time,a (g)\n0,1\n0.01,2\n".encode("utf-16-le"), "UTF-16, not plain text: save it as UTF-8"),
        (b"UNCORRECTED ACCELEROGRAM DATA\n0000001\n", "of the format CSMIP V1, .* take the corrected file"),
        (b"2 CORRECTED ACCELEROGRAM\n*\n", "of the format SMC, .* take the COSMOS file"),
    ],
)
def test_other_formats_are_named(tmp_path, text, message):
    with pytest.raises(RecordError, match=message):
        read(tmp_path, text)


@pytest.mark.parametrize("text", [at2(f"{TITLE}\nACCELERATION IN G\n{NPTS}"), f"time,a (g)\n{ROWS}"])
@pytest.mark.parametrize("end", ["\x1a", "\r\n\x1a\x1a\x1a", "\x1a\r\n"])
def test_the_end_mark_of_dos(tmp_path, text, end):
    motion = read(tmp_path, text.rstrip("\n") + end)
    np.testing.assert_allclose(motion.values[0], np.array(SAMPLES) * G, rtol=1e-15)


def test_line_ends_that_a_transfer_doubled(tmp_path):
    text = at2(f"{TITLE}\nACCELERATION IN G\n{NPTS}").replace("\n", "\r\r\n")
    motion = read(tmp_path, text, "record.AT2")
    np.testing.assert_allclose(motion.values[0], np.array(SAMPLES) * G, rtol=1e-15)
    assert motion.attrs["title"].split(", ") == ["Somewhere", "1/2/1999", "Station", "090"]


@pytest.mark.parametrize(
    ("unit", "factor"),
    [
        ("g", G),
        ("G", G),
        ("(g)", G),
        ("Gal.", 0.01),
        ("cm/s²", 0.01),
        ("cm/sec/sec", 0.01),
        ("cm/sec2", 0.01),
        ("cm*s-2", None),
        ("m.s-2", 1.0),
        ("m s^-2", 1.0),
        ("m/s**2", 1.0),
        ("mm/s2", 0.001),
        ("cm/s", None),
        ("counts", None),
        ("ms", None),
    ],
)
def test_spellings_of_units(unit, factor):
    assert unit_factor(unit) == factor


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
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        read(tmp_path, text)


CELLS = "Station,ABC,,\n{}\nAcceleration (g)\n" + COLUMN


@pytest.mark.parametrize(
    ("line", "options", "message"),
    [
        ("Sampling interval (s),0.005", {"dt": 0.01}, "its header says dt = 0.005 s, so dt must not be 0.01"),
        ('"Sampling rate (Hz)";"200"', {"dt": 0.01}, "its header says dt = 0.005 s"),
        ("dt\t5 ms", {"dt": 0.01}, "its header says dt = 0.005 s"),
        ("Units,cm/s2", {"dt": 0.01}, "which of them is the unit"),
        ("Sampling rate,200,Hz", {"dt": 0.01}, "its header says dt = 0.005 s"),
        ("Unit,gal,gal,gal", {"dt": 0.01}, "which of them is the unit"),
        ("Number of samples;4000", {"dt": 0.01}, "line 2 declares 4000 samples, it holds 12"),
        ("Quantity,velocity,in cm/s", {"dt": 0.01}, "which of them is the unit|gives a velocity"),
    ],
)
def test_keys_and_values_in_cells_are_not_contradicted(tmp_path, line, options, message):
    """A header whose lines are cells of a sheet says what a header of 'key: value' says."""
    with pytest.raises(RecordError, match=message):
        read(tmp_path, CELLS.format(line), **options)


@pytest.mark.parametrize(
    "line",
    ["Sampling interval (s),0.005,,", '"dt";".005"', "Sampling frequency (Hz)\t200", "Sampling interval;0.005;s"],
)
def test_a_step_in_a_cell_is_read(tmp_path, line):
    motion = read(tmp_path, CELLS.format(line))
    assert float(motion["dt"][0]) == 0.005
    np.testing.assert_allclose(motion.values[0], np.array(SAMPLES) * G, rtol=1e-15)


@pytest.mark.parametrize(
    ("line", "said"), [("Duration (s),40", "40"), ("Duration,40,s", "40 s"), ("Scale factor;2.5", "2.5")]
)
def test_values_in_cells_are_doubted(tmp_path, line, said):
    with pytest.warns(ImplausibleInput, match=rf"line 2 says .*{said}"):
        read(tmp_path, CELLS.format(line), dt=0.01)


def test_whole_numbers_of_a_unit_are_doubted(tmp_path):
    counts = "".join(f"{round(1e4 * one)}\n" for one in SAMPLES)
    with pytest.warns(ImplausibleInput, match="whole numbers, as counts are, are taken as 'gal'"):
        read(tmp_path, counts, dt=0.01, unit="gal")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
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


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time (s),acc (g)\n" + ROWS.replace(",", ";").replace(".", ",").replace(";", ","), "decimals with a point"),
        (COLUMN.replace(".", ",").replace("0,1\n", "0,1234567\n"), "write decimals with a point"),
        ("acc (g),time (s)\n0.1,0.00\n0.2,0.01\n", "first column is not 'time .s.': write the times first"),
        ("Zeit;a (g)\n13.11.2016 11:02:30,000;0,1\n13.11.2016 11:02:30,010;0,2\n", "a time of day"),
    ],
)
def test_what_spreadsheets_write_is_named(tmp_path, text, message):
    with pytest.raises(RecordError, match=message):
        read(tmp_path, text)


@pytest.mark.parametrize(
    ("text", "factor"),
    [
        (f"sep=,\ntime (s),acc (g)\n{ROWS}", G),
        (f"time (s),acc (g)\n{ROWS},\n,,\n", G),
        (f"UNIDADES : cm/seg2\nMUESTREO : 100\ntime (s),acc\n{ROWS}", 0.01),
        (f"# aceleración en cm/seg^2\n# dt = 0.01\n{COLUMN}", 0.01),
    ],
)
def test_right_files_of_spreadsheets_and_agencies(tmp_path, text, factor):
    motion = read(tmp_path, text)
    np.testing.assert_allclose(motion.values[0], np.array(SAMPLES) * factor, rtol=1e-15)
    assert float(motion["dt"][0]) == pytest.approx(0.01, rel=1e-12, abs=0.0)


@pytest.mark.parametrize(
    "line", ["Full scale (g),2", "Trigger level (g);0.01", "Sensor range [g]: 0.2", "PGV (cm/s),3"]
)
def test_units_of_an_instrument_are_not_of_samples(tmp_path, line):
    motion = read(tmp_path, f"{line}\nUnits,m/s2\ndt,0.01\nAcceleration\n{COLUMN}")
    np.testing.assert_allclose(motion.values[0], SAMPLES, rtol=1e-15)


@pytest.mark.parametrize("line", ["# Earthquake of 2011, time 14:46", "Tokyo, T2"])
def test_words_above_that_are_no_names_of_columns(tmp_path, line):
    assert read(tmp_path, f"# acceleration in g\n{line}\n{ROWS}").sizes["time"] == 12


def test_whole_milliseconds_and_numbers_are_no_decimal_commas(tmp_path):
    rows = "".join(f"{5 * i},{round(1e5 * one)}\n" for i, one in enumerate(SAMPLES))
    motion = read(tmp_path, f"time (ms),acc (mm/s2)\n{rows}")
    np.testing.assert_allclose(motion.values[0], np.array(SAMPLES) * 100.0, rtol=1e-12)


def test_units_of_times_and_accelerations_in_one_comment(tmp_path):
    motion = read(tmp_path, f"# Units: time ms, acceleration g\nt,a\n{scaled_times(50.0)}")
    assert float(motion["dt"][0]) == pytest.approx(0.0005, rel=1e-12, abs=0.0)


@pytest.mark.parametrize(("suffix", "kind"), [("VT2", "velocity"), ("dt2", "displacement")])
def test_velocities_by_the_names_of_peer(tmp_path, suffix, kind):
    text = at2(f"{TITLE}\n{NPTS}")
    with pytest.raises(RecordError, match=f"a {kind} record by its name"):
        read(tmp_path, text, f"RSN6.{suffix}")
    read(tmp_path, at2(f"{TITLE}\nACCELERATION IN UNITS OF G\n{NPTS}"), f"RSN6.{suffix}")
