"""Characteristics of motions that the validity screen uses: frequency bands, and the peaks of half-cycles."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr

from ...core.aliases import Array
from ...core.units import HERTZ, described
from ...core.wording import given_percent
from ...motions.arrays import Record
from ...motions.intensity.peaks import half_cycle_peaks
from ...motions.intensity.spectra import BAND_SHARES, energy_band

OF_BAND = "frequency below which {} of the energy of the motion lie"


class Characteristics(NamedTuple):
    """Lower and upper end of the frequency band of each motion (motion,), Hz.

    `rising`: for each motion the peaks of its half-cycles that exceed all peaks before them, m/s².
    """

    low: xr.Variable
    high: xr.Variable
    rising: list[Array]

    @classmethod
    def of(cls, motions: Sequence[Record]) -> Characteristics:
        """Return the characteristics of motions."""
        bands = np.array([energy_band(record.acceleration, record.dt) for record in motions])
        low, high = (
            xr.Variable("motion", values, described(OF_BAND.format(given_percent(share)), HERTZ))
            for values, share in zip(bands.T, BAND_SHARES, strict=True)
        )
        peaks = (half_cycle_peaks(record.acceleration) for record in motions)
        return cls(low, high, [np.unique(np.maximum.accumulate(rising)) for rising in peaks])

    @classmethod
    def joined(cls, parts: Sequence[Characteristics]) -> Characteristics:
        """Return the characteristics of motions part after part."""
        ends = ([getattr(part, end) for part in parts] for end in ("low", "high"))
        low, high = (xr.Variable.concat(of_parts, "motion") for of_parts in ends)  # type: ignore[no-untyped-call]
        return cls(low, high, [peaks for part in parts for peaks in part.rising])

    def part(self, motions: slice) -> Characteristics:
        """Return the characteristics of some of the motions."""
        return Characteristics(self.low[motions], self.high[motions], self.rising[motions])
