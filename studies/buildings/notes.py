"""Notes on a performance assessment that a reader needs before relying on its numbers."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr

from ...core.aliases import Array
from ...core.facts import Fact
from ...core.units import DIMENSIONLESS
from ...core.wording import listed_name
from ...fragility import HazardCurve
from ...fragility.hazard.level_weights import line_weights
from ...fragility.numerics.proportions import wilson_interval
from ...fragility.risk.modelling import MODELLING
from ...fragility.runs.provenance import number_of_motions
from ...fragility.uncertainty.joint import TOGETHER
from ...models import Block
from ...models.friction import LOCKED
from ...motions.floors.histories import FloorHistories
from ...motions.polarity import BOTH
from ..inventory.contents import Inventory
from ..text.curve_notes import NOTABLE, SETTLED
from ..text.words import level_text
from .assessment import BUILDING
from .modelling import covering
from .pieces import dangers_meant
from .slide_runs import faces_an_edge
from .variables import FALLEN, fall_flags, levels_have_own_motions, variable

NOTABLE_BELOW = 0.02
"""Share of an annual value from below the levels above which it is worth a sentence."""
COARSE = 0.1
"""Difference between lines and cubics through the levels above which an annual value is worth a sentence."""
APART = 10.0
"""Ratio of the maximum annual value that levels allow between them to the minimum, above which a note is written."""
AMOUNTS = {"number": "overturnings", "loss": "loss", "downtime": "downtime", "injuries": "injuries"}
"""Annual amounts of a building in words."""
MOST_NAMED = 6
"""Most anchored lines that a note names."""


def notes(assessment: xr.Dataset) -> list[Fact]:
    """Return notes for a reader who relies on the numbers."""
    facts = _anchored(assessment)
    amounts = _amounts(assessment)
    below = [(amount, _share(amount, "below")) for amount in amounts]
    above = [(amount, _share(amount, "above")) for amount in amounts if amount.more > 0.0]
    facts += _from("rate.share_below_levels", below, NOTABLE_BELOW)
    facts += _from("rate.share_above_levels", above, NOTABLE)
    if amounts and not bool(fall_flags(assessment).any()):
        facts.append(Fact("building.no_fall"))
    if FALLEN in assessment:
        facts.append(Fact("sliding.upper_estimate"))
    if levels_have_own_motions(assessment) and "level_weight" in assessment:
        facts += _untried(assessment)
    several = int(assessment["count"].max()) > 1
    if assessment.attrs["pieces"] == "alike" and several:
        facts.append(Fact("consequence.pieces_alike", more={"friction": False}))
    if FALLEN in assessment and assessment.attrs["pieces"] == TOGETHER and several:
        facts.append(Fact("consequence.pieces_alike", more={"friction": True}))
    return facts


def _untried(assessment: xr.Dataset) -> list[Fact]:
    """Return the note on levels whose own motions made nothing fall: resampling them adds nothing to an interval."""
    flags = fall_flags(assessment)
    never = ~flags.any([dim for dim in flags.dims if dim != "level"]).values
    if not never.any() or never.all():
        return []
    n = number_of_motions(assessment)
    most = float(wilson_interval(np.zeros(1, np.int64), np.array([n]), float(assessment.attrs["confidence"]))[1][0])
    levels = assessment["level"]
    named = tuple(level_text(float(level), levels) for level in levels.values[never])
    return [Fact("precision.levels_without_falls", most, names=named, more={"motions": n})]


def _anchored(results: xr.Dataset) -> list[Fact]:
    """Return the notes on the pieces that are anchored already, for good or with kits that can break."""
    kits = results["anchored_with"].values if "anchored_with" in results.coords else np.full(results.sizes["block"], "")
    counts, items = results["count"].values, results["block"].values
    facts = []
    for what, which in (
        ("anchoring.already", results["anchored"].values.astype(bool)),
        ("anchoring.with_kit", kits != ""),
    ):
        at = np.flatnonzero(which)
        lines = [[int(counts[i]), listed_name(str(items[i])), str(kits[i])] for i in at[:MOST_NAMED]]
        more = {"of": int(counts.sum()), "lines": lines, "others": max(0, at.size - MOST_NAMED)}
        if at.size:
            facts.append(Fact(what, int(counts[at].sum()), more=more))
    return facts


def inventory_notes(inventory: Inventory, safety: Sequence[str], coded: bool) -> list[Fact]:
    """Return notes on likely slips in an inventory, and on missing data of a building code.

    >>> import toppling as tp
    >>> from toppling.studies.inventory.contents import Contents
    >>> shelf = Contents("shelf", tp.catalogue["bookcase-5-shelf"], floor=0, consequences=("injuries",))
    >>> inventory_notes(Inventory((shelf,)), ("injury", "blocks-exit"), False)[0].names
    ('injuries', 'injury')
    >>> shelf = Contents("shelf", tp.catalogue["bookcase-5-shelf"], floor=0, consequences=("injury and release",))
    >>> inventory_notes(Inventory((shelf,)), ("injury", "release"), False)[0].names
    ('injury and release', 'injury', 'release')
    """
    facts = []
    words = [word for word in inventory.consequences if word not in safety]
    for word in words:
        near = dangers_meant(word, safety)
        if near:
            facts.append(Fact("consequence.misspelt", names=(word, *near)))
    if words and len(words) == len(inventory.consequences):
        more = {"safety": list(safety), "value": inventory.value > 0.0}
        facts.append(Fact("consequence.none_of_safety", names=tuple(words), more=more))
    rows = inventory.rows
    named = {
        "support.rolls": [row for row in rows if row.rolls and not row.anchored],
        "support.brakes_assumed": [row for row in rows if row.contact == LOCKED and not row.anchored],
        "code.mass_not_given": [row for row in rows if coded and row.block.mass is None],
        "code.class_not_given": [row for row in rows if coded and not row.code_class],
    }
    return [*facts, *(Fact(what, names=tuple(row.label for row in of)) for what, of in named.items() if of)]


def polarity_notes(blocks: Sequence[Block], polarity: str) -> list[Fact]:
    """Return notes on the polarity of motions: if front and back of blocks that can fall differ, or for both."""
    if polarity == BOTH:
        return [Fact("motion.polarity_both")]
    sided = tuple(block.label for block in blocks if block.sided or faces_an_edge(block))
    return [Fact("motion.polarity_as_recorded", names=sided)] if sided else []


UNDIRECTED = Fact("motion.directions_unused")
"""Fact of an inventory with directions, if each floor has one motion."""
PROPORTIONAL = Fact("motion.floors_scaled_elastic")
"""Fact of floor histories that are scaled in proportion to their ground motions."""


def history_notes(histories: FloorHistories, inventory: Inventory) -> list[Fact]:
    """Return notes on floor histories of a user's own building model, and on their unused parts."""
    how = "one" if not histories.unit else "elastic" if histories.elastic else "levels"
    facts = [Fact("motion.floor_histories", names=tuple(histories.texts) if histories.unit else (), more={"how": how})]
    if histories.own_motions:
        facts.append(Fact("motion.levels_independent"))
    used = {row.direction for row in inventory.rows if not row.anchored}
    if used - {""} and not histories.axes:
        lines = [[sum(row.direction == axis for row in inventory.rows), axis] for axis in sorted(used)]
        facts.append(Fact("axis.across_not_included", more={"lines": lines}))
    return facts


