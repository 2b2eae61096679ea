"""Page of the benchmark, with its targets, its tables as CSV files and its figure."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

from ..core.writing import whole_file, write_bytes
from ..studies.tables.table import Table
from . import figures, scenes, sliding, whole
from .measure import ENGINE, Row
from .pages.page import template
from .pages.tables import body
from .speed import EXACT_GEOMETRY, exact_over_linear
from .tables import INTEGRATORS, RIGHT, TABLES, error, next_right, percent, short

HELD = tuple(name for name in scenes.SCENES if name.startswith(("wall", "strap")))
EXACT_NS, EXACT_TARGET = 6.0, 10.0
"""Targets of the cost of a sample in exact geometry: ns, and over the cost in linear geometry."""
WHOLE_TARGET, TWO_THREADS_TARGET, CORES_TARGET = 1.15, 1.9, 12.0
"""Targets of an analysis: CPU time over its engine's on one thread; speed-up of two threads and of `CORES` cores."""
COMPILE_TARGET = 0.7 * 48.0
"""Target of the CPU time of compiling, s: 0.7 times its time in July 2026."""


def write(results: Row, folder: Path) -> list[Path]:
    """Write the tables of the measured parts, and the page and its figure if all were measured; return their paths."""
    data = folder / "performance"
    data.mkdir(parents=True, exist_ok=True)
    written = {}
    for part, tables in TABLES.items():
        for i, made in enumerate(tables(results[part]) if part in results else ()):
            lines = ([column.heading for column in made.columns], *map(made.cells, made.lines))
            written[data / f"{part}{f'_{i + 1}' if i else ''}.csv"] = _csv(lines)
    if "precision" in results:
        written[data / "integrators.csv"] = _csv(integrators(results["precision"]["rows"]))
    if results.keys() >= TABLES.keys():
        written[folder / "performance.md"] = text(results)
        with whole_file(data / "work_precision.png") as temporary:
            figures.work_precision(results["precision"]["rows"]).savefig(temporary, format="png", dpi=150)
    for path, content in written.items():
        write_bytes(path, content.encode())
    return [*written]


def _csv(lines: Iterable[Sequence[object]]) -> str:
    stream = io.StringIO()
    csv.writer(stream, lineterminator="\n").writerows(lines)
    return stream.getvalue()


def integrators(rows: Iterable[Row]) -> Iterable[Sequence[str]]:
    """Yield the lines of the file of every integrator under every law: cost and errors."""
    yield "law", "integrator", *INTEGRATORS
    for row in rows:
        numbers = ("" if row[name] is None else f"{row[name]:.3g}" for name in INTEGRATORS.values())
        yield short(row["law"]), row["name"], *numbers


def summary(results: Row) -> list[Table]:
    """Return all tables."""
    return [table for part, tables in TABLES.items() if part in results for table in tables(results[part])]


def text(results: Row) -> str:
    """Return the page as Markdown."""
    costs, threads, studies = results["speed"], results["scale"]["threads"], results["studies"]
    exact, linear = ([row for row in costs if (row["law"] == EXACT_GEOMETRY) == is_exact] for is_exact in (True, False))
    largest, machine = results["scale"]["points"][-1], results["machine"]
    versions = ", ".join(f"{name} {machine[name]}" for name in ("python", "numpy", "numba", "dask", "toppling"))
    return template("performance").format(
        command=results["command"],
        machine=f"{machine['processor']} with vectors of {machine['vectors']} bits ({machine['system']}; {versions})",
        **{
            f"{geometry}_{who}": _span([row[who] for row in rows])
            for geometry, rows in (("linear", linear), ("exact", exact))
            for who in ("engine", "yardstick")
        },
        runs=f"{largest['runs']:,}",
        wall=f"{largest['wall']:.1f}",
        memory=f"{largest['memory'] / 1e9:.2f}",
        memory_before=f"{largest['memory_before'] / 1e9:.2f}",
        targets=body(target.row for target in targets(results)),
        alone=percent(threads["serial"]),
        bound=f"{threads['bound']:.1f}",
        bound_outside=f"{threads['bound_outside']:.1f}",
        cores=whole.CORES,
        again=f"{studies['again']:.1f}",
        report=f"{studies['report']:.1f}",
        compiling=f"{studies['compiling']:.1f}",
        large_runs=f"{studies['large_runs']:,}",
        large_bound=f"{studies['bound']:.1f}",
        newmark=newmark(results["sliding"]["newmark"]),
        **_precision(results["precision"]),
        **_flags(results["flags"]),
    )


class Target(NamedTuple):
    """A quantity with its values and its target."""

    what: str
    values: Sequence[float]
    target: float
    digits: int = 2
    is_minimum: bool = False

    @property
    def met(self) -> bool:
        """True if all values meet the target."""
        return min(self.values) >= self.target if self.is_minimum else max(self.values) <= self.target

    @property
    def row(self) -> tuple[str, str, str, str]:
        """Row of the table of targets."""
        wanted = f"{'at least' if self.is_minimum else 'at most'} {self.target:.3g}"
        return self.what, _span(self.values, self.digits), wanted, "met" if self.met else "**missed**"


