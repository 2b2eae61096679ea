"""Validity checks of a report: the rocking model, the elastic zone, the number of runs, and the widths of intervals."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...core.wording import counted, listed_name, two_digit_percent
from ...fragility.adaptive.stopping import REACHED
from ...fragility.fitting.states import DIRECTIONS, OK, OVERTURNED, SEPARATED, state_name, state_named
from ...fragility.numerics.proportions import runs_for_half_width, wilson_half_width
from ...fragility.runs.provenance import BED, number_of_motions
from ...fragility.validity.limits import HOPELESS, NO_BETTER_THAN, interval_ratios, mostly, sliding_shares
from ...fragility.validity.notes import greatest_need, not_modelled
from ...fragility.validity.reasons import ELASTIC_MODE, SCALED_FAR
from ...fragility.validity.slab_screen import HALF_WIDTH, SQUAT_RATIO
from ...models.friction import LOCKED, ROLLING
from ...motions.intensity.variability import CURE, NATURAL, SPECTRA, Variability
from ..buildings.notes import AMOUNTS
from ..buildings.sliding import MOVES, shares_with_moving_supports
from ..plan.slides import GATED, GATED_RATE, INSTEAD
from ..region.rows import is_pooled
from ..store.content import AS_WRITTEN, EDITED
from ..text.curve_notes import BEYOND, LEFT_OUT, NOTABLE, UNDER, extrapolated_shares, possible_change, rate_bounds
from ..text.one_side import FORCED
from ..text.precision import missed_precision, reached_by
from ..text.reached import levels_run, other_levels, within_levels
from ..text.words import reference_law

GOOD, CARE, INVALID, UNKNOWN = "good", "use with care", "not valid", "not checked"
"""Words of a check: the first three from best to worst, the last where nothing was checked."""
MARKED = 0.01
"""Share of runs from which a reason needs care."""
LARGE_DELTA = 0.1
"""Largest half width of the zone over alpha that Liu, Huang and Qu (2024) use."""
WIDE = 1.5
"""Ratio of the ends of the interval of a level at which half fall, above which it needs care."""
UNBOUNDED = 100.0
"""That ratio above which the number says no more."""
UNSTABLE = 0.05
"""Share of outcomes that a change of a millionth reverses, from which outcomes need care."""
MOST_NAMES = 4
ODD = {
    "table": "a table may not be read as a spreadsheet program shows it",
    "block size": "the size of a piece looks wrong",
    "units": "a number looks like one of another unit",
    "building": "a number of a building or a support looks like one of another unit",
    "level": "levels are stronger than any real shaking, or not the levels of motions that are not scaled",
    "scenario": "the motions or their scenario lie outside what ground-motion data support",
    "vertical": "vertical components of records are used as horizontal shaking",
    "offset": "the mean of a record is not zero",
    "drift": "the velocity of a record drifts",
    "displacement": "the displacement of a record is too large to be real",
    "PGA": "the PGA of a record is too large to be real",
    "PGV/PGA": "the ratio PGV/PGA of a record is not that of an earthquake",
    "duration": "a record is longer than any earthquake",
    "ringing": "the floor motions end before the building has come to rest",
    "collapse": "the building collapses under some motions",
    "strike": "the isolated platform strikes its stops under some motions",
    "rocks first": "blocks would rock before they slide",
    "slides on": "motions end while blocks slide",
    "hazard": "the hazard curve is unlike that of any site or contradicts another, or its file names no measure",
    "selection": "some selected motions do not agree with the hazard",
    "scaling": "motions are scaled far before they go through what yields",
    "misfit": "the motions do not match their target spectrum",
}
"""What is odd about the inputs, by the kind of doubt."""
AGAIN = "Run the study with this version."
NO_CHECK = "The results do not contain this check."
SLIDING = "Does the block rock rather than slide?"
UNKNOWN_FRICTION = (
    "Find the coefficient of friction between the base and the floor (the horizontal force that just makes the piece "
    "slide, divided by its weight), and give it in [friction]. Where pieces slide, the chances of falling do not "
    "apply: prevent sliding, or look at how far they slide."
)
KNOWN_FRICTION = (
    "Where pieces slide, the chances of falling do not apply: prevent sliding, or evaluate it with [friction], which "
    "says how far they slide."
)
FRICTION_IN_TABLE = (
    "Read the table of sliding: it says how likely each piece slides instead of rocking, how far, and what is left of "
    "the chance of falling. Have the friction measured where a decision depends on it."
)
SLIPS_IN_TABLE = (
    "Read the table of sliding: it says how likely each piece slides instead of rocking, and how far. Have the "
    "friction measured where a decision depends on it."
)
"""What to do about sliding: where no friction is given, where the screen alone has it, and where slips are computed,
with the chances of falling that are left and without them."""
HAZARD = "Do the annual rates come from the part of the hazard curve that is known?"
ENDS = {"below": "first", "above": "last"}
CURES = {
    "below": "Give the hazard curve at lower levels.",
    "above": "Give the hazard curve at higher levels, and raise the levels of the analysis.",
}
RUN_LEVELS = "Do the annual rates come from shaking that was run?"
RUN_ENDS = {"below": "weaker", "above": "stronger"}
RATES = ("rate", "any_rate")
"""Variables of studies that give annual rates."""


class Check(NamedTuple):
    """One check: its question, word and reason; cure, and clause for the badge, are empty where it is good."""

    question: str
    word: str
    reason: str
    cure: str = ""
    clause: str = ""


def checks_of(results: xr.Dataset, state: str = AS_WRITTEN) -> list[Check]:
    """Return every check of a study's results, of any kind, which are in the `state` of `check_content`."""
    return [*_edited(state), *_model(results), *_numbers(within_levels(results))]


