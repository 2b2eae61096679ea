"""Gain of a better measure: as measured on the first motions of an analysis, and as found by running both analyses.

`python -m toppling.benchmarks.sequential.measures [tolerance]` prints both for the generators of the databases.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Sequence

import xarray as xr

from ...fragility.analyses.adaptive import adaptive_ida
from ...models import EnergyConsistent
from ...motions.simulated.generator import Generator
from .databases import BLOCK, DATABASES

TOLERANCE = 0.03
MOST = 20_000
FIRST, OTHERS = "pga", ("pgv", "housner_intensity")


def savings(
    generator: Generator, tolerance: float = TOLERANCE
) -> Iterator[tuple[str, int, int, float, tuple[float, float, float]]]:
    """Yield other measures, motions at levels in peak acceleration and in them, and how many times fewer these are.

    Times fewer for the same half width, by both analyses, and as measured on the first motions, with its interval.
    """
    until = {"median": tolerance, "motions": {"most": MOST}}

    def run(im: str) -> tuple[xr.Dataset, int, float]:
        """Results, motions, and the square of the half width of ln(median) that one motion would give."""
        results = adaptive_ida(BLOCK, EnergyConsistent(), generator, im, until=until)
        number = int(results["motions_run"].item())
        return results, number, math.log1p(float(results["half_width"].item())) ** 2 * number

    first, motions, worth = run(FIRST)
    for measure in OTHERS:
        _, taken, reached = run(measure)
        gain = first.sel(other_measure=measure).squeeze()
        middle, low, high = (float(gain[f"measure_gain{end}"]) for end in ("", "_lower", "_upper"))
        yield measure, motions, taken, worth / reached, (middle, low, high)


def main(arguments: Sequence[str]) -> None:
    """Print the table."""
    tolerance = float(arguments[0]) if arguments else TOLERANCE
    print(f"median within ±{100.0 * tolerance:g} %: motions at levels in {FIRST} and in another measure")
    print(f"{'motions of':32s} {'other measure':18s} {FIRST:>6s} {'other':>6s}  fewer  measured on the first motions")
    for generator, _ in DATABASES.values():
        for measure, first, second, ratio, (middle, low, high) in savings(generator, tolerance):
            print(
                f"{type(generator).__name__:32s} {measure:18s} {first:6,d} {second:6,d} "
                f"{ratio:6.1f}  {middle:.1f} ({low:.1f}-{high:.1f})",
                flush=True,
            )


if __name__ == "__main__":
    main(sys.argv[1:])
