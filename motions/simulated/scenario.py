"""Published predictive equations for the parameters of site-based motions of an earthquake at a site.

Each parameter has a standard normal score, which is linear in functions of the scenario. A marginal distribution turns
the score into the parameter. The errors of the scores are correlated.
"""

import math
from dataclasses import dataclass
from functools import partial
from typing import Annotated, NamedTuple

import numpy as np

from ...core.elementary import Array, cholesky, times
from ...core.parameters import Parameter
from ...core.units import STANDARD_GRAVITY
from .marginals import Marginal, bounded_beta, gamma, lognormal, two_sided_exponential

STRIKE_SLIP, REVERSE = FAULTINGS = ("strike-slip", "reverse")
Faulting = Annotated[str, Parameter(words=FAULTINGS)]
VELOCITY = Parameter("m/s", at_least=100.0, at_most=3000.0)
Velocity = Annotated[float, VELOCITY]
"""Type of the shear-wave velocity of the uppermost 30 m."""
TWO_PI = 2.0 * math.pi


class Parameters(NamedTuple):
    """Parameters of site-based motions, as arrays (motion,) or floats.

    `arias`: Arias intensity pi/(2 g) integral a² dt, m/s. `d5_95`, `t_mid`: time from 5 to 95 % of the Arias intensity,
    and to its middle fraction (45 %), s. `omega_mid`, `omega_slope`: filter frequency at t_mid, rad/s, and its slope,
    rad/s². `zeta`: damping ratio of the filter.
    """

    arias: Array
    d5_95: Array
    t_mid: Array
    omega_mid: Array
    omega_slope: Array
    zeta: Array


UNITS = {
    "arias": ("m s-1", "Arias intensity"),
    "d5_95": ("s", "time from 5 to 95 % of the Arias intensity"),
    "t_mid": ("s", "time of the middle of the strong shaking"),
    "omega_mid": ("rad s-1", "filter frequency in the middle of the strong shaking"),
    "omega_slope": ("rad s-2", "slope of the filter frequency"),
    "zeta": ("1", "damping ratio of the filter"),
}


def corner_frequency(magnitude: float) -> float:
    """Return the corner of the final high-pass, Hz: 10^(1.4071 - 0.3452 M) (Dabaghi and Der Kiureghian 2018)."""
    return float(10.0 ** (1.4071 - 0.3452 * magnitude))


PUBLISHED_CONSTANT = -1.844
# Columns: constant, F, M/7, x_R, x_V, from the 2010 paper; the first constant may be another (`SiteBasedEquations`).
COEFFICIENTS = np.array(
    [
        [PUBLISHED_CONSTANT, -0.071, 2.944, -1.356, -0.265],
        [-6.195, -0.703, 6.792, 0.219, -0.523],
        [-5.011, -0.345, 4.638, 0.348, -0.185],
        [2.253, -0.081, -1.810, -0.211, 0.012],
        [-2.489, 0.044, 2.408, 0.065, -0.081],
        [-0.258, -0.477, 0.905, -0.289, 0.316],
    ]
)
BETWEEN = np.array([0.274, 0.457, 0.511, 0.692, 0.129, 0.682])
WITHIN = np.array([0.594, 0.569, 0.414, 0.723, 0.953, 0.760])
CORRELATION = np.array(
    [
        [1.0, -0.36, 0.01, -0.15, 0.13, -0.01],
        [-0.36, 1.0, 0.67, -0.13, -0.16, -0.20],
        [0.01, 0.67, 1.0, -0.28, -0.20, -0.22],
        [-0.15, -0.13, -0.28, 1.0, -0.20, 0.28],
        [0.13, -0.16, -0.20, -0.20, 1.0, -0.01],
        [-0.01, -0.20, -0.22, 0.28, -0.01, 1.0],
    ]
)
# In the papers' units: s g, s, s, Hz, Hz/s, 1.
MARGINALS: tuple[Marginal, ...] = (
    partial(lognormal, -4.374, 1.432),
    partial(bounded_beta, 1.1314, 2.4474, 5.0, 45.0),
    partial(bounded_beta, 1.5792, 3.6405, 0.5, 40.0),
    partial(gamma, 4.0982, 1.4330),
    partial(two_sided_exponential, 6.7729, 17.095, -2.0, 0.5),
    partial(bounded_beta, 1.4250, 5.7208, 0.02, 1.0),
)
SI = np.array([STANDARD_GRAVITY, 1.0, 1.0, TWO_PI, TWO_PI, 1.0])


@dataclass(frozen=True)
class SiteBasedEquations:
    """Predictive equations of Rezaeian and Der Kiureghian (2010) for one scenario, as of `SiteBasedScenario`.

    Score v_i = c_i + F f_i + m_i M/7 + r_i x_R + s_i x_V + error. For the Arias intensity x_R = ln(R/25 km) and x_V =
    ln(V/750 m/s), for the others x_R = R/25 km and x_V = V/750 m/s. The error N(0, tau² + sigma²) is the total error,
    and the correlations are between total errors. Coefficients, tau, sigma, correlations and marginals are the paper's,
    including the default constant of the Arias intensity, -1.844. Later public code by one of its authors has -2.2962,
    ln(pi/2) less. For M 6.5 at 20 km on 760 m/s it gives 1.1 to 1.2 times the median PGA and PGV of Boore et al.
    (2014). The paper's constant gives 1.5 to 1.7 times.

    Rezaeian, S. and Der Kiureghian, A. (2010). Earthquake Engineering and Structural Dynamics 39, 1155-1180.
    """

    magnitude: float
    distance: float
    vs30: float
    faulting: str = STRIKE_SLIP
    arias_constant: float = PUBLISHED_CONSTANT

    @property
    def expected(self) -> Array:
        """Expected scores, shape (6,)."""
        r, v = self.distance / 25e3, self.vs30 / 750.0
        f = float(self.faulting == REVERSE)
        predictors = np.array([1.0, f, self.magnitude / 7.0, r, v])
        scores = (COEFFICIENTS * predictors).sum(axis=1)
        intensity = np.array([1.0, f, self.magnitude / 7.0, math.log(r), math.log(v)])
        scores[0] = (np.array([self.arias_constant, *COEFFICIENTS[0, 1:]]) * intensity).sum()
        return np.asarray(scores)

    def draw(self, random: np.random.Generator) -> Array:
        """Return one random set of scores, shape (6,)."""
        return self.expected + times(SPREAD, random.standard_normal(6))

    def parameters(self, scores: Array) -> Parameters:
        """Return the parameters (SI) at scores (motion, 6)."""
        columns = [np.ascontiguousarray(column) for column in scores.T]
        return Parameters(*(si * law(column) for si, law, column in zip(SI, MARGINALS, columns, strict=True)))

    def medians(self) -> Parameters:
        """Return the median of each parameter, as floats."""
        return self.at(np.zeros(6))

    def at(self, deviations: Array) -> Parameters:
        """Return the parameters at `deviations` (6,) from the medians, in standard deviations of the scores."""
        parameters = self.parameters((self.expected + deviations * np.hypot(BETWEEN, WITHIN))[None])
        return Parameters(*(values[0] for values in parameters))


SPREAD = np.hypot(BETWEEN, WITHIN)[:, None] * cholesky(CORRELATION)
