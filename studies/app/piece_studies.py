"""Answers of the live page: a quick answer under the reference law, and full answers, by the steps of studies alone.

The page has studies of one state: the piece with its hazard, in one unscaled earthquake, and with each of its
restraints. The first two have a study with less restitution. Motions and results are kept from one change to the next.
"""

from __future__ import annotations

import copy
import json
import math
import threading
from collections import OrderedDict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, NamedTuple, TypeVar

import numpy as np
import xarray as xr
from pydantic import ValidationError

from ...core.aliases import Array
from ...core.doubts import noted
from ...core.parameters import declared
from ...core.units import ENDS
from ...fragility import curve_probability, probability_in
from ...fragility.analyses.analysis import Design as Scaled
from ...fragility.curves.curve import LEAST
from ...fragility.risk.modelling import LOWER, UPPER
from ...fragility.runs.scaling import BLOCK_MEASURES
from ...models import Block
from ...models.laws import LAWS
from ...motions.intensity.evaluation import measure_variables
from ...motions.intensity.measure import RESULT_MEASURES
from ..comparison.compare import Comparison, side_by_side
from ..comparison.sides import Side
from ..facts.say import remedy, say, value_of
from ..facts.sections import REGISTERS, sections
from ..file.blocks import RESTRAINTS
from ..file.models import model_table
from ..file.refusals import refusals
from ..file.schema import MotionSet, StudyFile
from ..file.table import all_errors
from ..kinds.fragility import OBSERVED, FragilityStudy
from ..kinds.study import study_of as study_in
from ..plan.designs import Design, Incremental
from ..plan.risk import RISK_NAMES, without_replicates
from ..plan.slides import GATED, GATED_RATE, INSTEAD, gated, in_plane
from ..text.error import StudyError
from ..text.words import display_unit, quantity_name, reference_law, reference_position, with_law_names
from .state import EARTHQUAKE, FREE, LESS_RESTITUTION, PIECE, REMEDIES, VARIANT, piece_of

POINTS = 60
"""Points of a drawn curve."""
MATCHED = "the piece"
"""Name of the block of both variants."""
LEAST_FACTOR = 0.7
"""Lowest restitution over e_R: of the example of uncertain inputs; on rubber tests have two thirds (experiments.md)."""
MOST_KEPT = 24
"""Most motions, and most results, that are kept."""
Kept = TypeVar("Kept")


class SupersededError(Exception):
    """A later change makes this computation useless."""


class LiveDesign(Incremental):
    """Every motion at every level, scaled and measured once."""

    @cached_property
    def _scaled(self) -> Scaled:
        made = super().scaled([])
        return made._replace(measures=measure_variables(made.motions, RESULT_MEASURES))

    def scaled(self, blocks: Sequence[Block]) -> Scaled:
        return super().scaled(blocks) if self.im in BLOCK_MEASURES else self._scaled


class LiveStudyFile(StudyFile):
    """A study whose motions and design are kept from one change to the next; first the picture, then comparisons."""

    compare: ClassVar[bool] = False
    ground_kept: ClassVar[OrderedDict[str, Any]] = OrderedDict()
    shaking_kept: ClassVar[OrderedDict[str, Any]] = OrderedDict()
    design_kept: ClassVar[OrderedDict[str, Any]] = OrderedDict()

    def shaking(self, folder: Path, both: bool = False) -> list[MotionSet]:
        key = self._key(folder, both, "" if self.ida is None else str(self.ida.im_at))
        made: list[MotionSet] = kept(self.shaking_kept, key, lambda: StudyFile.shaking(self, folder, both))
        return made

    def design(self, folder: Path, both: bool = False) -> Design:
        def make() -> Design:
            design = StudyFile.design(self, folder, both)
            return LiveDesign(**vars(design)) if isinstance(design, Incremental) else design

        key = self._key(folder, both, "" if self.ida is None else self.ida.model_dump_json())
        made: Design = kept(self.design_kept, key, make)
        return made

    def _key(self, *more: Any) -> str:
        """Return all that decides the motions, and more, as a text."""
        tables = ("motions", "building", "support", "stripes")
        given = {name: table.model_dump_json() for name in tables if (table := self.given(name)) is not None}
        return json.dumps([given, *map(str, more)])

    def _ground(self, motions: Any, folder: Path, own_level: bool = True) -> Any:
        key = json.dumps([str(folder), motions.model_dump_json(), own_level])
        return kept(self.ground_kept, key, lambda: StudyFile._ground(self, motions, folder, own_level))


