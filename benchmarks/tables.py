"""Tables of the benchmark's results, the same for the terminal and the page."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

from ..studies.tables.table import Column, Table
from .measure import ENGINE, Row
from .problems import CASES
from .speed import YARDSTICK
from .whole import CORES

RIGHT = 1e-6
"""Largest error of the trajectory, over alpha, of an integrator that is called right."""
INTEGRATORS = {
    "ns": "cost",
    "trajectory_largest": "trajectory_max",
    "trajectory_median": "trajectory_median",
    "peak_largest": "peak_max",
    "wrong_flags": "wrong_flags",
    "flags": "flags",
}
"""Columns of numbers in the file of all integrators; an empty cell diverges."""


def error(value: float | None) -> str:
    """Return an error in one significant digit."""
    if value is None:
        return "diverges"
    return "0" if value == 0.0 else f"{value:.0e}".replace("e-0", "e-").replace("e+00", "").replace("e+0", "e+")


def cost(value: float) -> str:
    """Return a cost in ns, in two or three digits."""
    return f"{value:.1f}" if value < 100.0 else f"{value:,.0f}"


def percent(value: float | None, signed: bool = False) -> str:
    """Return a share or a relative change in per cent."""
    if value is None:
        return "–"
    shown = f"{100.0 * value:{'+' if signed else ''}.{1 if abs(value) >= 0.00095 else 2}f}"
    return f"{'0' if float(shown) == 0.0 else shown.replace('-', '−')} %"


def short(law: str) -> str:
    """Return a law's label without the options that all laws share."""
    name = law.replace(" e=0.9", "").replace(" δ=0.05", "")
    return f"{name} geometry=exact" if name == "housner" else name


def table(title: str, headings: Sequence[str], lines: Sequence[Sequence[str]]) -> Table:
    """Return a table of texts, with numbers to the right of the first column."""
    columns = [Column(str(i), heading, "short" if i else "text") for i, heading in enumerate(headings)]
    return Table(title, columns, [{str(i): cell for i, cell in enumerate(line)} for line in lines])


def _speed(rows: Sequence[Row]) -> Iterator[Table]:
    headings = ("engine", "RK4", "ratio")
    cells = [(row["law"], (cost(row["engine"]), cost(row["yardstick"]), f"{row['share']:.2f}")) for row in rows]
    laws = dict.fromkeys(law for law, _ in cells)
    lines = [(short(law), *(cell for of, row in cells if of == law for cell in row)) for law in laws]
    title = f"ns per sample and run, engine without skipping and {YARDSTICK.name}"
    yield table(title, ("law", *(f"{case}: {heading}" for case in CASES for heading in headings)), lines)


def _scenes(rows: Sequence[Row]) -> Iterator[Table]:
    laws = list(dict.fromkeys(row["law"] for row in rows))
    known = {(row["scene"], row["law"]): (f"{row['cost']:.1f}", f"{row['ratio']:.2f}") for row in rows}
    lines = [
        (scene, *(cell for law in laws for cell in known.get((scene, law), ("–", "–"))))
        for scene in dict.fromkeys(row["scene"] for row in rows)
    ]
    headings = ("scene", *(f"{short(law)}: {heading}" for law in laws for heading in ("µs", "ratio")))
    yield table("Cost of a run in a scene, and over a run of the free block", headings, lines)


def _sliding(measured: Row) -> Iterator[Table]:
    headings = ("shaking", "PFA, m/s²", "vertical, m/s²", "slips in 1,000 samples", "ns", "with skips, ns")
    lines: list[tuple[str, ...]] = []
    for row in measured["cost"]:
        shaking = (row["case"], f"{row['horizontal']:g}", f"{row['vertical']:g}" if row["vertical"] else "–")
        lines.append((*shaking, f"{row['slips']:.1f}", f"{row['whole']:.2f}", f"{row['skipping']:.2f}"))
    yield table("ns per sample and run of sliding blocks", headings, lines)
    rows = measured["newmark"]["rows"]
    if not rows:
        return
    steps = dict.fromkeys(row["steps"] for row in rows)
    columns = ("k_y/PFA", "median slip, m", *(f"{n}: {heading}" for n in steps for heading in ("median", "largest")))
    lines = []
    for ratio in dict.fromkeys(row["ratio"] for row in rows):
        of_ratio = [row for row in rows if row["ratio"] == ratio]
        cells = [percent(row[name]) for row in of_ratio for name in ("median", "largest")]
        lines.append((f"{ratio:g}", f"{of_ratio[0]['slip']:.2g}", *cells))
    yield table("pyslammer's slips of Newmark's block: difference by samples for one of the record", columns, lines)


