"""The figure of claims: the distance of free rocking from the rigid block's."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...studies.plots import axes, selection
from ...studies.plots.sensitivity import ROOM, column, line_style, shade_friction, x_axis
from .evidence import RELEASE


def figures(results: xr.Dataset) -> Iterator[tuple[str, Figure]]:
    """Yield the figures of `evidence` with their names."""
    yield (
        "decay_error",
        column(results, decay_panel, "Peaks of free rocking", f"released at {RELEASE:g} α, mean of ten half cycles"),
    )


def decay_panel(results: xr.Dataset, ax: Axes, *, block: str | None = None) -> Axes:
    """Draw the mean ratio of free-rocking peaks to the rigid block's, against the parameter."""
    here = selection.one(results, block=block)
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
    axes.name(ax, str(here["block"].item()))
    return axes.label(ax, y="peaks of free rocking over the rigid block's")
