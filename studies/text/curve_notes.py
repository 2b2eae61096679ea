"""Notes on fitted curves and their rates that a reader needs before relying on them, in sentences."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...core.aliases import Flags
from ...core.wording import given_percent, listed_name, whole_percent
from ...fragility.fitting.states import OVERTURNED, SEPARATED, state_name
from ...fragility.runs.provenance import number_of_motions
from .words import axis_of, floor_name, level_text

FEWEST = 5
"""With fewer runs that reached the state, or that did not, a curve depends on chance."""
WIDEST = 2.0
"""Ratio of the ends of a median's interval above which it is worth a sentence."""
BEYOND = "rate_share_above_levels"
"""Variable with the share of a rate from shaking above the highest that was run."""
UNDER = "rate_share_below_levels"
"""Variable with the share of a rate from shaking below the lowest that was run."""
EXCEEDED = "rate_above_highest_level"
LEFT_OUT = "rate_share_left_out"
"""Variable with the annual rate of shaking above the highest that was run."""
AT_HIGHEST = "probability_at_highest_level"
"""Variable with the probability of a curve at the highest shaking that was run."""
NOTABLE = 0.05
"""Share of a rate from beyond the known range above which it is worth a sentence."""
SETTLED = 0.95
"""Probability from which a curve has little left to rise."""
ALIKE = 1e-6
"""Relative difference below which sizes are the same."""
LARGE = 100.0
"""Ratio above which no number is given."""
MEASURED = 0.95  # the confidence of the intervals whose coverage is measured
FAR_APART, MANY_MOTIONS = 1.5, 100
"""Dispersions between levels, and motions, from which on intervals between levels hold less than they say."""
MOST_NAMED = 3  # curves that a note names
STATES = {
    state_name(OVERTURNED): ("overturns", "overturned"),
    state_name("uplifted"): ("uplifts", "uplifted"),
    state_name("front"): ("falls forward", "fell forward"),
    state_name("back"): ("falls backward", "fell backward"),
    state_name("fallen_off"): ("falls over an edge", "fell over an edge"),
}
"""The verb for a block that reaches a state, and for runs that reached it."""


def held_apart(results: xr.Dataset) -> str:
    """What intervals of levels hold that lie between levels far apart, with many motions; nothing elsewhere."""
    cloud, levels = results.attrs.get("design") == "cloud", np.unique(axis_of(results).values)
    if cloud or levels.size < 2 or "motion" not in results.dims or number_of_motions(results) <= MANY_MOTIONS:
        return ""
    far = "dispersion" in results and np.diff(np.log(levels)).max() > FAR_APART * float(results["dispersion"].min())
    if not far or results.attrs.get("confidence", MEASURED) != MEASURED:
        return ""
    return f" (85 to 98 % of those between levels over {FAR_APART} β apart hold the true level)"


def state_in(results: xr.Dataset) -> str:
    """The name of the state that the curves of results are of."""
    return str(results.attrs.get("state", state_name(OVERTURNED)))


def verb_in(results: xr.Dataset) -> str:
    """The verb for a block that reaches the state that the curves of results are of."""
    return verb_of(state_in(results))


def verb_of(state: str) -> str:
    """The verb for a block that reaches a state, by the state's name: overturns, uplifts."""
    return STATES[state][0] if state in STATES else f"reaches {state}"


def reached_of(state: str) -> str:
    """The past verb for a run that reached a state, by the state's name: overturned, uplifted."""
    return STATES[state][1] if state in STATES else f"reached {state}"


def action_of(verb: str, name: str) -> str:
    """What a motion does to a block, in the infinitive: overturn it, uplift it, bring it to a rotation."""
    if verb.startswith("falls "):
        return f"make {name} {infinitive_of(verb)}"
    return f"{verb[:-1]} {name}" if verb.endswith("s") else f"bring {name} to {verb.removeprefix('reaches ')}"


