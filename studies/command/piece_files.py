"""Tables of results for spreadsheets: the pieces of a performance study (CSV or XLSX), or blocks' rates (XLSX)."""

from pathlib import Path

import xarray as xr

from ...core.wording import confidence_text
from ...core.writing import write_bytes
from ..report.results_file import read_results
from ..store.content import check_content
from ..store.outputs import own_files
from ..tables.files import csv_bytes, workbook
from ..tables.fragility import exported_rates
from ..tables.kits import exported_kits
from ..tables.pieces import exported_pieces
from ..tables.table import Column, Table
from ..text.error import StudyError, writing
from ..text.spread import MODEL_RANGE, of_what
from ..text.words import axis_of, level_name, level_text, reference_law
from .export import PERFORMANCE, laws_of


def write_pieces(result: Path, folder: Path, format_: str, model: str | None = None, verify: bool = False) -> Path:
    """Write the table of a performance study's pieces under one law, or of blocks' rates; return the file.

    A CSV file is in SI units, and ``kits.csv`` contains the kits. An XLSX workbook has a sheet of that table, a sheet
    of it in units of the tables, and sheets of kits and on its contents. In a CSV file, texts that a spreadsheet would
    take for formulas begin with an apostrophe.
    """
    with read_results(result) as results:
        check_content(result, results, verify)
        tables = _tables(results, result, model, readable=format_ == "xlsx")
    name = next(iter(tables))
    path = folder / f"{name}.{format_}"
    if format_ == "xlsx":
        files = {path.name: workbook(tables)}
    else:
        files = {f"{of}.csv": csv_bytes(table) for of, table in tables.items() if of != ABOUT}
    with writing(path), own_files(folder, f"export {format_} {name}", [*files]):
        for file, written in files.items():
            write_bytes(folder / file, written)
    return path


def _tables(results: xr.Dataset, path: Path, model: str | None, readable: bool) -> dict[str, Table]:
    """Return the tables by name: of pieces or rates, of kits if there are any, and about their contents."""
    about = [
        ["study", str(results.attrs.get("title", ""))],
        ["intensity measure", str(axis_of(results).attrs.get("long_name", results.attrs.get("im", "")))],
        ["intervals", f"{confidence_text(results)} for the number of motions; hazard curves as given"],
    ]
    beta = float(results.attrs.get("modelling_dispersion", 0.0))
    held = f"β_m = {beta:g}" if beta else "none in rates and chances"
    if beta and str(results.attrs.get("modelling")) == "fractiles":
        held = f"β_m = {beta:g} in ranges over branches, none in other rates and chances"
    about.append(["modelling uncertainty", held])
    if of_what(results):
        about.append([MODEL_RANGE, of_what(results)])
    version = ["toppling", str(results.attrs.get("toppling_version", ""))]
    if str(results.attrs["kind"]) != PERFORMANCE:
        if "rate" not in results or "block" not in results["rate"].dims:
            raise StudyError(
                f"{path}: --format xlsx is for pieces and annual rates, and there is no [hazard]: csv holds curves"
            )
        laws = None if model is None else laws_of(results, model, path).tolist()
        about += [["chances", "of at least one fall, from the annual rate"], version]
        return {"rates": exported_rates(results, laws), ABOUT: _about(about)}
    at = reference_law(results)[0] if model is None else int(laws_of(results, model, path)[0])
    code = f"{results.attrs['code']} ({results.attrs['code_site']})" if "code" in results.attrs else "not checked"
    about += [
        ["damping law", str(results["model"].values[at])],
        ["chances, values and costs", "of one piece; savings and paybacks are of the line"],
        ["code requirements", code],
        version,
    ]
    if "rate" not in results and "at_level" in results.attrs:
        about.append(["level of shaking", _level(results)])
    kits = {"kits": exported_kits(results, at)} if "kit_falls" in results else {}
    return {"pieces": exported_pieces(results, at, readable), **kits, ABOUT: _about(about)}


ABOUT = "about"
"""Name of the sheet on the contents of a workbook."""


def _about(rows: list[list[str]]) -> Table:
    return Table("About", (Column("what"), Column("is")), [{"what": what, "is": text} for what, text in rows])


def _level(results: xr.Dataset) -> str:
    return f"{level_name(results)} = {level_text(float(results.attrs['at_level']), results['level'])}"
