"""All record formats: real files if they are present, and small, damaged and hostile files written here."""

import re
import time
import tracemalloc
import warnings

import numpy as np
import pytest
import record_files as files
from damage import damaged
from record_files import COUNTS, SAMPLES, shaking
from shared_cases import SHARED, needs_shared

from toppling import motions as mo
from toppling.core.doubts import ImplausibleInput
from toppling.core.units import STANDARD_GRAVITY as G
from toppling.motions import RecordError
from toppling.motions.readers.lines import NETCDF

FORMATS = SHARED / "data/records/formats"

# file, components, samples, step (s), peaks that the headers declare (m/s², about the mean for K-NET), their last digit
REAL = [
    ("AOM0011801241951.EW", 1, 10200, 0.01, [0.04078], 1e-5),
    ("AOM0011801241951.NS", 1, 10200, 0.01, [0.04954], 1e-5),
    ("NGNH311106302345.EW2", 1, 12000, 0.01, [0.00708], 1e-5),
    ("HI.ARS1..HNE.D.20190728.160908.C.ACC.ASC", 1, 19128, 0.005, [0.00300022], 1e-8),
    ("Cosmos12TimeSeriesTest.v1", 1, 7000, 0.01, [1.61962], 1e-5),
    ("us1000hyfh_akbmrp_AKBMR--n.1000hyfh.BNZ.--.acc.V2c", 1, 42000, 0.005, [0.06851512], 1e-8),
    ("CE58667.V2", 3, 7500, 0.01, [0.27114, 0.11244, 0.26411], 1e-5),
    ("20180212_211557_WPWS_20.V2A", 3, 5800, 0.02, [0.0416, 0.1940, 0.0273], 1e-4),
]


def saved(tmp_path, text, name="record.dat"):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    return path


BLOCK, CSMIP, GEONET = [[("acceleration", shaking(100))]], [shaking(100)], {"N": shaking(100)}


@pytest.mark.parametrize(
    ("form", "units"),
    [
        (lambda scale: files.knet(np.tile([1, 2, 4, -7], 50), scale), {"2(g)/1000": 2e-3 * G, "3(m/s^2)/1": 3.0}),
        (lambda scale: files.knet(np.tile([1, 2, 4, -7], 50), scale), {"2(cm/s2)/4": 5e-3}),
        (lambda unit: files.esm([1, 2, 4], unit=unit), {"cm/s^2": 0.01, "m/s^2": 1.0, "g": G, "mm/s^2": 0.001}),
        (
            lambda unit: files.cosmos([[("acceleration", [1, 2, 4])]], unit=unit),
            {"g (02)": G, "cm/s^2 (4)": 0.01, "cm/s^2": 0.01, "m/sec2(99)": 1.0},
        ),
        (lambda unit: files.csmip([[1, 2, 4]], unit=unit), {"g": G, "cm/sec/sec": 0.01, "m/s2": 1.0}),
    ],
)
def test_units(tmp_path, form, units):
    for unit, factor in units.items():
        motion = mo.read(saved(tmp_path, form(unit)))
        np.testing.assert_allclose(motion.values[0, :3], np.array([1.0, 2.0, 4.0]) * factor, rtol=1e-14)


