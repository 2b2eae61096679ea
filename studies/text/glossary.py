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
        "overturn",
        "A piece overturns when it rocks so far that it does not return to the upright position.",
        r"overturn\w*|falls?\b|falling",
    ),
    Term(
        "interval",
        "How far a result may change because only a limited number of motions were run: if the study were repeated "
        "with other motions of the same kind, 95 % (or the share that is stated) of such ranges would contain the "
        "result of a very large number of motions.",
        r"\d[ \u00a0]% over motions|\bintervals?\b",
    ),
    Term(
        "motion",
        "A record of how the ground or a floor shakes, either measured in an earthquake or simulated.",
        r"\bmotions?\b",
    ),
    Term(
        "PGA, PGV",
        "Peak ground acceleration and peak ground velocity: the largest acceleration and velocity of the ground during "
        "an earthquake.",
        r"\bPG[AV]\b|\bpg[av]\b|peak ground",
    ),
    Term(
        "Sa(T)",
        "Spectral acceleration: the largest acceleration of an elastic oscillator with a natural period of T seconds "
        "and 5 % damping that stands on the ground.",
        r"\bSa\(|spectral acceleration",
    ),
    Term("g", "The acceleration of gravity, 9.81 m/s².", r"\d[ \u00a0]g\b|, g\b|\(g\)"),
    Term(
        "once in N years (return period)",
        "The inverse of the mean annual rate. It is a long-term average, not an interval at which events recur: two "
        "may come close together.",
        r"\b[Oo]nce in|[Rr]eturn period",
    ),
    Term(
        "hazard curve",
        "How often a year the shaking at the site exceeds each level. It comes from a seismic hazard analysis of "
        "the site, not from this study.",
        r"\bhazard\b",
    ),
    Term(
        "modelling uncertainty",
        "How far the calculated resistance to overturning may differ from that of the real piece. It is a logarithmic "
        "standard deviation (β_m): with β_m = 0.3, two in three real pieces are within a factor of 1.35 of the "
        "calculated one.",
        r"modelling (uncertainty|dispersion)|β_m|modelling_dispersion",
    ),
    Term(
        "payback",
        "The cost of anchoring a piece divided by the loss that anchoring prevents in an average year.",
        r"\bpayback\b|\bpays back\b",
    ),
    Term(
        "recommendation",
        "Required by code: the building code asks for anchors, whatever the risk. Anchor below code force: the anchors "
        "given are weaker than the code requires. Reduces risk most: the highest priority; safety comes first. Makes "
        "people safer: also a matter of safety, with less effect. Worth its cost: prevents more loss in 50 years than "
        "anchoring costs. Not resolved: these motions are too few to tell whether it does. Small effect: prevents less "
        "loss than that.",
        r"\brecommendations?\b",
    ),
    Term(
        "median",
        "The level of shaking at which half of the motions overturn the block (or bring it to the state that is "
        "studied).",
        r"\b[Mm]edians?\b",
    ),
    Term(
        "dispersion (β)",
        "How much the level of shaking that overturns a block differs from motion to motion: the standard deviation of "
        "its logarithm. With β = 0.4, two motions in three need between the median divided by 1.5 and the median times "
        "1.5.",
        r"\b[Dd]ispersions?\b|\bβ\b(?!_)",
    ),
    Term(
        "fragility curve",
        "The probability that a block overturns (or reaches the state that is studied), as a function of the level of "
        "shaking.",
        r"\b[Ff]ragility\b|(?<!hazard )\bcurves?\b|\bCurves?\b",
    ),
    Term(
        "damping law",
        "The rule by which a rocking block dissipates energy as it passes the upright position or throughout its "
        "motion. Laws idealise the impacts in different ways.",
        r"\blaws?\b",
    ),
    Term(
        "reference law",
        "Housner's rigid block with impacts (1963), which the damping laws approximate.",
        r"\breference law\b",
    ),
    Term(
        "restitution (e, e_R)",
        "The ratio of the angular velocities after and before an impact. e_R = 1 − (2/λ) sin²α follows from the shape "
        "of the block (Housner 1963); λ = I_O/(m R²), 4/3 of a uniform rectangular block.",
        r"\be_R\b|\be=|\b[Rr]estitution\b",
    ),
    Term(
        "δ",
        "Half the width of the zone about the upright position in which a law dissipates energy, as a share of α.",
        r"δ",
    ),
    Term(
        "α, R, p",
        "Slenderness α = arctan(b/h) and size R = √(b² + h²) of a block whose mass centre is b from either edge and h "
        "above the floor; p = √(m g R/I_O), which is √(3g/4R) of a uniform rectangular block, sets how quickly it "
        "rocks.",
        r"α, rad|\bp, rad/s|\bslenderness\b",
    ),
    Term(
        "uplift",
        "A block uplifts when it begins to rock on one edge. It slides instead where the coefficient of "
        "friction is below b/h.",
        r"\b[Uu]plift\w*",
    ),
    Term(
        "elastic mode",
        "A law that is elastic near the upright position lets the block vibrate there, which a rigid block does not.",
        r"\belastic (mode|zone)\b",
    ),
    Term(
        "bootstrap",
        "Repeating the evaluation with motions drawn at random from those that were run, which shows how far a result "
        "depends on their choice.",
        r"\b[Bb]ootstrap\b|\b[Rr]esample\w*",
    ),
    Term(
        "incremental dynamic analysis",
        "Every motion is scaled to every level of shaking, and each block is run under all of them.",
        r"[Ii]ncremental dynamic analysis",
    ),
)
"""Every term, in the order in which a reader meets them."""


def used(texts: Iterable[str], known: Iterable[Term] = ()) -> list[Term]:
    """Return the terms that some texts use, but for those that are `known` already.

    Examples
    --------
    >>> [term.name for term in used(["The median PGA is 0.4 g."])]
    ['PGA, PGV', 'g', 'median']
    """
    text = "\n".join(texts)
    before = set(known)
    return [term for term in TERMS if term not in before and re.search(term.pattern, text)]
