"""Classes of tested pieces by name in study files: their modelling uncertainty, and what is told of their tests."""

import numpy as np
import pytest
from study_texts import CABINET, HAZARD, IDA, laws, motions, study_of, tower

from toppling.studies.facts.footnotes import footnotes
from toppling.studies.facts.notes import notes_of
from toppling.studies.facts.say import say
from toppling.studies.plan.piece_classes import piece_classes

FIT = "[fit]\nreplicates = 100\n"
INVENTORY = "item,count,floor,width_m,height_m,value,anchored\nshelf,2,1,0.4,1.8,100,no\n"
PERFORMANCE = (
    laws("housner")
    + tower(0.4, 2)
    + '[performance]\ninventory = "things.csv"\n'
    + 'levels = { from = 1.0, to = 12.0, number = 5, spacing = "log", unit = "m/s2" }\nreplicates = 100\n'
)


def study(folder, *parts):
    return study_of(folder, *parts, things=INVENTORY)


def class_tests(results):
    return [fact for fact in footnotes(results) if fact.what == "validity.tests"]


def cabinet(folder, more):
    return study(folder, CABINET, motions(12), IDA, HAZARD, FIT, more)


class TestFragility:
    @pytest.mark.slow
    def test_a_class_gives_its_dispersion_and_says_so(self, tmp_path):
        """The rates are those of the same number given by hand."""
        beta = piece_classes()["rock"].beta_m
        found = cabinet(tmp_path, 'modelling_class = "rock"\n').run()
        byhand = cabinet(tmp_path, f"modelling_dispersion = {beta}\n").run()
        np.testing.assert_array_equal(found["rate"], byhand["rate"])
        assert found.attrs["modelling_dispersion"] == beta
        (included,) = (fact for fact in notes_of(found) if fact.what == "rate.modelling_included")
        assert included.value == beta
        (tests,) = (fact for fact in notes_of(found) if fact.what == "validity.tests")
        assert (tests.names, tests.more["tests"]) == (("rock",), 642)
        assert class_tests(byhand) == []
        (tests,) = class_tests(found)
        assert (tests.names, tests.more["tests"], tests.more["sources"]) == (("rock",), 642, 1)

    @pytest.mark.slow
    @pytest.mark.parametrize(("name", "said"), [("rack", "No test of the class rack"), ("bookcase-wall", "too few")])
    def test_a_class_without_an_estimate_changes_no_rate(self, tmp_path, name, said):
        plain = cabinet(tmp_path, "").run()
        found = cabinet(tmp_path, f'modelling_class = "{name}"\n').run()
        np.testing.assert_array_equal(found["rate"], plain["rate"])
        assert found.attrs["modelling_dispersion"] == 0.0
        (tests,) = class_tests(found)
        assert said in say(tests, "page")

    def test_a_dispersion_of_its_own_holds(self, tmp_path):
        found = cabinet(tmp_path, 'modelling_class = "rock"\nmodelling_dispersion = 0.2\n')
        assert found.fit.modelling_dispersion == 0.2
        assert cabinet(tmp_path, "").fit.modelling_class is None


class TestPerformance:
    def test_an_inventory(self, tmp_path):
        beta = piece_classes()["rock"].beta_m
        found = study(tmp_path, motions(12), PERFORMANCE, 'modelling_class = "rock"\n', HAZARD).run()
        byhand = study(tmp_path, motions(12), PERFORMANCE, f"modelling_dispersion = {beta}\n", HAZARD).run()
        np.testing.assert_array_equal(found["any_rate"], byhand["any_rate"])
        (tests,) = (fact for fact in notes_of(found) if fact.what == "validity.tests")
        assert (tests.names, tests.more["tests"]) == (("rock",), 642)