@needs_shared
class TestRealFiles:
    @pytest.mark.parametrize(("name", "components", "samples", "dt", "peaks", "digit"), REAL, ids=[r[0] for r in REAL])
    def test_components_step_samples_and_declared_peaks(self, name, components, samples, dt, peaks, digit):
        motion = mo.read(FORMATS / name)
        assert motion.shape == (components, samples)
        assert motion.dt.values.tolist() == [dt] * components
        assert set(motion.source.values) == {name}
        assert motion.attrs["units"] == "m s-2"
        np.testing.assert_allclose(np.abs(motion.values).max(axis=1), peaks, rtol=0, atol=0.5001 * digit)

    @pytest.mark.parametrize(
        ("name", "labels"),
        [
            ("AOM0011801241951.EW", ["AOM001 E-W 2018-01-24 19:51:00"]),
            ("NGNH311106302345.EW2", ["NGNH31 E-W surface 2011-06-30 23:45:00"]),
            ("HI.ARS1..HNE.D.20190728.160908.C.ACC.ASC", ["HI.ARS1 HNE GREECE 2019-07-28 16:09:08"]),
            (
                "20180212_211557_WPWS_20.V2A",
                [f"WPWS {axis} 2018 February 12 21:15:54 UT" for axis in ("S16W", "S74E", "Up")],
            ),
        ],
    )
    def test_labels(self, name, labels):
        assert mo.read(FORMATS / name).motion.values.tolist() == labels

    def test_what_the_headers_say(self):
        esm = mo.read(FORMATS / "HI.ARS1..HNE.D.20190728.160908.C.ACC.ASC")
        assert float(esm.epicentral_distance[0]) == pytest.approx(88100.0)
        assert (float(esm.magnitude[0]), str(esm.magnitude_type[0].item())) == (4.6, "ML")
        assert "vs30" not in esm.coords
        alaska = mo.read(FORMATS / "us1000hyfh_akbmrp_AKBMR--n.1000hyfh.BNZ.--.acc.V2c")
        assert (float(alaska.magnitude[0]), str(alaska.magnitude_type[0].item())) == (7.0, "Mw")
        assert str(alaska.component[0].item()) == "BNZ"

    def test_bad_header(self):
        with pytest.raises(RecordError, match=r"BadHeader.V2: line 46 .* without a number format such as \(8f10.6\)"):
            mo.read(FORMATS / "BadHeader.V2")

    @pytest.mark.parametrize("name", [r[0] for r in REAL])
    def test_cut_anywhere(self, name, tmp_path):
        """A file that is cut at the end of a line is refused or, between whole components, read without the rest."""
        lines = (FORMATS / name).read_text(encoding="utf-8").splitlines(keepends=True)
        whole = mo.read(FORMATS / name)
        for at in np.linspace(1, len(lines) - 1, 23).astype(int):
            path = saved(tmp_path, "".join(lines[:at]))
            try:
                found = mo.read(path)
            except RecordError:
                continue
            assert found.sizes["motion"] < whole.sizes["motion"], at

    @pytest.mark.parametrize("name", ["AOM0011801241951.EW", "AOM0011801241951.NS", "NGNH311106302345.EW2"])
    def test_as_obspy_reads_it(self, name):
        obspy = pytest.importorskip("obspy")
        trace = obspy.read(str(FORMATS / name), format="KNET", apply_calib=True)[0]
        motion = mo.read(FORMATS / name)
        np.testing.assert_allclose(motion.values[0], trace.data - trace.data.mean(), rtol=0, atol=1e-12)
        assert motion.attrs["processing"].startswith(f"mean of {trace.data.mean():.4g} m/s² removed")
        assert float(motion.dt[0]) == trace.stats.delta
        assert motion.sizes["time"] == trace.stats.npts


class TestKnet:
    def test_scale_and_direction(self, tmp_path):
        motion = mo.read(saved(tmp_path, files.knet(COUNTS, "7845(gal)/8223790", direction="6")))
        np.testing.assert_allclose(motion.values[0], (COUNTS + 0.5) * 0.01 * 7845.0 / 8223790.0, rtol=1e-13)
        assert motion.motion.item().split() == ["AOM001", "U-D", "surface", "2018-01-24", "19:51:00"]
        assert float(motion.magnitude[0]) == 6.2

    @pytest.mark.parametrize("stated", ["", "unknown"])
    def test_an_unknown_magnitude(self, tmp_path, stated):
        motion = mo.read(saved(tmp_path, files.knet(COUNTS).replace(" 6.2\n", f" {stated}\n")))
        assert "magnitude" not in motion.coords or np.isnan(motion.magnitude.item())

    @pytest.mark.parametrize("peak", ["", "unknown", "0.062", "0.064", "-0.063"])
    def test_peaks_that_are_unknown_or_rounded(self, tmp_path, peak):
        """The samples reach 0.06308 gal: within 2 % of all of these."""
        assert mo.read(saved(tmp_path, files.knet(COUNTS, peak=peak))).sizes["time"] == COUNTS.size

    def test_both_spellings_in_use(self, tmp_path):
        text = files.knet(COUNTS).replace("Max. Acc. (gal)   ", "Max Acc. (gal)    ").replace("Long.  ", "Lon.   ")
        assert mo.read(saved(tmp_path, text.replace("Lon.   ", "Long.  ", 1))).sizes["time"] == COUNTS.size