def worst_word(found: list[Check]) -> str:
    """Return the worst word of some checks; a check that was not made counts as one that needs care."""
    words = {one.word for one in found}
    return INVALID if INVALID in words else CARE if words & {CARE, UNKNOWN} else GOOD


def is_valid(results: xr.Dataset) -> bool:
    """Return whether no check of a study's results says that they are not valid."""
    return worst_word(checks_of(results)) != INVALID


def worst_clause(found: list[Check]) -> str:
    """Return what is wrong by the worst check in one clause, by the first of the worst word; empty if all are good."""
    for word in (INVALID, CARE, UNKNOWN):
        for one in found:
            if one.word == word:
                return one.clause
    return ""


def badge(found: list[Check]) -> str:
    """Return the worst word of some checks, what is wrong in one clause, and how many others are not good."""
    clause = worst_clause(found)
    others = sum(one.word != GOOD for one in found) - 1
    more = f"; {others} other check{' needs' if others == 1 else 's need'} attention" if clause and others > 0 else ""
    return f"{worst_word(found)}{f': {clause}{more}' if clause else ''}"


def not_checked(vertical: bool = False, slides: bool = False) -> list[str]:
    """Return the reservations that no check covers, one sentence each."""
    missing = not_modelled(vertical, slides)
    return [
        f"{missing[:1].upper()}{missing[1:]}, nor are impacts on other blocks or people, or on walls "
        "that the study does not name.",
        "Whether the motions suit the site: they are as the study specifies them.",
        "Whether the real objects are rigid, loaded as the study says, and held by nothing that it does not name.",
    ]


def _edited(state: str) -> Iterator[Check]:
    if state == EDITED:
        question, cure = "Are these the results of the study?", "Run the study again with --fresh."
        reason = "Values or attributes of the result file were edited after the study had written it."
        yield Check(question, INVALID, reason, cure, "the results were edited after they had been computed")


def _model(results: xr.Dataset) -> Iterator[Check]:
    yield _rocking(results)
    if "outside" not in results:
        reason, cure = "The results hold no shares of the runs for which rocking may be the wrong model.", AGAIN
        if is_pooled(results):
            reason = "Runs of a pooled surface are not screened for slides and for motions that are scaled far."
            cure = "Give the same blocks a few levels that all motions share, and look at the checks of that study."
        yield Check("Were the runs screened?", UNKNOWN, reason, cure, "the runs were not screened")
        return
    yield _sliding(results)
    yield from _rolling(results)
    yield from _pedestals(results)
    yield _zone(results)


