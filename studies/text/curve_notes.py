"""Notes on fitted curves and their rates that a reader needs before relying on them."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...core.aliases import Flags
from ...core.facts import Fact
from ...core.wording import given_percent, listed_name
from ...fragility.fitting.states import OVERTURNED, SEPARATED, state_name
from .words import floor_name, level_text

FEWEST = 5
"""With fewer runs that reached the state, or that did not, a curve depends on chance."""
WIDEST = 2.0
"""Ratio of the ends of a median's interval above which it is worth a sentence."""
BEYOND = "rate_share_above_levels"
"""Variable with the share of a rate from motions above the highest level of the runs."""
UNDER = "rate_share_below_levels"
"""Variable with the share of a rate from motions below the lowest level of the runs."""
EXCEEDED = "rate_above_highest_level"
LEFT_OUT = "rate_share_left_out"
"""Variable with the annual rate of motions above the highest level of the runs."""
AT_HIGHEST = "probability_at_highest_level"
"""Variable with the probability of a curve at the highest level of the runs."""
NOTABLE = 0.05
"""Share of a rate from beyond the known range above which it is worth a sentence."""
SETTLED = 0.95
"""Probability from which a curve has little left to rise."""
ALIKE = 1e-6
"""Relative difference below which sizes are the same."""
MOST_NAMED = 3  # curves that a note names
STATES = {
    state_name(OVERTURNED): ("overturns", "overturned"),
    state_name("uplifted"): ("uplifts", "uplifted"),
    state_name("front"): ("falls forward", "fell forward"),
    state_name("back"): ("falls backward", "fell backward"),
    state_name("fallen_off"): ("falls over an edge", "fell over an edge"),
}
"""The verb for a block that reaches a state, and for runs that reached it."""


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
    """Effect of a motion on a block, in the infinitive: overturn it, uplift it, bring it to a rotation."""
    if verb.startswith("falls "):
        return f"make {name} {infinitive_of(verb)}"
    return f"{verb[:-1]} {name}" if verb.endswith("s") else f"bring {name} to {verb.removeprefix('reaches ')}"


def curve_notes(curves: xr.Dataset, reached: xr.DataArray, runs: xr.DataArray, state: str) -> list[Fact]:
    """Return notes on curves of few `runs` that `reached` the state, and on levels of half with wide intervals."""
    status = curves["status"]
    reached, runs = (counts_of.transpose(*status.dims) for counts_of in (reached, runs))
    facts = []
    for what, few in (("curve.few_reached", reached), ("curve.few_stayed", runs - reached)):
        scarce = (few.values < FEWEST) & (runs.values > 0)
        if scarce.any():
            counts = [[int(count), int(of)] for count, of in zip(*_first(scarce, few.values, runs.values), strict=True)]
            facts.append(_of_curves(what, status, scarce, values=counts, fewest=FEWEST, state=state))
    apart = status.values == SEPARATED
    if apart.any():
        facts.append(_of_curves("curve.separated", status, apart, state=state))
    if "half_level_lower" in curves:
        lower, upper = (curves[f"half_level_{end}"].transpose(*status.dims).values for end in ("lower", "upper"))
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = upper / lower
        wide = np.isfinite(curves["half_level"].transpose(*status.dims).values) & (ratio > WIDEST)
        if wide.any():
            ratios = _first(wide, ratio)[0].tolist()
            facts.append(_of_curves("curve.wide_interval", status, wide, values=ratios, widest=WIDEST, state=state))
    return facts


def misfit_notes(curves: xr.Dataset, state: str) -> list[Fact]:
    """Return notes on curves whose median or 10 % level is outside the interval of that level of the runs."""
    dims = curves["status"].dims
    return [
        *_misses("curve.misfit", curves["misfit"].transpose(*dims), state=state),
        *_misses("curve.misfit_low", curves["misfit_low"].transpose(*dims), state=state),
    ]


def _misses(what: str, off: xr.DataArray, **more: Any) -> list[Fact]:
    """Return of which curves something is off, relative to the runs; 0 if nothing is."""
    missed = off.values != 0.0
    return (
        [_of_curves(what, off, missed, values=_first(missed, off.values)[0].tolist(), **more)] if missed.any() else []
    )


def spacing_notes(curves: xr.Dataset) -> list[Fact]:
    """Return the note on curves that were fitted to first overturnings, none on other curves."""
    if "level_shift" not in curves:
        return []
    shifts = curves["level_shift"].values.ravel()
    known = np.expm1(shifts[np.isfinite(shifts)])
    low, high = (float(known.min()), float(known.max())) if known.size else (math.nan, math.nan)
    return [Fact("curve.first_overturnings", float(curves.attrs.get("level_spacing", math.nan)), low, high)]


def modelling_note(dispersion: float, where: str) -> Fact:
    """Return the note on modelling uncertainty in rates."""
    if dispersion == 0.0:
        return Fact("uncertainty.modelling_none")
    return Fact("rate.modelling_included", dispersion, more={"yearly": True, "spread": where != "mean"})


SLIPS_WITHOUT_BRANCHES = Fact("sliding.without_branches")
"""Fact of a study with branches whose pieces may slide."""


def level_modelling_note(dispersion: float) -> Fact:
    """Return the note on modelling uncertainty in probabilities at given levels."""
    return Fact("chance.modelling_included", dispersion, upper=math.exp(3.0 * dispersion))


def branches_beyond(results: xr.Dataset) -> str:
    """Return the number of branches that depend on levels beyond hazard curves or runs, for a title."""
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