class TestEsm:
    def test_everything_it_says(self, tmp_path):
        values = shaking()
        motion = mo.read(saved(tmp_path, files.esm(values)))
        np.testing.assert_allclose(motion.values[0], 0.01 * values, rtol=1e-15)
        assert motion.motion.item().split() == ["HI.ARS1", "HNE", "SOMEWHERE", "2019-07-28", "16:09:08"]
        assert (float(motion.magnitude[0]), str(motion.magnitude_type[0].item())) == (5.1, "Mw")
        assert float(motion.epicentral_distance[0]) == pytest.approx(88100.0)
        assert float(motion.vs30[0]) == 760.0
        assert motion.vs30.attrs["units"] == "m s-1"

    def test_dyna_1_0(self, tmp_path):
        """Its header ends with USER4."""
        values = shaking()
        motion = mo.read(saved(tmp_path, files.esm(values).replace("USER5: \n", "").replace("USER1: a: b", "USER4: ")))
        np.testing.assert_allclose(motion.values[0], 0.01 * values, rtol=1e-15)

    @pytest.mark.parametrize("word", ["ND", "soft", "", "nan"])
    def test_words_in_place_of_numbers(self, tmp_path, word):
        assert "vs30" not in mo.read(saved(tmp_path, files.esm(shaking(), vs30=word))).coords

    def test_another_duration_is_doubted(self, tmp_path):
        text = files.esm(shaking()).replace("USER1:", "DURATION_S: 40.0\nUSER1:")
        with pytest.warns(ImplausibleInput, match=r"says 'DURATION_S: 40.0', its samples last 0.12 s"):
            mo.read(saved(tmp_path, text))


class TestCosmos:
    def test_channels_and_other_quantities(self, tmp_path):
        first, second = shaking(150), shaking(150, seed=1)
        blocks = [("acceleration", first), ("velocity", first), ("displacement", first)]
        motion = mo.read(saved(tmp_path, files.cosmos([blocks, [("acceleration", second)]])))
        np.testing.assert_allclose(motion.values, 0.01 * np.array([first, second]), rtol=1e-13)
        assert motion.component.values.tolist() == ["1: 90 deg", "2: 180 deg"]
        assert motion.event.values[0].startswith("Somewhere Earthquake of")
        assert motion.event.values[0].endswith("2018 17:29 UTC")
        assert motion.magnitude.values.tolist() == [6.7, 6.7]

    @pytest.mark.parametrize(
        ("new", "old"),
        [("(04)Format", "(04),Format"), ("(04) Format", "(04),Format"), ("points, approx", "pts, approx")],
    )
    def test_announcements(self, tmp_path, new, old):
        text = files.cosmos([[("acceleration", [1.0, 2.0, 3.0])]])
        assert old in text
        motion = mo.read(saved(tmp_path, text.replace(old, new)))
        np.testing.assert_allclose(motion.values[0], [0.01, 0.02, 0.03], rtol=1e-14)

    @pytest.mark.parametrize(
        ("form", "printed"), [("(10F9.5)", "%9.5f"), ("(1P10E14.7)", "%14.7E"), ("(10(2X,F9.5))", "  %9.5f")]
    )
    def test_fortran_formats(self, tmp_path, form, printed):
        """Columns run together, have an exponent that a scale factor leaves alone, or blanks of their own."""
        values = [123.45678, 223.45678, -23.45678]
        text = files.cosmos([[("acceleration", values)]], form=form, printed=printed)
        motion = mo.read(saved(tmp_path, text))
        np.testing.assert_allclose(motion.values[0], [1.2345678, 2.2345678, -0.2345678], rtol=1e-14)

    def test_components_of_other_lengths(self, tmp_path):
        path = saved(tmp_path, files.cosmos([[("acceleration", shaking(n))] for n in (20, 30, 20)]))
        refused(path, r"differ in step or length \(20 samples at 0.01 s, 30 samples at 0.01 s\): read_all")
        first, second = mo.read_all(path)
        assert (first.shape, second.shape) == ((2, 20), (1, 30))
        assert first.component.values.tolist() == ["1: 90 deg", "3: 270 deg"]
        assert mo.measures([first, second]).sizes["motion"] == 3


