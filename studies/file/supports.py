"""The table ``[support]``: a bench or an isolator between the floor and the blocks."""

from __future__ import annotations

from typing import Annotated

import xarray as xr
from pydantic import Field

from ... import motions as shaking
from ...doubts import Doubt
from ...motions.supports.isolator import strike_doubts
from .table import KeyInfo, Table, one_of, refuse_foreign

KINDS: dict[str, tuple[set[str], set[str]]] = {
    "bench": ({"frequency_hz", "damping"}, {"frequency_hz"}),
    "linear": ({"period_s", "damping"}, {"period_s", "damping"}),
    "bilinear": ({"period_s", "strength", "yield_displacement_mm", "clearance_mm"}, {"period_s", "strength"}),
    "pendulum": ({"radius_m", "friction", "clearance_mm"}, {"radius_m", "friction"}),
}
"""Kinds of supports, each with its own keys and the keys that must be given."""
ELASTIC = ("bench", "linear")


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
        float | None, KeyInfo(10.0, above=0.0), Field(description="Displacement at which it yields, mm.")
    ] = None
    radius_m: Annotated[float | None, KeyInfo(above=0.0), Field(description="Radius of a pendulum's dish, m.")] = None
    friction: Annotated[
        float | None, KeyInfo(above=0.0, below=1.0), Field(description="Coefficient of friction of a pendulum.")
    ] = None
    clearance_mm: Annotated[
        float | None,
        KeyInfo("no stop", above=0.0),
        Field(description="Displacement at which the platform would strike a stop, mm."),
    ] = None
    mass_ratio: Annotated[
        float, Field(ge=0.0, lt=1.0, description="Mass of the blocks over that and the platform's; above 0.1 refused.")
    ] = 0.0
    one_way: Annotated[bool, Field(description="Leave out the reaction of heavier blocks all the same.")] = False

    def build(self) -> shaking.Support | shaking.Isolator:
        """Make the support; ValueError where a key does not belong to it or is out of range."""
        own, needed = KINDS[self.kind]
        refuse_foreign(self, own | {"name", "kind", "mass_ratio", "one_way"}, f"kind {self.kind!r}")
        missing = sorted(name for name in needed if getattr(self, name) is None)
        if missing:
            raise ValueError(f"kind {self.kind!r} needs {' and '.join(missing)}")
        ratio, one_way = self.mass_ratio, self.one_way
        if self.kind == "bench":
            assert self.frequency_hz is not None
            damping = 0.05 if self.damping is None else self.damping
            return shaking.Support(self.frequency_hz, damping, ratio, one_way)
        if self.kind == "linear":
            assert self.period_s is not None
            assert self.damping is not None
            return shaking.Isolator.linear(self.period_s, self.damping, ratio, one_way)
        clear = {} if self.clearance_mm is None else {"clearance": 1e-3 * self.clearance_mm}
        if self.kind == "pendulum":
            assert self.radius_m is not None
            assert self.friction is not None
            return shaking.Isolator.pendulum(self.radius_m, self.friction, mass_ratio=ratio, one_way=one_way, **clear)
        assert self.period_s is not None
        assert self.strength is not None
        yields = 0.01 if self.yield_displacement_mm is None else 1e-3 * self.yield_displacement_mm
        return shaking.Isolator.bilinear(
            self.period_s, self.strength, yields, mass_ratio=ratio, one_way=one_way, **clear
        )

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
        return self.kind in ELASTIC

    def carry(self, below: list[xr.DataArray]) -> tuple[list[xr.DataArray], list[Doubt]]:
        """Return the motions on top of the support, and the doubt in them; ValueError as `build`."""
        support = self.made()
        try:
            found = [support.motions(one) for one in below]
        except ValueError as error:
            raise ValueError(f"support: {error}") from None
        return found, strike_doubts(found, support.clearance) if isinstance(support, shaking.Isolator) else []


class NamedSupportTable(SupportTable):
    """A bench or an isolated platform that lines of an inventory name."""

    name: Annotated[str, Field(min_length=1, max_length=100, description="Its name, in the column `support`.")]

    @property
    def where(self) -> str:
        return f"supports {self.name!r}"
