"""Inputs, method and assumptions of a study, from its results and the study file in them."""

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from ...core.facts import Fact
from ...fragility.fitting.states import DIRECTIONS, state_name
from ...fragility.runs.provenance import EDGE, SCENE, about_both_axes, blocks_of, number_of_motions, tilt_limits
from ...fragility.validity.scenes import DRIFT, pushed_by_drift
from ...models import Block
from ...models.scenes.edge import FOOT
from ...motions.arrays import POLARITY
from ...motions.supports.stops import RESTITUTION
from ..buildings.variables import FALLEN, levels_have_own_motions
from ..plan.slides import FALL_OFF, INSTEAD
from ..text.words import block_title, reference_law, roof_of, scales, storeys_yield
from .notes import notes_of

MOST_LINES = 6
"""Most records whose corrections are written out."""


def study_of(results: xr.Dataset) -> dict[str, object]:
    """Return the study file as plain values; empty if the results do not contain it."""
    try:
        study = json.loads(str(results.attrs.get("study", "{}")))
    except ValueError:
        return {}
    return study if isinstance(study, dict) else {}


def lifted(study: Mapping[str, object]) -> bool:
    """Return True if the motions of a study have a vertical component, too."""
    motions, stripes = study.get("motions"), study.get("stripes")
    of_stripes = stripes.get("at", []) if isinstance(stripes, dict) else []
    tables = [table for table in (motions, *(at.get("motions") for at in of_stripes)) if isinstance(table, dict)]
    return any(table.get("component") for table in tables) and any(table.get("vertical") for table in tables)


def by_histories(study: Mapping[str, Any]) -> bool:
    """Return True if the floors move by histories with levels of their own, or by others that are scaled."""
    motions = study.get("motions")
    return isinstance(motions, dict) and ("floors_index" in motions or bool(motions.get("elastic")))


def inputs_of(results: xr.Dataset) -> Iterator[Fact]:
    """Yield the inputs of a study: motions, building, hazard and code."""
    study = study_of(results)
    yield _motions(results, study)
    if "processing" in results.attrs:
        done = str(results.attrs["processing"]).splitlines()
        yield Fact("motion.processing", names=tuple(done[:MOST_LINES]), more={"others": len(done[MOST_LINES:])})
    yield from (note for note in notes_of(results) if note.what in ("motion.taken", "hazard.given"))
    if "scenario" in results.attrs:
        yield Fact("motion.scenario", names=tuple(str(results.attrs["scenario"]).splitlines()))
    building = study.get("building")
    if isinstance(building, dict):
        more = {"storeys": building.get("storeys"), "period": building.get("period_s")}
        more["yields"], more["isolated"] = storeys_yield(building), building.get("isolation") is not None
        yield Fact("building.given", names=tuple(str(results.attrs.get("storeys", "")).splitlines()), more=more)
        yield from _on_the_roof(results, roof_of(results))
    elif "buildings" in study:
        yield Fact("building.several", more={"elastic": all(map(scales, _tables(study["buildings"])))})
    elif by_histories(study):
        yield Fact("building.own_model", more={"direction": "direction" in results.coords})
    if "code" in results.attrs:
        site = (str(results.attrs.get("code_site", "")),)
        yield Fact("code.checked", names=site, more={"code": str(results.attrs["code"])})


def method_of(results: xr.Dataset) -> Iterator[Fact]:
    """Yield the method and the assumptions of a study, one fact for each sentence."""
    study = study_of(results)
    kind, slides = str(results.attrs["kind"]), INSTEAD in results
    scene = any(block.surrounded for block in _blocks(results))
    yield Fact(
        "block.model",
        more={
            "held": scene,
            "slides": slides,
            "lifted": lifted(study),
            "both": about_both_axes(results),
            "level": isinstance(study.get("support"), dict),
        },
    )
    yield from _law(results)
    design = str(results.attrs.get("design", ""))
    if design:
        yield Fact(f"design.{design}")
    if kind in ("performance", "sensitivity", "uncertainty"):
        yield Fact(f"kind.{kind}")
    stripes = study.get("stripes")
    if isinstance(stripes, dict) and stripes.get("select") is not None:
        yield Fact("selection.method")
    if POLARITY in results.coords:
        yield Fact("motion.polarity_both")
    if "fit_method" in results.attrs:
        yield Fact("curve.fit_method", names=(str(results.attrs["fit_method"]),))
    if _one_way(results) and str(results.attrs.get("form")) == "isotonic":
        yield Fact("curve.isotonic")
    if "rate" in results:
        yield Fact("rate.method")
    limited = tilt_limits(results)
    if limited:
        least, most = min(limited.values()), max(limited.values())
        yield Fact("block.tilt_limit", lower=least, upper=most, names=tuple(map(block_title, limited)))
    yield from _surroundings(results, study)
    yield from _sliding(results)
    if "cost_median" in results.coords or "annual_downtime" in results or "annual_injuries" in results:
        yield Fact("consequence.sampled")
    if "anchored" in results and bool(np.any(results["anchored"].values)):
        yield Fact("anchoring.assumed", more={"kits": "anchored_with" in results.coords})
    if "kit_falls" in results:
        yield Fact("kit.tried")
    yield Fact(
        "validity.left_out",
        more={
            "slides": slides,
            "lifted": lifted(study),
            "walls": any(block.wall is not None for block in _blocks(results)),
        },
    )


