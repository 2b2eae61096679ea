"""What study files may say: files that include others, and one sentence in a user's words where one is wrong."""

import os
import re
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from check_facts import numbers_in

import toppling as tp
from toppling.motions.readers import patterns
from toppling.motions.readers.patterns import expand
from toppling.studies import StudyError
from toppling.studies.command.cli import main
from toppling.studies.file import include
from toppling.studies.file.analyses import LEVEL_UNITS, LevelsTable
from toppling.studies.file.include import line_of
from toppling.studies.file.motions import motions_table
from toppling.studies.file.schema import StudyFile, read_study_file
from toppling.studies.file.uncertainty import INPUTS, SensitivityTable, UncertaintyTable
from toppling.studies.plan import size

SMALL = """title = "A small study"

[[blocks]]
width_m = 0.5
height_m = 1.2

[[models]]
law = "housner"

[motions]
generator = "clough-penzien"
number = 2
duration_s = 4
dt_s = 0.02
envelope = { kind = "stationary" }

[ida]
im = "pga"
levels = { values = [0.1, 0.2], unit = "g" }
"""


def write(folder, text=SMALL, name="study.toml"):
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def refused(folder, text, name="study.toml"):
    """The sentence that a study file is refused with, without the file's name."""
    path = write(folder, text, name)
    with pytest.raises(StudyError) as caught:
        tp.Study.from_toml(path)
    message = str(caught.value)
    assert message.startswith(str(path)), message
    assert "\n" not in message
    assert len(message) < 400
    return message.removeprefix(str(path)).removeprefix(": ")


def without(*tables):
    """The small study without some of its tables."""
    parts = re.split(r"(?m)^(?=\[)", SMALL)
    return "".join(part for part in parts if not any(part.startswith(f"{table}\n") for table in tables))


def part(table):
    """One table of the small study."""
    return next(one for one in re.split(r"(?m)^(?=\[)", SMALL) if one.startswith(f"{table}\n"))


