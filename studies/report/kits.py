"""What a report says of kits and restraints: which to buy for a budget or a target, and whether one helps at all."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
import xarray as xr

from ...core.wording import (
    about_percent,
    about_years,
    counted,
    currency_of,
    given_number,
    short_digits,
    two_digits,
    whole_percent,
    with_article,
    years_text,
)
from ...fragility.fitting.states import OVERTURNED, state_name
from ...fragility.runs.provenance import SCENE, blocks_of, number_of_motions
from ...models import Block
from ..buildings.recommendations import NOTHING, TOO_LITTLE, WORSE, Piece
from ..plan.gains import GAIN, comparable
from ..plan.ratios import HIGHER, LOWER, OPEN, SAME, verdict_of
from ..tables.gains import gains_of
from ..text.curve_notes import verb_of
from ..text.one_side import falling_both_ways
from ..text.words import axis_of, block_title, display_unit, floor_name, quantity_name, reference_law
from .results_file import without_motions

HALF = 0.5
STRONGER = "Do not rely on it: choose one that is more flexible or stronger, and check it in the same way."
MOST_SAID = 4
"""Most restraints whose use has a sentence."""
COUNTED = {"falls": "fall", "front_falls": "fall into the room", "injuries": "person injured"}
"""What a target limits, of one event."""
SEVERAL = {"falls": "falls", "front_falls": "falls into the room", "injuries": "persons injured", "loss": "lost"}
"""What a target limits, of several events."""
HELPS = "helps: "
CHECK = (
    "Before a restraint is fitted, have it checked that the wall and the furniture can carry the force that was "
    "assumed as its strength."
)


def purchases(results: xr.Dataset, pieces: list[Piece]) -> Iterator[str]:
    """Yield the kits to buy for the study's budget, and the cheapest that meet its target, under the reference law."""
    here = results.isel(model=reference_law(results)[0])
    money = f" {currency_of(results)}" if currency_of(results) else ""
    yearly = "item_rate" in results
    when = "" if yearly else " at the level of the tables"
    for name in ("budget", "target"):
        if f"{name}_kit" not in results:
            continue
        limits = _limits(json.loads(str(results.attrs.get("target", "{}"))), money, yearly)
        if name == "target" and not bool(here["target_met"]):
            yield f"None of the kits that were tried is shown to keep the building to at most {limits}{when}."
            continue
        kits = {str(item): str(kit) for item, kit in zip(here["item"].values, here[f"{name}_kit"].values, strict=True)}
        named = [f"“{kits[one.item]}” for “{one.item}” ({floor_name(one.floor)})" for one in pieces if kits[one.item]]
        cost = f"{given_number(float(here[f'{name}_cost']))}{money}"
        then = _then(here, name, yearly)
        unknown = []
        for item, kit in kits.items():
            if not kit:
                continue
            one = here.sel(item=item, kit=kit)
            if not any(float(one[f"kit_{side}falls_saved_lower"]) > 0.0 for side in ("", "front_")):
                unknown.append(f"“{item}”")
        unclear = f" (for {', '.join(unknown)} it is not shown that the kit prevents any falls)" if unknown else ""
        if name == "budget":
            budget = f"{given_number(float(results.attrs['budget']))}{money}"
            if named:
                best = f"the best choice is {', '.join(named)}{unclear}"
                yield f"With a budget of {budget}, {best}. It costs {cost}. {then}"
            else:
                yield f"No kit that is shown to be worth its cost can be bought for {budget}."
            yield from _left_out(here, kits, number_of_motions(results))
        else:
            what = (
                f"the cheapest choice is {', '.join(named)}{unclear}. It costs {cost}" if named else "no kit is needed"
            )
            yield f"To keep to at most {limits}{when}, {what}. {then}"
        gap = float(here[f"{name}_gap"])
        if gap > 0.0:
            by = f", by up to {two_digits(100.0 * gap)} %" if math.isfinite(gap) else ""
            yield f"Another set of kits may be better than this one{by}, because the search was stopped early."


