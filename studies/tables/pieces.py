"""The table of the pieces of a building: probability of falling, cost and saving of anchoring, and recommendation."""

import math
from collections.abc import Sequence

import numpy as np
import xarray as xr

from ...core.units import ENDS
from ...core.wording import about_percent, counted, currency_of, given_percent
from ...fragility.risk.modelling import LOWER, UPPER
from ..buildings.pieces import SHARES, pieces_of
from ..buildings.recommendations import UNKNOWN, YEARS, Piece, Range
from ..buildings.sliding import OFF, OFF_RATE, OVERTURNING, OVERTURNING_RATE
from ..buildings.variables import RUPTURE
from ..codes.check import UNSTATED_DANGER
from ..plan.slides import GATED, GATED_RATE, INSTEAD, TRIP, TRIP_DISTANCE, TRIP_RATE
from ..text.spread import MODEL_RANGE, OUTER, model_note
from ..text.words import consequence_name, display_unit, floor_cell, level_name, level_text, reference_law, roof_of
from .assessment import DRAWN, bound_of, most_rate, span
from .table import Cells, Column, Row, Table, Value, chance_in, ends_of, footnote, intervals, range_of, tilted

MOST_ROWS, MOST_SHORT = 60, 8
"""Most pieces that a table shows, and most on a terminal by default."""
FRACTILES = "", "_5_percent", "_95_percent"
CHANCES = {
    "sliding_off": (OFF, OFF_RATE),
    "tripping": (TRIP, TRIP_RATE),
    "overturning_alone": (OVERTURNING, OVERTURNING_RATE),
    "overturning_where_it_rocks": (GATED, GATED_RATE),
}
"""Probabilities that sliding changes, by the beginning of their columns: at a level, and annual rates."""
IN_50, AT_LEVEL = "_in_50_years", "_at_level"
EXPORTED = (
    *(Column(key) for key in ("item", "room", "floor", "pieces", "anchored_with", "damping_law")),
    *(Column(f"chance_in_{years}", unit="1", ends=ENDS) for years in ("a_year", "50_years")),
    *(Column(f"chance{IN_50}{end}", unit="1") for end in (LOWER, UPPER)),
    Column(f"chance{IN_50}_over_branches", unit="1", ends=FRACTILES),
    Column("level", unit="level"),
    Column(f"probability{AT_LEVEL}", unit="1", ends=ENDS),
    *(Column(f"probability{AT_LEVEL}{end}", unit="1") for end in (LOWER, UPPER)),
    *(Column("contact"), Column("friction", unit="1"), Column(INSTEAD, unit="1")),
    *(Column(f"sliding_off{when}", unit="1", ends=ENDS) for when in (IN_50, AT_LEVEL)),
    Column(TRIP_DISTANCE, unit="m"),
    *(Column(f"{key}{when}", unit="1", ends=ENDS) for key in [*CHANCES][1:] for when in (IN_50, AT_LEVEL)),
    *(Column(f"level_at_{100.0 * share:g}_percent", unit="level") for share in SHARES),
    Column("consequences"),
    *(Column(key, unit="money") for key in ("value", "anchoring_cost", "anchoring_cost_of_all")),
    Column("saving_a_year", unit="money/year", ends=ENDS),
    Column("payback", unit="years"),
    Column("downtime_of_one_a_year", unit="days/year", ends=ENDS),
    Column("injured_a_year", unit="1/year", ends=ENDS),
    *(Column(key) for key in ("recommendation", "kit", "within_budget", "code", "code_clause", "code_factors")),
    *(Column(key, unit="N") for key in ("code_force", "code_anchor_force")),
    Column("code_demand_over_strength", unit="1"),
)
"""Columns of the table in a file; units that depend on the results are replaced."""


