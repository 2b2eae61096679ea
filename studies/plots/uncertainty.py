"""Figures of uncertainty: curves with their spread over samples, shares of variance, Sobol’ indices and a tornado."""

import math
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...core import checks
from ...core.aliases import Array
from ...core.wording import percent
from ..buildings.variables import level_index
from ..plan.estimates import middle_level
from ..text.words import axis_name, block_title, display_unit, input_name
from . import axes, selection

MOST_BARS = 8
HATCHES = ("", "////", "....")
OPEN = 0.005
"""Probability from which the outcome is uncertain: below it, and above its complement, there is no variance."""


@axes.drawing
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

    A band lies between the outer quantiles of the samples' own probabilities (90 % of them).

    Parameters
    ----------
    results : xarray.Dataset
        An uncertainty study's results.
    view : {"probability", "variance"}
        Curves with bands, or the shares of the variance of the outcome at levels with an uncertain outcome.
    """
    checks.choice("view", view, ("probability", "variance"))
    needed = "probability_quantile" if view == "probability" else "flag_share"
    if needed not in results:
        raise ValueError(f"a figure of uncertainty needs {needed}: results of an uncertainty study")
    of_block = selection.single(results, block=block)
    if view == "variance":
        if model is not None:
            raise ValueError(f"the variance is shared among all laws: it has no part of {model!r} alone")
        return variance_bars(of_block[["flag_share"]].rename(flag_share="share").isel(level=open_levels(of_block)), ax)
    alone = ax is None
    ax = ax or axes.new()
    laws = selection.laws(of_block, model, color)
    scale, _ = display_unit(of_block["level"])
    x = of_block["level"].values / scale
    for law in laws:
        band = law.results["probability_quantile"].transpose(..., "quantile").values
        low, high = band[..., 0], band[..., -1]
        ax.fill_between(x, low, high, color=law.colour, alpha=0.15 if len(laws) == 1 else 0.06, lw=0.0)
        for end in (low, high):
            ax.plot(x, end, color=law.colour, ls=law.line, lw=0.8)
        ax.plot(x, law.results["probability"].values, color=law.colour, ls=law.line, lw=2.0, label=law.label or None)
    probability_axes(ax, of_block)
    if alone:
        axes.own_legend(ax)
    return ax


def probability_axes(ax: Axes, of_block: xr.Dataset) -> None:
    """Set up axes of probability against the level."""
    scale, _ = display_unit(of_block["level"])
    x = of_block["level"].values / scale
    # (only the levels at which some sample is uncertain, and one level on either side)
    band = of_block["probability_quantile"].transpose(..., "level", "quantile").values
    some = np.flatnonzero(((band > OPEN) & (band < 1.0 - OPEN)).any(axis=(*range(band.ndim - 2), -1)))
    low, high = (max(some[0] - 1, 0), min(some[-1] + 1, x.size - 1)) if some.size else (0, x.size - 1)
    axes.level_axis(ax, float(x[low]), float(x[high]), axes.log_spaced(x), axis_name(of_block["level"]))
    axes.probabilities(ax, str(of_block.attrs.get("state", "overturning")))


def open_levels(of_block: xr.Dataset) -> np.ndarray[Any, np.dtype[np.intp]]:
    """Return positions of levels with an uncertain outcome, only some of many; the first level if there is none."""
    rest = [dim for dim in of_block["probability"].dims if dim != "level"]
    overall = of_block["probability"].mean(rest).values
    uncertain = np.flatnonzero((overall > OPEN) & (overall < 1.0 - OPEN))
    return uncertain[:: max(1, math.ceil(uncertain.size / MOST_BARS))] if uncertain.size else np.arange(1)


def variance_bars(shares: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw `fragility.variance_shares` as stacked bars, a bar for each entry of the other dimension, if any."""
    share = shares["share"]
    rest = [str(dim) for dim in share.dims if dim != "component"]
    if len(rest) > 1:
        raise ValueError(f"shares are drawn along one dimension, got {', '.join(rest)}: select")
    alone = ax is None
    ax = ax or axes.new()
    values = np.atleast_2d(share.transpose(*rest, "component").values)
    x = np.arange(values.shape[0])
    bottom = np.zeros(x.size)
    styles = _component_styles(share["component"].values.astype(str).tolist())
    for k, (label, style) in enumerate(styles.items()):
        height = np.nan_to_num(values[:, k])
        ax.bar(x, height, 0.82, bottom, label=label, edgecolor="white", lw=0.8, **style)
        bottom += height
    for at in x[np.isnan(values).any(axis=1)]:
        ax.annotate("no variance", (at, 0.02), ha="center", rotation=90, color="0.4")
    if rest:
        axis = shares[rest[0]]
        if axis.dtype.kind == "f":
            scale, _ = display_unit(axis)
            ax.set_xticks(x, [f"{level / scale:.2g}" for level in axis.values])
            axes.label(ax, axis_name(axis, rest[0]))
        else:
            ax.set_xticks(x, axis.values.astype(str))
    else:
        ax.set_xticks([])
        ax.set_xlim(-0.7, 0.7)
    ax.set_ylim(0.0, 1.0)
    axes.shares(ax.yaxis)
    if alone:
        ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), reverse=True)
    return axes.label(ax, y="share of the variance", along="y")


def _component_styles(components: list[str]) -> dict[str, dict[str, Any]]:
    """Return a colour for each main effect; interactions are grey and hatched by their number of factors."""
    greys = iter(np.linspace(0.45, 0.85, max(1, sum("×" in component for component in components))))
    styles: dict[str, dict[str, Any]] = {}
    for component in components:
        parts = component.split(" × ")
        style = {"color": axes.colour(len(styles))}
        if len(parts) > 1:
            style = {"color": f"{next(greys):.3f}", "hatch": HATCHES[min(len(parts) - 1, 2)]}
        styles[" × ".join(map(input_name, parts))] = style
    return styles


