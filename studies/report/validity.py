"""Validity checks of a report: the rocking model, the elastic zone, the number of runs, and the widths of intervals.

Each check has a word (good, with care, not valid, not checked), a reason, and a cure.  Only counts and shares are
computed here, from what the screen wrote into the results.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import xarray as xr

from ...fragility.fitting.states import OK, SEPARATED
from ...fragility.numerics.proportions import runs_for_half_width, wilson_half_width
from ...fragility.validity.notes import NOT_MODELLED
from ...fragility.validity.reasons import (
    ELASTIC_MODE,
    SCALED_FAR,
    SLIDES_AT_IMPACT,
    SLIDES_AT_UPLIFT,
    SLIDES_WHILE_ROCKING,
)
from ...fragility.validity.screen import HALF_WIDTH, SQUAT_RATIO
from ...motions.intensity.variability import CURE, NATURAL, SPECTRA, Variability
from ...wording import counted, two_digit_percent
from ..store.content import AS_WRITTEN, EDITED
from ..text.curve_notes import NOTABLE

GOOD, CARE, INVALID, UNKNOWN = "good", "with care", "not valid", "not checked"
"""Words of a check: the first three from best to worst, the last where nothing was checked."""
MARKED, MOST = 0.01, 0.5
"""Share of runs from which a reason needs care, and share above which, for every block and law, it is not valid."""
LARGE_DELTA = 0.1
"""Largest half width of the zone over alpha that Liu, Huang and Qu (2024) use."""
WIDE, HOPELESS = 1.5, 4.0
"""Ratios of the ends of a median's interval: above the first it needs care, above the second it is not valid."""
NO_BETTER_THAN = 0.3
"""Half width of the interval of a probability of 1/2 above which the number of motions is not valid."""
UNSTABLE = 0.05
"""Share of outcomes that a change of a millionth reverses, from which outcomes need care."""
MOST_NAMES = 4
AGAIN = "Run the study with this version."
NO_CHECK = "The results hold no such check."
SLIDING = "Does the block rock rather than slide?"
HAZARD = "Do the annual rates come from shaking that is known?"
ENDS = {"below": "first", "above": "last"}
CURES = {
    "below": "Give the hazard curve at lower levels.",
    "above": "Give the hazard curve at higher levels, and raise the levels of the analysis.",
}
RATES = ("rate", "any_rate")
"""Variables of studies that give annual rates."""


class Check(NamedTuple):
    """One check: its question, its word, the reason, and what is empty where the check is good: cure and clause.

    The clause says in a few words what is wrong, for the badge.
    """

    question: str
    word: str
    reason: str
    cure: str = ""
    clause: str = ""


def checks_of(results: xr.Dataset, state: str = AS_WRITTEN) -> list[Check]:
    """Return every check of a study's results.

    Parameters
    ----------
    results : xarray.Dataset
        A study's results, of any kind.
    state : str
        Whether they are as they were written (`check_content`).

    Returns
    -------
    list of Check
    """
    return [*_edited(state), *_model(results), *_numbers(results)]


def worst_word(found: list[Check]) -> str:
    """Return the worst word of some checks; a check that was not made counts as one that needs care."""
    words = {one.word for one in found}
    return INVALID if INVALID in words else CARE if words & {CARE, UNKNOWN} else GOOD


def worst_clause(found: list[Check]) -> str:
    """Return what is wrong by the worst check in one clause, by the first of the worst word; empty where all are good.

    Checks stand in the order in which a result depends on them: the model comes before the numbers.
    """
    for word in (INVALID, CARE, UNKNOWN):
        for one in found:
            if one.word == word:
                return one.clause
    return ""


def badge(found: list[Check]) -> str:
    """Return the worst word of some checks and what is wrong in one clause."""
    clause = worst_clause(found)
    return f"{worst_word(found)}{f': {clause}' if clause else ''}"


