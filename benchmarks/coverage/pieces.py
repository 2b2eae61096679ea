"""Coverage of ranks of anchoring and of what kits save, in studies of real runs of four pieces."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np
import xarray as xr

from ...fragility import HazardCurve
from ...models import Block, HousnerImpact, Restraint
from ...motions import CloughPenzien
from ...studies.buildings.anchoring import anchoring
from ...studies.buildings.assessment import Assessment, assess
from ...studies.inventory.contents import Contents, Inventory
from ...studies.inventory.kits import Kit
from ...studies.kits.savings import kit_savings
from .drawn_studies import Row, row_of

SIZES = {"case": (0.3, 1.8), "wider": (0.31, 1.8), "shelf": (0.35, 1.6), "rack": (0.37, 1.65)}
CONTENTS = Inventory(tuple(Contents(name, Block(*size, mass=60.0), 0) for name, size in SIZES.items()))
KITS = tuple(Kit(f"{force:g} N", Restraint.strap(1.3, force, 20e3), 15.0, 1.3) for force in (120.0, 240.0))
LEVELS = np.geomspace(1.0, 10.0, 8)
HAZARD = HazardCurve(LEVELS.tolist(), (1e-3 * LEVELS**-2.5).tolist(), "pga")
MANY, ENDS = 10_000, ("lower", "upper")
WHAT = [("rank of anchoring", name, 0, "rank", (i, 0)) for i, name in enumerate(SIZES)] + [
    ("share of falls that a kit saves", f"{name}, {kit.name}", 1, "kit_share_saved", (0, k, i))
    for (i, name), (k, kit) in itertools.product(enumerate(SIZES), enumerate(KITS))
]
"""Interval, truth, which dataset of a study holds it, the variable and its place there."""


def rows(full: bool) -> Iterator[Row]:
    """Yield the rows of the table; what is true is what `MANY` other motions say."""
    true = _study(MANY, -1)
    for motions in (20, 80, 400):
        studies = [_study(motions, k) for k in range(1000 if full else 200)]
        for interval, truth, of, name, at in WHAT:
            lower, upper = (np.array([study[of][f"{name}_{end}"].values[at] for study in studies]) for end in ENDS)
            yield row_of(interval, truth, motions, (lower, upper), float(true[of][name].values[at]))


def _study(motions: int, number: int) -> tuple[xr.Dataset, xr.Dataset]:
    shaken = CloughPenzien(duration=8.0, dt=0.01).sample(motions, seed=number + 1)
    asked = Assessment([HousnerImpact(geometry="linear")], shaken, LEVELS, "pga", hazard=HAZARD, replicates=400)
    assessment = assess(CONTENTS, asked, sides=True)
    return anchoring(assessment, "number", replicates=400), kit_savings(CONTENTS, KITS, assessment, asked)
