"""Flags of many runs, whatever is asked for: with and without skips, with other outputs, in other chunks.

Usage: same_flags.py [RUNS], ten million by default (20 minutes on two cores); prints the runs and those that differ.
"""

import sys

import numpy as np

import toppling as tp
from toppling import motions

BLOCKS = [tp.Block(width, height) for width, height in ((0.4, 1.8), (0.3, 1.2), (0.5, 1.3), (0.25, 2.0), (0.6, 1.6))]
LAWS = [tp.HousnerImpact(), tp.HousnerImpact(geometry="linear"), tp.EnergyConsistent(), tp.DiscreteDamping()]
GENERATORS = [motions.KanaiTajimi(duration=30.0), motions.CloughPenzien(duration=20.0), motions.SiteBased()]
LEVELS = 0.1 * 9.81 * 20.0 ** np.linspace(0.0, 1.0, 50)


def differing(seed: int) -> tuple[int, int]:
    """Return how many runs under forty motions there are, and how many flags differ from those of whole runs."""
    shaking = GENERATORS[seed % len(GENERATORS)].sample(40, seed=seed)

    def flags(outputs: tuple[str, ...], skip: bool, blocks: slice = slice(None)) -> np.ndarray:
        runs = tp.ida(BLOCKS[blocks], LAWS, shaking, LEVELS, "pga", outputs, skip=skip, screen=False)
        return np.asarray(runs["overturned"].values)

    whole = flags(("overturned", "peak_rotation"), False)
    others = [flags(("overturned",), True), flags(("overturned", "peak_rotation"), True), flags(("overturned",), False)]
    others.append(np.concatenate([flags(("overturned",), True, part) for part in (slice(0, 2), slice(2, 5))]))
    return whole.size, sum(int((whole != other).sum()) for other in others)


def main(wanted: int) -> int:
    """Print how many runs and differences there are after each set of motions; 1 where there are any."""
    runs = differences = seed = 0
    while runs < wanted:
        size, differ = differing(seed)
        runs, differences, seed = runs + size, differences + differ, seed + 1
        print(f"{runs:,} runs, {differences} flags that differ", flush=True)
    return int(differences > 0)


if __name__ == "__main__":
    sys.exit(main(int(float(sys.argv[1])) if len(sys.argv) > 1 else 10_000_000))
