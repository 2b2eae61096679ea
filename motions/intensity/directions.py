"""Measures of both horizontal components of a recording: RotD50, RotD100 and the geometric mean."""

import math
from abc import abstractmethod
from dataclasses import dataclass

import numpy as np

from ...core.aliases import Array
from ..arrays import Record
from .measure import Measure

STEPS = 180
"""Directions, one degree apart, in which a pair is measured."""


@dataclass(frozen=True)
class PairMeasure(Measure):
    """Measure of a pair of horizontal components, made of the measure `base` of one motion."""

    base: Measure

    @property
    def power(self) -> float:  # type: ignore[override]
        return self.base.power

    @property
    def label(self) -> str:
        return f"{type(self).__name__}({self.base.label})"

    @property
    def units(self) -> str:
        return self.base.units

    @property
    def long_name(self) -> str:
        return f"{type(self).__name__} of the {self.base.long_name}"

    def of(self, acceleration: Array, dt: float) -> float:
        """Raise ValueError: one component has no such measure."""
        raise ValueError(
            f"{self.label} needs both horizontal components of a recording (motions.join; in a study motions.component)"
        )

    def of_record(self, record: Record) -> float:
        if record.companion is None:
            return self.of(record.acceleration, record.dt)
        return self.of_pair(record.acceleration, record.companion, record.dt)

    @abstractmethod
    def of_pair(self, first: Array, second: Array, dt: float) -> float:
        """Return the value for two perpendicular components (n,), m/s²."""


class _Rotated(PairMeasure):
    percentile: float

    def of_pair(self, first: Array, second: Array, dt: float) -> float:
        angles = np.arange(STEPS) * (math.pi / STEPS)
        values = [self.base.of(math.cos(angle) * first + math.sin(angle) * second, dt) for angle in angles]
        return float(np.percentile(values, self.percentile))


class RotD50(_Rotated):
    """Median of a measure over all directions, in steps of 1° over 180°.

    Parameters
    ----------
    base : Measure
        Measure of one motion, such as ``MEASURES["pga"]`` or ``Sa(1.0)``; written ``RotD50(pga)``, ``RotD50(Sa(1.0))``.

    References
    ----------
    Boore, D. M. (2010). Orientation-independent, nongeometric-mean measures of seismic intensity from two horizontal
    components of motion. Bulletin of the Seismological Society of America 100(4), 1830-1835.
    """

    percentile = 50.0


class RotD100(_Rotated):
    """Largest value of a measure over all directions, in steps of 1° over 180°; reference as `RotD50`."""

    percentile = 100.0


class GeometricMean(PairMeasure):
    """Geometric mean of a measure of the two components as they were recorded, written ``GeometricMean(pga)``."""

    def of_pair(self, first: Array, second: Array, dt: float) -> float:
        return math.sqrt(self.base.of(first, dt) * self.base.of(second, dt))


PAIR_MEASURES: dict[str, type[PairMeasure]] = {kind.__name__: kind for kind in (RotD50, RotD100, GeometricMean)}
"""The measures of pairs, by the name with which a label starts."""
