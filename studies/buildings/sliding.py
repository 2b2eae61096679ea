"""Sliding in an inventory as results: sliding instead of rocking, slips, falls off edges, and rates."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import xarray as xr

from ...core.aliases import Array, Flags
from ...core.facts import Fact, doubted
from ...core.units import DIMENSIONLESS
from ...fragility.analyses.sliding import SLIDES_ON
from ...fragility.runs.provenance import AXES, configuration_of
from ...models.friction import FixedFriction
from ..inventory.contents import Contents, Inventory
from ..plan.slides import (
    GATED,
    GATED_RATE,
    INSTEAD,
    NEAR,
    SHARE,
    SLIP,
    SLIP_RATE,
    TRIP,
    TRIP_RATE,
    near_uplift,
    of_near,
    slide_notes,
)
from .outcomes import JointFlags
from .slide_runs import SlidingRuns, slides
from .variables import LineEvent, Modelled, Precision, Variables, Year, line_variables, variable

OFF, OFF_RATE = "off_probability", "off_rate"
MOVES, MOVES_RATE = "support_moves_probability", "support_moves_rate"
MOVES_SHARE, MOVES_RATE_SHARE = "support_moves_share", "support_moves_rate_share"
OVERTURNING, OVERTURNING_RATE = "overturning_probability", "overturning_rate"


def slide_variables(
    joint: JointFlags,
    overturned: Flags,
    runs: SlidingRuns,
    precision: Precision,
    year: Year | None,
    modelled: Modelled | None = None,
) -> Variables:
    """Compute the effects of sliding, line by line, with annual rates if there is a hazard; NaN if unknown."""
    rows = joint.inventory.rows
    rocks = np.array([runs.rocks(rows[i]) for i in runs.rows]).reshape(len(runs.rows), runs.variants)

    def counted(which: int | slice) -> Callable[[slice], Array]:
        return lambda part: runs.counts[part, which] / runs.variants

    def gated(part: slice) -> Array:
        return _weighted(overturned, runs.rows[part], rocks[part])

    def gone(part: slice) -> Array:
        return np.asarray((runs.off[part] != 0).mean(axis=1))

    def tripped(part: slice) -> Array:
        return runs.tripped[part] / runs.variants

    alone, edged = "a piece overturns, as if it could not slide", range(len(rows)) if runs.edged else ()
    events = [
        LineEvent(SHARE, "", ("block",), "a piece slides", runs.rows, counted(0)),
        LineEvent(SLIP, SLIP_RATE, ("block", "slip"), "a piece slides farther", runs.rows, counted(slice(1, None))),
        LineEvent(
            GATED,
            GATED_RATE,
            ("model", "block"),
            "a piece overturns, where it does not slide instead",
            runs.rows,
            gated,
        ),
        LineEvent(OFF, OFF_RATE, ("block",), "a piece slides off an edge", runs.edged, gone),
        LineEvent(TRIP, TRIP_RATE, ("block",), "a piece slides into an obstacle and trips", runs.near, tripped),
        LineEvent.of_flags(OVERTURNING, OVERTURNING_RATE, alone, overturned, edged),
        LineEvent(
            MOVES, MOVES_RATE, ("block",), "what it stands on slides or rocks", runs.above, runs.moving.__getitem__
        ),
    ]
    variables = _chances_of_friction(rows, runs, rocks) if runs.rows else {}
    if runs.above:
        variables |= _shares_with_moving_supports(joint, runs, year, modelled)
    return variables | line_variables(joint, (event for event in events if event.rows), precision, year, modelled)


def _shares_with_moving_supports(
    joint: JointFlags, runs: SlidingRuns, year: Year | None, modelled: Modelled | None
) -> Variables:
    """Return the shares of lines' falls in runs in which their support moves, given the level and per year."""
    models, items, _, levels, _ = joint.flags.shape
    levels = levels if modelled is None else modelled.mixture.shares.shape[0]
    given, yearly = np.full((models, items, levels), np.nan), np.full((models, items), np.nan)
    with np.errstate(invalid="ignore"):
        for k, i in enumerate(runs.above):
            fell = joint.flags[:, i].mean(axis=1)
            both = fell * runs.moving[k]
            of_each = [falls if modelled is None else modelled.mixture.of(falls) for falls in (both, fell)]
            given[:, i] = of_each[0].sum(axis=-1) / of_each[1].sum(axis=-1)
            if year is not None:
                yearly[:, i] = year.total(both).sum(axis=-1) / year.total(fell).sum(axis=-1)
    text = "share of the falls in runs in which what it stands on slides or rocks"
    variables = {MOVES_SHARE: variable(("model", "block", "level"), given, DIMENSIONLESS, text)}
    if year is not None:
        variables[MOVES_RATE_SHARE] = variable(("model", "block"), yearly, DIMENSIONLESS, f"{text}, of those of a year")
    return variables


