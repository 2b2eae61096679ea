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
RATES = ("rate", "any_rate")
"""Variables of studies that give annual rates."""


class Check(NamedTuple):
    """One check: its question, its word, the reason, and the cure (empty where the check is good)."""

    question: str
    word: str
    reason: str
    cure: str = ""


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


def not_checked(results: xr.Dataset) -> list[str]:
    """Return the reservations that no check covers, one sentence each."""
    found = [
        f"{NOT_MODELLED[:1].upper()}{NOT_MODELLED[1:]}: neither is how blocks hit walls, each other or people.",
        "Whether the motions are those of the site: they are what the study gives.",
        "Whether the blocks are rigid, evenly loaded and free of whatever holds them in reality.",
    ]
    if "outside" not in results:
        found.append(
            "Sliding, the law’s elastic mode and scale factors run by run: this kind of study is not screened."
        )
    return found


def _edited(state: str) -> Iterator[Check]:
    if state == EDITED:
        reason = "Values or attributes of the result file were edited after the study had written it."
        yield Check("Are these the results of the study?", INVALID, reason, "Run the study again with --fresh.")


def _model(results: xr.Dataset) -> Iterator[Check]:
    yield _rocking(results)
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


def _rocking(results: xr.Dataset) -> Check:
    question = "Do the blocks rock at all, rather than bounce?"
    needs = _uplift(results)
    if needs is None:
        return Check(question, UNKNOWN, "The results hold no shapes of blocks.", "Run the study with this version.")
    squat = needs.values > 1.0 / SQUAT_RATIO
    named = [str(one) for one in needs[needs.dims[0]].values[squat]]
    if not named:
        return Check(question, GOOD, "Every mass centre is at least two half widths high.")
    cure = "Leave them out, or look at them with a model that includes sliding and bouncing."
    reason = f"{_names_text(named)}: the mass centre is less than two half widths high, so that bouncing decides."
    return Check(question, INVALID if squat.all() else CARE, reason, cure)


def _sliding(results: xr.Dataset) -> Check:
    question = "Does the block rock rather than slide?"
    cure = "Give the available coefficient as [screen] friction; where blocks slide, use a model that includes sliding."
    if "outside" not in results:
        needs = _uplift(results)
        if needs is None:
            return Check(question, UNKNOWN, "The results hold no need of friction.")
        reason = f"Uplift alone needs a coefficient of friction of up to {float(needs.max()):.2f}, strong shaking more."
        return Check(question, UNKNOWN, reason, "Compare that with the available friction.")
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
        )
    limit = "with the friction given" if given else "unless friction is above 1"
    reason = f"Up to {two_digit_percent(share)} of the runs slide {limit} ({where})."
    return Check(question, INVALID if float(shares.min()) > MOST else CARE, reason, cure)


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
    if "outside" not in results:
        word = CARE if delta[-1] > LARGE_DELTA else UNKNOWN
        return Check(question, word, f"{largest}, {bound}; its resonance with the motions was not looked for.", cure)
    share = results["outside"].sel(reason=ELASTIC_MODE.name).mean("block")
    resonant = share.values > MARKED
    if not resonant.any() and delta[-1] <= LARGE_DELTA:
        return Check(question, GOOD, f"{largest}, {bound}; no elastic mode lies inside a motion’s band.")
    if not resonant.any():
        return Check(question, CARE, f"{largest}, {bound}.", cure)
    names = [str(one) for one in results["model"].values[resonant]]
    reason = (
        f"{largest}, {bound}; but the elastic mode lies inside the band of up to "
        f"{two_digit_percent(float(share.max()))} of the motions for {_names_text(names)}: at rest they resonate and "
        f"uplift where a rigid block stands still."
    )
    return Check(question, INVALID if (share.values > MOST).all() else CARE, reason, cure)


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
    )


def _inputs(results: xr.Dataset) -> Check:
    question = "Do sizes, levels and records look like real ones?"
    if "doubts" not in results.attrs:
        return Check(question, UNKNOWN, "The results hold no such check.", "Run the study with this version.")
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
        )
    if doubts:
        names = ", ".join(dict.fromkeys(str(kind) for kind, *_ in doubts))
        return Check(question, GOOD, f"What looks odd is accepted by the study: {names}.")
    return Check(question, GOOD, "Nothing is outside of what exists, and no record keeps an offset or drifts.")


