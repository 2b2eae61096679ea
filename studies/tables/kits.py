"""Tables of kits: falls and savings with each kit, and the static checks of their forces by hand."""

import math
from itertools import product

import xarray as xr

from ...core.units import ENDS, STANDARD_GRAVITY
from ...core.wording import currency_of, given_number, given_percent
from ..buildings.pieces import pieces_of
from ..buildings.recommendations import NOT_KNOWN, NOTHING, YEARS, Piece, Range
from ..buildings.variables import RUPTURE
from ..money.present_value import payback
from ..text.words import floor_cell, floor_name, level_text, reference_law
from .assessment import bound_of, most_probability
from .pieces import MOST_ROWS, MOST_SHORT, bounded
from .restraints import breaks_by_level
from .table import Cells, Column, Row, Table, Value, chance_in, footnote, intervals, range_of

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


Line = tuple[Piece, str, Row]
"""A line of an inventory with a kit, or as it is (kit ''): the values of a file, and the breaks `at_design`."""


def kit_lines(results: xr.Dataset, model: int = 0) -> list[Line]:
    """Return every piece that is not anchored for good as it is and with each kit that fits it, in their order."""
    of_law = results.isel(model=model)
    yearly = "rate" in of_law
    names = {"falls": "rate", "front_falls": "front_rate", "breaks": f"{RUPTURE}_rate"}
    if not yearly:
        names = {"falls": "probability", "front_falls": "front_probability", "breaks": f"{RUPTURE}_probability"}
    lines: list[Line] = []
    for piece in pieces_of(results, model):
        if piece.held:
            continue
        item = of_law.sel(block=piece.item)
        now = item if yearly else item.sel(level=float(results.attrs["at_level"]))
        common: Row = {
            "item": piece.item,
            "floor": int(piece.floor) if piece.floor.isdecimal() else piece.floor,
            "pieces": piece.number,
            "damping_law": str(of_law["model"].item()),
            "half_weight": float(item["kit_half_weight"]),
        }
        row = common | {key: range_of(now, name) for key, name in names.items()}
        row |= dict.fromkeys(("falls_saved", "front_falls_saved", "share_saved"), Range(0.0, 0.0, 0.0))
        row |= {"kit": piece.kit, "effect": "", "saving_of_all": 0.0, "cost": 0.0, "cost_of_all": 0.0}
        row |= dict.fromkeys(("payback", "required_force", "strength", "static_capacity"), math.nan)
        lines.append((piece, "", row | _chosen(item, "")))
        effects = {tried.kit: tried.effect for tried in piece.tried}
        for name in map(str, of_law["kit"].values[item["kit_fits"].values.astype(bool)]):
            kit = item.sel(kit=name)
            cost = float(kit["kit_cost"])
            of_all = piece.number * cost
            saving = float(kit["kit_saving"]) if "kit_saving" in kit else math.nan
            effect = effects.get(name, "")
            judged = effect not in (NOTHING, NOT_KNOWN) and piece.judged
            ranges = "falls", "front_falls", "falls_saved", "front_falls_saved", "share_saved", "breaks"
            row = common | {key: range_of(kit, f"kit_{key}") for key in ranges}
            row |= {"kit": name, "effect": effect, "saving_of_all": saving, "cost": cost, "cost_of_all": of_all}
            row["payback"] = payback(of_all, saving, piece.discount) if judged else math.nan
            row |= {"required_force": float(kit["kit_required_force"]), "strength": float(kit["kit_strength"])}
            capacity = float(kit["kit_static_capacity"])
            row |= {"static_capacity": capacity, "capacity": capacity / STANDARD_GRAVITY}
            row["at_design"] = range_of(kit, "kit_breaks_at_design" if yearly else "kit_breaks")
            lines.append((piece, name, row | _chosen(item, name)))
    return lines


def kits(results: xr.Dataset, model: int = 0, number: int = MOST_ROWS) -> Table:
    """Return the falls with each kit and its savings, the kits of each piece together."""
    yearly, money, bound = "rate" in results, currency_of(results), bound_of(results)
    sets = [name for name in SETS if f"{name}_kit" in results]
    lines = kit_lines(results, model)
    savings = {line["saving_of_all"] for _, _, line in lines}
    valued = any(isinstance(saving, float) and math.isfinite(saving) and saving != 0.0 for saving in savings)
    when = f"in {YEARS:g} years" if yearly else "at the level"
    paid = footnote("payback", given_percent(lines[0][0].discount)) if lines else ""
    rows: list[Cells | str] = []
    for piece, kit, line in lines:
        if not kit:
            many = "" if piece.number == 1 else f", {piece.number:,} pieces"
            rows.append(f"{piece.item} ({floor_name(piece.floor)}{many})")
        saves = f"all save {'per year' if yearly else 'then'}"
        rows.append({
            Column("kit", "kit"): kit or (f"{AS_IT_IS} ({piece.kit})" if piece.kit else AS_IT_IS),
            Column("falls", f"falls {when}, each", "chance"): _chance(line["falls"], yearly, bound),
            Column("front_falls", "into the room", "chance"): _chance(line["front_falls"], yearly, bound),
            Column("share_saved", "falls saved", "share"): line["share_saved"] if kit else None,
            Column("effect", "effect"): line["effect"] if kit else None,
            Column("breaks", f"kit breaks {when}", "chance"): _chance(line["breaks"], yearly, bound),
            Column("saving_of_all", saves, "two", money): line["saving_of_all"] if kit and valued else None,
            Column("cost_of_all", "all cost", "given", money): line["cost_of_all"] if kit else None,
            Column("payback", "pays back", "payback", "years", priority=2, note=paid): (
                line["payback"] if kit and valued and yearly else None
            ),
            **{Column(name, f"for the {name}"): "yes" if line[f"for_{name}"] == "yes" else None for name in sets},
        })  # fmt: skip
    notes = intervals(results, rows), footnote("one_piece")
    return Table.of("Kits", rows, *notes, *_sets(results.isel(model=model), sets, money), most=number)


