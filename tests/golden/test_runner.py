"""The runner of the golden corpus shows every kind of change, and only changes."""

import json
import math
import sys
from pathlib import Path

import netCDF4
import numpy as np
import openpyxl
import pytest
from case import Case
from changes import Change, read_changes, sort_out
from compare import Difference, compare_case, visible
from corpus import Rename, cases, renamed_keys, with_old_keys
from run import lay_out, run_sides, show

PAGE = (
    "<html><head><title>x</title></head><body><p>About 16 of 100 <b>fall</b>.</p>"
    "<table><tr><td>a</td><td>1</td></tr></table></body></html>"
)
RATES = "block,rate\na,0.1\nb,0.2\n"


def outcome(folder):
    """What a case left: results, a table, a page, a workbook and two commands, the second of them refused."""
    folder.mkdir()
    with netCDF4.Dataset(folder / "results.nc", "w") as data:
        data.setncattr("title", "Two blocks")
        data.setncattr("processor", folder.name)  # (who computed it is no answer)
        data.createDimension("block", 2)
        median = data.createVariable("median", "f8", ("block",))
        median[:] = [0.5, np.nan]
        median.units = "m s-1"
        data.createVariable("name", str, ("block",))[:] = np.array(["a", "b"], dtype=object)
        data.createVariable("overturned", "i1", ("block",))[:] = [0, 1]
    (folder / "rates.csv").write_text(RATES)
    (folder / "report.html").write_text(PAGE)
    workbook = openpyxl.Workbook()
    workbook.active["B2"] = 4
    workbook.save(folder / "table.xlsx")
    (folder / ".1.out").write_text(f"median 0.50 m/s\nresults: {folder}/results.nc\nruns: 7 of 7, {folder.name} s\n")
    (folder / ".1.err").write_text("")
    (folder / ".2.out").write_text("")
    (folder / ".2.err").write_text("toppling: study.toml: ida.levels: must rise\n")
    (folder / ".done.json").write_text(json.dumps([{"code": 0}, {"code": 2}]))


def results(folder, change):
    with netCDF4.Dataset(folder / "results.nc", "a") as data:
        change(data)


def text(name, old, new):
    def change(folder):
        path = folder / name
        assert old in path.read_text()
        path.write_text(path.read_text().replace(old, new))

    return change


def cell(folder, value=5):
    workbook = openpyxl.load_workbook(folder / "table.xlsx")
    workbook.active["B2"] = value
    workbook.save(folder / "table.xlsx")


CHANGES = {
    "a last digit": (
        lambda folder: results(folder, lambda data: data["median"].__setitem__(0, np.nextafter(0.5, 1.0))),
        "results.nc:median",
    ),
    "a NaN that becomes a number": (
        lambda folder: results(folder, lambda data: data["median"].__setitem__(1, 1.0)),
        "results.nc:median",
    ),
    "a flag": (
        lambda folder: results(folder, lambda data: data["overturned"].__setitem__(0, 1)),
        "results.nc:overturned",
    ),
    "a unit": (
        lambda folder: results(folder, lambda data: data["median"].setncattr("units", "m s-2")),
        "results.nc:median@units",
    ),
    "a name": (lambda folder: results(folder, lambda data: data["name"].__setitem__(0, "c")), "results.nc:name"),
    "a new variable": (
        lambda folder: results(folder, lambda data: data.createVariable("rate", "f8", ("block",))),
        "results.nc:rate",
    ),
    "an attribute": (lambda folder: results(folder, lambda data: data.setncattr("title", "One")), "results.nc:@title"),
    "a lost column": (text("rates.csv", RATES, "block\na\nb\n"), "rates.csv"),
    "another order of rows": (text("rates.csv", "a,0.1\nb,0.2\n", "b,0.2\na,0.1\n"), "rates.csv"),
    "other ends of lines": (text("rates.csv", RATES, RATES.replace("\n", "\r\n")), "rates.csv"),
    "a number that becomes a text": (lambda folder: cell(folder, "4"), "table.xlsx:Sheet!B2"),
    "a sentence": (text("report.html", "16", "17"), "report.html"),
    "a cell": (cell, "table.xlsx:Sheet!B2"),
    "a line of the terminal": (text(".1.out", "0.50", "0.51"), "1 out"),
    "the key of a refusal": (text(".2.err", "ida.levels", "ida.im"), "2 err"),
    "an exit code": (text(".done.json", "2", "1"), "2 exit"),
    "a lost file": (lambda folder: (folder / "rates.csv").unlink(), "rates.csv"),
}


