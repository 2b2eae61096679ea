"""What making or reading the motions of a study brought to light: doubts, processing, and their scenario."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple, Self

import xarray as xr

from ...doubts import Doubt
from ...motions import Generator, over_model, records
from ...motions.matching.adjustment import matching_doubts
from ...motions.plausibility import record_doubts

MODEL = "BSSA14"
FAR = 1.5
"""Ratio to a ground-motion model's median, or its inverse, from which the amplitude of a scenario is doubted."""


class Reading(NamedTuple):
    """Doubts in records as they are used, their processing (a line for each record, or one for all), and scenarios.

    scenario: a line for each simulated earthquake, with its motions' PGA and PGV over those of a ground-motion model.
    far: the doubts in these amplitudes, which matter where motions are not scaled.
    """

    doubts: tuple[Doubt, ...] = ()
    processing: tuple[str, ...] = ()
    scenario: tuple[str, ...] = ()
    far: tuple[Doubt, ...] = ()

    @classmethod
    def of(cls, arrays: Sequence[xr.DataArray], generator: Generator | None = None) -> Self:
        """Return the reading of motions, and of the generator that made them, which may miss a target or a scenario."""
        if generator is not None:
            return cls._of_scenario(arrays, generator)
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
    def _of_scenario(cls, arrays: Sequence[xr.DataArray], generator: Generator) -> Self:
        doubts = matching_doubts(arrays)
        if generator.outside:
            doubts.append(
                Doubt("scenario", f"the scenario lies outside of the data behind its equations ({generator.outside})")
            )
        at = generator.scenario
        if at is None or sum(array.sizes["motion"] for array in arrays) < 2:
            return cls(tuple(doubts))
        try:
            ratios = over_model(list(arrays), at, periods=())["ratio"].values
        except ValueError:  # (a scenario beyond the range of the model has nothing to be held against)
            return cls(tuple(doubts))
        line = f"{at.text}: PGA {ratios[0]:.2f}, PGV {ratios[1]:.2f} times the median of {MODEL}"
        far = [Doubt("scenario", f"the motions are not of the strength to be expected ({line})")]
        odd = not 1.0 / FAR <= min(ratios) <= max(ratios) <= FAR
        return cls(tuple(doubts), (), (line,), tuple(far if odd else ()))

    @classmethod
    def joined(cls, parts: Iterable[Reading]) -> Self:
        """Return the reading of several sets of motions, with each doubt and line once."""
        every = list(parts)
        doubts = dict.fromkeys(one for part in every for one in part.doubts)
        lines = dict.fromkeys(line for part in every for line in part.processing)
        scenarios = dict.fromkeys(line for part in every for line in part.scenario)
        far = dict.fromkeys(one for part in every for one in part.far)
        return cls(tuple(doubts), tuple(lines), tuple(scenarios), tuple(far))


UNREAD = Reading()
"""The reading of motions that are generated."""
