"""Weighted branches of a study's laws, motions and hazards: their runs, and the rates over them."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple

import numpy as np
import xarray as xr

from ...core.elementary import times
from ...core.units import PER_YEAR, described
from ...fragility import Branch, HazardCurve, epistemic_rates
from ...fragility.fitting.states import state_name
from ...fragility.risk.annual_rate import rates_alone
from ...fragility.risk.modelling import capacity_factors, seen_by, with_ends
from .designs import Design
from .estimates import Fit
from .risk import OUTSIDE, Risk, bounded, worded

RENAMED = {
    "rate_mean": "epistemic_rate",
    "rate_fractile": "epistemic_rate_fractile",
    "spread": "epistemic_spread",
    "fractile": "epistemic_fractile",
    "source": "epistemic_source",
}
"""Names in the results, if other variables have the plain names."""
BRANCH_COORDINATES = (
    "branch_model",
    "branch_motions",
    "branch_hazard",
    "branch_weight",
    "epistemic_fractile",
    "epistemic_source",
)


BEYOND = "branch_share_beyond"


class FittedCurves(NamedTuple):
    """Curves of a design, the highest level of its runs in their measure, SI; and the curves without beta_m."""

    curves: xr.Dataset
    highest: xr.DataArray | float
    plain: xr.Dataset


@dataclass(frozen=True)
class Branches:
    """Weights by name of laws (labels), motions and hazard curves; `modelling` is beta_m in the fractiles, else 0."""

    models: dict[str, float]
    motions: dict[str, tuple[Design | None, float]]
    hazards: dict[str, tuple[HazardCurve, float]]
    modelling: float = 0.0

    @property
    def designs(self) -> dict[str, Design]:
        """The designs in addition to the study's own, by name."""
        return {name: design for name, (design, _) in self.motions.items() if design is not None}

    def of(
        self, of_study: FittedCurves, fitted: Callable[[str, Design], FittedCurves], risk: Risk, fit: Fit
    ) -> xr.Dataset:
        """Return the rates over all combinations, from the study's curves and those `fitted` to other designs."""
        every = {
            name: of_study if design is None else fitted(name, design) for name, (design, _) in self.motions.items()
        }
        branches = [
            Branch(
                model,
                motions,
                hazard,
                every[motions].curves.sel(model=model),
                curve,
                share * self.motions[motions][1] * weight,
            )
            for (model, share), motions, (hazard, (curve, weight)) in product(
                self.models.items(), every, self.hazards.items()
            )
        ]
        rates = epistemic_rates(
            branches, self.modelling, below=risk.below, above=risk.above, outside=OUTSIDE, seed=fit.seed
        )
        known = ~np.isinf(rates["rate_mean"])  # (of a tabulated curve that nothing bounds below its levels)
        finite = {"rate_mean": known, "rate_fractile": known, "branch_rate": ~np.isinf(rates["branch_rate"])}
        rates = rates.assign({name: rates[name].where(finite_ones) for name, finite_ones in finite.items()})
        of_each = [
            replace(risk, hazard=branch.hazard, along=None).beyond(branch.curves, every[branch.motions].highest)
            for branch in branches
        ]
        beyond = xr.concat(of_each, "branch").transpose(*rates["branch_rate"].dims)
        text = "share of the branch's rate from shaking beyond its hazard curve or above its runs"
        attributes = described(text)
        rates = rates.assign({BEYOND: (beyond.dims, beyond.values, attributes)})
        rates = rates.rename(RENAMED).assign(self._range(branches, every, risk, fit.modelling_dispersion))
        return worded(rates, state_name(fit.state))

    @staticmethod
    def _range(
        branches: list[Branch], every: dict[str, FittedCurves], risk: Risk, modelling: float
    ) -> dict[str, xr.Variable]:
        """Return the ends of the mean rate's range if all capacities are wrong by the same factor."""
        rules = risk.below, risk.above, OUTSIDE
        weights = np.array([branch.weight for branch in branches])
        ends = []
        for factor in capacity_factors(modelling):
            of_branches = [
                rates_alone(every[branch.motions].plain.sel(model=branch.model), seen_by(branch.hazard, factor), *rules)
                for branch in branches
            ]
            ends.append(bounded(times(np.stack([rates for _, rates in of_branches], axis=-1), weights)))
        dims = of_branches[0][0]
        return with_ends("epistemic_rate", dims, ends, PER_YEAR, modelling)
