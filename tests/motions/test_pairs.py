"""Joined components: which files belong together, rotation, and measures of both directions."""

import math
import re
import warnings
from pathlib import Path

import numpy as np
import pytest
import record_files as files
from shared_cases import SHARED, needs_shared

import toppling as tp
from toppling import motions as mo
from toppling.core.doubts import ImplausibleInput
from toppling.motions import RecordError
from toppling.motions.arrays import digest, records
from toppling.motions.pairs import pair_up
from toppling.motions.polarity import both_polarities
from toppling.motions.readers.directions import direction_of

DT = 0.005
T = np.arange(4001) * DT
FORMATS = SHARED / "data/records/formats"


def wave(values, label="one"):
    return mo.from_array(values, DT, [label])


def circle(amplitude=2.0, frequency=2.0):
    """A vector that turns, and grows and fades within many turns: the same in every direction."""
    phase = 2.0 * np.pi * frequency * T
    length = amplitude * np.sin(np.pi * T / T[-1]) ** 2
    return mo.join(wave(length * np.cos(phase)), wave(length * np.sin(phase)))


def noise(seed=1):
    rng = np.random.default_rng(seed)
    fading = np.sin(np.pi * T / T[-1]) ** 2
    return mo.join(*(wave(fading * rng.normal(size=T.size)) for _ in range(2)))


def value(pair, name):
    return float(mo.measures(pair, [name])[mo.measure_named(name).label][0])


class TestMeasures:
    @pytest.mark.parametrize("base", ["pga", "Sa(0.3)", "Sa(1.0)"])
    def test_circular_motion_has_its_amplitude_in_every_direction(self, base):
        pair = circle()
        one = float(mo.measures(pair.sel(component="h1"), [base])[base][0])
        assert value(pair, f"RotD50({base})") == pytest.approx(one, rel=2e-3)
        assert value(pair, f"RotD100({base})") == pytest.approx(one, rel=2e-3)
        if base == "pga":
            assert one == pytest.approx(2.0, rel=2e-3)

    @pytest.mark.parametrize("base", ["pga", "pgv", "Sa(0.5)", "pgd"])
    def test_one_silent_component(self, base):
        """In the direction φ from the other one, the motion is its |cos φ|: 1 at most, 0.7071 in the median."""
        loud = noise().sel(component="h1", drop=True).drop_vars("azimuth")
        own = float(mo.measures(loud, [base])[base][0])
        for pair in (mo.join(loud, 0.0 * loud), mo.join(0.0 * loud, loud)):
            assert value(pair, f"RotD100({base})") == pytest.approx(own, rel=1e-12)
            assert value(pair, f"RotD50({base})") == pytest.approx(own * math.sqrt(0.5), rel=1e-12)
            assert value(pair, f"GeometricMean({base})") == 0.0

    @pytest.mark.parametrize("name", ["RotD50(pga)", "RotD100(Sa(0.4))", "RotD50(pgv)"])
    def test_do_not_depend_on_the_instrument(self, name):
        """Turned by whole degrees the directions are the same 180."""
        pair = noise()
        for degrees in (1.0, 37.0, 90.0, 271.0):
            assert value(mo.rotate(pair, math.radians(degrees)), name) == pytest.approx(value(pair, name), rel=1e-9)

    def test_geometric_mean(self):
        pair = noise()
        h1, h2 = (float(mo.measures(pair.sel(component=one), ["pgv"]).pgv[0]) for one in ("h1", "h2"))
        assert value(pair, "GeometricMean(pgv)") == pytest.approx(math.sqrt(h1 * h2), rel=1e-14)

    @pytest.mark.slow
    def test_arias_intensity_is_a_quadratic_form(self):
        """Over all directions it is the ellipse of the two principal ones; its median is the mean of the two."""
        pair = noise()
        turned = (mo.rotate(pair, math.radians(degrees)).sel(component="h1") for degrees in range(180))
        along = [float(mo.measures(one, ["arias"]).arias[0]) for one in turned]
        assert value(pair, "RotD100(arias)") == pytest.approx(max(along), rel=1e-9)
        both = sum(float(mo.measures(pair.sel(component=one), ["arias"]).arias[0]) for one in ("h1", "h2"))
        assert value(pair, "RotD50(arias)") == pytest.approx(0.5 * both, rel=1e-3)

    def test_names(self):
        one = mo.measure_named("rotd50( SA(1.0) )")
        assert one == mo.RotD50(mo.Sa(1.0))
        assert one.label == "RotD50(Sa(1.0))"
        assert (one.units, one.power) == ("m s-2", 1.0)
        assert mo.measure_named("RotD100(arias)").power == 2.0
        assert one != mo.RotD100(mo.Sa(1.0))


