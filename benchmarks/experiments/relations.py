"""Known relations for the shaking that overturns half of such pieces, beside what the package computes.

A relation stands here only where its formula is in the package or was read; the page lists those that were not found.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...core.aliases import Array
from ...core.units import STANDARD_GRAVITY
from ...fragility.curves.published import japanese, p58_regression
from ...models import Block, HousnerImpact
from ...motions.arrays import records
from ...motions.intensity.dataset import measure
from .ensembles import motions_of
from .predictions import capacities
from .table import BROADBAND, NEAR_FAULT

HEIGHT = 1.8
"""Height of the pieces, m."""
RATIOS = np.array([0.12, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4])
"""Their widths over their height."""
LEVELS = np.geomspace(0.5, 45.0, 70)
QUANTILES = (0.16, 0.5, 0.84)

ACCELERATION, VELOCITY = "pga", "pgv"


class Relation(NamedTuple):
    """A relation for the median over width over height: PGA, m/s², or PGV, m/s; quality A read, D recalled."""

    name: str
    im: str
    median: Array
    quality: str


class Own(NamedTuple):
    """What is computed under a kind of motions: quantiles 16, 50 and 84 % of the capacities, as PGA and as PGV."""

    kind: str
    pga: Array
    pgv: Array  # quantile, ratio


def relations() -> list[Relation]:
    """Return the known relations for uniform blocks of `HEIGHT`.

    References
    ----------
    Housner (1963) and West, quoted by Ishiyama (1984), for the acceleration at which a block begins to rock; Ishiyama,
    Y. (1984), Criteria for overturning of rigid bodies by sinusoidal and earthquake excitations, 8WCEE, of which the
    summary was read: its velocity 10 B/sqrt(H) (cm) is recalled.  Others: `toppling.fragility.japanese`,
    `toppling.fragility.p58_regression`.
    """
    widths, blocks = RATIOS * HEIGHT, _blocks()
    return [
        Relation("start of rocking, g B/H", ACCELERATION, STANDARD_GRAVITY * RATIOS, "A"),
        Relation("Japanese criterion, acceleration", ACCELERATION, _median(blocks, "acceleration"), "A"),
        Relation("Japanese criterion, velocity", VELOCITY, _median(blocks, "velocity"), "D"),
        Relation("Ishiyama 1984, velocity", VELOCITY, 0.01 * 1000.0 * widths / np.sqrt(100.0 * HEIGHT), "D"),
        Relation("FEMA P-58, regression", VELOCITY, p58_regression(widths, HEIGHT), "A"),
    ]


def own() -> list[Own]:
    """Compute the capacities of the same blocks under the ensembles of tests whose motion is not known."""
    found = []
    for kind in (BROADBAND, NEAR_FAULT):
        motions = motions_of(kind)
        pga, pgv = (np.asarray(measure(name, records(motions)), dtype=float) for name in (ACCELERATION, VELOCITY))
        levels = np.array(capacities(_blocks(), HousnerImpact(), motions, LEVELS))
        quantiles = [
            np.quantile(each, QUANTILES, axis=1, method="inverted_cdf") for each in (levels, levels * (pgv / pga))
        ]
        found.append(Own(kind, *(np.where(np.isfinite(one), one, math.nan) for one in quantiles)))
    return found


def _blocks() -> list[Block]:
    return [Block(ratio * HEIGHT, HEIGHT, name=f"B/H {ratio:g}") for ratio in RATIOS]


def _median(blocks: list[Block], criterion: str) -> Array:
    return np.asarray(japanese(blocks, criterion)["median"].values, dtype=float)
