"""The figures of docs/theory/axes.md: what a second horizontal component does to the median of a block.

`python docs/axes.py` prints a table: for blocks of several plan ratios, the medians over RotD50 of PGA under the
component along the width alone and under both, and their ratio with a paired bootstrap interval over motions.
"""

from __future__ import annotations

import numpy as np
from paired import medians

import toppling as tp
from toppling import motions

RATIOS = (1.0, 1.25, 1.6, 2.0)
HEIGHT, WIDTH = 1.4, 0.3
IM = "RotD50(pga)"
LEVELS = np.geomspace(0.08, 1.2, 28) * 9.80665
PAIRS, REPLICATES, SEED = 300, 400, 1


def half(flags: np.ndarray) -> float:
    """Return the level at which half of the runs (level, motion) fall."""
    return float(medians(flags.mean(axis=1), LEVELS))


def main() -> None:
    """Print the table."""
    pairs = motions.SiteBasedScenario(magnitude=6.5, distance=15e3, vs30=500.0, dt=0.01).sample_pairs(PAIRS, SEED)
    blocks = [tp.Block(WIDTH, HEIGHT, depth=ratio * WIDTH, name=f"{ratio:g}") for ratio in RATIOS]
    law = tp.HousnerImpact()
    both = tp.ida(blocks, law, motions.both_axes(pairs, "random"), LEVELS, IM, screen=False)
    turned = [motions.as_recorded(one) for one in motions.both_axes(pairs, "random")]
    alone = tp.ida(blocks[0], law, turned, LEVELS, IM, screen=False)["overturned"].values[0, 0]
    random = np.random.default_rng(SEED)
    draws = [random.integers(0, PAIRS, PAIRS) for _ in range(REPLICATES)]
    print(
        "| depth over width | median of the width alone, g | of both axes, g | ratio (95 %) | falls along the depth |"
    )
    print("|---|---|---|---|---|")
    for i, ratio in enumerate(RATIOS):
        flags, axis = (both[name].values[i, 0] for name in ("overturned", "axis"))
        ratios = [half(alone[:, own]) / half(flags[:, own]) for own in draws]
        low, high = np.percentile(ratios, [2.5, 97.5])
        one, two = half(alone), half(flags)
        print(
            f"| {ratio:g} | {one / 9.80665:.3f} | {two / 9.80665:.3f} | {one / two:.3f} ({low:.3f}–{high:.3f}) "
            f"| {(axis == 2).sum() / (axis > 0).sum():.2f} |"
        )


if __name__ == "__main__":
    main()
