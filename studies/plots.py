"""Figures of results: axes in, axes out."""

from __future__ import annotations

import math
import textwrap
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogFormatterMathtext, LogLocator, NullFormatter, PercentFormatter
from numpy.typing import NDArray

from ..fragility import curve_probability
from .words import display_unit, floor_name

# Okabe and Ito (2008): told apart with any colour vision; black and dashed is the reference.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
MARKERS = ("o", "s", "^", "D", "v", "P")
REFERENCE = ("#000000", "X", (0, (4, 2)))
PANEL_COLUMNS = 3
MOST_PANELS = 36
"""Panels of one figure: what more there is stands in the results."""
FAR = 3.0
"""Dispersions above the median at which a curve has nothing more to show."""


def plain_log(ax: Axes) -> None:
    """Numbers as people write them on a logarithmic x-axis: a few within a decade where it holds little more."""
    low, high = ax.get_xlim()
    decades = math.log10(high / low) if 0.0 < low < high else 1.0
    subs = (1.0, 2.0, 5.0) if decades < 2.5 else (1.0,)
    ax.xaxis.set_major_locator(LogLocator(subs=subs))
    # (small numbers as powers, which do not run into each other)
    tiny = LogFormatterMathtext()

    def text(value: float, _: int | None = None) -> str:
        left, right = ax.get_xlim()
        if (value < 1e-3 or right > 100.0 * left) and not is_power(value):
            return ""
        return f"{value:,g}" if value >= 1e-3 else str(tiny(value))

    ax.xaxis.set_major_formatter(FuncFormatter(text))
    ax.xaxis.set_minor_formatter(NullFormatter())


def is_power(value: float) -> bool:
    """Whether a number is a power of ten."""
    return value > 0.0 and abs(math.log10(value) - round(math.log10(value))) < 1e-9


def in_years(rate: float) -> str:
    """A rate as the years between two events, to two or three digits."""
    if not rate > 0.0:
        return "∞"
    digits = 10.0 ** (math.floor(math.log10(1.0 / rate)) - 1)
    return f"{max(1.0 / rate, 0.1) if rate > 1.0 else round(1.0 / rate / digits) * digits:,.{int(rate > 0.1)}f}"


def axis_of(results: xr.Dataset) -> xr.DataArray:
    """The measure that curves are drawn against: the levels, or in a cloud every motion's own intensity."""
    return results["level"] if "level" in results.coords else results["intensity"]


