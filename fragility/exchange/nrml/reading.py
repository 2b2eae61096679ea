"""Reading of OpenQuake's fragility models (NRML 0.5) into datasets of curves, as OpenQuake itself interprets them."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Collection, Sequence

import numpy as np
import xarray as xr

from ....core.aliases import Array
from ....motions import Sa
from ...curves.curve import ISOTONIC
from ...fitting.links import LOGNORMAL
from ..datasets import MAX_NUMBERS, curve_dataset
from ..files import ExchangeError, number, read_bytes
from ..ids import Component, common_limit_state, component_of, labelled_curves
from ..rows import LARGEST, MAX_CURVES, SMALLEST, CurveParameters, CurveRow, CurveSet, levels_problem, select_measure
from .document import Element, parse
from .writing import COMMENT_MARK, IMTS, SA, Imt, median_and_dispersion


def read_nrml(path: str | os.PathLike[str], ids: Collection[str] | None = None, im: str | None = None) -> xr.Dataset:
    """Read curves from a fragility model of OpenQuake.

    Parameters
    ----------
    path : path
        The XML, NRML 0.5.
    ids : collection of str, optional
        The functions to read; every one where not given.
    im : str, optional
        The measure to read (``pga``, ``pgv``, ``Sa(1.0)``, …) where the model has several.

    Returns
    -------
    xarray.Dataset
        Of continuous functions median (SI) and dispersion, with lowest_level, highest_level and no_damage_level; of
        discrete ones probability on ``level``, every function at the levels of all functions, as OpenQuake interpolates
        and extends it.  Dimensions are those that `write_nrml` wrote, else ``block``, labelled by ids, with
        ``limit_state`` where there are several.

    Raises
    ------
    ExchangeError
        One sentence that names the file and the error: no XML, a document type or entities, no fragility
        model of NRML 0.5, functions that OpenQuake refuses or that are no fragility curves, both formats at once.
    ValueError
        An unknown `im`.

    Examples
    --------
    >>> import tempfile
    >>> from toppling.fragility import write_nrml
    >>> from toppling.fragility.curves import published
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     written = write_nrml(published.fema_p58(), f"{folder}/fragility.xml")
    ...     curves = read_nrml(written.paths[0])
    >>> round(float(curves["median"].sel(block="bookcase-5-shelf")), 12)
    0.29
    """
    file, content = read_bytes(path)
    model = parse(file, content)
    states = model.only("limitStates").text.replace(",", " ").split()
    if not states or len(set(states)) < len(states):
        raise ExchangeError(f"{file}: limitStates must be one name or more, each once, got {' '.join(states)!r:.60}")
    functions = {child.attribute("id"): child for child in model.children if child.tag == "fragilityFunction"}
    given = sum(child.tag == "fragilityFunction" for child in model.children)
    if given > len(functions):
        raise ExchangeError(f"{file}: {given - len(functions)} of {given} functions have the id of another")
    if given * len(states) > MAX_CURVES:
        raise ExchangeError(f"{file}: holds {given:,} functions, allowed are {MAX_CURVES // len(states):,}")
    absent = sorted(set(ids or ()) - set(functions))
    if absent:
        raise ExchangeError(f"{file}: holds no function {absent[0]!r:.80}")
    by_measure: dict[tuple[str, bool], dict[str, Element]] = {}
    for name, function in functions.items():
        if ids is None or name in ids:
            by_measure.setdefault((_measure(function), False), {})[name] = function
    (label, _), chosen = select_measure(file, by_measure, im)
    imt = IMTS.get(label, SA)
    formats = {function.attribute("format").lower() for function in chosen.values()}
    if formats not in ({"continuous"}, {"discrete"}):
        held = " and ".join(sorted(formats))
        raise ExchangeError(
            f"{file}: functions of {label} must be all continuous or all discrete, got {held!r:.60}: choose by ids"
        )
    levels = None
    if formats == {"discrete"}:
        levels, curves = _discrete(list(chosen.values()), states, imt)
    else:
        curves = [_continuous(function, states, imt) for function in chosen.values()]
    rows = [(name, at, curve) for name, own in zip(chosen, curves, strict=True) for at, curve in enumerate(own)]
    components = {name: one for name, function in chosen.items() if (one := _component(function)) is not None}
    dims, named = labelled_curves(file, rows, components, states, imt.units)
    title = _comment_content(model).get("title")
    made = CurveSet(
        label,
        imt.units,
        False,
        dims,
        tuple(name for name, _, _ in rows),
        named,
        LOGNORMAL if levels is None else ISOTONIC,
        levels,
        title if isinstance(title, str) else f"Fragility curves of {file.name}",
        state=common_limit_state(rows, components, states[0]),
    )
    return curve_dataset(made, file.name)


def _measure(function: Element) -> str:
    """Return the label of a function's measure."""
    imt = function.only("imls").attribute("imt").strip()
    for label, one in IMTS.items():
        if imt == one.name:
            return label
    period = re.fullmatch(r"SA\(([0-9]{1,4}(?:\.[0-9]{0,17})?)\)", imt)
    try:
        return Sa(float(period[1] if period else imt)).label
    except ValueError:
        raise function.error(f"is of {imt!r:.40}, which no measure here is") from None


