"""Every fact of a note has its sentence, and a page leaves out what it says elsewhere."""

import re

import pytest
import xarray as xr

from toppling.core.facts import Fact, doubted, facts_in, stored
from toppling.fragility.validity.notes import TEMPLATES as OF_SCREENS
from toppling.studies.facts.notes import left_notes, notes_of, of_branch
from toppling.studies.facts.say import SHARED, TEMPLATES, notes_said

MORE = {
    **{"of": 4, "values": [0.2], "fewest": 5, "widest": 2.0, "state": "overturning", "samples": 9, "branches": 2},
    **{"others": 2, "notable": 0.05, "side": "above", "end": "1 g", "formula": False, "run": "level", "cure": "raise"},
    **{"shares": [[0.2, "loss"]], "motions": 9, "lines": [[2, "x", "kit"]], "how": "levels", "stripes": 3},
    **{"why": "friction", "several": True, "friction": True, "safety": ["injury"], "value": True, "kit": "strap"},
    **{"stiffnesses": [20.0], "seed": 1, "worst": [[0.3, "a", "law"]], "when": "impact", "given": False},
    **{"impact": None, "bed": True, "least": None, "most": None, "need": 39, "width": 0.15, "flipped": 1, "tested": 10},
    **{"perturbed": 1, "reversed": True, "vertical": False, "slides": True, "branch": "other", "plane": True},
    "rocking": 0.5,
}
OWN = {
    **{what: {"values": [[1, 40]]} for what in ("curve.few_reached", "curve.few_stayed")},
    "axis.share_along_depth": {"shares": [0.5]},
    "axis.across_not_included": {"lines": [[1, "x"]]},
}
NAMED = {"selection.target_silent": ("pgv",), "building.default_strength": ("", "b")}
NAMES = [
    macro.replace("_", ".", 1)
    for folder, name in ((TEMPLATES, "notes"), (OF_SCREENS, "screen"))
    for macro in re.findall(r"{% macro ([a-z]+_\w+)\(f\)", (folder / f"{name}.j2").read_text(encoding="utf-8"))
    if macro != "motion_of_branch" and macro not in SHARED.values()
]
NAMES += [
    *("axis.bed_along_width", "axis.too_deep", "code.mass_not_given", "code.class_not_given", "curve.few_reached"),
    *("curve.few_stayed", "curve.forced", "curve.misfit_low", "rate.extrapolated", "rate.share_above_levels"),
    *("rate.share_below_levels", "rate.share_beyond_hazard", "anchoring.with_kit", "single.elastic_mode"),
]


@pytest.mark.parametrize("what", NAMES)
def test_every_note_has_a_sentence(what):
    names = NAMED.get(what, ("a", "b") if "adaptive" in what else ("a",))
    fact = Fact(what, 3, 1.0, 2.0, names=names, more=MORE | OWN.get(what, {}))
    (kept,) = facts_in(stored([fact]))
    assert kept == fact
    (text,) = notes_said([fact])
    assert text.startswith("Motions “other”: ")
    assert what == "input.doubt" or re.search(r"[.?]$", text), text


def test_notes_that_a_page_says_elsewhere_are_left_out():
    inputs = [*doubted(["odd?", "settled"]), Fact("wall.low_contact", names=("a",))]
    runs = [Fact("stability.undecided", 0.1), Fact("validity.not_modelled"), Fact("rate.no_width", 1)]
    results = xr.Dataset(
        attrs={"input_notes": stored(inputs), "notes": stored(runs), "doubts": '[["size", "odd?", false]]'}
    )
    assert notes_of(results) == [*inputs, *runs]
    said = [Fact("stability.undecided"), Fact("validity.left_out")]
    assert left_notes(results, said) == [*inputs[1:], runs[2]]
    assert of_branch("b", runs)[0].more == {"branch": "b"}
    assert facts_in("an old sentence") == doubted(["an old sentence"])
