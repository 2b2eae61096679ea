"""What a report says before all else: its answer in plain words, for who owns the contents, and what to do next.

Counts of a hundred earthquakes and chances in years, each with its interval; no law's name, no parameter of a curve.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ..fragility.states import OVERTURNED, state_name
from ..fragility.statuses import ALL
from .assessment import BUILDING
from .assessment_notes import anchored_text
from .assessment_rows import pieces_at
from .curve_notes import reached_of, verb_of
from .falling import places
from .performance_study import ranking_of
from .report_answers import largest_share
from .report_checks import GOOD, INVALID, Check
from .sensitivity_claims import FAILS, HOLDS
from .sensitivity_rows import GREEK, claims_of
from .words import (
    axis_of,
    chances_between,
    display_unit,
    floor_name,
    interval_text,
    level_text,
    reference_law,
    three,
    years_between,
)

RARE = 0.1
"""Probability of the shaking that is told of beside the median: what an owner still has to fear."""
YEARS = 50.0
"""Time of chances where the study names none."""
MOST_STEPS = 3
"""Checks whose cures are named as next steps."""


def plain_answer(results: xr.Dataset) -> list[str]:
    """The answer in a few plain sentences.

    Parameters
    ----------
    results : xarray.Dataset
        A study's results, of any kind.

    Returns
    -------
    list of str
    """
    return list(_PLAIN[str(results.attrs["kind"])](results))


def next_steps(results: xr.Dataset, checks: list[Check]) -> list[str]:
    """What to do next: what the answer comes to, then the cures of the checks that are worst."""
    found = list(_actions(results))
    bad = [one for one in checks if one.word != GOOD and one.cure]
    bad.sort(key=lambda one: one.word != INVALID)
    cures = list(dict.fromkeys(f"{one.reason} {one.cure}" for one in bad))
    more = len(cures) - MOST_STEPS
    rest = [f"{more} more check{'s need' if more > 1 else ' needs'} a look: see Validity checks."] if more > 0 else []
    return [*found, *cures[:MOST_STEPS], *rest]


def _curves(results: xr.Dataset) -> Iterator[str]:
    """Of the block that falls first, under the law that the answer is of."""
    at, _ = reference_law(results)
    state = str(results.attrs.get("state", state_name(OVERTURNED)))
    small = results[[name for name, one in results.data_vars.items() if "motion" not in one.dims]].isel(model=at)
    cases = small["median"].transpose("block", ...)
    status = small["status"].transpose(*cases.dims).values.ravel()
    if not np.isfinite(cases.values).any():
        yield f"The runs do not tell how strong shaking must be: {_counted(status)}."
        return
    always = int((status == ALL).sum())
    if always:
        yield f"{_always(small, cases, status)} {reached_of(state)} in every run, even in the weakest shaking."
    order = np.argsort(places(results).values.ravel())
    at_first = np.unravel_index(order[always], cases.shape)
    first = small.isel({str(dim): int(i) for dim, i in zip(cases.dims, at_first, strict=True)})
    name = f"“{first['block'].item()}”"
    where = f" on {floor_name(first['floor'].item())}" if "floor" in small.dims else ""
    verb = verb_of(state)
    if cases.size > 1:
        yield f"Of {'the others' if always else 'all that is looked at here'}, {name}{where} {verb} first."
    yield from _of_a_hundred(first, results, f"{name}{where}", verb)
    most = largest_share(first) if str(results.attrs["kind"]) == "uncertainty" else None
    if most is not None:
        yield f"Of why that differs from case to case, the largest part ({100.0 * most[1]:.0f}\u00a0%) is: {most[0]}."
    if "risk_probability" in first:
        yield _in_time(first, f"{name}{where}", verb, float(results.attrs["years"]))


def _counted(status: NDArray[np.object_]) -> str:
    """Why there is no curve: each reason, and for how many."""
    words, numbers = np.unique(status.astype(str), return_counts=True)
    if len(words) == 1:
        return str(words[0])
    return ", ".join(f"{word} ({n:,} of {status.size:,})" for word, n in zip(words, numbers, strict=True))


def _always(small: xr.Dataset, cases: xr.DataArray, status: NDArray[np.object_]) -> str:
    """What fell in every run, by name where it is one."""
    every = np.flatnonzero(status == ALL)
    row, *rest = np.unravel_index(every[0], cases.shape)
    where = f" on {floor_name(small['floor'][rest[0]].item())}" if rest else ""
    name = f"“{small['block'][row].item()}”{where}"
    return name if every.size == 1 else f"{every.size:,} of {status.size:,} ({name} and {every.size - 1:,} more)"


def _of_a_hundred(first: xr.Dataset, results: xr.Dataset, name: str, verb: str) -> Iterator[str]:
    """How many of a hundred earthquakes: where few do, as observed, and where half do, as the curve says."""
    axis = axis_of(results)
    scale, unit = display_unit(axis)
    unit = f" {unit}" if unit else ""
    measure = str(axis.attrs.get("long_name", "level"))
    median, low, high = (float(first[f"median{end}"]) / scale for end in ("", "_lower", "_upper"))
    sure = f"{100.0 * float(results.attrs['confidence']):g} %"
    known = f"(that level itself is known to {interval_text(low, high)}{unit}, {sure} interval)"
    rare = _rare(first, results["level"].values, median * scale) if {"probability", "lower"} <= {*first} else None
    if rare is None:
        strong = f"as strong as a {measure} of {three(median)}{unit}"
        yield f"Of 100 earthquakes {strong}, about 50 would {_bare(verb, name)} {known}."
        return
    few, least, most = (round(100.0 * float(first[end][rare])) for end in ("probability", "lower", "upper"))
    yield (
        f"Of 100 earthquakes as strong as a {measure} of {level_text(float(results['level'][rare]), axis)}, "
        f"about {few} would {_bare(verb, name)} ({least} to {most}, {sure} interval); at {three(median)}{unit} about "
        f"half of them would {known}."
    )


def _rare(first: xr.Dataset, levels: NDArray[np.float64], median: float) -> int | None:
    """The level below the median at which a tenth falls, as nearly as was observed; None where none tells."""
    seen = first["probability"].values
    found = np.flatnonzero((seen > 0.0) & (seen < 0.5) & (levels < median))
    return int(found[np.abs(np.log(seen[found] / RARE)).argmin()]) if found.size else None


def _bare(verb: str, name: str) -> str:
    """What an earthquake does to a block: overturn it, uplift it, bring it to a rotation."""
    return f"{verb[:-1]} {name}" if verb.endswith("s") else f"bring {name} to {verb.removeprefix('reaches ')}"


def _about(share: float) -> str:
    """A probability in per cent as people say it: two digits, and no line breaks it."""
    return f"{100.0 * share:.2g}\u00a0%"


def _in_time(first: xr.Dataset, name: str, verb: str, years: float) -> str:
    chance, low, high = (float(first[f"risk_probability{end}"]) for end in ("", "_lower", "_upper"))
    if not np.isfinite(chance):
        return "How often that is cannot be told: there is no curve."
    ends = "" if low == high else f" ({chances_between(low, high, _about)}, taking the hazard as given)"
    return f"The chance that {name} {verb} within {years:g} years is about {_about(chance)}{ends}."


def _contents(results: xr.Dataset) -> Iterator[str]:
    """Of a building full of things, under the law that the answer is of."""
    at, _ = reference_law(results)
    one = results.isel(model=at).sel(place=BUILDING)
    pieces = pieces_at(results, BUILDING)
    sure = f"{100.0 * float(results.attrs['confidence']):g} % interval"
    if "any_rate" in one:
        rate, low, high = (float(one[f"any_rate{end}"]) for end in ("", "_lower", "_upper"))
        if rate > 0.0:
            chance, *ends = (-math.expm1(-YEARS * each) for each in (rate, low, high))
            yield (
                f"Something in this building falls about once in {three(1.0 / rate)} years "
                f"({years_between(high, low)}): a chance of about {_about(chance)} in {YEARS:g} years "
                f"({chances_between(ends[0], ends[1], _about)}; {sure} over motions, hazard as given)."
            )
        else:
            yield "Under none of the motions does anything fall."
    else:
        here = one.sel(level=float(results.attrs["at_level"]))
        chance, low, high = (100.0 * float(here[f"any_probability{end}"]) for end in ("", "_lower", "_upper"))
        number, *ends = (float(here[f"number_mean{end}"]) for end in ("", "_lower", "_upper"))
        yield (
            f"Of 100 earthquakes {_strength(results)}, about {chance:.0f} would overturn something ({low:.0f} to "
            f"{high:.0f}), and on average {three(number)} of the {pieces:,} pieces that stand free would fall "
            f"({interval_text(ends[0], ends[1])}; {sure} over motions)."
        )
    if "annual_loss" in one:
        loss, low, high = (float(one[f"annual_loss{end}"]) for end in ("", "_lower", "_upper"))
        money = f" {results.attrs['currency']}" if results.attrs.get("currency") else ""
        yield f"What falls costs {three(loss)}{money} in a mean year ({interval_text(low, high)})."
    if "consequence_rate" in one and float(one["consequence_rate"].max()) > 0.0:
        worst = one.isel(consequence=int(one["consequence_rate"].values.argmax()))
        rate, low, high = (float(worst[f"consequence_rate{end}"]) for end in ("", "_lower", "_upper"))
        yield (
            f"Of what that means “{worst['consequence'].item()}” comes about most often: once in {three(1.0 / rate)} "
            f"years ({years_between(high, low)})."
        )
    held = anchored_text(results)
    if held:
        yield f"{held[:1].upper()}{held[1:]}."


def _strength(results: xr.Dataset) -> str:
    level = results["level"]
    if str(results.attrs["im"]) == "scale":
        return "like these"
    name = level.attrs.get("long_name", results.attrs["im"])
    return f"as strong as a {name} of {level_text(float(results.attrs['at_level']), level)}"


def _claims(results: xr.Dataset) -> Iterator[str]:
    symbol = GREEK[str(results.attrs["parameter"])]
    claims = claims_of(results)
    holds, fails = (sum(one.verdict == word for one in claims) for word in (HOLDS, FAILS))
    yield (
        f"Of {len(claims)} statements about {symbol}, {holds} hold{'s' if holds == 1 else ''} in these runs, {fails} "
        f"do{'es' if fails == 1 else ''} not, and {len(claims) - holds - fails} cannot be decided."
    )


def _actions(results: xr.Dataset) -> Iterator[str]:
    """What the answer itself asks for."""
    kind = str(results.attrs["kind"])
    at, _ = reference_law(results)
    if kind == "performance":
        ranking = ranking_of(results).isel(model=at)
        order = np.argsort(ranking["rank"].values)[:3]
        named = [f"“{ranking['item'].values[i]}” ({floor_name(str(ranking['floor'].values[i]))})" for i in order]
        if named and float(ranking["saving"].max()) > 0.0:
            yield f"Anchor first: {', then '.join(named)}."
    elif "size_along" in results.attrs:
        yield "Choose the size that meets the target, or anchor what is smaller."
    elif kind == "fragility" and "rate" not in results:
        yield (
            "Hold these levels against the shaking expected at the site; with a [hazard] table in the study file the "
            "report says how often a year."
        )


_PLAIN = {"fragility": _curves, "uncertainty": _curves, "performance": _contents, "sensitivity": _claims}
