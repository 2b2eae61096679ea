"""Measures and characteristics of motions, computed on a thread of their own while other threads run the engine.

Where dask is told to use one thread alone, they are computed when they are asked for.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence
from typing import NamedTuple

import xarray as xr

from ...motions.arrays import Record
from ...motions.intensity.dataset import measure_variables
from ...motions.intensity.measure import RESULT_MEASURES
from ..runs.runners import thread_count
from ..validity.characteristics import Characteristics


class MotionProperties(NamedTuple):
    """The measures that every result carries, and the characteristics for the screen (None without a screen)."""

    measures: dict[str, xr.Variable]
    characteristics: Characteristics | None


class MeasuringThread:
    """Thread that measures motions; an analysis that ends early (interrupted, cluster lost) does not wait for it.

    It starts at once; with `screen` it computes the characteristics of the motions, too.
    """

    def __init__(self, motions: Sequence[Record], screen: bool) -> None:
        self._motions = list(motions)
        self._screen = screen
        self._found: MotionProperties | None = None
        self._error: Exception | None = None
        self._thread = threading.Thread(target=self._work, name="toppling-motions", daemon=True)
        self._started = thread_count() > 1
        if self._started:
            self._thread.start()

    def _work(self) -> None:
        try:
            measures = measure_variables(self._motions, RESULT_MEASURES)
            self._found = MotionProperties(measures, Characteristics.of(self._motions) if self._screen else None)
        except Exception as error:
            self._error = error

    def result(self) -> MotionProperties:
        """Wait for the thread and return what it computed, or raise its error."""
        if self._started:
            self._thread.join()
        else:
            self._work()
        if self._error is not None:
            raise self._error
        assert self._found is not None
        return self._found