def _numbers(results: xr.Dataset) -> Iterator[Check]:
    yield _motions(results)
    yield _inputs(results)
    yield _spectra(results)
    if "half_level" in results:
        if FORCED in results.attrs:
            state = str(results.attrs["state"])
            clause = f"the {results.attrs['form']} curves rise to 1, as the probability of {state} need not"
            yield Check(
                "Can the curves follow the probability of a fall to one side?",
                INVALID,
                f"{results.attrs[FORCED]} may fall to the other side instead, but {clause}: chances and rates may be "
                "wrong by a factor.",
                "Take curves without a fixed form (isotonic), which are the default for falls to one side.",
                clause,
            )
        yield _curves(results)
        yield _intervals(results)
    if "outside" in results:
        yield _scaling(results)
    yield _stability(results)
    if "rate" in results:
        yield _hazard(results)
        if not is_pooled(results):  # (its runs lie where the surface needs them, at levels of no block by itself)
            yield _run_levels(results)
    elif "annual_number_share_above" in results:
        names = [name for name in AMOUNTS if f"annual_{name}_share_above" in results]
        of = xr.Variable("of", [f"annual {AMOUNTS[name]}" for name in names])
        yield _beyond_hazard(
            {
                side: xr.concat([results[f"annual_{name}_share_{side}"] for name in names], "of").assign_coords(of=of)
                for side in CURES
            },
            "value",
        )


def _rocking(results: xr.Dataset) -> Check:
    question = "Do the blocks rock rather than bounce?"
    needs = _uplift(results)
    if needs is None:
        reason = "The results hold no shapes of blocks."
        return Check(question, UNKNOWN, reason, AGAIN, "the shapes of the pieces are missing")
    squat = needs.values > 1.0 / SQUAT_RATIO
    named = [str(one) for one in needs[needs.dims[0]].values[squat]]
    if not named:
        return Check(question, GOOD, "Every mass centre is at least two half widths above the floor.")
    cure = "Leave them out, or study them with a model that includes sliding and bouncing."
    reason = f"{_names_text(named)}: the mass centre is less than two half widths above the floor, so bouncing governs."
    clause = f"{_of_all(results, squat)} would bounce rather than rock"
    return Check(question, INVALID if squat.all() else CARE, reason, cure, clause)


def _sliding(results: xr.Dataset) -> Check:
    question = SLIDING
    given = json.loads(str(results.attrs["screen"]))["friction"] is not None
    cure = UNKNOWN_FRICTION
    if given:
        cure = KNOWN_FRICTION
        if INSTEAD in results:
            cure = FRICTION_IN_TABLE if {GATED, GATED_RATE} & {*results.variables} else SLIPS_IN_TABLE
    shares = sliding_shares(results)
    share, where = _worst(shares)
    if share < MARKED and given:
        return Check(question, GOOD, "With the friction given, every block would slide in fewer than 1 % of its runs.")
    need = greatest_need(results, "friction_rocking_demand")
    if share < MARKED:
        return Check(
            question,
            UNKNOWN,
            "No coefficient of friction is given. To rock without sliding, the blocks need one of up to "
            f"{float(results['friction_uplift'].max()):.2f} to uplift and up to {need:.2f} in the strongest rocking.",
            cure,
            "a piece may slide instead of rocking, which was not checked because no coefficient of friction is given",
        )
    many = f"in up to {two_digit_percent(share)} of the runs a piece"
    clause = (
        f"{many} would slide with the friction given"
        if given
        else f"{many} would slide instead of rocking unless its coefficient of friction were above 1"
    )
    reason = f"{clause[:1].upper()}{clause[1:]} ({where})."
    return Check(question, INVALID if mostly(shares) else CARE, reason, cure, clause)


def _rolling(results: xr.Dataset) -> Iterator[Check]:
    """Yield the check of pieces on castors, where there are any: rolling is not modelled."""
    if "contact" not in results.coords:
        return
    free = ~results["anchored"].values.astype(bool)
    question = "Do the pieces stand on feet rather than castors?"
    for contact, reason, cure in (
        (
            ROLLING,
            "on castors that are not locked a piece rolls, which is not modelled: its chance of falling is that of the "
            "same piece on feet that cannot slide",
            "Lock or fix them, or take published fragilities of rolling equipment.",
        ),
        (
            LOCKED,
            "locked castors are taken as feet, which holds only as long as every brake does",
            "Test that the brakes hold with the friction given.",
        ),
    ):
        which = free & (results["contact"].values == contact)
        named = [str(one) for one in results["item"].values[which]]
        if named:
            text = f"{_names_text(named)}: {reason}."
            one = int(results["count"].values[which].sum()) == 1
            on = "locked castors" if contact == LOCKED else "castors that can roll"
            clause = f"{_of_all(results, which)} {'stands' if one else 'stand'} on {on}"
            yield Check(question, CARE, text, cure, clause)


