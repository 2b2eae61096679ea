"""What a report says of how a study was made: laws with their source, blocks, what the study file asks, versions."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from .assessment_rows import figure_text
from .drawable import clean
from .falling import chosen_of
from .rows import Rows

LONGEST_VALUE = 300
"""Letters of a value of the study file in a table: the whole file stands below."""
SECTIONS = {
    "motions": "motions",
    "building": "building",
    "buildings": "buildings",
    "ida": "incremental dynamic analysis",
    "stripes": "stripes",
    "cloud": "cloud",
    "performance": "inventory",
    "screen": "validity screen",
    "fit": "fit",
    "measures": "measures",
    "hazard": "hazard",
    "uncertainty": "uncertainty",
    "sensitivity": "sensitivity",
    "outputs": "outputs",
}
DESIGNS = {
    "ida": "Incremental dynamic analysis: every motion is scaled to every level, and every block is run under it.",
    "stripes": "Stripes: at every level the blocks are run under motions of that level’s own.",
    "cloud": "Cloud: every motion is run once, as it is.",
}
KINDS_SAID = {
    "uncertainty": "Sizes, restitution and law are drawn together by Latin hypercube sampling; every draw is run under "
    "every motion at every level.",
    "performance": "Every piece of the inventory is run under the motion of its floor; pieces are counted, and their "
    "value, motion by motion, because one earthquake shakes all of them.",
    "sensitivity": "One parameter is varied; every value is a law of its own, run under the same motions, so that "
    "differences are paired.",
}
ENGINE = (
    "Rocking is solved from event to event (edges of zones, impacts, turning points), in closed form where the law is "
    "linear between events and by Taylor series with error control in exact geometry. A block has overturned when it "
    "does not come back."
)
ASSUMPTIONS = (
    "Blocks are rigid, rock in one plane about the lower corners on a rigid floor, and do not slide, bounce, twist.",
    "Shaking is horizontal, in the plane of the width; there is no vertical shaking.",
    "Blocks do not touch walls or each other, and do not act on the building.",
    "Restitution is the block’s own, e_R = 1 − (2/λ) sin²α (Housner 1963), where the study gives no other.",
)
MEDIAN = (
    "Median: the level of shaking that half of the motions need. Dispersion β: the standard deviation of the logarithm "
    "of that level from motion to motion; with β = 0.4 two of three need between the median divided by 1.5 and 1.5 "
    "times the median."
)
OF_BUILDING = "The building is elastic, and its floors move as the ground does at its base."


class Law(NamedTuple):
    """A law in words, and who it is from."""

    words: str
    source: str


LAWS = {
    "discrete": Law(
        "Damping in a narrow zone |θ| ≤ δα about the upright position: c = I_O (1 − e)/(2δα) times the speed of entry.",
        "Liu, Huang and Qu (2024), Eqs. 15–17",
    ),
    "giannini-masiani": Law("Viscous damping throughout, ζ = (2/π)(1 − e)/(1 + e).", "Giannini and Masiani (1990)"),
    "makris-konstantinidis": Law(
        "Viscous damping throughout, ζ = −0.68 ln e, of the initial stiffness.",
        "Makris and Konstantinidis (2003), Eq. 11",
    ),
    "vassiliou": Law(
        "Viscous damping throughout, c = c_V (α/0.1)² m g^½ R^(3/2).", "Vassiliou, Mackie and Stojadinović (2014)"
    ),
    "viscous": Law("Viscous damping throughout, of the ratio ζ given.", "as given; FEMA 356 takes ζ = 0.4 (1 − e)"),
    "energy-consistent": Law(
        "Damping in a narrow zone |θ| ≤ δα that takes out exactly what an impact with e takes out.",
        "derived in toppling",
    ),
    "housner": Law(
        "Rigid block at rest until its threshold is exceeded; angular velocity times e at each impact. The reference.",
        "Housner (1963); exact geometry: Zhang and Makris (2001), Eq. 12",
    ),
}


def law_rows(results: xr.Dataset) -> Rows | None:
    """The laws of a study; None where they differ from sample to sample."""
    law = results.coords.get("law")
    if law is None or "model" not in law.dims:
        return None
    plain = law.isel({dim: 0 for dim in law.dims if dim != "model"})
    labels = [str(one) for one in results["model"].values]
    rows = []
    for label, name in zip(labels, [str(one) for one in plain.values], strict=True):
        said = LAWS.get(name, Law("", ""))
        rows.append((label, said.words, said.source))
    return Rows("Laws by which blocks lose energy", ("law", "what it does", "source"), rows)


def block_rows(results: xr.Dataset) -> Rows | None:
    """Sizes of the blocks; None where they are not known."""
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
            ("count", "pieces"),
        )
        if name in results.coords and results[name].dims == (dim,)
    ]
    if not columns or dim not in results.dims:
        return None
    rows = [
        (str(label), *(_cell(column.values[i]) for _, column in columns))
        for i, label in enumerate(np.atleast_1d(results[dim].values))
    ]
    chosen = chosen_of(results)
    title = "Items of the inventory" if dim == "item" else f"Blocks{': ' if chosen else ''}{chosen}"
    return Rows(title, (dim, *(heading for heading, _ in columns)), rows)


def _cell(value: object) -> str:
    return figure_text(float(value)) if isinstance(value, float | np.floating) and np.isfinite(value) else str(value)


def asked_rows(results: xr.Dataset) -> Rows:
    """What the study file asks: every key but those of blocks and laws."""
    study = study_of(results)
    rows: list[tuple[str, ...]] = []
    for name, title in SECTIONS.items():
        section = study.get(name)
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
        "What the study file asks (units stand in the keys; what is not here is the default)", ("key", "value"), rows
    )


def study_of(results: xr.Dataset) -> dict[str, object]:
    """The study file as plain values; empty where the results do not hold it."""
    try:
        found = json.loads(str(results.attrs.get("study", "{}")))
    except ValueError:
        return {}
    return found if isinstance(found, dict) else {}


def _value(value: object) -> str:
    if isinstance(value, dict) and not any(isinstance(one, dict | list) for one in value.values()):
        text = ", ".join(f"{key} {one:g}" if isinstance(one, float) else f"{key} {one}" for key, one in value.items())
    else:
        text = value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
    return text if len(text) <= LONGEST_VALUE else f"{text[:LONGEST_VALUE]}…"


def method(results: xr.Dataset) -> list[str]:
    """How the study was made: a paragraph each."""
    kind = str(results.attrs["kind"])
    words = [DESIGNS.get(str(results.attrs.get("design", "")), ""), KINDS_SAID.get(kind, ""), ENGINE]
    if "fit_method" in results.attrs:
        words.append(f"Curves: {results.attrs['fit_method']}.")
    if "median" in results:
        words.append(MEDIAN)
    if "rate" in results or "annual_number" in results:
        words.append("Annual rates: the curves, or what falls at each level, integrated over the hazard curve given.")
    sizes = [
        f"{results.sizes[dim]:,} {name}{'s' if results.sizes[dim] != 1 else ''}"
        for dim, name in (
            ("block", "block"),
            ("item", "kind of piece"),
            ("model", "law"),
            ("sample", "sample"),
            ("level", "level"),
            ("motion", "motion"),
        )
        if dim in results.dims
    ]
    words.append(f"Size: {', '.join(sizes).replace('kind of pieces', 'kinds of piece')}.")
    return [clean(one) for one in words if one]


def assumptions(results: xr.Dataset) -> list[str]:
    """What is taken for granted."""
    study = study_of(results)
    building = [OF_BUILDING] if "building" in study or "buildings" in study else []
    return [*ASSUMPTIONS, *building]


def provenance_rows(results: xr.Dataset, path: Path) -> Rows:
    """Which program made the results from what, and which file this is."""
    try:
        versions = json.loads(str(results.attrs.get("package_versions", "{}")))
    except ValueError:
        versions = {}
    packages = (
        ", ".join(f"{name} {version}" for name, version in versions.items()) if isinstance(versions, dict) else ""
    )
    rows = [
        ("toppling", str(results.attrs.get("toppling_version", ""))),
        ("packages", packages),
        ("layout of the results (schema)", str(results.attrs.get("schema", ""))),
        ("identity of the study", str(results.attrs.get("identity", ""))),
        ("result file", path.name),
        ("its SHA-256", _digest(path)),
    ]
    return Rows("Provenance", ("", ""), rows)


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