@pytest.fixture
def sides(tmp_path):
    for side in ("old", "new"):
        outcome(tmp_path / side)
    return tmp_path / "old", tmp_path / "new"


def test_equal_outcomes_have_no_difference(sides):
    assert compare_case("a", [], [], *sides) == []


def test_other_words_of_a_refusal_are_no_difference(sides):
    text(".2.err", "must rise", "levels have to rise")(sides[1])
    assert compare_case("a", [], [], *sides) == []


@pytest.mark.parametrize("change", CHANGES)
def test_a_change_is_shown_in_one_line(sides, capsys, change):
    make, item = CHANGES[change]
    make(sides[1])
    differences = compare_case("a", [], [], *sides)
    assert {difference.item for difference in differences} == {item}
    show(differences)
    (line,) = capsys.readouterr().out.splitlines()
    assert item in line


def test_the_size_of_a_difference(sides):
    results(sides[1], lambda data: data["median"].__setitem__(0, 0.5 * (1 + 1e-9)))
    (difference,) = compare_case("a", [], [], *sides)
    assert difference.size == pytest.approx(1e-9, rel=1e-6)
    assert "1 of 2 values" in difference.what


def test_a_lost_column_hides_no_other_change(sides):
    text("rates.csv", RATES, "block\na\nc\n")(sides[1])
    lost, other = compare_case("a", [], [], *sides)
    assert "rate" in lost.what
    assert "b" in other.what


def test_another_order_is_called_so(sides):
    text("rates.csv", "a,0.1\nb,0.2\n", "b,0.2\na,0.1\n")(sides[1])
    (difference,) = compare_case("a", [], [], *sides)
    assert "another order" in difference.what


def test_a_process_that_dies_is_one_difference(sides):
    text(".done.json", "2", '"the process died"')(sides[1])
    (sides[1] / "rates.csv").unlink()
    (sides[1] / ".2.err").unlink()
    (difference,) = compare_case("a", [], [], *sides)
    assert difference.item == "2 exit"


def test_a_dataset_that_was_cut_short_is_compared_as_that(sides):
    """A case cuts its results on both sides, with other bytes; on one side alone that is a difference."""
    for side, length in zip(sides, (300, 310), strict=True):
        (side / "results.nc").write_bytes((side / "results.nc").read_bytes()[:length])
        (difference,) = compare_case("a", [], [], *sides) or [None]
        assert difference is None or (difference.item, difference.what) == ("results.nc", "can be read now")
    assert difference is None


def test_an_attribute_of_numbers_has_a_size(sides):
    for side, value in zip(sides, (1.0, 1.0 + 1e-9), strict=True):
        results(side, lambda data, value=value: data.setncattr("share", value))
    (difference,) = compare_case("a", [], [], *sides)
    assert difference.size == pytest.approx(1e-9, rel=1e-6)


def test_what_a_refusal_must_name(sides):
    text(".2.err", "study.toml: ", "")(sides[1])
    assert compare_case("a", [], ["ida.levels"], *sides) == []
    (difference,) = compare_case("a", [], ["ida.levels", "study.toml"], *sides)
    assert "study.toml" in difference.what


def test_renamed_variables_and_dimensions_are_the_same(sides):
    results(sides[1], lambda data: (data.renameVariable("median", "centre"), data.renameDimension("block", "piece")))
    names = {"median": "centre", "block": "piece"}
    assert compare_case("a", [], [], *sides, lambda name: names.get(name, name)) == []
    assert len(compare_case("a", [], [], *sides)) > 2


def test_the_text_of_a_page():
    assert visible(PAGE) == ["About 16 of 100 fall.", "a | 1"]