def _spectra(results: xr.Dataset) -> Check:
    question = "Do the motions’ spectra differ as those of earthquakes do?"
    if "spectral_variability" not in results.attrs:
        if "machines" not in results.attrs:
            return Check(question, UNKNOWN, "The results hold no such check.", "Run the study with this version.")
        return Check(question, UNKNOWN, "Pulses, single motions and floor motions are not compared.")
    found = Variability(*json.loads(str(results.attrs["spectral_variability"])))
    reason = f"{found.text}, {NATURAL}."
    if not found.low:
        return Check(question, GOOD, reason)
    accepted = any(kind == SPECTRA and yes for kind, _, yes in json.loads(str(results.attrs.get("doubts", "[]"))))
    rates = any(name in results for name in RATES)
    cure = f"{CURE[:1].upper()}{CURE[1:]}."
    if not found.narrow:
        why = "That is little, but may be chance: there are few motions."
        return Check(question, CARE, f"{reason} {why}", cure)
    so = "Curves are too steep" + (", and annual rates far more certain than they are." if rates else ".")
    if accepted:
        if rates:
            return Check(question, CARE, f"{reason} {so} The study accepts it.", cure)
        return Check(question, GOOD, f"{reason} That is little, which the study accepts.")
    return Check(question, INVALID if rates else CARE, f"{reason} {so}", cure)


def _curves(results: xr.Dataset) -> Check:
    question = "Does every curve stand on runs that fell and runs that stood?"
    status = results["status"].values.astype(str)
    none = ~results["converged"].values.astype(bool)
    guessed = status == SEPARATED
    cure = "Take more motions, and levels from where hardly any falls to where nearly all do."
    total = status.size
    if none.any():
        why = ", ".join(f"{np.sum(status[none] == one)} × {one}" for one in dict.fromkeys(status[none]))
        return Check(question, INVALID if none.all() else CARE, f"{none.sum()} of {total} have no curve ({why}).", cure)
    if guessed.any():
        return Check(question, CARE, f"{guessed.sum()} of {total} are separated: their dispersion is a guess.", cure)
    if (status == OK).all():
        return Check(question, GOOD, f"All {total} do." if total > 1 else "It does.")
    return Check(question, CARE, f"{np.sum(status != OK)} of {total} are not plainly ok.", cure)


def _intervals(results: xr.Dataset) -> Check:
    question = "Are the intervals narrow enough to decide by?"
    cure = "Take more motions, or decide with the whole interval."
    if "median_lower" not in results:
        return Check(question, UNKNOWN, "The medians have no intervals.", "Run the study with this version.")
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = results["median_upper"] / results["median_lower"]
    known = ratio.where(np.isfinite(results["median"]))
    if not bool(known.notnull().any()):
        return Check(question, INVALID, "No median has an interval.", cure)
    widest, where = _worst(known)
    reason = f"The widest interval of a median spans a factor of {widest:.3g} ({where})."
    if not np.isfinite(widest):
        reason = f"An interval of a median is open ({where})."
    if widest <= WIDE:
        return Check(question, GOOD, reason)
    return Check(question, INVALID if float(known.min()) > HOPELESS else CARE, reason, cure)


def _scaling(results: xr.Dataset) -> Check:
    question = "Are the motions scaled moderately?"
    share, _ = _worst(results["outside"].sel(reason=SCALED_FAR.name))
    low, high = json.loads(str(results.attrs["screen"]))["factors"]
    if share < MARKED:
        return Check(
            question, GOOD, f"Fewer than 1 % of the runs are scaled by less than {low:g} or more than {high:g}."
        )
    reason = f"Up to {two_digit_percent(share)} of the runs are scaled by less than {low:g} or more than {high:g}."
    return Check(question, CARE, reason, "Take motions that are as strong as the levels, or stripes of them.")


def _stability(results: xr.Dataset) -> Check:
    question = "Are the outcomes of single runs stable?"
    if "undecided" not in results:
        return Check(question, UNKNOWN, "No run was repeated with a perturbation.", "")
    share, where = _worst(results["undecided"])
    many = f"up to {two_digit_percent(share)}" if share > 0.0 else "none"
    at = f" ({where})" if share > 0.0 else ""
    reason = f"A change of one millionth in the motion or the restitution reverses {many} of the outcomes{at}."
    if share < UNSTABLE:
        return Check(question, GOOD, f"{reason} Probabilities are not affected.")
    return Check(question, CARE, reason, "Trust probabilities, not single runs; take more motions.")


def _hazard(results: xr.Dataset) -> Check:
    question = "Do the annual rates come from shaking that is known?"
    cure = "Give the hazard curve at higher levels, and raise the levels of the analysis."
    if "rate_share_above" not in results:
        return Check(question, UNKNOWN, "The results hold no shares of the rates.", "")
    share, where = _worst(results["rate_share_above"])
    alike = results["rate_lower"] == results["rate_upper"] if "rate_lower" in results else results["rate"] < 0.0
    if not np.isfinite(results["rate"].values).any():
        return Check(question, INVALID, "There is no rate: no curve has one.", cure)
    if share > NOTABLE:
        reason = f"Up to {two_digit_percent(share)} come from above the hazard curve’s last level ({where})."
        known = results["rate_share_above"].where(np.isfinite(results["rate"]))
        return Check(question, INVALID if float(known.min()) > MOST else CARE, reason, cure)
    if bool(alike.any()):
        return Check(question, CARE, f"{int(alike.sum())} intervals of rates have no width.", "Take closer levels.")
    return Check(question, GOOD, f"At most {two_digit_percent(share)} come from above the hazard curve’s last level.")


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
