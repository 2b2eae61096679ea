"""Pieces of two performance studies side by side, and their buildings as a whole."""

import math
from typing import Any

import numpy as np

from ...core.aliases import Array
from ...core.facts import Fact
from ...core.units import DIMENSIONLESS, PER_YEAR
from ...core.wording import currency_of
from ...fragility.fitting.bootstrap import draw_motions
from ...fragility.hazard.poisson import probability_in
from ...fragility.numerics.totals import chances, chances_of_any
from ...fragility.runs.provenance import number_of_motions
from ..buildings.anchoring import weights_of
from ..buildings.assessment import BUILDING
from ..buildings.outcomes import DAY
from ..buildings.pieces import pieces_of
from ..buildings.recommendations import UNKNOWN, YEARS, Range
from ..buildings.variables import Year, fall_flags, level_index, per_year
from ..facts.coverage import coverage
from ..tables.assessment import at_most
from ..tables.table import chance_in, range_of
from ..text.words import floor_name, level_name, level_text
from .ratios import ANCHORED_IN, CHANCE, Found, Line, Quantity, line_of, pair_text
from .sides import Side, matched_laws, matched_names, same_motions

NUMBER, LOSS, ANY = "number", "loss", "any"
DOWNTIME, INJURIES = "downtime", "injuries"
"""Quantities: the probability of one piece; expected pieces and value that overturn, their longest downtime and the
persons whom they injure; the probability that anything overturns.
"""
AMOUNTS = (NUMBER, LOSS, DOWNTIME, INJURIES)
YEARLY = {**{amount: f"annual_{amount}" for amount in AMOUNTS}, ANY: "any_rate"}
AT_LEVEL = {**{amount: f"{amount}_mean" for amount in AMOUNTS}, ANY: "any_probability"}
"""Names of the totals in the results, with a hazard and without."""
WHOLE = "the building"
NEVER = "none seen to fall"
PERIOD = "in 1,000 years"


def fallen(side: Side, law: int) -> dict[str, Array]:
    """Return the falls of one side under one law by motion: `CHANCE` (item, motion) of a piece, others (motion,)."""
    results = side.results
    counts, sizes = results["count"].values, results.sizes
    independent = str(results.attrs["pieces"]) == "independent"
    year = year_of(side)
    chance = np.empty((sizes["block"], year.size(sizes["motion"])))
    none = np.ones((sizes["level"], sizes["motion"]))
    for i in range(sizes["block"]):
        of_item = chances(fall_flags(results).isel(model=[law], block=[i]).values)
        none *= 1.0 - chances_of_any(of_item, counts[[i]], independent)[0, 0]
        chance[i] = year.total(of_item[0, 0])
    of_piece = {NUMBER: 1, LOSS: results["value"].values}
    if AT_LEVEL[INJURIES] in results:  # (lines without persons injure none)
        of_piece[INJURIES] = np.nan_to_num(results["persons_exposed"].values * results["injury_probability"].values)
    totals = {name: ((counts * amount)[:, None] * chance).sum(axis=0) for name, amount in of_piece.items()}
    if DOWNTIME in results:
        building = results[[DOWNTIME, AT_LEVEL[DOWNTIME]]].isel(model=law).sel(place=BUILDING)
        drawn = building[DOWNTIME].mean("realisation")
        # (the mean at each level is no mean of draws)
        factor = (building[AT_LEVEL[DOWNTIME]] / drawn.mean("motion")).fillna(1.0)
        totals[DOWNTIME] = year.total((factor * drawn).transpose("level", "motion").values)
    return {CHANCE: chance, **totals, ANY: year.total(1.0 - none)}


