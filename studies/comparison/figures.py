"""Figures of a comparison: the curves of both studies in one panel a block and law, and their chances side by side."""

import math
from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...core.aliases import Array
from ...fragility.curves.curve import LEAST, curve_arrays, has_replicates
from ...fragility.fitting.bootstrap import percentile_interval
from ..plots import axes
from ..text.names import short_name
from ..text.reached import highest_level
from ..text.words import axis_name, axis_of, display_unit
from .curves import Curves, Place
from .ratios import CHANCE, HALF, Found, Line, Quantity, furthest, pair_text
from .sides import Side, same_measure

MOST_PANELS, MOST_DOTS = 12, 40
"""Most panels of curves and most rows of chances; those whose ratios are furthest from 1 are drawn."""
LOOKS = {"A": (axes.colour(0), "o", "solid"), "B": (axes.colour(1), "s", "dashed")}
POINTS = 200
LEAST_CHANCE = 1e-7
"""Minimum end of an interval that is drawn, on the logarithmic axis of probabilities."""


def of_curves(
    findings: Found,
    curves: tuple[Curves, Curves],
    places: list[tuple[Place, Place]],
    titles: tuple[str, str],
    confidence: str,
) -> Iterator[tuple[str, Figure]]:
    """Yield the figures of a comparison of curves, each with the name of its file."""
    levels = [line for line in findings.lines if line.quantity == HALF]
    if levels and same_measure(curves[0].side, curves[1].side):
        chosen = furthest(levels, MOST_PANELS)
        drawn = [(line, places[levels.index(line)]) for line in chosen]
        yield "curves", _panels(curves, drawn, levels, titles, confidence)
    yield from of_pieces(findings, titles, confidence)


def of_pieces(findings: Found, titles: tuple[str, str], confidence: str) -> Iterator[tuple[str, Figure]]:
    """Yield the figure of the chances of both sides if there are any, with the name of its file."""
    chances = [
        line for line in findings.lines if line.quantity == CHANCE and (line.a.value > 0.0 or line.b.value > 0.0)
    ]
    if chances:
        yield "chances", _dots(chances, findings.quantities[0], titles, confidence)


@axes.style()
def _panels(
    both: tuple[Curves, Curves],
    drawn: list[tuple[Line, tuple[Place, Place]]],
    lines: list[Line],
    titles: tuple[str, str],
    confidence: str,
) -> Figure:
    """Return the figure of the curves: a panel for each block, floor and law, A and B with bands over motions."""
    figure, panels, columns = axes.panel_grid(len(drawn), 2.3, 1.0, shared=True)
    low, high, log = _span((both[0].side, both[1].side), [line for line, _ in drawn])
    x = np.geomspace(low, high, POINTS) if log else np.linspace(high / POINTS, high, POINTS)
    results = both[0].side.results
    axis, state = axis_of(results), str(results.attrs.get("state", "overturning"))
    scale, _ = display_unit(axis)
    for i, (ax, (line, at)) in enumerate(zip(panels, drawn, strict=True)):
        for curves, where in zip(both, at, strict=True):
            _curve(curves, where, ax, x, scale)
        axes.level_axis(ax, low, high, log, axis_name(axis))
        axes.probabilities(ax, state)
        of_laws = len({line.laws for line in lines}) > 1
        text = ", ".join(filter(None, (short_name(line.name), line.place)))
        text += f"\n{axes.model_name(pair_text(*line.laws))}" if of_laws else ""
        axes.name(ax, text)
        axes.outer_labels(ax, i, columns, len(drawn))
    first = f"; the {len(drawn)} of {len(lines):,} whose levels differ most" if len(drawn) < len(lines) else ""
    notes = *_titles(titles, lines), f"bands: {confidence} intervals{first}"
    axes.heading(figure, f"Probability of {state}", *notes, legend=panels[:1])
    return figure


