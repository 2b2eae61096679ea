"""Results of a pooled surface for a region: its notes, examples of its blocks, and joint falls."""

import json

import numpy as np
import xarray as xr

from ...core.facts import Fact
from ...fragility.adaptive.stopping import REACHED
from ...fragility.analyses.surface_results import POOLED
from ..plan.form_free import OF_THE_MEAN
from ..text.block_order import HALF
from ..text.precision import measure_notes
from ..text.words import reference_law

MOST_SAID = 3
"""Most levels of events that a sentence names."""
TELLING = (0.1, 0.5, 0.9)
"""Mean shares of a region that fall, next to which levels are named if there are more."""


def is_pooled(results: xr.Dataset) -> bool:
    """Return True if results are of a pooled surface."""
    return str(results.attrs.get("design")) == POOLED


def pooled_notes(results: xr.Dataset) -> list[Fact]:
    """Return the notes on a region: missed precisions, surfaces cut or unlike their checks, and joint falls."""
    facts = []
    for j in range(results.sizes["model"]):
        of_law = results.isel(model=j)
        cut = "cut_places" in of_law and bool(of_law["cut_places"].notnull().all())
        if cut or str(of_law["stopped_because"].item()) != REACHED or float(of_law["lack_of_fit"]) > 0.0:
            facts.append(Fact("adaptive.account", names=(str(of_law["model"].item()), str(of_law["account"].item()))))
    facts += measure_notes(results)
    if "fallen_mean" not in results:
        facts.append(Fact("region.joint_falls"))
    if "rate" in results and str(json.loads(str(results.attrs["hazard"])).get("weights", "")):
        facts.append(OF_THE_MEAN)
    return facts


def examples(results: xr.Dataset) -> xr.Dataset:
    """Return the blocks with the lowest, the middle and the highest half level, for curves of a region."""
    order = np.argsort(results[HALF].isel(model=reference_law(results)[0]).values, kind="stable")
    chosen = list(dict.fromkeys(order[[0, order.size // 2, order.size - 1]].tolist()))
    which = {"shown_of": results.sizes["block"], "shown_by": "with the lowest, the middle and the highest half level"}
    return results.isel(block=chosen).assign_attrs(which if order.size > len(chosen) else {})


def event_levels(results: xr.Dataset) -> list[tuple[float, float, float, float, int]]:
    """Return the share of a region that falls in one event: level, mean share, its ends and the number of pieces.

    If there are many levels: three, with shares of about 10, 50 and 90 % under the reference law.
    """
    if "fallen_mean" not in results:
        return []
    of_law = results.isel(model=reference_law(results)[0])
    means, levels = of_law["fallen_mean"].values, of_law["event_level"].values
    every = list(range(levels.size))
    if levels.size > MOST_SAID:
        every = sorted({int(np.abs(means - share).argmin()) for share in TELLING})
    ends = of_law["fallen_quantile"].isel(event_quantile=[0, -1]).values
    number = int(results.attrs.get("shown_of", results.sizes["block"]))
    return [(float(levels[k]), float(means[k]), float(ends[k][0]), float(ends[k][1]), number) for k in every]