def curve_notes(curves: xr.Dataset, reached: xr.DataArray, runs: xr.DataArray, state: str) -> list[str]:
    """Notes on curves of few `runs` that `reached` the state, and on levels of half with wide intervals."""
    status = curves["status"]
    reached, runs = (one.transpose(*status.dims) for one in (reached, runs))
    found = []
    did, stayed = reached_of(state), f"did not {infinitive_of(verb_of(state))}"
    for few, number, what, cure in (
        (reached, reached, did, "higher levels"),
        (runs - reached, runs - reached, stayed, "lower levels"),
    ):
        here = (few.values < FEWEST) & (runs.values > 0)
        if here.any():
            of = [f"{int(a)} of {int(b)}" for a, b in zip(*_first(here, number.values, runs.values), strict=True)]
            rest = "it rests" if here.sum() == 1 else "they rest"
            found.append(
                f"fewer than {FEWEST} runs {what} for {_how_many(here)} ({_listed(status, here, of)}): {rest} on them; "
                f"take more motions or {cure}"
            )
    apart = status.values == SEPARATED
    if apart.any():
        found.append(
            f"data are separated for {_how_many(apart)} ({_listed(status, apart)}): no two levels have both runs that "
            f"{did} and runs that did not, so the dispersion is a guess (penalised likelihood); take more motions or "
            "closer levels"
        )
    if "half_level_lower" in curves:
        lower, upper = (curves[f"half_level_{end}"].transpose(*status.dims).values for end in ("lower", "upper"))
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = upper / lower
        wide = np.isfinite(curves["half_level"].transpose(*status.dims).values) & (ratio > WIDEST)
        if wide.any():
            of = [f"{one:.1f}" if one < LARGE else f"more than {LARGE:g}" for one in _first(wide, ratio)[0]]
            found.append(
                f"the interval of the level at which half {did} is wider than a factor of {WIDEST:g} for "
                f"{_how_many(wide)} ({_listed(status, wide, of)}): take more motions"
            )
    return found


def misfit_notes(curves: xr.Dataset, state: str) -> list[str]:
    """Notes on curves whose median or 10 % level lies outside the interval of the level at which that share fell."""
    rest = 'rates and exports are those of the fitted curve; compare with form = "isotonic", which follows any runs'
    return [
        note
        for name, level, share in (("misfit", "median", "half"), ("misfit_low", "level of 10 %", "a tenth"))
        for note in _misses(
            curves[name].transpose(*curves["status"].dims),
            f"{level} is not where {share} of them {reached_of(state)}; {rest}",
        )
    ]


def _misses(off: xr.DataArray, what: str) -> list[str]:
    """Say of which curves something is off, relative to the runs; 0 where nothing is."""
    here = off.values != 0.0
    if not here.any():
        return []
    of = [
        f"{100.0 * one:+.1f} %" if math.isfinite(one) else "the runs have none" for one in _first(here, off.values)[0]
    ]
    verb, their = ("misses its", "its") if int(here.sum()) == 1 else ("miss their", "their")
    return [f"{_how_many(here)} ({_listed(off, here, of)}) {verb} runs: {their} {what}"]


def spacing_notes(curves: xr.Dataset) -> list[str]:
    """Return one sentence on curves that were fitted to first overturnings, none on other curves."""
    if "level_shift" not in curves:
        return []
    shifts = curves["level_shift"].values.ravel()
    known = np.expm1(shifts[np.isfinite(shifts)])
    text = "the curves are of first overturnings, which closer levels find earlier, without an end"
    spacing = float(curves.attrs.get("level_spacing", math.nan))
    if math.isfinite(spacing):
        text += f": levels are up to {whole_percent(spacing)} apart"
    if known.size:
        low, high = (whole_percent(float(end)) for end in (known.min(), known.max()))
        much = low if low == high else f"{low} to {high}"
        text += f", and with every other level first overturnings come {much} later"
    return [text]


def modelling_note(dispersion: float, where: str) -> str:
    """Return what the rates hold of modelling uncertainty, in a sentence."""
    if dispersion == 0.0:
        return (
            "rates hold no modelling uncertainty (modelling_dispersion = 0; FEMA P-58 combines two parts of 0.1 to "
            "0.4 each)"
        )
    if where == "mean":
        return f"rates hold a modelling uncertainty of β_m = {dispersion:g}, in the mean"
    return (
        f"fractiles of the rate hold a modelling uncertainty of β_m = {dispersion:g}; rates of single branches do not"
    )


SLIPS_WITHOUT_BRANCHES = "chances and rates of slips are of the study's own motions and hazard, not over its branches"
"""What is to be said of a study with branches whose pieces may slide."""


