"""Compiled integrals of a hazard curve over lognormal fragility curves, piece by piece (`risk.convolution`)."""

import math

import numpy as np

from ...core.compiled import kernel
from .binomial import ROOT_2PI, ROOT_HALF, mills_ratio

CLOSED = 3.0
"""Deviate from which on a continued fraction is as good as the error function."""


@kernel()
def scaled_tail(t):
    """Return Phi(-t) exp(t²/2) at t >= 0."""
    if t < CLOSED:
        return 0.5 * math.erfc(t * ROOT_HALF) * math.exp(0.5 * t * t)
    return mills_ratio(t) / ROOT_2PI


@kernel()
def log_rate_at(u, reference, log_rate, slope, curvature):
    """Return ln H at u on a piece; 0 times infinity, at the end of an infinite piece, is 0."""
    slant = slope if curvature == 0.0 else slope + curvature * (u - reference)
    return log_rate if slant == 0.0 else log_rate - slant * (u - reference)


@kernel()
def slope_at(u, reference, slope, curvature):
    """Return -d ln H/du at u on a piece."""
    return slope if curvature == 0.0 else slope + 2.0 * curvature * (u - reference)


@kernel(keep=True)
def normal_integrals(start, stop, reference, log_rate, slope, curvature, median, dispersion, integrals):
    """Write the integrals of H dPhi((u - median)/dispersion) over pieces into `integrals` (curve, piece).

    start, stop (curve, piece), or (1, piece) of all curves; median, dispersion (curve,).  The integral of an empty
    piece is 0, and of a curve that is NaN it is NaN.
    """
    for i in range(median.size):
        m, beta = median[i], dispersion[i]
        row = i if start.shape[0] > 1 else 0
        for j in range(reference.size):
            if math.isnan(m):
                integrals[i, j] = np.nan
                continue
            if stop[row, j] <= start[row, j]:
                integrals[i, j] = 0.0
                continue
            r = math.sqrt(1.0 + 2.0 * curvature[j] * beta * beta)
            # its value is the same at every point: it is taken where its two terms are smallest
            e = log_rate_at(m, reference[j], log_rate[j], slope[j], curvature[j])
            t = slope_at(m, reference[j], slope[j], curvature[j]) * beta / r
            whole, least = e + 0.5 * t * t, abs(e) + 0.5 * t * t
            first = last = begin = end = 0.0
            for side in range(2):
                u = stop[row, j] if side else start[row, j]
                t, value = u, 0.0
                if not math.isinf(u):
                    z = (u - m) / beta
                    e = log_rate_at(u, reference[j], log_rate[j], slope[j], curvature[j]) - 0.5 * z * z
                    t = (z + slope_at(u, reference[j], slope[j], curvature[j]) * beta) / r
                    value = np.exp(e) * scaled_tail(abs(t))
                    if abs(e) + 0.5 * t * t < least:
                        whole, least = e + 0.5 * t * t, abs(e) + 0.5 * t * t
                if side:
                    last, end = t, value
                else:
                    first, begin = t, value
            if first >= 0.0:
                integrals[i, j] = (begin - end) / r
            elif last <= 0.0:
                integrals[i, j] = (end - begin) / r
            else:
                integrals[i, j] = (np.exp(whole) - begin - end) / r
