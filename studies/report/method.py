"""The method part of a report: laws with their sources, blocks, the study file's settings, assumptions and versions."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from ...core.wording import counted, given_number, given_percent, short_digits
from ...fragility.runs.provenance import SCENE, about_both_axes, blocks_of
from ...models import Block
from ...motions.arrays import POLARITY
from ...motions.supports.stops import RESTITUTION
from ..plan.slides import INSTEAD
from ..text.block_order import chosen_of
from ..text.names import clean
from ..text.rows import Rows
from ..text.words import scales, storeys_yield

MOST_LINES = 6
"""Most records whose corrections are written out."""
LONGEST_VALUE = 300
"""Largest length of a study file's value in a table; the report prints the whole file below."""
SECTIONS = (
    *("motions", "building", "buildings", "support", "supports", "ida", "until", "events", "stripes", "cloud"),
    *("performance", "screen", "fit", "measures", "hazard", "uncertainty", "sensitivity", "outputs"),
)
TITLES = {
    "ida": "incremental dynamic analysis",
    "until": "precision",
    "performance": "inventory",
    "screen": "validity screen",
}
"""Tables of a study file, and those that have a title of their own."""
DESIGNS = {
    "ida": "Incremental dynamic analysis: every motion is scaled to every level, and every block is run under it.",
    "adaptive": "Incremental dynamic analysis at adaptive levels: every motion is scaled to a few levels of its own, "
    "which follow from the runs before, and motions are run until the answer is as precise as the study asks. Looks at "
    "the result ask for more than that, and fresh motions confirm it, so that stopping does not favour lucky errors. "
    "Shares of runs leave out the first motions, whose levels lie far apart to find the curves.",
    "pooled": "One surface a law: every motion is scaled to a level of its own for each of a few blocks, which are "
    "placed where they tell most, and medians and dispersions of all blocks are smooth functions of their slenderness, "
    "size and inertia. Motions are run until the medians of all blocks are as precise as the study asks, and the "
    "surface is checked against blocks of which it holds no run.",
    "stripes": "Stripes: each level of shaking has a set of motions of its own.",
    "cloud": "Cloud: every motion is run once, as it is given.",
}
SELECTED = (
    "The motions of each level were selected so that together they have the distribution of spectra and measures that "
    "the hazard gives them there; the table of selections says how well they agree."
)
KIND_TEXTS = {
    "uncertainty": "Sizes, restitution and law are drawn together by Latin hypercube sampling; every draw is run under "
    "every motion at every level.",
    "performance": "Every piece of the inventory is run under the motion of its floor; the number and the value "
    "of the pieces that fall are counted motion by motion, because one earthquake shakes all of them.",
    "sensitivity": "One parameter is varied; every value is a law of its own, run under the same motions, so that "
    "differences are paired.",
}
ENGINE = (
    "Rocking is solved from event to event (edges of zones, impacts, turning points), in closed form where the law is "
    "linear between events and by Taylor series with error control in exact geometry. A block has overturned when it "
    "does not return to the upright position."
)
ASSUMPTIONS = (
    "Blocks are rigid, rock in one plane about the lower corners on a rigid floor, and do not {move}.",
    "Shaking is horizontal, in the plane of the width{sideways}{vertical}.",
    "Blocks do not touch each other, nor walls that the study does not name, and do not act on the building.",
    "Restitution is the block’s own, e_R = 1 − (2/λ) sin²α (Housner 1963), where the study gives no other.",
)
BUILDING_ASSUMPTION = (
    "The building responds elastically: floor motions follow from its modes, and neither the soil below it nor its "
    "contents change them."
)
YIELDING_ASSUMPTION = (
    "Storeys of the building yield: each ground motion goes through it at its level, and its floor motions are not "
    "scaled. Strengths follow a lateral load of the codes where only that of the lowest storey is given; neither the "
    "soil below nor its contents change floor motions."
)
ISOLATION_ASSUMPTION = (
    "The building stands on isolators: each ground motion goes through it at its level, and its floor motions are not "
    "scaled; floor 0 is the slab on them. Uplift and torsion of the isolators and the wall of the moat are left out."
)
UNCERTAIN_STRENGTH = (
    "Each ground motion meets a building of its own strength, the same at every level, so that curves and rates hold "
    "that uncertainty; all storeys have one factor."
)
DEFAULT_STRENGTH = (
    "The strength of the building is a default (judgement): what a code's design of its system asks for, times the "
    "overstrength factor of the system; factors are recalled from ASCE/SEI 7-22, table 12.2-1."
)
SUPPORTS = {
    "bench": "bench",
    "linear": "linear isolator",
    "bilinear": "bilinear isolator",
    "pendulum": "friction pendulum",
}
SUPPORT_ASSUMPTION = (
    "Between the floor and the {what} there is a {kind}, whose motion shakes them; their reaction on it is left out, "
    "and {stops}."
)
STOPS_LEFT_OUT = "stops are not modelled"
STOPS_ASSUMPTION = (
    "its stops are springs and dampers {clearance} mm away, on which it swings with {frequency} Hz and keeps {kept} of "
    "its velocity: whether a strike makes a block uplift rests on that stiffness"
)

