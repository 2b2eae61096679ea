"""Figures of fragility curves: fitted lines, observed fractions, and every motion of a cloud."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, PercentFormatter

from ...core.aliases import Array
from ...core.wording import percent
from ...fragility import curve_probability
from ...fragility.curves.curve import TABULATED
from ...fragility.fitting.states import OVERTURNED, State, flags_of, needed_output, state_name, state_named
from ...fragility.numerics.proportions import wilson_interval
from ...fragility.runs.provenance import RUN, number_of_motions
from ...motions.arrays import POLARITY
from ..text.block_order import HALF, ORDERS, places
from ..text.curve_notes import state_in
from ..text.precision import runs_of_curve
from ..text.reached import highest_level
from ..text.words import axis_name, axis_of, display_unit, floor_name, level_name
from . import axes, selection

MOST_PANELS = 36
"""Panels of one figure at the most; the results hold all curves."""
MOST_ROWS = 10
"""Rows of panels of several laws at the most, so that a figure is no higher than two pages or so."""
FAR = 3.0
"""Number of dispersions above the median beyond which a curve is flat."""
LOW_ROWS = 2
"""Rows of panels up to which panels of laws are high."""
FULL_BIN, MOST_BINS = 30, 8
"""Motions of a cloud that make a bin, and the largest number of bins."""
LEVEL = 1e-3
"""Greatest rise of a curve over a bin in which it is as good as level."""
BIN_POINTS = 200
"""Levels within a bin among which the place of its point is looked for."""


class Frame(NamedTuple):
    """What all panels of some results share: the axis of levels, its unit and span, and where curves are drawn."""

    axis: xr.DataArray
    scale: float
    span: Span
    x: Array

    @classmethod
    def of(cls, results: xr.Dataset) -> Frame:
        axis = _axis(results)
        scale, _ = display_unit(axis)
        span = _span(results, axis, scale)
        # (curves end at the highest level that was run)
        return cls(axis, scale, span, np.minimum(span.points(), highest_level(results) / scale))

    def curves(self, here: xr.Dataset) -> Array:
        """Return the fitted curves of one block (law, level), NaN where a law has none; no rows without curves."""
        if not _has_curves(here):
            return np.empty((0, self.x.size))
        return np.atleast_2d(_curves(here, self.x * self.scale))


class Span(NamedTuple):
    """The start and the end of an axis of levels, in the unit shown, and whether the axis is logarithmic."""

    low: float
    high: float
    log: bool

    def points(self, n: int = 400) -> Array:
        """Return the levels along the axis at which a curve is drawn."""
        return np.geomspace(self.low, self.high, n) if self.log else np.linspace(0.0, self.high, n + 1)[1:]


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
    legend: bool = True,
) -> Axes:
    """Draw the fragility curves of one block: a fitted line for each law, and observed fractions with their intervals.

    Parameters
    ----------
    results : xarray.Dataset
        A study's results; or curves, as `toppling.fit_fragility` returns them; or observed fractions, as
        `toppling.overturning_probability` returns them.
    ax : matplotlib Axes, optional
        Axes to draw into; by default those of a new figure.
    block, model : str, optional
        Labels of the block (needed where there are several) and of one law (all laws by default).
    floor : int or str, optional
        The floor; needed where the results are of several floors.
    observed : bool
        True to draw the observed fractions (for a cloud: every motion, and fractions in bins) with the curves.
    color, label : str, optional
        Matplotlib's colour for one law, and the law's text in the legend.
    legend : bool
        True for a legend where there are several laws, or a label.

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    TypeError, ValueError
        No dataset, neither curves nor fractions; several blocks or floors, and no label given; no such block, law or
        floor; a colour or label for several laws.

    Notes
    -----
    Levels that are spaced logarithmically are drawn on a logarithmic axis, other levels on a linear axis from zero.
    Curves end at the highest level that was run.  Points lie at their levels; those of several laws may cover each
    other, which `model` avoids.  The motions of a cloud are ticks: below the curves where the block stands, above them
    where it falls.  The points of a cloud, and of adaptive levels, are fractions in bins of equally many motions, with
    Wilson intervals, where the curve has the mean probability of the bin's runs: a curve is bent within a bin, and its
    value at the mean level is another.  Without a curve they lie at the bin's geometric mean.
    """
    if not _has_curves(selection.checked(results)) and not _observed(results) and "intensity" not in results.coords:
        raise ValueError("fragility needs curves (median and dispersion) or probability, lower and upper on level")
    here = selection.one(results, block=block, floor=floor)
    laws = selection.laws(here, model, color)
    if label is not None and len(laws) > 1:
        raise ValueError(f"label must be of one law, got {len(laws)} laws: say which model")
    ax = ax or axes.new(6.0, 4.2)
    frame = Frame.of(results)
    lines = frame.curves(here if model is None else laws[0].results)
    for i, law in enumerate(laws):
        _law(frame, ax, law, lines[i] if len(lines) else None, i=i, floor=floor, observed=observed, label=label)
    _finish(frame, ax, results)
    _name(ax, _title(here, floor, axes.width_of(ax) + 0.5))
    if legend and (len(laws) > 1 or label is not None):
        ax.legend(frameon=False, fontsize=9)
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
    """Draw one law, the law `i` of its axes: what was observed, its curve, and its entry in a legend."""
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


def _finish(frame: Frame, ax: Axes, results: xr.Dataset) -> None:
    """Set the two axes of a panel."""
    axes.level_axis(ax, frame.span.low, frame.span.high, frame.span.log, axis_name(frame.axis))
    cloud = _is_cloud(results)
    ax.set_ylim(-0.02 if not cloud else -0.06, 1.02 if not cloud else 1.06)
    ax.yaxis.set_major_formatter(PercentFormatter(1.0))
    ax.yaxis.set_major_locator(FixedLocator([0.0, 0.2, 0.4, 0.6, 0.8, 1.0]))
    ax.set_ylabel(f"probability of {results.attrs.get('state', 'overturning')}")
    axes.grid(ax)


def _name(ax: Axes, text: str) -> None:
    """Write the title of a panel at its upper edge; matplotlib would look again and again for ticks in its way."""
    ax.set_title(text, fontsize=10, y=1.0)


def _is_cloud(results: xr.Dataset) -> bool:
    return "level" not in results.coords and "intensity" in results.coords


def _has_curves(results: xr.Dataset) -> bool:
    return "median" in results or "curve_probability" in results or _tabulated(results)


def _axis(results: xr.Dataset) -> xr.DataArray:
    if "level" in results.coords or "intensity" in results.coords:
        return axis_of(results)
    # (curves without levels hold their unit and the name of their measure)
    return results["median"].assign_attrs(long_name=level_name(results))


def _tabulated(results: xr.Dataset) -> bool:
    return results.attrs.get("form") in TABULATED and "probability" in results


def _observed(results: xr.Dataset) -> bool:
    return "level" in results.coords and {"probability", "lower", "upper"} <= {*results.data_vars}


def _span(results: xr.Dataset, axis: xr.DataArray, scale: float) -> Span:
    """Return one axis for all blocks of some results, so that the panels can be compared."""
    if "level" in results.coords:
        x = axis.values / scale
        high = float(x[-1])
        if _observed(results):
            # the axis ends at the first level at which nearly every block falls
            rest = [dim for dim in results["probability"].dims if dim != "level"]
            done = np.flatnonzero((results["probability"] > 0.995).all(rest).values)
            high = float(x[done[0]] if done.size else high)
        log = axes.log_spaced(x)
        return Span(float(x[0]) / 1.06, 1.06 * high, log) if log else Span(0.0, 1.03 * high, log)
    far = math.inf
    if "median" in results:
        top = (results["median"] * np.exp(FAR * results.get("dispersion", xr.DataArray(0.0)))).values / scale
        far = float(np.nanmax(top, initial=0.0, where=np.isfinite(top))) or math.inf
    if "intensity" in results.coords:
        x = axis.values / scale
        # (a few strong motions must not compress all curves at the left)
        return Span(0.0, 1.02 * min(float(x.max()), far), False)
    return Span(0.0, far if math.isfinite(far) else 1.0, False)


def _points(ax: Axes, law: selection.DrawnLaw, x: Array, p: Array, lower: Array, upper: Array) -> None:
    errors = np.maximum(np.stack([p - lower, upper - p]), 0.0)
    ax.errorbar(x, p, yerr=errors, fmt=law.marker, ms=3.5, mew=0.0, lw=0.8, color=law.colour, alpha=0.7)


def _motions(law: selection.DrawnLaw, ax: Axes, scale: float, i: int, floor: int | str | None, state: State) -> None:
    """Draw outcomes of a cloud or of adaptive levels, and fractions in equally full bins at their mean probability."""
    one = law.results
    if RUN in one.dims:
        one = one.isel({RUN: runs_of_curve(one)})
    elif floor is not None and "motion_floor" in one.coords:
        one = one.isel(motion=np.flatnonzero(one["motion_floor"].values.astype(str) == str(floor)))
    alpha = float(one["alpha"]) if "alpha" in one.coords else math.nan
    at, fell = one["intensity"].values / scale, np.asarray(flags_of(one[needed_output(state)].values, state, alpha))
    ax.plot(at, np.where(fell, 1.02 + 0.022 * i, -0.02 - 0.022 * i), "|", ms=5.0, mew=0.7, color=law.colour, alpha=0.4)
    # (a motion and its reverse have one intensity, and are one trial of the intervals)
    sparse = RUN in one.dims
    motions = np.unique(one["run_motion"].values).size if sparse else number_of_motions(one)
    bins = min(MOST_BINS, motions // FULL_BIN)
    if bins < 2:
        return
    parts = np.array_split(np.argsort(at, kind="stable"), bins)
    falls = np.array([int(fell[part].sum()) for part in parts])
    runs = np.array([part.size for part in parts])
    if sparse:
        trials = np.array([np.unique(one["run_motion"].values[part]).size for part in parts])
    else:
        trials = runs / (at.size // motions)
    ends = wilson_interval(falls / runs * trials, trials, float(one.attrs.get("confidence", 0.95)))
    places = np.array([_place(one, at[part] * scale) for part in parts]) / scale
    _points(ax, law, places, falls / runs, np.asarray(ends[0]), np.asarray(ends[1]))


def _place(one: xr.Dataset, levels: Array) -> float:
    """Return the level at which a curve has its mean over a bin, or the geometric mean of the bin's levels."""
    mean = math.exp(float(np.log(levels).mean()))
    if not _has_curves(one):
        return mean
    along = np.geomspace(levels.min(), levels.max(), BIN_POINTS)
    curve = _curves(one, along)
    if not curve[-1] - curve[0] > LEVEL:
        return mean
    probability = float(np.interp(np.log(levels), np.log(along), curve).mean())
    return math.exp(float(np.interp(probability, curve, np.log(along))))


