"""Facts of performance studies: falls in a building, their costs, and the pieces to anchor."""

import json
import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import xarray as xr

from ...core.facts import Fact
from ...core.wording import currency_of
from ...fragility.numerics.slabs import slabs
from ...fragility.numerics.totals import chances, chances_of_any, chances_of_none
from ...fragility.runs.provenance import number_of_motions
from ...fragility.uncertainty.joint import INDEPENDENT
from ...models.friction import LOCKED, ROLLING
from ..buildings.anchoring import weights_of
from ..buildings.assessment import BUILDING
from ..buildings.pieces import on_moving_supports, pieces_of
from ..buildings.recommendations import (
    ANCHORED,
    DUTY,
    FIRST,
    INDICATIVE,
    LITTLE,
    NOTHING,
    OUTSIDE,
    PREVENTS,
    REDUCES,
    SAFER,
    SAVES,
    TOO_LITTLE,
    UNPRICED,
    UNRESOLVED,
    UNVALUED,
    WEAK,
    WORSE,
    WORTH,
    YEARS,
    Piece,
)
from ..buildings.sliding import shares_with_moving_supports
from ..buildings.variables import JOINT, Year, fall_flags
from ..codes.check import UNSTATED_DANGER
from ..inventory.consequences import SAFETY
from ..tables.assessment import amount, at_most, fallen_word, most_rate, pieces_at, span
from ..tables.slides import contacts_of
from ..tables.table import range_of
from ..text.spread import OUTER, building_spread, sources
from ..text.words import block_title, floor_name, quantity_name, reference_law
from .law_choice import damped_throughout

DISAGREE = 1.1
"""Ratio of the results of two laws from which the answer gives their difference."""
TO_ANCHOR = (DUTY, FIRST, REDUCES, SAFER, SAVES, PREVENTS, WORTH)
"""Recommendations to anchor a line."""
AMOUNTS = ("loss", "downtime", "injuries")
"""Annual amounts, most wanted first."""


def recommended_lines(results: xr.Dataset) -> list[Piece]:
    """Return the lines to anchor: those that the budget buys, or without a budget all that are recommended."""
    pieces = [piece for piece in pieces_of(results, reference_law(results)[0]) if not piece.held]
    if "budget_chosen" in results:
        return [piece for piece in pieces if piece.chosen]
    return [piece for piece in pieces if piece.recommendation in TO_ANCHOR and not piece.kit]


def rate_without(results: xr.Dataset, lines: Sequence[str]) -> float:
    """Return the annual rate of any fall under the reference law if some lines are anchored; NaN if not known.

    From the stored outcomes of the runs, motion by motion, as `assess` computes it.
    """
    if "overturned" not in results or "level_weight" not in results or "branch" in results.dims:
        return math.nan
    if "anchored_with" in results.coords and bool((results["anchored_with"] != "").any()):
        return math.nan  # (what falls with a kit, and breaks it, is no flag of these)
    at, _ = reference_law(results)
    flags = fall_flags(results.isel(model=[at]))
    stands = ~results["anchored"].values.astype(bool) & ~np.isin(results["block"].values.astype(str), list(lines))
    independent = str(results.attrs.get("pieces")) == INDEPENDENT
    parts = []
    for where in slabs({str(dim): size for dim, size in flags.sizes.items()}, ("motion",)):
        any_piece = chances_of_any(chances(flags.isel(where).values), results["count"].values, independent)
        parts.append(1.0 - chances_of_none(any_piece, stands[None])[0, 0])
    falls = np.concatenate(parts, axis=-1)
    return float(Year.of(results, weights_of(results, None)).total(falls).mean())


def answer(results: xr.Dataset) -> Iterator[Fact]:
    """Yield the answer, the most important fact first."""
    at, _ = reference_law(results)
    of_law = results.isel(model=at)
    whole = of_law.sel(place=BUILDING)
    more = {"pieces": pieces_at(results, BUILDING), "years": YEARS, "edges": fallen_word(results) != "overturned"}
    if "branch" in results.dims:
        yield _spread("building.over_branches", building_spread(results, "any_rate", BUILDING), more)
    elif "any_rate" in of_law:
        rate = range_of(whole, "any_rate")
        if rate.value > 0.0:
            yield Fact("building.any_fall", *rate, more=more)
        else:
            yield Fact("building.nothing_falls", 0.0, upper=most_rate(results), more=more)
    else:
        yield from _at_level(results, whole, more)
    yield from _afterwards(results, float(whole.get("any_rate", math.nan)))
    yield from _law_range(results, at)