SLIDING_ASSUMPTION = (
    "A block whose coefficient of friction is below b/h slides as a rigid body with Coulomb friction and does not "
    "rock; with more friction it rocks and does not slide."
)
HISTORIES_ASSUMPTION = (
    "Floor motions are taken for absolute accelerations of a building model of another program; what that model "
    "assumes holds here, too."
)
ELASTIC_ASSUMPTION = (
    "Floor motions are scaled linearly to all levels of shaking: the building is taken as elastic at all of them."
)

LAWS = {
    "discrete": (
        "Damping in a narrow zone |θ| ≤ δα about the upright position: c = I_O (1 − e)/(2δα) times the speed of entry.",
        "Liu, Huang and Qu (2024), Eqs. 15–17",
    ),
    "giannini-masiani": ("Viscous damping throughout, ζ = (2/π)(1 − e)/(1 + e).", "Giannini and Masiani (1990)"),
    "makris-konstantinidis": (
        "Viscous damping throughout, ζ = −0.68 ln e, of the initial stiffness.",
        "Makris and Konstantinidis (2003), Eq. 11",
    ),
    "vassiliou": (
        "Viscous damping throughout, c = c_V (α/0.1)² m g^½ R^(3/2).",
        "Vassiliou, Mackie and Stojadinović (2014)",
    ),
    "viscous": ("Viscous damping throughout, of the ratio ζ given.", "as given; FEMA 356 takes ζ = 0.4 (1 − e)"),
    "energy-consistent": (
        "Damping in a narrow zone |θ| ≤ δα that dissipates exactly the energy that an impact with e dissipates.",
        "derived in toppling",
    ),
    "housner": (
        "Rigid block at rest until its threshold is exceeded; angular velocity times e at each impact. The reference.",
        "Housner (1963); exact geometry: Zhang and Makris (2001), Eq. 12",
    ),
}
"""Each law in words, and its source."""


def law_rows(results: xr.Dataset) -> Rows | None:
    """Return the table of a study's laws; None where the laws differ from sample to sample."""
    law = results.coords.get("law")
    if law is None or "model" not in law.dims:
        return None
    plain = law.isel({dim: 0 for dim in law.dims if dim != "model"})
    labels = [str(one) for one in results["model"].values]
    rows = []
    for label, name in zip(labels, [str(one) for one in plain.values], strict=True):
        rows.append((label, *LAWS.get(name, ("", ""))))
    return Rows("Damping laws of the blocks", ("law", "what it does", "source"), rows)


def block_rows(results: xr.Dataset) -> Rows | None:
    """Return the table of the blocks' sizes; None where the sizes are not known."""
    dim = "item" if "item" in results.dims else "block"
    columns = [
        (heading, results[name])
        for name, heading in (
            ("width", "width, m"),
            ("height", "height, m"),
            ("cm_height", "mass centre, m"),
            ("alpha", "α, rad"),
            ("R", "R, m"),
            ("p", "p, rad/s"),
            ("floor", "floor"),
            ("direction", "direction of its width"),
            ("count", "pieces"),
        )
        if name in results.coords and results[name].dims == (dim,)
    ]
    if not columns or dim not in results.dims:
        return None
    headings = [heading for heading, _ in columns]
    rows = [
        (str(label), *(_cell(column.values[i]) for _, column in columns))
        for i, label in enumerate(np.atleast_1d(results[dim].values))
    ]
    if SCENE in results.coords:
        headings.append("stands")
        blocks = blocks_of(results if dim == "block" else results.rename(item="block"))
        rows = [(*row, _stands(block)) for row, block in zip(rows, blocks, strict=True)]
    chosen = chosen_of(results)
    title = "Items of the inventory" if dim == "item" else f"Blocks{': ' if chosen else ''}{chosen}"
    return Rows(title, (dim, *headings), rows)


