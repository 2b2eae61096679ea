"""Sizes, colours, titles, labels and legends that all figures share, of matplotlib objects outside pyplot."""

import math
import textwrap
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from functools import wraps
from inspect import signature
from typing import Any, Literal, TypeVar, cast

import matplotlib as mpl
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.colors import is_color_like
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogFormatterSciNotation, LogLocator, MaxNLocator

from ...core import checks

# The blue of Okabe and Ito (2008) and three dark colours: contrast of 5:1 on white, different with any colour vision.
COLOURS = ("#0072B2", "#C04A00", "#007A5A", "#222222")
MARKERS = ("o", "s", "^", "D", "v", "P")
LINES = ("solid", "dotted", "dashdot")
REFERENCE = ("#222222", "X", (0, (4, 2)))
"""Colour, marker and line of the reference: black and dashed."""
GREY = "0.75"
"""Grey of curves shown for comparison."""
PAGE, COLUMN = 7.2, 3.5
"""Widths of figures for a page and for a column or a phone, inches."""
PANEL_COLUMNS = 3
"""Largest number of panels in a row of a figure."""
LETTERS = 13.0
"""Letters of 10 points that fit into one inch."""
LONG_NUMBER = 1.2
"""Width that a small number on an axis needs as a multiple of a power of ten, with adjacent space, inches."""
LOOK: dict[Any, Any] = {
    "axes.titlelocation": "left",
    "axes.titlesize": "medium",
    "figure.titleweight": "bold",
    "legend.fontsize": "medium",
    "legend.frameon": False,
}
"""Matplotlib's settings within which figures are drawn."""
SHARED = {
    ("ax",): "Matplotlib axes to draw into; by default, new axes in a new figure.",
    ("block", "model", "floor"): "Labels in the results; needed if there are several, but usually all laws are drawn.",
    ("label", "color", "linestyle"): "Matplotlib's properties of the line.",
}
"""Meanings of parameters that public functions share."""
SECTIONS = """

    Returns
    -------
    matplotlib Axes

    Raises
    ------
    TypeError, ValueError
        Results without what is drawn; no such option or label, or one that is needed and missing.
    """
"""Parts that the docstrings of all public functions have."""
Drawing = TypeVar("Drawing", bound=Callable[..., Axes])
_narrow: ContextVar[bool] = ContextVar("_narrow", default=False)


@contextmanager
def on_a_phone() -> Iterator[None]:
    """Draw the figures within for the width of a phone: panels are one below the other."""
    before = _narrow.set(True)
    try:
        yield
    finally:
        _narrow.reset(before)


@contextmanager
def defaults() -> Iterator[None]:
    """Draw and write files with matplotlib's defaults: a user's file of settings may need LaTeX, which fails late."""
    with mpl.rc_context():
        mpl.rcdefaults()
        yield


@contextmanager
def style() -> Iterator[None]:
    """Draw within this context, or a decorated function, with the look of all figures and text of 8 to 10 points."""
    size = 9.0 if has_room() else 8.0
    with mpl.rc_context({**LOOK, "font.size": size, "figure.titlesize": size + 1.0}):
        yield


def drawing(function: Drawing) -> Drawing:
    """Draw a public function in the style of all figures, and add the common sections to its docstring."""
    optional = [name for name, given in signature(function).parameters.items() if given.default is not given.empty]
    text = (function.__doc__ or "").rstrip()
    for names, meaning in SHARED.items():
        options = ", ".join(name for name in names if name in optional)
        text += f"\n    {options} : optional\n        {meaning}" if options else ""
    function.__doc__ = text + SECTIONS
    parameters = signature(function).parameters
    places = list(parameters)
    datasets = {name for name, given in parameters.items() if given.annotation is xr.Dataset}

    @wraps(function)
    def checked(*arguments: Any, **named: Any) -> Axes:
        given = {**dict(zip(places, arguments, strict=False)), **named}
        for name in given.keys() & datasets:
            if not isinstance(given[name], xr.Dataset):
                raise TypeError(f"{name} must be a dataset, got {checks.kind(given[name])}")
            checks.plain(name, given[name])
        ax, color = given.get("ax"), given.get("color")
        if ax is not None and not isinstance(ax, Axes):
            raise TypeError(f"ax must be matplotlib Axes, got {checks.kind(ax)}")
        if color is not None and not is_color_like(color):
            raise ValueError(f"color must be a colour of matplotlib, got {checks.shown(color)}")
        if np.iterable(label := given.get("label")) and not isinstance(label, str):
            raise TypeError(f"label must be text, got {checks.shown(label)}")
        return function(*arguments, **named)

    return cast("Drawing", style()(checked))


