"""Spectral variability of an ensemble: differences of the spectral shapes of its motions."""

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
import scipy

from ...core.aliases import Array
from ...core.units import DAMPING
from ..arrays import Record
from .peaks import peak_acceleration, peak_velocity
from .spectra import peak_displacements

SHORT, LONG = 0.2, 1.0
"""Periods of the ratio of spectral accelerations, s."""
NATURAL_VELOCITY, NATURAL_SHAPE = 0.52, 0.73
"""Dispersions of PGV/PGA and of Sa(1 s)/Sa(0.2 s) for one magnitude, distance and site.

From the total dispersions of Boore et al. (2014), a and b, and the correlations r of Baker and Bradley (2017), 0.65 and
0.38. The formula is sqrt(a² + b² - 2 r a b).
"""
LEAST_VELOCITY, LEAST_SHAPE = 0.3, 0.45
"""Dispersions below which motions have nearly one spectrum: generators with one spectrum have about 0.2 and 0.2 to 0.3,
scenarios 0.32 to 0.53 and 0.54 to 0.8.
"""
CONFIDENCE = 0.95
SPECTRA = "spectra"
"""Kind of warning on ensembles with nearly one spectrum."""


class Variability(NamedTuple):
    """Standard deviations of ln(PGV/PGA) and of ln(Sa(1 s)/Sa(0.2 s)), with their degrees of freedom.

    Boore, D. M., Stewart, J. P., Seyhan, E. and Atkinson, G. M. (2014). Earthquake Spectra 30(3), 1057-1085. Baker, J.
    W. and Bradley, B. A. (2017). Earthquake Spectra 33(1), 145-156.
    """

    freedom: int
    velocity: float
    shape: float

    @property
    def low(self) -> bool:
        """True if one of the two is below its minimum value, possibly by chance."""
        return self.velocity < LEAST_VELOCITY or self.shape < LEAST_SHAPE

    @property
    def narrow(self) -> bool:
        """True if one of the two is below its minimum value, with a confidence of 95 %."""
        if self.freedom < 1:
            return False
        # (freedom s²/sigma² has the distribution chi²)
        over = math.sqrt(self.freedom / float(scipy.special.chdtri(self.freedom, CONFIDENCE)))
        return over * self.velocity < LEAST_VELOCITY or over * self.shape < LEAST_SHAPE

    @property
    def text(self) -> str:
        """The standard deviations in words."""
        return (
            f"ln(PGV/PGA) has a standard deviation of {self.velocity:.2f} and ln(Sa(1 s)/Sa(0.2 s)) one of "
            f"{self.shape:.2f}"
        )


NATURAL = (
    f"compared with {NATURAL_VELOCITY:g} and {NATURAL_SHAPE:g} for earthquakes of similar magnitude, distance and site"
)


def variability(motions: Sequence[Record]) -> Variability:
    """Return the spectral variability of motions of the ground; motions that are zero throughout are passed over."""
    logs = [_logarithms(motion) for motion in motions if motion.acceleration.any()]
    if len(logs) < 2:
        return Variability(0, math.nan, math.nan)
    spread = np.array(logs).std(axis=0, ddof=1)
    return Variability(len(logs) - 1, float(spread[0]), float(spread[1]))


def pooled(parts: Iterable[Variability]) -> Variability:
    """Return the variability within several ensembles, which may differ from each other."""
    every = [part for part in parts if part.freedom]
    freedom = sum(part.freedom for part in every)
    if freedom == 0:
        return Variability(0, math.nan, math.nan)
    squares = (sum(part.freedom * getattr(part, name) ** 2 for part in every) for name in ("velocity", "shape"))
    velocity, shape = (math.sqrt(square / freedom) for square in squares)
    return Variability(freedom, velocity, shape)


def _logarithms(record: Record) -> Array:
    pga = peak_acceleration(record.acceleration, record.dt)
    pgv = peak_velocity(record.acceleration, record.dt)
    long, short = peak_displacements(record.acceleration, record.dt, np.array([LONG, SHORT]), DAMPING)
    return np.array([math.log(pgv / pga), math.log(long / short) - 2.0 * math.log(LONG / SHORT)])