def pieces(results: xr.Dataset, model: int = 0) -> Table:
    """Return the table of the pieces under one law; under the law of the answer chances are over all branches."""
    every = pieces_of(results, model)
    spread = over_branches(results) if model == reference_law(results)[0] else {}
    yearly, roof, money = "rate" in results, roof_of(results), currency_of(results)
    bound, of_law = bound_of(results), results.isel(model=model)
    unseen_rate = most_rate(results) if yearly else math.nan
    spans = {name: span(results[f"block_annual_{name}"]) for name in DRAWN if f"block_annual_{name}" in results}
    means = results["cost_median"].notnull().values if "cost_median" in results.coords else np.zeros(0)
    mean = dict(zip(results["block"].values.tolist(), means.tolist(), strict=False))
    scale, unit = display_unit(results["level"])
    judged = footnote("discount", given_percent(every[0].discount if every else 0.0))
    when = f" in {YEARS:g} years" if yearly else ""
    rows: list[Cells] = []
    for piece in every:
        values = of_law.sel(block=piece.item)
        breaks = chance_of(values, f"{RUPTURE}_probability", f"{RUPTURE}_rate")
        rate = spread.get(piece.item, piece.chance)
        saving = _saving(piece, unseen_rate)
        row: Cells = {
            Column("item", "piece"): piece.item,
            Column("room", "room"): piece.room,
            Column("floor", "floor"): floor_cell(piece.floor, roof),
            Column("pieces", "number", "count"): piece.number,
            Column("anchored_with", "held by"): piece.kit,
            Column("chance", f"falls{when}, each", "chance"): (
                None if piece.held else bounded(chance_in(rate, YEARS) if yearly else piece.chance, bound)
            ),
            Column("model_range", MODEL_RANGE, "chance", note=model_note(results)): (
                None if piece.held else _model_range(values)
            ),
            Column("breaks", f"its kit breaks{when}", "chance"): (
                None if math.isnan(breaks.value) else bounded(breaks, bound)
            ),
            Column("recommendation", "recommendation"): piece.recommendation,
            Column("kit", "with kit"): "" if piece.meant is None or piece.held else piece.meant.kit,
            Column("level", f"half fall at {level_name(results)}", "level2", unit, priority=2): (
                None if piece.held or results.sizes["level"] == 1 else piece.levels[-1] / scale
            ),
            Column("consequences", "consequence"): ", ".join(map(consequence_name, piece.consequences)) or None,
            Column("value", "mean cost, each", "given", money, priority=2): (
                (float(f"{piece.value:.2g}") if mean.get(piece.item) else piece.value) if mean and piece.value else None
            ),
            Column("anchoring_cost", "anchoring, each", "given", money, priority=2, note=judged): piece.cost,
            Column("saves", "saves per year, all", "amount", money, priority=2): None if mean else saving,
            Column("lost", "lost per year, all", "two", money, priority=2): (
                (saving if saving.value == 0.0 else saving.value) if mean and not piece.held else None
            ),
        }
        for name, (years, words) in spans.items():
            column = Column(
                name, f"{DRAWN[name]} {words}, {'each' if name == 'downtime' else 'all'}", "two", priority=2
            )
            row[column] = None if piece.held else years * getattr(piece, name).value or None
        rows.append(row)
    level = "" if yearly else level_text(float(results.attrs["at_level"]), results["level"])
    return Table.of(
        "Pieces",
        rows,
        footnote("pieces_over_branches") if spread else intervals(results, rows),
        footnote("chances_at", level_name(results), level) if level and results.sizes["level"] > 1 else "",
        tilted(results),
    )


def _saving(piece: Piece, unseen_rate: float) -> Range:
    """Return the annual saving of anchoring a line; of pieces that fall in no run 0 with its largest value as a bound.

    `unseen_rate`: largest annual rate of an event in no motion.
    """
    if piece.held or piece.saving.value != 0.0:
        return piece.saving
    return Range(0.0, math.nan, unseen_rate * (piece.number * piece.value + piece.carried))


def short_pieces(results: xr.Dataset, most: int = MOST_SHORT) -> Table:
    """Return the first pieces with their chance of falling and the recommendation."""
    at = reference_law(results)[0]
    table = pieces(results, at).only(*SHORT).without(model_note(results))  # (the answer says it)
    every = pieces_of(results, at)
    # (pieces are in the order of what to do about them: one below may fall more often than one above)
    least = min((piece.chance.value for piece in every[:most] if not piece.held), default=math.inf)
    above = [piece.chance for piece in every[most:] if not piece.held and piece.chance.value > least]
    if not above:
        return table.first(most)
    highest = max(above, key=lambda chance: chance.value)
    highest = chance_in(highest, YEARS) if "rate" in results else highest
    more = footnote("others_fall_more", len(above), about_percent(highest.value))
    return table.first(most).noted(more)


