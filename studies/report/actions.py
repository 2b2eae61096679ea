"""What a report tells its client to do: what the answer asks for, and how far its validity checks went."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
import xarray as xr

from ...core.doubts import first_of
from ...core.wording import (
    about_percent,
    about_years,
    counted,
    currency_of,
    given_number,
    given_percent,
    interval_text,
    percent,
    short_digits,
    two_digits,
    whole_percent,
    with_article,
    years_text,
)
from ...fragility.runs.provenance import SCENE, blocks_of, number_of_motions
from ...models import Block
from ...models.friction import LOCKED, ROLLING
from ..buildings.pieces import SAFETY, on_moving_supports, pieces_of
from ..buildings.recommendations import (
    ANCHORED,
    DUTY,
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
    YEARS as PIECE_YEARS,
    Piece,
)
from ..buildings.sliding import MOVES, shares_with_moving_supports
from ..buildings.variables import FALLEN, JOINT
from ..codes.check import UNCHECKED as NOT_CHECKED
from ..plan.gains import GAIN, comparable
from ..plan.ratios import HIGHER, LOWER, OPEN, SAME, verdict_of
from ..plan.slides import INSTEAD
from ..tables.gains import gains_of
from ..tables.item_slides import contacts_of
from ..tables.sensitivity import law_name, law_of_answer, laws_apart, swings_of
from ..tables.unseen import at_most
from ..text.curve_notes import verb_in
from ..text.one_side import falling_both_ways
from ..text.words import (
    axis_of,
    block_title,
    consequence_name,
    display_unit,
    floor_name,
    quantity_name,
    reference_law,
    that_has,
)
from .results_file import without_motions
from .validity import GOOD, SLIDING, Check

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
    chance = f"it {verb_in(results)}"
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


PUSH_STEP = (
    "On a smooth floor or on castors a piece may slide instead of rocking, and the chances of falling then do not "
    "apply to it. As a first check of a light piece, push it gently at mid-height, with a second person steadying it "
    "and nobody where it could fall; do not try this with heavy, fragile or hazardous contents."
)
SLIDE_STEP = (
    f"{PUSH_STEP} A piece that slides rather than tips needs a study that includes sliding, or must be kept from "
    "sliding."
)
KNOWN_SLIDE_STEP = (
    f"{PUSH_STEP} The table of sliding in the appendix says how far a piece that slides goes; where that is too far, "
    "keep it from sliding."
)
SIZES = {"alpha": "slenderness angle", "R": "size (half of its diagonal)", "cm_height": "height of the mass centre"}
"""Sizes that are no words themselves."""
SAFER_LARGER = ("width", "alpha", "R")
"""Sizes of which more is safer with the others unchanged."""
MEASURE_STEP = (
    "The friction that the study assumes decides what slides, and what slides off an edge. Have it measured on an "
    "empty duplicate, or on a sample of the same base and the same floor: the force that just makes it slide, divided "
    "by its weight, is the coefficient. Do not push heavy, fragile, valuable or hazardous pieces."
)
NO_TILT = (
    "Do not tilt loaded furniture or racks to measure anything: take sizes and the mass centre from a plan and a list "
    "of what they hold."
)
"""What keeps a measurement safe."""
NOTABLE_SWING = 1.15
"""Ratio of levels from which a parameter or a law is said to matter."""
MOST_PIECES = 5
"""Largest number of pieces that a step names."""


def next_steps(results: xr.Dataset, checks: list[Check]) -> list[str]:
    """Return the next steps: those that follow from the answer, and what an engineer should look at first."""
    bad = sum(one.word != GOOD for one in checks)
    if not bad:
        return list(_actions(results))
    them = "check that is" if bad == 1 else "checks that are"
    look = (
        f"Before any decision that cannot be reversed, have an engineer review the validity {them} not rated “{GOOD}” "
        f"({bad} of {len(checks)}); the technical appendix says what to do about each."
    )
    pushed = str(results.attrs["kind"]) != "sensitivity"  # (its blocks stand for no piece in particular)
    step = MEASURE_STEP if FALLEN in results else KNOWN_SLIDE_STEP if INSTEAD in results else SLIDE_STEP
    slides = [step] if pushed and any(one.question == SLIDING and one.word != GOOD for one in checks) else []
    return [*_actions(results), *slides, look]


def _actions(results: xr.Dataset) -> Iterator[str]:
    """Yield the next steps that follow from the answer itself."""
    kind = str(results.attrs["kind"])
    at, _ = reference_law(results)
    if kind == "performance":
        pieces = pieces_of(results, at)
        yield from _duties(pieces, results)
        yield from _first(pieces, results)
        worth = [one for one in pieces if one.recommendation == WORTH]
        if worth:
            yield (
                f"Anchoring saves more than it costs within {PIECE_YEARS:g} years, with later savings discounted at "
                f"{given_percent(worth[0].discount)} a year: {_pieces(worth, kits=True)}."
            )
        yield from _undecided(pieces, results)
        yield from _not_judged(pieces)
        yield from _unstated(pieces)
        yield from _spent(pieces, results)
        yield from purchases(results, pieces)
        yield from kits_without_effect(results, pieces)
        yield from _anchored(pieces)
        yield from _supports(results)
        yield from _carried(pieces, results)
        yield from _castors(results)
        if "code" not in results.attrs:
            yield (
                "Code requirements are not checked. Any piece that the law requires to be anchored must be anchored, "
                "whatever these results say."
            )
    elif kind == "sensitivity":
        yield from _of_sensitivity(results)
    elif "size_along" in results.attrs:
        yield from _sizes(results)
    elif kind in ("fragility", "uncertainty") and "rate" not in results:
        yield (
            "Compare these levels with the shaking expected at the site. If a hazard curve for the site is added to "
            "the study, the report will also say how often such shaking occurs."
        )
    if kind == "fragility":
        yield from restraint_steps(results)


def _first(pieces: list[Piece], results: xr.Dataset) -> Iterator[str]:
    """Yield what to anchor first: for safety, and after that for the loss or the falls; never the two together."""
    first = [one for one in pieces if one.recommendation == REDUCES]
    also = [one for one in pieces if one.recommendation == SAFER]
    most = [one for one in pieces if one.recommendation in (SAVES, PREVENTS)]
    valued = any(one.value > 0.0 for one in pieces if not one.safety)
    of = "the expected loss comes" if valued else "the expected falls come"
    if first and not any(one.safety for one in first):
        yield f"Most of {of} from {_pieces(first)}: anchor {_them(first)} first{_with_kits(first)}."
    elif first:
        words = dict.fromkeys(word for one in first for word in one.consequences if word in _safety(results))
        named = ", ".join(map(consequence_name, words))
        yield f"Anchor first, for safety ({named}): {_pieces(first, kits=True)}."
    if also:
        yield f"Anchoring these also makes people safer: {_pieces(also, kits=True)}."
    if most:
        yield (
            f"Among the pieces that do not affect safety, most of {of} from {_pieces(most)}: anchor {_them(most)} next"
            f"{_with_kits(most)}."
        )


def _with_kits(pieces: list[Piece]) -> str:
    """Return with which kits pieces are to be anchored, after the advice to anchor them; '' where none were tried."""
    said = [f"“{one.item}”{_kit_of(one)}" for one in pieces[:MOST_PIECES] if one.tried]
    return f" ({'; '.join(said)})" if said else ""


def _kit_of(one: Piece) -> str:
    """Return which kit is meant where a piece is to be anchored, and what it prevents; '' where none were tried."""
    if not one.tried:
        return ""
    if one.meant is None:
        return ": none of the kits that were tried is shown to prevent enough of its falls, so choose a stronger one"
    return f" with “{one.meant.kit}”, which prevents about {whole_percent(one.meant.share.value)} of its falls"


def _not_judged(pieces: list[Piece]) -> Iterator[str]:
    """Yield for which pieces nothing is advised, because their chances of falling are no ground for it."""
    for word, why in (
        (
            OUTSIDE,
            "a piece whose mass centre is less than two half widths high slides or bounces rather than rocks, which is "
            "outside the model",
        ),
        (INDICATIVE, "what it stands on moves itself, so that the chance given is only indicative"),
    ):
        named = [one for one in pieces if one.recommendation == word]
        if named:
            yield f"No advice on anchoring follows from these results for {_pieces(named, len(named))}: {why}."
        if people := [one for one in named if one.safety]:
            can = "can endanger people all the same: have an engineer judge whether to fix"
            yield f"{_pieces(people, len(people))} {can} {_them(people)}."


def _unstated(pieces: list[Piece]) -> Iterator[str]:
    """Yield for which pieces the inventory does not say whether their falling is a danger."""
    if named := [one for one in pieces if not one.stated and not one.held]:
        by = "money" if any(one.value > 0.0 for one in pieces) else "their falls"
        yield (
            f"The inventory does not say what it means for people if these fall, so that they are judged by {by} "
            f"alone, and none of them is known to be harmless: {_pieces(named)}. Let the inventory say it of each line "
            "(“none” where nobody can be harmed)."
        )


def _undecided(pieces: list[Piece], results: xr.Dataset) -> Iterator[str]:
    """Yield for which pieces it is not known whether anchoring is worth its cost, and what would tell."""
    open_ = [one for one in pieces if one.recommendation == UNRESOLVED and not one.safety]
    seen = [one for one in open_ if one.chance.value > 0.0]
    never = [one for one in pieces if one.recommendation == UNRESOLVED and one.chance.value == 0.0]
    if seen:
        yield (
            f"Not resolved: whether anchoring {_pieces(seen, len(seen))} saves more than it costs within "
            f"{PIECE_YEARS:g} years. The interval of the saving, discounted, includes the cost: run more motions, or "
            "decide on other grounds."
        )
    if never:
        does = "falls" if len(never) == 1 else "fall"
        bound = f"in {PIECE_YEARS:g} years" if "level_weight" in results else "at this level"
        yield (
            f"{_pieces(never, len(never))} {does} under none of the motions, which shows no more than a chance of "
            f"{at_most(results)} {bound} for each. The benefit of anchoring is not known: run more motions or stronger "
            "shaking if it matters."
        )
    for word, what in ((UNPRICED, "cost of anchoring"), (UNVALUED, "value")):
        missing = [one for one in pieces if one.recommendation == word]
        if missing:
            yield (
                f"The inventory gives no {what} for {_pieces(missing, len(missing))}, so that cost and benefit of "
                f"anchoring {_them(missing)} cannot be compared; the table gives the chance of falling."
            )


def _of_sensitivity(results: xr.Dataset) -> Iterator[str]:
    """Yield what follows from a sensitivity study for studies of real pieces."""
    at = law_of_answer(results)
    swings = [max(first, last) / min(first, last) for _, _, _, first, last in swings_of(results, at)]
    e = str(results.attrs["parameter"]) == "e"
    if swings and max(swings) > NOTABLE_SWING:
        by, law = f"by a factor of up to {two_digits(max(swings))}", law_name(results, at)
        yield (
            f"The restitution changes the level {by}. Where a decision depends on it, treat it as uncertain in the "
            f"study, or have it measured on an unloaded sample with the same base and floor. {NO_TILT}"
            if e
            else f"The width δ changes the level {by} even under {law}: choose it as small as in the flat part of the "
            "figure."
        )
    elif swings:
        name = "restitution" if e else "width δ"
        by = f"by at most {whole_percent(max(swings) - 1.0)}"
        yield f"The {name} changes the level {by} under {law_name(results, at)}: no more effort on it is needed."
    apart = laws_apart(results)
    far = [f"{label} ({ratio:.2f})" for label, ratio in apart if abs(math.log(ratio)) > math.log(NOTABLE_SWING)]
    if apart:
        text = f"For studies of rigid pieces take {apart[0][0]}, which agrees best with a rigid block"
        if far:
            text += f"; do not take {first_of(far)}: in brackets, their mean levels over those of a rigid block"
        yield f"{text}."


def _them(pieces: list[Piece]) -> str:
    return "it" if len(pieces) == 1 and pieces[0].number == 1 else "them"


def _anchored(pieces: list[Piece]) -> Iterator[str]:
    """Yield which lines are anchored already, and what the results assume of them."""
    held = [one for one in pieces if one.held and one.recommendation == ANCHORED]
    assumed = "The results assume that the anchors hold: have them inspected."
    if held and len(held) == len(pieces):
        yield f"All pieces are anchored already, and nothing is left to anchor. {assumed}"
    elif held:
        yield f"{_pieces(held)} {'is' if len(held) == 1 else 'are'} anchored already. {assumed}"


def _supports(results: xr.Dataset) -> Iterator[str]:
    """Yield what to do where pieces stand on others that slide or rock in some of their falls."""
    if MOVES not in results:
        return
    shares = shares_with_moving_supports(results)
    for i in np.flatnonzero(on_moving_supports(results))[:MOST_PIECES].tolist():
        below = results["stands_on"].values[i]
        yield (
            f"Fix “{below}” before “{results['item'].values[i]}”, which stands on it: in {about_percent(shares[i])} of "
            f"the runs in which “{results['item'].values[i]}” falls, “{below}” would slide or rock itself. That is not "
            "modelled, so the chance given is only indicative."
        )


def _carried(pieces: list[Piece], results: xr.Dataset) -> Iterator[str]:
    """Yield which pieces take others with them when they fall."""
    if "stands_on" not in results.coords or "item_rate" not in results:
        return
    on = results["stands_on"].values
    for one in [one for one in pieces if one.item in on and not one.held and one.chance.value > 0.0][:MOST_PIECES]:
        above = [f"“{item}”" for item in results["item"].values[on == one.item]]
        yield (
            f"Where “{one.item}” falls (each about once in {about_years(one.chance.value)} years), it takes with it "
            f"what stands on it: {first_of(above)}, also if this is fixed to it."
            + (
                ""
                if math.isnan(one.payback)
                else f" The payback of “{one.item}” counts both, but for what falls by itself in the same motions."
            )
        )


def _castors(results: xr.Dataset) -> Iterator[str]:
    """Yield what to do about pieces on castors."""
    contacts = contacts_of(results)
    for contact, text in (
        (
            ROLLING,
            "on castors that can roll, which is not modelled: lock or tether them. The chances given are those of the "
            "same pieces on feet",
        ),
        (LOCKED, "on locked castors: have the brakes checked, which the results assume to hold"),
    ):
        standing = [
            f"“{name}”"
            for name, one, held in zip(results["item"].values, contacts, results["anchored"].values, strict=True)
            if one == contact and not held
        ]
        if standing:
            yield f"{first_of(standing)} {'stands' if len(standing) == 1 else 'stand'} {text}."


def _safety(results: xr.Dataset) -> list[str]:
    """Return the consequences that are a matter of safety."""
    return str(results.attrs.get("safety", JOINT.join(SAFETY))).split(JOINT)


def _sizes(results: xr.Dataset) -> Iterator[str]:
    """Yield the size that meets the target under the reference law, on each floor, and the pieces that do not."""
    along = str(results.attrs["size_along"])
    found = results[f"size_{along}"]
    size = SIZES.get(along, along)
    least = "at least " if along in SAFER_LARGER else ""
    unit = f" {found.attrs['units']}".replace(" 1", "")
    most = float(results.attrs["size_probability"])
    target = f"{percent(most)} in {years_text(float(results.attrs['years']))}"
    at, _ = reference_law(results)
    for floor in found["floor"].values.tolist() if "floor" in found.dims else [None]:
        here = results if floor is None else results.sel(floor=floor)
        where = "" if floor is None else f" on {floor_name(floor)}"
        value, low, high = (float(here[f"size_{along}{end}"].isel(model=at)) for end in ("", "_lower", "_upper"))
        if math.isfinite(value):
            others = np.delete(here[f"size_{along}"].values, at)
            others = others[np.isfinite(others)]
            ends = [two_digits(float(one)) for one in (others.min(), others.max())] if others.size else []
            laws = "law" if others.size == 1 else "laws"
            other = f"; {' to '.join(dict.fromkeys(ends))}{unit} under the other {laws}" if ends else ""
            yield (
                f"For the chance that a piece like these overturns{where} to meet the target of this study (no more "
                f"than {target}), its {size} must be {least}about {two_digits(value)}{unit} "
                f"({interval_text(low, high, two_digits)}{other}), with its other dimensions unchanged."
            )
        else:
            yield f"No {size} was found with which a piece like these meets the target of {target}{where}."
        chance = here["risk_probability"].isel(model=at).values
        missed = [f"“{block_title(str(one))}”" for one in here["block"].values[chance > most]]
        if missed:
            does, its, them = ("does", "its", "it") if len(missed) == 1 else ("do", "their", "them")
            yield (
                f"{first_of(missed)} {does} not meet this target{where}: where {its} {size} cannot be changed, anchor "
                f"{them}."
            )
        barely = here["risk_probability"].max("model").values
        named = here["block"].values[(chance <= most) & (barely > most)]
        only = [f"“{block_title(str(one))}”" for one in named]
        if only:
            meets = "meets" if len(only) == 1 else "meet"
            yield f"{first_of(only)} {meets} this target{where} under the reference law, but not under all laws."


def _duties(pieces: list[Piece], results: xr.Dataset) -> Iterator[str]:
    """Yield what the building code requires."""
    if "code" not in results.attrs:
        return
    duty = [one for one in pieces if one.recommendation == DUTY]
    weak = [one for one in pieces if one.recommendation == WEAK]
    unknown = [one for one in pieces if one.code is not None and one.code.status == NOT_CHECKED]
    if duty:
        code = str(results.attrs["code"])
        # (Eurocode 8 asks for a verification of the element and its fixing, ASCE 7 for the fixing)
        demand = (
            f"Regardless of the calculated risk, {code} requires the following to be verified for a horizontal force: "
            "anchor them, unless an engineer shows that they resist it unanchored"
            if code.startswith("EN 1998")
            else f"Anchor the following, which {code} requires regardless of the calculated risk"
        )
        yield f"{demand}: {_pieces(duty)}."
    if weak:
        held = " (all rates assume that they hold)" if all(one.held for one in weak) else ""
        yield (
            "Strengthen the anchors of the following, which are weaker than the force that the code requires"
            f"{held}: {_pieces(weak)}."
        )
    if unknown:
        clauses = [one.code.clause for one in unknown if one.code is not None]
        why = ", ".join(dict.fromkeys(clause.partition(": ")[2] or clause for clause in clauses))
        yield f"The code requirements could not be checked for {_pieces(unknown, len(unknown))}: {why}."


def money_steps(results: xr.Dataset) -> list[str]:
    """Return what is best done with the budget, and which kits are not worth buying, under the reference law."""
    pieces = pieces_of(results, reference_law(results)[0])
    return [*_spent(pieces, results), *kits_without_effect(results, pieces)]


def _spent(pieces: list[Piece], results: xr.Dataset) -> Iterator[str]:
    """Yield what is best done with the study's budget."""
    if "budget_chosen" not in results:
        return
    at, _ = reference_law(results)
    money = f" {currency_of(results)}" if currency_of(results) else ""
    budget = f"{given_number(float(results.attrs['budget']))}{money}"
    chosen = [one for one in pieces if one.chosen]
    if not chosen and all(one.held for one in pieces):
        return  # (nothing is left to anchor, which is said)
    if not chosen:
        yield f"No line of the inventory that would reduce the risk can be anchored for {budget}."
        return
    cost = sum(one.cost_of_all for one in chosen)
    names = _pieces(chosen, len(chosen))
    effect = _effect(pieces, chosen, money, _safety(results))
    if open_ := [one for one in chosen if one.recommendation == UNRESOLVED and not one.safety]:
        effect += f"; whether anchoring {_pieces(open_, len(open_))} saves more than it costs is not resolved"
    yield f"With a budget of {budget}, anchor {names}, at a cost of {given_number(cost)}{money}{effect}."
    gap = float(results["budget_gap"].values[at])
    over = float(results.attrs["budget"]) - cost
    others = [one for one in pieces if not one.chosen and one.number * one.cost <= over and not one.held]
    wanted = (REDUCES, SAFER, WORTH)
    dear = [one for one in pieces if not one.chosen and one.recommendation in wanted and one.number * one.cost > over]
    if others and gap == 0.0 and all(one.recommendation in LITTLE for one in others):
        yield (
            f"{given_number(over)}{money} would be left over; none of the other lines that it would pay for saves more "
            "than it costs."
        )
    elif dear and gap == 0.0:
        first = " after what the code requires" if all(one.recommendation == DUTY for one in chosen) else ""
        together = " All pieces of a line are anchored together." if any(one.number > 1 for one in dear) else ""
        yield (
            f"{_pieces(dear, money=money)} {'is' if len(dear) == 1 else 'are'} beyond this budget, of which "
            f"{given_number(over)}{money} would be left over{first}.{together} Judged by safety first, then by what is "
            f"saved in {PIECE_YEARS:g} years, discounted, less what it costs, no other choice within it does better."
        )
    if gap > 0.0:
        by = f", by up to {two_digits(100.0 * gap)} %" if math.isfinite(gap) else ""
        yield f"Another choice may be better than this one{by}, because the search was stopped early."
    left = [one for one in pieces if one.recommendation == DUTY and not one.chosen]
    dear = [one for one in left if math.isfinite(one.cost)]
    unknown = [one for one in left if not math.isfinite(one.cost)]
    if dear:
        yield f"The budget does not cover all that the code requires: {_pieces(dear, money=money)}."
    if unknown:
        yield f"The cost of anchoring {_pieces(unknown)}, which the code requires, is not given."