def details(results: xr.Dataset) -> Iterator[Fact]:
    """Yield annual loss, downtime and injuries."""
    at, _ = reference_law(results)
    whole, branches = results.isel(model=at).sel(place=BUILDING), "branch" in results.dims
    rate = float(whole.get("any_rate", math.nan))
    for name in AMOUNTS:
        if f"annual_{name}" not in results:
            continue
        years, _ = (1.0, "") if name == "loss" else span(results.isel(model=at)[f"annual_{name}"])
        more = {
            "unit": currency_of(results),
            "years": years,
            "each": math.nan if branches or not rate else float(whole[f"annual_{name}"]) / rate,
            "repair": "cost_median" in results.coords,
            "unstated": name == "injuries" and bool(np.isnan(results["persons_exposed"]).any()),
        }
        if branches:
            yield _spread(f"consequence.{name}", building_spread(results, f"annual_{name}", BUILDING), more)
        else:
            yield Fact(f"consequence.{name}", *amount(whole, f"annual_{name}"), more=more)
    yield from _carried(results)


def _spread(what: str, results: xr.Dataset, more: Mapping[str, object]) -> Fact:
    """Return an annual value over branches: its mean and the ends of nine tenths, with the largest source."""
    low, high = (float(results["epistemic_rate_fractile"].sel(epistemic_fractile=end)) for end in OUTER)
    more = {**more, "branches": results.sizes.get("branch", 0), "largest": sources(results)[:1]}
    return Fact(what, float(results["epistemic_rate"]), low, high, more=more)


def _at_level(results: xr.Dataset, whole: xr.Dataset, more: Mapping[str, object]) -> Iterator[Fact]:
    """Yield the chance of any fall and the number of falls at the study's level."""
    level = float(results.attrs["at_level"])
    at_level = whole.sel(level=level)
    measure = "" if str(results.attrs["im"]) == "scale" else quantity_name(results["level"], str(results.attrs["im"]))
    more = {**more, "measure": measure, "units": str(results["level"].attrs.get("units", "1"))}
    yield Fact("building.any_at_level", *range_of(at_level, "any_probability"), level=level, more=more)
    yield Fact("building.number_at_level", *amount(at_level, "number_mean"), level=level, more=more)


def _afterwards(results: xr.Dataset, now: float) -> Iterator[Fact]:
    """Yield the effect of the recommended work: the lines, their cost, and the rate of any fall afterwards."""
    pieces = pieces_of(results, reference_law(results)[0])
    lines = recommended_lines(results)
    free = [piece for piece in pieces if not piece.held]
    if lines:
        safe = [piece for piece in lines if piece.safety]
        safety = str(results.attrs.get("safety", JOINT.join(SAFETY))).split(JOINT)
        dangers = dict.fromkeys(word for piece in safe for word in piece.consequences if word in safety)
        falls, all_falls = (
            math.fsum(piece.number * piece.chance.value for piece in some if piece.safety) for some in (lines, free)
        )
        saved = [piece.saving.value for piece in lines if math.isfinite(piece.saving.value)]
        more = {
            "now": now,
            "years": YEARS,
            "cost": math.fsum(piece.cost_of_all for piece in lines),
            "currency": currency_of(results),
            "duty": all(piece.recommendation == DUTY for piece in lines),
            "code": str(results.attrs.get("code", "")),
            "dangers": tuple(dangers),
            "share_safe": falls / all_falls if all_falls > 0.0 else math.nan,
            "saved": math.fsum(saved) if saved else math.nan,
            "number": sum(piece.number for piece in lines),
        }
        after = rate_without(results, [piece.item for piece in lines])
        if math.isfinite(after) or saved or falls > 0.0:
            names = tuple(block_title(piece.item) for piece in lines)
            yield Fact("anchoring.after", after, names=names, more=more)
    rest = [piece for piece in free if piece not in lines]
    little = [piece for piece in rest if piece.recommendation in LITTLE]
    if little and len(little) == len(rest):
        more = {
            "number": sum(piece.number for piece in little),
            "unstated": sum(piece.number for piece in little if not piece.stated),
            "others": bool(lines),
            "priced": all(math.isfinite(piece.cost) for piece in little),
        }
        yield Fact("anchoring.rest_repays_nothing", more=more)
    if free and not lines and not little:
        yield Fact("anchoring.nothing_advised")
    if not free:
        yield Fact("anchoring.all_anchored")


