"""Designs of a study's motions: each at every level, a set for each level, each once, or at levels of its own."""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar, NamedTuple, Self

import numpy as np
import xarray as xr

from ...core.aliases import Array, Progress
from ...core.doubts import Doubt, noted
from ...core.wording import counted
from ...fragility import HazardCurve, cloud, joint_falls, pooled, stripes
from ...fragility.adaptive.sequential import exploring
from ...fragility.adaptive.stopping import usual_motions
from ...fragility.adaptive.until import Until
from ...fragility.analyses import analysis
from ...fragility.analyses.adaptive import adaptive
from ...fragility.analyses.ida import incremental
from ...fragility.analyses.region_runs import CHECKED_SHARE, checked_runs
from ...fragility.analyses.stripes import stripe_scalings
from ...fragility.analyses.waves import MotionSource
from ...fragility.runs.axes import axes_of
from ...fragility.runs.request import check_request
from ...fragility.runs.runners import Workers
from ...fragility.runs.scaling import ground_of, intensities, intensity_measure, scaling
from ...fragility.surfaces import checks as of_checks
from ...fragility.validity.plausibility import period_doubts
from ...fragility.validity.slab_screen import ScreenRequest
from ...fragility.validity.undecided import choose_motions
from ...models import Block, Law, Model
from ...models.block_array import BlockArray
from ...motions import Generator, records
from ...motions.arrays import BOTH_AXES, REVERSE_OF
from ...motions.polarity import AS_RECORDED, BOTH
from ...motions.simulated.ground_motion_models import Scenario
from ..text.words import value_in
from .reading import UNREAD, Reading

Motions = tuple[xr.DataArray, ...]
POOLED_RUNS = 60.0
"""Runs under one law that a surface takes, times the square of the half width, as seen (docs/adaptive.md)."""
MOST_CHECKS = 3
"""Usual maximum number of checks of a surface: a higher degree or a missed aim takes another one."""
KEPT_BYTES = 2.0**28
"""Most memory of motions that are kept."""


