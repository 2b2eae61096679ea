"""Tables of a study file that say what shakes the blocks: motions and buildings."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Self

import xarray as xr
from pydantic import Field, model_validator

from .. import motions as shaking
from ..motions.filters import BASELINES
from ..motions.nearfault import WITH_PULSE
from ..motions.scenario import FAULTINGS
from ..motions.seismological import SITES
from ..motions.targets import EDITIONS
from .tables import Table, bare, construct, expand, one_of, refuse_foreign


class EnvelopeTable(Table):
    """Intensity envelope of a simulated motion."""

    kind: Annotated[str, one_of(shaking.ENVELOPES), Field(description="Its shape.")]
    rise_s: Annotated[float | None, Field(description="End of the quadratic rise, s.")] = None
    strong_end_s: Annotated[float | None, Field(description="End of the strong phase, s.")] = None
    decay_per_s: Annotated[float | None, Field(description="Rate of decay, 1/s.")] = None
    shape: Annotated[float | None, Field(description="Shape of the gamma envelope, above 1.")] = None
    rate_per_s: Annotated[float | None, Field(description="Rate of the gamma envelope, 1/s.")] = None
    slow_per_s: Annotated[float | None, Field(description="Slow rate of the double exponential, 1/s.")] = None
    fast_per_s: Annotated[float | None, Field(description="Fast rate of the double exponential, 1/s.")] = None

    def build(self) -> shaking.Envelope:
        """The envelope; ValueError where a parameter does not belong to it or is out of range."""
        envelope: shaking.Envelope = construct(shaking.ENVELOPES[self.kind], self, {"kind"}, f"envelope {self.kind!r}")
        return envelope


BUILDINGS: dict[str, tuple[set[str], set[str]]] = {
    "ground": (set(), set()),
    "flexural-shear": ({"period_s", "alpha0", "storeys"}, {"period_s"}),
    "storeys": ({"masses_kg", "stiffnesses_n_m"}, {"masses_kg", "stiffnesses_n_m"}),
}
"""Kinds of buildings: the keys that are their own, and those that must be given."""


class BuildingTable(Table):
    """An elastic building between the motions and the blocks."""

    name: Annotated[str | None, Field(min_length=1, description="Its name, where there are several.")] = None
    kind: Annotated[str, one_of(BUILDINGS), Field(description="A uniform cantilever, masses on springs, or none.")]
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
        refuse_foreign(
            self, own | {"name", "kind", "damping", "storey_height_m", "modes", "floors"}, f"kind {self.kind!r}"
        )
        missing = sorted(name for name in needed if getattr(self, name) is None)
        if missing:
            raise ValueError(f"kind {self.kind!r} needs {' and '.join(missing)}")
        given = self.model_dump(exclude={"name", "kind", "floors"}, exclude_none=True)
        options = {bare(key): value for key, value in given.items()}
        make = shaking.Building.flexural_shear if self.kind == "flexural-shear" else shaking.Building.from_storeys
        return make(**options)

    def shake(self, ground: list[xr.DataArray]) -> list[xr.DataArray]:
        """Its floors' motions; floors of a building with a name carry it (``tower 10``)."""
        if self.kind == "ground":
            refuse_foreign(self, {"name", "kind"}, "kind 'ground'")
            return [array.expand_dims(floor=[self.name or "ground"], axis=1) for array in ground]
        moved = self.build().floor_motions(ground, self.floors)
        if self.name is None:
            return moved
        return [
            array.assign_coords(floor=[f"{self.name} {floor}" for floor in array["floor"].values]) for array in moved
        ]


class MotionsTable(Table):
    """What shakes the blocks: a generator, a pulse, records, or floor histories."""

    generator: Annotated[
        str | None, one_of(shaking.GENERATORS), Field(description="Name of a stochastic generator.")
    ] = None
    pulse: Annotated[str | None, one_of(shaking.PULSES), Field(description="Name of a textbook pulse.")] = None
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
    baseline: Annotated[str | None, one_of(BASELINES), Field(description="Baseline correction.")] = None
    target: Annotated[
        str | None, Field(description="CSV of the spectrum to be matched, relative to the study file.")
    ] = None
    s_ds: Annotated[float | None, Field(description="S_DS of ASCE 7, in g.")] = None
    z_over_h: Annotated[float | None, Field(description="Height of attachment over that of the roof (0).")] = None
    edition: Annotated[str | None, one_of(EDITIONS), Field(description="Edition of ASCE 7 (7-16).")] = None
    vertical: Annotated[bool | None, Field(description="The vertical spectrum (false).")] = None
    lowest_frequency_hz: Annotated[float | None, Field(description="Where matching starts, Hz (0.1).")] = None
    f_lowest_hz: Annotated[float | None, Field(description="Lowest natural frequency of the component, Hz.")] = None
    pgv_bound: Annotated[float | None, Field(description="Greatest relative distance of PGV (0.15).")] = None
    pgd_bound: Annotated[float | None, Field(description="Greatest relative distance of PGD (0.5).")] = None
    envelope: Annotated[EnvelopeTable | None, Field(description="Intensity envelope.")] = None
    magnitude: Annotated[float | None, Field(description="Moment magnitude of the scenario.")] = None
    distance_m: Annotated[float | None, Field(description="Distance of the scenario, m.")] = None
    vs30_m_s: Annotated[float | None, Field(description="Shear-wave velocity of the uppermost 30 m, m/s.")] = None
    faulting: Annotated[str | None, one_of(FAULTINGS), Field(description="Style of faulting.")] = None
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
        str | None, one_of(WITH_PULSE), Field(description="Whether near-fault motions have a pulse.")
    ] = None
    stress_drop_pa: Annotated[float | None, Field(description="Stress drop of the source, Pa.")] = None
    kappa_s: Annotated[float | None, Field(description="Attenuation near the site, s.")] = None
    q0: Annotated[float | None, Field(description="Quality factor of the path at 1 Hz.")] = None
    q_exponent: Annotated[float | None, Field(description="Its growth with frequency.")] = None
    beta_m_s: Annotated[float | None, Field(description="Shear-wave velocity at the source, m/s.")] = None
    density_kg_m3: Annotated[float | None, Field(description="Density at the source, kg/m³.")] = None
    site: Annotated[str | None, one_of(SITES), Field(description="Site amplification.")] = None
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
            refuse_foreign(self, {"records", "dt_s"}, "motions from records")
            return [shaking.read(path, self.dt_s) for path in expand(self.records, folder)]
        if self.floors_file is not None:
            refuse_foreign(self, {"floors_file"}, "motions from a floors_file")
            return [shaking.read_floors(path) for path in expand(self.floors_file, folder, "floors_file")]
        if self.pulse is not None:
            if self.omega_rad_s is None:
                raise ValueError(f"pulse {self.pulse!r} needs omega_rad_s (its circular frequency)")
            amplitude = 1.0 if self.amplitude_m_s2 is None else self.amplitude_m_s2
            values = self.model_copy(update={"amplitude_m_s2": amplitude})
            return [construct(shaking.PULSES[self.pulse], values, {"pulse"}, f"pulse {self.pulse!r}").sample(1)]
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
        generator = construct(kind, values, apart, what)
        return [generator.sample(self.number, seed=self.seed or 0)]
