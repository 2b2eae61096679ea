"""Link functions F of two-parameter curves, P(x) = F(a + b ln x): each is a distribution of ln(capacity)."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy

from ...core.elementary import exp, expm1, log, log1p
from ..kernels import binomial as engine

LOGNORMAL = "lognormal"
"""The default form, and the one whose rates have closed forms."""


@dataclass(frozen=True)
class Link:
    """Link function F: its name as a form of curve, the kernel's code, and the vectorised functions.

    `scale` is b times the standard deviation of ln(capacity), so that `dispersion` means the same for every form:
    P(x) = cumulative(quantile(1/2) + scale ln(x/median)/dispersion).
    """

    name: str
    code: int
    scale: float
    cumulative: Callable[[Any], Any]
    quantile: Callable[[Any], Any]
    text: str


def _normal(eta: Any) -> Any:
    return scipy.special.ndtr(eta)


def _normal_quantile(p: Any) -> Any:
    return scipy.special.ndtri(p)


def _logistic(eta: Any) -> Any:
    return scipy.special.expit(eta)


def _logistic_quantile(p: Any) -> Any:
    return scipy.special.logit(p)


def _weibull(eta: Any) -> Any:
    return -expm1(-exp(eta))


def _weibull_quantile(p: Any) -> Any:
    return log(-log1p(-np.asarray(p)))


# wrapped in functions, so that scipy's parts load only when they are first used
LINKS: dict[str, Link] = {
    link.name: link
    for link in (
        Link(LOGNORMAL, engine.PROBIT, 1.0, _normal, _normal_quantile, "Phi(ln(x/median)/dispersion)"),
        Link("log-logistic", engine.LOGIT, math.pi / math.sqrt(3.0), _logistic, _logistic_quantile, "logistic in ln x"),
        Link("weibull", engine.CLOGLOG, math.pi / math.sqrt(6.0), _weibull, _weibull_quantile, "1 - exp(-(x/scale)^b)"),
    )
}
"""Every two-parameter form by name."""
