"""Names of measures, floors, inputs and axes for people: the same words in tables and in drawings."""

import json
import re
from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from ...core.units import ACCELERATION, DIMENSIONLESS, SPELLED, STANDARD_GRAVITY
from ...fragility.runs.provenance import floor_of_each_motion
from ...models import catalogue
from ...motions.intensity.naming import FLOOR, place_in

MEASURES = {
    "pga": "PGA",
    "pgv": "PGV",
    "pgd": "PGD",
    "arias": "Arias intensity",
    "cav": "CAV",
    "housner_intensity": "Housner intensity",
    "pga_normalised": "PGA/(g tan α)",
    "pgv_normalised": "p·PGV/(g tan α)",
    "d5_75": "D5–75",
    "d5_95": "D5–95",
    "scale": "scale factor",
}
STRENGTHS = ("yield_coefficient", "system")
"""Keys of a building's table in a study file by which its storeys yield."""
_PERIOD = re.compile(r"\b(S[avd]|FIV3)\((\d[\d.e+-]*)(?:, (\d[\d.e+-]*))?\)")
_PERIODS = re.compile(r"\bAvgSa\((\d[\d.e+-]*):(\d[\d.e+-]*):(\d+)(?:, (\d[\d.e+-]*))?\)")
"""Labels of spectral values at a period, and of averages over periods, with their damping if it is not 5 %."""
REFERENCE_LAW = "housner"
LAW_NAMES = {
    "discrete": "discrete damping",
    "giannini-masiani": "Giannini–Masiani",
    "makris-konstantinidis": "Makris–Konstantinidis",
    "vassiliou": "Vassiliou et al.",
    "energy-consistent": "energy-consistent damping",
    "housner": "Housner’s impacts",
    "viscous": "viscous damping",
}
"""Laws in words, by their short names."""
CONSEQUENCES = {"blocks-exit": "blocked exit", "release": "hazardous release"}
"""Consequences that are written in other words than in an inventory."""
INPUTS = {
    "alpha": "slenderness α",
    "alpha_factor": "slenderness α",
    "R": "size R",
    "R_factor": "size R",
    "inertia_factor": "inertia factor λ",
    "restraint_strength": "restraint strength",
    "restraint_stiffness": "restraint stiffness",
    "e": "restitution e",
    "restitution_factor": "restitution e",
    "delta": "elastic zone δ",
    "zeta": "damping ratio ζ",
    "law": "damping law",
    "model": "damping law",
    "sample": "properties",
    "cm_height": "mass centre",
}
"""Uncertain inputs and dimensions of runs in words."""


def display_unit(level: xr.DataArray) -> tuple[float, str]:
    """Return the divisor that converts an SI level to its display unit, and that unit: g for accelerations, SI else."""
    return display_of(level.attrs.get("units", "1"))


def display_of(units: str) -> tuple[float, str]:
    """Return the same of the SI unit of a level."""
    if units == ACCELERATION:
        return STANDARD_GRAVITY, "g"
    return 1.0, "" if units == DIMENSIONLESS else SPELLED.get(units, units)


def level_text(value: float, like: xr.DataArray) -> str:
    """A level with its display unit, to three digits."""
    return value_in(value, like.attrs.get("units", "1"))


def value_in(value: float, units: str) -> str:
    """A value in an SI unit with its display unit, to three digits."""
    scale, unit = display_of(units)
    return f"{value / scale:.3g}{f' {unit}' if unit else ''}"


NOT_REACHED = "not reached"
"""Text instead of a level above the highest level of the runs."""


def axis_of(results: xr.Dataset) -> xr.DataArray:
    """The measure on the axis of the curves: the levels, or for a cloud the intensity of each motion."""
    return results["level"] if "level" in results.coords else results["intensity"]


def axis_name(axis: xr.DataArray, default: str = "level") -> str:
    """The label of an axis: the name of its quantity with the display unit."""
    _, unit = display_unit(axis)
    return f"{axis.attrs.get('long_name', default)}{f' ({unit})' if unit else ''}"


def quantity_name(axis: xr.DataArray, default: str = "level") -> str:
    """The name of the quantity of an axis in a sentence, if a number follows it."""
    name, _, rest = str(axis.attrs.get("long_name", default)).partition(", ")
    return f"{name} ({rest})" if rest else name


def level_name(results: xr.Dataset) -> str:
    """Return the measure of the levels of some results, with the place where it is measured: PGV of the ground."""
    axis = next(results[name] for name in ("level", "intensity", "median") if name in results.variables)
    label = str(axis.attrs.get("im") or results.attrs.get("im") or "level")
    floors = {*floor_of_each_motion(results)} if "motion" in results.sizes else set()
    return measure_at(label, str(axis.attrs.get("long_name", "")), floor=floors.pop() if len(floors) == 1 else "")


def measure_at(label: str, long_name: str, power: float = 1.0, floor: str = "") -> str:
    """Return the written name of a measure with the place that its long name gives; `floor`: the only one, if known."""
    name = measure_name(label.removeprefix("ground_"), power)
    place = place_in(long_name)
    if place == FLOOR and floor:
        return f"{name} of {floor_name(floor)}"
    return f"{name} of the {place}" if place else name


