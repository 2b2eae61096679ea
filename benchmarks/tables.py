"""Tables of the benchmark's results as strings, the same for the terminal and the page."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from .measure import ENGINE, Row
from .mixing import LEVELS
from .precision import ALL_LAWS, DEAR, FAILED, MISSING, UNABLE
from .speed import YARDSTICK

TARGETS = {"K": 1.0 / 3.0, "B": 1.0 / 6.0}
"""Target cost of the engine over that of plain Runge-Kutta, by case."""
EXACT_NS = 6.0
"""Cost of a sample of exact geometry, ns."""
EXACT_TARGET = 10.0
SHARE_TARGET = 0.85
SHARED = "e = 0.9 and δ = 0.05 wherever a law has them"
RIGHT = 1e-6
"""Largest error of the trajectory, over alpha, of an integrator that is called right."""


class Table(NamedTuple):
    """Title, headings (the first column is text, the others are figures) and rows of a table."""

    title: str
    headings: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]


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


def span(values: Iterable[float], digits: int = 1) -> str:
    """Return the least and the largest value, or the only one."""
    known = list(values)
    low, high = f"{min(known):,.{digits}f}", f"{max(known):,.{digits}f}"
    return low if low == high else f"{low}–{high}"


def short(law: str) -> str:
    """Return a law's label without the options that all laws share (see `SHARED`)."""
    name = law.replace(" e=0.9", "").replace(" δ=0.05", "")
    return f"{name} geometry=exact" if name == "housner" else name


def fraction(target: float) -> str:
    """A target as people say it."""
    return f"1/{round(1.0 / target)}"


SHARES = ("share", "share_passing")
"""The two ratios of `speed`."""


def speed_table(rows: Sequence[Row]) -> Table:
    """Return the costs of each law, with both cases in one row."""
    each = ("engine", "RK4", "ratio", "passing over rest")
    headings = ("law", *(f"{case}: {one}" for case in TARGETS for one in each))
    lines = []
    for law in laws_of(rows):
        cells = []
        star = ""
        for case, target in TARGETS.items():
            for row in (r for r in rows if r["law"] == law and r["case"] == case):
                star = " *" if row["rigid"] else ""
                ratios = [f"{row[name]:.3f}" + ("\u00a0✓" if row[name] <= target else "") for name in SHARES]
                cells += [cost(row["engine"]), cost(row["yardstick"]), *ratios]
        lines.append((short(law) + star, *cells))
    return Table(f"ns per sample and run, engine without skipping and {YARDSTICK.name}", headings, lines)


def mixing_table(rows: Sequence[Row]) -> Table:
    """Return the cost of a run in batches of one motion and of many, and of a motion at few levels."""
    levels = f"{len(LEVELS)} levels of a motion"
    headings = (
        "law",
        "one motion, µs",
        "mixed, µs",
        "of it before the run, µs",
        "ratio",
        f"{levels}, µs",
        "motion by motion, µs",
    )
    figures = ("shared", "mixed", "before", "ratio", "levels", "alone")
    digits = (1, 1, 1, 2, 0, 0)
    lines = [
        (short(row["law"]), *(f"{row[name]:.{n}f}" for name, n in zip(figures, digits, strict=True))) for row in rows
    ]
    return Table("Cost of a run where few share a motion", headings, lines)


def scenes_table(rows: Sequence[Row]) -> Table:
    """Return the cost of a run in each scene under each law, and over that of the free block."""
    laws = laws_of(rows)
    lines = []
    for scene in dict.fromkeys(row["scene"] for row in rows):
        cells = []
        for law in laws:
            here = [row for row in rows if row["law"] == law and row["scene"] == scene]
            cells += [f"{here[0]['cost']:.1f}", f"{here[0]['ratio']:.2f}"] if here else ["–", "–"]
        lines.append((scene, *cells))
    headings = ("scene", *(f"{short(law)}: {one}" for law in laws for one in ("µs", "ratio")))
    return Table("Cost of a run in a scene, and over that of the free block", headings, lines)


def sliding_table(rows: Sequence[Row]) -> Table:
    """Return the cost of a sample of a sliding run in each case."""
    headings = ("shaking", "PFA, m/s²", "vertical, m/s²", "slips in 1,000 samples", "ns", "with skips, ns")
    lines = [
        (
            row["case"],
            f"{row['horizontal']:g}",
            f"{row['vertical']:g}" if row["vertical"] else "–",
            f"{row['slips']:.1f}",
            f"{row['whole']:.2f}",
            f"{row['skipping']:.2f}",
        )
        for row in rows
    ]
    return Table("ns per sample and run of sliding blocks", headings, lines)


def newmark_table(rows: Sequence[Row]) -> Table:
    """Return the differences of pyslammer's one-way slips from the engine's."""
    steps = list(dict.fromkeys(row["steps"] for row in rows))
    headings = ("k_y/PFA", "median slip, m", *(f"{n}: {one}" for n in steps for one in ("median", "largest")))
    lines = []
    for ratio in dict.fromkeys(row["ratio"] for row in rows):
        here = [row for row in rows if row["ratio"] == ratio]
        cells = [percent(row[name]) for row in here for name in ("median", "largest")]
        lines.append((f"{ratio:g}", f"{here[0]['slip']:.2g}", *cells))
    return Table("pyslammer's slips of Newmark's block: difference by samples for one of the record", headings, lines)


