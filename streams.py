"""Random streams: every item draws from one of its own, so that results know neither chunks nor order nor number."""

from __future__ import annotations

import numpy as np


def stream(seed: int, *key: int) -> np.random.Generator:
    """The random stream of the item `key` under `seed`, both >= 0: it depends on these alone.

    Examples
    --------
    >>> bool(stream(1, 7).random() == stream(1, 7).random())
    True
    """
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))
