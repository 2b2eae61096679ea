"""What the answer of a report rests on, in sentences for the client: no names of keys, no parameters of laws."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import xarray as xr

from ...core.doubts import first_of
from ...core.wording import confidence_text, counted, given_number
from ...fragility.fitting.states import DIRECTIONS, state_name
from ...fragility.risk.modelling import RANGE
from ...fragility.runs.provenance import SCENE, about_both_axes, blocks_of, number_of_motions
from ...fragility.validity.scenes import DRIFT, pushed_by_drift
from ...motions.arrays import POLARITY
from ..buildings.variables import FALLEN, levels_have_own_motions
from ..plan.slides import FALL_OFF, GATED, GATED_RATE, INSTEAD
from ..text.spread import MODEL_RANGE
from ..text.words import block_title, reference_law, roof_of, scales, storeys_yield
from .method import by_histories, lifted, study_of

LOST = "The energy that a piece loses in rocking follows"
LAW_WORDS = {
    "housner": "A rocking piece loses energy as a rigid block does in its impacts on the floor (Housner 1963)",
    "energy-consistent": f"{LOST} a damping law that dissipates, at each passage through the upright position, the "
    "energy that an impact would",
    "discrete": f"{LOST} the damping law of Liu, Huang and Qu (2024), which acts near the upright position",
    "giannini-masiani": f"{LOST} the viscous law of Giannini and Masiani (1990)",
    "makris-konstantinidis": f"{LOST} the viscous law of Makris and Konstantinidis (2003)",
    "vassiliou": f"{LOST} the viscous law of Vassiliou, Mackie and Stojadinović (2014)",
    "viscous": f"{LOST} a viscous law",
}
"""Laws in words, by their short names."""


def basis(results: xr.Dataset) -> list[str]:
    """Return what the answer of a study rests on, one sentence each."""
    return list(_sentences(results, study_of(results)))


def _scenes(results: xr.Dataset) -> Iterator[str]:
    """Say what stands around blocks, or holds them."""
    blocks = blocks_of(results if "block" in results.coords else results.rename(item="block"))
    if any(block.wall is not None for block in blocks):
        yield (
            "Walls are rigid and move with the floor. “Forward” means away from the wall, into the room; “backward” "
            "means towards the wall."
        )
        moved = [f"“{block_title(block.label)}”" for block in blocks if pushed_by_drift(block)]
        if moved:
            yield (
                f"In a building the wall moves with the drift of the storey: at a drift of {100.0 * DRIFT:g} % of the "
                f"height it moves, where it meets {first_of(moved)}, by more than a third of the gap and may push "
                f"{'it' if len(moved) == 1 else 'them'}. That is not included, and falls into the room may be more "
                "frequent than stated."
            )
    if any(block.restraint is not None for block in blocks):
        yield (
            "Straps, brackets and other restraints are elastic up to the strength given for them; at that force they "
            "break and no longer hold."
        )
    if any(block.bed is not None for block in blocks):
        yield (
            "Soft beds (carpets, mats) are elastic, without tension, and thick enough for the settlement given; how "
            "much energy they take up is the law's damping, which should be measured."
        )


def _left_out(slides: bool, scene: bool, vertical: bool) -> str:
    """Return what the model of a piece leaves out, in words."""
    left = [
        *([] if slides else ["sliding"]),
        *([] if scene else ["walls"]),
        "neighbouring pieces",
        *([] if vertical else ["vertical shaking"]),
    ]
    said = f"{', '.join(left[:-1])} and {left[-1]}" if len(left) > 1 else left[0]
    return said[:1].upper() + said[1:]


def _what_is_left(results: xr.Dataset) -> str:
    """Return what else the table of sliding says, in words."""
    if GATED in results or GATED_RATE in results:
        return ", how far it slides, and what is left of the chance of falling"
    return " and how far it slides"


def _width_alone(results: xr.Dataset) -> str:
    """Return which pieces are shaken along their width alone where others are along both, in words."""
    if "both_axes" not in results.coords:
        return ""
    alone = results["item"].values[~results["both_axes"].values.astype(bool) & ~results["anchored"].values]
    return f" ({first_of([f'“{one}”' for one in alone])} along the width alone)" if alone.size else ""


def _sentences(results: xr.Dataset, study: Mapping[str, Any]) -> Iterator[str]:
    yield _shaking(results, study)
    building = study.get("building")
    if isinstance(building, dict):
        storeys = building.get("storeys")
        roof = ""
        if storeys is not None:
            roof = f" ({counted(int(storeys), 'storey')}; floor 0 is the ground floor, floor {int(storeys)} the roof)"
        what = f"The building{roof}"
        period = building.get("period_s")
        first = "" if period is None else f", with a first natural period of {given_number(float(period))} s"
        if not scales(building):
            yield from _yielding(results, building)
        else:
            yield f"{what} is taken as elastic{first}; each piece is shaken by the motion of its own floor."
        if storeys is not None:
            yield from _on_the_roof(results, roof_of(results))
    elif "buildings" in study:
        but = "" if all(map(scales, study["buildings"])) else ", but for those that yield or are isolated"
        yield f"The buildings are taken as elastic{but}; each piece is shaken by the motion of its own floor."
    elif by_histories(study):
        yield from _own_building(results, study)
    if "support" in results.coords:
        on = results["item"].values[results["support"].values != ""]
        yield (
            f"{first_of([f'“{one}”' for one in on])} {'stands' if on.size == 1 else 'stand'} on a bench or an isolated "
            f"platform, which answers the motion of the floor and shakes what stands on it; {_at_stops(study)}."
        )
    support = study.get("support")
    if isinstance(support, dict):
        on = "a bench" if str(support["kind"]) == "bench" else "an isolated platform"
        yield (
            f"The pieces stand on {on}, which answers the motion of the floor and shakes what stands on it"
            f"{_at_stop(support)}."
        )
    scene = SCENE in results.coords
    ground = "a platform that stays level" if isinstance(support, dict) else "a level floor"
    sideways = (
        ", and along its depth by the other component of the same earthquake; it has fallen where it falls in either "
        f"direction{_width_alone(results)}"
        if about_both_axes(results)
        else ""
    )
    yield (
        f"Each piece is taken as a rigid body that {'stands' if scene else 'stands freely'} on {ground} and is "
        "shaken horizontally, in the direction of its width, the direction in which it tips most easily (for a "
        f"bookcase: from front to back){sideways}{', and vertically' if lifted(study) else ''}. "
        f"{_left_out(INSTEAD in results, scene, lifted(study))} are not included."
    )
    if FALLEN in results:
        yield (
            "The chances of falling are upper estimates: a piece counts as fallen if it would overturn were it unable "
            "to slide (feet may catch at a joint, the edge of a carpet or a cable), or if it slides off an edge. A "
            "piece with little friction slides instead of rocking; the table of sliding in the appendix gives each of "
            "the two, and what is left of overturning."
        )
    elif INSTEAD in results:
        yield (
            "The chances of falling are those of pieces that cannot slide: feet may catch at a joint, the edge of "
            "a carpet or a cable. A piece with little friction slides instead; the table of sliding in the appendix "
            f"says how likely that is{_what_is_left(results)}."
        )
    if f"{FALL_OFF}_probability" in results:
        yield (
            "A piece falls off its shelf, bench or pedestal when it slides over the edge; while it rocks it is taken "
            "not to move towards the edge."
        )
    yield from _exact_friction(results)
    yield from _round(results)
    if scene:
        yield from _scenes(results)
    if "sample" in results.sizes:
        yield (
            f"The uncertain properties of each piece are sampled {results.sizes['sample']:,} times from their "
            "distributions."
        )
    law = results.coords.get("law")
    if str(results.attrs["kind"]) == "sensitivity":
        values, symbol = results["value"].values, {"e": "e", "delta": "δ"}[str(results.attrs["parameter"])]
        yield (
            f"{counted(results.sizes['model'], 'damping law')} are compared with each other and with a rigid block "
            f"with impacts, each with {counted(values.size, 'value')} of {symbol} from {values.min():g} to "
            f"{values.max():g}, under the same motions."
        )
    elif law is not None and law.dims in (("model",), ("model", "sample")):
        at, _ = reference_law(results)
        own = dict.fromkeys(map(str, np.ravel(law.values[at])))
        words = "; ".join(LAW_WORDS[one] for one in own)
        others = results.sizes["model"] - 1
        them = "one other law" if others == 1 else f"{others} other laws"
        rest = f"; results under {them} are in the technical appendix" if others else ""
        yield f"{words}{rest}."
    if "rate" in results or "annual_number" in results:
        curves = 1 + len(study.get("hazards") or [])
        of = "the hazard curve supplied for the site" if curves == 1 else f"{curves} weighted hazard curves"
        yield f"How often the ground shakes, and how strongly, is taken from {of}."
    if "cost_median" in results.coords or "annual_downtime" in results or "annual_injuries" in results:
        yield (
            "Costs, downtimes and injuries are sampled from the distributions in the inventory, independently for each "
            "piece; all repairs are assumed to run at the same time."
        )
    sure = confidence_text(results)
    apart = f", apart from {MODEL_RANGE}s," if RANGE in results.attrs else ""
    beta = float(results.attrs.get("modelling_dispersion", 0.0))
    held = (
        f"modelling uncertainty (β_m = {beta:g}) is in the rates themselves"
        if beta
        else "they do not include modelling uncertainty"
    )
    one_way = str(results.attrs.get("state")) in {state_name(one) for one in DIRECTIONS}
    if one_way and str(results.attrs.get("form")) == "isotonic":
        yield (
            "The chance of such a fall at each level of shaking is the share of the motions that cause it; where that "
            "share is lower at a stronger level, the two are averaged, so that it never decreases. No smooth curve is "
            "fitted. Compared with a study that counts falls in both directions, for which a smooth (lognormal) curve "
            "is fitted, small differences between the two can come from that alone."
        )
    if "branch" in results.dims:
        branches = counted(results.sizes["branch"], "weighted combination")
        yield (
            f"Ranges of return periods and of chances cover 90 % of the results of {branches} of laws, motions and "
            f"hazard curves, together with the other uncertainties that the study states; other ranges{apart} "
            f"are {sure} intervals that reflect only the limited number of motions."
        )
    else:
        yield (
            f"Ranges in brackets{apart} are {sure} intervals that reflect only the limited number of motions; {held}."
        )
    if "anchored" in results and bool(np.any(results["anchored"].values)):
        kits = ", except for those held by a kit, which can break" if "anchored_with" in results.coords else ""
        yield f"Pieces that are already anchored are assumed not to overturn{kits}."
    if "kit_falls" in results:
        yield (
            "Each kit is tried on every piece that it fits, under the same motions. Its strength is taken as that of "
            "its weakest part: device, wall fixing or furniture fixing."
        )
    if str(results.attrs["kind"]) == "performance":
        code = results.attrs.get("code")
        site = f"{code} with {results.attrs.get('code_site', '')}".removesuffix(" with ")
        yield (
            "Code requirements were not checked." if code is None else f"Code requirements are checked against {site}."
        )


def _on_the_roof(results: xr.Dataset, roof: str) -> Iterator[str]:
    """Yield which pieces stand on the roof, so that a floor that was meant as the uppermost storey is noticed."""
    if "item" not in results.dims or "floor" not in results.coords:
        return
    above = results["item"].values[results["floor"].values.astype(str) == roof]
    if above.size:
        stand = "stands" if above.size == 1 else "stand"
        yield (
            f"{first_of([f'“{one}”' for one in above])} {stand} on floor {roof}, which is the roof. If the highest "
            f"storey is meant, that is floor {int(roof) - 1}."
        )


def _exact_friction(results: xr.Dataset) -> Iterator[str]:
    """Yield which pieces have a coefficient of friction without dispersion, where sliding is evaluated."""
    given = json.loads(str(results.attrs.get("screen", "{}"))).get("friction")
    if INSTEAD not in results or not isinstance(given, dict):
        return
    dim = "item" if "item" in results.dims else "block"
    labels = results[dim].values[np.isfinite(results[INSTEAD].values)]
    exact = [f"“{one}”" for one in labels if given.get(str(one), given).get("distribution") == "fixed"]
    if exact:
        yield (
            f"The coefficient of friction of {first_of(exact)} is taken as known exactly, because no dispersion is "
            "given for it: whether such a piece slides is then certain, which it is not on a real floor."
        )


def _round(results: xr.Dataset) -> Iterator[str]:
    """Yield which pieces have a round base, and what is left out for them."""
    if "round" not in results.coords:
        return
    dim = results["round"].dims[0]
    known = ~results["anchored"].values.astype(bool) if "anchored" in results.coords else True
    named = [f"“{one}”" for one in results[dim].values[results["round"].values.astype(bool) & known]]
    if named:
        its = "its base is" if len(named) == 1 else "their bases are"
        yield (
            f"{first_of(named)}: {its} round. A round base can wobble and roll round its rim, which is not modelled "
            "and can make it fall in weaker shaking than is given here."
        )


def _at_stops(study: Mapping[str, Any]) -> str:
    """Return what is modelled of the stops of a study's isolated platforms."""
    modelled = [one["name"] for one in study.get("supports") or [] if one.get("stop_frequency_hz") is not None]
    if not modelled:
        return "what it would do at its stops is not modelled"
    return (
        f"stops of {first_of([f'“{one}”' for one in modelled])} are modelled, and what falls in a strike rests on the "
        "stiffness given for them"
    )


