"""Predictions of tests from what was known before them: no function here takes an outcome.

Every rule is in docs/experiments.md, and was fixed before a prediction was compared with an outcome.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.stats import binom

from ...core.aliases import Array
from ...core.wording import counted
from ...fragility import ida
from ...fragility.numerics.proportions import interval_of_parts
from ...models import Block, HousnerImpact
from ...models.friction import contact_named
from ...motions.polarity import BOTH
from .ensembles import kinds_of, motions_of, scaled_to_class
from .replays import Replays
from .specimens import blocks_of, law_of, not_sliding
from .table import FRICTION, MEDIAN, OVERTURNED, REPLAY, RESTITUTION, Experiment, Measured

LEVELS = np.geomspace(0.5, 45.0, 90)
"""Peak accelerations at which capacities are looked for, m/s²: 5.2 % apart."""
SURE = 0.95
RATIO_TO_HOUSNER = "restitution over Housner's"
KINETIC = "kinetic friction"


class Prediction(NamedTuple):
    """The value predicted of a test, its 95 % interval (NaN: none), its dispersion, and how; or why there is none."""

    id: str
    value: float
    lower: float
    upper: float
    dispersion: float
    how: str

    @property
    def made(self) -> bool:
        """Whether there is a value."""
        return not math.isnan(self.value)


def predict(experiment: Experiment, replays: Replays | None = None) -> Prediction:
    """Predict a test: a probability of overturning, a median (PGA, m/s²), or the package's own e or friction.

    Replays are predicted where the runs have table motions.
    """
    if not experiment.predicted:
        return _none(experiment, experiment.predict.partition(" ")[2])
    if experiment.predict == REPLAY:
        if replays is None:
            return _none(experiment, "the table motions are not in the project: set TOPPLING_GRANITE to their folder")
        return _replayed(experiment, replays)
    return {OVERTURNED: _overturned, MEDIAN: _median, RESTITUTION: _restitution, FRICTION: _friction}[
        experiment.predict
    ](experiment)


def predict_measured(experiment: Experiment, measured: Measured) -> Prediction:
    """Predict a count or a median again with inputs that were measured, by the same rules for all others.

    ValueError for other quantities, of which restitution and friction are the outcome.
    """
    if experiment.predict not in (OVERTURNED, MEDIAN):
        raise ValueError(f"measured inputs are for {OVERTURNED} and {MEDIAN}, got {experiment.predict!r}")
    prediction = (_overturned if experiment.predict == OVERTURNED else _median)(experiment, measured)
    return prediction._replace(how=f"{prediction.how}; {measured.read}")


def _none(experiment: Experiment, why: str) -> Prediction:
    return Prediction(experiment.id, math.nan, math.nan, math.nan, math.nan, why)


def _overturned(experiment: Experiment, measured: Measured | None = None) -> Prediction:
    """The probability of overturning: the mean over specimens and kinds of motions, all of equal share.

    Every motion is run both ways and is one trial, by the share of its two runs that fall, times the chance that the
    specimen does not slide.  The interval reaches from the least to the greatest end of Wilson's intervals of all
    specimens and kinds: it counts motions and what the description leaves open.
    """
    low, high = (float(level) for level in experiment.levels if level is not None)
    blocks, shares = blocks_of(experiment, measured), []
    for kind in kinds_of(experiment):
        runs = ida(
            blocks,
            law_of(experiment, measured),
            scaled_to_class(kind, low, high),
            [1.0],
            im="scale",
            outputs=("overturned",),
            screen=False,
            polarity=BOTH,
        )
        fallen = np.asarray(runs["overturned"].values[:, 0, 0], dtype=float)
        fallen = fallen.reshape(len(blocks), -1, 2).mean(-1)
        shares += [fell * not_sliding(experiment, block, measured) for fell, block in zip(fallen, blocks, strict=True)]
    lower, upper = interval_of_parts([share.sum() for share in shares], [share.size for share in shares], SURE)
    motions = "motions" if len(kinds_of(experiment)) == 1 else "motions of each of two kinds"
    rests = float(np.mean([not_sliding(experiment, block, measured) for block in blocks]))
    slide = f", times {rests:.2f} not to slide" if experiment.contact else ""
    how = f"{counted(len(blocks), 'specimen')}, {shares[0].size} {motions}, both ways{slide}"
    return Prediction(
        experiment.id,
        float(np.mean([share.mean() for share in shares])),
        float(lower.min()),
        float(upper.max()),
        math.nan,
        how,
    )


def _median(experiment: Experiment, measured: Measured | None = None) -> Prediction:
    """The median over motions and specimens of the least peak acceleration that overturns, and its dispersion.

    The dispersion is half the distance of the quantiles 16 and 84 % of its logarithm.  The interval of the median is
    that of order statistics, from the least to the greatest end of all specimens.
    """
    blocks, law = blocks_of(experiment, measured), law_of(experiment, measured)
    factors = [capacity for kind in kinds_of(experiment) for capacity in capacities(blocks, law, motions_of(kind))]
    ends = [_median_interval(capacity) for capacity in factors]
    pooled = np.sort(np.concatenate(factors))
    middle, low, high = (_quantile(pooled, fraction) for fraction in (0.5, 0.16, 0.84))
    if not math.isfinite(middle):
        return _none(experiment, f"half of the runs stand at {LEVELS[-1]:g} m/s2")
    spread = 0.5 * math.log(high / low) if math.isfinite(high) else math.nan
    how = f"{counted(len(blocks), 'specimen')}, {factors[0].size} motions"
    return Prediction(experiment.id, middle, min(end[0] for end in ends), max(end[1] for end in ends), spread, how)


def capacities(
    blocks: list[Block],
    law: HousnerImpact,
    motions: xr.DataArray | list[xr.DataArray],
    levels: Array = LEVELS,
    im: str = "pga",
) -> list[Array]:
    """Return for every block the least level at which each motion overturns it; infinity where none does."""
    runs = ida(blocks, law, motions, levels, im=im, outputs=("overturned",), screen=False)
    fallen = runs["overturned"].values[:, 0].astype(bool)  # block, level, motion
    return [np.where(flags.any(0), levels[np.argmax(flags, axis=0)], np.inf) for flags in fallen]


def _quantile(ordered: Array, probability: float) -> float:
    """Return the value at a probability, by rank: infinite values stay apart from finite ones."""
    return float(ordered[min(ordered.size - 1, math.floor(probability * ordered.size))])


def _median_interval(values: Array) -> tuple[float, float]:
    """Return the order statistics between which the median lies with at least 95 % probability."""
    ordered, n = np.sort(values), values.size
    rank = int(binom.ppf(0.5 * (1.0 - SURE), n, 0.5))
    return float(ordered[max(rank - 1, 0)]), float(ordered[min(n - rank, n - 1)])


def _restitution(experiment: Experiment) -> Prediction:
    """Housner's value of a uniform block, or 1 where the row is a ratio to it; the default has no interval."""
    if experiment.quantity == RATIO_TO_HOUSNER:
        value, how = 1.0, "the package's default is Housner's value"
    else:
        assert experiment.slenderness is not None
        value, how = Block(1.0, experiment.slenderness).restitution, "Housner's value of a uniform block"
    return Prediction(experiment.id, value, math.nan, math.nan, math.nan, how)


def _friction(experiment: Experiment) -> Prediction:
    """The median of the named contact, times its ratio of kinetic to static friction, with its 95 % range."""
    contact = contact_named(experiment.contact)
    factor = contact.kinetic_ratio if experiment.quantity == KINETIC else 1.0
    low, middle, high = (
        factor * float(mu) for mu in contact.friction.quantile(np.array([0.5 - SURE / 2, 0.5, 0.5 + SURE / 2]))
    )
    return Prediction(experiment.id, middle, low, high, contact.friction.dispersion, f"contact {experiment.contact!r}")


def _replayed(experiment: Experiment, replays: Replays) -> Prediction:
    """The share of the runs of a band that overturn the block: mean and range over its half-widths."""
    fallen = replays.overturned[:, replays.inside(*experiment.levels)]
    shares = fallen.mean(-1)
    how = f"{fallen.shape[-1]} runs replayed with three half-widths"
    return Prediction(experiment.id, float(shares.mean()), float(shares.min()), float(shares.max()), math.nan, how)
