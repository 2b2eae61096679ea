"""Facts of fragility and uncertainty studies: levels, probabilities, laws, restraints, sliding, sizes, and advice."""

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import xarray as xr

from ...core.aliases import Array, Index
from ...core.facts import Fact
from ...fragility.fitting.states import ALL
from ...fragility.runs.provenance import SCENE, blocks_of, number_of_motions
from ...models import Block
from ...motions.intensity.naming import FLOOR, place_in
from ..plan.gains import GAIN, comparable
from ..plan.ratios import HIGHER, LOWER, OPEN, SAME, verdict_of
from ..region.rows import event_levels
from ..report.results_file import without_motions
from ..tables.restraints import Gain, breaks_of, gains_of, strength_of
from ..tables.slides import edges_of
from ..tables.table import range_of
from ..text.block_order import HALF, RATE, places
from ..text.curve_notes import NOTABLE, extrapolated_shares, state_in, verb_in
from ..text.one_side import falling_both_ways
from ..text.precision import FITTED_RATE
from ..text.reached import EDGE, NO_LEVEL, highest_level
from ..text.spread import OUTER, sample_range, sources
from ..text.words import axis_of, block_title, display_unit, floor_name, is_one_piece, quantity_name, reference_law
from .crossed import Crossing, case_at, case_name, crossings_between, crossings_of_laws
from .law_choice import damped_throughout

RARE = 0.1
"""Probability of overturning, rare but still relevant to an owner, at whose level the answer also gives a count."""
DISAGREE = 1.1
"""Ratio of the results of two laws from which the answer gives their difference."""
MANY = 12
"""Number of pieces above which the answer gives the spread of their levels and chances."""
SPREAD = (0.1, 0.5, 0.9)
"""Shares of many pieces for which the answer gives the level at which half of the motions bring them down."""
CHANCES = (0.5, 0.1, 0.01)
"""Chances for which the answer counts the pieces that reach them."""
MOST_SAID = 3
"""Maximum number of comparisons, restraints and edges in the answer; tables contain all of them."""
HELD = 0.5
"""Share of falls that a restraint must prevent."""
SAFER_LARGER = ("width", "alpha", "R")
"""Sizes of which more is safer with the others unchanged."""


def answer(results: xr.Dataset) -> Iterator[Fact]:
    """Yield the answer, the most important fact first."""
    at, _ = reference_law(results)
    every = without_motions(results)
    small = every.isel(model=at)
    cases = small[HALF].transpose("block", ...)
    status = small["status"].transpose(*cases.dims).values.ravel()
    always = int((status == ALL).sum())
    if np.isnan(cases.values).all() or (not _rated(small) and not np.isfinite(cases.values).any()):
        yield _unknown(cases, status)
        reached = np.flatnonzero(cases.values.ravel() == np.inf)
        order = np.argsort(places(results).values.ravel(), kind="stable")
        for i in [int(place) for place in order if place in reached][:1]:
            yield from _at_an_end(case_at(small, cases, i), results)
        return
    by = RATE if _rated(small) else HALF
    if always:
        fallen = np.flatnonzero(status == ALL)
        yield Fact(
            "curve.always",
            always,
            names=(case_name(case_at(small, cases, int(fallen[0]))),),
            more={"cases": cases.size, **_what(results)},
        )
    # (by rate, blocks that fell in every run come after those that have a rate)
    ranked = np.argsort(places(results, by).values.ravel(), kind="stable")[always if by == HALF else 0 :]
    first = case_at(small, cases, int(ranked[0]))
    yield from _chance(first, results) if by == RATE else _level(first, results)
    if by == HALF and "risk_probability" in small:  # (a bound of the chance may be known)
        yield from _chance(first, results)
    yield from events(results)
    yield from (_gain("gain.chance", gain, results) for gain in [*gains_of(results, [at])][:MOST_SAID])
    yield from _restraints(results, at)
    for name, off, either, when in edges_of(results)[:MOST_SAID]:
        yield Fact("sliding.off_edge", names=(f"“{name}”",), more={"off": off, "either": either, "when": when})
    yield from _other_side(results)
    crossings = crossings_between(results, small, cases, ranked)
    # (the answer on many pieces is their spread; one crossing is enough)
    most = MOST_SAID if cases.size <= MANY else 1
    more, crossings = len(crossings[most:]), crossings[:most]
    # (where the curve of the first piece crosses another, its level of half does not make it the first at all levels)
    if cases.size > 1 and not (by == HALF and any(case_name(first) in crossing.names for crossing in crossings)):
        yield _rank(small, cases, ranked, by, results)
    yield from _laws(case_at(every, cases, int(ranked[0])), results)
    if by == RATE:
        yield from _level(first, results)
    for i, crossing in enumerate(crossings):
        others = more if i == most - 1 else 0
        yield _crossing("curve.crossing_too" if i else "curve.crossing", crossing, results, others)
    yield from _scatter(first, results)
    if cases.size > MANY:
        yield from _spread(small, cases, results)