def _state_of(results: xr.Dataset) -> State | None:
    """Return the state of the curves of runs; None where the runs do not have the output that it is read from."""
    state = state_named(state_in(results))
    return state if state is not None and needed_output(state) in results else None


def _curves(here: xr.Dataset, x: Array) -> Array:
    """Return the fitted curve of one block at x, one row for each law; NaN where there is no curve."""
    fit = here.assign_attrs(form=here.attrs.get("form", "lognormal"))
    if "curve_probability" in here:
        fit = fit.drop_vars(["probability", "lower", "upper"], errors="ignore").rename(curve_probability="probability")
    found = curve_probability(fit, x, outside="most")
    return np.asarray(found.transpose(..., "level").values)


def _title(here: xr.Dataset, floor: int | str | None, inches: float) -> str:
    """Return the title of a panel: the block, its floor, and its sizes where they are known."""
    where = "" if floor is None else f", {floor_name(floor)}".replace("r ", "r\u00a0")
    lines = [axes.wrapped("".join([*selection.labels(here, "block"), where]), inches)]
    if {"width", "height", "alpha"} <= {*here.coords} and all(here[n].ndim == 0 for n in ("width", "height", "alpha")):
        width, height, alpha = (here[name].item() for name in ("width", "height", "alpha"))
        sizes = f"{width:.2f} m × {height:.2f} m, " + f"α = {alpha:.3f} rad".replace(" ", "\u00a0")
        lines.append(axes.wrapped(sizes, inches, 9.0))
    return "\n".join(line for line in lines if line)


