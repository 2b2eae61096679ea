"""What an analysis needs of its motions alone: worked out on a thread of its own, while others run the engine."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from typing import NamedTuple

import xarray as xr

from ..motions.arrays import Record
from ..motions.intensity import RESULT_MEASURES
from ..motions.measures import measure_variables
from .screen import Shaken


class OfMotions(NamedTuple):
    """The measures that every result carries, and what the validity screen asks (None where there is none)."""

    measures: dict[str, xr.Variable]
    shaken: Shaken | None


class Beside:
    """Begins at once; an analysis that ends early (interrupted, or its cluster lost) does not wait for it."""

    def __init__(self, plain: Sequence[Record], screen: bool) -> None:
        self._plain = list(plain)
        self._screen = screen
        self._found: OfMotions | None = None
        self._error: Exception | None = None
        self._thread = threading.Thread(target=self._work, name="toppling-motions", daemon=True)
        self._thread.start()

    def _work(self) -> None:
        try:
            measures = measure_variables(self._plain, RESULT_MEASURES)
            self._found = OfMotions(measures, Shaken.by(self._plain) if self._screen else None)
        except Exception as error:
            self._error = error

    def result(self) -> OfMotions:
        """What was found, once it is."""
        self._thread.join()
        if self._error is not None:
            raise self._error
        assert self._found is not None
        return self._found
