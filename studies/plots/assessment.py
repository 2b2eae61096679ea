"""Figures of a performance assessment: overturned pieces and value by level and annual rate, savings from anchoring."""

import math
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from ...core import checks
from ...core.aliases import Array
from ...core.units import ENDS
from ...core.wording import counted, currency_of, percent, short_digits
from ..buildings.pieces import SORTS, pieces_of
from ..tables.assessment import MARK, MARKED, doubtful_items, fallen_word, objective_unit, pieces_at, place_name
from ..text.words import display_unit, level_name, reference_law
from . import axes, selection

BUILDING = "building"
QUANTITIES = ("number", "loss", "downtime")
VIEWS = ("levels", "exceedance", "anchoring", "left")
NEVER = 1e-12
"""A rate below every logarithmic axis, and a loss to the left of it."""
MOST_BANDS = 3
"""Number of laws up to which one panel shows their spread over motions."""
MARKED_YEARS = (100, 500, 1000)
"""Return periods whose losses are marked on the curve of the building, years."""


@axes.drawing
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
    """Draw the overturning of an inventory by level or annual rate, or the effect of anchoring.

    The exceedance curve is a step function.  Between two thresholds of value it has the rate of the lower threshold,
    which is not less than the true rate.

    Parameters
    ----------
    results : xarray.Dataset
        A performance study's results, or a result of `toppling.studies.assess` or `toppling.studies.anchoring`.
    view : {"levels", "exceedance", "anchoring", "left"}
        Mean and quantiles by level; annual rates of exceedance; savings from anchoring each item; the remainder as the
        items are anchored one by one.
    quantity : {"number", "loss", "downtime"}, optional
        Pieces, value (or cost) or the longest downtime, for the first two views; by default pieces by level, and value
        (if there is any) for annual rates.
    place : str, optional
        ``building``, or a floor as in the results (``floor 2``).  By default the building; for exceedance under one law
        the building and every floor.
    """
    checks.choice("view", view, VIEWS)
    checks.plain("results", results)
    alone = ax is None
    if view in ("anchoring", "left"):
        ranking = ranking_in(results)
        laws = selection.laws(ranking, model, color)
        ax = ax or axes.new(max(3.0, 0.3 * ranking.sizes["block"] + 1.4) if view == "anchoring" else 4.0)
        (bars if view == "anchoring" else remainder)(ranking, laws, ax)
        if alone:  # (bars become shorter downwards and leave room for a legend)
            axes.own_legend(ax, "lower right" if view == "anchoring" else "best")
        return ax
    have = [name for name in QUANTITIES if f"{name}_mean" in results]
    if not have:
        raise ValueError("a figure of an inventory needs an assessment: a performance study, or what assess returns")
    usual = "loss" if view == "exceedance" and "loss" in have else "number"
    chosen = checks.choice("quantity", quantity or usual, have)
    if place is not None:
        checks.choice("place", place, [str(text) for text in results["place"].values])
    laws = selection.laws(results, model, color)
    ax = ax or axes.new()
    (_levels if view == "levels" else _exceedance)(results, laws, chosen, place, ax)
    if alone:
        axes.own_legend(ax)
    return ax


def _levels(results: xr.Dataset, laws: list[selection.DrawnLaw], quantity: str, place: str | None, ax: Axes) -> None:
    """Draw the means of one place with their intervals, and the spread over motions."""
    if results.sizes["level"] < 2:
        raise ValueError("a figure by level needs several levels, got one")
    place = place or BUILDING
    scale, unit = display_unit(results["level"])
    x = results["level"].values / scale
    shares = results["quantile"].values
    single = len(laws) == 1
    for law in laws:
        at_place = law.results.sel(place=place)
        band = axes.COLOURS[0] if single else law.colour
        quantile = at_place[f"{quantity}_quantile"].values
        if shares.size > 1 and len(laws) <= MOST_BANDS:
            text = f"{100 * shares[0]:g}–{100 * shares[-1]:g}\u00a0% of motions" if single else None
            alpha = 0.18 if single else 0.08
            ax.fill_between(x, quantile[:, 0], quantile[:, -1], color=band, alpha=alpha, lw=0.0, label=text)
            if not single:
                ax.plot(x, quantile[:, [0, -1]], color=band, lw=0.7, ls=law.line)
        mean, lower, upper = (at_place[f"{quantity}_mean{end}"].values for end in ENDS)
        errors = np.nan_to_num(np.maximum(np.stack([mean - lower, upper - mean]), 0.0))
        style: dict[str, Any] = {"ms": 3.5, "lw": 1.5, "elinewidth": 0.9, "ls": "solid" if single else law.line}
        text = "mean" if single else law.label
        ax.errorbar(x, mean, yerr=errors, marker=law.marker, label=text, color=law.colour, **style)
    pieces = pieces_at(results, place)
    free, top = counted(pieces, "piece"), float(pieces)
    ax.yaxis.set_major_locator(axes.round_ticks(5, whole=quantity == "number"))
    if quantity != "number":
        ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: short_digits(value)))
        if quantity == "loss":
            top = _value(results, place)
            free = f"{short_digits(top)}\u00a0{currency_of(results)}".strip()
        if _is_drawn(results, quantity):  # without a maximum
            ends = results[f"{quantity}_quantile"], results[f"{quantity}_mean_upper"]
            top = max(0.0, *(float(end.sel(place=place).max()) for end in ends))
    ax.set_ylim(-0.03 * top, 1.06 * top if top > 0.0 else 1.0)
    name = f"{level_name(results)}{f' ({unit})' if unit else ''}"
    axes.level_axis(ax, float(x[0]) / 1.06, float(x[-1]) * 1.06, axes.log_spaced(x), name)
    axes.label(ax, y=_with_unit(results, quantity))
    axes.name(ax, axes.sentence(f"{place_name(place)}: {free} not anchored"))