def _pedestals(results: xr.Dataset) -> Iterator[Check]:
    """Yield the check of what other pieces stand on, where there is any: objects are shaken as the floor is."""
    if MOVES not in results:
        return
    question = "Does what objects stand on rest, so that it shakes them as the floor moves?"
    shares = shares_with_moving_supports(results)
    worst = int(np.argmax(shares))
    share, name = float(shares[worst]), str(results["item"].values[worst])
    told = f"In {two_digit_percent(share)} of the falls of “{name}”"
    if share < MARKED:
        yield Check(question, GOOD, "What objects stand on slides or rocks in fewer than 1 % of their falls.")
        return
    yield Check(
        question,
        INVALID if mostly(shares[np.asarray(results[MOVES].notnull().all("level").values)]) else CARE,
        f"{told} what it stands on slides or rocks itself; a moving pedestal is not modelled.",
        "Anchor the pedestal, or widen or weight its base.",
        f"what “{name}” stands on moves in {two_digit_percent(share)} of its falls",
    )


def _uplift(results: xr.Dataset) -> xr.DataArray | None:
    """Return the coefficient of friction that uplift needs, b/h, of every block or item; None where it is not known."""
    if "friction_uplift" in results:
        return results["friction_uplift"]
    known = "alpha" in results.coords and results["alpha"].dims in (("block",), ("item",))
    return xr.ufuncs.tan(results["alpha"]) if known else None


def _zone(results: xr.Dataset) -> Check:
    """Check the elastic zone of the laws that the answer is given for; the others are only named."""
    question = "Is δ, the half width of the law’s elastic zone over α, small enough?"
    cure = "Rely first on a law whose rest is rigid (housner, energy-consistent), and make δ smaller."
    at = laws_of_answer(results)
    rest = _other_modes(results, at)
    results = results.isel(model=at)
    widths = results["delta"].values.astype(float) if "delta" in results.coords else np.array([])
    soft = False
    if "rest" in results.coords and results["rest"].shape == widths.shape:
        # (a law with a rigid rest has no elastic mode that could resonate)
        # (and that of a soft support is real)
        kinds = results["rest"].values.astype(str)
        soft = bool((kinds == "soft").any())
        widths = np.where((kinds == "rigid") | (kinds == "soft"), np.nan, widths)
    if BED in results.coords and results[BED].notnull().all():
        return Check(question, GOOD, "Every block stands on a soft bed, whose elastic mode is real; δ is not used.")
    delta = np.unique(widths[np.isfinite(widths)])
    if not delta.size and soft:
        return Check(question, GOOD, f"δ is that of a soft support, whose elastic mode is real.{rest}")
    if not delta.size:
        none = "The law of the answer is not elastic at rest." if rest else "No law of this study is elastic at rest."
        return Check(question, GOOD, f"{none}{rest}")
    largest = f"The law is elastic up to {delta[-1]:.3g} of the angle at which the block tips (δ)"
    bound = f"{'above' if delta[-1] > LARGE_DELTA else 'not above'} {LARGE_DELTA:g}"
    runs = results["outside"].sel(reason=ELASTIC_MODE.name)
    over = [dim for dim in runs.dims if dim != "model"]
    share, most = runs.mean(over), two_digit_percent(float(runs.max()))
    resonant = share.values > MARKED
    if not resonant.any() and delta[-1] <= LARGE_DELTA:
        reason = f"{largest}, {bound}; its elastic mode lies inside no motion’s band.{rest}"
        return Check(question, GOOD, reason)
    if not resonant.any():
        clause = f"the law is elastic up to {two_digit_percent(delta[-1])} of the angle at which a piece tips"
        return Check(question, CARE, f"{largest}, {bound}.", cure, clause)
    names = [str(one) for one in results["model"].values[resonant]]
    reason = (
        f"{largest}, {bound}; but the elastic mode lies inside the band of the motion in up to {most} of the runs for "
        f"{_names_text(names)}: at rest the blocks resonate and uplift where a rigid block stands still.{rest}"
    )
    clause = f"the law’s elastic mode resonates in up to {most} of the runs"
    return Check(question, INVALID if mostly(share) else CARE, reason, cure, clause)


def laws_of_answer(results: xr.Dataset) -> list[int]:
    """Return the positions of the laws of the answer: the reference, those of branches, or all of a sensitivity."""
    every = list(range(results.sizes["model"]))
    if str(results.attrs["kind"]) == "sensitivity":
        return every
    if "branch_model" in results:
        named = {str(one) for one in results["branch_model"].values}
        return [i for i in every if str(results["model"].values[i]) in named] or every
    return [reference_law(results)[0]]


