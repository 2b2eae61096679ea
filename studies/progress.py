"""Progress of a running study: a bar with rate and time left on a terminal, plain lines elsewhere."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

from .watch import Watch

LINE_SECONDS = 5.0
AFTER_SECONDS = 2.0
"""Work behind the runs that takes less is not spoken of."""


@dataclass
class Display:
    """What `Study.run` tells: `update` of (runs done, in all), `watching` with the counts behind them."""

    show: Callable[[str, int, int, str], None]
    what: str
    watch: Watch | None = None
    _stage: str = ""
    _after: float = math.inf

    def watching(self, watch: Watch) -> None:
        """Take the counts of the study that begins."""
        self.watch, self._stage = watch, ""
        watch.telling = self.telling

    def telling(self, what: str, done: int, total: int) -> None:
        """Show how far the work is that follows the runs, where it takes more than a moment."""
        now = time.monotonic()
        if what != self._stage:
            self._stage, self._after = what, now + AFTER_SECONDS
        if now >= self._after:
            self.show(what, done, total, "")

    def update(self, done: int, total: int) -> None:
        """Show how far it is."""
        watch = self.watch
        if watch is None:
            self.show(self.what, done, total, "")
            return
        rate = max(watch.rate, 1e-9)
        left = f", {time_text((total - done) / rate)} left" if done < total else ""
        self.show(self.what, done, total, f"{watch.rate:,.0f}/s{left}, {watch.detail}")


def time_text(seconds: float) -> str:
    """A time for people: 12 s, 3 min, 4.5 h, 2 d."""
    for size, unit in ((86_400.0, "d"), (3_600.0, "h"), (60.0, "min")):
        if seconds >= 2.0 * size:
            return f"{seconds / size:.{int(seconds < 10.0 * size)}f} {unit}"
    return f"{seconds:.0f} s" if seconds >= 1.0 else "less than 1 s"


@contextmanager
def show_progress(console: Console, what: str, total: int) -> Iterator[Display]:
    """What shows how far the work is."""
    if not console.is_terminal:
        last = time.monotonic()

        def line(stage: str, done: int, total: int, detail: str) -> None:
            nonlocal last
            now = time.monotonic()
            if now - last >= LINE_SECONDS or done == total:
                last = now
                share = f"{100.0 * done / total:.0f} %"
                words = f"{stage}: {done:,} of {total:,} ({share}){', ' if detail else ''}{detail}"
                console.print(words, highlight=False, soft_wrap=True)

        yield Display(line, what)
        return
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[detail]}"),
    )
    with Progress(*columns, console=console) as bar:
        tasks = {what: bar.add_task(what, total=total, detail="")}

        def update(stage: str, done: int, total: int, detail: str) -> None:
            if stage not in tasks:
                tasks[stage] = bar.add_task(stage, total=total, detail="")
            bar.update(tasks[stage], completed=done, total=total, detail=detail)

        yield Display(update, what)
