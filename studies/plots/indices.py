"""Figures of sensitivity indices: Sobol' indices and a tornado."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...core import checks
from ...core.aliases import Array
from ...core.wording import percent
from ..buildings.variables import level_index
from ..plan.estimates import middle_level
from ..text.words import block_title, display_unit, input_name
from . import axes, selection

OWN = {"sobol": "total", "tornado": "swing"}
"""For each method a variable that only its results have."""


@axes.drawing
def indices(
    results: xr.Dataset,
    ax: Axes | None = None,
    *,
    method: str | None = None,
    block: str | None = None,
    model: str | None = None,
    level: float | None = None,
) -> Axes:
    """Draw the importance of each uncertain input: Sobol' indices or a tornado.

    Parameters
    ----------
    results : xarray.Dataset
        An uncertainty study's results, or the dataset that `sobol_indices` or `tornado` of
        `toppling.fragility` returns, of one output (``isel(output=0)``).
    method : {"sobol", "tornado"}, optional
        The method; needed where a study's results have several.
    level : float, optional
        One of a study's levels (SI); by default the level with a probability of overturning nearest to one half.
    """
    draw = {"sobol": sobol_bars, "tornado": tornado_bars}
    held = [name for name, own in OWN.items() if f"{name}_{own}" in results]
    plain = [name for name, own in OWN.items() if own in results]
    if not held and not plain:
        raise ValueError("a figure of indices needs Sobol' indices or a tornado, got none")
    if method is not None:
        checks.choice("method", method, held or plain)
    elif len(held) > 1:
        raise ValueError(f"results hold indices of several methods, say which: {', '.join(held)}")
    name = method or (held or plain)[0]
    if not held:
        return draw[name](selection.one(results, block=block, model=model), ax)
    here = selection.one(results, block=block, model=model)
    at = middle_level(here["probability"]) if level is None else level_index(here, level)
    found = {str(key): str(key).removeprefix(f"{name}_") for key in here.data_vars if str(key).startswith(f"{name}_")}
    ax = draw[name](here[list(found)].rename(found).isel(output=at), ax)
    scale, unit = display_unit(here["level"])
    axes.name(ax, f"Probability of overturning at {float(here['level'][at]) / scale:.3g} {unit}".strip())
    return ax


def _reach(here: xr.Dataset, name: str) -> tuple[Array, Array] | None:
    """Return how far the interval of an index extends below and above it; None where there is no interval."""
    value = here[name].values
    if f"{name}_lower" not in here:
        return None
    lower, upper = (here[f"{name}{end}"].values for end in ("_lower", "_upper"))
    return np.maximum(value - lower, 0.0), np.maximum(upper - value, 0.0)


@axes.style()
def sobol_bars(found: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw first- and total-order Sobol' indices of one output with their intervals, the largest total on top."""
    here = _one_output(found, "total")
    here = here.isel(input=np.argsort(-np.nan_to_num(here["total"].values), kind="stable"))
    y = np.arange(here.sizes["input"])
    alone = ax is None
    ax = ax or axes.new(0.5 * y.size + 1.3)
    error = {"ecolor": "0.25", "elinewidth": 1.1, "capsize": 2.5}
    for name, shift, label in (("total", 0.19, "total: with all others"), ("first", -0.19, "first order: alone")):
        colour = axes.GREY if name == "total" else axes.COLOURS[0]
        ax.barh(y + shift, here[name].values, 0.36, color=colour, label=label, xerr=_reach(here, name), error_kw=error)
    ax.axvline(0.0, color="0.25", lw=0.8)
    return _with_inputs(ax, here, "share of the variance", alone)


@axes.style()
def tornado_bars(found: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw one output with one input at a time at its low and its high quantile, the widest on top."""
    here = _one_output(found, "swing")
    here = here.isel(input=np.argsort(-here["swing"].values, kind="stable"))
    y = np.arange(here.sizes["input"])
    alone = ax is None
    ax = ax or axes.new(0.42 * y.size + 1.6)
    first, last = (percent(float(quantile)) for quantile in found.attrs["quantiles"])
    ax.axvline(here["base"].item(), color="0.25", lw=0.9, zorder=0)
    # only the ends are drawn, not bars from the base: both ends may lie on one side, where one bar would hide the other
    ax.hlines(y, here["low"].values, here["high"].values, color=axes.GREY, lw=5.0, zorder=1)
    for i, name, label in (
        (0, "low", f"input at its {first} quantile, or its smallest choice"),
        (1, "high", f"input at its {last} quantile, or its largest choice"),
    ):
        ax.plot(here[name].values, y, axes.MARKERS[i], ms=8.0, color=axes.colour(i), label=label, zorder=2)
    return _with_inputs(ax, here, "value", alone)


def _with_inputs(ax: Axes, here: xr.Dataset, text: str, alone: bool) -> Axes:
    """Name the rows after the inputs, and the axes after the output; axes of their own get a legend above them."""
    axes.named_rows(ax, [input_name(str(key)) for key in here["input"].values], 0.6)
    output = str(here["output"].item()) if "output" in here.coords else ""
    axes.label(ax, output if output and text == "value" else text, along="x")
    if output and text != "value":
        axes.name(ax, output)
    if alone:
        ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.08), reverse=text != "value")
    return ax


def _one_output(indices: xr.Dataset, name: str) -> xr.Dataset:
    if indices[name].dims != ("input",):
        raise ValueError(f"one output is drawn, got {dict(indices[name].sizes)}: select it")
    return indices


@axes.style()
def index_figure(results: xr.Dataset) -> Figure:
    """Return the figure of Sobol' indices at a probability near one half: a panel for each block and law."""
    blocks, models = selection.labels(results, "block"), selection.labels(results, "model")
    cases = [
        (block, model, law) for block in blocks for model, law in zip(models, selection.law_names(models), strict=True)
    ]
    height = 0.45 * results.sizes["input"] + 1.0
    figure, panels, columns = axes.panel_grid(len(cases), height, 0.7, axes.columns_for(len(models)))
    for i, (ax, (block, model, law)) in enumerate(zip(panels, cases, strict=True)):
        indices(results, ax, method="sobol", block=block or None, model=model or None)
        axes.name(
            ax, f"{', '.join(filter(None, (block_title(block), law)))}\nat {ax.get_title('left').rpartition(' at ')[2]}"
        )
        axes.outer_labels(ax, i, columns, len(cases), ticks=False)
    notes = (
        "variance of the probability of overturning at the level where it is nearest to 50 %",
        "bars: 95 % intervals",
    )
    axes.heading(figure, "Shares of the variance by input", *notes, legend=panels[:1])
    return figure
