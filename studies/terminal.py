"""What a command prints on: the terminal, or plain lines where the output goes elsewhere."""

from __future__ import annotations

from rich.console import Console


def say(console: Console, *lines: str) -> None:
    """Lines as they are: no markup, nothing coloured, none broken."""
    for line in lines:
        console.print(line, highlight=False, markup=False, soft_wrap=True)


def terminal(least: int = 100) -> Console:
    """The terminal, or at least so many columns where the output goes elsewhere."""
    console = Console()
    return console if console.is_terminal else Console(width=max(least, console.width))
