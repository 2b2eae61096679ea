"""Tables of a study file for what stands between the ground and the blocks: buildings, elastic or not."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Self

import numpy as np
import xarray as xr
from pydantic import Field

from ... import motions as shaking
from ...core.doubts import noted
from ...core.facts import Fact
from ...core.units import STANDARD_GRAVITY
from ...core.wording import short_digits
from ...motions.floors.strength import LARGEST_IMPORTANCE, SYSTEMS, Strength, code_strength
from ...motions.floors.yielding import MOST_DISPERSION
from ...motions.intensity.peaks import peak_velocity
from .table import KeyInfo, Table, bare, one_of, refuse_foreign

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
