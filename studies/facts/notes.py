"""Notes of results, of the inputs and of the runs, for a reader who relies on them."""

import json
from collections.abc import Iterable
from dataclasses import replace

import xarray as xr

from ...core.facts import Fact, facts_in
from .coverage import coverage_in

INPUT_NOTES = "input_notes"
"""Attribute of results with the notes that are known before anything runs; the attribute `notes` is of the runs."""

SAID_BY = {
    "anchoring.already": ("anchoring.assumed",),
    "anchoring.with_kit": ("anchoring.assumed",),
    "building.default_strength": ("building.strength_default",),
    "building.random_strength": ("building.strength_uncertain",),
    "friction.not_given": ("sliding.share_needed", "sliding.share"),
    "law.elastic_mode": ("law.other_elastic_modes",),
    "restraint.elastic": ("restraint.model",),
    "sliding.share": ("sliding.share_needed", "friction.not_given"),
    "selection.agreement": ("selection.method",),
    "support.brakes_assumed": ("support.castors_locked",),
    "support.pedestals_as_floor": ("support.moving_pedestal",),
    "support.rolls": ("support.castors",),
    "uncertainty.modelling_none": ("rate.model_range",),
    "wall.base_no_slip": ("wall.model",),
    "validity.not_modelled": ("validity.left_out",),
}
"""Notes, and their facts on a page, in addition to the facts of the same name."""


def notes_of(results: xr.Dataset) -> list[Fact]:
    """Return the notes of results, those on the inputs first, those on their intervals last."""
    known, facts = (facts_in(str(results.attrs.get(name, ""))) for name in (INPUT_NOTES, "notes"))
    known_names = {(fact.what, fact.names) for fact in known}
    return [*known, *(fact for fact in facts if (fact.what, fact.names) not in known_names), *coverage_in(results)]


def of_branch(motions: str, notes: Iterable[Fact]) -> list[Fact]:
    """Return notes as those on the motions of a branch."""
    return [replace(note, more={**note.more, "branch": motions}) for note in notes]


def left_notes(results: xr.Dataset, facts: Iterable[Fact]) -> list[Fact]:
    """Return the notes that are in no fact of a page."""
    names = {fact.what for fact in facts}
    doubts = {str(sentence) for _, sentence, _ in json.loads(str(results.attrs.get("doubts", "[]")))}
    return [
        note
        for note in notes_of(results)
        if not names & {note.what, *SAID_BY.get(note.what, ())} and not doubts & {*note.names}
    ]
