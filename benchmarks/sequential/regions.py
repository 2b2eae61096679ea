"""Pooled surfaces against runs of the blocks themselves: errors of medians and rates, coverage, time of 10^6 blocks.

`python -m toppling.benchmarks.sequential.regions [part …]` prints the parts named, or all: plane, band, kink, rates,
million, site.  (`sizes` beside it compares surfaces with grids of levels of each block.)
"""

from __future__ import annotations

import math
import resource
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import perf_counter, process_time
from typing import Any, NamedTuple

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
from ...models import Block, DiscreteDamping, EnergyConsistent, HousnerImpact, Law, MakrisKonstantinidis
from ...models.columns import BlockArray
from ...models.laws import oscillator_of
from ...models.oscillator import Oscillator
from ...motions import CloughPenzien, SiteBasedScenario
from ...motions.simulated.generator import Generator

MOTIONS = CloughPenzien(duration=20.0, dt=0.005)
SITE_BASED = SiteBasedScenario(magnitude=6.8, distance=15e3, vs30=620.0)
OTHER_SEED = 90_000
"""Seed of the motions of direct runs, which no surface has seen."""
LAWS: tuple[Law, ...] = (
    EnergyConsistent(),
    HousnerImpact(),
    DiscreteDamping(delta=0.1),
    MakrisKonstantinidis(delta=0.1),
)
SLENDERNESS, SIZES = (2.5, 8.0), (0.3, 2.0)
"""Height over width, and R (m), of the region in two variables."""
WIDTH = 0.3
"""Distance of the outer levels of direct runs from the surface's median, in dispersions: they are near, as its own."""
TOGETHER = 500
SURFACES = 8
"""Surfaces, of motions of their own, whose errors are put together: the error of one is common to its blocks."""


class Errors(NamedTuple):
    """Root mean square and largest difference of ln medians from direct ones, what of it is the direct ones' own
    standard error, and runs and CPU seconds of a surface.
    """

    rms: float
    most: float
    direct: float
    runs: int
    seconds: float


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


def direct_medians(
    blocks: Sequence[Block],
    law: Law,
    curves: xr.Dataset,
    motions: int,
    generator: Generator = MOTIONS,
    seed: int = OTHER_SEED,
) -> tuple[Array, Array]:
    """Return ln medians (PGA) of blocks by three runs of each under each motion, and their standard errors.

    curves: medians and dispersions on (block, model), near which the runs are.
    """
    request = check_request(blocks[:1], law, ["overturned"], True, None, None)
    specimens = [oscillator_of(block, law) for block in blocks]
    source, scaled = MotionSource(generator, seed), scaled_to("pga")
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


def errors(columns: BlockArray, tested: BlockArray, law: Law, runs: int, each: int, motions: int) -> Errors:
    """Return the errors of surfaces of so many runs, `each` a motion, at tested blocks run under `motions` others."""
    found = [pooled_of(columns, law, runs, each, seed) for seed in range(1, SURFACES + 1)]
    curves = [surface_curves(one.surface, tested) for one in found]
    truth, error = direct_medians(blocks_of(tested), law, curves[0], motions)
    gaps = np.log(np.stack([one["half_level"].values[:, 0] for one in curves])) - truth
    # (runs of the surface alone: those of its check come on top)
    return Errors(
        float(np.sqrt(np.mean(gaps**2))),
        float(np.abs(gaps).max()),
        float(np.sqrt(np.mean(error**2))),
        runs,
        float(np.mean([one.seconds for one in found])),
    )


def plane(motions: int = 4000) -> list[tuple[str, Errors]]:
    """Return the errors in two variables, 20,000 blocks, of four laws with 12,800 and 51,200 runs."""
    columns, tested = region(20_000, 1), region(14, 2)
    return [
        (law.label, errors(columns, _inside(columns, tested), law, runs, 8, motions))
        for law in LAWS
        for runs in (12_800, 51_200)
    ]


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


@dataclass(frozen=True)
class Kinked(DiscreteDamping):
    """A law that no polynomial follows: its elastic zone is three times as wide for blocks of R above 0.8 m."""

    def oscillator(self, block: Block) -> Oscillator:
        """Return the oscillator of a block."""
        return DiscreteDamping(delta=self.delta * (3.0 if block.R > 0.8 else 1.0)).oscillator(block)


def kink(tested: int = 200, motions: int = 4000) -> tuple[str, float, float]:
    """Return what a pooled analysis of a law with a kink says, and of blocks run by themselves the share in their
    intervals and the difference of ln medians that 95 % do not exceed.
    """
    columns, law = region(20_000, 1), Kinked(delta=0.1)
    surface = pooled(columns, law, MOTIONS, until={"median": 0.06}, seed=1)
    own = _inside(columns, region(tested, 2))
    curves = surface_curves(surface, own)
    truth, _ = direct_medians(blocks_of(own), law, curves, motions)
    lower, middle, upper = (np.log(curves[f"half_level{end}"].values[:, 0]) for end in ("_lower", "", "_upper"))
    held = float(((lower <= truth) & (truth <= upper)).mean())
    return str(surface["account"].values[0]), held, float(np.quantile(np.abs(middle - truth), 0.95))


def _print_kink() -> None:
    account, held, gap = kink()
    print(f"kink: {account}; {100.0 * held:.1f} % of 200 blocks in their intervals, 95 % differ by {gap:.4f} at most")


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


def million(
    number: int = 1_000_000, tolerance: float = 0.02, generator: Generator = MOTIONS, im: str = "pga"
) -> tuple[float, float, float, xr.Dataset]:
    """Return seconds, CPU seconds and GB for medians and rates of a region of so many blocks under two laws."""
    columns = region(number, 1)
    levels = np.array([0.1, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0]) * (0.1 if im == "pgv" else 1.0)
    hazard = HazardCurve(levels.tolist(), [6e-2, 2e-2, 7e-3, 2e-3, 4.5e-4, 7e-5, 7e-6], im)
    wall, cpu = perf_counter(), process_time()
    found = pooled(columns, LAWS[:2], generator, im, until={"median": tolerance}, hazard=hazard, seed=1)
    wall, cpu = perf_counter() - wall, process_time() - cpu
    return wall, cpu, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6, found


def _text(one: Errors) -> str:
    return (
        f"{one.runs:,} runs: rms {one.rms:.4f}, most {one.most:.4f} (direct medians' own error {one.direct:.4f}), "
        f"{one.seconds:.1f} s CPU"
    )


def _print_million(generator: Generator = MOTIONS, im: str = "pga") -> None:
    wall, cpu, memory, found = million(generator=generator, im=im)
    print(f"10^6 blocks, two laws, ±2 %, rates: {wall:.0f} s, {cpu:.0f} s CPU, {memory:.2f} GB")
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


_PARTS: dict[str, Callable[[], Any]] = {
    "plane": lambda: print("\n".join(f"{law}, {_text(one)}" for law, one in plane())),
    "band": lambda: print(band()),
    "kink": _print_kink,
    "rates": _print_rates,
    "million": _print_million,
    "site": lambda: _print_million(SITE_BASED, "pgv"),
}


def main(arguments: Sequence[str]) -> None:
    """Print the parts named."""
    for name in arguments or _PARTS:
        _PARTS[name]()


if __name__ == "__main__":
    main(sys.argv[1:])
