"""A study's figures for a page, SVG in HTML and PNG for Markdown: bit-identical files."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from io import BytesIO, StringIO
from typing import TYPE_CHECKING, NamedTuple
from xml.etree import ElementTree

from ..facts.say import value_of
from ..text.names import clean

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Draw = Callable[[], Iterator[tuple[str, "Figure"]]]
"""Draws figures, each with its file name."""
LONGEST_ALT = 150
"""Largest length of an alternative text, which a screen reader reads without a pause."""
PIXELS_AN_INCH = 96.0
NARROWEST, WIDEST = 0.72, 1.15
"""Widths of a figure on a page over the width for which it was drawn: text of 9 points has at least 9 pixels."""
# Attributes of positions, in points: rounded to a hundredth, which is not visible and halves large figures.
_PLACES = ("d", "x", "y", "width", "height")
_DIGITS = re.compile(r"-?\d+\.\d{3,}(?!\d*e)")
_SENTENCE = re.compile(r"(?<=\.) (?=[A-Z0-9])")
_REFERENCE = re.compile(r"url\(#([^)]+)\)")


class Picture(NamedTuple):
    """A figure on a page: its file name, its caption without sentences of earlier figures, and the image."""

    name: str
    caption: str
    svg: str
    phone: str
    png: bytes
    alt: str


def pictures_of(draw: Draw, *, png: bool = False) -> Iterator[Picture]:
    """Yield figures as pictures; their SVG has no script, no reference outside, unique ids."""
    captions = value_of("captions", "captions")
    owners: dict[str, str] = {}
    for i, (name, figure, narrow) in enumerate(_figures(draw, phone=not png), start=1):
        svg, phone, content = "", "", b""
        if narrow is None:
            from ..plots.axes import settle  # noqa: PLC0415 - matplotlib loads slowly

            settle(figure)
            file = BytesIO()
            figure.savefig(file, format="png", dpi=150, metadata={"Software": None})
            content = file.getvalue()
        else:
            svg, phone = _svg(figure, f"f{i}-"), _svg(narrow, f"p{i}-")
        caption = captions.get(name) or captions.get(name.partition("_")[0])
        caption = f"{caption or name.replace('_', ' ').capitalize() + '.'} {_plain(str(figure.get_label()))}".strip()
        new = {sentence: name for sentence in _SENTENCE.split(caption) if owners.get(sentence, name) == name}
        owners |= new
        yield Picture(name, " ".join(new), svg, phone, content, _alternative(caption))


def _alternative(caption: str) -> str:
    """Return the alternative text of an image: its caption, of a long one the first sentences or words."""
    if len(caption) <= LONGEST_ALT:
        return caption
    stop = caption.rfind(". ", 0, LONGEST_ALT)
    return caption[: stop + 1] if stop > 0 else f"{caption[: caption.rfind(' ', 0, LONGEST_ALT - 1)]} …"


def _plain(text: str) -> str:
    """Return a figure's text without marks of mathematics."""
    return clean(text.replace(r"\$", "＄").replace("$", ""))


@contextmanager
def _settings() -> Iterator[None]:
    import matplotlib as mpl  # noqa: PLC0415 - loads slowly

    from ..plots.axes import defaults  # noqa: PLC0415

    with defaults(), mpl.rc_context({"svg.hashsalt": "toppling", "svg.fonttype": "path"}), warnings.catch_warnings():
        # (letters that the font lacks appear as boxes; the tables show the letters)
        warnings.filterwarnings("ignore", "Glyph .* missing from font")
        warnings.filterwarnings("ignore", "constrained_layout not applied")
        yield


def _figures(draw: Draw, *, phone: bool) -> Iterator[tuple[str, Figure, Figure | None]]:
    """Yield every figure, and with `phone` the same figure drawn for a phone."""
    with _settings():
        narrow = _on_a_phone(draw)
        for name, figure in draw():
            yield name, figure, next(narrow) if phone else None


def _on_a_phone(draw: Draw) -> Iterator[Figure]:
    from ..plots.axes import on_a_phone  # noqa: PLC0415 - matplotlib loads slowly

    figures = draw()
    while True:
        # (the width is set while a figure is drawn, not while its reader has it)
        with on_a_phone():
            drawn = next(figures, None)
        if drawn is None:
            return
        yield drawn[1]


def _svg(figure: Figure, prefix: str) -> str:
    """Return a figure as an HTML element: without a file's header and metadata, its ids a prefix and short numbers."""
    from ..plots.axes import settle  # noqa: PLC0415 - matplotlib loads slowly

    settle(figure)
    file = StringIO()
    figure.savefig(file, format="svg", transparent=True, metadata={"Date": None, "Creator": None})
    root = ElementTree.fromstring(re.sub(r"<!--.*?-->", "", file.getvalue(), flags=re.DOTALL))
    for parent in list(root.iter()):
        for child in list(parent):
            if _local_name(child.tag) in ("metadata", "style", "script"):
                parent.remove(child)
    # only what is referred to keeps an id, a short one: names of thousands of letters and groups are half of a figure
    values = [value for element in root.iter() for value in element.attrib.values()]
    referred = {value[1:] for value in values if value.startswith("#")}
    referred |= {name for value in values for name in _REFERENCE.findall(value)}
    ids = {name: f"{prefix}{n:x}" for n, name in enumerate(sorted(referred))}
    for element in root.iter():
        element.tag = _local_name(element.tag)
        named = [(_local_name(key), value) for key, value in element.attrib.items()]
        element.attrib = {key: _renamed(key, value, ids) for key, value in named if key != "id" or value in ids}
    for name in ("width", "height", "version"):
        root.attrib.pop(name, None)
    # limits on the width, within which the figure's text is legible
    width = PIXELS_AN_INCH * float(figure.get_figwidth())
    size = f"max-width:{WIDEST * width:.0f}px;min-width:{NARROWEST * width:.0f}px"
    root.attrib |= {"style": size, "aria-hidden": "true", "focusable": "false"}
    return ElementTree.tostring(root, encoding="unicode")


def _local_name(name: str) -> str:
    """Return a name without its namespace, which HTML does not need inside an svg element."""
    return name.rpartition("}")[2]


def _renamed(key: str, value: str, ids: dict[str, str]) -> str:
    if key == "id":
        return ids[value]
    if key in _PLACES or value.startswith("translate("):
        return " ".join(_DIGITS.sub(lambda match: f"{float(match[0]):.2f}".rstrip("0").rstrip("."), value).split())
    if key == "href" and value.startswith("#"):
        return f"#{ids[value[1:]]}"
    return _REFERENCE.sub(lambda match: f"url(#{ids[match[1]]})", value)