class TestChanges:
    ENTRY = Change("Issue", "0e788eb", "studies/*", ["out/results.nc:median*"], "because", largest=1e-6)

    def test_only_what_it_names_is_allowed(self):
        allowed = Difference("studies/a", "out/results.nc:median_lower", 1e-7, "")
        larger, other = allowed._replace(size=1e-5), allowed._replace(item="out/results.nc:rate")
        assert sort_out([allowed, larger, other], [self.ENTRY]) == ([larger, other], [])

    def test_an_entry_that_explains_nothing_is_named(self):
        assert sort_out([], [self.ENTRY]) == ([], [self.ENTRY])

    def test_words_select(self):
        entry = self.ENTRY._replace(items=["report.html"], largest=math.inf, text="half")
        differences = [Difference("studies/a", "report.html", math.inf, what) for what in ("a half", "a third")]
        assert sort_out(differences, [entry]) == ([differences[1]], [])

    def test_an_entry_that_allows_everything_is_refused(self):
        entry = 'issue = "x"\nafter = "y"\nstudies = "*"\nitems = ["*"]\nreason = "z"'
        for more in ("", "largest = 1e300", "text = '→'"):
            with pytest.raises(ValueError, match="everything"):
                read_changes(f"```toml\n[[change]]\n{entry}\n{more}\n```\n")

    def test_a_key_that_it_does_not_have_is_named(self):
        with pytest.raises(ValueError, match="studie"):
            read_changes("```toml\n[[change]]\nstudie = 'x'\n```\n")

    def test_those_of_the_repository_are_read(self):
        assert all(
            change.reason for change in read_changes(Path(__file__).with_name("CHANGES.md").read_text(encoding="utf-8"))
        )


class TestRenamedKeys:
    def test_a_key_by_its_path(self):
        keys = [Rename("blocks.lean", "blocks.lean_deg", "0"), Rename("ida.levels.count", "ida.levels.number", "0")]
        text = "number = 1\n[[blocks]] # {0}\n{0} = 2\n[ida]\nnumber = 3\nlevels = {{ {1} = 4, of = 'number' }}\n"
        assert with_old_keys(text.format("lean_deg", "number"), keys) == text.format("lean", "count").replace(
            "# lean", "# lean_deg"
        )

    def test_a_table(self):
        assert with_old_keys("[pieces.at]\nx = 1\n", [Rename("items", "pieces", "0")]) == "[items.at]\nx = 1\n"

    def test_the_table_is_read(self):
        assert all(rename.old and rename.new and rename.after for rename in renamed_keys())


@pytest.fixture(scope="module")
def ended(tmp_path_factory):
    """The exit codes of cases run in one process, which outlives what they do, and the folder of their outcomes."""
    side = tmp_path_factory.mktemp("sides") / "side"
    corpus = [
        Case("exits", {"x.py": "import sys\nsys.exit(3)"}, [["python", "x.py"]]),
        Case("fails", {"x.py": "1 / 0"}, [["python", "x.py"]]),
        Case("dies", {"x.py": "import os\nos._exit(7)"}, [["python", "x.py"], ["--version"]]),
        Case("version", {}, [["--version"], ["--no-such-option"]]),
        Case("process", {"x.py": "raise SystemExit(4)"}, [["python", "x.py"]], process=True),
    ]
    names = [case.name for case in corpus]
    lay_out(corpus, side, False, lambda after: True)
    run_sides({side: Path(sys.executable)}, names)
    ends = {name: json.loads((side / name / ".done.json").read_text()) for name in names}
    return {name: [end["code"] for end in ends[name]] for name in names}, side


class TestWorker:
    def test_exit_codes(self, ended):
        codes, _ = ended
        assert codes == {
            "exits": [3],
            "fails": ["traceback: ZeroDivisionError"],
            "dies": ["the process died"],
            "version": [0, 2],
            "process": [4],
        }

    def test_what_is_printed(self, ended):
        _, side = ended
        assert (side / "version/.1.out").read_text().strip()
        assert "--no-such-option" in (side / "version/.2.err").read_text()


def test_twins_and_old_keys_are_of_the_old_commit_alone(tmp_path):
    case = Case("a", {"x.py": "new"}, [["python", "x.py"]], twins={"x.py": "old"}, renamed="b")
    for old, content in ((True, "old"), (False, "new")):
        lay_out([case], tmp_path / content, old, lambda after: True)
        assert (tmp_path / content / "a/x.py").read_text() == content


def test_names_of_cases_differ_and_select():
    corpus = cases()
    assert len({case.name for case in corpus}) == len(corpus) > 350
    assert {case.name for case in cases("refused/")} == {case.name for case in corpus if "refused/" in case.name}


def test_inputs_lie_in_the_folder_of_a_case():
    for case in cases():
        assert all(not Path(name).is_absolute() and ".." not in Path(name).parts for name in case.files), case.name