def events(results: xr.Dataset) -> Iterator[Fact]:
    """Yield the share of a region that falls in one event, at levels of about 10, 50 and 90 %."""
    scale, unit = display_unit(axis_of(results))
    for level, mean, low, high, number in event_levels(results):
        share = float(np.ptp(results["event_quantile"].values[[0, -1]]))
        more = {"number": number, "share": share, **_what(results)}
        yield Fact("region.event", mean, low, high, unit, level=level / scale, more=more)


def actions(results: xr.Dataset) -> Iterator[Fact]:
    """Yield the recommended actions: sizes that meet a target, restraints that help or do not, a hazard curve."""
    if "size_along" in results.attrs:
        yield from _sizes(results)
    yield from _restraint_steps(results)
    if "rate" not in results and str(results.attrs.get("im")) != "scale":
        yield Fact("hazard.wanted", more={"floor": place_in(str(axis_of(results).attrs.get("long_name", ""))) == FLOOR})


def _rated(small: xr.Dataset) -> bool:
    return "rate" in small and bool(np.isfinite(small["rate"].values).any())


def _what(results: xr.Dataset) -> dict[str, object]:
    """Return the state and the measure of a study's curves."""
    return {"verb": verb_in(results), "state": state_in(results), "measure": quantity_name(axis_of(results))}


def _unknown(cases: xr.DataArray, status: Array) -> Fact:
    reasons = [NO_LEVEL.get(str(word), str(word)) for word in status]
    reasons = ["" if level == np.inf else reason for level, reason in zip(cases.values.ravel(), reasons, strict=True)]
    counts = Counter(reason for reason in reasons if reason)
    more = {"cases": cases.size, "counts": tuple(counts.values())}
    return Fact("curve.unknown", reasons.count(""), names=tuple(counts), more=more)


def _at_an_end(case: xr.Dataset, results: xr.Dataset, at: int = -1) -> Iterator[Fact]:
    """Yield the share of motions that bring down a block at the strongest level, or at the weakest."""
    if "probability" not in case or "level" not in case["probability"].dims:
        return
    end = case.isel(level=at)
    sampled = "sample_probability" in end
    low, high = sample_range(end, "sample_probability") if sampled else (float(end["lower"]), float(end["upper"]))
    scale, unit = display_unit(axis_of(results))
    level = float(results["level"][at]) / scale
    more = {"end": "strongest" if at else "weakest", "sampled": sampled, **_what(results)}
    yield Fact("curve.at_end", float(end["probability"]), low, high, unit, (case_name(case),), level, more=more)


def _level(case: xr.Dataset, results: xr.Dataset) -> Iterator[Fact]:
    """Yield the level at which half of the motions overturn a block, and a lower one at which about 10 % do."""
    scale, unit = display_unit(axis_of(results))
    half, low, high = range_of(case, HALF, scale)
    if not 0.0 < half < math.inf:
        yield from _at_an_end(case, results, 0 if half == 0.0 else -1)
        return
    more = {"either": str(case["block"].item()) in falling_both_ways(results), **_what(results)}
    yield Fact("curve.half_level", half, low, high, unit, (case_name(case),), more=more)
    if "sample_median" in case:
        least, most = sample_range(case)
        yield Fact("uncertainty.half_level", math.nan, least / scale, most / scale, unit)
    elif {"probability", "lower"} <= {*case} and "level" in results.coords:
        seen, levels = case["probability"].values, results["level"].values
        rare = np.flatnonzero((seen > 0.0) & (seen < 0.5) & (levels < half * scale))
        if rare.size:
            at = int(rare[np.abs(np.log(seen[rare] / RARE)).argmin()])
            share, least, most = (float(case[name][at]) for name in ("probability", "lower", "upper"))
            yield Fact("curve.rare", share, least, most, unit, level=float(levels[at]) / scale)


