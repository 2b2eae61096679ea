"""Money now and money later: present value of savings over some years, and payback of a cost."""

import math

from ...core import checks
from ...core.parameters import Parameter

DISCOUNT = 0.04
"""Discount rate, 1/year, if a study names no other."""
DISCOUNT_RATE = Parameter("1/year", at_least=0.0, at_most=0.5)
"""Discount rates that make sense."""


def present_value(rate: float, years: float) -> float:
    """Return the present value of a saving of 1 at the end of each of some years, in years.

    (1 - (1 + r)^-n) / r, the uniform series present worth factor; n if r = 0. The discount rate r, 1/year, 0 to 0.5, is
    compounded once a year; the years n are >= 0. Fuller, S. K., Petersen, S. R. (1996). Life-cycle costing manual for
    the federal energy management program. NIST Handbook 135 (recalled).
    """
    DISCOUNT_RATE.number("rate", rate)
    checks.number("years", years, at_least=0.0)
    return -math.expm1(-years * math.log1p(rate)) / rate if rate > 0.0 else years


def payback(cost: float, saving: float, rate: float) -> float:
    """Return the years after which savings, discounted, have paid a cost: infinite if never, NaN if one is not known.

    The number of years is n = -ln(1 - r C / A) / ln(1 + r), at which `present_value` times A is C; C / A if r = 0. It
    is the discounted payback of equal annual savings A at the end of each year (a loss if negative), with the cost C >=
    0 today. The discount rate r, 1/year, 0 to 0.5, is compounded once a year. The saving never pays the cost if A <= r
    C, or A <= 0; a cost of 0 is paid after 0 years. ASTM E1121. Standard practice for measuring payback for investments
    in buildings and building systems (recalled).
    """
    DISCOUNT_RATE.number("rate", rate)
    if math.isnan(cost) or math.isnan(saving):
        return math.nan
    checks.number("cost", cost, at_least=0.0)
    if cost == 0.0:
        return 0.0
    if saving <= rate * cost:
        return math.inf
    return -math.log1p(-rate * cost / saving) / math.log1p(rate) if rate > 0.0 else cost / saving
