"""Tables of a study file that define the shaking of the blocks: motions and buildings."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
import xarray as xr
from pydantic import Field, model_validator

from ... import motions as shaking
from ...core.doubts import noted
from ...core.facts import Fact
from ...core.units import STANDARD_GRAVITY
from ...core.wording import short_digits
from ...motions import RecordError
from ...motions.arrays import BOTH_AXES, HORIZONTAL, VERTICAL, WEAK_AXIS
from ...motions.floors.strength import LARGEST_IMPORTANCE, SYSTEMS, Strength, code_strength
from ...motions.floors.yielding import MOST_DISPERSION
from ...motions.intensity.peaks import peak_velocity
from ...motions.matching.targets import EDITIONS
from ...motions.pairs import RANDOM, correct_together, pair_up
from ...motions.readers.directions import ON_PURPOSE, horizontal_motions, of_the_ground
from ...motions.readers.patterns import expand
from ...motions.simulated.kanai_tajimi import BASELINES
from ...motions.simulated.near_fault import WITH_PULSE
from ...motions.simulated.scenario import FAULTINGS
from ...motions.simulated.seismological import SITES
from ..plan.size import refuse_samples
from .table import KeyInfo, RelativePath, Table, bare, construct, one_of, refuse_foreign


class EnvelopeTable(Table):
    """Intensity envelope of a simulated motion."""

    kind: Annotated[
        str, one_of(shaking.ENVELOPES), Field(description="Its shape; the keys that follow belong to one each.")
    ]
    rise_s: Annotated[float | None, KeyInfo(4.0, above=0.0), Field(description="End of the quadratic rise, s.")] = None
    strong_end_s: Annotated[
        float | None, KeyInfo(15.0, above=0.0), Field(description="End of the strong phase, s.")
    ] = None
    decay_per_s: Annotated[float | None, KeyInfo(0.0992, above=0.0), Field(description="Rate of decay, 1/s.")] = None

    def build(self) -> shaking.Envelope:
        """Make the envelope; ValueError where a parameter does not belong to it or is out of range."""
        envelope: shaking.Envelope = construct(shaking.ENVELOPES[self.kind], self, {"kind"}, f"envelope {self.kind!r}")
        return envelope


CODE_STRENGTH = ("system", "sds_g", "sd1_g", "importance")
"""Keys of a strength that a code's design gives."""
STRENGTH = ("yield_coefficient", *CODE_STRENGTH)
YIELDING = ("hardening", "p_delta", "strength_dispersion", "seed")
"""Keys of storeys that yield."""
BUILDINGS: dict[str, tuple[set[str], set[str]]] = {
    "ground": (set(), set()),
    "flexural-shear": ({"period_s", "alpha0", "storeys"}, {"period_s"}),
    "storeys": ({"masses_kg", "stiffnesses_n_m", "isolation", *STRENGTH, *YIELDING}, {"masses_kg", "stiffnesses_n_m"}),
}
"""Kinds of buildings, each with its own keys and the keys that must be given."""


ISOLATORS: dict[str, tuple[set[str], set[str]]] = {
    "linear": ({"period_s", "damping"}, {"period_s", "damping"}),
    "bilinear": ({"period_s", "strength", "yield_displacement_mm"}, {"period_s", "strength"}),
}
"""Kinds of isolators below a building, each with its own keys and the keys that must be given."""


class IsolationTable(Table):
    """Isolators below a building, and the slab on them."""

    kind: Annotated[
        str,
        one_of(ISOLATORS),
        Field(description="Linear, or bilinear: lead rubber, or friction pendulums with a small yield displacement."),
    ]
    period_s: Annotated[
        float,
        Field(
            ge=0.01, le=100.0, description="Period of the whole weight on them, s; of a bilinear one after yielding."
        ),
    ]
    damping: Annotated[
        float | None, KeyInfo(at_least=0.0, below=1.0), Field(description="Damping ratio of linear ones.")
    ] = None
    strength: Annotated[
        float | None, KeyInfo(above=0.0, below=1.0), Field(description="Force at rest over the whole weight.")
    ] = None
    yield_displacement_mm: Annotated[
        float | None,
        KeyInfo(10.0, above=0.0),
        Field(description="Displacement at which they yield, mm; the default is judgement."),
    ] = None
    base_mass_kg: Annotated[float, Field(gt=0.0, description="Mass of the slab above them, kg.")]

    def build(self) -> shaking.Support | shaking.Isolator:
        """Make the isolators; ValueError where a key does not belong to them or is out of range."""
        own, needed = ISOLATORS[self.kind]
        refuse_foreign(self, own | {"kind", "period_s", "base_mass_kg"}, f"isolation of kind {self.kind!r}", needed)
        given = self.model_dump(exclude={"kind", "base_mass_kg"}, exclude_none=True)
        options = {bare(key): 1e-3 * value if key.endswith("_mm") else value for key, value in given.items()}
        found: shaking.Support | shaking.Isolator = getattr(shaking.Isolator, self.kind)(**options)
        return found


