"""The summary at the top of a report: the answer in plain words for the owner of the contents."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...core.aliases import Array
from ...core.doubts import first_of
from ...core.wording import (
    about_percent,
    about_years,
    chances_between,
    confidence_text,
    currency_of,
    interval_text,
    two_digits,
    with_article,
    years_text,
)
from ...fragility.fitting.states import ALL, OK
from ..buildings.assessment import BUILDING
from ..buildings.notes import anchored_text
from ..plan.piece_classes import TESTS
from ..region.rows import event_sentences
from ..tables.assessment import fallen_word, pieces_at, span
from ..tables.breaks import break_sentences
from ..tables.gains import gain_sentences
from ..tables.item_slides import falling_off_sentences, item_trip_sentences, years_of
from ..tables.sensitivity import sensitivity_sentences
from ..tables.slides import edge_sentences, trip_sentences
from ..text.block_order import HALF, RATE, places
from ..text.curve_notes import action_of, reached_of, state_in, verb_in
from ..text.one_side import falling_both_ways
from ..text.precision import FITTED_RATE
from ..text.reached import NO_LEVEL, within_levels
from ..text.spread import (
    amount_range,
    amount_sentence,
    and_model,
    building_spread,
    chance_range,
    model_range,
    model_range_sentences,
    range_text,
    rates_of_consequences,
    sample_range,
    spread_sentence,
    whole_range,
    years_range,
)
from ..text.words import (
    axis_of,
    block_title,
    display_unit,
    floor_name,
    is_one_piece,
    level_text,
    quantity_name,
    reference_law,
    that_has,
)
from .answers import largest_share
from .crossed import case_name, crossed, crossing_laws
from .extrapolation import part_sentence
from .law_choice import choice_of_law
from .results_file import without_motions
from .validity import resonant_laws

NEVER_HALF = "fewer than half of the runs do so at any level"
"""Why there is no level at which half fall where a curve exists."""
RARE = 0.1
"""Probability of overturning, rare but still relevant to an owner, at whose level the summary also gives counts."""
YEARS = 50.0
"""Years for which chances are given where the study names no time."""
DISAGREE = 1.1
"""Ratio of the results of two laws from which the summary says how far they lie apart."""
THROUGHOUT = ("giannini-masiani", "makris-konstantinidis", "vassiliou", "viscous")
"""Laws whose damping acts throughout the motion, and not near the upright position alone."""
MIN_LAWS = 2
MOST_CONSEQUENCES = 3
"""Largest number of consequences that the summary names."""
SOURCES = {
    "alpha": "the slenderness",
    "alpha_factor": "the slenderness",
    "R": "the size",
    "R_factor": "the size",
    "inertia_factor": "the moment of inertia",
    "restraint_strength": "the strength of the restraint",
    "restraint_stiffness": "the stiffness of the restraint",
    "e": "the restitution",
    "restitution_factor": "the restitution",
    "delta": "the width of the zone of damping",
    "zeta": "the damping ratio",
    "law": "the damping law",
    "model": "the damping law",
    "sample": "the properties of the piece",
    "cm_height": "the height of the mass centre",
    "motion": "the differences between motions",
}
"""Uncertain inputs in plain words, by their names."""


def plain_answer(results: xr.Dataset) -> list[str]:
    """Return the answer of a study's results, of any kind, in a few plain sentences."""
    return list(_PLAIN[str(results.attrs["kind"])](within_levels(results)))