def level_modelling_note(dispersion: float) -> str:
    """Return what chances at given levels hold of modelling uncertainty, in a sentence."""
    return (
        f"chances and numbers at a level hold a modelling uncertainty of β_m = {dispersion:g}, from runs at levels up "
        f"to {math.exp(3.0 * dispersion):.2g} times lower and higher; the ranking of what anchoring saves does not"
    )


def branches_beyond(results: xr.Dataset) -> str:
    """Return how many branches rest on shaking beyond hazard curves or runs, for a title; empty without any."""
    if "branch_share_beyond" not in results:
        return ""
    share = results["branch_share_beyond"]
    largest = share.max([dim for dim in share.dims if dim != "branch"]).values
    many = int((largest > NOTABLE).sum())
    if not many:
        return ""
    return (
        f"{many} of {largest.size} branches: more than {given_percent(NOTABLE)} of a rate is a guess, from beyond the "
        "hazard curve or the runs"
    )


def branches_beyond_note(beyond: Sequence[float], names: Sequence[str]) -> list[str]:
    """Return what is to be known of branches whose rates come from shaking beyond hazard curves or levels.

    `beyond` is the share of each branch's rate (its largest over blocks) from such shaking.
    """
    many = [share for share in beyond if share > NOTABLE]
    if not many:
        return []
    worst = max(range(len(names)), key=lambda i: beyond[i])
    return [
        f"in {len(many)} of {len(names)} branches part of a rate comes from shaking beyond the hazard curve or above "
        f"the highest runs, up to {whole_percent(beyond[worst])} ({names[worst]})"
    ]


class LevelEnd(NamedTuple):
    """The lowest or the highest shaking that was run: its name (the last level), and advice (raise ida.levels.to)."""

    name: str
    cure: str


def extrapolated_shares(results: xr.Dataset) -> dict[str, xr.DataArray]:
    """Return shares of annual rates ``below`` and ``above`` run levels, 0 if up to `NOTABLE`; empty without."""
    found = {side: results[name] for side, name in (("below", UNDER), ("above", BEYOND)) if name in results}
    if "above" in found:
        found["above"] = found["above"].where(possible_change(results) > NOTABLE, 0.0)
    return {side: one.where(np.isfinite(results["rate"])) for side, one in found.items()}


def rate_bounds(results: xr.Dataset) -> tuple[xr.DataArray, xr.DataArray] | None:
    """Return the least and the greatest possible rate over the given one.

    Above the highest level run it is P H to H: P its probability there, H the annual rate of such shaking.
    """
    if not {BEYOND, AT_HIGHEST, EXCEEDED} <= {*results}:
        return None
    run, share = 1.0 - results[BEYOND], results[EXCEEDED] / results["rate"].where(results["rate"] > 0.0)
    return run + results[AT_HIGHEST] * share, run + share


def possible_change(results: xr.Dataset) -> xr.DataArray:
    """Return by how much of itself a rate may be off for what its curve does above the highest shaking that was run."""
    bounds = rate_bounds(results)
    if bounds is None:
        return results[BEYOND]
    low, high = bounds
    return (1.0 - low).where(1.0 - low > high - 1.0, high - 1.0)


