"""Sensitivity studies: every law at many values of delta or of e under the same motions, and the rigid block."""

from collections.abc import Iterable
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np
import xarray as xr

from ...core.aliases import Progress
from ...core.doubts import Doubt
from ...core.facts import stored
from ...core.wording import counted
from ...fragility import RandomInputs, overturning_response, sobol_indices, tornado
from ...fragility.runs.provenance import records_of
from ...fragility.runs.request import part_of
from ...fragility.runs.runners import Runner
from ...fragility.uncertainty.inputs import input_doubts
from ...fragility.validity.characteristics import Characteristics
from ...fragility.validity.notes import screen_facts
from ...fragility.validity.slab_screen import screen_input
from ...fragility.validity.summary import summary_screen
from ...fragility.validity.undecided import count_flips, perturbed_runs
from ...models import Block, HousnerImpact, Law
from ...models.friction import Friction
from ...models.plausibility import restitution_doubts
from ..file.schema import StudyFile
from ..file.uncertainty import GIVEN, OWN, PREVIOUS, RIGID, Sweep
from ..plan.designs import Incremental
from ..plan.estimates import middle_level
from ..sensitivity.findings import Grid, findings, placed_screen
from .study import (
    CURVE_BYTES,
    MOST_VARIED,
    REPLICATE_BYTES,
    BlockStudy,
    blocks_of,
    parts_of,
    perturbed_words,
    screening_of,
)

OUTPUTS = ("overturned", "peak_rotation", "uplifted")


@dataclass(frozen=True)
class SensitivityStudy(BlockStudy):
    """Blocks x laws x values x motions x levels; tornado of `inputs`, and Sobol' indices if `sobol` is a number."""

    design: Incremental
    friction: Friction | None = None
    sweep: Sweep = field(kw_only=True)
    inputs: RandomInputs | None = None
    sobol: int | None = None
    kind: ClassVar[str] = "sensitivity"

    @classmethod
    def of(cls, content: StudyFile, folder: Path) -> Self:
        asked = content.sensitivity
        assert asked is not None  # (the table makes it this kind of study)
        limit = None if content.friction is None else content.friction.median
        friction, undecided = screening_of(content)
        study = cls(
            **parts_of(content, folder, blocks_of(content, folder, MOST_VARIED), "sensitivity", "value"),
            sweep=asked.sweep() if limit is None else asked.sweep(limit),
            inputs=asked.random_inputs(),
            sobol=asked.sobol,
            friction=friction,
            undecided=undecided,
        )
        varied = {"delta": ("delta",), "e": ("e", "restitution_factor")}[study.sweep.parameter]
        for i, table in enumerate(content.models, start=1):
            for name in varied:
                if table.given(name) is not None:
                    raise ValueError(f"models[{i}]: {name} is what sensitivity.values are of, it cannot be given")
        if not any(_has(model, study.sweep.parameter) for model in study.models):
            raise ValueError(f"models must hold one with {study.sweep.parameter}, which is varied, got none")
        bedded = next((block for block in study.blocks if block.bed is not None), None)
        if bedded is not None and study.sweep.parameter == "delta":
            raise ValueError(f"{bedded.label!r} stands on a bed (bed_settlement_mm), where delta is not used: vary e")
        study._check(content, study.grid.laws)
        for block in study.blocks:
            for model in study.models:
                inputs = study.inputs_of(model)
                if inputs is not None:
                    inputs.realise(block, model, inputs.sample(2))
        return study

    @property
    def doubts(self) -> list[Doubt]:
        values = [("the least value", min(self.sweep.values))] if self.sweep.parameter == "e" else []
        inputs = () if self.inputs is None else input_doubts(self.inputs, self.blocks)
        return [*super().doubts, *restitution_doubts(values), *inputs]

    @property
    def words(self) -> str:
        values = f"{counted(len(self.sweep.values), 'value')} of {self.sweep.parameter}"
        differ = f"{counted(self.runs, 'run')} that differ"
        return f"{self.pairs_words} × {values} × {self.design.words}: {differ}{perturbed_words(self.perturbed_runs)}"

    @property
    def runs(self) -> int:
        return self._shaken + self._varied

    @property
    def _tests(self) -> int:
        return perturbed_runs(len(self.blocks), self.grid.laws, 1, 1, 1.0)

    @property
    def kept_outputs(self) -> tuple[str, ...]:
        return OUTPUTS

    @property
    def stored_bytes(self) -> float:
        values = len(self.models) * len(self.sweep.values)
        return float(self.bytes_a_run * self._shaken * (1.0 + values / len(self.grid.laws)))

    @property
    def together(self) -> float:
        curves = len(self.blocks) * len(self.grid.laws)
        return super().together + (CURVE_BYTES + REPLICATE_BYTES * self.sweep.replicates) * curves

    @cached_property
    def grid(self) -> Grid:
        """Every law at every value, and the laws that each is compared with."""
        sweep = self.sweep
        at = [[_at(model, sweep.parameter, value) for value in sweep.values] for model in self.models]
        rigid = [[_rigid(law, sweep, k) for k, law in enumerate(row)] for row in at]
        against: dict[str, list[list[Law | None]]] = {}
        if sweep.reference == OWN:
            against[OWN] = [[_at(model, "e", None)] * sweep.values.size for model in self.models]
        elif sweep.reference != RIGID:
            given = [_at(model, sweep.parameter, float(sweep.reference)) for model in self.models]
            against[GIVEN] = [[law] * sweep.values.size for law in given]
        against[RIGID] = [list(row) for row in rigid]
        against[PREVIOUS] = [[None, *row[:-1]] for row in at]
        return Grid.of(at, against)

    @property
    def cases(self) -> Iterable[tuple[str, Block, Law]]:
        return (("sensitivity.values", block, law) for block in self.blocks for law in self.grid.laws)

    @property
    def _shaken(self) -> int:
        return len(self.blocks) * len(self.grid.laws) * self.design.runs

    def inputs_of(self, model: Law) -> RandomInputs | None:
        """Return the inputs that apply to a law and its block; None if there are none."""
        if self.inputs is None:
            return None
        of_laws = {"e", "restitution_factor", "delta", "zeta", "coefficient"}
        distributions = {
            name: distribution
            for name, distribution in self.inputs.distributions.items()
            if name not in of_laws or _has(model, name)
        }
        return RandomInputs(distributions) if distributions else None

    def _samples(self, model: Law) -> tuple[int, int]:
        """The numbers of samples of the tornado and of the indices of a law."""
        inputs = self.inputs_of(model)
        if inputs is None:
            return 0, 0
        d = len(inputs.names)
        return 2 * d + 1, 0 if self.sobol is None else self.sobol * (d + 2)

    @property
    def _varied(self) -> int:
        samples = sum(sum(self._samples(model)) for model in self.models)
        return len(self.blocks) * samples * self.design.shakes

    def _compute(self, client: Runner, progress: Progress | None) -> xr.Dataset:
        laws = self.grid.laws
        runs = self.design.run(self.blocks, laws, OUTPUTS, client, part_of(progress, 0, self.work))
        results = findings(runs, self.blocks, self.models, self.grid, self.sweep, client.array)
        if self.inputs is not None:
            results = results.assign(self._indices(results, client, progress).data_vars)
        screened = self._screened(runs, client, part_of(progress, self.runs, self.work))
        varied = screened.isel(model=np.unique(self.grid.at))  # without the accompanying laws
        return (
            results.assign(placed_screen(screened, self.grid).data_vars)
            .assign_coords(reason=screened["reason"])
            .assign_attrs(screen=screened.attrs["screen"], notes=stored(screen_facts(varied)))
        )

    def _screened(self, runs: xr.Dataset, client: Runner, progress: Progress | None) -> xr.Dataset:
        """Screen the runs of all distinct laws."""
        flips = None
        if self.undecided > 0.0:
            flips = count_flips(runs, self.design.motions, self.undecided, client, progress)
        shaking = Characteristics.of(records_of(runs, self.design.motions))
        screened = summary_screen(screen_input(runs), shaking, self.friction, flips)
        return screened.assign_coords(model=runs["model"].variable)

    def _indices(self, results: xr.Dataset, client: Runner, progress: Progress | None) -> xr.Dataset:
        """Tornado and Sobol' indices of P(overturn) at the level at which its mean over values is nearest to 1/2."""
        assert self.inputs is not None
        done = self._shaken
        blocks = []
        for block in self.blocks:
            rows = []
            for j, model in enumerate(self.models):
                inputs = self.inputs_of(model)
                assert inputs is not None  # a law with the parameter has its own inputs, other laws the block's
                at = middle_level(results["probability"].sel(block=block.label).isel(model=j))
                level = self.design.levels[at : at + 1]
                samples = self._samples(model)
                parts = {}
                for name, size in zip(("tornado", "sobol"), samples, strict=True):
                    if not size:
                        continue
                    response = overturning_response(
                        inputs,
                        block,
                        model,
                        self.design.motions,
                        level,
                        self.design.im,
                        ground=self.design.ground or None,
                        client=client,
                        progress=part_of(progress, done, self.work),
                    )
                    if name == "tornado":
                        parts[name] = tornado(inputs, response)
                    else:
                        assert self.sobol is not None
                        parts[name] = sobol_indices(inputs, response, self.sobol, seed=self.sweep.seed)
                    done += size * self.design.shakes
                rows.append(_row(parts, self.inputs.names, float(level[0]), results["level"].attrs))
            blocks.append(xr.concat(rows, results["model"], combine_attrs="override"))
        return xr.concat(blocks, results["block"], combine_attrs="override", coords="minimal")


