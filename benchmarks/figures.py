"""Figures of the benchmark: error against cost, and the cost of an IDA."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from ..core.writing import whole_file
from .measure import ENGINE, Row
from .precision import SHOWN

FLOOR = 1e-16
"""Error at which smaller errors are drawn."""
FONT = 12.0


class Family(NamedTuple):
    """Integrators that share one line: start of their names, colour (Okabe and Ito), marker, line style."""

    title: str
    start: str
    colour: str
    marker: str
    line: str


# told apart by marker and line as well as by colour
FAMILIES = (
    Family("toppling", ENGINE, "#000000", "*", ""),
    Family("RK4", "RK4 dt", "#D55E00", "o", "-"),
    Family("Newmark", "Newmark", "#E69F00", "s", "-"),
    Family("RK4 with events", "RK4 with events", "#0072B2", "^", "-"),
    Family("heyoka", "heyoka", "#56B4E9", "X", "-"),
)
_TITLES = dict(
    zip(
        SHOWN, ("discrete", "Giannini–Masiani", "energy-consistent, rigid rest", "Housner, exact geometry"), strict=True
    )
)


def work_precision(rows: Sequence[Row], laws: Sequence[str] = SHOWN) -> Figure:
    """Draw the largest error of the trajectory against cost, in a panel for each law, with a line for each family."""
    columns = min(2, len(laws))
    lines = math.ceil(len(laws) / columns)
    figure = Figure(figsize=(3.9 * columns, 3.3 * lines + 1.5), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(lines, columns, squeeze=False, sharex=True, sharey=True)
    for ax, law in zip(axes.flat, laws, strict=False):
        _panel(ax, [row for row in rows if row["law"] == law])
        ax.set_title(_TITLES.get(law, law), fontsize=FONT)
    for ax in list(axes.flat)[len(laws) :]:
        ax.remove()
    known = {family.title for family in FAMILIES for row in rows if row["name"].startswith(family.start)}
    handles = [
        axes.flat[0].plot(
            [],
            [],
            color=f.colour,
            marker=f.marker,
            ls=f.line or "none",
            ms=15.0 if f.start == ENGINE else 8.0,
            label=f.title,
        )[0]
        for f in FAMILIES
        if f.title in known
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, frameon=False, fontsize=FONT)
    for ax in list(axes.flat)[max(0, len(laws) - columns) : len(laws)]:
        ax.set_xlabel("ns per sample and run", fontsize=FONT)
    figure.supylabel("largest error of the rotation / α (less is better)", fontsize=FONT)
    return figure


def _panel(ax: Axes, rows: Sequence[Row]) -> None:
    for family in FAMILIES:
        own = sorted(
            (row["cost"], max(row["trajectory_max"], FLOOR))
            for row in rows
            if row["name"].startswith(family.start) and row["trajectory_max"] is not None
        )
        if own:
            x, y = np.array(own).T
            size = 17.0 if family.start == ENGINE else 7.0
            ax.plot(
                x,
                y,
                color=family.colour,
                marker=family.marker,
                ls=family.line or "none",
                ms=size,
                lw=1.5,
                mew=0.0,
                zorder=3,
            )
    ax.set(xscale="log", yscale="log")
    ax.axhline(1.0, color="0.5", lw=1.0, ls=(0, (2, 2)))
    ax.grid(alpha=0.3, lw=0.6)
    ax.spines[["top", "right"]].set_visible(False)
    ax.tick_params(labelsize=FONT - 1.0)


def cost_curve(points: Sequence[Row]) -> Figure:
    """Draw wall time and peak memory of an IDA against the number of runs."""
    done = [point for point in points if not point["failed"]]
    runs = np.array([point["runs"] for point in done])
    figure = Figure(figsize=(7.2, 3.6), layout="constrained")
    FigureCanvasAgg(figure)
    time, memory = figure.subplots(1, 2)
    wall = np.array([point["wall"] for point in done])
    time.loglog(runs, wall, "o-", color="#0072B2", lw=1.8)
    for x, y in zip(runs, wall, strict=True):
        text = f"{1e3 * y:.0f} ms" if y < 1.0 else f"{y:.1f} s"
        time.annotate(text, (x, y), (-6, 6), textcoords="offset points", ha="right", fontsize=FONT - 1.0)
    time.set_ylabel("wall time, s", fontsize=FONT)
    time.set_ylim(wall.min() / 2.0, wall.max() * 4.0)
    peak = np.array([point["memory"] for point in done]) / 1e6
    before = np.array([point["memory_before"] for point in done]) / 1e6
    memory.semilogx(runs, peak, "s-", color="#D55E00", lw=1.8)
    memory.semilogx(runs, before, "^--", color="#009E73", lw=1.8)
    memory.set_ylim(0.0, 1.3 * peak.max())
    memory.annotate("peak", (runs[-1], peak[-1]), (0, 10), textcoords="offset points", ha="right", fontsize=FONT - 1.0)
    memory.annotate(
        "before the analysis\n(packages, motions)",
        (runs[0], before[0]),
        (0, -10),
        textcoords="offset points",
        va="top",
        fontsize=FONT - 1.0,
    )
    memory.set_ylabel("memory, MB", fontsize=FONT)
    for ax in (time, memory):
        ax.set_xlabel("runs", fontsize=FONT)
        ax.set_xlim(runs.min() / 30.0, runs.max() * 2.0)  # (room for the first label)
        ax.grid(alpha=0.3, lw=0.6)
        ax.spines[["top", "right"]].set_visible(False)
        ax.tick_params(labelsize=FONT - 1.0)
    return figure


def save(figure: Figure, path: Path) -> None:
    """Write a figure as PNG."""
    with whole_file(path) as temporary:
        figure.savefig(temporary, format="png", dpi=150)
