"""What all figures share: colours and markers of laws, axes of levels, legends and headings.

Figures are matplotlib's own objects and never pyplot's: nothing is left open, and no backend is chosen for the user.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogFormatterMathtext, LogLocator, MaxNLocator, NullFormatter
from numpy.typing import NDArray

from .. import checks
from .words import display_unit, floor_name

__all__ = [
    "COLOURS",
    "MARKERS",
    "PANEL_COLUMNS",
    "REFERENCE",
    "Drawn",
    "display_unit",
    "floor_name",
    "floors_of",
    "grid",
    "heading",
    "labels_of",
    "laws_of",
    "legend_below",
    "level_axis",
    "level_index",
    "log_spaced",
    "lowest_panels",
    "model_name",
    "new_axes",
    "one_of",
    "own_legend",
    "plain_log",
    "styles",
    "wrapped",
]

# Okabe and Ito (2008): told apart with any colour vision; black and dashed is the reference.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
MARKERS = ("o", "s", "^", "D", "v", "P")
REFERENCE = ("#000000", "X", (0, (4, 2)))
LINES = ("solid", "dotted", "dashdot")
PANEL_COLUMNS = 3
# Letters that an inch holds, of text of 10 points.
LETTERS = 13.0


def new_axes(width: float, height: float) -> Axes:
    """Axes in a figure of their own, inches."""
    return Figure(figsize=(width, height), layout="constrained").add_subplot()


def wrapped(text: str, inches: float, size: float = 10.0) -> str:
    """Text broken into lines that fit a width, at spaces (no-break spaces hold), all about as long."""
    most = max(8, int(LETTERS * inches * 10.0 / size))
    return "\n".join("\n".join(_even(line, most)) for line in text.split("\n"))


def _even(line: str, most: int) -> list[str]:
    """No more lines than needed, the longest as short as it can be: no word stands alone in the last."""
    found = textwrap.wrap(line, most, break_on_hyphens=False)
    # (narrower than its longest word text would be broken within it)
    for width in range(most - 1, max(7, *map(len, line.split(" "))) - 1, -1):
        closer = textwrap.wrap(line, width, break_on_hyphens=False)
        if len(closer) > len(found):
            break
        found = closer
    return found


def heading(figure: Figure, title: str, text: str = "") -> None:
    """A title above all panels, and below it what must be known to read them."""
    width = 0.94 * figure.get_figwidth()
    size = 11.0 if width > 7.0 else 10.0
    figure.suptitle("\n".join(wrapped(one, width, size) for one in (title, text) if one), fontsize=size)


def own_legend(ax: Axes, place: Literal["best", "lower right"] = "best") -> None:
    """The legend of axes in a figure of their own, where there is more than one thing to tell apart."""
    if len(ax.get_legend_handles_labels()[1]) > 1:
        ax.legend(frameon=False, fontsize=9, loc=place)


def legend_below(figure: Figure, handles: Sequence[Artist], labels: Sequence[str]) -> None:
    """One legend for all panels, in as many columns as fit."""
    if not labels:
        return
    entry = max(len(label.replace("$", "")) for label in labels) / LETTERS * 0.9 + 0.55
    columns = max(1, min(len(labels), int(0.96 * figure.get_figwidth() / entry)))
    # (rows of one length: five as 3 + 2, not 4 + 1)
    columns = math.ceil(len(labels) / math.ceil(len(labels) / columns))
    figure.legend(handles, labels, loc="outside lower center", ncols=columns, frameon=False, fontsize=9)


def lowest_panels(axes: NDArray[Any], panels: int) -> set[int]:
    """Which of so many panels, filled in row by row, have no other below."""
    return {i for i in range(panels) if i + axes.shape[1] >= panels}


def grid(ax: Axes, along: str = "both") -> None:
    """Pale lines, and no frame where there is no axis."""
    ax.grid(axis=along, alpha=0.25, lw=0.6)  # type: ignore[arg-type]
    ax.set_axisbelow(True)
    ax.spines[["top", "right"]].set_visible(False)
    if along == "x":
        ax.tick_params(axis="y", length=0.0)
        ax.spines["left"].set_visible(False)


def log_spaced(levels: Any) -> bool:
    """Whether levels lie more evenly on a logarithmic axis than on a plain one."""
    x = np.asarray(levels, dtype=float)
    if x.size < 3 or x[0] <= 0.0 or x[-1] < 3.0 * x[0]:
        return False
    steps, ratios = np.diff(x), np.diff(np.log(x))
    return bool(ratios.std() / ratios.mean() < steps.std() / steps.mean())


def level_axis(ax: Axes, low: float, high: float, log: bool, name: str) -> None:
    """An x-axis of levels from `low` to `high`: logarithmic, or from zero."""
    if log:
        ax.set_xscale("log")
        ax.set_xlim(low, high)
        plain_log(ax)
    else:
        ax.set_xlim(0.0, high)
        ax.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 2.5, 5, 10]))
    ax.set_xlabel(wrapped(name, width_of(ax)))


def width_of(ax: Axes) -> float:
    """About the width that axes have for text, inches."""
    spec = ax.get_subplotspec()
    figure = ax.get_figure(root=True)
    whole = 6.0 if figure is None else float(figure.get_figwidth())
    return max(1.5, (whole if spec is None else whole / spec.get_gridspec().ncols) - 0.7)


def plain_log(ax: Axes) -> None:
    """Numbers as people write them on a logarithmic x-axis: a few within a decade where there is room for them."""
    low, high = ax.get_xlim()
    decades = math.log10(high / low) if 0.0 < low < high else 1.0
    room = width_of(ax) / decades
    subs = (1.0, 2.0, 5.0) if room > 1.3 else (1.0, 3.0) if room > 0.9 else (1.0,)
    ax.xaxis.set_major_locator(LogLocator(subs=subs))
    # (small numbers as powers, which do not run into each other)
    tiny = LogFormatterMathtext()

    def text(value: float, _: int | None = None) -> str:
        left, right = ax.get_xlim()
        if (value < 1e-3 or right > 100.0 * left) and not is_power(value):
            return ""
        return f"{value:,g}" if value >= 1e-3 else str(tiny(value))

    ax.xaxis.set_major_formatter(FuncFormatter(text))
    ax.xaxis.set_minor_formatter(NullFormatter())


def is_power(value: float) -> bool:
    """Whether a number is a power of ten."""
    return value > 0.0 and abs(math.log10(value) - round(math.log10(value))) < 1e-9


def styles(results: xr.Dataset) -> list[tuple[str, str, Any]]:
    """Colour, marker and line style of each model: the first Housner black and dashed, the others in order."""
    labels = labels_of(results, "model")
    laws = results.get("law")
    if laws is None or "model" not in laws.dims:
        along = [""] * len(labels)
    else:
        # (an uncertain law is another in every sample: then there is no reference among the models)
        along = [str(law) for law in laws.isel({dim: 0 for dim in laws.dims if dim != "model"}).values]
    chosen: list[tuple[str, str, Any]] = []
    for law in along:
        if law == "housner" and REFERENCE not in chosen:
            chosen.append(REFERENCE)
            continue
        i = sum(style != REFERENCE for style in chosen)
        chosen.append((COLOURS[i % len(COLOURS)], MARKERS[i % len(MARKERS)], LINES[i // len(COLOURS) % len(LINES)]))
    return chosen


class Drawn(NamedTuple):
    """A law to be drawn: its label, its part of the results, and how it looks wherever it is drawn."""

    label: str
    results: xr.Dataset
    colour: str
    marker: str
    line: Any


def laws_of(results: xr.Dataset, model: str | None = None, color: str | None = None) -> list[Drawn]:
    """Every law of some results, or the one called `model`, in the look that it has among all.

    Raises
    ------
    ValueError
        No such law; one colour for several laws.
    """
    labels = labels_of(results, "model")
    if model is not None:
        checks.choice("model", model, labels)
    found = []
    for i, (label, (colour, marker, line)) in enumerate(zip(labels, styles(results), strict=True)):
        if model is None or label == model:
            here = results.isel(model=i) if "model" in results.dims else results
            found.append(Drawn(model_name(label), here, color or colour, marker, line))
    if color is not None and len(found) > 1:
        raise ValueError(f"color must be of one law, got {len(found)} laws: say which model")
    return found


def model_name(label: str) -> str:
    """A law's label with the field's subscript."""
    return label.replace("e_R", "$e_R$")


def labels_of(results: xr.Dataset, dim: str) -> list[str]:
    """Labels along a dimension; one, the coordinate's or an empty one, where there is no such dimension."""
    if dim not in results.dims:
        return [str(results[dim].item())] if dim in results.coords and results[dim].ndim == 0 else [""]
    return [str(one) for one in results[dim].values]


