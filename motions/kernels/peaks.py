"""Compiled peaks of velocity and displacement of one motion, exact for acceleration that is linear between samples."""

import math

from ...core.compiled import kernel


@kernel(keep=True)
def peak_velocity(a, dt):
    """Return the largest |v|, m/s, from a (n,), m/s²: at samples, and where the acceleration passes through zero."""
    v = 0.0
    best = 0.0
    for i in range(a.size - 1):
        if a[i] * a[i + 1] < 0.0:
            # v + a t/2 at t = dt a/(a - b)
            best = max(best, abs(v + 0.5 * dt * a[i] * (a[i] / (a[i] - a[i + 1]))))
        v += 0.5 * dt * (a[i] + a[i + 1])
        best = max(best, abs(v))
    return best


@kernel(keep=True)
def peak_displacement(a, dt):
    """Return the largest |u|, m, from a (n,), m/s²: at samples, and where the velocity passes through zero."""
    u = 0.0
    v = 0.0
    best = 0.0
    for i in range(a.size - 1):
        slope = (a[i + 1] - a[i]) / dt
        # roots in (0, dt) of v + a t + slope t²/2, in the form without cancellation
        discriminant = a[i] * a[i] - 2.0 * slope * v
        if discriminant >= 0.0:
            root = math.sqrt(discriminant)
            q = -(a[i] + (root if a[i] >= 0.0 else -root))
            if q != 0.0:
                t = 2.0 * v / q
                if 0.0 < t < dt:
                    best = max(best, abs(u + t * (v + t * (a[i] / 2.0 + t * slope / 6.0))))
            if slope != 0.0:
                t = q / slope
                if 0.0 < t < dt:
                    best = max(best, abs(u + t * (v + t * (a[i] / 2.0 + t * slope / 6.0))))
        u += dt * (v + dt * (2.0 * a[i] + a[i + 1]) / 6.0)
        v += 0.5 * dt * (a[i] + a[i + 1])
        best = max(best, abs(u))
    return best
