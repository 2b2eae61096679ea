"""The figures of docs/directions.md: each takes what it draws and returns a figure, narrow enough for a phone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator, PercentFormatter
from polarity import Share
from walls_figures import DPI, LOOKS, WIDTH

from toppling.studies.plots.axes import COLOURS, MARKERS

__all__ = ["DPI", "LOOKS", "Interval", "change_figure", "file_figure", "rate_figure"]

Interval = tuple[float, float, float]
"""A value and its ends."""


def _bare(ax: Axes) -> None:
    ax.grid(alpha=0.25, lw=0.6)
    ax.spines[["top", "right"]].set_visible(False)


def _whiskers(ax: Axes, found: Mapping[str, Sequence[Interval | None]], first: int = 0) -> None:
    """Values with intervals of every piece (series, piece), one series above the other."""
    step = 0.8 / len(found)
    for k, (name, values) in enumerate(found.items()):
        for i, one in enumerate(values):
            if one is None:
                continue
            value, low, high = one
            ax.errorbar(
                value, i + step * (k - 0.5 * (len(found) - 1)), xerr=[[value - low], [high - value]],
                fmt=MARKERS[first + k], ms=4.5, lw=1.2, color=COLOURS[first + k],
                label=name if i == _first(values) else None,
            )  # fmt: skip


def _first(values: Sequence[Interval | None]) -> int:
    """The first piece that has a value."""
    return next(i for i, one in enumerate(values) if one is not None)


def change_figure(
    names: Sequence[str],
    directions: Mapping[str, Sequence[Interval | None]],
    vertical: Mapping[str, Sequence[Interval | None]],
) -> Figure:
    """Changes of the chance of falling, percentage points, of every piece: by the second direction, and vertically."""
    figure = Figure(figsize=(WIDTH, 8.6), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True, sharex=True)
    for ax, found, first in ((left, directions, 0), (right, vertical, len(directions))):
        ax.axvline(0.0, color="0.3", lw=1.0)
        _whiskers(ax, found, first)
        _bare(ax)
        ax.set_ylim(len(names) - 0.4, -0.6)
        ax.set_yticks(range(len(names)), names)
        ax.legend(loc="lower left", bbox_to_anchor=(-0.05, 1.0), frameon=False, handlelength=1.2, borderaxespad=0.2)
    figure.supxlabel("change of P(falls), percentage points", fontsize=10.5)
    return figure


def file_figure(
    levels: Sequence[float], falls: Mapping[str, Sequence[Share]], slips: Mapping[str, Sequence[Share]]
) -> Figure:
    """The two-drawer file: chances of falling over the level, and of slips on vinyl."""
    figure = Figure(figsize=(WIDTH, 6.4), layout="constrained")
    for n, (ax, found) in enumerate(zip(figure.subplots(2, 1, sharex=True, sharey=True), (falls, slips), strict=True)):
        for k, (name, shares) in enumerate(found.items()):
            colour = COLOURS[k + 3 * n]
            ax.plot(levels, [one.value for one in shares], color=colour, marker=MARKERS[k], ms=4.0, lw=1.6, label=name)
            ax.fill_between(
                levels, [one.lower for one in shares], [one.upper for one in shares], color=colour, alpha=0.15, lw=0.0
            )
        _bare(ax)
        ax.set_xscale("log")
        ax.xaxis.set_minor_locator(NullLocator())
        ax.xaxis.set_major_locator(FixedLocator([0.25, 0.5, 1.0, 2.0, 4.0]))
        ax.xaxis.set_major_formatter("{x:g}")
        ax.set_xlim(0.2, 4.0)
        ax.set_ylim(0.0, 1.02)
        ax.yaxis.set_major_formatter(PercentFormatter(1.0))
        ax.legend(loc="upper left", frameon=False, handlelength=1.6)
    figure.supxlabel("peak velocity, RotD50 (m/s)", fontsize=10.5)
    return figure


def rate_figure(names: Sequence[str], found: Mapping[str, Sequence[Interval | None]]) -> Figure:
    """Annual rates over that of one component, of every piece."""
    figure = Figure(figsize=(WIDTH, 8.2), layout="constrained")
    ax = figure.subplots()
    ax.axvline(1.0, color="0.3", lw=1.0)
    _whiskers(ax, found)
    _bare(ax)
    ax.set_ylim(len(names) - 0.4, -0.6)
    ax.set_yticks(range(len(names)), names)
    ax.set_xlabel("annual rate over that of one component (–)")
    figure.legend(loc="outside upper left", frameon=False, handlelength=1.2)
    return figure
