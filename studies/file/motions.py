"""The table ``[motions]`` of a study file: one for each generator, pulse or kind of files."""

import math
from abc import abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

import xarray as xr
from pydantic import BeforeValidator, Field, TypeAdapter, model_validator

from ... import motions as shaking
from ...core.doubts import noted
from ...core.parameters import CORRELATION, COUNT, SHARE, STEP, Seed
from ...motions import RecordError
from ...motions.arrays import BOTH_AXES, HORIZONTAL, VERTICAL, WEAK_AXIS
from ...motions.corrections import BASELINE_ORDERS, CORNER, FILTER_ORDER, FILTER_ORDERS, TAPER
from ...motions.pairs import RANDOM, correct_together, pair_up
from ...motions.readers.directions import ON_PURPOSE, horizontal_motions, of_the_ground
from ...motions.readers.patterns import expand
from ..plan.size import refuse_samples
from .derived import By, Derived, choice, chosen_by, derived
from .table import KeyInfo, RelativePath, one_of

PROCESSING = ("baseline_order", "window", "taper_s", "highpass_hz", "lowpass_hz", "order")
"""Keys of the corrections of records, in the order in which they are made."""
RECORD_UNITS = ("g", "m/s2", "cm/s2", "mm/s2", "gal")
PAIR = "pair"
AXES = {"both": shaking.both_axes, "weak": shaking.weak_axis}
SHAKES = {"both": BOTH_AXES, "weak": WEAK_AXIS}
"""Axes of both directions of floor histories, by the same words."""
PAIR_KEYS = ("axes", "azimuth", "correlation")
"""Keys of components that act together."""
SOURCES = ("generator", "pulse", "records", "floors_file", "floors_index")
"""Keys of which one gives the source of the motions."""

Axes = Annotated[
    str | None,
    one_of(AXES),
    KeyInfo("both"),
    Field(
        description="Of a pair: whether blocks rock about both axes, or about their weak axis alone (the width, where "
        "the depth is at least 1.6 times the width)."
    ),
]
Azimuth = Annotated[
    Annotated[float, Field(ge=-360.0, le=360.0)] | Literal["random"] | None,
    KeyInfo(0.0, unit="°"),
    Field(
        description="Of a pair: direction of the blocks' width, of an inventory that of the building's x, clockwise "
        "from north (of simulated pairs from h1). `random`: another one for each motion, by `seed`."
    ),
]
Elastic = Annotated[
    bool | None,
    KeyInfo("histories are not scaled"),
    Field(
        description="Whether floor histories of a performance study may be scaled to its levels, as if the building "
        "were elastic."
    ),
]
Step = Annotated[
    Annotated[float, STEP] | None, KeyInfo("the files' own"), Field(description="Time step, s, of files without.")
]
Unit = Annotated[
    str | None,
    one_of(RECORD_UNITS),
    KeyInfo("the files' own"),
    Field(description="Unit of accelerations in files, for those that state none."),
]


class MotionsTable(Derived):
    """Ground or floor motions: a generator, a pulse, records, or floor histories."""

    source: ClassVar[str]
    """The key of the source of the motions."""

    @property
    def pair(self) -> bool:
        """True if both components act."""
        return bool(self.given("component") == PAIR)

    def samples(self, folder: Path) -> float:
        """The number of samples of all motions that are generated, 0 if they are read; ValueError as `build`."""
        return 0.0

    @abstractmethod
    def build(self, folder: Path = Path(), first: int = 0) -> list[xr.DataArray]:
        """The motions, from number `first` of a generator; ValueError for a wrong parameter or without a record."""

    def made_by(self, folder: Path) -> shaking.Generator | None:
        """Return the generator or pulse of the motions; None for motions that are read."""
        return None

    def refuse_moving(self, folder: Path, im: str) -> None:
        """Raise a ValueError if a measure of velocity or displacement is of motions that end moving."""
        made = self.made_by(folder)
        if made is not None and made.ends_moving and ("pgv" in im or "pgd" in im):
            raise ValueError(
                f"motions: generator {self.given('generator')!r} ends moving, so that {im} depends on the duration; "
                "take 'clough-penzien' with baseline = 'none', or im = 'pga'"
            )

    def _both(self, pairs: list[xr.DataArray], first: int = 0) -> list[xr.DataArray]:
        """Return pairs that act on blocks along their axes, whose width has the azimuth of the table."""
        at = self.given("azimuth") or 0.0
        azimuth = at if isinstance(at, str) else math.radians(at)
        upward = self.source == "records" and bool(self.given("vertical"))
        make = AXES[self.given("axes") or "both"]
        return make(pairs, azimuth, self.given("seed") or 0, first=first, vertical=upward)

    @model_validator(mode="after")
    def _one_component(self) -> Self:
        if not self.pair:
            for name in PAIR_KEYS:
                if self.given(name) is not None:
                    raise ValueError(f"motions.{name} needs component = 'pair'")
        elif self.given("match_gmm"):
            raise ValueError("match_gmm is for one component, not for component = 'pair'")
        return self


