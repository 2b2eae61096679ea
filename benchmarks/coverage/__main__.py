"""How often intervals hold what they claim: `python -m toppling.benchmarks.coverage [--full]` prints docs/coverage.md.

Some minutes; with --full about an hour.
"""

from __future__ import annotations

import math
import sys
import time

from . import draws, goodness, levels
from .drawn import Row

PARTS = (levels, draws, goodness)
"""Modules whose `rows` make the tables."""
HEAD = """# How often intervals hold the truth

`make coverage` draws studies from known truths and counts how many of their 95 % intervals hold the truth: this page \
is its output ({kind}, {studies} studies a row at least, so that a share of 95 % is known to ±{error:.1f} %). Truths \
are lognormal, skewed to either side (Weibull, Fréchet) or of two populations; *within motions* is the correlation of \
the normal scores of two runs of one motion, 1 where a motion has one capacity. *Truth below*, *truth above*: shares \
of the intervals that lie wholly above, or below, the truth; 2.5 % each is nominal. Of goodness of fit the last column \
is the share of right curves that are rejected at 5 %.
"""


def main() -> None:
    """Print the page."""
    full = "--full" in sys.argv[1:]
    found: list[Row] = []
    began = time.perf_counter()
    for part in PARTS:
        found += part.rows(full)
        print(f"{part.__name__}: {time.perf_counter() - began:.0f} s", file=sys.stderr, flush=True)
    studies = min(row.studies for row in found)
    error = 196.0 * math.sqrt(0.95 * 0.05 / studies)
    print(HEAD.format(kind="in full" if full else "the short run", studies=studies, error=error))
    for interval in dict.fromkeys(row.interval for row in found):
        print(f"## {interval[:1].upper()}{interval[1:]}\n")
        print("| truth | motions | holds | truth below | truth above |")
        print("|---|---|---|---|---|")
        for row in (row for row in found if row.interval == interval):
            shares = (f"{100 * share:.1f} %" for share in (row.coverage, row.high, row.low))
            print(f"| {row.truth} | {row.motions} | {' | '.join(shares)} |")
        print()


if __name__ == "__main__":
    main()
