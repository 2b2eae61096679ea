"""Validity checks: the rocking model, elastic zone, motions, inputs, curves, intervals, hazard and stability."""

import json
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from ...core.facts import CARE, GOOD, INVALID, UNKNOWN, Fact
from ...fragility.adaptive.stopping import REACHED
from ...fragility.fitting.states import DIRECTIONS, OK, OVERTURNED, SEPARATED, state_name, state_named
from ...fragility.numerics.proportions import runs_for_half_width, wilson_half_width
from ...fragility.runs.provenance import BED, number_of_motions
from ...fragility.validity.limits import HOPELESS, MOST, NO_BETTER_THAN, interval_ratios, mostly, sliding_shares
from ...fragility.validity.notes import greatest_need
from ...fragility.validity.reasons import ELASTIC_MODE, SCALED_FAR
from ...fragility.validity.slab_screen import HALF_WIDTH, SQUAT_RATIO
from ...models.friction import LOCKED, ROLLING
from ...motions.intensity.variability import NATURAL_SHAPE, NATURAL_VELOCITY, SPECTRA, Variability
from ..buildings.notes import AMOUNTS, changes_beyond_levels
from ..buildings.pieces import uplift_friction
from ..buildings.sliding import MOVES, shares_with_moving_supports
from ..plan.slides import INSTEAD
from ..region.rows import is_pooled
from ..store.content import AS_WRITTEN, EDITED
from ..text.curve_notes import BEYOND, LEFT_OUT, NOTABLE, UNDER, extrapolated_shares, possible_change, rate_bounds
from ..text.one_side import FORCED
from ..text.precision import missed_curves, reached_by
from ..text.reached import levels_run, other_levels, within_levels
from ..text.words import block_title, reference_law
from .say import value_of

MARKED = 0.01
"""Share of runs from which a reason needs care."""
LARGE_DELTA = 0.1
"""Largest half width of the zone over alpha that Liu, Huang and Qu (2024) use."""
WIDE = 1.5
"""Ratio of the ends of the interval of a level at which half fall, above which it needs care."""
UNSTABLE = 0.05
"""Share of outcomes that a change of a millionth reverses, from which outcomes need care."""
SIDES = "below", "above"
RATES = ("rate", "any_rate")
"""Variables of studies that give annual rates."""
REMARKS = (
    "law.other_elastic_modes",
    "motion.spectra_accepted",
    "rate.extrapolated_bounded",
    "validity.inputs_accepted",
)
"""Facts of checks that a reader needs though the check is good."""


def checks_of(results: xr.Dataset, state: str = AS_WRITTEN) -> list[Fact]:
    """Return every check of a study's results, of any kind, which are in the `state` of `check_content`."""
    edited = [Fact("validity.edited", word=INVALID, remedy="remedy_fresh")] if state == EDITED else []
    return [*edited, *_model(results), *_numbers(within_levels(results))]


def worst_word(checks: Sequence[Fact]) -> str:
    """Return the worst word of some checks; a check that was not made counts as one that needs care."""
    words = {check.word for check in checks}
    return INVALID if INVALID in words else CARE if words & {CARE, UNKNOWN} else GOOD


def badge(checks: Sequence[Fact]) -> Fact:
    """Return the worst word of some checks, with the titles of those that are not good, the worst first."""
    titles = value_of("titles", "checks")
    bad = sorted((check for check in checks if check.word != GOOD), key=lambda check: check.word != INVALID)
    names = tuple(dict.fromkeys(titles[check.what] for check in bad))
    every = len({titles[check.what] for check in checks})
    return Fact("validity.badge", value=every, names=names, word=worst_word(checks))


def _model(results: xr.Dataset) -> Iterator[Fact]:
    yield _rocking(results)
    if "outside" not in results:
        pooled = is_pooled(results)
        yield Fact(
            "validity.not_screened_pooled" if pooled else "validity.not_screened",
            word=UNKNOWN,
            remedy="remedy_common_levels" if pooled else "remedy_fresh",
        )
        return
    yield _sliding(results)
    yield from _rolling(results)
    yield from _pedestals(results)
    yield from _zone(results)


