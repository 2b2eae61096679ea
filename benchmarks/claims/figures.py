"""Figures of claims: free rocking, its distance from the rigid block's, and convergence under pulses."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...core.aliases import Index
from ...studies.plots import axes, selection
from ...studies.plots.sensitivity import HEIGHT, ROOM, TEXT, WIDTH, column, legend, line_style, shade_friction, x_axis
from ...studies.tables.sensitivity import GREEK
from .free_decay import RELEASE

EQUAL = 1e-9
"""A distance from the rigid block up to which the difference is only rounding."""
SHOWN = 5
"""Number of values of the parameter for which free rocking is shown."""


def figures(results: xr.Dataset) -> Iterator[tuple[str, Figure]]:
    """Yield the figures of `evidence` with their names, free rocking of the first block."""
    yield "decay_error", column(results, decay_panel, f"released at {RELEASE:g} α, mean of ten half cycles")
    yield "free_rocking", free_rocking_figure(results, str(results["block"].values[0]))
    if "pulse_error" in results:
        yield "convergence", column(results, convergence, "one-cycle sine pulses; below the frame: equal")


def decay_panel(results: xr.Dataset, ax: Axes | None = None, *, block: str | None = None) -> Axes:
    """Draw the mean ratio of free-rocking peaks to the rigid block's, against the parameter."""
    here = selection.one(results, block=block)
    if ax is None:
        ax = axes.new(WIDTH, HEIGHT)
    x = results["value"].values
    for law in selection.laws(here):
        ax.plot(x, 1.0 + law.results["decay_error"].values, **line_style(law))
    colour, _, line = axes.REFERENCE
    ax.plot(x, np.ones(x.size), color=colour, lw=1.3, ls=line, zorder=1, label="rigid block")
    x_axis(results, ax)
    shade_friction(here, ax)
    ratios = 1.0 + here["decay_error"].values
    ax.set_ylim(min(1.0, np.nanmin(ratios)) / ROOM, max(1.0, np.nanmax(ratios)) * ROOM)
    ax.set_yscale("log")
    axes.plain_log_y(ax)
    ax.set_ylabel("peaks of free rocking\nover the rigid block's")
    ax.set_title(str(here["block"].item()), fontsize=TEXT)
    return ax


def free_rocking_panel(
    results: xr.Dataset, ax: Axes | None = None, *, block: str | None = None, model: str | None = None
) -> Axes:
    """Draw free rocking of a block under one law at some values of the parameter, from dark to bright.

    In a study of delta the rigid block's peaks are drawn as dots.
    """
    here = selection.one(results, block=block, model=model)
    if ax is None:
        ax = axes.new(WIDTH, HEIGHT)
    colours = mpl.colormaps["viridis"]
    for k, place in enumerate(_shown_values(results)):
        one = here.isel(value=place)
        colour = colours(0.9 * k / max(1, SHOWN - 1))
        ax.plot(one["scaled_time"], one["free_rotation"], color=colour, lw=1.2, label=f"{one['value'].item():g}")
    ax.axhline(0.0, color="0.6", lw=0.6, zorder=0)
    envelope = here.isel(value=_shown_values(results)[0])
    if results.attrs["parameter"] == "delta":
        times, signs = _closed_form(envelope)
        ax.plot(times, signs, ".", color="black", ms=5.0, zorder=3, label="rigid block's peaks")
    ax.set_xlim(0.0, float(here["scaled_time"].max()))
    ax.set_ylim(-0.56, 0.56)
    axes.grid(ax)
    ax.set_title(axes.model_name(str(here["model"].item())), fontsize=TEXT - 1.0)
    return ax


def convergence(results: xr.Dataset, ax: Axes | None = None, *, block: str | None = None) -> Axes:
    """Draw the distance from the rigid block under pulses over delta, both logarithmic, and the slope of first order.

    Distances that are only rounding (below 1e-9) lie below the frame.
    """
    here = selection.one(results, block=block)
    if ax is None:
        ax = axes.new(WIDTH, HEIGHT)
    x = results["value"].values
    for law in selection.laws(here):
        error = law.results["pulse_error"].values
        ax.plot(x, np.where(error > 0.0, error, np.nan), **line_style(law))
    ax.set_yscale("log")
    apart = here["pulse_error"].values[here["pulse_error"].values > EQUAL]
    if apart.size:
        ax.set_ylim(0.3 * apart.min(), 3.0 * apart.max())
        ax.plot(x, apart.min() * x / x[0], color="0.5", lw=1.0, ls=(0, (1, 2)), label="first order")
    x_axis(results, ax)
    ax.set_ylabel("distance from the rigid\nblock's peaks, over α")
    ax.set_title(str(here["block"].item()), fontsize=TEXT)
    return ax


def free_rocking_figure(results: xr.Dataset, block: str | None = None) -> Figure:
    """Return the figure of free rocking of one block (needed where there are several): a panel for each law."""
    here = selection.one(results, block=block)
    labels = selection.labels(results, "model")
    columns = min(2, axes.columns_for(len(labels)))
    rows = math.ceil(len(labels) / columns)
    with mpl.rc_context({"font.size": TEXT - 0.5}):
        figure = axes.figure(WIDTH, 1.75 * rows + 1.3)
        panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
        for ax, label in zip(panels.flat, labels, strict=False):
            free_rocking_panel(here, ax, model=label)
        for ax in list(panels.flat)[len(labels) :]:
            ax.set_axis_off()
        for ax in panels[-1]:
            ax.set_xlabel("time, p t")
        figure.supylabel("rotation θ/α", fontsize=TEXT)
        name = here["block"].item()
        symbol = GREEK[str(results.attrs["parameter"])]
        figure.suptitle(f"{name}: colours are {symbol}", fontsize=TEXT)
        legend(figure, panels.flat[0], 3 if axes.has_room() else 2)
    return figure


def _shown_values(results: xr.Dataset) -> Index:
    n = results.sizes["value"]
    return np.unique(np.linspace(0, n - 1, min(SHOWN, n)).round().astype(np.int64))


def _closed_form(one: xr.Dataset) -> tuple[Any, Any]:
    """Return times (p t) and signed rotations of the rigid block's peaks, from the closed form."""
    x = one["decay_rigid"].values
    q_over_p = np.sqrt(np.sin(one["alpha"].item()) / one["alpha"].item())
    quarters = np.arccosh(1.0 / (1.0 - x))
    times = np.concatenate([[0.0], np.cumsum(quarters[:-1] + quarters[1:])]) / q_over_p
    return times, x * (-1.0) ** np.arange(x.size)
