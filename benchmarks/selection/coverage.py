"""How often the interval of a rate from selected stripes holds the rate that is known.

`python -m toppling.benchmarks.selection.coverage [sites] [processes]` prints the table.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.optimize import brentq

from ...core.aliases import Array, Index
from ...core.streams import stream
from ...fragility import HazardCurve, annual_rate, fit_fragility
from ...motions import Mixture
from ...motions.selection.choosing import Problem, choose
from .worlds import AT, GIVEN, MEASURES, Pool, Site, pool, site

SITES = 1000
PROCESSES = 2
RETURN_PERIODS = (30.0, 30_000.0)
"""Of the lowest and the highest stripe, years."""
LEAST_OF_ALL = 1.3
"""The lowest stripe is exceeded in no more than one of so many earthquakes."""
STRIPES, NUMBER = 8, 40
REPLICATES = 300
FACTORS = (0.25, 4.0)
MEDIAN_OFF, SCATTER = np.log(1.1), (0.8, 1.25)
CHOICES = ("ideal", "selected", "any")
"""Motions drawn from the site's own distribution at the level, selected for it, and any that reach the level."""


class Estimate(NamedTuple):
    """A rate over the known one, with its interval."""

    ratio: float
    lower: float
    upper: float

    @property
    def holds(self) -> bool:
        """Whether the interval holds the known rate."""
        return self.lower <= 1.0 <= self.upper


def estimates(seed: int) -> dict[str, Estimate | None]:
    """Return the rates of one site: from motions selected for it, and from any that reach the level; None without."""
    rng = stream(seed, 0)
    place, candidates = site(rng), pool(rng)
    levels = _levels(place)
    grid = np.geomspace(levels[0] / 20.0, levels[-1] * 20.0, 160)
    hazard = HazardCurve(grid.tolist(), place.exceeded(grid).tolist(), GIVEN)
    return {choice: _estimate(place, candidates, levels, hazard, choice, rng) for choice in CHOICES}


def _levels(place: Site) -> Array:
    least = max(RETURN_PERIODS[0], LEAST_OF_ALL / place.rates.sum())

    def exceeded_once_in(years: float) -> float:
        level: float = brentq(lambda x: float(np.log(place.exceeded(np.array(np.exp(x))) * years)), -12.0, 8.0)
        return level

    return np.exp(np.linspace(exceeded_once_in(least), exceeded_once_in(RETURN_PERIODS[1]), STRIPES))


def _estimate(
    place: Site, candidates: Pool, levels: Array, hazard: HazardCurve, choice: str, rng: np.random.Generator
) -> Estimate | None:
    fell, at, which = [], [], []
    for i, level in enumerate(levels.tolist()):
        if choice == "ideal":
            drawn = place.motions(level, NUMBER, rng)
            fell.append(drawn.falls(np.ones(NUMBER), place.capacity))
            at.append(np.full(NUMBER, level))
            which.append(i * NUMBER + np.arange(NUMBER))
            continue
        factors = level / np.exp(candidates.values[:, AT])
        allowed = np.flatnonzero((factors >= FACTORS[0]) & (factors <= FACTORS[1]))
        if allowed.size < 2 * NUMBER:
            continue
        chosen = _chosen(place, candidates, level, allowed, factors, rng) if choice == "selected" else None
        if choice == "any":
            chosen = rng.choice(allowed, NUMBER, replace=False)
        if chosen is None:
            continue
        fell.append(candidates.falls(factors, place.capacity)[chosen])
        at.append(np.full(NUMBER, level))
        which.append(chosen)
    if not fell:
        return None
    curve = fit_fragility(
        _runs(np.concatenate(fell), np.concatenate(at), np.concatenate(which)),
        replicates=REPLICATES,
        intervals="bootstrap",
        keep_replicates=True,
    )
    rates = annual_rate(curve, hazard)
    if not np.isfinite(rates["rate"].item()):
        return None
    ratio, lower, upper = (float(rates[name].item()) / place.rate for name in ("rate", "rate_lower", "rate_upper"))
    return Estimate(ratio, lower, upper)


def _chosen(
    place: Site, candidates: Pool, level: float, allowed: Index, factors: Array, rng: np.random.Generator
) -> Index | None:
    """Return the choice for a stripe as `motions.select` makes it, None outside its gate."""
    wanted = Mixture(place.ruptures, place.shares(level)).at(level)
    scale = np.array([name != "d5_95" for name in MEASURES])
    values = (candidates.values + np.log(factors)[:, None] * scale)[allowed] - wanted.mean
    problem = Problem(values, wanted.sigmas, np.ones(len(MEASURES)), np.arange(allowed.size), 1)
    indices = choose(problem, wanted.covariance, NUMBER, rng)
    free = wanted.sigmas > 0.0
    mean = values[indices].mean(axis=0)
    scatter = values[indices].std(axis=0, ddof=1)[free] / wanted.sigmas[free]
    if np.abs(mean).max() > MEDIAN_OFF or scatter.min() < SCATTER[0] or scatter.max() > SCATTER[1]:
        return None
    return np.asarray(allowed[indices])


def _runs(fell: Array, at: Array, which: Index) -> xr.Dataset:
    """Return stripes as `stripes` does: the motions of one record are one cluster."""
    return xr.Dataset(
        {"overturned": ("motion", fell, {"units": "1"})},
        {
            "intensity": ("motion", at, {"units": "m s-2", "im": GIVEN}),
            "record": ("motion", np.array([f"candidate {i}" for i in which.tolist()], dtype=object)),
        },
        {"design": "stripes"},
    )


class Row(NamedTuple):
    """A choice of motions over all sites: share of intervals that hold the rate, bias and scatter of ln(ratio)."""

    choice: str
    sites: int
    holds: float
    bias: float
    scatter: float


def coverage(sites: int, processes: int = PROCESSES) -> list[Row]:
    """Return a row for each choice."""
    with ProcessPoolExecutor(processes) as workers:
        every = list(workers.map(estimates, range(sites), chunksize=4))
    rows = []
    for choice in CHOICES:
        known = [rate for rate in (of_site[choice] for of_site in every) if rate is not None]
        off = np.log([rate.ratio for rate in known])
        held = float(np.mean([rate.holds for rate in known]))
        rows.append(Row(choice, len(known), held, float(off.mean()), float(off.std(ddof=1))))
    return rows


def main(arguments: Sequence[str]) -> None:
    """Print the table."""
    sites, processes = (*map(int, arguments), *(SITES, PROCESSES)[len(arguments) :])
    print(f"{'motions':10s} {'sites':>6s} {'held':>6s} {'bias':>7s} {'sd':>6s}")
    for row in coverage(sites, processes):
        print(f"{row.choice:10s} {row.sites:6d} {row.holds:6.3f} {row.bias:+7.3f} {row.scatter:6.3f}")


if __name__ == "__main__":
    main(sys.argv[1:])
