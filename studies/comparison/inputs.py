"""Differences between the inputs of two studies: blocks, laws, motions, hazard curves, options."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ...core.doubts import first_names
from ...core.facts import Fact
from ...core.wording import short_digits
from ...fragility.runs.provenance import EDGE, SCENE, blocks_of, number_of_motions
from ...motions.arrays import POLARITY
from ..store.differences import APART, changes, corrects, makes_motions
from .sides import PIECES, Matched, Side, same_motions

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
OF_MOTIONS = ("motions", "stripes", "building", "buildings", "support", "supports")
"""Tables of a study that decide on the motions of its blocks."""


def inputs_that_differ(a: Side, b: Side, matched: Mapping[str, Matched]) -> Iterator[Fact]:
    """Yield each input that differs, with its values in A and in B: labels, keys of study files, sizes, versions."""
    for dim, pairing in matched.items():
        what = "item" if dim == "block" and a.kind == PIECES else dim  # (a line of an inventory)
        for i, j in pairing.pairs:
            labels = [str(side.results[dim].values[at]) for side, at in ((a, i), (b, j)) if dim in side.results.coords]
            if len({*labels}) == 2:
                yield Fact("comparison.input", names=(what, *labels))
        if pairing.only_a or pairing.only_b:
            yield _alone(what, pairing.only_a, pairing.only_b)
    yield from _keys(a, b)
    for key in ("toppling_version", "processor"):
        values = [str(side.results.attrs.get(key, "")) for side in (a, b)]
        if values[0] != values[1]:
            yield Fact("comparison.input", names=(key, *values))
    yield from _numbers(a, b, OF_PIECES if a.kind == PIECES else OF_BLOCKS, matched)
    yield from _surroundings(a, b, matched["block"])


def notes_on_inputs(a: Side, b: Side, differ: bool, resampled: bool) -> Iterator[Fact]:
    """Yield the effects of levels, files and motions on the ratios; `resampled`: some ratio has an interval."""
    n, m = number_of_motions(a.results), number_of_motions(b.results)
    twice = [side.name for side in (a, b) if POLARITY in side.results.coords]
    more = {"motions": (n, m), "both_ways": twice, "resampled": resampled}
    if same_motions(a, b):
        yield Fact("comparison.same_motions", more=more)
    else:
        same_tables = all(a.study.get(key) == b.study.get(key) for key in OF_MOTIONS)
        read_again = same_tables and (corrects(a.study) or not makes_motions(a.study))
        more["changed"] = read_again and a.identity(1) != b.identity(1)
        # (the identity of a study with branches is of the motions of all branches)
        more["known"] = not any("motion_sets" in side.study for side in (a, b))
        yield Fact("comparison.other_motions", more=more)
    grids = [side.results["level"].values for side in (a, b) if "level" in side.results.coords]
    if len(grids) == 2 and not (
        grids[0].shape == grids[1].shape and np.allclose(grids[0], grids[1], rtol=ROUNDING, atol=0.0)
    ):
        yield Fact("comparison.other_levels")
    same_blocks = a.study.get("blocks") == b.study.get("blocks") and a.study.get("models") == b.study.get("models")
    if not differ and same_blocks and a.path.resolve() != b.path.resolve():
        yield Fact("comparison.files_changed")


def _alone(what: str, of_a: list[str], of_b: list[str]) -> Fact:
    return Fact("comparison.input_of_one", names=(what, first_names(of_a), first_names(of_b)))


def _numbers(a: Side, b: Side, names: Sequence[str], matched: Mapping[str, Matched]) -> Iterator[Fact]:
    """Yield the sizes and other numbers of blocks or pieces that differ, under the first laws that are compared."""
    pairs = matched["block"].pairs
    for name in names:
        if not all(name in side.results.coords for side in (a, b)):
            continue
        both = [
            side.results[name].isel(model=k, missing_dims="ignore")
            for side, k in zip((a, b), matched["model"].pairs[0], strict=True)
        ]
        if any(values.dims != ("block",) for values in both):
            continue
        # (money has the unit of its inventory)
        units = ["" if values.attrs.get("units", "1") == "1" else f" {values.attrs['units']}" for values in both]
        before, after = (values.values[[pair[k] for pair in pairs]] for k, values in enumerate(both))
        labels = [str(a.results["block"].values[i]) for i, _ in pairs]
        if name == "anchored":
            alone = [[labels[i] for i in np.flatnonzero(more)] for more in (before > after, after > before)]
            if any(alone):
                yield _alone(name, *alone)
            continue
        for label, old, new in zip(labels, before, after, strict=True):
            # (equal numbers of two currencies are apart, unless they are not known: NaN)
            if not _equal(old, new) or (units[0] != units[1] and _value(old)):
                values = (f"{text}{unit}" if text else "" for text, unit in zip(_values(old, new), units, strict=True))
                yield Fact("comparison.input", names=(name, *values), more={"of": label})


def _surroundings(a: Side, b: Side, matched: Matched) -> Iterator[Fact]:
    """Yield walls, kits, edges, leans, limits of tilt and depths that differ between blocks or pieces of one name."""
    if not any(name in side.results.coords for side in (a, b) for name in (SCENE, EDGE, "depth")):
        return
    before, after = (blocks_of(side.results) for side in (a, b))
    for i, j in matched.pairs:
        old, new = (
            ", ".join([*block.scene_words, *([] if block.depth is None else [f"{block.depth:g} m deep"])])
            for block in (before[i], after[j])
        )
        if old != new:
            yield Fact("comparison.input", names=("surroundings", old, new), more={"of": before[i].label})


def _keys(a: Side, b: Side) -> Iterator[Fact]:
    """Yield the keys of the study files that differ, and the tables that only one study has."""
    alone: tuple[list[str], list[str]] = [], []
    for name in dict.fromkeys([*a.study, *b.study]):
        if name in UNCOMPARED:
            continue
        before, now = a.study.get(name), b.study.get(name)
        if (before is None or now is None) and isinstance(before or now, dict | list):
            alone[before is None].append(f"[{name}]")
            continue
        for change in changes(before, now, name):
            yield Fact("comparison.input", names=change)
    if any(alone):
        yield _alone("table", *alone)
    files = [side.study.get("hazard", {}).get("file") for side in (a, b)]
    curves = [str(side.results.attrs.get("hazard_sha256", "")) for side in (a, b)]
    if files[0] is not None and files[0] == files[1] and (curves[0] != curves[1] or not all(curves)):
        yield Fact("comparison.input", names=("content", *(curve[:8] for curve in curves)), more={"of": files[0]})


def _equal(value: object, other: object) -> bool:
    if isinstance(value, float | np.floating) and isinstance(other, float | np.floating):
        return bool(np.isclose(value, other, rtol=ROUNDING, atol=0.0, equal_nan=True))
    return str(value) == str(other)


def _values(value: object, other: object) -> tuple[str, str]:
    """Return two values as texts, with all digits if fewer are equal."""
    short = _value(value), _value(other)
    return short if short[0] != short[1] else (f"{value:.12g}", f"{other:.12g}")


def _value(value: object) -> str:
    if isinstance(value, float | np.floating):
        return "" if np.isnan(value) else short_digits(float(value))
    return str(value)
