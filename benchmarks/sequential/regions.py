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
from typing import NamedTuple

import numpy as np
import xarray as xr

from ...core.aliases import Array, Flags
from ...core.streams import stream
from ...fragility.adaptive.probit import Observations, fit_probit
from ...fragility.analyses.pooled import pooled
from ...fragility.analyses.surface_results import surface_curves
from ...fragility.analyses.waves import MotionSource, run_wave, scaled_to
from ...fragility.hazard.curve import HazardCurve
from ...fragility.runs.request import check_request
from ...models import Block, EnergyConsistent, HousnerImpact, Law
from ...models.columns import BlockArray
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


def direct_medians(blocks: Sequence[Block], law: Law, curves: xr.Dataset, motions: int) -> tuple[Array, Array]:
    """Return ln medians (PGA) of blocks by three runs of each under each motion, and their standard errors.

    curves: medians and dispersions on (block, model), near which the runs are.
    """
    request = check_request(blocks[:1], law, ["overturned"], True, None, None)
    specimens = [oscillator_of(block, law) for block in blocks]
    source, scaled = MotionSource(MOTIONS, OTHER_SEED), scaled_to("pga")
    x = np.log(curves["half_level"].values) + WIDTH * curves["dispersion"].values * np.array([-1.0, 0.0, 1.0])
    levels = np.exp(x)
    flags, numbers = [], []
    for first in range(0, motions, TOGETHER):
        wave = source.wave(first, min(TOGETHER, motions - first))
        measured = scaled.measured(wave, blocks[:1])[0]
        factors = np.asarray(scaled.factors(levels[:, :, None], measured))
        flags.append(run_wave(request, specimens, None, wave.records, factors)["overturned"])
        numbers.append(wave.numbers)
    fell, motion = np.concatenate(flags, axis=-1), np.concatenate(numbers)
    found = np.empty((2, len(blocks)))
    for i in range(len(blocks)):
        own = np.broadcast_to(x[i][:, None], fell[i].shape).ravel()
        fitted, _ = fit_probit(Observations(own, fell[i].ravel(), np.broadcast_to(motion, fell[i].shape).ravel()))
        assert fitted is not None
        estimate = fitted.median()
        found[:, i] = estimate.value, estimate.error
    return found[0], found[1]


class Pooled(NamedTuple):
    """A surface, all runs with those of its check, and CPU seconds."""

    surface: xr.Dataset
    runs: int
    seconds: float


def pooled_of(columns: BlockArray, law: Law, runs: int, each: int, seed: int) -> Pooled:
    """Return a surface of so many runs, `each` a motion."""
    started, number, counted = process_time(), runs // each, [0]
    surface = pooled(
        columns,
        law,
        MOTIONS,
        until={"median": 0.02, "motions": {"least": min(64, number), "most": number}},
        blocks_per_motion=each,
        seed=seed,
        progress=lambda done, _: counted.append(done),
    )
    return Pooled(surface, counted[-1], process_time() - started)


def _inside(columns: BlockArray, tested: BlockArray) -> BlockArray:
    """Return the tested blocks drawn towards the middle of the region, where every sample of it holds them."""
    alpha, size = np.log(np.tan(tested.alpha)), np.log(tested.R)
    middle = np.mean(np.log(np.tan(columns.alpha))), np.mean(np.log(columns.R))
    angle = np.arctan(np.exp(middle[0] + 0.9 * (alpha - middle[0])))
    radius = np.exp(middle[1] + 0.9 * (size - middle[1]))
    return BlockArray(2.0 * radius * np.sin(angle), 2.0 * radius * np.cos(angle))


class Coverage(NamedTuple):
    """Share of replicates whose band holds the medians of all tested blocks, of single medians in it, and motions."""

    all_held: float
    each_held: float
    promise: float
    motions: float


def band(replicates: int = 40, tolerance: float = 0.05, motions: int = 20_000) -> Coverage:
    """Return how often the band holds 200 tested blocks at once."""
    columns = region(20_000, 1)
    tested = _inside(columns, region(200, 2))
    law = LAWS[0]
    truth: Array | None = None
    held, promised, used = [], [], []
    for seed in range(replicates):
        surface = pooled(columns, law, MOTIONS, until={"median": tolerance}, seed=seed)
        curves = surface_curves(surface, tested)
        if truth is None:
            truth, _ = direct_medians(blocks_of(tested), law, curves, motions)
        lower, upper = (np.log(curves[f"half_level_{end}"].values[:, 0]) for end in ("lower", "upper"))
        held.append((lower <= truth) & (truth <= upper))
        promised.append(
            float((np.abs(np.log(curves["half_level"].values[:, 0]) - truth) <= math.log1p(tolerance)).all())
        )
        used.append(int(surface["motions_run"].values[0]))
    table = np.array(held)
    return Coverage(
        float(table.all(axis=1).mean()), float(table.mean()), float(np.mean(promised)), float(np.mean(used))
    )


class Rates(NamedTuple):
    """Rates of surfaces (surface, block) over those of direct runs, less 1, and half widths of their intervals.

    apart: of which surfaces (surface,) single checked blocks are off the plane of ratios, which widens all intervals.
    """

    errors: Array
    reach: Array
    apart: Flags


