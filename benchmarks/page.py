"""Page of the benchmark: the template performance.md.in with every number from the results."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable
from pathlib import Path

from jinja2 import Environment, StrictUndefined

from ..core.writing import whole_file, write_bytes
from ..studies.tables.table import Table
from . import figures, scenes, whole
from .measure import ENGINE, Row
from .pages.tables import table as markdown
from .sliding import TARGET as SLIDING_TARGET
from .speed import EXACT_GEOMETRY, exact_over_linear
from .tables import INTEGRATORS, RIGHT, TABLES, error, next_right, percent, short

PAGE, DATA, FIGURE = "performance.md", "integrators.csv", "work_precision.png"
CONSTANTS = {
    "EXACT_GEOMETRY": EXACT_GEOMETRY,
    "SCENE_TARGET": scenes.TARGET,
    "HELD": [name for name in scenes.SCENES if name.startswith(("wall", "strap"))],
    "SLIDING_TARGET": SLIDING_TARGET,
    "SAMPLE_TARGET": whole.MOTION_TARGET,
    "MEASURE_TARGET": whole.MEASURE_TARGET,
    "CORES": whole.CORES,
    "RIGHT": RIGHT,
    # cost of a sample of exact geometry, ns, and over that of linear geometry
    "EXACT_NS": 6.0,
    "EXACT_TARGET": 10.0,
    # an analysis: speed-up of two threads and on `CORES` cores; CPU time on one thread over that of its engine
    "TWO_THREADS_TARGET": 1.9,
    "CORES_TARGET": 12.0,
    "WHOLE_TARGET": 1.15,
    # CPU time of compiling the office study's kernels, s: 0.7 of what it took in July 2026
    "COMPILE_TARGET": 0.7 * 48.0,
}
"""Names in the template that do not depend on the results."""


def write(results: Row, folder: Path) -> list[Path]:
    """Write the page, its data and the figures of the measured parts; return their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    written = [folder / PAGE]
    write_bytes(folder / PAGE, text(results).encode())
    if "precision" in results:
        found = results["precision"]["found"]
        written += [folder / DATA, folder / FIGURE]
        write_bytes(folder / DATA, integrators(found).encode())
        with whole_file(folder / FIGURE) as temporary:
            figures.work_precision(found).savefig(temporary, format="png", dpi=150)
    return written


def integrators(rows: Iterable[Row]) -> str:
    """Return cost and errors of every integrator under every law as CSV."""
    stream = io.StringIO()
    lines = csv.writer(stream, lineterminator="\n")
    lines.writerow(["law", "integrator", *INTEGRATORS])
    for row in rows:
        numbers = ["" if row[name] is None else f"{row[name]:.3g}" for name in INTEGRATORS.values()]
        lines.writerow([short(row["law"]), row["name"], *numbers])
    return stream.getvalue()


def text(results: Row) -> str:
    """Return the page as Markdown."""
    environment = Environment(
        trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True, undefined=StrictUndefined, autoescape=False
    )
    environment.filters |= {
        "each": lambda rows, name: [row[name] for row in rows],
        "error": error,
        "groupby_name": lambda rows: [
            (name, [row for row in rows if row["name"] == name]) for name in dict.fromkeys(row["name"] for row in rows)
        ],
        "met": lambda value, target: "met" if value <= target else "**missed**",
        "percent": percent,
        "short": short,
        "span": span,
        "verdict": verdict,
    }
    numbers: Row = dict.fromkeys(TABLES)
    numbers |= {"factors": [], "mean": None, **CONSTANTS, **results}
    if "speed" in results:
        numbers["exact_over_linear"] = exact_over_linear(results["speed"])
    if "scenes" in results:
        numbers["scenes"] = [{**row, "what": f"{row['scene']} under {short(row['law'])}"} for row in results["scenes"]]
    if "precision" in results:
        numbers |= _of_precision(results["precision"]["found"])
    if "flags" in results:
        numbers |= _of_flags(results["flags"])
    shown = {
        part: [
            markdown([column.heading for column in made.columns], map(made.cells, made.lines))
            for made in tables(results[part])
        ]
        for part, tables in TABLES.items()
        if part in results
    }
    template = Path(__file__).with_name("performance.md.in").read_text(encoding="utf-8")
    return environment.from_string(template).render(numbers, tables=shown)


def summary(results: Row) -> list[Table]:
    """Return all tables."""
    return [table for part, tables in TABLES.items() if part in results for table in tables(results[part])]


def span(values: Iterable[float], digits: int = 1) -> str:
    """Return the least and the largest value, or the only one."""
    known = list(values)
    low, high = f"{min(known):,.{digits}f}", f"{max(known):,.{digits}f}"
    return low if low == high else f"{low}–{high}"


def verdict(
    rows: Iterable[Row], of: str, target: float | None, specification: str, name: str = "law", unit: str = ""
) -> str:
    """Return "met", or the rows above a target, their own without one, with their values."""
    over = [
        f"{short(row[name])} ({row[of]:{specification}}{unit})"
        for row in rows
        if row[of] > (row["target"] if target is None else target)
    ]
    return f"**missed** by {', '.join(over)}" if over else "met"


def _of_precision(rows: list[Row]) -> Row:
    ours = [row for row in rows if row["name"] == ENGINE]
    rivals = [(row["cost"], next_right(row["law"], rows)) for row in ours]
    return {
        "ours": ours,
        "worst": max(ours, key=lambda row: float("inf") if row["trajectory_max"] is None else row["trajectory_max"]),
        "factors": [rival["cost"] / cost for cost, rival in rivals if rival is not None],
    }


def _of_flags(rows: list[Row]) -> Row:
    changes = [row for row in rows if row["median_largest"] is not None]
    most = {
        name: max(changes, key=lambda row: abs(row[of]), default=None)
        for name, of in (("mean", "median_mean"), ("most_moved", "median_largest"))
    }
    return {**most, "flags": [{**row, "wrong_percent": 100.0 * row["wrong"] / row["runs"]} for row in rows]}
