"""The faults that tests must find still apply, and the README lists them; `tests/faults/find.py` runs the search."""

import csv

import pytest
from faults import FIELDS, FOLDER, HEADING, NAME, README, ROOT, Fault, faults, read, table

FAULTS = faults()


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_it_applies(fault):
    """A rebuilt file keeps the meaning of its fault: the patch is rewritten, never dropped."""
    text = (ROOT / fault.place).read_text("utf-8")
    changed = fault.applied(text)
    assert changed != text
    compile(changed, fault.place, "exec")
    assert fault.lines()


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_its_header_is_whole(fault):
    assert {*fault.header} - {"Changed"} == {*FIELDS}
    assert all(value.strip() for values in fault.header.values() for value in values)
    assert all(len(fault.header[field]) == 1 for field in FIELDS[:3])
    assert fault.header["Chosen"][0] in ("lot", "hand")


def test_tests_that_find_faults_exist():
    for fault in FAULTS:
        for test in fault.header["Found by"]:
            if "::" in test:
                file, *_, function = test.split("::")
                assert f"def {function}(" in (ROOT / "tests" / file).read_text("utf-8"), (fault.name, test)


def test_tests_of_mended_mistakes_exist():
    """`faults.csv`: what outsiders found wrong without a word, or misleading, and the test that holds each."""
    with (ROOT / "tests/faults.csv").open(encoding="utf-8", newline="") as table:
        tests = [row["test"] for row in csv.DictReader(table) if "::" in row["test"]]
    assert len(tests) > 30
    for test in tests:
        file, *classes, function = test.split("::")
        lines = (ROOT / "tests" / file).read_text("utf-8").splitlines()
        assert any(line.startswith(f"{'    ' * len(classes)}def {function}(") for line in lines), test
        assert all(any(line.startswith(f"class {name}:") for line in lines) for name in classes), test


def test_sixty_are_numbered_without_gaps():
    names = [NAME.fullmatch(fault.path.name) for fault in FAULTS]
    assert [int(name[1]) for name in names] == list(range(1, len(names) + 1))
    assert len(names) >= 60
    assert len({name[2] for name in names}) == len(names)
    packages = [fault.place.partition("/")[0] for fault in FAULTS]
    assert {package: packages.count(package) for package in packages}.items() >= {
        "motions": 15,
        "fragility": 22,
    }.items()
    assert packages.count("studies") >= 22


def test_the_readme_lists_them():
    _, heading, rows = README.read_text("utf-8").partition(HEADING)
    assert heading + rows == table(FAULTS)


def test_a_patch_of_changed_code_is_seen(tmp_path):
    fault = read(FOLDER / "01_station_value_lost.patch")
    text = (ROOT / fault.place).read_text("utf-8")
    with pytest.raises(ValueError, match="applies to 0 places"):
        fault.applied(fault.applied(text))
    with pytest.raises(ValueError, match="applies to 2 places"):
        fault.applied(text + text)
    copy = Fault(tmp_path / fault.path.name, *fault[1:])
    copy.path.write_bytes(fault.path.read_bytes())
    copy.record(["a.py::test", "none"])
    assert read(copy.path)._replace(path=fault.path) == fault._replace(
        header={**fault.header, "Found by": ["a.py::test", "none"]}
    )
