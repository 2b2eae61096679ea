"""Progress of long work: a bar with rate and time left on a terminal, plain lines elsewhere."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

LINE_SECONDS = 5.0


@contextmanager
def show_progress(console: Console, what: str, total: int) -> Iterator[Callable[[int, int], None]]:
    """A function of (done, total) that shows how far the work is."""
    started = time.monotonic()
    if not console.is_terminal:
        last = started

        def line(done: int, total: int) -> None:
            nonlocal last
            now = time.monotonic()
            if now - last >= LINE_SECONDS or done == total:
                last = now
                rate = done / max(now - started, 1e-9)
                left = f", {(total - done) / rate:.0f} s left" if done < total else ""
                console.print(f"{what}: {done:,} of {total:,} ({100.0 * done / total:.0f} %), {rate:,.0f}/s{left}")

        yield line
        return
    columns = (
        TextColumn(what),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]}"),
        TimeRemainingColumn(),
        TextColumn("left"),
    )
    with Progress(*columns, console=console) as bar:
        task = bar.add_task(what, total=total, rate="")

        def update(done: int, total: int) -> None:
            rate = done / max(time.monotonic() - started, 1e-9)
            bar.update(task, completed=done, total=total, rate=f"{rate:,.0f}/s")

        yield update
