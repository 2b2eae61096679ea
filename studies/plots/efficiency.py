"""Figures that compare intensity measures by their dispersions."""

import math

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...core.units import ENDS
from ...core.wording import percent
from ..plan.estimates import RANK, ranking_of_measures
from ..text.words import measure_at
from . import axes, selection

WORSE = "0.55"
"""Grey of measures that the paired differences show to be worse than the best."""


@axes.drawing
def measures(
    results: xr.Dataset,
    ax: Axes | None = None,
    *,
    block: str | None = None,
    model: str | None = None,
    floor: int | str | None = None,
    color: str | None = None,
) -> Axes:
    """Draw intensity measures ranked by the dispersion of the capacity in each measure, the best on top.

    Full dots are measures that paired differences do not distinguish from the best; worse measures are hollow. Each
    measure is taken to the power in which it grows with the motion's amplitude (Arias intensity as its root).

    Parameters
    ----------
    results : xarray.Dataset
        Results of a study with ``[measures]``, or the dataset that `toppling.fragility.rank_measures` returns.
    """
    if f"{RANK}rank" in results:
        measured = ranking_of_measures(results)
    elif "amplitude_dispersion" in results and "measure" in results.dims:
        measured = results
    else:
        raise ValueError(
            "a figure of measures needs their ranking: a study with measures, or what rank_measures returns"
        )
    return ranking(selection.single(measured, block=block, floor=floor, model=model), ax, color=color)


def ranking(
    measured: xr.Dataset, ax: Axes | None = None, order: list[str] | None = None, color: str | None = None
) -> Axes:
    """Draw the dispersion of the capacity in every measure (over its power), with its interval, by `order` or rank."""
    if measured["dispersion"].dims != ("measure",):
        raise ValueError(f"one block and one law are drawn, got {dict(measured['dispersion'].sizes)}: select them")
    ax = ax or axes.new(0.28 * measured.sizes["measure"] + 1.0)
    ordered = measured.sel(measure=order or by_rank(measured))
    best = np.nanmin(ordered["amplitude_dispersion"].values, initial=math.inf)
    if math.isfinite(best):
        ax.axvline(best, color="0.7", lw=0.8, ls=(0, (4, 2)), zorder=0)
    for y in range(ordered.sizes["measure"]):
        measure = ordered.isel(measure=y)
        value, low, high = (measure[f"amplitude_dispersion{end}"].item() for end in ENDS)
        if math.isnan(value):
            ax.annotate(str(measure["status"].item()), (0.02, y), xycoords=("axes fraction", "data"), va="center")
            continue
        worse = bool(measure["distinguishable"])
        colour = WORSE if worse else color or axes.COLOURS[0]
        ax.plot([low, high], [y, y], color=colour, lw=1.6, solid_capstyle="butt")
        ax.plot(value, y, "o", ms=6.0, color=colour, mfc="white" if worse else colour, mew=1.4)
    names = (map(str, ordered[name].values) for name in ("measure", "measure_long_name"))
    axes.named_rows(
        ax, list(map(measure_at, *names, ordered["power"].values.tolist())), 1.2 if axes.has_room() else 0.7
    )
    ax.set_xlim(0.0, _largest(ordered))
    return axes.label(ax, "dispersion of the capacity", along="x")


def _largest(measured: xr.Dataset) -> float:
    """Return the end of an axis on which every dispersion and its interval fit."""
    ends = [measured[f"amplitude_dispersion{end}"].values for end in ("", "_upper")]
    return 1.04 * float(np.nanmax(np.stack(ends), initial=0.1))


def by_rank(measured: xr.Dataset) -> list[str]:
    """Return the measures from the best to the worst by their mean rank over all else; measures without a rank last."""
    rank = measured["rank"].where(measured["rank"] > 0, measured.sizes["measure"] + 1)
    mean = rank.mean([dim for dim in rank.dims if dim != "measure"])
    return [str(measure) for measure in measured["measure"].values[np.argsort(mean.values, kind="stable")]]


@axes.style()
def ranking_figure(measured: xr.Dataset, block: str | None = None, floor: int | str | None = None) -> Figure:
    """Return the figure of a block's ranked measures, a panel for each law, in one order; by default the first."""
    label = selection.labels(measured, "block")[0] if block is None else block
    of_block = selection.single(measured, block=label, floor=floor)
    names, order = selection.law_names(selection.labels(of_block, "model")), by_rank(of_block)
    figure, panels, columns = axes.panel_grid(len(names), 0.32 * len(order) + 0.6, 0.6, shared=True)
    for i, (ax, law) in enumerate(zip(panels, names, strict=True)):
        ranking(of_block.isel(model=i), ax, order)
        ax.set_xlim(0.0, _largest(of_block))
        axes.name(ax, law)
        axes.outer_labels(ax, i, columns, len(names))
    axes.heading(
        figure,
        "Dispersion by intensity measure",
        selection.place(label, floor),
        f"{measured.attrs['motions']} motions, {percent(float(measured.attrs['confidence']))} bootstrap intervals",
        "full dots: not distinguished from the best measure by paired differences",
    )
    return figure