class TestJoin:
    def test_what_it_holds(self):
        h1, h2, v = (wave(np.sin(k * T)) for k in (1, 2, 3))
        pair = mo.join(h1, h2, v)
        assert pair.dims == ("motion", "component", "time")
        assert pair["component"].values.tolist() == ["h1", "h2", "v"]
        for name, one in (("h1", h1), ("h2", h2), ("v", v)):
            np.testing.assert_array_equal(pair.sel(component=name).values, one.values)
        np.testing.assert_array_equal(pair["azimuth"].values, [[0.0, 0.5 * math.pi, math.nan]])
        assert pair.attrs["units"] == "m s-2"
        assert all("units" in pair[name].attrs for name in ("azimuth", "component"))

    def test_horizontal_components_are_perpendicular(self):
        def along(degrees):
            return wave(np.sin(T)).assign_coords(azimuth=("motion", [math.radians(degrees)]))

        for one, two in ((0, 90), (9, 279), (350, 80), (180, 271)):
            mo.join(along(one), along(two))
        with pytest.raises(ValueError, match="h1 and h2 must be perpendicular, got azimuths of 0° and 80°"):
            mo.join(along(0), along(80))


FADING = np.sin(np.pi * T / T[-1]) ** 2
LOUD, OTHER = (FADING * np.random.default_rng(seed).normal(size=T.size) for seed in (1, 2))