def _numbers(results: xr.Dataset) -> Iterator[Fact]:
    yield _motions(results)
    yield _inputs(results)
    yield _spectra(results)
    if "half_level" in results:
        if FORCED in results.attrs:
            more = {"form": str(results.attrs["form"]), "state": str(results.attrs["state"])}
            names = (str(results.attrs[FORCED]),)
            yield Fact("curve.forced", names=names, word=INVALID, remedy="remedy_isotonic", more=more)
        yield _curves(results)
        yield _intervals(results)
        yield from _reached(results)
    if "outside" in results:
        yield _scaling(results)
    yield _stability(results)
    if "rate" in results and "place" not in results.dims:
        yield _hazard(results)
        if not is_pooled(results):  # (its runs lie where the surface needs them, at levels of no block by itself)
            yield _run_levels(results)
    elif "annual_number_share_above" in results:
        amounts = [name for name in AMOUNTS if f"annual_{name}_share_above" in results]
        of = xr.Variable("of", [f"annual {AMOUNTS[name]}" for name in amounts])
        yield _beyond_hazard(
            {
                side: xr.concat([results[f"annual_{name}_share_{side}"] for name in amounts], "of").assign_coords(of=of)
                for side in SIDES
            }
        )
        yield _levels_of_amounts(results)


def _missing(what: str) -> Fact:
    """Return a check that results of an earlier version do not have."""
    return Fact(what, word=UNKNOWN, remedy="remedy_fresh", more={"sentence": "missing"})


def _rocking(results: xr.Dataset) -> Fact:
    needs = uplift_friction(results)
    if needs is None:
        return _missing("block.squat")
    squat = needs.values > 1.0 / SQUAT_RATIO
    names = tuple(str(name) for name in needs[needs.dims[0]].values[squat])
    word = GOOD if not names else INVALID if squat.all() else CARE
    return Fact("block.squat", names=names, word=word, remedy="remedy_squat", more=_of_all(results, squat))


def _sliding(results: xr.Dataset) -> Fact:
    given = json.loads(str(results.attrs["screen"]))["friction"] is not None
    remedy = "remedy_measure_friction"
    if given:
        remedy = "remedy_prevent_sliding"
        if INSTEAD in results:
            remedy = "remedy_sliding_table"
    shares = sliding_shares(results)
    share, where = _worst(shares)
    if share < MARKED and not given:
        need = greatest_need(results, "friction_rocking_demand")
        uplift = float(results["friction_uplift"].max())
        return Fact("friction.not_given", more={"uplift": uplift, "rocking": need}, word=UNKNOWN, remedy=remedy)
    word = GOOD if share < MARKED else INVALID if mostly(shares) else CARE
    return Fact("sliding.share" if given else "sliding.share_needed", share, names=where, word=word, remedy=remedy)


def _rolling(results: xr.Dataset) -> Iterator[Fact]:
    """Yield the checks of pieces on castors: rolling is not modelled."""
    if "contact" not in results.coords:
        return
    free = ~results["anchored"].values.astype(bool)
    for contact, what, remedy in (
        (ROLLING, "support.castors", "remedy_castors"),
        (LOCKED, "support.castors_locked", "remedy_brakes"),
    ):
        which = free & (results["contact"].values == contact)
        if which.any():
            names = tuple(str(item) for item in results["block"].values[which])
            yield Fact(what, names=names, word=CARE, remedy=remedy, more=_of_all(results, which))


def _pedestals(results: xr.Dataset) -> Iterator[Fact]:
    """Yield the check of pieces on others, which are assumed to move with the floor."""
    if MOVES not in results:
        return
    shares = shares_with_moving_supports(results)
    worst = int(np.argmax(shares))
    known = np.asarray(results[MOVES].notnull().all("level").values)
    yield Fact(
        "support.moving_pedestal",
        float(shares[worst]),
        names=(str(results["block"].values[worst]),),
        word=GOOD if shares[worst] < MARKED else INVALID if mostly(shares[known]) else CARE,
        remedy="remedy_pedestal",
    )


def _zone(results: xr.Dataset) -> Iterator[Fact]:
    """Yield the check of the elastic zone of the laws that the answer is given for; the others are only named."""
    at = laws_of_answer(results)
    others = resonant_laws(results, [i for i in range(results.sizes["model"]) if i not in at])
    if others:
        runs = results["outside"].sel(reason=ELASTIC_MODE.name).isel(model=others)
        names = tuple(str(results["model"].values[i]) for i in others)
        yield Fact("law.other_elastic_modes", float(runs.max()), names=names, word=GOOD)
    results = results.isel(model=at)
    widths = results["delta"].values.astype(float) if "delta" in results.coords else np.array([])
    if "rest" in results.coords and results["rest"].shape == widths.shape:
        # (a law with a rigid rest has no elastic mode that could resonate, and the mode of a soft support is real)
        widths = np.where(np.isin(results["rest"].values.astype(str), ("rigid", "soft")), np.nan, widths)
    largest = float(np.nanmax(widths, initial=0.0))
    if largest == 0.0 or (BED in results.coords and results[BED].notnull().all()):
        yield Fact("law.elastic_mode", word=GOOD)
        return
    runs = results["outside"].sel(reason=ELASTIC_MODE.name)
    share = runs.mean([dim for dim in runs.dims if dim != "model"])
    resonant = share.values > MARKED
    if not resonant.any():
        word = CARE if largest > LARGE_DELTA else GOOD
        yield Fact("law.wide_zone", largest, word=word, remedy="remedy_rigid_law")
        return
    names = tuple(dict.fromkeys(str(law) for law in results["model"].values[resonant]))
    word = INVALID if mostly(share) else CARE
    yield Fact("law.elastic_mode", float(runs.max()), names=names, word=word, remedy="remedy_rigid_law")


