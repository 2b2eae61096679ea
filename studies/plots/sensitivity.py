"""Figures of a sensitivity study: quantities over delta or e, and uncertain inputs."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...core import checks
from ...core.aliases import Array
from ...core.units import ENDS
from ...core.wording import confidence_text, counted
from ..buildings.variables import level_index
from ..file.uncertainty import RIGID
from ..tables.sensitivity import level_at, level_between, reference_name, reference_of
from ..text.words import block_title, display_unit, input_name, level_name
from . import axes, selection

SCALED = ("median", "median_ratio", "dispersion")
"""Quantities on logarithmic axes."""
ROOM = 1.6
"""Factor by which a logarithmic axis extends beyond its lines."""
QUANTITIES = {
    "median": ("Medians", "median {measure}"),
    "median_ratio": ("Medians relative to the reference", "median relative to {reference}"),
    "dispersion": ("Dispersions", "dispersion β"),
    "probability": ("Probability of overturning", "probability of overturning at {level}"),
    "excess": ("Change in the probability", "change in the probability from {reference} at {level}"),
    "flipped": ("Changed outcomes", "outcomes changed from {reference} at {level}"),
}
"""Title and axis of each quantity."""


def _tornado(ax: Axes, y: Array, law: selection.DrawnLaw) -> None:
    """Draw the probability of overturning with one input at a time at its low (open) and high (full) quantile."""
    low, high = law.results["tornado_low"].values, law.results["tornado_high"].values
    ax.hlines(y, low, high, color=law.colour, lw=3.0)
    ax.plot(low, y, law.marker, color=law.colour, ms=5.0, mfc="white", mew=1.3)
    ax.plot(high, y, law.marker, color=law.colour, ms=5.0, label=law.label)
    ax.set_xlim(-0.03, 1.03)
    axes.shares(ax.xaxis)


def _sobol(ax: Axes, y: Array, law: selection.DrawnLaw) -> None:
    """Draw total Sobol' indices of the probability of overturning with their intervals."""
    total, lower, upper = (law.results[f"sobol_total{end}"].values for end in ENDS)
    ends = [total - lower, upper - total]
    ax.errorbar(total, y, xerr=ends, fmt=law.marker, color=law.colour, ms=5.0, lw=1.2, label=law.label)


PANELS = {
    "tornado_low": (_tornado, "probability of overturning"),
    "sobol_total": (_sobol, "total Sobol' index of the probability"),
}


def input_panel(results: xr.Dataset, ax: Axes | None = None, *, needed: str, block: str | None = None) -> Axes:
    """Draw the effect of each input on the probability of overturning, the laws of a block below each other."""
    if needed not in results:
        raise ValueError(f"results hold no {needed}: the study asked for none (sensitivity.inputs, sensitivity.sobol)")
    of_block = selection.single(results, block=block)
    ax = ax or axes.new()
    draw, text = PANELS[needed]
    laws = selection.laws(of_block)
    shifts = np.linspace(-0.3, 0.3, len(laws)) if len(laws) > 1 else np.zeros(1)
    axes.named_rows(ax, [input_name(str(name)) for name in of_block["input"].values])
    for shift, law in zip(shifts, laws, strict=True):
        draw(ax, shift + np.arange(of_block.sizes["input"]), law)
    axes.name(ax, block_title(str(of_block["block"].item())))
    return axes.label(ax, text, along="x")


