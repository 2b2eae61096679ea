"""Inventories: what a CSV file or a workbook says, and one sentence where it says something else."""

import csv
import io
import math
import re
import time
import warnings
import zipfile
from datetime import datetime
from pathlib import Path

import numpy as np
import openpyxl
import pytest
import refused_cases
from openpyxl.styles import Font
from openpyxl.worksheet.worksheet import Worksheet

import toppling as tp
from toppling.core.doubts import ImplausibleInput, noted
from toppling.core.facts import Fact
from toppling.studies import StudyError
from toppling.studies.buildings.notes import inventory_notes
from toppling.studies.buildings.pieces import SAFETY
from toppling.studies.facts.say import notes_said
from toppling.studies.inventory.contents import Contents, Inventory, place_doubts
from toppling.studies.inventory.reading import InventoryError, example_path, read_inventory

SHELF = tp.catalogue["bookcase-5-shelf"]
NINE = datetime(2026, 2, 1, 9)

SMALL = """item,catalogue,width_m,height_m,floor,count,e,value,consequence
shelf,bookcase-5-shelf,,,2,3,0.9,400,blocks-exit
crate,,0.5,1.25,0,,,,
"""


def rows_of(text):
    """The lines of a CSV as rows of text; a comment is one cell."""
    return [[line] if line.startswith("#") else next(csv.reader([line]), []) for line in text.splitlines()]


def number(text):
    """A cell of a CSV as a spreadsheet takes it: as a number where it is one."""
    try:
        return float(text)
    except ValueError:
        return text or None


def book_of(rows, path, as_cell=number, change=lambda book: None):
    book = openpyxl.Workbook()
    for i, row in enumerate(rows, start=1):
        for j, cell in enumerate(row, start=1):
            book.active.cell(i, j, as_cell(cell) if isinstance(cell, str) else cell)
    change(book)
    book.save(path)
    return path


def counted(tmp_path, cell):
    """A workbook of two lines, of which the second counts its pieces by a cell."""
    rows = [["catalogue", "floor", "count"], ["bookcase-5-shelf", 1, 3], ["bookcase-4-shelf", 1, cell]]
    return book_of(rows, tmp_path / "i.xlsx")


def formatted(**codes):
    """A change of a workbook: number formats of cells."""

    def change(book):
        for cell, code in codes.items():
            book.active[cell].number_format = code

    return change


def read(tmp_path, text, encoding="utf-8"):
    path = tmp_path / "inventory.csv"
    path.write_bytes(text.encode(encoding) if isinstance(text, str) else text)
    return read_inventory(path)


class TestReading:
    def test_example(self):
        inventory = read_inventory(example_path())
        assert len(inventory) == 14
        assert inventory.pieces == 54
        assert inventory.currency == "EUR"
        assert inventory.consequences == ("blocks-exit", "injury", "release", "medication", "samples", "records")
        assert inventory.value == math.fsum(row.count * row.value for row in inventory.rows)
        assert [row.label for row in inventory.rows if row.anchored] == ["oxygen cylinder"]
        last = inventory.rows[-1]
        assert last.label.startswith("book stack,")
        assert (last.block.width, last.block.height, last.block.h, last.block.inertia) == (0.35, 2.1, 1.25, 1.25)

    def test_the_class_of_a_piece(self, tmp_path):
        file = tmp_path / "inventory.csv"
        file.write_text("item,width_m,height_m,floor,class\na,0.4,1.8,0,shelf\nb,0.4,1.8,0,\n", encoding="utf-8")
        assert [row.piece_class for row in read_inventory(file).rows] == ["shelf", ""]

    def test_columns_and_defaults(self, tmp_path):
        shelf, crate = read(tmp_path, SMALL).rows
        assert shelf == Contents("shelf", tp.Block(SHELF.width, SHELF.height), 2, 3, 0.9, 400.0, ("blocks-exit",))
        assert crate == Contents("crate", tp.Block(0.5, 1.25), 0)
        assert crate.count == 1
        assert crate.e is None
        assert not crate.anchored
        assert crate.anchoring_cost is None

    @pytest.mark.parametrize(
        "text",
        [
            "\ufeff" + SMALL,
            SMALL.replace("\n", "\r\n"),
            SMALL.replace("\n", "\r"),
            SMALL.replace(",", ";"),
            SMALL.replace(",", "\t"),
            SMALL.replace(",", ";").replace(".", ","),
            "# shelves, \"of\" the 'office'\n\n" + SMALL + "\n  # the end\n,,,,,,,,\n",
            SMALL.replace("shelf,bookcase", '"shelf",bookcase').replace("0.9", " 0.9 "),
            SMALL.replace(SMALL.splitlines()[0], SMALL.splitlines()[0].upper()),
            SMALL.replace(",e,", ",restitution,"),
            SMALL.replace("\n", ",\n"),
        ],
        ids=["bom", "crlf", "cr", "semicolons", "tabs", "comma", "comments", "quotes", "capitals", "synonym", "empty"],
    )  # fmt: skip
    def test_the_same_in_other_spellings(self, tmp_path, text):
        assert read(tmp_path, text) == read(tmp_path, SMALL)

    def test_the_same_name_on_several_floors(self, tmp_path):
        found = read(tmp_path, "catalogue,floor\nbookcase-5-shelf,1\nbookcase-5-shelf,2\nwardrobe-double,2\n")
        assert [row.label for row in found.rows] == [
            "bookcase-5-shelf, floor 1",
            "bookcase-5-shelf, floor 2",
            "wardrobe-double",
        ]

    def test_words(self, tmp_path):
        found = read(
            tmp_path, 'width_m,height_m,floor,consequence,anchored\n.4,2,roof," Injury|blocks-exit, injury",Y\n'
        )
        row = found.rows[0]
        assert row.consequences == ("injury", "blocks-exit")
        assert row.anchored
        assert row.floor == "roof"
        assert row.label == "line 2"

    def test_centre_of_mass_beside_a_catalogue_name(self, tmp_path):
        found = read(tmp_path, "catalogue,cm_height_m,inertia_factor,floor\nbookcase-5-shelf,1.0,1.3,0\n")
        assert found.rows[0].block == tp.Block(SHELF.width, SHELF.height, 1.0, 1.3)


