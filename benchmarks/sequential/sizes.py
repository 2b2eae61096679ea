"""Medians of 97 blocks of one slenderness: by one surface through pooled runs, and by 20 levels of each block.

`python -m toppling.benchmarks.sequential.sizes [replicates]` prints the table.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from functools import partial
from time import process_time
from typing import NamedTuple

import numpy as np

from ...core.aliases import Array
from ...core.units import STANDARD_GRAVITY
from ...fragility.adaptive.probit import fit_probit, local_probit
from ...fragility.analyses.surface_results import surface_curves
from ...models.block_array import BlockArray
from .promises import GRID
from .regions import blocks_of, direct_medians, observations, outcomes, pooled_of

ALPHA, SMALLEST, LARGEST, NUMBER = 0.2, 0.2, 3.0, 97
EACH = 4
"""Blocks that a pooled analysis runs under each motion."""
POOLED = (4000, 8000, 16_000)
GRID_MOTIONS = (30, 120, 480)
COMMON = (0.8, 8.0)
"""Lowest and highest of the levels that all blocks share, over g tan alpha: about where the first block falls under one
motion, and beyond where the last one stands."""
OWN = 1.0
"""Distance of the outer levels of each block's own from its median, in dispersions."""
TESTED = 8
"""One block in so many is compared."""
TRUTH_MOTIONS = 16_000
REPLICATES = 16
SEED = 500


def sizes() -> BlockArray:
    """Return the blocks, from the smallest to the largest."""
    size = np.geomspace(SMALLEST, LARGEST, NUMBER)
    return BlockArray(2.0 * size * math.sin(ALPHA), 2.0 * size * math.cos(ALPHA))


class Truth(NamedTuple):
    """Ln medians and dispersions of all blocks, ln medians of the tested ones by themselves, and the latter's error."""

    rough: Array
    dispersions: Array
    medians: Array
    error: float


def truth(motions: int = TRUTH_MOTIONS) -> Truth:
    """Return the medians by runs of each tested block under many motions, near those of a surface."""
    blocks = sizes()
    curves = surface_curves(pooled_of(blocks, POOLED[-1], EACH, 1)[0], blocks)
    near = curves.isel(block=slice(None, None, TESTED))
    medians, errors = direct_medians(blocks_of(blocks)[::TESTED], near, motions)
    rough, dispersions = (curves[name].values[:, 0] for name in ("half_level", "dispersion"))
    return Truth(np.log(rough), dispersions, medians, float(np.sqrt(np.mean(errors**2))))


Medians = tuple[Array, int, float]
"""Ln medians of all blocks by one analysis, runs of its check, and its CPU time, s."""


def by_surface(runs: int, seed: int) -> Medians:
    """Return the medians by a surface through so many runs."""
    blocks = sizes()
    surface, number, seconds = pooled_of(blocks, runs, EACH, seed)
    return np.log(surface_curves(surface, blocks)["half_level"].values[:, 0]), number - runs, seconds


def common_grid() -> Array:
    """Return ln of the levels (block, level) that all blocks share."""
    x = np.log(np.geomspace(*COMMON, GRID) * STANDARD_GRAVITY * math.tan(ALPHA))
    return np.repeat(x[None], NUMBER, axis=0)


def by_grid(x: Array, local: bool, motions: int, seed: int) -> Medians:
    """Return the medians by a curve of each block, at ln levels x (block, level) of common motions.

    local: through the runs within a dispersion of the median alone, where these determine one.
    """
    started = process_time()
    fell, numbers = outcomes(blocks_of(sizes()), np.exp(x), motions, seed=seed)
    medians = []
    for seen in map(observations, x, fell, [numbers] * NUMBER):
        curve, _ = fit_probit(seen)
        assert curve is not None  # (the lowest level fells no block under every motion, the highest does)
        near = local_probit(seen, curve.log_median, curve.dispersion, follow=True)[0] if local else None
        # (levels so far apart that hardly one is within a dispersion have the curve through all alone)
        medians.append((near or curve).log_median)
    return np.array(medians), 0, process_time() - started


HEAD = f"{'97 sizes':36s} {'rms':>6s} {'most':>6s} {'motions':>8s} {'runs':>9s} {'check':>7s} {'s':>6s}"


def line(label: str, analysis: Callable[[int], Medians], motions: int, runs: int, known: Truth, replicates: int) -> str:
    """Return a line of the table: an analysis by its seed, as often as asked.

    Root mean square and largest difference of ln medians from the truth; motions and runs of one analysis, and on
    top of them what a surface's check takes; CPU time with motions and fits.
    """
    medians, checks, times = zip(*(analysis(SEED + k) for k in range(replicates)), strict=True)
    gaps = np.stack(medians)[:, ::TESTED] - known.medians
    checked, seconds = round(np.mean(checks)), np.median(times)
    return (
        f"{label:36s} {np.sqrt(np.mean(gaps**2)):6.4f} {np.abs(gaps).max():6.4f} {motions:8,d} {runs:9,d} "
        f"{checked:7,d} {seconds:6.1f}"
    )


def main(arguments: Sequence[str]) -> None:
    """Print the table."""
    replicates = int(arguments[0]) if arguments else REPLICATES
    known = truth()
    print(HEAD, flush=True)
    for runs in POOLED:
        print(line("one surface", partial(by_surface, runs), runs // EACH, runs, known, replicates), flush=True)
    near_medians = known.rough[:, None] + OWN * known.dispersions[:, None] * np.linspace(-1.0, 1.0, GRID)
    grids = {
        "20 common levels, curve through all": (common_grid(), False),
        "20 common levels, local fit": (common_grid(), True),
        "20 levels near each median": (near_medians, False),
    }
    for label, (x, local) in grids.items():
        for motions in GRID_MOTIONS:
            analysis = partial(by_grid, x, local, motions)
            print(line(label, analysis, motions, motions * GRID * NUMBER, known, replicates), flush=True)
    print(f"error of the truth: {known.error:.4f}")


if __name__ == "__main__":
    main(sys.argv[1:])