class TestInclude:
    @pytest.mark.slow
    def test_the_study_is_what_it_would_be_in_one_file(self, tmp_path):
        write(tmp_path, part("[[models]]") + part("[motions]"), "common.toml")
        split = 'include = ["common.toml"]\n' + without("[[models]]", "[motions]")
        one = tp.Study.from_toml(write(tmp_path))
        two = tp.Study.from_toml(write(tmp_path, split, "split.toml"))
        assert two.configuration == one.configuration
        assert two.identity == one.identity
        assert "include" not in two.configuration
        for study, name in ((one, "one"), (two, "two")):
            study.run(tmp_path / name)
        assert (tmp_path / "one/results.nc").read_bytes() == (tmp_path / "two/results.nc").read_bytes()

    def test_keys_of_a_table_are_refined(self, tmp_path):
        write(tmp_path, part("[motions]") + part("[ida]"), "common.toml")
        text = 'include = ["common.toml"]\n' + without("[motions]", "[ida]")
        study = tp.Study.from_toml(write(tmp_path, text + "[motions]\nnumber = 3\nseed = 9\n"))
        assert study.configuration["motions"]["number"] == 3
        assert study.configuration["motions"]["seed"] == 9
        assert study.configuration["motions"]["duration_s"] == 4
        assert study.configuration["motions"]["envelope"] == {"kind": "stationary"}
        # a table in a table is one key: it takes the other's place
        again = text + '[ida]\nlevels = { from = 0.1, to = 0.5, number = 5, unit = "g" }\n'
        assert "values" not in tp.Study.from_toml(write(tmp_path, again)).configuration["ida"]["levels"]

    def test_paths_are_those_of_the_file_that_names_them(self, tmp_path):
        """Records, patterns, inventory, hazard and target, two folders down, and one folder up."""
        shake = tp.motions.CloughPenzien(duration=4.0).sample(1, seed=1)
        write(tmp_path, "x", "far [1]/records/none")
        tp.motions.write_at2(shake, tmp_path / "far [1]" / "records" / "R1.AT2")
        write(tmp_path, "pga (g),rate (1/yr)\n0.1,1e-2\n0.4,1e-3\n", "site.csv")
        write(
            tmp_path,
            '[motions]\nrecords = "records/*.AT2"\n[hazard]\nfile = "../site.csv"\n',
            "far [1]/common.toml",
        )
        text = 'include = ["far [1]/common.toml"]\n' + without("[motions]")
        study = tp.Study.from_toml(write(tmp_path, text))
        assert [str(array.motion.values[0]) for array in study.design.arrays] == ["R1"]
        assert study.risk is not None
        # the same file from another folder: the same study
        other = 'include = ["../far [1]/common.toml"]\n' + without("[motions]")
        assert tp.Study.from_toml(write(tmp_path, other, "near/study.toml")).runs == study.runs

    def test_paths_in_lists_and_of_inventories(self, tmp_path):
        write(
            tmp_path,
            '[performance]\ninventory = "things.csv"\n[motions]\nrecords = ["a.AT2", "/abs/b.AT2"]\n'
            '[[stripes.at]]\nlevel = 1.0\nmotions = { target = "t.csv" }\n[stripes]\nunit = "g"\n',
            "in/common.toml",
        )
        content = include.read_content(write(tmp_path, 'include = ["in/common.toml"]\n'), StudyFile).content
        assert content["performance"]["inventory"] == "in/things.csv"
        assert content["motions"]["records"] == ["in/a.AT2", "/abs/b.AT2"]
        assert content["stripes"]["at"][0]["motions"]["target"] == "in/t.csv"

    def test_what_is_wrong_in_an_included_file_names_it(self, tmp_path):
        write(tmp_path, part("[motions]").replace("number = 2", "number = 0"), "common.toml")
        text = 'include = ["common.toml"]\n' + without("[motions]")
        message = refused(tmp_path, text)
        assert message.startswith("motions.number: ")
        assert "got 0" in message
        assert message.endswith(f"(in {tmp_path / 'common.toml'})")
        # what the study itself refines is its own fault
        write(tmp_path, part("[motions]"), "common.toml")
        message = refused(tmp_path, text + "[motions]\nseed = -1\n")
        assert message.endswith("got -1")

    def test_an_include_of_a_long_name(self, tmp_path):
        """The others: `tests/golden/refused/sentences.toml`."""
        assert refused(tmp_path, f'include = ["{"x" * 3000}"]\n{SMALL}').startswith("include: no file 'xxx")

    def test_an_included_file_that_is_none(self, tmp_path):
        for content, message in (
            ("[motions]\nnumber = \xe4".encode("latin-1"), "common.toml: not a text file in UTF-8"),
            (b"[motions", "common.toml: not valid TOML"),
            (b"#" * (2**20 + 1), "common.toml: larger than 1 MiB"),
        ):
            write(tmp_path, content, "common.toml")
            with pytest.raises(StudyError, match=message):
                tp.Study.from_toml(write(tmp_path, 'include = ["common.toml"]\n' + SMALL))


