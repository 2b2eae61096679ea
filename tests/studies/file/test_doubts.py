"""Doubts in studies: what is noted, accepted and refused, and the corrections of records that cure it."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from check_facts import check as check_of, doubts_in, numbers_in
from study_texts import study_in

import toppling as tp
from toppling import motions as mo
from toppling.core.doubts import ImplausibleInput
from toppling.core.facts import CARE, GOOD, INVALID, UNKNOWN
from toppling.studies import StudyError
from toppling.studies.command.cli import main
from toppling.studies.facts.notes import notes_of
from toppling.studies.facts.say import notes_said
from toppling.studies.kinds.study import OF_TABLES

DT = 0.01
STUDY = """
title = "Records"
{top}
[[blocks]]
name = "cabinet"
width_m = {width}
height_m = {height}
[[models]]
law = "housner"
{e}
[motions]
{source}
{keys}
[ida]
levels = {{ from = 0.1, to = {highest}, number = 4, unit = "g" }}
{more}"""
STUDIES = {"width": 0.4, "height": 1.8, "highest": 1.0, "e": "e = 0.9", "source": 'records = "*.csv"'}
HOLE = "period (s), sa (g)\n0.05, 0.8\n0.3, 0.8\n0.31, 0.05\n0.33, 0.05\n0.34, 0.8\n4, 0.1\n"


def without_sources(notes):
    """The notes without what is taken from files."""
    return [note for note in notes if ", time step " not in note and "; source: " not in note]


def write(folder, top="", keys="", more="", offset=0.3, **others):
    """A study of one record of 20 s, with an offset; others are keys of `STUDIES`."""
    t = np.arange(2001) * DT
    values = 2.0 * np.sin(np.pi * t / t[-1]) ** 2 * np.sin(2.0 * np.pi * t) + offset
    rows = "".join(f"{i * DT:.2f},{one:.8f}\n" for i, one in enumerate(values))
    (folder / "shake.csv").write_text(f"time (s),acceleration (m/s2)\n{rows}", encoding="utf-8")
    path = folder / "study.toml"
    path.write_text(STUDY.format(top=top, keys=keys, more=more, **STUDIES | others), encoding="utf-8")
    return path


def notes(folder, part="", **options):
    """The notes of a study without an offset that hold a text."""
    return [note for note in tp.Study.from_toml(write(folder, offset=0.0, **options)).notes if part in note]


def looks(results):
    return check_of(results, "inputs")


class TestNotes:
    def test_an_offset_is_noted_before_and_after(self, tmp_path):
        study = tp.Study.from_toml(write(tmp_path))
        assert (study.doubts[0].kind, numbers_in(study.notes[0])[0]) == ("offset", 13)
        results = study.run()
        assert notes_of(results)[: len(study.facts)] == study.facts
        check = looks(results)
        assert check.word == CARE
        assert check.names == ("offset", "drift", "displacement")
        assert "offset (shake" in check.more["sentences"][0]

    def test_what_readers_doubt_is_noted(self, tmp_path):
        """Input warnings of every kind that a reader of records issues are notes of a study, as they are in Python."""
        source = "".join(
            file.read_text(encoding="utf-8") for file in (Path(mo.__file__).parent / "readers").glob("*.py")
        )
        assert set(re.findall(r'Doubt\("([^"]+)"', source)) <= set(OF_TABLES)
        path, file = write(tmp_path), tmp_path / "shake.csv"
        _, *rows = file.read_text(encoding="utf-8").splitlines()
        samples = [row.split(",") for row in rows]
        lines = "".join(f"{time},{x},{float(x) ** 2},{float(x) ** 3}\n" for time, x in samples)
        file.write_text(f"time (s),CH1 (m/s2),CH2 (m/s2),CH3 (m/s2)\n{lines}", encoding="utf-8")
        assert any("none of them known to be vertical" in note for note in notes_said(tp.Study.from_toml(path).facts))

    def test_a_key_cures_it(self, tmp_path):
        study = tp.Study.from_toml(write(tmp_path, keys="baseline_order = 1"))
        assert without_sources(study.notes) == []
        results = study.run()
        assert looks(results).word == GOOD
        assert results.attrs["processing"] == "baseline(order=1)"

    def test_accepted_kinds_are_silent(self, tmp_path):
        path = write(tmp_path, top='accept = ["offset", "drift", "displacement"]')
        study = tp.Study.from_toml(path)
        assert without_sources(study.notes) == []
        results = study.run()
        assert "offset" not in results.attrs["notes"]
        assert looks(results).word == GOOD
        assert looks(results).names == ("offset", "drift", "displacement")

    @pytest.mark.slow
    def test_accepting_later_keeps_the_results(self, tmp_path):
        """The kinds that are accepted are no part of what decides the runs."""
        before = tp.Study.from_toml(write(tmp_path)).run(tmp_path / "out")
        study = tp.Study.from_toml(write(tmp_path, top='accept = ["offset"]'))
        after = study.run(tmp_path / "out")
        assert after.attrs["identity"] == before.attrs["identity"]
        assert "keeps an offset" in doubts_in(before)
        assert "keeps an offset" not in doubts_in(after)
        assert json.loads(after.attrs["study"])["accept"] == ["offset"]
        assert {*notes_said(notes_of(after))} < {*notes_said(notes_of(before))}
        assert tp.Study.from_toml(write(tmp_path)).run(tmp_path / "out").attrs == before.attrs

    @pytest.mark.slow
    def test_a_missed_spectrum(self, tmp_path, recwarn):
        """A hole that no motion has: a note instead of a warning, and one that can be accepted."""
        (tmp_path / "target.csv").write_text(HOLE, encoding="utf-8")
        source = 'generator = "spectrum-compatible"\ntarget = "target.csv"\nnumber = 2\nduration_s = 10\ndt_s = 0.02'
        study = tp.Study.from_toml(write(tmp_path, source=source))
        (doubt,) = study.doubts
        assert (doubt.kind, numbers_in(doubt.sentence)[:2]) == ("misfit", [2, 2])
        assert [one for one in recwarn if issubclass(one.category, mo.TargetMissed)] == []
        assert looks(study.run()).names == ("misfit",)
        assert notes(tmp_path, top='accept = ["misfit"]', source=source) == []

    def test_a_building_that_sways_at_the_end(self, tmp_path, recwarn):
        """In the studies of blocks and of inventories; a longer motion cures it."""
        short = 'pulse = "one-cycle-sine"\nomega_rad_s = 6.28\ndt_s = 0.01\ntail_s = 0.5'
        tower = '[building]\nkind = "flexural-shear"\nperiod_s = 1.0\nstoreys = 2\n'
        path = write(tmp_path, source=short, more=f"{tower}floors = [2]\n")
        (doubt,) = tp.Study.from_toml(path).doubts
        assert doubt.kind == "ringing"
        assert "(OneCycleSine" in doubt.sentence
        assert [one for one in recwarn if "sways" in str(one.message)] == []
        assert notes(tmp_path, source=short.replace("0.5", "12"), more=f"{tower}floors = [2]\n") == []
        (tmp_path / "items.csv").write_text("item,catalogue,floor\nshelf,bookcase-5-shelf,1\n", encoding="utf-8")
        asked = '[performance]\ninventory = "items.csv"\nlevels = { values = [0.2], unit = "g" }\n'
        path.write_text(f'title = "x"\n[[models]]\nlaw = "housner"\n[motions]\n{short}\n{tower}{asked}')
        (doubt,) = tp.Study.from_toml(path).doubts
        assert doubt.kind == "ringing"
        assert "on floor 2)" in doubt.sentence

    def test_a_hazard_without_a_return_period_names_its_ends(self, tmp_path):
        table = '[hazard]\nlevels = [0.1, 0.4]\nrates = [0.1, {rate}]\nunit = "g"\n'
        assert notes(tmp_path, "; source: ", more=table.format(rate=0.02)) == [
            "PGA from 0.1 g (once in 10 years) to 0.4 g (once in 50 years); source: study file."
        ]
        assert notes(tmp_path, "; source: ", more=table.format(rate=0.001)) == [
            "PGA 0.32 g once in 475 years, curve from 0.1 g (once in 10 years) to 0.4 g (once in 1,000 years); "
            "source: study file."
        ]

    @pytest.mark.slow
    @pytest.mark.parametrize(("rule", "levels"), [('above = "none"', "0.0005, 0.1"), ('below = "none"', "2, 4")])
    def test_a_hazard_that_leaves_out_what_the_rate_needs(self, tmp_path, rule, levels):
        hazard = f'[hazard]\nlevels = [{levels}]\nrates = [1e-2, 2e-3]\nunit = "g"\n'
        for more in ("", f"{rule}\n"):
            path = write(tmp_path, offset=0.0, highest=2.0, more=hazard + more)
            check = check_of(tp.Study.from_toml(path).run(), "hazard curve")
            assert check.word != GOOD
        assert check.what == "rate.left_out"

    def test_return_periods_in_place_of_rates(self, tmp_path):
        for rates, message in (
            ("9975, 475, 50", "exceeded 9,975 times per year"),
            ("50, 475, 9975", "1/return period"),
        ):
            with pytest.raises(StudyError, match=message):
                notes(tmp_path, more=f'[hazard]\nlevels = [0.1, 0.4, 0.8]\nrates = [{rates}]\nunit = "g"\n')

    def test_a_point_of_a_comment_that_is_off_the_curve(self, tmp_path):
        table = '[hazard]\nlevels = [0.1, 0.4, 0.8]\nrates = [1e-2, 1e-3, 1e-4]\nunit = "g"\n'
        for comment, off in (("0.4 g once in 475 years", True), ("0.4 g once in 1,000 years", False)):
            found = notes(tmp_path, "a comment names", more=f"# {comment}\n{table}")
            assert len(found) == off

    def test_stripes_and_buildings_see_the_ground(self, tmp_path):
        path = write(tmp_path, more='[building]\nkind = "flexural-shear"\nperiod_s = 0.5\nfloors = [2]\n')
        assert [doubt.kind for doubt in tp.Study.from_toml(path).doubts].count("offset") == 1
        blocks = write(tmp_path).read_text(encoding="utf-8").partition("[ida]")[0]
        path.write_text(f'{blocks}[stripes]\nunit = "g"\nat = [{{ level = 0.2 }}, {{ level = 0.4 }}]\n')
        assert [doubt.kind for doubt in tp.Study.from_toml(path).doubts].count("offset") == 1

    def test_measures_in_any_capitals(self, tmp_path):
        text = write(tmp_path, offset=0.0).read_text(encoding="utf-8")
        for written, im in (("PGA", "pga"), ("SA(1.0)", "Sa(1.0)"), ("Scale", "scale")):
            unit = '"1"' if im == "scale" else '"g"'
            changed = text.replace("[ida]", f'[ida]\nim = "{written}"').replace('"g"', unit)
            assert study_in(tmp_path, changed).design.im == im
        assert mo.measure_named("AVGSA(0.2:2.0:10)") == mo.measure_named("AvgSa(0.2:2.0:10)")


class TestRefused:
    @pytest.mark.parametrize(
        ("options", "kind", "said"),
        [
            (
                {"width": 400, "height": 1800},
                "block size",
                r"cabinet: 400 m × 1800 m, or 0.4 m × 1.8 m with both divided by 1000\?\): centimetres or millimetres",
            ),
            ({"highest": 98}, "level", "the highest level, 98 g, is beyond any shaking: g written where m/s² is meant"),
        ],
    )
    def test_what_cannot_be_meant(self, tmp_path, options, kind, said):
        options = {**options, "offset": 0.0}
        with pytest.raises(
            StudyError, match=rf"{said}.*accept = \[\"{kind}\"\] at the top of the study file takes it as it is"
        ):
            tp.Study.from_toml(write(tmp_path, **options))
        assert without_sources(tp.Study.from_toml(write(tmp_path, top=f'accept = ["{kind}"]', **options)).notes) == []

    def test_records_in_another_unit(self, tmp_path):
        path = write(tmp_path, offset=20.0)
        shake = tmp_path / "shake.csv"
        shake.write_text(shake.read_text(encoding="utf-8").replace("(m/s2)", "(g)"), encoding="utf-8")
        with pytest.raises(StudyError, match=r"reaches more than 2 g .shake: 22 g.*gal headed g"):
            tp.Study.from_toml(path)


def drawn(table, key, kind, names, numbers):
    """Options of a study of uncertain or varied inputs: a key from a distribution with these numbers by their names."""
    given = ", ".join(f"{name} = {number}" for name, number in zip(names, numbers, strict=False))
    e = 'e = { distribution = "uniform", lower = 0.85, upper = 0.95 }'
    of = "samples = 4" if table == "uncertainty" else 'parameter = "e"\nvalues = [0.85, 0.9]'
    inputs = f'{e}\n{key} = {{ distribution = "{kind}", {given} }}'
    own = {"e": "e = 0.9" if table == "uncertainty" else ""}
    return own | {"more": f"[{table}]\n{of}\n[{table}.inputs]\n{inputs}\n"}


class TestCorrections:
    @pytest.mark.parametrize(
        ("keys", "expected"),
        [
            ("baseline_order = 0", lambda one: mo.baseline(one, 0)),
            ("window = [0.05, 0.95]", lambda one: mo.trim_husid(one, 0.05, 0.95)),
            ("taper_s = 1.5", lambda one: mo.taper(one, 1.5)),
            ("highpass_hz = 0.2", lambda one: mo.highpass(one, 0.2)),
            ("lowpass_hz = 20", lambda one: mo.lowpass(one, 20.0)),
            ("highpass_hz = 0.2\nlowpass_hz = 20\norder = 2", lambda one: mo.bandpass(one, 0.2, 20.0, 2)),
            (
                "order = 3\nhighpass_hz = 0.1\ntaper_s = 1.0\nbaseline_order = 1\nwindow = [0.0, 0.9]",
                lambda one: mo.highpass(mo.taper(mo.trim_husid(mo.baseline(one, 1), 0.0, 0.9), 1.0), 0.1, 3),
            ),
        ],
    )
    def test_as_in_python_in_one_order(self, tmp_path, keys, expected):
        study = tp.Study.from_toml(write(tmp_path, keys=keys))
        (found,) = study.arrays
        wanted = expected(mo.read(tmp_path / "shake.csv"))
        np.testing.assert_array_equal(found.values, wanted.values)
        assert list(study.reading.processing) == [wanted.attrs["processing"]]

    @pytest.mark.parametrize(
        ("keys", "said"),
        [
            ("highpass_hz = 10", "takes out what is below 10 Hz, usual is up to 1 Hz: a period in s in place of Hz"),
            ("lowpass_hz = 0.5", "takes out what is above 0.5 Hz, usual is from 5 Hz"),
            ("highpass_hz = 0.1\nlowpass_hz = 4.0", "above 4 Hz"),
            ("highpass_hz = 1.0\nlowpass_hz = 5.0", ""),
        ],
    )
    def test_corners_that_leave_no_earthquake(self, tmp_path, keys, said):
        found = notes(tmp_path, "filter", keys=keys)
        assert [said in note for note in found] == [True] * bool(said)
        if said:
            with pytest.warns(ImplausibleInput, match="a filter takes out"):
                mo.highpass(mo.read(tmp_path / "shake.csv"), 10.0)

    @pytest.mark.parametrize("e", ["0.09", "0.9"])
    def test_restitution(self, tmp_path, capsys, e):
        """Of a law, of an uncertain input, and of one run."""
        bounds = f"lower = {e}, upper = {float(e) + 0.01}"
        drawn = (
            '[uncertainty]\nsamples = 4\n[uncertainty.inputs]\n{} = {{ distribution = "uniform", ' + bounds + " }}\n"
        )
        for name in ("e", "restitution_factor"):
            for options in (
                {"e": f"{name} = {e}"},
                {"e": "" if name != "e" else "e = 0.9", "more": drawn.format(name)},
            ):
                assert bool(notes(tmp_path, "restitution below 0.3", **options)) == (e == "0.09")
        shake = str(tmp_path / "shake.csv")
        assert main(["simulate", "bookcase-5-shelf", shake, "--law", "housner", "--e", e, "--out", str(tmp_path)]) == 0
        assert ("restitution below 0.3" in " ".join(capsys.readouterr().out.split())) == (e == "0.09")


@pytest.mark.slow
class TestCommands:
    def test_motions_names_them(self, tmp_path, capsys):
        write(tmp_path)
        assert main(["motions", str(tmp_path / "shake.csv"), "--out", str(tmp_path / "figures")]) == 0
        assert re.search("note: .*offset.* 13", capsys.readouterr().out)
        assert main(["motions", str(tmp_path / "shake.csv"), "--json", "--out", str(tmp_path / "figures")]) == 0
        assert "keeps an offset" in json.loads(capsys.readouterr().out)["notes"][0]

    def test_simulate_takes_the_corrections(self, tmp_path, capsys):
        write(tmp_path)
        command = ["simulate", "bookcase-5-shelf", str(tmp_path / "shake.csv"), "--out", str(tmp_path / "one")]
        assert main(command) == 0
        assert "keeps an offset" in capsys.readouterr().out
        assert main([*command, "--set", "baseline_order=1"]) == 0
        assert "keeps an offset" not in capsys.readouterr().out


NARROW = """
title = "One spectrum"
{top}
[[blocks]]
catalogue = "bookcase-5-shelf"
[[models]]
law = "housner"
[motions]
generator = "clough-penzien"
number = 50
duration_s = 20
dt_s = 0.02
{keys}
[ida]
levels = {{ from = 1.0, to = 8.0, number = 4, unit = "m/s2" }}
{hazard}
"""
HAZARD = '[hazard]\nk0 = 1e-4\nk = 2.5\nunit = "g"'


class TestSpectra:
    def study(self, folder, top="", keys="", hazard=""):
        return study_in(folder, NARROW.format(top=top, keys=keys, hazard=hazard))

    def check(self, study):
        return check_of(study.run(), "variety of spectra")

    @pytest.mark.slow
    def test_one_spectrum_is_noted_and_decides_about_rates(self, tmp_path):
        study = self.study(tmp_path)
        (doubt,) = study.doubts
        assert doubt.kind == "spectra"
        assert "omega_g_dispersion" in doubt.sentence
        assert self.check(study).word == CARE
        rated = self.check(self.study(tmp_path, hazard=HAZARD))
        assert rated.word == INVALID
        assert rated.more["rates"]

    def test_it_is_no_doubt_in_sizes_and_records(self, tmp_path):
        assert looks(self.study(tmp_path).run()).word == GOOD

    @pytest.mark.parametrize(("hazard", "word"), [("", GOOD), (HAZARD, CARE)])
    def test_accepted(self, tmp_path, hazard, word):
        study = self.study(tmp_path, top='accept = ["spectra"]', hazard=hazard)
        assert without_sources(study.notes) == []
        check = self.check(study)
        assert check.word == word
        assert check.what == "motion.spectra_accepted"

    def test_a_ground_that_varies_cures_it(self, tmp_path):
        study = self.study(tmp_path, keys="omega_g_dispersion = 0.5\nxi_g_dispersion = 0.6", hazard=HAZARD)
        assert without_sources(study.notes) == []
        check = self.check(study)
        assert check.word == GOOD

    def test_single_motions_are_not_compared(self, tmp_path):
        assert self.check(tp.Study.from_toml(write(tmp_path))).word == UNKNOWN

    @pytest.mark.slow
    def test_few_motions_may_be_far_by_chance(self, tmp_path):
        """Matched to the model, eight motions of one in six seeds have a median beyond 1.5 times: that is no doubt."""
        keys = (
            'generator = "site-based-scenario"\nmagnitude = 7.0\ndistance_m = 20000\nvs30_m_s = 760\nmatch_gmm = true'
        )
        doubted = []
        for seed in range(12):
            text = NARROW.format(top="", keys=f"seed = {seed}", hazard="").replace('generator = "clough-penzien"', keys)
            text = text.replace("number = 50\nduration_s = 20\ndt_s = 0.02", "number = 8\ndt_s = 0.02")
            doubted += study_in(tmp_path, text.partition("[ida]")[0] + "[cloud]\n").doubts
        assert len(doubted) <= 1


class TestUses:
    """What a helper who tried to fool the inputs found."""

    def test_a_vertical_component_is_named(self, tmp_path):
        path = write(tmp_path, keys="baseline_order = 1")
        rows = "".join(f"{i * DT:.2f},{math.sin(0.3 * i):.6f},{math.sin(0.2 * i):.6f}\n" for i in range(400))
        (tmp_path / "shake.csv").write_text(f"time (s),NS (m/s2),UD (m/s2)\n{rows}", encoding="utf-8")
        (doubt,) = (doubt for doubt in tp.Study.from_toml(path).doubts if doubt.kind == "vertical")
        assert "(shake UD (m/s2))" in doubt.sentence
        text = path.read_text(encoding="utf-8").replace("baseline_order", 'component = "h1"\nbaseline_order')
        path.write_text(text, encoding="utf-8")
        with pytest.raises(StudyError, match="has no second horizontal component"):
            tp.Study.from_toml(path)

    def test_what_is_left_of_a_constant_is_no_record(self, tmp_path):
        path = write(tmp_path, keys="baseline_order = 0")
        rows = "".join(f"{i * DT:.2f},0.3\n" for i in range(500))
        (tmp_path / "shake.csv").write_text(f"time (s),acceleration (m/s2)\n{rows}", encoding="utf-8")
        with pytest.raises(StudyError, match="cannot be scaled"):
            tp.Study.from_toml(path)

    def test_no_cure_that_was_taken(self, tmp_path):
        path = write(tmp_path, keys="baseline_order = 1\nwindow = [0.3, 0.6]")
        found = [one.sentence for one in tp.Study.from_toml(path).doubts]
        assert found
        assert not any("removes" in one for one in found)
        assert any("after the corrections" in sentence for sentence in found)

    @pytest.mark.slow
    def test_stripes_of_the_same_records(self, tmp_path, capsys):
        path = write(tmp_path, keys="baseline_order = 1")
        stripes = "".join(
            f"[[stripes.at]]\nlevel = {level}\nmotions = {{ {keys} }}\n"
            for level, keys in ((0.1, "taper_s = 0.5"), (0.3, "taper_s = 0.5"), (0.5, "taper_s = 1.0"))
        )
        text = path.read_text(encoding="utf-8").partition("[ida]")[0]
        path.write_text(f'{text}[stripes]\nim = "pga"\nunit = "g"\n{stripes}', encoding="utf-8")
        assert main(["motions", str(path), "--out", str(tmp_path / "figures"), "--json"]) == 0
        assert json.loads(capsys.readouterr().out)["motions"] == ["shake", "shake (stripe 3)"]
