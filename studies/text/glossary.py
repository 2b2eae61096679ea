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
        "A range that shows how precisely a result is known from a limited number of motions. With very many motions "
        "of the same kind the result would be expected to lie in it, with the confidence that is stated (95 %). The "
        "range covers no other uncertainty.",
        r"\bintervals?\b",
    ),
    Term(
        "block",
        "The model of a piece: a rigid body that rocks on the edges of its base.",
        r"(?<!rigid )\b[Bb]locks?\b(?!-)",
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
    Term(
        "RotD50",
        "The median of a measure over all horizontal directions, from the two components of a motion, so that it does "
        "not depend on how the instrument was turned.",
        r"\bRotD50\b",
    ),
    Term(
        "RotD100",
        "The largest value of a measure over all horizontal directions, from the two components of a motion.",
        r"\bRotD100\b",
    ),
    Term("g", "The acceleration of gravity, 9.81 m/s².", r"\d[ \u00a0]g\b|, g\b|\(g\)"),
    Term(
        "once in N years (return period)",
        "The average time between two events in the long run, which is the inverse of the mean annual rate. Events do "
        "not keep to it: two may come close together, and none may come for much longer. Once in 500 years is a chance "
        "of about 10 % in 50 years.",
        r"\b[Oo]nce in|[Rr]eturn period",
    ),
    Term(
        "hazard curve",
        "How many times a year, on average, the shaking at the site exceeds each level. It comes from a seismic hazard "
        "analysis of the site, not from this study.",
        r"\bhazard\b",
    ),
    Term(
        "modelling uncertainty",
        "How far the shaking that overturns a real piece may differ from what is calculated for it, because the model "
        "simplifies. It is given as the standard deviation β_m of the natural logarithm of that shaking: with "
        "β_m = 0.3, the calculated value is within a factor of 1.35 of the real one in about two-thirds of cases.",
        r"modelling (uncertainty|dispersion)|β_m|modelling_dispersion",
    ),
    Term(
        "payback",
        "The years after which the loss that anchoring prevents has paid what it costs, with later savings discounted "
        "at the rate that stands beside it: a saving next year at 4 % is worth 1/1.04 of one today, and 50 years of "
        "savings are worth some 21 of them. Never: the saving of a year is no more than a year's interest on the cost; "
        "“at best” is the payback of the upper end of the saving's interval, where that decides. A dash: the cost or "
        "the value is not given, or the chance of falling is no ground for advice.",
        r"\bpayback\b|\bpays back\b",
    ),
    Term(
        "recommendation",
        "What anchoring a piece does. Required by code: the building code requires anchors, whatever the risk. Anchor "
        "below code force: the anchors given are weaker than the code requires. Reduces risk most: the pieces that "
        "together make up four fifths of the expected falls that endanger people (of the expected injuries, where the "
        "inventory gives these; of the expected loss, where no piece endangers people). Makes people safer: the other "
        "pieces that endanger people, however rarely they fall. Reduces loss most, prevents "
        "most other falls: the same share of the loss, or of the falls, of pieces that endanger nobody. Worth its "
        "cost: prevents more loss in 50 years, discounted, than anchoring costs. Not resolved: these motions cannot "
        "show whether it does. Small effect: prevents less loss than it costs, or little of it. Little money saved "
        "(few falls prevented); danger to people not stated: the same, of a piece of which the inventory does not say "
        "whether its fall can harm people, so that it is not known to be harmless. Fix before what stands on it: it "
        "slides or rocks while something on it falls. Indicative only: what it stands on moves itself, so that its own "
        "chance is uncertain. Outside the model: too squat to rock, so that its chance is no ground for advice.",
        r"\brecommendations?\b",
    ),
    Term(
        "half level",
        "The level of shaking at which half of the motions overturn the block (or bring it to the state that is "
        "studied), read off the runs themselves.",
        r"\bhalf (?:levels?|fall|at\b|of the (?:runs|motions))",
    ),
    Term(
        "fitted curve, median",
        "The lognormal curve through the runs of all levels, from which rates follow, and the level at which it passes "
        "50 %. Where the runs are not lognormal, its median is not the level at which half of them fall.",
        r"\b[Mm]edians?\b|\bfitted curves?\b",
    ),
    Term(
        "dispersion (β)",
        "How much the level of shaking that overturns a block (or brings it to the state that is studied) varies from "
        "motion to motion: the standard deviation of its logarithm. With β = 0.4, about two-thirds of the motions do "
        "so at a level within a factor of 1.5 of the fitted median.",
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
        "The coefficient of restitution e is the angular velocity of a block just after an impact divided by that just "
        "before it. Housner (1963) derived e_R = 1 − (2/λ) sin²α from the shape of a rigid block, where λ = I_O/(m R²) "
        "is its moment of inertia about an edge over its mass times R²; λ is 4/3 for a uniform rectangular block.",
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
        "Every motion is scaled to several levels of shaking, and each block is run under all of them. Levels are the "
        "same for all motions, or, at adaptive levels, a few of each motion's own.",
        r"[Ii]ncremental dynamic analysis",
    ),
)
"""Every term, in the order in which a reader meets them."""


def used(texts: Iterable[str], known: Iterable[Term] = ()) -> list[Term]:
    """Return the terms that some texts use, but for those that are `known` already."""
    text = "\n".join(texts)
    before = set(known)
    return [term for term in TERMS if term not in before and re.search(term.pattern, text)]
