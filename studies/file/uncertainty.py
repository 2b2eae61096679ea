"""Tables of a study file for uncertainty: uncertain inputs and their indices, and values of delta or e to try."""

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator

from ...core.aliases import Array
from ...core.parameters import CORRELATION, POSITIVE, Seed
from ...core.units import METRE, NEWTON, RADIAN, STIFFNESS
from ...fragility import Beta, Categorical, Least, Lognormal, Normal, RandomInputs, Uniform
from ...fragility.uncertainty.distributions import Distribution
from ...fragility.uncertainty.ida import SAMPLES
from ...fragility.uncertainty.realisation import KNOWN
from ...models.laws import DELTA, RESTITUTION
from ..plan.estimates import Fit
from .derived import choice
from .table import WRITTEN, Confidence, KeyInfo, Replicates, ResamplingSeed, Table, checked

SUFFIXES = {METRE: "_m", RADIAN: "_rad", NEWTON: "_n", STIFFNESS: "_n_per_mm"}
FACTORS = {STIFFNESS: WRITTEN["N/mm"]}
"""SI value of the unit in which the names of inputs are, if it is not 1."""
INPUTS = {name + SUFFIXES.get(known.units, ""): name for name, known in KNOWN.items()}
"""Names of the inputs that can be uncertain, each with its unit, and without it."""

MOST_SAMPLES = 1_000_000
Sobol = Annotated[
    int | None,
    KeyInfo("no indices"),
    Field(ge=8, le=MOST_SAMPLES, description="Base samples of Sobol' indices, a power of 2."),
]


OF_INPUT = KeyInfo(unit="of the input")
InUnit = Annotated[float, OF_INPUT]
End = Annotated[float | None, OF_INPUT]


class InputTable(Table):
    """One uncertain input: its distribution.

    distribution: Kind of distribution.
    lower: Lower end of the support.
    upper: Upper end of the support.
    """

    distribution: str
    makes: ClassVar[type[Distribution]]

    def build(self, factor: float = 1.0) -> Distribution:
        """Make the distribution of the input in SI, `factor` times the file's; ValueError for a wrong value."""
        return type(self).makes(**self._scaled(factor))

    def _scaled(self, factor: float) -> dict[str, Any]:
        """Return the given values of the distribution, in SI."""
        given = self.model_dump(exclude={"distribution"}, exclude_none=True)
        in_unit = [key for key, field in type(self).model_fields.items() if OF_INPUT in field.metadata]
        return {key: _times(value, factor) if key in in_unit else value for key, value in given.items()}


class NormalTable(InputTable):
    """A normal distribution, cut at its ends.

    mean: Mean, before truncation.
    std: Standard deviation, before truncation.
    """

    makes = Normal
    mean: InUnit
    std: InUnit
    lower: End = None
    upper: End = None


class LognormalTable(InputTable):
    """A lognormal distribution, cut at its ends.

    median: Median, before truncation.
    dispersion: Logarithmic standard deviation.
    """

    makes = Lognormal
    median: InUnit
    dispersion: float
    lower: End = None
    upper: End = None


class UniformTable(InputTable):
    """A uniform distribution."""

    makes = Uniform
    lower: InUnit
    upper: InUnit


class BetaTable(InputTable):
    """A beta distribution between its ends.

    a: First shape.
    b: Second shape.
    """

    makes = Beta
    a: float
    b: float
    lower: InUnit = Beta.lower
    upper: InUnit = Beta.upper


class LeastTable(InputTable):
    """The minimum of several lognormal values.

    medians: Medians of the lognormal values, of which the input is the minimum.
    dispersions: Dispersions of the parts, one each.
    """

    medians: Annotated[list[Annotated[float, POSITIVE]], OF_INPUT, Field(min_length=1, max_length=20)]
    dispersions: list[Annotated[float, POSITIVE]]

    def build(self, factor: float = 1.0) -> Distribution:
        if len(self.medians) != len(self.dispersions):
            raise ValueError(
                f"medians and dispersions must be equally many, got {len(self.medians)} and {len(self.dispersions)}"
            )
        medians = self._scaled(factor)["medians"]
        return Least([Lognormal(*part) for part in zip(medians, self.dispersions, strict=True)])


class ChoiceTable(InputTable):
    """A choice among laws.

    values: The laws.
    weights: Weights of the laws.
    """

    values: list[str]
    weights: Annotated[list[Annotated[float, Field(ge=0.0)]] | None, KeyInfo("equal")] = None

    def build(self, factor: float = 1.0) -> Distribution:
        weights = self.weights or [1.0] * len(self.values)
        if len(weights) != len(self.values) or sum(weights) == 0.0:
            raise ValueError(f"weights must be {len(self.values)} numbers >= 0, not all 0, got {weights}")
        return Categorical(tuple(self.values), tuple(weight / sum(weights) for weight in weights))


def _times(value: Any, factor: float) -> Any:
    """Return a number, or each number of a list, times a factor."""
    return [number * factor for number in value] if isinstance(value, list) else value * factor