def not_checked() -> list[str]:
    """Return the reservations that no check covers, one sentence each."""
    return [
        f"{NOT_MODELLED[:1].upper()}{NOT_MODELLED[1:]}: neither is how blocks hit walls, each other or people.",
        "Whether the motions are those of the site: they are what the study gives.",
        "Whether the blocks are rigid, evenly loaded and free of whatever holds them in reality.",
    ]


def _edited(state: str) -> Iterator[Check]:
    if state == EDITED:
        reason = "Values or attributes of the result file were edited after the study had written it."
        yield Check(
            "Are these the results of the study?",
            INVALID,
            reason,
            "Run the study again with --fresh.",
            "results were edited",
        )


def _model(results: xr.Dataset) -> Iterator[Check]:
    yield _rocking(results)
    if "outside" not in results:
        reason = "The results hold no shares of the runs for which rocking may be the wrong model."
        yield Check("Were the runs screened?", UNKNOWN, reason, AGAIN, "runs were not screened")
        return
    yield _sliding(results)
    yield _zone(results)


def _numbers(results: xr.Dataset) -> Iterator[Check]:
    yield _motions(results)
    yield _inputs(results)
    yield _spectra(results)
    if "median" in results:
        yield _curves(results)
        yield _intervals(results)
    if "outside" in results:
        yield _scaling(results)
    yield _stability(results)
    if "rate" in results:
        yield _hazard(results)
    elif "annual_number_share_above" in results:
        yield _hazard_of_building(results)


def _rocking(results: xr.Dataset) -> Check:
    question = "Do the blocks rock at all, rather than bounce?"
    needs = _uplift(results)
    if needs is None:
        return Check(question, UNKNOWN, "The results hold no shapes of blocks.", AGAIN, "shapes of blocks are missing")
    squat = needs.values > 1.0 / SQUAT_RATIO
    named = [str(one) for one in needs[needs.dims[0]].values[squat]]
    if not named:
        return Check(question, GOOD, "Every mass centre is at least two half widths high.")
    cure = "Leave them out, or look at them with a model that includes sliding and bouncing."
    reason = f"{_names_text(named)}: the mass centre is less than two half widths high, so that bouncing decides."
    clause = f"{len(named):,} of {counted(squat.size, 'block')} bounce{'s' if len(named) == 1 else ''} rather than rock"
    return Check(question, INVALID if squat.all() else CARE, reason, cure, clause)


def _sliding(results: xr.Dataset) -> Check:
    question = SLIDING
    cure = "Give the available coefficient as [screen] friction; where blocks slide, use a model that includes sliding."
    given = json.loads(str(results.attrs["screen"]))["friction"] is not None
    reasons = (SLIDES_AT_UPLIFT, SLIDES_WHILE_ROCKING, SLIDES_AT_IMPACT)
    shares = results["outside"].sel(reason=[one.name for one in reasons]).max("reason")
    share, where = _worst(shares)
    if share < MARKED and given:
        return Check(question, GOOD, "With the friction given fewer than 1 % of the runs of any block slide.")
    need = float(results["friction_rocking_demand"].max())
    if share < MARKED:
        return Check(
            question,
            UNKNOWN,
            "No coefficient of friction is given; uplift needs up to "
            f"{float(results['friction_uplift'].max()):.2f}, the greatest peak {need:.2f}.",
            cure,
            "no coefficient of friction is given",
        )
    limit = "with the friction given" if given else "unless friction is above 1"
    reason = f"Up to {two_digit_percent(share)} of the runs slide {limit} ({where})."
    clause = f"up to {two_digit_percent(share)} of the runs slide {limit}"
    return Check(question, INVALID if float(shares.min()) > MOST else CARE, reason, cure, clause)


def _uplift(results: xr.Dataset) -> xr.DataArray | None:
    """Return the coefficient of friction that uplift needs, b/h, of every block or item; None where it is not known."""
    if "friction_uplift" in results:
        return results["friction_uplift"]
    known = "alpha" in results.coords and results["alpha"].dims in (("block",), ("item",))
    return xr.ufuncs.tan(results["alpha"]) if known else None


