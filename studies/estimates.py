"""What a study makes of its runs: probabilities and curves, what a year brings, and which measure serves best."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from ..fragility import (
    HazardCurve,
    annual_rate,
    fit_fragility,
    overturning_probability,
    rank_measures,
    size_for_rate,
)
from ..fragility.states import OVERTURNED, UPLIFTED, State

# In results these stand beside the probabilities and shares of others.
RISK_NAMES = {
    "probability": "risk_probability",
    "probability_lower": "risk_probability_lower",
    "probability_upper": "risk_probability_upper",
    "share": "rate_share",
    "share_below": "rate_share_below",
    "share_above": "rate_share_above",
}
RANK = "measure_"
"""What the ranking of measures is called after, beside the other variables."""


@dataclass(frozen=True)
class Fit:
    """How curves are fitted: the options of `toppling.fit_fragility`."""

    form: str = "lognormal"
    method: str = "binomial"
    intervals: str | None = None
    fractiles: tuple[float, ...] = ()
    penalty: str = "auto"
    replicates: int = 1000
    seed: int = 0
    state: State = OVERTURNED
    confidence: float = 0.95

    @property
    def outputs(self) -> tuple[str, ...]:
        """What it needs of the runs."""
        uplift = self.form == "uplift-lognormal" or self.state == UPLIFTED
        return ("overturned", "peak_rotation", *(["uplifted"] if uplift else []))

    def curves(self, runs: xr.Dataset, replicates: bool) -> xr.Dataset:
        """Curves of runs, with their replicates where these are wanted."""
        return fit_fragility(
            runs,
            self.confidence,
            form=self.form,
            method=self.method,
            intervals=self.intervals,
            fractiles=self.fractiles,
            penalty=self.penalty,
            replicates=self.replicates,
            seed=self.seed,
            keep_replicates=replicates,
            state=self.state,
        )

    def probabilities(self, runs: xr.Dataset) -> xr.Dataset:
        """Observed probabilities of runs that have levels."""
        return overturning_probability(runs, self.confidence, self.state)


@dataclass(frozen=True)
class Risk:
    """A hazard curve and what is asked with it: `target` is a probability in `years`, to be met by a size `along`."""

    hazard: HazardCurve
    years: float
    below: str
    above: str
    target: float | None = None
    along: str | None = None

    def of(self, curves: xr.Dataset, confidence: float) -> xr.Dataset:
        """Rates of curves, and the size that meets the target, under the names that they have in results."""
        # (a curve without parameters is taken for the highest that it can be beyond its levels: the safe side)
        rates = annual_rate(
            curves,
            self.hazard,
            self.years,
            below=self.below,
            above=self.above,
            outside="most",
            confidence=confidence,
        )
        found = rates.drop_vars("rate_sample", errors="ignore").rename(
            {old: new for old, new in RISK_NAMES.items() if old in rates}
        )
        if self.along is None:
            return found
        size = size_for_rate(rates, self.along, probability=self.target, years=self.years, confidence=confidence)
        names = {str(name): f"size_{name}" for name in size.data_vars}
        return found.merge(size.rename(names), compat="override").assign_attrs(
            found.attrs, size_along=self.along, size_probability=self.target
        )


def risk_of(results: xr.Dataset) -> xr.Dataset:
    """The rates that stand in a study's results, under the names that `toppling.annual_rate` gives them."""
    own = results.drop_vars([name for name in RISK_NAMES if name in results])
    return own.rename({new: old for old, new in RISK_NAMES.items() if new in own})


def ranked(runs: xr.Dataset, motions: Any, also: tuple[str, ...], state: State) -> xr.Dataset:
    """The ranking of measures, under the names that it has in results."""
    found = rank_measures(runs, motions, also, state=state)
    said = {name: value for name, value in found.attrs.items() if name not in runs.attrs}
    renamed = found.rename({str(name): f"{RANK}{name}" for name in found.data_vars})
    return renamed.assign_attrs(ranking=json.dumps(said, default=str))


def ranking_of_measures(results: xr.Dataset) -> xr.Dataset:
    """The ranking that stands in a study's results, as `rank_measures` returns it."""
    own = [str(name) for name in results.data_vars if str(name).startswith(RANK)]
    found = results[own].rename({name: name.removeprefix(RANK) for name in own})
    return found.assign_attrs(json.loads(results.attrs["ranking"]))


def middle_level(probability: xr.DataArray) -> int:
    """The level at which a probability, averaged over all else, is nearest to one half."""
    rest = [dim for dim in probability.dims if dim != "level"]
    return int(np.abs(probability.mean(rest).values - 0.5).argmin())
