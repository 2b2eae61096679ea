"""The study file: one TOML schema, checked once at the edge, turned into blocks, laws and motions.

Units stand in key names (``width_m``, ``dt_s``) or beside the values (``unit = "g"``).  Unknown keys are refused.
"""

from __future__ import annotations

import difflib
import glob
import math
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, Self

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, model_validator
from pydantic_core import ErrorDetails

from .. import motions as shaking
from ..fragility.scaling import INTENSITY_MEASURES, intensity_measure
from ..models import LAWS, Block, Law, catalogue
from ..models.laws import GEOMETRIES, LEVERS, RESTS
from ..motions import RecordError
from ..motions.filters import BASELINES
from ..motions.nearfault import WITH_PULSE
from ..motions.parametrised import PARAMETRISED
from ..motions.scenario import FAULTINGS
from ..motions.seismological import SITES
from ..motions.targets import EDITIONS
from ..units import DIMENSIONLESS, STANDARD_GRAVITY

# SI value of each unit a level may be written in, and the SI unit it belongs to.
LEVEL_UNITS: dict[str, tuple[float, str]] = {
    "g": (STANDARD_GRAVITY, "m s-2"),
    "m/s2": (1.0, "m s-2"),
    "cm/s2": (0.01, "m s-2"),
    "m/s": (1.0, "m s-1"),
    "cm/s": (0.01, "m s-1"),
    "m": (1.0, "m"),
    "cm": (0.01, "m"),
    "1": (1.0, "1"),
}


class StudyError(ValueError):
    """A study file that cannot be run; one sentence that names the file, the key, the value and what is allowed."""


def _checked(value: str, allowed: Iterable[str], beside: str = "") -> str:
    """A word that must be one of those allowed; the nearest is suggested where it is not."""
    words = list(allowed)
    if value in words:
        return value
    near = difflib.get_close_matches(value, words, n=1, cutoff=0.5)
    hint = f"; did you mean {near[0]!r}?" if near else ""
    raise ValueError(f"must be one of {', '.join(words)}{beside}, got {value!r}{hint}")


def _one_of(names: Iterable[str]) -> AfterValidator:
    """A word (or None) that must be one of `names`."""
    allowed = list(names)
    return AfterValidator(lambda value: None if value is None else _checked(value, allowed))


def _intensity_measure(value: str) -> str:
    """The name of an intensity measure, one with parameters written as its label is."""
    if "(" not in value:
        return _checked(value, INTENSITY_MEASURES, f", {', '.join(f'{name}(…)' for name in PARAMETRISED)}")
    measure = intensity_measure(value)
    assert measure is not None  # only plain factors have none, and they have no parameters
    return measure.label


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class BlockTable(_Table):
    """One block: a catalogue name, or outer sizes, or slenderness and size."""

    catalogue: Annotated[str | None, Field(description="Name of a catalogue item (see `toppling catalogue`).")] = None
    name: Annotated[str | None, Field(description="Label in results.")] = None
    width_m: Annotated[float | None, Field(description="Full width in the direction of shaking, m.")] = None
    height_m: Annotated[float | None, Field(description="Full height, m.")] = None
    cm_height_m: Annotated[float | None, Field(description="Height of the centre of mass, m (mid-height).")] = None
    inertia_factor: Annotated[float | None, Field(description="I_O/(m R²), above 1 to 2 (4/3).")] = None
    alpha_rad: Annotated[float | None, Field(description="Slenderness, rad, instead of sizes.")] = None
    R_m: Annotated[float | None, Field(description="Size R, m, instead of sizes.")] = None

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        ways = (
            self.catalogue is not None,
            self.width_m is not None and self.height_m is not None,
            self.alpha_rad is not None and self.R_m is not None,
        )
        given = {name for name in self.model_fields_set if getattr(self, name) is not None}
        allowed = (
            {"catalogue", "name"},
            {"width_m", "height_m", "cm_height_m", "inertia_factor", "name"},
            {"alpha_rad", "R_m", "inertia_factor", "name"},
        )
        if sum(ways) != 1 or not given <= allowed[ways.index(True)]:
            raise ValueError(
                "a block needs either catalogue, or width_m and height_m, or alpha_rad and R_m, got "
                + (", ".join(sorted(given)) or "nothing")
            )
        return self

    def build(self) -> Block:
        """The block; ValueError where its values are out of range or its name is not in the catalogue."""
        if self.catalogue is not None:
            try:
                block = catalogue[self.catalogue]
            except KeyError as error:
                raise ValueError(error.args[0]) from None
            return block if self.name is None else Block(block.width, block.height, name=self.name)
        if self.alpha_rad is not None and self.R_m is not None:
            factor = 4.0 / 3.0 if self.inertia_factor is None else self.inertia_factor
            return Block.from_slenderness(self.alpha_rad, self.R_m, factor, self.name)
        assert self.width_m is not None  # one of three ways, checked above
        assert self.height_m is not None
        return Block(self.width_m, self.height_m, self.cm_height_m, self.inertia_factor, self.name)


