"""Annual rates of a study's curves: the hazard curve and the questions that a study asks with it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from ...core.aliases import Array
from ...core.facts import Fact
from ...core.units import DIMENSIONLESS, PER_YEAR, described
from ...fragility import HazardCurve, annual_rate, curve_probability, rate_share_above, size_for_rate
from ...fragility.curves.curve import LEAST
from ...fragility.fitting.labels import OBSERVED
from ...fragility.fitting.states import OVERTURNED, State, state_name
from ...fragility.hazard.pieces import EXTEND, HOLD
from ...fragility.hazard.poisson import probability_in
from ...fragility.numerics.slabs import gathered
from ...fragility.risk.annual_rate import rates_alone
from ...fragility.risk.common_measure import per_block
from ...fragility.risk.modelling import capacity_factors, seen_by, with_ends
from ...fragility.runs.scaling import BLOCK_MEASURES
from ...motions.intensity.naming import FLOOR, GROUND_FLOORS
from ..text.curve_notes import AT_HIGHEST, BEYOND, EXCEEDED, LEFT_OUT, SETTLED, UNDER, family_notes, rate_notes, verb_of
from ..text.reached import levels_run, other_levels

if TYPE_CHECKING:
    from .designs import Design

# The names in the results, where other variables have the plain names.
RISK_NAMES = {
    "probability": "risk_probability",
    "probability_lower": "risk_probability_lower",
    "probability_upper": "risk_probability_upper",
    "share": "rate_share",
    "share_below": "rate_share_below",
    "share_above": "rate_share_above",
}
OUTSIDE = "most"
"""A curve without parameters is taken beyond its levels as high as it can be, which is conservative."""


@dataclass(frozen=True)
class Risk:
    """A hazard curve and its questions: a size `along` is sought that meets the probability `target` in `years`."""

    hazard: HazardCurve
    years: float
    below: str
    above: str
    target: float | None = None
    along: str | None = None

    def check(self, design: Design, file_of_floors: bool = False) -> None:
        """Check that hazard curve and levels are of one place; `file_of_floors`: ground motions are not known."""
        floors = design.floors
        upper = [floor for floor in floors if floor not in GROUND_FLOORS]
        if self.hazard.at == FLOOR:
            if design.below:
                raise ValueError(
                    f"hazard.at 'floor' does not go with {design.name}.im_at 'ground': the levels are of the ground's "
                    "motion, so the hazard must be, too"
                )
            if not floors:
                raise ValueError(
                    "hazard.at 'floor' needs motions of a floor (a building, motions.floors_file): these motions are "
                    "of the ground"
                )
            if len(floors) > 1:
                raise ValueError(f"hazard.at 'floor' is for blocks on one floor, got floors {', '.join(floors)}")
        elif upper and not design.below:
            cure = "" if file_of_floors else f"set {design.name}.im_at = 'ground', or "
            raise ValueError(
                f"the hazard is of the ground and the levels are of the motion of floor {', '.join(upper)}: {cure}give "
                "that floor's own hazard with hazard.at = 'floor'"
            )

    def of(
        self,
        curves: xr.Dataset,
        confidence: float,
        highest: xr.DataArray | float,
        state: State = OVERTURNED,
        telling: Callable[[str, int, int], None] | None = None,
        *,
        lowest: xr.DataArray | float,
    ) -> xr.Dataset:
        """Compute the rates of curves, and the size that meets the target, under the names that they have in results.

        `highest` and `lowest` are the ends of the levels of the runs, in the measure of the curves, SI.
        """
        rates = self._slab_by_slab(curves, confidence, telling)
        results = rates.drop_vars("rate_sample", errors="ignore").rename(
            {old: new for old, new in RISK_NAMES.items() if old in rates}
        )
        dims = rates["rate"].dims
        of_levels = {
            UNDER: (1.0 - self._beyond(curves, lowest), "share of the rate from shaking below the lowest that was run"),
            BEYOND: (self._beyond(curves, highest), "share of the rate from shaking above the highest that was run"),
            AT_HIGHEST: (
                _at_level(without_replicates(curves), highest),
                "probability of overturning, of the curve, at the highest shaking that was run",
            ),
        }
        if (self.below, self.above) != (EXTEND, EXTEND):
            text = "share of the rate of an extended hazard curve that is left out beyond the curve's ends"
            of_levels[LEFT_OUT] = (self._left_out(curves, rates["rate"]), text)
        rare = self.hazard.rate_at(_levels_of(curves, highest), self.below, self.above)
        above = xr.zeros_like(rates["rate"]) + xr.DataArray(rare, dims=["block"] * np.ndim(rare))
        text = "annual rate of shaking above the highest that was run"
        results = results.assign({EXCEEDED: (dims, above.transpose(*dims).values, described(text, PER_YEAR))})
        results = results.assign(
            {
                name: (dims, level.transpose(*dims).values.clip(0.0, 1.0), described(text))
                for name, (level, text) in of_levels.items()
            }
        )
        if self.along is not None:
            results = results.merge(self.size_of(rates, confidence), compat="override").assign_attrs(
                results.attrs, size_along=self.along, size_probability=self.target
            )
        return worded(results, state_name(state))

    def size_of(self, rates: xr.Dataset, confidence: float) -> xr.Dataset:
        """Return the size `along` that meets the target, under the names that it has in results."""
        assert self.along is not None
        size = size_for_rate(rates, self.along, probability=self.target, years=self.years, confidence=confidence)
        return size.rename({str(name): f"size_{name}" for name in size.data_vars})

    def notes(
        self, rates: xr.Dataset, curves: xr.Dataset, highest: xr.DataArray | float, study: Mapping[str, Any]
    ) -> list[Fact]:
        """Return notes on rates from beyond the hazard curve or beyond the runs of a study."""
        run = levels_run(curves)[0], float(np.max(highest))
        ends = next((end for key, end in (("ida", "level"), ("stripes", "stripe")) if key in study), "motion")
        cures = other_levels(study, False, run), other_levels(study, True, run)
        facts = [] if self.along is None else family_notes(curves, self.along)
        settled = _at_level(without_replicates(curves), highest)
        known = float(self.hazard.levels[0]), float(self.hazard.levels[-1])
        return facts + rate_notes(rates, settled, known, cures, ends, self.hazard.of_formula)

    def beyond(self, curves: xr.Dataset, highest: xr.DataArray | float) -> xr.DataArray:
        """Return the largest share of each rate outside the hazard curve, or above `highest` unless known there."""
        plain = without_replicates(curves)
        rates = self.rates(plain, 0.9)
        settled = _at_level(plain, highest)
        extrapolated = self._beyond(plain, highest).where(settled < SETTLED, 0.0)
        shares = xr.concat([rates["share_below"], rates["share_above"], extrapolated], "part", coords="minimal")
        return shares.max("part").fillna(0.0)

    def rates(self, curves: xr.Dataset, confidence: float, outside: str = OUTSIDE) -> xr.Dataset:
        """Compute the rates of curves under the names of `annual_rate`; NaN if the rule MOST gives an infinite rate."""

        def under(rule: str) -> xr.Dataset:
            rules = {"below": self.below, "above": self.above, "outside": rule}
            return annual_rate(curves, self.hazard, self.years, confidence=confidence, **rules)

        rates = under(outside)
        known = ~np.isinf(rates["rate"])
        if known.all():
            return rates
        least = under(LEAST)
        for name in ("rate", "probability"):
            rates[name] = rates[name].where(known)
            if f"{name}_lower" in rates:
                rates[f"{name}_lower"] = rates[f"{name}_lower"].where(known, least[f"{name}_lower"])
        return rates

    def modelling_range(
        self, curves: xr.Dataset, modelling: float, rate: Array | None = None
    ) -> dict[str, xr.Variable]:
        """Return the ends of rates and chances if all capacities are wrong by the same factor (`with_ends`).

        `rate`: the results' rate if the runs correct the curves' own; the ends are corrected by the same factor.
        """
        rules = self.below, self.above, OUTSIDE
        ends = [rates_alone(curves, seen_by(self.hazard, factor), *rules) for factor in capacity_factors(modelling)]
        (dims, *_), rates = zip(*((dims, bounded(rates)) for dims, rates in ends), strict=True)
        if rate is not None:
            unshifted = rates_alone(curves, self.hazard, *rules)[1]
            factor = np.divide(rate, unshifted, out=np.ones(unshifted.shape), where=unshifted > 0.0)
            rates = tuple(factor * end for end in rates)
        chances = [probability_in(rate, self.years) for rate in rates]
        return {
            **with_ends("rate", dims, rates, PER_YEAR, modelling),
            **with_ends(RISK_NAMES["probability"], dims, chances, DIMENSIONLESS, modelling),
        }

    def _slab_by_slab(
        self, curves: xr.Dataset, confidence: float, telling: Callable[[str, int, int], None] | None
    ) -> xr.Dataset:
        """Compute the rates of curves; rates of the many replicates are kept only if a size is requested."""
        done = 0

        def of(part: xr.Dataset) -> xr.Dataset:
            nonlocal done
            rates = self.rates(part, confidence)
            done += part.sizes.get("block", 1)
            if telling is not None:
                telling("rates", done, curves.sizes.get("block", 1))
            return rates if self.along is not None else rates.drop_vars("rate_sample", errors="ignore")

        if "block" not in curves.dims:
            return of(curves)
        of_one = math.prod(curves.sizes.get(dim, 1) for dim in ("model", "floor", "replicate"))
        sizes = {"block": curves.sizes["block"], "sample": of_one * len(self.hazard.weights or (1.0,))}
        return gathered(of, curves, ("block",), sizes)

    def _left_out(self, curves: xr.Dataset, rate: xr.DataArray) -> xr.DataArray:
        """Return the share of the rate of an extended hazard curve that is missing in a rate by the study's rules."""
        extended = replace(self, below=EXTEND, above=EXTEND)
        try:
            whole = extended.rates(without_replicates(curves), 0.9)["rate"]
        except ValueError:  # a curve whose last two rates are equal has no slope for its extension
            whole = replace(extended, above=HOLD).rates(without_replicates(curves), 0.9)["rate"]
        return (1.0 - rate / whole.where(whole > 0.0)).where(np.isfinite(rate))

    def _beyond(self, curves: xr.Dataset, highest: xr.DataArray | float) -> xr.DataArray:
        """The share of each rate from motions above the highest level of the runs."""
        rules = {"below": self.below, "above": self.above, "outside": OUTSIDE}
        return rate_share_above(curves, self.hazard, _levels_of(curves, highest), **rules)


