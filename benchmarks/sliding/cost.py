"""Cost of a sample of a sliding run: weak and strong shaking, with vertical acceleration and without."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np
from scipy import stats

from ...models.sliding.law import Slider
from ...models.sliding.runs import SLIDES, friction_table, run_sliders
from ..measure import Row, seconds
from ..speed import motions

TARGET = 2.0
"""Largest cost of a sample of a run in lanes, ns."""
MEDIAN, DISPERSION, KINETIC = 0.3, 0.3, 0.85
"""Static friction: lognormal median and dispersion; and kinetic over static friction."""


class Shaking(NamedTuple):
    """Peaks of the floor's horizontal and vertical acceleration, m/s²."""

    horizontal: float
    vertical: float


SHAKING: dict[str, Shaking] = {
    "at rest": Shaking(0.5, 0.0),
    "weak": Shaking(3.5, 0.0),
    "weak, vertical": Shaking(3.5, 2.3),
    "strong": Shaking(12.0, 0.0),
    "strong, vertical": Shaking(12.0, 8.0),
}
"""Cases by their names in the table."""


def sliding_cost(runs: int = 512, repeats: int = 7) -> list[Row]:
    """Measure ns per sample and run of each case, every sample computed (`whole`) and with skips; and its slips."""
    static = MEDIAN * np.exp(DISPERSION * stats.norm.ppf((np.arange(runs) + 0.5) / runs))
    friction = friction_table([Slider(mu, mu, KINETIC * mu, KINETIC * mu) for mu in static.tolist()])
    across, upward = (one.acceleration / np.abs(one.acceleration).max() for one in motions(2))
    dt, factors = motions(1)[0].dt, np.ones((runs, 1))
    tasks = []
    slips = []
    for shaking in SHAKING.values():
        vertical = shaking.vertical * upward if shaking.vertical > 0.0 else None
        one = partial(run_sliders, friction, factors, shaking.horizontal * across, vertical, dt)
        slips.append(float(one()[:, 0, SLIDES["slips"]].mean()))
        tasks += [partial(one, skip=False), partial(one, skip=True)]
    each = [1e9 * taken / (runs * across.size) for taken in seconds(tasks, repeats)]
    return [
        {"case": case, "slips": 1e3 * slips[k] / across.size, "whole": each[2 * k], "skipping": each[2 * k + 1]}
        | {"horizontal": shaking.horizontal, "vertical": shaking.vertical}
        for k, (case, shaking) in enumerate(SHAKING.items())
    ]
