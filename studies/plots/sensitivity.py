"""Figures of a sensitivity study: quantities over delta or e, free rocking, convergence, and uncertain inputs.

The panels of a figure stand in one column, so that a telephone can show them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from ...core import checks
from ...core.aliases import Array, Index
from ...core.wording import confidence_text
from ..file.uncertainty import RIGID
from ..tables.sensitivity import GREEK, level_at, level_between, reference_name, reference_of
from ..text.words import display_unit, input_name, level_name
from . import axes, selection

WIDTH, HEIGHT = 5.2, 3.4
TEXT = 11.0
"""Size of figures (in) and of their text (pt): on a screen 380 pixels wide the text is 8 pt."""


def tornado_panel(results: xr.Dataset, ax: Axes | None = None, *, block: str | None = None) -> Axes:
    """Draw P(overturn) with one input at a time at its 5 % and 95 % quantiles, the laws of a block below each other.

    The arguments are as for `sensitivity`.
    """
    here, ax = _panel(results, "tornado_low", ax, block)
    for y, law in zip(_lanes(here), selection.laws(here), strict=True):
        low, high = law.results["tornado_low"].values, law.results["tornado_high"].values
        ax.hlines(y, low, high, color=law.colour, lw=3.0)
        ax.plot(low, y, "o", color=law.colour, ms=5.0, mfc="white", mew=1.3)
        ax.plot(high, y, "o", color=law.colour, ms=5.0, label=law.label)
    ax.set_xlim(-0.03, 1.03)
    ax.xaxis.set_major_formatter(PercentFormatter(1.0))
    ax.set_xlabel(axes.wrapped("P(overturn), input low (open) and high (full)", axes.width_of(ax)))
    return ax


def sobol_panel(results: xr.Dataset, ax: Axes | None = None, *, block: str | None = None) -> Axes:
    """Draw total Sobol' indices of P(overturn) with their intervals, the laws of a block below each other.

    The arguments are as for `sensitivity`.
    """
    here, ax = _panel(results, "sobol_total", ax, block)
    for y, law in zip(_lanes(here), selection.laws(here), strict=True):
        total, lower, upper = (law.results[f"sobol_total{end}"].values for end in ("", "_lower", "_upper"))
        ends = [total - lower, upper - total]
        ax.errorbar(total, y, xerr=ends, fmt=law.marker, color=law.colour, ms=5.0, lw=1.2, label=law.label)
    ax.axvline(0.0, color="0.4", lw=0.8)
    ax.set_xlabel("total Sobol' index of P(overturn)")
    return ax


def _panel(results: xr.Dataset, needed: str, ax: Axes | None, block: str | None) -> tuple[xr.Dataset, Axes]:
    """Return the results of one block, and axes with a row for each input."""
    if needed not in results:
        raise ValueError(f"results hold no {needed}: the study asked for none (sensitivity.inputs, sensitivity.sobol)")
    here = selection.one(results, block=block)
    if ax is None:
        ax = axes.new(WIDTH, HEIGHT)
    names = [input_name(str(one)) for one in here["input"].values]
    ax.set_yticks(range(len(names)), names)
    ax.set_ylim(len(names) - 0.5, -0.5)
    for i in range(1, len(names)):
        ax.axhline(i - 0.5, color="0.85", lw=0.8, zorder=0)
    axes.grid(ax, "x")
    ax.set_title(str(here["block"].item()), fontsize=TEXT)
    return here, ax


def _lanes(results: xr.Dataset) -> Array:
    """Return the vertical position of each law at each input, shape (model, input)."""
    laws, inputs = results.sizes["model"], results.sizes["input"]
    shift = np.linspace(-0.3, 0.3, laws) if laws > 1 else np.zeros(1)
    return np.asarray(shift[:, None] + np.arange(inputs)[None])


EQUAL = 1e-9
"""A distance from the rigid block up to which the difference is only rounding."""
SHOWN = 5
"""Number of values of the parameter for which free rocking is shown."""
SCALED = ("median", "median_ratio", "dispersion", "decay_error")
"""Quantities on logarithmic axes."""
ROOM = 1.6
"""Factor by which a logarithmic axis extends beyond its lines."""
QUANTITIES = {
    "median": "median",
    "median_ratio": "median over that of\n{reference}",
    "dispersion": "dispersion β",
    "probability": "P(overturn) at {level}",
    "excess": "P(overturn) less that\nof {reference}, {level}",
    "flipped": "outcomes that differ from\n{reference}, {level}",
    "decay_error": "peaks of free rocking\nover the rigid block's",
}


def sensitivity(
    results: xr.Dataset,
    ax: Axes | None = None,
    *,
    quantity: str = "median",
    block: str | None = None,
    model: str | None = None,
    level: float | None = None,
    color: str | None = None,
) -> Axes:
    """Draw a quantity of every law over the values of delta or e, with its interval as a band.

    Parameters
    ----------
    results : xarray.Dataset
        Results of a sensitivity study.
    ax : matplotlib Axes, optional
        Axes to draw into; by default those of a new figure with a legend.
    quantity : {"median", "median_ratio", "dispersion", "probability", "excess", "flipped", "decay_error"}
        The quantity; differences are from the study's reference.
    block, model : str, optional
        Labels of the block (needed where there are several) and of one law (all laws by default).
    level : float, optional
        One of the study's levels (SI), for quantities that depend on the level; by default the level at which the rigid
        block is nearest to falling under half of the motions.
    color : str, optional
        Matplotlib's colour for one law.

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    ValueError
        Results of another kind of study; no such quantity, block, law or level; several blocks, and no label given.

    Notes
    -----
    Values of e at which an impact needs more friction than there is are shaded.  The axes are scaled to the lines, so
    that bands may extend beyond the frame.
    """
    if "parameter" not in results.attrs or "comparison" not in results.dims:
        raise ValueError("results must be of a sensitivity study, which have a parameter and comparisons, got others")
    checks.choice("quantity", quantity, tuple(QUANTITIES))
    here = selection.one(results, block=block)
    at = level_between(here) if level is None else selection.level_index(here, level)
    drawn = here.isel(level=at) if "level" in here[quantity].dims else here
    if "comparison" in here[quantity].dims:
        drawn = drawn.sel(comparison=reference_of(results))
    scale, unit = display_unit(results["level"]) if quantity == "median" else (1.0, "")
    ends = ("lower", "upper") if quantity == "probability" else (f"{quantity}_lower", f"{quantity}_upper")
    laws = selection.laws(drawn, model, color)
    alone = ax is None
    if ax is None:
        ax = axes.new(WIDTH, HEIGHT)
    x = results["value"].values
    for law in laws:
        one = law.results
        y = _finite_or_nan(one[quantity].values / scale)
        if quantity == "decay_error":
            y = 1.0 + y
        if ends[0] in one and ends[1] in one:
            low, high = (_finite_or_nan(one[end].values / scale) for end in ends)
            ax.fill_between(x, low, high, where=list(np.isfinite(y)), color=law.colour, alpha=0.15, lw=0.0)
        ax.plot(x, y, **_line_style(law))
    named = axes.model_name(reference_name(results))
    _rigid_line(drawn, quantity, ax, scale, named)
    _x_axis(results, ax)
    _shade_friction(here, ax)
    if quantity in SCALED:
        # (an interval that the levels leave open must not compress all lines)
        lines = np.concatenate([np.asarray(line.get_ydata(), dtype=float) for line in ax.lines])
        ax.set_ylim(np.nanmin(lines) / ROOM, np.nanmax(lines) * ROOM)
    _y_axis(quantity, ax)
    words = QUANTITIES[quantity].format(reference=named, level=level_at(results, at))
    if quantity == "median":
        words = f"median {level_name(results)}{f' ({unit})' if unit else ''}"
    ax.set_ylabel(words)
    ax.set_title(str(here["block"].item()), fontsize=TEXT)
    if alone:
        axes.own_legend(ax)
    return ax


def free_rocking_panel(
    results: xr.Dataset, ax: Axes | None = None, *, block: str | None = None, model: str | None = None
) -> Axes:
    """Draw free rocking of a block under one law at some values of the parameter, from dark to bright.

    In a study of delta the rigid block's peaks are drawn as dots.  The arguments are as for `sensitivity`; the law is
    needed where there are several.
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

    The arguments are as for `sensitivity`. Distances that are only rounding (below 1e-9) lie below the frame.
    """
    if "pulse_error" not in results:
        raise ValueError("convergence is of delta: results hold no pulse_error")
    here = selection.one(results, block=block)
    if ax is None:
        ax = axes.new(WIDTH, HEIGHT)
    x = results["value"].values
    for law in selection.laws(here):
        error = law.results["pulse_error"].values
        ax.plot(x, np.where(error > 0.0, error, np.nan), **_line_style(law))
    ax.set_yscale("log")
    apart = here["pulse_error"].values[here["pulse_error"].values > EQUAL]
    if apart.size:
        ax.set_ylim(0.3 * apart.min(), 3.0 * apart.max())
        ax.plot(x, apart.min() * x / x[0], color="0.5", lw=1.0, ls=(0, (1, 2)), label="first order")
    _x_axis(results, ax)
    ax.set_ylabel("distance from the rigid\nblock's peaks, over α")
    ax.set_title(str(here["block"].item()), fontsize=TEXT)
    return ax


def sensitivity_figure(results: xr.Dataset, quantity: str) -> Figure:
    """Return the figure of a quantity over the values of the parameter: a panel for each block, one below the other."""
    said = f"{results.sizes['motion']} motions; bands: {confidence_text(results)} intervals"
    if quantity == "decay_error":
        said = f"released at {float(results.attrs['release']):g} α, mean of ten half cycles"
    return _column(results, partial(sensitivity, quantity=quantity), said)


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
        _legend(figure, panels.flat[0], 3 if axes.has_room() else 2)
    return figure


def figures(results: xr.Dataset) -> Iterator[tuple[str, Figure]]:
    """Yield every figure of a study's results with its name; free rocking has a numbered figure for each block."""
    for quantity in ("median", "median_ratio", "dispersion", "probability", "flipped", "decay_error"):
        yield quantity, sensitivity_figure(results, quantity)
    for i, block in enumerate(selection.labels(results, "block")):
        yield f"free_rocking_{i + 1}" if i else "free_rocking", free_rocking_figure(results, block)
    for needed, name, draw, said in (
        ("pulse_error", "convergence", convergence, "one-cycle sine pulses; below the frame: equal"),
        ("tornado_low", "tornado", tornado_panel, "one input at a time, 5 % to 95 %"),
        ("sobol_total", "sobol", sobol_panel, f"all inputs at once; bars: {confidence_text(results)} intervals"),
    ):
        if needed in results:
            yield name, _column(results, draw, said)


