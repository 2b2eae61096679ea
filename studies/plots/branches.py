"""Figure of annual rates over weighted branches: their range for each block, and the sources of their spread."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatterSciNotation, LogLocator

from ..text.curve_notes import state_in
from ..text.spread import SOURCES
from ..text.words import by_place
from . import axes

MOST_ROWS = 16
"""Largest number of blocks (and floors) of the figure."""
THIN, THICK = (0.05, 0.95), (0.16, 0.84)
TOGETHER = "together"
"""The source that is the interaction of the others."""
SEEN, NAMED = 0.005, 0.15
"""Shares of a variance from which its source is drawn, and named in the bar."""


@axes.style()
def spread_figure(results: xr.Dataset) -> Figure:
    """Return the figure of the rates over all branches: ranges of each block or piece beside the sources of spread."""
    dims = results["epistemic_rate"].dims
    flat = results[["epistemic_rate", "epistemic_rate_fractile", "epistemic_spread", "branch_rate"]]
    flat = flat.stack(row=dims, create_index=False) if len(dims) > 1 else flat.rename({dims[0]: "row"})
    flat = flat.isel(row=slice(MOST_ROWS))
    names = [name for name, _ in by_place(results, dims)][:MOST_ROWS]
    figure, (ranges, shares), _ = axes.panel_grid(2, 1.3 + 0.45 * len(names), 0.4)
    y = np.arange(len(names))
    fractiles = flat["epistemic_rate_fractile"].transpose("row", "epistemic_fractile")
    for (low, high), width in ((THIN, 1.4), (THICK, 5.0)):
        left, right = (fractiles.sel(epistemic_fractile=end).values for end in (low, high))
        ranges.hlines(y, left, right, color=axes.colour(0), lw=width, zorder=2)
    rates = flat["branch_rate"].transpose("row", "branch").values
    sizes = np.broadcast_to(90.0 * results["branch_weight"].values + 4.0, rates.shape)
    ranges.scatter(rates, np.broadcast_to(y[:, None] + 0.28, rates.shape), sizes, color="0.55", lw=0.0, zorder=1)
    ranges.plot(fractiles.sel(epistemic_fractile=0.5).values, y, "|", color="black", ms=12.0, mew=1.6, zorder=3)
    ranges.plot(flat["epistemic_rate"].values, y, "D", color="black", mfc="white", ms=6.0, zorder=4)
    ranges.set_xscale("log")
    axes.named_rows(ranges, names)
    ranges.xaxis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
    ranges.xaxis.set_major_formatter(LogFormatterSciNotation(labelOnlyBase=False, minor_thresholds=(np.inf, np.inf)))
    ranges.minorticks_off()
    axes.label(ranges, f"annual rate of {state_in(results)}")
    axes.years(ranges, "top")
    before = np.zeros(len(names))
    for k, source in enumerate(results["epistemic_source"].values.astype(str)):
        part = np.nan_to_num(flat["epistemic_spread"].sel(epistemic_source=source).values)
        if part.max() > SEEN:
            hatch = "////" if k >= len(axes.COLOURS) and source != TOGETHER else None
            colour = axes.GREY if source == TOGETHER else axes.colour(k)
            name = "interactions" if source == TOGETHER else SOURCES[source][0]
            shares.barh(y, part, 0.6, before, color=colour, edgecolor="white", lw=0.8, hatch=hatch, label=name)
            ink = "black" if source == TOGETHER or hatch else "white"
            for at, (first, wide) in enumerate(zip(before, part, strict=True)):
                if wide > max(NAMED, len(name) / axes.LETTERS / axes.width_of(shares)):
                    shares.annotate(name, (first + 0.5 * wide, at), ha="center", va="center", color=ink)
            before += part
    axes.named_rows(shares, names)
    shares.tick_params(labelleft=not axes.has_room())
    shares.set_xlim(0.0, 1.0)
    axes.shares(shares.xaxis)
    axes.label(shares, "share of the variance of ln(rate)", along="x")
    axes.heading(
        figure,
        "Annual rates over all branches",
        f"{results.sizes['branch']:,} weighted branches",
        "thick lines: 16 to 84 %; thin lines: 5 to 95 %; bars: medians; diamonds: means",
        "grey dots: single branches, with their weight as area",
        legend=[shares],
    )
    return figure