class BuildingTable(Table):
    """A building between the motions and the blocks: elastic, with storeys that yield, or on isolators."""

    name: Annotated[
        str | None,
        Field(
            min_length=1,
            max_length=200,
            description="Its name, where there are several: its floors are called after it.",
        ),
    ] = None
    kind: Annotated[str, one_of(BUILDINGS), Field(description="A uniform cantilever, masses on springs, or none.")]
    period_s: Annotated[
        float | None, KeyInfo(at_least=1e-3, at_most=100.0), Field(description="Fundamental period, s.")
    ] = None
    alpha0: Annotated[
        float | None,
        KeyInfo(5.0, at_least=0.0, at_most=1e4),
        Field(description="Flexural-shear parameter: 0 bends, 10 000 shears."),
    ] = None
    storeys: Annotated[int | None, KeyInfo(5, at_least=1, at_most=500), Field(description="Number of storeys.")] = None
    masses_kg: Annotated[
        list[float] | None, KeyInfo(above=0.0), Field(description="Mass of each floor from the lowest up, kg.")
    ] = None
    stiffnesses_n_m: Annotated[
        list[float] | None, KeyInfo(above=0.0), Field(description="Stiffness of each storey, N/m.")
    ] = None
    damping: Annotated[
        float | list[float] | None,
        KeyInfo(0.05, at_least=0.0, below=1.0),
        Field(description="Damping ratio of all modes, or of each."),
    ] = None
    storey_height_m: Annotated[
        float | list[float] | None, KeyInfo(3.0, above=0.0), Field(description="Height of all storeys, or of each, m.")
    ] = None
    yield_coefficient: Annotated[
        float | list[float] | None,
        KeyInfo("elastic", above=0.0),
        Field(
            description="Strength of the lowest storey over the weight of the building, the others by the "
            "lateral forces of ASCE/SEI 7-22, 12.8.3; or the strength of each storey."
        ),
    ] = None
    system: Annotated[
        str | None,
        one_of(SYSTEMS),
        Field(
            description="Seismic force-resisting system: a default strength from the site's code hazard (judgement)."
        ),
    ] = None
    sds_g: Annotated[
        float | None,
        KeyInfo("that of [performance.code]", above=0.0, at_most=10.0),
        Field(description="S_DS of the site by ASCE 7, in g, for `system`."),
    ] = None
    sd1_g: Annotated[
        float | None, KeyInfo(above=0.0, at_most=10.0), Field(description="S_D1 of the site, in g, for `system`.")
    ] = None
    importance: Annotated[
        float | None,
        KeyInfo(1.0, at_least=1.0, at_most=LARGEST_IMPORTANCE),
        Field(description="Importance factor I_e of the building, for `system`."),
    ] = None
    hardening: Annotated[
        float | None,
        KeyInfo(0.03, at_least=0.0, below=1.0),
        Field(description="Stiffness of storeys after yielding over that before; the default is judgement."),
    ] = None
    p_delta: Annotated[
        bool | None, KeyInfo(False), Field(description="Whether the weight above softens storeys as they drift.")
    ] = None
    strength_dispersion: Annotated[
        float | None,
        KeyInfo(0.0, at_least=0.0, at_most=MOST_DISPERSION),
        Field(
            description="Dispersion of the real strength about that one: each motion meets a building of its "
            "own, the same at every level. 0.3 is judgement for real buildings."
        ),
    ] = None
    seed: Annotated[
        int | None, KeyInfo(0, at_least=0), Field(description="Seed of the strengths, with the names of the motions.")
    ] = None
    isolation: Annotated[
        IsolationTable | None, Field(description="Isolators below the building; floor 0 is the slab on them.")
    ] = None
    modes: Annotated[
        int | None, KeyInfo("6, or all of `storeys`", at_least=1), Field(description="Number of modes.")
    ] = None
    floors: Annotated[
        list[int] | None, KeyInfo("all", at_least=0), Field(description="Floors with blocks; 0 is the ground.")
    ] = None

    def build(self) -> shaking.Building | shaking.YieldingBuilding:
        """Make the building; ValueError where a key does not belong to it or is out of range."""
        own, needed = BUILDINGS[self.kind]
        others = {"name", "kind", "damping", "storey_height_m", "modes", "floors"}
        refuse_foreign(self, own | others, f"kind {self.kind!r}", needed)
        strength = self.default_strength
        for key in YIELDING:
            if getattr(self, key) is not None and not self.yields:
                raise ValueError(f"{key} needs yield_coefficient or system: an elastic building does not yield")
        if not self.scales and isinstance(self.damping, list):
            raise ValueError(f"damping of {self.what} must be one number, that of the first and the last mode")
        apart = {"name", "kind", "floors", "isolation", *CODE_STRENGTH}
        given = self.model_dump(exclude=apart, exclude_none=True)
        options = {bare(key): value for key, value in given.items() if value is not False}
        if strength is not None:
            options["yield_coefficient"] = strength.coefficient
        if self.isolation is not None:
            if self.modes is not None:
                raise ValueError("modes must be left out of an isolated building: it has all of them")
            return shaking.Building.isolated(self.isolation.build(), self.isolation.base_mass_kg, **options)
        make = shaking.Building.flexural_shear if self.kind == "flexural-shear" else shaking.Building.from_storeys
        return make(**options)

    @property
    def yields(self) -> bool:
        """Whether storeys yield."""
        return self.yield_coefficient is not None or self.system is not None

    @property
    def scales(self) -> bool:
        """Whether floor motions scale with the ground motions; they belong to the strength of these if not."""
        return not self.yields and self.isolation is None

    @property
    def what(self) -> str:
        """What it is where it does not scale."""
        return "a building that yields" if self.isolation is None else "an isolated building"

    @property
    def default_strength(self) -> Strength | None:
        """The strength that a code's design gives, None if not requested; ValueError without the code hazard."""
        if self.system is None:
            alone = [key for key in CODE_STRENGTH if getattr(self, key) is not None]
            if alone:
                raise ValueError(f"{alone[0]} needs system: it gives the default strength of one")
            return None
        if self.yield_coefficient is not None:
            raise ValueError("system gives a default strength, and yield_coefficient a known one: state one of them")
        if self.sds_g is None or self.sd1_g is None:
            raise ValueError(
                "system needs sds_g and sd1_g, the site's code hazard (sds_g may stand in [performance.code]): without "
                "one there is no default strength, and yield_coefficient must be given"
            )
        plain = self.elastic.build()
        assert isinstance(plain, shaking.Building)
        first = float(plain.periods[0])
        factor = 1.0 if self.importance is None else self.importance
        return code_strength(self.system, first, self.sds_g, self.sd1_g, factor)

    @property
    def strength_facts(self) -> list[Fact]:
        """What is assumed or uncertain of its strength; ValueError as `build`."""
        found, strength, name = [], self.default_strength, self.name or ""
        if strength is not None:
            found.append(Fact("building.default_strength", names=(name, strength.text)))
        if self.strength_dispersion:
            more = {"seed": self.seed or 0}
            found.append(Fact("building.random_strength", self.strength_dispersion, names=(name,), more=more))
        return found

    @property
    def elastic(self) -> Self:
        """The same building, as if its storeys could not yield, on a fixed base."""
        return self.model_copy(update=dict.fromkeys((*STRENGTH, *YIELDING, "isolation")))

    def made(self) -> shaking.Building:
        """Make the only building of a study, as elastic as it is before it yields; an error names the table."""
        try:
            self.build()  # (what is wrong with its strength is raised here)
            found = self.elastic.build()
        except ValueError as error:
            raise ValueError(f"building: {error}") from None
        assert isinstance(found, shaking.Building)
        return found

    @property
    def floor_count(self) -> int:
        """The number of floors whose motions are computed; ValueError as `build`."""
        if self.kind == "ground":
            return 1
        every = self.build().floors  # (what is doubted of the building is said here)
        return len(every if self.floors is None else self.floors)

    def yielding(self, ground: list[xr.DataArray], floors: list[xr.DataArray]) -> str:
        """Return how far storeys and isolators go, and the last floor beside that of an elastic building."""
        top = floors[0]["floor"].values[-1]
        with noted():  # (what is doubted of the elastic building is not of this one)
            beside = self.elastic.shake(ground)

        def medians(arrays: list[xr.DataArray]) -> tuple[float, float]:
            plain = [one for array in arrays for one in shaking.records(array.sel(floor=[top]))]
            pga = np.median([np.abs(one.acceleration).max() for one in plain]) / STANDARD_GRAVITY
            return float(pga), float(np.median([peak_velocity(one.acceleration, one.dt) for one in plain]))

        def extent(name: str) -> tuple[str, str]:
            values = np.concatenate([one[name].values for one in floors])
            ends = f"{short_digits(float(values.min()))} to {short_digits(float(values.max()))}"
            return short_digits(float(np.median(values))), ends

        said = []
        if self.isolation is not None:
            middle, ends = extent("isolator_displacement")
            said.append(f"isolators move {middle} m ({ends})")
        if self.yields:
            middle, ends = extent("ductility")
            said.append(f"drifts reach {middle} times those at yielding ({ends})")
        base = "" if self.isolation is None else " on a fixed base"
        (pfa, pfv), (elastic_pfa, elastic_pfv) = medians(floors), medians(beside)
        return (
            f"{', '.join(said)}; floor {top}: PGA {short_digits(pfa)} g (elastic{base} {short_digits(elastic_pfa)}), "
            f"PGV {short_digits(pfv)} m/s (elastic{base} {short_digits(elastic_pfv)}), medians"
        )

    def shake(self, ground: list[xr.DataArray]) -> list[xr.DataArray]:
        """Compute the motions of the floors; floors of a building with a name carry that name (``tower 10``)."""
        if self.kind == "ground":
            refuse_foreign(self, {"name", "kind"}, "kind 'ground'")
            name = self.name or "ground"
            return [array.expand_dims(floor=[name], axis=array.dims.index("time")) for array in ground]
        building = self.build()
        if isinstance(building, shaking.YieldingBuilding):
            moved = [building.floor_motions(one, self.floors) for one in ground]
        else:
            moved = building.floor_motions(ground, self.floors)
        if self.name is None:
            return moved
        return [
            array.assign_coords(floor=[f"{self.name} {floor}" for floor in array["floor"].values]) for array in moved
        ]