def _chance(case: xr.Dataset, results: xr.Dataset) -> Iterator[Fact]:
    """Yield the chance of a block in the study's years, over branches if there are any."""
    years, names = float(results.attrs["years"]), (case_name(case),)
    more = {"years": years, **_what(results)}
    if "epistemic_rate" in case:
        rate = float(case["epistemic_rate"])
        low, high = (float(case["epistemic_rate_fractile"].sel(epistemic_fractile=end)) for end in OUTER)
        largest = sources(case)[:1]
        more |= {"branches": case.sizes["branch"], "largest": largest}
        what = "rate.over_branches" if np.isfinite(rate) else "rate.unbounded_branch"
        yield Fact(what, rate, low, high, names=names, more=more)
        return
    chance = range_of(case, "risk_probability")
    more["rate"] = float(case["rate"])
    if not math.isfinite(chance.value):
        what = (
            "rate.at_least" if chance.lower > 0.0 else "rate.too_few_runs" if FITTED_RATE in case else "rate.no_curve"
        )
        yield Fact(what, lower=chance.lower, names=names, more=more)
        return
    yield Fact("rate.chance", *chance, names=names, more=more)
    for side, share in extrapolated_shares(case).items():
        if float(share) > NOTABLE:
            yield Fact("rate.part_extrapolated", float(share), names=names, more={"side": side})
    if f"{FITTED_RATE}_lower" in case and float(case["rate_misfit"]):
        yield Fact("rate.fitted_differs", float(case["fitted_risk_probability"]), names=names)


def _rank(small: xr.Dataset, cases: xr.DataArray, ranked: Index, by: str, results: xr.Dataset) -> Fact:
    """Return that a block falls first, with the blocks whose intervals overlap with its own."""
    low, high = (small[f"{by}_{end}"].transpose(*cases.dims).values.ravel() for end in ("lower", "upper"))
    first, *rest = ranked.tolist()
    with np.errstate(invalid="ignore"):
        close = [i for i in rest if (low[i] <= high[first] if by == HALF else high[i] >= low[first])]
    names = tuple(case_name(case_at(small, cases, other)) for other in close)
    single = "floor" not in small.dims and is_one_piece(small)
    more = {"name": case_name(case_at(small, cases, first)), "all": len(close) == len(rest) > 1, "single": single}
    more["others"] = len(ranked) < cases.size
    return Fact("curve.rank", len(ranked), names=names, more=more)


def _spread(small: xr.Dataset, cases: xr.DataArray, results: xr.Dataset) -> Iterator[Fact]:
    """Yield the spread of many pieces' levels, infinite if not reached, and the number with a high probability."""
    scale, unit = display_unit(axis_of(results))
    known = cases.values[~np.isnan(cases.values)]
    if known.size:
        # (a level that is not reached counts as one above all others)
        ends = np.quantile(np.minimum(known, 1e300), SPREAD)
        low, half, high = np.where(ends <= EDGE * highest_level(results), ends / scale, np.inf).tolist()
        more = {"pieces": known.size, "beyond": int(np.isinf(known).sum()), **_what(results)}
        yield Fact("curve.spread", half, low, high, unit, more=more)
    if _rated(small):
        chances = small["risk_probability"].values
        counts = [(share, int((chances >= share).sum())) for share in CHANCES]
        more = {"counts": counts, "years": float(results.attrs["years"])}
        yield Fact("rate.counts", int(np.isfinite(chances).sum()), more=more)


def _crossing(what: str, crossing: Crossing, results: xr.Dataset, others: int = 0) -> Fact:
    scale, unit = display_unit(axis_of(results))
    spans = [[(low / scale, high / scale) for low, high in part] for part in (crossing.higher, crossing.lower)]
    more = {"higher": spans[0], "lower": spans[1], "chance": crossing.by_chance, "others": others, **_what(results)}
    return Fact(what, lower=crossing.most_lower, upper=crossing.most_higher, unit=unit, names=crossing.names, more=more)


