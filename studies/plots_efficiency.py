"""Figures of intensity measures compared: axes in, axes out."""

from __future__ import annotations

import math

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.special import stdtrit

from .estimates import RANK, ranking_of_measures
from .plots import COLOURS, PANEL_COLUMNS, grid, heading, labels_of, model_name, new_axes, one_of, wrapped
from .words import floor_name, measure_name, percent

TOLD_APART = "0.55"


def measures(
    results: xr.Dataset,
    ax: Axes | None = None,
    *,
    block: str | None = None,
    model: str | None = None,
    floor: int | str | None = None,
    color: str | None = None,
) -> Axes:
    """Intensity measures ranked by the scatter of the capacity that each leaves, the best on top.

    Parameters
    ----------
    results : xarray.Dataset
        Of a study with ``[measures]``, or as `toppling.fragility.rank_measures` returns it.
    ax : matplotlib Axes, optional
        Where to draw; axes of a new figure where not given.
    block, model : str, optional
        Labels of a block and a damping law; each needed where there are several.
    floor : int or str, optional
        Which floor, where the results are of several.
    color : str, optional
        Of measures that are not told from the best, matplotlib's.

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    ValueError
        No ranking; several blocks, laws or floors, and none is said; none called so.

    Notes
    -----
    Dots are dispersions of the capacity, each measure to the power in which it grows with the motion (the root of Arias
    intensity), with bootstrap intervals.  Full: not told from the best by paired differences; hollow and grey: worse.

    Examples
    --------
    >>> import toppling as tp
    >>> shaking = tp.motions.CloughPenzien(duration=6, dt=0.02).sample(12)
    >>> runs = tp.ida(tp.catalogue["bookcase-5-shelf"], tp.HousnerImpact(), shaking, [1.0, 2.0, 4.0, 8.0])
    >>> found = tp.fragility.rank_measures(runs, shaking, replicates=50)
    >>> tp.plot.measures(found).get_xlabel()
    'dispersion of the capacity'
    """
    if f"{RANK}rank" in results:
        found = ranking_of_measures(results)
    elif "amplitude_dispersion" in results and "measure" in results.dims:
        found = results
    else:
        raise ValueError(
            "a figure of measures needs their ranking: a study with measures, or what rank_measures returns"
        )
    here = one_of(one_of(one_of(found, "block", block), "floor", floor), "model", model)
    return ranking(here, ax, color=color)


def ranking(
    found: xr.Dataset, ax: Axes | None = None, order: list[str] | None = None, color: str | None = None
) -> Axes:
    """Dispersion of the capacity in every measure (over its power) with its interval, the best on top.

    Full dots: not told from the best by the paired differences; hollow ones: worse.

    Parameters
    ----------
    found : xarray.Dataset
        Of one block and one law (and one floor): `fragility.rank_measures` with `sel` or `isel`.
    ax : matplotlib Axes, optional
        Where to draw; new axes where not given.
    order : list of str, optional
        The measures from top to bottom; by rank where not given.
    color : str, optional
        Of measures that are not told from the best.

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    ValueError
        Several blocks, laws or floors.
    """
    _single(found, "dispersion")
    if ax is None:
        ax = new_axes(6.0, 0.28 * found.sizes["measure"] + 1.3)
    here = found.sel(measure=order or by_rank(found))
    y = np.arange(here.sizes["measure"])
    best = np.nanmin(here["amplitude_dispersion"].values, initial=math.inf)
    if math.isfinite(best):
        ax.axvline(best, color="0.7", lw=0.8, ls=(0, (4, 2)), zorder=0)
    for at, one in zip(y, (here.isel(measure=i) for i in range(y.size)), strict=True):
        value = one["amplitude_dispersion"].item()
        if math.isnan(value):
            ax.annotate(
                str(one["status"].item()), (0.02, at), xycoords=("axes fraction", "data"), va="center", fontsize=8
            )
            continue
        worse = bool(one["distinguishable"])
        colour = TOLD_APART if worse else color or COLOURS[0]
        low, high = (one[f"amplitude_dispersion_{end}"].item() for end in ("lower", "upper"))
        ax.plot([low, high], [at, at], color=colour, lw=1.6, solid_capstyle="butt")
        ax.plot(value, at, "o", ms=6.0, color=colour, mfc="white" if worse else colour, mew=1.4)
    powers = here["power"].values
    names = [measure_name(str(one), float(power)) for one, power in zip(here["measure"].values, powers, strict=True)]
    ax.set_yticks(y, names)
    ax.set_ylim(y[-1] + 0.6, -0.6)
    ax.set_xlim(0.0, _largest(here))
    ax.set_xlabel("dispersion of the capacity")
    grid(ax, "x")
    return ax