def _column(results: xr.Dataset, draw: Callable[..., Axes], said: str) -> Figure:
    """Return a figure with a panel for each block, one below the other, drawn by `draw`."""
    blocks = selection.labels(results, "block")
    with mpl.rc_context({"font.size": TEXT}):
        laws = results.sizes["model"]
        figure = axes.figure(WIDTH, 2.9 * len(blocks) + 0.22 * laws + 0.6)
        panels = figure.subplots(len(blocks), 1, squeeze=False)[:, 0]
        for ax, block in zip(panels, blocks, strict=True):
            draw(results, ax, block=block)
        title = f"{results.attrs.get('title', '')}\n{said}"
        figure.suptitle(title, fontsize=TEXT)
        _legend(figure, panels[0], 1)
    return figure


def _legend(figure: Figure, ax: Axes, columns: int) -> None:
    handles, labels = ax.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=columns, frameon=False, fontsize=TEXT - 0.5)


def _line_style(law: selection.DrawnLaw) -> dict[str, Any]:
    """Return matplotlib's properties of a law's line."""
    look = {"color": law.colour, "ls": law.line, "marker": law.marker, "label": law.label}
    return {**look, "ms": 4.5, "mew": 0.0, "lw": 1.6}


def _rigid_line(drawn: xr.Dataset, quantity: str, ax: Axes, scale: float, reference: str) -> None:
    """Draw the rigid block's value of the quantity; its median follows from the laws' medians and median ratios."""
    x = drawn["value"].values
    colour, _, line = axes.REFERENCE
    if quantity == "median":
        ratio = drawn["median_ratio"].sel(comparison=RIGID)
        y = _middle(_finite_or_nan((drawn["median"] / ratio).transpose("model", "value").values)) / scale
    elif quantity == "probability":
        y = (drawn["probability"] - drawn["excess"].sel(comparison=RIGID)).transpose("model", "value").values[0]
    elif quantity in ("median_ratio", "decay_error", "excess"):
        y = np.full(x.size, 0.0 if quantity == "excess" else 1.0)
    else:
        return
    words = "rigid block"
    if quantity in ("median_ratio", "excess"):  # (quantities that may refer to another reference)
        words = reference.removeprefix("the ")
    ax.plot(x, y, color=colour, lw=1.3, ls=line, zorder=1, label=words)