class TestPlausible:
    """Components that cannot be of one recording are doubted, in Python and before the runs of a study."""

    @pytest.mark.parametrize(
        ("h2", "said"),
        [
            (LOUD, "a is 1 times b"),
            (-0.8 * LOUD, "a is -1.25 times b"),
            (np.round(0.5 * LOUD, 4), "a is 2 times b"),
            (0.0 * LOUD, r"a and b: a PGA of [\d.]+ and 0 g"),
            (OTHER / 9.80665, "a and b: a PGA of"),
            (8.0 * OTHER, "a and b: a PGA of"),
        ],
    )
    def test_one_component_against_the_other(self, h2, said):
        h1, h2 = (mo.from_array(values, DT, [name], recorded=True) for name, values in (("a", LOUD), ("b", h2)))
        for given in ((h1, h2), (h2.assign_coords(motion=["a"]), h1.assign_coords(motion=["b"]))):
            wanted = said if given[0] is h1 else "a is|a and b"
            with pytest.warns(ImplausibleInput, match=rf"1 pair cannot be components of one recording \({wanted}"):
                mo.join(*given)

    def test_what_is_not_doubted(self):
        for scale in (0.25, 1.0, 4.0):
            mo.join(*(mo.from_array(values, DT, recorded=True) for values in (LOUD, scale * OTHER)))

    def test_a_vertical_that_is_a_copy(self):
        h1, h2 = (mo.from_array(values, DT, [name], recorded=True) for name, values in (("a", LOUD), ("b", OTHER)))
        with pytest.warns(ImplausibleInput, match=r"\(b is 1.5 times v\): a copy, zeros or another unit"):
            mo.join(h1, h2, mo.from_array(OTHER / 1.5, DT, ["v"], recorded=True))

    @pytest.mark.parametrize(
        ("first", "second", "said"),
        [
            ("Event 1, 1/1/1991, Station 1, 000", "Event 1, 1/1/1991, Station 1, 90", None),
            ("Event 1, 1/1/1991, Station 1, 360", "EVENT 1, 1/1/1991, STATION 1, 270", None),
            ("Event 1, 1/1/1991, Station 1, 000", "Event 3, 1/1/1993, Station 3, 090", "headers name two recordings"),
            ("Event 1, 1/1/1991, Station 1, 000", "Event 1, 1/1/1991, Station 2, 090", "headers name two recordings"),
            ("Event 1, 1/1/1991, Station 1, 000", "Event 1, 1/1/1991, Station 1, 000", "says 000, its name 090"),
            ("Event 1, 1/1/1991, Station 1, 000", "Event 1, 1/1/1991, Station 1, UP", "says UP, its name 090"),
        ],
    )
    def test_second_lines_of_at2_files(self, tmp_path, first, second, said):
        for name, values, title in (("RSN1_A000", LOUD, first), ("RSN1_A090", OTHER, second)):
            text = files.at2(values[:400], DT).splitlines()
            (tmp_path / f"{name}.AT2").write_text("\n".join([text[0], title, *text[2:]]), encoding="utf-8")
        with warnings.catch_warnings(record=True, action="always") as found:
            files.read_pairs([str(tmp_path / "*.AT2")])
        assert [said in str(one.message) for one in found] == [True] * (said is not None)
        study = tmp_path / "study.toml"
        study.write_text(PAIRS, encoding="utf-8")
        assert sum(str(said) in note for note in tp.Study.from_toml(study).notes) == (said is not None)

    def test_stations_of_other_headers(self, tmp_path):
        counts = np.round(1000.0 * np.sin(np.arange(200) * 0.1) * np.sin(np.arange(200) * 0.03)).astype(int)
        (tmp_path / "X.EW").write_text(files.knet(counts, direction="E-W"), encoding="utf-8")
        other = re.sub("(Station Code +)[A-Z0-9]+", r"\1ZZZ001", files.knet(np.roll(counts, 40), direction="N-S"))
        (tmp_path / "X.NS").write_text(other, encoding="utf-8")
        with pytest.warns(ImplausibleInput, match="headers name two recordings are joined .*ZZZ001"):
            files.read_pairs([str(tmp_path / "X.*")])


class TestBegins:
    """Components whose files begin at different times are doubted until they are cut to the same times."""

    @staticmethod
    def table(folder, name, values, start, head="time (s)"):
        rows = "".join(f"{start + DT * i:.3f},{value:.6f}\n" for i, value in enumerate(values))
        (folder / f"{name}.csv").write_text(f"{head},acc {name[-2:]} (g)\n{rows}", encoding="utf-8")
        return mo.read(folder / f"{name}.csv")

    def test_tables(self, tmp_path):
        h1, late = self.table(tmp_path, "A-NS", LOUD, 0.0), self.table(tmp_path, "A-EW", OTHER, 0.5)
        with pytest.warns(ImplausibleInput, match=r"begin at different times.*\(A-NS: 0.5 s apart\): trim them"):
            mo.join(h1, late)
        with pytest.warns(ImplausibleInput, match="begin at different times"):
            files.read_pairs([str(tmp_path / "A-*.csv")])
        steps = round(0.5 / DT)
        with warnings.catch_warnings(action="error"):
            mo.join(h1, self.table(tmp_path, "B-EW", OTHER, 0.0))
            mo.join(h1, self.table(tmp_path, "B-EW", OTHER, DT))
            mo.join(mo.pad(h1, 0.0, 0.5), mo.pad(late, 0.5, 0.0))
            mo.join(h1.isel(time=slice(steps, None)), late.isel(time=slice(0, -steps)))
            mo.join(h1, mo.from_array(9.8 * OTHER, DT, recorded=True))
            mo.join(mo.resample(h1, 2.0 * DT), mo.resample(self.table(tmp_path, "B-EW", OTHER, 0.0), 2.0 * DT))

    def test_components_cut_to_their_own_strong_motion(self, tmp_path):
        h1, h2 = self.table(tmp_path, "A-NS", LOUD, 0.0), self.table(tmp_path, "A-EW", OTHER, 0.0)
        cut = [mo.trim_husid(h1, 0.1, 0.9), mo.trim_husid(h2, 0.3, 0.9)]
        n = min(part.sizes["time"] for part in cut)
        with pytest.warns(ImplausibleInput, match="begin at different times"):
            mo.join(*(part.isel(time=slice(n)) for part in cut))

    def test_clocks_of_agencies(self, tmp_path):
        counts = np.round(1000.0 * np.sin(np.arange(200) * 0.1) * np.sin(np.arange(200) * 0.03)).astype(int)
        (tmp_path / "X.EW").write_text(files.knet(counts, direction="E-W"), encoding="utf-8")
        late = files.knet(np.roll(counts, 40), direction="N-S").replace("19:51:43", "19:51:58")
        (tmp_path / "X.NS").write_text(late, encoding="utf-8")
        with pytest.warns(ImplausibleInput, match="begin at different times.* 15 s apart"):
            files.read_pairs([str(tmp_path / "X.*")])


