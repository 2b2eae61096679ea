"""The table of a study file that gives the values of delta or e of a sensitivity study, and their reference."""

from __future__ import annotations

from typing import Annotated, Literal, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator

from ...aliases import Array
from ...fragility import RandomInputs
from ...models.laws import MIN_DELTA
from .table import KeyInfo, Table, bare
from .uncertainty import InputTable

RIGID, OWN, GIVEN, PREVIOUS = "rigid", "own", "given", "previous"
"""References of a value: the rigid block, the block's own e_R, a given value, the value before."""


class Sweep(NamedTuple):
    """The varied parameter and the options of its evaluation.

    parameter: delta or e; values: increasing; reference: `RIGID`, `OWN` or a value; release: the rotation over alpha
    from which blocks rock freely; friction: the coefficient of friction between block and floor; replicates, seed,
    confidence: of the bootstrap over motions.
    """

    parameter: str
    values: Array
    reference: str | float
    release: float = 0.5
    friction: float = 1.0
    replicates: int = 1000
    seed: int = 0
    confidence: float = 0.95


class SensitivityTable(Table):
    """How results depend on delta or e."""

    parameter: Annotated[Literal["delta", "e"], Field(description="What is varied.")]
    values: Annotated[list[float], Field(min_length=2, max_length=200, description="Its values, increasing.")]
    reference: Annotated[
        str | float | None,
        KeyInfo("rigid over delta, own over e"),
        Field(description="What values are held against: rigid (Housner's impact), own (the block's e_R), or a value."),
    ] = None
    release: Annotated[
        float, Field(gt=0.0, lt=1.0, description="Rotation over alpha from which blocks rock freely.")
    ] = 0.5
    replicates: Annotated[int, Field(ge=100, le=1_000_000, description="Bootstrap replicates.")] = 1000
    seed: Annotated[int, Field(ge=0, description="Their seed.")] = 0
    confidence: Annotated[float, Field(gt=0.0, lt=1.0, description="Of all intervals.")] = 0.95
    inputs: Annotated[
        dict[str, InputTable] | None,
        KeyInfo("none"),
        Field(min_length=1, description="Inputs of the tornado and of Sobol' indices, the parameter among them."),
    ] = None
    sobol: Annotated[
        int | None,
        KeyInfo("no indices"),
        Field(ge=8, le=1_000_000, description="Base samples of Sobol' indices, a power of 2."),
    ] = None

    @model_validator(mode="after")
    def _in_range(self) -> Self:
        low, high = (MIN_DELTA, 1.0) if self.parameter == "delta" else (0.0, 1.0)
        given = [*self.values, *([self.reference] if isinstance(self.reference, float | int) else [])]
        for one in given:
            inside = low <= one < high if self.parameter == "delta" else low < one <= high
            if not inside:
                allowed = f">= {low:g} and < 1" if self.parameter == "delta" else "> 0 and <= 1"
                raise ValueError(f"values and reference of {self.parameter} must be {allowed}, got {one:g}")
        if any(after <= before for before, after in zip(self.values, self.values[1:], strict=False)):
            raise ValueError(f"values must increase, got {', '.join(f'{one:g}' for one in self.values)}")
        if len({f"{one:g}" for one in self.values}) < len(self.values):
            raise ValueError("values must differ within six digits, by which laws are told apart")
        if isinstance(self.reference, str):
            words = (RIGID,) if self.parameter == "delta" else (RIGID, OWN)
            if self.reference not in words:
                raise ValueError(f"reference must be {' or '.join(words)} or a value, got {self.reference!r}")
        if self.sobol is not None and self.inputs is None:
            raise ValueError("sobol needs inputs")
        if self.inputs is not None and self.parameter not in self.inputs:
            raise ValueError(f"inputs must hold {self.parameter}, the parameter that is varied, got none of it")
        return self

    def sweep(self, friction: float = 1.0) -> Sweep:
        """Return the varied parameter and the options of its evaluation, with the friction there is."""
        reference = self.reference
        if reference is None:
            reference = RIGID if self.parameter == "delta" else OWN
        return Sweep(
            self.parameter,
            np.array(self.values),
            reference,
            self.release,
            friction,
            self.replicates,
            self.seed,
            self.confidence,
        )

    def random_inputs(self) -> RandomInputs | None:
        """Make the inputs of tornado and indices; ValueError for an invalid distribution or a choice of laws."""
        if self.inputs is None:
            return None
        found = {}
        for name, table in self.inputs.items():
            try:
                found[bare(name)] = table.build()
            except (TypeError, ValueError) as error:
                raise ValueError(f"sensitivity.inputs.{name}: {error}") from None
        if "law" in found:
            raise ValueError("sensitivity.inputs has no law: every law stands by itself")
        try:
            return RandomInputs(found)
        except (TypeError, ValueError) as error:
            raise ValueError(f"sensitivity.inputs: {error}") from None
