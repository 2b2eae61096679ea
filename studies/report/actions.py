"""What a report tells its client to do: what the answer asks for, and how far its validity checks went."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping

import numpy as np
import xarray as xr

from ...wording import about_percent, currency_of, given_number, interval_text, percent, two_digits
from ..buildings.pieces import DUTY, REDUCES, SAFER, SAFETY, SMALL, WEAK, WORTH, Piece, pieces_of
from ..buildings.pieces import YEARS as PIECE_YEARS
from ..buildings.variables import JOINT
from ..codes.check import UNCHECKED as NOT_CHECKED
from ..text.words import floor_name, reference_law
from .validity import GOOD, Check

MOST_PIECES = 5
"""Largest number of pieces that a step names."""


def next_steps(results: xr.Dataset, checks: list[Check]) -> list[str]:
    """Return the next steps: those that follow from the answer, and what an engineer should look at first."""
    bad = sum(one.word != GOOD for one in checks)
    if not bad:
        return list(_actions(results))
    them = "check that is" if bad == 1 else "checks that are"
    look = (
        f"Before any decision that cannot be reversed, have an engineer review the {bad} of {len(checks)} validity "
        f"{them} not rated “{GOOD}”; the technical appendix says what to do about each."
    )
    return [*_actions(results), look]


def _actions(results: xr.Dataset) -> Iterator[str]:
    """Yield the next steps that follow from the answer itself."""
    kind = str(results.attrs["kind"])
    at, _ = reference_law(results)
    if kind == "performance":
        pieces = pieces_of(results, at)
        yield from _duties(pieces, results)
        first = [one for one in pieces if one.recommendation == REDUCES]
        if first:
            if all(one.safety for one in first):
                words = dict.fromkeys(word for one in first for word in one.consequences if word in _safety(results))
                yield f"Anchor first, for safety ({', '.join(words)}): {_pieces(first)}."
                if also := [one for one in pieces if one.recommendation == SAFER]:
                    yield f"Anchoring these also makes people safer: {_pieces(also)}."
            else:
                yield f"Most of the risk comes from {_pieces(first)}: anchor them first."
        worth = [one for one in pieces if one.recommendation == WORTH]
        if worth:
            yield f"Anchoring saves more than it costs within {PIECE_YEARS:g} years: {_pieces(worth)}."
        yield from _spent(pieces, results)
        yield from _bought(pieces, results)
        if "code" not in results.attrs:
            yield (
                "Code requirements are not checked. Any piece that the law requires to be anchored must be anchored, "
                "whatever these results say."
            )
    elif "size_along" in results.attrs:
        yield from _sizes(results)
    elif kind == "fragility" and "rate" not in results:
        yield (
            "Compare these levels with the shaking expected at the site; given a hazard curve for the site, the report "
            "also says how often that happens."
        )


def _safety(results: xr.Dataset) -> list[str]:
    """Return the consequences that are a matter of safety."""
    return str(results.attrs.get("safety", JOINT.join(SAFETY))).split(JOINT)


def _sizes(results: xr.Dataset) -> Iterator[str]:
    """Yield the size that meets the target under the reference law, on each floor, and under the other laws."""
    along = str(results.attrs["size_along"])
    found = results[f"size_{along}"]
    unit = f" {found.attrs['units']}".replace(" 1", "")
    target = f"{percent(float(results.attrs['size_probability']))} in {float(results.attrs['years']):g} years"
    at, _ = reference_law(results)
    for floor in found["floor"].values.tolist() if "floor" in found.dims else [None]:
        here = results if floor is None else results.sel(floor=floor)
        where = "" if floor is None else f" on {floor_name(floor)}"
        value, low, high = (float(here[f"size_{along}{end}"].isel(model=at)) for end in ("", "_lower", "_upper"))
        if not math.isfinite(value):
            yield f"No {along} was found that meets the target of {target}{where}."
            continue
        others = np.delete(here[f"size_{along}"].values, at)
        others = others[np.isfinite(others)]
        ends = [two_digits(float(one)) for one in (others.min(), others.max())] if others.size else []
        laws = "law" if others.size == 1 else "laws"
        other = f"; {' to '.join(dict.fromkeys(ends))}{unit} under the other {laws}" if ends else ""
        yield (
            f"For a probability of overturning of no more than {target}{where}, a {along} of {two_digits(value)}{unit} "
            f"is needed ({interval_text(low, high, two_digits)}{other})."
        )


def _duties(pieces: list[Piece], results: xr.Dataset) -> Iterator[str]:
    """Yield what the building code requires."""
    if "code" not in results.attrs:
        return
    duty = [one for one in pieces if one.recommendation == DUTY]
    weak = [one for one in pieces if one.recommendation == WEAK]
    unknown = [one for one in pieces if one.code is not None and one.code.status == NOT_CHECKED]
    if duty:
        yield f"Anchor the following, which {results.attrs['code']} requires whatever the risk: {_pieces(duty)}."
    if weak:
        held = " (all rates assume that they hold)" if all(one.held for one in weak) else ""
        yield (
            "Strengthen the anchors of the following, which are weaker than the force that the code requires"
            f"{held}: {_pieces(weak)}."
        )
    if unknown:
        clauses = [one.code.clause for one in unknown if one.code is not None]
        why = ", ".join(dict.fromkeys(clause.partition(": ")[2] or clause for clause in clauses))
        yield f"The code could not be checked for {_pieces(unknown, len(unknown))}: {why}."


def budget_steps(results: xr.Dataset) -> list[str]:
    """Return what is best done with the study's budget under the reference law; nothing without a budget."""
    return list(_spent(pieces_of(results, reference_law(results)[0]), results))


