"""Pooled surfaces against runs of the blocks themselves: coverage of medians and rates, and the time of 10^6 blocks.

`python -m toppling.benchmarks.sequential.regions [part …]` prints the parts named, or all: band, rates, million.
(`sizes` beside it compares surfaces with grids of levels of each block.)
"""

from __future__ import annotations

import math
import resource
import sys
from collections.abc import Callable, Sequence
from time import perf_counter, process_time

import numpy as np
import xarray as xr

from ...core.aliases import Array, Flags, Index
from ...core.streams import stream
from ...fragility.adaptive.probit import Observations, fit_probit
from ...fragility.analyses.pooled import pooled
from ...fragility.analyses.surface_results import surface_curves
from ...fragility.analyses.waves import MotionSource, run_wave, scaled_to
from ...fragility.hazard.curve import HazardCurve
from ...fragility.runs.request import check_request
from ...models import Block, EnergyConsistent, HousnerImpact, Law
from ...models.block_array import BlockArray
from ...models.laws import oscillator_of
from ...motions import CloughPenzien

MOTIONS = CloughPenzien(duration=20.0, dt=0.005)
OTHER_SEED = 90_000
"""Seed of the motions of direct runs, which no surface has seen."""
LAWS: tuple[Law, ...] = (EnergyConsistent(), HousnerImpact())
SLENDERNESS, SIZES = (2.5, 8.0), (0.3, 2.0)
"""Height over width, and R (m), of the region in two variables."""
WIDTH = 0.3
"""Distance of the outer levels of direct runs from the surface's median, in dispersions: they are near, as its own."""
TOGETHER = 500
SURFACES = 8
"""Surfaces, of motions of their own, whose errors are put together: the error of one is common to its blocks."""


def region(number: int, seed: int) -> BlockArray:
    """Return blocks at random in the region, even in ln of slenderness and size."""
    random = stream(seed, 7)
    slender, size = (
        np.exp(random.uniform(math.log(ends[0]), math.log(ends[1]), number)) for ends in (SLENDERNESS, SIZES)
    )
    alpha = np.arctan(1.0 / slender)
    return BlockArray(2.0 * size * np.sin(alpha), 2.0 * size * np.cos(alpha))


def blocks_of(columns: BlockArray) -> list[Block]:
    """Return columns as blocks."""
    return columns.some(np.arange(len(columns)))


def outcomes(
    blocks: Sequence[Block], levels: Array, motions: int, law: Law = LAWS[0], seed: int = OTHER_SEED
) -> tuple[Flags, Index]:
    """Return whether blocks overturn (block, level, motion) at PGAs (block, level), and the numbers of the motions."""
    request = check_request(blocks[:1], law, ["overturned"], True, None, None)
    specimens = [oscillator_of(block, law) for block in blocks]
    source, scaled = MotionSource(MOTIONS, seed), scaled_to("pga")
    flags, numbers = [], []
    for first in range(0, motions, TOGETHER):
        wave = source.wave(first, min(TOGETHER, motions - first))
        factors = np.asarray(scaled.factors(levels[:, :, None], scaled.measured(wave, blocks[:1])[0]))
        flags.append(run_wave(request, specimens, None, wave.records, factors)["overturned"])
        numbers.append(wave.numbers)
    return np.concatenate(flags, axis=-1), np.concatenate(numbers)


def observations(x: Array, fell: Flags, numbers: Index) -> Observations:
    """Return the runs of one block (level, motion) at ln levels."""
    levels, motions = (np.broadcast_to(values, fell.shape).ravel() for values in (x[:, None], numbers))
    return Observations(levels.astype(float), fell.ravel(), motions.astype(np.int64))


def direct_medians(blocks: Sequence[Block], curves: xr.Dataset, motions: int) -> tuple[Array, Array]:
    """Return ln medians (PGA) of blocks by three runs of each under each motion, and their standard errors.

    curves: medians and dispersions on (block, model), near which the runs are.
    """
    x = np.log(curves["half_level"].values) + WIDTH * curves["dispersion"].values * np.array([-1.0, 0.0, 1.0])
    fell, numbers = outcomes(blocks, np.exp(x), motions)
    medians = np.empty((2, len(blocks)))
    for i in range(len(blocks)):
        fitted, _ = fit_probit(observations(x[i], fell[i], numbers))
        assert fitted is not None
        estimate = fitted.median()
        medians[:, i] = estimate.value, estimate.error
    return medians[0], medians[1]


def pooled_of(columns: BlockArray, runs: int, per_motion: int, seed: int) -> tuple[xr.Dataset, int, float]:
    """Return a surface of so many runs, `per_motion` each; all runs, its check included, and CPU seconds."""
    started, number, counted = process_time(), runs // per_motion, [0]
    surface = pooled(
        columns,
        LAWS[0],
        MOTIONS,
        until={"median": 0.02, "motions": {"least": min(64, number), "most": number}},
        blocks_per_motion=per_motion,
        seed=seed,
        progress=lambda done, _: counted.append(done),
    )
    return surface, counted[-1], process_time() - started


