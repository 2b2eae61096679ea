"""The pieces of a building one by one: probability of falling, cost and saving of anchoring, and recommendation."""

import difflib
import json
import math
import re
from collections.abc import Sequence

import numpy as np
import xarray as xr

from ...core.elementary import Array, Flags, tan
from ...core.units import DIMENSIONLESS, ENDS, NEWTON
from ...fragility.fitting.isotonic import crossings, isotonic_probabilities
from ...fragility.validity.slab_screen import SQUAT_RATIO
from ...motions import Building
from ..codes.check import Code, CodeCheck, Component
from ..inventory.consequences import SAFETY
from ..inventory.contents import Contents, Inventory
from ..money.budget import Choice, best_set
from ..money.present_value import DISCOUNT
from .recommendations import (
    ANCHORED,
    DUTY,
    INDICATIVE,
    ORDER,
    OUTSIDE,
    UNKNOWN,
    WEAK,
    KitEffect,
    Piece,
    Range,
    carriers,
    harm_of,
    recommended,
    settled,
)
from .sliding import MOVES_RATE_SHARE, MOVES_SHARE, shares_with_moving_supports
from .variables import ANNUAL_SAVING, DOUBTFUL, JOINT, variable

RANKING = "ranked_"
"""Prefix of the names of the ranking's variables in the dataset of the assessment."""
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
    verdicts = [code.check(component_of(row, building, safety)) for row in inventory.rows]
    texts = {
        name: (np.array([getattr(verdict, name) for verdict in verdicts], object), text) for name, text in TEXTS.items()
    }
    return {
        **{
            f"code_{name}": variable(("block",), texts_of, DIMENSIONLESS, text)
            for name, (texts_of, text) in texts.items()
        },
        **{
            f"code_{name}": variable(
                ("block",), np.array([getattr(verdict, name) for verdict in verdicts]), units, text
            )
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
        stated=bool(row.consequences) and not any(dangers_meant(word, safety) for word in row.consequences),
        anchored=row.anchored or row.block.restraint is not None,
        strength=row.anchor_strength,
        anchor_height=row.anchor_height,
    )


def dangers_meant(word: str, safety: Sequence[str]) -> list[str]:
    """Return the safety consequences that another consequence may mean: a slip of the pen, or another language."""
    if word in safety:
        return []
    parts = set(re.split(r"[^\w-]+", word.lower()))
    near = [known for known in safety if known in parts or re.search(ABROAD.get(known, "$^"), word.lower())]
    return near or difflib.get_close_matches(word, safety, 1, NEAR)


def checks_of_items(results: xr.Dataset) -> list[CodeCheck] | None:
    """Return the code's check of every line of a study's results; None if the study names no code."""
    if "code_status" not in results:
        return None
    columns = [results[f"code_{name}"].values.tolist() for name in CodeCheck._fields]
    return [CodeCheck(*row) for row in zip(*columns, strict=True)]


NEAR = 0.7
"""Similarity of a consequence to one that is a matter of safety, from which it may be a slip of the pen."""
ABROAD = {
    "injury": "verletz|bless|l[eé]si|ferit|herid|feriment|yaral|травм|harm(?!less)|hurt|casualt|wound|victim|"
    "danger|fatal|kill|death|gefahr|mort|muert|pelig|p[eé]ril|pericol|perigo|tehlike|ölüm|опас|people|person|life",
    "blocks-exit": "ausgang|fluchtweg|sortie|salida|uscita|saída|çıkış|выход|exit|egress|escape",
    "release": "freisetz|gefahrstoff|fuite|fuga|rilascio|утечк|spill|leak",
}
"""Beginnings of words of other languages, and of further English words, for the safety consequences."""
SHARES = (0.1, 0.5)
"""Probabilities of falling whose levels describe a piece."""

NOTABLE_MOVES = 0.05
"""Share of a piece's falls in runs in which its support moves, above which its probability is only indicative."""
SORTS = ("recommendation", "chance", "loss", "payback", "value", "cost", "floor", "item")
"""Sort keys of pieces."""


def pieces_of(results: xr.Dataset, model: int = 0) -> list[Piece]:
    """Return the pieces of a performance study's results under one of its laws, in the order of the study.

    *Required by code* and *anchor below code force* come before all others, whatever the risk. A matter of safety
    (``safety``) is not weighed against cost. *Reduces risk most* are the pieces that cause four fifths of the expected
    falls of all such pieces (of the injuries, if all are known). *Makes people safer* are the others. Other pieces are
    *worth its cost* if the lower end of the saving of anchoring (or a kit) in 50 years, discounted, is at least its
    cost. They are *small effect* if the upper end is less, and *not resolved* between the two. Without a hazard or
    values, *reduces loss most* or *prevents most other falls* cause four fifths of the loss or the falls. A small
    effect is *danger to people not stated* for lines without any consequence.

    No advice follows from probabilities that are not valid. A squat piece is *outside the model*. A piece is
    *indicative only* if more than 5 % of its falls are in runs in which its support moves. The support is then `fix
    before what stands on it`, unless a rule of safety or code applies to it.
    """
    of_law = results.isel(model=model)
    yearly = "rate" in of_law
    of, name = of_law, "rate"
    if not yearly:
        of, name = of_law.sel(level=float(results.attrs["at_level"])), "probability"
    chances = np.stack([of[f"{name}{end}"].values for end in ENDS], axis=-1)
    safety = str(results.attrs.get("safety", JOINT.join(SAFETY))).split(JOINT)
    observed = of_law["probability"].transpose("block", "level").values
    levels = of_law["level"].values
    runs = np.ones(levels.size)
    checks = checks_of_items(results)
    chosen = of_law["budget_chosen"].values if "budget_chosen" in of_law else None
    kits = of_law["anchored_with"].values if "anchored_with" in of_law.coords else np.full(of_law.sizes["block"], "")
    squat, uncertain = squat_items(results), on_moving_supports(results)
    discount = float(results.attrs.get("discount_rate", DISCOUNT))
    pieces = []
    for i, item in enumerate(of_law["block"].values):
        values = {name: of_law[name].values[i] for name in ("floor", "count", "anchored", "value", "anchoring_cost")}
        words = tuple(word for word in str(of_law["consequences"].values[i]).split(JOINT) if word)
        curve = isotonic_probabilities(levels, observed[i], runs)[None]
        chance = Range(*chances[i].tolist())
        count, value, cost = int(values["count"]), float(values["value"]), float(values["anchoring_cost"])
        carried = _carried(of_law, str(item))
        lost = count * value + carried
        saving = chance.times(lost) if yearly and lost > 0.0 else UNKNOWN
        if ANNUAL_SAVING in of_law and lost > 0.0 and not values["anchored"]:
            saving = _range(of_law, ANNUAL_SAVING, i)
        pieces.append(
            Piece(
                item=str(item),
                room=str(of_law["room"].values[i]) if "room" in of_law.coords else "",
                floor=str(values["floor"]),
                number=count,
                chance=chance,
                levels=(float(crossings(levels, curve, SHARES[0])[0]), float(crossings(levels, curve, SHARES[1])[0])),
                consequences=words,
                value=value,
                cost=cost,
                saving=saving,
                payback=math.nan,
                safety=bool({*words} & {*safety}),
                recommendation=settled(bool(values["anchored"]), bool(kits[i]), None if checks is None else checks[i]),
                code=None if checks is None else checks[i],
                chosen=None if chosen is None else bool(chosen[i]),
                downtime=_a_year(of_law, "downtime", i),
                injuries=_a_year(of_law, "injuries", i),
                kit=str(kits[i]),
                carried=carried,
                discount=discount,
                tried=_tried(of_law, i, count, count * value if yearly and value > 0.0 else math.nan),
                doubt=OUTSIDE if squat[i] else INDICATIVE if uncertain[i] else "",
            )
        )
    moving = {str(below) for below in of_law["stands_on"].values[uncertain]} if uncertain.any() else set()
    return _sorted(carriers(recommended(pieces), moving), str(results.attrs.get("sort", SORTS[0])))


def ranking_of(results: xr.Dataset) -> xr.Dataset:
    """Return the ranking held by a performance study's results, as `anchoring` returns it."""
    names = [str(name) for name in results.data_vars if str(name).startswith(RANKING)]
    ranked = results[names].rename({name: name.removeprefix(RANKING) for name in names})
    keep = np.flatnonzero(ranked["rank"].notnull().all("model").values)
    doubtful = squat_items(results) | on_moving_supports(results)
    ranked = ranked.assign_coords({DOUBTFUL: ("block", doubtful)})
    return ranked.isel(block=keep).assign_attrs(json.loads(results.attrs["ranking"]))


def uplift_friction(results: xr.Dataset) -> xr.DataArray | None:
    """Return the coefficient of friction that uplift needs, b/h, of every block or item; None if it is not known."""
    if "friction_uplift" in results:
        return results["friction_uplift"]
    known = "alpha" in results.coords and results["alpha"].dims == ("block",)
    return results["alpha"].copy(data=tan(results["alpha"].values)) if known else None


def squat_items(results: xr.Dataset) -> Flags:
    """Return True for squat lines (item,): outside the model, because they bounce rather than rock."""
    needs = uplift_friction(results)
    return np.zeros(results.sizes["block"], bool) if needs is None else np.asarray(needs.values > 1.0 / SQUAT_RATIO)


def on_moving_supports(results: xr.Dataset) -> Flags:
    """Return the lines whose probabilities of falling are only indicative (item,), because their support moves."""
    if MOVES_RATE_SHARE not in results and MOVES_SHARE not in results:
        return np.zeros(results.sizes["block"], bool)
    return np.asarray(shares_with_moving_supports(results) > NOTABLE_MOVES)


def _tried(results: xr.Dataset, i: int, count: int, value: float) -> tuple[KitEffect, ...]:
    """Return the effects of the kits tried on a line; `value`: of all its pieces, NaN if savings are not known."""
    if "kit_falls_saved" not in results:
        return ()
    of_item = results.isel(block=i)
    effects = []
    for name in of_item["kit"].values[of_item["kit_fits"].values.astype(bool)]:
        kit = of_item.sel(kit=name)
        saved, share = _range(kit, "kit_falls_saved"), _range(kit, "kit_share_saved")
        cost = count * float(kit["kit_cost"]) if "kit_cost" in kit else math.nan
        effects.append(KitEffect(str(name), cost, saved, share, saved.times(value)))
    return tuple(effects)


def _carried(results: xr.Dataset, support: str) -> float:
    """Return the value of pieces on the pieces of a line that is lost if these fall, even if it is anchored."""
    if "stands_on" not in results.coords:
        return 0.0
    above = results.isel(block=np.flatnonzero(results["stands_on"].values == support))
    return float((above["count"].values * np.nan_to_num(above["value"].values)).sum())


def _range(values: xr.Dataset, name: str, at: int | tuple[()] = ()) -> Range:
    """Return a value of a line with the ends of its interval."""
    return Range(*(float(values[f"{name}{end}"].values[at]) for end in ENDS))


def _a_year(results: xr.Dataset, quantity: str, i: int) -> Range:
    """Return the annual amount of a line, unknown if the line does not state it or there is no hazard."""
    name, stated = f"block_annual_{quantity}", {"downtime": "downtime_median", "injuries": "persons_exposed"}[quantity]
    if name not in results or (stated in results.coords and math.isnan(results[stated].values[i])):
        return UNKNOWN
    return _range(results, name, i)


def budget_set(results: xr.Dataset, budget: float, model: int = 0) -> Choice:
    """Choose the lines to anchor for a sum of money under one law: `chosen` in the order of the results' items.

    The pieces that the code requires come first, then the most falls (injuries, if known) of pieces that are a matter
    of safety. Then comes the saving of the others in 50 years, discounted, beyond their cost; without a hazard or
    values, their loss or falls. Pieces whose probabilities are no basis for advice are chosen only if the code requires
    it.
    """
    named = {piece.item: piece for piece in pieces_of(results, model)}
    pieces = [named[str(item)] for item in results["block"].values]
    valued = any(piece.value > 0.0 for piece in pieces)
    priced = any(math.isfinite(piece.saving.value) for piece in pieces)
    goals: list[list[float]] = [[], [], []]
    harm = harm_of(pieces)
    for piece in pieces:
        falls = 0.0 if piece.held else piece.number * piece.chance.value
        goals[0].append(float(piece.number) if piece.recommendation == DUTY else 0.0)
        goals[1].append(harm(piece) if piece.safety and piece.judged and not piece.held else 0.0)
        gain = falls * piece.value + (0.0 if piece.held else piece.chance.value * piece.carried) if valued else falls
        if priced:
            gain = piece.worth if math.isfinite(piece.worth) else 0.0
        apart = piece.safety or piece.held or not piece.judged or piece.recommendation == DUTY
        goals[2].append(0.0 if apart else max(gain, 0.0))
    costs: Array = np.array([piece.cost_of_all for piece in pieces])
    return best_set(costs, budget, [np.array(goal) for goal in goals])


def _sorted(pieces: list[Piece], by: str) -> list[Piece]:
    """Return the pieces in an order; pieces without a number come last, and equal pieces as in the inventory."""

    def last(value: float) -> tuple[bool, float]:
        return math.isnan(value), value

    harm = harm_of(pieces)

    def falls(piece: Piece) -> float:
        return -piece.number * piece.chance.value

    if by == "recommendation":
        pieces = sorted(pieces, key=falls)
        pieces.sort(key=lambda piece: last(-piece.saving.value) if not piece.safety else (False, -harm(piece)))
        return sorted(
            pieces,
            key=lambda piece: (
                piece.recommendation == ANCHORED,
                piece.recommendation not in (DUTY, WEAK),
                not piece.safety,
                ORDER.index(piece.recommendation),
            ),
        )
    keys = {
        "chance": lambda piece: (piece.held, *last(-piece.chance.value)),
        "loss": lambda piece: (piece.held, *last(-piece.saving.value)),
        "payback": lambda piece: (piece.held, *last(piece.payback)),
        "value": lambda piece: -piece.value,
        "cost": lambda piece: last(piece.cost),
        "floor": lambda piece: piece.floor.zfill(10) if piece.floor.isdecimal() else piece.floor,
        "item": lambda piece: piece.item,
    }
    return sorted(pieces, key=keys[by])
