"""`toppling new`: each study runs as it is, the workbook is the CSV, and nothing that is there is touched."""

import errno
import json
import re
import shlex
import shutil
import tomllib
from pathlib import Path

import openpyxl
import pytest
import xarray as xr

import toppling as tp
from toppling.core.units import STANDARD_GRAVITY
from toppling.fragility.validity.scenes import scene_facts
from toppling.studies import StudyError, read_inventory
from toppling.studies.command import starters
from toppling.studies.command.cli import main
from toppling.studies.file.schema import StudyFile

KINDS = {
    "bookcase": {"study.toml", "records"},
    "hazard": {"study.toml", "hazard.csv", "disaggregation.csv"},
    "inventory": {"study.toml", "inventory.csv", "inventory.xlsx", "hazard.csv", "records"},
    "records": {"study.toml", "records"},
    "scenario": {"study.toml", "inventory.csv", "inventory.xlsx"},
}
OF_HAZARD = ["hazard.csv: a comment calls the curve invented: replace it by the site's own"]
INVENTED = {"hazard": OF_HAZARD, "inventory": OF_HAZARD}
SEED = re.compile(r"(?m)^number = \d+")


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """Each starter in a folder of its own, as the command writes it."""
    folder = tmp_path_factory.mktemp("new")
    for kind in KINDS:
        assert main(["new", kind, str(folder / kind)]) == 0
    return folder


