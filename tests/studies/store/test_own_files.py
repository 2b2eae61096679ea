"""Folders that are written again: what is stale goes, and what is not ours stays as it is."""

import json
import re

import pytest

from toppling.studies.store import outputs
from toppling.studies.store.outputs import RECORD, own_files
from toppling.studies.text.error import StudyError

NAMES = ("a.csv", "b.csv", "c.csv")


def write(folder, *names, command="one", text="x", allowed=NAMES):
    with own_files(folder, command, allowed):
        for name in names:
            (folder / name).write_text(text, encoding="utf-8")


def stop_after(folder, *names):
    with own_files(folder, "one", NAMES):
        for name in names:
            (folder / name).write_text("y", encoding="utf-8")
        raise RuntimeError


def there(folder):
    return {path.name for path in folder.iterdir()} - {RECORD}


def test_only_what_the_last_run_wrote(tmp_path):
    write(tmp_path / "out", "a.csv", "b.csv")
    for _ in range(2):  # (the same bytes again)
        write(tmp_path / "out", "b.csv", "c.csv", text="y")
        assert there(tmp_path / "out") == {"b.csv", "c.csv"}


def test_files_of_others_stay(tmp_path):
    (tmp_path / "mine.csv").write_text("mine", encoding="utf-8")
    write(tmp_path, "a.csv")
    write(tmp_path, "x.csv", command="another", allowed=["x.csv"])
    write(tmp_path, "b.csv")
    assert there(tmp_path) == {"mine.csv", "x.csv", "b.csv"}


@pytest.mark.parametrize("name", ["a.csv", "c.csv"])
def test_a_file_that_is_not_ours(name, tmp_path):
    (tmp_path / name).write_text("mine", encoding="utf-8")
    with pytest.raises(StudyError, match=rf"{re.escape(name)}: was not written by toppling"):
        write(tmp_path, "a.csv")
    assert {path.name: path.read_text(encoding="utf-8") for path in tmp_path.iterdir()} == {name: "mine"}


def test_a_file_that_was_changed(tmp_path):
    write(tmp_path, "a.csv", "b.csv")
    (tmp_path / "b.csv").write_text("changed", encoding="utf-8")
    with pytest.raises(StudyError, match=r"b[.]csv: was not written by toppling, or was changed since"):
        write(tmp_path, "a.csv")
    assert (tmp_path / "b.csv").read_text(encoding="utf-8") == "changed"


def test_a_link_or_a_folder_is_not_ours(tmp_path):
    (tmp_path / "target").write_text("mine", encoding="utf-8")
    ours = tmp_path / "out" / "a.csv"
    write(tmp_path / "out", "a.csv")
    for make in (lambda: ours.symlink_to(tmp_path / "target"), ours.mkdir):
        ours.unlink()
        make()
        with pytest.raises(StudyError, match="not written by toppling"):
            write(tmp_path / "out", "b.csv")


def test_an_error_while_writing(tmp_path):
    """Nothing is removed, and what was written is still ours."""
    write(tmp_path, "a.csv", "b.csv")
    with pytest.raises(RuntimeError):
        stop_after(tmp_path, "c.csv")
    assert there(tmp_path) == {"a.csv", "b.csv", "c.csv"}
    write(tmp_path, "c.csv")
    assert there(tmp_path) == {"c.csv"}


def test_a_record_that_cannot_be_read(tmp_path):
    """It is not taken for none, after which files of ours would be those of others."""
    (tmp_path / RECORD).mkdir()
    with pytest.raises(StudyError, match=rf"{re.escape(RECORD)}: cannot be read \("):
        write(tmp_path, "a.csv")
    assert there(tmp_path) == set()


def test_the_first_error_counts(tmp_path, monkeypatch):
    """A disk that fails refuses the files to the record, too."""

    def refuse(path):
        raise StudyError(f"{path}: cannot be read")

    monkeypatch.setattr(outputs, "file_digest", refuse)
    with pytest.raises(RuntimeError):
        stop_after(tmp_path, "a.csv")
    monkeypatch.undo()
    write(tmp_path, "b.csv")  # (what was written remains ours)
    assert there(tmp_path) == {"b.csv"}


def test_an_error_leaves_no_new_folder(tmp_path):
    with pytest.raises(RuntimeError):
        stop_after(tmp_path / "new")
    assert not (tmp_path / "new").exists()


def test_a_run_that_was_killed(tmp_path):
    """Its record has no digests yet: files of these names are ours."""
    (tmp_path / RECORD).write_text(json.dumps({"one": dict.fromkeys(NAMES, "")}), encoding="utf-8")
    (tmp_path / "a.csv").write_text("half", encoding="utf-8")
    write(tmp_path, "b.csv")
    assert there(tmp_path) == {"b.csv"}


@pytest.mark.parametrize("text", ["", "[]", "{", '{"one": 1}', "null", '{"one": {"../a": "x"}}'])
def test_a_damaged_record(text, tmp_path):
    (tmp_path / RECORD).write_text(text, encoding="utf-8")
    (tmp_path / "a.csv").write_text("mine", encoding="utf-8")
    with pytest.raises(StudyError, match="not written by toppling"):
        write(tmp_path, "b.csv")
    (tmp_path / "a.csv").unlink()
    write(tmp_path, "b.csv")
    assert there(tmp_path) == {"b.csv"}


def test_a_file_in_place_of_the_folder(tmp_path):
    (tmp_path / "out").write_text("", encoding="utf-8")
    with pytest.raises(StudyError, match="cannot be made a folder"):
        write(tmp_path / "out", "a.csv")
