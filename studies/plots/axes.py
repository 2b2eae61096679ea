"""Axes, legends, headings and colours that all figures share, of matplotlib objects outside pyplot."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, Literal

import numpy as np
from matplotlib import rcParams
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backend_bases import RendererBase
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import (
    FuncFormatter,
    LogFormatterSciNotation,
    LogLocator,
    MaxNLocator,
    NullFormatter,
    NullLocator,
)

# The palette of Okabe and Ito (2008), which readers with any colour vision can tell apart.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
MARKERS = ("o", "s", "^", "D", "v", "P")
LINES = ("solid", "dotted", "dashdot")
REFERENCE = ("#000000", "X", (0, (4, 2)))
"""Colour, marker and line of the reference: black and dashed."""
PANEL_COLUMNS = 3
"""Panels in a row of a figure at the most."""
LETTERS = 13.0
"""Letters of 10 points that fit into one inch."""
LONG_NUMBER = 1.2
"""Width that a small number on an axis needs as a multiple of a power of ten, with the space beside it, inches."""
PHONE = 3.7
"""Width of a figure for a phone, inches."""
_widest: ContextVar[float] = ContextVar("_widest", default=math.inf)


@contextmanager
def on_a_phone() -> Iterator[None]:
    """Draw the figures within for the width of a phone: panels stand one below the other."""
    before = _widest.set(PHONE)
    try:
        yield
    finally:
        _widest.reset(before)


def has_room() -> bool:
    """Return whether two panels fit beside each other."""
    return math.isinf(_widest.get())


def figure(width: float, height: float) -> Figure:
    """Return a new figure of a width and a height in inches, no wider than the page that it is drawn for."""
    return Figure(figsize=(min(width, _widest.get()), height), layout="constrained")


def settle(figure: Figure) -> None:
    """Compute the layout of a figure that is complete, once; saved without it, everything is drawn twice for it."""
    engine = figure.get_layout_engine()
    if engine is not None:
        engine.execute(figure)
        figure.set_layout_engine()  # (none; a placeholder, which "none" leaves, has everything drawn twice)


def new(width: float, height: float) -> Axes:
    """Return the axes of a new figure of a width and a height in inches."""
    return figure(width, height).add_subplot()


def colour(i: int) -> str:
    """Return colour `i` of the palette, which starts again after its last colour."""
    return COLOURS[i % len(COLOURS)]


def look(i: int) -> tuple[str, str, str]:
    """Return the colour, marker and line style of entry `i`; after a whole palette the line style changes."""
    return colour(i), MARKERS[i % len(MARKERS)], LINES[i // len(COLOURS) % len(LINES)]


def model_name(label: str) -> str:
    """Return a law's label with e_R written as a symbol with its subscript."""
    return label.replace("e_R", "$e_R$")


def wrapped(text: str, inches: float, size: float = 10.0) -> str:
    """Return a text in lines about equally long that fit into a width; `size` is the size of the letters in points."""
    most = max(8, int(LETTERS * inches * 10.0 / size))
    return "\n".join("\n".join(_even(line, most)) for line in text.split("\n"))


def _even(line: str, most: int) -> list[str]:
    """Break a line into as few lines as needed, the longest as short as possible, so that no word is left alone."""
    found = textwrap.wrap(line, most, break_on_hyphens=False)
    # (a width below the longest word would break that word)
    for width in range(most - 1, max(7, *map(len, line.split(" "))) - 1, -1):
        closer = textwrap.wrap(line, width, break_on_hyphens=False)
        if len(closer) > len(found):
            break
        found = closer
    return found


def heading(figure: Figure, title: str, text: str = "") -> None:
    """Write a title above all panels, and below the title what a reader must know to read the panels."""
    width = 0.94 * figure.get_figwidth()
    size = 11.0 if width > 7.0 else 10.0
    figure.suptitle("\n".join(wrapped(one, width, size) for one in (title, text) if one), fontsize=size)


def own_legend(ax: Axes, place: Literal["best", "lower right"] = "best") -> None:
    """Add the legend of axes that have a figure of their own, where they show more than one labelled thing."""
    if len(ax.get_legend_handles_labels()[1]) > 1:
        ax.legend(frameon=False, fontsize=9, loc=place)


