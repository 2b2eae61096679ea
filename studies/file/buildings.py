"""Tables of a study file for buildings between the ground and the blocks, elastic or not."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, Self

import numpy as np
import xarray as xr
from pydantic import Field, TypeAdapter, create_model

from ... import motions as shaking
from ...core.doubts import noted
from ...core.facts import Fact
from ...core.units import STANDARD_GRAVITY
from ...core.wording import short_digits
from ...motions.floors.isolation import BaseMass
from ...motions.floors.strength import SYSTEMS, Design, Importance, Strength, code_strength
from ...motions.intensity.peaks import peak_velocity
from .derived import Derived, choice, derived, in_si, keys_of
from .table import KeyInfo, Label, one_of

CODE_STRENGTH = ("system", "sds_g", "sd1_g", "importance")
"""Keys of a strength that a code's design gives."""
P_DELTA = Annotated[bool, Field(description="True: include the P-delta effect of the weight above.")]
FIELDS, FACTORS = keys_of(
    shaking.Yielding, {"p_delta": P_DELTA}, defaults={"yield_coefficient": "none: elastic storeys"}
)
COEFFICIENT, *YIELDING = FIELDS
"""Keys of storeys that yield: of their strength, and of what comes with one."""


class IsolationTable(Derived):
    """Isolators below a building, of its whole weight, and the slab on them.

    kind: Linear, or bilinear: lead rubber; or friction pendulums, yielding early.
    base_mass_kg: Mass of the slab above them, kg.
    """

    kind: str
    base_mass_kg: BaseMass


_NOT_BELOW_BUILDINGS = dict.fromkeys(("mass_ratio", "one_way", "clearance", "stop_frequency", "stop_restitution"))
ISOLATION = {
    kind: derived(make, IsolationTable, word=("kind", kind), types=_NOT_BELOW_BUILDINGS)
    for kind, make in (("linear", shaking.Isolator.linear), ("bilinear", shaking.Isolator.bilinear))
}
if TYPE_CHECKING:
    Isolation = IsolationTable
else:
    Isolation = choice("kind", ISOLATION)


class BuildingTable(Derived):
    """A building between the motions and the blocks: elastic, with storeys that yield, or on isolators.

    kind: A uniform cantilever, masses on springs, or none.
    name: Name of the building and prefix of its floors, if there are several.
    """

    kind: str
    name: Label | None = None

    def build(self) -> shaking.Building | shaking.YieldingBuilding:
        """Make the building; ValueError if values do not go together."""
        made: shaking.Building = type(self).makes(**self.options())
        return made

    @property
    def yields(self) -> bool:
        """True if storeys yield."""
        return False

    @property
    def scales(self) -> bool:
        """True if floor motions scale with the ground motions; otherwise they belong to one amplitude of these."""
        return True

    @property
    def what(self) -> str:
        """Name of a building that does not scale."""
        return "a building that yields" if self.given("isolation") is None else "an isolated building"

    @property
    def strength_facts(self) -> list[Fact]:
        """Assumed or uncertain parts of its strength; ValueError as `build`."""
        return []

    @property
    def elastic(self) -> Self:
        """The same building, as if its storeys could not yield, on a fixed base."""
        return self

    def made(self) -> shaking.Building:
        """Make the only building of a study, as elastic as it is before it yields; an error names the table."""
        try:
            self.build()  # (what is wrong with its strength is raised here)
            building = self.elastic.build()
        except ValueError as error:
            raise ValueError(f"building: {error}") from None
        assert isinstance(building, shaking.Building)
        return building

    @property
    def floor_count(self) -> int:
        """The number of floors whose motions are computed; ValueError as `build`."""
        every = self.build().floors  # input warnings on the building are given here
        return len(every if self.given("floors") is None else self.given("floors"))

    def yielding(self, ground: list[xr.DataArray], floors: list[xr.DataArray]) -> str:
        """Return the response of storeys and isolators, and of the last floor compared with an elastic building."""
        top = floors[0]["floor"].values[-1]
        with noted():  # (what is doubted of the elastic building is not of this one)
            elastic_floors = self.elastic.shake(ground)

        def medians(arrays: list[xr.DataArray]) -> tuple[float, float]:
            moves = [record for array in arrays for record in shaking.records(array.sel(floor=[top]))]
            pga = np.median([np.abs(record.acceleration).max() for record in moves]) / STANDARD_GRAVITY
            return float(pga), float(np.median([peak_velocity(record.acceleration, record.dt) for record in moves]))

        def extent(name: str) -> tuple[str, str]:
            values = np.concatenate([floor[name].values for floor in floors])
            ends = f"{short_digits(float(values.min()))} to {short_digits(float(values.max()))}"
            return short_digits(float(np.median(values))), ends

        texts = []
        if self.given("isolation") is not None:
            middle, ends = extent("isolator_displacement")
            texts.append(f"isolators move {middle} m ({ends})")
        if self.yields:
            middle, ends = extent("ductility")
            texts.append(f"drifts reach {middle} times those at yielding ({ends})")
        base = "" if self.given("isolation") is None else " on a fixed base"
        (pfa, pfv), (elastic_pfa, elastic_pfv) = medians(floors), medians(elastic_floors)
        return (
            f"{', '.join(texts)}; floor {top}: PGA {short_digits(pfa)} g (elastic{base} {short_digits(elastic_pfa)}), "
            f"PGV {short_digits(pfv)} m/s (elastic{base} {short_digits(elastic_pfv)}), medians"
        )

    def shake(self, ground: list[xr.DataArray]) -> list[xr.DataArray]:
        """Compute the motions of the floors; floors of a building with a name carry that name (``tower 10``)."""
        building = self.build()
        if isinstance(building, shaking.YieldingBuilding):
            moved = [building.floor_motions(motions, self.given("floors")) for motions in ground]
        else:
            moved = building.floor_motions(ground, self.given("floors"))
        if self.name is None:
            return moved
        return [
            array.assign_coords(floor=[f"{self.name} {floor}" for floor in array["floor"].values]) for array in moved
        ]