BAD_FILES = [
    (
        "catalogue,floor,consequence\n" + "".join(f"bookcase-5-shelf,{i},c{i}\n" for i in range(50)),
        "at most 40 different",
    ),
    ("catalogue,floor\n" + "".join(f"bookcase-5-shelf,{i}\n" for i in range(10_001)), "more than 10,000 lines"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("text", "message"), BAD_FILES, ids=range(len(BAD_FILES)))
def test_bad_files(tmp_path, text, message):
    """Long ones; all others are in `tests/golden/refused/inventories.toml`."""
    with pytest.raises(InventoryError, match=message):
        read(tmp_path, text)


def test_bad_paths(tmp_path):
    with pytest.raises(InventoryError, match="no such file"):
        read_inventory(tmp_path / "none.csv")
    with pytest.raises(InventoryError, match="not a file"):
        read_inventory(tmp_path)
    with pytest.raises(TypeError, match="path must be a path, got int"):
        read_inventory(5)
    big = tmp_path / "big.csv"
    big.write_bytes(b"x" * (16 * 2**20 + 1))
    with pytest.raises(StudyError, match="larger than 16 MiB"):
        read_inventory(big)
    big.write_text(",".join(f"c{i}" for i in range(1025)) + "\n")
    with pytest.raises(StudyError, match="line 1: has 1,025 columns, at most 1,024 are read"):
        read_inventory(big)


@pytest.mark.parametrize("value", ["1.200,00", "1'200.00", "1\N{NO-BREAK SPACE}200,00", "1 200", "1.200.300"])
def test_marks_of_thousands_are_refused_with_their_remedy(tmp_path, value):
    with pytest.raises(InventoryError, match=r"'value': must be a number, got .*: write thousands without a mark"):
        read(tmp_path, f"catalogue;floor;value\nbookcase-5-shelf;0;{value}\n")
    with pytest.raises(InventoryError, match="must be a number, got '0,5': write decimals with a point"):
        read(tmp_path, 'catalogue,floor,value\nbookcase-5-shelf,0,"0,5"\n')


@pytest.mark.parametrize("written", ["1200", "1.2000", "1,2000"])
def test_what_the_refusal_of_thousands_offers_is_read(tmp_path, written):
    (row,) = read(tmp_path, f"catalogue;floor;value\nbookcase-5-shelf;0;{written}\n").rows
    assert row.value == (1200.0 if written == "1200" else 1.2)


@pytest.mark.parametrize(
    "text",
    [
        "width_m;height_m;floor;lean_deg\n1.200;2.450;0;1.250\n",
        "catalogue;floor;lean_deg;e\nbookcase-5-shelf;0;1.250;0.95\n",
        "catalogue;floor;lean_deg;e\nbookcase-5-shelf;0;1.250;\nbookcase-4-shelf;0;;0.95\n",
    ],
    ids=["sizes in metres", "before", "after"],
)
def test_points_that_other_numbers_show_to_mark_decimals(tmp_path, text):
    assert read(tmp_path, text).rows[0].block.lean == math.radians(1.25)


@pytest.mark.parametrize("column", ["value", "anchoring_cost", "cost_median"])
@pytest.mark.parametrize("separator", [",", ";"])
def test_money_has_no_three_decimals(tmp_path, column, separator):
    """Sizes in metres do not show the meaning of a point in an amount; another amount of its column does."""
    lines = [["item", "width_m", "height_m", "floor", column], ["shelf", "0.4", "1.8", "1", "1.200"]]
    lines.append(["rack", "0.6", "2.0", "2", "300"])

    def text():
        return "".join(separator.join(line) + "\n" for line in lines)

    with pytest.raises(InventoryError, match=f"line 2, column '{column}': is ambiguous, write 1200 or 1.2000, got"):
        read(tmp_path, text())
    lines[2][-1] = "9.5"
    assert len(read(tmp_path, text())) == 2


@pytest.mark.parametrize(("gap", "doubted"), [("1.500", True), ("12.500", False), ("1.50", False), ("1.500\n", False)])
def test_gaps_of_thousands_are_doubted(tmp_path, gap, doubted):
    """12.5 m is no gap, and another gap may show the meaning of a point; masses are compared with sizes."""
    further = "rack,0.6,2.0,1,120.500,9.5,0.4\n" if gap.endswith("\n") else ""
    head = "item,width_m,height_m,floor,mass_kg,edge_distance_mm,friction\n"
    with noted() as doubts:
        read(tmp_path, f"{head}shelf,0.400,1.800,1,85.250,{gap.strip()},0.400\n{further}")
    assert ["edge_distance_mm has three digits behind all points" in doubt.sentence for doubt in doubts] == [True] * (
        doubted
    )


CUT = "item,catalogue,floor,count,anchored\nshelf,bookcase-5-shelf,0,1,no\ncase,bookcase-4-shelf,1,12,yes\n"


@pytest.mark.parametrize("end", ["case,bookcase-4-shelf,1,1", "case,bookcase-4-shelf,1", "case,bookcase-4-shelf,1,"])
@pytest.mark.parametrize("line_end", ["\n", "\r\n", "\r"])
def test_a_cut_last_line(tmp_path, end, line_end):
    whole = CUT[: CUT.index(end) + len(end)].replace("\n", line_end)
    with pytest.raises(InventoryError, match=r"line 3: has \d of 5 cells and no line end: the file is cut"):
        read(tmp_path, whole)


def test_a_whole_last_line_without_its_end(tmp_path):
    assert read(tmp_path, CUT[:-1]) == read(tmp_path, CUT)


def test_short_lines_and_lines_left_out_are_named(tmp_path):
    text = (
        CUT + "#3 rack,bookcase-3-shelf,1,5,no\nrack,bookcase-3-shelf,1\n# shelf, as it was, on floor 2, no, yes\nlow,,"
    )
    with pytest.raises(InventoryError, match="line 7: has 3 of 5 cells"):
        read(tmp_path, text)
    text = text[: text.index("low")]
    with pytest.warns(ImplausibleInput) as caught:
        found = read(tmp_path, text)
    said = [str(warning.message) for warning in caught]
    assert [re.match(r"inventory\.csv, line \d", sentence)[0][-1] for sentence in said] == ["4", "5"]
    assert ["comment" in sentence for sentence in said] == [True, False]
    assert [(row.label, row.count, row.anchored) for row in found.rows][1:] == [("case", 12, True), ("rack", 1, False)]


@pytest.mark.parametrize(
    ("comment", "said"),
    [
        ("all values in thousands of EUR", "in thousands"),
        ("values in 1,000 EUR", "in 1,000"),
        ("value: k€", "k€"),
        ("prices in TEUR", "TEUR"),
        ("sizes in feet", "sizes in feet"),
        ("all dimensions are in mm", "all dimensions are in mm"),
        ("Breite und Höhe: cm", ""),
        ("gaps in mm, values in EUR, 1000 pieces", ""),
    ],
)
def test_units_in_comments_are_doubted(tmp_path, comment, said):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        read(tmp_path, f"# {comment}\n{SMALL}")
        file = book_of(rows_of(f"# {comment}\n{SMALL}"), tmp_path / "book.xlsx")
        read_inventory(file)

        def noted(book):
            book.active["B1"].comment = openpyxl.comments.Comment(comment, "a person")

        read_inventory(book_of(rows_of(SMALL), tmp_path / "noted.xlsx", change=noted))
    assert len(caught) == 3 * bool(said)
    assert all(f"a comment says {said!r}, which is not applied" in str(warning.message) for warning in caught)


def test_a_line_for_spreadsheet_programs_is_none_of_the_table(tmp_path):
    for line in ("sep=;", '"SEP=;"'):
        assert read(tmp_path, f"{line}\n" + SMALL.replace(",", ";")) == read(tmp_path, SMALL)


def test_crowds_and_tiny_distances(tmp_path):
    heading = "catalogue,floor,persons_exposed,injury_probability,friction,trip_mm\n"
    with pytest.warns(ImplausibleInput, match=r"more than 50 persons where one piece falls \(bookcase-5-shelf: 9000\)"):
        read(tmp_path, f"{heading}bookcase-5-shelf,1,9000,0.0001,,\n")
    with pytest.warns(ImplausibleInput, match=r"restitution below 0.3 \(bookcase-5-shelf: 0.09\)"):
        read(tmp_path, "catalogue,floor,e\nbookcase-5-shelf,1,0.09\n")
    with pytest.raises(InventoryError, match="trip_mm"):
        read(tmp_path, f"{heading}bookcase-5-shelf,1,40,0.1,0.3,0.02\n")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert read(tmp_path, f"{heading}bookcase-5-shelf,1,50,0.02,0.3,20\n").rows[0].trip == 0.02


A = "0.5,0.4,,1,"


def placed(*floors, height=1.8):
    return [Contents(f"piece {i}", tp.Block(0.4, height), floor) for i, floor in enumerate(floors)]


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        (placed(1, 2, 3), "floors 1 to 3, the roof, and none on floor 0, the ground: are floors counted from 1?"),
        (placed("1", "3"), "are floors counted from 1?"),
        (placed(0, 1, 3), ""),
        (placed(1, 2), ""),
        (placed(3, 3), ""),  # (a plant on the roof alone)
        (placed(0, 1, height=6.0), "higher than their storey (piece 0: 6 m in 4 m, piece 1: 6 m in 3 m): feet?"),
        (placed(0, 3, height=3.5), ""),  # (on the roof nothing limits it)
    ],
)
def test_floors_from_1_and_pieces_in_feet(rows, words):
    found = [doubt.sentence for doubt in place_doubts(rows, [0.0, 4.0, 7.0, 10.0])]
    assert len(found) == bool(words), found
    assert not words or words in found[0]


