"""Expected numbers of the studies: `python tests/golden/expect.py [PATTERN]` computes them again and writes them.

Main variables are kept with their dimensions and units.  Flags, counts and words are exact, and floats have all digits.
Of a larger array of floats there are a few values, the extremes and a sum that depends on the order.

`page.json` has what the page of a study says: the facts of each section and the rows of each table, without sentences.
"""

import json
import sys
import tempfile
from collections.abc import Iterator, Mapping
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from case import Case
from numpy.typing import NDArray
from study_cases import folders, inputs, settings

import toppling as tp
from toppling.studies.facts.bars import bars_of
from toppling.studies.facts.notes import notes_of
from toppling.studies.facts.sections import fact_json, sections
from toppling.studies.tables.files import table_json
from toppling.studies.tables.registry import REGISTRY, tables
from toppling.studies.text.reached import within_levels

EXPECTED = "expected.json"
PAGE = "page.json"
NOT_MAIN = (
    *("account", "slip_account"),
    *("region_*", "near_*", "curve_*s", "curve_covariance", "rate_coefficients", "run_model", "run_motion"),
    *("aic", "converged", "penalised*", "failed_replicates", "undecided_lower", "undecided_upper", "perturbed"),
    *("few_motions", "squat", "interval_half_width", "band_*", "friction_*_demand"),
)
"""Sentences, which later issues reword, the working of a surface and of fits, and what the screen compares."""
MANY = 10
"""Largest size of an array whose values are all kept."""
SPREAD = 5
"""Number of values that are kept of a larger one."""
BYTE = 256
SMALL = 1e-6
"""Share of a variable's largest value below which differences are relative to it: what cancels leaves 1e-16 of it."""
TOLERANCE = 1e-9
OF_PAGE = 1e-5
"""Tolerance of what a page says, which has few digits."""
MOST_ROWS = 30
"""Most rows that are kept of a table."""


def compute(folder: Path, out: Path) -> xr.Dataset:
    """Return the results of a study, whose files are copied into a new folder."""
    Case(folder.name, inputs(folder), ()).write(out)
    return tp.Study.from_toml(out / "study.toml").run(out / "out")


def summary(results: xr.Dataset) -> dict[str, list[Any]]:
    """Return what is expected of the variables of some results."""
    names = (str(name) for name in sorted(results.data_vars))
    return {
        name: _of_variable(results[name]) for name in names if not any(fnmatch(name, pattern) for pattern in NOT_MAIN)
    }


def _of_variable(array: xr.DataArray) -> list[Any]:
    """Return the dimensions, unit and values of a variable."""
    values = array.values.ravel()
    sizes = " ".join(f"{dimension}={size}" for dimension, size in array.sizes.items())
    return [sizes, array.attrs.get("units", ""), _of_values(values)]


def _of_values(values: NDArray[Any]) -> Any:
    """Return values as a list, flags and small integers as digits of a byte string, or what sums up the rest."""
    if values.dtype.kind not in "biuf" or values.size <= MANY:
        return values.tolist()
    if values.dtype.kind == "b" or (values.dtype.kind in "iu" and set(values.tolist()) <= {0, 1}):
        return "flags " + np.packbits(values.astype(bool)).tobytes().hex()
    if values.dtype.kind in "iu" and values.min() >= -BYTE // 2 and values.max() < BYTE:
        return "bytes " + values.astype(np.int64).astype(np.uint8).tobytes().hex()
    numbers = values.astype(float)
    finite = numbers[np.isfinite(numbers)]
    return {
        "not_numbers": int(np.isnan(numbers).sum()),
        "infinite": int(np.isinf(numbers).sum()),
        # All terms are positive, so that rounding stays small; the factor of 3 distinguishes negative values.
        "weighted_sum": float(np.where(finite < 0, -3 * finite, finite) @ np.arange(1.0, finite.size + 1)),
        "extremes": [finite.min(), finite.max()] if finite.size else [],
        "some": numbers[np.linspace(0, numbers.size - 1, SPREAD).round().astype(int)].tolist(),
    }


