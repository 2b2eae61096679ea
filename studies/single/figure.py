"""The figure of one run: floor acceleration and rotation over time, phase portrait and hysteresis."""

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...core.units import STANDARD_GRAVITY
from ..plots import axes
from ..plots.response import HIGHEST, history, hysteresis, phase
from ..text.histories import block_of, last_balance

AFTER = 1.0
"""Time that the axis continues after the block lies on its side, s; at least a tenth of the time until then."""
WIDTH = 8.0
INK, DASHED, DOTTED = "0.35", (0, (4, 3)), (0, (1, 2))


@axes.style()
def history_figure(
    response: xr.Dataset, title: str, text: str, *, lifts: tuple[float, float], ends: float, walls: Sequence[float] = ()
) -> Figure:
    """Return the figure of one run: `lifts` are tipping accelerations, m/s²; `ends` the end of the record, s."""
    figure = Figure(figsize=(WIDTH, 9.0), layout="constrained")
    panels = figure.subplot_mosaic(
        [["shaking", "shaking"], ["history", "history"], ["phase", "hysteresis"]], height_ratios=(0.55, 1.0, 1.25)
    )
    time = response["time"].values
    first, last = float(time[0]), float(time[-1])
    lies = float(response["overturning_time"])
    if lies < last:  # NaN if the block does not overturn
        last = min(last, lies + max(AFTER, 0.1 * (lies - first)))
    _shaking(response, panels["shaking"], lifts)
    _rotation(response, panels["history"], walls)
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
    if bool(response["overturned"]):  # the fall would compress all that precedes it into the middle
        for name in ("phase", "hysteresis"):
            low, high = panels[name].get_xlim()
            panels[name].set_xlim(max(low, -HIGHEST), min(high, HIGHEST))
            _fit_to_seen(panels[name])
    figure.suptitle(axes.wrapped(f"{title}\n{text}", 0.94 * WIDTH), x=0.01, ha="left", weight="normal")
    return figure


def _shaking(response: xr.Dataset, ax: Axes, lifts: tuple[float, float]) -> None:
    """Draw the floor's acceleration, and the accelerations that lift the block (negative: it tips to the front)."""
    acceleration = response["floor_acceleration"].values / STANDARD_GRAVITY
    ax.plot(response["time"].values, acceleration, color=INK, lw=0.8)
    front, back = (limit / STANDARD_GRAVITY for limit in lifts)
    limits = f"±g tan α = {back:.3g} g" if front == back else f"g tan α = −{front:.3g} g and {back:.3g} g"
    ax.axhline(back, color=axes.COLOURS[1], lw=0.9, ls=DASHED, label=f"lifts a rigid block: {limits}")
    ax.axhline(-front, color=axes.COLOURS[1], lw=0.9, ls=DASHED)
    axes.label(ax, y="floor acceleration (g)")


def _rotation(response: xr.Dataset, ax: Axes, walls: Sequence[float]) -> None:
    """Draw the rotation, balance and walls, and the times of the restraint's rupture, the last balance and the fall."""
    history(response, ax, labels=[""], colors=axes.COLOURS[:1]).lines[0].set_linestyle("solid")
    low, high = ax.get_ylim()
    alpha = float(response.attrs["alpha"])
    block = block_of(response)
    front, back = block.balances
    sides = (front / alpha, -back / alpha)
    if low < sides[1] or high > sides[0]:
        alike = "balance, θ = ±α" if sides[0] == -sides[1] else "balance, forward and backward"
        alike = alike if block.bed is None else "balance on the bed"
        for side in sides:
            ax.axhline(side, color=INK, lw=0.9, ls=DASHED, label=alike if side > 0.0 else None)
    label: str | None = "meets the wall"
    for rotation in walls:
        if low < rotation / alpha < high:
            ax.axhline(rotation / alpha, color=axes.COLOURS[2], lw=1.1, ls=DOTTED, label=label)
            label = None
    ax.set_ylim(low, high)
    if "rupture_time" in response and float(response["rupture_time"]) <= float(response["time"][-1]):
        at = float(response["rupture_time"])
        ax.axvline(at, color=axes.COLOURS[1], lw=1.1, ls=DOTTED, label=f"restraint breaks, {at:.2f} s")
    if bool(response["overturned"]):
        at, _, passed = last_balance(response)
        if passed:
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
