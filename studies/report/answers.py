"""The detailed answer of a report: the question of a study, and sentences that answer it from the results."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
import xarray as xr

from ...core.wording import (
    chance_text,
    confidence_text,
    currency_of,
    in_years,
    interval_text,
    percent,
    three_digits,
    whole_percent,
    with_article,
    years_between,
    years_text,
)
from ...fragility.fitting.states import ALL
from ..plan.estimates import middle_level
from ..region.rows import event_sentences
from ..tables.assessment import (
    ABOVE,
    DRAWN,
    MARK,
    annual_rows,
    common_modelling,
    doubtful_items,
    fallen_word,
    level_rows,
    objective_unit,
    ranking_rows,
)
from ..tables.sensitivity import PARAMETERS
from ..text.block_order import places, shown
from ..text.curve_notes import reached_of, state_in, verb_in
from ..text.precision import FITTED_RATE
from ..text.reached import EDGE, NO_LEVEL, highest_level, within_levels
from ..text.rows import Rows
from ..text.spread import and_model, sample_range, years_range
from ..text.words import INPUTS, axis_of, display_unit, floor_name, is_one_piece, quantity_name, reference_law
from .extrapolation import part_sentence
from .results_file import without_motions

SPREAD = (0.1, 0.5, 0.9)
"""Shares of many blocks for which the answer gives the level at which half overturn."""
BEYOND = 1e300
"""In place of a level that is not reached, where shares are interpolated (SI)."""
CHANCES = (0.5, 0.1, 0.01)
"""Probabilities in the study's years for which the answer counts the blocks that reach them."""
MOST_NAMED = 3
"""Largest number of blocks that are named among those that fell in every run."""
MOST_DESCRIBED = 12
"""Largest number of blocks that the answer describes; of more blocks it describes the weakest."""


class Answer(NamedTuple):
    """A study's question, and the sentences that answer it, the most important first."""

    question: str
    sentences: list[str]


def answer(results: xr.Dataset) -> Answer:
    """Return a study's question and its answer."""
    return _ANSWERS[str(results.attrs["kind"])](within_levels(results))


def _fragility(results: xr.Dataset) -> Answer:
    verb = verb_in(results)
    cases = list(product(range(results.sizes["block"]), _floors(results)))
    question = f"How strong must the shaking be before {_each_block(results)} {verb}"
    question += ", and how often does that happen?" if "rate" in results else "?"
    said = []
    if len(cases) > MOST_DESCRIBED:
        held = "the tables hold all" if shown(results) is results else "tables hold more, the results all"
        cases = [cases[i] for i in np.argsort(places(results).values.ravel())]
        status = results["status"].isel(model=reference_law(results)[0]).transpose("block", ...).values
        always = int((status == ALL).sum())
        said = [*_spread(results, verb), *([_always(results, cases[:always], len(cases))] if always else [])]
        others = len(cases) - always
        if others > MOST_DESCRIBED:
            of = f"of the other {others:,}" if always else f"of {others:,}"
            said.append(f"The {MOST_DESCRIBED} that fall first {of}; {held}.")
        cases = cases[always : always + MOST_DESCRIBED]
    for i, (k, floor) in cases:
        here = _block_and_floor(results, i, k)
        where = "" if floor is None else f", {floor_name(floor)},"
        text = f"“{results['block'].values[i]}”{where} {curve_sentence(here, verb, axis_of(results))}"
        if "rate" in here:
            text += f" {_rate_sentence(here, float(results.attrs['years']))}"
        said.append(text)
    said.extend(event_sentences(results))
    if "size_along" in results.attrs:
        said.extend(_size_sentences(results))
    return Answer(question, said)


def _spread(results: xr.Dataset, verb: str) -> Iterator[str]:
    """Yield sentences on the spread of many blocks' levels, and on the number of blocks with a high chance."""
    at, _ = reference_law(results)
    one = results.isel(model=at)
    halves = one["half_level"].values.ravel()
    known = halves[~np.isnan(halves)]
    every = f"{halves.size:,} {'blocks' if 'floor' not in results.dims else 'blocks and floors'}"
    if known.size:
        scale, unit = display_unit(axis_of(results))
        unit = f" {unit}" if unit else ""
        # (a level that is not reached counts as one above all others)
        ends = np.quantile(np.where(np.isinf(known), BEYOND, known), SPREAD)
        few, half, most = (f"below {three_digits(float(end) / scale)}{unit}" for end in ends)
        reached = int((ends <= EDGE * highest_level(results)).sum())
        said = (
            f"fewer than a tenth {verb} in half of the runs at any level that was run",
            f"a tenth {verb} {few}; half do so at no level that was run",
            f"a tenth {verb} {few} and half {half}; nine tenths do so at no level that was run",
            f"a tenth {verb} {few} and half {half}, nine tenths {most}",
        )[reached]
        beyond = int(np.isinf(known).sum())
        of = f", of which {beyond:,} {'is' if beyond == 1 else 'are'} not reached" if beyond else ""
        yield f"Of {every} {said} (levels of the {known.size:,} that have one{of})."
    if "risk_probability" in one:
        chance = one["risk_probability"].values.ravel()
        told = int(np.isfinite(chance).sum())
        numbers = [f"{int((chance >= share).sum()) or 'none'} at {percent(share)} or more" for share in CHANCES]
        years = years_text(float(results.attrs["years"]))
        yield f"Chances in {years}, of the {told:,} with a rate: {', '.join(numbers)}."


