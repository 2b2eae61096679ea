"""Sliding blocks in the benchmark: what a sample costs, and Newmark's one-way block compared with another program.

pyslammer's rigid analysis steps with the samples: velocities by the trapezoidal rule, beginnings and ends of a slide at
a sample.  The engine finds both between the samples.  A record with straight lines between its samples can be sampled
more finely without a change of the motion: pyslammer's results then approach the engine's, which stay.  What
remains is that pyslammer has no friction at speeds below 1e-5 m/s: a block that gets there goes on at that speed.
"""

from __future__ import annotations

import math
from functools import partial
from importlib import import_module
from typing import Any

import numpy as np
from scipy import stats

from ..core.aliases import Array
from ..core.units import STANDARD_GRAVITY
from ..models.outputs import SLIDES
from ..models.sliding.law import Slider
from ..models.sliding.runs import friction_table, run_sliders
from .measure import Row, seconds
from .speed import motions

TARGET = 2.0
"""Largest cost of a sample of a run in lanes, ns."""
MEDIAN, DISPERSION, KINETIC = 0.3, 0.3, 0.85
"""Static friction: lognormal median and dispersion; and kinetic over static friction."""
SHAKING = {
    "at rest": (0.5, 0.0),
    "weak": (3.5, 0.0),
    "weak, vertical": (3.5, 2.3),
    "strong": (12.0, 0.0),
    "strong, vertical": (12.0, 8.0),
}
"""Peaks of the floor's horizontal and vertical acceleration, m/s², by the names of the cases in the table."""
RATIOS = (0.05, 0.1, 0.2, 0.4, 0.6)
"""Accelerations that start the block, over the peak of the record."""
REFINED = (1, 4, 16)
"""Samples that pyslammer gets for each sample of the record."""
QUIET = 3.0
"""Time after the motion, s, in which all blocks stop: pyslammer ends with the record."""


def sliding_cost(runs: int = 512, repeats: int = 7) -> list[Row]:
    """Measure ns per sample and run of each case, every sample computed (`whole`) and with skips; and its slips."""
    static = MEDIAN * np.exp(DISPERSION * stats.norm.ppf((np.arange(runs) + 0.5) / runs))
    friction = friction_table([Slider(mu, mu, KINETIC * mu, KINETIC * mu) for mu in static.tolist()])
    across, upward = (motion.acceleration / np.abs(motion.acceleration).max() for motion in motions(2))
    dt, factors = motions(1)[0].dt, np.ones((runs, 1))
    tasks = []
    slips = []
    for horizontal, vertical in SHAKING.values():
        task = partial(run_sliders, friction, factors, horizontal * across, vertical * upward if vertical else None, dt)
        slips.append(float(task()[:, 0, SLIDES["slips"]].mean()))
        tasks += [partial(task, skip=False), partial(task, skip=True)]
    costs = [1e9 * taken / (runs * across.size) for taken in seconds(tasks, repeats)]
    return [
        {"case": case, "slips": 1e3 * slips[k] / across.size, "whole": costs[2 * k], "skipping": costs[2 * k + 1]}
        | {"horizontal": horizontal, "vertical": vertical}
        for k, (case, (horizontal, vertical)) in enumerate(SHAKING.items())
    ]


def newmark(number: int = 10, refined: tuple[int, ...] = REFINED) -> Row:
    """Compare the slips of one-way blocks: `rows` of pyslammer's differences, or the reason why it is `missing`.

    A row has the largest and the median relative difference over the motions at one ratio and one refinement; `costs`
    has the time of a run in both programs, s.
    """
    try:
        package = import_module("pyslammer")
    except ImportError as error:
        return {"missing": f"pyslammer: {error}", "rows": [], "motions": number}
    shaking = [np.append(motion.acceleration, np.zeros(round(QUIET / motion.dt))) for motion in motions(number)]
    dt = motions(1)[0].dt
    rows = []
    for ratio in RATIOS:
        levels = [ratio * float(np.abs(record).max()) / STANDARD_GRAVITY for record in shaking]
        ours = np.array([_engine(record, dt, level) for record, level in zip(shaking, levels, strict=True)])
        for steps in refined:
            theirs = np.array(
                [
                    _pyslammer(package, _finer(record, steps), dt / steps, k)
                    for record, k in zip(shaking, levels, strict=True)
                ]
            )
            slid = ours > 0.0
            apart = np.abs(theirs[slid] / ours[slid] - 1.0)
            rows.append(
                {"ratio": ratio, "steps": steps, "median": float(np.median(apart)), "largest": float(apart.max())}
                | {"slip": float(np.median(ours[slid]))}
            )
    level = 0.1 * float(np.abs(shaking[0]).max()) / STANDARD_GRAVITY
    taken = seconds(
        [partial(_engine, shaking[0], dt, level), partial(_pyslammer, package, shaking[0], dt, level)], repeats=3
    )
    return {"missing": "", "rows": rows, "motions": number, "costs": taken}


def _finer(record: Array, steps: int) -> Array:
    """The same motion with `steps` samples for each."""
    at = np.arange(steps * (record.size - 1) + 1) / steps
    return np.asarray(np.interp(at, np.arange(record.size), record))


def _engine(record: Array, dt: float, friction: float) -> float:
    slider = Slider(friction, math.inf, friction, friction)
    return float(run_sliders(friction_table([slider]), np.ones((1, 1)), record, None, dt)[0, 0, SLIDES["slide_peak"]])


def _pyslammer(package: Any, record: Array, dt: float, friction: float) -> float:
    """Its accelerations are in g, and slide the block when they are positive: ours, when they are negative."""
    motion = package.GroundMotion(-record / package.constants.G_EARTH, dt, "motion")
    ratio = friction * STANDARD_GRAVITY / package.constants.G_EARTH
    return float(package.RigidAnalysis(ratio, motion).max_sliding_disp)
