"""Draws of pieces and of their consequences: events with closed forms given the motions, and the errors beside them."""

import math
from dataclasses import replace

import numpy as np
import pytest

import toppling as tp
from toppling.core.streams import stream
from toppling.fragility.uncertainty.joint import Variability
from toppling.studies.buildings.outcomes import JointFlags
from toppling.studies.buildings.variables import Precision, conditional_variables
from toppling.studies.inventory.consequences import Consequence, Injury, PieceScores
from toppling.studies.inventory.contents import Contents, Inventory

SEEDS = 250
MOTIONS, VARIANTS, COUNTS = 40, 16, (1, 2, 3, 1, 2, 5, 1, 1)


pytestmark = pytest.mark.slow


def flags_of_lines():
    """Flags (line, variant, motion), whose variants fall as their capacities do."""
    random = stream(60)
    capacity = 0.4 * random.standard_normal(MOTIONS) + 0.5 * random.standard_normal((len(COUNTS), 1, 1))
    return capacity + 0.2 * random.standard_normal((len(COUNTS), VARIANTS, 1)) < -0.4


def any_falls(flags, pieces):
    """The probability that any piece falls, given the motions."""
    count = np.array(COUNTS)[:, None] if pieces == "independent" else 1
    return 1.0 - np.prod((1.0 - flags.mean(axis=1)) ** count, axis=0).mean()


FLAGS = flags_of_lines()
DOWNTIME, INJURY = Consequence(10.0, 0.6), Injury(2.0, 0.3)
LINES = tuple(Contents(f"line {i}", tp.Block(0.4, 1.8), 0, count) for i, count in enumerate(COUNTS))


def found(pieces, seed):
    """Variables given the level, but for intervals over motions; of independent pieces with consequences."""
    lines = LINES
    if pieces == "independent":
        lines = tuple(replace(line, downtime=DOWNTIME, injury=INJURY) for line in LINES)
    how = Variability(0.02, pieces=pieces, variants=FLAGS.shape[1], seed=seed)
    members, losses, scores = np.ones((1, len(lines)), bool), np.zeros(0), PieceScores(seed=seed)
    joint = JointFlags(Inventory(lines), FLAGS[None, :, :, None], members, losses, how, scores=scores)
    return conditional_variables(joint, Precision.checked([0.8], 0.95, 50, 0).over(FLAGS.shape[-1]))


@pytest.fixture(scope="module")
def drawn():
    return {pieces: [found(pieces, seed) for seed in range(SEEDS)] for pieces in ("together", "independent")}


def held_to(truth, studies, name):
    """The values are as far from the truth as their errors say."""
    value, error = (
        np.array([one[f"{name}{end}"].values.ravel()[0] for one in studies]) for end in ("", "_sampling_error")
    )
    assert abs(value.mean() - truth) < 3.0 * value.std() / math.sqrt(SEEDS)
    assert error.mean() == pytest.approx(value.std(), rel=0.15)  # (2 to 3 % more, of 2,000 seeds)
    assert (np.abs(value - truth) < 1.96 * error).mean() == pytest.approx(0.95, abs=0.03)


@pytest.mark.parametrize("pieces", ["together", "independent"])
def test_an_event_has_one_probability(drawn, pieces):
    """The share of realisations with any fall, and the probability of any fall."""
    (chance,) = {float(one["any_probability"].values.item()) for one in drawn[pieces]}
    assert chance == pytest.approx(any_falls(FLAGS, pieces), rel=1e-12)
    held_to(chance, drawn[pieces], "number_exceedance")


def test_consequences_of_independent_pieces(drawn):
    """Someone is injured unless no piece that falls injures anyone; a Poisson number of mean 0.6 is 0 in exp(-0.6)."""
    stands = 1.0 - FLAGS.mean(axis=1) * -math.expm1(-0.6)
    held_to(
        1.0 - np.prod(stands ** np.array(COUNTS)[:, None], axis=0).mean(), drawn["independent"], "injuries_exceedance"
    )


def test_the_quantile_of_the_longest_downtime(drawn):
    """At the mean of all quantiles some 80 % of what may fall is not out of use for longer."""
    quantile = np.mean([one["downtime_quantile"].values.item() for one in drawn["independent"]])
    longer = 0.5 * math.erfc(math.log(quantile / 10.0) / (0.6 * math.sqrt(2.0)))
    stays = np.prod((1.0 - FLAGS.mean(axis=1) * longer) ** np.array(COUNTS)[:, None], axis=0).mean()
    assert stays == pytest.approx(0.8, abs=0.003)
    errors = [one["downtime_quantile_sampling_error"].values.item() for one in drawn["independent"]]
    spread = np.std([one["downtime_quantile"].values.item() for one in drawn["independent"]])
    assert 0.9 * spread < np.mean(errors) < 1.3 * spread  # (14 % more, of 2,000 seeds: the greater of two sides)
