"""Notes on a performance assessment that a reader needs before relying on its numbers, in sentences."""

from __future__ import annotations

import difflib
import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr

from ...core.aliases import Array, Flags
from ...core.doubts import first_names
from ...core.units import DIMENSIONLESS
from ...core.wording import counted, listed_name, whole_percent
from ...fragility import HazardCurve
from ...fragility.hazard.levels import line_weights
from ...fragility.numerics.proportions import wilson_interval
from ...fragility.risk.modelling import MODELLING
from ...fragility.runs.provenance import number_of_motions
from ...fragility.uncertainty.joint import TOGETHER
from ...models import Block
from ...models.friction import LOCKED
from ...motions.floors.histories import FloorHistories
from ...motions.polarity import BOTH
from ..inventory.contents import Inventory
from ..text.curve_notes import NOTABLE, SETTLED, beyond_hazard
from ..text.words import level_text
from .assessment import BUILDING, straight_weights
from .modelling import covering
from .slide_runs import faces_an_edge
from .variables import FALLEN, fall_flags, levels_have_own_motions, variable

NOTABLE_BELOW = 0.02
"""Share of an annual value from below the levels above which it is worth a sentence."""
COARSE = 0.1
"""Difference between lines and cubics through the levels above which an annual value is worth a sentence."""
NEAR = 0.7
"""Similarity of a consequence to one that is a matter of safety, from which it may be a slip of the pen."""
ABROAD = {
    "injury": "verletz|bless|l[eé]si|ferit|herid|feriment|yaral|травм|harm(?!less)|hurt|casualt",
    "blocks-exit": "ausgang|fluchtweg|sortie|salida|uscita|saída|çıkış|выход|exit|egress|escape",
    "release": "freisetz|gefahrstoff|fuite|fuga|rilascio|утечк|spill|leak",
}
"""Beginnings of words of other languages, and of other English ones, for the safety consequences."""
AMOUNTS = {"number": "overturnings", "loss": "loss", "downtime": "downtime", "injuries": "injuries"}
"""Annual amounts of a building in words."""
SINGULAR = ("loss", "downtime")
MOST_NAMED = 6
"""Most anchored items that a sentence names."""


def notes(assessment: xr.Dataset) -> list[str]:
    """Notes that a reader should know before relying on the numbers: one sentence each."""
    held = anchored_text(assessment)
    found = [held] if held else []
    amounts = _amounts(assessment)
    below = [(one, _share(one, "below")) for one in amounts]
    above = [(one, _share(one, "above")) for one in amounts if not one.settled]
    found += _from(below, NOTABLE_BELOW, "below the first level, where it is a guess: add lower levels")
    found += _from(above, NOTABLE, "above the last level, as if nothing more fell there: add higher levels")
    if not bool(fall_flags(assessment).any()):
        found.append("nothing overturned under any motion: annual values have no intervals")
    if FALLEN in assessment:
        found.append(
            "falls count overturning, as if no piece could slide, and sliding off an edge; overturning alone is given "
            "beside them"
        )
    if levels_have_own_motions(assessment) and "level_weight" in assessment:
        found += _untried(assessment)
    if assessment.attrs["pieces"] == "alike" and int(assessment["count"].max()) > 1:
        found.append("pieces of a line are alike and overturn together: means do not depend on it, extremes do")
    if FALLEN in assessment and assessment.attrs["pieces"] == TOGETHER and int(assessment["count"].max()) > 1:
        found.append("pieces of a line share their friction and fall together: means do not depend on it, extremes do")
    return found