def contents(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("kind", KINDS)
class TestEach:
    def test_says_what_it_wrote_and_what_comes_next(self, kind, tmp_path, monkeypatch, capsys):
        monkeypatch.chdir(tmp_path)
        assert main(["new", kind, "of us/mine"]) == 0
        files, replace, following = capsys.readouterr().out.splitlines()
        assert {one.name for one in Path("of us/mine").iterdir()} == KINDS[kind]
        assert [one.name for one in Path("of us").iterdir()] == ["mine"]
        for name in KINDS[kind]:
            assert name in files
        assert replace.startswith("replace these invented inputs: ")
        assert shlex.split(following)[1:] == ["toppling", "run", "of us/mine/study.toml", "--out", "of us/mine/results"]

    def test_the_same_bytes_again(self, kind, written, tmp_path):
        """In an empty folder that was there, too."""
        assert main(["new", kind, str(tmp_path)]) == 0
        assert contents(tmp_path) == contents(written / kind)

    @pytest.mark.slow
    def test_runs_as_it_is(self, kind, written, tmp_path, capsys):
        """Unchanged but for fewer motions: the study finishes, its results are valid and its notes expected."""
        folder = shutil.copytree(written / kind, tmp_path / kind)
        study = folder / "study.toml"
        if kind != "hazard":  # (of fewer candidates some stripes do not agree with the hazard)
            study.write_text(SEED.sub("number = 40", study.read_text(encoding="utf-8")), encoding="utf-8")
        assert main(["run", str(study), "--out", str(folder / "results")]) == 0
        said = capsys.readouterr()
        assert said.err == ""
        assert "validity: not valid" not in said.out
        with xr.open_dataset(folder / "results/results.nc") as results:
            doubts = json.loads(results.attrs.get("doubts", "[]"))
            assert [sentence for _, sentence, _ in doubts] == INVENTED.get(kind, [])
            for word in ("motions are few", "scenario lies outside", "not of the strength", "squat", "scaled by"):
                assert word not in results.attrs["notes"]
        assert main(["report", str(folder / "results"), "--format", "md"]) == 0

    @pytest.mark.slow
    def test_as_it_is_with_all_of_its_motions(self, kind, written):
        plan = tp.Study.from_toml(written / kind / "study.toml")
        # (the model of a wall and a kit has limits of its own)
        assert [fact for fact in plan.facts if fact.what not in ("input.doubt", "motion.taken", "hazard.given")] == (
            scene_facts(plan.blocks) if kind == "bookcase" else []
        )
        assert [doubt.sentence for doubt in plan.doubts] == INVENTED.get(kind, [])
        assert plan.work < 400_000  # runs: seconds

    def test_every_key_of_its_comments_exists(self, kind, written):
        """A line of settings behind # is still a study when the # goes."""
        text = (written / kind / "study.toml").read_text(encoding="utf-8")
        # (settings that stand at the beginning of a comment's line, tables of them included)
        bare, n = re.subn(r"(?m)^# (?=\[\w+\]$|\w+ = )", "", text)
        assert n == {"bookcase": 2, "hazard": 0, "inventory": 1, "records": 6, "scenario": 0}[kind]
        StudyFile.model_validate(tomllib.loads(bare))

    def test_a_folder_that_is_not_empty(self, kind, tmp_path, capsys):
        (tmp_path / "notes.txt").write_text("mine")
        assert main(["new", kind, str(tmp_path)]) == 2
        assert "is not empty" in capsys.readouterr().err
        assert contents(tmp_path) == {"notes.txt": b"mine"}

    @pytest.mark.slow
    def test_all_or_nothing(self, kind, tmp_path, monkeypatch, capsys):
        """The disk is full in the midst of it: no folder, or the empty one that was there."""

        def full(*_):
            raise OSError(28, "No space left on device")

        if kind in ("bookcase", "hazard"):
            monkeypatch.setattr(starters.shutil, "copyfile", full)
        else:
            monkeypatch.setattr(starters, "write_at2" if kind == "records" else "workbook_of", full)
        (tmp_path / "there").mkdir()
        for folder in ("new", "there"):
            assert main(["new", kind, str(tmp_path / folder)]) == 2
            assert "(No space left" in capsys.readouterr().err
        assert [one.name for one in tmp_path.iterdir()] == ["there"]
        assert list((tmp_path / "there").iterdir()) == []


def test_a_file_that_exists(tmp_path, capsys):
    path = tmp_path / "office"
    path.write_text("mine")
    (tmp_path / "link").symlink_to(tmp_path / "nowhere")
    for name in ("office", "link"):
        assert main(["new", "inventory", str(tmp_path / name)]) == 2
        assert "file of that" in capsys.readouterr().err
    assert main(["new", "inventory", str(path / "below")]) == 2
    assert "cannot be written" in capsys.readouterr().err
    assert path.read_text() == "mine"
    assert len(list(tmp_path.iterdir())) == 2


def test_a_new_folder_is_not_read_again(tmp_path, monkeypatch):
    """Its study is whole: a disk that refuses to list it is no failure."""
    listed = Path.iterdir

    def refuse(path):
        if path == tmp_path / "fresh":
            raise PermissionError(errno.EACCES, "Permission denied", str(path))
        return listed(path)

    monkeypatch.setattr(Path, "iterdir", refuse)
    assert starters.write_starter("hazard", tmp_path / "fresh")[0] == "study.toml"


def test_what_comes_in_between_is_kept(tmp_path, monkeypatch, capsys):
    """Somebody writes a file of the same name into the empty folder meanwhile."""
    fill = starters._fill

    def slowly(kind, staged):
        fill(kind, staged)
        (tmp_path / "inventory.csv").write_text("mine")

    monkeypatch.setattr(starters, "_fill", slowly)
    assert main(["new", "inventory", str(tmp_path)]) == 2
    assert "inventory.csv: there is" in capsys.readouterr().err
    assert contents(tmp_path) == {"inventory.csv": b"mine"}


def test_the_workbook_is_the_table(written):
    folder = written / "inventory"
    assert read_inventory(folder / "inventory.xlsx") == read_inventory(folder / "inventory.csv")
    sheet = openpyxl.load_workbook(folder / "inventory.xlsx")["inventory"]
    rows = [row for row in sheet.iter_rows(values_only=True) if not str(row[0]).startswith("#")]
    header, *lines = rows
    # (numbers are numbers, or a spreadsheet could not calculate with them)
    assert all(isinstance(line[header.index("value")], int) for line in lines)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "im", "lowest", "highest"),
    [
        ("bookcase", "pgv", 0.1, 1.3),
        ("inventory", "Sa(0.5)", 0.2 * STANDARD_GRAVITY, 2.5 * STANDARD_GRAVITY),
        ("records", "pgv", 0.2, 2.5),
    ],
)
def test_records_are_simulated_and_scaled_by_at_most_five(written, kind, im, lowest, highest):
    """Their factors by hand: a level over the measure of a record, the lowest and the highest in the study's file."""
    paths = sorted((written / kind / "records").iterdir())
    assert len(paths) == 40  # (with fewer than 39 a note says that they are few)
    assert sum(path.stat().st_size for path in paths) < 3e6
    plan = tp.Study.from_toml(written / kind / "study.toml")
    levels = plan.levels if kind == "inventory" else plan.design.levels
    assert (levels.min(), levels.max()) == pytest.approx((lowest, highest))
    for path in paths:
        motion = tp.motions.read(path)
        assert motion.dt == 0.02
        assert path.read_text(encoding="ascii").splitlines()[1].startswith("SIMULATED, NOT RECORDED")
        strength = float(tp.motions.measures(motion, [im])[im].values[0])
        assert highest / strength <= 5.001
        assert lowest / strength >= 0.1999


