"""Correlations of the residuals of ln intensity measures, by published formulas, and their repair.

Each formula was fitted by itself, so that together they need not form a correlation matrix: `repaired` makes one, and
returns its difference.
"""

import math
import warnings
from collections.abc import Sequence

import numpy as np

from ...core import checks
from ...core.elementary import Array, eigh, log, times
from ...core.units import DAMPING
from ..intensity.measure import MEASURES, Measure
from ..intensity.parametric_measures import Sa

SHORTEST, LONGEST = 0.01, 10.0
"""Periods of the formulas, s; the peak acceleration counts as the spectral one at the shortest."""
LEAST_EIGENVALUE = 1e-6
DOUBTFUL_CHANGE, GREATEST_CHANGE = 0.05, 0.15
"""Changes of a correlation by its repair that cause a warning and an error (assumed)."""
PGV_PGA, DURATION_PGA, DURATION_PGV = 0.733, -0.405, -0.211


class DoubtfulCorrelations(UserWarning):
    """Warning that correlations had to be changed by more than a rounding to form a matrix."""


def spectral(first: float, second: float) -> float:
    """Return the correlation of ln Sa at two periods, s, 0.01 to 10.

    Baker, J. W. and Jayaram, N. (2008). Earthquake Spectra 24(1), 299-317.
    """
    a, b = sorted((first, second))
    c1 = 1.0 - math.cos(0.5 * math.pi - 0.366 * math.log(b / max(a, 0.109)))
    if a > 0.109:
        return c1
    c2 = 0.0
    if b < 0.2:
        c2 = 1.0 - 0.105 * (1.0 - 1.0 / (1.0 + math.exp(100.0 * b - 5.0))) * (b - a) / (b - 0.0099)
    if b <= 0.109:
        return c2
    c3 = c2 if b < 0.109 else c1
    c4 = c1 + 0.5 * (math.sqrt(c3) - c3) * (1.0 + math.cos(math.pi * a / 0.109))
    return min(c2, c4) if b < 0.2 else c4


_PGV = (
    # (up to the period, p, q, c, d)
    (0.1, 0.73, 0.54, 0.045, 1.8),
    (0.75, 0.54, 0.81, 0.28, 1.5),
    (2.5, 0.80, 0.76, 1.1, 3.0),
    (LONGEST, 0.76, 0.70, 5.0, 3.2),
)


def velocity_spectral(period: float) -> float:
    """Return the correlation of ln PGV and ln Sa at a period, s, 0.01 to 10.

    The formula jumps by up to 0.0016 at 0.1, 0.75 and 2.5 s; there the piece of the shorter periods is taken. Bradley,
    B. A. (2012). Earthquake Spectra 28(1), 17-35.
    """
    _, p, q, c, d = next(piece for piece in _PGV if period <= piece[0])
    return 0.5 * (p + q) - 0.5 * (p - q) * math.tanh(d * math.log(period / c))


_DURATION = np.array(
    [(0.01, -0.41), (0.04, -0.41), (0.08, -0.38), (0.26, -0.35), (1.4, -0.02), (6.0, 0.23), (10.0, 0.02)]
)


def duration_spectral(period: float) -> float:
    """Return the correlation of ln D5-95 and ln Sa at a period, s, 0.01 to 10.

    Bradley, B. A. (2011). Journal of Earthquake Engineering 15(6), 809-832.
    """
    return float(np.interp(math.log(period), log(_DURATION[:, 0]), _DURATION[:, 1]))


def by_formulas(measures: Sequence[Measure]) -> Array:
    """Return the published correlations (measure, measure) of PGA, PGV, D5-95 and Sa of 5 % damping."""
    matrix = np.eye(len(measures))
    for i, measure in enumerate(measures):
        for j in range(i):
            matrix[i, j] = matrix[j, i] = _pair(measure, measures[j])
    return matrix


def _pair(first: Measure, second: Measure) -> float:
    pga, pgv, duration = (MEASURES[name] for name in ("pga", "pgv", "d5_95"))
    if isinstance(second, Sa) or first == pga:
        first, second = second, first
    if isinstance(first, Sa) and isinstance(second, Sa):
        return spectral(_period(first), _period(second))
    between = {first.label, second.label}
    if between == {"pga", "pgv"}:
        return PGV_PGA
    if between == {"pga", "d5_95"}:
        return DURATION_PGA
    if between == {"pgv", "d5_95"}:
        return DURATION_PGV
    if isinstance(first, Sa):
        if second == pga:
            return spectral(_period(first), SHORTEST)
        if second == pgv:
            return velocity_spectral(_period(first))
        if second == duration:
            return duration_spectral(_period(first))
    unknown = next(
        measure for measure in (first, second) if not (isinstance(measure, Sa) or measure in (pga, pgv, duration))
    )
    raise ValueError(
        f"there is no formula for correlations of {unknown.label!r} (only of 'pga', 'pgv', 'd5_95' and Sa): give "
        "correlations as an array"
    )


def _period(measure: Sa) -> float:
    if not SHORTEST <= measure.period <= LONGEST:
        raise ValueError(
            f"correlations of {measure.label} are not known: the formulas are for {SHORTEST:g} to {LONGEST:g} s"
        )
    if measure.damping != DAMPING:
        raise ValueError(f"correlations of {measure.label} are not known: the formulas are for 5 % damping")
    return measure.period


def repaired(correlations: Array, labels: Sequence[str] = ()) -> tuple[Array, float]:
    """Return correlations (measure, measure) as a positive definite matrix, and the maximum change.

    Eigenvalues below 1e-6 are raised to it, and rows and columns are scaled so that the diagonal is one again. A change
    of a correlation by more than 0.05 causes a warning (DoubtfulCorrelations), and by more than 0.15 an error. `labels`
    name the measures in messages.
    """
    given = checks.finite_array("correlations", correlations, ndim=(2,))
    n = given.shape[0]
    if given.shape != (n, n) or (labels and n != len(labels)):
        raise ValueError(
            f"correlations must be square, one row for each of {len(labels) or n} measures, got {given.shape}"
        )
    if np.abs(given - given.T).max() > 1e-9:
        i, j = divmod(int(np.abs(given - given.T).argmax()), n)
        raise ValueError(f"correlations must be symmetric, got {given[i, j]:g} and {given[j, i]:g} at {i}, {j}")
    if np.abs(np.diag(given) - 1.0).max() > 1e-9 or np.abs(given).max() > 1.0 + 1e-9:
        raise ValueError("correlations must be 1 on the diagonal and at most 1 elsewhere")
    values, vectors = eigh(given)
    if values[0] >= LEAST_EIGENVALUE:
        return given, 0.0
    raised = times(vectors * np.maximum(values, LEAST_EIGENVALUE), vectors.T)
    scale = 1.0 / np.sqrt(np.diag(raised))
    matrix = 0.5 * (raised + raised.T) * scale[:, None] * scale
    np.fill_diagonal(matrix, 1.0)
    change = float(np.abs(matrix - given).max())
    i, j = divmod(int(np.abs(matrix - given).argmax()), n)
    where = f"of {labels[i]} and {labels[j]} " if labels else ""
    text = f"the correlations form no matrix; the nearest one that was found changes that {where}by {change:.2g}"
    if change > GREATEST_CHANGE:
        raise ValueError(f"{text}, more than {GREATEST_CHANGE:g}: take fewer measures, or correlations of one source")
    if change > DOUBTFUL_CHANGE:
        warnings.warn(text, DoubtfulCorrelations, stacklevel=3)
    return matrix, change