@axes.style()
def uncertainty_figure(results: xr.Dataset) -> Figure:
    """Return the figure of an uncertainty study: of each block all laws' curves, and the sources of variance."""
    blocks, laws = selection.labels(results, "block"), selection.laws(results)
    figure, panels, _ = axes.panel_grid(2 * len(blocks), 2.8, 0.9, 2 if axes.has_room() else 1)
    for k, block in enumerate(blocks):
        curves, bars = panels[2 * k : 2 * k + 2]
        uncertainty(results, curves, block=block or None)
        axes.name(curves, block_title(block))
        uncertainty(results, bars, block=block or None, view="variance")
    ends = results["quantile"].values
    share = percent(round(float(ends[-1] - ends[0]), 9))
    axes.heading(
        figure,
        f"Probability of {results.attrs.get('state', 'overturning')} with uncertain inputs",
        f"{results.sizes['sample']} samples under {selection.motions(results)}",
        f"bands: {share} of the samples' own probabilities",
        legend=panels[:2] if len(laws) > 1 else panels[1:2],
    )
    return figure


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
        The method; needed if a study's results have several.
    level : float, optional
        One of a study's levels (SI); by default the level with a probability of overturning nearest to one half.
    """
    draw = {"sobol": sobol_bars, "tornado": tornado_bars}
    held = [name for name, variable in OWN.items() if f"{name}_{variable}" in results]
    plain = [name for name, variable in OWN.items() if variable in results]
    if not held and not plain:
        raise ValueError("a figure of indices needs Sobol' indices or a tornado, got none")
    if method is not None:
        checks.choice("method", method, held or plain)
    elif len(held) > 1:
        raise ValueError(f"results hold indices of several methods, say which: {', '.join(held)}")
    name = method or (held or plain)[0]
    if not held:
        return draw[name](selection.single(results, block=block, model=model), ax)
    of_block = selection.single(results, block=block, model=model)
    at = middle_level(of_block["probability"]) if level is None else level_index(of_block, level)
    names_of = {
        str(key): str(key).removeprefix(f"{name}_") for key in of_block.data_vars if str(key).startswith(f"{name}_")
    }
    ax = draw[name](of_block[list(names_of)].rename(names_of).isel(output=at), ax)
    scale, unit = display_unit(of_block["level"])
    axes.name(ax, f"Probability of overturning at {float(of_block['level'][at]) / scale:.3g} {unit}".strip())
    return ax


def _reach(shown: xr.Dataset, name: str) -> tuple[Array, Array] | None:
    """Return the extent of the interval of an index below and above it; None without an interval."""
    value = shown[name].values
    if f"{name}_lower" not in shown:
        return None
    lower, upper = (shown[f"{name}{end}"].values for end in ("_lower", "_upper"))
    return np.maximum(value - lower, 0.0), np.maximum(upper - value, 0.0)


@axes.style()
def sobol_bars(indices_of: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw first- and total-order Sobol' indices of one output with their intervals, the largest total on top."""
    ordered = _one_output(indices_of, "total")
    ordered = ordered.isel(input=np.argsort(-np.nan_to_num(ordered["total"].values), kind="stable"))
    y = np.arange(ordered.sizes["input"])
    alone = ax is None
    ax = ax or axes.new(0.5 * y.size + 1.3)
    error = {"ecolor": "0.25", "elinewidth": 1.1, "capsize": 2.5}
    for name, shift, label in (("total", 0.19, "total: with all others"), ("first", -0.19, "first order: alone")):
        colour = axes.GREY if name == "total" else axes.COLOURS[0]
        ax.barh(
            y + shift, ordered[name].values, 0.36, color=colour, label=label, xerr=_reach(ordered, name), error_kw=error
        )
    ax.axvline(0.0, color="0.25", lw=0.8)
    return _with_inputs(ax, ordered, "share of the variance", alone)


@axes.style()
def tornado_bars(swings: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw one output with one input at a time at its low and its high quantile, the widest on top."""
    ordered = _one_output(swings, "swing")
    ordered = ordered.isel(input=np.argsort(-ordered["swing"].values, kind="stable"))
    y = np.arange(ordered.sizes["input"])
    alone = ax is None
    ax = ax or axes.new(0.42 * y.size + 1.6)
    first, last = (percent(float(quantile)) for quantile in swings.attrs["quantiles"])
    ax.axvline(ordered["base"].item(), color="0.25", lw=0.9, zorder=0)
    # only the ends are drawn, not bars from the base: both ends may lie on one side, where one bar would hide the other
    ax.hlines(y, ordered["low"].values, ordered["high"].values, color=axes.GREY, lw=5.0, zorder=1)
    for i, name, label in (
        (0, "low", f"input at its {first} quantile, or its smallest choice"),
        (1, "high", f"input at its {last} quantile, or its largest choice"),
    ):
        ax.plot(ordered[name].values, y, axes.MARKERS[i], ms=8.0, color=axes.colour(i), label=label, zorder=2)
    return _with_inputs(ax, ordered, "value", alone)


def _with_inputs(ax: Axes, shown: xr.Dataset, text: str, alone: bool) -> Axes:
    """Name the rows after the inputs, and the axes after the output; axes of their own get a legend above them."""
    axes.named_rows(ax, [input_name(str(key)) for key in shown["input"].values], 0.6)
    output = str(shown["output"].item()) if "output" in shown.coords else ""
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