@axes.drawing
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

    Values of e at which an impact needs more friction than there is are shaded.  The axes are scaled to the lines, so
    that bands may extend beyond the frame.

    Parameters
    ----------
    results : xarray.Dataset
        Results of a sensitivity study.
    quantity : {"median", "median_ratio", "dispersion", "probability", "excess", "flipped"}
        The quantity; differences are from the study's reference.
    level : float, optional
        One of the study's levels (SI), for quantities that depend on the level. By default it is the level at which the
        rigid block is nearest to falling under half of the motions.
    """
    if "parameter" not in results.attrs or "comparison" not in results.dims:
        raise ValueError("results must be of a sensitivity study, which have a parameter and comparisons, got others")
    checks.choice("quantity", quantity, tuple(QUANTITIES))
    of_block = selection.single(results, block=block)
    at = level_between(of_block) if level is None else level_index(of_block, level)
    drawn = of_block.isel(level=at) if "level" in of_block[quantity].dims else of_block
    if "comparison" in of_block[quantity].dims:
        drawn = drawn.sel(comparison=reference_of(results))
    scale, unit = display_unit(results["level"]) if quantity == "median" else (1.0, "")
    ends = ("lower", "upper") if quantity == "probability" else (f"{quantity}_lower", f"{quantity}_upper")
    alone = ax is None
    ax = ax or axes.new()
    x = results["value"].values
    for law in selection.laws(drawn, model, color):
        y = _finite_or_nan(law.results[quantity].values / scale)
        if ends[0] in law.results and ends[1] in law.results:
            low, high = (_finite_or_nan(law.results[end].values / scale) for end in ends)
            ax.fill_between(x, low, high, where=list(np.isfinite(y)), color=law.colour, alpha=0.15, lw=0.0)
        ax.plot(x, y, marker=law.marker, ls=law.line, color=law.colour, label=law.label, ms=4.5, mew=0.0, lw=1.6)
    reference = axes.model_name(reference_name(results))
    _rigid_line(drawn, quantity, ax, scale, reference)
    x_axis(results, ax)
    shade_friction(of_block, ax)
    if quantity not in SCALED:
        axes.shares(ax.yaxis)
    else:
        # (an interval that the levels leave open must not compress all lines)
        lines = np.concatenate([np.asarray(line.get_ydata(), dtype=float) for line in ax.lines])
        if np.isfinite(lines).any():
            ax.set_ylim(np.nanmin(lines) / ROOM, np.nanmax(lines) * ROOM)
            ax.set_yscale("log")
            axes.plain_log_y(ax)
        else:
            ax.annotate("no curve", (0.03, 0.5), xycoords="axes fraction", va="center", color="0.4")
    measure = f"{level_name(results)}{f' ({unit})' if unit else ''}"
    text = QUANTITIES[quantity][1].format(reference=reference, level=level_at(results, at), measure=measure)
    axes.label(ax, y=text)
    axes.name(ax, block_title(str(of_block["block"].item())))
    if alone:
        axes.own_legend(ax)
    return ax


def figures(results: xr.Dataset) -> Iterator[tuple[str, Figure]]:
    """Yield every figure of a study's results with its name."""
    intervals = f"{confidence_text(results)} intervals"
    for quantity in ("median", "median_ratio", "dispersion", "probability", "flipped"):
        notes = counted(results.sizes["motion"], "motion"), f"bands: {intervals}"
        yield quantity, column(results, partial(sensitivity, quantity=quantity), QUANTITIES[quantity][0], *notes)
    for needed, title, note in (
        ("tornado_low", "One input at a time", "open: 5 % quantile, full: 95 %"),
        ("sobol_total", "All inputs at once", f"bars: {intervals}"),
    ):
        if needed in results:
            yield needed.partition("_")[0], column(results, partial(input_panel, needed=needed), title, note)


@axes.style()
def column(results: xr.Dataset, draw: Callable[..., Axes], title: str, *notes: str) -> Figure:
    """Return a figure as wide as a column with a panel for each block, one below the other, drawn by `draw`."""
    with axes.on_a_phone(), axes.style():
        blocks = selection.labels(results, "block")
        figure, panels, _ = axes.panel_grid(len(blocks), 2.4, 0.5 + 0.19 * results.sizes["model"])
        for ax, block in zip(panels, blocks, strict=True):
            draw(results, ax, block=block)
        axes.heading(figure, title, *notes, legend=panels[:1])
    return figure


def _rigid_line(drawn: xr.Dataset, quantity: str, ax: Axes, scale: float, reference: str) -> None:
    """Draw the rigid block's value of the quantity; its median follows from the laws' medians and median ratios."""
    x = drawn["value"].values
    colour, _, line = axes.REFERENCE
    if quantity == "median":
        ratio = drawn["median_ratio"].sel(comparison=RIGID)
        values = _finite_or_nan((drawn["median"] / ratio).transpose("model", "value").values)
        y = np.full(values.shape[1], np.nan)
        known = np.isfinite(values).any(axis=0)
        y[known] = np.nanmedian(values[:, known], axis=0) / scale
    elif quantity == "probability":
        y = (drawn["probability"] - drawn["excess"].sel(comparison=RIGID)).transpose("model", "value").values[0]
    elif quantity in ("median_ratio", "excess"):
        y = np.full(x.size, 0.0 if quantity == "excess" else 1.0)
    else:
        return
    # (quantities that may refer to another reference)
    text = reference.removeprefix("the ") if quantity in ("median_ratio", "excess") else "rigid block"
    ax.plot(x, y, color=colour, lw=1.3, ls=line, zorder=1, label=text)


def x_axis(results: xr.Dataset, ax: Axes) -> None:
    """Draw the axis of the varied parameter, logarithmic for delta."""
    x = results["value"].values
    if results.attrs["parameter"] == "delta":
        axes.level_axis(ax, x[0] / 1.15, x[-1] * 1.15, True, "half width of the elastic zone, δ")
        return
    margin = 0.02 * (x[-1] - x[0])
    ax.set_xlim(x[0] - margin, x[-1] + margin)
    axes.label(ax, "coefficient of restitution, e")


def shade_friction(of_block: xr.Dataset, ax: Axes) -> None:
    """Shade the values of e at which an impact needs more friction than there is."""
    if of_block.attrs["parameter"] != "e" or bool(of_block["in_use"].all()):
        return
    # the friction needed equals the friction available: (h/b)(1 - e)/(1 + e) = friction
    ratio, limit = float(1.0 / np.tan(of_block["alpha"].item())), float(of_block.attrs["friction"])
    end = (ratio - limit) / (ratio + limit)
    ax.axvspan(ax.get_xlim()[0], end, color="0.88", zorder=0, lw=0.0, label=f"needs friction above {limit:g}")


def _finite_or_nan(values: Any) -> Array:
    numbers = np.asarray(values, dtype=float)
    return np.where(np.isfinite(numbers), numbers, np.nan)
