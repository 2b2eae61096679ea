"""The local Taylor series of a piece, in linear geometry and in exact geometry (with sine and cosine of the angle)."""

import math

from ...core.compiled import kernel
from .regions import rate, value
from .tables import ACCELERATION, DEGREE, EPSILON, FUSED, INVERSE, MOVED, SPEED

FAR_ANGLE = 1.7  # rad: more than any block gets from its balance before it lies


@kernel(**FUSED)
def evaluate(row, n, t):
    """Evaluate one row of the local Taylor series at t: displacement, velocity or acceleration."""
    s = row[n]
    for k in range(n - 1, -1, -1):
        s = s * t + row[k]
    return s


@kernel(**FUSED)
def state_at(poly, n, t):
    """Return displacement since the start, velocity and acceleration at t, by one Horner pass of three chains."""
    moved = poly[MOVED, n]
    slope = poly[SPEED, n]
    curvature = poly[ACCELERATION, n]
    for k in range(n - 1, -1, -1):
        moved = moved * t + poly[MOVED, k]
        slope = slope * t + poly[SPEED, k]
        curvature = curvature * t + poly[ACCELERATION, k]
    return moved, slope, curvature


@kernel(**FUSED)
def rate_bound(stiffness, c):
    """Return a bound of the exponents of a linear piece, 1/s: |s| <= c/2 + sqrt(c²/4 + |K|)."""
    return 0.5 * c + math.sqrt(0.25 * c * c + abs(stiffness))


@kernel(**FUSED)
def series_degree(z):
    """Return the degree at which a linear piece's Taylor terms, falling like z^k/k!, are below rounding (z <= 1/2)."""
    if z < 0.01:
        return 6
    if z < 0.03:
        return 8
    if z < 0.08:
        return 9
    if z < 0.2:
        return 11
    return 15


@kernel(**FUSED)
def linear_series(poly, acceleration, omega, c, stiffness, slope, n):
    """Write the Taylor coefficients 0 … n of displacement, velocity and acceleration about the current state.

    a' = slope - c a - K v, hence a_(k+1) (k+1) = -c a_k - K v_k, v_(k+1) (k+1) = a_k, y_(k+1) (k+1) = v_k.
    """
    poly[MOVED, 0] = 0.0
    poly[MOVED, 1] = omega
    poly[SPEED, 0] = omega
    poly[SPEED, 1] = acceleration
    poly[ACCELERATION, 0] = acceleration
    v = acceleration
    a = slope - c * acceleration - stiffness * omega
    poly[ACCELERATION, 1] = a
    for k in range(1, n):
        poly[MOVED, k + 1] = v * INVERSE[k + 1]
        new = -(c * a + stiffness * v) * INVERSE[k + 1]
        v = a * INVERSE[k + 1]
        a = new
        poly[SPEED, k + 1] = v
        poly[ACCELERATION, k + 1] = a


@kernel(inline="always")
def sine_and_cosine(x):
    """Return sine and cosine by their series, whose next terms are below rounding for |x| <= FAR_ANGLE."""
    y = x * x
    s = 1.0 / 355687428096000.0 + y * (-1.0 / 121645100408832000.0 + y * (1.0 / 51090942171709440000.0))
    s = 1.0 / 6227020800.0 + y * (-1.0 / 1307674368000.0 + y * s)
    s = -1.0 / 5040.0 + y * (1.0 / 362880.0 + y * (-1.0 / 39916800.0 + y * s))
    s = -1.0 / 6.0 + y * (1.0 / 120.0 + y * s)
    c = 1.0 / 2432902008176640000.0 + y * (-1.0 / 1124000727777607680000.0)
    c = 1.0 / 20922789888000.0 + y * (-1.0 / 6402373705728000.0 + y * c)
    c = 1.0 / 479001600.0 + y * (-1.0 / 87178291200.0 + y * c)
    c = -1.0 / 720.0 + y * (1.0 / 40320.0 + y * (-1.0 / 3628800.0 + y * c))
    c = -0.5 + y * (1.0 / 24.0 + y * c)
    return x + x * y * s, 1.0 + y * c


