"""Inventories: what a CSV file says, and one sentence where it says something else."""

import math
import re
import time
from pathlib import Path

import numpy as np
import pytest

import toppling as tp
from toppling.studies import StudyError
from toppling.studies.buildings.contents import Contents, Inventory
from toppling.studies.buildings.inventory import COLUMNS, InventoryError, example_path, read_inventory

SHELF = tp.catalogue["bookcase-5-shelf"]

SMALL = """item,catalogue,width_m,height_m,floor,count,e,value,consequence
shelf,bookcase-5-shelf,,,2,3,0.9,400,blocks-exit
crate,,0.5,1.25,0,,,,
"""


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
        assert last.label == "book stack, loaded on top"
        assert (last.block.width, last.block.height, last.block.h, last.block.inertia) == (0.35, 2.1, 1.25, 1.25)

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

    def test_order_of_columns_does_not_matter(self, tmp_path):
        lines = [line.split(",") for line in SMALL.splitlines()]
        turned = "\n".join(",".join(reversed(line)) for line in lines)
        assert read(tmp_path, turned) == read(tmp_path, SMALL)

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
    ("", "empty"),
    ("# nothing\n", "empty"),
    ("item,catalogue,floor\n", "has a header but no items"),
    ("item,catalogue,flor\nx,bookcase-5-shelf,1\n", r"line 1: unknown column 'flor'; did you mean 'floor'\?"),
    ("item,width,height_m,floor\n", r"unknown column 'width'; did you mean 'width_m'\?"),
    ("item,catalogue,floor,colour of the door\n", "unknown column 'colour of the door'; allowed are item, catalogue"),
    ("item,catalogue,floor,floor\n", "column 'floor' stands there twice"),
    ("item,catalogue\nx,bookcase-5-shelf\n", "line 1: column 'floor' is missing"),
    ("item,floor,width_m\n", "columns must name catalogue, or width_m and height_m"),
    ("catalogue,floor\nbookcase-5-shelf,\n", "line 2, column 'floor': is empty: it must say where"),
    ("catalogue,floor\nbookcase-5-shelf,-1\n", "column 'floor': must be a whole number from 0 .ground., or a name"),
    ("catalogue,floor\nbookcase-5-shelf,1.5\n", "column 'floor': must be a whole number"),
    (
        "catalogue,floor\nbookcase-5-shelve,1\n",
        r"there is no item 'bookcase-5-shelve'; did you mean 'bookcase-5-shelf'",
    ),
    ("catalogue,floor\n,1\n", "column 'width_m': is empty: a line needs a catalogue name"),
    ("catalogue,width_m,height_m,floor\n,1,,1\n", "column 'height_m': is empty"),
    ("catalogue,width_m,height_m,floor\nbookcase-5-shelf,1,,1\n", "column 'width_m': must be empty beside a catalogue"),
    ("width_m,height_m,floor\n0.4 m,2,1\n", "line 2, column 'width_m': must be a number, got '0.4 m'"),
    ("width_m,height_m,floor\n-0.4,2,1\n", "column 'width_m': must be finite and > 0, got -0.4"),
    ("width_m,height_m,floor\nnan,2,1\n", "column 'width_m': must be a number, got 'nan'"),
    ("width_m,height_m,floor\n1e9,2,1\n", "column 'width_m': must be finite and > 0 and <= 1e.06"),
    ("width_m,height_m,cm_height_m,floor\n0.4,2,1.5,1\n", "column 'inertia_factor': must be given"),
    ("width_m,height_m,cm_height_m,inertia_factor,floor\n.4,2,2.5,1.3,1\n", "column 'cm_height_m': must be .* < 2"),
    ("width_m,height_m,floor\n0.4,2,1,7\n", "line 2: has 4 cells, the header names 3 columns"),
    ('width_m,height_m,floor\n"0,4",2,1\n', "column 'width_m': must be a number, got '0,4'"),
    ("width_m;height_m;floor;value\n0,4;1.9;1;5\n", "column 'height_m': must have its decimals as the numbers above"),
    ("width_m;height_m;floor;value\n0,4;1,9;1;1,200\n", "column 'value': is ambiguous, write 1200 or 1.200"),
    ("catalogue,floor,count\nbookcase-5-shelf,1,0\n", "column 'count': must be from 1 to 1000000, got 0"),
    ("catalogue,floor,count\nbookcase-5-shelf,1,2.5\n", "column 'count': must be a whole number, got '2.5'"),
    ("catalogue,floor,e\nbookcase-5-shelf,1,1.1\n", "column 'e': must be finite and > 0 and <= 1, got 1.1"),
    ("catalogue,floor,restitution\nbookcase-5-shelf,1,0\n", "column 'restitution': must be finite and > 0"),
    ("catalogue,floor,e,restitution\nbookcase-5-shelf,1,.9,.9\n", "column 'restitution': is the same as e"),
    ("catalogue,floor,value\nbookcase-5-shelf,1,-5\n", "column 'value': must be finite and >= 0"),
    (
        "catalogue,floor,value,currency\nbookcase-5-shelf,1,5,EUR\nbookcase-4-shelf,1,5,USD\n",
        "line 3, column 'currency'",
    ),
    ("catalogue,floor,anchored\nbookcase-5-shelf,1,perhaps\n", "column 'anchored': must be yes or no, got 'perhaps'"),
    ("catalogue,floor,anchoring_cost\nbookcase-5-shelf,1,free\n", "column 'anchoring_cost': must be a number"),
    ("catalogue,floor,consequence\nbookcase-5-shelf,1,loss\n", "column 'consequence': must not be one of number, loss"),
    (
        "catalogue,floor,cost_median,cost_dispersion\nbookcase-5-shelf,1,50,-0.1\n",
        "line 2, column 'cost_dispersion': must be finite and >= 0, got -0.1",
    ),
    (
        "catalogue,floor,cost_median,cost_dispersion\nbookcase-5-shelf,1,50,4\n",
        "line 2, column 'cost_dispersion': must be from 0 to 3 of a lognormal distribution, got 4",
    ),
    (
        "catalogue,floor,cost_median,cost_dispersion\nbookcase-5-shelf,1,,0.4\n",
        "line 2, column 'cost_dispersion': needs cost_median, which is empty",
    ),
    (
        "catalogue,floor,downtime_distribution\nbookcase-5-shelf,1,normal\n",
        "column 'downtime_distribution': needs downtime_median_days, which is empty",
    ),
    (
        "catalogue,floor,downtime_median_days,downtime_distribution\nbookcase-5-shelf,1,3,beta\n",
        "column 'downtime_distribution': must be one of lognormal, normal, got 'beta'",
    ),
    (
        "catalogue,floor,downtime_median_days,downtime_distribution,downtime_dispersion\nbookcase-5-shelf,1,3,normal,.9\n",
        "column 'downtime_dispersion': must be from 0 to 0.5 of a normal distribution, got 0.9; use lognormal above",
    ),
    ("catalogue,floor,cost_median\nbookcase-5-shelf,1,0\n", "column 'cost_median': must be finite and > 0"),
    ("catalogue,floor,cost_median,value\nbookcase-5-shelf,1,5,5\n", "column 'cost_median': takes the place of value"),
    (
        "catalogue,floor,persons_exposed,injury_probability\nbookcase-5-shelf,1,2,1.5\n",
        "line 2, column 'injury_probability': must be finite and >= 0 and <= 1, got 1.5",
    ),
    (
        "catalogue,floor,persons_exposed,injury_probability\nbookcase-5-shelf,1,2,\n",
        "column 'persons_exposed': needs injury_probability, which is empty",
    ),
    (
        "catalogue,floor,injury_probability\nbookcase-5-shelf,1,0.1\n",
        "column 'injury_probability': needs persons_exposed, which is empty",
    ),
    (
        "item,catalogue,floor\nx,bookcase-5-shelf,1\nx,bookcase-4-shelf,1\n",
        "line 3, column 'item': must be another name",
    ),
    ("item,catalogue,floor\n" + "x" * 300 + ",bookcase-5-shelf,1\n", "column 'item': must be at most 200 printable"),
    ('item,catalogue,floor\n"x\ny",bookcase-5-shelf,1\n', "column 'item': must be at most 200 printable characters"),
    ('item,catalogue,floor\n"x,bookcase-5-shelf,1\n', "line 2: no CSV"),
    ("catalogue,floor\nbookcase-5-shelf,1\0\n", "holds NUL characters"),
    (b"catalogue,floor\n\xff\xfe,1\n", "not a text file in UTF-8"),
    (
        "catalogue,floor,consequence\n" + "".join(f"bookcase-5-shelf,{i},c{i}\n" for i in range(50)),
        "at most 40 different",
    ),
    ("catalogue,floor,count\n" + "".join(f"bookcase-5-shelf,{i},900000\n" for i in range(2)), "at most 1000000 pieces"),
    ("catalogue,floor\n" + "".join(f"bookcase-5-shelf,{i}\n" for i in range(10_001)), "more than 10,000 lines"),
]