def _curves(results: xr.Dataset) -> Iterator[str]:
    """Yield sentences on the block that falls first, under the reference law."""
    at, _ = reference_law(results)
    verb = verb_in(results)
    small = without_motions(results).isel(model=at)
    cases = small["half_level"].transpose("block", ...)
    status = small["status"].transpose(*cases.dims).values.ravel()
    # (a curve that never reaches 1/2 has a rate, and an infinite level of half)
    curved = not np.isnan(cases.values).all()
    by = RATE if curved and "rate" in small and np.isfinite(small["rate"].values).any() else HALF
    if by == HALF and not np.isfinite(cases.values).any():
        status = np.where(status == OK, NO_LEVEL[OK], status)
        status = np.where(cases.values.ravel() == np.inf, NEVER_HALF, status)
        yield f"The runs do not show how strong the shaking must be: {_missing_curves(status)}."
        yield from _at_the_strongest(results, small, cases, verb)
        return
    always = int((status == ALL).sum())
    if always:
        fallen = np.flatnonzero(status == ALL)
        row, *rest = np.unravel_index(fallen[0], cases.shape)
        floor = f" on {floor_name(small['floor'][rest[0]].item())}" if rest else ""
        label = f"“{block_title(str(small['block'][row].item()))}”{floor}"
        always_fallen = (
            label if fallen.size == 1 else f"{fallen.size:,} of {status.size:,} ({label} and {fallen.size - 1:,} more)"
        )
        yield f"{always_fallen} {reached_of(state_in(results))} in every run, even in the weakest shaking."
    order = np.argsort(places(results, by).values.ravel())
    # (by rate, blocks that fell in every run come after those that have a rate)
    at_first = np.unravel_index(order[always if by == HALF else 0], cases.shape)
    first = small.isel({str(dim): int(i) for dim, i in zip(cases.dims, at_first, strict=True)})
    name = f"“{block_title(str(first['block'].item()))}”"
    where = f" on {floor_name(first['floor'].item())}" if "floor" in small.dims else ""
    if cases.size > 1:
        ranked = order[always if by == HALF else 0 :]
        found = list(crossed(results, small, cases, ranked, verb))
        none_first = any(of_first for of_first, _ in found)
        if not none_first:
            yield _most_vulnerable(f"{name}{where}", small, cases, ranked, by, always)
        yield from (said for _, said in found)
        if none_first and by == RATE:
            yield f"At this site, over all levels of shaking, {name}{where} is expected to do so most often."
        yield from _other_falls(results, verb)
    yield from _hundred_earthquakes(first, results, f"{name}{where}", verb)
    most = largest_share(first, SOURCES) if str(results.attrs["kind"]) == "uncertainty" else None
    if most is not None:
        wider = " more widely than this level" if np.isfinite(first["half_level"]) else ""
        yield (
            f"The shaking that overturns the piece in a single earthquake scatters{wider}; the largest contribution to "
            f"that scatter, {about_percent(most[1])}, comes from {most[0]}."
        )
    if "epistemic_rate" in first:
        beta = float(results.attrs.get("modelling_dispersion", 0.0))
        spread = str(results.attrs.get("modelling")) == "fractiles"
        yield spread_sentence(first, f"{name}{where}", verb, beta if spread else 0.0)
        if beta and not spread:
            yield f"Each of these rates is the mean over a modelling uncertainty of {beta:g}."
    elif "risk_probability" in first:
        yield _chance_in_years(first, f"{name}{where}", verb, float(results.attrs["years"]), _held(results))
        yield from part_sentence(first, "this chance")
    yield from event_sentences(results)
    yield from _tests(results)
    every = without_motions(results).isel({str(dim): int(i) for dim, i in zip(cases.dims, at_first, strict=True)})
    yield from model_range_sentences(results, "half_level")
    yield from _other_laws(every, results, f"{name}{where}", verb)
    yield from gain_sentences(results)
    yield from break_sentences(results)
    yield from edge_sentences(results)
    yield from trip_sentences(results)


def _at_the_strongest(results: xr.Dataset, small: xr.Dataset, cases: xr.DataArray, verb: str) -> Iterator[str]:
    """Yield how many of 100 earthquakes at the highest level bring down what falls first, if half fall at none."""
    reached = np.flatnonzero(cases.values.ravel() == np.inf)
    if not reached.size:
        return
    order = np.argsort(places(results).values.ravel(), kind="stable")
    first = next(one for one in order.tolist() if one in reached)
    at = np.unravel_index(first, cases.shape)
    one = small.isel({str(dim): int(i) for dim, i in zip(cases.dims, at, strict=True)})
    where = f" on {floor_name(one['floor'].item())}" if "floor" in small.dims else ""
    yield from _hundred_earthquakes(one, results, f"“{block_title(str(one['block'].item()))}”{where}", verb)