def _effect(pieces: list[Piece], chosen: list[Piece], money: str, safety: list[str]) -> str:
    """Return what anchoring the chosen pieces prevents, and saves."""

    def falls(counted: list[Piece]) -> float:
        return sum(one.number * one.chance.value for one in counted)

    said = []
    safe, of_all = [[one for one in every if one.safety] for every in (chosen, pieces)]
    if falls(safe) > 0.0:
        marks = dict.fromkeys(word for one in of_all for word in one.consequences if word in safety)
        words = " or ".join(dict.fromkeys(map(that_has, marks))).replace("or that can", "or")
        share = falls(safe) / falls(of_all)
        part = (
            "every fall, as long as the anchors hold," if share > 1.0 - 1e-9 else f"{about_percent(share)} of the falls"
        )
        said.append(f"prevents {part} of pieces {words}")
    saved = sum(one.saving.value for one in chosen if math.isfinite(one.saving.value))
    if saved > 0.0:
        said.append(f"saves {two_digits(saved)}{money} a year")
    elif not said and falls(chosen) > 0.0:
        said.append(f"prevents {about_percent(falls(chosen) / falls(pieces))} of the falls")
    return f"; this {', and '.join(said)}" if said else ""


def _pieces(pieces: list[Piece], most: int = MOST_PIECES, money: str | None = None, kits: bool = False) -> str:
    """Name pieces with floors, kits, with `money` the costs of their lines, and with `kits` those meant for them."""
    named = []
    for one in pieces[:most]:
        kit = f", now held by “{one.kit}”" if one.kit else ""
        cost = "" if money is None else f", {given_number(one.number * one.cost)}{money}"
        named.append(f"“{one.item}” ({floor_name(one.floor)}{kit}{cost}){_kit_of(one) if kits else ''}")
    more = f" and {len(pieces) - most} more" if len(pieces) > most else ""
    comma = "; " if kits and any(one.tried for one in pieces) else ", "
    return f"{comma.join(named)}{more}"
