"""A dropped table as cells: the file written from it is read as the dropped file, or refused at the same cell."""

import datetime
import io
import warnings

import pytest

from toppling.studies.inventory.reading import example_path, read_inventory
from toppling.studies.inventory.sheet import Sheet
from toppling.studies.text.error import StudyError

HEADINGS = ["item", "width_m", "height_m", "floor", "count", "value", "currency", "consequence", "anchored", "mass_kg"]
LINES = [
    ["a", 0.4, 1.8, 0, 2, 1.234, "EUR", "injury", "no", 120.5],
    ["b", 0.4, 1.125, 1, 1, 500, "EUR", "injury", False, 1.125],
]


def workbook(change=lambda sheet: None, rows=(HEADINGS, *LINES)):
    """The bytes of a workbook of some rows, changed by `change`."""
    openpyxl = pytest.importorskip("openpyxl")
    book, content = openpyxl.Workbook(), io.BytesIO()
    for row in rows:
        book.active.append(row)
    change(book.active)
    book.save(content)
    return content.getvalue()


def read(folder, name, content):
    """What the reader makes of a file: the inventory, or its refusal without the name of the file."""
    (folder / name).write_bytes(content)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return read_inventory(folder / name)
    except StudyError as error:
        return str(error).removeprefix(str(folder / name))


def set_cell(at, value=None, number_format=None, kind=None):
    """Return a change of one cell of a workbook."""

    def change(sheet):
        if value is not None:
            sheet[at] = value
        if number_format is not None:
            sheet[at].number_format = number_format
        if kind is not None:
            sheet[at].data_type = kind

    return change


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("example.csv", open(example_path(), "rb").read()),  # noqa: SIM115
        ("decimals.csv", "item;width_m;height_m;floor\nä;0,4;1,8;0\n".encode()),
        ("quoted.csv", b'item,catalogue,floor\n"#3 rack",bookcase-5-shelf,0\n'),
        ("tabs.csv", b"item\tcatalogue\tfloor\r\na, b\tbookcase-5-shelf\t0\r\n"),
    ],
)
def test_a_text_is_read_as_it_was(tmp_path, name, content):
    sheet = Sheet.read(name, content)
    assert read(tmp_path, "page.csv", sheet.content) == read(tmp_path, name, content)
    assert Sheet.read("page.csv", sheet.content) == sheet._replace(doubts=[])


@pytest.mark.parametrize(
    "change", [lambda sheet: None, set_cell("F2", number_format='0.0 "€"'), set_cell("B3", number_format='0.0" m"')]
)
def test_a_workbook_is_read_as_it_was(tmp_path, change):
    """A number of a workbook such as 1.234 is no thousands, which the same text may be."""
    content = workbook(change)
    sheet = Sheet.read("table.xlsx", content)
    assert read(tmp_path, "page.csv", sheet.content) == read(tmp_path, "table.xlsx", content)


@pytest.mark.parametrize(
    ("change", "cell"),
    [
        (lambda sheet: sheet.merge_cells("H2:H3"), (0, "consequence")),
        (set_cell("B3", number_format='0.0" cm"'), (1, "width_m")),
        (set_cell("H2", datetime.date(2020, 1, 1)), (0, "consequence")),
        (set_cell("F2", "=1+1"), (0, "value")),
        (set_cell("G2", "#REF!", kind="e"), (0, "currency")),
        (set_cell("F2", number_format='0.0 "$"'), (0, "value")),
        (set_cell("A2", "=A1"), (0, "item")),
    ],
)
def test_what_a_workbook_alone_can_say_is_refused_at_its_cell(tmp_path, change, cell):
    """As text it would pass: a merged consequence, a width in another unit, an amount in another currency."""
    content = workbook(change)
    sheet = Sheet.read("table.xlsx", content)
    assert isinstance(read(tmp_path, "table.xlsx", content), str)
    refusal = read(tmp_path, "page.csv", sheet.content)
    line, column = cell
    at = sheet.headings.index(column)
    assert sheet.place(refusal) == (line, f"{line}-{at}"), refusal
    mended = sheet.edited(
        str(line), str(at), {"consequence": "injury", "width_m": "0.4", "currency": "EUR"}.get(column, "1")
    )
    assert not isinstance(read(tmp_path, "page.csv", mended.content), str)