TOTALS = (
    "Total|TOTAL:|Totals|Sum|Grand total|Subtotal (3)|Total pieces|Summe EG|Zwischensumme 1. OG|Gesamtsumme Haus A|"
    "EG gesamt|Insgesamt 1. OG|Total EG|TOTAL floor 1|Sum of the ground floor|Room 12 total|Sum total|Total RDC|"
    "Total étage 1|Totale piano terra|Total planta baja|Σ|Mean|Gesamt|Summe|Zwischensumme|Total général|Totale|"
    "合計|Итого"
)
NO_TOTALS = (
    "Total lab analyser|Totem|Summer table|Meander shelf|Total station|Sumo statue|Total 360 display|Sommelier's rack"
)


@pytest.mark.parametrize(
    ("name", "total"),
    [
        *((name, True) for name in TOTALS.split("|")),
        *((name, False) for name in NO_TOTALS.split("|")),
    ],
)
def test_lines_of_totals_are_no_pieces(tmp_path, name, total):
    text = f"item,width_m,height_m,floor,count\nshelf,0.35,2,0,3\n{name},0.35,2,0,3\n"
    if not total:
        assert len(read(tmp_path, text)) == 2
        return
    with pytest.raises(InventoryError, match=r"line 3, column 'item': must be a piece, got .* leave totals out"):
        read(tmp_path, text)


