"""Adjustment of one motion to a given response spectrum, with peak velocity and displacement kept within bounds.

Matching alone spoils velocity and displacement, and velocity overturns blocks.  Both are therefore conditions of the
same adjustment as the spectrum (`kernels.matching`), not a correction after it.  The module does not depend on the
origin of motion and target.
"""

import math
from collections.abc import Iterable
from typing import Annotated, Any, NamedTuple

import numpy as np
import xarray as xr

from ...core import checks
from ...core.aliases import Array
from ...core.doubts import Doubt, first_of
from ...core.parameters import Parameter
from ...core.units import DIMENSIONLESS, METRE, VELOCITY, variables
from ...core.wording import two_digit_percent
from ..arrays import from_array
from ..intensity.peaks import peak_displacement, peak_velocity
from ..kernels import matching as engine
from .target_spectra import TargetSpectrum

PGV_BOUND, PGD_BOUND = 0.15, 0.5
WITHIN = Parameter(at_least=0.02, at_most=100.0)
Bound = Annotated[float, WITHIN]
TOLERANCE = 0.03
GOOD = 0.05  # mean misfit above which another attempt is made
FIRM = (1e-3, 1e-6)  # two regularisations of bounds: one often succeeds where the other fails
TAPER = 0.5  # s at both ends, where a motion is not adjusted
REACHED = ("misfit_mean", "target_met", "bounds_held")
"""Coordinates of matched motions that show if they meet their target."""
MOST_NUMBERS = 2**25  # rows times samples of the system of a step: 0.27 GB, and a step takes less than a second
BETWEEN_SAMPLES = 0.997  # factor on upper bounds, because they also hold for peaks between samples


class Bounds(NamedTuple):
    """Reference peak velocity (m/s) and displacement (m), and the allowed relative change of each; None: no bound."""

    pgv: float
    pgd: float
    pgv_bound: float | None
    pgd_bound: float | None

    def limits(self) -> Array:
        """Return minimum and maximum peak velocity, minimum and maximum peak displacement."""
        out = []
        for value, bound in ((self.pgv, self.pgv_bound), (self.pgd, self.pgd_bound)):
            free = bound is None
            out += [
                0.0 if free else value / (1.0 + (bound or 0.0)),
                math.inf if free else value * (1.0 + (bound or 0.0)) * BETWEEN_SAMPLES,
            ]
        return np.array(out)

    def held(self, pgv: float, pgd: float) -> bool:
        """Return True if the peaks lie within the bounds."""
        low_v, high_v, low_d, high_d = self.limits()
        return bool(low_v <= pgv <= high_v / BETWEEN_SAMPLES and low_d <= pgd <= high_d / BETWEEN_SAMPLES)


class TargetMissed(UserWarning):
    """Warning of matched motions whose misfit is above the limit, or whose PGV or PGD leave their bounds."""


class MatchResult(NamedTuple):
    """Result for one motion: misfits, peak velocity and displacement, and their bounds.

    `reached`: mean misfit of the matched spectrum, the target times 1 + margin. `misfit` and `worst`: mean and maximum
    misfit of the target.
    """

    reached: float
    misfit: float
    worst: float
    pgv: float
    pgd: float
    reference: Bounds


class Plan(NamedTuple):
    """Maximum number of steps of an adjustment, mean misfit at which it stops, and regularisation of the bounds."""

    steps: int
    tolerance: float
    firm: float = FIRM[0]


class Lines(NamedTuple):
    """Target at its oscillators, by falling period: circular frequency (rad/s), damping, pseudo-acceleration."""

    omega: Array
    damping: float
    sa: Array

    @classmethod
    def of(cls, target: TargetSpectrum, dt: float, duration: float, periods: Any = None) -> "Lines":
        """Return the oscillators; ValueError if step and length of a motion do not allow the target's periods."""
        ends = target.periods if periods is None else periods
        shortest, longest = ends[0], ends[-1]
        if shortest < 2.0 * dt * (1.0 - 1e-9):
            raise ValueError(
                f"a spectrum from {shortest:g} s needs a time step of at most {shortest / 2.0:g} s, got {dt:g} s: "
                "take a part of it (between)"
            )
        if longest > duration * (1.0 + 1e-9):
            raise ValueError(
                f"a spectrum up to {longest:g} s needs motions at least as long, got {duration:g} s: "
                "take a part of it (between)"
            )
        axis = (target.grid() if periods is None else np.array(periods))[::-1].copy()
        samples, most = round(duration / dt) + 1, MOST_NUMBERS // (axis.size + engine.MORE_ROWS)
        if samples > most:
            raise ValueError(
                f"{axis.size} periods can be matched by motions of at most {most:,} samples, got {samples:,}: take "
                "shorter motions (trim_husid), a longer step (resample) or fewer periods (between)"
            )
        return cls(2.0 * math.pi / axis, target.damping, target.at(axis))

    def spectrum(self, acceleration: Array, dt: float) -> Array:
        """Return the pseudo-acceleration of a motion, m/s²."""
        displacement, when = np.empty(self.omega.size), np.empty(self.omega.size)
        engine.peaks(acceleration, dt, self.omega, self.damping, displacement, when)
        return np.abs(displacement)

    def adjust(self, acceleration: Array, dt: float, freedom: Array, limits: Array, plan: Plan) -> Array:
        """Match one motion in place and return misfit, worst, pgv, pgd, steps."""
        out = np.zeros(engine.RESULTS)
        axis, steps, enough, firm = (self.omega, self.damping, self.sa), *plan
        engine.adjust(acceleration, dt, *axis, freedom, limits, steps, enough, firm, out)
        return out


