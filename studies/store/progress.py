"""Progress of a running study: a bar with rate and time left on a terminal, plain lines elsewhere."""

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn
from rich.table import Column

from ...core.wording import part_text, time_text
from .watch import Watch

LINE_SECONDS = 5.0
BAR_WIDTH = 20
AFTER_SECONDS = 2.0
"""Work after the runs that takes less time is not shown."""


@dataclass
class Display:
    """Display of progress: `Study.run` calls `update` with (runs done, all runs), and `watching` with its counts."""

    show: Callable[[str, int, int, str], None]
    what: str
    aside: int = 0
    watch: Watch | None = None
    _shown: tuple[int, int] = (0, 0)
    _told: int = 0
    _stage: str = ""
    _after: float = math.inf

    def watching(self, watch: Watch) -> None:
        """Take over the counts of the study that begins."""
        self.watch, self._stage, self._shown, self._told = watch, "", (0, 0), 0
        watch.telling = self.telling

    def telling(self, what: str, done: int, total: int) -> None:
        """Show the progress of the work that follows the runs, if it takes more than a moment."""
        if self.aside and self.watch is not None:
            self._show_runs(self.watch, self._all_runs(self.watch, done, total))
        now = time.monotonic()
        if what != self._stage:
            self._stage, self._after = what, now + AFTER_SECONDS
        if now >= self._after:
            self.show(what, done, total, "")

    def update(self, done: int, total: int) -> None:
        """Show the progress of the runs."""
        if self.watch is None:
            self.show(self.what, done, total, "")
        else:
            self._told = self.watch.runs
            self._show_runs(self.watch, total + self.aside)

    def _all_runs(self, watch: Watch, done: int, total: int) -> int:
        """Return the expected number of runs if `done` of `total` parts of the excluded runs are done."""
        further = watch.runs - self._told
        if further == 0 or done == 0:
            return self._shown[1]
        return self._told + math.ceil(further * total / done)

    def finished(self) -> None:
        """Show that all runs are done, if that was not shown."""
        watch = self.watch
        if watch is not None and self._shown != (watch.runs, watch.runs):
            self._shown = watch.runs, watch.runs
            self.show(self.what, *self._shown, "")

    def _show_runs(self, watch: Watch, expected: int) -> None:
        """Show the runs that are done, of those that are expected or, if it is known, of all."""
        done = watch.runs
        total = max(done, expected if watch.most else watch.total)
        self._shown = done, total
        if done == watch.kept and done < total:  # (how long the rest takes is not known yet)
            self.show(self.what, done, total, "kept from before" if done else "")
            return
        left = f"{time_text((total - done) / watch.rate)} left" if done < total else ""
        self.show(self.what, done, total, left)


@contextmanager
def show_progress(console: Console, what: str, total: int | None, aside: int = 0) -> Iterator[Display]:
    """Make the display of the progress: a bar on a terminal, lines elsewhere; total: None if it is not known yet."""
    if not console.is_terminal:
        last = time.monotonic()

        def line(stage: str, done: int, total: int, detail: str) -> None:
            nonlocal last
            now = time.monotonic()
            if now - last >= LINE_SECONDS or done == total:
                last = now
                words = f"{stage}: {part_text(done, total)}{', ' if detail else ''}{detail}"
                console.print(words, highlight=False, soft_wrap=True)

        yield Display(line, what, aside)
        return
    columns = (
        TextColumn("{task.description}"),
        BarColumn(BAR_WIDTH),
        MofNCompleteColumn(),
        # (what has no room is cut here, and not from the numbers)
        TextColumn("{task.fields[detail]}", table_column=Column(ratio=1, no_wrap=True, overflow="ellipsis")),
    )
    with Progress(*columns, console=console, expand=True) as bar:
        tasks = {what: bar.add_task(what, total=total, detail="")}

        def update(stage: str, done: int, total: int, detail: str) -> None:
            if stage not in tasks:
                tasks[stage] = bar.add_task(stage, total=total, detail="")
            bar.update(tasks[stage], completed=done, total=total, detail=detail)

        yield Display(update, what, aside)
