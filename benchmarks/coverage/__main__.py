"""Coverage of intervals: `python -m toppling.benchmarks.coverage [--full]` prints docs/runs/coverage.csv.

Half an hour; with --full 1,000 studies for each truth, which takes much longer.
"""

from __future__ import annotations

import csv
import math
import sys
import time
from collections.abc import Iterable, Iterator

from . import draws_of_pieces, estimates, goodness, levels, pieces, rates
from .drawn_studies import Row

PARTS = (levels, rates, estimates, pieces, draws_of_pieces, goodness)
"""Modules whose `rows` are measured."""
COLUMNS = ("interval", "motions", "lowest", "highest", "worst truth", "above", "below", "longest")
"""Columns: an interval with its number of motions; lowest and highest coverage over the truths, per cent.

The line with the lowest coverage of an interval has the truth, and the shares of intervals above and below the true
value.  longest: greatest mean length over the truths, as a multiple of a normal interval with the true deviation.
"""


def main() -> None:
    """Print the table."""
    rows: list[Row] = []
    began = time.perf_counter()
    for part in PARTS:
        rows += part.rows("--full" in sys.argv[1:])
        print(f"{part.__name__}: {time.perf_counter() - began:.0f} s", file=sys.stderr, flush=True)
    print(f"studies for each truth: {min(row.studies for row in rows)} or more", file=sys.stderr)
    csv.writer(sys.stdout, lineterminator="\n").writerows([COLUMNS, *summary(rows)])


def summary(drawn: Iterable[Row]) -> Iterator[tuple[str | int, ...]]:
    """Yield the line of each interval and number of motions."""
    by_interval: dict[str, dict[int, list[Row]]] = {}
    for row in drawn:
        by_interval.setdefault(row.interval, {}).setdefault(row.motions, []).append(row)
    for interval, by_motions in by_interval.items():
        worst = min((row for rows in by_motions.values() for row in rows), key=lambda row: row.coverage)
        missed = (worst.truth, f"{100.0 * worst.high:.1f}", f"{100.0 * worst.low:.1f}")
        for motions, rows in by_motions.items():
            covered = sorted(100.0 * row.coverage for row in rows)
            longest = max((row.length for row in rows if not math.isnan(row.length)), default=math.nan)
            yield (
                interval[:1].upper() + interval[1:],
                motions,
                f"{covered[0]:.1f}",
                f"{covered[-1]:.1f}",
                *(missed if motions == worst.motions else ("", "", "")),
                "" if math.isnan(longest) else f"{longest:.2f}",
            )


if __name__ == "__main__":
    main()
