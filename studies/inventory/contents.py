"""The contents of a building: kinds of pieces on floors, with the consequences of their overturning."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
import xarray as xr

from ...core import checks
from ...core.doubts import Doubt, first_of, noted
from ...core.parameters import PART, Parameter, check
from ...models import Block
from ...models.friction import CONTACTS, LOCKED, ROLLING, Friction
from ...models.laws import Restitution
from ...models.plausibility import LEAST_STRENGTH, MOST_STRENGTH, block_doubts, restitution_doubts
from ...models.sliding.trip import TRIP
from ...motions.arrays import Record, from_array
from ...motions.floors.histories import DIRECTIONS
from ...motions.floors.strength import Importance
from ...motions.supports.isolator import Isolator
from ...motions.supports.support import Support
from ..codes.check import CLASSES
from ..file.table import AMOUNT, MAX_TEXT, MAX_VALUE, shown
from .consequences import Consequence, Injury


@dataclass(frozen=True)
class Stand:
    """A bench or an isolated platform, which responds to the motion of its floor alone and moves the pieces on it."""

    name: str
    support: Support | Isolator

    @property
    def scales(self) -> bool:
        """True if twice the motion of the floor gives twice the motion on top."""
        return isinstance(self.support, Support)

    def carry(self, below: Sequence[Record]) -> list[Record]:
        """Return the motions on top of it under motions of its floor, in their order."""
        return self._moved(below)[0]

    def strikes(self, below: Sequence[Record]) -> list[Doubt]:
        """Return the input warning on its clearance under motions of its floor; an elastic one has no clearance."""
        if not isinstance(self.support, Isolator):
            return []
        return self.support.stops.doubts(self._moved(below)[1])

    def _moved(self, below: Sequence[Record]) -> tuple[list[Record], list[xr.DataArray]]:
        """Return the motions on top, in the order of those below, and as arrays of motions of one length."""
        carried = list(below)
        tops = []
        alike: dict[tuple[float, int], list[int]] = {}
        for i, record in enumerate(below):
            alike.setdefault((record.dt, record.acceleration.size), []).append(i)
        for (dt, _), lines in alike.items():
            array = from_array(np.stack([below[i].acceleration for i in lines]), dt)
            with noted():  # the motions of floors were checked, and strikes are reported by name
                top = self.support.motions(array)
            step = float(top["dt"].values[0])
            tops.append(top)
            for k, i in enumerate(lines):
                source = f"{self.support!r} on {below[i].source}"
                carried[i] = below[i]._replace(acceleration=top.values[k], dt=step, source=source)
        return carried, tops


MAX_ROWS = 10_000
MAX_COUNT = 1_000_000
Amount = Annotated[float, AMOUNT]
MOST_PERSONS = 50.0
MOST_INJURED = 1.0
"""Mean number of persons injured by a fall of one piece."""
LONGEST_DOWNTIME = 5.0 * 365.25
"""Days: buildings themselves are replaced in 1 to 3 years (FEMA P-58-1, recalled)."""
DEAREST, MOST_SCATTER = 100.0, 1.5
"""Cost of anchoring a piece over its value, and the dispersion of a consequence: its mean is then 3 medians."""
MAX_CONSEQUENCES = 40
MOST_FLOORS = 12  # that a message lists
HARMLESS = "none"
"""The word, instead of consequences, that states that a fall harms no person."""
NOTHING = re.compile(
    r"no|[-–0]|n[./]a\.?|nil|nothing|harmless|nein|keine?|nichts|aucune?|non|rien|ningun[oa]|nada|nessun[oa]|niente|geen|"
    r"nenhuma?|yok|нет|なし|无"
)
"""Other words for that, which would be consequences of their own."""
UNKNOWN = re.compile(
    r"t\.?b\.?[cd]\.?|n|na|nan|null|<na>|\d+|low|medium|high|(?:see|siehe|voir|vedi) .*"
    r"|\?+|\.+|…|x|yes|y|true|ja|oui|s[iíì]"
    r"|evet|да|はい|(?:is )?(?:unknown|not known|unclear)|un(?:bekannt|klar)|offen"
    r"|inconnue?|sconosciut[oa]|desconocid[oa]"
    r"|bilinmiyor|неизвестно|不明|未定"
)
"""Words that give no effect of a fall."""
RESERVED = ("number", "loss", "any")
"""Words that cannot be consequences, because results use them for everything that falls."""


def floor_text(known: Sequence[str], floor: object) -> str:
    """Return the reason why an unknown floor cannot be used, and the remedy."""
    listed = ", ".join(known if len(known) <= MOST_FLOORS else [*known[:5], "…", known[-1]])
    hint = "; give a building, or floor motions" if list(known) == ["0"] else ""
    if str(floor) == "0":
        hint = "; add the histories of the ground, which is floor 0"
    return f"must be one of {listed}, got {shown(floor)}{hint}"


@dataclass(frozen=True)
class Contents:
    """Pieces of one kind on one floor.

    Parameters
    ----------
    label : str
        Name in results.
    block : Block
        The mechanical model of each piece, with its mass (kg) if known, and its surroundings or restraint.
    floor : int or str
        The floor of the pieces, by its name in the building (or the file of floor motions): 0 is the ground.
    count : int
        Number of pieces.
    e : float, optional
        Restitution; by default the damping law's.
    value : float
        The loss when a piece overturns, without spread, in the inventory's currency.
    consequences : tuple of str
        The consequences when at least one piece overturns, such as ``blocks-exit``. The single word ``none`` excludes
        consequences, which an empty tuple does not.
    anchored : bool
        True if the pieces are fixed already, so that they do not overturn.
    kit : str
        The name of the restraint that holds them already and can break, which is the block's; '' for none.
    anchoring_cost : float, optional
        Cost of fixing a piece, in the inventory's currency.
    room : str
        The room of the pieces, for tables.
    direction : str
        The direction of the building, x or y, in which its width lies; of use with floor histories in two directions
        and with pairs of components.
    along_depth : bool
        True if it is run about its depth, too, under the other component (`studies.buildings.axes` decides).
    code_class : str
        Class of the pieces in a building code (`toppling.studies.codes.check.CLASSES`), '' if it is not known.
    code_importance : float, optional
        Its importance factor; by default the study's code has one.
    anchor_strength : float, optional
        Design strength of a piece's anchors against a horizontal force, N.
    anchor_height : float, optional
        Height of these anchors above the floor, m.
    cost : Consequence, optional
        Cost of repairing or replacing a piece that overturned, in the inventory's currency, instead of `value`.
    downtime : Consequence, optional
        Days for which a piece that overturned is out of use.
    piece_class : str
        Its class, whose pieces have their modelling uncertainty in common; '' for all pieces of the same sizes.
    contact : str
        Contact of the pieces with their floor: a name of `toppling.models.friction.CONTACTS`, ``castors`` (whose
        rolling is not modelled) or ``castors locked``; '' if it is not known.
    friction : Friction, optional
        Static coefficient of friction between a piece and its floor; needed by blocks near an edge.
    kinetic_ratio : float
        Kinetic over static friction, above 0, at most 1.
    trip : float, optional
        Clear distance from the foot to an obstacle on either side (a joint, a cable, the edge of a carpet), m; needs a
        friction.
    stands_on : str
        The label of the line whose piece is below, such as a pedestal on the same floor; '' for the floor itself.
    stand : Stand, optional
        The bench or the isolated platform between the floor and it.
    injury : Injury, optional
        The persons whom a piece injures; if their mean is above 0, ``injury`` is added to its consequences.

    Raises
    ------
    TypeError, ValueError
        A value out of range, both a value and a cost.
    """

    label: str
    block: Block
    floor: int | str
    count: Annotated[int, Parameter(at_least=1, at_most=MAX_COUNT)] = 1
    e: Restitution | None = None
    value: Amount = 0.0
    consequences: tuple[str, ...] = ()
    anchored: bool = False
    anchoring_cost: Amount | None = None
    room: Annotated[str, Parameter()] = ""
    code_class: Annotated[str, Parameter(words=("", *CLASSES))] = ""
    code_importance: Importance | None = None
    anchor_strength: Annotated[float, Parameter("N", above=0.0, at_most=MAX_VALUE)] | None = None
    anchor_height: Annotated[float, Parameter("m", above=0.0, at_most=MAX_VALUE)] | None = None
    cost: Consequence | None = None
    downtime: Consequence | None = None
    injury: Injury | None = None
    piece_class: str = ""
    direction: Annotated[str, Parameter(words=("", *DIRECTIONS))] = ""
    kit: str = ""
    along_depth: bool = False
    contact: str = ""
    friction: Friction | None = None
    kinetic_ratio: float = 1.0
    stands_on: Annotated[str, Parameter()] = ""
    trip: Annotated[float, TRIP] | None = None
    stand: Stand | None = None

    def __post_init__(self) -> None:
        _text("label", self.label)
        for name in ("room", "piece_class", "kit"):
            if getattr(self, name):
                _text(name, getattr(self, name))
        if not isinstance(self.block, Block):
            raise TypeError(f"block must be a toppling Block, got {checks.kind(self.block)}")
        if self.anchored and self.block.restraint is not None:
            raise ValueError(f"anchored must be False with a restraint, which can break, got both for {self.label!r}")
        if self.kit and self.block.restraint is None:
            raise ValueError(f"kit {self.kit!r} must be the restraint of the block of {self.label!r}, which has none")
        if isinstance(self.floor, str):
            _text("floor", self.floor)
        else:
            object.__setattr__(self, "floor", checks.count("floor", self.floor))
        check(self)
        words: Any = self.consequences
        if isinstance(words, str):
            raise TypeError(f"consequences must be a sequence of words, got the string {shown(words)}")
        for word in self.consequences:
            _text("consequence", word)
            if NOTHING.fullmatch(word):
                raise ValueError(f"consequence must be {HARMLESS!r} where nobody can be harmed, got {word!r}")
            if UNKNOWN.fullmatch(word):
                raise ValueError(f"consequence must be the effect of a fall, or empty if it is not known, got {word!r}")
            if word in RESERVED:
                raise ValueError(f"consequence must not be one of {', '.join(RESERVED)}, got {word!r}")
        self._check_distributions()
        self._check_friction()
        if HARMLESS in self.consequences and (len(self.consequences) > 1 or self.injury is not None):
            raise ValueError(
                f"consequence must be {HARMLESS!r} alone, without other consequences and persons exposed, got "
                f"{', '.join(map(repr, self.consequences))}"
            )
        injures = ("injury",) if self.injury is not None and self.injury.mean > 0.0 else ()
        object.__setattr__(self, "consequences", tuple(dict.fromkeys((*self.consequences, *injures))))

    def _check_distributions(self) -> None:
        for name, kind in (("cost", Consequence), ("downtime", Consequence), ("injury", Injury)):
            given = getattr(self, name)
            if given is not None and not isinstance(given, kind):
                raise TypeError(f"{name} must be of {kind.__name__} or None, got {checks.kind(given)}")
        if self.cost is not None and self.value > 0.0:
            raise ValueError(f"cost takes the place of value, which must not be given beside it, got {self.value:g}")

    def _check_friction(self) -> None:
        if self.contact not in ("", ROLLING, LOCKED, *CONTACTS):
            raise ValueError(f"contact must be one of {', '.join((*CONTACTS, ROLLING, LOCKED))}, got {self.contact!r}")
        if self.friction is not None and not isinstance(self.friction, Friction):
            raise TypeError(f"friction must be a Friction or None, got {checks.kind(self.friction)}")
        PART.number("kinetic_ratio", self.kinetic_ratio)
        if self.rolls and self.friction is not None:
            raise ValueError(f"friction must be None on castors, which roll, got one for {self.label!r}")
        if self.anchored or self.friction is not None:
            return
        why = "it rolls, which is not modelled" if self.rolls else "its friction is not given"
        if self.block.edge is not None:
            raise ValueError(f"the edge of {self.label!r} needs to know how far it slides, and {why}")
        if self.trip is not None:
            raise ValueError(f"the obstacle near {self.label!r} needs to know how fast it slides, and {why}")

    @property
    def rolls(self) -> bool:
        """True if it is on castors that are not locked."""
        return self.contact == ROLLING

    @property
    def obstacle(self) -> float | None:
        """Clear distance to an obstacle that it may slide into, m; None if there is none, or it is anchored."""
        return None if self.anchored else self.trip

    @property
    def both_axes(self) -> bool:
        """True if it is run about its width and its depth, about which nothing holds it; not on a soft bed."""
        return self.along_depth and self.block.bed is None

    @property
    def loss(self) -> float:
        """Mean loss when a piece overturns: its value, or the mean of its cost."""
        return float(self.value) if self.cost is None else self.cost.mean

    @property
    def class_label(self) -> str:
        """Its class: the one that is given, or its sizes."""
        block = self.block
        sizes = (block.width, block.height, block.cm_height, block.inertia_factor)
        return self.piece_class or " x ".join("-" if size is None else f"{size:.9g}" for size in sizes)

    @property
    def drawn(self) -> bool:
        """True if any consequence of a piece is drawn."""
        return any(drawn is not None for drawn in (self.cost, self.downtime, self.injury))


@dataclass(frozen=True)
class Inventory:
    """All contents of a building, and the currency of their values ('' if it is not stated).

    Raises
    ------
    TypeError, ValueError
        No rows, invalid rows, a label used twice, more than a million pieces or 40 different consequences.

    Examples
    --------
    >>> import toppling as tp
    >>> shelf = Contents("shelf", tp.catalogue["bookcase-5-shelf"], floor=2, count=3, value=400.0)
    >>> inventory = Inventory((shelf,), "EUR")
    >>> inventory.pieces, inventory.value
    (3, 1200.0)
    """

    rows: tuple[Contents, ...]
    currency: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "rows", tuple(self.rows))
        if not self.rows:
            raise ValueError("an inventory must have at least one row, got none")
        if len(self.rows) > MAX_ROWS:
            raise ValueError(f"an inventory must have at most {MAX_ROWS} rows, got {len(self.rows)}")
        for row in self.rows:
            if not isinstance(row, Contents):
                raise TypeError(f"rows must be Contents, got {checks.kind(row)}")
        labels = [row.label for row in self.rows]
        if len(set(labels)) < len(labels):
            twice = next(label for label in labels if labels.count(label) > 1)
            raise ValueError(f"rows must have unique labels, got {twice!r} more than once")
        if self.currency:
            _text("currency", self.currency)
        if self.pieces > MAX_COUNT:
            raise ValueError(f"an inventory must have at most {MAX_COUNT} pieces, got {self.pieces}")
        if len(self.consequences) > MAX_CONSEQUENCES:
            raise ValueError(
                f"an inventory must have at most {MAX_CONSEQUENCES} different consequences, got "
                f"{len(self.consequences)}"
            )

    def check_supports(self) -> None:
        """Raise a ValueError if pieces are on a missing line, or may move in a way that is not known."""
        by_label = {row.label: row for row in self.rows}
        for row in self.rows:
            if not row.stands_on:
                continue
            below = by_label.get(row.stands_on)
            what = f"what {row.label!r} stands on"
            if below is None or below is row:
                raise ValueError(f"{what} must be another line of the inventory, got {row.stands_on!r}")
            if below.stands_on:
                raise ValueError(f"{what} must stand on the floor, got {below.label!r}, which stands on a piece itself")
            if (below.floor, below.direction, below.stand) != (row.floor, row.direction, row.stand):
                raise ValueError(
                    f"{what} must be on its own floor (and support) and in its direction, got {below.label!r}"
                )
            if not below.anchored and (below.friction is None or below.block.surrounded):
                raise ValueError(
                    f"{what} must be anchored, or stand free with a friction, so that it is known whether it rests, "
                    f"got {below.label!r}"
                )

    def __len__(self) -> int:
        return len(self.rows)

    @property
    def carried(self) -> dict[int, int]:
        """Positions of lines on another line, with the position of that line if it exists."""
        at = {row.label: i for i, row in enumerate(self.rows)}
        return {i: at[row.stands_on] for i, row in enumerate(self.rows) if row.stands_on in at}

    @property
    def pieces(self) -> int:
        """Number of pieces."""
        return sum(row.count for row in self.rows)

    @property
    def value(self) -> float:
        """Mean loss if all pieces overturned."""
        return math.fsum(row.count * row.loss for row in self.rows)

    @property
    def consequences(self) -> tuple[str, ...]:
        """All consequences, each once, in the order of the rows."""
        words = dict.fromkeys(word for row in self.rows for word in row.consequences)
        return tuple(word for word in words if word != HARMLESS)


def _text(name: str, value: Any) -> None:
    if not isinstance(value, str) or not value.strip() or len(value) > MAX_TEXT or not value.isprintable():
        raise ValueError(f"{name} must be 1 to {MAX_TEXT} printable characters, got {shown(value)}")


def row_doubts(rows: Sequence[Contents]) -> list[Doubt]:
    """Return the input warnings on the blocks of lines, on the consequences of falls, and on pieces on others."""
    injuries = [(row.label, row.injury) for row in rows if row.injury is not None]
    downtimes = [(row.label, row.downtime.median) for row in rows if row.downtime is not None]
    costs = [(row.label, row.anchoring_cost, row.loss) for row in rows if row.anchoring_cost and row.loss > 0.0]
    odd = {
        "row_persons": [f"{label}: {injury.persons:g}" for label, injury in injuries if injury.persons > MOST_PERSONS],
        "row_injuries": [f"{label}: {injury.mean:g}" for label, injury in injuries if injury.mean > MOST_INJURED],
        "row_downtime": [f"{label}: {days:,.0f} days" for label, days in downtimes if days > LONGEST_DOWNTIME],
        "row_cost": [f"{label}: {cost:,.12g} for {loss:,.12g}" for label, cost, loss in costs if cost > DEAREST * loss],
        "row_costs": [
            f"{label}: {cost:,.12g} for {loss:,.12g}" for label, cost, loss in costs if cost <= DEAREST * loss
        ]
        * (len(costs) > 1 and all(cost > loss for _, cost, loss in costs)),
        "row_dispersion": [
            f"{row.label}: {amount.dispersion:g}"
            for row in rows
            for amount in (row.cost, row.downtime)
            if amount is not None and amount.dispersion > MOST_SCATTER
        ],
        "row_anchors": [
            f"{row.label}: {row.anchor_strength:g} N"
            for row in rows
            if row.anchor_strength is not None and not LEAST_STRENGTH <= row.anchor_strength <= MOST_STRENGTH
        ],
        "row_crowded": _crowded(rows),
    }
    most = {"persons": MOST_PERSONS, "injured": MOST_INJURED, "cost": DEAREST, "dispersion": MOST_SCATTER}
    doubts = block_doubts([replace(row.block, name=row.label) for row in rows])
    doubts += restitution_doubts((row.label, row.e) for row in rows)
    return [*doubts, *(Doubt.of(what, named=first_of(named), **most) for what, named in odd.items() if named)]


def place_doubts(rows: Sequence[Contents], heights: Sequence[float]) -> list[Doubt]:
    """Return the input warnings on lines in a building with floors at some heights (m): floors from 1, tall pieces."""
    roof, floors = len(heights) - 1, {int(row.floor) for row in rows}
    doubts = []
    if roof in floors and len(floors) > 1 and min(floors) > 0:
        doubts.append(Doubt.of("floors_of_rows", lowest=min(floors), roof=roof))
    storeys = {floor: heights[floor + 1] - heights[floor] for floor in floors if floor < roof}
    tall = [
        f"{row.label}: {row.block.height:g} m in {storeys[int(row.floor)]:g} m"
        for row in rows
        if row.block.height > storeys.get(int(row.floor), math.inf)
    ]
    return [*doubts, *([Doubt.of("rows_high", named=first_of(tall))] if tall else [])]


def _crowded(rows: Sequence[Contents]) -> list[str]:
    """Return the lines that are wider than the piece below, or do not fit on it together."""
    crowded: list[str] = []
    loads: dict[str, list[Contents]] = {}
    for row in rows:
        loads.setdefault(row.stands_on, []).append(row)
    for support in rows:
        above = loads.get(support.label, [])
        wide = [row.label for row in above if row.block.width > support.block.width * (1.0 + 1e-9)]
        area = sum(map(_plan, above))
        if wide:
            crowded.append(f"{first_of(wide)} on {support.label}: wider")
        elif area > _plan(support) * (1.0 + 1e-9):
            crowded.append(f"on {support.label}: {area:.3g} m² on {_plan(support):.3g} m²")
    return crowded


def _plan(row: Contents) -> float:
    """Return the area in plan of the pieces of a line, m²."""
    return row.count * row.block.width * (row.block.depth or row.block.width)
