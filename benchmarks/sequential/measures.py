"""Gain of a better measure: as measured on the first motions of an analysis, and as found by running both analyses.

`python -m toppling.benchmarks.sequential.measures [tolerance]` prints both for the generators of the databases.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import xarray as xr

from ...fragility.analyses.ida import ida
from ...models import EnergyConsistent
from ...motions.simulated.generator import Generator
from .databases import BLOCK, DATABASES

TOLERANCE = 0.03
MOST = 20_000
FIRST, OTHERS = "pga", ("pgv", "housner_intensity")


class Saving(NamedTuple):
    """Motions that both measures took, and how many times fewer the second one takes for the same half width.

    measured: from the first motions of the analysis in the first measure, with its interval; found: by both analyses.
    """

    other: str
    motions: tuple[int, int]
    measured: tuple[float, float, float]
    found: float


def savings(generator: Generator, tolerance: float = TOLERANCE) -> Iterator[Saving]:
    """Yield what levels in other measures save of the motions that levels in peak acceleration take."""
    until = {"median": tolerance, "motions": {"most": MOST}}

    def run(im: str) -> tuple[xr.Dataset, int, float]:
        """Results, motions, and the square of the half width of ln(median) that one motion would give."""
        results = ida(BLOCK, EnergyConsistent(), generator, "adaptive", im, until=until)
        number = int(results["motions_run"].item())
        return results, number, math.log1p(float(results["half_width"].item())) ** 2 * number

    first, motions, worth = run(FIRST)
    for other in OTHERS:
        _, taken, reached = run(other)
        gain = first.sel(other_measure=other).squeeze()
        middle, low, high = (float(gain[f"measure_gain{end}"]) for end in ("", "_lower", "_upper"))
        yield Saving(other, (motions, taken), (middle, low, high), worth / reached)


def main(arguments: Sequence[str]) -> None:
    """Print the table."""
    tolerance = float(arguments[0]) if arguments else TOLERANCE
    print(f"median within ±{100.0 * tolerance:g} %: motions at levels in {FIRST} and in another measure")
    print(f"{'motions of':32s} {'other measure':18s} {FIRST:>6s} {'other':>6s}  fewer  measured on the first motions")
    for generator, _ in DATABASES.values():
        for saving in savings(generator, tolerance):
            first, second = saving.motions
            middle, low, high = saving.measured
            print(
                f"{type(generator).__name__:32s} {saving.other:18s} {first:6,d} {second:6,d} "
                f"{saving.found:6.1f}  {middle:.1f} ({low:.1f}-{high:.1f})",
                flush=True,
            )


if __name__ == "__main__":
    main(sys.argv[1:])
