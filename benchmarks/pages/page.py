"""Where pages go, how their templates are filled, and what few motions change."""

from __future__ import annotations

import csv
import re
import shutil
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import xarray as xr
from matplotlib.figure import Figure

import toppling as tp

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
FEW = "--few" in sys.argv
"""True if pages have a tenth of their motions, which shows that they are made as before."""
RESULTS = ROOT / "results/few" if FEW else ROOT / "results"
"""Folder of finished studies, which are kept."""
OUT = RESULTS if FEW else ROOT / "docs"
"""Folder of the pages."""


def some(number: int, few: int = 0) -> int:
    """Return a number of motions or draws; with few motions the second, or a tenth."""
    return (few or number // 10) if FEW else number


def example(name: str) -> Path:
    """Return the file of an example study; with few motions, of a copy, if it does not select them."""
    path = ROOT / f"studies/examples/{name}.toml"
    text = path.read_text(encoding="utf-8")
    if not FEW or "[stripes.select]" in text:
        return path
    copied = Path(shutil.copytree(path.parent, RESULTS / "studies", dirs_exist_ok=True)) / path.name
    copied.write_text(re.sub(r"(?m)^number = (\d+)0\b", r"number = \1", text), encoding="utf-8")
    return copied


def study(name: str) -> tp.Study:
    """Return an example study."""
    return tp.Study.from_toml(example(name))


def results(name: str) -> xr.Dataset:
    """Return the results of an example study, from its folder if they are there."""
    return study(name).run(RESULTS / name)


def template(name: str) -> str:
    """Return the text of a page, with names of values in braces."""
    return (HERE / f"{name}.md.in").read_text(encoding="utf-8")


def folder(name: str) -> Path:
    """Return the folder of a page's figures."""
    place = OUT / name
    place.mkdir(parents=True, exist_ok=True)
    return place


def save(name: str, figures: Mapping[str, Figure], dpi: int, **options: Any) -> None:
    """Write the figures of a page."""
    for figure, drawn in figures.items():
        drawn.savefig(folder(name) / f"{figure}.png", dpi=dpi, **options)


Table = tuple[Sequence[str], Iterable[Sequence[object]]]
"""Headings and rows."""


def write_csv(name: str, table: str, headings: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write a table of a page as a CSV file."""
    with (folder(name) / f"{table}.csv").open("w", encoding="utf-8", newline="") as stream:
        csv.writer(stream, lineterminator="\n").writerows([headings, *rows])


def write(name: str, text: str) -> None:
    """Write a page."""
    OUT.mkdir(parents=True, exist_ok=True)
    (OUT / f"{name}.md").write_text(text, encoding="utf-8")
