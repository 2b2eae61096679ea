"""Uncertainty studies: blocks and laws of which not all is known, under the same motions for every sample."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
import xarray as xr

from ..fragility import (
    RandomInputs,
    block_notes,
    capacity_variance_shares,
    fit_fragility,
    morris_indices,
    overturning_probability,
    overturning_response,
    sobol_indices,
    standing,
    uncertain_ida,
    variance_shares,
)
from ..models import Block, Law
from ..models.oscillator import Oscillator
from ..units import DIMENSIONLESS
from .designs import Incremental, count
from .schema import StudyFile
from .study import Progress, Study, each, part_of, plain

if TYPE_CHECKING:
    from ..fragility.runners import Runner

QUANTILES = (0.05, 0.5, 0.95)
FACTORS = ("motion", "model", "sample")


@dataclass(frozen=True)
class UncertaintyStudy(Study):
    """Samples of uncertain blocks and laws x motions x levels; `sobol` and `morris` say whether indices are wanted."""

    blocks: tuple[Block, ...]
    models: tuple[Law, ...]
    design: Incremental
    inputs: RandomInputs
    samples: int
    seed: int
    sobol: int | None = None
    morris: int | None = None
    kind: ClassVar[str] = "uncertainty"

    @classmethod
    def of(cls, content: StudyFile, folder: Path) -> Self:
        asked = content.uncertainty
        assert asked is not None  # which makes it this kind
        design = content.design(folder)
        if not isinstance(design, Incremental):
            raise ValueError("uncertainty needs ida: the same motions at the same levels for every sample")
        study = cls(
            content.title,
            plain(content),
            each("blocks", content.blocks or []),
            each("models", content.models),
            design,
            asked.build(),
            asked.samples,
            asked.seed,
            asked.sobol,
            asked.morris,
        )
        if "law" in study.inputs.names and len(study.models) > 1:
            raise ValueError(f"models must be one law where law is an uncertain input, got {len(study.models)}")
        if any(array.sizes.get("floor", 1) > 1 for array in design.arrays) or len(design.floors) > 1:
            raise ValueError("uncertainty needs the motions of one floor, got several")
        drawn = study.inputs.sample(2, study.seed)
        for block in study.blocks:
            for model in study.models:
                study.inputs.realise(block, model, drawn)
        design.check(study.blocks)
        return study

    @property
    def words(self) -> str:
        of = f"{count(len(self.blocks), 'block')} × {count(len(self.models), 'law')} × {count(self.samples, 'sample')}"
        more = self.runs - self._sampled
        return f"{of} × {self.design.words} = {count(self._sampled, 'run')}" + (f", and {more:,} more" if more else "")

    @property
    def runs(self) -> int:
        more = sum(samples for _, _, samples in self._indices.values())
        return self._sampled + len(self.blocks) * len(self.models) * more * self.design.runs

    @property
    def of_each_law(self) -> list[Oscillator]:
        return [model.oscillator(self.blocks[0]) for model in self.models]

    @property
    def notes(self) -> list[str]:
        return block_notes(self.blocks)

    @property
    def arrays(self) -> Iterable[xr.DataArray]:
        return (*self.design.arrays, *self.design.below)

    @property
    def _sampled(self) -> int:
        return len(self.blocks) * len(self.models) * self.samples * self.design.runs

    @property
    def _indices(self) -> dict[str, tuple[Any, int, int]]:
        """The indices that are wanted: function, its size, and how many samples it takes."""
        d = len(self.inputs.names)
        found: dict[str, tuple[Any, int, int]] = {}
        if self.sobol is not None:
            found["sobol"] = sobol_indices, self.sobol, self.sobol * (d + 2)
        if self.morris is not None:
            found["morris"] = morris_indices, self.morris, self.morris * (d + 1)
        return found

    def _compute(self, client: Runner, progress: Progress | None) -> xr.Dataset:
        share = self.runs // len(self.blocks)
        parts = []
        for i, block in enumerate(self.blocks):
            parts.append(self._of_block(block, client, part_of(progress, i * share, self.runs)))
        labels = np.array([block.label for block in self.blocks], dtype=object)
        along = xr.DataArray(labels, dims="block", name="block", attrs={"units": DIMENSIONLESS, "long_name": "block"})
        found = xr.concat(parts, along, combine_attrs="override", coords="different", compat="equals")
        # (of the blocks as they are thought to be: samples differ from them)
        screened = standing(self.blocks, self.models, found.sizes["motion"])
        return found.assign(screened.data_vars).assign_attrs(notes=screened.attrs["notes"])

    def _of_block(self, block: Block, client: Runner, progress: Progress | None) -> xr.Dataset:
        ground = self.design.ground or None
        runs = uncertain_ida(
            self.inputs,
            block,
            list(self.models),
            self.design.motions,
            self.design.at,
            self.design.im,
            ("overturned",),
            client,
            samples=self.samples,
            seed=self.seed,
            ground=ground,
            progress=progress,
        )
        found = runs.assign(summary(runs).data_vars)
        done = len(self.models) * self.samples * self.design.runs
        for name, (indices, n, samples) in self._indices.items():
            each_law = []
            for model in self.models:
                response = overturning_response(
                    self.inputs,
                    block,
                    model,
                    self.design.motions,
                    self.design.at,
                    self.design.im,
                    ground=ground,
                    client=client,
                    progress=part_of(progress, done, self.runs),
                )
                each_law.append(indices(self.inputs, response, n, seed=self.seed))
                done += samples * self.design.runs
            together = xr.concat(each_law, runs["model"], combine_attrs="override")
            found = found.assign({f"{name}_{key}": one for key, one in together.data_vars.items()})
        return found


def summary(runs: xr.Dataset) -> xr.Dataset:
    """What samples x motions say together: probabilities with their spread over samples, curves, shares of variance."""
    counts = overturning_probability(runs)
    probability = counts["probability"]
    quantile = probability.quantile(list(QUANTILES), "sample")
    quantile = quantile.assign_attrs(units=DIMENSIONLESS, long_name="quantile over samples of the probability")
    pooled = counts[["overturnings", "runs"]].sum("sample", keep_attrs=True)
    curve = fit_fragility(pooled)[["median", "dispersion", "status", "converged"]]
    own = fit_fragility(counts)[["median", "dispersion"]]
    names = {"median": "median of each sample", "dispersion": "dispersion of each sample"}
    alone = [dim for dim in FACTORS if runs.sizes[dim] == 1]
    flags = variance_shares(runs["overturned"].squeeze(alone), [dim for dim in FACTORS if dim not in alone])
    found = {
        "probability": probability.mean("sample").assign_attrs(
            units=DIMENSIONLESS, long_name="probability of overturning, inputs uncertain"
        ),
        "probability_quantile": quantile,
        "sample_probability": probability,
        **{str(name): one for name, one in curve.data_vars.items()},
        **{f"sample_{name}": own[name].assign_attrs(long_name=text) for name, text in names.items()},
        "flag_share": flags["share"],
        "flag_total_share": flags["total_share"],
    }
    dataset = xr.Dataset(found)
    try:
        capacity = capacity_variance_shares(runs.squeeze(alone), flags["factor"].values.tolist())
    except ValueError as error:
        return dataset.assign_attrs(no_capacity_shares=str(error))
    keep = ("share", "total_share", "total_variance", "share_known", "rounding_share", "motions_used")
    return dataset.assign({f"capacity_{name}": capacity[name] for name in keep})