def resonant_laws(results: xr.Dataset, at: list[int]) -> list[int]:
    """Return which of some laws have an elastic mode inside the band of motions."""
    if "outside" not in results or not at:
        return []
    runs = results["outside"].sel(reason=ELASTIC_MODE.name).isel(model=at)
    share = runs.mean([dim for dim in runs.dims if dim != "model"]).values
    return [i for i, one in zip(at, share, strict=True) if one > MARKED]


def _other_modes(results: xr.Dataset, at: list[int]) -> str:
    """Return the sentence on laws beside those of the answer whose elastic modes lie inside the band of motions."""
    found = resonant_laws(results, [i for i in range(results.sizes["model"]) if i not in at])
    if not found:
        return ""
    runs = results["outside"].sel(reason=ELASTIC_MODE.name).isel(model=found)
    names = _names_text([str(results["model"].values[i]) for i in found])
    return (
        f" Other laws of this study ({names}), for which the answer is not given, have an elastic mode inside the band "
        f"of the motion in up to {two_digit_percent(float(runs.max()))} of the runs: compare the answer with them, "
        "but do not rely on them."
    )


def fewest_motions(results: xr.Dataset) -> int:
    """Return the number of motions of a curve at the level that has the fewest."""
    screened = json.loads(str(results.attrs.get("screen", "{}")))
    return int(screened.get("fewest_motions", number_of_motions(results)))


def _motions(results: xr.Dataset) -> Check:
    question = "Are there enough motions?"
    widest = float(json.loads(str(results.attrs.get("screen", "{}"))).get("half_width", HALF_WIDTH))
    n = fewest_motions(results)
    at = " at each level" if "stripe" in results.coords else ""
    half = float(results["interval_half_width"]) if "interval_half_width" in results else wilson_half_width(n)
    reason = f"With {counted(n, 'motion')} a probability of 1/2 is known to ±{half:.2f} (95 %)."
    if half <= widest:
        return Check(question, GOOD, reason)
    return Check(
        question,
        INVALID if half > NO_BETTER_THAN else CARE,
        reason,
        f"Take more motions: {runs_for_half_width(widest)} give ±{widest:g}.",
        f"there {'is' if n == 1 else 'are'} only {counted(n, 'motion')}{at}",
    )


def _inputs(results: xr.Dataset) -> Check:
    question = "Are sizes, levels and records plausible?"
    if "doubts" not in results.attrs:
        return Check(question, UNKNOWN, NO_CHECK, AGAIN, "the inputs were not checked")
    doubts = [one for one in json.loads(str(results.attrs["doubts"])) if one[0] != SPECTRA]
    kinds = dict.fromkeys(str(kind) for kind, _, accepted in doubts if not accepted)
    if kinds:
        said = (str(sentence).rstrip(".") for _, sentence, accepted in doubts if not accepted)
        return Check(
            question,
            CARE,
            " ".join(f"{doubt[:1].upper()}{doubt[1:]}{'' if doubt.endswith('?') else '.'}" for doubt in said),
            "Correct what is wrong. What is intended can be accepted in the study, which the report then states.",
            "; ".join(ODD[kind] for kind in kinds),
        )
    if doubts:
        names = ", ".join(dict.fromkeys(str(kind) for kind, *_ in doubts))
        return Check(question, GOOD, f"The study accepts what is implausible about them: {names}.")
    return Check(question, GOOD, "No size or level is implausible, and no record has an offset or drifts.")


def _spectra(results: xr.Dataset) -> Check:
    question = "Do the motions’ spectra differ as those of earthquakes do?"
    if "spectral_variability" not in results.attrs:
        if not results.attrs.keys() & {"processor", "machines"}:
            return Check(question, UNKNOWN, NO_CHECK, AGAIN, "the spectra of the motions were not compared")
        reason = "Pulses, single motions and floor motions are not compared."
        return Check(question, UNKNOWN, reason, clause="the spectra of the motions were not compared")
    found = Variability(*json.loads(str(results.attrs["spectral_variability"])))
    reason = f"{found.text}, {NATURAL}."
    if not found.low:
        return Check(question, GOOD, reason)
    alike = "the spectra of the motions are too similar"
    accepted = any(kind == SPECTRA and yes for kind, _, yes in json.loads(str(results.attrs.get("doubts", "[]"))))
    rates = any(name in results for name in RATES)
    cure = f"{CURE[:1].upper()}{CURE[1:]}."
    if not found.narrow:
        why = "That is little, but may be chance: there are few motions."
        return Check(question, CARE, f"{reason} {why}", cure, "the spectra of the few motions are similar")
    so = "Curves are too steep" + (", and annual rates far more certain than they are." if rates else ".")
    if accepted:
        if rates:
            return Check(question, CARE, f"{reason} {so} The study accepts it.", cure, alike)
        return Check(question, GOOD, f"{reason} That is little, which the study accepts.")
    return Check(question, INVALID if rates else CARE, f"{reason} {so}", cure, alike)