def _row(parts: dict[str, xr.Dataset], names: tuple[str, ...], level: float, attrs: dict[str, Any]) -> xr.Dataset:
    """Tornado and indices of one block and law on all inputs; inputs that do not apply to the law have no effect."""
    variables: dict[str, Any] = {}
    for name, part in parts.items():
        of_output = part.isel(output=0).reindex(input=np.array(names, dtype=object))
        missing = [which not in part["input"].values for which in names]
        for key, array in of_output.data_vars.items():
            bare = array.drop_vars([c for c in array.coords if c != "input"])
            if "input" in bare.dims:
                held = of_output["base"].item() if key in ("low", "high") else 0.0
                bare = bare.where(~xr.DataArray(missing, dims="input"), held).assign_attrs(array.attrs)
            variables[f"{name}_{key}"] = bare
    variables["index_level"] = ((), level, {**attrs, "long_name": f"{attrs.get('long_name', 'level')} of the indices"})
    return xr.Dataset(variables)


def _has(model: Law, name: str) -> bool:
    return any(field.name == name for field in fields(model))  # type: ignore[arg-type]


def _at(model: Law, parameter: str, value: float | None) -> Law:
    """Return the law at a value of the parameter; unchanged if it has no such parameter."""
    return replace(model, **{parameter: value}) if _has(model, parameter) else model  # type: ignore[type-var]


def _rigid(law: Law, sweep: Sweep, k: int) -> HousnerImpact:
    """Return the rigid block that a law represents: with its e (or the study's, if e is varied) and lever arm."""
    options = law.options
    e = float(sweep.values[k]) if sweep.parameter == "e" else options.get("e")
    factor = 1.0 if e is not None else float(options.get("restitution_factor", 1.0))
    return HousnerImpact(e, "bilinear", options.get("lever", "h"), restitution_factor=factor)
