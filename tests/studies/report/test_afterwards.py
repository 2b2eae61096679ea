"""What falls in a building today and after the recommended work, from stored outcomes."""

import numpy as np
import pytest
from report_pages import loaded

from toppling.studies.facts.building import actions, answer, rate_without, recommended_lines
from toppling.studies.facts.say import say
from toppling.studies.text.reached import within_levels
from toppling.studies.text.words import reference_law


@pytest.fixture
def results(folder):
    return within_levels(loaded(folder, "performance"))


def test_the_rate_of_any_fall_follows_from_the_stored_outcomes(results):
    whole = results.sel(place="building")
    assert rate_without(results, []) == float(whole["any_rate"][reference_law(results)[0]])
    assert rate_without(results, results["item"].values.tolist()) == 0.0


def test_anchoring_a_line_is_a_study_without_it(results):
    """The rate is that of the flags of the other lines, counted by hand."""
    for item in results["item"].values.tolist():
        others = (
            results["overturned"]
            .isel(model=reference_law(results)[0])
            .sel(item=[one for one in results["item"].values if one != item])
        )
        free = others.sel(item=~others["anchored"])
        falls = free.any("item")  # (the pieces of this study are alike: one variant)
        expected = float((falls.mean("motion") * results["level_weight"]).sum())
        np.testing.assert_allclose(rate_without(results, [item]), expected, rtol=1e-12)


def test_the_answer_gives_the_state_after_the_recommended_work(results):
    facts = {fact.what: fact for fact in answer(results)}
    lines = [piece.item for piece in recommended_lines(results)]
    after = facts["anchoring.after"]
    assert after.value == rate_without(results, lines) < after.more["now"] == facts["building.any_fall"].value
    assert after.more["number"] == sum(piece.number for piece in recommended_lines(results))


def test_every_fact_has_a_sentence(results):
    for fact in [*answer(results), *actions(results)]:
        sentence = say(fact, "page")
        assert sentence.endswith((".", "?")), sentence
        assert "  " not in sentence
        assert "nan" not in sentence
