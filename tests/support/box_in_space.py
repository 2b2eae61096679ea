"""A rigid box in space on four corners with penalty contact and friction: slow, and independent of the engine.

It shares no code with the models: six degrees of freedom, corners that press on springs and dashpots and never pull,
tangential springs that slip at the friction limit, and small steps of the semi-implicit Euler method.  Dashpots are so
strong that a corner that comes down does not bounce, which is the impact of Housner's model.
"""

import math

import numba
import numpy as np

GRAVITY = 9.80665
SETTLEMENT = 2e-7
"""Depth to which the springs of the corners settle under the weight, m."""
STEP = 1e-5
"""Time step, s."""
QUIET = 5.0
"""Time after the motion in which a box that is about to fall does so, s."""
FALLEN = 1.0
"""Tilt from which a box has overturned, rad."""


@numba.njit(cache=False, error_model="numpy")
def _shaken(half, x, y, dt, friction, settlement, step, fallen, gravity):
    """Return the greatest tilt (rad) and the time of the fall (s, NaN if it stands) of a box of unit mass."""
    bx, by, h = half
    inertia = np.array([(by * by + h * h) / 3.0, (bx * bx + h * h) / 3.0, (bx * bx + by * by) / 3.0])
    corners = np.array([[bx, by, -h], [bx, -by, -h], [-bx, by, -h], [-bx, -by, -h]])
    k = gravity / (4.0 * settlement)
    c = 2.0 * math.sqrt(k * 0.25)
    position = np.array([0.0, 0.0, h - settlement])
    velocity = np.zeros(3)
    turn = np.eye(3)
    spin = np.zeros(3)  # in the frame of the box
    anchor = np.full((4, 2), np.nan)
    greatest = 0.0
    n = int((x.size - 1) * dt / step)
    force, moment, arm, speed = np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3)
    for i in range(n):
        time = i * step
        j = min(int(time / dt), x.size - 2)
        part = time / dt - j
        force[0] = -(x[j] + part * (x[j + 1] - x[j]))
        force[1] = -(y[j] + part * (y[j + 1] - y[j]))
        force[2] = -gravity
        moment[:] = 0.0
        for q in range(4):
            r = corners[q]
            for a in range(3):
                arm[a] = turn[a, 0] * r[0] + turn[a, 1] * r[1] + turn[a, 2] * r[2]
            depth = -(position[2] + arm[2])
            if depth <= 0.0:
                anchor[q, 0] = np.nan
                continue
            w0 = spin[1] * r[2] - spin[2] * r[1]
            w1 = spin[2] * r[0] - spin[0] * r[2]
            w2 = spin[0] * r[1] - spin[1] * r[0]
            for a in range(3):
                speed[a] = velocity[a] + turn[a, 0] * w0 + turn[a, 1] * w1 + turn[a, 2] * w2
            normal = max(0.0, k * depth - c * speed[2])
            px, py = position[0] + arm[0], position[1] + arm[1]
            if math.isnan(anchor[q, 0]):
                anchor[q, 0], anchor[q, 1] = px, py
            fx = -k * (px - anchor[q, 0]) - c * speed[0]
            fy = -k * (py - anchor[q, 1]) - c * speed[1]
            size, limit = math.hypot(fx, fy), friction * normal
            if size > limit:
                share = limit / size
                fx, fy = fx * share, fy * share
                anchor[q, 0] = px + (fx + c * speed[0]) / k
                anchor[q, 1] = py + (fy + c * speed[1]) / k
            force[0] += fx
            force[1] += fy
            force[2] += normal
            moment[0] += arm[1] * normal - arm[2] * fy
            moment[1] += arm[2] * fx - arm[0] * normal
            moment[2] += arm[0] * fy - arm[1] * fx
        m0 = turn[0, 0] * moment[0] + turn[1, 0] * moment[1] + turn[2, 0] * moment[2]
        m1 = turn[0, 1] * moment[0] + turn[1, 1] * moment[1] + turn[2, 1] * moment[2]
        m2 = turn[0, 2] * moment[0] + turn[1, 2] * moment[1] + turn[2, 2] * moment[2]
        s0, s1, s2 = spin
        spin[0] += step * (m0 - (inertia[2] - inertia[1]) * s1 * s2) / inertia[0]
        spin[1] += step * (m1 - (inertia[0] - inertia[2]) * s2 * s0) / inertia[1]
        spin[2] += step * (m2 - (inertia[1] - inertia[0]) * s0 * s1) / inertia[2]
        for a in range(3):
            velocity[a] += step * force[a]
            position[a] += step * velocity[a]
        rate = math.sqrt(spin[0] ** 2 + spin[1] ** 2 + spin[2] ** 2)
        if rate > 0.0:  # (the rotation of a step, exact for a constant spin)
            e0, e1, e2 = spin / rate
            sine, rest = math.sin(rate * step), 1.0 - math.cos(rate * step)
            for a in range(3):
                t0, t1, t2 = turn[a, 0], turn[a, 1], turn[a, 2]
                d0, d1, d2 = t1 * e2 - t2 * e1, t2 * e0 - t0 * e2, t0 * e1 - t1 * e0
                g0, g1, g2 = d1 * e2 - d2 * e1, d2 * e0 - d0 * e2, d0 * e1 - d1 * e0
                turn[a, 0] = t0 + sine * d0 + rest * g0
                turn[a, 1] = t1 + sine * d1 + rest * g1
                turn[a, 2] = t2 + sine * d2 + rest * g2
        tilt = math.acos(min(1.0, turn[2, 2]))
        greatest = max(greatest, tilt)
        if tilt > fallen:
            return greatest, time
    return greatest, np.nan


def shaken_box(width, depth, height, x, y, dt, friction=1.5, settlement=SETTLEMENT, step=STEP):
    """Return the greatest tilt and the time of the fall of a box of full sizes (m) on a floor of x and y (m/s²)."""
    half = (0.5 * width, 0.5 * depth, 0.5 * height)
    quiet = np.zeros(int(QUIET / dt))
    x, y = (np.concatenate([one, quiet]) for one in (x, y))
    return _shaken(half, x, y, dt, friction, settlement, step, FALLEN, GRAVITY)
