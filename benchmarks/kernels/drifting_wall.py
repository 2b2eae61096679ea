"""A block before a wall that drifts against the floor: an integration in small steps, independent of the engine.

The engine's walls move with the floor.  Here the wall's contact follows the drift u(t) of a storey, an oscillator of
one degree of freedom under the same motion.  Runge-Kutta steps of order four; the time of an impact is found by
bisection.  The page docs/walls.md uses it; tests compare it with the engine where the drift is zero.
"""

from __future__ import annotations

import math

import numpy as np

from ...core.compiled import kernel

ON_FLOOR, ON_WALL, ROCKS = 0, 1, 2
MOST_IMPACTS = 12
"""Impacts within one step; a block that has more is taken to rest until the step's end."""


def drift(record: np.ndarray, dt: float, period: float = 0.5, damping: float = 0.05) -> np.ndarray:
    """Displacement and velocity (2, n) of a storey against its floor under a motion (m/s², linear between samples).

    The storey is an oscillator of one degree of freedom, x'' + 2 damping Omega x' + Omega² x = -record.
    """
    omega = 2.0 * math.pi / period
    root = omega * math.sqrt(1.0 - damping * damping)
    decay, sine, cosine = math.exp(-damping * omega * dt), math.sin(root * dt), math.cos(root * dt)
    free = decay * np.array(
        [
            [cosine + damping * omega * sine / root, sine / root],
            [-omega * omega * sine / root, cosine - damping * omega * sine / root],
        ]
    )
    # a particular solution under -(a + b t): x = -(a + b t)/Omega² + 2 damping b/Omega³
    out = np.zeros((2, record.size))
    slope = np.diff(record) / dt
    for i in range(record.size - 1):
        a, b = record[i], slope[i]
        shift = 2.0 * damping * b / omega**3
        start = np.array([-a / omega**2 + shift, -b / omega**2])
        end = np.array([-(a + b * dt) / omega**2 + shift, -b / omega**2])
        out[:, i + 1] = free @ (out[:, i] - start) + end
    return out


@kernel()
def _acceleration(theta, side, force, p2, alpha, gravity):
    """Angular acceleration about the corner of a side (1: front, -1: back), exact geometry; force = -ü, m/s²."""
    lever = alpha - side * theta
    return -side * p2 * math.sin(lever) + p2 / gravity * math.cos(lever) * force


@kernel()
def _step(theta, omega, side, force, slope, h, p2, alpha, gravity):
    """Rotation and velocity after a Runge-Kutta step of length h; the force is force + slope t."""
    middle, end = force + 0.5 * h * slope, force + h * slope
    a1 = _acceleration(theta, side, force, p2, alpha, gravity)
    v2 = omega + 0.5 * h * a1
    a2 = _acceleration(theta + 0.5 * h * omega, side, middle, p2, alpha, gravity)
    v3 = omega + 0.5 * h * a2
    a3 = _acceleration(theta + 0.5 * h * v2, side, middle, p2, alpha, gravity)
    v4 = omega + h * a3
    a4 = _acceleration(theta + h * v3, side, end, p2, alpha, gravity)
    return theta + h * (omega + 2.0 * v2 + 2.0 * v3 + v4) / 6.0, omega + h * (a1 + 2.0 * a2 + 2.0 * a3 + a4) / 6.0


@kernel()
def _wall(t, i, dt, u, du, scale, gap, height):
    """Rotation and angular velocity of a block that touches the wall, at a time t after sample i (cubic Hermite)."""
    s = t / dt
    x0, x1, v0, v1 = scale * u[i], scale * u[i + 1], scale * du[i] * dt, scale * du[i + 1] * dt
    r = 1 - s
    x = (1 + 2 * s) * (r * r) * x0 + s * (r * r) * v0 + s * s * (3 - 2 * s) * x1 + s * s * (s - 1) * v1
    v = (6 * s * s - 6 * s) * (x0 - x1) + (1 - s) * (1 - 3 * s) * v0 + s * (3 * s - 2) * v1
    theta = math.asin(max(-1.0, (x - gap) / height))
    return theta, v / dt / (height * math.cos(theta))


