"""Runs of sliding blocks that are held to 40 digits: typed and generated records, and their stored results.

Records are made with the arithmetic of floats and Python's own random numbers alone, and rounded: they are the same on
every machine.  Run `python tests/support/slide_cases.py` to solve all runs anew (some minutes): it writes
tests/data/slide_reference.csv.gz.
"""

import csv
import gzip
import io
import math
import random
from functools import cache
from pathlib import Path
from typing import NamedTuple

FILE = Path(__file__).resolve().parents[1] / "data" / "slide_reference.csv.gz"
G = 9.80665
INF = math.inf
KEPT = 40
"""Digits that are stored."""
TWIN = 1e-13
"""Relative change of the record in the twin of a run, which shows by how much the run multiplies errors."""
TYPED = [0.0, 2.0, 5.0, 3.0, -1.0, -6.0, -4.0, 1.0, 4.0, 2.0, -3.0, -2.0, 0.0]
LIFTED = [0.0, 1.0, -1.0, 2.0, 3.0, -2.0, -4.0, 1.0, 2.0, 0.0, 1.0, -1.0, 0.0]


class Case(NamedTuple):
    """One run: its record and vertical acceleration, m/s² (lists), coefficients (front, back), and a factor on both."""

    name: str
    record: list
    dt: float
    static: tuple
    kinetic: tuple
    factor: float = 1.0
    vertical: list | None = None


def both(static, kinetic=None):
    """Coefficients alike at front and back."""
    kinetic = static if kinetic is None else kinetic
    return (static, static), (kinetic, kinetic)


def noise(seed, n, dt, peak, frequency=2.5, quiet=0):
    """Noise of a damped oscillator with an envelope, by differences; `quiet` samples of zero follow."""
    draw = random.Random(seed)
    omega = 2.0 * math.pi * frequency
    x = v = 0.0
    found = []
    for i in range(n):
        v += dt * (-omega * omega * x - 1.2 * omega * v + draw.uniform(-1.0, 1.0) / math.sqrt(dt))
        x += dt * v
        place = i / n
        found.append((0.8 * omega * v + x * omega * omega) * min(1.0, 5.0 * place) * min(1.0, 4.0 * (1.0 - place)))
    most = max(map(abs, found))
    return [round(peak * one / most, 4) for one in found] + [0.0] * quiet


def coarse(seed, n, step):
    """Random multiples of a step: with equal neighbours, zeros, and values on the thresholds of round coefficients.

    Multiples are powers of two, so that they are not rounded.
    """
    draw = random.Random(seed)
    return [step * draw.choice((-4, -2, -1, 0, 0.5, 1, 2, 4)) for _ in range(n)] + [0.0] * 20


def pulse(shape, n, peak):
    """One pulse of n steps (half sine, triangle, rectangle, one cycle), rounded, with quiet after it."""
    at = [i / n for i in range(n + 1)]
    values = {
        "half sine": [math.sin(math.pi * x) for x in at],
        "triangle": [1.0 - abs(2.0 * x - 1.0) for x in at],
        "rectangle": [1.0] * (n + 1),
        "cycle": [math.sin(2.0 * math.pi * x) for x in at],
    }[shape]
    return [-round(peak * one, 6) for one in values] + [0.0] * (12 * n)


def typed():
    """friction.md's record under many coefficients and factors, with and without vertical acceleration."""
    for static, kinetic in ((0.2, 0.2), (0.25, 0.25), (0.3, 0.2), (0.05, 0.05), (0.5, 0.1), (0.6, 0.6), (0.02, 0.01)):
        for vertical in (None, LIFTED):
            for factor in (1.0, 2.0):
                yield Case("typed", TYPED, 0.1, *both(static, kinetic), factor, vertical)
    yield Case("typed, Newmark's block", TYPED, 0.1, (0.2, INF), (0.2, 0.2))
    yield Case("typed, Newmark's block", TYPED, 0.1, (INF, 0.2), (0.2, 0.2), 1.0, LIFTED)
    yield Case("typed, a slope", TYPED, 0.1, (0.15, 0.4), (0.12, 0.35), 1.5)


