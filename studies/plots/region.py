"""Maps of a region: medians and rates of its blocks over their slenderness and size, a panel for each law."""

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
from . import axes, selection

MOST_POINTS = 3000
"""Number of blocks of which a map is drawn, evenly among all; values between them are interpolated."""
STEPS = 9
"""Steps of colour if no round numbers serve."""
LEAST_STEPS = 4
"""Round numbers between the ends of the values from which they are the steps of colour."""
SLENDERNESS, SIZE = "height of the mass centre over half the width", "size R (m)"
OWN = "own_e", "own_delta"
"""Properties that blocks may have of their own: neighbours on the map then differ."""
FLAT = 1e-3
"""Ratio of the narrow to the wide way of a region from which it is drawn as a line."""


def maps(results: xr.Dataset) -> Iterator[tuple[str, Figure]]:
    """Yield maps of the medians, and of the rates if there are any, each with its name."""
    scale, unit = display_unit(results["half_level"])
    level = f"{level_name(results)}{f' ({unit})' if unit else ''}"
    yield "map_half_level", _map(results, "half_level", "Medians by slenderness and size", f"median {level}", scale)
    if "rate" in results:
        rate = "annual rate of overturning"
        yield "map_rate", _map(results, "rate", "Annual rates by slenderness and size", rate, 1.0)


@axes.style()
def event_figure(results: xr.Dataset) -> Figure:
    """Return the probability that more than a share of the region falls in one event, a panel for each law."""
    scale, unit = display_unit(results["event_level"])
    laws, events = selection.laws(results), results.sizes["event_motion"]
    figure, panels, _ = axes.panel_grid(len(laws), 2.6, 0.8)
    beyond = 1.0 - np.arange(events + 1) / events
    for i, ax in enumerate(panels):
        axes.name(ax, laws[i].label)
        for k, level in enumerate(results["event_level"].values.tolist()):
            event = results.isel(model=i, event_level=k)
            shares = np.concatenate([[0.0], np.sort(event["fallen_share"].values)])
            colour, _, line = axes.look(k)
            text = f"{level / scale:.3g} {unit}".strip()
            ax.step(shares, beyond, where="post", color=colour, ls=line, label=text)
            middle, apart = (float(event[name]) for name in ("fallen_mean", "fallen_sd_independent"))
            ax.axvspan(max(0.0, middle - 2.0 * apart), min(1.0, middle + 2.0 * apart), color=colour, alpha=0.25, lw=0.0)
        axes.shares(ax.xaxis)
        axes.shares(ax.yaxis)
        axes.label(ax, "share of fallen blocks", "probability of a larger share")
    axes.heading(
        figure,
        "Share of blocks fallen together",
        f"{results.sizes['block']:,} blocks in one event; lines: {level_name(results)}",
        "bands: 95 % of events if blocks fell independently",
        legend=panels[:1],
    )
    return figure


@axes.style()
def _map(results: xr.Dataset, name: str, title: str, words: str, scale: float) -> Figure:
    """Return the map of a quantity."""
    kept = np.unique(np.linspace(0, results.sizes["block"] - 1, MOST_POINTS).astype(int))
    # (the ends of both axes are always among them)
    ends = [at for size in ("alpha", "R") for at in (results[size].values.argmin(), results[size].values.argmax())]
    drawn = results.isel(block=np.unique([*kept, *ends]))
    laws = selection.laws(results)
    figure, panels, _ = axes.panel_grid(len(laws), 2.9, 0.5, min(2, axes.columns_for(len(laws))))
    slender, size = 1.0 / np.tan(drawn["alpha"].values), drawn["R"].values
    values = drawn[name].transpose("model", "block").values / scale
    flat = _is_line(slender, size)
    block_laws = any(name in drawn.coords for name in OWN)
    areas = 0
    for i, ax in enumerate(panels):
        axes.name(ax, laws[i].label)
        known = np.isfinite(values[i]) & (values[i] > 0.0)
        if block_laws or (not flat and _is_line(slender[known], size[known])):
            _points(ax, figure, slender, size, values[i], words)
        elif flat:
            _line(ax, drawn.isel(model=i), slender, size, name, words, scale)
        else:
            areas += 1
            _area(ax, figure, slender, size, values[i], words)
            # the blocks of the surface's check
            p, alpha = (results[f"check_{size}"].isel(model=i).values for size in ("p", "alpha"))
            height = STANDARD_GRAVITY / (float(drawn["inertia_factor"].mean()) * p**2)
            ax.plot(1.0 / np.tan(alpha), height, "x", color="black", ms=5, mew=1.2)
    axes.heading(
        figure,
        title,
        f"{results.sizes['block']:,} blocks",
        "each block with its own e and δ" if block_laws else "",
        "lines: equal values; crosses: blocks that were run by themselves as a check"
        if areas and not block_laws
        else "",
    )
    return figure


def _is_line(slender: Array, size: Array) -> bool:
    """Return True if blocks lie on a line, which has no area to colour."""
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
    # round numbers if there are enough of them: closer numbers if the values vary little
    for subs in ((1.0, 1.5, 2.0, 3.0, 5.0, 7.0), (1.0, 1.2, 1.4, 1.7, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 7.0, 8.0)):
        ticks = [tick for tick in LogLocator(subs=subs).tick_values(low, high) if low < tick < high]
        if len(ticks) >= LEAST_STEPS:
            levels = np.array([low * 0.999, *ticks, high * 1.001])
            break
    filled = ax.tricontourf(shape, values[known], levels=levels, norm=LogNorm(low, high), cmap="viridis")
    ax.tricontour(shape, values[known], levels=levels[1:-1], colors="white", linewidths=0.6)
    bar = figure.colorbar(filled, ax=ax)
    texts = [axes.plain_number(float(f"{level:.2g}")) for level in levels[1:-1]]
    bar.set_ticks(levels[1:-1].tolist(), labels=texts)
    bar.set_label(axes.sentence(words))
    axes.label(ax, SLENDERNESS, SIZE)


def _points(ax: Axes, figure: Figure, slender: Array, size: Array, values: Array, words: str) -> None:
    """Draw each block, as neighbours differ in their own properties."""
    known = np.isfinite(values) & (values > 0.0)
    axes.label(ax, SLENDERNESS, SIZE)
    if not known.any():
        ax.text(0.5, 0.5, "no block has a value", transform=ax.transAxes, ha="center", va="center")
        return
    low, high = float(values[known].min()), float(values[known].max())
    norm = LogNorm(low, max(high, low * 1.0001))
    drawn = ax.scatter(slender[known], size[known], c=values[known], s=10.0, norm=norm, cmap="viridis")
    figure.colorbar(drawn, ax=ax).set_label(axes.sentence(words))


def _line(ax: Axes, results: xr.Dataset, slender: Array, size: Array, name: str, words: str, scale: float) -> None:
    """Draw a quantity with its interval along the one way in which blocks differ."""
    by_size = np.ptp(np.log(size)) > np.ptp(np.log(slender))
    x = size if by_size else slender
    order = np.argsort(x)
    low, high = (results[f"{name}_{end}"].values[order] / scale for end in ("lower", "upper"))
    ax.fill_between(x[order], low, high, color=axes.colour(0), alpha=0.25, lw=0.0)
    ax.plot(
        x[order], results[name].values[order] / scale, color=axes.colour(0), marker="" if x.size > 20 else "o", ms=4
    )
    ax.set_yscale("log")
    axes.plain_log_y(ax)
    axes.label(ax, SIZE if by_size else SLENDERNESS, words)
