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
REFERENCE_BAR = "0.6"


def ranking_in(results: xr.Dataset) -> xr.Dataset:
    """Return a ranking of anchoring as it is, or the ranking that a performance study's results hold."""
    if "saving" in results:
        return results
    if "ranking" in results.attrs and "place" in results.dims:
        # (that module reads study files, which a ranking that `anchoring` returned does not need)
        from ..kinds.performance import ranking_of  # noqa: PLC0415

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


def bars(ranking: xr.Dataset, laws: list[selection.DrawnLaw], ax: Axes) -> Axes:
    """Draw what anchoring each item saves: the best item on top, a bar for each law, with intervals."""
    order = order_of(ranking)
    y = np.arange(len(order))
    scale, unit = objective_unit(ranking)
    high = 0.78 / len(laws)
    sure = percent(float(ranking.attrs["confidence"]))
    for i, law in enumerate(laws):
        one = law.results.isel(item=order)
        saving, lower, upper = (one[f"saving{end}"].values * scale for end in ("", "_lower", "_upper"))
        at = y + high * (i - 0.5 * (len(laws) - 1))
        label = f"saved by anchoring it alone, with {sure} interval" if len(laws) == 1 else law.label
        # (a black interval could not be seen on a black bar)
        colour = REFERENCE_BAR if law.colour == axes.REFERENCE[0] else law.colour
        ax.barh(at, saving, color=colour, alpha=0.85, height=0.9 * high, label=label)
        alone = one["alone"].values * scale
        if len(laws) == 1 and not np.allclose(alone, saving, rtol=1e-6, atol=0.0):
            text = "caused by it, were all else anchored"
            ax.barh(at, alone, fc="none", ec="0.45", lw=0.9, height=0.9 * high, label=text, zorder=0)
        known = np.isfinite(lower) & np.isfinite(upper)
        errors = np.maximum(np.stack([saving - lower, upper - saving])[:, known], 0.0)
        ax.errorbar(saving[known], at[known], xerr=errors, fmt="none", color="0.1", lw=1.0)
    where = [place_name(f"floor {ranking['floor'].values[i]}").replace(" ", "\u00a0") for i in order]
    doubtful = doubtful_items(ranking)
    names = [
        f"{ranking['item'].values[i]} ({place}){MARK if doubtful[i] else ''}"
        for i, place in zip(order, where, strict=True)
    ]
    axes.named_rows(ax, [axes.wrapped(name, 0.55 * axes.width_of(ax), 9.0) for name in names], fontsize=9)
    ax.set_xlim(left=0.0)
    text = f"saved of the {ranking.attrs['objective_text']}{f' ({unit})' if unit else ''}"
    ax.set_xlabel(axes.wrapped(text, 0.6 * axes.width_of(ax)))
    ax.xaxis.set_major_locator(axes.round_ticks(5))
    return ax


def remainder(ranking: xr.Dataset, laws: list[selection.DrawnLaw], ax: Axes) -> Axes:
    """Draw what is left as items are anchored one by one, with intervals; against the cost if ranked by it."""
    scale, unit = objective_unit(ranking)
    paid = bool(ranking.attrs["per_cost"])
    last = 0.0
    for law in laws:
        one = law.results
        amount = one["left"].values * scale
        step = one["total_cost"].values if paid else ranking["step"].values
        last = max(last, float(step[-1]))
        ends = np.stack([one["left_lower"].values, one["left_upper"].values]) * scale
        ends = np.where(np.isfinite(ends), ends, amount)
        ax.fill_between(step, ends[0], ends[1], color=law.colour, alpha=0.15, lw=0.0)
        style = {"color": law.colour, "marker": law.marker, "ls": law.line}
        ax.plot(step, amount, ms=3.5, lw=1.5, label=law.label or None, **style)
    ax.set_ylim(bottom=0.0)
    ax.set_xlim(-0.02 * last, 1.02 * last if last > 0.0 else 1.0)
    ax.xaxis.set_major_locator(axes.round_ticks(4 if paid else 7, whole=not paid))
    if paid:
        ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: short_digits(value)))
    ax.yaxis.set_major_locator(axes.round_ticks(5))
    money = currency_of(ranking)
    spent = f"spent on anchoring, most saved first{f' ({money})' if money else ''}"
    across = spent if paid else "items anchored one after the other, most saved first"
    ax.set_xlabel(axes.wrapped(across, 0.7 * axes.width_of(ax)))
    left = f"left of the {ranking.attrs['objective_text']}{f' ({unit})' if unit else ''}"
    figure = ax.get_figure(root=True)
    ax.set_ylabel(axes.wrapped(left, 0.4 * (4.0 if figure is None else float(figure.get_figheight()))))
    axes.grid(ax)
    return ax


def anchoring_figure(results: xr.Dataset) -> Figure:
    """Return the figure of the savings from anchoring each item under every law, and of what is left as items are."""
    ranking = ranking_in(results)
    laws = selection.laws(ranking)
    n = len(order_of(ranking))
    each = max(0.3, 0.14 * len(laws))
    height = max(3.8, each * n + 1.9)
    if axes.has_room():
        figure = axes.figure(8.4, height)
        left, right = figure.subplots(1, 2, width_ratios=(1.5, 1.0))
    else:
        figure = axes.figure(8.4, height + 2.6)
        left, right = figure.subplots(2, 1, height_ratios=(height, 2.6))
    bars(ranking, laws, left)
    remainder(ranking, laws, right)
    handles, labels = left.get_legend_handles_labels()
    axes.legend_below(figure, handles, labels)
    text = f"what anchoring saves of the {ranking.attrs['objective_text']}"
    by = "saving over cost" if ranking.attrs["per_cost"] else ""
    by = "recommendation" if PLACE in ranking.coords else by
    text += f", ranked by {by}" if by else ""
    if n < ranking.sizes["item"]:
        text += f"; the first {n} of {ranking.sizes['item']} items"
    of = f"; {laws[0].label}" if len(laws) == 1 and laws[0].label else ""
    sure = percent(float(ranking.attrs["confidence"]))
    text += f"; {sure} intervals{of}"
    if doubtful_items(ranking)[order_of(ranking)].any():
        text += f"; {MARKED}"
    axes.heading(figure, str(results.attrs.get("title", "Anchoring")), text)
    return figure