def _stands(block: Block) -> str:
    """Return what stands around a block or holds it, with the numbers of the study file."""
    words = block.scene_words
    held = block.restraint
    if held is not None and block.mass is not None:
        words += [] if held.rigid else [f"stiffness {given_number(1e-3 * held.stiffness)} N/mm"]
        words.append(f"{given_number(block.mass)} kg")
    return ", ".join(words) or "free"


def _cell(value: object) -> str:
    return short_digits(float(value)) if isinstance(value, float | np.floating) and np.isfinite(value) else str(value)


def study_file_rows(results: xr.Dataset) -> Rows:
    """Return the table of the study file's keys, except those of blocks and laws."""
    study = study_of(results)
    rows: list[tuple[str, ...]] = []
    for name in SECTIONS:
        title, section = TITLES.get(name, name), study.get(name)
        if isinstance(section, dict):
            for key, value in section.items():
                inner = value if isinstance(value, dict) else {}
                if inner and all(isinstance(one, dict) for one in inner.values()):
                    rows += [(f"{title}: {key}, {name}", _value(one)) for name, one in inner.items()]
                else:
                    rows.append((f"{title}: {key}", _value(value)))
        elif section is not None:
            rows.append((title, _value(section)))
    return Rows(
        "Keys of the study file, other than of blocks and laws (units are part of their names; keys that are not "
        "listed have their defaults)",
        ("key", "value"),
        rows,
    )


def study_of(results: xr.Dataset) -> dict[str, object]:
    """Return the study file as plain values; empty where the results do not hold it."""
    try:
        found = json.loads(str(results.attrs.get("study", "{}")))
    except ValueError:
        return {}
    return found if isinstance(found, dict) else {}


def lifted(study: Mapping[str, object]) -> bool:
    """Return True if the motions of a study shake vertically, too."""
    motions, stripes = study.get("motions"), study.get("stripes")
    own = stripes.get("at", []) if isinstance(stripes, dict) else []
    tables = [one for one in (motions, *(at.get("motions") for at in own)) if isinstance(one, dict)]
    return any(one.get("component") for one in tables) and any(one.get("vertical") for one in tables)


def by_histories(study: Mapping[str, Any]) -> bool:
    """Return whether the floors move by histories with levels of their own, or by others that are scaled."""
    motions = study.get("motions")
    return isinstance(motions, dict) and ("floors_index" in motions or bool(motions.get("elastic")))


def _value(value: object) -> str:
    if isinstance(value, dict) and not any(isinstance(one, dict | list) for one in value.values()):
        text = ", ".join(f"{key} {one:g}" if isinstance(one, float) else f"{key} {one}" for key, one in value.items())
    else:
        text = value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
    return text if len(text) <= LONGEST_VALUE else f"{text[:LONGEST_VALUE]}…"


def method(results: xr.Dataset) -> list[str]:
    """Return the paragraphs on how the study was made."""
    kind = str(results.attrs["kind"])
    words = [DESIGNS.get(str(results.attrs.get("design", "")), ""), KIND_TEXTS.get(kind, ""), ENGINE]
    stripes = study_of(results).get("stripes")
    if isinstance(stripes, dict) and stripes.get("select") is not None:
        words.append(SELECTED)
    if "processing" in results.attrs:
        done = str(results.attrs["processing"]).splitlines()
        more = f"; and {len(done) - MOST_LINES:,} more" if len(done) > MOST_LINES else ""
        words.append(f"Records, as they were read and corrected: {'; '.join(done[:MOST_LINES])}{more}.")
    if "scenario" in results.attrs:
        words.append(f"Simulated earthquakes: {'; '.join(str(results.attrs['scenario']).splitlines())}.")
    if "storeys" in results.attrs:
        words.append(f"The building: {'; '.join(str(results.attrs['storeys']).splitlines())}.")
    if "fit_method" in results.attrs:
        words.append(f"Curves: {results.attrs['fit_method']}.")
    if "rate" in results or "annual_number" in results:
        words.append("Annual rates: the curves, or what falls at each level, integrated over the hazard curve given.")
    sizes = [
        counted(results.sizes[dim], name)
        for dim, name in (
            ("block", "block"),
            ("item", "kind of piece"),
            ("model", "law"),
            ("sample", "sample"),
            ("level", "level"),
            ("motion", "motion"),
            ("run", "run"),
        )
        if dim in results.dims
    ]
    if POLARITY in results.coords:
        at = sizes.index(counted(results.sizes["motion"], "motion"))
        sizes[at] = f"{counted(results.sizes['motion'] // 2, 'motion')} both ways"
        words.append(
            "Every motion is run both ways, as it is and reversed, because it may reach a block from either side; the "
            "two runs are trials of one motion, and intervals take them together."
        )
    words.append(f"Size: {', '.join(sizes).replace('kind of pieces', 'kinds of piece')}.")
    return [clean(one) for one in words if one]