class SimulatedMotions(MotionsTable):
    """Motions of a stochastic generator.

    generator: Name of a stochastic generator.
    number: Number of motions.
    seed: Seed of the motions.
    component: `pair`: both components shake.
    correlation: Expected correlation of the two components of a pair.
    """

    source = "generator"
    generator: str
    number: Annotated[int, COUNT]
    seed: Annotated[Seed | None, KeyInfo(0)] = None
    component: Annotated[Literal["pair"] | None, KeyInfo("one")] = None
    axes: Axes = None
    azimuth: Azimuth = None
    correlation: Annotated[Annotated[float, CORRELATION] | None, KeyInfo(0.0)] = None

    def samples(self, folder: Path) -> float:
        made: Any = self.made_by(folder)
        return self.number * float((getattr(made, "length", None) or made.duration) / made.dt)

    def made_by(self, folder: Path) -> shaking.Generator:
        with _named("motions"):
            options = self.options()
            if "target" in options:
                options["target"] = shaking.TargetSpectrum.from_csv(folder / options["target"])
            made: shaking.Generator = type(self).makes(**options)
            if self.given("match_gmm"):
                if made.scenario is None:
                    raise ValueError("match_gmm needs motions of a scenario, which these are not on this site")
                try:
                    shaking.expected_motions(made.scenario)
                except ValueError as error:
                    raise ValueError(
                        f"match_gmm: the ground-motion model does not cover this scenario: {error}"
                    ) from None
            return made

    def build(self, folder: Path = Path(), first: int = 0) -> list[xr.DataArray]:
        made, seed = self.made_by(folder), self.seed or 0
        refuse_samples(self.samples(folder), "motions")
        with noted():  # a study has input warnings among its notes
            if self.pair:
                return self._both([made.sample_pairs(self.number, seed, first, self.correlation or 0.0)], first)
            array = made.sample(self.number, seed=seed, first=first)
        if not self.given("match_gmm"):
            return [array]
        assert made.scenario is not None
        return [shaking.scale_to_model(array, made.scenario, seed=seed, first=first)]


class ScenarioMotions(SimulatedMotions):
    """Motions of a generator for one earthquake and site.

    match_gmm: True: scale each motion to a PGV drawn from the ground-motion model of Boore et al. (2014), with event
        and record terms.
    """

    match_gmm: Annotated[bool | None, KeyInfo(False)] = None


class PulseMotions(MotionsTable):
    """A textbook pulse.

    pulse: Name of a textbook pulse.
    """

    source = "pulse"
    pulse: str

    def samples(self, folder: Path) -> float:
        made = self.made_by(folder)
        return float((made.duration + made.tail) / made.dt)

    def made_by(self, folder: Path) -> shaking.Pulse:
        with _named("motions"):
            made: shaking.Pulse = type(self).makes(**{"amplitude": 1.0, **self.options()})
            return made

    def build(self, folder: Path = Path(), first: int = 0) -> list[xr.DataArray]:
        refuse_samples(self.samples(folder), "motions")
        return [self.made_by(folder).sample()]