def has_room() -> bool:
    """Return True if two panels fit side by side."""
    return not _narrow.get()


def figure(height: float) -> Figure:
    """Return a new figure of a height in inches, as wide as a page, or as a column on a phone."""
    return Figure(figsize=(PAGE if has_room() else COLUMN, height), layout="constrained")


def settle(figure: Figure) -> None:
    """Compute the layout of a figure that is complete, once; saved without it, everything is drawn twice for it."""
    engine = figure.get_layout_engine()
    if engine is not None:
        engine.execute(figure)
        figure.set_layout_engine()  # (none; a placeholder, which "none" leaves, has everything drawn twice)


def panel(figure: Figure, *at: Any) -> Axes:
    """Return new axes of a figure, whose numbers keep the size of this moment's text."""
    ax = figure.add_subplot(*at)
    ax.tick_params(labelsize=mpl.rcParams["font.size"])
    return ax


def new(height: float = 4.0) -> Axes:
    """Return the axes of a new figure of a height in inches."""
    return panel(figure(height))


def colour(i: int) -> str:
    """Return colour `i` of the palette, which starts again after its last colour."""
    return COLOURS[i % len(COLOURS)]


def look(i: int) -> tuple[str, str, str]:
    """Return the colour, marker and line style of entry `i`; after a whole palette the line style changes."""
    return colour(i), MARKERS[i % len(MARKERS)], LINES[i // len(COLOURS) % len(LINES)]


def model_name(label: str) -> str:
    """Return a law's label with e_R written as a symbol with its subscript."""
    return label.replace("e_R", "$e_R$")


def sentence(text: str) -> str:
    """Return a text with a capital letter at its beginning."""
    return text[:1].upper() + text[1:]


def wrapped(text: str, inches: float) -> str:
    """Return a text in lines about equally long that fit into a width."""
    most = max(8, int(LETTERS * inches))
    return "\n".join("\n".join(_even(line, most)) for line in text.split("\n"))


def _even(line: str, most: int) -> list[str]:
    """Break a line into as few lines as needed, the longest as short as possible, so that no word is left alone."""
    lines = textwrap.wrap(line, most, break_on_hyphens=False)
    # (a width below the longest word would break that word)
    for width in range(most - 1, max(7, *map(len, line.split(" "))) - 1, -1):
        closer = textwrap.wrap(line, width, break_on_hyphens=False)
        if len(closer) > len(lines):
            break
        lines = closer
    return lines


def heading(figure: Figure, title: str, *notes: str, legend: Sequence[Axes] = ()) -> None:
    """Write a short title above all panels, and below them one legend of some panels; notes make the caption.

    The notes become the figure's label: sentences that the report prints below the figure.
    """
    figure.suptitle(wrapped(sentence(title), 0.94 * figure.get_figwidth()), x=0.01, ha="left")
    figure.set_label(" ".join(f"{sentence(note)}." for note in notes if note))
    entries = [ax.get_legend_handles_labels() for ax in legend]
    handles, labels = [item for entry in entries for item in entry[0]], [item for entry in entries for item in entry[1]]
    if len(labels) > 1:
        entry = max(len(label.replace("$", "")) for label in labels) / LETTERS * 0.9 + 0.55
        columns = max(1, min(len(labels), int(0.96 * figure.get_figwidth() / entry)))
        # (rows of equal length: five entries as 3 + 2, not 4 + 1)
        columns = math.ceil(len(labels) / math.ceil(len(labels) / columns))
        figure.legend(handles, labels, loc="outside lower center", ncols=columns)


def alone(ax: Axes, title: str, *notes: str) -> Figure:
    """Return the figure with these axes only, with its heading and legend."""
    figure = ax.figure
    assert isinstance(figure, Figure)
    heading(figure, title, *notes, legend=[ax])
    return figure


def own_legend(ax: Axes, place: Literal["best", "lower right"] = "best") -> None:
    """Add the legend of axes that have a figure of their own, if they show more than one labelled thing."""
    if len(ax.get_legend_handles_labels()[1]) > 1:
        ax.legend(loc=place)


def columns_for(panels: int) -> int:
    """Return the number of columns for a number of panels: at most three, two for four panels, one on a phone."""
    return 1 if not has_room() else 2 if panels == 4 else min(PANEL_COLUMNS, panels)


def panel_grid(
    number: int, height: float, extra: float, columns: int | None = None, shared: bool = False
) -> tuple[Figure, list[Axes], int]:
    """Return a figure, its panels row by row, and its columns; heights of a row and of all else are in inches."""
    columns = columns_for(number) if columns is None else columns
    rows = math.ceil(number / columns)
    whole = figure(height * rows + extra)
    cells = whole.add_gridspec(rows, columns)
    panels: list[Axes] = []
    for i in range(number):
        ax = panel(whole, cells[i // columns, i % columns])
        if shared and panels:
            ax.sharex(panels[0])
            ax.sharey(panels[0])
        panels.append(ax)
    return whole, panels, columns


def outer_labels(ax: Axes, i: int, columns: int, panels: int, *, ticks: bool = True) -> None:
    """Keep the axis labels of panel `i`, and with `ticks` the numbers, only at the left and the lower edge."""
    left, below = i % columns == 0, i + columns >= panels
    if not left:
        ax.set_ylabel("")
    if not below:
        ax.set_xlabel("")
    if ticks:
        ax.tick_params(labelleft=left, labelbottom=below)


def name(ax: Axes, text: str) -> None:
    """Write the title of a panel; matplotlib would look again and again for ticks in its way."""
    ax.set_title(wrapped(text, width_of(ax) + 0.3), y=1.0)


def label(ax: Axes, x: str = "", y: str = "", along: Literal["both", "x", "y"] = "both") -> Axes:
    """Label both axes, draw pale grid lines, and return the axes; the parts without an axis have no frame."""
    if x:  # next to the names of rows about half of the width is free
        ax.set_xlabel(wrapped(sentence(x), width_of(ax) * (0.65 if along == "x" else 1.0)))
    if y:
        ax.set_ylabel(wrapped(sentence(y), height_of(ax)))
    ax.grid(axis=along, alpha=0.25, lw=0.6)
    ax.set_axisbelow(True)
    ax.spines[["top", "right"]].set_visible(False)
    if along == "x":
        ax.tick_params(axis="y", length=0.0)
        ax.spines["left"].set_visible(False)
    return ax


def shares(axis: Axis) -> None:
    """Write the numbers of an axis in per cent."""
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{100.0 * value:.4g}\u00a0%"))


def probabilities(ax: Axes, state: str = "overturning", margin: float = 0.02) -> None:
    """Make the y-axis one of probabilities of a state."""
    ax.set_ylim(-margin, 1.0 + margin)
    ax.set_yticks([0.0, 0.25, 0.5, 0.75, 1.0])
    shares(ax.yaxis)
    label(ax, y=f"probability of {state}")


def named_rows(ax: Axes, names: Sequence[str], room: float = 0.45) -> None:
    """Name the rows of horizontal bars or dots, the first on top; names take at most a share `room` of the width."""
    ax.set_yticks(range(len(names)), [wrapped(text, room * width_of(ax)) for text in names])
    ax.set_ylim(len(names) - 0.4, -0.6)


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


def level_axis(ax: Axes, low: float, high: float, log: bool, text: str) -> None:
    """Set the x-axis of levels: logarithmic from `low` to `high`, or linear from zero to `high`."""
    if log:
        ax.set_xscale("log")
        ax.set_xlim(low, high)
        plain_log(ax)
    else:
        ax.set_xlim(0.0, high)
        ax.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 2.5, 5, 10]))
    label(ax, text)


