"""Propagators: the step of a linear region over a sample without an event, as one multiplication."""

import math

import numpy as np

from ...core.compiled import kernel
from .series import rate_bound
from .tables import (
    BARE,
    FUSED,
    LANES,
    MANY_STEPS,
    ONE_PIECE,
    ONE_STEP,
    PAR_EXACT,
    PAR_SIDED,
    PIECE_DAMPING,
    PIECE_GAP,
    PIECE_STIFFNESS,
    REGION_DAMPING,
    REGION_LOWER,
    REGION_OFFSET,
    REGION_STIFFNESS,
    REGION_UPPER,
    STEP_DAMPING,
    STEP_G0,
    STEP_G1,
    STEP_G2,
    STEP_G2_RISE,
    STEP_G3,
    STEP_GRADE,
    STEP_PULL,
)

GRADES = (0.5, 0.25)  # largest rate * dt of one step, and of a piece of degree 12
# The same of springs without damping in scenes (stiff restraints of light blocks). Every second term is small then, and
# the first omitted term of the velocity, z^12/12!, is 1e-15 of it.
SPRING_GRADE = 0.3
SPLITTER = 134217729.0  # 2^27 + 1


@kernel(inline="always")
def _propagator(stiffness, c, h):
    """Return a step's transition: impulse response, its slope, its first and second integrals, as series.

    With y'' + c y' + K y = a + s t, y(h) = omega g1 + a g2 + s g3 and y'(h) = omega (1 + g0) + a g1 + s g2. These are
    increments, so that the coefficients' rounding does not add up to a drift of energy. The impulse response is the sum
    of u_k h (t/h)^k; the terms after the sixteenth are below rounding for rate * h <= 1/2. Returns g0, g1, g2, g3/h and
    g2/h. It is written out, because otherwise the loop that calls it would not be vectorised.
    """
    d = -c * h
    s = -stiffness * h * h
    u2 = d * 0.5
    u3 = (d * u2 + s * 0.5) * (1.0 / 3.0)
    u4 = (d * u3 + s * u2 * (1.0 / 3.0)) * (1.0 / 4.0)
    u5 = (d * u4 + s * u3 * (1.0 / 4.0)) * (1.0 / 5.0)
    u6 = (d * u5 + s * u4 * (1.0 / 5.0)) * (1.0 / 6.0)
    u7 = (d * u6 + s * u5 * (1.0 / 6.0)) * (1.0 / 7.0)
    u8 = (d * u7 + s * u6 * (1.0 / 7.0)) * (1.0 / 8.0)
    u9 = (d * u8 + s * u7 * (1.0 / 8.0)) * (1.0 / 9.0)
    u10 = (d * u9 + s * u8 * (1.0 / 9.0)) * (1.0 / 10.0)
    u11 = (d * u10 + s * u9 * (1.0 / 10.0)) * (1.0 / 11.0)
    u12 = (d * u11 + s * u10 * (1.0 / 11.0)) * (1.0 / 12.0)
    u13 = (d * u12 + s * u11 * (1.0 / 12.0)) * (1.0 / 13.0)
    u14 = (d * u13 + s * u12 * (1.0 / 13.0)) * (1.0 / 14.0)
    u15 = (d * u14 + s * u13 * (1.0 / 14.0)) * (1.0 / 15.0)
    u16 = (d * u15 + s * u14 * (1.0 / 15.0)) * (1.0 / 16.0)
    g0 = 16.0 * u16 + 15.0 * u15 + 14.0 * u14 + 13.0 * u13 + 12.0 * u12 + 11.0 * u11 + 10.0 * u10 + 9.0 * u9 + 8.0 * u8
    g0 += 7.0 * u7 + 6.0 * u6 + 5.0 * u5 + 4.0 * u4 + 3.0 * u3 + 2.0 * u2
    g1 = u16 + u15 + u14 + u13 + u12 + u11 + u10 + u9 + u8
    g1 += u7 + u6 + u5 + u4 + u3 + u2
    g2 = (
        u16 * (1.0 / 17.0)
        + u15 * (1.0 / 16.0)
        + u14 * (1.0 / 15.0)
        + u13 * (1.0 / 14.0)
        + u12 * (1.0 / 13.0)
        + u11 * (1.0 / 12.0)
        + u10 * (1.0 / 11.0)
        + u9 * (1.0 / 10.0)
        + u8 * (1.0 / 9.0)
    )
    g2 += (
        u7 * (1.0 / 8.0) + u6 * (1.0 / 7.0) + u5 * (1.0 / 6.0) + u4 * (1.0 / 5.0) + u3 * (1.0 / 4.0) + u2 * (1.0 / 3.0)
    )
    g3 = (
        u16 * (1.0 / 306.0)
        + u15 * (1.0 / 272.0)
        + u14 * (1.0 / 240.0)
        + u13 * (1.0 / 210.0)
        + u12 * (1.0 / 182.0)
        + u11 * (1.0 / 156.0)
        + u10 * (1.0 / 132.0)
        + u9 * (1.0 / 110.0)
        + u8 * (1.0 / 90.0)
    )
    g3 += (
        u7 * (1.0 / 72.0)
        + u6 * (1.0 / 56.0)
        + u5 * (1.0 / 42.0)
        + u4 * (1.0 / 30.0)
        + u3 * (1.0 / 20.0)
        + u2 * (1.0 / 12.0)
    )
    g2 += 0.5
    return g0, h * (1.0 + g1), h * h * g2, h * h * (1.0 / 6.0 + g3), h * g2


