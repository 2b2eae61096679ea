"""Kanai-Tajimi and Clough-Penzien motions: filtered white noise with an intensity envelope."""

import math
from dataclasses import dataclass, field, replace
from typing import Annotated, ClassVar, Self

import numpy as np
import xarray as xr

from ...core.aliases import Array
from ...core.parameters import Parameter, check
from ..intensity.peaks import velocity
from ..scaling import parabolic_baseline
from .envelopes import Envelope, RiseStrongDecay
from .filters import filtered, high_pass, settling, soil_layer
from .generator import LARGEST, USUAL_STEP, Generator, Seconds, Streams, ensemble, normals, steps_of

BASELINES = ("parabolic", "none")
Baseline = Annotated[str, Parameter(words=BASELINES)]
FREQUENCY = Parameter("rad/s", above=0.0, at_most=LARGEST)
Frequency = Annotated[float, FREQUENCY]
Ratio = Annotated[float, Parameter(above=0.0, at_most=LARGEST)]
Density = Annotated[float, Parameter("m²/s³", above=0.0, at_most=LARGEST)]
Dispersion = Annotated[float, Parameter(at_least=0.0, at_most=2.0)]
"""Type of the dispersion of a parameter: beyond 2 most motions are of no ground."""
FARTHEST = 5.0  # standard deviations above the median for which a parameter must be in its range


class FilteredNoise(Generator):
    """Generator of white noise with an envelope through the filter of a soil layer, and a high-pass if any."""

    own_amplitude: ClassVar[bool] = False

    duration: Seconds
    dt: Seconds
    envelope: Envelope
    baseline: str

    def _check(self) -> None:
        """Raise ValueError or TypeError for fields that every such generator has."""
        check(self)
        steps_of(self.duration, self.dt)
        if not isinstance(self.envelope, Envelope):
            raise TypeError(f"envelope must be a toppling.motions envelope, got {type(self.envelope).__name__}")

    @property
    def length(self) -> float:
        """Length of the motions, s: the duration, and the time to rest after it."""
        return self.duration + self.rest

    @property
    def rest(self) -> float:
        """Time in which the filters bring the ground to rest after the noise, s; 0 without a high-pass."""
        return 0.0

    @property
    def ends_moving(self) -> bool:
        return self.rest == 0.0

    def _steps(self) -> tuple[int, int]:
        """Return the number of steps of the noise, and of the rest."""
        return steps_of(self.duration, self.dt), math.ceil(self.rest / self.dt)

    def _finished(self, motions: Array) -> Array:
        """Return motions (motion, time) after the baseline correction, or at rest."""
        if self.baseline == "parabolic":
            return parabolic_baseline(motions, self.dt)
        rest = self._steps()[1]
        if rest:  # (what is left is taken out evenly; the trapezoidal rule counts half of the first step)
            motions[:, -rest:] -= velocity(motions, self.dt)[:, -1:] / ((rest - 0.5) * self.dt)
        return motions


@dataclass(frozen=True)
class HighPassed(FilteredNoise):
    """Filtered noise through a second, high-pass filter, which brings the ground to rest after the noise.

    Parameters
    ----------
    omega_f : float
        Circular frequency of the high-pass, rad/s.
    xi_f : float
        Damping ratio of the high-pass.
    """

    omega_f: Frequency = 0.25 * math.pi
    xi_f: Ratio = 0.6
    baseline: Baseline = "none"

    @property
    def rest(self) -> float:
        if self.baseline != "none":
            return 0.0
        soil = float(np.min(self.omega_g)), self.xi_g  # type: ignore[attr-defined]
        return max(settling(self.omega_f, self.xi_f), settling(*soil))


