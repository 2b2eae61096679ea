"""Gain of a better measure: as measured on the first motions of an analysis, and as found by running both analyses.

`python -m toppling.benchmarks.sequential.measures [tolerance]` prints both for the generators of the databases.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
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


def savings(generator: Generator, tolerance: float = TOLERANCE) -> list[Saving]:
    """Return what levels in other measures save of the motions that levels in peak acceleration take."""
    first = _run(generator, FIRST, tolerance)
    known = [str(one) for one in first["other_measure"].values]
    found = []
    for other in OTHERS:
        second = _run(generator, other, tolerance)
        at = known.index(other)
        low, middle, high = (float(first[f"measure_gain{end}"].values[0, 0, at]) for end in ("_lower", "", "_upper"))
        counts = _motions(first), _motions(second)
        found.append(Saving(other, counts, (middle, low, high), _worth(first) / _worth(second)))
    return found


def _run(generator: Generator, im: str, tolerance: float) -> xr.Dataset:
    until = {"median": tolerance, "motions": {"most": MOST}}
    return ida(BLOCK, EnergyConsistent(), generator, "adaptive", im, until=until)


def _motions(found: xr.Dataset) -> int:
    return int(found["motions_run"].item())


def _worth(found: xr.Dataset) -> float:
    """Return the square of the half width of ln(median) that one motion would give."""
    return math.log1p(float(found["half_width"].item())) ** 2 * _motions(found)


def main(arguments: Sequence[str]) -> None:
    """Print the table."""
    tolerance = float(arguments[0]) if arguments else TOLERANCE
    print(f"median within ±{100.0 * tolerance:g} %: motions at levels in {FIRST} and in another measure")
    print(f"{'motions of':32s} {'other measure':18s} {FIRST:>6s} {'other':>6s}  fewer  measured on the first motions")
    for generator, _ in DATABASES.values():
        for one in savings(generator, tolerance):
            middle, low, high = one.measured
            print(
                f"{type(generator).__name__:32s} {one.other:18s} {one.motions[0]:6,d} {one.motions[1]:6,d} "
                f"{one.found:6.1f}  {middle:.1f} ({low:.1f}-{high:.1f})",
                flush=True,
            )


if __name__ == "__main__":
    main(sys.argv[1:])
