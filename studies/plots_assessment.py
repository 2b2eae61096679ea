"""Figures of a performance assessment: what overturns by floor and level, how often, and what to anchor first."""

from __future__ import annotations

import math
import textwrap
from typing import Any, Literal

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator, NullFormatter

from .. import checks
from .assessment_rows import figure_text, objective_unit, of_model, pieces_at, place_name
from .plots import COLOURS, PANEL_COLUMNS, model_name, plain_log
from .plots_efficiency import measure_name
from .words import display_unit

MEAN, BAND = "#000000", COLOURS[0]
MOST_BARS = 20


def levels_figure(assessment: xr.Dataset, quantity: str = "number", model: str | None = None) -> Figure:
    """What overturns against the level: mean with its interval, median, and a band between the outer quantiles.

    Parameters
    ----------
    assessment : xarray.Dataset
        As `assess` returns it.
    quantity : {"number", "loss"}
        Pieces, or value.
    model : str, optional
        Label of the damping law; the first where not given.

    Returns
    -------
    matplotlib Figure
        A panel for the building and for each floor.

    Raises
    ------
    ValueError
        No such model, a loss where nothing has a value.
    """
    _known(assessment, quantity)
    here = of_model(assessment, model)
    places = [str(place) for place in here["place"].values]
    if len(places) == 2:  # one floor is the building
        places = places[1:]
    columns = min(PANEL_COLUMNS, len(places))
    rows = math.ceil(len(places) / columns)
    figure = plt.figure(figsize=(max(4.0 * columns, 6.0), 3.2 * rows + 1.1), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False)
    for ax, place in zip(axes.flat, places, strict=False):
        _levels(here, quantity, place, ax)
    for ax in list(axes.flat)[len(places) :]:
        ax.remove()
    handles, labels = axes.flat[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, frameon=False, fontsize=9)
    what = "Pieces overturned" if quantity == "number" else "Value overturned"
    motions = here.sizes["motion"]
    figure.suptitle(f"{what} under {motions} motions, {model_name(str(here['model'].item()))}", fontsize=11)
    return figure


def _levels(here: xr.Dataset, quantity: str, place: str, ax: Axes) -> None:
    """One place's panel."""
    one = here.sel(place=place)
    scale, unit = display_unit(here["level"])
    x = here["level"].values / scale
    name = f"{quantity}_quantile"
    probabilities = here["quantile"].values
    if probabilities.size > 1:
        ends = f"{100 * probabilities[0]:g}–{100 * probabilities[-1]:g} % of motions"
        low, high = one[name].values[:, 0], one[name].values[:, -1]
        ax.fill_between(x, low, high, color=BAND, alpha=0.18, lw=0.0, label=ends)
    for i in np.flatnonzero(np.isclose(probabilities, 0.5)):
        ax.plot(x, one[name].values[:, i], color=BAND, lw=1.4, ls=(0, (4, 2)), label="median")
    mean = one[f"{quantity}_mean"].values
    errors = np.stack([mean - one[f"{quantity}_mean_lower"].values, one[f"{quantity}_mean_upper"].values - mean])
    percent = f"{100.0 * float(here.attrs['confidence']):g} %"
    ax.errorbar(
        x,
        mean,
        yerr=np.maximum(errors, 0.0),
        fmt="o-",
        ms=3.0,
        lw=1.4,
        elinewidth=0.9,
        color=MEAN,
        label=f"mean, with its {percent} interval",
    )
    pieces = pieces_at(here, place)
    free = f"{pieces} piece{'s' if pieces != 1 else ''}"
    if quantity == "number":
        ax.set_ylabel("pieces overturned")
        ax.yaxis.set_major_locator(_locator(5, whole=True))
        top = float(pieces)
    else:
        ax.set_ylabel(f"value overturned{_in_money(here)}")
        ax.yaxis.set_major_locator(_locator(5))
        ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: figure_text(value)))
        top = _value(here, place)
        free = f"{figure_text(top)} {_money(here)}".strip()
    ax.set_ylim(-0.03 * top, 1.06 * top if top > 0.0 else 1.0)
    ax.set_xscale("log")
    plain_log(ax)
    ax.set_xlabel(f"{measure_name(str(here['level'].attrs['im']))}{f' ({unit})' if unit else ''} of the ground motion")
    ax.set_title(f"{place_name(place)}: {free} free to fall", fontsize=10)
    _tidy(ax)


