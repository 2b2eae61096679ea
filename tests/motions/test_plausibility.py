"""Plausibility of records: what is named, with which figures, and what is not."""

import re
import warnings

import numpy as np
import pytest
from check_facts import numbers_in
from shared_cases import SHARED, needs_shared

import toppling as tp
from toppling import motions as mo
from toppling.core.doubts import Doubt, ImplausibleInput, noted
from toppling.core.units import STANDARD_GRAVITY as G
from toppling.motions.arrays import records
from toppling.motions.floors.histories import FloorHistories, History
from toppling.motions.plausibility import history_doubts, record_doubts, ringing_doubts

DT = 0.01


def recorded(values, dt=DT, label="one"):
    return mo.from_array(values, dt, [label], recorded=True)


def wavelet(amplitude=2.0, frequency=1.0, n=4000, dt=DT):
    """A whole number of cosine cycles under a sin² window: no mean, and no velocity at its end."""
    t = np.arange(n + 1) * dt
    return amplitude * np.sin(np.pi * t / t[-1]) ** 2 * np.sin(2.0 * np.pi * frequency * t)


def kinds(array):
    return {one.kind: one for one in record_doubts(records(array))}


class TestRecords:
    def test_a_sound_record_is_not_doubted(self):
        assert kinds(recorded(wavelet())) == {}

    @pytest.mark.parametrize(("share", "named"), [(0.009, False), (0.012, True)])
    def test_offset(self, share, named):
        """A mean of so much of the PGA, which the offset itself raises."""
        found = kinds(recorded(wavelet() + 2.0 * share / (1.0 - share)))
        assert ("offset" in found) == named
        if named:
            assert "is 1.2 %" in found["offset"].sentence
            assert "baseline_order = 1" in found["offset"].sentence

    @pytest.mark.parametrize(("share", "named"), [(0.09, False), (0.11, True), (-0.09, False), (-0.11, True)])
    def test_drift(self, share, named):
        """A short push at the end leaves its velocity."""
        a = wavelet()
        pgv = float(mo.measures(recorded(a)).pgv[0])
        push = np.zeros_like(a)
        push[-11:-1] = share * pgv / (10.0 * DT)  # (the peak of the velocity comes before it)
        assert ("drift" in kinds(recorded(a + push))) == named

    def test_a_mean_of_gravity(self):
        """A sensor that stands upright measures g: it is no horizontal motion, and no offset to remove."""
        found = kinds(recorded(wavelet() + G))
        assert "vertical" in found
        assert "offset" not in found
        assert "offset" in kinds(recorded(wavelet() + 0.8 * G))

    @pytest.mark.parametrize(("factor", "named"), [(2.9, False), (3.1, True)])
    def test_a_peak_of_one_sample(self, factor, named):
        a = wavelet()
        a[3] = -factor * np.abs(a).max()
        assert ("PGA" in kinds(recorded(a))) == named

    @pytest.mark.parametrize(("samples", "named"), [(6, False), (7, True)])
    def test_a_clipped_peak(self, samples, named):
        """Five samples between equal ones."""
        a = wavelet()
        a[10 : 10 + samples] = 1.1 * np.abs(a).max()
        assert ("PGA" in kinds(recorded(a))) == named

    def test_every_sample_twice(self):
        """Nothing else than a copy keeps all pairs equal; coarse records, tails and odd lengths do not."""
        a = wavelet()
        for doubled in (np.repeat(a, 2), np.repeat(a, 2)[:-1]):
            assert "duration" in kinds(recorded(doubled))
        for record in (a, np.round(a, 1), np.repeat(a, 2)[1:], np.append(a, np.zeros(9999)), np.repeat([0.0, 1.0], 50)):
            assert "duration" not in kinds(recorded(record))

    def test_displacement(self):
        """PGD over PGV of constant velocity is the duration."""
        a = np.zeros(4000)
        a[1:3] = 1.0
        assert "displacement" in kinds(recorded(a))
        assert "displacement" not in kinds(recorded(wavelet()))

    @pytest.mark.parametrize(
        ("peak", "expected"), [(1.9, None), (2.1, False), (3.1, False), (19.0, False), (21.0, True)]
    )
    def test_peak(self, peak, expected):
        a = wavelet(1.0)
        found = kinds(recorded(a * peak * G / np.abs(a).max()))
        assert (found["PGA"].grave if "PGA" in found else None) == expected

    @pytest.mark.parametrize(
        ("peak", "recorded", "floor", "doubted"),
        [
            *((29.0, False, "", False), (30.0, False, "", True), (19.0, True, "", False), (20.0, True, "", True)),
            *((60.0, False, "2", False), (0.0, False, "", False)),
        ],
    )
    def test_the_strength_of_one_motion_in_python(self, peak, recorded, floor, doubted):
        motion = mo.from_array(peak * np.sin(np.arange(500) * 0.05), 0.01).assign_coords(
            recorded=("motion", [recorded])
        )
        if floor:
            motion = motion.assign_coords(floor=floor)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", ImplausibleInput)
            tp.simulate(tp.Block(0.4, 1.8), tp.HousnerImpact(), motion)
        assert [" g (motion 1: " in str(warning.message) for warning in caught] == [True] * doubted

    @pytest.mark.parametrize(
        ("peaks", "said"),
        [
            ([1.9, 1.8], ""),  # (single records reach as much)
            ([0.4, 0.5, 2.1], "1 of 3 records reaches more than 2 g (record 2: 2.1 g)"),
            ([1.5, 1.6, 1.8, 2.0], "1.7 g of 4 motions is beyond sets of records: m/s² headed g?"),
            ([1.8, 1.3, 0.9, 0.4], "1.1 g of 4 motions is beyond"),
            ([1.8, 0.9, 0.6], ""),
            ([0.021], ""),
            ([0.019, 0.03], ""),
            ([0.019, 0.01, 0.03], "0.019 g of 3 motions is too weak to overturn anything: g or m/s² read as m/s² or"),
            ([0.005], "a PGA of 0.0050 g is too weak"),
        ],
    )
    def test_the_strength_of_a_set(self, peaks, said):
        """m/s² read as g, and g or m/s² read as m/s² or gal; records scaled to a level, and noise, have another one."""
        plain = [wavelet(frequency=0.5 + 0.1 * i) for i, _ in enumerate(peaks)]
        waves = [a * peak * G / np.abs(a).max() for a, peak in zip(plain, peaks, strict=True)]
        arrays = [recorded(a, label=f"record {i}") for i, a in enumerate(waves)]
        sentences = [doubt.sentence for doubt in record_doubts(records(arrays))]
        assert [said in sentence for sentence in sentences] == [True] * bool(said)
        if max(peaks) < 2.0:
            assert record_doubts(records(arrays), own_level=False) == []
        assert record_doubts(records(mo.from_array(waves, DT, own_amplitude=False))) == []
        made = [doubt.sentence for doubt in record_doubts(records(mo.from_array(waves, DT)))]
        assert ["in place of" in sentence for sentence in made] == [True] * ("weak" in said)

    @pytest.mark.parametrize(("frequency", "named"), [(0.25, False), (0.15, True), (14.0, False), (18.0, True)])
    def test_ratio(self, frequency, named):
        """PGV/PGA of a harmonic is 1/(2 pi f): 0.64, 1.06, 0.0114 and 0.0088 s."""
        found = kinds(recorded(wavelet(frequency=frequency, n=40_000, dt=0.001), dt=0.001))
        assert ("PGV/PGA" in found) == named

    NOISE = {name: wavelet() * np.random.default_rng(seed).normal(size=4001) for seed, name in enumerate("abcd")}

    @pytest.mark.parametrize(
        ("h1", "h2", "said"),
        [
            (NOISE["c"], NOISE["d"], ""),
            (-NOISE["a"], NOISE["d"], "second: those of first times -1"),
            (np.round(0.3 * NOISE["a"], 4), NOISE["d"], "second: those of first times 0.3"),
            (NOISE["c"], 1.5 * NOISE["b"], "second, other component: those of first times 1.5"),
            (NOISE["b"], NOISE["a"], "second: those of first"),  # (h1 and h2 exchanged)
            (np.pad(NOISE["a"], (500, 200)), np.pad(NOISE["d"], (500, 200)), "second: those of first"),
            (np.append(NOISE["a"], 0.0)[1:], NOISE["d"], "second: those of first"),
            (NOISE["a"][900:], NOISE["d"][900:], ""),  # (a part of it is not looked for)
        ],
    )
    def test_multiples(self, h1, h2, said):
        given = {"first": (self.NOISE["a"], self.NOISE["b"]), "second": (h1, h2)}
        pairs = [
            mo.as_recorded(mo.join(*(recorded(values, label=label) for values in both)))
            for label, both in given.items()
        ]
        found = [one.sentence for one in record_doubts(records(pairs)) if one.kind == "spectra"]
        assert [f"({said}): leave copies" in sentence for sentence in found] == [True] * bool(said)
        alone = [recorded(both[0], label=label) for label, both in given.items()]
        found = [one for one in record_doubts(records(alone)) if one.kind == "spectra"]
        assert bool(found) == (said.startswith("second:") and h1 is not self.NOISE["b"])

    @pytest.mark.parametrize(("factor", "doubted"), [(1.0, True), (-1.0, True), (2.0, False), (-0.5, False)])
    def test_multiples_of_floors(self, factor, doubted):
        """Levels scale histories."""
        histories = [
            History(level, "EQ", floor, "", times * self.NOISE[name], DT, "file")
            for level, floor, times, name in (
                (1.0, "1", 1.0, "a"),
                (1.0, "2", 1.0, "b"),
                (2.0, "1", factor, "a"),
                (2.0, "2", 1.0, "c"),
            )
        ]
        found = record_doubts(records(FloorHistories.of(histories, "m/s2").arrays))
        assert any("samples of another" in doubt.sentence for doubt in found) == doubted

    def test_copies(self):
        one, two = (recorded(wavelet(frequency=f), label=str(f)) for f in (1.0, 1.5))
        copy, other = recorded(wavelet(), label="copy of 1.0"), recorded(wavelet(), 2.0 * DT, "slow")
        found = record_doubts([*records(one), *records(two), *records(copy), *records(other)])
        (doubt,) = found
        assert "(copy of 1.0:" in doubt.sentence
        assert record_doubts([*records(one), *records(two), *records(other)]) == []

    @pytest.mark.parametrize(
        ("frequencies", "words"),
        [
            ({"EQ1": (1.0, 1.0), "EQ2": (1.5, 2.0)}, "a floor motion has"),
            ({"EQ1": (1.0, 1.0), "EQ2": (1.5, 1.5)}, "2 floor motions have"),
            ({"EQ1": (1.0, 2.0), "EQ2": (1.5, 2.0)}, "a floor motion has"),
            ({"EQ1": (1.0, 2.0), "EQ2": (1.5, 2.5)}, ""),
        ],
    )
    def test_copies_of_floors(self, frequencies, words):
        floors = [
            recorded(wavelet(frequency=one), label=name).expand_dims(floor=[str(floor)], axis=1)
            for name, of_floors in frequencies.items()
            for floor, one in enumerate(of_floors)
        ]
        found = record_doubts([record for array in floors for record in records(array)])
        assert [one.kind for one in found] == ["table"] * bool(words)
        assert not words or found[0].sentence.startswith(f"{words} the samples")

    def test_duration(self):
        assert set(kinds(recorded(wavelet(n=45_100, dt=0.02), dt=0.02))) == {"duration"}
        assert kinds(recorded(wavelet(n=44_900, dt=0.02), dt=0.02)) == {}

    def test_generated_motions_and_silence_are_passed_over(self):
        assert kinds(mo.from_array(wavelet() + 1.0, DT)) == {}
        assert kinds(recorded(np.zeros(100))) == {}
        assert kinds(mo.KanaiTajimi(duration=10.0).sample(3)) == {}

    @pytest.mark.parametrize(("quiet", "named"), [(2.0, True), (5.0, True), (8.0, False)])
    def test_a_building_that_sways_at_the_end(self, quiet, named):
        """Free vibration falls by exp(-2 pi zeta/sqrt(1 - zeta²)) a period: here T = 1 s and zeta = 5 %."""
        building = mo.Building.from_storeys([1e5], [1e5 * (2.0 * np.pi) ** 2])
        pulse = mo.OneCycleSine(1.0, 2.0 * np.pi, tail=quiet).sample(1)
        with warnings.catch_warnings(record=True, action="always") as caught:
            floors = building.floor_motions(pulse)
        said = [str(one.message) for one in caught if "sways" in str(one.message)]
        assert bool(said) == named
        assert (floors.ringing.item() > 0.2) == named
        before = building.floor_motions(mo.OneCycleSine(1.0, 2.0 * np.pi, tail=1.5).sample(1)).ringing.item()
        decay = np.exp(-2.0 * np.pi * 0.05 / np.sqrt(1.0 - 0.05**2) * (quiet - 1.5))
        assert floors.ringing.item() / before == pytest.approx(decay, rel=0.01)
        if named:
            assert "sways (OneCycleSine" in said[0]
            assert "on floor 1)" in said[0]
            padded = building.floor_motions(mo.pad(pulse, 0.0, 8.0))
            assert ringing_doubts([padded]) == []

    def test_what_cannot_sway_is_not_doubted(self):
        """The ground, silence, and a floor that follows the ground; parts change nothing."""
        building = mo.Building.flexural_shear(1.0, storeys=2)
        cut = mo.from_array(np.sin(np.arange(400) * 0.06), DT)
        whole = building.floor_motions([cut, cut.assign_coords(motion=["other"])])
        (one,) = ringing_doubts(whole)
        assert one.kind == "ringing"
        assert one.sentence.startswith("2 of 2")
        assert building.floor_motions(cut, [0]).ringing.item() == 0.0
        assert building.floor_motions(mo.from_array(np.zeros(400), DT)).ringing.item() == 0.0
        assert building.floor_motions(cut, parts=4).ringing.item() == pytest.approx(whole[0].ringing.item(), rel=1e-2)
        assert building.floor_motions(cut, [2, 0]).ringing.item() == whole[0].ringing.item()

    @pytest.mark.parametrize(
        ("period", "storeys", "doubted"),
        [(0.1, 40, True), (30.0, 10, True), (2.0, 5, False), (1.0, 1, False), (0.8, 40, False), (10.0, 20, True)],
    )
    def test_periods_of_storeys(self, period, storeys, doubted):
        with noted() as said:
            mo.Building.flexural_shear(period, storeys=storeys)
        assert [(doubt.kind, *numbers_in(doubt.sentence)[:2]) for doubt in said] == [
            ("building", storeys, pytest.approx(period))
        ] * doubted

    def test_storeys_of_stiffnesses_in_another_unit(self):
        with noted() as said:  # (2π over √(k/m (3 - √5)/2): kN/m in place of N/m)
            mo.Building.from_storeys([1e5, 1e5], [4e4, 4e4])
        assert [numbers_in(doubt.sentence)[:2] for doubt in said] == [[2, 16.0745]]

    def test_few_of_many_are_named(self):
        every = [recorded(wavelet() + (0.5 if i < 5 else 0.0), label=f"r{i}") for i in range(7)]
        (offset,) = [one for one in record_doubts(records(every)) if one.kind == "offset"]
        assert numbers_in(offset.sentence)[:3] == [5, 7, 20]
        assert " and 2 more)" in offset.sentence

    def test_a_cure_for_those_without_it(self):
        """Filtered records that keep an offset have no baseline to take any more; one that has none beside them has."""
        cut, plain = (recorded(wavelet() + 0.5, label=label) for label in ("cut", "plain"))
        low = plain.assign_coords(motion=["low"]).assign_attrs(processing="lowpass(10 Hz, order=4)")
        cut = cut.assign_attrs(processing="baseline(order=1); window(0.3, 0.6)")
        said = {}
        for name, some in {"cut": [cut], "plain": [plain], "low": [low], "both": [cut, plain]}.items():
            (said[name],) = [one.sentence for one in record_doubts(records(some)) if one.kind == "offset"]
        assert "after the corrections" in said["cut"]
        assert all("baseline_order = 1" in said[name] for name in ("plain", "low", "both"))

    def test_the_cures_cure(self):
        noisy = recorded(wavelet() + 0.3)
        assert set(kinds(noisy)) >= {"offset", "drift"}
        assert kinds(mo.baseline(noisy, 1)) == {}

    @pytest.mark.slow
    @needs_shared
    def test_real_records(self):
        """No processed record of the suite is doubted; what a slip of units makes of them is."""
        suite = [mo.read(path) for path in sorted((SHARED / "data/records/suite").glob("*.AT2"))]
        assert len(suite) > 40
        assert record_doubts(records(suite)) == []
        assert "PGA" in kinds(suite[0] * 100.0)
        raw = mo.read(SHARED / "data/records/formats/AOM0011801241951.EW")
        assert [*kinds(raw)] == ["PGA"]  # (0.0042 g overturns nothing)
        found = kinds(raw - 0.07656)
        assert {"offset", "drift", "displacement"} <= set(found)


