"""Sliding in the plane of the floor, step by step: friction acts against the velocity, not on each axis by itself."""

import numpy as np

G = 9.80665


def peak_in_plane(ground, dt, friction, parts=8):
    """Return the greatest distance (motion,) that blocks slide from their place, m.

    ground: accelerations (motion, component, time), m/s²; each sample is divided into `parts` steps, in which the
    friction, at the speed at the end of a step, takes at most the whole speed.
    """
    step = dt / parts
    speed, slip = np.zeros((2, len(ground), 2))
    peak = np.zeros(len(ground))
    for k in range(ground.shape[-1] - 1):
        first, rise = ground[:, :, k], ground[:, :, k + 1] - ground[:, :, k]
        for part in range(parts):
            free = speed - step * (first + (part + 0.5) / parts * rise)
            size = np.hypot(free[:, 0], free[:, 1])
            after = free * np.maximum(0.0, 1.0 - friction * G * step / np.maximum(size, 1e-300))[:, None]
            slip += 0.5 * step * (speed + after)
            speed = after
            peak = np.maximum(peak, np.hypot(slip[:, 0], slip[:, 1]))
    return peak
