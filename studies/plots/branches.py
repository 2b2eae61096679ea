"""Figure of annual rates over weighted branches: their range for each block, and what spreads it."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogFormatterSciNotation, LogLocator, NullFormatter, PercentFormatter

from ...core.wording import two_digits
from ..text.curve_notes import state_in
from ..text.spread import SOURCES
from ..text.words import by_place
from . import axes

MOST_ROWS = 16
"""Most blocks (and floors) of the figure."""
THIN, THICK = (0.05, 0.95), (0.16, 0.84)


def spread_figure(results: xr.Dataset) -> Figure:
    """Return the figure of the rates over all branches: ranges of each block or piece beside what spreads them."""
    dims = results["epistemic_rate"].dims
    flat = results[["epistemic_rate", "epistemic_rate_fractile", "epistemic_spread", "branch_rate"]]
    flat = flat.stack(row=dims, create_index=False) if len(dims) > 1 else flat.rename({dims[0]: "row"})
    flat = flat.isel(row=slice(MOST_ROWS))
    names = [name for name, _ in by_place(results, dims)][:MOST_ROWS]
    rows = len(names)
    height = 1.9 + 0.55 * rows
    if axes.has_room():
        figure = axes.figure(8.4, height)
        ranges, shares = figure.subplots(1, 2, sharey=True, width_ratios=(1.25, 1.0))
    else:
        figure = axes.figure(8.4, 2.0 * height + 0.6)
        ranges, shares = figure.subplots(2, 1, sharey=True)
    y = np.arange(rows)
    fractiles = flat["epistemic_rate_fractile"].transpose("row", "epistemic_fractile")
    for (low, high), width in ((THIN, 1.4), (THICK, 5.0)):
        ends = [fractiles.sel(epistemic_fractile=end).values for end in (low, high)]
        ranges.hlines(y, *ends, color=axes.colour(0), lw=width, zorder=2)
    weights = results["branch_weight"].values
    own = flat["branch_rate"].transpose("row", "branch").values
    for i in range(rows):
        ranges.scatter(own[i], np.full(own.shape[1], y[i] + 0.28), 90.0 * weights + 4.0, color="0.55", lw=0.0, zorder=1)
    ranges.plot(fractiles.sel(epistemic_fractile=0.5).values, y, "|", color="black", ms=12.0, mew=1.6, zorder=3)
    ranges.plot(flat["epistemic_rate"].values, y, "D", color="black", mfc="white", ms=6.0, zorder=4)
    ranges.set_xscale("log")
    ranges.set_yticks(y, [axes.wrapped(name, 1.6) for name in names])
    ranges.set_ylim(rows - 0.4, -0.6)
    ranges.set_xlabel("annual rate (1/year)")
    years = ranges.secondary_xaxis("top", functions=(axes.inverse, axes.inverse))
    years.set_xlabel("once in so many years")
    years.xaxis.set_major_formatter(FuncFormatter(lambda value, _: two_digits(value)))
    for axis in (ranges.xaxis, years.xaxis):  # (of less than a decade the numbers between powers of ten would overlap)
        axis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
        axis.set_minor_formatter(NullFormatter())
    ranges.xaxis.set_major_formatter(LogFormatterSciNotation(labelOnlyBase=False, minor_thresholds=(np.inf, np.inf)))
    axes.grid(ranges)
    before = np.zeros(rows)
    for k, name in enumerate(str(one) for one in results["epistemic_source"].values):
        part = np.nan_to_num(flat["epistemic_spread"].sel(epistemic_source=name).values)
        if part.max() > 0.0:
            colour = "0.7" if name == "together" else axes.colour(k)
            shares.barh(y, part, 0.6, before, color=colour, edgecolor="white", lw=0.8, label=SOURCES[name][1])
            before += part
    shares.set_xlim(0.0, 1.0)
    shares.xaxis.set_major_formatter(PercentFormatter(1.0))
    shares.set_xlabel("share of the variance of ln(rate)")
    shares.spines[["top", "right"]].set_visible(False)
    marks: list[Artist] = [
        Line2D([], [], color=axes.colour(0), lw=1.4),
        Line2D([], [], color=axes.colour(0), lw=5.0),
        Line2D([], [], color="black", marker="|", ms=12.0, mew=1.6, ls=""),
        Line2D([], [], color="black", marker="D", mfc="white", ms=6.0, ls=""),
        Line2D([], [], color="0.55", marker="o", ms=5.0, ls=""),
    ]
    texts = ["5 to 95 %", "16 to 84 %", "median", "mean", "single branches (area: weight)"]
    handles, labels = shares.get_legend_handles_labels()
    axes.legend_below(figure, [*marks, *handles], [*texts, *labels])
    text = (
        f"annual rates of {state_in(results)} over {results.sizes['branch']:,} weighted branches, and what spreads them"
    )
    axes.heading(figure, str(results.attrs.get("title", "Rates over branches")), text)
    return figure
