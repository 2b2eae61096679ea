"""Intervals of a binomial proportion: Wilson's score, Clopper and Pearson's exact, and Jeffreys' interval."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import scipy

from ...core import checks
from ...core.aliases import Array
from ...core.doubts import Doubt, warn
from ...core.parameters import CONFIDENCE, HALF_INTERVAL, USUAL_CONFIDENCE

Ends = tuple[Array, Array]


def binomial_interval(
    successes: Any, trials: Any, confidence: float = USUAL_CONFIDENCE, method: str = "wilson"
) -> Ends:
    """Return an interval of a binomial proportion.

    Parameters
    ----------
    successes, trials : array_like, broadcast against each other
        Successes, between 0 and the trials; not whole if trials succeed in part. Shares of the trials cause a warning.
    confidence : float
        Between 0 and 1.
    method : {"wilson", "clopper-pearson", "jeffreys"}
        Wilson's score interval. Clopper and Pearson's interval, whose coverage is at least its confidence level. The
        equal-tailed interval of Jeffreys' prior, with lower end 0 if no trial and upper end 1 if every trial succeeded.

    Returns
    -------
    lower, upper : numpy.ndarray
        NaN if there was no trial.

    Notes
    -----
    Wilson's interval has a coverage near its nominal level on average and never leaves [0, 1]. Clopper and Pearson's
    interval keeps the level for every true probability, at the cost of some width. Jeffreys' interval has much the same
    coverage as Wilson's and is a little shorter near 0 and 1 (Brown, Cai and DasGupta 2001).

    References
    ----------
    Wilson, E. B. (1927). Probable inference, the law of succession, and statistical inference. Journal of the
    American Statistical Association 22, 209-212.

    Clopper, C. J. and Pearson, E. S. (1934). The use of confidence or fiducial limits illustrated in the case of the
    binomial. Biometrika 26, 404-413.

    Brown, L. D., Cai, T. T. and DasGupta, A. (2001). Interval estimation for a binomial proportion. Statistical
    Science 16(2), 101-133.

    Examples
    --------
    >>> lower, upper = binomial_interval(4, 40)
    >>> print(f"{lower:.5f} {upper:.5f}")
    0.03958 0.23052
    """
    k, n = _numbers(successes, trials)
    part = (k > 0.0) & (k < 1.0) & (n > 1.0)
    if part.any() and bool((k <= 1.0).all()) and bool((2.0 * k[part] % 1.0 != 0.0).all()):
        warn([Doubt.of("share_of_trials", successes=k[part].flat[0], trials=n[part].flat[0])])
    return _ends(k, n, confidence, checks.choice("method", method, tuple(METHODS)))


def wilson_interval(successes: Any, trials: Any, confidence: float = USUAL_CONFIDENCE) -> Ends:
    """`binomial_interval` with ``method="wilson"``."""
    return binomial_interval(successes, trials, confidence, "wilson")


def interval_of_parts(successes: Any, trials: Any, confidence: float = USUAL_CONFIDENCE) -> Ends:
    """`wilson_interval` of trials that succeed in part (means over variants of a piece), without a warning."""
    return _ends(*_numbers(successes, trials), confidence, "wilson")


def _numbers(successes: Any, trials: Any) -> Ends:
    """Return successes and trials of one shape; TypeError or ValueError if they do not go together."""
    try:
        k, n = np.broadcast_arrays(checks.numbers("successes", successes), checks.numbers("trials", trials))
    except (TypeError, ValueError, RuntimeError):
        shapes = f"{checks.shown(successes)} and {checks.shown(trials)}"
        raise TypeError(f"successes and trials must be numbers or arrays of shapes that fit, got {shapes}") from None
    if not np.all((k >= 0.0) & (k <= n)):
        raise ValueError("successes must lie between 0 and trials")
    return k, n


def _ends(k: Array, n: Array, confidence: float, method: str) -> Ends:
    known = np.where(n > 0.0, n, np.nan)
    lower, upper = METHODS[method](k, known, CONFIDENCE.number("confidence", confidence))
    lower = np.where(k == 0.0, 0.0, lower)
    upper = np.where(k == n, 1.0, upper)
    return np.where(n > 0.0, lower, np.nan), np.where(n > 0.0, upper, np.nan)


def wilson_half_width(runs: int) -> float:
    """Return the half width of Wilson's 95 % interval of a probability of 1/2: z/(2 sqrt(runs + z²))."""
    z = float(scipy.special.ndtri(0.975))
    return 0.5 * z / math.sqrt(checks.count("runs", runs) + z * z)


def runs_for_half_width(half_width: float) -> int:
    """Return the minimum number of runs whose `wilson_half_width` does not exceed `half_width` (above 0, below 1/2)."""
    width = HALF_INTERVAL.number("half_width", half_width)
    z = float(scipy.special.ndtri(0.975))
    return math.ceil(z * z * (0.25 / width**2 - 1.0))


def _wilson(k: Array, n: Array, confidence: float) -> Ends:
    z2 = scipy.special.ndtri(0.5 + 0.5 * confidence) ** 2
    centre = (k + 0.5 * z2) / (n + z2)
    half = np.sqrt(z2 * (k * (n - k) / n + 0.25 * z2)) / (n + z2)
    return centre - half, centre + half


def _clopper_pearson(k: Array, n: Array, confidence: float) -> Ends:
    tail = 0.5 * (1.0 - confidence)
    # where an end is 0 or 1 anyway, the beta distribution degenerates
    lower = scipy.special.betaincinv(np.where(k > 0.0, k, 1.0), n - k + 1.0, tail)
    upper = scipy.special.betainccinv(k + 1.0, np.where(n > k, n - k, 1.0), tail)
    return np.asarray(lower, dtype=float), np.asarray(upper, dtype=float)


def _jeffreys(k: Array, n: Array, confidence: float) -> Ends:
    tail = 0.5 * (1.0 - confidence)
    lower = scipy.special.betaincinv(k + 0.5, n - k + 0.5, tail)
    upper = scipy.special.betainccinv(k + 0.5, n - k + 0.5, tail)
    return np.asarray(lower, dtype=float), np.asarray(upper, dtype=float)


METHODS: dict[str, Callable[[Array, Array, float], Ends]] = {
    "wilson": _wilson,
    "clopper-pearson": _clopper_pearson,
    "jeffreys": _jeffreys,
}
"""The intervals by the names that `binomial_interval` takes."""

METHOD_NAMES = {"wilson": "Wilson", "clopper-pearson": "Clopper-Pearson", "jeffreys": "Jeffreys"}
"""Names of the methods in figures and long names."""