def rates(slopes: Sequence[float], motions: int = 4000) -> list[Rates]:
    """Return rates of eight blocks by surfaces, beside those of direct runs, under a power-law hazard of each slope."""
    columns = region(20_000, 1)
    tested = _inside(columns, region(8, 3))
    hazards = [HazardCurve.power_law(1e-3, slope, "pga") for slope in slopes]
    found = [[_rates(columns, tested, hazard, 1 + k) for k in range(SURFACES)] for hazard in hazards]
    direct = np.empty((len(slopes), len(tested)))
    for i, block in enumerate(blocks_of(tested)):
        median = float(found[0][0]["half_level"][i, 0])
        levels = np.geomspace(0.3 * median, 5.0 * median, 60)
        shares = _shares(block, LAWS[0], levels, motions)
        for k, hazard in enumerate(hazards):
            # (the integral of P over the rate between levels so close that P is linear between them)
            mass = -np.diff(hazard.rate_at(levels))
            direct[k, i] = (0.5 * (shares[:-1] + shares[1:]) * mass).sum() + hazard.rate_at(levels[-1:])[0]
    return [_compared(own, one) for own, one in zip(found, direct, strict=True)]


def _rates(columns: BlockArray, tested: BlockArray, hazard: HazardCurve, seed: int) -> xr.Dataset:
    surface = pooled(columns, LAWS[0], MOTIONS, until={"median": 0.03}, hazard=hazard, seed=seed)
    return surface_curves(surface, tested, hazard).assign(rate_apart=surface["rate_apart"])


def _compared(found: Sequence[xr.Dataset], direct: Array) -> Rates:
    rate, upper = (np.stack([one[name].values[:, 0] for one in found]) for name in ("rate", "rate_upper"))
    apart = np.array([float(one["rate_apart"][0]) > 0.0 for one in found])
    return Rates(rate / direct - 1.0, upper / rate - 1.0, apart)


def _shares(block: Block, law: Law, levels: Array, motions: int) -> Array:
    request = check_request(block, law, ["overturned"], True, None, None)
    source, scaled, total = MotionSource(MOTIONS, OTHER_SEED), scaled_to("pga"), np.zeros(levels.size)
    for first in range(0, motions, TOGETHER):
        wave = source.wave(first, min(TOGETHER, motions - first))
        factors = np.asarray(scaled.factors(levels[None, :, None], scaled.measured(wave, [block])[0]))
        total += run_wave(request, [oscillator_of(block, law)], None, wave.records, factors)["overturned"][0].sum(
            axis=1
        )
    return np.asarray(total / motions)


def million(number: int = 1_000_000, tolerance: float = 0.02) -> None:
    """Print seconds, CPU seconds and GB for medians and rates of a region of so many blocks under two laws."""
    columns = region(number, 1)
    rates_of = {0.1: 6e-2, 0.5: 2e-2, 1.0: 7e-3, 2.0: 2e-3, 4.0: 4.5e-4, 8.0: 7e-5, 16.0: 7e-6}
    hazard = HazardCurve([*rates_of], [*rates_of.values()], "pga")
    wall, cpu = perf_counter(), process_time()
    found = pooled(columns, LAWS, MOTIONS, "pga", until={"median": tolerance}, hazard=hazard, seed=1)
    wall, cpu = perf_counter() - wall, process_time() - cpu
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    print(f"{number:,} blocks, two laws, ±{tolerance:.0%}, rates: {wall:.0f} s, {cpu:.0f} s CPU, {memory:.2f} GB")
    print("\n".join(found["account"].values.tolist()))


def _print_rates() -> None:
    slopes = (2.0, 3.0)
    for slope, one in zip(slopes, rates(slopes), strict=True):
        gaps = 100.0 * one.errors
        widths = [f"{own.min():.1f} to {own.max():.1f} %" for own in _halves(one)]
        held = float((np.abs(np.log1p(one.errors)) <= np.log1p(one.reach)).mean())
        print(
            f"k = {slope:g}: {gaps.min():+.1f} to {gaps.max():+.1f} %, rms {np.sqrt(np.mean(gaps**2)):.1f} %, "
            f"mean {gaps.mean():+.1f} %; {100.0 * held:.0f} % of {gaps.size} in their intervals; half widths "
            f"{', and where checked blocks are off the plane '.join(widths)} ({one.apart.sum()} of {one.apart.size})"
        )


def _halves(one: Rates) -> list[Array]:
    """Return half widths (%) of surfaces on whose plane of ratios all checked blocks lie, and of the others, if any."""
    return [100.0 * one.reach[which] for which in (~one.apart, one.apart) if which.any()]


_PARTS: dict[str, Callable[[], object]] = {
    "band": lambda: print(band()),
    "rates": _print_rates,
    "million": million,
}


def main(arguments: Sequence[str]) -> None:
    """Print the parts named."""
    for name in arguments or _PARTS:
        _PARTS[name]()


if __name__ == "__main__":
    main(sys.argv[1:])