@kernel(inline="always")
def _by_terms(weight, p2, heavier, force, slope, unit):
    """Return the factors of f and g in slope c - heavier s (see `first_terms`)."""
    if weight is None:
        return slope * force * unit, slope * p2 * unit
    return (slope * force + heavier * p2) * unit, (slope * p2 - heavier * force) * unit


@kernel(inline="always")
def _rate_of_terms(weight, sine, cosine, heavier, slope):
    """Return slope c - heavier s."""
    if weight is None:
        return slope * cosine
    return slope * cosine - heavier * sine


@kernel(inline="always")
def first_terms(weight, sine, cosine, w0, a0, p2, heavier, force, slope):
    """Return the terms of `exact_series` to degree 12, and the values from which the next terms follow.

    `w` and `a`: velocity and acceleration. With sine s and cosine c of the running angle, let f = force c - p² s and g
    = force s + p² c. They alternate like sine and cosine, k f_k = sum w_j g_(k-1-j) and k g_k = -sum w_j f_(k-1-j). The
    acceleration is a = f + t (slope c - heavier s), in which c and s are sums of f and g, too. A velocity is in the
    next but one after one sum and two products. `p2`, `heavier`: p² under the weight, and its rate (which is not used
    without one).
    """
    f0 = a0
    g0 = force * sine + p2 * cosine
    unit = 1.0 / (force * force + p2 * p2)
    by_f, by_g = _by_terms(weight, p2, heavier, force, slope, unit)
    w1 = a0
    f1 = w0 * g0
    g1 = -w0 * f0
    a1 = _rate_of_terms(weight, sine, cosine, heavier, slope) + f1
    w2 = a1 * (1.0 / 2.0)
    f2 = (w0 * g1 + w1 * g0) * (1.0 / 2.0)
    g2 = -(w0 * f1 + w1 * f0) * (1.0 / 2.0)
    a2 = (by_f * f1 + by_g * g1) + f2
    w3 = a2 * (1.0 / 3.0)
    f3 = ((w1 * g1) + (w0 * g2 + w2 * g0)) * (1.0 / 3.0)
    g3 = -((w1 * f1) + (w0 * f2 + w2 * f0)) * (1.0 / 3.0)
    a3 = (by_f * f2 + by_g * g2) + f3
    w4 = a3 * (1.0 / 4.0)
    f4 = ((w1 * g2 + w2 * g1) + (w0 * g3 + w3 * g0)) * (1.0 / 4.0)
    g4 = -((w1 * f2 + w2 * f1) + (w0 * f3 + w3 * f0)) * (1.0 / 4.0)
    a4 = (by_f * f3 + by_g * g3) + f4
    w5 = a4 * (1.0 / 5.0)
    f5 = ((w1 * g3 + w2 * g2 + w3 * g1) + (w0 * g4 + w4 * g0)) * (1.0 / 5.0)
    g5 = -((w1 * f3 + w2 * f2 + w3 * f1) + (w0 * f4 + w4 * f0)) * (1.0 / 5.0)
    a5 = (by_f * f4 + by_g * g4) + f5
    w6 = a5 * (1.0 / 6.0)
    f6 = ((w1 * g4 + w2 * g3 + w3 * g2 + w4 * g1) + (w0 * g5 + w5 * g0)) * (1.0 / 6.0)
    g6 = -((w1 * f4 + w2 * f3 + w3 * f2 + w4 * f1) + (w0 * f5 + w5 * f0)) * (1.0 / 6.0)
    a6 = (by_f * f5 + by_g * g5) + f6
    w7 = a6 * (1.0 / 7.0)
    f7 = ((w1 * g5 + w2 * g4 + w3 * g3 + w4 * g2 + w5 * g1) + (w0 * g6 + w6 * g0)) * (1.0 / 7.0)
    g7 = -((w1 * f5 + w2 * f4 + w3 * f3 + w4 * f2 + w5 * f1) + (w0 * f6 + w6 * f0)) * (1.0 / 7.0)
    a7 = (by_f * f6 + by_g * g6) + f7
    w8 = a7 * (1.0 / 8.0)
    f8 = ((w1 * g6 + w2 * g5 + w3 * g4 + w4 * g3 + w5 * g2 + w6 * g1) + (w0 * g7 + w7 * g0)) * (1.0 / 8.0)
    g8 = -((w1 * f6 + w2 * f5 + w3 * f4 + w4 * f3 + w5 * f2 + w6 * f1) + (w0 * f7 + w7 * f0)) * (1.0 / 8.0)
    a8 = (by_f * f7 + by_g * g7) + f8
    w9 = a8 * (1.0 / 9.0)
    f9 = ((w1 * g7 + w2 * g6 + w3 * g5 + w4 * g4 + w5 * g3 + w6 * g2 + w7 * g1) + (w0 * g8 + w8 * g0)) * (1.0 / 9.0)
    g9 = -((w1 * f7 + w2 * f6 + w3 * f5 + w4 * f4 + w5 * f3 + w6 * f2 + w7 * f1) + (w0 * f8 + w8 * f0)) * (1.0 / 9.0)
    a9 = (by_f * f8 + by_g * g8) + f9
    w10 = a9 * (1.0 / 10.0)
    f10 = ((w1 * g8 + w2 * g7 + w3 * g6 + w4 * g5 + w5 * g4 + w6 * g3 + w7 * g2 + w8 * g1) + (w0 * g9 + w9 * g0)) * (
        1.0 / 10.0
    )
    g10 = -((w1 * f8 + w2 * f7 + w3 * f6 + w4 * f5 + w5 * f4 + w6 * f3 + w7 * f2 + w8 * f1) + (w0 * f9 + w9 * f0)) * (
        1.0 / 10.0
    )
    a10 = (by_f * f9 + by_g * g9) + f10
    w11 = a10 * (1.0 / 11.0)
    of_f = (f1, f2, f3, f4, f5, f6, f7, f8, f9, f10)
    of_g = (g1, g2, g3, g4, g5, g6, g7, g8, g9, g10)
    of_w = (w2, w3, w4, w5, w6, w7, w8, w9, w10, w11)
    return unit, of_f, of_g, of_w, (a1, a2, a3, a4, a5, a6, a7, a8, a9, a10)