def _inside(columns: BlockArray, tested: BlockArray) -> BlockArray:
    """Return the tested blocks drawn towards the middle of the region, where every sample of it holds them."""
    alpha, size = np.log(np.tan(tested.alpha)), np.log(tested.R)
    middle = np.mean(np.log(np.tan(columns.alpha))), np.mean(np.log(columns.R))
    angle = np.arctan(np.exp(middle[0] + 0.9 * (alpha - middle[0])))
    radius = np.exp(middle[1] + 0.9 * (size - middle[1]))
    return BlockArray(2.0 * radius * np.sin(angle), 2.0 * radius * np.cos(angle))


def band(replicates: int = 40, tolerance: float = 0.05, motions: int = 20_000) -> None:
    """Print how often the band holds the medians of 200 tested blocks at once, and each, and the promise is kept."""
    columns = region(20_000, 1)
    tested = _inside(columns, region(200, 2))
    truth: Array | None = None
    held, promised, used = [], [], []
    for seed in range(replicates):
        surface = pooled(columns, LAWS[0], MOTIONS, until={"median": tolerance}, seed=seed)
        curves = surface_curves(surface, tested)
        if truth is None:
            truth, _ = direct_medians(blocks_of(tested), curves, motions)
        lower, middle, upper = (np.log(curves[f"half_level{end}"].values[:, 0]) for end in ("_lower", "", "_upper"))
        held.append((lower <= truth) & (truth <= upper))
        promised.append((np.abs(middle - truth) <= math.log1p(tolerance)).all())
        used.append(surface["motions_run"].values[0])
    table = np.array(held)
    print(
        f"all in the band {table.all(axis=1).mean():.3f}, each {table.mean():.3f}, promise kept "
        f"{np.mean(promised):.3f}, {np.mean(used):.0f} motions"
    )


def rates(slopes: Sequence[float] = (2.0, 3.0), motions: int = 4000) -> None:
    """Print rates of eight blocks by surfaces over rates of direct runs, under a power-law hazard of each slope.

    Intervals are wider where single checked blocks are off the plane of ratios of a surface.
    """
    columns = region(20_000, 1)
    tested = _inside(columns, region(8, 3))
    levels: Array | None = None
    for slope in slopes:
        hazard = HazardCurve.power_law(1e-3, slope, "pga")
        surfaces = [
            pooled(columns, LAWS[0], MOTIONS, until={"median": 0.03}, hazard=hazard, seed=1 + k)
            for k in range(SURFACES)
        ]
        curves = [surface_curves(surface, tested, hazard) for surface in surfaces]
        if levels is None:
            median = curves[0]["half_level"].values[:, 0]
            levels = np.geomspace(0.3 * median, 5.0 * median, 60, axis=1)
            shares = outcomes(blocks_of(tested), levels, motions)[0].mean(axis=-1)
        # (the integral of P over the rate between levels so close that P is linear between them)
        events = hazard.rate_at(levels)
        direct = -(0.5 * (shares[:, :-1] + shares[:, 1:]) * np.diff(events)).sum(axis=1) + events[:, -1]
        rate, upper = (np.stack([curve[name].values[:, 0] for curve in curves]) for name in ("rate", "rate_upper"))
        gaps, reach = 100.0 * (rate / direct - 1.0), 100.0 * (upper / rate - 1.0)
        apart = np.array([float(surface["rate_apart"][0]) > 0.0 for surface in surfaces])
        widths = [f"{part.min():.1f} to {part.max():.1f} %" for part in (reach[~apart], reach[apart]) if part.size]
        held = np.mean(np.abs(np.log1p(0.01 * gaps)) <= np.log1p(0.01 * reach))
        print(
            f"k = {slope:g}: {gaps.min():+.1f} to {gaps.max():+.1f} %, rms {np.sqrt(np.mean(gaps**2)):.1f} %, "
            f"mean {gaps.mean():+.1f} %; {100.0 * held:.0f} % of {gaps.size} in their intervals; half widths "
            f"{', and where checked blocks are off the plane '.join(widths)} ({apart.sum()} of {apart.size})"
        )


def million(number: int = 1_000_000, tolerance: float = 0.02) -> None:
    """Print seconds, CPU seconds and GB for medians and rates of a region of so many blocks under two laws."""
    columns = region(number, 1)
    rates_of = {0.1: 6e-2, 0.5: 2e-2, 1.0: 7e-3, 2.0: 2e-3, 4.0: 4.5e-4, 8.0: 7e-5, 16.0: 7e-6}
    hazard = HazardCurve([*rates_of], [*rates_of.values()], "pga")
    wall, cpu = perf_counter(), process_time()
    surface = pooled(columns, LAWS, MOTIONS, "pga", until={"median": tolerance}, hazard=hazard, seed=1)
    wall, cpu = perf_counter() - wall, process_time() - cpu
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    print(f"{number:,} blocks, two laws, ±{tolerance:.0%}, rates: {wall:.0f} s, {cpu:.0f} s CPU, {memory:.2f} GB")
    print("\n".join(surface["account"].values.tolist()))


PARTS: dict[str, Callable[[], None]] = {"band": band, "rates": rates, "million": million}


def main(arguments: Sequence[str]) -> None:
    """Print the parts named."""
    for name in arguments or PARTS:
        PARTS[name]()


if __name__ == "__main__":
    main(sys.argv[1:])
