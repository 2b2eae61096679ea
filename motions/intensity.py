"""Intensity measures: what a measure is, how it grows with the motion, and those that a name alone says.

Measures with parameters stand in `parametrised`; reading any of them back from its name in `measures`.  Nothing here
knows of blocks.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..units import ACCELERATION, METRE, SECOND, VELOCITY
from .cumulative import (
    arias_intensity,
    cumulative_absolute_velocity,
    significant_duration_5_75,
    significant_duration_5_95,
)
from .peaks import peak_acceleration, peak_displacement, peak_velocity
from .spectra import housner_intensity, mean_period

Series = NDArray[np.float64]


class Measure(ABC):
    """An intensity measure of one motion.

    `power` says how it grows: a motion times f has f**power times the measure.  A power of 0 (durations, periods) means
    that no scaling reaches a level of it.
    """

    power: float = 1.0

    @property
    @abstractmethod
    def label(self) -> str:
        """Its name in results and study files; `measure_named` reads it back."""

    @property
    @abstractmethod
    def units(self) -> str:
        """Unit of its values, written the CF way."""

    @property
    @abstractmethod
    def long_name(self) -> str:
        """What it is, for people."""

    @abstractmethod
    def of(self, acceleration: Series, dt: float) -> float:
        """Its value for one record (n,), m/s², of step dt, s."""

    def factors(self, ratios: NDArray[np.float64]) -> NDArray[np.float64]:
        """Scale factors that bring a motion to `ratios` times its measure (power > 0)."""
        return ratios if self.power == 1.0 else np.asarray(ratios ** (1.0 / self.power))


@dataclass(frozen=True)
class NamedMeasure(Measure):
    """A measure without parameters: a function of (acceleration, dt) under a name."""

    name: str
    function: Callable[[Series, float], float]
    unit: str
    text: str
    power: float = 1.0

    @property
    def label(self) -> str:
        return self.name

    @property
    def units(self) -> str:
        return self.unit

    @property
    def long_name(self) -> str:
        return self.text

    def of(self, acceleration: Series, dt: float) -> float:
        return self.function(acceleration, dt)


MEASURES: dict[str, Measure] = {
    one.name: one
    for one in (
        NamedMeasure("pga", peak_acceleration, ACCELERATION, "peak floor acceleration"),
        NamedMeasure("pgv", peak_velocity, VELOCITY, "peak floor velocity"),
        NamedMeasure("pgd", peak_displacement, METRE, "peak floor displacement"),
        NamedMeasure("arias", arias_intensity, VELOCITY, "Arias intensity", 2.0),
        NamedMeasure("cav", cumulative_absolute_velocity, VELOCITY, "cumulative absolute velocity"),
        NamedMeasure("d5_75", significant_duration_5_75, SECOND, "significant duration 5-75 %", 0.0),
        NamedMeasure("d5_95", significant_duration_5_95, SECOND, "significant duration 5-95 %", 0.0),
        NamedMeasure("t_mean", mean_period, SECOND, "mean period", 0.0),
        NamedMeasure("housner_intensity", housner_intensity, METRE, "Housner intensity, 0.1-2.5 s, 5 % damping"),
    )
}
"""Measures without parameters, by name."""

RESULT_MEASURES = tuple(one for name, one in MEASURES.items() if name not in {"t_mean", "housner_intensity"})
"""Those that every result carries on its motions: all that cost less than a handful of runs."""