def _untried(assessment: xr.Dataset) -> list[str]:
    """Return a sentence on levels whose own motions made nothing fall: resampling them adds nothing to an interval."""
    flags = fall_flags(assessment)
    never = ~flags.any([dim for dim in flags.dims if dim != "level"]).values
    if not never.any() or never.all():
        return []
    n = number_of_motions(assessment)
    most = float(wilson_interval(np.zeros(1, np.int64), np.array([n]), float(assessment.attrs["confidence"]))[1][0])
    named = ", ".join(level_text(float(one), assessment["level"]) for one in assessment["level"].values[never])
    return [
        f"nothing fell under the {counted(n, 'motion')} at {named}, which intervals of annual values take as certain: "
        f"{whole_percent(most)} of such motions might still make something fall, so take more motions there"
    ]


def anchored_text(here: xr.Dataset) -> str:
    """A sentence on the pieces that are anchored already, for good or with kits that can break; empty without any."""
    every = int(here["count"].values.sum())
    number, names = _named(here, here["anchored"].values.astype(bool))
    one = number == 1
    said = f"{number:,} of {every:,} pieces {'is' if one else 'are'} anchored and assumed not to overturn: {names}"
    kits = here["anchored_with"].values if "anchored_with" in here.coords else np.full(here.sizes["item"], "")
    held, of_kits = _named(here, kits != "", kits)
    if not held:
        return said if number else ""
    can = f"{held:,} of {every:,} pieces {'is' if held == 1 else 'are'} held by a kit that can break: {of_kits}"
    return f"{said}; {can}" if number else can


def _named(here: xr.Dataset, which: Flags, beside: Array | None = None) -> tuple[int, str]:
    """Return the number of the pieces of some items, and the first items, with what holds them."""
    at = np.flatnonzero(which)
    kits = ["" if beside is None else f" ({beside[i]})" for i in at]
    names = [f"{int(here['count'].values[i]):,} × {listed_name(str(here['item'].values[i]))}" for i in at[:MOST_NAMED]]
    named = ", ".join(f"{name}{kit}" for name, kit in zip(names, kits[:MOST_NAMED], strict=True))
    more = f" and {at.size - MOST_NAMED} more items" if at.size > MOST_NAMED else ""
    return int(here["count"].values[at].sum()), f"{named}{more}"


def inventory_notes(inventory: Inventory, safety: Sequence[str], coded: bool) -> list[str]:
    """Notes on what an inventory may have meant, and on what a building code would need of it: a sentence each.

    >>> import toppling as tp
    >>> from toppling.studies.inventory.contents import Contents
    >>> shelf = Contents("shelf", tp.catalogue["bookcase-5-shelf"], floor=0, consequences=("injuries",))
    >>> inventory_notes(Inventory((shelf,)), ("injury", "blocks-exit"), False)[0]
    "the consequence 'injuries' is not among the safety consequences: did you mean 'injury'?"
    >>> shelf = Contents("shelf", tp.catalogue["bookcase-5-shelf"], floor=0, consequences=("injury and release",))
    >>> inventory_notes(Inventory((shelf,)), ("injury", "release"), False)[0]
    "the consequence 'injury and release' is not among the safety consequences: did you mean 'injury; release'?"
    """
    found = []
    words = [word for word in inventory.consequences if word not in safety]
    for word in words:
        parts = set(re.split(r"[^\w-]+", word.lower()))
        near = [known for known in safety if known in parts or re.search(ABROAD.get(known, "$^"), word)]
        near = near or difflib.get_close_matches(word, safety, 1, NEAR)
        if near:
            meant = f"did you mean {'; '.join(near)!r}?"
            found.append(f"the consequence {word!r} is not among the safety consequences: {meant}")
    if words and len(words) == len(inventory.consequences):
        found.append(
            f"no consequence in the inventory ({', '.join(words)}) is a matter of safety ({', '.join(safety)}): every "
            f"piece is judged by {'money' if inventory.value > 0.0 else 'its falls'}; performance.safety names others"
        )
    rolling = [row.label for row in inventory.rows if row.rolls and not row.anchored]
    if rolling:
        found.append(
            f"{first_names(rolling)}: on castors that are not locked a piece rolls, which is not modelled: what is "
            "said of its falls is of the same piece on feet that cannot slide"
        )
    locked = [row.label for row in inventory.rows if row.contact == LOCKED and not row.anchored]
    if locked:
        found.append(
            f"{first_names(locked)}: locked castors are taken as feet, which holds only as long as every brake does"
        )
    if coded:
        for column, missing, what in (
            (
                "mass_kg",
                [row.label for row in inventory.rows if row.block.mass is None],
                "no design force is computed for",
            ),
            (
                "code_class",
                [row.label for row in inventory.rows if not row.code_class],
                "the code's class is not known of",
            ),
        ):
            if missing:
                found.append(f"{column} is not given, so that {what} {first_names(missing)}")
    return found