def test_all_amounts_of_mixed_currencies_are_refused(tmp_path):
    """Not only the first: after this is mended, the second still says it."""

    def change(sheet):
        set_cell("F2", number_format='0.0 "€"')(sheet)
        set_cell("F3", number_format='0.0 "$"')(sheet)

    sheet = Sheet.read("table.xlsx", workbook(change))
    at = HEADINGS.index("value")
    assert sheet.place(read(tmp_path, "page.csv", sheet.content)) == (0, f"0-{at}")
    mended = sheet.edited("0", str(at), "1.2340")
    assert sheet.place(read(tmp_path, "page.csv", mended.content)) == (1, f"1-{at}")


def test_hidden_rows_are_told():
    sheet = Sheet.read("table.xlsx", workbook(lambda sheet: setattr(sheet.row_dimensions[3], "hidden", True)))
    assert sheet.doubts == ["table.xlsx: hidden row 3 is read, too"]


@pytest.mark.parametrize(
    ("content", "cell"),
    [
        (b"item,Width,height_m,floor\na,0.4,1.8,0\n", (None, "h-1")),
        (b"item,catalogue,floor\na,bookcase-5-shelf,0\nTotal,,\n", (1, "1-0")),
        (b'item,catalogue,floor\n"a\nb",bookcase-5-shelf,0\n', (0, "0-0")),
        (b"item,catalogue,floor\na,bookcase-5-shelf,0,9\n", (0, "0-")),
        (b"item,catalogue,floor\na,bookcase-5-shelf,9\n", (0, "0-2")),
        (b"item,catalogue,floor\n", (None, "")),
    ],
)
def test_the_place_of_a_refusal(tmp_path, content, cell):
    sheet = Sheet.read("table.csv", content)
    (tmp_path / "page.csv").write_bytes(sheet.content)
    with pytest.raises(StudyError) as caught:
        read_inventory(tmp_path / "page.csv", ["0", "1"])
    assert sheet.place(str(caught.value).removeprefix(str(tmp_path / "page.csv"))) == cell


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"a\0b",
        "ä".encode("latin-1"),
        b"PK\3\4junk",
        b"level,rate\n1,2\n",
        b"item,item\na,b\n",
        b'item,floor\n"a,0\n',
    ],
)
def test_a_file_without_cells_is_one_sentence(content):
    for name in ("table.csv", "table.xlsx"):
        with pytest.raises(StudyError) as caught:
            Sheet.read(name, content)
        assert "\n" not in str(caught.value)


def test_lines_and_columns():
    sheet = Sheet.read("table.csv", b"item,catalogue,floor\na,bookcase-5-shelf,0\nb,bookcase-5-shelf,1\n")
    assert sheet.edited("0", "", None).lines == sheet.lines[1:]
    emptied = sheet
    for column in range(3):
        emptied = emptied.edited("0", str(column), "")
    assert emptied.lines == sheet.lines[1:]
    wider = sheet.edited("h", "3", "count").edited("1", "3", " 4 ")
    assert (wider.headings[3], wider.lines) == ("count", [sheet.lines[0], [*sheet.lines[1], "4"]])
    ticked = sheet.with_text(1, "anchored", "yes")
    assert sheet.differences(ticked, ("anchored", "floor")) == {1: {"anchored": "yes"}}
    for line, column, text in (
        *(("9", "0", "x"), ("0", "9", "x"), ("x", "0", "x"), ("0", "", "x"), ("-1", "0", "x")),
        *(("h", "0", "floor"), ("0", "0", "x" * 201), ("0", "1e3", "x"), ("9", "", None)),
    ):
        with pytest.raises(StudyError):
            sheet.edited(line, column, text)