def _law_range(results: xr.Dataset, at: int) -> Iterator[Fact]:
    """Yield the rate of any fall, or the number of falls, under the other laws if they disagree."""
    if "branch" in results.dims or results.sizes["model"] == 1:
        return
    yearly = "any_rate" in results
    whole = results.sel(place=BUILDING)
    values = whole["any_rate" if yearly else "number_mean"]
    of_laws = (values if yearly else values.sel(level=float(results.attrs["at_level"]))).values
    others = np.delete(of_laws, at)
    others = others[np.isfinite(others) & (others > 0.0)]
    known = [float(value) for value in (of_laws[at], *others.tolist()) if value > 0.0]
    if len(known) > 1 and max(known) >= DISAGREE * min(known):
        throughout = damped_throughout(results, of_laws < of_laws[at] / DISAGREE)
        more = {"laws": results.sizes["model"] - 1, "yearly": yearly, "throughout": throughout}
        yield Fact("law.building_range", lower=float(others.min()), upper=float(others.max()), more=more)


def actions(results: xr.Dataset) -> Iterator[Fact]:
    """Yield the recommended actions, the most important first."""
    at, _ = reference_law(results)
    pieces = pieces_of(results, at)
    lines = recommended_lines(results)
    money = {"currency": currency_of(results), "budget": float(results.attrs.get("budget", math.nan))}
    if lines:
        forces = any(piece.code is not None and math.isfinite(piece.code.demand) for piece in lines)
        kits = tuple((piece.item, piece.meant.kit if piece.meant else "") for piece in lines if piece.tried)
        # (Eurocode 8 asks for a verification of the element and its fixing, ASCE 7 for the fixing)
        verified = str(results.attrs.get("code")).startswith("EN 1998")
        more = {"number": sum(piece.number for piece in lines), "forces": forces, "verified": verified, "kits": kits}
        # (a budget of kits alone is not of these lines)
        of_lines = money if "budget_chosen" in results else {**money, "budget": math.nan}
        yield Fact("anchoring.lines", names=_names(lines), more={**more, **of_lines})
        duty = [piece for piece in lines if piece.recommendation == DUTY]
        if duty and len(duty) < len(lines):  # (of all lines the answer says it)
            yield Fact(
                "code.required", names=_names(duty), more={"code": str(results.attrs["code"]), "verified": verified}
            )
    yield from _code(pieces, results, money)
    yield from _budget(pieces, results, at, money)
    yield from _kit_sets(results, pieces, money)
    yield from _kits(results, pieces)
    asked = [piece for piece in pieces if _missing(piece) == UNSTATED_DANGER]
    unstated = [piece for piece in pieces if piece in asked or not (piece.stated or piece.held)]
    if unstated:
        more = {"code": str(results.attrs["code"]) if asked else ""}
        yield Fact("anchoring.unstated", sum(piece.number for piece in unstated), names=_names(unstated), more=more)
    for word, what in ((UNPRICED, "anchoring.unpriced"), (UNVALUED, "anchoring.unvalued")):
        if missing := [piece for piece in pieces if piece.recommendation == word]:
            yield Fact(what, names=_names(missing))
    yield from _supports(results)
    yield from _castors(results)
    held = [piece for piece in pieces if piece.held and piece.recommendation == ANCHORED]
    if held:
        yield Fact("anchoring.inspect", sum(piece.number for piece in held), names=_names(held))
    yield from _undecided(pieces, results)
    for word, what in ((OUTSIDE, "anchoring.outside"), (INDICATIVE, "anchoring.indicative")):
        if named := [piece for piece in pieces if piece.recommendation == word]:
            people = _names([piece for piece in named if piece.safety])
            yield Fact(what, names=_names(named), more={"people": people})
    if "code" not in results.attrs:
        yield Fact("code.not_checked")


