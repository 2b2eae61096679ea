"""The figure of one run: floor acceleration and rotation over time, phase portrait and hysteresis."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...units import STANDARD_GRAVITY
from ..plots import axes
from ..plots.moments import hysteresis
from ..plots.response import HIGHEST, history, phase
from ..text.histories import last_balance

AFTER = 1.0
"""Time that the axis continues after the block lies on its side, s; at least a tenth of the time until then."""
INK, DASHED, DOTTED = "0.35", (0, (4, 3)), (0, (1, 2))


def history_figure(response: xr.Dataset, title: str, text: str, *, lifts: float, ends: float) -> Figure:
    """Return the figure of one run on one page: shaking, history, phase portrait and hysteresis.

    Parameters
    ----------
    response : xarray.Dataset
        Dataset that `toppling.simulate` returned.
    title, text : str
        Texts above the panels: the block and the law, and what the block does.
    lifts : float
        Acceleration that just lifts a rigid block, m/s².
    ends : float
        Time at which the record ends, s; a history may continue without shaking after it.

    Returns
    -------
    matplotlib Figure
    """
    figure = Figure(figsize=(8.0, 9.0), layout="constrained")
    panels = figure.subplot_mosaic(
        [["shaking", "shaking"], ["history", "history"], ["phase", "hysteresis"]],
        height_ratios=(0.55, 1.0, 1.25),
    )
    time = response["time"].values
    first, last = float(time[0]), float(time[-1])
    lies = float(response["overturning_time"])
    if lies < last:  # (NaN where the block stands)
        last = min(last, lies + max(AFTER, 0.1 * (lies - first)))
    _shaking(response, panels["shaking"], lifts)
    _rotation(response, panels["history"])
    for ax in (panels["shaking"], panels["history"]):
        ax.set_xlim(first, last)
    if ends < last:
        panels["shaking"].axvline(ends, color=INK, lw=0.9, ls=DOTTED, label=f"the record ends, {ends:.2f} s")
    elif ends > last:
        panels["shaking"].plot([], [], " ", label=f"the record goes on to {ends:.2f} s")
    for ax in (panels["shaking"], panels["history"]):
        if ax.get_legend_handles_labels()[1]:
            ax.legend(loc="lower left", bbox_to_anchor=(-0.01, 1.0), ncols=3, frameon=False, fontsize=9)
    panels["shaking"].tick_params(labelbottom=False)
    for name in ("phase", "hysteresis"):
        panels[name].locator_params(axis="x", nbins=6)
    phase(response, panels["phase"])
    hysteresis(response, panels["hysteresis"])
    panels["hysteresis"].set_ylabel("restoring and damping\nmoment over m g R sin α (–)")
    panels["phase"].set_ylabel("angular velocity over pα,\nθ'/(pα) (–)")
    if bool(response["overturned"]):  # the fall would compress all that precedes it into the middle
        for name in ("phase", "hysteresis"):
            low, high = panels[name].get_xlim()
            panels[name].set_xlim(max(low, -HIGHEST), min(high, HIGHEST))
            _fit_to_seen(panels[name])
    axes.heading(figure, title, text)
    return figure


def _shaking(response: xr.Dataset, ax: Axes, lifts: float) -> None:
    """Draw the floor's acceleration, and the acceleration that lifts the block."""
    acceleration = response["floor_acceleration"].values / STANDARD_GRAVITY
    ax.plot(response["time"].values, acceleration, color=INK, lw=0.8)
    limit = lifts / STANDARD_GRAVITY
    ax.axhline(limit, color=axes.COLOURS[1], lw=0.9, ls=DASHED, label=f"lifts a rigid block: ±g tan α = {limit:.3g} g")
    ax.axhline(-limit, color=axes.COLOURS[1], lw=0.9, ls=DASHED)
    ax.set_ylabel("floor\nacceleration (g)")
    axes.grid(ax)


def _rotation(response: xr.Dataset, ax: Axes) -> None:
    """Draw the rotation, the balance, and the times at which the block passes its balance and lies on its side."""
    history(response, ax, labels=[""], colors=axes.COLOURS[:1]).lines[0].set_linestyle("solid")
    low, high = ax.get_ylim()
    if low < -1.0 or high > 1.0:
        for side in (-1.0, 1.0):
            ax.axhline(side, color=INK, lw=0.9, ls=DASHED, label="balance, θ = ±α" if side > 0.0 else None)
        ax.set_ylim(low, high)
    if bool(response["overturned"]):
        at, x = last_balance(response)
        if abs(x) == 1.0:
            ax.lines[1].set_label(f"past its balance for good, {at:.2f} s")
        lies = float(response["overturning_time"])
        if lies <= float(response["time"][-1]):
            ax.axvline(lies, color=axes.COLOURS[0], lw=1.1, ls=DOTTED, label=f"on its side, {lies:.2f} s")


def _fit_to_seen(ax: Axes) -> None:
    """Scale the y-axis to the part of the line that the x-axis shows."""
    low, high = ax.get_xlim()
    x, y = (np.asarray(values) for values in ax.lines[0].get_data())
    seen = y[(x >= low) & (x <= high)]
    if seen.size and np.ptp(seen) > 0.0:
        room = 0.05 * float(np.ptp(seen))
        ax.set_ylim(float(seen.min()) - room, float(seen.max()) + room)