@pytest.mark.parametrize("kind", KINDS)
def test_all_take_one_law_for_one_reason(kind, written):
    text = (written / kind / "study.toml").read_text(encoding="utf-8")
    models = tomllib.loads(text)["models"]
    assert models == [{"law": "housner", "geometry": "bilinear"}]
    reason = "Housner's law, the field's reference, in the geometry that takes walls, restraints, leans and offset"
    assert reason in text.replace("\n# ", " ")


@pytest.mark.slow
def test_an_inventory_with_all_that_its_law_takes(written, tmp_path):
    """Walls however near, leans and centres of mass off the middle, beside the columns that are there."""
    folder = shutil.copytree(written / "scenario", tmp_path / "scenario")
    study = folder / "study.toml"
    text = study.read_text(encoding="utf-8").replace("inventory.xlsx", "inventory.csv")
    study.write_text(SEED.sub("number = 40", text), encoding="utf-8")
    table = (folder / "inventory.csv").read_text(encoding="utf-8").splitlines()
    start = next(i for i, line in enumerate(table) if not line.startswith("#"))
    more = ["0,,", "5,,", "20,,", ",1,", ",,10", "2,,"]
    table[start] += ",wall_gap_mm,lean_deg,cm_offset_mm"
    rows = [f"{line},{more[i % len(more)]}" for i, line in enumerate(table[start + 1 :])]
    (folder / "inventory.csv").write_text("\n".join([*table[: start + 1], *rows]) + "\n", encoding="utf-8")
    assert len(tp.Study.from_toml(study).inventory) == len(rows)


def test_all_refused_pieces_come_at_once_with_numbers_that_work(tmp_path):
    """10 mm behind 0.4 m × 1.8 m: 0.00556 rad; alpha is atan(0.4/1.8) = 0.2187, so that 0.0254 alpha is met there."""
    motions = '[motions]\ngenerator = "clough-penzien"\nnumber = 2\nduration_s = 4\ndt_s = 0.02\n'
    text = f'title = "t"\n[[models]]\nlaw = "energy-consistent"\n{motions}[performance]\ninventory = "i.csv"\n'
    study, table = tmp_path / "study.toml", tmp_path / "i.csv"
    study.write_text(text, encoding="utf-8")
    rows = "item,width_m,height_m,floor,wall_gap_mm\nfar,0.4,1.8,0,50\nshelf,0.4,1.8,0,10\nclock,0.3,1.8,0,12\n"
    table.write_text(rows, encoding="utf-8")
    with pytest.raises(StudyError) as caught:
        tp.Study.from_toml(study)
    said = str(caught.value)
    assert re.search(r"inventory: 'shelf', 'clock'.*0\.02 ", said)
    assert "'far'" not in said
    assert re.search(r"below 0\.0252.* 21", said)
    for changed, other in ((text.replace('"energy-consistent"', '"energy-consistent"\ndelta = 0.02'), rows),
                           (text, rows.replace(",10\n", ",21\n").replace(",12\n", ",21\n"))):  # fmt: skip
        study.write_text(changed, encoding="utf-8")
        table.write_text(other, encoding="utf-8")
        assert len(tp.Study.from_toml(study).inventory) == 3
