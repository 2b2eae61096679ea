"""Tables of kits: what falls with each kit and what that saves, and the static checks of their forces by hand."""

from __future__ import annotations

import math
from itertools import product
from typing import NamedTuple

import xarray as xr

from ...core.units import STANDARD_GRAVITY
from ...core.wording import currency_of, given_number, given_percent
from ..buildings.pieces import pieces_of
from ..buildings.recommendations import NOT_KNOWN, NOTHING, UNKNOWN, YEARS, Piece, Range
from ..buildings.variables import RUPTURE
from ..money.present_value import payback
from ..text.words import floor_cell, floor_name, level_text, reference_law
from .breaks import breaks_by_level
from .pieces import bounded, in_years
from .table import ENDS, Column, Row, Table, intervals
from .unseen import bound_of, most_probability

MOST_ROWS, MOST_SHORT = 60, 8
"""Most rows of a table, and on a terminal by default."""
AS_IT_IS = "as it is"
SETS = ("budget", "target")
EXPORTED = (
    *(Column(key) for key in ("item", "floor", "pieces", "kit", "damping_law")),
    *(Column(key, unit="rate", ends=ENDS) for key in ("falls", "front_falls", "falls_saved", "front_falls_saved")),
    Column("share_saved", unit="1", ends=ENDS),
    *(Column("effect"), Column("breaks", unit="rate", ends=ENDS), Column("saving_of_all", unit="saving")),
    *(Column(key, unit="money") for key in ("cost", "cost_of_all")),
    *(Column("payback", unit="years"), Column("for_budget"), Column("for_target")),
    *(Column(key, unit="N") for key in ("required_force", "half_weight", "strength")),
    Column("static_capacity", unit="m s-2"),
)
"""Columns of the table in a file; units that depend on the results are replaced."""


class KitRow(NamedTuple):
    """A line of an inventory with one kit, or as it is (kit ''): annual rates, or probabilities at the level.

    saving: mean loss that all pieces save in a year, or at the level.  cost: of one piece.  chosen: for the budget and
    for the target, None without one.  force, half, strength: N; capacity: m/s².  breaks: how often the kit breaks, NaN
    without one; at_design: the share of the motions of the static check in which it breaks.
    """

    piece: Piece
    kit: str
    falls: Range
    front: Range
    saved: Range
    front_saved: Range
    share: Range
    saving: float
    cost: float
    chosen: tuple[bool | None, bool | None]
    force: float
    half: float
    strength: float
    capacity: float
    breaks: Range
    at_design: Range = UNKNOWN

    @property
    def effect(self) -> str:
        """What the kit does for the piece, as far as the motions show it; '' of the piece as it is."""
        every = {one.kit: one.effect for one in self.piece.tried}
        return every.get(self.kit, "")

    @property
    def payback(self) -> float:
        """Years after which the discounted saving has paid the cost: infinite if never, NaN where not known."""
        if not self.kit or self.effect in (NOTHING, NOT_KNOWN) or not self.piece.judged:
            return math.nan
        return payback(self.piece.number * self.cost, self.saving, self.piece.discount)


def kit_lines(results: xr.Dataset, model: int = 0) -> list[KitRow]:
    """Return every piece that is not anchored for good as it is and with each kit that fits it, in their order."""
    here = results.isel(model=model)
    strengths = {str(name): one for name, one in zip(here["kit"].values, here["kit_strength"].values, strict=True)}
    yearly = "item_rate" in here
    given = here if yearly else here.sel(level=float(results.attrs["at_level"]))
    now = {"falls": "item_rate", "front": "item_front_rate"}
    now = now if yearly else {"falls": "probability", "front": "front_probability"}
    breaking = f"item_{RUPTURE.name}_rate" if yearly else f"{RUPTURE.name}_probability"
    found = []
    for piece in pieces_of(results, model):
        if piece.held:
            continue
        one = here.sel(item=piece.item)
        half = float(one["kit_half_weight"])
        falls, front = (_range(given.sel(item=piece.item), name) for name in now.values())
        no, chosen, unknown = Range(0.0, 0.0, 0.0), _chosen(one, ""), math.nan
        breaks = _range(given.sel(item=piece.item), breaking)
        static = unknown, half, unknown, unknown
        found.append(KitRow(piece, "", falls, front, no, no, no, 0.0, 0.0, chosen, *static, breaks))
        for name in here["kit"].values[one["kit_fits"].values.astype(bool)]:
            with_it = one.sel(kit=name)
            found.append(
                KitRow(
                    piece,
                    str(name),
                    _range(with_it, "kit_falls"),
                    _range(with_it, "kit_front_falls"),
                    _range(with_it, "kit_falls_saved"),
                    _range(with_it, "kit_front_falls_saved"),
                    _range(with_it, "kit_share_saved"),
                    float(with_it["kit_saving"]) if "kit_saving" in with_it else math.nan,
                    float(with_it["kit_cost"]),
                    _chosen(one, str(name)),
                    float(with_it["kit_required_force"]),
                    half,
                    float(strengths[str(name)]),
                    float(with_it["kit_static_capacity"]),
                    _range(with_it, "kit_breaks"),
                    _range(with_it, "kit_breaks_at_design" if yearly else "kit_breaks"),
                )
            )
    return found


