"""Figures of a sensitivity study: quantities over delta or e, and uncertain inputs."""

from __future__ import annotations

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
from ...core.aliases import Array
from ...core.wording import confidence_text
from ..buildings.variables import level_index
from ..file.uncertainty import RIGID
from ..tables.sensitivity import level_at, level_between, reference_name, reference_of
from ..text.curve_notes import FEW_HELD, few_motions
from ..text.words import display_unit, input_name, level_name
from . import axes, selection

WIDTH, HEIGHT = 5.2, 3.4
TEXT = 11.0
"""Size of figures (in) and of their text (pt): on a screen 380 pixels wide the text is 8 pt."""


def tornado_panel(results: xr.Dataset, ax: Axes | None = None, *, block: str | None = None) -> Axes:
    """Draw P(overturn) with one input at a time at its 5 % and 95 % quantiles, the laws of a block below each other."""
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
    """Draw total Sobol' indices of P(overturn) with their intervals, the laws of a block below each other."""
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
    ax = ax or axes.new(WIDTH, HEIGHT)
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
    laws = results.sizes["model"]
    shift = np.linspace(-0.3, 0.3, laws) if laws > 1 else np.zeros(1)
    return np.asarray(shift[:, None] + np.arange(results.sizes["input"])[None])


SCALED = ("median", "median_ratio", "dispersion")
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
    quantity : {"median", "median_ratio", "dispersion", "probability", "excess", "flipped"}
        The quantity; differences are from the study's reference.
    level : float, optional
        One of the study's levels (SI), for quantities that depend on the level; by default the level at which the rigid
        block is nearest to falling under half of the motions.
    ax, block, model, color : optional
        As for `fragility`.

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
    at = level_between(here) if level is None else level_index(here, level)
    drawn = here.isel(level=at) if "level" in here[quantity].dims else here
    if "comparison" in here[quantity].dims:
        drawn = drawn.sel(comparison=reference_of(results))
    scale, unit = display_unit(results["level"]) if quantity == "median" else (1.0, "")
    ends = ("lower", "upper") if quantity == "probability" else (f"{quantity}_lower", f"{quantity}_upper")
    laws = selection.laws(drawn, model, color)
    alone = ax is None
    ax = ax or axes.new(WIDTH, HEIGHT)
    x = results["value"].values
    for law in laws:
        one = law.results
        y = _finite_or_nan(one[quantity].values / scale)
        if ends[0] in one and ends[1] in one:
            low, high = (_finite_or_nan(one[end].values / scale) for end in ends)
            ax.fill_between(x, low, high, where=list(np.isfinite(y)), color=law.colour, alpha=0.15, lw=0.0)
        ax.plot(x, y, **line_style(law))
    named = axes.model_name(reference_name(results))
    _rigid_line(drawn, quantity, ax, scale, named)
    x_axis(results, ax)
    shade_friction(here, ax)
    if quantity not in SCALED:
        ax.yaxis.set_major_formatter(PercentFormatter(1.0))
    else:
        # (an interval that the levels leave open must not compress all lines)
        lines = np.concatenate([np.asarray(line.get_ydata(), dtype=float) for line in ax.lines])
        if np.isfinite(lines).any():
            ax.set_ylim(np.nanmin(lines) / ROOM, np.nanmax(lines) * ROOM)
            ax.set_yscale("log")
            axes.plain_log_y(ax)
        else:
            ax.annotate("no curve", (0.03, 0.5), xycoords="axes fraction", va="center", color="0.4")
    words = QUANTITIES[quantity].format(reference=named, level=level_at(results, at))
    if quantity == "median":
        words = f"median {level_name(results)}{f' ({unit})' if unit else ''}"
    ax.set_ylabel(words)
    ax.set_title(str(here["block"].item()), fontsize=TEXT)
    if alone:
        axes.own_legend(ax)
    return ax