@dataclass(frozen=True)
class Design(ABC):
    """Motions and their analysis; `im` is the measure, taken of the `ground` motions if these are given."""

    motions: tuple[Any, ...]
    ground: tuple[Any, ...]
    im: str
    levels: Array = field(default_factory=lambda: np.empty(0), kw_only=True)
    """Levels of the measure; empty if every motion has an intensity of its own."""
    reading: Reading = field(default=UNREAD, kw_only=True)
    name: ClassVar[str] = "ida"
    """Its key in study files."""

    @property
    def doubts(self) -> list[Doubt]:
        """The input warnings on the records and on the measure."""
        far = () if self.levels.size and getattr(self, "scale", True) else self.reading.far
        return [*self.reading.doubts, *far, *period_doubts(self.im)]

    @property
    def arrays(self) -> Motions:
        """All motions of the blocks."""
        return self.motions

    @property
    def below(self) -> Motions:
        """All ground motions whose measure defines the levels; none if the motions' own measure does."""
        return self.ground

    def highest(self, runs: xr.Dataset) -> xr.DataArray | float:
        """The highest level of the runs, in the measure; on block if the measure depends on the block."""
        return float(self.levels[-1]) if self.levels.size else runs["intensity"].max("motion")

    def lowest(self, runs: xr.Dataset) -> xr.DataArray | float:
        """The lowest level of the runs, in the measure; on block if the measure depends on the block."""
        return float(self.levels[0]) if self.levels.size else runs["intensity"].min("motion")

    @property
    def shakes(self) -> int:
        """Number of motions, counted on every floor, those run both ways twice."""
        return sum(array.sizes["motion"] * array.sizes.get("floor", 1) for array in self.arrays)

    @property
    def both_ways(self) -> bool:
        """True if every motion is run both ways."""
        return any(REVERSE_OF in array.coords for array in self.arrays)

    @cached_property
    def axes(self) -> str:
        """Axes along which pairs of components act (`axes_of`), '' for one component."""
        # (the motions of an array shake alike: reading one of them is a thousandth of the work)
        return axes_of([record for array in self.arrays for record in records(array.isel(motion=slice(1)))])

    @property
    def about(self) -> int:
        """Number of axes about which each run is made."""
        return 2 if self.axes == BOTH_AXES else 1

    @property
    def floors(self) -> list[str]:
        """The floors that the motions are of, each once; empty if the motions are of the ground."""
        every = [array["floor"].values for array in self.arrays if "floor" in array.dims]
        return list(dict.fromkeys(str(floor) for floors in every for floor in floors))

    @property
    def runs(self) -> int:
        """Number of runs of one block under one law."""
        return self.shakes

    def tested(self, share: float) -> int:
        """Return the number of runs of one block under one law whose outcomes are tested as undecided."""
        return 0 if share == 0.0 else self.runs // self.shakes * int(choose_motions(self.shakes, share).sum())

    @property
    def words(self) -> str:
        """The size of the design in words: 60 motions × 3 floors × 16 levels."""
        floors = {array.sizes.get("floor", 1) for array in self.arrays}
        per_motion = floors.pop() if len(floors) == 1 else 1
        words = counted(self.shakes // per_motion, "motion") + (" about both axes" if self.about == 2 else "")
        if self.both_ways:
            words = f"{counted(self.shakes // per_motion // 2, 'motion')} both ways"
        return words if per_motion == 1 else f"{words} × {counted(per_motion, 'floor')}"

    @abstractmethod
    def check(self, blocks: Sequence[Block]) -> None:
        """Raise a ValueError if motions, levels and measure do not go together, before anything runs."""

    def run(
        self,
        blocks: Sequence[Block] | BlockArray,
        models: Sequence[Model],
        outputs: Sequence[str],
        client: Workers,
        progress: Progress | None,
    ) -> xr.Dataset:
        """Return all runs of blocks under laws as a labelled dataset; of a pooled surface, its curves of all blocks."""
        ground = self.ground or None
        with noted():  # a study has input warnings among its notes
            results = self._analysed(
                blocks, models, outputs, client=client, screen=False, ground=ground, progress=progress
            )
        return results.assign_coords(self._below())

    def _below(self) -> dict[str, xr.Variable]:
        """Return the response of buildings and supports to each motion, as coordinates of the runs; none if scaling."""
        return {}

    @abstractmethod
    def _analysed(self, blocks: Any, models: Any, outputs: Sequence[str], **options: Any) -> xr.Dataset:
        """Return the runs of the analysis that has the design's name, with the options that all analyses share."""


@dataclass(frozen=True)
class Incremental(Design):
    """Every motion at every level."""

    @property
    def runs(self) -> int:
        return self.shakes * self.levels.size

    @property
    def words(self) -> str:
        return f"{super().words} × {counted(self.levels.size, 'level')}"

    def check(self, blocks: Sequence[Block]) -> None:
        self.scaled(blocks)

    def scaled(self, blocks: Sequence[Block]) -> analysis.Design:
        """Return the motions with the factors that scale them to the levels; ValueError as of `check`."""
        return incremental(self.levels, self.motions, self.im, blocks, self.ground or None)

    def _analysed(self, blocks: Any, models: Any, outputs: Sequence[str], **options: Any) -> xr.Dataset:
        request = check_request(
            blocks, models, outputs, True, options["client"], options["progress"], options["screen"]
        )
        return analysis.analyse(request, analysis.specimens_of(request), self.scaled(request.blocks))


class KeptMotions(Generator):
    """The motions of a generator, made once as long as they fit into `KEPT_BYTES`; its `repr` is the generator's."""

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
        if sum(part.nbytes for part in self._parts.values()) + made.nbytes <= KEPT_BYTES:
            self._parts[key] = made
        return made


@dataclass(frozen=True)
class Waves(Design):
    """Motion after motion, each with `runs_per_motion` runs, until the answer is as precise as requested."""

    until: Until
    runs_per_motion: int
    seed: int
    generator: Generator | None = None
    both: bool = False
    needs: ClassVar[tuple[str, str]]
    """Beginnings of the refusals of several floors, and of too few motions."""

    @property
    def both_ways(self) -> bool:
        return self.both

    @property
    def source(self) -> MotionSource:
        """The motions as the analysis takes them."""
        motions = self.motions if self.generator is None else self.generator
        return MotionSource(motions, self.seed, self.ground or None, BOTH if self.both else AS_RECORDED)

    def check(self, blocks: Sequence[Block]) -> None:
        plain = records(self.motions)
        scaling([1.0], plain, self.im, blocks, ground_of(plain, records(self.ground)) if self.ground else None)
        if len(self.floors) > 1:
            raise ValueError(f"{self.needs[0]} the motions of one floor, got several")
        size, least = sum(array.sizes["motion"] for array in self.arrays), self.until.least
        if self.generator is None and size < least:
            raise ValueError(f"{self.needs[1]} {least} motions at least (until.motions.least), got {size}")


@dataclass(frozen=True)
class Sequential(Waves):
    """Runs at a few levels of each motion's own."""

    screening: ScreenRequest | None = None
    needs: ClassVar[tuple[str, str]] = ("adaptive levels need", "adaptive levels need")

    @property
    def one_way(self) -> Self:
        """The same with every motion as it is: a slip to either side is as long under the reversed motion."""
        return replace(self, both=False)

    @property
    def keeping(self) -> Self:
        """The same, whose runs share the motions of a generator with other runs of it, which are made once."""
        return self if self.generator is None else replace(self, generator=KeptMotions(self.generator))

    @property
    def kept_bytes(self) -> float:
        """Most bytes of motions that it keeps."""
        if self.generator is None:
            return 0.0
        shaking: xr.DataArray = self.motions[0]
        return min(KEPT_BYTES, self.until.most * shaking.nbytes / shaking.sizes["motion"])

    @property
    def shakes(self) -> int:
        return self.until.most * (2 if self.both else 1)

    @property
    def runs(self) -> int:
        return self.runs_of(self.until.most, self.until.least)

    def runs_of(self, motions: int, first: int) -> int:
        """Return the number of runs of one block under one law and `motions` motions; the `first` have more."""
        ways = 2 if self.both_ways else 1
        more = exploring(self.runs_per_motion) - self.runs_per_motion
        return ways * (motions * self.runs_per_motion + more * first)

    def tested(self, share: float) -> int:
        return self.tested_of(share, self.until.most, self.until.least)

    def tested_of(self, share: float, motions: int, first: int) -> int:
        """Return the number of tested runs under `motions` motions (`runs_of`)."""
        return self.runs_of(math.ceil(share * motions), math.ceil(share * first))

    @property
    def expected(self) -> tuple[int, int, int]:
        """Approximate number of motions for the precision: few, usual, many (`usual_motions`)."""
        return usual_motions(self.until, self.runs_per_motion)

    @property
    def words(self) -> str:
        ways = " both ways" if self.both else " about both axes" if self.about == 2 else ""
        measure = intensity_measure(self.im)
        until = self.until.words(value_in(self.until.level, "1" if measure is None else measure.units))
        return f"up to {counted(self.until.most, 'motion')}{ways} at adaptive levels, {until}"

    def highest(self, runs: xr.Dataset) -> xr.DataArray | float:
        levels = np.zeros(runs.sizes["block"])
        np.maximum.at(levels, runs["run_block"].values, runs["level"].values)
        return xr.DataArray(levels, dims="block")

    def lowest(self, runs: xr.Dataset) -> xr.DataArray | float:
        levels = np.full(runs.sizes["block"], np.inf)
        np.minimum.at(levels, runs["run_block"].values, runs["level"].values)
        return xr.DataArray(levels, dims="block")

    def _analysed(self, blocks: Any, models: Any, outputs: Sequence[str], **options: Any) -> xr.Dataset:
        # (the screen is made with the waves, whose motions are not kept)
        request = check_request(
            blocks, models, outputs, True, options["client"], options["progress"], self.screening is not None
        )
        return adaptive(request, self.source, self.im, self.until, self.runs_per_motion, self.seed, self.screening)


class Events(NamedTuple):
    """Events in which a sample of a region is run: levels (level,), SI, motions at each, and blocks of the sample."""

    levels: Array
    motions: int
    sample: int

    def runs_of(self, blocks: int) -> int:
        """Return the number of runs of a region of `blocks` blocks under one law."""
        return self.levels.size * self.motions * min(self.sample, blocks)


@dataclass(frozen=True)
class Pooled(Waves):
    """One surface of all blocks under each law: every motion runs several blocks once."""

    events: Events | None = None
    hazard: HazardCurve | None = None
    needs: ClassVar[tuple[str, str]] = ("levels = 'pooled' needs", "a pooled surface needs")

    @property
    def runs(self) -> int:
        return MOST_CHECKS * self.runs_of(self.until.most)

    def runs_of(self, motions: int) -> int:
        """Return the number of runs under one law and `motions` motions, including one check and its rates."""
        every = sum(array.sizes["motion"] for array in self.arrays)
        checked = every if self.generator is None else max(of_checks.MOTIONS, motions // CHECKED_SHARE)
        of_a_motion = of_checks.BLOCKS * sum(checked_runs(self.generator is not None, self.hazard is not None))
        return (2 if self.both_ways else 1) * (motions * self.runs_per_motion + checked * of_a_motion)

    @property
    def words(self) -> str:
        ways = " both ways" if self.both_ways else ""
        return f"up to {counted(self.until.most, 'motion')}{ways} for one surface, {self.until.words()}"

    @property
    def expected(self) -> tuple[int, int, int]:
        """Approximate number of motions for the precision: few, usual, many."""
        usual = POOLED_RUNS / self.runs_per_motion / self.until.room**2
        return tuple(  # type: ignore[return-value]
            math.ceil(min(max(self.until.least, usual * factor), self.until.most)) for factor in (0.5, 1.0, 3.0)
        )

    def highest(self, runs: xr.Dataset) -> xr.DataArray | float:
        return float(runs["run_level"].max())

    def lowest(self, runs: xr.Dataset) -> xr.DataArray | float:
        return float(runs["run_level"].min())

    def _analysed(self, blocks: Any, models: Any, outputs: Sequence[str], **options: Any) -> xr.Dataset:
        return pooled(
            blocks,
            models,
            self.motions if self.generator is None else self.generator,
            self.im,
            self.until,
            options["client"],
            ground=options["ground"],
            polarity=BOTH if self.both else AS_RECORDED,
            hazard=self.hazard,
            blocks_per_motion=self.runs_per_motion,
            seed=self.seed,
            progress=options["progress"],
        )

    def falls(
        self, blocks: BlockArray, models: Sequence[Law], client: Workers, progress: Progress | None
    ) -> xr.Dataset:
        """Return the share of the region that falls in one event (`fragility.joint_falls`), under other motions."""
        assert self.events is not None
        motions: Any = list(self.motions)
        if self.generator is not None:
            motions = self.generator.sample(self.events.motions, self.seed, self.until.most)
        levels, _, sample = self.events
        options: dict[str, Any] = {"ground": self.ground or None, "sample": sample, "seed": self.seed}
        return joint_falls(blocks, models, motions, levels, self.im, client, progress=progress, **options)


@dataclass(frozen=True)
class Stripes(Design):
    """A set of motions at each level, scaled to it if `scale` is set; `selections` gives their agreement."""

    scale: bool
    selections: tuple[xr.Dataset, ...] = ()
    name: ClassVar[str] = "stripes"

    @property
    def arrays(self) -> Motions:
        return tuple(_flat(self.motions))

    @property
    def below(self) -> Motions:
        return tuple(_flat(self.ground))

    @property
    def words(self) -> str:
        return f"{super().words} in {counted(self.levels.size, 'stripe')}"

    def check(self, blocks: Sequence[Block]) -> None:
        sets = [records(motions) for motions in self.motions]
        below = [records(motions) for motions in self.ground] if self.ground else [None] * len(sets)
        stripe_scalings(self.levels, sets, self.im, blocks, below, self.scale)

    def _analysed(self, blocks: Any, models: Any, outputs: Sequence[str], **options: Any) -> xr.Dataset:
        return stripes(blocks, models, self.motions, self.levels, self.im, outputs, scale=self.scale, **options)

    def _below(self) -> dict[str, xr.Variable]:
        return answers_below(self.arrays)


@dataclass(frozen=True)
class Cloud(Design):
    """Every motion once, as it is."""

    name: ClassVar[str] = "cloud"

    def check(self, blocks: Sequence[Block]) -> None:
        plain = records(self.motions)
        measure = intensity_measure(self.im)
        if measure is None:
            raise ValueError(f"cloud.im must be a measure of the motions, got {self.im!r}")
        intensities(measure, ground_of(plain, records(self.ground)) if self.ground else plain, blocks)

    def _analysed(self, blocks: Any, models: Any, outputs: Sequence[str], **options: Any) -> xr.Dataset:
        return cloud(blocks, models, self.motions, self.im, outputs, **options)

    def _below(self) -> dict[str, xr.Variable]:
        return answers_below(self.arrays)


BELOW: dict[str, tuple[str, float]] = {
    "ductility": ("building_ductility", math.nan),
    "collapsed": ("building_collapsed", 0.0),
    "strength_factor": ("building_strength_factor", math.nan),
    "isolator_displacement": ("building_isolator_displacement", math.nan),
    "support_displacement": ("support_displacement", math.nan),
    "strikes": ("support_strikes", 0.0),
    "strike_acceleration": ("support_strike_acceleration", math.nan),
}
"""Coordinates of motions with the response of a building or a support: their names in results, and without one."""


def answers_below(arrays: Sequence[xr.DataArray]) -> dict[str, xr.Variable]:
    """Return the response of buildings and supports to all motions of the arrays, floor by floor."""
    answers = {}
    for name, (called, none) in BELOW.items():
        attributes = next((array[name].attrs for array in arrays if name in array.coords), None)
        if attributes is None:
            continue
        values = []
        for array in arrays:
            like = array.isel(time=0, drop=True)
            response = like[name] if name in array.coords else xr.DataArray(none)
            values.append(response.broadcast_like(like).transpose(*like.dims).values.ravel())
        answers[called] = xr.Variable("motion", np.concatenate(values), attributes)
    return answers


def _flat(sets: tuple[Motions, ...]) -> Iterator[xr.DataArray]:
    for motions in sets:
        yield from motions