def _one_way(results: xr.Dataset) -> bool:
    """Return True if the curves are of falls to one side."""
    return str(results.attrs.get("state")) in {state_name(state) for state in DIRECTIONS}


def _blocks(results: xr.Dataset) -> Sequence[Block]:
    """Return the blocks of a study in which a block has surroundings or a tilt limit; none of others."""
    if SCENE not in results.coords:
        return ()
    return blocks_of(results)


def _tables(value: object) -> list[dict[str, Any]]:
    return [table for table in value if isinstance(table, dict)] if isinstance(value, list) else []


def _motions(results: xr.Dataset, study: Mapping[str, Any]) -> Fact:
    """Return the motions: their number, origin and scaling."""
    given = study["motions"] if isinstance(study.get("motions"), dict) else {}
    # (runs on several floors are counted for each floor)
    counts = "motion" in results.sizes or "motions_run" in results
    number = (number_of_motions(results) if counts else 0) // max(1, results.sizes.get("floor", 1))
    stripes = study.get("stripes")
    varied = isinstance(stripes, dict) and any(at.get("motions") for at in stripes.get("at", []))
    selected = isinstance(stripes, dict) and stripes.get("select") is not None
    origin = next(
        name
        for name, holds in (
            ("floors", "floors_file" in given or by_histories(study)),
            ("selected", selected),
            ("records", "records" in given),
            ("varied", varied),
            ("scenario", "magnitude" in given and "scenario" not in results.attrs),  # (which says them)
            ("simulated", bool(given.get("generator"))),
            ("pulses", True),
        )
        if holds
    )
    performance = str(results.attrs["kind"]) == "performance"
    scaled = str(results.attrs.get("design")) == "ida" or (performance and str(results.attrs["im"]) != "scale")
    scaled = scaled and (not by_histories(study) or bool(given.get("elastic")))
    unscaled = by_histories(study) and not given.get("elastic") and str(results.attrs["im"]) != "scale"
    distance = given.get("distance_m")
    more = {
        "origin": origin,
        "magnitude": given.get("magnitude"),
        "distance": None if distance is None else float(distance) / 1000.0,
        "levels": results.sizes["level"] if (scaled or unscaled) and "level" in results.sizes else 0,
        "scaled": scaled,
        "elastic": bool(given.get("elastic")),
        "own": unscaled and levels_have_own_motions(results),
        "sets": len(study.get("motion_sets") or []),
    }
    return Fact("motion.given", number, more=more)


def _law(results: xr.Dataset) -> Iterator[Fact]:
    """Yield the law of the answer."""
    law = results.coords.get("law")
    if str(results.attrs["kind"]) == "sensitivity":
        values, symbol = results["value"].values, {"e": "e", "delta": "δ"}[str(results.attrs["parameter"])]
        more = {"laws": results.sizes["model"], "values": values.size, "symbol": symbol}
        yield Fact("law.compared", lower=float(values.min()), upper=float(values.max()), more=more)
    elif law is not None and law.dims in (("model",), ("model", "sample")):
        at, _ = reference_law(results)
        for name in dict.fromkeys(map(str, np.ravel(law.values[at]))):
            yield Fact("law.of_answer", more={"law": name})
    if "sample" in results.sizes:
        yield Fact("uncertainty.samples", results.sizes["sample"])


