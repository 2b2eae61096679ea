"""Pieces of two performance studies side by side, and their buildings as a whole."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from ...core.aliases import Array, Index
from ...core.facts import Fact
from ...core.units import DIMENSIONLESS, PER_YEAR
from ...core.wording import currency_of
from ...fragility.fitting.bootstrap import draw_motions
from ...fragility.hazard.rates import probability_in
from ...fragility.numerics.totals import chances, chances_of_any
from ...fragility.risk.ratios import ratio_of
from ...fragility.runs.provenance import number_of_motions
from ..buildings.anchoring import weights_of
from ..buildings.assessment import BUILDING
from ..buildings.outcomes import DAY
from ..buildings.pieces import pieces_of
from ..buildings.recommendations import YEARS, Piece, Range
from ..buildings.variables import Year, fall_flags, level_index, per_year
from ..facts.coverage import coverage
from ..plan.ratios import verdict_of
from ..tables.unseen import at_most
from ..text.words import floor_name, level_name, level_text
from .ratios import ANCHORED_IN, NONE, Found, Line, Quantity
from .sides import Side, matched_laws, matched_names, same_motions

CHANCE, NUMBER, LOSS, ANY = "chance", "number", "loss", "any"
DOWNTIME, INJURIES = "downtime", "injuries"
"""Quantities: the chance of one piece; expected pieces and value that overturn, the longest downtime of them and the
persons whom they injure; the chance that anything overturns."""
AMOUNTS = (NUMBER, LOSS, DOWNTIME, INJURIES)
YEARLY = {**{amount: f"annual_{amount}" for amount in AMOUNTS}, ANY: "any_rate"}
AT_LEVEL = {**{amount: f"{amount}_mean" for amount in AMOUNTS}, ANY: "any_probability"}
"""Names of the totals in the results, with a hazard and without."""
WHOLE = "the building"
NEVER = "none seen to fall"
PERIOD = "in 1,000 years"


class Shaken(NamedTuple):
    """Falls of one side under one law, motion by motion: `chance` (item, motion) of a piece, others (motion,)."""

    chance: Array
    number: Array
    loss: Array
    downtime: Array | None
    injuries: Array | None
    any: Array

    @classmethod
    def of(cls, side: Side, law: int) -> Shaken:
        """Compute them from the flags of every run."""
        results = side.results
        counts, values = results["count"].values, results["value"].values
        independent = str(results.attrs["pieces"]) == "independent"
        sizes = results.sizes
        year = year_of(side)
        chance = np.empty((sizes["item"], year.size(sizes["motion"])))
        none = np.ones((sizes["level"], sizes["motion"]))
        for i in range(sizes["item"]):
            own = chances(fall_flags(results).isel(model=[law], item=[i]).values)
            none *= 1.0 - chances_of_any(own, counts[[i]], independent)[0, 0]
            chance[i] = year.total(own[0, 0])
        number = (counts[:, None] * chance).sum(axis=0)
        loss = ((counts * values)[:, None] * chance).sum(axis=0)
        persons = _persons(results)
        injuries = None if persons is None else ((counts * persons)[:, None] * chance).sum(axis=0)
        return cls(chance, number, loss, _downtime(results, law, year), injuries, year.total(1.0 - none))


def _persons(results: xr.Dataset) -> Array | None:
    """Return the mean number of persons whom a piece of each line injures (item,), None where no line injures any."""
    if AT_LEVEL[INJURIES] not in results:
        return None
    mean = results["persons_exposed"].values * results["injury_probability"].values
    return np.asarray(np.where(np.isnan(mean), 0.0, mean))


def _downtime(results: xr.Dataset, law: int, year: Year) -> Array | None:
    """Return the expected longest downtime under each motion, None where no line has any."""
    if DOWNTIME not in results:
        return None
    drawn = results[DOWNTIME].isel(model=law).sel(place=BUILDING).mean("realisation")
    return year.total(drawn.transpose("level", "motion").values)


def compare_pieces(a: Side, b: Side, laws: tuple[str, str] | None = None) -> Found:
    """Compare pieces and totals of two performance studies, with paired intervals if their motions are the same."""
    items, models = matched_names(a, b, "item", "piece"), matched_laws(a, b, laws)
    yearly = "item_rate" in a.results
    # (where levels have motions of their own, those of the same levels are drawn)
    paired = same_motions(a, b) and np.array_equal(year_of(a).strata_levels, year_of(b).strata_levels)
    options = a.study.get("performance", {})
    replicates, seed = int(options.get("replicates", 1000)), int(options.get("seed", 0))
    drawn = [
        draw_motions(strata, replicates, seed + shift) / sum(stratum.size for stratum in strata)
        for strata, shift in ((_strata(a), 0), (_strata(b), 0 if paired else 1))
    ]
    lines = []
    for j, k in models.pairs:
        shaken = [Shaken.of(a, j), Shaken.of(b, k)]
        names = str(a.results["model"].values[j]), str(b.results["model"].values[k])
        pieces = [{one.item: one for one in pieces_of(side.results, law)} for side, law in ((a, j), (b, k))]
        lines += _totals(a, b, (j, k), shaken, drawn, names, yearly)
        for i, m in items.pairs:
            rates = [one.chance[at] @ weights.T for one, at, weights in zip(shaken, (i, m), drawn, strict=True)]
            sides = zip(pieces, (a, b), (i, m), strict=True)
            both = [found[str(side.results["item"].values[at])] for found, side, at in sides]
            lines.append(_line((a, b), both, rates, names, yearly))
    notes = [Fact("comparison.totals")] if items.only_a or items.only_b else []
    notes += coverage(["ratio of totals"], min(number_of_motions(side.results) for side in (a, b)))
    if not _lossy(a, b) and any(map(_valued, (a, b))):
        notes.append(Fact("comparison.no_losses"))
    for quantity in (DOWNTIME, INJURIES):
        has = [AT_LEVEL[quantity] in side.results for side in (a, b)]
        if has[0] != has[1]:
            notes.append(Fact("comparison.no_amount", names=(quantity, "A" if has[0] else "B")))
    return Found({"model": models, "item": items}, lines, _quantities(a, yearly), notes)


def _quantities(side: Side, yearly: bool) -> list[Quantity]:
    """Return what is compared, the pieces first."""
    money = currency_of(side.results)
    of: dict[str, Any] = {"years": YEARS}
    if not yearly:
        level = level_text(float(side.results.attrs["at_level"]), side.results["level"])
        of = {"measure": level_name(side.results), "level": level}
    per, in_a = (PER_YEAR, f"{money} a year".strip()) if yearly else (DIMENSIONLESS, money)
    # (few pieces fall in one year)
    rare = (PERIOD, 1e-3, per, of) if yearly else ("", 1.0, per, of)
    each = " per year" if yearly else ""
    days = f"{DAY}s{each}", 1.0, per_year(DAY) if yearly else DAY, of
    return [
        Quantity(CHANCE, "", 1.0, DIMENSIONLESS, of, chance=True),
        Quantity(NUMBER, *rare, whole=True),
        Quantity(LOSS, f"{money}{each}".strip(), 1.0, in_a, of, whole=True),
        Quantity(DOWNTIME, *days, whole=True),
        Quantity(INJURIES, *rare, whole=True),
        Quantity(ANY, "", 1.0, DIMENSIONLESS, of, chance=True, whole=True),
    ]


def year_of(side: Side) -> Year:
    """Return the sums over the levels of a side; without a hazard the level of the answer alone."""
    level = None if "level_weight" in side.results else float(side.results.attrs["at_level"])
    return Year.of(side.results, weights_of(side.results, level))


def _strata(side: Side) -> tuple[Index, ...]:
    """Return the strata of the motions of a side."""
    return year_of(side).strata(side.results.sizes["motion"])


def _line(sides: tuple[Side, Side], both: list[Piece], rates: list[Array], laws: tuple[str, str], yearly: bool) -> Line:
    """Return the line of one piece: its chance in some years, or at the level."""
    held = [one.held for one in both]
    ranges = [NONE if kept else _in_years(one.chance, yearly) for one, kept in zip(both, held, strict=True)]
    samples = [_in_years_all(one, yearly) for one in rates]
    said = [
        "anchored" if kept else at_most(side.results) if one.value == 0.0 else ""
        for one, kept, side in zip(ranges, held, sides, strict=True)
    ]
    confidence = float(sides[0].results.attrs["confidence"])
    ratio = Range(*ratio_of(ranges[0].value, ranges[1].value, samples[0], samples[1], confidence))
    verdict = verdict_of(ratio)
    if any(held):
        verdict = ANCHORED_IN["both" if all(held) else "A" if held[0] else "B"]
    places = [", ".join(filter(None, (one.room, floor_name(one.floor)))) for one in both]
    names = [one.item for one in both]
    name, place = (one[0] if one[0] == one[1] else f"{one[0]} → {one[1]}" for one in (names, places))
    return Line(CHANCE, name, place, laws, ranges[0], ranges[1], ratio, verdict, *said)


def _lossy(a: Side, b: Side) -> bool:
    """Return whether both sides have losses in the same currency."""
    return _valued(a) and _valued(b) and a.results.attrs.get("currency") == b.results.attrs.get("currency")


def _totals(
    a: Side, b: Side, at: tuple[int, int], shaken: list[Shaken], drawn: list[Array], laws: tuple[str, str], yearly: bool
) -> list[Line]:
    """Return the lines of the building: what falls and what comes of it, as far as both sides have it."""
    both = [one for one in AT_LEVEL if all(AT_LEVEL[one] in side.results for side in (a, b))]
    known = [one for one in both if one != LOSS or _lossy(a, b)]
    found = []
    for quantity in known:
        of_years = yearly and quantity == ANY
        stored = [_stored(side, quantity, law, yearly) for side, law in zip((a, b), at, strict=True)]
        ranges = [_in_years(rate, of_years) for rate in stored]
        sums = [getattr(one, quantity) @ weights.T for one, weights in zip(shaken, drawn, strict=True)]
        samples = [_in_years_all(rates, of_years) for rates in sums]
        said = [
            "" if one.value != 0.0 else at_most(side.results) if quantity == ANY else NEVER
            for one, side in zip(ranges, (a, b), strict=True)
        ]
        confidence = float(a.results.attrs["confidence"])
        ratio = Range(*ratio_of(ranges[0].value, ranges[1].value, samples[0], samples[1], confidence))
        found.append(Line(quantity, WHOLE, "", laws, ranges[0], ranges[1], ratio, verdict_of(ratio), *said))
    return found


def _stored(side: Side, quantity: str, law: int, yearly: bool) -> Range:
    """Return a total of the building with its interval, as the results hold it."""
    here = side.results.isel(model=law).sel(place=BUILDING)
    name = YEARLY[quantity] if yearly else AT_LEVEL[quantity]
    if not yearly:
        here = here.isel(level=level_index(side.results, float(side.results.attrs["at_level"])))
    return Range(*(float(here[f"{name}{end}"]) for end in ("", "_lower", "_upper")))


def _valued(side: Side) -> bool:
    return bool((side.results["value"].values > 0.0).any())


def _in_years(rate: Range, yearly: bool) -> Range:
    """Return the chance of at least one fall in `YEARS` from annual rates, or probabilities as they are."""
    return Range(*(float(one) for one in _in_years_all(np.array(rate), yearly))) if not math.isnan(rate.value) else rate


def _in_years_all(rates: Array, yearly: bool) -> Array:
    return probability_in(rates, YEARS) if yearly else rates
