"""Figures of uncertainty: curves with their spread over samples, and shares of variance."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from ...core import checks
from ...core.wording import percent
from ...fragility.runs.provenance import number_of_motions
from ...motions.arrays import POLARITY
from ..text.words import axis_name, display_unit, input_name
from . import axes, selection

MOST_BARS = 8
HATCHES = ("", "////", "....")
OPEN = 0.005
"""Probability from which the outcome is uncertain: below it, and above its complement, there is no variance."""


def uncertainty(
    results: xr.Dataset,
    ax: Axes | None = None,
    *,
    view: str = "probability",
    block: str | None = None,
    model: str | None = None,
    color: str | None = None,
) -> Axes:
    """Draw probabilities of an uncertain block with their spread over samples, or the sources of the variance.

    Parameters
    ----------
    results : xarray.Dataset
        An uncertainty study's results.
    view : {"probability", "variance"}
        Curves with bands, or the shares of the variance of the outcome at levels where the outcome is uncertain.
    ax, block, model, color : optional
        As for `fragility`.

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    ValueError
        No results of an uncertainty study; several blocks, and no label given; no such block or law; one law for the
        variance, which is shared among all laws.

    Notes
    -----
    A band lies between the outer quantiles over samples of the samples' own probabilities (90 % of them); its edges
    have the colour and the line of the law.
    """
    checks.choice("view", view, ("probability", "variance"))
    needed = "probability_quantile" if view == "probability" else "flag_share"
    if needed not in results:
        raise ValueError(f"a figure of uncertainty needs {needed}: results of an uncertainty study")
    here = selection.one(results, block=block)
    if view == "variance":
        if model is not None:
            raise ValueError(f"the variance is shared among all laws: it has no part of {model!r} alone")
        return variance_bars(here[["flag_share"]].rename(flag_share="share").isel(level=open_levels(here)), ax)
    alone = ax is None
    ax = ax or axes.new(6.4, 4.4)
    laws = selection.laws(here, model, color)
    scale, _ = display_unit(here["level"])
    x = here["level"].values / scale
    for law in laws:
        band = law.results["probability_quantile"].transpose(..., "quantile").values
        low, high = band[..., 0], band[..., -1]
        ax.fill_between(x, low, high, color=law.colour, alpha=0.15 if len(laws) == 1 else 0.06, lw=0.0)
        for end in (low, high):
            ax.plot(x, end, color=law.colour, ls=law.line, lw=0.8)
        ax.plot(x, law.results["probability"].values, color=law.colour, ls=law.line, lw=2.0, label=law.label or None)
    probability_axes(ax, here)
    if alone:
        axes.own_legend(ax)
    return ax


def probability_axes(ax: Axes, here: xr.Dataset) -> None:
    """Set up axes of probability against the level."""
    scale, _ = display_unit(here["level"])
    x = here["level"].values / scale
    # (only the levels at which some sample is uncertain, and one level on either side)
    band = here["probability_quantile"].transpose(..., "level", "quantile").values
    some = np.flatnonzero(((band > OPEN) & (band < 1.0 - OPEN)).any(axis=(*range(band.ndim - 2), -1)))
    low, high = (max(some[0] - 1, 0), min(some[-1] + 1, x.size - 1)) if some.size else (0, x.size - 1)
    axes.level_axis(ax, float(x[low]), float(x[high]), axes.log_spaced(x), axis_name(here["level"]))
    ax.set_ylim(-0.02, 1.02)
    ax.yaxis.set_major_formatter(PercentFormatter(1.0))
    ax.set_ylabel(f"probability of {here.attrs.get('state', 'overturning')}")
    axes.grid(ax)


def open_levels(here: xr.Dataset) -> np.ndarray[Any, np.dtype[np.intp]]:
    """Return positions of levels with an uncertain outcome, only some of many; the first level if there is none."""
    rest = [dim for dim in here["probability"].dims if dim != "level"]
    overall = here["probability"].mean(rest).values
    found = np.flatnonzero((overall > OPEN) & (overall < 1.0 - OPEN))
    return found[:: max(1, math.ceil(found.size / MOST_BARS))] if found.size else np.arange(1)


def variance_bars(shares: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw `fragility.variance_shares` as stacked bars, a bar for each entry of the other dimension, if any."""
    share = shares["share"]
    rest = [str(dim) for dim in share.dims if dim != "component"]
    if len(rest) > 1:
        raise ValueError(f"shares are drawn along one dimension, got {', '.join(rest)}: select")
    alone = ax is None
    ax = ax or axes.new(8.4 if rest else 4.6, 4.0)
    values = np.atleast_2d(share.transpose(*rest, "component").values)
    x = np.arange(values.shape[0])
    bottom = np.zeros(x.size)
    styles = _component_styles([str(one) for one in share["component"].values])
    for k, (label, style) in enumerate(styles.items()):
        height = np.nan_to_num(values[:, k])
        ax.bar(x, height, 0.82, bottom, label=label, edgecolor="white", lw=0.8, **style)
        bottom += height
    for at in x[np.isnan(values).any(axis=1)]:
        ax.annotate("no variance", (at, 0.02), ha="center", rotation=90, fontsize=8, color="0.4")
    if rest:
        axis = shares[rest[0]]
        if axis.dtype.kind == "f":
            scale, _ = display_unit(axis)
            ax.set_xticks(x, [f"{one / scale:.2g}" for one in axis.values])
            ax.set_xlabel(axes.wrapped(axis_name(axis, rest[0]), axes.width_of(ax)))
        else:
            ax.set_xticks(x, [str(one) for one in axis.values])
    else:
        ax.set_xticks([])
        ax.set_xlim(-0.7, 0.7)
    ax.set_ylim(0.0, 1.0)
    ax.yaxis.set_major_formatter(PercentFormatter(1.0))
    ax.set_ylabel("share of the variance")
    ax.spines[["top", "right"]].set_visible(False)
    if alone:
        handles, labels = ax.get_legend_handles_labels()
        # from top to bottom, in the order of the bars
        ax.legend(handles[::-1], labels[::-1], frameon=False, loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=9)
    return ax