def kits_without_effect(results: xr.Dataset, pieces: list[Piece]) -> Iterator[str]:
    """Yield the kits that prevent nothing measurable, or too little, or cause more falls, and of which pieces."""
    motions = counted(number_of_motions(results), "motion") if "kit_falls" in results else ""
    for kit in dict.fromkeys(tried.kit for one in pieces for tried in one.tried):
        of: dict[str, list[tuple[Piece, float]]] = {}
        for one in pieces:
            for tried in one.tried:
                if tried.kit == kit:
                    of.setdefault(tried.effect, []).append((one, tried.share.value))
        for word, made in ((WORSE, of.get(WORSE)), (NOTHING, of.get(NOTHING)), (TOO_LITTLE, of.get(TOO_LITTLE))):
            if not made:
                continue
            names = ", ".join(f"“{one.item}” ({floor_name(one.floor)})" for one, _ in made)
            if word == WORSE:
                yield f"Do not fit “{kit}” as it is to {names}: with it falls are more frequent than without it."
            elif word == NOTHING:
                yield (
                    f"“{kit}” achieves nothing measurable for {names}: with it falls are about as frequent as without "
                    f"it under these {motions}. Do not rely on it there."
                )
            else:
                shares = ", ".join(dict.fromkeys(whole_percent(share) for _, share in made))
                yield f"“{kit}” is too little for {names}: it prevents only about {shares} of the falls."


def _then(here: xr.Dataset, name: str, yearly: bool) -> str:
    """Return the falls that remain with a set of kits, in all and into the room, beside those without it."""
    write: Callable[[float], str] = _every if yearly else _in_hundred
    if yearly:
        now, front_now = (_sum(here, f"item_{one}rate") for one in ("", "front_"))
    else:
        given = here.sel(level=float(here.attrs["at_level"]))
        now, front_now = (_sum(given, f"{one}probability") for one in ("", "front_"))
    falls, front = (float(here[f"{name}_{one}"]) for one in ("falls", "front_falls"))
    return (
        f"Averaged over a long time, {write(falls)} would then fall ({write(now)} as things are), and {write(front)} "
        f"into the room ({write(front_now)}); several may fall in the same earthquake."
    )


def _sum(here: xr.Dataset, name: str) -> float:
    return math.fsum((here[name] * here["count"]).values.ravel())


def _every(rate: float) -> str:
    """Return an expected number of pieces a year: a piece in so many years, or pieces a year where it is above 1."""
    if not rate > 0.0:
        return "no piece"
    return f"{two_digits(rate)} pieces a year" if rate >= 1.0 else f"one piece in {about_years(rate)} years"


def _in_hundred(number: float) -> str:
    """Return an expected number of pieces as one in a hundred earthquakes."""
    return f"{two_digits(100.0 * number)} pieces in 100 such earthquakes" if number > 0.0 else "no piece"


def _limits(target: Mapping[str, float], money: str, yearly: bool) -> str:
    """Return what a target allows, in words: what comes less than once a year as one event in so many years."""

    def words(name: str, most: float) -> str:
        if yearly and name in COUNTED and 0.0 < most < 1.0:
            return f"one {COUNTED[name]} in {short_digits(1.0 / most)} years"
        amount = f"{given_number(most)}{money if name == 'loss' else ''} {SEVERAL[name]}"
        return f"{amount} a year" if yearly else amount

    return " and ".join(words(name, most) for name, most in target.items())


def _left_out(here: xr.Dataset, kits: Mapping[str, str], motions: int) -> Iterator[str]:
    """Yield the lines without a kit in a set for which motions are too few to tell whether any kit helps."""
    saved, lower = (here[f"kit_falls_saved{end}"].transpose("item", "kit") for end in ("", "_lower"))
    open_ = ((saved > 0.0) & (lower <= 0.0)).any("kit") & ~(lower > 0.0).any("kit")
    names = [f"“{item}”" for item, kit in kits.items() if not kit and bool(open_.sel(item=item))]
    if names:
        yield (
            f"No kit is proposed for {', '.join(names)}: {counted(motions, 'motion')} are too few to tell whether any "
            "of the kits prevents falls there."
        )


