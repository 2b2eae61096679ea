"""Monitoring of a running study: counts for its progress and its log, and the request to stop it."""

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

from ...core.wording import part_text, whole_percent
from ...core.writing import refuse_pipe
from ...fragility.runs.plan import ChunkResult
from ...models.runs import TALLY
from ..text.error import writing

LOG_NAME = "run.log"
LOG_SECONDS = 10.0
"""Time between two lines of progress in the log."""


class Interrupted(KeyboardInterrupt):
    """An interrupt with the number of its signal."""

    def __init__(self, number: int, sentence: str = "") -> None:
        super().__init__(sentence)
        self.number = number


class Stop:
    """A request to stop the work by a signal: first chunks in flight are finished, the second time they are left."""

    def __init__(self) -> None:
        self.number: int = signal.SIGINT
        self.asked = False
        self.waiting = False

    def __call__(self) -> bool:
        return self.asked

    def _ask(self, number: int, frame: FrameType | None) -> None:
        self.number = number
        if self.asked or not self.waiting:
            raise Interrupted(number)
        self.asked = True
        with suppress(OSError):  # (not with print, which the signal may have interrupted)
            os.write(2, b"toppling: finishing the chunks in flight (once more leaves them)\n")

    @contextmanager
    def graceful(self) -> Iterator[None]:
        """Catch the signals that would end the process."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        names = ("SIGINT", "SIGTERM", "SIGHUP")  # (no SIGHUP on Windows)
        before = {number: signal.getsignal(number) for name in names if (number := getattr(signal, name, None))}
        before = {number: handler for number, handler in before.items() if handler is not signal.SIG_IGN}
        for number in before:
            signal.signal(number, self._ask)
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)


@dataclass
class Watch:
    """Counts of a running study; `total` also counts runs that only test others, `busy` and `storing` are seconds."""

    total: int
    log: logging.Logger
    most: bool = False
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

    def done(self, done: ChunkResult, kept: bool) -> None:
        """Count a further chunk, `kept` from before or computed now."""
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
        """Report the progress of the work that follows the runs, by `telling` and in the log."""
        if self.telling is not None:
            self.telling(what, done, total)
        if self._due():
            self.log.info("%s: %s of %s", what, f"{done:,}", f"{total:,}")

    def _due(self) -> bool:
        """Return True if the log is due for a line, once every `LOG_SECONDS`."""
        now = time.monotonic()
        if now - self._logged < LOG_SECONDS:
            return False
        self._logged = now
        return True

    @property
    def rate(self) -> float:
        """Computed runs per second."""
        return (self.runs - self.kept) / max(time.monotonic() - self.started, 1e-9)

    def count_of(self, runs: int) -> str:
        """Return a number of runs, and their total if it is known."""
        return f"{runs:,} runs" if self.most else f"{runs:,} of {self.total:,} runs"

    @property
    def words(self) -> str:
        """The counts in one line."""
        share = f"at most {self.total:,}" if self.most else part_text(self.runs, self.total)
        return f"{self.count_of(self.runs)} ({share}), {self.pace}"

    @property
    def pace(self) -> str:
        """The rate, the share of all samples that did not have to be computed, and the time of the slowest chunk."""
        counts = dict(zip(TALLY, self.tally.tolist(), strict=True))
        skipped = sum(counts[name] for name in TALLY if name not in ("samples", "events")) / max(counts["samples"], 1)
        return f"{self.rate:,.0f}/s, {whole_percent(skipped)} of samples skipped, slowest chunk {self.slowest:.1f} s"


class _LogFile(logging.FileHandler):
    """A log that ignores write errors: a full disk is reported if it ends the study."""

    def handleError(self, record: logging.LogRecord) -> None:
        pass

    def close(self) -> None:
        with suppress(OSError):
            super().close()


@contextmanager
def run_log(folder: Path) -> Iterator[logging.Logger]:
    """Open a log that appends to a file in the folder; StudyError if it cannot be written."""
    log = logging.getLogger(f"toppling.run.{folder.resolve()}")
    log.setLevel(logging.INFO)
    log.propagate = False
    with writing(folder / LOG_NAME):
        if (folder / LOG_NAME).is_symlink():  # (the file that it points to must not be overwritten)
            (folder / LOG_NAME).unlink()
        refuse_pipe(folder / LOG_NAME)
        handler = _LogFile(folder / LOG_NAME, encoding="utf-8")
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
    log.addHandler(handler)
    try:
        yield log
    finally:
        log.removeHandler(handler)
        handler.close()