@kernel(inline="always")
def terms_end(w0, a0, a1, a9, a10, p2, force, h):
    """Return True if the velocity's terms that degree 12 leaves out are below rounding, by its last two.

    Terms fall by z = h sqrt(2 (p² + |force| + w0²)) at least, with the largest p² and force of the piece. This is the
    rate of the series of positive terms that bounds them: v'' = v' v, from v = w0 and v' = |force| + p² (*derived*).
    """
    least = 1e-17 * max(abs(w0), 0.5 * abs(a0) * h, 0.5 * abs(a1) * h * h)
    square = h * h
    fifth = square * square * h
    fall = 2.0 * square * (p2 + abs(force) + w0 * w0)
    last = a10 * fifth * fifth * h
    return (abs(a9) * fifth * fifth * fall <= 10.0 * least) & (last * last * fall <= 121.0 * least * least)


@kernel(**FUSED)
def _few_terms(poly, trig, weight, w0, a0, p2, heavier, force, slope, h):
    """Write the terms of `exact_series` to degree 12; return the degree, or 0 if more terms are needed."""
    unit, of_f, of_g, of_w, of_a = first_terms(weight, trig[0, 0], trig[1, 0], w0, a0, p2, heavier, force, slope)
    f1, f2, f3, f4, f5, f6, f7, f8, f9, f10 = of_f
    g1, g2, g3, g4, g5, g6, g7, g8, g9, g10 = of_g
    w2, w3, w4, w5, w6, w7, w8, w9, w10, w11 = of_w
    a1, a2, a3, a4, a5, a6, a7, a8, a9, a10 = of_a
    poly[MOVED, 0] = 0.0
    poly[SPEED, 0] = w0
    poly[ACCELERATION, 0] = a0
    poly[MOVED, 1] = w0
    poly[SPEED, 1] = a0
    poly[MOVED, 2] = 0.5 * a0
    poly[ACCELERATION, 1] = a1
    poly[SPEED, 2] = w2
    poly[MOVED, 3] = w2 * (1.0 / 3.0)
    poly[ACCELERATION, 2] = a2
    poly[SPEED, 3] = w3
    poly[MOVED, 4] = w3 * (1.0 / 4.0)
    poly[ACCELERATION, 3] = a3
    poly[SPEED, 4] = w4
    poly[MOVED, 5] = w4 * (1.0 / 5.0)
    poly[ACCELERATION, 4] = a4
    poly[SPEED, 5] = w5
    poly[MOVED, 6] = w5 * (1.0 / 6.0)
    poly[ACCELERATION, 5] = a5
    poly[SPEED, 6] = w6
    poly[MOVED, 7] = w6 * (1.0 / 7.0)
    poly[ACCELERATION, 6] = a6
    poly[SPEED, 7] = w7
    poly[MOVED, 8] = w7 * (1.0 / 8.0)
    poly[ACCELERATION, 7] = a7
    poly[SPEED, 8] = w8
    poly[MOVED, 9] = w8 * (1.0 / 9.0)
    poly[ACCELERATION, 8] = a8
    poly[SPEED, 9] = w9
    poly[MOVED, 10] = w9 * (1.0 / 10.0)
    poly[ACCELERATION, 9] = a9
    poly[SPEED, 10] = w10
    poly[MOVED, 11] = w10 * (1.0 / 11.0)
    poly[ACCELERATION, 10] = a10
    poly[SPEED, 11] = w11
    poly[MOVED, 12] = w11 * (1.0 / 12.0)
    if terms_end(w0, a0, a1, a9, a10, p2 + abs(heavier) * h, abs(force) + abs(slope) * h, h):
        return 12
    trig[0, 1] = (force * g1 - p2 * f1) * unit
    trig[1, 1] = (force * f1 + p2 * g1) * unit
    trig[0, 2] = (force * g2 - p2 * f2) * unit
    trig[1, 2] = (force * f2 + p2 * g2) * unit
    trig[0, 3] = (force * g3 - p2 * f3) * unit
    trig[1, 3] = (force * f3 + p2 * g3) * unit
    trig[0, 4] = (force * g4 - p2 * f4) * unit
    trig[1, 4] = (force * f4 + p2 * g4) * unit
    trig[0, 5] = (force * g5 - p2 * f5) * unit
    trig[1, 5] = (force * f5 + p2 * g5) * unit
    trig[0, 6] = (force * g6 - p2 * f6) * unit
    trig[1, 6] = (force * f6 + p2 * g6) * unit
    trig[0, 7] = (force * g7 - p2 * f7) * unit
    trig[1, 7] = (force * f7 + p2 * g7) * unit
    trig[0, 8] = (force * g8 - p2 * f8) * unit
    trig[1, 8] = (force * f8 + p2 * g8) * unit
    trig[0, 9] = (force * g9 - p2 * f9) * unit
    trig[1, 9] = (force * f9 + p2 * g9) * unit
    trig[0, 10] = (force * g10 - p2 * f10) * unit
    trig[1, 10] = (force * f10 + p2 * g10) * unit
    return 0


