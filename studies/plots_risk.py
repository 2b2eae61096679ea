"""Figures of risk: which shaking the rate of overturning comes from, and how large it is.  Axes in, axes out."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from .plots import in_years, model_name, plain_log, styles
from .words import display_unit, floor_name

MOST_ROWS = 12
NOTHING = 5e-4
"""Share of a rate below which a bin is not drawn."""


def deaggregation(risk: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Share of the annual rate by intensity, a line for each law.

    Parameters
    ----------
    risk : xarray.Dataset
        As `toppling.annual_rate` returns it, of one block (and floor): share on (model, bin).
    ax : matplotlib Axes, optional
        Where to draw; new axes where not given.

    Returns
    -------
    matplotlib Axes
    """
    if ax is None:
        ax = plt.figure(figsize=(6.0, 3.8), layout="constrained").add_subplot()
    scale, unit = display_unit(risk["bin"])
    x = risk["bin"].values / scale
    for i, (colour, _, line) in enumerate(styles(risk)):
        one = risk.isel(model=i)
        ax.step(x, one["share"], where="mid", color=colour, ls=line, lw=1.6, label=model_name(str(one["model"].item())))
    ax.set_xscale("log")
    plain_log(ax)
    ax.set_ylim(bottom=0.0)
    ax.yaxis.set_major_formatter(PercentFormatter(1.0, decimals=0))
    name = str(risk["bin"].attrs.get("long_name", "intensity")).rsplit(" of ", 1)[-1]
    ax.set_xlabel(f"{name}{f' ({unit})' if unit else ''}")
    ax.set_ylabel("share of the annual rate")
    ax.grid(alpha=0.25, lw=0.6)
    ax.spines[["top", "right"]].set_visible(False)
    return ax


def annual_rates(risk: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Annual rates of one block (and floor) under every law, with their intervals and the years between events.

    Parameters
    ----------
    risk : xarray.Dataset
        As `toppling.annual_rate` returns it: rate on model, and where there are rate_lower and rate_upper.
    ax : matplotlib Axes, optional
        Where to draw; new axes where not given.

    Returns
    -------
    matplotlib Axes
    """
    if ax is None:
        ax = plt.figure(figsize=(6.0, 0.4 * risk.sizes["model"] + 1.2), layout="constrained").add_subplot()
    names = []
    for i, (colour, marker, _) in enumerate(styles(risk)):
        one = risk.isel(model=i)
        names.append(model_name(str(one["model"].item())))
        rate = one["rate"].item()
        if not rate > 0.0:
            continue
        ends = [[rate - one["rate_lower"].item()], [one["rate_upper"].item() - rate]] if "rate_lower" in one else None
        ax.errorbar(
            rate, i, xerr=None if ends is None else np.maximum(ends, 0.0), fmt=marker, ms=6.0, color=colour, lw=1.4
        )
        ax.annotate(
            f"once in {in_years(rate)} years",
            (rate, i),
            xytext=(0, 7),
            textcoords="offset points",
            ha="center",
            fontsize=8,
        )
    ax.set_xscale("log")
    plain_log(ax)
    ax.set_yticks(np.arange(len(names)), names)
    ax.set_ylim(len(names) - 0.4, -0.7)
    ax.margins(x=0.18)
    ax.set_xlabel("annual rate of overturning (1/year)")
    ax.grid(axis="x", alpha=0.25, lw=0.6)
    ax.spines[["top", "right"]].set_visible(False)
    return ax


def risk_figure(results: xr.Dataset) -> Figure:
    """A row for each block (and floor): rates of every law, and the shaking that they come from."""
    floors = list(results["floor"].values.tolist()) if "floor" in results["rate"].dims else [None]
    every = [(str(block), floor) for block in results["block"].values for floor in floors]
    rows = every[:MOST_ROWS]
    figure = plt.figure(
        figsize=(10.4, max(2.6, 0.42 * results.sizes["model"] + 1.4) * len(rows) + 0.5), layout="constrained"
    )
    axes = figure.subplots(len(rows), 2, squeeze=False, sharex="col")
    for (left, right), (block, floor) in zip(axes, rows, strict=True):
        here = results.sel(block=block) if floor is None else results.sel(block=block, floor=floor)
        annual_rates(here, left)
        deaggregation(here, right)
        for ax in (left, right):
            ax.tick_params(labelbottom=True)
            ax.set_xlabel(ax.get_xlabel() if block == rows[-1][0] and floor == rows[-1][1] else "")
        left.set_title(block if floor is None else f"{block}, {floor_name(floor)}", fontsize=10)
    whole = results["share"].values
    held = np.flatnonzero((whole > NOTHING).any(axis=tuple(range(whole.ndim - 1))))
    if held.size:
        x = results["bin"].values / display_unit(results["bin"])[0]
        axes[0, 1].set_xlim(x[max(held[0] - 1, 0)], x[min(held[-1] + 1, x.size - 1)])
    percent = f"{100.0 * float(results.attrs.get('confidence', 0.95)):g} %"
    title = str(results.attrs.get("title", "Risk"))
    if len(every) > len(rows):
        title += f": the first {len(rows)} of {len(every)}"
    figure.suptitle(f"{title}\nannual rates with {percent} intervals over motions", fontsize=11)
    return figure