def _exceedance(
    results: xr.Dataset, laws: list[selection.DrawnLaw], quantity: str, place: str | None, ax: Axes
) -> None:
    """Draw annual rates of exceedance: under one law for several places, or of one place under several laws."""
    if f"{quantity}_rate" not in results:
        raise ValueError("a curve of annual rates needs an assessment with a hazard curve, got one without")
    if len(laws) > 1 or place is not None:
        lines = [(place or BUILDING, law.label, law.results, law.colour, law.line) for law in laws]
    else:  # (a single floor is the same as the building)
        floors = [str(floor) for floor in results["place"].values[1:]]
        of_law, (black, _, _) = laws[0].results, axes.REFERENCE
        lines = [(BUILDING, BUILDING, of_law, black, "solid")]
        looks = [axes.look(i + i // 3) for i in range(len(floors))]  # (without the building's black)
        lines += [
            (floor, place_name(floor), of_law, colour, line)
            for floor, (colour, _, line) in zip(floors if len(floors) > 1 else [], looks, strict=False)
        ]
    x = results[f"{quantity}_threshold"].values
    ends: list[float] = []
    edges: list[float] = []
    for k, (where, label, drawn, colour, line) in enumerate(lines):
        of_law = drawn.sel(place=where)
        rate, low, high = (of_law[f"{quantity}_rate{end}"].values for end in ENDS)
        if not (rate > 0.0).any():
            continue
        most = _value(of_law, where) if quantity == "loss" else float(pieces_at(of_law, where))
        if _is_drawn(results, quantity):
            most = 1.05 * float(x[-1])
        at, rate, low, high = _step_points(x, quantity, most, rate, low, high)
        ends += [float(rate[:-1].min()), float(np.fmax(rate[:-1], high[:-1]).max())]
        edges += [*x[x > 0.0][:1], float(at[-1])]
        band = where == lines[0][0]
        if band:  # (a lower end of zero lies below every logarithmic axis)
            bottom = np.where(low > 0.0, low, NEVER)
            ax.fill_between(at[:-1], bottom[:-1], high[:-1], color=colour, alpha=0.18, lw=0.0)
        ax.plot(at, rate, label=label, color=colour, ls=line, lw=2.0 if band else 1.3)
        for years in MARKED_YEARS if k == 0 and quantity != "number" else ():
            if rate[:-1].min() < 1.0 / years < rate[0]:
                amount = float(at[np.flatnonzero(rate >= 1.0 / years)[-1]])
                ax.plot(amount, 1.0 / years, "o", color=colour, ms=5.0)
                text = f"{short_digits(amount)}"
                ax.annotate(text, (amount, 1.0 / years), (5, 3), textcoords="offset points")
    ax.set_yscale("log")
    if ends:  # whole decades, since few curves span more than two
        ax.set_ylim(10.0 ** math.floor(math.log10(0.9 * min(ends))), 10.0 ** math.ceil(math.log10(1.1 * max(ends))))
    else:
        ax.annotate("nothing overturns", (0.5, 0.5), xycoords="axes fraction", ha="center", color="0.4")
    if quantity != "number":
        ax.set_xscale("log")
        axes.plain_log(ax)
        if edges:
            ax.set_xlim(0.7 * min(edges), 1.4 * max(edges))
    else:
        ax.xaxis.set_major_locator(axes.round_ticks(8, whole=True))
    what = {"number": "number of pieces", "loss": "loss", "downtime": "downtime"}[quantity]
    verb = "reaching" if quantity == "number" else "exceeding"
    axes.label(ax, _with_unit(results, quantity), f"annual rate of {verb} a {what}")
    if len(laws) == 1:
        expected = float(laws[0].results[f"annual_{quantity}"].sel(place=place or BUILDING))
        text = {
            "number": f"{expected:.3g} pieces",
            "loss": f"{short_digits(expected)} {currency_of(results)}".strip(),
            "downtime": f"{expected:.2g} days",
        }[quantity]
        axes.name(ax, f"Expected: {text} per year")


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
    return at, *(np.append(np.repeat(value[:last], 2), NEVER) for value in values)


@axes.style()
def levels_figure(results: xr.Dataset, quantity: str = "number") -> Figure:
    """Return the figure of the overturning in the building by level, under all laws."""
    ax = inventory(results, axes.new(3.6), quantity=quantity)
    shares = results["quantile"].values
    notes = [f"bars: {percent(float(results.attrs['confidence']))} intervals"]
    if shares.size > 1 and results.sizes.get("model", 1) <= MOST_BANDS:
        notes.append(f"bands: {100 * shares[0]:g}–{100 * shares[-1]:g} % of motions")
    return _headed(results, ax, f"{_name(results, quantity)} by intensity level", *notes)


@axes.style()
def exceedance_figure(results: xr.Dataset, quantity: str = "loss") -> Figure:
    """Return the figure of annual rates of exceeding a loss (or a number of pieces), under all laws."""
    ax = inventory(results, axes.new(3.8), view="exceedance", quantity=quantity)
    axes.years(ax, "right")
    title = {"number": "Annual rate of falling pieces", "loss": "Annual rate of exceeding a loss"}
    notes = [f"band: {percent(float(results.attrs['confidence']))} interval"]
    if quantity != "number":
        notes.append(f"dots: exceeded once in {', '.join(map(str, MARKED_YEARS[:-1]))} and {MARKED_YEARS[-1]:,} years")
    return _headed(results, ax, title.get(quantity, "Annual rate of exceeding a downtime"), *notes)


def _headed(results: xr.Dataset, ax: Axes, title: str, *notes: str) -> Figure:
    """Return the figure of one panel, with notes on motions and law."""
    laws = selection.laws(results)
    law = f", {laws[0].label}" if len(laws) == 1 and laws[0].label else ""
    return axes.alone(ax, title, f"{selection.motions(results)}{law}", *notes)


def _value(results: xr.Dataset, place: str) -> float:
    """Return the value of the pieces that are not anchored, in the building or on one floor."""
    free = ~results["anchored"].values.astype(bool)
    if place.startswith("floor "):
        free &= results["floor"].values == place.removeprefix("floor ")
    return float((results["value"].values * results["count"].values)[free].sum())


def _is_drawn(results: xr.Dataset, quantity: str) -> bool:
    """Return True if a quantity is drawn from distributions, so that it has no largest value."""
    return quantity == "downtime" or (quantity == "loss" and "cost_median" in results.coords)


def _name(results: xr.Dataset, quantity: str) -> str:
    fallen = fallen_word(results)
    return {
        "number": f"{fallen} pieces",
        "loss": f"cost of {fallen} pieces" if _is_drawn(results, "loss") else f"{fallen} value",
        "downtime": "longest downtime",
    }[quantity]


def _with_unit(results: xr.Dataset, quantity: str) -> str:
    """Return the name of a quantity with its unit, for an axis."""
    unit = {"number": "", "downtime": "days"}.get(quantity, currency_of(results))
    return f"{_name(results, quantity)}{f' ({unit})' if unit else ''}"


MOST_BARS = 20
PLACE = "advised_place"
"""Coordinate of a study's ranking with the place of each item among the recommendations."""


def ranking_in(results: xr.Dataset) -> xr.Dataset:
    """Return a ranking of anchoring as it is, or the ranking that a performance study's results contain."""
    if "saving" in results:
        return results
    if "ranking" in results.attrs and "place" in results.dims:
        # (that module reads study files, which a ranking that `anchoring` returned does not need)
        from ..buildings.pieces import ranking_of  # noqa: PLC0415

        ranking = ranking_of(results)
        advised = [piece.item for piece in pieces_of(results.assign_attrs(sort=SORTS[0]), reference_law(results)[0])]
        return ranking.assign_coords({PLACE: ("block", [advised.index(str(item)) for item in ranking["block"].values])})
    raise ValueError("a figure of anchoring needs a ranking: a performance study, or what anchoring returns")


def order_of(ranking: xr.Dataset) -> list[int]:
    """Return the positions of the items as the table of pieces advises, of a ranking alone by its mean rank."""
    if PLACE in ranking.coords:
        place = ranking[PLACE].values
    else:
        place = ranking["rank"].transpose(..., "block").values.reshape(-1, ranking.sizes["block"]).mean(axis=0)
    return [int(i) for i in np.argsort(place, kind="stable")[:MOST_BARS]]


def _objective(ranking: xr.Dataset) -> tuple[float, str, str]:
    """Return the factor to the unit of the objective, its name, and its unit in brackets."""
    scale, unit = objective_unit(ranking)
    return scale, str(ranking.attrs["objective_text"]), f" ({unit})" if unit else ""


def bars(ranking: xr.Dataset, laws: list[selection.DrawnLaw], ax: Axes) -> Axes:
    """Draw the savings from anchoring each item: the first item on top, a bar for each law, with intervals."""
    order = order_of(ranking)
    scale, objective, unit = _objective(ranking)
    high = 0.78 / len(laws)
    for i, law in enumerate(laws):
        ordered = law.results.isel(block=order)
        saving, lower, upper = (ordered[f"saving{end}"].values * scale for end in ENDS)
        y = np.arange(len(order)) + high * (i - 0.5 * (len(laws) - 1))
        # (a black interval could not be seen on a black bar)
        colour = axes.GREY if law.colour == axes.REFERENCE[0] else law.colour
        label = "anchored alone" if len(laws) == 1 else law.label
        ax.barh(y, saving, color=colour, height=0.9 * high, label=label)
        alone = ordered["alone"].values * scale
        if len(laws) == 1 and not np.allclose(alone, saving, rtol=1e-6, atol=0.0):
            ax.barh(y, alone, fc="none", ec="0.45", height=0.9 * high, label="anchored last", zorder=0)
        errors = np.nan_to_num(np.maximum(np.stack([saving - lower, upper - saving]), 0.0))
        ax.errorbar(saving, y, xerr=errors, fmt=law.marker, ms=3.5, color="0.1", lw=1.0)
    doubtful = doubtful_items(ranking)
    places = [place_name(f"floor {ranking['floor'].values[i]}").replace(" ", "\u00a0") for i in order]
    names = [
        f"{ranking['block'].values[i]} ({place}){f' {MARK}' if doubtful[i] else ''}"
        for i, place in zip(order, places, strict=True)
    ]
    axes.named_rows(ax, names, 0.55)
    ax.set_xlim(left=0.0)
    ax.xaxis.set_major_locator(axes.round_ticks(5))
    return axes.label(ax, f"reduction of the {objective}{unit}", along="x")


def remainder(ranking: xr.Dataset, laws: list[selection.DrawnLaw], ax: Axes) -> Axes:
    """Draw the remainder as items are anchored one by one, with intervals; against the cost if ranked by it."""
    scale, objective, unit = _objective(ranking)
    paid = bool(ranking.attrs["per_cost"])
    last = 0.0
    for law in laws:
        steps = law.results
        step = steps["total_cost"].values if paid else ranking["step"].values
        last = max(last, float(step[-1]))
        amount, *ends = (steps[f"left{end}"].values * scale for end in ENDS)
        low, high = (np.where(np.isfinite(end), end, amount) for end in ends)
        ax.fill_between(step, low, high, color=law.colour, alpha=0.15, lw=0.0)
        ax.plot(step, amount, ms=3.5, lw=1.5, label=law.label or None, color=law.colour, marker=law.marker, ls=law.line)
    ax.set_ylim(bottom=0.0)
    ax.set_xlim(-0.02 * last, 1.02 * last if last > 0.0 else 1.0)
    ax.xaxis.set_major_locator(axes.round_ticks(4 if paid else 7, whole=not paid))
    if paid:
        ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: short_digits(value)))
    ax.yaxis.set_major_locator(axes.round_ticks(5))
    money = currency_of(ranking)
    across = f"cost of anchoring{f' ({money})' if money else ''}" if paid else "anchored items, largest saving first"
    return axes.label(ax, across, f"remaining {objective.replace('expected annual', 'expected')}{unit}")


@axes.style()
def anchoring_figure(results: xr.Dataset) -> Figure:
    """Return the figure of the savings from anchoring each item under every law."""
    ranking = ranking_in(results)
    laws, order = selection.laws(ranking), order_of(ranking)
    height = max(2.2, max(0.3 if axes.has_room() else 0.5, 0.14 * len(laws)) * len(order) + 1.2)
    ax = bars(ranking, laws, axes.new(height))
    by_cost = ranking.attrs["per_cost"] and PLACE not in ranking.coords
    return axes.alone(
        ax,
        "Savings from anchoring",
        "ranked by saving over cost" if by_cost else "",
        f"the first {len(order)} of {ranking.sizes['block']} items" if len(order) < ranking.sizes["block"] else "",
        f"black: {percent(float(ranking.attrs['confidence']))} intervals"
        + (f", {laws[0].label}" if len(laws) == 1 and laws[0].label else ""),
        MARKED if doubtful_items(ranking)[order].any() else "",
    )