@kernel(**FUSED)
def _power(h, n):
    """Return h to the power of n."""
    product = 1.0
    for _ in range(n):
        product *= h
    return product


@kernel(**FUSED)
def _many_terms(poly, trig, weight, omega, p2, heavier, scale, force, slope, h):
    """Write the terms of `exact_series` beyond degree 12, as many as are needed; return the degree and the step."""
    start = abs(poly[ACCELERATION, 0])
    jerk = abs(poly[ACCELERATION, 1])
    largest = max(abs(omega) * h, 0.5 * start * h * h, 0.5 * jerk * h * h * h)
    power = _power(h, 12)
    before = abs(poly[SPEED, 11]) * power
    n = DEGREE
    for k in range(11, DEGREE - 1):
        s = 0.0
        c = 0.0
        for j in range(k):
            s -= poly[SPEED, j] * trig[1, k - 1 - j]
            c += poly[SPEED, j] * trig[0, k - 1 - j]
        trig[0, k] = s * INVERSE[k]
        trig[1, k] = c * INVERSE[k]
        a = -p2 * trig[0, k] + (force * trig[1, k] + slope * trig[1, k - 1]) * scale
        if weight is not None:
            a -= heavier * trig[0, k - 1]
        poly[ACCELERATION, k] = a
        poly[SPEED, k + 1] = a * INVERSE[k + 1]
        poly[MOVED, k + 2] = poly[SPEED, k + 1] * INVERSE[k + 2]
        power *= h
        term = abs(poly[SPEED, k + 1]) * power
        if term <= 1e-17 * largest and before <= 1e-17 * largest:
            n = k + 2
            break
        before = term
    if n == DEGREE:
        while (
            abs(poly[SPEED, n - 1]) * _power(h, n) > 1e-17 * largest
            or abs(poly[SPEED, n - 2]) * _power(h, n - 1) > 1e-17 * largest
        ) and h > 1e-12:
            h *= 0.7
            largest = max(abs(omega) * h, 0.5 * start * h * h, 0.5 * jerk * h * h * h)
    return n, h