def restraint_steps(results: xr.Dataset) -> Iterator[str]:
    """Yield whether the restraints of blocks help, compared with the same blocks without, under the reference law."""
    if SCENE not in results.coords:
        return
    blocks = blocks_of(results)
    pairs = {i: j for i, j in comparable(blocks).items() if _same_but_held(blocks[i], blocks[j])}
    said = list(_by_chance(results, blocks, pairs) if GAIN in results else _by_level(results, blocks, pairs))
    yield from said[:MOST_SAID]
    if any(HELPS in one for one in said):
        yield CHECK


def _same_but_held(block: Block, other: Block) -> bool:
    """Return whether a block has a restraint and another, in the same place, has none."""
    return block.restraint is not None and other.restraint is None and block.wall == other.wall


def _by_chance(results: xr.Dataset, blocks: Sequence[Block], pairs: Mapping[int, int]) -> Iterator[str]:
    named = {(blocks[i].label, blocks[j].label) for i, j in pairs.items()}
    at, _ = reference_law(results)
    years = years_text(float(results.attrs["years"]))
    motions = counted(number_of_motions(results), "motion")
    for one in gains_of(results, [at]):
        if (one.block, one.other) not in named:
            continue
        name = f"“{block_title(one.block)}”{f' on {one.floor}' if one.floor else ''}"
        chances = f"{about_percent(one.chance)} instead of {about_percent(one.of_other)} in {years}"
        word = verdict_of(one.ratio)
        if word == LOWER and one.ratio.lower > HALF:
            yield (
                f"The restraint of {name} is too little: it prevents only about {whole_percent(1.0 - one.ratio.value)} "
                f"of the falls ({chances}). {STRONGER}"
            )
        elif word == LOWER:
            yield f"The restraint of {name} {HELPS}it lowers the chance of falling ({chances})."
        elif word == HIGHER:
            yield f"Do not fit the restraint of {name} as it is: it raises the chance of falling ({chances})."
        elif word in (OPEN, SAME):
            yield (
                f"The restraint of {name} achieves nothing measurable: {motions} do not show that it lowers the chance "
                f"of falling ({chances}). {STRONGER}"
            )


def _by_level(results: xr.Dataset, blocks: Sequence[Block], pairs: Mapping[int, int]) -> Iterator[str]:
    """Yield whether restraints raise the level at which half of the motions bring a block down."""
    at, _ = reference_law(results)
    small = without_motions(results).isel(model=at)
    if "floor" in small["half_level"].dims or "level" not in small.coords:
        return
    axis = axis_of(results)
    scale, unit = display_unit(axis)
    unit = f" {unit}" if unit else ""
    either = falling_both_ways(results)
    chance = f"it {verb_of(str(results.attrs.get('state', state_name(OVERTURNED))))}"
    for i, j in pairs.items():
        with_it, without = blocks[i], blocks[j]
        if {with_it.label, without.label} & either:
            continue
        here, other = small.isel(block=i), small.isel(block=j)
        if not np.isfinite(float(other["half_level"])):
            continue
        level = f"{two_digits(float(other['half_level']) / scale)}{unit}"
        name, of = f"“{block_title(with_it.label)}”", f"“{block_title(without.label)}”"
        upper = float(other["half_level_upper"])
        seldom = small["level"].values[(small["level"].values > upper) & (here["upper"].values < HALF)]
        if seldom.size:
            yield (
                f"The restraint of {name} {HELPS}{chance} in fewer than half of the motions even at a "
                f"{quantity_name(axis)} of {two_digits(float(seldom.max()) / scale)}{unit}, compared with half of them "
                f"at {level} for {of}."
            )
        elif np.isfinite(float(here["half_level"])):
            own = f"{two_digits(float(here['half_level']) / scale)}{unit}"
            compared = (
                f"{chance} in half of the motions at "
                f"{with_article(quantity_name(axis))} of {own}, compared with {level} for {of}"
            )
            # (fitted medians are compared: their intervals are narrower than those of the levels themselves)
            if float(here["median_lower"]) > float(other["median_upper"]):
                yield f"The restraint of {name} {HELPS}{compared}."
            elif float(here["median_upper"]) < float(other["median_lower"]):
                yield f"Do not fit the restraint of {name} as it is: {compared}."
            else:
                yield (
                    f"The restraint of {name} achieves nothing measurable: these motions do not show that it helps "
                    f"({compared}). {STRONGER}"
                )
