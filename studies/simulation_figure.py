"""The figure of one run: what shakes the block and what it does, over time, and its paths against its rotation."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..units import STANDARD_GRAVITY
from .histories import last_balance
from .plots import COLOURS, grid, heading
from .plots_moments import hysteresis
from .plots_response import HIGHEST, history, phase

AFTER = 1.0
"""Time that the axis goes on after the block lies on its side, s, or a tenth of the time until then."""
INK, DASHED, DOTTED = "0.35", (0, (4, 3)), (0, (1, 2))


def history_figure(response: xr.Dataset, title: str, text: str, *, lifts: float, ends: float) -> Figure:
    """Shaking, history, phase portrait and hysteresis of one run, on one page.

    Parameters
    ----------
    response : xarray.Dataset
        As `toppling.simulate` returns it.
    title, text : str
        Above the panels: what stands where, and what it does.
    lifts : float
        Acceleration that just lifts a rigid block, m/s².
    ends : float
        Time at which the record ends, s: a history may go on in quiet after it.

    Returns
    -------
    matplotlib Figure
    """
    figure = Figure(figsize=(8.0, 9.0), layout="constrained")
    axes = figure.subplot_mosaic(
        [["shaking", "shaking"], ["history", "history"], ["phase", "hysteresis"]],
        height_ratios=(0.55, 1.0, 1.25),
    )
    time = response["time"].values
    first, last = float(time[0]), float(time[-1])
    lies = float(response["overturning_time"])
    if lies < last:  # (NaN where it stands)
        last = min(last, lies + max(AFTER, 0.1 * (lies - first)))
    _shaking(response, axes["shaking"], lifts)
    _rotation(response, axes["history"])
    for ax in (axes["shaking"], axes["history"]):
        ax.set_xlim(first, last)
    if ends < last:
        axes["shaking"].axvline(ends, color=INK, lw=0.9, ls=DOTTED, label=f"the record ends, {ends:.2f} s")
    elif ends > last:
        axes["shaking"].plot([], [], " ", label=f"the record goes on to {ends:.2f} s")
    for ax in (axes["shaking"], axes["history"]):
        if ax.get_legend_handles_labels()[1]:
            ax.legend(loc="lower left", bbox_to_anchor=(-0.01, 1.0), ncols=3, frameon=False, fontsize=9)
    axes["shaking"].tick_params(labelbottom=False)
    for name in ("phase", "hysteresis"):
        axes[name].locator_params(axis="x", nbins=6)
    phase(response, axes["phase"])
    hysteresis(response, axes["hysteresis"])
    axes["hysteresis"].set_ylabel("restoring and damping\nmoment over m g R sin α (–)")
    axes["phase"].set_ylabel("angular velocity over pα,\nθ'/(pα) (–)")
    if bool(response["overturned"]):  # the way down would press all before it into the middle
        for name in ("phase", "hysteresis"):
            low, high = axes[name].get_xlim()
            axes[name].set_xlim(max(low, -HIGHEST), min(high, HIGHEST))
            _fit_to_seen(axes[name])
    heading(figure, title, text)
    return figure


def _shaking(response: xr.Dataset, ax: Axes, lifts: float) -> None:
    """The floor's acceleration, and what lifts the block."""
    acceleration = response["floor_acceleration"].values / STANDARD_GRAVITY
    ax.plot(response["time"].values, acceleration, color=INK, lw=0.8)
    limit = lifts / STANDARD_GRAVITY
    ax.axhline(limit, color=COLOURS[1], lw=0.9, ls=DASHED, label=f"lifts a rigid block: ±g tan α = {limit:.3g} g")
    ax.axhline(-limit, color=COLOURS[1], lw=0.9, ls=DASHED)
    ax.set_ylabel("floor\nacceleration (g)")
    grid(ax)


def _rotation(response: xr.Dataset, ax: Axes) -> None:
    """The rotation, its balance, when that is passed and when the block lies on its side."""
    history(response, ax, labels=[""], colors=COLOURS[:1]).lines[0].set_linestyle("solid")
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
            ax.axvline(lies, color=COLOURS[0], lw=1.1, ls=DOTTED, label=f"on its side, {lies:.2f} s")


def _fit_to_seen(ax: Axes) -> None:
    """The y-axis for the part of the line that the x-axis shows."""
    low, high = ax.get_xlim()
    x, y = (np.asarray(values) for values in ax.lines[0].get_data())
    seen = y[(x >= low) & (x <= high)]
    if seen.size and np.ptp(seen) > 0.0:
        room = 0.05 * float(np.ptp(seen))
        ax.set_ylim(float(seen.min()) - room, float(seen.max()) + room)