class TestCsmip:
    def test_channels(self, tmp_path):
        first, second = shaking(100), shaking(100, seed=1)
        motion = mo.read(saved(tmp_path, files.csmip([first, second])))
        np.testing.assert_allclose(motion.values, 0.01 * np.array([first, second]), rtol=1e-13)
        event = "Sun Aug 24, 2014 03:20:33.0 PDT"
        assert motion.motion.values.tolist() == [f"CSMIP 58667 chan {i} H{i} {event}" for i in (1, 2)]
        assert (float(motion.magnitude[0]), str(motion.magnitude_type[0].item())) == (4.2, "ML")

    def test_a_magnitude_that_one_channel_alone_states(self, tmp_path):
        text = files.csmip([shaking(100)]) + files.csmip([shaking(100, seed=1)]).replace("ML: 4.2", "")
        np.testing.assert_array_equal(mo.read(saved(tmp_path, text)).magnitude, [4.2, np.nan])

    def test_units_in_place_of_a_number_format(self, tmp_path):
        """As in files of the 1980s: ten characters a value, eight values a line."""
        older = files.csmip(CSMIP).replace(", in cm/sec2. (8f10.6)", "  (UNITS: CM/SEC/SEC)")
        older = older.replace(", in cm/sec.  (8f10.6)", "  (UNITS: CM/SEC)").upper()
        np.testing.assert_allclose(mo.read(saved(tmp_path, older)).values[0], 0.01 * CSMIP[0], rtol=1e-13)
        refused(saved(tmp_path, older.replace("CM/SEC/SEC", "GNATS")), "gives the unit of acceleration as 'GNATS'")

    @needs_shared
    def test_an_older_file(self):
        motion = mo.read(FORMATS / "older_csmip.V2")
        assert motion.shape == (1, 640)
        assert float(np.abs(motion).max()) == pytest.approx(2.67957, abs=5e-6)
        assert motion.motion.item().split() == ["CSMIP", "99999", "chan", "1", "90", "DEG"]
        assert float(motion.magnitude[0]) == 6.5

    def test_another_peak(self, tmp_path):
        line = "Peak acceleration =    {:6.3f}    cm/sec/sec  at   32.570   sec."
        sound = files.csmip(CSMIP).replace("\n\n\n\n", "\n" + line.format(50.0) + "\n\n\n", 1)
        assert mo.read(saved(tmp_path, sound)).sizes["time"] == 100
        refused(
            saved(tmp_path, sound.replace("50.000", "48.9")), "Chan 1: H1: its samples reach 0.4999 m/s², its header"
        )


class TestGeonet:
    def test_components(self, tmp_path):
        first, second = np.round(shaking(100), 1), np.round(shaking(100, seed=1), 1)
        motion = mo.read(saved(tmp_path, files.geonet({"S16W": first, "Up": second})))
        np.testing.assert_allclose(motion.values, 0.001 * np.array([first, second]), rtol=1e-13)
        assert motion.component.values.tolist() == ["S16W", "Up"]
        assert motion.epicentral_distance.values.tolist() == [13000.0, 13000.0]
        assert float(motion.dt[0]) == 0.02


class TestTables:
    def test_named_columns(self, tmp_path):
        text = "# a record\ntime (s),north (g),east (cm/s2),up (m/s2)\n0.00,1,2,3\n0.01,4,5,6\n"
        motion = mo.read(saved(tmp_path, text, "site.csv"))
        np.testing.assert_allclose(motion.values, [[G, 4 * G], [0.02, 0.05], [3.0, 6.0]], rtol=1e-15)
        assert motion.motion.values.tolist() == ["site north (g)", "site east (cm/s2)", "site up (m/s2)"]

    def test_unit_given(self, tmp_path):
        path = saved(tmp_path, "0.00 1\n0.01 2\n")
        assert mo.read(path, unit="g").values[0].tolist() == [G, 2.0 * G]
        assert mo.read(path, unit=0.5).values[0].tolist() == [0.5, 1.0]