def styles(results: xr.Dataset) -> list[tuple[str, str, Any]]:
    """Colour, marker and line style of each model: the first Housner black and dashed, the others in order."""
    chosen: list[tuple[str, str, Any]] = []
    laws = results["law"]
    # (an uncertain law is another in every sample: then there is no reference among the models)
    along = laws.isel({dim: 0 for dim in laws.dims if dim != "model"}).values if "model" in laws.dims else [""]
    for law in along:
        if law == "housner" and REFERENCE not in chosen:
            chosen.append(REFERENCE)
            continue
        i = sum(style != REFERENCE for style in chosen)
        line = ("solid", "dotted", "dashdot")[i // len(COLOURS) % 3]
        chosen.append((COLOURS[i % len(COLOURS)], MARKERS[i % len(MARKERS)], line))
    return chosen


def model_name(label: str) -> str:
    """A law's label with the field's subscript."""
    return label.replace("e_R", "$e_R$")


def fragility(results: xr.Dataset, block: str, ax: Axes | None = None, floor: int | str | None = None) -> Axes:
    """Fragility curves of one block under every law: fitted lines, observed fractions with their intervals.

    Parameters
    ----------
    results : xarray.Dataset
        A study's results: probability, lower, upper, median and dispersion.
    block : str
        Label of the block.
    ax : matplotlib Axes, optional
        Where to draw; new axes where not given.
    floor : int or str, optional
        Which floor, where the results are of several.

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    ValueError
        Results of several floors, and none is said.
    """
    here = results.sel(block=block)
    if "floor" in results.dims:
        if floor is None:
            raise ValueError(f"results are of several floors, say which: {', '.join(map(str, _floors(results)))}")
        here = here.sel(floor=floor)
    if ax is None:
        ax = plt.figure(figsize=(6.0, 4.2), layout="constrained").add_subplot()
    axis = axis_of(results)
    scale, unit = display_unit(axis)
    shown = _points if "probability" in results and "level" in results.coords else _verdicts
    end = shown(results, here, ax, scale)
    x = np.linspace(0.0, end, 400)[1:]
    for i, (colour, marker, line) in enumerate(styles(results)):
        one = here.isel(model=i)
        drawn = _curve(one, x * scale)
        if drawn is not None:
            ax.plot(x, drawn, color=colour, lw=1.8, ls=line)
        label = model_name(str(one["model"].item()))
        ax.plot(
            [],
            [],
            color=colour,
            marker=marker,
            ms=5.0,
            mew=0.0,
            lw=1.8,
            ls="none" if drawn is None else line,
            label=label,
        )
    ax.set_xlim(0.0, end)
    ax.set_ylim(-0.02, 1.02)
    ax.yaxis.set_major_formatter(PercentFormatter(1.0))
    ax.set_xlabel(f"{axis.attrs.get('long_name', 'level')}{f' ({unit})' if unit else ''}")
    ax.set_ylabel(f"probability of {results.attrs.get('state', 'overturning')}")
    ax.grid(alpha=0.25, lw=0.6)
    ax.spines[["top", "right"]].set_visible(False)
    where = "" if floor is None else f", {floor_name(floor)}"
    ax.set_title(f"{block}{where}\n" + _sizes(here), fontsize=10)
    return ax


def _points(results: xr.Dataset, here: xr.Dataset, ax: Axes, scale: float) -> float:
    """Observed fractions with their intervals; where the axis ends."""
    # offset of each law's points by a part of the least spacing: intervals at one level do not hide each other
    shift = np.linspace(-0.25, 0.25, here.sizes["model"]) if here.sizes["model"] > 1 else np.zeros(1)
    levels = here["level"].values / scale
    gap = float(np.diff(levels).min()) if levels.size > 1 else 0.0
    # no further than the first level at which nearly everything falls: the same for all blocks, which are compared
    done = np.flatnonzero(
        (results["probability"] > 0.995).all([*{"block", "model", "floor"} & {*results["probability"].dims}]).values
    )
    for i, (colour, marker, _) in enumerate(styles(results)):
        one = here.isel(model=i)
        p = one["probability"].values
        errors = np.stack([p - one["lower"].values, one["upper"].values - p])
        ax.errorbar(
            levels + gap * shift[i],
            p,
            yerr=np.maximum(errors, 0.0),
            fmt=marker,
            ms=3.5,
            mew=0.0,
            lw=0.8,
            color=colour,
            alpha=0.6,
        )
    return 1.02 * float(levels[done[0]] if done.size else levels[-1])


def _verdicts(results: xr.Dataset, here: xr.Dataset, ax: Axes, scale: float) -> float:
    """Every motion of a cloud at its own intensity: below where the block stands, above where it falls."""
    at = here["intensity"].values / scale
    for i, (colour, _, _) in enumerate(styles(results)):
        fell = here["overturned"].isel(model=i).values
        ax.plot(at, np.where(fell, 1.0 + 0.012 * i, -0.012 * i), "|", ms=6.0, mew=0.8, color=colour, alpha=0.5)
    most = float((results["intensity"] / scale).max())
    if "median" not in results:
        return 1.02 * most
    # (a few strong motions must not press all curves against the axis)
    top = results["median"] * np.exp(FAR * results["dispersion"]) / scale
    return 1.02 * min(most, float(top.max())) if bool(np.isfinite(top).any()) else 1.02 * most


def _curve(one: xr.Dataset, x: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """The fitted curve of one block and law at x; None where there is none."""
    fit = one.assign_attrs(form=one.attrs.get("form", "lognormal"))
    if "curve_probability" in one:
        fit = fit.drop_vars(["probability", "lower", "upper"], errors="ignore").rename(curve_probability="probability")
    elif not np.isfinite(one["median"].item()):
        return None
    return np.asarray(curve_probability(fit, x, outside="most").values)


def fragility_figure(results: xr.Dataset) -> Figure:
    """One panel of fragility curves for each block (and floor), with one legend for all."""
    floors = _floors(results)
    every = [(str(block), floor) for block in results["block"].values for floor in floors]
    panels = every[:MOST_PANELS]
    # a row for each block where its floors fit into one
    columns = min(PANEL_COLUMNS, len(panels) if floors == [None] or len(floors) > PANEL_COLUMNS else len(floors))
    rows = math.ceil(len(panels) / columns)
    laws = results.sizes["model"]
    legend_rows = math.ceil(laws / columns)
    figure = plt.figure(figsize=(max(4.4 * columns, 6.0), 3.7 * rows + 0.26 * legend_rows + 0.55), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, sharey=True)
    for ax, (block, floor) in zip(axes.flat, panels, strict=False):
        fragility(results, block, ax, floor)
        ax.label_outer(remove_inner_ticks=False)
        ax.set_xlabel(ax.get_xlabel() or axes.flat[0].get_xlabel())
    for ax in list(axes.flat)[len(panels) :]:
        ax.remove()
    handles, labels = axes.flat[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=columns, frameon=False, fontsize=9)
    percent = f"{100.0 * float(results.attrs.get('confidence', 0.95)):g} %"
    motions = results.sizes["motion"] // len(floors)
    each = " a floor" if len(floors) > 1 else ""
    seen = f"points: observed, with {percent} Wilson intervals" if "level" in results.coords else "bars: every motion"
    legend = f"{motions} motion{'s' if motions != 1 else ''}{each}; {seen}"
    if results.sizes["model"] > 1 and "level" in results.coords:
        legend += " (shifted sideways to be told apart)"
    if bool(results["converged"].any()):
        legend += f"; lines: {results.attrs.get('form', 'lognormal')} fits"
    if len(every) > len(panels):
        legend = f"the first {len(panels)} of {len(every)} panels; {legend}"
    wrapped = textwrap.fill(legend, int(11.0 * figure.get_figwidth()))
    figure.suptitle(f"{results.attrs.get('title', 'Fragility')}\n{wrapped}", fontsize=11)
    return figure


def _floors(results: xr.Dataset) -> list[int | str | None]:
    """The floors that results tell apart; None alone where they do not."""
    return list(results["floor"].values.tolist()) if "floor" in results.dims else [None]


def _sizes(here: xr.Dataset) -> str:
    return f"{here['width'].item():.2f} m × {here['height'].item():.2f} m, α = {here['alpha'].item():.3f} rad"
