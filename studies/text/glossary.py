"""The terms that reports use, each with its definition: a report defines every term that it uses, once."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import NamedTuple


class Term(NamedTuple):
    """A term, its definition, and the pattern by which a text is known to use it."""

    name: str
    definition: str
    pattern: str


TERMS = (
    Term(
        "interval",
        "The range of the result over repeated draws of the motions; it covers no other uncertainty.",
        r"\bintervals?\b",
    ),
    Term(
        "once in N years (return period)",
        "The long-run average time between events; not a schedule.",
        r"\b[Oo]nce in|[Rr]eturn period",
    ),
    Term(
        "recommendation",
        "Required by code and anchor below code force come first. Reduces risk most: the pieces behind 80 % of the "
        "falls (or injuries) that endanger people; makes people safer: the others of them. Worth its cost saves "
        "more in 50 years, discounted, than it costs; small effect saves less; not resolved: the motions do not "
        "decide. Indicative only and outside the model give no ground for advice.",
        r"\brecommendations?\b",
    ),
    Term(
        "payback",
        "Years until the prevented loss, discounted, equals the cost; never if the saving per year is below the "
        "interest.",
        r"\bpayback\b|\bpays back\b",
    ),
    Term(
        "hazard curve",
        "How often per year the shaking at the site exceeds each level.",
        r"\bhazard\b",
    ),
    Term(
        "Sa(T)",
        "Peak acceleration of an elastic oscillator with a period of T seconds and 5 % damping.",
        r"\bSa\(|spectral acceleration",
    ),
    Term(
        "half level",
        "The level at which half of the motions overturn the block, from the runs themselves.",
        r"\bhalf (?:levels?|fall|at\b|of the (?:runs|motions))",
    ),
    Term(
        "dispersion (β)",
        "The standard deviation of the logarithm of the level that overturns a block, from motion to motion.",
        r"\b[Dd]ispersions?\b|\bβ\b(?!_)",
    ),
    Term(
        "fitted curve, median",
        "The curve fitted to the runs of all levels, and the level at which it passes 50 %; not always the half level.",
        r"\b[Mm]edians?\b|\bfitted curves?\b",
    ),
    Term(
        "modelling uncertainty",
        "The standard deviation β_m of the logarithm of the real capacity over the computed capacity.",
        r"modelling (uncertainty|dispersion)|β_m|modelling_dispersion",
    ),
    Term(
        "reference law",
        "Housner's rigid block with impacts (1963), which the damping laws approximate.",
        r"\breference law\b|\(reference\)",
    ),
    Term(
        "restitution (e, e_R)",
        "Angular velocity after an impact over that before it; e_R follows from the shape (Housner 1963).",
        r"\be_R\b|\be=|\b[Rr]estitution\b",
    ),
    Term(
        "δ",
        "Half the width of the zone about the upright position in which a law dissipates energy, over α.",
        r"δ",
    ),
    Term(
        "α, R, p",
        "Slenderness angle arctan(b/h), half diagonal, and √(m g R/I_O), which sets how quickly a block rocks.",
        r"α, rad|\bp, rad/s|\bslenderness\b",
    ),
    Term(
        "PGA, PGV",
        "Peak ground acceleration and velocity.",
        r"\bPG[AV]\b|\bpg[av]\b|peak ground",
    ),
    Term(
        "RotD50",
        "The median of a measure over all horizontal directions.",
        r"\bRotD50\b",
    ),
    Term(
        "RotD100",
        "The maximum of a measure over all horizontal directions.",
        r"\bRotD100\b",
    ),
    Term(
        "block",
        "The model of a piece: a rigid body that rocks on the edges of its base.",
        r"(?<!rigid )\b[Bb]locks?\b(?!-)",
    ),
    Term(
        "motion",
        "Ground or floor acceleration over time in one earthquake, recorded or simulated.",
        r"\bmotions?\b",
    ),
    Term(
        "overturn",
        "To rock so far that the piece does not return to the upright position.",
        r"overturn\w*|falls?\b|falling",
    ),
    Term(
        "fragility curve",
        "The probability that a block overturns, as a function of the level of shaking.",
        r"\b[Ff]ragility\b|(?<!hazard )\bcurves?\b|\bCurves?\b",
    ),
    Term(
        "damping law",
        "The rule by which a rocking block dissipates energy.",
        r"\blaws?\b",
    ),
    Term(
        "uplift",
        "To begin to rock on one edge.",
        r"\b[Uu]plift\w*",
    ),
    Term(
        "elastic mode",
        "A vibration near the upright position that a law allows and a rigid block does not have.",
        r"\belastic (mode|zone)\b",
    ),
    Term(
        "bootstrap",
        "Repeating the evaluation with motions drawn again at random.",
        r"\b[Bb]ootstrap\b|\b[Rr]esample\w*",
    ),
    Term(
        "incremental dynamic analysis",
        "Every motion is scaled to several levels, and each block runs under all of them.",
        r"[Ii]ncremental dynamic analysis",
    ),
    Term(
        "g",
        "The acceleration of gravity, 9.81 m/s².",
        r"\d[ \u00a0]g\b|, g\b|\(g\)",
    ),
)
"""Every term, the most needed first."""


def used(texts: Iterable[str], known: Iterable[Term] = ()) -> list[Term]:
    """Return the terms that some texts use, but for those that are `known` already."""
    text = "\n".join(texts)
    before = set(known)
    return [term for term in TERMS if term not in before and re.search(term.pattern, text)]
