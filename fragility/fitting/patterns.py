"""Patterns of outcomes: in which cells, of a level and a state, the runs of each motion lie.

Motions with the same outcomes share a pattern, so that sums over motions are sums over patterns.
"""

from __future__ import annotations

import hashlib
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.aliases import Index
from ..numerics import slabs

DENSE = 4
"""A table of counts is dense up to this many counts for each run of a slab."""


class Patterns(NamedTuple):
    """Patterns of outcomes; motions with the same outcomes share one.

    `of_cluster` (cluster,) is the pattern of each motion, -1 if it has no run here. `cells[starts[p]:starts[p + 1]]`
    are the cells in which the runs of pattern p lie; `counts` is the number of runs in each.
    """

    of_cluster: Index
    starts: Index
    cells: Index
    counts: Index


class CellCounts:
    """Counts of the runs of each cluster in each cell; keys are cluster * size + cell, increasing."""

    def __init__(self, clusters: int, size: int) -> None:
        self.size = size
        self._dense = np.zeros(clusters * size if clusters * size <= DENSE * slabs.RUNS else 0, np.int64)
        self._keys = np.empty(0, np.int64)
        self._counts = np.empty(0, np.int64)

    def add(self, keys: Index) -> None:
        """Add further runs."""
        if self._dense.size:
            self._dense += np.bincount(keys, minlength=self._dense.size)
            return
        new, counts = np.unique(keys, return_counts=True)
        self._keys, at = np.unique(np.concatenate([self._keys, new]), return_inverse=True)
        counts = np.concatenate([self._counts, counts])
        self._counts = np.zeros(self._keys.size, np.int64)
        np.add.at(self._counts, at, counts)

    @property
    def entries(self) -> tuple[Index, Index]:
        """Keys and counts of the cells with runs."""
        keys = np.flatnonzero(self._dense) if self._dense.size else self._keys
        return keys, self._dense[keys] if self._dense.size else self._counts


class PatternTable:
    """Patterns of outcomes, collected cluster by cluster."""

    def __init__(self, clusters: int) -> None:
        self.of_cluster = np.full(clusters, -1, dtype=np.int64)
        self._numbers: dict[bytes, int] = {}
        self._parts: list[NDArray[np.int32]] = []

    def add(self, cluster: Index, cell: Index, counts: Index) -> None:
        """Add further clusters, in their order, with the number of their runs in each cell."""
        bounds = np.append(np.flatnonzero(np.diff(cluster, prepend=-1)), cluster.size)
        pairs = np.stack([cell.astype(np.int32), counts.astype(np.int32)], axis=1)
        for begin, end in pairwise(bounds.tolist()):
            pattern = pairs[begin:end]
            key = hashlib.blake2b(pattern.data, digest_size=16).digest()
            if key not in self._numbers:
                self._numbers[key] = len(self._numbers)
                self._parts.append(pattern.copy())
            self.of_cluster[cluster[begin]] = self._numbers[key]

    @property
    def patterns(self) -> Patterns:
        """All patterns that were added."""
        starts = np.cumsum([0, *(len(part) for part in self._parts)], dtype=np.int64)
        cells, counts = np.concatenate(self._parts).T.astype(np.int64, order="C")
        return Patterns(self.of_cluster, starts, cells, counts)
