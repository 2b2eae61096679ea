"""Time of the engine against a plain RK4 of the same oscillators, one core, one process, medians of repeats.

The yardstick takes one classical Runge-Kutta step a sample, reads the damping at each entry into the zone and the
impact at each change of sign, and locates no event: what a careful user would write in numba first.  It is fast, and
wrong near every event; the table compares cost only.

Case K, hard rocking: one block, 1,024 scale factors from 0.05 to 0.45 g.  Case B, a typical study: 25 blocks x 40
levels from 0.05 to 0.44 g.  One Clough-Penzien record, 20 s at 0.005 s.  Skipping is off.

Run: python benchmarks/engine.py
"""

import math
from statistics import median
from time import perf_counter

import numpy as np
from numba import njit

import toppling as tp
from toppling.models.runs import run_many
from toppling.units import STANDARD_GRAVITY as G

REPEATS = 7
VISCOUS, ENTRY_SPEED, IMPACT = range(3)
LAWS = [
    tp.DiscreteDamping(e=0.9),
    tp.DiscreteDamping(e=0.9, rest="rigid"),
    tp.GianniniMasiani(e=0.9),
    tp.MakrisKonstantinidis(e=0.9),
    tp.Vassiliou(),
    tp.EnergyConsistent(e=0.9),
    tp.EnergyConsistent(e=0.9, rest="elastic"),
    tp.HousnerImpact(e=0.9, geometry="linear"),
    tp.HousnerImpact(e=0.9),
]


@njit(cache=True, nogil=True, error_model="numpy")
def rate(theta, omega, shaking, q2, alpha, edge, n, c_in, c_out, gain):
    if abs(theta) <= edge:
        return -n * q2 * theta - c_in * omega - gain * shaking
    return q2 * (theta - math.copysign(alpha, theta)) - c_out * omega - gain * shaking


@njit(cache=True, nogil=True, error_model="numpy")
def rk4(record, dt, factors, q2, alpha, edge, n, c, e, gain, kind, peaks):
    """Plain RK4, a step a sample; edge = 0 and kind IMPACT is the rigid block."""
    for j in range(factors.size):
        theta = omega = peak = 0.0
        held = c
        for i in range(record.size - 1):
            u0 = factors[j] * record[i]
            u1 = factors[j] * record[i + 1]
            um = 0.5 * (u0 + u1)
            if kind == IMPACT and theta == 0.0 and omega == 0.0:
                if gain * abs(u1) <= q2 * alpha:
                    continue
                theta = -math.copysign(1e-300, u1)
            out = c if kind == VISCOUS else 0.0
            a1 = rate(theta, omega, u0, q2, alpha, edge, n, held, out, gain)
            v2 = omega + 0.5 * dt * a1
            a2 = rate(theta + 0.5 * dt * omega, v2, um, q2, alpha, edge, n, held, out, gain)
            v3 = omega + 0.5 * dt * a2
            a3 = rate(theta + 0.5 * dt * v2, v3, um, q2, alpha, edge, n, held, out, gain)
            v4 = omega + dt * a3
            a4 = rate(theta + dt * v3, v4, u1, q2, alpha, edge, n, held, out, gain)
            before = theta
            theta += dt / 6.0 * (omega + 2.0 * v2 + 2.0 * v3 + v4)
            omega += dt / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
            if kind == ENTRY_SPEED and abs(before) > edge >= abs(theta):
                held = (1.0 - e) * abs(omega) / (2.0 * edge)
            elif kind == IMPACT and before * theta < 0.0:
                omega *= e
                if abs(omega) < 1e-4:
                    theta = omega = 0.0
            peak = max(peak, abs(theta))
            if peak > 0.5 * math.pi:
                break
        peaks[j] = peak


def yardstick(law, block):
    """RK4's numbers for a block under a law (its zone, damping and kind)."""
    oscillator = law.oscillator(block)
    right = next(r for r in oscillator.regions if r.offset < 0.0)
    edge = right.lower
    zone = max(oscillator.regions, key=lambda region: region.stiffness)
    kind = IMPACT if edge == 0.0 else ENTRY_SPEED if zone.held else VISCOUS
    n = zone.stiffness / -right.stiffness if edge else 1.0
    return -right.stiffness, block.alpha, edge, n, zone.damping, oscillator.e, oscillator.gain, kind


def timed(function):
    """Median seconds of repeated calls, the first (which may compile) not counted."""
    function()
    spans = []
    for _ in range(REPEATS):
        start = perf_counter()
        function()
        spans.append(perf_counter() - start)
    return median(spans)


def main():
    envelope = tp.motions.RiseStrongDecay(2.0, 10.0, 0.2)
    shaking = tp.motions.CloughPenzien(omega_g=15.0, xi_g=0.6, duration=20.0, dt=0.005, envelope=envelope)
    record = np.ascontiguousarray(tp.motions.scale_to(shaking.sample(1, seed=5), G).values[0])
    hard = [tp.Block.from_slenderness(0.2, 0.38)]
    typical = [
        tp.Block.from_slenderness(alpha, R)
        for alpha in (0.16, 0.20, 0.24, 0.28, 0.32)
        for R in (0.38, 0.8, 1.5, 2.5, 4.0)
    ]
    cases = (("K", hard, np.linspace(0.05, 0.45, 1024)), ("B", typical, np.linspace(0.05, 0.44, 40)))
    print("ns per sample and run (ratio: engine over RK4)")
    print(f"{'law':42s}" + "".join(f"{f'{name}: RK4':>10s}{'engine':>9s}{'ratio':>7s}" for name, *_ in cases))
    for law in LAWS:
        cells = []
        for _, blocks, levels in cases:
            samples = len(blocks) * levels.size * record.size
            oscillators = [law.oscillator(block) for block in blocks]
            factors = np.tile(levels, (len(blocks), 1))
            engine = timed(lambda: run_many(oscillators, factors, record, 0.005, skip=False)) / samples  # noqa: B023
            numbers = [yardstick(law, block) for block in blocks]
            peaks = np.empty(levels.size)

            def plain():
                for one in numbers:  # noqa: B023
                    rk4(record, 0.005, levels, *one, peaks)  # noqa: B023

            rk4_time = timed(plain) / samples
            cells.append(f"{1e9 * rk4_time:10.1f}{1e9 * engine:9.2f}{engine / rk4_time:7.2f}")
        print(f"{law.label:42s}" + "".join(cells), flush=True)


if __name__ == "__main__":
    main()