def test_studies_note_what_is_odd_in_their_tables(tmp_path):
    """An inventory, and blocks in a file, which is a table too."""
    motions = '[motions]\ngenerator = "clough-penzien"\nnumber = 2\nduration_s = 4\ndt_s = 0.02\n'
    top = f'title = "t"\n{{}}[[models]]\nlaw = "housner"\n{motions}'
    (tmp_path / "items.csv").write_text("item,catalogue,floor,count\nshelf,bookcase-5-shelf,0\n", encoding="utf-8")
    (tmp_path / "blocks.csv").write_text("name,width_m,height_m,mass_kg\na,0.4,1.8\n", encoding="utf-8")
    of_items = top.format("") + '[performance]\ninventory = "items.csv"\n'
    levels = '[ida]\nim = "pga"\nlevels = { values = [0.1, 0.2], unit = "g" }\n'
    of_blocks = top.format('blocks_file = "blocks.csv"\n') + levels
    for text, name in ((of_items, "items.csv"), (of_blocks, "blocks.csv")):
        path = tmp_path / "study.toml"
        path.write_text(text, encoding="utf-8")
        note = f"{name}, line 2 has fewer cells than the header: the others are assumed to be empty"
        assert note in tp.Study.from_toml(path).notes
        path.write_text(f'accept = ["table"]\n{text}', encoding="utf-8")
        assert note not in tp.Study.from_toml(path).notes


@pytest.mark.parametrize("cut", ["study.toml", "items.csv"])
def test_last_lines_without_an_end_that_end_in_a_number_are_named(cut, tmp_path):
    """An inventory cut after the 1 of 12 pieces, a study after the 1 of `number = 12`: nothing else tells."""
    motions = '[motions]\ngenerator = "clough-penzien"\nduration_s = 4\ndt_s = 0.02\nnumber = 1'
    study = f'title = "t"\n[[models]]\nlaw = "housner"\n[performance]\ninventory = "items.csv"\n{motions}'
    texts = {"study.toml": study, "items.csv": "item,catalogue,floor,count\nshelf,bookcase-5-shelf,0,1"}
    for name, text in texts.items():
        (tmp_path / name).write_text(text + "\n" * (name != cut), encoding="utf-8")
    found = [one for one in tp.Study.from_toml(tmp_path / "study.toml").doubts if one.kind == "table"]
    said = f"{cut}: the last line has no line end: if the file is cut, so is its last number"
    assert [(one.sentence, one.settled) for one in found] == [(said, True)]


OF_CORPUS = [case.files["inventory.csv"] for case in refused_cases.cases() if "inventories/pieces_" in case.name]
PLAIN_FILES = [
    text
    for text in OF_CORPUS
    # what only a text file can be: another separator, a broken quote, bytes, characters that no workbook may hold
    if isinstance(text, str) and not re.search(r"^[^,\n]*[;\t]|\0|\"x,", text)
]


def test_a_floor_without_histories(tmp_path):
    path = tmp_path / "i.csv"
    path.write_text("catalogue,floor\nbookcase-5-shelf,0\n", encoding="utf-8")
    with pytest.raises(InventoryError, match="must be one of 1, 2, got '0'; add the histories of the ground, which is"):
        read_inventory(path, ["1", "2"])
    path.write_text("catalogue,floor\nbookcase-5-shelf,3\n", encoding="utf-8")
    with pytest.raises(InventoryError, match=r"must be one of 1, 2, got '3'$"):
        read_inventory(path, ["1", "2"])


def hidden_by_name(book):
    book.active.title, book.active.sheet_state = "inventory", "hidden"
    book.active = book.create_sheet("empty")


