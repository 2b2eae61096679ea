"""What a study does with its motions: each at every level (ida), a set a level (stripes), or each once (cloud)."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..fragility import cloud, ida, stripes
from ..fragility.scaling import ground_of, intensities, intensity_measure, scaling
from ..models import Block, Law
from ..motions import records

if TYPE_CHECKING:
    from distributed import Client

    from ..fragility.runners import Runner

Progress = Callable[[int, int], None]
Motions = tuple[xr.DataArray, ...]


class Design(ABC):
    """Motions and what is done with them; `im` is the measure, `ground` what it is taken of where not the motions."""

    motions: tuple[Any, ...]
    ground: tuple[Any, ...]
    im: str
    name: ClassVar[str]
    """Its key in study files."""

    @property
    def arrays(self) -> Motions:
        """All motions that blocks stand on."""
        return self.motions

    @property
    def below(self) -> Motions:
        """All ground motions whose measure counts instead; none where the motions' own does."""
        return self.ground

    @property
    def levels(self) -> NDArray[np.float64]:
        """Levels of the measure; none where every motion has an intensity of its own."""
        return np.empty(0)

    def highest(self, runs: xr.Dataset) -> xr.DataArray | float:
        """The highest shaking of its runs, in the measure; on block where that depends on it."""
        return float(self.levels[-1]) if self.levels.size else runs["intensity"].max("motion")

    @property
    def shakes(self) -> int:
        """Number of motions, those of every floor."""
        return sum(array.sizes["motion"] * array.sizes.get("floor", 1) for array in self.arrays)

    @property
    def floors(self) -> list[str]:
        """The floors whose motions these are, each once; none where they are not of floors."""
        every = [array["floor"].values for array in self.arrays if "floor" in array.dims]
        return list(dict.fromkeys(str(floor) for one in every for floor in one))

    @property
    def runs(self) -> int:
        """Number of runs of one block under one law."""
        return self.shakes

    @property
    def words(self) -> str:
        """Its size for people: 60 motions × 3 floors × 16 levels."""
        floors = {array.sizes.get("floor", 1) for array in self.arrays}
        each = floors.pop() if len(floors) == 1 else 1
        found = count(self.shakes // each, "motion")
        return found if each == 1 else f"{found} × {count(each, 'floor')}"

    @abstractmethod
    def check(self, blocks: Sequence[Block]) -> None:
        """ValueError for what would only be found when it runs: motions, levels and measure do not go together."""

    @abstractmethod
    def run(
        self,
        blocks: Sequence[Block],
        models: Sequence[Law],
        outputs: Sequence[str],
        client: Client | Runner | None,
        progress: Progress | None,
    ) -> xr.Dataset:
        """All runs, labelled."""


@dataclass(frozen=True)
class Incremental(Design):
    """Every motion at every level."""

    motions: Motions
    ground: Motions
    im: str
    at: NDArray[np.float64]
    name: ClassVar[str] = "ida"

    @property
    def levels(self) -> NDArray[np.float64]:
        return self.at

    @property
    def runs(self) -> int:
        return self.shakes * self.at.size

    @property
    def words(self) -> str:
        return f"{super().words} × {count(self.at.size, 'level')}"

    def check(self, blocks: Sequence[Block]) -> None:
        plain = records(self.motions)
        scaling(self.at, plain, self.im, blocks, ground_of(plain, records(self.ground)) if self.ground else None)

    def run(
        self,
        blocks: Sequence[Block],
        models: Sequence[Law],
        outputs: Sequence[str],
        client: Client | Runner | None,
        progress: Progress | None,
    ) -> xr.Dataset:
        ground = self.ground or None
        return ida(
            blocks,
            models,
            self.motions,
            self.at,
            self.im,
            outputs,
            client=client,
            screen=False,
            ground=ground,
            progress=progress,
        )


@dataclass(frozen=True)
class Stripes(Design):
    """A set of motions at each level; `scale`: scaled to it, or taken as they are."""

    motions: tuple[Motions, ...]
    ground: tuple[Motions, ...]
    im: str
    at: NDArray[np.float64]
    scale: bool
    name: ClassVar[str] = "stripes"

    @property
    def arrays(self) -> Motions:
        return tuple(_flat(self.motions))

    @property
    def below(self) -> Motions:
        return tuple(_flat(self.ground))

    @property
    def levels(self) -> NDArray[np.float64]:
        return self.at

    @property
    def words(self) -> str:
        return f"{super().words} in {count(self.at.size, 'stripe')}"

    def check(self, blocks: Sequence[Block]) -> None:
        for i, (level, motions) in enumerate(zip(self.at, self.motions, strict=True)):
            plain = records(motions)
            below = ground_of(plain, records(self.ground[i])) if self.ground else None
            scaling([level], plain, self.im, blocks, below)

    def run(
        self,
        blocks: Sequence[Block],
        models: Sequence[Law],
        outputs: Sequence[str],
        client: Client | Runner | None,
        progress: Progress | None,
    ) -> xr.Dataset:
        return stripes(
            blocks,
            models,
            self.motions,
            self.at,
            self.im,
            outputs,
            client=client,
            scale=self.scale,
            screen=False,
            ground=self.ground or None,
            progress=progress,
        )


@dataclass(frozen=True)
class Cloud(Design):
    """Every motion once, as it is."""

    motions: Motions
    ground: Motions
    im: str
    name: ClassVar[str] = "cloud"

    def check(self, blocks: Sequence[Block]) -> None:
        plain = records(self.motions)
        measure = intensity_measure(self.im)
        if measure is None:
            raise ValueError(f"cloud.im must be a measure of the motions, got {self.im!r}")
        intensities(measure, ground_of(plain, records(self.ground)) if self.ground else plain, blocks)

    def run(
        self,
        blocks: Sequence[Block],
        models: Sequence[Law],
        outputs: Sequence[str],
        client: Client | Runner | None,
        progress: Progress | None,
    ) -> xr.Dataset:
        ground = self.ground or None
        return cloud(
            blocks,
            models,
            self.motions,
            self.im,
            outputs,
            client=client,
            screen=False,
            ground=ground,
            progress=progress,
        )


def count(n: int, noun: str) -> str:
    """A number of things: 1 block, 12,000 runs."""
    return f"{n:,} {noun}{'' if n == 1 else 's'}"


def _flat(sets: tuple[Motions, ...]) -> Iterator[xr.DataArray]:
    for one in sets:
        yield from one