class TestMarks:
    def test_who_is_marked(self, tmp_path):
        """Files are, whatever is done to them later; generators, arrays and buildings are not."""
        read = mo.read(mo.example_path())
        assert records(read)[0].recorded
        assert records(mo.highpass(mo.baseline(read), 0.1))[0].recorded
        assert records(mo.scale_to(read, 1.0))[0].recorded
        (tmp_path / "floors.csv").write_text("time,a/1 [g]\n0,0\n0.1,1\n0.2,0\n", encoding="utf-8")
        assert records(mo.read_floors(tmp_path / "floors.csv"))[0].recorded
        assert not records(mo.CloughPenzien().sample(1))[0].recorded
        assert not records(mo.Building.flexural_shear(0.5).floor_motions(read))[0].recorded
        with pytest.raises(TypeError, match="recorded must be True or False"):
            mo.from_array([0.0, 1.0], 0.1, recorded=1)


@pytest.mark.parametrize(("peak", "grave"), [(2.9, []), (18.0, [False]), (21.0, [True])])
def test_generated_motions_beyond_what_was_recorded(peak, grave):
    """A target of 20 % of g, headed g."""
    values = peak * G * np.sin(np.arange(500) * 0.1)[None]
    found = record_doubts(records(mo.from_array(values, 0.01)))
    assert [(one.kind, one.grave) for one in found] == [("PGA", one) for one in grave]


