"""Rules that join several tables of a study file: each has its sentence, and all of them are run."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from ...core import checks
from ...fragility.adaptive.curve import MOST_RUNS
from ...fragility.adaptive.until import MEDIAN, TARGETS
from ...fragility.analyses.surface_results import POOLED
from ...fragility.curves.curve import LINKED
from ...fragility.fitting.links import LINKS
from ...fragility.fitting.states import OVERTURNED, UPLIFTED
from ...fragility.hazard.pieces import EXTEND
from ...fragility.runs.scaling import BLOCK_MEASURES, SCALE
from ...fragility.uncertainty.joint import INDEPENDENT, TOGETHER
from .hazard import OF_HAZARD, OF_MOTIONS
from .motions import PAIR

if TYPE_CHECKING:
    from .schema import StudyFile

ANALYSES = ("ida", "stripes", "cloud", "performance")
RULES: list[Callable[[StudyFile], None]] = []
"""All rules, in the order in which their sentences are told; each raises a ValueError where it is broken."""


def rule(check: Callable[[StudyFile], None]) -> Callable[[StudyFile], None]:
    """Put a function among the rules."""
    RULES.append(check)
    return check


def broken(study: StudyFile) -> list[str]:
    """Return the sentences of the rules that a study breaks; those of one analysis come before all others."""
    said: list[str] = []
    for check in RULES:
        try:
            check(study)
        except ValueError as error:
            said.append(str(error))
            if check is _one_analysis:
                break
    return said


@rule
def _one_analysis(study: StudyFile) -> None:
    analyses = [name for name in ANALYSES if study.given(name) is not None]
    if len(analyses) != 1:
        found = " and ".join(analyses) or "none"
        raise ValueError(f"a study needs exactly one of {', '.join(ANALYSES)}, got {found}")


@rule
def _inventory_or_blocks(study: StudyFile) -> None:
    if study.performance is None:
        if study.blocks is None and study.blocks_file is None:
            raise ValueError("key 'blocks' is missing")
        if study.blocks is not None and study.blocks_file is not None:
            raise ValueError("blocks stand in the study file or in blocks_file, not in both")
        return
    for name in ("blocks", "blocks_file", "buildings", "uncertainty", "sensitivity", "fit", "measures", "outputs"):
        if study.given(name) is not None:
            why = "its blocks stand in its inventory" if name.startswith("blocks") else "leave it out"
            raise ValueError(f"a performance study has no {name}: {why}")


@rule
def _hazard_of_an_inventory(study: StudyFile) -> None:
    if study.performance is None or study.hazard is None:
        return
    given = sorted(study.hazard.model_fields_set & {"years", "probability", "along", "at", "below", "above"})
    if given:
        why = "its values are of one year" if given[0] == "years" else "leave it out"
        raise ValueError(f"hazard.{given[0]} is not for a performance study: {why}")


@rule
def _measure_of_an_inventory(study: StudyFile) -> None:
    if study.performance is not None and study.performance.im in BLOCK_MEASURES:
        raise ValueError(
            "performance.im must be a measure of the ground motion alone, which all pieces share, got "
            f"{study.performance.im!r}"
        )


@rule
def _targets_of_restraints(study: StudyFile) -> None:
    targets = [key for key, table in study.restraint_tables.items() if table.target is not None]
    if targets and study.kind != "fragility":
        raise ValueError(
            f"{targets[0]}.target is for fragility studies at levels that all motions share, not for {study.of_kind}"
        )


@rule
def _restraints_that_hold(study: StudyFile) -> None:
    named = {block.restraint for block in study.blocks or [] if isinstance(block.restraint, str)}
    unused = [name for name in study.restraints or {} if name not in named]
    if unused and study.blocks_file is None and study.performance is None:
        raise ValueError(f"restraints.{unused[0]} holds no block: name it in `restraint` of a block")


@rule
def _rates_of_curves(study: StudyFile) -> None:
    form = "lognormal" if study.fit is None else study.fit.form
    if study.hazard is not None and form in LINKED:
        raise ValueError(f"hazard needs curves whose rates are known exactly, not fit.form {form!r}")


@rule
def _sensitivity_alone(study: StudyFile) -> None:
    if study.sensitivity is None:
        return
    for name in ("hazard", "fit", "measures", "outputs", "uncertainty"):
        if study.given(name) is not None:
            raise ValueError(f"a study with sensitivity has no {name}")
    if study.motions.pair:
        raise ValueError("motions.component 'pair' is for an inventory or a study of blocks, not for [sensitivity]")


@rule
def _levels_that_follow(study: StudyFile) -> None:
    word = None if study.ida is None or not isinstance(study.ida.levels, str) else study.ida.levels
    if study.events is not None and word != POOLED:
        raise ValueError("events are of a region: they need ida with levels = 'pooled'")
    if word is None:
        if study.until is not None:
            raise ValueError("until is for ida with levels = 'adaptive' or 'pooled'")
        return
    if word != POOLED and study.until is not None and study.until.runs_per_motion is not None:
        checks.number("until.runs_per_motion", study.until.runs_per_motion, at_least=1, at_most=MOST_RUNS)
    needing = ("uncertainty", "sensitivity", "measures", "branches", "motion_sets")
    for name in (*needing, *(("screen", "friction") if word == POOLED else ())):
        if study.given(name) is not None:
            raise ValueError(f"{name} needs levels that all motions share, not levels = {word!r}")


@rule
def _fit_of_adaptive_levels(study: StudyFile) -> None:
    if study.fit is None or not study.adaptive:
        return
    for key, value, allowed in (
        ("state", study.fit.state, (OVERTURNED, UPLIFTED, "a number")),
        ("form", study.fit.form, tuple(LINKS)),
        ("method", study.fit.method, ("binomial",)),
    ):
        if value not in allowed and not (key == "state" and isinstance(value, float | int)):
            raise ValueError(f"fit.{key} of adaptive levels must be {' or '.join(allowed)}, got {value!r}")


@rule
def _rate_of_adaptive_levels(study: StudyFile) -> None:
    if not study.adaptive or study.until is None or study.until.rate is None:
        return
    if study.hazard is None:
        raise ValueError("until.rate needs a [hazard]")
    for key in ("below", "above"):
        if getattr(study.hazard, key) != EXTEND:
            raise ValueError(
                f"until.rate draws levels from the hazard curve, extended at both ends: leave out hazard.{key}"
            )


@rule
def _surface_of_many_blocks(study: StudyFile) -> None:
    if study.kind != "pooled":
        return
    for name in ("fit", "outputs", "restraints", "buildings"):
        if study.given(name) is not None:
            stands = name in ("restraints", "buildings")
            why = "blocks stand free on one floor" if stands else "all curves are found together"
            raise ValueError(f"levels = 'pooled' has no {name}: {why}")
    if study.motions.pair:
        raise ValueError(f"motions.component {PAIR!r} is not for levels = 'pooled', whose curves are of one component")
    asked = {} if study.until is None else study.until.model_dump(include=set(TARGETS), exclude_none=True)
    other = sorted({*asked} - {MEDIAN})
    if other:
        raise ValueError(f"until.{other[0]} is for levels = 'adaptive': a pooled surface asks for the median")
    given = (
        set() if study.hazard is None else study.hazard.model_fields_set & {"probability", "along", "below", "above"}
    )
    if given:
        raise ValueError(f"hazard.{min(given)} is not for levels = 'pooled', whose rates are found with its runs")


@rule
def _slips(study: StudyFile) -> None:
    friction = study.friction
    if friction is None:
        return
    if friction.slips_m is not None and study.kind not in ("fragility", "sequential", "performance"):
        raise ValueError(
            "friction.slips_m is for fragility and performance studies; "
            f"{study.of_kind} has its friction screened alone"
        )
    if friction.trip_mm is not None and study.kind == "sequential":
        raise ValueError("friction.trip_mm needs levels that all motions share, not levels = 'adaptive'")
    if friction.trip_mm is not None and study.kind not in ("fragility", "performance"):
        raise ValueError(f"friction.trip_mm is for fragility and performance studies, not for {study.of_kind}")


@rule
def _shared_friction(study: StudyFile) -> None:
    shared = None if study.friction is None else study.friction.shared
    if shared is None:
        return
    if study.performance is None:
        raise ValueError(f"friction.shared is for the pieces of a performance study, not for {study.of_kind}")
    variability = study.performance.variability
    pieces = INDEPENDENT if variability is None else variability.given("pieces") or INDEPENDENT
    if variability is not None and shared != (pieces == TOGETHER):
        raise ValueError(
            f"friction.shared = {str(shared).lower()} contradicts performance.variability.pieces = "
            f"{pieces!r}: pieces share their friction as they share all that differs"
        )


@rule
def _friction_of_blocks(study: StudyFile) -> None:
    own = next((i for i, block in enumerate(study.blocks or [], start=1) if block.own_friction is not None), None)
    if own is not None and study.kind not in ("fragility", "sequential"):
        raise ValueError(f"blocks[{own}]: its own friction is for fragility studies, not for {study.of_kind}")
    if own is not None and study.friction is None:
        raise ValueError(f"blocks[{own}]: its own friction needs [friction], which is that of the other blocks")


@rule
def _obstacles_near_blocks(study: StudyFile) -> None:
    near = next((i for i, block in enumerate(study.blocks or [], start=1) if block.trip_mm is not None), None)
    if near is None:
        return
    if study.kind == "sequential":
        raise ValueError(f"blocks[{near}].trip_mm needs levels that all motions share, not levels = 'adaptive'")
    if study.kind != "fragility":
        raise ValueError(f"blocks[{near}].trip_mm is for fragility studies, not for {study.of_kind}")
    if study.friction is None:
        raise ValueError(f"blocks[{near}].trip_mm needs [friction], without which no block slides")


@rule
def _branches(study: StudyFile) -> None:
    sets = {
        OF_MOTIONS: [motions.name for motions in study.motion_sets or []],
        OF_HAZARD: [hazard.name for hazard in study.hazards or []],
    }
    keys = {OF_MOTIONS: "motion_sets", OF_HAZARD: "hazards"}
    kinds = [table.of for table in study.branches or []]
    key, table = ("fit", study.fit) if study.performance is None else ("performance", study.performance)
    modelled = table is not None and table.modelling == "fractiles"
    if modelled and table is not None and table.modelling_dispersion == 0.0:
        raise ValueError(f"{key}.modelling = 'fractiles' needs {key}.modelling_dispersion > 0")
    if study.branches is None and not any(sets.values()) and not modelled:
        return
    if study.kind not in ("fragility", "performance"):
        raise ValueError(
            f"branches are for fragility studies of known blocks and for inventories, not for {study.of_kind}"
        )
    if study.hazard is None:
        what = "branches" if study.branches is not None or any(sets.values()) else f"{key}.modelling = 'fractiles'"
        raise ValueError(f"{what}: they spread an annual rate, which needs a [hazard]")
    if len(set(kinds)) < len(kinds):
        raise ValueError(f"branches hold one table for each kind, got {', '.join(kinds)}")
    for kind, names in sets.items():
        known = [kind, *names]
        if len(set(known)) < len(known):
            raise ValueError(f"{keys[kind]} need names that differ from each other and from {kind!r}")
        asked = next((table.names for table in study.branches or [] if table.of == kind), [])
        for name in asked:
            if name not in known:
                raise ValueError(f"branches of {kind} must name {', '.join(map(repr, known))}, got {name!r}")
        unused = [name for name in names if name not in asked]
        if unused:
            raise ValueError(f"{keys[kind]} {unused[0]!r} is in no branch: name it with its weight")
    if sets[OF_MOTIONS] and study.stripes is not None:
        raise ValueError("branches of motions need ida or cloud: stripes have motions of their own at each level")


@rule
def _buildings(study: StudyFile) -> None:
    if study.building is not None and study.buildings is not None:
        raise ValueError("a study has one building or several buildings, not both keys")
    names = [building.name for building in study.buildings or []]
    if None in names or len(set(names)) < len(names):
        raise ValueError(f"buildings need a name each, all different, got {', '.join(map(str, names))}")
    for key in ("floors_file", "floors_index"):
        if study.stand and study.motions.given(key) is not None:
            raise ValueError(f"a building needs ground motions, got motions.{key}, which are of floors already")


@rule
def _levels_at_the_ground(study: StudyFile) -> None:
    if study.performance is None and study.analysis.im_at == "ground" and not study.stand and study.support is None:
        name = next(name for name in ANALYSES if study.given(name) is not None)
        raise ValueError(f"{name}.im_at 'ground' needs a building, whose floors move with the ground")


@rule
def _what_does_not_scale(study: StudyFile) -> None:
    if study.scales or study.performance is not None:
        return  # (motions of an inventory go through what yields at each level)
    what = next((building.what for building in study.stand if not building.scales), "an isolator that yields")
    if study.ida is not None:
        raise ValueError(
            f"{what} needs stripes or cloud: what is above it does not scale, so that motions go through it at "
            "each level"
        )
    if study.stripes is None or not study.stripes.scale:
        return
    if study.stripes.im_at != "ground":
        raise ValueError(
            f"{what} needs stripes.im_at = 'ground', where motions are scaled to their level, or scale = false"
        )
    if study.stripes.im in (SCALE, *BLOCK_MEASURES):
        raise ValueError(f"{what} needs a measure of the ground motion, got {study.stripes.im}")


@rule
def _support(study: StudyFile) -> None:
    if study.support is None:
        return
    if study.performance is not None or study.sensitivity is not None:
        raise ValueError(
            "support is for the blocks of a study, not for an inventory, whose lines name [[supports]], or "
            "[sensitivity]"
        )
    for key in ("floors_file", "floors_index"):
        if study.motions.given(key) is not None:
            raise ValueError(f"a support needs ground motions, got motions.{key}, which are of floors already")
    if study.analysis.im_at != "ground":
        raise ValueError("a support needs im_at = 'ground': levels are of the ground motion below it")


@rule
def _supports(study: StudyFile) -> None:
    names = [support.name for support in study.supports or []]
    if names and study.performance is None:
        raise ValueError("supports are for the lines of an inventory; blocks of a study have one [support]")
    if len(set(names)) < len(names):
        raise ValueError(f"supports need different names, got {', '.join(names)}")


@rule
def _elastic_histories(study: StudyFile) -> None:
    if study.performance is None and study.motions.given("elastic") is not None:
        raise ValueError("motions.elastic is for the floor histories of a performance study")