class RecordMotions(MotionsTable):
    """Records of earthquakes in files.

    records: Record files: paths or patterns (* and **), relative to the study file.
    component: Component of recordings that shakes the blocks; measures such as RotD50(pga) use both. `v`: vertical
        components alone, as if horizontal. `pair`: both components shake.
    vertical: With `component`: the vertical component shakes, too.
    seed: Seed of random azimuths.
    baseline_order: Order of the polynomial that is subtracted from records: 0 their mean, 1 a straight line.
    window: Shares of the Arias intensity between which records are kept, as [0.05, 0.95].
    taper_s: Half cosine at both ends of records, s.
    highpass_hz: Corner of a high-pass of records, Hz.
    lowpass_hz: Corner of a low-pass of records, Hz.
    order: Order of these Butterworth filters, which run both ways: no phase shift.
    """

    source = "records"
    records: Annotated[str | list[str], RelativePath(pattern=True)]
    component: Annotated[
        str | None, one_of((*HORIZONTAL, VERTICAL, PAIR)), KeyInfo("every horizontal component is a motion")
    ] = None
    vertical: Annotated[bool | None, KeyInfo(False)] = None
    axes: Axes = None
    azimuth: Azimuth = None
    seed: Annotated[Seed | None, KeyInfo(0)] = None
    dt_s: Step = None
    unit: Unit = None
    baseline_order: Annotated[Annotated[int, BASELINE_ORDERS] | None, KeyInfo("not corrected")] = None
    window: Annotated[list[Annotated[float, SHARE]] | None, KeyInfo("whole"), Field(min_length=2, max_length=2)] = None
    taper_s: Annotated[Annotated[float, TAPER] | None, KeyInfo("none")] = None
    highpass_hz: Annotated[Annotated[float, CORNER] | None, KeyInfo("none")] = None
    lowpass_hz: Annotated[Annotated[float, CORNER] | None, KeyInfo("none")] = None
    order: Annotated[Annotated[int, FILTER_ORDERS] | None, KeyInfo(FILTER_ORDER)] = None

    @model_validator(mode="after")
    def _of_what_is_there(self) -> Self:
        if self.seed is not None and self.azimuth != RANDOM:
            raise ValueError("motions.seed of records is that of azimuth = 'random', which is not asked for")
        if self.order is not None and self.highpass_hz is None and self.lowpass_hz is None:
            raise ValueError("motions.order is of a filter: it needs highpass_hz or lowpass_hz")
        if self.component in (None, VERTICAL) and self.vertical:
            raise ValueError("motions.vertical needs motions.component, which joins those of a recording")
        return self

    def build(self, folder: Path = Path(), first: int = 0) -> list[xr.DataArray]:
        read: dict[Path, list[xr.DataArray]] = {}
        for path in expand(self.records, folder):
            given = path, self.dt_s, self.unit
            read[path] = [shaking.read(*given)] if self.component is None else shaking.read_all(*given)
            refuse_samples(sum(array.size for arrays in read.values() for array in arrays), "records")
        patterns = [self.records] if isinstance(self.records, str) else self.records
        if self.component is None or self.component == VERTICAL:
            chosen = horizontal_motions(read, patterns, folder, self.component == VERTICAL, ON_PURPOSE)
            return [self._processed(array, str(array["source"].values[0])) for array in chosen]
        prepared = []
        for pair in pair_up(of_the_ground(read, patterns, folder)):
            # (a window is common to the components, which stay simultaneous)
            done = correct_together(pair, partial(self._processed, what=str(pair["motion"].values[0])))
            if self.vertical and VERTICAL not in done["component"].values:
                name = str(pair["motion"].values[0])
                raise ValueError(f"motions.vertical needs a vertical component of each recording, {name} has none")
            prepared.append(done if self.pair else shaking.as_recorded(done, self.component, self.vertical or False))
        return self._both(prepared) if self.pair else prepared

    def _processed(self, record: xr.DataArray, what: str) -> xr.DataArray:
        """Return a record after the requested corrections, in the order of `PROCESSING`."""
        order = FILTER_ORDER if self.order is None else self.order
        low, high = self.highpass_hz, self.lowpass_hz
        steps: dict[str, Callable[[xr.DataArray], xr.DataArray]] = {}
        if self.baseline_order is not None:
            steps["baseline_order"] = partial(shaking.baseline, order=self.baseline_order)
        if self.window is not None:
            steps["window"] = partial(shaking.trim_husid, low=self.window[0], high=self.window[1])
        if self.taper_s is not None:
            steps["taper_s"] = partial(shaking.taper, duration=self.taper_s)
        if low is not None and high is not None:
            steps["highpass_hz and lowpass_hz"] = partial(shaking.bandpass, low=low, high=high, order=order)
        elif low is not None:
            steps["highpass_hz"] = partial(shaking.highpass, low=low, order=order)
        elif high is not None:
            steps["lowpass_hz"] = partial(shaking.lowpass, high=high, order=order)
        for keys, correction in steps.items():
            with _named(f"motions.{keys}: {what}"):
                record = correction(record)
        return record