def said(results: xr.Dataset) -> dict[str, list[Any]]:
    """Return what the page of some results says: facts by section, all notes, bars, and rows of the tables."""
    by_section = {**sections(results), "notes": notes_of(results)}
    facts = {name: [fact_json(fact, "") for fact in of_section] for name, of_section in by_section.items()}
    bars = bars_of(within_levels(results))
    facts["bars"] = [list(bar) for group in bars.groups.values() for bar in group] if bars else []
    rows = {
        f"table {name}": [row for table in tables(results, [name]) for row in table_json(table)["rows"][:MOST_ROWS]]
        for name in REGISTRY
    }
    return {name: _rounded(entries) for name, entries in (facts | rows).items() if entries}


def _rounded(value: Any) -> Any:
    """Return a value of JSON with numbers of nine digits."""
    if isinstance(value, dict):
        return {name: _rounded(part) for name, part in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(part) for part in value]
    return float(f"{value:.9g}") if isinstance(value, float) else value


def otherwise_said(old: Any, new: Any, place: str = "page") -> Iterator[str]:
    """Yield a line for each place of a page that is missing, additional or different."""
    if type(old) is type(new) and isinstance(old, dict):
        for name in sorted(old.keys() | new.keys()):
            yield from otherwise_said(old.get(name), new.get(name), f"{place}: {name}")
    elif type(old) is type(new) and isinstance(old, list) and len(old) == len(new):
        for i, pair in enumerate(zip(old, new, strict=True)):
            yield from otherwise_said(*pair, f"{place} {i}")
    elif _difference(old, new) > OF_PAGE:
        yield f"{place}: {old} became {new}"


def differences(expected: Mapping[str, list[Any]], results: xr.Dataset, looser: Mapping[str, float]) -> Iterator[str]:
    """Yield a line for each variable that is missing, additional or different, with the size of its difference."""
    actual = summary(results)
    for name in sorted(expected.keys() | actual.keys()):
        if name not in actual or name not in expected:
            yield f"{name}: {'missing' if name in expected else 'additional'}"
            continue
        old, new = expected[name], actual[name]
        size = _difference(old, new)
        if size > looser.get(name, TOLERANCE):
            yield f"{name} differs by {size:.2g}: {old} became {new}"


def _difference(old: Any, new: Any, scale: float = 0.0) -> float:
    """Return the largest difference of floats, relative to them or to a scale, and infinity for what is not equal."""
    if isinstance(old, dict) and isinstance(new, dict) and old.keys() == new.keys():
        scale = SMALL * max((abs(value) for value in old["extremes"]), default=0.0)
        return max(_difference(old[key], new[key], scale) for key in old)
    if isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        finite = [abs(value) for value in old if isinstance(value, float) and np.isfinite(value)]
        scale = max(scale, SMALL * max(finite, default=0.0))
        return max((_difference(*pair, scale) for pair in zip(old, new, strict=True)), default=0.0)
    if old == new or (isinstance(old, float) and isinstance(new, float) and np.isnan(old) and np.isnan(new)):
        return 0.0
    if isinstance(old, float) and isinstance(new, float) and np.isfinite(old) and np.isfinite(new):
        return abs(new - old) / max(abs(old), abs(new), scale)
    return float("inf")


def write(folder: Path) -> None:
    """Write the expected numbers and the page of a study, a line for each variable, fact and row."""
    with tempfile.TemporaryDirectory() as out:
        results = compute(folder, Path(out) / "study")
    numbers = (f"{json.dumps(name)}: {_line(entry)}" for name, entry in summary(results).items())
    page = (
        f"{json.dumps(name)}: [\n" + ",\n".join(map(_line, entries)) + "\n]" for name, entries in said(results).items()
    )
    for name, lines in ((EXPECTED, numbers), (PAGE, page)):
        (folder / name).write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")


def _line(entry: Any) -> str:
    """Return a value as JSON in one line."""
    return json.dumps(entry, separators=(",", ":"), ensure_ascii=False)


def tolerances(folder: Path) -> dict[str, float]:
    """Return the variables of a study that do not hold to `TOLERANCE`, and what they hold to."""
    return {name: entry["relative"] for name, entry in settings(folder).get("tolerances", {}).items()}


def read(folder: Path, name: str = EXPECTED) -> dict[str, list[Any]]:
    """Return the expected numbers of a study, or its page."""
    expected: dict[str, list[Any]] = json.loads((folder / name).read_text(encoding="utf-8"))
    return expected


if __name__ == "__main__":
    for study in folders():
        if fnmatch(study.name, sys.argv[1] if len(sys.argv) > 1 else "*"):
            print(study.name, flush=True)
            write(study)
