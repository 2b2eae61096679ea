"""Fractiles of a product of two curves, P(x) = F(line 1) F(line 2): value, variance and profile-likelihood interval."""

from __future__ import annotations

import math

import numpy as np
import scipy

from ...core.aliases import Array
from ..kernels import binomial as engine
from .intervals import Ends, Estimate, LineFits
from .likelihood import FittedLines

BISECTIONS = 60
# An interval has no end where the search gets further than this (in ln x) from the estimate.
FAR = 50.0


def log_fractile(first: FittedLines, second: FittedLines, p: float) -> Array:
    """Return ln x at which products of lognormal curves pass p, (replicate,)."""
    # not before either factor passes p, nor after both pass its root
    low = np.maximum(first.log_fractile(p), second.log_fractile(p))
    high = np.maximum(first.log_fractile(math.sqrt(p)), second.log_fractile(math.sqrt(p)))
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        below = scipy.special.ndtr(_eta(first, middle)) * scipy.special.ndtr(_eta(second, middle)) < p
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return 0.5 * (low + high)


def log_fractile_variance(first: LineFits, second: LineFits, p: float, plain: bool = False) -> Array:
    """Return the variance of `log_fractile`, (replicate,), to first order.

    The errors of the two lines are taken as independent of each other.  `plain`: as if runs were independent.
    """
    at = log_fractile(first.lines, second.lines, p)
    variance = np.zeros_like(at)
    slope = np.zeros_like(at)
    for fits in (first, second):
        lines, covariance = fits.lines, fits.plain if plain else fits.covariance
        z = (at - lines.centre) / lines.width
        eta = lines.a + lines.b * z
        hazard = np.exp(-0.5 * eta**2 - 0.5 * math.log(2.0 * math.pi) - scipy.special.log_ndtr(eta))
        aa, ab, bb = covariance.T
        variance += hazard**2 * (aa + 2.0 * z * ab + z**2 * bb)
        slope += hazard * lines.b / lines.width
    return variance / slope**2


def profile_interval(first: Estimate, second: Estimate, p: float, confidence: float) -> Ends:
    """Profile-likelihood interval of ln x of a fractile: twice the drop of the profile is the chi-square quantile.

    Where motions come more than once, the quantile is multiplied by the ratio of the variance to that of independent
    runs (1 at least).
    """
    best = float(log_fractile(first.lines, second.lines, p)[0])
    variances = (log_fractile_variance(first.fits, second.fits, p, plain)[0] for plain in (False, True))
    drop = 0.5 * float(scipy.special.chdtri(1.0, 1.0 - confidence)) * max(next(variances) / next(variances), 1.0)
    top = sum(_line_value(one, one.lines.a[0], one.lines.b[0]) for one in (first, second))

    def excess(t: float) -> float:
        """Return the drop of the profile log-likelihood at t less the drop that is allowed."""
        scratch = (_scratch(first), _scratch(second))

        def loss(share: float) -> float:
            # the first factor's part of p on the scale of its eta: from p itself (the second factor is 1) to 1
            eta = float(scipy.special.ndtri(p)) + math.exp(share)
            rest = float(scipy.special.ndtri(min(p / float(scipy.special.ndtr(eta)), 1.0)))
            if not math.isfinite(rest):
                return math.inf
            return -(_profile(first, t, eta, scratch[0]) + _profile(second, t, rest, scratch[1]))

        own = math.log(max(float(_eta(first.lines, np.array([t]))[0] - scipy.special.ndtri(p)), 1e-3))
        found = scipy.optimize.minimize_scalar(loss, bracket=(own - 0.5, own + 0.5), tol=1e-10)
        return float(top + found.fun - drop)

    ends = []
    for side in (-1.0, 1.0):
        step, inner = 0.1, best
        while excess(inner + side * step) < 0.0 and abs(inner - best) < FAR:
            inner += side * step
            step *= 1.6
        outer = inner + side * step
        if abs(inner - best) >= FAR:
            ends.append(side * math.inf)
        else:
            ends.append(float(scipy.optimize.brentq(excess, inner, outer, xtol=1e-11)))
    return ends[0], ends[1]


def _eta(lines: FittedLines, log_x: Array) -> Array:
    return lines.a + lines.b * (log_x - lines.centre) / lines.width


def _scratch(one: Estimate) -> Array:
    return np.zeros((engine.SCRATCH, one.fits.data.z.size))


def _arguments(one: Estimate) -> tuple[int, int, Array, Array, Array, bool]:
    lines, data = one.lines, one.fits.data
    return data.kind, lines.link.code, data.z, data.failures[0], data.runs[0], bool(lines.penalised[0])


def _line_value(one: Estimate, a: float, b: float) -> float:
    kind, link, z, failures, runs, penalised = _arguments(one)
    return float(engine.evaluate(kind, link, a, b, z, failures, runs, penalised, _scratch(one))[0])


def _profile(one: Estimate, t: float, eta: float, scratch: Array) -> float:
    """Return the largest log-likelihood of a factor whose line passes eta at ln x = t."""
    kind, link, z, failures, runs, penalised = _arguments(one)
    at = (t - one.lines.centre) / one.lines.width
    guess = one.lines.b[0]
    what = engine.FRACTILE
    found = engine.profile(kind, link, z, failures, runs, penalised, what, eta, at, guess, engine.PRECISE, scratch)
    return float(found[0])
