"""Coverage of intervals: `python -m toppling.benchmarks.coverage [--full]` prints docs/coverage.md.

Seven minutes; with --full 1,000 studies per row, which takes much longer.
"""

from __future__ import annotations

import math
import sys
import time

from . import draws, goodness, levels, others, rates
from .drawn import Row

PARTS = (levels, rates, others, draws, goodness)
"""Modules whose `rows` make the tables."""
HEAD = """# Coverage of intervals

`make coverage` draws studies from known curves and counts the 95 % intervals that contain the true value. This page \
is its output ({kind}). Each row has at least {studies} studies, so a share of 95 % is accurate to ±{error:.1f} %.

- Curves are lognormal, skewed to either side (Weibull, Fréchet) or mixtures of two populations. *Within motions* is \
the correlation between the normal scores of two runs under one motion; it is 1 if each motion has one capacity.
- *True value below* and *above* are shares of intervals that lie entirely above or below the true value (nominal \
2.5 %).
- *Length* is the mean length over that of a normal interval with the true standard deviation.
- For goodness of fit, *true value above* is the share of correct curves that the test rejects at 5 %.
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
        print("| truth | motions | coverage | true value below | true value above | length |")
        print("|---|---|---|---|---|---|")
        for row in (row for row in found if row.interval == interval):
            shares = (f"{100 * share:.1f} %" for share in (row.coverage, row.high, row.low))
            length = "–" if math.isnan(row.length) else f"{row.length:.2f}"
            print(f"| {row.truth} | {row.motions} | {' | '.join(shares)} | {length} |")
        print()


if __name__ == "__main__":
    main()