def _surroundings(results: xr.Dataset, study: Mapping[str, Any]) -> Iterator[Fact]:
    """Yield the surroundings and supports of blocks: buildings, supports, walls, restraints, beds."""
    buildings = _tables([study.get("building"), *(study.get("buildings") or [])])
    for what, holds in (
        ("building.elastic", any(map(scales, buildings))),
        ("building.yields", any(map(storeys_yield, buildings))),
        ("building.isolated", any(table.get("isolation") is not None for table in buildings)),
        ("building.strength_uncertain", any(table.get("strength_dispersion") for table in buildings)),
        ("building.strength_default", any(table.get("system") is not None for table in buildings)),
    ):
        if holds:
            yield Fact(what)
    if "building_collapsed" in results and bool(results["building_collapsed"].any()):
        cases = results["building_collapsed"]
        yield Fact("building.collapses", int((cases > 0).sum()), more={"cases": cases.size})
    support = study.get("support")
    for table in _tables([support, *(study.get("supports") or [])]):
        kept = 100.0 * float(table.get("stop_restitution") or RESTITUTION)
        clearance, frequency = (table.get(key) for key in ("clearance_mm", "stop_frequency_hz"))
        more = {"kind": str(table["kind"]), "clearance": clearance, "frequency": frequency, "kept": kept}
        if table is support:
            yield Fact("support.on", more=more)
        elif (on := results["block"].values[results["support"].values == table["name"]]).size:
            yield Fact("support.on", names=(str(table["name"]), *map(str, on)), more=more)
    blocks = _blocks(results)
    if any(block.wall is not None for block in blocks):
        gaps = any(block.wall is not None and block.wall.gap > 0.0 for block in blocks)
        yield Fact("wall.model", more={"sided": _one_way(results), "gaps": gaps})
        moved = tuple(block_title(block.label) for block in blocks if pushed_by_drift(block))
        if moved:
            yield Fact("wall.pushes", DRIFT, names=moved)
    if any(block.restraint is not None for block in blocks):
        yield Fact("restraint.model")
    if any(block.bed is not None for block in blocks):
        yield Fact("support.bed")


def _sliding(results: xr.Dataset) -> Iterator[Fact]:
    """Yield the modelled parts of sliding, edges and round bases."""
    if FALLEN in results:
        yield Fact("sliding.upper_estimate")
    elif INSTEAD in results:
        yield Fact("sliding.model")
    if f"{FALL_OFF}_probability" in results:
        yield Fact("sliding.edge_model")
    if any(note.what == "sliding.checked_freestanding" for note in notes_of(results)):
        yield Fact("sliding.checked_freestanding")
    given = json.loads(str(results.attrs.get("screen", "{}"))).get("friction")
    if EDGE in results.coords:
        held = results["anchored"].values if "anchored" in results.coords else np.zeros(results.sizes["block"], bool)
        edges = zip(results["block"].values, results[EDGE].values, held, strict=True)
        falls = ((label, json.loads(str(edge)) or {}) for label, edge, fixed in edges if not fixed)
        foot = tuple(str(label) for label, edge in falls if edge.get("falls_when") == FOOT)
        if foot:
            yield Fact("sliding.clearance", names=foot)
    if INSTEAD in results and isinstance(given, dict):
        labels = map(str, results["block"].values[np.isfinite(results[INSTEAD].values)])
        exact = tuple(label for label in labels if given.get(label, given).get("distribution") == "fixed")
        if exact:
            yield Fact("friction.exact", names=exact)
    if "round" in results.coords:
        known = ~results["anchored"].values.astype(bool) if "anchored" in results.coords else True
        round_ = results["round"].values.astype(bool) & known
        if round_.any():
            yield Fact("block.round", names=tuple(map(str, results[results["round"].dims[0]].values[round_])))
    if "both_axes" in results.coords:
        alone = results["block"].values[~results["both_axes"].values.astype(bool) & ~results["anchored"].values]
        if alone.size:
            yield Fact("axis.width_alone", names=tuple(map(str, alone)))


def _on_the_roof(results: xr.Dataset, roof: str) -> Iterator[Fact]:
    """Yield the pieces on the roof, so that a floor that was meant as the uppermost storey is noticed."""
    if not roof or "place" not in results.dims or "floor" not in results.coords:
        return
    above = results["block"].values[results["floor"].values.astype(str) == roof]
    if above.size:
        yield Fact("floor.roof", int(roof), names=tuple(map(str, above)))
