"""Tables and answers of what starting up costs, and of the frozen studies."""

from __future__ import annotations

from collections.abc import Sequence

from ..measure import Row
from ..tables import Table, percent
from .studies import CORES

COMPILE_TARGET = 0.7 * 48.0
"""CPU time of compiling the office study's kernels, s: 0.7 of what it took in July 2026."""
SHARE_TARGET = 12.0
"""Speed-up on `CORES` cores."""
TWO_THREADS_TARGET = 1.9
"""Speed-up of two threads."""
WHOLE_TARGET = 1.15
"""CPU time of an analysis on one thread over that of its engine."""
RATIO_TARGETS = {"office": 0.6, "large": 0.5}
"""CPU time of the frozen studies over that of July 2026 (the office study with its report)."""
MOTION_TARGET, MEASURE_TARGET = 2.0, 1.0
"""CPU time of a simulated motion and of the measures of a motion, ms."""


def first_use_table(rows: Sequence[Row]) -> Table:
    """Return the CPU time of whole processes."""
    lines = [
        (row["what"], f"{row['cpu']:.2f}", "–" if row["target"] is None else f"{row['target']:.2f}") for row in rows
    ]
    return Table("Starting up, CPU time of a whole process", ("what", "CPU time, s", "target, s"), lines)


def first_use_answer(rows: Sequence[Row]) -> list[str]:
    """Return what starting up costs, in a sentence."""
    over = [f"{row['what']} ({row['cpu']:.2f} s)" for row in rows if row["target"] and row["cpu"] > row["target"]]
    held = sum(row["target"] is not None for row in rows)
    verdict = f"**missed** by {', '.join(over)}" if over else "all met"
    return [f"**Starting up.** {held} targets of CPU time ({rows[0]['target']:g} s for a command): {verdict}."]


def studies_table(found: Row) -> Table:
    """Return the costs of the frozen studies."""
    lines = [
        ("office study, first run after installation", f"{found['first']:.1f}"),
        ("of it, compiling", f"{found['compiling']:.1f}"),
        ("office study, later runs", f"{found['again']:.1f}"),
        ("of it, loading libraries", f"{found['libraries']:.1f}"),
        ("its report", f"{found['report']:.1f}"),
        ("of it, loading libraries", f"{found['report_libraries']:.1f}"),
        (f"large study, {found['large_runs']:,} runs, two threads", f"{found['large_cpu']:.1f}"),
    ]
    return Table("Frozen studies, CPU time", ("what", "CPU time, s"), lines)


def threads_table(found: Row) -> Table:
    """Return wall times of the large study by threads, and what Amdahl's law makes of them."""
    serial = found["serial"]
    lines = [
        (
            f"{found['wall_one']:.1f}",
            f"{found['wall_two']:.1f}",
            f"{found['speed_up']:.2f}",
            f"{serial:.1f}",
            percent(serial / found["wall_one"]),
            f"{found['bound']:.1f}",
        )
    ]
    headings = (
        "one thread, s",
        "two threads, s",
        "speed-up",
        "serial, s",
        "of one thread's time",
        f"bound on {CORES} cores",
    )
    return Table("The large study by threads, wall time", headings, lines)


def by_threads_table(found: Row) -> Table:
    """Return one analysis on one thread and on two, s."""
    lines = [
        (str(row["threads"]), *(f"{row[name]:.2f}" for name in ("wall", "cpu", "engine", "alone")))
        for row in found["rows"]
    ]
    headings = ("threads", "wall time, s", "CPU time, s", "of it the engine's, s", "the calling thread's, s")
    return Table(f"An analysis of {found['runs']:,} runs by threads", headings, lines)


def by_threads_answer(found: Row) -> list[str]:
    """Return what a second thread brings, and what many could, in a sentence or two."""
    faster = "met" if found["speed_up"] >= TWO_THREADS_TARGET else "**missed**"
    share = "met" if found["bound"] >= SHARE_TARGET else "**missed**"
    whole = found["rows"][0]["cpu"] / found["rows"][0]["engine"]
    close = "met" if whole <= WHOLE_TARGET else "**missed**"
    return [
        f"On one thread that analysis takes {whole:.2f} times the engine's CPU time, labels and screen included "
        f"(target {WHOLE_TARGET:g}: {close}).",
        f"**Two threads** are {found['speed_up']:.2f} times as fast as one in an analysis of {found['runs']:,} runs "
        f"(target {TWO_THREADS_TARGET:g}: {faster}). What the calling thread does alone is {percent(found['serial'])} "
        f"of the CPU time: by Amdahl's law {CORES} cores can be {found['bound']:.1f} times as fast as one (target "
        f"{SHARE_TARGET:g}: {share}), and {found['bound_outside']:.1f} times if nothing outside the engine could be "
        "divided.",
    ]


def studies_answer(found: Row) -> list[str]:
    """Return what the frozen studies cost, in a sentence or two."""
    compiling = "met" if found["compiling"] <= COMPILE_TARGET else "**missed**"
    libraries = found["libraries"] + found["report_libraries"]
    lines = [
        f"**Whole studies.** The frozen office study of 72,000 runs takes {found['again']:.1f} s of CPU time, and "
        f"{found['report']:.1f} s more for its report, of which loading libraries takes {libraries:.1f} s; compiling "
        f"takes {found['compiling']:.1f} s once (target {COMPILE_TARGET:.0f}: {compiling}). By Amdahl's law a whole "
        f"study of {found['large_runs']:,} runs, with its files and figures, can become {found['bound']:.1f} times "
        f"faster on {CORES} cores."
    ]
    ratios = {name: found[f"{name}_ratio"] for name in RATIO_TARGETS if f"{name}_ratio" in found}
    if ratios:
        each = ", ".join(
            f"{ratio:.2f} for the {name} study (target {RATIO_TARGETS[name]:g}: "
            f"{'met' if ratio <= RATIO_TARGETS[name] else '**missed**'})"
            for name, ratio in ratios.items()
        )
        lines.append(
            "CPU time over that of another installation (`--against`; targets hold for commit a4baf48 of July 2026), "
            f"taken in turns: {each}."
        )
    return lines


def making_table(rows: Sequence[Row]) -> Table:
    """Return the CPU time of a motion by generator, and of the measures of a motion."""
    lines = [(row["what"], f"{row['cpu']:.2f}", f"{row['target']:g}") for row in rows]
    return Table("Motions, CPU time of one thread", ("what", "ms a motion", "target, ms"), lines)


def making_answer(rows: Sequence[Row]) -> list[str]:
    """Return what making and measuring motions costs, in a sentence."""
    over = [f"{row['what']} ({row['cpu']:.1f} ms)" for row in rows if row["cpu"] > row["target"]]
    verdict = f"**missed** by {', '.join(over)}" if over else "met"
    return [
        f"**Motions.** Targets of {MOTION_TARGET:g} ms of CPU time for a motion and {MEASURE_TARGET:g} ms for its "
        f"measures: {verdict}."
    ]