def floors_of(results: xr.Dataset) -> list[int | str | None]:
    """The floors that results tell apart; None alone where they do not."""
    return list(results["floor"].values.tolist()) if "floor" in results.dims else [None]


def one_of(results: xr.Dataset, dim: str, label: str | int | None) -> xr.Dataset:
    """Results of one block (law, floor, place): the one called so, or the only one.

    Raises
    ------
    ValueError
        Several, and none is said; none called so.
    """
    if dim not in results.dims:
        return results
    labels = labels_of(results, dim)
    if label is None:
        if len(labels) > 1:
            few = ", ".join(labels[:8]) + (", …" if len(labels) > 8 else "")
            raise ValueError(f"results are of several {dim}s, say which: {few}")
        return results.isel({dim: 0})
    return results.isel({dim: labels.index(checks.choice(dim, str(label), labels))})


def level_index(results: xr.Dataset, level: float) -> int:
    """Where a level (SI) stands among those of some results; ValueError where it is none of them."""
    levels = results["level"].values
    close = np.flatnonzero(np.isclose(levels, checks.number("level", level), rtol=1e-6, atol=0.0))
    if not close.size:
        raise ValueError(f"level must be one of {', '.join(f'{one:.6g}' for one in levels)}, got {level:g}")
    return int(close[0])