def _largest(found: xr.Dataset) -> float:
    """End of an axis that holds every dispersion and its interval."""
    ends = [found[name].values for name in ("amplitude_dispersion", "amplitude_dispersion_upper")]
    return 1.04 * float(np.nanmax(np.concatenate([one.ravel() for one in ends]), initial=0.1))


def by_rank(found: xr.Dataset) -> list[str]:
    """Measures from the best to the worst by their mean rank over blocks, laws and floors; those without one last."""
    rank = found["rank"].where(found["rank"] > 0, found.sizes["measure"] + 1)
    mean = rank.mean([dim for dim in rank.dims if dim != "measure"])
    return [str(one) for one in found["measure"].values[np.argsort(mean.values, kind="stable")]]


def ranking_figure(found: xr.Dataset, block: str | None = None, floor: int | str | None = None) -> Figure:
    """One panel of ranked measures for each law of a block (the first where not given), in one order.

    Raises
    ------
    ValueError
        Results of several floors, and none is said.
    """
    label = labels_of(found, "block")[0] if block is None else block
    here = one_of(one_of(found, "block", label), "floor", floor)
    where = label if floor is None else f"{label}, {floor_name(floor)}"
    laws = here.sizes["model"]
    columns = 2 if laws == 4 else min(PANEL_COLUMNS, laws)
    rows = math.ceil(laws / columns)
    height = 0.24 * here.sizes["measure"] + 0.75
    width = max(2.6 * columns + 1.8, 6.0)
    figure = Figure(figsize=(width, height * rows + 1.2), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, sharey=True, sharex=True)
    order = by_rank(here)
    for i, ax in enumerate(axes.flat):
        if i >= laws:
            ax.remove()
            continue
        one = here.isel(model=i)
        ranking(one, ax, order)
        ax.set_xlim(0.0, _largest(here))
        ax.set_title(wrapped(model_name(str(one["model"].item())), 2.5), fontsize=10)
        ax.set_xlabel("dispersion of the capacity" if i + columns >= laws else "")
        ax.tick_params(labelbottom=True, labelleft=i % columns == 0)
    text = (
        f"{where}: scatter of the capacity in each intensity measure; {found.attrs['motions']} motions, "
        f"{percent(float(found.attrs['confidence']))} bootstrap intervals; "
        "full dots: not told from the best by paired differences"
    )
    heading(figure, str(found.attrs.get("title", "Intensity measures")), text)
    return figure


def sufficiency(found: xr.Dataset, covariate: str, ax: Axes | None = None, order: list[str] | None = None) -> Axes:
    """Trend of the capacity with a covariate in every measure, with its interval: none is what a measure should leave.

    Parameters
    ----------
    found : xarray.Dataset
        Of one block and one law (and one floor), as for `ranking`.
    covariate : str
        Which one.
    ax, order
        As for `ranking`.

    Returns
    -------
    matplotlib Axes
    """
    _single(found, "dispersion")
    here = found.sel(measure=order or by_rank(found), covariate=covariate)
    if ax is None:
        ax = new_axes(6.0, 0.28 * found.sizes["measure"] + 1.3)
    level = float(found.attrs["confidence"])
    n = int(here["covariate_motions"])
    half = stdtrit(max(n - 2, 1), 0.5 + 0.5 * level) * here["slope_se"].values
    slope, p = here["slope"].values, here["p_value"].values
    y = np.arange(slope.size)
    ax.axvline(0.0, color="0.7", lw=0.8, ls=(0, (4, 2)), zorder=0)
    for at in y[np.isfinite(slope)]:
        trend = p[at] < 1.0 - level
        colour = COLOURS[1] if trend else COLOURS[0]
        ax.plot(slope[at] + half[at] * np.array([-1.0, 1.0]), [at, at], color=colour, lw=1.6, solid_capstyle="butt")
        ax.plot(slope[at], at, "s" if trend else "o", ms=5.5, color=colour, mfc="white" if trend else colour, mew=1.4)
    ax.set_yticks(y, [measure_name(str(one)) for one in here["measure"].values])
    ax.set_ylim(y[-1] + 0.6, -0.6)
    ax.set_xlabel(f"slope of ln capacity on {here['covariate_long_name'].item()}")
    grid(ax, "x")
    return ax


def _single(found: xr.Dataset, name: str) -> None:
    if found[name].dims != ("measure",):
        raise ValueError(f"one block and one law are drawn, got {dict(found[name].sizes)}: select them")
