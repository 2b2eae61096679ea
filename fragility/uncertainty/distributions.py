"""Distributions of uncertain inputs: numbers, and choices among words and damping laws."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...core import checks
from ...core.aliases import Array
from ...core.distributions import Beta, Continuous, Distribution, Least, Lognormal, Normal, Uniform
from ...models import Law

__all__ = ["Beta", "Categorical", "Continuous", "Distribution", "Least", "Lognormal", "Normal", "Uniform"]


@dataclass(frozen=True)
class Categorical(Distribution):
    """Distribution over several choices: damping laws, their short names, or any other words.

    Parameters
    ----------
    choices : sequence of str or law
        The choices, each once.
    probabilities : sequence of float, optional
        Probability of each choice, > 0, with sum 1; equal if not given.

    Examples
    --------
    >>> import numpy as np
    >>> Categorical(["housner", "discrete"], [0.7, 0.3]).quantile(np.array([0.2, 0.69, 0.71])).tolist()
    ['housner', 'housner', 'discrete']
    """

    choices: Sequence[Any]
    probabilities: Sequence[float] | None = None

    def __post_init__(self) -> None:
        if isinstance(self.choices, str) or not checks.is_several(self.choices):
            raise TypeError(f"choices must be a sequence of laws or words, got {checks.kind(self.choices)}")
        choices = tuple(self.choices)
        for choice in choices:
            if not isinstance(choice, str | Law):
                raise TypeError(f"choices must be laws or words, got {checks.kind(choice)}")
        object.__setattr__(self, "choices", choices)
        labels = self.labels
        if len(labels) < 2 or len(set(labels)) != len(labels):
            raise ValueError(f"choices must be at least two, each once, got {labels!r:.80}")
        if self.probabilities is None:
            return
        shares = checks.finite_array("probabilities", self.probabilities)
        if shares.size != len(labels) or np.any(shares <= 0.0) or abs(float(shares.sum()) - 1.0) > 1e-9:
            raise ValueError(f"probabilities must be {len(labels)} numbers > 0 with sum 1, got {shares.tolist()!r:.80}")
        object.__setattr__(self, "probabilities", tuple(shares.tolist()))

    @property
    def labels(self) -> tuple[str, ...]:
        """The choices as words."""
        return tuple(choice.label if isinstance(choice, Law) else choice for choice in self.choices)

    @property
    def shares(self) -> Array:
        """Probability of each choice."""
        n = len(self.choices)
        return np.full(n, 1.0 / n) if self.probabilities is None else np.array(self.probabilities)

    @property
    def support(self) -> tuple[float, float]:
        return 0.0, float(len(self.choices) - 1)

    def quantile(self, probability: Array) -> NDArray[np.object_]:
        ends = np.cumsum(self.shares)[:-1]
        return np.array(self.labels, dtype=object)[np.searchsorted(ends, probability, side="right")]
