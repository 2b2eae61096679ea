"""Evolutionary Kanai-Tajimi and Clough-Penzien motions, whose ground frequency drifts."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
import xarray as xr

from ...core import checks
from ...core.aliases import Array
from ..kernels.drifting_filters import drifting_ground
from .envelopes import Envelope, RiseStrongDecay
from .filters import filtered, high_pass, propagators
from .generator import Seconds, Streams, ensemble, normals
from .kanai_tajimi import FREQUENCY, Baseline, Density, FilteredNoise, HighPassed, KanaiTajimi, Ratio

PSD_INSTANTS = 101  # of the drift, over which a density is averaged


@dataclass(frozen=True)
class EvolutionaryKanaiTajimi(FilteredNoise):
    """Gaussian white noise times an envelope, through a soil layer whose frequency drifts during the motion.

    Parameters
    ----------
    omega_g : float or sequence of float
        Circular frequency of the ground filter, rad/s: one value (constant), two (a linear drift) or more (a table).
    omega_g_times : sequence of float, optional
        Times of these frequencies, s, increasing; the frequency is linear between them and constant outside.  If not
        given, they are spread evenly over the duration.
    xi_g : float
        Damping ratio of the ground filter.
    s0 : float
        Two-sided power spectral density of the white noise, m²/s³ per rad/s.
    duration : float
        Length of the noise, s.
    dt : float
        Time step, s.
    envelope : Envelope
        Intensity of the white noise as a function of time.
    baseline : {"parabolic", "none"}
        Baseline correction of the finished motion.

    Notes
    -----
    The filter is x'' + 2 xi_g omega_g(t) x' + omega_g(t)² x = w(t), with the acceleration 2 xi_g omega_g x' + omega_g²
    x. The frequency is constant within a time step (its value in the middle), and each step is solved exactly for noise
    that is linear between samples. With a single frequency the motions equal `KanaiTajimi`, value by value. They also
    end moving.

    References
    ----------
    Fan, F.-G. and Ahmadi, G. (1990). Nonstationary Kanai-Tajimi models for El Centro 1940 and Mexico City 1985
    earthquakes. Probabilistic Engineering Mechanics 5, 171-181 (recalled).

    Examples
    --------
    >>> generator = EvolutionaryKanaiTajimi(omega_g=(25.0, 8.0), duration=10.0, dt=0.01)
    >>> float(generator.frequency(5.0))
    16.5
    """

    omega_g: Annotated[float | Sequence[float], FREQUENCY] = (8.0 * math.pi, 3.0 * math.pi)
    omega_g_times: Sequence[float] | None = None
    xi_g: Ratio = KanaiTajimi.xi_g
    s0: Density = KanaiTajimi.s0
    duration: Seconds = KanaiTajimi.duration
    dt: Seconds = KanaiTajimi.dt
    envelope: Envelope = field(default_factory=RiseStrongDecay)
    baseline: Baseline = KanaiTajimi.baseline

    def __post_init__(self) -> None:
        given = self.omega_g if isinstance(self.omega_g, Sequence | np.ndarray) else (self.omega_g,)
        if len(given) == 0:
            raise ValueError("omega_g must hold at least one frequency, got none")
        self._check()
        values = tuple(map(float, given))
        object.__setattr__(self, "omega_g", values)
        if self.omega_g_times is not None:
            given = checks.sequence("omega_g_times", self.omega_g_times)
            times = tuple(checks.number("omega_g_times", time, unit="s") for time in given)
            if len(times) != len(values):
                raise ValueError(f"omega_g_times must hold one time a frequency, got {len(times)} for {len(values)}")
            if any(late <= early for early, late in itertools.pairwise(times)):
                raise ValueError(f"omega_g_times must increase, got {times}")
            object.__setattr__(self, "omega_g_times", times)

    def frequency(self, time: Array) -> Array:
        """Return the circular frequency of the ground at `time` (s), rad/s, in the same shape."""
        values = np.atleast_1d(np.asarray(self.omega_g, dtype=np.float64))
        if values.size == 1:
            return np.full(np.shape(time), values[0])
        times = np.linspace(0.0, self.duration, values.size) if self.omega_g_times is None else self.omega_g_times
        return np.interp(time, times, values)

    def density(self, omega: Array) -> Array:
        """Return the two-sided power spectral density at `omega` (rad/s), m²/s³ per rad/s, in the same shape.

        It is the evolutionary density s0 |H(omega; t)|², averaged over the duration with the square of the envelope as
        weight. This is the density of the strong motion, at the level of a unit envelope.
        """
        time = np.linspace(0.0, self.duration, PSD_INSTANTS)
        weight = self.envelope(time) ** 2
        w = np.asarray(omega, dtype=np.float64)[..., None]
        ground = self.frequency(time)
        damping = (2.0 * self.xi_g * ground * w) ** 2
        squared = ((ground**2) ** 2 + damping) / ((ground**2 - w**2) ** 2 + damping)
        return np.asarray(self.s0 * (squared * weight).sum(axis=-1) / weight.sum())

    def sample(self, n: int, seed: int = 0, first: int = 0) -> xr.DataArray:
        """Return motions `first` … `first + n - 1` of `seed`; see `KanaiTajimi.sample`."""
        steps, rest = self._steps()
        time = np.arange(steps + rest + 1, dtype=np.float64) * self.dt
        amplitude = math.sqrt(2.0 * math.pi * self.s0 / self.dt) * self.envelope(time[: steps + 1])
        omega, where = np.unique(self.frequency(time[:-1] + 0.5 * self.dt), return_inverse=True)
        of_steps = [part[where] for part in propagators(2.0 * self.xi_g * omega, omega**2, self.dt)]
        ground = self.frequency(time)
        read = np.stack([ground**2, 2.0 * self.xi_g * ground], axis=1)

        def make(streams: Streams) -> Array:
            noise = np.pad(normals(streams, steps + 1) * amplitude, ((0, 0), (0, rest)))
            motions: Array = drifting_ground(noise, *of_steps, read)
            return self._finished(self._post_filter(motions))

        return ensemble(self, n, seed, first, steps + rest, self.dt, make)

    def _post_filter(self, motions: Array) -> Array:
        return motions


@dataclass(frozen=True)
class EvolutionaryCloughPenzien(HighPassed, EvolutionaryKanaiTajimi):
    """Evolutionary Kanai-Tajimi motions through the constant high-pass of `CloughPenzien`.

    Parameters as in `EvolutionaryKanaiTajimi`, and omega_f (rad/s) and xi_f as in `CloughPenzien`; they end as those.
    """

    def density(self, omega: Array) -> Array:
        w = np.asarray(omega, dtype=np.float64)
        damping = (2.0 * self.xi_f * self.omega_f * w) ** 2
        return super().density(omega) * (w**2) ** 2 / ((self.omega_f**2 - w**2) ** 2 + damping)

    def _post_filter(self, motions: Array) -> Array:
        return filtered(motions, *high_pass(self.omega_f, self.xi_f), self.dt)