def strength_notes(study: Mapping[str, Any]) -> list[Fact]:
    """Return notes on the buildings of a study file, as plain values, whose strength is assumed or uncertain."""
    tables = [one for one in [study.get("building"), *(study.get("buildings") or [])] if one]
    return [fact for table in map(BuildingTable.model_validate, tables) for fact in table.strength_facts]


PROCESSING = ("baseline_order", "window", "taper_s", "highpass_hz", "lowpass_hz", "order")
"""Keys of the corrections of records, in the order in which they are made."""
RECORD_UNITS = ("g", "m/s2", "cm/s2", "mm/s2", "gal")


PAIR = "pair"
AXES = {"both": shaking.both_axes, "weak": shaking.weak_axis}
SHAKES = {"both": BOTH_AXES, "weak": WEAK_AXIS}
"""How both directions of floor histories shake, by the same words."""
PAIR_KEYS = ("axes", "azimuth", "correlation")
"""Keys of components that shake together."""


class MotionsTable(Table):
    """What shakes the blocks: a generator, a pulse, records, or floor histories."""

    generator: Annotated[
        str | None,
        one_of(shaking.GENERATORS),
        Field(description="Name of a stochastic generator, which needs `number`."),
    ] = None
    pulse: Annotated[str | None, one_of(shaking.PULSES), Field(description="Name of a textbook pulse.")] = None
    records: Annotated[
        str | list[str] | None,
        RelativePath(pattern=True),
        Field(description="Record files: paths or patterns (* and **), relative to the study file."),
    ] = None
    floors_file: Annotated[
        str | list[str] | None,
        RelativePath(pattern=True),
        Field(
            description="Floor histories of another program, paths or patterns as for records: CSV with the "
            "header `time, motion/floor [unit], …`, or netCDF (motion, floor, time)."
        ),
    ] = None
    floors_index: Annotated[
        str | None,
        RelativePath(),
        Field(
            description="CSV that names the floor histories of an own building model by level, motion, floor and "
            "direction; of a performance study."
        ),
    ] = None
    elastic: Annotated[
        bool | None,
        KeyInfo("histories are not scaled"),
        Field(
            description="Whether floor histories of a performance study may be scaled to its levels, as if the "
            "building were elastic."
        ),
    ] = None
    number: Annotated[int | None, Field(ge=1, description="Number of simulated motions.")] = None
    seed: Annotated[int | None, KeyInfo(0), Field(ge=0, description="Seed of the simulated motions.")] = None
    duration_s: Annotated[
        float | None,
        KeyInfo("30; 20 for `spectrum-compatible`; else what the motions need", above=0.0),
        Field(
            description="Length of a simulated motion, s; `clough-penzien` motions then come to rest, 21 s by default."
        ),
    ] = None
    dt_s: Annotated[
        float | None,
        KeyInfo("0.005; 0.001 for pulses", above=0.0),
        Field(description="Time step, s; of records only where a table states none."),
    ] = None
    unit: Annotated[
        str | None,
        one_of(RECORD_UNITS),
        KeyInfo("the file's own"),
        Field(description="Unit of accelerations in records, for tables that state none."),
    ] = None
    component: Annotated[
        str | None,
        one_of((*HORIZONTAL, VERTICAL, PAIR)),
        KeyInfo("every horizontal component is a motion"),
        Field(
            description="Component that shakes, where records are joined to recordings by the names of their files; "
            "measures such as RotD50(pga) are of both. `v`: vertical components alone, as if horizontal. `pair`: both "
            "components shake, from records or a generator, or both directions of floor histories."
        ),
    ] = None
    axes: Annotated[
        str | None,
        one_of(AXES),
        KeyInfo("both"),
        Field(
            description="Of a pair: whether blocks rock about both axes, or about their weak axis alone (the "
            "width, where the depth is at least 1.6 times the width)."
        ),
    ] = None
    azimuth: Annotated[
        float | Literal["random"] | None,
        KeyInfo(0.0, unit="°", at_least=-360.0, at_most=360.0),
        Field(
            description="Of a pair: direction of the blocks' width, of an inventory that of the building's x, "
            "clockwise from north (of simulated pairs from h1). `random`: another one for each "
            "motion, by `seed`."
        ),
    ] = None
    correlation: Annotated[
        float | None,
        KeyInfo(0.0, at_least=-1.0, at_most=1.0),
        Field(description="Of a generator's pair: expected correlation of the two components."),
    ] = None
    baseline_order: Annotated[
        int | None,
        KeyInfo("not corrected", at_least=0, at_most=10),
        Field(description="Order of the polynomial that is subtracted from records: 0 their mean, 1 a straight line."),
    ] = None
    window: Annotated[
        list[float] | None,
        KeyInfo("whole", at_least=0.0, at_most=1.0),
        Field(
            min_length=2,
            max_length=2,
            description="Shares of the Arias intensity between which records are kept, as [0.05, 0.95].",
        ),
    ] = None
    taper_s: Annotated[
        float | None, KeyInfo("none", above=0.0), Field(description="Half cosine at both ends of records, s.")
    ] = None
    highpass_hz: Annotated[
        float | None, KeyInfo("none", above=0.0), Field(description="Corner of a high-pass of records, Hz.")
    ] = None
    lowpass_hz: Annotated[
        float | None, KeyInfo("none", above=0.0), Field(description="Corner of a low-pass of records, Hz.")
    ] = None
    order: Annotated[
        int | None,
        KeyInfo(4, at_least=1, at_most=10),
        Field(description="Order of these Butterworth filters, which run both ways: no phase shift."),
    ] = None
    omega_g_rad_s: Annotated[
        float | list[float] | None,
        KeyInfo("5π; from 8π to 3π where it drifts", above=0.0),
        Field(description="Circular frequency of the ground filter, or its drift, rad/s."),
    ] = None
    xi_g: Annotated[float | None, KeyInfo(0.6, above=0.0), Field(description="Damping ratio of the ground filter.")] = (
        None
    )
    omega_g_dispersion: Annotated[
        float | None,
        KeyInfo(0.0, at_least=0.0, at_most=2.0),
        Field(
            description="Dispersion of that frequency from motion to motion (0.5 in records); 0 gives all one spectrum."
        ),
    ] = None
    xi_g_dispersion: Annotated[
        float | None,
        KeyInfo(0.0, at_least=0.0, at_most=2.0),
        Field(description="Dispersion of that damping ratio from motion to motion (0.6 in records)."),
    ] = None
    omega_f_rad_s: Annotated[
        float | None, KeyInfo("π/4", above=0.0), Field(description="Circular frequency of the high-pass, rad/s.")
    ] = None
    xi_f: Annotated[float | None, KeyInfo(0.6, above=0.0), Field(description="Damping ratio of the high-pass.")] = None
    s0_m2_s3: Annotated[
        float | None, KeyInfo(0.01, above=0.0), Field(description="Spectral density of the white noise, m²/s³.")
    ] = None
    baseline: Annotated[
        str | None,
        one_of(BASELINES),
        KeyInfo("`parabolic` for `kanai-tajimi`, `none` for `clough-penzien`"),
        Field(description="Baseline correction."),
    ] = None
    target: Annotated[
        str | None,
        RelativePath(),
        Field(
            description="CSV of the spectrum to be matched, relative to the study file; its first line names "
            "`period (s)` or `frequency (Hz)`, and `sa (g)` or `sa (m/s2)`."
        ),
    ] = None
    s_ds: Annotated[float | None, KeyInfo(unit="g", above=0.0), Field(description="S_DS of ASCE 7.")] = None
    z_over_h: Annotated[
        float | None,
        KeyInfo(0.0, at_least=0.0, at_most=1.0),
        Field(description="Height of attachment over that of the roof."),
    ] = None
    edition: Annotated[str | None, one_of(EDITIONS), KeyInfo("7-16"), Field(description="Edition of ASCE 7.")] = None
    vertical: Annotated[
        bool | None,
        KeyInfo(False),
        Field(description="With `component`: the vertical component shakes, too; of AC156: the vertical spectrum."),
    ] = None
    pgv_bound: Annotated[
        float | None,
        KeyInfo(0.15, above=0.0),
        Field(description="Greatest relative distance of PGV from what the spectrum implies."),
    ] = None
    pgd_bound: Annotated[
        float | None,
        KeyInfo(0.5, above=0.0),
        Field(description="Greatest relative distance of PGD from what the spectrum implies."),
    ] = None
    envelope: Annotated[
        EnvelopeTable | None, KeyInfo("that of the generator"), Field(description="Intensity envelope.")
    ] = None
    magnitude: Annotated[
        float | None,
        KeyInfo("6.5; 7 for `near-fault`", at_least=3.0, at_most=8.5),
        Field(description="Moment magnitude of the scenario."),
    ] = None
    distance_m: Annotated[
        float | None,
        KeyInfo("20 000; 5000 for `near-fault`", at_least=0.0, at_most=1e6),
        Field(description="Distance of the scenario, m."),
    ] = None
    vs30_m_s: Annotated[
        float | None,
        KeyInfo("760; 500 for `near-fault`", at_least=100.0, at_most=3000.0),
        Field(description="Shear-wave velocity of the uppermost 30 m, m/s."),
    ] = None
    faulting: Annotated[
        str | None, one_of(FAULTINGS), KeyInfo("strike-slip"), Field(description="Style of faulting.")
    ] = None
    match_gmm: Annotated[
        bool | None,
        KeyInfo(False),
        Field(
            description="Whether each motion of a scenario, point source or near fault is scaled to a PGV drawn "
            "from the ground-motion model of Boore et al. (2014): its median, event and record "
            "terms."
        ),
    ] = None
    f_c_hz: Annotated[
        float | None,
        KeyInfo("0.15 for `site-based`; else from the magnitude", above=0.0),
        Field(description="Corner of the high-pass, Hz: it rules the peak velocity."),
    ] = None
    arias_constant: Annotated[
        float | None,
        KeyInfo(-1.844, at_least=-5.0, at_most=0.0),
        Field(
            description="Constant of the equation of the Arias intensity: -1.844 as published, -2.2962 in later "
            "code, which is nearer to ground-motion models."
        ),
    ] = None
    arias_m_s: Annotated[float | None, KeyInfo(0.5, above=0.0), Field(description="Expected Arias intensity, m/s.")] = (
        None
    )
    d5_95_s: Annotated[
        float | None, KeyInfo(12.0, above=0.0), Field(description="Time from 5 to 95 % of the Arias intensity, s.")
    ] = None
    t_mid_s: Annotated[
        float | None, KeyInfo(7.0, above=0.0), Field(description="Time to 45 % of the Arias intensity, s.")
    ] = None
    omega_mid_rad_s: Annotated[
        float | None, KeyInfo("10π", above=0.0), Field(description="Filter frequency at that time, rad/s.")
    ] = None
    zeta: Annotated[
        float | None, KeyInfo(0.2, at_least=0.005, at_most=0.99), Field(description="Damping ratio of the filter.")
    ] = None
    depth_m: Annotated[
        float | None, KeyInfo(0.0, at_least=0.0, at_most=3e4), Field(description="Depth of the top of the rupture, m.")
    ] = None
    along_m: Annotated[
        float | None,
        KeyInfo(20000.0, at_least=0.0, at_most=5e5),
        Field(description="Length of rupture towards the site, m."),
    ] = None
    angle_rad: Annotated[
        float | None,
        KeyInfo(0.0, at_least=0.0, at_most=0.5 * math.pi),
        Field(description="Angle between rupture and site, rad."),
    ] = None
    with_pulse: Annotated[
        str | None,
        one_of(WITH_PULSE),
        KeyInfo("always"),
        Field(description="Whether near-fault motions have a pulse; `probability` is the scenario's own."),
    ] = None
    stress_drop_pa: Annotated[
        float | None, KeyInfo(8e6, at_least=1e4, at_most=1e9), Field(description="Stress drop of the source, Pa.")
    ] = None
    kappa_s: Annotated[
        float | None, KeyInfo(0.04, at_least=0.0, at_most=1.0), Field(description="Attenuation near the site, s.")
    ] = None
    q0: Annotated[float | None, KeyInfo(180.0, above=0.0), Field(description="Quality factor of the path at 1 Hz.")] = (
        None
    )
    q_exponent: Annotated[
        float | None, KeyInfo(0.45, at_least=0.0, at_most=1.0), Field(description="Its growth with frequency.")
    ] = None
    beta_m_s: Annotated[
        float | None,
        KeyInfo(3500.0, at_least=100.0, at_most=1e4),
        Field(description="Shear-wave velocity at the source, m/s."),
    ] = None
    density_kg_m3: Annotated[
        float | None, KeyInfo(2800.0, at_least=100.0, at_most=1e4), Field(description="Density at the source, kg/m³.")
    ] = None
    site: Annotated[str | None, one_of(SITES), KeyInfo("generic-rock"), Field(description="Site amplification.")] = None
    amplification: Annotated[
        list[Annotated[tuple[float, float], Field(strict=False)]] | None,
        KeyInfo("that of the site"),
        Field(description="Own amplification instead: pairs of frequency (Hz) and factor."),
    ] = None
    gamma: Annotated[
        float | None,
        KeyInfo(2.0, at_least=1.0, at_most=10.0),
        Field(description="Half cycles of the near-fault pulse."),
    ] = None
    nu_rad: Annotated[
        float | None,
        KeyInfo(0.0, at_least=-100.0, at_most=100.0),
        Field(description="Phase of the near-fault pulse, rad."),
    ] = None
    zero_residual: Annotated[
        bool | None, KeyInfo(False), Field(description="Whether the near-fault pulse leaves nothing.")
    ] = None
    amplitude_m_s2: Annotated[
        float | None, KeyInfo(1.0, above=0.0), Field(description="Amplitude of the pulse, m/s².")
    ] = None
    omega_rad_s: Annotated[
        float | None,
        KeyInfo(above=0.0),
        Field(description="Circular frequency of the pulse, rad/s; every pulse needs it."),
    ] = None
    tail_s: Annotated[float | None, KeyInfo(1.0, at_least=0.0), Field(description="Quiet after the pulse, s.")] = None

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        sources = ("generator", "pulse", "records", "floors_file", "floors_index")
        kinds = [name for name in sources if getattr(self, name) is not None]
        if len(kinds) != 1:
            raise ValueError(f"motions needs exactly one of {', '.join(sources)}, got {' and '.join(kinds) or 'none'}")
        if self.generator is not None and self.number is None:
            raise ValueError("motions from a generator need number (how many)")
        if self.floors_index is not None:
            apart = {"floors_index", "elastic", "dt_s", "unit", "component", "axes"}
            refuse_foreign(self, apart, "motions from a floors_index")
            if self.component not in (None, PAIR):
                raise ValueError(
                    "motions.component of a floors_index is 'pair', where both directions shake, or left out: which "
                    "direction shakes a piece is in the inventory"
                )
        if self.component != PAIR:
            for name in PAIR_KEYS:
                if getattr(self, name) is not None:
                    raise ValueError(f"motions.{name} needs component = 'pair'")
        elif not isinstance(self.azimuth, str) and not abs(self.azimuth or 0.0) <= 360.0:
            raise ValueError(f"motions.azimuth must be between -360 and 360 (in °), or 'random', got {self.azimuth:g}")
        elif self.generator is None and self.records is None and self.floors_index is None:
            raise ValueError("motions.component 'pair' needs records, a generator or a floors_index")
        elif self.generator is not None and self.match_gmm:
            raise ValueError("match_gmm is for one component, not for component = 'pair'")
        elif self.records is not None and self.correlation is not None:
            raise ValueError("motions.correlation is of simulated pairs: those of records have their own")
        return self

    def samples(self, folder: Path) -> float:
        """The number of samples of all motions that are generated, 0 where they are read; ValueError as `build`."""
        made = self._made(folder)
        if made is None:
            return 0.0
        if isinstance(made, shaking.Pulse):
            return (made.duration + made.tail) / made.dt
        length = getattr(made, "length", None) or made.duration
        return (self.number or 1) * float(length / made.dt)

    def build(self, folder: Path, first: int = 0) -> list[xr.DataArray]:
        """The motions, from number `first` of a generator; ValueError for a wrong parameter or without a record."""
        made = self._made(folder)
        if made is not None:
            refuse_samples(self.samples(folder), "motions")
            seed = self.seed or 0
            with noted():  # (a study has doubts among its notes)
                if self.component == PAIR:
                    pairs = made.sample_pairs(self.number or 1, seed, first, self.correlation or 0.0)
                    return self._both([pairs], first)
                array = made.sample(self.number or 1, seed=seed, first=first)
            if not self.match_gmm:
                return [array]
            return [shaking.scale_to_model(array, made.scenario, seed=seed, first=first)]
        if self.floors_index is not None:
            raise ValueError("motions.floors_index is for a performance study: other studies take floors_file")
        found: list[xr.DataArray] = []
        if self.records is not None:
            apart = {"records", "dt_s", "unit", "component", "vertical", "seed", *PAIR_KEYS, *PROCESSING}
            refuse_foreign(self, apart if self.azimuth == RANDOM else apart - {"seed"}, "motions from records")
            if self.order is not None and self.highpass_hz is None and self.lowpass_hz is None:
                raise ValueError("motions.order is of a filter: it needs highpass_hz or lowpass_hz")
            read: dict[Path, list[xr.DataArray]] = {}
            for path in expand(self.records, folder):
                given = path, self.dt_s, self.unit
                read[path] = [shaking.read(*given)] if self.component is None else shaking.read_all(*given)
                refuse_samples(sum(array.size for arrays in read.values() for array in arrays), "records")
            patterns = [self.records] if isinstance(self.records, str) else self.records
            if self.component in (None, VERTICAL):
                if self.vertical:
                    raise ValueError("motions.vertical needs motions.component, which joins those of a recording")
                chosen = horizontal_motions(read, patterns, folder, self.component == VERTICAL, ON_PURPOSE)
                return [self._processed(array, str(array["source"].values[0])) for array in chosen]
            for pair in pair_up(of_the_ground(read, patterns, folder)):
                # (a window is common to the components, which stay simultaneous)
                done = correct_together(pair, partial(self._processed, what=str(pair["motion"].values[0])))
                if self.vertical and VERTICAL not in done["component"].values:
                    name = str(pair["motion"].values[0])
                    raise ValueError(f"motions.vertical needs a vertical component of each recording, {name} has none")
                both = self.component == PAIR
                found.append(done if both else shaking.as_recorded(done, self.component, self.vertical or False))
            return self._both(found) if self.component == PAIR else found
        if self.floors_file is not None:
            refuse_foreign(self, {"floors_file", "elastic"}, "motions from a floors_file")
            for path in expand(self.floors_file, folder, "floors_file"):
                found.append(shaking.read_floors(path))
                refuse_samples(sum(array.size for array in found), "floors_file")
        return found

    def _both(self, pairs: list[xr.DataArray], first: int = 0) -> list[xr.DataArray]:
        """Return pairs that shake blocks along their axes, whose width has the azimuth of the table."""
        at = 0.0 if self.azimuth is None else self.azimuth
        azimuth = at if isinstance(at, str) else math.radians(at)
        upward = bool(self.vertical)
        return AXES[self.axes or "both"](pairs, azimuth, self.seed or 0, first=first, vertical=upward)

    def _processed(self, record: xr.DataArray, what: str) -> xr.DataArray:
        """Return a record after the corrections that are asked for, in the order of `PROCESSING`."""
        order = 4 if self.order is None else self.order
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
            try:
                record = correction(record)
            except ValueError as error:
                raise ValueError(f"motions.{keys}: {what}: {error}") from None
        return record

    def refuse_moving(self, folder: Path, im: str) -> None:
        """Raise a ValueError if a measure of velocity or displacement is of motions that end moving."""
        made = self.made_by(folder)
        if made is not None and made.ends_moving and ("pgv" in im or "pgd" in im):
            raise ValueError(
                f"motions: generator {self.generator!r} ends moving, so that {im} depends on the duration; take "
                "'clough-penzien' with baseline = 'none', or im = 'pga'"
            )

    def made_by(self, folder: Path) -> shaking.Generator | None:
        """Return the generator of the motions; None of pulses and of what is read."""
        made = self._made(folder)
        return made if isinstance(made, shaking.Generator) else None

    def _made(self, folder: Path) -> Any:
        """Return the generator or pulse that makes the motions, None where they are read."""
        try:
            return self._source(folder)
        except RecordError:
            raise
        except ValueError as error:
            raise ValueError(f"motions: {error}") from None

    def _source(self, folder: Path) -> Any:
        if self.pulse is not None:
            if self.omega_rad_s is None:
                raise ValueError(f"pulse {self.pulse!r} needs omega_rad_s (its circular frequency)")
            amplitude = 1.0 if self.amplitude_m_s2 is None else self.amplitude_m_s2
            values = self.model_copy(update={"amplitude_m_s2": amplitude})
            return construct(shaking.PULSES[self.pulse], values, {"pulse"}, f"pulse {self.pulse!r}")
        if self.generator is None:
            return None
        kind, what = shaking.GENERATORS[self.generator], f"generator {self.generator!r}"
        apart = {"generator", "number", "seed"}
        if kind.scenario is not shaking.Generator.scenario:
            apart.add("match_gmm")
        if self.component == PAIR:
            apart |= {"component", *PAIR_KEYS}
        for need in ("s_ds", "target"):
            if need in getattr(kind, "__dataclass_fields__", {}) and getattr(self, need) is None:
                raise ValueError(f"{what} needs {need}")
        values = self
        if self.target is not None:
            spectrum = shaking.TargetSpectrum.from_csv(folder / self.target)
            values = self.model_copy(update={"target": spectrum})
        made = construct(kind, values, apart, what)
        if self.match_gmm:
            if made.scenario is None:
                raise ValueError("match_gmm needs motions of a scenario, which these are not on this site")
            try:
                shaking.expected_motions(made.scenario)
            except ValueError as error:
                raise ValueError(f"match_gmm: the ground-motion model does not cover this scenario: {error}") from None
        return made