def _levels_of(curves: xr.Dataset, level: xr.DataArray | float) -> xr.DataArray | float:
    """Return a level of the curves' measure as one of the hazard's, on block if it is another for every block."""
    im = str(curves.attrs["im"])
    return level / per_block(curves, im) if im in BLOCK_MEASURES else level


def without_replicates(curves: xr.Dataset) -> xr.Dataset:
    """Curves as results contain them: without their replicates, and without the shares of their runs."""
    return curves.drop_vars([name for name in curves.data_vars if "replicate" in curves[name].dims or name == OBSERVED])


def _at_level(curves: xr.Dataset, level: xr.DataArray | float) -> xr.DataArray:
    """Return the probability of curves at one level, block by block if each block has its own level."""
    if not isinstance(level, xr.DataArray) or not level.dims:
        return curve_probability(curves, [float(level)], LEAST)[..., 0]
    parts = [_at_level(curves.isel(block=[i]), float(value)) for i, value in enumerate(level.values)]
    return xr.concat(parts, "block", coords="minimal", compat="override", join="exact")


def worded(rates: xr.Dataset, state: str) -> xr.Dataset:
    """Return rates whose long names name the state that is counted, if it is not overturning."""
    name, verb = state_name(OVERTURNED), verb_of(state_name(OVERTURNED))
    if state == name:
        return rates
    named = rates.copy()
    for name_of in (*named.data_vars, *named.coords):
        text = str(named[name_of].attrs.get("long_name", ""))
        named[name_of].attrs["long_name"] = text.replace(f"that {verb}", f"that {verb_of(state)}").replace(name, state)
    return named


def bounded(rates: Array) -> Array:
    """Return rates, NaN instead of infinite rates: nothing bounds them."""
    return np.where(np.isinf(rates), np.nan, rates)


def risk_of(results: xr.Dataset) -> xr.Dataset:
    """Return the rates held by a study's results, under the names that `toppling.annual_rate` gives them."""
    kept = results.drop_vars([name for name in RISK_NAMES if name in results])
    return kept.rename({new: old for old, new in RISK_NAMES.items() if new in kept})