def _most_vulnerable(
    name: str, small: xr.Dataset, cases: xr.DataArray, order: NDArray[np.int64], by: str, always: int
) -> str:
    """Return which of the cases (`order`) falls first, with those whose intervals overlap with its own."""
    number = order.size if by == HALF else cases.size - always
    many = "combinations of piece and floor" if "floor" in small.dims else "pieces"
    if "floor" not in small.dims and is_one_piece(small):
        many = "arrangements of the same piece"
    of = f"the other {number:,}" if always else f"the {number:,} {many}"
    most = "the most vulnerable" if number > 2 else "the more vulnerable"
    low, high = (small[f"{by}_{end}"].transpose(*cases.dims).values.ravel() for end in ("lower", "upper"))
    first, *rest = order.tolist()
    with np.errstate(invalid="ignore"):
        close = [one for one in rest if (low[one] <= high[first] if by == HALF else high[one] >= low[first])]
    if not close:
        return f"{name} is {most} of {of}."
    if len(close) == len(rest) and len(rest) > 1:
        return (
            f"By these motions {name} is the most vulnerable of {of}, but the intervals of all others overlap with its "
            "own."
        )
    named = [case_name(small, cases, tuple(int(i) for i in np.unravel_index(one, cases.shape))) for one in close]
    overlap = "interval overlaps" if len(close) == 1 else "intervals overlap"
    return (
        f"By these motions {name} is {most} of {of}, but not with certainty: the {overlap} with that of "
        f"{first_of(named)}."
        if len(close) > 1
        else f"By these motions {name} is {most} of {of}, but not with certainty: its {overlap} with that "
        f"of {named[0]}."
    )


def _other_falls(results: xr.Dataset, verb: str) -> Iterator[str]:
    """Yield which pieces may fall the other way as well, where falls to one side alone are counted."""
    either = falling_both_ways(results)
    named = [f"“{block_title(str(one))}”" for one in results["block"].values if str(one) in either]
    if named and len(named) < results.sizes["block"]:
        side = "forward" if "forward" in verb else "backward"
        yield (
            f"Only falls {side} are compared. {first_of(named)} may fall the other way as well, which "
            f"{'is' if len(named) == 1 else 'are'} not counted."
        )


def _missing_curves(status: NDArray[np.object_]) -> str:
    """Return the reasons why there is no curve, each with its count."""
    words, numbers = np.unique(status.astype(str), return_counts=True)
    if len(words) == 1:
        return str(words[0])
    return ", ".join(f"{word} ({n:,} of {status.size:,})" for word, n in zip(words, numbers, strict=True))


def _hundred_earthquakes(first: xr.Dataset, results: xr.Dataset, name: str, verb: str) -> Iterator[str]:
    """Yield the number of overturnings in 100 earthquakes: where few are observed, and where half are."""
    axis = axis_of(results)
    scale, unit = display_unit(axis)
    unit = f" {unit}" if unit else ""
    measure = quantity_name(axis)
    half, low, high = (float(first[f"half_level{end}"]) / scale for end in ("", "_lower", "_upper"))
    sure = confidence_text(results)
    if not 0.0 < half < math.inf:
        if "probability" in first and "level" in first["probability"].dims:
            at, which = (0, "weakest") if half == 0.0 else (-1, "strongest")
            end = first.isel(level=at)
            sampled = "sample_probability" in first
            ends = sample_range(end, "sample_probability") if sampled else (end["lower"], end["upper"])
            few, least, most = (round(100.0 * float(share)) for share in (end["probability"], *ends))
            held = "" if sampled else f" ({and_model(f'{least} to {most}', end, 'probability', whole_range, 100.0)})"
            level = f"{two_digits(float(results['level'][at]) / scale)}{unit}"
            yield (
                f"Of 100 earthquakes with {with_article(measure)} of {level}, the {which} shaking that was run, about "
                f"{few}{held} would {action_of(verb, name)}. "
            ) + (
                f"Because the properties of the piece are uncertain, this number may lie between {least} and {most} "
                "(90 % range)."
                if sampled
                else f"The first range in brackets is a {sure} interval for the limited number of motions."
            )
        return
    if math.isfinite(high) or low > 0.0:
        known = interval_text(low or -math.inf, high, two_digits)
    else:
        known = "these motions do not show how precisely that level is known"
    which = "The first range" if model_range(first, "half_level") else "The range"
    at_half = f"{two_digits(half)}{unit} ({and_model(known, first, 'half_level', amount_range, 1.0 / scale)})"
    either = str(first["block"].item()) in falling_both_ways(results)
    if "sample_median" in first:
        yield (
            f"Of 100 earthquakes with {with_article(measure)} of {two_digits(half)}{unit}, about 50 would "
            f"{action_of(verb, name)}. {_over_properties(first, scale, unit)} The {sure} interval for the limited "
            f"number of motions is {interval_text(low or -math.inf, high, two_digits)}{unit}."
        )
        return
    rare = _rare(first, results["level"].values, half * scale) if {"probability", "lower"} <= {*first} else None
    if rare is None:
        yield (
            f"Of 100 earthquakes with {with_article(measure)} of {at_half}, about 50 would {action_of(verb, name)}. "
            f"{which} in brackets is a {sure} interval for the limited number of motions."
        )
        return
    few, least, most = (round(100.0 * float(first[end][rare])) for end in ("probability", "lower", "upper"))
    weak = f"{two_digits(float(results['level'][rare]) / scale)}{unit}"
    range_of_few = and_model(f"{least} to {most}", first.isel(level=rare), "probability", whole_range, 100.0)
    if either:
        yield (
            f"Of 100 earthquakes with {with_article(measure)} of {weak}, about {few} ({range_of_few}) would "
            f"{action_of(verb, name)}; it may fall the other way as well, and such falls are not counted. "
            f"{which} in brackets is a {sure} interval for the limited number of motions."
        )
        return
    yield (
        f"Of 100 earthquakes with {with_article(measure)} of {weak}, about {few} ({range_of_few}) would "
        f"{action_of(verb, name)}; at {at_half} about half of them would. {which}s in brackets are {sure} "
        "intervals for the limited number of motions."
    )