def _size_of(ax: Axes, along: int) -> float:
    """Return the approximate width (0) or height (1) of axes with all adjacent texts, inches."""
    spec, figure = ax.get_subplotspec(), ax.get_figure(root=True)
    whole = 6.0 if figure is None else float(figure.get_size_inches()[along])
    if spec is None:
        return whole
    grid = spec.get_gridspec()
    return whole * (len(spec.colspan) / grid.ncols if along == 0 else len(spec.rowspan) / grid.nrows)


def width_of(ax: Axes) -> float:
    """Return the approximate width that axes have for text, inches."""
    return max(1.5, _size_of(ax, 0) - 0.7)


def height_of(ax: Axes) -> float:
    """Return the approximate height that axes have for text, inches."""
    return max(1.2, _size_of(ax, 1) - 0.5)


def plain_log(ax: Axes) -> None:
    """Write plain numbers on a logarithmic x-axis, several within a decade if there is room for them."""
    low, high = ax.get_xlim()
    decades = math.log10(high / low) if 0.0 < low < high else 1.0
    room = width_of(ax) / decades
    subs = (1.0, 2.0, 5.0) if room > 1.3 else (1.0, 3.0) if room > 0.9 else (1.0,)
    ax.xaxis.set_major_locator(ShownTicks(subs, max(1, int(width_of(ax) / LONG_NUMBER))))
    ax.minorticks_off()  # (they take a third of a figure's time)

    def text(value: float, _: int | None = None) -> str:
        left, right = ax.get_xlim()
        is_power = value > 0.0 and abs(math.log10(value) - round(math.log10(value))) < 1e-9
        few = right <= (10.0 ** (width_of(ax) / 3.0) if value < 1e-3 else 100.0) * left
        return plain_number(value) if is_power or few else ""

    ax.xaxis.set_major_formatter(FuncFormatter(text))


