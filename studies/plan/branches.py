"""Weighted branches of a study's laws, motions and hazards: what has to be run for them, and the rates over them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import xarray as xr

from ...fragility import Branch, HazardCurve, epistemic_rates
from .designs import Design
from .risk import OUTSIDE, Risk

RENAMED = {
    "rate_mean": "epistemic_rate",
    "rate_fractile": "epistemic_rate_fractile",
    "spread": "epistemic_spread",
    "fractile": "epistemic_fractile",
    "source": "epistemic_source",
}
"""Names in the results, where other variables have the plain names."""
BRANCH_COORDINATES = (
    "branch_model",
    "branch_motions",
    "branch_hazard",
    "branch_weight",
    "epistemic_fractile",
    "epistemic_source",
)


@dataclass(frozen=True)
class Branches:
    """Weights by name of laws (labels), sets of motions and hazard curves; the study's own motions have no design.

    `modelling` is beta_m where it is to be in the fractiles, 0 where it is in the mean rate or not known.
    """

    models: dict[str, float]
    motions: dict[str, tuple[Design | None, float]]
    hazards: dict[str, tuple[HazardCurve, float]]
    modelling: float = 0.0

    @property
    def designs(self) -> dict[str, Design]:
        """The designs beside the study's own, by name."""
        return {name: design for name, (design, _) in self.motions.items() if design is not None}

    def of(self, curves: xr.Dataset, fitted: Callable[[str, Design], xr.Dataset], risk: Risk, seed: int) -> xr.Dataset:
        """Return the rates over all combinations, under the names that they have in the results.

        Parameters
        ----------
        curves : xarray.Dataset
            The study's own curves with their replicates, of all laws.
        fitted : callable
            Returns the curves of another design, of all laws, given its name and itself.
        risk : Risk
            The rules beyond the ends of hazard curves.
        seed : int
            Of the pairing of replicates with samples of the modelling uncertainty.
        """
        every = {name: curves if design is None else fitted(name, design) for name, (design, _) in self.motions.items()}
        branches = [
            Branch(
                model,
                motions,
                hazard,
                every[motions].sel(model=model),
                curve,
                share * self.motions[motions][1] * weight,
            )
            for (model, share), motions, (hazard, (curve, weight)) in product(
                self.models.items(), every, self.hazards.items()
            )
        ]
        found = epistemic_rates(
            branches, self.modelling, below=risk.below, above=risk.above, outside=OUTSIDE, seed=seed
        )
        return found.rename(RENAMED)
