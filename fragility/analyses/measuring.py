"""Measures and characteristics of motions, computed on a thread of their own while other threads run the engine.

If dask is limited to one thread, they are computed at their first use.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from typing import Self

import xarray as xr

from ...motions.arrays import Record
from ...motions.intensity.evaluation import measure_variables
from ...motions.intensity.measure import RESULT_MEASURES
from ..runs.plan import LeftError
from ..runs.runners import thread_count
from ..validity.characteristics import Characteristics

MotionProperties = tuple[dict[str, xr.Variable], Characteristics | None]
"""The measures that every result carries, and the characteristics for the screen (None without a screen)."""


class _Motions(list[Record]):
    """Motions that are gone through until they are left."""

    left = False

    def __iter__(self) -> Iterator[Record]:
        for motion in super().__iter__():
            if self.left:
                raise LeftError
            yield motion


class MeasuringThread:
    """Thread that measures motions, and stops after the motion in hand if the runs, its context, end early.

    (Interrupted, or their cluster lost.  No daemon, which Python ends within C++ code, and the process with it.)

    It starts at once; with `screen` it computes the characteristics of the motions, too.
    """

    def __init__(self, motions: Sequence[Record], screen: bool) -> None:
        self._motions = _Motions(motions)
        self._screen = screen
        self._found: MotionProperties | None = None
        self._error: Exception | None = None
        self._done = threading.Event()
        self._started = thread_count() > 1
        if self._started:
            threading.Thread(target=self._work, name="toppling-motions").start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self._motions.left = kind is not None

    def _work(self) -> None:
        try:
            measures = measure_variables(self._motions, RESULT_MEASURES)
            self._found = measures, Characteristics.of(self._motions) if self._screen else None
        except Exception as error:
            self._error = error
        self._done.set()

    def result(self) -> MotionProperties:
        """Wait for the thread and return its result, or raise its error."""
        if self._started:
            with self:
                self._done.wait()  # Python treats a thread with an interrupted join as ended, and exits
        else:
            self._work()
        if self._error is not None:
            raise self._error
        assert self._found is not None
        return self._found
