"""Figures of risk: annual rates of overturning, and the levels of shaking that contribute to them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from ...core import checks
from ...core.aliases import Array
from ...core.wording import in_years, percent, years_between
from ..plan.risk import risk_of
from ..text import block_order as falling
from ..text.curve_notes import BEYOND
from ..text.precision import FITTED_RATE
from ..text.words import axis_name, display_unit, floor_name
from . import axes, selection

MOST_ROWS = 12
NOTHING = 5e-4
"""Share of a rate below which a bin at either end is not drawn."""
NOTABLE = 5e-3
"""Smallest share of a rate from beyond the hazard curve's levels that is drawn."""
HATCHES = ("////", "\\\\\\\\", "....", "xxxx", "||||", "----")
RATE, SHARE = "rate", "share"


def risk(
    results: xr.Dataset,
    ax: Axes | None = None,
    *,
    quantity: str = RATE,
    block: str | None = None,
    model: str | None = None,
    floor: int | str | None = None,
    color: str | None = None,
) -> Axes:
    """Draw the annual rates of one block under every law, or the shares of the intensities in these rates.

    Parameters
    ----------
    results : xarray.Dataset
        Results of a study with a hazard, or the dataset that `toppling.annual_rate` returns.
    quantity : {"rate", "share"}
        The rates with their intervals, or the share of each rate by intensity.
    ax, block, model, floor, color : optional
        As for `fragility`.

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    TypeError, ValueError
        Results without annual rates; several blocks or floors, and no label given; no such block, law or floor.

    Notes
    -----
    Shares are a histogram on a logarithmic axis.  The share from beyond the hazard curve's levels is hatched and spread
    over several bins' width so that its area is its share; its true distribution there is not known.  Bins outside the
    levels at which blocks were shaken are shaded, because the curve is extrapolated there.
    """
    checks.choice("quantity", quantity, (RATE, SHARE))
    found = risk_of(results) if "rate_share" in selection.checked(results) else results
    if "rate" not in found or "share" not in found:
        raise ValueError("a figure of risk needs annual rates: a study with a hazard, or what annual_rate returns")
    here = selection.one(found, block=block, floor=floor)
    return _rates(here, ax, model, color) if quantity == RATE else _shares(here, found, ax, model, color)


def _rates(here: xr.Dataset, ax: Axes | None, model: str | None, color: str | None) -> Axes:
    laws = selection.laws(here, model, color)
    ax = ax or axes.new(6.0, 0.45 * len(laws) + 1.2)
    state = here.attrs.get("state", "overturning")
    for i, law in enumerate(laws):
        one = law.results
        rate = one["rate"].item()
        if not rate > 0.0:
            text = "no curve" if math.isnan(rate) else "never"
            ax.annotate(text, (0.03, i), xycoords=("axes fraction", "data"), va="center", fontsize=9, color="0.4")
            continue
        ends = [[rate - one["rate_lower"].item()], [one["rate_upper"].item() - rate]] if "rate_lower" in one else None
        error = None if ends is None else np.nan_to_num(np.maximum(ends, 0.0), posinf=0.0)
        ax.errorbar(rate, i, xerr=error, fmt=law.marker, ms=6.0, color=law.colour, lw=1.4)
        text = f"once in {in_years(rate)} years"
        if error is not None and math.isinf(one["rate_upper"].item()):
            text += f"\n({years_between(math.inf, one['rate_lower'].item())})"
        ax.annotate(text, (rate, i), xytext=(0, 6), textcoords="offset points", ha="center", fontsize=9)
    ax.set_xscale("log")
    ax.set_yticks(np.arange(len(laws)), [axes.wrapped(law.label, max(1.5, 0.4 * axes.width_of(ax))) for law in laws])
    ax.set_ylim(len(laws) - 0.5, -0.8)
    ax.margins(x=0.45)
    axes.plain_log(ax)
    ax.set_xlabel(f"annual rate of {state} (1/year)")
    axes.grid(ax, "x")
    return ax