def polarity_notes(blocks: Sequence[Block], polarity: str) -> list[str]:
    """Notes on how motions are run where front and back of the blocks that can fall differ, or with both polarities."""
    if polarity == BOTH:
        return [
            "every motion is run both ways, as it is and reversed, because an earthquake may come from either side: "
            "intervals count the two as one earthquake, and the fronts of all pieces are taken to face the same way"
        ]
    sided = [block.label for block in blocks if block.sided or faces_an_edge(block)]
    if not sided:
        return []
    return [
        f"{first_names(sided)}: a motion and its reverse differ for what stands at a wall or an edge, is held by a "
        "kit, is loaded off the middle or leans; motions are run as recorded only (performance.polarity), which can "
        "make falls to the front or off an edge and what kits save too high or too low"
    ]


UNDIRECTED = (
    "the directions in the inventory are not used: each floor has one motion, which shakes every piece in the "
    "direction of its width"
)


PROPORTIONAL = (
    "the floor histories are scaled in proportion to their ground motions, as if the building were elastic "
    "(motions.elastic)"
)


def history_notes(histories: FloorHistories, inventory: Inventory) -> list[str]:
    """Notes on floor histories of a user's own building model, and on what is not taken from them: a sentence each."""
    if not histories.unit:
        how = "as they are, of one earthquake"
    elif histories.elastic:
        how = (
            f"one set at {histories.texts[0]}, scaled linearly to the other levels as if the building were elastic "
            "(motions.elastic)"
        )
    else:
        how = f"as they are, each set at its own level: {', '.join(histories.texts)}"
    found = [f"the floor motions are histories of another program's building model ({how})"]
    if histories.own_motions:
        found.append(
            "each level has motions of its own: levels count as independent of each other in intervals of annual values"
        )
    used = {row.direction for row in inventory.rows if not row.anchored}
    if used - {""} and not histories.axes:
        each = [f"{sum(row.direction == one for row in inventory.rows)} in {one}" for one in sorted(used)]
        found.append(
            f"each line is shaken in the direction of its width alone ({', '.join(each)}): shaking across it, and "
            "falling sideways, are not included"
        )
    return found


def hazard_shares(assessment: xr.Dataset, hazard: HazardCurve) -> dict[str, xr.Variable]:
    """Return shares of annual values from shaking below and above the hazard curve's levels (`line_weights`)."""
    levels = assessment["level"].values
    plain = covering(hazard, levels)
    rates = np.asarray(plain.rates)

    def weights(of: Array) -> xr.DataArray:
        return xr.DataArray(straight_weights(levels, plain, of).weights, dims="level")

    # where other events are left out the curve is flat: below its own first level, or all the way up to its last
    shaking, known, rarer = (weights(np.minimum(rates, most)) for most in (np.inf, hazard.rates[0], hazard.rates[-1]))
    found = {}
    for one in _amounts(assessment):
        given = assessment[f"{one.name}_mean"].sel(place=BUILDING)
        whole = (given * shaking).sum("level")
        for side, weight in (("below", shaking - known), ("above", rarer)):
            share = ((given * weight).sum("level") / whole.where(whole > 0.0)).fillna(0.0).clip(0.0, 1.0)
            share = share.transpose("model")
            text = f"share of the building's {assessment[f'annual_{one.name}'].attrs['long_name']} from shaking {side} "
            text += "the hazard curve's levels"
            found[f"annual_{one.name}_share_{side}"] = variable(("model",), share.values, DIMENSIONLESS, text)
    return found