def _zone(results: xr.Dataset) -> Check:
    question = "Is δ, the half width of the law’s elastic zone over α, small enough?"
    cure = "Rely first on a law whose rest is rigid (housner, energy-consistent), and make δ smaller."
    widths = results["delta"].values.astype(float) if "delta" in results.coords else np.array([])
    if "rest" in results.coords and results["rest"].shape == widths.shape:
        # (a law with a rigid rest has no elastic mode that could resonate)
        widths = np.where(results["rest"].values.astype(str) == "rigid", np.nan, widths)
    delta = np.unique(widths[np.isfinite(widths)])
    if not delta.size:
        return Check(question, GOOD, "No law of this study is elastic at rest.")
    largest = f"The law is elastic up to {delta[-1]:.3g} of the angle at which the block tips (δ)"
    bound = f"{'above' if delta[-1] > LARGE_DELTA else 'not above'} {LARGE_DELTA:g}"
    runs = results["outside"].sel(reason=ELASTIC_MODE.name)
    share = runs.mean([dim for dim in runs.dims if dim != "model"])
    resonant = share.values > MARKED
    if not resonant.any() and delta[-1] <= LARGE_DELTA:
        return Check(question, GOOD, f"{largest}, {bound}; no elastic mode lies inside a motion’s band.")
    if not resonant.any():
        return Check(question, CARE, f"{largest}, {bound}.", cure, f"δ of {delta[-1]:.3g} is {bound}")
    names = [str(one) for one in results["model"].values[resonant]]
    reason = (
        f"{largest}, {bound}; but the elastic mode lies inside the band of up to "
        f"{two_digit_percent(float(share.max()))} of the motions for {_names_text(names)}: at rest they resonate and "
        f"uplift where a rigid block stands still."
    )
    clause = f"the elastic mode resonates with up to {two_digit_percent(float(share.max()))} of the motions"
    return Check(question, INVALID if (share.values > MOST).all() else CARE, reason, cure, clause)


def _motions(results: xr.Dataset) -> Check:
    question = "Are there enough motions?"
    screened = json.loads(str(results.attrs.get("screen", "{}")))
    n, widest = (
        int(screened.get("fewest_motions", results.sizes["motion"])),
        float(screened.get("half_width", HALF_WIDTH)),
    )
    half = float(results["interval_half_width"]) if "interval_half_width" in results else wilson_half_width(n)
    reason = f"With {counted(n, 'motion')} a probability of 1/2 is known to ±{half:.2f} (95 %)."
    if half <= widest:
        return Check(question, GOOD, reason)
    return Check(
        question,
        INVALID if half > NO_BETTER_THAN else CARE,
        reason,
        f"Take more motions: {runs_for_half_width(widest)} give ±{widest:g}.",
        f"there {'is' if n == 1 else 'are'} only {counted(n, 'motion')}",
    )


def _inputs(results: xr.Dataset) -> Check:
    question = "Do sizes, levels and records look like real ones?"
    if "doubts" not in results.attrs:
        return Check(question, UNKNOWN, NO_CHECK, AGAIN, "inputs were not checked")
    doubts = [one for one in json.loads(str(results.attrs["doubts"])) if one[0] != SPECTRA]
    kinds = dict.fromkeys(str(kind) for kind, _, accepted in doubts if not accepted)
    if kinds:
        said = (str(sentence).rstrip(".?") for _, sentence, accepted in doubts if not accepted)
        names = ", ".join(f'"{kind}"' for kind in kinds)
        return Check(
            question,
            CARE,
            " ".join(f"{one[:1].upper()}{one[1:]}." for one in said),
            f"Correct them; where they are meant so, put accept = [{names}] at the top of the study file.",
            f"the inputs look odd ({', '.join(kinds)})",
        )
    if doubts:
        names = ", ".join(dict.fromkeys(str(kind) for kind, *_ in doubts))
        return Check(question, GOOD, f"What looks odd is accepted by the study: {names}.")
    return Check(question, GOOD, "Nothing is outside of what exists, and no record keeps an offset or drifts.")


