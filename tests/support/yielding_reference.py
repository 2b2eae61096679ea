"""Yielding shear buildings by another way: Runge-Kutta of order 8 from event to event, with dense matrices."""

import numpy as np
from scipy.integrate import solve_ivp


def reference(ground, dt, mass, stiffness, yields, hardening, theta, damping):
    """Return absolute accelerations (storey, n) at the samples, peak drifts, energies at the end and plastic drifts.

    Energies: put in (relative), kinetic, stored in springs, damped, dissipated in yielding.
    """
    n = len(mass)
    b = np.eye(n) - np.eye(n, k=-1)
    plastic, flow = np.zeros(n), np.zeros(n)
    state = np.zeros(2 * n + 3)  # (displacements, velocities, work of the ground, of damping, of yielding)
    accelerations, peaks = np.empty((n, len(ground))), np.zeros(n)

    def forces(u):
        d = b @ u
        elastic = np.where(flow == 0.0, d - plastic, flow * yields)
        return stiffness * ((hardening - theta) * d + (1.0 - hardening) * elastic)

    def damped(v):
        return damping[0] * mass * v + b.T @ (damping[1] * stiffness * (b @ v))

    def slope(t, y, a, rise):
        u, v = y[:n], y[n : 2 * n]
        shake = a + rise * t
        push = -(b.T @ forces(u)) - damped(v)
        lost = (1.0 - hardening) * stiffness * yields * np.abs(b @ v) * (flow != 0.0)
        return np.concatenate([v, push / mass - shake, [-(mass * v).sum() * shake, v @ damped(v), lost.sum()]])

    def event_of(i):
        def event(t, y, *_):
            if flow[i] == 0.0:
                return abs((b @ y[:n])[i] - plastic[i]) - yields[i]
            return -flow[i] * (b @ y[n : 2 * n])[i]

        event.terminal, event.direction = True, 1.0
        return event

    for step in range(len(ground)):
        u, v = state[:n], state[n : 2 * n]
        accelerations[:, step] = (-(b.T @ forces(u)) - damped(v)) / mass
        if step + 1 == len(ground):
            break
        rise = (ground[step + 1] - ground[step]) / dt
        t = 0.0
        while t < dt:
            found = solve_ivp(
                slope, (t, dt), state, method="DOP853", args=(ground[step], rise), rtol=1e-13, atol=1e-15,
                events=[event_of(i) for i in range(n)],
            )  # fmt: skip
            state, t = found.y[:, -1], found.t[-1]
            drifts = b @ state[:n]
            peaks = np.maximum(peaks, np.abs(b @ found.y[:n]).max(axis=1))
            if found.status == 1:
                i = next(i for i, times in enumerate(found.t_events) if times.size)
                if flow[i] == 0.0:
                    flow[i] = 1.0 if drifts[i] > plastic[i] else -1.0
                else:
                    plastic[i], flow[i] = drifts[i] - flow[i] * yields[i], 0.0
    u, v = state[:n], state[n : 2 * n]
    d = b @ u
    elastic = np.where(flow == 0.0, d - plastic, flow * yields)
    stored = 0.5 * (stiffness * ((hardening - theta) * d**2 + (1.0 - hardening) * elastic**2)).sum()
    energies = (state[2 * n], 0.5 * (mass * v**2).sum(), stored, state[2 * n + 1], state[2 * n + 2])
    return accelerations, peaks, energies, d - elastic
