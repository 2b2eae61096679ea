"""How a running study is doing: counts for its progress and its log, and how it is stopped."""

from __future__ import annotations

import logging
import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType

import numpy as np

from ..fragility.plan import Done
from ..models.runs import TALLY
from .store import without_link
from .tables import StudyError

LOG_NAME = "run.log"
LOG_SECONDS = 10.0
"""Time between two lines of progress in the log."""


class Stop:
    """Whether the work is to end: asked once, chunks in flight are finished; asked again, nothing is.

    While `graceful`, SIGINT and SIGTERM ask (in the main thread, where signals can be caught).
    """

    def __init__(self) -> None:
        self.asked = False
        self.waiting = False

    def __call__(self) -> bool:
        return self.asked

    def _ask(self, number: int, frame: FrameType | None) -> None:
        if self.asked or not self.waiting:
            raise KeyboardInterrupt
        self.asked = True
        # (not by print, which a signal may have interrupted)
        os.write(2, b"toppling: finishing the chunks in flight (once more leaves them)\n")

    @contextmanager
    def graceful(self) -> Iterator[None]:
        """Catch what would end the process."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        before = {number: signal.signal(number, self._ask) for number in (signal.SIGINT, signal.SIGTERM)}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)


@dataclass
class Watch:
    """Counts of a running study; `total` is its runs in all, those that only test others included.

    `telling` is called with how far the work is that follows them.  `busy` is the time of all chunks (s, added over
    threads or workers), `storing` that of writing them here.
    """

    total: int
    log: logging.Logger
    runs: int = 0
    kept: int = 0
    chunks: int = 0
    slowest: float = 0.0
    busy: float = 0.0
    storing: float = 0.0
    tally: np.ndarray = field(default_factory=lambda: np.zeros(len(TALLY), np.int64))
    started: float = field(default_factory=time.monotonic)
    telling: Callable[[str, int, int], None] | None = None
    _logged: float = field(default_factory=time.monotonic)

    def done(self, done: Done, kept: bool) -> None:
        """A chunk more; `kept` from before, or computed now."""
        self.runs += done.runs
        self.tally += done.tally
        if kept:
            self.kept += done.runs
            return
        self.chunks += 1
        self.slowest = max(self.slowest, done.seconds)
        self.busy += done.seconds
        if self._due():
            self.log.info("%s", self.words)

    def tell(self, what: str, done: int, total: int) -> None:
        """How far the work is that follows the runs: to whoever watches (`telling`), and to the log."""
        if self.telling is not None:
            self.telling(what, done, total)
        if self._due():
            self.log.info("%s: %s of %s", what, f"{done:,}", f"{total:,}")

    def _due(self) -> bool:
        """Whether the log gets a line: once every so many seconds."""
        now = time.monotonic()
        if now - self._logged < LOG_SECONDS:
            return False
        self._logged = now
        return True

    @property
    def rate(self) -> float:
        """Runs a second, of those that were computed."""
        return (self.runs - self.kept) / max(time.monotonic() - self.started, 1e-9)

    @property
    def skipped(self) -> float:
        """Share of all samples that did not have to be computed."""
        counts = dict(zip(TALLY, self.tally.tolist(), strict=True))
        left_out = sum(counts[name] for name in TALLY if name not in ("samples", "events"))
        return float(left_out / max(counts["samples"], 1))

    @property
    def detail(self) -> str:
        """What a bar does not show."""
        return f"{100.0 * self.skipped:.0f} % of samples skipped, slowest chunk {self.slowest:.1f} s"

    @property
    def words(self) -> str:
        """All of it in one line."""
        share = 100.0 * self.runs / max(self.total, 1)
        return f"{self.runs:,} of {self.total:,} runs ({share:.0f} %), {self.rate:,.0f}/s, {self.detail}"


class _LogFile(logging.FileHandler):
    """A log that gives up quietly: what fills the disk is said where it ends the study."""

    def handleError(self, record: logging.LogRecord) -> None:
        pass

    def close(self) -> None:
        with suppress(OSError):
            super().close()


@contextmanager
def run_log(folder: Path) -> Iterator[logging.Logger]:
    """A log that goes to a file in the folder, behind what stands there; StudyError where it cannot."""
    log = logging.getLogger(f"toppling.run.{folder.resolve()}")
    log.setLevel(logging.INFO)
    log.propagate = False
    try:
        without_link(folder / LOG_NAME)
        handler = _LogFile(folder / LOG_NAME, encoding="utf-8")
    except OSError as error:
        raise StudyError(f"{folder / LOG_NAME}: cannot be written ({error.strerror})") from None
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
    log.addHandler(handler)
    try:
        yield log
    finally:
        log.removeHandler(handler)
        handler.close()