def end_window(size: int, dt: float) -> Array:
    """Return a window that is 0 at both ends and 1 from TAPER s (a tenth of a short motion) inwards."""
    from_end = np.minimum(np.arange(size), np.arange(size)[::-1]) * dt
    return np.minimum(1.0, from_end / min(TAPER, 0.1 * (size - 1) * dt))


def check_options(pgv_bound: Any, pgd_bound: Any, tolerance: Any) -> None:
    """Raise TypeError or ValueError if bounds or the tolerance are out of range."""
    for name, bound in (("pgv_bound", pgv_bound), ("pgd_bound", pgd_bound)):
        if bound is not None:
            WITHIN.check(name, bound)
    checks.number("tolerance", tolerance, at_least=0.005, at_most=0.5)


def match_result(
    acceleration: Array, dt: float, reached: Array, bounds: Bounds, lines: Lines, lifted: float
) -> MatchResult:
    """Return the result for the target itself, which is the matched spectrum over `lifted`."""
    target_misfit = float(reached[engine.MISFIT])
    misfit, worst = reached[engine.MISFIT], reached[engine.WORST]
    if lifted != 1.0:
        off = np.abs(lines.spectrum(acceleration, dt) / lines.sa * lifted - 1.0)
        misfit, worst = off.mean(), off.max()
    pgv, pgd = peak_velocity(acceleration, dt), peak_displacement(acceleration, dt)
    return MatchResult(target_misfit, float(misfit), float(worst), pgv, pgd, bounds)


def labelled_matches(
    values: Array, dt: float, labels: list[str], sources: list[str], results: list[MatchResult], allowed: float
) -> xr.DataArray:
    """Return matched motions (motion, time) as a labelled array, with the results of each as coordinates.

    allowed: mean misfit up to which a motion has met its target.
    """
    of_target = "misfit of the target spectrum over its periods"
    coordinates = {
        "misfit_mean": ([result.misfit for result in results], DIMENSIONLESS, f"mean {of_target}"),
        "misfit_max": ([result.worst for result in results], DIMENSIONLESS, f"greatest {of_target}"),
        "pgv_reference": ([result.reference.pgv for result in results], VELOCITY, "PGV to stay near"),
        "pgd_reference": ([result.reference.pgd for result in results], METRE, "PGD to stay near"),
        "bounds_held": (
            [result.reference.held(result.pgv, result.pgd) for result in results],
            DIMENSIONLESS,
            "PGV and PGD lie within their bounds",
        ),
        "target_met": (
            [result.reached <= allowed for result in results],
            DIMENSIONLESS,
            f"the mean misfit of the matched spectrum is at most {allowed:g}",
        ),
    }
    matched = from_array(values, dt, labels, sources, own_amplitude=False)
    return matched.assign_coords(variables("motion", coordinates))


def matching_doubts(arrays: Iterable[xr.DataArray]) -> list[Doubt]:
    """Return the input warning on matched motions: a misfit above the limit, or PGV or PGD outside of their bounds.

    Motions that were not matched are passed over.
    """
    every, missed = 0, []
    for array in arrays:
        if "target_met" not in array.coords:
            continue
        columns = [np.atleast_1d(array[name].values) for name in ("motion", *REACHED)]
        every += columns[0].size
        for label, misfit, near, held in zip(*columns, strict=True):
            if not (near and held):
                beyond = "" if held else ", PGV or PGD outside of their bounds"
                missed.append(f"{label}: mean misfit {two_digit_percent(float(misfit))}{beyond}")
    of = f"{len(missed):,} of {every:,} motions" if every > 1 else "the motion"
    return [Doubt.of("misfit", number=len(missed), of=of, named=first_of(missed))] if missed else []