def kept(store: OrderedDict[str, Any], key: str, make: Callable[[], Kept]) -> Kept:
    """Return the value of a key, made if it is not there; the oldest of too many values is forgotten."""
    if key in store:
        store.move_to_end(key)
    else:
        store[key] = make()
        while len(store) > MOST_KEPT:
            store.popitem(last=False)
    value: Kept = store[key]
    return value


class RefusalError(StudyError):
    """Errors in the keys of a study: all of them as one sentence, and the first key's path."""

    def __init__(self, message: str, path: str = "") -> None:
        super().__init__(message)
        self.path = path


def study_of(content: Mapping[str, Any], path: Path) -> FragilityStudy:
    """Return the study of a content as if it stood in a file; RefusalError names the key of what is wrong."""

    def checked() -> StudyFile:
        try:
            return LiveStudyFile.model_validate(content)
        except ValidationError as error:
            refused = refusals(error, content, StudyFile)
            where = ".".join(map(str, refused[0][1]))
            raise RefusalError(all_errors([sentence for sentence, _ in refused]), where) from None

    try:
        made = study_in(checked, path)
    except RefusalError:
        raise
    except StudyError as error:
        raise RefusalError(str(error).removeprefix(f"{path}: ")) from None
    if not isinstance(made, FragilityStudy):
        raise RefusalError(f"the page shows fragility studies, got a {made.kind} study")
    return made


