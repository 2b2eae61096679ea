"""Figures of fragility curves: fitted lines, observed fractions, every motion of a cloud, and medians by law."""

import math
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...core.aliases import Array
from ...core.parameters import USUAL_CONFIDENCE
from ...core.units import ENDS
from ...core.wording import percent
from ...fragility.curves.curve import TABULATED
from ...fragility.fitting.states import OVERTURNED, State, flags_of, needed_output, state_name, state_named
from ...fragility.numerics.proportions import wilson_interval
from ...fragility.runs.provenance import RUN, number_of_motions
from ..tables.fragility import curves_at
from ..text.block_order import HALF, ORDERS, places
from ..text.curve_notes import state_in
from ..text.precision import runs_of_curve
from ..text.reached import highest_level
from ..text.words import axis_name, axis_of, display_unit, level_name, reference_law
from . import axes, selection

MOST_TOGETHER = 4
"""Largest number of blocks and floors whose curves share a panel."""
MOST_PANELS = 12
"""Maximum number of panels of a figure; the results contain all curves."""
FAR = 3.0
"""Number of dispersions above the median beyond which a curve is flat."""
FULL_BIN, MOST_BINS = 30, 8
"""Motions of a cloud that make a bin, and the largest number of bins."""
LEVEL = 1e-3
"""Largest rise of a curve over a bin in which it is as good as level."""
BIN_POINTS = 200
"""Levels within a bin among which the place of its point is looked for."""
RAIL, TICK = 0.19, 0.022
"""Height of a row of medians below a panel, inches, and distance of the motions' ticks of two curves."""
Case = tuple[str, int | str | None]
"""A block and its floor, if results have floors."""


class Frame(NamedTuple):
    """The axis of levels that all panels share: its unit, its ends in it, and the levels at which curves are drawn."""

    axis: xr.DataArray
    scale: float
    low: float
    high: float
    log: bool
    x: Array

    @classmethod
    def of(cls, results: xr.Dataset) -> "Frame":
        """Return the axis of all blocks of some results."""
        axis = _axis(results)
        scale, _ = display_unit(axis)
        low, high, log = _span(results, axis.values / scale, scale)
        x = np.geomspace(low, high, 400) if log else np.linspace(0.0, high, 401)[1:]
        # curves end at the highest level of the runs
        return cls(axis, scale, low, high, log, np.minimum(x, highest_level(results) / scale))

    def curves(self, of_block: xr.Dataset) -> Array:
        """Return the fitted curves of one block (law, level), NaN if a law has none; no rows without curves."""
        if not _has_curves(of_block):
            return np.empty((0, self.x.size))
        return np.atleast_2d(curves_at(of_block, self.x * self.scale).transpose(..., "level").values)


@axes.drawing
def fragility(
    results: xr.Dataset,
    ax: Axes | None = None,
    *,
    block: str | None = None,
    model: str | None = None,
    floor: int | str | None = None,
    observed: bool = True,
    color: str | None = None,
    label: str | None = None,
) -> Axes:
    """Draw the fragility curves of one block: a fitted line for each law, and observed fractions with their intervals.

    The points of a cloud and of adaptive levels are fractions in bins of equally many motions, with Wilson intervals.
    Each is where the curve has the mean probability of the bin's runs, because a curve is bent within a bin.  Without a
    curve they are at the bin's geometric mean.

    Parameters
    ----------
    results : xarray.Dataset
        A study's results, or a result of `toppling.fit_fragility` or `toppling.overturning_probability`.
    observed : bool
        True to draw the observed fractions (for a cloud: every motion, and fractions in bins) with the curves.
    """
    if not _has_curves(results) and not _observed(results) and "intensity" not in results.coords:
        raise ValueError("fragility needs curves (median and dispersion) or probability, lower and upper on level")
    of_block = selection.single(results, block=block, floor=floor)
    laws = selection.laws(of_block, model, color)
    if label is not None and len(laws) > 1:
        raise ValueError(f"label must be of one law, got {len(laws)} laws: say which model")
    alone, ax = ax is None, ax or axes.new()
    frame = Frame.of(results)
    lines = frame.curves(of_block if model is None else laws[0].results)
    for i, law in enumerate(laws):
        _law(frame, ax, law, lines[i] if len(lines) else None, i=i, floor=floor, observed=observed, label=label)
    _finish(frame, ax, results, len(laws))
    axes.name(ax, selection.place(selection.labels(of_block, "block")[0], floor))
    if alone and label is not None:
        ax.legend()
    elif alone:
        axes.own_legend(ax)
    return ax