def kits(results: xr.Dataset, model: int = 0, number: int = MOST_ROWS) -> Table:
    """Return the falls with each kit and its savings, the kits of each piece together."""
    yearly, money, bound = "item_rate" in results, currency_of(results), bound_of(results)
    sets = [name for name in SETS if f"{name}_kit" in results]
    rows: list[Row | str] = []
    lines = kit_lines(results, model)
    for line in lines:
        piece, first = line.piece, not line.kit
        if first:
            many = "" if piece.number == 1 else f", {piece.number:,} pieces"
            rows.append(f"{piece.item} ({floor_name(piece.floor)}{many})")
        cost = piece.number * line.cost
        row: Row = {
            "kit": line.kit or (f"{AS_IT_IS} ({piece.kit})" if piece.kit else AS_IT_IS),
            **{key: _chance(rate, yearly, bound) for key, rate in (("falls", line.falls), ("front", line.front))},
            "breaks": "" if math.isnan(line.breaks.value) else _chance(line.breaks, yearly, bound),
        }
        if not first:
            row |= {
                "share": line.share,
                "effect": line.effect,
                "cost": cost,
                "payback": line.payback if yearly else None,
            }
            row["saving"] = line.saving
        row |= {name: "yes" for name in sets if line.chosen[SETS.index(name)]}
        rows.append(row)
    valued = any(line.saving != 0.0 and math.isfinite(line.saving) for line in lines)
    priced = any(math.isfinite(line.cost) and line.kit for line in lines)
    when = f"in {YEARS:g} years" if yearly else "at the level"
    columns = [
        *(Column("kit", "kit"), Column("falls", f"falls {when}, each", "chance")),
        *(
            Column("front", "into the room", "chance"),
            Column("share", "falls saved", "share"),
            Column("effect", "effect"),
        ),
        Column("breaks", f"kit breaks {when}", "chance"),
        *([Column("saving", f"all save {'per year' if yearly else 'then'}", "two", money)] if valued else []),
        *([Column("cost", "all cost", "given", money)] if priced else []),
        *([Column("payback", "pays back", "payback", "years", priority=2)] if valued and priced else []),
        *(Column(name, f"for the {name}") for name in sets),
    ]
    rates = {line.piece.discount for line in lines if not math.isnan(line.payback)} if valued else set()
    paid = f"Paybacks are at a discount rate of {given_percent(*rates)}." if rates else ""
    notes = intervals(results), "Chances are of one piece, costs of all pieces of a line.", paid
    return Table.of("Kits", columns, rows, *notes, *_sets(results.isel(model=model), sets, money), most=number)


def short_kits(results: xr.Dataset, number: int = MOST_SHORT) -> Table:
    """Return the table of kits for a narrow terminal."""
    table = kits(results, reference_law(results)[0], number)
    return table.only("kit", "falls", "front", "share", "effect", "cost", "breaks", *SETS)


def static_checks(results: xr.Dataset) -> Table:
    """Return the static checks of the kits by hand."""
    rows: list[Row] = []
    bound = most_probability(results)
    for line in kit_lines(results):
        if line.kit:
            peak = float(results["kit_peak_acceleration"].sel(item=line.piece.item)) / STANDARD_GRAVITY
            rows.append({
                **{"item": line.piece.item, "floor": floor_cell(line.piece.floor), "peak": peak, "kit": line.kit},
                **{"strength": line.strength, "force": line.force if line.force != 0.0 else "no uplift"},
                **{"half": line.half, "capacity": line.capacity / STANDARD_GRAVITY},
                "breaks": None if math.isnan(line.at_design.value) else _chance(line.at_design, False, bound),
            })  # fmt: skip
    columns = (
        *(Column("item", "piece"), Column("floor", "floor"), Column("peak", "peak of its floor", "two", "g")),
        *(
            Column("kit", "kit"),
            Column("strength", "strength", "two", "N"),
            Column("force", "static force", "two", "N"),
        ),
        *(Column("half", "half of the weight", "two", "N"), Column("capacity", "tips statically at", "two", "g")),
        Column("breaks", "breaks in the runs", "chance"),
    )
    at = "10 % in 50 years"
    outside = "item_rate" in results and math.isnan(results["kit_peak_acceleration"].values.min())
    if "item_rate" not in results:
        at = level_text(float(results.attrs["at_level"]), results["level"])
    notes = f"The shaking is {at}.", OUTSIDE if outside else "", RIGID, _nodes(results)
    return Table.of("Static checks by hand, of one piece", columns, rows, *notes, most=MOST_ROWS)