@dataclass(frozen=True)
class KanaiTajimi(FilteredNoise):
    """Gaussian white noise times an envelope, through the Kanai-Tajimi filter of a soil layer.

    Parameters
    ----------
    omega_g : float
        Circular frequency of the ground filter, rad/s; the median if motions differ.
    xi_g : float
        Damping ratio of the ground filter; the median if motions differ.
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
    omega_g_dispersion : float
        Dispersion of omega_g from motion to motion (0.5 in records); 0 gives all one spectrum.
    xi_g_dispersion : float
        Dispersion of xi_g from motion to motion (0.6 in records).

    Notes
    -----
    H(s) = (2 xi_g omega_g s + omega_g²)/(s² + 2 xi_g omega_g s + omega_g²), solved exactly for white noise that is
    linear between samples N(0, 2 pi s0/dt) (first-order hold).  Stationary variance pi s0 omega_g (1 + 4 xi_g²)/(2
    xi_g) as dt -> 0.  The peak of filtered white noise depends on dt.

    The motions end with the noise, and they end moving. Since |H(0)| = 1, the velocity is a random walk, of which the
    baseline correction leaves about 0.25 PGV at the end. PGV and PGD depend on the duration and on that correction;
    studies do not accept them as measures of these motions. The motions of `CloughPenzien` end at rest.

    The motions of one spectrum differ far less than earthquakes do. PGV/PGA has a dispersion of 0.2 instead of about
    0.5, and fragility curves are too steep. Dispersions of 0.5 and 0.6 raise it to 0.35. They are, rounded up, of the
    lognormal distributions of frequency and damping of such a filter in the records of Rezaeian and Der Kiureghian
    [2]_. The coefficients of variation there are 0.49 and 0.64 (sqrt(ln(1 + 0.49²)) = 0.47; 0.58).

    References
    ----------
    .. [1] Tajimi, H. (1960). A statistical method of determining the maximum response of a building structure during
       an earthquake. 2nd World Conference on Earthquake Engineering.
    .. [2] Rezaeian, S. and Der Kiureghian, A. (2010). Simulation of synthetic ground motions for specified earthquake
       and site characteristics. Earthquake Engineering and Structural Dynamics 39, 1155-1180.

    Examples
    --------
    >>> KanaiTajimi(duration=10.0, dt=0.01).sample(3, seed=1).shape
    (3, 1001)
    """

    omega_g: Frequency = 5.0 * math.pi
    xi_g: Ratio = 0.6
    s0: Density = 0.01
    duration: Seconds = 30.0
    dt: Seconds = USUAL_STEP
    envelope: Envelope = field(default_factory=RiseStrongDecay)
    baseline: Baseline = "parabolic"
    omega_g_dispersion: Dispersion = field(default=0.0, kw_only=True)
    xi_g_dispersion: Dispersion = field(default=0.0, kw_only=True)

    def __post_init__(self) -> None:
        self._check()
        for name in ("omega_g", "xi_g"):
            most = LARGEST * math.exp(-FARTHEST * getattr(self, f"{name}_dispersion"))
            if getattr(self, name) > most:
                raise ValueError(
                    f"{name} must be at most {most:.3g} with this {name}_dispersion, got {getattr(self, name)}"
                )

    def sample(self, n: int, seed: int = 0, first: int = 0) -> xr.DataArray:
        """Return motions `first` … `first + n - 1` of `seed`.

        Parameters
        ----------
        n : int
            Number of motions, >= 1.
        seed, first : int
            Seed of the ensemble and index of the first motion, >= 0; a motion depends on (seed, index) alone.

        Returns
        -------
        xarray.DataArray
            ``acceleration`` (motion, time), m s-2, not normalised (see `scale_to_mean`).
        """
        return ensemble(self, n, seed, first, sum(self._steps()), self.dt, self._make)

    def _make(self, streams: Streams) -> Array:
        steps, rest = self._steps()
        time = np.arange(steps + 1, dtype=np.float64) * self.dt
        noise = normals(streams, time.size)
        noise *= math.sqrt(2.0 * math.pi * self.s0 / self.dt) * self.envelope(time)
        noise = np.pad(noise, ((0, 0), (0, rest)))
        if self.omega_g_dispersion or self.xi_g_dispersion:
            for row, random in zip(noise, streams, strict=True):
                row[:] = self._drawn(random)._filtered(row[None])
        else:
            noise = self._filtered(noise)
        return self._finished(noise)

    def _drawn(self, random: np.random.Generator) -> Self:
        """Return the generator with parameters of one motion, drawn from its stream."""
        ground, damping = random.standard_normal(2)
        return replace(
            self,
            omega_g=self.omega_g * math.exp(self.omega_g_dispersion * ground),
            xi_g=self.xi_g * math.exp(self.xi_g_dispersion * damping),
        )

    def _filtered(self, noise: Array) -> Array:
        for numerator, denominator in self._sections():
            noise = filtered(noise, numerator, denominator, self.dt)
        return noise

    def _sections(self) -> list[tuple[list[float], list[float]]]:
        """Return the transfer functions in s, which are applied one after the other."""
        return [soil_layer(self.omega_g, self.xi_g)]


@dataclass(frozen=True)
class CloughPenzien(HighPassed, KanaiTajimi):
    """Kanai-Tajimi motions through a second, high-pass filter, which keeps velocity and displacement finite.

    Parameters as in `KanaiTajimi`, and omega_f (rad/s) and xi_f of the high-pass.

    Notes
    -----
    The high-pass is s²/(s² + 2 xi_f omega_f s + omega_f²). The noise lasts for `duration`. Ten time constants of the
    slower filter follow (21 s with the defaults). Their gain is 0 at frequency 0, so that their own response brings the
    ground to rest. The rest of the velocity is taken out evenly there. It is less than 1e-3 PGV, and about 0.01 PGV if
    the noise starts at full intensity (`Stationary`). A motion with a parabolic baseline ends moving with the noise, as
    in `KanaiTajimi`.

    References
    ----------
    Clough, R. W. and Penzien, J. (1993). Dynamics of Structures, 2nd ed. McGraw-Hill.
    """

    def _sections(self) -> list[tuple[list[float], list[float]]]:
        return [*super()._sections(), high_pass(self.omega_f, self.xi_f)]