def _over_properties(first: xr.Dataset, scale: float, unit: str) -> str:
    """Return the sentence on the levels at which half of the motions overturn nine tenths of a block's samples."""
    low, high = (end / scale for end in sample_range(first))
    if not math.isfinite(low):
        return "How far this level depends on the uncertain properties of the piece could not be determined."
    ends = f"above {two_digits(low)}" if math.isinf(high) else f"between {two_digits(low)} and {two_digits(high)}"
    return f"Because the properties of the piece are uncertain, this level may lie {ends}{unit} (90 % range)."


def _other_laws(every: xr.Dataset, results: xr.Dataset, name: str, verb: str) -> Iterator[str]:
    """Yield what the other laws say of a block where laws disagree: the chance, or the level without a hazard."""
    if "branch" in results.dims or every.sizes["model"] == 1:
        return  # (branches hold the choice of law)
    at, _ = reference_law(results)
    write: Callable[[float], str] = two_digits
    if "risk_probability" in every:
        values = every["risk_probability"].values
        what = f"the chance that {name} {verb} within {years_text(float(results.attrs['years']))} is"
        write, unit = about_percent, ""
    else:
        scale, unit = display_unit(axis_of(results))
        values, unit = every["half_level"].values / scale, f" {unit}" if unit else ""
        what = (
            f"about half of the earthquakes would {action_of(verb, name)} at "
            f"{with_article(quantity_name(axis_of(results)))} of"
        )
    others = np.delete(values, at)
    others = others[np.isfinite(others) & (others > 0.0)]
    text = _where_laws_disagree(float(values[at]), others, write)
    crosses, choice = crossing_laws(every, results, name, verb), choice_of_law(results)
    if text:
        with np.errstate(invalid="ignore"):
            less = values < values[at] / DISAGREE if "risk_probability" in every else values > values[at] * DISAGREE
        why = " ".join(filter(None, (_why_laws_differ(results, less).strip(), crosses, choice)))
        yield f"{_under_others(every.sizes['model'] - 1)}, {what} {text}{unit}. {why}".rstrip()
    elif crosses or choice:
        yield " ".join(filter(None, (crosses, choice)))


def _under_others(number: int) -> str:
    laws = "the other law" if number == 1 else f"the other {number} laws"
    return f"The answer depends on the damping law that is assumed: under {laws} of this study"


def _where_laws_disagree(value: float, others: Array, write: Callable[[float], str]) -> str:
    """Return the range of what other laws give, '' where no law differs notably from another."""
    every = [one for one in (value, *others.tolist()) if math.isfinite(one) and one > 0.0]
    if not others.size or len(every) < MIN_LAWS or max(every) < DISAGREE * min(every):
        return ""
    return " to ".join(dict.fromkeys(write(float(end)) for end in (others.min(), others.max())))


def _why_laws_differ(results: xr.Dataset, milder: NDArray[np.bool_]) -> str:
    """Return the remarks on why other laws differ: pieces that vibrate at rest, and damping throughout the motion."""
    return f"{_elastic(results)}{_damped_throughout(results, milder)}"


