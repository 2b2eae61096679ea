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

from ...core.aliases import Array, Flags, Index
from ...core.units import STANDARD_GRAVITY
from ...fragility.adaptive.probit import Observations, fit_probit, local_probit
from ...fragility.analyses.surface_results import surface_curves
from ...fragility.analyses.waves import MotionSource, run_wave, scaled_to
from ...fragility.runs.request import check_request
from ...models.columns import BlockArray
from ...models.laws import oscillator_of
from .promises import GRID
from .regions import LAWS, MOTIONS, blocks_of, direct_medians, pooled_of

ALPHA, SMALLEST, LARGEST, NUMBER = 0.2, 0.2, 3.0, 97
LAW = LAWS[0]
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


class Way(NamedTuple):
    """A way to the medians of all blocks.

    rms, most: root mean square and largest difference of ln medians from the truth.  motions, runs: of one analysis.
    checked: runs of the check of a surface, which come on top.  seconds: CPU time with motions and fits.
    """

    label: str
    rms: float
    most: float
    motions: int
    runs: int
    checked: int
    seconds: float


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
    curves = surface_curves(pooled_of(blocks, LAW, POOLED[-1], EACH, 1).surface, blocks)
    near = curves.isel(block=slice(None, None, TESTED))
    medians, errors = direct_medians(blocks_of(blocks)[::TESTED], LAW, near, motions)
    rough, dispersions = (curves[name].values[:, 0] for name in ("half_level", "dispersion"))
    return Truth(np.log(rough), dispersions, medians, float(np.sqrt(np.mean(errors**2))))


class Medians(NamedTuple):
    """Ln medians of all blocks by one analysis, runs of its check, and its CPU time, s."""

    medians: Array
    checked: int
    seconds: float


def by_surface(runs: int, seed: int) -> Medians:
    """Return the medians by a surface through so many runs."""
    blocks = sizes()
    found = pooled_of(blocks, LAW, runs, EACH, seed)
    medians = np.log(surface_curves(found.surface, blocks)["half_level"].values[:, 0])
    return Medians(medians, found.runs - runs, found.seconds)


def common_grid() -> Array:
    """Return ln of the levels (block, level) that all blocks share."""
    x = np.log(np.geomspace(*COMMON, GRID) * STANDARD_GRAVITY * math.tan(ALPHA))
    return np.repeat(x[None], NUMBER, axis=0)


def own_grid(known: Truth) -> Array:
    """Return ln of the levels (block, level) of each block about its median, as if that were known."""
    return np.asarray(known.rough[:, None] + OWN * known.dispersions[:, None] * np.linspace(-1.0, 1.0, GRID))


def by_grid(x: Array, local: bool, motions: int, seed: int) -> Medians:
    """Return the medians by a curve of each block, at ln levels x (block, level) of common motions.

    local: through the runs within a dispersion of the median alone, where these determine one.
    """
    started = process_time()
    blocks = blocks_of(sizes())
    request = check_request(blocks[:1], LAW, ["overturned"], True, None, None)
    scaled = scaled_to("pga")
    wave = MotionSource(MOTIONS, seed).wave(0, motions)
    factors = np.asarray(scaled.factors(np.exp(x)[:, :, None], scaled.measured(wave, blocks[:1])[0]))
    fell = run_wave(request, [oscillator_of(one, LAW) for one in blocks], None, wave.records, factors)["overturned"]
    medians = np.array([_median(own, y, wave.numbers, local) for own, y in zip(x, fell, strict=True)])
    return Medians(medians, 0, process_time() - started)


def _median(x: Array, fell: Flags, motions: Index, local: bool) -> float:
    """Return ln median of one block from runs (level, motion)."""
    every = np.asarray(np.broadcast_to(x[:, None], fell.shape), float)
    own = Observations(every.ravel(), fell.ravel(), np.asarray(np.broadcast_to(motions, fell.shape), np.int64).ravel())
    curve, _ = fit_probit(own)
    assert curve is not None  # (the lowest level fells no block under every motion, the highest does)
    near = local_probit(own, curve.log_median, curve.dispersion, follow=True)[0] if local else None
    # (levels so far apart that hardly one is within a dispersion have the curve through all alone)
    return curve.log_median if near is None else near.log_median


def way(label: str, analysis: Callable[[int], Medians], motions: int, runs: int, known: Truth, replicates: int) -> Way:
    """Return a row of the table: an analysis by its seed, as often as asked."""
    every = [analysis(SEED + k) for k in range(replicates)]
    gaps = np.stack([one.medians[::TESTED] for one in every]) - known.medians
    return Way(
        label,
        float(np.sqrt(np.mean(gaps**2))),
        float(np.abs(gaps).max()),
        motions,
        runs,
        round(np.mean([one.checked for one in every])),
        float(np.median([one.seconds for one in every])),
    )


HEAD = f"{'97 sizes':36s} {'rms':>6s} {'most':>6s} {'motions':>8s} {'runs':>9s} {'check':>7s} {'s':>6s}"


def line(one: Way) -> str:
    """Return a way as a line of the table."""
    return (
        f"{one.label:36s} {one.rms:6.4f} {one.most:6.4f} {one.motions:8,d} {one.runs:9,d} {one.checked:7,d} "
        f"{one.seconds:6.1f}"
    )


def main(arguments: Sequence[str]) -> None:
    """Print the table."""
    replicates = int(arguments[0]) if arguments else REPLICATES
    known = truth()
    print(HEAD, flush=True)
    for runs in POOLED:
        found = way("one surface", partial(by_surface, runs), runs // EACH, runs, known, replicates)
        print(line(found), flush=True)
    grids = {
        "20 common levels, curve through all": (common_grid(), False),
        "20 common levels, local fit": (common_grid(), True),
        "20 levels near each median": (own_grid(known), False),
    }
    for label, (x, local) in grids.items():
        for motions in GRID_MOTIONS:
            analysis = partial(by_grid, x, local, motions)
            found = way(label, analysis, motions, motions * GRID * NUMBER, known, replicates)
            print(line(found), flush=True)
    print(f"error of the truth: {known.error:.4f}")


if __name__ == "__main__":
    main(sys.argv[1:])