class TestWorkbooks:
    """A workbook says what the CSV of its sheet says, and is refused as that is."""

    def test_the_example(self, tmp_path):
        text = Path(example_path()).read_text(encoding="utf-8")
        for as_cell in (number, str):
            path = book_of(rows_of(text), tmp_path / "i.xlsx", as_cell)
            assert read_inventory(path) == read_inventory(example_path())

    def test_rows_take_time_in_proportion(self, tmp_path, monkeypatch):
        """The library looks through all cells for a sheet's last column: not for every row."""
        asked, last = [], Worksheet.max_column
        monkeypatch.setattr(Worksheet, "max_column", property(lambda sheet: asked.append(1) or last.fget(sheet)))
        lines = [["item", "width_m", "height_m", "floor"], *([f"shelf {n}", "0.4", "1.8", "0"] for n in range(60))]
        assert len(read_inventory(book_of(lines, tmp_path / "i.xlsx")).rows) == 60
        assert len(asked) < 10

    def test_defaults_and_labels(self, tmp_path):
        for text in (SMALL, "width_m,height_m,floor\n0.4,2,1\n"):
            assert read_inventory(book_of(rows_of(text), tmp_path / "i.XLSX")) == read(tmp_path, text)

    @pytest.mark.slow
    @pytest.mark.parametrize("text", PLAIN_FILES, ids=range(len(PLAIN_FILES)))
    def test_bad_files(self, tmp_path, text):
        """The pieces of the CSV, or word by word its sentence, with a row in the place of a line."""
        (tmp_path / "inventory.csv").write_text(text, encoding="utf-8", newline="")
        book_of(csv.reader(io.StringIO(text)), tmp_path / "inventory.xlsx", lambda cell: cell or None)
        found = []
        for name in ("inventory.csv", "inventory.xlsx"):
            try:
                found.append(read_inventory(tmp_path / name))
            except InventoryError as error:
                found.append(str(error).replace(name, "inventory"))
        if isinstance(found[0], str):
            found[0] = re.sub(r"\bline( \d+|s\b)", lambda line: f"row{line[1]}", found[0])
            if '"x\ny"' in text:  # (lines are counted at their end)
                found[0] = found[0].replace("row 3", "row 2")
        assert found[1] == found[0]

    def test_kept_values_of_formulas(self, tmp_path):
        """As other programs save them: a number, a text, and the empty text, also below the table."""
        rows = [["item", "catalogue", "floor", "count"], ["=A9", "bookcase-5-shelf", 1, "=1+6"], ["=B9"], ["=C9"]]
        path = book_of(rows, tmp_path / "i.xlsx")
        kept = {"A2": ("str", "shelf"), "D2": (None, "7"), "A3": ("str", ""), "A4": ("str", "")}
        held = io.BytesIO()
        with zipfile.ZipFile(path) as old, zipfile.ZipFile(held, "w") as new:
            for name in old.namelist():
                text = old.read(name).decode()
                for cell, (kind, value) in kept.items() if name.endswith("sheet1.xml") else ():
                    typed = "" if kind is None else f' t="{kind}"'
                    text, n = re.subn(
                        rf'<c r="{cell}"[^>]*>(<f>.*?</f>)<v */?>(</v>)?',
                        rf'<c r="{cell}"{typed}>\1<v>{value}</v>',
                        text,
                    )
                    assert n == 1, cell
                new.writestr(name, text)
        path.write_bytes(held.getvalue())
        (row,) = read_inventory(path).rows
        assert (row.label, row.count) == ("shelf", 7)

    def test_booleans_say_yes_and_no(self, tmp_path):
        rows = [["catalogue", "floor", "anchored"], ["bookcase-5-shelf", 1, True], ["bookcase-4-shelf", 1, False]]
        found = read_inventory(book_of(rows, tmp_path / "i.xlsx"))
        assert [row.anchored for row in found.rows] == [True, False]

    def test_merged_cells(self, tmp_path):
        rows = [["# all of it"], ["catalogue", "floor"], ["bookcase-5-shelf", 1], ["bookcase-4-shelf", None]]
        path = book_of(rows, tmp_path / "i.xlsx")
        book = openpyxl.load_workbook(path)
        book.active.merge_cells("A1:B1")  # of a comment
        book.active.merge_cells("C3:C4")  # of empty cells
        book.save(path)
        with pytest.raises(InventoryError, match="row 4, column 'floor': is empty"):
            read_inventory(path)
        book.active.merge_cells("B3:B4")
        book.save(path)
        with pytest.raises(InventoryError, match=r"row 3, column 'floor': is merged with others \(B3:B4\): fill each"):
            read_inventory(path)
        book.active.merge_cells("A2:B2")
        book.save(path)
        with pytest.raises(InventoryError, match=r"row 2: the heading 'catalogue' is merged with others \(A2:B2\)"):
            read_inventory(path)

    def test_sheets_and_empty_rows(self, tmp_path):
        path = book_of(rows_of(SMALL), tmp_path / "i.xlsx")
        book = openpyxl.load_workbook(path)
        sheet = book.active
        for row in (9, 30, 4000):  # rows that only have a format
            sheet.cell(row, 12).font = openpyxl.styles.Font(bold=True)
        sheet.cell(6, 1, "# notes below")
        book.create_sheet("costs")["A1"] = "nothing of ours"
        book.save(path)
        with pytest.warns(ImplausibleInput, match="only the sheet 'Sheet' is read, not 'costs'"):
            assert read_inventory(path) == read(tmp_path, SMALL)
        # the first that is not hidden …
        book.create_sheet("lists", 0)["A1"] = "nothing of ours"
        book["lists"].sheet_state = "hidden"
        book.active = 1
        book.save(path)
        with pytest.warns(ImplausibleInput, match="only the sheet 'Sheet' is read, not 'costs'"):
            assert read_inventory(path) == read(tmp_path, SMALL)
        # … or the one of that name, wherever it is
        book.create_sheet("first", 0)["A1"] = "nothing of ours"
        book.save(path)
        with pytest.raises(InventoryError, match="unknown column 'nothing of ours'"):
            read_inventory(path)
        sheet.title = "Inventory"
        book.save(path)
        with pytest.warns(ImplausibleInput, match="only the sheet 'Inventory' is read, not 'first', 'costs'"):
            assert read_inventory(path) == read(tmp_path, SMALL)

    @pytest.mark.parametrize(
        ("hide", "message"),
        [
            (lambda book: setattr(book.active.row_dimensions[3], "hidden", True), "hidden row 3 is read, too"),
            (lambda book: setattr(book.active["A3"], "font", Font(strike=True)), "struck-out row 3 is read, too"),
            (lambda book: setattr(book.active.column_dimensions["C"], "hidden", True), "hidden column C is read, too"),
            (lambda book: book.active.column_dimensions.group("B", "C", hidden=True), "hidden column B is read, too"),
            (
                lambda book: book.create_sheet("floor 2").append(["item"]),
                "only the sheet 'Sheet' is read, not 'floor 2'",
            ),
            (hidden_by_name, "hidden sheet 'inventory' is read, too"),
        ],
        ids=["row", "struck-out", "column", "group", "sheet", "name"],
    )
    def test_what_a_person_does_not_see_or_sees_in_vain(self, tmp_path, hide, message):
        rows = [["catalogue", "floor", "count"], ["bookcase-5-shelf", 1, 3], ["bookcase-4-shelf", 1, 2]]
        with pytest.warns(ImplausibleInput, match=rf"^i\.xlsx: {re.escape(message)}$"):
            assert read_inventory(book_of(rows, tmp_path / "i.xlsx", change=hide)).pieces == 5

    @pytest.mark.parametrize(
        ("currency", "codes", "message"),
        [
            (
                "",
                ("#,##0 [$€-407]", "[$$-409]#,##0"),
                "column 'value': must be in € as the others are, got 26000 shown in",
            ),
            ("EUR", ("0", '"$"0'), "column 'value': must be in EUR as the others are, got 26000 shown in"),
            ("JPY", ("0", '"£"0'), "must be in JPY"),
            ("EUR", ("0", "_ [$CHF-807] * #,##0.00_ "), "must be in EUR as the others are, got 26000 shown in CHF"),
            ("EUR", ("0", '#,##0 "USD"'), "shown in USD"),
            ("EUR", ("0", "#,##0.00 [$kr-41D]"), "shown in kr"),
            ("", ("[$EUR] 0", "[$CHF] 0"), "must be in EUR as the others are, got 26000 shown in CHF"),
            ("", ("#,##0 [$€-407]", '0" EUR"'), ""),
            ("SEK", ("0", "#,##0.00 [$kr-41D]"), ""),
            ("EUR", ("_-* #,##0.00\\ _€_-", "0"), ""),
            ("JPY", ("[$¥-411]#,##0", '"¥"0'), ""),
            ("USD", ("[$$-409]#,##0", "0"), ""),
        ],
    )
    def test_signs_of_money(self, tmp_path, currency, codes, message):
        """A person sees euros above dollars."""
        head = ["catalogue", "floor", "value", "currency"]
        rows = [head, *(["bookcase-5-shelf", floor, value, currency] for floor, value in ((1, 350), (2, 26000)))]
        path = book_of(rows, tmp_path / "i.xlsx", change=formatted(C2=codes[0], C3=codes[1]))
        if not message:
            assert read_inventory(path).pieces == 2
            return
        with pytest.raises(InventoryError, match=message):
            read_inventory(path)

    @pytest.mark.parametrize(
        "code",
        [
            '0.0" cm"',
            '0" mm"',
            '0.00\\ "ft"',
            '0.0" CM";-0.0" CM"',
            '0" feet"',
            "0.0\\'",
            '0" inch"',
            '0" lbs"',
            "-0",
            '"B"0',
        ],
    )
    def test_units_of_number_formats(self, tmp_path, code):
        """A person sees 45 cm below width_m."""
        codes = {"A2": '0.00" m"', "B2": '0.00\\ "m"', "C2": '0" pcs."', "D2": '0" kg"'}
        rows = [["width_m", "height_m", "floor", "mass_kg"], [0.45, 2.0, 1, 80]]
        path = book_of(rows, tmp_path / "i.xlsx", change=formatted(**codes))
        assert read_inventory(path).rows[0].block.width == 0.45
        rows[1][0] = 45
        with pytest.raises(InventoryError, match="row 2, column 'width_m': must be in the unit of its heading, got 45"):
            read_inventory(book_of(rows, path, change=formatted(**codes | {"A2": code})))

    @pytest.mark.parametrize(
        ("code", "refused"),
        [
            ('0.0" k€"', True),
            ('0.0\\ "TEUR"', True),
            ('0.0" Mio. EUR"', True),
            ("0.0 [$k€-407]", True),
            ('0".000"', True),
            ('0.0," k€"', False),  # (shows 1200 as 1.2 k€)
            *((code, True) for code in ("#,##0,", "0.0,", '0.0," €"', "0.0,,", ";;;")),  # (show 1200 as 1)
            ("#,##0.0\\ [$€-407]", False),
            ('#,##0.0" EUR"', False),
            ('0.0" MXN"', False),
            ('0.0" × 1000"', True),
            ('0.0" lakh"', True),
            ("#\\'##0.0", False),
        ],
    )
    def test_multiples_of_number_formats(self, tmp_path, code, refused):
        """A person sees 1.2 k€ below value."""
        rows = [["width_m", "height_m", "floor", "value"], [0.45, 2.0, 1, 1.2]]
        path = book_of(rows, tmp_path / "i.xlsx", change=formatted(D2=code))
        if refused:
            with pytest.raises(InventoryError, match="column 'value': must be in the unit of its heading, got"):
                read_inventory(path)
        else:
            assert read_inventory(path).rows[0].value == 1.2

    def test_shares_in_per_cent_and_numbers_as_text(self, tmp_path):
        rows = [["catalogue", "floor", "persons_exposed", "injury_probability", "value"]]
        rows.append(["bookcase-5-shelf", 1, 1.125, 0.4, "250"])
        shares = formatted(D2="0%")  # (shows 40 %)
        (row,) = read_inventory(book_of(rows, tmp_path / "i.xlsx", lambda cell: cell, shares)).rows
        assert (row.injury.probability, row.injury.persons, row.value) == (0.4, 1.125, 250.0)
        rows[1][-1] = 0.12
        with pytest.raises(InventoryError, match=r"row 2, column 'value': .*got 0.12 shown in %"):
            read_inventory(book_of(rows, tmp_path / "i.xlsx", lambda cell: cell, formatted(E2="0%")))
        rows[1][-1] = "1.200"  # (text: as a person wrote it)
        with pytest.raises(InventoryError, match="row 2, column 'value': is ambiguous, write 1200"):
            read_inventory(book_of(rows, tmp_path / "i.xlsx", lambda cell: cell, shares))

    def test_macros_are_not_looked_at(self, tmp_path):
        path = book_of(rows_of(SMALL), tmp_path / "i.xlsm")
        with zipfile.ZipFile(path, "a") as book:
            book.writestr("xl/vbaProject.bin", b"Attribute VB_Name")
        assert read_inventory(path) == read(tmp_path, SMALL)

    @pytest.mark.slow
    def test_hostile_files(self, tmp_path):
        path = tmp_path / "i.xlsx"
        whole = book_of(rows_of(SMALL), path).read_bytes()
        held = io.BytesIO()
        with zipfile.ZipFile(held, "w", zipfile.ZIP_DEFLATED) as bomb:
            bomb.writestr("xl/worksheets/sheet1.xml", bytes(60 * 2**20))
        laughs = "".join(f'<!ENTITY l{i} "{10 * f"&l{i - 1};"}">' for i in range(1, 12))
        entities = {"xl/worksheets/sheet1.xml": f'<!DOCTYPE x [<!ENTITY l0 "ha">{laughs}]><x>&l11;</x>'}
        far = {"xl/worksheets/sheet1.xml": SHEET.format('<row r="999999999999"><c r="A1"><v>1</v></c></row>')}
        wide = {"xl/worksheets/sheet1.xml": SHEET.format('<row r="1"><c r="ZZZ1"><v>1</v></c></row>')}
        for content, message in [
            (b"", "not a workbook"),
            (SMALL.encode(), r"not a workbook \(XLSX\), or a damaged one"),
            (whole[:-30], r"not a workbook \(XLSX\), or a damaged one"),
            (b"\xd0\xcf\x11\xe0" + bytes(600), r"an old workbook \(XLS\), or one with a password"),
            (held.getvalue(), "larger than 48 MiB once it is unpacked"),
            (replaced(whole, {"xl/workbook.xml": "<x/>"}), "a workbook without a sheet to be seen"),
            (replaced(whole, {"xl/workbook.xml": "<x>"}), r"not a workbook \(XLSX\) that can be read"),
            (replaced(whole, entities), r"not a workbook \(XLSX\) that can be read"),
            (replaced(whole, far), "reaches beyond 1,048,576 rows or 1,024 columns"),
            (replaced(whole, wide), "row 1 reaches beyond 1,048,576 rows or 1,024 columns"),
            (b"PK" + bytes(16 * 2**20), "larger than 16 MiB, no inventory is"),
        ]:
            path.write_bytes(content)
            before = time.process_time()
            with pytest.raises(InventoryError, match=message) as caught:
                read_inventory(path)
            assert "\n" not in str(caught.value)
            assert time.process_time() - before < 5.0, message
        (tmp_path / "i.csv").write_bytes(whole)
        with pytest.raises(InventoryError, match=r"a workbook or archive, no text; name a workbook .xlsx, or save its"):
            read_inventory(tmp_path / "i.csv")

    @pytest.mark.slow
    def test_any_mutation_is_an_inventory_or_an_inventory_error(self, tmp_path):
        """Damage to the sheet itself, which the archive's checksums do not see."""
        path = book_of(rows_of(Path(example_path()).read_text(encoding="utf-8")), tmp_path / "i.xlsx")
        whole = path.read_bytes()
        with zipfile.ZipFile(path) as book:
            sheet = book.read("xl/worksheets/sheet1.xml")
        generator = np.random.default_rng(3)
        refused = 0
        for _ in range(100):
            data = bytearray(sheet)
            at = int(generator.integers(len(data)))
            data[at : at + int(generator.integers(1, 9))] = bytes(generator.integers(32, 127, 3, dtype=np.uint8))
            path.write_bytes(replaced(whole, {"xl/worksheets/sheet1.xml": bytes(data)}))
            try:
                assert len(read_inventory(path)) > 0
            except InventoryError as error:
                refused += 1
                assert str(error).startswith(f"{path}")
                assert "\n" not in str(error)
        assert 50 < refused < 100

    @pytest.mark.slow
    def test_a_study_has_the_same_results(self, tmp_path):
        """Every variable, byte by byte; the study's own text names another file, and with it the identity differs."""
        text = Path(example_path()).with_name("clinic.toml").read_text(encoding="utf-8")
        text = re.sub(r"(?m)^number = \d+", "number = 4", text)
        table = Path(example_path()).read_text(encoding="utf-8")
        (tmp_path / "inventory.csv").write_text(table, encoding="utf-8")
        book_of(rows_of(table), tmp_path / "inventory.xlsx")
        (tmp_path / "a.toml").write_text(text, encoding="utf-8")
        (tmp_path / "b.toml").write_text(text.replace("inventory.csv", "inventory.xlsx"), encoding="utf-8")
        a, b = (tp.Study.from_toml(tmp_path / f"{name}.toml").run() for name in "ab")
        assert a.identical(b.assign_attrs(a.attrs))
        for name in a.variables:
            if a[name].dtype != object:
                assert a[name].values.tobytes() == b[name].values.tobytes(), name
        assert {name for name in a.attrs if a.attrs[name] != b.attrs[name]} == {"study", "identity", "content_sha256"}
        assert a.attrs["study"] == b.attrs["study"].replace("inventory.xlsx", "inventory.csv")


