"""The weighted branches that a study file asks for: its laws, sets of motions and hazard curves by name."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

from ...fragility import HazardCurve
from ...models import Law
from ..file.hazard import OF_HAZARD, OF_MODELS, OF_MOTIONS
from ..file.schema import StudyFile
from ..text.words import reference_position

Made = TypeVar("Made")


def weighted_laws(content: StudyFile, models: Sequence[Law]) -> dict[str, float]:
    """Return weights by the labels of laws; the reference law alone without branches of models."""
    asked = _shares(content).get(OF_MODELS)
    labels = [model.label for model in models]
    if asked is None:  # (the law that every report takes first)
        return {labels[reference_position([model.law for model in models])[0]]: 1.0}
    weights: dict[str, float] = {}
    for name, weight in asked.items():
        named = [model.label for model in models if name in (model.label, model.law)]
        if len(named) != 1 or named[0] in weights:
            allowed = ", ".join(map(repr, labels))
            raise ValueError(f"branches of models must name one law each of {allowed}, got {name!r}")
        weights[named[0]] = weight
    return weights


def weighted_motions(content: StudyFile, made: Callable[[StudyFile], Made]) -> dict[str, tuple[Made | None, float]]:
    """Return the object made of each set of motions with its weight, by name; None for the study's own motions."""
    others = {other.name: other.motions for other in content.motion_sets or []}
    weighted: dict[str, tuple[Made | None, float]] = {}
    for name, weight in _shares(content).get(OF_MOTIONS, {OF_MOTIONS: 1.0}).items():
        if name == OF_MOTIONS:
            weighted[name] = None, weight
            continue
        try:
            weighted[name] = made(content.other(others[name])), weight
        except ValueError as error:
            raise ValueError(f"motion_sets {name!r}: {error}") from None
    return weighted


def weighted_hazards(
    content: StudyFile, of_study: HazardCurve, im: str, folder: Path
) -> dict[str, tuple[HazardCurve, float]]:
    """Return the hazard curves with their weights by name, `of_study` under its own name."""
    curves = {table.name: table.hazard for table in content.hazards or []}
    weighted = {}
    for name, weight in _shares(content).get(OF_HAZARD, {OF_HAZARD: 1.0}).items():
        try:
            curve = of_study if name == OF_HAZARD else curves[name].build(im, folder)
        except ValueError as error:
            raise ValueError(f"hazards {name!r}: {error}") from None
        weighted[name] = replace(curve, at=of_study.at), weight
    return weighted


def _shares(content: StudyFile) -> dict[str, dict[str, float]]:
    return {branch.of: branch.shares for branch in content.branches or []}