def _choice(results: xr.Dataset) -> str:
    """Return which law to use, with a space before it; '' where there is no choice."""
    said = choice_of_law(results)
    return f" {said}" if said else ""


def _damped_throughout(results: xr.Dataset, milder: NDArray[np.bool_]) -> str:
    """Return the remark on laws that dissipate energy throughout the motion, where these need stronger shaking."""
    law = results.coords.get("law")
    if law is None or law.dims != ("model",):
        return ""
    number = int(np.sum(milder & np.isin(law.values.astype(str), THROUGHOUT)))
    if not number:
        return ""
    others = results.sizes["model"] - 1
    some = "One of them dissipates" if number == 1 else f"{number} of them dissipate"
    some = "That law dissipates" if others == 1 else some
    return (
        f" {some} energy throughout the motion, and more of it than impacts do, so that stronger shaking is needed to "
        "overturn a piece."
    )


def _elastic(results: xr.Dataset) -> str:
    """Return the remark that some of the other laws let a piece vibrate where a real one stands still."""
    others = [i for i in range(results.sizes["model"]) if i != reference_law(results)[0]]
    number = len(resonant_laws(results, others))
    if not number:
        return ""
    several = "One of these laws lets" if number == 1 else f"{number} of these laws let"
    some = "That law lets" if len(others) == 1 else several
    return (
        f" {some} a standing piece vibrate elastically, so that it begins to rock in weaker shaking than a rigid piece "
        "does."
    )


def _rare(first: xr.Dataset, levels: Array, half: float) -> int | None:
    """Return the position of the level below that of half whose observed share is nearest a tenth; None without any."""
    seen = first["probability"].values
    found = np.flatnonzero((seen > 0.0) & (seen < 0.5) & (levels < half))
    return int(found[np.abs(np.log(seen[found] / RARE)).argmin()]) if found.size else None


def _chance_in_years(first: xr.Dataset, name: str, verb: str, years: float, held: str) -> str:
    chance, low, high = (float(first[f"risk_probability{end}"]) for end in ("", "_lower", "_upper"))
    if not np.isfinite(chance):
        if low > 0.0:
            text = f"The chance that {name} {verb} within {years_text(years)} is at least {about_percent(low)}"
            return f"{text}. Levels at which it stands would bound it from above."
        why = "too few of the runs show it" if FITTED_RATE in first else "there is no curve"
        return f"How often that happens cannot be said, because {why}."
    said = f"The chance that {name} {verb} within {years_text(years)} is about {about_percent(chance)}"
    if low == high:
        modelled = and_model("", first, "risk_probability")
        return f"{said} ({modelled})." if modelled else f"{said}."
    if math.isnan(low):
        modelled = and_model("", first, "risk_probability")
        said += f" ({modelled})" if modelled else ""
        return f"{said}, but these motions do not show how precisely that is known.{_second_opinion(first)}"
    return (
        f"{said} ({and_model(chances_between(low, high, about_percent), first, 'risk_probability')}). The first range "
        f"reflects only the limited number of motions; {held}, and the damping law and the hazard curve are taken as "
        f"correct.{_second_opinion(first)}"
    )


def _second_opinion(first: xr.Dataset) -> str:
    """Return what the fitted curve says of a chance that is without a form of curve; empty where it is the curve's."""
    if f"{FITTED_RATE}_lower" not in first:
        return ""
    chance, apart = float(first["fitted_risk_probability"]), float(first["rate_misfit"])
    if not math.isfinite(chance):
        return ""
    agrees = (
        "differs by more than the limited number of motions explains: that curve has another form than the runs"
        if apart
        else "agrees within the error"
    )
    return (
        " The chance is counted from the runs, without a form of fragility curve; the fitted curve would give "
        f"{about_percent(chance)}, which {agrees}."
    )


