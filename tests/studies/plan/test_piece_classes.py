"""Classes of pieces: what is said of their tests, and the modelling uncertainty that follows from them."""

import math

from check_facts import numbers_in

from toppling.core.facts import facts_in, stored
from toppling.studies.facts.say import notes_said
from toppling.studies.plan import piece_classes
from toppling.studies.plan.piece_classes import COLUMNS, PieceClass, class_notes


def test_sentences(monkeypatch):
    numbers = dict.fromkeys(COLUMNS[1:], math.nan)
    none = PieceClass(name="rack", **{**numbers, "tests": 0, "fell": 0, "records": 0, "sources": 0})
    classes = {"rack": none}
    monkeypatch.setattr(piece_classes, "piece_classes", lambda: classes)

    def said():
        (fact,) = class_notes("rack")
        (kept,) = facts_in(stored([fact]))
        assert (fact.what, fact.names, {*fact.more}) == ("validity.tests", ("rack",), {*COLUMNS})
        assert notes_said([kept]) == notes_said([fact])
        return notes_said([fact])[0]

    assert said().startswith("No test ")
    few = classes["rack"] = none._replace(tests=2, fell=1, sources=2, predicted=1.2, records=2)
    assert numbers_in(said())[:3] == [1, 2, 2]
    assert "too few" in said()
    assert math.isnan(few.beta_m)
    known = classes["rack"] = few._replace(
        tests=90, ratio=0.8, ratio_lower=0.7, ratio_upper=0.9, beta=0.3, brier=0.1, reference=0.2
    )
    assert known.beta_m == 0.37
    assert "0.80 (0.70 to" in said()
    assert class_notes(None) == []