PAIRS = """title = "pairs"
[[blocks]]
name = "cabinet"
width_m = 0.45
height_m = 1.8
depth_m = 0.6
[[models]]
law = "energy-consistent"
[motions]
records = "*.AT2"
component = "pair"
[ida]
im = "RotD50(pga)"
levels = { values = [0.3], unit = "g" }
"""


class TestRotate:
    def test_a_wave_along_one_direction(self):
        """What shakes along N 30° E alone is all in h1 of that azimuth, with either handedness of the instrument."""
        shake = np.sin(3.0 * T)
        for azimuths in ((0.0, 90.0), (0.0, 270.0), (120.0, 30.0)):
            a, b = (
                wave(shake * math.cos(math.radians(30.0 - one))).assign_coords(azimuth=("motion", [math.radians(one)]))
                for one in azimuths
            )
            turned = mo.rotate(mo.join(a, b), math.radians(30.0))
            np.testing.assert_allclose(turned.sel(component="h1").values[0], shake, atol=1e-15)
            np.testing.assert_allclose(turned.sel(component="h2").values[0], 0.0, atol=1e-15)
            np.testing.assert_allclose(turned["azimuth"].values, [[math.radians(30.0), math.radians(120.0)]])

    def test_back_and_forth(self):
        pair = noise()
        again = mo.rotate(mo.rotate(pair, 1.234), 0.0)
        np.testing.assert_allclose(again.values, pair.values, atol=1e-14)
        np.testing.assert_allclose(again["azimuth"].values % (2.0 * math.pi), pair["azimuth"].values, atol=1e-15)

    @pytest.mark.parametrize("turn", [mo.rotate, mo.both_axes, mo.weak_axis])
    def test_degrees_in_place_of_radians(self, turn):
        with warnings.catch_warnings(record=True, action="always") as said:
            turn(noise(), 2.0 * math.pi)
            turn(noise(), -90.0)
        assert len(said) == 1
        assert "azimuth of -90" in str(said[0].message)

    def test_the_vertical_stays(self):
        pair = mo.join(wave(np.sin(T)), wave(np.cos(T)), wave(np.sin(5.0 * T)))
        turned = mo.rotate(pair, 0.7)
        np.testing.assert_array_equal(turned.sel(component="v").values, pair.sel(component="v").values)
        assert math.isnan(turned["azimuth"].values[0, 2])


