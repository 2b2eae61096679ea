"""Figures of intensity measures compared: axes in, axes out."""

from __future__ import annotations

import math

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.special import stdtrit

from .plots import COLOURS, PANEL_COLUMNS, model_name
from .words import floor_name

TOLD_APART = "0.55"
NAMES = {
    "pga": "PGA",
    "pgv": "PGV",
    "pgd": "PGD",
    "arias": "Arias intensity",
    "cav": "CAV",
    "housner_intensity": "Housner intensity",
    "pga_normalised": "PGA/(g tan α)",
    "pgv_normalised": "p·PGV/(g tan α)",
    "scale": "scale factor",
}


def measure_name(label: str) -> str:
    """A measure as people write it."""
    if label.startswith("ground_"):
        return f"{measure_name(label.removeprefix('ground_'))}, ground"
    return NAMES.get(label, label)


def ranking(found: xr.Dataset, ax: Axes | None = None, order: list[str] | None = None) -> Axes:
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
        ax = plt.figure(figsize=(6.0, 0.28 * found.sizes["measure"] + 1.3), layout="constrained").add_subplot()
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
        colour = TOLD_APART if worse else COLOURS[0]
        low, high = (one[f"amplitude_dispersion_{end}"].item() for end in ("lower", "upper"))
        ax.plot([low, high], [at, at], color=colour, lw=1.6, solid_capstyle="butt")
        ax.plot(value, at, "o", ms=6.0, color=colour, mfc="white" if worse else colour, mew=1.4)
    ax.set_yticks(y, [_root(one) for one in (here.isel(measure=i) for i in range(y.size))])
    ax.set_ylim(y[-1] + 0.6, -0.6)
    ax.set_xlim(0.0, _largest(here))
    ax.set_xlabel("dispersion of the capacity")
    _bare(ax)
    return ax


def _root(one: xr.Dataset) -> str:
    """A measure in the form in which it grows with the motion."""
    name = measure_name(str(one["measure"].item()))
    return f"√({name})" if float(one["power"]) == 2.0 else name


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
    label = str(found["block"].values[0]) if block is None else block
    here = found.sel(block=label)
    where = label
    if "floor" in here.dims:
        if floor is None:
            raise ValueError(f"results are of several floors, say which: {', '.join(map(str, here['floor'].values))}")
        here = here.sel(floor=floor)
        where = f"{label}, {floor_name(floor)}"
    laws = here.sizes["model"]
    columns = 2 if laws == 4 else min(PANEL_COLUMNS, laws)
    rows = math.ceil(laws / columns)
    height = 0.24 * here.sizes["measure"] + 0.75
    figure = plt.figure(figsize=(3.2 * columns + 1.6, height * rows + 1.0), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, sharey=True, sharex=True)
    order = by_rank(here)
    for i, ax in enumerate(axes.flat):
        if i >= laws:
            ax.remove()
            continue
        one = here.isel(model=i)
        ranking(one, ax, order)
        ax.set_xlim(0.0, _largest(here))
        ax.set_title(model_name(str(one["model"].item())), fontsize=10)
        ax.label_outer(remove_inner_ticks=False)
        ax.set_xlabel("dispersion of the capacity" if i + columns >= laws else "")
        ax.tick_params(labelbottom=True)
    percent = f"{100.0 * float(found.attrs['confidence']):g} %"
    figure.suptitle(
        f"{where}: scatter of the capacity in each intensity measure\n"
        f"{found.attrs['motions']} motions, {percent} bootstrap intervals; "
        "full dots: not told from the best by paired differences",
        fontsize=10,
    )
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
        ax = plt.figure(figsize=(6.0, 0.28 * found.sizes["measure"] + 1.3), layout="constrained").add_subplot()
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
    _bare(ax)
    return ax


def _single(found: xr.Dataset, name: str) -> None:
    if found[name].dims != ("measure",):
        raise ValueError(f"one block and one law are drawn, got {dict(found[name].sizes)}: select them")


def _bare(ax: Axes) -> None:
    ax.grid(axis="x", alpha=0.25, lw=0.6)
    ax.tick_params(axis="y", length=0.0)
    ax.spines[["top", "right", "left"]].set_visible(False)
