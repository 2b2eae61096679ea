"""Whether the shares and quantiles that draws of pieces give are as far off as their errors say."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

import numpy as np

from ...core.aliases import Array, Flags
from ...core.streams import stream
from ...fragility.curves.means import quantiles, share_error
from ...fragility.numerics.totals import fallen_pieces
from ...fragility.uncertainty.joint import INDEPENDENT, PIECES, Variability, drawn_pieces
from .drawn_studies import Row, row_of

VARIANTS, SEEDS = 16, 200
WANTED = np.array([0.8])
COUNTS, VALUES = (1, 2, 3, 1, 2, 5, 1, 1), (130.0, 90.0, 71.0, 517.0, 233.0, 37.0, 811.0, 307.0)
WIDE = 1.959964


def flags_of(motions: int, seed: int) -> Flags:
    """Return flags (item, variant, motion) of lines whose variants fall as their capacities do."""
    random = stream(seed)
    capacity = 0.4 * random.standard_normal(motions) + 0.5 * random.standard_normal((len(COUNTS), 1, 1))
    capacity = capacity + 0.2 * random.standard_normal((len(COUNTS), VARIANTS, 1))
    return np.asarray(capacity < -0.4)


def fallen(flags: Flags, how: Variability) -> Array:
    """Return how many pieces of each line fall (item, motion, realisation)."""
    lines = enumerate(zip(flags, COUNTS, strict=True))
    drawn = ((fell, drawn_pieces(how, f"line {i}", count, fell.shape[-1])) for i, (fell, count) in lines)
    return np.stack([fallen_pieces(fell[None, :, None], pieces)[0, 0] for fell, pieces in drawn])


def number_at_least(flags: Flags, pieces: str) -> Array:
    """Return the probability of so many pieces or more, from 1 on, given the motions."""
    chance = np.zeros(sum(COUNTS) + 1)
    for chances in flags.mean(axis=1).T:
        number = np.ones(1)
        for p, count in zip(chances, COUNTS, strict=True):
            if pieces == INDEPENDENT:
                for _ in range(count):
                    number = np.convolve(number, [1.0 - p, p])
            else:
                number = np.convolve(number, [1.0 - p, *[0.0] * (count - 1), p])
        chance += number / flags.shape[-1]
    return np.asarray(np.cumsum(chance[::-1])[::-1][1:])


def loss_quantile(flags: Flags) -> float:
    """Return the loss that is not exceeded with the wanted probability where the pieces of a line fall together."""
    chance = flags.mean(axis=1)
    falls = np.array(list(itertools.product([0, 1], repeat=len(COUNTS))))
    loss = falls @ np.multiply(COUNTS, VALUES)
    weight = np.prod(np.where(falls[:, :, None], chance, 1.0 - chance), axis=1).mean(axis=1)
    order = np.argsort(loss)
    return float(loss[order][np.searchsorted(np.cumsum(weight[order]), WANTED[0])])


def rows(full: bool) -> Iterator[Row]:
    """Yield the rows of drawn values; the true value follows from the flags, which are the same for all draws.

    low, high: shares of the seeds whose value ± 1.96 errors lies below and above the true value; length: the mean error
    over the deviation of the values.
    """
    seeds, realisations = (5 * SEEDS, (5, 20, 100)) if full else (SEEDS, (20,))
    for motions, number, pieces in itertools.product((20, 60), realisations, PIECES):
        flags = flags_of(motions, motions)
        draws = (Variability(0.02, 0.0, pieces, VARIANTS, number, seed) for seed in range(seeds))
        every = np.stack([fallen(flags, how) for how in draws])
        truth, total = number_at_least(flags, pieces), every.sum(axis=1)
        text = f"{pieces}, {number} realisations"
        for n in (1, 4):
            at_least = total >= n
            of = at_least.mean(axis=(1, 2)), share_error(at_least)
            yield _row(f"number, {n} or more", text, motions, *of, truth[n - 1])
        if pieces != INDEPENDENT:  # (whose quantile is found by counting all that may fall)
            loss = quantiles(np.einsum("simr,i->smr", every, VALUES), WANTED, np.inf)
            yield _row("loss, quantile", text, motions, loss.value[:, 0], loss.error[:, 0], loss_quantile(flags))


def _row(interval: str, text: str, motions: int, value: Array, error: Array, true: float) -> Row:
    spread = float(value.std())
    ends = value - WIDE * error, value + WIDE * error
    return row_of(interval, text, motions, ends, true, float(error.mean()) / spread if spread > 0.0 else math.nan)