def noisy():
    """Noise: short and long steps, weak and strong shaking, with vertical acceleration or without."""
    draw = random.Random(7)
    steps = (1e-4, 1e-3, 0.0025, 0.005, 0.01, 0.02, 0.05)
    for seed in range(112):
        dt = steps[seed % len(steps)]
        n = draw.choice((150, 400, 700)) if dt > 2e-4 else 1500
        frequency = min(draw.choice((1.0, 2.5, 6.0)), 0.05 / dt) if dt > 2e-4 else 30.0
        static = round(math.exp(draw.uniform(math.log(0.02), math.log(0.9))), 4)
        kinetic = round(static * draw.choice((1.0, 0.85, 0.5)), 5)
        peak = static * G * draw.choice((1.02, 1.3, 2.0, 5.0, 30.0))
        quiet = draw.choice((0, n // 2))
        record = noise(seed, n, dt, peak, frequency, quiet)
        # (both are multiplied by the factor: it keeps some weight)
        factor = draw.choice((1.0, 1.0, 1.7))
        up = noise(seed + 1000, n, dt, min(0.6 * peak, 5.0), 1.5 * frequency, quiet) if seed % 2 else None
        way = both(static, kinetic)
        if seed % 9 == 4:
            way = ((static, INF), (kinetic, kinetic))
        elif seed % 9 == 8:
            way = ((static, round(1.7 * static, 4)), (kinetic, round(1.2 * kinetic, 5)))
        yield Case("noise", record, dt, *way, factor, up)


def pulses():
    """Pulses: from one that hardly moves the block to one of eight times the friction."""
    for shape in ("half sine", "triangle", "rectangle", "cycle"):
        for n, dt in ((2, 0.05), (9, 0.02), (60, 0.005), (250, 1e-3)):
            for static, kinetic, level in ((0.3, 0.3, 1.1), (0.3, 0.25, 1.5), (0.05, 0.05, 8.0), (0.7, 0.35, 2.0)):
                yield Case(shape, pulse(shape, n, level * static * G), dt, *both(static, kinetic))


def cornered():
    """What rounding can turn over: motions that begin or end in motion, touch a threshold, repeat or lack samples."""
    for k, level in enumerate((1.5, 1.0, 0.999)):
        above = [-level * 0.25 * G, -0.4 * G, -0.1 * G, 0.3 * G, 0.0, 0.0, 0.0, 0.0]
        yield Case("begins above the threshold", above, 0.05, *both(0.25))
        yield Case("begins above the threshold", above, 0.05, *both(0.25, 0.2), 1.0, [0.5 * k] * 8)
        yield Case("begins above the threshold", [-3.0 * one for one in above[:3]], 0.02, *both(0.25, 0.1))
        fading = [-level * 0.25 * G, -0.2 * G, 0.0, 0.0]
        yield Case("begins at the threshold and fades", fading, 0.02, *both(0.25))
        yield Case("begins at the threshold and fades", [-one for one in fading], 0.02, *both(0.25, 0.2))
    # 0.25 and 0.5 times g are floats, so that these peaks reach their threshold to the last digit
    for static, kinetic in ((0.25, 0.25), (0.5, 0.125), (0.125, 0.125)):
        touch = [0.0, static * G, 0.0, -static * G, 0.0, 0.0]
        yield Case("touches the threshold", touch, 0.1, *both(static, kinetic))
        yield Case("touches the threshold", touch, 0.003, *both(static, kinetic))
        held = [0.0, static * G, static * G, static * G, 0.0, 2.0 * static * G, static * G, static * G, 0.0, 0.0, 0.0]
        yield Case("rests at the threshold", held, 0.01, *both(static, kinetic))
        yield Case("rests at the threshold", [-one for one in held], 0.01, *both(static, kinetic))
    for k in range(8):
        yield Case("constant", [-(1.0 + 0.1 * k)] * 30, 0.01, *both(0.1, 0.1 - 0.01 * (k % 2)))
        yield Case("constant, ends at rest", [-2.0] * (10 + k) + [0.0] * 60, 0.01, *both(0.1))
    yield Case("zeros", [0.0] * 40, 0.01, *both(0.1))
    yield Case("zeros and one sample", [0.0] * 20 + [-3.0] + [0.0] * 20, 0.01, *both(0.1, 0.05))
    yield Case("two samples", [-4.0, 5.0], 0.05, *both(0.2, 0.1))
    for seed in range(36):
        step, static = ((0.25 * G, 0.25), (1.0, 0.1), (0.5, 0.2))[seed % 3]
        kinetic = static if seed % 2 else 0.5 * static
        yield Case("coarse", coarse(seed, 60, step), (0.01, 0.05, 0.1)[seed // 12], *both(static, kinetic))
    for seed in range(24):
        up = [round(2.0 * one, 4) for one in coarse(seed + 500, 60, 0.5)]
        static = (0.05, 0.2, 0.4)[seed % 3]
        yield Case("coarse, vertical", coarse(seed, 60, 0.9), 0.02, *both(static, 0.8 * static), 1.0, up)
    for k, mu in enumerate((1e-9, 1e-3, 2.0, 10.0)):
        yield Case("extreme friction", noise(300 + k, 300, 0.01, 12.0 * max(1.0, mu), 2.0, 40), 0.01, *both(mu))
        yield Case("extreme friction", noise(310 + k, 300, 0.01, 9.0, 2.0, 40), 0.01, *both(mu, 0.5 * mu), 1e3)


@cache
def cases():
    """All runs, in the order in which their results are stored."""
    return [*typed(), *noisy(), *pulses(), *cornered()]


def stored():
    """The stored results of all runs: rows of text by name."""
    with gzip.open(FILE, "rt", encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def main():
    """Solve all runs anew, and write them."""
    import mpmath
    from slide_reference import NAMES, solve

    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["name", *NAMES, *(f"twin_{name}" for name in NAMES)])
    for i, case in enumerate(cases()):
        found = solve(*case[1:])
        # (a factor that is no float: its change of 1e-13 is exact)
        with mpmath.workdps(60):
            twin = solve(*case[1:5], mpmath.mpf(case.factor) * (1 + mpmath.mpf(TWIN)), case.vertical)
            moved = [mpmath.nstr(abs(twin[name] - found[name]), 3) for name in NAMES]
            values = [mpmath.nstr(found[name], KEPT, min_fixed=0, max_fixed=0) for name in NAMES]
        writer.writerow([case.name, *values, *moved])
        print(i, case.name, len(case.record), values[5], flush=True)
    # (without a time in its head: the same results are the same bytes)
    with FILE.open("wb") as raw, gzip.GzipFile("", "wb", 9, raw, 0) as file:
        file.write(text.getvalue().encode())


if __name__ == "__main__":
    main()