def figures(results: xr.Dataset) -> Iterator[tuple[str, Figure]]:
    """Yield every figure of a study's results with its name."""
    for quantity in ("median", "median_ratio", "dispersion", "probability", "flipped"):
        said = f"{results.sizes['motion']} motions; bands: {confidence_text(results)} intervals"
        if quantity == "median_ratio" and few_motions(results):
            said += f", of which {FEW_HELD['ratio']}"
        yield quantity, column(results, partial(sensitivity, quantity=quantity), said)
    for needed, name, draw, said in (
        ("tornado_low", "tornado", tornado_panel, "one input at a time, 5 % to 95 %"),
        ("sobol_total", "sobol", sobol_panel, f"all inputs at once; bars: {confidence_text(results)} intervals"),
    ):
        if needed in results:
            yield name, column(results, draw, said)


def column(results: xr.Dataset, draw: Callable[..., Axes], said: str) -> Figure:
    """Return a figure with a panel for each block, one below the other, drawn by `draw`."""
    blocks = selection.labels(results, "block")
    with mpl.rc_context({"font.size": TEXT}):
        laws = results.sizes["model"]
        figure = axes.figure(WIDTH, 2.9 * len(blocks) + 0.22 * laws + 0.6)
        panels = figure.subplots(len(blocks), 1, squeeze=False)[:, 0]
        for ax, block in zip(panels, blocks, strict=True):
            draw(results, ax, block=block)
        figure.suptitle(f"{results.attrs.get('title', '')}\n{said}", fontsize=TEXT)
        legend(figure, panels[0], 1)
    return figure


def legend(figure: Figure, ax: Axes, columns: int) -> None:
    """Draw the legend of a panel below all panels of a figure."""
    handles, labels = ax.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=columns, frameon=False, fontsize=TEXT - 0.5)


def line_style(law: selection.DrawnLaw) -> dict[str, Any]:
    """Return matplotlib's properties of a law's line."""
    look = {"color": law.colour, "ls": law.line, "marker": law.marker, "label": law.label}
    return {**look, "ms": 4.5, "mew": 0.0, "lw": 1.6}


def _rigid_line(drawn: xr.Dataset, quantity: str, ax: Axes, scale: float, reference: str) -> None:
    """Draw the rigid block's value of the quantity; its median follows from the laws' medians and median ratios."""
    x = drawn["value"].values
    colour, _, line = axes.REFERENCE
    if quantity == "median":
        ratio = drawn["median_ratio"].sel(comparison=RIGID)
        values = _finite_or_nan((drawn["median"] / ratio).transpose("model", "value").values)
        found = np.full(values.shape[1], np.nan)
        known = np.isfinite(values).any(axis=0)
        found[known] = np.nanmedian(values[:, known], axis=0)
        y = found / scale
    elif quantity == "probability":
        y = (drawn["probability"] - drawn["excess"].sel(comparison=RIGID)).transpose("model", "value").values[0]
    elif quantity in ("median_ratio", "excess"):
        y = np.full(x.size, 0.0 if quantity == "excess" else 1.0)
    else:
        return
    # (quantities that may refer to another reference)
    words = reference.removeprefix("the ") if quantity in ("median_ratio", "excess") else "rigid block"
    ax.plot(x, y, color=colour, lw=1.3, ls=line, zorder=1, label=words)


def x_axis(results: xr.Dataset, ax: Axes) -> None:
    """Draw the axis of the varied parameter, logarithmic for delta."""
    x = results["value"].values
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


def shade_friction(here: xr.Dataset, ax: Axes) -> None:
    """Shade the values of e at which an impact needs more friction than there is."""
    if here.attrs["parameter"] != "e" or bool(here["in_use"].all()):
        return
    # the friction needed equals the friction available: (h/b)(1 - e)/(1 + e) = friction
    ratio, limit = float(1.0 / np.tan(here["alpha"].item())), float(here.attrs["friction"])
    end = (ratio - limit) / (ratio + limit)
    left = ax.get_xlim()[0]
    ax.axvspan(left, end, color="0.88", zorder=0, lw=0.0, label=f"needs friction above {limit:g}")


def _finite_or_nan(values: Any) -> Array:
    found = np.asarray(values, dtype=float)
    return np.where(np.isfinite(found), found, np.nan)
