"""Coverage of intervals: `python -m toppling.benchmarks.coverage [--full]` prints docs/coverage.md.

Half an hour; with --full 1,000 studies for each truth, which takes much longer.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Iterable, Iterator

from ..pages.tables import table
from . import draws, goodness, levels, others, pieces, rates
from .drawn import Row

PARTS = (levels, rates, others, pieces, draws, goodness)
"""Modules whose `rows` are measured."""
PAGE = """# Coverage of intervals

`make coverage` draws studies from known curves and counts the 95 % intervals that contain the true value. This page \
is its output ({kind}). Each truth has at least {studies} studies, so a share of 95 % is accurate to ±{error:.1f} %.

- Truths are lognormal, skewed to either side (Weibull, Fréchet) or mixtures of two populations. *Within motions* is \
the correlation between the normal scores of two runs under one motion; it is 1 if each motion has one capacity.
- *Coverage* is the least and the greatest over the truths, in per cent, after the number of motions.
- *Least* names the truth and the number of motions of the least coverage, with the shares of its intervals that lie \
above and below the true value (nominal 2.5 %).
- *Length* is the greatest mean length over the truths, as a multiple of a normal interval that knows the deviation of \
the values, after the number of motions.
- For goodness of fit, intervals *below* are the correct curves that the test rejects at 5 %.

{table}
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
    heads = ("interval", "coverage (%)", "least", "length")
    kind = "in full" if full else "the short run"
    print(PAGE.format(kind=kind, studies=studies, error=error, table=table(heads, summary(found))), end="")


def summary(found: Iterable[Row]) -> Iterator[tuple[str, str, str, str]]:
    """Yield the extreme coverages of each interval by number of motions, its worst truth, and its lengths."""
    by_interval: dict[str, dict[int, list[Row]]] = {}
    for row in found:
        by_interval.setdefault(row.interval, {}).setdefault(row.motions, []).append(row)
    for interval, by_motions in by_interval.items():
        covered = {motions: sorted(100.0 * row.coverage for row in rows) for motions, rows in by_motions.items()}
        worst = min((row for rows in by_motions.values() for row in rows), key=lambda row: row.coverage)
        lengths = {
            motions: [row.length for row in rows if not math.isnan(row.length)] for motions, rows in by_motions.items()
        }
        missed = f"{100.0 * worst.high:.1f} above, {100.0 * worst.low:.1f} below"
        yield (
            interval[:1].upper() + interval[1:],
            "; ".join(f"{motions}: {shares[0]:.1f}–{shares[-1]:.1f}" for motions, shares in covered.items()),
            f"{worst.truth}, {worst.motions}: {missed}",
            "; ".join(f"{motions}: {max(known):.2f}" for motions, known in lengths.items() if known),
        )


if __name__ == "__main__":
    main()