@kernel(**BARE)
def solve_propagators(v, n, dt):
    """Write the propagator of each of n columns, from the column's stiffness and damping."""
    for j in range(n):
        g0, g1, g2, g3, g2_rise = _propagator(v[PIECE_STIFFNESS * LANES + j], v[PIECE_DAMPING * LANES + j], dt)
        v[(PIECE_GAP + STEP_G0) * LANES + j] = g0
        v[(PIECE_GAP + STEP_G1) * LANES + j] = g1
        v[(PIECE_GAP + STEP_G2) * LANES + j] = g2
        v[(PIECE_GAP + STEP_G3) * LANES + j] = g3
        v[(PIECE_GAP + STEP_G2_RISE) * LANES + j] = g2_rise


@kernel(**BARE)
def _two_sum(a, b):
    """Return the sum of two numbers and its rounding error (Knuth)."""
    s = a + b
    of_b = s - a
    return s, (a - (s - of_b)) + (b - of_b)


@kernel(**BARE)
def _two_product(a, b):
    """Return the product of two numbers and its rounding error (Dekker)."""
    p = a * b
    high = SPLITTER * a
    high_a = high - (high - a)
    high = SPLITTER * b
    high_b = high - (high - b)
    low_a = a - high_a
    low_b = b - high_b
    return p, ((high_a * high_b - p) + high_a * low_b + low_a * high_b) + low_a * low_b


@kernel(**BARE)
def _without_drift(stiffness, g0, g1, g2):
    """Return an undamped step's coefficients, or their neighbours, with the smallest change of phase-plane areas.

    Its determinant is 1 + r, r = g0 - K g2 + K g1² - K g2 g0. Rounded once for all samples, three coefficients leave an
    r of a part of an ulp, by which the energy grows or fades in every sample. The coefficients are chosen among each
    value and its two neighbours to minimise r.
    """
    p1, e1 = _two_product(stiffness, g2)
    square, e_square = _two_product(g1, g1)
    p2, e2 = _two_product(stiffness, square)
    p3, e3 = _two_product(p1, g0)
    s1, t1 = _two_sum(g0, -p1)
    s2, t2 = _two_sum(p2, -p3)
    s, t = _two_sum(s1, s2)
    r = s + (t + t1 + t2 - e1 + e2 + stiffness * e_square - e3 - e1 * g0)
    of_g0 = (np.nextafter(g0, math.inf) - g0) * (1.0 - p1)
    of_g1 = (np.nextafter(g1, math.inf) - g1) * 2.0 * stiffness * g1
    of_g2 = (np.nextafter(g2, math.inf) - g2) * -stiffness * (1.0 + g0)
    least = abs(r)
    best_0 = best_1 = best_2 = 0
    for i in range(-1, 2):
        for j in range(-1, 2):
            for k in range(-1, 2):
                left = abs(r + i * of_g0 + j * of_g1 + k * of_g2)
                if left < least:
                    least = left
                    best_0 = i
                    best_1 = j
                    best_2 = k
    return (
        np.nextafter(g0, best_0 * math.inf) if best_0 != 0 else g0,
        np.nextafter(g1, best_1 * math.inf) if best_1 != 0 else g1,
        np.nextafter(g2, best_2 * math.inf) if best_2 != 0 else g2,
    )


@kernel(**FUSED)
def step_grade(rate):
    """Return the grade of a sample by rate * dt: one piece, one step, or many steps."""
    if rate <= GRADES[1]:
        return ONE_PIECE
    return ONE_STEP if rate <= GRADES[0] else MANY_STEPS


@kernel(**BARE)
def fill_step(step, region, c, dt):
    """Write a region's propagator with damping c, its grade and its pull into the row `step`."""
    stiffness = region[REGION_STIFFNESS]
    offset = region[REGION_OFFSET]
    grade = step_grade(dt * rate_bound(stiffness, c))
    step[STEP_DAMPING] = c
    step[STEP_GRADE] = grade
    step[STEP_PULL] = max(
        abs(offset - stiffness * region[REGION_UPPER]), abs(offset - stiffness * region[REGION_LOWER])
    )
    if grade != MANY_STEPS:
        g0, g1, g2, g3, g2_rise = _propagator(stiffness, c, dt)
        if c == 0.0:
            g0, g1, g2 = _without_drift(stiffness, g0, g1, g2)
        step[STEP_G0] = g0
        step[STEP_G1] = g1
        step[STEP_G2] = g2
        step[STEP_G3] = g3
        step[STEP_G2_RISE] = g2_rise


@kernel(**FUSED)
def fill_steps(steps, model, dt):
    """Write a propagator for every oscillator and region, with the region's constant damping."""
    for o in range(model.tables.shape[0]):
        for r in range(model.tables.shape[1]):
            if model.parameters[o, PAR_EXACT] != 0.0:
                continue
            stiffness, c = model.tables[o, r, REGION_STIFFNESS], model.tables[o, r, REGION_DAMPING]
            fill_step(steps[o, r], model.tables[o, r], c, dt)
            if (
                model.parameters[o, PAR_SIDED] != 0.0
                and c == 0.0
                and 0.0 < stiffness * dt * dt <= SPRING_GRADE * SPRING_GRADE
            ):
                steps[o, r, STEP_GRADE] = ONE_PIECE
