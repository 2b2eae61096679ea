"""Curves that are not lognormal as pelicun's ``multilinear_CDF``: levels and probabilities, linear between them.

pelicun keeps six digits of each number, and wants probabilities that begin with 0, end with 1 and rise at every level.
"""

import math
from pathlib import Path

import numpy as np

from ....core.aliases import Array
from ..discrete import grid, probability_at
from ..files import ExchangeError, number
from ..rows import CurveRow, levels_problem

FAMILY = "multilinear_CDF"
FAR = 1e6
"""Level, in multiples of the highest one of a curve that does not reach 1, at which it is written to reach 1."""
PARTS = 1_000_000
"""Parts into which the probability is divided."""
TAIL, STEP = 1e-6, 1e-5
"""Probability at which the tails of a curve with uplift are cut, and the width of a step relative to its level."""


def theta(row: CurveRow, levels: Array | None, factor: float) -> str:
    """Return ``Theta_0`` of a curve: levels, in a unit of `factor` (SI), unlike to six digits, and probabilities."""
    if row.probability is None:
        x = grid([row], TAIL, STEP)
        y = probability_at(row.parameters, x)
        y[0], y[-1] = 0.0, 1.0  # (the tails)
    else:
        assert levels is not None  # (a curve without parameters has its probabilities at levels)
        x, y = _closed(levels, row.probability)
    kept = np.array([float(f"{level:g}") for level in x])
    if np.any(np.diff(kept) <= 0.0):
        raise ExchangeError("pelicun keeps six digits of a level, and two levels of a curve are closer than that")
    return f"{','.join(map(repr, (x / factor).tolist()))}|{','.join(f'{p:.6g}' for p in _rising(y))}"


def points(file: Path, where: str, theta_0: str, factor: float) -> tuple[Array, Array]:
    """Return the levels (SI) and the probabilities of a curve in a table; levels are in a unit of `factor`.

    A last point that only ends the list, at `FAR` times the level before, is left out: the curve is constant there.
    """
    texts = [part.split(",") for part in theta_0.split("|")]
    if len(texts) != 2 or len(texts[0]) != len(texts[1]):
        raise ExchangeError(f"{file}: Theta_0 {where} must be levels|probabilities, as many of both, with commas")
    x, p = (np.array([number(file, f"Theta_0 {where}", value) for value in part]) for part in texts)
    x = x * factor
    problem = levels_problem(x)
    if problem is None and (x.size < 2 or p[0] != 0.0 or p[-1] != 1.0 or np.any(np.diff(p) < 0.0)):
        problem = "probabilities must begin with 0, end with 1 and not decrease with the level"
    if problem is not None:
        raise ExchangeError(f"{file}: Theta_0 {where} is no curve: {problem}")
    if math.isclose(x[-1], FAR * x[-2], rel_tol=1e-4):
        x, p = x[:-1], p[:-1]
    return x, p


def _closed(levels: Array, probability: Array) -> tuple[Array, Array]:
    """Return levels and probabilities from 0 to 1, without the points that repeat an end."""
    p = np.rint(probability * PARTS) / PARTS
    first = max(int((p == 0.0).sum()) - 1, 0)
    last = int(np.argmax(p == 1.0)) + 1 if p[-1] == 1.0 else p.size
    x, p = levels[first:last], p[first:last]
    if p[0] > 0.0:
        below = levels[0] ** 2 / levels[1] if levels.size > 1 else 0.0
        x, p = np.append(below, x), np.append(0.0, p)
    if p[-1] < 1.0:
        x, p = np.append(x, FAR * x[-1]), np.append(p, 1.0)
    return x, p


def _rising(p: Array) -> Array:
    """Return probabilities that rise by a millionth at least at every level, with the same ends."""
    parts = np.rint(p * PARTS)
    order = np.arange(p.size)
    parts = np.maximum.accumulate(parts - order) + order
    return np.asarray(np.minimum(parts, PARTS - order[::-1]) / PARTS)