SHEET = (
    '<worksheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"><sheetData>{}</sheetData></worksheet>'
)


def replaced(book, parts):
    """A workbook with other parts in the place of some."""
    held = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(book)) as old, zipfile.ZipFile(held, "w") as new:
        for name in old.namelist():
            new.writestr(name, parts.get(name, old.read(name)))
    return held.getvalue()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::toppling.core.doubts.ImplausibleInput")
def test_any_mutation_is_an_inventory_or_an_inventory_error(tmp_path):
    """2,000 damaged files: bytes changed, cut out, doubled, put in from a list of nasty ones."""
    whole = Path(example_path()).read_bytes()
    nasty = [
        b'"',
        b"\r",
        b"\n",
        b",",
        b";",
        b"\t",
        b"\0",
        b"\xff",
        b"e308",
        b"-",
        b"nan",
        b"9" * 40,
        b"\xe2\x80\xa8",
        b"#",
    ]
    generator = np.random.default_rng(11)
    path = tmp_path / "mutant.csv"
    slowest = 0.0
    refused = 0
    for _ in range(2000):
        data = bytearray(whole)
        for _ in range(generator.integers(1, 5)):
            at = int(generator.integers(len(data)))
            kind = generator.integers(4)
            if kind == 0:
                data[at] = generator.integers(256)
            elif kind == 1:
                del data[at : at + int(generator.integers(1, 40))]
            elif kind == 2:
                piece = nasty[generator.integers(len(nasty))]
                data[at:at] = piece
            else:
                data[at:at] = data[at : at + int(generator.integers(1, 200))]
        path.write_bytes(bytes(data))
        before = time.process_time()
        try:
            found = read_inventory(path)
        except InventoryError as error:
            refused += 1
            assert str(error).startswith(f"{path}")
            assert "\n" not in str(error)
        else:
            assert found.pieces >= len(found)
        slowest = max(slowest, time.process_time() - before)
    assert 500 < refused < 1990
    assert slowest < 3.0  # s of computing, whatever else runs


