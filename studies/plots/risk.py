"""Figures of risk: annual rates of overturning, the contributing levels, and rates over branches."""

import math
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatterSciNotation, LogLocator

from ...core import checks
from ...core.aliases import Array
from ...core.parameters import USUAL_CONFIDENCE
from ...core.wording import percent
from ..plan.risk import risk_of
from ..text import block_order as falling
from ..text.curve_notes import BEYOND, state_in
from ..text.precision import FITTED_RATE
from ..text.spread import SOURCES
from ..text.words import axis_name, by_place, display_unit
from . import axes, selection

MOST_ROWS = 12
NOTHING = 5e-4
"""Share of a rate below which a bin at either end is not drawn."""
NOTABLE = 5e-3
"""Smallest share of a rate from beyond the hazard curve's levels that is drawn."""
HATCHES = ("////", "\\\\\\\\", "....", "xxxx", "||||", "----")
RATE, SHARE = "rate", "share"


@axes.drawing
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
    """Draw the annual rates of one block under every law, or the contributions of intensities to these rates.

    The share from beyond the hazard curve's levels is hatched and spread over several bins, so that its area is its
    share; its true distribution is not known.  Bins outside the levels of the runs are shaded: there the curve is
    extrapolated.

    Parameters
    ----------
    results : xarray.Dataset
        Results of a study with a hazard, or the dataset that `toppling.annual_rate` returns.
    quantity : {"rate", "share"}
        The rates with their intervals, or the share of each rate by intensity.
    """
    checks.choice("quantity", quantity, (RATE, SHARE))
    rates = risk_of(results) if "rate_share" in results else results
    if "rate" not in rates or "share" not in rates:
        raise ValueError("a figure of risk needs annual rates: a study with a hazard, or what annual_rate returns")
    of_block = selection.single(rates, block=block, floor=floor)
    laws = selection.laws(of_block, model, color)
    if quantity == SHARE:
        return _shares(of_block, rates, ax, laws)
    ax = ax or axes.new(0.4 * len(laws) + 1.3)
    _rates(of_block, [[law] for law in laws], ax)
    axes.named_rows(ax, [law.label for law in laws])
    return ax


def _rates(rates: xr.Dataset, rows: list[list[selection.DrawnLaw]], ax: Axes) -> None:
    """Draw rows of rates with their intervals, the laws of a row one below the other."""
    for y, laws in enumerate(rows):
        for at, law in zip(y + 0.18 * (np.arange(len(laws)) - 0.5 * (len(laws) - 1)), laws, strict=True):
            rate = law.results["rate"].item()
            if not rate > 0.0:
                text = "no curve" if math.isnan(rate) else "never"
                ax.annotate(text, (0.03, at), xycoords=("axes fraction", "data"), va="center", color="0.4")
                continue
            low, high = (float(law.results.get(f"rate_{end}", law.results["rate"])) for end in ("lower", "upper"))
            error = np.nan_to_num(np.maximum([[rate - low], [high - rate]], 0.0), posinf=0.0)
            ax.errorbar(rate, at, xerr=error, fmt=law.marker, ms=5.5, color=law.colour, lw=1.4)
            if math.isinf(high):  # (an arrow: there is no upper end)
                ax.plot(rate, at, marker=9, ms=14.0, color=law.colour)
    ax.set_xscale("log")
    ax.margins(x=0.15)
    axes.plain_log(ax)
    axes.label(ax, f"annual rate of {rates.attrs.get('state', 'overturning')}", along="x")
    axes.years(ax, "top")


