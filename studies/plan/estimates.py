"""Estimates from the runs of a study: probabilities, curves, and the ranking of intensity measures."""

import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import xarray as xr

from ...core.facts import Fact
from ...core.units import DIMENSIONLESS
from ...fragility import curve_probability, overturning_probability, rank_measures, with_modelling
from ...fragility.curves.curve import LEAST, TABULATED, form_name
from ...fragility.fitting.fit import CurveOptions, fit_curves, half_level_samples
from ...fragility.fitting.links import LOGNORMAL
from ...fragility.fitting.states import State, flags_of, needed_output, reached, state_name
from ...fragility.numerics.slabs import gathered
from ...fragility.risk.modelling import capacity_factors, with_ends
from ...fragility.runs.provenance import RUN, motions_by_floor
from ..text.curve_notes import curve_notes, misfit_notes, spacing_notes

RANK = "measure_"
"""Prefix of the names of the ranking's variables, to distinguish them from other variables of the results."""
MEAN: Final = "mean"
"""Use of the modelling uncertainty: in the mean rate, else in its fractiles."""
UNDECIDED = 0.08
"""Share of the motions whose flags are tested under perturbations: about 30 % more work."""
LOW_SHARE = 0.1
"""Probability whose level is given in addition to the median with a hazard."""


@dataclass(frozen=True)
class Fit(CurveOptions):
    """Options of the fitted curves, and the modelling uncertainty."""

    form: str = LOGNORMAL
    modelling_dispersion: float = 0.0
    modelling: str = MEAN
    modelling_class: str | None = None

    @property
    def in_mean(self) -> float:
        """beta_m if the mean rate includes it, else 0."""
        return self.modelling_dispersion if self.modelling == MEAN else 0.0

    @property
    def outputs(self) -> tuple[str, ...]:
        """The outputs of the runs that the fit needs."""
        uplift = self.form == "uplift-lognormal"
        more = [needed_output(self.state), *(["uplifted"] if uplift else [])]
        return tuple(dict.fromkeys(("overturned", *more)))

    def curves(
        self,
        runs: xr.Dataset,
        replicates: bool,
        together: tuple[str, ...] = (),
        telling: Callable[[str, int, int], None] | None = None,
    ) -> xr.Dataset:
        """Fit the curves of runs, pooled along the dimensions `together`, with their `replicates` if wanted."""
        total = math.prod(runs.sizes.get(dim, 1) for dim in ("block", "model")) * len(motions_by_floor(runs)[1])
        before = 0

        def fitted(part: xr.Dataset) -> xr.Dataset:
            nonlocal before
            of_part = 0

            def progress(done: int, of: int) -> None:
                nonlocal of_part
                of_part = of
                if telling is not None:
                    telling("curves", before + done, total)

            curves = fit_curves(part, self, replicates, together, progress)
            before += of_part
            return curves

        return gathered(fitted, runs)

    def half_level_samples(self, runs: xr.Dataset, together: tuple[str, ...] = ()) -> xr.DataArray:
        """Return the levels at which half of the runs reach the state, of the replicates of `curves`."""
        return gathered(lambda part: half_level_samples(part, self, together), runs)["half_level_sample"]

    def modelled(self, curves: xr.Dataset) -> xr.Dataset:
        """Return curves whose dispersions include the modelling uncertainty if the mean rate is to include it."""
        return with_modelling(curves, self.in_mean) if self.in_mean else curves

    def chances_of_range(self, curves: xr.Dataset, level: xr.DataArray) -> dict[str, xr.Variable]:
        """Return chances at levels, of the curves, if all capacities are wrong by the same factor (`with_ends`)."""
        ends = []
        for factor in capacity_factors(self.modelling_dispersion):
            seen = level.values / factor
            chance = curve_probability(curves, seen, LEAST)
            if form_name(curves) in TABULATED:
                known = (seen >= level.values[0]) & (seen <= level.values[-1])
                chance = chance.where(xr.DataArray(known, dims="level"))
            ends.append(chance.transpose(..., "level"))
        dims = tuple(map(str, ends[0].dims))
        return with_ends("probability", dims, [end.values for end in ends], DIMENSIONLESS, self.modelling_dispersion)

    def probabilities(self, runs: xr.Dataset) -> xr.Dataset:
        """Observed probabilities of runs that have levels."""
        return gathered(lambda part: overturning_probability(part, self.confidence, self.state), runs)

    def notes(self, curves: xr.Dataset, runs: xr.Dataset) -> list[Fact]:
        """Return notes on curves that depend on few or contradicting runs."""
        counted = gathered(self._counted, runs)
        facts = curve_notes(curves, counted["fell"], counted["tried"], state_name(self.state))
        facts += spacing_notes(curves)
        # a misfit at adaptive levels is reported with the precision
        return facts if RUN in runs.dims else facts + misfit_notes(curves, state_name(self.state))

    def _counted(self, runs: xr.Dataset) -> xr.Dataset:
        """The number of runs of each curve that reached the state, and the number of its runs."""
        if RUN in runs.dims:
            return _counted_at_own_levels(runs, self.state)
        flags = reached(runs, self.state)
        floor, groups = motions_by_floor(flags)
        over = [dim for dim in ("level", "motion") if dim in flags.dims]
        parts = [flags if floor is None else flags.isel(motion=group) for group in groups]
        counts = [part.sum(over) for part in parts]
        sizes = [
            xr.full_like(count, math.prod(part.sizes[dim] for dim in over))
            for count, part in zip(counts, parts, strict=True)
        ]
        fell, tried = (counts_of[0] if floor is None else xr.concat(counts_of, floor) for counts_of in (counts, sizes))
        return xr.Dataset({"fell": fell, "tried": tried})


