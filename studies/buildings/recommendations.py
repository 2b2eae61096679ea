"""Effect of anchoring a line of an inventory, in a few words: the rules that assess pieces and kits."""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

from ..codes.check import REQUIRED, CodeCheck
from ..money.present_value import DISCOUNT, payback, present_value

YEARS = 50.0
"""Years in which anchoring has to save its cost to be worth it, discounted; and of the chance of falling."""
MOST = 0.8
"""Share of the risk that the pieces which reduce it most make up together."""
HALF = 0.5
"""Share of the falls that a kit must be able to prevent to be enough."""

DUTY, WEAK, FIRST, REDUCES, SAFER, SAVES, PREVENTS, WORTH = (
    "required by code",
    "anchor below code force",
    "fix before what stands on it",
    "reduces risk most",
    "makes people safer",
    "reduces loss most",
    "prevents most other falls",
    "worth its cost",
)
UNRESOLVED, UNPRICED, UNVALUED, SMALL, UNSTATED, FEW_UNSTATED, INDICATIVE, OUTSIDE, ANCHORED = (
    "not resolved",
    "anchoring cost not given",
    "value not given",
    "small effect",
    "little money saved; danger to people not stated",
    "few falls prevented; danger to people not stated",
    "indicative only",
    "outside the model",
    "anchored",
)
ORDER = (
    *(DUTY, WEAK, FIRST, REDUCES, SAFER, SAVES, PREVENTS, WORTH),
    *(UNRESOLVED, UNPRICED, UNVALUED, SMALL, UNSTATED, FEW_UNSTATED, INDICATIVE, OUTSIDE, ANCHORED),
)
"""Every recommendation, in the order of the table."""
LITTLE = (SMALL, UNSTATED, FEW_UNSTATED)
"""Recommendations for pieces whose anchoring saves less than it costs, or little."""
HELD = (ANCHORED, WEAK)
"""Recommendations for pieces that are anchored; those without a kit do not fall in any run."""
BY_MONEY = (WORTH, UNRESOLVED, UNPRICED, UNVALUED, *LITTLE)
"""Recommendations that do not concern danger."""

HELPS, TOO_LITTLE, NOTHING, WORSE, NOT_KNOWN = (
    "prevents falls",
    "prevents too little",
    "nothing measurable",
    "causes more falls",
    "not known",
)
"""Effects of a kit on a piece."""


class Range(NamedTuple):
    """A value with the ends of its interval, NaN if there is none."""

    value: float
    lower: float
    upper: float

    def times(self, factor: float) -> "Range":
        """Return all three multiplied."""
        return Range(*(value * factor for value in self))


UNKNOWN = Range(math.nan, math.nan, math.nan)


class KitEffect(NamedTuple):
    """Effect of a kit on the pieces of a line.

    `cost`: of the kits of all pieces. `saved`: falls of one piece that it prevents, per year or at the level. `share`:
    of all falls of the piece. `saving`: money per year of all pieces, NaN if it is not known.
    """

    kit: str
    cost: float
    saved: Range
    share: Range
    saving: Range

    @property
    def effect(self) -> str:
        """Effect as far as the motions show it: by the intervals of the prevented falls, and their share."""
        if math.isnan(self.saved.lower) or math.isnan(self.saved.upper):
            return NOT_KNOWN
        if self.saved.lower > 0.0:
            return TOO_LITTLE if self.share.upper < HALF else HELPS
        return WORSE if self.saved.upper < 0.0 else NOTHING


