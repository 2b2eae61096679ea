"""The table of docs/theory/axes.md, printed: the effect of a second horizontal component on the median of a block.

For blocks of several plan ratios, the medians over RotD50 of PGA under the component along the width alone and under
both, and their ratio with a paired bootstrap interval over motions.
"""

from __future__ import annotations

import numpy as np

import toppling as tp

from ... import motions
from ...core.units import STANDARD_GRAVITY
from .page import some
from .shares import medians
from .tables import Interval, table

RATIOS = (1.0, 1.25, 1.6, 2.0)
HEIGHT, WIDTH = 1.4, 0.3
IM = "RotD50(pga)"
LEVELS = np.geomspace(0.08, 1.2, 28) * STANDARD_GRAVITY
PAIRS, REPLICATES, SEED = some(300), 400, 1


def half(flags: np.ndarray) -> float:
    """Return the level at which half of the runs (level, motion) fall."""
    return float(medians(flags.mean(axis=1), LEVELS))


def main() -> None:
    """Print the table."""
    pairs = motions.SiteBasedScenario(magnitude=6.5, distance=15e3, vs30=500.0, dt=0.01).sample_pairs(PAIRS, SEED)
    blocks = [tp.Block(WIDTH, HEIGHT, depth=ratio * WIDTH, name=f"{ratio:g}") for ratio in RATIOS]
    turned = motions.both_axes(pairs, "random")
    both = tp.ida(blocks, tp.HousnerImpact(), turned, LEVELS, IM, screen=False)
    single = [motions.as_recorded(pair) for pair in turned]
    alone = tp.ida(blocks[0], tp.HousnerImpact(), single, LEVELS, IM, screen=False)["overturned"].values[0, 0]
    random = np.random.default_rng(SEED)
    draws = [random.integers(0, PAIRS, PAIRS) for _ in range(REPLICATES)]
    rows = []
    for i, ratio in enumerate(RATIOS):
        flags, axis = (both[name].values[i, 0] for name in ("overturned", "axis"))
        low, high = np.percentile([half(alone[:, draw]) / half(flags[:, draw]) for draw in draws], [2.5, 97.5])
        single_median, both_median = half(alone), half(flags)
        medians_g = (f"{median / STANDARD_GRAVITY:.3f}" for median in (single_median, both_median))
        along = f"{(axis == 2).sum() / (axis > 0).sum():.2f}"
        rows.append((f"{ratio:g}", *medians_g, f"{Interval(single_median / both_median, low, high):.3f}", along))
    heads = (
        "depth over width",
        "median of the width alone, g",
        "of both axes, g",
        "ratio (95 %)",
        "falls along the depth",
    )
    print(table(heads, rows))
