"""The summary at the top of a report: the answer in plain words for the owner of the contents.

The sentences give counts out of a hundred earthquakes and chances in years, each with its interval, without names of
laws or parameters of curves.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...aliases import Array
from ...fragility.fitting.states import ALL, OVERTURNED, state_name
from ...wording import (
    about_percent,
    about_years,
    chances_between,
    confidence_text,
    currency_of,
    interval_text,
    two_digits,
)
from ..buildings.assessment import BUILDING
from ..buildings.notes import anchored_text
from ..sensitivity.claims import FAILS, HOLDS
from ..tables.assessment import pieces_at, span
from ..tables.gains import gain_sentences
from ..tables.sensitivity import GREEK, claims_of
from ..text.block_order import MEDIAN, RATE, places
from ..text.curve_notes import action_of, reached_of, verb_of
from ..text.one_side import falling_both_ways
from ..text.spread import amount_sentence, building_spread, range_text, rates_of_consequences, spread_sentence
from ..text.words import axis_of, display_unit, floor_name, level_text, quantity_name, reference_law
from .answers import largest_share
from .results_file import without_motions

NEVER_HALF = "fewer than half of the runs do so at any level"
"""Why there is no median where a curve exists (isotonic)."""
RARE = 0.1
"""Probability of overturning, rare but still relevant to an owner, at whose level the summary also gives counts."""
YEARS = 50.0
"""Years for which chances are given where the study names no time."""
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
    "sample": "the properties of the block",
    "cm_height": "the height of the mass centre",
    "motion": "the differences between motions",
}
"""Uncertain inputs in plain words, by their names."""


def plain_answer(results: xr.Dataset) -> list[str]:
    """Return the answer in a few plain sentences.

    Parameters
    ----------
    results : xarray.Dataset
        A study's results, of any kind.

    Returns
    -------
    list of str
    """
    return list(_PLAIN[str(results.attrs["kind"])](results))


def _curves(results: xr.Dataset) -> Iterator[str]:
    """Yield sentences on the block that falls first, under the reference law."""
    at, _ = reference_law(results)
    state = str(results.attrs.get("state", state_name(OVERTURNED)))
    small = without_motions(results).isel(model=at)
    cases = small["median"].transpose("block", ...)
    status = small["status"].transpose(*cases.dims).values.ravel()
    # (a curve that never reaches 1/2 has a rate, and an infinite median)
    curved = not np.isnan(cases.values).all()
    by = RATE if curved and "rate" in small and np.isfinite(small["rate"].values).any() else MEDIAN
    if by == MEDIAN and not np.isfinite(cases.values).any():
        status = np.where(cases.values.ravel() == np.inf, NEVER_HALF, status)
        yield f"The runs do not show how strong the shaking must be: {_missing_curves(status)}."
        return
    always = int((status == ALL).sum())
    if always:
        yield f"{_always_fallen(small, cases, status)} {reached_of(state)} in every run, even in the weakest shaking."
    order = np.argsort(places(results, by).values.ravel())
    # (by rate, blocks that fell in every run come after those that have a rate)
    at_first = np.unravel_index(order[always if by == MEDIAN else 0], cases.shape)
    first = small.isel({str(dim): int(i) for dim, i in zip(cases.dims, at_first, strict=True)})
    name = f"“{first['block'].item()}”"
    where = f" on {floor_name(first['floor'].item())}" if "floor" in small.dims else ""
    verb = verb_of(state)
    if cases.size > 1:
        others = cases.size - always
        of = (
            f"the other {others:,}"
            if always
            else f"the {others:,} {'blocks' if not where else 'combinations of block and floor'}"
        )
        yield f"{name}{where} is the most vulnerable of {of}."
    yield from _hundred_earthquakes(first, results, f"{name}{where}", verb)
    most = largest_share(first, SOURCES) if str(results.attrs["kind"]) == "uncertainty" else None
    if most is not None:
        yield f"The largest contribution to the scatter, {about_percent(most[1])}, comes from {most[0]}."
    if "epistemic_rate" in first:
        beta = float(results.attrs.get("modelling_dispersion", 0.0))
        spread = str(results.attrs.get("modelling")) == "fractiles"
        yield spread_sentence(first, f"{name}{where}", verb, beta if spread else 0.0)
        if beta and not spread:
            yield f"Each of these rates is the mean over a modelling uncertainty of {beta:g}."
    elif "risk_probability" in first:
        yield _chance_in_years(first, f"{name}{where}", verb, float(results.attrs["years"]), _held(results))
    yield from gain_sentences(results)


def _missing_curves(status: NDArray[np.object_]) -> str:
    """Return the reasons why there is no curve, each with its count."""
    words, numbers = np.unique(status.astype(str), return_counts=True)
    if len(words) == 1:
        return str(words[0])
    return ", ".join(f"{word} ({n:,} of {status.size:,})" for word, n in zip(words, numbers, strict=True))


def _always_fallen(small: xr.Dataset, cases: xr.DataArray, status: NDArray[np.object_]) -> str:
    """Return the blocks that fell in every run: the name of the first, and the number of the others."""
    every = np.flatnonzero(status == ALL)
    row, *rest = np.unravel_index(every[0], cases.shape)
    where = f" on {floor_name(small['floor'][rest[0]].item())}" if rest else ""
    name = f"“{small['block'][row].item()}”{where}"
    return name if every.size == 1 else f"{every.size:,} of {status.size:,} ({name} and {every.size - 1:,} more)"


def _hundred_earthquakes(first: xr.Dataset, results: xr.Dataset, name: str, verb: str) -> Iterator[str]:
    """Yield the number of overturnings in 100 earthquakes: at a level where few are observed, and at the median."""
    axis = axis_of(results)
    scale, unit = display_unit(axis)
    unit = f" {unit}" if unit else ""
    measure = quantity_name(axis)
    median, low, high = (float(first[f"median{end}"]) / scale for end in ("", "_lower", "_upper"))
    sure = confidence_text(results)
    if not math.isfinite(median):
        if "probability" in first and "level" in first["probability"].dims:
            few, least, most = (round(100.0 * float(first[end][-1])) for end in ("probability", "lower", "upper"))
            strongest = f"{two_digits(float(results['level'][-1]) / scale)}{unit}"
            yield (
                f"Of 100 earthquakes with a {measure} of {strongest}, the strongest shaking that was run, about {few} "
                f"({least} to {most}) would {action_of(verb, name)}. The range in brackets is a {sure} interval."
            )
        return
    if math.isfinite(high) or low > 0.0:
        known = f" ({interval_text(low, high, two_digits)})"
    else:
        known = " (how well that level is known, these motions do not show)"
    at_median = f"{two_digits(median)}{unit}{known}"
    either = str(first["block"].item()) in falling_both_ways(results)
    rare = _rare(first, results["level"].values, median * scale) if {"probability", "lower"} <= {*first} else None
    if rare is None:
        yield (
            f"Of 100 earthquakes with a {measure} of {at_median}, about 50 would {action_of(verb, name)}. The range in "
            f"brackets is a {sure} interval."
        )
        return
    few, least, most = (round(100.0 * float(first[end][rare])) for end in ("probability", "lower", "upper"))
    weak = f"{two_digits(float(results['level'][rare]) / scale)}{unit}"
    if either:
        yield (
            f"Of 100 earthquakes with a {measure} of {weak}, about {few} ({least} to {most}) would "
            f"{action_of(verb, name)}; it may fall to the other side as well, and such falls are not counted. The "
            f"range in brackets is a {sure} interval."
        )
        return
    yield (
        f"Of 100 earthquakes with a {measure} of {weak}, about {few} ({least} to {most}) would "
        f"{action_of(verb, name)}; at {at_median} about half of them would. Ranges in brackets are {sure} intervals."
    )


def _rare(first: xr.Dataset, levels: Array, median: float) -> int | None:
    """Return the position of the level below the median whose observed share is nearest a tenth; None without any."""
    seen = first["probability"].values
    found = np.flatnonzero((seen > 0.0) & (seen < 0.5) & (levels < median))
    return int(found[np.abs(np.log(seen[found] / RARE)).argmin()]) if found.size else None


def _chance_in_years(first: xr.Dataset, name: str, verb: str, years: float, held: str) -> str:
    chance, low, high = (float(first[f"risk_probability{end}"]) for end in ("", "_lower", "_upper"))
    if not np.isfinite(chance):
        return "How often that happens cannot be said, because there is no curve."
    said = f"The chance that {name} {verb} within {years:g} years is about {about_percent(chance)}"
    if low == high:
        return f"{said}."
    return (
        f"{said} ({chances_between(low, high, about_percent)}). This range reflects only the limited number of "
        f"motions; {held}, and the damping law and the hazard curve are taken as correct."
    )


def _building(results: xr.Dataset) -> Iterator[str]:
    """Yield sentences on the contents of a building, under the reference law."""
    at, _ = reference_law(results)
    one = results.isel(model=at).sel(place=BUILDING)
    pieces = pieces_at(results, BUILDING)
    sure = f"{confidence_text(results)} interval"
    branches = "branch" in results.dims
    if branches:
        beta = float(results.attrs.get("modelling_dispersion", 0.0))
        held = beta if str(results.attrs.get("modelling")) == "fractiles" else 0.0
        whole = building_spread(results, "any_rate", BUILDING)
        yield spread_sentence(whole, "At least one piece in this building", "overturns", held)
    elif "any_rate" in one:
        rate, low, high = (float(one[f"any_rate{end}"]) for end in ("", "_lower", "_upper"))
        if rate > 0.0:
            chance, *ends = (-math.expm1(-YEARS * each) for each in (rate, low, high))
            yield (
                f"At least one piece in this building overturns about once in {about_years(rate)} years "
                f"({_range(high, low)}), which is a probability of about {about_percent(chance)} "
                f"({chances_between(ends[0], ends[1], about_percent)}) in {YEARS:g} years."
            )
        else:
            yield "Nothing falls under any of the motions."
    else:
        here = one.sel(level=float(results.attrs["at_level"]))
        chance, low, high = (100.0 * float(here[f"any_probability{end}"]) for end in ("", "_lower", "_upper"))
        number, *ends = (float(here[f"number_mean{end}"]) for end in ("", "_lower", "_upper"))
        yield (
            f"Of 100 earthquakes {_strength(results)}, about {chance:.0f} ({low:.0f} to {high:.0f}) would overturn "
            f"something, and on average {two_digits(number)} ({interval_text(ends[0], ends[1], two_digits)}) of the "
            f"{pieces:,} pieces that are not anchored would fall ({sure} over motions)."
        )
    if branches and "annual_loss" in one:
        money = f" {currency_of(results)}" if currency_of(results) else ""
        yield amount_sentence(building_spread(results, "annual_loss", BUILDING), "The expected loss", money)
    elif "annual_loss" in one:
        loss, low, high = (float(one[f"annual_loss{end}"]) for end in ("", "_lower", "_upper"))
        money = f" {currency_of(results)}" if currency_of(results) else ""
        interval = interval_text(low, high, two_digits)
        of = "cost of what falls" if "cost_median" in results.coords else "value of what falls"
        yield f"The expected loss, the {of}, is about {two_digits(loss)}{money} a year ({interval})."
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
        interval = interval_text(low, high, two_digits)
        yield (
            f"The expected downtime is about {two_digits(days)} days {words} ({interval}), counting in each earthquake "
            "only the piece that takes longest to restore."
        )
    if "annual_injuries" in one and not branches:
        years, words = span(one["annual_injuries"])
        persons, low, high = (years * float(one[f"annual_injuries{end}"]) for end in ("", "_lower", "_upper"))
        interval = interval_text(low, high, two_digits)
        yield f"On average about {two_digits(persons)} people would be injured {words} ({interval})."
    if branches:
        yield from _consequences_over_branches(results)
    elif "consequence_rate" in one and float(one["consequence_rate"].max()) > 0.0:
        yield from _consequences(results.isel(model=at))
    anchored = anchored_text(results)
    if anchored:
        yield f"{anchored[:1].upper()}{anchored[1:]}."
    if not branches and "any_rate" in one:
        yield (
            f"All ranges here are {sure}s that reflect only the limited number of motions; {_held(results)}, and the "
            "damping law and the hazard curve are taken as correct."
        )


def _consequences_over_branches(results: xr.Dataset) -> Iterator[str]:
    """Yield how often the most frequent consequences come about over all branches."""
    rates = rates_of_consequences(results, BUILDING)
    if rates is not None:
        each = [rates.isel(block=k) for k in range(min(MOST_CONSEQUENCES, rates.sizes["block"]))]
        said = [f"marked “{one['block'].item()}” overturns about once in {range_text(one)}" for one in each]
        yield f"At least one piece {'; one '.join(said)} (ranges of 90 % probability over the same combinations)."


def _consequences(here: xr.Dataset) -> Iterator[str]:
    """Yield how often the most frequent consequences come about, and on which floor mainly."""
    whole = here.sel(place=BUILDING)
    order = np.argsort(-whole["consequence_rate"].values, kind="stable")[:MOST_CONSEQUENCES]
    said = []
    for k in order:
        one = whole.isel(consequence=int(k))
        rate, low, high = (float(one[f"consequence_rate{end}"]) for end in ("", "_lower", "_upper"))
        if rate > 0.0:
            floors = here["consequence_rate"].isel(consequence=int(k)).drop_sel(place=BUILDING)
            worst = floors.isel(place=int(floors.values.argmax()))
            mainly = floors.sizes["place"] > 1 and float(worst) > 0.5 * float(floors.sum())
            where = f", mostly on {floor_name(str(worst['place'].item()).removeprefix('floor '))}" if mainly else ""
            years = f"about once in {about_years(rate)} years ({_range(high, low)}){where}"
            said.append(f"marked “{one['consequence'].item()}” overturns {years}")
    yield f"At least one piece {'; one '.join(said)}."


def _range(often: float, seldom: float) -> str:
    """Return the ends of a rate's interval as years between two events."""
    if not math.isfinite(often) or not math.isfinite(seldom):
        return "no interval"
    return f"above {about_years(often)}" if seldom == 0.0 else f"{about_years(often)} to {about_years(seldom)}"


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
    return f"as strong as a {name} of {level_text(float(results.attrs['at_level']), level)}"


def _claims(results: xr.Dataset) -> Iterator[str]:
    symbol = GREEK[str(results.attrs["parameter"])]
    claims = claims_of(results)
    holds, fails = (sum(one.verdict == word for one in claims) for word in (HOLDS, FAILS))
    yield (
        f"Of {len(claims)} statements about {symbol}, {holds} hold{'s' if holds == 1 else ''} in these runs, {fails} "
        f"do{'es' if fails == 1 else ''} not, and {len(claims) - holds - fails} cannot be decided."
    )


_PLAIN = {"fragility": _curves, "uncertainty": _curves, "performance": _building, "sensitivity": _claims}