def _shares(here: xr.Dataset, every: xr.Dataset, ax: Axes | None, model: str | None, color: str | None) -> Axes:
    alone = ax is None
    ax = ax or axes.new(6.2, 3.8)
    laws = selection.laws(here, model, color)
    scale, unit = display_unit(here["bin"])
    edges = _edges(here) / scale
    wide = math.log(edges[-1] / edges[0]) / (edges.size - 1)
    first, last, tails = _window(every, edges)
    said: dict[str, list[float]] = {}
    for i, law in enumerate(laws):
        # (the bins have equal width in ln x, so that their heights can be compared)
        share = np.nan_to_num(law.results["share"].values)
        ax.stairs(share, edges, color=law.colour, ls=law.line, lw=1.6, label=law.label or None)
        for side, bins in tails.items():
            part = float(law.results[f"share_{side}"])
            if not part >= NOTABLE:
                continue
            at = edges[-1] if side == "above" else edges[0]
            to = at * math.exp(wide * bins * (1.0 if side == "above" else -1.0))
            style: dict[str, Any] = {"fill": True, "facecolor": "none", "edgecolor": law.colour, "lw": 1.0}
            ax.stairs([part / bins], sorted((at, to)), hatch=HATCHES[i % len(HATCHES)], **style)
            said.setdefault(f"from {side} {at:.3g} {unit}".strip(), []).append(part)
    ends = _outside_levels(here, scale)
    if ends is not None:
        for low, high in ((first, min(ends[0], last)), (max(ends[1], first), last)):
            if high > low:
                ax.axvspan(low, high, color="0.5", alpha=0.12, lw=0.0, zorder=0)
    axes.level_axis(ax, first, last, True, axis_name(here["bin"]).removeprefix("geometric middle of a bin of "))
    ax.margins(y=0.12)
    ax.set_ylim(bottom=0.0)
    # few numbers, since the share of a single bin says little by itself
    ax.yaxis.set_major_formatter(PercentFormatter(1.0))
    ax.set_ylabel("share of the rate per bin")
    axes.grid(ax)
    hatched = bool(said)
    if BEYOND in here:
        far = [float(law.results[BEYOND]) for law in laws]
        if max(far) >= NOTABLE:
            said["from above the levels run"] = far
    if said:
        ranges = {
            where: dict.fromkeys(f"{float(f'{100.0 * end:.2g}'):g}" for end in (min(shares), max(shares)))
            for where, shares in said.items()
        }
        text = "; ".join(f"{'–'.join(ends)} % {where}" for where, ends in ranges.items())
        room = (0.9 if axes.has_room() else 0.75) * axes.width_of(ax)
        ax.set_title(axes.wrapped(f"hatched: {text}" if hatched else text, room, 9.0), fontsize=9)
    if alone:
        axes.own_legend(ax)
    return ax


def _edges(here: xr.Dataset) -> Array:
    return np.append(here["bin_lower"].values, here["bin_upper"].values[-1])


def _window(every: xr.Dataset, edges: Array) -> tuple[float, float, dict[str, int]]:
    """Return the start and the end of the axis of all rows, and the width of each hatched tail in bins."""
    whole = np.nan_to_num(every["share"].values).reshape(-1, edges.size - 1)
    most = max(float(whole.max()), 1e-9)
    held = np.flatnonzero((whole > NOTHING).any(axis=0))
    low, high = (max(held[0] - 1, 0), min(held[-1] + 2, edges.size - 1)) if held.size else (0, edges.size - 1)
    wide = math.log(edges[-1] / edges[0]) / (edges.size - 1)
    first, last = float(edges[low]), float(edges[high])
    tails = {}
    for side in ("below", "above"):
        part = float(np.nanmax(np.nan_to_num(every[f"share_{side}"].values), initial=0.0))
        if part >= NOTABLE:
            # the tail is no higher than the highest bin, unless that would take more than 0.6 of the bins' width
            tails[side] = int(np.clip(math.ceil(part / most), 3, 0.6 * (edges.size - 1)))
            if side == "above":
                last = float(edges[-1]) * math.exp(wide * (tails[side] + 0.5))
            else:
                first = float(edges[0]) * math.exp(-wide * (tails[side] + 0.5))
    return first, last, tails


