"""Annual rates of a study's curves: the hazard curve and the questions that a study asks with it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import xarray as xr

from ...fragility import HazardCurve, annual_rate, curve_probability, rate_share_above, size_for_rate
from ...fragility.curves.curve import LEAST
from ...fragility.fitting.states import OVERTURNED, State, state_name
from ...fragility.hazard.curve import FLOOR
from ...fragility.numerics.slabs import gathered
from ...fragility.risk.common_measure import per_block
from ...fragility.runs.scaling import BLOCK_MEASURES, GROUND_FLOORS
from ...units import DIMENSIONLESS
from ..text.curve_notes import BEYOND, SETTLED, family_notes, rate_notes, verb_of
from ..text.level_advice import other_levels

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
        """Check that the hazard curve is of the same place as the levels, before anything runs.

        Parameters
        ----------
        design : Design
            The motions and the measure of the levels.
        file_of_floors : bool
            True where the floor motions are of another program, so that their ground motions are not known.

        Raises
        ------
        ValueError
            The hazard is of the ground and the levels are of a floor's motion, or the other way round; it is of a
            floor, and there are several.
        """
        floors = design.floors
        upper = [floor for floor in floors if floor not in GROUND_FLOORS]
        if self.hazard.at == FLOOR:
            if design.below:
                raise ValueError(
                    f"hazard.at 'floor' does not go with {design.name}.im_at 'ground': the levels are of the ground's "
                    "motion, so the hazard must be, too"
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
    ) -> xr.Dataset:
        """Compute the rates of curves, and the size that meets the target, under the names that they have in results.

        Parameters
        ----------
        curves : xarray.Dataset
            As `fit_fragility` returns them.
        confidence : float
            Confidence of the intervals.
        highest : xarray.DataArray or float
            The highest shaking that was run, in the measure of the curves, SI; on block where it depends on the block.
        state : str or float
            The state that counts, for the long names.
        telling : callable, optional
            Called with the name of the work, the number of blocks that have their rates, and the number of all blocks.

        Returns
        -------
        xarray.Dataset
            As `annual_rate` and `size_for_rate`, with names of `RISK_NAMES` and ``size_…``; and
            ``rate_share_above_levels``, the share of each rate from shaking above `highest`.
        """
        rates = self._slab_by_slab(curves, confidence, telling)
        found = rates.drop_vars("rate_sample", errors="ignore").rename(
            {old: new for old, new in RISK_NAMES.items() if old in rates}
        )
        text = "share of the rate from shaking above the highest that was run"
        beyond = self._beyond(curves, highest).transpose(*rates["rate"].dims)
        beyond = beyond.assign_attrs(units=DIMENSIONLESS, long_name=text)
        found = found.assign({BEYOND: (beyond.dims, beyond.values, beyond.attrs)})
        if self.along is not None:
            size = size_for_rate(rates, self.along, probability=self.target, years=self.years, confidence=confidence)
            names = {str(name): f"size_{name}" for name in size.data_vars}
            found = found.merge(size.rename(names), compat="override").assign_attrs(
                found.attrs, size_along=self.along, size_probability=self.target
            )
        return worded(found, state_name(state))

    def notes(
        self, rates: xr.Dataset, curves: xr.Dataset, highest: xr.DataArray | float, study: Mapping[str, Any]
    ) -> list[str]:
        """Notes on rates that come from shaking beyond the hazard curve or beyond the runs of a study, in sentences."""
        ends = {"ida": "the last level", "stripes": "the highest stripe"}
        end = next((words for key, words in ends.items() if key in study), "the strongest motion")
        cure = other_levels(study, True)
        said = [] if self.along is None else family_notes(curves, self.along)
        settled = _by_block(_plain(curves), highest, lambda one, level: curve_probability(one, [level], LEAST)[..., 0])
        known = float(self.hazard.levels[0]), float(self.hazard.levels[-1])
        return said + rate_notes(rates, settled, known, end, cure)

    def beyond(self, curves: xr.Dataset, highest: xr.DataArray | float) -> xr.DataArray:
        """Return the largest share of each rate from below or above the hazard curve, or above `highest`: a guess.

        Shaking above the highest that was run is known where nearly every block has fallen there.
        """
        plain = _plain(curves)
        rates = self.rates(plain, 0.9)
        settled = _by_block(plain, highest, lambda one, level: curve_probability(one, [level], LEAST)[..., 0])
        extrapolated = self._beyond(plain, highest).where(settled < SETTLED, 0.0)
        found = xr.concat([rates["share_below"], rates["share_above"], extrapolated], "part", coords="minimal")
        return found.max("part").fillna(0.0)

    def rates(self, curves: xr.Dataset, confidence: float, outside: str = OUTSIDE) -> xr.Dataset:
        """Compute the rates of curves alone, under the names of `annual_rate`."""
        return annual_rate(
            curves,
            self.hazard,
            self.years,
            below=self.below,
            above=self.above,
            outside=outside,
            confidence=confidence,
        )

    def _slab_by_slab(
        self, curves: xr.Dataset, confidence: float, telling: Callable[[str, int, int], None] | None
    ) -> xr.Dataset:
        """Compute the rates of curves; those of the many replicates are kept only where a size is asked for."""
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

    def _beyond(self, curves: xr.Dataset, highest: xr.DataArray | float) -> xr.DataArray:
        """The share of each rate from shaking above the highest that was run."""
        im = str(curves.attrs["im"])
        if im in BLOCK_MEASURES:  # (one level of these is another level of the hazard's measure for every block)
            highest = highest / per_block(curves, im)
        rules = {"below": self.below, "above": self.above, "outside": OUTSIDE}
        return rate_share_above(curves, self.hazard, highest, **rules)


def _plain(curves: xr.Dataset) -> xr.Dataset:
    """Curves without their replicates."""
    return curves.drop_vars([name for name in curves.data_vars if "replicate" in curves[name].dims])


def _by_block(
    curves: xr.Dataset, level: xr.DataArray | float, found: Callable[[xr.Dataset, float], xr.DataArray]
) -> xr.DataArray:
    """Evaluate a function of curves and one level, block by block where each block has its own level."""
    if not isinstance(level, xr.DataArray) or not level.dims:
        return found(curves, float(level))
    parts = [found(curves.isel(block=[i]), float(one)) for i, one in enumerate(level.values)]
    return xr.concat(parts, "block", coords="minimal", compat="override", join="exact")


def worded(rates: xr.Dataset, state: str) -> xr.Dataset:
    """Return rates whose long names name the state that is counted, where it is not overturning."""
    name, verb = state_name(OVERTURNED), verb_of(state_name(OVERTURNED))
    if state == name:
        return rates
    found = rates.copy()
    for one in (*found.data_vars, *found.coords):
        text = str(found[one].attrs.get("long_name", ""))
        found[one].attrs["long_name"] = text.replace(f"that {verb}", f"that {verb_of(state)}").replace(name, state)
    return found


def risk_of(results: xr.Dataset) -> xr.Dataset:
    """Return the rates held by a study's results, under the names that `toppling.annual_rate` gives them."""
    own = results.drop_vars([name for name in RISK_NAMES if name in results])
    return own.rename({new: old for old, new in RISK_NAMES.items() if new in own})