class TestUse:
    def test_an_analysis_needs_to_know_which_component_shakes(self):
        one, two = (records(mo.as_recorded(noise(), name))[0] for name in ("h1", "h2"))
        np.testing.assert_array_equal(one.acceleration, two.companion)
        np.testing.assert_array_equal(two.acceleration, one.companion)
        assert digest(one) != digest(two) != digest(two._replace(companion=None))

    def test_levels_are_of_both_and_runs_of_one(self):
        block, law = tp.Block(0.4, 1.8, name="cabinet"), tp.HousnerImpact(e=0.9)
        shakes = mo.as_recorded(4.0 * noise(), "h2")
        options = {"outputs": ("peak_rotation",), "screen": False}
        runs = tp.ida(block, law, shakes, [3.0, 6.0], im="RotD50(pga)", **options)
        assert runs["level"].attrs["im"] == "RotD50(pga)"
        alone = shakes.sel(component="h2", drop=True).drop_vars(["shakes", "azimuth"]).assign_attrs(shakes.attrs)
        own = value(shakes, "RotD50(pga)")
        plain = tp.ida(block, law, alone, [3.0 / own, 6.0 / own], im="scale", **options)
        np.testing.assert_array_equal(runs["peak_rotation"].values, plain["peak_rotation"].values)
        assert np.all(runs["peak_rotation"].values[..., 1, :] > 0.0)

    def test_scaling_keeps_both_in_proportion(self):
        scaled = mo.scale_to(mo.as_recorded(noise()), 3.0, "RotD100(pga)")
        assert value(scaled, "RotD100(pga)") == pytest.approx(3.0, rel=1e-12)
        assert value(scaled, "GeometricMean(pga)") / 3.0 == pytest.approx(
            value(noise(), "GeometricMean(pga)") / value(noise(), "RotD100(pga)"), rel=1e-12
        )

    def test_both_are_looked_at_for_offsets(self):
        sound = mo.from_array(np.sin(np.pi * T / T[-1]) ** 2 * np.sin(6.0 * T), DT, ["a"], recorded=True)
        pair = mo.as_recorded(mo.join(sound, sound + 0.5))
        with pytest.warns(UserWarning, match="a, other component: its mean is"):
            tp.ida(tp.Block(0.4, 1.8), tp.HousnerImpact(e=0.9), pair, [1.0], screen=False)


class TestDirections:
    @pytest.mark.parametrize(
        ("text", "degrees"),
        [
            ("N-S", 0.0), ("E-W", 90.0), ("N-S surface", 0.0), ("NS", 0.0), ("E", 90.0), ("W", 270.0), ("009", 9.0),
            ("90 DEG", 90.0), ("360", 0.0), ("S16W", 196.0), ("S74E", 106.0), ("N30E", 30.0), ("N30W", 330.0),
            ("HNE", 90.0), ("HNN", 0.0),
        ],
    )  # fmt: skip
    def test_azimuths(self, text, degrees):
        vertical, azimuth = direction_of(text)
        assert not vertical
        assert math.degrees(azimuth) == pytest.approx(degrees)

    @pytest.mark.parametrize("text", ["U-D", "UD", "Up", "DWN", "vert", "V", "Z", "HNZ", "U-D surface"])
    def test_vertical(self, text):
        assert direction_of(text) == (True, pytest.approx(math.nan, nan_ok=True))

    @pytest.mark.parametrize("text", ["H1", "L", "T1", "HN1", "BH2", "BH100", "TRAN"])
    def test_horizontal_of_no_known_azimuth(self, text):
        assert direction_of(text) == (False, pytest.approx(math.nan, nan_ok=True))

    @pytest.mark.parametrize("text", ["", "BNZZ", "anything", "400", "1999", "STATION"])
    def test_unknown(self, text):
        assert direction_of(text) is None