OUTSIDE = "That shaking is outside the levels that were run."
RIGID = (
    "A static check assumes a rigid kit and leaves out slack, stiffness and duration. The last column is the share of "
    "the motions in which the kit breaks, which may be higher or lower."
)
NODES = "A higher floor can have a smaller peak than a lower floor, because higher modes move it less."


def _nodes(results: xr.Dataset) -> str:
    """Return the sentence on a higher floor that has a smaller peak than a lower floor; '' if none has."""
    floors = results["floor"].values
    peaks = results["kit_peak_acceleration"].values
    known = [(int(floor), peak) for floor, peak in zip(floors, peaks, strict=True) if str(floor).isdecimal()]
    return NODES if any(low < high and peak > above for low, peak in known for high, above in known) else ""


def kit_breaks(results: xr.Dataset) -> Table:
    """Return the shares of the motions in which kits break at each level, of the first kits on pieces."""
    here = results.isel(model=reference_law(results)[0])
    found: dict[str, list[xr.DataArray]] = {}
    if f"{RUPTURE.name}_probability" in here:
        names = [f"{RUPTURE.name}_probability{end}" for end in ENDS]
        for item, kit in zip(here["item"].values, here["anchored_with"].values, strict=True):
            if kit:
                found[f"{item}: {kit}"] = [here[name].sel(item=item) for name in names]
    if "kit_broken_probability" in here:
        for item, kit in product(here["item"].values, here["kit"].values):
            if bool(here["kit_fits"].sel(item=item, kit=kit)):
                at = {"item": item, "kit": kit}
                found[f"{item}: {kit}"] = [here[f"kit_broken_probability{end}"].sel(at) for end in ENDS]
    return breaks_by_level(found, here["level"], "kits", intervals(results))


def exported_kits(results: xr.Dataset, model: int = 0) -> Table:
    """Return all pieces with all kits as values, for a spreadsheet."""
    yearly, money = "item_rate" in results, currency_of(results)
    units = {
        "rate": "1/year" if yearly else "1",
        "saving": f"{money}/year" if money and yearly else money,
        "money": money,
    }
    left = [f"for_{name}" for name in SETS if f"{name}_kit" not in results] + ([] if yearly else ["payback"])
    rows: list[Row] = [
        {
            "item": line.piece.item,
            "floor": int(line.piece.floor) if line.piece.floor.isdecimal() else line.piece.floor,
            "pieces": line.piece.number,
            "kit": line.kit or line.piece.kit,
            "damping_law": str(results["model"].values[model]),
            **{"falls": line.falls, "front_falls": line.front, "falls_saved": line.saved},
            **{"front_falls_saved": line.front_saved, "share_saved": line.share, "breaks": line.breaks},
            **{"effect": line.effect, "saving_of_all": line.saving, "payback": line.payback},
            **{"cost": line.cost, "cost_of_all": line.piece.number * line.cost},
            **{f"for_{name}": "yes" if yes else "no" for name, yes in zip(SETS, line.chosen, strict=True)},
            **{"required_force": line.force, "half_weight": line.half, "strength": line.strength},
            "static_capacity": line.capacity,
        }
        for line in kit_lines(results, model)
    ]
    columns = [
        column._replace(unit=units.get(column.unit, column.unit)) for column in EXPORTED if column.key not in left
    ]
    return Table("Kits", columns, rows)


def _sets(here: xr.Dataset, sets: list[str], money: str) -> list[str]:
    """Return sentences on the costs of the sets of kits, and on a target that none of them meets."""
    found = []
    for name in sets:
        if name == "target" and not bool(here["target_met"]):
            found.append("No set of these kits meets the target.")
        else:
            cost = f"{given_number(float(here[f'{name}_cost']))} {money}".rstrip()
            found.append(f"The set for the {name} costs {cost}.")
    return found


def _range(one: xr.Dataset, name: str) -> Range:
    """Return a value with the ends of its interval, unknown where results do not hold it."""
    return Range(*(float(one[f"{name}{end}"]) for end in ENDS)) if name in one else UNKNOWN


def _chosen(one: xr.Dataset, kit: str) -> tuple[bool | None, bool | None]:
    """Return whether a kit ('' for none) is the one of a piece in the sets for the budget and for the target."""
    found = [str(one[f"{name}_kit"].item()) == kit if f"{name}_kit" in one else None for name in SETS]
    if "target_met" in one and not bool(one["target_met"]):
        found[1] = False
    return found[0], found[1]


def _chance(rate: Range, yearly: bool, bound: float) -> Range:
    """Return a chance with its interval; of what no motion showed 0 with the upper end of its interval."""
    return bounded(in_years(rate, YEARS) if yearly else rate, bound)
