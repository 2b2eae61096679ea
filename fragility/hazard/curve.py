"""Hazard curves: annual rates at which ground motions at a site exceed levels of an intensity measure.

A curve has plain values in SI and its measure. `hazard.files` reads curves from files; `risk` convolves them with
fragility curves.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...core import checks
from ...core.elementary import Array, exp, log, power, times
from ...core.parameters import CHANCE, Parameter
from ...motions.intensity.measure import Measure
from ...motions.intensity.naming import FLOOR, GROUND, in_si, measure_named
from ..runs.scaling import BLOCK_MEASURES, SCALE
from .pieces import EXTEND, Pieces, pieces_of, segment_slopes

AT_ONE = Parameter("1/year", above=0.0)
"""Rate k0 at a level of one unit."""
# Rates between which a law is stored as points; beyond them the last piece of the curve is extended.
HIGHEST_RATE, LOWEST_RATE = 1.0, 1e-8
# Slopes above minus this value are negative by rounding alone.
FLAT = 1e-9
ROUNDING = 1e-3
"""Maximum relative difference of given rates from the mean of their realisations: files print four digits or more."""


@dataclass(frozen=True)
class HazardCurve:
    """Annual rates of exceedance over levels of an intensity measure, linear between points on a log-log plot.

    Parameters
    ----------
    levels : sequence of float, shape (level,)
        Levels, in the SI unit of the measure, > 0, at least two, strictly increasing.
    rates : sequence of float, shape (level,)
        Annual rates at which the measure exceeds each level, 1/year, > 0, never rising. With `realisations` they are
        their weighted mean. They are computed if not given (an empty sequence), else used as given. A difference of
        more than 0.1 %, the rounding of files, is an error.
    im : str or Measure
        The measure, as `toppling.ida` names it: ``pga``, ``pgv``, ``Sa(1.0)``, …
    source : str
        Source of the curve.
    realisations : sequence of sequences, shape (realisation, level), optional
        Rates of the branches of a logic tree, or of other equally complete views of the hazard.
    weights : sequence of float, shape (realisation,), optional
        Weights of the realisations, > 0, of sum 1; equal if not given.
    curvature : float
        k2 >= 0: ln(rate) + k2 ln²(level) is linear between points instead of ln(rate).
    fractile : float, optional
        Fractile of the curve over epistemic uncertainty, above 0 to below 1; a mean curve if not given. With
        `realisations` its rates must be given, and lie between the lowest and the highest of them. They are not
        compared with the mean, and definitions of a fractile of few realisations differ.
    at : {"ground", "floor"}
        Place of the measure: the ground motion at the site, or the motion of the floor below the blocks.

    Notes
    -----
    A rate of 0 has no logarithm: end the curve at its last positive rate.

    Examples
    --------
    >>> hazard = HazardCurve([1.0, 2.0, 4.0], [1e-2, 2e-3, 2e-4], "pga")
    >>> hazard.units, round(float(hazard.rate_at(2.0)), 9)
    ('m s-2', 0.002)
    """

    levels: Sequence[float]
    rates: Sequence[float]
    im: str | Measure
    source: str = ""
    realisations: Sequence[Sequence[float]] | None = field(default=None, repr=False)
    weights: Sequence[float] | None = field(default=None, repr=False)
    curvature: float = 0.0
    fractile: float | None = None
    at: str = GROUND

    def __post_init__(self) -> None:
        measure = hazard_measure(self.im)
        levels = checks.finite_array("levels of a hazard curve", self.levels, unit=measure.units)
        if levels.size < 2:
            raise ValueError(f"levels of a hazard curve must be at least two, got {levels.size}")
        checks.increasing("levels of a hazard curve", levels, measure.units)
        curvature = checks.number("curvature", self.curvature, at_least=0.0)
        if self.fractile is not None:
            CHANCE.number("fractile", self.fractile)
        checks.choice("at", self.at, (GROUND, FLOOR))
        if not isinstance(self.source, str):
            raise TypeError(f"source must be a text, got {checks.kind(self.source)}")
        rows, weights = _realisations(self.realisations, self.weights, levels.size)
        for row in () if rows is None else rows:
            check_rates("rates of a realisation", row, levels, measure.units)
            _check_slopes("rates of a realisation", row, levels, curvature)
        mean = None if rows is None or weights is None else times(weights, rows)
        computed = mean is not None and not checks.sequence("rates of a hazard curve", self.rates)
        if computed and self.fractile is not None:
            raise ValueError(
                f"rates of a fractile curve must be given with its realisations, fractile {self.fractile:g}"
            )
        rates = checks.finite_array("rates of a hazard curve", mean if computed else self.rates, unit="1/year")
        check_rates("rates of a hazard curve", rates, levels, measure.units)
        _check_slopes("rates of a hazard curve", rates, levels, curvature)
        if rows is not None and mean is not None:
            _check_agreement(rates, mean, rows, levels, self.fractile)
        values: dict[str, Any] = {
            "levels": tuple(levels.tolist()),
            "rates": tuple(rates.tolist()),
            "im": measure.label,
            "realisations": None if rows is None else tuple(tuple(row) for row in rows.tolist()),
            "weights": None if weights is None else tuple(weights.tolist()),
            "curvature": curvature,
        }
        for name, value in values.items():
            object.__setattr__(self, name, value)

    @property
    def measure(self) -> Measure:
        """Measure of the levels."""
        return hazard_measure(self.im)

    @property
    def units(self) -> str:
        """Unit of the levels, SI, written the CF way."""
        return self.measure.units

    @property
    def of_formula(self) -> bool:
        """True if the curve is a formula, which has no first and no last level."""
        return self.source.endswith("law")

    @classmethod
    def from_points(
        cls,
        levels: Sequence[float],
        rates: Sequence[float],
        im: str | Measure,
        units: str | None = None,
        source: str = "",
        **options: Any,
    ) -> HazardCurve:
        """A curve from points whose levels are in `units` (``g``, ``m/s2``, ``cm/s2``, ``cm/s`` …; SI if not given).

        Examples
        --------
        >>> HazardCurve.from_points([0.1, 1.0], [1e-2, 1e-5], "Sa(1.0)", "g").levels[0]
        0.980665
        """
        factor = unit_to_si(units, im)
        values = checks.finite_array("levels of a hazard curve", levels, unit=units or hazard_measure(im).units)
        if units is not None:
            check_points(values, [np.asarray(rates, dtype=np.float64)], units)
        with np.errstate(over="ignore"):
            return cls((values * factor).tolist(), rates, im, source, **options)

    @classmethod
    def power_law(cls, k0: float, k: float, im: str | Measure, units: str | None = None) -> HazardCurve:
        """Return the curve H(x) = k0 x**-k, with x in `units` (SI if not given); k0 1/year, > 0; k from 0.1 to 100.

        The curve is stored as two points, at rates of 1 and 1e-8 per year, and continues beyond them if tails are
        extended.

        References
        ----------
        Cornell, C. A., Jalayer, F., Hamburger, R. O. and Foutch, D. A. (2002). Probabilistic basis for 2000 SAC Federal
        Emergency Management Agency steel moment frame guidelines. Journal of Structural Engineering 128(4), 526-533.

        Examples
        --------
        >>> hazard = HazardCurve.power_law(1e-4, 2.5, "pga", units="g")
        >>> round(float(hazard.rate_at(9.80665)), 10)
        0.0001
        """
        scale = AT_ONE.number("k0", k0)
        slope = checks.number("k", k, at_least=0.1, at_most=100.0)
        rates = (HIGHEST_RATE, LOWEST_RATE)
        with np.errstate(over="ignore"):  # (no level is infinite)
            levels = power(scale / np.array(rates), 1.0 / slope)
        if not np.all(np.isfinite(levels) & (levels > 0.0)):
            raise ValueError(
                f"k0 = {scale:g} per year with k = {slope:g} puts no level at rates of 1 and 1e-8 per year"
            )
        return cls.from_points(levels.tolist(), rates, im, units, "power law")

    @classmethod
    def log_quadratic(cls, k0: float, k1: float, k2: float, im: str | Measure, units: str | None = None) -> HazardCurve:
        """Return the curve H(x) = k0 exp(-k2 ln²x - k1 ln x), x in `units` (SI if None); k0 1/year, k0 and k2 > 0.

        The curve is stored as two points and its curvature.  Left of its summit, at ln x = -k1/(2 k2), where the
        formula would fall towards small levels, the rate is constant: no hazard curve rises.

        References
        ----------
        Vamvatsikos, D. (2013). Derivation of new SAC/FEMA performance evaluation solutions with second-order hazard
        approximation. Earthquake Engineering & Structural Dynamics 42(8), 1171-1188.

        Examples
        --------
        >>> hazard = HazardCurve.log_quadratic(1e-4, 2.0, 0.2, "pga", units="g")
        >>> round(float(hazard.rate_at(9.80665)), 10)
        0.0001
        """
        scale = AT_ONE.number("k0", k0)
        slope = checks.number("k1", k1)
        bend = checks.number("k2", k2, above=0.0)
        summit = math.log(scale) + 0.25 * slope**2 / bend
        # a little below the summit, where the slope is 0
        first = min(math.log(HIGHEST_RATE), summit - 1e-3)
        last = min(math.log(LOWEST_RATE), first - 10.0)
        at = np.array([first, last])
        drop = math.log(scale) - at
        root = np.sqrt(slope**2 + 4.0 * bend * drop)
        # of two forms of the greater solution, the one whose terms do not cancel
        logs = 2.0 * drop / (slope + root) if slope > 0.0 else (root - slope) / (2.0 * bend)
        levels = exp(logs)
        if not np.all(np.isfinite(levels) & (levels > 0.0)):
            raise ValueError(f"k0 = {scale:g}, k1 = {slope:g}, k2 = {bend:g} put the rates at levels of no shaking")
        return cls.from_points(levels.tolist(), exp(at).tolist(), im, units, "second-order law", curvature=bend)

    def rate_at(self, levels: Any, below: str = EXTEND, above: str = EXTEND) -> Array:
        """Annual rate of exceedance at `levels` (SI, any shape), 1/year; rules beyond its points as `annual_rate`."""
        x = checks.numbers("levels", levels, self.units)
        if not np.all(x > 0.0):
            raise ValueError(f"levels must be > 0, got {np.min(x):g}")
        return self.pieces(below, above)[0].rate(log(x))

    def resampled(self, levels: Any) -> HazardCurve:
        """Return the mean curve as points at other `levels` (SI, increasing), linear between them, without curvature.

        Examples
        --------
        >>> hazard = HazardCurve.log_quadratic(1e-4, 2.0, 0.2, "pga")
        >>> points = hazard.resampled(np.geomspace(0.1, 10.0, 50))
        >>> points.curvature, round(float(points.rate_at(1.0) / hazard.rate_at(1.0)), 3)
        (0.0, 1.0)
        """
        axis = checks.finite_array("levels", levels, unit=self.units)
        rates = self.rate_at(axis).tolist()
        return HazardCurve(axis.tolist(), rates, self.im, self.source, fractile=self.fractile, at=self.at)

    def pieces(self, below: str = EXTEND, above: str = EXTEND) -> list[Pieces]:
        """Return the curve as pieces over all intensities, followed by each of its realisations."""
        log_levels = log(self.levels)
        rows = [self.rates, *(self.realisations or ())]
        return [pieces_of(log_levels, log(row), self.curvature, below, above) for row in rows]

    def describe(self) -> dict[str, Any]:
        """Return the curve as plain values for the attributes of a dataset."""
        plain: dict[str, Any] = {
            "im": self.im,
            "units": self.units,
            "at": self.at,
            "source": self.source,
            "levels": list(self.levels),
            "rates": list(self.rates),
        }
        if self.curvature:
            plain["curvature"] = self.curvature
        if self.fractile is not None:
            plain["fractile"] = self.fractile
        if self.weights is not None:
            plain["weights"] = list(self.weights)
        if self.realisations is not None:
            plain["realisations"] = [list(row) for row in self.realisations]
        return plain


def hazard_measure(im: str | Measure) -> Measure:
    """Return the measure of a hazard curve; ValueError for block measures, plain factors and durations."""
    if isinstance(im, str) and (im in BLOCK_MEASURES or im == SCALE):
        base = f": give the hazard of {BLOCK_MEASURES[im].measure.label}" if im in BLOCK_MEASURES else ""
        raise ValueError(f"im of a hazard curve must be a measure of the motion alone, got {im!r}{base}")
    measure = measure_named(im, "im of a hazard curve")
    if measure.power == 0.0:
        raise ValueError(f"im of a hazard curve must grow with the motion, got {measure.label!r}")
    return measure


def unit_to_si(units: str | None, im: str | Measure) -> float:
    """Return the SI value of a unit of a measure, as people write units; ValueError for a unit of another measure."""
    measure = hazard_measure(im)
    if units is None:
        return 1.0
    if not isinstance(units, str):
        raise TypeError(f"units must be a text, got {checks.kind(units)}")
    return in_si(units, measure)


def check_points(levels: Array, rows: Sequence[Array], units: str) -> None:
    """Raise ValueError, in the unit of the levels as they are given, if points make no hazard curve."""
    checks.increasing("levels of a hazard curve", levels, units)
    for row in rows:
        check_rates("rates of a hazard curve" if len(rows) == 1 else "rates of a realisation", row, levels, units)


def check_rates(what: str, rates: Array, levels: Array, units: str) -> None:
    """Raise ValueError if rates are not positive or rise anywhere."""
    if rates.size != levels.size:
        raise ValueError(f"{what} must contain one rate per level, got {rates.size} for {levels.size} levels")
    if not np.all(rates > 0.0):
        at = int(np.argmin(rates > 0.0))
        raise ValueError(
            f"{what} must be > 0 per year, got {rates[at]:g} at {levels[at]:g} {units}: leave out that level"
        )
    rising = np.diff(rates) > 0.0
    if rising.any():
        at = int(np.argmax(rising))
        raise ValueError(
            f"{what} must never rise, got {rates[at]:g} per year at {levels[at]:g} {units} and {rates[at + 1]:g} at "
            f"{levels[at + 1]:g} {units}{': give 1/return period' if rates.min() > 1.0 else ''}"
        )


def _check_slopes(what: str, rates: Array, levels: Array, curvature: float) -> None:
    """Raise ValueError if the curvature makes rates rise."""
    slopes = segment_slopes(log(levels), log(rates), curvature)
    if np.any(slopes < -FLAT):
        at = int(np.argmin(slopes))
        raise ValueError(f"{what} would rise from {levels[at]:g} on with a curvature of {curvature:g}")


def _check_agreement(rates: Array, mean: Array, rows: Array, levels: Array, fractile: float | None) -> None:
    """Raise ValueError if rates are not the mean of the realisations, or a fractile lies outside of them."""
    low, high = (mean, mean) if fractile is None else (rows.min(axis=0), rows.max(axis=0))
    off = np.maximum(low / rates, rates / high) > 1.0 + ROUNDING
    if not off.any():
        return
    at = int(np.argmax(off))
    if fractile is not None:
        raise ValueError(
            f"rates of a fractile curve must lie between its realisations, {low[at]:g} to {high[at]:g} per year at a "
            f"level of {levels[at]:g}, got {rates[at]:g}"
        )
    raise ValueError(
        f"rates of a hazard curve must be the weighted mean of its realisations, {mean[at]:g} per year at a level of "
        f"{levels[at]:g}, got {rates[at]:g}: give () for their mean, or the fractile that they are"
    )


def _realisations(realisations: Any, weights: Sequence[float] | None, levels: int) -> tuple[Array | None, Array | None]:
    if realisations is None:
        if weights is not None:
            raise ValueError("weights belong to realisations, got no realisations")
        return None, None
    rows = checks.finite_array("realisations", realisations, ndim=(2,), unit="1/year")
    if rows.shape[1] != levels:
        raise ValueError(f"realisations must have one rate a level, got {rows.shape[1]} for {levels} levels")
    if weights is None:
        return rows, np.full(rows.shape[0], 1.0 / rows.shape[0])
    values = checks.finite_array("weights", weights)
    if values.size != rows.shape[0]:
        raise ValueError(f"weights must be one a realisation, got {values.size} for {rows.shape[0]} realisations")
    if np.any(values <= 0.0) or abs(values.sum() - 1.0) > 1e-6:
        raise ValueError(f"weights must be > 0 and of sum 1, got a sum of {values.sum():g}, least {values.min():g}")
    return rows, values / values.sum()