class TestFiles:
    def written(self, tmp_path, *names, values=None):
        for i, name in enumerate(names):
            shake = np.sin((1 + i) * T[:400]) if values is None else values
            (tmp_path / name).write_text(files.at2(shake, DT), encoding="utf-8")
        return [tmp_path / name for name in names]

    @pytest.mark.parametrize(
        ("names", "azimuths"),
        [
            (("RSN953_NORTHR_MUL009.AT2", "RSN953_NORTHR_MUL279.AT2", "RSN953_NORTHR_MUL-UP.AT2"), (9.0, 279.0)),
            (("A-ELC180.AT2", "A-ELC270.AT2"), (180.0, 270.0)),
            (("HWA002-N.AT2", "HWA002-V.AT2", "HWA002-W.AT2"), (0.0, 270.0)),
            (("GCN-WE.AT2", "GCN-NS.AT2", "GCN-UD.AT2"), (90.0, 0.0)),
        ],
    )
    def test_names_as_of_the_nga_databases(self, tmp_path, names, azimuths):
        (pair,) = files.read_pairs(self.written(tmp_path, *names))
        assert pair.sizes["component"] == len(names)
        np.testing.assert_allclose(np.degrees(pair["azimuth"].values[0, :2]), azimuths)

    def test_several_recordings_in_any_order(self, tmp_path):
        paths = self.written(tmp_path, "A090.AT2", "B-N.AT2", "A000.AT2", "B-E.AT2")
        first, second = files.read_pairs(paths)
        np.testing.assert_array_equal(first.values[0, 0], mo.read(paths[0]).values[0])
        np.testing.assert_array_equal(second.values[0, 1], mo.read(paths[3]).values[0])

    def test_knet(self, tmp_path):
        for name, direction, k in (
            ("X.EW", "E-W", 1),
            ("X.NS", "N-S", 2),
            ("X.UD", "U-D", 3),
            ("X.EW1", "2", 4),
            ("X.NS1", "1", 5),
        ):
            counts = np.round(1000.0 * np.sin(k * np.arange(200) * 0.1)).astype(int)
            (tmp_path / name).write_text(files.knet(counts, direction=direction), encoding="utf-8")
        surface, borehole = files.read_pairs([tmp_path / f"X.{end}" for end in ("EW", "NS", "UD", "EW1", "NS1")])
        assert surface.sizes["component"] == 3
        assert borehole.sizes["component"] == 2
        np.testing.assert_allclose(np.degrees(surface["azimuth"].values[0, :2]), [90.0, 0.0])
        assert "removed on reading" in surface.attrs["processing"]

    @needs_shared
    def test_real_files(self):
        east = FORMATS / "AOM0011801241951.EW"
        (pair,) = files.read_pairs([east, east.with_suffix(".NS")])
        np.testing.assert_allclose(np.degrees(pair["azimuth"].values), [[90.0, 0.0]])
        rotated = value(pair, "RotD50(pga)"), value(pair, "RotD100(pga)")
        assert 0.0408 <= rotated[0] <= rotated[1] <= math.hypot(0.0408, 0.0496)
        (three,) = files.read_pairs([FORMATS / "20180212_211557_WPWS_20.V2A"])
        assert three["component"].values.tolist() == ["h1", "h2", "v"]
        np.testing.assert_allclose(np.degrees(three["azimuth"].values[0, :2]), [196.0, 106.0])
        (channels,) = files.read_pairs([FORMATS / "CE58667.V2"])
        assert channels.sizes["component"] >= 2

    @pytest.mark.slow
    def test_hostile_names(self):
        """3,000 sets of names: each file is in exactly one recording, or one sentence names some of them."""
        rng = np.random.default_rng(7)
        parts = [*"aé -_.[ne0\n", "RSN1", "AOM001", "..", "%s", "000", "090", "360"]
        directions = ["000", "090", "-N", "e", "up", "z", ""]
        shaking = [wave(np.sin(2.0 * np.pi * f * T[:400]), f"wave {f}") for f in range(1, 8)]
        joined = refused = 0
        for _ in range(3000):
            stems = ["".join(rng.choice(parts, rng.integers(1, 5))) for _ in range(rng.integers(1, 3))]
            ends = rng.choice(["NS", "EW", "UD", "NS1", "EW2", "AT2", "csv", "", "ns", "E", "090"], 2)
            names = {f"{stem}{one}.{ends[0]}" for stem in stems for one in ("000", "090")}
            for _ in range(rng.integers(0, 3)):
                names.add(f"{rng.choice(stems)}{rng.choice(['', '-', '_'])}{rng.choice(directions)}.{rng.choice(ends)}")
            read = {Path("folder") / name: [shaking[i]] for i, name in enumerate(sorted(names))}
            try:
                pairs = pair_up(read)
            except RecordError as error:
                refused += 1
                assert any(path.name in str(error) for path in read)
                continue
            joined += 1
            assert sum(one.sizes["component"] for one in pairs) == len(read)
            assert all(list(one["component"].values[:2]) == ["h1", "h2"] for one in pairs)
            sources = [row.tobytes() for one in pairs for row in one.values[0]]
            assert len(set(sources)) == len(read)
        assert joined > 30
        assert refused > 300