def legend_below(figure: Figure, handles: Sequence[Artist], labels: Sequence[str]) -> None:
    """Add one legend for all panels below them, in as many columns as fit."""
    if not labels:
        return
    entry = max(len(label.replace("$", "")) for label in labels) / LETTERS * 0.9 + 0.55
    columns = max(1, min(len(labels), int(0.96 * figure.get_figwidth() / entry)))
    # (rows of equal length: five entries as 3 + 2, not 4 + 1)
    columns = math.ceil(len(labels) / math.ceil(len(labels) / columns))
    figure.legend(handles, labels, loc="outside lower center", ncols=columns, frameon=False, fontsize=9)


def columns_for(panels: int) -> int:
    """Return the number of columns for a number of panels: three at the most, two for four panels, one on a phone."""
    return 1 if not has_room() else 2 if panels == 4 else min(PANEL_COLUMNS, panels)


def panel_grid(
    number: int,
    each: tuple[float, float],
    beside: tuple[float, float],
    least: float = 0.0,
    columns: int | None = None,
    shared: bool = False,
) -> tuple[Figure, list[Axes], int]:
    """Return a figure, its panels row by row, and its columns; sizes are in inches, `least` of the whole width."""
    columns = columns_for(number) if columns is None else columns
    rows = math.ceil(number / columns)
    whole = figure(max(each[0] * columns + beside[0], least), each[1] * rows + beside[1])
    panels = list(whole.subplots(rows, columns, squeeze=False, sharex=shared, sharey=shared).flat)
    for ax in panels[number:]:
        ax.remove()
    return whole, panels[:number], columns


def outer_labels(ax: Axes, i: int, columns: int, panels: int, *, ticks: bool = True) -> None:
    """Keep the axis labels of panel `i`, and with `ticks` the numbers, only at the left and the lower edge."""
    left, below = i % columns == 0, i + columns >= panels
    if not left:
        ax.set_ylabel("")
    if not below:
        ax.set_xlabel("")
    if ticks:
        ax.tick_params(labelleft=left, labelbottom=below)


def grid(ax: Axes, along: str = "both") -> None:
    """Draw pale grid lines, and remove the frame on the sides that have no axis."""
    ax.grid(axis=along, alpha=0.25, lw=0.6)  # type: ignore[arg-type]
    ax.set_axisbelow(True)
    ax.spines[["top", "right"]].set_visible(False)
    if along == "x":
        ax.tick_params(axis="y", length=0.0)
        ax.spines["left"].set_visible(False)


def named_rows(ax: Axes, names: Sequence[str], **text: Any) -> None:
    """Name the rows of horizontal bars or dots, the first on top, and draw the grid across them."""
    ax.set_yticks(range(len(names)), names, **text)
    ax.set_ylim(len(names) - 0.4, -0.6)
    grid(ax, "x")


def round_ticks(most: int, *, whole: bool = False) -> MaxNLocator:
    """Return a locator of at most `most` intervals at 1, 2 or 5 times powers of ten, with `whole` at integers alone."""
    return MaxNLocator(most, integer=whole, steps=[1, 2, 5, 10])


def log_spaced(levels: Any) -> bool:
    """Return True if levels are spaced more evenly on a logarithmic axis than on a linear one."""
    x = np.asarray(levels, dtype=float)
    if x.size < 3 or x[0] <= 0.0 or x[-1] < 3.0 * x[0]:
        return False
    steps, ratios = np.diff(x), np.diff(np.log(x))
    return bool(ratios.std() / ratios.mean() < steps.std() / steps.mean())


def level_axis(ax: Axes, low: float, high: float, log: bool, name: str) -> None:
    """Set the x-axis of levels: logarithmic from `low` to `high`, or linear from zero to `high`."""
    if log:
        ax.set_xscale("log")
        ax.set_xlim(low, high)
        plain_log(ax)
    else:
        ax.set_xlim(0.0, high)
        ax.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 2.5, 5, 10]))
    ax.set_xlabel(wrapped(name, width_of(ax)))


def width_of(ax: Axes) -> float:
    """Return the approximate width that axes have for text, inches."""
    spec = ax.get_subplotspec()
    figure = ax.get_figure(root=True)
    whole = 6.0 if figure is None else float(figure.get_figwidth())
    return max(1.5, (whole if spec is None else whole / spec.get_gridspec().ncols) - 0.7)


