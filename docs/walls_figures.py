"""The figures of docs/walls.md: each takes what it draws and returns a figure.  Narrow, so that a phone shows them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, NullLocator, PercentFormatter
from polarity import share, share_of_free

from toppling.studies.plots.axes import COLOURS, MARKERS

_SIZED = ("font.size", "axes.labelsize", "axes.titlesize", "legend.fontsize", "figure.labelsize", "xtick.labelsize")
LOOKS: dict[str, Any] = dict.fromkeys((*_SIZED, "ytick.labelsize"), 10.5)
"""8 pt where a phone shows a figure 380 pixels wide."""
WIDTH, DPI = 5.2, 140
FEWER_MORE = LinearSegmentedColormap.from_list("fewer_more", [COLOURS[0], "#ffffff", COLOURS[1]])
NORMALISED = "peak velocity, p PGV/(g tan α) (–)"


def gap_name(gap: float | None) -> str:
    """A gap in words."""
    return "free" if gap is None else "touching" if gap == 0.0 else f"{1000.0 * gap:g} mm"


def _bare(ax: Axes) -> None:
    ax.grid(alpha=0.25, lw=0.6)
    ax.spines[["top", "right"]].set_visible(False)


def map_figure(
    excess: np.ndarray, decided: np.ndarray, kinds: Sequence[str], names: Sequence[str], gaps: Sequence[float],
    levels: Sequence[float],
) -> Figure:  # fmt: skip
    """Falls into the room before a wall less those of the free piece (kind, piece, gap, level); open cells dotted."""
    figure = Figure(figsize=(WIDTH, 9.0), layout="constrained")
    axes = figure.subplots(len(names), len(kinds))
    edges = np.arange(len(levels) + 1) - 0.5
    shown = [j for j, level in enumerate(levels) if level in (0.5, 1.0, 2.0)]
    for (i, k), ax in np.ndenumerate(axes):
        mesh = ax.pcolormesh(
            edges, np.arange(len(gaps) + 1) - 0.5, excess[k, i], cmap=FEWER_MORE, vmin=-0.5, vmax=0.5,
            edgecolors="white", lw=0.4,
        )  # fmt: skip
        y, x = np.nonzero(~decided[k, i])
        ax.plot(x, y, ".", color="0.55", ms=2.5)
        ax.set_yticks(range(len(gaps)), [gap_name(gap) for gap in gaps] if k == 0 else [])
        ax.set_xticks(shown, [f"{levels[j]:g}" for j in shown] if i == len(names) - 1 else [])
        ax.tick_params(length=2.0)
        heading = names[i] if k == 0 else ""
        ax.set_title(f"{kinds[k]}\n{heading}" if i == 0 else heading, loc="left", fontsize=9.5)
    bar = figure.colorbar(mesh, ax=axes, location="bottom", shrink=0.8, aspect=30, pad=0.06)
    bar.set_label("P(falls into the room): before the wall minus free")
    axes[-1, 1].set_xlabel(NORMALISED)
    return figure


def curve_figure(
    front: np.ndarray, kinds: Sequence[str], gaps: Sequence[float | None], levels: Sequence[float]
) -> Figure:
    """Falls into the room over the level (kind, gap, level, motion), with intervals: a panel for each kind."""
    figure = Figure(figsize=(WIDTH, 8.0), layout="constrained")
    axes = figure.subplots(len(kinds), 1, sharex=True, sharey=True)
    for k, ax in enumerate(axes):
        for j, gap in enumerate(gaps):
            interval = share_of_free if gap is None else share
            shares = [interval(front[k, j, n]) for n in range(len(levels))]
            colour, line = ("black", (0, (4, 2))) if gap is None else (COLOURS[j - 1], "solid")
            ax.plot(levels, [one.value for one in shares], color=colour, ls=line, lw=1.6, marker=MARKERS[j], ms=4.0,
                    label=gap_name(gap))  # fmt: skip
            ax.fill_between(levels, [one.lower for one in shares], [one.upper for one in shares], color=colour,
                            alpha=0.13, lw=0.0)  # fmt: skip
        _bare(ax)
        ax.set_title(kinds[k], loc="left")
        ax.set_xscale("log")
        ax.xaxis.set_minor_locator(NullLocator())
        ax.xaxis.set_major_locator(FixedLocator([0.3, 0.5, 1.0, 2.0, 3.0]))
        ax.xaxis.set_major_formatter("{x:g}")
        ax.set_ylim(0.0, 1.02)
        ax.yaxis.set_major_formatter(PercentFormatter(1.0))
    figure.supylabel("P(falls into the room)")
    figure.supxlabel(NORMALISED)
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=5, frameon=False,
                  handlelength=1.6, columnspacing=1.0, handletextpad=0.4)  # fmt: skip
    return figure


def varied_figure(
    front: np.ndarray, free: np.ndarray, kinds: Sequence[str], gaps: Sequence[float], names: Sequence[str],
    values: Sequence[float], label: str, percent: bool = False,
) -> Figure:  # fmt: skip
    """Falls into the room over a varied input (kind, half or nine in ten, piece, gap, value).

    A panel for every kind, intensity and gap; `free` (kind, half or nine in ten): the range over the free pieces.
    """
    figure = Figure(figsize=(WIDTH, 8.2), layout="constrained")
    axes = figure.subplots(2 * len(kinds), len(gaps), sharex=True, sharey=True)
    for k, kind in enumerate(kinds):
        for often in (0, 1):
            for j, gap in enumerate(gaps):
                ax = axes[2 * k + often, j]
                low, high = free[k, often]
                ax.axhspan(low - 0.004, high + 0.004, color="0.8", lw=0.0)
                for i in range(len(names)):
                    ax.plot(values, front[k, often, i, j], color=COLOURS[i], marker=MARKERS[i], ms=4.0, lw=1.3)
                _bare(ax)
                ax.set_ylim(-0.02, 1.02)
                ax.yaxis.set_major_formatter(PercentFormatter(1.0))
                if percent:
                    ax.xaxis.set_major_formatter(PercentFormatter(1.0, decimals=1, symbol=""))
                intensity = "free falls in 9 of 10" if often else "free falls in half"
                ax.set_title(
                    f"{kind}, {gap_name(gap)}\n{intensity}" if len(gaps) < 3 else f"{gap_name(gap)}", loc="left"
                )
        if len(gaps) > 2:
            for often in (0, 1):
                intensity = "in 9 of 10" if often else "in half"
                axes[2 * k + often, 0].set_ylabel(f"{kind},\nfree falls {intensity}")
    figure.supylabel("P(falls into the room)")
    figure.supxlabel(label)
    handles = [Line2D([], [], color=COLOURS[i], marker=MARKERS[i], ms=4.0, lw=1.3) for i in range(len(names))]
    figure.legend([*handles, Line2D([], [], color="0.8", lw=6.0)], [*names, "free, into the room"],
                  loc="outside upper center", ncols=2, frameon=False, handlelength=1.6)  # fmt: skip
    return figure