def _names(pieces: Sequence[Piece]) -> tuple[str, ...]:
    return tuple(f"“{piece.item}” ({floor_name(piece.floor)})" for piece in pieces)


def _code(pieces: Sequence[Piece], results: xr.Dataset, money: Mapping[str, object]) -> Iterator[Fact]:
    """Yield the requirements of the building code beyond the recommended lines."""
    if "code" not in results.attrs:
        return
    weak = [piece for piece in pieces if piece.recommendation == WEAK]
    if weak:
        yield Fact("code.weak_anchors", names=_names(weak), more={"held": all(piece.held for piece in weak)})
    left = [piece for piece in pieces if piece.recommendation == DUTY and piece.chosen is False]
    for what, some in (
        ("code.beyond_budget", [piece for piece in left if math.isfinite(piece.cost)]),
        ("code.unpriced", [piece for piece in left if not math.isfinite(piece.cost)]),
    ):
        if some:
            cost = math.fsum(piece.cost_of_all for piece in some)
            yield Fact(what, cost, names=_names(some), more=money)
    unknown = [piece for piece in pieces if _missing(piece) not in ("", UNSTATED_DANGER)]
    if unknown:
        why = tuple(dict.fromkeys(map(_missing, unknown)))
        yield Fact("code.unchecked", names=_names(unknown), more={"why": why})


def _missing(piece: Piece) -> str:
    """Return the missing data of the check of a piece by the code; '' if there is a check."""
    return "" if piece.code is None else piece.code.missing


def _budget(pieces: Sequence[Piece], results: xr.Dataset, at: int, money: Mapping[str, object]) -> Iterator[Fact]:
    """Yield the pieces outside the budget, and the remaining money."""
    if "budget_chosen" not in results:
        return
    chosen = [piece for piece in pieces if piece.chosen]
    gap = float(results["budget_gap"].values[at])
    over = float(results.attrs["budget"]) - math.fsum(piece.cost_of_all for piece in chosen)
    wanted = (REDUCES, SAFER, WORTH)
    dear = [
        piece for piece in pieces if not piece.chosen and piece.recommendation in wanted and piece.cost_of_all > over
    ]
    if not chosen and not all(piece.held for piece in pieces):
        yield Fact("budget.buys_nothing", more=money)
    elif dear and gap == 0.0:
        costs = [piece.cost_of_all for piece in dear]
        yield Fact("budget.beyond", over, names=_names(dear), more={**money, "costs": costs})
    if gap > 0.0:
        yield Fact("budget.not_optimal", gap)


def _kit_sets(results: xr.Dataset, pieces: Sequence[Piece], money: Mapping[str, object]) -> Iterator[Fact]:
    """Yield the kits to buy for the study's budget, and the cheapest that meet its target."""
    of_law = results.isel(model=reference_law(results)[0])
    yearly = "rate" in results
    for name in ("budget", "target"):
        if f"{name}_kit" not in results:
            continue
        target = json.loads(str(results.attrs.get("target", "{}")))
        more = {**money, "target": target, "yearly": yearly}
        if name == "target" and not bool(of_law["target_met"]):
            yield Fact("kit.target_missed", more=more)
            continue
        kits = {
            str(item): str(kit) for item, kit in zip(of_law["block"].values, of_law[f"{name}_kit"].values, strict=True)
        }
        pairs = tuple((kits[piece.item], piece.item) for piece in pieces if kits[piece.item])
        surely = [of_law[f"kit_{side}falls_saved_lower"] for side in ("", "front_")]
        shown = {
            item for item, kit in kits.items() if kit and any(least.sel(block=item, kit=kit) > 0.0 for least in surely)
        }
        falls = of_law if yearly else of_law.sel(level=float(of_law.attrs["at_level"]))
        now = [falls[f"{side}rate" if yearly else f"{side}probability"] * of_law["count"] for side in ("", "front_")]
        more |= {"pairs": pairs, "unclear": tuple(item for item, kit in kits.items() if kit and item not in shown)}
        more["now"] = [math.fsum(number.values.ravel()) for number in now]
        more["then"] = [float(of_law[f"{name}_{side}falls"]) for side in ("", "front_")]
        yield Fact(f"kit.for_{name}", float(of_law[f"{name}_cost"]), more=more)
        if name == "budget":
            saved, lower = (of_law[f"kit_falls_saved{end}"].transpose("block", "kit") for end in ("", "_lower"))
            open_ = ((saved > 0.0) & (lower <= 0.0)).any("kit") & ~(lower > 0.0).any("kit")
            names = tuple(f"“{item}”" for item, kit in kits.items() if not kit and bool(open_.sel(block=item)))
            if names:
                yield Fact("kit.too_few_motions", number_of_motions(results), names=names)
        if float(of_law[f"{name}_gap"]) > 0.0:
            yield Fact("budget.not_optimal", float(of_law[f"{name}_gap"]))