def _at_stop(support: Mapping[str, Any]) -> str:
    """Return what is modelled of the stops of the one support of a study; '' of a bench, which has none."""
    if str(support["kind"]) == "bench":
        return ""
    if support.get("stop_frequency_hz") is None:
        return "; what it would do at its stops is not modelled"
    return "; its stops are modelled, and what falls in a strike rests on the stiffness given for them"


def _yielding(results: xr.Dataset, building: Mapping[str, Any]) -> Iterator[str]:
    """Yield how a building that yields or is isolated moves, and what is not known where it collapses."""
    what = "The storeys of the building yield" if storeys_yield(building) else "The building is elastic"
    on = "" if building.get("isolation") is None else ", on isolators below the slab that is floor 0 here"
    yield (
        f"{what}{on}: each ground motion goes through it at its own level of shaking, and each "
        "piece is shaken by the motion of its own floor."
    )
    if "building_collapsed" in results and bool(results["building_collapsed"].any()):
        fallen = int((results["building_collapsed"] > 0).sum())
        yield (
            f"The building collapses in {fallen:,} of {results['building_collapsed'].size:,} cases of a motion at a "
            "level. There a piece counts as fallen only where the motion of its floor until then makes it fall: what "
            "the collapse itself destroys, and whom it injures, is in no number of this report."
        )


