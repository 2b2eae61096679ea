"""Tables of a page on the inputs of a study: pieces to anchor, the sizes of blocks, and the provenance."""

import json
import math
from pathlib import Path

import xarray as xr

from ...core.wording import currency_of, given_number
from ...fragility.curves.published import fema_p58
from ...fragility.runs.provenance import SCENE, blocks_of
from ...models import Block
from ..buildings.pieces import pieces_of
from ..facts.answer_building import recommended_lines
from ..store.outputs import file_digest
from ..text.block_order import shown
from ..text.words import block_title, consequence_name, floor_cell, reference_law, roof_of
from .blocks import MOST_SHORT
from .table import Cells, Column, Row, Table, chosen


def anchoring(results: xr.Dataset) -> Table:
    """Return the table of pieces to anchor."""
    money, roof = currency_of(results), roof_of(results)
    lines = recommended_lines(results)
    rows: list[Row] = [
        {
            "item": block_title(piece.item),
            "floor": floor_cell(piece.floor, roof),
            "pieces": piece.number,
            "consequences": ", ".join(map(consequence_name, piece.consequences)) or "not stated",
            "force": math.nan if piece.code is None else piece.code.demand,
            "cost": piece.cost_of_all,
        }
        for piece in lines
    ]
    total: Row = {
        "pieces": sum(piece.number for piece in lines),
        "cost": math.fsum(piece.cost_of_all for piece in lines),
    }
    columns = (
        *(Column("item", "piece"), Column("floor", "floor"), Column("pieces", "pieces", "count")),
        *(Column("consequences", "a fall could mean"), Column("force", "force, each", "three", "N")),
        Column("cost", "cost", "given", money),
    )
    rest: Row = {"item": "Total", "floor": "", "consequences": "", "force": ""}
    budget = f"Budget: {given_number(float(results.attrs.get('budget', math.nan)))} {money}".rstrip() + "."
    notes = [budget] if "budget_chosen" in results else []
    return Table("Table 1. What to anchor", columns, [*rows, rest | total] if rows else [], notes)


def sizes(results: xr.Dataset) -> Table:
    """Return the table of the blocks' sizes."""
    in_building = "place" in results.dims
    results, most = shown(results), 0
    if in_building:  # (the pieces in the order of the other tables)
        lines = pieces_of(results, reference_law(results)[0])
        results, most = results.sel(block=[line.item for line in lines]), MOST_SHORT
    columns = [column for column in SIZES if column.key in results.coords and results[column.key].dims == ("block",)]
    labels = results["block"].values.astype(str).tolist() if columns and "block" in results.dims else []
    medians = fema_p58()["median"].to_series()
    stands = SCENE in results.coords and bool(labels)
    blocks = blocks_of(results) if stands else ()
    rows: list[Cells] = [
        {
            Column("name", "item" if in_building else "block"): _with_key(label),
            **{column: results[column.key][i].item() for column in columns},
            Column("p58", "FEMA P-58 median PGV", "two", "m/s"): float(medians.get(_key(label), math.nan)),
            Column("stands", "stands"): _stands(blocks[i]) if stands else None,
        }
        for i, label in enumerate(labels)
    ]
    title = "Items of the inventory" if in_building else "Sizes of the blocks"
    return Table.of(title, rows, chosen(results), most=most)


SIZES = (
    *(Column("width", "width", "short", "m"), Column("height", "height", "short", "m")),
    *(Column("cm_height", "mass centre", "short", "m"), Column("alpha", "slenderness angle α", "short", "rad")),
    *(Column("p", "frequency parameter p", "short", "rad/s"), Column("direction", "direction of its width", "short")),
)


def _key(label: str) -> str:
    """Return the key of the catalogue with which a label may begin."""
    return label.partition(",")[0]


def _with_key(label: str) -> str:
    """Return the title of a block, with the key of an item of the catalogue."""
    title = block_title(label)
    return title if title == label else f"{title} ({_key(label)})"


def _stands(block: Block) -> str:
    """Return the surroundings and restraint of a block, with the numbers of the study file."""
    words = block.scene_words
    held = block.restraint
    if held is not None and block.mass is not None:
        words += [] if held.rigid else [f"stiffness {given_number(1e-3 * held.stiffness)} N/mm"]
        words.append(f"{given_number(block.mass)} kg")
    return ", ".join(words) or "free"


def provenance(results: xr.Dataset, path: Path, state: str) -> Table:
    """Return the table of the versions, the study's identity, and the result file with its checksum."""
    versions = json.loads(str(results.attrs.get("package_versions", "{}")))
    packages = ", ".join(f"{name} {version}" for name, version in versions.items())
    rows = [
        ("toppling", str(results.attrs.get("toppling_version", ""))),
        ("packages", packages),
        ("processor", str(results.attrs.get("processor", results.attrs.get("machines", ""))).strip('[]"')),
        ("schema", str(results.attrs.get("schema", ""))),
        ("identity of the study", str(results.attrs.get("identity", ""))),
        ("result file", f"{path.name}, {state}"),
        ("its SHA-256", file_digest(path)),
    ]
    columns = Column("what"), Column("value")
    return Table("Provenance", columns, [{"what": what, "value": value} for what, value in rows])