def laws_of_answer(results: xr.Dataset) -> list[int]:
    """Return the positions of the laws of the answer: the reference law, or all laws of branches and sensitivities."""
    every = list(range(results.sizes["model"]))
    if str(results.attrs["kind"]) == "sensitivity":
        return every
    if "branch_model" in results:
        named = {str(law) for law in results["branch_model"].values}
        return [i for i in every if str(results["model"].values[i]) in named] or every
    return [reference_law(results)[0]]


def resonant_laws(results: xr.Dataset, at: list[int]) -> list[int]:
    """Return the laws, of some, with an elastic mode inside the band of motions."""
    if "outside" not in results or not at:
        return []
    runs = results["outside"].sel(reason=ELASTIC_MODE.name).isel(model=at)
    shares = runs.mean([dim for dim in runs.dims if dim != "model"]).values
    return [i for i, share in zip(at, shares, strict=True) if share > MARKED]


def fewest_motions(results: xr.Dataset) -> int:
    """Return the number of motions of a curve at the level that has the fewest."""
    screened = json.loads(str(results.attrs.get("screen", "{}")))
    return int(screened.get("fewest_motions", number_of_motions(results)))


def _motions(results: xr.Dataset) -> Fact:
    widest = float(json.loads(str(results.attrs.get("screen", "{}"))).get("half_width", HALF_WIDTH))
    n = fewest_motions(results)
    half = float(results["interval_half_width"]) if "interval_half_width" in results else wilson_half_width(n)
    return Fact(
        "validity.few_motions",
        half,
        word=GOOD if half <= widest else INVALID if half > NO_BETTER_THAN else CARE,
        remedy="remedy_motions",
        more={"motions": n, "each": "stripe" in results.coords, "need": runs_for_half_width(widest), "width": widest},
    )


def _inputs(results: xr.Dataset) -> Fact:
    if "doubts" not in results.attrs:
        return _missing("validity.inputs")
    doubts = [doubt for doubt in json.loads(str(results.attrs["doubts"])) if doubt[0] != SPECTRA]
    open_ = [(str(kind), str(sentence)) for kind, sentence, accepted in doubts if not accepted]
    if not open_:
        names = tuple(dict.fromkeys(str(kind) for kind, *_ in doubts))
        return Fact("validity.inputs_accepted" if names else "validity.inputs", names=names, word=GOOD)
    sentences = [f"{sentence[:1].upper()}{sentence[1:].rstrip('.')}" for _, sentence in open_]
    more = {"sentences": [text if text.endswith("?") else f"{text}." for text in sentences]}
    names = tuple(dict.fromkeys(kind for kind, _ in open_))
    return Fact("validity.inputs", names=names, word=CARE, remedy="remedy_inputs", more=more)


def _spectra(results: xr.Dataset) -> Fact:
    if "spectral_variability" not in results.attrs:
        made = results.attrs.keys() & {"processor", "machines"}
        if not made:
            return _missing("motion.spectra_alike")
        return Fact("motion.spectra_not_compared", word=UNKNOWN, remedy="remedy_compare_spectra")
    varied = Variability(*json.loads(str(results.attrs["spectral_variability"])))
    rates = any(name in results for name in RATES)
    accepted = any(kind == SPECTRA and yes for kind, _, yes in json.loads(str(results.attrs.get("doubts", "[]"))))
    more = {
        "velocity": varied.velocity,
        "shape": varied.shape,
        "of_earthquakes": (NATURAL_VELOCITY, NATURAL_SHAPE),
        "rates": rates,
        "curves": "half_level" in results,
    }
    if not varied.low:
        return Fact("motion.spectra_alike", word=GOOD)
    if not varied.narrow:
        return Fact("motion.spectra_may_be_chance", word=CARE, remedy="remedy_spectra", more=more)
    if accepted:
        return Fact("motion.spectra_accepted", word=CARE if rates else GOOD, remedy="remedy_spectra", more=more)
    word = INVALID if rates else CARE
    return Fact("motion.spectra_alike", word=word, remedy="remedy_spectra", more=more)


