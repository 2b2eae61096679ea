"""Whether the values that draws of pieces and of their consequences give are as far off as their errors say."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import scipy

from ...aliases import Array, Flags
from ...fragility.uncertainty.joint import INDEPENDENT, PIECES, Variability
from ...models import Block
from ...streams import stream
from ...studies.buildings.outcomes import JointFlags
from ...studies.buildings.variables import DRAWING, Precision, Variables, conditional_variables
from ...studies.inventory.consequences import Consequence, Injury, PieceScores
from ...studies.inventory.contents import Contents, Inventory
from .drawn import Row, row_of

VARIANTS, WANTED = 16, 0.8
COUNTS, VALUES = (1, 2, 3, 1, 2, 5, 1, 1), (130.0, 90.0, 71.0, 517.0, 233.0, 37.0, 811.0, 307.0)
DOWNTIME, INJURY = Consequence(10.0, 0.6), Injury(2.0, 0.3)
MISSED = 1.959964
SEEDS = 200


def inventory(drawn: bool) -> Inventory:
    """Return lines of few pieces with values or, `drawn`, with downtimes and injured persons."""
    block = Block(0.4, 1.8)
    found = []
    for i, (count, value) in enumerate(zip(COUNTS, VALUES, strict=True)):
        line = Contents(f"line {i}", block, 0, count, value=0.0 if drawn else value)
        found.append(replace(line, downtime=DOWNTIME, injury=INJURY) if drawn else line)
    return Inventory(tuple(found))


def flags_of(motions: int, seed: int) -> Flags:
    """Return flags (1, item, variant, 1, motion) of lines whose variants fall as their capacities do."""
    random = stream(seed)
    capacity = 0.4 * random.standard_normal(motions) + 0.5 * random.standard_normal((len(COUNTS), 1, 1))
    capacity = capacity + 0.2 * random.standard_normal((len(COUNTS), VARIANTS, 1))
    return np.asarray((capacity < -0.4)[None, :, :, None])


def studied(of: Inventory, flags: Flags, pieces: str, realisations: int, seed: int) -> Variables:
    """Return the variables given the level, from draws that the seed decides."""
    how = Variability(0.02, pieces=pieces, variants=VARIANTS, realisations=realisations, seed=seed)
    losses = np.array([0.0]) if of.value else np.zeros(0)
    scores = PieceScores(realisations, seed=seed)
    joint = JointFlags(of, flags, np.ones((1, len(of)), bool), losses, how, scores=scores)
    # (of the intervals over motions nothing is asked)
    return conditional_variables(joint, Precision.checked([WANTED], 0.95, 50, 0).over(flags.shape[-1]))


def number_at_least(flags: Flags, pieces: str) -> Array:
    """Return the probability of so many pieces or more, from 1 on, given the motions."""
    chance = flags[0].mean(axis=1)[:, 0]
    found = np.zeros(sum(COUNTS) + 1)
    for p in chance.T:
        number = np.ones(1)
        for q, n in zip(p, COUNTS, strict=True):
            if pieces == INDEPENDENT:
                for _ in range(n):
                    number = np.convolve(number, [1.0 - q, q])
            else:
                number = np.convolve(number, [1.0 - q, *[0.0] * (n - 1), q])
        found += number / flags.shape[-1]
    return np.asarray(np.cumsum(found[::-1])[::-1][1:])


def loss_quantile(flags: Flags) -> float:
    """Return the loss that is not exceeded with the wanted probability where the pieces of a line fall together."""
    chance = flags[0].mean(axis=1)[:, 0]
    falls = np.array(list(itertools.product([0, 1], repeat=len(COUNTS))))
    loss = falls @ (np.array(COUNTS) * VALUES)
    weight = np.prod(np.where(falls[:, :, None], chance, 1.0 - chance), axis=1).mean(axis=1)
    order = np.argsort(loss)
    return float(loss[order][np.searchsorted(np.cumsum(weight[order]), WANTED)])


def drawn_above(flags: Flags, single: float) -> float:
    """Return the probability that one piece or more has what each that falls has with the probability `single`.

    Pieces fall independently, given the motion.
    """
    chance = flags[0].mean(axis=1)[:, 0]
    return float(1.0 - np.prod((1.0 - chance * single) ** np.array(COUNTS)[:, None], axis=0).mean())


def downtime_quantile(flags: Flags) -> float:
    """Return the longest downtime that is not exceeded with the wanted probability, where pieces fall independently."""

    def excess(z: float) -> float:
        return drawn_above(flags, float(scipy.special.ndtr(-z))) - (1.0 - WANTED)

    return float(DOWNTIME.at(np.array(scipy.optimize.brentq(excess, -8.0, 8.0))))


def rows(full: bool) -> Iterator[Row]:
    """Yield the rows of values from draws: the truth is that of the flags, which the draws do not change.

    low, high: shares of the seeds whose value ± 1.96 errors lies below and above the truth.
    """
    seeds, realisations = (5 * SEEDS, (5, 20, 100)) if full else (SEEDS, (20,))
    for motions, number in itertools.product((20, 60), realisations):
        flags = flags_of(motions, motions)
        for pieces in PIECES:
            found = [studied(inventory(False), flags, pieces, number, seed) for seed in range(seeds)]
            truth = number_at_least(flags, pieces)
            text = f"{pieces}, {number} realisations"
            for n in (1, 4):
                name = "number_exceedance"
                yield _row(f"{name}, {n} or more", text, motions, found, name, n - 1, truth[n - 1])
            if pieces != INDEPENDENT:
                yield _row(f"loss_quantile {WANTED:g}", text, motions, found, "loss_quantile", 0, loss_quantile(flags))
        found = [studied(inventory(True), flags, INDEPENDENT, number, seed) for seed in range(seeds)]
        text = f"drawn, {number} realisations"
        injured = drawn_above(flags, -math.expm1(-INJURY.mean))
        yield _row("injuries_exceedance, 1 or more", text, motions, found, "injuries_exceedance", 0, injured)
        at = f"downtime_quantile {WANTED:g}"
        yield _row(at, text, motions, found, "downtime_quantile", 0, downtime_quantile(flags))


def _row(text: str, truth: str, motions: int, found: list[Variables], name: str, at: int, true: float) -> Row:
    value, error = (np.array([one[end].values.ravel()[at] for one in found]) for end in (name, f"{name}{DRAWING}"))
    ends = value - MISSED * error, value + MISSED * error
    spread = float(value.std())
    return row_of(text, truth, motions, ends, true, float(error.mean()) / spread if spread > 0.0 else math.nan)