def rate_notes(
    rates: xr.Dataset,
    settled: xr.DataArray,
    hazard_ends: tuple[float, float],
    highest: LevelEnd,
    lowest: LevelEnd | None = None,
    of_formula: bool = False,
) -> list[str]:
    """Notes on rates from beyond the hazard curve or the levels; `settled`: probabilities at the highest level."""
    beyond = rates[BEYOND]
    found = []
    under = [] if lowest is None else [(rates[UNDER], rates[UNDER].values > NOTABLE, _unknown_at("below", lowest))]
    for share, here, where in (
        *(
            (
                rates[f"rate_share_{side}"],
                rates[f"rate_share_{side}"].values > NOTABLE,
                beyond_hazard(side, end, of_formula),
            )
            for side, end in zip(
                ("below", "above"), (level_text(one, rates["bin"]) for one in hazard_ends), strict=True
            )
        ),
        (
            beyond,
            (beyond.values > NOTABLE) & (settled.transpose(*beyond.dims).values < SETTLED),
            _unknown_at("above", highest),
        ),
        *under,
    ):
        if here.any():
            shown = np.where(here, share.values, 0.0)
            worst = tuple(int(i) for i in np.unravel_index(int(shown.argmax()), shown.shape))
            more = int(here.sum()) - 1
            least = given_percent(NOTABLE)
            others = f" (and more than {least} of {more} other{'s' if more > 1 else ''})" if more else ""
            found.append(
                f"{whole_percent(shown[worst])} of the annual rate of {_name(share, worst)}{others} comes from shaking "
                f"{where}"
            )
    if "rate_lower" in rates:
        lower, upper = rates["rate_lower"].values, rates["rate_upper"].values
        alike = np.isfinite(upper) & (lower == upper)
        if alike.any():
            found.append(
                f"the interval of the annual rate has no width for {_how_many(alike)} "
                f"({_listed(rates['rate'], alike)}): however motions are drawn from these the curve is the same, and "
                "where it rises between two levels is not known; take closer levels and more motions"
            )
    if "rate_misfit" in rates:
        found += _misses(rates["rate_misfit"], "annual rate is not that of the runs; its interval contains both")
    return found


def _unknown_at(side: str, end: LevelEnd) -> str:
    return f"{side} {end.name}, where the curve is not known: {end.cure}"


def beyond_hazard(side: str, end: str, of_formula: bool = False) -> str:
    """Return the words on shaking beyond an end of a hazard curve, with the advice; `end`: that level as text."""
    if of_formula:
        return f"{side} {end}, where the formula of the hazard is extrapolated: give points of a hazard curve"
    which, other = {"below": ("first", "lower"), "above": ("last", "higher")}[side]
    return (
        f"{side} the hazard curve's {which} level ({end}), where only its {which} slope is known: give the curve at "
        f"{other} levels"
    )


def family_notes(curves: xr.Dataset, along: str) -> list[str]:
    """A note for blocks that differ in more than the size that is solved for: one sentence, or none.

    The blocks of a family with one free size share another size: all slendernesses of one R, all widths of one height.
    """
    others = [name for name in ("alpha", "R", "width", "height") if name != along and name in curves.coords]
    values = [np.asarray(curves[name].values, dtype=float) for name in others]
    if not others or any(np.ptp(one) <= ALIKE * abs(one).max() for one in values):
        return []
    return [
        f"the size that is looked for is of blocks that differ in {along}, {', '.join(others[:-1])}"
        f"{' and ' if len(others) > 1 else ''}{others[-1]}: a number for them is of no block in particular; take a "
        "family with one free size, such as widths of one height"
    ]


def infinitive_of(verb: str) -> str:
    """The infinitive of a verb with its object: overturn, fall forward."""
    first, _, rest = verb.partition(" ")
    return f"{first.removesuffix('es' if first == 'reaches' else 's')} {rest}".strip()


def _how_many(here: Flags) -> str:
    return f"{int(here.sum()):,} of {here.size:,} curves" if here.size > 1 else "the curve"


def _listed(like: xr.DataArray, here: Flags, said: list[str] | None = None) -> str:
    """The names of the first curves where `here` is True, each with its text in `said`."""
    every = np.argwhere(here)
    names = [_name(like, tuple(int(i) for i in at)) for at in every[:MOST_NAMED]]
    words = names if said is None else [f"{name}: {one}" for name, one in zip(names, said, strict=True)]
    more = len(every) - MOST_NAMED
    return "; ".join(words) + (f"; and {more:,} more" if more > 0 else "")


def _first(here: Flags, *values: NDArray[Any]) -> list[NDArray[Any]]:
    """The values of the curves that `_listed` names."""
    return [one[here][:MOST_NAMED] for one in values]


def _name(like: xr.DataArray, at: tuple[Any, ...]) -> str:
    """The name of a curve: its block, law and floor, as far as the curves differ in them."""
    labels = {str(dim): str(like[dim].values[i]) for dim, i in zip(like.dims, at, strict=True) if dim in like.coords}
    alone = [dim for dim in labels if dim != "block" and like.sizes[dim] == 1]
    text = listed_name(labels.get("block", "the block"))
    if "model" in labels and "model" not in alone:
        text += f" under {labels['model']}"
    if "floor" in labels:
        text += f", {floor_name(labels['floor'])}"
    return text