def _always(results: xr.Dataset, cases: Sequence[tuple[int, tuple[int, str | None]]], every: int) -> str:
    """Return the sentence on the blocks that fell in every run, with the names of the first."""
    names = [
        f"{results['block'].values[i]}{'' if floor is None else f', {floor_name(floor)}'}"
        for i, (_, floor) in cases[:MOST_NAMED]
    ]
    more = f" and {len(cases) - MOST_NAMED:,} more" if len(cases) > MOST_NAMED else ""
    number = f"{len(cases):,} of {every:,} ({'; '.join(names)}{more})"
    unknown = "neither that level nor a rate is known" if "rate" in results else "that level is not known"
    return f"In every run {number} {reached_of(state_in(results))}, even in the weakest shaking: {unknown}."


def curve_sentence(here: xr.Dataset, verb: str, axis: xr.DataArray) -> str:
    """Return a sentence on the level at which half overturn: the reference law's with its interval, and the others'.

    `here` has curves on the dimension model alone, `axis` the levels with the attributes of their measure; `verb` is
    what the block does.
    """
    at, known = reference_law(here)
    law = f"under {here['model'].values[at]}" + (", the reference law" if known else "")
    one = here.isel(model=at)
    half = float(one["half_level"])
    scale, unit = display_unit(axis)
    unit = f" {unit}" if unit else ""
    if half == np.inf:
        most = f"{three_digits(float(axis.max()) / scale)}{unit}"
        text = f"does not reach a probability of 50 % {law}, up to the highest shaking that was run ({most})."
    elif half == 0.0:
        least = f"{three_digits(float(axis.min()) / scale)}{unit}"
        text = f"{verb} in half of the runs or more at every level {law}, down to the weakest shaking ({least})."
    elif np.isnan(half):
        text = f"has no such level {law}: {NO_LEVEL.get(one['status'].item(), one['status'].item())}."
    else:
        lower, upper = (float(one[f"half_level_{end}"]) / scale for end in ("lower", "upper"))
        percent = confidence_text(here)
        ends = interval_text(lower or -np.inf, upper)
        interval = f"({percent} interval {ends})".replace(f"{percent} interval no", "no")
        measure = quantity_name(axis)
        text = (
            f"{verb} with a probability of 50 % at {with_article(measure)} of {three_digits(half / scale)}{unit} "
            f"{interval} {law}."
        )
    others = np.delete(here["half_level"].values.astype(float), at) / scale
    beyond = int(np.isposinf(others).sum())
    found = others[np.isfinite(others) & (others > 0.0)]
    if found.size:
        low, high = found.min(), found.max()
        ends = (
            three_digits(high)
            if three_digits(low) == three_digits(high)
            else f"{three_digits(low)} to {three_digits(high)}"
        )
        them = "law gives" if others.size == 1 else f"{others.size} laws give"
        every = [*found, half / scale] if 0.0 < half < np.inf else [*found]
        ratio = f"{max(every) / min(every):.2g}"
        apart = f": a factor of {ratio} between laws" if ratio != "1" else ""
        text += f" The other {them} {ends}{unit}{apart}."
        if beyond:
            text += f" (Under {beyond} of them it is not reached.)"
        if found.size + beyond < others.size:
            text += f" ({others.size - found.size - beyond} of them have no such level.)"
    elif beyond:
        text += " Nor is it reached under any other law." if half == np.inf else " It is reached under no other law."
    elif others.size:
        text += " No other law has such a level."
    return text


