"""The table ``[support]``: a bench or an isolator between the floor and the blocks."""

from typing import TYPE_CHECKING, Annotated

import xarray as xr
from pydantic import Field

from ... import motions as shaking
from ...core.doubts import Doubt, noted
from ...core.parameters import declared
from .derived import Derived, choice, derived
from .table import SEVERAL


class SupportTable(Derived):
    """Support of the blocks: a bench, or an isolated platform.

    kind: A bench (or table, rack), or the type of isolation of a platform.
    """

    kind: str
    one_way: Annotated[bool, Field(description=declared(shaking.Support)["one_way"].sentence)] = False

    def made(self) -> shaking.Support | shaking.Isolator:
        """Make the support; as `build`, but an error names the table."""
        try:
            support: shaking.Support | shaking.Isolator = self.build()
        except ValueError as error:
            raise ValueError(f"{self.where}: {error}") from None
        return support

    @property
    def where(self) -> str:
        """Its place in a study file."""
        return "support"

    @property
    def scales(self) -> bool:
        """True if twice the motion below gives twice the motion on top."""
        return self.kind == "bench" or (self.kind == "linear" and self.given("clearance_mm") is None)

    def carry(self, below: list[xr.DataArray]) -> tuple[list[xr.DataArray], list[Doubt]]:
        """Return the motions on top of the support, and the input warning on them; ValueError as `build`."""
        support = self.made()
        try:
            with noted():  # strikes are reported below
                arrays = [support.motions(floor) for floor in below]
        except ValueError as error:
            raise ValueError(f"support: {error}") from None
        return arrays, support.stops.doubts(arrays) if isinstance(support, shaking.Isolator) else []


class NamedSupportTable(SupportTable):
    """A bench or an isolated platform that lines of an inventory name.

    name: Its name, in the column `support`.
    """

    name: Annotated[str, SEVERAL]

    @property
    def where(self) -> str:
        return f"supports {self.name!r}"


MAKERS = {
    "bench": shaking.Support,
    **{kind: getattr(shaking.Isolator, kind) for kind in ("linear", "bilinear", "pendulum")},
}


def _tables(base: type[SupportTable]) -> dict[str, type[SupportTable]]:
    return {kind: derived(make, base, word=("kind", kind)) for kind, make in MAKERS.items()}


if TYPE_CHECKING:
    Supports = SupportTable
    NamedSupports = NamedSupportTable
else:
    Supports = choice("kind", _tables(SupportTable))
    NamedSupports = choice("kind", _tables(NamedSupportTable))
