"""Rates without a form of curve from levels drawn by the hazard, beside those of levels that all motions share.

`python -m toppling.benchmarks.sequential.strata [motions]` prints the bias of both against 200 levels of each motion.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...core.aliases import Array, Index
from ...core.streams import stream
from ...core.units import STANDARD_GRAVITY
from ...fragility.adaptive.curve import SequentialCurve
from ...fragility.adaptive.rate import draw_levels, hazard_cells
from ...fragility.adaptive.until import until_of
from ...fragility.hazard.curve import HazardCurve
from ...models import EnergyConsistent
from ...models.oscillator import stack
from ...models.runs import OUTPUTS, run_mixed
from ...motions import records
from ...motions.arrays import Record
from ...motions.simulated.generator import Generator
from .databases import BLOCK, DATABASES

MOTIONS = 10_000
STRATA = (3, 10, 20)
REFERENCE = 200
GRIDS = (5, 10, 20)
ENDS = 0.4, 25.0
"""Levels of the shared grids, from and to, over g tan(alpha), the PGA that uplifts the block."""
SLOPES = (2.0, 3.0)
SEED = 5
TOGETHER = 1000


class Bias(NamedTuple):
    """Relative difference of a rate from that of the reference under the same motions, and its standard error."""

    name: str
    value: float
    error: float


class _Set(NamedTuple):
    motions: list[Record]
    peaks: Array


def biases(slope: float, number: int = MOTIONS) -> list[Bias]:
    """Return what both kinds of levels make of the rate under a power-law hazard of PGA."""
    generator, _ = next(iter(DATABASES.values()))
    hazard = HazardCurve.power_law(1e-3, slope, "pga")
    middle, spread = _rough(generator, hazard)
    cells = hazard_cells(hazard, middle, spread)
    static = math.log(STANDARD_GRAVITY * math.tan(BLOCK.alpha))
    rates: dict[str, list[Array]] = {}
    for first in range(0, number, TOGETHER):
        motions = records(generator.sample(min(TOGETHER, number - first), SEED, first))
        own = _Set(motions, np.array([np.abs(one.acceleration).max() for one in motions]))
        for strata in (REFERENCE, *STRATA):
            uniform = np.stack(
                [stream(SEED, strata, first + i).random((2, strata)) for i in range(len(motions))], axis=-1
            )
            x, weights = draw_levels(cells, middle, spread, uniform)
            rates.setdefault(f"{strata} drawn", []).append((weights * _fell(own, x)).sum(axis=0))
        for levels in GRIDS:
            at = np.linspace(static + math.log(ENDS[0]), static + math.log(ENDS[1]), levels)
            edges = np.concatenate([[at[0] - 0.5 * (at[1] - at[0])], 0.5 * (at[1:] + at[:-1])])
            masses = hazard.rate_at(np.exp(edges)) - np.append(hazard.rate_at(np.exp(edges[1:])), 0.0)
            fell = _fell(own, np.repeat(at[:, None], len(motions), axis=1))
            rates.setdefault(f"{levels} shared", []).append((masses[:, None] * fell).sum(axis=0))
    known = np.concatenate(rates.pop(f"{REFERENCE} drawn"))
    found = []
    for name, parts in rates.items():
        gaps = (np.concatenate(parts) - known) / known.mean()
        found.append(Bias(name, float(gaps.mean()), float(gaps.std() / math.sqrt(gaps.size))))
    return found


def _fell(motions: _Set, x: Array) -> Array:
    """Return whether the block overturns at ln levels (level, motion) of PGA, as 0 and 1."""
    table = stack([EnergyConsistent().oscillator(BLOCK)])
    motion: Index = np.broadcast_to(np.arange(x.shape[1]), x.shape).ravel().astype(np.int64)
    factors = (np.exp(x) / motions.peaks).ravel()
    runs = run_mixed(table, np.zeros(motion.size, np.int64), motion, factors, motions.motions, flags_only=True)
    return np.asarray(runs[:, OUTPUTS["overturned"]].reshape(x.shape))


def _rough(generator: Generator, hazard: HazardCurve) -> tuple[float, float]:
    """Return ln median and dispersion of the curve, as a first wave of an analysis knows them."""
    curve = SequentialCurve(until_of({"rate": 0.5}), 0.5, 8.0, seed=SEED, hazard=hazard)
    motions = records(generator.sample(64, SEED + 1))
    own = _Set(motions, np.array([np.abs(one.acceleration).max() for one in motions]))
    numbers = np.arange(64)
    plan = curve.plan(numbers)
    curve.add(numbers, plan, _fell(own, np.log(plan.levels)) > 0.0)
    look = curve.looks[-1]
    assert look.curve is not None
    return look.curve.value, curve.dispersion


def main(arguments: Sequence[str]) -> None:
    """Print both tables."""
    number = int(arguments[0]) if arguments else MOTIONS
    for slope in SLOPES:
        print(f"hazard of slope {slope:g}, {number:,} motions: rate over that of {REFERENCE} drawn levels, less 1 (%)")
        for one in biases(slope, number):
            print(f"  {one.name:10s} {100.0 * one.value:+6.2f} ± {100.0 * one.error:.2f}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
