"""Uncertainty studies: blocks and laws with uncertain properties, under the same motions for every sample."""

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import ClassVar, Self

import numpy as np
import xarray as xr

from ...core.aliases import Progress
from ...core.doubts import Doubt
from ...core.facts import Fact, stored
from ...core.units import described
from ...core.wording import counted
from ...fragility import RandomInputs, overturning_response, sobol_indices, uncertain_ida
from ...fragility.curves.curve import LINKED
from ...fragility.fitting.links import LOGNORMAL
from ...fragility.fitting.states import OVERTURNED, state_name
from ...fragility.risk.modelling import RANGE, USUAL_DISPERSION, range_of_half_levels
from ...fragility.runs.axes import check_axes
from ...fragility.runs.plan import refuse_endless_runs
from ...fragility.runs.provenance import SCENE
from ...fragility.runs.request import part_of
from ...fragility.runs.runners import Runner
from ...fragility.runs.scaling import BLOCK_MEASURES
from ...fragility.uncertainty.indices import sobol_samples
from ...fragility.uncertainty.inputs import input_doubts
from ...fragility.validity.characteristics import Characteristics
from ...fragility.validity.notes import OF_THE_WIDTH, screen_facts
from ...fragility.validity.slab_screen import ScreenRequest
from ...models import Block, Law
from ...models.friction import Friction
from ...models.plausibility import restitution_doubts
from ...motions import records
from ..file.schema import StudyFile
from ..plan.designs import Incremental
from ..plan.risk import without_replicates
from ..plan.samples import (
    NO_CAPACITY,
    fitted,
    joined_screens,
    pooled_curves,
    samples_perturbed_runs,
    screen_samples,
    summary,
    yearly,
)
from ..text.axes import held_notes
from ..text.curve_notes import curve_notes
from .study import (
    LOGNORMAL as USUAL_FIT,
    MOST_VARIED,
    BlockStudy,
    blocks_of,
    parts_of,
    perturbed_words,
    screening_of,
)

REFUSED = {
    "measures": "measures are ranked for known blocks: leave uncertainty out to rank them",
    "outputs": "of so many runs only the outcomes are kept",
}
"""Keys that are not supported in a study with uncertainty, and the reasons."""
FORMS = (LOGNORMAL, *LINKED)
"""Forms of curves that can be fitted to every sample."""
OF_KNOWN_BLOCKS = ("probability", "along")
"""Questions asked with a hazard that need blocks of one size each."""

LEVEL_BYTES_A_RUN = 60.0
"""Memory for the variance shares of the flags at one level, or of the capacities, for each run."""


