"""What the answer of a report rests on, in sentences for the client: no names of keys, no parameters of laws."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import xarray as xr

from ...wording import confidence_text, counted, short_digits
from ..text.words import reference_law
from .method import study_of

LAW_WORDS = {
    "housner": "the rigid block of Housner (1963), which loses angular velocity at every impact",
    "energy-consistent": "a damping law that dissipates at every passage through the upright position what an impact "
    "would",
    "discrete": "the damping law of Liu, Huang and Qu (2024), which acts near the upright position",
    "giannini-masiani": "the viscous damping law of Giannini and Masiani (1990)",
    "makris-konstantinidis": "the viscous damping law of Makris and Konstantinidis (2003)",
    "vassiliou": "the viscous damping law of Vassiliou, Mackie and Stojadinović (2014)",
    "viscous": "a viscous damping law",
}
"""Laws in words, by their short names."""


def basis(results: xr.Dataset) -> list[str]:
    """Return what the answer of a study rests on, one sentence each."""
    return list(_sentences(results, study_of(results)))


def _sentences(results: xr.Dataset, study: Mapping[str, Any]) -> Iterator[str]:
    one = "piece" if str(results.attrs["kind"]) == "performance" else "block"
    yield _shaking(results, study)
    building = study.get("building")
    if isinstance(building, dict):
        storeys = building.get("storeys")
        what = "The building" if storeys is None else f"The building, of {counted(int(storeys), 'storey')},"
        period = building.get("period_s")
        first = "" if period is None else f" with a first natural period of {short_digits(float(period))} s"
        yield f"{what} is taken as elastic{first}; each {one} is shaken by the motion of its own floor."
    elif "buildings" in study:
        yield "The buildings are taken as elastic; each block is shaken by the motion of its own floor."
    yield (
        f"Each {one} is taken as a rigid body that stands freely on a level floor and is shaken horizontally, in the "
        "direction of its width. Sliding, walls, neighbours and vertical shaking are not included."
    )
    if "sample" in results.sizes:
        yield (
            f"What is not known exactly of a {one} is drawn {results.sizes['sample']:,} times from the range in which "
            "it may lie."
        )
    law = results.coords.get("law")
    if law is not None and law.dims == ("model",):
        at, _ = reference_law(results)
        words = LAW_WORDS.get(str(law.values[at]), "the first damping law of the study")
        others = results.sizes["model"] - 1
        rest = f"; results of {counted(others, 'other law')} are in the technical appendix" if others else ""
        yield f"Rocking dies down as in {words}{rest}."
    if "rate" in results or "annual_number" in results:
        yield "How often the ground shakes is taken from the hazard curve of the site, as it was given."
    sure = confidence_text(results)
    beta = float(results.attrs.get("modelling_dispersion", 0.0))
    if "epistemic_rate" not in results:
        held = (
            f"modelling uncertainty (β_m = {beta:g}) is in the rates themselves"
            if beta
            else "they do not include modelling uncertainty"
        )
        yield f"Ranges in brackets are {sure} intervals from the choice of motions; {held}."
    if "anchored" in results and bool(np.any(results["anchored"].values)):
        yield "Pieces that are anchored already are counted as not overturning."
    if str(results.attrs["kind"]) == "performance":
        code = results.attrs.get("code")
        site = f"{code} with {results.attrs.get('code_site', '')}".removesuffix(" with ")
        yield "Code requirements were not checked." if code is None else f"Code requirements are those of {site}."


def _shaking(results: xr.Dataset, study: Mapping[str, Any]) -> str:
    motions = study.get("motions")
    given: Mapping[str, Any] = motions if isinstance(motions, dict) else {}
    made, number = str(given.get("generator", "")), results.sizes.get("motion", 0)
    if "floors_file" in given:
        what = f"{counted(number, 'motion')} of the floors, calculated elsewhere"
    elif "records" in given:
        what = counted(number, "recorded ground motion")
    elif "magnitude" in given:
        distance = given.get("distance_m")
        far = "" if distance is None else f" at a distance of {short_digits(float(distance) / 1000.0)} km"
        what = f"{counted(number, 'simulated ground motion')} of an earthquake of magnitude {given['magnitude']:g}{far}"
    else:
        what = counted(number, "simulated ground motion" if made else "idealised pulse")
    scaled = str(results.attrs.get("design")) == "ida" or (
        str(results.attrs["kind"]) == "performance" and str(results.attrs["im"]) != "scale"
    )
    levels = f", scaled to {counted(results.sizes['level'], 'level')} of shaking" if scaled else ""
    return f"The shaking is that of {what}{levels}."