def targets(results: Row) -> list[Target]:
    """Return all targets."""
    exact = [row["engine"] for row in results["speed"] if row["law"] == EXACT_GEOMETRY]
    held = [row["ratio"] for row in results["scenes"] if row["scene"] in HELD]
    moving = [row["whole"] for row in results["sliding"]["cost"] if row["slips"]]
    threads, compiling = results["scale"]["threads"], results["studies"]["compiling"]
    over_engine = threads["rows"][0]["cpu"] / threads["rows"][0]["engine"]
    of_two = f"two threads over one, speed ({threads['runs']:,} runs)"
    timed = [*((row, "ms") for row in results["motions"]), *((row, "s") for row in results["start"] if row["target"])]
    return [
        Target("sample of a run in exact geometry, ns", exact, EXACT_NS, 1),
        Target("exact over linear geometry, cost", [*exact_over_linear(results["speed"]).values()], EXACT_TARGET, 1),
        Target("run with a wall or a strap over a free run, cost", held, scenes.TARGET),
        Target("sample of a sliding run, ns", moving, sliding.TARGET, 1),
        Target("analysis over its engine on one thread, CPU time", [over_engine], WHOLE_TARGET),
        Target(of_two, [threads["speed_up"]], TWO_THREADS_TARGET, is_minimum=True),
        Target(f"{whole.CORES} cores over one, bound of the speed", [threads["bound"]], CORES_TARGET, 1, True),
        Target("compiling, once, s of CPU time", [compiling], COMPILE_TARGET, 1),
        *(Target(f"{row['what']}, {unit} of CPU time", [row["cpu"]], row["target"]) for row, unit in timed),
    ]


def newmark(measured: Row) -> str:
    """Return the comparison of Newmark's sliding block with another program."""
    if not measured["rows"]:
        return f"Newmark's block is not compared with another program: {measured['missing']}."
    coarse, *_, fine = (
        max(row["median"] for row in measured["rows"] if row["steps"] == steps)
        for steps in sorted({row["steps"] for row in measured["rows"]})
    )
    ours, theirs = measured["costs"]
    return (
        f"Slips of Newmark's block are compared with pyslammer's `RigidAnalysis` under {measured['motions']} motions. "
        f"Its medians differ by up to {percent(coarse)}, and by up to {percent(fine)} with finer samples of the "
        f"motions ([sliding_2.csv](performance/sliding_2.csv)). A run takes the engine {1e6 * ours:,.0f} µs from "
        f"Python and pyslammer {1e3 * theirs:,.1f} ms."
    )


def _span(values: Iterable[float], digits: int = 1) -> str:
    """Return the smallest and the largest value, or the only one."""
    known = [*values]
    low, high = (f"{end:,.{digits}f}" for end in (min(known), max(known)))
    return low if low == high else f"{low}–{high}"


def _precision(measured: Row) -> Row:
    rows = measured["rows"]
    ours = [row for row in rows if row["name"] == ENGINE]
    rivals = [(row["cost"], next_right(row["law"], rows)) for row in ours]
    factors = [rival["cost"] / cost for cost, rival in rivals if rival is not None]
    worst = max(ours, key=lambda row: float("inf") if row["trajectory_max"] is None else row["trajectory_max"])
    none = len(ours) - len(factors)
    return {
        "wrong": sum(row["wrong_flags"] for row in ours),
        "flags": sum(row["flags"] for row in ours),
        "worst": error(worst["trajectory_max"]),
        "worst_law": short(worst["law"]),
        "twin": error(worst["twin"]),
        "right": error(RIGHT),
        "factors": _span(factors) if factors else "–",
        "none_right": f" No rival is right under {none} of {len(ours)} laws." if none else "",
        "left_out": "".join(f" Left out: {name}, {reason}." for name, reason in measured["missing"].items()),
    }


def _flags(rows: list[Row]) -> Row:
    names = dict.fromkeys(row["name"] for row in rows)
    changes = ("median_mean", "median_largest", "dispersion_mean", "dispersion_largest")
    lines = []
    for name in names:
        of_name = [row for row in rows if row["name"] == name]
        known = [row for row in of_name if row["median_largest"] is not None]
        wrong = _span([100.0 * row["wrong"] / row["runs"] for row in of_name], 2)
        most = [percent(max((row[change] for row in known), key=abs, default=None), signed=True) for change in changes]
        lines.append((name, wrong, *most))
    return {
        "flag_runs": f"{rows[0]['runs']:,}",
        "flag_laws": len({row["law"] for row in rows}),
        "most_wrong": f"{max(100.0 * row['wrong'] / row['runs'] for row in rows):.2f}",
        "flag_table": body(lines),
    }
