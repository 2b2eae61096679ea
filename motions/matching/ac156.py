"""ICC-ES AC156: motions for shake-table tests of nonstructural components, and its rules of acceptance.

The rules do not apply below 1.3 Hz, so that an accepted motion may lack the velocity that overturns blocks. The peak
floor velocity is therefore reported with them.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
import xarray as xr

from ...core import checks
from ...core.doubts import noted, warn
from ...core.elementary import Array, power, times
from ...core.parameters import SHARE, Parameter, check
from ...core.units import HERTZ, SECOND, VELOCITY, described, provenance
from ..arrays import Record, motion_coordinates, records
from ..intensity.cumulative import significant_duration_5_95
from ..intensity.peaks import peak_velocity
from ..intensity.spectra import peak_displacements
from ..simulated.envelopes import Envelope
from ..simulated.generator import USUAL_STEP, Generator, Seconds
from .adjustment import PGD_BOUND, PGV_BOUND, Bound, TargetMissed, matching_doubts
from .spectrum_compatible import SpectrumCompatible
from .target_spectra import AC156_FREQUENCIES, ASCE_16, EDITIONS, S_DS, TargetSpectrum

MARGIN = 0.01
TOLERANCE = 0.015
LOWEST, MIDDLE, HIGHEST = AC156_FREQUENCIES[1:]
HIGHEST_START = 3.5  # Hz
START_OF_LOWEST = 0.75  # of the lowest natural frequency
LEAST = 0.9
MOST_BELOW = 2
MOST_CORRELATION = 0.3
PER_OCTAVE = 6


@dataclass(frozen=True)
class AC156(Generator):
    """Simulated motions compatible with the required response spectrum of AC156.

    Parameters
    ----------
    s_ds : float
        Design spectral acceleration S_DS, in g as ASCE 7 writes it.
    z_over_h : float
        Height of attachment over mean roof height.
    edition : {"7-16", "7-22"}
        ASCE 7 edition.
    vertical : bool
        True: match the vertical spectrum.
    duration : float
        Length of the motions, s.
    dt : float
        Time step, s.
    envelope : Envelope, optional
        Intensity of the noise as a function of time. By default it rises over a sixth of the duration, stays strong to
        two thirds, then decays (5, 15 and 10 s of 30 s).
    lowest_frequency : float
        Lowest matched frequency, Hz, 0.1 to 1.3; 1.3 leaves out all frequencies that the rules do not cover, and with
        them most of the velocity.
    f_lowest : float, optional
        Lowest natural frequency of the component, Hz: it sets the lowest frequency of the acceptance check, and the
        motions are matched at the frequencies of that check (`ac156_acceptance`).
    pgv_bound : float or None
        Largest relative difference of PGV from the value that the spectrum implies, as in `SpectrumCompatible`.
    pgd_bound : float or None
        Largest relative difference of PGD from the value that the spectrum implies.

    Notes
    -----
    The motions are matched at the frequencies of `ac156_acceptance` to 1.01 times the spectrum, so that they pass it;
    this is not guaranteed for each motion.  Between these frequencies their spectra are somewhat higher.

    References
    ----------
    See `TargetSpectrum.ac156`.  The length of 30 s with 5 s of build-up, 15 s strong and 10 s of decay is recalled.

    Examples
    --------
    >>> AC156(s_ds=1.0, z_over_h=0.5).sample(1).sizes["time"]
    6001
    """

    own_amplitude: ClassVar[bool] = False

    s_ds: Annotated[float, S_DS]
    z_over_h: Annotated[float, SHARE] = 0.0
    edition: Annotated[str, Parameter(words=EDITIONS)] = ASCE_16
    vertical: Annotated[bool, Parameter()] = False
    duration: Seconds = 30.0
    dt: Seconds = USUAL_STEP
    envelope: Envelope | None = None
    lowest_frequency: float = AC156_FREQUENCIES[0]
    f_lowest: float | None = None
    pgv_bound: Bound | None = PGV_BOUND
    pgd_bound: Bound | None = PGD_BOUND

    def __post_init__(self) -> None:
        check(self)
        checks.number(
            "lowest_frequency", self.lowest_frequency, at_least=AC156_FREQUENCIES[0], at_most=LOWEST, unit="Hz"
        )
        self._matched()

    @property
    def target(self) -> TargetSpectrum:
        """Spectrum that is matched, from `lowest_frequency`."""
        whole = TargetSpectrum.ac156(self.s_ds, self.z_over_h, self.edition, vertical=self.vertical)
        return whole.between(whole.periods[0], min(1.0 / self.lowest_frequency, whole.periods[-1]))

    def sample(self, n: int, seed: int = 0, first: int = 0) -> xr.DataArray:
        """Return motions `first` … `first + n - 1` of `seed`, as `SpectrumCompatible.sample`."""
        with noted():  # (the motions are warned of under their own labels)
            made = self._matched().sample(n, seed, first)
        labels = np.array([f"AC156 {seed}-{first + i}" for i in range(n)], dtype=object)
        sources = np.array([f"{self!r} seed {seed}"] * n, dtype=object)
        made = made.assign_coords(
            motion=("motion", labels, made["motion"].attrs), source=("motion", sources, made["source"].attrs)
        )
        warn(matching_doubts([made]), TargetMissed)
        return made

    def _matched(self) -> SpectrumCompatible:
        target = self.target
        checked = checked_frequencies(self.f_lowest)
        below = checked[0] * power(2.0, -np.arange(1, 64) / PER_OCTAVE)
        # the lowest frequency itself is appended, and none that is nearly equal to it
        below = below[below > self.lowest_frequency * 2.0 ** (0.5 / PER_OCTAVE)]
        if self.lowest_frequency < checked[0]:
            below = np.append(below, self.lowest_frequency)
        periods = 1.0 / np.concatenate([checked[::-1], below])
        periods[0], periods[-1] = target.periods[0], target.periods[-1]
        return SpectrumCompatible(
            target,
            self.duration,
            self.dt,
            self.envelope,
            self.pgv_bound,
            self.pgd_bound,
            tolerance=TOLERANCE,
            margin=MARGIN,
            periods=tuple(periods.tolist()),
        )


def checked_frequencies(f_lowest: float | None = None) -> Array:
    """Return the frequencies (Hz) of the check: sixths of an octave, from a start set by `f_lowest`, up to 33.3."""
    start = LOWEST
    if f_lowest is not None:
        lowest = checks.number("f_lowest", f_lowest, above=0.0, unit="Hz")
        start = max(LOWEST, min(HIGHEST_START, START_OF_LOWEST * lowest))
    count = math.floor(math.log2(HIGHEST / start) * PER_OCTAVE) + 1
    return np.append(start * power(2.0, np.arange(count) / PER_OCTAVE), HIGHEST)


def ac156_acceptance(
    motions: xr.DataArray,
    s_ds: float,
    z_over_h: float = 0.0,
    edition: str = AC156.edition,
    vertical: bool = False,
    f_lowest: float | None = None,
    other_axes: Sequence[xr.DataArray] = (),
) -> xr.Dataset:
    """Check motions by AC156's rules of acceptance: the value and the outcome of each rule for every motion.

    Parameters
    ----------
    motions : xarray.DataArray
        Labelled motions of the shake table (motion, time), m s-2.
    s_ds, z_over_h, edition, vertical
        As in `TargetSpectrum.ac156`, the required response spectrum (RRS).
    f_lowest : float, optional
        Lowest natural frequency of the component, Hz, > 0: checks start at 0.75 of it, between 1.3 and 3.5 Hz; at 1.3
        Hz if not given.
    other_axes : sequence of xarray.DataArray
        The same motions along other axes, in the same order and with the same steps, for the correlation between axes.

    Returns
    -------
    xarray.Dataset
        On (motion, frequency): ``ratio``, response spectrum at 5 % damping over RRS, at sixths of an octave up to 33.3
        Hz.

        On motion, value and outcome of each rule:

        - ``lowest_ratio`` and ``above_90`` (every point >= 0.9);
        - ``adjacent_below`` (pairs of neighbours both below RRS) and ``none_adjacent``;
        - ``below_to_middle`` and ``below_from_middle`` (points below RRS up to and beyond 8.3 Hz) and ``at_most_two``;
        - with other axes ``correlation`` (the maximum of any pair) and ``uncorrelated`` (< 0.3);
        - ``accepted``, all rules together.

        On motion, without outcome: ``strong_duration`` (D5-95, s), and ``pfv``, the peak velocity (m s-1), for which
        there is no rule.

    Notes
    -----
    The correlation is between the whole histories at zero lag. Test-laboratory software rounds the frequency at which
    checks start up to 0.1 Hz; it is not rounded here. The strong motion that the criteria demand (20 s, recalled) is
    not defined in any source at hand, so D5-95 is given without outcome.

    References
    ----------
    ICC Evaluation Service, AC156: rules as test-laboratory software states them; the document itself was not read.

    Examples
    --------
    >>> made = AC156(s_ds=1.0).sample(1, seed=1)
    >>> bool(ac156_acceptance(made, s_ds=1.0).above_90[0]), bool(ac156_acceptance(made, s_ds=1.5).above_90[0])
    (True, False)
    """
    target = TargetSpectrum.ac156(s_ds, z_over_h, edition, vertical=vertical)
    plain = records(motions)
    frequency = checked_frequencies(f_lowest)
    axis = 1.0 / frequency
    required = target.at(axis) * axis**2 / (2.0 * math.pi) ** 2
    ratio = np.array([peak_displacements(r.acceleration, r.dt, axis, target.damping) for r in plain]) / required
    below = ratio < 1.0
    low, high = frequency <= MIDDLE, frequency > MIDDLE
    numbers = {
        "lowest_ratio": (ratio.min(axis=1), "least response spectrum over RRS"),
        "adjacent_below": ((below[:, 1:] & below[:, :-1]).sum(axis=1), "pairs of neighbours both below RRS"),
        "below_to_middle": (below[:, low].sum(axis=1), "points below RRS up to 8.3 Hz"),
        "below_from_middle": (below[:, high].sum(axis=1), "points below RRS beyond 8.3 Hz"),
    }
    at_most_two = (numbers["below_to_middle"][0] <= MOST_BELOW) & (numbers["below_from_middle"][0] <= MOST_BELOW)
    rules = {
        "above_90": (numbers["lowest_ratio"][0] >= LEAST, "every point at least 0.9 RRS"),
        "none_adjacent": (numbers["adjacent_below"][0] == 0, "no two neighbours below RRS"),
        "at_most_two": (at_most_two, "at most two points below RRS on either side of 8.3 Hz"),
    }
    if other_axes:
        correlation = _correlations([plain, *(records(axis) for axis in other_axes)])
        numbers["correlation"] = (correlation, "greatest correlation between axes")
        rules["uncorrelated"] = (correlation < MOST_CORRELATION, "correlation between axes below 0.3")
    accepted = np.logical_and.reduce([verdict for verdict, _ in rules.values()])
    variables = {
        name: xr.Variable("motion", values, described(text))
        for name, (values, text) in {**numbers, **rules, "accepted": (accepted, "all rules hold")}.items()
    }
    strong = [significant_duration_5_95(record.acceleration, record.dt) for record in plain]
    variables["strong_duration"] = xr.Variable("motion", strong, described("D5-95", SECOND))
    pfv = [peak_velocity(record.acceleration, record.dt) for record in plain]
    variables["pfv"] = xr.Variable("motion", pfv, described("peak velocity of the table", VELOCITY))
    variables["ratio"] = xr.Variable(("motion", "frequency"), ratio, described("response spectrum over RRS"))
    at = xr.Variable("frequency", frequency, described("natural frequency", HERTZ))
    return xr.Dataset(
        variables,
        coords={**motion_coordinates(plain), "frequency": at},
        attrs={"title": "Acceptance by AC156", **provenance({"target": repr(target)}), "target": target.name},
    )


def _correlations(axes: list[list[Record]]) -> Array:
    """Return the maximum absolute correlation of any two axes, for each motion."""
    largest = np.zeros(len(axes[0]))
    for further in axes[1:]:
        if len(further) != len(axes[0]):
            raise ValueError(f"other_axes must hold the same motions, got {len(further)} beside {len(axes[0])}")
    for i in range(largest.size):
        same = [axis[i] for axis in axes]
        if len({(record.acceleration.size, record.dt) for record in same}) > 1:
            raise ValueError(f"motion {same[0].label!r} must have one step and length on all axes")
        off = np.array([record.acceleration - record.acceleration.mean() for record in same])
        products = times(off, off.T)
        together = np.abs(products / np.sqrt(np.diag(products)) / np.sqrt(np.diag(products))[:, None])
        largest[i] = np.max(together[~np.eye(len(same), dtype=bool)])
    return largest