class TestObspy:
    def stream(self, tmp_path, kind, **header):
        obspy = pytest.importorskip("obspy")
        np_data = (1000.0 * shaking(500, 1.0)).astype(np.int32)
        traces = [
            obspy.Trace(np_data * (i + 1), {"station": "ABC", "channel": f"HN{c}", "delta": 0.01, **header})
            for i, c in enumerate("ENZ")
        ]
        path = tmp_path / "record.dat"
        obspy.Stream(traces[: 1 if kind.startswith("SAC") or "channel" in header else 3]).write(str(path), format=kind)
        return path, np_data

    @pytest.mark.parametrize("kind", ["MSEED", "SAC", "SACXY", "SLIST", "TSPAIR"])
    def test_formats(self, tmp_path, kind):
        path, data = self.stream(tmp_path, kind)
        with pytest.raises(RecordError, match=f"{kind} states no unit, so unit must be given"):
            mo.read(path)
        motion = mo.read(path, unit=0.001)
        np.testing.assert_allclose(motion.values[0], 0.001 * (data - np.mean(data)), rtol=0, atol=1e-6)
        assert "removed on reading" in motion.attrs["processing"]
        kept = mo.read(path, unit="mm/s2")
        np.testing.assert_allclose(kept.values[0], 0.001 * data, rtol=1e-6)
        assert "processing" not in kept.attrs
        assert motion.sizes["motion"] == (1 if kind.startswith("SAC") else 3)
        assert motion.motion.values[0].startswith("ABC HNE 1970-01-01")
        assert float(motion.dt[0]) == pytest.approx(0.01)

    @pytest.mark.parametrize("kind", ["SLIST", "TSPAIR"])
    def test_a_unit_in_the_header(self, tmp_path, kind):
        path, data = self.stream(tmp_path, kind)
        text = path.read_text(encoding="utf-8").replace("INTEGER, \n", "INTEGER, Counts\n")
        for written, factor in (("M/S**2", 1.0), ("CM/S**2", 0.01), ("G", G)):
            path.write_text(text.replace("Counts", written), encoding="utf-8")
            np.testing.assert_allclose(mo.read(path).values[0], factor * data, rtol=1e-12)
        assert mo.read(path, unit="g").sizes["motion"] == 3
        refused(path, "states its unit .G., so unit must not be 'gal'", unit="gal")
        path.write_text(text.replace("Counts", "M/S"), encoding="utf-8")
        refused(path, "line 1 gives a velocity")
        lines = text.replace("Counts", "M/S**2").split("\n")
        second = [i for i, line in enumerate(lines) if line.startswith("TIMESERIES")][1]
        for written, said in (
            ("M/S", rf"line {second + 1} gives a velocity"),
            ("G", rf"line 1 says .M/S.*line {second + 1} 'G'"),
        ):
            changed = [*lines[:second], lines[second].replace("M/S**2", written), *lines[second + 1 :]]
            path.write_text("\n".join(changed), encoding="utf-8")
            refused(path, said)

    @pytest.mark.parametrize("word", ["MG", "NM/S**2"])
    def test_an_unknown_unit_in_the_header_is_no_other(self, tmp_path, word):
        path, _ = self.stream(tmp_path, "SLIST")
        path.write_text(path.read_text(encoding="utf-8").replace("INTEGER, \n", f"INTEGER, {word}\n"), encoding="utf-8")
        refused(path, f"states an unknown unit ..{re.escape(word)}.., so unit must not be 'g'", unit="g")

    @pytest.mark.parametrize(("channel", "said"), [("HHE", "HHE, by the code a seismometer"), ("HNE", ""), ("CH1", "")])
    def test_channels_of_seismometers_are_doubted(self, tmp_path, channel, said):
        path, _ = self.stream(tmp_path, "MSEED", channel=channel)
        with warnings.catch_warnings(record=True, action="always") as told:
            assert mo.read_all(path, unit=1e-3)
        assert [said in str(one.message) for one in told] == [True] * bool(said)

    def test_whole_numbers_of_a_unit_are_doubted(self, tmp_path):
        """Counts that a caller takes for gal."""
        path, counts = self.stream(tmp_path, "MSEED")
        with pytest.warns(ImplausibleInput, match="HNE, HNN, HNZ: whole numbers, as counts are, are taken as 'gal'"):
            (found,) = mo.read_all(path, unit="gal")
        np.testing.assert_allclose(found.values[0], counts * 0.01, rtol=1e-15)

    @pytest.mark.parametrize("inclination", [0.0, 180.0])
    def test_the_inclination_in_a_sac_header(self, tmp_path, inclination):
        sac = pytest.importorskip("obspy.io.sac").SACTrace(data=shaking(50, 1.0).astype("f4"), delta=0.01)
        for name, along in (("A1", 90.0), ("A2", 90.0), ("A3", inclination)):
            sac.kcmpnm, sac.cmpinc = name, along
            sac.write(str(tmp_path / f"{name}.sac"))
        with pytest.warns(ImplausibleInput, match=r"a vertical component is left out \(A3.sac\)"):
            assert len(mo.read_all(tmp_path / "*.sac", unit="m/s2")) == 2

    def test_channels_of_no_motion_and_uneven_steps_are_refused(self, tmp_path):
        path, _ = self.stream(tmp_path, "MSEED", channel="LDO")
        refused(path, "channel .ABC..LDO is of no motion, by its code", unit="m/s2")
        sac = pytest.importorskip("obspy.io.sac").SACTrace(data=np.arange(50, dtype="f4"), delta=0.01, kcmpnm="HNE")
        sac.leven = False
        sac.write(str(path))
        refused(path, "is not evenly sampled .leven.", unit="m/s2")
        sac.leven, sac.idep = True, "ivolts"
        sac.write(str(path))
        refused(path, "is of volts, not acceleration", unit="m/s2")

    def test_a_scale_factor_in_the_header_is_doubted(self, tmp_path):
        sac = pytest.importorskip("obspy.io.sac").SACTrace(data=np.arange(50, dtype="f4"), delta=0.01, scale=0.001)
        path = tmp_path / "record.sac"
        sac.write(str(path))
        with pytest.warns(ImplausibleInput, match="has the scale factor 0.001, which is not applied"):
            mo.read(path, unit="m/s2")

    def test_counts_in_the_header_beside_a_unit_are_doubted(self, tmp_path):
        path, _ = self.stream(tmp_path, "SLIST")
        path.write_text(path.read_text(encoding="utf-8").replace("INTEGER, \n", "INTEGER, Counts\n"), encoding="utf-8")
        with pytest.warns(ImplausibleInput, match="states counts, which are taken as 'm/s2'"):
            mo.read(path, unit="m/s2")
        with warnings.catch_warnings(action="error"):
            mo.read(path, unit=0.001)

    def test_gse(self, tmp_path):
        path, _ = self.stream(tmp_path, "GSE2")
        refused(path, "a GSE file, which obspy reads unsafely", unit="g")

    def test_gap(self, tmp_path):
        obspy = pytest.importorskip("obspy")
        data = np.arange(50, dtype=np.int32)
        traces = [obspy.Trace(data, {"station": "A", "starttime": obspy.UTCDateTime(t)}) for t in (0, 500)]
        path = tmp_path / "gap.mseed"
        obspy.Stream(traces).write(str(path), format="MSEED")
        refused(path, "is in pieces .a gap.", unit="g")

    def test_more_samples_than_memory_holds(self, tmp_path, monkeypatch):
        """A constant signal is a few bytes, whatever its length: it is refused before it is unfolded."""
        obspy = pytest.importorskip("obspy")
        monkeypatch.setattr("toppling.motions.readers.obspy.MOST_SAMPLES", 100_000)
        path = tmp_path / "long.mseed"
        trace = obspy.Trace(np.zeros(200_000, dtype=np.int32), {"station": "A", "channel": "HNE"})
        obspy.Stream([trace]).write(str(path), format="MSEED", encoding="STEIM2", reclen=4096)
        assert path.stat().st_size < 200_000
        refused(path, "holds 200,000 samples, allowed are 100,000", unit="g")

    def test_more_channels_than_an_instrument_has(self, tmp_path):
        obspy = pytest.importorskip("obspy")
        traces = [obspy.Trace(np.arange(9, dtype=np.int32), {"station": f"{at:05d}"}) for at in range(1001)]
        path = tmp_path / "many.mseed"
        obspy.Stream(traces).write(str(path), format="MSEED", reclen=256)
        refused(path, "holds 1,001 channels", unit="g")
        for at, trace in enumerate(traces):
            trace.stats.station, trace.stats.starttime = "A", obspy.UTCDateTime(10.0 * at)
        obspy.Stream(traces).write(str(path), format="MSEED", reclen=256)
        refused(path, "holds 1,001 channels or pieces", unit="g")

    def test_binary_rubbish(self, tmp_path):
        path = tmp_path / "rubbish.AT2"
        path.write_bytes(np.random.default_rng(1).bytes(20000))
        refused(path, "not text .holds NUL bytes.|in a format of", unit="g")
        for mark in NETCDF:
            path.write_bytes(mark + bytes(100))
            refused(path, "netCDF or HDF5, not plain text: write time and acceleration as CSV")

    def test_pickles_are_not_opened(self, tmp_path):
        """obspy's own detection would unpickle this file and so run its code."""
        pytest.importorskip("obspy")
        path = tmp_path / "trap.AT2"
        trap = tmp_path / "sprung"
        path.write_bytes(b"Vobspy.core.stream\n0cbuiltins\nopen\n(V" + str(trap).encode() + b"\nVw\ntR.\0")
        refused(path, "not text", unit="g")
        assert not trap.exists()