def _spectra(results: xr.Dataset) -> Check:
    question = "Do the motions’ spectra differ as those of earthquakes do?"
    if "spectral_variability" not in results.attrs:
        if "machines" not in results.attrs:
            return Check(question, UNKNOWN, NO_CHECK, AGAIN, "spectra were not compared")
        reason = "Pulses, single motions and floor motions are not compared."
        return Check(question, UNKNOWN, reason, clause="spectra were not compared")
    found = Variability(*json.loads(str(results.attrs["spectral_variability"])))
    reason = f"{found.text}, {NATURAL}."
    if not found.low:
        return Check(question, GOOD, reason)
    alike = "spectra of the motions are too much alike"
    accepted = any(kind == SPECTRA and yes for kind, _, yes in json.loads(str(results.attrs.get("doubts", "[]"))))
    rates = any(name in results for name in RATES)
    cure = f"{CURE[:1].upper()}{CURE[1:]}."
    if not found.narrow:
        why = "That is little, but may be chance: there are few motions."
        return Check(question, CARE, f"{reason} {why}", cure, "spectra of the few motions are alike")
    so = "Curves are too steep" + (", and annual rates far more certain than they are." if rates else ".")
    if accepted:
        if rates:
            return Check(question, CARE, f"{reason} {so} The study accepts it.", cure, alike)
        return Check(question, GOOD, f"{reason} That is little, which the study accepts.")
    return Check(question, INVALID if rates else CARE, f"{reason} {so}", cure, alike)


def _curves(results: xr.Dataset) -> Check:
    question = "Does every curve stand on runs that fell and runs that stood?"
    status = results["status"].values.astype(str)
    none = ~results["converged"].values.astype(bool)
    guessed = status == SEPARATED
    cure = "Take more motions, and levels from where hardly any falls to where nearly all do."
    total = status.size
    if none.any():
        why = ", ".join(f"{np.sum(status[none] == one)} × {one}" for one in dict.fromkeys(status[none]))
        clause = f"{none.sum():,} of {counted(total, 'curve')} cannot be fitted"
        reason = f"{none.sum()} of {total} have no curve ({why})."
        return Check(question, INVALID if none.all() else CARE, reason, cure, clause)
    if guessed.any():
        reason = f"{guessed.sum()} of {total} are separated: their dispersion is a guess."
        clause = f"the dispersion is a guess for {guessed.sum():,} of {counted(total, 'curve')}"
        return Check(question, CARE, reason, cure, clause)
    if (status == OK).all():
        return Check(question, GOOD, f"All {total} do." if total > 1 else "It does.")
    not_ok = f"{np.sum(status != OK)} of {total}"
    return Check(question, CARE, f"{not_ok} are not plainly ok.", cure, f"{not_ok} curves are not plainly ok")


def _intervals(results: xr.Dataset) -> Check:
    question = "Are the intervals narrow enough to decide by?"
    cure = "Take more motions, or decide with the whole interval."
    if "median_lower" not in results:
        return Check(question, UNKNOWN, "The medians have no intervals.", AGAIN, "medians have no intervals")
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = results["median_upper"] / results["median_lower"]
    known = ratio.where(np.isfinite(results["median"]))
    if not bool(known.notnull().any()):
        return Check(question, INVALID, "No median has an interval.", cure, "no median has an interval")
    widest, where = _worst(known)
    reason = f"The widest interval of a median spans a factor of {widest:.3g} ({where})."
    clause = f"the interval of a median spans a factor of {widest:.3g}"
    if not np.isfinite(widest):
        reason, clause = f"An interval of a median is open ({where}).", "the interval of a median is open"
    if widest <= WIDE:
        return Check(question, GOOD, reason)
    return Check(question, INVALID if float(known.min()) > HOPELESS else CARE, reason, cure, clause)