def measure_name(label: str, power: float = 1.0) -> str:
    """The written name of a measure; for a measure that grows with the square of the amplitude, its square root.

    `power` is the exponent of the motion's amplitude in the measure.
    """
    if power == 2.0:
        return f"√({measure_name(label)})"
    known = MEASURES.get(label)
    if known is not None:
        return known
    named = _PERIOD.sub(lambda match: f"{match[1]}({float(match[2]):g} s{_damping(match[3])})", label)
    return _PERIODS.sub(
        lambda match: f"AvgSa({float(match[1]):g}–{float(match[2]):g} s, {match[3]} periods{_damping(match[4])})", named
    )


def _damping(share: str | None) -> str:
    return "" if share is None else f", {100.0 * float(share):g} % damping"


def input_name(name: str) -> str:
    """The written name of an uncertain input, or of a dimension of runs."""
    return INPUTS.get(name, name)


def block_title(name: str) -> str:
    """The name of a block for people: the title of an item of the catalogue instead of its key."""
    key, comma, rest = name.partition(",")
    return f"{catalogue.item(key).title.removesuffix(', unanchored')}{comma}{rest}" if key in catalogue else name


def law_names(labels: Sequence[str]) -> list[str]:
    """Return laws by the names of their authors, with parameters only if laws of one name differ in them."""
    split = [(key, rest.split()) for key, _, rest in (label.partition(" ") for label in labels)]
    names = []
    for label, (key, rest) in zip(labels, split, strict=True):
        alike = [other for name, other in split if name == key]
        parameters = (part for part in rest if not all(part in other for other in alike))
        short = LAW_NAMES.get(key, "").removesuffix(" damping").removesuffix("’s impacts")
        name = " ".join((short[:1].upper() + short[1:], *parameters)).replace("rest=rigid", "(rigid at rest)")
        names.append(name if short else label)
    return names


def with_law_names(results: xr.Dataset) -> xr.Dataset:
    """Return results whose laws have their names instead of labels, for a page."""
    names = dict(zip(map(str, results["model"].values), law_names([*map(str, results["model"].values)]), strict=True))
    of_laws = [name for name in ("model", "branch_model") if name in results.coords and results[name].ndim]
    words = {name: [names.get(str(label), str(label)) for label in results[name].values] for name in of_laws}
    return results.assign_coords({name: (results[name].dims, words[name], results[name].attrs) for name in of_laws})


def renamed(text: str, results: xr.Dataset) -> str:
    """Return a text with names of laws and titles of blocks instead of their labels, for a page."""
    laws, blocks = ([*map(str, results[name].values)] if name in results.dims else [] for name in ("model", "block"))
    names = dict(zip(laws, law_names(laws), strict=True))
    for block in blocks:
        if block_title(block) != block:
            names |= {block: f"“{block_title(block)}”", f"“{block}”": f"“{block_title(block)}”"}
    for label in sorted(names, key=len, reverse=True):
        text = text.replace(label, names[label])
    return text


def consequence_name(word: str) -> str:
    """The name of a consequence in a table or a list: words of the default consequences, others as they are."""
    return CONSEQUENCES.get(word, word)


def floor_name(floor: int | str) -> str:
    """The written name of a floor; one of several buildings is called after its building."""
    text = str(floor)
    return "ground" if text in ("0", "ground") else text if " " in text else f"floor {text}"


def by_place(results: xr.Dataset, dims: Iterable[Hashable]) -> Iterator[tuple[str, dict[str, int]]]:
    """Yield the name and the position of each block, and each of its floors if the `dims` of some variable do."""
    for i, block in enumerate(results["block"].values):
        if "floor" not in dims:
            yield block_title(str(block)), {"block": i}
            continue
        for k, floor in enumerate(results["floor"].values):
            yield f"{block_title(str(block))}, {floor_name(floor)}", {"block": i, "floor": k}


def roof_of(results: xr.Dataset) -> str:
    """Return the floor that is the roof of the study's building, '' if that is not known."""
    building = json.loads(str(results.attrs.get("study", "{}"))).get("building")
    storeys = building.get("storeys") if isinstance(building, dict) else None
    return "" if storeys is None else str(int(storeys))


def is_one_piece(results: xr.Dataset) -> bool:
    """Return True if all blocks have the same size: one piece in several places, or held in several ways."""
    return all(name in results.coords and bool(np.ptp(results[name].values) == 0.0) for name in ("alpha", "R"))


def floor_cell(floor: int | str, roof: str = "") -> str:
    """The floor in a column of floors, with a word if it is the roof."""
    text = floor_name(floor).removeprefix("floor ")
    return f"{text} (roof)" if roof and str(floor) == roof else text


def reference_law(results: xr.Dataset) -> tuple[int, bool]:
    """Return the position of the law of the answer, and True if it is Housner's, the reference of the field."""
    law = results.coords.get("law")
    if law is not None and law.dims == ("model",):
        return reference_position([str(value) for value in law.values])
    if law is not None and law.dims == ("model", "sample"):  # (of a study with samples, whose law may be uncertain)
        return reference_position(["/".join(dict.fromkeys(map(str, value))) for value in law.values])
    return 0, False


def reference_position(laws: Sequence[str]) -> tuple[int, bool]:
    """Return the result of `reference_law` for short names of laws."""
    return (laws.index(REFERENCE_LAW), True) if REFERENCE_LAW in laws else (0, False)


def scales(building: Mapping[str, Any]) -> bool:
    """Return True if floors of a building scale with the ground motions, by its table as plain values."""
    return not storeys_yield(building) and building.get("isolation") is None


def storeys_yield(building: Mapping[str, Any]) -> bool:
    """Return True if the storeys of a building yield, by its table in a study file as plain values."""
    return any(building.get(key) is not None for key in STRENGTHS)
