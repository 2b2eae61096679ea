"""The benchmark's truth: every run of blocks x laws x factors to 40 digits, by a method of its own.

The truth shares only the statement in `problems` with the compiled engine: its doubles, and those of the record, are
taken as exact numbers, the forcing is linear between samples, and all further arithmetic has 60 digits.

The method, and the choices that the statement leaves open, are described in `exact_motion`.

One run is at its threshold except for the rounding of its doubles (hard block, Housner's linear geometry, factor 0.2):
its peak of 3e-49 rad follows from these doubles, and a peak of 0 is right for any integrator in doubles.

Run: python -m toppling.benchmarks.truth [--out FILE] [--processes N]; needs gmpy2.
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from itertools import product
from pathlib import Path
from time import perf_counter

import numpy as np
import xarray as xr
from gmpy2 import mpfr

from .exact_motion import WORKING_DIGITS, Result, integrate
from .multiprecision import set_digits
from .problems import (
    DT,
    LAWS,
    TRUTH_BLOCKS,
    TRUTH_FACTORS,
    TRUTH_FILE,
    Problem,
    problem as problem_of,
    record as the_record,
)

DIGITS = 40
STRIDE = 20
"""Number of samples between two stored rotations."""
TWIN = "1e-13"
"""Relative change of the record in the twin run, which shows by how much a run multiplies errors."""


def run(case: tuple[Problem, float], digits: int = WORKING_DIGITS) -> tuple[str, Result, float, float]:
    """Return the peak in DIGITS digits, the run, and the changes of peak and rotation in the twin run."""
    problem, factor = case
    set_digits(digits)
    record = the_record()
    result = integrate(problem, record, mpfr(factor), digits)
    twin = integrate(problem, record, mpfr(factor) * (1 + mpfr(TWIN)), digits)
    moved = max(abs(a - b) for a, b in zip(result.rotation, twin.rotation, strict=True))
    return f"{result.peak:.{DIGITS - 1}e}", result, float(abs(result.peak - twin.peak)), float(moved)


def dataset(results: list[tuple[str, Result, float, float]]) -> xr.Dataset:
    """Return all runs as a labelled dataset."""
    dims = ("block", "law", "factor")
    shape = (len(TRUTH_BLOCKS), len(LAWS), len(TRUTH_FACTORS))
    record = the_record()
    samples = np.arange(0, record.size, STRIDE)
    rotation = np.array([[float(r.rotation[i]) for i in samples] for _, r, _, _ in results])
    twin_text = f"when the record is multiplied by 1 + {TWIN}"

    def table(values: list[object], dtype: type | str, long_name: str, units: str) -> tuple[object, ...]:
        return dims, np.array(values, dtype=dtype).reshape(shape), {"long_name": long_name, "units": units}

    peak_name = "maximum of abs(rotation) over all time, pi/2 if overturned"
    return xr.Dataset(
        {
            "record": ("time", record, {"long_name": "floor acceleration, linear between samples", "units": "m s-2"}),
            "peak": table([p for p, *_ in results], "U46", f"{peak_name}, {DIGITS} significant digits", "rad"),
            "peak_rotation": table([float(r.peak) for _, r, _, _ in results], float, peak_name, "rad"),
            "overturned": table([r.overturned for _, r, _, _ in results], bool, "abs(rotation) reaches pi/2", "1"),
            "impacts": table(
                [r.impacts for _, r, _, _ in results],
                "int64",
                "entries into the elastic zone and impacts at zero rotation during the record",
                "1",
            ),
            "rotation": (
                (*dims, "sample"),
                rotation.reshape(*shape, samples.size),
                {"long_name": "rotation, from overturning on +-pi/2", "units": "rad"},
            ),
            "twin": table([t for *_, t, _ in results], float, f"change of the peak {twin_text}", "rad"),
            "rotation_twin": table(
                [t for *_, t in results], float, f"largest change of the rotation at any sample {twin_text}", "rad"
            ),
        },
        coords={
            "block": ("block", list(TRUTH_BLOCKS), {"long_name": "block", "units": "1"}),
            "law": ("law", [law.label for law in LAWS], {"long_name": "law of damping", "units": "1"}),
            "factor": ("factor", list(TRUTH_FACTORS), {"long_name": "factor on the record", "units": "1"}),
            "sample": ("sample", samples, {"long_name": "index of the sample in the record", "units": "1"}),
            "time": ("time", np.arange(record.size) * DT, {"long_name": "time", "units": "s"}),
        },
        attrs={
            "title": "Rocking blocks under one record: the truth of the integrators' benchmark",
            "digits": DIGITS,
            "working_digits": WORKING_DIGITS,
            "method": "Taylor series in each region and sample, events to rounding, in multiple precision",
            "source": "python -m toppling.benchmarks.truth",
        },
    )


def main() -> None:
    """Integrate all runs and write them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=TRUTH_FILE)
    parser.add_argument("--processes", type=int, default=1)
    options = parser.parse_args()
    cases = [
        (problem_of(block, law), factor) for block, law, factor in product(TRUTH_BLOCKS.values(), LAWS, TRUTH_FACTORS)
    ]
    results = []
    start = perf_counter()
    with ProcessPoolExecutor(options.processes) as pool:
        for (problem, factor), result in zip(cases, pool.map(run, cases), strict=True):
            results.append(result)
            peak, _, twin, _ = result
            print(
                f"{len(results):4d}/{len(cases)} {perf_counter() - start:5.0f} s  {problem.label} "
                f"alpha={problem.alpha:g} factor={factor:g}: {peak} twin {twin:.1e}",
                flush=True,
            )
    data = dataset(results)
    encoding = {
        name: {"dtype": "S1", "zlib": True} if variable.dtype.kind == "U" else {"zlib": True}
        for name, variable in data.variables.items()
    }
    data.to_netcdf(options.out, engine="netcdf4", encoding=encoding)


if __name__ == "__main__":
    main()