@dataclass(frozen=True)
class UncertaintyStudy(BlockStudy):
    """Samples of uncertain blocks and laws x motions x levels; `sobol`: the size of the indices, or None."""

    design: Incremental
    friction: Friction | None = None
    inputs: RandomInputs = field(kw_only=True)
    samples: int = field(kw_only=True)
    seed: int = field(kw_only=True)
    sobol: int | None = None
    kind: ClassVar[str] = "uncertainty"

    @classmethod
    def of(cls, content: StudyFile, folder: Path) -> Self:
        asked = content.uncertainty
        assert asked is not None  # (the table makes it this kind of study)
        _refuse(content)
        friction, undecided = screening_of(content)
        study = cls(
            **parts_of(content, folder, blocks_of(content, folder, MOST_VARIED), "uncertainty", "sample"),
            fit=USUAL_FIT if content.fit is None else content.fit.build(),
            inputs=asked.build(),
            samples=asked.samples,
            seed=asked.seed,
            sobol=asked.sobol,
            friction=friction,
            undecided=undecided,
        )
        if "law" in study.inputs.names and len(study.models) > 1:
            raise ValueError(f"models must be one law where law is an uncertain input, got {len(study.models)}")
        study._check(content)
        drawn = study.inputs.sample(2, study.seed)
        for block in study.blocks:
            for model in study.models:
                for block_drawn, law in study.inputs.realise(block, model, drawn):
                    check_axes(study.design.axes, [block_drawn], [law])
        if study.sobol is not None:
            drawn = sobol_samples(study.inputs, study.sobol, study.seed)
            of_indices = (
                ("uncertainty.inputs", *pair)
                for block in study.blocks
                for model in study.models
                for pair in study.inputs.realise(block, model, drawn)
            )
            refuse_endless_runs(of_indices, (record for array in study.arrays for record in records(array)))
        return study

    @property
    def doubts(self) -> list[Doubt]:
        laws = ((of, self.inputs.distributions.get(of)) for of in ("e", "restitution_factor"))
        medians = [(f"the median of {of}", law.quantile(np.array([0.5])).item()) for of, law in laws if law]
        return [*super().doubts, *restitution_doubts(medians), *input_doubts(self.inputs, self.blocks, self.models)]

    @property
    def words(self) -> str:
        of = f"{self.pairs_words} × {counted(self.samples, 'sample')} × {self.design.words}"
        sampled = f"{of} = {counted(self._sampled, 'run')}"
        more = self.runs - self._sampled
        return sampled + (f", and {more:,} more" if more else "") + perturbed_words(self.perturbed_runs)

    @property
    def runs(self) -> int:
        more = len(self.blocks) * len(self.models) * self._index_samples
        return self._sampled + more * self.design.runs

    @property
    def perturbed_runs(self) -> int:
        """Number of further runs that test which outcomes of the samples are undecided."""
        return len(self.blocks) * samples_perturbed_runs(self._pairs[0], self.design, self.undecided)

    @cached_property
    def _pairs(self) -> list[list[list[tuple[Block, Law]]]]:
        """The block and the law of every sample, (block, sample, model)."""
        drawn = self.inputs.sample(self.samples, self.seed)
        pairs = []
        for block in self.blocks:
            laws = [self.inputs.realise(block, model, drawn) for model in self.models]
            pairs.append([list(row) for row in zip(*laws, strict=True)])
        return pairs

    @property
    def cases(self) -> Iterable[tuple[str, Block, Law]]:
        return (("uncertainty.inputs", *pair) for samples in self._pairs for laws in samples for pair in laws)

    @property
    def stored_bytes(self) -> float:
        return float(self._sampled)

    @property
    def together(self) -> float:
        # the flags of one block at one level, and its capacities, under all laws
        return max(super().together, LEVEL_BYTES_A_RUN * self._sampled / len(self.blocks) / self.design.levels.size)

    @property
    def _sampled(self) -> int:
        return len(self.blocks) * len(self.models) * self.samples * self.design.runs

    @property
    def _index_samples(self) -> int:
        """Number of samples of the Sobol' indices of one block and law."""
        return 0 if self.sobol is None else self.sobol * (len(self.inputs.names) + 2)

    def _compute(self, client: Runner, progress: Progress | None) -> xr.Dataset:
        share = self.runs * self.design.about // len(self.blocks)
        parts = []
        for i, block in enumerate(self.blocks):
            parts.append(self._of_block(block, client, part_of(progress, i * share, self.work)))
        labels = np.array([block.label for block in self.blocks], dtype=object)
        along = xr.DataArray(labels, dims="block", name="block", attrs=described("block"))
        rest = [part.drop_vars("overturned") for part in parts]
        if any(SCENE in part.coords for part in rest):  # (of blocks that some have, others none)
            none = ("sample", np.full(self.samples, "{}", dtype=object))
            rest = [part if SCENE in part.coords else part.assign_coords({SCENE: none}) for part in rest]
        results = xr.concat(rest, along, combine_attrs="override", coords="different", compat="equals")
        results = results.assign(overturned=_concatenated([part["overturned"].variable for part in parts], client))
        results = results[list(parts[0].data_vars)]
        done = self.runs * self.design.about
        screens = []
        shaking = Characteristics.of(records(self.design.motions))
        for block, pairs, part in zip(self.blocks, self._pairs, parts, strict=True):
            of_part = part_of(progress, done, self.work)
            asked = ScreenRequest(self.friction, undecided=self.undecided), shaking, client, of_part
            screens.append(screen_samples(block, pairs, self.design, part["overturned"], *asked))
            done += self.perturbed_runs // len(self.blocks)
        screened = joined_screens(screens, results["model"])
        facts = [*self._curve_facts(results), *screen_facts(screened)]
        return (
            results.assign(screened.data_vars)
            .assign_coords(reason=screened["reason"])
            .assign_attrs(combined_attributes(parts), screen=screened.attrs["screen"])
            .assign_attrs(notes=stored(facts))
        )

    def _curve_facts(self, results: xr.Dataset) -> list[Fact]:
        """Return notes on the curves and rates of all samples together."""
        over = ["sample", "level", "motion"]
        fell = results["overturned"].sum(over)
        runs = xr.full_like(fell, self.samples * self.design.runs)
        facts = curve_notes(results, fell, runs, state_name(OVERTURNED))
        if self.design.about == 2:
            facts += [OF_THE_WIDTH, Fact("axis.depth_ratio_kept")]
            facts += held_notes([block.label for block in self.blocks if block.surrounded])
        if self.risk is None:
            return facts
        curves = results[["median", "dispersion"]].assign_attrs(form=self.fit.form, im=self.design.im)
        facts += self.risk.notes(results, curves, self.design.highest(results), self.configuration)
        missing = int(results["sample_rate"].isnull().sum())
        if missing:
            facts.append(
                Fact("uncertainty.samples_without_rate", missing, more={"samples": results["sample_rate"].size})
            )
        return facts

    def _of_block(self, block: Block, client: Runner, progress: Progress | None) -> xr.Dataset:
        ground = self.design.ground or None
        runs = uncertain_ida(
            self.inputs,
            block,
            list(self.models),
            self.design.motions,
            self.design.levels,
            self.design.im,
            ("overturned",),
            client,
            samples=self.inputs.sample(self.samples, self.seed),
            ground=ground,
            progress=progress,
        )
        shared = summary(runs, self.fit)
        pooled, curves_of_samples = pooled_curves(runs, self.fit, keep=self.risk is not None), fitted(runs, self.fit)
        results = runs.assign(shared.data_vars).assign(
            curves_of_samples.rename(median="sample_median", dispersion="sample_dispersion")
        )
        results = results.assign(without_replicates(pooled).data_vars).assign_attrs(
            shared.attrs, fit_method=pooled.attrs["method"], form=pooled.attrs["form"], confidence=self.fit.confidence
        )
        results = results.assign(range_of_half_levels(pooled, 0.0)).assign_attrs({RANGE: USUAL_DISPERSION})
        if self.risk is not None:
            ends = self.design.highest(runs), self.design.lowest(runs)
            rates = yearly(self.risk, pooled, curves_of_samples, *ends, self.fit.confidence)
            results = results.assign(rates.data_vars).assign(self.risk.modelling_range(pooled, 0.0))
            results = results.assign_attrs(years=self.risk.years)
        done = len(self.models) * self.samples * self.design.runs * self.design.about
        if self.sobol is not None:
            each_law = []
            for model in self.models:
                response = overturning_response(
                    self.inputs,
                    block,
                    model,
                    self.design.motions,
                    self.design.levels,
                    self.design.im,
                    ground=ground,
                    client=client,
                    progress=part_of(progress, done, self.work),
                )
                each_law.append(sobol_indices(self.inputs, response, self.sobol, seed=self.seed))
                done += self._index_samples * self.design.runs * self.design.about
            together = xr.concat(each_law, runs["model"], combine_attrs="override")
            results = results.assign({f"sobol_{key}": variable for key, variable in together.data_vars.items()})
        return results


