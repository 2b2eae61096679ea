"""What the answer of a report rests on, in sentences for the client: no names of keys, no parameters of laws."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import xarray as xr

from ...fragility.runs.provenance import SCENE, blocks_of, number_of_motions
from ...motions.arrays import POLARITY
from ...wording import confidence_text, counted, given_number
from ..text.words import reference_law
from .method import study_of

LOST = "The energy that a piece loses in rocking follows"
LAW_WORDS = {
    "housner": "The energy that a piece loses in rocking is that of the impacts of a rigid block (Housner 1963)",
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
            "Walls are rigid and move with the floor. “To the front” means away from the wall, into the room; “to the "
            "back” means towards the wall."
        )
    if any(block.restraint is not None for block in blocks):
        yield (
            "Straps, brackets and other restraints are elastic up to the strength given for them; beyond it they break "
            "and hold nothing from then on."
        )


def _sentences(results: xr.Dataset, study: Mapping[str, Any]) -> Iterator[str]:
    one = "piece" if str(results.attrs["kind"]) == "performance" else "block"
    yield _shaking(results, study)
    building = study.get("building")
    if isinstance(building, dict):
        storeys = building.get("storeys")
        what = "The building" if storeys is None else f"The building ({counted(int(storeys), 'storey')})"
        period = building.get("period_s")
        first = "" if period is None else f", with a first natural period of {given_number(float(period))} s"
        yield f"{what} is taken as elastic{first}; each {one} is shaken by the motion of its own floor."
    elif "buildings" in study:
        yield "The buildings are taken as elastic; each block is shaken by the motion of its own floor."
    elif _histories(study):
        yield from _own_building(results, study)
    scene = SCENE in results.coords
    yield (
        f"Each {one} is taken as a rigid body that {'stands' if scene else 'stands freely'} on a level floor and is "
        f"shaken horizontally, in the direction of its width. Sliding, {'' if scene else 'walls, '}neighbouring {one}s "
        "and vertical shaking are not included."
    )
    if scene:
        yield from _scenes(results)
    if "sample" in results.sizes:
        yield (
            f"The uncertain properties of each {one} are sampled {results.sizes['sample']:,} times from their "
            "distributions."
        )
    law = results.coords.get("law")
    if law is not None and law.dims == ("model",):
        at, _ = reference_law(results)
        words = LAW_WORDS[str(law.values[at])].replace("a piece", f"a {one}")
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
    beta = float(results.attrs.get("modelling_dispersion", 0.0))
    held = (
        f"modelling uncertainty (β_m = {beta:g}) is in the rates themselves"
        if beta
        else "they do not include modelling uncertainty"
    )
    if "branch" in results.dims:
        branches = counted(results.sizes["branch"], "weighted combination")
        yield (
            f"Ranges of return periods and of chances cover 90 % of the results of {branches} of laws, motions and "
            "hazard curves, together with the other uncertainties that the study states; other ranges are "
            f"{sure} intervals that reflect only the limited number of motions."
        )
    else:
        yield f"Ranges in brackets are {sure} intervals that reflect only the limited number of motions; {held}."
    if "anchored" in results and bool(np.any(results["anchored"].values)):
        kits = ", except for those held by a kit, which can break" if "anchored_with" in results.coords else ""
        yield f"Pieces that are already anchored are counted as not overturning{kits}."
    if "kit_falls" in results:
        yield (
            "Each kit is tried on every piece that it fits, under the same motions. It is elastic up to the strength "
            "that is given, the least of device, wall fixing and furniture fixing, and breaks for good beyond it."
        )
    if str(results.attrs["kind"]) == "performance":
        code = results.attrs.get("code")
        site = f"{code} with {results.attrs.get('code_site', '')}".removesuffix(" with ")
        yield (
            "Code requirements were not checked." if code is None else f"Code requirements are checked against {site}."
        )


def _histories(study: Mapping[str, Any]) -> bool:
    """Return whether the floors move by histories with levels of their own, or by others that are scaled."""
    motions = study.get("motions")
    return isinstance(motions, dict) and ("floors_index" in motions or bool(motions.get("elastic")))


def _own_building(results: xr.Dataset, study: Mapping[str, Any]) -> Iterator[str]:
    """Yield how the histories of another program's building model are used."""
    yield (
        "How the floors move was calculated with a building model of another program, which is not checked here; each "
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
        others = "other motions" if "record" in results.coords else "the same motions"
        yield f"Each level of shaking has floor motions calculated for it ({others} at each level), used unscaled."
    if "direction" in results.coords:
        yield (
            "Each piece is shaken in the direction of its width alone, by the motion of its floor in that direction. "
            "That it may fall in the other direction is not included."
        )


def _shaking(results: xr.Dataset, study: Mapping[str, Any]) -> str:
    motions = study.get("motions")
    given: Mapping[str, Any] = motions if isinstance(motions, dict) else {}
    made = str(given.get("generator", ""))
    # (runs on several floors are counted for each floor)
    number = (number_of_motions(results) if "motion" in results.sizes else 0) // max(1, results.sizes.get("floor", 1))
    stripes = study.get("stripes")
    varied = isinstance(stripes, dict) and any(one.get("motions") for one in stripes.get("at", []))
    if "floors_file" in given:
        what = f"{counted(number, 'motion')} of the floors, calculated elsewhere"
    elif _histories(study):
        levels = f" at each of {counted(results.sizes['level'], 'level')}" if results.sizes["level"] > 1 else ""
        many = "" if given.get("elastic") else levels
        what = f"{counted(number, 'motion')} of the floors{many}, calculated elsewhere"
    elif "records" in given:
        what = counted(number, "recorded ground motion")
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
    scaled = scaled and (not _histories(study) or bool(given.get("elastic")))
    levels = f", scaled to {counted(results.sizes['level'], 'level')} of shaking" if scaled else ""
    sets = len(study.get("motion_sets") or [])
    more = (
        f"; {'one further set' if sets == 1 else f'{sets} further sets'} of motions {'is' if sets == 1 else 'are'} "
        "weighted with it"
        if sets
        else ""
    )
    ways = ", each run both ways (as it is and reversed)" if POLARITY in results.coords else ""
    return f"The shaking is that of {what}{ways}{levels}{more}."
