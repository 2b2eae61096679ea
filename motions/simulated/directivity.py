"""Predictive equations of Dabaghi and Der Kiureghian for the parameters of near-fault motions.

They are valid for one horizontal component, in the direction of the largest pulse; in motions with a pulse the
background is the motion without the pulse.
"""

import math
from dataclasses import dataclass
from functools import partial

import numpy as np

from ...core.elementary import Array, cholesky, times
from .marginals import Marginal, bounded_beta, exponential_of_beta, lognormal, two_sided_exponential
from .scenario import REVERSE, STRIKE_SLIP, TWO_PI, Parameters

TRUNCATION = 2.0  # standard deviations beyond which scores are drawn again
MIDDLE = 0.30  # the energy fraction of t_mid in these equations
NEARNESS = 6.0  # km, of sqrt(R² + 6²)
SATURATION = 6.5  # magnitude above which V_p no longer grows, and the intensity grows less
DEEPEST, STIFFEST = 1e3, 1100.0  # depth (m) and velocity (m/s) above which the motions do not change

# Columns: constant, M, (M - 6.5)+, ln sqrt(R² + 36), M ln sqrt(R² + 36), F Z, ln V, s; km, m/s.
# Rows: ln V_p (cm/s), ln T_p, gamma, nu, ln t_p; then the background: ln Ia (cm/s), ln D5-95, ln t_30, ln f_mid (Hz),
# slope of it (Hz/s), zeta; s.
WITH_PULSE = np.array(
    [
        [1.69863, 0.60819, -0.60819, -0.57622, 0.0, 0.18307, -0.09393, 0.006571],
        [-2.47924, 0.67040, 0.0, 0.0, 0.0, -0.26396, -0.23255, 0.007920],
        [0.0] * 8,
        [0.0] * 8,
        [-4.24873, 0.85219, 0.0, 0.38960, 0.0, -0.38032, -0.08801, 0.0],
        [-2.11599, 1.47405, -1.37811, -1.07312, 0.0, 0.33651, 0.0, 0.0],
        [-0.38109, 0.73282, 0.0, 0.21650, 0.0, -0.16265, -0.42657, 0.0],
        [-4.77682, 0.87998, 0.0, 0.31061, 0.0, -0.33923, 0.0, 0.0],
        [0.96671, -0.11094, 0.0, 0.0, 0.0, 0.0, 0.18329, 0.0],
        [-2.16588, 0.32150, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [-1.70735, 0.43303, 0.0, -0.41265, 0.0, 0.0, 0.0, 0.0],
    ]
)
SPREAD_WITH_PULSE = np.array([0.3853, 0.5806, 1.0, 1.0, 0.4686, 0.7815, 0.3720, 0.3935, 0.4100, 0.8201, 1.0964])
CORRELATION_WITH_PULSE = (
    (-0.1758, -0.0203, 0.1736, 0.1911, 0.4466, 0.0422, 0.1200, -0.3822, 0.0573, 0.1551),
    (0.1834, 0.0013, 0.4316, -0.0803, 0.0984, 0.3682, 0.0510, 0.0223, 0.1752),
    (-0.1900, 0.2428, 0.1782, 0.1072, 0.2364, -0.1140, 0.0536, 0.0642),
    (0.1192, -0.0812, 0.0912, 0.0718, -0.1336, -0.0920, 0.0299),
    (0.0597, 0.1637, 0.7887, -0.0313, -0.1538, 0.1261),
    (-0.0244, 0.0857, 0.0784, 0.0991, 0.0265),
    (0.2454, -0.0247, -0.2248, 0.0459),
    (0.0299, -0.0618, 0.1978),
    (-0.2415, 0.1125),
    (0.1124,),
)
WITHOUT_PULSE = np.array(
    [
        [8.09696, 1.00610, -1.39348, -4.85870, 0.47264, 0.43455, -0.86256, 0.0],
        [-1.03474, 0.76909, 0.0, 0.41224, 0.0, -0.37774, -0.42423, 0.0],
        [-4.44400, 0.79809, 0.0, 0.34541, 0.0, -0.23082, 0.0, 0.0],
        [0.24713, -0.14921, 0.0, 0.0, 0.0, 0.0, 0.37720, 0.0],
        [-1.44303, 0.22305, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [-0.38041, 0.15934, 0.0, -0.29821, 0.0, 0.0, 0.0, 0.0],
    ]
)
SPREAD_WITHOUT_PULSE = np.array([1.0527, 0.3984, 0.3057, 0.4475, 0.9413, 1.0077])
CORRELATION_WITHOUT_PULSE = (
    (-0.1836, 0.1041, 0.0143, 0.2029, -0.1519),
    (0.3074, -0.0150, -0.1494, 0.0888),
    (-0.1629, -0.0946, -0.0192),
    (-0.1875, -0.1637),
    (-0.0854,),
)

UNIT_LOGNORMAL: Marginal = partial(lognormal, 0.0, 1.0)
PULSE_MARGINALS: tuple[Marginal, ...] = (
    UNIT_LOGNORMAL,
    UNIT_LOGNORMAL,
    partial(bounded_beta, 1.3033, 3.9686, 2.0, 3.2),
    partial(bounded_beta, 1.0, 1.0, 0.0, TWO_PI),
    UNIT_LOGNORMAL,
)
BACKGROUND_MARGINALS: tuple[Marginal, ...] = (
    *(UNIT_LOGNORMAL,) * 4,
    partial(two_sided_exponential, 6.4024, 14.2936, -3.5, 1.5),
    partial(exponential_of_beta, 5.3355, 3.8295, -4.7, 0.0),
)
BACKGROUND_SI = (0.01, 1.0, 1.0, TWO_PI, TWO_PI, 1.0)
PULSE_SI = (0.01, 1.0, 1.0, 1.0, 1.0)


def _symmetric(triangle: tuple[tuple[float, ...], ...]) -> Array:
    size = len(triangle) + 1
    matrix = np.eye(size)
    for i, row in enumerate(triangle):
        matrix[i, i + 1 :] = matrix[i + 1 :, i] = row
    return matrix


ROOT_WITH_PULSE = cholesky(_symmetric(CORRELATION_WITH_PULSE))
ROOT_WITHOUT_PULSE = cholesky(_symmetric(CORRELATION_WITHOUT_PULSE))


@dataclass(frozen=True)
class NearFaultEquations:
    """Predictive equations of Dabaghi and Der Kiureghian (2018) for one scenario; parameters as of `NearFault`.

    Probability of a pulse (Shahi and Baker 2014), in km and degrees. In strike-slip faulting it is 1/[1 + exp(0.457 +
    0.126 R - 0.244 sqrt s + 0.013 theta)]. In other faulting it is 1/[1 + exp(0.304 + 0.072 R - 0.208 sqrt d + 0.021
    phi)]. Errors beyond two standard deviations are drawn again, as are pulses that would begin before the motion.

    Dabaghi, M. and Der Kiureghian, A. (2018). Earthquake Engineering and Structural Dynamics 47, 1369-1393
    (coefficients, correlations and truncation read in public code that implements it). Shahi, S. K. and Baker, J. W.
    (2014). Bulletin of the Seismological Society of America 104, 2456-2466.
    """

    magnitude: float
    distance: float
    vs30: float
    faulting: str
    depth: float
    along: float
    angle: float

    @property
    def pulse_probability(self) -> float:
        """Probability that the motion has a pulse."""
        km, length, degrees = self.distance / 1e3, math.sqrt(self.along / 1e3), math.degrees(self.angle)
        if self.faulting == STRIKE_SLIP:
            exponent = 0.457 + 0.126 * km - 0.244 * length + 0.013 * degrees
        else:
            exponent = 0.304 + 0.072 * km - 0.208 * length + 0.021 * degrees
        return 1.0 / (1.0 + math.exp(exponent))

    def expected(self, pulse: bool) -> Array:
        """Return the expected scores, shape (11,) with a pulse and (6,) without."""
        m, reverse = self.magnitude, float(self.faulting == REVERSE)
        near = 0.5 * math.log((self.distance / 1e3) ** 2 + NEARNESS**2)
        shallow = min(self.depth, DEEPEST) / 1e3
        terms = [1.0, m, max(m - SATURATION, 0.0), near, m * near, reverse * shallow]
        terms += [math.log(min(self.vs30, STIFFEST)), self.along / 1e3]
        return np.asarray(((WITH_PULSE if pulse else WITHOUT_PULSE) * np.array(terms)).sum(axis=1))

    def draw(self, random: np.random.Generator, pulse: bool) -> Array:
        """Return one random set of scores, with errors within two standard deviations."""
        root = ROOT_WITH_PULSE if pulse else ROOT_WITHOUT_PULSE
        while True:
            errors = times(root, random.standard_normal(len(root)))
            if np.abs(errors).max() <= TRUNCATION:
                return self.at(errors, pulse)

    def at(self, errors: Array, pulse: bool) -> Array:
        """Return the scores at `errors` standard deviations from the expected scores."""
        return np.asarray(self.expected(pulse) + (SPREAD_WITH_PULSE if pulse else SPREAD_WITHOUT_PULSE) * errors)


def pulse_parameters(scores: Array) -> list[Array]:
    """Return V_p (m/s), T_p (s), gamma, nu (rad) and the time t_p of the middle (s) from scores (motion, >= 5)."""
    columns = np.ascontiguousarray(scores[:, :5].T)
    return [si * law(column) for si, law, column in zip(PULSE_SI, PULSE_MARGINALS, columns, strict=True)]


def background_parameters(scores: Array) -> Parameters:
    """Return the background's parameters (SI) from the last six scores (motion, >= 6); `t_mid` at 30 % energy."""
    columns = np.ascontiguousarray(scores[:, -6:].T)
    return Parameters(
        *(si * law(column) for si, law, column in zip(BACKGROUND_SI, BACKGROUND_MARGINALS, columns, strict=True))
    )