def _rate_sentence(here: xr.Dataset, years: float) -> str:
    """Return the sentence on the annual rate under the reference law, and under the other laws."""
    at, _ = reference_law(here)
    one = here.isel(model=at)
    rate = float(one["rate"])
    if not np.isfinite(rate):
        return "Without a curve there is no annual rate."
    lower, upper = (float(one[f"rate_{end}"]) for end in ("lower", "upper"))
    interval = "whose interval has no width (see the notes)" if lower == upper else years_between(upper, lower)
    interval = and_model(interval, one, "rate", years_range)
    chance = f"a probability of {chance_text(float(one['risk_probability']))} in {years_text(years)}"
    text = f"With the given hazard curve the mean return period is {in_years(rate)} years ({interval}), {chance}"
    if FITTED_RATE in one:
        fitted, *ends = (float(one[f"{FITTED_RATE}{end}"]) for end in ("", "_upper", "_lower"))
        known = f" {in_years(fitted)} years ({years_between(*ends)})" if np.isfinite(fitted) else " none"
        text += f", from weighted runs without a form of curve (the fitted curve gives{known})"
    others = np.delete(here["rate"].values.astype(float), at)
    others = others[np.isfinite(others)]
    if others.size:
        often, seldom = in_years(others.max()), in_years(others.min())
        text += (
            f"; under the other law{'s' if others.size > 1 else ''} the mean return period is {often}"
            + (f" to {seldom}" if seldom != often else "")
            + " years"
        )
    of = "this rate" if not others.size else f"the rate under {one['model'].item()}"
    return " ".join([f"{text}.", *part_sentence(one, of)])


def _size_sentences(results: xr.Dataset) -> Iterator[str]:
    along = str(results.attrs["size_along"])
    name = f"size_{along}"
    units = results[name].attrs["units"].replace("1", "")
    at, _ = reference_law(results)
    target = f"{100.0 * float(results.attrs['size_probability']):.3g} % in {years_text(float(results.attrs['years']))}"
    floors = list(enumerate(results["floor"].values)) if "floor" in results[name].dims else [(0, None)]
    for k, floor in floors:
        one = results.isel(model=at) if floor is None else results.isel(model=at, floor=k)
        where = "" if floor is None else f" on {floor_name(floor)}"
        found = float(one[name])
        if np.isfinite(found):
            low, high = (float(one[f"{name}_{end}"]) for end in ("lower", "upper"))
            interval = interval_text(low, high)
            size, law = f"{three_digits(found)} {units} ({interval})", one["model"].item()
            yield f"A {along} of {size} meets the target of {target}{where} under {law}."
        else:
            yield f"No {along} was found that meets the target of {target}{where}: {one['size_status'].item()}."


def _uncertainty(results: xr.Dataset) -> Answer:
    question = f"How strong must the shaking be before {_each_block(results)} overturns"
    question += ", given the uncertainty of its size, restitution and damping law, and what matters most?"
    at, _ = reference_law(results)
    scale, unit = display_unit(results["level"])
    said = []
    for i in range(min(results.sizes["block"], MOST_DESCRIBED)):
        here = results.isel(block=i)
        text = f"“{results['block'].values[i]}” {curve_sentence(here, 'overturns', results['level'])}"
        low, high = (end / scale for end in sample_range(here.isel(model=at)))
        if np.isfinite(low):
            text += (
                f" For 90 % of the samples of its properties the median lies in the range {interval_text(low, high)}"
                f"{f' {unit}' if unit else ''}."
            )
        if "rate" in here:
            text += f" {_rate_sentence(here, float(results.attrs['years']))}"
        text += f" {_largest_share(here)}"
        said.append(text)
    return Answer(question, said)


def largest_share(here: xr.Dataset, words: Mapping[str, str] = INPUTS) -> tuple[str, float] | None:
    """Return the component with the largest share of one block's variance, and its share; None where it is unknown."""
    known = "capacity_share" in here
    share = here["capacity_share"] if known else here["flag_share"].isel(level=middle_level(here["probability"]))
    if not np.isfinite(share.values).any():
        return None
    first = int(np.nanargmax(share.values))
    names = [words.get(part, part) for part in str(here["component"].values[first]).split(" × ")]
    return names[0] if len(names) == 1 else f"the interaction of {' and '.join(names)}", float(share[first])


def _largest_share(here: xr.Dataset) -> str:
    found = largest_share(here)
    if found is None:
        return "The source of the scatter could not be determined."
    what = "the logarithm of its capacity" if "capacity_share" in here else "its outcome where that is least certain"
    return f"The largest part of the variance of {what} ({whole_percent(found[1])}) comes from: {found[0]}."


def _performance(results: xr.Dataset) -> Answer:
    yearly = "annual_number" in results
    question = "How often does anything fall in this building" if yearly else "What falls in this building"
    question += "" if yearly else " at this level of shaking"
    question += ", with what consequences, and what should be anchored first?"
    at, known = reference_law(results)
    labels = [str(one) for one in results["model"].values]
    said = []
    for model in (labels[at], *(one for i, one in enumerate(labels) if i != at))[:MOST_DESCRIBED]:
        level = None if yearly else float(results.attrs["at_level"])
        rows = annual_rows(results, model) if level is None else level_rows(results, level, model)
        law = f"Under {model}," + (" the reference law," if known and model == labels[at] else "")
        said.append(_whole_building(rows, law, results))
        if model == labels[at]:
            said.extend(_first_to_anchor(results, model))
    return Answer(question, said)


