"""The two compared results: reading, errors if they cannot be compared, and matching of their blocks and laws."""

import json
import shlex
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from ...core.doubts import first_of
from ...fragility.analyses.surface_results import POOLED
from ...fragility.runs.provenance import as_given, number_of_motions
from ...motions.intensity.naming import place_in
from ..kinds.study import Study
from ..report.results_file import opened_results, read_results
from ..store.content import check_content
from ..store.differences import changes, makes_motions, same_inputs
from ..store.folder import RESULT_NAME, reading, refuse_unfinished, result_file
from ..store.netcdf import opened
from ..text.curve_notes import state_in
from ..text.error import StudyError
from ..text.words import level_name

CURVES, PIECES = ("fragility", "uncertainty"), "performance"
"""Kinds of studies that are compared: by curves, and by pieces."""
STUDY_FILE = ".toml"


class Side(NamedTuple):
    """One of the two results: `name` A or B, its file, its content, and its study as plain values."""

    name: str
    path: Path
    results: xr.Dataset
    study: dict[str, Any]

    @property
    def kind(self) -> str:
        """The kind of the study."""
        return str(self.results.attrs["kind"])

    @property
    def title(self) -> str:
        """The title of the study."""
        return str(self.results.attrs.get("title", ""))

    def identity(self, part: int) -> str:
        """The hash of all tables (part 0), or of the samples of all motions (part 1)."""
        parts = str(self.results.attrs.get("identity", "")).split("-")
        return parts[part] if len(parts) == 2 else ""


class Matched(NamedTuple):
    """Labels of both sides that are compared, as pairs of positions, and the labels that only one side has."""

    pairs: list[tuple[int, int]]
    only_a: list[str]
    only_b: list[str]


def titles_of(a: Side, b: Side, laws: tuple[str, str] | None = None) -> tuple[str, str]:
    """Return the titles of both sides; equal titles are distinguished by the folders, or by the laws compared."""
    titles = a.title or "A study", b.title or "A study"
    if titles[0] != titles[1]:
        return titles
    folders = [side.path.resolve().parent for side in (a, b)]
    words: Sequence[str] = [folder.name for folder in folders]
    if words[0] == words[1]:
        words = [folder.as_posix() for folder in folders]
    if folders[0] == folders[1]:
        words = [side.path.name for side in (a, b)] if a.path.resolve() != b.path.resolve() else laws or ("A", "B")
    first_title, other = (f"{titles[0]} ({word})" for word in words)
    return first_title, other


def result_of(path: Path) -> Path:
    """Return the result file of a finished, unchanged study, given its folder, its result file or its study file."""
    if path.suffix == STUDY_FILE and path.is_file():
        folder = Path("results") / path.stem
        run = f"toppling run {shlex.quote(str(path))}"
        named = "or name the folder of its results"
        if folder.is_dir():
            refuse_unfinished(path, folder)
        target = folder / RESULT_NAME
        study = Study.from_toml(path)
        if not target.exists():
            raise StudyError(f"{path}: has no results in {folder}: {run} computes them, {named}")
        with reading(target), opened(target) as stored:
            theirs = str(stored.attrs.get("identity"))
        same = theirs == study.identity or (same_inputs(theirs, study.identity) and makes_motions(study.configuration))
        if not same:
            raise StudyError(
                f"{path}: is not the study of the results in {folder}, or was changed since: {run} --fresh computes "
                f"them again, {named}"
            )
        return target
    return result_file(path)


@contextmanager
def two_sides(first: Path, second: Path, same: bool = False, verify: bool = False) -> Iterator[tuple[Side, Side]]:
    """Open two results until the block ends: folders of finished studies, their results, or their study files."""
    paths = [result_of(path) for path in (first, second)]
    if not same and paths[0].resolve() == paths[1].resolve():
        raise StudyError(f"{first} and {second} are the same results: name another folder, or two laws with --laws")
    for path in paths:  # (both are refused before either is read whole)
        with opened_results(path):
            pass
    with read_results(paths[0]) as first_results, read_results(paths[1]) as other:
        sides = []
        for name, path, results in zip("AB", paths, (first_results, other), strict=True):
            if not (same and name == "B"):  # (the same file is checked once)
                check_content(path, results, verify)
            try:
                study = json.loads(str(results.attrs.get("study")))
            except (ValueError, RecursionError):
                study = None
            if not isinstance(study, dict):
                raise StudyError(f"{path}: does not hold its study (attribute study): run it again")
            sides.append(Side(name, path, results, study))
        a, b = sides
        alike = a.identity(0) and [a.identity(i) for i in (0, 1)] == [b.identity(i) for i in (0, 1)]
        if not same and alike and not any(changes(a.study, b.study)):
            raise StudyError(f"{first} and {second} hold the results of the same study: nothing differs")
        try:
            refuse_different(a, b)
            yield a, b
        except (KeyError, IndexError, ValueError, TypeError, AttributeError) as error:
            if isinstance(error, StudyError):
                raise
            reason = " ".join(str(error).split())[:200] or type(error).__name__
            raise StudyError(f"{first} and {second}: cannot be compared ({reason}): run both studies again") from error


