"""Tables of kits: what falls with each kit and what that saves, and the static checks of their forces by hand."""

from __future__ import annotations

import math
from itertools import product
from typing import NamedTuple

import xarray as xr

from ...core.units import STANDARD_GRAVITY
from ...core.wording import about_percent, confidence_text, currency_of, given_number, two_digits
from ..buildings.pieces import pieces_of
from ..buildings.recommendations import HELPS, NOT_KNOWN, NOTHING, UNKNOWN, YEARS, Piece, Range
from ..buildings.variables import RUPTURE
from ..money.present_value import payback
from ..text.rows import Rows
from ..text.words import floor_cell, floor_name, level_text
from .breaks import ENDS, breaks_by_level
from .pieces import at_rate, chance_cell, in_years, payback_text
from .unseen import at_most, most_probability
from .values import Cell, ValueTable, known, of_kind, with_ends, with_units

MOST_ROWS = 60
"""Most rows of a table in a terminal or a report."""
AS_IT_IS = "as it is"
SETS = ("budget", "target")
COLUMNS = {
    **of_kind("", "item", "floor", "pieces", "kit", "damping_law"),
    **with_ends("rate", "falls", "front_falls", "falls_saved", "front_falls_saved"),
    **with_ends("share", "share_saved"),
    "effect": "",
    **with_ends("rate", "breaks"),
    "saving_of_all": "saving",
    **of_kind("money", "cost", "cost_of_all"),
    "payback": "years",
    **of_kind("", "for_budget", "for_target"),
    **of_kind("N", "required_force", "half_weight", "strength"),
    "static_capacity": "m s-2",
}
"""Columns of the table in a file, and the kind of their units."""


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


def kit_rows(results: xr.Dataset, model: int = 0, number: int = MOST_ROWS) -> Rows | None:
    """Return what falls with each kit and what it saves, in at most so many rows; None without kits."""
    if "kit_falls" not in results:
        return None
    lines = kit_lines(results, model)
    yearly = "item_rate" in results
    money = currency_of(results)
    valued = any(one.saving != 0.0 and math.isfinite(one.saving) for one in lines)
    priced = any(math.isfinite(one.cost) and one.kit for one in lines)
    sets = [name for name in SETS if f"{name}_kit" in results]
    when = f"in {YEARS:g} years" if yearly else "at the level"
    headings = ["piece", "floor", "number", "kit", f"chance of falling {when}, each", "into the room"]
    headings += ["falls saved", "effect", f"kit breaks {when}"]
    headings += [f"all save {'a year' if yearly else 'then'}"] if valued else []
    headings += ["all cost"] if priced else []
    headings += [f"pays back, years{at_rate([one.piece for one in lines])}"] if valued and priced and yearly else []
    headings += [f"for the {name}" for name in sets]
    rows = []
    most = at_most(results)
    for one in lines[:number]:
        first = not one.kit
        cells = [one.piece.item, floor_cell(one.piece.floor), f"{one.piece.number:,}"] if first else ["", "", ""]
        cells.append(one.kit or (f"{AS_IT_IS} ({one.piece.kit})" if one.piece.kit else AS_IT_IS))
        cells += [_chance(each, yearly, most) for each in (one.falls, one.front)]
        cells.append("" if first else _share(one.share))
        cells.append(one.effect)
        cells.append("" if math.isnan(one.breaks.value) else _chance(one.breaks, yearly, most))
        cells += ["" if first else _digits(one.saving)] if valued else []
        cost = one.piece.number * one.cost
        cells += ["" if first else given_number(cost) if math.isfinite(cost) else "–"] if priced else []
        pays = payback_text(one.payback)
        cells += ["" if first else pays] if valued and priced and yearly else []
        cells += ["yes" if one.chosen[SETS.index(name)] else "" for name in sets]
        rows.append(tuple(cells))
    said = [f"{confidence_text(results)} intervals"]
    said += [f"values in {money}"] if money and (valued or priced) else []
    said += [f"the first {number} of {len(lines):,} rows"] if len(lines) > number else []
    said += _sets(results.isel(model=model), sets, money)
    return Rows(f"Each kit on each piece that it fits ({', '.join(said)})", tuple(headings), rows)


