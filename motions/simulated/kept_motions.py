"""Motions that several analyses share: made once, and kept as far as memory allows."""

from __future__ import annotations

import xarray as xr

from .generator import Generator
from .ground_motion_models import Scenario

KEPT_BYTES = 2.0**28
"""Most memory of motions that are kept."""


class KeptMotions(Generator):
    """The motions of a generator, made once as long as they fit into `KEPT_BYTES`; others are made again each time.

    Its `repr` is the generator's, so that results name that, and so are its other properties.
    """

    def __init__(self, generator: Generator) -> None:
        self._generator = generator
        self.along_a_pulse = generator.along_a_pulse  # type: ignore[misc]  # (of the class elsewhere)
        self.own_amplitude = generator.own_amplitude  # type: ignore[misc]
        self._parts: dict[tuple[int, int, int], xr.DataArray] = {}

    def __repr__(self) -> str:
        return repr(self._generator)

    @property
    def scenario(self) -> Scenario | None:
        return self._generator.scenario

    @property
    def outside(self) -> str:
        return self._generator.outside

    def sample(self, n: int, seed: int = 0, first: int = 0) -> xr.DataArray:
        """Return motions as the generator does; the arrays are kept and must not be changed."""
        key = n, seed, first
        if key in self._parts:
            return self._parts[key]
        made = self._generator.sample(n, seed, first)
        if sum(one.nbytes for one in self._parts.values()) + made.nbytes <= KEPT_BYTES:
            self._parts[key] = made
        return made