class ModelTable(_Table):
    """One damping law and its options."""

    law: Annotated[str, _one_of(LAWS), Field(description="Short name of the damping law.")]
    e: Annotated[float | None, Field(description="Restitution, above 0 to 1 (the block's own e_R).")] = None
    restitution_factor: Annotated[float | None, Field(description="Factor on e_R where e is not given.")] = None
    delta: Annotated[float | None, Field(description="Half width of the elastic zone over alpha, 0 to 1.")] = None
    zeta: Annotated[float | None, Field(description="Damping ratio of the viscous law.")] = None
    coefficient: Annotated[float | None, Field(description="Coefficient of the law of Vassiliou et al. (0.02).")] = None
    lever: Annotated[str | None, _one_of(LEVERS), Field(description="Lever arm of the shaking.")] = None
    rest: Annotated[str | None, _one_of(RESTS), Field(description="Kind of rest.")] = None
    geometry: Annotated[str | None, _one_of(GEOMETRIES), Field(description="Housner's geometry.")] = None

    def build(self) -> Law:
        """The law; ValueError where an option does not belong to it or is out of range."""
        options = {k: v for k, v in self.model_dump().items() if v is not None and k != "law"}
        law = LAWS[self.law]
        known = set(law.__dataclass_fields__)  # type: ignore[attr-defined]
        foreign = sorted(set(options) - known)
        if foreign:
            raise ValueError(f"law {self.law!r} has no option {foreign[0]!r}, allowed are {', '.join(sorted(known))}")
        if self.law == "viscous" and self.zeta is None:
            raise ValueError("law 'viscous' needs zeta (its damping ratio)")
        return law(**options)


class EnvelopeTable(_Table):
    """Intensity envelope of a simulated motion."""

    kind: Annotated[str, _one_of(shaking.ENVELOPES), Field(description="Its shape.")]
    rise_s: Annotated[float | None, Field(description="End of the quadratic rise, s.")] = None
    strong_end_s: Annotated[float | None, Field(description="End of the strong phase, s.")] = None
    decay_per_s: Annotated[float | None, Field(description="Rate of decay, 1/s.")] = None
    shape: Annotated[float | None, Field(description="Shape of the gamma envelope, above 1.")] = None
    rate_per_s: Annotated[float | None, Field(description="Rate of the gamma envelope, 1/s.")] = None
    slow_per_s: Annotated[float | None, Field(description="Slow rate of the double exponential, 1/s.")] = None
    fast_per_s: Annotated[float | None, Field(description="Fast rate of the double exponential, 1/s.")] = None

    def build(self) -> shaking.Envelope:
        """The envelope; ValueError where a parameter does not belong to it or is out of range."""
        envelope: shaking.Envelope = _construct(shaking.ENVELOPES[self.kind], self, {"kind"}, f"envelope {self.kind!r}")
        return envelope


BUILDINGS = {
    "flexural-shear": ({"period_s", "alpha0", "storeys"}, {"period_s"}),
    "storeys": ({"masses_kg", "stiffnesses_n_m"}, {"masses_kg", "stiffnesses_n_m"}),
}
"""Kinds of buildings: the keys that are their own, and those that must be given."""