def _concatenated(parts: Sequence[xr.Variable], client: Runner) -> xr.Variable:
    """Join the runs of each block into the runs of all blocks."""
    first = parts[0]
    flags = client.array((len(parts), *first.shape), first.dtype)
    for of_block, part in zip(flags, parts, strict=True):
        of_block[...] = part.values
    return xr.Variable(("block", *first.dims), flags, first.attrs)


def combined_attributes(parts: Sequence[xr.Dataset]) -> dict[str, str]:
    """Combine the configurations and the counts of skipped samples of results of one block each."""
    configurations = [json.loads(part.attrs["configuration"]) for part in parts]
    first = {key: value for key, value in configurations[0].items() if key != "block"}
    counts = [json.loads(part.attrs["skipped"]) for part in parts]
    samples = [count["samples"] for count in counts]
    shares = {
        name: round(float(np.average([count[name] for count in counts], weights=samples)), 6)
        for name in counts[0]
        if name.startswith("share_")
    }
    events = round(float(np.mean([count["events_per_run"] for count in counts])), 3)
    attributes = {
        "configuration": json.dumps(
            {"blocks": [configuration["block"] for configuration in configurations], **first},
            ensure_ascii=False,
            sort_keys=True,
        ),
        "skipped": json.dumps({"samples": sum(samples), **shares, "events_per_run": events}),
    }
    reasons = dict.fromkeys(str(part.attrs[NO_CAPACITY]) for part in parts if NO_CAPACITY in part.attrs)
    return attributes | ({NO_CAPACITY: "; ".join(reasons)} if reasons else {})


def _refuse(content: StudyFile) -> None:
    """Raise a ValueError with the reason for questions that a study with uncertainty cannot answer."""
    for name, reason in REFUSED.items():
        if getattr(content, name) is not None:
            raise ValueError(f"a study with uncertainty has no {name}: {reason}")
    if content.fit is not None:
        if content.fit.form not in FORMS:
            raise ValueError(
                f"fit.form of a study with uncertainty must be one of {', '.join(FORMS)}, got {content.fit.form!r}: "
                "every sample needs a median and a dispersion"
            )
        if content.fit.modelling_dispersion > 0.0:
            raise ValueError(
                "fit.modelling_dispersion is not for a study with uncertainty, whose inputs say what is not known: "
                "leave it out"
            )
        if content.fit.state != OVERTURNED:
            raise ValueError(
                f"fit.state of a study with uncertainty must be 'overturned', got {content.fit.state!r}: its shares "
                "of the variance and its indices are of overturning"
            )
    if content.hazard is not None:
        given = [name for name in OF_KNOWN_BLOCKS if getattr(content.hazard, name) is not None]
        if given:
            raise ValueError(
                f"hazard.{given[0]} is not for a study with uncertainty: the sizes of its blocks are not known; leave "
                "uncertainty out to ask which size meets a target"
            )
        im = content.analysis.im
        if im in BLOCK_MEASURES:
            raise ValueError(
                f"hazard needs levels of the motion alone in a study with uncertainty, got im {im!r}: a level of it is "
                f"another shaking for every sample; set ida.im = {BLOCK_MEASURES[im].measure.label!r}"
            )