def hazard_shares(assessment: xr.Dataset, hazard: HazardCurve) -> dict[str, xr.Variable]:
    """Return shares of annual values from below and above the hazard curve's levels (`line_weights`)."""
    levels = assessment["level"].values
    plain = covering(hazard, levels)
    rates = np.asarray(plain.rates)

    def weights(of: Array) -> xr.DataArray:
        return xr.DataArray(line_weights(levels, plain, of).weights, dims="level")

    # where other events are left out the curve is flat: below its own first level, or all the way up to its last
    shaking, known, rarer = (weights(np.minimum(rates, most)) for most in (np.inf, hazard.rates[0], hazard.rates[-1]))
    shares = {}
    for amount in _amounts(assessment):
        given = assessment[f"{amount.name}_mean"].sel(place=BUILDING)
        whole = (given * shaking).sum("level")
        for side, weight in (("below", shaking - known), ("above", rarer)):
            share = ((given * weight).sum("level") / whole.where(whole > 0.0)).fillna(0.0).clip(0.0, 1.0)
            share = share.transpose("model")
            text = (
                f"share of the building's {assessment[f'annual_{amount.name}'].attrs['long_name']} from shaking {side} "
            )
            text += "the hazard curve's levels"
            shares[f"annual_{amount.name}_share_{side}"] = variable(("model",), share.values, DIMENSIONLESS, text)
    return shares


