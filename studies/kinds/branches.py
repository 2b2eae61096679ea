"""The weighted branches that a study file asks for: its laws, sets of motions and hazard curves by name."""

from __future__ import annotations

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
    found: dict[str, float] = {}
    for name, weight in asked.items():
        named = [model.label for model in models if name in (model.label, model.law)]
        if len(named) != 1 or named[0] in found:
            allowed = ", ".join(map(repr, labels))
            raise ValueError(f"branches of models must name one law each of {allowed}, got {name!r}")
        found[named[0]] = weight
    return found


def weighted_motions(content: StudyFile, made: Callable[[StudyFile], Made]) -> dict[str, tuple[Made | None, float]]:
    """Return the object made of each set of motions with its weight, by name; None for the study's own motions."""
    others = {one.name: one.motions for one in content.motion_sets or []}
    found: dict[str, tuple[Made | None, float]] = {}
    for name, weight in _shares(content).get(OF_MOTIONS, {OF_MOTIONS: 1.0}).items():
        if name == OF_MOTIONS:
            found[name] = None, weight
            continue
        try:
            found[name] = made(content.other(others[name])), weight
        except ValueError as error:
            raise ValueError(f"motion_sets {name!r}: {error}") from None
    return found


def weighted_hazards(
    content: StudyFile, own: HazardCurve, im: str, folder: Path
) -> dict[str, tuple[HazardCurve, float]]:
    """Return the hazard curves with their weights by name, `own` under its own name."""
    curves = {one.name: one.hazard for one in content.hazards or []}
    found = {}
    for name, weight in _shares(content).get(OF_HAZARD, {OF_HAZARD: 1.0}).items():
        try:
            curve = own if name == OF_HAZARD else curves[name].build(im, folder)
        except ValueError as error:
            raise ValueError(f"hazards {name!r}: {error}") from None
        found[name] = replace(curve, at=own.at), weight
    return found


def _shares(content: StudyFile) -> dict[str, dict[str, float]]:
    return {one.of: one.shares for one in content.branches or []}