def fragility_figure(results: xr.Dataset) -> Figure:
    """Return the figure of fragility curves: a panel for each block (and floor) and law, the other laws in grey."""
    floors = selection.floors(results)
    every = [(str(block), floor) for block in results["block"].values for floor in floors]
    if len(every) > MOST_PANELS:
        every = [every[i] for i in np.argsort(places(results).values.ravel())]
    laws = [str(one) for one in results["model"].values]
    most = MOST_PANELS // len(laws)
    if len(laws) > 1:
        most = min(most, MOST_ROWS // math.ceil(len(laws) / axes.columns_for(len(laws))))
    cases = every[: max(1, most)]
    # (each block has its own row where its laws, or the floors of one law, fit into one)
    if len(laws) > 1:
        columns = axes.columns_for(len(laws))
    else:
        one_row = floors != [None] and len(floors) <= axes.PANEL_COLUMNS and axes.has_room()
        columns = len(floors) if one_row else axes.columns_for(len(cases))
    each = math.ceil(len(laws) / columns) * columns if len(laws) > 1 else 1
    rows = math.ceil(len(cases) * each / columns)
    width = max(3.0 * columns, 6.4)
    height = 3.1 if rows <= LOW_ROWS or len(laws) == 1 else 2.3
    figure = axes.figure(width, height * rows + 1.0)
    # (every panel gets the same limits; with `sharey` each of them would set those of all others)
    panels = figure.subplots(rows, columns, squeeze=False)
    # (only what the panels show, a tenth of a study's variables: selecting from all of them is slow)
    cloud = "level" not in results.coords
    curves = [f"{part}{name}" for part in ("", "uplift_") for name in ("median", "dispersion")]
    wanted = {*curves, "probability", "lower", "upper", "curve_probability"}
    if cloud:
        state = _state_of(results)
        wanted |= {"run_block", "run_model", "run_motion", *([] if state is None else [needed_output(state)])}
    chosen = results[[name for name in results.data_vars if name in wanted]]
    shown = chosen if cloud else chosen.drop_vars([name for name, one in chosen.coords.items() if "motion" in one.dims])
    frame = Frame.of(shown)
    spare = set(range(rows * columns))
    for k, (block, floor) in enumerate(cases):
        here = selection.one(shown, block=block, floor=floor)
        lines = frame.curves(here)
        looks = selection.laws(here)
        for j, law in enumerate(laws):
            i = k * each + j
            spare.discard(i)
            ax = panels.flat[i]
            for other, line in enumerate(lines):
                if other != j:
                    ax.plot(frame.x, line, color="0.75", lw=1.0, zorder=0)
            _law(frame, ax, looks[j], lines[j] if len(lines) else None, floor=floor)
            _finish(frame, ax, shown)
            # (a title may extend over the numbers beside the axis)
            room = axes.width_of(ax) + 0.5
            if len(laws) > 1:
                where = "" if floor is None else f", {floor_name(floor)}"
                _name(ax, axes.wrapped(f"{block}{where}\n{axes.model_name(law)}", room))
                axes.outer_labels(ax, j, columns, len(laws))
            else:
                _name(ax, _title(here, floor, room))
                axes.outer_labels(ax, i, columns, len(cases))
    for i in spare:
        panels.flat[i].remove()
    text = _reading_note(results, len(floors), len(cases), len(every))
    axes.heading(figure, str(results.attrs.get("title", "Fragility")), text)
    return figure


def _reading_note(results: xr.Dataset, floors: int, panels: int, every: int) -> str:
    """Return the text below the title: what a reader must know to read the panels."""
    motions = number_of_motions(results) // floors
    confidence = percent(float(results.attrs.get("confidence", 0.95)))
    ways = " both ways" if POLARITY in results.coords else ""
    parts = [f"{motions} motion{'s' if motions != 1 else ''}{ways}{' a floor' if floors > 1 else ''}"]
    if panels < every or "shown_of" in results.attrs:
        by = results.attrs.get("shown_by", ORDERS[HALF])
        of = every // results.sizes["block"] * int(results.attrs.get("shown_of", results.sizes["block"]))
        parts.insert(0, f"the {panels} of {of:,} blocks{' and floors' if floors > 1 else ''} {by}")
    fell = state_in(results) == state_name(OVERTURNED)
    ends = "stood below, fell above" if fell else "state not reached below, reached above"
    fitted = bool(results["converged"].any())
    placed = ", placed by the curve's mean over the bin" if fitted else ""
    if "level" in results.coords:
        parts.append(f"points: observed, with {confidence} Wilson intervals")
    elif _state_of(results) is None:
        pass  # (curves of a surface: no runs of each block)
    elif RUN in results.dims:
        parts.append(f"ticks: every run, {ends}; points: fractions in bins{placed}, {confidence} Wilson intervals")
    else:
        parts.append(f"ticks: every motion, {ends}")
        if motions >= 2 * FULL_BIN:
            bins = min(MOST_BINS, motions // FULL_BIN)
            what = f"{bins} bins of equally many motions{placed}"
            parts.append(f"points: fractions in {what}, {confidence} Wilson intervals")
    if results.sizes["model"] > 1:
        parts.append("grey: the other laws")
    if fitted:
        parts.append(f"lines: {results.attrs.get('form', 'lognormal')} fits")
    return "; ".join(parts)
