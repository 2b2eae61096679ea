"""Maps of a region: medians and rates of its blocks over their slenderness and size, a panel for each law."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator
from matplotlib.tri import Triangulation

from ...core.aliases import Array
from ...core.units import STANDARD_GRAVITY
from ..text.words import display_unit, level_name
from . import axes

MOST_POINTS = 3000
"""Blocks of which a map is drawn, evenly among all; what lies between is interpolated."""
STEPS = 9
"""Steps of colour where no round numbers serve."""
LEAST_STEPS = 4
"""Round numbers between the ends of the values from which they are the steps of colour."""
SLENDERNESS = "height of the mass centre over half the width"
OWN = "own_e", "own_delta"
"""What blocks may have of their own: neighbours on the map then differ."""
FLAT = 1e-3
"""Ratio of the narrow to the wide way of a region from which it is drawn as a line."""


def maps(results: xr.Dataset) -> Iterator[tuple[str, Figure]]:
    """Yield maps of the medians, and of the rates where there are any, each with its name."""
    scale, unit = display_unit(results["half_level"])
    quantities = [("half_level", f"{level_name(results)} at which half fall{f' ({unit})' if unit else ''}", scale)]
    if "rate" in results:
        quantities.append(("rate", "annual rate of overturning", 1.0))
    for name, words, size in quantities:
        yield f"map_{name}", _map(results, name, words, size)


def event_figure(results: xr.Dataset) -> Figure:
    """Return how often more than a share of the region falls in one event, a panel for each law."""
    scale, unit = display_unit(results["event_level"])
    measure = level_name(results)
    laws, events = results.sizes["model"], results.sizes["event_motion"]
    figure, panels, _ = axes.panel_grid(laws, (3.9, 3.4), (0.0, 0.6), 4.6)
    beyond = 1.0 - np.arange(events + 1) / events
    for i, ax in enumerate(panels):
        _name(ax, results, i)
        for k, level in enumerate(results["event_level"].values.tolist()):
            one = results.isel(model=i, event_level=k)
            shares = 100.0 * np.sort(one["fallen_share"].values)
            text = f"{measure} {level / scale:.3g}{f' {unit}' if unit else ''}"
            ax.step(np.concatenate([[0.0], shares]), beyond, where="post", color=axes.colour(k), label=text)
            middle, apart = (100.0 * float(one[name]) for name in ("fallen_mean", "fallen_sd_independent"))
            ends = max(0.0, middle - 2.0 * apart), min(100.0, middle + 2.0 * apart)
            ax.axvspan(*ends, color=axes.colour(k), alpha=0.25, lw=0.0)
        ax.set_xlabel("share of the region that falls, %")
        ax.set_ylabel("share of events in which more falls")
        ax.legend(fontsize=8)
        axes.grid(ax)
    title = f"Share of {results.sizes['block']:,} blocks that falls in one event"
    axes.heading(figure, title, "bands: 95 % of events if blocks fell independently")
    return figure


def _name(ax: Axes, results: xr.Dataset, i: int) -> None:
    """Write the law of panel `i` above it."""
    ax.set_title(axes.wrapped(axes.model_name(str(results["model"].values[i])), axes.width_of(ax)), fontsize=10.0)


def _map(results: xr.Dataset, name: str, words: str, scale: float) -> Figure:
    """Return the map of a quantity."""
    kept = np.unique(np.linspace(0, results.sizes["block"] - 1, MOST_POINTS).astype(int))
    # (the ends of both axes are always among them)
    ends = [at for one in ("alpha", "R") for at in (results[one].values.argmin(), results[one].values.argmax())]
    drawn = results.isel(block=np.unique([*kept, *ends]))
    figure, panels, _ = axes.panel_grid(results.sizes["model"], (3.9, 3.7), (0.0, 0.6), 4.6)
    slender, size = 1.0 / np.tan(drawn["alpha"].values), drawn["R"].values
    values = drawn[name].transpose("model", "block").values / scale
    flat = _is_line(slender, size)
    own = any(name in drawn.coords for name in OWN)
    areas = 0
    for i, ax in enumerate(panels):
        _name(ax, results, i)
        known = np.isfinite(values[i]) & (values[i] > 0.0)
        if own or (not flat and _is_line(slender[known], size[known])):
            _points(ax, figure, slender, size, values[i], words)
        elif flat:
            _line(ax, drawn.isel(model=i), slender, size, name, words, scale)
        else:
            areas += 1
            _area(ax, figure, slender, size, values[i], words)
            # (the blocks that were run to check the surface)
            p, alpha = (results[f"check_{one}"].isel(model=i).values for one in ("p", "alpha"))
            height = STANDARD_GRAVITY / (float(drawn["inertia_factor"].mean()) * p**2)
            ax.plot(1.0 / np.tan(alpha), height, "x", color="black", ms=5, mew=1.2)
    what = "lines: equal values; crosses: blocks that were run by themselves as a check" if areas else ""
    what = "each block with its own e and δ" if own else what
    axes.heading(figure, f"{words[:1].upper()}{words[1:]} of {results.sizes['block']:,} blocks", what)
    return figure


def _is_line(slender: Array, size: Array) -> bool:
    """Return whether blocks lie on a line, which has no area to colour."""
    if slender.size < 3:
        return True
    for both in (np.stack([np.log(slender), np.log(size)]), np.stack([slender, size])):
        wide = np.linalg.svd(both - both.mean(axis=1, keepdims=True), compute_uv=False)
        if wide[1] <= FLAT * max(wide[0], 1e-9):
            return True
    return False


def _area(ax: Axes, figure: Figure, slender: Array, size: Array, values: Array, words: str) -> None:
    known = np.isfinite(values) & (values > 0.0)
    shape = Triangulation(slender[known], size[known])
    low, high = float(values[known].min()), float(values[known].max())
    levels = np.geomspace(low, max(high, low * 1.0001), STEPS)
    # (round numbers where there are enough of them: closer ones where the values vary little)
    for subs in ((1.0, 1.5, 2.0, 3.0, 5.0, 7.0), (1.0, 1.2, 1.4, 1.7, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 7.0, 8.0)):
        ticks = [one for one in LogLocator(subs=subs).tick_values(low, high) if low < one < high]
        if len(ticks) >= LEAST_STEPS:
            levels = np.array([low * 0.999, *ticks, high * 1.001])
            break
    filled = ax.tricontourf(shape, values[known], levels=levels, norm=LogNorm(low, high), cmap="viridis")
    ax.tricontour(shape, values[known], levels=levels[1:-1], colors="white", linewidths=0.6)
    bar = figure.colorbar(filled, ax=ax)
    bar.set_ticks(levels[1:-1].tolist(), labels=[axes.plain_number(float(f"{one:.2g}")) for one in levels[1:-1]])
    bar.set_label(words, fontsize=9)
    _of_sizes(ax)


def _of_sizes(ax: Axes) -> None:
    ax.set_xlabel(SLENDERNESS)
    ax.set_ylabel("size R, m")


def _points(ax: Axes, figure: Figure, slender: Array, size: Array, values: Array, words: str) -> None:
    """Draw each block, as neighbours differ in what they have of their own."""
    known = np.isfinite(values) & (values > 0.0)
    _of_sizes(ax)
    if not known.any():
        ax.text(0.5, 0.5, "no block has a value", transform=ax.transAxes, ha="center", va="center", fontsize=9)
        return
    low, high = float(values[known].min()), float(values[known].max())
    norm = LogNorm(low, max(high, low * 1.0001))
    drawn = ax.scatter(slender[known], size[known], c=values[known], s=10.0, norm=norm, cmap="viridis")
    figure.colorbar(drawn, ax=ax).set_label(words, fontsize=9)


def _line(ax: Axes, one: xr.Dataset, slender: Array, size: Array, name: str, words: str, scale: float) -> None:
    """Draw a quantity with its interval along the one way in which blocks differ."""
    by_size = np.ptp(np.log(size)) > np.ptp(np.log(slender))
    x = size if by_size else slender
    order = np.argsort(x)
    low, high = (one[f"{name}_{end}"].values[order] / scale for end in ("lower", "upper"))
    ax.fill_between(x[order], low, high, color=axes.colour(0), alpha=0.25, lw=0.0)
    ax.plot(x[order], one[name].values[order] / scale, color=axes.colour(0), marker="" if x.size > 20 else "o", ms=4)
    ax.set_yscale("log")
    axes.plain_log_y(ax)
    ax.set_xlabel("size R, m" if by_size else SLENDERNESS)
    ax.set_ylabel(words)
    axes.grid(ax)