def _scale(measured: Row) -> Iterator[Table]:
    lines: list[tuple[str, ...]] = []
    for point in measured["points"]:
        wall, memory, before = point["wall"], point["memory"] / 1e6, point["memory_before"] / 1e6
        seconds = f"{wall:.3f}" if wall < 1.0 else f"{wall:.1f}"
        used, a_run = f"{point['cpu'] / wall:.2f}", f"{1e6 * point['cpu'] / point['runs']:.1f}"
        lines.append((f"{point['runs']:,}", seconds, used, a_run, f"{memory:,.0f}", f"{before:,.0f}"))
    headings: tuple[str, ...] = (
        *("runs", "wall time, s", "cores in use", "CPU time a run, µs"),
        *("peak memory, MB", "of it before the analysis, MB"),
    )
    yield table("Cost of an IDA with two threads, flags only", headings, lines)
    threads = measured["threads"]
    lines = [
        (str(row["threads"]), *(f"{row[name]:.2f}" for name in ("wall", "cpu", "engine", "alone")))
        for row in threads["rows"]
    ]
    headings = ("threads", "wall time, s", "CPU time, s", "of it the engine's, s", "the calling thread's, s")
    yield table(f"An analysis of {threads['runs']:,} runs by threads", headings, lines)


def _motions(rows: Sequence[Row]) -> Iterator[Table]:
    lines = [(row["what"], f"{row['cpu']:.2f}", f"{row['target']:g}") for row in rows]
    yield table("Motions, CPU time of one thread", ("what", "ms a motion", "target, ms"), lines)


def _start(rows: Sequence[Row]) -> Iterator[Table]:
    lines = [
        (row["what"], f"{row['cpu']:.2f}", "–" if row["target"] is None else f"{row['target']:.2f}") for row in rows
    ]
    yield table("Starting up, CPU time of a whole process", ("what", "CPU time, s", "target, s"), lines)


def _studies(measured: Row) -> Iterator[Table]:
    names = {
        "first": "office study, first run after installation",
        "compiling": "of it, compiling",
        "again": "office study, later runs",
        "libraries": "of it, loading libraries",
        "report": "its report",
        "report_libraries": "of it, loading libraries",
        "large_cpu": f"large study, {measured['large_runs']:,} runs, two threads",
    }
    lines = [(text, f"{measured[name]:.1f}") for name, text in names.items()]
    yield table("Frozen studies, CPU time", ("what", "CPU time, s"), lines)
    columns = {
        "one thread, s": f"{measured['wall_one']:.1f}",
        "two threads, s": f"{measured['wall_two']:.1f}",
        "speed-up": f"{measured['speed_up']:.2f}",
        "serial, s": f"{measured['serial']:.1f}",
        "of one thread's time": percent(measured["serial"] / measured["wall_one"]),
        f"bound on {CORES} cores": f"{measured['bound']:.1f}",
    }
    yield table("The large study by threads, wall time", [*columns], [[*columns.values()]])


def next_right(law: str, rows: Sequence[Row]) -> Row | None:
    """Return the cheapest rival that is right under a law."""
    right = [
        row
        for row in rows
        if row["law"] == law
        and row["name"] != ENGINE
        and row["trajectory_max"] is not None
        and row["trajectory_max"] <= RIGHT
        and not row["wrong_flags"]
    ]
    return min(right, key=lambda row: float(row["cost"]), default=None)


def _precision(measured: Row) -> Iterator[Table]:
    headings = (
        *("law", "ns", "error", "1e-13 moves the truth by", "wrong flags"),
        *("cheapest right rival", "its ns", "its error"),
    )
    lines = []
    for ours in (row for row in measured["rows"] if row["name"] == ENGINE):
        rival = next_right(ours["law"], measured["rows"])
        theirs = ("none", "–", "–")
        if rival is not None:
            theirs = (rival["name"], cost(rival["cost"]), error(rival["trajectory_max"]))
        flags = f"{ours['wrong_flags']} of {ours['flags']}"
        cells = (short(ours["law"]), cost(ours["cost"]), error(ours["trajectory_max"]), error(ours["twin"]), flags)
        lines.append((*cells, *theirs))
    yield table("The engine against the 40-digit truth: largest error of the trajectory over α", headings, lines)


def _flags(rows: Sequence[Row]) -> Iterator[Table]:
    headings = (
        *("law", "integrator", "wrong flags", "share", "of them overturned"),
        *("median: mean change", "largest", "β: mean change", "largest"),
    )
    changes = [f"{name}_{kind}" for name in ("median", "dispersion") for kind in ("mean", "largest")]
    lines = [
        (
            short(row["law"]),
            row["name"],
            f"{row['wrong']:,} of {row['runs']:,}",
            percent(row["wrong"] / row["runs"]),
            f"{row['falsely_overturned']:,}",
            *(percent(row[name], signed=True) for name in changes),
        )
        for row in rows
    ]
    yield table("Wrong verdicts", headings, lines)


TABLES: dict[str, Callable[[Any], Iterator[Table]]] = {
    "speed": _speed,
    "scenes": _scenes,
    "sliding": _sliding,
    "scale": _scale,
    "motions": _motions,
    "start": _start,
    "studies": _studies,
    "precision": _precision,
    "flags": _flags,
}
"""Tables of each part of the benchmark, in the order in which the parts are measured."""