def _own_building(results: xr.Dataset, study: Mapping[str, Any]) -> Iterator[str]:
    """Yield how the histories of another program's building model are used."""
    yield (
        "The floor motions were calculated with a building model of another program, which is not checked here; each "
        "piece is shaken by the motion of its own floor."
    )
    motions = study["motions"]
    if motions.get("elastic"):
        of = "one level of shaking" if "floors_index" in motions else "each earthquake"
        yield (
            f"The floor motions of {of} are scaled in proportion to the level of shaking, as if the building remained "
            "elastic."
        )
    elif str(results.attrs["im"]) != "scale":
        others = "other motions" if levels_have_own_motions(results) else "the same motions"
        yield f"Each level of shaking has floor motions calculated for it ({others} at each level), used unscaled."
    if "direction" in results.coords:
        yield (
            "Each piece is shaken only in the direction of its width, by the motion of its floor in that direction. "
            "Falls in the other direction are not included."
        )


def _shaking(results: xr.Dataset, study: Mapping[str, Any]) -> str:
    motions = study.get("motions")
    given: Mapping[str, Any] = motions if isinstance(motions, dict) else {}
    made = str(given.get("generator", ""))
    # (runs on several floors are counted for each floor)
    counts = "motion" in results.sizes or "motions_run" in results
    number = (number_of_motions(results) if counts else 0) // max(1, results.sizes.get("floor", 1))
    stripes = study.get("stripes")
    varied = isinstance(stripes, dict) and any(one.get("motions") for one in stripes.get("at", []))
    if "floors_file" in given:
        what = f"{counted(number, 'floor motion')}, calculated elsewhere"
    elif by_histories(study):
        levels = f" at each of {counted(results.sizes['level'], 'level')}" if results.sizes["level"] > 1 else ""
        many = "" if given.get("elastic") else levels
        what = f"{counted(number, 'floor motion')}{many}, calculated elsewhere"
    elif isinstance(stripes, dict) and stripes.get("select") is not None:
        what = (
            f"{counted(number, 'ground motion')}, which were selected for each level of shaking from larger sets so "
            "that together they agree with the hazard"
        )
    elif "records" in given:
        what = f"{counted(number, 'ground motion')} read from files"
    elif varied:
        what = f"{counted(number, 'ground motion')}, from different earthquakes for each level of shaking"
    elif "magnitude" in given:
        distance = given.get("distance_m")
        far = "" if distance is None else f" at a distance of {given_number(float(distance) / 1000.0)} km"
        what = f"{counted(number, 'simulated ground motion')} of an earthquake of magnitude {given['magnitude']:g}{far}"
    else:
        what = counted(number, "simulated ground motion" if made else "idealised pulse")
    scaled = str(results.attrs.get("design")) == "ida" or (
        str(results.attrs["kind"]) == "performance" and str(results.attrs["im"]) != "scale"
    )
    scaled = scaled and (not by_histories(study) or bool(given.get("elastic")))
    levels = f", scaled to {counted(results.sizes['level'], 'level')} of shaking" if scaled else ""
    sets = len(study.get("motion_sets") or [])
    more = (
        f"; {'one further set' if sets == 1 else f'{sets} further sets'} of motions {'is' if sets == 1 else 'are'} "
        "weighted with it"
        if sets
        else ""
    )
    ways = ", each applied both ways (as it is and reversed)" if POLARITY in results.coords else ""
    return f"The pieces are shaken by {what}{ways}{levels}{more}."
