"""The demands of a building code on every line of an inventory, as variables of a study's results."""

from __future__ import annotations

import numpy as np
import xarray as xr

from ...core.units import DIMENSIONLESS, NEWTON
from ...motions import Building
from ..codes.check import Code, CodeCheck, Component
from ..inventory.contents import Contents, Inventory
from .variables import variable

TEXTS = {
    "status": "what the code says of anchoring it",
    "clause": "clause that says so",
    "factors": "how the design force comes about",
}
NUMBERS = {
    "coefficient": (DIMENSIONLESS, "design force over weight"),
    "force": (NEWTON, "design force at the centre of mass of a piece"),
    "demand": (NEWTON, "horizontal force on the anchors of a piece"),
    "ratio": (DIMENSIONLESS, "force on the anchors over their strength"),
}


def code_variables(
    inventory: Inventory, code: Code, building: Building | None, safety: tuple[str, ...]
) -> dict[str, xr.Variable]:
    """Return the statements of a code on every line, on item; `safety` are consequences that are a risk to persons."""
    found = [code.check(component_of(row, building, safety)) for row in inventory.rows]
    texts = {name: (np.array([getattr(one, name) for one in found], object), text) for name, text in TEXTS.items()}
    return {
        **{f"code_{name}": variable(("item",), each, DIMENSIONLESS, text) for name, (each, text) in texts.items()},
        **{
            f"code_{name}": variable(("item",), np.array([getattr(one, name) for one in found]), units, text)
            for name, (units, text) in NUMBERS.items()
        },
    }


def component_of(row: Contents, building: Building | None, safety: tuple[str, ...]) -> Component:
    """Return a line's piece as a code sees it."""
    ground = str(row.floor) == "0"
    known = building is not None and not ground
    return Component(
        width=row.block.width,
        height=row.block.height,
        cm_height=float(row.block.cm_height or 0.5 * row.block.height),
        kind=row.code_class,
        mass=row.block.mass,
        importance=row.code_importance,
        z=float(building.heights[int(row.floor)]) if known and building is not None else None,
        h=float(building.heights[-1]) if known and building is not None else None,
        at_grade=ground,
        safety=bool({*row.consequences} & {*safety}),
        anchored=row.anchored or row.block.restraint is not None,
        strength=row.anchor_strength,
        anchor_height=row.anchor_height,
    )


def checks_of_items(results: xr.Dataset) -> list[CodeCheck] | None:
    """Return what the code says of every line of a study's results; None where the study names no code."""
    if "code_status" not in results:
        return None
    columns = [results[f"code_{name}"].values.tolist() for name in CodeCheck._fields]
    return [CodeCheck(*one) for one in zip(*columns, strict=True)]