def _x_axis(results: xr.Dataset, ax: Axes) -> None:
    x = results["value"].values
    ax.set_xlim(x[0], x[-1])
    if results.attrs["parameter"] == "delta":
        ax.set_xscale("log")
        ax.set_xlim(x[0] / 1.15, x[-1] * 1.15)
        axes.plain_log(ax)
        ax.set_xlabel("half width of the elastic zone, δ")
    else:
        margin = 0.02 * (x[-1] - x[0])
        ax.set_xlim(x[0] - margin, x[-1] + margin)
        ax.set_xlabel("coefficient of restitution, e")
    axes.grid(ax)


def _y_axis(quantity: str, ax: Axes) -> None:
    if quantity in SCALED:
        ax.set_yscale("log")
        axes.plain_log_y(ax)
    elif quantity in ("probability", "flipped", "excess"):
        ax.yaxis.set_major_formatter(PercentFormatter(1.0))


def _shade_friction(here: xr.Dataset, ax: Axes) -> None:
    """Shade the values of e at which an impact needs more friction than there is."""
    if here.attrs["parameter"] != "e" or bool(here["in_use"].all()):
        return
    # the friction needed equals the friction available: (h/b)(1 - e)/(1 + e) = friction
    ratio, limit = float(1.0 / np.tan(here["alpha"].item())), float(here.attrs["friction"])
    end = (ratio - limit) / (ratio + limit)
    left = ax.get_xlim()[0]
    ax.axvspan(left, end, color="0.88", zorder=0, lw=0.0, label=f"needs friction above {limit:g}")


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


def _middle(values: Array) -> Array:
    """Return the medians over the rows of finite values; NaN of a column without any."""
    found = np.full(values.shape[1], np.nan)
    known = np.isfinite(values).any(axis=0)
    found[known] = np.nanmedian(values[:, known], axis=0)
    return found


def _finite_or_nan(values: Any) -> Array:
    found = np.asarray(values, dtype=float)
    return np.where(np.isfinite(found), found, np.nan)
