"""A study's figures for a page: SVG to stand inside HTML, PNG beside Markdown, and what a figure shows in words.

The same results give the same bytes: no dates, ids from a fixed salt and unique on the page.  Text is drawn as paths,
so that a figure looks the same without its font.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO, StringIO
from typing import TYPE_CHECKING, NamedTuple
from xml.etree import ElementTree

import xarray as xr

from . import show
from .drawable import clean

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_PANELS_SAID = 6
PIXELS_AN_INCH = 96.0
NARROWEST, WIDEST = 0.72, 1.15
"""Widths of a figure on a page over that which it was drawn for: text of 9 points has at least 9 pixels."""
# Where things are, in points: a hundredth of one is not seen, and halves what figures with many curves take.
_PLACES = ("d", "x", "y", "width", "height")
_DIGITS = re.compile(r"-?\d+\.\d{3,}(?!\d*e)")
_REFERENCE = re.compile(r"url\(#([^)]+)\)")


class Picture(NamedTuple):
    """A figure on a page: file name, what it shows, what is in it, and the figure itself."""

    name: str
    caption: str
    description: str
    svg: str
    png: bytes


# What each figure shows, by the first part of its name; what is in it is read off the figure.
CAPTIONS = {
    "fragility": "Probability of overturning against the strength of shaking: fitted curves, observed shares of the "
    "motions with their intervals.",
    "risk": "Which shaking the annual rate of overturning comes from.",
    "measures": "Which measure of shaking tells best which block falls: the smaller the dispersion the better.",
    "uncertainty": "Probability of overturning with everything that is uncertain, and where its scatter comes from.",
    "sobol": "Sobol’ indices: how much of the variance each input explains, alone and with others.",
    "morris": "Morris’ elementary effects: how much each input matters, and how much that depends on the others.",
    "number": "How many pieces overturn at each level of shaking.",
    "loss": "What is lost at each level of shaking.",
    "exceedance": "How often a year so much or more falls. At the left edge: anything at all; where a line drops to "
    "the axis, none of the motions brings down more.",
    "anchoring": "What anchoring each item saves, and what is left as one after the other is anchored.",
    "median": "Medians of the fragility curves over the values that are varied.",
    "median_ratio": "Medians over those of the reference, over the values that are varied.",
    "dispersion": "Dispersions of the fragility curves over the values that are varied.",
    "probability": "Probability of overturning over the values that are varied.",
    "flipped": "Share of runs whose verdict differs from the reference’s, over the values that are varied.",
    "decay_error": "How far free rocking lies from the rigid block’s closed form, over the values that are varied.",
    "free_rocking": "Free rocking of a block let go, beside the rigid block’s.",
    "convergence": "How the response to a pulse converges as the value that is varied becomes small.",
    "tornado": "How far the median moves when one input at a time goes from its low to its high value.",
}


def pictures(results: xr.Dataset, numbers: str, *, png: bool = False) -> Iterator[Picture]:
    """Every figure of a study's results.

    Parameters
    ----------
    results : xarray.Dataset
        A study's results.
    numbers : str
        What the figures come to, in words: it ends their descriptions.
    png : bool
        Pictures of points instead of SVG.

    Yields
    ------
    Picture
        Its ``svg`` is safe inside HTML: no script, no reference that leaves it, ids that no other figure has.
    """
    for i, (name, figure) in enumerate(_drawn(results), start=1):
        described = f"{describe(figure)} {clean(numbers)}".strip()
        svg, content = ("", _png(figure)) if png else (_svg(figure, f"figure-{i}-"), b"")
        caption = CAPTIONS.get(name) or CAPTIONS.get(name.rpartition("_")[0]) or name.replace("_", " ").capitalize()
        yield Picture(name, caption, described, svg, content)


def describe(figure: Figure) -> str:
    """What a figure holds, for who does not see it: its heading, panels, axes and what its lines are called."""
    shown = [ax for ax in figure.axes if ax.get_visible() and ax.axison]
    heading = figure.get_suptitle()
    parts = [heading.rstrip(".")] if heading else []
    titles = [title for title in (ax.get_title() for ax in shown) if title]
    if titles:
        more = len(titles) - MOST_PANELS_SAID
        panels = "1 panel" if len(shown) == 1 else f"{len(shown)} panels"
        parts.append(f"{panels}: {'; '.join(titles[:MOST_PANELS_SAID])}{f'; and {more} more' if more > 0 else ''}")
    for word, labels in (
        ("Across", [ax.get_xlabel() for ax in shown]),
        ("Up", [ax.get_ylabel() for ax in shown]),
        ("Drawn", _legend(figure, shown)),
    ):
        found = list(dict.fromkeys(label for label in labels if label))
        if found:
            parts.append(f"{word}: {'; '.join(found)}")
    return clean(" ".join(f"{' '.join(part.split())}." for part in parts).replace(r"\$", "＄").replace("$", ""))


def _legend(figure: Figure, shown: list[Axes]) -> list[str]:
    legends = [*figure.legends, *(one for one in (ax.get_legend() for ax in shown) if one is not None)]
    return [text.get_text() for legend in legends for text in legend.get_texts()]


@contextmanager
def _settings() -> Iterator[None]:
    import matplotlib as mpl  # noqa: PLC0415 - loads slowly

    with (
        mpl.rc_context({"svg.hashsalt": "toppling", "svg.fonttype": "path", "font.size": 10.0}),
        warnings.catch_warnings(),
    ):
        # (a name may hold letters that the font has not: a box stands for them, tables hold them)
        warnings.filterwarnings("ignore", "Glyph .* missing from font")
        warnings.filterwarnings("ignore", "constrained_layout not applied")
        yield


def _drawn(results: xr.Dataset) -> Iterator[tuple[str, Figure]]:
    with _settings():
        yield from show.figures(results)


def _png(figure: Figure) -> bytes:
    file = BytesIO()
    figure.savefig(file, format="png", dpi=150, metadata={"Software": None})
    return file.getvalue()


def _svg(figure: Figure, prefix: str) -> str:
    """A figure as an element of HTML: without what makes it a file, ids and references under a prefix of its own."""
    file = StringIO()
    figure.savefig(file, format="svg", transparent=True, metadata={"Date": None, "Creator": None})
    root = ElementTree.fromstring(_without_comments(file.getvalue()))
    for parent in list(root.iter()):
        for child in list(parent):
            if _plain(child.tag) in ("metadata", "style", "script"):
                parent.remove(child)
    for element in root.iter():
        element.tag = _plain(element.tag)
        element.attrib = {_plain(key): _renamed(_plain(key), value, prefix) for key, value in element.attrib.items()}
    for name in ("width", "height", "version"):
        root.attrib.pop(name, None)
    # no wider than it was drawn for, and on a narrow screen no smaller than can be read: there its box scrolls
    width = PIXELS_AN_INCH * float(figure.get_figwidth())
    size = f"max-width:{WIDEST * width:.0f}px;min-width:{NARROWEST * width:.0f}px"
    root.attrib |= {"style": size, "aria-hidden": "true", "focusable": "false"}
    return ElementTree.tostring(root, encoding="unicode")


def _without_comments(text: str) -> str:
    return re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL)


def _plain(name: str) -> str:
    """A name without its namespace: HTML knows what is inside an svg element."""
    return name.rpartition("}")[2]


def _renamed(key: str, value: str, prefix: str) -> str:
    if key == "id":
        return prefix + value
    if key in _PLACES:
        return _DIGITS.sub(lambda found: f"{float(found[0]):.2f}".rstrip("0").rstrip("."), value)
    if key == "href" and value.startswith("#"):
        return f"#{prefix}{value[1:]}"
    return _REFERENCE.sub(lambda found: f"url(#{prefix}{found[1]})", value)