def loss_curve_figure(assessment: xr.Dataset, quantity: str = "loss", model: str | None = None) -> Figure:
    """Annual rate at which a loss (or a number of pieces) is exceeded, for the building and each floor.

    Parameters
    ----------
    assessment, quantity, model
        As for `levels_figure`; the assessment needs a hazard curve.

    Returns
    -------
    matplotlib Figure

    Raises
    ------
    ValueError
        An assessment without a hazard curve; as `levels_figure`.
    """
    _known(assessment, quantity)
    if f"{quantity}_rate" not in assessment:
        raise ValueError("a curve of annual rates needs an assessment with a hazard curve, got one without")
    here = of_model(assessment, model)
    x = here[f"{quantity}_threshold"].values
    figure = plt.figure(figsize=(6.6, 4.6), layout="constrained")
    ax = figure.add_subplot()
    places = [str(place) for place in here["place"].values]
    shown = x > 0.0
    percent = f"{100.0 * float(here.attrs['confidence']):g} %"
    smallest, largest = np.inf, 0.0
    # the rate of n pieces or more holds from n - 1 on
    step: Literal["pre"] | None = "pre" if quantity == "number" else None
    for i, place in enumerate(places[:1] if len(places) == 2 else places):
        one = here.sel(place=place)
        rate, low, high = (one[f"{quantity}_rate{end}"].values for end in ("", "_lower", "_upper"))
        seen = shown & (rate > 0.0)
        if not seen.any():
            continue
        smallest = min(smallest, float(rate[seen].min()))
        largest = max(largest, float(np.fmax(rate, high)[seen].max()))
        style: dict[str, Any] = {"lw": 2.0, "color": MEAN}
        if i == 0:
            # an end at zero lies below any axis of logarithms
            bottom = np.where(low > 0.0, low, 1e-12)
            label = f"{percent} interval, {place_name(place)}"
            ax.fill_between(x[seen], bottom[seen], high[seen], color="0.5", alpha=0.25, lw=0.0, step=step, label=label)
        else:
            line = ("-", "--", ":")[(i - 1) // len(COLOURS) % 3]
            style = {"lw": 1.3, "ls": line, "color": COLOURS[(i - 1) % len(COLOURS)]}
        drawn = "default" if step is None else "steps-pre"
        ax.plot(x[seen], rate[seen], label=place_name(place), drawstyle=drawn, **style)
    ax.set_yscale("log")
    if largest > 0.0:  # whole decades: few curves span more than two
        ax.set_ylim(10.0 ** math.floor(math.log10(0.9 * smallest)), 10.0 ** math.ceil(math.log10(1.1 * largest)))
    if quantity == "loss":
        ax.set_xscale("log")
        plain_log(ax)
        ax.set_xlabel(f"value overturned, more than{_in_money(here)}")
    else:
        ax.xaxis.set_major_locator(_locator(8, whole=True))
        ax.set_xlabel("pieces overturned, at least")
    ax.set_ylabel("annual rate")
    years = ax.secondary_yaxis("right", functions=(_inverse, _inverse))
    years.set_ylabel("return period (years)")
    years.yaxis.set_minor_formatter(NullFormatter())
    years.yaxis.set_major_formatter(FuncFormatter(lambda value, _: figure_text(value)))
    _tidy(ax)
    ax.spines["right"].set_visible(True)
    ax.legend(frameon=False, fontsize=9)
    expected = here[f"annual_{quantity}"].sel(place="building")
    amount = (
        f"{figure_text(float(expected))} {_money(here)}".strip()
        if quantity == "loss"
        else f"{float(expected):.3g} pieces"
    )
    ax.set_title(f"{amount} a year expected, {model_name(str(here['model'].item()))}", fontsize=10)
    return figure


def ranking_figure(ranking: xr.Dataset, model: str | None = None) -> Figure:
    """What anchoring each item saves, and what is left when they are anchored one after the other.

    Parameters
    ----------
    ranking : xarray.Dataset
        As `anchoring` returns it.
    model : str, optional
        Label of the damping law; the first where not given.

    Returns
    -------
    matplotlib Figure
        Bars with intervals, the first 20 of them; a curve of what is left.

    Raises
    ------
    ValueError
        No such model.
    """
    here = of_model(ranking, model)
    order = np.argsort(here["rank"].values)[:MOST_BARS]
    n = order.size
    figure = plt.figure(figsize=(9.6, max(3.4, 0.32 * n + 1.6)), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.35, 1.0))
    scale, unit = objective_unit(ranking)
    unit = f" ({unit})" if unit else ""
    saving = here["saving"].values[order] * scale
    errors = np.stack(
        [saving - here["saving_lower"].values[order] * scale, here["saving_upper"].values[order] * scale - saving]
    )
    y = np.arange(n)
    left.barh(y, saving, color=COLOURS[0], alpha=0.85, height=0.7, label="saved by anchoring it alone")
    alone = here["alone"].values[order] * scale
    if not np.allclose(alone, saving, rtol=1e-6, atol=0.0):
        left.barh(y, alone, fc="none", ec="0.45", lw=0.9, height=0.7, label="if it stood alone", zorder=0)
        left.legend(frameon=False, fontsize=9, loc="lower right")
    known = np.isfinite(errors).all(axis=0)
    left.errorbar(saving[known], y[known], xerr=np.maximum(errors[:, known], 0.0), fmt="none", color="0.15", lw=1.0)
    names = [f"{here['item'].values[i]} ({place_name('floor ' + str(here['floor'].values[i]))})" for i in order]
    left.set_yticks(y, [textwrap.fill(name, 36) for name in names], fontsize=9)
    left.invert_yaxis()
    left.set_xlim(left=0.0)
    left.set_xlabel(f"saved{unit}" if unit else "saved")
    left.xaxis.set_major_locator(_locator(5))
    _tidy(left)
    left.grid(axis="y", visible=False)
    amount = here["left"].values * scale
    paid = bool(ranking.attrs["per_cost"])
    step = here["total_cost" if paid else "step"].values
    ends = np.stack([here["left_lower"].values, here["left_upper"].values]) * scale
    ends = np.where(np.isfinite(ends), ends, amount)
    right.fill_between(step, ends[0], ends[1], color=COLOURS[0], alpha=0.18, lw=0.0)
    right.plot(step, amount, "o-", color=COLOURS[0], ms=3.5, lw=1.5)
    right.set_ylim(bottom=0.0)
    right.set_xlim(-0.015 * step[-1], 1.015 * step[-1])
    right.xaxis.set_major_locator(_locator(5 if paid else 8, whole=not paid))
    if paid:
        right.xaxis.set_major_formatter(FuncFormatter(lambda value, _: figure_text(value)))
    right.yaxis.set_major_locator(_locator(5))
    right.set_xlabel(f"spent on anchoring, best first{_in_money(here)}" if paid else "items anchored, best first")
    right.set_ylabel(f"left{unit}")
    _tidy(right)
    percent = f"{100.0 * float(ranking.attrs['confidence']):g} %"
    text = str(ranking.attrs["objective_text"])
    per = ", ranked by saving over cost" if ranking.attrs["per_cost"] else ""
    figure.suptitle(f"{text[0].upper()}{text[1:]}{per}\n{percent} intervals over motions", fontsize=11)
    return figure


def _inverse(value: Any) -> Any:
    with np.errstate(divide="ignore"):
        return 1.0 / np.asarray(value, dtype=float)


def _known(assessment: xr.Dataset, quantity: str) -> None:
    checks.choice("quantity", quantity, [name for name in ("number", "loss") if f"{name}_mean" in assessment])


def _value(here: xr.Dataset, place: str) -> float:
    """Value that can overturn."""
    free = ~here["anchored"].values.astype(bool)
    if place.startswith("floor "):
        free &= here["floor"].values == place.removeprefix("floor ")
    return float((here["value"].values * here["count"].values)[free].sum())


def _money(here: xr.Dataset) -> str:
    return str(here.attrs.get("currency", ""))


def _in_money(here: xr.Dataset) -> str:
    return f" ({_money(here)})" if _money(here) else ""


def _locator(most: int, whole: bool = False) -> MaxNLocator:
    return MaxNLocator(most, integer=whole, steps=[1, 2, 5, 10])


def _tidy(ax: Axes) -> None:
    ax.grid(alpha=0.25, lw=0.6)
    ax.spines[["top", "right"]].set_visible(False)
