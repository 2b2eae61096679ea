"""Random streams: every item draws from its own stream.

Results therefore depend neither on the chunks in which items are computed, nor on their order, nor on their number.
"""

import hashlib

import numpy as np


def stream(seed: int, *key: int) -> np.random.Generator:
    """Return the random stream of the item `key` under `seed`, both >= 0; the stream depends on these two alone.

    >>> bool(stream(1, 7).random() == stream(1, 7).random())
    True
    """
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))


def key_of(label: str) -> tuple[int, ...]:
    """Return a key of four numbers for a label, by which an item draws the same whatever else there is.

    >>> len(key_of("shelf"))
    4
    """
    digest = hashlib.sha256(label.encode()).digest()
    return tuple(int.from_bytes(digest[i : i + 4], "little") for i in range(0, 16, 4))