def _scaling(results: xr.Dataset) -> Check:
    question = "Are the motions scaled moderately?"
    share, _ = _worst(results["outside"].sel(reason=SCALED_FAR.name))
    low, high = json.loads(str(results.attrs["screen"]))["factors"]
    if share < MARKED:
        return Check(
            question, GOOD, f"Fewer than 1 % of the runs are scaled by less than {low:g} or more than {high:g}."
        )
    clause = f"up to {two_digit_percent(share)} of the runs are scaled by less than {low:g} or more than {high:g}"
    cure = "Take motions that are as strong as the levels, or stripes of them."
    return Check(question, CARE, f"{clause[:1].upper()}{clause[1:]}.", cure, clause)


def _stability(results: xr.Dataset) -> Check:
    question = "Are the outcomes of single runs stable?"
    if "undecided" not in results:
        reason = "No run was repeated with a perturbation."
        return Check(question, UNKNOWN, reason, clause="no outcome was tested for stability")
    share, where = _worst(results["undecided"])
    many = f"up to {two_digit_percent(share)}" if share > 0.0 else "none"
    at = f" ({where})" if share > 0.0 else ""
    reason = f"A change of one millionth in the motion or the restitution reverses {many} of the outcomes{at}."
    if share < UNSTABLE:
        return Check(question, GOOD, f"{reason} Probabilities are not affected.")
    clause = f"up to {two_digit_percent(share)} of the outcomes are undecided"
    return Check(question, CARE, reason, "Trust probabilities, not single runs; take more motions.", clause)


def _hazard(results: xr.Dataset) -> Check:
    if "rate_share_above" not in results:
        return Check(HAZARD, UNKNOWN, "The results hold no shares of the rates.", AGAIN, "shares of rates are missing")
    known = np.isfinite(results["rate"])
    if not bool(known.any()):
        return Check(HAZARD, INVALID, "There is no rate: no curve has one.", CURES["above"], "there is no annual rate")
    far = _beyond_hazard({side: results[f"rate_share_{side}"].where(known) for side in CURES})
    if far.word != GOOD:
        return far
    alike = results["rate_lower"] == results["rate_upper"] if "rate_lower" in results else results["rate"] < 0.0
    if bool(alike.any()):
        none = f"{int(alike.sum())} intervals of rates have no width"
        return Check(HAZARD, CARE, f"{none}.", "Take closer levels.", none)
    return far


def _hazard_of_building(results: xr.Dataset) -> Check:
    names = [name for name in ("number", "loss") if f"annual_{name}_share_above" in results]
    return _beyond_hazard(
        {side: xr.concat([results[f"annual_{name}_share_{side}"] for name in names], "of") for side in CURES}
    )


def _beyond_hazard(shares: dict[str, xr.DataArray]) -> Check:
    """Check the shares of annual rates that come from shaking below and above a hazard curve's levels."""
    side = max(shares, key=lambda one: _worst(shares[one])[0])
    share, where = _worst(shares[side])
    end = f"{side} the hazard curve’s {ENDS[side]} level"
    if share <= NOTABLE:
        return Check(HAZARD, GOOD, f"At most {two_digit_percent(share)} come from {end}.")
    clause = f"up to {two_digit_percent(share)} of an annual rate comes from {end}"
    word = INVALID if float(shares[side].min()) > MOST else CARE
    return Check(HAZARD, word, f"Up to {two_digit_percent(share)} come from {end} ({where}).", CURES[side], clause)


def _worst(shares: xr.DataArray) -> tuple[float, str]:
    """Return the greatest of some shares, and the labels to which it belongs."""
    values = shares.values.astype(float)
    filled = np.where(np.isnan(values), -np.inf, values)
    at = np.unravel_index(int(filled.argmax()), values.shape)
    names = [str(shares[dim].values[i]) for dim, i in zip(shares.dims, at, strict=True) if dim in shares.coords]
    return max(0.0, float(filled[at])), ", ".join(names) or "the only one"


def _names_text(names: list[str]) -> str:
    more = len(names) - MOST_NAMES
    return "; ".join(names[:MOST_NAMES]) + (f"; and {more} more" if more > 0 else "")