def _building(results: xr.Dataset) -> Iterator[str]:
    """Yield sentences on the contents of a building, under the reference law."""
    at, _ = reference_law(results)
    one = results.isel(model=at).sel(place=BUILDING)
    pieces = pieces_at(results, BUILDING)
    sure = f"{confidence_text(results)} interval"
    branches = "branch" in results.dims
    money = f" {currency_of(results)}".rstrip()
    verb = "overturns" if fallen_word(results) == "overturned" else "overturns or falls off an edge"
    if branches:
        beta = float(results.attrs.get("modelling_dispersion", 0.0))
        held = beta if str(results.attrs.get("modelling")) == "fractiles" else 0.0
        whole = building_spread(results, "any_rate", BUILDING)
        yield spread_sentence(whole, "At least one piece in this building", verb, held)
    elif "any_rate" in one:
        rate, low, high = (float(one[f"any_rate{end}"]) for end in ("", "_lower", "_upper"))
        if rate > 0.0:
            chance, *ends = (-math.expm1(-YEARS * each) for each in (rate, low, high))
            chances = and_model(chance_range(ends[0], ends[1]), one, "any_rate", _chances_range)
            yield (
                f"At least one piece in this building {verb} about once in {about_years(rate)} years "
                f"({and_model(years_of(high, low), one, 'any_rate', years_range)}), which is a probability of about "
                f"{about_percent(chance)} ({chances}) in {YEARS:g} years."
            )
            rates = results["any_rate"].sel(place=BUILDING).values
            others = np.delete(rates, at)
            others = others[np.isfinite(others) & (others > 0.0)][::-1]
            text = _where_laws_disagree(1.0 / rate, 1.0 / others, two_digits)
            if text:
                laws = results.sizes["model"] - 1
                why = _why_laws_differ(results, results["any_rate"].sel(place=BUILDING).values < rate / DISAGREE)
                yield f"{_under_others(laws)}, this happens about once in {text} years.{why}{_choice(results)}"
        else:
            yield "Nothing falls under any of the motions."
    else:
        here = one.sel(level=float(results.attrs["at_level"]))
        chance, low, high = (100.0 * float(here[f"any_probability{end}"]) for end in ("", "_lower", "_upper"))
        number, *ends = (float(here[f"number_mean{end}"]) for end in ("", "_lower", "_upper"))
        known = and_model(f"{low:.0f} to {high:.0f}", here, "any_probability", whole_range, 100.0)
        falling = and_model(interval_text(ends[0], ends[1], two_digits), here, "number_mean", amount_range)
        which = "first ranges" if model_range(here, "any_probability") else "ranges"
        does = "overturn something" if verb == "overturns" else "make something overturn or fall off an edge"
        yield (
            f"Of 100 earthquakes {_strength(results)}, about {chance:.0f} ({known}) would {does}, and on average "
            f"{two_digits(number)} ({falling}) of the {pieces:,} pieces that are not anchored would fall ({which} in "
            f"brackets: {sure}s)."
        )
        falls = results["number_mean"].sel(place=BUILDING, level=float(results.attrs["at_level"])).values
        text = _where_laws_disagree(number, np.delete(falls, at), two_digits)
        if text:
            laws = results.sizes["model"] - 1
            why = _why_laws_differ(results, falls < number / DISAGREE)
            yield f"{_under_others(laws)}, on average {text} of them would fall.{why}{_choice(results)}"
    yield from _tests(results)
    if branches and "annual_loss" in one:
        yield amount_sentence(building_spread(results, "annual_loss", BUILDING), "The expected loss", money)
    elif "annual_loss" in one:
        loss, low, high = (float(one[f"annual_loss{end}"]) for end in ("", "_lower", "_upper"))
        interval = and_model(interval_text(low, high, two_digits), one, "annual_loss", amount_range)
        of = "cost of what falls" if "cost_median" in results.coords else "value of what falls"
        yield f"The expected loss (the {of}) is about {two_digits(loss)}{money} a year ({interval})."
    if branches:
        for name, what, unit in (
            ("annual_downtime", "The expected downtime", " days"),
            ("annual_injuries", "The expected number of people injured", ""),
        ):
            if name in one:
                years, words = span(one[name])
                yield amount_sentence(building_spread(results, name, BUILDING), what, unit, years, words)
    if "annual_downtime" in one and not branches:
        years, words = span(one["annual_downtime"])
        days, low, high = (years * float(one[f"annual_downtime{end}"]) for end in ("", "_lower", "_upper"))
        interval = and_model(interval_text(low, high, two_digits), one, "annual_downtime", amount_range, years)
        rate = float(one["any_rate"])
        if rate > 0.0:
            yield (
                "When anything falls, the piece that takes longest to restore is out of use for about "
                f"{two_digits(days / years / rate)} days on average. Averaged over a long time, that is about "
                f"{two_digits(days)} days {words} ({interval})."
            )
    if "annual_injuries" in one and not branches:
        years, words = span(one["annual_injuries"])
        persons, low, high = (years * float(one[f"annual_injuries{end}"]) for end in ("", "_lower", "_upper"))
        interval = and_model(interval_text(low, high, two_digits), one, "annual_injuries", amount_range, years)
        once = f", or one person in {two_digits(years / persons)} years" if persons > 0.0 and years > 1.0 else ""
        some = " Lines that state no persons do not count." * bool(np.isnan(results["persons_exposed"]).any())
        yield f"On average about {two_digits(persons)} people would be injured {words} ({interval}){once}.{some}"
    if branches:
        yield from _consequences_over_branches(results)
    elif "consequence_rate" in one and float(one["consequence_rate"].max()) > 0.0:
        yield from _consequences(results.isel(model=at))
    yield from falling_off_sentences(results)
    yield from item_trip_sentences(results)
    anchored = anchored_text(results)
    if anchored:
        yield f"{anchored[:1].upper()}{anchored[1:]}."
    yield from model_range_sentences(results, "any_rate", "epistemic_any_rate", "any_probability")
    if not branches and "any_rate" in one:
        yield (
            f"All other ranges here are {sure}s that reflect only the limited number of motions; {_held(results)}, and "
            "the damping law and the hazard curve are taken as correct."
        )