class FloorMotions(MotionsTable):
    """Floor histories of another program.

    floors_file: Floor histories of another program, paths or patterns as for records: CSV with the header
        `time, motion/floor [unit], …`, or netCDF (motion, floor, time).
    """

    source = "floors_file"
    floors_file: Annotated[str | list[str], RelativePath(pattern=True)]
    elastic: Elastic = None

    def build(self, folder: Path = Path(), first: int = 0) -> list[xr.DataArray]:
        arrays: list[xr.DataArray] = []
        for path in expand(self.floors_file, folder, "floors_file"):
            arrays.append(shaking.read_floors(path))
            refuse_samples(sum(array.size for array in arrays), "floors_file")
        return arrays


class IndexedFloorMotions(MotionsTable):
    """Floor histories of an own building model, one file or column for each level, motion, floor and direction.

    floors_index: CSV that names the floor histories of an own building model by level, motion, floor and
        direction; of a performance study.
    component: `pair`: both directions shake; otherwise the inventory gives the direction for each piece.
    """

    source = "floors_index"
    floors_index: Annotated[str, RelativePath()]
    elastic: Elastic = None
    component: Annotated[Literal["pair"] | None, KeyInfo("the direction of each piece")] = None
    axes: Axes = None
    dt_s: Step = None
    unit: Unit = None

    def build(self, folder: Path = Path(), first: int = 0) -> list[xr.DataArray]:
        raise ValueError("motions.floors_index is for a performance study: other studies take floors_file")


class EnvelopeTable(Derived):
    """Intensity envelope of a simulated motion.

    kind: Shape of the envelope.
    """

    kind: str


ENVELOPES = choice(
    "kind",
    {word: derived(make, EnvelopeTable, word=("kind", word)) for word, make in shaking.ENVELOPES.items()},
)
TARGET = Annotated[
    str,
    RelativePath(),
    Field(
        description="CSV of the spectrum to be matched, relative to the study file; its first line names `period (s)` "
        "or `frequency (Hz)`, and `sa (g)` or `sa (m/s2)`."
    ),
]
AMPLIFICATION = list[Annotated[tuple[float, float], Field(strict=False)]]


class _BySource(By):
    """Choice of the table of motions: the generator, the pulse, or the key that names files."""

    def __call__(self, value: Any) -> str:
        given = value if isinstance(value, dict) else getattr(value, "__dict__", {})
        key = next((key for key in SOURCES if given.get(key) is not None), "")
        return f"{key}={given[key]}" if key in WORDS else f"{key}="

    def word_of(self, content: Mapping[str, Any]) -> tuple[str, Sequence[str]]:
        key = "pulse" if "pulse" in content else "generator"
        return key, tuple(WORDS[key])


def _one_source(value: Any) -> Any:
    """Raise a ValueError for a table that does not give the source of the motions by exactly one key."""
    if isinstance(value, dict):
        kinds = [key for key in SOURCES if value.get(key) is not None]
        if len(kinds) != 1:
            raise ValueError(f"motions needs exactly one of {', '.join(SOURCES)}, got {' and '.join(kinds) or 'none'}")
    return value


WORDS: dict[str, Mapping[str, Any]] = {"generator": shaking.GENERATORS, "pulse": shaking.PULSES}
TABLES: dict[str, type[MotionsTable]] = {
    **{
        f"generator={word}": derived(
            make,
            SimulatedMotions if make.scenario is shaking.Generator.scenario else ScenarioMotions,
            word=("generator", word),
            types={"envelope": ENVELOPES, "target": TARGET, "amplification": AMPLIFICATION},
        )
        for word, make in shaking.GENERATORS.items()
    },
    **{
        f"pulse={word}": derived(make, PulseMotions, word=("pulse", word), defaults={"amplitude": 1.0})
        for word, make in shaking.PULSES.items()
    },
    **{f"{table.source}=": table for table in (RecordMotions, FloorMotions, IndexedFloorMotions)},
}
"""The tables by their key or word."""
if TYPE_CHECKING:
    Motions = MotionsTable
else:
    Motions = Annotated[chosen_by(_BySource("generator"), TABLES), BeforeValidator(_one_source)]
motions_table: Callable[[Any], MotionsTable] = TypeAdapter(Motions, config={"defer_build": True}).validate_python
"""Function that returns the table of motions of some content; pydantic's ValidationError if it is not valid."""


@contextmanager
def _named(what: str) -> Iterator[None]:
    """Put the subject of an error in front of it."""
    try:
        yield
    except RecordError:
        raise
    except ValueError as error:
        raise ValueError(f"{what}: {error}") from None