def danger(results: xr.Dataset, model: int = 0) -> Table:
    """Return the probability of falling of each piece, and the recommendation."""
    return pieces(results, model).but(WORTH).first(MOST_ROWS)


def worth(results: xr.Dataset, model: int = 0) -> Table:
    """Return the levels at which each piece falls, its value, and the cost and saving of its anchoring."""
    table = pieces(results, model).apart("Levels and values", ("item",), WORTH)
    return table.first(MOST_SHORT)


SHORT = "item", "floor", "pieces", "chance", "model_range", "recommendation"
"""Columns of the short table."""
WORTH = "level", "value", "anchoring_cost", "saves", "lost", *DRAWN
"""Columns of the second table."""


def codes(results: xr.Dataset) -> Table:
    """Return the building code's result for each piece, with the design forces."""
    rows, unstated, moments = list[Cells](), 0, False
    for piece in pieces_of(results):
        code = piece.code
        assert code is not None  # (the study names a code)
        if code.missing == UNSTATED_DANGER:
            unstated += 1
            continue
        moments |= math.isfinite(code.demand) and code.demand != code.force
        missing = code.factors if math.isnan(code.coefficient) else ""
        rows.append({
            Column("item", "piece"): piece.item,
            Column("status", "code says"): code.status,
            Column("clause", "clause"): "; ".join(filter(None, (code.clause, missing))),
            Column("coefficient", "force / weight", "three"): code.coefficient,
            Column("force", "force, each", "three", "N"): code.force,
            Column("demand", "on its anchors", "three", "N"): code.demand,
            Column("ratio", "demand / strength", "two"): code.ratio,
        })  # fmt: skip
    anchors = footnote("moments" if moments else "whole_force")
    left = footnote("not_checked_lines", counted(unstated, "line")) if unstated else footnote("not_checked")
    table = Table.of("Code requirements", rows, code_note(results), anchors, left, most=MOST_ROWS)
    return table.but([] if moments else ["demand"])


def code_note(results: xr.Dataset) -> str:
    """Return the sentence of a note on the building code, with its values of the site; '' without a code."""
    return footnote("code", results.attrs["code"], results.attrs["code_site"]) if "code" in results.attrs else ""


def exported_pieces(results: xr.Dataset, model: int = 0, readable: bool = False) -> Table:
    """Return the pieces under one law as values in SI, or for people (`readable`) in the tables' units and per cent."""
    scale, level = display_unit(results["level"]) if readable else (1.0, str(results["level"].attrs.get("units", "1")))
    money = currency_of(results)
    units = {
        "1": "" if readable else "1",
        "level": level,
        "money": money,
        "money/year": f"{money}/year" if money else "",
    }
    yearly = "rate" in results
    of_all: dict[str, Value] = {"damping_law": str(results["model"].values[model])}
    of_all |= {} if yearly else {"level": float(results.attrs["at_level"]) / scale}
    spread = over_branches(results)
    slid = _sliding(results.isel(model=model))
    rows = [
        of_all | _values(results, piece, spread.get(piece.item), scale) | slid[piece.item]
        for piece in pieces_of(results, model)
    ]
    columns = [column._replace(unit=units.get(column.unit, column.unit)) for column in EXPORTED]
    return Table("Pieces", [column for column in columns if column.key in rows[0]], rows)


def _sliding(of_law: xr.Dataset) -> dict[str, Row]:
    """Return the results on sliding of each item, and its probability if all capacities are off, by column."""
    chance, end = ("chance", IN_50) if "rate" in of_law else ("probability", AT_LEVEL)
    sliding_of = {}
    for i, item in enumerate(of_law["block"].values.tolist()):
        piece = of_law.isel(block=i)
        row: Row = {key: piece[key].item() for key in ("contact", "friction", INSTEAD, TRIP_DISTANCE) if key in of_law}
        row |= {f"{name}{end}": chance_of(piece, *chances) for name, chances in CHANCES.items() if chances[0] in of_law}
        if f"{'rate' if chance == 'chance' else chance}{LOWER}" in of_law:
            ends = _model_range(piece.drop_vars("epistemic_rate", errors="ignore"))
            row |= {f"{chance}{end}{LOWER}": ends.lower, f"{chance}{end}{UPPER}": ends.upper}
        sliding_of[str(item)] = row
    return sliding_of