def skipping_table(rows: Sequence[Row]) -> Table:
    """Return the speed-up by skipping, and the share of samples that are left out."""
    headings = (
        *("law", "no skipping, ns", "after overturning"),
        *("peaks: times faster", "left out", "flags only: times faster", "left out"),
    )
    lines = [
        (
            short(row["law"]),
            cost(row["whole"]),
            percent(row["after_overturning"]),
            f"{row['peaks']:.1f}",
            percent(row["left_out_peaks"]),
            f"{row['flags']:.1f}",
            percent(row["left_out_flags"]),
        )
        for row in rows
    ]
    return Table("What skipping saves in a typical IDA", headings, lines)


def share_table(share: Row) -> Table:
    """Return the share of the kernels in an IDA."""
    lines = [
        (title, f"{one['wall']:.2f}", f"{one['cores']:.2f}", percent(one["of_wall"]), percent(one["of_cpu"]))
        for title, one in (("flags and peaks", share["peaks"]), ("flags only", share["flags"]))
    ]
    headings = (
        "outputs",
        "wall time, s",
        "cores in use",
        "kernels: share of wall time × 2 threads",
        "share of CPU time",
    )
    return Table(f"An IDA of {share['runs']:,} runs with two threads", headings, lines)


def scale_table(points: Sequence[Row]) -> Table:
    """Return time and memory by the number of runs."""
    lines = []
    for point in points:
        if "failed" in point:
            lines.append((f"{point['runs']:,}", "failed", *(["–"] * 4)))
            continue
        wall, memory, before = point["wall"], point["memory"] / 1e6, point["memory_before"] / 1e6
        seconds = f"{wall:.3f}" if wall < 1.0 else f"{wall:.1f}"
        used, a_run = f"{point['cpu'] / wall:.2f}", f"{1e6 * point['cpu'] / point['runs']:.1f}"
        lines.append((f"{point['runs']:,}", seconds, used, a_run, f"{memory:,.0f}", f"{before:,.0f}"))
    headings = (
        "runs",
        "wall time, s",
        "cores in use",
        "CPU time a run, µs",
        "peak memory, MB",
        "of it before the analysis, MB",
    )
    return Table("Cost of an IDA with two threads, flags only", headings, lines)


def errors_table(law: str, rows: Sequence[Row]) -> Table:
    """Return cost and errors of all integrators under one law, the cheapest first."""
    here = sorted((row for row in rows if row["law"] == law), key=lambda row: float(row["cost"]))
    headings = ("integrator", "ns", "trajectory, largest", "trajectory, median", "peak, largest", "wrong flags")
    lines = [
        (
            row["name"],
            cost(row["cost"]),
            *(error(row[name]) for name in ("trajectory_max", "trajectory_median", "peak_max")),
            f"{row['wrong_flags']} of {row['flags']}",
        )
        for row in here
    ]
    return Table(short(law), headings, lines)


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


def precision_table(rows: Sequence[Row]) -> Table:
    """Return the engine's figures under each law, the sensitivity of the truth, and the cheapest right rival."""
    headings = (
        "law",
        "ns",
        "error",
        "1e-13 moves the truth by",
        "wrong flags",
        "cheapest right rival",
        "its ns",
        "its error",
    )
    lines = []
    for ours in (row for row in rows if row["name"] == ENGINE):
        rival = next_right(ours["law"], rows)
        theirs = ("none", "–", "–")
        if rival is not None:
            theirs = (rival["name"], cost(rival["cost"]), error(rival["trajectory_max"]))
        flags = f"{ours['wrong_flags']} of {ours['flags']}"
        cells = (short(ours["law"]), cost(ours["cost"]), error(ours["trajectory_max"]), error(ours["twin"]), flags)
        lines.append((*cells, *theirs))
    return Table("The engine against the 40-digit truth: largest error of the trajectory over α", headings, lines)


def absences(left_out: Sequence[Row]) -> list[str]:
    """Return one line for each rival that is missing under some law, with the reason."""
    lines = []
    for why in (MISSING, UNABLE, DEAR, FAILED):
        rows = [row for row in left_out if row["why"] == why]
        if why == MISSING:
            for reason in dict.fromkeys(row["reason"] for row in rows):
                names = ", ".join(row["name"] for row in rows if row["reason"] == reason)
                lines.append(f"{names}: {ALL_LAWS}, {reason}")
            continue
        for name in dict.fromkeys(row["name"] for row in rows):
            here = [row for row in rows if row["name"] == name]
            count = f"{len(here)} law{'' if len(here) == 1 else 's'}"
            if why == DEAR:
                needed = span((row["seconds"] for row in here), digits=0)
                lines.append(f"{name}: {count}, too dear (about {needed} s a law)")
            else:
                reasons = "; ".join(dict.fromkeys(row["reason"] for row in here))
                lines.append(f"{name}: {count}, {reasons}")
    return lines


def flags_table(law: str, rows: Sequence[Row]) -> Table:
    """Return the wrong flags under one law, and their effect on curves."""
    headings = (
        *("integrator", "wrong flags", "share", "of them overturned"),
        *("median: mean change", "largest", "β: mean change", "largest"),
    )
    lines: list[tuple[str, ...]] = []
    for row in (row for row in rows if row["law"] == law):
        changes = (f"{name}_{kind}" for name in ("median", "dispersion") for kind in ("mean", "largest"))
        lines.append(
            (
                row["name"],
                f"{row['wrong']:,} of {row['runs']:,}",
                percent(row["wrong"] / row["runs"]),
                f"{row['falsely_overturned']:,}",
                *(percent(row[name], signed=True) for name in changes),
            )
        )
    return Table(f"Wrong verdicts: {short(law)}", headings, lines)


def laws_of(rows: Sequence[Row]) -> list[str]:
    """Return the labels of the laws in some rows, in order."""
    return list(dict.fromkeys(row["law"] for row in rows))