def _counted_at_own_levels(runs: xr.Dataset, state: State) -> xr.Dataset:
    """The number of runs of each block under each law that reached the state, and of its runs, at adaptive levels."""
    blocks, models = (np.asarray(runs[f"{dim}_number"].values) for dim in ("block", "model"))
    at = (runs["run_block"].values == blocks[:, None]), (runs["run_model"].values == models[:, None])
    alpha = np.zeros(1 + int(blocks.max()))
    alpha[blocks] = runs["alpha"].values
    of_run = alpha[runs["run_block"].values]
    fell = np.asarray(flags_of(runs[needed_output(state)].values, state, of_run), dtype=float)
    dims = ("block", "model")
    return xr.Dataset(
        {
            "fell": (dims, np.rint((at[0] * fell) @ at[1].T.astype(float)).astype(int)),
            "tried": (dims, np.rint(at[0].astype(float) @ at[1].T.astype(float)).astype(int)),
        }
    )


def ranked(runs: xr.Dataset, motions: Any, also: tuple[str, ...], state: State) -> xr.Dataset:
    """Return the ranking of measures under the names that it has in the results."""
    ranking = rank_measures(runs, motions, also, state=state)
    settings = {name: value for name, value in ranking.attrs.items() if name not in runs.attrs}
    renamed = ranking.rename({str(name): f"{RANK}{name}" for name in ranking.data_vars})
    return renamed.drop_attrs(deep=False).assign_attrs(ranking=json.dumps(settings, default=str))


def ranking_of_measures(results: xr.Dataset) -> xr.Dataset:
    """Return the ranking held by a study's results, as `rank_measures` returns it."""
    names = [str(name) for name in results.data_vars if str(name).startswith(RANK)]
    ranking = results[names].rename({name: name.removeprefix(RANK) for name in names})
    return ranking.assign_attrs(json.loads(results.attrs["ranking"]))


def middle_level(probability: xr.DataArray) -> int:
    """The index of the level at which a probability, averaged over all other dimensions, is nearest to one half."""
    rest = [dim for dim in probability.dims if dim != "level"]
    return int(np.abs(probability.mean(rest).values - 0.5).argmin())