def _curves(results: xr.Dataset) -> Check:
    question = "Does every curve rest both on runs that reached the state that is studied and on runs that did not?"
    status = results["status"].values.astype(str)
    none = ~results["converged"].values.astype(bool)
    guessed = status == SEPARATED
    cure = "Take more motions, and levels that reach from hardly any falls to nearly all."
    total = status.size
    if none.any():
        why = ", ".join(f"{np.sum(status[none] == one)} × {one}" for one in dict.fromkeys(status[none]))
        clause = f"{none.sum():,} of {counted(total, 'fragility curve')} cannot be fitted"
        reason = f"{none.sum():,} of {counted(total, 'curve')} cannot be fitted ({why})."
        return Check(question, INVALID if none.all() else CARE, reason, cure, clause)
    if guessed.any():
        clause = f"the dispersion is a guess for {guessed.sum():,} of {counted(total, 'curve')}"
        reason = f"{clause[:1].upper()}{clause[1:]}: fewer than two levels have runs of both outcomes."
        return Check(question, CARE, reason, cure, clause)
    if (status == OK).all():
        return Check(question, GOOD, "All curves do." if total > 1 else "The curve does.")
    marked = status[status != OK]
    of = "the curve" if total == 1 else f"{marked.size:,} of {counted(total, 'curve')}"
    clause = f"{of} {'is' if marked.size == 1 else 'are'} marked “{'”, “'.join(dict.fromkeys(marked))}”"
    return Check(question, CARE, f"{clause[:1].upper()}{clause[1:]}.", cure, clause)


def _intervals(results: xr.Dataset) -> Check:
    question = "Are the intervals narrow enough to base a decision on?"
    cure = "Take more motions, or decide with the whole interval."
    if "half_level_lower" not in results:
        said = "levels at which half fall have no intervals"
        return Check(question, UNKNOWN, f"The {said}.", AGAIN, said)
    known = interval_ratios(results)
    if bool((results["half_level"] == np.inf).all()):
        reason = "In no case do half of the runs fall at the levels that were run."
        cure = "Judge by the intervals of the probabilities and rates in the tables."
        return Check(question, UNKNOWN, reason, cure, "half fall at no level")
    if not bool(known.notnull().any()):
        said = "no level at which half fall has an interval"
        return Check(question, INVALID, f"{said.capitalize()}.", cure, said)
    widest, where = _worst(known)
    reason = f"The widest interval of a level at which half fall spans a factor of {widest:.3g} ({where})."
    clause = f"the interval of the level at which half fall spans a factor of {widest:.2g}"
    if widest > UNBOUNDED:
        reason = f"An interval of a level at which half fall spans a factor of more than {UNBOUNDED:g} ({where})."
        clause = f"the interval of the level at which half fall spans a factor of more than {UNBOUNDED:g}"
    if not np.isfinite(widest):
        clause = "an interval of a level at which half fall is open"
        reason = f"{clause.capitalize()} ({where})."
    if widest <= WIDE:
        return _reached(results, question, reason)
    return Check(question, INVALID if float(known.min()) > HOPELESS else CARE, reason, cure, clause)


def _reached(results: xr.Dataset, question: str, reason: str) -> Check:
    """Check whether intervals that are narrow are as narrow as was asked, where motions are run until they are."""
    if "stopped_because" not in results:
        return Check(question, GOOD, reason)
    missed = missed_precision(results)
    if not missed:
        every = reached_by(results) if "block" in results["stopped_because"].dims else []
        unsure = sum(one.stopped != REACHED for one in every)
        sure = "" if not unsure else f" (for {unsure:,} of {counted(len(every), 'curve')} no further look confirms it)"
        return Check(question, GOOD, f"{reason} The precision that was asked for is reached{sure}.")
    cure = "Allow more motions, or decide with the interval that was reached."
    return Check(question, CARE, f"{reason} {missed}", cure, "the precision asked for was not reached")