MESSAGES = [
    (SMALL.replace("number = 2", f"number = {'9' * 5000}"), "not valid TOML: a number that is none"),
    (SMALL.replace("number = 2", f"number = 0x{'f' * 5000}"), "'motions.number' is an integer of more than 64 bits"),
    ("x = " + "[" * 5000 + "]" * 5000, "not valid TOML: nested too deeply"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("text", "message"), MESSAGES, ids=range(len(MESSAGES)))
def test_messages(tmp_path, text, message):
    """Long ones; all others are in `tests/golden/refused/sentences.toml`."""
    assert message in refused(tmp_path, text)


STRIPES = SMALL.replace('[ida]\nim = "pga"\nlevels = { values = [0.1, 0.2], unit = "g" }', '[stripes]\nunit = "g"\n')


class TestStripes:
    def stripes(self, *levels):
        return STRIPES + "".join(f"[[stripes.at]]\nlevel = {level}\n" for level in levels)

    def test_out_of_order_is_said_before_any_work(self, tmp_path, monkeypatch):
        assert tp.Study.from_toml(write(tmp_path, self.stripes(0.1, 0.2))).runs == 4

        def none(*_):
            raise AssertionError("motions were made")

        monkeypatch.setattr(tp.motions.CloughPenzien, "sample", none)
        message = refused(tmp_path, self.stripes(0.1, 0.4, 0.2))
        assert message.startswith("stripes: ")
        assert numbers_in(message) == [0.2, 0.4]
        assert "levels of pga" in refused(tmp_path, self.stripes(0.1).replace('"g"', '"m"'))

    def test_all_stripes_together_are_judged(self, tmp_path, monkeypatch):
        monkeypatch.setattr(tp.motions.CloughPenzien, "sample", None)
        text = self.stripes(0.1, 0.2).replace("number = 2", "number = 250000")
        assert "6.31e+08 samples" in refused(tmp_path, text)

    def test_records_are_judged_as_they_are_read(self, tmp_path, monkeypatch):
        write(tmp_path, "time,acceleration (g)\n" + "".join(f"{i / 50},{i % 2}\n" for i in range(100)), "r.csv")
        text = re.sub(r"(?s)\[motions\].*?(?=\[stripes\])", '[motions]\nrecords = "r.csv"\n', self.stripes(0.1, 0.2))
        assert tp.Study.from_toml(write(tmp_path, text)).runs == 2
        monkeypatch.setattr(size, "MOST_NUMBERS", 150)
        assert numbers_in(refused(tmp_path, text)) == [200, 150, 4]
        monkeypatch.setattr(size, "MOST_NUMBERS", 50)
        message = refused(tmp_path, text)
        assert message.startswith("records ")
        assert numbers_in(message)[:2] == [100, 50]


class TestUnits:
    def records(self, keys):
        return re.sub(r"(?s)\[motions\].*?(?=\[ida\])", f"[motions]\n{keys}\n", SMALL)

    def test_a_table_without_a_unit(self, tmp_path):
        write(tmp_path, "time,acceleration\n0.0,0.0\n0.01,0.2\n0.02,0.0\n", "r.csv")
        message = refused(tmp_path, self.records('records = "r.csv"'))
        assert "r.csv: states no" in message
        study = tp.Study.from_toml(write(tmp_path, self.records('records = "r.csv"\nunit = "g"')))
        assert float(study.design.arrays[0].max()) == pytest.approx(0.2 * 9.80665, rel=1e-12)
        write(tmp_path, "time (s),acceleration (g)\n0.0,0.0\n0.01,0.2\n0.02,0.0\n", "r.csv")
        twice = self.records('records = "r.csv"\nunit = "g"')
        assert "states its unit" in refused(tmp_path, twice)
        assert re.search("unit: .*g, m/s2", refused(tmp_path, twice.replace('"g"', '"m"')))

    @pytest.mark.parametrize(
        ("name", "heading", "keys"),
        [("r.csv", "time,acceleration (g)", 'records = "r.csv"'), ("f.csv", "time,a/1 [g]", 'floors_file = "f.csv"')],
    )
    def test_a_number_that_its_unit_takes_beyond_the_largest(self, tmp_path, name, heading, keys):
        """Found by the fuzzer (mutants 11429 and 19100): 1e308 g is no number in m/s²."""
        write(tmp_path, f"{heading}\n0.0,0.0\n0.01,1e308\n0.02,0.0\n", name)
        assert "got inf at" in refused(tmp_path, self.records(keys))


PERFORMANCE = (
    without("[[blocks]]", "[ida]")
    + """
[building]
kind = "flexural-shear"
period_s = 0.5
storeys = 3

[performance]
inventory = "things.csv"
im = "pga"
levels = { values = [0.1, 0.2], unit = "g" }
"""
)


@pytest.mark.parametrize("unit", ["m/s²", "m/s^2", "m/s**2", "cm/s²", "g", "1"])
def test_spellings_of_the_unit_of_levels(unit):
    levels = LevelsTable(values=[0.1, 0.2], unit=unit)
    assert levels.unit == re.sub(r"²|\^2|\*\*2", "2", unit)
    np.testing.assert_allclose(levels.build("scale" if unit == "1" else "pga")[1], 0.2 * LEVEL_UNITS[levels.unit][0])


def test_units_of_records_and_wrong_ones():
    assert motions_table({"records": "r.csv", "unit": "Gal"}).unit == "gal"
    for unit in ("m/s³", "m²/s", "°", "mm/s²"):
        with pytest.raises(ValueError, match="unit"):
            LevelsTable(values=[0.1, 0.2], unit=unit)


@pytest.mark.parametrize(
    "name", sorted(INPUTS.keys() - {"law", "e", "restitution_factor", "delta", "zeta", "coefficient"})
)
def test_inputs_are_in_their_units_in_both_tables(name):
    """A stiffness of a sensitivity study was taken in N/m instead of N/mm."""
    inputs = {
        "e": {"distribution": "uniform", "lower": 0.8, "upper": 0.9},
        name: {"distribution": "uniform", "lower": 1.1, "upper": 1.2},
    }
    both = SensitivityTable(parameter="e", values=[0.8, 0.9], inputs=inputs), UncertaintyTable(inputs=inputs)
    assert both[0].random_inputs() == both[1].build()
    support = both[1].build().distributions[INPUTS[name]].support
    np.testing.assert_allclose(support, np.array([1.1, 1.2]) * (1000.0 if "per_mm" in name else 1.0))
    if name != INPUTS[name]:
        inputs[INPUTS[name]] = inputs.pop(name)
        table = SensitivityTable(parameter="e", values=[0.8, 0.9], inputs=inputs)
        with pytest.raises(ValueError, match=f"^sensitivity.inputs.{INPUTS[name]}: must be one of .*{name}"):
            table.random_inputs()


class TestInventory:
    THINGS = "item,catalogue,floor\nshelf,bookcase-5-shelf,1\ncase,bookcase-4-shelf,{}\n"

    def test_a_floor_that_the_building_does_not_have(self, tmp_path, monkeypatch):
        write(tmp_path, self.THINGS.format(3), "things.csv")
        assert tp.Study.from_toml(write(tmp_path, PERFORMANCE)).runs == 8
        monkeypatch.setattr(tp.motions.CloughPenzien, "sample", None)  # said before motions are made
        path = write(tmp_path, self.THINGS.format(7), "things.csv")
        with pytest.raises(StudyError) as caught:
            tp.Study.from_toml(write(tmp_path, PERFORMANCE))
        assert str(caught.value).startswith(f"{path}, line 3,")
        assert str(caught.value).endswith("got '7'")

    def test_floor_histories(self, tmp_path):
        write(tmp_path, "time,a/0 [g],a/2 [g]\n" + "".join(f"{i / 50},0.1,{i % 2}\n" for i in range(9)), "f.csv")
        text = re.sub(r"(?s)\[building\].*?(?=\[perf)", "", PERFORMANCE)
        text = re.sub(r"(?s)\[motions\].*?(?=\[perf)", '[motions]\nfloors_file = "f.csv"\n', text)
        write(tmp_path, self.THINGS.format(2).replace("shelf,1", "shelf,0"), "things.csv")
        with pytest.raises(StudyError, match=r"holds for an elastic building alone: say motions\.elastic = true"):
            tp.Study.from_toml(write(tmp_path, text))
        text = text.replace('"f.csv"\n', '"f.csv"\nelastic = true\n')
        assert tp.Study.from_toml(write(tmp_path, text)).runs == 4
        write(tmp_path, self.THINGS.format(2), "things.csv")
        with pytest.raises(StudyError, match="line 2, column 'floor': must be one of 0, 2, got '1'"):
            tp.Study.from_toml(write(tmp_path, text))


class TestFiles:
    def test_what_is_no_file(self, tmp_path):
        with pytest.raises(StudyError, match="cannot be read"):
            read_study_file(tmp_path)
        with pytest.raises(StudyError, match="no such file"):
            read_study_file(tmp_path / "none.toml")
        with pytest.raises(StudyError, match=r"no such file|cannot be read"):
            read_study_file(tmp_path / "a\0b.toml")
        with pytest.raises(StudyError, match="cannot be read"):
            read_study_file(tmp_path / ("x" * 5000))

    def test_a_pipe_or_a_device_is_not_waited_for(self, tmp_path):
        os.mkfifo(tmp_path / "pipe.toml")
        found = []

        def read():
            for path in (tmp_path / "pipe.toml", Path("/dev/zero")):
                try:
                    read_study_file(path)
                except StudyError as error:
                    found.append(str(error))

        reader = threading.Thread(target=read, daemon=True)
        reader.start()
        reader.join(10)
        assert len(found) == 2
        assert all("not a file" in one for one in found)

    def test_patterns_that_would_look_everywhere(self, tmp_path, monkeypatch):
        for i in range(30):
            write(tmp_path, "x", f"{i}/deep/r.AT2")
        assert len(expand("**/*.AT2", tmp_path)) == 30
        monkeypatch.setattr(patterns, "MOST_FILES", 50)
        with pytest.raises(ValueError, match="more than 50 files to look at"):
            expand("*/deep/r.AT2", tmp_path)
        with pytest.raises(ValueError, match="more than 50 files to look at: name a folder further down"):
            expand("**/*.AT2", tmp_path)
        with pytest.raises(ValueError, match=r"\*\* may stand once"):
            expand("**/**/*.AT2", tmp_path)
        assert len(expand("3/deep/*.AT2", tmp_path)) == 1

    @pytest.mark.slow
    def test_a_loop_of_links_ends(self, tmp_path):
        write(tmp_path, "x", "in/r.AT2")
        for name in ("a", "b"):
            (tmp_path / "in" / name).symlink_to(tmp_path / "in")
        start = time.process_time()
        with pytest.raises(ValueError, match="files to look at"):
            expand("**/*.AT2", tmp_path)
        assert time.process_time() - start < 10.0

    def test_a_message_is_one_line_whatever_stands_in_it(self):
        error = StudyError("a\nb\x1b[31m\u202ec" + "x" * 1000 + " the end")
        assert str(error).isprintable()
        assert len(str(error)) == 399
        assert str(error).endswith(" the end")


@pytest.mark.parametrize("text", ["", "x = [", SMALL.replace("number = 2", "number = 0")], ids=["empty", "none", "bad"])
def test_the_command_writes_nothing(tmp_path, text, capsys):
    path = write(tmp_path, text)
    assert main(["run", str(path), "--out", str(tmp_path / "out")]) == 2
    assert capsys.readouterr().err.startswith(f"toppling: {path}: ")
    assert not (tmp_path / "out").exists()


LINES = """title = "t" # line 1

[[blocks]]
name = "a"
[[blocks]]
name = "b"
low = 1
[hazard.nested]
"quoted" = 2
[[uncertainty.cases]]
[[uncertainty.cases]]
deep = 1
inline = { hidden = 3 }
"""


@pytest.mark.parametrize(
    ("location", "line"),
    [
        (("title",), 1),
        (("blocks", 0), 3),
        (("blocks", 1, "name"), 6),
        (("blocks", 0, "low"), 0),
        (("blocks", 1, "low"), 7),
        (("hazard", "nested", "quoted"), 9),
        (("uncertainty", "cases", 1, "deep"), 12),
        (("uncertainty", "cases", 1, "inline", "hidden"), 0),
    ],
)
def test_lines_of_keys(location, line):
    assert line_of(LINES, location) == line


def test_the_line_of_an_unknown_key_and_its_file(tmp_path):
    (tmp_path / "common.toml").write_text('[motions]\ngenerator = "clough-penzien"\nnumbr = 3\n', encoding="utf-8")
    text = SMALL[: SMALL.index("[motions]")] + SMALL[SMALL.index("[ida]") :]
    said = refused(tmp_path, 'include = ["common.toml"]\n' + text.replace("width_m", "widht_m"))
    number = 2 + text[: text.index("width_m")].count("\n")
    assert re.search(rf"'blocks\[1\]\.widht_m'.*'width_m'.*\(line {number}\)", said)
    assert re.search(r"'motions\.numbr'.*'number'.*common\.toml, line 3\)", said)


def test_keys_of_other_kinds_of_study_come_together(tmp_path):
    """Every key that the kind of a study does not have is named, with adaptive levels called by their word."""
    friction = "[friction]\nstatic = 0.4\ntrip_mm = 20\nshared = true\n"
    adaptive = SMALL.replace('levels = { values = [0.1, 0.2], unit = "g" }', 'levels = "adaptive"')
    message = refused(tmp_path, adaptive.replace("height_m = 1.2\n", "height_m = 1.2\ntrip_mm = 10\n") + friction)
    for key in ("friction.trip_mm", "friction.shared", "blocks[1].trip_mm"):
        assert key in message
    assert "levels = 'adaptive'" in message
    right = SMALL + friction.replace("shared = true\n", "")
    assert read_study_file(write(tmp_path, right)).kind == "fragility"
    assert "[friction]" in refused(tmp_path, SMALL.replace("height_m = 1.2\n", "height_m = 1.2\nfriction = 0.3\n"))