def branches_beyond_note(beyond: Sequence[float], names: Sequence[str]) -> list[Fact]:
    """Return the note on branches whose rates are from beyond hazard curves or levels.

    `beyond` is that share of each branch's rate (its largest over blocks).
    """
    many = sum(share > NOTABLE for share in beyond)
    if not many:
        return []
    worst = max(range(len(names)), key=lambda i: beyond[i])
    more = {"branches": many, "of": len(names)}
    return [Fact("rate.branches_beyond", float(beyond[worst]), names=(names[worst],), more=more)]


def extrapolated_shares(results: xr.Dataset) -> dict[str, xr.DataArray]:
    """Return shares of annual rates ``below`` and ``above`` run levels, 0 if up to `NOTABLE`; empty without."""
    shares = {side: results[name] for side, name in (("below", UNDER), ("above", BEYOND)) if name in results}
    if "above" in shares:
        shares["above"] = shares["above"].where(possible_change(results) > NOTABLE, 0.0)
    return {side: share.where(np.isfinite(results["rate"])) for side, share in shares.items()}


def rate_bounds(results: xr.Dataset) -> tuple[xr.DataArray, xr.DataArray] | None:
    """Return the minimum and the maximum possible rate over the given one.

    Above the highest level run it is P H to H: P its probability there, H the annual rate of such motions.
    """
    if not {BEYOND, AT_HIGHEST, EXCEEDED} <= {*results}:
        return None
    run, share = 1.0 - results[BEYOND], results[EXCEEDED] / results["rate"].where(results["rate"] > 0.0)
    return run + results[AT_HIGHEST] * share, run + share


def possible_change(results: xr.Dataset) -> xr.DataArray:
    """Return the possible relative error of a rate from its curve above the highest level of the runs."""
    bounds = rate_bounds(results)
    if bounds is None:
        return results[BEYOND]
    low, high = bounds
    return (1.0 - low).where(1.0 - low > high - 1.0, high - 1.0)


def rate_notes(
    rates: xr.Dataset,
    settled: xr.DataArray,
    hazard_ends: tuple[float, float],
    cures: tuple[str, str],
    run: str = "level",
    of_formula: bool = False,
) -> list[Fact]:
    """Return notes on rates from beyond the hazard curve or the runs.

    `settled`: probabilities at the highest level of the runs. `cures`: remedies that reach lower and higher levels.
    `run`: ends of the runs: a level, a stripe or a motion.
    """
    facts = []
    for side, end in zip(("below", "above"), hazard_ends, strict=True):
        share = rates[f"rate_share_{side}"]
        more = {"side": side, "end": level_text(end, rates["bin"]), "formula": of_formula}
        facts += _comes("rate.beyond_hazard", share, share.values > NOTABLE, more)
    above = rates[BEYOND]
    unsettled = (above.values > NOTABLE) & (settled.transpose(*above.dims).values < SETTLED)
    facts += _comes("rate.extrapolated", above, unsettled, {"side": "above", "run": run, "cure": cures[1]})
    if UNDER in rates:
        more = {"side": "below", "run": run, "cure": cures[0]}
        facts += _comes("rate.extrapolated", rates[UNDER], rates[UNDER].values > NOTABLE, more)
    if "rate_lower" in rates:
        lower, upper = rates["rate_lower"].values, rates["rate_upper"].values
        alike = np.isfinite(upper) & (lower == upper)
        if alike.any():
            facts.append(_of_curves("rate.no_width", rates["rate"], alike))
    if "rate_misfit" in rates:
        facts += _misses("rate.misfit", rates["rate_misfit"])
    return facts


def _comes(what: str, share: xr.DataArray, notable: Flags, more: Mapping[str, Any]) -> list[Fact]:
    """Return the note on the largest share of a rate that comes from somewhere, with the number of other rates."""
    if not notable.any():
        return []
    shown = np.where(notable, share.values, 0.0)
    worst = tuple(int(i) for i in np.unravel_index(int(shown.argmax()), shown.shape))
    others = {"others": int(notable.sum()) - 1, "notable": NOTABLE}
    return [Fact(what, float(shown[worst]), names=(_name(share, worst),), more={**more, **others})]


def family_notes(curves: xr.Dataset, along: str) -> list[Fact]:
    """Return the note on blocks that differ in more than the size that is solved for, or none.

    The blocks of a family with one free size share another size: all slendernesses of one R, all widths of one height.
    """
    others = [name for name in ("alpha", "R", "width", "height") if name != along and name in curves.coords]
    values = [np.asarray(curves[name].values, dtype=float) for name in others]
    if not others or any(np.ptp(value) <= ALIKE * abs(value).max() for value in values):
        return []
    return [Fact("size.of_no_block", names=(along, *others))]


def infinitive_of(verb: str) -> str:
    """The infinitive of a verb with its object: overturn, fall forward."""
    first, _, rest = verb.partition(" ")
    return f"{first.removesuffix('es' if first == 'reaches' else 's')} {rest}".strip()


def _of_curves(what: str, like: xr.DataArray, at_curves: Flags, **more: Any) -> Fact:
    """Return a fact of the curves if `at_curves` is True: their number, and the names of the first."""
    names = (_name(like, tuple(int(i) for i in at)) for at in np.argwhere(at_curves)[:MOST_NAMED])
    return Fact(what, int(at_curves.sum()), names=tuple(names), more={"of": at_curves.size, **more})


def _first(at_curves: Flags, *values: NDArray[Any]) -> list[NDArray[Any]]:
    """Return the values of the curves that are named."""
    return [value[at_curves][:MOST_NAMED] for value in values]


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
