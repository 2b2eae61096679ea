"""The figure of tests: predicted probabilities beside observed shares."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from ...studies.plots import axes
from .predictions import Prediction
from .results import Compared

MOST = 9.0
"""Largest marker, points."""


def calibration_figure(rows: list[Compared]) -> Figure | None:
    """Return the figure of all rows with a probability and a count, None without any.

    Blind predictions are filled markers, predictions with measured or fitted inputs are open ones.
    """
    own = [one for one in rows if one.counted]
    if not own:
        return None
    figure = axes.figure(6.4, 5.8)
    ax = figure.add_subplot()
    ax.plot([0, 1], [0, 1], color="0.6", linewidth=1.0, label="predicted = observed")
    pieces = list(dict.fromkeys(one.row.test.piece for one in own))
    for i, piece in enumerate(pieces):
        colour, marker, _ = axes.look(i)
        named = False
        for one in (row for row in own if row.row.test.piece == piece):
            for made, filled in ((one.prediction, True), (one.measured, False)):
                if made is not None and made.made:
                    _point(ax, one, made, colour, marker, filled, piece if filled and not named else None)
                    named = named or filled
    ax.set(xlim=(-0.03, 1.03), ylim=(-0.03, 1.03), xlabel="predicted probability of overturning")
    ax.set_ylabel("observed share overturned")
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_formatter(PercentFormatter(1.0))
    axes.grid(ax)
    handles, labels = ax.get_legend_handles_labels()
    axes.legend_below(figure, handles, labels)
    axes.heading(
        figure,
        "Predicted beside observed",
        "filled: predicted blindly; open: with measured inputs, or inputs fitted on other records; bars: 95 % "
        "intervals; large markers: many trials",
    )
    return figure


def _point(
    ax: Axes, one: Compared, made: Prediction, colour: str, marker: str, filled: bool, label: str | None
) -> None:
    ax.errorbar(
        made.value,
        one.observed,
        xerr=[[max(made.value - made.lower, 0.0)], [max(made.upper - made.value, 0.0)]],
        yerr=[[max(one.observed - one.lower, 0.0)], [max(one.upper - one.observed, 0.0)]],
        color=colour,
        marker=marker,
        markersize=4.0 + (MOST - 4.0) * min(1.0, (one.row.test.trials or 0) / 100.0),
        markerfacecolor=colour if filled else "white",
        linewidth=0.8,
        alpha=0.85,
        label=label,
    )