class BuildingTable(_Table):
    """An elastic building between the motions and the blocks."""

    kind: Annotated[str, _one_of(BUILDINGS), Field(description="A uniform cantilever, or masses on springs.")]
    period_s: Annotated[float | None, Field(description="Fundamental period, s.")] = None
    alpha0: Annotated[float | None, Field(description="Flexural-shear parameter (5).")] = None
    storeys: Annotated[int | None, Field(description="Number of storeys (5).")] = None
    masses_kg: Annotated[list[float] | None, Field(description="Mass of each floor from the lowest up, kg.")] = None
    stiffnesses_n_m: Annotated[list[float] | None, Field(description="Stiffness of each storey, N/m.")] = None
    damping: Annotated[float | list[float] | None, Field(description="Damping ratio, of all or each mode.")] = None
    storey_height_m: Annotated[float | list[float] | None, Field(description="Height of all or each storey, m.")] = None
    modes: Annotated[int | None, Field(description="Number of modes.")] = None
    floors: Annotated[list[int] | None, Field(description="Floors with blocks, 0 is the ground (all).")] = None

    def build(self) -> shaking.Building:
        """The building; ValueError where a key does not belong to it or is out of range."""
        own, needed = BUILDINGS[self.kind]
        _refuse_foreign(self, own | {"kind", "damping", "storey_height_m", "modes", "floors"}, f"kind {self.kind!r}")
        missing = sorted(name for name in needed if getattr(self, name) is None)
        if missing:
            raise ValueError(f"kind {self.kind!r} needs {' and '.join(missing)}")
        given = self.model_dump(exclude={"kind", "floors"}, exclude_none=True)
        options = {_bare(key): value for key, value in given.items()}
        make = shaking.Building.flexural_shear if self.kind == "flexural-shear" else shaking.Building.from_storeys
        return make(**options)


