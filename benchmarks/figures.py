"""The figure of the benchmark: error against cost."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from ..studies.plots.axes import COLOURS
from .measure import ENGINE, Row

FLOOR = 1e-16
"""Error at which smaller errors are drawn."""
FONT = 12.0
SHOWN = {
    "discrete e=0.9 δ=0.05": "discrete",
    "giannini-masiani e=0.9 δ=0.05": "Giannini–Masiani",
    "energy-consistent e=0.9 δ=0.05": "energy-consistent, rigid rest",
    "housner e=0.9": "Housner, exact geometry",
}
"""Labels of the laws in the figure with their titles: one for each kind of dissipation, and exact geometry."""
FAMILIES = {
    ENGINE: (COLOURS[3], "*", "none"),
    "RK4 dt": (COLOURS[1], "o", "-"),
    "Newmark": (COLOURS[1], "s", "--"),
    "RK4 with events": (COLOURS[0], "^", "-"),
    "heyoka": (COLOURS[2], "X", "-"),
}
"""Starts of the names of integrators that share a line, with colour, marker and line style."""


def work_precision(rows: Sequence[Row]) -> Figure:
    """Draw the largest error of the trajectory against cost, in a panel for each law, with a line for each family."""
    figure = Figure(figsize=(7.8, 8.1), layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(2, 2, sharex=True, sharey=True)
    for ax, (law, title) in zip(panels.flat, SHOWN.items(), strict=True):
        for start, (colour, marker, line) in FAMILIES.items():
            points = sorted(
                (row["cost"], max(row["trajectory_max"], FLOOR))
                for row in rows
                if row["law"] == law and row["name"].startswith(start) and row["trajectory_max"] is not None
            )
            if points:
                x, y = zip(*points, strict=True)
                look = {"color": colour, "marker": marker, "ls": line, "ms": 17.0 if start == ENGINE else 7.0}
                ax.plot(x, y, **look, lw=1.5, mew=0.0, zorder=3, label=start.removesuffix(" dt"))
        ax.set(xscale="log", yscale="log")
        ax.axhline(1.0, color="0.5", lw=1.0, ls=(0, (2, 2)))
        ax.grid(alpha=0.3, lw=0.6)
        ax.spines[["top", "right"]].set_visible(False)
        ax.tick_params(labelsize=FONT - 1.0)
        ax.set_title(title, fontsize=FONT)
    handles, labels = panels[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False, fontsize=FONT)
    for ax in panels[-1]:
        ax.set_xlabel("ns per sample and run", fontsize=FONT)
    figure.supylabel("largest error of the rotation / α (smaller is better)", fontsize=FONT)
    return figure