def plain_number(value: float) -> str:
    """Return the number of a tick; small numbers are written with powers of ten, which do not overlap."""
    if value < 1e-3:
        return str(LogFormatterSciNotation()(value))
    return f"{value:,.0f}" if value >= 1e3 else f"{value:g}"


def plain_log_y(ax: Axes) -> None:
    """Write plain numbers on a logarithmic y-axis, several within a decade unless there are more than two."""
    low, high = ax.get_ylim()
    ax.yaxis.set_major_locator(ShownTicks((1.0,) if high > 200.0 * low else (1.0, 2.0, 5.0), 5))
    ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: plain_number(value)))
    ax.yaxis.minorticks_off()


def inverse(value: Any) -> Any:
    """Return one over a rate, the years between two events, or one over those; infinite for 0."""
    with np.errstate(divide="ignore"):
        return 1.0 / np.asarray(value, dtype=float)


def years(ax: Axes, side: Literal["top", "right"]) -> None:
    """Add an axis of return periods parallel to an axis of annual rates."""
    make = ax.secondary_xaxis if side == "top" else ax.secondary_yaxis
    other = make(side, functions=(inverse, inverse))  # type: ignore[arg-type]
    axis = other.xaxis if side == "top" else other.yaxis
    axis.set_label_text("Return period (years)")
    low, high = ax.get_xlim() if side == "top" else ax.get_ylim()
    axis.set_major_locator(ShownTicks((1.0,) if high > 100.0 * low else (1.0, 3.0), 5))
    axis.set_major_formatter(FuncFormatter(lambda value, _: plain_number(float(f"{value:.2g}"))))
    axis.minorticks_off()
    other.tick_params(labelsize=mpl.rcParams["font.size"])


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
            within = [low <= times * size <= high for size in (power, 10.0 * power) for times in self._multiples]
            if sum(within) < 2:
                steps = round_ticks(self._most).tick_values(low, high)
                return [float(step) for step in steps if low <= step <= high]
        every = np.asarray(super().tick_values(vmin, vmax), dtype=float)
        shown: list[float] = every[(every >= low * (1.0 - 1e-6)) & (every <= high * (1.0 + 1e-6))].tolist()
        return shown
