"""The pulse trials of models of precarious rocks, whose sizes are not known: counts, thresholds, and sizes fitted.

Nothing is predicted of them blindly.  Slenderness and size are fitted on the trials of half of the pulses' durations,
and the trials of the other half are predicted with them.
"""

from __future__ import annotations

import math
import warnings
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...core.aliases import Array, Flags
from ...core.doubts import ImplausibleInput
from ...core.units import STANDARD_GRAVITY
from ...models import Block
from ...motions import from_array
from ...studies.file.csv_table import CsvTable, TableKind
from .halves import HalfFits, fit_halves
from .replays import fallen
from .scores import Threshold, best_threshold
from .table import ExperimentError

KIND = TableKind(
    "table of pulse trials",
    ("file", "time", "pgv_over_pga_s", "pga_g", "toppled"),
    100_000,
    16 * 2**20,
    ExperimentError,
)


SLENDERNESS, FREQUENCY = np.round(np.geomspace(0.02, 0.5, 25), 4), np.round(np.geomspace(2.0, 16.0, 13), 2)
"""Width over height, and frequency parameters p (1/s), of the uniform blocks of which one is fitted."""
SAMPLES = 100
"""Steps of a pulse's motion."""


class Pulses(NamedTuple):
    """The trials of one set: how many there are, how many toppled, and the best thresholds of PGA (m/s²) and PGV.

    fits: each half of the trials with the block that fits the other half, split by the duration of the pulse.
    """

    name: str
    trials: int
    toppled: int
    pga: Threshold
    pgv: Threshold
    fits: HalfFits


def read_pulses(path: Path) -> list[Pulses]:
    """Read the pulse trials of a CSV file, set by set.

    Raises
    ------
    ExperimentError
        One sentence: a file that cannot be read, a cell that is not allowed, no trials.
    """
    sets: dict[str, list[tuple[float, float, bool]]] = {}
    for line in CsvTable(path, KIND):
        ratio, pga = (line.number_in(name, at_least=0.0) for name in ("pgv_over_pga_s", "pga_g"))
        if ratio is None or pga is None:
            line.refuse("pga_g", "and pgv_over_pga_s must be given")
        sets.setdefault(line.text("file"), []).append((ratio, STANDARD_GRAVITY * pga, line.yes_in("toppled")))
    if not sets:
        raise ExperimentError(f"{path}: has no trials")
    found = []
    for name, trials in sets.items():
        ratios, peaks = np.array([one[:2] for one in trials]).T
        toppled = np.array([one[2] for one in trials])
        measures = peaks, ratios * peaks
        fits = fit_halves(replayed_pulses(ratios, peaks), toppled, list(ratios), measures)
        found.append(
            Pulses(
                name,
                toppled.size,
                int(toppled.sum()),
                best_threshold(peaks, toppled),
                best_threshold(ratios * peaks, toppled),
                fits,
            )
        )
    return found


def candidates() -> list[Block]:
    """Return the uniform blocks of which one is fitted: every slenderness with every frequency parameter."""
    blocks = []
    for slenderness in SLENDERNESS:
        for frequency in FREQUENCY:
            radius, alpha = 0.75 * STANDARD_GRAVITY / frequency**2, math.atan(slenderness)
            name = f"b/h {slenderness:g}, p {frequency:g}/s"
            blocks.append(Block(2.0 * radius * math.sin(alpha), 2.0 * radius * math.cos(alpha), name=name))
    return blocks


def replayed_pulses(ratios: Array, peaks: Array) -> Flags:
    """Return whether every candidate overturns under every pulse (candidate, trial).

    The displacement is d = A (1 - cos 2 pi F t) for 0 <= t <= 1/F, F = 1/(2 pi PGV/PGA), so that the acceleration is a
    cosine; a pulse without acceleration or duration overturns nothing.
    """
    pairs, which = np.unique(np.stack([ratios, peaks]), axis=1, return_inverse=True)
    shaken = (pairs > 0.0).all(0)
    motions = []
    for i, (ratio, peak) in enumerate(pairs.T[shaken]):
        phase = np.linspace(0.0, 2.0 * math.pi, SAMPLES + 1)
        motions.append(from_array(peak * np.cos(phase), ratio * phase[1], [str(i)], "pulse"))
    flags = np.zeros((SLENDERNESS.size * FREQUENCY.size, shaken.size), dtype=bool)
    if motions:
        with warnings.catch_warnings():  # (models on a small table have sides of millimetres)
            warnings.simplefilter("ignore", ImplausibleInput)
            flags[:, shaken] = fallen(candidates(), motions)
    return flags[:, which.ravel()]