def short_kit_rows(results: xr.Dataset, model: int = 0, number: int = MOST_ROWS) -> Rows | None:
    """Return the table of kits for a narrow terminal, of at most so many rows of pieces and kits; None without kits."""
    if "kit_falls" not in results:
        return None
    lines = kit_lines(results, model)
    yearly = "item_rate" in results
    money = currency_of(results)
    rows: list[tuple[str, ...]] = []
    most = at_most(results)
    for one in lines[:number]:
        piece = one.piece
        if not one.kit:
            many = "" if piece.number == 1 else f", {piece.number:,} pieces"
            rows.append((f"{piece.item} ({floor_name(piece.floor)}{many})", "", "", "", ""))
        name = one.kit or (f"{AS_IT_IS} ({piece.kit})" if piece.kit else AS_IT_IS)
        cost = piece.number * one.cost
        name += f", {given_number(cost)} {money}".rstrip() if one.kit and math.isfinite(cost) else ""
        sets = [of for of, chosen in zip(SETS, one.chosen, strict=True) if chosen]
        said = f"\n  for {', '.join(sets)}" if sets and one.kit else ""
        said += f"\n  {one.effect}" if one.kit and one.effect not in (HELPS, NOT_KNOWN) else ""
        cells = [_chance(each, yearly, most) for each in (one.falls, one.front)]
        cells += [_share(one.share) if one.kit else ""]
        cells.append("" if math.isnan(one.breaks.value) else _chance(one.breaks, yearly, most))
        # (the interval below its value)
        rows.append(
            (f"  {name}{said}", *(cell.replace(" (", "\n(").replace(" to ", "\u00a0to\u00a0") for cell in cells))
        )
    when = f" in {YEARS:g} years" if yearly else ""
    notes = [f"chances of one piece{when} with {confidence_text(results)} intervals, costs of all pieces of a line"]
    notes += [f"the first {number} of {len(lines):,} rows"] if len(lines) > number else []
    notes += _sets(results.isel(model=model), [name for name in SETS if f"{name}_kit" in results], money)
    return Rows(f"Kits ({'; '.join(notes)})", ("", "falls", "into room", "saved", "breaks"), rows)


def static_rows(results: xr.Dataset) -> Rows | None:
    """Return the static checks of the kits by hand; None without kits."""
    if "kit_falls" not in results:
        return None
    headings = ["piece", "floor", "peak of its floor, g", "kit", "strength, N", "static force, N"]
    headings += ["half of the weight, N", "tips statically at, g", "breaks in the runs"]
    rows = []
    lines = [one for one in kit_lines(results) if one.kit]
    most = f"at most {about_percent(most_probability(results))}"
    for one in lines[:MOST_ROWS]:
        peak = float(results["kit_peak_acceleration"].sel(item=one.piece.item)) / STANDARD_GRAVITY
        force = _digits(one.force) if one.force != 0.0 else "no uplift"
        cells = [one.piece.item, floor_cell(one.piece.floor), _digits(peak), one.kit, _digits(one.strength), force]
        breaks = "–" if math.isnan(one.at_design.value) else _chance(one.at_design, False, most)
        rows.append((*cells, _digits(one.half), _digits(one.capacity / STANDARD_GRAVITY), breaks))
    at = "10 % in 50 years"
    if "item_rate" not in results:
        at = level_text(float(results.attrs["at_level"]), results["level"])
    elif math.isnan(results["kit_peak_acceleration"].values.min()):
        at += ", shaking outside the levels that were run"
    first = "" if len(lines) <= MOST_ROWS else f"the first {MOST_ROWS} of {len(lines):,}; "
    title = (
        f"Static checks by hand, of one piece ({first}at {at}; they take a kit as rigid and leave out slack, stiffness "
        "and the duration of the shaking, so the last column, the share of the motions in which the kit breaks there, "
        f"may be higher or lower than they suggest{_nodes(results)})"
    )
    return Rows(title, headings, rows)


def _nodes(results: xr.Dataset) -> str:
    """Return why a higher floor has a smaller peak than a lower one, where one has; '' where none has."""
    floors = results["floor"].values
    peaks = results["kit_peak_acceleration"].values
    known = [(int(floor), peak) for floor, peak in zip(floors, peaks, strict=True) if str(floor).isdecimal()]
    if not any(low < high and peak > above for low, peak in known for high, above in known):
        return ""
    return "; a higher floor can have a smaller peak than one below it, because higher modes move it less"


