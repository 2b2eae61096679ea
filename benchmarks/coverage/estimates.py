"""Coverage of observed probabilities, of rates of uplift curves, of Sobol' indices and of ranked dispersions."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import xarray as xr

from ...core.streams import stream
from ...fragility import RandomInputs, Uniform, overturning_probability, rank_measures, sobol_indices
from ..sequential.truths import DISPERSION, MEDIAN, Truth
from .drawn_studies import LOGNORMAL, Row, ida, row_of
from .rates import of_runs

UPLIFT = 0.5 * MEDIAN
"""Level below which no run uplifts."""


def rows(full: bool) -> Iterator[Row]:
    """Yield the rows of the table."""
    studies = 1000 if full else 200
    for motions in (10, 20, 80, 400):
        yield from _of_shares(motions, 10 * studies)
        yield from _of_dispersions(motions, studies)
    for motions in (10, 20, 80):
        for correlation in (0.5, 1.0):
            drawn, known = uplifting(replace(LOGNORMAL, correlation=correlation), motions, studies)
            yield from of_runs(drawn, known, motions, "annual rate of uplift curves", form="uplift-lognormal")
    for samples in (64, 256, 1024):
        yield from _of_indices(samples, studies)


def uplifting(truth: Truth, motions: int, studies: int) -> tuple[xr.Dataset, Truth]:
    """Draw analyses of blocks that do not uplift below a level, and return them with their truth."""
    drawn = ida(truth, studies, motions, motions)
    rocks = (drawn["level"] >= UPLIFT).broadcast_like(drawn["overturned"])
    known = replace(truth, probability=lambda x: truth.probability(x) * (x >= math.log(UPLIFT)))
    return drawn.assign(overturned=drawn["overturned"] & rocks, uplifted=rocks), known


def _of_shares(motions: int, studies: int) -> Iterator[Row]:
    for true in (0.02, 0.1, 0.5):
        fell = stream(motions, 7).random((studies, 1, motions)) < true
        runs = xr.Dataset({"overturned": (("block", "level", "motion"), fell)}, coords={"level": [1.0]})
        shares = overturning_probability(runs)
        lower, upper = (shares[end].values[:, 0] for end in ("lower", "upper"))
        yield row_of("observed probability at a level", f"{100 * true:g} %", motions, (lower, upper), true)


def _of_dispersions(motions: int, studies: int) -> Iterator[Row]:
    drawn = ida(replace(LOGNORMAL, correlation=1.0), studies, motions, motions)
    runs = drawn.rename(study="block").expand_dims("model").assign_coords(pga=("motion", np.ones(motions)))
    ranking = rank_measures(runs, replicates=200)
    lower, upper = (ranking[f"dispersion_{end}"].values.ravel() for end in ("lower", "upper"))
    yield row_of("dispersion of capacities in a measure", "lognormal", motions, (lower, upper), DISPERSION)


def _of_indices(samples: int, studies: int) -> Iterator[Row]:
    """Yield rows of the g-function of Sobol', whose indices have closed forms (Saltelli et al. 2010)."""
    factors = np.array([0.0, 1.0, 9.0])
    variances = 1.0 / (3.0 * (1.0 + factors) ** 2)
    total = np.prod(1.0 + variances) - 1.0
    true = {"first": variances / total, "total": variances * np.prod(1.0 + variances) / (1.0 + variances) / total}
    inputs = RandomInputs({name: Uniform(0.0, 1.0) for name in "abc"})

    def function(at: xr.Dataset) -> xr.DataArray:
        product = xr.ones_like(at["a"])
        for name, factor in zip("abc", factors, strict=True):
            product = product * (abs(4.0 * at[name] - 2.0) + factor) / (1.0 + factor)
        return product

    indices = [sobol_indices(inputs, function, samples, replicates=100, seed=seed) for seed in range(studies)]
    for name, values in true.items():
        for i, value in enumerate(values):
            lower, upper = (
                np.array([float(index[f"{name}_{end}"].values[i]) for index in indices]) for end in ("lower", "upper")
            )
            yield row_of(
                f"Sobol' index, {name}, by base samples", f"{value:.3f}", samples, (lower, upper), float(value)
            )