def _other_side(results: xr.Dataset) -> Iterator[Fact]:
    """Yield the pieces that may fall the other way as well, if falls to one side alone are counted."""
    either = falling_both_ways(results)
    names = tuple(f"“{block_title(str(block))}”" for block in results["block"].values if str(block) in either)
    if names and len(names) < results.sizes["block"]:
        yield Fact("curve.other_side", names=names, more=_what(results))


def _gain(what: str, gain: Gain, results: xr.Dataset) -> Fact:
    floor = f" on {gain.floor}" if gain.floor else ""
    more = {
        "other": gain.of_other,
        "verdict": verdict_of(gain.ratio),
        "ratio": gain.ratio,
        "years": float(results.attrs["years"]),
        "motions": number_of_motions(results),
    }
    names = (f"“{block_title(gain.block)}”{floor}", f"“{block_title(gain.other)}”")
    return Fact(what, gain.chance, names=names, more={**more, **_what(results)})


def _restraints(results: xr.Dataset, at: int) -> Iterator[Fact]:
    """Yield the frequency of ruptures of restraints, and their required strength, of the first blocks."""
    scale, unit = display_unit(axis_of(results))
    for name, share, low, high, level, design in breaks_of(results, at)[:MOST_SAID]:
        more = {"design": design, **_what(results)}
        yield Fact("restraint.breaks", share, low, high, unit, (f"“{block_title(name)}”",), level / scale, more=more)
    for name, needed, tried, target in strength_of(results, at)[:MOST_SAID]:
        more = {
            "tried": tried,
            "target": target,
            "years": float(results.attrs.get("years", math.nan)),
            **_what(results),
        }
        if "years" not in results.attrs:
            more["level"] = float(results["level"][0]) / scale
        yield Fact("restraint.needed", needed, unit=unit, names=(f"“{block_title(name)}”",), more=more)


def _laws(case: xr.Dataset, results: xr.Dataset) -> Iterator[Fact]:
    """Yield the results of the other laws if laws disagree: the probability, or the level without a hazard."""
    if "branch" in results.dims or case.sizes["model"] == 1:
        return  # (branches hold the choice of law)
    at, _ = reference_law(results)
    scale, unit = display_unit(axis_of(results))
    yearly = "risk_probability" in case
    values = case["risk_probability"].values if yearly else case[HALF].values / scale
    reference, others = float(values[at]), np.delete(values, at)
    known = [float(value) for value in (reference, *others.tolist()) if math.isfinite(value) and value > 0.0]
    finite = others[np.isfinite(others)]
    if len(known) > 1 and max(known) >= DISAGREE * min(known) and finite.size:
        with np.errstate(invalid="ignore"):
            fewer = values < reference / DISAGREE if yearly else values > reference * DISAGREE
        more = {"laws": others.size, "yearly": yearly, "throughout": damped_throughout(results, fewer)}
        more["verb"] = verb_in(results)
        ends = float(finite.min()), float(finite.max())
        yield Fact("law.range", math.nan, *ends, unit, (case_name(case),), more=more)
    for i, crossing in enumerate(crossings_of_laws(case, results)[:MOST_SAID]):
        named = crossing._replace(names=(*crossing.names, case_name(case)))
        yield _crossing("law.crossing_too" if i else "law.crossing", named, results)


def _scatter(case: xr.Dataset, results: xr.Dataset) -> Iterator[Fact]:
    """Yield the uncertain input that contributes most to the scatter of a block's capacity."""
    if str(results.attrs["kind"]) != "uncertainty":
        return
    share = case["capacity_share"] if "capacity_share" in case else case.get("flag_share")
    if share is None:
        return
    share = share.isel(level=0) if "level" in share.dims else share
    if not bool(np.isfinite(share.values).any()):
        return
    largest = int(np.nanargmax(share.values))
    yield Fact("uncertainty.largest", float(share[largest]), more={"input": str(share["component"].values[largest])})