def _spent(pieces: list[Piece], results: xr.Dataset) -> Iterator[str]:
    """Yield what is best done with the study's budget."""
    if "budget_chosen" not in results:
        return
    at, _ = reference_law(results)
    money = f" {currency_of(results)}" if currency_of(results) else ""
    budget = f"{given_number(float(results.attrs['budget']))}{money}"
    chosen = [one for one in pieces if one.chosen]
    if not chosen:
        yield f"No line that matters can be anchored for {budget}."
        return
    cost = sum(one.number * one.cost for one in chosen)
    names = _pieces(chosen, len(chosen))
    effect = _effect(pieces, chosen, money, _safety(results))
    yield f"With a budget of {budget}, anchor {names}, at a cost of {given_number(cost)}{money}{effect}."
    gap = float(results["budget_gap"].values[at])
    over = float(results.attrs["budget"]) - cost
    others = [one for one in pieces if not one.chosen and one.number * one.cost <= over and not one.held]
    wanted = (REDUCES, SAFER, WORTH)
    dear = [one for one in pieces if not one.chosen and one.recommendation in wanted and one.number * one.cost > over]
    if others and gap == 0.0 and all(one.recommendation == SMALL for one in others):
        yield (
            f"{given_number(over)}{money} would be left over; no other line that this would pay for saves more than it "
            "costs."
        )
    elif dear and gap == 0.0:
        first = " after what the code requires" if all(one.recommendation == DUTY for one in chosen) else ""
        together = "; all pieces of a line are anchored together" if any(one.number > 1 for one in dear) else ""
        yield (
            f"{_pieces(dear, money=money)} {'does' if len(dear) == 1 else 'do'} not fit: {given_number(over)}{money} "
            f"would be left over{first}{together}, and no other choice within this budget does better."
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


def _bought(pieces: list[Piece], results: xr.Dataset) -> Iterator[str]:
    """Yield the kits to buy for the study's budget, and the cheapest that meet its target."""
    here = results.isel(model=reference_law(results)[0])
    money = f" {currency_of(results)}" if currency_of(results) else ""
    when = "a year" if "item_rate" in results else "at the level of the tables"
    for name in ("budget", "target"):
        if f"{name}_kit" not in results:
            continue
        if name == "target" and not bool(here["target_met"]):
            limits = _limits(json.loads(results.attrs["target"]), money)
            yield f"No set of the kits that were tried keeps the building within {limits} {when}."
            continue
        kits = {str(item): str(kit) for item, kit in zip(here["item"].values, here[f"{name}_kit"].values, strict=True)}
        named = [f"“{one.item}” ({floor_name(one.floor)}): {kits[one.item]}" for one in pieces if kits[one.item]]
        cost = f"{given_number(float(here[f'{name}_cost']))}{money}"
        falls, front = (two_digits(float(here[f"{name}_{one}"])) for one in ("falls", "front_falls"))
        then = f"about {falls} pieces would then fall {when}, {front} of them into the room"
        if name == "budget":
            budget = f"{given_number(float(results.attrs['budget']))}{money}"
            if not named:
                yield f"No kit that is worth its cost can be bought for {budget}."
                continue
            yield f"With a budget of {budget}, the best kits are {'; '.join(named)}. They cost {cost}; {then}."
        else:
            limits = _limits(json.loads(results.attrs["target"]), money)
            what = f"the cheapest kits are {'; '.join(named)}. They cost {cost}" if named else "no kit is needed"
            yield f"To stay within {limits} {when}, {what}; {then}."
        gap = float(here[f"{name}_gap"])
        if gap > 0.0:
            by = f", by up to {two_digits(100.0 * gap)} %" if math.isfinite(gap) else ""
            yield f"Another set of kits may be better than this one{by}: the search was stopped."


def _limits(target: Mapping[str, float], money: str) -> str:
    """Return what a target allows, in words."""
    words = {"falls": "falls", "front_falls": "falls into the room", "injuries": "injured persons", "loss": "lost"}
    return " and ".join(
        f"{given_number(most)}{money if name == 'loss' else ''} {words[name]}" for name, most in target.items()
    )


def _effect(pieces: list[Piece], chosen: list[Piece], money: str, safety: list[str]) -> str:
    """Return what anchoring the chosen pieces prevents, and saves."""

    def falls(counted: list[Piece]) -> float:
        return sum(one.number * one.chance.value for one in counted)

    said = []
    safe, of_all = [[one for one in every if one.safety] for every in (chosen, pieces)]
    if falls(safe) > 0.0:
        marks = dict.fromkeys(word for one in of_all for word in one.consequences if word in safety)
        words = " or ".join(f"“{word}”" for word in marks)
        share = falls(safe) / falls(of_all)
        part = "every fall" if share > 1.0 - 1e-9 else f"{about_percent(share)} of the falls"
        said.append(f"prevents {part} of pieces marked {words}")
    saved = sum(one.saving.value for one in chosen if math.isfinite(one.saving.value))
    if saved > 0.0:
        said.append(f"saves {two_digits(saved)}{money} a year")
    elif not said and falls(chosen) > 0.0:
        said.append(f"prevents {about_percent(falls(chosen) / falls(pieces))} of the falls")
    return f"; this {' and '.join(said)}" if said else ""


def _pieces(pieces: list[Piece], most: int = MOST_PIECES, money: str | None = None) -> str:
    """Name pieces with their floors, the kits that hold them, and the costs of their lines where `money` is given."""
    named = []
    for one in pieces[:most]:
        kit = f", now held by “{one.kit}”" if one.kit else ""
        cost = "" if money is None else f", {given_number(one.number * one.cost)}{money}"
        named.append(f"“{one.item}” ({floor_name(one.floor)}{kit}{cost})")
    more = f" and {len(pieces) - most} more" if len(pieces) > most else ""
    return f"{', '.join(named)}{more}"
