"""Figures of the benefit of anchoring: the ranking of items, and the remainder as items are anchored one by one."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from ...core.wording import currency_of, percent, short_digits
from ..buildings.pieces import SORTS, pieces_of
from ..tables.assessment import MARK, MARKED, doubtful_items, objective_unit, place_name
from ..text.words import reference_law
from . import axes, selection

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
        return ranking.assign_coords({PLACE: ("item", [advised.index(str(item)) for item in ranking["item"].values])})
    raise ValueError("a figure of anchoring needs a ranking: a performance study, or what anchoring returns")


def order_of(ranking: xr.Dataset) -> list[int]:
    """Return the positions of the items as the table of pieces advises, of a ranking alone by its mean rank."""
    if PLACE in ranking.coords:
        place = ranking[PLACE].values
    else:
        place = ranking["rank"].transpose(..., "item").values.reshape(-1, ranking.sizes["item"]).mean(axis=0)
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
        here = law.results.isel(item=order)
        saving, lower, upper = (here[f"saving{end}"].values * scale for end in ("", "_lower", "_upper"))
        y = np.arange(len(order)) + high * (i - 0.5 * (len(laws) - 1))
        # (a black interval could not be seen on a black bar)
        colour = axes.GREY if law.colour == axes.REFERENCE[0] else law.colour
        label = "anchored alone" if len(laws) == 1 else law.label
        ax.barh(y, saving, color=colour, height=0.9 * high, label=label)
        alone = here["alone"].values * scale
        if len(laws) == 1 and not np.allclose(alone, saving, rtol=1e-6, atol=0.0):
            ax.barh(y, alone, fc="none", ec="0.45", height=0.9 * high, label="anchored last", zorder=0)
        errors = np.nan_to_num(np.maximum(np.stack([saving - lower, upper - saving]), 0.0))
        ax.errorbar(saving, y, xerr=errors, fmt=law.marker, ms=3.5, color="0.1", lw=1.0)
    doubtful = doubtful_items(ranking)
    places = [place_name(f"floor {ranking['floor'].values[i]}").replace(" ", "\u00a0") for i in order]
    names = [
        f"{ranking['item'].values[i]} ({place}){f' {MARK}' if doubtful[i] else ''}"
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
        here = law.results
        step = here["total_cost"].values if paid else ranking["step"].values
        last = max(last, float(step[-1]))
        amount, *ends = (here[f"left{end}"].values * scale for end in ("", "_lower", "_upper"))
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
        f"the first {len(order)} of {ranking.sizes['item']} items" if len(order) < ranking.sizes["item"] else "",
        f"bars: savings with {percent(float(ranking.attrs['confidence']))} intervals"
        + (f", {laws[0].label}" if len(laws) == 1 and laws[0].label else ""),
        MARKED if doubtful_items(ranking)[order].any() else "",
    )
