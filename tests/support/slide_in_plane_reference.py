"""Sliding in the plane of the floor by SciPy's DOP853 between events: an integration that shares no code with ours."""

import numpy as np
from scipy.integrate import solve_ivp

G = 9.80665
STARTS, STOPS = 1e-12, 1e-10
"""Speeds with which a slide begins, and below which it has ended, m/s."""


def first_excess(p, q, hold, lift, left):
    """First time within `left` from which on |p + q t| > hold + lift t, or None."""
    now = p @ p - hold * hold
    if now > 1e-13 * hold * hold:
        return 0.0
    roots = np.roots([q @ q - lift * lift, 2.0 * (p @ q - hold * lift), now])
    good = [t.real for t in roots if abs(t.imag) < 1e-12 and 1e-12 < t.real < left]
    # (from rest within friction to more than it: the last root, after which the excess stays)
    later = p + q * left
    return max(good) if good and later @ later > (hold + lift * left) ** 2 else None


def to_the_next_stop(start, end, slip, v, way, a, slope, drag, more):
    """Integrate a slide from `start` to its stop or to `end`, under the floor's a + slope t and friction drag + more t.

    Returns SciPy's answer and all states (state, 5) that may be extreme: its steps, and events between them.
    """

    def rate(t, z):
        speed = np.hypot(z[2], z[3])
        return np.array([*z[2:4], *(-(a + slope * t) - (drag + more * t) * np.array(z[2:4]) / speed), speed])

    def stops(_, z):
        return np.hypot(z[2], z[3]) - STOPS

    stops.terminal, stops.direction = True, -1.0
    events = [
        stops,
        lambda _, z: z[0] * z[2] + z[1] * z[3],
        lambda _, z: z[2],
        lambda t, z: np.dot(z[2:4], rate(t, z)[2:4]),
    ]
    found = solve_ivp(
        rate, (start, end), np.array([*slip, *v, way]), method="DOP853", rtol=1e-12, atol=1e-14, events=events
    )
    return found, [*found.y.T, *(state for states in found.y_events for state in states)]


def slide(record, dt, static, kinetic, vertical=None):
    """Slip (2,) at the end of a record (2, n), way, greatest distance, slips to the front and the back, and speed.

    Without what comes after the record.
    """
    slip, v, way, slides = np.zeros(2), np.zeros(2), 0.0, False
    most = dict.fromkeys(("peak", "forward", "backward", "speed"), 0.0)
    weight = np.full(record.shape[1], G) if vertical is None else G + vertical
    for k in range(record.shape[1] - 1):
        a, slope = record[:, k], (record[:, k + 1] - record[:, k]) / dt
        w, lift = weight[k], (weight[k + 1] - weight[k]) / dt
        time = 0.0
        while time < dt * (1.0 - 1e-12):
            if not slides:
                p = -(a + slope * time)
                after = first_excess(p, -slope, static * (w + lift * time), static * lift, dt - time)
                if after is None:
                    break
                time += after
                p = -(a + slope * time)
                v, slides = STARTS * p / np.hypot(*p), True
            found, states = to_the_next_stop(time, dt, slip, v, way, a, slope, kinetic * w, kinetic * lift)
            time, slip, v, way = found.t[-1], found.y[:2, -1], found.y[2:4, -1], found.y[4, -1]
            for x, y, *speed, _ in states:
                for name, value in zip(most, (np.hypot(x, y), x, -x, np.hypot(*speed)), strict=True):
                    most[name] = max(most[name], value)
            slides = found.status != 1
    return {"slip": slip, "way": way, **most}
