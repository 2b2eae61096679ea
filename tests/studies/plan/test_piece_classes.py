"""Classes of pieces: what is said of their tests, and the modelling uncertainty that follows from them."""

import math

from toppling.studies.plan.piece_classes import COLUMNS, PieceClass


def test_sentences():
    numbers = dict.fromkeys(COLUMNS[1:], math.nan)
    none = PieceClass(name="rack", **{**numbers, "tests": 0, "fell": 0, "records": 0, "sources": 0})
    assert none.sentence.startswith("no test of this class (rack)")
    few = none._replace(tests=2, fell=1, sources=2, predicted=1.2, records=2)
    assert "2 tests of 2 sources" in few.sentence
    assert "too few" in few.sentence
    assert math.isnan(few.beta_m)
    known = few._replace(tests=90, ratio=0.8, ratio_lower=0.7, ratio_upper=0.9, beta=0.3, brier=0.1, reference=0.2)
    assert known.beta_m == 0.37
    assert "0.80 (0.70 to 0.90) times those computed" in known.sentence