def _consequences_over_branches(results: xr.Dataset) -> Iterator[str]:
    """Yield how often the most frequent consequences come about over all branches."""
    rates = rates_of_consequences(results, BUILDING)
    verb = "overturns" if fallen_word(results) == "overturned" else "falls"
    if rates is not None:
        each = [rates.isel(block=k) for k in range(min(MOST_CONSEQUENCES, rates.sizes["block"]))]
        said = [f"{that_has(str(one['block'].item()))} {verb} about once in {range_text(one)}" for one in each]
        yield f"At least one piece {'; one '.join(said)} (90 % ranges over the same combinations)."


def _consequences(here: xr.Dataset) -> Iterator[str]:
    """Yield how often the most frequent consequences come about, and on which floor mainly."""
    whole = here.sel(place=BUILDING)
    order = np.argsort(-whole["consequence_rate"].values, kind="stable")[:MOST_CONSEQUENCES]
    said = []
    verb = "overturns" if fallen_word(here) == "overturned" else "falls"
    for k in order:
        one = whole.isel(consequence=int(k))
        rate, low, high = (float(one[f"consequence_rate{end}"]) for end in ("", "_lower", "_upper"))
        if rate > 0.0:
            floors = here["consequence_rate"].isel(consequence=int(k)).drop_sel(place=BUILDING)
            worst = floors.isel(place=int(floors.values.argmax()))
            mainly = floors.sizes["place"] > 1 and float(worst) > 0.5 * float(floors.sum())
            where = f", mostly on {floor_name(str(worst['place'].item()).removeprefix('floor '))}" if mainly else ""
            interval = and_model(years_of(high, low), one, "consequence_rate", years_range)
            years = f"about once in {about_years(rate)} years ({interval}){where}"
            said.append(f"{that_has(str(one['consequence'].item()))} {verb} {years}")
    yield f"At least one piece {'; one '.join(said)}."


def _chances_range(low: float, high: float) -> str:
    return chance_range(*(-math.expm1(-YEARS * rate) for rate in (low, high)))


def _tests(results: xr.Dataset) -> Iterator[str]:
    """Yield what tests say of the class of pieces that the study names."""
    said = str(results.attrs.get(TESTS, ""))
    if said:
        yield f"{said[0].upper()}{said[1:]}."


def _held(results: xr.Dataset) -> str:
    """Return what rates hold of modelling uncertainty."""
    beta = float(results.attrs.get("modelling_dispersion", 0.0))
    if str(results.attrs.get("modelling")) == "fractiles":
        beta = 0.0
    return (
        f"a modelling uncertainty of {beta:g} is included in the rates themselves"
        if beta
        else "modelling uncertainty is not included"
    )


def _strength(results: xr.Dataset) -> str:
    level = results["level"]
    if str(results.attrs["im"]) == "scale":
        return "like these"
    name = quantity_name(level, str(results.attrs["im"]))
    return f"as strong as {with_article(name)} of {level_text(float(results.attrs['at_level']), level)}"


_PLAIN = {"fragility": _curves, "uncertainty": _curves, "performance": _building, "sensitivity": sensitivity_sentences}