class MotionsTable(_Table):
    """What shakes the blocks: a generator, a pulse, records, or floor histories."""

    generator: Annotated[
        str | None, _one_of(shaking.GENERATORS), Field(description="Name of a stochastic generator.")
    ] = None
    pulse: Annotated[str | None, _one_of(shaking.PULSES), Field(description="Name of a textbook pulse.")] = None
    records: Annotated[
        str | list[str] | None,
        Field(description="Record files: paths or patterns (* and **), relative to the study file."),
    ] = None
    floors_file: Annotated[
        str | list[str] | None,
        Field(description="Floor histories (CSV, netCDF) of another program: paths or patterns, as for records."),
    ] = None
    number: Annotated[int | None, Field(ge=1, description="Number of simulated motions.")] = None
    seed: Annotated[int | None, Field(ge=0, description="Seed of the simulated motions (0).")] = None
    duration_s: Annotated[float | None, Field(description="Length of a simulated motion, s.")] = None
    dt_s: Annotated[float | None, Field(description="Time step, s (of records: where a table states none).")] = None
    omega_g_rad_s: Annotated[
        float | list[float] | None, Field(description="Circular frequency of the ground filter, or its drift, rad/s.")
    ] = None
    omega_g_times_s: Annotated[list[float] | None, Field(description="Times of the drift, s (evenly).")] = None
    xi_g: Annotated[float | None, Field(description="Damping ratio of the ground filter.")] = None
    omega_f_rad_s: Annotated[float | None, Field(description="Circular frequency of the high-pass, rad/s.")] = None
    xi_f: Annotated[float | None, Field(description="Damping ratio of the high-pass.")] = None
    s0_m2_s3: Annotated[float | None, Field(description="Spectral density of the white noise, m²/s³.")] = None
    baseline: Annotated[str | None, _one_of(BASELINES), Field(description="Baseline correction.")] = None
    target: Annotated[
        str | None, Field(description="CSV of the spectrum to be matched, relative to the study file.")
    ] = None
    s_ds: Annotated[float | None, Field(description="S_DS of ASCE 7, in g.")] = None
    z_over_h: Annotated[float | None, Field(description="Height of attachment over that of the roof (0).")] = None
    edition: Annotated[str | None, _one_of(EDITIONS), Field(description="Edition of ASCE 7 (7-16).")] = None
    vertical: Annotated[bool | None, Field(description="The vertical spectrum (false).")] = None
    lowest_frequency_hz: Annotated[float | None, Field(description="Where matching starts, Hz (0.1).")] = None
    f_lowest_hz: Annotated[float | None, Field(description="Lowest natural frequency of the component, Hz.")] = None
    pgv_bound: Annotated[float | None, Field(description="Greatest relative distance of PGV (0.15).")] = None
    pgd_bound: Annotated[float | None, Field(description="Greatest relative distance of PGD (0.5).")] = None
    envelope: Annotated[EnvelopeTable | None, Field(description="Intensity envelope.")] = None
    magnitude: Annotated[float | None, Field(description="Moment magnitude of the scenario.")] = None
    distance_m: Annotated[float | None, Field(description="Distance of the scenario, m.")] = None
    vs30_m_s: Annotated[float | None, Field(description="Shear-wave velocity of the uppermost 30 m, m/s.")] = None
    faulting: Annotated[str | None, _one_of(FAULTINGS), Field(description="Style of faulting.")] = None
    f_c_hz: Annotated[float | None, Field(description="Corner of the high-pass, Hz.")] = None
    arias_m_s: Annotated[float | None, Field(description="Expected Arias intensity, m/s.")] = None
    d5_95_s: Annotated[float | None, Field(description="Time from 5 to 95 % of the Arias intensity, s.")] = None
    t_mid_s: Annotated[float | None, Field(description="Time to 45 % of the Arias intensity, s.")] = None
    omega_mid_rad_s: Annotated[float | None, Field(description="Filter frequency at that time, rad/s.")] = None
    omega_slope_rad_s2: Annotated[float | None, Field(description="Slope of the filter frequency, rad/s².")] = None
    zeta: Annotated[float | None, Field(description="Damping ratio of the filter.")] = None
    depth_m: Annotated[float | None, Field(description="Depth of the top of the rupture, m.")] = None
    along_m: Annotated[float | None, Field(description="Length of rupture towards the site, m.")] = None
    angle_rad: Annotated[float | None, Field(description="Angle between rupture and site, rad.")] = None
    with_pulse: Annotated[
        str | None, _one_of(WITH_PULSE), Field(description="Whether near-fault motions have a pulse.")
    ] = None
    stress_drop_pa: Annotated[float | None, Field(description="Stress drop of the source, Pa.")] = None
    kappa_s: Annotated[float | None, Field(description="Attenuation near the site, s.")] = None
    q0: Annotated[float | None, Field(description="Quality factor of the path at 1 Hz.")] = None
    q_exponent: Annotated[float | None, Field(description="Its growth with frequency.")] = None
    beta_m_s: Annotated[float | None, Field(description="Shear-wave velocity at the source, m/s.")] = None
    density_kg_m3: Annotated[float | None, Field(description="Density at the source, kg/m³.")] = None
    site: Annotated[str | None, _one_of(SITES), Field(description="Site amplification.")] = None
    amplification: Annotated[
        list[tuple[float, float]] | None, Field(description="Own amplification: pairs of frequency (Hz) and factor.")
    ] = None
    gamma: Annotated[float | None, Field(description="Half cycles of the near-fault pulse.")] = None
    nu_rad: Annotated[float | None, Field(description="Phase of the near-fault pulse, rad.")] = None
    zero_residual: Annotated[bool | None, Field(description="Whether the near-fault pulse leaves nothing.")] = None
    amplitude_m_s2: Annotated[float | None, Field(description="Amplitude of the pulse, m/s² (1).")] = None
    omega_rad_s: Annotated[float | None, Field(description="Circular frequency of the pulse, rad/s.")] = None
    tail_s: Annotated[float | None, Field(description="Quiet after the pulse, s.")] = None

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        sources = ("generator", "pulse", "records", "floors_file")
        kinds = [name for name in sources if getattr(self, name) is not None]
        if len(kinds) != 1:
            raise ValueError(f"motions needs exactly one of {', '.join(sources)}, got {' and '.join(kinds) or 'none'}")
        if self.generator is not None and self.number is None:
            raise ValueError("motions from a generator need number (how many)")
        return self

    def build(self, folder: Path) -> list[xr.DataArray]:
        """The motions; ValueError where a parameter does not belong or is out of range, or no record is found."""
        if self.records is not None:
            _refuse_foreign(self, {"records", "dt_s"}, "motions from records")
            return [shaking.read(path, self.dt_s) for path in expand(self.records, folder)]
        if self.floors_file is not None:
            _refuse_foreign(self, {"floors_file"}, "motions from a floors_file")
            return [shaking.read_floors(path) for path in expand(self.floors_file, folder, "floors_file")]
        if self.pulse is not None:
            if self.omega_rad_s is None:
                raise ValueError(f"pulse {self.pulse!r} needs omega_rad_s (its circular frequency)")
            amplitude = 1.0 if self.amplitude_m_s2 is None else self.amplitude_m_s2
            values = self.model_copy(update={"amplitude_m_s2": amplitude})
            return [_construct(shaking.PULSES[self.pulse], values, {"pulse"}, f"pulse {self.pulse!r}").sample(1)]
        assert self.generator is not None  # exactly one of four, checked above
        assert self.number is not None
        apart = {"generator", "number", "seed"}
        kind, what = shaking.GENERATORS[self.generator], f"generator {self.generator!r}"
        for need in ("s_ds", "target"):
            if need in getattr(kind, "__dataclass_fields__", {}) and getattr(self, need) is None:
                raise ValueError(f"{what} needs {need}")
        values = self
        if self.target is not None:
            spectrum = shaking.TargetSpectrum.from_csv(folder / self.target)
            values = self.model_copy(update={"target": spectrum})
        generator = _construct(kind, values, apart, what)
        return [generator.sample(self.number, seed=self.seed or 0)]