def refused(path, message, **options):
    with pytest.raises(RecordError, match=message) as error:
        mo.read(path, **options)
    assert str(error.value).startswith(str(path))
    assert "\n" not in str(error.value)


class TestHostile:
    @pytest.mark.parametrize("name", SAMPLES)
    def test_line_endings_and_byte_order_mark(self, tmp_path, name):
        for text in (SAMPLES[name].replace("\n", "\r\n"), SAMPLES[name].replace("\n", "\r"), "\ufeff" + SAMPLES[name]):
            path = tmp_path / "record.dat"
            path.write_bytes(text.encode())
            plain = mo.read(saved(tmp_path, SAMPLES[name], "plain.dat"))
            assert np.isfinite(plain.values).all()
            np.testing.assert_array_equal(mo.read(path), plain)

    @pytest.mark.parametrize("name", SAMPLES)
    @pytest.mark.parametrize("trouble", ["web page", "a million columns", "one line", "junk", "a billion samples"])
    def test_refused_quickly_in_little_memory(self, tmp_path, name, trouble):
        text = SAMPLES[name]
        lines = text.splitlines(keepends=True)
        body = {
            "web page": "<!DOCTYPE html>\n<html><body>404</body></html>\n" + text,
            "a million columns": "".join(lines[:-3]) + "1.0 " * 1_000_000 + "\n",
            "one line": lines[0].rstrip() + "x" * 3_000_000,
            "junk": "".join(lines[:20]) + "\x01\x02\ud800".encode("utf-8", "replace").decode() * 5000,
            "a billion samples": text.replace("Duration Time(s)  2.0", "Duration Time(s)  10000000")
            .replace("200", "1000000000")
            .replace("100 ", "1000000000 "),
        }[trouble]
        path = saved(tmp_path, body, "hostile.AT2")
        mo.read(mo.example_path())
        tracemalloc.start()
        begin = time.process_time()
        try:
            mo.read(path)
        except RecordError as error:
            assert "\n" not in str(error)
        else:
            assert (name, trouble) == ("csv", "a billion samples")  # a table declares no count
        elapsed = time.process_time() - begin
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert peak < 40e6
        assert elapsed < 5.0

    @pytest.mark.slow
    def test_memory_follows_the_samples_not_the_text(self, tmp_path):
        n = 300_000
        path = saved(tmp_path, files.at2(np.zeros(n)))
        tracemalloc.start()
        mo.read(path)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert path.stat().st_size > 15 * n
        assert peak < 8 * 8 * n

    @pytest.mark.parametrize("name", SAMPLES)
    @pytest.mark.parametrize(("times", "least"), [(300, 50), pytest.param(3000, 300, marks=pytest.mark.slow)])
    def test_damaged(self, tmp_path, name, times, least):
        assert damage(tmp_path / "damaged.dat", SAMPLES[name].encode(), times) > least

    @needs_shared
    @pytest.mark.slow
    @pytest.mark.parametrize("name", [*(r[0] for r in REAL), "older_csmip.V2"])
    def test_damaged_real_files(self, tmp_path, name):
        source = cut(name)
        assert mo.read(saved(tmp_path, source)).size > 100
        assert damage(tmp_path / "damaged.dat", source.encode(), 3000) > 300


