"""The table ``[support]``: a bench or an isolator between the floor and the blocks."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any

import xarray as xr
from pydantic import Field

from ... import motions as shaking
from ...core.doubts import Doubt, noted
from ...motions.supports.stops import LEAST_FREQUENCY, LEAST_RESTITUTION, RESTITUTION
from .table import KeyInfo, Table, bare, one_of, refuse_foreign

STOPS = ("clearance_mm", "stop_frequency_hz", "stop_restitution")
"""Keys of stops, which isolators have."""
KINDS: dict[str, tuple[set[str], set[str]]] = {
    "bench": ({"frequency_hz", "damping"}, {"frequency_hz"}),
    "linear": ({"period_s", "damping", *STOPS}, {"period_s", "damping"}),
    "bilinear": ({"period_s", "strength", "yield_displacement_mm", *STOPS}, {"period_s", "strength"}),
    "pendulum": ({"radius_m", "friction", *STOPS}, {"radius_m", "friction"}),
}
"""Kinds of supports, each with its own keys and the keys that must be given."""


class SupportTable(Table):
    """What the blocks stand on: a bench, or an isolated platform."""

    kind: Annotated[str, one_of(KINDS), Field(description="A bench (or table, rack), or how a platform is isolated.")]
    frequency_hz: Annotated[
        float | None, KeyInfo(at_least=0.01, at_most=1000.0), Field(description="Natural frequency of a bench, Hz.")
    ] = None
    period_s: Annotated[
        float | None,
        KeyInfo(at_least=0.01, at_most=100.0),
        Field(description="Period of an isolator, s; of a bilinear one, of its stiffness after yielding."),
    ] = None
    damping: Annotated[
        float | None, KeyInfo("bench 0.05", at_least=0.0, below=1.0), Field(description="Damping ratio.")
    ] = None
    strength: Annotated[
        float | None, KeyInfo(above=0.0, below=1.0), Field(description="Force at rest over the weight (lead core).")
    ] = None
    yield_displacement_mm: Annotated[
        float | None,
        KeyInfo(10.0, above=0.0),
        Field(description="Displacement at which it yields, mm; the default is judgement."),
    ] = None
    radius_m: Annotated[float | None, KeyInfo(above=0.0), Field(description="Radius of a pendulum's dish, m.")] = None
    friction: Annotated[
        float | None, KeyInfo(above=0.0, below=1.0), Field(description="Coefficient of friction of a pendulum.")
    ] = None
    clearance_mm: Annotated[
        float | None,
        KeyInfo("no stop", above=0.0),
        Field(description="Displacement at which an isolated platform strikes a stop, mm."),
    ] = None
    stop_frequency_hz: Annotated[
        float | None,
        KeyInfo("strikes are not modelled", at_least=LEAST_FREQUENCY, at_most=250.0),
        Field(
            description="Natural frequency of platform and load on a stop, sqrt(k/m)/(2 pi), Hz: its stiffness, "
            "at least that of the isolator. Contacts last 2 ms at least. Whether a strike makes a "
            "block uplift depends on it: try several."
        ),
    ] = None
    stop_restitution: Annotated[
        float | None,
        KeyInfo(RESTITUTION, at_least=LEAST_RESTITUTION, at_most=1.0),
        Field(description="Velocity of the platform after a strike over that before; the default is judgement."),
    ] = None
    mass_ratio: Annotated[
        float, Field(ge=0.0, lt=1.0, description="Mass of the blocks over that and the platform's; above 0.1 refused.")
    ] = 0.0
    one_way: Annotated[bool, Field(description="Leave out the reaction of heavier blocks all the same.")] = False

    def build(self) -> shaking.Support | shaking.Isolator:
        """Make the support; ValueError where a key does not belong to it or is out of range."""
        own, needed = KINDS[self.kind]
        refuse_foreign(self, own | {"name", "kind", "mass_ratio", "one_way"}, f"kind {self.kind!r}", needed)
        given = self.model_dump(exclude={"name", "kind"}, exclude_none=True)
        options = {bare(key): 1e-3 * value if key.endswith("_mm") else value for key, value in given.items()}
        make: Any = getattr(shaking.Isolator, self.kind, None) or partial(shaking.Support, damping=0.05)
        found: shaking.Support | shaking.Isolator = make(**options)
        return found

    def made(self) -> shaking.Support | shaking.Isolator:
        """Make the support; as `build`, but an error names the table."""
        try:
            return self.build()
        except ValueError as error:
            raise ValueError(f"{self.where}: {error}") from None

    @property
    def where(self) -> str:
        """Its place in a study file."""
        return "support"

    @property
    def scales(self) -> bool:
        """Whether twice the motion below gives twice the motion on top."""
        return self.kind == "bench" or (self.kind == "linear" and self.clearance_mm is None)

    def carry(self, below: list[xr.DataArray]) -> tuple[list[xr.DataArray], list[Doubt]]:
        """Return the motions on top of the support, and the doubt in them; ValueError as `build`."""
        support = self.made()
        try:
            with noted():  # (strikes are said below)
                found = [support.motions(floor) for floor in below]
        except ValueError as error:
            raise ValueError(f"support: {error}") from None
        return found, support.stops.doubts(found) if isinstance(support, shaking.Isolator) else []


class NamedSupportTable(SupportTable):
    """A bench or an isolated platform that lines of an inventory name."""

    name: Annotated[str, Field(min_length=1, max_length=100, description="Its name, in the column `support`.")]

    @property
    def where(self) -> str:
        return f"supports {self.name!r}"