def _shares(of_block: xr.Dataset, every: xr.Dataset, ax: Axes | None, laws: list[selection.DrawnLaw]) -> Axes:
    alone = ax is None
    ax = ax or axes.new(3.6)
    scale, unit = display_unit(of_block["bin"])
    edges = _edges(of_block) / scale
    wide = math.log(edges[-1] / edges[0]) / (edges.size - 1)
    first, last, tails = _window(every, edges)
    outside: dict[str, list[float]] = {}
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
            outside.setdefault(f"from {side} {at:.3g} {unit}".strip(), []).append(part)
    ends = _outside_levels(of_block, scale)
    if ends is not None:
        for low, high in ((first, min(ends[0], last)), (max(ends[1], first), last)):
            if high > low:
                ax.axvspan(low, high, color="0.5", alpha=0.12, lw=0.0, zorder=0)
    axes.level_axis(ax, first, last, True, axis_name(of_block["bin"]).removeprefix("geometric middle of a bin of "))
    ax.margins(y=0.12)
    ax.set_ylim(bottom=0.0)
    axes.shares(ax.yaxis)
    axes.label(ax, y="contribution to the rate per bin")
    hatched = bool(outside)
    if BEYOND in of_block:
        far = [float(law.results[BEYOND]) for law in laws]
        if max(far) >= NOTABLE:
            outside["from above all runs"] = far
    if outside:
        ranges = {
            where: dict.fromkeys(f"{float(f'{100.0 * end:.2g}'):g}" for end in (min(parts), max(parts)))
            for where, parts in outside.items()
        }
        text = "; ".join(f"{'–'.join(ends)} % {where}" for where, ends in ranges.items())
        axes.name(ax, f"hatched: {text}" if hatched else text)
    if alone:
        axes.own_legend(ax)
    return ax


def _edges(of_block: xr.Dataset) -> Array:
    return np.append(of_block["bin_lower"].values, of_block["bin_upper"].values[-1])


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


def _outside_levels(of_block: xr.Dataset, scale: float) -> tuple[float, float] | None:
    """Return the lowest and the highest level of the blocks' runs; None if the hazard has another measure."""
    if "level" not in of_block.coords or of_block["level"].ndim != 1:
        return None
    level, bins = of_block["level"], of_block["bin"]
    if level.attrs.get("im") != bins.attrs.get("im") or level.attrs.get("units") != bins.attrs.get("units"):
        return None
    return float(level[0]) / scale, float(level[-1]) / scale


@axes.style()
def risk_figure(results: xr.Dataset) -> Figure:
    """Return the figure of risk: the rates of all blocks (and floors), and the contributions to the highest rate."""
    rates = risk_of(results) if "rate_share" in results else results
    every = [(str(block), floor) for block in rates["block"].values for floor in selection.floors(rates[["rate"]])]
    if len(every) > MOST_ROWS:
        every = [every[i] for i in np.argsort(falling.places(results, falling.RATE).values.ravel())]
    rows = [selection.laws(selection.single(rates, block=block, floor=floor)) for block, floor in every[:MOST_ROWS]]
    names = [selection.place(block, floor) for block, floor in every]
    height = max(2.8, (0.16 + 0.18 * len(rows[0])) * len(rows) + 1.2)
    figure, (left, right), _ = axes.panel_grid(2, height, 0.5)
    _rates(rates, rows, left)
    axes.named_rows(left, names[:MOST_ROWS])
    highest = int(np.argmax([max(np.nan_to_num(law.results["rate"].item()) for law in row) for row in rows]))
    block, floor = every[highest]
    risk(rates, right, quantity=SHARE, block=block, floor=floor)
    outside = right.get_title("left")
    axes.name(right, names[highest] if len(rows) > 1 else "")
    notes = [f"rates with {percent(float(results.attrs.get('confidence', USUAL_CONFIDENCE)))} intervals"]
    if len(every) > len(rows):
        floors = len(every) // results.sizes["block"]
        of = f"{floors * int(results.attrs.get('shown_of', results.sizes['block'])):,} blocks"
        of += " and floors" if floors > 1 else ""
        notes.insert(0, f"the {len(rows)} of {of} {falling.ORDERS[falling.RATE]}")
    if outside.startswith("hatched"):
        notes.append("hatched area: share from beyond the hazard curve")
    notes.append(" ".join(outside.split()).removeprefix("hatched: "))
    if FITTED_RATE in rates:
        notes.append("rates do not depend on a form of curve; contributions are of the fitted curve")
    ends = _outside_levels(rates, 1.0)
    first, last, _ = _window(rates, _edges(rates))
    if ends is not None and (ends[0] > first or ends[1] < last):
        notes.append("shaded: levels without runs")
    axes.heading(figure, f"Annual rate of {rates.attrs.get('state', 'overturning')}", *notes, legend=[right])
    return figure