# the peak in the header of a real file, and that of the lines which `cut` leaves
CUT_PEAKS = {
    "AOM0011801241951.EW": ("  4.078", "  1.062"),
    "AOM0011801241951.NS": ("  4.954", "  0.740"),
    "NGNH311106302345.EW2": ("  0.708", "  0.527"),
    "HI.ARS1..HNE.D.20190728.160908.C.ACC.ASC": ("S^2: 0.300022", "S^2: 0.000001"),
    "Cosmos12TimeSeriesTest.v1": ("Max =  -161.962", "Max =     0.053"),
    "us1000hyfh_akbmrp_AKBMR--n.1000hyfh.BNZ.--.acc.V2c": ("Max =   -6.852", "Max =    0.000"),
    "CE58667.V2": ("    27.114 ", "     0.062 "),
    "20180212_211557_WPWS_20.V2A": ("  -41.6 mm", "    0.3 mm"),
}


def cut(name):
    """Return the header of a real file and about 200 lines of its first component, with adapted counts and peak."""
    text = (FORMATS / name).read_text(encoding="utf-8")
    if name not in CUT_PEAKS:  # (shortened already)
        return text
    stated, left = CUT_PEAKS[name]
    assert stated in text
    lines = text.replace(stated, left, 1).splitlines(keepends=True)
    if name.endswith(".ASC"):
        return "".join(lines[:264]).replace("NDATA: 19128", "NDATA: 200")
    if name.endswith(".v1"):
        return (
            "".join([*lines[:246], lines[-1]])
            .replace("   7000  acc", "   1600  acc")
            .replace("approx   70", "approx 16")
        )
    if name.endswith(".V2c"):
        return (
            "".join([*lines[:253], lines[-1]]).replace("  42000 acc", "    200 acc").replace("approx  210", "approx 1")
        )
    if name.endswith(".V2"):
        blocks = [line for start in (45, 984, 1923) for line in lines[start : start + 61]]
        return "".join([*lines[:45], *blocks, lines[2862]]).replace("  7500 points of", "   480 points of")
    if name.endswith(".V2A"):
        blocks = [line for start in (26, 606, 1186) for line in lines[start : start + 60]]
        return "".join([*lines[:26], *blocks]).replace("    5800    5800    5800", "     600     600     600")
    return "".join(lines[:217]).replace(lines[11], "Duration Time(s)  16\n")


