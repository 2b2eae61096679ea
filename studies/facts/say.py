"""Templates of facts: one file of whole sentences for each register."""

import math
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment
from markupsafe import Markup

from ...core import sentences, wording
from ...core.facts import Fact
from ...fragility.hazard.poisson import probability_in
from ...fragility.validity.notes import TEMPLATES as OF_SCREENS
from ..text.curve_notes import action_of, infinitive_of, reached_of, verb_of
from ..text.names import clean
from ..text.words import value_in

TEMPLATES = Path(__file__).parents[1] / "templates"
FALLBACKS = {
    "notes": ("notes", "screen", "method", "page"),
    "method": ("method", "screen"),
    "comparison": ("comparison", "page"),
}
"""Registers in which the sentences of a register are looked up, if it shares them with others."""

SHARED = {
    **dict.fromkeys(("anchoring.outside", "anchoring.indicative"), "anchoring_no_advice"),
    **dict.fromkeys(("anchoring.unpriced", "anchoring.unvalued", "code.unpriced"), "anchoring_incomplete"),
    "anchoring.with_kit": "anchoring.already",
    **dict.fromkeys(("axis.bed_along_width", "axis.too_deep"), "axis_width_only"),
    "building.over_branches": "building.any_fall",
    **dict.fromkeys(("code.mass_not_given", "code.class_not_given"), "code_not_given"),
    "comparison.no_losses": "comparison.no_amount",
    **dict.fromkeys(("comparison.surface", "comparison.too_many"), "comparison_no_intervals"),
    **dict.fromkeys(("consequence.loss", "consequence.downtime", "consequence.injuries"), "consequence_amount"),
    "curve.crossing_too": "curve.crossing",
    **dict.fromkeys(("curve.few_reached", "curve.few_stayed"), "curve_few"),
    "curve.forced": "curve.one_side",
    "curve.misfit_low": "curve.misfit",
    "curve.unfitted": "curve.marked",
    **dict.fromkeys(("kit.for_budget", "kit.for_target", "kit.target_missed"), "kit_set"),
    **dict.fromkeys(("kit.no_effect", "kit.too_weak", "kit.worse"), "kit_unfit"),
    "law.crossing_too": "law.crossing",
    **dict.fromkeys(("law.use_consistent", "law.use_missing", "law.use_reference"), "law_use"),
    **dict.fromkeys(
        ("motion.spectra_accepted", "motion.spectra_alike", "motion.spectra_may_be_chance"), "motion_spectra"
    ),
    "rate.extrapolated": "rate.beyond_hazard",
    **dict.fromkeys(
        ("rate.share_above_levels", "rate.share_below_levels", "rate.share_beyond_hazard"), "rate_share_beyond"
    ),
    **dict.fromkeys(("rate.no_curve", "rate.too_few_runs", "rate.unbounded_branch"), "rate_unknown"),
    **dict.fromkeys(("restraint.helps", "restraint.hurts"), "restraint_changes"),
    **dict.fromkeys(("restraint.helps_level", "restraint.hurts_level"), "restraint_changes_level"),
    "restraint.no_effect_level": "restraint.no_effect",
    **dict.fromkeys(("sensitivity.delta_settled", "sensitivity.e_settled"), "sensitivity_settled"),
    "single.elastic_mode": "single.outside",
}
"""The sentences of facts without one of their own: of another fact, or (without a dot) of several facts alone."""

FILTERS: sentences.Filters = {
    **sentences.FILTERS,
    "chance": wording.about_percent,
    "chances": lambda ends: _ends(ends, wording.about_percent, wording.chances_between),
    "ends": lambda ends: _ends(ends, wording.two_digits, wording.interval_text),
    "ratio": lambda values: wording.ratio_text(*values),
    "years": wording.about_years,
    "in_years": lambda rate, years: float(probability_in(np.float64(rate), years)),
    "year_count": wording.years_text,
    "in_unit": value_in,
    "acts": action_of,
    "fell": reached_of,
    "fall": lambda state: infinitive_of(verb_of(state)),
}
"""Filters of numbers, plurals and lists."""


def _ends(ends: tuple[float, float], write: Callable[[float], str], between: Callable[..., str]) -> str:
    """Return the ends of a range, one number if both are written alike, or that they are not known."""
    low, high = ends
    if not (math.isfinite(low) and low > 0.0) and math.isinf(high):
        return "interval not known"
    return write(low) if math.isfinite(high) and write(low) == write(high) else between(low, high, write)


def say(fact: Fact, register: str) -> str:
    """Return the sentence of a fact: the macro of its name in the template of a register, `a.b` as `a_b`."""
    return sentences.sentence(fact.more.get("sentence", fact.what), fact, _modules(register), SHARED)


def remedy(fact: Fact, register: str) -> str:
    """Return the remedy for a fact; empty if nothing is needed."""
    return sentences.sentence(fact.remedy, fact, _modules(register)) if fact.remedy else ""


def notes_said(facts: Iterable[Fact]) -> list[str]:
    """Return the sentences of notes; those on the motions of a branch name it."""
    return [
        f"{sentences.sentence('motion.of_branch', fact, _modules('notes')) if 'branch' in fact.more else ''}"
        f" {say(fact, 'notes')}".strip()
        for fact in facts
    ]


def value_of(name: str, register: str) -> Any:
    """Return a table of a register, such as the titles of its facts."""
    return getattr(register_of(register), name)


def _modules(register: str) -> Iterable[Any]:
    return map(register_of, FALLBACKS.get(register, (register,)))


@cache
def register_of(register: str) -> Any:
    """Return a register: its macros and tables are attributes."""
    return environment(escaping=False).get_template(f"{register}.j2").module


def environment(*, escaping: bool) -> Environment:
    """Return the templates, whose texts are cleaned and, with `escaping`, escaped for HTML."""

    def safe(value: object) -> object:
        return clean(value) if isinstance(value, str) and not isinstance(value, Markup) else value

    return sentences.environment([TEMPLATES, OF_SCREENS], FILTERS, escaping=escaping, safe=safe)