def compare_pieces(a: Side, b: Side, laws: tuple[str, str] | None = None) -> Found:
    """Compare pieces and totals of two performance studies, with paired intervals if their motions are the same."""
    items, models = matched_names(a, b, "block", "piece"), matched_laws(a, b, laws)
    yearly = "rate" in a.results
    # if levels have their own motions, motions of the same levels are drawn
    paired = same_motions(a, b) and np.array_equal(year_of(a).strata_levels, year_of(b).strata_levels)
    options = a.study.get("performance", {})
    replicates, seed = int(options.get("replicates", 1000)), int(options.get("seed", 0))
    drawn = []
    for side, shift in ((a, 0), (b, 0 if paired else 1)):
        strata = year_of(side).strata(side.results.sizes["motion"])
        drawn.append(draw_motions(strata, replicates, seed + shift) / sum(stratum.size for stratum in strata))
    totals = [name for name, stored in AT_LEVEL.items() if all(stored in side.results for side in (a, b))]
    lines = []
    for j, k in models.pairs:
        sides = (a, j), (b, k)
        falls = [fallen(side, law) for side, law in sides]
        laws = str(a.results["model"].values[j]), str(b.results["model"].values[k])
        for name in totals:
            if name != LOSS or _lossy(a, b):
                stored = [_stored(side, name, law, yearly) for side, law in sides]
                of_motions = [of_side[name] for of_side in falls]
                lines.append(_line((a, b), (name, WHOLE, "", laws), stored, of_motions, drawn, yearly and name == ANY))
        pieces = [{piece.item: piece for piece in pieces_of(side.results, law)} for side, law in sides]
        for pair in items.pairs:
            sides_of = zip(pieces, (a, b), pair, strict=True)
            both = [by_item[str(side.results["block"].values[at])] for by_item, side, at in sides_of]
            chances = [UNKNOWN if piece.held else piece.chance for piece in both]
            name = pair_text(*(piece.item for piece in both))
            place = pair_text(*(", ".join(filter(None, (piece.room, floor_name(piece.floor)))) for piece in both))
            of_motions = [of_side[CHANCE][at] for of_side, at in zip(falls, pair, strict=True)]
            line = _line((a, b), (CHANCE, name, place, laws), chances, of_motions, drawn, yearly)
            held = [piece.held for piece in both]
            said_a, said_b = ("anchored" if fixed else words for fixed, words in zip(held, line[-2:], strict=True))
            verdict = ANCHORED_IN["both" if all(held) else "A" if held[0] else "B"] if any(held) else line.verdict
            lines.append(line._replace(verdict=verdict, said_a=said_a, said_b=said_b))
    notes = [Fact("comparison.totals")] if items.only_a or items.only_b else []
    notes += coverage(["ratio of totals"], min(number_of_motions(side.results) for side in (a, b)))
    if not _lossy(a, b) and any(map(_valued, (a, b))):
        notes.append(Fact("comparison.no_losses"))
    for quantity in (DOWNTIME, INJURIES):
        has = [AT_LEVEL[quantity] in side.results for side in (a, b)]
        if has[0] != has[1]:
            notes.append(Fact("comparison.no_amount", names=(quantity, "A" if has[0] else "B")))
    return Found({"model": models, "block": items}, lines, _quantities(a, yearly), notes)


def _quantities(side: Side, yearly: bool) -> list[Quantity]:
    """Return the compared quantities, the pieces first."""
    money = currency_of(side.results)
    of: dict[str, Any] = {"years": YEARS}
    if not yearly:
        level = level_text(float(side.results.attrs["at_level"]), side.results["level"])
        of = {"measure": level_name(side.results), "level": level}
    per, in_a = (PER_YEAR, f"{money} a year".strip()) if yearly else (DIMENSIONLESS, money)
    # (few pieces fall in one year)
    rare = (PERIOD, 1e-3, per, of) if yearly else ("", 1.0, per, of)
    per_year_text = " per year" if yearly else ""
    days = f"{DAY}s{per_year_text}", 1.0, per_year(DAY) if yearly else DAY, of
    return [
        Quantity(CHANCE, "", 1.0, DIMENSIONLESS, of, chance=True),
        Quantity(NUMBER, *rare, whole=True),
        Quantity(LOSS, f"{money}{per_year_text}".strip(), 1.0, in_a, of, whole=True),
        Quantity(DOWNTIME, *days, whole=True),
        Quantity(INJURIES, *rare, whole=True),
        Quantity(ANY, "", 1.0, DIMENSIONLESS, of, chance=True, whole=True),
    ]


def year_of(side: Side) -> Year:
    """Return the sums over the levels of a side; without a hazard the level of the answer alone."""
    level = None if "level_weight" in side.results else float(side.results.attrs["at_level"])
    return Year.of(side.results, weights_of(side.results, level))


def _line(
    sides: tuple[Side, Side],
    of: tuple[str, str, str, tuple[str, str]],
    stored: list[Range],
    of_motions: list[Array],
    drawn: list[Array],
    yearly: bool,
) -> Line:
    """Return the line of a number, stored and motion by motion; if `yearly`, of its chance in some years."""
    ranges = [chance_in(rate, YEARS) if yearly and not math.isnan(rate.value) else rate for rate in stored]
    samples = [number @ weights.T for number, weights in zip(of_motions, drawn, strict=True)]
    samples = [probability_in(rates, YEARS) for rates in samples] if yearly else samples
    words = [
        "" if number.value != 0.0 else at_most(side.results) if of[0] in (CHANCE, ANY) else NEVER
        for number, side in zip(ranges, sides, strict=True)
    ]
    return line_of(of, ranges, samples, words, float(sides[0].results.attrs["confidence"]))


def _lossy(a: Side, b: Side) -> bool:
    """Return True if both sides have losses in the same currency."""
    return _valued(a) and _valued(b) and a.results.attrs.get("currency") == b.results.attrs.get("currency")


def _stored(side: Side, quantity: str, law: int, yearly: bool) -> Range:
    """Return a total of the building with its interval from the results."""
    totals = side.results.isel(model=law).sel(place=BUILDING)
    name = YEARLY[quantity] if yearly else AT_LEVEL[quantity]
    if not yearly:
        totals = totals.isel(level=level_index(side.results, float(side.results.attrs["at_level"])))
    return range_of(totals, name)


def _valued(side: Side) -> bool:
    return bool((side.results["value"].values > 0.0).any())
