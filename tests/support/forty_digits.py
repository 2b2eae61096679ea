"""40-digit solutions of one linear piece (mpmath), from other formulas than the engine's: what rounding is held to.

Between samples the forcing is linear, so the piece is x' = M x with x = (rotation, velocity, push, slope of the push);
its step is the matrix exponential.  Arguments are floats, taken exactly.  SI units, per unit moment of inertia.
"""

import mpmath
import numpy as np

DIGITS = 60  # worked with; 40 are left after the longest runs


def history(stiffness, damping, push, dt, theta0=0.0, omega0=0.0):
    """Rotation and velocity (2, n) at the samples of theta'' = push - stiffness theta - damping theta', as floats."""
    with mpmath.workdps(DIGITS):
        rates = [[0, 1, 0, 0], [-mpmath.mpf(stiffness), -mpmath.mpf(damping), 1, 0], [0, 0, 0, 1], [0, 0, 0, 0]]
        step = mpmath.expm(mpmath.matrix(rates) * mpmath.mpf(dt), method="taylor")
        a, b = ([step[row, column] for column in range(4)] for row in range(2))
        theta, omega = mpmath.mpf(theta0), mpmath.mpf(omega0)
        found = [(float(theta), float(omega))]
        values = [mpmath.mpf(float(value)) for value in push]
        for now, after in zip(values[:-1], values[1:], strict=True):
            slope = (after - now) / dt
            theta, omega = (
                a[0] * theta + a[1] * omega + a[2] * now + a[3] * slope,
                b[0] * theta + b[1] * omega + b[2] * now + b[3] * slope,
            )
            found.append((float(theta), float(omega)))
    return np.array(found).T


def driven(stiffness, damping, amplitude, per_cycle, dt, samples):
    """Rotation and velocity (2, s) at `samples` of a piece at rest under amplitude sin(2 pi k/per_cycle), held linear.

    The modes m = omega - s' theta obey m' = s m + push, so m after k steps is a geometric sum: no error adds up, at
    and beside resonance, however many the cycles.
    """
    with mpmath.workdps(DIGITS):
        root = mpmath.sqrt(mpmath.mpc(mpmath.mpf(damping) ** 2 / 4 - mpmath.mpf(stiffness)))
        exponents = (-mpmath.mpf(damping) / 2 + root, -mpmath.mpf(damping) / 2 - root)
        found = []
        for k in samples:
            modes = []
            for s in exponents:
                turn = mpmath.exp(s * dt)
                constant, rising = (turn - 1) / s, (turn - 1 - s * dt) / (s * s * dt)
                total = mpmath.mpc(0)
                for sign in (1, -1):
                    z = mpmath.expjpi(sign * mpmath.mpf(2) / per_cycle)
                    drive = sign * mpmath.mpf(amplitude) / 2j * (constant + rising * (z - 1))
                    total += drive * (z**k - turn**k) / (z - turn)
                modes.append(total)
            theta = (modes[0] - modes[1]) / (exponents[0] - exponents[1])
            omega = (exponents[0] * modes[0] - exponents[1] * modes[1]) / (exponents[0] - exponents[1])
            found.append((float(theta.real), float(omega.real)))
    return np.array(found).T


def first_peaks(x0, e, count):
    """Housner's free rocking peaks x_1 … x_count of x = theta/alpha in linear geometry (Housner 1963)."""
    with mpmath.workdps(DIGITS):
        start = 1 - (1 - mpmath.mpf(x0)) ** 2
        return np.array([float(1 - mpmath.sqrt(1 - mpmath.mpf(e) ** (2 * n) * start)) for n in range(1, count + 1)])


def released_at(peak, e, n):
    """The x0 whose nth peak is `peak`: Housner's formula backwards."""
    with mpmath.workdps(DIGITS):
        return float(1 - mpmath.sqrt(1 - (1 - (1 - mpmath.mpf(peak)) ** 2) / mpmath.mpf(e) ** (2 * n)))