def _curves(results: xr.Dataset) -> Fact:
    status = results["status"].values.astype(str)
    none = ~results["converged"].values.astype(bool)
    what, marked = next(
        (what, marked)
        for what, marked in (
            ("curve.unfitted", none),
            ("curve.separated", status == SEPARATED),
            ("curve.marked", status != OK),
        )
        if marked.any() or what == "curve.marked"
    )
    word = GOOD if not marked.any() else INVALID if none.all() else CARE
    more: dict[str, Any] = {"number": int(marked.sum()), "curves": status.size}
    if what == "curve.unfitted":
        study, run = json.loads(str(results.attrs["study"])), levels_run(results)
        more |= {"higher": other_levels(study, True, run), "lower": other_levels(study, False, run)}
    return Fact(what, names=tuple(dict.fromkeys(status[marked])), word=word, remedy="remedy_curves", more=more)


def _intervals(results: xr.Dataset) -> Fact:
    if "half_level_lower" not in results:
        return _missing("curve.wide_interval")
    known = interval_ratios(results)
    if bool((results["half_level"] == np.inf).all()):
        return Fact("curve.half_not_reached", word=UNKNOWN, remedy="remedy_probabilities")
    if not bool(known.notnull().any()):
        return Fact("curve.no_interval", word=INVALID, remedy="remedy_interval")
    widest, where = _worst(known)
    word = GOOD if widest <= WIDE else INVALID if float(known.min()) > HOPELESS else CARE
    return Fact("curve.wide_interval", widest, names=where, word=word, remedy="remedy_interval")


def _reached(results: xr.Dataset) -> Iterator[Fact]:
    """Yield the check of a requested precision, if motions are run until it is reached."""
    if "stopped_because" not in results:
        return
    accounts, number = missed_curves(results)
    every = reached_by(results) if "block" in results["stopped_because"].dims else []
    more = {
        "missed": len(accounts),
        "curves": number,
        "account": accounts[0] if accounts else "",
        "unsure": sum(curve.stopped != REACHED for curve in every),
    }
    yield Fact("adaptive.precision_missed", word=CARE if accounts else GOOD, remedy="remedy_interval", more=more)


def _scaling(results: xr.Dataset) -> Fact:
    before = [str(text) for kind, text, _ in json.loads(str(results.attrs.get("doubts", "[]"))) if kind == "scaling"]
    share, _ = _worst(results["outside"].sel(reason=SCALED_FAR.name))
    low, high = json.loads(str(results.attrs["screen"]))["factors"]
    word = CARE if before or share >= MARKED else GOOD
    more = {"sentences": [f"{text[:1].upper()}{text[1:]}." for text in before]}
    return Fact("motion.scaled_far", share, low, high, word=word, remedy="remedy_scaling", more=more)


def _stability(results: xr.Dataset) -> Fact:
    if "undecided" not in results:
        state = state_named(str(results.attrs.get("state", state_name(OVERTURNED))))
        other = str(results.attrs["state"]) if state not in (OVERTURNED, *DIRECTIONS) else ""
        cure = "remedy_common_levels" if is_pooled(results) else "remedy_stability"
        return Fact("stability.not_tested", word=UNKNOWN, remedy=cure, more={"state": other})
    share, where = _worst(results["undecided"])
    word = GOOD if share < UNSTABLE else CARE
    return Fact("stability.undecided", share, names=where, word=word, remedy="remedy_stability")


def _hazard(results: xr.Dataset) -> Fact:
    if "rate_share_above" not in results:
        return _missing("rate.beyond_hazard")
    known = results["rate"].notnull() & np.isfinite(results["rate"])
    if not bool(known.any()):
        return Fact("rate.none", word=INVALID, remedy="remedy_hazard")
    far = _beyond_hazard({side: results[f"rate_share_{side}"].where(known) for side in SIDES})
    left_out = results.get(LEFT_OUT, xr.zeros_like(results["rate"])).where(known)
    left = _of_shares("rate.left_out", left_out, "remedy_left_out")
    odd = [check for check in (left, far) if check.word != GOOD]
    if odd:
        return next((check for check in odd if check.word == INVALID), odd[0])
    alike = results["rate_lower"] == results["rate_upper"] if "rate_lower" in results else results["rate"] < 0.0
    if bool(alike.any()):
        return Fact("rate.no_width", word=CARE, remedy="remedy_closer_levels", more={"number": int(alike.sum())})
    return far


