"""Intensity measures: the class of all measures, and the measures without parameters, by name."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

from ...core.elementary import Array, power
from ...core.units import ACCELERATION, METRE, SECOND, VELOCITY
from ..arrays import Record
from .cumulative import (
    arias_intensity,
    cumulative_absolute_velocity,
    significant_duration_5_75,
    significant_duration_5_95,
)
from .peaks import peak_acceleration, peak_displacement, peak_velocity
from .spectra import housner_intensity, mean_period


class Measure(ABC):
    """Intensity measure of one motion.

    The measure of a motion times f is f**power times the measure of the motion.  A power of 0 (durations, periods)
    means that scaling does not change the measure, so that motions cannot be scaled to a level of it.
    """

    power: float = 1.0

    @property
    @abstractmethod
    def label(self) -> str:
        """Name of the measure in results and study files; `measure_named` finds the measure by it."""

    @property
    @abstractmethod
    def units(self) -> str:
        """Unit of the values, in CF notation."""

    @property
    @abstractmethod
    def long_name(self) -> str:
        """Description of the measure for tables and axes."""

    @abstractmethod
    def of(self, acceleration: Array, dt: float) -> float:
        """Return the value for one record (n,), m/s², of step dt, s."""

    def of_record(self, record: Record) -> float:
        """Return the value for a record, of both its components if the measure is of both."""
        return self.of(record.acceleration, record.dt)

    def factors(self, ratios: Array) -> Array:
        """Return the scale factors that multiply the measure of a motion by `ratios` (power > 0)."""
        return ratios if self.power == 1.0 else power(ratios, 1.0 / self.power)


@dataclass(frozen=True)
class NamedMeasure(Measure):
    """Measure without parameters: a function of (acceleration, dt) with a name."""

    name: str
    function: Callable[[Array, float], float]
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

    def of(self, acceleration: Array, dt: float) -> float:
        return self.function(acceleration, dt)


MEASURES: dict[str, Measure] = {
    measure.name: measure
    for measure in (
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
"""The measures without parameters, by name."""

RESULT_MEASURES = tuple(measure for name, measure in MEASURES.items() if name not in {"t_mean", "housner_intensity"})
"""The measures of the motions in every result: all measures that cost less than a few runs."""