def level_break_rows(results: xr.Dataset, model: int = 0) -> Rows | None:
    """Return the shares of the motions in which kits break at each level, of the first kits on pieces; None without."""
    here = results.isel(model=model)
    every: dict[str, list[xr.DataArray]] = {}
    if f"{RUPTURE.name}_probability" in here:
        names = [f"{RUPTURE.name}_probability{end}" for end in ENDS]
        for item, kit in zip(here["item"].values, here["anchored_with"].values, strict=True):
            if kit:
                every[f"{item}: {kit}"] = [here[name].sel(item=item) for name in names]
    if "kit_broken_probability" in here:
        for item, kit in product(here["item"].values, here["kit"].values):
            if bool(here["kit_fits"].sel(item=item, kit=kit)):
                at = {"item": item, "kit": kit}
                every[f"{item}: {kit}"] = [here[f"kit_broken_probability{end}"].sel(at) for end in ENDS]
    return breaks_by_level(every, here["level"], confidence_text(results), "kits")


def kit_table(results: xr.Dataset, model: int = 0) -> ValueTable | None:
    """Return all pieces with all kits as values, for a spreadsheet; None without kits."""
    if "kit_falls" not in results:
        return None
    yearly = "item_rate" in results
    money = currency_of(results)
    units = {
        "": "",
        "share": "1",
        "rate": "1/year" if yearly else "1",
        "saving": f"{money}/year" if money and yearly else money,
        "money": money,
        "years": "years",
        "N": "N",
        "m s-2": "m s-2",
    }
    left = [f"for_{name}" for name in SETS if f"{name}_kit" not in results]
    left += [] if yearly else ["payback"]
    kept = [name for name in COLUMNS if name not in left]
    law = str(results["model"].values[model])
    rows: list[list[Cell]] = []
    for one in kit_lines(results, model):
        values: dict[str, str | float | int] = {
            "item": one.piece.item,
            "floor": int(one.piece.floor) if one.piece.floor.isdecimal() else one.piece.floor,
            "pieces": one.piece.number,
            "kit": one.kit or one.piece.kit,
            "damping_law": law,
            "saving_of_all": one.saving,
            "cost": one.cost,
            "cost_of_all": one.piece.number * one.cost,
            "payback": one.payback,
            "effect": one.effect,
            "for_budget": "yes" if one.chosen[0] else "no",
            "for_target": "yes" if one.chosen[1] else "no",
            "required_force": one.force,
            "half_weight": one.half,
            "strength": one.strength,
            "static_capacity": one.capacity,
        }
        ranges = {"falls": one.falls, "front_falls": one.front}
        ranges |= {"falls_saved": one.saved, "front_falls_saved": one.front_saved, "share_saved": one.share}
        ranges |= {"breaks": one.breaks}
        for name, each in ranges.items():
            values |= {f"{name}{end}": value for end, value in zip(("", "_lower", "_upper"), each, strict=True)}
        rows.append([known(values[name]) for name in kept])
    return ValueTable([with_units(name, units[COLUMNS[name]]) for name in kept], rows)


def _sets(here: xr.Dataset, sets: list[str], money: str) -> list[str]:
    """Return what the sets of kits cost, and whether they are enough."""
    found = []
    for name in sets:
        if name == "target" and not bool(here["target_met"]):
            found.append("no set of these kits meets the target")
        else:
            cost = f"{given_number(float(here[f'{name}_cost']))} {money}".rstrip()
            found.append(f"the set for the {name} costs {cost}")
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


def _chance(rate: Range, yearly: bool, most: str) -> str:
    """Return a chance with its interval; `most` is the bound of what no motion showed."""
    return chance_cell(in_years(rate, YEARS) if yearly else rate, most)


def _share(share: Range) -> str:
    """Return the share of a piece's falls that a kit saves, with its interval."""
    if not math.isfinite(share.value):  # (-inf: it falls with the kit alone)
        return "–" if math.isnan(share.value) else "more falls"
    value, *ends = (f"{100.0 * part:.0f}".replace("-", "−").replace("inf", "∞") for part in share)
    between = " to " if share.lower < 0.0 else "–"
    return f"{value}\u00a0%" if math.isnan(share.lower) else f"{value}\u00a0% ({between.join(dict.fromkeys(ends))})"


def _digits(value: float) -> str:
    return two_digits(value) if math.isfinite(value) else "–"