@pytest.mark.parametrize(("text", "message"), BAD_FILES, ids=range(len(BAD_FILES)))
def test_bad_files(tmp_path, text, message):
    with pytest.raises(InventoryError, match=message) as caught:
        read(tmp_path, text)
    said = str(caught.value)
    assert said.startswith(f"{tmp_path / 'inventory.csv'}")
    assert "\n" not in said
    assert len(said) < 400 + len(str(tmp_path))


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
    start = time.perf_counter()
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
    assert slowest < 1.0  # s of computing, whatever else runs
    assert time.perf_counter() - start < 60.0


class TestContents:
    @pytest.mark.parametrize(
        ("make", "error", "message"),
        [
            (lambda: Contents("", SHELF, 0), ValueError, "label must be 1 to 200 printable characters, got ''"),
            (lambda: Contents("x", 0.4, 0), TypeError, "block must be a toppling Block, got float"),
            (lambda: Contents("x", SHELF, -1), ValueError, "floor must be at least 0, got -1"),
            (lambda: Contents("x", SHELF, 1.0), TypeError, "floor must be a whole number"),
            (lambda: Contents("x", SHELF, " "), ValueError, "floor must be 1 to 200 printable characters"),
            (lambda: Contents("x", SHELF, 0, 0), ValueError, "count must be at least 1, got 0"),
            (lambda: Contents("x", SHELF, 0, 10**7), ValueError, "count must be at most 1000000, got 10000000"),
            (lambda: Contents("x", SHELF, 0, e=0.0), ValueError, "e must be finite and > 0 and <= 1, got 0.0"),
            (lambda: Contents("x", SHELF, 0, value=math.inf), ValueError, "value must be finite"),
            (lambda: Contents("x", SHELF, 0, anchoring_cost=-1.0), ValueError, "anchoring_cost must be"),
            (lambda: Contents("x", SHELF, 0, consequences="injury"), TypeError, "sequence of words, got the string"),
            (
                lambda: Contents("x", SHELF, 0, consequences=("any",)),
                ValueError,
                "must not be one of number, loss, any",
            ),
            (lambda: Inventory(()), ValueError, "at least one row, got none"),
            (lambda: Inventory((SHELF,)), TypeError, "rows must be Contents, got Block"),
            (lambda: Inventory((Contents("x", SHELF, 0),) * 2), ValueError, "unique labels, got 'x' more than once"),
            (lambda: Inventory((Contents("x", SHELF, 0),), "\n"), ValueError, "currency must be"),
        ],
    )
    def test_refuses(self, make, error, message):
        with pytest.raises(error, match=message):
            make()


def test_docs_name_every_column():
    for column in COLUMNS:
        assert re.search(rf"``{column}``", read_inventory.__doc__), column