def hazard_notes(assessment: xr.Dataset, hazard: HazardCurve) -> list[Fact]:
    """Return notes on annual values that hang on few levels, or come from beyond the hazard curve's own."""
    levels = assessment["level"].values
    curve = covering(hazard, levels, float(assessment.attrs.get(MODELLING, 0.0)))
    whole = xr.DataArray(line_weights(levels, curve).weights, dims="level")
    amounts = _amounts(assessment)
    rates = xr.DataArray(curve.rate_at(levels), dims="level")
    events = rates - rates.shift(level=-1)  # (between each level and the next one)
    apart, facts = [], []
    for amount in amounts:
        given = assessment[f"{amount.name}_mean"].sel(place=BUILDING).reset_coords(drop=True).drop_vars("level")
        known = amount.annual.where(amount.annual > 0.0)
        apart.append((amount, float(((given * whole).sum("level") / known - 1.0).fillna(0.0).max())))
        beyond = (given * rates).isel(level=-1)
        least, most = (((amount * events).sum("level") + beyond) / known for amount in (given, given.shift(level=-1)))
        if bool((most > APART * least).any()):
            ends = float(least.min()), float(most.max())
            facts.append(Fact("hazard.levels_apart", lower=ends[0], upper=ends[1], names=(amount.text,)))
    facts = [*sorted(facts, key=lambda fact: -fact.upper)[:1], *_from("hazard.levels_coarse", apart, COARSE)]
    for side, end in (("below", hazard.levels[0]), ("above", hazard.levels[-1])):
        shares = [(amount, float(assessment[f"annual_{amount.name}_share_{side}"].max())) for amount in amounts]
        level = level_text(float(end), assessment["level"])
        facts += _from("rate.share_beyond_hazard", shares, NOTABLE, side=side, end=level, formula=hazard.of_formula)
    return facts


def changes_beyond_levels(assessment: xr.Dataset) -> dict[str, dict[str, float]]:
    """Return the possible relative change of each annual amount from motions weaker and stronger than the runs.

    Below the first level all of its share is a guess; above the last one everything else may fall, which is infinite if
    nothing fell.
    """
    amounts = _amounts(assessment)
    above = {
        amount.text: _share(amount, "above") * amount.more if amount.annual.any() or not amount.more else np.inf
        for amount in amounts
    }
    return {"below": {amount.text: _share(amount, "below") for amount in amounts}, "above": above}


class _Amount(NamedTuple):
    """An annual amount of the whole building.

    `more`: pieces without a fall at the last level over pieces with one, 0 if nearly all fell.
    """

    name: str
    text: str
    annual: xr.DataArray
    more: float
    assessment: xr.Dataset


def _amounts(assessment: xr.Dataset) -> list[_Amount]:
    """Return number, loss, downtime and injuries, if their annual values are known."""
    free = (~assessment["anchored"].astype(bool)) * assessment["count"]
    fallen = assessment["probability"].isel(level=-1)
    amounts = []
    for name, text in AMOUNTS.items():
        if f"annual_{name}" in assessment:
            amount = free * of_a_piece(assessment, name)
            down, whole = float((fallen * amount).sum("block").min()), float(amount.sum())
            more = 0.0 if down >= SETTLED * whole else min(whole / max(down, 1e-300) - 1.0, 1e300)
            amounts.append(_Amount(name, text, assessment[f"annual_{name}"].sel(place=BUILDING), more, assessment))
    return amounts


def of_a_piece(assessment: xr.Dataset, name: str) -> xr.DataArray | float:
    """Return the contribution of a falling piece of each item; the median of downtimes, of which the longest counts."""
    if name == "number":
        return 1.0
    if name == "loss":
        return assessment["value"]
    if name == "downtime":
        return assessment["downtime_median"].fillna(0.0)
    return (assessment["persons_exposed"] * assessment["injury_probability"]).fillna(0.0)


def _share(amount: _Amount, side: str) -> float:
    """Return the share of an annual amount from one side of the levels, the largest of the laws; 0 of an amount 0."""
    part = amount.assessment[f"annual_{amount.name}_{side}"].sel(place=BUILDING)
    # (the weight of cubics for the last level may be less than the rate above it)
    return float((part / amount.annual.where(amount.annual > 0.0)).fillna(0.0).clip(max=1.0).max())


def _from(what: str, shares: Sequence[tuple[_Amount, float]], least: float, **more: object) -> list[Fact]:
    """Return one fact on the shares of annual amounts above `least`, if there are any."""
    named = [[share, amount.text] for amount, share in shares if share > least]
    return [Fact(what, more={"shares": named, **more})] if named else []