class TestStudy:
    def test_corrections_keep_components_simultaneous(self, tmp_path):
        """A component that comes two seconds later still does after a window, which is that of both."""
        still = np.zeros(round(2.0 / DT))
        shaking = np.sin(np.pi * T / T[-1]) ** 2 * np.sin(2.0 * np.pi * T)
        for name, values in (("A000", np.r_[shaking, still]), ("A090", np.r_[still, shaking])):
            rows = "".join(f"{i * DT:.3f},{one:.9f}\n" for i, one in enumerate(values))
            (tmp_path / f"{name}.csv").write_text(f"time (s),acceleration (m/s2)\n{rows}", encoding="utf-8")
        path = tmp_path / "study.toml"
        path.write_text(
            """
            title = "A window"
            [[blocks]]
            width_m = 0.4
            height_m = 1.8
            [[models]]
            law = "housner"
            [motions]
            records = "A*.csv"
            component = "h1"
            baseline_order = 0
            window = [0.05, 0.95]
            [cloud]
            im = "RotD50(pgv)"
            """,
            encoding="utf-8",
        )
        (pair,) = tp.Study.from_toml(path).design.motions
        assert pair.attrs["processing"] == "baseline(order=0); trim_husid(low=0.05, high=0.95)"
        one, two = (pair.sel(component=name).values[0] for name in ("h1", "h2"))
        later = round(2.0 / DT)
        np.testing.assert_allclose(two[later:], one[:-later], atol=1e-5)
        both = mo.from_array([np.r_[shaking, still], np.r_[still, shaking]], DT)
        cut = mo.trim_husid(mo.baseline(both, 0))
        whole = mo.join(cut.isel(motion=[0]), cut.isel(motion=[1]))
        assert value(pair, "RotD100(pgv)") == pytest.approx(value(whole, "RotD100(pgv)"), rel=1e-6)


class TestVertical:
    def components(self):
        return [mo.CloughPenzien(duration=2.0).sample(2, seed=seed) for seed in range(3)]

    def test_shakes_beside_a_horizontal_component(self):
        h1, h2, v = self.components()
        read = records(mo.as_recorded(mo.join(h1, h2, v), "h2", vertical=True))
        for i, one in enumerate(read):
            np.testing.assert_array_equal(one.acceleration, h2.values[i])
            np.testing.assert_array_equal(one.companion, h1.values[i])
            np.testing.assert_array_equal(one.vertical, v.values[i])

    def test_is_left_out_unless_told(self):
        h1, h2, v = self.components()
        once = mo.as_recorded(mo.join(h1, h2, v), vertical=True)
        for one in records(mo.as_recorded(once)):
            assert one.vertical is None

    def test_makes_another_motion(self):
        joined = mo.join(*self.components())
        plain, lifted = (records(mo.as_recorded(joined, vertical=on))[0] for on in (False, True))
        assert digest(plain) != digest(lifted)

    def test_a_reverse_turns_the_horizontal_components_alone(self):
        h1, h2, v = self.components()
        first, back, *_ = records(both_polarities(mo.as_recorded(mo.join(h1, h2, v), vertical=True)))
        np.testing.assert_array_equal(back.acceleration, -first.acceleration)
        np.testing.assert_array_equal(back.companion, -first.companion)
        np.testing.assert_array_equal(back.vertical, first.vertical)


def test_refused(refusal):
    refusal()
