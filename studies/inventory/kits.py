"""Kits: restraints with a name and a cost, and the pieces of an inventory that they fit."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Self

from ...core.parameters import declared
from ...models import Block, Restraint
from ..file.blocks import MAKERS, RestraintTable
from ..file.table import AMOUNT
from .contents import Contents

SAME_WIDTH = 1e-6
"""Relative difference of widths up to which a kit that is made for one width fits another."""
POLE_WIDTH = 0.02
"""That between a piece's width and the distances of a pole from its two edges."""


AT_A_HEIGHT = [kind for kind, make in MAKERS.items() if "height" in declared(make)]
"""Kinds whose moment arm is the height of their anchor."""


@dataclass(frozen=True)
class Kit:
    """A restraint that can be bought for pieces of an inventory.

    `cost` fixes one piece, in the inventory's currency, >= 0. `height` is the height of its anchor, m, of a kit whose
    moment arm is that height (straps, brackets, horizontal cables). `width` is the width of the pieces for which it is
    made, m (tendons, sloping cables).
    """

    name: str
    restraint: Restraint
    cost: float | None = None
    height: float | None = None
    width: float | None = None

    def __post_init__(self) -> None:
        if self.cost is not None:
            AMOUNT.number("cost", self.cost)

    @classmethod
    def of(cls, name: str, table: RestraintTable) -> Self:
        """Return the kit of a study file's table; ValueError if its values are out of range."""
        return cls(name, table.build(), table.cost, table.given("height_m"), table.given("width_m"))

    def misfit(self, block: Block, height: float | None = None) -> str:
        """Return why a block cannot have the kit, '' if it can; height: of anchors on the block, m, if not own."""
        if block.bed is not None:
            return "cannot hold a piece on a soft bed, for which no restraint is modelled"
        if block.edge is not None:
            return "cannot hold a piece near an edge, over which it may slide once the kit breaks: not modelled"
        restraint, sloping = self.restraint, self.width is not None and self.restraint.kind == "cable"
        if restraint.kind in AT_A_HEIGHT:
            if sloping and height is not None:
                return "is a sloping cable, whose anchor has a height of its own"
            at = self.height if height is None else height
            if at is not None and at > block.height:
                return f"is fixed at {at:g} m, above its top at {block.height:g} m"
        if self.width is not None and not math.isclose(self.width, block.width, rel_tol=SAME_WIDTH):
            return f"is made for pieces {self.width:g} m wide, not {block.width:g} m"
        arms = [arm for arm in (restraint.front, restraint.back) if arm is not None]
        if restraint.kind in ("pole", "adhesive") and max(arms) > block.width:
            return f"acts {max(arms):g} m from an edge, beyond its width of {block.width:g} m"
        if restraint.kind == "pole" and not math.isclose(sum(arms), block.width, rel_tol=POLE_WIDTH):
            both = " and ".join(f"{arm:g}" for arm in arms)
            return f"stands {both} m from the edges of a piece {block.width:g} m wide"
        return ""

    def held(self, block: Block, height: float | None = None) -> Block:
        """Return the block with the kit, at the height of its own anchors (m) if that is given."""
        why = self.misfit(block, height)
        if why:
            raise ValueError(f"kit {self.name!r} {why}")
        if block.mass is None:
            raise ValueError(f"kit {self.name!r} needs the mass of the piece (mass_kg)")
        restraint = self.restraint
        if restraint.kind in AT_A_HEIGHT and height is not None:
            restraint = replace(restraint, front=height, back=None if restraint.back is None else height, height=height)
        return replace(block, restraint=restraint)

    def on(self, row: Contents) -> Contents:
        """Return a line of an inventory with the kit instead of any that it has; ValueError as `held`."""
        free = replace(row.block, restraint=None)
        return replace(row, block=self.held(free, row.anchor_height), kit=self.name)

    def fits(self, row: Contents) -> bool:
        """Return True if the pieces of a line can get the kit: not fixed for good, nor by it already, and it fits."""
        return not row.anchored and row.kit != self.name and not self.misfit(row.block, row.anchor_height)
