"""Base of all generators of motions: a random stream for each motion, work in chunks, one labelled array.

Motion `index` of a seed has its own random stream, so that any part of an ensemble can be made separately.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Annotated, ClassVar

import numpy as np
import xarray as xr

from ...core import checks
from ...core.aliases import Array
from ...core.parameters import CORRELATION, COUNT, Parameter
from ...core.streams import stream
from ...core.units import DIMENSIONLESS, METRE, described
from ..arrays import from_array
from ..pairs import join
from .ground_motion_models import Scenario

Streams = list[np.random.Generator]

SECOND_COMPONENT = (0, 1)
"""Key, under a seed, of the seed of second components; motions have keys of one number."""
LARGEST = 1e6
SECONDS = Parameter("s", above=0.0, at_most=LARGEST)
Seconds = Annotated[float, SECONDS]
"""Type of a time that is longer than 0."""
USUAL_STEP = 0.005
"""Time step of motions, s."""
MOST_SAMPLES = 500_000_000  # 4 GB
LEAST_STEPS = 20  # fewer steps hold no motion, and a parabolic baseline would remove most of it
CHUNK_SAMPLES = 2_000_000  # 16 MB for each temporary array


class Generator(ABC):
    """Generator of simulated motions: a frozen dataclass of parameters with the method `sample`."""

    along_a_pulse: ClassVar[bool] = False
    """True if the motions are those in the direction of a pulse."""
    own_amplitude: ClassVar[bool] = True
    """True if the motions have the amplitude of an earthquake; False if a parameter sets their amplitude."""

    @property
    def scenario(self) -> Scenario | None:
        """The stated earthquake and site of the motions; None without a statement."""
        return None

    @property
    def ends_moving(self) -> bool:
        """True if the velocity does not return to 0, so that PGV and PGD depend on the duration."""
        return False

    @property
    def outside(self) -> str:
        """Parts of the scenario outside the data behind the generator's equations; empty if all are inside."""
        return ""

    @abstractmethod
    def sample(self, n: int, seed: int = 0, first: int = 0) -> xr.DataArray:
        """Return motions `first` … `first + n - 1` of a seed, as one labelled array (motion, time), m/s²."""

    def sample_pairs(self, n: int, seed: int = 0, first: int = 0, correlation: float = 0.0) -> xr.DataArray:
        """Return pairs of horizontal components, in the form in which `toppling.motions.join` joins recordings.

        Parameters
        ----------
        n, seed, first : int
            As for `sample`, which gives the first component.
        correlation : float
            Expected correlation of the two components over time, between -1 and 1.

        Returns
        -------
        xarray.DataArray
            ``acceleration`` (motion, component, time), m/s²; h2 lies a right angle from h1.

        Raises
        ------
        ValueError
            As `sample`; a correlation out of range; motions in the direction of a pulse, which have no other component.

        Notes
        -----
        With a motion w that is drawn independently of h1, h2 = r h1 + sqrt(1 - r²) w. If motions of the generator have
        their own amplitude, w is first scaled to the Arias intensity of h1, because both components are of one
        earthquake. Components of recordings differ in it.
        """
        share = CORRELATION.number("correlation", correlation)
        if self.along_a_pulse:
            raise ValueError(f"{type(self).__name__} gives motions in the direction of a pulse, which have no pairs")
        h1 = self.sample(n, seed, first)
        words = np.random.SeedSequence(seed, spawn_key=SECOND_COMPONENT).generate_state(2, np.uint64)
        second = self.sample(n, int(words[0]) << 64 | int(words[1]), first)
        along, drawn = h1.values, second.values
        if self.own_amplitude:
            drawn = drawn * np.sqrt((along**2).sum(axis=1) / (drawn**2).sum(axis=1))[:, None]
        h2 = h1.copy(data=share * along + math.sqrt(1.0 - share**2) * drawn)
        sources = [f"{value}, in pairs of correlation {share:g}" for value in h1["source"].values]
        pair = join(h1, h2)
        return pair.assign_coords(source=("motion", np.array(sources, dtype=object), h1["source"].attrs))


def steps_of(duration: float, dt: float) -> int:
    """Return the number of steps of a motion; ValueError if it is too short, or if duration or dt (s) are not > 0."""
    SECONDS.check("dt", dt)
    SECONDS.check("duration", duration)
    if duration < LEAST_STEPS * dt:
        raise ValueError(f"duration must be at least {LEAST_STEPS} dt = {LEAST_STEPS * dt:g} s, got {duration:g}")
    return round(duration / dt)


def counts(n: int, seed: int, first: int) -> tuple[int, int, int]:
    """Return the arguments of `sample`, checked."""
    return COUNT.count("n", n), checks.count("seed", seed), checks.count("first", first)


def check_samples(n: int, steps: int) -> None:
    """Raise ValueError if n motions of `steps` steps would have more than 5e8 samples."""
    if n * (steps + 1) > MOST_SAMPLES:
        raise ValueError(
            f"motions must have at most {MOST_SAMPLES:.0e} samples in all, got {n} motions of {steps + 1}: "
            "make them in parts (first)"
        )


def ensemble(
    generator: Generator, n: int, seed: int, first: int, steps: int, dt: float, make: Callable[[Streams], Array]
) -> xr.DataArray:
    """Return motions `first` … `first + n - 1` of `seed`, made chunk by chunk.

    Parameters
    ----------
    generator : Generator
        Generator of the motions, after which they are named.
    steps, dt : int, float
        Length in steps and time step, s.
    make : callable
        Function from the streams of some motions to their accelerations (motion, steps + 1), m/s²; each row must
        depend on its own stream only, to the last bit.
    """
    n, seed, first = counts(n, seed, first)
    check_samples(n, steps)
    values = np.empty((n, steps + 1))
    rows = max(1, CHUNK_SAMPLES // (steps + 1))
    for start in range(0, n, rows):
        indices = range(first + start, first + min(start + rows, n))
        values[start : start + len(indices)] = make([stream(seed, index) for index in indices])
    labels = [f"{type(generator).__name__} {seed}-{first + i}" for i in range(n)]
    array = from_array(values, dt, labels, f"{generator!r} seed {seed}", generator.own_amplitude)
    scenario = {
        name: ("motion", np.full(n, float(getattr(generator, name))), described(long_name, units))
        for name, units, long_name in (
            ("magnitude", DIMENSIONLESS, "moment magnitude"),
            ("distance", METRE, "distance of the scenario, as its generator defines it"),
        )
        if hasattr(generator, name)
    }
    return array.assign_coords(scenario)


def normals(streams: Streams, size: int) -> Array:
    """Return standard normal numbers, shape (motion, size), each row from its own stream."""
    noise = np.empty((len(streams), size))
    for row, random in zip(noise, streams, strict=True):
        random.standard_normal(out=row)
    return noise