@kernel(keep=True)
def fall(record, dt, factor, parts, alpha, p2, gravity, e, rebound, gap, height, u, du, scale):
    """Side to which a block falls (1: front, away from the wall; -1: back; 0: it stands) and its peak rotation to it.

    `record` (m/s²) times `factor`; `parts` steps per sample; `e`, `rebound`: velocity kept at the floor and the wall;
    `height` of the block, whose upper edge meets the wall; `u`, `du` times `scale`: the drift there (m, m/s).
    """
    theta, omega, side, mode, peak = 0.0, 0.0, 1, ON_FLOOR, 0.0
    h = dt / parts
    for i in range(record.size - 1):
        f0, slope = -factor * record[i], -factor * (record[i + 1] - record[i]) / dt
        for k in range(parts):
            t, left = k * h, h
            for _ in range(MOST_IMPACTS):
                force = f0 + slope * t
                wall, speed = _wall(t, i, dt, u, du, scale, gap, height)
                if mode == ON_FLOOR:  # rests on the floor until the shaking lifts it or the wall pushes it
                    ahead, faster = _wall(t + left, i, dt, u, du, scale, gap, height)
                    if ahead > 0.0:
                        theta, omega, side, mode = ahead, faster, 1, ON_WALL
                        break
                    end = force + slope * left
                    if _acceleration(0.0, 1, max(force, end), p2, alpha, gravity) > 0.0:
                        side = 1
                    elif _acceleration(0.0, -1, min(force, end), p2, alpha, gravity) < 0.0 and wall < 0.0:
                        side = -1
                    else:
                        break
                    theta, omega, mode = 0.0, 0.0, ROCKS
                elif mode == ON_WALL:  # rests against the wall, and follows it
                    ahead, faster = _wall(t + left, i, dt, u, du, scale, gap, height)
                    if _acceleration(theta, side, force, p2, alpha, gravity) > (faster - speed) / left:
                        mode = ROCKS
                    elif theta * ahead <= 0.0 and ahead != theta:
                        # the wall takes it across the upright position, where its base meets the floor
                        theta, side, mode = 0.0, (1 if ahead > theta else -1), ROCKS
                        omega = e * faster
                        if omega < faster:
                            omega = faster + rebound * (faster - omega)
                        break
                    else:
                        theta, omega = ahead, faster
                        break
                # rocks: to the end of the step, or to the first impact in it
                after, rate = _step(theta, omega, side, force, slope, left, p2, alpha, gravity)
                ahead, faster = _wall(t + left, i, dt, u, du, scale, gap, height)
                if side * after >= 0.0 and after > ahead:
                    theta, omega = after, rate
                    break
                low, high = 0.0, left
                for _ in range(45):
                    half = 0.5 * (low + high)
                    after, rate = _step(theta, omega, side, force, slope, half, p2, alpha, gravity)
                    ahead, faster = _wall(t + half, i, dt, u, du, scale, gap, height)
                    if side * after >= 0.0 and after > ahead:
                        low = half
                    else:
                        high = half
                after, rate = _step(theta, omega, side, force, slope, high, p2, alpha, gravity)
                wall, speed = _wall(t + high, i, dt, u, du, scale, gap, height)
                t, left = t + high, left - high
                floor = side * after <= 0.0
                theta, omega = (0.0 if floor else wall), rate
                if floor:
                    omega, side = e * omega, -side
                if theta <= wall and omega < speed:
                    theta = wall
                    omega = speed - rebound * (omega - speed)
                    if theta == 0.0 and side * omega < 0.0:
                        omega, side = e * omega, -side
                force = f0 + slope * t
                away = omega - speed if theta <= wall else side * omega
                pull = -_acceleration(theta, side, force, p2, alpha, gravity) * (1.0 if theta <= wall else side)
                if left <= 1e-9 * h or (pull > 0.0 and 2.0 * away < 1e-3 * h * pull):
                    # its hops are shorter than a thousandth of a step
                    if pull > 0.0 and 2.0 * away < h * pull:
                        mode = ON_FLOOR if theta == 0.0 else ON_WALL
                        omega = 0.0 if mode == ON_FLOOR else speed
                    break
            else:
                if abs(theta) < 1e-9:
                    theta, omega, mode = 0.0, 0.0, ON_FLOOR
            peak = max(peak, theta)
            if abs(theta) >= 0.5 * math.pi:
                return (1 if theta > 0.0 else -1), peak
    return 0, peak
