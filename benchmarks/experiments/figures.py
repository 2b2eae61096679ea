"""The figure of tests: predicted probabilities and observed shares."""

from __future__ import annotations

from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from ...studies.plots import axes
from .predictions import Prediction
from .results import Compared

MOST = 9.0
"""Largest marker, points."""


@axes.style()
def calibration_figure(rows: list[Compared]) -> Figure | None:
    """Return the figure of all rows with a probability and a count, None without any.

    Blind predictions are filled markers, predictions with measured or fitted inputs are open ones.
    """
    counted = [row for row in rows if row.counted]
    if not counted:
        return None
    figure = axes.figure(5.8)
    ax = axes.panel(figure)
    ax.plot([0, 1], [0, 1], color="0.6", linewidth=1.0, label="predicted = observed")
    for i, piece in enumerate(dict.fromkeys(row.row.test.piece for row in counted)):
        colour, marker, _ = axes.look(i)
        for k, row in enumerate(row for row in counted if row.row.test.piece == piece):
            _point(ax, row, row.prediction, color=colour, marker=marker, label=None if k else piece)
            if row.measured is not None and row.measured.made:
                _point(ax, row, row.measured, color=colour, marker=marker, markerfacecolor="white")
    ax.set(xlim=(-0.03, 1.03), ylim=(-0.03, 1.03), xlabel="predicted probability of overturning")
    ax.set_ylabel("observed share overturned")
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_formatter(PercentFormatter(1.0, symbol=" %"))
    axes.label(ax)
    axes.heading(
        figure,
        "Predicted probabilities and observed shares",
        "filled: predicted blindly; open: with measured inputs, or inputs fitted on other records; bars: 95 % "
        "intervals; large markers: many trials",
        legend=[ax],
    )
    return figure


def _point(ax: Axes, row: Compared, made: Prediction, **look: Any) -> None:
    ax.errorbar(
        made.value,
        row.observed,
        xerr=[[max(made.value - made.lower, 0.0)], [max(made.upper - made.value, 0.0)]],
        yerr=[[max(row.observed - row.lower, 0.0)], [max(row.upper - row.observed, 0.0)]],
        markersize=4.0 + (MOST - 4.0) * min(1.0, (row.row.test.trials or 0) / 100.0),
        linewidth=0.8,
        alpha=0.85,
        **look,
    )