DISTRIBUTIONS = {
    "normal": NormalTable,
    "lognormal": LognormalTable,
    "uniform": UniformTable,
    "beta": BetaTable,
    "least": LeastTable,
    "choice": ChoiceTable,
}
if TYPE_CHECKING:
    Inputs = InputTable
else:
    Inputs = choice("distribution", DISTRIBUTIONS)


class CorrelationTable(Table):
    """Rank correlation of two inputs.

    of: The two inputs.
    rank: Spearman's correlation.
    """

    of: Annotated[tuple[str, str], Field(strict=False)]
    rank: Annotated[float, CORRELATION]


def _random(
    of: str, inputs: dict[str, Inputs], correlations: Sequence[CorrelationTable] = (), names: Iterable[str] = INPUTS
) -> RandomInputs:
    """Make the inputs of a table in SI; ValueError for a wrong one or correlation, or a name that is not of `names`."""
    distributions = {}
    for name, table in inputs.items():
        try:
            known = INPUTS[checked(name, names)]
            distributions[known] = table.build(FACTORS.get(KNOWN[known].units, 1.0))
        except (TypeError, ValueError) as error:
            raise ValueError(f"{of}.inputs.{name}: {error}") from None
    pairs = {}
    for correlation in correlations:
        first, second = (INPUTS.get(name, name) for name in correlation.of)  # (another name is an error below)
        pairs[first, second] = correlation.rank
    try:
        return RandomInputs(distributions, pairs)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{of}: {error}") from None


class UncertaintyTable(Table):
    """Uncertain inputs and requested indices.

    correlations: Rank correlations.
    samples: Number of Latin hypercube samples.
    seed: Seed of the samples.
    """

    inputs: Annotated[
        dict[str, Inputs],
        Field(
            min_length=1,
            description=f"Uncertain inputs by name: {', '.join(INPUTS)}; those of a restraint are of each block's.",
        ),
    ]
    correlations: Annotated[list[CorrelationTable] | None, KeyInfo("none")] = None
    samples: Annotated[int, Field(ge=2, le=MOST_SAMPLES)] = SAMPLES
    seed: Seed = 0
    sobol: Sobol = None

    def build(self) -> RandomInputs:
        """Make the inputs; ValueError for a distribution or correlation that is invalid, or a name without its unit."""
        return _random("uncertainty", self.inputs, self.correlations or ())


RIGID, OWN, GIVEN, PREVIOUS = "rigid", "own", "given", "previous"
"""References of a value: the rigid block, the block's own e_R, a given value, the value before."""


class Sweep(NamedTuple):
    """The varied parameter and the options of its evaluation.

    `parameter`: delta or e. `values`: increasing. `reference`: `RIGID`, `OWN` or a value. `friction`: the coefficient
    of friction between block and floor. `replicates`, `seed`, `confidence`: of the bootstrap over motions.
    """

    parameter: str
    values: Array
    reference: str | float
    friction: float
    replicates: int
    seed: int
    confidence: float


class SensitivityTable(Table):
    """Dependence of results on delta or e.

    parameter: Varied parameter; the laws must not give it, nor `restitution_factor` over e.
    values: Values, increasing.
    reference: Reference of the comparison: rigid (Housner's impact), own (the block's e_R), or a value.
    inputs: Inputs of the tornado and of Sobol' indices, the parameter among them.
    """

    parameter: Literal["delta", "e"]
    values: Annotated[list[float], Field(min_length=2, max_length=200)]
    reference: Annotated[str | float | None, KeyInfo("rigid over delta, own over e")] = None
    replicates: Replicates = Fit.replicates
    seed: ResamplingSeed = 0
    confidence: Confidence = Fit.confidence
    inputs: Annotated[dict[str, Inputs] | None, KeyInfo("none"), Field(min_length=1)] = None
    sobol: Sobol = None

    @model_validator(mode="after")
    def _in_range(self) -> Self:
        bounds = DELTA if self.parameter == "delta" else RESTITUTION
        for number in (*self.values, *([self.reference] if isinstance(self.reference, float | int) else [])):
            bounds.number(f"values and reference of {self.parameter}", number)
        if any(after <= before for before, after in zip(self.values, self.values[1:], strict=False)):
            raise ValueError(f"values must increase, got {', '.join(f'{value:g}' for value in self.values)}")
        if len({f"{value:g}" for value in self.values}) < len(self.values):
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
            self.parameter, np.array(self.values), reference, friction, self.replicates, self.seed, self.confidence
        )

    def random_inputs(self) -> RandomInputs | None:
        """Make the inputs of tornado and indices; ValueError for an invalid distribution or a choice of laws."""
        if self.inputs is None:
            return None
        if "law" in self.inputs:
            raise ValueError("sensitivity.inputs has no law: every law stands by itself")
        return _random("sensitivity", self.inputs, names=[name for name in INPUTS if name != "law"])
