"""Floor histories of a user's own building model: the index that names them, and what is refused in it."""

import numpy as np
import pytest
from check_facts import numbers_in

from toppling.core.doubts import ImplausibleInput
from toppling.core.units import STANDARD_GRAVITY
from toppling.studies.file.floor_index import COLUMNS, LEVELS, read_floor_index

HEAD = "level (g),motion,floor,direction,file\n"


def history(folder, name, samples=40, dt=0.02, first="0"):
    rows = "".join(f"{i * dt:.2f},{i % 7 - 3}\n" for i in range(1, samples))
    (folder / name).write_text(f"time (s),acceleration (m/s2)\n0,{first}\n{rows}", encoding="utf-8")


def index(folder, text):
    (folder / "index.csv").write_text(text, encoding="utf-8")
    return folder / "index.csv"


@pytest.fixture
def folder(tmp_path):
    history(tmp_path, "h.csv")
    history(tmp_path, "long.csv", samples=60)
    history(tmp_path, "coarse.csv", dt=0.04)
    history(tmp_path, "nan.csv", first="nan")
    (tmp_path / "zero.csv").write_text("time (s),acceleration (g)\n0,0\n0.02,0\n0.04,0\n", encoding="utf-8")
    (tmp_path / "wide.csv").write_text(
        "time (s),A 1 (g),A 2 (m/s2)\n0,0.1,1\n0.02,0.2,2\n0.04,0.3,5\n", encoding="utf-8"
    )
    (tmp_path / "bare.txt").write_text("1\n2\n3\n", encoding="utf-8")
    return tmp_path


def line(level="0.1", motion="A", floor="1", direction="x", file="h.csv"):
    return f"{level},{motion},{floor},{direction},{file}\n"


def test_lines_in_any_order(folder):
    text = HEAD + "".join(
        line(level, motion, floor, direction)
        for floor, direction in (("10", "x"), ("2", "Y"), ("2", "x"))
        for level, motion in (("0.4", "C"), ("0.1", "A"), ("0.1", "B"), ("0.4", "D"))
    )
    found = read_floor_index(index(folder, text))
    assert found.levels.tolist() == [0.1, 0.4]
    assert found.unit == "g"
    assert found.names == (("A", "B"), ("C", "D"))
    assert found.supports == (("2", "x"), ("2", "y"), ("10", "x"))
    assert found.floors == ("2", "10")
    assert found.own_motions
    assert found.labels == ("motion 1", "motion 2")
    labels = [record.label for record in found.on("2", "y")]
    assert (labels[0][0], numbers_in(labels[0]), labels[0][-1]) == ("A", [0.1, 2], "y")
    assert [one.partition(" ")[0] for one in labels] == ["A", "B", "C", "D"]
    floors = {str(array["motion"].values[0]): array.sizes["floor"] for array in found.arrays}
    floors = {(name[0], name[-1]): number for name, number in floors.items()}
    assert (floors["A", "x"], floors["D", "y"]) == (2, 1)


def test_the_same_motions_at_every_level_in_another_order(folder):
    text = HEAD + line() + line(motion="B") + line("0.2", "B") + line("0.2", "A")
    said = r"a motion has the same history at two levels \(line 4: h.csv, line 5: h.csv\): give the history of each"
    with pytest.warns(ImplausibleInput, match=said):
        found = read_floor_index(index(folder, text))
    assert found.names == (("A", "B"), ("A", "B"))
    assert not found.own_motions
    assert found.labels == ("A", "B")


def test_columns_of_a_file(folder):
    text = "motion,floor,file,column\nA,1,wide.csv,A 1\nA,2,wide.csv,A 2 (m/s2)\n"
    found = read_floor_index(index(folder, text))
    assert found.unit == ""
    np.testing.assert_allclose(found.on("1", "")[0].acceleration, STANDARD_GRAVITY * np.array([0.1, 0.2, 0.3]))
    np.testing.assert_allclose(found.on("2", "")[0].acceleration, [1.0, 2.0, 5.0])


def test_step_and_unit_of_the_study(folder):
    text = "motion,floor,file\nA,1,bare.txt\n"
    (record,) = read_floor_index(index(folder, text), 0.01, "g").on("1", "")
    assert record.dt == 0.01
    np.testing.assert_allclose(record.acceleration, STANDARD_GRAVITY * np.array([1.0, 2.0, 3.0]))


@pytest.mark.parametrize("column", LEVELS)
def test_units_of_levels(folder, column):
    found = read_floor_index(index(folder, f"{column},motion,floor,file\n0.3,A,1,h.csv\n"))
    assert f"level ({found.unit})" == column


def test_columns_are_documented():
    from pathlib import Path

    import toppling as tp

    page = (Path(tp.__file__).parent / "docs/howto/floor_histories.md").read_text(encoding="utf-8")
    table = page.split("| column | meaning |\n|---|---|\n")[1].partition("\n\n")[0]
    for name in COLUMNS:
        assert f"`{name}`" in table or name in LEVELS