def _kits(results: xr.Dataset, pieces: Sequence[Piece]) -> Iterator[Fact]:
    """Yield the kits that prevent nothing measurable, or too little, or cause more falls, and of which pieces."""
    motions = number_of_motions(results) if "kit_falls" in results else 0
    for kit in dict.fromkeys(tried.kit for piece in pieces for tried in piece.tried):
        for word, what in ((WORSE, "kit.worse"), (NOTHING, "kit.no_effect"), (TOO_LITTLE, "kit.too_weak")):
            effects = [
                (piece, tried) for piece in pieces for tried in piece.tried if (tried.kit, tried.effect) == (kit, word)
            ]
            if effects:
                shares = [tried.share.value for _, tried in effects]
                names = _names([piece for piece, _ in effects])
                more = {"kit": kit, "motions": motions}
                yield Fact(what, lower=min(shares), upper=max(shares), names=names, more=more)


def _supports(results: xr.Dataset) -> Iterator[Fact]:
    """Yield facts on pieces on others that slide or rock, and on pieces that fall with their support."""
    if "stands_on" not in results.coords:
        return
    moving = on_moving_supports(results)
    shares = shares_with_moving_supports(results) if moving.any() else np.zeros(moving.size)
    for i in np.flatnonzero(moving).tolist():
        names = (f"“{results['stands_on'].values[i]}”", f"“{results['block'].values[i]}”")
        yield Fact("support.fix_first", float(shares[i]), names=names)


def _carried(results: xr.Dataset) -> Iterator[Fact]:
    """Yield the frequency of falls of pieces that carry others, and of the latter."""
    if "stands_on" not in results.coords or "rate" not in results:
        return
    on = results["stands_on"].values
    for piece in pieces_of(results, reference_law(results)[0]):
        if piece.item in on and not piece.held and piece.chance.value > 0.0:
            names = (f"“{item}”" for item in (piece.item, *results["block"].values[on == piece.item]))
            yield Fact("support.carries", piece.chance.value, names=tuple(names))


def _castors(results: xr.Dataset) -> Iterator[Fact]:
    """Yield the recommendations for pieces on castors."""
    contacts, free = np.array(contacts_of(results)), ~results["anchored"].values.astype(bool)
    for contact, what in ((ROLLING, "support.lock_castors"), (LOCKED, "support.check_brakes")):
        names = tuple(f"“{item}”" for item in results["block"].values[free & (contacts == contact)])
        if names:
            yield Fact(what, names=names)


def _undecided(pieces: Sequence[Piece], results: xr.Dataset) -> Iterator[Fact]:
    """Yield the pieces for which it is not known if anchoring is worth its cost."""
    open_ = [piece for piece in pieces if piece.recommendation == UNRESOLVED]
    seen = [piece for piece in open_ if piece.chance.value > 0.0 and not piece.safety]
    never = [piece for piece in open_ if piece.chance.value == 0.0]
    if seen:
        yield Fact("anchoring.unresolved", YEARS, names=_names(seen))
    if never:
        more = {"most": at_most(results), "years": YEARS if "level_weight" in results else 0.0}
        yield Fact("anchoring.never_seen", names=_names(never), more=more)