def contents_of(content: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return the contents of the page's studies by name: only studies that the keys of the state allow."""
    block = piece_of(content)
    held = _restraint_of(content)
    piece = copy.deepcopy(dict(content))
    piece["models"] = applicable(content, [held] if held else [], block) or piece["models"]
    piece["restraints"] = {name: table for name, table in piece.get("restraints", {}).items() if table == held}
    piece = {key: table for key, table in piece.items() if table != {}}
    held_fast = {key: table for key, table in copy.deepcopy(piece).items() if key != "friction"}
    earthquake = {key: table for key, table in copy.deepcopy(piece).items() if key not in ("hazard", "fit")}
    earthquake["title"] = f"{piece['title']}: one earthquake"
    earthquake["ida"] = {key: value for key, value in piece["ida"].items() if key in ("im_at", "polarity")}
    earthquake["ida"] |= {"im": "scale", "levels": {"values": [1.0], "unit": "1"}}
    contents = {PIECE: piece, EARTHQUAKE: earthquake}
    contents |= {name: less for of, name in LESS_RESTITUTION.items() if (less := _with_less_restitution(contents[of]))}
    tables = content.get("restraints", {})
    models = applicable(content, [*tables.values()], block)[:1]
    if tables and models and "hazard" in content and "mass_kg" in content["blocks"][0]:
        free = {key: value for key, value in content["blocks"][0].items() if key != "restraint"}
        blocks = [{**free, "name": FREE}, *({**free, "name": name, "restraint": name} for name in tables)]
        contents[REMEDIES] = {
            **held_fast,
            "title": f"{piece['title']}: restraints",
            "restraints": copy.deepcopy(tables),
            "blocks": blocks,
            "models": models,
        }
    return contents


def _with_less_restitution(content: Mapping[str, Any]) -> dict[str, Any]:
    """Return a study under its reference law with less restitution; empty if the law has none, or a given one."""
    law = content["models"][reference_position([str(model.get("law")) for model in content["models"]])[0]]
    has_one = law.get("law") in LAWS and "restitution_factor" in declared(LAWS[law["law"]])
    if not has_one or {"e", "restitution_factor"} & {*law}:
        return {}
    less = {key: copy.deepcopy(table) for key, table in content.items() if key != "friction"}
    models = [{**law, "restitution_factor": LEAST_FACTOR}]
    return {**less, "title": f"{content['title']}: less restitution", "models": models}


def _restraint_of(content: Mapping[str, Any]) -> Any:
    given = content["blocks"][0].get("restraint")
    return content.get("restraints", {}).get(given) if isinstance(given, str) else given


def applicable(content: Mapping[str, Any], restraints: list[Any], block: Block) -> list[dict[str, Any]]:
    """Return the laws of a study that apply to its piece with each restraint; of none, a law in another geometry."""
    given: list[dict[str, Any]] = [dict(model) for model in content["models"]]
    fitting = [model for model in given if _applies(model, block, restraints)]
    if fitting:
        return fitting
    others = [
        {**model, "geometry": word}
        for model in given
        if model.get("law") in LAWS and (about := declared(LAWS[model["law"]]).get("geometry")) and about.parameter
        for word in about.parameter.words
    ]
    return [model for model in others if _applies(model, block, restraints)][:1]


def _applies(model: Mapping[str, Any], block: Block, restraints: list[Any]) -> bool:
    """Return True if a law applies to a block without and with each of some tables of restraints.

    A table that makes no restraint of the block is left out; reading the study gives its error.
    """
    try:
        law = model_table(dict(model)).build([block])
        law.oscillator(block)
        for held in filter(None, (_held(block, table) for table in restraints)):
            law.oscillator(held)
    except ValueError:
        return False
    return True


def _held(block: Block, table: Any) -> Block | None:
    try:
        return replace(block, restraint=RESTRAINTS[table["kind"]].model_validate(table).build())
    except (ValueError, KeyError, TypeError):
        return None


class Curve(NamedTuple):
    """A fragility curve in the unit shown: points of the line, and share, interval and level of the runs."""

    levels: list[float]
    shares: list[float]
    at: list[float]
    seen: list[float]
    lower: list[float]
    upper: list[float]
    unit: str
    measure: str


class Numbers(NamedTuple):
    """Chances of the piece under the names of results, and the curve of the reference law."""

    chances: xr.Dataset
    curve: Curve


def reference_of(study: FragilityStudy) -> FragilityStudy:
    """Return a study with its reference law alone."""
    words = [str(model.get("law")) for model in study.configuration["models"]]
    return replace(study, models=(study.models[reference_position(words)[0]],))


def numbers_of(study: FragilityStudy, stopped: Callable[[], bool] = bool, *, quick: bool = False) -> Numbers:
    """Return the numbers of a study by its steps, without screen, notes and slips.

    quick: without ranges of the motions and the model, which take most of the time.
    SupersededError as soon as `stopped` says so.
    """
    fit = replace(study.fit, intervals="wald") if quick and study.fit.intervals is None else study.fit

    def watched(*_: int) -> None:
        if stopped():
            raise SupersededError

    watched()
    try:
        with noted():
            runs = study.design.run(study.blocks, study.models, fit.outputs, None, watched)
            curves = fit.curves(runs, study.risk is not None and not quick)
            plain, seen = without_replicates(curves), fit.probabilities(runs)
            numbers = plain.drop_vars([*OBSERVED], errors="ignore").assign(seen.data_vars)
            if not quick:
                numbers = numbers.assign(fit.chances_of_range(plain, seen["level"]))
            if study.risk is not None:
                rates = study.risk.rates(fit.modelled(curves), fit.confidence)
                named = rates.rename({old: new for old, new in RISK_NAMES.items() if old in rates}).data_vars
                numbers = numbers.assign({name: rate for name, rate in named.items() if name != "rate_sample"})
                if not quick:
                    numbers = numbers.assign(study.risk.modelling_range(curves, fit.modelling_dispersion))
            if study.slides is not None:
                slides = study.slides.chances(study.blocks, in_plane(runs))[INSTEAD]
                numbers = numbers.assign(gated(slides, {str(name): numbers[name] for name in numbers.data_vars}))
    except ValueError as error:
        raise StudyError(f"{study.title}: {error}") from None
    at = {"block": 0, "model": reference_law(numbers)[0]}
    chances = numbers.isel({dim: 0 for dim in ("block", "floor") if dim in numbers.dims})
    return Numbers(chances, _curve(curves.isel(at), seen.isel(at)))


def _curve(case: xr.Dataset, seen: xr.Dataset) -> Curve:
    scale, unit = display_unit(seen["level"])
    at = seen["level"].values
    levels = np.geomspace(at[0], at[-1], POINTS)
    shares = curve_probability(case, levels, LEAST).values.ravel()
    share, lower, upper = (_plain(seen[name].values) for name in ("probability", "lower", "upper"))
    line = (levels / scale).tolist(), np.nan_to_num(shares).tolist()
    return Curve(*line, (at / scale).tolist(), share, lower, upper, unit, quantity_name(seen["level"]))


def _plain(values: Array) -> list[float]:
    numbers: list[float] = values.ravel().tolist()
    return numbers


class Range(NamedTuple):
    """A chance with its ranges, each None if the study has none.

    The range of friction reaches to the chance without sliding. The range of the model is of one factor on all
    capacities. The chances of the laws are by name.
    """

    value: float
    motions: tuple[float, float]
    laws: dict[str, float]
    model: tuple[float, float]
    friction: tuple[float, float] | None
    restitution: tuple[float, float] | None

    @property
    def of_laws(self) -> tuple[float, float]:
        """The lowest and the highest chance of the laws."""
        known = [chance for chance in self.laws.values() if math.isfinite(chance)]
        return (min(known), max(known)) if known else (math.nan, math.nan)

    @property
    def whole(self) -> tuple[float, float]:
        """The lowest and the highest chance of all ranges."""
        ranges = (self.motions, self.of_laws, self.model, self.friction or (), self.restitution or ())
        known = [chance for ends in ranges for chance in (*ends, self.value) if math.isfinite(chance)]
        return (min(known), max(known)) if known else (math.nan, math.nan)

    def over(self, years: float) -> Range:
        """Return the chances in years of annual rates."""

        def chances(rates: tuple[float, ...] | None) -> Any:
            return None if rates is None else tuple(float(probability_in(np.float64(rate), years)) for rate in rates)

        laws = dict(zip(self.laws, chances(tuple(self.laws.values())), strict=True))
        return Range(chances((self.value,))[0], chances(self.motions), laws, *map(chances, self[3:]))


def range_at(numbers: xr.Dataset, less: xr.Dataset | None, name: str, ends: tuple[str, str]) -> Range:
    """Return the range of a variable of numbers, and of numbers with less restitution."""
    at, _ = reference_law(numbers)
    case = numbers.isel(level=0)
    law = case.isel(model=at)
    value = float(law[name])
    motions = float(law[ends[0]]), float(law[ends[1]])
    low, high = (float(law[f"{name}{end}"]) if f"{name}{end}" in law else math.nan for end in (LOWER, UPPER))
    laws = dict(zip(map(str, case["model"].values), case[name].values.tolist(), strict=True))
    instead = {"probability": GATED, "rate": GATED_RATE}.get(name)
    friction = (float(law[instead]), value) if instead in law else None
    changed = None if less is None else float(less.isel(level=0, model=0)[name])
    restitution = None if changed is None else (min(changed, value), max(changed, value))
    return Range(value, motions, laws, (low, high), friction, restitution)


class Remedy(NamedTuple):
    """A restraint of the study: its cost, and the chance of the piece with it, with its interval."""

    name: str
    cost: float
    chance: float
    lower: float
    upper: float


def remedies_in(results: xr.Dataset, tables: Mapping[str, Any]) -> list[Remedy]:
    """Return the piece without and with each restraint."""
    case = results.isel(model=0)
    case = case.isel({dim: 0 for dim in ("floor",) if dim in case["risk_probability"].dims})
    remedies = []
    for i, name in enumerate(map(str, case["block"].values)):
        values = [float(case[f"risk_probability{end}"][i]) for end in ENDS]
        cost = tables.get(name, {}).get("cost", math.nan) if name != FREE else 0.0
        remedies.append(Remedy(name, float(cost), *values))
    return remedies


def cheapest(remedies: list[Remedy], target: float) -> Remedy | None:
    """Return the cheapest remedy of known cost whose interval of the chance is at most a target."""
    enough = [remedy for remedy in remedies if remedy.upper <= target and math.isfinite(remedy.cost)]
    return min(enough, key=lambda remedy: (remedy.cost, remedy.upper), default=None)


class Basis(NamedTuple):
    """The facts below the numbers of a study, as sentences by section, and its checks."""

    sentences: dict[str, list[str]]
    checks: list[tuple[str, str, str]]
    passed: list[str]
    verdict: str
    badge: str


def basis_of(results: xr.Dataset) -> Basis:
    """Return the sentences that the report of a study has on its answer, its inputs, its method and its checks."""
    titles, facts = value_of("titles", "checks"), sections(with_law_names(results))
    names = ("answer", "footnotes", "inputs", "method")
    sentences = {name: [say(fact, REGISTERS[name]) for fact in facts[name]] for name in names}
    checks = [
        (titles[check.what], check.word, f"{say(check, 'checks')} {remedy(check, 'checks')}".strip())
        for check in facts["checks"]
    ]
    passed = list(dict.fromkeys(titles[check.what] for check in facts["passed"]))
    (badge,) = facts["validity"]
    return Basis(sentences, checks, passed, say(badge, "checks"), badge.word)


class Full(NamedTuple):
    """The full answer: results of each study of the page."""

    results: dict[str, xr.Dataset]
    basis: dict[str, Basis]
    compared: Comparison | None = None


def full_of(
    studies: Mapping[str, FragilityStudy], path: Path, before: Full | None, stopped: Callable[[], bool]
) -> Full:
    """Run studies as `toppling run` does, in memory; SupersededError as soon as `stopped` says so.

    before: an earlier answer, whose facts are kept for the same results.
    """
    results = {name: results_of(study, stopped) for name, study in studies.items()}
    compared = compared_of(results[VARIANT], results[PIECE], path) if VARIANT in results else None
    held, basis = ({}, {}) if before is None else (before.results, before.basis)
    known = {name: facts for name, facts in basis.items() if held[name] is results.get(name)}
    bases = {name: known.get(name) or basis_of(results[name]) for name in results if name != VARIANT}
    return Full(results, bases, compared)


def compared_of(variant: xr.Dataset, piece: xr.Dataset, path: Path) -> Comparison:
    """Compare the piece with a variant of it, each under its reference law, as `toppling compare` does."""
    sides = []
    for name, results in (("A", variant), ("B", piece)):
        # (blocks are matched by their names, which a variant may have changed)
        renamed = results.assign_coords(block=[MATCHED])
        sides.append(Side(name, path, renamed, json.loads(str(results.attrs["study"]))))
    first, second = (str(side.results["model"].values[reference_law(side.results)[0]]) for side in sides)
    return side_by_side(sides[0], sides[1], (first, second))


_RESULTS: OrderedDict[str, Any] = OrderedDict()
_RUNNING = threading.Lock()


def results_of(study: FragilityStudy, stopped: Callable[[], bool]) -> xr.Dataset:
    """Return the results of a study, which are kept; SupersededError as soon as `stopped` says so."""

    def watched(*_: int) -> None:
        if stopped():
            raise SupersededError

    def run() -> xr.Dataset:
        watched()
        return study.run(progress=watched)

    key = f"{study.identity} {study.title} {json.dumps(study.configuration, sort_keys=True)}"
    with _RUNNING:
        return kept(_RESULTS, key, run)