def _scaling(results: xr.Dataset) -> Check:
    question = "Are the motions scaled moderately?"
    before = [str(text) for kind, text, _ in json.loads(str(results.attrs.get("doubts", "[]"))) if kind == "scaling"]
    cure = "Take motions whose strength is near the levels, or a set of motions for each level (stripes)."
    if before:
        reason = " ".join(f"{one[:1].upper()}{one[1:]}." for one in before)
        return Check(question, CARE, reason, cure, ODD["scaling"])
    share, _ = _worst(results["outside"].sel(reason=SCALED_FAR.name))
    low, high = json.loads(str(results.attrs["screen"]))["factors"]
    scaled = f"the motion is scaled by less than {low:g} or more than {high:g}"
    if share < MARKED:
        return Check(question, GOOD, f"In fewer than 1 % of the runs {scaled}.")
    clause = f"in up to {two_digit_percent(share)} of the runs {scaled}"
    return Check(question, CARE, f"{clause[:1].upper()}{clause[1:]}.", cure, clause)


def _stability(results: xr.Dataset) -> Check:
    question = "Are the outcomes of single runs stable?"
    if "undecided" not in results:
        state = state_named(str(results.attrs.get("state", state_name(OVERTURNED))))
        reason = "No run was repeated with a perturbation."
        if state not in (OVERTURNED, *DIRECTIONS):
            reason = f"Falls alone are tested for stability, and the curves are of {results.attrs['state']}."
        return Check(question, UNKNOWN, reason, clause="no outcome was tested for stability")
    share, where = _worst(results["undecided"])
    many = f"up to {two_digit_percent(share)}" if share > 0.0 else "none"
    at = f" ({where})" if share > 0.0 else ""
    reason = f"A change of one millionth in the motion or the restitution reverses {many} of the outcomes{at}."
    if share < UNSTABLE:
        return Check(question, GOOD, f"{reason} Probabilities are not affected.")
    clause = f"up to {two_digit_percent(share)} of the outcomes change with a minute change of the motion"
    return Check(question, CARE, reason, "Rely on probabilities, not on single runs, and take more motions.", clause)


def _hazard(results: xr.Dataset) -> Check:
    if "rate_share_above" not in results:
        clause = "how much of the rates comes from beyond the hazard curve is not known"
        return Check(HAZARD, UNKNOWN, "The results hold no shares of the rates.", AGAIN, clause)
    known = np.isfinite(results["rate"])
    if not bool(known.any()):
        return Check(HAZARD, INVALID, "There is no rate: no curve has one.", CURES["above"], "there is no annual rate")
    far = _beyond_hazard({side: results[f"rate_share_{side}"].where(known) for side in CURES})
    odd = [check for check in (_left_out(results, known), far) if check.word != GOOD]
    if odd:
        return next((check for check in odd if check.word == INVALID), odd[0])
    alike = results["rate_lower"] == results["rate_upper"] if "rate_lower" in results else results["rate"] < 0.0
    if bool(alike.any()):
        n = int(alike.sum())
        none = f"the interval of {counted(n, 'annual rate')} has no width"
        return Check(HAZARD, CARE, f"{none[:1].upper()}{none[1:]}.", "Take closer levels.", none)
    return far


def _left_out(results: xr.Dataset, known: NDArray[np.bool_]) -> Check:
    """Check how much of the rates the study's rules leave out beyond the hazard curve's ends."""
    left = results.get(LEFT_OUT, xr.zeros_like(results["rate"])).where(known)
    share, where = _worst(left)
    clause = f"up to {two_digit_percent(share)} of an annual rate is left out beyond the hazard curve’s ends"
    return Check(
        HAZARD,
        GOOD if share <= NOTABLE else INVALID if mostly(left) else CARE,
        f"{clause[:1].upper()}{clause[1:]} ({where}), by hazard.below and hazard.above.",
        "Give the hazard curve at lower and higher levels, or leave out hazard.below and hazard.above.",
        clause,
    )