class Piece(NamedTuple):
    """One line of an inventory under one law.

    `chance`: annual rate of falling of a piece (1/year), or its probability at the study's level without a hazard.
    `levels`: intensities (SI) at which it falls with the probabilities `SHARES`; 0 below all levels, inf above.
    `saving`: money per year by anchoring the line. `payback`: years, with the discount rate, infinite if the saving
    never pays the cost. NaN if something is not known, or is no basis for advice. `code`: demands of the study's
    building code on it, None without one. `chosen`: True if it is among the lines to anchor for the study's budget,
    None without one. `downtime`: expected days per year for which one piece is out of use. `injuries`: expected number
    of persons per year whom the line injures. `kit`: the kit that holds it and can break, '' for none. `carried`: value
    of pieces on the pieces of the line, which is lost if these fall. It is part of the saving, except for pieces that
    fall by themselves in the same motions. `tried`: effects of the kits that were tried on it. `doubt`: reason why its
    probability of falling is no basis for advice (`OUTSIDE`, `INDICATIVE`), '' if it is one.
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
    discount: float = DISCOUNT
    tried: tuple[KitEffect, ...] = ()
    doubt: str = ""

    @property
    def held(self) -> bool:
        """True if it is permanently anchored, so that it does not fall in any run; a kit can break."""
        return self.recommendation in HELD and not self.kit

    @property
    def judged(self) -> bool:
        """True if its probability of falling is a basis for advice."""
        return not self.doubt

    @property
    def stated(self) -> bool:
        """True if the inventory states the meaning of its fall for people."""
        return bool(self.consequences)

    @property
    def cost_of_all(self) -> float:
        """Cost of anchoring all pieces of the line."""
        return self.number * self.cost

    @property
    def worth(self) -> float:
        """Present value of the saving of `YEARS`, beyond the cost; NaN if either is not known."""
        return present_value(self.discount, YEARS) * self.saving.value - self.cost_of_all

    @property
    def meant(self) -> KitEffect | None:
        """The kit for a piece: of most (sure) worth, or the cheapest that prevents as many falls as the best."""
        good = [kit for kit in self.tried if kit.effect == HELPS]
        if not good:
            return None
        factor = present_value(self.discount, YEARS)
        priced = [kit for kit in good if math.isfinite(factor * kit.saving.value - kit.cost)]
        if not self.safety and self.recommendation != DUTY and priced:
            sure = [kit for kit in priced if factor * kit.saving.lower >= kit.cost]
            return max(sure or priced, key=lambda kit: factor * kit.saving.value - kit.cost)
        most = max(good, key=lambda kit: kit.share.value)
        like = [kit for kit in good if kit.share.upper >= most.share.value]
        return min(like, key=lambda kit: kit.cost if math.isfinite(kit.cost) else math.inf)


def settled(anchored: bool, held: bool, code: CodeCheck | None) -> str:
    """Return the recommendation that is settled before any risk is looked at, '' if there is none."""
    if (anchored or held) and code is not None and code.ratio > 1.0:
        return WEAK
    if anchored or held:
        return ANCHORED if anchored else ""
    return DUTY if code is not None and code.status == REQUIRED else ""


def recommended(pieces: Sequence[Piece]) -> list[Piece]:
    """Return the pieces with their recommendations, and with the paybacks that go with these."""
    free = [piece for piece in pieces if not piece.recommendation and piece.judged and piece.chance.value > 0.0]
    safety = _most([piece for piece in free if piece.safety], harm_of(pieces))
    others = [piece for piece in free if not piece.safety]
    known = any(map(_options, others))
    valued = any(other.value > 0.0 or other.carried > 0.0 for other in others)
    # money is never called the largest risk if a piece can injure people
    first = (SAVES if valued else PREVENTS) if any(piece.safety and not piece.held for piece in pieces) else REDUCES
    most = _most(
        others,
        lambda piece: piece.chance.value * ((piece.number * piece.value + piece.carried) if valued else piece.number),
    )

    def words(piece: Piece) -> str:
        if piece.doubt:
            return piece.doubt
        if piece.chance.value == 0.0:
            return UNRESOLVED
        if piece.safety:
            return REDUCES if piece.item in safety else SAFER
        if known:
            if math.isnan(piece.saving.value):
                return UNVALUED
            options = _options(piece)
            if not options:
                return UNPRICED
            factor = present_value(piece.discount, YEARS)
            if any(saving.lower > 0.0 and factor * saving.lower >= cost for cost, saving in options):
                return WORTH
            if all(factor * saving.upper < cost for cost, saving in options):
                return SMALL if piece.stated else UNSTATED
            return UNRESOLVED
        if piece.item in most:
            return first
        return SMALL if piece.stated else UNSTATED if valued else FEW_UNSTATED

    return [_paid(piece if piece.recommendation else piece._replace(recommendation=words(piece))) for piece in pieces]


def carriers(pieces: Sequence[Piece], moving: set[str]) -> list[Piece]:
    """Return the pieces with another word for pieces that must be fixed first because other pieces are on them."""
    return [
        piece._replace(recommendation=FIRST, saving=UNKNOWN, payback=math.nan)
        if piece.item in moving and (piece.recommendation in BY_MONEY or piece.recommendation == piece.doubt)
        else piece
        for piece in pieces
    ]


def harm_of(pieces: Sequence[Piece]) -> Callable[[Piece], float]:
    """Return the contribution of a piece to the danger to people: expected injuries if known of all, else falls."""
    of = [piece for piece in pieces if piece.safety and piece.judged and not piece.held and piece.chance.value > 0.0]
    if of and all(piece.injuries.value > 0.0 for piece in of):
        return lambda piece: piece.injuries.value if piece.injuries.value > 0.0 else 0.0
    return lambda piece: piece.number * piece.chance.value


def _most(pieces: Sequence[Piece], contribution: Callable[[Piece], float]) -> set[str]:
    """Return the names of the pieces that contribute most, and together `MOST` of all."""
    whole = sum(map(contribution, pieces))
    names, part = set(), 0.0
    for piece in sorted(pieces, key=contribution, reverse=True):
        if part >= MOST * whole:
            break
        names.add(piece.item)
        part += contribution(piece)
    return names


def _options(piece: Piece) -> list[tuple[float, Range]]:
    """Return the costs and savings that are known of a piece: of its own anchors, else of the kits that were tried."""
    anchors = [(piece.cost_of_all, piece.saving)]
    tried = [(kit.cost, kit.saving) for kit in piece.tried]
    return [
        (cost, saving)
        for cost, saving in (anchors if math.isfinite(piece.cost) else tried)
        if math.isfinite(cost) and math.isfinite(saving.value)
    ]


def _paid(piece: Piece) -> Piece:
    """Return a piece with its payback: of its own anchors, or if these have no cost of the kit that is meant."""
    if not piece.judged:
        return piece._replace(saving=UNKNOWN, payback=math.nan)
    if piece.recommendation == ANCHORED or not piece.chance.value > 0.0:
        return piece
    kit = None if math.isfinite(piece.cost) else piece.meant
    cost, saving = (piece.cost_of_all, piece.saving) if kit is None else (kit.cost, kit.saving)
    return piece._replace(payback=payback(cost, saving.value, piece.discount))