def _law(
    frame: Frame,
    ax: Axes,
    law: selection.DrawnLaw,
    line: Array | None,
    *,
    i: int = 0,
    floor: int | str | None = None,
    observed: bool = True,
    label: str | None = None,
) -> None:
    """Draw one law, the curve `i` of its axes: observed values, its curve, and its entry in a legend."""
    cloud = _is_cloud(law.results)
    state = _state_of(law.results)
    if observed and cloud and state is not None:
        _motions(law, ax, frame.scale, i, floor, state)
    elif observed and _observed(law.results):
        p, *ends = (law.results[name].values for name in ("probability", "lower", "upper"))
        _points(ax, law, law.results["level"].values / frame.scale, p, *ends)
    fitted = line is not None and bool(np.isfinite(line).any())
    if line is not None and fitted:
        ax.plot(frame.x, line, color=law.colour, lw=1.8, ls=law.line)
    style = law.line if fitted else "none"
    marker = law.marker if observed and (cloud or _observed(law.results)) else "none"
    text = label or law.label or "curve"
    ax.plot([], [], color=law.colour, marker=marker, ms=5.0, mew=0.0, lw=1.8, ls=style, label=text)


def _finish(frame: Frame, ax: Axes, results: xr.Dataset, curves: int) -> None:
    """Set the two axes of a panel."""
    axes.level_axis(ax, frame.low, frame.high, frame.log, axis_name(frame.axis))
    margin = 0.04 + TICK * (curves - 1) if _is_cloud(results) else 0.02
    axes.probabilities(ax, str(results.attrs.get("state", "overturning")), margin)


def _is_cloud(results: xr.Dataset) -> bool:
    return "level" not in results.coords and "intensity" in results.coords


def _has_curves(results: xr.Dataset) -> bool:
    tabulated = str(results.attrs.get("form")) in TABULATED and "probability" in results
    return "median" in results or "curve_probability" in results or tabulated


def _axis(results: xr.Dataset) -> xr.DataArray:
    if "level" in results.coords or "intensity" in results.coords:
        return axis_of(results)
    # (curves without levels hold their unit and the name of their measure)
    return results["median"].assign_attrs(long_name=level_name(results))


def _observed(results: xr.Dataset) -> bool:
    return "level" in results.coords and {"probability", "lower", "upper"} <= {*results.data_vars}


def _span(results: xr.Dataset, x: Array, scale: float) -> tuple[float, float, bool]:
    """Return the ends of the axis of all blocks, so that panels can be compared, and True if it is logarithmic."""
    if "level" in results.coords:
        high = float(x[-1])
        if _observed(results):
            # the axis ends at the first level at which nearly every block falls
            rest = [dim for dim in results["probability"].dims if dim != "level"]
            done = np.flatnonzero((results["probability"] > 0.995).all(rest).values)
            high = float(x[done[0]] if done.size else high)
        return (float(x[0]) / 1.06, 1.06 * high, True) if axes.log_spaced(x) else (0.0, 1.03 * high, False)
    far = math.inf
    if "median" in results:
        top = (results["median"] * np.exp(FAR * results.get("dispersion", xr.DataArray(0.0)))).values / scale
        far = float(np.nanmax(top, initial=0.0, where=np.isfinite(top))) or math.inf
    if "intensity" in results.coords:
        # (a few strong motions must not compress all curves at the left)
        return 0.0, 1.02 * min(float(x.max()), far), False
    return 0.0, far if math.isfinite(far) else 1.0, False


def _points(ax: Axes, law: selection.DrawnLaw, x: Array, p: Array, lower: Array, upper: Array) -> None:
    errors = np.maximum(np.stack([p - lower, upper - p]), 0.0)
    ax.errorbar(x, p, yerr=errors, fmt=law.marker, ms=4.0, mew=0.0, lw=0.8, color=law.colour, alpha=0.7)


