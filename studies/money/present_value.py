"""Money now and money later: what a saving of some years is worth today, and when it has paid a cost.

What falls, and what anything costs, is not known here.
"""

from __future__ import annotations

import math

from ...core import checks

DISCOUNT = 0.04
"""Discount rate, 1/year, where a study names no other."""
MOST_DISCOUNT = 0.5
"""Largest discount rate, 1/year."""


def present_value(rate: float, years: float) -> float:
    """Return what a saving of 1 at the end of each of some years is worth today.

    Parameters
    ----------
    rate : float
        Discount rate r, 1/year, 0 to 0.5, compounded once a year; 0 for no discounting.
    years : float
        Number of years n, >= 0.

    Returns
    -------
    float
        In years: the present value over the saving of one year.

    Raises
    ------
    ValueError
        A rate or a number of years out of range.

    Notes
    -----
    (1 - (1 + r)^-n) / r, the uniform series present worth factor; n where r = 0.

    References
    ----------
    Fuller, S. K., Petersen, S. R. (1996). Life-cycle costing manual for the federal energy management program. NIST
    Handbook 135 (recalled).

    Examples
    --------
    >>> round(present_value(0.04, 50.0), 3)
    21.482
    """
    checks.number("rate", rate, at_least=0.0, at_most=MOST_DISCOUNT)
    checks.number("years", years, at_least=0.0)
    return -math.expm1(-years * math.log1p(rate)) / rate if rate > 0.0 else years


def payback(cost: float, saving: float, rate: float) -> float:
    """Return the years after which savings, discounted, have paid a cost.

    Parameters
    ----------
    cost : float
        Cost C today, >= 0.
    saving : float
        Saving A at the end of each year, in the same currency; a loss where it is negative.
    rate : float
        Discount rate r, 1/year, 0 to 0.5, compounded once a year; 0 for no discounting.

    Returns
    -------
    float
        Years; infinite where the saving never pays the cost (A <= r C, or A <= 0), 0 of a cost of 0; NaN where cost or
        saving is not known (NaN).

    Raises
    ------
    ValueError
        A rate out of range, a negative cost.

    Notes
    -----
    n = -ln(1 - r C / A) / ln(1 + r), at which `present_value` times A is C; C / A where r = 0.  It is the discounted
    payback of equal annual savings.

    References
    ----------
    ASTM E1121. Standard practice for measuring payback for investments in buildings and building systems (recalled).

    Examples
    --------
    >>> round(payback(1000.0, 100.0, 0.0), 1), round(payback(1000.0, 100.0, 0.04), 1), payback(1000.0, 40.0, 0.04)
    (10.0, 13.0, inf)
    """
    checks.number("rate", rate, at_least=0.0, at_most=MOST_DISCOUNT)
    if math.isnan(cost) or math.isnan(saving):
        return math.nan
    checks.number("cost", cost, at_least=0.0)
    if cost == 0.0:
        return 0.0
    if saving <= rate * cost:
        return math.inf
    return -math.log1p(-rate * cost / saving) / math.log1p(rate) if rate > 0.0 else cost / saving