PIECES = [b"9" * 30, b"1e400", b"nan", b"-", b"0", b"\xff\xfe", b"\n", b"1e9", b"#~ Unit: (cm/s) | 'x'"]


def damage(path, source, times):
    """Read damaged copies, with numbers or a RecordError of one line as the result; return how many were refused."""
    rng = np.random.default_rng(7)
    refusals = 0
    for _ in range(times):
        path.write_bytes(damaged(rng, source, PIECES))
        try:
            found = mo.read_all(path)
        except RecordError as error:
            refusals += 1
            assert str(error).startswith(str(path))
            assert "\n" not in str(error)
        else:
            assert all(np.isfinite(motion.values).all() for motion in found)
    return refusals


def test_refused(refusal):
    refusal()


def test_a_unit_and_a_step_are_named_with_their_lines(tmp_path):
    """Each reader names the unit that it takes and the place of the unit and of the time step."""
    many = shaking(30)
    table = "time (s),acc\n" + "".join(f"{0.01 * i:.2f},{value}\n" for i, value in enumerate(many))
    column = "".join(f"{value}\n" for value in many)
    short = many[:4].tolist()
    rows = [
        (files.at2(short), {}, "g (line 3)", "line 4"),
        (files.at2(short).replace(" IN UNITS OF G", ""), {}, "g (AT2 without a unit)", "line 4"),
        (files.knet(COUNTS), {}, "cm/s² (line 14)", "line 11"),
        (files.esm(short), {}, "cm/s² (line 15)", "line 12"),
        (files.cosmos([[("acceleration", short)]]), {}, "cm/s² (line 45)", "real header 62"),
        (files.csmip(CSMIP), {}, "cm/s² (line 46)", "line 46"),
        (files.geonet(GEONET), {}, "mm/s² (line 14)", "real header 26"),
        (f"# values: gal\n{table}", {}, "cm/s² (line 1)", "time column"),
        (f"# note\n# in m/s2\n\ndt = 0.01\n{column}", {}, "m/s² (line 2)", "line 4"),
        (table, {"unit": "g"}, "g (given)", "time column"),
        (column, {"unit": 2e-6, "dt": 0.01}, "2e-06 m/s² (given)", "given"),
    ]
    for text, options, unit, step in rows:
        motion = mo.read(saved(tmp_path, text), **options)
        assert (motion["unit_from"].item(), motion["dt_from"].item()) == (unit, step), text[:200]
        line = int((re.findall(r"line (\d+)", unit) or [1])[0])
        assert re.search("(?i)unit|gal|of g$|sec2|m/s2|s/s", text.splitlines()[line - 1]) or "line" not in unit
    two = "".join(f"{0.01 * i:.2f},{value},1\n" for i, value in enumerate(many))
    motion = mo.read(saved(tmp_path, f"time (s),NS (g),EW (gal)\n{two}"))
    assert motion["unit_from"].values.tolist() == ["g (line 1)", "cm/s² (line 1)"]
