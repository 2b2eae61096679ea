"""Tables of a page on the inputs of a study: what to anchor, the sizes of blocks, and the provenance."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import xarray as xr

from ...core.wording import currency_of, given_number, short_digits, two_digits
from ...fragility.curves.published import fema_p58
from ...fragility.runs.provenance import SCENE, blocks_of
from ...models import Block
from ..facts.building import recommended_lines
from ..store.outputs import file_digest
from ..text.block_order import chosen_of
from ..text.rows import Rows
from ..text.words import block_title, consequence_name, floor_cell, roof_of


def anchor_rows(results: xr.Dataset) -> Rows | None:
    """Return the table of what to anchor; None if nothing is."""
    lines = recommended_lines(results)
    if not lines:
        return None
    money = currency_of(results)
    roof = roof_of(results)
    rows = [
        (
            block_title(piece.item),
            floor_cell(piece.floor, roof),
            f"{piece.number:,}",
            ", ".join(map(consequence_name, piece.consequences)) or "not stated",
            two_digits(piece.code.demand) if piece.code is not None and math.isfinite(piece.code.demand) else "–",
            given_number(piece.cost_of_all) if math.isfinite(piece.cost_of_all) else "–",
        )
        for piece in lines
    ]
    total = math.fsum(piece.cost_of_all for piece in lines)
    number = sum(piece.number for piece in lines)
    rows.append(("Total", "", f"{number:,}", "", "", given_number(total) if math.isfinite(total) else "–"))
    headings = ("piece", "floor", "pieces", "a fall could mean", "force each, N", f"cost, {money}" if money else "cost")
    return Rows("Table 1. What to anchor", headings, rows)


def block_rows(results: xr.Dataset) -> Rows | None:
    """Return the table of the blocks' sizes; None where the sizes are not known."""
    dim = "item" if "item" in results.dims else "block"
    columns = [
        (heading, results[name])
        for name, heading in (
            ("width", "width, m"),
            ("height", "height, m"),
            ("cm_height", "mass centre, m"),
            ("alpha", "α, rad"),
            ("R", "R, m"),
            ("p", "p, rad/s"),
            ("floor", "floor"),
            ("direction", "direction of its width"),
            ("count", "pieces"),
        )
        if name in results.coords and results[name].dims == (dim,)
    ]
    if not columns or dim not in results.dims:
        return None
    headings = [heading for heading, _ in columns]
    labels = [str(label) for label in np.atleast_1d(results[dim].values)]
    rows = [(_with_key(label), *(_cell(column.values[i]) for _, column in columns)) for i, label in enumerate(labels)]
    medians = fema_p58()["median"].to_series()
    if any(_key(label) in medians for label in labels):
        headings.append("FEMA P-58 median PGV, m/s")
        rows = [
            (*row, two_digits(medians[_key(label)]) if _key(label) in medians else "–")
            for row, label in zip(rows, labels, strict=True)
        ]
    if SCENE in results.coords:
        headings.append("stands")
        blocks = blocks_of(results if dim == "block" else results.rename(item="block"))
        rows = [(*row, _stands(block)) for row, block in zip(rows, blocks, strict=True)]
    chosen = chosen_of(results)
    title = "Items of the inventory" if dim == "item" else f"Blocks{': ' if chosen else ''}{chosen}"
    return Rows(title, (dim, *headings), rows)


def _key(label: str) -> str:
    """Return the key of the catalogue with which a label may begin."""
    return label.partition(",")[0]


def _with_key(label: str) -> str:
    """Return the title of a block, with the key of an item of the catalogue."""
    title = block_title(label)
    return title if title == label else f"{title} ({_key(label)})"


def _stands(block: Block) -> str:
    """Return what stands around a block or holds it, with the numbers of the study file."""
    words = block.scene_words
    held = block.restraint
    if held is not None and block.mass is not None:
        words += [] if held.rigid else [f"stiffness {given_number(1e-3 * held.stiffness)} N/mm"]
        words.append(f"{given_number(block.mass)} kg")
    return ", ".join(words) or "free"


def _cell(value: object) -> str:
    return short_digits(float(value)) if isinstance(value, float | np.floating) and np.isfinite(value) else str(value)


def provenance_rows(results: xr.Dataset, path: Path, state: str) -> Rows:
    """Return the table of the program and its versions, the study's identity, and the result file with its checksum."""
    versions = json.loads(str(results.attrs.get("package_versions", "{}")))
    packages = ", ".join(f"{name} {version}" for name, version in versions.items())
    rows = [
        ("toppling", str(results.attrs.get("toppling_version", ""))),
        ("packages", packages),
        ("processor", str(results.attrs.get("processor", results.attrs.get("machines", ""))).strip('[]"')),
        ("layout of the results (schema)", str(results.attrs.get("schema", ""))),
        ("identity of the study", str(results.attrs.get("identity", ""))),
        ("result file", path.name),
        ("its contents", state),
        ("its SHA-256", file_digest(path)),
    ]
    return Rows("Provenance", ("", ""), rows)