def _run_levels(results: xr.Dataset) -> Fact:
    """Check the share of annual rates from parts of curves beyond the runs; above a half a rate depends on the form."""
    shares = extrapolated_shares(results)
    if not shares:
        return _missing("rate.extrapolated")
    side = max(shares, key=lambda end: _worst(shares[end])[0])
    share, where = _worst(shares[side])
    if share <= NOTABLE:
        return _little_extrapolated(results)
    bounds, rests = rate_bounds(results), shares[side]
    low = high = np.nan
    if side == "above" and bounds is not None:
        rests = possible_change(results).where(np.isfinite(shares[side]))
        low, high = (float(end.transpose(*shares[side].dims).values[_at_worst(shares[side])]) for end in bounds)
    advice = other_levels(json.loads(str(results.attrs["study"])), side == "above", levels_run(results))
    word, more = INVALID if mostly(rests) else CARE, {"side": side, "advice": advice}
    return Fact("rate.extrapolated", share, low, high, names=where, word=word, remedy="remedy_levels", more=more)


def _levels_of_amounts(results: xr.Dataset) -> Fact:
    """Check the possible change of annual amounts of an inventory from motions beyond the runs."""
    if "annual_number_above" not in results:
        return _missing("rate.amounts_beyond_levels")
    changes = changes_beyond_levels(results)
    side = max(changes, key=lambda end: max(changes[end].values()))
    change_of = changes[side]
    most = max(change_of.values())
    names = tuple(f"annual {text}" for text, change in change_of.items() if change == most > NOTABLE)
    word = GOOD if most <= NOTABLE else INVALID if MOST < min(change_of.values()) < np.inf else CARE
    study = json.loads(str(results.attrs.get("study", "{}")))
    more = {"side": side, "advice": other_levels(study, side == "above", levels_run(results))}
    return Fact("rate.amounts_beyond_levels", most, names=names, word=word, remedy="remedy_levels", more=more)


def _little_extrapolated(results: xr.Dataset) -> Fact:
    """Return the check of rates that hardly depend on curves beyond the runs."""
    known = np.isfinite(results["rate"])
    sides = (("below", UNDER), ("above", BEYOND))
    shares = {side: _worst(results[name].where(known))[0] for side, name in sides if name in results}
    side = max(shares, key=lambda end: shares[end])
    if shares[side] <= NOTABLE:
        return Fact("rate.extrapolated", shares[side], word=GOOD)
    change = _worst(possible_change(results).where(known))[0]
    return Fact("rate.extrapolated_bounded", shares[side], upper=change, word=GOOD, more={"side": side})


def _beyond_hazard(shares: dict[str, xr.DataArray]) -> Fact:
    """Check the shares of annual rates or values from below and above a hazard curve's levels."""
    side = max(shares, key=lambda end: _worst(shares[end])[0])
    return _of_shares("rate.beyond_hazard", shares[side], "remedy_hazard", side=side)


def _of_shares(what: str, shares: xr.DataArray, remedy: str, **more: object) -> Fact:
    """Check that shares are small; they are invalid if most of them are large."""
    share, where = _worst(shares)
    word = GOOD if share <= NOTABLE else INVALID if mostly(shares) else CARE
    return Fact(what, share, names=where, word=word, remedy=remedy, more=more)


def _worst(shares: xr.DataArray) -> tuple[float, tuple[str, ...]]:
    """Return the maximum of some shares, and its labels, without the law of a study of one."""
    at = _at_worst(shares)
    dims = [*zip(shares.dims, at, strict=True)]
    parts = [shares[dim][i] for dim, i in dims if dim in shares.coords and (dim != "model" or shares.sizes[dim] > 1)]
    share = float(shares.values[at])
    return share if share > 0.0 else 0.0, tuple(map(_label, parts))


def _label(part: xr.DataArray) -> str:
    """Return the title of a block or another label; a varied value has its symbol."""
    symbol = f"{str(part.attrs['long_name']).rpartition(', ')[2]} = " if part.name == "value" else ""
    return symbol + block_title(str(part.item()))


def _at_worst(shares: xr.DataArray) -> tuple[int, ...]:
    """Return the position of the maximum of some shares."""
    values = shares.values.astype(float)
    filled = np.where(np.isnan(values), -np.inf, values)
    return tuple(int(i) for i in np.unravel_index(int(filled.argmax()), values.shape))


def _of_all(results: xr.Dataset, which: NDArray[np.bool_]) -> dict[str, int]:
    """Return the number of pieces in some blocks or lines, and in all; a line counts all of its pieces."""
    counts = results["count"].values if "place" in results.dims else np.ones(which.size, np.int64)
    return {"number": int(counts[which].sum()), "pieces": int(counts.sum())}
