"""Notes on the horizontal components that shake blocks: along which axis they fall, and what levels are of."""

from __future__ import annotations

from collections.abc import Sequence

import xarray as xr

from ...core.doubts import first_names
from ...core.wording import listed_name, two_digit_percent
from ...fragility.runs.axes import AXIS
from ...motions.arrays import HORIZONTAL
from ...motions.intensity.directions import PAIR_MEASURES
from .words import measure_name

MOST_NAMED = 8


def axis_notes(results: xr.Dataset) -> list[str]:
    """Return a sentence on the share of each block's falls that are along its depth; none of other runs."""
    if AXIS not in results:
        return []
    over = [dim for dim in results[AXIS].dims if dim != "block"]
    fell, deep = ((results[AXIS] >= least).sum(over).values.tolist() for least in (1, 2))
    labels = [str(one) for one in results["block"].values]
    shares = [
        f"{listed_name(label)} {two_digit_percent(part / whole)}"
        for label, whole, part in zip(labels, fell, deep, strict=True)
        if whole
    ]
    if not shares:
        return []
    more = f" and {len(shares) - MOST_NAMED:,} more" if len(shares) > MOST_NAMED else ""
    return [f"share of the falls that are along the depth: {', '.join(shares[:MOST_NAMED])}{more}"]


def held_notes(labels: Sequence[str]) -> list[str]:
    """Return a sentence on what walls, restraints, offsets and leans do along the depth of pieces; none of no piece."""
    if not labels:
        return []
    return [
        f"{first_names(labels)}: a wall, a restraint, an offset of the mass or a lean acts in the direction of the "
        "width; along the depth a piece is run as if it stood free, and what holds it there is left out"
    ]


def component_notes(component: str | None, im: str) -> list[str]:
    """Return a sentence where recordings are scaled by one of their components, and rates are computed from that."""
    if component not in HORIZONTAL or im.partition("(")[0] in PAIR_MEASURES:
        return []
    name = measure_name(im)
    return [
        f"the levels are of {name} of the component that shakes, while hazard curves as a rule are of RotD50 of both: "
        f"levels of RotD50({name}) take the differences between components into account"
    ]