def _outside_levels(here: xr.Dataset, scale: float) -> tuple[float, float] | None:
    """Return the lowest and the highest level at which blocks were shaken; None if the hazard has another measure."""
    if "level" not in here.coords or here["level"].ndim != 1:
        return None
    level, bins = here["level"], here["bin"]
    if level.attrs.get("im") != bins.attrs.get("im") or level.attrs.get("units") != bins.attrs.get("units"):
        return None
    return float(level[0]) / scale, float(level[-1]) / scale


def risk_figure(results: xr.Dataset) -> Figure:
    """Return the figure of risk: a row for each block (and floor) with the rates and the shares of the intensities."""
    found = risk_of(results) if "rate_share" in results else results
    every = [(str(block), floor) for block in found["block"].values for floor in selection.floors(found[["rate"]])]
    if len(every) > MOST_ROWS:
        every = [every[i] for i in np.argsort(falling.places(results, falling.RATE).values.ravel())]
    rows = every[:MOST_ROWS]
    laws = found.sizes["model"]
    height = max(2.7, 0.45 * laws + 1.5) * len(rows)
    figure = axes.figure(8.2, height * (1.0 if axes.has_room() else 2.0) + 0.9)
    if axes.has_room():
        panels = figure.subplots(len(rows), 2, squeeze=False, sharex="col")
    else:  # (each block has its rate, and below it where that comes from)
        panels = figure.subplots(2 * len(rows), 1, squeeze=False).reshape(len(rows), 2)
        for first, *others in panels.T:
            for ax in others:
                ax.sharex(first)
    for (left, right), (block, floor) in zip(panels, rows, strict=True):
        risk(found, left, block=block, floor=floor)
        risk(found, right, quantity=SHARE, block=block, floor=floor)
        name = block if floor is None else f"{block}, {floor_name(floor)}"
        left.set_title(axes.wrapped(name, axes.width_of(left)), fontsize=10)
        hatched = right.get_title()
        right.set_title(f"where its rate comes from\n{hatched}".strip(), fontsize=10 if axes.has_room() else 9)
        for ax in (left, right):
            ax.tick_params(labelbottom=True)
            if (block, floor) != rows[-1]:
                ax.set_xlabel("")
    axes.legend_below(figure, *panels[0, 1].get_legend_handles_labels())
    parts = [f"annual rates with {percent(float(results.attrs.get('confidence', 0.95)))} intervals"]
    if len(every) > len(rows):
        floors = len(every) // results.sizes["block"]
        of = f"{floors * int(results.attrs.get('shown_of', results.sizes['block'])):,} blocks"
        of += " and floors" if floors > 1 else ""
        parts.insert(0, f"the {len(rows)} of {of} {falling.ORDERS[falling.RATE]}")
    outside = [side for side in ("above", "below") if float(found[f"share_{side}"].max()) >= NOTABLE]
    if outside:
        parts.append("hatched: from shaking beyond the hazard curve's levels, drawn with an area that is its share")
    if FITTED_RATE in found:
        parts.append("rates are without a form of curve, and where a rate comes from is said by the fitted curve")
    ends = _outside_levels(found, 1.0)
    first, last, _ = _window(found, _edges(found))
    if ends is not None and (ends[0] > first or ends[1] < last):
        parts.append("shaded: outside the levels that were run")
    axes.heading(figure, str(results.attrs.get("title", "Risk")), "; ".join(parts))
    return figure