def refuse_different(a: Side, b: Side) -> None:
    """Raise StudyError if the results of two studies have no number in common."""
    if a.kind != b.kind:
        raise StudyError(f"A is a {a.kind} study and B a {b.kind} study: only studies of one kind can be compared")
    if a.kind not in (*CURVES, PIECES):
        raise StudyError(
            f"A and B are {a.kind} studies, which compare laws themselves: fragility, uncertainty and performance "
            "studies can be compared"
        )
    states = [state_in(side.results) for side in (a, b)]
    if states[0] != states[1]:
        raise StudyError(f"A is of {states[0]} and B of {states[1]}: only results of one damage state can be compared")
    if a.kind == PIECES:
        _refuse_pieces(a, b)
    elif not same_measure(a, b) and not ("rate" in a.results and "rate" in b.results):
        levels = [level_name(side.results) for side in (a, b)]
        raise StudyError(
            f"the curves of A are in {levels[0]} and those of B in {levels[1]}: medians of two measures cannot be "
            "compared, and there are no annual rates of both (give both studies one im, or both a [hazard])"
        )


def _refuse_pieces(a: Side, b: Side) -> None:
    """Raise StudyError if the chances of pieces are not of the same thing."""
    yearly = ["rate" in side.results for side in (a, b)]
    if yearly[0] != yearly[1]:
        has, lacks = ("A", "B") if yearly[0] else ("B", "A")
        raise StudyError(
            f"{has} has a [hazard] and {lacks} has none: chances in a year and chances at a level cannot be compared"
        )
    if yearly[0]:
        return
    at = [float(side.results.attrs["at_level"]) for side in (a, b)]
    if not same_measure(a, b) or not np.isclose(at[0], at[1], rtol=1e-9, atol=0.0):
        levels = [
            f"{level_name(side.results)} = {level:g} {side.results['level'].attrs['units']}"
            for side, level in zip((a, b), at, strict=True)
        ]
        raise StudyError(
            f"chances of A are at {levels[0]} and those of B at {levels[1]}: give both one im and one "
            "performance.at_level"
        )


def measure_of(side: Side) -> str:
    """Return the name of the measure of the levels."""
    return _measure_key(side)[0]


def same_measure(a: Side, b: Side) -> bool:
    """Return True if the levels of both sides are of one measure, in one unit and at one place."""
    (*measure, place), (*other, there) = _measure_key(a), _measure_key(b)
    # (results of earlier versions may not say the place)
    return measure == other and (place == there or not place or not there)


def _measure_key(side: Side) -> tuple[str, str, str]:
    axis = side.results.coords.get("level", side.results.coords.get("intensity"))
    im, units, name = ("" if axis is None else str(axis.attrs.get(key, "")) for key in ("im", "units", "long_name"))
    return str(side.results.attrs.get("im") or im), units, place_in(name)


def same_motions(a: Side, b: Side) -> bool:
    """True if both sides had the same motions in one design, so that replicates can be paired."""
    if number_of_motions(a.results) != number_of_motions(b.results) or not a.identity(1):
        return False
    if a.identity(1) != b.identity(1) or a.results.attrs.get("design") != b.results.attrs.get("design"):
        return False
    if a.results.attrs.get("design") == POOLED:  # (whose results have no list of motions)
        return True
    first, second = (side.results["motion"].values[as_given(side.results)] for side in (a, b))
    if not np.array_equal(first, second):
        return False
    # (stripes draw motions level by level)
    return a.results.attrs.get("design") != "stripes" or np.array_equal(
        a.results["intensity"].values, b.results["intensity"].values
    )


def matched(of_a: Sequence[str], of_b: Sequence[str]) -> Matched:
    """Match labels of two sides; if none is common and each side has one, these two are compared."""
    where = {label: j for j, label in enumerate(of_b)}
    pairs = [(i, where[label]) for i, label in enumerate(of_a) if label in where]
    if not pairs and len(of_a) == len(of_b) == 1:
        return Matched([(0, 0)], [], [])
    common = {of_a[i] for i, _ in pairs}
    return Matched(
        pairs, [label for label in of_a if label not in common], [label for label in of_b if label not in common]
    )


def matched_laws(a: Side, b: Side, laws: tuple[str, str] | None) -> Matched:
    """Match the damping laws of two sides, or the two that are named; StudyError if there is none."""
    if laws is not None:
        return Matched([(law_at(a, laws[0]), law_at(b, laws[1]))], [], [])
    return matched_names(a, b, "model", "damping law", ": name one of each with --laws")


def matched_names(a: Side, b: Side, dim: str, noun: str, cure: str = "") -> Matched:
    """Match laws, blocks or pieces of two sides by their labels; StudyError if there is none in common."""
    labels = [_labels(side, dim) for side in (a, b)]
    pairs = matched(*labels)
    if not pairs.pairs:
        raise StudyError(f"A and B have no {noun} in common (A: {_listed(labels[0])}; B: {_listed(labels[1])}){cure}")
    return pairs


def floors_of(side: Side) -> list[str]:
    """Return the floors of a study's curves; one without a name if curves are not separated by floor."""
    if "floor" not in side.results["half_level"].dims:
        return [""]
    return [str(floor) for floor in side.results["floor"].values]


def law_at(side: Side, name: str) -> int:
    """Return the position of the law with a label or a short name; StudyError if that is not one law."""
    labels = _labels(side, "model")
    law = side.results.coords.get("law")
    # (laws of samples have no short name of their own; their labels begin with it)
    if law is not None and law.dims == ("model",):
        short = [str(value) for value in law.values]
    else:
        short = [label.partition(" ")[0] for label in labels]
    places = [i for i, label in enumerate(labels) if label == name] or [
        i for i, name_short in enumerate(short) if name_short == name
    ]
    if len(places) != 1:
        several = "several" if places else "no"
        raise StudyError(f"--laws {name}: {side.name} holds {several} such law among {_listed(labels)}")
    return places[0]


def _labels(side: Side, dim: str) -> list[str]:
    return [str(value) for value in side.results[dim].values]


def _listed(labels: Sequence[str]) -> str:
    return first_of([*map(repr, labels)])