def plain_log(ax: Axes) -> None:
    """Write plain numbers on a logarithmic x-axis, several within a decade where there is room for them."""
    low, high = ax.get_xlim()
    decades = math.log10(high / low) if 0.0 < low < high else 1.0
    room = width_of(ax) / decades
    subs = (1.0, 2.0, 5.0) if room > 1.3 else (1.0, 3.0) if room > 0.9 else (1.0,)
    ax.xaxis.set_major_locator(ShownTicks(subs, max(1, int(width_of(ax) / LONG_NUMBER))))

    def text(value: float, _: int | None = None) -> str:
        left, right = ax.get_xlim()
        is_power = value > 0.0 and abs(math.log10(value) - round(math.log10(value))) < 1e-9
        return plain_number(value) if is_power or right <= (10.0 if value < 1e-3 else 100.0) * left else ""

    ax.xaxis.set_major_formatter(FuncFormatter(text))
    for one in ax.artists:
        if isinstance(one, MinorTicks):
            one.remove()
    ax.add_artist(MinorTicks(ax))


def plain_number(value: float) -> str:
    """Return the number of a tick; small ones are written with powers of ten, which do not overlap."""
    return f"{value:,g}" if value >= 1e-3 else str(LogFormatterSciNotation()(value))


def inverse(value: Any) -> Any:
    """Return one over a rate, the years between two events, or one over those; infinite for 0."""
    with np.errstate(divide="ignore"):
        return 1.0 / np.asarray(value, dtype=float)


def plain_log_y(ax: Axes) -> None:
    """Write plain numbers on a logarithmic y-axis, several within a decade unless there are more than two."""
    low, high = ax.get_ylim()
    ax.yaxis.set_major_locator(ShownTicks((1.0,) if high > 200.0 * low else (1.0, 2.0, 5.0), 5))
    ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: plain_number(value)))
    ax.yaxis.set_minor_formatter(NullFormatter())


class ShownTicks(LogLocator):
    """The logarithmic ticks within the limits, or at most `most` equal round steps with fewer than two `subs`."""

    def __init__(self, subs: Sequence[float], most: int) -> None:
        super().__init__(subs=subs)
        self._multiples, self._most = subs, most

    def tick_values(self, vmin: float, vmax: float) -> list[float]:
        """Return the ticks from `vmin` to `vmax`, with those that rounding puts just beyond."""
        low, high = sorted((vmin, vmax))
        if 0.0 < low < high < 10.0 * low:
            power = 10.0 ** math.floor(math.log10(low))
            within = [low <= one * size <= high for size in (power, 10.0 * power) for one in self._multiples]
            if sum(within) < 2:
                steps = round_ticks(self._most).tick_values(low, high)
                return [float(one) for one in steps if low <= one <= high]
        every = np.asarray(super().tick_values(vmin, vmax), dtype=float)
        shown: list[float] = every[(every >= low * (1.0 - 1e-6)) & (every <= high * (1.0 + 1e-6))].tolist()
        return shown


class MinorTicks(Artist):
    """The short ticks of a logarithmic x-axis, drawn together: matplotlib's take a third of a figure's time."""

    def __init__(self, ax: Axes) -> None:
        super().__init__()
        self._axis = ax.xaxis
        self._locator = LogLocator(subs="auto")
        self._locator.set_axis(ax.xaxis)
        ax.xaxis.set_minor_locator(NullLocator())
        self.set_in_layout(False)
        self.set_zorder(ax.xaxis.get_zorder())

    def draw(self, renderer: RendererBase) -> None:
        """Draw a tick at each place of matplotlib's locator of minor ticks that has none of the longer ticks."""
        ax, figure = self.axes, self.get_figure()
        if ax is None or figure is None or not self.get_visible():
            return
        low, high = sorted(ax.get_xlim())
        longer = self._axis.get_majorticklocs()
        at = [x for x in self._locator() if low <= x <= high and not np.isclose(x, longer, rtol=1e-9, atol=0.0).any()]
        ticks = Line2D(
            at,
            np.zeros(len(at)),
            color=rcParams["xtick.color"],
            linestyle="none",
            marker=3,  # (matplotlib's TICKDOWN)
            markersize=rcParams["xtick.minor.size"],
            markeredgewidth=rcParams["xtick.minor.width"],
            transform=ax.get_xaxis_transform(),
        )
        ticks.set_figure(figure)
        ticks.draw(renderer)