def short_kits(results: xr.Dataset, number: int = MOST_SHORT) -> Table:
    """Return the table of kits for a narrow terminal."""
    table = kits(results, reference_law(results)[0], number)
    return table.only("kit", "falls", "front_falls", "share_saved", "effect", "cost_of_all", "breaks", *SETS)


def static_checks(results: xr.Dataset) -> Table:
    """Return the static checks of the kits by hand."""
    peaks = results["kit_peak_acceleration"] / STANDARD_GRAVITY
    bound = most_probability(results)
    rows: list[Cells] = [
        {
            Column("item", "piece"): piece.item,
            Column("floor", "floor"): floor_cell(piece.floor),
            Column("peak", "peak of its floor", "two", "g"): float(peaks.sel(block=piece.item)),
            Column("kit", "kit"): kit,
            Column("strength", "strength", "two", "N"): line["strength"],
            Column("required_force", "static force", "two", "N"): line["required_force"] or "no uplift",
            Column("half_weight", "half of the weight", "two", "N"): line["half_weight"],
            Column("capacity", "tips statically at", "two", "g"): line["capacity"],
            Column("breaks", "breaks in the runs", "chance"): _chance(line["at_design"], False, bound),
        }
        for piece, kit, line in kit_lines(results)
        if kit
    ]
    at = "10 % in 50 years"
    outside = "rate" in results and math.isnan(results["kit_peak_acceleration"].values.min())
    if "rate" not in results:
        at = level_text(float(results.attrs["at_level"]), results["level"])
    notes = (
        footnote("shaking", at),
        footnote("shaking_outside") if outside else "",
        footnote("rigid_kit"),
        footnote("smaller_peak") if _smaller_peak(results) else "",
    )
    return Table.of("Static checks by hand, of one piece", rows, *notes, most=MOST_ROWS)


def _smaller_peak(results: xr.Dataset) -> bool:
    """Return True if a higher floor has a smaller peak than a lower floor."""
    floors = results["floor"].values
    peaks = results["kit_peak_acceleration"].values
    known = [(int(floor), peak) for floor, peak in zip(floors, peaks, strict=True) if str(floor).isdecimal()]
    return any(low < high and peak > above for low, peak in known for high, above in known)


def kit_breaks(results: xr.Dataset) -> Table:
    """Return the shares of the motions in which kits break at each level, of the first kits on pieces."""
    of_law = results.isel(model=reference_law(results)[0])
    shares: dict[str, list[xr.DataArray]] = {}
    if f"{RUPTURE}_probability" in of_law:
        names = [f"{RUPTURE}_probability{end}" for end in ENDS]
        for item, kit in zip(of_law["block"].values, of_law["anchored_with"].values, strict=True):
            if kit:
                shares[f"{item}: {kit}"] = [of_law[name].sel(block=item) for name in names]
    if "kit_broken_probability" in of_law:
        for item, kit in product(of_law["block"].values, of_law["kit"].values):
            if bool(of_law["kit_fits"].sel(block=item, kit=kit)):
                at = {"block": item, "kit": kit}
                shares[f"{item}: {kit}"] = [of_law[f"kit_broken_probability{end}"].sel(at) for end in ENDS]
    return breaks_by_level(shares, of_law["level"], "kits", intervals(results))


def exported_kits(results: xr.Dataset, model: int = 0) -> Table:
    """Return all pieces with all kits as values, for a spreadsheet."""
    yearly, money = "rate" in results, currency_of(results)
    units = {
        "rate": "1/year" if yearly else "1",
        "saving": f"{money}/year" if money and yearly else money,
        "money": money,
    }
    left = [f"for_{name}" for name in SETS if f"{name}_kit" not in results] + ([] if yearly else ["payback"])
    columns = [
        column._replace(unit=units.get(column.unit, column.unit)) for column in EXPORTED if column.key not in left
    ]
    return Table("Kits", columns, [row for _, _, row in kit_lines(results, model)])


def _sets(of_law: xr.Dataset, sets: list[str], money: str) -> list[str]:
    """Return sentences on the costs of the sets of kits, and on a target that none of them meets."""
    sentences = []
    for name in sets:
        if name == "target" and not bool(of_law["target_met"]):
            sentences.append(footnote("no_set"))
        else:
            cost = f"{given_number(float(of_law[f'{name}_cost']))} {money}".rstrip()
            sentences.append(footnote("set_cost", name, cost))
    return sentences


def _chosen(item: xr.Dataset, kit: str) -> Row:
    """Return the membership of a kit ('' for none) of a piece in the sets for the budget and for the target."""
    sets = {name: f"{name}_kit" in item and str(item[f"{name}_kit"].item()) == kit for name in SETS}
    sets["target"] &= "target_met" not in item or bool(item["target_met"])
    return {f"for_{name}": "yes" if yes else "no" for name, yes in sets.items()}


def _chance(rate: Value, yearly: bool, bound: float) -> Range | None:
    """Return a probability with its interval; for an event in no motion 0 with the upper end of its interval."""
    if not isinstance(rate, Range) or math.isnan(rate.value):
        return None
    return bounded(chance_in(rate, YEARS) if yearly else rate, bound)