@kernel(**FUSED)
def exact_series(poly, trig, weight, theta, omega, p2, tilt, scale, force, slope, h):
    """Write the Taylor series of x'' = -p² sin(tilt - x) + (force + slope t) cos(tilt - x) scale; return a safe step.

    Under a vertical component p² is times the weight, which is linear in time. The sine and cosine of the running angle
    are by their product recurrences. The returned step (<= h) keeps the neglected terms below 1e-17 of the largest kept
    one and contains at most one zero of the acceleration. The proof is a bound on the terms of the acceleration, or of
    the jerk, that follow the first.
    """
    if abs(tilt - theta) <= FAR_ANGLE:
        trig[0, 0], trig[1, 0] = sine_and_cosine(tilt - theta)
    else:
        trig[0, 0] = math.sin(tilt - theta)
        trig[1, 0] = math.cos(tilt - theta)
    heavier = p2 * rate(weight)
    p2 *= value(weight)
    a = -p2 * trig[0, 0] + force * trig[1, 0] * scale
    level = p2 * (abs(trig[0, 0]) + abs(theta)) + abs(force * trig[1, 0] * scale)
    if omega == 0.0 and abs(a) <= 8.0 * EPSILON * level:
        a = 0.0  # (a block that is just lifted: tilt, lever and threshold are rounded, too)
    n = _few_terms(poly, trig, weight, omega, a, p2, heavier, force * scale, slope * scale, h)
    if n == 0:
        n, h = _many_terms(poly, trig, weight, omega, p2, heavier, scale, force, slope, h)
    start = abs(poly[ACCELERATION, 0])
    jerk = abs(poly[ACCELERATION, 1])
    for _ in range(40):
        of_a = 0.0
        of_jerk = 0.0
        power = 1.0
        for k in range(1, n - 1):
            power *= h
            term = abs(poly[ACCELERATION, k]) * power
            of_a += term
            if k > 1:
                of_jerk += k * term
        if start > of_a or jerk * h > of_jerk or (omega == 0.0 and start == 0.0 and jerk == 0.0):
            break
        h *= 0.5
    poly[SPEED, n] = 0.0
    poly[ACCELERATION, n - 1] = 0.0
    poly[ACCELERATION, n] = 0.0
    return n, h