def _sizes(results: xr.Dataset) -> Iterator[Fact]:
    """Yield the size that meets the target on each floor, and the pieces that miss it."""
    along = str(results.attrs["size_along"])
    size_of, target = results[f"size_{along}"], float(results.attrs["size_probability"])
    unit = f" {size_of.attrs['units']}".removesuffix(" 1")
    at, _ = reference_law(results)
    for floor in size_of["floor"].values.tolist() if "floor" in size_of.dims else [None]:
        of_floor = results if floor is None else results.sel(floor=floor)
        size = range_of(of_floor.isel(model=at), f"size_{along}")
        others = np.delete(of_floor[f"size_{along}"].values, at)
        others = others[np.isfinite(others)]
        chance = of_floor["risk_probability"].isel(model=at).values
        worst = of_floor["risk_probability"].max("model").values
        missed = tuple(f"“{block_title(str(block))}”" for block in of_floor["block"].values[chance > target])
        only = of_floor["block"].values[(chance <= target) & (worst > target)]
        more = {
            "size": along,
            "least": along in SAFER_LARGER,
            "target": target,
            "years": float(results.attrs["years"]),
            "others": (float(others.min()), float(others.max())) if others.size else None,
            "floor": "" if floor is None else floor_name(floor),
            "only": tuple(f"“{block_title(str(block))}”" for block in only),
        }
        yield Fact("size.target" if math.isfinite(size.value) else "size.none", *size, unit, missed, more=more)


def _restraint_steps(results: xr.Dataset) -> Iterator[Fact]:
    """Yield the effect of the restraints of blocks, compared with the same blocks without."""
    if SCENE not in results.coords:
        return
    blocks = blocks_of(results)
    pairs = {
        i: j
        for i, j in comparable(blocks).items()
        if blocks[i].restraint is not None and blocks[j].restraint is None and blocks[i].wall == blocks[j].wall
    }
    steps = list(_by_chance(results, blocks, pairs) if GAIN in results else _by_level(results, blocks, pairs))
    yield from steps
    if any(fact.what.startswith("restraint.helps") for fact in steps):
        yield Fact("restraint.check")


def _by_chance(results: xr.Dataset, blocks: Sequence[Block], pairs: Mapping[int, int]) -> Iterator[Fact]:
    named = {(blocks[i].label, blocks[j].label) for i, j in pairs.items()}
    for gain in gains_of(results, [reference_law(results)[0]]):
        if (gain.block, gain.other) not in named:
            continue
        word = verdict_of(gain.ratio)
        weak = word == LOWER and gain.ratio.lower > HELD
        what = {LOWER: "too_weak" if weak else "helps", HIGHER: "hurts", OPEN: "no_effect", SAME: "no_effect"}.get(word)
        if what is not None:
            yield _gain(f"restraint.{what}", gain, results)


def _by_level(results: xr.Dataset, blocks: Sequence[Block], pairs: Mapping[int, int]) -> Iterator[Fact]:
    """Yield the effect of restraints on the level at which half of the motions overturn a block."""
    at, _ = reference_law(results)
    small = without_motions(results).isel(model=at)
    if "floor" in small[HALF].dims or "level" not in small.coords:
        return
    scale, unit = display_unit(axis_of(results))
    either = falling_both_ways(results)
    for i, j in pairs.items():
        held, other = small.isel(block=i), small.isel(block=j)
        levels = [float(case[HALF]) / scale for case in (held, other)]
        if {blocks[i].label, blocks[j].label} & either or not math.isfinite(levels[1]):
            continue
        names = tuple(f"“{block_title(blocks[k].label)}”" for k in (i, j))
        seldom = (small["level"].values > float(other[f"{HALF}_upper"])) & (held["upper"].values < HELD)
        if seldom.any():
            level, above, what = float(small["level"].values[seldom].max()) / scale, True, "helps"
        elif math.isfinite(levels[0]):
            # (fitted medians have narrower intervals than half levels)
            helps = float(held["median_lower"]) > float(other["median_upper"])
            hurts = float(held["median_upper"]) < float(other["median_lower"])
            level, above, what = levels[0], False, "helps" if helps else "hurts" if hurts else "no_effect"
        else:
            continue
        more = {"other": levels[1], "above": above, "motions": number_of_motions(results), **_what(results)}
        yield Fact(f"restraint.{what}_level", level, unit=unit, names=names, more=more)
