"""Measured coverage of 95 % intervals that contain the true value less often than they should.

The values are the lowest and highest of docs/runs/coverage.csv over its truths, in per cent, by number of motions.
"""

import math
from collections.abc import Iterable, Iterator

import numpy as np
import xarray as xr

from ...core.facts import Fact
from ...fragility.runs.provenance import RUN, number_of_motions
from ..text.words import axis_of

COVERAGE: dict[str, dict[int, tuple[float, float]]] = {
    "rate": {10: (88.0, 98.9), 20: (89.2, 99.3), 40: (88.2, 99.6), 80: (85.4, 99.9), 400: (81.2, 100.0)},
    "rate, stripes": {10: (65.9, 92.5), 20: (88.6, 99.5), 40: (79.0, 99.9), 80: (73.9, 100.0), 400: (69.3, 100.0)},
    "rate, cloud": {40: (85.5, 97.0), 80: (81.2, 97.1), 400: (24.5, 95.4)},
    "rate, isotonic": {10: (73.9, 95.0), 20: (78.0, 96.3), 40: (84.2, 95.8), 80: (84.4, 96.3), 400: (88.1, 94.1)},
    "rate, uplift-lognormal": {10: (91.1, 94.5), 20: (93.2, 96.2), 80: (95.0, 96.3)},
    "dispersion": {
        **{10: (82.9, 98.5), 20: (87.6, 98.0), 40: (91.4, 96.9), 100: (93.0, 97.2), 200: (96.0, 96.3)},
        400: (93.9, 96.4),
    },
    "fraction": {
        **{10: (96.9, 100.0), 20: (95.5, 100.0), 40: (95.5, 100.0), 100: (94.3, 100.0), 200: (94.8, 100.0)},
        400: (90.3, 100.0),
    },
    "fraction, cloud": {10: (80.0, 97.1), 20: (85.5, 99.4), 40: (88.0, 99.1), 100: (90.8, 98.0), 400: (92.4, 97.4)},
    "half level, far apart": {
        **{10: (99.3, 100.0), 20: (97.3, 99.8), 40: (97.0, 100.0), 100: (94.1, 100.0), 200: (90.8, 100.0)},
        400: (83.4, 100.0),
    },
    "measure": {10: (77.9, 77.9), 20: (89.6, 89.6), 80: (94.3, 94.3), 400: (96.3, 96.3)},
    "size": {10: (95.6, 97.4), 20: (93.8, 95.6), 40: (91.1, 95.3), 80: (86.9, 94.4), 400: (58.4, 93.9)},
    "total": {10: (84.9, 97.2), 20: (89.7, 97.0), 40: (88.9, 97.4), 80: (90.5, 96.7), 400: (93.5, 96.3)},
    "saving": {10: (82.4, 95.2), 20: (82.4, 94.8), 40: (84.6, 96.8), 80: (87.6, 96.2), 400: (91.7, 95.9)},
    "kit": {20: (90.7, 93.0), 80: (93.8, 94.9), 400: (92.3, 95.2)},
    "number": {20: (91.1, 100.0), 60: (93.9, 96.3)},
    "ratio of medians": {10: (90.2, 90.2), 20: (93.5, 93.5), 40: (93.3, 93.3), 80: (94.7, 94.7), 400: (93.6, 93.6)},
    "ratio of totals": {10: (87.9, 90.6), 20: (90.7, 93.2), 40: (90.9, 94.2), 80: (92.4, 95.4), 400: (93.9, 95.2)},
}
ENOUGH = 93.0
"""Minimum coverage of an interval that needs no remark, in per cent."""
FAR_APART = 1.5
"""Dispersions between two levels from which on they are far apart (measured: 1.9)."""


def coverage(kinds: Iterable[str], motions: int) -> Iterator[Fact]:
    """Yield the coverage of these kinds of intervals, if it is too low at a measured number of motions near theirs.

    The nearest smaller number counts, and the nearest larger one if the smaller has enough.
    """
    short = []
    for kind in kinds:
        measured = COVERAGE[kind]
        smaller = max((tested for tested in measured if tested <= motions), default=min(measured))
        larger = min((tested for tested in measured if tested >= motions), default=smaller)
        number = next((tested for tested in (smaller, larger) if measured[tested][0] < ENOUGH), None)
        if number is not None:
            short.append((kind, number, *measured[number]))
    if short:
        kinds, numbers, *ends = zip(*short, strict=True)
        more = {"motions": sorted(set(numbers)), "parts": list(zip(kinds, *ends, strict=True))}
        yield Fact("precision.coverage", names=kinds, more=more)


def coverage_in(results: xr.Dataset) -> Iterator[Fact]:
    """Yield the coverage of the intervals of results, if it is too low."""
    if "confidence" in results.attrs and "motion" in results.dims:
        # (each floor and each stripe has motions of its own)
        dims = ("floor", "level") if results.attrs.get("design") == "stripes" else ("floor",)
        sets = math.prod(results.sizes.get(dim, 1) for dim in dims)
        yield from coverage(_kinds(results), number_of_motions(results) // max(1, sets))


def _kinds(results: xr.Dataset) -> list[str]:
    """Return the kinds of intervals in results; none of adaptive analyses, whose promises are measured elsewhere."""
    if RUN in results.dims:
        return []
    form, design = (str(results.attrs.get(name, "")) for name in ("form", "design"))
    by = [part for part in (form, design) if f"rate, {part}" in COVERAGE][:1]
    there = {
        **({} if "place" in results.dims else {", ".join(["rate", *by]): "rate_lower"}),
        "dispersion": "dispersion_lower",
        "ratio of medians": "median_ratio_lower",
        "fraction, cloud" if design == "cloud" else "fraction": "fraction_level_lower",
        "measure": "measure_amplitude_dispersion_lower",
        **({"half level, far apart": "half_level_lower"} if _far_apart(results) else {}),
        "size": "size_status",
        "total": "any_probability_lower",
        "number": "number_rate_lower",
        "saving": "ranked_saving_lower",
        "kit": "kit_share_saved_lower",
    }
    return [kind for kind, name in there.items() if name in results]


def _far_apart(results: xr.Dataset) -> bool:
    """Return True if neighbouring levels of a study are far apart; a cloud has none."""
    levels = np.unique(axis_of(results).values)
    if results.attrs.get("design") == "cloud" or levels.size < 2 or "dispersion" not in results:
        return False
    return bool(np.diff(np.log(levels)).max() > FAR_APART * float(results["dispersion"].min()))
