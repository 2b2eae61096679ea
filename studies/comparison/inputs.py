"""What differs between the inputs of two studies, in words: blocks, laws, motions, hazard curves, options."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from ...core.wording import counted, listed_name, short_digits
from ...fragility.analyses.surface_results import POOLED
from ...fragility.runs.provenance import number_of_motions
from ...motions.arrays import POLARITY
from ..store.differences import APART, changes, corrects, makes_motions
from .sides import PIECES, Matched, Side, same_motions

MOST_SAID = 6
"""Most differences that are said of one table of the study file, and most names in a list."""
ROUNDING = 1e-9
"""Relative difference of two numbers that were written in different units."""
UNCOMPARED = (*APART, "blocks", "blocks_file", "models")
"""Keys that do not change results, or that are compared by the labels and numbers in the results."""
DRAWN = (
    *(f"{of}_{part}" for of in ("cost", "downtime") for part in ("median", "dispersion", "distribution")),
    *("persons_exposed", "injury_probability"),
)
OF_BLOCKS = ("width", "height", "cm_height", "inertia_factor", "e")
OF_PIECES = (
    *("anchored", "count", "floor", "room", "direction", *OF_BLOCKS),
    *("value", "anchoring_cost", "consequences", *DRAWN),
)
"""Numbers that are compared of each block, and of each piece of an inventory."""


def differences_in_words(a: Side, b: Side, of_names: Matched, of_laws: Matched) -> list[str]:
    """Return a line for each table of the study file that differs, for the blocks or pieces, and for the motions."""
    dim = "item" if a.kind == PIECES else "block"
    said = [*_matched(a, b, of_laws, "model", "law"), *_matched(a, b, of_names, dim, "piece" if dim == "item" else dim)]
    said += list(_numbers(a, b, of_names, of_laws, dim))
    said += list(_tables(a, b))
    grids = [side.results["level"].values for side in (a, b) if "level" in side.results.coords]
    if len(grids) == 2 and not (
        grids[0].shape == grids[1].shape and np.allclose(grids[0], grids[1], rtol=ROUNDING, atol=0.0)
    ):
        between = "so that a part of each difference may come from the interpolation between them"
        said.append(f"levels: not the same, {between}")
    said += list(_surroundings(a, b))
    if not said and a.path.resolve() != b.path.resolve():
        said.append("the files that the studies read (records or inventory) have changed between them")
    return [*(said or ["nothing but the laws"]), motions_in_words(a, b)]


def motions_in_words(a: Side, b: Side) -> str:
    """Return whether both sides were shaken by the same motions, and what that means for the intervals."""
    n, m = number_of_motions(a.results), number_of_motions(b.results)
    twice = [name for name, side in (("A", a), ("B", b)) if POLARITY in side.results.coords]
    ways = f", run both ways in {' and '.join(twice)}" if twice else ""
    surface = any(side.results.attrs.get("design") == POOLED for side in (a, b))  # (whose ratios have no intervals)
    if same_motions(a, b):
        paired = "" if surface else ", so the intervals of B/A are paired: what one motion does to both cancels"
        return f"motions: the same {counted(n, 'motion')} in both{ways}{paired}"
    number = f"{n:,} in A and {m:,} in B" if n != m else f"{counted(n, 'motion')} each"
    number += ways
    same_tables = a.study.get("motions") == b.study.get("motions")
    read_again = same_tables and (corrects(a.study) or not makes_motions(a.study))
    why = "; the records or their corrections have changed" if read_again and a.identity(1) != b.identity(1) else ""
    # (the identity of a study with branches is of the motions of all branches)
    known = not any("motion_sets" in side.study for side in (a, b))
    paired = "" if surface else ", so the intervals of B/A are not paired: they hold the choice of both sets"
    return f"motions: {'not the same' if known else 'not known to be the same'} in A and B ({number}{why}){paired}"


def _matched(a: Side, b: Side, found: Matched, dim: str, noun: str) -> Iterator[str]:
    """Say which labels are compared with others, and which only one side has."""
    for i, j in found.pairs:
        names = [str(side.results[dim].values[at]) for side, at in ((a, i), (b, j))]
        if names[0] != names[1]:
            yield f"{noun}: {names[0]} in A, {names[1]} in B"
    for name, alone in (("A", found.only_a), ("B", found.only_b)):
        if alone:
            yield f"{noun}s only in {name}, not compared: {_listed(alone)}"


def _numbers(a: Side, b: Side, found: Matched, laws: Matched, dim: str) -> Iterator[str]:
    """Say which sizes and other numbers of blocks or pieces differ, under the first laws that are compared."""
    for name in OF_PIECES if dim == "item" else OF_BLOCKS:
        both = [side.results[name] for side in (a, b) if name in side.results.coords]
        both = [one.isel(model=k) if "model" in one.dims else one for one, k in zip(both, laws.pairs[0], strict=False)]
        if len(both) < 2 or any(one.dims != (dim,) for one in both):
            continue
        one, other = (values.values[[pair[k] for pair in found.pairs]] for k, values in enumerate(both))
        labels = [str(a.results[dim].values[i]) for i, _ in found.pairs]
        if name == "anchored":
            here, there = one.astype(bool), other.astype(bool)
            for side, more in (("A", here & ~there), ("B", there & ~here)):
                if more.any():
                    yield f"anchored only in {side}: {_listed([labels[i] for i in np.flatnonzero(more)])}"
            continue
        # (money has the unit of its inventory)
        units = [str(side.results[name].attrs.get("units", "1")) for side in (a, b)]
        other_units = units[0] != units[1]
        # (equal numbers of two currencies are apart, unless they are not known: NaN)
        apart = [i for i in range(len(labels)) if not _equal(one[i], other[i]) or (other_units and one[i] == one[i])]
        if apart:
            before, after = ("" if unit == "1" else f" {unit}" for unit in units)
            shown = [(labels[i], *_values(one[i], other[i])) for i in apart[:MOST_SAID]]
            each = [f"{label} {old}{before} in A, {new}{after} in B" for label, old, new in shown]
            yield f"{name.replace('_', ' ')}: {'; '.join(each)}{_more(len(apart))}"


def _tables(a: Side, b: Side) -> Iterator[str]:
    """Say what differs in the study files, table by table; tables that only one study has are named."""
    tables: dict[str, list[str]] = {}
    for name in dict.fromkeys([*a.study, *b.study]):
        if name in UNCOMPARED:
            continue
        before, now = a.study.get(name), b.study.get(name)
        if before != now and (before is None or now is None) and isinstance(before or now, dict | list):
            tables[name] = [f"only in {'B' if before is None else 'A'}"]
            continue
        for key, old, new in changes(before, now, name):
            tables.setdefault(name, []).append(f"{re.sub(rf'^{name}[.]', '', key)} {old} in A, {new} in B")
    file = a.study.get("hazard", {}).get("file")
    if file is not None and "hazard" not in tables:
        curves = [str(side.results.attrs.get("hazard_sha256", "")) for side in (a, b)]
        if not all(curves):
            tables["hazard"] = [f"in {file} in both; it is not known whether the curve in it is the same"]
        elif curves[0] != curves[1]:
            tables["hazard"] = [f"the curve in {file} has changed between A and B"]
    for name, said in tables.items():
        yield f"{name}: {'; '.join(said[:MOST_SAID])}{_more(len(said))}"


def _surroundings(a: Side, b: Side) -> Iterator[str]:
    """Say where the versions or the processors differ."""
    for key, text in (("toppling_version", "made by toppling"), ("processor", "computed on")):
        one, other = (str(side.results.attrs.get(key, "")) for side in (a, b))
        if one != other:
            yield f"{text} {one} in A, {other} in B"


def _equal(one: object, other: object) -> bool:
    if isinstance(one, float | np.floating) and isinstance(other, float | np.floating):
        return bool(np.isclose(one, other, rtol=ROUNDING, atol=0.0, equal_nan=True))
    return str(one) == str(other)


def _values(one: object, other: object) -> tuple[str, str]:
    """Return two values in words, with all digits where fewer are equal."""
    short = _value(one), _value(other)
    return short if short[0] != short[1] else (f"{one:.12g}", f"{other:.12g}")


def _value(value: object) -> str:
    if isinstance(value, float | np.floating):
        return "not given" if np.isnan(value) else short_digits(float(value))
    return str(value) or "none"


def _listed(labels: list[str]) -> str:
    return ", ".join(map(listed_name, labels[:MOST_SAID])) + _more(len(labels))


def _more(number: int) -> str:
    return f" and {number - MOST_SAID:,} more" if number > MOST_SAID else ""
