"""Figures that compare intensity measures by their dispersions."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...core.wording import percent
from ..plan.estimates import RANK, ranking_of_measures
from ..text.words import floor_name, measure_at
from . import axes, selection

WORSE = "0.55"
"""Grey of measures that the paired differences show to be worse than the best."""


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

    Parameters
    ----------
    results : xarray.Dataset
        Results of a study with ``[measures]``, or the dataset that `toppling.fragility.rank_measures` returns.
    ax, block, model, floor, color : optional
        As for `fragility`, but a law is needed where there are several; the colour is of the measures that cannot be
        distinguished from the best.

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    ValueError
        No ranking; several blocks, laws or floors, and no label given; no such label.

    Notes
    -----
    Dots are dispersions of the capacity with bootstrap intervals.  Each measure is taken to the power in which it grows
    with the motion's amplitude (Arias intensity as its root).  Full dots: measures that paired differences do not
    distinguish from the best; hollow grey dots: worse measures.
    """
    if f"{RANK}rank" in results:
        found = ranking_of_measures(results)
    elif "amplitude_dispersion" in results and "measure" in results.dims:
        found = results
    else:
        raise ValueError(
            "a figure of measures needs their ranking: a study with measures, or what rank_measures returns"
        )
    return ranking(selection.one(found, block=block, floor=floor, model=model), ax, color=color)


def ranking(
    found: xr.Dataset, ax: Axes | None = None, order: list[str] | None = None, color: str | None = None
) -> Axes:
    """Draw the dispersion of the capacity in every measure (over its power), with its interval, by `order` or rank."""
    if found["dispersion"].dims != ("measure",):
        raise ValueError(f"one block and one law are drawn, got {dict(found['dispersion'].sizes)}: select them")
    ax = ax or axes.new(6.0, 0.28 * found.sizes["measure"] + 1.3)
    here = found.sel(measure=order or by_rank(found))
    y = np.arange(here.sizes["measure"])
    best = np.nanmin(here["amplitude_dispersion"].values, initial=math.inf)
    if math.isfinite(best):
        ax.axvline(best, color="0.7", lw=0.8, ls=(0, (4, 2)), zorder=0)
    for at, one in zip(y, (here.isel(measure=i) for i in range(y.size)), strict=True):
        value = one["amplitude_dispersion"].item()
        if math.isnan(value):
            status = str(one["status"].item())
            ax.annotate(status, (0.02, at), xycoords=("axes fraction", "data"), va="center", fontsize=8)
            continue
        worse = bool(one["distinguishable"])
        colour = WORSE if worse else color or axes.COLOURS[0]
        low, high = (one[f"amplitude_dispersion_{end}"].item() for end in ("lower", "upper"))
        ax.plot([low, high], [at, at], color=colour, lw=1.6, solid_capstyle="butt")
        ax.plot(value, at, "o", ms=6.0, color=colour, mfc="white" if worse else colour, mew=1.4)
    names = (map(str, here[name].values) for name in ("measure", "measure_long_name"))
    axes.named_rows(ax, list(map(measure_at, *names, here["power"].values.tolist())))
    ax.set_xlim(0.0, _largest(here))
    ax.set_xlabel("dispersion of the capacity")
    return ax


def _largest(found: xr.Dataset) -> float:
    """Return the end of an axis on which every dispersion and its interval fit."""
    ends = [found[name].values for name in ("amplitude_dispersion", "amplitude_dispersion_upper")]
    return 1.04 * float(np.nanmax(np.concatenate([one.ravel() for one in ends]), initial=0.1))


def by_rank(found: xr.Dataset) -> list[str]:
    """Return the measures from the best to the worst by their mean rank over all else; measures without a rank last."""
    rank = found["rank"].where(found["rank"] > 0, found.sizes["measure"] + 1)
    mean = rank.mean([dim for dim in rank.dims if dim != "measure"])
    return [str(one) for one in found["measure"].values[np.argsort(mean.values, kind="stable")]]


def ranking_figure(found: xr.Dataset, block: str | None = None, floor: int | str | None = None) -> Figure:
    """Return the figure of a block's ranked measures, a panel for each law, in one order; by default the first."""
    label = selection.labels(found, "block")[0] if block is None else block
    here = selection.one(found, block=label, floor=floor)
    where = label if floor is None else f"{label}, {floor_name(floor)}"
    laws, height = here.sizes["model"], 0.24 * here.sizes["measure"] + 0.75
    figure, panels, columns = axes.panel_grid(laws, (2.6, height), (1.8, 1.2), 6.0, shared=True)
    order = by_rank(here)
    for i, ax in enumerate(panels):
        one = here.isel(model=i)
        ranking(one, ax, order)
        ax.set_xlim(0.0, _largest(here))
        ax.set_title(axes.wrapped(axes.model_name(str(one["model"].item())), 2.5), fontsize=10)
        ax.set_xlabel("dispersion of the capacity" if i + columns >= laws else "")
        ax.tick_params(labelbottom=True, labelleft=i % columns == 0)
    text = (
        f"{where}: scatter of the capacity in each intensity measure; {found.attrs['motions']} motions, "
        f"{percent(float(found.attrs['confidence']))} bootstrap intervals; "
        "full dots: not distinguished from the best by paired differences"
    )
    axes.heading(figure, str(found.attrs.get("title", "Intensity measures")), text)
    return figure
