"""Restraints of blocks: shares of the motions that break them, and the strength that keeps a target."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import xarray as xr

from ...core.aliases import Array
from ...core.units import DIMENSIONLESS, NEWTON, described
from ...core.wording import given_percent
from ...fragility import HazardCurve, overturning_probability
from ...fragility.numerics.slabs import gathered
from ...models import Block, Law, Restraint
from .design_shaking import at_level, design_level

FLAG = "ruptured"
"""Output of a run that is True if its restraint broke."""
BROKEN = "broken_probability"
"""Variable with the share of the motions in which a restraint breaks, and beginning of the names of its interval."""
AT_DESIGN = "broken_at_design"
DESIGN = "design_level"
"""Coordinate with the design level."""
ENDS = {"": "probability", "_lower": "lower", "_upper": "upper"}
WEAKER, STRONGER = 3, 5
"""Halvings and doublings of the given strength that are tried."""
BISECTIONS = 4
"""Strengths that are tried between the strongest that misses the target and the next, which are then 5 % apart."""
STEPS = WEAKER + 1 + STRONGER + BISECTIONS
"""Most strengths that are tried of a restraint under a law."""
TARGET, NEEDED, TRIED, CHANCE = "target_chance", "needed_strength", "tried_strength", "tried_chance"


def any_held(blocks: Sequence[Block]) -> bool:
    """Return True if a restraint holds any of some blocks."""
    return any(block.restraint is not None for block in blocks)


def ruptures(
    runs: xr.Dataset, blocks: Sequence[Block], confidence: float, hazard: HazardCurve | None = None
) -> xr.Dataset:
    """Return the shares of motions that break restraints, with a hazard also at 10 % in 50 years."""
    flags = runs.assign(overturned=runs[FLAG])
    counted = gathered(lambda part: overturning_probability(part, confidence), flags)
    held = xr.DataArray([block.restraint is not None for block in blocks], dims="block")
    text, percent = "probability that the restraint breaks", given_percent(confidence)
    shares = xr.Dataset()
    for end, name in ENDS.items():
        long_name = f"{end[1:]} end of the {percent} interval: {text}" if end else text
        attributes = described(long_name)
        shares[f"{BROKEN}{end}"] = counted[name].where(held).assign_attrs(attributes)
    if hazard is None:
        return shares
    levels = shares["level"]
    design = design_level(levels.values, hazard)
    for end in ENDS:
        given = shares[f"{BROKEN}{end}"].transpose(..., "level")
        there = given.isel(level=0, drop=True).copy(data=at_level(design, levels.values, given.values))
        long_name = f"{given.attrs['long_name']}, under the shaking that is exceeded with 10 % in 50 years"
        shares[f"{AT_DESIGN}{end}"] = there.assign_attrs(units=DIMENSIONLESS, long_name=long_name)
    name = f"level that is exceeded with a probability of 10 % in 50 years: {levels.attrs.get('long_name', 'level')}"
    return shares.assign_coords({DESIGN: ((), np.float64(design), described(name, levels.attrs["units"]))})


def needed_strengths(
    blocks: Sequence[Block],
    laws: Sequence[Law],
    targets: Sequence[float],
    chances: Callable[[Sequence[Block], Law], Array],
) -> xr.Dataset:
    """Return the weakest tested strengths above the strongest that misses the target: inf if that is the strongest.

    A stronger restraint may raise the probability, so all tested strengths above must meet the target.
    """
    asked = np.flatnonzero(np.isfinite(targets)).tolist()
    needed = np.full((len(blocks), len(laws)), np.nan)
    tried = np.full((2, *needed.shape, STEPS), np.nan)
    for j, law in enumerate(laws):
        known: dict[int, dict[float, float]] = {i: {} for i in asked}
        for step in range(STEPS):
            strengths = {i: _next(_restraint(blocks[i]), step, *_ends(known[i], targets[i])) for i in asked}
            held = {
                i: replace(blocks[i], restraint=replace(_restraint(blocks[i]), strength=strength))
                for i, strength in strengths.items()
                if strength not in (0.0, math.inf)
            }
            if held:
                for i, chance in zip(held, chances(list(held.values()), law).tolist(), strict=True):
                    known[i][strengths[i]] = chance
        for i, of_block in known.items():
            needed[i, j] = _ends(of_block, targets[i])[1]
            tried[:, i, j, : len(of_block)] = np.array(sorted(of_block.items())).T
    text = "strength above which all tested strengths of the restraint keep the chance to target_chance"
    of_cases, trials = ("block", "model"), ("block", "model", "trial")
    return xr.Dataset(
        {
            NEEDED: (of_cases, needed, described(f"least {text}; inf: none does", NEWTON)),
            TRIED: (trials, tried[0], described("tested strengths, weakest first, then NaN", NEWTON)),
            CHANCE: (trials, tried[1], described("chance with each, NaN if not known")),
        },
        {TARGET: ("block", np.array(targets), described("chance to be kept"))},
    )


def _restraint(block: Block) -> Restraint:
    assert block.restraint is not None  # (a target is a key of a restraint)
    return block.restraint


def _ends(known: dict[float, float], target: float) -> tuple[float, float]:
    """Return the strongest tested strength that misses a target, else 0, and the next tested one, else inf."""
    low = max((strength for strength, chance in known.items() if not chance <= target), default=0.0)
    return low, min((strength for strength in known if strength > low), default=math.inf)


def _next(restraint: Restraint, step: int, low: float, high: float) -> float:
    """Return the strength to be tried next; 0 or inf if none is left between the ends."""
    doublings = STEPS - BISECTIONS
    strength = restraint.strength * 2.0 ** (step - WEAKER) if step < doublings else math.sqrt(low * high)
    if not 0.0 < strength < math.inf:
        return strength
    rounded = float(f"{strength:.3g}")
    # (a restraint is stronger than its preload)
    return rounded if rounded > restraint.preload else 0.0
