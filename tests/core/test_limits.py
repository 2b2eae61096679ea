"""Files that unfold: each is answered by one sentence before a parser makes objects of it."""

import io
import struct
import time
import zipfile

import netCDF4
import numpy as np
import pytest
from openpyxl import Workbook

import toppling as tp
from toppling.studies import StudyError
from toppling.studies.command.cli import main
from toppling.studies.command.starters import workbook_of
from toppling.studies.file.workbook import WorkbookError, sheet_rows

SHEET, BOOK, STYLES = "xl/worksheets/sheet1.xml", "xl/workbook.xml", "xl/styles.xml"
MERGED, LINKS = "<mergeCells>{}</mergeCells>", "<hyperlinks>{}</hyperlinks>"
PAIR, LINK = '<mergeCell ref="C{0}:D{0}"/>', '<hyperlink location="x" ref="A{}"/>'
NAMED = '<sheet xmlns:r="http://schemas.openxmlformats.org/officeDocument/2006/relationships" name="s{}" r:id="rId1"/>'


def book(part=SHEET, before="", new="", also=()):
    """A small workbook, with something new in one of its parts."""
    made, old = Workbook(), io.BytesIO()
    made.active.append(["name", "width_m"])
    made.active.append(["shelf", 0.4])
    made.save(old)
    changed = io.BytesIO()
    with zipfile.ZipFile(old) as parts, zipfile.ZipFile(changed, "w", zipfile.ZIP_DEFLATED) as file:
        for name in parts.namelist():
            text = parts.read(name).decode()
            assert name != part or before in text
            file.writestr(name, text.replace(before, new + before, 1) if name == part and before else text)
        for name, text in also:
            file.writestr(name, text)
    return changed.getvalue()


def many(text, number):
    return "".join(text.format(i) for i in range(10, 10 + number))


def test_shared_formulas_are_not_written_out():
    """Which takes the reader 45 µs a character; that a cell has a formula without a value is still said."""
    first, other = (
        '<c r="A4"><f ref="A4:A9" t="&#115;hared" si="0">{}1</f></c>',
        "<c r='A{0}'><f t='shared' si='0'/></c>",
    )
    rows = f'<row r="4">{first.format("A1+" * 999)}</row>' + many("<row r='{0}'>" + other + "</row>", 9_000)
    found, *_ = sheet_rows(book(SHEET, "</sheetData>", rows), "inventory", 2**24, 100)
    assert "has a formula without a value" in found[2][1][0].why


def test_sizes_and_names_in_a_directory_that_are_untrue():
    """A part that unfolds to more than it states is read no further; of two parts of a name, the last is read."""
    content = bytearray(book(SHEET, "</worksheet>", " " * 10**7))
    at = content.rfind(b"PK\x01\x02", 0, content.rfind(SHEET.encode()))
    content[at + 24 : at + 28] = (100).to_bytes(4, "little")
    with pytest.raises(WorkbookError, match="or a damaged one"):
        sheet_rows(bytes(content), "inventory", 2**24, 100)


def test_right_workbooks_are_read():
    """With merged cells beside the table."""
    new = MERGED.format(many(PAIR, 500))
    rows, _, _ = sheet_rows(book(SHEET, "<pageMargins", new), "inventory", 2**24, 100)
    assert [cells for _, cells in rows] == [["name", "width_m"], ["shelf", "0.4"]]


@pytest.mark.parametrize("now", [86400.0, 9e9], ids=["1970", "2255"])
def test_workbooks_of_any_clock(monkeypatch, now):
    """A ZIP file stores times from 1980 to 2107 only: clocks without a battery start in 1970."""
    expected = workbook_of("name,width_m\nshelf,0.4\n")
    monkeypatch.setattr(time, "time", lambda: now)
    assert workbook_of("name,width_m\nshelf,0.4\n") == expected
    assert len(sheet_rows(expected, "inventory", 2**24, 100)[0]) == 2


def declared(path, size, kind="f8"):
    with netCDF4.Dataset(path, "w") as file:
        file.createDimension("level", size)
        file.createVariable("level", kind, ("level",), chunksizes=(10**6,))
    return path


@pytest.mark.parametrize(("size", "kind", "gigabytes"), [(10**10, "f8", "80.0"), (3 * 10**8, str, "19.2")])
def test_results_that_declare_more_than_they_hold(size, kind, gigabytes, tmp_path, capsys):
    path = str(declared(tmp_path / "results.nc", size, kind))
    (tmp_path / "other").mkdir()
    other = str(declared(tmp_path / "other/results.nc", size, kind))
    for arguments in (["report", path], ["export", path, "--format", "csv"], ["compare", path, other]):
        assert main(arguments) == 2
        assert f"declares {gigabytes} GB" in " ".join(capsys.readouterr().err.split())


def stored_once(path):
    """Four hundred strings that refer to the same million letters."""
    with netCDF4.Dataset(path, "w") as file:
        file.createDimension("block", 400)
        file.createVariable("block", str, ("block",))[:] = np.array(["a" * 1_000_000] + ["b"] * 399, object)
    content = bytearray(path.read_bytes())
    first = content.find(struct.pack("<I", 1_000_000))
    content[first : first + 6400] = content[first : first + 16] * 400
    path.write_bytes(content)
    return path


def lists(path):
    with netCDF4.Dataset(path, "w") as file:
        file.createVariable("lists", file.createVLType("f8", "list"))
    return path


def chunks(path):
    """A hundred thousand chunks of one number."""
    with netCDF4.Dataset(path, "w") as file:
        file.createDimension("time", 100_000)
        file.createVariable("acceleration", "f8", ("time",), chunksizes=(1,))
    return path


def variables(path):
    with netCDF4.Dataset(path, "w") as file:
        for number in range(2_001):
            file.createVariable(f"v{number}", "i1")
    return path


def classic(path, *numbers):
    """The header of a classic file."""
    path.write_bytes(b"CDF\1" + struct.pack(f">{len(numbers)}I", *numbers) + bytes(1000))
    return path


@pytest.mark.parametrize("table", ["", "[motions]\n"])
def test_tables_of_many_keys(table, tmp_path):
    """Each unknown key is compared with all known keys."""
    path = tmp_path / "study.toml"
    path.write_text(f'title = "x"\n{table}' + "".join(f"b{i} = 2020-01-01\n" for i in range(1001)))
    with pytest.raises(StudyError, match=r"holds 1,00\d entries, allowed are 1,000"):
        tp.Study.from_toml(path)


def test_refused(refusal):
    refusal()