def hazard_notes(assessment: xr.Dataset, hazard: HazardCurve) -> list[str]:
    """Notes on annual values that hang on few levels, or come from beyond the hazard curve's own: a sentence each."""
    levels = assessment["level"].values
    curve = covering(hazard, levels, float(assessment.attrs.get(MODELLING, 0.0)))
    whole = xr.DataArray(line_weights(levels, curve).weights, dims="level")
    amounts, more = _amounts(assessment), []
    for one in amounts:
        given = assessment[f"{one.name}_mean"].sel(place=BUILDING)
        annual = (given * whole).sum("level")
        apart = float((annual / one.annual.where(one.annual > 0.0) - 1.0).fillna(0.0).max())
        more += [f"{whole_percent(apart)} more annual {one.text}"] if apart > COARSE else []
    found = []
    if more:
        found.append(
            f"the levels are coarse for this hazard curve: straight lines between them would give {_listed(more)} than "
            "the cubics used: add levels"
        )
    for side, end in (("below", hazard.levels[0]), ("above", hazard.levels[-1])):
        shares = [(one, float(assessment[f"annual_{one.name}_share_{side}"].max())) for one in amounts]
        where = beyond_hazard(side, level_text(float(end), assessment["level"]), hazard.of_formula)
        found += _from(shares, NOTABLE, f"shaking {where}")
    return found


class _Amount(NamedTuple):
    """An annual amount of the whole building; `settled`: nearly everything has fallen at the last level."""

    name: str
    text: str
    annual: xr.DataArray
    settled: bool
    assessment: xr.Dataset


def _amounts(assessment: xr.Dataset) -> list[_Amount]:
    """Return number, loss, downtime and injuries, where their annual values are known."""
    free = (~assessment["anchored"].astype(bool)) * assessment["count"]
    fallen = assessment["probability"].isel(level=-1)
    found = []
    for name, text in AMOUNTS.items():
        if f"annual_{name}" in assessment:
            each = free * _of_a_piece(assessment, name)
            settled = bool(((fallen * each).sum("item") >= SETTLED * float(each.sum())).all())
            found.append(_Amount(name, text, assessment[f"annual_{name}"].sel(place=BUILDING), settled, assessment))
    return found


def _of_a_piece(assessment: xr.Dataset, name: str) -> xr.DataArray | float:
    """Return how much a falling piece of each item adds; its median for downtimes, of which the longest counts."""
    if name == "number":
        return 1.0
    if name == "loss":
        return assessment["value"]
    if name == "downtime":
        return assessment["downtime_median"].fillna(0.0)
    return (assessment["persons_exposed"] * assessment["injury_probability"]).fillna(0.0)


def _share(one: _Amount, side: str) -> float:
    """Return the share of an annual amount from one side of the levels, the largest of the laws; 0 of an amount 0."""
    part = one.assessment[f"annual_{one.name}_{side}"].sel(place=BUILDING)
    # (the weight of cubics for the last level may be less than the rate above it)
    return float((part / one.annual.where(one.annual > 0.0)).fillna(0.0).clip(max=1.0).max())


def _from(shares: Sequence[tuple[_Amount, float]], least: float, where: str) -> list[str]:
    """Return one sentence on the shares of annual amounts above `least` that come from somewhere, if there are any."""
    told = [(f"{whole_percent(share)} of the annual {one.text}", one.name) for one, share in shares if share > least]
    if not told:
        return []
    single = len(told) == 1 and told[0][1] in SINGULAR
    return [f"{_listed([text for text, _ in told])} {'comes' if single else 'come'} from {where}"]


def _listed(parts: Sequence[str]) -> str:
    return " and ".join([", ".join(parts[:-1]), parts[-1]] if len(parts) > 1 else parts)