class FloorsTable(BuildingTable):
    """A building with floors, which bends and shears as a uniform cantilever.

    floors: Floors with blocks; 0 is the ground.
    """

    floors: Annotated[list[Annotated[int, Field(ge=0)]] | None, KeyInfo("all")] = None


class GroundTable(BuildingTable):
    """No building: blocks are on the ground."""

    @property
    def floor_count(self) -> int:
        return 1

    def shake(self, ground: list[xr.DataArray]) -> list[xr.DataArray]:
        name = self.name or "ground"
        return [array.expand_dims(floor=[name], axis=array.dims.index("time")) for array in ground]


if TYPE_CHECKING:
    YieldingTable = FloorsTable
else:
    YieldingTable = create_model("YieldingTable", __base__=FloorsTable, __module__=__name__, **FIELDS)


class StoreysTable(YieldingTable):
    """A building of masses on springs, which may yield or be on isolators.

    system: Seismic force-resisting system: a default strength from the site's code hazard (assumed).
    sds_g: S_DS of the site by ASCE 7, in g, for `system`.
    sd1_g: S_D1 of the site, in g, for `system`.
    importance: Importance factor I_e of the building, for `system`.
    isolation: Isolators below the building; floor 0 is the slab on them.
    """

    system: Annotated[str | None, one_of(SYSTEMS)] = None
    sds_g: Annotated[Design | None, KeyInfo("that of [performance.code]")] = None
    sd1_g: Design | None = None
    importance: Annotated[Importance | None, KeyInfo(1.0)] = None
    isolation: Isolation | None = None

    def build(self) -> shaking.Building | shaking.YieldingBuilding:
        strength = self.default_strength
        for key in YIELDING:
            if self.given(key) is not None and not self.yields:
                raise ValueError(f"{key} needs yield_coefficient or system: an elastic building does not yield")
        if not self.scales and isinstance(self.given("damping"), list):
            raise ValueError(f"damping of {self.what} must be one number, that of the first and the last mode")
        options, of_yielding = self.options(), in_si(self, FACTORS)
        if strength is not None:
            of_yielding[COEFFICIENT] = strength.coefficient
        if of_yielding:
            options["yielding"] = shaking.Yielding(**of_yielding)
        if self.isolation is not None:
            if "modes" in options:
                raise ValueError("modes must be left out of an isolated building: it has all of them")
            return shaking.Building.isolated(self.isolation.build(), self.isolation.base_mass_kg, **options)
        made: shaking.Building | shaking.YieldingBuilding = shaking.Building.from_storeys(**options)
        return made

    @property
    def yields(self) -> bool:
        return self.given(COEFFICIENT) is not None or self.system is not None

    @property
    def scales(self) -> bool:
        return not self.yields and self.isolation is None

    @property
    def strength_facts(self) -> list[Fact]:
        facts, strength, name = [], self.default_strength, self.name or ""
        if strength is not None:
            facts.append(Fact("building.default_strength", names=(name, strength.text)))
        if self.given("strength_dispersion"):
            more = {"seed": self.given("seed") or 0}
            facts.append(Fact("building.random_strength", self.given("strength_dispersion"), names=(name,), more=more))
        return facts

    @property
    def elastic(self) -> Self:
        return self.model_copy(update=dict.fromkeys((*FIELDS, *CODE_STRENGTH, "isolation")))

    @property
    def default_strength(self) -> Strength | None:
        """The strength that a code's design gives, None if not requested; ValueError without the code hazard."""
        if self.system is None:
            alone = [key for key in CODE_STRENGTH if self.given(key) is not None]
            if alone:
                raise ValueError(f"{alone[0]} needs system: it gives the default strength of one")
            return None
        if self.given(COEFFICIENT) is not None:
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


BUILDINGS = {
    "ground": GroundTable,
    "flexural-shear": derived(shaking.Building.flexural_shear, FloorsTable, word=("kind", "flexural-shear")),
    "storeys": derived(shaking.Building.from_storeys, StoreysTable, word=("kind", "storeys"), types={"yielding": None}),
}
if TYPE_CHECKING:
    Buildings = BuildingTable
else:
    Buildings = choice("kind", BUILDINGS)
_READER: TypeAdapter[BuildingTable] = TypeAdapter(Buildings, config={"defer_build": True})


def strength_notes(study: Mapping[str, Any]) -> list[Fact]:
    """Return notes on the buildings of a study file, as plain values, whose strength is assumed or uncertain."""
    tables = [table for table in [study.get("building"), *(study.get("buildings") or [])] if table]
    return [fact for table in map(_READER.validate_python, tables) for fact in table.strength_facts]
