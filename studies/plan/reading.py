"""What reading the motions of a study brought to light: doubts in records, and what was done to them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple, Self

import xarray as xr

from ...doubts import Doubt
from ...motions import records
from ...motions.matching.adjustment import matching_doubts
from ...motions.plausibility import record_doubts


class Reading(NamedTuple):
    """Doubts in records as they are used, and their processing: a line for each record, or one for all."""

    doubts: tuple[Doubt, ...] = ()
    processing: tuple[str, ...] = ()

    @classmethod
    def of(cls, arrays: Sequence[xr.DataArray]) -> Self:
        """Return the reading of motions; generated ones have no processing, and a doubt where they miss a target."""
        plain = [record for array in arrays for record in records(array)]
        missed = tuple(matching_doubts(arrays))
        if not any(record.recorded for record in plain):
            return cls(missed)
        done = [(str(array.attrs.get("processing", "")), records(array)) for array in arrays]
        notes = {note for note, _ in done}
        if len(notes) == 1:
            lines = tuple(notes - {""})
        else:
            lines = tuple(f"{record.label}: {note or 'none'}" for note, own in done for record in own)
        return cls((*record_doubts(plain), *missed), lines)

    @classmethod
    def joined(cls, parts: Iterable[Reading]) -> Self:
        """Return the reading of several sets of motions, with each doubt and line once."""
        every = list(parts)
        doubts = dict.fromkeys(one for part in every for one in part.doubts)
        lines = dict.fromkeys(line for part in every for line in part.processing)
        return cls(tuple(doubts), tuple(lines))


UNREAD = Reading()
"""The reading of motions that are generated."""
