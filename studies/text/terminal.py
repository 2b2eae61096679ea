"""Output of a command: on the terminal, or as plain lines if the output goes elsewhere."""

from collections.abc import Iterator

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment

from .encoding import printable

MOST_COLUMNS = 1000
"""Columns of an output that goes elsewhere, whatever COLUMNS says: lines of tables are filled up to them."""


def say(console: Console, *lines: str) -> None:
    """Print lines as they are: without markup, colours or line breaks."""
    for line in lines:
        console.print(line, highlight=False, markup=False, soft_wrap=True)


def terminal(least: int = 100) -> Console:
    """The console: of the terminal's width, or of `least` to `MOST_COLUMNS` columns if the output goes elsewhere."""
    console = _Printable()
    return console if console.is_terminal else _Printable(width=min(max(least, console.width), MOST_COLUMNS))


class _Printable(Console):
    """A console that a name cannot give orders to: control characters are its own."""

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterator[Segment]:
        for segment in super().render(renderable, options):
            yield segment if segment.control else segment._replace(text=printable(segment.text))