def chance_of(piece: xr.Dataset, chance: str, rate: str, ends: Sequence[str] = ENDS) -> Range:
    """Return a chance of a piece in `YEARS`, or at the level; NaN if the results have none."""
    if "rate" in piece:
        return chance_in(range_of(piece, rate, ends=ends), YEARS, 0.0)
    return range_of(piece.sel(level=float(piece.attrs["at_level"])), chance, ends=ends)


def _model_range(piece: xr.Dataset) -> Range:
    """Return the range of the chance that a piece falls if all capacities are off; NaN if it is not known."""
    rate = "epistemic_rate" if "epistemic_rate" in piece else "rate"
    ends = chance_of(piece, "probability", rate, ("", LOWER, UPPER))._replace(value=math.nan)
    return ends if ends.upper > 0.0 else UNKNOWN  # (no range is known of what never fell)


def over_branches(results: xr.Dataset) -> dict[str, Range]:
    """Return the mean rate of each piece over all branches with its 5 and 95 % fractiles; empty without branches."""
    if "epistemic_rate" not in results:
        return {}
    ends = results["epistemic_rate_fractile"].sel(epistemic_fractile=list(OUTER)).values
    rates = zip(results["epistemic_rate"].values.tolist(), ends.tolist(), strict=True)
    return {str(item): Range(mean, *pair) for item, (mean, pair) in zip(results["block"].values, rates, strict=True)}


def bounded(chance: Range, bound: float) -> Range:
    """Return a probability; for an event in no motion 0 with the upper end of its interval."""
    return chance if chance.value > 0.0 else Range(0.0, math.nan, bound)


def _values(results: xr.Dataset, piece: Piece, spread: Range | None, scale: float) -> dict[str, Value]:
    """Return the values of a piece by column; levels divided by `scale`."""
    yearly = "rate" in results
    values: dict[str, Value] = {
        "item": piece.item,
        "room": piece.room,
        "floor": int(piece.floor) if piece.floor.isdecimal() else piece.floor,
        "pieces": piece.number,
        **{
            f"level_at_{100.0 * share:g}_percent": (level or math.nan) / scale
            for share, level in zip(SHARES, piece.levels, strict=True)
        },
        "consequences": ", ".join(piece.consequences),
        "value": piece.value,
        "anchoring_cost": piece.cost,
        "anchoring_cost_of_all": piece.number * piece.cost,
        "saving_a_year": piece.saving,
        "payback": piece.payback,
        "recommendation": piece.recommendation,
    }
    if "anchored_with" in results.coords:
        values["anchored_with"] = piece.kit
    if "kit_falls" in results:
        values["kit"] = "" if piece.meant is None or piece.held else piece.meant.kit
    if "budget_chosen" in results:
        values["within_budget"] = "" if piece.held else "yes" if piece.chosen else "no"
    if "branch" in results.dims:
        known = spread if spread is not None and not piece.held and spread.value > 0.0 else UNKNOWN
        values[f"chance{IN_50}_over_branches"] = chance_in(known, YEARS)
    if piece.code is not None:
        names = {"": "status", "_clause": "clause", "_factors": "factors", "_force": "force"}
        names |= {"_anchor_force": "demand", "_demand_over_strength": "ratio"}
        values |= {f"code{end}": getattr(piece.code, name) for end, name in names.items()}
    unseen = not piece.held and piece.chance.value == 0.0 and math.isnan(piece.chance.upper)
    if "block_annual_downtime" in results:
        values["downtime_of_one_a_year"] = UNKNOWN if unseen else piece.downtime
    if "block_annual_injuries" in results:
        values["injured_a_year"] = UNKNOWN if unseen else piece.injuries
    chance = UNKNOWN if piece.held else piece.chance
    if unseen:  # (no motion made it fall)
        rate = most_rate(results) if yearly else math.nan
        chance = ends_of(math.nan, rate)
        if piece.saving.value == 0.0:
            values["saving_a_year"] = ends_of(math.nan, _saving(piece, rate).upper)
    if yearly:
        return values | {"chance_in_a_year": chance_in(chance, 1.0), "chance_in_50_years": chance_in(chance, YEARS)}
    return values | {"probability_at_level": chance}