class LevelsTable(_Table):
    """Levels of the intensity measure: a list of values, or from, to, number and spacing."""

    values: Annotated[list[float] | None, Field(description="The levels, increasing.")] = None
    from_: Annotated[float | None, Field(alias="from", description="First level.")] = None
    to: Annotated[float | None, Field(description="Last level.")] = None
    number: Annotated[int | None, Field(ge=1, le=100_000, description="Number of levels.")] = None
    spacing: Annotated[Literal["linear", "log"], Field(description="Spacing of the levels.")] = "linear"
    unit: Annotated[str, _one_of(LEVEL_UNITS), Field(description="Unit of the levels.")]

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        ranged = (self.from_, self.to, self.number)
        if (self.values is None) == (None in ranged) or (
            self.values is not None and any(v is not None for v in ranged)
        ):
            raise ValueError("levels need either values, or from, to and number")
        if self.spacing == "log" and not (self.from_ or 0.0) > 0.0:
            raise ValueError(f"levels with log spacing need from > 0, got {self.from_}")
        return self

    def build(self, im: str) -> NDArray[np.float64]:
        """Levels in SI; ValueError where the unit is not one of the measure's."""
        factor, si = LEVEL_UNITS[self.unit]
        measure = intensity_measure(im)
        needed = DIMENSIONLESS if measure is None else measure.units
        if si != needed:
            fitting = [unit for unit, (_, of) in LEVEL_UNITS.items() if of == needed]
            raise ValueError(f"unit of levels of {im} must be one of {', '.join(fitting)}, got {self.unit!r}")
        if self.values is not None:
            return np.array(self.values) * factor
        assert self.from_ is not None  # checked above
        assert self.to is not None
        assert self.number is not None
        if self.spacing == "log":
            if not self.to > 0.0:
                raise ValueError(f"levels with log spacing need to > 0, got {self.to}")
            return np.exp(np.linspace(math.log(self.from_), math.log(self.to), self.number)) * factor
        return np.linspace(self.from_, self.to, self.number) * factor


class IdaTable(_Table):
    """Incremental dynamic analysis: the measure and its levels."""

    im: Annotated[str, AfterValidator(_intensity_measure), Field(description="Intensity measure.")] = "pga"
    im_at: Annotated[
        str | None, _one_of(("floor", "ground")), Field(description="Where a building's motions are measured (floor).")
    ] = None
    levels: Annotated[LevelsTable, Field(description="Levels of the measure.")]


class Shaking(NamedTuple):
    """What shakes the blocks, and the ground motions below it where the levels are of their measure."""

    motions: list[xr.DataArray]
    ground: list[xr.DataArray]


class StudyFile(_Table):
    """A study: blocks x damping laws x motions x levels."""

    title: Annotated[str, Field(min_length=1, max_length=200, description="Title of the study.")]
    blocks: Annotated[list[BlockTable], Field(min_length=1, description="The blocks.")]
    models: Annotated[list[ModelTable], Field(min_length=1, description="The damping laws.")]
    motions: Annotated[MotionsTable, Field(description="What shakes them.")]
    building: Annotated[BuildingTable | None, Field(description="What stands between the motions and them.")] = None
    ida: Annotated[IdaTable, Field(description="The analysis.")]

    @model_validator(mode="after")
    def _ground_below(self) -> Self:
        if self.ida.im_at == "ground" and self.building is None:
            raise ValueError("ida.im_at 'ground' needs a building, whose floors move with the ground")
        if self.building is not None and self.motions.floors_file is not None:
            raise ValueError("a building needs ground motions, got motions.floors_file, which are of floors already")
        return self

    def shaking(self, folder: Path) -> Shaking:
        """The motions, through the building where there is one; ValueError as the tables' own."""
        ground = self.motions.build(folder)
        if self.building is None:
            return Shaking(ground, [])
        try:
            floors = self.building.build().floor_motions(ground, self.building.floors)
        except ValueError as error:
            raise ValueError(f"building: {error}") from None
        return Shaking(floors, ground if self.ida.im_at == "ground" else [])