MOST_SPREADS = 16
"""Largest number of blocks (and floors) of the figure."""
THIN, THICK = (0.05, 0.95), (0.16, 0.84)
TOGETHER = "together"
"""The source that is the interaction of the others."""
SEEN, NAMED = 0.005, 0.15
"""Shares of a variance from which its source is drawn, and named in the bar."""


@axes.style()
def spread_figure(results: xr.Dataset) -> Figure:
    """Return the figure of the rates over all branches: ranges of each block or piece, and the sources of spread."""
    dims = results["epistemic_rate"].dims
    flat = results[["epistemic_rate", "epistemic_rate_fractile", "epistemic_spread", "branch_rate"]]
    flat = flat.stack(row=dims, create_index=False) if len(dims) > 1 else flat.rename({dims[0]: "row"})
    flat = flat.isel(row=slice(MOST_SPREADS))
    names = [name for name, _ in by_place(results, dims)][:MOST_SPREADS]
    figure, (ranges, shares), _ = axes.panel_grid(2, 1.3 + 0.45 * len(names), 0.4)
    y = np.arange(len(names))
    fractiles = flat["epistemic_rate_fractile"].transpose("row", "epistemic_fractile")
    for (low, high), width in ((THIN, 1.4), (THICK, 5.0)):
        left, right = (fractiles.sel(epistemic_fractile=end).values for end in (low, high))
        ranges.hlines(y, left, right, color=axes.colour(0), lw=width, zorder=2)
    rates = flat["branch_rate"].transpose("row", "branch").values
    sizes = np.broadcast_to(90.0 * results["branch_weight"].values + 4.0, rates.shape)
    ranges.scatter(rates, np.broadcast_to(y[:, None] + 0.28, rates.shape), sizes, color="0.55", lw=0.0, zorder=1)
    ranges.plot(fractiles.sel(epistemic_fractile=0.5).values, y, "|", color="black", ms=12.0, mew=1.6, zorder=3)
    ranges.plot(flat["epistemic_rate"].values, y, "D", color="black", mfc="white", ms=6.0, zorder=4)
    ranges.set_xscale("log")
    axes.named_rows(ranges, names)
    ranges.xaxis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
    ranges.xaxis.set_major_formatter(LogFormatterSciNotation(labelOnlyBase=False, minor_thresholds=(np.inf, np.inf)))
    ranges.minorticks_off()
    axes.label(ranges, f"annual rate of {state_in(results)}")
    axes.years(ranges, "top")
    before = np.zeros(len(names))
    for k, source in enumerate(results["epistemic_source"].values.astype(str)):
        part = np.nan_to_num(flat["epistemic_spread"].sel(epistemic_source=source).values)
        if part.max() > SEEN:
            hatch = "////" if k >= len(axes.COLOURS) and source != TOGETHER else None
            colour = axes.GREY if source == TOGETHER else axes.colour(k)
            name = "interactions" if source == TOGETHER else SOURCES[source][0]
            shares.barh(y, part, 0.6, before, color=colour, edgecolor="white", lw=0.8, hatch=hatch, label=name)
            ink = "black" if source == TOGETHER or hatch else "white"
            for at, (first, wide) in enumerate(zip(before, part, strict=True)):
                if wide > max(NAMED, len(name) / axes.LETTERS / axes.width_of(shares)):
                    shares.annotate(name, (first + 0.5 * wide, at), ha="center", va="center", color=ink)
            before += part
    axes.named_rows(shares, names)
    shares.tick_params(labelleft=not axes.has_room())
    shares.set_xlim(0.0, 1.0)
    axes.shares(shares.xaxis)
    axes.label(shares, "share of the variance of ln(rate)", along="x")
    axes.heading(
        figure,
        "Annual rates over all branches",
        f"{results.sizes['branch']:,} weighted branches",
        "thick lines: 16 to 84 %; thin lines: 5 to 95 %; bars: medians; diamonds: means",
        "grey dots: single branches, with their weight as area",
        legend=[shares],
    )
    return figure
