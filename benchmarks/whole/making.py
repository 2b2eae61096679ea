"""What motions cost: simulating them, and measuring them."""

from __future__ import annotations

from functools import partial

from ...motions import CloughPenzien, NearFault, SiteBasedScenario, measures
from ..measure import Row, seconds
from .tables import MEASURE_TARGET, MOTION_TARGET

GENERATORS = {
    "site-based motion, M 6.8 at 15 km": SiteBasedScenario(magnitude=6.8, distance=15_000.0, vs30=620.0),
    "near-fault motion, M 6.8 at 8 km": NearFault(magnitude=6.8, distance=8_000.0, vs30=620.0),
    "Clough–Penzien motion of 20 s": CloughPenzien(duration=20.0),
}
NUMBER = 32
"""Motions made at a time: those of a study share vectors."""


def making(repeats: int = 5) -> list[Row]:
    """Measure the CPU time of a motion by generator and of its measures, ms."""
    shakes = GENERATORS["Clough–Penzien motion of 20 s"].sample(NUMBER, seed=1)
    tasks = [partial(one.sample, NUMBER, seed=2) for one in GENERATORS.values()]
    *made, measured = seconds([*tasks, partial(measures, shakes)], repeats)
    rows = [
        {"what": name, "cpu": 1e3 * spent / NUMBER, "target": MOTION_TARGET}
        for name, spent in zip(GENERATORS, made, strict=True)
    ]
    return [*rows, {"what": "usual measures of a motion", "cpu": 1e3 * measured / NUMBER, "target": MEASURE_TARGET}]