def _continuous(function: Element, states: Sequence[str], imt: Imt) -> list[CurveRow]:
    shape = function.attributes.get("shape", "logncdf")
    if shape != "logncdf":
        raise function.error(f"has the shape {shape!r:.30}, allowed is logncdf")
    imls = function.only("imls")
    low, high = (_number(imls, imls.attribute(key), key) for key in ("minIML", "maxIML"))
    if not 0.0 <= low < high:
        raise imls.error(f"must have 0 <= minIML < maxIML, got {low:g} and {high:g}")
    named = {"lowest_level": low, "highest_level": high, "no_damage_level": _no_damage(imls)}
    numbers = {key: value * imt.factor for key, value in named.items() if value > 0.0}
    curves = []
    for state, params in zip(states, _of_states(function, "params", states), strict=True):
        mean, stddev = (_number(params, params.attribute(key), key) for key in ("mean", "stddev"))
        if not (SMALLEST <= mean <= LARGEST and SMALLEST <= stddev <= LARGEST):
            raise params.error(f"must have mean and stddev > 0 for {state:.40}, got {mean:g} and {stddev:g}")
        median, dispersion = median_and_dispersion(mean, stddev)
        curves.append(CurveRow((), CurveParameters(median * imt.factor, dispersion), numbers=numbers))
    return curves


def _discrete(functions: Sequence[Element], states: Sequence[str], imt: Imt) -> tuple[Array, list[list[CurveRow]]]:
    """Return the levels of all functions (SI), and the curves of each function at all of these levels."""
    tables = []
    for function in functions:
        imls = function.only("imls")
        own = _numbers(imls) * imt.factor
        problem = levels_problem(own)
        if problem:
            raise imls.error(f"is wrong: {problem}")
        rows = [_numbers(poes) for poes in _of_states(function, "poes", states)]
        if any(row.size != own.size for row in rows):
            raise function.error(f"must have a probability for each of its {own.size} levels")
        tables.append((own, rows, _no_damage(imls) * imt.factor))
    levels = np.unique(np.concatenate([own for own, _, _ in tables]))
    if levels.size * len(functions) * len(states) > MAX_NUMBERS:
        raise functions[0].error(f"and {len(functions) - 1:,} others have {levels.size:,} levels: choose some by ids")
    return levels, [
        [CurveRow((), probability=_between(levels, own, row, limit)) for row in rows] for own, rows, limit in tables
    ]


def _between(levels: Array, own: Array, probabilities: Array, limit: float) -> Array:
    """Return a discrete function at any levels: linear between its own, from 0 below them, constant above.

    OpenQuake starts at the level of no damage where that lies below the function's own levels, at (nearly) 0 where it
    is not given, and takes everything below it as 0.
    """
    start = min(limit, float(own[0]))
    x, p = (own, probabilities) if start == own[0] else (np.append(start, own), np.append(0.0, probabilities))
    return np.where(levels < limit, 0.0, np.interp(levels, x, p))


def _no_damage(imls: Element) -> float:
    stated = imls.attributes.get("noDamageLimit", "").strip()
    limit = 0.0 if stated in ("", "None") else _number(imls, stated, "noDamageLimit")
    if limit < 0.0:
        raise imls.error(f"must have a noDamageLimit >= 0, got {limit:g}")
    return limit


def _of_states(function: Element, tag: str, states: Sequence[str]) -> list[Element]:
    found = [child for child in function.children if child.tag == tag]
    if [child.attribute("ls") for child in found] != list(states):
        raise function.error(f"must have {tag} of {', '.join(states):.200}, in this order")
    return found


def _numbers(element: Element) -> Array:
    words = element.text.replace(",", " ").strip().strip("[]").split()
    return np.array([_number(element, word, f"a number of {element.tag}") for word in words])


def _number(element: Element, text: str, what: str) -> float:
    return number(element.file, f"line {element.line}: {what}", text)


def _component(function: Element) -> Component | None:
    return component_of(_comment_content(function))


def _comment_content(element: Element) -> dict[str, object]:
    """Return the content of our comment before an element; empty where there is none, or another comment."""
    text = element.comment.strip()
    try:
        found = json.loads(text.removeprefix(COMMENT_MARK)) if text.startswith(f"{COMMENT_MARK} ") else None
    except (ValueError, RecursionError):
        found = None
    return found if isinstance(found, dict) else {}