def _motions(law: selection.DrawnLaw, ax: Axes, scale: float, i: int, floor: int | str | None, state: State) -> None:
    """Draw outcomes of a cloud or of adaptive levels, and fractions in equally full bins at their mean probability."""
    runs = law.results
    if RUN in runs.dims:
        runs = runs.isel({RUN: runs_of_curve(runs)})
    elif floor is not None and "motion_floor" in runs.coords:
        runs = runs.isel(motion=np.flatnonzero(runs["motion_floor"].values.astype(str) == str(floor)))
    alpha = float(runs["alpha"]) if "alpha" in runs.coords else math.nan
    at, fell = runs["intensity"].values / scale, np.asarray(flags_of(runs[needed_output(state)].values, state, alpha))
    ax.plot(at, np.where(fell, 1.02 + TICK * i, -0.02 - TICK * i), "|", ms=5.0, mew=0.7, color=law.colour, alpha=0.4)
    # (a motion and its reverse have one intensity, and are one trial of the intervals)
    sparse = RUN in runs.dims
    motions = np.unique(runs["run_motion"].values).size if sparse else number_of_motions(runs)
    bins = min(MOST_BINS, motions // FULL_BIN)
    if bins < 2:
        return
    parts = np.array_split(np.argsort(at, kind="stable"), bins)
    share = np.array([fell[part].mean() for part in parts])
    if sparse:
        trials = np.array([np.unique(runs["run_motion"].values[part]).size for part in parts])
    else:
        trials = np.array([part.size for part in parts]) / (at.size // motions)
    ends = wilson_interval(share * trials, trials, float(runs.attrs.get("confidence", USUAL_CONFIDENCE)))
    places = np.array([_place(runs, at[part] * scale) for part in parts]) / scale
    _points(ax, law, places, share, np.asarray(ends[0]), np.asarray(ends[1]))


def _place(runs: xr.Dataset, levels: Array) -> float:
    """Return the level at which a curve has its mean over a bin, or the geometric mean of the bin's levels."""
    mean = math.exp(float(np.log(levels).mean()))
    if not _has_curves(runs):
        return mean
    along = np.geomspace(levels.min(), levels.max(), BIN_POINTS)
    curve = curves_at(runs, along).transpose(..., "level").values
    if not curve[-1] - curve[0] > LEVEL:
        return mean
    probability = float(np.interp(np.log(levels), np.log(along), curve).mean())
    return math.exp(float(np.interp(probability, curve, np.log(along))))


def _state_of(results: xr.Dataset) -> State | None:
    """Return the state of the curves of runs; None if the runs do not have the output that it is read from."""
    state = state_named(state_in(results))
    return state if state is not None and needed_output(state) in results else None


@axes.style()
def fragility_figure(results: xr.Dataset) -> Figure:
    """Return the figure of curves under the reference law: one panel of few blocks and floors, else one a block."""
    floors, blocks = selection.floors(results), results["block"].values.astype(str).tolist()
    if len(blocks) > MOST_PANELS:
        first = places(results).values.reshape(len(blocks), -1).min(axis=1)
        blocks = [blocks[i] for i in np.argsort(first)]
    groups: list[list[Case]] = [[(block, floor) for floor in floors] for block in blocks]
    every = len(floors) * len(blocks)
    groups = [[case for group in groups for case in group]] if every <= MOST_TOGETHER else groups[:MOST_PANELS]
    figure, panels, columns = axes.panel_grid(len(groups), 3.4 if len(groups) == 1 else 2.3, 0.5)
    shown = _drawn(results)
    frame, at = Frame.of(shown), reference_law(results)[0]
    for i, (ax, group) in enumerate(zip(panels, groups, strict=True)):
        _panel(shown, frame, at, ax, group, named=i % columns == 0 and axes.has_room())
        axes.outer_labels(ax, i, columns, len(groups))
    title = f"Probability of {results.attrs.get('state', 'overturning')}"
    axes.heading(figure, title, *_reading_notes(results, len(floors), sum(map(len, groups)), every, at))
    return figure


def _drawn(results: xr.Dataset) -> xr.Dataset:
    """Return only the variables of the panels, a tenth of a study's: selecting from all of them is slow."""
    cloud = "level" not in results.coords
    wanted = {f"{part}{name}" for part in ("", "uplift_") for name in ("median", "dispersion")}
    wanted |= {"probability", "lower", "upper", "curve_probability", "half_level"}
    if cloud:
        state = _state_of(results)
        wanted |= {"run_block", "run_model", "run_motion", *([] if state is None else [needed_output(state)])}
    shown = results[[name for name in results.data_vars if name in wanted]]
    return (
        shown
        if cloud
        else shown.drop_vars([name for name, coordinate in shown.coords.items() if "motion" in coordinate.dims])
    )


def _panel(results: xr.Dataset, frame: Frame, at: int, ax: Axes, group: list[Case], *, named: bool) -> None:
    """Draw a group of blocks and floors under the law `at`, and the medians of each under all laws below them."""
    laws: list[selection.DrawnLaw] = []
    rows: list[Array] = []
    several = len({block for block, _ in group}) > 1
    for i, (block, floor) in enumerate(group):
        of_block = selection.single(results, block=block, floor=floor)
        lines = frame.curves(of_block)
        colour, marker, line = axes.look(i)
        name = selection.place(block if several else "", floor)
        law = selection.laws(of_block)[at]
        laws = [*laws, law._replace(label=name, colour=colour, marker=marker, line=line)]
        for other in np.delete(lines, at, axis=0) if len(group) == 1 and len(lines) else ():
            ax.plot(frame.x, other, color=axes.GREY, lw=1.0, zorder=0)
        _law(frame, ax, laws[-1], lines[at] if len(lines) else None, i=i, floor=floor)
        rows.append(of_block["half_level"].values.ravel() / frame.scale if "half_level" in of_block else np.empty(0))
    _finish(frame, ax, results, len(group))
    ax.set_ylabel("")
    if not several:
        axes.name(ax, selection.place(block, None if len(group) > 1 else floor))
    if len(group) > 1 or any(row.size > 1 for row in rows):
        _rail(ax, laws, rows, at, named=named)


def _rail(ax: Axes, laws: list[selection.DrawnLaw], rows: list[Array], at: int, *, named: bool) -> None:
    """Draw the medians under all laws below a panel, a row for each curve, which has its name there."""
    bottom, top = ax.get_ylim()
    step = RAIL * (top - bottom) / max(1.0, axes.height_of(ax) - 0.4 - RAIL * len(rows))
    low, high = ax.get_xlim()
    ax.axhline(bottom, color="0.4", lw=0.8)
    names, short = ([law.label.partition(mark)[0] for law in laws] for mark in ("\n", ","))
    names = short if not axes.has_room() and len(set(short)) == len(laws) else names
    for i, (law, medians) in enumerate(zip(laws, rows, strict=True)):
        y = bottom - step * (i + 0.7)
        inside = medians[(medians >= low) & (medians <= high)]
        ends = (float(inside.min()), float(inside.max())) if inside.size else (low, low)
        ax.plot(ends, [y, y], color=law.colour, lw=1.2, clip_on=False)
        ax.plot(inside, np.full(inside.size, y), "|", color=law.colour, ms=6.0, mew=1.2)
        if medians.size and medians[at] in inside:
            ax.plot(medians[at], y, law.marker, color=law.colour, ms=6.0, mew=0.0)
        sides = (ax.transScale + ax.transLimits).transform([(end, 0.0) for end in ends])[:, 0]
        left = bool(sides.sum() > 1.0)  # (there is more room at the left)
        place: dict[str, Any] = {"xytext": (-6 if left else 6, 0), "ha": "right" if left else "left", "va": "center"}
        ax.annotate(
            names[i] if len(rows) > 1 else "",
            (ends[0 if left else 1], y),
            textcoords="offset points",
            color=law.colour,
            **place,
        )
    ax.set_ylim(bottom - step * (len(rows) + 0.4), top)
    if named:
        text = "Medians\nby law" if len(rows) > 1 and rows[0].size > 1 else "Medians"
        y = bottom - step * (0.5 * len(rows) + 0.2)
        at_left: dict[str, Any] = {"textcoords": "offset points", "ha": "right", "va": "center"}
        ax.annotate(text, (0.0, y), (-4, 0), xycoords=("axes fraction", "data"), color="0.4", **at_left)


def _reading_notes(results: xr.Dataset, floors: int, cases: int, every: int, at: int) -> list[str]:
    """Return the caption's notes for reading the panels."""
    motions = number_of_motions(results) // floors
    confidence = percent(float(results.attrs.get("confidence", USUAL_CONFIDENCE)))
    notes = [selection.motions(results, floors)]
    if cases < every or "shown_of" in results.attrs:
        by = results.attrs.get("shown_by", ORDERS[HALF])
        of = every // results.sizes["block"] * int(results.attrs.get("shown_of", results.sizes["block"]))
        notes.insert(0, f"the {cases} of {of:,} blocks{' and floors' if floors > 1 else ''} {by}")
    fitted = bool(results["converged"].any())
    law = selection.laws(results)[at].label
    if fitted:
        notes.append(f"lines: {results.attrs.get('form', 'lognormal')} fits{f', {law}' if law else ''}")
    if "level" in results.coords:
        notes.append(f"points: observed shares with {confidence} Wilson intervals")
    elif _state_of(results) is not None:  # (curves of a surface have no runs of each block)
        fell = state_in(results) == state_name(OVERTURNED)
        outcomes = "stood below, fell above" if fell else "state not reached below, reached above"
        notes.append(f"ticks: every {'run' if RUN in results.dims else 'motion'}, {outcomes}")
        if RUN in results.dims or motions >= 2 * FULL_BIN:
            notes.append(f"points: shares in bins of equally many motions with {confidence} Wilson intervals")
    if results.sizes["model"] > 1:
        notes.append(f"below: medians under {results.sizes['model']} laws (symbol: {law})")
    return notes


@axes.style()
def laws_figure(results: xr.Dataset) -> Figure:
    """Return the figure of medians under every law over the median under the reference, a panel for each block."""
    laws, at = selection.laws(results), reference_law(results)[0]
    order = [at, *(i for i in range(len(laws)) if i != at)]
    wanted = [f"half_level{end}" for end in ENDS if f"half_level{end}" in results]
    shown = results[wanted].isel(model=order)
    scale, unit = display_unit(_axis(results))
    every = [(str(block), floor) for block in results["block"].values for floor in selection.floors(results)]
    medians = [selection.single(shown, block=block, floor=floor)["half_level"].values[0] for block, floor in every]
    cases = [case for case, median in zip(every, medians, strict=True) if 0.0 < median < np.inf][:MOST_PANELS]
    height = 0.21 * len(laws) + 0.5
    figure, panels, columns = axes.panel_grid(len(cases), height, 0.6, shared=True)
    for i, (ax, (block, floor)) in enumerate(zip(panels, cases, strict=True)):
        of_block = selection.single(shown, block=block, floor=floor)
        middle, *ends = (of_block[name].values for name in wanted)
        for y, value in enumerate(middle):
            colour = axes.REFERENCE[0] if y == 0 else axes.colour(0)
            if ends and np.isfinite(value):
                ax.plot([end[y] / middle[0] for end in ends], [y, y], color=colour, lw=2.2, solid_capstyle="butt")
            ax.plot(value / middle[0], y, "o", color=colour, ms=5.5)
            text = f"{value / scale:.2f}" if np.isfinite(value) else "–"
            ax.annotate(text, (1.02, y), xycoords=("axes fraction", "data"), va="center", color="0.3")
        ax.axvline(1.0, color="0.5", lw=0.9, zorder=0)
        axes.name(ax, selection.place(block, floor))
        axes.named_rows(ax, [laws[k].label for k in order], 1.2)
        axes.label(ax, along="x").tick_params(labelleft=i % columns == 0, labelbottom=i + columns >= len(cases))
    panels[0].set_xscale("log")
    axes.plain_log(panels[0])
    figure.supxlabel(f"Median relative to {laws[at].label} (numbers: median{f', {unit}' if unit else ''})", fontsize=9)
    confidence = percent(float(results.attrs.get("confidence", USUAL_CONFIDENCE)))
    note = f"bars: {confidence} intervals; left of 1: the state is reached in weaker shaking"
    motions = selection.motions(results, len(selection.floors(results)))
    axes.heading(figure, "Medians by damping law", motions, note)
    return figure