class TestFloorHistories:
    """Levels of 2, 4 and 8 m/s², PGA: noise on floors 0, 1, 2 (times 1, 1.5, 2) in x, and 0.7 times in y."""

    FACTORS = {
        (floor, way): (1.0 + 0.5 * floor) * share for floor in range(3) for way, share in (("x", 1.0), ("y", 0.7))
    }

    def histories(self, changed=None, levels=(2.0, 4.0, 8.0), factors=None, swapped=()):
        rng, found = np.random.default_rng(1), []
        of = dict(zip(levels, levels, strict=True)) | dict(zip(swapped, reversed(swapped), strict=True))
        for level in levels:
            for motion in ("a", "b"):
                for (floor, way), factor in (self.FACTORS | (factors or {})).items():
                    noise = rng.normal(size=500) * np.sin(np.pi * np.arange(500) / 499.0) ** 2
                    wave = of[level] * factor * noise / np.abs(noise).max()
                    wave = (changed or (lambda _level, _motion, values: values))(level, motion, wave)
                    found.append(History(level, motion, str(floor), way, wave, DT, "file"))
        return FloorHistories.of(found, "m/s2")

    @pytest.mark.parametrize(
        ("share", "times"), [(1.0, ""), (1.0 / G, "0.13 times the level"), (G, "12 times the level")]
    )
    def test_without_floor_0(self, share, times):
        """By hand: the mean of ln 1.5 and ln 1.05 is ln 1.255."""
        whole = self.histories(changed=lambda _level, _motion, wave: share * wave)
        upper = FloorHistories.of([one for key, one in whole.histories.items() if key[2] != "0"], "m/s2")
        assert [one.kind for one in history_doubts(upper, "pga")] == ["table"] * bool(times)
        assert all(f"floor 1 is {times}" in one.sentence for one in history_doubts(upper, "pga"))
        spectral = history_doubts(upper, "Sa(0.5)")  # (far above the level may be right at a long period)
        assert spectral == (history_doubts(upper, "pga") if share < 1.0 else [])
        assert history_doubts(upper, "pgv") == history_doubts(upper, "") == []

    @pytest.mark.parametrize(("late", "doubted"), [(0.5, True), (DT, False), (0.0, False), (np.nan, False)])
    def test_directions_that_begin_at_different_times(self, late, doubted):
        """By their files; the clocks of floors may differ, as that of the ground in an analysis after its weight."""
        clocks = {"x": 0.0, "y": late}
        every = self.histories().histories.values()
        begun = [one._replace(begins=clocks[one.direction] + 10.0 * float(one.floor)) for one in every]
        doubts = [doubt.sentence for doubt in history_doubts(FloorHistories.of(begun, "m/s2"), "pga")]
        assert ["begin at different times" in doubt and "a on floor 0: 0.5 s" in doubt for doubt in doubts] == [
            True
        ] * doubted

    @pytest.mark.parametrize("period", [0.5, 1.0, 1.6])
    @pytest.mark.parametrize("relative", [False, True])
    def test_relative_accelerations(self, period, relative):
        """A building follows slow motion: its absolute acceleration is the ground's, its relative one is near 0."""
        building = mo.Building.flexural_shear(period, alpha0=5.0, storeys=4)
        ground = mo.Seismological(magnitude=6.5).sample(2, seed=1)
        floors = building.floor_motions(ground, [0, 2, 4])
        if relative:
            floors[:, 1:] -= floors[:, :1].values
        histories = [
            History(1.0, f"EQ {i}", floor, "", floors.values[i, j], 0.005, "file")
            for j, floor in enumerate(("0", "2", "4"))
            for i in range(2)
        ]
        doubts = [doubt.kind for doubt in history_doubts(FloorHistories.of(histories), "")]
        assert doubts == ["table"] * relative

    def test_floors_counted_from_1(self):
        """The lowest floor has the PGA of the level, as the ground has."""
        whole = self.histories()
        raised = [one._replace(floor=str(int(key[2]) + 1)) for key, one in whole.histories.items()]
        assert history_doubts(FloorHistories.of(raised, "m/s2"), "pga") == [
            Doubt.of("floors_from_one", measure="pga", floor="1")
        ]

    def test_directions_that_are_multiples(self):
        whole = self.histories()
        keys = {key: one for key, one in whole.histories.items() if key[3] == "x"}
        y = {
            (*key[:3], "y"): one._replace(direction="y", acceleration=-0.7 * one.acceleration)
            for key, one in keys.items()
        }
        found = history_doubts(FloorHistories.of([*keys.values(), *y.values()], "m/s2"), "pga")
        assert re.search(r"x is -1\.43.*y\b", found[0].sentence)


def test_doubted(doubts):
    doubts()