def _curve(curves: Curves, at: Place, ax: Axes, x: Array, scale: float) -> None:
    """Draw the curve of one side with its band, if it has one."""
    colour, _, line = LOOKS[curves.side.name]
    label = curves.side.name
    ax.plot([], [], color=colour, ls=line, lw=1.8, label=label)
    if curves.fit is None:
        level = curves.value(HALF, at)
        if math.isfinite(level.value):
            ax.axvline(level.value / scale, color=colour, ls=line, lw=1.2)
        return
    curve = curves.fit.isel(block=at[0], model=at[1])
    curve = curve.isel(floor=at[2]) if "floor" in curve.dims else curve
    x = np.minimum(x, highest_level(curves.side.results) / scale)  # (a curve ends where its runs do)
    log_x = np.log(x * scale)
    ax.plot(x, np.ravel(curve_arrays(curve)[0].probability(log_x, LEAST)), color=colour, ls=line, lw=1.8)
    if has_replicates(curve):
        drawn = curve_arrays(curve, replicates=True)[0].probability(log_x, LEAST)
        low, high, _ = percentile_interval(drawn.reshape(-1, x.size).T, float(curves.side.results.attrs["confidence"]))
        ax.fill_between(x, low, high, color=colour, alpha=0.18, lw=0.0)


def _span(sides: tuple[Side, Side], chosen: list[Line]) -> tuple[float, float, bool]:
    """Return the ends of the axis of levels that includes the levels of both sides, and True for a logarithmic axis."""
    levels = [axis_of(side.results) for side in sides]
    scale, _ = display_unit(levels[0])
    if all("level" in side.results.coords for side in sides):
        x = np.unique(np.concatenate([axis.values for axis in levels])) / scale
        log = all(axes.log_spaced(axis.values) for axis in levels)
        return float(x[0]), float(x[-1]), log
    high = max((end.value for line in chosen for end in (line.a, line.b) if math.isfinite(end.value)), default=1.0)
    return 0.0, min(3.0 * high, max(float(axis.max()) for axis in levels)) / scale, False


@axes.style()
def _dots(lines: list[Line], quantity: Quantity, titles: tuple[str, str], confidence: str) -> Figure:
    """Return the figure of the chances of both sides: a row for each block or piece, dots with intervals."""
    chosen = furthest(lines, MOST_DOTS)
    figure = axes.figure(0.42 * len(chosen) + 1.6)
    ax = axes.panel(figure)
    ends: list[float] = []
    for i, line in enumerate(chosen):
        for name, value, shift in (("A", line.a, -0.14), ("B", line.b, 0.14)):
            if not value.value > 0.0:
                continue
            colour, marker, _ = LOOKS[name]
            known = value.lower > 0.0 and math.isfinite(value.upper)
            low = max(value.lower, LEAST_CHANCE) if math.isfinite(value.lower) else value.value
            high = value.upper if math.isfinite(value.upper) else value.value
            ax.plot([100.0 * low, 100.0 * high], [i + shift] * 2, color=colour, lw=1.6, alpha=0.6)
            ax.plot(100.0 * value.value, i + shift, marker, color=colour, ms=5.5, mew=0.0)
            ends += [100.0 * value.value, 100.0 * high, *([100.0 * low] if known else [])]
    ax.set_xscale("log")
    ax.set_xlim(0.7 * min(ends), 1.4 * max(ends))
    for i, line in enumerate(chosen):
        for name, words, shift in (("A", line.said_a, -0.14), ("B", line.said_b, 0.14)):
            if words:
                at, text = ax.get_xlim()[0], f" {name}: {words}"
                ax.annotate(text, (at, i + shift), color=LOOKS[name][0], va="center")
    for name, (colour, marker, _) in LOOKS.items():
        ax.plot([], [], marker, color=colour, ms=5.5, mew=0.0, label=name)
    laws = len({line.laws for line in lines}) > 1
    parts = [(short_name(line.name), line.place, pair_text(*line.laws) if laws else "") for line in chosen]
    names = [", ".join(filter(None, part)) for part in parts]
    axes.named_rows(ax, [axes.model_name(name) for name in names])
    axes.plain_log(ax)
    axes.label(ax, f"{quantity.title} (%)", along="x")
    first = f"; the {len(chosen)} of {len(lines):,} that differ most" if len(chosen) < len(lines) else ""
    note = f"lines: {confidence} intervals{first}"
    axes.heading(figure, "Chances of both studies", *_titles(titles, lines), note, legend=[ax])
    return figure


def _titles(titles: tuple[str, str], lines: list[Line]) -> list[str]:
    """Return the titles of both studies, with their laws if these differ and there is one pair."""
    laws = {line.laws for line in lines}
    names = next(iter(laws)) if len(laws) == 1 else ("", "")
    names = names if names[0] != names[1] else ("", "")
    parts = zip("AB", map(short_name, titles), map(axes.model_name, names), strict=True)
    return [f"{name}: {', '.join(filter(None, (title, law)))}" for name, title, law in parts]