def read_study_file(path: Path) -> StudyFile:
    """The study file, checked against the schema; StudyError with one sentence where it does not hold."""
    try:
        text = path.read_bytes().decode("utf-8")
        content = tomllib.loads(text)
    except FileNotFoundError:
        raise StudyError(f"{path}: no such file") from None
    except OSError as error:
        raise StudyError(f"{path}: cannot be read ({error.strerror})") from None
    except UnicodeDecodeError:
        raise StudyError(f"{path}: not a text file in UTF-8") from None
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise StudyError(f"{path}: not valid TOML: {str(error) or 'nested too deeply'}") from None
    try:
        return StudyFile.model_validate(content)
    except ValidationError as error:
        # an unknown key is likely the cause of one that is missing: say it first
        errors = sorted(error.errors(), key=lambda one: one["type"] != "extra_forbidden")
        raise StudyError(f"{path}: {_sentence(errors[0])}") from None


def _sentence(error: ErrorDetails) -> str:
    """One pydantic error as one sentence that names the key, the value and what is allowed."""
    key = "".join(f"[{part + 1}]" if isinstance(part, int) else f".{part}" for part in error["loc"]).lstrip(".")
    if error["type"] == "extra_forbidden":
        known = _known_keys(error["loc"][:-1])
        near = difflib.get_close_matches(str(error["loc"][-1]), known, n=1, cutoff=0.5)
        hint = f"; did you mean {near[0]!r}?" if near else f", allowed are {', '.join(known)}"
        return f"unknown key {key!r}{hint}"
    if error["type"] == "missing":
        return f"key {key!r} is missing"
    message = error["msg"].removeprefix("Value error, ")
    if error["type"] == "value_error":
        return f"{key}: {message}" if key else message
    shown = repr(error["input"])
    message = message[0].lower() + message[1:]
    return f"{key}: {message}, got {shown if len(shown) <= 60 else shown[:57] + '...'}"


def _known_keys(location: tuple[int | str, ...]) -> list[str]:
    """The keys allowed in the table at `location`."""
    table: type[_Table] = StudyFile
    nested: dict[str, type[_Table]] = {
        "blocks": BlockTable,
        "models": ModelTable,
        "motions": MotionsTable,
        "building": BuildingTable,
        "envelope": EnvelopeTable,
        "ida": IdaTable,
        "levels": LevelsTable,
    }
    for part in location:
        if isinstance(part, str):
            table = nested.get(part, table)
    return [field.alias or name for name, field in table.model_fields.items()]


# longest first
_UNIT_SUFFIXES = (
    "_m2_s3", "_rad_s2", "_kg_m3", "_rad_s", "_per_s", "_m_s2", "_m_s", "_n_m", "_rad", "_hz", "_pa", "_kg", "_m", "_s"
)  # fmt: skip


def _bare(key: str) -> str:
    for suffix in _UNIT_SUFFIXES:
        if key.endswith(suffix):
            return key.removesuffix(suffix)
    return key


def _refuse_foreign(table: BaseModel, allowed: set[str], what: str) -> None:
    for name in sorted(table.model_fields_set):
        if getattr(table, name) is not None and name not in allowed:
            raise ValueError(f"{what} has no key {name!r}, allowed are {', '.join(sorted(allowed))}")


def _construct(cls: Any, table: BaseModel, apart: set[str], what: str) -> Any:
    """An instance of a dataclass from the table's keys, their units taken off; keys `apart` are not its own."""
    own = {key for key in type(table).model_fields if _bare(key) in cls.__dataclass_fields__}
    _refuse_foreign(table, own | apart, what)
    options = {_bare(key): getattr(table, key) for key in own if getattr(table, key) is not None}
    if isinstance(options.get("envelope"), EnvelopeTable):
        options["envelope"] = options["envelope"].build()
    try:
        return cls(**options)
    except TypeError as error:
        raise ValueError(f"{what}: {error}") from None


def expand(patterns: str | list[str], folder: Path, what: str = "records") -> list[Path]:
    """Files that the patterns name, sorted, each once; RecordError where a pattern names none."""
    found: dict[Path, None] = {}
    for pattern in [patterns] if isinstance(patterns, str) else patterns:
        matches = sorted(glob.glob(pattern, root_dir=folder, recursive=True))
        files = [folder / match for match in matches if (folder / match).is_file()]
        if not files and (folder / pattern).is_file():  # a name with brackets is a pattern that does not match itself
            files = [folder / pattern]
        if not files:
            raise RecordError(f"{what}: no file matches {pattern!r} (looked in {folder.resolve()})")
        found.update(dict.fromkeys(files))
    return list(found)