def _component_styles(components: list[str]) -> dict[str, dict[str, Any]]:
    """Return a colour for each main effect; interactions are grey and hatched by their number of factors."""
    styles: dict[str, dict[str, Any]] = {}
    greys = iter(np.linspace(0.45, 0.85, max(1, sum("×" in one for one in components))))
    mains = 0
    for one in components:
        parts = one.split(" × ")
        label = " × ".join(input_name(part) for part in parts)
        if len(parts) == 1:
            styles[label] = {"color": axes.colour(mains)}
            mains += 1
        else:
            styles[label] = {"color": str(round(float(next(greys)), 3)), "hatch": HATCHES[min(len(parts) - 1, 2)]}
    return styles


def uncertainty_figure(results: xr.Dataset) -> Figure:
    """Return the figure of an uncertainty study: of each block every law's curves, and the sources of variance."""
    blocks, laws = selection.labels(results, "block"), selection.laws(results)
    columns = axes.columns_for(len(laws))
    rows = math.ceil(len(laws) / columns)
    figure = axes.figure(8.4, (2.9 * rows + 3.3) * len(blocks) + 0.8)
    ratios = ([2.9] * rows + [3.2]) * len(blocks)
    cells = figure.add_gridspec((rows + 1) * len(blocks), columns, height_ratios=ratios)
    for k, block in enumerate(blocks):
        here = selection.one(results, block=block or None)
        scale, _ = display_unit(here["level"])
        top = k * (rows + 1)
        for i, law in enumerate(laws):
            ax = figure.add_subplot(cells[top + i // columns, i % columns])
            for other in selection.laws(here):
                if other.label != law.label:
                    grey = {"color": "0.75", "lw": 1.0, "ls": other.line}
                    ax.plot(here["level"].values / scale, other.results["probability"].values, **grey)
            uncertainty(here, ax, model=str(results["model"].values[i]) if "model" in results.dims else None)
            ax.set_title(axes.wrapped(f"{block}\n{law.label}", axes.width_of(ax)), fontsize=10)
            axes.outer_labels(ax, i, columns, len(laws))
        shares = uncertainty(here, figure.add_subplot(cells[top + rows, :]), view="variance")
        name = f"{block}: sources of the variance of the outcome"
        shares.set_title(axes.wrapped(name, 0.9 * figure.get_figwidth()), fontsize=10)
    axes.legend_below(figure, *shares.get_legend_handles_labels())
    samples, motions = results.sizes["sample"], number_of_motions(results)
    text = f"{samples} samples under {motions} motions{' both ways' if POLARITY in results.coords else ''}; "
    ends = results["quantile"].values
    text += f"bands hold {percent(round(float(ends[-1] - ends[0]), 9))} of the samples' own probabilities"
    if len(laws) > 1:
        text += "; grey: the other laws"
    axes.heading(figure, str(results.attrs.get("title", "Uncertainty")), text)
    return figure
