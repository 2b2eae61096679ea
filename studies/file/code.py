"""The table of a study file that names a building code, with its parameters."""

from typing import TYPE_CHECKING

from ...motions import Building
from ..codes.asce7 import Asce7, Factors
from ..codes.check import Code
from ..codes.eurocode8 import Eurocode8
from .derived import Derived, choice, derived


class CodeTable(Derived):
    """A building code: pieces that it requires to be anchored, forces, and checks of anchors.

    standard: The code: ASCE/SEI 7-22, chapter 13, or EN 1998-1, 4.3.5.
    """

    standard: str

    def of(self, building: Building | None) -> Code:
        """Make the code for a building; ValueError if values do not belong to it."""
        period = None if building is None else float(building.periods[0])
        code: Code = type(self).makes(**self.options(), building_period=period)
        return code


if TYPE_CHECKING:
    Codes = CodeTable
else:
    FactorsTable = derived(Factors, defaults={"c_ar_at_grade": "as `c_ar`"})
    Codes = choice(
        "standard",
        {
            "asce7-22": derived(
                Asce7,
                CodeTable,
                word=("standard", "asce7-22"),
                types={"building_period": None, "factors": dict[str, FactorsTable]},
                defaults={"factors": "none: no forces"},
            ),
            "ec8": derived(
                Eurocode8,
                CodeTable,
                word=("standard", "ec8"),
                types={"building_period": None},
                defaults={"q_a": "2 for storage, else 1"},
            ),
        },
    )