def _whole_building(rows: Rows, law: str, results: xr.Dataset) -> str:
    """Return a sentence from a table's first row, that of the whole building; its numbers are the table's texts."""
    if not rows.rows:
        return f"{law} nothing is known."
    found = dict(zip(rows.headings, rows.rows[0], strict=True))
    money = f" {currency_of(results)}" if currency_of(results) else ""
    fell = fallen_word(results)
    yearly = f"{fell} a year" in found
    number, loss = (found.get(f"{name} a year" if yearly else name) for name in (fell, "lost"))
    years = " a year" if yearly else ""
    amounts = [] if loss is None else [f"expected loss is {loss}{money}{years}"]
    for heading, text in found.items():
        for name, words, unit in (("downtime", "downtime", " days"), ("injuries", "number of injured persons", "")):
            if heading.startswith(DRAWN[name]):
                amounts.append(f"expected {words} is {text}{unit}{heading.removeprefix(DRAWN[name])}")
    if yearly:
        often = found["anything falls, once in"]
        rest = "Nothing that stands free can fall" if often == "–" else f"At least one piece falls once in {often}"
        if often.startswith(ABOVE):
            rest = f"Nothing falls under any motion, which shows no more than: less than once in {often[len(ABOVE) :]}"
    else:
        chance = "0 %" if found["anything falls"] == "–" else found["anything falls"]
        shaken = rows.title.partition(" (")[0].partition(",")[0]
        law = f"{shaken} and {law[:1].lower()}{law[1:]}"
        rest = f"The probability that at least one piece falls is {chance}"
    said = [
        f"{law} on average {number} of the {found['unanchored pieces']} pieces that are not anchored "
        f"{'overturn' if fell == 'overturned' else 'fall'}{years}."
    ]
    said += [f"The {_listed(amounts)}."] if amounts else []
    return f"{' '.join(said)} {rest}. Ranges in brackets are {confidence_text(results)} intervals."


def _listed(parts: list[str]) -> str:
    """Return parts of a sentence, each with its own verb, as a list."""
    *first, last = parts
    return f"{', the '.join(first)} and the {last}" if first else last


def _first_to_anchor(results: xr.Dataset, model: str) -> Iterator[str]:
    from ..kinds.performance import ranking_of  # noqa: PLC0415 - with the study files' tables, of which no other report needs any

    ranking = ranking_of(results)
    doubtful = doubtful_items(ranking)
    ranking = ranking.isel(item=~doubtful)
    before = f"Apart from the pieces with the mark{MARK}, " if doubtful.any() else ""
    rows = ranking_rows(ranking, model, most=1)
    _, unit = objective_unit(ranking)
    for row in rows.rows:
        found = dict(zip((heading.partition(",")[0] for heading in rows.headings), row, strict=True))
        share = "" if found["share"] == "–" else f" ({found['share']} of all that anchoring could save)"
        place = found["rank"].partition(" ")[2].strip("()")
        sure = f"; its rank may be {place}" if place else "; its rank is the same in every bootstrap resample"
        common = common_modelling(ranking)
        sure += f"; for the ranks, {common}" if common else ""
        yield (
            f"{before}{'a' if before else 'A'}nchoring “{found['item']}” ({floor_name(found['floor'])}) saves the most "
            f"of the {ranking.attrs['objective_text']}: {found['saves']}{f' {unit}' if unit else ''}{share}{sure}."
        )


def _sensitivity(results: xr.Dataset) -> Answer:
    name = PARAMETERS[str(results.attrs["parameter"])]
    question = (
        f"How much does the shaking that overturns {_each_block(results)} depend on {name}, and which damping laws "
        "agree with a rigid block?"
    )
    return Answer(question, [])  # (the plain answer says all of it)


def _each_block(results: xr.Dataset) -> str:
    number = results.sizes["block"]
    many = "arrangements of one piece" if "floor" not in results.dims and is_one_piece(results) else "pieces"
    return "this piece" if number == 1 else f"each of these {number:,} {many}"


def _floors(results: xr.Dataset) -> list[tuple[int, str | None]]:
    return [(k, str(one)) for k, one in enumerate(results["floor"].values)] if "floor" in results.dims else [(0, None)]


def _block_and_floor(results: xr.Dataset, block: int, floor: int) -> xr.Dataset:
    here = without_motions(results).isel(block=block)
    return here.isel(floor=floor) if "floor" in here.dims else here


_ANSWERS = {
    "fragility": _fragility,
    "uncertainty": _uncertainty,
    "performance": _performance,
    "sensitivity": _sensitivity,
}