def _listed(value: Any) -> list[Any]:
    return value if isinstance(value, list) else []


def _stops(support: Mapping[str, Any]) -> str:
    """Return what is assumed of the stops of a support of a study file."""
    if support.get("stop_frequency_hz") is None:
        return STOPS_LEFT_OUT
    return STOPS_ASSUMPTION.format(
        clearance=f"{support['clearance_mm']:g}",
        frequency=f"{support['stop_frequency_hz']:g}",
        kept=given_percent(support.get("stop_restitution") or RESTITUTION),
    )


def assumptions(results: xr.Dataset) -> list[str]:
    """Return the assumptions of a study, one sentence each."""
    study = study_of(results)
    stand = [one for one in [study.get("building"), *_listed(study.get("buildings"))] if isinstance(one, dict)]
    yields = [one for one in stand if storeys_yield(one)]
    building = [BUILDING_ASSUMPTION] if any(map(scales, stand)) else []
    building += [ISOLATION_ASSUMPTION] if any(one.get("isolation") is not None for one in stand) else []
    building += [YIELDING_ASSUMPTION] if yields else []
    building += [UNCERTAIN_STRENGTH] if any(one.get("strength_dispersion") for one in stand) else []
    building += [DEFAULT_STRENGTH] if any(one.get("system") is not None for one in stand) else []
    support = study.get("support")
    if isinstance(support, dict):
        kind = SUPPORTS.get(str(support.get("kind")), "support")
        building.append(SUPPORT_ASSUMPTION.format(what="blocks", kind=kind, stops=_stops(support)))
    for one in _listed(study.get("supports")):
        what, kind = f"pieces on “{one['name']}”", SUPPORTS[str(one["kind"])]
        building.append(SUPPORT_ASSUMPTION.format(what=what, kind=kind, stops=_stops(one)))
    motions = study.get("motions")
    building += [HISTORIES_ASSUMPTION] if by_histories(study) else []
    building += [ELASTIC_ASSUMPTION] if isinstance(motions, dict) and motions.get("elastic") else []
    vertical = ", and vertical, scaled as the horizontal component"
    vertical = vertical if lifted(study) else "; there is no vertical shaking"
    sideways = (
        ", and in that of the depth under the other component: two planar motions under one scale factor, of which "
        "either can overturn a block"
        if about_both_axes(results)
        else ""
    )
    slides = INSTEAD in results
    if slides:
        building.append(SLIDING_ASSUMPTION)
    move = "bounce, twist, or slide while they rock" if slides else "slide, bounce or twist"
    return [*(one.format(vertical=vertical, sideways=sideways, move=move) for one in ASSUMPTIONS), *building]


def provenance_rows(results: xr.Dataset, path: Path, state: str) -> Rows:
    """Return the table of the program and its versions, the study's identity, and the result file with its checksum."""
    versions = json.loads(str(results.attrs.get("package_versions", "{}")))
    packages = ", ".join(f"{name} {version}" for name, version in versions.items())
    rows = [
        ("toppling", str(results.attrs.get("toppling_version", ""))),
        ("packages", packages),
        ("processor", str(results.attrs.get("processor", results.attrs.get("machines", ""))).strip('[]"')),
        ("layout of the results (schema)", str(results.attrs.get("schema", ""))),
        ("identity of the study", str(results.attrs.get("identity", ""))),
        ("result file", path.name),
        ("its contents", state),
        ("its SHA-256", _digest(path)),
    ]
    return Rows("Provenance", ("", ""), rows)


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
