"""The pieces of a building one by one: how likely each falls, what anchoring it costs and saves, and what to do."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr

from ...aliases import Array
from ...fragility.fitting.isotonic import crossings, isotonic_probabilities
from ..budget import Choice, best_set
from ..codes.check import REQUIRED, CodeCheck
from .code_checks import checks_of_items
from .variables import JOINT

SAFETY = ("injury", "blocks-exit", "release")
"""Consequences that rank before money, where a study names no others."""
YEARS = 50.0
"""Years in which anchoring has to save its cost, without discounting, to be worth it; and of the chance of falling."""
MOST = 0.8
"""Share of the risk that the pieces which reduce it most make up together."""
SHARES = (0.1, 0.5)
"""Probabilities of falling at whose levels of shaking a piece is described."""

DUTY, WEAK, REDUCES, SAFER, SAVES, PREVENTS, WORTH, UNRESOLVED, UNPRICED, UNVALUED, SMALL, ANCHORED = (
    "required by code",
    "anchor below code force",
    "reduces risk most",
    "makes people safer",
    "reduces loss most",
    "prevents most other falls",
    "worth its cost",
    "not resolved",
    "anchoring cost not given",
    "value not given",
    "small effect",
    "anchored",
)
_ORDER = (DUTY, WEAK, REDUCES, SAFER, SAVES, PREVENTS, WORTH, UNRESOLVED, UNPRICED, UNVALUED, SMALL, ANCHORED)
HELD = (ANCHORED, WEAK)
"""Recommendations for pieces that are anchored; those without a kit do not fall in any run."""
SORTS = ("recommendation", "chance", "loss", "payback", "value", "cost", "floor", "item")
"""What pieces can be sorted by."""


class Range(NamedTuple):
    """A value with the ends of its interval, NaN where there is none."""

    value: float
    lower: float
    upper: float

    def times(self, factor: float) -> Range:
        """Return all three multiplied."""
        return Range(*(one * factor for one in self))


UNKNOWN = Range(math.nan, math.nan, math.nan)


class Piece(NamedTuple):
    """One line of an inventory under one law.

    chance: annual rate of falling of a piece (1/year), or its probability at the study's level where there is no
    hazard.  levels: shaking (SI) at which it falls with the probabilities `SHARES`; 0 below all levels, inf above.
    saving: money a year by anchoring the line; payback: years.  NaN where something is not known.  code: what the
    study's building code says of it, None where there is none.  chosen: whether it is among the lines to anchor for the
    study's budget, None where there is none.  downtime: expected days a year for which one piece is out of use;
    injuries: expected number of persons a year whom the line injures.  kit: the kit that holds it and can break, ''
    for none.  carried: value of what stands on the pieces of the line, which is lost where they fall and is part of the
    saving.
    """

    item: str
    room: str
    floor: str
    number: int
    chance: Range
    levels: tuple[float, float]
    consequences: tuple[str, ...]
    value: float
    cost: float
    saving: Range
    payback: float
    safety: bool
    recommendation: str
    code: CodeCheck | None = None
    chosen: bool | None = None
    downtime: Range = UNKNOWN
    injuries: Range = UNKNOWN
    kit: str = ""
    carried: float = 0.0

    @property
    def held(self) -> bool:
        """Whether it is anchored for good, so that it does not fall in any run; a kit can break."""
        return self.recommendation in HELD and not self.kit


def pieces_of(results: xr.Dataset, model: int = 0) -> list[Piece]:
    """Return the pieces of a performance study's results under one of its laws, sorted as the study says.

    Parameters
    ----------
    results : xarray.Dataset
        As a performance study writes it: an assessment (`assess`), with the attributes ``safety`` and ``sort`` where
        these are not as by default, and ``at_level`` without a hazard.
    model : int
        Position of the law.

    Returns
    -------
    list of Piece

    Notes
    -----
    *Required by code* and *anchor below code force* come before all others, whatever the risk.  Other recommendations,
    for pieces that are not anchored.  Where the falling of a piece is a matter of safety (``safety``,
    by default the consequences injury, blocks-exit, and release of a hazardous substance), nothing is said of its cost:
    *reduces risk most* for those that, taken from the one that contributes most, make up four fifths of the expected
    falls of all such pieces (of the expected injuries, where the inventory gives these for all of them), *makes people
    safer* for the others.  For pieces that are no matter of safety: *worth its cost*, if the lower end of what
    anchoring saves in 50 years, without discounting, is more than its cost; *small effect*, if the upper end is less;
    *not resolved* between the two; *anchoring cost not given*, *value not given* where there is nothing to compare.
    Without a hazard, or
    where no piece has a value, *reduces loss most* are those that make up four fifths of the expected loss
    (*prevents most other falls*: of the falls, where nothing has a value), and *small effect* the others; both are
    *reduces risk most* in an inventory of which nothing that is not anchored is a matter of safety.  A piece that falls
    under no motion is *not resolved*.
    """
    here = results.isel(model=model)
    yearly = "item_rate" in here
    if yearly:
        chances = np.stack([here[f"item_rate{end}"].values for end in ("", "_lower", "_upper")], axis=-1)
    else:
        level = here.sel(level=float(results.attrs["at_level"]))
        chances = np.stack([level[f"probability{end}"].values for end in ("", "_lower", "_upper")], axis=-1)
    safety = str(results.attrs.get("safety", JOINT.join(SAFETY))).split(JOINT)
    observed = here["probability"].transpose("item", "level").values
    levels = here["level"].values
    runs = np.ones(levels.size)
    checks = checks_of_items(results)
    chosen = here["budget_chosen"].values if "budget_chosen" in here else None
    kits = here["anchored_with"].values if "anchored_with" in here.coords else np.full(here.sizes["item"], "")
    found = []
    for i, item in enumerate(here["item"].values):
        one = {name: here[name].values[i] for name in ("floor", "count", "anchored", "value", "anchoring_cost")}
        words = tuple(word for word in str(here["consequences"].values[i]).split(JOINT) if word)
        curve = isotonic_probabilities(levels, observed[i], runs)[None]
        chance = Range(*chances[i].tolist())
        count, value, cost = int(one["count"]), float(one["value"]), float(one["anchoring_cost"])
        carried = _carried(here, str(item))
        lost = count * value + carried
        saving = chance.times(lost) if yearly and lost > 0.0 else UNKNOWN
        found.append(
            Piece(
                item=str(item),
                room=str(here["room"].values[i]) if "room" in here.coords else "",
                floor=str(one["floor"]),
                number=count,
                chance=chance,
                levels=(float(crossings(levels, curve, SHARES[0])[0]), float(crossings(levels, curve, SHARES[1])[0])),
                consequences=words,
                value=value,
                cost=cost,
                saving=saving,
                payback=count * cost / saving.value if saving.value > 0.0 else math.nan,
                safety=bool({*words} & {*safety}),
                recommendation=_settled(bool(one["anchored"]), bool(kits[i]), None if checks is None else checks[i]),
                code=None if checks is None else checks[i],
                chosen=None if chosen is None else bool(chosen[i]),
                downtime=_a_year(here, "downtime", i),
                injuries=_a_year(here, "injuries", i),
                kit=str(kits[i]),
                carried=carried,
            )
        )
    return _sorted(_recommended(found), str(results.attrs.get("sort", SORTS[0])))


def _carried(here: xr.Dataset, support: str) -> float:
    """Return the value of what stands on the pieces of a line, and is lost where these fall, also if it is held there.

    What falls by itself in the same motions is counted in its own line as well.
    """
    if "stands_on" not in here.coords:
        return 0.0
    above = here.isel(item=np.flatnonzero(here["stands_on"].values == support))
    return float((above["count"].values * np.nan_to_num(above["value"].values)).sum())


def _a_year(here: xr.Dataset, quantity: str, i: int) -> Range:
    """Return the annual amount of a line, unknown where nothing of the building has it or there is no hazard."""
    name = f"item_annual_{quantity}"
    if name not in here:
        return UNKNOWN
    return Range(*(float(here[f"{name}{end}"].values[i]) for end in ("", "_lower", "_upper")))


def budget_set(results: xr.Dataset, budget: float, model: int = 0) -> Choice:
    """Choose the lines to anchor for a sum of money under one law: `chosen` in the order of the results' items.

    What the code requires comes first (as many pieces as the budget allows), then the most falls of pieces that are a
    matter of safety (the most injuries, where these are known of all such pieces), then of the others what they save in
    50 years beyond their cost: none is chosen that costs more
    than it saves.  Without a hazard, or where nothing has a value, the loss or the falls of the others.

    Parameters
    ----------
    results : xarray.Dataset
        As `pieces_of` takes them.
    budget : float
        Money, in the currency of the inventory.
    model : int
        Position of the law.

    Returns
    -------
    Choice
        With the chosen lines in the order of the results' items.

    Raises
    ------
    ValueError
        A budget that is negative or not finite.
    """
    named = {one.item: one for one in pieces_of(results, model)}
    pieces = [named[str(item)] for item in results["item"].values]
    valued = any(one.value > 0.0 for one in pieces)
    priced = any(math.isfinite(one.saving.value) for one in pieces)
    goals: list[list[float]] = [[], [], []]
    harm = _harm(pieces)
    for one in pieces:
        falls = 0.0 if one.held else one.number * one.chance.value
        goals[0].append(float(one.number) if one.recommendation == DUTY else 0.0)
        goals[1].append(harm(one) if one.safety and not one.held else 0.0)
        gain = falls * one.value + (0.0 if one.held else one.chance.value * one.carried) if valued else falls
        if priced:
            gain = YEARS * one.saving.value - one.number * one.cost
            gain = gain if math.isfinite(gain) else 0.0
        goals[2].append(0.0 if one.safety or one.held or one.recommendation == DUTY else max(gain, 0.0))
    costs: Array = np.array([one.number * one.cost for one in pieces])
    return best_set(costs, budget, [np.array(one) for one in goals])


def _settled(anchored: bool, held: bool, code: CodeCheck | None) -> str:
    """Return the recommendation that is settled before any risk is looked at, '' where there is none.

    anchored: for good; held: by a kit, which can break.
    """
    if (anchored or held) and code is not None and code.ratio > 1.0:
        return WEAK
    if anchored or held:
        return ANCHORED if anchored else ""
    return DUTY if code is not None and code.status == REQUIRED else ""


def _recommended(pieces: Sequence[Piece]) -> list[Piece]:
    """Return the pieces with their recommendations."""
    free = [one for one in pieces if not one.recommendation and one.chance.value > 0.0]
    safety = _most([one for one in free if one.safety], _harm(pieces))
    others = [one for one in free if not one.safety]
    known = any(math.isfinite(one.saving.value) and math.isfinite(one.cost) for one in others)
    valued = any(one.value > 0.0 or one.carried > 0.0 for one in others)
    # (money is never called the greatest risk beside a piece that can injure people)
    first = (SAVES if valued else PREVENTS) if any(one.safety and not one.held for one in pieces) else REDUCES
    most = _most(
        others, lambda one: one.chance.value * ((one.number * one.value + one.carried) if valued else one.number)
    )

    def words(one: Piece) -> str:
        if one.chance.value == 0.0:
            return UNRESOLVED
        if one.safety:
            return REDUCES if one.item in safety else SAFER
        if known:
            return _by_cost(one)
        return first if one.item in most else SMALL

    return [one if one.recommendation else one._replace(recommendation=words(one)) for one in pieces]


def _harm(pieces: Sequence[Piece]) -> Callable[[Piece], float]:
    """Return how much a piece contributes to the danger to people, the measure by which these are ranked.

    The expected injuries, where they are known of all pieces that are a matter of safety and not held; else the falls.
    """
    of = [one for one in pieces if one.safety and not one.held and one.chance.value > 0.0]
    if of and all(one.injuries.value > 0.0 for one in of):
        return lambda one: one.injuries.value if one.injuries.value > 0.0 else 0.0
    return lambda one: one.number * one.chance.value


def _most(pieces: Sequence[Piece], contribution: Callable[[Piece], float]) -> set[str]:
    """Return the names of the pieces that contribute most, and together `MOST` of all."""
    whole = sum(map(contribution, pieces))
    found, part = set(), 0.0
    for one in sorted(pieces, key=contribution, reverse=True):
        if part >= MOST * whole:
            break
        found.add(one.item)
        part += contribution(one)
    return found


def _by_cost(one: Piece) -> str:
    cost = one.number * one.cost
    if math.isnan(one.saving.value):
        return UNVALUED
    if math.isnan(cost):
        return UNPRICED
    least, most = (YEARS * end if math.isfinite(end) else math.nan for end in one.saving[1:])
    return WORTH if least >= cost else SMALL if most < cost else UNRESOLVED


def _sorted(pieces: list[Piece], by: str) -> list[Piece]:
    """Return the pieces in an order; those without a number come last, and equal ones as in the inventory."""

    def last(value: float) -> tuple[bool, float]:
        return math.isnan(value), value

    harm = _harm(pieces)

    def falls(one: Piece) -> float:
        return -one.number * one.chance.value

    if by == "recommendation":
        pieces = sorted(pieces, key=falls)
        pieces.sort(key=lambda one: last(-one.saving.value) if not one.safety else (False, -harm(one)))
        return sorted(
            pieces,
            key=lambda one: (
                one.recommendation == ANCHORED,
                one.recommendation not in (DUTY, WEAK),
                not one.safety,
                _place(one),
            ),
        )
    keys = {
        "chance": lambda one: (one.held, *last(-one.chance.value)),
        "loss": lambda one: (one.held, *last(-one.saving.value)),
        "payback": lambda one: (one.held, *last(one.payback)),
        "value": lambda one: -one.value,
        "cost": lambda one: last(one.cost),
        "floor": lambda one: one.floor.zfill(10) if one.floor.isdecimal() else one.floor,
        "item": lambda one: one.item,
    }
    return sorted(pieces, key=keys[by])


def _place(one: Piece) -> int:
    return _ORDER.index(one.recommendation)