def _chances_of_friction(rows: Sequence[Contents], runs: SlidingRuns, rocks: Array) -> Variables:
    """Return the chances of a friction below b/h, and between b/h and 1.3 b/h, means over the variants of each line."""
    instead, near = np.full((2, len(rows)), np.nan)
    for i, rock in zip(runs.rows, rocks, strict=True):
        friction = rows[i].friction
        assert friction is not None  # (these lines slide)
        instead[i], near[i] = 1.0 - rock.mean(), near_uplift(friction, runs.blocks_of(rows[i]), runs.plane).mean()
    text = "chance of a friction with which the piece slides, never rocks"
    return {
        INSTEAD: variable(("block",), instead, DIMENSIONLESS, text),
        NEAR: variable(("block",), near, DIMENSIONLESS, of_near(runs.plane)),
    }


def _weighted(flags: Flags, rows: Sequence[int], weights: Array) -> Array:
    """Return means over variants of flags of some lines (model, line, level, motion) times weights (line, variant)."""
    models, _, variants, *shape = flags.shape
    means = np.empty((models, len(rows), *shape))
    for k, i in enumerate(rows):
        share = weights[k] if variants > 1 else weights[k].mean(keepdims=True)
        means[:, k] = np.einsum("v,mvle->mle", share, flags[:, i].astype(np.float64)) / variants
    return means


def item_slide_notes(assessment: xr.Dataset, inventory: Inventory) -> list[Fact]:
    """Return the limits of the results on sliding of the lines that have friction and can fall."""
    at = [i for i, row in enumerate(inventory.rows) if row.friction is not None and not row.anchored]
    if INSTEAD not in assessment or not at:
        return []
    blocks = [replace(inventory.rows[i].block, name=inventory.rows[i].label) for i in at]
    facts = doubted(str(assessment.attrs.get(SLIDES_ON, "")).splitlines())
    names = [name for name in (INSTEAD, NEAR, TRIP) if name in assessment]
    chances = assessment[names].isel(block=at)
    exact = [row.label for row in inventory.rows if slides(row) and isinstance(row.friction, FixedFriction)]
    facts += slide_notes(chances, blocks, exact, plane=AXES in configuration_of(assessment))
    if MOVES in assessment:
        moving = shares_with_moving_supports(assessment)
        above = [i for i, row in enumerate(inventory.rows) if row.stands_on]
        worst = max(above, key=lambda i: moving[i])
        more = {"several": bool((moving > 0.0).sum() > 1)}
        name = str(assessment["block"].values[worst])
        facts.append(Fact("support.pedestals_as_floor", float(moving[worst]), names=(name,), more=more))
    return facts


def shares_with_moving_supports(results: xr.Dataset) -> Array:
    """Return the share of each line's falls in runs in which its support moves; without a hazard the maximum."""
    if MOVES_RATE_SHARE in results:
        shares = results[MOVES_RATE_SHARE].isel(model=0)
    else:
        shares = results[MOVES_SHARE].isel(model=0).max("level")
    return np.asarray(np.nan_to_num(shares.values))
