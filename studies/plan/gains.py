"""Probabilities of blocks with walls and restraints over probabilities of blocks that differ in these alone."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import xarray as xr

from ...core.units import ENDS, described, of_end
from ...core.wording import years_text
from ...fragility.hazard.poisson import probability_in
from ...fragility.risk.annual_rate import OF_RUNS
from ...fragility.risk.ratios import ratio_of
from ...models import Block
from .risk import Risk

GAIN = "chance_ratio"
"""Variable with the ratio of two blocks' probabilities, and beginning of the names of its interval."""
OTHER = "compared_with"
OTHER_TEXT = described("block whose chance the ratio is of")
MOST = 100
"""Most blocks that are compared with another."""


def comparable(blocks: Sequence[Block]) -> dict[int, int]:
    """Return blocks with the block to compare each with: that differs in the restraint alone, else the first."""
    bare = [replace(block, wall=None, restraint=None, mass=None, name=None) for block in blocks]
    # (backwards, so that the first of several that are alike is kept)
    free = {(bare[i], blocks[i].wall): i for i in reversed(range(len(blocks))) if blocks[i].restraint is None}
    pairs: dict[int, int] = {}
    for i, block in enumerate(blocks):
        without = None if block.restraint is None else free.get((bare[i], block.wall))
        same = bare[i] == bare[0] and (block.wall, block.restraint) != (blocks[0].wall, blocks[0].restraint)
        if without is not None:
            pairs[i] = without
        elif i and same:
            pairs[i] = 0
    return dict(list(pairs.items())[:MOST])


def gains(curves: xr.Dataset, risk: Risk, blocks: Sequence[Block], confidence: float) -> xr.Dataset | None:
    """Return ratios of chances in the study's years by `comparable` pairs under the same drawn motions."""
    pairs = comparable(blocks)
    if not pairs:
        return None
    compared = sorted({*pairs, *pairs.values()})
    mean = replace(risk, hazard=replace(risk.hazard, realisations=None, weights=None))
    return gains_of_rates(mean.rates(curves.isel(block=compared), confidence), risk.years, blocks, confidence)


def gains_of_rates(rates: xr.Dataset, years: float, blocks: Sequence[Block], confidence: float) -> xr.Dataset | None:
    """Return the ratios of `gains` from the rates of the blocks that are compared; None without samples or pairs."""
    pairs = comparable(blocks)
    if not pairs or "rate_sample" not in rates:
        return None
    compared = sorted({*pairs, *pairs.values()})
    if rates.sizes["block"] > len(compared):
        rates = rates.isel(block=compared)
    dims = tuple(str(dim) for dim in rates["rate"].dims)
    chance = probability_in(rates["rate"].values, years)
    samples = probability_in(rates["rate_sample"].values, years).reshape(*chance.shape, -1)
    at = dims.index("block")
    runs = probability_in(rates[OF_RUNS].values, years) if OF_RUNS in rates else np.full(chance.shape, np.nan)
    chance, samples, runs = (np.moveaxis(array, at, 0) for array in (chance, samples, runs))
    ratios = np.full((3, len(blocks), *chance.shape[1:]), np.nan)
    for block, other in pairs.items():
        for where in np.ndindex(*chance.shape[1:]):
            (a, of_a, runs_a), (b, of_b, runs_b) = (
                (float(chance[(k, *where)]), samples[(k, *where)], float(runs[(k, *where)]))
                for k in map(compared.index, (other, block))
            )
            ratios[(slice(None), block, *where)] = ratio_of(a, b, of_a, of_b, confidence, (runs_a, runs_b))
    text = f"chance in {years_text(years)} over that of the block compared with, under the same motions"
    values = np.moveaxis(ratios, 1, 1 + at)
    return xr.Dataset(
        {
            f"{GAIN}{end}": (dims, value, described(of_end(end, text, confidence)))
            for end, value in zip(ENDS, values, strict=True)
        },
        {OTHER: ("block", [blocks[pairs[i]].label if i in pairs else "" for i in range(len(blocks))], OTHER_TEXT)},
    )