def _run_levels(results: xr.Dataset) -> Check:
    """Check the share of annual rates from curves where nothing was run; above a half a rate is the form's."""
    shares = extrapolated_shares(results)
    if not shares:
        reason = "The results hold no shares of the rates from beyond the shaking that was run."
        return Check(RUN_LEVELS, UNKNOWN, reason, AGAIN, "how much of the rates was extrapolated is not known")
    side = max(shares, key=lambda one: _worst(shares[one])[0])
    share, where = _worst(shares[side])
    if share <= NOTABLE:
        return _little_extrapolated(results)
    clause = (
        f"up to {two_digit_percent(share)} of an annual rate comes from shaking {RUN_ENDS[side]} than any that was run"
    )
    bounds, rests = rate_bounds(results), shares[side]
    within = ""
    if side == "above" and bounds is not None:
        rests = possible_change(results).where(np.isfinite(shares[side]))
        low, high = (float(one.transpose(*shares[side].dims).values[_at_worst(shares[side])]) for one in bounds)
        within = f" Unless the curve decreases there, the rate is {low:.2f} to {high:.2f} times the one given."
    advice = other_levels(json.loads(str(results.attrs["study"])), side == "above", levels_run(results))
    return Check(
        RUN_LEVELS,
        INVALID if mostly(rests) else CARE,
        f"{clause[:1].upper()}{clause[1:]} ({where}), where the fitted curve is extrapolated: the interval does not "
        f"hold what another form of curve would give.{within}",
        f"{advice[:1].upper()}{advice[1:]}, or take the rate as less certain than its interval says.",
        clause,
    )


def _little_extrapolated(results: xr.Dataset) -> Check:
    """Return the check of rates that hardly depend on what curves do where nothing was run."""
    known = np.isfinite(results["rate"])
    sides = (("below", UNDER), ("above", BEYOND))
    shares = {side: _worst(results[name].where(known))[0] for side, name in sides if name in results}
    side = max(shares, key=lambda one: shares[one])
    end = f"shaking {RUN_ENDS[side]} than any that was run"
    said = f"{two_digit_percent(shares[side])} of any annual rate comes from {end}"
    if shares[side] <= NOTABLE:
        return Check(RUN_LEVELS, GOOD, f"At most {said}.")
    change = two_digit_percent(_worst(possible_change(results).where(known))[0])
    unless = f"unless a curve decreases there no rate is off by more than {change}"
    return Check(RUN_LEVELS, GOOD, f"Up to {said}, but {unless}.")


def _beyond_hazard(shares: dict[str, xr.DataArray], of: str = "rate") -> Check:
    """Check the shares of annual rates or values that come from shaking below and above a hazard curve's levels."""
    side = max(shares, key=lambda one: _worst(shares[one])[0])
    share, where = _worst(shares[side])
    end = f"shaking {side} the hazard curve’s {ENDS[side]} level"
    if share <= NOTABLE:
        return Check(HAZARD, GOOD, f"At most {two_digit_percent(share)} of any annual {of} comes from {end}.")
    clause = f"up to {two_digit_percent(share)} of an annual {of} comes from {end}"
    word = INVALID if mostly(shares[side]) else CARE
    return Check(HAZARD, word, f"{clause[:1].upper()}{clause[1:]} ({where}).", CURES[side], clause)


def _worst(shares: xr.DataArray) -> tuple[float, str]:
    """Return the greatest of some shares, and the labels to which it belongs."""
    at = _at_worst(shares)
    labels = [shares[dim].values[i] for dim, i in zip(shares.dims, at, strict=True) if dim in shares.coords]
    names = [listed_name(str(one)) for one in labels]
    share = float(shares.values[at])
    return share if share > 0.0 else 0.0, ", ".join(names) or "the only one"


def _at_worst(shares: xr.DataArray) -> tuple[int, ...]:
    """Return where the greatest of some shares is."""
    values = shares.values.astype(float)
    filled = np.where(np.isnan(values), -np.inf, values)
    return tuple(int(i) for i in np.unravel_index(int(filled.argmax()), values.shape))


def _of_all(results: xr.Dataset, which: NDArray[np.bool_]) -> str:
    """Return how many of all pieces some blocks or lines are: a line of an inventory counts all of its pieces."""
    counts = results["count"].values if "item" in results.dims else np.ones(which.size, np.int64)
    return f"{int(counts[which].sum()):,} of {counted(int(counts.sum()), 'piece')}"


def _names_text(names: list[str]) -> str:
    more = len(names) - MOST_NAMES
    return "; ".join(map(listed_name, names[:MOST_NAMES])) + (f"; and {more} more" if more > 0 else "")
