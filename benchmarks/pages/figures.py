"""Looks and parts that figures of pages share: narrow enough for a phone, with text of 8 pt there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator, PercentFormatter

from ...studies.plots.axes import COLOURS, MARKERS
from .tables import Interval

WIDTH, DPI = 5.2, 140
DASHED, DOTTED = (0, (4, 2)), (0, (1, 1))
_SIZED = ("font.size", "axes.labelsize", "axes.titlesize", "legend.fontsize", "figure.labelsize")


def looks(*more: str) -> AbstractContextManager[None]:
    """Return a context in which all text, and ticks where they are named, is of one size."""
    names: list[Any] = [*_SIZED, *more]
    return mpl.rc_context(dict.fromkeys(names, 10.5))


def new(height: float, rows: int = 1, columns: int = 1, **options: Any) -> tuple[Figure, Any]:
    """Return a figure of a height in inches, and its panels."""
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    return figure, figure.subplots(rows, columns, **options)


def bare(ax: Axes, axis: str = "both") -> None:
    """Give a panel a faint grid and no frame."""
    ax.grid(axis=axis, alpha=0.25, lw=0.6)  # type: ignore[arg-type]
    ax.spines[["top", "right"]].set_visible(False)


def log_ticks(ax: Axes, ticks: Sequence[float], form: str = "{x:g}") -> None:
    """Make the x axis logarithmic, with these ticks."""
    ax.set_xscale("log")
    ax.xaxis.set_minor_locator(NullLocator())
    ax.xaxis.set_major_locator(FixedLocator(list(ticks)))
    ax.xaxis.set_major_formatter(form)


def shares_axis(ax: Axes) -> None:
    """Make the y axis one of shares."""
    ax.set_ylim(-0.02, 1.02)
    ax.yaxis.set_major_formatter(PercentFormatter(1.0, symbol=" %"))


def curve(
    ax: Axes, x: Sequence[float], shares: Sequence[Interval], k: int, band: float = 0.15, marker: int | None = None,
    **look: Any,
) -> None:  # fmt: skip
    """Draw shares over x in the k-th colour, with a band of their intervals."""
    drawn: dict[str, Any] = {
        "color": COLOURS[k],
        "marker": MARKERS[k if marker is None else marker],
        "ms": 4.0,
        "lw": 1.5,
    } | look
    ax.plot(x, [share.value for share in shares], **drawn)
    if band:
        lower, upper = ([share[end] for share in shares] for end in (1, 2))
        ax.fill_between(x, lower, upper, color=drawn["color"], alpha=band, lw=0.0)


def whiskers(ax: Axes, names: Sequence[str], series: Mapping[str, Sequence[Interval | None]], first: int = 0) -> None:
    """Draw values with intervals of every piece, one series above the other."""
    step = 0.8 / len(series)
    for k, (name, values) in enumerate(series.items()):
        label: str | None = name
        for i, value in enumerate(values):
            if value is not None and np.isfinite(value.value):
                ax.errorbar(
                    value.value, i + step * (k - 0.5 * (len(series) - 1)),
                    xerr=[[value.value - value.lower], [value.upper - value.value]],
                    fmt=MARKERS[first + k], ms=4.5, lw=1.2, color=COLOURS[(first + k) % len(COLOURS)],
                    label=label,
                )  # fmt: skip
                label = None
    bare(ax)
    ax.set_ylim(len(names) - 0.4, -0.6)
    ax.set_yticks(range(len(names)), names)
