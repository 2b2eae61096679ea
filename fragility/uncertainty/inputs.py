"""Random inputs: the uncertain properties of a block and its damping law, their correlations, and samples of them."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import scipy
import xarray as xr

from ...core import checks
from ...core.doubts import Doubt, first_of
from ...core.elementary import Array, cholesky, times
from ...core.parameters import CORRELATION
from ...core.streams import stream
from ...core.units import DIMENSIONLESS, described, provenance
from ...models import Block, Law
from .distributions import Categorical, Distribution, Least, Lognormal, Normal
from .realisation import (
    KNOWN,
    LAW,
    PREFIX,
    RESTRAINT,
    InputRange,
    block_with,
    check_known,
    check_restitution,
    laws_of,
    taken_by,
)

METHODS = ("latin-hypercube", "sobol", "random")
# A point on the edge of the unit cube has no finite score: Sobol' points are multiples of this.
LEAST = 2.0**-32
SIZED = ("alpha", "R", "width", "height", *RESTRAINT)
"""Inputs that replace a number of the nominal block."""
OF_LAWS = ("e", "zeta")
"""Inputs that replace a number of the nominal law, which has no default."""
WIDEST = 1.5
"""Maximum logarithmic standard deviation of a property: of strengths it is 0.2 to 0.6 (assumed)."""
FAR = 3.0
"""Standard score beyond which the nominal value is no sample."""
FACTORS = ("alpha_factor", "R_factor")
"""Inputs that multiply a number of the nominal block."""
OFF = 2.0
"""Ratio of a factor to 1, beyond which it is no factor but the number itself, an angle or a size."""


@dataclass(frozen=True)
class RandomInputs:
    """Uncertain inputs by name, each with its distribution, and their rank correlations.

    Parameters
    ----------
    distributions : mapping of str to Distribution
        Of a block: `alpha` (rad) and `R` (m), or `alpha_factor` and `R_factor` on the nominal block's values, or
        `width`, `height` and `cm_height` (m); and `inertia_factor`. Of its restraint: `restraint_strength` (N) and
        `restraint_stiffness` (N/m). Of its law: `e`, `restitution_factor`, `delta`, `zeta`, `coefficient`, and `law`, a
        `Categorical` of laws or their short names. Other names are for functions of the user (`sobol_indices`); no
        block or law has them.
    rank_correlation : mapping of pairs of names to float, optional
        Spearman's correlations, between -1 and 1; 0 if not given.

    Raises
    ------
    TypeError, ValueError
        An input that is no distribution. A support that leaves the physical range (0 < e <= 1, 0 < delta < 1, 0 < alpha
        < pi/2, 1 < inertia_factor <= 2 …), which must be truncated. Correlations that no joint distribution has, or of
        a choice, which has no ranks. Two inputs that define the same property.

    Notes
    -----
    The inputs have a Gaussian copula: their scores have the correlation 2 sin(pi rho/6), and thus the rank correlation
    rho (Pearson 1907).

    Examples
    --------
    >>> from toppling.fragility import Beta, Lognormal
    >>> inputs = RandomInputs(
    ...     {"e": Beta(4.0, 2.0, 0.8, 1.0), "R_factor": Lognormal(1.0, 0.1)}, {("e", "R_factor"): 0.3}
    ... )
    >>> dict(inputs.sample(8, seed=1).sizes)
    {'sample': 8}
    """

    distributions: Mapping[str, Distribution]
    rank_correlation: Mapping[tuple[str, str], float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not isinstance(self.distributions, Mapping) or not self.distributions:
            raise TypeError(f"distributions must map names to distributions, got {checks.kind(self.distributions)}")
        for name, distribution in self.distributions.items():
            if not isinstance(name, str) or not name.isidentifier() or name == "sample":
                raise TypeError(f"names of inputs must be words such as 'e', other than 'sample', got {name!r:.40}")
            if not isinstance(distribution, Distribution):
                raise TypeError(
                    f"input {name!r} must be a distribution, such as Uniform(0.8, 1.0), got {checks.kind(distribution)}"
                )
        check_known(self.distributions)
        object.__setattr__(self, "distributions", dict(self.distributions))
        object.__setattr__(self, "rank_correlation", dict(self.rank_correlation))
        _ = self._factor

    @property
    def names(self) -> tuple[str, ...]:
        """The inputs in order."""
        return tuple(self.distributions)

    @property
    def independent(self) -> bool:
        """True if no two inputs are correlated."""
        return not any(self.rank_correlation.values())

    @property
    def _factor(self) -> Array:
        """Cholesky factor of the correlation matrix of scores; ValueError if there is no such joint distribution."""
        names = self.names
        matrix = np.eye(len(names))
        given: dict[frozenset[str], float] = {}
        for pair, value in self.rank_correlation.items():
            if not isinstance(pair, tuple) or len(pair) != 2 or not {*pair} <= {*names} or pair[0] == pair[1]:
                raise ValueError(f"rank_correlation must be of pairs of {', '.join(names)}, got {pair!r:.60}")
            rho = CORRELATION.number(f"rank_correlation of {pair[0]} and {pair[1]}", value)
            for name in pair:
                if isinstance(self.distributions[name], Categorical):
                    raise ValueError(f"{name!r} is a choice and has no ranks: it cannot be correlated")
            i, j = (names.index(name) for name in pair)
            if given.setdefault(frozenset(pair), rho) != rho:
                raise ValueError(f"rank_correlation of {pair[0]} and {pair[1]} is given twice and differs, got {rho:g}")
            matrix[i, j] = matrix[j, i] = 2.0 * math.sin(math.pi * rho / 6.0)
        try:
            return cholesky(matrix)
        except np.linalg.LinAlgError:
            raise ValueError(
                f"rank_correlation must be positive definite as 2 sin(pi rho/6), got {self.rank_correlation!r:.80}"
            ) from None

    def sample(self, n: int, seed: int = 0, method: str = "latin-hypercube") -> xr.Dataset:
        """Return samples of the inputs.

        Parameters
        ----------
        n : int
            Number of samples, >= 1; a power of 2 for ``sobol``.
        seed : int
            Seed of the scrambling; the same seed gives the same samples.
        method : {"latin-hypercube", "sobol", "random"}
            Method by which the unit cube is filled.

        Returns
        -------
        xarray.Dataset
            One variable for each input, on ``sample``, with units; choices as words.
        """
        count, start = checks.count("n", n, at_least=1), checks.count("seed", seed)
        checks.choice("method", method, METHODS)
        random = stream(start)
        d = len(self.names)
        if method == "sobol":
            if count & (count - 1):
                raise ValueError(f"n must be a power of 2 with method='sobol', got {count}")
            points = scipy.stats.qmc.Sobol(d, scramble=True, seed=random).random(count)
        elif method == "latin-hypercube":
            points = scipy.stats.qmc.LatinHypercube(d, seed=random).random(count)
        else:
            points = random.random((count, d))
        return self.at(points).assign_attrs(method=method, seed=start)

    def at(self, points: Array) -> xr.Dataset:
        """Return the inputs at points (sample, input) of the unit cube: probabilities of independent scores."""
        cube = checks.finite_array("points", points, ndim=(2,))
        if cube.shape[1] != len(self.names) or cube.min() < 0.0 or cube.max() > 1.0:
            raise ValueError(
                f"points must be between 0 and 1 in {len(self.names)} columns, got an array of shape {cube.shape} "
                f"from {cube.min():g} to {cube.max():g}"
            )
        inside = np.clip(cube, LEAST, 1.0 - LEAST)
        if not self.independent:
            inside = scipy.special.ndtr(times(scipy.special.ndtri(inside), self._factor.T))
        variables = {}
        for i, (name, distribution) in enumerate(self.distributions.items()):
            known = KNOWN.get(name, InputRange(DIMENSIONLESS, name, -math.inf, math.inf))
            attributes = described(known.long_name, known.units)
            variables[name] = ("sample", distribution.quantile(inside[:, i]), attributes)
        index = np.arange(cube.shape[0])
        return xr.Dataset(
            variables,
            coords={"sample": ("sample", index, described("sample of the inputs"))},
            attrs={
                "title": "Samples of uncertain inputs",
                **provenance({"analysis": "samples of inputs", "inputs": self.description}),
                "inputs": json.dumps(self.description, ensure_ascii=False),
            },
        )

    @property
    def description(self) -> dict[str, Any]:
        """The inputs as plain values."""
        return {
            "distributions": {name: repr(distribution) for name, distribution in self.distributions.items()},
            "rank_correlation": {f"{a}, {b}": value for (a, b), value in self.rank_correlation.items()},
        }

    def realise(self, block: Block, model: Law, samples: xr.Dataset) -> list[tuple[Block, Law]]:
        """Return a block and a law for every sample: the nominal block and law with the uncertain properties.

        Parameters
        ----------
        block : Block
            The nominal block. Its ratio of cm_height to height is kept if only one of them or neither is an input, and
            its inertia factor if that is no input.
        model : law
            The nominal law; if `law` is an input, it is not used.
        samples : xarray.Dataset
            As `sample` returns them.

        Raises
        ------
        TypeError, ValueError
            An input that no block or law has, or that none of the laws has. A law with the block's own e_R if the
            inputs let e_R be 0 or less, or above 1 with its factor.

        Notes
        -----
        An input that the drawn law does not have (such as e for Vassiliou's law) has no effect on that sample.

        Examples
        --------
        >>> import toppling as tp
        >>> from toppling.fragility import Uniform
        >>> inputs = RandomInputs({"delta": Uniform(0.01, 0.1)})
        >>> pairs = inputs.realise(tp.catalogue["bookcase-5-shelf"], tp.DiscreteDamping(), inputs.sample(3))
        >>> len(pairs), pairs[0][0].label
        (3, 'bookcase-5-shelf')
        """
        if not isinstance(block, Block):
            raise TypeError(f"block must be a toppling Block, got {checks.kind(block)}")
        if not isinstance(model, Law):
            raise TypeError(f"model must be a damping law such as DiscreteDamping(), got {checks.kind(model)}")
        unknown = [name for name in self.names if name not in KNOWN]
        if unknown:
            raise ValueError(f"inputs of a block and its law must be among {', '.join(KNOWN)}, got {unknown[0]!r}")
        missing = [name for name in self.names if not isinstance(samples, xr.Dataset) or name not in samples]
        if missing:
            raise ValueError(f"samples must hold every input, as RandomInputs.sample gives them, got no {missing[0]!r}")
        checks.plain("samples", samples)
        laws = laws_of(self.distributions[LAW]) if LAW in self.names else {"": model}
        taken = taken_by(laws, self.names)
        check_restitution(block, laws.values(), self.distributions)
        if block.bed is not None and "delta" in self.names:
            raise ValueError(f"input 'delta' has no effect: {block.label!r} stands on a bed, where delta is not used")
        columns = {name: samples[name].values for name in self.names}
        pairs = []
        for k in range(samples.sizes["sample"]):
            values = {name: column[k] for name, column in columns.items()}
            label = str(values.get(LAW, ""))
            if label not in laws:
                raise ValueError(f"sample {k} has law {label!r}, which is none of {', '.join(laws)}")
            options = {name: float(values[name]) for name in taken[label]}
            try:
                pairs.append((block_with(block, values), replace(laws[label], **options)))  # type: ignore[type-var]
            except ValueError as error:
                raise ValueError(f"sample {k}: {error}") from None
        return pairs


def input_doubts(inputs: RandomInputs, blocks: Sequence[Block], models: Sequence[Law] = ()) -> list[Doubt]:
    """Return the input warnings on inputs that are never near a nominal block or law, or that scatter too much."""
    odd, wide, factors = [], [], []
    for name, law in inputs.distributions.items():
        if name == LAW:
            continue
        for part in law.parts if isinstance(law, Least) else (law,):
            if isinstance(part, Normal) and part.std > part.mean:
                wide.append(f"{name}: a standard deviation of {part.std:g}, a mean of {part.mean:g}")
            if isinstance(part, Lognormal) and part.dispersion > WIDEST:
                wide.append(f"{name}: a dispersion of {part.dispersion:g}")
        known = KNOWN[name]
        low, high = law.quantile(scipy.special.ndtr(np.array([-FAR, FAR])))
        edge = 0.01 * (high - low)
        nominal = [(model.label, model.options.get(name)) for model in models if name in OF_LAWS]
        for block in blocks if name in SIZED else ():
            holder = block.restraint if name in RESTRAINT else block
            nominal.append((block.label, getattr(holder, name.removeprefix(PREFIX), None)))
        for label, value in nominal:
            if value is not None and not low - edge <= value <= high + edge:
                unit = "" if known.units == DIMENSIONLESS else f" {known.units}"
                given = f"{known.long_name} {value:.4g}{unit}"
                odd.append(f"{label}: {given}, the input is {low:.4g} to {high:.4g}{unit}")
        if name in FACTORS and not low / OFF <= 1.0 <= OFF * high:
            factors.append(f"{name}: {low:.4g} to {high:.4g}")
    rows = {"inputs_apart": odd, "inputs_wide": wide, "inputs_factors": factors}
    return [Doubt.of(what, named=first_of(named)) for what, named in rows.items() if named]
