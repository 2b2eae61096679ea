"""Figures of a performance assessment: overturned pieces and their value, by floor and level, and annual rates."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from ...core import checks
from ...core.aliases import Array
from ...core.wording import counted, currency_of, percent, short_digits
from ...fragility.runs.provenance import number_of_motions
from ...motions.arrays import POLARITY
from ..tables.assessment import fallen_word, pieces_at, place_name
from ..text.words import display_unit, level_name
from . import axes, selection
from .anchoring import bars, ranking_in, remainder

ALONE = "#000000"
BUILDING = "building"
QUANTITIES = ("number", "loss", "downtime")
VIEWS = ("levels", "exceedance", "anchoring", "left")
NEVER = 1e-12
"""A rate below every logarithmic axis, and a loss to the left of it."""
MOST_BANDS = 3
"""Number of laws up to which one panel shows their spread over motions."""


def inventory(
    results: xr.Dataset,
    ax: Axes | None = None,
    *,
    view: str = "levels",
    quantity: str | None = None,
    place: str | None = None,
    model: str | None = None,
    color: str | None = None,
) -> Axes:
    """Draw the overturning of an inventory: by level, by annual rate, or by what anchoring saves.

    Parameters
    ----------
    results : xarray.Dataset
        A performance study's results, or the dataset that `toppling.studies.assess` returns; for the last two views
        also the dataset that `toppling.studies.anchoring` returns.
    view : {"levels", "exceedance", "anchoring", "left"}
        Mean and quantiles against the level; annual rates of exceedance; what anchoring each item saves; what is left
        as the items are anchored one by one.
    quantity : {"number", "loss", "downtime"}, optional
        Pieces, value (or cost) or the longest downtime, for the first two views; by default pieces against the level,
        and value (where there is any) for annual rates.
    place : str, optional
        ``building``, or a floor as the results call it (``floor 2``).  By default the building; for exceedance under
        one law the building and every floor.
    ax, model, color : optional
        As for `fragility`.

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    ValueError
        The results do not hold what the view shows (no levels, a loss where nothing has a value, no hazard curve, no
        ranking), or there is no such view, quantity, place or law.

    Notes
    -----
    The exceedance curve is drawn as a step function.  Between two thresholds of value the rate is at most the rate at
    the lower threshold, which is drawn.  The curve begins with the rate at which anything overturns, and falls to the
    axis at the greatest value (or number) that any motion overturns.
    """
    checks.choice("view", view, VIEWS)
    alone = ax is None
    if view in ("anchoring", "left"):
        ranking = ranking_in(results)
        laws = selection.laws(ranking, model, color)
        ax = ax or axes.new(6.4, max(3.0, 0.3 * ranking.sizes["item"] + 1.4) if view == "anchoring" else 4.0)
        (bars if view == "anchoring" else remainder)(ranking, laws, ax)
        if alone:  # (bars become shorter downwards and leave room for a legend)
            axes.own_legend(ax, "lower right" if view == "anchoring" else "best")
        return ax
    have = [name for name in QUANTITIES if f"{name}_mean" in results]
    if not have:
        raise ValueError("a figure of an inventory needs an assessment: a performance study, or what assess returns")
    usual = "loss" if view == "exceedance" and "loss" in have else "number"
    chosen = checks.choice("quantity", quantity or usual, have)
    places = [str(one) for one in results["place"].values]
    if place is not None:
        checks.choice("place", place, places)
    laws = selection.laws(results, model, color)
    ax = ax or axes.new(6.4, 4.4)
    if view == "levels":
        _levels(results, laws, chosen, place or BUILDING, ax)
    else:
        _exceedance(results, laws, chosen, place, ax)
    if alone:
        axes.own_legend(ax)
    return ax


def _levels(results: xr.Dataset, laws: list[selection.DrawnLaw], quantity: str, place: str, ax: Axes) -> None:
    """Draw the means of one place with their intervals, and the spread over motions."""
    if results.sizes["level"] < 2:
        raise ValueError("a figure by level needs several levels, got one")
    scale, unit = display_unit(results["level"])
    x = results["level"].values / scale
    shares = results["quantile"].values
    sure = percent(float(results.attrs["confidence"]))
    single = selection.labels(results, "model") == [laws[0].label] or results.sizes.get("model", 1) == 1
    for law in laws:
        one = law.results.sel(place=place)
        colour = ALONE if single else law.colour
        band = axes.COLOURS[0] if single else law.colour
        quantile = one[f"{quantity}_quantile"].values
        if shares.size > 1 and len(laws) <= MOST_BANDS:
            ends = f"{100 * shares[0]:g}–{100 * shares[-1]:g} % of motions"
            low, high = quantile[:, 0], quantile[:, -1]
            text = ends if single else None
            ax.fill_between(x, low, high, color=band, alpha=0.18 if len(laws) == 1 else 0.08, lw=0.0, label=text)
            if len(laws) > 1:
                for end in (low, high):
                    ax.plot(x, end, color=band, lw=0.7, ls=law.line)
        for i in np.flatnonzero(np.isclose(shares, 0.5)) if len(laws) == 1 else ():
            ax.plot(x, quantile[:, i], color=band, lw=1.4, ls=(0, (4, 2)), label="median")
        mean, lower, upper = (one[f"{quantity}_mean{end}"].values for end in ("", "_lower", "_upper"))
        errors = np.nan_to_num(np.maximum(np.stack([mean - lower, upper - mean]), 0.0))
        label = f"mean, with its {sure} interval" if single else law.label
        line = "solid" if single else law.line
        style: dict[str, Any] = {"ms": 3.5, "lw": 1.5, "elinewidth": 0.9, "ls": line, "color": colour}
        ax.errorbar(x, mean, yerr=errors, marker=law.marker, label=label, **style)
    pieces = pieces_at(results, place)
    free = f"{pieces} piece{'s' if pieces != 1 else ''}"
    top = float(pieces)
    if quantity == "number":
        ax.set_ylabel(f"pieces {fallen_word(results)}")
        ax.yaxis.set_major_locator(axes.round_ticks(5, whole=True))
    else:
        ax.set_ylabel(_with_unit(results, quantity))
        ax.yaxis.set_major_locator(axes.round_ticks(5))
        ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: short_digits(value)))
        if quantity == "loss":
            top = _value(results, place)
            free = f"{short_digits(top)}\u00a0{currency_of(results)}".strip()
        if _is_drawn(results, quantity):  # (without a greatest value)
            shown = results[f"{quantity}_quantile"], results[f"{quantity}_mean_upper"]
            top = max(0.0, *(float(one.sel(place=place).max()) for one in shown))
    ax.set_ylim(-0.03 * top, 1.06 * top if top > 0.0 else 1.0)
    log = axes.log_spaced(x)
    name = f"{level_name(results)}{f' ({unit})' if unit else ''}"
    axes.level_axis(ax, float(x[0]) / 1.06, float(x[-1]) * 1.06, log, name)
    # (a title may extend over the numbers beside the axis, but those of a loss are so long that the axis is short)
    room = axes.width_of(ax) + (0.0 if quantity == "loss" else 0.5)
    ax.set_title(axes.wrapped(f"{place_name(place)}: {free} not anchored", room), fontsize=10)
    axes.grid(ax)


def _exceedance(
    results: xr.Dataset, laws: list[selection.DrawnLaw], quantity: str, place: str | None, ax: Axes
) -> None:
    """Draw annual rates of exceedance: under one law for several places, or of one place under several laws."""
    if f"{quantity}_rate" not in results:
        raise ValueError("a curve of annual rates needs an assessment with a hazard curve, got one without")
    places = [str(one) for one in results["place"].values]
    if len(laws) > 1 or place is not None:
        lines = [(place or BUILDING, law.label, law.results, law.colour, law.line, True) for law in laws]
    else:
        here = laws[0].results
        # (a single floor is the same as the building)
        lines = [(BUILDING, BUILDING, here, ALONE, "solid", True)]
        for i, floor in enumerate(places[1:] if len(places) > 2 else []):
            colour, _, line = axes.look(i)
            lines.append((floor, place_name(floor), here, colour, line, False))
    x = results[f"{quantity}_threshold"].values
    sure = percent(float(results.attrs["confidence"]))
    ends: list[float] = []
    edges: list[float] = []
    for where, label, here, colour, line, band in lines:
        one = here.sel(place=where)
        rate, low, high = (one[f"{quantity}_rate{end}"].values for end in ("", "_lower", "_upper"))
        if not (rate > 0.0).any():
            continue
        most = _value(here, where) if quantity == "loss" else float(pieces_at(here, where))
        if _is_drawn(results, quantity):
            most = 1.05 * float(x[-1])
        at, rate, low, high = _step_points(x, quantity, most, rate, low, high)
        shown = rate[:-1]
        ends += [float(shown.min()), float(np.fmax(shown, high[:-1]).max())]
        edges += [*x[x > 0.0][:1], float(at[-1])]
        if band:
            # a lower end of zero lies below every logarithmic axis
            bottom = np.where(low > 0.0, low, NEVER)
            text = f"{sure} interval" if band and colour == ALONE else None
            ax.fill_between(at[:-1], bottom[:-1], high[:-1], color=colour, alpha=0.18, lw=0.0, label=text)
        ax.plot(at, rate, label=label, color=colour, ls=line, lw=2.0 if band else 1.3)
    ax.set_yscale("log")
    if ends:  # whole decades, since few curves span more than two
        ax.set_ylim(10.0 ** math.floor(math.log10(0.9 * min(ends))), 10.0 ** math.ceil(math.log10(1.1 * max(ends))))
    else:
        ax.annotate("nothing overturns", (0.5, 0.5), xycoords="axes fraction", ha="center", fontsize=9, color="0.4")
    if quantity != "number":
        ax.set_xscale("log")
        axes.plain_log(ax)
        if edges:
            ax.set_xlim(0.7 * min(edges), 1.4 * max(edges))
        ax.set_xlabel(axes.wrapped(_with_unit(results, quantity, ", more than"), axes.width_of(ax)))
    else:
        ax.xaxis.set_major_locator(axes.round_ticks(8, whole=True))
        ax.set_xlabel(axes.wrapped(f"pieces {fallen_word(results)}, at least", axes.width_of(ax)))
    ax.set_ylabel("annual rate (1/year)")
    axes.grid(ax)
    if len(laws) == 1:
        expected = float(laws[0].results[f"annual_{quantity}"].sel(place=place or BUILDING))
        amount = {
            "number": f"{expected:.3g} pieces",
            "loss": f"{short_digits(expected)} {currency_of(results)}".strip(),
            "downtime": f"{expected:.2g} days",
        }[quantity]
        of = f"{laws[0].label}\n" if results.sizes.get("model", 1) > 1 else ""
        ax.set_title(axes.wrapped(f"{of}{amount} a year expected", axes.width_of(ax)), fontsize=10)


def _step_points(x: Array, quantity: str, most: float, *values: Array) -> tuple[Array, ...]:
    """Return points of a step curve: "n or more" from n - 1 to n, "more than x" to the next threshold; then `NEVER`."""
    last = int(np.flatnonzero(values[0] > 0.0)[-1]) + 1
    if quantity == "number":
        at = np.repeat(np.concatenate([[0.0], x[:last]]), 2)[1:]
    else:
        ends = np.append(x[1 : last + 1], most)[:last]
        ends[-1] = min(ends[-1], most)
        # (a threshold of 0 lies to the left of every logarithmic axis)
        at = np.repeat(np.concatenate([[x[0] if x[0] > 0.0 else NEVER], ends]), 2)[1:]
    return at, *(np.append(np.repeat(one[:last], 2), NEVER) for one in values)


def levels_figure(results: xr.Dataset, quantity: str = "number") -> Figure:
    """Return the figure of what overturns against the level: a panel for the building and each floor, all laws."""
    places = [str(place) for place in results["place"].values]
    if len(places) == 2:  # a single floor is the same as the building
        places = places[1:]
    figure, panels, columns = axes.panel_grid(len(places), (2.8, 2.7), (0.0, 1.3), 6.0)
    for i, (ax, place) in enumerate(zip(panels, places, strict=True)):
        inventory(results, ax, quantity=quantity, place=place)
        axes.outer_labels(ax, i, columns, len(places), ticks=False)
    axes.legend_below(figure, *panels[0].get_legend_handles_labels())
    what = _name(results, quantity)
    laws = selection.laws(results)
    text = f"{what} under {_motions(results)}"
    if len(laws) == 1:
        text += f", {laws[0].label}" if laws[0].label else ""
    else:
        text += f"; thick: means with {percent(float(results.attrs['confidence']))} intervals"
        shares = results["quantile"].values
        if shares.size > 1 and len(laws) <= MOST_BANDS:
            text += f", thin: {100 * shares[0]:g} and {100 * shares[-1]:g} % of motions"
    axes.heading(figure, str(results.attrs.get("title", "Assessment")), text)
    return figure


def exceedance_figure(results: xr.Dataset, quantity: str = "loss") -> Figure:
    """Return the figure of annual rates at which a loss (or a number of pieces) is exceeded, a panel for each law."""
    laws = selection.labels(results, "model")
    each, beside = ((0.0, 3.6), (6.6, 1.2)) if axes.columns_for(len(laws)) == 1 else ((2.7, 3.2), (0.6, 1.2))
    figure, panels, columns = axes.panel_grid(len(laws), each, beside, shared=True)
    ends = []
    for i, (ax, law) in enumerate(zip(panels, laws, strict=True)):
        inventory(results, ax, view="exceedance", quantity=quantity, model=law or None)
        ends.append(ax.get_ylim())
        axes.outer_labels(ax, i, columns, len(laws))
    bottoms, tops = zip(*ends, strict=True)
    panels[0].set_ylim(min(bottoms), max(tops))
    for i, ax in enumerate(panels):
        if i % columns == columns - 1 or ax is panels[-1]:
            years = ax.secondary_yaxis("right", functions=(axes.inverse, axes.inverse))
            years.set_ylabel("return period (years)")
            years.yaxis.set_minor_formatter(NullFormatter())
            years.yaxis.set_major_formatter(FuncFormatter(lambda value, _: short_digits(value)))
    axes.legend_below(figure, *panels[0].get_legend_handles_labels())
    alone = fallen_word(results) == "overturned"
    verb = "overturns" if alone else "falls"
    what = {
        "number": f"so many pieces or more {'overturn' if alone else 'fall'}",
        "loss": f"what {verb} costs more" if _is_drawn(results, "loss") else f"more than so much value {verb}",
        "downtime": "something is out of use for longer",
    }[quantity]
    text = f"how often a year {what}, {_motions(results)}"
    text += f"; {selection.laws(results)[0].label}" if len(laws) == 1 else ""
    axes.heading(figure, str(results.attrs.get("title", "Assessment")), text)
    return figure


def _motions(results: xr.Dataset) -> str:
    """Return the number of motions in words, and whether they were run both ways."""
    ways = " both ways" if POLARITY in results.coords else ""
    return f"{counted(number_of_motions(results), 'motion')}{ways}"


def _value(here: xr.Dataset, place: str) -> float:
    """Return the value of the pieces that are not anchored, in the building or on one floor."""
    free = ~here["anchored"].values.astype(bool)
    if place.startswith("floor "):
        free &= here["floor"].values == place.removeprefix("floor ")
    return float((here["value"].values * here["count"].values)[free].sum())


def _is_drawn(here: xr.Dataset, quantity: str) -> bool:
    """Return whether a quantity is drawn from distributions, so that it has no greatest value."""
    return quantity == "downtime" or (quantity == "loss" and "cost_median" in here.coords)


def _name(here: xr.Dataset, quantity: str) -> str:
    fallen = fallen_word(here)
    what = f"of what {fallen if fallen == 'overturned' else 'fell'}"
    return {
        "number": f"pieces {fallen}",
        "loss": f"cost {what}" if _is_drawn(here, "loss") else f"value {fallen}",
        "downtime": f"longest downtime {what}",
    }[quantity]


def _with_unit(here: xr.Dataset, quantity: str, text: str = "") -> str:
    """Return the name of a quantity with its unit, for an axis."""
    unit = "days" if quantity == "downtime" else currency_of(here)
    return f"{_name(here, quantity)}{text}{f' ({unit})' if unit else ''}"
