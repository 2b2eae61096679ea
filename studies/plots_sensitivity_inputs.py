"""Figures of uncertain inputs in a sensitivity study: tornado and Sobol' indices of every law.  Axes in, axes out."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.ticker import PercentFormatter
from numpy.typing import NDArray

from .plots import grid, laws_of, new_axes, one_of
from .words import input_name

WIDTH, HEIGHT = 5.2, 3.4
TEXT = 11.0
"""Of figures (in) and their text (pt): 380 pixels across leave 8 pt."""


def tornado_panel(results: xr.Dataset, ax: Axes | None = None, *, block: str | None = None) -> Axes:
    """P(overturn) with one input at a time at its 5 % and 95 % quantiles, every law of a block below another.

    Arguments as of `plots_sensitivity.sensitivity`.
    """
    here, ax = _panel(results, "tornado_low", ax, block)
    for y, law in zip(_lanes(here), laws_of(here), strict=True):
        low, high = law.results["tornado_low"].values, law.results["tornado_high"].values
        ax.hlines(y, low, high, color=law.colour, lw=3.0)
        ax.plot(low, y, "o", color=law.colour, ms=5.0, mfc="white", mew=1.3)
        ax.plot(high, y, "o", color=law.colour, ms=5.0, label=law.label)
    ax.set_xlim(-0.03, 1.03)
    ax.xaxis.set_major_formatter(PercentFormatter(1.0))
    ax.set_xlabel("P(overturn), input low (open) and high (full)")
    return ax


def sobol_panel(results: xr.Dataset, ax: Axes | None = None, *, block: str | None = None) -> Axes:
    """Total Sobol' indices of P(overturn) with their intervals, every law of a block below another.

    Arguments as of `plots_sensitivity.sensitivity`.
    """
    here, ax = _panel(results, "sobol_total", ax, block)
    for y, law in zip(_lanes(here), laws_of(here), strict=True):
        total, lower, upper = (law.results[f"sobol_total{end}"].values for end in ("", "_lower", "_upper"))
        ends = [total - lower, upper - total]
        ax.errorbar(total, y, xerr=ends, fmt=law.marker, color=law.colour, ms=5.0, lw=1.2, label=law.label)
    ax.axvline(0.0, color="0.4", lw=0.8)
    ax.set_xlabel("total Sobol' index of P(overturn)")
    return ax


def _panel(results: xr.Dataset, needed: str, ax: Axes | None, block: str | None) -> tuple[xr.Dataset, Axes]:
    """The results of one block, and axes with a row for each input."""
    if needed not in results:
        raise ValueError(f"results hold no {needed}: the study asked for none (sensitivity.inputs, sensitivity.sobol)")
    here = one_of(results, "block", block)
    if ax is None:
        ax = new_axes(WIDTH, HEIGHT)
    names = [input_name(str(one)) for one in here["input"].values]
    ax.set_yticks(range(len(names)), names)
    ax.set_ylim(len(names) - 0.5, -0.5)
    for i in range(1, len(names)):
        ax.axhline(i - 0.5, color="0.85", lw=0.8, zorder=0)
    grid(ax, "x")
    ax.set_title(str(here["block"].item()), fontsize=TEXT)
    return here, ax


def _lanes(results: xr.Dataset) -> NDArray[np.float64]:
    """Where each law stands beside each input, (model, input)."""
    laws, inputs = results.sizes["model"], results.sizes["input"]
    shift = np.linspace(-0.3, 0.3, laws) if laws > 1 else np.zeros(1)
    return np.asarray(shift[:, None] + np.arange(inputs)[None])
