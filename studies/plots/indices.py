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
from ..text.words import display_unit, input_name
from . import axes, selection

OWN = {"sobol": "total", "tornado": "swing"}
"""For each method a variable that only its results have."""


def indices(
    results: xr.Dataset,
    ax: Axes | None = None,
    *,
    method: str | None = None,
    block: str | None = None,
    model: str | None = None,
    level: float | None = None,
) -> Axes:
    """Draw how much each uncertain input matters: Sobol' indices or a tornado.

    Parameters
    ----------
    results : xarray.Dataset
        An uncertainty study's results, or the dataset that `sobol_indices` or `tornado` of
        `toppling.fragility` returns, of one output (``isel(output=0)``).
    method : {"sobol", "tornado"}, optional
        The method; needed where a study's results hold several.
    ax, block, model : optional
        As for `fragility`, but a law is needed where there are several.
    level : float, optional
        For a study: one of its levels (SI); by default the level at which the probability of overturning is nearest to
        one half.

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    ValueError
        No such indices; several methods, blocks, laws or outputs, and none given; no such label, no such level.
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
    own = [str(one) for one in here.data_vars if str(one).startswith(f"{name}_")]
    ax = draw[name](here[own].rename({one: one.removeprefix(f"{name}_") for one in own}).isel(output=at), ax)
    scale, unit = display_unit(here["level"])
    said = f"{float(here['level'][at]) / scale:.3g} {unit}".strip()
    ax.set_title(f"probability of overturning at {said}", fontsize=10)
    return ax


def _reach(here: xr.Dataset, name: str) -> tuple[Array, Array] | None:
    """Return how far the interval of an index extends below and above it; None where there is no interval."""
    value = here[name].values
    if f"{name}_lower" not in here:
        return None
    lower, upper = (here[f"{name}{end}"].values for end in ("_lower", "_upper"))
    return np.maximum(value - lower, 0.0), np.maximum(upper - value, 0.0)


def sobol_bars(found: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw first- and total-order Sobol' indices of one output with their intervals, the largest total on top."""
    here = _one_output(found, "total")
    order = np.argsort(-np.nan_to_num(here["total"].values), kind="stable")
    here = here.isel(input=order)
    y = np.arange(order.size)
    alone = ax is None
    ax = ax or axes.new(6.0, 0.55 * y.size + 1.5)
    for name, shift, colour, label in (
        ("total", 0.19, axes.COLOURS[5], "total: with all others"),
        ("first", -0.19, axes.COLOURS[0], "first order: alone"),
    ):
        error = {"ecolor": "0.25", "elinewidth": 1.1, "capsize": 2.5}
        ax.barh(y + shift, here[name].values, 0.36, color=colour, label=label, xerr=_reach(here, name), error_kw=error)
    ax.axvline(0.0, color="0.25", lw=0.8)
    axes.named_rows(ax, [input_name(str(one)) for one in here["input"].values])
    ax.set_xlabel("share of the variance")
    if "output" in here.coords:
        ax.set_title(str(here["output"].item()), fontsize=10)
    if alone:
        handles, labels = ax.get_legend_handles_labels()
        ax.legend(
            handles[::-1], labels[::-1], frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.08), fontsize=9
        )
    return ax


def tornado_bars(found: xr.Dataset, ax: Axes | None = None) -> Axes:
    """Draw one output with one input at a time at its low and its high quantile, the widest on top."""
    here = _one_output(found, "swing")
    here = here.isel(input=np.argsort(-here["swing"].values, kind="stable"))
    y = np.arange(here.sizes["input"])
    alone = ax is None
    ax = ax or axes.new(6.0, 0.42 * y.size + 1.6)
    base = here["base"].item()
    first, last = (percent(float(one)) for one in found.attrs["quantiles"])
    ax.axvline(base, color="0.25", lw=0.9, zorder=0)
    # only the ends are drawn, not bars from the base: both ends may lie on one side, where one bar would hide the other
    ax.hlines(y, here["low"].values, here["high"].values, color="0.75", lw=5.0, zorder=1)
    for name, colour, marker, label in (
        ("low", axes.COLOURS[0], "o", f"input at its {first} quantile, or its least choice"),
        ("high", axes.COLOURS[1], "s", f"input at its {last} quantile, or its greatest choice"),
    ):
        ax.plot(here[name].values, y, marker, ms=8.0, color=colour, label=label, zorder=2)
    axes.named_rows(ax, [input_name(str(one)) for one in here["input"].values])
    ax.set_xlabel(str(here["output"].item()) if "output" in here.coords else "value")
    if alone:
        ax.legend(frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), fontsize=9)
    return ax


def _one_output(indices: xr.Dataset, name: str) -> xr.Dataset:
    if indices[name].dims != ("input",):
        raise ValueError(f"one output is drawn, got {dict(indices[name].sizes)}: select it")
    return indices


def index_figure(results: xr.Dataset) -> Figure:
    """Return the figure of Sobol' indices where P(overturn) is nearest to one half: a panel for each block and law."""
    blocks, models = selection.labels(results, "block"), selection.labels(results, "model")
    cases = [(block, model) for block in blocks for model in models]
    each = 2.7, 0.5 * results.sizes["input"] + 1.3
    figure, panels, columns = axes.panel_grid(len(cases), each, (0.4, 1.2), 6.0, axes.columns_for(len(models)))
    for ax, (block, model) in zip(panels, cases, strict=True):
        indices(results, ax, method="sobol", block=block or None, model=model or None)
        width = 0.72 * figure.get_figwidth() / columns
        at = ax.get_title().rpartition(" at ")[2]
        ax.set_title(axes.wrapped(f"{block}\n{axes.model_name(model)}\nat {at}", width, 9.0), fontsize=9)
        ax.set_xlabel(axes.wrapped(ax.get_xlabel(), width))
    axes.legend_below(figure, *panels[0].get_legend_handles_labels())
    text = "Sobol' indices of the probability of overturning, with intervals, where it is nearest to one half"
    axes.heading(figure, str(results.attrs.get("title", "Indices")), text)
    return figure