class TestNotes:
    @pytest.mark.parametrize(
        ("word", "known"),
        [
            ("verletzung", "injury"),
            ("blessure", "injury"),
            ("danger", "injury"),
            ("fatalities", "injury"),
            ("blockiert ausgang", "blocks-exit"),
            ("sortie bloquée", "blocks-exit"),
            ("freisetzung", "release"),
            ("leaks", "release"),
            ("explosion", ""),
            ("loss of use", ""),
        ],
    )
    def test_consequences_in_other_words(self, word, known):
        rows = (Contents("a", SHELF, 0, consequences=(word,)), Contents("b", SHELF, 0, consequences=("injury",)))
        meant = Fact("consequence.misspelt", names=(word, known))
        assert inventory_notes(Inventory(rows), SAFETY, False) == [meant] * bool(known)

    @pytest.mark.parametrize(("value", "by"), [(100.0, "money"), (0.0, "its falls")])
    def test_pieces_are_judged_by_money_where_there_is_any(self, value, by):
        (note,) = inventory_notes(
            Inventory((Contents("a", SHELF, 0, value=value, consequences=("noise",)),)), SAFETY, False
        )
        assert (note.what, note.names, note.more["value"]) == ("consequence.none_of_safety", ("noise",), value > 0.0)
        assert f" by {by};" in notes_said([note])[0]


def test_refused(refusal):
    refusal()
